"""Steps of a scheduled Kalman filter: prediction and update between the linear models of two wind speeds.

Reference: docs/theory/observer.md (O-8 to O-11).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.core.kernel import kernel

Float = NDArray[np.float64]


@kernel
def kalman_step(
    z: Float,
    y: Float,
    u: Float,
    measured: Float,
    schedule: float,
    first: float,
    spacing: float,
    centre: Float,
    A: Float,
    B: Float,
    K: Float,
    C: Float,
    D: Float,
    inputs: Float,
    outputs: Float,
) -> None:
    """One step: z is predicted with the input of the last step, then updated with the measurement.

    Args:
      z: (n,) state, changed in place.
      y: (p,) outputs after the update, changed in place; the first s are the sensors.
      u: (2, m) inputs of the last and of this step.
      measured: (s,) of the sensors; NaN where one has no value, which is then not used.
      schedule: [m/s] wind speed between whose models the step is taken.
      first, spacing: [m/s] of the wind speeds of the models.
      centre: (k, n) operating points.
      A, B: (k, n, n), (k, n, m) of the discrete models.
      K: (k, n, s) gains.
      C, D: (k, p, n), (k, p, m) of the outputs.
      inputs, outputs: (k, m), (k, p) at the operating points.
    """
    k, n = centre.shape
    m, p, s = inputs.shape[1], outputs.shape[1], measured.shape[0]
    place = min(max((schedule - first) / spacing, 0.0), k - 1.0)
    at = min(int(place), max(k - 2, 0))
    other = min(at + 1, k - 1)
    right = place - at if other > at else 0.0
    new = np.zeros(n)
    for i, share in ((at, 1.0 - right), (other, right)):
        if share > 0.0:
            for r in range(n):
                total = centre[i, r]
                for c in range(n):
                    total += A[i, r, c] * (z[c] - centre[i, c])
                for c in range(m):
                    total += B[i, r, c] * (u[0, c] - inputs[i, c])
                new[r] += share * total
    gap = np.zeros(s)
    for r in range(s):
        if not np.isnan(measured[r]):
            gap[r] = measured[r]
            for i, share in ((at, 1.0 - right), (other, right)):
                gap[r] -= share * _output(r, i, new, u[1], centre, C, D, inputs, outputs)
    for r in range(n):
        z[r] = new[r]
        for c in range(s):
            z[r] += ((1.0 - right) * K[at, r, c] + right * K[other, r, c]) * gap[c]
    for r in range(p):
        y[r] = 0.0
        for i, share in ((at, 1.0 - right), (other, right)):
            y[r] += share * _output(r, i, z, u[1], centre, C, D, inputs, outputs)


@kernel
def _output(
    r: int, i: int, z: Float, u: Float, centre: Float, C: Float, D: Float, inputs: Float, outputs: Float
) -> float:
    """Output ``r`` of the model ``i``."""
    total = outputs[i, r]
    for c in range(len(z)):
        total += C[i, r, c] * (z[c] - centre[i, c])
    for c in range(len(u)):
        total += D[i, r, c] * (u[c] - inputs[i, c])
    return total
