"""A frame in the sea as a part of the machine: loads of the water on its pieces, added mass, section loads of members.

Linear loads of the waves on pieces that are always wet act on the modes as series that are computed before a run; drag
follows the motion of each piece, and so does all that acts near the surface. Section loads are recovered from the loads
on the nodes and the load at the tower base, at output steps only.

Reference: docs/theory/frames.md (F-25 to F-49).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import (
    Array1,
    Array2,
    Constant,
    KernelRecord,
    Numbers,
    Single,
    Table,
    Vec,
    Vectors,
    View,
    kernel,
    number,
    whole,
    xyz,
)
from meltemi.core.errors import InputError
from meltemi.frames.checks import TOLERANCE
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import assemble
from meltemi.frames.kinematics import kinematics
from meltemi.frames.loads import Derived, Loads
from meltemi.frames.reduction import tower_base
from meltemi.frames.water import Pieces, added_mass, pieces, plates
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import cross, dot
from meltemi.sea.conditions import Sea, StillWater
from meltemi.sea.pile import SeaState, at, cubic
from meltemi.simulation.channels import Channel, channels_of_group
from meltemi.simulation.parts import Part
from meltemi.simulation.step import outer_forces, outer_section_loads
from meltemi.simulation.system import Outputs, System

Float = NDArray[np.float64]
REACTION, WATER = 0, 6
"""First rows of the loads of the ground on the frame, and of the water on it."""


class FrameWater(Table, title="water"):
    """The water around the frame."""

    density: float = number("kg/m^3", "density of the water")
    depth: float = number("m", "depth of still water")
    level: float = number("m", "level of still water above mean sea level")
    step: float = number("s", "interval between the samples of the kinematics")
    period: float = number("s", "period after which they repeat")
    deep: float = number("-", "number of pieces that are always wet")
    wet: float = number("-", "number of pieces that are ever wet")


class FramePiece(Table, axes="node"):
    """Constants of the pieces of members, from the lowest up; loads are those of a piece that is fully wet."""

    axis: Vectors = xyz("-", "direction of the member")
    low: Numbers = number("m", "lower end above mean sea level")
    high: Numbers = number("m", "upper end above mean sea level")
    drag: Numbers = number("kg/m", "drag across the member over velocity squared")
    plate: Numbers = number("kg/m", "drag along the member over velocity squared")
    added: Numbers = number("kg", "added mass across the member")
    along: Numbers = number("kg", "added mass along the member")


class FrameShape(Table, axes="mode node", outer=1):
    """Modes at the pieces."""

    displacement: Vectors = xyz("-", "displacement of the piece, inertial axes")


class PieceForce(Table, axes="node"):
    """Force of the water on the pieces."""

    force: Vectors = xyz("N", "drag, and near the surface all forces of the water, inertial axes")
    wet: Numbers = number("-", "share of the piece that is wet")


class FrameSection(Table, axes="station"):
    """Section loads of members, member axes; a run computes those that it records."""

    force_x: Numbers = number("N", "shear along the member's x")
    force_y: Numbers = number("N", "shear along the member's y")
    force_z: Numbers = number("N", "axial force in the wall")
    moment_x: Numbers = number("N m", "bending moment about the member's x")
    moment_y: Numbers = number("N m", "bending moment about the member's y")
    moment_z: Numbers = number("N m", "torsion")
    tension: Numbers = number("N", "effective tension")


class FrameBasis(Table, axes="part"):
    """Forces of the water on the pieces, load of the tower, accelerations and coordinates of the modes, and 1."""

    value: Numbers = number("-", "in this order, in SI units")


class FrameClock(Table):
    """Time of the last forces of the water."""

    time: float = number("s", "time")


class FrameSystem(System):
    """A turbine on a frame in the sea.

    Attributes:
      frame_pieces, frame_shape: pieces (P,) and modes at them.
      frame_flow: (T, 3 P) velocity of the water, with current.
      frame_force: (T, 3 P) forces of the waves on pieces that do not move, without drag.
      frame_surface: (T, P) elevation of the surface.
      frame_push: (T, 1 + k) elevation at the origin, and generalised forces of the waves on pieces that are always wet.
      frame_still: (k,) generalised forces of weight and still water.
      frame_added: (k, k) added mass of the pieces that are always wet.
      frame_whole: (3 P + 6 + 2 k + 1, 12) load of the ground, and of the water, by the entries of ``frame_basis``.
    """

    water: FrameWater
    sea: SeaState
    frame_clock: FrameClock
    frame_pieces: Single[FramePiece]
    frame_shape: Single[FrameShape]
    frame_piece: Single[PieceForce]
    frame_basis: FrameBasis
    frame_flow: Constant[Array2]
    frame_force: Constant[Array2]
    frame_surface: Constant[Array2]
    frame_push: Constant[Array2]
    frame_still: Constant[Array1]
    frame_added: Constant[Array2]
    frame_whole: Constant[Array2]


@kernel
def drag_force(v: Vec, e: Vec, drag: float, plate: float) -> Vec:
    """Drag [N] in relative velocity ``v`` of a piece along ``e`` (F-36)."""
    along = dot(v, e)
    across = v - along * e
    return drag * sqrt(dot(across, across)) * across + plate * abs(along) * along * e


@kernel
def velocity_of(n: int, m: FrameSystem) -> Vec:
    """Velocity [m/s] of a piece."""
    v = Vec(0.0, 0.0, 0.0)
    for k in range(m.frame_shape.modes):
        v += m.v[k] * m.frame_shape.displacement[k, n]
    return v


@outer_forces.variant
@kernel
def frame_forces(t: float, m: FrameSystem) -> None:
    """Forces of waves, drag and still water on the modes, and the added mass (F-43 to F-46)."""
    w, shape, piece, out = m.water, m.frame_shape, m.frame_pieces, m.frame_piece
    now, flow, modes = cubic(t, w.step, w.period), m.frame_flow, shape.modes
    m.frame_clock.time = t
    m.sea.elevation = at(now, m.frame_push, 0)
    for k in range(modes):
        m.core_force[k] += m.frame_still[k] + at(now, m.frame_push, 1 + k)
        for j in range(k + 1):
            m.core_mass[k, j] += m.frame_added[k, j]
    for n in range(whole(w.deep)):
        if piece.drag[n] + piece.plate[n] == 0.0:
            continue
        i = 3 * n
        v = Vec(at(now, flow, i), at(now, flow, i + 1), at(now, flow, i + 2)) - velocity_of(n, m)
        F = drag_force(v, piece.axis[n], piece.drag[n], piece.plate[n])
        out.force[n] = F
        for k in range(modes):
            m.core_force[k] += dot(shape.displacement[k, n], F)
    for n in range(whole(w.deep), whole(w.wet)):
        surface, i = w.level + at(now, m.frame_surface, n), 3 * n
        low, high = piece.low[n], piece.high[n]
        share = min(max((surface - low) / max(high - low, 1e-3), 0.0), 1.0)
        out.wet[n] = share
        e, f = piece.axis[n], m.frame_force
        v = Vec(at(now, flow, i), at(now, flow, i + 1), at(now, flow, i + 2)) - velocity_of(n, m)
        F = drag_force(v, e, piece.drag[n], piece.plate[n])
        F += Vec(at(now, f, i), at(now, f, i + 1), at(now, f, i + 2))
        out.force[n] = share * F
        for k in range(modes):
            s = shape.displacement[k, n]
            m.core_force[k] += share * dot(s, F)
            for j in range(k + 1):
                r = shape.displacement[j, n]
                along = dot(s, e) * dot(r, e)
                m.core_mass[k, j] += share * (piece.added[n] * (dot(s, r) - along) + piece.along[n] * along)


@kernel
def force_on(n: int, m: FrameSystem) -> Vec:
    """Force [N] of the water on a piece at the last instant, with added mass."""
    w, piece, f, i = m.water, m.frame_pieces, m.frame_force, 3 * n
    now, F, wet = cubic(m.frame_clock.time, w.step, w.period), m.frame_piece.force[n], 1.0
    if n < w.deep:
        F += Vec(at(now, f, i), at(now, f, i + 1), at(now, f, i + 2))
    else:
        wet = m.frame_piece.wet[n]
    a, e = Vec(0.0, 0.0, 0.0), piece.axis[n]
    for k in range(m.frame_shape.modes):
        a += m.a[k] * m.frame_shape.displacement[k, n]
    along = dot(a, e)
    return F - wet * (piece.added[n] * (a - along * e) + piece.along[n] * along * e)


@outer_section_loads.variant
@kernel
def frame_section_loads(m: FrameSystem, s: Outputs) -> None:
    """Loads from which those of members follow, and those of ground and water (F-25, F-29)."""
    x, R, modes, sea = m.frame_basis.value, m.frame_whole, m.frame_shape.modes, m.sea
    moved, turned = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(modes):
        moved += m.q[k] * m.tower_shape.displacement[k, 0]
        turned += m.q[k] * m.tower_shape.rotation[k, 0]
    # the deflection of the tower is relative to its base
    s.chain.top_deflection -= moved + cross(turned, Vec(0.0, 0.0, m.structure.tower_length))
    F = s.tower_station.force[0]
    M = s.tower_station.moment[0] + cross(moved, F)
    for n in range(whole(m.water.wet)):
        W = force_on(n, m)
        x[3 * n], x[3 * n + 1], x[3 * n + 2] = W.x, W.y, W.z
    i = R.shape[0] - 7 - 2 * modes
    x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5] = F.x, F.y, F.z, M.x, M.y, M.z
    for k in range(modes):
        x[i + 6 + k] = m.a[k]
        x[i + 6 + modes + k] = m.q[k]
    x[i + 6 + 2 * modes] = 1.0 + 0.0 * F.x
    sea.reaction, sea.reaction_moment = product(REACTION, m), product(REACTION + 3, m)
    sea.force, sea.moment = product(WATER, m), product(WATER + 3, m)
    # loads of the tower base are in its axes, which tilt with it
    tilted = rotation(turned).T
    s.tower_station.force[0] = tilted @ s.tower_station.force[0]
    s.tower_station.moment[0] = tilted @ s.tower_station.moment[0]


@kernel
def product(j: int, m: FrameSystem) -> Vec:
    """Three rows of the load of ground and water."""
    y = Vec(0.0, 0.0, 0.0)
    for i in range(m.frame_whole.shape[0]):
        y += m.frame_basis.value[i] * Vec(m.frame_whole[i, j], m.frame_whole[i, j + 1], m.frame_whole[i, j + 2])
    return y


@dataclass(frozen=True)
class FramePart(Part):
    """Frame of a model, in still water.

    Attributes:
      loads: what its section loads follow from.
      constants: arrays of the records.
    """

    system: ClassVar[type[KernelRecord] | None] = FrameSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        "sea": SeaState,
        "frame_piece": PieceForce,
        "frame_basis": FrameBasis,
        "frame_section": FrameSection,
        "frame_clock": FrameClock,
    }
    afterwards: ClassVar[tuple[str, ...]] = ("frame_section",)
    loads: Loads
    constants: dict[str, Float]

    @property
    def shown(self) -> tuple[str, ...]:
        """Elevation, force of the water, reactions of the ground."""
        reactions = ("mudline_reaction_force_x", "mudline_reaction_moment_x", "mudline_reaction_moment_y")
        return ("wave_elevation", "sea_force_x", *reactions)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        basis = len(self.constants["frame_whole"])
        sizes = {"node": len(self.loads.pieces.low), "station": len(self.loads.sections), "part": basis}
        return {name: table.shape(**sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Constants of the frame, and still water."""
        return {name: each.copy() for name, each in self.constants.items()}

    def channels(self) -> Sequence[Channel]:
        """The sea, its loads, those of the ground, and section loads of members."""
        return (*channels_of_group("sea"), *channels_of_group("frame"), *self.loads.channels)

    def notices(self, channels: Sequence[Channel]) -> list[str]:
        """Ends of members that act like plates, as those of published decks of jackets do by mistake."""
        if not (joints := plates(self.loads.assembly, self.loads.pieces)):
            return []
        words = f"frame.ends: at {len(joints)} joints where members meet, {joints[0]} the first of them, drag and added"
        words += " mass of members' ends act on the water like plates; set both to 0, unless you compare with a program"
        return [f"{words} that has them"]

    def derived(self, channels: Sequence[Channel], parts: Sequence[Part]) -> Derived | None:
        """Section loads of members, by a matrix from what the time loop records (F-27)."""
        water = View(FrameWater, next((p.water for p in parts if isinstance(p, FrameSea)), self.constants)["water"])
        loads, p = self.loads.at_level(float(water["level"])), self.loads.pieces
        used = [*range(3 * int(water["wet"])), *range(3 * len(p.low), len(self.constants["frame_whole"]))]
        still = still_forces(p, loads.assembly.frame.water_density, loads.level, loads.gravity)
        return loads.derived(channels, used, still)

    def in_sea(self, sea: Any, duration: float, origin: tuple[float, float], gravity: float) -> FrameSea:
        """The sea of a run.

        Raises:
          InputError: waves break, the level is too low, or the sea does not last.
        """
        return FrameSea(in_water(self.loads, self.constants, sea, duration, origin))


