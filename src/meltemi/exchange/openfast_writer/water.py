"""Files of a deck for offshore turbines: SeaState, HydroDyn, SubDyn, MoorDyn, potential-flow coefficients.

Reader and writer share the table of keywords.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.exchange.openfast.mooring import BED_FRICTION
from meltemi.exchange.openfast.tower import SPRINGS
from meltemi.exchange.openfast.water import DRIFTS, FULL_DRIFT, STRETCHINGS
from meltemi.exchange.openfast_writer.template import by_target, fill, matrix, rows_of
from meltemi.floating.coefficients import platform_coefficients
from meltemi.floating.members import Member
from meltemi.floating.moorings import at_rest
from meltemi.floating.platform import Platform
from meltemi.frames.definition import Frame
from meltemi.frames.water import coefficients_of, sections_of
from meltemi.hydro.wamit import wamit_texts
from meltemi.sea.conditions import Sea
from meltemi.sea.support import Hydrodynamics, Support
from meltemi.turbine.definition import Foundation

Float = NDArray[np.float64]
Report = Callable[[str, str], None]
WAVES, POTENTIAL, GROUND = "Waves.txt", "HydroData/platform", "Ground.dat"
"""Files beside the deck: waves, common name of the coefficients, springs under a pile."""
PIECE, SHORT, LONGEST = 2.0, 1.0, 2.5
"""[m] longest piece of a platform's member and of a pile in HydroDyn, and of a pile in SubDyn."""
NEAR, STEP = 0.01, 0.001
"""[m] stations of a pile that are one to the water; from the edge of growth to the table's row."""
SAME = 1e-3
"""[m] change of the diameter that is none."""
WALL = 0.01
"""Wall over the diameter of members, which are not flooded: HydroDyn wants one."""
SOLVER = {"kbot": 3e6, "cbot": 3e5, "dtIC": 1.0, "TmaxIC": 60.0, "CdScaleIC": 4.0, "threshIC": 0.001}
"""Options of MoorDyn: stiffness [Pa/m] and damping [Pa s/m] of the sea bed, and of the search for equilibrium."""
BELOW = 0.1
"""[m] extension of a pile below the bed in HydroDyn, so that water pressure does not act on its end."""
MOST_OUTPUTS = 9
STEP_OF_LINE = 0.2
"""Time step of MoorDyn over that in which tension crosses a segment."""
FEWEST_SEGMENTS = 30
WIDER = 10.0
"""[m] width of the field of waves beyond the platform."""
BESIDE, SPACING = 2.0, 2.0
"""[m] width of the field of waves beyond a frame, and distance of its points, between which waves are interpolated."""
REACH, PLACES = 50.0, 16
"""[m] additional width for a displaced platform, and points along either axis there."""
SAMPLE = 0.25
"""[s] time step of the waves, at most; SeaState halves it."""


