"""Conditions of a site in the sea: joint distribution of wind, waves and direction; storms, levels and currents.

Reference: docs/guide/load-case-tables.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_record
from meltemi.iec.classes import WindClass

FOLDER = Path(__file__).parent / "tables" / "metocean"
Seas = Literal["normal", "joint", "severe", "1-year", "50-year"]
Level = Literal["mean", "low", "high"]
NEAR_SURFACE = 0.01
"""Wind-driven current at still water, over the mean wind speed at 10 m."""


@dataclass(frozen=True)
class Waves:
    """Sea of a case.

    Attributes:
      height: [m] significant wave height.
      period: [s] peak period of the spectrum.
      misalignment: [deg] angle from the direction of the wind to that of the waves, clockwise from above.
      share: share of the time with this wind.
      level: [m] still water level.
      current: [m/s] current at still water, which decreases with depth by the power law.
      name: text that distinguishes it from the other seas of its row, in the names of cases.
    """

    height: float
    period: float
    misalignment: float = 0.0
    share: float = 1.0
    level: float = 0.0
    current: float = 0.0
    name: str = ""


class Storm(Record):
    """Extreme sea of a return period."""

    height: float = Field(gt=0.0, lt=30.0)
    """Significant wave height [m; 0.5 to 20]."""
    period: float = Field(gt=1.0, lt=60.0)
    """Peak period of the spectrum [s; 3 to 25]."""
    current: float = Field(default=0.0, ge=0.0, lt=10.0)
    """Current at still water [m/s; 0.05 to 4], which decreases with depth by the power law."""
    levels: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest still water level [m] above mean sea level."""


def _like_speed(record: Record, speed: NDArray[np.float64], names: Sequence[str]) -> None:
    """Reject arrays of a record that do not have one entry for each wind speed; None is skipped."""
    for name in names:
        values = getattr(record, name)
        if values is not None and len(values) != len(speed):
            raise ValueError(f"{name} must have {len(speed)} entries like speed, found {len(values)}")


