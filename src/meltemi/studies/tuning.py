"""``tune_ipc``: gains of individual pitch and flap loops from the turbine's own linear model, by margins.

A loop at nP works on amplitudes: a signal of the blades is the real part of M(t) exp(i n psi_i), and its tilt and yaw
part are those of M. An amplitude that changes with the frequency w, of either sign, is a tone at n W + w on each blade.
So the turbine is one complex transfer function P_n(i w), which the linear model in the fixed frame has inside, and the
loop is

    L(s) = k_I / s * exp(i phi) * F(s + i n W) * (-P_n(s)),    F: band-pass, sensor, delay

The rule: phi is the phase by which F and the turbine lag at nP, so L is a pure integrator for slow changes. A band-pass
of damping zeta delays the loop by 1 / (zeta n W); it is made as slow as actuator and turbine are together, no slower.
The gain is the largest for which, at every operating point, phase margin and gain margin are kept. Gains fall with
pitch as 1 / (1 + theta / theta_h), fitted to |P_n(0)|.

Reference: docs/theory/control.md (C-32 to C-37).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.control.filters import check_harmonic, response
from meltemi.control.load_control import HarmonicLoop, LoadSensor, SpeedNotch
from meltemi.core.errors import InputError
from meltemi.simulation.linear import LinearModel, linearise
from meltemi.simulation.model import Model
from meltemi.simulation.modes import time_step
from meltemi.simulation.trim import operating_point

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

PHASE_MARGIN = math.radians(60.0)
GAIN_MARGIN = 2.0
"""6 dB."""
POINTS = 4
"""Operating points of a tuning, from a little above rated wind to cut-out."""
ABOVE_RATED = 1.1
"""Of rated wind speed, where they begin."""
FEWEST_SEARCHED, MOST_SEARCHED, SEARCHED = 1e-3, 10.0, 400
"""[rad/s] bandwidths among which the largest is sought, and how many."""
HALF_DELAY = 1.5
"""Of a sample time: loads are those of the step before, and a demand is held for a step."""
DAMPINGS = 0.1, 5.0
"""Of a band-pass that the rule may choose."""
NOTCH_DAMPING = 0.2
BEYOND, HIGHEST = 3.5, 25.0
"""Of the rotor speed: between them the drivetrain's resonance is sought."""


@dataclass(frozen=True)
class TunedPoint:
    """A loop at one operating point.

    Attributes:
      wind_speed: [m/s].
      rotor_speed: [rad/s].
      pitch: [rad].
      plant: P_n(0) [N m/rad], amplitude of the blades' moments over that of the demands at nP.
      leak: what of a demand at nP appears at other frequencies, over what appears at nP; left out of the design.
      frequency: (F,) [rad/s] of the amplitudes, both signs, without zero.
      plant_response: (F,) P_n [N m/rad].
      loop: (F,) L with the gain found.
      bandwidth: [rad/s] lowest frequency at which |L| falls to one.
      phase_margin: [rad] smallest, over both signs of the frequency.
      gain_margin: by which factor the gain could grow; infinite if any.
      sensitivity: largest of 1 / |1 + L|.
    """

    wind_speed: float
    rotor_speed: float
    pitch: float
    plant: complex
    leak: float
    frequency: Float = field(repr=False)
    plant_response: Complex = field(repr=False)
    loop: Complex = field(repr=False)
    bandwidth: float
    phase_margin: float
    gain_margin: float
    sensitivity: float


@dataclass(frozen=True)
class Tuning:
    """A loop and how it was found.

    Attributes:
      loop: ready for :class:`~meltemi.control.load_control.LoadControl`.
      points: the operating points, with margins.
      phase_margin: [rad] that was asked for.
      gain_margin: that was asked for.
    """

    loop: HarmonicLoop
    points: tuple[TunedPoint, ...]
    phase_margin: float
    gain_margin: float


