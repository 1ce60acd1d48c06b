"""Load control: collective law, azimuth-dependent feed-forward, feedback of blade moments at multiples of 1P.

    pitch of blade i = collective (1 + g (K_i - 1)) + the demands of the pitch loops
    flap of blade i  = the demands of its loops

Every part is optional and has a separate module; here they are combined. Without parts the controller is exactly the
collective law. The demand of each blade is limited like its actuator, in angle and in rate, and the integrals have
anti-windup by the limited demands. The time of demands at their limits is counted, which reveals gains that are too
high.

Reference: docs/theory/control.md (C-27 to C-31, C-39, C-40); He et al. (2018); Bossanyi (2003).
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy import float64
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.compiler import (
    MAX_BLADES,
    MAX_FLAPS,
    Entries,
    Numbers,
    Table,
    blades,
    crossed,
    kernel,
    number,
    part,
    parts,
    whole,
)
from meltemi.control.baseline import BaselineState, motion_pitch, start_state
from meltemi.control.baseline import law as collective_step
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.feedforward import FeedforwardWeights, weight, weight_settings
from meltemi.control_laws.filters import LowPass, SecondOrder, check_harmonic, low_pass, notch
from meltemi.control_laws.harmonic import HarmonicState, add_demands, back_calculate_loop, harmonic_loop
from meltemi.control_laws.integrator import integrator_settings
from meltemi.control_laws.preview import PreviewState, preview_change, preview_settings
from meltemi.control_laws.sensors import Delay, Noise, delay, delay_start, noise, noise_start
from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic

FEATURE = "load control"

Float = NDArray[float64]


class FeedForward(Record):
    """Azimuth-dependent feed-forward of the collective pitch (C-22, C-23)."""

    gain: float = Field(default=1.0, ge=0.0, le=2.0)
    """Weight of the feed-forward; 1: pitch in proportion to the weights, 0: none."""
    shear_exponent: float = Field(default=0.2, ge=0.0, lt=1.0)
    """Shear exponent of the wind that the weights assume."""
    radius: float | None = Field(default=None, gt=0.0)
    """[m] radius for the wind of a blade; two thirds of the rotor radius by default."""
    tower_shadow: bool = False
    """The weights have a dip where a blade passes the tower."""
    exponent: float = Field(default=2.0, ge=0.0, le=4.0)
    """Exponent of the wind speed in the weights."""


class HarmonicLoop(Record):
    """Feedback of the blades' out-of-plane root moments at a multiple of the rotor speed, to pitch or to a flap."""

    harmonic: int = Field(ge=1, le=20)
    """Multiple n of the rotor speed."""
    integral_gain: float
    """[rad/(N m s)] gain of the integral; positive for pitch, negative for flaps."""
    proportional_gain: float = 0.0
    """[rad/(N m)] proportional gain, with the sign of the integral gain."""
    derivative_gain: float = 0.0
    """[rad s/(N m)] gain of the derivative."""
    derivative_frequency: float = Field(default=0.0, ge=0.0)
    """[rad/s] corner of the derivative's low-pass."""
    actuator: Literal["pitch", "flap"] = "pitch"
    """Actuator of the loop."""
    flap: int = Field(default=1, ge=1, le=MAX_FLAPS)
    """Number of the flap, in the order of the turbine."""
    filter_damping: float = Field(default=0.25, ge=0.0, le=5.0)
    """Damping ratio of the band-pass about nP; 0: no band-pass."""
    offset: float = Field(default=0.0, ge=-math.pi, le=math.pi)
    """[rad] phase lead of the demand at the harmonic."""
    gain_halving_pitch: float | None = Field(default=None, gt=0.0)
    """[rad] collective pitch at which the gains are halved; constant gains by default."""
    authority: float | None = Field(default=None, gt=0.0)
    """[rad] limit of the tilt and of the yaw demand; by default the limit of the actuator."""
    tracking_time: float = Field(default=1.0, gt=0.0)
    """[s] time constant with which the integrals follow the limits of the actuators."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.proportional_gain * self.integral_gain < 0.0:
            raise ValueError("proportional_gain and integral_gain must have the same sign")
        if self.derivative_gain != 0.0 and self.derivative_frequency == 0.0:
            raise ValueError("a derivative_gain needs a derivative_frequency [rad/s]")
        return self


class LoadSensor(Record):
    """Sensor of the blade root moments; ideal by default."""

    low_pass: float = Field(default=0.0, ge=0.0)
    """[rad/s] bandwidth of the sensor; 0: not limited."""
    noise: float = Field(default=0.0, ge=0.0)
    """[N m] standard deviation of white noise."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Seed of the noise."""
    delay: int = Field(default=0, ge=0, le=10000)
    """Sample times of transport delay."""


