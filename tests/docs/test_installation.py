"""Commands of texts and messages for installing something work without a package index that knows meltemi."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
TEXTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *(ROOT / "docs").rglob("*.md"),
    *(p for p in (ROOT / "src").rglob("*") if p.suffix in (".py", ".md")),
]


def test_nothing_is_installed_from_an_index_by_our_name() -> None:
    for path in TEXTS:
        found = re.findall(r"(?:pip|pipx) (?:install|run)[^`\n]*[ \"']meltemi\\?\[.*", path.read_text(encoding="utf-8"))
        assert not found, f"{path}: {found}"


def test_versions_that_messages_name_are_those_of_the_extras() -> None:
    extras = {name: PROJECT["optional-dependencies"][name][0] for name in ("control", "windio", "rosco")}
    for name, file in {
        "control": "simulation/linear.py",
        "windio": "turbine/library.py",
        "rosco": "control/bladed/rosco.py",
    }.items():
        assert f"'{extras[name]}'" in (ROOT / "src" / "meltemi" / file).read_text(encoding="utf-8"), extras[name]
        assert any(f'"{extras[name]}"' in path.read_text(encoding="utf-8") for path in TEXTS if path.suffix == ".md")


def test_texts_name_extras_that_exist() -> None:
    for path in TEXTS:
        for named in re.findall(r'pip install (?:-q )?(?:-e )?"?\.\[([a-z,]+)\]', path.read_text(encoding="utf-8")):
            assert set(named.split(",")) <= set(PROJECT["optional-dependencies"]), path
