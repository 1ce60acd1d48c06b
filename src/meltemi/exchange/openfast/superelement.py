"""Superelements of ExtPtfm: matrices of a substructure reduced to its interface with the tower and internal modes.

Formats: Guyan and FlexASCII of OpenFAST 2 to 4, and that of OpenFAST 5 (ExtPtfm_MCKF_IO.f90 of 3.5.3 and 5.0.0). In
all of them a title stands before the rows of each matrix.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import scipy.linalg

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.frame import moved, reference, transition_piece
from meltemi.exchange.openfast.text import Float, InputFile, number, read_input, split
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

TITLE = re.compile(r"[^\w.+]*\s*(MASS|STIFF|DAMP|LOAD|FORC|WEIGHT)", re.IGNORECASE)
MATRICES = {"MASS": "mass", "STIFF": "stiffness", "DAMP": "damping"}


def read_superelement(main: InputFile, v: Values, notes: Notes) -> dict[str, Any]:
    """Read a superelement as ``foundation``: its Guyan matrices, with the transition piece, about the tower's base.

    Args:
      v: values of the main file and ElastoDyn, whose platform is the transition piece.

    Raises:
      InputError: a file is not valid; the message has file and line.
      UnsupportedError: the substructure floats, or stands in the water of HydroDyn.
    """
    path = v.file(main, "sub")
    if path is None:
        raise InputError(f"{main.path}: CompSub is 2, but SubFile names no file")
    file = read_input(path, "ExtPtfm")
    own = Values(notes, file)
    for target in ("rigid", "connections"):
        if own.given(target, 0):
            raise UnsupportedError(f"{path.parent / own.source[target]}: a superelement that floats or has moorings")
    if v.given("comp_hydro", 0):
        raise UnsupportedError(
            f"{main.path.parent / v.source['comp_hydro']} 1: a superelement in the water of HydroDyn"
        )
    source = own.file(file, "matrices")
    assert source is not None, "kind 'file' in the table makes sure of it"
    matrices, loads = _matrices(read_input(source, "superelement"))
    base = np.array([0.0, 0.0, v["tower.base_height"]])
    arm = reference(v) - base
    content: dict[str, Any] = {name: moved(x[:6, :6], arm) for name, x in matrices.items()}
    if piece := transition_piece(v, "foundation.mass"):
        mass, (xx, yy, zz, xy, xz, yz), centre = piece[0], piece[1:7], np.array(piece[7:])
        body = scipy.linalg.block_diag(mass * np.eye(3), [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        content["mass"] = content["mass"] + moved(body, centre - base)
    n = len(matrices["stiffness"])
    if n > 6:
        inner = np.linalg.eigvals(np.linalg.solve(matrices["mass"][6:, 6:], matrices["stiffness"][6:, 6:]))
        lowest = math.sqrt(float(np.abs(inner).min())) / math.tau
        why = f"left out: the lowest has {lowest:.3g} Hz with the interface held; static deflections are exact"
        notes.add("approximated", source.name, f"{n - 6} internal modes", why)
    if loads or own.given("forcing", False):
        why = "loads over time on interface and modes, among them those of waves and weight, do not act here"
        notes.add("warning", source.name, "loads of the superelement", why)
    for target in ("forcing", "connection_forcing"):
        own.differs("ignored", False, **{target: "see the warning about loads"})
    return {"foundation": content | {"source": source.name}}


def _matrices(file: InputFile) -> tuple[dict[str, Float], bool]:
    """Mass, stiffness and damping (n, n), n at least 6, and whether there are loads other than zero.

    Raises:
      InputError: a matrix is missing or malformed.
    """
    rows: dict[str, list[tuple[int, list[float | None]]]] = {}
    kind = ""
    for i, line in enumerate(file.lines, 1):
        words = split(line)
        if (title := TITLE.match(line)) is not None:
            kind = title[1].upper()
            rows.setdefault(kind, [])
        elif kind and words and number(words[0]) is not None:
            rows[kind].append((i, [number(word) for word in words]))
    content: dict[str, Float] = {}
    for kind, name in MATRICES.items():
        table = rows.get(kind, [])
        n = len(table[0][1]) if table else 0
        bad = next((i for i, row in table[:n] if len(row) != n or None in row), 0)
        if n < 6 or bad or len(table) < n:
            where = file.at(bad or (table[0][0] if table else 0))
            raise InputError(f"{where}: expected a {name} matrix of 6 rows and columns or more below its title")
        content[name] = np.array([row for _, row in table[:n]], dtype=np.float64)
    if len({x.shape for x in content.values()}) > 1:
        raise InputError(f"{file.path}: mass, stiffness and damping are of different sizes")
    loads = (row[1:] for kind in ("LOAD", "FORC") for _, row in rows.get(kind, []))
    weight = (row for _, row in rows.get("WEIGHT", []))
    return content, any(x for each in (loads, weight) for row in each for x in row)
