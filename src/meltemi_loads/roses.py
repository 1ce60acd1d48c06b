"""Load roses: a resultant by direction.

The two transverse components of a force or moment are projected on directions: equations L-16 to L-18 of
``docs/theory/design-loads.md``. Largest load and cycles are kept for each direction and add up over runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import pi, radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.postprocess.cycles import Cycles, Residue, bin_cycles, cycle_load, rainflow_cycles, sum_cycles
from meltemi.postprocess.inputs import floats, positive

Float = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class LoadRose(Brief):
    """Loads by direction.

    Attributes:
      angles: (D,) [rad] of the directions, from 0 towards 2 pi, from the first to the second component.
      largest: (D,) largest projections, in the unit of the components.
      cycles: (D / 2) of the projections on the first half of the directions; opposite ones have the same.
    """

    angles: Float
    largest: Float
    cycles: tuple[Cycles, ...]


def load_rose(
    first: ArrayLike, second: ArrayLike, *, step: float = radians(30.0), residue: Residue = "half"
) -> LoadRose:
    """Rose of a run.

    Args:
      first, second: (T,) transverse components, such as My and Mx of the tower base.
      step: [rad] between directions; half a turn is a whole number of steps.
      residue: see ``rainflow_cycles``.

    Raises:
      InputError: shapes differ, values are not finite, or half a turn is no whole number of steps.
    """
    x, y = floats(first, "load_rose: first"), floats(second, "load_rose: second")
    half = round(pi / positive(step, "load_rose: step"))
    if half < 1 or abs(half * step - pi) > 1e-6:
        raise InputError(f"load_rose: half a turn must be a whole number of steps, found a step of {step!r} rad")
    if x.ndim != 1 or y.shape != x.shape or not len(x):
        raise InputError(f"load_rose: components must be (T,) values, found shapes {x.shape} and {y.shape}")
    angles = pi / half * np.arange(2 * half, dtype=np.float64)
    parts = [np.cos(a) * x + np.sin(a) * y for a in angles[:half]]
    largest = np.array([p.max() for p in parts] + [-p.min() for p in parts])
    return LoadRose(angles, largest, tuple(bin_cycles(rainflow_cycles(p, residue)) for p in parts))


def sum_roses(
    roses: Iterable[LoadRose], weights: Sequence[float] | None = None, factors: Sequence[float] | None = None
) -> LoadRose:
    """Rose of several runs: the largest loads of all, and their cycles as often as the weights say.

    Args:
      roses: of each run, with the same directions.
      weights: how often each run occurs, from ``lifetime_weights``; 1 by default, 0 for ultimate load cases.
      factors: partial safety factors of the largest loads; 1 by default, 0 for a run that takes no part.

    Raises:
      InputError: there are none, directions differ, or there is not one weight and factor for each.
    """
    given = list(roses)
    f = np.ones(len(given)) if factors is None else floats(factors, "sum_roses: factors")
    if not given or f.shape != (len(given),) or any(len(r.angles) != len(given[0].angles) for r in given):
        raise InputError("sum_roses: there must be roses with the same directions, and a factor for each")
    largest = np.max(
        [r.largest * x if x > 0.0 else -np.inf * np.ones(len(r.largest)) for r, x in zip(given, f, strict=True)], axis=0
    )
    cycles = tuple(sum_cycles(parts, weights) for parts in zip(*(r.cycles for r in given), strict=True))
    return LoadRose(given[0].angles, largest, cycles)


def rose_loads(rose: LoadRose, *, slope: float, reference: float) -> Float:
    """Damage-equivalent load of each direction.

    Args:
      rose: of a run or a lifetime.
      slope: m of the S-N curve.
      reference: number of cycles, see ``cycle_load``.

    Returns:
      (D,) in the unit of the components; that of a direction is that of the opposite one.

    Raises:
      InputError: ``slope`` or ``reference`` is not positive.
    """
    half = [cycle_load(c, slope=slope, reference=reference) for c in rose.cycles]
    return np.array(half + half)
