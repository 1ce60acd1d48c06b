"""Parameters of the baseline controller from ROSCO's DISCON.IN or from ServoDyn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.exchange.openfast.text import Float
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

IDEAL_RATE = math.radians(8.0)
"""[rad/s] rate limit of a pitch drive of which the deck says nothing."""
SLIP = 0.1
REGION_3 = 0.99
"""Share of the rated speed at which region 3 begins (TP-500-38060)."""
MINIMUM_TO_OPTIMAL = 1.05
"""Speed at which the line of region 1 1/2 meets the optimal curve, over the minimum speed that ROSCO holds."""
UNUSED = 9999.0
LEAST = 1e-3
"""Share that stands for nothing, where a record wants a number above zero."""
UNFILTERED = 50.0
"""Corner frequency of the speed of a law that has no filter, over the rated rotor speed."""


def from_discon(v: Values, notes: Notes) -> tuple[dict[str, Any], dict[str, Any]]:
    """Controller and pitch actuator from ROSCO's settings.

    ROSCO's gains over pitch angle become K / (1 + pitch / halving), fitted by least squares of the relative errors.

    Raises:
      InputError: the schedule has no gains.
    """
    where = v.source["schedule"].split(":")[0]
    angle, gain_p, gain_i = (np.array(v[name]) for name in ("angles", "proportional", "integral"))
    n = min(len(angle), len(gain_p), len(gain_i))
    angle, gain_p, gain_i = angle[:n], np.abs(gain_p[:n]), np.abs(gain_i[:n])
    if n < 2 or not gain_p.max() > 0.0 or not gain_i.max() > 0.0:
        raise InputError(f"{where}: PC_GS_angles, PC_GS_KP, PC_GS_KI: expected two points or more, not all zero")
    use = (gain_p > 0.05 * gain_p.max()) & (gain_i > 0.05 * gain_i.max())
    pitch = np.linspace(0.0, angle[use].max(), 60)  # below its first angle ROSCO holds the first gains
    gains = np.stack([np.interp(pitch, angle[use], gain[use]) for gain in (gain_p, gain_i)])
    halving, at_zero, off = _schedule(pitch, gains)
    why = (
        f"K / (1 + pitch / {math.degrees(halving):.2f} deg), off by up to {100.0 * off[0]:.0f} % (proportional) and "
        f"{100.0 * off[1]:.0f} % (integral); ROSCO itself (--controller rosco) has them exactly"
    )
    notes.add("approximated", where, f"PC_GS_angles, PC_GS_KP, PC_GS_KI ({n} points)", why)
    v.differs(
        "approximated",
        1,
        filter_type="the filter of the generator speed is of first order",
        torque_control="optimal torque by speed squared, VS_Rgn2K; no wind estimate",
        constant_power="above rated the power is constant, not the torque",
    )
    v.note("approximated", "minimum_speed", "a torque ramp from there, instead of a PI loop at this speed")
    rated = v["reference_speed"]
    low = max(v["minimum_speed"], 0.05 * rated)
    fine = v.given("fine_pitch", v["minimum_pitch"])
    power = v["rated_power"] / v.given("efficiency", 1.0)
    control = {
        "filter_frequency": v.given("filter", 2.0 * math.pi * 0.25),
        "torque": {
            "cut_in_speed": low,
            "optimal_speed": min(MINIMUM_TO_OPTIMAL * low, 0.9 * REGION_3 * rated),
            "rated_speed": REGION_3 * rated,
            "optimal_gain": v["optimal_gain"],
            "slip": SLIP,
            "rated_power": power,
            "maximum_torque": max(v["maximum_torque"], 1.001 * power / (REGION_3 * rated)),
            "rate_limit": v["torque_rate"],
            "power_pitch": max(v.given("switch", math.radians(1.0)) + fine, 0.0),
        },
        "pitch": {
            "reference_speed": rated,
            "proportional_gain": float(at_zero[0]),
            "integral_gain": float(at_zero[1]),
            "gain_halving_pitch": halving,
            "minimum": fine,
            "maximum": v["maximum_pitch"],
            "rate_limit": v["pitch_rate"],
        },
        "source": f"{where}: settings of ROSCO, mapped to the baseline controller",
    }
    v.unneeded("as many as PC_GS_angles has", "schedule")
    v.unneeded("region 3 begins at 0.99 of PC_RefSpd", "rated_speed")
    return control, _actuator(v, where, fine)


def _actuator(v: Values, where: str, fine: float) -> dict[str, Any]:
    """Pitch actuator from ROSCO's settings; ``fine`` [rad] is the pitch below rated."""
    actuator = {
        "rate_limit": v["pitch_rate"],
        "minimum": min(v["minimum_pitch"], fine),
        "maximum": max(v["maximum_pitch"], 1.58),
        "kind": "ideal",
        "source": where,
    }
    if v.given("actuator", 0) != 2:
        v.unneeded("of PA_Mode 2", "actuator_frequency", "actuator_damping")
        if v.given("actuator", 0) == 1:
            v.note("approximated", "actuator", "the pitch follows without delay, instead of with a first-order lag")
    if v.given("actuator", 0) == 2 and v.given("actuator_frequency", 0.0) > 0.0:
        actuator |= {"kind": "second_order", "natural_frequency": v["actuator_frequency"]}
        if v.given("actuator_damping", 0.0) > 0.0:
            actuator["damping_ratio"] = v["actuator_damping"]
    return actuator


