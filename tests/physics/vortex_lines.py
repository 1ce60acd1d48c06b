"""Chains of straight vortex filaments as the kernels of vortex wakes read them, and closed forms of smooth vortices."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ellipe, ellipk, elliprf, elliprj, ive, kve

from meltemi.vortex.filaments import NONE, ROUNDING, ROWS, TINY, induced

Float = NDArray[np.float64]


def filaments(begin: ArrayLike, end: ArrayLike, circulation: ArrayLike = 1.0) -> Float:
    """(9, S) filaments without cores, from (S, 3) points [m] to others; what ``filaments.store`` writes one by one."""
    a, b = np.atleast_2d(np.asarray(begin, float)), np.atleast_2d(np.asarray(end, float))
    sources = np.full((ROWS, len(a)), TINY)
    sources[:3], sources[3:6] = a.T, (b - a).T
    sources[6] = np.asarray(circulation) / (4.0 * pi)
    sources[8] += ROUNDING * ((b - a) ** 2).sum(axis=1) ** 2
    return sources


def chain(points: Float, circulation: ArrayLike = 1.0) -> Float:
    """Filaments from each of (S + 1, 3) points [m] to the next."""
    return filaments(points[:-1], points[1:], circulation)


def velocity(at: ArrayLike, *sources: Float, core: int = NONE) -> Float:
    """(..., 3) velocities [m/s] that all filaments induce at (..., 3) points [m]."""
    x, every = np.asarray(at, float), np.concatenate(sources, axis=1)
    each = [induced(p, every, 0, every.shape[1], core) for p in x.reshape(-1, 3)]
    return np.array(each).reshape(x.shape)


def polygon(sides: int, radius: float = 1.0, z: float = 0.0) -> Float:
    """(sides + 1, 3) corners on a circle about the z axis, counter-clockwise."""
    angle = np.linspace(0.0, 2.0 * pi, sides + 1)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full_like(angle, z)], axis=1)


def helix(radius: float, pitch: float, turns: Sequence[float], sides: int, azimuth: float = 0.0) -> Float:
    """(n, 3) points of a right-handed helix about the z axis from one number of turns to another, ``sides`` a turn.

    They are as far from the axis as makes the area of a turn that of the circle (docs/theory/vortices.md, VW-15).
    """
    count = round((turns[1] - turns[0]) * sides)
    angle, step = 2.0 * pi * np.linspace(*turns, count + 1), 2.0 * pi / sides
    r = radius * np.sqrt(step / np.sin(step))
    return np.stack([r * np.cos(angle + azimuth), r * np.sin(angle + azimuth), pitch * angle / (2.0 * pi)], axis=1)


def richardson(coarse: ArrayLike, fine: ArrayLike) -> Float:
    """Limit of results of second order whose steps are as two to one."""
    return (4.0 * np.asarray(fine) - np.asarray(coarse)) / 3.0


def ring(r: float, z: float) -> tuple[float, float]:
    """Radial and axial velocity of a ring of unit radius and circulation (Lamb, sec. 161)."""
    a, b2 = np.hypot(1.0 + r, z), (1.0 - r) ** 2 + z * z
    K, E = ellipk(4.0 * r / a**2), ellipe(4.0 * r / a**2)
    axial = (K + (1.0 - r * r - z * z) / b2 * E) / (2.0 * pi * a)
    return z / (2.0 * pi * r * a) * (-K + (1.0 + r * r + z * z) / b2 * E), axial


def cylinder(r: float, z: float) -> tuple[float, float]:
    """Radial and axial velocity of rings of unit circulation per length from z = 0 on (Branlard & Gaunaa 2015)."""
    m, n = 4.0 * r / ((1.0 + r) ** 2 + z * z), 4.0 * r / (1.0 + r) ** 2
    k, K = np.sqrt(m), ellipk(m)
    third = elliprf(0.0, 1.0 - m, 1.0) + n / 3.0 * elliprj(0.0, 1.0 - m, 1.0, 1.0 - n)
    radial = -((2.0 - m) / k * K - 2.0 / k * ellipe(m)) / (2.0 * pi * np.sqrt(r))
    axial = 0.5 * ((1.0 if r < 1.0 else 0.0) + z * k / (2.0 * pi * np.sqrt(r)) * (K + (1.0 - r) / (1.0 + r) * third))
    return radial, axial


def helices(blades: int, pitch: float, r: float) -> float:
    """Axial velocity of endless helices of unit radius and circulation, on the ray to one of them (Hardin 1982)."""
    advance = pitch / (2.0 * pi)
    m = np.arange(1, 400) * float(blades)
    x, y = m * min(r, 1.0) / advance, m * max(r, 1.0) / advance
    inner = r < 1.0
    f, g, z = (ive, kve, y) if inner else (kve, ive, x)  # one function at r, the slope of the other at the helix
    sign = -1.0 if inner else 1.0
    slope = sign * 0.5 * (g(m - 1.0, z) + g(m + 1.0, z))
    waves = float((m * f(m, x if inner else y) * slope * np.exp(x - y)).sum())
    return blades * ((1.0 / pitch if inner else 0.0) - waves / (pi * advance**2))


def goldstein(x: Float, advance: float, blades: int = 3, panels: int = 60) -> Float:
    """G = blades x circulation / (pitch x w) of the rotor whose far wake moves like a rigid screw with the speed w.

    Normal velocities of endless helices, by Wrench's approximation of Kawada's series (Okulov 2004), on helicoids of
    constant circulation in cosine spacing.

    Args:
      x: radii over that of the rotor.
      advance: pitch of the wake over its circumference.
    """
    ends = 0.5 * (1.0 - np.cos(np.linspace(0.0, pi, panels + 1)))
    ends[0] = 1e-4
    angle = np.linspace(0.0, pi, panels + 1)
    points = 0.5 * (1.0 - np.cos(0.5 * (angle[:-1] + angle[1:])))
    r, r0 = np.meshgrid(points, ends, indexing="ij")
    s, s0, pitch = np.hypot(advance, r), np.hypot(advance, r0), 2.0 * pi * advance
    log = np.log(r / r0 * (advance + s0) / (advance + s)) + (s - s0) / advance
    c1 = advance / 24.0 * ((3.0 * r**2 - 2.0 * advance**2) / s**3 + (2.0 * advance**2 + 9.0 * r0**2) / s0**3)
    decay = np.exp(-blades * np.abs(log))
    near = (
        np.sqrt(s0 / s) / pitch * (np.where(r < r0, 1.0, -1.0) * decay / (1.0 - decay) - c1 / blades * np.log1p(-decay))
    )
    axial = near + np.where(r < r0, 1.0 / pitch, 0.0)
    normal = blades * (axial * r - advance**2 / r * (1.0 / pitch - axial)) / s  # of unit circulation that leaves at r0
    G = np.linalg.solve(normal[:, 1:] - normal[:, :-1], points / np.hypot(points, advance))
    return np.asarray(np.interp(x, np.r_[0.0, points, 1.0], np.r_[G[0], G, 0.0]) * blades / pitch)
