"""Grids sized by the turbine."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import meltemi
from meltemi import InputError, Turbine
from meltemi.wind import WindGrid, wind_grid_for


@given(points=st.integers(5, 61), tower=st.booleans(), width=st.floats(126.0, 400.0))
def test_a_grid_covers_rotor_and_tower_and_has_a_point_at_the_hub(points: int, tower: bool, width: float) -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    grid = wind_grid_for(turbine, points, width=width, tower=tower)
    hub, radius = turbine.hub_height, turbine.rotor_radius
    assert grid.width == pytest.approx(width)
    assert grid.bottom <= hub - radius
    assert grid.top >= hub + 0.5 * width - 1e-9
    row, column = grid.hub
    assert grid.z[row] == pytest.approx(hub, abs=1e-9)
    assert points % 2 == 0 or grid.y[column] == pytest.approx(0.0, abs=1e-9)
    if tower:
        assert grid.bottom == pytest.approx(0.02 * hub)
        assert grid.dz == pytest.approx(grid.dy, rel=0.5)  # as near as a whole number of rows allows


def test_the_default_is_a_fifth_wider_than_the_rotor(turbine: Turbine) -> None:
    grid = wind_grid_for(turbine)
    assert (grid.points_y, grid.points_z) == (25, 27)
    assert grid.width == pytest.approx(1.2 * turbine.rotor_diameter)
    assert grid.dy == pytest.approx(6.3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": 2}, "at least 3"),
        ({"points": 10.5}, "whole number"),
        ({"width": 100.0}, "it is 100 m wide, the rotor needs 126.0 m"),
        ({"width": float("nan")}, "the rotor needs"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(turbine: Turbine, arguments: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        wind_grid_for(turbine, **arguments)  # type: ignore[arg-type]


def test_a_rotor_near_the_ground_is_refused(turbine: Turbine) -> None:
    low = turbine.replace(**{"tower.base_height": -26.0})
    with pytest.raises(InputError, match="the rotor reaches down to"):
        wind_grid_for(low)


def test_the_hub_must_be_inside() -> None:
    with pytest.raises(InputError, match="hub_height 90 m lies outside the grid, which reaches from 10 m to 60 m"):
        WindGrid(points_y=3, points_z=6, dy=10.0, dz=10.0, bottom=10.0, hub_height=90.0)
