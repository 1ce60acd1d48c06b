"""What is imported when: quick commands leave the heavy packages alone, and every module stands on its own."""

from __future__ import annotations

import json
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import meltemi
from meltemi.core.stores import CORE
from meltemi.namespaces import NAMESPACES

HEAVY = ("numba", "llvmlite", "scipy", "xarray", "pandas", "matplotlib", "h5netcdf", "h5py")


def python(code: str, *arguments: str) -> str:
    """Standard output of a new Python in which warnings are errors."""
    command = [sys.executable, "-W", "error", "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def imported_by(code: str, *arguments: str) -> set[str]:
    """Heavy packages that are there after some code."""
    report = f"import json, sys\nprint(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    return set(json.loads(python(f"{code}\n{report}", *arguments).splitlines()[-1]))


COMMAND = """
from meltemi.app.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code
"""


def test_importing_the_package_imports_nothing_heavy() -> None:
    assert imported_by("import meltemi; dir(meltemi); meltemi.__version__") == set()


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments",
    [
        "--help",
        "--version",
        "run --help",
        "power-curve --help",
        "compare --help",
        "reproduce --help",
        "inspect --help",
        "export --help",
        "verify --help",
        "warmup --help",
        "bench --help",
        "channels",
        "channels --search tower",
        "channels --explain RootMyc1",
        "turbines",
        "template turbine",
    ],
)
def test_quick_commands_import_nothing_heavy(arguments: str) -> None:
    assert imported_by(COMMAND, *arguments.split()) == set()


@pytest.mark.slow
def test_the_test_sees_what_is_imported() -> None:
    assert {"numba", "scipy"} <= imported_by("from meltemi import simulate")


def test_reading_a_turbine_compiles_nothing() -> None:
    assert imported_by("import meltemi; meltemi.load_turbine('nrel5mw').replace(name='mine')") == set()


FOLDER = Path(meltemi.__file__).parent
MODULES = sorted(m.name for m in pkgutil.walk_packages([str(FOLDER)], "meltemi."))
ONE_BY_ONE = """
import importlib, sys
for name in sys.argv[1:]:
    for other in [m for m in sys.modules if m.partition(".")[0] == "meltemi"]:
        del sys.modules[other]
    try:
        importlib.import_module(name)
    except Exception as error:
        print(f"{name}: {type(error).__name__}: {error}")
"""


def test_every_module_is_found() -> None:
    assert len(MODULES) == len([*FOLDER.rglob("*.py")]) - 1  # itself
    assert "meltemi.simulation.step" in MODULES


@pytest.mark.long  # half a minute; import-linter finds cycles at once
def test_every_module_imports_on_its_own() -> None:
    # each is the first of the package to be imported, so none relies on what others did before
    assert python(ONE_BY_ONE, *MODULES) == ""


def test_every_public_name_is_there() -> None:
    for name in meltemi.__all__:
        assert getattr(meltemi, name) is not None
    assert set(dir(meltemi)) == set(meltemi.__all__)


def test_a_misspelt_public_name_gets_the_closest() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'load_turbin': did you mean 'load_turbine'"):
        meltemi.load_turbin  # noqa: B018


@pytest.mark.slow
def test_nothing_in_the_core_imports_what_is_built_on_it() -> None:
    code = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)\nprint(*sys.modules)"
    ours = [name for name in MODULES if name.split(".")[1] in CORE]
    beyond = {name for name in python(code, *ours).split() if name in MODULES and name not in ours}
    assert beyond <= {f"meltemi.{name}" for name in ("namespaces", *NAMESPACES)}
