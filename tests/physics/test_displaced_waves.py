"""Waves push a platform at its place and heading, where that is asked for (W-39)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import meltemi
from meltemi.core.errors import InputError
from meltemi.floating.coefficients import read_coefficients
from meltemi.floating.waves import HEADINGS, displaced_forces

Place = tuple[float, float]
SEA = meltemi.environment.ComponentSea(
    frequency=[0.5, 0.9, 0.7], amplitude=[1.0, 0.5, 0.7], phase=[0.3, 1.0, 2.0], direction=[0.4, 0.4, -1.0]
)
ORIGIN, MOVED = (0.0, 0.0), (12.0, -7.0)


@pytest.fixture(scope="module")
def models() -> dict[str, Any]:
    turbine = meltemi.load_turbine("iea15mw-volturnus").replace(**{"platform.drift": "none"})
    return {name: meltemi.build(turbine.replace(**{"platform.excitation": name})) for name in ("at_rest", "displaced")}


def forces(model: Any, sea: Any, place: Place = ORIGIN, yaw: float = 0.0, origin: Place = ORIGIN) -> Any:
    """(T, 6) loads of waves on a platform that is held at a place and a heading."""
    found = []
    for water in (sea, meltemi.environment.StillWater()):
        run = meltemi.Run(
            model=model, wind=meltemi.SteadyWind(speed=8.0), duration=60.0, sea=water, origin=origin,
            start=meltemi.Start(rotor_speed=0.5),
        )  # fmt: skip
        case = meltemi.Simulation(run).case
        first = int(case.plain.top_shape.modes) - 6
        case["q"][first : first + 6] = [*place, 0.0, 0.0, 0.0, yaw]
        case["v"][first : first + 6] = 0.0
        found.append([])
        for t in np.linspace(0.0, 50.0, 12):
            case.evaluate(float(t))
            found[-1].append(np.array(case["base_six"][1]))
    return np.subtract(*found)


@pytest.mark.slow
def test_a_displaced_platform_is_pushed_as_one_that_stands_there(models: dict[str, Any]) -> None:
    found, expected = forces(models["displaced"], SEA, MOVED), forces(models["at_rest"], SEA, MOVED, origin=MOVED)
    fixed, scale = forces(models["at_rest"], SEA, MOVED), np.abs(expected).max(axis=0)
    assert np.all(np.abs(found - expected) < 1e-3 * scale)  # of the cubic between samples over time
    assert np.all(np.abs(fixed - expected).max(axis=0) > 0.1 * scale)


@pytest.mark.slow
def test_a_platform_that_yaws_turns_into_the_waves(models: dict[str, Any]) -> None:
    """It is pushed as one at rest by waves from elsewhere; between headings the force is linear."""
    yaw = math.radians(20.0)
    turned = SEA.replace(direction=[x + yaw for x in (0.4, 0.4, -1.0)])  # directions count clockwise
    found, own = forces(models["displaced"], SEA, yaw=yaw), forces(models["displaced"], turned)
    R = Rotation.from_euler("z", yaw).as_matrix()
    expected = np.concatenate([own[:, :3] @ R.T, own[:, 3:] @ R.T], axis=1)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    half = forces(models["displaced"], SEA, yaw=yaw + math.pi / HEADINGS)
    next_one = forces(models["displaced"], SEA, yaw=yaw + 2.0 * math.pi / HEADINGS)
    assert np.abs(half - 0.5 * (found + next_one)).max() < 0.02 * np.abs(found).max()
    assert np.abs(half - found).max() > 0.03 * np.abs(found).max()


def test_all_headings_are_needed() -> None:
    platform, c = meltemi.load_turbine("iea15mw-volturnus").platform, read_coefficients("iea15mw-volturnus")
    few = replace(c, heading=c.heading[12:25], excitation=c.excitation[:, 12:25])
    lines, force = displaced_forces(SEA, c, platform, 60.0, ORIGIN, 9.81)
    assert lines.shape == (3, 3) and force.shape == (HEADINGS, 3, 12)
    with pytest.raises(InputError, match="displaced needs coefficients of all headings.*have -60 to 60 deg"):
        displaced_forces(SEA, few, platform, 60.0, ORIGIN, 9.81)
