"""The wind of a HAWC2 model as keys of a case file: steady, or a turbulence box whose files exist.

The wind field is rotated by the yaw angle about the global z axis, which points down, and upwards by the tilt angle:
wind of positive yaw comes from the right for an observer looking upwind. HAWC2 reads a box with its last plane
first (:func:`meltemi.io.read_hawc2`). Its mean wind has the speed ``wsp`` at the middle of the box, ``center_pos0``;
``shear_format`` 0 has none, as its output shows (h2lib-tests 13.2.2103).

Reference: docs/migrate/hawc2.md; Larsen and Hansen, How 2 HAWC2, the user's manual, DTU R-1597, commands of the wind.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi.exchange.boxes import Profile, box_case
from meltemi.exchange.hawc2.htc import Block, Command, Treatment
from meltemi.exchange.report import Notes

PROFILES: dict[int, Profile] = {0: "none", 1: "constant", 2: "log", 3: "power"}


def read_wind(wind: Block, path: Path, turned_by: float, treatment: Treatment, notes: Notes) -> dict[str, Any]:
    """The ``wind`` of a case file, with absolute paths.

    Args:
      path: main file of the model.
      turned_by: [rad] rotation of the rotor of the model about z, which is undone by rotating the wind.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    tilt = 0.0
    if (turned := wind.get("windfield_rotations")) is not None:
        yaw, tilt, roll = (math.radians(x) for x in turned.numbers(0, 3))
        turned_by += yaw
        if roll:
            words = f"the roll of the field, {math.degrees(roll):g} deg"
            notes.add("ignored", turned.where, "windfield_rotations", words)
    direction = {"direction": math.remainder(turned_by, 2.0 * math.pi)} if abs(turned_by) > 1e-9 else {}
    speed = wind.value("wsp", 10.0)
    if (along := wind.get("horizontal_input")) is not None and not along.numbers(0, 1)[0]:
        speed *= math.cos(tilt)  # HAWC2's speed is along the flow, that of a case is horizontal
        if not tilt:
            treatment.set_note([along], "equivalent", "the flow is horizontal")
    shear, centre, form = (wind.get(name) for name in ("shear_format", "center_pos0", "turb_format"))
    profile = "constant" if shear is None else PROFILES.get(int(shear.numbers(0, 1)[0]), "constant")
    value = float(shear.numbers(1, 1)[0]) if shear is not None and profile in ("log", "power") else 0.0
    if form is not None and form.values[:1] == ("1",):
        try:
            box = _box(wind, path, speed, profile, value, treatment)
        except InputError as error:
            treatment.set_note([form], "ignored", f"the case has steady wind: {error}")
        else:
            treatment.set_note([form], "used", "the case has the box of the block mann, its last plane first")
            if tilt and turned is not None:
                notes.add("ignored", turned.where, "windfield_rotations", "boxes are not inclined")
            return box | direction
    steady: dict[str, Any] = {"kind": "steady", "speed": 0.0 if profile == "none" else speed} | direction
    if tilt:
        steady["upflow"] = tilt
    height = 0.0 if centre is None else -float(centre.numbers(0, 3)[2])
    if profile in ("log", "power"):
        steady["roughness" if profile == "log" else "shear_exponent"] = value
        if height > 0.0:
            return steady | {"reference_height": height}
    if centre is not None:
        treatment.set_note([centre], "not needed", "without shear the height of the wind speed does not matter")
    return steady


def _box(wind: Block, path: Path, speed: float, profile: Profile, value: float, treatment: Treatment) -> dict[str, Any]:
    mann, centre = wind.find("mann"), wind.need("center_pos0")
    scaled, names, dims = mann.get("dont_scale"), _of_components(mann, "filename"), _of_components(mann, "box_dim")
    if scaled is None or scaled.numbers(0, 1)[0] != 1.0:
        raise InputError("HAWC2 scales its box to tint unless dont_scale is 1: specify a scaled wind file for the run")
    if mann.get("factor_scaling") is not None:
        raise InputError("factor_scaling is not read: specify a scaled wind file for the run")
    points, steps = zip(*(each.numbers(0, 2) for each in dims), strict=True)
    *aside, z = centre.numbers(0, 3)
    files = [each.file(path) for each in names]
    box = box_case(files, points, steps, speed=speed, height=-z, front="last", profile=profile, value=value)
    treatment.set_note(names, "used", "wind.file")
    treatment.set_note(dims, "used", "wind.grid")
    treatment.set_note([scaled], "equivalent", "boxes are not scaled")
    why = "height of the middle of the box; in the case it is centred on the tower, where plane 0 is at time 0"
    treatment.set_note([centre], "approximated" if any(aside) else "used", why)
    return box


def _of_components(mann: Block, name: str) -> list[Command]:
    return [mann.need(f"{name}_{c}") for c in "uvw"]
