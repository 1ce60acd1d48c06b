"""Load control: the collective law, with feed-forward by azimuth and feedback of blade moments at multiples of 1P.

    pitch of blade i = collective (1 + g (K_i - 1)) + the demands of the pitch loops
    flap of blade i  = the demands of its loops

Every part is optional and stands alone in a module of its own; here they are put together. With none the controller is
the collective law to the bit. Each blade's demand is limited as its actuator is, in angle and in rate, and what the
limits took away is taken back from the integrals, so nothing winds up. The time that demands spend at their limits is
counted: gains that are too high show there.

Reference: docs/theory/control.md (C-27 to C-31, C-39, C-40); He et al. (2018); Bossanyi (2003).
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy import float64
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.control import signals as s
from meltemi.control.baseline import HALVING, INTEGRAL, KI, SWITCHES, BaselineState, law, start_state
from meltemi.control.baseline import PITCH as COLLECTIVE
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.feedforward import FeedforwardWeights, weight, weight_settings
from meltemi.control.filters import LOW_PASS_STATES, check_harmonic, low_pass, notch
from meltemi.control.harmonic import GROUP as LOOP_GROUP
from meltemi.control.harmonic import (
    LOOP_NAMES,
    LOOP_STATES,
    TILT_AXIS,
    YAW_AXIS,
    HarmonicState,
    add_demands,
    harmonic_loop,
    take_back,
)
from meltemi.control.integrator import SWITCHES as AXIS_SWITCHES
from meltemi.control.integrator import integrator_settings
from meltemi.control.preview import preview_change, preview_settings
from meltemi.control.sensors import NOISE_STATES, delay, delay_states, noise, noise_start
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.record import Record, Vector
from meltemi.maths.generic import crossed, whole
from meltemi.maths.tables import MAX_BLADES, MAX_FLAPS, Numbers, Table, View, blades, number
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic

FEATURE = "load control"

Float = NDArray[float64]


class FeedForward(Record):
    """Each blade's share of the collective pitch by its azimuth (C-22, C-23)."""

    gain: float = Field(default=1.0, ge=0.0, le=2.0)
    """Share of the weights that is used; 1: pitch in proportion to the weights, 0: none."""
    shear_exponent: float = Field(default=0.2, ge=0.0, lt=1.0)
    """Of the wind that the weights assume."""
    radius: float | None = Field(default=None, gt=0.0)
    """[m] at which a blade's wind is taken; two thirds of the rotor radius by default."""
    tower_shadow: bool = False
    """The weights have a dip where a blade passes the tower."""
    exponent: float = Field(default=2.0, ge=0.0, le=4.0)
    """Of the wind in the weights."""


class HarmonicLoop(Record):
    """Feedback of the blades' out-of-plane root moments at a multiple of the rotor speed, to pitch or to a flap."""

    harmonic: int = Field(ge=1, le=20)
    """Multiple n of the rotor speed."""
    integral_gain: float
    """[rad/(N m s)]; positive for pitch, negative for flaps."""
    proportional_gain: float = 0.0
    """[rad/(N m)], of the sign of the integral gain."""
    derivative_gain: float = 0.0
    """[rad s/(N m)]."""
    derivative_frequency: float = Field(default=0.0, ge=0.0)
    """[rad/s] corner of the derivative's low-pass."""
    actuator: Literal["pitch", "flap"] = "pitch"
    """What the loop moves."""
    flap: int = Field(default=1, ge=1, le=MAX_FLAPS)
    """Which of a blade's flaps, counted as the turbine lists them."""
    filter_damping: float = Field(default=0.25, ge=0.0, le=5.0)
    """Damping ratio of the band-pass about nP; 0: no band-pass."""
    offset: float = Field(default=0.0, ge=-math.pi, le=math.pi)
    """[rad] of the harmonic's phase, by which the demand leads."""
    gain_halving_pitch: float | None = Field(default=None, gt=0.0)
    """[rad] collective pitch at which the gains are halved; without it they are the same everywhere."""
    authority: float | None = Field(default=None, gt=0.0)
    """[rad] limit of the tilt and of the yaw demand; by default what the actuator can do."""
    tracking_time: float = Field(default=1.0, gt=0.0)
    """[s] in which the integrals follow what the actuators can do."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.proportional_gain * self.integral_gain < 0.0:
            raise ValueError("proportional_gain and integral_gain must have the same sign")
        if self.derivative_gain != 0.0 and self.derivative_frequency == 0.0:
            raise ValueError("a derivative_gain needs a derivative_frequency [rad/s]")
        return self


class LoadSensor(Record):
    """How the blades' root moments reach the controller; by default as they are."""

    low_pass: float = Field(default=0.0, ge=0.0)
    """[rad/s] bandwidth of the sensor; 0: not limited."""
    noise: float = Field(default=0.0, ge=0.0)
    """[N m] standard deviation of white noise."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Of the noise."""
    delay: int = Field(default=0, ge=0, le=10000)
    """Sample times of transport delay."""


