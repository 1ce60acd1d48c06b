"""Page of the study: claims, Table 2, figures, diagrams, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi_papers.claim import Claim, brief, claims_table, count_held, listed, reason_lines
from meltemi_papers.study import Chapter, Contents, Draw, Progress, Study, span, tabled, worded
from meltemi_papers.wang2021 import figures
from meltemi_papers.wang2021.beyond import report as beyond
from meltemi_papers.wang2021.beyond.report import Beyond
from meltemi_papers.wang2021.claims import REASONS, claims
from meltemi_papers.wang2021.gust import DERATE, IGNORE, MACHINE, RATIOS, SHORT, SLOW, STOP, peaks, spread
from meltemi_papers.wang2021.runs import CALIBRATED, QUICK, Runs, Setup, run_all
from meltemi_papers.wang2021.table2 import FITTED, MOMENT, POWER
from meltemi_papers.wang2021.winds import measured
from meltemi_reports.blocks import Table
from meltemi_reports.state_diagram import plot_states
from meltemi_studies.machine_loads import YAW_BENDING, YAW_TORSION
from meltemi_tuning.run_store import FailedResult, guarded

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
    "fig09_wind": ("Figure 9: the gust with direction change", lambda runs: figures.gust_wind(runs.gusts.shown)),
    "fig10_strategies": (
        "Figure 10: the three strategies, 12.6 rpm, default yaw control; dotted: the paper's 18 s and 2,000 kW",
        lambda runs: figures.gust_runs(runs.gusts.shown),
    ),
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
    """The two calibrated numbers."""
    c = runs.calibration
    chord, drag = c.errors
    return f"chord times {c.chord:.2f} ± {chord:.2f}, drag coefficient {c.drag:+.4f} ± {drag:.4f}, from bins 5 to 7"


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
    rows = peaks(runs.gusts.shown)
    return Table(head, rows, "Loads of the strategies in the gust: 12.6 rpm, default yaw control, first phase")


def ratios_table(runs: Runs) -> Table:
    """Table of ratios of loads by machine and yaw control, over the phases."""
    g = runs.gusts
    head = ["machine", "yaw average\ns", *(f"{load}\nS2 over {against[:2]}" for load, against in RATIOS)]
    head += ["tower top\nS1 < S2 < S3", "largest speed\nof rated"]
    rows = []
    for machine, average in g.phases:
        rated = float(machine.split()[0])
        fastest = g.values(machine, average, lambda each: max(r["rotor_speed"].max() for r in each.results.values()))
        ordered = g.ordered(machine, average)
        rows.append([machine, f"{average:g}", *(spread(g.ratios(machine, average, *which)) for which in RATIOS)])
        rows[-1] += [f"{ordered.sum():.0f} of {len(ordered)}", f"{fastest.max() * 30.0 / np.pi / rated:.2f}"]
    note = (
        f"Smallest to largest over {runs.setup.phases} azimuths of the rotor. The torque is constant above rated but "
        f'for "power held". {max(g.averages):g} s and a start time of 10 s are the default yaw control; the others '
        "start at once. The paper gives neither."
    )
    return Table(head, rows, "Peaks of derating over those of stopping and ignoring", text_columns=1, note=note)


def log_table(runs: Runs) -> Table:
    """Table of the supervisor's transitions."""
    results = {**runs.gusts.shown.results, SHORT: runs.recheck}
    rows = [
        [name, f"{entry.time:.2f}", entry.what, entry.reason]
        for name, result in results.items()
        for entry in result.log
    ]
    return Table(["strategy", "time [s]", "transition", "reason"], rows, "The supervisor's log", text_columns=4)