def tune_ipc(
    model: Model,
    harmonic: int = 1,
    actuator: Literal["pitch", "flap"] = "pitch",
    *,
    flap: int = 1,
    filter_damping: float | None = None,
    phase_margin: float = PHASE_MARGIN,
    gain_margin: float = GAIN_MARGIN,
    wind_speeds: Sequence[float] | None = None,
    sensor: LoadSensor | None = None,
    sample_time: float | None = None,
    linear: Sequence[LinearModel] | None = None,
) -> Tuning:
    """An individual pitch or flap loop, tuned by margins on the turbine's own linear model (C-32 to C-37).

    Args:
      model: its actuators count, and its flaps.
      harmonic: multiple n of the rotor speed.
      actuator: what the loop moves.
      flap: which one, from 1.
      filter_damping: damping ratio of the band-pass, 0: none; by default the filter delays the loop as much as actuator
        and turbine do.
      phase_margin: [rad] kept at every operating point.
      gain_margin: factor kept at every operating point.
      wind_speeds: [m/s] of the operating points; by default four from 1.1 times rated to cut-out.
      sensor: what lies between the blades' moments and the controller.
      sample_time: [s] of the controller; by default the model's time step.
      linear: from :func:`linear_models`, for several tunings of one model.

    Raises:
      InputError: a harmonic that the blades or the sample time cannot do, a flap that is not there, a margin out of
        range, or one that no gain keeps.
    """
    if not 0.0 < phase_margin < 0.5 * math.pi:
        raise InputError(f"tune_ipc: phase_margin must lie between 0 and pi/2 rad, found {phase_margin!r}")
    if not gain_margin > 1.0:
        raise InputError(f"tune_ipc: gain_margin must be above 1, found {gain_margin!r}")
    if actuator == "flap" and flap > model.n_flaps:
        raise InputError(f"tune_ipc: flap {flap} is asked for, the blades have {model.n_flaps or 'none'}")
    dt = sample_time or model.options.time_step or time_step(model)
    models = linear or linear_models(model, wind_speeds)
    for each in models:
        check_harmonic(harmonic, each.point.rotor_speed, dt, model.n_blades)
    inputs = [f"pitch_{part}" if actuator == "pitch" else f"flap_{flap}_{part}" for part in ("cosine", "sine")]
    plants = [_plant(each, inputs, harmonic) for each in models]
    if filter_damping is None:
        lag_time = np.mean([_delay(w, P) for w, P, *_ in plants])
        filter_damping = float(np.clip(1.0 / (lag_time * harmonic * models[0].point.rotor_speed), *DAMPINGS))
    pitch = np.array([each.point.pitch for each in models])
    size = np.array([abs(at_zero) for *_, at_zero, _ in plants])
    begin, halving = _schedule(pitch, size)
    filters = [
        _filters(w + harmonic * each.point.rotor_speed, harmonic * each.point.rotor_speed, filter_damping, sensor, dt)
        for each, (w, *_) in zip(models, plants, strict=True)
    ]
    # lead and sign make the loop a pure integrator for slow changes, on the average of the points
    lags = [np.angle(at_zero * f[1]) for (*_, at_zero, _), f in zip(plants, filters, strict=True)]
    mean = float(np.angle(np.exp(2j * np.array(lags)).mean())) / 2.0  # of lines through zero, whatever their sign
    sign = -1.0 if np.cos(np.mean(np.unwrap(lags)) - mean) > 0.0 else 1.0
    offset = -mean
    shapes = []
    for each, (w, P, _, _), (F, _) in zip(models, plants, filters, strict=True):
        falls = 1.0 / (1.0 + each.point.pitch / halving) if halving else 1.0
        shapes.append(-sign * falls / begin / (1j * w) * np.exp(1j * offset) * F * P)
    bandwidth = _largest([(w, L) for (w, *_), L in zip(plants, shapes, strict=True)], phase_margin, gain_margin)
    points = tuple(
        TunedPoint(
            wind_speed=each.point.wind.speed,
            rotor_speed=each.point.rotor_speed,
            pitch=each.point.pitch,
            plant=complex(at_zero),
            leak=leak,
            frequency=w,
            plant_response=P,
            loop=bandwidth * L,
            bandwidth=_crossover(w, bandwidth * L),
            phase_margin=phase_reserve(w, bandwidth * L),
            gain_margin=gain_reserve(w, bandwidth * L),
            sensitivity=float((1.0 / np.abs(1.0 + bandwidth * L)).max()),
        )
        for each, (w, P, at_zero, leak), L in zip(models, plants, shapes, strict=True)
    )
    loop = HarmonicLoop(
        harmonic=harmonic,
        actuator=actuator,
        flap=flap,
        integral_gain=sign * bandwidth / begin,
        filter_damping=filter_damping,
        offset=offset,
        gain_halving_pitch=halving,
        tracking_time=1.0 / bandwidth,
    )
    return Tuning(loop, points, phase_margin, gain_margin)


