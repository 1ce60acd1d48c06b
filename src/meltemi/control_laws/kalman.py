"""Steps of a scheduled Kalman filter: prediction and update between the linear models of two wind speeds.

The filter is one vector, so that a compiled controller can have it as its state: sizes, state, outputs and inputs of
the last steps, the tables of the models, and room for the next state and outputs.

Reference: docs/theory/observer.md (O-8 to O-11).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import kernel

Float = NDArray[np.float64]

MODELS, STATES, INPUTS, OUTPUTS, SENSORS, WIND, FIRST, SPACING, SHARE, SCHEDULE, HEAD = range(11)
"""Indices of sizes, settings and the scheduling wind speed [m/s] in the vector, see ``filter_vector``."""


def filter_vector(
    z: Float, u: Float, sensors: int, wind: int, schedule: Sequence[float], tables: Sequence[Float]
) -> NDArray[np.float64]:
    """The vector of a filter.

    Args:
      z: (n,) state at the start.
      u: (m,) inputs at the start.
      sensors: number s of measured outputs, the first ones.
      wind: index in the state of the wind speed that schedules the models after a lag.
      schedule: first and spacing of the wind speeds of the models [m/s], share of the lag in a step [-], wind speed at
        the start [m/s].
      tables: centre (k, n), A (k, n, n), B (k, n, m), K (k, n, s), C (k, p, n), D (k, p, m), inputs (k, m) and
        outputs (k, p) of k models.
    """
    centre, outputs = tables[0], tables[-1]
    sizes = (*centre.shape, len(u), outputs.shape[1], sensors, wind)
    # matrices by columns: a product adds columns, which has no chain of dependent sums
    parts = [np.swapaxes(t, 1, 2) if t.ndim == 3 else t for t in tables]
    y = np.zeros(outputs.shape[1])
    return np.concatenate([sizes, schedule, z, y, u, u, *(np.ravel(t) for t in parts), z, y]).astype(float)


@kernel
def kalman_step(f: Float, inputs: Any, measured: Any) -> None:
    """One step: the state is predicted with the inputs of the last step, then updated with the measurement.

    Args:
      f: vector of the filter, changed in place: the state stands at ``HEAD``, the outputs after it.
      inputs: (m,) inputs of this step.
      measured: (s,) sensor values; NaN for a missing value, which is not used.
    """
    k, n, m, p, s = int(f[MODELS]), int(f[STATES]), int(f[INPUTS]), int(f[OUTPUTS]), int(f[SENSORS])
    z, y = f[HEAD : HEAD + n], f[HEAD + n : HEAD + n + p]
    at = HEAD + n + p
    before, now, at = f[at : at + m], f[at + m : at + 2 * m], at + 2 * m
    for c in range(m):
        before[c], now[c] = now[c], inputs[c]
    centre, at = f[at : at + k * n], at + k * n
    A, at = f[at : at + k * n * n], at + k * n * n
    B, at = f[at : at + k * n * m], at + k * n * m
    K, at = f[at : at + k * n * s], at + k * n * s
    C, at = f[at : at + k * p * n], at + k * p * n
    D, at = f[at : at + k * p * m], at + k * p * m
    steady, at = f[at : at + k * m], at + k * m
    outputs, at = f[at : at + k * p], at + k * p
    # no allocation of arrays here, so that the step can be exported in libraries
    new, measured_outputs = f[at : at + n], f[at + n : at + n + p]
    f[at : at + n + p] = 0.0
    f[SCHEDULE] += f[SHARE] * (z[int(f[WIND])] - f[SCHEDULE])
    place = min(max((f[SCHEDULE] - f[FIRST]) / f[SPACING], 0.0), k - 1.0)
    left = min(int(place), max(k - 2, 0))
    right = min(left + 1, k - 1)
    share = place - left if right > left else 0.0
    for i, part in ((left, 1.0 - share), (right, share)):
        _add(new, part, centre, i)
        _add_product(new, part, A, z, centre, i)
        _add_product(new, part, B, before, steady, i)
    for i, part in ((left, 1.0 - share), (right, share)):
        _add(measured_outputs, part, outputs, i)
        _add_product(measured_outputs, part, C, new, centre, i)
        _add_product(measured_outputs, part, D, now, steady, i)
    for r in range(n):
        z[r] = new[r]
    for c in range(s):
        gap = measured[c] - measured_outputs[c]
        if not np.isnan(gap):
            for i, part in ((left, (1.0 - share) * gap), (right, share * gap)):
                _add(z, part, K, i * s + c)
    y[:] = 0.0
    for i, part in ((left, 1.0 - share), (right, share)):
        _add(y, part, outputs, i)
        _add_product(y, part, C, z, centre, i)
        _add_product(y, part, D, now, steady, i)


@kernel
def _add(total: Float, factor: float, table: Float, i: int) -> None:
    """Add a factor times row ``i`` of a table."""
    n = len(total)
    row = table[i * n : i * n + n]
    for r in range(n):
        total[r] += factor * row[r]


@kernel
def _add_product(total: Float, factor: float, table: Float, x: Float, about: Float, i: int) -> None:
    """Add a factor times matrix ``i`` of a table, stored by columns, times x minus row ``i`` of ``about``."""
    n = len(x)
    for c in range(n):
        _add(total, factor * (x[c] - about[i * n + c]), table, i * n + c)
