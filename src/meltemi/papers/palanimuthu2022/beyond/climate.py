"""Annual energy and lifetime loads of an aeroelastic turbine at three sites, compared with the review.

The study is that of ``meltemi climate`` (:mod:`meltemi.studies.climate`); this module has the sites, scenarios and
texts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi.papers.palanimuthu2022.beyond import part_chapter
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.study import Draw, Progress
from meltemi.postprocess.ensemble import MeanEstimate
from meltemi.reports.blocks import Section, Table
from meltemi.studies.climate import response
from meltemi.studies.climate.climates import load_climate
from meltemi.studies.climate.response import ICED, SIDE, Response, ResponseSetup, respond
from meltemi.studies.climate.tables import (
    energy_table,
    estimate_text,
    load_table,
    of_standard,
    share,
    words,
    years_figure,
)
from meltemi.studies.climate.weather import periods
from meltemi.studies.climate.year import AIR, Curves, SiteYear, SiteYears, whole_energy
from meltemi.studies.power_schemes.costs import few_modes
from meltemi.studies.rain_drops import rain_loads
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine

Float = NDArray[np.float64]
CLIMATES = ("north_sea", "inland_plateau", "tropical_coast")
TURBINE: Final = "iea22mw"
SCENARIOS: dict[str, dict[str, float]] = {
    "3 K warmer": {"temperature": 3.0},
    "3 K warmer, half the ice": {"temperature": 3.0, "icing": 0.5},
    "humidity +0.1": {"humidity": 0.1},
    "rain half as long again": {"rain": 1.5},
    "wind 5 % slower": {"wind": 0.95},
}


@dataclass(frozen=True)
class SiteResults(SiteYears):
    """Annual results at three sites.

    Attributes:
      common: (seeds,) [J] annual energy by site, with its air in the wind of the first site.
      scenarios: (seeds,) [J] annual energy by site with all effects, by scenario.
    """

    common: Mapping[str, Float]
    scenarios: Mapping[str, Mapping[str, Float]]


def study(
    quick: bool,
    *,
    turbine: Turbine | None = None,
    workers: int | None = None,
    progress: Progress = lambda share, what: None,
) -> SiteResults:
    """Annual results of the review's aeroelastic turbine, or another one, in three climates."""
    turbine = turbine or load_turbine(TURBINE)
    setup = response.QUICK if quick else ResponseSetup(options=few_modes(turbine))
    return years(respond(turbine, setup, workers=workers, progress=lambda share, what: progress(0.98 * share, what)))


def years(response: Response) -> SiteResults:
    """Annual results in three climates from a response."""
    sites, curves = [load_climate(name) for name in CLIMATES], Curves(response)
    base = SiteYears.of(response, sites)
    hours = curves.hours(periods(sites[0]))
    return SiteResults(
        response,
        base.years,
        common={name: curves.energy(year.density, hours) for name, year in base.years.items()},
        scenarios={
            site.name: {name: whole_energy(curves, site.shifted(**shift)) for name, shift in SCENARIOS.items()}
            for site in sites
        },
    )


def scenario_change(sites: SiteResults, site: str, name: str) -> MeanEstimate:
    """Change [%] of a site's annual energy in a scenario."""
    energy = sites.years[site].energy
    return share(sites.scenarios[site][name] - energy, energy)


def scenario_table(sites: SiteResults) -> Table:
    """Table of scenarios."""
    head = ["scenario", *(f"{words(name)}\n%" for name in sites.years)]
    rows = [[name, *(estimate_text(scenario_change(sites, site, name)) for site in sites.years)] for name in SCENARIOS]
    return Table(head, rows, "Scenarios", note="Change of the year's energy with all effects in.")


def chapter(sites: SiteResults, draw: Draw, *, applied: bool = False) -> Section:
    """Chapter on a year in three climates; for the review's turbine with the numbers of the review."""
    caption = "A year in three climates: the turbine, the air, and what weather adds; bars with 95 % intervals"
    figure = draw("climate", caption, lambda: years_figure(sites))

    def tables() -> list[Table]:
        beside = [] if applied else [review_table(sites)]
        return [energy_table(sites), *beside, load_table(sites), scenario_table(sites)]

    return part_chapter("a year in three climates", lambda: verdict(sites), [figure], tables, applied=applied)


def iced_loss(sites: SiteResults) -> tuple[float, float]:
    """Largest and smallest power loss below rated by ice on all blades, means over seeds [%]."""
    response = sites.response
    setup = response.setup
    at = int(np.argmin(np.abs(np.array(setup.densities) - setup.icing_density)))
    below = response.below[at].mean(axis=1) > 0.9
    lost = 100.0 * (1.0 - response.states[ICED].power.mean(axis=1) / response.power[at].mean(axis=1))[below]
    return float(lost.max()), float(lost.min())


