"""``meltemi export-linear`` and ``meltemi export-rosco``: models and tables for control design in other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.options import CHANNELS, TurbineArgument
from meltemi.app.scans import speeds_of
from meltemi.app.terminal import OutOption, folder_for, simulation_bar, suggest, wrote


def export_linear(
    turbine: TurbineArgument,
    wind_speeds: Annotated[str, typer.Option(help="Wind speeds [m/s], e.g. 4,6,8 or 4:24:2.")] = "4:24:2",
    inputs: Annotated[str, typer.Option(help="Inputs, separated by commas.")] = "generator_torque,pitch,wind_speed",
    outputs: Annotated[
        str, typer.Option(help="Channels, separated by commas.", autocompletion=CHANNELS)
    ] = "rotor_speed,tower_top_fore_aft",
    out: Annotated[Path, typer.Option(help="The file, .mat or .nc.")] = Path("linear.mat"),
) -> None:
    """Export state-space models over wind speed for MATLAB (.mat) or Python (.nc)."""
    import meltemi
    from meltemi.core.errors import InputError
    from meltemi.io import linear_set, write_linear_set

    if out.suffix not in (".mat", ".nc"):
        raise InputError(f"--out {out}: expected the ending .mat or .nc")
    speeds = speeds_of(wind_speeds)
    with simulation_bar("linear models", len(speeds), "points") as progress:
        model = meltemi.build(meltemi.load_turbine(turbine))
        models = linear_set(model, speeds, inputs.split(","), outputs.split(","), progress)
    wrote(write_linear_set(models, out, turbine=model.turbine.name))
    suggest("campbell", turbine, "--out", "out")


def export_rosco(
    turbine: TurbineArgument,
    discon: Annotated[
        Path | None, typer.Option(help="A DISCON.IN, from which one with the turbine's settings is made.")
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Export the table of rotor coefficients, and a tuned DISCON.IN, for ROSCO."""
    import meltemi
    from meltemi.io import export_rosco as export

    folder_for(out)
    with simulation_bar("rotor coefficients"):
        files = export(meltemi.load_turbine(turbine), out, discon)
    wrote(*files)
    suggest("run", turbine, "--wind-speed", 12, "--out", out)
