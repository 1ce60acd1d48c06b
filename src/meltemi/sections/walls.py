"""The shell of a section as columns of plies between nodes on its outer surface, for both models.

Where the two sides meet at a sharp trailing edge, walls are thicker than the room between the surfaces. There the inner
plies end on the line that shares this room between the sides in proportion to their thickness, and both are bonded
along it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sections.layup import THINNEST, Section, arcs

Numbers = NDArray[Any]
Float = NDArray[np.float64]

CORNER = np.radians(25.0)
"""Change of direction of a contour beyond which it has a corner."""
WEDGE = 0.5
"""Slope of a side against the chord below which it may meet the other one at the trailing edge."""
BOND = 1.2
"""Room between the sides, over the thickness of both walls, below which they are bonded."""
RAMP = 0.1
"""Half the length over which a ply's thickness goes to zero where it ends, over the spacing of nodes."""
CROWDED = 0.3
"""Least inner over outer length of a column; where it is less, a node is left out."""


FREE = 1e9
"""[m] room of nodes whose depth nothing limits, finite for the product with complex numbers."""


def at_arc(contour: Numbers, s: Numbers) -> Numbers:
    """(n, 2) points of a contour at arcs, real or complex."""
    known = arcs(contour)
    s = np.atleast_1d(s)
    i = np.clip(np.searchsorted(known, s.real, side="right") - 1, 0, len(known) - 2)
    return contour[i] + ((s - known[i]) / (known[i + 1] - known[i]))[:, None] * (contour[i + 1] - contour[i])


@dataclass(frozen=True)
class Edge:
    """Where the sides meet at the trailing edge.

    Attributes:
      y: (n,) from its tip to where the walls part.
      suction, pressure: (n,) arcs of the two sides at these y.
      gap: (n,) [m] between the surfaces.
    """

    y: Float
    suction: Float
    pressure: Float
    gap: Float


