"""Tuned mass dampers of tower, nacelle and blades from ServoDyn's structural control (StC) files.

Positions are relative to the tower base, for the nacelle to the tower top and for blades to the blade root, in the
axes of that frame, without twist (ServoDyn.f90, ``InitRefPos`` and ``InitRefOrient``; for tower and nacelle from
memory).
"""

from __future__ import annotations

from typing import Any

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import InputFile, read_input
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

INDEPENDENT, OMNIDIRECTIONAL = 1, 2
PLACES = (("nacelle_dampers", "NStCfiles"), ("tower_dampers", "TStCfiles"), ("blade_dampers", "BStCfiles"))


def read_mass_dampers(servo: InputFile, v: Values, length: float, notes: Notes) -> list[dict[str, Any]]:
    """Read the mass dampers that ServoDyn names.

    Args:
      servo: ServoDyn file; v: its values.
      length: [m] length of the tower.

    Raises:
      InputError: a file is missing or not valid.
      UnsupportedError: a liquid damper, prescribed or controlled forces, a table of the spring, motion along z.
    """
    dampers: list[dict[str, Any]] = []
    for target, keyword in PLACES:
        count = int(v.given(target, 0))
        if count == 0:
            continue
        entry = servo.require([keyword], f"names of {count} StC files")
        if len(entry.values) < count:
            raise InputError(f"{servo.at(entry.line)}: {keyword}: expected {count} files, found {len(entry.values)}")
        for text in entry.values[:count]:
            path = servo.file(text, entry.line)
            if path is None:
                raise InputError(f"{servo.at(entry.line)}: {keyword}: expected the name of a file, found {text!r}")
            origin = length if target == "nacelle_dampers" else 0.0
            dampers += _dampers(read_input(path, "StC"), origin, notes, in_blade=target == "blade_dampers")
    return dampers


def _dampers(file: InputFile, origin: float, notes: Notes, in_blade: bool) -> list[dict[str, Any]]:
    v = Values(notes, file)
    mode = v["mode"]
    if mode == 0:
        return []
    if mode not in (INDEPENDENT, OMNIDIRECTIONAL):
        entry = file.require(["StC_DOF_MODE"], "degrees of freedom")
        raise UnsupportedError(
            f"{file.at(entry.line)}: StC_DOF_MODE {mode}: only masses on springs are modelled (1, 2); set it to 0"
        )
    for target, name, usual in (("table", "Use_F_TBL", False), ("control", "StC_CMODE", 0)):
        if v.given(target, usual) != usual:
            raise UnsupportedError(
                f"{v.source[target].split(' ')[0]}: {name}: springs and dampers are linear and passive"
            )
    if mode == INDEPENDENT and v.given("z_on", False):
        raise UnsupportedError(f"{file.path}: StC_Z_DOF: masses move along x and y only")
    for target in ("place_x", "place_y"):
        if v.given(target, 0.0):
            v.note("approximated", target, f"the mass is on the axis of the {'blade' if in_blade else 'tower'}")
    place = {"span": v["place_z"], "angle": 0.0} if in_blade else {"height": origin + v["place_z"]}
    axes = [axis for axis in "xy" if mode == OMNIDIRECTIONAL or v.given(f"{axis}_on", False)]
    each = {axis: _axis(v, axis, mode) | place for axis in axes}
    if mode == OMNIDIRECTIONAL:
        if each["x"] != each["y"]:
            raise UnsupportedError(
                f"{file.path}: a mass that moves in both directions needs the same values along x and y"
            )
        return [each["x"] | {"axes": "xy"}]
    return [values | {"axes": axis} for axis, values in each.items()]


def _axis(v: Values, axis: str, mode: int) -> dict[str, Any]:
    mass = v["both_mass"] if mode == OMNIDIRECTIONAL and v["both_mass"] else v[f"{axis}_mass"]
    damper = {"mass": mass, "stiffness": v[f"{axis}_stiffness"], "damping": v.given(f"{axis}_damping", 0.0)}
    if stop := v.given(f"{axis}_stop_stiffness", 0.0):
        damper |= {"stops": [v[f"{axis}_low"], v[f"{axis}_high"]], "stop_stiffness": stop}
        damper["stop_damping"] = v.given(f"{axis}_stop_damping", 0.0)
    return damper
