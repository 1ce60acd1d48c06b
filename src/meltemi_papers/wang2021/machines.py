"""The paper's two turbines under its strategies."""

from __future__ import annotations

from typing import Final

from meltemi.control.controller import Controller
from meltemi.control.supervisor.settings import Supervision
from meltemi.control.supervisor.supervised import SupervisedController
from meltemi.control.supervisor.threshold import YawProtection
from meltemi.control.yaw import YawControl
from meltemi.core.units import rpm
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi_papers.wang2021.gust import HELD, MACHINE, SLOW
from meltemi_papers.wang2021.turbines import scaled_turbine

MEASURED: Final = "zr20-122"
STUDIED: Final = "ct30-155"
"""Of the library: that of the measurements, and that of the strategies."""
TORQUE_HELD: Final = {"control.torque.hold": "torque"}
LIMITED = 2.0e6
"""[W] to which the paper derates."""


def measured_turbine() -> Turbine:
    """ZR2.0-122 with the torque of the paper above rated: constant."""
    return load_turbine(MEASURED).replace(**TORQUE_HELD)


def studied_turbine(yaw_rate: float) -> Turbine:
    """CT3.0-155 of the library, 9.9 rpm and power held, with a yaw rate [rad/s]."""
    return with_yaw_rate(load_turbine(STUDIED), yaw_rate)


def gust_machines(yaw_rate: float) -> dict[str, Turbine]:
    """CT3.0-155 with the paper's rotor speed or a slower one, torque or power held above rated; yaw rate in rad/s."""
    fast = with_yaw_rate(scaled_turbine(STUDIED, rotor_speed=rpm(12.6)), yaw_rate)
    held = {MACHINE: fast, SLOW: studied_turbine(yaw_rate)}
    return {n: t.replace(**TORQUE_HELD) for n, t in held.items()} | {n + HELD: t for n, t in held.items()}


def with_yaw_rate(turbine: Turbine, rate: float) -> Turbine:
    """The turbine with another yaw drive [rad/s]."""
    return turbine.replace(**{"yaw.rate": rate})


YAW_CONTROLS = {1.0: YawControl(average_time=1.0, start_time=0.0), 10.0: YawControl(average_time=10.0, start_time=0.0)}
YAW_CONTROLS |= {YawControl().average_time: YawControl()}
"""By averaging time [s]: two that start as soon as the averaged error leaves the dead band, and the default."""
SUPERVISION = Supervision(over_speed=1.25, trip_speed=1.3, normal_rate=0.1)
"""Speed limits wide enough for the strategies to act alone: at 60 degrees of yaw error the speed swings by up to 17 %.
Stops pitch at 0.1 rad/s, 5.7 deg/s: the paper gives no rate, the scaled actuator has 6.5 deg/s."""


def strategy(turbine: Turbine, protection: YawProtection, yaw: YawControl | None = None) -> Controller:
    """Supervisor with yaw control and a strategy of yaw protection."""
    return SupervisedController(turbine, SUPERVISION, yaw=yaw or YawControl(), protection=protection)