class SpeedNotch(Record):
    """Notch filter of the generator speed of the collective law."""

    frequency: float = Field(gt=0.0)
    """[rad/s] centre frequency."""
    damping: float = Field(default=0.2, gt=0.0, le=5.0)
    """Damping ratio: half its relative width."""


class Preview(Record):
    """Preview of the rotor-averaged wind, with the pitch of steady operation."""

    wind: Vector
    """(T,) [m/s] rotor-averaged wind speed, from time zero on."""
    time_step: float = Field(gt=0.0)
    """[s] time between its values."""
    lead: float = Field(default=0.0, ge=0.0)
    """[s] lead time."""
    frequency: float = Field(gt=0.0)
    """[rad/s] corner frequency of its low-pass filter."""
    first_speed: float = Field(gt=0.0)
    """[m/s] first wind speed of the table of pitch."""
    spacing: float = Field(gt=0.0)
    """[m/s] spacing of wind speeds of the table of pitch."""
    pitch: Vector
    """(n,) [rad] pitch of steady operation."""


class LoadControl(Record):
    """Settings of a load controller: its parts in addition to the collective law."""

    feedforward: FeedForward | None = None
    """Feed-forward of the pitch by azimuth; none by default."""
    loops: tuple[HarmonicLoop, ...] = ()
    """Feedback loops, which are added where they share an actuator."""
    sensor: LoadSensor = LoadSensor()
    """Sensor of the moments."""
    notch: SpeedNotch | None = None
    """Notch filter of the generator speed; none by default."""
    preview: Preview | None = None
    """Preview of the wind, for the collective pitch."""


PITCH, *FLAPS = range(1 + MAX_FLAPS)
"""Groups of actuators."""


class ActuatorLimits(Table):
    """Limits and demands of a group of actuators."""

    minimum: float = number("rad", "lower limit of a demand")
    maximum: float = number("rad", "upper limit of a demand")
    rate: float = number("rad/s", "rate limit of a demand")
    held: float = number("s", "time with a demand at a limit, mean of the blades, lowest pitch excluded")
    last: Numbers = blades("rad", "demands of the last call")
    wanted: Numbers = blades("rad", "demands before the limits")


class LoadControlState(Table, title="load control"):
    """Settings and state. The count of switches is that of the collective law, for all parts together."""

    collective: BaselineState = part(BaselineState, "law of torque and collective pitch", prefix="")
    loop_count: float = number("-", "number of feedback loops")
    groups: float = number("-", "number of groups of actuators: pitch, and each flap")
    feedforward: float = number("-", "gain of the feed-forward weights; 0: none")
    notch_frequency: float = number("rad/s", "centre frequency of the notch filter of the generator speed; 0: none")
    notch_damping: float = number("-", "damping ratio of the notch filter")
    previews: float = number("-", "1: with a preview of the wind")
    time: float = number("s", "time over which demands have been limited")
    notch: SecondOrder = part(SecondOrder, "state of the notch")
    sensor_frequency: float = number("rad/s", "corner frequency of the low-pass filter of the sensors; 0: none")
    sensor_noise: float = number("N m", "standard deviation of the sensor noise; 0: none")
    low_pass: Entries[LowPass] = parts(LowPass, MAX_BLADES, "states of the sensors")
    moment: Numbers = blades("N m", "measured root bending moment of each blade")
    missing: Numbers = blades("rad", "demand beyond the limits of a group")
    weights: FeedforwardWeights = part(FeedforwardWeights, "of the feed-forward")
    noise: Entries[Noise] = parts(Noise, MAX_BLADES, "of the sensors")
    group: Entries[ActuatorLimits] = parts(ActuatorLimits, ("blade_pitch", *(f"flap_{flap}" for flap in FLAPS)))
    loop: Entries[HarmonicState] = parts(HarmonicState, "loop_count", "feedback loops")
    delay: Entries[Delay] = parts(Delay, MAX_BLADES, "of the sensors")
    preview: Entries[PreviewState] = parts(PreviewState, "previews", "of the wind")


MOST_HELD = 0.35
"""Share of the time at limits beyond which a run has a warning; sound loops reach a third in extreme turbulence."""


@kernel
def sense(x: LoadControlState, moment: float, blade: int, dt: float) -> float:
    """Measured moment [N m] of a blade."""
    if x.sensor_frequency > 0.0:
        moment = low_pass(x.low_pass[blade], moment, x.sensor_frequency, dt)
    if x.sensor_noise > 0.0:
        moment = moment + noise(x.noise[blade], x.sensor_noise)
    return delay(x.delay[blade], moment)


