"""OLAF's input file as options of a vortex wake.

OLAF, the vortex wake of AeroDyn, reads by line, whatever the keywords are (``FVW_ReadInputFile`` in FVW_IO.f90); blank
lines do not count here. Of its layouts the one is taken whose headings and values are where the file has them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.keywords import ROWS
from meltemi.exchange.openfast.text import WORDS, InputFile, KeywordLine, key, number, read_input, split
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Kind
from meltemi.simulation.options import VortexOptions
from meltemi.turbine.definition import Turbine

T = TypeVar("T")
LAYOUT = (
    "- - - IntMethod DTfvw FreeWakeStart FullCircStart - CircSolvMethod CircSolvConvCrit CircSolvRelaxation "
    "CircSolvMaxIter PrescribedCircFile - - - nNWPanels nNWPanelsFree nFWPanels nFWPanelsFree FWShedVorticity - "
    "DiffusionMethod RegDeterMethod RegFunction WakeRegMethod WakeRegFactor WingRegFactor CoreSpreadEddyVisc - "
    "TwrShadowOnWake ShearModel - VelocityMethod TreeBranchFactor PartPerSegment - - WrVTK nVTKBlades VTKCoord VTK_fps"
)
"""Lines of OpenFAST 3.4 to 5.0; a dash is a heading. Grids of outputs and options without a fixed line follow."""
LAYOUTS = (
    LAYOUT,
    LAYOUT.replace("nNWPanelsFree ", ""),
    LAYOUT.replace("RegFunction", "RegFunction RegFunctionPart"),
)
"""Also those of OpenFAST 2.5 to 3.3, and after 5.0."""
WITHOUT_FORM = ("PrescribedCircFile", "VTK_fps")
"""Values that may be any word."""
CORES = {0: "none", 1: "rankine", 2: "lamb_oseen", 3: "vatistas", 4: "offset"}
"""Cores of ``RegFunction``."""
VATISTAS = 3
METRES, OPTIMIZED, CHORD, WIDTH = range(4)
"""Measures of core radii (``RegDeterMethod``)."""
OPTIMIZED_CORE, OPTIMIZED_VISCOSITY = 2.0, 1000.0
"""Core radius over the mean width of an element, and eddy viscosity, of ``RegDeterMethod`` 1."""
DEFAULT_VISCOSITY = 100.0


def read_olaf(file: InputFile, values: Values) -> Values:
    """Read the values of OLAF's input file by line, with a note on each.

    Args:
      file: the file without its entries, which its lines give.
      values: those of AeroDyn, whose notes are continued.

    Raises:
      InputError: a line is missing, or its value is not of the expected kind.
    """
    body = [(i, split(line)) for i, line in enumerate(file.lines, 1) if line.strip() or i == 2]

    def misfits(layout: Sequence[str]) -> list[int]:
        both = enumerate(zip(layout, body, strict=False))
        return [k for k, (name, (_, words)) in both if name not in WITHOUT_FORM and (name != "-") != _is_value(words)]

    layout = min((names.split() for names in LAYOUTS), key=lambda names: len(misfits(names)))
    if wrong := [k for k in misfits(layout) if layout[k] != "-"]:
        line = body[wrong[0]][0]
        raise InputError(
            f"{file.at(line)}: expected the value of {layout[wrong[0]]}, which OLAF of OpenFAST 2.5 and newer reads in "
            f"this line, found {file.lines[line - 1].strip()[:40]!r}"
        )
    if missing := [name for name in layout[len(body) :] if name != "-"]:
        raise InputError(f"{file.at(len(file.lines))}: the file ends before the line of {missing[0]} of OLAF's input")
    known = {key(name): name for row in ROWS["OLAF"] for name in row.names}
    lines = [(name, *at) for name, at in zip(layout, body, strict=False) if name != "-"]
    for name, line, words in lines:
        other = next((known[key(w)] for w in words[1:3] if key(w) in known and key(w) != key(name)), None)
        if other is not None:
            why = f"read as {name}: OLAF reads by line; is one missing, or one too many?"
            values.notes.add("warning", file.place(line), f"the line has the keyword {other}", why)
    lines += _rest(file, body[len(layout) :], known, values)
    entries = {key(name): [KeywordLine(name, (words[0].strip("\"'"),), line)] for name, line, words in lines}
    return Values(values.notes, replace(file, entries=entries))


def _is_value(words: Sequence[str]) -> bool:
    """Whether a line begins with a number, True, False, "default" or a text in quotes."""
    word = words[0] if words else ""
    return word[:1] in {'"', "'"} or number(word) is not None or word.strip(".").lower() in WORDS - {""}


def _rest(
    file: InputFile, body: Sequence[tuple[int, list[str]]], known: dict[str, str], values: Values
) -> list[tuple[str, int, list[str]]]:
    """Lines below the fixed ones: number of grids, which are skipped, and options by keyword."""
    if not body or not _is_value(body[0][1]):  # OpenFAST 2.5 has no grids yet
        return []
    lines = [("nGridOut", *body[0])]
    for line, words in body[5 + max(int(number(body[0][1][0]) or 0), 0) :]:
        if words[0][0] in "!=#-":
            continue
        name = next((known[key(word)] for word in words[1:] if key(word) in known), None)
        if name is not None:
            lines.append((name, line, words))
        else:
            values.notes.add("not needed", file.place(line), " ".join(words)[:60], "not a keyword of OLAF")
    return lines


class _Settings:
    """Options of the vortices, with the values of OLAF's file that they follow from."""

    def __init__(self, file: InputFile, values: Values) -> None:
        self.v, self.folder = read_olaf(file, values), file.path.parent
        self.vortices: dict[str, Any] = {"shed": 0.0}

    def place(self, target: str) -> str:
        """File, line, keyword and value, for errors."""
        return f"{self.folder / self.v.source[target]} = {self.v[target]}"

    def require(self, holds: bool, target: str, expected: str) -> None:
        """Raise an error unless a value is as expected."""
        if not holds:
            raise InputError(f"{self.place(target)}: expected {expected}")

    def choice(self, target: str, kinds: Mapping[int, T], default: int) -> T:
        """What a number selects."""
        n = self.v.given(target, default)
        self.require(n in kinds, target, f"one of {', '.join(map(str, kinds))}")
        return kinds[n]

    def put(self, name: str, value: float, target: str, why: str, kind: Kind = "used") -> None:
        """Set an option within its limits, with a note on the value that it follows from."""
        nearest = value
        for limit in VortexOptions.model_fields[name].metadata:
            nearest = min(max(nearest, getattr(limit, "ge", -math.inf)), getattr(limit, "le", math.inf))
        if nearest != value:
            kind, why = "approximated", f"{why}; this is the nearest to {value:.4g} that is possible"
        self.vortices[name] = nearest
        if target in self.v.source:
            self.v.note(kind, target, f"options.vortices.{name} {nearest:.4g}{why}")


