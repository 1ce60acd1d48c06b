"""The pieces of members on which water acts, their coefficients, and the liquid inside of members.

Reference: docs/theory/frames.md (F-35 to F-42); Morison et al. (1950).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.frames.definition import Coefficients, Frame, Member, Section
from meltemi.frames.finite_elements import Assembly

Float = NDArray[np.float64]
NEAR, LONG, GROWTH = 0.5, 2.5, 0.15
"""Length of pieces at still water and that of the longest over ``frame.piece``, and their growth with depth."""
NOWHERE = -1


@dataclass(frozen=True)
class Pieces:
    """Pieces (P,) of members, and their ends at joints, from the lowest up; loads are those of one that is fully wet.

    Attributes:
      place, axis: (P, 3) [m] middle, and direction of the member.
      low, high: [m] heights of its ends above mean sea level.
      drag, plate: [kg/m] drag across and along the member over velocity squared.
      added, along: [kg] added mass across and along.
      inertial: [kg] mass that the acceleration of the water pushes across; along it is ``along``.
      volume: [m^3] displaced volume, of which the pressure on the side lifts the piece across the member.
      area, still_area: [m^2] area on which the pressure of waves, and that of still water, act along the axis.
      radius: [m] radius of an upright cylinder that diffracts the waves, or 0.
      element, fraction: finite element that carries it, and the place there; -1 at a joint.
      node: node of the joint that carries it, or -1.
    """

    place: Float
    axis: Float
    low: Float
    high: Float
    drag: Float
    plate: Float
    added: Float
    along: Float
    inertial: Float
    volume: Float
    area: Float
    still_area: Float
    radius: Float
    element: NDArray[np.int64]
    fraction: Float
    node: NDArray[np.int64]

    def ends(self, assembly: Assembly) -> Float:
        """(P, 3, 12) displacement of the pieces by those of the ends of their elements, 0 at joints."""
        shapes = np.zeros((len(self.low), 3, 12))
        some = self.element != NOWHERE
        shapes[some] = assembly.elements.at(self.element[some], self.fraction[some])[:, :3]
        return shapes

    def moved(self, assembly: Assembly, below: Float) -> Float:
        """(k, P, 3) displacement of the pieces by that of the nodes (k, n, 6)."""
        nodes = assembly.elements.nodes[self.element]
        at = below[:, nodes].reshape(len(below), len(self.low), 12)
        result: Float = np.einsum("pij,kpj->kpi", self.ends(assembly), at)
        joints = self.node != NOWHERE
        result[:, joints] = below[:, self.node[joints], :3]
        return result


def grown(frame: Frame, z: float) -> float:
    """[m] thickness of the marine growth at a height."""
    return sum(each.thickness for each in frame.growth if each.bottom < z < each.top)


def edges_of(frame: Frame, a: Float, b: Float, divisions: int) -> Float:
    """(N + 1,) places from 0 to 1 along a member that are the edges of its pieces.

    Pieces end at still water, at the edges of growth and at the nodes of the finite elements; they are short near the
    surface and longer below it.
    """
    length, rise = float(np.linalg.norm(b - a)), float(b[2] - a[2])
    cuts = list(np.linspace(0.0, 1.0, divisions + 1))
    if abs(rise) > 1e-9:
        heights = [0.0, -frame.depth, *(z for each in frame.growth for z in (each.bottom, each.top))]
        cuts += [s for z in heights if 1e-6 < (s := (z - a[2]) / rise) < 1.0 - 1e-6]
    edges = np.unique(np.round(cuts, 9))
    result = [0.0]
    for s, e in pairwise(edges):
        depth = abs(a[2] + 0.5 * (s + e) * rise)
        n = max(int(np.ceil((e - s) * length / frame.piece / np.clip(GROWTH * depth, NEAR, LONG))), 1)
        result += [s + (e - s) * (i + 1) / n for i in range(n)]
    return np.array(result)


def coefficients_of(frame: Frame, member: Member) -> Coefficients:
    """Coefficients of a member."""
    name = member.hydrodynamics
    return frame.hydrodynamics if name is None else frame.other_hydrodynamics[name]


def sections_of(frame: Frame, member: Member) -> tuple[Section, Section]:
    """Sections at both ends of a member."""
    return frame.sections[member.section], frame.sections[member.end_section or member.section]


def beams(frame: Frame) -> Iterator[tuple[str, Member, Float, Float, Callable[[float], float]]]:
    """Name, member, ends and diameter [m] without growth at a place from 0 to 1, of the members with a section."""
    for name, member in frame.members.items():
        if member.kind == "beam":
            a, b = (frame.joints[joint] for joint in member.joints)
            first, last = (each.breadth for each in sections_of(frame, member))
            yield name, member, a, b, lambda s, first=first, last=last: first + s * (last - first)  # type: ignore[misc]


def pieces(assembly: Assembly) -> Pieces:
    """The pieces of a frame above the sea bed (F-35)."""
    frame = assembly.frame
    rows: list[dict[str, Any]] = []
    ends: dict[str, list[End]] = {}
    for name, member, a, b, diameter in beams(frame):
        axis = (b - a) / np.linalg.norm(b - a)
        rows += _along_member(assembly, name, member, a, b, diameter)
        for joint, sign, s in ((0, -1.0, 0.0), (1, 1.0, 1.0)):
            z = frame.joints[member.joints[joint]][2]
            if z > -frame.depth + 1e-6:
                radius = 0.5 * diameter(s) + grown(frame, z)
                ends.setdefault(member.joints[joint], []).append(End(sign * axis, radius, member.potential_flow))
    rows += list(_at_joints(assembly, ends))
    order = sorted(range(len(rows)), key=lambda i: rows[i]["high"])
    unset = {"element": NOWHERE, "node": NOWHERE}
    values = {f.name: np.array([rows[i].get(f.name, unset.get(f.name, 0.0)) for i in order]) for f in fields(Pieces)}
    return Pieces(**values)


def _along_member(
    assembly: Assembly, name: str, member: Member, a: Float, b: Float, diameter: Callable[[float], float]
) -> Iterator[dict[str, Any]]:
    """The pieces of a member, and the rings where its diameter changes."""
    frame, rho = assembly.frame, assembly.frame.water_density
    first = int(np.flatnonzero(assembly.elements.member == assembly.members.index(name))[0])
    n, length = len(assembly.member_nodes[name]) - 1, float(np.linalg.norm(b - a))
    c = coefficients_of(frame, member)
    thick, inside = c.diffraction == "maccamy_fuchs", float(not member.potential_flow)

    def carried(s: float) -> dict[str, Any]:
        at = min(int(s * n), n - 1)
        return {"element": first + at, "fraction": s * n - at}

    before: float | None = None
    for s, e in pairwise(edges_of(frame, a, b, n)):
        (x, y), middle = (a + s * (b - a), a + e * (b - a)), a + 0.5 * (s + e) * (b - a)
        if middle[2] < -frame.depth:
            before = None
            continue
        growth = grown(frame, middle[2])
        D, size = diameter(0.5 * (s + e)) + 2.0 * growth, (e - s) * length
        drag, Ca, Cp = (_under(c, kind, growth) for kind in ("drag", "added_mass", "pressure"))
        outer = 0.25 * np.pi * (np.array([diameter(s), diameter(e)]) + 2.0 * growth) ** 2
        volume = inside * 0.25 * np.pi * D**2 * size
        yield carried(0.5 * (s + e)) | {
            "place": middle,
            "axis": (b - a) / length,
            "low": min(x[2], y[2]),
            "high": max(x[2], y[2]),
            "drag": 0.5 * rho * drag * D * size,
            "added": rho * Ca * volume,
            "inertial": rho * (2.0 if thick else Ca + Cp) * volume,
            "volume": volume,
            "area": inside * (outer[1] - outer[0]),
            "still_area": inside * (outer[1] - outer[0]),
            "radius": 0.5 * D if thick and inside else 0.0,
        }
        if before is not None and inside and abs(outer[0] - before) > 1e-9:  # the edge of growth is a ring
            ring = {"place": x, "axis": (b - a) / length, "low": x[2], "high": x[2]}
            yield carried(s) | ring | {"area": outer[0] - before, "still_area": outer[0] - before}
        before = outer[1]


def _under(c: Coefficients, kind: str, growth: float) -> float:
    """A coefficient, under growth that for growth."""
    grown_value = getattr(c, f"grown_{kind}")
    value: float = grown_value if growth > 0.0 and grown_value is not None else getattr(c, kind)
    return value


@dataclass(frozen=True)
class End:
    """The end of a member at a joint: outward direction, radius [m] with growth, and whether potential flow has it."""

    outward: Float
    radius: float
    potential_flow: bool


def _at_joints(assembly: Assembly, ends: dict[str, list[End]]) -> Iterator[dict[str, Any]]:
    """The ends of members at joints: pressure on them, and where there are coefficients plates (F-38).

    Members end at their joints, so that pressures on the ends are those which the wall of a leg lacks at its braces.
    """
    frame, rho = assembly.frame, assembly.frame.water_density
    for joint, those in ends.items():
        c, place = frame.other_ends.get(joint, frame.ends), frame.joints[joint]
        wet = [end for end in those if not end.potential_flow]
        area = sum((np.pi * end.radius**2 * end.outward for end in wet), np.zeros(3))
        every = sum((np.pi * end.radius**2 * end.outward for end in those), np.zeros(3))
        volume = sum((2.0 / 3.0 * np.pi * end.radius**3 * end.outward for end in wet), np.zeros(3))
        at = {"place": place, "low": place[2], "high": place[2], "node": assembly.joint_nodes[joint]}
        if (size := float(np.linalg.norm(area))) > 1e-9:
            yield at | {"axis": area / size, "area": -c.pressure * size, "still_area": -size}
        if (size := float(np.linalg.norm(every))) > 1e-9 and c.drag > 0.0:
            yield at | {"axis": every / size, "plate": 0.25 * rho * c.drag * size}
        if (ball := float(np.linalg.norm(volume))) > 1e-9 and c.added_mass > 0.0:
            yield at | {"axis": volume / ball, "along": rho * c.added_mass * ball}


def added_mass(p: Pieces, shape: Float, deep: int) -> Float:
    """(k, k) added mass of the lowest pieces in the modes (F-44)."""
    along = np.einsum("kpi,pi->kp", shape, p.axis)
    total = np.einsum("p,kpi,jpi->kj", p.added[:deep], shape[:, :deep], shape[:, :deep])
    total += np.einsum("p,kp,jp->kj", (p.along - p.added)[:deep], along[:, :deep], along[:, :deep])
    result: Float = total
    return result


def plates(assembly: Assembly, p: Pieces) -> list[str]:
    """Joints where members meet whose ends have drag or added mass, so that they act on the water like plates."""
    meeting = Counter(joint for m in assembly.frame.members.values() if m.kind == "beam" for joint in m.joints)
    acting = set(p.node[(p.plate > 0.0) | (p.along > 0.0)].tolist())
    return [joint for joint, node in assembly.joint_nodes.items() if meeting[joint] > 1 and node in acting]


def liquid_inside(assembly: Assembly, level: float = 0.0) -> tuple[Float, Float]:
    """Loads over gravity [kg] of the liquid inside of members, on nodes (n, 6) and on the ends of elements (e, 2, 6).

    In flooded members it stands at the ``level`` [m] of still water.

    They are those of its pressure on the wall, and on both ends of each member (F-40), so that the axial force is that
    in the wall. Water that stands on the sea bed does not rest on the frame.
    """
    frame, e = assembly.frame, assembly.elements
    nodes, line = np.zeros((len(assembly.points), 6)), np.zeros((len(e.length), 3))
    for name, member, a, b, _ in beams(frame):
        if (liquid := frame.liquid(member, level)) is None:
            continue
        top, density = liquid
        mine, axis = np.flatnonzero(e.member == assembly.members.index(name)), (b - a) / np.linalg.norm(b - a)
        for i in mine:
            z = assembly.points[e.nodes[i], 2]
            wet = np.clip((top - z.min() + 1e-9) / max(float(np.ptp(z)), 1e-9), 0.0, 1.0)  # full where it is level
            section = e.properties[i]
            assert section is not None
            line[i] = -wet * density * section.hole * (np.array([0.0, 0.0, 1.0]) - axis[2] * axis)
        for end, sign, part in ((a, 1.0, mine[0]), (b, -1.0, mine[-1])):
            section = e.properties[part]
            if section is not None and end[2] < top and not (member.flooded and end[2] < -frame.depth + 1e-6):
                node = assembly.member_nodes[name][0 if sign > 0.0 else -1]
                nodes[node, :3] -= sign * density * section.hole * (top - end[2]) * axis
    return nodes, assembly.line_loads(line)