@kernel
def limited(x: LoadControlState, group: ActuatorLimits, blade: int, dt: float) -> float:
    """Demand of a blade within the limits of its actuator (C-30)."""
    wanted, last, step = group.wanted[blade], group.last[blade], group.rate * dt
    x.collective.switches += crossed(wanted - group.minimum) + crossed(wanted - group.maximum)
    demand = min(max(wanted, group.minimum), group.maximum)
    x.collective.switches += crossed(abs(demand - last) - step)
    return min(max(demand, last - step), last + step)


@kernel
def load_step(x: LoadControlState, measured: Measurements, demands: Demands, dt: float) -> None:
    """One call of the law (C-27 to C-31)."""
    law = x.collective
    if x.previews > 0.0:
        change = preview_change(x.preview[0], measured.time, dt)
        law.integral += change * (1.0 + 2.0 * law.pitch / law.gain_halving_pitch) / law.integral_gain  # C-40
    speed = measured.generator_speed
    if x.notch_frequency > 0.0:
        speed = notch(x.notch, speed, x.notch_frequency, x.notch_damping, dt)
    collective_step(law, speed, measured, demands, dt)
    individual(x, measured, demands, dt)


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    load_step(LoadControlState(state), Measurements(measurements), Demands(demands), dt)


@kernel
def individual(x: LoadControlState, measured: Measurements, demands: Demands, dt: float) -> None:
    """Individual pitch, added to the collective pitch, and flap demands (C-28 to C-31)."""
    blades, loops = whole(measured.n_blades), whole(x.loop_count)
    azimuth, collective = measured.azimuth, x.collective.pitch + motion_pitch(x.collective)
    if loops == 0 and x.feedforward <= 0.0:
        return
    for b in range(blades):
        x.group[PITCH].wanted[b] = collective
        if x.feedforward > 0.0:
            share = weight(x.weights, b, blades, azimuth)
            x.group[PITCH].wanted[b] = collective * (1.0 + x.feedforward * (share - 1.0))
        for g in range(1, whole(x.groups)):
            x.group[g].wanted[b] = 0.0
        if loops > 0:
            x.moment[b] = sense(x, measured.out_of_plane_moment[b], b, dt)
    for k in range(loops):
        loop = x.loop[k]
        harmonic_loop(loop, x.moment, blades, azimuth, measured.rotor_speed, collective, dt)
        x.collective.switches += loop.tilt_axis.switches
        x.collective.switches += loop.yaw_axis.switches
        loop.tilt_axis.switches = 0.0
        loop.yaw_axis.switches = 0.0
        add_demands(loop, x.group[whole(loop.group)].wanted, blades, azimuth)
    x.time += dt
    for g in range(whole(x.groups)):
        group = x.group[g]
        for b in range(blades):
            demand = limited(x, group, b, dt)
            x.missing[b] = demand - group.wanted[b]
            group.last[b] = demand
            # below rated wind speed the pitch is always at its minimum
            if x.missing[b] != 0.0 and (g > PITCH or demand > group.minimum):
                group.held += dt / blades
            if g == PITCH:
                demands.pitch[b] = demand
            else:
                demands.flap[g - 1, b] = demand
        for k in range(loops):
            if whole(x.loop[k].group) == g:
                back_calculate_loop(x.loop[k], x.missing, blades, azimuth, dt)


def LoadController(
    turbine: AnyTurbine,
    settings: LoadControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "load control",
) -> Controller:
    """Load controller of a turbine.

    Args:
      turbine: turbine with the collective law, the limits of its actuators, and the geometry for the weights.
      settings: parts of the controller; by default the collective law only.
      sample_time: [s] time between calls; by default every time step.
      name: name for messages.

    Raises:
      InputError: the turbine does not have a flap, a harmonic is impossible with its blades or the sample time, or
        numbers are inconsistent.
    """
    settings = settings or LoadControl()
    flaps = turbine.flaps
    if settings.loops:
        aeroelastic(turbine, "LoadController: loops, which need loads of the blades")
    for i, loop in enumerate(settings.loops):
        where = f"LoadController: loops[{i}]"
        if loop.actuator == "flap" and loop.flap > len(flaps):
            raise InputError(
                f"{where}: flap {loop.flap} is required, the blades of {turbine.name!r} have {len(flaps) or 'none'}: "
                "add flaps to the blade, such as meltemi.turbine.with_flaps(turbine)"
            )
        try:
            check_harmonic(loop.harmonic, turbine.rated_rotor_speed, sample_time or 1e-3, turbine.n_blades)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    if settings.notch is not None and settings.notch.frequency * (sample_time or 0.0) >= math.pi:
        raise InputError(
            f"LoadController: notch.frequency {settings.notch.frequency:g} rad/s is not below half the sampling rate, "
            f"{math.pi / (sample_time or 1.0):g} rad/s"
        )
    template = load_settings(turbine, settings)

    def init(start: StartPoint) -> LoadControlState:
        return load_start(template, start_state(turbine.control, start), start)

    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        uses_loads=bool(settings.loops) or turbine.control.pitch.motion_gain != 0.0,
        state_names=LoadControlState.names_of(template.array) if settings.preview is None else (),
        warnings=lambda x: limit_warnings(LoadControlState(x)),
    )


