"""Settings of the supervisor, with defaults from the turbine."""

from __future__ import annotations

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.turbine.power_turbine import AnyTurbine

OVER_SPEED, TRIP_SPEED = 1.25, 1.3
"""Shares of rated speed at which the supervisor stops and trips: 1.2 times the largest excursion of speed of the
library's turbines in the extreme turbulence model at cut-out, and 0.05 above (docs/theory/control.md, C-69)."""
LEAST_CUT_IN = 0.3
"""Share of rated speed: the cut-in of a law below it does not determine the speed at which to connect."""


ROUNDING = 1e-5
"""Excess of a rate or angle, converted from degrees, over a limit that a file gives with six digits."""
CUT_OUT_MEAN = 1.04
"""Share of cut-out above ten-minute means, measured at hub height, of normal turbulence with the mean of cut-out."""


class Supervision(Record):
    """Settings of start, stop and protection; defaults follow from the turbine."""

    begin: Literal["automatic", "standby", "idling"] = "automatic"
    """State at the start of a run: by the rotor's speed, or one of rest; ``idling`` lasts until the request "start"."""
    auto_start: bool = True
    """Start without a request in suitable wind; otherwise only at the operator's request."""
    latched: bool = True
    """Stops for the turbine's protection last until the operator requests "start"."""

    start_wind: float | None = Field(default=None, gt=0.0)
    """[m/s; 1.5 to 8] 30 s mean above which it starts; the turbine's cut-in by default."""
    start_time: float = Field(default=10.0, ge=0.0)
    """[s; 1 to 900] time for which it must be above."""
    stop_wind: float | None = Field(default=None, ge=0.0)
    """[m/s; 1 to 8] 30 s mean below which it stops; 0.8 of cut-in by default."""
    stop_time: float = Field(default=60.0, ge=0.0)
    """[s; 5 to 1800] time for which it must be below."""
    cut_out_mean: float | None = Field(default=None, gt=0.0)
    """[m/s; 12 to 40] 10 min mean above which it stops; 1.04 of cut-out by default: turbulence about cut-out stays
    below."""
    cut_out_wind: float | None = Field(default=None, gt=0.0)
    """[m/s; 12 to 50] 30 s mean above which it stops; 1.2 of cut-out by default."""
    cut_out_gust: float | None = Field(default=None, gt=0.0)
    """[m/s; 12 to 60] 3 s mean above which it stops; 1.4 of cut-out by default."""
    restart_wind: float | None = Field(default=None, gt=0.0)
    """[m/s; 10 to 40] 30 s mean below which it may start; 0.88 of cut-out by default."""
    restart_time: float = Field(default=60.0, ge=0.0)
    """[s; 10 to 3600] time for which it must be below, after a stop."""
    mean_window: float = Field(default=600.0, gt=0.0, le=3600.0)
    """[s; 60 to 3600] averaging time of the long mean, which moves in steps of a 600th of it."""
    wind_window: float = Field(default=30.0, gt=0.0, le=3600.0)
    """[s; 5 to 300] averaging time of the mean."""
    gust_window: float = Field(default=3.0, gt=0.0, le=3600.0)
    """[s; 0.5 to 20] averaging time of the gust."""

    start_pitch: float = Field(default=0.5, ge=0.0, lt=1.6)
    """[rad; 0.2 to 1.2] lowest pitch at standstill, which falls in proportion to the speed: at low tip-speed ratios
    the rotor stalls at fine pitch."""
    start_ratio: float = Field(default=5.0, gt=0.0)
    """Tip-speed ratio at which the lowest pitch is that of the law [-; 2 to 12]."""
    start_rate: float | None = Field(default=None, gt=0.0, le=2.0)
    """[rad/s; 0.002 to 0.5] pitch rate during start-up; 2 deg/s by default, at most that of the actuator."""
    start_acceleration: float | None = Field(default=None, gt=0.0)
    """[rad/s^2] acceleration of the reference of the generator speed; by default connection after 30 s."""
    connect_speed: float | None = Field(default=None, gt=0.0)
    """[rad/s] generator speed at the connection; by default that at which the law's torque begins."""
    connect_time: float = Field(default=10.0, gt=0.0)
    """[s; 1 to 120] time in which the limit of the torque rises from zero to the largest torque."""
    start_limit: float = Field(default=600.0, gt=0.0)
    """[s; 60 to 3600] longest duration of a start-up."""

    feather: float | None = Field(default=None, gt=-1.6, lt=3.2)
    """[rad; 1 to 1.7] pitch at rest; the largest of the collective law by default."""
    normal_rate: float | None = Field(default=None, gt=0.0, le=2.0)
    """[rad/s; 0.01 to 1] pitch rate at a normal stop; 4 deg/s by default, at most that of the actuator."""
    emergency_rate: float | None = Field(default=None, gt=0.0, le=2.0)
    """[rad/s; 0.02 to 2] pitch rate at an emergency stop; 7 deg/s by default, at most that of the actuator."""
    emergency_torque: bool = True
    """The generator brakes at an emergency stop while there is a grid; otherwise its torque falls to zero at the rate
    limit of the law, not at once as when the grid is lost."""
    brake: float = Field(default=1.0, ge=0.0, le=1.0)
    """Share of the full brake at an emergency stop; 0: none."""
    brake_speed: float = Field(default=0.1, ge=0.0, lt=2.0)
    """Share of rated speed below which the brake is applied [-; 0.01 to 1]."""
    idle_speed: float = Field(default=0.15, gt=0.0, lt=1.0)
    """Share of rated speed below which a stopped turbine idles [-; 0.05 to 0.6]."""

    over_speed: float = Field(default=OVER_SPEED, gt=1.0, lt=3.0)
    """Share of rated speed above which it stops."""
    trip_speed: float = Field(default=TRIP_SPEED, gt=1.0, lt=3.0)
    """Share of rated speed above which it makes an emergency stop."""
    over_power: float = Field(default=1.2, gt=1.0, lt=10.0)
    """Share of rated power above which it stops."""
    power_time: float = Field(default=1.0, ge=0.0)
    """[s; 0.05 to 60] time for which it must be above."""
    speed_difference: float = Field(default=0.05, gt=0.0)
    """Permitted difference of the sensors of rotor and generator speed, as a share of rated speed [-; 0.01 to 0.3]."""
    sensor_time: float = Field(default=0.5, ge=0.0)
    """[s; 0.02 to 10] time for which they may differ by more."""
    frozen_time: float = Field(default=2.0, gt=0.0)
    """[s; 0.1 to 60] time for which the measured generator speed may be constant while the rotor speed changes."""
    pitch_difference: float = Field(default=math.radians(5.0), gt=0.0)
    """[rad; 0.01 to 0.5] permitted difference of a blade's pitch from its demand."""
    pitch_time: float = Field(default=1.0, ge=0.0)
    """[s; 0.05 to 20] time for which it may differ by more."""
    acceleration: float = Field(default=3.0, gt=0.0)
    """[m/s^2; 0.5 to 20] horizontal acceleration of the tower top above which it stops."""

    region_time: float = Field(default=5.0, ge=0.0)
    """[s; 0.2 to 60] time for which the law must be in another region before the state follows; it has no other
    effect."""
    derate_rate: float = Field(default=0.1, gt=0.0)
    """[1/s; 0.005 to 2] rate at which the set-point follows the operator's limit, as a share of rated power."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.over_speed > self.trip_speed:
            raise ValueError(f"over_speed {self.over_speed:g} must not be more than trip_speed {self.trip_speed:g}")
        return self


def limits(turbine: AnyTurbine, settings: Supervision) -> dict[str, float]:
    """Limits and settings of conditions and states by name, in SI units.

    Raises:
      InputError: winds or speeds in a wrong order, or a pitch rate that the actuator does not have.
    """

    def given(name: str, default: float) -> float:
        value = getattr(settings, name)
        return default if value is None else float(value)

    torque, pitch = turbine.control.torque, turbine.control.pitch
    rated, cut_out = pitch.reference_speed, turbine.cut_out
    most = turbine.pitch_actuator.rate_limit if turbine.pitch_actuator.kind != "ideal" else pitch.rate_limit
    begins = torque.cut_in_speed
    connect = given("connect_speed", begins if begins >= LEAST_CUT_IN * rated else 0.5 * rated)
    values = {
        "start_wind": given("start_wind", turbine.cut_in),
        "stop_wind": given("stop_wind", 0.8 * turbine.cut_in),
        "cut_out_mean": given("cut_out_mean", CUT_OUT_MEAN * cut_out),
        "cut_out_wind": given("cut_out_wind", 1.2 * cut_out),
        "cut_out_gust": given("cut_out_gust", 1.4 * cut_out),
        "restart_wind": given("restart_wind", 0.88 * cut_out),
        "connect_speed": connect,
        "start_acceleration": given("start_acceleration", connect / 30.0),
        "feather": given("feather", pitch.maximum),
        "start_rate": given("start_rate", min(math.radians(2.0), most)),
        "normal_rate": given("normal_rate", min(math.radians(4.0), most)),
        "emergency_rate": given("emergency_rate", min(math.radians(7.0), most)),
        "rated_speed": rated,
        "trip_speed": settings.trip_speed * rated,
        "over_speed": settings.over_speed * rated,
        "speed_difference": settings.speed_difference * rated,
        "idle_speed": settings.idle_speed * rated,
        "brake_speed": settings.brake_speed * rated,
        "over_power": settings.over_power * turbine.rated_power,
        "rated_power": torque.rated_power * turbine.drivetrain.generator_efficiency,
    }
    names = "start_time stop_time restart_time mean_window wind_window gust_window start_pitch connect_time"
    names += " start_limit brake power_time sensor_time frozen_time pitch_difference pitch_time"
    names += " acceleration region_time derate_rate"
    values |= {name: getattr(settings, name) for name in names.split()}
    values["feathered"] = values["feather"] - math.radians(0.5)
    for low, high in (
        ("stop_wind", "start_wind"),
        ("start_wind", "restart_wind"),
        ("restart_wind", "cut_out_mean"),
        ("cut_out_mean", "cut_out_wind"),
        ("cut_out_wind", "cut_out_gust"),
    ):
        if values[low] > values[high]:
            raise InputError(
                f"supervision: {low} {values[low]:g} m/s is more than {high} {values[high]:g} m/s "
                f"(the turbine's cut-in is {turbine.cut_in:g}, its cut-out {cut_out:g} m/s)"
            )
    if not connect < rated:
        raise InputError(
            f"supervision: connect_speed {connect:g} rad/s is not below the rated {rated:g} rad/s of the generator"
        )
    for name in ("normal_rate", "emergency_rate", "start_rate"):
        if values[name] > most * (1.0 + ROUNDING):
            raise InputError(
                f"supervision: {name} {values[name]:g} rad/s is more than the pitch actuator's {most:g} rad/s"
            )
    if values["feather"] > turbine.pitch_actuator.maximum + ROUNDING:
        raise InputError(
            f"supervision: feather {values['feather']:g} rad is beyond the pitch actuator's "
            f"{turbine.pitch_actuator.maximum:g} rad"
        )
    return values
