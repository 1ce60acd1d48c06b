"""``meltemi inspect``: turbine summary page."""

from __future__ import annotations

from pathlib import Path

import meltemi
from meltemi.app.options import TurbineArgument
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, warn, wrote


def inspect(turbine: TurbineArgument, out: OutOption = Path("out")) -> None:
    """Write a summary page of a turbine: figures, main data, power curve, modes."""
    described = meltemi.load_turbine(turbine)
    from meltemi.reports.turbine_facts import fact_rows

    with simulation_bar(described.name) as progress:
        overview, files = meltemi.analysis.inspect_turbine(described, out, progress=progress)
    print_table(described.name, ["", "what", "value"], fact_rows(overview), text_columns=3)
    wrote(*files)
    suggest("run", turbine, "--wind-speed", 12, "--out", out)
    warn(meltemi.turbine.plausibility_warnings(described))
    warn((f"{what}: {why}" for what, why in overview.problems.items()), "missing")
