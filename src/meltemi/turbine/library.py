"""Turbines that come with the package, and turbines from files."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import read_record, write_record
from meltemi.turbine.definition import Turbine

DATA = Path(__file__).parent / "data"


def list_turbines() -> list[str]:
    """Names that :func:`load_turbine` knows."""
    return sorted(path.stem for path in DATA.glob("*.yaml"))


def load_turbine(name: str | Path) -> Turbine:
    """A turbine from the library by its name, or from a YAML file or OpenFAST deck (.fst) by its path.

    Raises:
      InputError: no such turbine or file, or the file does not describe a valid turbine.
    """
    if str(name) in list_turbines():
        return _from_library(str(name))
    path = Path(name)
    if path.suffix == ".fst":
        from meltemi.turbine.openfast import read_openfast

        return read_openfast(path)
    if path.suffix in (".yaml", ".yml") or path.exists():
        return read_record(path, Turbine)
    raise InputError(
        f"no turbine {str(name)!r} in the library: {did_you_mean(str(name), list_turbines())} "
        "(or give the path of a .yaml file)"
    )


@cache
def _from_library(name: str) -> Turbine:
    return read_record(DATA / f"{name}.yaml", Turbine)


def write_turbine(turbine: Turbine, path: str | Path) -> None:
    """Write a turbine as a YAML file that :func:`load_turbine` reads."""
    write_record(turbine, path)
