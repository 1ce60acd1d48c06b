"""``meltemi export-fmu``: a turbine as a functional mock-up unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.options import CHANNELS, CONTROLLER, CONTROLLERS, TURBINES, controller_of_options, is_case
from meltemi.app.terminal import simulation_bar, suggest, wrote


def export_fmu(
    target: Annotated[
        str, typer.Argument(metavar="TURBINE|CASE", help="A turbine, or a case file.", autocompletion=TURBINES)
    ],
    out: Annotated[Path, typer.Option(help="The file.")] = Path("turbine.fmu"),
    fmi: Annotated[str, typer.Option(help="Version of the standard: 2.0 or 3.0.")] = "3.0",
    controller: Annotated[
        str,
        typer.Option(help=f"Controller: {CONTROLLER}; fixed: the demands are inputs.", autocompletion=CONTROLLERS),
    ] = "baseline",
    wind_speed: Annotated[float, typer.Option(help="Wind speed at the start [m/s].")] = 12.0,
    channels: Annotated[
        str, typer.Option(help="Channels, separated by commas, that are outputs.", autocompletion=CHANNELS)
    ] = "",
) -> None:
    """Export a turbine as a functional mock-up unit (FMU) for co-simulation."""
    from meltemi.io import export_fmu as export
    from meltemi.loadcases.case import LoadCase, read_case

    path, folder = Path(target), Path()
    if path.suffix in (".yaml", ".yml") and is_case(path):
        case, folder = read_case(path), path.parent
    else:
        keys = {"channels": tuple(channels.split(","))} if channels else {}
        named = controller_of_options({"--controller": controller})
        wind = {"kind": "steady", "speed": wind_speed}
        case = LoadCase(turbine=target, wind=wind, duration=600.0, controller=named, **keys)  # type: ignore[arg-type]
    with simulation_bar("export"):
        wrote(export(case, out, fmi=fmi, folder=folder))  # type: ignore[arg-type]
    suggest("run", target, "--wind-speed", wind_speed, "--out", "out")
