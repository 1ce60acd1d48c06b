"""Descriptions of mooring lines, their tables for kernels, and lines alone in equilibrium.

Reference: docs/theory/floating.md (W-40, W-41).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.compiler import View
from meltemi.control.faults import healthy
from meltemi.core.record import Record, Vector
from meltemi.floating.catenary import span
from meltemi.floating.mooring import (
    INNER,
    NONE,
    FreePoint,
    Line,
    LineEnd,
    LineLoad,
    LineOrder,
    Moorings,
    PointState,
    hang_all,
)
from meltemi.sea.airy import GRAVITY
from meltemi.structure.tables import StructureParameters
from meltemi.turbine.plausibility import doubt

Float = NDArray[np.float64]
ON_BED = 1e-3
"""[m] height above the sea bed below which an anchor lies on it."""


class MooringPoint(Record):
    """A free point where lines meet, with a clump weight or a buoy. It hangs in the lines and stays off the sea bed."""

    mass: float = Field(default=0.0, ge=0.0)
    """[kg; 10 to 1e6] mass in air."""
    volume: float = Field(default=0.0, ge=0.0)
    """[m^3; 0.005 to 2000] volume of the displaced water."""
    drag_area: float = Field(default=0.0, ge=0.0)
    """[m^2; 0.05 to 1000] drag coefficient times area."""
    added_mass: float = Field(default=0.0, ge=0.0)
    """Added mass over the mass of the water displaced [-; 0.3 to 3]."""

    def wet_mass(self, water_density: float) -> float:
        """Mass [kg] less that of the displaced water of a density [kg/m^3]."""
        return self.mass - water_density * self.volume


class MooringLine(Record):
    """A line of one kind, from the platform or a free point down to an anchor or a free point."""

    fairlead: Vector | str
    """(3,) [m] position on the platform at rest: x, y, height above still water; or the name of one of ``points``."""
    anchor: Vector | str
    """(3,) [m] position, or the name of one of ``points``."""
    length: float = Field(gt=0.0)
    """[m] unstretched length."""
    mass: float = Field(gt=0.0)
    """[kg/m] mass per length in air."""
    diameter: float = Field(ge=0.0)
    """[m; 0.02 to 0.7] diameter of a cylinder with the volume of the line."""
    stiffness: float = Field(gt=0.0)
    """[N] Young's modulus times section."""
    friction: float = Field(default=0.0, ge=0.0, le=2.0)
    """Friction coefficient of the sea bed [-; 0.05 to 1.5]."""
    drag: float = Field(default=0.0, ge=0.0)
    """Drag coefficient [-; 0.65 to 3.5] of motion across the line, over its diameter."""
    axial_drag: float = Field(default=0.0, ge=0.0)
    """Drag coefficient [-; 0.02 to 1.5] of motion along the line, over its surface."""
    added_mass: float = Field(default=0.0, ge=0.0)
    """Added-mass coefficient [-; 0.35 to 2] across the line."""
    axial_added_mass: float = Field(default=0.0, ge=0.0)
    """Added-mass coefficient [-; 0.05 to 1.2] along the line."""
    strength: float | None = Field(default=None, gt=0.0)
    """[N] characteristic strength, for utilisations of load bases."""
    damping_ratio: float = Field(default=1.0, ge=0.0)
    """Axial damping of a segment over ``l sqrt(stiffness mass)`` [-; 0.02 to 5]; of moving lines."""

    @property
    def section(self) -> float:
        """[m^2] section of the displaced water."""
        return 0.25 * np.pi * self.diameter**2

    def wet_mass(self, water_density: float) -> float:
        """Mass per length [kg/m] less that of the displaced water of a density [kg/m^3]."""
        return self.mass - water_density * self.section

    def ratios(self, key: str) -> list[str]:
        """Doubts about ratios of chains, wires and ropes: density, stiffness over mass, strength over stiffness."""
        doubts = [doubt(f"{key}.stiffness", "it over mass [m^2/s^2]", self.stiffness / self.mass, 2e5, 6e7)]
        if self.diameter > 0.0:
            doubts.append(doubt(f"{key}.mass", "density [kg/m^3] by diameter", self.mass / self.section, 800.0, 1.6e4))
        if self.strength is not None:
            doubts.append(doubt(f"{key}.strength", "it over stiffness", self.strength / self.stiffness, 2e-3, 0.2))
        if not isinstance(self.fairlead, str) and not isinstance(self.anchor, str):
            way = float(np.linalg.norm(self.fairlead - self.anchor))
            doubts.append(doubt(f"{key}.length", "it over the distance of its ends", self.length / way, 0.9, 1.3))
        return doubts

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("fairlead", "anchor"):
            place = getattr(self, name)
            if not isinstance(place, str) and len(place) != 3:
                raise ValueError(f"{name} must have 3 entries, x, y, z [m], found {len(place)}")
        if isinstance(self.fairlead, str) or isinstance(self.anchor, str):
            return self
        x, y, down = self.fairlead - self.anchor
        if down <= 0.0:
            raise ValueError("anchor must be below the fairlead")
        most = np.hypot(x, y) + down
        if self.length >= most:
            raise ValueError(
                f"length {self.length:g} m hangs straight down at the fairlead; expected less than {most:.5g} m (use a "
                "shorter line)"
            )
        return self


