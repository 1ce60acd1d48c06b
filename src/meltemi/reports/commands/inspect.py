"""``meltemi inspect``: turbine summary page."""

from __future__ import annotations

from pathlib import Path

from meltemi.app.options import TurbineArgument
from meltemi.app.terminal import OutOption, folder_for, print_table, say, simulation_bar, suggest, wrote


def inspect(
    turbine: TurbineArgument,
    out: OutOption = Path("out"),
) -> None:
    """Write a summary page of a turbine: figures, main data, power curve, modes."""
    from meltemi.turbine.library import load_turbine

    described = load_turbine(turbine)
    folder_for(out)
    from meltemi.reports.inspection import inspect_turbine
    from meltemi.reports.turbine_facts import fact_rows
    from meltemi.turbine.plausibility import plausibility_warnings

    with simulation_bar(described.name) as progress:
        seen, files = inspect_turbine(described, out, progress=progress)
    print_table(described.name, ["", "what", "value"], fact_rows(seen), text_columns=3)
    wrote(*files)
    suggest("run", turbine, "--wind-speed", 12, "--out", out)
    for words in plausibility_warnings(described):
        say(f"warning: {words}")
    for what, why in seen.problems.items():
        say(f"missing: {what}: {why}")
