"""Members of a platform cut into pieces: drag, and where potential flow does not have it, inertia and buoyancy.

Reference: docs/theory/floating.md (W-16 to W-20); Morison et al. (1950).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector
from meltemi.floating.potential import HydroCoefficients
from meltemi.sea.airy import profiles, wave_number
from meltemi.sea.field import summed, times

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

PIECE = 2.0
"""[m] longest piece."""
FARTHEST = 500.0
"""[m] largest distance of a member from the tower's axis at still water."""
FREQUENCY = np.arange(0.02, 5.0, 0.02)
HEADING = np.arange(-180.0, 181.0, 10.0)
"""[rad/s], [deg] frequencies and headings of the excitation of a platform without potential flow."""


class Member(Record):
    """A column, pontoon or plate: a round cylinder or cone. Forces act on what is below still water at rest.

    The coefficients of inertia and pressure are for members outside of potential flow; with it they stay 0.
    """

    start: Vector
    """(3,) [m] x, y, and height above still water of one end; for a column the lower one."""
    end: Vector
    """(3,) [m] position of the other end."""
    diameter: float = Field(gt=0.0)
    """[m; 0.2 to 60] diameter at the start."""
    end_diameter: float | None = Field(default=None, gt=0.0)
    """[m] diameter at the end; by default ``diameter``."""
    drag: float = Field(default=0.0, ge=0.0)
    """Drag coefficient [-; 0.2 to 3] across the member, over its diameter."""
    added_mass: float = Field(default=0.0, ge=0.0)
    """Added mass across the member, over the mass of the water displaced [-; 0.2 to 2]."""
    pressure: float = Field(default=0.0, ge=0.0)
    """Share of the pressure of the undisturbed wave on its side [-; 0.5 to 1]: 1 without potential flow."""
    plate_drag: float = Field(default=0.0, ge=0.0)
    """Drag coefficient [-; 0.4 to 12] along the member of its start as a plate, over its section."""
    plate_added_mass: float = Field(default=0.0, ge=0.0)
    """Added mass along the member of its start, over that of water in half a ball of this diameter [-; 0.2 to 3]."""
    plate_pressure: float = Field(default=0.0, ge=0.0)
    """Share of the pressure of the undisturbed wave on its start [-; 0.5 to 1]: 1 for a free end without potential
    flow."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("start", "end"):
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} must have 3 entries, x, y, z [m], found {len(getattr(self, name))}")
            if (most := float(np.abs(getattr(self, name)).max())) > FARTHEST:
                raise ValueError(f"{name}: {most:g} m from the tower's axis at still water; at most {FARTHEST:g} m")
        if not np.linalg.norm(self.end - self.start) > 0.0:
            raise ValueError("start and end are the same point")
        return self

    @property
    def diameters(self) -> tuple[float, float]:
        """[m] diameters at start and end."""
        return self.diameter, self.diameter if self.end_diameter is None else self.end_diameter


@dataclass(frozen=True)
class Pieces:
    """The submerged parts of members in pieces (P,); the start of a member is a piece without length.

    Attributes:
      place: (P, 3) [m] middle; axis: (P, 3).
      volume: [m^3]; drag, plate: [m^2] half the drag coefficient times area, across and along.
      added, along: [m^3] added mass over density, across and along; pushed: [m^3] volume that the wave pushes across;
      area: [m^2] area on which the pressure acts along the axis.
    """

    place: Float
    axis: Float
    volume: Float
    drag: Float
    plate: Float
    added: Float
    along: Float
    pushed: Float
    area: Float


def pieces(members: Sequence[Member]) -> Pieces:
    """Members under still water in pieces of equal length (W-16)."""
    rows: list[list[Any]] = []
    for each in members:
        wet = _wet(each)
        if wet is None:
            continue
        a, b, (first, last) = wet
        axis = (each.end - each.start) / np.linalg.norm(each.end - each.start)
        size = float(np.linalg.norm(b - a))
        n = int(np.ceil(size / PIECE))
        d = np.linspace(first, last, n + 1)
        section = 0.25 * np.pi * d**2
        for i in range(n):
            volume = size / n * np.pi / 12.0 * (d[i] ** 2 + d[i] * d[i + 1] + d[i + 1] ** 2)
            drag = 0.25 * each.drag * (d[i] + d[i + 1]) * size / n
            across = [volume, drag, 0.0, each.added_mass * volume, 0.0]
            pushed = [(each.added_mass + each.pressure) * volume, each.pressure * (section[i + 1] - section[i])]
            rows.append([a + (i + 0.5) / n * (b - a), axis, *across, *pushed])
        if each.start[2] <= 0.0:
            half_ball = each.plate_added_mass * np.pi / 12.0 * first**3
            along = [0.5 * each.plate_drag * section[0], 0.0, half_ball, 0.0, each.plate_pressure * section[0]]
            rows.append([a, axis, 0.0, 0.0, *along])
    columns = list(zip(*rows, strict=True)) if rows else [()] * 9
    vectors = [np.array(column, dtype=np.float64).reshape(-1, 3) for column in columns[:2]]
    return Pieces(*vectors, *(np.array(column, dtype=np.float64) for column in columns[2:]))


def _wet(member: Member) -> tuple[Float, Float, tuple[float, float]] | None:
    """Ends and diameters of the part of a member under still water."""
    ends, d = np.stack([member.start, member.end]), np.array(member.diameters)
    z = ends[:, 2]
    if z.min() >= 0.0:
        return None
    share = np.array([0.0, 1.0])
    if z.max() > 0.0:
        share[int(np.argmax(z))] = -z[0] / (z[1] - z[0])
    a, b = ends[0] + share[:, None] * (ends[1] - ends[0])
    first, last = d[0] + share * (d[1] - d[0])
    return a, b, (float(first), float(last))


def at_rest(members: Sequence[Member]) -> tuple[float, Float, Float]:
    """Volume [m^3] under still water, its centre (3,) [m], and stiffness (6, 6) over density and gravity (W-17)."""
    p = pieces(members)
    V = float(p.volume.sum())
    x, y, z = centre = p.volume @ p.place / max(V, 1e-300)
    C = np.zeros((6, 6))
    for each in members:
        if each.start[2] * each.end[2] < 0.0 and (wet := _wet(each)):
            top = int(each.end[2] > 0.0)
            cut, radius = wet[top], 0.5 * wet[2][top]
            slope = float(np.linalg.norm(each.end - each.start)) / abs(each.end[2] - each.start[2])
            A, inertia = np.pi * radius**2 * slope, 0.25 * np.pi * radius**4 * slope
            arm = np.array([1.0, cut[1], -cut[0]])
            C[2:5, 2:5] += A * np.outer(arm, arm) + np.diag([0.0, inertia, inertia])
    C[3, 3] += V * z
    C[4, 4] += V * z
    C[3, 5], C[4, 5] = -V * x, -V * y
    return V, centre, C


def with_members(
    c: HydroCoefficients | None, members: Sequence[Member], depth: float, gravity: float
) -> HydroCoefficients:
    """Coefficients with inertia and pressure of members besides potential flow, or without it, buoyancy too.

    Args:
      c: potential flow; None without.
      depth: [m] depth of the water.
    """
    if c is None:
        one = np.zeros((len(FREQUENCY), 6, 6))
        push = np.zeros((len(FREQUENCY), len(HEADING), 6), dtype=np.complex128)
        c = HydroCoefficients(FREQUENCY, one, one, one[0], HEADING, push, at_rest(members)[2])
    p = pieces(members)
    if not (p.added.any() or p.along.any() or p.pushed.any() or p.area.any()):
        return c
    added = np.zeros((6, 6))
    for r, e, across, along in zip(p.place, p.axis, p.added, p.along, strict=True):
        T = np.hstack([np.eye(3), np.cross(np.eye(3), r).T])
        added += T.T @ (across * (np.eye(3) - np.outer(e, e)) + along * np.outer(e, e)) @ T
    X = np.stack([_excitation(p, c.frequency, b, depth, gravity) for b in np.radians(c.heading)], axis=1)
    return replace(c, added_mass=c.added_mass + added, infinite=c.infinite + added, excitation=c.excitation + X)


def _excitation(p: Pieces, frequency: Float, direction: float, depth: float, gravity: float) -> Complex:
    """(F, 6) force per wave amplitude over density and gravity, of inertia and pressure (W-18, W-19)."""
    k = wave_number(frequency, depth, gravity)
    phase = np.exp(-1j * np.outer(p.place[:, 0] * np.cos(direction) + p.place[:, 1] * np.sin(direction), k))
    velocity = _velocity(p.place, frequency, k, np.full(len(k), direction), depth)
    a = 1j * frequency[:, None] * velocity / gravity  # (P, F, 3)
    along = np.einsum("pfx,px->pf", a, p.axis)
    pressure = profiles(k, p.place[:, 2], depth)[2] * phase
    axial = (p.along - p.pushed)[:, None] * along + p.area[:, None] * pressure
    force = p.pushed[:, None, None] * a + axial[..., None] * p.axis[:, None]
    moment = np.cross(p.place[:, None], force)
    return np.concatenate([force.sum(axis=0), moment.sum(axis=0)], axis=1)


def _velocity(place: Float, frequency: Float, k: Float, direction: Float, depth: float) -> Complex:
    """(P, F, 3) velocity of the water per wave amplitude at places."""
    x, y = np.cos(direction), np.sin(direction)
    along, up, _ = profiles(k, place[:, 2], depth)
    phase = frequency * np.exp(-1j * k * (np.outer(place[:, 0], x) + np.outer(place[:, 1], y)))
    return np.stack([along * phase * x, along * phase * y, 1j * up * phase], axis=-1)


def flow_at(
    place: Float,
    sea: Any,
    depth: float,
    duration: float,
    origin: tuple[float, float],
    gravity: float,
    sums: bool = False,
) -> Float:
    """(T, 3 P) [m/s] velocity of waves and current at places (P, 3), at the times of the forces of the waves (W-20)."""
    waves = sea.components(depth, duration, gravity)
    dt, count, total = times(waves, duration, sums)
    k = wave_number(waves.frequency, depth, gravity)
    position = place + np.array([*origin, 0.0])
    velocity = waves.amplitude[:, None] * _velocity(position, waves.frequency, k, waves.direction, depth)
    series = summed(waves, velocity.transpose(0, 2, 1).reshape(-1, len(k)), dt, count, total)
    if sea.current is not None:
        steady = np.column_stack([sea.current.at(place[:, 2], depth), np.zeros(len(place))])
        series += steady.reshape(-1, 1)
    return np.ascontiguousarray(series.T)
