"""Isotropic turbulence of unit variance for the turbulence added by wakes.

Reference: docs/theory/wakes.md (K-14); von Karman (1948).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

EDDY_SPACING = 0.04
"""Spacing of the points over the largest rotor diameter."""
EDDY_LENGTH = 0.5
"""Length scale over the largest rotor diameter."""
EDDY_POINTS = 64
"""Points in each direction, after which the turbulence repeats."""


@cache
def eddies_of(seed: int) -> NDArray[np.float32]:
    """(n, n, n + 1, 3) velocities [m/s] by x, z and y; the last column is the first one again.

    Energy spectrum of von Karman, without divergence, in a box that repeats in all directions; the means along x and
    along y are zero everywhere.
    """
    n = EDDY_POINTS
    k = 2.0 * np.pi * np.fft.fftfreq(n, EDDY_SPACING)
    waves = np.stack(np.meshgrid(k, k, k, indexing="ij"))
    square = np.einsum("c...,c...->...", waves, waves)
    square[0, 0, 0] = 1.0
    amplitude = np.sqrt(square) * (square + EDDY_LENGTH**-2) ** (-17.0 / 12.0)
    # no components that are constant along the wind, whose mean would not be zero
    amplitude[0] = amplitude[:, 0] = 0.0
    white = np.fft.fftn(np.random.default_rng(seed).standard_normal((3, n, n, n)), axes=(1, 2, 3))
    white -= waves * (np.einsum("c...,c...->...", waves, white) / square)
    u = np.fft.ifftn(amplitude * white, axes=(1, 2, 3)).real
    u /= np.sqrt(np.mean(u**2, axis=(1, 2, 3), keepdims=True))
    box = np.moveaxis(u[[0, 1, 2]], 0, -1).transpose(0, 2, 1, 3)
    return np.ascontiguousarray(np.concatenate([box, box[:, :, :1]], axis=2), dtype=np.float32)
