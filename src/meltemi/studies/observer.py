"""Observer of wind and loads from turbine signals: a Kalman filter scheduled by the lagged wind speed.

    dz/dt = A z + B u + G w,   y = C z + D u + v     about steady operation at each wind speed

The state z contains the states of the linear model in the fixed frame, the rotor-effective wind speed (a random walk)
and harmonics of the turbulence in the frame of a rotating blade. Gains solve the discrete Riccati equation at each wind
speed.

Reference: docs/theory/observer.md (O-1 to O-12); Branlard, Jonkman, Brown and Zhang (2024), Wind Energ. Sci. 9, 1-24.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.analyses.linear import LinearModel, linearise
from meltemi.control_laws.kalman import HEAD, SCHEDULE, filter_vector, kalman_step
from meltemi.core.errors import InputError, MeltemiError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.shown import Brief
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.channels import Channel, ChannelSet, catalogue
from meltemi.simulation.model import Model
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.studies.kalman_design import condensed, discrete, stationary
from meltemi.studies.observer_signals import INPUTS, SENSORS, STEP, Signals, signals_of
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.spectra import coherence_decay, densities, scale_parameter
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

TOWER = ("tower_base_moment_fore_aft", "tower_base_moment_side_side", "tower_top_fore_aft", "tower_top_side_side")
BLADE = ("root_moment_out_of_plane", "root_moment_in_plane")
HARMONICS = (1, 2, 3, 4)
"""Multiples of the rotor frequency of the turbulence in a rotating frame."""
AZIMUTHS = 4
"""Rotor positions in a third of a revolution over which the matrices are averaged."""
BEYOND = 0.3
"""Share of the largest steady value by which speed, torque and pitch may leave their range in production."""
MISFIT = 10.0
"""Innovation over its expected deviation from which on the signals are not those of the turbine; in full simulations
with dynamic stall and wake it is 2 to 3."""
WIND = Channel(
    "rotor_effective_wind",
    "",
    "m/s",
    "-",
    "downwind",
    "wind speed averaged over the rotor, estimated",
    ("observer", ""),
)


class SensorNoise(Record):
    """Standard deviations of white noise of the sensors, per sample."""

    speed: float = Field(default=5e-4, gt=0.0)
    """Generator speed over its rated value."""
    acceleration: float = Field(default=0.01, gt=0.0)
    """[m/s^2] tower-top acceleration."""


class ExpectedTurbulence(Record):
    """Turbulence model of the filter: Kaimal spectrum with exponential coherence."""

    reference_intensity: float = Field(default=0.16, gt=0.0, lt=1.0)
    """I_ref of the class: sigma = I_ref (0.75 V + 5.6 m/s), the normal turbulence model."""
    edition: Literal[2, 3, 4] = 3
    """Edition of IEC 61400-1, for length scales and coherence."""

    def deviation(self, speed: float) -> float:
        """Standard deviation [m/s] at a mean wind speed [m/s]."""
        return self.reference_intensity * (0.75 * speed + 5.6)

    def harmonics(self, speed: float, height: float, radius: float) -> tuple[Float, Float]:
        """Variances [m^2/s^2] and time constants [s] of the harmonics 0 to 4 of the wind on a blade (O-5, O-6).

        Args:
          speed: [m/s] mean wind speed.
          height: [m] hub height.
          radius: [m] rotor radius.
        """
        scale = scale_parameter(self.edition, height)
        f = np.concatenate([[0.0], np.geomspace(1e-4, 5.0, 120)])
        S = densities("kaimal", f, speed, self.deviation(speed), scale)[0]
        decay = coherence_decay("kaimal", self.edition, f, speed, scale)
        r, theta = radius * (np.arange(12) + 0.5) / 12.0, np.pi * (np.arange(48) + 0.5) / 48.0
        weight = r**2 / np.sum(r**2)
        apart = np.sqrt(
            np.maximum(r[:, None, None] ** 2 + r[:, None] ** 2 - 2.0 * r[:, None, None] * r[:, None] * np.cos(theta), 0)
        )
        variance, times = [], []
        for n in (0, *HARMONICS):
            share = [
                np.einsum("i,j,ijk->", weight, weight, np.exp(-a * apart) * np.cos(n * theta)) / len(theta)
                for a in decay
            ]
            density = (1.0 if n == 0 else 2.0) * S * np.array(share)
            variance.append(float(np.trapezoid(density, f)))
            times.append(float(density[0] / (4.0 * variance[-1])))
        return np.array(variance), np.array(times)


@dataclass(frozen=True)
class Estimate:
    """Estimates from measured signals.

    Attributes:
      result: estimated wind, loads and motion of the tower, as a result.
      deviation: (T, C) standard deviations of the errors, by channel.
      innovation: (T, 3) measured minus predicted sensors, over their predicted standard deviations.
      samples: samples of the conditional distribution of the loads given the signals: estimate plus a realisation of
        its error. Their damage-equivalent loads scatter about that of the turbine.
    """

    result: Result
    deviation: Float = field(repr=False)
    innovation: Float = field(repr=False)
    samples: tuple[Result, ...] = field(default=(), repr=False)


@dataclass(frozen=True, repr=False)
class Observer(Brief):
    """A Kalman filter for each wind speed; ``estimate`` applies it to a result, ``start`` creates one for a controller.

    Attributes:
      wind_speed: (k,) [m/s] wind speeds of the operating points.
      centre: (k, n) states at the operating points.
      A, B, K, C, D: matrices and gains of the discrete models, see ``kalman_step``.
      inputs, outputs: (k, m), (k, p) values at the operating points.
      covariance: (k, n, n) covariance of the error after an update.
      innovation: (k, s, s) covariance of the innovation.
      Q, R: (k, n, n), (s, s) covariances of process and sensor noise, per step.
      states, output_names: names of states and outputs.
      model: turbine model.
    """

    wind_speed: Float
    centre: Float
    A: Float
    B: Float
    K: Float
    C: Float
    D: Float
    inputs: Float
    outputs: Float
    covariance: Float
    innovation: Float
    Q: Float
    R: Float
    states: tuple[str, ...]
    output_names: tuple[str, ...]
    model: Model[Any]

    def __repr__(self) -> str:
        speeds = f"{self.wind_speed[0]:g} to {self.wind_speed[-1]:g} m/s"
        return f"<Observer of {self.model.turbine.name}: {len(self.states)} states, {speeds}, {1.0 / STEP:g} Hz>"

    @property
    def wind_place(self) -> int:
        """Index of the rotor-effective wind speed in the state."""
        return self.states.index("rotor-effective wind")

    @property
    def lag(self) -> float:
        """Lag [s] of the scheduling wind speed: a revolution at rated speed, over which the models average."""
        drivetrain, control = self.model.turbine.drivetrain, self.model.turbine.control
        return float(2.0 * np.pi * drivetrain.gear_ratio / control.pitch.reference_speed)

    def start(self, wind_speed: float) -> ObserverFilter:
        """A filter in steady operation at a wind speed [m/s]."""
        return ObserverFilter(self, wind_speed)

    def using(self, present: Sequence[bool] | NDArray[np.bool_]) -> Observer:
        """The observer with gains and covariances of some of the sensors only.

        Args:
          present: (3,) mask of ``SENSORS``.

        Raises:
          MeltemiError: these sensors do not determine the state.
        """
        some = np.flatnonzero(present)
        K, S, P = np.zeros_like(self.K), self.innovation.copy(), np.empty_like(self.covariance)
        for i in range(len(K)):
            try:
                K[i][:, some], P[i], S[i][np.ix_(some, some)] = stationary(
                    self.A[i], self.C[i, some], self.Q[i], self.R[np.ix_(some, some)]
                )
            except np.linalg.LinAlgError as error:
                names = ", ".join(SENSORS[k] for k in some)
                raise MeltemiError(f"observer: no gain at {self.wind_speed[i]:g} m/s from {names}: {error}") from None
        return replace(self, K=K, covariance=P, innovation=S)

    def guess(self, speed: float, torque: float, pitch: float) -> float:
        """Wind speed [m/s] at which steady operation is closest to a generator speed, torque and pitch (SI units)."""
        points = np.column_stack([self.outputs[:, 0], self.inputs])
        scale = np.maximum(points.max(axis=0) - points.min(axis=0), 1e-9)
        far = np.sum(((points - [speed, torque, pitch]) / scale) ** 2, axis=1)
        return float(self.wind_speed[np.argmin(far)])

    @one_blas_thread
    def estimate(self, result: Result, *, samples: int = 0, seed: int = 1) -> Estimate:
        """Estimate wind and loads from the signals of a result, whose loads and wind are not used.

        Args:
          result: result with ``generator_speed``, ``pitch_1`` and ``generator_torque`` or ``generator_power``, and if
            available, ``tower_top_acceleration_x``, ``tower_top_acceleration_y`` and ``azimuth``.
          samples: number of samples of the distribution of the loads.
          seed: seed of the samples.

        Samples with values that are not finite are excluded. In gaps the estimate is a prediction without sensors.
        The warnings of the estimated result list gaps and signals that are inconsistent with the turbine.

        Raises:
          InputError: a signal is missing, hardly any of its samples is finite, or the series is too short.
          MeltemiError: the state cannot be determined without the accelerations.
        """
        signals = signals_of(result, self.model.turbine)
        missing = np.isnan(signals.sensors[0])
        usable = self.using(~missing) if np.any(missing) else self
        meta = {k: v for k, v in result.meta.items() if k in ("turbine", "wind", "transient", "file")}
        estimate = usable._estimate(signals, meta | {"controller": "observer"}, samples, seed)
        outside = self._outside(signals.sensors[:, 0], *signals.inputs.T)
        meta = estimate.result.meta | {"warnings": [*signals.warnings, *outside, *_misfits(estimate.innovation)]}
        return replace(estimate, result=replace(estimate.result, meta=meta))

    def _estimate(self, signals: Signals, meta: dict[str, Any], samples: int, seed: int) -> Estimate:
        """The estimate from signals whose missing sensors this observer does not use."""
        y, speeds, schedule, gaps = self._filtered(signals)
        near = self._nearest(schedule)
        gaps /= np.sqrt(np.stack([np.diag(S) for S in self.innovation]))[near]
        channels, places = self._channels()
        mix = _mixing(self.output_names, signals.azimuth, places)
        data = np.column_stack([speeds, mix(y)])
        errors = np.stack([c @ P @ c.T for c, P in zip(self.C, self.covariance, strict=True)])
        deviation = np.column_stack(
            [
                np.sqrt(self.covariance[near, self.wind_place, self.wind_place]),
                _deviations(self.output_names, errors[near], signals.azimuth, places),
            ]
        )
        estimated = Result(signals.time, data, channels, meta=meta)
        chance = np.random.default_rng(seed)
        roots = [_root(Q, 1e-14 * np.trace(Q) / len(Q)) for Q in self.Q] if samples else []
        draws = (self._drawn_error(near, roots, chance) for _ in range(samples))
        realisations = tuple(
            replace(estimated, data=data + np.column_stack([wind, mix(wrong)])) for wind, wrong in draws
        )
        return Estimate(estimated, deviation, gaps, realisations)

    def _filtered(self, signals: Signals) -> tuple[Float, Float, Float, Float]:
        """(T, p) outputs, (T,) wind speed, (T,) scheduling wind speed, and (T, s) measured minus predicted sensors."""
        u, measured = signals.inputs, signals.sensors
        T, p = len(signals.time), len(self.output_names)
        y, speeds, schedule, gaps = np.zeros((T, p)), np.zeros(T), np.zeros(T), np.zeros((T, len(SENSORS)))
        now = self.start(self.guess(float(measured[0, 0]), float(u[0, 0]), float(u[0, 1])))
        for i in range(T):
            expected = now.predicted(u[i])
            y[i] = now.step(u[i], measured[i])
            speeds[i], schedule[i] = now.wind_speed, now.schedule
            gaps[i] = measured[i] - expected
        return y, speeds, schedule, gaps

    def _drawn_error(
        self, near: NDArray[np.intp], roots: Sequence[Float], chance: np.random.Generator
    ) -> tuple[Float, Float]:
        """(T,) and (T, p) a realisation of the error of the wind and of the outputs (O-12)."""
        T, n = len(near), len(self.states)
        e = _root(self.covariance[near[0]], 1e-12) @ chance.standard_normal(n)
        wrong, wind = np.zeros((T, len(self.output_names))), np.zeros(T)
        shocks, noise = chance.standard_normal((T, n)), chance.standard_normal((T, len(SENSORS)))
        noise *= np.sqrt(np.diag(self.R))
        for i, k in enumerate(near):
            e = self.A[k] @ e + roots[k] @ shocks[i]
            e = e - self.K[k] @ (self.C[k, : len(SENSORS)] @ e + noise[i])
            wrong[i], wind[i] = self.C[k] @ e, e[self.wind_place]
        return wind, wrong

    def _outside(self, *signals: Float) -> list[str]:
        """Warnings about generator speed, torque and pitch that are mostly outside their range in operation."""
        steady = (self.outputs[:, 0], *self.inputs.T)
        lines = []
        for name, x, steady_values in zip((SENSORS[0], *INPUTS), signals, steady, strict=True):
            room = BEYOND * float(np.abs(steady_values).max())
            low, high = float(steady_values.min()) - room, float(steady_values.max()) + room
            share = float(np.mean((x < low) | (x > high)))
            if share > 0.5:
                lines.append(
                    f"{name} is {x.mean():.4g} on average, in production it is {steady_values.min():.4g} to "
                    f"{steady_values.max():.4g} "
                    "(SI units): the estimate is not that of the turbine; check units, names and turbine"
                )
        return lines

    def _nearest(self, speed: Float) -> NDArray[np.intp]:
        spacing = self.wind_speed[1] - self.wind_speed[0]
        place = np.rint((speed - self.wind_speed[0]) / spacing)
        return np.clip(place, 0, len(self.wind_speed) - 1).astype(np.intp)

    def _channels(self) -> tuple[tuple[Channel, ...], list[str]]:
        known = catalogue(ChannelSet(3))
        places = [*TOWER, *(f"{b}_{i}" for b in BLADE for i in (1, 2, 3))]
        return (WIND, *(known[name] for name in places)), places


def _root(covariance: Float, least: float) -> Float:
    """Factor of a covariance, with ``least`` added to the variances so that there is one."""
    return np.asarray(np.linalg.cholesky(covariance + least * np.eye(len(covariance))), float)


def _misfits(innovation: Float) -> list[str]:
    """Warnings about sensors far from their predictions; by the median, which is insensitive to starts and faults."""
    lines = []
    for name, gaps in zip(SENSORS, innovation.T, strict=True):
        if np.any(np.isfinite(gaps)) and (far := float(np.nanmedian(np.abs(gaps)) / 0.6745)) > MISFIT:
            lines.append(
                f"{name} differs from its prediction by {far:.2g} times the expected deviation: the signals are not "
                "those of this turbine in production; check units, names and turbine"
            )
    return lines


class ObserverFilter:
    """Filter of an observer with its state in time.

    Attributes:
      memory: the complete filter as one vector, which can be the state of a compiled controller, see ``kalman_step``.
      z: (n,) state.
      y: (p,) outputs of the last step, named by ``observer.output_names``.
    """

    def __init__(self, observer: Observer, wind_speed: float) -> None:
        o = self.observer = observer
        z = np.array([np.interp(wind_speed, o.wind_speed, c) for c in o.centre.T])
        u = np.array([np.interp(wind_speed, o.wind_speed, c) for c in o.inputs.T])
        first, spacing, share = o.wind_speed[0], o.wind_speed[1] - o.wind_speed[0], -np.expm1(-STEP / o.lag)
        tables = (o.centre, o.A, o.B, o.K, o.C, o.D, o.inputs, o.outputs)
        self.memory = filter_vector(z, u, len(SENSORS), o.wind_place, (first, spacing, share, wind_speed), tables)
        n = len(z)
        self.z, self.y = self.memory[HEAD : HEAD + n], self.memory[HEAD + n : HEAD + n + len(o.output_names)]

    @property
    def wind_speed(self) -> float:
        """Rotor-effective wind speed [m/s]."""
        return float(self.z[self.observer.wind_place])

    @property
    def schedule(self) -> float:
        """Scheduling wind speed [m/s]: the lagged estimate."""
        return float(self.memory[SCHEDULE])

    def place(self, name: str) -> int:
        """Index in ``memory`` of an output in the fixed frame, or of a state, by its name."""
        names = (*self.observer.states, *self.observer.output_names)
        if name not in names:
            raise InputError(f"observer: no {name!r}: {did_you_mean(name, names)}")
        return HEAD + names.index(name)

    def __getitem__(self, name: str) -> float:
        """An output of the last step, by its name in the fixed frame, or a state by its name."""
        return float(self.memory[self.place(name)])

    def step(self, inputs: Sequence[float] | Float, measured: Sequence[float] | Float) -> Float:
        """Outputs after one step of 0.04 s.

        Args:
          inputs: (2,) generator torque [N m] and mean pitch [rad].
          measured: (3,) generator speed [rad/s], acceleration of the tower top along x and y [m/s^2]; NaN if unknown.
        """
        kalman_step(self.memory, np.asarray(inputs, float), np.asarray(measured, float))
        return self.y

    def predicted(self, inputs: Sequence[float] | Float) -> Float:
        """(3,) sensor values predicted for the next step."""
        n = HEAD + len(self.z) + len(self.y) + 2 * len(INPUTS)
        keep = self.memory[:n].copy()
        outputs = self.step(inputs, np.full(len(SENSORS), np.nan))[: len(SENSORS)].copy()
        self.memory[:n] = keep
        return outputs


def _mixing(names: Sequence[str], azimuth: Float, wanted: Sequence[str]) -> Callable[[Float], Float]:
    """Function that converts outputs in the fixed frame (T, p) to channels (T, C)."""

    def mix(y: Float) -> Float:
        return np.column_stack([np.einsum("tp,tp->t", row, y) for row in _rows(names, azimuth, wanted)])

    return mix


def _rows(names: Sequence[str], azimuth: Float, wanted: Sequence[str]) -> list[Float]:
    """(T, p) weights of the outputs in each channel."""
    rows = []
    for name in wanted:
        row = np.zeros((len(azimuth), len(names)))
        if name in names:
            row[:, names.index(name)] = 1.0
        else:
            base, blade = name[:-2], int(name[-1])
            psi = azimuth + 2.0 * np.pi / 3.0 * (blade - 1)
            parts = {"collective": np.ones_like(psi), "cosine": np.cos(psi), "sine": np.sin(psi)}
            for part, weight in parts.items():
                row[:, names.index(f"{base}_{part}")] = weight
        rows.append(row)
    return rows


def _deviations(names: Sequence[str], errors: Float, azimuth: Float, wanted: Sequence[str]) -> Float:
    """(T, C) standard deviations of the channels, from covariances (T, p, p)."""
    rows = _rows(names, azimuth, wanted)
    return np.sqrt(np.column_stack([np.maximum(np.einsum("tp,tpq,tq->t", r, errors, r), 0.0) for r in rows]))


@one_blas_thread
def observer(
    model: Model[Any],
    *,
    turbulence: ExpectedTurbulence | None = None,
    noise: SensorNoise | None = None,
    shear_exponent: float = 0.2,
    spacing: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> Observer:
    """Observer of wind and loads of a turbine with three blades.

    Air density, flexibility and aerodynamic options are those of the model; wake and stall are in equilibrium in the
    fixed frame.

    Args:
      model: turbine model.
      turbulence: expected turbulence; category A by default.
      noise: sensor noise.
      shear_exponent: shear exponent of the mean wind.
      spacing: [m/s] spacing of the wind speeds, from cut-in to cut-out.
      progress: callback with the completed fraction.

    Raises:
      InputError: a value is not valid.
      UnsupportedError: the rotor does not have three blades.
    """
    if not 0.0 < spacing <= 5.0:
        raise InputError(f"observer: spacing must be above 0 and at most 5 m/s, found {spacing!r}")
    turbulence, noise = turbulence or ExpectedTurbulence(), noise or SensorNoise()
    turbine = model.turbine.replace(**{"pitch_actuator.kind": "ideal"})
    plain = build(turbine, model.options, model.environment)
    rated = turbine.control.pitch.reference_speed
    R = np.diag([(noise.speed * rated) ** 2, noise.acceleration**2, noise.acceleration**2])
    speeds = np.arange(turbine.cut_in, turbine.cut_out + 1e-9, spacing)
    parts = []
    for i, speed in enumerate(speeds):
        if progress is not None:
            progress(i / len(speeds))
        linear = _linear_model(plain, SteadyWind(speed=float(speed), shear_exponent=shear_exponent))
        try:
            parts.append(_design(linear, turbine, turbulence, R))
        except np.linalg.LinAlgError as error:
            raise MeltemiError(f"observer: no gain at {speed:g} m/s: {error}") from None
    arrays: dict[str, Any] = {
        name: np.ascontiguousarray(np.stack(column))
        for name, column in zip(ARRAYS, zip(*parts, strict=True), strict=True)
    }
    harmonics = [f"harmonic {n} {part}" for n in HARMONICS for part in ("cosine", "sine")]
    states = (*linear.states, "rotor-effective wind", *harmonics)
    return Observer(wind_speed=speeds, R=R, states=states, output_names=linear.outputs, model=model, **arrays)


def _linear_model(model: Model[Any], wind: SteadyWind) -> LinearModel:
    """Linear model about steady operation in a wind, with wake and stall in equilibrium."""
    inputs = (*INPUTS, "wind_speed", "vertical_shear", "horizontal_shear")
    outputs = (*SENSORS, *TOWER, *(f"{name}_1" for name in BLADE))
    linear = linearise(model, operating_point(model, wind), inputs, outputs, azimuths=AZIMUTHS)
    return condensed(linear, np.array([" inflow " in name or " stall " in name for name in linear.states]))


ARRAYS = ("centre", "A", "B", "K", "C", "D", "inputs", "outputs", "covariance", "innovation", "Q")
"""Results of :func:`_design`, as attributes of :class:`Observer`."""


def _design(linear: LinearModel, turbine: AnyTurbine, turbulence: ExpectedTurbulence, R: Float) -> tuple[Float, ...]:
    """Discrete model, gain and covariances at one wind speed (O-1 to O-10)."""
    speed, omega = float(linear.u0[2]), linear.point.rotor_speed
    n, m = len(linear.states), len(INPUTS)
    scale = _wind_scale(linear, speed)
    mix, F, q = _wind_model(*turbulence.harmonics(speed, turbine.hub_height, turbine.rotor_radius), omega)
    h = len(q)
    A = np.block([[linear.A, linear.B[:, m:] @ scale @ mix], [np.zeros((h, n)), F]])
    B = np.vstack([linear.B[:, :m], np.zeros((h, m))])
    C = np.hstack([linear.C, linear.D[:, m:] @ scale @ mix])
    Ad, Bd, Q = discrete(A, B, np.diag([*np.zeros(n), *q]), STEP)
    K, P, S = stationary(Ad, C[: len(SENSORS)], Q, R)
    centre = np.concatenate([linear.x0, [speed], np.zeros(h - 1)])
    return centre, Ad, Bd, K, C, linear.D[:, :m], linear.u0[:m], linear.y0, P, S, Q


def _wind_scale(linear: LinearModel, speed: float) -> Float:
    """(3, 3) wind speed and shears from collective, cosine and sine component of the wind at the blades [m/s]."""
    # a shear of 1 changes the wind by V r / D; the harmonics are averages weighted with r^2, for which r is 3 R / 4
    shear = 1.0 / (speed * 3.0 / 8.0)
    # the sine component is the wind on the side of the downward moving blade 1: its moment has the sign of the sine
    gain = linear.response([1e-3j])[0].real
    row = linear.outputs.index("root_moment_out_of_plane_sine")
    side = np.sign(gain[row, len(INPUTS) + 2]) or 1.0
    return np.diag([1.0, shear, side * shear])


def _wind_model(variance: Float, times: Float, omega: float) -> tuple[Float, Float, Float]:
    """Model of the wind at the blades in the fixed frame (O-3, O-4).

    Args:
      variance, times: variances [m^2/s^2] and time constants [s] of the harmonics 0 to 4.
      omega: [rad/s] rotor speed.

    Returns:
      (3, h) collective, cosine and sine component from the states, (h, h) dynamics of the states, and (h,) intensity
      of their white noise.
    """
    h = 1 + 2 * len(HARMONICS)
    mix, F, q = np.zeros((3, h)), np.zeros((h, h)), np.zeros(h)
    mix[0, 0] = 1.0
    mix[1, 1] = mix[2, 2] = 1.0  # first harmonic: constant in the fixed frame
    mix[1, 3], mix[2, 4] = 1.0, 1.0  # second and fourth: three times the rotor frequency
    mix[0, 5] = 1.0
    mix[1, 7], mix[2, 8] = 1.0, -1.0
    q[0] = 2.0 * variance[0] / times[0]
    for i, k in enumerate(HARMONICS, 1):
        a = slice(2 * i - 1, 2 * i + 1)
        turn = 0.0 if k == 1 else 3.0 * omega
        F[a, a] = [[-1.0 / times[k], -turn], [turn, -1.0 / times[k]]]
        q[a] = 2.0 * variance[k] / times[k]
    return mix, F, q
