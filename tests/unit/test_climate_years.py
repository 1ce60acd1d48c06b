"""A year in a climate from what a turbine does: with responses in closed form, and once with a simulated one."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, Turbine
from meltemi.environment import air_density
from meltemi.environment.drops import water_content
from meltemi.papers.palanimuthu2022.beyond import climate as part
from meltemi.papers.palanimuthu2022.beyond.climate import study, years
from meltemi.reports.blocks import Block, Table
from meltemi.studies.climate.climates import MONTH_HOURS, load_climate
from meltemi.studies.climate.response import ICED, SHED, SLOPES, WET, Response, ResponseSetup, WeatherState
from meltemi.studies.climate.tables import month_table
from meltemi.studies.climate.weather import periods, read_weather
from meltemi.studies.climate.year import SHED_SHARE, Curves, a_year

SETUP = ResponseSetup(seeds=(1, 2))
SPEEDS, DENSITIES = np.array(SETUP.speeds), np.array(SETUP.densities)


class Point(SimpleNamespace):
    """What the rain's study asks of an operating point."""

    def __getitem__(self, name: str) -> float:
        return float(self.power)


@pytest.fixture(scope="module")
def response(turbine: Turbine) -> Response:
    """Power and loads that go with the density; ice takes a fifth of the power, and doubles loads when one sheds it."""
    power = 0.5 * DENSITIES[:, None, None] * SPEEDS[:, None] ** 3 * np.array([1.0, 1.1])
    loads = {name: 1e6 * DENSITIES[:, None, None] * SPEEDS[:, None] * np.ones(2) for name in SLOPES}
    middle, last = ({name: values[i] for name, values in loads.items()} for i in (1, -1))
    points = [
        Point(wind=SimpleNamespace(speed=v), rotor_speed=min(0.12 * v, 1.27), pitch=0.0, power=250.0 * v**3)
        for v in SPEEDS
    ]
    return Response(
        turbine=turbine,
        setup=SETUP,
        power=power,
        below=np.ones(power.shape),
        loads=loads,
        states={
            ICED: WeatherState(1.3, 0.8 * power[-1], last, 11.5),
            SHED: WeatherState(1.3, 0.9 * power[-1], {name: 2.0 * values for name, values in last.items()}, 11.3),
            WET: WeatherState(1.15, power[1], {name: 1.01 * values for name, values in middle.items()}, 11.3),
        },
        rated_wind=11.0 * (1.225 / DENSITIES) ** (1.0 / 3.0),
        points=tuple(points),  # type: ignore[arg-type]
    )


