"""Look-up tables of the rotor for the power control, from its steady performance.

With the density rho, R and the gear ratio N, and K of (C-80):

    C_p(lambda, beta)      power coefficient
    g(beta)                K / rho that is best at a held pitch (A3)
    s(beta, r)             -dP/dbeta over K omega^3, where the power is P = r^3 K omega^3 (C-86)

All tables have uniform grids and are interpolated linearly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.compiler import kernel, whole
from meltemi.control_laws.lookup import bilinear, linear
from meltemi.core.errors import InputError
from meltemi.power_control.state import PowerControlState

Float = NDArray[float64]

RATIO_STEP, PITCH_STEP, SHARE_STEP = 0.25, math.radians(1.0), 0.05
SHARES = 0.3, 1.6
"""Range of the speed at which the power is optimal over the present speed; 1.6 is for pitch held far out (A3)."""
SECANT = math.radians(2.0)
"""Half the pitch interval of the difference quotient for the sensitivity: at fine pitch the tangent may be flat."""
LEAST_SENSITIVITY, LEAST_PITCH = 0.5, math.radians(6.0)
"""Lower limit of the sensitivity, as a share of that at this pitch beyond the smallest."""


@kernel
def power_coefficient(x: PowerControlState, ratio: float, pitch: float) -> float:
    """Power coefficient by tip-speed ratio and pitch [rad]; below the table with the torque coefficient of its edge."""
    row = (ratio - x.ratio_first) / x.ratio_step
    column = (pitch - x.pitch_first) / x.pitch_step
    value = bilinear(x.power_coefficient, whole(x.ratios), whole(x.pitches), row, column)
    return value * (ratio / x.ratio_first) if ratio < x.ratio_first else value


@kernel
def sensitivity(x: PowerControlState, pitch: float, share: float) -> float:
    """Pitch sensitivity -dP/dpitch over K omega^3 [1/rad] at a pitch [rad] and a speed ratio r (C-86)."""
    row = (pitch - x.pitch_first) / x.pitch_step
    column = (share - x.share_first) / x.share_step
    return bilinear(x.sensitivity, whole(x.pitches), whole(x.shares), row, column)


@kernel
def gain_at_pitch(x: PowerControlState, pitch: float) -> float:
    """Optimal gain over density, on the generator's side, at a held pitch [rad] (C-84)."""
    return linear(x.optimal_gain, whole(x.pitches), (pitch - x.pitch_first) / x.pitch_step)


@dataclass(frozen=True)
class RotorTables:
    """Look-up tables of a rotor.

    Attributes:
      tip_speed_ratio: (n,) uniform.
      pitch: (m,) [rad] uniform.
      power: (n, m) C_p.
      share: (k,) uniform.
      sensitivity: (m, k) [1/rad] sensitivity of (C-86).
      best_ratio, best_power: (m,) where C_p is largest at each pitch, and that C_p.
      best: both at the smallest pitch.
    """

    tip_speed_ratio: Float
    pitch: Float
    power: Float
    share: Float
    sensitivity: Float
    best_ratio: Float
    best_power: Float
    best: tuple[float, float]
    ratio_step: float = RATIO_STEP
    pitch_step: float = PITCH_STEP


def rotor_tables(performance: RotorPerformance, fine: float) -> RotorTables:
    """Look-up tables of a rotor for its power control.

    Args:
      performance: tables with the largest power coefficient in their interior.
      fine: [rad] the smallest pitch of the turbine.

    Raises:
      InputError: the largest power coefficient lies at the edge of the table or is not above zero.
    """
    from scipy.interpolate import RectBivariateSpline, make_interp_spline

    ratios, pitches, power = performance.tip_speed_ratio, performance.pitch, performance.power
    ratio = ratios[0] + RATIO_STEP * np.arange(int((ratios[-1] - ratios[0]) / RATIO_STEP + 1e-9) + 1)
    if len(pitches) > 1:
        count = int((pitches[-1] - pitches[0]) / PITCH_STEP + 1e-9) + 1
        pitch = pitches[0] + PITCH_STEP * np.arange(count)
        degrees = min(3, len(ratios) - 1), min(3, len(pitches) - 1)
        surface = RectBivariateSpline(ratios, pitches, power, kx=degrees[0], ky=degrees[1])
    else:
        pitch = np.array(pitches, float)
        line = make_interp_spline(ratios, power[:, 0], k=min(3, len(ratios) - 1))

    def coefficient(at_ratio: Float, at_pitch: Float) -> Float:
        if len(pitches) > 1:
            return np.asarray(surface.ev(at_ratio, at_pitch))
        return np.asarray(line(np.broadcast_arrays(at_ratio, at_pitch)[0]))

    def best(at_pitch: float) -> tuple[float, float]:
        fine_ratio = np.linspace(ratios[0], ratios[-1], 4001)
        values = coefficient(fine_ratio, np.full(4001, at_pitch))
        i = min(max(int(np.argmax(values)), 1), 3999)
        left, middle, right = values[i - 1 : i + 2]
        bend = left - 2.0 * middle + right  # parabola through three points
        step = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
        at_ratio = float(fine_ratio[i] + min(max(step, -1.0), 1.0) * (fine_ratio[1] - fine_ratio[0]))
        return at_ratio, float(coefficient(np.array(at_ratio), np.array(at_pitch)))

    best_ratio, best_power = np.array([best(angle) for angle in pitch]).T
    top_ratio, top_power = best(fine)
    if not ratios[0] < top_ratio < ratios[-1] or top_power <= 0.0:
        raise InputError(
            f"PowerController: the largest power coefficient at the smallest pitch, {top_power:.3g}, lies at a "
            f"tip-speed ratio of {top_ratio:.3g}, which is not inside the {ratios[0]:g} to {ratios[-1]:g} of the "
            "performance: give more tip-speed ratios"
        )
    share = np.arange(SHARES[0], SHARES[1] + 1e-9, SHARE_STEP)
    table = coefficient(*np.meshgrid(ratio, pitch, indexing="ij"))
    slope = np.zeros((len(pitch), len(share)))
    for j, angle in enumerate(pitch):
        steady = np.minimum.accumulate(table[:, j] / ratio**3)  # falls with the ratio
        wanted = top_power / top_ratio**3 * share**3
        at_ratio = np.interp(-wanted, -steady, ratio)
        low, high = max(angle - SECANT, pitch[0]), min(angle + SECANT, pitch[-1])
        if high > low:
            lost = coefficient(at_ratio, np.full(len(share), low)) - coefficient(at_ratio, np.full(len(share), high))
            slope[j] = lost / (high - low) / at_ratio**3 * top_ratio**3 / top_power
    wide = slope[np.searchsorted(pitch, min(fine + LEAST_PITCH, pitch[-1]) - 1e-9)]
    slope = np.maximum(slope, LEAST_SENSITIVITY * np.maximum(wide, 0.1 * slope.max(axis=0)))
    return RotorTables(ratio, pitch, table, share, slope, best_ratio, best_power, (top_ratio, top_power))