def sea_state(
    texts: dict[str, str],
    title: str,
    sea: Sea,
    duration: float,
    below: Support | Frame | Platform,
) -> None:
    """Add SeaState, and a file of all single waves (WaveMod 7), so that OpenFAST has the same waves.

    Args:
      duration: [s] simulated time.
      below: the support structure in the water.

    Raises:
      UnsupportedError: waves that are not periodic, a tabulated current.
    """
    values: dict[str, float | str] = {}
    platform = below if isinstance(below, Platform) else None
    waves = sea.components(below.depth + sea.level, duration)
    if platform is not None:
        values["drift_cutoff"] = platform.drift_cutoff
        if sea.level:
            raise UnsupportedError(
                f"sea.level: {sea.level:g} m: HydroDyn's platforms float at mean sea level; add it to depth"
            )
    if len(waves.frequency):
        if waves.period is None:
            raise UnsupportedError("sea: OpenFAST has waves whose frequencies are multiples of one; these are not")
        rows = np.column_stack(
            [waves.frequency, 2.0 * np.abs(waves.amplitude), *np.degrees([waves.direction, np.angle(waves.amplitude)])]
        )
        head = "! frequency (rad/s)  height (m)  direction (deg)  phase (deg)"
        texts[WAVES] = "\n".join([head, *(" ".join(f"{x:.12g}" for x in row) for row in rows)]) + "\n"
        values |= {"waves": 7, "wave_file": WAVES, "repeat": waves.period}
        values |= {"stretching": STRETCHINGS.index(sea.stretching)}
    if (current := sea.current) is not None:
        if current.height is not None:
            raise UnsupportedError("sea.current: SeaState has no table of the current; give its parts")
        values["current"] = 1
        for name in ("sub_surface", "near_surface", "uniform"):
            values |= {name: getattr(current, name), f"{name}_direction": current.direction}
        values["reference_depth"] = current.reference_depth
    if (thick := _thick(below)) and len(waves.frequency):
        values["diffraction_radius"] = thick  # a diameter (Morison.f90, Waves.f90 of 5.0.0), other than its manual says
    written = by_target("SeaState", values)
    wet = [] if platform is None else loaded_members(platform)
    displaced = platform is not None and platform.excitation == "displaced"
    if wet or displaced:  # waves are interpolated between points in steps of a fourth of this width
        width = float(np.abs([0.0, *(x for m in wet for x in (*m.start[:2], *m.end[:2]))]).max()) + WIDER
        written |= {"X_HalfWidth": width, "Y_HalfWidth": width, "NX": 5, "NY": 5}
        if displaced:
            written |= {"X_HalfWidth": width + REACH, "Y_HalfWidth": width + REACH, "NX": PLACES, "NY": PLACES}
            written |= {} if wet else {"NZ": 2}
    if isinstance(below, Frame):
        width = float(np.abs([place[:2] for place in below.joints.values()]).max()) + BESIDE
        n = 1 + 2 * math.ceil(width / max(SPACING, width / PLACES))
        written |= {"X_HalfWidth": width, "Y_HalfWidth": width, "NX": n, "NY": n}
    if len(waves.frequency):
        written["WaveDT"] = min(SAMPLE, 1.5 / float(waves.frequency.max()))
    texts["SeaState.dat"] = fill("SeaState", title, written, {"channels": ["Wave1Elev"]})


def _thick(below: Support | Frame | Platform) -> float:
    """[m] diameter of members that diffract the waves, or 0.

    Raises:
      UnsupportedError: they have several diameters, or growth.
    """
    if isinstance(below, Support):
        return float(below.diameter[0]) if below.hydrodynamics.diffraction == "maccamy_fuchs" else 0.0
    if not isinstance(below, Frame):
        return 0.0
    diameters = set()
    for member in below.members.values():
        if member.kind == "beam" and coefficients_of(below, member).diffraction == "maccamy_fuchs":
            diameters |= {each.breadth for each in sections_of(below, member)}
    if len(diameters) > 1 or (diameters and below.growth):
        raise UnsupportedError(
            "frame.hydrodynamics.diffraction: OpenFAST has diffraction by cylinders of one diameter, without growth"
        )
    return max(diameters, default=0.0)


def hydrodyn(title: str, values: dict[str, float | str], tables: dict[str, list[str]]) -> str:
    """Text of the HydroDyn file; the numbers of rows follow from its tables."""
    zero, count = np.zeros((6, 6)), {name: len(tables.get(table, ())) for name, table in COUNTED.items()}
    whole = {name: matrix(name, zero) for name in MATRICES} | {"AddF0": matrix("AddF0", zero[:, :1])}
    whole |= {"simple": rows_of([[0.0] * 14]), "simple_rectangles": rows_of([[0.0] * 18])} | tables
    channels = "HydroFxi HydroFyi HydroFzi HydroMxi HydroMyi HydroMzi".split()
    return fill("HydroDyn", title, by_target("HydroDyn", values) | count, whole | {"channels": channels})


COUNTED = {
    "NAxCoef": "axial",
    "NJoints": "joints",
    "NPropSetsCyl": "sections",
    "NPropSetsRec": "rectangles",
    "NCoefDpthCyl": "by_depth",
    "NCoefMembersCyl": "by_member",
    "NCoefMembersRec": "by_member_rectangles",
    "NMembers": "members",
    "NFillGroups": "fills",
    "NMGDepths": "growth",
}
MATRICES = {"AddCLin": "stiffness", "AddBLin": "linear_damping", "AddBQuad": "quadratic_damping"}
"""Matrices of HydroDyn and of a platform."""


