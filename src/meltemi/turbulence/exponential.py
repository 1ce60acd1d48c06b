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
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.compiler import kernel
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.random import noise

Float = NDArray[np.float64]
Complex = NDArray[np.complex64]

TOLERANCE = 1e-4
"""Negligible coherence: of a point with its images, and of neighbours where they become independent."""
REACH = -float(np.log(TOLERANCE))
"""Distance times kappa at which the coherence has fallen to the tolerance."""
CHUNK_POINTS = 400_000
"""Number of points of the tori that are processed together."""


@cache
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
    z, y = (d * np.arange(n + 1) for n, d in zip(size, (dz, dy), strict=True))
    alone = -kappa[:, None, None] * np.sqrt(z[:, None] ** 2 + y**2)
    np.exp(alone, out=alone)
    # with the images: a distance across the torus is also its size less that distance
    half_z, half_y = (n // 2 for n in size)
    with_images = alone[:, : half_z + 1] + alone[:, : half_z - 1 : -1]
    covariance = with_images[..., : half_y + 1] + with_images[..., : half_y - 1 : -1]
    covariance /= covariance[:, :1, :1]
    # farther images are left out, which can make the smallest eigenvalues negative by less than the tolerance squared
    return np.maximum(fft.dctn(covariance, type=1, axes=(1, 2), overwrite_x=True), 0.0)


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


@lru_cache(maxsize=4)
def weights(
    kappa: bytes, points: tuple[int, int], steps: tuple[float, float]
) -> list[tuple[slice, NDArray[np.float32]]]:
    """Standard deviations (b, Z/2 + 1, Y/2 + 1) of the modes at successive frequencies; fields of all seeds share them.

    Args:
      kappa: (B,) [1/m] increasing, its bytes.
      points, steps: points of the grid and their spacing [m], vertical and lateral.
    """
    each = np.frombuffer(kappa)
    sides = ([torus_size(n, step, REACH / k) for k in each] for n, step in zip(points, steps, strict=True))
    return [
        (some, np.sqrt(eigenvalues(each[some], size, *steps) / (size[0] * size[1])).astype(np.float32))
        for some, size in groups(list(zip(*sides, strict=True)))
    ]


@kernel
def put_noise(modes: NDArray[np.complex64], weight: NDArray[np.float32], seed: int, first: int, stream: int) -> None:
    """Fill the modes (B, Z, Y) of tori with normal numbers times the weights (B, Z/2 + 1, Y/2 + 1) of a quarter."""
    count_z, count_y = modes.shape[1], modes.shape[2]
    bits = np.empty((4, count_z * count_y // 2), np.uint32)
    numbers = np.empty(count_z * count_y, np.complex64)
    for i in range(modes.shape[0]):
        noise(seed, first + i, stream, bits, numbers)
        for z in range(count_z):
            for y in range(count_y):
                w = weight[i, min(z, count_z - z), min(y, count_y - y)]
                modes[i, z, y] = w * numbers[z * count_y + y]


def cut_out(modes: Complex, grid: WindGrid) -> Complex:
    """Fields (..., Z, Y) on the grid from modes on a torus, which are overwritten: sums of modes times exp(i k x)."""
    across = fft.ifft(modes, axis=-2, norm="forward", overwrite_x=True)[..., : grid.points_z, :]
    return fft.ifft(across, axis=-1, norm="forward", overwrite_x=True)[..., : grid.points_y]


def coherent_fields(kappa: Float, grid: WindGrid, addresses: list[tuple[int, int]]) -> Iterator[tuple[slice, Complex]]:
    """Complex fields of unit variance with coherence exp(-kappa r) at successive frequencies.

    Args:
      kappa: (B,) [1/m] increasing.
      grid: points across the wind.
      addresses: seed and stream of the random numbers of each independent field (C).

    Yields:
      Slice of frequencies, and fields (C, b, Z, Y).
    """
    for some, weight in weights(kappa.tobytes(), (grid.points_z, grid.points_y), (grid.dz, grid.dy)):
        height, width = (2 * (n - 1) for n in weight.shape[1:])
        fields = []
        for seed, stream in addresses:
            modes = np.empty((len(weight), height, width), np.complex64)
            put_noise(modes, weight, seed, some.start, stream)
            fields.append(cut_out(modes, grid))
        yield some, np.stack(fields)