def linear_models(
    model: Model, wind_speeds: Sequence[float] | None = None, *, progress: Callable[[float], None] | None = None
) -> list[LinearModel]:
    """Linear models for tunings: demands of all blades' pitch and flaps to root moments, in the fixed frame."""
    speeds = default_speeds(model) if wind_speeds is None else wind_speeds
    inputs = ["pitch_1", *(f"flap_{j + 1}_1" for j in range(model.n_flaps))]
    outputs = ["generator_speed", "root_moment_out_of_plane_1"]
    found = []
    for u in speeds:
        found.append(linearise(model, operating_point(model, float(u)), inputs, outputs))
        if progress is not None:
            progress(len(found) / len(speeds))
    return found


def default_speeds(model: Model) -> list[float]:
    """[m/s] of the operating points of a tuning: evenly from 1.1 times rated wind speed to cut-out."""
    turbine = model.turbine
    low, high = turbine.cut_in, turbine.cut_out
    for _ in range(6):  # rated: where the pitch leaves its minimum
        middle = 0.5 * (low + high)
        above = operating_point(model, middle).pitch > turbine.control.pitch.minimum + 1e-6
        low, high = (low, middle) if above else (middle, high)
    return [float(u) for u in np.linspace(min(ABOVE_RATED * high, turbine.cut_out), turbine.cut_out, POINTS)]


def speed_notch(linear: LinearModel, damping: float = NOTCH_DAMPING) -> SpeedNotch:
    """A notch where collective pitch shakes the generator most, beyond 3P, so that the collective law does not (C-31).

    Args:
      linear: from :func:`linear_models`; nearest to rated wind it is highest.
    """
    w = np.geomspace(BEYOND * linear.point.rotor_speed, HIGHEST * linear.point.rotor_speed, 200)
    size = np.abs(linear.response(1j * w)[:, linear.outputs.index("generator_speed"), 0])
    return SpeedNotch(frequency=float(w[int(np.argmax(size))]), damping=damping)


def _plant(linear: LinearModel, inputs: Sequence[str], harmonic: int) -> tuple[Float, Complex, complex, float]:
    """Frequencies [rad/s], P_n there and at zero [N m/rad], and the leak (C-33)."""
    speed = linear.point.rotor_speed
    turn = 1 if harmonic % 3 == 1 else -1  # which way the blades' pattern goes around in cosine and sine part
    side = np.geomspace(1e-3, 3.0 * speed, 90)
    w = np.concatenate([-side[::-1], side])
    s = 1j * (np.append(w, 0.0) + (harmonic - turn) * speed)
    rows = [linear.outputs.index(f"root_moment_out_of_plane_{part}") for part in ("cosine", "sine")]
    columns = [linear.inputs.index(name) for name in inputs]
    H = linear.response(s)[:, rows][:, :, columns]
    d = np.array([1.0, 1j * turn])
    P, other = 0.5 * H @ d @ d.conj(), 0.5 * H @ d @ d
    return w, P[:-1], complex(P[-1]), float(abs(other[-1]) / abs(P[-1]))