def strings(lines: Sequence[MooringLine], points: Mapping[str, MooringPoint]) -> list[list[int]]:
    """Lines end to end, each string from its upper to its lower line; a line at a junction begins or ends one.

    Raises:
      ValueError: free points do not join lines with the platform.
    """
    ends = [[end if isinstance(end, str) else None for end in (line.fairlead, line.anchor)] for line in lines]
    above = {name: [i for i, (_, low) in enumerate(ends) if low == name] for name in points}
    below = {name: [i for i, (up, _) in enumerate(ends) if up == name] for name in points}
    for i, end in ((i, end) for i, both in enumerate(ends) for end in both if end not in (None, *points)):
        known = ", ".join(points) or "none"
        raise ValueError(f"lines: line {i + 1} ends at {end!r}, which is not one of points ({known})")
    for name in points:
        if not above[name] or len(above[name]) + len(below[name]) < 2:
            raise ValueError(
                f"points: {name} must be the anchor of a line from the platform, and an end of another one; it is the "
                f"anchor of {len(above[name])} and the fairlead of {len(below[name])} lines"
            )
    inner = {name for name in points if len(above[name]) == len(below[name]) == 1}
    result = []
    for i, (head, foot) in enumerate(ends):
        if head in inner:
            continue
        row = [i]
        while foot in inner:
            row.append(below[foot][0])
            foot = ends[row[-1]][1]
        if head is not None and foot is not None:
            raise ValueError(
                f"lines: from {head} to {foot} lines join two points where lines meet; each must end at the "
                "platform or an anchor"
            )
        result.append(row)
    left = set(range(len(lines))) - {i for row in result for i in row}
    if left:
        raise ValueError(f"lines: line {min(left) + 1} belongs to a ring that does not reach the platform")
    return result


def mooring_tables(
    lines: Sequence[MooringLine],
    points: Mapping[str, MooringPoint],
    depth: float,
    water_density: float,
    segments: int = 1,
) -> dict[str, Any]:
    """Arrays of the constants, and of the work, of the kernels of ``mooring``.

    Args:
      depth: [m]; water_density: [kg/m^3]; segments: of a moving line.
    """
    line, order = Line.zeros(line=len(lines)), np.full(LineOrder.shape(line=len(lines)), NONE)
    v, o, number = View(Line, line), View(LineOrder, order), {name: n for n, name in enumerate(points)}

    def of_lines(name: str) -> Float:
        return np.array([getattr(each, name) for each in lines])

    for name in ("length", "stiffness", "friction", "diameter"):
        v[name] = of_lines(name)
    across, displaced, dry = water_density * of_lines("diameter"), water_density * of_lines("section"), of_lines("mass")
    v["mass"] = dry - displaced
    v["drag"], v["axial_drag"] = 0.5 * across * of_lines("drag"), 0.5 * np.pi * across * of_lines("axial_drag")
    v["inertia"] = dry + displaced * of_lines("added_mass")
    v["axial_inertia"] = dry + displaced * of_lines("axial_added_mass")
    v["damping"] = of_lines("damping_ratio") * v["length"] / segments * np.sqrt(v["stiffness"] * dry)
    junctions = set()
    for row in strings(lines, points):
        head, foot = lines[row[0]].fairlead, lines[row[-1]].anchor
        upper, lower = (number[end] if isinstance(end, str) else NONE for end in (head, foot))
        o["head"][row[0]], o["head"][row[1:]], o["foot"][row] = upper, INNER, lower
        junctions |= {upper, lower}
        ends = [number[end] for end in (lines[k].anchor for k in row[:-1]) if isinstance(end, str)]
        o["below"][row[:-1]], o["point"][row[:-1]] = row[1:], ends
        # on the way to the last point: from the anchor upwards, or from the platform down to a junction
        way = row if isinstance(foot, str) else row[::-1]
        o["start"][row], o["finish"][row] = way[0], way[-1]
        o["onward"][way[:-1]], o["back"][way[1:]] = way[1:], way[:-1]
        o["knot"][way[:-1]] = ends if isinstance(foot, str) else ends[::-1]
        v["reach"][row] = np.cumsum(v["length"][row[::-1]])[::-1]
        if not isinstance(head, str):
            v["fairlead"][:, row] = head[:, None]
        if not isinstance(foot, str):
            v["anchor"][:, row] = foot[:, None]
            clear = foot[2] >= -depth + ON_BED
            for k in reversed(row):
                if isinstance(end := lines[k].anchor, str):
                    clear = clear or points[end].wet_mass(water_density) < 0.0
                v["on_bed"][k] = not clear
    point = FreePoint.zeros(point=len(points))
    v = View(FreePoint, point)
    v["mass"] = [each.wet_mass(water_density) for each in points.values()]
    v["inertia"] = [each.mass + each.added_mass * water_density * each.volume for each in points.values()]
    v["drag"] = [0.5 * water_density * each.drag_area for each in points.values()]
    v["junction"] = [n in junctions for n in range(len(points))]
    return {"line": line, "line_order": order, "point": point, "line_end": LineEnd.zeros(line=len(lines))}