def test_energy_goes_with_the_density(response: Response) -> None:
    site = load_climate("inland_plateau")
    year = a_year(Curves(response), site)
    # in such a power every month counts with its density, weighted with its wind's third power
    assert np.asarray(year.reference[1] / year.reference[0]) == pytest.approx(1.1)
    hours = site.wind_hours(Curves(response).edges, response.turbine.hub_height)
    middle = Curves(response).middle
    flat = replace(response, power=0.5 * 1.225 * np.ones((3, len(SPEEDS), 2)))
    assert a_year(Curves(flat), site).steps["altitude"] == pytest.approx(0.0, abs=1e-3)
    cube = hours @ np.minimum(middle, 24.0) ** 3
    assert year.reference[0] == pytest.approx(3600.0 * 0.5 * 1.225 * cube.sum(), rel=3e-3)
    in_air = year.reference + sum(year.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert in_air[0] / year.reference[0] == pytest.approx((cube @ site.density) / (1.225 * cube.sum()), rel=1e-3)
    assert year.steps["altitude"][0] < 0.0 < year.steps["temperature"][0]
    assert year.steps["humidity"][0] < 0.0
    assert year.rated_wind == pytest.approx(11.0 * (1.225 / site.density) ** (1.0 / 3.0), rel=1e-3)


def test_ice_takes_its_hours(response: Response) -> None:
    site = load_climate("inland_plateau")
    one = a_year(Curves(response), site)
    lost = (1.0 - SHED_SHARE) * 0.2 + SHED_SHARE * 0.1
    always = a_year(Curves(response), site.replace(icing_hours=MONTH_HOURS))
    in_air = always.reference + sum(always.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert always.steps["ice"] == pytest.approx(-lost * in_air)
    twice = a_year(Curves(response), site.shifted(icing=2.0))
    assert twice.steps["ice"] == pytest.approx(2.0 * one.steps["ice"])
    for name, slope in SLOPES.items():
        dry, rainy, ice = (always.loads[name][what] for what in ("humidity", "rain", "ice"))
        shed = dry**slope * (1.0 - SHED_SHARE + SHED_SHARE * 2.0**slope)
        assert ice**slope == pytest.approx(shed + rainy**slope - dry**slope)
        # these loads go with the density alone
        assert always.loads[name]["altitude"] / always.loads[name]["reference"] == pytest.approx(
            periods(site).density("altitude")[0] / 1.225
        )


def test_rain_loads_blades_in_its_hours(response: Response) -> None:
    """A hundredth more in 32 mm/h, in other rain in proportion to its water."""
    site = load_climate("tropical_coast")
    light = 0.01 * float(water_content(2.5 / 3.6e6) / water_content(32.0 / 3.6e6))
    for kind, more in (("rainstorm", 0.01), ("light", light)):
        rainy = site.replace(rain_hours={kind: 0.5 * MONTH_HOURS})
        loads = a_year(Curves(response), rainy).loads
        for name, slope in SLOPES.items():
            damage = (loads[name]["rain"] / loads[name]["humidity"]) ** slope
            assert damage - 1.0 == pytest.approx(0.5 * ((1.0 + more) ** slope - 1.0), rel=1e-6)


def test_rain_takes_its_hours_and_never_more_than_there_is(response: Response) -> None:
    site = load_climate("tropical_coast")
    one, none = a_year(Curves(response), site), a_year(Curves(response), site.shifted(rain=0.0))
    assert np.all(none.steps["rain"] == 0.0)
    assert np.all(one.steps["rain"] < 0.0)
    # this turbine makes so little that the review's formula takes all of it
    wet = sum(hours for hours in site.rain_hours.values())
    clean = one.reference + sum(one.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert np.all(-one.seed_rain <= clean * np.max(wet / MONTH_HOURS))
    assert np.all(one.seed_rain < 0.0)
    full = a_year(Curves(replace(response, below=np.zeros(response.below.shape))), site)
    assert np.all(full.steps["rain"] == 0.0)


def test_scenarios_shift_the_year(response: Response) -> None:
    found = years(response)
    for name, year in found.years.items():
        assert np.all(found.scenarios[name]["3 K warmer"] < year.energy)
        assert np.all(found.scenarios[name]["wind 5 % slower"] < found.scenarios[name]["humidity +0.1"])
    plateau = found.scenarios["inland_plateau"]
    assert np.all(plateau["3 K warmer, half the ice"] > plateau["3 K warmer"])


def test_tables_figure_and_words(response: Response) -> None:
    found = years(response)
    drawn: list[str] = []

    def draw(name: str, caption: str, figure: Callable[[], Any]) -> Block:
        figure()
        drawn.append(name)
        return caption

    content = part.chapter(found, draw).content
    made = [each for each in content if isinstance(each, Table)]
    assert [len(table.rows) for table in made] == [13, 4, 28, 5]
    assert all(len(row) == len(table.head) for table in made for row in table.rows)
    assert drawn == ["climate"]
    words = " ".join(each for each in content if isinstance(each, str))
    assert "north sea" in words
    assert "nan" not in words


HEADER = "LOCATION,Town,-,XXX,-,1,50.0,8.0,1.0,500.0\n" + "x\n" * 7
EPW_ROWS = (
    "2020,1,1,1,0,_,-5.0,-6,80,95000,0,0,0,0,0,0,0,0,0,0,180,4.0,0,0,9,9,0,0,0,0,0,0,0,0.0,1\n"
    "2020,7,1,2,0,_,30.0,20,50,999999,0,0,0,0,0,0,0,0,0,0,180,8.0,0,0,9,9,0,0,0,0,0,0,0,4.0,1\n"
    "2020,7,1,3,0,_,99.9,20,50,95000,0,0,0,0,0,0,0,0,0,0,180,8.0,0,0,9,9,0,0,0,0,0,0,0,0.0,1\n"
)


def test_hours_of_an_epw_file(tmp_path: Path) -> None:
    path = tmp_path / "town.epw"
    path.write_text(HEADER + EPW_ROWS)
    found = periods(path)
    assert (found.name, found.altitude, found.missing, found.month.tolist()) == ("town", 500.0, 1, [1, 7])
    assert found.density()[0] == pytest.approx(float(air_density(-5.0, 0.8, pressure=95000.0)))
    assert found.density()[1] == pytest.approx(float(air_density(30.0, 0.5, altitude=500.0)))
    assert found.density("temperature")[1] > found.density()[1]  # moist air is lighter
    edges = np.array([0.0, 6.0, 12.0, 20.0])
    # 4 and 8 m/s at 10 m: 5.5 and 11.0 at 100 m
    assert found.wind_hours(edges, 100.0).tolist() == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    assert read_weather(path, wind_height=2.0).wind_hours(edges, 100.0).tolist() == [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    # 4 mm/h: an hour of light rain, at most
    assert {name: hours.tolist() for name, hours in found.rain_hours.items() if hours.any()} == {"light": [0.0, 1.0]}


def test_a_year_of_hours_is_that_of_its_months(response: Response, tmp_path: Path) -> None:
    """Energy of hours with the air of their own; a warm hour with wind and a cold calm one make less than the mean."""
    path = tmp_path / "hours.csv"
    path.write_text("temperature,humidity,pressure,wind_speed,icing\n-10,0,100000,3.3,0\n35,0,100000,8.1,0.5\n")
    year = a_year(Curves(response), periods(path))
    warm, cold = (float(air_density(t, pressure=1e5)) for t in (35.0, -10.0))
    cube = 0.5 * np.array([Curves(response).middle[i] ** 3 for i in (0, 10)]) * 3600.0
    assert year.reference[0] == pytest.approx(1.225 * cube.sum(), rel=5e-3)
    assert (year.reference + year.steps["altitude"] + year.steps["temperature"])[0] == pytest.approx(
        cold * cube[0] + warm * cube[1], rel=5e-3
    )
    assert year.constant[0] > 0.0
    assert year.steps["ice"][0] == pytest.approx(-0.5 * 0.19 * warm * cube[1], rel=5e-3)
    head = month_table(year).head
    assert [row[0] for row in month_table(year).rows] == ["1"] and len(head) == len(month_table(year).rows[0])


def test_without_rain_and_ice_nothing_of_them_is_simulated(response: Response) -> None:
    site = load_climate("inland_plateau")
    dry = a_year(Curves(replace(response, states={})), site.shifted(rain=0.0, icing=0.0))
    full = a_year(Curves(response), site.shifted(rain=0.0, icing=0.0))
    assert dry.energy == pytest.approx(full.energy)
    for name in SLOPES:
        assert dry.loads[name]["ice"] == pytest.approx(full.loads[name]["ice"])


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "temperature,humidity\n1,1\n", "column wind_speed [m/s] is missing"),
        ("a.csv", "temperatur,humidity,wind_speed\n1,1,1\n", "no column 'temperatur': did you mean 'temperature'"),
        (
            "a.csv",
            "temperature,humidity,wind_speed\n1,80,1\n",
            "humidity of 80 in hour 1: expected 0 to 1",
        ),
        ("a.csv", "temperature,humidity,wind_speed\n1,x,1\n", "hour 1, humidity: expected a number, found 'x'"),
        ("a.csv", "temperature,humidity,wind_speed\n", "no hour has temperature, humidity, wind_speed"),
        ("a.csv", "time,temperature,humidity,wind_speed\nnow,1,1,1\n", "time: expected ISO 8601"),
        ("a.epw", "1,2\n", "line 1: expected LOCATION of an EPW file"),
        ("a.epw", HEADER + "2020,1\n", "line 9: expected the 35 fields of an hour, found 2"),
    ],
)
def test_what_is_no_weather_is_refused(tmp_path: Path, name: str, text: str, said: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(said)):
        periods(path)


@pytest.mark.long
def test_a_look_with_a_simulated_turbine(turbine: Turbine) -> None:
    told: list[Any] = []
    found = study(True, turbine=turbine, workers=2, progress=lambda share, what: told.append(share))
    assert told == sorted(told)
    r = found.response
    # thin air has less power below rated, and rated wind comes later
    assert np.all(np.diff(r.power[:, :2].mean(axis=2), axis=0) > 0.0)
    assert np.all(np.diff(r.rated_wind) < 0.0)
    assert r.rated_wind[0] / r.rated_wind[-1] == pytest.approx((1.3 / 1.0) ** (1.0 / 3.0), rel=0.01)
    lost = 1.0 - r.states[ICED].power[1].mean() / r.power[-1, 1].mean()
    assert 0.12 < lost < 0.26
    plateau = found.years["inland_plateau"]
    share = (plateau.energy / plateau.reference - 1.0).mean()
    assert -0.15 < share < 0.0
