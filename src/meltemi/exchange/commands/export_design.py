"""``meltemi export-linear`` and ``meltemi export-rosco``: models and tables for control design in other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import meltemi
from meltemi.app.options import CHANNELS, TurbineArgument
from meltemi.app.scans import speeds_of
from meltemi.app.terminal import OutOption, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError


def export_linear(
    turbine: TurbineArgument,
    wind_speeds: Annotated[str, "Wind speeds [m/s], e.g. 4,6,8 or 4:24:2."] = "4:24:2",
    inputs: Annotated[tuple[str, ...], "Inputs, separated by commas."] = ("generator_torque", "pitch", "wind_speed"),
    outputs: Annotated[tuple[str, ...], "Channels, separated by commas.", CHANNELS] = (
        "rotor_speed",
        "tower_top_fore_aft",
    ),
    out: Annotated[Path, "The file, .mat or .nc."] = Path("linear.mat"),
) -> None:
    """Export state-space models over wind speed for MATLAB (.mat) or Python (.nc)."""
    if out.suffix not in (".mat", ".nc"):
        raise InputError(f"--out {out}: expected the ending .mat or .nc")
    speeds = speeds_of(wind_speeds)
    with simulation_bar("linear models", len(speeds), "points") as progress:
        model = meltemi.build(meltemi.load_turbine(turbine))
        models = meltemi.io.linear_set(model, speeds, inputs, outputs, progress)
    wrote(meltemi.io.write_linear_set(models, out, turbine=model.turbine.name))
    suggest("campbell", turbine, "--out", "out")


def export_rosco(
    turbine: TurbineArgument,
    discon: Annotated[Path | None, "A DISCON.IN as template for one with the turbine's settings."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Export the table of rotor coefficients, and a tuned DISCON.IN, for ROSCO."""
    with simulation_bar("rotor coefficients"):
        files = meltemi.io.export_rosco(meltemi.load_turbine(turbine), out, discon)
    wrote(*files)
    suggest("run", turbine, "--wind-speed", 12, "--out", out)
