"""Fatigue, energy and duty of a load base over its lifetime."""

from __future__ import annotations

from dataclasses import dataclass

from meltemi.core.display import Brief
from meltemi.postprocess.cycles import Float


@dataclass(frozen=True, repr=False)
class MarkovMatrix(Brief):
    """Cycles of the lifetime by range and mean.

    Attributes:
      range_edges: (R + 1,) in the unit of the load.
      mean_edges: (M + 1,) in the unit of the load.
      counts: (R, M) numbers of cycles.
    """

    range_edges: Float
    mean_edges: Float
    counts: Float
