"""An irregular sea: random waves of a spectrum.

Reference: docs/theory/sea.md (H-11 to H-19).
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.sea.airy import GRAVITY, WaveComponents
from meltemi.sea.conditions import BREAKS_IN_SHALLOWS, Sea, along, refuse_breaking
from meltemi.sea.crest import Crest
from meltemi.sea.spectra import default_peak_factor, jonswap
from meltemi.sea.spreading import Spreading

Float = NDArray[np.float64]
HIGHEST = 5.0
"""Highest frequency of the waves over that of the peak: 0.2 % of the energy lies above."""
MOST_COMPONENTS = 100_000
STEEPEST = 1.0 / 15.0
"""Significant wave height over the deep-water length at the peak."""


class UserSpectrum(Record):
    """A spectrum by its values, linear in between and zero beyond."""

    frequency: Vector
    """(K,) [rad/s] increasing frequencies."""
    density: Vector
    """(K,) [m^2 s/rad] one-sided density."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.frequency) < 2 or len(self.frequency) != len(self.density):
            raise ValueError(
                f"frequency and density need the same number of entries, at least 2; found {len(self.frequency)} and "
                f"{len(self.density)}"
            )
        if np.any(np.diff(self.frequency) <= 0.0) or self.frequency[0] < 0.0 or np.any(self.density < 0.0):
            raise ValueError("frequency must increase from 0 or more, and density be 0 or more")
        return self


