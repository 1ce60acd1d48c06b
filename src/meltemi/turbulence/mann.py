"""Mann's uniform shear turbulence: the spectral tensor, its one-point spectra, and fields across the wind.

Isotropic turbulence with von Karman's energy spectrum is sheared for as long as its eddies live (rapid distortion).
Three parameters: a length L, the shear parameter Gamma of the eddies' life, and a standard deviation.

A field is synthesised frequency by frequency: a sum over wave vectors (k2, k3) across the wind, each with separate
random numbers. Large slow eddies are far wider than the rotor, so at low frequencies the tensor is a narrow ridge about
k2 = k3 = 0. The wave numbers are therefore graded: dense there, and elsewhere as wide apart as the grid's width allows.
Such a sum is two matrix products. The variance beyond the largest wave number is added as a part that is independent
from point to point, so every point has exactly the one-point spectra.

Lengths are relative to L. Wave number 1 points downwind: a frozen field that passes with speed U has at frequency f
the wave number k1 = -2 pi f L / U, since later parts of the field are upwind.

Reference: docs/theory/wind.md (W-13 to W-19); Mann (1994), J. Fluid Mech. 273, 141-168; Mann (1998), Prob. Eng.
Mech. 13, 269-282; IEC 61400-1 ed. 3, B.1 to B.12.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import atan2, cos, gamma, log, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import exp, kernel
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.random import noise

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

GAMMA = 3.9
"""Shear parameter of IEC 61400-1."""
LENGTH = 0.8
"""[-] L over the scale parameter in IEC 61400-1."""
ENERGY = 1.5 / (0.5 * gamma(2.5) * gamma(1.0 / 3.0) / gamma(17.0 / 6.0))
"""E(k) = ENERGY k^4 / (1 + k^2)^(17/6) has the integral 3/2, for unit L and unit isotropic deviation; 1.4528."""
LOWEST, HIGHEST, ENTRIES = 1e-6, 1e6, 1201
"""Wave numbers of the table of eddy lifetimes, equally spaced in their logarithm."""
SPACING = log(HIGHEST / LOWEST) / (ENTRIES - 1)
INDEPENDENT = 5.0
"""k1 times the grid step above which neighbours are independent: their coherence is below exp(-5)."""
REACH = 4.0
"""Correlation lengths, 1 / hypot(k1, 1), between a point and its nearest image."""
GRADING, CORE = 0.5, 0.3
"""Ratio of spacing to wave number near zero, and width of the innermost range over k1."""


@cache
def lifetimes(gamma: float) -> Float:
    """Logarithm of beta = Gamma k^(-2/3) / sqrt(2F1(1/3, 17/6; 4/3; -k^-2)), the shear that an eddy has seen (W-14)."""
    from scipy.special import hyp2f1  # slow to import, and only Mann needs it

    k = np.exp(np.linspace(log(LOWEST), log(HIGHEST), ENTRIES))
    beta: Float = np.log(gamma * k ** (-2.0 / 3.0)) - 0.5 * np.log(hyp2f1(1 / 3, 17 / 6, 4 / 3, -(k**-2.0)))
    return beta


@kernel
def lifetime(k_squared: float, table: Float) -> float:
    """Shear beta of an eddy, from the table: linear in the logarithms."""
    x = min(max((0.5 * log(k_squared) - log(LOWEST)) / SPACING, 0.0), ENTRIES - 1.001)
    i = int(x)
    return exp(table[i] + (x - i) * (table[i + 1] - table[i]))


@kernel
def root(k1: float, k2: float, k3: float, table: Float, psi: Float) -> None:
    """A square root ``psi`` (3, 3) of the spectral tensor, Phi = psi psi^T, for unit L and isotropic deviation.

    Before the shearing the mode had the wave vector k0 = (k1, k2, k3 + beta k1) and the velocity sqrt(E / 4 pi) / k0^2
    times k0 x n with normal numbers n (W-15). The shearing turns vertical motion into horizontal one by zeta_1, zeta_2
    (W-16).
    """
    k = k1 * k1 + k2 * k2 + k3 * k3  # squared, like k0 and h
    beta = lifetime(k, table)
    k30 = k3 + beta * k1
    h = k1 * k1 + k2 * k2
    k0 = h + k30 * k30
    e = sqrt(ENERGY / (4.0 * pi)) * exp(-17.0 / 12.0 * log(1.0 + k0))
    c1 = beta * k1 * k1 * (k0 - 2.0 * k30 * k30 + beta * k1 * k30) / (k * h)
    c2 = k2 * k0 / (h * sqrt(h)) * atan2(beta * k1 * sqrt(h), k0 - k30 * k1 * beta)
    zeta_1, zeta_2 = c1 - k2 / k1 * c2, k2 / k1 * c1 + c2
    psi[0, 0], psi[0, 1], psi[0, 2] = -e * k2 * zeta_1, e * (k1 * zeta_1 - k30), e * k2
    psi[1, 0], psi[1, 1], psi[1, 2] = e * (k30 - k2 * zeta_2), e * k1 * zeta_2, -e * k1
    psi[2, 0], psi[2, 1], psi[2, 2] = -e * k2 * k0 / k, e * k1 * k0 / k, 0.0


@kernel
def add_products(psi: Float, area: float, sums: Float) -> None:
    """Add the tensor's entries 11, 22, 33, 13 times ``area`` to ``sums`` (4,)."""
    for j in range(3):
        sums[0] += area * psi[0, j] * psi[0, j]
        sums[1] += area * psi[1, j] * psi[1, j]
        sums[2] += area * psi[2, j] * psi[2, j]
        sums[3] += area * psi[0, j] * psi[2, j]


