"""``tune_ipc``, ``tune_loops``: gains of pitch and flap loops for stability margins of the linear turbine model.

A loop at nP works on amplitudes: a signal of the blades is the real part of M(t) exp(i n psi_i), and its tilt and yaw
part are those of M. An amplitude that changes with the frequency w, of either sign, is a tone at n W + w on each blade.
So the turbine is one complex transfer function P_n(i w), contained in the linear model in the fixed frame, and the loop
is

    L(s) = (k_I / s + k_P) * exp(i phi) * F(s + i n W) * (-P_n(s)),    F: band-pass, sensor, delay

Loops at several harmonics act on the same blades: each one takes its part of a tone, so their L add up.

The rule: phi is the phase by which F and the turbine lag at nP, so L is an integrator for slow changes. A band-pass of
damping zeta delays the loop by 1 / (zeta n W); it is made as slow as actuator and turbine are together, and the
proportional part takes this delay back, k_P = k_I / (zeta n W). The gain is the largest for which, at every operating
point, phase margin and gain margin are kept; of several loops the gains are then lowered by one common factor until
all together keep them. Gains fall with pitch as 1 / (1 + theta / theta_h), fitted to |P_n(0)|.

Reference: docs/theory/control.md (C-32 to C-38).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.control.filters import check_harmonic, response
from meltemi.control.load_control import HarmonicLoop, LoadSensor, SpeedNotch
from meltemi.core.display import Brief
from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.linear import LinearModel, linearise
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
FEWEST_SEARCHED, MOST_SEARCHED, SEARCHED = 1e-3, 10.0, 400
"""[rad/s] range of the search for the largest bandwidth, and number of bandwidths."""
FACTORS = np.linspace(1.0, 0.02, 99)
"""Common factors on the gains of several loops."""
HALF_DELAY = 1.5
"""Delay over the sample time: loads are those of the step before, and a demand is held for a step."""
NEAREST, FARTHEST, PER_SIDE = 1e-3, 3.0, 70
"""Frequencies on each side of a harmonic: lowest [rad/s], highest [rotor speeds], number."""
DAMPINGS = 0.1, 5.0
"""Limits of the damping ratio of the band-pass."""
NOTCH_DAMPING = 0.2
BEYOND, HIGHEST = 3.5, 25.0
"""Range of the search for the drivetrain resonance, over the rotor speed."""


@dataclass(frozen=True)
class TunedPoint:
    """A control loop at one operating point, together with the other loops.

    Attributes:
      wind_speed: [m/s].
      rotor_speed: [rad/s].
      pitch: [rad].
      plant: P_n(0) [N m/rad], amplitude of the blades' moments over that of the demands at nP.
      leak: response to a demand at nP at other frequencies over that at nP; not part of the design.
      frequency: (F,) [rad/s] of the amplitudes, both signs, without zero.
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
      loop: ready for :class:`~meltemi.control.load_control.LoadControl`.
      points: the operating points, with margins.
      phase_margin: [rad] required.
      gain_margin: required.
      factor: by which gains were lowered because of the other loops; 1 for a single loop.
    """

    loop: HarmonicLoop
    points: tuple[TunedPoint, ...]
    phase_margin: float
    gain_margin: float
    factor: float = 1.0


def tune_ipc(
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
      model: of the turbine, with its actuators and flaps.
      harmonic: multiple n of the rotor speed.
      actuator: that the loop moves.
      flap: its number, from 1.
      filter_damping: damping ratio of the band-pass, 0: none; by default the filter delays the loop as much as actuator
        and turbine do.
      lead_time: [s] proportional over integral gain; by default the filter's delay.
      phase_margin: [rad] kept at every operating point.
      gain_margin: factor kept at every operating point.
      wind_speeds: [m/s] of the operating points; by default four from 1.1 times rated to cut-out.
      sensor: dynamics between the blade moments and the controller.
      sample_time: [s] of the controller; by default the model's time step.
      linear: from :func:`linear_models`, for several tunings of one model.

    Raises:
      InputError: a harmonic that number of blades or sample time do not permit, a flap that does not exist, a margin
        out of range, or one that no gain keeps.
    """
    if not 0.0 < phase_margin < 0.5 * math.pi:
        raise InputError(f"tune_ipc: phase_margin must lie between 0 and pi/2 rad, found {phase_margin!r}")
    if not gain_margin > 1.0:
        raise InputError(f"tune_ipc: gain_margin must be above 1, found {gain_margin!r}")
    if actuator == "flap" and flap > model.n_flaps:
        raise InputError(f"tune_ipc: flap {flap} is asked for, the blades have {model.n_flaps or 'none'}")
    dt = sample_time or default_step(model)
    models = linear or linear_models(model, wind_speeds)
    for each in models:
        check_harmonic(harmonic, each.point.rotor_speed, dt, model.n_blades)
    plants = [_Plant(each, harmonic, ()) for each in models]
    own = [plant.of(actuator, flap) for plant in plants]
    if filter_damping is None:
        lag_time = float(np.mean([_delay(plant.w, P) for plant, (P, _, _) in zip(plants, own, strict=True)]))
        filter_damping = float(np.clip(1.0 / (lag_time * harmonic * models[0].point.rotor_speed), *DAMPINGS))
    if lead_time is None:
        lead_time = 1.0 / (filter_damping * harmonic * models[0].point.rotor_speed) if filter_damping else 0.0
    pitch, size = np.array([each.point.pitch for each in models]), np.array([abs(at_zero) for _, at_zero, _ in own])
    begin, halving = _schedule(pitch, size)
    draft = HarmonicLoop(
        harmonic=harmonic,
        actuator=actuator,
        flap=flap,
        integral_gain=1.0 / begin,
        proportional_gain=lead_time / begin,
        filter_damping=filter_damping,
        gain_halving_pitch=halving,
    )
    # lead and sign make the loop an integrator for slow changes, on the average of the points
    lags = [
        np.angle(at_zero * _filter(draft, np.array([harmonic * plant.speed]), plant.speed, sensor, dt)[0])
        for plant, (_, at_zero, _) in zip(plants, own, strict=True)
    ]
    mean = float(np.angle(np.exp(2j * np.array(lags)).mean())) / 2.0  # of lines through zero, whatever their sign
    sign = -1.0 if np.cos(np.mean(np.unwrap(lags)) - mean) > 0.0 else 1.0
    draft = draft.replace(
        offset=-mean, integral_gain=sign * draft.integral_gain, proportional_gain=sign * draft.proportional_gain
    )
    shapes = [(plant.w, plant.loop(draft, sensor, dt)) for plant in plants]
    bandwidth = _largest(shapes, phase_margin, gain_margin)
    loop = scaled(draft, bandwidth).replace(tracking_time=1.0 / bandwidth)
    return LoopTuning(loop, _points(models, loop, (), sensor, dt), phase_margin, gain_margin)


