"""Yaw control: vane with bias and noise, filters, dead band, start and stop of the yaw drive.

    error          e = wrap(wind direction - nacelle direction) + bias, clockwise from above
    filtered       low-pass of e, fast: for protection and reports
    averaged       low-pass of the wind's direction, slow: for the drive's decision
    start          |averaged| > dead band for the start time
    stop           averaged error in the direction of turning <= stop band + rate^2 / (2 acceleration)

The yaw motion of the nacelle is known, so the average excludes it: it follows the nacelle without lag and lags only
behind the wind direction. A drive that stops by it does not overshoot by the averaging time, and turbulence does not
stop it halfway. The vane measures the undisturbed horizontal wind at the hub; the effect of the rotor on a vane behind
it is part of the bias.

Reference: docs/theory/control.md (C-50 to C-54).
"""

from __future__ import annotations

import math
from math import exp

from numpy import float64
from numpy.typing import NDArray
from pydantic import Field

from meltemi.compiler import Table, crossed, floor, kernel, number, part
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.load_control import LoadControl, LoadController, LoadControlState, limit_warnings, load_step
from meltemi.control_laws.sensors import Noise, noise, noise_start
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.turbine.definition import YawDrive
from meltemi.turbine.power_turbine import AnyTurbine

FEATURE = "the yaw control"

Float = NDArray[float64]


class YawControl(Record):
    """Settings of the yaw control; angles in radians, clockwise from above positive."""

    bias: float = Field(default=0.0, gt=-math.pi, lt=math.pi)
    """[rad] bias of the vane."""
    noise: float = Field(default=0.0, ge=0.0, lt=math.pi)
    """[rad] standard deviation of white noise of the vane, at every call."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Seed of the noise."""
    filter_time: float = Field(default=1.0, ge=0.0)
    """[s] time constant of the error for protection and reports; 0: not filtered."""
    average_time: float = Field(default=30.0, ge=0.0)
    """[s] time constant of the averages of wind direction and speed by which the drive is switched; 0: none."""
    dead_band: float = Field(default=math.radians(8.0), gt=0.0, lt=math.pi)
    """[rad] averaged error beyond which the drive starts."""
    start_time: float = Field(default=10.0, ge=0.0)
    """[s] time for which the error must exceed the dead band."""
    stop_band: float = Field(default=math.radians(0.5), ge=0.0, lt=math.pi)
    """[rad] averaged error within which the drive stops; smaller than the dead band."""
    rate: float | None = Field(default=None, gt=0.0, lt=0.2)
    """[rad/s] demanded yaw rate; by default the rate of the turbine's yaw drive."""
    minimum_wind: float = Field(default=2.5, ge=0.0)
    """[m/s] averaged wind speed below which the drive does not turn."""
    twist_limit: float | None = Field(default=None, gt=0.0)
    """[rad] limit of the yaw angle to either side, for the cables; the drive does not turn beyond it; none by default.
    Nothing untwists the cables."""


class YawControlState(Table, title="yaw control"):
    """Settings and state."""

    bias: float = number("rad", "bias of the vane")
    noise: float = number("rad", "standard deviation of the vane's noise; 0: none")
    filter_time: float = number("s", "time constant of the filtered error")
    average_time: float = number("s", "time constant of the averages")
    dead_band: float = number("rad", "averaged error that starts the drive")
    start_time: float = number("s", "time for which it has to last")
    stop_band: float = number("rad", "averaged error at which the drive stops, with the angle of its braking")
    rate: float = number("rad/s", "demanded rate")
    minimum_wind: float = number("m/s", "averaged wind speed below which the drive does not turn")
    twist_limit: float = number("rad", "yaw beyond which the drive does not turn further out; 0: none")
    filtered: float = number("rad", "state: filtered yaw error")
    averaged: float = number("rad", "state: averaged yaw error")
    wind: float = number("m/s", "state: averaged wind speed")
    heading: float = number("rad", "state: yaw at the last call, counter-clockwise")
    outside: float = number("s", "state: time for which the averaged error has been beyond the dead band")
    turning: float = number("-", "state: 1 while the drive follows a positive error, -1 a negative one, 0 at rest")
    begun: float = number("-", "state: 0 before the first call, 1 with an initial error, 2 after the first call")
    starts: float = number("-", "state: number of starts of the drive")
    vane: Noise = part(Noise, "noise of the vane", prefix="")
    switches: float = number("-", "limits within the difference step of a parameter, in derivative runs")


class YawingState(Table, title="load control and yaw control"):
    """State of load control and yaw control."""

    yaw: YawControlState = part(YawControlState, "yaw control")
    load: LoadControlState = part(LoadControlState, "load control", prefix="")


@kernel
def wrap(angle: float) -> float:
    """Angle within (-pi, pi]."""
    return angle + 2.0 * math.pi * floor((math.pi - angle) / (2.0 * math.pi))