def _delay(w: Float, P: Complex) -> float:
    """[s] by which slow changes of the amplitude come later, positive."""
    middle = len(w) // 2
    before, after = middle - 1, middle
    late = -float(np.angle(P[after] / P[before])) / (w[after] - w[before])
    return max(late, 1e-3)


def _filters(w: Float, centre: float, zeta: float, sensor: LoadSensor | None, dt: float) -> tuple[Complex, complex]:
    """Response of band-pass, sensor and delay at blade frequencies ``w``, and at the centre (C-34)."""
    low_pass, samples = (sensor.low_pass, sensor.delay) if sensor else (0.0, 0)
    all_w = np.append(w, centre)
    found = np.exp(-1j * all_w * dt * (HALF_DELAY + samples))
    if zeta > 0.0:
        found = found * np.array([response("band_pass", float(each), centre, zeta, dt) for each in all_w])
    if low_pass > 0.0:
        found = found * np.array([response("low_pass", float(each), low_pass, 0.0, dt) for each in all_w])
    return found[:-1], complex(found[-1])


def _schedule(pitch: Float, size: Float) -> tuple[float, float | None]:
    """|P| at zero pitch and the pitch at which it has doubled, by least squares; None if it does not grow (C-36)."""
    if len(pitch) < 2 or np.ptp(pitch) < 1e-3:
        return float(size.mean()), None
    slope, begin = np.polyfit(pitch, size, 1)
    if slope <= 0.0 or begin <= 0.0:
        return float(size.max()), None
    return float(begin), float(begin / slope)


def phase_reserve(w: Float, L: Complex) -> float:
    """[rad] phase margin of a complex loop, smallest over all frequencies at which its gain is one."""
    size, angle = np.abs(L) - 1.0, math.pi - np.abs(np.angle(L))
    at = np.flatnonzero((size[:-1] * size[1:] <= 0.0) & (w[:-1] * w[1:] > 0.0))
    if not len(at):
        return math.inf
    share = size[at] / (size[at] - size[at + 1])
    return float((angle[at] + share * (angle[at + 1] - angle[at])).min())


def gain_reserve(w: Float, L: Complex) -> float:
    """Gain margin of a complex loop: the inverse of its largest size where it is negative and real."""
    i = L.imag
    at = np.flatnonzero((i[:-1] * i[1:] <= 0.0) & (w[:-1] * w[1:] > 0.0))
    if not len(at):
        return math.inf
    share = i[at] / (i[at] - i[at + 1])
    real = L.real[at] + share * (L.real[at + 1] - L.real[at])
    return float(1.0 / -real.min()) if real.min() < 0.0 else math.inf


def _crossover(w: Float, L: Complex) -> float:
    size = np.abs(L) - 1.0
    at = np.flatnonzero((size[:-1] * size[1:] <= 0.0) & (w[:-1] * w[1:] > 0.0))
    if not len(at):
        return math.inf
    found = w[at] + (w[at + 1] - w[at]) * size[at] / (size[at] - size[at + 1])
    return float(np.abs(found).min())


def _largest(loops: Sequence[tuple[Float, Complex]], phase: float, gain: float) -> float:
    """[rad/s] largest bandwidth up to which all smaller ones keep the margins at all points (C-35)."""
    best = 0.0
    # margins do not tell a loop that drives slow changes up, as one would whose plant has another sign at some points
    right_way = all((L * 1j * w)[np.argmin(np.abs(w))].real > 0.0 for w, L in loops)
    for bandwidth in np.geomspace(FEWEST_SEARCHED, MOST_SEARCHED, SEARCHED):
        kept = all(
            phase_reserve(w, bandwidth * L) >= phase and gain_reserve(w, bandwidth * L) >= gain for w, L in loops
        )
        if not (kept and right_way):
            break
        best = float(bandwidth)
    if best == 0.0:
        raise InputError(
            "tune_ipc: no gain keeps these margins at all operating points: ask for less, or look at the plants' phases"
        )
    return best
