"""``meltemi optimise``: a turbine and its controller by gradients."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from meltemi.app.scans import finish
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, made_by, print_table, say, simulation_bar, suggest, wrote

if TYPE_CHECKING:
    from meltemi.designs.problem import Problem, Trial


def optimise(
    file: Annotated[Path, "File of the design (docs/guide/designs.md)."],
    resume: Annotated[bool, "Continue the search whose history is in --out."] = False,
    unchecked: Annotated[bool, "Go on where the gradient does not agree with differences."] = False,
    workers: Annotated[int | None, "Simultaneous runs [one per core].", Range(1, 1000)] = None,
    out: OutOption = Path("out"),
) -> None:
    """Design a turbine and its controller by gradients: search, turbine, and proof on unseen runs."""
    from meltemi.designs import design as study
    from meltemi.designs import report

    designed = study.read_design(file)
    files: dict[str, Path] = {}

    def told(problem: Problem, trials: Sequence[Trial]) -> None:
        files["progress"] = report.write_progress(problem, trials, out)

    with simulation_bar("optimise") as bar:
        teller = study.Teller(line=say, runs=bar, iteration=told)
        result = study.optimise(
            designed, folder=file.parent, out=out, resume=resume, workers=workers, unchecked=unchecked, teller=teller
        )
    for table in (report.variable_table(result), report.change_table(result)):
        if table.rows:
            print_table(table.caption, table.head, table.texts, table.text_columns)
    for words in report.sentences(result):
        print(words)
    wrote(*report.write_design(result, out, **made_by()))
    controller = "baseline" if not result.entries else str(out / report.CONTROLLER)
    suggest("export-controller", controller, "--turbine", out / report.TURBINE)
    finish((), interrupted=result.interrupted)
