"""``meltemi export-controller``: a controller as a shared library with the Bladed interface."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import meltemi
from meltemi.app.options import CONTROLLER, CONTROLLERS, TURBINES
from meltemi.app.terminal import print_table, say, simulation_bar, suggest, wrote


def export_controller(
    controller: Annotated[str, f"Controller: {CONTROLLER}.", CONTROLLERS],
    turbine: Annotated[str, "--turbine", "The turbine that it controls: a name or YAML file.", TURBINES],
    out: Annotated[Path, "Name of the library."] = Path("libcontroller.so"),
) -> None:
    """Export a controller as a shared library (DISCON) for OpenFAST, Bladed, HAWC2; needs a C compiler."""
    from meltemi.controllers.schemes import fitted
    from meltemi.controllers.specification import specification

    with simulation_bar("export"):
        model = meltemi.build(fitted(meltemi.load_turbine(turbine), specification(controller)))
        exported = meltemi.io.export_controller(meltemi.control.make_controller(controller, model), model.turbine, out)
    rows = [[name, f"{difference:.2g}"] for name, difference in exported.inexact.items()]
    if rows:
        print_table("Initial states that the library interpolates", ["entry", "difference"], rows, text_columns=1)
    say(f"note: without records in the interface, constant in the library: {', '.join(exported.unmeasured)}")
    wrote(exported.library, exported.parameters)
    library = out if len(out.parts) > 1 else Path() / out
    files = ("--controller", library.absolute(), "--controller-input", exported.parameters.absolute())
    suggest("run", turbine, "--wind-speed", 12, *files, "--out", "out")
