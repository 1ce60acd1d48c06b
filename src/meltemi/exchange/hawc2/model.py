"""A HAWC2 model as a turbine, with the equivalent model options and case.

Axes, signs and approximations: docs/migrate/hawc2.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.yamlfile import validated
from meltemi.exchange.hawc2.bodies import INERTIAL, Body, Lump, read_bodies, rotation
from meltemi.exchange.hawc2.control import read_control
from meltemi.exchange.hawc2.htc import Block, Treatment, notes_on, read_htc
from meltemi.exchange.hawc2.roles import assign_roles, is_about, other_blades
from meltemi.exchange.hawc2.sections import at_elastic_centre, read_planform, read_polars, turned_centres
from meltemi.exchange.hawc2.start import read_start
from meltemi.exchange.hawc2.wind import read_wind
from meltemi.exchange.openfast.deck import LEAST_YAW_FREQUENCY, supplement
from meltemi.exchange.openfast.tower import STEEL_SPEED
from meltemi.exchange.report import ImportedModel, Notes
from meltemi.exchange.windio.polars import NO_STALL, by_thickness
from meltemi.turbine.definition import Turbine
from meltemi.turbine.plausibility import bending_frequency

Float = NDArray[np.float64]
SECTION = np.kron(np.eye(2), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
"""(6, 6) our axes of a section, x to the suction side and y to the trailing edge, from HAWC2's."""
RIGID_TORSION = 1e13
"""[N m/rad] torsional stiffness of a shaft above which it is rigid for any turbine."""
OVERDAMPED = 0.99
"""Largest damping ratio of a tower: stiffer or more damped ones do not swing at all."""
BESIDE = 0.01
"""[m] distance between two definitions of a centre of mass above which a note reports it."""
BOUND = 0.5
"""Share of the torsional compliance from the generator to the hub; what lies beyond turns with the hub."""


@dataclass(frozen=True, eq=False)
class ModelBodies:
    """Bodies of a model by their role in the turbine.

    Attributes:
      foundation: bodies below the tower.
      bearing: the block of the shaft's bearing.
      nacelle: bodies between tower and shaft.
      hub: bodies between shaft and blade.
      down: (3,) direction of the shaft, downwind, inertial axes.
    """

    foundation: list[Body]
    tower: Body
    nacelle: list[Body]
    shaft: Body
    hub: list[Body]
    blade: Body
    down: Float
    bearing: Block

    @property
    def apex(self) -> Float:
        """(3,) [m] last node of the shaft, inertial axes."""
        return self.shaft.place(self.shaft.nodes[-1, :3])

    @property
    def top(self) -> Float:
        """(3,) [m] tower top, inertial axes."""
        return self.tower.place(self.tower.nodes[-1, :3])


def read_hawc2_model(path: str | Path, **how: Any) -> Turbine:
    """Read the turbine of a HAWC2 model; see :func:`import_hawc2` for arguments and errors."""
    return import_hawc2(path, **how).turbine


