"""A year in a climate from what a turbine does: with responses in closed form, and once with a simulated one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi import Turbine
from meltemi.environment.climate import MONTH_HOURS, load_climate
from meltemi.environment.drops import water_content
from meltemi_papers.palanimuthu2022.beyond import climate as part
from meltemi_papers.palanimuthu2022.beyond.climate.response import (
    ICED,
    QUICK,
    SHED,
    SLOPES,
    WET,
    Response,
    Setup,
    State,
)
from meltemi_papers.palanimuthu2022.beyond.climate.year import (
    EDGES,
    SHED_SHARE,
    Curves,
    a_year,
    densities,
    of_turbine,
    years,
)
from meltemi_papers.study import Drawing
from meltemi_reports.blocks import Table

SETUP = Setup(seeds=(1, 2))
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
            ICED: State(1.3, 0.8 * power[-1], last, 11.5),
            SHED: State(1.3, 0.9 * power[-1], {name: 2.0 * values for name, values in last.items()}, 11.3),
            WET: State(1.15, power[1], {name: 1.01 * values for name, values in middle.items()}, 11.3),
        },
        rated_wind=11.0 * (1.225 / DENSITIES) ** (1.0 / 3.0),
        points=tuple(points),  # type: ignore[arg-type]
    )


def test_energy_goes_with_the_density(response: Response) -> None:
    site = load_climate("inland_plateau")
    year = a_year(Curves(response), site, site)
    # in such a power every month counts with its density, weighted with its wind's third power
    assert np.asarray(year.reference[1] / year.reference[0]) == pytest.approx(1.1)
    hours = site.wind_hours(EDGES, response.turbine.hub_height)
    middle = 0.5 * (EDGES[1:] + EDGES[:-1])
    flat = replace(response, power=0.5 * 1.225 * np.ones((3, len(SPEEDS), 2)))
    assert a_year(Curves(flat), site, site).steps["altitude"] == pytest.approx(0.0, abs=1e-3)
    cube = hours @ np.minimum(middle, 24.0) ** 3
    assert year.reference[0] == pytest.approx(3600.0 * 0.5 * 1.225 * cube.sum(), rel=3e-3)
    in_air = year.reference + sum(year.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert in_air[0] / year.reference[0] == pytest.approx((cube @ site.density) / (1.225 * cube.sum()), rel=1e-3)
    assert year.steps["altitude"][0] < 0.0 < year.steps["temperature"][0]
    assert year.steps["humidity"][0] < 0.0
    assert year.rated_wind == pytest.approx(11.0 * (1.225 / site.density) ** (1.0 / 3.0), rel=1e-3)


def test_ice_takes_its_hours(response: Response) -> None:
    site = load_climate("inland_plateau")
    one = a_year(Curves(response), site, site)
    lost = (1.0 - SHED_SHARE) * 0.2 + SHED_SHARE * 0.1
    always = a_year(Curves(response), site.replace(icing_hours=MONTH_HOURS), site)
    in_air = always.reference + sum(always.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert always.steps["ice"] == pytest.approx(-lost * in_air)
    twice = a_year(Curves(response), site.shifted(icing=2.0), site)
    assert twice.steps["ice"] == pytest.approx(2.0 * one.steps["ice"])
    for name, slope in SLOPES.items():
        dry, rainy, ice = (always.loads[name][what] for what in ("humidity", "rain", "ice"))
        shed = dry**slope * (1.0 - SHED_SHARE + SHED_SHARE * 2.0**slope)
        assert ice**slope == pytest.approx(shed + rainy**slope - dry**slope)
        # these loads go with the density alone
        assert always.loads[name]["altitude"] / always.loads[name]["reference"] == pytest.approx(
            densities(site, "altitude")[0] / 1.225
        )


def test_rain_loads_blades_in_its_hours(response: Response) -> None:
    """A hundredth more in 32 mm/h, in other rain in proportion to its water."""
    site = load_climate("tropical_coast")
    light = 0.01 * float(water_content(2.5 / 3.6e6) / water_content(32.0 / 3.6e6))
    for kind, more in (("rainstorm", 0.01), ("light", light)):
        rainy = site.replace(rain_hours={kind: 0.5 * MONTH_HOURS})
        loads = a_year(Curves(response), rainy, rainy).loads
        for name, slope in SLOPES.items():
            damage = (loads[name]["rain"] / loads[name]["humidity"]) ** slope
            assert damage - 1.0 == pytest.approx(0.5 * ((1.0 + more) ** slope - 1.0), rel=1e-6)


def test_rain_takes_its_hours_and_never_more_than_there_is(response: Response) -> None:
    site = load_climate("tropical_coast")
    one, none = a_year(Curves(response), site, site), a_year(Curves(response), site.shifted(rain=0.0), site)
    assert np.all(none.steps["rain"] == 0.0)
    assert np.all(one.steps["rain"] < 0.0)
    # this turbine makes so little that the review's formula takes all of it
    wet = sum(hours for hours in site.rain_hours.values())
    clean = one.reference + sum(one.steps[what] for what in ("altitude", "temperature", "humidity"))
    assert np.all(-one.seed_rain <= clean * np.max(wet / MONTH_HOURS))
    assert np.all(one.seed_rain < 0.0)
    full = a_year(Curves(replace(response, below=np.zeros(response.below.shape))), site, site)
    assert np.all(full.steps["rain"] == 0.0)


def test_scenarios_shift_the_year(response: Response) -> None:
    found = years(response)
    for year in found.years.values():
        assert np.all(year.scenarios["3 K warmer"] < year.energy)
        assert np.all(year.scenarios["wind 5 % slower"] < year.scenarios["humidity +0.1"])
    plateau = found.years["inland_plateau"].scenarios
    assert np.all(plateau["3 K warmer, half the ice"] > plateau["3 K warmer"])


def test_tables_figure_and_words(response: Response) -> None:
    found = years(response)
    drawn: list[str] = []

    def draw(name: str, caption: str, figure: Callable[[], Any]) -> Drawing:
        figure()
        drawn.append(name)
        return Drawing(caption, None)

    content = part.chapter(found, draw).content
    made = [each for each in content if isinstance(each, Table)]
    assert [len(table.rows) for table in made] == [13, 4, 28, 5]
    assert all(len(row) == len(table.head) for table in made for row in table.rows)
    assert drawn == ["climate"]
    words = " ".join(each for each in content if isinstance(each, str))
    assert "north sea" in words
    assert "nan" not in words


@pytest.mark.long
def test_a_look_with_a_simulated_turbine(turbine: Turbine) -> None:
    told: list[Any] = []
    found = of_turbine(turbine, QUICK, workers=2, progress=lambda share, what: told.append(share))
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
