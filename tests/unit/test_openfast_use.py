"""What the report of a deck calls used is used: one keyword or column at a time is changed, and the import changes."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_of_use import differences

import meltemi
from meltemi.core.errors import MeltemiError
from meltemi.exchange.openfast import airfoils, blade, deck, mass_dampers, tower, water
from meltemi.exchange.openfast.keywords import row_of
from meltemi.exchange.openfast.mooring import LAYOUTS, SECTIONS
from meltemi.exchange.openfast.text import InputFile, number, read_input, split
from meltemi.io import Deck, read_deck, write_openfast

READERS = (airfoils, blade, deck, mass_dampers, tower, water)
STATIC = meltemi.ModelOptions(stall="static", inflow="quasi_steady")
PAIR = {"PCMode", "VSContrl"}
"""One of them suffices for a controller library."""
SEA = {
    "WaveMod": 2, "WaveHs": 4.0, "WaveTp": 9.0, "WaveDir": 20.0, "WaveNDAmp": True, "WavePkShp": 2.0,
    "WaveDirMod": 1, "WaveDirSpread": 2.0, "WaveNDir": 5, "WaveDirRange": 60.0, "WvLowCOff": 0.1, "WvHiCOff": 3.0,
    "ConstWaveMod": 1, "CrestHmax": 7.0, "CrestTime": 30.0,
    "CurrMod": 1, "CurrSSV0": 0.5, "CurrSSDir": 10.0, "CurrNSV0": 0.3, "CurrNSRef": 15.0, "CurrDIV": 0.1,
}  # fmt: skip
"""Irregular waves from several directions around a crest, with a current of all parts."""


@dataclass
class Case:
    """A deck in a folder of its own, of which one file at a time is changed.

    Attributes:
      main: the main file.
      how: arguments of ``read_deck``.
      cells: places of the columns that were read from the tables of a file, with their lines.
    """

    main: Path
    how: dict[str, Any] = field(default_factory=dict)
    cells: dict[tuple[Path, str, int], set[int]] = field(default_factory=dict)

    def read(self) -> Deck:
        return read_deck(self.main, **self.how)

    def put(self, name: str, **values: object) -> Case:
        """With other values of keywords in a file."""
        file = self.main.with_name(name)
        text = file.read_text()
        for keyword, value in values.items():
            text, count = re.subn(rf"(?m)^ *\S+( +){keyword}(?=\s)", rf"{value}\1{keyword}", text)
            assert count == 1, keyword
        file.write_text(text)
        return self

    def changes(self, before: Deck, file: Path, lines: list[str]) -> bool:
        """Whether the deck is read otherwise, or refused, with other lines in a file."""
        text = file.read_text()
        file.write_text("\n".join(lines) + "\n")
        try:
            return bool(differences(before, self.read()))
        except MeltemiError:
            return True
        finally:
            file.write_text(text)


def others(word: str) -> list[str]:
    """Other values of the same kind; 5 of a switch is a controller library."""
    value, bare = number(word), word.strip("\"'").lower()
    if value is None:
        return [{"true": "False", "false": "True", "t": "F", "f": "T"}.get(bare, '"other"')]
    if re.fullmatch(r"[-+]?\d+", word):
        return [str(int(value) + 1), str(int(value) - 1), "5"]
    return [repr(1.001 * value if value else 1e-3), repr(0.999 * value if value else -1e-3)]


def moved(lines: list[str], rows: list[int], place: int) -> list[str]:
    """Lines with other values in a column, each a little more different: a shift of all joints is none."""
    changed = lines.copy()
    for k, i in enumerate(rows, 1):
        words = split(lines[i])
        value = number(words[place])
        if value is None or words[place].isdigit():
            words[place] = others(words[place])[0]
        else:
            words[place] = repr((1.0 + 1e-3 * k) * value if value else 0.02 * k)
        changed[i] = " ".join(words)
    return changed


@pytest.fixture(scope="module")
def cases(openfast_deck: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Case]:
    """Cases by name, made when they are first asked for."""
    made: dict[str, Case] = {}

    def case(name: str) -> Case:
        if name not in made:
            made[name] = _made(name, openfast_deck, tmp_path_factory.mktemp(name) / "deck")
        return made[name]

    return case


def _made(name: str, openfast_deck: Path, folder: Path) -> Case:
    if name in ("land", "beamdyn"):
        shutil.copytree(openfast_deck, folder)
        case = Case(folder / "5MW.fst", {"blade": "beamdyn"} if name == "beamdyn" else {})
        case.main.write_text(case.main.read_text().replace("NRELOffshrBsline5MW_BeamDyn.dat", "BeamDyn.dat"))
        beamdyn = folder / "BeamDyn.dat"
        beamdyn.write_text(re.sub(r'"[^"]*BeamDyn_Blade.dat"', '"BeamDyn_Blade.dat"', beamdyn.read_text()))
        return case
    turbine: Any = meltemi.load_turbine({"pile": "nrel5mw-monopile", "floater": "nrel5mw-spar"}[name])
    if name == "pile":
        turbine = turbine.replace(**{"support.diameter": np.linspace(6.5, 6.0, len(turbine.support.diameter)).tolist()})
    else:
        bottom, *more = (member.content() for member in turbine.platform.members)
        turbine = turbine.replace(**{"platform.members": [bottom | {"plate_drag": 0.6}, *more]})
    written = write_openfast(turbine, folder, options=STATIC, time_step=0.01, duration=60.0)
    case = Case(written.main, {"control_of": turbine}).put("SeaState.dat", **SEA)
    if name == "pile":  # its damping takes a model: see test_openfast_sea_writer
        case.put("SubDyn.dat", GuyanDampMod=0).put("ElastoDyn.dat", PtfmMass=1e5, PtfmRIner=1e6, PtfmPIner=1e6)
    return case


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, cases: Callable[[str], Case]) -> Callable[[str], Case]:
    """Cases whose unchanged files are parsed once, and that record the cells that are read."""
    parsed: dict[Any, Any] = {}

    def read_once(path: Path, module: str) -> InputFile:
        found = (str(path), module, Path(path).read_bytes())
        if found not in parsed:
            parsed[found] = read_input(path, module)
        file: InputFile = parsed[found]
        return file

    def polars_once(paths: list[Path], columns: dict[str, int], mode: int, notes: list[Any]) -> airfoils.Polars:
        found = repr((columns, mode)), *(path.read_bytes() for path in paths)
        if found not in parsed:
            parsed[found] = airfoils.read_airfoils(paths, columns, mode, notes)
        polars: airfoils.Polars = parsed[found]
        return polars

    for module in READERS:
        if hasattr(module, "read_input"):
            monkeypatch.setattr(module, "read_input", read_once)
    monkeypatch.setattr(deck, "read_airfoils", polars_once)
    cell = InputFile._cell

    def spy(self: InputFile, line: int, tokens: list[str], place: int, name: str) -> float:
        at.cells.setdefault((self.path, name, place), set()).add(line)
        return cell(self, line, tokens, place, name)

    at = Case(Path())

    def case(name: str) -> Case:
        nonlocal at
        at = cases(name)
        monkeypatch.setattr(InputFile, "_cell", spy)
        return at

    return case


FILES = {
    "land": {
        "5MW.fst": "main", "ElastoDyn.dat": "ElastoDyn", "ElastoDyn_blade.dat": "ElastoDyn blade",
        "ElastoDyn_tower.dat": "ElastoDyn tower", "AeroDyn.dat": "AeroDyn", "AeroDyn_blade.dat": "AeroDyn blade",
        "ServoDyn.dat": "ServoDyn", "InflowWind.dat": "InflowWind", "DISCON.IN": "DISCON",
    },
    "beamdyn": {"BeamDyn.dat": "BeamDyn", "BeamDyn_Blade.dat": "BeamDyn blade"},
    "pile": {
        "nrel5mw-monopile.fst": "main", "ElastoDyn.dat": "ElastoDyn", "SubDyn.dat": "SubDyn",
        "HydroDyn.dat": "HydroDyn", "SeaState.dat": "SeaState", "ServoDyn.dat": "ServoDyn",
    },
    "floater": {
        "nrel5mw-spar.fst": "main", "ElastoDyn.dat": "ElastoDyn", "HydroDyn.dat": "HydroDyn",
        "SeaState.dat": "SeaState",
    },
}  # fmt: skip


NEITHER = (
    *("MSpinOrient", "MDivSize", "MHstLMod", "SimplCb"),  # round members by pieces of their own length
    *(f"Simpl{c}{side}" for c in ("Cd", "Ca") for side in "AB"),  # rectangles
)
NOT_NEEDED = {
    # geometry is that of SubDyn, upright ends have no pressure
    "pile": (
        *("MemberID", "MJointID1", "MJointID2", "MPropSetID1", "MPropSetID2"),
        *("Jointzi", "PropD", "PropThck", "SimplCp", *NEITHER),
    ),
    # inertia is that of potential flow, coefficients are those by member, there is no ballast
    "floater": (
        *("MemberCa1", "MemberCa2", "MemberCp1", "MemberCp2", "MemberCb1", "MemberCb2", "AxCa", "AxCp"),
        *("SimplCd", "SimplCa", "SimplCp", "PropThck", *NEITHER),
    ),
}
"""Columns of HydroDyn that are read and that these decks, without growth (MG), do not need."""


def tables(cells: dict[tuple[Path, str, int], set[int]]) -> list[tuple[tuple[Path, str, int], list[int]]]:
    """Columns, each in one table: lines that follow each other."""
    found: list[tuple[tuple[Path, str, int], list[int]]] = []
    for key, lines in cells.items():
        for line in sorted(lines):
            if found and found[-1][0] == key and found[-1][1][-1] == line - 1:
                found[-1][1].append(line)
            else:
                found.append((key, [line]))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("name", "file"), [(name, file) for name, files in FILES.items() for file in files])
def test_what_a_deck_calls_used_is_used(quick: Callable[[str], Case], name: str, file: str) -> None:
    """By itself, with another value; what is ignored or not needed changes nothing, all of it at once."""
    case, module = quick(name), FILES[name][file]
    case.cells.clear()
    before = case.read()
    cells = {key: set(lines) for key, lines in case.cells.items() if key[0].name == file}
    path = next(each for each in case.main.parent.rglob(file))
    lines, idle, missed, used = path.read_text().splitlines(), path.read_text().splitlines(), [], 0
    kinds = {note.where: note.kind for note in before.notes if " = " in note.what}
    for entries in read_input(path, module).entries.values():
        entry, row = entries[0], row_of(module, entries[0].name)
        kind, at = kinds.get(f"{file}:{entry.line}"), entry.line - 1
        words = split(lines[at])
        if row is None or kind is None or words[0].strip("\"'").lower() == "default" or entry.name in PAIR:
            continue
        if kind in ("ignored", "not needed") and not row.same:
            idle[at] = " ".join([others(words[0])[0], *words[1:]])
        if kind != "used":
            continue
        used += 1
        for place in range(len(entry.values) if row.kind == "list" else 1):
            tried = ([*words[:place], word, *words[place + 1 :]] for word in others(words[place]))
            if not any(case.changes(before, path, [*lines[:at], " ".join(t), *lines[at + 1 :]]) for t in tried):
                missed.append(f"{entry.name} {place}")
                break
    for (_, column, place), rows in tables(cells):
        if module == "HydroDyn" and (column in NOT_NEEDED[name] or "MG" in column):
            continue
        used += 1
        if not case.changes(before, path, moved(lines, [line - 1 for line in rows], place)):
            missed.append(f"column {column}")
    assert not missed and used
    assert idle == lines or not case.changes(before, path, idle)


@pytest.mark.slow
@pytest.mark.parametrize("table", ["types", "points", "lines"])
def test_every_column_of_moordyn_is_used(quick: Callable[[str], Case], table: str) -> None:
    """Those that are ignored have a note: EI, and mass, volume and drag of a point on the platform; lines by order."""
    case = quick("floater")
    before, path = case.read(), case.main.with_name("MoorDyn.dat")
    lines = path.read_text().splitlines()
    kept = {"types": ["EI"], "points": ["M", "V", "CdA", "Ca"], "lines": ["ID"]}[table]
    title = next(i for i, line in enumerate(lines) if "---" in line and any(w in line for w in SECTIONS[table]))
    rows = [i for i in range(title + 3, len(lines)) if not any("---" in line for line in lines[title + 1 : i + 1])]
    names = [word.split("|")[0] for word in LAYOUTS["MoorDyn 2"][table].split()]
    assert len(rows) > 0
    for place, name in enumerate(names):
        assert case.changes(before, path, moved(lines, rows, place)) == (name not in kept), name


@pytest.mark.slow
@pytest.mark.parametrize("which", ["stiffness", "mass"])
def test_every_entry_of_the_matrices_of_beamdyn_is_used(quick: Callable[[str], Case], which: str) -> None:
    """At one station, with the one opposite: they are symmetric."""
    case = quick("beamdyn")
    before, path = case.read(), case.main.with_name("BeamDyn_Blade.dat")
    lines = path.read_text().splitlines()
    top = next(i for i, line in enumerate(lines) if len(split(line)) == 1 and number(split(line)[0]) == 0.0)
    block = top + 1 + 6 * (which == "mass")
    while not split(lines[block]):
        block += 1
    largest = max(abs(number(word) or 0.0) for word in split(lines[block]))
    for a in range(6):
        for b in range(a, 6):
            changed = lines.copy()
            for i, j in {(a, b), (b, a)}:
                words = split(changed[block + i])
                words[j] = repr((number(words[j]) or 0.0) + 1e-4 * largest)
                changed[block + i] = " ".join(words)
            assert case.changes(before, path, changed), (a, b)
