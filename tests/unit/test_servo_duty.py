"""Duty of a servo that oscillates and rests."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest

from meltemi.core.errors import Status
from meltemi.simulation.channels import catalogue
from meltemi.simulation.result import Result
from meltemi.studies.servo_duty import YEAR, servo_duty


def test_duty_of_a_triangle_and_a_rest() -> None:
    """Ten triangles of 2 degrees within 100 s, then 100 s of rest."""
    time = np.arange(0.0, 200.0 + 1e-9, 0.05)
    triangle = radians(1.0) * (1.0 - np.abs(2.0 * ((time / 10.0) % 1.0) - 1.0)) * 2.0
    angle = np.where(time <= 100.0, triangle, 0.0)
    run = Result(time, angle[:, None], (catalogue()["pitch_1"],), Status.OK, "", {})
    duty = servo_duty(run)
    assert duty.travel == pytest.approx(radians(2.0) * 20.0 / 200.0, rel=1e-6)
    assert duty.revolutions == pytest.approx(duty.travel * YEAR / (2.0 * pi))
    assert duty.moving == pytest.approx(0.5, abs=0.01)
    assert duty.starts * 200.0 <= 1.0  # it turns back without a rest
    assert duty.oscillation == pytest.approx(radians(2.0) * (10.0 / 200.0) ** (1.0 / 3.0), rel=0.05)
    assert servo_duty(run, moves=radians(1.0)).moving == 0.0
