"""Pitch, yaw and torque under one controller: power control, yaw control that knows of it, and individual pitch.

Power control gives torque and collective pitch (C-80 to C-90), load control what each blade adds (C-27 to C-31), yaw
control the rate of the yaw drive (C-50 to C-54). Coordinated they are by what each may leave to the others:

* While the wind has more power than is asked for, a yaw error costs pitch, not energy. So the nacelle may stay where it
  is as long as a weak wind would still give the power that is asked for:

      cos(band) = (P / (1/2 rho pi R^2 C_p,max))^(1/3) / v_weak,      v_weak = v - caution * sigma_v

  with the mean v and standard deviation sigma_v of the estimated wind along the present wind direction. The dead band
  is that, but neither less than the yaw control's own nor more than ``widest_band``, which loads and not power set.
* The speed takes up what it can before the pitch moves: that is the scheme of the power control.
* Individual pitch adds to the collective pitch of the moment, whichever state the power control is in.

Reference: docs/theory/control.md (C-91 to C-93).
"""

from __future__ import annotations

import math
from math import atan2, cos, pi, sqrt

import numpy as np
from numpy import float64
from numpy.typing import NDArray
from pydantic import Field

from meltemi.control import signals as s
from meltemi.control.baseline import PITCH as COLLECTIVE
from meltemi.control.baseline import SWITCHES as LAW_SWITCHES
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.load_control import LoadControl, individual, load_control
from meltemi.control.power_control import state as p
from meltemi.control.power_control.controller import power_names, power_section, power_warnings, start_power
from meltemi.control.power_control.law import power_step, third_root
from meltemi.control.power_control.settings import PowerControl
from meltemi.control.yaw import (
    AVERAGED,
    DEAD_BAND,
    FILTERED,
    YawControl,
    YawControlState,
    share,
    yaw_settings,
    yaw_step,
)
from meltemi.control.yaw import LENGTH as YAW_LENGTH
from meltemi.control.yaw import SWITCHES as YAW_SWITCHES
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.record import Record
from meltemi.maths.generic import crossed, whole
from meltemi.maths.tables import Table, View, number
from meltemi.turbine.definition import Turbine
from meltemi.turbine.performance import RotorPerformance
from meltemi.turbine.power_turbine import PowerTurbine

FEATURE = "coordinated control"

Float = NDArray[float64]


class Coordination(Record):
    """What the yaw control makes of power that is not asked for."""

    widest_band: float = Field(default=math.radians(15.0), gt=0.0, lt=0.8)
    """[rad] dead band beyond which loads forbid to leave the nacelle, however much power there is."""
    caution: float = Field(default=1.0, ge=0.0, le=5.0)
    """Standard deviations of the wind below its mean at which the power asked for must still be there."""
    mean_time: float = Field(default=300.0, gt=0.0, le=3600.0)
    """[s] time constant of mean and standard deviation of the estimated wind."""


class CoordinationState(Table, title="coordination"):
    """Settings and state, which stand before those of the yaw control at the end of the vector."""

    power: float = number("-", "place of the power control in the state vector")
    individual: float = number("-", "1: with load control, which stands first")
    yaws: float = number("-", "1: with yaw control, which stands last")
    relieves: float = number("-", "1: the dead band follows the power")
    own_band: float = number("rad", "dead band of the yaw control itself")
    widest_band: float = number("rad", "largest dead band")
    caution: float = number("-", "standard deviations")
    mean_time: float = number("s", "of mean and standard deviation")
    mean: float = number("m/s", "state: mean of the estimated wind")
    variance: float = number("m^2/s^2", "state: variance of the estimated wind")
    switches: float = number("-", "limits that a difference step would have reached, in derivative runs")


LENGTH = len(CoordinationState)
POWER_PLACE, INDIVIDUAL, YAWS, RELIEVES, OWN_BAND, WIDEST_BAND, CAUTION, MEAN_TIME, MEAN, VARIANCE, SWITCHES = (
    CoordinationState.slots(
        "power individual yaws relieves own_band widest_band caution mean_time mean variance switches"
    )
)
LEAST_WIND = 0.1
"""[m/s]."""