class SpeedNotch(Record):
    """A notch in the generator speed that the collective law sees."""

    frequency: float = Field(gt=0.0)
    """[rad/s] that is taken out."""
    damping: float = Field(default=0.2, gt=0.0, le=5.0)
    """Damping ratio: half its relative width."""


class Preview(Record):
    """Rotor-averaged wind that is known beforehand, and the pitch that steady operation has in it."""

    wind: Vector
    """(T,) [m/s] averaged over the rotor, from time zero on."""
    time_step: float = Field(gt=0.0)
    """[s] between its values."""
    lead: float = Field(default=0.0, ge=0.0)
    """[s] by which it is read ahead."""
    frequency: float = Field(gt=0.0)
    """[rad/s] corner of its low-pass."""
    first_speed: float = Field(gt=0.0)
    """[m/s] of the table of pitch."""
    spacing: float = Field(gt=0.0)
    """[m/s] of the table of pitch."""
    pitch: Vector
    """(n,) [rad] of steady operation."""


class LoadControl(Record):
    """Settings of a load controller: which parts it has beside the collective law, and their numbers."""

    feedforward: FeedForward | None = None
    """Of the pitch by azimuth; none by default."""
    loops: tuple[HarmonicLoop, ...] = ()
    """Of feedback, which add up where they share an actuator."""
    sensor: LoadSensor = LoadSensor()
    """Of the moments that the loops get."""
    notch: SpeedNotch | None = None
    """In the generator speed; none by default."""
    preview: Preview | None = None
    """Of the wind to come, for the collective pitch."""


class LoadControlState(Table, title="load control"):
    """Settings and state. The count of switches is that of the collective law, for all parts together."""

    loops: float = number("-", "how many")
    groups: float = number("-", "of actuators: pitch, and each flap")
    feedforward: float = number("-", "gain of the weights; 0: none")
    notch_frequency: float = number("rad/s", "of the generator speed's notch; 0: none")
    notch_damping: float = number("-", "its damping ratio")
    preview: float = number("-", "place of the preview in this vector; 0: none")
    time: float = number("s", "for which demands have been limited")
    notch_first: float = number("rad/s", "state of the notch")
    notch_second: float = number("rad/s", "state of the notch")
    sensor_frequency: float = number("rad/s", "corner of the sensors' low-pass; 0: none")
    sensor_noise: float = number("N m", "standard deviation; 0: none")
    sensor_delay: float = number("-", "sample times")
    low_pass: Numbers = blades("N m", "states of the sensors")
    moment: Numbers = blades("N m", "what the sensors give")
    missing: Numbers = blades("rad", "of the demands, within the limits of a group")


LOOPS, GROUPS, FEEDFORWARD, NOTCH_FREQUENCY, NOTCH_DAMPING, PREVIEW_PLACE, LIMITED_TIME, NOTCH = (
    len(BaselineState) + i
    for i in LoadControlState.slots("loops groups feedforward notch_frequency notch_damping preview time notch_first")
)
SENSOR_FREQUENCY, SENSOR_NOISE, SENSOR_DELAY, SENSOR, MOMENT, MISSING = (
    len(BaselineState) + i
    for i in LoadControlState.slots("sensor_frequency sensor_noise sensor_delay low_pass moment missing")
)