def _schedule(angle: Float, gains: Float) -> tuple[float, Float, Float]:
    """Halving pitch [rad], gains at zero pitch, and their largest relative errors, by least relative squares.

    The halving pitch is that of the integral gain: ROSCO's proportional gain falls faster, as it accounts for the
    aerodynamic damping of the rotor.

    Args:
      angle: (n,) [rad] pitch angles.
      gains: (2, n) proportional and integral, positive.
    """
    tried = np.geomspace(0.02, 10.0, 400)
    ratio = 1.0 / (1.0 + angle / tried[:, None])[:, None, :] / gains  # (candidates, 2, n)
    at_zero = ratio.sum(axis=2) / (ratio**2).sum(axis=2)
    error = at_zero[:, :, None] * ratio - 1.0
    best = int(np.argmin((error[:, 1] ** 2).sum(axis=1)))
    return float(tried[best]), at_zero[best], np.abs(error[best]).max(axis=1)


def simple_torque(v: Values) -> dict[str, Any] | None:
    """ServoDyn's simple variable-speed control, if the deck has it (``VSContrl`` 1; ServoDyn.f90, ``CalculateTorque``).

    Region 2 from standstill, VS_Rgn2K times speed squared; region 2 1/2 a line from VS_RtGnSp / (1 + VS_SlPc) to the
    rated point; region 3 the torque VS_RtTq. No filter and no rate limit.

    Raises:
      InputError: region 2 exceeds the rated torque at rated speed.
    """
    speed, torque, gain, slip = (v[f"simple_{name}"] for name in ("speed", "torque", "gain", "slip"))
    unused = UNUSED * math.pi / 30.0 * 0.99
    if None in (speed, torque, gain) or not 0.0 < speed < unused or torque in (0.0, UNUSED):
        return None
    if gain * speed**2 > torque:
        raise InputError(
            f"{v.source['simple_gain']}: VS_Rgn2K times VS_RtGnSp squared is {gain * speed**2:g} N m, expected at most "
            f"VS_RtTq, {torque:g} N m"
        )
    return {
        "cut_in_speed": 0.0,
        "optimal_speed": LEAST * speed,
        "rated_speed": speed,
        "optimal_gain": max(gain, LEAST**2 * torque / speed**2),
        "slip": min(max(slip or 0.0, LEAST**2), 0.99),
        "rated_power": torque * speed,
        "maximum_torque": torque,
        "rate_limit": torque / LEAST,
        "power_pitch": math.pi,
        "hold": "torque",
    }


def fixed_pitch(torque: dict[str, Any], pitch: float, gear_ratio: float, source: str) -> dict[str, Any]:
    """Control of a deck with ServoDyn's torque alone (``PCMode`` 0): blades stay at their initial pitch [rad]."""
    law = {
        "reference_speed": torque["rated_speed"],
        "proportional_gain": 0.0,
        "integral_gain": LEAST**3,
        "gain_halving_pitch": 0.3,  # has no effect, as the gains are zero
        "minimum": pitch,
        "maximum": pitch + 1e-4,
        "rate_limit": IDEAL_RATE,
    }
    frequency = UNFILTERED * torque["rated_speed"] / gear_ratio
    return {"filter_frequency": frequency, "torque": torque, "pitch": law, "source": f"{source}: VSContrl 1, PCMode 0"}