def tune_loops(
    model: BladedModel,
    targets: Sequence[tuple[Actuator, int]],
    *,
    phase_margin: float = PHASE_MARGIN,
    gain_margin: float = GAIN_MARGIN,
    linear: Sequence[LinearModel] | None = None,
    sensor: LoadSensor | None = None,
    sample_time: float | None = None,
) -> tuple[LoopTuning, ...]:
    """Tune several simultaneous loops: each alone, then all gains lowered until all keep the margins (C-38).

    Arguments not listed here are those of :func:`tune_ipc`.

    Args:
      model: of the turbine.
      targets: actuator and harmonic of each loop.

    Raises:
      InputError: as :func:`tune_ipc`, or no common factor keeps the margins.
    """
    models = linear or linear_models(model)
    dt = sample_time or default_step(model)
    tune = partial(
        tune_ipc,
        model,
        phase_margin=phase_margin,
        gain_margin=gain_margin,
        sensor=sensor,
        sample_time=sample_time,
        linear=models,
    )
    alone = [tune(harmonic, actuator) for actuator, harmonic in targets]
    if len(alone) < 2:
        return tuple(alone)
    loops = [tuning.loop for tuning in alone]
    plants = [_Plant(each, loops[0].harmonic, [loop.harmonic for loop in loops[1:]]) for each in models]
    sums = [(plant.w, plant.poles, sum(plant.loop(loop, sensor, dt) for loop in loops)) for plant in plants]
    for factor in FACTORS.tolist():
        if all(keeps(w, factor * L, poles, phase_margin, gain_margin) for w, poles, L in sums):
            break
    else:
        raise InputError(
            "tune_loops: no gains keep these margins with all loops together: reduce the margins or the number of loops"
        )
    lowered = [scaled(loop, factor).replace(tracking_time=loop.tracking_time / factor) for loop in loops]
    found = []
    for tuning, loop in zip(alone, lowered, strict=True):
        points = _points(models, loop, [other for other in lowered if other is not loop], sensor, dt)
        found.append(replace(tuning, loop=loop, points=points, factor=factor))
    return tuple(found)


