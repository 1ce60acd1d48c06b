"""Steady operation in steady wind: the operating point, in which runs start.

Steady operation is periodic: under gravity, tilt, shear and tower influence every blade repeats the same motion
once per revolution, and the tower at B times that frequency. The motion is written as

    blade b:            q(psi) = sum_n c_n cos(n psi_b) + s_n sin(n psi_b),  n = 0..H
    tower, yaw, shaft:  the same in the rotor's azimuth with n = 0, B

and found by harmonic balance: march the flow around the azimuth with this motion prescribed, project the residuals of
the equations of motion on the harmonics, correct the motion with the linearised equations, repeat. Rotor speed and
pitch follow from the balance of torque and the controller's steady law. If this does not converge, the motion is
continued from a rotor in vacuum, with smaller corrections.

Reference: docs/theory/simulation.md (M-10 to M-16).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroOptions, InflowState
from meltemi.control.baseline import parameters, steady_torque
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.representation import Brief
from meltemi.core.threads import one_blas_thread
from meltemi.core.yamlfile import validated
from meltemi.environment.drops import MM_PER_HOUR
from meltemi.simulation.bladed.rotor import BladedModel, with_static_gears
from meltemi.simulation.case import Case
from meltemi.simulation.channels import Channel, catalogue, find
from meltemi.simulation.modes import growing
from meltemi.simulation.start import set_actuators
from meltemi.simulation.step import ABSURD, equations
from meltemi.simulation.system import System
from meltemi.structure.kinematics import GENERATOR, N_SHAFT, TORSION
from meltemi.turbine.definition import Turbine
from meltemi.turbine.imbalance import deviations
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.wind.fields import SharedTurbulence, SteadyWind, WindBox, WindSeries, mean_speed
from meltemi.wind.turbulence.field import AnyWind
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]

BLADE_HARMONICS = 4
SAMPLES = 12
"""Azimuths per sector of 1/B revolution."""
SWEEPS = 3
"""Sectors marched, each with a correction of the motion, at each trial rotor speed and pitch."""
UNLIKE_SWEEPS = 3 * SWEEPS
"""The same for blades that differ: a balance over one revolution, after revolutions in which the blades settle."""
JACOBIAN_SAMPLES = 10
PERTURBATION = 1e-3
"""[m or rad] perturbation of the coefficients for finite differences."""
MEAN_ONLY, FULL = 0, 1
"""Levels: only mean deflections during the search for speed and pitch; then all harmonics."""
SCAN = 9
"""Number of rotor speeds at which the balance of torque is evaluated first."""
STALLED, PITCH_SCAN = 3.0, 0.05
"""Tip-speed ratio below which a rotor stalls, and spacing [rad] of the pitch angles that are then tried."""
SETTLE_SWEEPS, SECANT_STEPS, SEARCHES = 3, 5, 4
BALANCE = 1e-4
"""Largest residual torque over rated torque at the end of a search."""
TOLERANCE = 1e-5
"""Relative change of rotor speed or pitch at which the search ends."""
FARTHEST = 0.05
"""Largest correction over the rotor radius in a careful search."""
SETTLED, NEARLY = 1e-5, 2e-3
"""Corrections over the rotor radius: of a converged motion, and the largest acceptable one."""
PATIENCE, FRESH, AGE = 90, 18, 3
"""Largest number of sectors to converge, initial sectors with new derivatives each, and sectors that reuse them."""
SHORTEST = 1.0 / 32.0
"""Smallest continuation step, as a fraction of the way from a motion to the next one."""
BENT = 0.25
"""Tip deflection over blade length beyond which the range of the blades' models ends."""
SOUND = 340.0
"""[m/s] fastest speed of the blade tips: coefficients of sections are those of incompressible flow."""
DIVERGES = "operating_point: the motion diverges"
UNBALANCED = 30.0
"""Multiple of BALANCE beyond which a search has failed."""
CLOSE = 0.97
"""Fraction of the reference speed above which the search is repeated if the first one predicted the reference speed
in error."""