class Scatter(Record):
    """Joint distribution of wind, waves and their directions: one entry for each class of conditions."""

    speed: Vector
    """(K,) mean wind speed at hub height [m/s; 3 to 60]."""
    height: Vector
    """(K,) significant wave height [m; 0.2 to 20]."""
    period: Vector
    """(K,) peak period of the spectrum [s; 3 to 25]."""
    misalignment: Vector | None = None
    """(K,) angle [deg] from the direction of the wind to that of the waves, clockwise from above; none: 0."""
    probability: Vector
    """(K,) share of the time, or number of observations: only their ratios at a wind speed count."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        _like_speed(self, self.speed, ("height", "period", "misalignment", "probability"))
        if self.height.min() <= 0.0 or self.period.min() <= 1.0:
            raise ValueError("height must be above 0 and period above 1 s")
        if self.probability.min() < 0.0 or self.probability.max() <= 0.0:
            raise ValueError("probability must be 0 or more, and one above 0")
        return self


class Metocean(Record):
    """Wind, waves, currents and levels of a site in the sea."""

    name: str = Field(min_length=1)
    """Name of the site."""
    source: str = ""
    """Source of the values."""
    wind_class: str | WindClass = "IB"
    """Class whose turbulence and extreme winds the site has; an option of the command replaces it."""
    weibull_scale: float | None = Field(default=None, gt=0.0, le=60.0)
    """Scale parameter of the distribution of the wind speed [m/s; 4 to 20]; by default Rayleigh's with the mean of the
    class."""
    weibull_shape: float = Field(default=2.0, gt=0.5, le=10.0)
    """Shape parameter of the distribution of the wind speed [-; 1 to 4]."""
    shear_exponent: float = Field(default=0.14, gt=-1.0, lt=1.0)
    """Shear exponent of the mean wind in normal conditions [-; 0.02 to 0.5]."""
    speed: Vector
    """(n,) wind speeds of ``height`` and ``period`` [m/s; 10 to 60], increasing; in between linear, beyond constant."""
    height: Vector
    """(n,) expected significant wave height [m; 0.5 to 20]."""
    period: Vector
    """(n,) expected peak period of the spectrum [s; 3 to 25]."""
    misalignment: Vector = Field(default_factory=lambda: np.zeros(1))
    """(M,) angles [deg] from the direction of the wind to that of the waves, clockwise from above, at all speeds."""
    misalignment_share: Vector = Field(default_factory=lambda: np.ones(1))
    """(M,) share of the time of each misalignment."""
    scatter: Scatter | None = None
    """Joint distribution, which replaces expected values and misalignments in fatigue."""
    severe_height: Vector | None = None
    """(n,) or (1,) significant wave height of the severe sea [m; 0.5 to 25]."""
    severe_period: Vector | None = None
    """(n,) or (1,) peak period of the severe sea [s; 3 to 25]."""
    one_year: Storm | None = None
    """Extreme sea with a return period of 1 year."""
    fifty_years: Storm | None = None
    """Extreme sea with a return period of 50 years."""
    current: float = Field(default=0.0, ge=0.0, lt=10.0)
    """Tidal current in normal conditions [m/s; 0.02 to 4] at still water, which decreases with depth by the power
    law."""
    wind_current: float = Field(default=NEAR_SURFACE, ge=0.0, lt=0.2)
    """Wind-driven current at still water [-; 0.003 to 0.1], over the mean wind speed at 10 m."""
    levels: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest still water level [m] in normal conditions, above mean sea level."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.speed) < 2 or np.any(np.diff(self.speed) <= 0.0):
            raise ValueError("speed needs at least 2 entries that increase")
        severe = [name for name in ("severe_height", "severe_period") if getattr(self, name) is not None]
        _like_speed(self, self.speed, ["height", "period", *(n for n in severe if len(getattr(self, n)) != 1)])
        for name in ("height", "period", *severe):
            least, text = (1.0, "1 s") if name.endswith("period") else (0.0, "0 m")
            if getattr(self, name).min() <= least:
                raise ValueError(f"{name} must be above {text}")
        if (self.severe_height is None) != (self.severe_period is None):
            raise ValueError("severe_height and severe_period come together")
        shares = self.misalignment_share
        if len(shares) != len(self.misalignment) or abs(shares.sum() - 1.0) > 1e-6 or shares.min() < 0.0:
            raise ValueError("misalignment_share needs one share for each misalignment, and their sum must be 1")
        if len(set(self.misalignment.tolist())) != len(self.misalignment):
            raise ValueError("misalignment: an angle appears twice")
        for levels in (self.levels, *(storm.levels for storm in (self.one_year, self.fifty_years) if storm)):
            if levels[0] > levels[1]:
                raise ValueError(f"levels: the lowest is above the highest: {levels[0]:g}, {levels[1]:g} m")
        return self

    def storm(self, seas: Seas) -> Storm | None:
        """Extreme sea of a return period; None if the site has none, or ``seas`` are not extreme."""
        return {"1-year": self.one_year, "50-year": self.fifty_years}.get(seas)

    def lacks(self, seas: Seas) -> str:
        """Key of a sea that the site does not have; empty if the site has the sea."""
        if seas == "severe":
            return "severe_height" if self.severe_height is None else ""
        key = {"1-year": "one_year", "50-year": "fifty_years"}.get(seas, "")
        return key if key and self.storm(seas) is None else ""

    def expected(self, seas: Seas, speed: float) -> tuple[float, float]:
        """Significant wave height [m] and peak period [s] at a wind speed [m/s]."""
        storm = self.storm(seas)
        if storm is not None:
            return storm.height, storm.period
        height, period = self.height, self.period
        if seas == "severe":
            assert self.severe_height is not None and self.severe_period is not None
            height, period = self.severe_height, self.severe_period
        return _at(speed, self.speed, height), _at(speed, self.speed, period)

    def waves(
        self, seas: Seas, speed: float, low: float, high: float, misalignments: list[float], levels: list[Level]
    ) -> list[Waves]:
        """Seas of a row of a load case table at a wind speed.

        Args:
          seas: kind of sea; "joint": those of the joint distribution in the bin, or at the nearest speed if the bin has
            none; all others have a share of 1.
          speed: [m/s] mean wind speed.
          low, high: [m/s] edges of the bin of the speed.
          misalignments: [deg] misalignments of seas that are not of the joint distribution.
          levels: still water levels; equal ones count once.
        """
        if seas == "joint":
            return self._joint(speed, low, high)
        height, period = self.expected(seas, speed)
        storm = self.storm(seas)
        current = self.current if storm is None else storm.current
        lowest, highest = self.levels if storm is None else storm.levels
        heights, names = {"mean": 0.0, "low": lowest, "high": highest}, dict[float, str]()
        for name in levels:  # equal levels count once: "low" and "high" are the same where the site has no tide
            names.setdefault(heights[name], name)
        waves = []
        for misalignment, (level, label) in product(misalignments, names.items()):
            parts = [f"m{misalignment:.6g}"] * (len(misalignments) > 1) + [label] * (len(names) > 1)
            waves.append(Waves(height, period, misalignment, 1.0, level, current, "-".join(parts)))
        return waves

    def _joint(self, speed: float, low: float, high: float) -> list[Waves]:
        if self.scatter is None:
            height, period = self.expected("joint", speed)
            several = len(self.misalignment) > 1
            pairs = zip(self.misalignment.tolist(), self.misalignment_share.tolist(), strict=True)
            return [Waves(height, period, m, share, name=f"m{m:.6g}" if several else "") for m, share in pairs if share]
        s = self.scatter
        inside: NDArray[np.bool_] = (s.speed >= low) & (s.speed < high) & (s.probability > 0.0)
        if not inside.any():
            nearest = np.flatnonzero(s.probability > 0.0)
            inside = (s.speed == s.speed[nearest[np.abs(s.speed[nearest] - speed).argmin()]]) & (s.probability > 0.0)
        total = float(s.probability[inside].sum())
        misalignment = np.zeros(len(s.speed)) if s.misalignment is None else s.misalignment
        shares: dict[tuple[float, float, float], float] = {}
        for i in np.flatnonzero(inside):
            sea = (float(s.height[i]), float(s.period[i]), float(misalignment[i]))
            shares[sea] = shares.get(sea, 0.0) + float(s.probability[i]) / total
        return [Waves(*sea, share, name="h{:.6g}-t{:.6g}-m{:.6g}".format(*sea)) for sea, share in shares.items()]


def _at(speed: float, speeds: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    return float(values[0]) if len(values) == 1 else round(float(np.interp(speed, speeds, values)), 6)


def list_metocean() -> list[str]:
    """Names of the sites of the package."""
    return sorted(path.stem for path in FOLDER.glob("*.yaml"))


def metocean_file(name: str | Path) -> Path:
    """File of a site: a path, or the name of a site of the package.

    Raises:
      InputError: there is no such file or site.
    """
    path = Path(name)
    if path.is_file():
        return path
    if path.suffix or len(path.parts) > 1:
        raise InputError(f"{path}: no such file; a site of the package is one of {', '.join(list_metocean())}")
    if str(name) not in list_metocean():
        raise InputError(f"no site {str(name)!r}; {did_you_mean(str(name), list_metocean())}")
    return FOLDER / f"{name}.yaml"


def read_metocean(name: str | Path) -> Metocean:
    """Conditions of a site in the sea: a YAML file, or the name of a site of the package.

    Raises:
      InputError: there is no such site, or it is not valid.
    """
    return read_record(metocean_file(name), Metocean)


def wind_driven(site: Metocean, speed: float, hub_height: float) -> float:
    """Current [m/s] at still water driven by a mean wind speed [m/s] at hub height [m], from its value at 10 m."""
    return round(site.wind_current * speed * (10.0 / hub_height) ** site.shear_exponent, 6)
