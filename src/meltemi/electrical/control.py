"""What the converters ask of their currents, and what trips the turbine.

The machine's side follows the torque, with no current along the flux unless the voltage of the DC link asks for it; the
grid's side holds the energy of the DC link and gives the reactive power.

Reference: docs/theory/electrical.md (E-13 to E-24).
"""

from __future__ import annotations

from math import sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.electrical.circuit import Phasor
from meltemi.electrical.tables import ElectricalParameters

Float = NDArray[float64]

POLE_PAIRS, FLUX, STATOR_R, STATOR_L, MACHINE_LIMIT, GRID_LIMIT, RESERVE, SUBSTEP = ElectricalParameters.slots(
    "pole_pairs flux stator_resistance stator_inductance machine_limit grid_limit reserve substep"
)
GRID_PEAK, GRID_CURRENT, GAIN, BAND, ZERO_TIME, RECOVERY_TIME = ElectricalParameters.slots(
    "grid_peak grid_current support_gain dead_band zero_time recovery_time"
)
DC_HIGHEST, DC_LOWEST, HEAT_LIMIT, HIGHEST_VOLTAGE, LOWEST_FREQUENCY, HIGHEST_FREQUENCY = ElectricalParameters.slots(
    "dc_highest dc_lowest chopper_heat highest_voltage lowest_frequency highest_frequency"
)
LEAST_CURRENT = 1e-9
"""[A] short-circuit current of a machine at rest, to be divided by."""
LEAST_VOLTAGE = 0.05
"""Share of the grid's nominal voltage below which there is nothing to lock on, and by which powers are divided."""


@kernel
def most_torque(d0: float, q0: float, short: float, a: float, b: float, radius: float, limit: float) -> float:
    """[A] q-current of the largest torque in the sense that ``b``, ``radius`` and ``limit`` have as sign (E-15)."""
    d = (a * d0 - b * q0) / short
    if d <= 0.0:
        return limit + 0.0 * d
    return q0 + radius if d >= d0 else (a * q0 + b * d0) / short


@kernel
def stator_reference(p: Float, torque: float, w: float, most: float) -> Phasor:
    """[A] Currents for a torque within the limits of voltage and current (E-13 to E-15).

    Args:
      torque: [N m] electromagnetic.
      w: [rad/s] of the stator.
      most: [V] amplitude that the converter can make.
    """
    R, X = p[STATOR_R], w * p[STATOR_L]
    square = R * R + X * X
    # voltages within the limit are currents within a circle about the short-circuit current
    d0, q0 = w * p[FLUX] * X / square, w * p[FLUX] * R / square
    radius, limit = p[RESERVE] * most / sqrt(square), p[MACHINE_LIMIT]
    # which meets the circle of the largest current at a +- j b, seen along the short-circuit current
    short = max(sqrt(d0 * d0 + q0 * q0), LEAST_CURRENT)
    a = min(max(0.5 * (limit * limit - radius * radius + short * short) / short, -limit), limit)
    b = sqrt(max(limit * limit - a * a, 0.0))
    high = most_torque(d0, q0, short, a, b, radius, limit)
    low = most_torque(d0, q0, short, a, -b, -radius, -limit)
    q = min(max(torque / (1.5 * p[POLE_PAIRS] * p[FLUX]), low), high)
    d = max(d0 - sqrt(max(radius * radius - (q - q0) * (q - q0), 0.0)), 0.0)
    return Phasor(min(d, sqrt(max(limit * limit - q * q, 0.0))), q)


@kernel
def grid_reference(p: Float, active: float, reactive: float, share: float) -> Phasor:
    """[A] Currents for an active current and a reactive power within the limit of current (E-18 to E-20).

    Args:
      active: [A] wanted in phase with the voltage.
      reactive: [var] demanded.
      share: of the nominal voltage.
    """
    limit, away = p[GRID_LIMIT], 1.0 - share
    if abs(away) > p[BAND]:
        # support comes on top of what was there before
        before = -reactive / (1.5 * p[GRID_PEAK])
        most = min(p[GRID_CURRENT], limit)
        q = min(max(before - p[GAIN] * away * p[GRID_CURRENT], -most), most)
        rest = sqrt(max(limit * limit - q * q, 0.0))
        return Phasor(min(max(active, -rest), rest), q)
    d = min(max(active, -limit), limit)
    rest = sqrt(max(limit * limit - d * d, 0.0))
    q = -reactive / (1.5 * max(share, LEAST_VOLTAGE) * p[GRID_PEAK])
    return Phasor(d, min(max(q, -rest), rest))


@kernel
def protection(p: Float, dc: float, share: float, frequency: float, low_time: float, heat: float) -> float:
    """Number of the protection that trips, see TRIPS; 0 for none (E-23, E-24).

    Args:
      dc: [V] of the DC link.
      share: of the grid's nominal voltage.
      frequency: [Hz] of the grid.
      low_time: [s] since when the voltage is low.
      heat: [J] in the chopper.
    """
    if dc > p[DC_HIGHEST]:
        return 1.0
    if dc < p[DC_LOWEST]:
        return 2.0
    # half a sub-step of grace: what lasts as long as is allowed is ridden through, however sub-steps add up
    recovery = (low_time - 0.5 * p[SUBSTEP] - p[ZERO_TIME]) / (p[RECOVERY_TIME] - p[ZERO_TIME])
    if share < (1.0 - p[BAND]) * min(max(recovery, 0.0), 1.0):
        return 3.0
    if share > p[HIGHEST_VOLTAGE]:
        return 4.0
    if share > LEAST_VOLTAGE and (frequency < p[LOWEST_FREQUENCY] or frequency > p[HIGHEST_FREQUENCY]):
        return 5.0
    if heat > p[HEAT_LIMIT]:
        return 6.0
    return 0.0
