"""Coordinated pitch, yaw and torque control: power control, a yaw control that uses it, and individual pitch.

Power control sets torque and collective pitch (C-80 to C-88), load control individual pitch and flaps (C-27 to C-31),
yaw control the yaw rate (C-50 to C-54). They are coordinated as follows:

* While the available power exceeds the demand, a yaw error changes the pitch, not the energy. So the nacelle may keep
  its angle as long as a weak wind would still deliver the demanded power:

      cos(band) = (P / (1/2 rho pi R^2 C_p,max))^(1/3) / v_weak,      v_weak = v - caution * sigma_v

  with the mean v and standard deviation sigma_v of the estimated wind along the present wind direction. This
  dead band is limited to between that of the yaw control and ``widest_band``, which is set by loads.
* The rotor speed absorbs variations before the pitch moves, by the scheme of the power control.
* Individual pitch is added to the present collective pitch in all states of the power control.

Reference: docs/theory/control.md (C-91 to C-93).
"""

from __future__ import annotations

import math
from math import atan2, cos, pi, sqrt

from numpy import float64
from numpy.typing import NDArray
from pydantic import Field

from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.compiler import Table, crossed, kernel, number, part
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.load_control import LoadControl, LoadController, LoadControlState, individual, limit_warnings
from meltemi.control_laws.yaw import YawControl, YawControlState, share, yaw_settings, yaw_step
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.power_control.controller import power_settings, power_start, power_warnings
from meltemi.power_control.law import power_step, third_root
from meltemi.power_control.settings import PowerControl
from meltemi.power_control.state import PowerControlState
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import PowerTurbine

FEATURE = "coordinated control"

Float = NDArray[float64]


class Coordination(Record):
    """Dead band of the yaw control as a function of the power in excess of the reference."""

    widest_band: float = Field(default=math.radians(15.0), gt=0.0, lt=0.8)
    """[rad] largest dead band that loads permit, regardless of the available power."""
    caution: float = Field(default=1.0, ge=0.0, le=5.0)
    """Standard deviations of the wind below its mean at which the demanded power must still be available."""
    mean_time: float = Field(default=300.0, gt=0.0, le=3600.0)
    """[s] time constant of mean and standard deviation of the estimated wind."""


class CoordinationState(Table, title="coordination"):
    """Settings and state of the coordination."""

    individual: float = number("-", "1: with load control")
    yaws: float = number("-", "1: with yaw control")
    relieves: float = number("-", "1: the dead band follows the power")
    narrow_band: float = number("rad", "dead band of the yaw control without relief")
    widest_band: float = number("rad", "largest dead band")
    caution: float = number("-", "number of standard deviations below the mean")
    mean_time: float = number("s", "time constant of mean and standard deviation")
    mean: float = number("m/s", "state: mean of the estimated wind")
    variance: float = number("m^2/s^2", "state: variance of the estimated wind")
    switches: float = number("-", "limits within the difference step of a parameter, in derivative runs")


class CoordinatedState(Table, title="coordinated control"):
    """State of all parts; load control and yaw control are idle unless requested."""

    coordination: CoordinationState = part(CoordinationState, "coordination of the parts")
    yaw: YawControlState = part(YawControlState, "yaw control")
    power: PowerControlState = part(PowerControlState, "power control", prefix="")
    load: LoadControlState = part(LoadControlState, "individual pitch and flaps")


LEAST_WIND = 0.1
"""[m/s] lower limit of the weak wind."""