def vortex_wake(aero: InputFile, values: Values, deck: Values, turbine: Turbine) -> dict[str, Any]:
    """Options of a model with the vortex wake of the file that AeroDyn's names.

    The wake of OLAF has a row of panels for each of its steps; here their number is in revolutions at the initial rotor
    speed, or at rated speed if the deck begins at a standstill. Shed vorticity counts from the first row on, as there.

    Args:
      aero, values: AeroDyn's file and its values.
      deck: values of the other files.
      turbine: turbine of the deck.

    Raises:
      InputError: the file is not valid, with file, line, keyword and what was expected.
      UnsupportedError: the circulation does not follow from the polars.
    """
    path = values.file(aero, "olaf")
    if path is None:
        raise InputError(f"{aero.path}: Wake_Mod is 3, but OLAFInputFileName names no file")
    settings = _Settings(read_input(path, "OLAF"), values)
    v, vortices = settings.v, settings.vortices
    method = {1: "", 2: "circulation without flow through the blade", 3: "a prescribed circulation"}
    if refused := settings.choice("circulation", method, 1):
        raise UnsupportedError(
            f"{settings.place('circulation')}: {refused} is not modelled; momentum_wake=True (--momentum-wake) uses "
            "momentum theory instead"
        )
    stated = aero.find("DTAero")
    shortest = (number(stated.values[0]) if stated else None) or deck.given("time_step", 0.0)
    step = v.given("wake_step", shortest)
    settings.require(step > 0.0 and step > 0.999999 * shortest, "wake_step", f"AeroDyn's step, {shortest:g} s, or more")
    _extent(settings, step, deck, turbine)
    _cores(settings, turbine)
    vortices["ground"] = settings.choice("ground", {0: False, 1: True}, 0)
    for target in ("core", "ground"):
        if target in v.source:
            v.note("used", target, f"options.vortices.{target} {vortices[target]}")
    return {"wake": "free" if v.given("induction", True) else "none", "vortices": vortices}