class Shell:
    """Contour and plies of a section's shell."""

    def __init__(self, section: Section) -> None:
        contour = section.contour.real
        if len(contour) < 3 or not np.allclose(contour[0], contour[-1]):
            raise InputError(f"{section.name}: the contour must be closed: its last point must be its first")
        x, y = contour.T
        if np.sum(x[:-1] * np.diff(y) - y[:-1] * np.diff(x)) >= 0.0:
            raise InputError(
                f"{section.name}: the contour must run from the trailing edge along the suction side (x > 0) to the "
                "leading edge, and back along the pressure side"
            )
        self.section, self.contour, self.arc = section, contour, arcs(contour)
        self.length = float(np.sum(np.hypot(*np.diff(contour, axis=0).T)))
        self.plies = [i for i, ply in enumerate(section.plies) if ply.web is None]
        self.start = np.array([section.plies[i].start for i in self.plies])
        self.end = np.array([section.plies[i].end for i in self.plies])
        self.thickness = np.array([section.plies[i].thickness for i in self.plies])

    def present(self, s: Float) -> NDArray[np.bool_]:
        """(len(s), plies) whether the plies are there at arcs."""
        return (self.start <= s[:, None]) & (s[:, None] <= self.end)

    def total(self, s: Float) -> Numbers:
        """(len(s),) [m] thickness of the wall."""
        return self.present(s) @ self.thickness

    @cached_property
    def corners(self) -> Float:
        """Arcs of the corners of the contour, its beginning included where it is one."""
        t = np.diff(self.contour, axis=0)
        angle = np.arctan2(t[:, 1], t[:, 0])
        turn = np.abs((np.diff(np.append(angle, angle[0])) + np.pi) % (2.0 * np.pi) - np.pi)
        found = self.arc[1:][turn > CORNER]
        return found[found < 1.0]

    def normal(self, s: Float, spacing: float) -> Float:
        """(len(s), 2) direction inwards at arcs that are no corners, of the contour's slope over part of the
        spacing."""
        marks = np.concatenate([self.corners - 1.0, self.corners, self.corners + 1.0])
        clear = np.min(np.abs(s[:, None] - marks), axis=1) if len(marks) else np.ones(len(s))
        half = np.clip(0.99 * clear, 1e-6, 0.3 * spacing)
        t = at_arc(self.contour, (s + half) % 1.0) - at_arc(self.contour, (s - half) % 1.0)
        t /= np.hypot(*t.T)[:, None]
        return np.stack([t[:, 1], -t[:, 0]], axis=1)

    @cached_property
    def slots(self) -> NDArray[np.intp]:
        """(plies,) place of each ply in the stack; plies that nowhere overlap share one."""
        slots: list[int] = []
        for k in range(len(self.plies)):
            over = [
                slots[i] for i in range(k) if self.start[k] < self.end[i] - 1e-9 and self.start[i] < self.end[k] - 1e-9
            ]
            slots.append(1 + max(over, default=-1))
        return np.array(slots, dtype=np.intp)

    @cached_property
    def edge(self) -> Edge | None:
        """Where the sides meet at the trailing edge, if they do."""
        le = int(np.argmin(self.contour[:, 1]))
        sides = [self.contour[: le + 1][::-1], self.contour[le:]]
        along = [self.arc[: le + 1][::-1], self.arc[le:]]
        top = min(float(side[:, 1].max()) for side in sides)
        low = float(self.contour[le, 1])
        y = np.linspace(top - 1e-4 * (top - low), low + 0.3 * (top - low), 1500)
        x, s, t, slope = [], [], [], []
        for side, arc in zip(sides, along, strict=True):
            keep = np.concatenate([[True], np.diff(np.maximum.accumulate(side[:, 1])) > 1e-12])
            x.append(np.interp(y, side[keep, 1], side[keep, 0]))
            s.append(np.interp(y, side[keep, 1], arc[keep]))
            slope.append(np.gradient(x[-1], y))
            t.append(self.total(s[-1]).real * np.hypot(1.0, slope[-1]))
        gap = x[0] - x[1]
        wedge = (np.abs(slope[0]) < WEDGE) & (np.abs(slope[1]) < WEDGE) & (t[0] > 0.0) & (t[1] > 0.0)
        meet = wedge & (gap < BOND * (t[0] + t[1]))
        if not meet.any():
            return None
        first, last = int(np.argmax(wedge)), int(np.flatnonzero(meet)[-1])
        part = slice(first, max(last, first + 2) + 1)
        return Edge(y[part], s[0][part], s[1][part], gap[part])


@dataclass(frozen=True)
class Columns:
    """Columns of plies between nodes along the shell, from the trailing edge round.

    Attributes:
      s: (J + 1,) arcs of the nodes.
      outer: (J + 1, 2) [m] the nodes on the outer surface.
      inward: (J + 1, 2) displacement of a node inwards for each metre of depth.
      room: (J + 1,) [m] greatest depth.
      present: (J, plies) plies of the columns.
      beside: (J + 1,) columns before and behind each node; where one of them has no plies, the other.
      smooth: (J + 1,) whether ``inward`` is across a smooth contour: not at corners, nor where both sides meet.
      closed: whether the last node is the first.
      bonded: nodes whose inner ends are one: pairs.
    """

    s: Numbers
    outer: Numbers
    inward: Numbers
    room: Numbers
    present: NDArray[np.bool_]
    beside: tuple[NDArray[np.intp], NDArray[np.intp]]
    smooth: NDArray[np.bool_]
    closed: bool
    bonded: tuple[tuple[int, int], ...]


