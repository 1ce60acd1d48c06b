"""Multiblade coordinates: collective, cosine and sine components of blade quantities.

    x_b = x_0 + x_c cos(psi_b) + x_s sin(psi_b),   psi_b = psi + 2 pi (b - 1) / 3

Reference: docs/theory/simulation.md (M-17 to M-19); Bir (2008), NREL/CP-500-42553.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Indices = NDArray[np.intp]
TURNING = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""T' = T TURNING, for the matrix T from components to blades and its derivative by the azimuth."""


def blade_matrix(azimuth: float) -> tuple[Float, Float, Float]:
    """(3, 3) matrix from multiblade to blade coordinates, and its first and second derivative by azimuth."""
    psi = azimuth + 2.0 * np.pi / 3.0 * np.arange(3.0)
    one, zero = np.ones(3), np.zeros(3)
    c, s = np.cos(psi), np.sin(psi)
    return np.stack([one, c, s], 1), np.stack([zero, -s, c], 1), np.stack([zero, -c, -s], 1)


def fixed_frame(
    stiffness: Float, damping: Float, azimuth: float, speed: float, core: int, modes: int
) -> tuple[Float, Float]:
    """Second-order equations q'' = K q + D q' in multiblade coordinates.

    Args:
      stiffness, damping: (n, n) K and D at one azimuth; first ``core`` fixed coordinates, then three blades
        with ``modes`` coordinates each.
      azimuth: [rad] azimuth of blade 1.
      speed: [rad/s] speed of the rotor.

    Returns:
      The same matrices for z with q = T z: collective, cosine, sine component of each blade coordinate.
    """
    n = core + 3 * modes
    T, T1, T2 = np.zeros((3, n, n))
    T[:core, :core] = np.eye(core)
    for whole, part in zip((T, T1, T2), blade_matrix(azimuth), strict=True):
        for k in range(modes):
            rows = core + k + modes * np.arange(3)
            columns = core + 3 * k + np.arange(3)
            whole[np.ix_(rows, columns)] = part
    K = np.linalg.solve(T, stiffness @ T + speed * damping @ T1 - speed**2 * T2)
    D = np.linalg.solve(T, damping @ T - 2.0 * speed * T1)
    return np.asarray(K, dtype=float), np.asarray(D, dtype=float)


def to_components(values: Float, triples: Indices, azimuth: float) -> None:
    """Turn rows of blades into their collective, cosine and sine components, in place; others are unchanged.

    Args:
      values: (n, ...).
      triples: (quantities, 3) rows of blades 1 to 3, and afterwards of the components.
      azimuth: [rad] azimuth of blade 1.
    """
    values[triples] = np.einsum("ij,kj...->ki...", np.linalg.inv(blade_matrix(azimuth)[0]), values[triples])


def by_components(matrix: Float, triples: Indices, azimuth: float) -> None:
    """Turn columns (rows, n), derivatives by quantities of blades, into those by the components, in place."""
    matrix[:, triples] = matrix[:, triples] @ blade_matrix(azimuth)[0]
