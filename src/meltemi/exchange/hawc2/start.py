"""Initial rotor speed, pitch and azimuth of a HAWC2 model.

Reference: docs/migrate/hawc2.md.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.exchange.hawc2.bodies import Body
from meltemi.exchange.hawc2.htc import Block, Treatment

Float = NDArray[np.float64]


def _bearing_axis(bearing: Block, ground: Float, parent: Body, shaft: Body) -> Float | None:
    """(3,) unit vector about which the second body of a bearing turns, inertial axes; None if there is none."""
    command = bearing.get("bearing_vector")
    if command is None:
        return None
    frame, *vector = command.numbers(0, 4)
    axes = {0: ground, 1: parent.axes}.get(int(frame), shaft.axes)
    axis: Float = axes @ np.array(vector)
    return axis / (float(np.linalg.norm(axis)) or 1.0)


def read_start(
    bearing: Block, ground: Float, parent: Body, shaft: Body, beyond: list[Body], down: Float, treatment: Treatment
) -> dict[str, float]:
    """Rotor speed [rad/s], pitch and azimuth [rad] of blade 1 with which the model begins.

    Args:
      bearing: bearing of the shaft.
      ground: (3, 3) rotation from HAWC2's global axes to the inertial axes of meltemi.
      parent: the body that carries the shaft.
      beyond: the bodies from the hub to blade 1.
      down: (3,) direction of the shaft, downwind, inertial axes.

    Raises:
      UnsupportedError: the shaft does not turn about its axis.
    """
    axis = _bearing_axis(bearing, ground, parent, shaft)
    if axis is not None and abs(axis @ down) < 0.999:
        raise UnsupportedError(f"{bearing.where}: the bearing of {shaft.name} does not rotate it about its axis")
    spins = [(body, c) for body in (shaft, *beyond) for c in body.joint.all("mbdy2_ini_rotvec_d1")]
    speed = 0.0
    for body, command in spins:
        *vector, size = command.numbers(0, 4)
        length = float(np.linalg.norm(vector)) or 1.0
        speed += size * float(body.axes @ np.array(vector) @ down) / length
    speed_command = bearing.get("omegas")
    if speed_command is not None and bearing.name == "bearing3":
        speed = float(speed_command.numbers(0, 1)[0]) * (1.0 if axis is None else float(np.sign(axis @ down)))
        treatment.set_note([c for _, c in spins], "not needed", "bearing3 prescribes the rotor speed")
    blade = beyond[-1]
    x, y, z = blade.axes.T
    left = np.array([-down[1], down[0], 0.0]) / np.hypot(down[0], down[1])
    up = np.cross(down, left)
    # clockwise for an observer who looks downwind: up, right
    azimuth = math.atan2(-float(z @ left), float(z @ up))
    pitch = math.atan2(-float(down @ x), float(down @ y))
    # angles that are rounding errors are zero
    return {
        "rotor_speed": float(speed),
        "pitch": pitch if abs(pitch) > 1e-9 else 0.0,
        "azimuth": azimuth % (2.0 * math.pi) if abs(azimuth) > 1e-9 else 0.0,
    }
