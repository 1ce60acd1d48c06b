"""Coefficients of a rotor's power and thrust against tip-speed ratio and pitch, for kernels.

One kernel for all models: a formula whose constants are parameters, and a table between whose entries a bicubic
polynomial runs with continuous slopes. The slopes at the entries are those of Akima, modified: they look at the next
two entries to either side only, so that an edge in the table spoils its neighbourhood alone.

Reference: docs/theory/power-turbines.md (P-2 to P-4); Akima (1970), J. ACM 17(4), 589-602.
"""

from __future__ import annotations

from math import exp

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Array1, Array4, Constant, KernelRecord, Table, kernel, number
from meltemi.turbine.power_turbine import CalibratedCoefficient, Coefficient, HeierCoefficient, TableCoefficient

Float = NDArray[float64]


class RotorCoefficient(Table, title="coefficient"):
    """Parameters of a power coefficient."""

    formula: float = number("-", "1: the formula, 0: the table")
    scale: float = number("-", "factor of the coefficient of the formula")
    ratio_scale: float = number("-", "factor of the tip-speed ratio of the formula")
    c1: float = number("-", "constant c_1 of the formula")
    c2: float = number("-", "constant c_2 of the formula")
    c3: float = number("-", "constant c_3 of the formula")
    c4: float = number("-", "constant c_4 of the formula")
    c5: float = number("-", "constant c_5 of the formula")
    c6: float = number("-", "constant c_6 of the formula")
    least_ratio: float = number("-", "smallest tip-speed ratio of validity")
    most_ratio: float = number("-", "largest tip-speed ratio of validity")
    most_pitch: float = number("rad", "largest pitch angle of validity")
    floor: float = number("-", "smallest coefficient outside the table")


DEGREES = 57.29577951308232
"""Degrees in a radian."""
POWER, THRUST = 0, 1
"""First axis of a table's values."""
EVERYWHERE = 1e9
"""Bound of coefficients that are defined everywhere; infinities have no differences."""
CALIBRATED = (0.979372, 116.0, 0.0, 6.363840, 37.744134, 0.0375390)


class PowerCoefficients(KernelRecord):
    """Power and thrust coefficient of a rotor.

    Attributes:
      ratios, pitches: (n,) tip-speed ratios and (m,) pitch angles [rad] of the table.
      values: (2, 4, n, m) power and thrust; value, slope by ratio, slope by pitch, slope by both.
    """

    coefficient: RotorCoefficient
    ratios: Constant[Array1]
    pitches: Constant[Array1]
    values: Array4


@kernel
def formula(ratio: float, pitch: float, p: RotorCoefficient) -> float:
    """Power coefficient by the formula (P-2)."""
    r, b = p.ratio_scale * ratio, max(pitch * DEGREES, 0.0)
    x = 1.0 / (r + 0.08 * b) - 0.035 / (b * b * b + 1.0)
    return p.scale * (p.c1 * (p.c2 * x - p.c3 * b - p.c4) * exp(-p.c5 * x) + p.c6 * r)


@kernel
def below(x: float, grid: Float) -> int:
    """Index of the interval of an increasing grid in which x lies; the first or last one beyond its ends."""
    i, j = 0, grid.shape[0] - 1
    while j - i > 1:
        k = (i + j) // 2
        if grid[k] <= x:
            i = k
        else:
            j = k
    return i


@kernel
def looked_up(what: int, ratio: float, pitch: float, c: PowerCoefficients) -> float:
    """Power or thrust coefficient from the table (P-4)."""
    ratios, pitches, values = c.ratios, c.pitches, c.values
    n, m = ratios.shape[0], pitches.shape[0]
    x, y = min(max(ratio, ratios[0]), ratios[n - 1]), min(max(pitch, pitches[0]), pitches[m - 1])
    i, j = below(x, ratios), below(y, pitches)
    h, k = ratios[i + 1] - ratios[i], pitches[j + 1] - pitches[j]
    s, t = (x - ratios[i]) / h, (y - pitches[j]) / k
    f, fx, fy = 0.0, 0.0, 0.0
    for a in range(2):
        # Hermite's polynomials of the near and of the far entry, and their slopes
        u = s if a == 0 else 1.0 - s
        sign = 1.0 if a == 0 else -1.0
        p, dp = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u), -6.0 * u * (1.0 - u) * sign / h
        q, dq = sign * h * u * (1.0 - u) * (1.0 - u), (1.0 - u) * (1.0 - 3.0 * u)
        for b in range(2):
            w = t if b == 0 else 1.0 - t
            turn = 1.0 if b == 0 else -1.0
            g, dg = (1.0 + 2.0 * w) * (1.0 - w) * (1.0 - w), -6.0 * w * (1.0 - w) * turn / k
            r, dr = turn * k * w * (1.0 - w) * (1.0 - w), (1.0 - w) * (1.0 - 3.0 * w)
            v, vx = values[what, 0, i + a, j + b], values[what, 1, i + a, j + b]
            vy, vxy = values[what, 2, i + a, j + b], values[what, 3, i + a, j + b]
            f += p * (g * v + r * vy) + q * (g * vx + r * vxy)
            fx += dp * (g * v + r * vy) + dq * (g * vx + r * vxy)
            fy += p * (dg * v + dr * vy) + q * (dg * vx + dr * vxy)
    return f + fx * (ratio - x) + fy * (pitch - y)


