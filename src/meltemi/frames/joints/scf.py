"""Stress concentration factors of tubular joints by Efthymiou's equations (F-53 to F-57).

Source: Efthymiou (1988), Development of SCF formulae and generalised influence functions, OTH 88, as in appendix B of
DNV-RP-C203. What was checked against which public code is in docs/theory/frames.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, exp, nan, radians, sin, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.frames.joints.geometry import Joint

Float = NDArray[np.float64]
ChordBending = Literal["frame", "formula"]

LEAST = 1.5
"""Smallest factor of a weld that is used."""
SHORT = 12.0
"""alpha below which the chord is short, so that its ends relieve the saddles."""
LIMITS: Mapping[str, tuple[float, float]] = {
    "beta": (0.2, 1.0),
    "tau": (0.2, 1.0),
    "gamma": (8.0, 32.0),
    "alpha": (4.0, 40.0),
    "theta": (radians(20.0), radians(90.0)),
}
"""Ranges of validity; zeta from -0.6 beta / sin(theta) to 1."""


class Parameters(NamedTuple):
    """Parameters of a brace.

    Attributes:
      beta, gamma, tau, alpha: d/D, D/2T, t/T, 2L/D.
      theta: [rad] angle between brace and chord.
      opposed: whether a brace lies on the opposite side of the chord.
      zeta: largest gap over D to a brace on its side; NaN without one.
      near: beta, tau, theta and gap over D of the nearest of these braces.
      sines, betas: largest over smallest sine of theta, and beta, of these braces and itself.
      both: [rad] sum of the largest and smallest theta of these.
    """

    beta: float
    gamma: float
    tau: float
    alpha: float
    theta: float
    opposed: bool = False
    zeta: float = nan
    near: tuple[float, float, float, float] = (nan, nan, nan, nan)
    sines: float = 1.0
    betas: float = 1.0
    both: float = 0.0


class Factors(NamedTuple):
    """Factors of a brace.

    Attributes:
      axial: (3, 2, 2) by class K, X, T/Y, side chord, brace, and crown, saddle.
      bending: (2, 3) by side, and in plane, out of plane, out of plane where the brace opposite to it balances it.
    """

    axial: Float
    bending: Float


def parameters_of(joint: Joint, alpha: float | None = None) -> list[Parameters]:
    """Parameters of each brace of a joint; ``alpha`` replaces that of the chord's length."""
    D, T = joint.diameter, joint.thickness
    sizes = [(b.tube.diameter / D, b.tube.thickness / T, b.angle) for b in joint.braces]
    chord = 2.0 * joint.length / D if alpha is None else alpha
    given = []
    beside, opposite = joint.beside()
    for i, (beta, tau, theta) in enumerate(sizes):
        p = Parameters(beta, D / (2.0 * T), tau, chord, theta, bool(opposite[i].any()))
        if others := [int(j) for j in np.flatnonzero(beside[i]) if j != i]:
            gaps = {j: joint.gap(i, j) / D for j in others}
            nearest = min(gaps, key=lambda j: gaps[j])
            betas, _, thetas = zip(*(sizes[j] for j in (i, *others)), strict=True)
            sines = max(map(sin, thetas)) / min(map(sin, thetas))
            both = max(thetas) + min(thetas)
            near = (*sizes[nearest], gaps[nearest])
            p = p._replace(zeta=max(gaps.values()), near=near, sines=sines, betas=max(betas) / min(betas), both=both)
        given.append(p)
    return given


def outside(p: Parameters) -> list[str]:
    """Names of the parameters outside their range of validity."""
    names = [name for name, (low, high) in LIMITS.items() if not low - 1e-9 <= getattr(p, name) <= high + 1e-9]
    return names + ["zeta"] * (not np.isnan(p.zeta) and not -0.6 * p.beta / sin(p.theta) <= p.zeta <= 1.0)


def at_limits(p: Parameters) -> Parameters:
    """Parameters with those outside their range of validity at its limits."""
    beta, tau, gamma, alpha, theta = (float(np.clip(getattr(p, name), *ends)) for name, ends in LIMITS.items())
    q = p._replace(beta=beta, tau=tau, gamma=gamma, alpha=alpha, theta=theta)
    return q._replace(zeta=float(np.clip(p.zeta, -0.6 * q.beta / sin(q.theta), 1.0)))


def factors(p: Parameters, fixity: float = 0.7, bending: ChordBending = "frame") -> Factors:
    """Factors of a brace: outside the ranges of validity the larger of those there and at the limits (F-57).

    Args:
      fixity: C of the chord's ends, 0.5 (clamped) to 1 (pinned).
      bending: whether bending of the chord comes from the ``frame`` (F-55), or from alpha in the ``formula`` (F-54).
    """
    here, limited = (efthymiou(each, fixity, bending) for each in (p, at_limits(p)))
    return Factors(*(np.maximum(np.maximum(a, b), LEAST) for a, b in zip(here, limited, strict=True)))


