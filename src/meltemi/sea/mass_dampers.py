"""Tuned mass dampers in tower or nacelle, as a part of the model: a mass on springs that moves along one or two axes.

Dampers in blades, which the same record describes, are in ``blade_dampers``.

Reference: docs/theory/sea.md (H-45 to H-48).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.compiler import KernelRecord, Numbers, Single, Table, Vec, View, kernel, number
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.maths.vectors import cross
from meltemi.simulation.channels import Channel
from meltemi.simulation.parts import Part, StateRows
from meltemi.simulation.step import (
    begin_parts,
    begin_parts_step,
    end_parts_step,
    outer_forces,
    outer_section_loads,
    part_rates,
)
from meltemi.simulation.system import Control, Outputs, System
from meltemi.turbine.exchange import TowerShape

Float = NDArray[np.float64]
FEATURE = "mass dampers"
FAR = 1e9
"""[m] displacement at a stop where there is none."""
LIVELY = 1.0
"""Largest angular frequency of a mass on its spring and stop times the time step."""


class MassDamper(Record):
    """A mass that moves along axes of tower or blade against springs and dampers; its mass is not part of theirs."""

    height: float | None = Field(default=None, ge=0.0)
    """[m] height above the tower base; above the tower top the damper is in the nacelle."""
    span: float | None = Field(default=None, ge=0.0)
    """[m] distance from the blade root, in place of ``height``."""
    blades: tuple[int, ...] = ()
    """Numbers of the blades that have one; all by default."""
    angle: float | None = Field(default=None, ge=-np.pi, le=np.pi)
    """[rad] angle of its axes from those of the blade, towards feather; by default the twist of the section."""
    mass: float = Field(gt=0.0)
    """[kg; 50 to 1e5 at 100 m] moving mass."""
    axes: Literal["x", "y", "xy"] = "x"
    """Along which it moves: fore-aft, side-side, or both, in a blade flapwise and edgewise; it is carried along the
    others."""
    stiffness: float = Field(gt=0.0)
    """[N/m; 10 to 1e6 at 100 m] stiffness of the spring along each axis."""
    damping: float = Field(default=0.0, ge=0.0)
    """[N s/m; 1 to 1e6 at 100 m] coefficient of the damper along each axis."""
    stops: tuple[float, float] | None = None
    """[m] displacements at the stops; none by default."""
    stop_stiffness: float = Field(default=0.0, ge=0.0)
    """[N/m; 1e2 to 1e9] stiffness of a stop, besides the spring."""
    stop_damping: float = Field(default=0.0, ge=0.0)
    """[N s/m] damping coefficient of a stop, while the mass moves into it."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.height is None) == (self.span is None):
            raise ValueError("expected either height (tower, nacelle) or span (blade)")
        if len(set(self.blades)) < len(self.blades):
            raise ValueError("blades: a blade is named twice")
        if self.span is None and (self.blades or self.angle is not None):
            raise ValueError("blades and angle are those of a damper in a blade; give span in place of height")
        if self.stops is not None and not self.stops[0] < 0.0 < self.stops[1]:
            raise ValueError(f"stops: expected one below and one above 0, found {self.stops[0]:g}, {self.stops[1]:g} m")
        if (self.stops is None) != (self.stop_stiffness == 0.0):
            raise ValueError("stops and stop_stiffness come together")
        return self


class Mover(Table, axes="node"):
    """Constants of the masses, one entry for each axis along which one moves."""

    mass: Numbers = number("kg", "mass that moves along the axis")
    across: Numbers = number("kg", "mass that the tower carries along the other horizontal axis")
    weight: Numbers = number("kg", "mass that the tower carries vertically: half of a mass with two axes")
    x: Numbers = number("-", "component of the axis along x")
    y: Numbers = number("-", "component of the axis along y")
    stiffness: Numbers = number("N/m", "stiffness of the spring")
    damping: Numbers = number("N s/m", "damping coefficient of the damper")
    low: Numbers = number("m", "displacement at the lower stop")
    high: Numbers = number("m", "displacement at the upper stop")
    stop_stiffness: Numbers = number("N/m", "stiffness of the stops")
    stop_damping: Numbers = number("N s/m", "damping coefficient of the stops")
    height: Numbers = number("m", "height above the tower base")


class MoverState(Table, axes="node"):
    """Motion of the masses relative to the tower."""

    position: Numbers = number("m", "state: displacement along the axis")
    velocity: Numbers = number("m/s", "state: its velocity, predicted")
    acceleration: Numbers = number("m/s^2", "rate of the velocity")
    earlier: Numbers = number("m/s^2", "acceleration one step before")
    held: Numbers = number("m/s", "velocity at the begin of the step")
    begun: Numbers = number("-", "1 after the first step")
    force: Numbers = number("N", "force of spring, damper and stop on the tower along the axis")


class DamperControl(Control):
    """Control of a turbine with mass dampers."""


class DamperSystem(System):
    """A turbine with mass dampers."""

    mover: Single[Mover]
    mover_shape: Single[TowerShape]
    mover_state: Single[MoverState]
    d_mover_state: Single[MoverState]


