"""Baseline controller from a windIO file: speeds, limits and initial gains.

windIO has the schedules of one controller (ROSCO), whose gains are only valid with its filters and torque law. They
are not used. The pitch gains are those of the NREL 5 MW by similarity (docs/migrate/windio.md): initial values, which
``tune_baseline`` (called by the command line) replaces by gains from the aerodynamics of the turbine.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.units import rpm
from meltemi.exchange.windio.machine import DEGREE, given, rotor_speed, scaled
from meltemi.exchange.windio.tree import Tree

Float = NDArray[np.float64]

SENSITIVITY = 25.52e6 / 5.2966e6
"""[1/rad] -dP/dpitch over rated power at zero pitch of the NREL 5 MW (TP-500-38060, Table 7-1 and section 7)."""
HALVING = 6.302336 * DEGREE
"""[rad] pitch at which the sensitivity of the NREL 5 MW is doubled."""
BANDWIDTH, DAMPING = 0.6 / rpm(12.1), 0.7
"""Frequency of the speed loop of the NREL 5 MW over the rated rotor speed, and its damping ratio."""
REGION_3, SLIP, POWER_PITCH = 0.99, 0.1, DEGREE
"""Rated over reference speed, slip, and pitch [rad] above the smallest for constant power, of the NREL 5 MW."""
TORQUE = {"maximum_torque": ("control.max_gen_torque", 1.0), "rate_limit": ("control.max_torque_rate", 1.0)}
PITCH = {"maximum": ("control.max_pitch_limit", DEGREE), "rate_limit": ("control.max_pitch_rate", DEGREE)}
"""Our keys from the paths of a windIO file, with the factor to SI units."""
MOST_TORQUE, FILTER = 1.1, 2.0 * math.pi * 0.25 / rpm(12.1)
"""Largest over rated torque, and corner frequency of the filter over the rated rotor speed, of the same."""
TORQUE_BEGINS = 0.95
"""Generator speed where torque begins over the smallest one, where region 2 begins."""


def read_control(tree: Tree, rotor_inertia: float, ratio: float, generator_inertia: float, efficiency: float) -> Any:
    """Content of ``Turbine.control``, as far as available in the file.

    Args:
      rotor_inertia: [kg m^2] inertia of blades and hub about the shaft.
      ratio: gear ratio.
      generator_inertia: [kg m^2] inertia of the generator about the high-speed shaft.
      efficiency: electrical over mechanical power.
    """
    rated, slowest = rotor_speed(tree, "rated_rotor_speed"), rotor_speed(tree, "min_rotor_speed")
    electric = tree.number("control.rated_power") or tree.number("assembly.rated_power")
    power = scaled(electric, 1.0 / efficiency)
    fine = tree.number("control.fine_pitch")
    low = tree.number("control.min_pitch_limit") if fine is None else fine
    torque: dict[str, Any] = {"slip": SLIP} | tree.quantities(TORQUE)
    pitch: dict[str, Any] = given(minimum=scaled(low, DEGREE)) | tree.quantities(PITCH)
    if low is not None:
        torque["power_pitch"] = max(low * DEGREE + POWER_PITCH, 0.0)
    if slowest is not None:
        torque |= {"cut_in_speed": TORQUE_BEGINS * ratio * slowest, "optimal_speed": ratio * slowest}
    if power is not None:
        torque["rated_power"] = power
    if rated is not None:
        torque["rated_speed"], pitch["reference_speed"] = REGION_3 * ratio * rated, ratio * rated
    if rated is not None and power is not None:
        pitch |= _similar(rated, power, rotor_inertia, ratio, generator_inertia)
        why = "NREL 5 MW by similarity; meltemi.analysis.tune_baseline computes gains for this turbine"
        tree.note("approximated", "control.pitch_kp, control.pitch_ki", GAINS, why)
    gain = scaled(tree.number("control.region2_k"), 1.0 / rpm(1.0) ** 2)
    if gain is not None:
        torque["optimal_gain"] = gain
        if power is not None and rated is not None and gain * torque["rated_speed"] ** 3 > power:
            torque["optimal_gain"] = power / torque["rated_speed"] ** 3
            why = f"lowered from {gain:.4g} to {torque['optimal_gain']:.4g} N m s^2/rad^2: rated power at rated speed"
            tree.note("approximated", "control.region2_k", "optimal gain", why)
    elif rated is not None and power is not None:
        torque["optimal_gain"] = power / torque["rated_speed"] ** 3
        why = f"{torque['optimal_gain']:.4g} N m s^2/rad^2: none is given; rated power at rated speed"
        tree.note("approximated", "control.region2_k", "optimal gain", why)
    if "maximum_torque" not in torque and rated is not None and power is not None:
        torque["maximum_torque"] = MOST_TORQUE * power / (ratio * rated)
        why = f"none is given; {MOST_TORQUE:g} of rated torque, as the NREL 5 MW"
        tree.note("approximated", "control.max_gen_torque", "largest torque", why)
    filtered = tree.number("control.lpf_frequency")
    if filtered is None and rated is not None:
        filtered = FILTER * rated
        why = f"none is given; first order, {filtered:.4g} rad/s, as the NREL 5 MW by similarity"
        tree.note("approximated", "control.lpf_frequency", "filter of the generator speed", why)
    elif filtered is not None:
        tree.note("approximated", "control.lpf_frequency", "filter of the generator speed", "first order")
    for key, why in IGNORED.items():
        if tree.get(f"control.{key}") is not None:
            tree.note("ignored", tree.place(f"control.{key}"), key.replace("_", " "), why)
    return given(filter_frequency=filtered) | {"torque": torque, "pitch": pitch, "source": tree.source}


GAINS = "pitch gains"
IGNORED = {
    "min_pitch_table": "the baseline controller has a constant minimum pitch",
    "optimal_tsr": "the baseline controller uses optimal_gain",
    "gen_torque_kp": "the baseline controller has a torque ramp in region 2 1/2",
    "gen_torque_ki": "the baseline controller has a torque ramp in region 2 1/2",
    "lpf_damping": "first-order filter",
    "constant_power": "the baseline controller holds constant power",
    "max_rotor_speed": "there is no shutdown",
    "gen_actuator_frequency": "torque follows without delay, within its rate limit",
}


def _similar(rated: float, power: float, rotor: float, ratio: float, generator: float) -> dict[str, float]:
    """Pitch gains of Jonkman et al. (2009), section 7, with the pitch sensitivity of the NREL 5 MW per power."""
    inertia = rotor + ratio**2 * generator
    frequency = BANDWIDTH * rated
    unit = inertia * rated / (ratio * SENSITIVITY * power)
    return {
        "proportional_gain": 2.0 * DAMPING * frequency * unit,
        "integral_gain": frequency**2 * unit,
        "gain_halving_pitch": HALVING,
    }


def rotor_inertia(blade: dict[str, Any], hub: dict[str, Any], blades: int) -> float:
    """Inertia [kg m^2] of straight, coned blades and the hub about the shaft."""
    structure = blade["structure"]
    mass, z = structure["mass_matrix"][:, 0, 0], structure["position"]
    radius = (hub.get("radius", 0.0) + z) * math.cos(hub.get("precone", 0.0))
    return float(blades * np.trapezoid(mass * radius**2, z) + hub.get("inertia", 0.0))
