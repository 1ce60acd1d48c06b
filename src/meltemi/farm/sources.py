"""Farm layouts of other programs: FAST.Farm primary files (4.x and 5.x), windIO plants, FLORIS inputs.

A FAST.Farm file also gives wake settings. Domains are ignored, since wakes here need no grid.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import parse, read_text, validated
from meltemi.exchange.openfast.text import InputFile, number, read_input
from meltemi.exchange.report import Notes
from meltemi.farm.layout import LARGEST
from meltemi.farm.settings import WakeSettings

_CONSTANTS = (
    "Mod_WakeDiam 1; Mod_Meander 3; C_Meander 1.9; C_NearWake 1.8; C_HWkDfl_O 0; C_HWkDfl_OY 0.3; "
    "C_HWkDfl_x 0; C_HWkDfl_xY -0.004; k_vAmb 0.05 1 0 1 0.01; k_vShr 0.016 0.2 3 25 0.1; C_vAmb_FMin 1; "
    "C_vAmb_DMin 0; C_vAmb_DMax 1; C_vAmb_Exp 0.01; C_vShr_FMin 0.2; C_vShr_DMin 3; C_vShr_DMax 25; C_vShr_Exp 0.1; "
    "WAT_k_Def 0.6 0 0 2 1; WAT_k_Grad 3 0 0 12 0.65"
)
FAST_FARM = {name: tuple(map(float, values)) for name, *values in map(str.split, _CONSTANTS.split(";"))}
"""Constants of the set ``fast.farm`` by keyword; the viscosities of 4.x have one number, and separate lines."""
CURLED = {name: (0.0,) for name in FAST_FARM if name.startswith("C_HWkDfl")} | {
    "k_VortexDecay": (0.0,),
    "NumVortices": (100.0,),
    "sigma_D": (0.2,),
    "FilterInit": (1.0,),
    "k_vCurl": (2.0,),
}
"""Constants of the set ``curled`` that differ from these, and additional ones."""
INCLUDE = re.compile(r"!include\s+([^\s,\]}#]+)")


@dataclass(frozen=True)
class Layout:
    """Farm layout from a file.

    Attributes:
      positions: (x, y) [m] positions of the turbines.
      wakes: keys and values of wake settings in the file.
      notes: content that was not used, and the reasons.
    """

    positions: tuple[tuple[float, float], ...]
    wakes: dict[str, Any]
    notes: tuple[str, ...]


def read_layout(path: str | Path, diameter: float) -> Layout:
    """Read the layout of a farm from a FAST.Farm primary file (.fstf), a windIO plant or a FLORIS input (YAML).

    Args:
      path: layout file.
      diameter: [m] rotor diameter.

    Raises:
      InputError: with file, key and what was expected.
    """
    file = Path(path)
    if file.suffix.lower() not in (".yaml", ".yml"):
        return _fast_farm(read_input(file, "FAST.Farm"), diameter)
    data = _tree(file)
    if isinstance(data.get("wind_farm"), str):
        file = file.parent / data["wind_farm"].removeprefix("!include ")
        data = {"wind_farm": _tree(file)}
    farm = data["wind_farm"] if isinstance(data.get("wind_farm"), dict) else data
    if "layouts" in farm:
        layouts, notes = farm["layouts"], []
        if isinstance(layouts, list):
            if len(layouts) > 1:
                notes.append(f"the first of {len(layouts)} layouts is taken")
            layouts = layouts[0] if layouts else {}
        if isinstance(layouts, dict) and "coordinates" not in layouts and len(layouts) == 1:
            (layouts,) = layouts.values()  # windIO 1: layouts by name
        types = layouts.get("turbine_types") if isinstance(layouts, dict) else None
        notes += _several(types)
        return _mapped(_columns(file, layouts, "layouts.coordinates", ("x", "y")), notes)
    if isinstance(farm.get("farm"), dict):
        notes = _several(farm["farm"].get("turbine_type"))
        return _mapped(_columns(file, {"farm": farm["farm"]}, "farm", ("layout_x", "layout_y")), notes)
    raise InputError(
        f"{file}: expected the layout of a farm: layouts.coordinates.x and y (windIO plant), or farm.layout_x and "
        f"layout_y (FLORIS); {did_you_mean('layouts', farm)}"
    )


def _several(types: Any) -> list[str]:
    """A note if a farm has different types of turbines."""
    if isinstance(types, list) and len({str(each) for each in types}) > 1:
        return ["it has several types of turbines; all turbines are the one that is given"]
    return []


def _tree(path: Path) -> dict[str, Any]:
    """Content of a YAML file; includes remain texts."""
    return parse(INCLUDE.sub(r'"!include \1"', read_text(path)), path, "a farm of windIO or FLORIS")


def _columns(path: Path, data: Any, where: str, names: tuple[str, str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(turbines, 2) [m] positions from two lists under the last key of a path."""
    content = data.get(where.split(".")[-1]) if isinstance(data, dict) else None
    columns = [content.get(name) if isinstance(content, dict) else None for name in names]
    for name, column in zip(names, columns, strict=True):
        numbers = isinstance(column, list) and all(
            isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in column
        )
        if not (numbers and column):
            raise InputError(f"{path}: {where}.{name}: expected a list of numbers [m], found {str(column)[:40]}")
    x, y = (column or [] for column in columns)
    if len(x) != len(y):
        raise InputError(f"{path}: {where}: {len(x)} numbers of {names[0]}, but {len(y)} of {names[1]}")
    return np.array([x, y], dtype=np.float64).T