def limit_warnings(x: LoadControlState) -> list[str]:
    """Warnings about demands at their limits for much of a run."""
    sentences = []
    for g in range(1 + MAX_FLAPS):
        share = x.group[g].held / max(x.time, 1e-9)
        if share > MOST_HELD:
            sentences.append(
                f"{f'flap {g}' if g else 'pitch'}: demands at their limits {100.0 * share:.0f} % of the time: "
                "gains too high or of the wrong sign?"
            )
    return sentences


def load_settings(turbine: AnyTurbine, settings: LoadControl) -> LoadControlState:
    """Initial state without that of the collective law."""
    flaps, pitch, sensor = turbine.flaps, turbine.control.pitch, settings.sensor
    limits = [(pitch.minimum, pitch.maximum, pitch.rate_limit), *((f.minimum, f.maximum, f.rate) for f in flaps)]
    preview, notch = settings.preview, settings.notch
    known = {} if preview is None else {name: getattr(preview, name) for name in Preview.model_fields}
    x = LoadControlState.of(
        groups=1 + len(flaps),
        sensor_frequency=sensor.low_pass,
        sensor_noise=sensor.noise,
        noise=[noise_start(sensor.seed, b) for b in range(MAX_BLADES)],
        loop=[_loop(loop, limits[loop.flap if loop.actuator == "flap" else PITCH]) for loop in settings.loops],
        delay=[delay_start(sensor.delay) for _ in range(MAX_BLADES)],
        preview=[] if preview is None else [preview_settings(**known)],
    )
    for g, (low, high, rate) in enumerate(limits):
        group = x.group[g]
        group.minimum, group.maximum, group.rate = low, high, rate
    if settings.feedforward is not None:
        x.feedforward, x.weights = settings.feedforward.gain, _weights(turbine, settings.feedforward)
    if notch is not None:
        x.notch_frequency, x.notch_damping = notch.frequency, notch.damping
    return x


def load_start(template: LoadControlState, law: BaselineState, start: StartPoint) -> LoadControlState:
    """Initial state at an operating point."""
    x = template.copy()
    x.collective = law
    for b in range(MAX_BLADES):
        x.group[PITCH].last[b] = start.pitch
    if x.notch_frequency > 0.0:
        x.notch.second = start.generator_speed
    return x


def _loop(loop: HarmonicLoop, limits: tuple[float, float, float]) -> HarmonicState:
    axis = integrator_settings(
        proportional_gain=loop.proportional_gain,
        integral_gain=loop.integral_gain,
        derivative_gain=loop.derivative_gain,
        derivative_frequency=loop.derivative_frequency,
        tracking_time=loop.tracking_time,
    )
    return HarmonicState.of(
        harmonic=loop.harmonic,
        damping=loop.filter_damping,
        offset=loop.offset,
        halving_pitch=loop.gain_halving_pitch or 0.0,
        authority=loop.authority or max(abs(limits[0]), abs(limits[1])),
        group=loop.flap if loop.actuator == "flap" else PITCH,
        tilt_axis=axis,
        yaw_axis=axis,
    )


def _weights(turbine: AnyTurbine, f: FeedForward) -> FeedforwardWeights:
    radius = f.radius if f.radius is not None else 2.0 / 3.0 * turbine.rotor_radius
    tower_radius = clearance = 0.0
    if f.tower_shadow:
        turbine = aeroelastic(turbine, "LoadController: feedforward.tower_shadow")
        tower = turbine.tower
        above_base = turbine.hub_height - radius - tower.base_height
        tower_radius = 0.5 * float(np.interp(above_base, tower.position, tower.diameter))
        tilt, cone = turbine.nacelle.tilt, turbine.hub.precone
        clearance = turbine.nacelle.overhang * math.cos(tilt) + radius * math.sin(tilt + cone)
    return weight_settings(
        radius=radius,
        hub_height=turbine.hub_height,
        shear=f.shear_exponent,
        tower_radius=tower_radius,
        clearance=clearance,
        exponent=f.exponent,
    )
