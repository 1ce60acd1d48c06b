"""Edges that import contracts do not see: modules named in strings, and homes of public names in stub files."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

from meltemi.namespaces import NAMESPACES, declared

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "meltemi"
UPWARD = {
    ("app", "farm"),  # a template that lies with its reader
    ("core", "plots"),  # what is shown in a notebook
    ("cases", "sea"),  # fields of a case
    ("loadcases", "cluster"),  # dask="..."
    ("loadcases", "cuda"),  # device="cuda"
    ("loadcases", "postprocess"),  # files of a batch, and its summaries
    ("simulation", "analyses"),  # states in which a run begins that no plain one needs
    ("simulation", "electrical"),  # parts
    ("simulation", "floating"),
    ("simulation", "frames"),
    ("simulation", "scene"),  # what the view of a run records
    ("simulation", "sea"),
    ("simulation", "supervisor"),  # words for its states
    ("simulation", "vortex"),
    ("turbine", "electrical"),  # fields of a turbine
    ("turbine", "floating"),
    ("turbine", "frames"),
    ("turbine", "sea"),
    ("wind", "turbulence"),  # the field of a turbulent wind
}
"""Packages that name modules of a layer above their own, to be imported by those who ask for them."""
BY_NAMESPACE = {
    ("app", "gradients"),  # compiled in advance
    ("cases", "sea"),  # types of fields
    ("controllers", "exchange"),  # FMUs by their file
    ("simulation", "sea"),
    ("turbine", "electrical"),
    ("turbine", "exchange"),  # turbines by the files of other programs
    ("turbine", "floating"),
    ("turbine", "frames"),
    ("turbine", "sea"),
}
"""Packages that take a name of a layer above their own from a namespace, in functions or for types."""
HOMES = {
    "control": {"bladed_controllers", "control_laws", "controllers", "farm", "power_control", "supervisor"},
    "environment": {"sea", "studies"},
    "loads": {"strength"},
    "turbine": {"analyses", "electrical", "floating", "frames", "sea", "sections", "studies"},
    "wind": {"iec", "turbulence"},
}
"""Layers above a namespace that is a package where its public names are defined; one that is a module is above all."""


def layers() -> dict[str, int]:
    """Height of each package; a namespace that is a module stands above all."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (rows,) = (each["layers"] for each in contracts if "meltemi.core" in each.get("layers", ()))
    found = {name.strip().split(".")[1]: i for i, row in enumerate(reversed(rows)) for name in row.split("|")}
    return found | {path.stem: len(rows) for path in SOURCES.glob("*.pyi")}


def is_module(name: str) -> bool:
    path = SOURCES.joinpath(*name.split(".")[1:])
    return (
        name.startswith("meltemi.")
        and name[-1] != "."
        and (path.with_suffix(".py").is_file() or (path / "__init__.py").is_file())
    )


def test_modules_above_are_named_where_it_is_listed() -> None:
    height, found = layers(), set[tuple[str, str]]()
    for path in SOURCES.glob("*/**/*.py"):
        own = path.relative_to(SOURCES).parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and is_module(node.value):
                there = node.value.split(".")[1]
                if height[there] > height[own]:
                    found.add((own, there))
    assert found == UPWARD


def test_public_names_have_their_homes_where_it_is_listed() -> None:
    height, found = layers(), dict[str, set[str]]()
    for namespace in NAMESPACES:
        homes = {module.split(".")[1] for module, _ in declared(f"meltemi.{namespace}").values()}
        if above := {home for home in homes if height[home] > height[namespace]}:
            found[namespace] = above
    assert found == HOMES


def test_names_from_above_are_taken_from_a_namespace_where_it_is_listed() -> None:
    height, found = layers(), set[tuple[str, str]]()
    for path in SOURCES.glob("*/**/*.py"):
        own = path.relative_to(SOURCES).parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module in {"meltemi", *(f"meltemi.{n}" for n in NAMESPACES)}:
                names = declared(node.module)
                homes = {names[alias.name][0].split(".")[1] for alias in node.names if alias.name in names}
                found |= {(own, home) for home in homes - set(NAMESPACES) if height[home] > height[own]}
    assert found == BY_NAMESPACE
