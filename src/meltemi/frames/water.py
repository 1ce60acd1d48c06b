"""The pieces of members on which water acts, their coefficients, and the loads of still water.

Reference: docs/theory/frames.md (F-35 to F-42); Morison et al. (1950).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.frames.definition import Coefficients, Frame, Member, Section

Float = NDArray[np.float64]
NEAR, LONG, GROWTH = 0.5, 2.5, 0.15
"""Length of pieces at still water and that of the longest over ``frame.piece``, and their growth with depth."""


@dataclass(frozen=True)
class Pieces:
    """Pieces (P,) of members and ends of members, from the lowest up; loads are those of a piece that is fully wet.

    Attributes:
      place, axis: (P, 3) [m] middle, and direction of the member.
      low, high: [m] heights of its ends above mean sea level.
      drag, plate: [kg/m] drag across and along the member over velocity squared.
      added, along: [kg] added mass across and along.
      inertial: [kg] mass that the acceleration of the water pushes across; along it is ``along``.
      area: [m^2] area on which the pressure of the waves acts along the axis.
      radius: [m] radius of an upright cylinder that diffracts the waves, or 0.
      first, last, share: nodes of the finite elements that carry the piece, and the share of the last.
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
    area: Float
    radius: Float
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    share: Float

    def between(self, values: Float) -> Float:
        """(..., P, c) values at the pieces from those (..., n, c) at the nodes."""
        s = self.share[:, None]
        result: Float = (1.0 - s) * values[..., self.first, :] + s * values[..., self.last, :]
        return result

    def at_nodes(self, forces: Float, n: int) -> Float:
        """(n, 3) forces at the nodes from those (P, 3) on the pieces."""
        total = np.zeros((n, 3))
        for node, share in ((self.first, 1.0 - self.share), (self.last, self.share)):
            np.add.at(total, node, share[:, None] * forces)
        return total


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
            first, last = (
                frame.sections[each].breadth for each in (member.section, member.end_section or member.section)
            )
            yield name, member, a, b, lambda s, first=first, last=last: first + s * (last - first)  # type: ignore[misc]


def pieces(frame: Frame, nodes: dict[str, NDArray[np.int64]]) -> Pieces:
    """The pieces of a frame above the sea bed (F-35).

    Args:
      nodes: nodes of the finite elements of each member, from its first joint to its second.
    """
    rows: list[dict[str, Any]] = []
    rho = frame.water_density
    outward: dict[str, list[tuple[Float, float, int]]] = {}
    for name, member, a, b, diameter in beams(frame):
        axis, length = (b - a) / np.linalg.norm(b - a), float(np.linalg.norm(b - a))
        c, n = coefficients_of(frame, member), len(nodes[name]) - 1
        edges = edges_of(frame, a, b, n)
        before: float | None = None
        for s, e in pairwise(edges):
            (x, y), middle = (a + s * (b - a), a + e * (b - a)), a + 0.5 * (s + e) * (b - a)
            if middle[2] < -frame.depth:
                before = None
                continue
            growth = grown(frame, middle[2])
            D, size = diameter(0.5 * (s + e)) + 2.0 * growth, (e - s) * length
            drag, Ca, Cp = (_under(c, kind, growth) for kind in ("drag", "added_mass", "pressure"))
            section = 0.25 * np.pi * D**2
            outer = 0.25 * np.pi * (np.array([diameter(s), diameter(e)]) + 2.0 * growth) ** 2
            volume = 0.0 if member.potential_flow else rho * section * size
            thick = c.diffraction == "maccamy_fuchs"
            node, share = divmod(0.5 * (s + e) * n, 1.0)
            carried = {"first": nodes[name][int(node)], "last": nodes[name][int(node) + 1], "share": share}
            row = {
                "place": middle,
                "axis": axis,
                "low": min(x[2], y[2]),
                "high": max(x[2], y[2]),
                "drag": 0.5 * rho * drag * D * size,
                "added": Ca * volume,
                "inertial": (2.0 if thick else Ca + Cp) * volume,
                "area": outer[1] - outer[0] if volume else 0.0,
                "radius": 0.5 * D if thick and volume else 0.0,
            }
            rows.append(row | carried)
            if before is not None and volume and abs(outer[0] - before) > 1e-9:  # the edge of growth is a ring
                ring = {"place": x, "axis": axis, "low": x[2], "high": x[2], "area": outer[0] - before}
                where, share = divmod(s * n, 1.0)
                where, share = (where, share) if where < n else (n - 1, 1.0)
                at = {"first": nodes[name][int(where)], "last": nodes[name][int(where) + 1], "share": share}
                rows.append(ring | at)
            before = outer[1]
        if not member.potential_flow:
            for joint, sign, s, node in ((0, -1.0, 0.0, 0), (1, 1.0, 1.0, -1)):
                end = frame.joints[member.joints[joint]]
                if end[2] > -frame.depth + 1e-6:
                    radius = 0.5 * diameter(s)
                    outward.setdefault(member.joints[joint], []).append((sign * axis, radius, nodes[name][node]))
    rows += list(_ends(frame, outward))
    order = sorted(range(len(rows)), key=lambda i: rows[i]["high"])
    values = {f.name: np.array([rows[i].get(f.name, 0.0) for i in order]) for f in fields(Pieces)}
    return Pieces(**values | {name: values[name].astype(np.int64) for name in ("first", "last")})


def _under(c: Coefficients, kind: str, growth: float) -> float:
    """A coefficient, under growth that for growth."""
    grown_value = getattr(c, f"grown_{kind}")
    value: float = grown_value if growth > 0.0 and grown_value is not None else getattr(c, kind)
    return value


