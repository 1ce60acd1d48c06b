"""``meltemi export``: export of a turbine as an OpenFAST deck."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import meltemi
from meltemi.app.options import TURBINES, SeaOption, is_case, of_options, sea_of_options
from meltemi.app.signatures import POSITIVE
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError, MeltemiError

if TYPE_CHECKING:
    from meltemi.cases.case import LoadCase


def export(
    turbine: Annotated[str, "A turbine's name or YAML file, a case file, or a deck (.fst) to be rewritten.", TURBINES],
    wind_speed: Annotated[float | None, "Steady wind [m/s] [12]."] = None,
    wind_file: Annotated[Path | None, "TurbSim field (.bts) instead."] = None,
    sea: SeaOption = None,
    duration: Annotated[float | None, "Duration of the simulation [s] [600].", POSITIVE] = None,
    option: Annotated[
        list[str] | None, "A model option: stall=static, flap_modes=1, locked=[yaw], time_step=0.005; repeatable."
    ] = None,
    beamdyn: Annotated[bool, "BeamDyn computes the blades."] = False,
    library: Annotated[str | None, "Bladed-style controller library, such as libdiscon.so."] = None,
    settings: Annotated[str, "Input file of the library."] = "DISCON.IN",
    out: OutOption = Path("out"),
) -> None:
    """Export a turbine, or a case with its models, site and wind, as an OpenFAST 5 deck."""
    from meltemi.cases.case import FileCase, StartCase, case_turbine, case_wind
    from meltemi.turbine.power_turbine import aeroelastic

    if wind_speed is not None and wind_file is not None:
        raise InputError("give one of --wind-speed, --wind-file")
    case, folder = case_of(turbine)
    described = aeroelastic(case_turbine(case, folder), "meltemi export")
    options = of_options(_options(case.options.content(), option or []), meltemi.ModelOptions, "--option")
    start = case.start if isinstance(case.start, StartCase) else None
    if wind_speed is not None:
        steady = of_options({"speed": wind_speed}, meltemi.SteadyWind, "--wind-speed")
        case = case.replace(wind={"kind": "steady"} | steady.content())
    elif wind_file is not None:
        case = case.replace(wind={"kind": "file", "file": str(wind_file.absolute())})
    field = case.wind if isinstance(case.wind, FileCase) else None
    wind: Any = folder / field.file if field else case_wind(case, described, folder)
    waves: Any = case.sea
    if sea is not None:
        from meltemi.sea.kinds import sea_of

        waves = sea_of(sea_of_options(sea), "--sea")
    with simulation_bar("export"):
        rotor_speed, pitch = None, None
        if start is not None:
            rotor_speed, pitch = None if start.rotor_speed == "idling" else start.rotor_speed, start.pitch
        elif case.start == "operating":
            rotor_speed, pitch = _operation(described, options, case, folder)
        written = meltemi.io.write_openfast(
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

    try:
        model = meltemi.build(turbine, options, case.environment)
        point = meltemi.operating_point(model, case_wind(case, turbine, folder))
    except MeltemiError:
        return None, None
    return point.rotor_speed, point.pitch


def case_of(target: str) -> tuple[LoadCase, Path]:
    """The case of a turbine, case file or deck, and the folder to which its paths are relative."""
    path = Path(target)
    if path.suffix.lower() == ".fst":
        deck = meltemi.io.read_deck(path)
        for title, head, rows in deck.tables():
            print_table(title, head, rows, text_columns=3)
        return meltemi.io.deck_case(deck, path.absolute(), started=True), Path()
    if is_case(path):
        return meltemi.io.read_case(path), path.parent
    data = {"turbine": target, "wind": {"kind": "steady", "speed": 12.0}, "duration": 600.0}
    return of_options(data, meltemi.io.LoadCase), Path()


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
