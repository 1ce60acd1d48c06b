"""SeaState and HydroDyn of a deck: sea, hydrodynamics of a pile, platform in potential flow.

Decks before version 4 have the waves in HydroDyn. OpenFAST counts directions counter-clockwise; its seeds belong to
another random number generator.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.members import (
    COEFFICIENTS,
    Tables,
    displaced,
    fill_groups,
    hydro_members,
    hydro_table,
    read_members,
    with_ballast,
)
from meltemi.exchange.openfast.text import Float, InputFile, number, read_input, split
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

STRETCHINGS = ("none", "vertical", "extrapolation", "wheeler")
IRREGULAR = (
    *("height", "direction", "lowest", "highest", "repeat", "seed", "gaussian", "spread", "spread_exponent"),
    *("spread_directions", "spread_range", "crest", "crest_height", "crest_time"),
)
OF_WAVES = {
    "1": ("height", "period", "direction"),
    "2": (*IRREGULAR, "period", "peak_factor"),
    "3": IRREGULAR,
    "7": ("wave_file",),
}
"""Values that waves have, by the first letter of ``WaveMod``."""
POTENTIAL = ("potential_file", "volume", "buoyancy_x", "buoyancy_y", "excitation_place", "unit_length")
FULL_DRIFT = 12
"""WAMIT's file of difference-frequency forces that is read (.12d)."""


