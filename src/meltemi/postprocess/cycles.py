"""Load cycles: rainflow counting, sums over runs, Markov matrices, influence of the mean, equivalent loads.

* Cycles are counted by the rainflow method of ASTM E1049-85 (2017), section 5.4.4, on the turning points
  of the series; the residue counts as half cycles, or the series is closed and repeated (section 5.4.5).
* Cycles of many runs are added in fine cells of range and mean: L-1 to L-6 of ``docs/theory/design-loads.md``.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.inputs import floats, one_row, positive

Float = NDArray[np.float64]
Index = NDArray[np.intp]
Residue = Literal["half", "repeated"]

OCTAVES = 24
"""Ranges below the largest one over two to this power are left out: they do no damage."""
MEAN_CELLS = 128
"""The largest mean lies between half of this number and this number of cells from zero."""


class Cycles(NamedTuple):
    """Cycles of a load.

    Attributes:
      ranges: (n,) ranges from valley to peak, in the unit of the load.
      means: (n,) half-way between valley and peak, in the unit of the load.
      counts: (n,) numbers of cycles.
    """

    ranges: Float
    means: Float
    counts: Float


def cycle_ends(series: ArrayLike, residue: Residue = "half") -> tuple[Index, Index, Float]:
    """Turning points of the cycles of a series.

    Args:
      series: (T,) values.
      residue: see :func:`rainflow_cycles`.

    Returns:
      for each cycle the places in the series of its first and its second turning point, and its count
      (1 or 0.5), each (n,). A plateau counts as its first value.

    Raises:
      InputError: the series contains values that are not finite, or there is no such treatment of the residue.
    """
    from meltemi.postprocess.counting import pair, turning_points

    x = one_row(series, "rainflow counting", least=0)
    if not np.all(np.isfinite(x)):
        raise InputError("rainflow counting: the series contains values that are not finite")
    if residue not in ("half", "repeated"):
        raise InputError(f"rainflow counting: residue must be 'half' or 'repeated', found {residue!r}")
    closed = residue == "repeated"
    first, second = np.empty(len(x) + 1, dtype=np.intp), np.empty(len(x) + 1, dtype=np.intp)
    counts = np.empty(len(x) + 1)
    n = 0
    if len(x) > 1:
        points = np.empty(len(x) + 1, dtype=np.intp)
        begin = int(np.argmax(x)) if closed else 0
        n = pair(x, points, turning_points(x, begin, closed, points), closed, first, second, counts)
    return first[:n], second[:n], counts[:n]


def rainflow_cycles(series: ArrayLike, residue: Residue = "half") -> Cycles:
    """Cycles of a series.

    Args:
      series: (T,) values.
      residue: "half": ranges that close no cycle count as half a cycle (ASTM E1049-85, 5.4.4). "repeated": the series
        follows itself, so that all cycles close and count as one (5.4.5; the same as counting the residue twice in a
        row, after de Jonge, and Clormann and Seeger).

    Returns:
      ranges, means and counts (1 or 0.5) of the cycles, each (n,).

    Raises:
      InputError: the series contains values that are not finite, or there is no such treatment of the residue.
    """
    x = one_row(series, "rainflow counting", least=0)
    first, second, counts = cycle_ends(x, residue)
    return Cycles(np.abs(x[first] - x[second]), 0.5 * (x[first] + x[second]), counts)


def bin_cycles(cycles: Cycles, *, means: bool = True) -> Cycles:
    """Fewer cycles with the same damage: those in a cell of range and mean become one entry (L-1 to L-3).

    Cells of ranges are the same for all loads: 40 an octave. An entry has the range that does the damage of its cycles
    at slope 10, and their mean. Damage is exact for that slope and within 0.1 % for any other up to 12. Cells of means
    have a width of a power of two, the largest mean is 64 to 128 of them from zero.

    Args:
      cycles: cycles of one or several series.
      means: distinguish means; otherwise an entry has the mean of all cycles of its range.

    Returns:
      binned again it stays the same but for rounding. Ranges below 6e-8 of the largest one are left out.
    """
    from meltemi.postprocess.counting import RANGE_CELLS, gather

    ranges, middle, counts = (one_row(part, "bin_cycles", least=0) for part in cycles)
    largest, extreme = float(ranges.max(initial=0.0)), float(np.abs(middle).max(initial=0.0)) if means else 0.0
    if largest == 0.0:
        return Cycles(np.zeros(0), np.zeros(0), np.zeros(0))
    width = 2.0 ** np.ceil(np.log2(extreme / MEAN_CELLS)) if extreme > 0.0 else 0.0
    cells = np.empty((5, len(ranges)))
    n = gather(ranges, middle, counts, int(np.floor(RANGE_CELLS * np.log2(largest))), width, _slots(), cells)
    return Cycles(cells[0, :n].copy(), cells[1, :n].copy(), cells[2, :n].copy())


def _slots() -> NDArray[np.int32]:
    """Table of free cells, one for each thread: nine tenths of the time would go into making it."""
    if not hasattr(_TABLES, "slots"):
        from meltemi.postprocess.counting import RANGE_CELLS

        _TABLES.slots = np.full((OCTAVES * RANGE_CELLS, 2 * MEAN_CELLS + 2), -1, dtype=np.int32)
    slots: NDArray[np.int32] = _TABLES.slots
    return slots


_TABLES = threading.local()


def sum_cycles(parts: Iterable[Cycles], weights: Sequence[float] | None = None, *, means: bool = True) -> Cycles:
    """Cycles of several series together, each weighted with its number of occurrences, in the cells of
    :func:`bin_cycles`.

    Args:
      parts: cycles of each series.
      weights: how often each series occurs; once by default.
      means: see :func:`bin_cycles`.

    Raises:
      InputError: there is not one weight for each series, or one is negative or not finite.
    """
    given = list(parts)
    w = np.ones(len(given)) if weights is None else floats(weights, "sum_cycles: weights")
    if w.shape != (len(given),) or not np.all((w >= 0.0) & np.isfinite(w)):
        raise InputError("sum_cycles: there must be a finite weight for each series, none negative")
    joined = Cycles(
        np.concatenate([c.ranges for c in given] or [np.zeros(0)]),
        np.concatenate([c.means for c in given] or [np.zeros(0)]),
        np.concatenate([x * c.counts for x, c in zip(w, given, strict=True)] or [np.zeros(0)]),
    )
    return bin_cycles(joined, means=means)


def markov_matrix(cycles: Cycles, range_edges: ArrayLike, mean_edges: ArrayLike) -> Float:
    """Table of cycles by range and mean, as it is handed to designers of components.

    Args:
      cycles: see :func:`rainflow_cycles` and :func:`sum_cycles`.
      range_edges: (R + 1,) ascending, in the unit of the load; each bin contains its lower edge, the last one both.
      mean_edges: (M + 1,) as these.

    Returns:
      (R, M) numbers of cycles.

    Raises:
      InputError: edges do not ascend, or cycles lie outside them.
    """
    edges = [floats(e, "markov_matrix") for e in (range_edges, mean_edges)]
    if any(e.ndim != 1 or len(e) < 2 or not np.all(np.diff(e) > 0.0) for e in edges):
        raise InputError("markov_matrix: edges must be at least two ascending numbers")
    for name, x, e in (("ranges", cycles.ranges, edges[0]), ("means", cycles.means, edges[1])):
        if len(x) and (x.min() < e[0] or x.max() > e[-1]):
            raise InputError(
                f"markov_matrix: {name} lie between {x.min():g} and {x.max():g}, edges between {e[0]:g} and {e[-1]:g}"
            )
    table: Float = np.histogram2d(cycles.ranges, cycles.means, bins=edges, weights=cycles.counts)[0]
    return table


def goodman_cycles(cycles: Cycles, strength: float, *, mean: float = 0.0) -> Cycles:
    """Cycles about another mean that do the same damage, by the straight line of Goodman (L-4).

    Args:
      cycles: cycles with their means.
      strength: magnitude of the load at which the component fails, in the unit of the load.
      mean: mean of the returned cycles; that of the S-N curve, zero by default.

    Raises:
      InputError: a mean is as large as the strength, or the strength is not positive.
    """
    positive(strength, "goodman_cycles: strength")
    largest = max(float(np.abs(cycles.means).max(initial=0.0)), abs(mean))
    if largest >= strength:
        raise InputError(f"goodman_cycles: a mean of magnitude {largest:g} reaches the strength {strength:g}")
    factor = (strength - abs(mean)) / (strength - np.abs(cycles.means))
    return Cycles(cycles.ranges * factor, np.full(len(factor), float(mean)), cycles.counts)


def damage_sum(cycles: Cycles, slope: float) -> float:
    """Sum of n S^m, proportional to the damage (F-4); shares of it are the shares of cases in the damage.

    Args:
      cycles: cycles of one case, weighted with its occurrence.
      slope: m of the S-N curve.

    Returns:
      in the unit of the load to the power m.

    Raises:
      InputError: ``slope`` is not positive.
    """
    return cycle_load(cycles, slope=slope, reference=1.0) ** slope


def cycle_load(cycles: Cycles, *, slope: float, reference: float) -> float:
    """Equivalent load of cycles: the range of ``reference`` cycles that do the same damage (F-8).

    Args:
      cycles: cycles of a series, or of a lifetime: see :func:`sum_cycles`.
      slope: m of the S-N curve.
      reference: number of cycles of the equivalent load: 1e7, or the seconds of the lifetime for a load at 1 Hz.

    Returns:
      in the unit of the load; 0 without cycles.

    Raises:
      InputError: ``slope`` or ``reference`` is not positive.
    """
    for name, value in (("slope", slope), ("reference", reference)):
        positive(value, f"cycle_load: {name}")
    largest = float(cycles.ranges.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    return float(largest * (np.sum(cycles.counts * (cycles.ranges / largest) ** slope) / reference) ** (1.0 / slope))