def columns_of(shell: Shell, spacing: float, wanted: Sequence[Numbers], *, ramps: bool = False) -> Columns:
    """Columns with nodes at corners, ends of plies and wanted arcs, and between these at most ``spacing`` [arc] apart.

    Args:
      wanted: arcs of nodes in groups, the feet of webs; no others are within a group.
      ramps: plies that change the thickness of the wall end between nodes close to their end.
    """
    edge = shell.edge
    ends = np.unique(np.concatenate([shell.start, shell.end]))
    step = RAMP * spacing
    jumps = np.array(
        [e for e in ends if abs(np.diff(shell.total(np.array([e - step, e + step]) % 1.0).real)[0]) > THINNEST]
    )
    if ramps:
        turn = np.clip(2.0 * shell.total(shell.corners).real / shell.length, 0.06 * spacing, 0.5 * spacing)
        beside = np.concatenate([jumps - step, jumps + step, shell.corners - turn, shell.corners + turn])
        ends = np.concatenate([ends, beside % 1.0])
    low, high = (0.0, 1.0) if edge is None else (float(edge.suction[0]), float(edge.pressure[0]))
    fixed = np.concatenate([shell.corners, ends, [low, high]])
    if edge is not None:  # nodes of the two sides at the same y
        inside = np.concatenate([[edge.suction[-1], edge.suction[0]], fixed[fixed < edge.suction[-1]]])
        behind = fixed[fixed > edge.pressure[-1]]
        y = np.concatenate(
            [np.interp(inside, edge.suction, edge.y), np.interp(behind, edge.pressure[::-1], edge.y[::-1])]
        )
        y = _spaced(np.clip(y, edge.y[-1], edge.y[0]), 0.85 * spacing * shell.length)  # sides are longer than y
        mirrored = [np.interp(y, edge.y[::-1], side[::-1]) for side in (edge.suction, edge.pressure)]
        fixed = fixed[(fixed > edge.suction[-1]) & (fixed < edge.pressure[-1])]
        fixed = np.concatenate([fixed, *mirrored])
    fixed = fixed[(fixed >= low) & (fixed <= high)]
    feet = [np.sort(f.real) for f in wanted]
    for f in feet:  # ends of plies within a web's foot go to its lines
        fixed = fixed[(fixed < f[0] - 0.1 * spacing) | (fixed > f[-1] + 0.1 * spacing)]
    s = _spaced(fixed, spacing, feet)
    foot = np.concatenate([*feet, np.zeros(0)])
    complex_of = {v.real: v for f in wanted for v in f.tolist()}
    essential = np.concatenate([foot, [low, high], *([] if edge is None else mirrored)])
    for _ in range(len(s)):
        columns = _columns(shell, np.array([complex_of.get(v, v) for v in s.tolist()]), spacing)
        crowded = _crowded(shell, columns)
        drop = [j for j in crowded if not np.any(np.abs(essential - s[j]) < 1e-12)]
        if not drop:
            return columns
        s = np.delete(s, drop[0])
    return columns


def _spaced(points: Float, spacing: float, whole: Sequence[Float] = ()) -> Float:
    """Sorted points, those closer than a twentieth of the spacing merged, with others between them but not within
    groups."""
    points = np.unique(points)
    keep = [points[0]]
    for p in points[1:]:
        if p - keep[-1] > 0.05 * spacing:
            keep.append(p)
    keep[-1] = points[-1]
    all_points = np.unique(np.concatenate([keep, *whole]))
    pieces = [all_points[-1:]]
    for a, b in itertools.pairwise(all_points):
        inside = any(f[0] <= a and b <= f[-1] for f in whole)
        n = 1 if inside else max(int(np.ceil((b - a) / spacing - 1e-6)), 1)
        pieces.append(np.linspace(a, b, n, endpoint=False))
    return np.sort(np.concatenate(pieces))


