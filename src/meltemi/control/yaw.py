"""Yaw control: a vane with bias and noise, filters, a dead band, and the start and stop of the yaw drive.

    error          e = wrap(wind direction - nacelle direction) + bias, clockwise from above
    filtered       low-pass of e, fast: for protection and reports
    averaged       low-pass of the wind's direction, slow: for the drive's decision
    start          |averaged| > dead band for the start time
    stop           averaged error in the direction of turning <= stop band + rate^2 / (2 acceleration)

The nacelle's own turning is known, so the average takes it out: it moves with the nacelle at once and lags behind the
wind's direction alone. A drive that stops by it does not overshoot by the time of the average, and turbulence does not
stop it halfway. The vane is the horizontal wind at the undisturbed hub; what the rotor does to a vane behind it is part
of the bias.

Settings and state lie in a vector from the place ``at`` on, one behind the other as in ``YAW_CONTROL``.

Reference: docs/theory/control.md (C-50 to C-54).
"""

from __future__ import annotations

import math
from math import exp

import numpy as np
from numpy import float64
from numpy.typing import NDArray
from pydantic import Field

from meltemi.control import load_control as composed
from meltemi.control import signals as s
from meltemi.control.baseline import SWITCHES as LAW_SWITCHES
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.load_control import LoadControl, load_control
from meltemi.control.sensors import noise, noise_start
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.record import Record
from meltemi.maths.generic import crossed, floor
from meltemi.maths.tables import Table, View, number
from meltemi.turbine.definition import YawDrive
from meltemi.turbine.power_turbine import AnyTurbine

FEATURE = "the yaw control"

Float = NDArray[float64]


class YawControl(Record):
    """Settings of the yaw control; angles in radians, clockwise from above positive."""

    bias: float = Field(default=0.0, gt=-math.pi, lt=math.pi)
    """[rad] that the vane reads too much."""
    noise: float = Field(default=0.0, ge=0.0, lt=math.pi)
    """[rad] standard deviation of white noise of the vane, at every call."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Of the noise."""
    filter_time: float = Field(default=1.0, ge=0.0)
    """[s] time constant of the error for protection and reports; 0: not filtered."""
    average_time: float = Field(default=30.0, ge=0.0)
    """[s] time constant of the averages of wind direction and speed by which the drive is switched; 0: none."""
    dead_band: float = Field(default=math.radians(8.0), gt=0.0, lt=math.pi)
    """[rad] averaged error beyond which the drive starts."""
    start_time: float = Field(default=10.0, ge=0.0)
    """[s] for which it must stay beyond."""
    stop_band: float = Field(default=math.radians(0.5), ge=0.0, lt=math.pi)
    """[rad] averaged error within which the drive stops; smaller than the dead band."""
    rate: float | None = Field(default=None, gt=0.0, lt=0.2)
    """[rad/s] that is demanded; by default the most that the turbine's drive has."""
    minimum_wind: float = Field(default=2.5, ge=0.0)
    """[m/s] averaged wind speed below which the drive does not turn."""
    twist_limit: float | None = Field(default=None, gt=0.0)
    """[rad] from yaw 0 to either side beyond which the drive does not turn, for the cables' sake; none by default.
    Nothing untwists the cables."""


class YawControlState(Table, title="yaw control"):
    """Settings and state."""

    bias: float = number("rad", "of the vane")
    noise: float = number("rad", "standard deviation of the vane's noise; 0: none")
    filter_time: float = number("s", "time constant of the filtered error")
    average_time: float = number("s", "time constant of the averages")
    dead_band: float = number("rad", "averaged error that starts the drive")
    start_time: float = number("s", "for which it has to last")
    stop_band: float = number("rad", "averaged error at which the drive stops, with the angle of its braking")
    rate: float = number("rad/s", "that is demanded")
    minimum_wind: float = number("m/s", "below which the drive rests")
    twist_limit: float = number("rad", "yaw beyond which the drive does not turn further out; 0: none")
    filtered: float = number("rad", "state: filtered yaw error")
    averaged: float = number("rad", "state: averaged yaw error")
    wind: float = number("m/s", "state: averaged wind speed")
    heading: float = number("rad", "state: yaw at the last call, counter-clockwise")
    outside: float = number("s", "state: for which the averaged error has been beyond the dead band")
    turning: float = number("-", "state: 1 while the drive follows a positive error, -1 a negative one, 0 at rest")
    begun: float = number("-", "state: 0 nothing is known, 1 the error is, 2 all is")
    starts: float = number("-", "state: how often the drive has started")
    seed: float = number("-", "state: of the noise")
    stream: float = number("-", "state: of the noise")
    count: float = number("-", "state: of the noise")
    switches: float = number("-", "limits that a difference step would have reached, in derivative runs")


