"""Weights of fatigue: occurrences of a case in the lifetime.

The wind speed has a Weibull distribution. A case of a state represents a bin of the wind speed, whose edges are midway
between the speeds of its row; the first bin begins at zero and the last one has no end. The state has one share of the
time in a bin between cut-in and cut-out, and another one outside (docs/guide/load-case-tables.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from meltemi.core.errors import InputError
from meltemi.loads.loadbase.campaign import Campaign
from meltemi.loads.loadbase.table import State

HOURS = 8766.0
"""Duration [h] of a mean year."""


@dataclass(frozen=True)
class Weibull:
    """Weibull distribution of the wind speed.

    Attributes:
      scale: [m/s] scale parameter.
      shape: shape parameter; 2 is Rayleigh's distribution.
    """

    scale: float
    shape: float = 2.0

    def below(self, speed: float) -> float:
        """Probability of a lower wind speed."""
        return 1.0 - math.exp(-((max(speed, 0.0) / self.scale) ** self.shape))

    def between(self, low: float, high: float) -> float:
        """Probability of a wind speed from ``low`` to ``high`` [m/s]; zero if they do not ascend."""
        return max(self.below(high) - self.below(low), 0.0)


def distribution(campaign: Campaign) -> Weibull:
    """Distribution of the wind speed of a campaign: that of the site, or Rayleigh's with the mean of the class."""
    if campaign.site is not None:
        return Weibull(campaign.site.weibull_scale, campaign.site.weibull_shape)
    sea = campaign.metocean
    if sea is not None and sea.weibull_scale is not None:
        return Weibull(sea.weibull_scale, sea.weibull_shape)
    return Weibull(2.0 * campaign.iec_class.v_ave / math.sqrt(math.pi))


def edges(speeds: Sequence[float]) -> list[float]:
    """Edges [m/s] of the bins of ascending speeds: zero, the midpoints, infinity."""
    return [0.0, *(0.5 * (a + b) for a, b in pairwise(speeds)), math.inf]


def time_share(name: str, states: Mapping[str, State], campaign: Campaign, low: float, high: float) -> float:
    """Share of the lifetime of a state in a bin of the wind speed.

    Args:
      campaign: campaign with the distribution of the wind speed.
      low, high: [m/s] edges of the bin.

    Raises:
      InputError: the states have more than all of the time between cut-in and cut-out.
    """
    wind, least, most = distribution(campaign), campaign.cut_in, campaign.cut_out
    operating = wind.between(least, most)
    given = {
        each: state.inside if state.hours is None else state.hours / HOURS / operating for each, state in states.items()
    }
    rest = 1.0 - sum(share for share in given.values() if share is not None)
    if rest < 0.0:
        raise InputError(f"states: they have {1.0 - rest:.3g} of the time between cut-in and cut-out, more than all")
    share_inside = given[name]
    between = wind.between(max(low, least), min(high, most))
    return (
        between * (rest if share_inside is None else share_inside)
        + (wind.between(low, high) - between) * states[name].outside
    )
