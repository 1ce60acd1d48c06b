"""The public interface: few names at the root, each declared once; no circles of imports, those of types included."""

from __future__ import annotations

import ast
import graphlib
import re
from importlib import import_module
from pathlib import Path

import pytest

import meltemi
from meltemi.namespaces import NAMESPACES, declared

ROOT = Path(__file__).parents[2]
GROUPS = ("commands", "parts", "rotors")
"""Of entry points."""
ALL = ("meltemi", *(f"meltemi.{name}" for name in NAMESPACES))


def test_the_root_has_what_a_first_week_needs() -> None:
    assert len(meltemi.__all__) <= 47
    assert set(NAMESPACES) <= set(meltemi.__all__)


@pytest.mark.parametrize("namespace", ALL)
def test_every_declared_name_is_there(namespace: str) -> None:
    home = import_module(namespace)
    assert dir(home) == sorted(declared(namespace)) == home.__all__
    for name, (module, there) in declared(namespace).items():
        assert getattr(home, name) is (getattr(import_module(module), there) if there else import_module(module)), name


def test_a_name_has_one_home_and_the_root_takes_its_names_from_there() -> None:
    homes: dict[str, str] = {}
    for namespace in ALL[1:]:
        for name in declared(namespace):
            assert homes.setdefault(name, namespace) == namespace or name in declared("meltemi"), name
    for name, (module, _) in declared("meltemi").items():
        if module in ALL[1:] and name not in NAMESPACES:
            assert name in declared(module), name


def test_no_name_of_a_namespace_is_hidden_by_a_module() -> None:
    """A module that is imported becomes an attribute of its package."""
    for namespace in ALL:
        folder = ROOT / "src" / Path(*namespace.split("."))
        modules = {path.stem for path in folder.glob("*")} - {"__init__"} if folder.is_dir() else set()
        assert not modules & ({*declared(namespace)} - {*NAMESPACES}), namespace


@pytest.mark.parametrize(
    ("namespace", "name", "words"),
    [
        ("meltemi", "etm", "it is meltemi.wind.etm"),
        ("meltemi.wind", "simulate", "it is meltemi.simulate"),
        ("meltemi.loads", "rainflow_cycle", "did you mean 'rainflow_cycles'"),
    ],
)
def test_a_name_that_is_elsewhere_is_told_where(namespace: str, name: str, words: str) -> None:
    with pytest.raises(AttributeError, match=rf"{namespace}' has no attribute '{name}': {re.escape(words)}"):
        getattr(import_module(namespace), name)


def test_names_of_pages_and_examples_are_public() -> None:
    files = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").glob("*.py")]
    for file in files:
        if file.name in ("development.md", "extensions.md") or "reference" in file.parts:
            continue
        for space, name in re.findall(r"(?<![\w./-])meltemi\.(\w+)(?:\.(\w+))?", file.read_text(encoding="utf-8")):
            home = f"meltemi.{space}" if space in NAMESPACES and name else "meltemi"
            asked = name if space in NAMESPACES and name else space
            known = asked in (*GROUPS, *declared(home)) or [*(ROOT / "src/meltemi").glob(f"{space}*")]
            assert known, (file.name, space, name)


def imports() -> dict[str, set[str]]:
    """What each module imports when it is imported, and for its types; not what functions import when called."""
    sources = {
        ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__"): path
        for path in (ROOT / "src").rglob("*.py")
    }

    def found(module: str, node: ast.AST) -> set[str]:
        names: set[str] = set()
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ImportFrom) and child.module:
                names |= {child.module, *(f"{child.module}.{alias.name}" for alias in child.names)}
            elif isinstance(child, ast.Import):
                names |= {alias.name for alias in child.names}
            elif not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                names |= found(module, child)
        return names & sources.keys() - {module}

    return {module: found(module, ast.parse(path.read_text("utf-8"))) for module, path in sources.items()}


def test_no_circles_of_imports_types_included() -> None:
    """``if TYPE_CHECKING`` hides a circle from Python, not from the reader."""
    graphlib.TopologicalSorter(imports()).prepare()


@pytest.mark.parametrize(
    "tool", sorted([*(ROOT / "tools").glob("*.py"), *(ROOT / "benchmarks").glob("*.py")]), ids=lambda path: path.stem
)
def test_tools_import_what_is_there(tool: Path) -> None:
    """They run by hand, rarely: a module that has moved is noticed here, wherever in the file it is imported."""
    for node in ast.walk(ast.parse(tool.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("meltemi"):
            home = import_module(str(node.module))
            for alias in node.names:
                assert hasattr(home, alias.name) or import_module(f"{node.module}.{alias.name}"), alias.name