def _columns(shell: Shell, s: Numbers, spacing: float) -> Columns:
    outer = at_arc(shell.contour, s)
    closed = shell.edge is None
    t = np.diff(outer.real, axis=0)
    t /= np.hypot(*t.T)[:, None]
    normal = np.stack([t[:, 1], -t[:, 0]], axis=1)
    present = shell.present(0.5 * (s[1:] + s[:-1]).real)
    some, n = np.any(present, axis=1), np.arange(len(t))
    before, behind = np.append(n[-1] if closed else 0, n), np.append(n, 0 if closed else n[-1])
    beside = a, b = np.where(some[before], before, behind), np.where(some[behind], behind, before)
    inward = normal[a] + normal[b]
    inward /= np.maximum(np.sum(inward * normal[a], axis=1), 0.2)[:, None]  # the mitre of a corner
    real = s.real
    smooth = np.all(np.abs((real % 1.0)[:, None] - shell.corners) >= 1e-9, axis=1) & some[before] & some[behind]
    if not closed:
        smooth[[0, -1]] = False
    inward[smooth] = shell.normal(real[smooth], spacing)
    room = np.full(len(s), FREE, dtype=np.result_type(shell.thickness, s))
    bonded: list[tuple[int, int]] = []
    if (edge := shell.edge) is not None:
        total = shell.total
        for j in range(len(s)):
            if s[j].real > edge.suction[-1] + 1e-12:
                break
            y = outer[j, 1].real
            k = int(np.argmin(np.abs(s.real - np.interp(y, edge.y[::-1], edge.pressure[::-1]))))
            gap = outer[j, 0] - outer[k, 0]
            thick = [total(np.array([s[i].real + sign * 1e-9]))[0] for i, sign in ((j, 1), (k, -1))]
            tilt = [1.0 / max(abs(normal[a[i]][0]), 0.5) for i in (j, k)]
            share = thick[0] * tilt[0] + thick[1] * tilt[1]
            for i, inner, depth in ((j, -1.0, 0), (k, 1.0, 1)):
                inward[i] = inner * tilt[depth], 0.0
                smooth[i] = False
                room[i] = gap * thick[depth] / share
            if BOND * share.real >= 0.999 * gap.real:
                bonded.append((j, k))
    return Columns(s, outer, inward, room, present, beside, smooth, closed, tuple(bonded))


def depths(shell: Shell, columns: Columns) -> Numbers:
    """(J + 1, slots + 1) [m] depth of the interfaces at the nodes: means of the columns beside them, within their
    room."""
    slots = shell.slots
    stack = np.zeros((len(columns.present), int(slots.max(initial=-1)) + 1), dtype=columns.room.dtype)
    for k, slot in enumerate(slots):
        stack[:, slot] += columns.present[:, k] * shell.thickness[k]
    a, b = columns.beside
    depth = np.pad(np.cumsum(0.5 * (stack[a] + stack[b]), axis=1), ((0, 0), (1, 0)))
    bonded = {i for pair in columns.bonded for i in pair}
    for j in range(len(depth)):
        over = depth[j].real > (
            min(columns.room[j].real, depth[j, -1].real * (1.0 - 1e-12)) if j in bonded else columns.room[j].real
        )
        depth[j][over] = columns.room[j]
    return depth


def _crowded(shell: Shell, columns: Columns) -> list[int]:
    """Nodes beside columns whose inner side is short, or runs backwards; the shortest first."""
    depth = depths(shell, columns)[:, -1].real
    inner = columns.outer.real + depth[:, None] * columns.inward
    t = np.diff(columns.outer.real, axis=0)
    ratio = np.sum(np.diff(inner, axis=0) * t, axis=1) / np.sum(t * t, axis=1)
    bad = np.flatnonzero((ratio < CROWDED) & columns.present.any(axis=1))
    nodes = [j for c in bad[np.argsort(ratio[bad])] for j in (int(c), int(c) + 1) if 0 < j < len(t)]
    corners = [j for j in range(len(columns.s)) if np.any(np.abs(columns.s[j].real - shell.corners) < 1e-9)]
    close = [
        j
        for j in corners
        if any(0.0 < np.hypot(*(columns.outer[j] - columns.outer[i]).real) < depth[j] for i in corners)
    ]
    # two corners close together become one, others stay
    return sorted((j for j in dict.fromkeys(nodes) if j in close or j not in corners), key=lambda j: j in close)
