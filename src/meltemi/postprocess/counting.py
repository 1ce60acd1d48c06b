"""Rainflow counting by the rules of ASTM E1049-85 (2017), and cells of range and mean, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.core.kernel import kernel

Float = NDArray[np.float64]
Index = NDArray[np.intp]
Slots = NDArray[np.int32]

FEATURE = "rainflow counting"
RANGE_CELLS = 40
"""Cells an octave of the range."""
KEPT_SLOPE = 10
"""Slope at which the cycles of a cell and their common range do the same damage."""


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
            n -= 1  # no turning point: still on its way
        points[n] = at
        n += 1
    return n


@kernel
def pair(x: Float, points: Index, n: int, closed: bool, first: Index, second: Index, counts: Float) -> int:
    """Pair the turning points to cycles by the three-point rule (F-2); their number. ``points`` is overwritten."""
    found, low, high = 0, 0, 0  # points[low:high] are left
    for i in range(n):
        points[high] = points[i]
        high += 1
        while high - low > 2:
            X = abs(x[points[high - 1]] - x[points[high - 2]])
            Y = abs(x[points[high - 2]] - x[points[high - 3]])
            if X < Y:
                break
            first[found], second[found] = points[high - 3], points[high - 2]
            if high - low == 3 and not closed:  # Y contains the first point
                counts[found] = 0.5
                low += 1
            else:
                counts[found] = 1.0
                points[high - 3] = points[high - 1]
                high -= 2
            found += 1
    for i in range(low, high - 1):  # the residue; a closed series leaves none
        first[found], second[found], counts[found] = points[i], points[i + 1], 0.5
        found += 1
    return found


@kernel
def gather(ranges: Float, means: Float, counts: Float, top: int, width: float, slots: Slots, cells: Float) -> int:
    """Add cycles to cells of range and mean (L-1 to L-3); the number of cells.

    Args:
      ranges, means, counts: (n,) of the cycles.
      top: row of the largest range.
      width: of the cells of the mean; 0 for a single cell.
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
