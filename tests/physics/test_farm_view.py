"""A farm in the three-dimensional view: turbines at their places, and rings where the wakes are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi.farm.settings import WakeSettings
from meltemi.farm.simulation import FarmResult
from meltemi.postprocess.formats import write_result

D = 126.0
pytestmark = pytest.mark.slow  # kernels with the wind of wakes


@pytest.fixture(scope="module")
def seen() -> FarmResult:
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), meltemi.ModelOptions(blade_nodes=8, tower_nodes=5))
    farm = meltemi.Farm(model, [(0.0, 0.0), (5.0 * D, 20.0)], WakeSettings(added_turbulence=False))
    channels = ("generator_power", "wind_x")
    return meltemi.simulate_farm(farm, 9.0, duration=12.0, channels=channels, view=True)


def test_rings_are_where_the_wakes_are(seen: FarmResult) -> None:
    first, second = (result.scene for result in seen.turbines)
    assert first is not None and second is not None
    assert (first.about["place"], second.about["place"]) == ([0.0, 0.0], [5.0 * D, 20.0])
    about, track = first.about["wakes"], first.track("wakes")
    rings = track.reshape(len(track), about["count"], about["stations"], 5)
    at = round(3.0 * D / about["spacing"]) - 1
    assert rings[:, 0, at, :3] == pytest.approx(seen.wake(0).centre(3.0 * D), abs=0.1)
    deficit, radius = rings[-1, 0, at, 3:]
    # between that at the centre and none; the top hat is somewhat wider than the rotor, and widens
    assert 3.0 < deficit < 5.5 and 0.5 * D < radius < 0.7 * D
    assert rings[-1, 0, at + 4, 4] > radius > rings[-1, 0, 0, 4]
    assert "wakes" not in second.about
    low = np.array(first.about["farm"]["centre"]) - first.about["farm"]["half"]
    assert (low <= 0.0).all()


def test_a_page_has_all_turbines_and_a_folder_is_viewed_as_a_farm(seen: FarmResult, tmp_path: Path) -> None:
    page = meltemi.plots.view({f"T{i + 1}": each for i, each in enumerate(seen.turbines)}).html
    assert "class WakeRings" in page and 'id="scene-2"' in page
    for i, each in enumerate(seen.turbines):
        write_result(each, tmp_path / f"turbine_{i + 1}.nc")
    from meltemi.view.commands.view import view

    view([tmp_path], tmp_path / "farm.html")
    text = (tmp_path / "farm.html").read_text()
    assert 'id="scene-2"' in text and "turbine_2" in text


def test_more_than_two_results_are_a_farm_or_refused(seen: FarmResult) -> None:
    import dataclasses

    plain = [dataclasses.replace(each, scene=None) for each in (*seen.turbines, seen[0])]
    with pytest.raises(meltemi.InputError, match="motion of the turbine is not recorded|one or two results"):
        meltemi.plots.view({str(i): each for i, each in enumerate(plain)})
