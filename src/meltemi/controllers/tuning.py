"""``tune_ipc``, ``tune_loops``: gains of pitch and flap loops for stability margins of the linear turbine model.

A loop at nP works on amplitudes: a signal of the blades is the real part of M(t) exp(i n psi_i), and its tilt and yaw
part are those of M. An amplitude that changes with the frequency w, of either sign, is a tone at n W + w on each blade.
So the turbine is one complex transfer function P_n(i w), contained in the linear model in the fixed frame, and the loop
is

    L(s) = (k_I / s + k_P) * exp(i phi) * F(s + i n W) * (-P_n(s)),    F: band-pass, sensor, delay

Loops at several harmonics act on the same blades: each filters its part of a tone, so their L are added.

The rule: phi is the phase by which F and the turbine lag at nP, so L is an integrator for slow changes. A band-pass of
damping zeta delays the loop by 1 / (zeta n W); by default it is as slow as actuator and turbine together, and the
proportional part takes a share of this delay back, k_P = share k_I / (zeta n W). Share and gain are those of the
largest integral gain for which, at every operating point and all frequencies of the controller, phase margin and gain
margin are kept, those of weakly damped modes included. Of several loops the gains are lowered by one
common factor until all together keep the margins; their share is the one that leaves them most. Gains fall with pitch
as 1 / (1 + theta / theta_h), fitted to |P_n(0)|.

Reference: docs/theory/control.md (C-32 to C-38); Astrom, Panagopoulos, Hagglund (1998), Automatica 34, 585-601.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import LinearModel, linearise
from meltemi.control_laws.filters import check_harmonic, response
from meltemi.control_laws.load_control import HarmonicLoop, LoadSensor, SpeedNotch
from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.rotors import default_step
from meltemi.simulation.trim import operating_point

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Actuator = Literal["pitch", "flap"]

PHASE_MARGIN = math.radians(60.0)
GAIN_MARGIN = 2.0
"""6 dB."""
POINTS = 4
"""Operating points of a tuning, from a little above rated wind to cut-out."""
ABOVE_RATED = 1.1
"""Lowest wind speed over rated wind speed."""
SURE = 0.99
"""Used share of the largest gain, as margins between the frequencies may be smaller."""
SHARES = np.linspace(0.0, 1.0, 9)
"""Shares of the delay of the band-pass that the proportional part compensates, among which a tuning chooses."""
HALF_DELAY = 1.5
"""Delay over the sample time: loads are those of the last step, and demands are constant over a step."""
NEAREST, PER_SIDE, HIGHEST = 1e-3, 120, 0.999
"""Frequencies on each side of a harmonic: lowest [rad/s], number, and highest over half the sampling rate."""
DAMPED, ABOUT = 0.1, np.tan(np.linspace(-1.45, 1.45, 21))
"""Damping ratio below which a mode has additional frequencies, and their distances from it in its half-widths."""
DAMPINGS = 0.1, 5.0
"""Limits of the damping ratio of the band-pass."""
NOTCH_DAMPING = 0.2
BEYOND, LAST = 3.5, 25.0
"""Range of the search for the drivetrain resonance, over the rotor speed."""


@dataclass(frozen=True)
class TunedPoint:
    """A control loop at one operating point, together with the other loops.

    Attributes:
      wind_speed: [m/s] wind speed.
      rotor_speed: [rad/s] rotor speed.
      pitch: [rad] collective pitch.
      plant: P_n(0) [N m/rad], amplitude of the blades' moments over that of the demands at nP.
      leak: response to a demand at nP at other frequencies over that at nP; not part of the design.
      frequency: (F,) [rad/s] frequencies of the amplitudes, both signs, without zero.
      plant_response: (F,) P_n [N m/rad].
      loop: (F,) L of this loop.
      together: (F,) sum of all loops; equal to ``loop`` for a single loop.
      bandwidth: [rad/s] lowest frequency at which |L| falls to one.
      phase_margin: [rad] smallest of all loops together, over all frequencies.
      gain_margin: factor by which all gains may grow; may be infinite.
      sensitivity: largest of 1 / |1 + L|, all loops together.
    """

    wind_speed: float
    rotor_speed: float
    pitch: float
    plant: complex
    leak: float
    frequency: Float = field(repr=False)
    plant_response: Complex = field(repr=False)
    loop: Complex = field(repr=False)
    together: Complex = field(repr=False)
    bandwidth: float
    phase_margin: float
    gain_margin: float
    sensitivity: float


@dataclass(frozen=True, repr=False)
class LoopTuning(Brief):
    """A tuned control loop, with its margins.

    Attributes:
      loop: ready for :class:`~meltemi.control_laws.load_control.LoadControl`.
      points: the operating points, with margins.
      phase_margin: [rad] required.
      gain_margin: required.
      factor: reduction of the gains because of the other loops; 1 for a single loop.
    """

    loop: HarmonicLoop
    points: tuple[TunedPoint, ...]
    phase_margin: float
    gain_margin: float
    factor: float = 1.0


def tune_ipc(  # noqa: PLR0913 - design choices, each with a default
    model: BladedModel,
    harmonic: int = 1,
    actuator: Actuator = "pitch",
    *,
    flap: int = 1,
    filter_damping: float | None = None,
    lead_time: float | None = None,
    phase_margin: float = PHASE_MARGIN,
    gain_margin: float = GAIN_MARGIN,
    wind_speeds: Sequence[float] | None = None,
    sensor: LoadSensor | None = None,
    sample_time: float | None = None,
    linear: Sequence[LinearModel] | None = None,
) -> LoopTuning:
    """Tune an individual pitch or flap loop for stability margins of the linear turbine model (C-32 to C-37).

    Args:
      model: turbine model with its actuators and flaps.
      harmonic: multiple n of the rotor speed.
      actuator: actuator of the loop.
      flap: number of the flap, from 1.
      filter_damping: damping ratio of the band-pass, 0: none; by default the filter delays the loop as much as actuator
        and turbine do.
      lead_time: [s] proportional over integral gain; by default the share of the filter's delay that permits the
        largest gain.
      phase_margin: [rad] least phase margin at every operating point.
      gain_margin: least gain margin at every operating point.
      wind_speeds: [m/s] wind speeds of the operating points; by default four from 1.1 times rated to cut-out.
      sensor: dynamics between the blade moments and the controller.
      sample_time: [s] sample time of the controller; by default the model's time step.
      linear: linear models from :func:`linear_models`, for several tunings of one model.

    Raises:
      InputError: a harmonic that number of blades or sample time do not permit, a flap that does not exist, a margin
        out of range, or one that no gain keeps.
    """
    _check(model, flap if actuator == "flap" else 0, phase_margin, gain_margin)
    dt = sample_time or default_step(model)
    models = linear or linear_models(model, wind_speeds)
    plants = _plants(models, harmonic, [harmonic], dt)
    draft = _draft(model, plants, actuator, flap, filter_damping, sensor)
    times = SHARES * draft.delay if lead_time is None else np.array([lead_time])
    return _tuned([draft], times[:, None], phase_margin, gain_margin, sensor)[0]


def tune_loops(
    model: BladedModel,
    targets: Sequence[tuple[Actuator, int]],
    *,
    filter_damping: float | None = None,
    phase_margin: float = PHASE_MARGIN,
    gain_margin: float = GAIN_MARGIN,
    linear: Sequence[LinearModel] | None = None,
    sensor: LoadSensor | None = None,
    sample_time: float | None = None,
) -> tuple[LoopTuning, ...]:
    """Tune several simultaneous loops: each alone, then all gains lowered until all keep the margins (C-37, C-38).

    Arguments not listed here are those of :func:`tune_ipc`.

    Args:
      model: turbine model.
      targets: actuator and harmonic of each loop.

    Raises:
      InputError: as :func:`tune_ipc`.
    """
    if not targets:
        return ()
    _check(model, int(any(actuator == "flap" for actuator, _ in targets)), phase_margin, gain_margin)
    models = linear or linear_models(model)
    dt = sample_time or default_step(model)
    harmonics = [harmonic for _, harmonic in targets]
    drafts = [
        _draft(model, _plants(models, harmonic, harmonics, dt), actuator, 1, filter_damping, sensor)
        for actuator, harmonic in targets
    ]
    times = np.outer(SHARES, [draft.delay for draft in drafts])
    return _tuned(drafts, times, phase_margin, gain_margin, sensor)


def margins(
    linear: Sequence[LinearModel],
    loops: Sequence[HarmonicLoop],
    *,
    sample_time: float,
    sensor: LoadSensor | None = None,
) -> tuple[float, float]:
    """Phase margin [rad] and gain margin of simultaneous loops, smallest over all operating points (C-35, C-38).

    Args:
      linear: linear models from :func:`linear_models`.
      loops: loops that act simultaneously.
      sample_time: [s] sample time of the controller; margins are evaluated up to half the sampling rate.
      sensor: dynamics between the blade moments and the controller.
    """
    points = []
    for plant in _plants(linear, loops[0].harmonic, [loop.harmonic for loop in loops], sample_time):
        together = _sum(plant, loops, sensor)
        points.append([reserve(plant.w, together, plant.poles) for reserve in (phase_reserve, gain_reserve)])
    phase, gain = np.min(points, axis=0)
    return float(phase), float(gain)


def scaled(loop: HarmonicLoop, factor: float) -> HarmonicLoop:
    """The loop with all gains multiplied by a factor."""
    gains = ("integral_gain", "proportional_gain", "derivative_gain")
    return loop.replace(**{name: factor * getattr(loop, name) for name in gains})


def linear_models(
    model: BladedModel, wind_speeds: Sequence[float] | None = None, *, progress: Callable[[float], None] | None = None
) -> list[LinearModel]:
    """Linear models for tuning: pitch and flap demands of all blades to root moments, in the fixed frame."""
    speeds = default_speeds(model) if wind_speeds is None else wind_speeds
    inputs = ["pitch_1", *(f"flap_{j + 1}_1" for j in range(model.n_flaps))]
    outputs = ["generator_speed", "root_moment_out_of_plane_1"]
    models: list[LinearModel] = []
    for u in speeds:
        models.append(linearise(model, operating_point(model, float(u)), inputs, outputs))
        if progress is not None:
            progress(len(models) / len(speeds))
    return models


def default_speeds(model: BladedModel) -> list[float]:
    """[m/s] wind speeds of the operating points of a tuning, evenly spaced from 1.1 times rated to cut-out."""
    turbine = model.turbine
    low, high = turbine.cut_in, turbine.cut_out
    for _ in range(6):  # rated: where the pitch leaves its minimum
        middle = 0.5 * (low + high)
        above = operating_point(model, middle).pitch > turbine.control.pitch.minimum + 1e-6
        low, high = (low, middle) if above else (middle, high)
    return [float(u) for u in np.linspace(min(ABOVE_RATED * high, turbine.cut_out), turbine.cut_out, POINTS)]


def speed_notch(linear: LinearModel, damping: float = NOTCH_DAMPING) -> SpeedNotch:
    """Notch filter of the speed loop at the largest response of generator speed to collective pitch above 3P (C-31).

    Args:
      linear: linear models from :func:`linear_models`; the response is largest near rated wind speed.
    """
    w = np.geomspace(BEYOND * linear.point.rotor_speed, LAST * linear.point.rotor_speed, 200)
    size = np.abs(linear.response(1j * w)[:, linear.outputs.index("generator_speed"), 0])
    return SpeedNotch(frequency=float(w[int(np.argmax(size))]), damping=damping)


def turn(harmonic: int) -> int:
    """Direction of rotation of the nP pattern of three blades: 1 for n = 1, 4, ..., -1 for n = 2, 5, ... (C-33)."""
    return 1 if harmonic % 3 == 1 else -1


class _Plant:
    """Plant of a loop at nP: amplitudes of moments over those of demands, by frequency (C-33).

    Attributes:
      w: (F,) [rad/s] frequencies of the amplitude at nP, up to half the sampling rate on the blades, dense about zero,
        about the other loops and about weakly damped modes.
      poles: [rad/s] poles of the integrators: zero for this loop, and those of the other loops.
    """

    def __init__(self, linear: LinearModel, harmonic: int, harmonics: Set[int], dt: float) -> None:
        self.linear, self.harmonic, self.speed, self.dt = linear, harmonic, linear.point.rotor_speed, dt
        self.poles = tuple({0.0, *((turn(harmonic) * turn(n) * n - harmonic) * self.speed for n in harmonics)})
        shift, highest = (harmonic - turn(harmonic)) * self.speed, HIGHEST * math.pi / dt
        side = np.geomspace(NEAREST, highest - harmonic * self.speed, PER_SIDE)
        roots = linear.eigenvalues
        roots = roots[(-roots.real < DAMPED * np.abs(roots)) & (np.abs(roots) > NEAREST)]
        beside = [pole + sign * side for pole in self.poles for sign in (-1.0, 1.0)]
        modes = roots.imag[:, None] + roots.real[:, None] * ABOUT - shift
        w = np.unique(np.concatenate([*beside, modes.ravel()]))
        near = np.abs(w[:, None] - np.array(self.poles)[None, :]).min(axis=1)
        self.w: Float = w[(near > 0.5 * NEAREST) & (np.abs(w + harmonic * self.speed) <= highest)]
        rows = [linear.outputs.index(f"root_moment_out_of_plane_{part}") for part in ("cosine", "sine")]
        self.H = linear.response(1j * (np.append(self.w, 0.0) + shift))[:, rows]

    def of(self, actuator: Actuator, flap: int) -> tuple[Complex, complex, float]:
        """P_n at the frequencies and at zero [N m/rad], and the leak."""
        name = "pitch" if actuator == "pitch" else f"flap_{flap}"
        columns = [self.linear.inputs.index(f"{name}_{part}") for part in ("cosine", "sine")]
        H, d = self.H[:, :, columns], np.array([1.0, 1j * turn(self.harmonic)])
        P, other = 0.5 * H @ d @ d.conj(), 0.5 * H @ d @ d
        return P[:-1], complex(P[-1]), float(abs(other[-1]) / abs(P[-1]))

    def loop(self, loop: HarmonicLoop, sensor: LoadSensor | None) -> Complex:
        """(F,) contribution of a loop at this or another harmonic to L (C-34, C-38)."""
        tone = self.w + self.harmonic * self.speed
        same = turn(self.harmonic) * turn(loop.harmonic)
        s = 1j * (tone - same * loop.harmonic * self.speed)
        falls = 1.0
        if loop.gain_halving_pitch is not None:
            falls = 1.0 / (1.0 + self.linear.point.pitch / loop.gain_halving_pitch)
        law = falls * (loop.integral_gain / s + loop.proportional_gain)
        P = self.of(loop.actuator, loop.flap)[0]
        return -law * np.exp(1j * same * loop.offset) * _filter(loop, tone, self.speed, sensor, self.dt) * P


_plant = lru_cache(maxsize=32)(_Plant)
"""Plants are cached: responses take most of the time of a tuning, and are used for each loop and for all together."""


def _check(model: BladedModel, flap: int, phase: float, gain: float) -> None:
    if not 0.0 < phase < 0.5 * math.pi:
        raise InputError(f"tune_ipc: phase_margin must lie between 0 and pi/2 rad, found {phase!r}")
    if not gain > 1.0:
        raise InputError(f"tune_ipc: gain_margin must be above 1, found {gain!r}")
    if flap > model.n_flaps:
        raise InputError(f"tune_ipc: flap {flap} is required, the blades have {model.n_flaps or 'none'}")


def _plants(models: Sequence[LinearModel], harmonic: int, harmonics: Sequence[int], dt: float) -> tuple[_Plant, ...]:
    """Plants of a loop among others, for all operating points."""
    return tuple(_plant(each, harmonic, frozenset(harmonics), dt) for each in models)


def _sum(plant: _Plant, loops: Sequence[HarmonicLoop], sensor: LoadSensor | None) -> Complex:
    """(F,) L of simultaneous loops."""
    together: Complex = np.sum([plant.loop(loop, sensor) for loop in loops], axis=0)
    return together


@dataclass(frozen=True)
class _Draft:
    """A loop to be tuned.

    Attributes:
      loop: an integrator of unit bandwidth.
      plants: transfer functions by operating point.
      shapes: L of the loop, by operating point.
    """

    loop: HarmonicLoop
    plants: tuple[_Plant, ...]
    shapes: tuple[Complex, ...]

    @property
    def delay(self) -> float:
        """[s] delay of slow changes by the band-pass."""
        damping = self.loop.filter_damping
        return 1.0 / (damping * self.loop.harmonic * self.plants[0].speed) if damping else 0.0

    def led(self, lead_time: float) -> HarmonicLoop:
        """The loop with a proportional part."""
        return self.loop.replace(proportional_gain=lead_time * self.loop.integral_gain)

    def bandwidth(self, lead_time: float, phase: float, gain: float) -> float:
        """[rad/s] largest bandwidth of the loop alone with a proportional part; 0 if there is none (C-37)."""
        pairs = zip(self.plants, self.shapes, strict=True)
        shapes = [(plant.w, (1.0 + 1j * plant.w * lead_time) * L, plant.poles) for plant, L in pairs]
        # margins do not reveal a loop that amplifies slow changes, such as one whose plant changes sign between points
        right_way = all((L * 1j * w)[np.argmin(np.abs(w))].real > 0.0 for w, L, _ in shapes)
        return SURE * min(largest(*each, phase, gain) for each in shapes) if right_way else 0.0


def _draft(
    model: BladedModel,
    plants: tuple[_Plant, ...],
    actuator: Actuator,
    flap: int,
    filter_damping: float | None,
    sensor: LoadSensor | None,
) -> _Draft:
    """Filter, phase lead, sign and gain schedule of a loop (C-36)."""
    harmonic, speed, dt = plants[0].harmonic, plants[0].speed, plants[0].dt
    for plant in plants:
        check_harmonic(harmonic, plant.speed, dt, model.n_blades)
    responses = [plant.of(actuator, flap) for plant in plants]
    if filter_damping is None:
        lag_time = float(np.mean([_delay(plant.w, P) for plant, (P, _, _) in zip(plants, responses, strict=True)]))
        filter_damping = float(np.clip(1.0 / (lag_time * harmonic * speed), *DAMPINGS))
    pitch = np.array([plant.linear.point.pitch for plant in plants])
    begin, halving = _schedule(pitch, np.array([abs(at_zero) for _, at_zero, _ in responses]))
    loop = HarmonicLoop(
        harmonic=harmonic,
        actuator=actuator,
        flap=flap,
        integral_gain=1.0 / begin,
        filter_damping=filter_damping,
        gain_halving_pitch=halving,
    )
    # lead and sign make the loop an integrator for slow changes, on the average of the points
    lags = [
        np.angle(at_zero * _filter(loop, np.array([harmonic * plant.speed]), plant.speed, sensor, dt)[0])
        for plant, (_, at_zero, _) in zip(plants, responses, strict=True)
    ]
    mean = float(np.angle(np.exp(2j * np.array(lags)).mean())) / 2.0  # of lines through zero, whatever their sign
    sign = -1.0 if np.cos(np.mean(np.unwrap(lags)) - mean) > 0.0 else 1.0
    loop = loop.replace(offset=-mean, integral_gain=sign * loop.integral_gain)
    return _Draft(loop, plants, tuple(plant.loop(loop, sensor) for plant in plants))


def _tuned(
    drafts: Sequence[_Draft], times: Float, phase: float, gain: float, sensor: LoadSensor | None
) -> tuple[LoopTuning, ...]:
    """Gains of simultaneous loops (C-37, C-38), with the best of (choices, loops) lead times [s]."""
    factor, tuned, most = 1.0, list[HarmonicLoop](), 0.0
    for chosen in times:
        alone = [draft.bandwidth(t, phase, gain) for draft, t in zip(drafts, chosen, strict=True)]
        if min(alone) <= 0.0:
            continue
        loops = [scaled(draft.led(t), w) for draft, t, w in zip(drafts, chosen, alone, strict=True)]
        share = 1.0
        if len(loops) > 1:
            sums = [(plant.w, _sum(plant, loops, sensor), plant.poles) for plant in drafts[0].plants]
            share = min(1.0, SURE * min(largest(*each, phase, gain) for each in sums))
        if share * sum(alone) > most:
            factor, most = share, share * sum(alone)
            tracking = [1.0 / (factor * w) for w in alone]
            tuned = [scaled(loop, factor).replace(tracking_time=T) for loop, T in zip(loops, tracking, strict=True)]
    if not tuned:
        raise InputError(
            "tune_ipc: no gain keeps these margins at all operating points: reduce the margins, or check the plants' "
            "phases"
        )
    return tuple(
        LoopTuning(loop, _points(draft.plants, loop, tuned, sensor), phase, gain, factor)
        for draft, loop in zip(drafts, tuned, strict=True)
    )


def _points(
    plants: Sequence[_Plant], loop: HarmonicLoop, loops: Sequence[HarmonicLoop], sensor: LoadSensor | None
) -> tuple[TunedPoint, ...]:
    points = []
    for plant in plants:
        P, at_zero, leak = plant.of(loop.actuator, loop.flap)
        alone, together = plant.loop(loop, sensor), _sum(plant, loops, sensor)
        points.append(
            TunedPoint(
                wind_speed=plant.linear.point.wind.speed,
                rotor_speed=plant.speed,
                pitch=plant.linear.point.pitch,
                plant=at_zero,
                leak=leak,
                frequency=plant.w,
                plant_response=P,
                loop=alone,
                together=together,
                bandwidth=_crossover(plant.w, alone),
                phase_margin=phase_reserve(plant.w, together, plant.poles),
                gain_margin=gain_reserve(plant.w, together, plant.poles),
                sensitivity=float((1.0 / np.abs(1.0 + together)).max()),
            )
        )
    return tuple(points)


def _filter(loop: HarmonicLoop, tone: Float, speed: float, sensor: LoadSensor | None, dt: float) -> Complex:
    """Response of band-pass, sensor and delay at frequencies of the blades [rad/s] (C-34)."""
    low_pass, samples = (sensor.low_pass, sensor.delay) if sensor else (0.0, 0)
    factor: Complex = np.exp(-1j * tone * dt * (HALF_DELAY + samples))
    centre, zeta = loop.harmonic * speed, loop.filter_damping
    if zeta > 0.0:
        factor = factor * np.array([response("band_pass", float(each), centre, zeta, dt) for each in tone])
    if low_pass > 0.0:
        factor = factor * np.array([response("low_pass", float(each), low_pass, 0.0, dt) for each in tone])
    return factor


def _delay(w: Float, P: Complex) -> float:
    """[s] delay of slow changes of the amplitude, positive."""
    after = int(np.searchsorted(w, 0.0))
    late = -float(np.angle(P[after] / P[after - 1])) / (w[after] - w[after - 1])
    return max(late, 1e-3)


def _schedule(pitch: Float, size: Float) -> tuple[float, float | None]:
    """|P| at zero pitch and the pitch at which it has doubled, by least squares; None if it does not grow (C-36)."""
    if len(pitch) < 2 or np.ptp(pitch) < 1e-3:
        return float(size.mean()), None
    slope, begin = np.polyfit(pitch, size, 1)
    if slope <= 0.0 or begin <= 0.0:
        return float(size.max()), None
    return float(begin), float(begin / slope)


def largest(w: Float, L: Complex, poles: Sequence[float], phase: float, gain: float) -> float:
    """Largest factor on L up to which all smaller ones keep both margins (C-35).

    Wherever L lies within ``phase`` of the negative real axis it has to stay below one, on the axis below 1 / ``gain``.
    """
    size = np.abs(L)[np.abs(np.angle(-L)) < phase].max(initial=0.0)
    sides = (gain_reserve(w, L * np.exp(1j * side), poles) for side in (-phase, phase))
    return float(min(gain_reserve(w, L, poles) / gain, *sides, 1.0 / size if size > 0.0 else math.inf))


def phase_reserve(w: Float, L: Complex, poles: Sequence[float] = (0.0,)) -> float:
    """[rad] phase margin of a complex loop, smallest over all frequencies at which its gain is one."""
    size, angle = np.abs(L) - 1.0, math.pi - np.abs(np.angle(L))
    at = _passings(w, size, poles)
    share = size[at] / (size[at] - size[at + 1])
    return float(np.min(angle[at] + share * (angle[at + 1] - angle[at]), initial=math.inf))


def gain_reserve(w: Float, L: Complex, poles: Sequence[float] = (0.0,)) -> float:
    """Gain margin of a complex loop: the inverse of its largest size where it is negative and real."""
    at = _passings(w, L.imag, poles)
    share = L.imag[at] / (L.imag[at] - L.imag[at + 1])
    real = float(np.min(L.real[at] + share * (L.real[at + 1] - L.real[at]), initial=0.0))
    return -1.0 / real if real < 0.0 else math.inf


def _passings(w: Float, x: Float, poles: Sequence[float]) -> NDArray[np.int64]:
    """Indices of the frequencies after which x crosses zero, other than at the pole of an integrator."""
    passes = x[:-1] * x[1:] <= 0.0
    for pole in poles:
        passes &= (w[:-1] - pole) * (w[1:] - pole) > 0.0
    return np.flatnonzero(passes)


def _crossover(w: Float, L: Complex) -> float:
    size = np.abs(L) - 1.0
    at = _passings(w, size, (0.0,))
    frequency = w[at] + (w[at + 1] - w[at]) * size[at] / (size[at] - size[at + 1])
    return float(np.min(np.abs(frequency), initial=math.inf))