@kernel
def integrate_across(k1: Float, table: Float, radii: Float, turns: int, out: Float) -> None:
    """Integrals ``out`` (K, 4) of the tensor over the plane across the wind: 11, 22, 33, 13.

    Polar coordinates with radii times sqrt(1 + k1^2), equally spaced in their logarithm. The integrand is periodic in
    the angle and falls off to both sides in the logarithm, so the trapezoidal rule converges like a power.
    """
    psi = np.zeros((3, 3))
    step = log(radii[1] / radii[0]) * 2.0 * pi / turns
    out[:] = 0.0
    for i in range(len(k1)):
        for radius in radii:
            r = radius * sqrt(1.0 + k1[i] * k1[i])
            for j in range(turns):
                angle = 2.0 * pi * (j + 0.5) / turns
                root(k1[i], r * cos(angle), r * sin(angle), table, psi)
                add_products(psi, r * r * step, out[i])


@kernel
def shear(
    k1: float, k3: Float, k2: Float, weight_3: Float, weight_2: Float, table: Float, modes: Complex, sums: Float
) -> None:
    """Convert normal numbers ``modes`` (3, K3, K2) to u, v, w; ``sums`` (4,) are the covariances 11, 22, 33, 13."""
    psi = np.zeros((3, 3))
    sums[:] = 0.0
    # wave numbers are symmetric about zero, and with -k2 four entries of the root change their sign
    half = len(k2) // 2
    for i in range(len(k3)):
        for j in range(half, len(k2)):
            root(k1, k2[j], k3[i], table, psi)
            area = weight_3[i] * weight_2[j]
            add_products(psi, 2.0 * area, sums)
            to_velocities(psi, sqrt(area), modes[:, i, j])
            psi[0, 0], psi[0, 2], psi[1, 1], psi[2, 0] = -psi[0, 0], -psi[0, 2], -psi[1, 1], -psi[2, 0]
            to_velocities(psi, sqrt(area), modes[:, i, len(k2) - 1 - j])


@kernel
def to_velocities(psi: Float, amplitude: float, mode: Complex) -> None:
    """Convert three normal numbers ``mode`` to velocities, in place."""
    a, b, c = mode[0], mode[1], mode[2]
    for m in range(3):
        mode[m] = amplitude * (psi[m, 0] * a + psi[m, 1] * b + psi[m, 2] * c)


@kernel
def tensor(k1: float, k3: Float, k2: Float, table: Float, out: Float) -> None:
    """Spectral tensor ``out`` (3, 3, K3, K2)."""
    psi = np.zeros((3, 3))
    for i in range(len(k3)):
        for j in range(len(k2)):
            root(k1, k2[j], k3[i], table, psi)
            for m in range(3):
                for n in range(3):
                    out[m, n, i, j] = psi[m, 0] * psi[n, 0] + psi[m, 1] * psi[n, 1] + psi[m, 2] * psi[n, 2]


class OnePoint:
    """One-point spectra of unit L and isotropic deviation, as splines of the logarithms."""

    def __init__(self, gamma: float) -> None:
        from scipy.interpolate import CubicSpline

        k1 = np.exp(np.linspace(log(1e-3), log(1e4), 57))
        values = np.empty((len(k1), 4))
        integrate_across(k1, lifetimes(gamma), np.exp(np.linspace(-12.0, 12.0, 150)), 256, values)
        self.diagonal = CubicSpline(np.log(k1), np.log(values[:, :3]))
        self.correlation = CubicSpline(np.log(k1), values[:, 3] / np.sqrt(values[:, 0] * values[:, 2]))
        # below the lowest wave number the spectra are flat
        x = np.linspace(log(1e-3), log(1e4), 4001)
        k = np.exp(x)
        head, tail = k[0], 1.5 * k[-1]  # a power of -5/3 beyond the highest
        f = self(k)
        self.variances = 2.0 * (head * f[:, 0] + tail * f[:, -1] + np.trapezoid(k * f, x))
        """(4,) of u, v, w and their covariance uw, for a unit isotropic deviation."""

    def __call__(self, k1: Float) -> Float:
        """Two-sided densities (4, K) of u, v, w and the co-spectrum uw, at k1 > 0."""
        x = np.log(np.clip(k1, 1e-3, 1e4))
        f: Float = np.exp(self.diagonal(x)).T * np.where(k1 > 1e4, (1e4 / k1) ** (5.0 / 3.0), 1.0)
        return np.vstack([f, self.correlation(x) * np.sqrt(f[0] * f[2])])


