"""Moments of gravity by which gauges are calibrated are those of the simulated turbine at rest in vacuum."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import Turbine
from meltemi.simulation.case import Case
from meltemi.validation.gauges import root_moments, tower_moments

RIGID = dict.fromkeys(("flap_modes", "edge_modes", "torsion_modes", "fore_aft_modes", "side_side_modes"), 0)


@pytest.mark.parametrize(("azimuth", "pitch", "yaw"), [(0.9, 0.2, 0.0), (2.5, 1.5, 0.0), (4.4, -0.1, 0.7)])
def test_moments_of_a_rigid_turbine(turbine: Turbine, azimuth: float, pitch: float, yaw: float) -> None:
    thin = meltemi.Environment(air_density=1e-9)
    case = Case(meltemi.build(turbine, meltemi.ModelOptions(**RIGID), environment=thin), meltemi.SteadyWind(speed=0.1))
    coordinates = case.model.coordinates
    case["q"][coordinates.index("generator")], case["q"][coordinates.index("yaw")] = azimuth, yaw
    case.system.pitch.angle[:] = pitch
    case.evaluate(0.0)
    case["a"][:] = 0.0  # held at rest
    case.loads(0.0)
    root, tower, of_blades = case.view("root"), case.view("tower_station"), azimuth + 2.0 * np.pi * np.arange(3) / 3.0
    theirs = np.stack([root["pitched_moment_y"], root["pitched_moment_x"]], axis=1)
    size = np.abs(theirs).max()
    assert root_moments(turbine, of_blades, np.full(3, pitch)) == pytest.approx(theirs, abs=1e-5 * size)
    at_base = [np.ravel(tower[f"moment_{axis}"])[0] for axis in "yx"]
    assert tower_moments(turbine, np.array(yaw)) == pytest.approx(at_base, rel=1e-3, abs=1.0)