@np.errstate(all="ignore")  # the record reports values that are not finite by their name
def import_hawc2(
    path: str | Path, *, control_of: Turbine | None = None, extra: Mapping[str, Any] | None = None
) -> ImportedModel:
    """Read a HAWC2 model: main file (.htc), sections (st), planform (ae), polars (pc), DTU controller.

    Args:
      path: the main file.
      control_of: a turbine whose control, pitch actuator and rated power are taken, for models with another controller.
      extra: key paths and values that supplement or replace those of the model: ``{"yaw.stiffness": 6e9}``.

    Raises:
      InputError: the model is not valid, with file, line, command and what was expected; or the missing data, as key
        paths for ``extra``.
      UnsupportedError: the model has a named feature that is not supported.
    """
    path = Path(path)
    root = read_htc(path)
    treatment = Treatment()
    notes = Notes()
    structure, aero = root.block("new_htc_structure"), root.block("aero")
    count = int(aero.value("nblades", 3.0))
    link = next((c for c in aero.all("link") if c.values[:1] == ("1",) and len(c.values) > 2), None)
    if link is None:
        raise InputError(f"{aero.where}: expected: link 1 mbdy_c2_def NAME, the body of blade 1")
    parts = _parts(read_bodies(structure, path, link.word(2)), root, aero)
    # the nacelle points along x here: rotating the rotor about the vertical is equivalent to rotating the wind
    yaw = math.atan2(parts.down[1], parts.down[0])
    ground = INERTIAL
    if abs(yaw) > 1e-9:
        ground = rotation(np.array([0.0, 0.0, 1.0]), -yaw) @ INERTIAL
        parts = _parts(read_bodies(structure, path, link.word(2), ground), root, aero)
        what = f"{math.degrees(yaw):.4g} deg about the vertical"
        notes.add("approximated", parts.shaft.joint.where, what, "the model is turned back, with its wind")
    alike = other_blades(structure, aero, path, parts.blade, parts.down, count, notes)
    chain = {
        "foundation": parts.foundation,
        "tower": [parts.tower],
        "rigid": parts.nacelle + parts.hub,
        "shaft": [parts.shaft],
        "blade": [parts.blade],
    }
    assign_roles(root, chain, alike, control_of is not None, treatment)
    data: dict[str, Any] = {"name": path.stem, "source": f"HAWC2 model {path.name}", "n_blades": count}
    data |= read_control(root.find("dll"), path, notes, treatment, control_of, extra or {})
    blade, airfoils = _blade(parts.blade, aero, path, notes)
    data |= {"blade": blade, "airfoils": airfoils, "tower": _tower(parts.tower, root, treatment, notes)}
    data |= _rotating(parts, count, data["drivetrain"], notes)
    inertia = max(data["nacelle"]["yaw_inertia"], 1.0)
    stiffness = LEAST_YAW_FREQUENCY**2 * inertia
    data["yaw"] = {"stiffness": stiffness, "damping": 0.02 * stiffness / LEAST_YAW_FREQUENCY}
    notes.add("approximated", "yaw bearing", "clamped", "yaw frequency 2 Hz, damping ratio 1 %")
    supplement(data, control_of, extra or {}, notes)
    try:
        turbine = validated(data, Turbine, str(path))
    except InputError as error:
        hint = "without the DTU Wind Energy Controller, give control_of=..., or extra={...} with these keys"
        raise InputError(f"{error}\n{hint}; to `meltemi import`: --control-of, --extra") from None
    wind = root.find("wind")
    case = read_wind(wind, path, yaw, treatment, notes)
    beyond = [*parts.hub, parts.blade]
    carrier = [parts.tower, *parts.nacelle][-1]
    start = read_start(parts.bearing, ground, carrier, parts.shaft, beyond, parts.down, treatment)
    return ImportedModel(
        turbine,
        (*notes_on(root, treatment), *notes),
        options=_options(aero, wind, structure, parts, turbine),
        environment={"air_density": wind.value("density", 1.225)},
        wind=case,
        duration=root.find("simulation").value("time_stop", 60.0),
        start=start,
    )


def _parts(chain: list[Body], root: Block, aero: Block) -> ModelBodies:
    constraint = root.block("new_htc_structure").block("constraint")
    names = [b.name for b in chain]
    rotating = {b.need("mbdy2").word(): b for b in constraint.within("bearing1", "bearing3")}
    place = next((i for i, name in enumerate(names) if i and name in rotating), None)
    if place is None or place > len(chain) - 2:
        raise InputError(f"{constraint.where}: no bearing1 or bearing3 of a body between tower and blade: the shaft")
    # the body that casts the tower's shadow, or the longest one below the shaft
    shadows = [b.need("tower_mbdy_link").word() for b in root.find("wind").blocks if b.get("tower_mbdy_link")]
    linked = [name for name in shadows if name in names[:place]]
    longest = max(range(place), key=lambda i: float(chain[i].arc[-1]))
    base = names.index(linked[0]) if len(set(linked)) == 1 else longest
    shaft = chain[place]
    hub_vec = aero.get("hub_vec")
    if hub_vec is not None and (hub_vec.word() != shaft.name or hub_vec.numbers(1, 1)[0] != -3.0):
        raise UnsupportedError(f"{hub_vec.where}: hub_vec: only {shaft.name} -3, a rotor that turns clockwise, is read")
    along = shaft.nodes[0, :3] - shaft.nodes[-1, :3]
    down = shaft.axes @ (along / np.linalg.norm(along))
    for body in (chain[base], chain[-1]):
        if not 0.98 * body.arc[-1] < body.sections.given:
            end = f"the sections of {body.name} end at {body.sections.given:g} m, its axis at {body.arc[-1]:g} m"
            raise InputError(f"{body.block.where}: {end}")
    return ModelBodies(
        foundation=chain[:base],
        tower=chain[base],
        nacelle=chain[base + 1 : place],
        shaft=shaft,
        hub=chain[place + 1 : -1],
        blade=chain[-1],
        down=np.sign(down[0]) * down,
        bearing=rotating[shaft.name],
    )


