"""What README, start pages and guides claim is what the package has: turbines, standards, versions, extras, formats."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
import typer

from meltemi.app.cli import app
from meltemi.floating.platform import Platform
from meltemi.loads.loadbase.table import AT_SEA, Standard
from meltemi.turbine.library import DATA, library_entries
from meltemi.wind_files.formats import FORMATS

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
GUIDES = {path.name for path in (ROOT / "docs" / "guide").glob("*.md")}
NUMBERS = "no one two three four five six seven eight nine ten".split()
RUN_NAMES = {"nrel5mw-electrical", "nrel5mw-ipc", "nrel5mw-supervised"}
"""Names of runs and cases in examples, which begin with that of a turbine."""


def text(page: str) -> str:
    """A page without line breaks inside of its sentences."""
    return " ".join((ROOT / page).read_text(encoding="utf-8").split())


def pages() -> Iterator[tuple[str, str]]:
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


def afloat_and_on_piles() -> tuple[set[str], set[str]]:
    """Library turbines with a platform, and with a support in the sea, by their files."""
    files = {name: (DATA / entry.file).read_text(encoding="utf-8") for name, entry in library_entries().items()}
    return tuple(  # type: ignore[return-value]
        {name for name, lines in files.items() if re.search(rf"^{key}:", lines, re.MULTILINE)}
        for key in ("platform", "support")
    )


def test_the_library_of_the_readme_is_that_of_the_package() -> None:
    """Every rated power, and the numbers of turbines on monopiles and floaters."""
    (sentence,) = re.findall(r"The library contains (.*?);", text("README.md"))
    stated = {float(power) for power in re.findall(r"(\d+)(?= MW| and \d+ MW)", sentence)}
    assert stated == {entry.rated_power / 1e6 for entry in library_entries().values()}
    afloat, piles = afloat_and_on_piles()
    assert f"{NUMBERS[len(piles)]} of them on monopiles and {NUMBERS[len(afloat)]} on floaters" in sentence


def test_turbines_at_sea_are_on_the_pages_that_list_them() -> None:
    afloat, piles = afloat_and_on_piles()
    table = text("docs/guide/floating.md").partition("Floating turbines of the library:")[2].partition("Periods are")[0]
    assert set(re.findall(r"\| `([\w-]+)` \|", table)) == afloat
    listed = re.findall(r"Library turbines are (.*?)\. ", text("docs/guide/sea.md"))[0]
    assert set(re.findall(r"`([\w-]+)`", listed)) == piles


def test_turbines_that_pages_name_are_in_the_library() -> None:
    name = r"(?<![\w/-])(?:nrel5mw|iea10mw|iea15mw|iea22mw|pmsg20mw|zr20|ct30)(?:-[a-z0-9]+)*(?![\w./-])"
    unknown = {
        (page, found)
        for page, content in pages()
        for found in re.findall(name, content)
        if found not in {*library_entries(), *RUN_NAMES}
    }
    assert not unknown


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/complaints.md", "docs/guide/load-base.md"])
def test_standards_are_those_of_load_bases(page: str) -> None:
    assert set(get_args(Standard)) == {"61400-1", *AT_SEA}
    named = set(re.findall(r"61400-\d(?:-\d)?", text(page))) - {"61400-15"}
    assert named >= set(get_args(Standard)), page


def test_versions_of_python() -> None:
    versions = sorted(
        int(found[1])
        for line in PROJECT["classifiers"]
        if (found := re.fullmatch(r"Programming Language :: Python :: 3\.(\d+)", line))
    )
    assert versions == list(range(versions[0], versions[-1] + 1))
    assert PROJECT["requires-python"] == f">=3.{versions[0]},<3.{versions[-1] + 1}"
    stated = f"Python 3.{versions[0]} to 3.{versions[-1]}"
    for page in ("README.md", "CHANGELOG.md", "docs/index.md", "docs/getting-started.md"):
        assert stated in text(page), page
        assert set(re.findall(r"Python 3\.\d+ to 3\.\d+", text(page))) == {stated}, page


def test_every_extra_has_a_row_in_getting_started() -> None:
    """By its name, or by what it installs."""
    rows = re.findall(r"^\| .* \| (.*pip install.*) \|$", (ROOT / "docs/getting-started.md").read_text("utf-8"), re.M)
    installed = "\n".join(rows)
    by_name = {name for group in re.findall(r'"\.\[([a-z,]+)\]"', installed) for name in group.split(",")}
    for extra, requirements in PROJECT["optional-dependencies"].items():
        assert extra in by_name or all(f'"{each}"' in installed for each in requirements), extra
    assert by_name <= set(PROJECT["optional-dependencies"])


@pytest.mark.parametrize("stated", sorted({page for page, content in pages() if 'pip install "' in content}))
def test_requirements_on_pages_are_those_of_the_extras(stated: str) -> None:
    known = {each for group in PROJECT["optional-dependencies"].values() for each in group}
    found = re.findall(r"pip install (?:--no-deps )?[\"']([A-Za-z]\w+[<>=][^\"']*)[\"']", text(stated))
    assert set(found) <= known


def subcommands(command: Any, name: str = "meltemi") -> Iterator[str]:
    if not hasattr(command, "list_commands"):
        yield name
        return
    context = command.context_class(command)
    for each in command.list_commands(context):
        yield from subcommands(command.get_command(context, each), f"{name} {each}")


def test_every_command_is_on_the_page_of_commands() -> None:
    page = text("docs/guide/command-line.md")
    missing = [name for name in subcommands(typer.main.get_command(app)) if not re.search(rf"`{name}\b(?!-)", page)]
    assert not missing


def test_every_guide_is_in_their_index() -> None:
    linked = set(re.findall(r"\(([\w-]+\.md)", (ROOT / "docs/guide/index.md").read_text(encoding="utf-8")))
    assert GUIDES - linked == {"index.md", "command-line.md"}  # which the reference has


def test_wind_files_of_the_readme_are_read_and_written() -> None:
    words = {"TurbSim": "bts", "Bladed": "bladed", "HAWC2": "hawc2", "netCDF": "netcdf", "uniform": "uniform"}
    (sentence,) = re.findall(r"([^;]*) wind files, read and written", text("README.md"))
    assert re.findall(r"[\w-]+(?=,| and|$)", sentence) == list(words)
    formats = {each.name: each for each in FORMATS}
    assert all(formats[name].reader and formats[name].writer for name in words.values())
    assert set(formats) - set(words.values()) == {"hub_csv"}  # no wind field


def test_complaints_are_as_many_as_stated() -> None:
    content = (ROOT / "docs/complaints.md").read_text(encoding="utf-8")
    numbers = [int(number) for number in re.findall(r"^(\d+)\. \*\*", content, re.MULTILINE)]
    assert numbers == list(range(1, 21))
    assert "Twenty complaints" in content and "twenty [common complaints]" in text("README.md")


def test_mooring_lines_move_by_default() -> None:
    assert Platform.model_fields["line_model"].default == "dynamic"
    for page in ("docs/guide/floating.md", "docs/limits.md"):
        assert re.search(r"(?:^|[^\w])(?:Mooring )?[Ll]ines\*{0,2} move", text(page)), page


DENIED = (
    r"no wind farms",
    r"no wakes here",
    r"no (?:floating|offshore) turbines",
    r"no load base of (?:a )?float",
    r"on ?shore only|only on ?shore|only on land|on land only",
    r"quasi-static (?:mooring )?lines (?:by default|only)",
    r"(?:lines|tensions) (?:are|is) (?:quasi-)?static by default",
    r"no HAWC2|HAWC2 models are not read",
)
"""Statements that something is missing which the package has."""


@pytest.mark.parametrize("denied", DENIED)
def test_nothing_that_exists_is_called_missing(denied: str) -> None:
    assert [page for page, content in pages() if re.search(denied, " ".join(content.split()))] == []
