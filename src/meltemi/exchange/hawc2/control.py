"""Baseline control, actuators and generator from the DTU Wind Energy Controller and the servo libraries.

Reference: Hansen and Henriksen (2013), Basic DTU Wind Energy controller, DTU E-0018.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.exchange.hawc2.htc import Block, Treatment, file_of, lines_of
from meltemi.exchange.openfast.text import number
from meltemi.exchange.report import Notes
from meltemi.exchange.windio.control import POWER_PITCH, REGION_3, SLIP, TORQUE_BEGINS
from meltemi.turbine.definition import Turbine

DEGREE = math.pi / 180.0
CONTROLLERS = {"controller": "dtu_we_controller", "servo": "generator_servo", "pitch": "servo_with_limits"}
BRAKE = "mech_brake"


def libraries(dll: Block) -> dict[str, Block]:
    """Blocks of supported controller libraries, identified by their names or files."""
    blocks: dict[str, Block] = {}
    for block in dll.within("type2_dll"):
        words = " ".join(w for c in block.all("name", "filename") for w in c.values).lower()
        for name in (*CONTROLLERS.values(), BRAKE):
            if name in words and name not in blocks:
                blocks[name] = block
                break
    return blocks


def _constants(block: Block) -> dict[int, float]:
    rows = [c.numbers(0, 2) for c in block.find("init").all("constant")]
    return {int(row[0]): float(row[1]) for row in rows}


def read_control(
    dll: Block, main: Path, notes: Notes, treatment: Treatment, control_of: Turbine | None, extra: Mapping[str, Any]
) -> dict[str, Any]:
    """Read control, pitch actuator, rated power and parts of the drivetrain, as far as given.

    The controller's gains act on the rotor speed, those of meltemi on the generator speed. The gain schedule
    1 / (1 + t / K1 + t^2 / K2) becomes that of one pitch angle at which the gains are halved. The control of another
    turbine comes with its gear ratio, as its generator speeds do; the generator's inertia about the shaft remains.

    Raises:
      InputError: the table of the smallest pitch is missing or wrong.
    """
    blocks = libraries(dll)
    if control_of is not None:
        blocks = {name: block for name, block in blocks.items() if name in ("generator_servo", BRAKE)}
    known = {name: _constants(block) for name, block in blocks.items()}
    servo = known.get("generator_servo", {})
    c, p = known.get("dtu_we_controller", {}), known.get("servo_with_limits", {})
    ratio = control_of.drivetrain.gear_ratio if control_of is not None else c.get(76) or servo.get(5) or 1.0
    if (control_of is not None or c.get(76)) and 5 in servo:
        init = blocks["generator_servo"].find("init")
        fifth = [k for k in init.all("constant") if k.numbers(0, 1)[0] == 5]
        treatment.set_note(fifth, "not needed", "the gear ratio is that of the controller")
    efficiency = servo.get(4, 1.0)
    drive: dict[str, Any] = {"gear_ratio": ratio, "generator_efficiency": efficiency}
    if 1 in known.get(BRAKE, {}):
        drive["brake_torque"] = known[BRAKE][1] / ratio
    data: dict[str, Any] = {"drivetrain": drive}
    if p:
        data["pitch_actuator"] = {
            "natural_frequency": 2.0 * math.pi * p[2],
            "damping_ratio": p[3],
            "rate_limit": p[4] * DEGREE,
            "minimum": p[6] * DEGREE,
            "maximum": p[7] * DEGREE,
        }
        notes.add("used", "servo_with_limits", "frequency, damping, rate, angles", "pitch_actuator, without 5")
    missing = [i for i in (1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 17, 21) if i not in c]
    if missing:
        return data
    stated = extra.get("control.pitch.minimum")  # a constant minimum pitch needs no table
    low = _smallest_pitch(c[5], dll, main, notes) * DEGREE if stated is None else 0.0
    half = c[21] if not c.get(22) else 0.5 * (math.sqrt((k := c[22] / c[21]) ** 2 + 4.0 * c[22]) - k)
    slowest, rated, power = ratio * c[2], ratio * c[3], 1e3 * c[1] / efficiency
    # of the electrical torque, which the servo divides by the efficiency
    gain = c[11] / efficiency / ratio**3
    speed = REGION_3 * rated
    most = power / speed**3
    if gain > most:
        why = f"lowered from {gain:.4g} to {most:.4g} N m s^2/rad^2: rated power at rated speed"
        notes.add("approximated", "dtu_we_controller", "constant 11", why)
    data["rated_power"] = 1e3 * c[1]
    data["control"] = {
        "filter_frequency": 2.0 * math.pi * c[8],
        "torque": {
            "cut_in_speed": TORQUE_BEGINS * slowest,
            "optimal_speed": slowest,
            "rated_speed": speed,
            "optimal_gain": min(gain, most),
            "slip": SLIP,
            "rated_power": power,
            "maximum_torque": c[4] / efficiency / ratio,
            "rate_limit": c[4] / efficiency / ratio / (c.get(33, 2.0) + 0.01),
            "power_pitch": max(low + POWER_PITCH, 0.0),
            "hold": "power" if c.get(15, 1.0) >= 0.5 else "torque",
        },
        "pitch": {
            "reference_speed": rated,
            "proportional_gain": c[16] / ratio,
            "integral_gain": c[17] / ratio,
            "gain_halving_pitch": half * DEGREE,
            "minimum": low,
            "maximum": c[6] * DEGREE,
            "rate_limit": c[7] * DEGREE,
        },
        "source": "dtu_we_controller",
    }
    why = f"gains halved at {half:.3g} deg, linear in between"
    notes.add("approximated", "dtu_we_controller", "constants 21, 22", why)
    return data


def _smallest_pitch(angle: float, dll: Block, main: Path, notes: Notes) -> float:
    """[deg] constant 5, or the minimum of the table over wind speed that it refers to."""
    if abs(angle) <= 90.0:
        return angle
    name = f"wpdata.{int(angle)}"
    try:
        path = file_of(main, f"control/{name}", dll.where)
    except InputError as error:
        hint = "constant 5 names it; without it give extra={'control.pitch.minimum': ...} or control_of"
        raise InputError(f"{error}; {hint}") from None
    rows = [[number(word) for word in line.split()[:2]] for line in lines_of(path)[1:] if line.split()]
    pitch = [row[1] for row in rows if len(row) == 2 and row[1] is not None]
    if not pitch:
        raise InputError(f"{path}: expected rows of wind speed and smallest pitch")
    least = float(np.min(pitch))
    why = f"the baseline law has one smallest pitch: the least of the table, {least:g} deg"
    notes.add("approximated", "dtu_we_controller", f"constant 5: {name}", why)
    return least