def margins(
    linear: Sequence[LinearModel],
    loops: Sequence[HarmonicLoop],
    *,
    sample_time: float,
    sensor: LoadSensor | None = None,
    farthest: float = FARTHEST,
    per_side: int = PER_SIDE,
) -> tuple[float, float]:
    """Phase margin [rad] and gain margin of simultaneous loops, smallest over all operating points (C-35, C-38).

    Args:
      linear: from :func:`linear_models`.
      loops: that act at the same time.
      sample_time: [s] of the controller.
      sensor: dynamics between the blade moments and the controller.
      farthest: [rotor speeds] from each harmonic up to which frequencies are searched. A tuning searches 3; a weakly
        damped mode beyond, such as the first edgewise one, needs more.
      per_side: number of frequencies on each side of a harmonic; a narrow resonance needs some hundreds.
    """
    first, *others = loops
    found = []
    for each in linear:
        plant = _Plant(each, first.harmonic, [loop.harmonic for loop in others], farthest, per_side)
        together: Complex = np.sum([plant.loop(loop, sensor, sample_time) for loop in loops], axis=0)
        reserves = (phase_reserve, gain_reserve)
        found.append([reserve(plant.w, together, plant.poles) for reserve in reserves])
    phase, gain = np.min(found, axis=0)
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
    found: list[LinearModel] = []
    for u in speeds:
        found.append(linearise(model, operating_point(model, float(u)), inputs, outputs))
        if progress is not None:
            progress(len(found) / len(speeds))
    return found


