"""Tower from ElastoDyn and AeroDyn, monopile from SubDyn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import Float, InputFile, KeywordLine, number, read_input
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.openfast.water import DeckWater
from meltemi.exchange.pile import pile_foundation
from meltemi.exchange.report import Notes
from meltemi.turbine.definition import Foundation

STEEL_SPEED = math.sqrt(210e9 / 8500.0)
"""[m/s] speed of sound along a steel bar, with paint, bolts and flanges in its density (TP-500-38060)."""
SHEAR_SHARE = 0.53
"""Share of the area of a thin tube that carries shear (Cowper 1966 for a Poisson ratio of 0.3)."""

ADJUSTED = ("AdjTwMa", "AdjFASt", "AdjSSSt")
"""Keywords of the lines that stand before the table of the tower's sections."""
LUMP = (*(f"centre_{axis}" for axis in "xyz"), *(f"inertia_{axis}" for axis in "RPY"))
"""Centre and inertia of the platform's mass in ElastoDyn, which here is that of a transition piece."""
SPRINGS = ("x", "y", "z", "tx", "ty", "tz")
"""Directions in the names of SubDyn's springs: Kxx, Kxty and so on."""


def read_tower(file: InputFile, values: Values, notes: Notes) -> dict[str, Any]:
    """Read the ElastoDyn tower, except its diameter.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    v = Values(notes, file)
    entry = file.require(["NTwInpSt"], "number of stations")
    wanted = {
        "position": "HtFract",
        "mass": "TMassDen",
        "fore_aft_stiffness": "TwFAStif",
        "side_side_stiffness": "TwSSStif",
    }
    below = max((e.line for e in map(file.find, ADJUSTED) if e is not None), default=entry.line)
    sections = file.placed(entry, columns.TOWER, wanted, notes, after=below, skip=1)
    length = values["tower_top"] - values["tower.base_height"]
    if not length > 0.0:
        raise InputError(f"{values.source['tower_top']}: TowerHt must be above TowerBsHt")
    position = sections["position"] * length
    for axis, what in (("fore_aft", "fore-aft"), ("side_side", "side-to-side")):
        for target, mode in ((f"{axis}_tuner", 1), (f"{axis}_tuner_2", 2)):
            why = f"tuning of {what} mode {mode}: modes follow from the stiffness"
            v.differs("ignored", 1.0, **{target: why})
        first = f"{axis}_damping"
        v.use_other(f"{first}_2", first, f"both modes have that of the first, {v[first]:g}")
    return {
        "position": position,
        "mass": sections["mass"] * v.given("mass_factor", 1.0),
        "fore_aft_stiffness": sections["fore_aft_stiffness"] * v.given("fore_aft_factor", 1.0),
        "side_side_stiffness": sections["side_side_stiffness"] * v.given("side_side_factor", 1.0),
        "damping": {"fore_aft": v["fore_aft_damping"], "side_side": v["side_side_damping"]},
        "mode_shapes": shapes(file, {"fore_aft": ("TwFAM1Sh", "TwFAM2Sh"), "side_side": ("TwSSM1Sh", "TwSSM2Sh")}),
        "base_height": values["tower.base_height"],
        "source": file.path.name,
    }


def shapes(file: InputFile, wanted: dict[str, tuple[str, ...]]) -> dict[str, Any] | None:
    """Mode shape coefficients, if the file contains all of them."""
    coefficients: dict[str, Any] = {}
    for kind, modes in wanted.items():
        polynomials = []
        for mode in modes:
            entries = [file.find(f"{mode}({power})") for power in range(2, 7)]
            if any(entry is None for entry in entries):
                return None
            polynomials.append(tuple(_coefficient(file, entry) for entry in entries if entry is not None))
        coefficients[kind] = tuple(polynomials)
    return coefficients


def _coefficient(file: InputFile, entry: KeywordLine) -> float:
    value = number(entry.values[0])
    if value is None:
        raise InputError(f"{file.at(entry.line)}: {entry.name}: expected a number, found {entry.values[0]!r}")
    return value


def add_diameter(tower: dict[str, Any], aero: InputFile, values: Values, notes: Notes) -> None:
    """Add tower diameter and drag from the AeroDyn file, or estimate the diameter from stiffness over mass.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    entry = aero.find("NumTwrNds")
    count = aero.count(entry) if entry is not None else 0
    if entry is not None and count >= 2:
        wanted = {"height": "TwrElev", "diameter": "TwrDiam", "drag": "TwrCd"}
        table = aero.placed(entry, columns.TOWER_AIR, wanted, notes)
        height = tower["position"] + tower["base_height"]
        tower["diameter"] = np.interp(height, table["height"], table["diameter"])
        drag = tower["drag_coefficient"] = float(np.mean(table["drag"]))
        if np.ptp(table["drag"]) > 1e-9:
            why = f"the mean, {drag:.3g}, everywhere"
            notes.add("approximated", f"{aero.path.name}:{entry.line}", "TwrCd", why)
        notes.add("used", f"{aero.path.name}:{entry.line}", f"tower, {count} stations", "tower.diameter, interpolated")
        return
    # a thin tube has EI / m = (E / rho) d^2 / 8
    tower["diameter"] = np.sqrt(8.0 * (tower["fore_aft_stiffness"] / tower["mass"])) / STEEL_SPEED
    why = "steel tube with the stiffness over mass given"
    notes.add("approximated", aero.path.name, "tower without diameters", why)


