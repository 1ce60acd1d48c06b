"""A floating platform as a part of the machine: water, waves, radiation, drag, weight and mooring lines at its base.

All act on the six motions of the tower base, the last coordinates of the tower. Coefficients of the water are about the
platform's point on the tower's axis at still water, which moves with it, in inertial axes.

Reference: docs/theory/floating.md (W-4, W-7 to W-15, W-39, W-42).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, degrees, exp, pi, sin, sqrt
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Array2, Array3, KernelRecord, Rot, Sym, Table, Vec, View, by_record, kernel, whole
from meltemi.core.errors import InputError
from meltemi.floating.balance import check_balance, check_reach
from meltemi.floating.base import (
    AGAINST_CURRENT,
    BODY_DRAG,
    BODY_VELOCITY,
    FURTHER_LOAD,
    PLACE,
    WATER_LOAD,
    WHOLE_LOAD,
    DragStrip,
    Floater,
    FloaterSystem,
    PlatformState,
    RadiationState,
    column,
    first_moving,
    keep_six,
    point_motion,
    six,
)
from meltemi.floating.coefficients import platform_coefficients
from meltemi.floating.consistency import check_coefficients
from meltemi.floating.members import flow_at, pieces, with_members
from meltemi.floating.mooring import (
    INNER,
    NONE,
    Line,
    LineLoad,
    PointState,
    dyad,
    half_of,
    holds,
    is_held,
    moved_string,
    pulls,
    settle,
    string_forces,
)
from meltemi.floating.moorings import mooring_tables
from meltemi.floating.moving_base import add_to_base, moving_base
from meltemi.floating.platform import Platform
from meltemi.floating.potential import HydroCoefficients
from meltemi.floating.radiation import Radiation, fit_radiation
from meltemi.floating.waves import HEADINGS, displaced_forces, mean_drift, wave_forces
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import cross, dot
from meltemi.sea.airy import GRAVITY
from meltemi.sea.field import AHEAD, BEHIND
from meltemi.sea.pile import Instant, at, cubic
from meltemi.simulation.channels import Channel, channels_of_group
from meltemi.simulation.parts import ParameterTables, Part, StateRows
from meltemi.simulation.step import (
    DIVERGED,
    begin_parts_step,
    check_parts,
    outer_forces,
    outer_section_loads,
    part_rates,
)
from meltemi.simulation.system import March, Outputs
from meltemi.turbine.definition import BaseMotion

Float = NDArray[np.float64]
MOTIONS = tuple(f"platform_{motion}" for motion in get_args(BaseMotion))
ADDED, WATER, FURTHER, LINEAR, QUADRATIC = 0, 6, 12, 18, 24
"""First rows of the matrices."""
CAPSIZED = pi / 3.0
"""[rad] tilt beyond which a platform turns over, far beyond that for which the stiffness of the water is linear."""


@kernel
def tilt_of(R: Rot) -> float:
    """Tilt [rad] of the vertical axis of an orientation."""
    return atan2(sqrt(R.xz * R.xz + R.yz * R.yz), R.zz)


@kernel
def strip_drag(now: Instant, R: Rot, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Force and moment of drag, in velocities relative to that of the water at the places at rest (W-20)."""
    p, s, f = m.platform, m.strip, m.float_flow
    F, M = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for n in range(s.strips):  # type: ignore[attr-defined]
        r, e, k = R @ s.place[n], R @ s.axis[n], 3 * n
        v = Vec(at(now, f, k), at(now, f, k + 1), at(now, f, k + 2)) - (p.velocity + cross(p.spin, r))
        along = dot(v, e)
        across = v - along * e
        G = s.drag[n] * sqrt(dot(across, across)) * across + s.plate[n] * abs(along) * along * e
        F += G
        M += cross(r, G)
    return F, M


@kernel
def three(x: Array3, i: int, j: int, k: int) -> Vec:
    """Three neighbours as a vector."""
    return Vec(x[i, j, k], x[i, j, k + 1], x[i, j, k + 2])


