"""AeroDyn airfoil files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.exchange.openfast.text import (
    Float,
    InputFile,
    KeywordLine,
    begins_with_number,
    is_content,
    number,
    read_input,
    split,
)
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Kind, Notes

NO_LIFT = 0.05
"""A section whose lift coefficient stays below this within 30 degrees has no dynamic stall: a cylinder."""
FIRST, BY_SETTING = 1, 3
"""Values of ``AFTabMod``."""
SEVERAL: dict[int, tuple[Kind, str]] = {
    FIRST: ("used", "the first, as with AFTabMod 1"),
    BY_SETTING: ("approximated", "that of UserProp 0: flaps of a controller are not read"),
}
"""Note on the one of several polars in a file that is read."""
STALL_CONSTANTS = {"a1": 0.3, "a2": 0.7, "b1": 0.14, "b2": 0.53, "pressure_lag": 1.7, "separation_lag": 3.0}
"""AeroDyn's defaults."""


@dataclass(frozen=True)
class Polars:
    """The airfoils of a deck.

    Attributes:
      airfoils: records by name, in the order of the AeroDyn file.
      constants: constants of the dynamic stall model that most airfoils have.
    """

    airfoils: dict[str, dict[str, Any]]
    constants: dict[str, float]


def has_lift(alpha: Float, lift: Float) -> bool:
    """Whether a polar is that of an airfoil, not of a cylinder."""
    return bool(np.any(np.abs(lift[np.abs(alpha) < 0.52]) > NO_LIFT))


