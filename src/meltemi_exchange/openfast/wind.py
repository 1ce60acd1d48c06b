"""The wind of a deck, as keys of a case file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi_exchange.openfast.text import InputFile
from meltemi_exchange.openfast.values import Values
from meltemi_exchange.report import ImportNote


def read_inflow(file: InputFile, hub_height: float, notes: list[ImportNote]) -> dict[str, Any] | None:
    """The ``wind`` of a case file, with absolute paths; None for unsupported kinds of wind.

    Raises:
      InputError: with file, line, keyword.
    """
    v = Values(notes)
    v.read(file)
    steady = ("upflow", "speed", "reference_height", "shear_exponent")
    files = {1: "", 2: "uniform_file", 3: "turbsim_file", 4: "bladed_file"}
    unread = [name for name in files.values() if name and name != files.get(v["wind_type"])]
    v.unneeded("of another WindType", *unread, *(() if v["wind_type"] == 1 else steady))
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
            # HWindSpeed lies along the inclined flow, our speed is its horizontal part
            "speed": v["speed"] * (hub_height / height) ** shear * math.cos(v.given("upflow", 0.0)),
            "shear_exponent": shear,
        }
        return wind | {name: v[name] for name in ("direction", "upflow") if v.given(name, 0.0)}
    target, suffix = {2: ("uniform_file", ""), 3: ("turbsim_file", ""), 4: ("bladed_file", ".wnd")}.get(
        v["wind_type"], ("", "")
    )
    if v.given("upflow", 0.0):
        v.note("ignored", "upflow", "only a steady wind can be inclined")
    if not target or v[target] is None:
        v.note("ignored", "wind_type", "this kind of wind is not supported in a deck; specify a wind file for the run")
        return None
    text = v[target]
    if suffix and not text.lower().endswith(suffix):
        text += suffix
    line = int(v.source[target].split(" ")[0].rsplit(":", 1)[1])
    try:
        found: Path | None = file.file(text, line)
    except InputError:
        v.note("ignored", target, "the file does not exist; specify a wind file for the run")
        return None
    turned = {"direction": v["direction"]} if v.given("direction", 0.0) else {}
    return None if found is None else {"kind": "file", "file": str(found.absolute())} | turned