@kernel
def displaced_waves(t: float, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Forces of the waves at the platform's place, in the axes of its heading, wave by wave (W-39)."""
    r, w, X = m.platform.displacement, m.float_lines, m.float_forces
    turn = HEADINGS * (1.0 + m.platform.angle.z / (2.0 * pi))
    i = whole(turn)
    s, i, j = turn - i, i % HEADINGS, (i + 1) % HEADINGS
    F, M = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for n in range(w.shape[0]):
        phase = w[n, 0] * t - w[n, 1] * r.x - w[n, 2] * r.y
        c, d = cos(phase), sin(phase)
        a, b, c, d = (1.0 - s) * c, (1.0 - s) * d, s * c, s * d
        F += a * three(X, i, n, 0) - b * three(X, i, n, 6) + (c * three(X, j, n, 0) - d * three(X, j, n, 6))
        M += a * three(X, i, n, 3) - b * three(X, i, n, 9) + (c * three(X, j, n, 3) - d * three(X, j, n, 9))
    return F, M


@kernel
def part_of_six(x: Array2, n: int, j: int) -> tuple[Vec, Vec]:
    """Six neighbours in a row as two vectors."""
    return Vec(x[n, j], x[n, j + 1], x[n, j + 2]), Vec(x[n, j + 3], x[n, j + 4], x[n, j + 5])


@kernel
def radiated(m: FloaterSystem) -> tuple[Vec, Vec]:
    """Force and moment of the waves that past motion has radiated (W-4, W-5)."""
    x, F, M = m.radiation, Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for n in range(x.modes):
        (f, g), (h, k) = part_of_six(m.float_output, n, 0), part_of_six(m.float_output, n, 6)
        F -= x.real[n] * f - x.imaginary[n] * h
        M -= x.real[n] * g - x.imaginary[n] * k
    return F, M


@kernel
def water_load(t: float, m: FloaterSystem) -> None:
    """Loads of the water but for added mass, in ``base_six``, with further ones (W-8 to W-10)."""
    p, f, x, K = m.platform, m.floater, m.base_six, m.float_matrices
    now = cubic(t, f.step, f.period)
    a, angle, R, known = m.float_waves, p.angle, p.orientation, m.base.spin_rate
    velocity, turning = R.T @ p.velocity, R.T @ p.spin
    keep_six(BODY_VELOCITY, velocity, turning, m)
    keep_six(PLACE, p.displacement, angle, m)
    keep_six(AGAINST_CURRENT, velocity - R.T @ f.current, turning, m)
    p.elevation = at(now, a, 0)
    F, M = radiated(m)
    keep_six(WATER_LOAD, F, M, m)
    for k in range(6):
        water = x[WATER_LOAD, k] + at(now, a, k + 1) - (p.bias.x * K[k, 0] + p.bias.y * K[k, 1] + p.bias.z * K[k, 2])
        water -= known.x * K[k, 3] + known.y * K[k, 4] + known.z * K[k, 5]
        other, drag = 0.0 * water, 0.0 * water
        for j in range(6):
            other -= K[FURTHER + k, j] * x[PLACE, j]
            drag -= K[LINEAR + k, j] * x[BODY_VELOCITY, j]
            drag -= K[QUADRATIC + k, j] * (x[AGAINST_CURRENT, j] * abs(x[AGAINST_CURRENT, j]))
        x[WATER_LOAD, k], x[FURTHER_LOAD, k], x[BODY_DRAG, k] = water, other, drag
    # lift and moments of the water turn with the heading
    lift = f.displaced * Vec(1.0, f.buoyancy_y, -f.buoyancy_x)
    for j in range(2, 5):
        lift -= x[PLACE, j] * Vec(K[WATER + 2, j], K[WATER + 3, j], K[WATER + 4, j])
    g, cz, sz = m.structure.gravity, cos(angle.z), sin(angle.z)
    x[WATER_LOAD, 2] += g * lift.x
    x[WATER_LOAD, 3] += g * (cz * lift.y - sz * lift.z)
    x[WATER_LOAD, 4] += g * (sz * lift.y + cz * lift.z)
    (F, M), (body_drag, body_moment) = six(WATER_LOAD, m), six(BODY_DRAG, m)
    strips, strip_moment = strip_drag(now, R, m)
    if m.float_lines.shape[0] > 0:
        H, (push, turning) = rotation(Vec(0.0, 0.0, angle.z)), displaced_waves(t, m)
        F, M = F + H @ push, M + H @ turning
    keep_six(WATER_LOAD, F + (R @ body_drag + strips), M + (R @ body_moment + strip_moment), m)


@kernel
def add_mass(M: Sym, r: Vec, m: FloaterSystem) -> None:
    """Add a mass [kg], by direction, that moves with the platform at ``r`` [m] to the mass matrix."""
    first = first_moving(m)
    for k in range(m.platform_columns.shape[0]):
        T, W = column(k, m)
        momentum = M @ (T + cross(W, r))
        for j in range(k + 1):
            T, W = column(j, m)
            m.core_mass[first + k, first + j] += dot(momentum, T + cross(W, r))


@kernel
def joint_motion(n: int, v: Vec, w: Vec, m: FloaterSystem) -> Vec:
    """Velocity of a junction while the platform moves with ``v`` and ``w`` (W-42)."""
    ends, F = m.line_end, Vec(0.0, 0.0, 0.0)
    for i in range(m.line_order.lines):  # type: ignore[attr-defined]
        if m.line_order.foot[i] == n and holds(i, n, m):
            F += ends.stiffness[i] @ (v + cross(w, ends.upper[i] - m.platform.displacement))
    return m.point_state.flexibility[n] @ F


@kernel
def move_junction(n: int, m: FloaterSystem) -> None:
    """Drag and inertia of a junction, of the strings below it, and of half of those above (W-42)."""
    p, s, order, first = m.platform, m.point_state, m.line_order, first_moving(m)
    v = joint_motion(n, p.velocity, p.spin, m)
    M, drag = dyad(m.point.inertia[n], 0.0, v), m.point.drag[n]
    F = Vec(0.0, 0.0, 0.0)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if holds(i, n, m):
            if order.foot[i] == n:
                mass, more = half_of(i, m)
                M, drag = M + dyad(mass, 0.0, v), drag + more
            else:
                d = s.place[n] - m.line.anchor[i]
                e, across = string_forces(i, d, m)
                force, below = moved_string(i, e, d, across, v, m)
                F, M = F + force, M + below
    s.load[n] = F - (drag * sqrt(dot(v, v))) * v
    for k in range(m.platform_columns.shape[0]):
        T, W = column(k, m)
        coupling = M @ joint_motion(n, T, W, m)
        for j in range(k + 1):
            T, W = column(j, m)
            m.core_mass[first + k, first + j] += dot(coupling, joint_motion(n, T, W, m))


@by_record
def line_pull(i: int, r: Vec, m: FloaterSystem) -> Vec:
    """Force [N] of a string of lines on its fairlead, ``r`` [m] from the platform's point."""
    raise NotImplementedError


@line_pull.variant
@kernel
def static_pull(i: int, r: Vec, m: FloaterSystem) -> Vec:
    """Force of a string in its static shape on its fairlead, with drag and inertia of its motion (W-12 to W-15)."""
    ends, load, n = m.line_end, m.line_load, m.line_order.foot[i]
    v = ends.velocity[i]
    low = m.line.anchor[i] if n < 0 else m.point_state.place[n]
    d = ends.upper[i] - low
    e, across = string_forces(i, d, m)
    if n < 0:
        pull, M = moved_string(i, e, d, across, v, m)
    else:
        mass, drag = half_of(i, m)
        M = dyad(mass, 0.0, v)
        pull = ends.stiffness[i] @ (m.point_state.flexibility[n] @ m.point_state.load[n])
        pull -= (drag * sqrt(dot(v, v))) * v
    H = load.horizontal[i]
    pull += Vec(-H * d.x / across, -H * d.y / across, -load.vertical[i])
    add_mass(M, r, m)
    load.fairlead[i] = sqrt(dot(pull, pull))
    return pull


@by_record
def settle_points(m: FloaterSystem) -> None:
    """Bring free points into equilibrium, where they do not move by themselves."""
    raise NotImplementedError


@settle_points.variant
@kernel
def settle_junctions(m: FloaterSystem) -> None:
    """Bring the junctions of lines in their static shapes into equilibrium."""
    for n in range(m.point.points):  # type: ignore[attr-defined]
        if m.point.junction[n] > 0.0 and is_held(n, m):
            settle(n, m)
            move_junction(n, m)


@kernel
def mooring(m: FloaterSystem) -> None:
    """Forces of the lines on the platform."""
    p, order, ends, load, R = m.platform, m.line_order, m.line_end, m.line_load, m.platform.orientation
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] == NONE:
            r = R @ m.line.fairlead[i]
            ends.upper[i] = p.displacement + r
            ends.velocity[i] = p.velocity + cross(p.spin, r)
    settle_points(m)
    F, M = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] == INNER:
            continue
        if not pulls(i, m):
            k = i
            while k >= 0:
                load.fairlead[k], load.anchor[k] = 0.0, 0.0
                k = order.below[k]
        elif order.head[i] == NONE:
            r = ends.upper[i] - p.displacement
            pull = line_pull(i, r, m)
            load.pull[i] = pull
            F += pull
            M += cross(r, pull)
    p.mooring_force, p.mooring_moment = F, M