def _extent(settings: _Settings, step: float, deck: Values, turbine: Turbine) -> None:
    """Set azimuth step and ages of the parts of the wake, from a step [s] and numbers of panels."""
    v, require, put = settings.v, settings.require, settings.put
    near, far = v["near_panels"], v.given("far_panels", 0)
    near_free, far_free = v.given("near_free", near), v.given("far_free", far)
    require(near >= 1, "near_panels", "1 or more")
    require(far >= 0, "far_panels", "0 or more")
    require(0 <= near_free <= near, "near_free", f"from 0 to nNWPanels, {near}")
    require(0 <= far_free <= far, "far_free", f"from 0 to nFWPanels, {far}")
    require(near_free == near or far_free == 0, "near_free", f"nNWPanels, {near}, or nFWPanelsFree 0")
    speed, named = deck.given("rotor_speed", 0.0), "RotSpeed"
    if not speed > 0.0:
        speed, named = turbine.rated_rotor_speed, "rated speed"
    turn = step * speed / (2.0 * math.pi)
    put("azimuth_step", step * speed, "wake_step", f" rad at {named}, {speed * 30.0 / math.pi:.4g} rpm")
    put("lattice", min(VortexOptions().lattice, near * turn), "near_panels", "")
    coarser = f" revolutions with nFWPanels; the rows are coarser beyond lattice, {settings.vortices['lattice']:.4g}"
    put("length", (near + far) * turn, "near_panels", coarser, "approximated")
    if far:
        v.note("approximated", "far_panels", "the end of options.vortices.length, with two vortices a blade")
    never = v.given("free_start", 0.0) >= deck.given("duration", 60.0)
    free = 0.0 if never else (near_free + far_free) * turn
    beyond = " revolutions; beyond, the wake moves with the velocity at their end"
    part: Kind = "approximated" if near_free < near else "used"
    put("free", min(free, settings.vortices["length"]), "near_free", beyond, part)
    if never:
        v.note("approximated", "free_start", "options.vortices.free 0; OLAF's wake moves with the wind alone")
    elif v.given("free_start", 0.0) > 0.0:
        v.note("ignored", "free_start", "the wake is developed and free from the start")


def _cores(settings: _Settings, turbine: Turbine) -> None:
    """Set the kind, the radii and the growth of the cores."""
    v, blade = settings.v, turbine.blade.aerodynamics
    measure = settings.choice("measure", {n: n for n in (METRES, OPTIMIZED, CHORD, WIDTH)}, METRES)
    optimized = measure == OPTIMIZED
    growing = settings.choice("growth", {1: False, 3: True}, 3 if "near_free" in v.source else 1) or optimized
    width, chord = float(np.diff(blade.position).mean()), float(np.mean(blade.chord))
    over_width = {METRES: 1.0 / width, OPTIMIZED: 1.0, CHORD: chord / width, WIDTH: 1.0}[measure]
    how = "" if measure == WIDTH else f" over the mean width of the elements, {width:.4g} m"
    how += f", from the mean chord, {chord:.4g} m" if measure == CHORD else ""
    alike = measure == WIDTH and v["wake_factor"] == v["wing_factor"]
    of_blades = "" if alike else "; OLAF's is that of the blades' vortices and the first row"
    for name, target, why in (("wake_core", "wake_factor", how), ("blade_core", "wing_factor", how + of_blades)):
        settings.require(v[target] >= 0.0, target, "0 or more")
        factor = OPTIMIZED_CORE if optimized else v[target]
        settings.put(name, factor * over_width, target, why, "used" if alike else "approximated")
    settings.vortices["core"] = "vatistas" if optimized else settings.choice("core", CORES, VATISTAS)
    viscosity = OPTIMIZED_VISCOSITY if optimized else v.given("viscosity", DEFAULT_VISCOSITY)
    settings.require(viscosity >= 0.0, "viscosity", "0 or more")
    constant = "" if growing else ", as WakeRegMethod 1 keeps the cores"
    settings.put("eddy_viscosity", viscosity if growing else 0.0, "viscosity", constant)