def _blade(body: Body, aero: Block, path: Path, notes: Notes) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Content of ``Turbine.blade`` and ``Turbine.airfoils``."""
    arc, sections = body.arc, body.sections
    line = Akima1DInterpolator(arc, body.nodes - np.append(body.nodes[0, :3], 0.0))

    def half_chord(s: Float) -> tuple[Float, Float, Float, Float]:
        """Prebend, sweep and height [m], and twist [rad], in the axes of meltemi."""
        x, y, z, twist = line(s).T
        return y, -x, z, -np.radians(twist)

    # the beam runs through the elastic centres
    stiffness, mass, centre = at_elastic_centre(sections.stiffness, sections.mass)
    x, y, z, twist = half_chord(sections.span)
    c, s = np.cos(twist), np.sin(twist)
    flap, edge = centre[:, 1], -centre[:, 0]
    structure = {
        "position": z,
        "twist": twist,
        "axis_x": x + c * flap + s * edge,
        "axis_y": y - s * flap + c * edge,
        "stiffness_matrix": SECTION @ stiffness @ SECTION.T,
        "mass_matrix": SECTION @ mass @ SECTION.T,
        # the factors belong to deflections along x, along y and to torsion
        "damping_time": dict(zip(("edge", "flap", "torsion"), body.damping[3:], strict=True)),
    }
    ae, pc = aero.need("ae_filename"), aero.need("pc_filename")
    sets = aero.get("ae_sets")
    shape = read_planform(ae.file(path), 1 if sets is None else int(sets.numbers(0, 1)[0]))
    reach = shape[-1, 0] / arc[-1]
    if not 0.98 < reach < 1.02:
        raise InputError(f"{ae.where}: the planform ends at {shape[-1, 0]:g} m, the blade is {arc[-1]:g} m long")
    s = shape[:, 0] / reach
    # between the nodes the line is curved; a station within a millimetre of another would be a step of the chord
    along = np.interp(np.arange(0.0, len(arc) - 1 + 1e-6, 0.25), np.arange(len(arc)), arc)
    grid = np.concatenate([s, [a for a in along if np.min(np.abs(a - s)) > 1e-3]])
    grid.sort()
    grid[0], grid[-1] = 0.0, arc[-1]
    x, y, z, twist = half_chord(grid)
    chord = np.interp(grid, s, shape[:, 1])
    group = int(shape[-1, 3])
    polars = read_polars(pc.file(path), group)
    masters = [
        {
            "name": f"{name or 'airfoil'} {thickness:g} %",
            "thickness": 0.01 * thickness,
            "angles": np.radians(table[:, 0]),
            **{which: table[:, k] for k, which in enumerate(("lift", "drag", "moment"), 1)},
        }
        for thickness, name, table in polars
    ]
    names, airfoils = by_thickness(0.01 * np.interp(grid, s, shape[:, 2]), masters, pc.values[-1])
    if np.any(shape[:, 3] != group):
        notes.add("approximated", ae.where, "sets of polars", f"set {group}, of the tip, everywhere")
    notes.add("approximated", pc.where, "dynamic stall", NO_STALL)
    apart = turned_centres(sections.rows)[:, 2:4] - sections.rows[:, 2:4]
    away = float(np.max(np.linalg.norm(apart, axis=1)))
    if away > BESIDE:
        why = f"from the half chord along the chord, as in the manual; that of HAWC2 is up to {away:.2g} m away (S-72)"
        notes.add("approximated", body.block.where, "centres of mass, FPM 1", why)
    if np.any(body.damping[:3]):
        notes.add("ignored", body.block.where, "damping", "the part in proportion to the mass")
    outer = {
        "position": z,
        "chord": chord,
        "twist": twist,
        "airfoil": names,
        # a quarter chord ahead of the half chord
        "centre_x": x - 0.25 * chord * np.sin(twist),
        "centre_y": y - 0.25 * chord * np.cos(twist),
        # sections are normal to the line of the half chords
        "cant": np.arctan(np.gradient(x, z)),
    }
    return {"aerodynamics": outer, "structure": structure, "source": body.name}, airfoils


def _tower(body: Body, root: Block, treatment: Treatment, notes: Notes) -> dict[str, Any]:
    height = -body.nodes[:, 2] + body.nodes[0, 2]
    if np.any(np.ptp(body.nodes[:, :2], axis=0) > 1e-6) or np.any(np.diff(height) <= 0.0) or body.axes[2, 2] > -0.999:
        raise UnsupportedError(f"{body.block.where}: the tower {body.name} is not upright and straight")
    span, K, M = body.sections.span, body.sections.stiffness, body.sections.mass
    lumps = {id(command): body.concentrated(command) for command in body.block.all("concentrated_mass")}
    below = [c for c in body.block.all("concentrated_mass") if not lumps[id(c)].last]
    treatment.set_note(below, "ignored", "a mass of the tower below its top is not modelled")
    mass, side, fore, torsion, axial = (A[:, i, i] for A, i in ((M, 0), (K, 4), (K, 3), (K, 5), (K, 2)))
    data: dict[str, Any] = {
        "position": span,
        "mass": mass,
        "fore_aft_stiffness": fore,
        "side_side_stiffness": side,
        "torsion_stiffness": torsion,
        "axial_stiffness": axial,
        "shear_stiffness": 0.5 * (K[:, 0, 0] + K[:, 1, 1]),
        "base_height": float(body.origin[2] - body.nodes[0, 2]),
        "top_mass": sum(lump.mass for lump in lumps.values() if lump.last),
        "source": body.name,
    }
    # x to the left, y downwind; the ratio of the first mode of the tower alone
    factors = {"side_side": (body.damping[3], side), "fore_aft": (body.damping[4], fore)}
    data["damping"] = {name: 0.5 * time * bending_frequency(span, mass, EI) for name, (time, EI) in factors.items()}
    data["damping"]["torsion"] = data["damping"]["fore_aft"]
    what = ", ".join(f"{name} {100 * ratio:.3g} %" for name, ratio in data["damping"].items())
    if max(data["damping"].values()) > OVERDAMPED:
        # a mode this stiff follows its load at once, whatever its damping
        data["damping"] = {name: min(ratio, OVERDAMPED) for name, ratio in data["damping"].items()}
        what += f", at most {100 * OVERDAMPED:g} % here"
    notes.add("approximated", body.block.where, "damping", f"{what}: ratios of the tower alone")
    elements = [b for b in root.find("aerodrag").within("aerodrag_element") if is_about(b, body.name)]
    rows = np.array([c.numbers(0, 3) for b in elements for c in b.all("sec")])
    radii = [
        c.numbers(0, 2) for b in root.find("wind").blocks if b.name.startswith("tower_shadow") for c in b.all("radius")
    ]
    if radii:
        table = np.array(radii)
        data["diameter"] = 2.0 * np.interp(span, np.abs(table[:, 0]), table[:, 1])
    elif len(rows):
        data["diameter"] = np.interp(span, np.abs(rows[:, 0]), rows[:, 2])
    else:
        data["diameter"] = np.sqrt(8.0 * fore / mass) / STEEL_SPEED
        notes.add("approximated", body.block.where, "tower without radii", "steel tube of its EI / m")
    if len(rows):
        # the drag widths of the tower need not be its structural diameters
        area = np.interp(span, np.abs(rows[:, 0]), rows[:, 1] * rows[:, 2])
        data["drag_coefficient"] = float(np.trapezoid(area, span) / np.trapezoid(data["diameter"], span))
    return data


def _rotating(parts: ModelBodies, count: int, drive: dict[str, Any], notes: Notes) -> dict[str, Any]:
    """Content of hub, nacelle and drivetrain."""
    shaft, apex, down = parts.shaft, parts.apex, parts.down
    grid, softness = shaft.sections.span, 1.0 / shaft.sections.stiffness[:, 5, 5]
    compliance = np.concatenate([[0.0], np.cumsum(0.5 * (softness[1:] + softness[:-1]) * np.diff(grid))])
    lumps = shaft.lumps()

    def about_shaft(lump: Lump) -> float:
        arm = lump.position - apex
        return float(down @ lump.inertia @ down + lump.mass * (arm @ arm - (arm @ down) ** 2))

    # the generator's rotor is the largest inertia that is not on the hub
    rigid = compliance[-1] * RIGID_TORSION <= 1.0

    def reached(lump: Lump) -> float:
        """Torsional compliance up to a mass; on a rigid shaft up to its centre of mass instead of its node."""
        along = grid[-1] - float((lump.position - apex) @ down) if rigid else lump.span
        return float(np.interp(along, grid, compliance))

    inner = [lump for lump in lumps if not lump.last]
    generator = reached(max(inner, key=about_shaft)) if inner else 0.0
    bound = generator + BOUND * (compliance[-1] - generator)
    side = [lump.last or reached(lump) > bound for lump in lumps]
    with_hub = [lump for lump, on_hub in zip(lumps, side, strict=True) if on_hub]
    with_generator = [lump for lump, on_hub in zip(lumps, side, strict=True) if not on_hub]
    arms = [lump for body in parts.hub for lump in body.lumps()]
    root = parts.blade.place(parts.blade.nodes[0, :3])
    axis = parts.blade.axes[:, 2]
    mass = sum(lump.mass for lump in with_hub) + count * sum(lump.mass for lump in arms)
    moment = sum(lump.mass * float((lump.position - apex) @ down) for lump in with_hub + count * arms)
    hub = {
        "radius": float(np.linalg.norm(root - apex)),
        "precone": math.asin(-float(axis @ down)),
        "mass": mass,
        "inertia": sum(map(about_shaft, with_hub)) + count * sum(map(about_shaft, arms)),
        "mass_centre": moment / max(mass, 1e-9),
    }
    still = [lump for body in parts.nacelle for lump in body.lumps()]
    fixed = still + with_generator
    weight = sum(lump.mass for lump in fixed)
    centre = np.zeros(3)
    for lump in fixed:
        centre += lump.mass / max(weight, 1e-9) * (lump.position - parts.top)
    J = np.zeros((3, 3))
    for lump in fixed:
        arm = lump.position - parts.top - centre
        turning = (0.0 if lump in still else 1.0) * about_shaft(lump) * np.outer(down, down)
        J += lump.inertia - turning + lump.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    tilt = math.asin(-float(down[2]))
    overhang = float(-(apex - parts.top)[0] / math.cos(tilt))
    nacelle = {
        "mass": weight,
        "mass_centre": tuple(map(float, centre)),
        "roll_inertia": max(float(J[0, 0]), 0.0),
        "nod_inertia": max(float(J[1, 1]), 0.0),
        "yaw_inertia": float(J[2, 2] + weight * (centre[0] ** 2 + centre[1] ** 2)),
        "overhang": overhang,
        "shaft_height": float((apex - parts.top)[2] - overhang * math.sin(tilt)),
        "tilt": tilt,
    }
    stiffness = min(1.0 / (compliance[-1] - generator), RIGID_TORSION)
    inertia = sum(map(about_shaft, with_generator)) / drive["gear_ratio"] ** 2
    least = 1e-3 * max(hub["inertia"], 1.0) / drive["gear_ratio"] ** 2
    damping = float(shaft.damping[5]) * stiffness
    drive = drive | {"stiffness": stiffness, "damping": damping, "generator_inertia": max(inertia, least)}
    why = f"two masses: generator {inertia:.4g} kg m^2, spring {stiffness:.4g} N m/rad; rigid in bending"
    notes.add("approximated", shaft.block.where, f"shaft {shaft.name}", why)
    for body in parts.nacelle + parts.hub:
        notes.add("approximated", body.block.where, f"body {body.name}", "rigid")
    return {"hub": hub, "nacelle": nacelle, "drivetrain": drive}


def _options(aero: Block, wind: Block, structure: Block, parts: ModelBodies, turbine: Turbine) -> dict[str, Any]:
    """Degrees of freedom and models as in HAWC2; defaults where HAWC2 has no equivalent."""
    constant_speed = structure.block("constraint").within("bearing3")
    # shaft at prescribed speed; without a yaw bearing the nacelle is fixed to the tower
    locked = ["yaw"] + (["generator"] if constant_speed else [])
    if turbine.drivetrain.stiffness >= RIGID_TORSION:
        locked.append("drivetrain")
    influence = {0: "none", 2: "eames", 4: "eames"}.get(int(wind.value("tower_shadow_method", 0.0)), "potential")
    return {
        "locked": tuple(locked),
        "tower_torsion_modes": 1,
        "wake": "momentum" if aero.value("induction_method", 1.0) else "none",
        "tip_loss": bool(aero.value("tiploss_method", 1.0)),
        "hub_loss": False,
        "axial_drag": True,
        "tangential_drag": True,
        "stall": "hansen" if aero.value("dynstall_method", 0.0) else "static",
        "tower_influence": influence,
        "tower_drag": turbine.tower.drag_coefficient > 0.0,
        "advanced": {"high_induction": "madsen"},
    }