class ActuatorLimits(Table):
    """Limits of one group of actuators, and its demands."""

    minimum: float = number("rad", "of a demand")
    maximum: float = number("rad", "of a demand")
    rate: float = number("rad/s", "of a demand")
    held: float = number("s", "with a demand at a limit, mean of the blades; not the lowest pitch")
    last: Numbers = blades("rad", "demands of the last call")
    wanted: Numbers = blades("rad", "demands before the limits")


PER_GROUP = len(ActuatorLimits)

MINIMUM, MAXIMUM, RATE, HELD, LAST, WANTED = ActuatorLimits.slots("minimum maximum rate held last wanted")

MOST_HELD = 0.35
"""Share of the time at limits beyond which a run has a warning; sound loops reach a third in extreme turbulence."""

SHARES = len(BaselineState) + len(LoadControlState)
NOISES = SHARES + len(FeedforwardWeights)
LIMITED = NOISES + NOISE_STATES * MAX_BLADES
FIRST_LOOP = LIMITED + PER_GROUP * (1 + MAX_FLAPS)
"""Where weights, noise, limits and loops stand in the state vector; the delays' memory follows the loops."""


@kernel
def sense(x: Float, moment: float, blade: int, dt: float) -> float:
    """What the sensor of a blade gives for its moment [N m]."""
    if x[SENSOR_FREQUENCY] > 0.0:
        moment = low_pass(x, SENSOR + LOW_PASS_STATES * blade, moment, x[SENSOR_FREQUENCY], dt)
    if x[SENSOR_NOISE] > 0.0:
        moment = moment + noise(x, NOISES + NOISE_STATES * blade, x[SENSOR_NOISE])
    samples = whole(x[SENSOR_DELAY])
    if samples > 0:
        memory = FIRST_LOOP + LOOP_STATES * whole(x[LOOPS]) + (1 + samples) * blade
        moment = delay(x, memory, moment, samples)
    return moment