@kernel
def pull(x: float, v: float, n: int, p: Any) -> float:
    """Force [N] of spring, damper and stop on the structure along the axis (H-45); ``p`` has the springs."""
    force = p.stiffness[n] * x + p.damping[n] * v
    beyond = max(x - p.high[n], 0.0) + min(x - p.low[n], 0.0)
    into = max(v, 0.0) if beyond > 0.0 else min(v, 0.0)
    return force + p.stop_stiffness[n] * beyond + (p.stop_damping[n] * into if beyond * beyond > 0.0 else 0.0 * into)


@kernel
def lean(n: int, m: DamperSystem) -> float:
    """Acceleration [m/s^2] of the mass along the axis by gravity due to the tilt of the tower (H-46)."""
    p, shape, acceleration = m.mover, m.mover_shape, 0.0
    for k in range(shape.modes):
        r = shape.rotation[k, n]
        acceleration += m.structure.gravity * m.q[k] * (r.y * p.x[n] - r.x * p.y[n])
    return acceleration


@kernel
def drive(n: int, m: DamperSystem) -> float:
    """Acceleration [m/s^2] of the mass along the axis by gravity and the tower's motion (H-46)."""
    p, shape, acceleration = m.mover, m.mover_shape, lean(n, m)
    for k in range(shape.modes):
        u = shape.displacement[k, n]
        acceleration -= m.a[k] * (u.x * p.x[n] + u.y * p.y[n])
    return acceleration


@begin_parts.variant
@kernel
def _(dt: float, c: DamperControl, m: DamperSystem) -> None:
    s = m.mover_state
    for n in range(s.nodes):
        hanging = m.mover.mass[n] / m.mover.stiffness[n] * lean(n, m)
        s.position[n] = min(max(hanging, m.mover.low[n]), m.mover.high[n])
        s.velocity[n] = s.acceleration[n] = s.earlier[n] = s.held[n] = s.begun[n] = 0.0


@outer_forces.variant
@kernel
def damper_forces(t: float, m: DamperSystem) -> None:
    """Forces of the masses on the tower coordinates, and masses supported by the tower in the mass matrix (H-47)."""
    p, shape, s, g = m.mover, m.mover_shape, m.mover_state, m.structure.gravity
    for n in range(s.nodes):
        force, lever = pull(s.position[n], s.velocity[n], n, p), p.mass[n] * g * s.position[n]
        s.force[n] = force
        for k in range(shape.modes):
            u, r = shape.displacement[k, n], shape.rotation[k, n]
            m.core_force[k] += force * (u.x * p.x[n] + u.y * p.y[n]) + lever * (r.y * p.x[n] - r.x * p.y[n])
            m.core_force[k] -= p.weight[n] * g * u.z
            for j in range(k + 1):
                w = shape.displacement[j, n]
                aside = (u.y * p.x[n] - u.x * p.y[n]) * (w.y * p.x[n] - w.x * p.y[n])
                m.core_mass[k, j] += p.across[n] * aside + p.weight[n] * u.z * w.z


@begin_parts_step.variant
@kernel
def _(dt: float, m: DamperSystem) -> None:
    """Advance the masses with the predictor of the coordinates, so that they move consistently with them."""
    s = m.mover_state
    for n in range(s.nodes):
        if s.begun[n] == 0.0:
            s.acceleration[n] = s.earlier[n] = drive(n, m) - s.force[n] / m.mover.mass[n]
            s.begun[n] = 1.0
        v, a = s.velocity[n], s.acceleration[n]
        s.position[n] += dt * (v + 0.5 * dt * a)
        s.velocity[n] = v + dt * (1.5 * a - 0.5 * s.earlier[n])
        s.held[n] = v
        s.earlier[n] = a


@end_parts_step.variant
@kernel
def _(dt: float, m: DamperSystem) -> None:
    s = m.mover_state
    for n in range(s.nodes):
        s.acceleration[n] = drive(n, m) - s.force[n] / m.mover.mass[n]
        s.velocity[n] = s.held[n] + 0.5 * dt * (s.earlier[n] + s.acceleration[n])


@part_rates.variant
@kernel
def _(m: DamperSystem) -> None:
    for n in range(m.mover_state.nodes):
        m.d_mover_state.position[n] = m.mover_state.velocity[n]
        m.d_mover_state.velocity[n] = drive(n, m) - m.mover_state.force[n] / m.mover.mass[n]