@kernel
def dead_band(x: Float, at: int, power: int, error: float, dt: float) -> float:
    """Yaw error [rad] that may be left while power is to spare (C-91 to C-93).

    Args:
      at, power: places of the coordination and of the power control.
      error: [rad] averaged yaw error, by whose cosine the wind along its direction is stronger than the estimate.
    """
    along = x[power + p.WIND] / max(cos(error), 0.5)
    slow = share(x[at + MEAN_TIME], dt)
    off = along - x[at + MEAN]
    x[at + MEAN] += slow * off
    x[at + VARIANCE] += slow * ((1.0 - slow) * off * off - x[at + VARIANCE])
    weak = max(x[at + MEAN] - x[at + CAUTION] * sqrt(max(x[at + VARIANCE], 1e-12)), LEAST_WIND)
    radius = x[power + p.RADIUS]
    best = 0.5 * x[power + p.DENSITY] * pi * radius * radius * x[power + p.BEST_COEFFICIENT]
    needed = third_root(max(x[power + p.SETPOINT], 1.0) / (best * x[power + p.GEAR_EFFICIENCY]))
    cosine = needed / weak
    own, widest = x[at + OWN_BAND], x[at + WIDEST_BAND]
    x[at + SWITCHES] += crossed(cosine - cos(own)) + crossed(cosine - cos(widest))
    if cosine >= cos(own):
        return own + 0.0 * cosine
    if cosine <= cos(widest):
        return widest + 0.0 * cosine
    return atan2(sqrt(1.0 - cosine * cosine), cosine)


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    yaw = x.shape[0] - YAW_LENGTH
    at = yaw - LENGTH
    power = whole(x[at + POWER_PLACE])
    power_step(x, power, measured, demands, dt)
    if x[at + INDIVIDUAL] > 0.0:
        x[COLLECTIVE] = x[power + p.PITCH]
        individual(x, measured, demands, dt)
        x[power + p.SWITCHES] += x[LAW_SWITCHES]
        x[LAW_SWITCHES] = 0.0
    if x[at + YAWS] > 0.0:
        if x[at + RELIEVES] > 0.0:
            x[yaw + DEAD_BAND] = dead_band(x, at, power, x[yaw + AVERAGED], dt)
        demands[s.YAW_RATE_DEMAND] = yaw_step(x, yaw, measured, dt)
        demands[s.YAW_ERROR], demands[s.YAW_THRESHOLD] = x[yaw + FILTERED], x[yaw + DEAD_BAND]
        x[power + p.SWITCHES] += x[yaw + YAW_SWITCHES] + x[at + SWITCHES]
        x[yaw + YAW_SWITCHES] = x[at + SWITCHES] = 0.0


def coordinated(
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
    """Pitch, yaw and torque in one controller (Fig. 16 of Palanimuthu et al. 2022).

    Args:
      turbine: of blades, or of a power coefficient.
      performance: of its rotor, see ``performance_of``.
      power: torque, power reference and collective pitch.
      yaw: of the nacelle; none leaves it where it is. The model needs ``yaw="driven"``.
      relief: lets the dead band of the yaw follow the power that is to spare; none keeps it.
      load: what each blade's pitch and flaps add; none by default. Its collective law is not used.
      sample_time: [s] between calls; by default every time step.
      name: for messages.

    Raises:
      InputError: relief without yaw, a widest band within the yaw's own, load control of a turbine without blades or
        with a notch or preview, or whatever the parts refuse.
    """
    if relief is not None and yaw is None:
        raise InputError("coordinated: relief changes the dead band of the yaw control, so it needs yaw=YawControl()")
    if relief is not None and yaw is not None and relief.widest_band <= yaw.dead_band:
        raise InputError(
            f"coordinated: relief.widest_band {relief.widest_band:g} rad is not more than the dead_band "
            f"{yaw.dead_band:g} rad of the yaw control, so nothing could change"
        )
    if load is not None and not isinstance(turbine, Turbine):
        raise InputError(f"coordinated: load control acts on blades, which {turbine.name!r} does not have")
    if load is not None and (load.notch is not None or load.preview is not None):
        raise InputError("coordinated: notch and preview belong to a collective law that power control replaces")
    section = power_section(turbine, performance, power or PowerControl())
    blades = load_control(turbine, load, sample_time=sample_time) if load and isinstance(turbine, Turbine) else None
    own = yaw_settings(yaw or YawControl(), turbine.yaw)
    view = View(CoordinationState, CoordinationState.zeros())
    view["individual"], view["yaws"], view["relieves"] = blades is not None, yaw is not None, relief is not None
    settings = relief or Coordination()
    view["own_band"], view["widest_band"] = own[DEAD_BAND], settings.widest_band
    view["caution"], view["mean_time"] = settings.caution, settings.mean_time

    def init(start: StartPoint) -> Float:
        first = np.zeros(0) if blades is None else blades.initial_state(start)
        template = view.array.copy()
        template[POWER_PLACE], template[MEAN] = len(first), start.wind_speed
        x = np.concatenate([first, section, template, own])
        start_power(x, len(first), start)
        return x

    def warnings(x: Float) -> list[str]:
        found = [] if blades is None or blades.warnings is None else list(blades.warnings(x))
        return found + power_warnings(x, int(x[len(x) - YAW_LENGTH - LENGTH + POWER_PLACE]))

    names = [*power_names(section), *(f"coordination_{n}" for n in CoordinationState.names)]
    names += [f"yaw_{n}" for n in YawControlState.names]
    if blades is not None:
        names = [f"load_{n}" for n in blades.state_names] + names
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        uses_loads=blades is not None or yaw is not None,
        yaws=yaw is not None,
        state_names=tuple(names),
        warnings=warnings,
    )
