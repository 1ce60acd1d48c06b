"""Fields with the exponential coherence exp(-kappa r), frequency by frequency, by circulant embedding.

At one frequency the field across the grid is a random one whose covariance depends on the distance r of two points
alone. On a torus, a grid whose opposite sides are joined, such a covariance is diagonal in Fourier modes: independent
numbers, weighted by the square roots of its eigenvalues and transformed by FFT, have it exactly (Dietrich and Newsam
1997). The grid is a part of a torus so large that its images are negligible: the sum of exp(-kappa r) over all
images is positive definite whatever kappa, and differs from exp(-kappa r) on the grid by less than TOLERANCE.

Low frequencies need a large torus, but they are few; high ones need hardly more than the grid.

Reference: docs/theory/wind.md (W-10 to W-12).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.random import noise

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

TOLERANCE = 1e-4
"""Negligible coherence: of a point with its images, and of neighbours where they become independent."""
REACH = -float(np.log(TOLERANCE))
"""Distance times kappa at which the coherence has fallen to the tolerance."""
CHUNK_POINTS = 400_000
"""Number of points of the tori that are processed together."""


def even_fast(n: int, *, real: bool = False) -> int:
    """The next even number from ``n`` on whose FFT is fast."""
    while True:
        n = fft.next_fast_len(n, real=real)
        if n % 2 == 0:
            return n
        n += 1


def torus_size(points: int, step: float, reach: float) -> int:
    """Even number of points of a torus side: those of the grid, and a distance [m] to its image."""
    return even_fast(points - 1 + int(np.ceil(reach / step)))


def eigenvalues(kappa: Float, size: tuple[int, int], dz: float, dy: float) -> Float:
    """Eigenvalues (B, Z/2 + 1, Y/2 + 1) of exp(-kappa r) on a torus (Z, Y), for each kappa [1/m] (B,).

    They are even in both wave numbers, so a quarter of them is sufficient; their mean over the whole torus is 1.
    """
    z, y = (d * np.arange(n // 2 + 1) for n, d in zip(size, (dz, dy), strict=True))
    covariance: Float = np.zeros((len(kappa), len(z), len(y)))
    for image_z in (z, size[0] * dz - z):
        for image_y in (y, size[1] * dy - y):
            covariance += np.exp(-kappa[:, None, None] * np.hypot(image_z[:, None], image_y))
    covariance /= covariance[:, :1, :1]
    # farther images are left out, which can make the smallest eigenvalues negative by less than the tolerance squared
    return np.maximum(fft.dctn(covariance, type=1, axes=(1, 2)), 0.0)


def groups(sizes: list[tuple[int, int]]) -> Iterator[tuple[slice, tuple[int, int]]]:
    """Slices of successive frequencies whose tori have the same size, with a limited number of points."""
    begin = 0
    while begin < len(sizes):
        size = sizes[begin]
        most = max(CHUNK_POINTS // (size[0] * size[1]), 1)
        end = begin + 1
        while end < len(sizes) and end - begin < most and sizes[end] == size:
            end += 1
        yield slice(begin, end), size
        begin = end


def torus_noise(seed: int, bins: range, stream: int, size: tuple[int, int]) -> Complex:
    """Complex normal numbers (B, Z, Y) of unit variance for the modes of a torus."""
    count = size[0] * size[1]  # even
    out = np.empty((len(bins), *size), np.complex128)
    bits = np.empty((4, count // 2), np.uint64)
    for i, m in enumerate(bins):
        noise(seed, m, stream, bits, out[i].reshape(-1))
    return out


def cut_out(modes: Complex, grid: WindGrid) -> Complex:
    """Fields (..., Z, Y) on the grid from modes on a torus: sums of modes times exp(i k x)."""
    across = fft.ifft(modes, axis=-2, norm="forward")[..., : grid.points_z, :]
    return fft.ifft(across, axis=-1, norm="forward")[..., : grid.points_y]


def coherent_fields(kappa: Float, grid: WindGrid, addresses: list[tuple[int, int]]) -> Iterator[tuple[slice, Complex]]:
    """Complex fields of unit variance with coherence exp(-kappa r) at successive frequencies.

    Args:
      kappa: (B,) [1/m] increasing.
      grid: points across the wind.
      addresses: seed and stream of the random numbers of each independent field (C).

    Yields:
      Slice of frequencies, and fields (C, b, Z, Y).
    """
    sizes = [
        (torus_size(grid.points_z, grid.dz, REACH / k), torus_size(grid.points_y, grid.dy, REACH / k)) for k in kappa
    ]
    for some, size in groups(sizes):
        quarter = np.sqrt(eigenvalues(kappa[some], size, grid.dz, grid.dy) / (size[0] * size[1]))
        row, column = (np.minimum(np.arange(n), n - np.arange(n)) for n in size)
        weight = quarter[:, row[:, None], column]
        bins = range(some.start, some.stop)
        yield some, np.stack([cut_out(weight * torus_noise(seed, bins, s, size), grid) for seed, s in addresses])
