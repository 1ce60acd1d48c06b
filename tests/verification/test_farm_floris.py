"""A row of three in uniform wind beside the steady models of FLORIS (docs/verification/farm.md)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.farm.sets import SETS
from meltemi.farm.settings import WakeSettings

pytestmark = [pytest.mark.reference, pytest.mark.long]
D, SPEED = 126.0, 9.0
PLACES = [(0.0, 0.0), (5.0 * D, 0.0), (10.0 * D, 0.0)]
MODELS = {"gauss": "crespo_hernandez", "cc": "crespo_hernandez", "jensen": "none"}
"""Velocity models of FLORIS, and the turbulence that wakes add in them."""


def of_floris(velocity: str, intensity: float) -> NDArray[np.float64]:
    """Power of three turbines in line over that of the first one."""
    floris = pytest.importorskip("floris")
    given = floris.FlorisModel("defaults").core.as_dict()
    given["wake"]["model_strings"].update(velocity_model=velocity, turbulence_model=MODELS[velocity])
    model = floris.FlorisModel(given)
    x, y = np.array(PLACES).T
    wind = {"wind_directions": [270.0], "wind_speeds": [SPEED], "turbulence_intensities": [intensity]}
    model.set(layout_x=x, layout_y=y, **{name: np.array(values) for name, values in wind.items()})
    model.run()
    power = np.asarray(model.get_turbine_powers()[0], dtype=np.float64)
    return power / power[0]


def of_ours(wakes: str, intensity: float) -> NDArray[np.float64]:
    settings = WakeSettings(model=wakes, intensity=intensity, added_turbulence=False)  # type: ignore[arg-type]
    farm: Any = meltemi.Farm("nrel5mw", PLACES, settings)
    result = meltemi.simulate_farm(farm, SPEED, duration=200.0, transient=150.0, channels=("generator_power",))
    power = np.array([turbine["generator_power"].mean() for turbine in result.turbines])
    return power / power[0]


@pytest.mark.parametrize("intensity", [0.06, 0.1])
def test_a_row_of_three_costs_what_steady_models_say(intensity: float) -> None:
    """`fast.farm` is within what the models of FLORIS span, and every set within 0.1 of it."""
    spread = np.array([of_floris(model, intensity) for model in MODELS])
    found = np.array([of_ours(wakes, intensity) for wakes in SETS])
    low, high = spread.min(axis=0), spread.max(axis=0)
    assert np.all((low <= found[0]) & (found[0] <= high)), (found[0], low, high)
    assert np.all((low - 0.1 < found) & (found < high + 0.1))
