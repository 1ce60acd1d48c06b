"""Density of the air against the numbers of Palanimuthu et al. (2022), to every digit, and the weather of a year."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Environment, InputError
from meltemi.electrical.system import nominal_frequency
from meltemi.environment import Air, Climate, PowerGrid, TimeSeries, air_density, load_climate
from meltemi.environment.air import site_pressure, vapour_pressure
from meltemi.environment.conditions import Conditions, conditions_now
from meltemi.environment.course import conditions_array
from meltemi.environment.gases import R_DRY, R_VAPOUR
from meltemi.studies.climate.climates import MONTH_HOURS

TIME, AIR_DENSITY, AIR_TEMPERATURE, GRID_FREQUENCY = (
    Conditions.index(name) for name in ("time", "air_density", "air_temperature", "grid_frequency")
)
HUMIDITY = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
AT_SEA_LEVEL = {
    -10: "1.3414 1.3411 1.3408 1.3405 1.3402 1.3399",
    0: "1.2922 1.2917 1.2911 1.2905 1.2899 1.2893",
    15: "1.2250 1.2234 1.2219 1.2203 1.2187 1.2172",
    20: "1.2041 1.2020 1.1999 1.1978 1.1957 1.1936",
    35: "1.1455 1.1407 1.1359 1.1311 1.1263 1.1214",
    40: "1.1272 1.1210 1.1148 1.1086 1.1024 1.0962",
}
"""At 0, 20, ..., 100 % of humidity."""
ALTITUDE = np.array([0.0, 500.0, 1000.0, 1500.0, 2000.0])
HIGHER_UP = {
    -10: "1.3408 1.2565 1.1775 1.1034 1.0340",
    0: "1.2911 1.2127 1.1391 1.0700 1.0051",
    15: "1.2219 1.1514 1.0849 1.0223 0.9633",
    25: "1.1783 1.1124 1.0501 0.9913 0.9358",
    35: "1.1359 1.0741 1.0157 0.9604 0.9081",
}
"""At 40 % of humidity."""


@pytest.mark.parametrize("temperature", AT_SEA_LEVEL)
def test_humidity_to_the_printed_digits(temperature: int) -> None:
    found = air_density(temperature, HUMIDITY)
    assert " ".join(f"{rho:.4f}" for rho in found) == AT_SEA_LEVEL[temperature]


@pytest.mark.parametrize("temperature", HIGHER_UP)
def test_altitude_to_the_printed_digits(temperature: int) -> None:
    found = air_density(temperature, 0.4, ALTITUDE)
    assert " ".join(f"{rho:.4f}" for rho in found) == HIGHER_UP[temperature]


def test_standard_atmosphere() -> None:
    assert float(air_density()) == pytest.approx(1.22498, abs=5e-6)
    assert float(air_density(0.0, pressure=90000.0)) == pytest.approx(90000.0 / (R_DRY * 273.15), rel=1e-14)


def test_arguments_are_broadcast() -> None:
    assert air_density(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)


@pytest.mark.parametrize(("temperature", "percent"), [(-10, 0.1), (20, 0.9), (35, 2.1), (40, 2.8)])
def test_spread_from_dry_to_saturated(temperature: float, percent: float) -> None:
    dry, saturated = air_density(temperature, np.array([0.0, 1.0]))
    assert 100.0 * (1.0 - saturated / dry) == pytest.approx(percent, abs=0.05)


def test_what_the_paper_prints_is_another_reading() -> None:
    """273.5 in place of 273.15, or 20 % in place of 40 %, miss the paper's own digits (E-E1, E-E2)."""
    printed = np.array([1.3408, 1.0340, 1.1359, 0.9081])
    t, h = np.array([-10.0, -10.0, 35.0, 35.0]), np.array([0.0, 2000.0, 0.0, 2000.0])
    assert np.array_equal(air_density(t, 0.4, h).round(4), printed)
    assert np.array_equal(air_density(t, 0.2, h).round(4), [1.3411, 1.0343, 1.1407, 0.9129])
    vapour = vapour_pressure(t + 273.15, 0.4)
    dry = site_pressure(t + 273.15, h) - vapour
    typed = dry / (R_DRY * (t + 273.5)) + vapour / (R_VAPOUR * (t + 273.15))
    assert np.array_equal(typed.round(4), [1.3390, 1.0327, 1.1346, 0.9070])


