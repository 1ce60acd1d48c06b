"""``meltemi verify`` and ``meltemi bench``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, print_values, say, simulation_bar, suggest, wrote

if TYPE_CHECKING:
    from meltemi.verification.table import CheckTable


def verify(
    quick: Annotated[bool, "Only what takes less than two minutes."] = False,
    measured: Annotated[bool, "Only the comparison with measured loads of a rotor in a wind tunnel."] = False,
    hawc2: Annotated[
        Path | None, "Folder with models of HAWC2: only the comparisons with its results for them."
    ] = None,
    members: Annotated[
        Path | None, "Folder with runs of OpenFAST on a jacket and a tripod: only the comparisons with them."
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare with closed forms, OpenFAST, HAWC2 and measurements."""
    from meltemi.verification.verification import report_of, verification

    tables: list[CheckTable] = []
    suggest(*(("verify", "--out", out) if quick or measured or hawc2 or members else ("bench",)))
    try:
        with simulation_bar("verification") as progress:
            verification(
                quick=quick, measured=measured, models=hawc2, frames=members, progress=progress, say=say,
                done=tables.append,
            )  # fmt: skip
    finally:  # after an interruption or an error, too
        report = report_of(tables, measured, hawc2, members)
        for table in tables:
            print_table(table.title, *table.head_and_rows(), text_columns=table.text_columns)
        if tables:
            print(report.summary())
            wrote(*report.write(out))
    if report.failed:
        raise typer.Exit(1)


def bench(
    duration: Annotated[float, "Length of the timed runs [s]."] = 600.0,
    loads: Annotated[bool, "Only a sample of a load base."] = False,
    cases: Annotated[int, "Cases of that sample.", Range(1)] = 40,
) -> None:
    """Measure compile time, run time, memory."""
    if loads:
        from meltemi.verification.load_bench import load_benchmark, load_lines

        print_values("figures", load_benchmark(cases=cases, say=say), load_lines)
        suggest("loads", "plan", "nrel5mw", "--class", "IB", "--quick")
        return
    from meltemi.verification import bench as study

    print_values("figures", study.benchmark(duration=duration, say=say), study.report_lines)
    suggest("bench", "--loads")