def _joints_and_members(file: InputFile, notes: Notes) -> tuple[dict[str, Float], dict[str, Float]]:
    wanted = {"x": "JointXss", "y": "JointYss", "z": "JointZss", "id": "JointID"}
    joints = _subdyn(file, "NJoints", columns.SUB_JOINTS, wanted, notes)
    wanted = {"a": "MJointID1", "b": "MJointID2", "first": "MPropSetID1", "second": "MPropSetID2"}
    return joints, _subdyn(file, "NMembers", columns.SUB_MEMBERS, wanted, notes)


def is_pile(file: InputFile, notes: Notes) -> bool:
    """Whether a structure of SubDyn is one upright pile on the ground; otherwise it is a frame.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    joints, members = _joints_and_members(file, notes)
    order = np.argsort(joints["z"], kind="stable")
    off = np.hypot(*(joints[axis] - joints[axis][order[0]] for axis in "xy"))
    one = len(members["a"]) == len(off) - 1 and bool(np.all(np.diff(joints["z"][order]) > 0.0))
    return one and float(off.max()) <= 0.01 and file.count(file.require(["NReact"], "of lines")) > 0


def _stations(file: InputFile, notes: Notes) -> dict[str, Float]:
    """Height [m] and section of an upright pile at both ends of each member, from bottom to top: z, d, t, E, G,
    density.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    joints, members = _joints_and_members(file, notes)
    wanted = {"d": "XsecD", "t": "XsecT", "id": "PropSetID", "E": "YoungE", "G": "ShearG", "density": "MatDens"}
    sets = _subdyn(file, "NPropSets", columns.SUB_SECTIONS, wanted, notes)
    joint_height = {int(j): float(z) for j, z in zip(joints["id"], joints["z"], strict=True)}
    which = {int(i): k for k, i in enumerate(sets["id"])}
    stations: list[tuple[float, int]] = []
    for a, b, first, second in zip(members["a"], members["b"], members["first"], members["second"], strict=True):
        for joint, prop in ((a, first), (b, second)):
            if int(joint) not in joint_height or int(prop) not in which:
                raise InputError(
                    f"{file.path}: a member names joint {int(joint)} or property set {int(prop)}; it is not defined"
                )
            stations.append((joint_height[int(joint)], which[int(prop)]))
    stations.sort()
    k = np.array([s[1] for s in stations])
    stations_by_name = {name: values[k] for name, values in sets.items() if name != "id"}
    if np.any(2.0 * stations_by_name["t"] > stations_by_name["d"]):
        raise InputError(f"{file.path}: a wall thickness XsecT is more than half of its diameter XsecD")
    return {"z": np.array([s[0] for s in stations])} | stations_by_name


