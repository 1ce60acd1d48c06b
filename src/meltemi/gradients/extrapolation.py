"""Derivatives of tables by central differences, extrapolated to a step of zero, with an estimate of their error.

Reference: Richardson & Gaunt (1927), Phil. Trans. A 226; docs/theory/designs.md (D-17, D-18).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
STEP = 0.03
"""Largest relative step: with four levels its eighth power, and rounding of mode shapes over its eighth, are 1e-9."""
LEVELS = 4
ROUNDING = 1e-14
"""Relative change of an entry by the step that counts as none."""
FLOOR = 1e-3
"""Smallest row of a table, over its largest, whose error counts."""
ENOUGH = 1e-5
"""Relative error above which the step is reduced: two modes that nearly cross within it."""
REDUCED = (1.0, 0.25, 0.0625)
"""Parts of the step that are tried."""


def extrapolated(tables: Callable[[float], Mapping[str, Float]], step: float) -> tuple[dict[str, Float], float]:
    """Derivatives of tables that are functions of one number, at zero, and the largest relative error of a row.

    Args:
      tables: arrays by name, of the same shapes for all arguments.
      step: the largest step.

    Returns:
      Derivatives that are not all zero; and the largest change by the last extrapolation, over the largest value or
      derivative in the row of the table: some 1e-9 where the tables are smooth, much more at a kink.
    """
    found: list[tuple[dict[str, Float], float]] = []
    for part in REDUCED:
        found.append(_extrapolated(tables, part * step, step / STEP))
        if found[-1][1] <= ENOUGH:
            break
    return min(found, key=lambda each: each[1])


def _extrapolated(
    tables: Callable[[float], Mapping[str, Float]], step: float, unit: float
) -> tuple[dict[str, Float], float]:
    """Derivatives by steps from a largest one, and their error over values by a unit of the argument."""
    rows: list[list[dict[str, Float]]] = []
    for level in range(LEVELS):
        h = step / 2.0**level
        low, high = tables(-h), tables(h)
        row = [{name: (high[name] - array) / (2.0 * h) for name, array in low.items()}]
        for k in range(level):
            weight = 1.0 / (4.0 ** (k + 1) - 1.0)
            row.append({name: a + weight * (a - rows[-1][k][name]) for name, a in row[k].items()})
        rows.append(row)
    found, error = {}, 0.0
    for name, array in rows[-1][-1].items():
        moved = np.abs(array) * step > ROUNDING * np.abs(high[name])
        if np.any(moved):
            found[name] = np.where(moved, array, 0.0)
            whole = np.maximum(np.abs(found[name]), np.abs(high[name]) / unit)
            sizes = np.max(whole, axis=-1, keepdims=True) if array.ndim else whole
            sizes = np.maximum(sizes, FLOOR * float(np.max(whole)))
            change = np.where(moved, np.abs(array - rows[-1][-2][name]), 0.0)
            error = max(error, float(np.max(change / np.where(sizes > 0.0, sizes, 1.0))))
    return found, error