def _ends(frame: Frame, outward: dict[str, list[tuple[Float, float, int]]]) -> Iterator[dict[str, Any]]:
    """The ends of members at joints as plates (F-38), where they have coefficients."""
    rho = frame.water_density
    for joint, ends in outward.items():
        c = frame.other_ends.get(joint, frame.ends)
        area = sum((np.pi * r**2 * n for n, r, _ in ends), np.zeros(3))
        volume = sum((2.0 / 3.0 * np.pi * r**3 * n for n, r, _ in ends), np.zeros(3))
        size, ball = float(np.linalg.norm(area)), float(np.linalg.norm(volume))
        if size < 1e-9 or not (c.drag or c.added_mass or c.pressure):
            continue
        node, place = ends[0][2], frame.joints[joint]
        yield {
            "place": place,
            "axis": area / size,
            "low": place[2],
            "high": place[2],
            "plate": 0.25 * rho * c.drag * size,
            "along": rho * c.added_mass * ball,
            "area": -c.pressure * size,
            "first": node,
            "last": node,
        }


def still_water(frame: Frame, nodes: dict[str, NDArray[np.int64]], count: int, level: float, gravity: float) -> Float:
    """(n, 3) [N] forces of still water and of the liquid inside on the nodes (F-39, F-40).

    The pressure on the side of each piece and on both ends of each member, so that axial forces are those in the wall.
    """
    forces = np.zeros((count, 3))
    for name, member, a, b, diameter in beams(frame):
        n = len(nodes[name]) - 1
        for s, e in pairwise(edges_of(frame, a, b, n)):
            middle = 0.5 * (s + e)
            z, node, share = a[2] + middle * (b[2] - a[2]), int(middle * n), middle * n % 1.0
            total = np.zeros(3)
            for sign, top, density, d in _liquids(frame, member, float(z), level, (s, e), diameter):
                total += sign * density * _side(a + s * (b - a), a + e * (b - a), d, top)
            forces[nodes[name][node]] += gravity * (1.0 - share) * total
            forces[nodes[name][node + 1]] += gravity * share * total
        forces[nodes[name][[0, -1]]] += gravity * _caps(frame, member, a, b, diameter, level)
    return forces


def _liquids(
    frame: Frame, member: Member, z: float, level: float, ends: tuple[float, float], diameter: Callable[[float], float]
) -> Iterator[tuple[float, float, float, Float]]:
    """Sign, height of its surface, density, and diameters (2,) of what is outside and inside of a piece at a height."""
    if -frame.depth < z < level and not member.potential_flow:
        yield 1.0, level, frame.water_density, np.array([diameter(s) for s in ends]) + 2.0 * grown(frame, z)
    top, density = inner_surface(frame, member, level)
    if top is not None and z < top:
        yield -1.0, top, density, np.array([_bore(frame, member, s) for s in ends])


def inner_surface(frame: Frame, member: Member, level: float) -> tuple[float | None, float]:
    """Height [m] of the surface of the liquid inside a member, None without, and its density [kg/m^3]."""
    if member.flooded:
        return level, frame.water_density
    if member.filled_to is None:
        return None, 0.0
    ends = [frame.joints[joint][2] for joint in member.joints]
    return min(member.filled_to, float(max(ends))), member.fill_density


def _bore(frame: Frame, member: Member, s: float) -> float:
    """[m] inner diameter of a member, from its area inside the wall."""
    inner = [
        0.0 if each.thickness is None else max(each.breadth - 2.0 * each.thickness, 0.0)
        for each in sections_of(frame, member)
    ]
    return inner[0] + s * (inner[1] - inner[0])


def _side(x: Float, y: Float, d: Float, top: float) -> Float:
    """(3,) [m^3] force of the pressure on the side of a piece up to a surface, over density and gravity (F-39)."""
    if max(x[2], y[2]) > top:  # cut at the surface
        share = (top - x[2]) / (y[2] - x[2])
        cut, dc = x + share * (y - x), d[0] + share * (d[1] - d[0])
        (x, y), d = ((x, cut), np.array([d[0], dc])) if x[2] < y[2] else ((cut, y), np.array([dc, d[1]]))
    axis, length = (y - x) / np.linalg.norm(y - x), float(np.linalg.norm(y - x))
    A, volume = 0.25 * np.pi * d**2, length * np.pi / 12.0 * (d[0] ** 2 + d[0] * d[1] + d[1] ** 2)
    pressure = top - np.array([x[2], y[2]])
    side: Float = np.array([0.0, 0.0, volume]) + (pressure[1] * A[1] - pressure[0] * A[0]) * axis
    return side


def _caps(frame: Frame, member: Member, a: Float, b: Float, diameter: Callable[[float], float], level: float) -> Float:
    """(2, 3) [kg] force over gravity of the pressure on the ends of a member, outside and inside."""
    result = np.zeros((2, 3))
    axis = (b - a) / np.linalg.norm(b - a)
    top, density = inner_surface(frame, member, level)
    for i, (end, s, sign) in enumerate(((a, 0.0, 1.0), (b, 1.0, -1.0))):
        outer = 0.25 * np.pi * (diameter(s) + 2.0 * grown(frame, end[2])) ** 2
        if -frame.depth + 1e-6 < end[2] < level and not member.potential_flow:
            result[i] += sign * frame.water_density * outer * (level - end[2]) * axis
        bore = 0.25 * np.pi * _bore(frame, member, s) ** 2
        # the sea stands on the bed in a leg that is open below
        if top is not None and end[2] < top and not (member.flooded and end[2] < -frame.depth + 1e-6):
            result[i] -= sign * density * bore * (top - end[2]) * axis
    return result
