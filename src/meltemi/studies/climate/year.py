"""A year at a site: energy and lifetime loads from the turbine's response and the weather.

Each period, a month of a climate or an hour of a weather file, has an air density and hours of wind
speeds, rain and ice. Power in turbulence is interpolated in the wind speed (monotone cubic) and in the
density (through three values). Weather effects are added successively: altitude (the mean pressure, where pressures
are measured), temperature, humidity, rain, ice; contributions are relative to the annual energy, or to a load, at 1.225
kg/m^3 in the same wind. Hours of rain and ice are distributed over all wind speeds of their period.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.drops import water_content
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi.studies.climate.climates import Climate
from meltemi.studies.climate.response import ICED, RAIN, SHED, SLOPES, WET, Response
from meltemi.studies.climate.weather import Effect, Periods, periods
from meltemi.studies.rain_drops import rain_loads

Float = NDArray[np.float64]

BIN = 0.5
"""[m/s] width of the bins of a year, from cut-in to cut-out."""
AIR: Final[tuple[Effect, ...]] = ("altitude", "temperature", "humidity")
STEPS = (*AIR, "rain", "ice")
"""Effects in the order in which they are added."""
SHED_SHARE = 0.1
"""Share of the hours with ice in which one blade has shed its ice: an assumption, for want of statistics."""


@dataclass(frozen=True)
class SiteYear:
    """Annual results at a site, for each seed.

    Attributes:
      climate: the periods.
      hours: (N, bins) [h] hours of each period in the bins of wind speed in operation.
      density: (N,) [kg/m^3] air density.
      rated_wind: (N,) [m/s] rated wind speed.
      by_period, base_by_period: (N,) [J] energy with clean blades in the site's dry air, and at 1.225 kg/m^3; means
        over seeds.
      reference: (seeds,) [J] annual energy at 1.225 kg/m^3, dry and without ice.
      steps: (seeds,) [J] successive contributions of the effects.
      constant: (seeds,) [J] excess of energy with the annual mean density over that with densities of the periods.
      seed_rain: (seeds,) [J] loss by rain by the review's formula, drops of 3 mm, instead of by drops on the blades.
      loads: (seeds,) [N m] annual equivalent loads by channel: at 1.225 kg/m^3 (``reference``), and with the effects
        up to each of the steps.
    """

    climate: Periods
    hours: Float
    density: Float
    rated_wind: Float
    by_period: Float = field(repr=False)
    base_by_period: Float = field(repr=False)
    reference: Float
    steps: Mapping[str, Float]
    constant: Float
    seed_rain: Float
    loads: Mapping[str, Mapping[str, Float]]

    @property
    def energy(self) -> Float:
        """(seeds,) [J] annual energy with all effects."""
        return self.reference + sum(self.steps.values())


@dataclass(frozen=True)
class SiteYears:
    """Annual results of a turbine at sites, and the response behind them."""

    response: Response
    years: Mapping[str, SiteYear]

    @classmethod
    def of(cls, response: Response, sites: Iterable[Climate | Periods]) -> SiteYears:
        """Annual results at sites, by their names."""
        curves = Curves(response)
        return cls(response, {site.name: a_year(curves, site) for site in sites})


class Curves:
    """Power and loads at the centres of the wind speed bins."""

    def __init__(self, response: Response) -> None:
        self.response = response
        self.speeds, self.densities = np.array(response.setup.speeds), np.array(response.setup.densities)
        turbine = response.turbine
        self.edges = np.arange(turbine.cut_in, turbine.cut_out + 0.01, BIN)
        self.middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        self.produced = self.power(response.power)
        self.wet: dict[tuple[str, str], Float] = {}

    def over_speed(self, values: Float) -> Float:
        """(..., bins, seeds) interpolated from (..., speeds, seeds), constant beyond the outermost speeds."""
        from scipy.interpolate import PchipInterpolator

        inside = np.clip(self.middle, self.speeds[0], self.speeds[-1])
        interpolated: Float = PchipInterpolator(self.speeds, values, axis=-2)(inside)
        return interpolated

    def power(self, values: Float) -> Float:
        """Power at wind speeds, as ``over_speed``; below the smallest speed it is cubic in the wind speed."""
        slow = np.minimum(self.middle / self.speeds[0], 1.0) ** 3
        return self.over_speed(values) * slow[:, None]

    def at(self, values: Float, density: Float) -> Float:
        """(N, bins, seeds) from (densities, bins, seeds) by Lagrange interpolation in density."""
        x, result = self.densities, np.zeros((len(density), *values.shape[1:]))
        for i, value in enumerate(values):
            others = np.delete(x, i)
            weight = np.prod((density[:, None] - others) / (x[i] - others), axis=1)
            result += weight[:, None, None] * value
        return result

    def clean(self, density: Float) -> Float:
        """(N, bins, seeds) [W] power with clean blades in periods of a density."""
        rated = self.response.turbine.rated_power
        return np.clip(self.at(self.produced, density), 0.0, 1.02 * rated)

    def hours(self, climate: Periods) -> Float:
        """(N, bins) [h] hours of each period in the bins of the wind speed at the hub."""
        return climate.wind_hours(self.edges, self.response.turbine.hub_height)

    def energy(self, density: Float, hours: Float) -> Float:
        """(seeds,) [J] energy with clean blades in dry periods of a density."""
        return np.asarray(3600.0 * np.einsum("mb,mbs->s", hours, self.clean(density)))

    def by_period(self, density: Float, hours: Float) -> Float:
        """(N,) [J] energy of each period, mean over seeds."""
        return np.asarray(3600.0 * np.einsum("mb,mbs->m", hours, self.clean(density)) / self.produced.shape[-1])

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


def a_year(curves: Curves, site: Climate | Periods) -> SiteYear:
    """Annual results at a site from the curves of a turbine."""
    climate = periods(site)
    response, hours = curves.response, curves.hours(climate)
    density = climate.density()
    reference = curves.energy(np.full(len(density), STANDARD), hours)
    sums = {what: curves.energy(climate.density(what), hours) for what in AIR}
    steps: dict[str, Float] = {
        what: sums[what] - before for what, before in zip(sums, [reference, *sums.values()], strict=False)
    }
    steps["rain"] = -_rain(curves, climate, hours, "drops")
    steps["ice"] = -_ice(curves, climate, hours)
    mean = np.full(len(density), np.average(density, weights=hours.sum(axis=1)))
    # rated wind speed is proportional to the density to the power of -1/3
    known = np.array(response.setup.densities) ** (-1.0 / 3.0)
    rated = np.interp(density ** (-1.0 / 3.0), known[::-1], response.rated_wind[::-1])
    return SiteYear(
        climate=climate,
        hours=hours,
        density=density,
        rated_wind=rated,
        by_period=curves.by_period(density, hours),
        base_by_period=curves.by_period(np.full(len(density), STANDARD), hours),
        reference=reference,
        steps=steps,
        constant=curves.energy(mean, hours) - sums["humidity"],
        seed_rain=-_rain(curves, climate, hours, "review"),
        loads={name: _loads(curves, climate, hours, name) for name in SLOPES},
    )


def whole_energy(curves: Curves, site: Climate | Periods) -> Float:
    """(seeds,) [J] annual energy with all effects."""
    climate = periods(site)
    hours = curves.hours(climate)
    dry = curves.energy(climate.density(), hours)
    return np.asarray(dry - _rain(curves, climate, hours, "drops") - _ice(curves, climate, hours))


def _rain(curves: Curves, climate: Periods, hours: Float, by: Literal["drops", "review"]) -> Float:
    """(seeds,) [J] annual energy loss by rain, at most the energy itself."""
    clean = curves.clean(climate.density())
    lost = np.zeros(clean.shape[-1])
    for kind, wet in climate.rain_hours.items():
        share = hours * (wet / climate.hours)[:, None]
        lost += 3600.0 * np.einsum("mb,mbs->s", share, np.minimum(clean, curves.rain_loss(kind, by)))
    return lost


def _ice(curves: Curves, climate: Periods, hours: Float) -> Float:
    """(seeds,) [J] annual energy loss by ice; none where ice was not simulated."""
    if ICED not in curves.response.states:
        return np.zeros(curves.produced.shape[-1])
    share = hours * (climate.icing_hours / climate.hours)[:, None]
    kept = (1.0 - SHED_SHARE) * curves.ice_ratio(ICED) + SHED_SHARE * curves.ice_ratio(SHED)
    return np.asarray(3600.0 * np.einsum("mb,mbs,bs->s", share, curves.clean(climate.density()), 1.0 - kept))


def _loads(curves: Curves, climate: Periods, hours: Float, name: str) -> dict[str, Float]:
    """(seeds,) damage-equivalent load of the hours in operation, effects added one by one.

    The load increment by rain is proportional to the water content of the air.
    """
    m = SLOPES[name]
    clean = curves.over_speed(curves.response.loads[name])
    states = curves.response.states
    damage: dict[str, Float] = {"reference": curves.at(clean, np.full(len(climate.hours), STANDARD)) ** m}
    for what in AIR:
        damage[what] = curves.at(clean, climate.density(what)) ** m
    dry, wet = damage[AIR[-1]], curves.load_ratio(WET, name) - 1.0 if WET in states else 0.0
    more = np.zeros_like(dry)
    for kind, time in climate.rain_hours.items():
        water = float(water_content(Rain(kind=kind).intensity) / water_content(RAIN.intensity))
        more += (time / climate.hours)[:, None, None] * ((1.0 + water * wet) ** m - 1.0)
    damage["rain"] = dry * (1.0 + more)
    damage["ice"] = damage["rain"]
    if ICED in states:
        ice = (1.0 - SHED_SHARE) * curves.load_ratio(ICED, name) ** m + SHED_SHARE * curves.load_ratio(SHED, name) ** m
        damage["ice"] = damage["rain"] + dry * (climate.icing_hours / climate.hours)[:, None, None] * (ice - 1.0)
    weight = hours / hours.sum()
    return {what: np.asarray(np.einsum("mb,mbs->s", weight, x) ** (1.0 / m)) for what, x in damage.items()}
