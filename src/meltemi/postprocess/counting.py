"""Rainflow counting by the rules of ASTM E1049-85 (2017), cells of range and mean, statistics of channels.

The statistics of a run are computed while it runs, sample by sample. Cycles are counted when they close; the residue
counts as half cycles, so that the damage is that of :func:`meltemi.loads.rainflow_cycles` of the whole series.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Array2, KernelRecord, Table, kernel, number, part, whole
from meltemi.simulation.tables import Clock

Float = NDArray[np.float64]
Index = NDArray[np.intp]
Slots = NDArray[np.int32]

FEATURE = "rainflow counting"
RANGE_CELLS = 40
"""Cells an octave of the range."""
KEPT_SLOPE = 10
"""Slope at which the cycles of a cell and their common range do the same damage."""
DEPTH = 64
"""Turning points of open cycles that are kept; beyond them the oldest one counts as half a cycle."""


class OpenCycles(Table, title="rainflow counter"):
    """Cycles of a series that grows by one value after the other."""

    slope: float = number("-", "slope of the S-N curve")
    depth: float = number("-", "turning points of open cycles")
    end: float = number("of the series", "present end of the series")
    values: float = number("-", "values until now, as far as it matters: 0, 1, 2")
    closed: float = number("of the series to the power of the slope", "damage of closed cycles")


class ChannelState(Table, title="statistics of a channel"):
    """Statistics of the samples of a channel so far."""

    cycles: OpenCycles = part(OpenCycles, "of a load", prefix="")
    period: float = number("of the channel", "interval to which values are wrapped; 0 for none")
    skipped: float = number("-", "samples of the initial transient that are still to come")
    samples: float = number("-", "samples after them")
    begin: float = number("of the channel", "first value")
    total: float = number("of the channel", "sum of the differences from the first value")
    squares: float = number("of the channel squared", "sum of the squares of these differences")
    low: float = number("of the channel", "smallest value")
    high: float = number("of the channel", "largest value")


class Tally(KernelRecord):
    """Statistics of a run in progress.

    Attributes:
      output: (rows, channels) samples; the first ``clock.row`` rows are new.
      states: (channels, fields) array of :class:`ChannelState`.
      points: (channels, DEPTH) turning points of open cycles.
    """

    clock: Clock
    output: Array2
    states: Array2
    points: Array2


@kernel
def turning_points(x: Float, begin: int, closed: bool, points: Index) -> int:
    """Places of the turning points of ``x`` (F-1), of a plateau its first value; their number.

    A closed series starts at ``begin``, its largest value, and ends there.
    """
    n, length = 0, len(x) + 1 if closed else len(x)
    for i in range(length):
        at = begin + i if begin + i < len(x) else begin + i - len(x)
        if n > 0 and x[at] == x[points[n - 1]]:
            continue
        if n > 1 and (x[points[n - 1]] - x[points[n - 2]]) * (x[at] - x[points[n - 1]]) > 0.0:
            n -= 1  # no turning point: the series continues in the same direction
        points[n] = at
        n += 1
    return n


@kernel
def pair(x: Float, points: Index, n: int, closed: bool, first: Index, second: Index, counts: Float) -> int:
    """Pair the turning points to cycles by the three-point rule (F-2); their number. ``points`` is overwritten."""
    n_cycles, low, high = 0, 0, 0  # points[low:high] are left
    for i in range(n):
        points[high] = points[i]
        high += 1
        while high - low > 2:
            X = abs(x[points[high - 1]] - x[points[high - 2]])
            Y = abs(x[points[high - 2]] - x[points[high - 3]])
            if X < Y:
                break
            first[n_cycles], second[n_cycles] = points[high - 3], points[high - 2]
            if high - low == 3 and not closed:  # Y contains the first point
                counts[n_cycles] = 0.5
                low += 1
            else:
                counts[n_cycles] = 1.0
                points[high - 3] = points[high - 1]
                high -= 2
            n_cycles += 1
    for i in range(low, high - 1):  # the residue; a closed series leaves none
        first[n_cycles], second[n_cycles], counts[n_cycles] = points[i], points[i + 1], 0.5
        n_cycles += 1
    return n_cycles


@kernel
def gather(ranges: Float, means: Float, counts: Float, top: int, width: float, slots: Slots, cells: Float) -> int:
    """Add cycles to cells of range and mean (L-1 to L-3); the number of cells.

    Args:
      ranges, means, counts: (n,) ranges, means and numbers of the cycles.
      top: row of the largest range.
      width: width of the cells of the mean; 0 for a single cell.
      slots: (rows, columns) of -1, places of the cells in ``cells``; left as it was.
      cells: (5, n) range of the first cycle, mean, count, damage against the first cycle, place in ``slots``.
    """
    n, (rows, columns) = 0, slots.shape
    flat = slots.ravel()
    for i in range(len(ranges)):
        if ranges[i] <= 0.0 or counts[i] <= 0.0:
            continue
        row = top - int(np.floor(RANGE_CELLS * np.log2(ranges[i])))
        if row >= rows:
            continue
        column = int(np.floor(means[i] / width)) + columns // 2 if width > 0.0 else 0
        at = row * columns + column
        if flat[at] < 0:
            flat[at] = n
            cells[0, n], cells[1, n], cells[2, n], cells[3, n], cells[4, n] = ranges[i], 0.0, 0.0, 0.0, at
            n += 1
        k = flat[at]
        cells[1, k] += counts[i] * means[i]
        cells[2, k] += counts[i]
        cells[3, k] += counts[i] * (ranges[i] / cells[0, k]) ** KEPT_SLOPE
    for k in range(n):
        flat[int(cells[4, k])] = -1
        if cells[3, k] != cells[2, k]:  # more than one cycle
            cells[0, k] *= (cells[3, k] / cells[2, k]) ** (1.0 / KEPT_SLOPE)
        cells[1, k] /= cells[2, k]
    return n


# series that grow -----------------------------------------------------------------------------------------


@kernel
def close(points: Float, n: int, slope: float) -> tuple[int, float]:
    """Close cycles after a new turning point by the three-point rule (F-2): points left, damage."""
    damage = 0.0
    while n > 2:
        last, before = abs(points[n - 1] - points[n - 2]), abs(points[n - 2] - points[n - 3])
        if last < before:
            break
        if n == 3:  # the range contains the first point
            damage += 0.5 * before**slope
            points[0], points[1] = points[1], points[2]
            n = 2
        else:
            damage += before**slope
            points[n - 3] = points[n - 1]
            n -= 2
    return n, damage


@kernel
def count(x: OpenCycles, points: Float, value: float) -> None:
    """Add a value to a series."""
    n = whole(x.depth)
    if x.values == 0.0:
        points[0] = value
        x.depth, x.end, x.values = 1.0, value, 1.0
        return
    if value == x.end:
        return
    if x.values == 1.0 or (x.end - points[n - 1]) * (value - x.end) > 0.0:
        x.end, x.values = value, 2.0
        return
    if n == DEPTH - 1:
        x.closed += 0.5 * abs(points[1] - points[0]) ** x.slope
        for i in range(1, n):
            points[i - 1] = points[i]
        n -= 1
    points[n] = x.end
    left, damage = close(points, n + 1, x.slope)
    x.depth, x.end = float(left), value
    x.closed += damage


@kernel
def damage_until_now(x: OpenCycles, points: Float, spare: Float) -> float:
    """Damage of a series if it ended here, its open cycles counted as half."""
    n = whole(x.depth)
    for i in range(n):
        spare[i] = points[i]
    damage = x.closed
    if x.values == 2.0:
        spare[n] = x.end
        n, more = close(spare, n + 1, x.slope)
        damage += more
    for i in range(n - 1):
        damage += 0.5 * abs(spare[i + 1] - spare[i]) ** x.slope
    return damage


@kernel
def add_channel(t: Tally, k: int) -> None:
    """Add the new samples of a channel to its statistics."""
    x, points = ChannelState(t.states[k]), t.points[k]
    for row in range(t.clock.row):
        if x.skipped > 0.0:
            x.skipped -= 1.0
            continue
        value = t.output[row, k]
        if x.period > 0.0:
            value %= x.period
        if x.samples == 0.0:
            x.begin = x.low = x.high = value
        x.samples += 1.0
        change = value - x.begin
        x.total += change
        x.squares += change * change
        x.low, x.high = min(x.low, value), max(x.high, value)
        if x.cycles.slope > 0.0:
            count(x.cycles, points, value)


@kernel
def add_samples(t: Tally) -> None:
    """Add the new samples of all channels to their statistics, and discard them."""
    for k in range(t.states.shape[0]):
        add_channel(t, k)
    t.clock.row = 0