BAD: list[tuple[dict[str, Any], str]] = [
    ({"humidity": 40.0}, "humidity 40 is not between 0 and 1; if it is in percent, write 0.4"),
    ({"humidity": -0.1}, "humidity -0.1 is not between 0 and 1"),
    ({"temperature": -274.0}, "below absolute zero"),
    ({"temperature": 288.0}, "if it is in kelvin, write 14.85"),
    ({"pressure": 1013.0}, "1 hPa is 100 Pa"),
    ({"temperature": 50.0, "humidity": 1.0, "pressure": 1.2e4}, "below that of the water vapour"),
    ({"altitude": 9500.0}, "altitude"),
]


@pytest.mark.parametrize(("given", "words"), BAD, ids=lambda v: str(v)[:30])
def test_impossible_air(given: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        air_density(**given)
    with pytest.raises(InputError, match=words):
        Air(**given)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"sea_level_pressure": -1.0},
            "sea_level_pressure -1 Pa is not between 80,000 and 110,000 Pa",
        ),
        ({"sea_level_pressure": 1013.25}, "sea_level_pressure 1013.25 Pa .* 1 hPa is 100 Pa"),
        ({"sea_level_pressure": [1e5, np.nan]}, "sea_level_pressure nan Pa is not between"),
        ({"sea_level_pressure": [1e5, 2e5]}, "sea_level_pressure 200000 Pa is not between"),
        ({"temperature": np.nan}, "temperature nan degC is not between"),
        ({"altitude": np.nan}, "altitude is not between"),
        ({"temperature": []}, "temperature: at least one number is needed"),
        ({"pressure": np.zeros(0)}, "pressure: at least one number is needed"),
        ({"humidity": "wet"}, "humidity: expected a number or an array of numbers, found 'wet'"),
        ({"altitude": [[1.0], [2.0, 3.0]]}, "altitude: expected a number or an array"),
        ({"temperature": 1j}, "temperature: expected a number"),
        (
            {"temperature": np.zeros(3), "humidity": np.zeros(4)},
            r"do not go together: temperature \(3,\), humidity \(4,\)",
        ),
    ],
    ids=lambda v: str(v)[:40],
)
def test_what_is_no_air_at_all(given: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        air_density(**given)


def test_impossible_air_for_a_moment() -> None:
    """Where only the coincidence of two series is impossible."""
    hot = TimeSeries(time=[0.0, 10.0], value=[10.0, 50.0])
    low = TimeSeries(time=[0.0, 10.0], value=[9e4, 1.2e4])
    with pytest.raises(InputError, match="water vapour"):
        Air(temperature=hot, humidity=1.0, pressure=low)


def test_constant_air_is_its_density_to_the_bit() -> None:
    air = Air(temperature=31.0, humidity=0.7, altitude=420.0)
    density = float(air_density(31.0, 0.7, 420.0))
    assert Environment(air=air).density == density
    array = conditions_array(Environment(air=air), None, 5e6)
    assert array.shape[1] == 1
    assert array[AIR_DENSITY, 0] == density


def test_air_or_its_density() -> None:
    """Not both, even if the density is that of the standard atmosphere; copies give what was given."""
    for density in (1.225, 1.0):
        with pytest.raises(InputError, match="either air_density or air"):
            Environment(air=Air(), air_density=density)
        with pytest.raises(InputError, match="either air_density or air"):
            Environment(air_density=density).replace(air=Air())
    weather = Environment().replace(air=Air(temperature=35.0))
    assert weather.replace(gravity=0.0).density == weather.density == float(air_density(35.0))
    assert weather.replace(air=None, air_density=1.1).density == 1.1


def test_the_grid_has_the_frequency_of_the_turbines_system() -> None:
    """But what is given holds, and without a system it is 50 Hz."""
    plain = meltemi.load_turbine("nrel5mw")
    sixty = plain.replace(electrical=meltemi.turbine.size_electrical(5.3e6, 122.9, frequency=60.0))
    for turbine, grid, hertz in ((plain, None, 50.0), (sixty, None, 60.0), (sixty, PowerGrid(frequency=59.0), 59.0)):
        assert nominal_frequency(turbine.electrical) == (50.0 if turbine is plain else 60.0)
        array = conditions_array(Environment(), grid, 5e6, nominal_frequency(turbine.electrical))
        assert array[GRID_FREQUENCY, 0] == hertz


def test_density_jumps_with_the_temperature() -> None:
    air = Air(temperature=TimeSeries(time=[0.0, 5.0, 5.0, 9.0], value=[40.0, 40.0, -10.0, 0.0]))
    array, now = conditions_array(Environment(air=air), None, 5e6), Conditions.zeros()
    for time, temperature in ((0.0, 40.0), (4.999, 40.0), (5.0, -10.0), (9.0, 0.0), (99.0, 0.0)):
        conditions_now(time, array, 9.0, Conditions(now))
        assert now[AIR_DENSITY] == pytest.approx(float(air_density(temperature)), rel=1e-12)


CHANGES: list[dict[str, Any]] = [
    {"temperature": TimeSeries(time=[0.0, 10.0], value=[35.0, 5.0]), "humidity": 0.4},
    {"temperature": TimeSeries(time=[0.0, 10.0], value=[-10.0, 40.0]), "humidity": 1.0, "altitude": 2000.0},
    {
        "temperature": TimeSeries(time=[0.0, 4.0, 4.0, 10.0], value=[59.0, -30.0, 20.0, -60.0]),
        "humidity": TimeSeries(time=[0.0, 10.0], value=[1.0, 0.0]),
        "pressure": TimeSeries(time=[2.0, 2.0, 9.0], value=[9e4, 1e5, 7e4]),
    },
]


@pytest.mark.parametrize("weather", CHANGES, ids=["cooler", "saturated", "everything"])
def test_density_between_times_is_that_of_the_weather(weather: dict[str, Any]) -> None:
    environment = Environment(air=Air(**weather))
    array, now = conditions_array(environment, None, 5e6), Conditions.zeros()
    times = np.linspace(0.0, 10.0, 1001)
    exact = environment.air.at(times)  # type: ignore[union-attr]
    found = np.zeros((len(Conditions), len(times)))
    for i, time in enumerate(times):
        conditions_now(time, array, 9.0, Conditions(now))
        found[:, i] = now
    assert found[AIR_DENSITY] == pytest.approx(exact[3], rel=1e-4)
    for row, values in ((AIR_TEMPERATURE, exact[0]), (Conditions.index("humidity"), exact[1])):
        assert found[row] == pytest.approx(values, rel=1e-12, abs=1e-12)
    assert np.all(np.diff(array[TIME]) >= 0.0)
    assert not np.any(array[TIME][2:] == array[TIME][:-2])
    assert array.shape[1] < 80


def test_only_air_that_changes_has_more_times() -> None:
    """Not the grid, and not a change so small that the density is linear in it."""
    grid = PowerGrid(voltage=TimeSeries(time=[0.0, 5.0], value=[1.0, 0.5]))
    assert conditions_array(Environment(air=Air(temperature=30.0)), grid, 5e6).shape[1] == 2
    slow = Air(temperature=TimeSeries(time=[0.0, 5.0], value=[20.0, 20.5]))
    assert conditions_array(Environment(air=slow), None, 5e6).shape[1] == 2


def test_a_jump_at_the_very_start_has_been() -> None:
    """For what a run begins in, and for its first step."""
    environment = Environment(air=Air(temperature=TimeSeries(time=[0.0, 0.0, 10.0], value=[40.0, -10.0, -10.0])))
    array, now = conditions_array(environment, None, 5e6), Conditions.zeros()
    conditions_now(0.0, array, 9.0, Conditions(now))
    assert now[AIR_DENSITY] == environment.density == float(air_density(-10.0))
    conditions_now(-1.0, array, 9.0, Conditions(now))
    assert now[AIR_DENSITY] == float(air_density(40.0))


# ---------------------------------------------------------------------------------------- climates


@pytest.mark.parametrize("name", meltemi.environment.list_climates())
def test_example_climates(name: str) -> None:
    climate = load_climate(name)
    assert climate.name == name
    assert "llustrative" in climate.source
    assert climate.wind_hours(np.linspace(0.0, 80.0, 41)).sum() == pytest.approx(8766.0, abs=1e-3)
    i = int(np.argmax(climate.temperature))
    t, h = climate.temperature[i], climate.humidity[i]
    assert climate.pressure is not None
    assert climate.density[i] == float(air_density(t, h, pressure=climate.pressure[i]))
    # of the altitude it is nearly the same: the pressure of a month differs by less than 2 %
    assert climate.replace(pressure=None).density[i] == float(air_density(t, h, climate.altitude))
    assert climate.density == pytest.approx(climate.replace(pressure=None).density, rel=0.025)


def test_a_year_of_water() -> None:
    """Rates times hours are the millimetres of the year that the climate says it was made from."""
    from meltemi.environment.rain import RAIN_CLASSES

    sea = load_climate("north_sea")
    assert sum(RAIN_CLASSES[k] * h.sum() for k, h in sea.rain_hours.items()) == pytest.approx(750.0, rel=0.01)


def test_hours_of_a_weibull_wind() -> None:
    """Mean over narrow bins against A Gamma(1 + 1/k), higher up by the power law."""
    from math import gamma

    sea, edges = load_climate("north_sea"), np.linspace(0.0, 60.0, 601)
    middle = 0.5 * (edges[1:] + edges[:-1])
    for height in (100.0, 170.0):
        hours = sea.wind_hours(edges, height)
        mean = hours @ middle / MONTH_HOURS
        exact = sea.wind_scale * (height / 100.0) ** sea.shear_exponent * gamma(1.0 + 1.0 / 2.26)
        assert mean == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("month", [0, -3, 13, 1.5, "May"])
def test_no_such_month(month: Any) -> None:
    with pytest.raises(InputError, match="month: expected 1 to 12"):
        load_climate("north_sea").air(month)


@pytest.mark.parametrize(
    ("edges", "height", "words"),
    [
        ([-1.0, 5.0], None, "edges must not be negative, found -1 m/s"),
        ([0.0, 5.0, 4.0], None, "edges must ascend, but edge 3 is 4 m/s"),
        ([0.0, np.nan], None, "edges: nan is not a wind speed"),
        ([3.0], None, "edges: expected at least two wind speeds"),
        (["a", "b"], None, "edges: expected at least two wind speeds"),
        ([0.0, 5.0], 0.0, "height must be a positive number of metres, found 0"),
        ([0.0, 5.0], -10.0, "height must be a positive number of metres, found -10"),
        ([0.0, 5.0], np.nan, "height must be a positive number of metres"),
    ],
)
def test_no_such_wind(edges: Any, height: float | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_climate("north_sea").wind_hours(edges, height)


def test_all_hours_of_the_wind() -> None:
    assert load_climate("north_sea").wind_hours([0.0, np.inf])[:, 0] == pytest.approx(MONTH_HOURS)


def test_scenarios() -> None:
    sea = load_climate("north_sea")
    warmer = sea.shifted(temperature=2.0, humidity=0.5, wind=1.1, rain=0.5, icing=2.0)
    assert warmer.temperature == pytest.approx(sea.temperature + 2.0)
    assert np.all(warmer.humidity == 1.0)
    assert warmer.wind_scale == pytest.approx(1.1 * sea.wind_scale)
    assert warmer.rain_hours["light"] == pytest.approx(0.5 * sea.rain_hours["light"])
    assert warmer.icing_hours == pytest.approx(2.0 * sea.icing_hours)
    assert np.all(warmer.density < sea.density)
    assert sea.shifted() == sea
    measured = sea.replace(pressure=np.full(12, 1e5))
    assert measured.shifted(pressure=-500.0).pressure == pytest.approx(99500.0)
    with pytest.raises(InputError, match="no pressure to shift"):
        sea.replace(pressure=None).shifted(pressure=100.0)


def test_bad_climates(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'north_sea'"):
        load_climate("nort_sea")
    sea = load_climate("north_sea")
    for change, words in (
        ({"temperature": np.zeros(11)}, "12 numbers"),
        ({"rain_hours": {"hevy": np.zeros(12)}}, "did you mean 'heavy'"),
        ({"rain_hours": {"heavy": np.full(12, 800.0)}}, "rain of 800 h in month 2, which has 678 h"),
        ({"icing_hours": np.full(12, -1.0)}, "icing of -1 h"),
        ({"humidity": np.full(12, 80.0)}, "if it is in percent"),
        ({"wind_scale": np.zeros(12)}, "wind_scale must be positive"),
    ):
        with pytest.raises(InputError, match=words):
            sea.replace(**change)
    path = tmp_path / "site.yaml"
    path.write_text("name: here\ntemperature: [1, 2]\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"site.yaml:2: temperature: expected 12 numbers"):
        load_climate(path)


def test_a_climate_from_a_file(tmp_path: Path) -> None:
    from meltemi.core.yamlfile import write_record

    sea = load_climate("north_sea")
    write_record(sea, tmp_path / "copy.yaml")
    assert load_climate(tmp_path / "copy.yaml") == sea
    assert isinstance(sea, Climate)