@kernel
def yaw_error(measured: Measurements) -> float:
    """Wind direction minus nacelle direction [rad], clockwise from above, within (-pi, pi] (C-50)."""
    return wrap(measured.wind_direction + measured.yaw)


@kernel
def share(time: float, dt: float) -> float:
    """Step of a low-pass with a time constant [s] over ``dt``, exact for a constant input."""
    return 1.0 - exp(-dt / time) if time > 0.0 else 1.0


@kernel
def yaw_start(x: YawControlState, error: float) -> None:
    """Set the steady state of a constant yaw error [rad] with the drive at rest; by default that of the first call."""
    x.filtered = wrap(error)
    x.averaged = wrap(error)
    x.outside = 0.0
    x.turning = 0.0
    x.begun = 1.0


@kernel
def yaw_step(x: YawControlState, measured: Measurements, dt: float) -> float:
    """One call of the yaw control (C-50 to C-54).

    Args:
      x: settings and state.
      measured: measurements of the sensors.
      dt: [s] since the last call.

    Returns:
      Demanded yaw rate [rad/s], counter-clockwise. The filtered error is left in ``x.filtered``.
    """
    error = yaw_error(measured) + x.bias
    if x.noise > 0.0:
        error = error + noise(x.vane, x.noise)
    error = wrap(error)
    if x.begun < 1.0:
        yaw_start(x, error)
    if x.begun < 2.0:
        x.wind, x.heading, x.begun = measured.wind_speed, measured.yaw, 2.0
    x.filtered = wrap(x.filtered + share(x.filter_time, dt) * wrap(error - x.filtered))
    slow = share(x.average_time, dt)
    turned = wrap(x.averaged + measured.yaw - x.heading)
    averaged = wrap(turned + slow * wrap(error - turned))
    x.averaged, x.heading = averaged, measured.yaw
    x.wind += slow * (measured.wind_speed - x.wind)

    beyond = abs(averaged) - x.dead_band
    x.switches += crossed(beyond)
    x.outside = x.outside + dt if beyond > 0.0 else 0.0
    turning = x.turning
    if turning != 0.0:
        left = turning * averaged - x.stop_band
        x.switches += crossed(left)
        if left <= 0.0:
            turning = 0.0
    elif beyond > 0.0 and x.outside >= x.start_time:
        turning = 1.0 if averaged > 0.0 else -1.0
        x.starts += 1.0
    calm = x.wind < x.minimum_wind
    x.switches += crossed(x.wind - x.minimum_wind)
    # a positive, clockwise error needs a clockwise, negative rate
    if calm or (x.twist_limit > 0.0 and -turning * measured.yaw >= x.twist_limit):
        turning = 0.0
    x.turning = turning
    return -turning * x.rate


def yaw_settings(settings: YawControl, turbine_yaw: YawDrive) -> YawControlState:
    """Settings and initial state of a yaw control for the drive of a turbine.

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
    same = "bias noise filter_time average_time dead_band start_time minimum_wind".split()
    return YawControlState.of(
        **{name: getattr(settings, name) for name in same},
        stop_band=settings.stop_band + braking,
        rate=rate,
        twist_limit=settings.twist_limit or 0.0,
        vane=noise_start(settings.seed),
    )


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of load control and yaw control."""
    x, measured, wanted = YawingState(state), Measurements(measurements), Demands(demands)
    load_step(x.load, measured, wanted, dt)
    wanted.yaw_rate = yaw_step(x.yaw, measured, dt)
    wanted.yaw_error = x.yaw.filtered
    wanted.yaw_threshold = x.yaw.dead_band
    x.load.collective.switches += x.yaw.switches
    x.yaw.switches = 0.0


def YawController(
    turbine: AnyTurbine,
    settings: YawControl | None = None,
    load: LoadControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "yaw control",
) -> Controller:
    """Baseline or load controller with a yaw control. The model needs ``yaw="driven"``.

    Args:
      turbine: turbine with the collective law and the limits of its actuators.
      settings: settings of the yaw control; by default those of ``YawControl``.
      load: settings of the load controller; by default the baseline law.
      sample_time: [s] time between calls; by default every time step.
      name: name for messages.

    Raises:
      InputError: settings are inconsistent with each other or with the turbine.
    """
    inner = LoadController(turbine, load, sample_time=sample_time, name=name)
    template = yaw_settings(settings or YawControl(), turbine.yaw)

    def init(start: StartPoint) -> YawingState:
        return YawingState.of(yaw=template, load=inner.init(start))

    names = (*(f"yaw_{n}" for n in YawControlState.names), *inner.state_names) if inner.state_names else ()
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        state_names=names,
        warnings=lambda x: limit_warnings(YawingState(x).load),
        yaws=True,
    )