class DeckWater:
    """Sea and hydrodynamics of a deck.

    Attributes:
      v: values of SeaState and HydroDyn, with those of the main file where they say "default".
      file: HydroDyn file; None without.
      notes: notes of the import.
    """

    def __init__(self, main: InputFile, values: Values, notes: Notes) -> None:
        self.notes, self.v, self.file = notes, Values(notes), None
        path = values.file(main, "hydro_file") if values.given("comp_hydro", 0) else None
        sea = values.file(main, "sea_file") if values.given("comp_sea", 0) else None
        if path is not None:
            self.file = self.v.read(read_input(path, "HydroDyn"))
        self.sea_file = self.file if sea is None else read_input(sea, "SeaState")
        if self.sea_file is not None:
            self.v.read(replace(self.sea_file, module="SeaState"))
        for name in ("water_density", "depth", "level"):
            if self.v[name] is None:
                self.v.data[name] = values[name]
            else:
                values.unneeded(f"that of {self.v.source[name].split(':')[0]} is used", name)
        if sea is None:
            values.unneeded("of CompSeaSt 1", "sea_file")

    def sea(self) -> dict[str, Any]:
        """The ``sea`` of a case file."""
        v = self.v
        kind = str(v.given("waves", "0")).upper()
        sea: dict[str, Any] = {"kind": "still"}
        direction = v.given("direction", 0.0)
        if kind.startswith("1"):
            sea = {"kind": "regular", "height": v["height"], "period": v["period"], "direction": direction}
            if kind[1:2] == "P" and (phase := number(kind[2:])) is not None:
                sea["phase"] = float(np.radians((phase + 180.0) % 360.0 - 180.0))
        elif kind in ("2", "3"):
            sea = {"kind": "irregular", "height": v["height"], "direction": direction}
            sea |= {"spectrum": "jonswap", "period": v["period"]} if kind == "2" else {"spectrum": "white"}
            if kind == "2" and v["peak_factor"] is not None:
                sea["peak_factor"] = v["peak_factor"]
            if v["highest"]:
                sea["frequencies"] = [v.given("lowest", 0.0), v["highest"]]
            sea |= {"repeat": max(v.given("repeat", 3600.0), 10.1), "seed": abs(int(v.given("seed", 1)))}
            sea["amplitudes"] = "gaussian" if v.given("gaussian", True) else "random phase"
            v.note("approximated", "seed", "a sea of the same spectrum, from other random numbers")
            if v.given("spread", 0):
                directions = int(v.given("spread_directions", 25)) | 1  # OpenFAST uses an odd number
                if directions > 1 and v["spread_range"]:
                    spreading = {"exponent": v.given("spread_exponent", 1.0), "width": v["spread_range"]}
                    sea["spreading"] = spreading | {"directions": directions}
            if (crest := v.given("crest", 0)) in (1, 2):
                height = v["crest_height"] * (0.5 if crest == 1 else 1.0)
                of = "crest" if crest == 1 else "crest to trough"
                sea["crest"] = {"height": height, "of": of, "time": v.given("crest_time", 0.0)}
        elif kind == "7":
            sea = self._waves()
        elif kind != "0":
            v.note("ignored", "waves", "waves of files are not read; give the case a sea of kind components, elevation")
        every = {name: None for names in OF_WAVES.values() for name in names}
        v.unneeded("of waves of another WaveMod", *(n for n in every if n not in OF_WAVES.get(kind[:1], ())))
        if kind in ("2", "3"):
            self._unneeded_of_irregular(sea)
        sea["stretching"] = STRETCHINGS[v.given("stretching", 0) % 4]
        if v.given("level", 0.0):
            sea["level"] = v["level"]
        parts = ("sub_surface", "near_surface", "uniform")
        if v.given("current", 0) == 1:
            sea["current"] = self._current(direction, parts)
        else:
            v.unneeded("of CurrMod 1", *parts, *(f"{name}_direction" for name in parts), "reference_depth")
        if v.given("current", 0) not in (0, 1):
            v.note("ignored", "current", "the current of a user's routine; give the case a current")
        return sea

    def _unneeded_of_irregular(self, sea: dict[str, Any]) -> None:
        v = self.v
        if "frequencies" not in sea:
            v.unneeded("of WvHiCOff above 0", "lowest", "highest")
        if "spreading" not in sea:
            v.unneeded("of WaveDirMod 1 and several directions", "spread_exponent", "spread_directions", "spread_range")
        if "crest" not in sea:
            v.unneeded("of ConstWaveMod 1 and 2", "crest_height", "crest_time")

    def _waves(self) -> dict[str, Any]:
        """Single waves: frequency [rad/s], height [m], direction [deg], phase [deg], or the .SEA format."""
        path = self.sea_file.file(str(self.v["wave_file"]), 0) if self.sea_file is not None else None
        if path is None:
            raise InputError(f"{self.sea_file and self.sea_file.path}: WaveMod 7: WvKinFile names no file")
        lines = read_input(path, "waves").lines
        cells = [[number(word) for word in split(line)] for line in lines]
        rows = np.array([row for row in cells if len(row) == 4 and None not in row], dtype=np.float64).reshape(-1, 4)
        if not len(rows):
            raise InputError(f"{path}: expected lines of frequency, height, direction and phase, found none")
        if lines[0].startswith("source: SEAFileGenerator"):  # Hz, amplitude, rad, rad
            rows *= [2.0 * np.pi, 2.0, 180.0 / np.pi, 180.0 / np.pi]
        (w, height, direction), phase = rows.T[:3], np.radians((rows[:, 3] + 180.0) % 360.0 - 180.0)
        direction = -np.radians(direction) + 0.0
        if len(rows) == 1:
            sea = {"kind": "regular", "height": height[0], "period": 2.0 * np.pi / w[0], "phase": phase[0]}
            return sea | {"direction": direction[0]}
        one = float(direction[0]) if np.ptp(direction) == 0.0 else direction
        return {"kind": "components", "frequency": w, "amplitude": 0.5 * height, "phase": phase, "direction": one}

    def _current(self, waves: float, parts: tuple[str, ...]) -> dict[str, Any]:
        v = self.v
        flows = {name: v.given(f"{name}_direction", waves) for name in parts if v.given(name, 0.0)}
        current = {name: v[name] for name in flows}
        if "near_surface" in flows:
            current["reference_depth"] = v["reference_depth"]
        if flows:
            current["direction"] = next(iter(flows.values()))
        others = [name for name in parts if name not in list(flows)[:1]]
        v.unneeded("of a part without speed", *(f"{name}_direction" for name in others if name not in flows))
        if "near_surface" not in flows:
            v.unneeded("of CurrNSV0", "reference_depth")
        for name in list(flows)[1:]:
            differs = flows[name] != current["direction"]
            why = f"all parts flow along that of {next(iter(flows))}"
            v.note("approximated" if differs else "equivalent", f"{name}_direction", why)
        if len(set(flows.values())) > 1:
            v.note("approximated", "current", f"all parts flow along that of {next(iter(flows))}")
        return current

    def matrix(self, name: str) -> Float | None:
        """(6, 6) matrix of HydroDyn whose first line ends with a keyword; None if it is zero.

        Raises:
          InputError: its lines do not have six numbers.
        """
        assert self.file is not None
        entry = self.file.find(name)
        if entry is None:
            return None
        lines = self.file.lines[entry.line - 1 : entry.line + 5]
        rows = [[number(text) for text in split(line)[:6]] for line in lines]
        if len(rows) < 6 or any(len(row) < 6 or None in row for row in rows):
            raise InputError(f"{self.file.at(entry.line)}: {name}: expected six lines of six numbers (one body)")
        matrix, where = np.array(rows, dtype=np.float64), f"{self.file.path.name}:{entry.line}"
        self.notes[:] = [note for note in self.notes if note.where != where]
        self.notes.add("used" if matrix.any() else "equivalent", where, f"{name}, 6 x 6", "platform")
        return matrix if matrix.any() else None

    def table(self, count: str, layout: str, wanted: dict[str, str]) -> dict[str, Float]:
        """Columns of a table of HydroDyn."""
        assert self.file is not None
        return hydro_table(self.file, count, layout, wanted, self.notes)

    def hydrodynamics(self, height: Float) -> dict[str, Any]:
        """Hydrodynamic properties of a pile with stations at heights (S,) [m], as keys of ``Support``.

        Raises:
          InputError, UnsupportedError: inclined members, coefficients by member.
        """
        v, file = self.v, self.file
        content: dict[str, Any] = {"depth": v["depth"], "water_density": v.given("water_density", 1025.0)}
        if v["depth"] is None or file is None:
            raise InputError("WtrDpth: the depth of the water is needed, in the main file or in SeaState")
        v.unneeded("of PotMod 1", *POTENTIAL)
        v.unneeded("of a platform", "drift_cutoff", "axial")
        v.note("equivalent", "sections", "geometry is that of SubDyn")
        if v.given("potential", 0):
            raise UnsupportedError(f"{file.path}: PotMod {v['potential']}: a pile has Morison's equation; set it to 0")
        joints = self.table("NJoints", columns.HYDRO_JOINTS, {"x": "Jointxi", "y": "Jointyi"})
        if np.ptp(joints["x"]) > 0.01 or np.ptp(joints["y"]) > 0.01:
            raise UnsupportedError(
                f"{file.path}: Jointxi, Jointyi: joints that are not above each other; only upright monopiles are "
                "modelled; fixed_base=True (--fixed-base) clamps the tower base instead"
            )
        members = hydro_members(file, self.notes, round_ones=True)
        if (model := members[0].model) not in (1, 2):
            raise UnsupportedError(f"{file.path}: MCoefMod {model}: coefficients are read by depth or for all (2, 1)")
        given = Tables(file, self.notes, grown=False)
        rows = [given.of(members[0], 0.0, float(z)) for z in height]
        water = {k: np.array([row[k] for row in rows]) if model == 2 else rows[0][k] for k in COEFFICIENTS}
        if "diffraction" in rows[0] or v.given("diffraction_radius", 0.0) > 0.0:
            water["diffraction"] = "maccamy_fuchs"
        fills = fill_groups(file, members, self.notes)
        content |= {"hydrodynamics": water, "flooded": fills[0][2] if fills else None}
        if growth := self.growth():
            content["growth"] = growth
        return content

    def growth(self) -> list[dict[str, Any]]:
        """Layers of marine growth, from the lowest up."""
        if self.v.given("growth", 0) < 2:
            return []
        grown = self.table("NMGDepths", columns.GROWTH, {"z": "MGDpth", "t": "MGThck", "density": "MGDens"})
        z, t, density = (grown[name][np.argsort(grown["z"])] for name in ("z", "t", "density"))
        if np.ptp(t[t > 0.0]) > 0.0:
            self.v.note("approximated", "growth", "constant between two depths, with their mean thickness")
        return [
            {"bottom": a, "top": b, "thickness": thick, "density": d}
            for a, b, thick, d in zip(z[:-1], z[1:], *(0.5 * (x[1:] + x[:-1]) for x in (t, density)), strict=True)
            if thick > 0.0 and b - a > 0.01  # closer rows represent a step
        ]

    def platform(self, main: Values) -> dict[str, Any]:
        """A platform in potential flow, without its lines.

        Args:
          main: values of the main file and ElastoDyn.

        Raises:
          UnsupportedError: the platform has a named feature that is not supported.
        """
        v, file = self.v, self.file
        if file is None or v.given("potential", 0) not in (0, 1):
            raise UnsupportedError(f"{main.source.get('hydro_file', 'HydroFile')}: a platform needs PotMod 0 or 1")
        flows = v.given("potential", 0) == 1
        if not flows:
            v.unneeded("of PotMod 1", *POTENTIAL)
        v.differs("ignored", 0.0, diffraction_radius="diffraction of a platform's members is not modelled")
        wrong = {
            "bodies": v.given("bodies", 1) != 1,
            "unit_length": v.given("unit_length", 1.0) != 1.0,
            "difference_drift": v.given("difference_drift", 0) not in (0, FULL_DRIFT),
            "newman": v.given("newman", 0) not in (0, FULL_DRIFT),
            "mean_drift": v.given("mean_drift", 0) not in (0, FULL_DRIFT),
            "sum_forces": v.given("sum_forces", 0) not in (0, FULL_DRIFT),
        } | {f"reference_{a}": bool(v.given(f"reference_{a}", 0.0)) for a in ("x", "y", "z", "turn")}
        for target, bad in wrong.items():
            if bad and flows:
                raise UnsupportedError(
                    f"{file.path.parent / v.source[target]} {v[target]:g}: one body about the origin, of unit length "
                    "and with forces of second order from files .12d and .12s is read"
                )
        if v.given("excitation_place", 0) == 2:
            v.note("approximated", "excitation_place", "waves push where the platform is, without a low-pass filter")
        body = [main.given(f"platform_{name}", 0.0) for name in BODY]
        members: list[dict[str, Any]] = []
        if v.given("members", 0):
            members = read_members(file, v)
            body = with_ballast(body, file, v)
        drift = next((d for n, d in DRIFTS if v.given(n, 0) and flows), "none")
        volume, centre = v["volume"], (v.given("buoyancy_x", 0.0), v.given("buoyancy_y", 0.0))
        if not flows:
            volume, centre = displaced(members)
        root = str(v["potential_file"]).strip("\"'").replace("\\", "/")
        content: dict[str, Any] = {
            "depth": v["depth"],
            "mass": body[0],
            "centre": body[1:4],
            "inertia": body[4:],
            "members": members,
            "volume": volume,
            "buoyancy_centre": centre,
            "coefficients": str((file.path.parent / root).absolute()) if flows else "",
            "excitation": "displaced" if flows and v.given("excitation_place", 0) else "at_rest",
            "drift": drift,
            "sum_forces": flows and v.given("sum_forces", 0) == FULL_DRIFT,
            "water_density": v.given("water_density", 1025.0),
            "source": file.path.name,
        }
        if drift != "none" and v.given("drift_cutoff", 0.0) > 0.0:
            content["drift_cutoff"] = v["drift_cutoff"]
        else:
            v.unneeded("of forces of second order at difference frequencies", "drift_cutoff")
        for key, name in (("stiffness", "AddCLin"), ("linear_damping", "AddBLin"), ("quadratic_damping", "AddBQuad")):
            if flows and (value := self.matrix(name)) is not None:
                content[key] = value
        return content


BODY = ("mass", *(f"centre_{axis}" for axis in "xyz"), *(f"inertia_{axis}" for axis in "RPY"))
DRIFTS = (("difference_drift", "full"), ("newman", "newman"), ("mean_drift", "mean"))