LENGTH = len(YawControlState)

BIAS, NOISE, FILTER_TIME, AVERAGE_TIME, DEAD_BAND, START_TIME, STOP_BAND, RATE, MINIMUM_WIND, TWIST_LIMIT = (
    YawControlState.slots(
        "bias noise filter_time average_time dead_band start_time stop_band rate minimum_wind twist_limit"
    )
)
FILTERED, AVERAGED, WIND, HEADING, OUTSIDE, TURNING, BEGUN, STARTS, SEED, SWITCHES = YawControlState.slots(
    "filtered averaged wind heading outside turning begun starts seed switches"
)


@kernel
def wrap(angle: float) -> float:
    """The angle within (-pi, pi]."""
    return angle + 2.0 * math.pi * floor((math.pi - angle) / (2.0 * math.pi))


@kernel
def yaw_error(measured: Float) -> float:
    """Wind direction minus nacelle direction [rad], clockwise from above, within (-pi, pi] (C-50)."""
    return wrap(measured[s.WIND_DIRECTION] + measured[s.YAW])


@kernel
def share(time: float, dt: float) -> float:
    """By which a low-pass of a time constant [s] moves towards its input in ``dt``; exact for a constant input."""
    return 1.0 - exp(-dt / time) if time > 0.0 else 1.0


@kernel
def yaw_start(x: Float, at: int, error: float) -> None:
    """State after a constant yaw error [rad] for long, the drive at rest; without it, the first call's error counts."""
    x[at + FILTERED] = wrap(error)
    x[at + AVERAGED] = wrap(error)
    x[at + OUTSIDE] = 0.0
    x[at + TURNING] = 0.0
    x[at + BEGUN] = 1.0


@kernel
def yaw_step(x: Float, at: int, measured: Float, dt: float) -> float:
    """One call of the yaw control (C-50 to C-54).

    Args:
      x: vector with settings and state from the place ``at`` on.
      measured: table Measurements.
      dt: [s] since the last call.

    Returns:
      Demanded yaw rate [rad/s], counter-clockwise. The filtered error is left in ``x[at + FILTERED]``.
    """
    error = yaw_error(measured) + x[at + BIAS]
    if x[at + NOISE] > 0.0:
        error = error + noise(x, at + SEED, x[at + NOISE])
    error = wrap(error)
    if x[at + BEGUN] < 1.0:
        yaw_start(x, at, error)
    if x[at + BEGUN] < 2.0:
        x[at + WIND], x[at + HEADING], x[at + BEGUN] = measured[s.WIND_SPEED], measured[s.YAW], 2.0
    x[at + FILTERED] = wrap(x[at + FILTERED] + share(x[at + FILTER_TIME], dt) * wrap(error - x[at + FILTERED]))
    slow = share(x[at + AVERAGE_TIME], dt)
    turned = wrap(x[at + AVERAGED] + measured[s.YAW] - x[at + HEADING])
    averaged = wrap(turned + slow * wrap(error - turned))
    x[at + AVERAGED], x[at + HEADING] = averaged, measured[s.YAW]
    x[at + WIND] += slow * (measured[s.WIND_SPEED] - x[at + WIND])

    beyond = abs(averaged) - x[at + DEAD_BAND]
    x[at + SWITCHES] += crossed(beyond)
    x[at + OUTSIDE] = x[at + OUTSIDE] + dt if beyond > 0.0 else 0.0 * beyond
    turning = x[at + TURNING]
    if turning != 0.0:
        left = turning * averaged - x[at + STOP_BAND]
        x[at + SWITCHES] += crossed(left)
        if left <= 0.0:
            turning = 0.0 * left
    elif beyond > 0.0 and x[at + OUTSIDE] >= x[at + START_TIME]:
        turning = 1.0 + 0.0 * beyond if averaged > 0.0 else -1.0 + 0.0 * beyond
        x[at + STARTS] += 1.0
    calm = x[at + WIND] < x[at + MINIMUM_WIND]
    x[at + SWITCHES] += crossed(x[at + WIND] - x[at + MINIMUM_WIND])
    # a positive, clockwise error is turned out by a clockwise, negative rate
    if calm or (x[at + TWIST_LIMIT] > 0.0 and -turning * measured[s.YAW] >= x[at + TWIST_LIMIT]):
        turning = 0.0 * turning
    x[at + TURNING] = turning
    return -turning * x[at + RATE]