def read_airfoils(paths: Sequence[Path], columns: dict[str, int], mode: int, notes: Notes) -> Polars:
    """Read the airfoil files of a deck.

    Args:
      paths: airfoil files in the order of the AeroDyn file.
      columns: column numbers of angle, lift, drag and moment in their tables, from 1; 0 for a missing column.
      mode: choice among several tables in a file (``AFTabMod``): 1 the first, 2 by Reynolds number (here the first,
        too), 3 by ``UserProp``, which is 0 unless a controller moves flaps.
      notes: a note on every file is appended.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    airfoils: dict[str, dict[str, Any]] = {}
    constants: list[tuple[float, ...]] = []
    for path in paths:
        file = read_input(path, "airfoil")
        # files written by meltemi state the original names, before characters were replaced for file names
        name = file.lines[1].lstrip("! ") if "by meltemi" in file.lines[0] else path.stem
        while name in airfoils:
            name += "_"
        airfoils[name], stall = _airfoil(file, columns, mode, notes)
        if airfoils[name]["dynamic_stall"]:
            constants.append(tuple(stall.values()))
    usual = max(set(constants), key=constants.count) if constants else tuple(STALL_CONSTANTS.values())
    if len(set(constants)) > 1:
        notes.add("approximated", "airfoils", "T_f0, T_p, A1, A2, b1, b2", "one set for all: that of most airfoils")
    return Polars(airfoils, dict(zip(STALL_CONSTANTS, usual, strict=True)))


def _airfoil(
    file: InputFile, columns: dict[str, int], mode: int, notes: Notes
) -> tuple[dict[str, Any], dict[str, float]]:
    file.require(["NumAlf"], "the number of lines of the polar")
    ends = file.entries["numalf"]
    if mode != BY_SETTING:
        ends = ends[:1]
    tables = [_table(file, entry, columns, notes) for entry in ends]
    settings = [_setting(file, entry) for entry in ends]
    order = sorted(range(len(ends)), key=settings.__getitem__)
    above = next((i for i in order if settings[i] >= 0.0), order[-1])
    below = next((i for i in reversed(order) if settings[i] <= 0.0), order[0])
    chosen = min(above, below, key=lambda i: abs(settings[i]))
    values = Values(Notes(), _part(file, ends[chosen]))  # one note per file keeps the report short
    alpha = tables[chosen]["alpha"]
    share = 0.0
    if settings[above] != settings[below]:
        alpha = np.union1d(tables[above]["alpha"], tables[below]["alpha"])
        share = -settings[below] / (settings[above] - settings[below])

    def column(which: str) -> Float:
        low, high = (np.interp(alpha, tables[i]["alpha"], tables[i][which]) for i in (below, above))
        with np.errstate(invalid="ignore", over="ignore"):  # the turbine reports values that are not finite by name
            return (1.0 - share) * low + share * high

    lift = column("lift")
    lifts = has_lift(alpha, lift)
    stated = lifts and bool(values.given("has_unsteady", False))
    airfoil: dict[str, Any] = {
        "angle_of_attack": alpha,
        "lift": lift,
        "drag": column("drag"),
        "moment": column("moment"),
        "dynamic_stall": lifts,
        "zero_lift_angle": values["zero_lift"] if stated else None,
        "zero_lift_drag": values["zero_lift_drag"] if stated else None,
        "source": f"{file.path.name}",
    }
    several = len(file.entries["numalf"])
    if several == 1:
        notes.add("used", file.path.name, f"polar, {len(alpha)} lines" + ("" if lifts else ", no lift"), "airfoils")
    else:
        kind, why = SEVERAL.get(mode, ("approximated", "the first, for one Reynolds number"))
        notes.add(kind, file.path.name, f"{several} polars", why)
    return airfoil, {name: values.given(name, default) for name, default in STALL_CONSTANTS.items()}


def _setting(file: InputFile, end: KeywordLine) -> float:
    """``UserProp`` of the table that ends with a line, such as a flap deflection."""
    entry = _part(file, end).find("UserProp", "Ctrl")
    return (number(entry.values[0]) or 0.0) if entry else 0.0


def _part(file: InputFile, end: KeywordLine) -> InputFile:
    """The keywords of one table, up to its number of lines."""
    begin = max((e.line for e in file.entries["numalf"] if e.line < end.line), default=0)
    entries = {name: [e for e in lines if begin < e.line <= end.line] for name, lines in file.entries.items()}
    return replace(file, entries={name: lines for name, lines in entries.items() if lines})


def _table(file: InputFile, entry: KeywordLine, columns: dict[str, int], notes: Notes) -> dict[str, Float]:
    """Angles [rad] and coefficients of one table.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    count = file.count(entry)
    body = [(i, split(line)) for i, line in enumerate(file.lines[entry.line :], entry.line + 1) if is_content(line)]
    body = body[next((k for k, (_, tokens) in enumerate(body) if begins_with_number(tokens)), len(body)) :]
    last = len(file.lines)
    rows = []
    for i in range(count):
        line, tokens = body[i] if i < len(body) else (last, [])
        numbers = [number(t) for t in tokens]
        need = max(columns.values())
        if len(numbers) < need or any(x is None for x in numbers[:need]):
            raise InputError(
                f"{file.at(line)}: NumAlf says {count} lines of {need} numbers, but line "
                f"{i + 1} of the polar is not one ({' '.join(tokens)[:40]!r})"
            )
        rows.append([float(x) for x in numbers[:need] if x is not None])
    if count < 3:
        raise InputError(f"{file.at(entry.line)}: NumAlf: a polar needs at least 3 lines")
    table = np.array(rows)

    polar = {which: table[:, place - 1] if place else np.zeros(count) for which, place in columns.items()}
    alpha = polar["alpha"] = np.radians(polar["alpha"])
    if np.any(np.diff(alpha) <= 0.0):
        i = int(np.flatnonzero(np.diff(alpha) <= 0.0)[0])
        raise InputError(f"{file.at(body[i + 1][0])}: angles of attack must increase from line to line")
    whole = abs(alpha[0] + math.pi) <= 1e-3 and abs(alpha[-1] - math.pi) <= 1e-3
    file.check_end(entry, count, body, len(columns), notes if whole else None)
    if not whole:
        raise InputError(
            f"{file.at(body[0][0])}: the polar must cover -180 to 180 degrees, but goes from "
            f"{math.degrees(alpha[0]):g} to {math.degrees(alpha[-1]):g}"
        )
    return polar
