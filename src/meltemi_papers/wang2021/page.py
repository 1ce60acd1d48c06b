"""Everything on one page and in files: claims, figures, diagrams, what lies beyond."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.report.html import Picture, Section, Table, write_page
from meltemi.report.state_diagram import plot_states
from meltemi.studies.journal import Lost, guarded, journal
from meltemi_papers.claim import Claim, brief, claims_table, count_held
from meltemi_papers.markdown import alone, documented, picture_line, table_lines
from meltemi_papers.study import Drawn, Reproduction, drawn, failed_tables, picture, tabled, write_tables
from meltemi_papers.wang2021 import figures
from meltemi_papers.wang2021.beyond import report as beyond
from meltemi_papers.wang2021.beyond.report import Beyond
from meltemi_papers.wang2021.claims import REASONS, claims
from meltemi_papers.wang2021.gust import DERATE, IGNORE, SHORT, STOP, peaks
from meltemi_papers.wang2021.runs import QUICK, Progress, Runs, Setup, run_all
from meltemi_papers.wang2021.table2 import MOMENT, POWER
from meltemi_papers.wang2021.winds import measured

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
TITLE = "Wang et al. (2021): derate and look again instead of shutting down, reproduced"
SOURCE = (
    "Wang, Y., Cai, Y., Xu, Z., Li, J. (2021): yaw error strategy of a wind turbine by multibody dynamics. "
    "Frontiers in Energy Research 9, 711927."
)
SHARE = 0.6
"""Of the time that the paper's part takes."""

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


def reproduce(
    out: Path, *, quick: bool = False, workers: int | None = None, progress: Progress = lambda share, what: None
) -> Reproduction:
    """Run everything and write it.

    Args:
      out: folder for page, tables and figures; it must exist.
      quick: few and short runs: a look, nothing to judge by.
      workers: threads.
      progress: called with the share that is done and what is under way.
    """
    began = time.perf_counter()
    with journal(out, f"wang2021, quick {quick}", "meltemi_papers") as book:
        runs = run_all(
            QUICK if quick else Setup(),
            workers=workers,
            progress=lambda share, what: progress(SHARE * share, what),
        )
        later: Any = Lost("not run yet")
        _write(out, runs, Beyond(later, later, later), time.perf_counter() - began)
        more = beyond.study(
            runs, workers=workers, progress=lambda share, what: progress(SHARE + (1.0 - SHARE) * share, what)
        )
        return replace(_write(out, runs, more, time.perf_counter() - began), **book.problems())


def _write(out: Path, runs: Runs, more: Beyond, seconds: float) -> Reproduction:
    """Page, tables and figures of what was run so far."""
    pictures = {name: drawn(name, text, partial(draw, runs), out) for name, (text, draw) in FIGURES.items()}
    pictures["beyond"] = drawn("beyond", "Derate or stop: one page to act on", lambda: beyond.page(more), out)
    files = [file for _, file in pictures.values() if file]
    found = claims(runs)
    loads = tabled("Loads of the strategies", lambda: loads_table(runs))
    tables = {
        "claims": ("Claim by claim", [claims_table(found)]),
        "table2": ("Table 2", [tabled("Table 2 of the paper and ours", lambda: bins_table(runs))]),
        "strategies": ("Loads of the strategies", [loads, tabled("The log", lambda: log_table(runs))]),
        **beyond.tables(more),
        **failed_tables(),
    }
    files += write_tables(tables, out)
    if not isinstance(more.grid, Lost):
        more.grid.rows.to_csv(out / "grid.csv", index=False, float_format="%.6g")
        files.append(out / "grid.csv")
    text = markdown(found, tables, pictures, beyond.verdict(more))
    path = out / "wang2021.md"
    path.write_text(alone(text), encoding="utf-8")
    files.append(path)
    sections = []
    for name, (heading, made) in tables.items():
        content: list[str | Table | Picture] = list(made)
        if name == "claims":
            content += [f"{key}: {words}" for key, words in REASONS.items()]
        if name == "beyond":
            content += [picture(*pictures["beyond"]), beyond.verdict(more)]
        sections.append(Section(heading, content))
    own = [picture(*pair) for name, pair in pictures.items() if name != "beyond"]
    sections.append(Section("The paper's figures", own))
    facts = [
        ("turbines", ", ".join(turbine.name for turbine in runs.turbines)),
        ("calibration", guarded(partial(calibration_words, runs), str)),
        ("seeds", ", ".join(str(seed) for seed in runs.setup.seeds)),
        ("computed in", f"{seconds:.0f} s"),
    ]
    files.append(write_page(out / "wang2021.html", TITLE, sections, facts=facts, lead=lead(found), footer=SOURCE))
    return Reproduction([brief(claims_table(found)), loads], lead(found), files, documented(text, "wang2021"))


def calibration_words(runs: Runs) -> str:
    """The two numbers."""
    c = runs.calibration
    return f"efficiency {c.efficiency:.3f}, air density {c.air_density:.3f} kg/m^3, from bins 5 to 7"


def bins_table(runs: Runs) -> Table:
    """Table 2 beside ours."""
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
    """Peaks after the gust began."""
    head = ["largest size after the gust began", STOP, DERATE, IGNORE, "S2 over S1", "S2 over S3"]
    return Table(head, peaks(runs.gust), "Loads of the strategies in the gust with direction change")


def log_table(runs: Runs) -> Table:
    """What the supervisor did."""
    rows = [
        [name, f"{entry.time:.2f}", entry.what, entry.reason]
        for name in (STOP, DERATE, IGNORE, SHORT)
        for entry in runs.gust.results[name].log
    ]
    return Table(["strategy", "time [s]", "transition", "reason"], rows, "The supervisor's log", text_columns=4)


def lead(found: list[Claim]) -> str:
    """The result in a sentence."""
    return f"{count_held(found)} " + (HERE / "lead.md").read_text(encoding="utf-8").strip()


def markdown(found: list[Claim], tables: dict[str, tuple[str, list[Table]]], pictures: Drawn, verdict: str) -> str:
    """Tables and figures for the documentation."""
    parts = [(HERE / "before.md").read_text(encoding="utf-8"), lead(found), ""]
    for name, (heading, made) in tables.items():
        parts += [f"## {heading}", ""]
        if name == "beyond":
            parts += [verdict, "", picture_line(*pictures["beyond"]), ""]
        for table in made:
            parts += [*table_lines(table), ""]
        if name == "claims":
            parts += [f"*{key}:* {words}\n" for key, words in REASONS.items()]
    parts += ["## The paper's figures", ""]
    parts += [f"{picture_line(*pair)}\n" for name, pair in pictures.items() if name != "beyond"]
    parts.append((HERE / "after.md").read_text(encoding="utf-8"))
    return "\n".join(parts)
