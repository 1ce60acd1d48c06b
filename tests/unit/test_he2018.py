"""Parts of the reproduction of He et al. (2018) that need no run."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.analysis import preview_of
from meltemi.wind.fields import WindBox
from meltemi_papers.he2018.claims import flap_slopes, share_at, thin_airfoil
from meltemi_papers.he2018.designs import LIDARS, Lidar, measured


def test_a_flap_as_long_as_the_chord_has_the_lift_of_the_airfoil() -> None:
    assert thin_airfoil(1.0) == pytest.approx((2.0 * pi, 0.0))
    lift, moment = thin_airfoil(0.1)
    assert (lift * pi / 180.0, moment * pi / 180.0) == pytest.approx((0.0434, -0.0094), abs=5e-5)


def test_increments_of_the_flap_are_a_little_below_thin_airfoil_theory() -> None:
    for found, ideal in zip(flap_slopes(), thin_airfoil(0.1), strict=True):
        assert 0.8 < found / ideal < 1.0


def test_the_share_of_a_tone() -> None:
    time = np.arange(0.0, 100.0, 0.05)
    x = 3.0 + 2.0 * np.sin(2.0 * pi * 0.2 * time) + np.sin(2.0 * pi * time)
    assert share_at(x, time, 0.2) == pytest.approx(0.8)


def test_the_errors_of_a_lidar_act_as_they_say() -> None:
    turbine = meltemi.turbine.load_turbine("nrel5mw")
    model, rng = meltemi.build(turbine), np.random.default_rng(3)
    velocity = np.zeros((6400, 11, 11, 3))
    gusts = rng.normal(0.0, 1.0, (1280, 1, 1)) + rng.normal(0.0, 1.0, (1280, 11, 11))
    velocity[..., 0] = 20.0 + np.repeat(gusts, 5, axis=0)
    box = WindBox(velocity, dt=0.1, dy=15.0, dz=15.0, bottom=15.0, speed=20.0, periodic=True)
    ideal = preview_of(model, box, (4.0, np.zeros(40))).wind
    np.testing.assert_array_equal(measured(box, model, Lidar()), ideal)
    beams = measured(box, model, LIDARS["4 beams"])
    assert np.std(beams - ideal) == pytest.approx(0.5, rel=0.15)  # of the mean of four points
    evolved = measured(box, model, LIDARS["evolving turbulence"])
    assert np.std(evolved) == pytest.approx(np.std(ideal), rel=0.1)
    coherence = [abs(np.corrcoef(low_passed(evolved, n), low_passed(ideal, n))[0, 1]) for n in (1, 400)]
    assert coherence[0] < 0.3 < 0.8 < coherence[1]
    held = measured(box, model, LIDARS["30 % lost"])
    assert np.mean(np.abs(held - ideal) > 1e-9) == pytest.approx(0.3, abs=0.08)


def low_passed(x: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    return np.convolve(x - x.mean(), np.ones(length) / length, "valid")
