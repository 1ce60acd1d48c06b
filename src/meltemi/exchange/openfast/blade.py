"""Blades: sections from ElastoDyn or BeamDyn, outer shape from AeroDyn."""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.columns import KEY_POINTS
from meltemi.exchange.openfast.text import Float, InputFile, number, read_input, split
from meltemi.exchange.openfast.tower import shapes
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

MATCHES, NEARLY = 2e-3, 2e-2
"""Differences of BeamDyn's from ElastoDyn's length of a blade, relative: that are rounding, and that are accepted."""


def read_elastodyn_blade(file: InputFile, length: float, notes: Notes) -> dict[str, Any]:
    """Read ElastoDyn section properties: a straight blade without torsion.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    values = Values(notes, file)
    entry = file.require(["NBlInpSt"], "number of stations")
    wanted = {
        "position": "BlFract",
        "twist": "StrcTwst",
        "mass": "BMassDen",
        "flap_stiffness": "FlpStff",
        "edge_stiffness": "EdgStff",
    }
    columns = file.table(entry, wanted, notes)
    tuning = "tuning of a mode: modes follow from the stiffness"
    values.differs("ignored", 1.0, flap_tuner=tuning, flap_tuner_2=tuning)
    values.use_other("flap_damping_2", "flap_damping", "all flap modes have that of the first")
    return {
        "position": columns["position"] * length,
        "twist": np.radians(columns["twist"]),
        "mass": columns["mass"] * values.given("mass_factor", 1.0),
        "flap_stiffness": columns["flap_stiffness"] * values.given("flap_factor", 1.0),
        "edge_stiffness": columns["edge_stiffness"] * values.given("edge_factor", 1.0),
        "damping": {"flap": values["flap_damping"], "edge": values["edge_damping"]},
        "mode_shapes": shapes(file, {"flap": ("BldFl1Sh", "BldFl2Sh"), "edge": ("BldEdgSh",)}),
    }


def add_torsion(structure: dict[str, Any], matrices: dict[str, Any], where: str, notes: Notes) -> None:
    """Add torsional stiffness and inertia from BeamDyn's sections, which ElastoDyn lacks."""
    z, K, M = matrices["position"], matrices["stiffness_matrix"], matrices["mass_matrix"]
    at = structure["position"]
    structure["torsion_stiffness"] = np.interp(at, z, K[:, 5, 5])
    structure["flap_inertia"] = np.interp(at, z, M[:, 4, 4])
    structure["edge_inertia"] = np.interp(at, z, M[:, 3, 3])
    torsion = matrices["damping_time"]["torsion"] if "damping_time" in matrices else 0.0
    # damping ratio equivalent to BeamDyn's damping time at the first torsional frequency of a uniform rod, (pi / 2 L)
    # sqrt(GJ / J)
    inner = (at >= 0.2 * at[-1]) & (at <= 0.9 * at[-1])
    J = structure["flap_inertia"] + structure["edge_inertia"]
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.sqrt(np.median((structure["torsion_stiffness"] / J)[inner]))
    ratio = 0.5 * torsion * 0.5 * np.pi / at[-1] * speed
    structure["damping"]["torsion"] = float(ratio) if np.isfinite(ratio) and ratio < 1.0 else 0.0
    notes.add("approximated", where, "GJ, rotary inertia, damping of torsion", "ElastoDyn has no torsion: from BeamDyn")


def read_beamdyn(file: InputFile, length: float, notes: Notes) -> dict[str, Any]:
    """Read a BeamDyn blade: curved axis and 6 x 6 section matrices.

    BeamDyn's section axes are those of meltemi: x towards the suction side, y towards the trailing edge, z along the
    axis. Its stations are fractions of the length of the axis.

    Raises:
      InputError: the file is not valid; the message has file and line.
      UnsupportedError: several members.
    """
    values = Values(notes, file)
    if values.given("members", 1) != 1:
        raise UnsupportedError(f"{file.path}: blades of {values['members']} members are not read, only of one")
    wanted = {"x": "kp_xr", "y": "kp_yr", "z": "kp_zr", "twist": "initial_twist"}
    keys = file.placed(file.require(["kp_total"], "number of key points"), KEY_POINTS, wanted, notes, skip=1)
    if len(keys["z"]) < 3:
        raise InputError(f"{file.path}: at least 3 key points are needed")
    z = keys["z"]
    off = abs(z[-1] / length - 1.0)
    if MATCHES < off < NEARLY:
        what = f"kp_zr ends at {z[-1]:g} m"
        why = f"stretched to ElastoDyn's length of the blade, {length:g} m"
        notes.add("warning", file.path.name, what, why)
    if abs(z[0]) > 1e-6 or np.any(np.diff(z) <= 0.0) or off > NEARLY:
        raise InputError(
            f"{file.path}: kp_zr must increase from 0 to the blade's length of {length:g} m, but goes from {z[0]:g} to "
            f"{z[-1]:g} m"
        )
    path = values.file(file, "blade_file")
    assert path is not None
    eta, K, M, damping = _sections(read_input(path, "BeamDyn blade"), notes)
    x, y, twist = keys["x"], keys["y"], np.radians(keys["twist"])
    arc = np.concatenate([[0.0], np.cumsum(np.sqrt(np.diff(x) ** 2 + np.diff(y) ** 2 + np.diff(z) ** 2))])
    at = np.interp(eta, arc / arc[-1], z) * (length / z[-1])
    structure: dict[str, Any] = {
        "position": at,
        "twist": np.interp(at, z, twist),
        "stiffness_matrix": K,
        "mass_matrix": M,
    }
    if np.any(x) or np.any(y):
        structure["axis_x"], structure["axis_y"] = np.interp(at, z, x), np.interp(at, z, y)
    return structure | damping


