"""SubDyn and HydroDyn of a frame of many members."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.exchange.openfast.frame import JOINTS, OTHERS, SECTIONS
from meltemi.exchange.openfast_writer.template import rows_of
from meltemi.exchange.openfast_writer.water import MOST_OUTPUTS, STEP, WALL, Report, ground_text, hydrodyn, subdyn
from meltemi.frames.definition import Coefficients, Frame, Member, Section
from meltemi.frames.finite_elements import assemble
from meltemi.frames.reduction import frequencies
from meltemi.frames.water import coefficients_of

Float = NDArray[np.float64]
MODES = 8
"""Internal modes of SubDyn."""
LEAST = 1e-3
"""Least damping ratio of internal modes, which have to have one."""
DEEPER, IN_AIR = 0.2, 50.0
"""Length of the pieces of a member over depth, and [m] in the air. The Jacobian of OpenFAST 5 has them all."""
BED = 1e-3
"""[m] extension of members at the bed into it: water does not press on their ends, and the sea fills them."""
STEEP = math.cos(math.radians(10.0))
"""Members that are less upright may not extend into the bed."""
TYPES = {"tube": "1c", "rectangle": "1r", "general": "4", "cable": "2", "rigid": "3", "spring": "5"}


def numbers_of(names: Iterable[str], letters: str) -> dict[str, int]:
    """Numbers of joints, members or sections: those of names such as J12 if all have one, otherwise in their order."""
    names = list(names)
    given = [re.fullmatch(rf"{letters}(\d+)", name) for name in names]
    values = [int(match[1]) for match in given if match is not None]
    if len(set(values)) < len(names) or 0 in values:
        values = list(range(1, len(names) + 1))
    return dict(zip(names, values, strict=True))


def structure(texts: dict[str, str], title: str, frame: Frame, base: Float, first: float, changed: Report) -> None:
    """Add SubDyn for a frame, and springs under its feet.

    Args:
      base: (3,) [m] the tower's base, on the transition piece.
      first: [rad/s] first natural frequency of the turbine, at which the damping ratio of the frame applies.

    Raises:
      UnsupportedError: nonlinear soil springs, general sections that change along a member.
    """
    joint, member = numbers_of(frame.joints, "J"), numbers_of(frame.members, "M")
    names = {kind: [n for n, each in frame.sections.items() if each.kind == kind] for kind in SECTIONS}
    section = {kind: numbers_of(each, kind) for kind, each in names.items()}
    reactions = []
    for foot in frame.feet:
        if foot.soil is not None:
            where = f"frame.feet: soil at joint {foot.joint}"
            raise UnsupportedError(f"{where}: SubDyn has springs under feet only; give a stiffness instead")
        ground = "" if foot.stiffness is None else f"Ground{joint[foot.joint]}.dat"
        if foot.stiffness is not None:
            texts[ground] = ground_text(foot.stiffness, np.zeros((6, 6)) if foot.mass is None else foot.mass)
        reactions.append([joint[foot.joint], *[int(not ground)] * 6, f'"{ground}"'])
    properties: dict[str, list[list[float]]] = {kind: [] for kind, _, _ in OTHERS.values()}
    rows = []
    for name, each in frame.members.items():
        kind: str = each.kind if each.kind != "beam" else frame.sections[each.section].kind
        if each.kind == "beam":
            ends = [section[kind][each.section], section[kind][each.end_section or each.section]]
            if kind == "general" and ends[0] != ends[1]:
                raise UnsupportedError(f"frame.members.{name}: SubDyn has one general section along a member")
        else:
            values = _properties(each)
            properties[kind] += [values] * (values not in properties[kind])
            ends = [properties[kind].index(values) + 1] * 2
        last = 1 if kind == "spring" else math.degrees(each.spin)
        rows.append([member[name], *(joint[j] for j in each.joints), *ends, TYPES[kind], last])
    held = float(frequencies(assemble(frame, base), 1, fixed=True)[0])
    matrix = frame.interface_damping
    if matrix is not None and frame.damping:
        changed("frame.damping", "that of internal modes; SubDyn has the matrix in its place for the interface")
    feet = {foot.joint for foot in frame.feet}
    legs = [member[name] for name, each in frame.members.items() if feet & {*each.joints}][:MOST_OUTPUTS]
    none = np.zeros(6)
    tables: dict[str, list[str]] = {
        "rayleigh": rows_of([[0.0, 2.0 * frame.damping / first, "RayleighDamp"]]),
        "guyan": rows_of((np.zeros((6, 6)) if matrix is None else np.asarray(matrix)).tolist()),
        "offset": rows_of([[0.0] * 6]),
        "NJoints": rows_of([joint[name], *map(float, x), *_release(frame, name)] for name, x in frame.joints.items()),
        "NReact": rows_of(reactions),
        "NInterf": rows_of([joint[name], *[1] * 7] for name in frame.interface),
        "NMembers": rows_of(rows),
        "NCOSMs": rows_of([[1, *np.eye(3).ravel().tolist()]]),
        "NCmass": rows_of(
            [
                joint[m.joint],
                m.mass,
                *(none if m.inertia is None else m.inertia),
                *(none[:3] if m.centre is None else m.centre),
            ]
            for m in frame.masses
        ),
        "NMOutputs": rows_of([leg, 2, 1, frame.divisions + 1] for leg in legs),
        "channels": [f"{kind}{load}ss" for kind in ("React", "Intf") for load in ("FX", "FY", "FZ", "MX", "MY", "MZ")],
    }
    ends_of_legs = [f"M{i + 1}N{end}" for i in range(len(legs)) for end in (1, 2)]
    tables["channels"] += [f"{end}{load}e" for end in ends_of_legs for load in ("FKz", "MKx", "MKy")]
    for kind, (keywords, _) in SECTIONS.items():
        tables[keywords[0]] = rows_of([i, *_section(frame.sections[name])] for name, i in section[kind].items())
    for kind, keyword, _ in OTHERS.values():
        tables[keyword] = rows_of([i, *each] for i, each in enumerate(properties[kind], 1))
    values_of: dict[str, object] = {
        "NDiv": frame.divisions,
        "Nmodes": MODES,
        "JDampings": 100.0 * max(frame.damping * held / first, LEAST),
        "GuyanDampMod": 1 if matrix is None else 2,
    }
    texts["SubDyn.dat"] = subdyn(title, values_of, tables)


def _section(s: Section) -> list[float]:
    """Properties of a section in the order of SubDyn; that of a general one is solid if it has no areas for shear."""
    material = [s.elastic_modulus, s.shear_modulus, s.density]
    values = [getattr(s, name) for name in SECTIONS[s.kind][1].split()]
    if s.kind == "general":
        area, x, y, *rest = values
        shear = [5.0 / 6.0 * area if each is None else each for each in (x, y)]
        values = [area, *shear, *rest[:2], sum(rest[:2]), rest[2]]
    return [*material, *(float(x or 0.0) for x in values)]


def _properties(member: Member) -> list[float]:
    """Properties of a cable, rigid link or spring in the order of SubDyn."""
    if member.kind == "spring":
        return np.asarray(member.stiffness)[np.triu_indices(6)].tolist()
    columns = next(each for kind, _, each in OTHERS.values() if kind == member.kind)
    return [*(float(getattr(member, name) or 0.0) for name in columns), *[0.0] * (member.kind == "cable")]


def _release(frame: Frame, name: str) -> list[float | int]:
    """Type, direction and stiffness of a joint."""
    release = frame.releases.get(name)
    if release is None:
        return [1, 0.0, 0.0, 0.0, 0.0]
    kind = next(number for number, each in JOINTS.items() if each == release.kind)
    return [kind, *map(float, np.zeros(3) if release.axis is None else release.axis), release.stiffness]


def wet_members(frame: Frame) -> dict[str, Member]:
    """Beams on which water acts, above the sea bed."""
    content = {}
    for name, member in frame.members.items():
        dry = member.potential_flow and not coefficients_of(frame, member).drag
        top = max(frame.joints[joint][2] for joint in member.joints)
        if member.kind == "beam" and not dry and top > -frame.depth:
            content[name] = member
    return content


def water(title: str, frame: Frame, level: float, changed: Report) -> str:
    """Text of the HydroDyn file of a frame.

    Args:
      level: [m] still-water level above mean sea level.
    """
    joint, member, wet = numbers_of(frame.joints, "J"), numbers_of(frame.members, "M"), wet_members(frame)
    used = dict.fromkeys(j for each in wet.values() for j in each.joints)
    places = {name: frame.joints[name].astype(float) for name in used}
    for name in [name for name in used if -frame.depth - 0.5 * BED < places[name][2] < -frame.depth + BED]:
        along = [_axis(frame, each, name) for each in wet.values() if name in each.joints]
        if all(abs(d[2]) > STEEP for d in along):
            places[name] = places[name] + along[0] * (places[name][2] + frame.depth + BED) / abs(along[0][2])
        else:
            changed(
                f"foot {name}", "its members are inclined by more than 10 degrees: water presses on their ends there"
            )
    ends = {name: frame.other_ends.get(name, frame.ends) for name in used}
    kinds = list(dict.fromkeys((each.drag, each.added_mass, each.pressure) for each in ends.values()))
    sets: dict[bool, dict[str, int]] = {False: {}, True: {}}
    rows: list[list[object]] = []
    own: dict[bool, list[list[object]]] = {False: [], True: []}
    fills: dict[tuple[Any, float], list[int]] = {}
    for name, each in wet.items():
        both = [each.section, each.end_section or each.section]
        boxed = frame.sections[both[0]].kind == "rectangle"
        numbers = [sets[boxed].setdefault(section, len(sets[boxed]) + 1) for section in both]
        top = max(places[j][2] for j in each.joints)
        piece = IN_AIR if min(places[j][2] for j in each.joints) > 0.0 else max(frame.piece, -DEEPER * top)
        model = 1 if each.hydrodynamics is None else 3
        spin = math.degrees(each.spin) if boxed else 0.0
        numerical = boxed or _cut_end(frame, each, level)
        geometry = [2 if boxed else 1, spin, piece, model, 2 if numerical else 1, str(each.potential_flow)]
        rows.append([member[name], *(joint[j] for j in each.joints), *numbers, *geometry])
        if model == 3:
            own[boxed].append([member[name], *_row(coefficients_of(frame, each), boxed=boxed, ends=2)])
        surface = (level, frame.water_density) if each.flooded else (each.filled_to, each.fill_density)
        if surface[0] is not None:
            fills.setdefault(surface, []).append(member[name])
    tables = {
        "axial": rows_of([i + 1, *kind, 0, 0.0, 1.0] for i, kind in enumerate(kinds)),
        "joints": rows_of(
            [joint[name], *map(float, places[name]), 1 + kinds.index((c.drag, c.added_mass, c.pressure)), 0]
            for name, c in ends.items()
        ),
        "sections": rows_of([i, *_shape(frame.sections[name])] for name, i in sets[False].items()),
        "rectangles": rows_of([i, *_shape(frame.sections[name])] for name, i in sets[True].items()),
        "simple": rows_of([_row(frame.hydrodynamics)]),
        "simple_rectangles": rows_of([_row(frame.hydrodynamics, boxed=True)]),
        "by_member": rows_of(own[False]),
        "by_member_rectangles": rows_of(own[True]),
        "members": rows_of(rows),
        # OpenFAST reads 1024 characters of a line
        "fills": [
            " ".join(map(str, [len(each), *each, float(surface[0]), float(surface[1])]))
            for surface, each in fills.items()
        ],
        "growth": rows_of(_growth(frame)),
    }
    return hydrodyn(title, {"potential": 0}, tables)


def _cut_end(frame: Frame, member: Member, level: float) -> bool:
    """Whether the surface of still water cuts or may reach an end of a tube: HydroDyn's closed forms refuse it."""
    grown = max((each.thickness for each in frame.growth), default=0.0)
    sections = (member.section, member.end_section or member.section)
    return any(
        abs(frame.joints[joint][2] - level) < 0.5 * frame.sections[section].breadth + grown
        for joint, section in zip(member.joints, sections, strict=True)
    )


