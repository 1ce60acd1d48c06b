"""S-N curves as data, and damage by Palmgren and Miner: of counted cycles, and of a spectrum (F-62 to F-65).

Curves are tables in MPa; stresses here are in N/m^2.
"""

from __future__ import annotations

from functools import cache
from math import inf, log10
from pathlib import Path
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record
from meltemi.postprocess.cycles import Cycles

Float = NDArray[np.float64]
Environment = Literal["air", "cathodic", "free"]
Spectral = Literal["dirlik", "narrow_band"]

MPA = 1e6
COMMON, PLAUSIBLE = 2e6, (20.0, 400.0)
"""Cycles at which the strength [MPa] of a welded detail lies within these bounds."""
FILE = Path(__file__).with_name("sn_curves.yaml")


class Line(Record):
    """One or two straight lines of an S-N curve in logarithms."""

    slopes: tuple[float, ...] = Field(min_length=1, max_length=2)
    """Slopes m."""
    log_a: tuple[float, ...]
    """Common logarithms of the cycles at a range of 1 MPa."""
    knee: float = Field(default=inf, gt=1.0)
    """[cycles] where the second line begins."""
    thickness_exponent: float | None = Field(default=None, ge=0.0, le=0.5)
    """Exponent of the effect of thickness; by default that of the detail."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.log_a) != len(self.slopes) or (len(self.slopes) == 2) != (self.knee < inf):
            raise ValueError("each slope needs its log_a, and two slopes need a knee")
        strength = self.range_at(min(COMMON, self.knee))
        if not PLAUSIBLE[0] <= strength <= PLAUSIBLE[1]:
            raise ValueError(
                f"log_a gives a strength of {strength:.3g} MPa at {min(COMMON, self.knee):.2g} cycles, expected 20 to 400: "
                "is it in Pa or ksi? It is in MPa"
            )
        if len(self.slopes) == 2:
            other = (self.log_a[1] - log10(self.knee)) / self.slopes[1]
            if abs(other - log10(self.range_at(self.knee))) > 0.005:
                raise ValueError("the two lines do not meet at the knee")
        return self

    def range_at(self, cycles: float) -> float:
        """[MPa] range at a number of cycles on the first line."""
        return float(10.0 ** ((self.log_a[0] - log10(cycles)) / self.slopes[0]))


class Detail(Record):
    """S-N curves of a detail in air, in sea water with cathodic protection, and in free corrosion."""

    thickness_exponent: float = Field(default=0.0, ge=0.0, le=0.5)
    """Exponent of the effect of thickness."""
    reference_thickness: float | None = Field(default=None, gt=0.0, lt=0.2)
    """[m; 0.016 to 0.025] thickness above which strength decreases; by default that of the edition."""
    air: Line | None = None
    cathodic: Line | None = None
    free: Line | None = None


class Edition(Record):
    """S-N curves of one source."""

    source: str
    """Standard, edition and table."""
    unit: str
    """Unit of ranges: MPa."""
    reference_thickness: float = Field(default=0.025, gt=0.0, lt=0.2)
    """[m; 0.016 to 0.025] thickness above which strength decreases."""
    curves: dict[str, Detail]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.unit != "MPa":
            raise ValueError(f"unit {self.unit!r}: expected MPa; convert log_a by adding slope times log10(MPa per unit)")
        return self


class Editions(Record):
    """Sources of S-N curves by edition."""

    editions: dict[str, Edition]


class Curve(NamedTuple):
    """An S-N curve: ranges in MPa, thickness in m."""

    name: str
    source: str
    line: Line
    exponent: float
    reference: float

    def factor(self, thickness: float | None) -> float:
        """Factor of the ranges for the thickness [m] (F-62)."""
        return max((thickness or 0.0) / self.reference, 1.0) ** self.exponent

    def rate(self, ranges: Float, thickness: float | None = None) -> Float:
        """Damage of one cycle of each range [N/m^2] (F-62)."""
        S = np.maximum(np.asarray(ranges) * (self.factor(thickness) / MPA), 1e-12)
        damage = S ** self.line.slopes[0] * 10.0 ** -self.line.log_a[0]
        if len(self.line.slopes) == 2:
            damage = np.where(damage * self.line.knee >= 1.0, damage, S ** self.line.slopes[1] * 10.0 ** -self.line.log_a[1])
        return damage

    def damage(self, cycles: Cycles, thickness: float | None = None) -> float:
        """Damage of cycles with ranges in N/m^2 (F-63)."""
        return float(cycles.counts @ self.rate(cycles.ranges, thickness))


@cache
def editions() -> dict[str, Edition]:
    """Editions that come with the package."""
    return read_record(FILE, Editions).editions


def sn_curve(name: str = "T", environment: Environment = "cathodic", edition: str = "2016") -> Curve:
    """An S-N curve.

    Args:
      name: detail: B1 to F3, or T of tubular joints.
      environment: air, sea water with cathodic protection, or free corrosion.
      edition: year of DNV-RP-C203, or path of a YAML file with source, unit and curves.

    Raises:
      InputError: there is no such curve, or the file is not valid, such as in another unit than MPa.
    """
    known = editions()
    if edition not in known and not edition.endswith((".yaml", ".yml")):
        raise InputError(f"S-N curve: no edition {edition!r}: {did_you_mean(edition, known)}, or the path of a YAML file")
    given = known[edition] if edition in known else read_record(edition, Edition)
    if name not in given.curves:
        raise InputError(f"S-N curve: {given.source} has no curve {name!r}: {did_you_mean(name, given.curves)}")
    detail = given.curves[name]
    line = getattr(detail, environment, None)
    if line is None:
        have = [each for each in ("air", "cathodic", "free") if getattr(detail, each) is not None]
        raise InputError(f"S-N curve {name}: not for {environment!r}; {given.source} has {', '.join(have)}")
    exponent = detail.thickness_exponent if line.thickness_exponent is None else line.thickness_exponent
    reference = detail.reference_thickness or given.reference_thickness
    return Curve(f"{name}, {environment}", given.source, line, exponent, reference)


def spectral_damage(
    frequency: Float,
    density: Float,
    duration: float,
    curve: Curve,
    thickness: float | None = None,
    method: Spectral = "dirlik",
) -> float:
    """Damage of a Gaussian stress from its spectrum (F-64, F-65).

    Args:
      frequency: (F,) [Hz] evenly spaced from zero.
      density: (F,) [(N/m^2)^2/Hz] one-sided spectral density.
      duration: [s] over which damage is summed.
      curve: S-N curve.
      thickness: [m] of the plate.
      method: ``dirlik``, or ``narrow_band``: ranges of a narrow-banded stress (Rayleigh), an upper bound.
    """
    df = frequency[1] - frequency[0]
    m0, m1, m2, m4 = (float(np.sum(frequency**k * density) * df) for k in (0, 1, 2, 4))
    if m0 <= 0.0:
        return 0.0
    z = np.linspace(0.0, 12.0, 4801)[1:]  # range over two standard deviations
    if method == "narrow_band":
        rate, pdf = np.sqrt(m2 / m0), z * np.exp(-0.5 * z**2)
    else:
        rate, g, x = np.sqrt(m4 / m2), m2 / np.sqrt(m0 * m4), m1 / m0 * np.sqrt(m2 / m4)
        d1 = 2.0 * (x - g**2) / (1.0 + g**2)
        r = (g - x - d1**2) / (1.0 - g - d1 + d1**2)
        d2 = (1.0 - g - d1 + d1**2) / (1.0 - r)
        d3, q = 1.0 - d1 - d2, 1.25 * (g - (1.0 - d1 - d2) - d2 * r) / d1
        pdf = d1 / q * np.exp(-z / q) + d2 * z / r**2 * np.exp(-0.5 * (z / r) ** 2) + d3 * z * np.exp(-0.5 * z**2)
    return float(duration * rate * np.sum(pdf * curve.rate(2.0 * np.sqrt(m0) * z, thickness)) * (z[1] - z[0]))
