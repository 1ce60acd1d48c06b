"""Suitability of a turbine for a site: lifetime loads there over those of its design class, from a surrogate.

Equations LS-8, LS-13 and LS-14 of ``docs/theory/surrogate.md``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_record
from meltemi.iec.classes import WindClass, as_class, sigma_ntm
from meltemi.loads.effective import checked_neighbours, effective_intensity
from meltemi.loads.loadbase.site import read_site
from meltemi.loads.loadbase.weights import Weibull
from meltemi.loads.surrogate.model import Float, LoadModel, Surrogate
from meltemi.loads.surrogate.space import SPEED

STEP = 0.5
"""Width [m/s] of the bins of wind speed."""
YAW = ((-1.0, 0.25), (0.0, 0.5), (1.0, 0.25))
"""Yaw errors over the usual yaw error, and their shares of the time."""
BAND = 1.645
"""Standard deviations to each end of an interval of 90 %."""


class Sector(Record):
    """Wind conditions of a direction sector, or of all directions, at hub height."""

    frequency: float = Field(default=1.0, ge=0.0, le=1.0)
    """Share of the time with wind from the sector."""
    weibull_scale: float = Field(gt=0.0, le=60.0)
    """Scale parameter [m/s] of the distribution of the wind speed."""
    weibull_shape: float = Field(default=2.0, gt=0.5, le=10.0)
    speed: Vector
    """(n,) wind speeds [m/s] of the turbulence intensities, increasing."""
    intensity: Vector
    """(n,) turbulence intensity: the 90 % quantile, or an effective one if ``neighbours`` of the site are left out."""
    thrust_coefficient: Vector | None = None
    """(n,) thrust coefficient of the neighbours, for their wakes; by default 7 m/s over the wind speed, as in IEC
    61400-1 edition 3."""
    shear_exponent: float = Field(default=0.2, gt=-1.0, lt=1.0)
    air_density: float = Field(default=1.225, gt=0.0, lt=3.0)
    """Density [kg/m^3] of the air."""
    inclination: float = Field(default=0.0, ge=-0.5, le=0.5)
    """Inclination [rad] of the flow."""
    yaw_error: float = Field(default=math.radians(8.0), ge=0.0, le=1.0)
    """Usual yaw error [rad], of each sign in a quarter of the time."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not len(self.speed) or np.any(np.diff(self.speed) <= 0.0):
            raise ValueError("speed needs at least one entry, and must increase")
        if len(self.intensity) != len(self.speed):
            raise ValueError(f"intensity must have {len(self.speed)} entries like speed, found {len(self.intensity)}")
        if self.thrust_coefficient is not None and len(self.thrust_coefficient) != len(self.speed):
            raise ValueError(f"thrust_coefficient must have {len(self.speed)} entries like speed")
        return self

    def effective(self, speed: Float, neighbours: Sequence[float], slope: float) -> Float:
        """(k,) turbulence intensities at wind speeds [m/s], with the wakes of neighbours (K-17)."""
        ambient, ct = np.interp(speed, self.speed, self.intensity), 7.0 / speed
        if self.thrust_coefficient is not None:
            ct = np.interp(speed, self.speed, self.thrust_coefficient)
        if not neighbours:
            return ambient
        each = zip(speed, ambient, ct, strict=True)
        return np.array([effective_intensity(v, i, neighbours, slope=slope, thrust=c) for v, i, c in each])


