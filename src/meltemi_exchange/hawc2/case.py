"""Wind and start of a HAWC2 model.

The field of the wind is turned by the yaw angle about the global z, which points down, and by the tilt angle upwards:
a wind of positive yaw comes from the right for an observer who looks upwind.

Reference: docs/migrate/hawc2.md; Larsen and Hansen, How 2 HAWC2, the user's manual, DTU R-1597, commands of the wind.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi_exchange.hawc2.bodies import Body
from meltemi_exchange.hawc2.htc import Block, Treatment
from meltemi_exchange.report import ImportNote

Float = NDArray[np.float64]


def read_wind(wind: Block, turned_by: float, treatment: Treatment, notes: list[ImportNote]) -> dict[str, Any]:
    """Steady wind of a model, as in a case file.

    Args:
      turned_by: [rad] about our z: the model's rotor, which is turned back with the wind.

    Raises:
      InputError: with file and line.
    """
    speed = wind.value("wsp", 10.0)
    found: dict[str, Any] = {"kind": "steady"}
    if (turned := wind.get("windfield_rotations")) is not None:
        yaw, tilt, roll = turned.numbers(0, 3)
        turned_by += math.radians(yaw)
        if tilt:
            found["upflow"] = math.radians(tilt)
        if roll:
            notes.append(
                ImportNote("ignored", turned.where, "windfield_rotations", f"the roll of the field, {roll:g} deg")
            )
    if abs(turned_by) > 1e-9:
        found["direction"] = math.remainder(turned_by, 2.0 * math.pi)
    if (input_along := wind.get("horizontal_input")) is not None and not input_along.numbers(0, 1)[0]:
        # the speed is that along the flow, ours the horizontal one
        speed *= math.cos(found.get("upflow", 0.0))
        if "upflow" not in found:
            treatment.say([input_along], "equivalent", "the flow is horizontal")
    shear, centre = wind.get("shear_format"), wind.get("center_pos0")
    law = 1 if shear is None else int(shear.numbers(0, 1)[0])
    if shear is not None and law in (2, 3):
        found["roughness" if law == 2 else "shear_exponent"] = float(shear.numbers(1, 1)[0])
    height = 0.0 if centre is None else -float(centre.numbers(0, 3)[2])
    if law in (2, 3) and height > 0.0:
        found["reference_height"] = height
    elif centre is not None:
        treatment.say([centre], "not needed", "without shear the height of the wind speed does not matter")
    return {**found, "speed": 0.0 if law == 0 else speed}


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
    bearing: Block,
    ground: Float,
    parent: Body,
    shaft: Body,
    beyond: list[Body],
    down: Float,
    treatment: Treatment,
) -> dict[str, float]:
    """Rotor speed [rad/s], pitch and azimuth [rad] of blade 1 with which the model begins.

    Args:
      bearing: of the shaft.
      ground: (3, 3) our inertial axes from HAWC2's global ones.
      parent: the body that carries the shaft.
      beyond: the bodies from the hub to blade 1.
      down: (3,) direction of the shaft, downwind, inertial axes.

    Raises:
      UnsupportedError: the shaft does not turn about its axis.
    """
    axis = _bearing_axis(bearing, ground, parent, shaft)
    if axis is not None and abs(axis @ down) < 0.999:
        raise UnsupportedError(f"{bearing.where}: the bearing of {shaft.name} does not turn it about its own axis")
    spins = [(body, c) for body in (shaft, *beyond) for c in body.joint.all("mbdy2_ini_rotvec_d1")]
    speed = 0.0
    for body, command in spins:
        *vector, size = command.numbers(0, 4)
        length = float(np.linalg.norm(vector)) or 1.0
        speed += size * float(body.axes @ np.array(vector) @ down) / length
    held = bearing.get("omegas")
    if held is not None and bearing.name == "bearing3":
        speed = float(held.numbers(0, 1)[0]) * (1.0 if axis is None else float(np.sign(axis @ down)))
        treatment.say([c for _, c in spins], "not needed", "bearing3 keeps the rotor at its own speed")
    blade = beyond[-1]
    x, y, z = blade.axes.T
    left = np.array([-down[1], down[0], 0.0]) / np.hypot(down[0], down[1])
    up = np.cross(down, left)
    # clockwise for an observer who looks downwind: up, right
    azimuth = math.atan2(-float(z @ left), float(z @ up))
    pitch = math.atan2(-float(down @ x), float(down @ y))
    # angles of nothing but rounding are zero
    return {
        "rotor_speed": float(speed),
        "pitch": pitch if abs(pitch) > 1e-9 else 0.0,
        "azimuth": azimuth % (2.0 * math.pi) if abs(azimuth) > 1e-9 else 0.0,
    }
