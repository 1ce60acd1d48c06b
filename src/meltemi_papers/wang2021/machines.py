"""The paper's two turbines under its strategies."""

from __future__ import annotations

from typing import Final

from meltemi.control.controller import Controller
from meltemi.control.supervisor.settings import Supervision
from meltemi.control.supervisor.supervised import SupervisedController
from meltemi.control.supervisor.threshold import YawProtection
from meltemi.control.yaw import YawControl
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine

MEASURED: Final = "zr20-122"
STUDIED: Final = "ct30-155"
"""Of the library: that of the measurements, and that of the strategies."""
LIMITED = 2.0e6
"""[W] to which the paper derates."""


def measured_turbine() -> Turbine:
    """ZR2.0-122."""
    return load_turbine(MEASURED)


def studied_turbine(yaw_rate: float) -> Turbine:
    """CT3.0-155 with a yaw rate [rad/s]."""
    return with_yaw_rate(load_turbine(STUDIED), yaw_rate)


def with_yaw_rate(turbine: Turbine, rate: float) -> Turbine:
    """The turbine with another yaw drive [rad/s]."""
    return turbine.replace(**{"yaw.rate": rate})


def prompt_yaw() -> YawControl:
    """Yaw control that starts as soon as the filtered yaw error leaves the dead band."""
    return YawControl(average_time=1.0, start_time=0.0)


SUPERVISION = Supervision(over_speed=1.25, trip_speed=1.3, normal_rate=0.1)
"""Speed limits wide enough for the strategies to act alone: at 60 degrees of yaw error the speed swings by up to 17 %.
Stops pitch at 0.1 rad/s, 5.7 deg/s: the paper gives no rate, the scaled actuator has 6.5 deg/s."""


def strategy(turbine: Turbine, protection: YawProtection, yaw: YawControl | None = None) -> Controller:
    """Supervisor with yaw control and a strategy of yaw protection."""
    return SupervisedController(turbine, SUPERVISION, yaw=yaw or YawControl(), protection=protection)