def rain_loss(sites: SiteResults) -> tuple[float, float, float]:
    """Power loss [%] below rated in a rainstorm: drops on blades; formula, integrated; formula, one drop size."""
    r = sites.response
    point = min(r.points, key=lambda p: abs(p.wind.speed - 9.0))
    power = point["generator_power"]
    by_drops = rain_loads(r.turbine, Rain(kind="rainstorm"), point.wind.speed, point.rotor_speed, point.pitch).power
    formula = (
        rain_power_loss(rain_parameters(Rain(kind="rainstorm", mode=mode), r.turbine.rotor_radius), point.wind.speed)
        for mode in ("integrated", "seed")
    )
    one, two, three = (100.0 * lost / power for lost in (by_drops, *formula))
    return one, two, three


def spread(sites: SiteResults) -> tuple[MeanEstimate, MeanEstimate]:
    """Annual energy with the air of the second and third site relative to the first, in the first site's wind [%]."""
    base, *others = sites.common.values()
    one, two = (share(each - base, base) for each in others)
    return one, two


def worst_density(sites: SiteResults) -> tuple[float, str]:
    """Largest error [%] of the power below rated with 1.225 kg/m³, in a month, and where."""
    worst = {name: 100.0 * (STANDARD / y.density - 1.0) for name, y in sites.years.items()}
    name = max(worst, key=lambda n: float(np.abs(worst[n]).max()))
    return float(worst[name][np.argmax(np.abs(worst[name]))]), words(name)


def in_its_air(year: SiteYear) -> Float:
    """(seeds,) [J] annual energy with monthly densities, dry blades, no ice."""
    return np.asarray(year.reference + sum(year.steps[what] for what in AIR))


def review_table(sites: SiteResults) -> Table:
    """Table of the numbers of the review and ours."""
    years, names = list(sites.years.values()), [words(name) for name in sites.years]

    def row(what: str, digits: int) -> str:
        return ", ".join(estimate_text(of_standard(year, what), digits) for year in years)

    def scenario(name: str) -> str:
        return ", ".join(estimate_text(scenario_change(sites, site, name)) for site in sites.years)

    most, least = iced_loss(sites)
    drops, integrated, single = rain_loss(sites)
    worst, where = worst_density(sites)
    constant = ", ".join(estimate_text(share(y.reference - in_its_air(y), in_its_air(y))) for y in years)
    ours = {
        ("production by climate change", "±8 to 10 %"): (
            f"3 K warmer: {scenario('3 K warmer')} %; wind 5 % slower: {scenario('wind 5 % slower')} %"
        ),
        ("loss by icing", "0.005 to 50 %"): (
            f"in a year {row('ice', 2)} %; while there is ice {least:.0f} to {most:.0f} % of the power below rated"
        ),
        ("loss of output in rain", "26 %"): (
            f"in a year {row('rain', 3)} %; in 32 mm/h at 9 m/s {drops:.2f} % by drops on the blades, "
            f"{integrated:.1f} % by the formula with the spectrum, {single:.0f} % with drops of 3 mm only"
        ),
        ("error with constant density", "16 % at most"): (
            f"{worst:+.1f} % of the power below rated in a month ({where}); in a year {constant} %"
        ),
    }
    rows = [[*quoted, text] for quoted, text in ours.items()]
    note = f"Three figures in a row: {', '.join(names)}. Means over seeds with 95 % intervals."
    return Table(["of", "quoted", "ours"], rows, "What the review quotes, and ours", text_columns=3, note=note)


def verdict(sites: SiteResults) -> str:
    """Conclusion, from the results."""
    names = [words(name) for name in sites.years]
    years = list(sites.years.values())
    one, two = spread(sites)
    air = [float(np.mean(year.density)) for year in years]
    icy = max(years, key=lambda year: float(year.climate.icing_hours.sum()))
    sway = icy.loads[SIDE]
    ice, side = of_standard(icy, "ice"), share(sway["ice"] - sway["rain"], sway["rain"])
    rain = min((of_standard(year, "rain") for year in years), key=lambda e: e.mean)
    all_ = ", ".join(
        f"{estimate_text(of_standard(year, 'all'))} % ({name})" for name, year in zip(names, years, strict=True)
    )
    warmer, slower = (
        ", ".join(estimate_text(scenario_change(sites, name, scenario)) for name in sites.years)
        for scenario in ("3 K warmer", "wind 5 % slower")
    )
    numbers: dict[str, object] = {"names": names, "one": estimate_text(one), "two": estimate_text(two)}
    numbers |= {"denser": [100.0 * (x / air[0] - 1.0) for x in air], "warmer": warmer, "slower": slower}
    icing = {"ice": estimate_text(ice), "icy": words(icy.climate.name), "side": estimate_text(side, 0)}
    hours = icy.climate.icing_hours.sum()
    return sentence("climate", all=all_, hours=hours, rain=-rain.mean, **numbers, **icing)