@kernel
def dead_band(x: CoordinationState, power: PowerControlState, error: float, dt: float) -> float:
    """Dead band [rad] of the yaw error with power in excess of the reference (C-91 to C-93).

    Args:
      error: [rad] averaged yaw error; the estimate is the wind along its direction times the cosine of the error.
    """
    along = power.wind / max(cos(error), 0.5)
    slow = share(x.mean_time, dt)
    off = along - x.mean
    x.mean += slow * off
    x.variance += slow * ((1.0 - slow) * off * off - x.variance)
    weak = max(x.mean - x.caution * sqrt(max(x.variance, 1e-12)), LEAST_WIND)
    best = 0.5 * power.density * pi * power.radius * power.radius * power.best_coefficient
    needed = third_root(max(power.setpoint, 1.0) / (best * power.gear_efficiency))
    cosine = needed / weak
    band, widest = x.narrow_band, x.widest_band
    x.switches += crossed(cosine - cos(band)) + crossed(cosine - cos(widest))
    if cosine >= cos(band):
        return band
    if cosine <= cos(widest):
        return widest
    return atan2(sqrt(1.0 - cosine * cosine), cosine)


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    x, measured, wanted = CoordinatedState(state), Measurements(measurements), Demands(demands)
    coordination, power, yaw = x.coordination, x.power, x.yaw
    power_step(power, measured, wanted, dt)
    if coordination.individual > 0.0:
        law = x.load.collective
        law.pitch = power.pitch
        individual(x.load, measured, wanted, dt)
        power.switches += law.switches
        law.switches = 0.0
    if coordination.yaws > 0.0:
        if coordination.relieves > 0.0:
            yaw.dead_band = dead_band(coordination, power, yaw.averaged, dt)
        wanted.yaw_rate = yaw_step(yaw, measured, dt)
        wanted.yaw_error, wanted.yaw_threshold = yaw.filtered, yaw.dead_band
        power.switches += yaw.switches + coordination.switches
        yaw.switches = 0.0
        coordination.switches = 0.0


def CoordinatedController(
    turbine: Turbine | PowerTurbine,
    performance: RotorPerformance,
    *,
    power: PowerControl | None = None,
    yaw: YawControl | None = None,
    relief: Coordination | None = None,
    load: LoadControl | None = None,
    sample_time: float | None = None,
    name: str = "coordinated",
) -> Controller:
    """Controller of pitch, yaw and torque (Fig. 16 of Palanimuthu et al. 2022).

    Args:
      turbine: turbine with blades or with a power coefficient.
      performance: performance of its rotor, see ``performance_of``.
      power: settings of torque, power reference and collective pitch.
      yaw: yaw control; None keeps the nacelle fixed. The model needs ``yaw="driven"``.
      relief: dead band of the yaw control as a function of the power reserve; None keeps it constant.
      load: load control by individual pitch and flaps; none by default. Its collective law is not used.
      sample_time: [s] time between calls; by default every time step.
      name: name for messages.

    Raises:
      InputError: relief without yaw control, a widest band within the dead band, load control of a turbine without
        blades or with a notch or preview, or invalid settings of a part.
    """
    if relief is not None and yaw is None:
        raise InputError(
            "CoordinatedController: relief changes the dead band of the yaw control, so it needs yaw=YawControl()"
        )
    if relief is not None and yaw is not None and relief.widest_band <= yaw.dead_band:
        raise InputError(
            f"CoordinatedController: relief.widest_band {relief.widest_band:g} rad is not more than the dead_band "
            f"{yaw.dead_band:g} rad of the yaw control, so nothing could change"
        )
    if load is not None and not isinstance(turbine, Turbine):
        raise InputError(f"CoordinatedController: load control acts on blades, which {turbine.name!r} does not have")
    if load is not None and (load.notch is not None or load.preview is not None):
        raise InputError(
            "CoordinatedController: notch and preview belong to a collective law that power control replaces"
        )
    template = power_settings(turbine, performance, power or PowerControl())
    blades = LoadController(turbine, load, sample_time=sample_time) if load and isinstance(turbine, Turbine) else None
    yaw_values = yaw_settings(yaw or YawControl(), turbine.yaw)
    settings = relief or Coordination()
    coordination = CoordinationState.of(
        individual=blades is not None,
        yaws=yaw is not None,
        relieves=relief is not None,
        narrow_band=yaw_values.dead_band,
        widest_band=settings.widest_band,
        caution=settings.caution,
        mean_time=settings.mean_time,
    )

    def init(start: StartPoint) -> CoordinatedState:
        load = LoadControlState.of() if blades is None else blades.init(start)
        x = CoordinatedState.of(
            coordination=coordination, yaw=yaw_values, power=power_start(template, start), load=load
        )
        x.coordination.mean = start.wind_speed
        return x

    def warnings(state: Float) -> list[str]:
        x = CoordinatedState(state)
        return limit_warnings(x.load) + power_warnings(x.power)

    anywhere = StartPoint(wind_speed=0.0, generator_speed=0.0, pitch=0.0, generator_torque=0.0)
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        uses_loads=blades is not None or yaw is not None,
        yaws=yaw is not None,
        state_names=CoordinatedState.names_of(init(anywhere).array),
        warnings=warnings,
    )