@kernel
def limited(x: Float, at: int, blade: int, dt: float) -> float:
    """Demand of a blade within its actuator's limits (C-30); ``at`` is where the group's limits stand."""
    wanted, last, step = x[at + WANTED + blade], x[at + LAST + blade], x[at + RATE] * dt
    x[SWITCHES] += crossed(wanted - x[at + MINIMUM]) + crossed(wanted - x[at + MAXIMUM])
    demand = min(max(wanted, x[at + MINIMUM]), x[at + MAXIMUM])
    x[SWITCHES] += crossed(abs(demand - last) - step)
    return min(max(demand, last - step), last + step)


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the controller (C-27 to C-31)."""
    if x[PREVIEW_PLACE] > 0.0:
        change = preview_change(x, whole(x[PREVIEW_PLACE]), measured[s.TIME], dt)
        x[INTEGRAL] += change * (1.0 + 2.0 * x[COLLECTIVE] / x[HALVING]) / x[KI]  # C-40
    speed = measured[s.GENERATOR_SPEED]
    if x[NOTCH_FREQUENCY] > 0.0:
        speed = notch(x, NOTCH, speed, x[NOTCH_FREQUENCY], x[NOTCH_DAMPING], dt)
    law(x, speed, measured, demands, dt)
    individual(x, measured, demands, dt)


@kernel
def individual(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """What is added to the collective pitch ``x[COLLECTIVE]`` of each blade, and the flaps (C-28 to C-31)."""
    blades, loops = whole(measured[s.N_BLADES]), whole(x[LOOPS])
    azimuth, collective = measured[s.AZIMUTH], x[COLLECTIVE]
    if loops == 0 and x[FEEDFORWARD] <= 0.0:
        return
    for i in range(blades):
        x[LIMITED + WANTED + i] = collective
        if x[FEEDFORWARD] > 0.0:
            share = weight(x, SHARES, i, blades, azimuth)
            x[LIMITED + WANTED + i] = collective * (1.0 + x[FEEDFORWARD] * (share - 1.0))
        for g in range(1, whole(x[GROUPS])):
            x[LIMITED + PER_GROUP * g + WANTED + i] = 0.0 * collective
        if loops > 0:
            x[MOMENT + i] = sense(x, measured[s.OUT_OF_PLANE_MOMENT + i], i, dt)
    for k in range(loops):
        at = FIRST_LOOP + LOOP_STATES * k
        harmonic_loop(x, at, MOMENT, blades, azimuth, measured[s.ROTOR_SPEED], collective, dt)
        for axis in (at + TILT_AXIS, at + YAW_AXIS):
            x[SWITCHES] += x[axis + AXIS_SWITCHES]
            x[axis + AXIS_SWITCHES] = 0.0
        add_demands(x, at, LIMITED + PER_GROUP * whole(x[at + LOOP_GROUP]) + WANTED, blades, azimuth)
    x[LIMITED_TIME] += dt
    for g in range(whole(x[GROUPS])):
        group = LIMITED + PER_GROUP * g
        for i in range(blades):
            demand = limited(x, group, i, dt)
            x[MISSING + i] = demand - x[group + WANTED + i]
            x[group + LAST + i] = demand
            if x[MISSING + i] != 0.0 and (g > 0 or demand > x[group + MINIMUM]):  # there it rests below rated
                x[group + HELD] += dt / blades
            demands[(s.PITCH_DEMAND if g == 0 else s.FLAP_DEMAND + MAX_BLADES * (g - 1)) + i] = demand
        for k in range(loops):
            at = FIRST_LOOP + LOOP_STATES * k
            if whole(x[at + LOOP_GROUP]) == g:
                take_back(x, at, MISSING, blades, azimuth, dt)


def load_control(
    turbine: AnyTurbine,
    settings: LoadControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "load control",
) -> Controller:
    """A load controller for a turbine.

    Args:
      turbine: gives the collective law, the limits of its actuators, and the places of the weights.
      settings: which parts it has; none by default, which leaves the collective law.
      sample_time: [s] between calls; by default every time step.
      name: for messages.

    Raises:
      InputError: a flap that the turbine does not have, a harmonic that its blades or the sample time cannot do, or
        numbers that contradict each other.
    """
    settings = settings or LoadControl()
    flaps = turbine.flaps
    if settings.loops:
        aeroelastic(turbine, "load_control: loops, which need loads of the blades")
    for i, loop in enumerate(settings.loops):
        where = f"load_control: loops[{i}]"
        if loop.actuator == "flap" and loop.flap > len(flaps):
            raise InputError(
                f"{where}: flap {loop.flap} is asked for, the blades of {turbine.name!r} have {len(flaps) or 'none'}: "
                "add flaps to the blade, such as meltemi.turbine.with_flaps(turbine)"
            )
        try:
            check_harmonic(loop.harmonic, _top_speed(turbine), sample_time or 1e-3, turbine.n_blades)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    if settings.notch is not None and settings.notch.frequency * (sample_time or 0.0) >= math.pi:
        raise InputError(
            f"load_control: notch.frequency {settings.notch.frequency:g} rad/s is not below half the sampling rate, "
            f"{math.pi / (sample_time or 1.0):g} rad/s"
        )
    template = _parameters(turbine, settings)
    delays = np.zeros(MAX_BLADES * delay_states(settings.sensor.delay) if settings.sensor.delay else 0)
    preview = np.zeros(0)
    if settings.preview is not None:
        preview = preview_settings(**{name: getattr(settings.preview, name) for name in Preview.model_fields})

    def init(start: StartPoint) -> Float:
        x = np.concatenate([start_state(turbine.control, start), template, delays, preview])
        x[PREVIEW_PLACE] = len(x) - len(preview) if len(preview) else 0.0
        x[LIMITED + LAST : LIMITED + LAST + MAX_BLADES] = start.pitch
        if settings.notch is not None:
            x[NOTCH + 1] = start.generator_speed
        return x

    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        uses_loads=bool(settings.loops),
        state_names=_names(settings) if settings.preview is None else (),
        warnings=limit_warnings,
    )


def limit_warnings(x: Float) -> list[str]:
    """What is to be said about demands that were at their limits for much of a run."""
    found = []
    for g in range(1 + MAX_FLAPS):
        share = x[LIMITED + PER_GROUP * g + HELD] / max(x[LIMITED_TIME], 1e-9)
        if share > MOST_HELD:
            found.append(
                f"{f'flap {g}' if g else 'pitch'}: demands at their limits {100.0 * share:.0f} % of the time: "
                "gains too high or of the wrong sign?"
            )
    return found


def _top_speed(turbine: AnyTurbine) -> float:
    """[rad/s] of the rotor that the collective law holds."""
    return turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio


def _names(settings: LoadControl) -> tuple[str, ...]:
    """Of the entries of the state vector, in the order of ``_parameters``."""
    blades = range(1, MAX_BLADES + 1)
    names = [*BaselineState.names, *LoadControlState.names, *(f"weights_{name}" for name in FeedforwardWeights.names)]
    names += [f"noise_{blade}_{name}" for blade in blades for name in ("seed", "stream", "count")]
    for group in ("blade_pitch", *(f"flap_{flap + 1}" for flap in range(MAX_FLAPS))):
        names += [f"{group}_{name}" for name in ActuatorLimits.names]
    for loop in range(len(settings.loops)):
        names += [f"loop_{loop + 1}_{name}" for name in LOOP_NAMES]
    if settings.sensor.delay:
        names += [f"delay_{blade}_{k}" for blade in blades for k in ("oldest", *range(1, settings.sensor.delay + 1))]
    return tuple(names)


def _parameters(turbine: AnyTurbine, settings: LoadControl) -> Float:
    """The state vector after the collective law's part."""
    flaps, pitch, sensor = turbine.flaps, turbine.control.pitch, settings.sensor
    composed = View(LoadControlState, LoadControlState.zeros())
    composed["loops"], composed["groups"] = len(settings.loops), 1 + len(flaps)
    shares = FeedforwardWeights.zeros()
    if settings.feedforward is not None:
        composed["feedforward"] = settings.feedforward.gain
        shares = _weights(turbine, settings.feedforward)
    if settings.notch is not None:
        composed["notch_frequency"], composed["notch_damping"] = settings.notch.frequency, settings.notch.damping
    composed["sensor_frequency"], composed["sensor_noise"] = sensor.low_pass, sensor.noise
    composed["sensor_delay"] = sensor.delay
    noises = np.zeros(NOISE_STATES * MAX_BLADES)
    for i in range(MAX_BLADES):
        noise_start(noises, NOISE_STATES * i, sensor.seed, i)
    limits = [(pitch.minimum, pitch.maximum, pitch.rate_limit), *((f.minimum, f.maximum, f.rate) for f in flaps)]
    groups = np.zeros((1 + MAX_FLAPS, PER_GROUP))
    for group, (low, high, rate) in zip(groups, limits, strict=False):
        group[[MINIMUM, MAXIMUM, RATE]] = low, high, rate
    loops = [_loop(loop, limits[loop.flap if loop.actuator == "flap" else 0]) for loop in settings.loops]
    return np.concatenate([composed.array, shares, noises, groups.reshape(-1), *loops])


def _loop(loop: HarmonicLoop, limits: tuple[float, float, float]) -> Float:
    x = np.zeros(LOOP_STATES)
    view = View(HarmonicState, x)
    view["harmonic"], view["damping"], view["offset"] = loop.harmonic, loop.filter_damping, loop.offset
    view["halving_pitch"] = loop.gain_halving_pitch or 0.0
    view["authority"] = loop.authority or max(abs(limits[0]), abs(limits[1]))
    view["group"] = loop.flap if loop.actuator == "flap" else 0
    for axis in (TILT_AXIS, YAW_AXIS):
        found = integrator_settings(
            proportional_gain=loop.proportional_gain,
            integral_gain=loop.integral_gain,
            derivative_gain=loop.derivative_gain,
            derivative_frequency=loop.derivative_frequency,
            tracking_time=loop.tracking_time,
        )
        x[axis : axis + len(found)] = found
    return x


def _weights(turbine: AnyTurbine, f: FeedForward) -> Float:
    radius = f.radius if f.radius is not None else 2.0 / 3.0 * turbine.rotor_radius
    tower_radius = clearance = 0.0
    if f.tower_shadow:
        turbine = aeroelastic(turbine, "load_control: feedforward.tower_shadow")
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