def yaw_settings(settings: YawControl, turbine_yaw: YawDrive) -> Float:
    """Settings of a yaw control for a turbine's drive, its state at nothing known yet: a slice of a state vector.

    Raises:
      InputError: the stop band, with the angle in which the drive brakes, is not within the dead band, or the demanded
        rate is more than the drive has.
    """
    rate = turbine_yaw.rate if settings.rate is None else settings.rate
    if rate > turbine_yaw.rate:
        raise InputError(
            f"yaw control: rate {rate:g} rad/s is more than the {turbine_yaw.rate:g} rad/s of the turbine's yaw drive"
        )
    braking = 0.0 if turbine_yaw.acceleration is None else 0.5 * rate * rate / turbine_yaw.acceleration
    if not settings.stop_band + braking < settings.dead_band:
        raise InputError(
            f"yaw control: the drive would stop at {settings.stop_band + braking:g} rad (stop_band, and the angle in "
            f"which it brakes), which must be less than the dead_band of {settings.dead_band:g} rad"
        )
    x = YawControlState.zeros()
    view = View(YawControlState, x)
    for name in "bias noise filter_time average_time dead_band start_time minimum_wind".split():
        view[name] = getattr(settings, name)
    view["stop_band"], view["rate"] = settings.stop_band + braking, rate
    view["twist_limit"] = settings.twist_limit or 0.0
    noise_start(x, SEED, settings.seed)
    return x


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of load control and yaw control, whose part is the last of the state vector."""
    composed.update(x, measured, demands, dt)
    at = x.shape[0] - LENGTH
    demands[s.YAW_RATE_DEMAND] = yaw_step(x, at, measured, dt)
    demands[s.YAW_ERROR] = x[at + FILTERED]
    demands[s.YAW_THRESHOLD] = x[at + DEAD_BAND]
    x[LAW_SWITCHES] += x[at + SWITCHES]
    x[at + SWITCHES] = 0.0


def yaw_control(
    turbine: AnyTurbine,
    settings: YawControl | None = None,
    load: LoadControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "yaw control",
) -> Controller:
    """The baseline law, or a load controller, and beside it a yaw control. The model needs ``yaw="driven"``.

    Args:
      turbine: gives the collective law and the limits of its actuators.
      settings: of the yaw control; the defaults of ``YawControl``.
      load: of the load controller; none leaves the baseline law.
      sample_time: [s] between calls; by default every time step.
      name: for messages.

    Raises:
      InputError: settings that contradict each other or the turbine.
    """
    inner = load_control(turbine, load, sample_time=sample_time, name=name)
    template = yaw_settings(settings or YawControl(), turbine.yaw)

    def init(start: StartPoint) -> Float:
        return np.concatenate([inner.init(start), template])

    names = (*inner.state_names, *(f"yaw_{n}" for n in YawControlState.names)) if inner.state_names else ()
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        state_names=names,
        warnings=inner.warnings,
        yaws=True,
    )
