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
    """Settings of the wakes; the defaults are those of FAST.Farm."""

    model: SetName = "fast.farm"
    """Named set of constants, or none: turbines without wakes."""
    merging: Literal["quadratic", "linear", "largest"] = "quadratic"
    """Superposition of wakes: root of the sum of squared deficits, sum, or largest deficit."""
    added_turbulence: bool = True
    """Small-scale turbulence that wakes add."""
    intensity: float | None = Field(default=None, ge=0.0, le=1.0)
    """Ambient turbulence intensity [-; 0.01 to 0.5] of the mixing in wakes; by default that of the wind over the rotor
    disk at each exchange."""
    step: float | None = Field(default=None, gt=0.0, le=10.0)
    """[s; 0.1 to 5] interval between exchanges of turbines and wakes; by default 2 s, or less where the wind
    travels a tenth of the averaging diameter sooner."""
    radial_points: float | None = Field(default=None, ge=15.0, le=30.0)
    """Points of a wake profile per rotor diameter; by default 25, for curled wakes 16."""
    rings: int = Field(default=16, ge=8, le=60)
    """Rings of points in the averages that determine the drift of wakes."""
    ceiling: float | None = Field(default=None, gt=0.0, le=1e5)
    """[m; 50 to 5000] height up to which these averages extend; those of FAST.Farm end at the top of its grid. By
    default there is no limit."""
    cut_off: float | None = Field(default=None, gt=0.0, le=100.0)
    """[m/s; 0.5 to 50] cut-off frequency of the low-pass filters times the rotor radius; by default that of the set."""
    seed: int = Field(default=1, ge=0, lt=2**63)
    """Seed of the added turbulence."""

    @property
    def words(self) -> str:
        """The wake model in words."""
        bare = self.model != "none" and not self.added_turbulence
        return WORDS[self.model] + ", no added turbulence" * bare

    def constants(self) -> WakeSet:
        """The named set, with constants replaced by given settings."""
        chosen = SETS[self.model]
        return chosen if self.cut_off is None else replace(chosen, cut_off=self.cut_off)