def _sections(file: InputFile, notes: Notes) -> tuple[Float, Float, Float, dict[str, Any]]:
    """Relative stations, stiffness (S, 6, 6), mass (S, 6, 6), and structural damping."""
    values = Values(notes, file)
    entry = file.require(["station_total"], "number of stations")
    count = file.count(entry)
    times: list[float] | None = None
    blocks: list[tuple[int, list[float]]] = []
    for i, line in enumerate(file.lines[entry.line :], entry.line + 1):
        numbers = [number(t) for t in split(line)]
        numbers_only = [x for x in numbers if x is not None]
        if len(numbers_only) != len(numbers) or not numbers_only:
            continue
        if len(numbers_only) == 6 and times is None and not blocks:
            times = numbers_only
        else:
            blocks.append((i, numbers_only))
    widths = [1] + [6] * 12
    for station in range(count):
        part = blocks[13 * station : 13 * (station + 1)]
        if [len(row) for _, row in part] != widths:
            odd = (n for (n, row), width in zip(part, widths, strict=False) if len(row) != width)
            bad = next(odd, len(file.lines))
            raise InputError(
                f"{file.at(bad)}: station {station + 1} of {count} (station_total, line {entry.line}) should be its "
                "share of the length, then 6 lines of 6 numbers of stiffness, then 6 of mass"
            )
    end = 13 * count
    if end < len(blocks) and len(blocks[end][1]) == 1:
        raise InputError(
            f"{file.at(blocks[end][0])}: station_total in line {entry.line} says {count} stations, but they go on"
        )
    share = np.array([row[0] for _, row in blocks[:end:13]])
    if count < 2 or abs(share[0]) > 1e-6 or abs(share[-1] - 1.0) > 1e-6 or np.any(np.diff(share) <= 0.0):
        raise InputError(f"{file.path}: the stations must increase from 0 to 1")
    stiffness, mass = (
        np.array([[row for _, row in blocks[k : k + 6]] for k in range(first, end, 13)]) for first in (1, 7)
    )
    # a massless or rotary-inertia-free section would make the mass matrix singular
    floor = 1e-9 * np.abs(mass).max()
    for i in (3, 4, 5):
        mass[:, i, i] = np.maximum(mass[:, i, i], floor)
    symmetric = [0.5 * (A + A.transpose(0, 2, 1)) for A in (stiffness, mass)]
    worst = max(np.abs(A - B).max() / np.abs(A).max() for A, B in zip((stiffness, mass), symmetric, strict=True))
    if worst > 1e-3:
        raise InputError(f"{file.path}: the section matrices are not symmetric")
    notes.add("used", f"{file.path.name}:{entry.line}", f"6 x 6 matrices at {count} stations", "blade.structure")
    damping: dict[str, Any] = {"damping": {}}
    if values["damping"] == 1 and times is not None:
        why = "bending and torsion; mu1 to mu3 have no mode"
        notes.add("approximated", file.path.name, f"mu1 to mu6 = {times}", why)
        damping = {"damping_time": {"flap": times[4], "edge": times[3], "torsion": times[5]}}
    ratios = values.given("modal_damping", [])
    if values["damping"] == 2 and ratios:
        flap, edge = ratios[0], ratios[min(1, len(ratios) - 1)]
        values.note(
            "approximated", "modal_damping", f"flap modes {flap:g}, edge modes {edge:g}, torsion {ratios[-1]:g}"
        )
        damping = {"damping": {"flap": flap, "edge": edge, "torsion": ratios[-1]}}
    elif "modal_damping" in values.source:
        values.unneeded("of damp_type 2", "modal_damping")
    return share, symmetric[0], symmetric[1], damping


def _cant(columns: dict[str, Float]) -> Float:
    """(S,) [deg] slope of the line of mid-chords, which AeroDyn uses without BlCrvAng (``setCantAngle``)."""
    middle = columns["centre_x"] + 0.25 * columns["chord"] * np.sin(np.radians(columns["twist"]))
    return np.degrees(np.arctan(np.gradient(middle, columns["position"], edge_order=2)))


def read_aerodyn_blade(file: InputFile, names: list[str], notes: Notes) -> dict[str, Any]:
    """Read the outer shape of an AeroDyn blade.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    Values(notes, file)
    entry = file.require(["NumBlNds"], "number of stations")
    wanted = {"position": "BlSpn", "chord": "BlChord", "twist": "BlTwist", "airfoil": "BlAFID"}
    offsets = {"centre_x": "BlCrvAC", "centre_y": "BlSwpAC", "cant": "BlCrvAng"}
    columns: dict[str, Any] = dict(file.table(entry, wanted | offsets, notes, optional=("cant",)))
    if "cant" not in columns and len(columns["position"]) > 2:
        columns["cant"] = _cant(columns)
        notes.add("used", file.path.name, "no BlCrvAng", "cant: that of the mid-chord line, as in AeroDyn")
    ids = columns["airfoil"]
    if len(wrong := np.flatnonzero((ids != np.round(ids)) | (ids < 1) | (ids > len(names)))):
        i = int(wrong[0])
        raise InputError(f"{file.path}: BlAFID of station {i + 1} is {ids[i]:g}; there are airfoils 1 to {len(names)}")
    columns["airfoil"] = tuple(names[int(i) - 1] for i in ids)
    columns["twist"] = np.radians(columns["twist"])
    for name in offsets:
        if name in columns and not np.any(columns[name]):
            del columns[name]
    if "cant" in columns:
        columns["cant"] = np.radians(columns["cant"])
    what = f"chord, twist, airfoils, offsets, cant at {len(ids)} stations"
    notes.add("used", f"{file.path.name}:{entry.line}", what, "blade.aerodynamics")
    return columns
