"""``meltemi export-fmu``: a turbine as a functional mock-up unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from meltemi.app.options import CHANNELS, CONTROLLER, CONTROLLERS, TURBINES, controller_of_options
from meltemi.app.terminal import simulation_bar, suggest, wrote
from meltemi.exchange.commands.export import case_of


def export_fmu(
    target: Annotated[
        str,
        typer.Argument(
            metavar="TURBINE|CASE",
            help="A turbine's name or YAML file, a case file, or a deck.",
            autocompletion=TURBINES,
        ),
    ],
    out: Annotated[Path, typer.Option(help="The file.")] = Path("turbine.fmu"),
    fmi: Annotated[str, typer.Option(help="Version of the standard: 2.0 or 3.0.")] = "3.0",
    controller: Annotated[
        str | None,
        typer.Option(help=f"Controller: {CONTROLLER}; fixed: the demands are inputs.", autocompletion=CONTROLLERS),
    ] = None,
    wind_speed: Annotated[float | None, typer.Option(help="Steady wind, at its start [m/s] [12].")] = None,
    channels: Annotated[
        str | None, typer.Option(help="Channels, separated by commas, that are outputs.", autocompletion=CHANNELS)
    ] = None,
) -> None:
    """Export a turbine, or a case with its models and wind, as a functional mock-up unit (FMU) for co-simulation."""
    from meltemi.cases.case import LoadCase
    from meltemi.core.yamlfile import validated
    from meltemi.exchange.fmu.export import export_fmu as export

    case, folder = case_of(target)
    given: dict[str, Any] = {}
    if controller is not None:
        given["controller"] = controller_of_options({"--controller": controller})
    if wind_speed is not None:
        given["wind"] = {"kind": "steady", "speed": wind_speed}
    if channels is not None:
        given["channels"] = channels.split(",")
    case = validated(case.content() | given, LoadCase, "command line")
    with simulation_bar("export"):
        wrote(export(case, out, fmi=fmi, folder=folder))  # type: ignore[arg-type]
    suggest("run", target, *(() if wind_speed is None else ("--wind-speed", wind_speed)), "--out", "out")
