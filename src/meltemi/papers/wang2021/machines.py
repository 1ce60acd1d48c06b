"""The two turbines of the paper with its strategies."""

from __future__ import annotations

from functools import cache
from typing import Final

from meltemi.analyses.performance import performance_of
from meltemi.control.controller import Controller
from meltemi.control_laws.yaw import YawControl
from meltemi.core.units import rpm
from meltemi.papers.wang2021.gust import MACHINE, SLOW
from meltemi.power_control.coordinated import CoordinatedController
from meltemi.power_control.settings import PowerControl
from meltemi.studies.scaling.library import scaled_turbine
from meltemi.studies.yaw_gusts import with_yaw_rate
from meltemi.tuning.baseline_tuning import tune_baseline
from meltemi.turbine.definition import BaselineControl, Turbine
from meltemi.turbine.library import load_turbine

MEASURED: Final = "zr20-122"
STUDIED: Final = "ct30-155"
"""Library turbines of the measurements, and of the strategies."""
TORQUE_HELD: Final = {"control.torque.hold": "torque"}
LIMITED = 2.0e6
"""[W] power of the paper's derating."""
RATING = 2.037e6
"""[W] rated power in the paper's simulation; Table 1 has 2 MW, Table 2 2,036 to 2,040 kW."""


def measured_turbine() -> Turbine:
    """ZR2.0-122 with the rating of the paper's simulation and constant torque above rated."""
    return scaled_turbine(MEASURED, rated_power=RATING).replace(**TORQUE_HELD)


def with_speed_loop(turbine: Turbine, factor: float, tip_speed_ratio: float | None = None) -> Turbine:
    """The turbine with the frequency of the speed loop multiplied by a factor, and a tip-speed ratio below rated."""
    control = _usual_control(turbine, tip_speed_ratio)
    proportional, integral = factor * control.pitch.proportional_gain, factor**2 * control.pitch.integral_gain
    pitch = control.pitch.replace(proportional_gain=proportional, integral_gain=integral)
    return turbine.replace(control=control.replace(pitch=pitch)).replace(**TORQUE_HELD)


@cache
def _usual_control(turbine: Turbine, tip_speed_ratio: float | None) -> BaselineControl:
    return tune_baseline(turbine, tip_speed_ratio=tip_speed_ratio, margins=False).control


def studied_turbine(yaw_rate: float) -> Turbine:
    """CT3.0-155 of the library, 9.9 rpm and constant power, with a yaw rate [rad/s]."""
    return with_yaw_rate(load_turbine(STUDIED), yaw_rate)


def gust_machines(yaw_rate: float) -> dict[str, Turbine]:
    """CT3.0-155 with the paper's rotor speed or a slower one, constant torque above rated; yaw rate in rad/s."""
    fast = with_yaw_rate(scaled_turbine(STUDIED, rotor_speed=rpm(12.6)), yaw_rate)
    return {n: t.replace(**TORQUE_HELD) for n, t in {MACHINE: fast, SLOW: studied_turbine(yaw_rate)}.items()}


YAW_CONTROLS = {1.0: YawControl(average_time=1.0, start_time=0.0), 10.0: YawControl(average_time=10.0, start_time=0.0)}
YAW_CONTROLS |= {YawControl().average_time: YawControl()}
"""Yaw controls by averaging time [s]: two that start when the averaged error leaves the dead band, and the default."""


def slowed(turbine: Turbine, yaw: YawControl) -> Controller:
    """Power control that follows a power limit at the lowest speed that gives it (A0)."""
    power = PowerControl(scheme="optimal_speed")
    return CoordinatedController(turbine, performance_of(turbine), power=power, yaw=yaw)
