"""Ultimate loads of a load base."""

from __future__ import annotations

from dataclasses import dataclass

from meltemi.core.display import Brief
from meltemi.postprocess.extrapolation import Extrapolation, Float


@dataclass(frozen=True, repr=False)
class ExtrapolatedLoad(Brief):
    """Load of DLC 1.1 by all ways of extrapolation, without partial safety factor.

    Attributes:
      interface: name, or channel such as ``tip_out_of_plane`` or ``tip_clearance``.
      driver: such as "My max"; "max" or "min" of a channel.
      unit: "N", "N m" or "m".
      speeds: (n,) [m/s] wind speeds.
      extremes: for each speed the (seeds,) extremes of the runs.
      largest: most severe of them.
      gumbel, weibull: extrapolations with their band; None where seeds are too few at all speeds.
      left_out: speeds [m/s] with too few seeds for the Weibull distribution, which ``weibull`` leaves out.
      quantiles: loads by the simplified ways of the table, in its order; empty in edition 3.
      factor: partial safety factor, which none of the loads contains.
    """

    interface: str
    driver: str
    unit: str
    speeds: Float
    extremes: tuple[Float, ...]
    largest: float
    gumbel: Extrapolation | None
    weibull: Extrapolation | None
    left_out: tuple[float, ...]
    quantiles: tuple[float, ...]
    factor: float
