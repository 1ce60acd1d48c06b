"""Farms: turbines in each other's wakes (docs/theory/wakes.md, K-15)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.farm.layout import FarmCase
from meltemi.farm.report import FORE_AFT, SIDE_SIDE, along_wind
from meltemi.farm.settings import WakeSettings
from meltemi.farm.simulation import FarmResult, SetPoint, begin_at
from meltemi.simulation.operating_point import OperatingPoint

D = 126.0
CHANNELS = ("generator_power", "wind_x", "root_moment_out_of_plane_1")
ROW = [(0.0, 0.0), (5.0 * D, 0.0)]
PAIR = r"positions: turbine 1: expected two numbers, x and y in m, such as \[630, 0\], found "

pytestmark = pytest.mark.slow  # kernels with the wind of wakes


@pytest.fixture(scope="module")
def model() -> Any:
    return meltemi.build(meltemi.load_turbine("nrel5mw"), meltemi.ModelOptions(blade_nodes=8, tower_nodes=5))


@pytest.fixture(scope="module")
def row(model: Any) -> FarmResult:
    settings = WakeSettings(added_turbulence=False)
    return meltemi.simulate_farm(meltemi.Farm(model, ROW, settings), 9.0, duration=20.0, channels=CHANNELS)


def test_without_wakes_each_turbine_has_the_bits_of_one_alone(model: Any) -> None:
    wind = meltemi.TurbulentWind(speed=9.0, intensity=0.1, points=5, dt=0.5, periodic=True, coherent="all")
    box = meltemi.wind.generate_field(wind, meltemi.wind.wind_grid_for(model.turbine, 9, width=4.0 * D), 200.0)
    result = meltemi.simulate_farm(meltemi.Farm(model, ROW, "none"), box, duration=10.0, channels=CHANNELS)
    assert not result.wakes
    for (x, y), found in zip(ROW, result.turbines, strict=True):
        alone = meltemi.simulate(model, box, duration=10.0, channels=CHANNELS, origin=(x, y))
        assert np.array_equal(alone.data, found.data)
    assert not np.array_equal(result[0].data, result[1].data)


def test_a_wake_costs_power_and_the_turbine_starts_in_it(row: FarmResult) -> None:
    first, second = (each["generator_power"] for each in row.turbines)
    assert second.mean() < 0.6 * first.mean()
    assert second.std() < 0.05 * first.mean()
    assert first.std() < 0.01 * first.mean()


def test_the_first_turbine_is_as_alone(row: FarmResult, model: Any) -> None:
    alone = meltemi.simulate(model, 9.0, duration=20.0, channels=CHANNELS)
    assert np.allclose(row[0].data, alone.data, rtol=1e-9)


def test_tilt_lifts_the_wake(row: FarmResult) -> None:
    centre = row.wake(0).centre(5.0 * D)[-1]
    assert centre[0] == pytest.approx(5.0 * D, abs=5.0)
    assert abs(centre[1]) < 3.0
    assert centre[2] - 90.0 == pytest.approx(24.0, abs=4.0)


def test_a_farm_controller_turns_the_first_turbine_at_the_rate_of_its_drive() -> None:
    options = meltemi.ModelOptions(blade_nodes=8, tower_nodes=5, yaw="driven")
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), options)
    called: list[float] = []

    def control(time: float, measured: Any) -> list[SetPoint]:
        called.append(time)
        assert measured[0]["generator_speed"] > 0.0
        return [SetPoint(yaw=np.radians(2.0)), SetPoint()]

    farm = meltemi.Farm(model, ROW, "none")
    result = meltemi.simulate_farm(farm, 9.0, duration=16.0, channels=("nacelle_yaw",), control=control)
    assert called == pytest.approx(np.arange(len(called)) * 2.0, abs=0.1)
    turned, still = (each["nacelle_yaw"] for each in result.turbines)
    assert np.degrees(turned[-1]) == pytest.approx(2.0, abs=0.05)
    rate = model.turbine.yaw.rate
    assert turned[40] == pytest.approx(2.0 * rate, rel=0.2)
    assert np.abs(still).max() < 1e-3


def test_set_points_are_checked(model: Any) -> None:
    for points, words in (
        ([SetPoint()], "expected a list of 2 SetPoint"),
        (None, "returned None, expected a list of 2 SetPoint"),
        ([0.1, 0.2], r"returned \[0.1, 0.2\], expected a list of 2 SetPoint"),
        ([SetPoint(yaw=0.1)] * 2, 'yaw="driven"'),
        ([SetPoint(power=-1.0)] * 2, "0 W or more"),
        ([SetPoint(pitch=1.0)] * 2, "pitch must be within"),
    ):
        with pytest.raises(meltemi.InputError, match=words):
            meltemi.simulate_farm(
                meltemi.Farm(model, ROW, "none"), 9.0, duration=1.0, control=lambda t, m, points=points: points
            )


def test_close_turbines_are_refused_with_their_distance(model: Any) -> None:
    with pytest.raises(meltemi.InputError, match=r"turbines 1 and 2 are 200 m apart, expected at least 252 m"):
        meltemi.simulate_farm(meltemi.Farm(model, [(0.0, 0.0), (200.0, 0.0)]), 9.0, duration=1.0)


def test_a_small_field_is_refused_with_the_size_that_is_needed(model: Any) -> None:
    wind = meltemi.TurbulentWind(speed=9.0, intensity=0.1, points=5, dt=0.5)
    box = meltemi.wind.generate_field(wind, model.turbine, 60.0)
    aside = meltemi.Farm(model, [(0.0, 0.0), (0.0, 400.0)])
    with pytest.raises(meltemi.InputError, match=r"the farm needs 926 m"):
        meltemi.simulate_farm(aside, box, duration=10.0)
    behind = meltemi.Farm(model, [(0.0, 0.0), (630.0, 0.0)])
    with pytest.raises(meltemi.InputError, match=r"begins .* m downwind of its origin, .* 630 m"):
        meltemi.simulate_farm(behind, box, duration=10.0)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_wakes_in_calm_air_are_refused(model: Any, speed: float) -> None:
    """They would not leave their rotors, and take any number of planes; without wakes the farm runs."""
    with pytest.raises(meltemi.InputError, match=f"1 m/s or more, found {speed:g} m/s"):
        meltemi.simulate_farm(meltemi.Farm(model, ROW), speed, duration=1.0)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"positions": []}, "positions: expected 1 to 200 turbines, found 0"),
        ({"positions": [[0.0, 0.0, 5.0], [630.0, 0.0]]}, PAIR + r"\[0.0, 0.0, 5.0\]"),
        ({"positions": [0.0, 630.0]}, PAIR + "0.0"),
        ({"yaw": [0.0]}, "yaw: expected an angle for each of 2 turbines, found 1"),
        ({"wakes": {"model": "fastfarm"}}, "fast.farm"),
        ({"wakes": {"merging": "square"}}, "quadratic"),
        ({"positions": [[0.0, 0.0], [1e9, 0.0]]}, "within 100000 m"),
        ({"positions": [[1e3 * i, 0.0] for i in range(201)]}, "expected 1 to 200 turbines, found 201"),
        ({"yaw": [20.0, 0.0]}, r"1146 deg \(20 rad\), expected within 60 deg"),
    ],
)
def test_files_with_mistakes_are_refused_in_words(keys: dict[str, Any], words: str) -> None:
    data = {"turbine": "nrel5mw", "positions": ROW, "wind": {"kind": "steady", "speed": 9.0}, "duration": 10.0}
    with pytest.raises(meltemi.InputError, match=words):
        FarmCase(**(data | keys))


@pytest.mark.parametrize(
    ("farm", "words"),
    [
        ({"wakes": "frandsen"}, "fast.farm"),
        ({"yaw": [0.1]}, "yaw: expected an angle for each of 2 turbines, found 1"),
        ({"yaw": []}, "yaw: expected an angle for each of 2 turbines, found 0"),
        ({"yaw": ["20 deg", 0.0]}, r"farm: yaw \[rad\]: could not convert"),
        ({"turbine": ["nrel5mw"]}, "a turbine for each of 2 positions"),
        ({"positions": [(0.0, 0.0, 5.0), (630.0, 0.0)]}, PAIR + r"\(0.0, 0.0, 5.0\)"),
        ({"positions": [0.0, 630.0]}, PAIR + "0.0"),
        ({"positions": []}, "positions: expected 1 to 200 turbines, found 0"),
    ],
)
def test_farms_with_mistakes_are_refused_in_words(farm: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"turbine": "nrel5mw", "positions": ROW} | farm
    with pytest.raises(meltemi.InputError, match=words):
        meltemi.simulate_farm(meltemi.Farm(**given), 9.0, duration=1.0)


@pytest.mark.parametrize("threads", [-1, 0, 1.5])
def test_a_number_of_threads_below_one_is_refused(model: Any, threads: Any) -> None:
    with pytest.raises(meltemi.InputError, match=f"threads: expected an integer of 1 or more.*, found {threads}"):
        meltemi.simulate_farm(meltemi.Farm(model, ROW), 9.0, duration=1.0, threads=threads)


def test_runs_import_no_wakes() -> None:
    import subprocess
    import sys

    code = "import sys, meltemi; meltemi.simulate; print([m for m in sys.modules if m.startswith('meltemi.farm')])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_an_offset_of_the_pitch_derates_one_turbine_and_strengthens_the_wind_behind_it(model: Any) -> None:
    settings = WakeSettings(added_turbulence=False)
    farm = meltemi.Farm(model, [(0.0, 0.0), (3.0 * D, 0.0)], settings)
    found = {}
    for pitch in (0.0, 0.06):
        points = [SetPoint(pitch=pitch), SetPoint()]
        found[pitch] = meltemi.simulate_farm(
            farm, 9.0, duration=80.0, channels=("generator_power", "pitch_1"), control=lambda t, m, p=points: p
        )
    plain, derated = found.values()
    assert (derated[0]["pitch_1"] - plain[0]["pitch_1"])[-1] == pytest.approx(0.06, abs=1e-3)
    assert np.abs(derated[1]["pitch_1"] - plain[1]["pitch_1"]).max() < 0.01
    assert derated[0]["generator_power"][-1] < 0.95 * plain[0]["generator_power"][-1]
    assert derated[1]["generator_power"][-1] > 1.02 * plain[1]["generator_power"][-1]


@pytest.mark.slow
def test_wakes_follow_a_turning_wind(model: Any) -> None:
    wind = meltemi.wind.WindSeries(time=[0.0, 60.0, 200.0], speed=[9.0] * 3, direction=[0.0, 0.0, np.radians(10.0)])
    farm = meltemi.Farm(model, [(0.0, 0.0), (7.0 * D, 0.0)], WakeSettings(added_turbulence=False))
    result = meltemi.simulate_farm(farm, wind, duration=400.0, channels=("generator_power",))
    aside = result.wake(0).centre(5.0 * D)[:, 1]
    assert np.abs(aside[:30]).max() < 1.0
    # the nacelle stays, so that the wake is deflected by 10 deg of yaw error, too: some 0.2 D
    assert aside[-1] == pytest.approx(-np.tan(np.radians(10.0)) * 5.0 * D - 0.2 * D, abs=0.05 * D)
    power = result[1]["generator_power"]
    assert power[-1] > 1.9 * power[0]


@pytest.mark.parametrize("turn", [60.0, 250.0])
def test_a_farm_that_turns_with_its_wind_is_the_same_farm(model: Any, turn: float) -> None:
    """Nacelles follow the direction, yaw is from it: power, wakes and the loads along the wind do not change."""
    yaw, angle = np.radians([20.0, 0.0]), np.radians(turn)
    channels = ("generator_power", "wind_x", "wind_y", FORE_AFT, SIDE_SIDE, "nacelle_yaw")
    settings = WakeSettings(added_turbulence=False)
    found = []
    for direction in (0.0, angle):
        c, s = np.cos(direction), np.sin(direction)
        places = [(float(x * c + y * s), float(y * c - x * s)) for x, y in ((0.0, 0.0), (5.0 * D, 60.0))]
        wind = meltemi.SteadyWind(speed=9.0, direction=direction)
        farm = meltemi.Farm(model, places, settings, yaw=list(yaw))
        found.append(meltemi.simulate_farm(farm, wind, duration=12.0, channels=channels))
    straight, turned = found
    assert turned.direction == angle
    assert np.array_equal(turned.yaw, yaw)
    for i in range(2):
        one, other = straight[i], along_wind(turned[i], turned.direction)
        for name, share in (("generator_power", 1e-3), ("wind_x", 1e-5), (FORE_AFT, 2e-3)):
            assert other[name].mean() == pytest.approx(one[name].mean(), rel=share)
        nacelle = np.remainder(other["nacelle_yaw"] + angle - one["nacelle_yaw"] + 1.0, 2.0 * np.pi) - 1.0
        assert np.abs(nacelle).max() < 1e-4
    way = straight.wake(0).centre(4.0 * D)[-1], turned.wake(0).centre(4.0 * D)[-1]
    assert way[1][0] * np.sin(angle) + way[1][1] * np.cos(angle) == pytest.approx(way[0][1], abs=0.5)
    assert way[0][1] < -10.0  # the nacelle turned counter-clockwise sends its wake to the right


def test_set_points_and_measurements_are_from_the_wind(model: Any) -> None:
    options = model.options.replace(yaw="driven")
    driven = meltemi.build(model.turbine, options)
    seen: list[Any] = []

    def control(time: float, measured: Any) -> list[SetPoint]:
        seen.append((measured[0]["yaw"], measured[0]["wind_direction"]))
        return [SetPoint(yaw=np.radians(1.0))]

    wind = meltemi.SteadyWind(speed=9.0, direction=np.radians(200.0))
    farm = meltemi.Farm(driven, [(0.0, 0.0)], "none")
    result = meltemi.simulate_farm(farm, wind, duration=8.0, channels=("nacelle_yaw",), control=control)
    assert seen[0] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert np.degrees(seen[-1][0]) == pytest.approx(1.0, abs=0.05)
    assert np.degrees(result[0]["nacelle_yaw"][-1]) == pytest.approx(161.0, abs=0.1)


def test_a_point_of_a_nacelle_at_rest_is_turned_to_the_wind(model: Any) -> None:
    point = meltemi.operating_point(model, 9.0)
    turned = meltemi.build(model.turbine, model.options.replace(nacelle_yaw=-0.5))
    found = begin_at(lambda: point, turned)
    assert isinstance(found, OperatingPoint) and begin_at(point, model) is point
    yaw = model.coordinates.index("yaw")
    assert found.q[yaw] - point.q[yaw] == pytest.approx(-0.5)
    assert found.revolution[:, yaw] - point.revolution[:, yaw] == pytest.approx(-0.5)
    with pytest.raises(meltemi.InputError, match="options.nacelle_yaw: turbines of a farm face the wind"):
        meltemi.simulate_farm(meltemi.Farm(turned, ROW), 9.0, duration=1.0)
