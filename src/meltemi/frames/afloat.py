"""The frame of a flexible floating platform as a part of the machine: its modes in the water, section loads of members.

The platform's part has the six motions and all loads of potential flow and lines, which act on the mean motion of the
hull. This part adds what the modes feel besides: forces of still water and of waves on members, less their spread
resultant, and the added mass of motion about the mean.

Reference: docs/theory/frames.md (F-70 to F-76).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Array2, Constant, KernelRecord, Numbers, Table, Vec, View, kernel
from meltemi.floating.balance import turbine_weight
from meltemi.floating.base import WHOLE_LOAD, FloaterSystem, six
from meltemi.floating.floater import floater_loads
from meltemi.floating.moving_base import base_row
from meltemi.floating.waves import excitation
from meltemi.frames.hull import Bodies, Spread, afloat, bodies_of, by_water_plane, hull_spread, rigid_motions
from meltemi.frames.kinematics import kinematics
from meltemi.frames.loads import Derived, Loads
from meltemi.frames.part import FrameBasis, FrameClock, FrameSea, FrameSection, FrameWater, still_forces, wave_forces
from meltemi.frames.recovery import Recovery
from meltemi.frames.reduction import tower_base
from meltemi.frames.water import liquid_inside, pieces
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import cross
from meltemi.sea.airy import wave_number
from meltemi.sea.conditions import StillWater
from meltemi.sea.field import amplitudes_at, summed, times
from meltemi.sea.pile import at, cubic
from meltemi.simulation.channels import Channel
from meltemi.simulation.parts import Part
from meltemi.simulation.step import outer_forces, outer_section_loads
from meltemi.simulation.system import Outputs
from meltemi.structure.beam import transfer

Float = NDArray[np.float64]
TOWER, WATER, PLACE, FALL, MODES = 0, 6, 12, 15, 21
"""First entries of ``frame_basis``: load of the tower on its base, of the water, heave, roll and pitch, gravity less
acceleration of the tower's base with its negative angular acceleration, accelerations of the modes. Forces of the lines
on their fairleads, those on the pieces, and 1 follow; all in axes of the base."""


class AfloatSystem(FloaterSystem):
    """A turbine on a flexible floating platform.

    Attributes:
      frame_force: (T, 3 P) forces of waves and still water on the wet pieces less their spread resultant.
      frame_push: (T, k) their generalised forces on the modes, less those of all loads at rest.
      frame_added: (k, k) added mass of motion about the mean of the hull.
    """

    water: FrameWater
    frame_clock: FrameClock
    frame_basis: FrameBasis
    frame_force: Constant[Array2]
    frame_push: Constant[Array2]
    frame_added: Constant[Array2]


@outer_forces.variant
@kernel
def frame_forces_afloat(t: float, m: AfloatSystem) -> None:
    """Forces of the water on the modes besides those of the mean of the hull, and their added mass (F-75)."""
    now = cubic(t, m.water.step, m.water.period)
    m.frame_clock.time = t
    for k in range(m.frame_push.shape[1]):
        m.core_force[k] += at(now, m.frame_push, k)
        for j in range(k + 1):
            m.core_mass[k, j] += m.frame_added[k, j]


@kernel
def put(x: Numbers, i: int, u: Vec) -> None:
    """Set three neighbours."""
    x[i], x[i + 1], x[i + 2] = u.x, u.y, u.z


@outer_section_loads.variant
@kernel
def frame_loads_afloat(m: AfloatSystem, s: Outputs) -> None:
    """Loads and accelerations from which the section loads of members follow (F-76)."""
    floater_loads(m, s)
    x, p, base, columns, n, shape = m.frame_basis.value, m.platform, m.base, m.base_columns, base_row(m), m.tower_shape
    R, rise, turning = base.orientation, base.acceleration, base.spin_rate
    for k in range(columns.coordinates):
        rise += m.a[n + k] * columns.linear[k]
        turning += m.a[n + k] * columns.angular[k]
    moved, turned = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(n):
        moved += m.q[k] * shape.displacement[k, 0]
        turned += m.q[k] * shape.rotation[k, 0]
        x[MODES + k] = m.a[k]
    # the deflection of the tower is relative to its base, and the loads there are in its axes
    s.chain.top_deflection -= moved + cross(turned, Vec(0.0, 0.0, m.structure.tower_length))
    F, M = s.tower_station.force[0], s.tower_station.moment[0]
    put(x, TOWER, F)
    put(x, TOWER + 3, M + cross(moved, F))
    tilted = rotation(turned).T
    s.tower_station.force[0], s.tower_station.moment[0] = tilted @ F, tilted @ M
    water, moment = six(WHOLE_LOAD, m)
    put(x, WATER, R.T @ water)
    put(x, WATER + 3, R.T @ moment)
    put(x, PLACE, Vec(p.displacement.z, p.angle.x, p.angle.y))
    put(x, FALL, R.T @ (Vec(0.0, 0.0, -m.structure.gravity) - rise))
    put(x, FALL + 3, -1.0 * (R.T @ turning))
    i, now = MODES + n, cubic(m.frame_clock.time, m.water.step, m.water.period)
    for k in range(m.line_order.lines):  # type: ignore[attr-defined]
        put(x, i + 3 * k, R.T @ m.line_load.pull[k])
    i += 3 * m.line_order.lines  # type: ignore[attr-defined]
    for k in range(m.frame_force.shape[1]):
        x[i + k] = at(now, m.frame_force, k)
    x[i + m.frame_force.shape[1]] = 1.0


@dataclass(frozen=True)
class AfloatLoads(Loads):
    """Section loads of members of a floating frame; the base of their matrix is described at ``TOWER`` (F-76).

    Attributes:
      platform: its platform.
      turbine_mass: [kg] mass on the tower's base.
    """

    platform: Any
    turbine_mass: float

    @cached_property
    def spread(self) -> Spread:
        """How loads of the water spread over pieces."""
        return hull_spread(self.assembly, self.platform, self.pieces)

    @cached_property
    def bodies(self) -> Bodies | None:
        """The bodies of the platform, if there are several."""
        return bodies_of(self.assembly, self.platform, self.pieces)

    @property
    def deep(self) -> int:
        """Number of pieces below still water."""
        return int(np.searchsorted(self.pieces.high, 1e-6))

    @property
    def about_mean(self) -> Float:
        """(k, P, 3) displacement of the pieces by the modes about the mean motion of the hull."""
        mean: Float = np.einsum("pia,ka->kpi", self.spread.arms, self.spread.mean(self.shape))
        return self.shape - mean

    @cached_property
    def at_rest(self) -> Float:
        """(k,) generalised forces at rest in still water, from which the frame has its shape (F-75)."""
        a, p = self.assembly, self.pieces
        weight = (rigid_motions(a.points)[2] @ a.mass) @ self.below.reshape(len(self.below), -1).T
        weight = weight + self.turbine_mass * self.below[:, -1, 2]
        lift = (self.platform.mass + self.turbine_mass) * self.spread.mean(self.shape)[:, 2]
        still = still_forces(p, a.frame.water_density, 0.0, self.gravity)
        still[self.deep :] = 0.0
        local = np.einsum("pi,kpi->k", self.spread.balanced(still), self.shape)
        result: Float = self.gravity * (lift - weight) + local
        return result

    def by_basis(self, r: Recovery, count: int, still: Float) -> Float:
        """(B, C) loads of sections by the entries of the basis (F-76)."""
        a, on_pieces, plane = self.assembly, self.of_pieces(r, count), by_water_plane(self.pieces)
        by_hull, by_plane = (each.forces.reshape(-1, 6).T @ on_pieces for each in (self.spread, plane))
        lift = -self.gravity * a.frame.water_density * plane.total[:, 2:5]
        rigid = rigid_motions(a.points - a.points[-1]).reshape(6, -1, 6)
        added = self.spread.weighted(self.about_mean).reshape(len(self.below), -1)
        inside, on_walls = liquid_inside(a)
        weight = a.line_loads(np.outer(a.elements.fill, [0.0, 0.0, 1.0]))  # that of the liquid is among the masses
        nodes, ends = self.gravity * inside, self.gravity * (on_walls + weight) + a.pretension
        return np.vstack(
            [
                r.interface[:count].T,
                by_hull,
                lift.T @ (by_plane - by_hull),
                self.of_motion(r, rigid, count),
                -self.of_motion(r, self.below, count) - added @ on_pieces,
                self._of_lines(r, count),
                on_pieces[: 3 * self.deep],
                r.loads(nodes + a.nodal(ends), ends)[None, :count],
            ]
        )

    def _of_lines(self, r: Recovery, count: int) -> Float:
        """(3 L, C) loads of sections by forces of the lines on the joints nearest to their fairleads."""
        joints, nodal = self.assembly.frame.joints, r.nodal[:count].reshape(count, -1, 6)
        result = np.zeros((len(self.platform.lines), 3, count))
        for i, line in enumerate(self.platform.lines):
            if not isinstance(line.fairlead, str):
                name = min(joints, key=lambda each: float(np.linalg.norm(joints[each] - line.fairlead)))
                arm = transfer(line.fairlead - joints[name])[:3]
                result[i] = arm @ nodal[:, self.assembly.joint_nodes[name]].T
        return result.reshape(-1, count)


@dataclass(frozen=True)
class AfloatPart(Part):
    """Frame of the platform of a model, in still water.

    Attributes:
      loads: what its section loads follow from.
      constants: arrays of the records.
    """

    system: ClassVar[type[KernelRecord] | None] = AfloatSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        "frame_basis": FrameBasis,
        "frame_section": FrameSection,
        "frame_clock": FrameClock,
    }
    afterwards: ClassVar[tuple[str, ...]] = ("frame_section",)
    loads: AfloatLoads
    constants: dict[str, Float]

    @property
    def basis(self) -> int:
        """Number of entries of the basis."""
        return MODES + len(self.loads.below) + 3 * len(self.loads.platform.lines) + 3 * self.loads.deep + 1

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        sizes = {"station": len(self.loads.sections), "part": self.basis}
        return {name: table.shape(**sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Constants of the frame, and still water."""
        return {name: each.copy() for name, each in self.constants.items()}

    def channels(self) -> Sequence[Channel]:
        """Section loads of members."""
        return self.loads.channels

    def derived(self, channels: Sequence[Channel], parts: Sequence[Part]) -> Derived | None:
        """Section loads of members, by a matrix from what the time loop records (F-76)."""
        return self.loads.derived(channels, range(self.basis), np.zeros((0, 3)))

    def in_sea(self, sea: Any, duration: float, origin: tuple[float, float], gravity: float) -> FrameSea:
        """The waves of a run on members, up to still water."""
        return FrameSea(in_waves(self.loads, sea, duration, origin, gravity))