@dataclass(frozen=True)
class FrameSea(Part):
    """The sea of a run, in place of still water."""

    water: dict[str, Any]

    def arrays(self) -> dict[str, Any]:
        """Arrays that replace those of still water."""
        return {name: each.copy() for name, each in self.water.items()}


def still_forces(p: Pieces, density: float, level: float, gravity: float) -> Float:
    """(P, 3) [N] pressure of still water on fully wet pieces, across by their volume and along by their ends (F-39)."""
    up = np.array([0.0, 0.0, 1.0])
    across = p.volume[:, None] * (up - p.axis[:, 2:] * p.axis)
    depth = np.maximum(level - p.place[:, 2], 0.0)
    result: Float = density * gravity * (across + (depth * p.still_area)[:, None] * p.axis)
    return result


def wave_forces(p: Pieces, acceleration: Float, pressure: Float) -> Float:
    """(T, P, 3) [N] forces on pieces that do not move by acceleration (T, P, 3) and pressure (T, P) of waves (F-43)."""
    along = (acceleration * p.axis).sum(axis=2)
    axial = (p.along - p.inertial) * along + p.area * pressure
    result: Float = p.inertial[:, None] * acceleration + axial[..., None] * p.axis
    return result


def in_water(
    loads: Loads, constants: dict[str, Float], sea: Sea, duration: float, origin: tuple[float, float]
) -> dict[str, Float]:
    """Arrays of a frame in a sea (F-43 to F-47).

    Raises:
      InputError: waves break, the level is too low, or the sea does not last.
    """
    loads = loads.at_level(sea.level)
    p, frame, rho, gravity = loads.pieces, loads.assembly.frame, loads.assembly.frame.water_density, loads.gravity
    depth = frame.depth + sea.level
    if depth <= 1.0:
        raise InputError(f"sea.level: {sea.level:g} m leaves {depth:g} m of water at a depth of {frame.depth:g} m")
    place = p.place - np.array([0.0, 0.0, sea.level])
    k = kinematics(
        sea.components(depth, duration, gravity),
        depth,
        np.concatenate([place, np.zeros((1, 3))]),  # the elevation at the tower's axis is a channel
        duration,
        stretching=sea.stretching,
        radius=np.append(p.radius, 0.0),
        gravity=gravity,
        origin=origin,
    )
    flow, surface = k.velocity[:, :-1], k.elevation[:, :-1]
    still = still_forces(p, rho, sea.level, gravity)
    force = wave_forces(p, k.acceleration[:, :-1], rho * gravity * k.pressure[:, :-1]) + still
    if sea.current is not None:
        flow = flow + np.column_stack([sea.current.at(place[:, 2], depth), np.zeros(len(place))])
    moving = sea.stretching != "none"
    low, high = (sea.level + moving * each for each in (surface.min(initial=0.0), surface.max(initial=0.0)))
    deep = int(np.searchsorted(p.high, low + TOLERANCE, side="right"))
    wet = max(deep, int(np.flatnonzero(p.low < high).max(initial=-1)) + 1)
    water = constants["water"].copy()
    v = View(FrameWater, water)
    v["depth"], v["level"], v["step"], v["period"], v["deep"], v["wet"] = depth, sea.level, k.dt, k.period, deep, wet
    shape = loads.shape
    push = force[:, :deep].reshape(len(flow), -1) @ shape[:, :deep].reshape(len(shape), -1).T
    return {
        "water": water,
        "frame_flow": np.ascontiguousarray(flow.reshape(len(flow), -1)),
        "frame_force": np.ascontiguousarray(force.reshape(len(flow), -1)),
        "frame_surface": np.ascontiguousarray(surface) * moving,
        "frame_push": np.ascontiguousarray(np.column_stack([k.elevation[:, -1], push])),
        "frame_added": added_mass(p, shape, deep),
        "frame_whole": loads.of_ground_and_water(still),
        "frame_still": loads.generalised,
    }


def part_of(turbine: Any, options: Any, rotor: Any) -> FramePart:
    """The frame of a turbine; arguments and errors as for ``simulation.parts.parts_of``."""
    frame: Frame = turbine.frame
    assembly = assemble(frame, tower_base(frame, turbine.tower))
    loads = Loads(assembly, pieces(assembly), rotor.tower.below, rotor.tower.gravity)
    p = loads.pieces
    k, count = len(loads.below), len(p.low)
    nodes = FramePiece.zeros(node=count)
    v = View(FramePiece, nodes)
    v["axis"] = p.axis.T
    for name in ("low", "high", "drag", "plate", "added", "along"):
        v[name] = getattr(p, name)
    water = FrameWater.zeros()
    v = View(FrameWater, water)
    v["density"] = frame.water_density
    constants = {
        "water": water,
        "frame_pieces": nodes,
        "frame_shape": np.ascontiguousarray(loads.shape.transpose(0, 2, 1).reshape(3 * k, count)),
    }
    return FramePart(loads, constants | in_water(loads, constants, StillWater(), 1.0, (0.0, 0.0)))