@dataclass(frozen=True)
class AtRest:
    """Lines in equilibrium, in the order of the platform's.

    Attributes:
      upper, lower: (L, 3) [m] ends.
      horizontal, vertical: (L,) [N] forces on the upper end, the vertical one downwards.
      tension: (L, 2) [N] tension at upper and lower end.
      force: (L, 3) [N] force on the platform; zero of lines that do not reach it.
      on_bed: (L,) whether they may lie on the sea bed.
    """

    upper: Float
    lower: Float
    horizontal: Float
    vertical: Float
    tension: Float
    force: Float
    on_bed: NDArray[np.bool_]


def at_rest(
    lines: Sequence[MooringLine],
    points: Mapping[str, MooringPoint],
    depth: float,
    water_density: float,
    fairleads: Float | None = None,
) -> AtRest:
    """Equilibrium of lines and free points (W-40, W-41).

    Args:
      depth: [m]; water_density: [kg/m^3].
      fairleads: (L, 3) [m] places of upper ends on the platform; by default those at rest.
    """
    arrays = mooring_tables(lines, points, depth, water_density)
    arrays |= {"structure": StructureParameters.zeros(), "faults": healthy()}
    arrays |= {"line_load": LineLoad.zeros(line=len(lines)), "point_state": PointState.zeros(point=len(points))}
    View(StructureParameters, arrays["structure"])["gravity"] = GRAVITY
    ends, load = View(LineEnd, arrays["line_end"]), View(LineLoad, arrays["line_load"])
    line = View(Line, arrays["line"])
    ends["upper"] = line["fairlead"] if fairleads is None else fairleads.T
    hang_all(Moorings("floats", arrays))
    upper, lower, H, V = ends["upper"].T, ends["lower"].T, load["horizontal"], load["vertical"]
    way = upper - lower
    across = np.hypot(way[:, 0], way[:, 1])
    force = np.column_stack([-H * way[:, 0] / across, -H * way[:, 1] / across, -V])
    force[View(LineOrder, arrays["line_order"])["head"] != NONE] = 0.0
    tension = np.stack([load["fairlead"], load["anchor"]], axis=1)
    return AtRest(upper, lower, H, V, tension, force, line["on_bed"] > 0.0)


def shapes(rest: AtRest, lines: Sequence[MooringLine], water_density: float, count: int = 40) -> list[Float]:
    """(count, 3) [m] places along each line from its upper end; for pictures (W-12, W-13).

    Args:
      water_density: [kg/m^3] density of the water.
      count: points of a line.
    """
    result = []
    for i, line in enumerate(lines):
        H, V, bed = max(rest.horizontal[i], 1.0), rest.vertical[i], rest.on_bed[i]
        w = GRAVITY * line.wet_mass(water_density)
        x, z = np.zeros(count), np.zeros(count)
        for k, s in enumerate(np.linspace(line.length, 0.0, count)[:-1]):
            up = V - w * (line.length - s)
            e = span(H, max(up, 0.0) if bed else up, s, w, line.stiffness, 0.0, 1.0 * bed)
            x[k], z[k] = e.x, e.z
        way = rest.upper[i] - rest.lower[i]
        result.append(rest.lower[i] + np.column_stack([np.outer(x / x[0], way[:2]), z]))
    return result
