"""Derivatives of tables by central differences, extrapolated to a step of zero, with an estimate of their error.

Reference: Richardson & Gaunt (1927), Phil. Trans. A 226; docs/theory/designs.md (G-8, G-9).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
STEP = 4e-3
"""Largest relative step: its fourth power, and rounding over its quarter, are about 1e-10."""
LEVELS = 3
ROUNDING = 1e-13
"""Relative change of a table by the step that counts as none."""


def extrapolated(tables: Callable[[float], Mapping[str, Float]], step: float) -> tuple[dict[str, Float], float]:
    """Derivatives of tables that are functions of one number, at zero, and the largest relative error of a table.

    Args:
      tables: arrays by name, of the same shapes for all arguments.
      step: the largest step.

    Returns:
      Derivatives that are not all zero; and the largest change by the last extrapolation, over the largest derivative
      of the table: some 1e-10 where the tables are smooth, much more at a kink.
    """
    rows: list[list[dict[str, Float]]] = []
    for level in range(LEVELS):
        h = step / 2.0**level
        low, high = tables(-h), tables(h)
        row = [{name: (high[name] - array) / (2.0 * h) for name, array in low.items()}]
        for k in range(level):
            weight = 1.0 / (4.0 ** (k + 1) - 1.0)
            row.append({name: a + weight * (a - rows[-1][k][name]) for name, a in row[k].items()})
        rows.append(row)
    best, before = rows[-1][-1], rows[-1][-2]
    found, error = {}, 0.0
    for name, array in best.items():
        largest, size = (float(np.max(np.abs(a), initial=0.0)) for a in (array, high[name]))
        if largest * step > ROUNDING * size:
            found[name] = array
            error = max(error, float(np.max(np.abs(array - before[name]))) / largest)
    return found, error
