"""The compiler layer: its stub, and the page on what a new version of Numba can break."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path

from meltemi import compiler
from meltemi.namespaces import declared

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "src" / "meltemi" / "compiler").glob("*.py"))
PAGE = (ROOT / "docs" / "development" / "numba.md").read_text(encoding="utf-8")
ROWS = [line.split("|")[1:5] for line in PAGE.splitlines() if line.startswith("| `")]
DOCUMENTED = ("numba", "numba.extending", "numba.types", "llvmlite", "llvmlite.ir", "llvmlite.binding")
"""Modules of Numba and llvmlite that are not internals."""


def names(text: str) -> set[str]:
    return set(re.findall(r"`([^`]+)`", text))


LISTED = set[str]().union(*(names(row[0]) for row in ROWS))


def test_the_stub_has_each_name_where_it_is_and_no_module_hides_one() -> None:
    for name, (module, there) in declared("meltemi.compiler").items():
        assert getattr(compiler, name) is getattr(import_module(module), there), name
    assert not {path.stem for path in FILES} & set(declared("meltemi.compiler"))


def test_each_name_of_the_stub_is_used_outside() -> None:
    used = set[str]()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module == "meltemi.compiler":
                used.update(alias.name for alias in node.names)
    assert set(declared("meltemi.compiler")) <= used


def test_internals_of_numba_that_are_imported_are_those_of_the_page() -> None:
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not str(node.module).startswith(("numba.", "llvmlite.")):
                continue
            found = {alias.name for alias in node.names} - {"types"}
            assert node.module in DOCUMENTED or found <= LISTED, (path.name, node.module, found - LISTED)


def test_what_the_page_lists_is_there() -> None:
    sources = "\n".join(path.read_text(encoding="utf-8") for path in FILES)
    gone = [name for name in LISTED if not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", sources)]
    assert not gone
    files = set[str]().union(*(names(row[1]) for row in ROWS))
    assert files <= {path.name for path in FILES}


def test_the_tests_of_the_page_run_with_the_oldest_numba() -> None:
    (command,) = re.findall(r"pytest .* tests/unit/test_\{(.*)\}\.py", PAGE)
    (oldest,) = re.findall(r"tests/unit/test_\{(.*)\}\.py", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    assert oldest == command
    tests = {f"test_{name}.py" for name in command.split(",")}
    assert set[str]().union(*(names(row[3]) for row in ROWS)) <= tests
    assert all((ROOT / "tests" / "unit" / name).is_file() for name in tests)
