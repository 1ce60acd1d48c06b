"""A year at a site: energy and lifetime loads from the turbine's response and a monthly climate.

Of each month the density of its air, the hours of its wind speeds (Weibull), of its rain and of ice are known. Power in
turbulence is interpolated in the wind speed (monotone cubic) and in the density (through three values). One weather
effect after another is put in: altitude (the mean pressure, where pressures are measured), temperature, humidity,
rain, ice; what each adds is a share of the year's energy, or of a load, at 1.225 kg/m^3 in the same wind. Rain and ice
come in hours that are spread over all wind speeds of their month.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.air import Air
from meltemi.environment.climate import MONTH_HOURS, Climate, load_climate
from meltemi.environment.drops import water_content
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi_papers.palanimuthu2022.beyond.climate.response import (
    ICED,
    QUICK,
    RAIN,
    SHED,
    SLOPES,
    WET,
    Response,
    Setup,
    respond,
)
from meltemi_papers.palanimuthu2022.rain_drops import rain_loads
from meltemi_papers.study import Progress

Float = NDArray[np.float64]

CLIMATES = ("north_sea", "inland_plateau", "tropical_coast")
TURBINE: Final = "iea22mw"
EDGES = np.arange(3.0, 25.01, 0.5)
"""[m/s] of the bins of a year, from cut-in to cut-out."""
AIR: Final = ("altitude", "temperature", "humidity")
STEPS = (*AIR, "rain", "ice")
"""What is put in one after another."""
SHED_SHARE = 0.1
"""Of the hours with ice, in which one blade has thrown its ice off. An assumption: there are no statistics."""
SCENARIOS: dict[str, dict[str, float]] = {
    "3 K warmer": {"temperature": 3.0},
    "3 K warmer, half the ice": {"temperature": 3.0, "icing": 0.5},
    "humidity +0.1": {"humidity": 0.1},
    "rain half as long again": {"rain": 1.5},
    "wind 5 % slower": {"wind": 0.95},
}


@dataclass(frozen=True)
class Year:
    """Annual results at a site, for each seed.

    Attributes:
      climate: of the site.
      density: (12,) [kg/m^3].
      rated_wind: (12,) [m/s].
      reference: (seeds,) [J] at 1.225 kg/m^3, dry and without ice.
      steps: (seeds,) [J] that each effect adds to what stands before it.
      constant: (seeds,) [J] more than with the months' densities if the density had its mean over the year.
      seed_rain: (seeds,) [J] that rain takes by the review's formula, drops of 3 mm, instead of by drops on the blades.
      loads: (seeds,) by channel, [N m] equivalent to the year's: at 1.225 kg/m^3 (``reference``), and with the effects
        up to each of the steps.
      common: (seeds,) [J] with its air in the wind of the first climate.
      scenarios: (seeds,) [J] all effects in, by scenario.
    """

    climate: Climate
    density: Float
    rated_wind: Float
    reference: Float
    steps: Mapping[str, Float]
    constant: Float
    seed_rain: Float
    loads: Mapping[str, Mapping[str, Float]]
    common: Float
    scenarios: Mapping[str, Float]

    @property
    def energy(self) -> Float:
        """(seeds,) [J] annual energy with all effects."""
        return self.reference + sum(self.steps.values())


@dataclass(frozen=True)
class Found:
    """Annual results and the data behind them."""

    response: Response
    years: Mapping[str, Year]


def study(runs: Any, *, workers: int | None = None, progress: Progress = lambda share, what: None) -> Found:
    """Simulate the response and compute the years; few runs with ``runs.setup.quick``."""
    setup = QUICK if runs.setup.quick else Setup()
    return of_turbine(load_turbine(TURBINE), setup, workers=workers, progress=progress)


def of_turbine(
    turbine: Turbine, setup: Setup, *, workers: int | None = None, progress: Progress = lambda share, what: None
) -> Found:
    """Annual results of a turbine in three climates."""
    response = respond(turbine, setup, workers=workers, progress=lambda share, what: progress(0.98 * share, what))
    return years(response)


def years(response: Response) -> Found:
    """Annual results in three climates from a response."""
    climates, curves = {name: load_climate(name) for name in CLIMATES}, Curves(response)
    return Found(response, {name: a_year(curves, each, climates[CLIMATES[0]]) for name, each in climates.items()})


class Curves:
    """Power and loads at the centres of the wind speed bins."""

    def __init__(self, response: Response) -> None:
        self.response = response
        self.speeds, self.densities = np.array(response.setup.speeds), np.array(response.setup.densities)
        self.middle = 0.5 * (EDGES[1:] + EDGES[:-1])
        self.produced = self.power(response.power)
        self.wet: dict[tuple[str, str], Float] = {}

    def over_speed(self, values: Float) -> Float:
        """(..., bins, seeds) interpolated from (..., speeds, seeds), constant beyond the outermost speeds."""
        from scipy.interpolate import PchipInterpolator

        inside = np.clip(self.middle, self.speeds[0], self.speeds[-1])
        found: Float = PchipInterpolator(self.speeds, values, axis=-2)(inside)
        return found

    def power(self, values: Float) -> Float:
        """As ``over_speed`` for power, which is proportional to the cube of the wind speed below the smallest one."""
        slow = np.minimum(self.middle / self.speeds[0], 1.0) ** 3
        return self.over_speed(values) * slow[:, None]

    def at(self, values: Float, density: Float) -> Float:
        """(12, bins, seeds) from (densities, bins, seeds) by Lagrange interpolation in density."""
        x, result = self.densities, np.zeros((len(density), *values.shape[1:]))
        for i, value in enumerate(values):
            others = np.delete(x, i)
            weight = np.prod((density[:, None] - others) / (x[i] - others), axis=1)
            result += weight[:, None, None] * value
        return result

    def clean(self, density: Float) -> Float:
        """[W] of clean blades in months of a density."""
        rated = self.response.turbine.rated_power
        return np.clip(self.at(self.produced, density), 0.0, 1.02 * rated)

    def ice_ratio(self, name: str) -> Float:
        """(bins, seeds) ratio of power with and without ice."""
        state = self.response.states[name]
        base = self.at(self.response.power, np.array([state.density]))[0]
        return self.over_speed(state.power / np.maximum(base, 1.0))

    def load_ratio(self, name: str, load: str) -> Float:
        """(bins, seeds) ratio of a load with ice or in rain to that without."""
        state = self.response.states[name]
        base = self.at(self.response.loads[load], np.array([state.density]))[0]
        return self.over_speed(state.loads[load] / base)

    def rain_loss(self, kind: str, by: Literal["drops", "review"]) -> Float:
        """(bins, seeds) [W] power loss in rain of a class, only below rated power."""
        if (kind, by) not in self.wet:
            below = self.at(self.over_speed(self.response.below), np.array([STANDARD]))[0]
            lost = np.interp(self.middle, self.speeds, self.rain_power(kind, by))
            self.wet[kind, by] = lost[:, None] * np.clip(below, 0.0, 1.0)
        return self.wet[kind, by]

    def rain_power(self, kind: str, by: Literal["drops", "review"]) -> list[float]:
        """[W] generator power loss in rain of a class at the wind speeds of the response."""
        r, rain = self.response, Rain.model_validate({"kind": kind, "mode": "integrated" if by == "drops" else "seed"})
        if by == "drops":
            lost = [rain_loads(r.turbine, rain, p.wind.speed, p.rotor_speed, p.pitch).power for p in r.points]
        else:
            parameters = rain_parameters(rain, r.turbine.rotor_radius)
            lost = [float(rain_power_loss(parameters, p.wind.speed)) for p in r.points]
        drivetrain = r.turbine.drivetrain
        return [drivetrain.generator_efficiency * drivetrain.gearbox_efficiency * power for power in lost]


def densities(climate: Climate, what: Literal["altitude", "temperature", "humidity"]) -> Float:
    """(12,) [kg/m^3] with the effects up to the named one."""
    if what == "humidity":
        return climate.density
    if what == "temperature":
        return climate.replace(humidity=np.zeros(12)).density
    if climate.pressure is not None:
        air = Air(pressure=float(np.average(climate.pressure, weights=MONTH_HOURS)))
    else:
        air = Air(altitude=climate.altitude)
    return np.full(12, air.at([0.0])[-1][0])


def a_year(curves: Curves, climate: Climate, first: Climate) -> Year:
    """A year at a site.

    Args:
      curves: of the turbine.
      climate: of the site.
      first: whose wind is common to all.
    """
    response = curves.response
    hours = climate.wind_hours(EDGES, response.turbine.hub_height)
    common = first.wind_hours(EDGES, response.turbine.hub_height)

    def produced(density: Float, time: Float = hours) -> Float:
        return np.asarray(3600.0 * np.einsum("mb,mbs->s", time, curves.clean(density)))

    reference = produced(np.full(12, STANDARD))
    sums = {what: produced(densities(climate, what)) for what in AIR}
    steps = {what: sums[what] - before for what, before in zip(sums, [reference, *sums.values()], strict=False)}
    steps["rain"] = -_rain(curves, climate, hours, "drops")
    steps["ice"] = -_ice(curves, climate, hours)
    mean = np.full(12, np.average(climate.density, weights=hours.sum(axis=1)))
    # rated wind goes with the density to the power of -1/3
    known = np.array(response.setup.densities) ** (-1.0 / 3.0)
    rated = np.interp(climate.density ** (-1.0 / 3.0), known[::-1], response.rated_wind[::-1])
    return Year(
        climate=climate,
        density=climate.density,
        rated_wind=rated,
        reference=reference,
        steps=steps,
        constant=produced(mean) - sums["humidity"],
        seed_rain=-_rain(curves, climate, hours, "review"),
        loads={name: _loads(curves, climate, hours, name) for name in SLOPES},
        common=produced(climate.density, common),
        scenarios={name: _all(curves, climate.shifted(**shift)) for name, shift in SCENARIOS.items()},
    )


def _all(curves: Curves, climate: Climate) -> Float:
    """(seeds,) [J] annual energy with all effects."""
    hours = climate.wind_hours(EDGES, curves.response.turbine.hub_height)
    dry = 3600.0 * np.einsum("mb,mbs->s", hours, curves.clean(climate.density))
    return np.asarray(dry - _rain(curves, climate, hours, "drops") - _ice(curves, climate, hours))


def _rain(curves: Curves, climate: Climate, hours: Float, by: Literal["drops", "review"]) -> Float:
    """(seeds,) [J] annual energy loss by rain, at most the energy itself."""
    clean = curves.clean(climate.density)
    lost = np.zeros(clean.shape[-1])
    for kind, wet in climate.rain_hours.items():
        share = hours * (wet / MONTH_HOURS)[:, None]
        lost += 3600.0 * np.einsum("mb,mbs->s", share, np.minimum(clean, curves.rain_loss(kind, by)))
    return lost


def _ice(curves: Curves, climate: Climate, hours: Float) -> Float:
    """(seeds,) [J] annual energy loss by ice."""
    share = hours * (climate.icing_hours / MONTH_HOURS)[:, None]
    kept = (1.0 - SHED_SHARE) * curves.ice_ratio(ICED) + SHED_SHARE * curves.ice_ratio(SHED)
    return np.asarray(3600.0 * np.einsum("mb,mbs,bs->s", share, curves.clean(climate.density), 1.0 - kept))


def _loads(curves: Curves, climate: Climate, hours: Float, name: str) -> dict[str, Float]:
    """(seeds,) damage-equivalent load of the hours in operation, effects added one by one.

    What rain adds to a load goes with the water that it puts into the air.
    """
    m = SLOPES[name]
    clean = curves.over_speed(curves.response.loads[name])
    damage = {"reference": curves.at(clean, np.full(12, STANDARD)) ** m}
    for what in AIR:
        damage[what] = curves.at(clean, densities(climate, what)) ** m
    own, wet = damage[AIR[-1]], curves.load_ratio(WET, name) - 1.0
    more = np.zeros_like(own)
    for kind, time in climate.rain_hours.items():
        water = float(water_content(Rain(kind=kind).intensity) / water_content(RAIN.intensity))
        more += (time / MONTH_HOURS)[:, None, None] * ((1.0 + water * wet) ** m - 1.0)
    damage["rain"] = own * (1.0 + more)
    ice = (1.0 - SHED_SHARE) * curves.load_ratio(ICED, name) ** m + SHED_SHARE * curves.load_ratio(SHED, name) ** m
    damage["ice"] = damage["rain"] + own * (climate.icing_hours / MONTH_HOURS)[:, None, None] * (ice - 1.0)
    weight = hours / hours.sum()
    return {what: np.asarray(np.einsum("mb,mbs->s", weight, x) ** (1.0 / m)) for what, x in damage.items()}
