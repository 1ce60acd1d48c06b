"""Look-up tables on uniform grids: linear between entries, constant beyond the edge."""

from __future__ import annotations

from meltemi.compiler import Numbers, kernel, whole


@kernel
def linear(values: Numbers, n: int, place: float) -> float:
    """Value at a fractional index from zero.

    Args:
      n: number of entries, one or more.
    """
    u = min(max(place, 0.0), n - 1.0)
    i = min(whole(u), max(n - 2, 0))
    right = 1 if n > 1 else 0
    return values[i] + (u - i) * (values[i + right] - values[i])


@kernel
def bilinear(values: Numbers, rows: int, columns: int, row: float, column: float) -> float:
    """Value at fractional row and column from zero of a table (rows, columns)."""
    u = min(max(row, 0.0), rows - 1.0)
    v = min(max(column, 0.0), columns - 1.0)
    i, j = min(whole(u), max(rows - 2, 0)), min(whole(v), max(columns - 2, 0))
    down, right = (1 if rows > 1 else 0), (1 if columns > 1 else 0)
    a, b = u - i, v - j
    upper = values[i, j] + b * (values[i, j + right] - values[i, j])
    lower = values[i + down, j] + b * (values[i + down, j + right] - values[i + down, j])
    return upper + a * (lower - upper)