def in_waves(loads: AfloatLoads, sea: Any, duration: float, origin: tuple[float, float], gravity: float) -> Any:
    """Arrays of a floating frame in a sea (F-75, F-78)."""
    p, frame, deep = loads.pieces, loads.assembly.frame, loads.deep
    depth = frame.depth + sea.level
    waves = sea.components(depth, duration, gravity)
    k = kinematics(waves, depth, p.place, duration, stretching="none", radius=p.radius, gravity=gravity, origin=origin)
    force = wave_forces(p, k.acceleration, frame.water_density * gravity * k.pressure)
    force[:, deep:] = 0.0
    if (bodies := loads.bodies) is not None and len(waves.frequency):  # their resultants are those of potential flow
        amplitude = amplitudes_at(waves, wave_number(waves.frequency, depth, gravity), origin)
        lines = frame.water_density * gravity * amplitude * excitation(bodies.coefficients, waves).T
        flat = force.reshape(len(force), -1)
        flat += (summed(waves, lines, *times(waves, duration)).T - flat @ bodies.arms) @ bodies.forces.T
    force[:, :deep] += still_forces(p, frame.water_density, 0.0, gravity)[:deep]
    force = loads.spread.balanced(force)
    flat = force.reshape(len(force), -1)
    water = FrameWater.zeros()
    v = View(FrameWater, water)
    v["density"], v["depth"], v["level"], v["deep"], v["wet"] = frame.water_density, depth, sea.level, deep, deep
    v["step"], v["period"] = k.dt, k.period
    return {
        "water": water,
        "frame_force": np.ascontiguousarray(flat[:, : 3 * deep]),
        "frame_push": np.ascontiguousarray(flat @ loads.shape.reshape(len(loads.shape), -1).T - loads.at_rest),
    }


def part_of(turbine: Any, options: Any, rotor: Any) -> AfloatPart:
    """The frame of a turbine's platform; arguments as for ``simulation.parts.parts_of``.

    Raises:
      InputError: the frame does not belong to the platform.
    """
    assembly = afloat(turbine.frame, turbine.platform, tower_base(turbine.frame, turbine.tower))
    loads = AfloatLoads(
        assembly, pieces(assembly), rotor.tower.below, rotor.tower.gravity, turbine.platform, turbine_weight(turbine)[0]
    )
    about = loads.about_mean
    still = in_waves(loads, StillWater(), 1.0, (0.0, 0.0), loads.gravity)
    added = np.einsum("kpi,lpi->kl", about, loads.spread.weighted(about))
    return AfloatPart(loads, still | {"frame_added": added})