def gust_words(runs: Runs) -> str:
    """Where derating loads less than the other strategies in the paper's gust, and where more."""
    g = runs.gusts

    def of(machine: str, load: str, against: str) -> str:
        return spread(np.concatenate([g.ratios(machine, t, load, against) for t in g.averages]))

    parts = [
        f"at {m} {of(m, YAW_BENDING, STOP)} of that of stopping and {of(m, YAW_BENDING, IGNORE)} of that of ignoring"
        for m in (MACHINE, SLOW)
    ]
    more = {
        t: [m for m, s in g.phases if s == t and g.ratios(m, t, YAW_BENDING, STOP).mean() > 1.0] for t in g.averages
    }
    worse = [
        f"with a yaw average of {t:g} s at {' and '.join(m.replace(', ', ' with ') for m in names)}"
        for t, names in more.items()
        if names
    ]
    order = {m: np.concatenate([g.ordered(m, t) for t in g.averages]) for m in (MACHINE, SLOW)}
    rises = [f"{x.sum():.0f} of {len(x)} runs at {m}" for m, x in order.items()]
    return (
        "What derating saves in the paper's gust depends on the rotor speed, on the yaw control and on the azimuth of "
        f"the rotor. The bending at the yaw bearing is {'; '.join(parts)} the error (yaw averages of "
        f"{listed(g.averages)} s, {runs.setup.phases} azimuths). "
        + (f"In the mean over the azimuths it exceeds that of stopping {'; '.join(worse)}. " if worse else "")
        + f"The torsion is {of(MACHINE, YAW_TORSION, STOP)} of that of stopping at {MACHINE}. "
        f"The tower-top load rises from stopping over derating to ignoring in {' and '.join(rises)}."
    )


def grid_words(more: Beyond) -> str:
    """Derating against ignoring over the grid of gusts."""
    cost = {name: beyond.costs(more.grid, "S2", name) for name in (f"{YAW_BENDING}, extreme", "energy")}
    bending, lost = cost[f"{YAW_BENDING}, extreme"], cost["energy"]
    return (
        f"In {beyond.winds_of(more.grid)} winds with gusts derating changes the extreme bending at the bearing by "
        f"{bending} against ignoring the error, and loses {lost} a gust where ignoring loses nothing."
    )


def calibrated_words(runs: Runs) -> str:
    """How far the calibrated turbine is from the bins that were not fitted."""
    table = runs.tables[CALIBRATED].whole()

    def off(name: str, of: str, bins: range) -> str:
        target = np.array([getattr(measured()[k - 1], of) for k in bins])
        return f"{spread(100.0 * (table.column(name, 'mean')[[k - 1 for k in bins]] / target - 1.0), '+.1f')} %"

    above, below = range(max(FITTED) + 1, len(measured()) + 1), range(3, min(FITTED))
    return (
        f"An aerodynamic penalty ({calibration_words(runs)}) leaves {off(POWER, 'power_mean', above)} in the mean "
        f"power of the bins above those, {off(MOMENT, 'moment_mean', above)} in the mean flapwise moment, and "
        f"{off(POWER, 'power_mean', below)} and {off(MOMENT, 'moment_mean', below)} in the bins at 4 and 5 m/s."
    )


def lead(lines: Sequence[Claim], runs: Runs, more: Beyond) -> str:
    """The result in a few sentences."""
    parts = [
        count_held(lines),
        worded(lambda: gust_words(runs), "The gust"),
        worded(lambda: grid_words(more), "The grid of gusts"),
        worded(lambda: calibrated_words(runs), "Table 2"),
    ]
    return " ".join(parts)


def contents(found: Found, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    runs, more = found.runs, found.more
    lines = claims(runs)
    table = claims_table(lines)
    ratios = tabled("Ratios of loads", lambda: ratios_table(runs))
    loads = tabled("Loads of the strategies", lambda: loads_table(runs))
    files = []
    if not isinstance(more.grid, FailedResult):
        files.append(out / "grid.csv")
        more.grid.rows.to_csv(files[0], index=False, float_format="%.6g")
    return Contents(
        lead=lead(lines, runs, more),
        chapters={
            "claims": Chapter("Claim by claim", [table, *reason_lines(REASONS)]),
            "table2": Chapter("Table 2", [tabled("Table 2 of the paper and ours", lambda: bins_table(runs))]),
            "strategies": Chapter(
                "Loads of the strategies", [ratios, loads, tabled("The log", lambda: log_table(runs))]
            ),
            "beyond": beyond.chapter(more, draw),
        },
        facts=[
            ("turbines", ", ".join(turbine.name for turbine in runs.turbines)),
            ("calibration", guarded(partial(calibration_words, runs), str)),
            ("seeds", ", ".join(str(seed) for seed in runs.setup.seeds)),
        ],
        shown=[brief(table), ratios],
        files=files,
    )


STUDY = Study(
    name="wang2021",
    title="Wang et al. (2021): derate and look again instead of shutting down, reproduced",
    source="Wang, Y., Cai, X., Xu, B., Li, Z. (2021): yaw error strategy of a wind turbine by multibody dynamics. "
    "Frontiers in Energy Research 9, 711927.",
    run=run,
    runs=lambda found: found.runs,
    figures=FIGURES,
    contents=contents,
    needs=("pandas",),
)