def efthymiou(p: Parameters, C: float, bending: ChordBending) -> Factors:
    """The equations without limits; T1 ... are their names in OTH 88."""
    b, g, t, a, th = p.beta, p.gamma, p.tau, p.alpha, p.theta
    s, crown = sin(th), a if bending == "formula" else 0.0
    plate, tube = g**0.2 * t * (2.65 + 5.0 * (b - 0.65) ** 2), 0.12 * exp(-4.0 * b) + 0.011 * b**2 - 0.045
    free = sqrt(max(1.0 - b**2, 0.0))
    t5 = g * t**1.1 * (1.11 - 3.0 * (b - 0.52) ** 2) * s**1.6
    t5 += 2.0 * (C - 0.5) * (0.8 * a - 6.0) * t * b**2 * free * sin(2.0 * th) ** 2
    t6 = plate + t * b * (0.5 * C * crown - 3.0) * s
    t3 = 1.3 + g * t**0.52 * a**0.1 * (0.187 - 1.25 * b**1.1 * (b - 0.96)) * s ** (2.7 - 0.01 * a)
    t7 = 3.0 + g**1.2 * tube + b * t * (0.2 * C * crown - 1.2)
    x1 = 3.87 * g * t * b * (1.10 - b**1.8) * s**1.7
    x2 = plate - 3.0 * t * b * s
    x3 = 1.0 + 1.9 * g * sqrt(t) * b**0.9 * (1.09 - b**1.7) * s**2.5
    x4 = 3.0 + g**1.2 * tube
    f, f3, f4 = _short(p, C)
    one = f * (1.0 - 0.26 * b**3 if p.opposed else 1.0)  # X7, X8: load in one brace of an X joint
    y, x, k = [[t6, one * t5], [t7, one * t3]], [[x2, f * x1], [x4, f * x3]], [[0.0, 0.0], [0.0, 0.0]]
    chord = f3 * _t10(g, b, t, th)
    inside = 1.0 + 0.65 * b * t**0.4 * g ** (1.09 - 0.77 * b) * s ** (0.06 * g - 1.16)
    if not np.isnan(p.zeta):
        k1 = t**0.9 * sqrt(g) * (0.67 - b**2 + 1.16 * b) * s * p.sines**0.30 * p.betas**0.30
        k1 *= 1.64 + 0.29 * b**-0.38 * atan(8.0 * p.zeta)
        k2 = 1.0 + k1 * (1.97 - 1.57 * b**0.25) * t**-0.14 * s**0.7
        if p.near[3] < 0.0:  # overlapping: C = 1, the larger of the two braces' values
            k2 += (
                b**1.5 * sqrt(g) * t**-1.22 * abs(sin(p.both)) ** 1.8 * (0.131 - 0.084 * atan(14.0 * p.zeta + 4.2 * b))
            )
            inside *= max(0.9 + 0.4 * b, 1.0)
        k = [[k1, k1], [k2, k2]]
        chord = max(chord, f4 * _k4(p))
    in_plane = 1.45 * b * t**0.85 * g ** (1.0 - 0.68 * b) * s**0.7
    balanced = f3 * g * t * b * (1.56 - 1.34 * b**4) * s**1.6
    brace = t**-0.54 * g**-0.05 * (0.99 - 0.47 * b + 0.08 * b**4)
    bent = [[in_plane, chord, balanced], [inside, brace * chord, brace * balanced]]
    return Factors(np.array([k, x, y]), np.array(bent))


def _t10(g: float, b: float, t: float, th: float) -> float:
    """Chord under out-of-plane bending of one brace (T10)."""
    return g * t * b * (1.7 - 1.05 * b**3) * sin(th) ** 1.6


def _k4(p: Parameters) -> float:
    """Chord under out-of-plane bending of a brace and its nearest neighbour (K4)."""
    b, t, th, gap = p.near
    x = 1.0 + gap * sin(p.theta) / p.beta
    alone = _t10(p.gamma, p.beta, p.tau, p.theta) * (1.0 - 0.08 * sqrt(b * p.gamma) * exp(-0.8 * x))
    other = _t10(p.gamma, b, t, th) * (1.0 - 0.08 * sqrt(p.beta * p.gamma) * exp(-0.8 * x))
    return alone + other * 2.05 * sqrt(max(p.beta, b)) * exp(-1.3 * x)


def _short(p: Parameters, C: float) -> tuple[float, float, float]:
    """Factors of short chords (F-56): F1 (clamped ends) or F2 for axial loads, F3 and F4 for out-of-plane bending."""
    b, g, a = p.beta, p.gamma, p.alpha
    if a >= SHORT:
        return 1.0, 1.0, 1.0
    f1 = 1.0 - (0.83 * b - 0.56 * b**2 - 0.02) * g**0.23 * exp(-0.21 * g**-1.16 * a**2.5)
    f2 = 1.0 - (1.43 * b - 0.97 * b**2 - 0.03) * g**0.04 * exp(-0.71 * g**-1.38 * a**2.5)
    f3 = 1.0 - 0.55 * b**1.8 * g**0.16 * exp(-0.49 * g**-0.89 * a**1.8)
    f4 = 1.0 - 1.07 * b**1.88 * exp(-0.16 * g**-1.06 * a**2.4)
    return f1 if C == 0.5 else f2, f3, f4