class IrregularSea(Sea):
    """Random waves; the same seed gives the same sea."""

    kind: Literal["irregular"] = "irregular"
    height: float | None = Field(default=None, gt=0.0, lt=30.0)
    """[m; 0.1 to 20] significant wave height: four standard deviations of the elevation."""
    period: float | None = Field(default=None, gt=1.0, lt=60.0)
    """[s; 2 to 25] peak period."""
    spectrum: Literal["jonswap", "pierson_moskowitz", "white"] | UserSpectrum = "jonswap"
    """JONSWAP, Pierson-Moskowitz, constant up to the highest frequency, or by values."""
    peak_factor: float | None = Field(default=None, ge=1.0, le=20.0)
    """Peak enhancement of JONSWAP [-; 1 to 7]; by default that of the IEC for height and period."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] direction of travel, clockwise from above as that of the wind."""
    spreading: Spreading | None = None
    """Spreading about the mean direction; by default all waves travel along it."""
    seed: int = Field(default=1, ge=0, lt=2**63)
    amplitudes: Literal["random phase", "gaussian"] = "random phase"
    """Amplitudes of the spectrum with random phases, so that every seed has the same variance; or amplitudes random,
    too, as of a sample of this length."""
    frequencies: tuple[float, float] | None = None
    """[rad/s] lowest and highest frequency of the waves; by default 0 and five times that of the peak."""
    repeat: float = Field(default=3600.0, gt=10.0, le=1e5)
    """[s; 300 to 4e4] repeat period of the sea."""
    crest: Crest | None = None
    """An embedded wave of given height."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        by_values = isinstance(self.spectrum, UserSpectrum)
        needs = {"height": not by_values, "period": self.spectrum in ("jonswap", "pierson_moskowitz")}
        for name, needed in needs.items():
            if needed and getattr(self, name) is None:
                raise ValueError(f"spectrum {self.spectrum} needs {name}")
        if self.peak_factor is not None and self.spectrum != "jonswap":
            raise ValueError("peak_factor is that of spectrum jonswap")
        if self.spectrum == "white" and self.frequencies is None:
            raise ValueError("spectrum white needs frequencies: its lowest and highest")
        if self.frequencies is not None and not 0.0 <= self.frequencies[0] < self.frequencies[1] < 50.0:
            raise ValueError(f"frequencies: expected two from 0 to 50 rad/s, increasing, found {self.frequencies}")
        if self.crest is not None and self.spreading is not None:
            raise ValueError("crest: a long-crested wave does not go with spreading; remove one of the two")
        return self

    @property
    def label(self) -> str:
        if isinstance(self.spectrum, UserSpectrum):
            words = ["sea of a given spectrum"]
        else:
            name = {"jonswap": "JONSWAP", "pierson_moskowitz": "Pierson-Moskowitz", "white": "white-noise"}
            words = [f"{name[self.spectrum]} sea {self.height:g} m" + (f", {self.period:g} s" if self.period else "")]
        if self.crest is not None:
            words.append(f"{self.crest.of} of {self.crest.height:g} m at {self.crest.time:g} s")
        return ", ".join([*words, f"seed {self.seed}"])

    def doubts(self) -> list[str]:
        """Sentences about unusual numbers, and about seas steeper than in DNV-RP-C205 (3.5.5)."""
        sentences = super().doubts()
        if self.height is not None and self.period is not None:
            steepness = 2.0 * math.pi * self.height / (GRAVITY * self.period**2)
            if steepness > STEEPEST:
                sentences.append(
                    f"sea: height {self.height:g} m and period {self.period:g} s have a steepness of {steepness:.3g}; "
                    f"seas have up to {STEEPEST:.3g}; are they in this order?"
                )
        return sentences

    def limits(self) -> tuple[float, float]:
        """Lowest and highest frequency [rad/s]."""
        if self.frequencies is not None:
            return self.frequencies
        if isinstance(self.spectrum, UserSpectrum):
            return float(self.spectrum.frequency[0]), float(self.spectrum.frequency[-1])
        assert self.period is not None
        return 0.0, HIGHEST * 2.0 * math.pi / self.period

    def density(self, frequency: Float) -> Float:
        """(M,) [m^2 s/rad] spectrum at frequencies (M,) [rad/s]."""
        low, high = self.limits()
        inside = (frequency >= low) & (frequency <= high)
        if isinstance(self.spectrum, UserSpectrum):
            density = np.interp(frequency, self.spectrum.frequency, self.spectrum.density)
        elif self.spectrum == "white":
            assert self.height is not None
            density = np.full(len(frequency), (0.25 * self.height) ** 2 / (high - low))
        else:
            assert self.height is not None and self.period is not None
            factor = 1.0
            if self.spectrum == "jonswap":
                factor = self.peak_factor or default_peak_factor(self.height, self.period)
            density = jonswap(frequency, self.height, self.period, factor)
        return np.where(inside, density, 0.0)

    def components(self, depth: float, duration: float, gravity: float = GRAVITY) -> WaveComponents:
        low, high = self.limits()
        step = 2.0 * math.pi / self.repeat
        if high / step > MOST_COMPONENTS:
            raise InputError(f"sea.repeat: {self.repeat:g} s gives {high / step:.3g} waves, at most {MOST_COMPONENTS}")
        number = np.arange(max(math.ceil(low / step), 1), math.floor(high / step) + 1)
        frequency: Float = step * number.astype(np.float64)
        variance = self.density(frequency) * step
        m0 = float(variance.sum())
        if m0 <= 0.0:
            raise InputError("sea.spectrum: no energy between the lowest and the highest frequency")
        self._refuse(depth, m0, frequency, variance)
        random = np.random.default_rng(self.seed)
        if self.amplitudes == "gaussian":
            amplitude = np.sqrt(variance) * (
                random.standard_normal(len(number)) + 1j * random.standard_normal(len(number))
            )
        else:
            amplitude = np.sqrt(2.0 * variance) * np.exp(2j * math.pi * random.random(len(number)))
        if self.crest is not None:
            if self.crest.time > self.repeat:
                raise InputError(f"sea.crest.time: {self.crest.time:g} s is after the sea repeats at {self.repeat:g} s")
            amplitude = self.crest.embedded(frequency, amplitude, variance / m0)
        mean = along(self.direction)
        direction = np.full(len(number), mean)
        if self.spreading is not None:
            direction = mean + self.spreading.directions_of(len(number), random)
        return WaveComponents(frequency, amplitude, direction, self.repeat)

    def _refuse(self, depth: float, m0: float, frequency: Float, variance: Float) -> None:
        """Reject breaking waves: the significant height at this depth, and an embedded wave."""
        height, mean = 4.0 * math.sqrt(m0), 2.0 * math.pi * math.sqrt(m0 / float((variance * frequency**2).sum()))
        if height > BREAKS_IN_SHALLOWS * depth:
            refuse_breaking(height, mean, depth, "sea.height")
        if self.period is not None and self.height is not None:
            refuse_breaking(self.height, self.period, depth, "sea.height")
        if mean > self.repeat:
            raise InputError(f"sea.repeat: {self.repeat:g} s is shorter than a wave of {mean:.3g} s")
        if self.crest is not None and self.crest.of == "crest" and self.crest.height > BREAKS_IN_SHALLOWS * depth:
            raise InputError(
                f"sea.crest.height: a crest of {self.crest.height:g} m breaks in water of {depth:g} m; expected at "
                f"most {BREAKS_IN_SHALLOWS * depth:.3g} m above still water"
            )
        if self.crest is not None and self.crest.of == "crest to trough":
            refuse_breaking(self.crest.height, 1.3 * mean, depth, "sea.crest.height")
