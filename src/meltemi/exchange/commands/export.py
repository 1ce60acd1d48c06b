"""``meltemi export``: export of a turbine as an OpenFAST deck."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import TURBINES, SeaOption, is_case, sea_of_options
from meltemi.app.terminal import OutOption, folder_for, print_table, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError, MeltemiError

if TYPE_CHECKING:
    from meltemi.cases.case import LoadCase


def export(
    turbine: Annotated[
        str,
        typer.Argument(
            help="A turbine's name or YAML file, a case file, or a deck (.fst) to be rewritten.",
            autocompletion=TURBINES,
        ),
    ],
    wind_speed: Annotated[float | None, typer.Option("--wind-speed", help="Steady wind [m/s] [12].")] = None,
    wind_file: Annotated[Path | None, typer.Option("--wind-file", help="TurbSim field (.bts) instead.")] = None,
    sea: SeaOption = None,
    duration: Annotated[float | None, typer.Option("--duration", help="Duration of the simulation [s] [600].")] = None,
    option: Annotated[
        list[str] | None,
        typer.Option(
            "--option", help="A model option: stall=static, flap_modes=1, locked=[yaw], time_step=0.005; repeatable."
        ),
    ] = None,
    beamdyn: Annotated[bool, typer.Option("--beamdyn", help="BeamDyn computes the blades.")] = False,
    library: Annotated[
        str | None, typer.Option("--library", help="Bladed-style controller library, such as libdiscon.so.")
    ] = None,
    settings: Annotated[str, typer.Option("--settings", help="Input file of the library.")] = "DISCON.IN",
    out: OutOption = Path("out"),
) -> None:
    """Export a turbine, or a case with its models, site and wind, as an OpenFAST 5 deck."""
    from meltemi.cases.case import FileCase, StartCase, case_turbine, case_wind
    from meltemi.core.yamlfile import validated
    from meltemi.simulation.options import ModelOptions
    from meltemi.turbine.power_turbine import aeroelastic
    from meltemi.wind.fields import SteadyWind

    if wind_speed is not None and wind_file is not None:
        raise InputError("give one of --wind-speed, --wind-file")
    if duration is not None and not duration > 0.0:
        raise InputError(f"--duration {duration:g}: expected a time above zero")
    case, folder = case_of(turbine)
    described = aeroelastic(case_turbine(case, folder), "meltemi export")
    options = validated(_options(case.options.content(), option or []), ModelOptions, "--option")
    start = case.start if isinstance(case.start, StartCase) else None
    if wind_speed is not None:
        steady = validated({"speed": wind_speed}, SteadyWind, "--wind-speed")
        case = case.replace(wind={"kind": "steady"} | steady.content())
    elif wind_file is not None:
        case = case.replace(wind={"kind": "file", "file": str(wind_file.absolute())})
    field = case.wind if isinstance(case.wind, FileCase) else None
    wind: Any = folder / field.file if field else case_wind(case, described, folder)
    waves: Any = case.sea
    if sea is not None:
        from meltemi.sea.kinds import sea_of

        waves = sea_of(sea_of_options(sea), "--sea")
    folder_for(out)
    with simulation_bar("export"):
        from meltemi.exchange.openfast_writer import write_openfast

        rotor_speed, pitch = None, None
        if start is not None:
            rotor_speed, pitch = None if start.rotor_speed == "idling" else start.rotor_speed, start.pitch
        elif case.start == "operating":
            rotor_speed, pitch = _operation(described, options, case, folder)
        written = write_openfast(
            described,
            out,
            options=options,
            environment=case.environment,
            wind=wind,
            direction=field.direction if field else 0.0,
            duration=duration or case.duration,
            rotor_speed=rotor_speed,
            pitch=pitch,
            azimuth=start.azimuth if start else 0.0,
            beamdyn=beamdyn,
            library=library,
            settings=settings,
            sea=waves,
        )
    rows = [[note.kind, note.what, note.why] for note in written.notes]
    print_table(f"{described.name}: differences of the deck", ["", "what", "how"], rows, text_columns=3)
    wrote(*written.files)
    beside = folder / case.turbine  # the deck itself has no controller settings that can be read
    source = beside if beside.is_file() else case.turbine
    suggest("import", written.main, "--control-of", source, "--out", out / "check")


def _operation(turbine: Any, options: Any, case: LoadCase, folder: Path) -> tuple[float | None, float | None]:
    """Rotor speed [rad/s] and pitch [rad] of steady operation at the mean wind speed; None for a parked turbine."""
    from meltemi.cases.case import case_wind
    from meltemi.simulation.rotors import build, operating_point

    try:
        point = operating_point(build(turbine, options, case.environment), case_wind(case, turbine, folder))
    except MeltemiError:
        return None, None
    return point.rotor_speed, point.pitch


def case_of(target: str) -> tuple[LoadCase, Path]:
    """The case of a turbine, case file or deck, and the folder to which its paths are relative."""
    from meltemi.cases.case import LoadCase, read_case
    from meltemi.core.yamlfile import validated
    from meltemi.exchange.deck_case import deck_case
    from meltemi.exchange.openfast import read_deck

    path = Path(target)
    if path.suffix.lower() == ".fst":
        deck = read_deck(path)
        for title, head, rows in deck.tables():
            print_table(title, head, rows, text_columns=3)
        return deck_case(deck, path.absolute(), started=True), Path()
    if path.suffix in (".yaml", ".yml") and is_case(path):
        return read_case(path), path.parent
    data = {"turbine": target, "wind": {"kind": "steady", "speed": 12.0}, "duration": 600.0}
    return validated(data, LoadCase, "command line"), Path()


def _options(content: dict[str, Any], texts: Sequence[str]) -> dict[str, Any]:
    """Options updated with settings ``key=value`` or ``advanced.key=value``."""
    from meltemi.core.record import set_keys
    from meltemi.core.yamlfile import parse

    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--option {text!r}: expected an option and its value, such as stall=static")
        for key, setting in parse(f"{name.strip()}: {value}", Path("--option")).items():
            set_keys(content, key, setting)
    return content
