"""Commands of texts and messages for installing something work without a package index that knows meltemi."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

from meltemi.core import extras
from meltemi.core.extras import BY_NAME, REQUIREMENTS

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
    stated = {requirement for group in PROJECT["optional-dependencies"].values() for requirement in group}
    assert set(REQUIREMENTS) <= stated
    for name in ("control", "windIO", "rosco"):
        assert any(f'"{BY_NAME[name]}"' in path.read_text(encoding="utf-8") for path in TEXTS if path.suffix == ".md")


def test_packages_that_are_needed_can_be_named() -> None:
    calls = [
        call
        for path in (ROOT / "src").rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "need"
    ]
    names = {a.value for call in calls for a in call.args[1:] if isinstance(a, ast.Constant)}
    assert names >= {"pettingzoo", "gymnasium"}
    assert names <= set(BY_NAME)


OPTIONAL = set(
    "capytaine control distributed docx fmpy gymnasium neuralfoil numba_cuda openpyxl pandas pettingzoo pyarrow "
    "pythonfmu pythonfmu3 rosco sklearn websockets windIO xarray".split()
)
"""Names under which optional packages are imported."""


def test_modules_are_imported_without_optional_packages() -> None:
    """Those are imported where they are used, or after ``need``, whose words a user then reads."""
    for path in (ROOT / "src").rglob("*.py"):
        for line in ast.parse(path.read_text(encoding="utf-8")).body:
            if ast.unparse(line).startswith("need("):
                break
            names = [alias.name for alias in line.names] if isinstance(line, ast.Import) else []
            names += [line.module or ""] if isinstance(line, ast.ImportFrom) else []
            assert not {name.partition(".")[0] for name in names} & OPTIONAL, path


def test_only_one_module_says_how_to_install_a_package() -> None:
    for path in (p for p in (ROOT / "src").rglob("*.py") if p.name not in ("extras.py", "docs.py")):
        text = path.read_text(encoding="utf-8")
        assert not re.findall(r"except (?:ImportError|PackageNotFoundError).*\n.*raise InputError", text), path


def test_missing_packages_are_named_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    assert extras.missing(("numpy",)) == ""
    monkeypatch.setattr(extras, "installed", lambda name: name == "pandas")
    assert extras.missing(("pandas", "pyarrow")) == "pyarrow, which is not installed: pip install 'pyarrow>=18'"
    assert extras.missing(("windIO", "pyarrow")) == (
        "windIO and pyarrow, which are not installed: pip install 'windIO>=2.1,<3' 'pyarrow>=18'"
    )
    assert "pip install --no-deps 'rosco" in extras.missing(("rosco",))
    with pytest.raises(extras.MissingPackageError, match="a thing needs windIO, which is not installed"):
        extras.need("a thing", "pandas", "windIO")
    assert extras.skipped({"one": ("pandas",), "two": ("windIO",)}) == {
        "two": "skipped: two: needs windIO, which is not installed: pip install 'windIO>=2.1,<3'"
    }


def test_texts_name_extras_that_exist() -> None:
    for path in TEXTS:
        for named in re.findall(r'pip install (?:-q )?(?:-e )?"?\.\[([a-z,]+)\]', path.read_text(encoding="utf-8")):
            assert set(named.split(",")) <= set(PROJECT["optional-dependencies"]), path