def pile_water(title: str, pile: Support) -> str:
    """Text of the HydroDyn file of a pile.

    Raises:
      UnsupportedError: waves diffracted by a pile that is no cylinder, which OpenFAST cannot represent.
    """
    z, water = pile.position, pile.hydrodynamics
    bottom = max(float(z[0]), -pile.depth) - BELOW
    joints = [bottom, *(b for a, b in pairwise(z.tolist()) if b - max(a, bottom) > NEAR)]
    # no joint where only the wall changes: OpenFAST's buoyancy allows no joint in the waves
    x = np.array(joints)
    d = [np.interp(x + step, z, pile.diameter) for step in (-1.0, -NEAR, NEAR, 1.0)]
    bent = np.abs((d[1] - d[0]) - (d[3] - d[2])) + np.abs(d[2] - d[1]) > SAME
    joints = [joints[0], *x[1:-1][bent[1:-1]].tolist(), joints[-1]]
    ends = [x for a, b in pairwise(joints) for x in (a + NEAR, b - NEAR)]
    n = len(joints) - 1
    drag, added, pressure = (np.broadcast_to(np.asarray(c, dtype=np.float64), z.shape) for c in _of_wave(water))
    diffracts = water.diffraction == "maccamy_fuchs"
    if diffracts and (np.ptp(pile.diameter) > NEAR or pile.growth):
        raise UnsupportedError(
            "support.hydrodynamics.diffraction: OpenFAST has diffraction by a cylinder of one diameter, without growth"
        )
    by_depth = [
        [x, d, d, a, a, *(["MCF"] * 2 if diffracts else [p, p]), 0.0, 0.0, 0.0, 0.0, p, p, 1.0, 1.0]
        for x, d, a, p in zip(*(c[::-1].tolist() for c in (z, drag, added, pressure)), strict=True)
    ]
    single = all(row[1:] == by_depth[0][1:] for row in by_depth)
    coefficients = {"simple": rows_of([by_depth[0][1:]])} if single else {"by_depth": rows_of(by_depth)}
    numbers = range(1, n + 1)
    # one mean wall thickness in the water: OpenFAST's moments of water inside a cone are wrong
    wall = float(np.mean(np.interp(np.linspace(joints[0], min(0.0, joints[-1]), 101), z, pile.thickness)))
    grown = sorted(pile.growth, key=lambda each: -each.top)
    tables = coefficients | {
        "axial": rows_of([[1, 0.0, 0.0, 0.0, 0, 0.0, 1.0]]),
        "joints": rows_of([i + 1, 0.0, 0.0, x, 1, 0] for i, x in enumerate(joints)),
        "sections": rows_of([i + 1, float(np.interp(x, z, pile.diameter)), wall] for i, x in enumerate(ends)),
        "members": rows_of(
            [i, i, i + 1, 2 * i - 1, 2 * i, 1, 0, SHORT, 1 if single else 2, 1, "False"] for i in numbers
        ),
        "fills": [] if pile.flooded is None else rows_of([[n, *numbers, pile.flooded, pile.water_density]]),
        "growth": rows_of(
            [x, each.thickness, each.density] for each in grown for x in (each.top - STEP, each.bottom + STEP)
        ),
    }
    return hydrodyn(title, {"potential": 0}, tables)


def _of_wave(water: Hydrodynamics) -> tuple[float | Float, float | Float, float | Float]:
    return water.drag, water.added_mass, water.pressure


def ground_text(stiffness: Float, mass: Float) -> str:
    """Text of the file of springs and mass (6, 6) under a foot."""
    lines = [
        f"{value[i, j]:.12g}  {letter}{SPRINGS[i]}{SPRINGS[j]}"
        for letter, value in (("K", stiffness), ("M", mass))
        for j in range(6)
        for i in range(j + 1)
    ]
    return "\n".join(lines) + "\n"