@dataclass(frozen=True, repr=False)
class OperatingPoint(Brief):
    """Steady operation in a steady wind.

    Attributes:
      wind: the steady wind.
      rotor_speed: [rad/s].
      pitch: [rad].
      generator_torque: [N m].
      imbalance: [N m] residual torque on the low-speed shaft; zero when the speed is free and an electrical
        system, if there is one, can supply the torque.
      q, v: coordinates and velocities with blade 1 up.
      aero: states of inflow and stall, and the solver's memory, with blade 1 up.
      revolution: (azimuths, states) q, v and aero in one row, at equal steps of the azimuth from 0.
      means: azimuthal averages of all signals.
      warnings: such as that the motion is unstable.
      azimuth: [rad] of blade 1 at the start of a run.
    """

    wind: SteadyWind
    rotor_speed: float
    pitch: float
    generator_speed: float
    generator_torque: float
    imbalance: float
    q: Float = field(repr=False)
    v: Float = field(repr=False)
    aero: Float = field(repr=False)
    revolution: Float = field(repr=False)
    means: Float = field(repr=False)
    channels: dict[str, Channel] = field(repr=False)
    places: dict[str, int] = field(repr=False)
    warnings: tuple[str, ...] = ()
    azimuth: float = 0.0

    def facts(self) -> dict[str, str]:
        """The wind, and the operation of the turbine in it, in engineering units."""
        wanted = ("rotor_speed", "pitch_1", "generator_power", "rotor_aero_thrust")
        known = [self.channels[name] for name in wanted if name in self.channels]
        told = {c.name: f"{self[c.name] * c.display_unit[1]:.5g} {c.display_unit[0]}" for c in known}
        return {"wind_speed": f"{self.wind.speed:g} m/s", **told}

    def put(self, case: Case, azimuth: float | None = None) -> None:
        """Write the state at an azimuth [rad] of blade 1, by default the point's own, into a case of the same model."""
        azimuth = self.azimuth if azimuth is None else azimuth
        set_actuators(case, self.pitch, self.generator_torque)
        case["q"][:], case["v"][:] = self.q, self.v
        case.set_aero_states(self.aero)
        if azimuth:
            # interpolation by the Fourier series of the stored azimuths; the generator rotates with the rotor
            n = len(self.revolution)
            weight = np.exp(1j * azimuth * np.arange(n // 2 + 1)) / n
            weight[1 : (n + 1) // 2] *= 2.0
            state = (weight @ np.fft.rfft(self.revolution, axis=0)).real
            case["q"][:], case["v"][:], air = np.split(state, [len(self.q), 2 * len(self.q)])
            case.set_aero_states(air)
            case["q"][case.model.n_core - N_SHAFT + GENERATOR] += azimuth

    def __getitem__(self, name: str) -> float:
        """Azimuthal average of a channel, by meltemi's name or OpenFAST's, in SI units."""
        return float(self.means[self.places[find(name, self.channels).name]])


@one_blas_thread
def operating_point(
    model: BladedModel, wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation of a turbine in steady wind.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; for an unsteady wind its mean.
      rotor_speed: [rad/s]; by default the speed at which the torque balances under the turbine's torque law.
      pitch: [rad]; by default the smallest, or above rated the one that holds the reference speed.

    Raises:
      InputError: the wind cannot turn the rotor, or a prescribed value is beyond any range.
    """
    steady = steady_wind(wind, model.turbine.hub_height)
    check_prescribed("operating_point", model.turbine, rotor_speed, pitch)
    try:
        quick = _Orbit(model, steady)
        point = _search(quick, rotor_speed, pitch)
        enough = UNBALANCED * BALANCE * model.turbine.rated_power / point.rotor_speed
        # a prescribed speed may be one where nothing converges; the own one is accepted by its balance
        settled = rotor_speed is None or quick.moved < NEARLY * model.turbine.rotor_radius
        if settled and (rotor_speed is not None or abs(point.imbalance) <= enough or model.has_electrical):
            return point if rotor_speed is None else _judged(point, quick)
    except NotConverged:
        pass
    orbit = CarefulOrbit(model, steady)
    return _judged(_search(orbit, rotor_speed, pitch), orbit)


def _judged(point: OperatingPoint, orbit: _Orbit) -> OperatingPoint:
    """An operating point with a warning if its motion is unstable."""
    unstable = orbit.unstable()
    return replace(point, warnings=(f"steady operation is unstable: {unstable}",)) if unstable else point


def check_prescribed(what: str, turbine: AnyTurbine, rotor_speed: float | None, pitch: float | None) -> None:
    """Refuse a rotor speed [rad/s] or pitch [rad] beyond any range, as one in rpm or in degrees is."""
    if rotor_speed is not None:
        if not rotor_speed > 0.0:
            other = "; use meltemi.analysis.parked_point for parked or idling rotors"
            bladed = isinstance(turbine, Turbine)
            raise InputError(f"{what}: rotor_speed must be above zero, found {rotor_speed!r}{other if bladed else ''}")
        if not (tip := rotor_speed * turbine.rotor_radius) <= SOUND:
            raise InputError(
                f"{what}: at a rotor speed of {rotor_speed:g} rad/s, {30.0 / np.pi * rotor_speed:.4g} rpm, the blade "
                f"tips would be faster than sound ({tip:.4g} m/s)"
            )
    if pitch is not None and not abs(pitch) <= np.pi:
        raise InputError(f"{what}: pitch {pitch:g} rad is not between -pi and pi; from degrees: math.radians")


def rigid_point(model: BladedModel, wind: AnyWind) -> OperatingPoint:
    """Steady operation of the same turbine with all degrees of freedom of deflection locked: a fallback start."""
    orbit = _Orbit(model, steady_wind(wind, model.turbine.hub_height))
    orbit.free_core, orbit.free_blade = orbit.free_core[:0], orbit.free_blade[:0]
    return _search(orbit, None, None)


class NotConverged(InputError):
    """A search for steady operation that did not converge."""


def _search(orbit: _Orbit, rotor_speed: float | None, pitch: float | None) -> OperatingPoint:
    """Steady operation by the motion of an orbit; arguments and errors as for :func:`operating_point`."""
    model, steady = orbit.model, orbit.wind
    control = model.turbine.control
    law = parameters(control)
    ratio = model.turbine.drivetrain.gear_ratio
    reference = model.turbine.rated_rotor_speed
    free = model.locked[model.coordinates.index("generator")] == 0.0

    def left_over(speed: float, angle: float) -> float:
        """Residual torque at a rotor speed and pitch."""
        return orbit.sweep(speed, angle, float(steady_torque(law, ratio * speed, angle)))

    angle = control.pitch.minimum if pitch is None else pitch
    if rotor_speed is None and not free:
        rotor_speed = reference
    search_speed, search_pitch, close = rotor_speed is None, False, False
    if rotor_speed is None:
        falling = model.environment.rain
        rain = f" in rain of {falling.intensity / MM_PER_HOUR:g} mm/h" if falling is not None else ""
        most = angle if pitch is not None else control.pitch.maximum
        stalled = STALLED * steady.speed / model.turbine.rotor_radius
        balance = _balance_speed if not orbit.careful else _balance_carefully
        rotor_speed, angle, above = balance(left_over, reference, angle, most, stalled, steady.speed, rain)
        search_pitch = above and pitch is None
        search_speed = not above
        if search_pitch:
            angle = root(lambda x: left_over(reference, x), angle, control.pitch.maximum, 0.02)
    # the harmonics of the motion contribute a little to the mean torque: search once more, close by
    orbit.level = FULL
    for _ in range(SETTLE_SWEEPS):
        left_over(rotor_speed, angle)
    enough = BALANCE * control.torque.rated_power / reference
    for _ in range(SEARCHES):
        if search_speed:
            rotor_speed = _secant(partial(left_over, angle=angle), rotor_speed, 1e-3 * rotor_speed)
            if rotor_speed > reference:  # with the harmonics the rotor exceeds the reference speed
                rotor_speed, search_speed, search_pitch = reference, False, pitch is None
        if search_pitch:
            angle = _secant(lambda x: left_over(reference, x), angle, 1e-3)
            if angle < control.pitch.minimum:  # with the harmonics the rotor no longer reaches the reference speed
                angle, search_pitch, close = control.pitch.minimum, False, True
        if close:
            rotor_speed = root(partial(left_over, angle=angle), CLOSE * reference, reference, 0.01 * reference)
        for _ in range(SETTLE_SWEEPS):
            left_over(rotor_speed, angle)
        settled = orbit.careful and not (search_speed or search_pitch or close)
        if settled or abs(orbit.over_revolution) <= enough:
            break
        orbit.unlike = True
    return orbit.finish()


def _secant(f: Callable[[float], float], x: float, step: float) -> float:
    """Root close to ``x`` by the secant method."""
    x_old, f_old = x, f(x)
    x = x + step * np.sign(f_old) if f_old != 0.0 else x
    for _ in range(SECANT_STEPS):
        f_new = f(x)
        if f_new == f_old or abs(x - x_old) < 1e-9:
            break
        move = -f_new * (x - x_old) / (f_new - f_old)
        x_old, f_old, x = x, f_new, x + float(np.clip(move, -20.0 * step, 20.0 * step))
    return x


def steady_wind(wind: float | AnyWind, hub_height: float) -> SteadyWind:
    """The steady wind at the start of a wind, of a turbulent wind its mean and shear, or that of a speed [m/s]."""
    if isinstance(wind, (int, float)):
        return validated({"speed": wind}, SteadyWind, "wind")
    if isinstance(wind, SteadyWind):
        return wind
    if isinstance(wind, SharedTurbulence):
        return wind.mean
    if isinstance(wind, TurbulentWind):
        return SteadyWind(**{name: getattr(wind, name) for name in SteadyWind.model_fields if hasattr(wind, name)})
    speed = mean_speed(wind, hub_height)
    if isinstance(wind, WindSeries):
        upflow = float(np.clip(np.arctan2(wind.vertical[0], speed), -0.99, 0.99))
        begin = {"speed": speed, "shear_exponent": wind.exponent[0], "direction": wind.direction[0], "upflow": upflow}
        return validated(begin, SteadyWind, f"{wind.label}, the wind at its start")
    assert isinstance(wind, WindBox)
    rows = wind.bottom + wind.dz * np.arange(wind.velocity.shape[1])
    profile = wind.velocity[..., 0].mean(axis=(0, 2), dtype=np.float64)
    slope = float(np.polyfit(np.log(rows), np.log(np.maximum(profile, 0.1)), 1)[0])
    mean = {"speed": speed, "shear_exponent": float(np.clip(slope, -0.5, 0.9)), "direction": wind.direction}
    return validated(mean, SteadyWind, f"{wind.label}, its mean")


def _balance_speed(
    left_over: Callable[[float, float], float],
    reference: float,
    pitch: float,
    most: float,
    stalled: float,
    wind_speed: float,
    rain: str = "",
) -> tuple[float, float, bool]:
    """Rotor speed of stable torque balance, a pitch, and whether the rotor would exceed the reference speed.

    Args:
      most: [rad] largest pitch that is tried for a rotor that stalls at ``pitch``.
      stalled: [rad/s] rotor speed below which the rotor counts as stalled.
    """
    speeds = np.linspace(0.25, 1.0, SCAN) * reference
    values = [left_over(speed, pitch) for speed in speeds]
    if values[-1] > 0.0:
        return reference, pitch, True
    found = 0.0
    for i in reversed(range(SCAN - 1)):
        if values[i] > 0.0 >= values[i + 1]:
            low, high = speeds[i], speeds[i + 1]
            found = root(lambda x: left_over(x, pitch), low, high, 0.25 * (high - low))
            break
    if found < stalled:
        for angle in np.arange(pitch + PITCH_SCAN, most, PITCH_SCAN):
            if left_over(reference, float(angle)) > 0.0:
                return reference, float(angle), True
    if found == 0.0:
        raise no_balance(wind_speed, rain)
    return found, pitch, False


def _balance_carefully(
    left_over: Callable[[float, float], float],
    reference: float,
    pitch: float,
    most: float,
    stalled: float,
    wind_speed: float,
    rain: str = "",
) -> tuple[float, float, bool]:
    """As :func:`_balance_speed`, but from feather on, since at fine pitch there may be no steady motion."""
    failed: list[NotConverged] = []

    def torque(speed: float, angle: float) -> float:
        try:
            return left_over(speed, angle)
        except NotConverged as error:
            failed.append(error)
            return float("nan")

    for angle in (*np.arange(most, pitch, -PITCH_SCAN), pitch):
        value = torque(reference, float(angle))
        if value > 0.0:
            return reference, float(angle), True
        if not np.isfinite(value):
            break
    try:
        return _balance_speed(torque, reference, pitch, pitch, stalled, wind_speed, rain)
    except InputError:
        raise failed[0] if failed else no_balance(wind_speed, rain) from None


def no_balance(wind_speed: float, rain: str = "") -> InputError:
    """Error for a wind that does not turn the rotor; ``rain`` adds the effect of rain."""
    return InputError(
        f"no steady operation at a wind speed of {wind_speed:g} m/s: the wind does not turn the rotor against the "
        f"generator{rain}. Use {'less rain or ' if rain else ''}a higher wind speed, or another start: in a case "
        "file start: standstill with controller: {kind: supervised}; in Python start=Start(rotor_speed=..., pitch=...)"
        ", or for operating_point rotor_speed and pitch"
    )


def root(f: Callable[[float], float], low: float, high: float, step: float) -> float:
    """Root of a falling function: widen from ``low`` until the sign changes, then false position (Illinois)."""
    a, fa = low, f(low)
    if fa <= 0.0:
        return low
    b = a
    fb = fa
    while fb > 0.0:
        if b >= high:
            return high
        a, fa = b, fb
        b = min(b + step, high)
        step *= 1.6
        fb = f(b)
    side = 0
    for _ in range(40):
        x = (a * fb - b * fa) / (fb - fa)
        if abs(b - a) < TOLERANCE * max(abs(b), 1e-3):
            return x
        fx = f(x)
        if abs(fx) < TOLERANCE * max(abs(fa), abs(fb), 1e-9):
            return x
        if fx > 0.0:
            a, fa = x, fx
            fb = 0.5 * fb if side == 1 else fb
            side = 1
        else:
            b, fb = x, fx
            fa = 0.5 * fa if side == -1 else fa
            side = -1
    return x


KEPT = ("core_mass", "arm_mass", "coupling", "core_force", "arm_force")


@kernel
def evaluate_motion(
    dt: float,
    motion: Float,
    m: System,
    one: System,
    left: tuple[Float, ...],
    kept: tuple[Float, ...],
    lack: Float,
) -> None:
    """Evaluate a motion at consecutive instants, and store the equations of each.

    Args:
      dt: [s] between the instants.
      motion: (3, instants, coordinates) coordinates, velocities and accelerations.
      m, one: the system, and the same node by node.
      left: flat views of the results of an evaluation, the arrays KEPT.
      kept: (instants, entries) each, where they are stored.
      lack: (2, blades, nodes) receives the sums of quasi-steady minus lagged induced velocity, normal and tangential.
    """
    q, v, a, flow, inflow = one.q, one.v, one.a, one.flow, one.inflow
    for i in range(motion.shape[1]):
        for j in range(q.shape[0]):
            q[j], v[j], a[j] = motion[0, i, j], motion[1, i, j], motion[2, i, j]
        equations(0.0, dt, m)
        for k in range(5):
            for j in range(left[k].shape[0]):
                kept[k][i, j] = left[k][j]
        for b in range(flow.blades):
            for n in range(flow.nodes):
                lack[0, b, n] += flow.steady_axial[b, n] * flow.vx[b, n] - inflow.x[b, n]
                lack[1, b, n] += flow.steady_tangential[b, n] * flow.vy[b, n] - inflow.y[b, n]


class _Orbit:
    """The periodic motion of a model in a steady wind, improved sector by sector."""

    careful = False

    def __init__(self, model: BladedModel, wind: SteadyWind) -> None:
        self.model, self.wind = model, wind
        self.case = Case(with_static_gears(model), wind)
        self.case.control.drive.yaw_held = 1.0  # a free nacelle has no steady direction
        self.B, self.K = model.n_blades, len(model.rotor.blade.names)
        self.core = model.n_core
        self.generator = len(model.rotor.tower.names) + GENERATOR
        self.torsion = len(model.rotor.tower.names) + TORSION
        free = model.locked == 0.0
        self.free_core = np.flatnonzero(free[: self.core] & (np.arange(self.core) != self.generator))
        self.free_blade = np.flatnonzero(free[self.core : self.core + self.K])
        # cosine and sine coefficients; a blade's in its own azimuth, the core's for harmonics 0 and B
        self.blade_c = np.zeros((BLADE_HARMONICS + 1, self.K))
        self.blade_s = np.zeros((BLADE_HARMONICS + 1, self.K))
        # individual deviations of the blades from it in the mean, for they differ if not all have ice
        self.own = np.zeros((self.B, self.K))
        self.core_c = np.zeros((2, self.core))
        self.core_s = np.zeros((2, self.core))
        self.azimuth = 0.0
        self.speed = self.pitch = self.torque = 0.0
        self.farthest, self.moved = np.inf, 0.0
        self.level = MEAN_ONLY
        self.correct: dict[int, Float] = {}
        self.lefts: deque[float] = deque(maxlen=self.B)
        # near their roots blades may settle in different flow states, so that sectors keep differing
        self.unlike = self.uneven = not model.turbine.blades_alike
        # quasi-steady minus lagged induced velocity, summed over a sector
        self.lack = np.zeros((2, *self.case.one.flow.array.shape[1:]))
        # residuals of each blade minus their mean over the blades; residuals, velocities and these of each sector
        self.blade_missing = np.zeros((self.B, self.K))
        self.parts: list[tuple[Float, Float, Float]] = []

    # motion -------------------------------------------------------------------------------------

    def prescribe(self, psi: float) -> None:
        """Set coordinates, velocities and accelerations of the motion at rotor azimuth ``psi``."""
        case, motion = self.case, self.motion(np.array([psi]))
        case["q"][:], case["v"][:], case["a"][:] = motion[:, 0]

    def motion(self, azimuths: Float) -> Float:
        """(3, azimuths, coordinates) coordinates, velocities and accelerations of the motion.

        All azimuths at once, since time in Python is time that threads wait.
        """
        w, fast = self.speed, self.B * self.speed
        result = np.empty((3, len(azimuths), len(self.case["q"])))
        q, v, a = result
        c, s = np.cos(self.B * azimuths)[:, None], np.sin(self.B * azimuths)[:, None]
        wave = self.core_c[1] * c + self.core_s[1] * s
        q[:, : self.core] = self.core_c[0] + wave
        v[:, : self.core] = fast * (self.core_s[1] * c - self.core_c[1] * s)
        a[:, : self.core] = -(fast**2) * wave
        q[:, self.generator] = azimuths - q[:, self.torsion]
        v[:, self.generator] = w - v[:, self.torsion]
        a[:, self.generator] = -a[:, self.torsion]
        n = np.arange(BLADE_HARMONICS + 1.0)
        blades = 2.0 * np.pi / self.B * np.arange(self.B, dtype=float)
        angle = (azimuths[:, None] + blades)[..., None] * n
        c, s = np.cos(angle), np.sin(angle)
        arms = (len(azimuths), self.B * self.K)
        q[:, self.core :] = (c @ self.blade_c + s @ self.blade_s + self.own).reshape(arms)
        v[:, self.core :] = w * ((n * c) @ self.blade_s - (n * s) @ self.blade_c).reshape(arms)
        a[:, self.core :] = -(w**2) * ((n**2 * c) @ self.blade_c + (n**2 * s) @ self.blade_s).reshape(arms)
        return result

    def residuals(self, azimuths: Float, dt: float) -> tuple[Float, Float]:
        """Residuals of the equations at consecutive azimuths: (azimuths, core), (azimuths, blades, modes).

        Args:
          dt: [s] between the azimuths; 0 holds inflow and stall.
        """
        case, motion, n = self.case, self.motion(azimuths), len(azimuths)
        shapes = [case[part].shape for part in KEPT]
        kept = tuple(np.empty((n, int(np.prod(shape)))) for shape in shapes)
        self.lack[:] = 0.0
        left = tuple(case[part].reshape(-1) for part in KEPT)
        evaluate_motion(dt, motion, case.system, case.one, left, kept, self.lack)
        A, D, C, core, blade = (array.reshape(n, *shape) for array, shape in zip(kept, shapes, strict=True))
        A, D = (np.tril(M) + np.swapaxes(np.tril(M, -1), -1, -2) for M in (A, D))
        a_core = motion[2, :, : self.core]
        a_blade = motion[2, :, self.core :].reshape(n, self.B, self.K)
        core -= np.einsum("ijk,ik->ij", A, a_core) + np.einsum("ibkj,ibk->ij", C, a_blade)
        blade -= np.einsum("ibkl,ibl->ibk", D, a_blade) + np.einsum("ibkj,ij->ibk", C, a_core)
        return core, blade

    # corrections --------------------------------------------------------------------------------

    def coefficients(self) -> Float:
        """All free coefficients of the motion as one vector."""
        core, blade = self.free_core, self.free_blade
        return np.concatenate(
            [
                self.core_c[:, core].ravel(),
                self.core_s[1, core],
                self.blade_c[:, blade].ravel(),
                self.blade_s[1:, blade].ravel(),
            ]
        )

    def move(self, change: Float) -> None:
        """Add a change to the free coefficients.

        Raises:
          NotConverged: the motion diverges.
        """
        if not np.all(np.abs(change) < ABSURD):
            raise NotConverged(DIVERGES)
        core, blade = self.free_core, self.free_blade
        sizes = [2 * len(core), len(core), (BLADE_HARMONICS + 1) * len(blade)]
        parts = np.split(change, np.cumsum(sizes))
        self.core_c[:, core] += parts[0].reshape(2, -1)
        self.core_s[1, core] += parts[1]
        self.blade_c[:, blade] += parts[2].reshape(BLADE_HARMONICS + 1, -1)
        self.blade_s[1:, blade] += parts[3].reshape(BLADE_HARMONICS, -1)

    def missing(self, azimuths: Float, dt: float) -> tuple[Float, float]:
        """Residuals over a sector, projected on the harmonics in the order of
        :meth:`coefficients`, and the mean residual torque.

        Raises:
          NotConverged: the motion diverges.
        """
        B = self.B
        core, blade = self.residuals(azimuths, dt)
        if not (np.isfinite(core).all() and np.isfinite(blade).all()):
            raise NotConverged(DIVERGES)
        core_0 = core.sum(axis=0)
        core_c, core_s = 2.0 * np.cos(B * azimuths) @ core, 2.0 * np.sin(B * azimuths) @ core
        n = np.arange(BLADE_HARMONICS + 1.0)
        angle = np.multiply.outer(n, azimuths[:, None] + 2.0 * np.pi / B * np.arange(B, dtype=float))
        blade_c = 2.0 / B * np.tensordot(np.cos(angle), blade, 2)
        blade_s = 2.0 / B * np.tensordot(np.sin(angle), blade, 2)
        blade_c[0] *= 0.5
        self.blade_missing = blade.mean(axis=0) - blade.mean(axis=(0, 1))
        trunk, arm = self.free_core, self.free_blade
        vector = np.concatenate(
            [core_0[trunk], core_c[trunk], core_s[trunk], blade_c[:, arm].ravel(), blade_s[1:, arm].ravel()]
        )
        return vector / len(azimuths), float(core_0[self.generator] / len(azimuths))

    def unknowns(self) -> NDArray[np.intp]:
        """Indices of the coefficients that are corrected at the present level."""
        core, blade = len(self.free_core), len(self.free_blade)
        if self.level == MEAN_ONLY:
            return np.concatenate([np.arange(core), 3 * core + np.arange(blade)])
        return np.arange(3 * core + (2 * BLADE_HARMONICS + 1) * blade)

    def linearise(self) -> None:
        """Compute the derivatives of the residuals by the coefficients, with inflow held and static polars."""
        options, stall = self.case["aero_options"], AeroOptions.index("stall")
        kept, options[stall] = options[stall], 0
        self.differentiate(2.0 * np.pi / self.B / JACOBIAN_SAMPLES * np.arange(JACOBIAN_SAMPLES, dtype=float), 0.0)
        options[stall] = kept

    def differentiate(self, azimuths: Float, dt: float) -> None:
        """Compute derivatives at azimuths; ``dt`` [s] as for :meth:`residuals`."""
        air = self.case.aero_state.vector
        state = air.copy()
        base, _ = self.missing(azimuths, dt)
        unknowns = self.unknowns()
        J: Float = np.empty((len(unknowns), len(unknowns)))
        for column, j in enumerate(unknowns):
            change = np.zeros(len(base))
            change[j] = PERTURBATION
            self.move(change)
            if dt:
                air[:] = state
            J[:, column] = (self.missing(azimuths, dt)[0] - base)[unknowns] / PERTURBATION
            self.move(-change)
        air[:] = state
        self.correct[self.level] = np.asarray(np.linalg.inv(J), dtype=float)

    def mean_correction(self) -> Float:
        """(free modes, free modes) correction of a blade's mean deflection for unit residuals of its equations."""
        core, blade = len(self.free_core), len(self.free_blade)
        begin = core if self.level == MEAN_ONLY else 3 * core
        result: Float = self.correct[self.level][begin : begin + blade, begin : begin + blade]
        return result

    def impose(self, speed: float, pitch: float, torque: float) -> None:
        """Set rotor speed [rad/s], pitch [rad] and generator torque [N m]."""
        case = self.case
        self.parts.clear()
        self.speed = speed
        case["pitch"][:] = 0.0
        self.pitch = pitch
        case.view("pitch")["angle"] = pitch + deviations(self.model.turbine, "pitch")
        case.control.drive.generator_torque = self.torque = torque

    def sweep(self, speed: float, pitch: float, torque: float) -> float:
        """March sectors and correct the motion after each; returns the mean residual torque [N m]."""
        self.impose(speed, pitch, torque)
        if not self.correct:
            self.prescribe(0.0)
            self.case.settle(0.0)
        if self.level not in self.correct:
            for _ in range(2):
                self.linearise()
                self.sector()
        for _ in range(UNLIKE_SWEEPS if self.unlike else SWEEPS):
            self.sector()
        return self.left

    @property
    def left(self) -> float:
        """Mean residual torque [N m], of the last sector or of the last revolution."""
        return self.over_revolution if self.unlike else self.lefts[-1]

    @property
    def over_revolution(self) -> float:
        """Mean residual torque [N m] of the last B sectors."""
        return sum(self.lefts) / len(self.lefts)

    @property
    def step(self) -> float:
        """[rad] from one azimuth of a sector to the next, in the sense of rotation."""
        return float(np.copysign(2.0 * np.pi / self.B / SAMPLES, self.speed))

    def sector(self) -> None:
        """March 1/B revolution, and correct motion and mean inflow; for blades that differ after each revolution.

        Over a revolution the forces that turn with such a rotor cancel out on the tower.
        """
        case, B = self.case, self.B
        step = self.step
        missing, left = self.missing(self.azimuth + step * np.arange(1.0, SAMPLES + 1.0), step / self.speed)
        self.azimuth += step * SAMPLES
        self.lefts.append(left)
        inflow = case["inflow"]
        lack = self.lack[..., : inflow.shape[-1]]
        if self.uneven:
            self.parts.append((missing, lack.copy(), self.blade_missing))
            if len(self.parts) < B:
                return
            missing, lack, residuals = (np.mean(parts, axis=0) for parts in zip(*self.parts, strict=True))
            self.parts.clear()
            self.own[:, self.free_blade] -= residuals[:, self.free_blade] @ self.mean_correction().T
        else:
            lack = lack.mean(axis=1, keepdims=True)
        lack = lack / SAMPLES
        change = np.zeros(len(missing))
        unknowns = self.unknowns()
        change[unknowns] = -self.correct[self.level] @ missing[unknowns]
        self.moved = float(np.max(np.abs(change), initial=0.0))
        if self.moved > self.farthest:
            change *= self.farthest / self.moved
        self.move(change)
        # dynamic inflow has time constants of many seconds: set its azimuthal mean to the steady value at once
        k = self.model.parameter("aerodynamics.inflow_lead")
        for i, (reduced, velocity) in enumerate((("reduced_x", "x"), ("reduced_y", "y"))):
            inflow[InflowState.index(velocity)] += lack[i]
            inflow[InflowState.index(reduced)] += (1.0 - k) * lack[i]

    # result -------------------------------------------------------------------------------------

    def unstable(self) -> str:
        """Result of ``modes.growing`` with blade 1 up."""
        self.prescribe(0.0)
        return growing(self.case)

    def finish(self, azimuth: float = 0.0, warnings: tuple[str, ...] = ()) -> OperatingPoint:
        """March one more revolution, average all signals, and store the state with blade 1 up.

        Args:
          azimuth, warnings: of the operating point.
        """
        case, B = self.case, self.B
        # approach azimuth 0 with the flow that belongs to it
        while round(self.azimuth * B / (2.0 * np.pi)) % B:
            self.sector()
        self.azimuth = 0.0
        step = self.step
        means, made = np.zeros_like(case.signals.vector), 0.0
        rows = []
        for i in range(B * SAMPLES):
            self.prescribe((i + 1) * step)
            equations(0.0, step / self.speed, case.system)
            case.control.drive.generator_torque = self.torque
            case.begin_electric()
            made += float(case.control.drive.generator_torque) / (B * SAMPLES)
            case.loads(0.0)
            means += case.signals.vector / (B * SAMPLES)
            rows.append(np.concatenate([case["q"], case["v"], case.aero_states()]))
            rows[-1][self.generator] -= (i + 1) * step
        aero = case.aero_states()
        self.prescribe(0.0)
        model = self.model
        channels = channels_of(model)
        revolution = np.roll(rows, 1, axis=0)
        if self.speed < 0.0:  # order by rising azimuth
            revolution[1:] = revolution[:0:-1].copy()
        return OperatingPoint(
            wind=self.wind,
            rotor_speed=self.speed,
            pitch=self.pitch,
            generator_speed=self.speed * model.turbine.drivetrain.gear_ratio,
            generator_torque=self.torque,
            imbalance=self.over_revolution + model.turbine.drivetrain.gear_ratio * (self.torque - made),
            q=case["q"].copy(),
            v=case["v"].copy(),
            aero=aero,
            revolution=revolution,
            means=means,
            channels=channels,
            places={name: case.place(channel) for name, channel in channels.items()},
            warnings=warnings,
            azimuth=azimuth,
        )


def channels_of(model: BladedModel) -> dict[str, Channel]:
    """Channels of an operating point."""
    return catalogue(
        model.n_blades,
        model.rotor.n_nodes,
        coordinates=model.coordinates,
        flaps=model.n_flaps,
        gears=model.rotor.gear_stages,
        electrical=model.has_electrical,
    )


def in_steps(reach: Callable[[float], bool], state: Sequence[Float]) -> float:
    """Completed fraction of a path from 0 to 1, in steps that are halved after a failure.

    Args:
      reach: (fraction of the path) -> whether a state could be moved to it.
      state: arrays that are restored after a failure.
    """
    share, step = 0.0, 1.0
    while share < 1.0 and step >= SHORTEST:
        kept, tried = [part.copy() for part in state], min(share + step, 1.0)
        if reach(tried):
            share, step = tried, 2.0 * step
            continue
        for part, values in zip(state, kept, strict=True):
            part[:] = values
        step *= 0.5
    return share


class CarefulOrbit(_Orbit):
    """The periodic motion by continuation, for motions that do not converge at once.

    From a converged motion the next speed, pitch and torque are reached in steps that are halved after a failure; the
    first motion is that in vacuum, from which the air density is raised. In overspeed the first motion is that at the
    reference speed: with a fraction of the air, a harmonic may meet a frequency on the way. Corrections are limited,
    and derivatives are recomputed as long as corrections do not shrink, with inflow and stall marched along: if held,
    they would damp a motion near resonance so much more that corrections would grow.
    """

    careful = True

    def __init__(self, model: BladedModel, wind: SteadyWind) -> None:
        super().__init__(model, wind)
        self.farthest = FARTHEST * model.turbine.rotor_radius
        self.air = float(self.case.plain.aero.air_density)
        self.at: Float | None = None

    def sweep(self, speed: float, pitch: float, torque: float) -> float:
        """Converge the motion; returns the mean residual torque [N m].

        Raises:
          NotConverged: the continuation does not reach it.
        """
        goal = np.array([speed, pitch, torque, self.air])
        if self.at is not None:
            try:
                self.follow(goal)
                return self.left
            except NotConverged:
                pass
        reference = self.model.turbine.rated_rotor_speed
        self.begin(float(np.clip(speed, -reference, reference)), pitch, torque)
        self.follow(goal)
        return self.left

    def begin(self, speed: float, pitch: float, torque: float) -> None:
        """Converge the motion from that in vacuum."""
        for part in (self.blade_c, self.blade_s, self.own, self.core_c, self.core_s):
            part[:] = 0.0
        goal = np.array([speed, pitch, torque, self.air])
        self.at = goal * [1.0, 1.0, 1.0, 0.0]
        self.impose(speed, pitch, torque)
        self.prescribe(0.0)
        self.case.settle(0.0)
        self.follow(goal)

    def follow(self, goal: Float) -> None:
        """Continue the converged motion to another speed, pitch, torque and density of the air."""
        assert self.at is not None
        begin = self.at
        parts = [self.blade_c, self.blade_s, self.own, self.core_c, self.core_s, self.case.aero_state.vector]
        share = in_steps(lambda share: self.settle(begin + share * (goal - begin)), parts)
        self.at = begin + share * (goal - begin)
        if share < 1.0:
            raise NotConverged(self.cause(goal))

    def linearise(self) -> None:
        """Compute the derivatives over the next sector."""
        self.differentiate(self.azimuth + self.step * np.arange(1.0, SAMPLES + 1.0), self.step / self.speed)

    def settle(self, at: Float) -> bool:
        """Whether the motion converges at a speed, pitch, torque and density."""
        *imposed, self.case.plain.aero.air_density = at
        self.impose(*imposed)
        radius, before = self.model.turbine.rotor_radius, np.inf
        self.lefts.clear()
        try:
            for i in range(PATIENCE):
                if i % AGE == 0 and i < FRESH and (i == 0 or self.moved > 0.2 * before):
                    before = self.moved if i else np.inf
                    self.linearise()
                self.sector()
                if i >= FRESH and self.moved >= self.farthest:
                    return False
                if i >= self.B and self.moved < SETTLED * radius:
                    return True
        except (NotConverged, np.linalg.LinAlgError):
            return False
        return self.moved < NEARLY * radius

    def cause(self, goal: Float) -> str:
        """Reason for the lack of steady motion beyond the last converged one, on the way to a goal of ``follow``."""
        assert self.at is not None
        speed, pitch, _, density = self.at
        case, turbine = self.case, self.model.turbine
        *imposed, case.plain.aero.air_density = self.at
        self.impose(*imposed)
        where = (
            f"at a wind speed of {self.wind.speed:g} m/s, near a rotor speed of {30.0 / np.pi * speed:.3g} rpm and "
            f"a pitch of {np.degrees(pitch):.3g} deg"
        )
        if abs(goal[0] - speed) > 0.01 * abs(goal[0]):
            where += f" on the way to {30.0 / np.pi * goal[0]:.4g} rpm"
        if density < self.air:
            where += f", with {100.0 * density / self.air:.0f} % of the aerodynamic loads"
        tip = float(np.linalg.norm(self.model.rotor.tip_shape[:3] @ self.blade_c[0]))
        unstable = self.unstable()
        begin = f"operating_point: no steady operation {where}: "
        if unstable:
            return begin + f"the machine is aeroelastically unstable there, {unstable}"
        if tip > BENT * turbine.blade.length:
            return begin + (
                f"the blades deflect by {tip:.3g} m of their {turbine.blade.length:.3g} m, beyond the range of their "
                "model; less wind, feathered blades (meltemi.analysis.parked_point) or stiffer blades help"
            )
        modal = self.model.options.blade_model == "modal"
        exact = "other blades than options.blade_model 'modal' may help; " if modal else ""
        return begin + (
            f"the search does not converge beyond; {exact}a simulation can start from initial conditions instead "
            "(start=meltemi.Start(...))"
        )
