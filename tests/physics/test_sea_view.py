"""The sea in the three-dimensional view: at the tower, its surface is the recorded elevation of the run."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi.simulation.result import Result
from meltemi.view.sea_surface import ERROR, POINTS, with_sea

pytestmark = pytest.mark.slow


def result(name: str, **more: object) -> Result:
    return meltemi.simulate(
        meltemi.build(meltemi.load_turbine(name)), meltemi.SteadyWind(speed=10.0), duration=12.0, view=True, **more
    )


def test_the_surface_at_the_tower_is_the_elevation_of_the_run() -> None:
    sea = meltemi.environment.IrregularSea(height=4.0, period=9.0, seed=2)
    run = result("nrel5mw-monopile", sea=sea, channels=("wave_elevation", "rotor_speed"))
    assert run.scene is not None
    scene = with_sea(run.scene, run)
    water, surface = scene.about["turbine"]["water"], scene.track("sea")[:, 0, :, 0]
    assert not water["floats"] and water["depth"] == 20.0 and water["members"][0][5] > water["members"][0][2]
    time = np.arange(len(surface)) * scene.about["steps"]["sea"]
    middle = np.interp(run.time, time, surface[:, POINTS // 2])
    assert np.abs(middle - run["wave_elevation"]).max() < 2.0 * ERROR  # of which half by interpolation in time
    assert np.ptp(surface[0]) > 1.0
    page = meltemi.plots.view(run).html
    assert "class SeaView" in page and "class Underwater" in page


def test_a_turbine_on_land_has_no_water() -> None:
    run = result("nrel5mw")
    assert run.scene is not None
    assert with_sea(run.scene, run) is run.scene


def test_a_platform_is_drawn_with_its_lines() -> None:
    pytest.importorskip("windIO")
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    drawn = platform.view_shape()
    assert drawn["floats"] and len(drawn["members"]) == 10
    for line, points in zip(platform.lines, drawn["lines"], strict=True):
        at = np.array(points)
        assert at[0] == pytest.approx(line.fairlead, abs=0.01) and at[-1] == pytest.approx(line.anchor, abs=0.01)
        assert at[:, 2].min() == pytest.approx(-200.0, abs=0.01)  # it lies on the sea bed
        length = np.linalg.norm(np.diff(at, axis=0), axis=1).sum()
        assert length == pytest.approx(line.length, rel=2e-3)
