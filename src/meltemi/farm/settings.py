"""Settings of the wakes of a farm, as in a file."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field

from meltemi.core.record import Record
from meltemi.farm.sets import SETS, WakeSet

SetName = Literal["none", "fast.farm", "curled", "iec", "madsen", "keck"]
WORDS: dict[SetName, str] = {
    "none": "without wakes",
    "fast.farm": "wake model as FAST.Farm's",
    "curled": "curled wakes as FAST.Farm's",
    "iec": "wake model of IEC 61400-1:2019",
    "madsen": "wake model of Madsen et al. (2010)",
    "keck": "wake model of Keck et al. (2015)",
}
"""Sets of constants as titles name them: no other program has run."""


class WakeSettings(Record):
    """How wakes are computed; the defaults are those of FAST.Farm."""

    model: SetName = "fast.farm"
    """Named set of constants, or none: each turbine as if it were alone."""
    merging: Literal["quadratic", "linear", "largest"] = "quadratic"
    """Of several wakes at a point: root of the sum of the squares of their deficits, sum, or the largest one."""
    added_turbulence: bool = True
    """Small-scale turbulence that wakes add."""
    intensity: float | None = Field(default=None, ge=0.0, le=1.0)
    """Ambient turbulence intensity [-; 0.01 to 0.5] of the mixing in wakes; by default that of the wind over a disk, at
    each exchange."""
    step: float | None = Field(default=None, gt=0.0, le=10.0)
    """[s; 0.1 to 5] between exchanges of turbines and wakes; by default 2 s, or less where the wind passes a tenth of
    the averaging diameter sooner."""
    radial_points: float | None = Field(default=None, ge=15.0, le=30.0)
    """Points of a wake's profile in a rotor diameter; by default 25, in curled wakes 16."""
    rings: int = Field(default=16, ge=8, le=60)
    """Rings of points in the averages that let wakes drift."""
    ceiling: float | None = Field(default=None, gt=0.0, le=1e5)
    """[m; 50 to 5000] height up to which these averages count; FAST.Farm's end at the top of its grid. By default all
    do."""
    cut_off: float | None = Field(default=None, gt=0.0, le=100.0)
    """[m/s; 0.5 to 50] frequency of the low-pass filters times the rotor radius; by default that of the set."""
    seed: int = Field(default=1, ge=0, lt=2**63)
    """Of the added turbulence."""

    @property
    def words(self) -> str:
        """The wake model in words."""
        bare = self.model != "none" and not self.added_turbulence
        return WORDS[self.model] + ", no added turbulence" * bare

    def constants(self) -> WakeSet:
        """The named set, with the constants that are given."""
        chosen = SETS[self.model]
        return chosen if self.cut_off is None else replace(chosen, cut_off=self.cut_off)
