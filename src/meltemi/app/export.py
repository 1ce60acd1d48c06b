"""``meltemi export``: a turbine as an OpenFAST deck."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.terminal import OutOption, print_table, results_in
from meltemi.core.errors import InputError


def export(
    turbine: Annotated[str, typer.Argument(help="A turbine's name or YAML file.")],
    wind_speed: Annotated[float | None, typer.Option("--wind-speed", help="Steady wind [m/s] [12].")] = None,
    wind_file: Annotated[Path | None, typer.Option("--wind-file", help="TurbSim field (.bts) instead.")] = None,
    duration: Annotated[float, typer.Option("--duration", help="Length of the run [s].")] = 600.0,
    beamdyn: Annotated[bool, typer.Option("--beamdyn", help="BeamDyn computes the blades.")] = False,
    library: Annotated[
        str | None, typer.Option("--library", help="Bladed-style controller library, such as libdiscon.so.")
    ] = None,
    settings: Annotated[str, typer.Option("--settings", help="Its input file.")] = "DISCON.IN",
    out: OutOption = Path("out"),
) -> None:
    """Write a turbine for OpenFAST 5."""
    from meltemi.core.yamlfile import validated
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic
    from meltemi.wind.fields import SteadyWind

    described = aeroelastic(load_turbine(turbine), "meltemi export")
    if wind_speed is not None and wind_file is not None:
        raise InputError("give one of --wind-speed, --wind-file")
    if not duration > 0.0:
        raise InputError(f"--duration {duration:g}: expected a time above zero")
    steady = validated({"speed": 12.0 if wind_speed is None else wind_speed}, SteadyWind, "--wind-speed")
    with results_in(out):
        from meltemi.studies.openfast_writer import write_openfast

        written = write_openfast(
            described,
            out,
            wind=steady if wind_file is None else wind_file,
            duration=duration,
            beamdyn=beamdyn,
            library=library,
            settings=settings,
        )
    rows = [[note.kind, note.what, note.why] for note in written.notes]
    print_table(f"{described.name}: what the deck has otherwise", ["", "what", "how"], rows, text_columns=3)
    for file in written.files:
        print(f"wrote {file}")
