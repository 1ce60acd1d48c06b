"""S-N curves as data, and damage by Palmgren and Miner: of counted cycles, and of a spectrum (F-62 to F-65).

Curves are tables in MPa; stresses here are in N/m^2.
"""

from __future__ import annotations

from functools import cache
from math import inf, log10
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_mapping, read_record, validated
from meltemi.postprocess.cycles import Cycles

Float = NDArray[np.float64]
Environment = Literal["air", "cathodic", "free"]
Spectral = Literal["dirlik", "narrow_band"]

MPA = 1e6
COMMON, PLAUSIBLE = 2e6, (20.0, 400.0)
"""Cycles at which the strength [MPa] of a welded detail lies within these bounds."""
MEET = 0.005
"""Largest jump of the logarithm of the range at the knee."""
FILE = Path(__file__).with_name("sn_curves.yaml")


class Curve(Record):
    """An S-N curve of one or two straight lines in logarithms, in MPa."""

    m: tuple[float, ...] = Field(min_length=1, max_length=2)
    """Slopes."""
    log_a: tuple[float, ...]
    """Common logarithms of the cycles at a range of 1 MPa."""
    knee: float = Field(default=inf, gt=1.0)
    """[cycles] where the second line begins."""
    cutoff: float = Field(default=inf, gt=1.0)
    """[cycles; 1e8] ranges that are survived for longer do no damage (cut-off limit)."""
    exponent: float = Field(default=0.0, ge=0.0, le=0.5)
    """Exponent of the effect of thickness."""
    reference: float = Field(default=0.025, gt=0.0, lt=0.2)
    """[m; 0.016 to 0.025] thickness above which strength decreases."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.log_a) != len(self.m) or (len(self.m) == 2) != (self.knee < inf):
            raise ValueError("each slope needs its log_a, and two slopes need a knee")
        cycles = min(COMMON, self.knee)
        strengths = [10.0 ** ((a - log10(cycles)) / m) for a, m in zip(self.log_a, self.m, strict=True)]
        if not PLAUSIBLE[0] <= strengths[0] <= PLAUSIBLE[1]:
            raise ValueError(
                f"log_a gives a strength of {strengths[0]:.3g} MPa at {cycles:.2g} cycles, expected 20 to 400: "
                "is it in Pa or ksi? It is in MPa"
            )
        at_knee = [(a - log10(self.knee)) / m for a, m in zip(self.log_a, self.m, strict=True)]
        if abs(at_knee[-1] - at_knee[0]) > MEET:
            raise ValueError("the two lines do not meet at the knee")
        return self

    def rate(self, ranges: Float, thickness: float | None = None) -> Float:
        """Damage of one cycle of each range [N/m^2] at a wall of a thickness [m] (F-62)."""
        thick = max((thickness or 0.0) / self.reference, 1.0) ** self.exponent
        S = np.maximum(np.asarray(ranges) * (thick / MPA), 1e-12)
        lines = [S**m * 10.0**-a for a, m in zip(self.log_a, self.m, strict=True)]
        rate = lines[0] if len(lines) == 1 else np.where(lines[0] * self.knee >= 1.0, *lines)
        return np.where(rate * self.cutoff >= 1.0, rate, 0.0)

    def damage(self, cycles: Cycles, thickness: float | None = None) -> float:
        """Damage of cycles with ranges in N/m^2 (F-63)."""
        return float(cycles.counts @ self.rate(cycles.ranges, thickness))


class Source(Record):
    """S-N curves of a standard, by detail and environment."""

    source: str
    """Standard, edition and table."""
    unit: str
    """Unit of ranges: MPa."""
    curves: dict[str, dict[Environment, Curve]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.unit != "MPa":
            raise ValueError(f"unit {self.unit!r}: expected MPa; add m times log10(MPa per unit) to log_a")
        return self


@cache
def editions() -> dict[str, Source]:
    """Editions that come with the package."""
    return {name: validated(data, Source, f"{FILE}: {name}") for name, data in read_mapping(FILE).items()}


def sn_curve(name: str = "T", environment: Environment = "cathodic", edition: str = "2016") -> Curve:
    """An S-N curve.

    Args:
      name: detail: B1 to W3, or T of tubular joints; of EN 1993-1-9 the detail category, 36 to 160.
      environment: air, sea water with cathodic protection, or free corrosion.
      edition: year of DNV-RP-C203, ``EN1993``, or path of a YAML file with source, unit and curves.

    Raises:
      InputError: there is no such curve, or the file is not valid, such as in another unit than MPa.
    """
    known = editions()
    if edition not in known and not edition.endswith((".yaml", ".yml")):
        raise InputError(
            f"S-N curve: no edition {edition!r}: {did_you_mean(edition, known)}, or the path of a YAML file"
        )
    given = known[edition] if edition in known else read_record(edition, Source)
    if name not in given.curves:
        raise InputError(f"S-N curve: {given.source} has no curve {name!r}: {did_you_mean(name, given.curves)}")
    if environment not in given.curves[name]:
        have = ", ".join(given.curves[name])
        raise InputError(f"S-N curve {name}: not for {environment!r}; {given.source} has {have}")
    return given.curves[name][environment]


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
