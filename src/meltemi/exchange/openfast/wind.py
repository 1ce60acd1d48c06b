"""The wind of a deck, as keys of a case file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi.exchange.boxes import Profile, box_case
from meltemi.exchange.openfast.text import InputFile
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes


def read_inflow(file: InputFile, hub_height: float, notes: Notes) -> dict[str, Any] | None:
    """The ``wind`` of a case file, with absolute paths; None for unsupported kinds of wind.

    Raises:
      InputError: the file is not valid; the message has file, line and keyword.
    """
    v = Values(notes, file)
    steady = ("upflow", "speed", "reference_height", "shear_exponent")
    files = {1: "", 2: "uniform_file", 3: "turbsim_file", 4: "bladed_file"}
    unread = [name for name in files.values() if name and name != files.get(v["wind_type"])]
    others = {"box_": 5, "uniform_": 2}
    unread += [name for name in v.source for o, kind in others.items() if name.startswith(o) and v["wind_type"] != kind]
    v.unneeded("of another WindType", *unread, *(() if v["wind_type"] == 1 else steady[1:]))
    if v["wind_type"] == 1:
        if v["speed"] is None:
            raise InputError(f"{file.path}: WindType is 1, but HWindSpeed is missing")
        shear = v.given("shear_exponent", 0.0)
        if not shear:
            v.unneeded("of PLExp other than 0", "reference_height")
        height = v.given("reference_height", hub_height) or hub_height
        if not height > 0.0 or not v["speed"] >= 0.0:
            raise InputError(f"{file.path}: HWindSpeed must be zero or more, RefHt positive")
        wind: dict[str, Any] = {
            "kind": "steady",
            # HWindSpeed is along the inclined flow, the speed of a case is its horizontal part
            "speed": v["speed"] * (hub_height / height) ** shear * math.cos(v.given("upflow", 0.0)),
            "shear_exponent": shear,
        }
        return wind | {name: v[name] for name in ("direction", "upflow") if v.given(name, 0.0)}
    if "upflow" in v.source:
        why = "only a steady wind can have an upflow; turn the tilt of the shaft instead"
        v.note("ignored" if v.given("upflow", 0.0) else "equivalent", "upflow", why)
    if v["wind_type"] == 5:
        return _box(file, v)
    target, suffix = {2: ("uniform_file", ""), 3: ("turbsim_file", ""), 4: ("bladed_file", ".wnd")}.get(
        v["wind_type"], ("", "")
    )
    if v["wind_type"] == 2:
        v.note("approximated", "uniform_length", "of linear shears; the rotor diameter is taken")
        same = abs(v.given("uniform_height", hub_height) - hub_height) < 1e-3 * hub_height
        v.note("equivalent" if same else "ignored", "uniform_height", "the hub height is the reference height")
    if not target or v[target] is None:
        v.note("ignored", "wind_type", "this kind of wind is not supported in a deck; specify a wind file for the run")
        return None
    text = v[target]
    if suffix and not text.lower().endswith(suffix):
        text += suffix
    line = int(v.source[target].split(" ")[0].rsplit(":", 1)[1])
    try:
        path: Path | None = file.file(text, line)
    except InputError:
        v.note("ignored", target, "the file does not exist; specify a wind file for the run")
        return None
    turned = {"direction": v["direction"]} if v.given("direction", 0.0) else {}
    return None if path is None else {"kind": "file", "file": str(path.absolute())} | turned


PROFILES: dict[int, Profile] = {-1: "none", 0: "constant", 1: "log", 2: "power"}
BOX = ("planes", "columns", "rows", "dx", "dy", "dz", "height", "speed", "profile")


def _box(file: InputFile, v: Values) -> dict[str, Any] | None:
    """A HAWC2 box as InflowWind reads it, which differs from HAWC2 itself (:func:`meltemi.io.read_hawc2`)."""
    missing = [name for name in ("u", "v", "w", *BOX) if v[f"box_{name}"] is None]
    if missing:
        raise InputError(f"{file.path}: WindType is 5, but the box has no {', '.join(missing)}")
    factors = [f"box_factor_{c}" for c in "uvw"]
    if v.given("box_scaling", 0) not in (0, 1) or (
        v.given("box_scaling", 0) == 1 and any(v.given(name, 1.0) != 1.0 for name in factors)
    ):
        v.note("ignored", "box_scaling", "boxes are not scaled; specify a scaled wind file for the run")
        return None
    v.unneeded("the box is not scaled", "box_scaling", *factors)
    profile = PROFILES.get(v["box_profile"])
    if profile is None:
        raise InputError(f"{file.path}: WindProfile is {v['box_profile']}, expected -1, 0, 1 or 2")
    value = {"power": v.given("box_exponent", 0.0), "log": v.given("box_roughness", 0.0)}.get(profile, 0.0)
    others = [f"box_{name}" for name, kind in (("exponent", "power"), ("roughness", "log")) if kind != profile]
    v.unneeded("of another WindProfile", *others)
    speed, height = v["box_speed"], v["box_height"]
    if not (height > 0.0 and speed > 0.0) or (profile == "log" and not 0.0 < value < height):
        raise InputError(f"{file.path}: RefHt_Hawc and URef must be positive, and Z0 of WindProfile 1 below RefHt_Hawc")
    if "box_offset" in v.source:
        v.note("approximated" if v["box_offset"] else "equivalent", "box_offset", "plane 0 is at the tower at time 0")
    points, steps = ([v[f"box_{name}"] for name in BOX[i : i + 3]] for i in (0, 3))
    try:
        components = [v.file(file, f"box_{c}") for c in "uvw"]
        files = [one for one in components if one is not None]
        if len(files) < 3:
            raise InputError("a file is not given")
        wind = box_case(files, points, steps, speed=speed, height=height, front="first", profile=profile, value=value)
    except InputError as error:
        v.note("ignored", "box_u", f"specify a wind file for the run: {error}")
        return None
    return wind | ({"direction": v["direction"]} if v.given("direction", 0.0) else {})
