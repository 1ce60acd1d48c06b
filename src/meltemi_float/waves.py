"""Forces of waves on a platform over a run: of first order, and at difference frequencies, by Fourier sums beforehand.

Reference: docs/theory/floating.md (W-9, W-11); Pinkster (1980); Standing, Brendling & Wilson (1987).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from meltemi.core.errors import InputError
from meltemi_float.coefficients import Coefficients
from meltemi_float.platform import Platform
from meltemi_sea.airy import Components, wave_number
from meltemi_sea.field import summed, times

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
MEAN_OF = 600.0
"""[s] of a sea of which mean forces are taken."""


def wave_forces(
    sea: Any, c: Coefficients, platform: Platform, duration: float, origin: tuple[float, float], gravity: float
) -> tuple[float, float, Float]:
    """Step [s], period [s], and (T, 7) elevation, forces [N] and moments [N m] of the waves of a sea.

    Raises:
      InputError: waves or their directions are not in the coefficients.
    """
    waves = sea.components(platform.depth, duration, gravity)
    dt, count, total = times(waves, duration)
    period = dt if not len(waves.frequency) else math.inf if waves.period is None else waves.period
    k = wave_number(waves.frequency, platform.depth, gravity)
    place = origin[0] * np.cos(waves.direction) + origin[1] * np.sin(waves.direction)
    amplitude = waves.amplitude * np.exp(-1j * k * place)
    scale = platform.water_density * gravity
    lines = np.concatenate([amplitude[None], scale * amplitude * excitation(c, waves).T])
    series = summed(waves, lines, dt, count, total)
    if platform.drift != "none" and len(waves.frequency):
        mean, differences, pairs = drift(c, platform, waves, amplitude)
        series[1:] += scale * (mean[:, None] + summed(differences, pairs, dt, count, total))
    return dt, period if math.isfinite(period) else 1e30, np.ascontiguousarray(series.T)


def mean_drift(sea: Any, c: Coefficients, platform: Platform, gravity: float) -> Float:
    """(6,) [N], [N m] mean forces of second order of the waves of a sea; zero without drift.

    Raises:
      InputError: as of :func:`drift`.
    """
    waves = sea.components(platform.depth, MEAN_OF, gravity)
    if platform.drift == "none" or not len(waves.frequency):
        return np.zeros(6)
    return platform.water_density * gravity * drift(c, platform, waves, waves.amplitude)[0]


def excitation(c: Coefficients, waves: Components) -> Complex:
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
    w = np.append(0.0, c.frequency)
    i = np.clip(np.searchsorted(w, waves.frequency) - 1, 0, len(w) - 2)
    s = np.clip((waves.frequency - w[i]) / (w[i + 1] - w[i]), 0.0, 1.0)[:, None]
    if len(c.heading) == 1:
        return np.asarray((1.0 - s) * X[i, 0] + s * X[i + 1, 0])
    j = np.clip(np.searchsorted(c.heading, heading) - 1, 0, len(c.heading) - 2)
    b = np.clip((heading - c.heading[j]) / (c.heading[j + 1] - c.heading[j]), 0.0, 1.0)[:, None]
    low, above = (1.0 - b) * X[i, j] + b * X[i, j + 1], (1.0 - b) * X[i + 1, j] + b * X[i + 1, j + 1]
    result: Complex = (1.0 - s) * low + s * above
    result[high] = 0.0
    return result


def drift(
    c: Coefficients, platform: Platform, waves: Components, amplitude: Complex
) -> tuple[Float, Components, Complex]:
    """Mean forces (6,) over density and gravity, difference frequencies, and forces (6, P) there (W-11, W-29).

    Raises:
      InputError: the coefficients do not have them, or not in the waves' direction.
    """
    if not len(c.drift_frequency):
        raise InputError(f"platform.drift: {platform.drift!r} needs a file .12d of platform.coefficients; use none")
    turned = np.degrees(waves.direction) - c.drift_heading[0]
    turned -= 360.0 * np.round(turned / 360.0)
    turn = turned[0] if platform.drift_directions == "turned" else 0.0
    if (off := np.abs(turned - turn).max()) > 0.1:
        raise InputError(
            f"platform.drift: {platform.drift!r} is known for waves along {c.drift_heading[0]:g} deg only, and these "
            f"travel {off:.3g} deg from it; use drift: none, coefficients with more headings, or for a sea without "
            "spreading drift_directions: turned"
        )
    w, order = np.sort(waves.frequency), np.argsort(waves.frequency)
    a = amplitude[order]
    inside = (w >= c.drift_frequency[0] - 1e-9) & (w <= c.drift_frequency[-1] + 1e-9)
    w, a = w[inside], a[inside]
    apart = w[:, None] - w
    used = (apart > 1e-9) & (apart <= (0.0 if platform.drift == "mean" else platform.drift_cutoff))
    still = np.zeros(int(used.sum()))
    differences = Components(apart[used], still.astype(np.complex128), still, waves.period)
    F, pairs = np.zeros(6), np.zeros((6, len(still)), dtype=np.complex128)
    if not len(w):
        return F, differences, pairs
    i = np.clip(np.searchsorted(c.drift_frequency, w) - 1, 0, len(c.drift_frequency) - 2)
    s = (w - c.drift_frequency[i]) / (c.drift_frequency[i + 1] - c.drift_frequency[i])
    N = np.zeros((len(w), len(c.drift_frequency)))
    N[np.arange(len(w)), i], N[np.arange(len(w)), i + 1] = 1.0 - s, s
    for k in range(6):
        own = c.drift[..., k]
        if not np.abs(own).any():
            continue
        Q = N @ own @ N.T
        mean = Q.diagonal().real
        F[k] = (np.abs(a) ** 2 * mean).sum()
        if platform.drift == "newman":
            Q = 0.5 * (mean[:, None] + mean).astype(np.complex128)
        pairs[k] = 2.0 * (Q * np.outer(a, a.conj()))[used]
    R = np.kron(np.eye(2), Rotation.from_euler("z", turn, degrees=True).as_matrix())
    return R @ F, differences, R @ pairs
