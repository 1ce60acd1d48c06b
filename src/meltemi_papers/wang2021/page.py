"""Page of the study: claims, Table 2, figures, diagrams, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.report.html import Table
from meltemi.report.state_diagram import plot_states
from meltemi.studies.run_store import FailedResult, guarded
from meltemi_papers.claim import brief, claims_table, count_held, reason_lines
from meltemi_papers.study import Chapter, Contents, Draw, Progress, Study, span, tabled
from meltemi_papers.wang2021 import figures
from meltemi_papers.wang2021.beyond import report as beyond
from meltemi_papers.wang2021.beyond.report import Beyond
from meltemi_papers.wang2021.claims import REASONS, claims
from meltemi_papers.wang2021.gust import DERATE, IGNORE, SHORT, STOP, peaks
from meltemi_papers.wang2021.runs import QUICK, Runs, Setup, run_all
from meltemi_papers.wang2021.table2 import MOMENT, POWER
from meltemi_papers.wang2021.winds import measured

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARE = 0.6
"""Of the time that the paper's part takes."""


@dataclass(frozen=True)
class Found:
    """Results of the paper's runs and of those beyond it."""

    runs: Runs
    more: Beyond


FIGURES: dict[str, tuple[str, Callable[[Runs], Figure]]] = {
    "table2": (
        "Power and load curves of Table 2 over the measured columns; shaded: smallest to largest value",
        lambda runs: figures.table2(dict(runs.tables)),
    ),
    "fig04_start_up": (
        "Figure 4 (V1): start-up, all seeds",
        lambda runs: figures.validation(
            runs.start_up,
            "Fig. 4: start-up, mean wind 7.49 m/s, last minute 8.06 m/s",
            ((180.0, 240.0, "measured", 1380.0), (180.0, 240.0, "the paper's simulation", 1435.0)),
        ),
    ),
    "fig05_power_limit": (
        "Figure 5 (V2): power limit, yaw and stop, all seeds",
        lambda runs: figures.validation(
            runs.power_stage,
            "Fig. 5: mean wind 10.49 m/s, turn of the wind at 120 s, stop at 430 s",
            ((360.0, 430.0, "measured", 2011.0), (360.0, 430.0, "the paper's simulation", 2036.0)),
        ),
    ),
    "fig06_threshold": ("Figures 6 and 7: the threshold", lambda runs: figures.thresholds()),
    "fig07_supervisor": ("Figure 7: the supervisor, drawn from its own table", lambda runs: plot_states()),
    "fig08_recheck": ("Figure 8: derate and look again, from the table", lambda runs: plot_states("yaw")),
    "fig09_wind": ("Figure 9: the gust with direction change", lambda runs: figures.gust_wind(runs.gust)),
    "fig10_strategies": ("Figure 10: the three strategies", lambda runs: figures.gust_runs(runs.gust)),
}


def run(
    *, quick: bool, workers: int | None, progress: Progress, partly: Callable[[Found], object], parts: Sequence[str]
) -> Found:
    """Run all simulations; ``partly`` is called with the paper's complete runs, the others marked as lost."""
    runs = run_all(QUICK if quick else Setup(), workers=workers, progress=span(progress, 0.0, SHARE))
    later: Any = FailedResult("not run yet")
    partly(Found(runs, Beyond(later, later, later)))
    return Found(runs, beyond.study(runs, workers=workers, progress=span(progress, SHARE, 1.0 - SHARE)))


def calibration_words(runs: Runs) -> str:
    """Sentence on the two calibrated numbers."""
    c = runs.calibration
    return f"efficiency {c.efficiency:.3f}, air density {c.air_density:.3f} kg/m^3, from bins 5 to 7"


def bins_table(runs: Runs) -> Table:
    """Table 2 of the paper and ours."""
    columns = [
        ("mean power [kW]", POWER, "mean", "power_mean", 0),
        ("std of power [kW]", POWER, "std", "power_std", 0),
        ("mean moment [kNm]", MOMENT, "mean", "moment_mean", 0),
        ("std of moment [kNm]", MOMENT, "std", "moment_std", 0),
    ]
    head, groups = ["bin", "m/s", "sets"], [("", 3)]
    for title, *_ in columns:
        head += ["measured", *runs.tables]
        groups.append((title, 1 + len(runs.tables)))
    rows = []
    for i, r in enumerate(measured()):
        row = [str(r.bin), f"{r.speed:g}", str(r.sets)]
        for _, name, of, column, digits in columns:
            row.append(f"{getattr(r, column):.{digits}f}")
            row += [
                "failed" if r.bin in table.lost else f"{table.column(name, of)[i]:.{digits}f}"
                for table in runs.tables.values()
            ]
        rows.append(row)
    seeds, period = len(runs.setup.seeds), runs.setup.period
    note = f"Ours: {seeds} seeds a bin, {period:g} s each; calibrated: {calibration_words(runs)}."
    return Table(head, rows, "Table 2 of the paper and ours", groups=groups, text_columns=1, note=note)


def loads_table(runs: Runs) -> Table:
    """Table of peak loads after the start of the gust."""
    head = ["largest size after the gust began", STOP, DERATE, IGNORE, "S2 over S1", "S2 over S3"]
    return Table(head, peaks(runs.gust), "Loads of the strategies in the gust with direction change")


def log_table(runs: Runs) -> Table:
    """Table of the supervisor's transitions."""
    rows = [
        [name, f"{entry.time:.2f}", entry.what, entry.reason]
        for name in (STOP, DERATE, IGNORE, SHORT)
        for entry in runs.gust.results[name].log
    ]
    return Table(["strategy", "time [s]", "transition", "reason"], rows, "The supervisor's log", text_columns=4)


def contents(found: Found, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    runs, more = found.runs, found.more
    lines = claims(runs)
    table = claims_table(lines)
    loads = tabled("Loads of the strategies", lambda: loads_table(runs))
    files = []
    if not isinstance(more.grid, FailedResult):
        files.append(out / "grid.csv")
        more.grid.rows.to_csv(files[0], index=False, float_format="%.6g")
    return Contents(
        lead=f"{count_held(lines)} {STUDY.text('lead.md').strip()}",
        chapters={
            "claims": Chapter("Claim by claim", [table, *reason_lines(REASONS)]),
            "table2": Chapter("Table 2", [tabled("Table 2 of the paper and ours", lambda: bins_table(runs))]),
            "strategies": Chapter("Loads of the strategies", [loads, tabled("The log", lambda: log_table(runs))]),
            "beyond": beyond.chapter(more, draw),
        },
        facts=[
            ("turbines", ", ".join(turbine.name for turbine in runs.turbines)),
            ("calibration", guarded(partial(calibration_words, runs), str)),
            ("seeds", ", ".join(str(seed) for seed in runs.setup.seeds)),
        ],
        shown=[brief(table), loads],
        files=files,
    )


STUDY = Study(
    name="wang2021",
    title="Wang et al. (2021): derate and look again instead of shutting down, reproduced",
    source="Wang, Y., Cai, Y., Xu, Z., Li, J. (2021): yaw error strategy of a wind turbine by multibody dynamics. "
    "Frontiers in Energy Research 9, 711927.",
    run=run,
    runs=lambda found: found.runs,
    figures=FIGURES,
    contents=contents,
)
