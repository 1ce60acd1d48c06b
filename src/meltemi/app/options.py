"""Wind options shared by several commands, and the wind that they describe."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import radians
from pathlib import Path
from typing import Annotated, Any

import typer

from meltemi.core.errors import InputError

WindSpeedOption = Annotated[float | None, typer.Option("--wind-speed", help="Mean wind speed at hub height [m/s].")]
TurbulenceOption = Annotated[
    float | None, typer.Option("--turbulence", help="Turbulence intensity, e.g. 0.14; steady wind without it.")
]
ShearOption = Annotated[
    float | None, typer.Option("--shear", help="Power-law exponent [0 in steady wind, 0.2 in turbulence].")
]
SpectrumOption = Annotated[
    str | None, typer.Option("--spectrum", help="Of turbulence: kaimal, vonkarman, mann [kaimal].")
]
IecOption = Annotated[
    str | None, typer.Option("--iec", help="Wind of IEC 61400-1: NTM, ETM, EOG, ECD ... (see meltemi wind --help).")
]
NtmOption = Annotated[bool, typer.Option("--ntm", help="The same as --iec NTM: normal turbulence.")]
ClassOption = Annotated[
    str | None, typer.Option("--wind-class", "--class", help="Wind turbine class of IEC 61400-1, e.g. IIB.")
]
DirectionOption = Annotated[
    float | None, typer.Option("--direction", help="Wind direction [deg], clockwise from above [0: along the shaft].")
]
EditionOption = Annotated[int | None, typer.Option("--edition", help="Edition of IEC 61400-1: 2, 3, 4 [3].")]

ControllerOption = Annotated[
    str | None, typer.Option("--controller", help="Bladed-style controller library, or: rosco, baseline [baseline].")
]
ControllerInputOption = Annotated[
    Path | None, typer.Option("--controller-input", help="Input file of the controller library, e.g. DISCON.IN.")
]


def is_case(path: Path) -> bool:
    """Whether a file is a case file: only these have the key ``turbine`` at top level."""
    from meltemi.core.files import text_of

    try:
        text = text_of(path)
    except InputError:  # which the reader will say
        return False
    return re.search(r"""^(\{\s*)?(['"]?)(turbine|wind|duration)\2\s*:""", text, re.MULTILINE) is not None


def given_options(**options: Any) -> dict[str, Any]:
    """The given options under their names on the command line."""
    return {f"--{name.replace('_', '-')}": value for name, value in options.items() if value is not None}


WIND = tuple(
    f"--{name}"
    for name in "wind-speed turbulence seed shear direction spectrum iec wind-class edition wind-file".split()
)
"""Options of a wind."""


def wind_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """The wind options among the given options."""
    return {name: given[name] for name in WIND if name in given}


def wind_of_options(given: Mapping[str, Any], before: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The wind of a case from the options of a command, by option name.

    Args:
      given: options.
      before: a wind of which a steady one keeps what speed, shear and direction do not name.

    Raises:
      InputError: options contradict each other, or do not suffice.
    """
    steady = {"--wind-speed": "speed", "--shear": "shear_exponent", "--direction": "direction"}
    if before is not None and before["kind"] == "steady" and wind_options(given).keys() <= steady.keys():
        named = {key: given[name] for name, key in steady.items() if name in given}
        return dict(before) | named | ({"direction": radians(named["direction"])} if "direction" in named else {})

    def only(*allowed: str, because: str) -> None:
        for name in ("--turbulence", "--seed", "--shear", "--spectrum", "--wind-class", "--edition", "--direction"):
            if name in given and name not in allowed:
                raise InputError(f"{name}: {because}")

    if "--wind-file" in given:
        for name in ("--wind-speed", "--iec"):
            if name in given:
                raise InputError(f"give one of {name}, --wind-file")
        only(because="a wind file defines shear, direction and turbulence")
        return {"kind": "file", "file": str(given["--wind-file"].absolute())}
    keys = {"--wind-speed": "speed", "--turbulence": "intensity", "--seed": "seed"}
    wind = {key: given[name] for name, key in keys.items() if name in given}
    if "--direction" in given:
        wind["direction"] = radians(given["--direction"])
    further = {"--shear": "shear_exponent", "--spectrum": "spectrum"}
    more = {key: given[name] for name, key in further.items() if name in given}
    if "--iec" in given:
        standard = {"--wind-class": "wind_class", "--edition": "edition"}
        wind |= {key: given[name] for name, key in standard.items() if name in given}
        return {"kind": "iec", "model": given["--iec"], **wind, "turbulence": more}
    if "--wind-speed" not in given:
        raise InputError("give one of --wind-speed, --iec (or --ntm), --wind-file")
    if "--turbulence" in given:
        only(
            *("--turbulence", "--seed", "--shear", "--spectrum", "--edition", "--direction"),
            because="add --iec (or --ntm)",
        )
        edition = {"edition": given["--edition"]} if "--edition" in given else {}
        return {"kind": "turbulence", **wind, **more, **edition}
    only("--shear", "--direction", because="steady wind has none; add --turbulence or --ntm")
    return {"kind": "steady", **wind, **more}


def controller_of_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """The controller of a case from the options of a command, by option name.

    Raises:
      InputError: there is an input file without a library.
    """
    name, file = given.get("--controller", "baseline"), given.get("--controller-input")
    if name == "baseline":
        if file is not None:
            raise InputError("--controller-input: requires --controller, the path of a library or rosco")
        return {"kind": "baseline"}
    library = name if name == "rosco" else str(Path(name).absolute())
    return {"kind": "bladed", "library": library, "input": None if file is None else str(file.absolute())}
