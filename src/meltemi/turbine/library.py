"""Library turbines, and turbines from files."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import merged, parse, read_mapping, read_text, validated, write_record
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine

Aeroelastic = Literal["nrel5mw", "iea10mw", "iea15mw", "iea22mw", "zr20-122", "ct30-155"]
AtSea = Literal["nrel5mw-monopile", "nrel5mw-jacket", "nrel5mw-tripod", "iea15mw-monopile", "iea22mw-monopile"]
Floating = Literal["nrel5mw-spar", "iea15mw-volturnus", "iea22mw-semi"]
Flexible = Literal["iea15mw-volturnus-flexible", "iea22mw-semi-flexible"]

DATA = Path(__file__).parent / "data"


class LibraryEntry(Record):
    """Summary of a library turbine, available without loading it."""

    file: str
    """File of the turbine, or of data in addition to its windIO file or HAWC2 model."""
    kind: Literal["aeroelastic", "power coefficient"] = "aeroelastic"
    """Kind of turbine."""
    base: str | None = None
    """Library turbine that the file modifies; without it the file is complete."""
    windio: str | None = None
    """File of the windIO package from which the turbine is read."""
    hawc2: str | None = None
    """Main file of the HAWC2 model from which the turbine is read."""
    rated_power: float
    """[W] electrical rated power."""
    rotor_diameter: float
    """[m] rotor diameter."""
    hub_height: float
    """[m] hub height."""
    source: str
    licence: str
    """Licence of the data."""
    verified: str
    """Comparisons with other sources."""


@cache
def library_entries() -> dict[str, LibraryEntry]:
    """Library turbines by name."""
    path = DATA / "library.yaml"
    return {name: validated(entry, LibraryEntry, f"{path}: {name}") for name, entry in read_mapping(path).items()}


def list_turbines() -> list[str]:
    """Names of the library turbines."""
    return sorted(library_entries())


def packages_of(name: str) -> tuple[str, ...]:
    """Optional packages that provide the data of a library turbine; empty for others."""
    entry = library_entries().get(name)
    return packages_of(entry.base) if entry and entry.base else ("windIO",) * bool(entry and entry.windio)


@overload
def load_turbine(name: Aeroelastic | AtSea | Floating | Flexible) -> Turbine: ...
@overload
def load_turbine(name: Literal["pmsg20mw", "pmsg20mw-bem"]) -> PowerTurbine: ...
@overload
def load_turbine(name: str | Path) -> AnyTurbine: ...
def load_turbine(name: str | Path) -> AnyTurbine:
    """Load a turbine from the library by name, or from a YAML file, OpenFAST deck (.fst) or HAWC2 model (.htc) by path.

    Raises:
      InputError: the turbine or file does not exist, the file does not describe a valid turbine, or the turbine's data
        are in the windIO package, which is not installed.
    """
    if str(name) in library_entries():
        return _from_library(str(name))
    path = Path(name)
    if path.suffix in (".fst", ".htc"):
        from meltemi.io import read_hawc2_model, read_openfast

        return (read_openfast if path.suffix == ".fst" else read_hawc2_model)(path)
    if path.suffix in (".yaml", ".yml") or path.exists():
        return read_turbine(path)
    raise InputError(
        f"no turbine {str(name)!r} in the library: {did_you_mean(str(name), list_turbines())} "
        "(or give the path of a .yaml file)"
    )


@cache
def _from_library(name: str) -> AnyTurbine:
    entry = library_entries()[name]
    if entry.base is not None:
        where = f"{entry.file} with {library_entries()[entry.base].file}"
        return validated(merged(_from_library(entry.base).content(), read_mapping(DATA / entry.file)), Turbine, where)
    if entry.hawc2 is not None:
        from meltemi.io import read_hawc2_model

        model = read_hawc2_model(DATA / entry.hawc2).content()
        return validated(merged(model, read_mapping(DATA / entry.file)), Turbine, f"{entry.file} with {entry.hawc2}")
    if entry.windio is None:
        return read_turbine(DATA / entry.file)
    from meltemi.io import read_windio
    from meltemi.turbine.windio_package import windio_file

    return read_windio(windio_file(entry.windio, name), DATA / entry.file)


def read_turbine(path: Path) -> AnyTurbine:
    """Read a turbine from a YAML file; a power-coefficient turbine has the key ``coefficient``.

    Raises:
      InputError: the file is missing or does not describe a valid turbine, with every line and key.
    """
    text = read_text(path)
    data = parse(text, path, "a turbine")
    for part, key in (("platform", "coefficients"), ("control", "discon")):
        if isinstance(content := data.get(part), dict):  # files of it are beside the turbine's
            full_path = str(path.absolute().parent / str(content.get(key) or "-"))
            content |= {key: full_path} if any(Path(full_path + end).is_file() for end in ("", ".1")) else {}
    if "coefficient" in data and "blade" not in data:
        from meltemi.turbine.power_turbine import PowerTurbine

        return validated(data, PowerTurbine, where=str(path), text=text)
    return validated(data, Turbine, where=str(path), text=text)


def write_turbine(turbine: AnyTurbine, path: str | Path) -> None:
    """Write a turbine as a YAML file that :func:`load_turbine` reads."""
    write_record(turbine, path)