@cache
def one_point(gamma: float) -> OnePoint:
    """One-point spectra, integrated once in a process."""
    return OnePoint(gamma)


def graded(k1: float, highest: float, width: float) -> tuple[Float, Float]:
    """Wave numbers across the wind and their weights, symmetric about zero.

    Their spacing is 1/h = 1/(2 pi / period) + 1/(GRADING hypot(k, CORE k1)): the midpoint rule in a smooth coordinate.

    Args:
      k1: longitudinal wave number of the frequency.
      highest: up to which they reach.
      width: width of the grid; the period of the sum is longer by the decay length of the correlation.
    """
    widest = 2.0 * pi / (width + REACH / np.hypot(k1, 1.0))
    core = CORE * k1
    fine = np.concatenate([[0.0], np.geomspace(1e-4 * core, highest, 2000)])
    coordinate = fine / widest + np.arcsinh(fine / core) / GRADING
    count = int(np.ceil(coordinate[-1]))
    step = coordinate[-1] / count
    k = np.interp((np.arange(count) + 0.5) * step, coordinate, fine)
    weight = step / (1.0 / widest + 1.0 / (GRADING * np.hypot(k, core)))
    return np.concatenate([-k[::-1], k]), np.concatenate([weight[::-1], weight])


def wave_numbers(k1: float, grid: WindGrid, length: float) -> tuple[tuple[Float, Float], tuple[Float, Float]]:
    """Graded wave numbers and weights, vertical and lateral.

    They reach to the largest that the grid resolves; if k1 is near it, or the grid is coarse, to two or three times
    it, which the grid shows as images at lower wave numbers.
    """
    step = max(grid.dy, grid.dz) / length
    factor = 1.0 if k1 * step < 0.3 and step < 0.3 else 2.0 if k1 * step < 1.5 else 3.0
    height = (grid.points_z - 1) * grid.dz
    return (
        graded(k1, factor * pi * length / grid.dz, height / length),
        graded(k1, factor * pi * length / grid.dy, grid.width / length),
    )


def waves(k: Float, x: Float) -> Complex:
    """exp(i k x) (X, K)."""
    return np.exp(1j * np.outer(x, k))


def sheared_fields(
    k1: Float, grid: WindGrid, length: float, gamma: float, seed: int, stream: int
) -> Iterator[tuple[Complex, Float]]:
    """Complex fields of u, v, w at successive wave numbers along the wind.

    Args:
      k1: (B,) positive, in 1 / L.
      grid: points across the wind.
      length: L [m].
      gamma: shear parameter.
      seed, stream: address of the random numbers; three streams are used.

    Yields:
      Fields (3, Z, Y) and the part of the one-point densities (4,) that they contain, both for a unit isotropic
      deviation and a unit interval of k1.
    """
    table = lifetimes(gamma)
    for i, k in enumerate(k1):
        (k3, weight_3), (k2, weight_2) = wave_numbers(float(k), grid, length)
        modes, covered = np.empty((3, len(k3), len(k2)), np.complex128), np.empty(4)
        bits = np.empty((4, len(k3) * len(k2) // 2), np.uint32)
        for c in range(3):
            noise(seed, i, stream + c, bits, modes[c].reshape(-1))
        shear(-float(k), k3, k2, weight_3, weight_2, table, modes, covered)
        yield waves(k3, grid.z / length) @ modes @ waves(k2, grid.y / length).T, covered


def covariance_with(point: tuple[int, int], k1: float, grid: WindGrid, length: float, gamma: float) -> Complex:
    """Covariances (3, 3, Z, Y) of the components at every point with those at one, E u_i(x) conj u_j(point)."""
    (k3, weight_3), (k2, weight_2) = wave_numbers(k1, grid, length)
    phi = np.empty((3, 3, len(k3), len(k2)))
    tensor(-k1, k3, k2, lifetimes(gamma), phi)
    z, y = (grid.z - grid.z[point[0]]) / length, (grid.y - grid.y[point[1]]) / length
    return waves(k3, z) @ (phi * weight_3[:, None] * weight_2) @ waves(k2, y).T
