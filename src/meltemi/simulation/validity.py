"""Where results leave what the model is made for: looked at in every step, since extremes fall between outputs.

Each criterion is a quantity that must not rise above its limit. The time loop keeps its largest value and when it was
above the limit first; a run in which one was ends as ``Status.DOUBTFUL``.

Reference: docs/theory/simulation.md (M-35 to M-37).
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.tables import RotorFlow, TowerFlow
from meltemi.control.actuators import ANGLE
from meltemi.core.kernel import kernel
from meltemi.maths.access import rot2, vec1, vec3
from meltemi.structure.tables import BladeNode
from meltemi.turbine import exchange as ex

if TYPE_CHECKING:
    from meltemi.simulation.machine import AnyModel

Float = NDArray[float64]

CRITERIA = SPEED, REVERSED, POWER, PITCH, DEFLECTION, TOWER = range(6)
LIMIT, WORST, FIRST, SCALE, STATE = range(5)
N_COLUMNS = 5
"""Columns of ``watch``: limit, largest value, time at which it was above the limit first (negative: never), parameter
and state of the quantity."""
WORDS = (
    ("rotor faster than 1.5 times its rated speed", "rad/s"),
    ("generator drives a rotor that turns backwards", "W"),
    ("aerodynamic power above that of the wind through the rotor (10 s mean), by", "W"),
    ("pitch angle beyond half a turn", "rad"),
    ("deflection of the blade's tip beyond the model's range", "m"),
    ("blade within the tower's surface, by", "m"),
)
"""What a finding says, with the unit of its value."""
OVERSPEED = 1.5
"""Times rated speed: beyond all that a machine is designed for."""
MOTORING = 0.01
"""Share of rated power that a generator may put into a rotor that turns backwards: a run may begin with it."""
EXCESS = 0.1
"""Share of rated power by which the mean may be above the wind's: turbulence has more than the mean over the disk."""
MEAN_TIME = 10.0
"""[s] of this mean, exponential."""
WIND_POWER = 1.0
"""Share of the wind's power that counts. Betz's limit, of a steady wake, is passed for seconds in strong turbulence."""
BENDING = 0.3
"""Of the blade's length: kinematics of second order in the deflection are off by about 3 % in its slope there."""
MOST_PITCH = np.pi

WIND, AERO_TORQUE = RotorFlow.slots("wind torque")
HEIGHT, DIAMETER, AXIS_X, AXIS_Y = TowerFlow.slots("height diameter x y")
(NODE,) = BladeNode.slots("position")


def new_watch(model: AnyModel) -> Float:
    """(criteria, columns) for a run that has not begun."""
    turbine = model.turbine
    rated, power = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio, turbine.rated_power
    watch = np.zeros((len(CRITERIA), N_COLUMNS))
    blade = getattr(turbine, "blade", None)
    bending = np.inf if blade is None else BENDING * blade.length
    watch[:, LIMIT] = OVERSPEED * rated, MOTORING * power, EXCESS * power, MOST_PITCH, bending, 0.0
    watch[:, WORST], watch[:, FIRST] = -np.inf, -1.0
    watch[POWER, SCALE] = WIND_POWER * 0.5 * np.pi * turbine.rotor_radius**2
    return watch


@kernel
def note(watch: Float, i: int, t: float, value: float) -> None:
    """Keep what a quantity is at time ``t``."""
    if value > watch[i, WORST]:
        watch[i, WORST] = value
    if value > watch[i, LIMIT] and watch[i, FIRST] < 0.0:
        watch[i, FIRST] = t


@kernel
def watch_shaft(
    t: float,
    dt: float,
    speed: float,
    generator_speed: float,
    torque: float,
    density: float,
    pitch: Float,
    rotor: Float,
    watch: Float,
) -> None:
    """Look at rotor, generator and pitch.

    Args:
      speed, generator_speed: [rad/s] of the rotor, and of the generator's shaft.
      torque: [N m] of the generator.
      density: [kg/m^3] of the air.
    """
    note(watch, SPEED, t, abs(speed))
    if generator_speed < 0.0:
        note(watch, REVERSED, t, -torque * generator_speed)
    x, y, z = rotor[WIND], rotor[WIND + 1], rotor[WIND + 2]
    u = sqrt(x * x + y * y + z * z)
    excess = rotor[AERO_TORQUE] * speed - watch[POWER, SCALE] * density * u * u * u
    watch[POWER, STATE] += (excess - watch[POWER, STATE]) * min(dt / MEAN_TIME, 1.0)
    note(watch, POWER, t, watch[POWER, STATE])
    for b in range(pitch.shape[1]):
        note(watch, PITCH, t, abs(pitch[ANGLE, b]))


@kernel
def watch_blades(
    t: float, blade_nodes: Float, motion: Float, frame: Float, machine: Float, tower: Float, watch: Float
) -> None:
    """Look at the tips' deflection, and at how near the blades' axes come to the tower."""
    hub, last = vec1(machine, ex.HUB_POSITION), tower.shape[1] - 1
    top, step = tower[HEIGHT, last], tower[HEIGHT, 1] - tower[HEIGHT, 0]
    tip = motion.shape[2] - 1
    for b in range(motion.shape[1]):
        x = motion[ex.POSITION, b, tip] - blade_nodes[NODE, b, tip]
        y = motion[ex.POSITION + 1, b, tip] - blade_nodes[NODE + 1, b, tip]
        note(watch, DEFLECTION, t, sqrt(x * x + y * y))
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        for n in range(tip, -1, -1):
            p = hub + R @ vec3(motion, ex.POSITION, b, n)
            if p.z >= top:
                break  # the rest of the blade is above, too
            place = max((p.z - tower[HEIGHT, 0]) / step, 0.0)
            i = min(int(place), last - 1)
            share = place - i
            x = p.x - tower[AXIS_X, i] - share * (tower[AXIS_X, i + 1] - tower[AXIS_X, i])
            y = p.y - tower[AXIS_Y, i] - share * (tower[AXIS_Y, i + 1] - tower[AXIS_Y, i])
            width = tower[DIAMETER, i] + share * (tower[DIAMETER, i + 1] - tower[DIAMETER, i])
            note(watch, TOWER, t, 0.5 * width - sqrt(x * x + y * y))


def found(watch: Float) -> list[dict[str, Any]]:
    """What was above its limit, by time: ``what``, ``value``, ``limit``, ``unit``, ``time`` [s]."""
    rows = [
        {"what": what, "value": float(row[WORST]), "limit": float(row[LIMIT]), "unit": unit, "time": float(row[FIRST])}
        for (what, unit), row in zip(WORDS, watch, strict=True)
        if row[FIRST] >= 0.0
    ]
    return sorted(rows, key=lambda row: row["time"])