@kernel
def power_coefficient(ratio: float, pitch: float, c: PowerCoefficients) -> float:
    """C_p at a tip-speed ratio above zero and a pitch angle [rad]."""
    if c.coefficient.formula > 0.0:
        return formula(ratio, pitch, c.coefficient)
    return max(looked_up(POWER, ratio, pitch, c), c.coefficient.floor)


@kernel
def thrust_coefficient(ratio: float, pitch: float, c: PowerCoefficients) -> float:
    """C_t at a tip-speed ratio and a pitch angle [rad]; 0 without thrust coefficients."""
    if c.coefficient.formula > 0.0:
        return 0.0
    return looked_up(THRUST, ratio, pitch, c)


@kernel
def known(ratio: float, pitch: float, p: RotorCoefficient) -> bool:
    """Whether the coefficient is defined there."""
    return p.least_ratio <= ratio <= p.most_ratio and pitch <= p.most_pitch


def coefficient_arrays(coefficient: Coefficient) -> dict[str, Float]:
    """Arrays of a power coefficient by the names in :class:`PowerCoefficients`."""
    p = RotorCoefficient.of(formula=1.0, scale=1.0, ratio_scale=1.0, most_ratio=EVERYWHERE, most_pitch=EVERYWHERE)
    ratios, pitches, values = np.arange(2.0), np.arange(2.0), np.zeros((2, 4, 2, 2))
    constants: tuple[float, ...] = CALIBRATED
    if isinstance(coefficient, TableCoefficient):
        p.formula, p.floor = 0.0, coefficient.power.min()
        constants = (0.0,) * len(CALIBRATED)
        ratios, pitches = np.concatenate([[0.0], coefficient.tip_speed_ratio]), np.array(coefficient.pitch)
        thrust = np.zeros_like(coefficient.power) if coefficient.thrust is None else coefficient.thrust
        at_rest = (np.zeros_like(coefficient.power[0]), thrust[0])
        values = np.stack(
            [
                _with_slopes(ratios, pitches, np.vstack([first, rows]))
                for first, rows in zip(at_rest, (coefficient.power, thrust), strict=True)
            ]
        )
    elif isinstance(coefficient, HeierCoefficient):
        constants = coefficient.constants
        ratio, most = coefficient.peak
        p.scale, p.ratio_scale = coefficient.maximum / most, ratio / coefficient.tip_speed_ratio
    else:
        assert isinstance(coefficient, CalibratedCoefficient)
        p.least_ratio, p.most_ratio, p.most_pitch = 7.0, 11.5, 1e-6
    p.c1, p.c2, p.c3, p.c4, p.c5, p.c6 = constants
    return {"coefficient": p.array, "ratios": ratios, "pitches": pitches, "values": values}


def rotor_coefficients(coefficient: Coefficient) -> PowerCoefficients:
    """The record of a power coefficient, for calls from Python."""
    return PowerCoefficients("floats", coefficient_arrays(coefficient))


def _with_slopes(x: Float, y: Float, f: Float) -> Float:
    """(4, n, m) values of a table and their slopes by x, by y, by both."""
    fx, fy = akima_slopes(x, f), akima_slopes(y, f.T).T
    return np.stack([f, fx, fy, 0.5 * (akima_slopes(y, fx.T).T + akima_slopes(x, fy))])


def akima_slopes(x: Float, f: Float) -> Float:
    """(n, m) slopes along the first axis of a table f at increasing x (n,), by Akima's modified formula."""
    steps = np.diff(f, axis=0) / np.diff(x)[:, None]
    before, after = 2.0 * steps[0] - steps[1], 2.0 * steps[-1] - steps[-2]
    d = np.vstack([2.0 * before - steps[0], before, steps, after, 2.0 * after - steps[-1]])
    change, mean = np.abs(np.diff(d, axis=0)), np.abs(0.5 * (d[1:] + d[:-1]))
    weight = change + mean
    left, right = weight[2:], weight[:-2]
    total = left + right
    flat = total <= 1e-12 * max(float(np.max(np.abs(d))), 1e-300)
    slope = (left * d[1:-2] + right * d[2:-1]) / np.where(flat, 1.0, total)
    return np.where(flat, 0.0, slope)