@outer_section_loads.variant
@kernel
def damper_section_loads(m: DamperSystem, s: Outputs) -> None:
    """Loads of the masses at the stations of the tower below them, and at the yaw bearing from the nacelle (H-48)."""
    p, shape, state, g = m.mover, m.mover_shape, m.mover_state, m.structure.gravity
    stations, out, turned = s.tower_stations, s.tower_station, m.machine.top.T
    for n in range(state.nodes):
        u, a = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            u += m.q[k] * shape.displacement[k, n]
            a += m.a[k] * shape.displacement[k, n]
        aside = p.across[n] * (a.y * p.x[n] - a.x * p.y[n])
        fx, fy = state.force[n] * p.x[n] + aside * p.y[n], state.force[n] * p.y[n] - aside * p.x[n]
        F = Vec(fx, fy, -p.weight[n] * (g + a.z))
        lever = p.mass[n] * g * state.position[n]
        M = Vec(-lever * p.y[n], lever * p.x[n], 0.0)
        place = u + Vec(0.0, 0.0, m.structure.tower_base + p.height[n])
        for i in range(out.stations):
            if stations[i] < p.height[n]:
                share, cut = stations[i] / p.height[n], Vec(0.0, 0.0, m.structure.tower_base + stations[i])
                # deflection of the cut: that of the mass by the square of its height, for the arm of the weight only
                out.force[i] += F
                out.moment[i] += M + cross(place - cut - share * share * Vec(u.x, u.y, 0.0), F)
        if p.height[n] >= m.structure.tower_length:
            arm = place - m.machine.top_position
            s.chain.yaw_force += turned @ F
            s.chain.yaw_moment += turned @ (M + cross(arm, F))


@dataclass(frozen=True)
class DamperPart(Part):
    """The mass dampers of a model."""

    control: ClassVar[type[KernelRecord] | None] = DamperControl
    system: ClassVar[type[KernelRecord] | None] = DamperSystem
    signals: ClassVar[dict[str, type[Table]]] = {"mover_state": MoverState}
    mover: Float
    mover_shape: Float
    names: tuple[str, ...]

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        return {"mover_state": MoverState.shape(node=len(self.names))}

    def arrays(self) -> dict[str, Any]:
        """Constants and rates."""
        arrays = {"mover": self.mover.copy(), "mover_shape": self.mover_shape.copy()}
        return arrays | {"d_mover_state": MoverState.zeros(node=len(self.names))}

    def channels(self) -> Sequence[Channel]:
        """Displacement of each mass, and its force on the tower."""
        kinds = (("position", "m", "displacement"), ("force", "N", "force on the tower"))
        return [
            Channel(
                f"mass_damper_{name}_{row}",
                "",
                unit,
                "tower",
                "along its axis",
                f"{what} of mass damper {name}",
                ("mover_state", row),
                (i,),
            )
            for i, name in enumerate(self.names)
            for row, unit, what in kinds
        ]

    def states(self) -> Sequence[StateRows]:
        """Displacements and velocities."""
        names = [
            f"mass damper {name.replace('_', ' ')} {row}" for row in ("position", "velocity") for name in self.names
        ]
        units = ["m"] * len(self.names) + ["m/s"] * len(self.names)
        return (StateRows("mover_state", "d_mover_state", tuple(names), tuple(units)),)


def check_step(turbine: Any, i: int, d: MassDamper, step: float | None) -> None:
    """Raise InputError if a time step [s] is too long for spring and stop of damper ``i``."""
    fastest = float(np.sqrt((d.stiffness + d.stop_stiffness) / d.mass))
    if step is not None and fastest * step > LIVELY:
        raise InputError(
            f"{turbine.name}: mass_dampers.{i}: spring and stop have {fastest:.3g} rad/s, too fast for a step of "
            f"{step:g} s; use at most {LIVELY / fastest:.2g} s (options.time_step), or a softer stop"
        )


def part_of(turbine: Any, options: Any, rotor: Any) -> DamperPart:
    """The mass dampers of a turbine; arguments and errors as for ``simulation.parts.parts_of``.

    Raises:
      InputError: the time step is too long for a spring or stop.
    """
    member, length = rotor.tower, turbine.tower.length
    dampers = [(i, d) for i, d in enumerate(turbine.mass_dampers, start=1) if d.height is not None]
    movers = [(i, d, axis) for i, d in dampers for axis in d.axes]
    table = Mover.zeros(node=len(movers))
    v = View(Mover, table)
    below = turbine.tower.base_height - float(turbine.support.position[0]) if turbine.support is not None else 0.0
    shape = np.zeros((6 * len(member.names), len(movers)))
    for n, (i, d, axis) in enumerate(movers):
        one = len(d.axes) == 1
        low, high = d.stops or (-FAR, FAR)
        values = [d.mass, d.mass if one else 0.0, d.mass if one else 0.5 * d.mass, axis == "x", axis == "y"]
        values += (d.stiffness, d.damping, low, high, d.stop_stiffness, d.stop_damping, d.height)
        for name, value in zip(Mover.names, values, strict=True):
            v[name][n] = float(value)
        at = member.modes.at(np.array([below + min(d.height, length)]))[:, 0, :].copy()
        arm = max(d.height - length, 0.0)
        at[:, 0] += arm * at[:, 4]
        at[:, 1] -= arm * at[:, 3]
        shape[:, n] = at.reshape(-1)
        check_step(turbine, i, d, options.time_step)
    return DamperPart(table, shape, tuple(f"{i}_{axis}" for i, d, axis in movers))