def _mapped(positions: np.ndarray[Any, np.dtype[np.float64]], notes: list[str]) -> Layout:
    """Positions from map coordinates, east and north."""
    notes.append("x is east and y north: wind direction 0 blows from the west, direction 30 deg from 300 deg")
    if np.abs(positions).max() > LARGEST:
        middle = np.round(positions.mean(axis=0))
        positions = positions - middle
        notes.append(f"the origin is moved to ({middle[0]:.0f}, {middle[1]:.0f}) m, the middle of the turbines")
    return Layout(tuple((float(x), float(y)) for x, y in positions), {}, tuple(notes))


def _fast_farm(file: InputFile, diameter: float) -> Layout:
    turbines = file.require(["NumTurbines"], "number of turbines")
    if file.find("Mod_Wake", "NumPlanes", "NumRadii") is None:
        raise InputError(f"{file.path}: no wake dynamics (NumRadii): expected a FAST.Farm primary file of 4.x or 5.x")
    table = file.placed(turbines, "WT_X WT_Y WT_Z", {"x": "WT_X", "y": "WT_Y", "z": "WT_Z"}, Notes())
    if not len(table["x"]):
        raise InputError(f"{file.at(turbines.line)}: NumTurbines: expected one turbine or more")
    kind = _numbers(file, "Mod_Wake") or (1.0,)
    model = "curled" if kind == (2.0,) else "fast.farm"
    notes, wakes = [], {"model": model} | _settings(file, diameter)
    if kind == (3.0,):
        notes.append("Mod_Wake 3, planes of points without curl, is not taken: the wakes are those of Mod_Wake 1")
    for name, constants in (FAST_FARM | (CURLED if model == "curled" else {})).items():
        given = _numbers(file, name)
        if given and given != constants[: len(given)]:
            of_set = " ".join(f"{x:g}" for x in constants)
            notes.append(f"{name} {' '.join(f'{x:g}' for x in given)} is not taken: the set {model} has {of_set}")
    if np.any(table["z"] != 0.0):
        notes.append("WT_Z is not used: all turbines have the same base height")
    notes.append("wind and turbines are those that are given; meltemi import converts the decks of WT_FASTInFile")
    validated(wakes, WakeSettings, f"{file.path}, by DT_Low, f_c, RotorDiamRef or NZ_Low")
    positions = tuple((float(x), float(y)) for x, y in zip(table["x"], table["y"], strict=True))
    return Layout(positions, wakes, tuple(notes))


def _settings(file: InputFile, diameter: float) -> dict[str, Any]:
    """Wake settings that a FAST.Farm file gives as numbers."""
    wakes: dict[str, Any] = {"added_turbulence": _numbers(file, "WAT") not in ((), (0.0,))}
    if step := _numbers(file, "DT_Low"):
        wakes["step"] = step[0]
    if cut_off := _numbers(file, "f_c"):
        wakes["cut_off"] = cut_off[0] * 0.5 * (_numbers(file, "RotorDiamRef") or (diameter,))[0]
    if spacing := _numbers(file, "dr"):
        wakes["radial_points"] = min(max(diameter / max(spacing[0], 1e-3), 15.0), 30.0)
    grid = [_numbers(file, name) for name in ("Z0_Low", "NZ_Low", "dZ_Low")]
    if all(grid) and _numbers(file, "Mod_AmbWind") == (2.0,):
        (bottom,), (count,), (height,) = (each[:1] for each in grid)
        wakes["ceiling"] = bottom + (count - 1.0) * height
    return wakes


def _numbers(file: InputFile, name: str) -> tuple[float, ...]:
    """Values of a keyword; empty where it is missing or DEFAULT."""
    entry = file.find(name)
    words = [] if entry is None else [word.strip("\"'") for word in entry.values]
    if entry is None or any(word.lower() == "default" for word in words):
        return ()
    values = tuple(number(word) for word in words)
    if any(value is None for value in values):
        raise InputError(f"{file.at(entry.line)}: {name}: expected numbers or DEFAULT, found {' '.join(words)!r}")
    return values  # type: ignore[return-value]