def pile_structure(
    texts: dict[str, str], title: str, pile: Support, foundation: Foundation | None, first: float
) -> None:
    """Add SubDyn for a pile that is clamped or on springs at its foot.

    Args:
      first: [rad/s] first natural frequency of the turbine, at which the damping ratio of the steel applies.

    Raises:
      UnsupportedError: nonlinear soil springs.
    """
    if pile.soil is not None:
        raise UnsupportedError(
            "support.soil: SubDyn has springs under the foot only; give foundation.stiffness instead"
        )
    z = pile.position
    joints = [float(z[0])]
    for a, b in pairwise(z.tolist()):
        joints += np.linspace(a, b, 1 + math.ceil((b - a) / LONGEST - 1e-9))[1:].tolist()
    heights = [float(x) for x in (*pile.load_stations, *(each.height for each in pile.masses))]
    joints = sorted({*joints, *(x for x in heights if np.abs(np.array(joints) - x).min() > NEAR)})
    near = [int(np.abs(np.array(joints) - x).argmin()) + 1 for x in heights]
    material = (pile.elastic_modulus, pile.shear_modulus, pile.density)
    outputs = sorted(set(near[: len(pile.load_stations)]) - {len(joints)})[:MOST_OUTPUTS]
    free = foundation is not None
    if foundation is not None:
        texts[GROUND] = ground_text(foundation.matrix("stiffness"), foundation.matrix("mass"))
    tables = {
        "rayleigh": rows_of([[0.0, 2.0 * pile.damping / first, "RayleighDamp"]]),
        "guyan": rows_of(np.zeros((6, 6)).tolist()),
        "offset": rows_of([[0.0] * 6]),
        "NJoints": rows_of([i + 1, 0.0, 0.0, x, 1, 0.0, 0.0, 0.0, 0.0] for i, x in enumerate(joints)),
        "NReact": rows_of([[1, *[int(not free)] * 6, f'"{GROUND if free else ""}"']]),
        "NInterf": rows_of([[len(joints), *[1] * 7]]),
        "NMembers": rows_of([i, i, i + 1, i, i + 1, "1c", 0] for i in range(1, len(joints))),
        "NPropSetsCyl": rows_of(
            [i + 1, *material, float(np.interp(x, z, pile.diameter)), float(np.interp(x, z, pile.thickness))]
            for i, x in enumerate(joints)
        ),
        "NCmass": rows_of(
            [joint, each.mass, each.inertia, each.inertia, each.about_axis, *[0.0] * 6]
            for joint, each in zip(near[len(pile.load_stations) :], pile.masses, strict=True)
        ),
        "NMOutputs": rows_of([joint, 1, 1] for joint in outputs),
        "channels": [
            *("ReactFXss ReactFYss ReactFZss ReactMXss ReactMYss ReactMZss".split()),
            *(f"M{i + 1}N1{name}" for i in range(len(outputs)) for name in ("FKxe", "FKye", "MKxe", "MKye")),
        ],
    }
    texts["SubDyn.dat"] = subdyn(title, {}, tables)


def subdyn(title: str, values: dict[str, object], tables: dict[str, list[str]]) -> str:
    """Text of the SubDyn file; tables with a number of rows are named by its keyword."""
    return fill("SubDyn", title, values | {name: len(rows) for name, rows in tables.items() if name[0] == "N"}, tables)


def loaded_members(platform: Platform) -> list[Member]:
    """Members with hydrodynamic loads; those within potential flow only serve for drawings."""
    forces = "drag added_mass pressure plate_drag plate_added_mass plate_pressure".split()
    return [m for m in platform.members if not platform.coefficients or any(getattr(m, name) for name in forces)]