def _subdyn(file: InputFile, count: str, layout: str, wanted: dict[str, str], notes: Notes) -> dict[str, Float]:
    return file.placed(file.require([count, f"{count}Cyl"], "a number of lines"), layout, wanted, notes)


def read_pile(file: InputFile, notes: Notes) -> Foundation:
    """Read an upright pile of SubDyn as equivalent springs at the tower base.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    v = Values(notes, file)
    _note_pile_ends(v)
    v.differs("ignored", 0, guyan_damping="springs have no damping", lumped_masses="see foundation.mass")
    v.unneeded("of GuyanDampMod 1", "rayleigh")
    name, at = file.path.name, _stations(file, notes)
    z = at["z"] + 1e-6 * np.arange(len(at["z"]))  # adjacent members have two values at their joint
    d, E, G = at["d"], at["E"], at["G"]
    inner = d - 2.0 * at["t"]
    area, second_moment = 0.25 * math.pi * (d**2 - inner**2), math.pi / 64.0 * (d**4 - inner**4)
    pile = pile_foundation(
        z,
        E * second_moment,
        SHEAR_SHARE * G * area,
        E * area,
        2.0 * G * second_moment,
        at["density"] * area,
        source=f"{name}: pile from {z[0]:g} to {z[-1]:g} m, clamped at its foot",
    )
    notes.add("approximated", name, f"pile of {len(z) // 2} members", "springs and a mass at its top")
    return pile


def _note_pile_ends(v: Values) -> None:
    """Notes on the ends of a pile."""
    for target, why in (
        ("reactions", "the pile is held at its lowest joint"),
        ("interfaces", "the tower base is the highest joint"),
    ):
        v.note("equivalent" if v[target] == 1 else "approximated", target, why)


def read_support(file: InputFile, v: Values, water: DeckWater, notes: Notes) -> dict[str, Any]:
    """Read an upright pile of SubDyn that stands in the water of HydroDyn, as keys of ``Support``.

    An additional key is ``rayleigh``: factors [1/s] of mass and [s] of stiffness, instead of a damping ratio.

    Raises:
      UnsupportedError: the pile is not of one material, or its water is not modelled.
      InputError: the file is not valid; the message has file and line.
    """
    subdyn = Values(notes, file)
    _note_pile_ends(subdyn)
    at = _stations(file, notes)
    for name, what in (("E", "YoungE"), ("G", "ShearG"), ("density", "MatDens")):
        if np.ptp(at[name]) > 1e-6 * at[name][0]:
            raise UnsupportedError(f"{file.path}: {what} differs between property sets; a pile is of one material")
    z, d, t = at["z"].copy(), at["d"], at["t"]
    keep = [0]
    for i in range(1, len(z)):
        same = d[i] == d[keep[-1]] and t[i] == t[keep[-1]]
        if z[i] <= z[keep[-1]]:  # adjacent members have two values at their joint, which a steep cone joins
            if same:
                continue
            z[i] = z[keep[-1]] + 1e-3
        if len(keep) > 1 and same and d[i] == d[keep[-2]] and t[i] == t[keep[-2]]:
            keep[-1] = i
        else:
            keep.append(i)
    support: dict[str, Any] = {"position": z[keep], "diameter": d[keep], "thickness": t[keep], "source": file.path.name}
    support |= {"elastic_modulus": at["E"][0], "shear_modulus": at["G"][0], "density": at["density"][0]}
    masses: list[tuple[float, ...]] = []
    if subdyn.given("lumped_masses", 0):
        wanted = {"id": "CMJointID", "m": "JMass", "x": "JMXX", "z": "JMZZ"}
        lumps = _subdyn(file, "NCmass", columns.SUB_MASSES, wanted, notes)
        joints = _subdyn(file, "NJoints", columns.SUB_JOINTS, {"id": "JointID", "z": "JointZss"}, notes)
        heights = dict(zip(joints["id"], joints["z"], strict=True))
        masses = [(heights.get(joint, z[0]), *subdyn) for joint, *subdyn in zip(*lumps.values(), strict=True)]
    about = v.given("platform_inertia_R", 0.0)
    masses.append((z[-1], v.given("platform_mass", 0.0), about, 2.0 * about))
    support["masses"] = [
        {"height": h, "mass": m, "inertia": max(x, 0.0)} | ({} if twist == 2.0 * x else {"yaw_inertia": twist})
        for h, m, x, twist in masses
        if m > 0.0 and h > z[0] + 0.5
    ]
    if subdyn.given("guyan_damping", 0) == 1:
        support["rayleigh"] = subdyn.given("rayleigh", [])
        if len(support["rayleigh"]) != 2:
            raise InputError(f"{file.path}: RayleighDamp: expected factors of mass and stiffness, as GuyanDampMod is 1")
    else:
        subdyn.unneeded("of GuyanDampMod 1", "rayleigh")
        subdyn.differs("ignored", 0, guyan_damping="the pile has the damping of the tower's modes; see support.damping")
    if not v.given("platform_mass", 0.0):
        v.unneeded("of PtfmMass", *(f"platform_{name}" for name in LUMP))
    else:
        top = v.given("platform_centre_z", z[-1])
        why = f"the mass is at the top of the pile, {z[-1]:g} m"
        v.note("equivalent" if abs(top - z[-1]) < 1e-6 else "approximated", "platform_centre_z", why)
        v.use_other("platform_inertia_P", "platform_inertia_R", "that of PtfmRIner")
        axis = "the mass is on the axis of the pile"
        v.differs("ignored", 0.0, platform_centre_x=axis, platform_centre_y=axis)
        v.differs("ignored", 0.0, platform_inertia_Y="about the pile's axis")
    return support | water.hydrodynamics(z[keep])


def read_pile_in_water(file: InputFile, values: Values, water: DeckWater, notes: Notes) -> dict[str, Any]:
    """Read an upright pile of SubDyn: ``support`` in water, otherwise ``foundation``."""
    if water.file is None:
        lump = "the pile is springs and the mass of its steel"
        values.differs("ignored", 0.0, **{f"platform_{name}": lump for name in ("mass", *LUMP)})
        return {"foundation": read_pile(file, notes)}
    content = {"support": read_support(file, values, water, notes)}
    foot = file.find("NReact")
    line, row = file.rows(foot, 1)[1][0] if foot is not None and file.count(foot) else (0, [])
    fixed = sum(number(word) == 1.0 for word in row[1:7])
    ground = file.file(row[7], line) if len(row) > 7 and fixed == 0 else None
    if ground is None:
        if row and fixed < 6:
            why = "the foot of the pile is clamped; springs of an SSI file need all six directions free"
            notes.add("warning", f"{file.path.name}:{line}", f"{fixed} of 6 directions are fixed", why)
        return content
    notes.add("used", ground.name, "springs and mass under the pile", "foundation")
    return content | {"foundation": springs(read_input(ground, "SSI"))}


def springs(file: InputFile) -> dict[str, Any]:
    """Springs and mass at the foot of a pile or frame, from the upper triangles in SubDyn's file."""
    content: dict[str, Any] = {"source": file.path.name}
    for letter, kind in (("K", "stiffness"), ("M", "mass")):
        value = np.zeros((6, 6))
        for i, j in zip(*np.triu_indices(6), strict=True):
            if (entry := file.find(f"{letter}{SPRINGS[i]}{SPRINGS[j]}")) is not None:
                value[i, j] = value[j, i] = _coefficient(file, entry)
        content[kind] = value
    return content
