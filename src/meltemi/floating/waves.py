"""Forces of waves on a platform over a run: of first order, and at differences and sums of frequencies, by Fourier sums
beforehand.

Reference: docs/theory/floating.md (W-9, W-11, W-38, W-39); Pinkster (1980); Standing, Brendling & Wilson (1987).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from meltemi.core.errors import InputError
from meltemi.floating.platform import Platform
from meltemi.floating.potential import HydroCoefficients
from meltemi.sea.airy import WaveComponents, wave_number
from meltemi.sea.field import amplitudes_at, repeats, summed, times

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
MEAN_OF = 600.0
"""[s] duration of a sea over which mean forces are taken."""
HEADINGS = 36
"""Number of headings of a platform over a turn at which the excitation is known."""
FEWEST = 1e-4
"""Amplitude of waves over the largest below which they do not push a displaced platform."""


def wave_forces(
    sea: Any, c: HydroCoefficients, platform: Platform, duration: float, origin: tuple[float, float], gravity: float
) -> tuple[float, float, Float]:
    """Step [s], period [s], and (T, 7) elevation, forces [N] and moments [N m] of the waves of a sea; without those of
    first order on a displaced platform.

    Raises:
      InputError: waves or their directions are not in the coefficients.
    """
    waves = sea.components(platform.depth, duration, gravity)
    dt, count, total = times(waves, duration, platform.sum_forces)
    amplitude = amplitudes_at(waves, wave_number(waves.frequency, platform.depth, gravity), origin)
    scale = platform.water_density * gravity
    at_rest = scale * (platform.excitation == "at_rest")
    lines = np.concatenate([amplitude[None], at_rest * amplitude * excitation(c, waves).T])
    series = summed(waves, lines, dt, count, total)
    kinds: list[Any] = ["drift"] * (platform.drift != "none") + ["sums"] * platform.sum_forces
    for kind in kinds if len(waves.frequency) else ():
        mean, further, pairs = second_order(kind, c, platform, waves, amplitude)
        series[1:] += scale * (mean[:, None] + summed(further, pairs, dt, count, total))
    return dt, repeats(waves, dt), np.ascontiguousarray(series.T)


def displaced_forces(
    sea: Any, c: HydroCoefficients, platform: Platform, duration: float, origin: tuple[float, float], gravity: float
) -> tuple[Float, Float]:
    """Waves of a sea one by one for a displaced platform (W-39).

    Returns:
      (M, 3) frequency [rad/s] and wave number along x and y [rad/m]; (HEADINGS, M, 12) forces [N] and moments [N m] in
      the platform's axes at headings from 0 on, real parts first.

    Raises:
      InputError: coefficients do not have all headings.
    """
    waves = sea.components(platform.depth, duration, gravity)
    size = np.abs(waves.amplitude)
    some = (size > FEWEST * size.max(initial=0.0)) & (waves.frequency <= c.frequency[-1])
    beta = waves.direction[some]
    waves = WaveComponents(waves.frequency[some], waves.amplitude[some], beta, waves.period)
    k = wave_number(waves.frequency, platform.depth, gravity)
    amplitude = platform.water_density * gravity * amplitudes_at(waves, k, origin)
    force = np.zeros((HEADINGS, len(k), 12))
    for row, heading in zip(force, 2.0 * np.pi / HEADINGS * np.arange(HEADINGS), strict=True):
        try:
            X = amplitude[:, None] * excitation(c, replace(waves, direction=beta - heading))
        except InputError:
            raise InputError(
                "platform.excitation: displaced needs coefficients of all headings, and those of the platform have "
                f"{c.heading[0]:g} to {c.heading[-1]:g} deg"
            ) from None
        row[:] = np.concatenate([X.real, X.imag], axis=1)
    return np.stack([waves.frequency, k * np.cos(beta), k * np.sin(beta)], axis=1), force


def mean_drift(sea: Any, c: HydroCoefficients, platform: Platform, gravity: float) -> Float:
    """(6,) [N], [N m] mean forces of second order of the waves of a sea; zero without drift.

    Raises:
      InputError: as for :func:`second_order`.
    """
    waves = sea.components(platform.depth, MEAN_OF, gravity)
    if platform.drift == "none" or not len(waves.frequency):
        return np.zeros(6)
    return platform.water_density * gravity * second_order("drift", c, platform, waves, waves.amplitude)[0]


def excitation(c: HydroCoefficients, waves: WaveComponents) -> Complex:
    """(M, 6) force per amplitude over density and gravity, linear between frequencies and headings (W-9).

    Raises:
      InputError: energy of the waves is at frequencies above, or headings outside, those of the coefficients.
    """
    power = np.abs(waves.amplitude) ** 2
    high = waves.frequency > c.frequency[-1] * (1.0 + 1e-9)
    if power[high].sum() > 1e-3 * power.sum():
        raise InputError(
            f"sea: waves of a period below {2.0 * np.pi / c.frequency[-1]:.3g} s are not in platform.coefficients"
        )
    heading = np.degrees(waves.direction)
    heading = heading - 360.0 * np.floor((heading - c.heading[0]) / 360.0)
    if len(heading) and heading.max() > c.heading[-1] + 1e-6:
        worst = heading.max()
        raise InputError(
            f"sea.direction: waves that travel towards {worst:g} deg (counter-clockwise) are not in "
            f"platform.coefficients, which have {c.heading[0]:g} to {c.heading[-1]:g} deg"
        )
    X = np.concatenate([c.excitation[:1], c.excitation])  # constant below the lowest frequency
    (i, s), (j, r) = between(np.append(0.0, c.frequency), waves.frequency), between(c.heading, heading)
    i_up, j_up, s, r = np.minimum(i + 1, X.shape[0] - 1), np.minimum(j + 1, X.shape[1] - 1), s[:, None], r[:, None]
    result: Complex = (1.0 - s) * ((1.0 - r) * X[i, j] + r * X[i, j_up])
    result += s * ((1.0 - r) * X[i_up, j] + r * X[i_up, j_up])
    result[high] = 0.0
    return result


def second_order(
    kind: Literal["drift", "sums"], c: HydroCoefficients, platform: Platform, waves: WaveComponents, amplitude: Complex
) -> tuple[Float, WaveComponents, Complex]:
    """Mean forces (6,) over density and gravity, differences or sums of frequencies, and forces (6, P) there (W-11,
    W-29, W-38).

    Raises:
      InputError: the coefficients do not have them, or not in the waves' direction.
    """
    plus, frequency = kind == "sums", getattr(c, f"{kind}_frequency")
    table, turn = _in_direction(kind, c, platform, waves.direction)
    w, order = np.sort(waves.frequency), np.argsort(waves.frequency)
    a = amplitude[order]
    inside = (w >= frequency[0] - 1e-9) & (w <= frequency[-1] + 1e-9)
    w, a = w[inside], a[inside]
    rows, n = np.arange(len(w)), len(w)
    first, last = np.zeros(n, dtype=int), rows + 1  # partners of each wave, at most as fast
    if not plus:
        first, last = np.searchsorted(w, w - (0.0 if platform.drift == "mean" else platform.drift_cutoff)), rows
    count = np.maximum(last - first, 0)
    p = np.repeat(rows, count)
    q = np.arange(len(p)) + np.repeat(first - np.cumsum(count) + count, count)
    still = np.zeros(len(p))
    further = WaveComponents(w[p] + w[q] if plus else w[p] - w[q], still.astype(np.complex128), still, waves.period)
    F, pairs = np.zeros(6), np.zeros((6, len(p)), dtype=np.complex128)
    if not n:
        return F, further, pairs
    both = 2.0 * a[p] * (a[q] if plus else a[q].conj())
    both[p == q] *= 0.5
    i, s = between(frequency, w)
    up = np.minimum(i + 1, len(frequency) - 1)
    low, high, before, after = (1.0 - s[p]) * both, s[p] * both, i[p] * n + q, up[p] * n + q
    for k in range(6):
        transfer = table[..., k]
        if not np.abs(transfer).any():
            continue
        with_second = (1.0 - s) * transfer[:, i] + s * transfer[:, up]  # (D, n)
        mean = ((1.0 - s) * with_second[i, rows] + s * with_second[up, rows]).real
        F[k] = 0.0 if plus else (np.abs(a) ** 2 * mean).sum()
        if platform.drift == "newman" and not plus:
            pairs[k] = 0.5 * (mean[p] + mean[q]) * both
        else:
            pairs[k] = low * with_second.take(before)
            pairs[k] += high * with_second.take(after)
    R = np.kron(np.eye(2), Rotation.from_euler("z", turn, degrees=True).as_matrix())
    return R @ F, further, R @ pairs


def between(known: Float, x: Float) -> tuple[NDArray[np.intp], Float]:
    """Index (X,) of the place before each of ``x`` (X,) among increasing places (N,), and its share of the way (X,) to
    the next one; values there are linear between places, and beyond them."""
    if len(known) == 1:
        return np.zeros(len(x), dtype=np.intp), np.zeros(len(x))
    i = np.clip(np.searchsorted(known, x) - 1, 0, len(known) - 2)
    return i, (x - known[i]) / (known[i + 1] - known[i])


def _in_direction(kind: str, c: HydroCoefficients, platform: Platform, direction: Float) -> tuple[Complex, float]:
    """Forces of second order (D, D, 6) in the direction of the waves, and angle [deg] by which they are turned."""
    heading, name, end = getattr(c, f"{kind}_heading"), "drift", "d"
    if kind == "sums":
        name, end = "sum_forces", "s"
    if not len(heading):
        raise InputError(f"platform.{name} needs a file .12{end} of platform.coefficients; leave it out")
    middle = 0.5 * (heading[0] + heading[-1])
    along = np.degrees(direction) - middle
    along += middle - 360.0 * np.round(along / 360.0)
    near = np.clip(along[:1], heading[0], heading[-1])
    turn = float(along[0] - near[0]) if platform.drift_directions == "turned" else 0.0
    if (off := np.abs(along - near - turn).max()) > 0.1:
        known = " to ".join(f"{x:g}" for x in dict.fromkeys(heading[[0, -1]]))
        raise InputError(
            f"platform.{name} is known for waves along {known} deg only, and these travel {off:.3g} deg from it; use "
            "drift: none and no sum_forces, coefficients with more headings, or for a sea without spreading "
            "drift_directions: turned"
        )
    (i,), (s,) = between(heading, near)
    table = getattr(c, kind)
    return (1.0 - s) * table[i] + s * table[min(i + 1, len(table) - 1)], turn