def default_speeds(model: BladedModel) -> list[float]:
    """[m/s] of the operating points of a tuning: evenly spaced from 1.1 times rated wind speed to cut-out."""
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
      linear: from :func:`linear_models`; the response is largest near rated wind speed.
    """
    w = np.geomspace(BEYOND * linear.point.rotor_speed, HIGHEST * linear.point.rotor_speed, 200)
    size = np.abs(linear.response(1j * w)[:, linear.outputs.index("generator_speed"), 0])
    return SpeedNotch(frequency=float(w[int(np.argmax(size))]), damping=damping)


def turn(harmonic: int) -> int:
    """Direction of rotation of the nP pattern of three blades: 1 for n = 1, 4, ..., -1 for n = 2, 5, ... (C-33)."""
    return 1 if harmonic % 3 == 1 else -1


class _Plant:
    """Plant of a loop at nP: amplitudes of moments over those of demands, by frequency (C-33).

    Attributes:
      w: (F,) [rad/s] frequencies of the amplitude at nP, dense about zero and about the other loops.
      poles: [rad/s] of the integrators: zero for this loop, and those of the other loops.
    """

    def __init__(
        self,
        linear: LinearModel,
        harmonic: int,
        beside: Sequence[int],
        farthest: float = FARTHEST,
        per_side: int = PER_SIDE,
    ) -> None:
        self.linear, self.harmonic, self.speed = linear, harmonic, linear.point.rotor_speed
        self.poles = tuple({0.0, *((turn(harmonic) * turn(n) * n - harmonic) * self.speed for n in beside)})
        side = np.geomspace(NEAREST, farthest * self.speed, per_side)
        w = np.unique([pole + s * side for pole in self.poles for s in (-1.0, 1.0)])
        near = np.abs(w[:, None] - np.array(self.poles)[None, :]).min(axis=1)
        self.w: Float = w[near > 0.5 * NEAREST]
        rows = [linear.outputs.index(f"root_moment_out_of_plane_{part}") for part in ("cosine", "sine")]
        shift = (harmonic - turn(harmonic)) * self.speed
        self.H = linear.response(1j * (np.append(self.w, 0.0) + shift))[:, rows]

    def of(self, actuator: Actuator, flap: int) -> tuple[Complex, complex, float]:
        """P_n at the frequencies and at zero [N m/rad], and the leak."""
        name = "pitch" if actuator == "pitch" else f"flap_{flap}"
        columns = [self.linear.inputs.index(f"{name}_{part}") for part in ("cosine", "sine")]
        H, d = self.H[:, :, columns], np.array([1.0, 1j * turn(self.harmonic)])
        P, other = 0.5 * H @ d @ d.conj(), 0.5 * H @ d @ d
        return P[:-1], complex(P[-1]), float(abs(other[-1]) / abs(P[-1]))

    def loop(self, loop: HarmonicLoop, sensor: LoadSensor | None, dt: float) -> Complex:
        """(F,) contribution of a loop, at its own or another harmonic, to L (C-34, C-38)."""
        tone = self.w + self.harmonic * self.speed
        same = turn(self.harmonic) * turn(loop.harmonic)
        s = 1j * (tone - same * loop.harmonic * self.speed)
        falls = 1.0
        if loop.gain_halving_pitch is not None:
            falls = 1.0 / (1.0 + self.linear.point.pitch / loop.gain_halving_pitch)
        law = falls * (loop.integral_gain / s + loop.proportional_gain)
        P = self.of(loop.actuator, loop.flap)[0]
        return -law * np.exp(1j * same * loop.offset) * _filter(loop, tone, self.speed, sensor, dt) * P


def _points(
    models: Sequence[LinearModel],
    loop: HarmonicLoop,
    others: Sequence[HarmonicLoop],
    sensor: LoadSensor | None,
    dt: float,
) -> tuple[TunedPoint, ...]:
    found = []
    for each in models:
        plant = _Plant(each, loop.harmonic, [other.harmonic for other in others])
        P, at_zero, leak = plant.of(loop.actuator, loop.flap)
        own = plant.loop(loop, sensor, dt)
        together: Complex = own + sum((plant.loop(other, sensor, dt) for other in others), np.zeros_like(own))
        found.append(
            TunedPoint(
                wind_speed=each.point.wind.speed,
                rotor_speed=each.point.rotor_speed,
                pitch=each.point.pitch,
                plant=at_zero,
                leak=leak,
                frequency=plant.w,
                plant_response=P,
                loop=own,
                together=together,
                bandwidth=_crossover(plant.w, own),
                phase_margin=phase_reserve(plant.w, together, plant.poles),
                gain_margin=gain_reserve(plant.w, together, plant.poles),
                sensitivity=float((1.0 / np.abs(1.0 + together)).max()),
            )
        )
    return tuple(found)


def _filter(loop: HarmonicLoop, tone: Float, speed: float, sensor: LoadSensor | None, dt: float) -> Complex:
    """Response of band-pass, sensor and delay at frequencies of the blades [rad/s] (C-34)."""
    low_pass, samples = (sensor.low_pass, sensor.delay) if sensor else (0.0, 0)
    found: Complex = np.exp(-1j * tone * dt * (HALF_DELAY + samples))
    centre, zeta = loop.harmonic * speed, loop.filter_damping
    if zeta > 0.0:
        found = found * np.array([response("band_pass", float(each), centre, zeta, dt) for each in tone])
    if low_pass > 0.0:
        found = found * np.array([response("low_pass", float(each), low_pass, 0.0, dt) for each in tone])
    return found


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


def keeps(w: Float, L: Complex, poles: Sequence[float], phase: float, gain: float) -> bool:
    """Whether both margins are kept (C-35)."""
    return phase_reserve(w, L, poles) >= phase and gain_reserve(w, L, poles) >= gain


def _largest(loops: Sequence[tuple[Float, Complex]], phase: float, gain: float) -> float:
    """[rad/s] largest bandwidth up to which all smaller ones keep the margins at all points (C-35)."""
    best = 0.0
    # margins do not tell a loop that drives slow changes up, as one would whose plant has another sign at some points
    right_way = all((L * 1j * w)[np.argmin(np.abs(w))].real > 0.0 for w, L in loops)
    for bandwidth in np.geomspace(FEWEST_SEARCHED, MOST_SEARCHED, SEARCHED):
        if not (right_way and all(keeps(w, bandwidth * L, (0.0,), phase, gain) for w, L in loops)):
            break
        best = float(bandwidth)
    if best == 0.0:
        raise InputError(
            "tune_ipc: no gain keeps these margins at all operating points: reduce the margins, or check the plants' "
            "phases"
        )
    return best


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
    found = w[at] + (w[at + 1] - w[at]) * size[at] / (size[at] - size[at + 1])
    return float(np.min(np.abs(found), initial=math.inf))
