"""Current references of both converters, and protection.

The machine side follows the torque demand, with d-current only where the DC link's voltage requires field weakening;
the grid side controls the energy of the DC link and delivers the reactive power.

Reference: docs/theory/electrical.md (E-13 to E-24).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from meltemi.compiler import kernel
from meltemi.electrical.tables import ElectricalParameters
from meltemi.maths.phasors import Phasor

SQRT_2 = sqrt(2.0)
LEAST_CURRENT = 1e-9
"""[A] lower limit of the short-circuit current as a divisor: a machine at rest has none."""
LEAST_VOLTAGE = 0.05
"""Grid voltage [per unit] below which the phase-locked loop stops; lower limit of the divisor of powers."""


@kernel
def most_torque(d0: float, q0: float, short: float, a: float, b: float, radius: float, limit: float) -> float:
    """[A] q-current of the largest torque, of the sign of ``b``, ``radius`` and ``limit`` (E-15)."""
    d = (a * d0 - b * q0) / short
    if d <= 0.0:
        return limit
    return q0 + radius if d >= d0 else (a * q0 + b * d0) / short


@kernel
def stator_reference(torque: float, w: float, most: float, p: ElectricalParameters) -> Phasor:
    """[A] Current reference for a torque within the limits of voltage and current (E-13 to E-15).

    Args:
      torque: [N m] electromagnetic.
      w: [rad/s] angular frequency of the stator.
      most: [V] largest amplitude of the converter's voltage.
    """
    R, X = p.stator_resistance, w * p.stator_inductance
    square = R * R + X * X
    # voltages within the limit are currents within a circle about the short-circuit current
    d0, q0 = w * p.flux * X / square, w * p.flux * R / square
    radius, limit = p.reserve * most / sqrt(square), p.machine_limit
    # which meets the circle of the largest current at a +- j b, seen along the short-circuit current
    short = max(sqrt(d0 * d0 + q0 * q0), LEAST_CURRENT)
    a = min(max(0.5 * (limit * limit - radius * radius + short * short) / short, -limit), limit)
    b = sqrt(max(limit * limit - a * a, 0.0))
    high = most_torque(d0, q0, short, a, b, radius, limit)
    low = most_torque(d0, q0, short, a, -b, -radius, -limit)
    q = min(max(torque / (1.5 * p.pole_pairs * p.flux), low), high)
    d = max(d0 - sqrt(max(radius * radius - (q - q0) * (q - q0), 0.0)), 0.0)
    return Phasor(min(d, sqrt(max(limit * limit - q * q, 0.0))), q)


@kernel
def grid_reference(active: float, reactive: float, voltage: float, p: ElectricalParameters) -> Phasor:
    """[A] Current reference for an active current and a reactive power within the current limit (E-18 to E-20).

    Args:
      active: [A] demanded in phase with the voltage.
      reactive: [var] demanded.
      voltage: [per unit] voltage of the grid.
    """
    limit, away = p.grid_limit, 1.0 - voltage
    if abs(away) > p.dead_band:
        # support comes on top of the reactive current before the fault
        before = -reactive / (1.5 * p.grid_peak)
        most = min(p.grid_current, limit)
        q = min(max(before - p.support_gain * away * p.grid_current, -most), most)
        rest = sqrt(max(limit * limit - q * q, 0.0))
        return Phasor(min(max(active, -rest), rest), q)
    d = min(max(active, -limit), limit)
    rest = sqrt(max(limit * limit - d * d, 0.0))
    q = -reactive / (1.5 * max(voltage, LEAST_VOLTAGE) * p.grid_peak)
    return Phasor(d, min(max(q, -rest), rest))


class GridControl(NamedTuple):
    """Current reference [A] of the grid side, and the rate [W/s] of the energy control's integral part."""

    current: Phasor
    rate: float


@kernel
def energy_control(
    incoming: float, energy: float, hold: float, reactive: float, voltage: float, p: ElectricalParameters
) -> GridControl:
    """Control of the DC link's energy by the grid side (E-17 to E-20).

    Args:
      incoming: [W] power from the machine side.
      energy: [J] energy in the DC link.
      hold: [W] integral part.
      reactive: [var] demanded.
      voltage: [per unit] voltage of the grid.
    """
    w = p.voltage_rate
    error = energy - 0.5 * p.capacitance * p.dc_voltage * p.dc_voltage
    power = incoming + SQRT_2 * w * error + hold
    active = power / (1.5 * max(voltage, LEAST_VOLTAGE) * p.grid_peak)
    current = grid_reference(active, reactive, voltage, p)
    # at the limit the integral part is held: anti-windup
    held = (active > current.d and error > 0.0) or (active < current.d and error < 0.0)
    return GridControl(current, 0.0 if held else w * w * error)


@kernel
def protection(
    dc: float, voltage: float, frequency: float, low_time: float, heat: float, p: ElectricalParameters
) -> float:
    """Number of the protection that trips, see TRIPS; 0 for none (E-23, E-24).

    Args:
      dc: [V] voltage of the DC link.
      voltage: [per unit] voltage of the grid.
      frequency: [Hz] frequency of the grid.
      low_time: [s] since the voltage left its band.
      heat: [J] heat in the chopper.
    """
    if dc > p.dc_highest:
        return 1.0
    if dc < p.dc_lowest:
        return 2.0
    # half a sub-step of grace: rounding of the sum of sub-steps does not affect a dip of exactly the permitted duration
    recovery = (low_time - 0.5 * p.substep - p.zero_time) / (p.recovery_time - p.zero_time)
    if voltage < (1.0 - p.dead_band) * min(max(recovery, 0.0), 1.0):
        return 3.0
    if voltage > p.highest_voltage:
        return 4.0
    if voltage > LEAST_VOLTAGE and (frequency < p.lowest_frequency or frequency > p.highest_frequency):
        return 5.0
    if heat > p.chopper_heat:
        return 6.0
    return 0.0