def _axis(frame: Frame, member: Member, joint: str) -> Float:
    """(3,) direction of a member out of its end at a joint."""
    a, b = (frame.joints[name] for name in member.joints)
    d = (a - b) if member.joints[0] == joint else (b - a)
    axis: Float = d / np.linalg.norm(d)
    return axis


def _row(c: Coefficients, *, boxed: bool = False, ends: int = 1) -> list[Any]:
    """Coefficients in the order of HydroDyn, which has those of a rectangle for each side."""
    grown = [getattr(c, f"grown_{name}") for name in ("drag", "added_mass", "pressure")]
    drag, mass, pressure = (
        [bare, bare if under is None else under]
        for bare, under in zip((c.drag, c.added_mass, c.pressure), grown, strict=True)
    )
    if c.diffraction == "maccamy_fuchs":
        pressure = ["MCF", "MCF"]
    sides = 2 if boxed else 1
    return [x for x in (*drag * sides, *mass * sides, *pressure, *[0.0] * 4, *[1.0] * 4) for _ in range(ends)]


def _shape(s: Section) -> list[float]:
    """Sides and wall of a section in the water."""
    sides = [float(s.width or 0.0), float(s.height or 0.0)] if s.kind == "rectangle" else [s.breadth]
    solid = WALL * s.breadth if s.kind == "general" else 0.5 * min(sides)
    return [*sides, s.thickness or solid]


def _growth(frame: Frame) -> list[list[float]]:
    """Rows of the table of growth from the top down, with a step where two layers meet."""
    edges = [x for each in frame.growth for x in (each.bottom, each.top)]
    step = STEP * (len(set(np.round(edges, 3))) < len(edges))
    layers = sorted(frame.growth, key=lambda each: -each.top)
    return [[x, each.thickness, each.density] for each in layers for x in (each.top - step, each.bottom + step)]