def platform_water(texts: dict[str, str], title: str, platform: Platform, lost: Report) -> None:
    """Add HydroDyn for a platform: potential flow with or without members, or members only.

    Raises:
      UnsupportedError: additional matrices without potential flow, which HydroDyn reads only with it.
    """
    given = {name: getattr(platform, key) for name, key in MATRICES.items()}
    tables = {name: matrix(name, value) for name, value in given.items() if value is not None}
    members, flows = loaded_members(platform), bool(platform.coefficients)
    if len(members) < len(platform.members):
        lost("members", "HydroDyn gets those with forces; the others are for pictures")
    values: dict[str, float | str] = {"potential": int(flows)}
    if flows:
        texts |= {POTENTIAL + end: text for end, text in wamit_texts(platform_coefficients(platform)).items()}
        values |= {"potential_file": POTENTIAL, "volume": platform.volume}
        values |= dict(zip(("buoyancy_x", "buoyancy_y"), platform.buoyancy_centre, strict=True))
        values |= {key: FULL_DRIFT for key, drift in DRIFTS if drift == platform.drift}
        values["sum_forces"] = FULL_DRIFT * platform.sum_forces
        values["excitation_place"] = int(platform.excitation == "displaced")
    elif tables:
        raise UnsupportedError(f"platform.{MATRICES[next(iter(tables))]}: HydroDyn has it with potential flow only")
    if any(each.plate_drag for each in members):
        lost("heave plates", "drag of a plate is one half on either side: AxCd is twice plate_drag")
    tables["axial"] = rows_of(
        [
            [1, 0.0, 0.0, 0.0, 0, 0.0, 1.0],
            *(
                [i + 2, 2.0 * m.plate_drag, m.plate_added_mass, m.plate_pressure, 0, 0.0, 1.0]
                for i, m in enumerate(members)
            ),
        ]
    )
    tables["joints"] = rows_of(
        [2 * i + k + 1, *end.tolist(), i + 2 if k == 0 else 1, 0]
        for i, m in enumerate(members)
        for k, end in enumerate((m.start, m.end))
    )
    tables["sections"] = rows_of(
        [2 * i + k + 1, d, WALL * d] for i, m in enumerate(members) for k, d in enumerate(m.diameters)
    )
    tables["by_member"] = rows_of(
        [i + 1, *[m.drag] * 4, *[m.added_mass] * 4, *[m.pressure] * 4, *[0.0] * 8, *[m.pressure] * 4, *[1.0] * 4]
        for i, m in enumerate(members)
    )
    tables["members"] = rows_of(
        [i, 2 * i - 1, 2 * i, 2 * i - 1, 2 * i, 1, 0, PIECE, 3, 1, str(flows)] for i in range(1, len(members) + 1)
    )
    texts["HydroDyn.dat"] = hydrodyn(title, values, tables)


def mooring(title: str, platform: Platform) -> str:
    """Text of the MoorDyn file.

    Raises:
      UnsupportedError: lines with different seabed friction.
    """
    lines = platform.lines
    segments = platform.segments if platform.line_model == "dynamic" else FEWEST_SEGMENTS
    if len({line.friction for line in lines}) > 1:
        raise UnsupportedError("platform.lines: MoorDyn has one friction of the bed for all lines")
    kinds = [
        (e.diameter, e.mass, e.stiffness, -e.damping_ratio, 0.0, e.drag, e.added_mass, e.axial_drag, e.axial_added_mass)
        for e in lines
    ]
    types = list(dict.fromkeys(kinds))
    crossed = min(line.length / segments * math.sqrt(line.mass / line.stiffness) for line in lines)
    settings = {"dtM": float(f"{STEP_OF_LINE * crossed:.1g}")} | SOLVER
    if lines[0].friction:
        settings |= dict.fromkeys(BED_FRICTION, lines[0].friction)
    n, rest = range(1, len(lines) + 1), at_rest(lines, platform.points, platform.depth, platform.water_density)
    points: list[list[object]] = []
    joints: dict[str, int] = {}
    ends = []
    for line, upper, lower in zip(lines, rest.upper, rest.lower, strict=True):
        both = []
        for what, end, place in (("Vessel", line.fairlead, upper), ("Fixed", line.anchor, lower)):
            if isinstance(end, str):
                joint = platform.points[end]
                kind, properties = "Free", [joint.mass, joint.volume, joint.drag_area, joint.added_mass]
            else:
                kind, properties = what, [0.0] * 4
            if not isinstance(end, str) or end not in joints:
                points.append([len(points) + 1, kind, *place.tolist(), *properties])
            both.append(joints.setdefault(end, len(points)) if isinstance(end, str) else len(points))
        ends.append(both)
    tables = {
        "types": rows_of([f"kind{i + 1}", *kind] for i, kind in enumerate(types)),
        "points": rows_of(points),
        "lines": rows_of(
            [i, f"kind{types.index(kind) + 1}", low, up, line.length, segments, "-"]
            for i, line, kind, (up, low) in zip(n, lines, kinds, ends, strict=True)
        ),
        "options": rows_of([value, name] for name, value in settings.items()),
        "channels": [f"FairTen{i}" for i in n],
    }
    return fill("MoorDyn", title, {}, tables)
