"""Tuned mass dampers in blades, as a part of the turbine model.

A mass is a particle at the end of an arm on the blade node that is closest to it. Along its axes, which turn with the
section, it is supported by springs; along the others by the blade, so that its inertia there is in the mass matrix and
the reaction contains known accelerations only.

Reference: docs/theory/sea.md (H-45, H-49 to H-55); La Cava & Lackner, theory of OpenFAST's StC.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import (
    Constant,
    KernelRecord,
    Numbers,
    Rot,
    Rotations,
    Single,
    Table,
    Vec,
    Vectors,
    View,
    kernel,
    number,
    rotation,
    whole,
    xyz,
)
from meltemi.core.errors import InputError
from meltemi.maths.vectors import cross, dot
from meltemi.sea.mass_dampers import FAR, check_step, pull
from meltemi.simulation.channels import Channel
from meltemi.simulation.parts import Part, StateRows
from meltemi.simulation.step import (
    begin_parts,
    begin_parts_step,
    end_parts_step,
    outer_blade_loads,
    outer_forces,
    outer_section_loads,
    part_drive_rates,
    part_rates,
)
from meltemi.simulation.system import Control, Outputs, System
from meltemi.structure.blades import station_place
from meltemi.structure.chain import motion
from meltemi.structure.tables import BladePartial
from meltemi.turbine.exchange import BladeMotion

Float = NDArray[np.float64]
FEATURE = "mass dampers"
SWEEPS = 3
"""Sweeps of the equilibrium of a mass: one is exact for one axis, two axes are weakly coupled."""


class Rider(Table, axes="damper"):
    """Constants of the masses, one for each blade that has the damper; spring and stops as in ``Mover``."""

    mass: Numbers = number("kg", "mass of the damper")
    stiffness: Numbers = number("N/m", "stiffness of the spring")
    damping: Numbers = number("N s/m", "damping coefficient of the damper")
    low: Numbers = number("m", "displacement at the lower stop")
    high: Numbers = number("m", "displacement at the upper stop")
    stop_stiffness: Numbers = number("N/m", "stiffness of the stops")
    stop_damping: Numbers = number("N s/m", "damping coefficient of the stops")
    span: Numbers = number("m", "distance from the blade root")
    blade: Numbers = number("-", "index of the blade")
    node: Numbers = number("-", "index of the node that carries it")
    first: Numbers = number("-", "index of its first axis among those along which masses move")
    x: Numbers = number("-", "1 if it moves along the first axis")
    y: Numbers = number("-", "1 if it moves along the second axis")
    arm: Vectors = xyz("m", "position of the mass at rest relative to the node, undeformed, blade axes")
    frame: Rotations = rotation("-", "axes of the damper in those of the blade, undeformed")


class RiderLoad(Table, axes="damper"):
    """Masses and their loads on the blades."""

    free: Numbers = number("-", "1 when the mass moves; in steady operation it rests in the blade")
    begun: Numbers = number("-", "1 after the first step")
    applied: Numbers = number("-", "1 when the load is among those of the blade, after an evaluation")
    force: Vectors = xyz("N", "force of the mass on the blade, blade axes")
    place: Vectors = xyz("m", "mass from the rotor apex, blade axes")

    dampers: int


class Slide(Table, axes="slider"):
    """Motion of the masses relative to the blades, one entry for each axis along which one moves."""

    position: Numbers = number("m", "state: displacement along the axis")
    velocity: Numbers = number("m/s", "state: its velocity, predicted")
    acceleration: Numbers = number("m/s^2", "rate of the velocity")
    earlier: Numbers = number("m/s^2", "acceleration one step before")
    held: Numbers = number("m/s", "velocity at the begin of the step")
    force: Numbers = number("N", "force of spring, damper and stop on the blade along the axis")

    sliders: int


class Swing(Table, axes="coordinate"):
    """Partial velocities of a mass."""

    velocity: Vectors = xyz(
        "- or m", "partial velocities by coordinates below the blades, then by those of its blade; axes of the damper"
    )


class BladeDamperControl(Control):
    """Control of a turbine with mass dampers in blades."""


class BladeDamperSystem(System):
    """A turbine with mass dampers in blades."""

    rider: Constant[Rider]
    rider_load: RiderLoad
    slide: Slide
    d_slide: Slide
    swing: Swing
    motion_alone: Single[BladeMotion]
    partial_alone: Single[BladePartial]

    SAME = {"motion_alone": "motion", "partial_alone": "partial"}  # noqa: RUF012


# motion -------------------------------------------------------------------------------------------------


@kernel
def second(n: int, m: BladeDamperSystem) -> int:
    """Index among the sliders of motion along y; that along x, if any, is the one before."""
    p = m.rider
    return whole(p.first[n]) + whole(p.x[n] * p.y[n])


@kernel
def place(n: int, m: BladeDamperSystem) -> tuple[Vec, Rot]:
    """Mass from its node, and its axes; blade axes (H-49)."""
    p, s, i, j = m.rider, m.slide, whole(m.rider.first[n]), second(n, m)
    R = m.motion_alone.orientation[whole(p.blade[n]), whole(p.node[n])]
    E = R @ p.frame[n]
    return R @ p.arm[n] + E @ Vec(p.x[n] * s.position[i], p.y[n] * s.position[j], 0.0), E


@kernel
def known(n: int, arm: Vec, E: Rot, m: BladeDamperSystem) -> Vec:
    """Known acceleration of a mass minus gravity, in its axes: node, spin, Coriolis (H-50)."""
    p, s, motion, i, j = m.rider, m.slide, m.motion_alone, whole(m.rider.first[n]), second(n, m)
    b, k = whole(p.blade[n]), whole(p.node[n])
    w = motion.spin[b, k]
    sliding = E @ Vec(p.x[n] * s.velocity[i], p.y[n] * s.velocity[j], 0.0)
    a = motion.acceleration[b, k] + cross(motion.spin_rate[b, k], arm) + cross(w, cross(w, arm) + 2.0 * sliding)
    return E.T @ (a - m.frame.orientation[b].T @ Vec(0.0, 0.0, -m.structure.gravity))


@kernel
def partial_velocities(n: int, arm: Vec, E: Rot, m: BladeDamperSystem) -> None:
    """Fill ``swing`` with the partial velocities of a mass, in its axes (H-51)."""
    p, u, columns, partial = m.rider, m.swing.velocity, m.columns, m.partial_alone
    b, k = whole(p.blade[n]), whole(p.node[n])
    R = m.frame.orientation[b]
    to, r = R @ E, R @ (m.motion_alone.position[b, k] + arm)
    for j in range(columns.coordinates):
        u[j] = to.T @ (columns.linear[j] + cross(columns.angular[j], r))
    for j in range(partial.modes):
        u[columns.coordinates + j] = E.T @ (partial.velocity[j, b, k] + cross(partial.rotation[j, b, k], arm))


@kernel
def acceleration(n: int, m: BladeDamperSystem) -> Vec:
    """Acceleration of a mass minus gravity, without its relative acceleration along the axes, in its axes (H-50)."""
    arm, E = place(n, m)
    partial_velocities(n, arm, E, m)
    a, core, modes = known(n, arm, E, m), m.columns.coordinates, m.partial_alone.modes
    for j in range(core):
        a += m.a[j] * m.swing.velocity[j]
    first = core + modes * whole(m.rider.blade[n])
    for j in range(modes):
        a += m.a[first + j] * m.swing.velocity[core + j]
    return a


@kernel
def slide_rates(n: int, m: BladeDamperSystem) -> tuple[float, float]:
    """Accelerations of a mass along its axes relative to the blade (H-52)."""
    a, p = acceleration(n, m), m.rider
    i, j = whole(p.first[n]), second(n, m)
    return -a.x - m.slide.force[i] / p.mass[n], -a.y - m.slide.force[j] / p.mass[n]


@kernel
def carried(n: int, m: BladeDamperSystem) -> Vec:
    """Mass [kg] that the blade supports along the axes of a damper."""
    p, free = m.rider, m.rider_load.free[n]
    return Vec(p.mass[n] * (1.0 - free * p.x[n]), p.mass[n] * (1.0 - free * p.y[n]), p.mass[n])


@kernel
def reaction(n: int, a: Vec, m: BladeDamperSystem) -> Vec:
    """Force on the blade for the acceleration ``a`` minus gravity, both in the axes of the mass (H-53)."""
    p, s, free, M = m.rider, m.slide, m.rider_load.free[n], carried(n, m)
    fx, fy = free * p.x[n] * s.force[whole(p.first[n])], free * p.y[n] * s.force[second(n, m)]
    return Vec(fx - M.x * a.x, fy - M.y * a.y, -M.z * a.z)


@kernel
def settle(n: int, m: BladeDamperSystem) -> None:
    """Displacement at which a mass is in equilibrium with its spring as it turns with the blade (H-55)."""
    p, s, b = m.rider, m.slide, whole(m.rider.blade[n])
    for _ in range(SWEEPS):
        arm, E = place(n, m)
        a, w, stiff = known(n, arm, E, m), E.T @ m.motion_alone.spin[b, whole(p.node[n])], p.stiffness[n] / p.mass[n]
        for axis in range(2):
            if (p.x[n] if axis == 0 else p.y[n]) > 0.0:
                k = whole(p.first[n]) if axis == 0 else second(n, m)
                across = w.z * w.z + (w.y * w.y if axis == 0 else w.x * w.x)
                pushed = -(a.x if axis == 0 else a.y) - stiff * s.position[k]
                # if the rotation overcomes the spring, the mass is at a stop
                x = s.position[k] + pushed / (stiff - across) if stiff > across else pushed * FAR
                s.position[k] = min(max(x, p.low[n]), p.high[n])


# hooks --------------------------------------------------------------------------------------------------


@begin_parts.variant
@kernel
def _(dt: float, c: BladeDamperControl, m: BladeDamperSystem) -> None:
    s = m.slide
    for i in range(s.sliders):
        s.velocity[i] = s.acceleration[i] = s.earlier[i] = s.held[i] = 0.0
    motion(m)
    for n in range(m.rider_load.dampers):
        # a run releases the masses; otherwise (trim, means) they are at rest in the blade
        m.rider_load.free[n] = 1.0 if dt > 0.0 else 0.0
        m.rider_load.begun[n] = 0.0
        settle(n, m)


@part_drive_rates.variant
@kernel
def _(c: BladeDamperControl, m: BladeDamperSystem) -> None:
    """Only linear models call this; there displacements are states."""
    for n in range(m.rider_load.dampers):
        m.rider_load.free[n] = 1.0


@outer_forces.variant
@kernel
def blade_damper_forces(t: float, m: BladeDamperSystem) -> None:
    """Forces of the masses on all coordinates, and masses supported by the blade in the mass matrix (H-54)."""
    p, s, load, u, core = m.rider, m.slide, m.rider_load, m.swing.velocity, m.columns.coordinates
    for n in range(load.dampers):
        if load.free[n] == 0.0:
            settle(n, m)
        i, j, b = whole(p.first[n]), second(n, m), whole(p.blade[n])
        s.force[i] = pull(s.position[i], s.velocity[i], n, p)
        s.force[j] = pull(s.position[j], s.velocity[j], n, p)
        arm, E = place(n, m)
        partial_velocities(n, arm, E, m)
        F, M = reaction(n, known(n, arm, E, m), m), carried(n, m)
        load.applied[n] = 0.0
        load.place[n] = m.motion_alone.position[b, whole(p.node[n])] + arm
        for k in range(core):
            m.core_force[k] += dot(u[k], F)
            P = Vec(M.x * u[k].x, M.y * u[k].y, M.z * u[k].z)
            for r in range(k + 1):
                m.core_mass[k, r] += dot(u[r], P)
        for k in range(m.partial_alone.modes):
            v = u[core + k]
            m.arm_force[b, k] += dot(v, F)
            P = Vec(M.x * v.x, M.y * v.y, M.z * v.z)
            for r in range(core):
                m.coupling[b, k, r] += dot(u[r], P)
            for r in range(k + 1):
                m.arm_mass[b, k, r] += dot(u[core + r], P)


@begin_parts_step.variant
@kernel
def _(dt: float, m: BladeDamperSystem) -> None:
    """Advance the masses with the predictor of the coordinates, so that they move consistently with them."""
    s, load = m.slide, m.rider_load
    for n in range(load.dampers):
        if load.begun[n] == 0.0:
            i, j = whole(m.rider.first[n]), second(n, m)
            x, y = slide_rates(n, m)
            s.acceleration[j] = s.earlier[j] = y
            if m.rider.x[n] > 0.0:
                s.acceleration[i] = s.earlier[i] = x
            load.begun[n] = load.free[n] = 1.0
    for i in range(s.sliders):
        v, a = s.velocity[i], s.acceleration[i]
        s.position[i] += dt * (v + 0.5 * dt * a)
        s.velocity[i] = v + dt * (1.5 * a - 0.5 * s.earlier[i])
        s.held[i] = v
        s.earlier[i] = a


@end_parts_step.variant
@kernel
def _(dt: float, m: BladeDamperSystem) -> None:
    s = m.slide
    for n in range(m.rider_load.dampers):
        i, j = whole(m.rider.first[n]), second(n, m)
        x, y = slide_rates(n, m)
        s.acceleration[j] = y
        if m.rider.x[n] > 0.0:
            s.acceleration[i] = x
    for i in range(s.sliders):
        s.velocity[i] = s.held[i] + 0.5 * dt * (s.earlier[i] + s.acceleration[i])


@part_rates.variant
@kernel
def _(m: BladeDamperSystem) -> None:
    d = m.d_slide
    for n in range(m.rider_load.dampers):
        i, j = whole(m.rider.first[n]), second(n, m)
        x, y = slide_rates(n, m)
        d.velocity[j] = y
        if m.rider.x[n] > 0.0:
            d.velocity[i] = x
    for i in range(d.sliders):
        d.position[i] = m.slide.velocity[i]


@outer_blade_loads.variant
@kernel
def _(m: BladeDamperSystem) -> None:
    p, load = m.rider, m.rider_load
    for n in range(load.dampers):
        if load.applied[n] == 0.0:
            load.applied[n] = 1.0
            b, R = whole(p.blade[n]), m.motion_alone.orientation[whole(p.blade[n]), whole(p.node[n])]
            load.force[n] = (R @ p.frame[n]) @ reaction(n, acceleration(n, m), m)
            m.body.force[b] += load.force[n]
            m.body.torque[b] += cross(load.place[n], load.force[n])


@outer_section_loads.variant
@kernel
def _(m: BladeDamperSystem, s: Outputs) -> None:
    """Loads of the masses at the stations of the blades inboard of them."""
    p, load, out, nodes = m.rider, m.rider_load, s.station, s.blade_edges.shape[0] - 1
    for n in range(load.dampers):
        b = whole(p.blade[n])
        for i in range(out.stations):
            if s.blade_stations[i] < p.span[n]:
                out.force[b, i] += load.force[n]
                arm = load.place[n] - station_place(m, s.blade_stations[i], b, nodes)
                out.moment[b, i] += cross(arm, load.force[n])


# description --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class BladeDamperPart(Part):
    """The mass dampers in the blades of a model.

    Attributes:
      sliders: number of the damper, axis and blade of each motion; ``full`` the dampers that every blade has.
      coordinates: number of those below the blades and of one blade.
    """

    control: ClassVar[type[KernelRecord] | None] = BladeDamperControl
    system: ClassVar[type[KernelRecord] | None] = BladeDamperSystem
    signals: ClassVar[dict[str, type[Table]]] = {"slide": Slide, "rider_load": RiderLoad}
    rider: Float
    sliders: tuple[tuple[int, str, int], ...]
    full: frozenset[int]
    coordinates: int

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        dampers = self.rider.shape[1]
        return {"slide": Slide.shape(slider=len(self.sliders)), "rider_load": RiderLoad.shape(damper=dampers)}

    def arrays(self) -> dict[str, Any]:
        """Constants, rates, and partial velocities."""
        arrays = {"rider": self.rider.copy(), "d_slide": Slide.zeros(slider=len(self.sliders))}
        return arrays | {"swing": Swing.zeros(coordinate=self.coordinates)}

    def channels(self) -> Sequence[Channel]:
        """Displacement of each mass, and the force of its spring on the blade."""
        kinds = (("position", "m", "displacement"), ("force", "N", "force on the blade"))
        return [
            Channel(
                f"mass_damper_{i}_{axis}_{row}_{blade}",
                "",
                unit,
                "blade section",
                "along its axis",
                f"{what} of mass damper {i} of blade {blade}",
                ("slide", row),
                (k,),
            )
            for k, (i, axis, blade) in enumerate(self.sliders)
            for row, unit, what in kinds
        ]

    def states(self) -> Sequence[StateRows]:
        """Displacements and velocities; in linear models in the fixed frame those of three blades are transformed."""
        names = [
            f"blade {blade} mass damper {i} {axis} {row}"
            if i in self.full
            else f"mass damper {i} {axis} {row} in blade {blade}"
            for row in ("position", "velocity")
            for i, axis, blade in self.sliders
        ]
        units = ["m"] * len(self.sliders) + ["m/s"] * len(self.sliders)
        return (StateRows("slide", "d_slide", tuple(names), tuple(units)),)


def part_of(turbine: Any, options: Any, rotor: Any) -> BladeDamperPart:
    """The mass dampers in blades of a turbine; arguments and errors as for ``simulation.parts.parts_of``.

    Raises:
      InputError: a damper is beyond the blade, in a blade that does not exist, or too soft for the rotation; or the
        time step is too long for a spring or stop.
    """
    structure, beam, B = turbine.blade.structure, rotor.blade.beam, turbine.n_blades
    dampers = [(i, d) for i, d in enumerate(turbine.mass_dampers, start=1) if d.span is not None]
    riders = [(i, d, blade) for i, d in dampers for blade in (d.blades or range(1, B + 1))]
    table, sliders = Rider.zeros(damper=len(riders)), list[tuple[int, str, int]]()
    v = View(Rider, table)
    for n, (i, d, blade) in enumerate(riders):
        where = f"{turbine.name}: mass_dampers.{i}"
        if d.span > turbine.blade.length:
            raise InputError(f"{where}.span: {d.span:g} m is beyond the blade of {turbine.blade.length:g} m")
        if not 1 <= blade <= B:
            raise InputError(f"{where}.blades: expected numbers of blades from 1 to {B}, found {blade}")
        check_step(turbine, i, d, options.time_step)
        angle = np.interp(d.span, structure.position, structure.twist) if d.angle is None else d.angle
        c, s = cos(angle), sin(angle)
        for axis, out in (("x", c), ("y", s)):
            # rotation softens the spring in the rotor plane; ``out`` is the out-of-plane share of the axis
            soft = d.mass * (1.0 - out * out) * turbine.rated_rotor_speed**2
            if axis in d.axes and d.stops is None and d.stiffness <= soft:
                raise InputError(
                    f"{where}.stiffness: {d.stiffness:g} N/m cannot hold the mass along {axis} as it rotates at rated "
                    f"speed; use more than {soft:.4g} N/m, or stops"
                )
        node = int(np.argmin(np.abs(rotor.blade_layout.position - d.span)))
        at = beam.at(np.array([d.span, rotor.blade_layout.position[node]]), "axis")
        for name in ("mass", "stiffness", "damping", "stop_stiffness", "stop_damping", "span"):
            v[name][n] = getattr(d, name)
        v["low"][n], v["high"][n] = d.stops or (-FAR, FAR)
        v["blade"][n], v["node"][n], v["first"][n] = blade - 1, node, len(sliders)
        v["x"][n], v["y"][n] = float("x" in d.axes), float("y" in d.axes)
        v["arm"][:, n] = at[0] - at[1]
        v["frame"][:, n] = (c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0)
        sliders += [(i, axis, blade) for axis in d.axes]
    full = frozenset(i for i, d in dampers if len(set(d.blades or range(B))) == B)
    return BladeDamperPart(table, tuple(sliders), full, rotor.n_core + len(rotor.blade.names))
