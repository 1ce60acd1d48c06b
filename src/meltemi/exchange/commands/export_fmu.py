"""``meltemi export-fmu``: a turbine as a functional mock-up unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import meltemi
from meltemi.app.options import CHANNELS, CONTROLLER, CONTROLLERS, TURBINES, controller_of, of_options
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
    out: Annotated[Path, "The file."] = Path("turbine.fmu"),
    fmi: Annotated[Literal["2.0", "3.0"], "Version of the standard: 2.0 or 3.0."] = "3.0",
    controller: Annotated[str | None, f"Controller: {CONTROLLER}; fixed: the demands are inputs.", CONTROLLERS] = None,
    wind_speed: Annotated[float | None, "Steady wind, at its start [m/s] [12]."] = None,
    channels: Annotated[tuple[str, ...] | None, "Channels, separated by commas, that are outputs.", CHANNELS] = None,
) -> None:
    """Export a turbine, or a case with its models and wind, as a functional mock-up unit (FMU) for co-simulation."""
    case, folder = case_of(target)
    given: dict[str, Any] = {}
    if controller is not None:
        given["controller"] = controller_of(controller)
    if wind_speed is not None:
        given["wind"] = {"kind": "steady", "speed": wind_speed}
    if channels is not None:
        given["channels"] = channels
    case = of_options(case.content() | given, meltemi.io.LoadCase)
    with simulation_bar("export"):
        wrote(meltemi.io.export_fmu(case, out, fmi=fmi, folder=folder))
    suggest("run", target, *(() if wind_speed is None else ("--wind-speed", wind_speed)), "--out", "out")
