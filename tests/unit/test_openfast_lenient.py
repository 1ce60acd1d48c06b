"""What OpenFAST accepts beside the usual form: included files, rows after tables, comments and blank lines."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

import meltemi
from meltemi import InputError
from meltemi.exchange.openfast.text import read_input


@pytest.fixture
def folder(openfast_deck: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(openfast_deck, tmp_path / "deck"))


def read(folder: Path) -> meltemi.io.Deck:
    return meltemi.io.read_deck(folder / "5MW.fst")


def table_at(lines: list[str], keyword: str) -> tuple[int, int]:
    """First and last line (from 0) of the table after a keyword, whose rows begin with a number."""
    at = next(i for i, line in enumerate(lines) if keyword in line)
    count = int(lines[at].split()[0])
    begin = next(i for i in range(at + 1, len(lines)) if re.match(r"\s*[-\d.]+\S*\s+[-\d.]", lines[i]))
    return begin, begin + count - 1


@pytest.mark.parametrize("form", ["@rows.txt", '  @ "rows.txt" ! rows', "@2-{end} in rows.txt", "@2 IN 'rows.txt'"])
def test_included_files(folder: Path, form: str) -> None:
    """``ReadComFile``, ``ParseInclInfo`` of NWTC_IO.f90; lines of the range count from 1."""
    before = read(folder)
    path = folder / "AeroDyn_blade.dat"
    lines = path.read_text().splitlines()
    begin, last = table_at(lines, "NumBlNds")
    rows = lines[begin : last + 1]
    head = ["! first"] if form.startswith("@2") else []
    tail = ["1 2 3 is not read"] if "{end}" in form else []
    (folder / "rows.txt").write_text("\n".join([*head, *rows, *tail]))
    path.write_text("\n".join([*lines[:begin], form.format(end=1 + len(rows)), *lines[last + 1 :]]))
    assert read(folder).turbine == before.turbine


def test_messages_name_the_included_file(folder: Path) -> None:
    path = folder / "AeroDyn.dat"
    line = next(line for line in path.read_text().splitlines() if "AirDens" in line)
    path.write_text(path.read_text().replace(line, "@air.txt"))
    (folder / "air.txt").write_text(f"! of the site\n{line}\n")
    assert any(note.where == "air.txt:2" for note in read(folder).notes)
    (folder / "air.txt").write_text(f"! of the site\nheavy {line.strip().split(maxsplit=1)[1]}\n")
    with pytest.raises(InputError, match=r"air\.txt:2: AirDens: expected a number"):
        read(folder)
    (folder / "air.txt").write_text("@AeroDyn.dat\n")
    with pytest.raises(InputError, match=r"air\.txt:1: AeroDyn\.dat cannot be included here"):
        read(folder)
    (folder / "air.txt").unlink()
    with pytest.raises(InputError, match=r"AeroDyn\.dat:\d+: the file does not exist: .*air\.txt"):
        read(folder)


def test_the_main_file_includes_nothing(folder: Path) -> None:
    """It is read line by line (``ReadVar``), where ``@`` has no meaning."""
    (folder / "rows.txt").write_text("1 CompElast\n")
    path = folder / "5MW.fst"
    path.write_text(path.read_text() + "@rows.txt\n")
    assert "rows.txt" in read_input(path, "main").lines[-1]


@pytest.mark.parametrize("name", ["AeroDyn_blade.dat", "Airfoils/DU21_A17.dat"])
def test_rows_after_a_table_that_ends_a_file(folder: Path, name: str) -> None:
    before = read(folder)
    path = folder / name
    keyword = "NumBlNds" if "blade" in name else "NumAlf"
    lines = path.read_text().rstrip().splitlines()
    last = table_at(lines, keyword)[1]
    path.write_text("\n".join([*lines[: last + 1], lines[last], "", "! old", lines[last]]))
    found = read(folder)
    assert found.turbine == before.turbine
    (note,) = [note for note in found.noted("warning") if keyword in note.what]
    assert note.where == f"{path.name}:{last + 2}" and note.what.startswith("2 lines beyond")
    path.write_text("\n".join([*lines[: last + 1], lines[last], "1.0  Another  - keyword"]))
    with pytest.raises(InputError, match=rf"{keyword}.* says .*goes on"):
        read(folder)


def test_blank_lines_and_comments(folder: Path) -> None:
    """``ProcessComFile`` drops them wherever they stand: between rows of a polar, and names of airfoil files."""
    before = read(folder)
    path = folder / "Airfoils/DU21_A17.dat"
    lines = path.read_text().splitlines()
    begin = table_at(lines, "NumAlf")[0]
    path.write_text("\n".join([*lines[: begin + 2], "", "# measured", "% from here", *lines[begin + 2 :]]))
    path = folder / "AeroDyn.dat"
    lines = path.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if "AFNames" in line)
    path.write_text("\n".join([*lines[: first + 1], "! thick ones", "", *lines[first + 1 :]]))
    assert read(folder).turbine == before.turbine