class SiteTable(Record):
    """Conditions of a site by sector."""

    name: str = ""
    sectors: tuple[Sector, ...] = Field(min_length=1)
    """One for each direction sector, or a single one for all directions."""
    neighbours: tuple[float, ...] = ()
    """Distances of the neighbours in rotor diameters; the loads are then those of Frandsen's effective turbulence."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        whole = sum(sector.frequency for sector in self.sectors)
        if abs(whole - 1.0) > 0.01:
            raise ValueError(f"sectors: their frequencies must sum to 1, found {whole:.4g}")
        checked_neighbours(self.neighbours)
        return self

    def density(self, speed: Float) -> Float:
        """Probability density (k,) [s/m] of wind speeds [m/s]."""
        density = np.zeros(len(speed))
        for s in self.sectors:
            x, k = np.asarray(speed) / s.weibull_scale, s.weibull_shape
            density += s.frequency * k / s.weibull_scale * x ** (k - 1) * np.exp(-(x**k))
        return density


def read_site_table(path: str | Path, turbine: str | None = None) -> SiteTable:
    """Read the conditions of a site: YAML with ``sectors``, or the JSON form of IEC 61400-15-1.

    Args:
      path: file of the site.
      turbine: ID of the turbine in the JSON form; not needed if there is only one.

    Raises:
      InputError: the file cannot be read or is not valid.
    """
    if Path(path).suffix.lower() != ".json":
        if turbine is not None:
            raise InputError(f"{path}: only the JSON form of IEC 61400-15-1 has turbines to choose from")
        return read_record(path, SiteTable)
    site = read_site(path, turbine)
    names = ("weibull_scale", "weibull_shape", "speed", "intensity", "shear_exponent", "air_density", "inclination")
    return SiteTable(name=site.name, sectors=(Sector(**{name: getattr(site, name) for name in names}),))


def class_table(wind_class: str | WindClass, edition: int = 4) -> SiteTable:
    """Conditions of the normal turbulence model of a wind turbine class, as DLC 1.2 has them.

    Args:
      wind_class: wind turbine class such as IB.
      edition: edition of IEC 61400-1.

    Raises:
      InputError: there is no such class.
    """
    k = as_class(wind_class, None if isinstance(wind_class, WindClass) else edition)  # type: ignore[arg-type]
    speed = np.arange(1.0, 61.0)
    sector = Sector(
        weibull_scale=2.0 * k.v_ave / math.sqrt(math.pi),
        speed=speed,
        intensity=np.array([sigma_ntm(v, k) / v for v in speed]),
        inclination=math.radians(8.0),
    )
    return SiteTable(name=f"class {k.name}", sectors=(sector,))


def conditions_of(surrogate: Surrogate, site: SiteTable, slope: float = 10.0) -> tuple[Float, Float]:
    """Probabilities (k,) and values (k, d) of the variables of all conditions in production (LS-13).

    Args:
      slope: slope of the S-N curve, for the effective turbulence of neighbours.
    """
    low, high = surrogate.space.ends
    edge = np.linspace(low, high, max(round((high - low) / STEP), 1) + 1)
    middle = 0.5 * (edge[1:] + edge[:-1])
    probability, rows = [], []
    for s in site.sectors:
        wind = Weibull(s.weibull_scale, s.weibull_shape)
        share = np.array([wind.between(a, b) for a, b in pairwise(edge)])
        turbulence = s.effective(middle, site.neighbours, slope)
        for sign, part in YAW:
            at = {SPEED: middle, "turbulence_intensity": turbulence}
            constant = ("shear_exponent", "air_density", "inclination")
            at |= {name: np.full(len(middle), getattr(s, name)) for name in constant}
            at["yaw_error"] = np.full(len(middle), sign * s.yaw_error)
            at |= {v.name: np.full(len(middle), v.upper[0]) for v in surrogate.space.variables[1:] if v.name not in at}
            probability.append(s.frequency * part * share)
            rows.append(np.column_stack([at[name] for name in surrogate.space.names]))
    return np.concatenate(probability), np.concatenate(rows)


@dataclass(frozen=True)
class Margin:
    """Lifetime load of a site over that of the design conditions.

    Attributes:
      load: model of the load.
      site, design: equivalent loads at 1 Hz of the lifetime [N, N m], and their ``ratio``.
      low, high: ends of the 90 % interval of the ratio, from the number and scatter of the runs.
    """

    load: LoadModel
    site: float
    design: float
    low: float
    high: float

    @property
    def ratio(self) -> float:
        return self.site / self.design

    @property
    def verdict(self) -> str:
        """Whether the site's load is below that of the design: yes, no, or undecided if the interval contains 1."""
        if self.load.verdict == "not usable":
            return "undecided"
        return "yes" if self.high <= 1.0 else "no" if self.low > 1.0 else "undecided"


@dataclass(frozen=True)
class Suitability:
    """Margins of all loads at a site.

    Attributes:
      site, design: conditions of the site and of the design.
      margins: margins of the loads.
      outside: share of the time in production in which a variable takes the nearest bound, by variable.
    """

    site: SiteTable
    design: SiteTable
    margins: tuple[Margin, ...]
    outside: dict[str, float]

    @property
    def verdict(self) -> str:
        """``suitable`` (all loads are below those of the design), ``not suitable`` (one is above) or ``undecided``."""
        verdicts = [margin.verdict for margin in self.margins]
        return (
            "not suitable"
            if "no" in verdicts
            else "undecided"
            if "undecided" in verdicts or self.outside
            else "suitable"
        )


def site_suitability(surrogate: Surrogate, site: SiteTable, design: SiteTable) -> Suitability:
    """Compare lifetime loads of a site with those of the design conditions (LS-8, LS-14).

    Args:
      surrogate: surrogate of the turbine.
      site: conditions of the site.
      design: design conditions of the turbine, such as ``class_table("IB")``.
    """
    margins, outside = [], dict[str, float]()
    conditions = _by_slope(surrogate, (site, design))
    for model in surrogate.loads.values():
        (p, germ, beyond), (q, reference, _) = conditions[model.slope]
        outside |= {name: max(share, outside.get(name, 0.0)) for name, share in beyond.items()}
        at_site, of_design = model.lifetime(p, germ), model.lifetime(q, reference)
        ratio, wide = at_site[0] / of_design[0], BAND * float(np.log(at_site / of_design)[1:].std())
        margins.append(Margin(model, at_site[0], of_design[0], ratio * np.exp(-wide), ratio * np.exp(wide)))
    return Suitability(site, design, tuple(margins), outside)


def _by_slope(
    surrogate: Surrogate, tables: Sequence[SiteTable]
) -> dict[float, list[tuple[Float, Float, dict[str, float]]]]:
    """Conditions of the sites for each slope of the loads, on which the effective turbulence of neighbours depends."""
    slopes = {each.slope for each in surrogate.loads.values()}
    return {slope: [_clipped(surrogate, table, slope) for table in tables] for slope in slopes}


def _clipped(surrogate: Surrogate, table: SiteTable, slope: float) -> tuple[Float, Float, dict[str, float]]:
    probability, points = conditions_of(surrogate, table, slope)
    germ = surrogate.space.germ(points)
    beyond = (np.abs(germ) > 1.0 + 1e-9) & (probability > 0.0)[:, None]
    whole = max(float(probability.sum()), 1e-300)
    shares = {
        n: float(probability @ b) / whole for n, b in zip(surrogate.space.names, beyond.T, strict=True) if b.any()
    }
    return probability, np.clip(germ, -1.0, 1.0), shares


def lifetime_loads(surrogate: Surrogate, tables: Sequence[SiteTable]) -> dict[str, list[float]]:
    """Equivalent loads at 1 Hz of the lifetime by load, one for each site."""
    conditions = _by_slope(surrogate, tables)
    return {
        name: [float(each.lifetime(p, g, 1)[0]) for p, g, _ in conditions[each.slope]]
        for name, each in surrogate.loads.items()
    }