@outer_forces.variant
@kernel
def floater_forces(t: float, m: FloaterSystem) -> None:
    """Forces on the motions of the base, with inertia of the platform and added mass of the water (W-7)."""
    p, f, J, K, first = m.platform, m.floater, m.platform_columns, m.float_matrices, first_moving(m)
    water_load(t, m)
    mooring(m)
    inertia, nothing = Sym(f.inertia.x, f.inertia.y, f.inertia.z, 0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    add_to_base(m, f.mass, f.centre - Vec(0.0, 0.0, m.structure.tower_base), inertia, nothing, nothing)
    water, water_moment = six(WATER_LOAD, m)
    further, further_moment = six(FURTHER_LOAD, m)
    F, M = water + (further + p.mooring_force), water_moment + (further_moment + p.mooring_moment)
    for k in range(J.shape[0]):
        T, W = column(k, m)
        m.core_force[first + k] += dot(T, F) + dot(W, M)
        for j in range(k + 1):
            added = 0.0 * m.core_force[first + k]
            for a in range(6):
                if J[j, a] != 0.0:
                    for b in range(6):
                        added += J[j, a] * K[ADDED + a, b] * J[k, b]
            m.core_mass[first + k, first + j] += added


@kernel
def mean_motion(dt: float, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Mean velocity and angular velocity of the platform's point over a step that ends now."""
    V, W, first = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), first_moving(m)
    for k in range(m.platform_columns.shape[0]):
        T, turning = column(k, m)
        rate = m.v[first + k] - 0.5 * dt * m.a[first + k]
        V += rate * T
        W += rate * turning
    return V, W


@kernel
def driven(n: int, V: Vec, W: Vec, m: FloaterSystem) -> tuple[float, float]:
    """Rate of an oscillation of the radiation by the velocities of the platform (W-4)."""
    (a, b), (c, d) = part_of_six(m.float_input, n, 0), part_of_six(m.float_input, n, 6)
    return dot(a, V) + dot(b, W), dot(c, V) + dot(d, W)


@kernel
def decay(n: int, dt: float, m: FloaterSystem) -> None:
    """Set what an oscillation of the radiation keeps over a step, exp(p dt), and its integral."""
    s, z, x = m.float_pole[n, 0], m.float_pole[n, 1], m.float_decay
    size, square = exp(s * dt), s * s + z * z
    c, d = size * cos(z * dt), size * sin(z * dt)
    # (exp(p dt) - 1) / p
    x[n, 0], x[n, 1], x[n, 2] = dt, c, d
    x[n, 3], x[n, 4] = ((c - 1.0) * s + d * z) / square, (d * s - (c - 1.0) * z) / square


@begin_parts_step.variant
@kernel
def floater_begin(dt: float, m: FloaterSystem) -> None:
    """Advance the radiation, exactly for the mean velocity over the step (W-4)."""
    x, keeps, (V, W) = m.radiation, m.float_decay, mean_motion(dt, m)
    for n in range(x.modes):
        if keeps[n, 0] != dt:
            decay(n, dt, m)
        c, d, g, h = keeps[n, 1], keeps[n, 2], keeps[n, 3], keeps[n, 4]
        re, im = driven(n, V, W, m)
        a, b = x.real[n], x.imaginary[n]
        x.real[n] = c * a - d * b + g * re - h * im
        x.imaginary[n] = c * b + d * a + g * im + h * re


@check_parts.variant
@kernel
def floater_upright(m: FloaterSystem, run: March) -> None:
    """End the run of a platform that turns over."""
    m.platform.tilt = tilt_of(point_motion(m).orientation)
    if m.platform.tilt > CAPSIZED:
        run.clock.status = DIVERGED


@part_rates.variant
@kernel
def floater_rates(m: FloaterSystem) -> None:
    """Rates of the radiation (W-4)."""
    x, rate, (V, W) = m.radiation, m.d_radiation, mean_motion(0.0, m)
    for n in range(x.modes):
        s, z = m.float_pole[n, 0], m.float_pole[n, 1]
        re, im = driven(n, V, W, m)
        rate.real[n] = s * x.real[n] - z * x.imaginary[n] + re
        rate.imaginary[n] = s * x.imaginary[n] + z * x.real[n] + im


@outer_section_loads.variant
@kernel
def floater_loads(m: FloaterSystem, s: Outputs) -> None:
    """Loads of the water with added mass."""
    p, J, K, x, first = m.platform, m.platform_columns, m.float_matrices, m.base_six, first_moving(m)
    for i in range(6):
        total = x[WATER_LOAD, i]
        for j in range(6):
            for k in range(J.shape[0]):
                total -= K[ADDED + i, j] * J[k, j] * m.a[first + k]
        x[WHOLE_LOAD, i] = total
    p.force, p.moment = six(WHOLE_LOAD, m)
    p.offset = sqrt(p.displacement.x * p.displacement.x + p.displacement.y * p.displacement.y)
    p.tilt = tilt_of(p.orientation)


@dataclass(frozen=True)
class FloaterPart(Part):
    """The platform of a model, in still water.

    Attributes:
      sizes: lengths of the axes of the signals.
      constants: all other arrays of the records.
      coefficients, radiation: coefficients of the hull and its members, and the oscillations fitted to them.
      platform: description of the platform.
    """

    system: ClassVar[type[KernelRecord] | None] = FloaterSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        "platform": PlatformState,
        "radiation": RadiationState,
        "line_load": LineLoad,
        "point_state": PointState,
    }
    parameter_tables: ClassVar[ParameterTables] = ((Floater, "floater", Floater.names),)
    sizes: dict[str, int]
    constants: dict[str, Any]
    coefficients: HydroCoefficients
    radiation: Radiation
    platform: Platform

    @property
    def shown(self) -> tuple[str, ...]:
        """Elevation, motions, force of the water, tensions of the lines."""
        lines = (f"line_{n + 1}_fairlead_tension" for n in range(self.sizes["line"]))
        return ("wave_elevation", *MOTIONS, "water_force_x", *lines)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        return {name: table.shape(**self.sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Constants of the platform, and still water."""
        return {name: array.copy() for name, array in self.constants.items()}

    def channels(self) -> Sequence[Channel]:
        """Motion of the platform, loads of the water and of the lines."""
        lines = channels_of_group("line", self.sizes["line"])
        return (*channels_of_group("platform"), *(replace(c, index=(c.index[0] - 1,)) for c in lines))

    def states(self) -> Sequence[StateRows]:
        """The memory of radiated waves."""
        n = self.sizes["mode"]
        names = tuple(f"radiation {part} {i + 1}" for part in ("real", "imaginary") for i in range(n))
        return (StateRows("radiation", "d_radiation", names, ("m",) * (2 * n)),)

    def notices(self, channels: Sequence[Channel]) -> list[str]:
        """Warnings about recorded tensions of static lines."""
        tensions = any(channel.source[0] == "line_load" for channel in channels)
        return [self.platform.tension_warning] if tensions and self.platform.tension_warning else []

    def why(self, case: Any) -> str:
        """The message that the platform turns over, or nothing."""
        if float(case.view("platform")["tilt"]) <= CAPSIZED:
            return ""
        return (
            f"the platform turns over (tilt beyond {degrees(CAPSIZED):.0f} deg): look at its ballast, lines, wind "
            "and waves in what was kept"
        )

    def in_sea(self, sea: Any, duration: float, origin: tuple[float, float], gravity: float) -> FloatingSea:
        """The waves of a run.

        Raises:
          InputError: the waves, or a part of them, are not in the coefficients.
        """
        place = View(DragStrip, self.constants["strip"])["place"].T
        n, platform = len(place), self.platform.replace(depth=self.platform.depth + sea.level)
        check_reach(self.platform, f"sea.level: with {sea.level:g} m", sea.level)
        if sea.current is not None and not n and platform.quadratic_damping is None:
            raise InputError("sea: current acts on platform.quadratic_damping and on members with drag; give either")
        dt, period, waves = wave_forces(sea, self.coefficients, platform, duration, origin, gravity)
        floater, line = self.constants["floater"].copy(), self.constants["line"].copy()
        v = View(Floater, floater)
        v["step"], v["period"], v["bed"] = dt, period, -platform.depth
        View(Line, line)["anchor"][2] -= sea.level
        if sea.current is not None:
            v["current"][:2] = sea.current.at(platform.centre[2:], platform.depth)[0]
        flow = np.zeros((len(waves), 0))
        if n:
            flow = flow_at(place, sea, platform.depth, duration, origin, gravity, platform.sum_forces)
        lines, forces = self.constants["float_lines"], self.constants["float_forces"]
        if platform.excitation == "displaced":
            lines, forces = displaced_forces(sea, self.coefficients, platform, duration, origin, gravity)
        return FloatingSea(floater, line, waves, flow, lines, forces)

    def in_steady_sea(self, sea: Any, still: Any, gravity: float) -> FloatingSea:
        """Level and current of a sea, as ``still`` has them, and the mean drift of its waves.

        Raises:
          InputError: as for :meth:`in_sea`.
        """
        steady = self.in_sea(still, 1.0, (0.0, 0.0), gravity)
        steady.float_waves[:, 1:] += mean_drift(sea, self.coefficients, self.platform, gravity)
        return steady


@dataclass(frozen=True)
class FloatingSea(Part):
    """The sea of a run, in place of still water."""

    floater: Float
    line: Float
    float_waves: Float
    float_flow: Float
    float_lines: Float
    float_forces: Float

    def arrays(self) -> dict[str, Any]:
        """Arrays that replace those of still water."""
        return {**vars(self), "floater": self.floater.copy(), "line": self.line.copy()}


def part_of(turbine: Any, options: Any, rotor: Any) -> FloaterPart:
    """The platform of a turbine; arguments and errors as for ``simulation.parts.parts_of``.

    Raises:
      InputError: no coefficients, no fit of the radiation, or the platform does not float.
    """
    platform: Platform = turbine.platform
    potential = platform_coefficients(platform) if platform.coefficients else None
    if potential is not None:
        check_coefficients(potential, platform, f"{turbine.name}: platform.coefficients")
    c = with_members(potential, platform.members, platform.depth, GRAVITY)
    check_balance(turbine, c)
    radiation, rho = fit_radiation(c), platform.water_density
    given = platform.stiffness, platform.linear_damping, platform.quadratic_damping
    further = [np.zeros((6, 6)) if each is None else each for each in given]
    floater = Floater.zeros()
    v = View(Floater, floater)
    v["mass"], v["centre"], v["inertia"] = platform.mass, platform.centre, platform.inertia
    v["displaced"] = rho * platform.volume
    v["buoyancy_x"], v["buoyancy_y"] = platform.buoyancy_centre
    v["step"], v["period"], v["bed"] = 1.0, 1.0, -platform.depth
    some = pieces(platform.members)
    has = (some.drag > 0.0) | (some.plate > 0.0)
    strip = DragStrip.zeros(strip=int(has.sum()))
    v = View(DragStrip, strip)
    v["place"], v["axis"], v["drag"], v["plate"] = (
        each[has].T for each in (some.place, some.axis, rho * some.drag, rho * some.plate)
    )
    fitted = [np.concatenate([each.real, each.imag], axis=1) for each in (radiation.input, radiation.output)]
    hull = np.zeros((0, 6)) if rotor.tower.hull is None else rotor.tower.hull
    sizes = {"mode": len(radiation.pole), "line": len(platform.lines), "point": len(platform.points)}
    constants = {
        "floater": floater,
        "strip": strip,
        **mooring_tables(platform.lines, platform.points, platform.depth, rho, platform.segments),
        "float_matrices": np.concatenate([rho * c.infinite, rho * c.hydrostatic, *further]),
        "float_pole": np.stack([radiation.pole.real, radiation.pole.imag], axis=1),
        "float_decay": np.zeros((sizes["mode"], 5)),
        "float_input": fitted[0],
        "float_output": rho * fitted[1],
        "d_radiation": RadiationState.zeros(mode=sizes["mode"]),
        "float_waves": np.zeros((AHEAD + BEHIND + 2, 7)),
        "float_flow": np.zeros((AHEAD + BEHIND + 2, 3 * strip.shape[1])),
        "float_lines": np.zeros((0, 3)),
        "float_forces": np.zeros((HEADINGS, 0, 12)),
        **moving_base(rotor.tower, turbine.tower.top_mass),
        "hull_shape": hull,
        "platform_columns": np.zeros((len(hull) + 6, 6)),
        "base_six": np.zeros((7, 6)),
    }
    return FloaterPart(sizes, constants, c, radiation, platform)
