"""Options shared by several commands, and the wind and the controller that they describe."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import typer

from meltemi.app.signatures import Range
from meltemi.controllers.names import NAMES, controller_keys
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.core.record import Record
    from meltemi.turbine.definition import Turbine

Kind = TypeVar("Kind", bound="Record")


def completing(
    names: Callable[[], Mapping[str, str]], *, several: bool = False
) -> Callable[[str], list[tuple[str, str]]]:
    """Completion in a shell: names that begin as typed, with their meaning; the last of ``several`` with commas."""

    def complete(incomplete: str) -> list[tuple[str, str]]:
        before, comma, last = incomplete.rpartition(",") if several else ("", "", incomplete)
        candidates = names().items()
        return [(before + comma + name, about) for name, about in candidates if name.startswith(last)]

    return complete


def turbine_names() -> dict[str, str]:
    """Turbines of the library."""
    from meltemi.turbine.library import library_entries

    return {
        name: f"{e.rated_power / 1e6:g} MW, rotor {e.rotor_diameter:g} m"
        for name, e in sorted(library_entries().items())
    }


def channel_names() -> dict[str, str]:
    """Output channels, by both names."""
    from meltemi.simulation.channels import every_kind

    return {name: c.description for c in every_kind().values() for name in (c.name, c.alias) if name}


def _one_of(*names: str) -> Callable[[str], list[tuple[str, str]]]:
    return completing(lambda: dict.fromkeys(names, ""))


CONTROLLER = "a name (baseline, supervised, ipc, cpfc, A2, rosco ...), a Python file, module:function, or a library"
"""Values of an option for a controller (docs/guide/controller-names.md)."""
CONTROLLERS = completing(lambda: NAMES)
"""Completion of a controller."""
ControllerOption = Annotated[str | None, f"Controller: {CONTROLLER}.", CONTROLLERS]
ControllerInputOption = Annotated[Path | None, "Input file of a library, e.g. DISCON.IN; the same as LIBRARY@FILE."]
TURBINES = completing(turbine_names)
"""Completion of a turbine."""
TurbineArgument = Annotated[str, "A turbine's name or YAML file.", TURBINES]
ClassOption = Annotated[
    str | None,
    "--wind-class",
    "--class",
    "Wind turbine class of IEC 61400-1, e.g. IIB.",
    _one_of(*(f"{v}{i}" for v in ("I", "II", "III") for i in "ABC")),
]
DirectionOption = Annotated[float | None, "Wind direction [deg], clockwise from above; the nacelle stays [0]."]
EditionOption = Annotated[int | None, "Edition of IEC 61400-1: 2, 3, 4 [3]."]
SpectrumOption = Annotated[
    Literal["kaimal", "vonkarman", "mann"] | None, "Of turbulence: kaimal, vonkarman, mann [kaimal]."
]

YAML = (".yaml", ".yml")
"""Suffixes of case files and of other files that describe something."""
SeaOption = Annotated[
    str | None,
    typer.Option(
        "--sea",
        metavar="[regular:]HEIGHT,PERIOD[,DIRECTION]",
        help="Irregular sea: significant wave height [m], peak period [s], direction [deg, clockwise from above: 0]; "
        "or a regular wave.",
    ),
]

WakeOption = Annotated[
    Literal["momentum", "near", "hybrid", "free", "none"] | None,
    "Induction: momentum; near: trailed vortices behind each blade with momentum's far wake; hybrid, free: a wake of "
    "vortices that move by their age, or each for itself; none [momentum].",
]


@dataclass(frozen=True)
class WorkOptions:
    """Where the cases of a batch run."""

    workers: Annotated[int | None, "Simultaneous runs [one per core].", Range(1, 1000)] = None
    shard: Annotated[str | None, "Only every N-th case, beginning with the k-th: k/N, e.g. 3/16."] = None
    dask: Annotated[str | None, "Address of a Dask scheduler, or: local (processes of this machine)."] = None

    def divided(self) -> dict[str, Any]:
        """``shard`` and ``dask`` as arguments."""
        return {"shard": shard_of(self.shard), "dask": self.dask}


def shard_of(text: str | None) -> tuple[int, int]:
    """Number and count of shards of a text k/N."""
    if text is None:
        return 1, 1
    k, _, n = text.partition("/")
    if not (k.isdigit() and n.isdigit() and 1 <= int(k) <= int(n)):
        raise InputError(f"--shard {text!r}: expected k/N with k from 1 to N, for instance 3/16")
    return int(k), int(n)


IEC_MODELS = _one_of("NTM", "ETM", "EWM1", "EWM50", "NWP", "EOG", "EDC", "ECD", "ECG", "EWSH", "EWSV")
"""Completion of a wind model of IEC 61400-1."""


@dataclass(frozen=True)
class Options:
    """Options of a command."""

    def given(self) -> dict[str, Any]:
        """The given options under their names on the command line."""
        return {f"--{name.replace('_', '-')}": value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True)
class WindOptions(Options):
    """Options of a wind."""

    wind_speed: Annotated[float | None, "Mean wind speed at hub height [m/s]."] = None
    turbulence: Annotated[float | None, "Turbulence intensity, e.g. 0.14; steady wind without it."] = None
    shear: Annotated[float | None, "Power-law exponent [0 in steady wind, 0.2 in turbulence]."] = None
    spectrum: SpectrumOption = None
    iec: Annotated[
        str | None,
        "Wind of IEC 61400-1: NTM, ETM, EOG, ECD ... (see meltemi wind --help).",
        IEC_MODELS,
    ] = None
    ntm: Annotated[bool, "The same as --iec NTM: normal turbulence."] = False
    wind_class: ClassOption = None
    edition: EditionOption = None
    begin: Annotated[float | None, "Begin of the gust of --iec [s] [60]."] = None

    def given(self) -> dict[str, Any]:
        """The given options under their names on the command line."""
        options = super().given()
        return options | {"--iec": "NTM"} if options.pop("--ntm") else options


CHANNELS = completing(channel_names, several=True)
"""Completion of channels, separated by commas."""


@dataclass(frozen=True)
class RunOptions(WindOptions):
    """Options of a simulation that replace keys of a case file."""

    seed: Annotated[int | None, "Seed of the turbulence [1]."] = None
    direction: DirectionOption = None
    wind_file: Annotated[Path | None, "--wind-file", "--bts", "--wnd", "Wind file: .bts, .wnd, .bin, .nc."] = None
    sea: SeaOption = None
    wake: WakeOption = None
    controller: ControllerOption = None
    controller_input: ControllerInputOption = None
    duration: Annotated[float | None, "Duration of the simulation [s] [60; with a gust, 60 after its begin]."] = None
    start: Annotated[
        Literal["operating", "deck"] | None,
        "operating: steady operation; deck: rotor speed, pitch and azimuth of the .fst [operating].",
    ] = None
    channels: Annotated[
        tuple[str, ...] | None,
        "Channels to record, separated by commas; 'all' records everything, * is any text.",
        CHANNELS,
    ] = None


def load_aeroelastic(name: str, what: str) -> Turbine:
    """A turbine by its name or file, which must have blades and a tower for ``what``."""
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic

    return aeroelastic(load_turbine(name), what)


def of_options(data: dict[str, Any], kind: type[Kind], where: str = "command line") -> Kind:
    """A record of the keys and values of options; messages begin with ``where``."""
    from meltemi.core.yamlfile import validated

    return validated(data, kind, where)


def turbine_key(target: str) -> str:
    """The turbine of a case: a name in the library, or the whole path of a file."""
    return str(Path(target).absolute()) if Path(target).is_file() else target


def is_case(path: Path) -> bool:
    """Whether a file is a case file: only these have the key ``turbine`` at top level."""
    from meltemi.core.files import text_of

    if path.suffix not in YAML:
        return False
    try:
        text = text_of(path)
    except InputError:  # which the reader reports
        return False
    return re.search(r"""^(\{\s*)?(['"]?)(turbine|wind|duration)\2\s*:""", text, re.MULTILINE) is not None


SPEED = {"--wind-speed": "speed", "--turbulence": "intensity", "--seed": "seed"}
STANDARD = {"--wind-class": "wind_class", "--edition": "edition", "--begin": "begin"}
FURTHER = {"--shear": "shear_exponent", "--spectrum": "spectrum"}
"""Options and keys of a wind; the last ones are below ``turbulence`` in a wind of IEC 61400-1."""
TURNED = {"--direction": "direction"}
WIND = {*SPEED, *STANDARD, *FURTHER, *TURNED, "--iec", "--wind-file"}
"""Options of a wind."""


def _keyed(given: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """The values of given options by their keys, a direction in radians."""
    values = {key: given[name] for name, key in names.items() if name in given}
    return values | ({"direction": radians(values["direction"])} if "direction" in values else {})


def wind_changed(given: Mapping[str, Any], before: Mapping[str, Any], known: Collection[str]) -> dict[str, Any]:
    """The wind of a case with what options name; another one, at its speed, if they name its kind or it is a file.

    Args:
      given: options.
      before: the wind of the case.
      known: keys that it may have.

    Raises:
      InputError: options contradict each other, do not suffice, or name what this kind of wind does not have.
    """
    steady, file = before["kind"] == "steady", "file" in before
    if file and given.keys() == {"--direction"}:
        return {**before, **_keyed(given, TURNED)}
    if file or given.keys() & {"--iec", "--wind-file"} or (steady and "--turbulence" in given):
        speed = before.get("speed") if not given.keys() & {"--wind-speed", "--wind-file"} else None
        return wind_of_options({**({} if speed is None else {"--wind-speed": speed}), **given})
    names, inner = SPEED | STANDARD | TURNED, {}
    if before["kind"] == "iec":
        inner = {"turbulence": {**before.get("turbulence", {}), **_keyed(given, FURTHER)}}
    else:
        names |= FURTHER
    for name, key in names.items():
        if name in given and key not in known:
            raise InputError(f"{name}: the wind of the case, of kind {before['kind']}, has no {key.replace('_', ' ')}")
    return {**before, **_keyed(given, names), **inner}


def wind_of_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """The wind of a case from the options of a command, by option name.

    Raises:
      InputError: options contradict each other, or do not suffice.
    """

    def only(*allowed: str, because: str) -> None:
        for name in (*SPEED, *FURTHER, *STANDARD, *TURNED):
            if name != "--wind-speed" and name in given and name not in allowed:
                raise InputError(f"{name}: {because}")

    if "--begin" in given and "--iec" not in given:
        raise InputError("--begin: is that of a gust; add --iec, e.g. --iec EOG")
    if "--wind-file" in given:
        for name in ("--wind-speed", "--iec"):
            if name in given:
                raise InputError(f"give one of {name}, --wind-file")
        only("--direction", because="a wind file defines shear and turbulence")
        return {"kind": "file", "file": str(given["--wind-file"].absolute())} | _keyed(given, TURNED)
    wind, more = _keyed(given, SPEED | TURNED), _keyed(given, FURTHER)
    if "--iec" in given:
        return {"kind": "iec", "model": given["--iec"], **wind, **_keyed(given, STANDARD), "turbulence": more}
    if "--wind-speed" not in given:
        raise InputError("give one of --wind-speed, --iec (or --ntm), --wind-file")
    if "--turbulence" in given:
        only(*SPEED, *FURTHER, *TURNED, "--edition", because="add --iec (or --ntm)")
        return {"kind": "turbulence", **wind, **more, **_keyed(given, {"--edition": "edition"})}
    only("--shear", "--direction", because="steady wind has none; add --turbulence or --ntm")
    return {"kind": "steady", **wind, **more}


def sea_of_options(text: str) -> dict[str, Any]:
    """The sea of a case from the option ``--sea``.

    Raises:
      InputError: it is not two or three numbers, after a kind of sea or not.
    """
    kind, colon, values = text.rpartition(":")
    try:
        numbers = [float(part) for part in values.split(",")]
        height, period, direction = (*numbers, 0.0)[:3]
        assert len(numbers) in (2, 3)
        assert kind in (("regular", "irregular") if colon else ("",))
    except (ValueError, AssertionError):
        raise InputError(
            f"--sea {text!r}: expected significant wave height [m], peak period [s] and perhaps direction [deg], "
            "separated by commas, e.g. --sea 2.0,8, or height and period of a regular wave, e.g. --sea regular:4,12"
        ) from None
    return {"kind": kind or "irregular", "height": height, "period": period, "direction": radians(direction)}


def controller_of(name: str | None = None, file: Path | None = None) -> dict[str, Any]:
    """The controller of a case from ``--controller`` and ``--controller-input``; the baseline one without.

    Raises:
      InputError: no such controller or file, or there is an input file without a library.
    """
    keys: dict[str, Any] = controller_keys("baseline" if name is None else name)
    if file is not None:
        if keys["kind"] != "bladed":
            raise InputError("--controller-input: requires --controller, the path of a library or rosco")
        keys["input"] = str(file)
    from meltemi.controllers.specification import check_files, keyed, rooted, specification

    case = rooted(specification(keys), Path())
    check_files(case)
    return keyed(case)
