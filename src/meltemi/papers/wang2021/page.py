"""Page of the study: claims, Table 2, figures, diagrams, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.iec.gusts import RISE_TIME, Sign
from meltemi.papers.claim import Claim, brief, claims_table, count_held, reason_lines
from meltemi.papers.study import (
    Contents,
    Draw,
    Progress,
    Study,
    applied,
    guarded_table,
    guarded_text,
    run_parts,
    span,
    step_progress,
)
from meltemi.papers.wang2021 import beyond, damage_budget, figures, measured_gusts
from meltemi.papers.wang2021.beyond import Beyond
from meltemi.papers.wang2021.claims import REASONS, claims
from meltemi.papers.wang2021.costs import costs, winds_of
from meltemi.papers.wang2021.gust import (
    SIGNS,
    Gusts,
    causes_table,
    gust_words,
    loads_tables,
    log_table,
    ratios_table,
    slowed_words,
)
from meltemi.papers.wang2021.machines import YAW_CONTROLS
from meltemi.papers.wang2021.runs import QUICK, YAW_RATE, YawProtectionRuns, YawProtectionSetup, run_all, run_gusts
from meltemi.papers.wang2021.table2 import LOOP_BINS, MOMENT, POWER
from meltemi.papers.wang2021.winds import STATED, TIMES, measured
from meltemi.papers.wang2021.words import sentence
from meltemi.reports.blocks import Block, Section, Table
from meltemi.reports.state_diagram import plot_states
from meltemi.studies.machine_loads import YAW_BENDING
from meltemi.studies.yaw_gusts import with_yaw_rate
from meltemi.tuning.run_store import FailedResult, attempt, guarded
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARE = 0.6
"""Share of the time for the paper's runs."""
PARTS: dict[str, Any] = {"gusts": measured_gusts, "budget": damage_budget}
"""Modules of the parts that are run on request."""


@dataclass(frozen=True)
class Results:
    """Results of the paper's runs and of those beyond it; parts by name."""

    runs: YawProtectionRuns
    more: Beyond
    parts: Mapping[str, Any] = field(default_factory=dict)


def _figure_10(sign: Sign, time: float) -> tuple[str, Callable[[YawProtectionRuns], Figure]]:
    return (
        f"Figure 10: {SIGNS[sign]} change within {time:g} s, 12.6 rpm, default yaw control; dotted: the paper's",
        lambda runs: figures.figure_10(runs.gusts.first(sign, time)),
    )


FIGURES: dict[str, tuple[str, Callable[[YawProtectionRuns], Figure]]] = {
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
    "fig07_supervisor": ("Figure 7: the supervisor, drawn from its table", lambda runs: plot_states()),
    "fig08_recheck": ("Figure 8: derate and look again, from the table", lambda runs: plot_states("yaw")),
    "fig09_wind": (
        "Figure 9: the gust with direction change, both directions, within 20 s and within 10 s",
        lambda runs: figures.gust_wind(runs.gusts),
    ),
    "fig10_strategies": _figure_10(1, STATED),
    "fig10_counter": _figure_10(-1, STATED),
    "fig10_iec": _figure_10(1, RISE_TIME),
    "fig10_iec_counter": _figure_10(-1, RISE_TIME),
}


def run(
    *, quick: bool, workers: int | None, progress: Progress, partly: Callable[[Results], object], parts: Sequence[str]
) -> Results:
    """Run all simulations; ``partly`` is called with the paper's complete runs, the others marked as missing."""
    runs = run_all(QUICK if quick else YawProtectionSetup(), workers=workers, progress=span(progress, 0.0, SHARE))
    later: Any = FailedResult("not run yet")
    partly(Results(runs, Beyond(later, later, later, later)))
    turbine, rest = runs.turbines[1], (1.0 - SHARE) / (1 + len(parts))
    limits: dict[str, Any] = {"limit_seeds": runs.setup.limit_seeds, "progress": span(progress, SHARE, rest)}
    more = beyond.study(turbine, quick, workers=workers, **limits)
    studies = {
        "gusts": lambda **given: measured_gusts.study(turbine, more.limits.base_points, quick, **given),
        "budget": lambda **given: damage_budget.study(turbine, beyond.site().mean, quick, **given),
    }
    requested = {name: partial(studies[name], workers=workers) for name in parts}
    left = span(progress, SHARE + rest, 1.0 - SHARE - rest)
    return Results(runs, more, run_parts(requested, left, lambda done: partly(Results(runs, more, done))))


def calibration_words(runs: YawProtectionRuns) -> str:
    """Text of the two calibrated numbers."""
    c = runs.calibration
    chord, drag = c.errors
    return f"chord times {c.chord:.2f} ± {chord:.2f}, drag coefficient {c.drag:+.4f} ± {drag:.4f}, from bins 5 to 7"


def bins_table(runs: YawProtectionRuns) -> Table:
    """Table 2 of the paper and ours."""
    columns = [
        ("mean power [kW]", POWER, "mean", "power_mean"),
        ("std of power [kW]", POWER, "std", "power_std"),
        ("mean moment [kNm]", MOMENT, "mean", "moment_mean"),
        ("std of moment [kNm]", MOMENT, "std", "moment_std"),
    ]
    head, groups = ["bin", "m/s", "sets"], [("", 3)]
    for title, *_ in columns:
        head += ["measured", *runs.tables]
        groups.append((title, 1 + len(runs.tables)))
    rows = []
    for i, r in enumerate(measured()):
        row = [str(r.bin), f"{r.speed:g}", str(r.sets)]
        for _, name, of, column in columns:
            values = [table.column(name, of)[i] for table in runs.tables.values()]
            lost = [r.bin in table.lost for table in runs.tables.values()]
            row.append(f"{getattr(r, column):.0f}")
            row += ["failed" if failed else f"{x:.0f}" for failed, x in zip(lost, values, strict=True)]
        rows.append(row)
    seeds, period = len(runs.setup.seeds), runs.setup.period
    note = f"Ours: {seeds} seeds a bin, {period:g} s each; calibrated: {calibration_words(runs)}."
    return Table(head, rows, "Table 2 of the paper and ours", groups=groups, text_columns=1, note=note)


def loops_table(runs: YawProtectionRuns) -> Table:
    """Table of the tried speed loops."""
    loop = runs.loop
    rows = [["measured", *(f"{x:.0f}" for x in loop.target), ""]]
    rows += [
        [f"{factor:g}", *(f"{x:.0f}" for x in std), f"{loop.off(factor):.1f}"] for factor, std in loop.power_std.items()
    ]
    head = ["frequency over the usual one", *(f"bin {k}\nkW" for k in LOOP_BINS), "rms off\nkW"]
    note = f"Std of power as scaled, {len(runs.setup.limit_seeds)} seeds; chosen by the least squares: {loop.chosen:g}."
    return Table(head, rows, "Frequency of the speed loop", note=note)


def grid_words(more: Beyond) -> str:
    """Derating against ignoring over the grid of gusts."""
    bending, lost = (costs(more.grid.rows, "S2", name) for name in (f"{YAW_BENDING}, extreme", "energy"))
    return sentence("grid", winds=winds_of(more.grid), bending=bending, lost=lost)


def lead(lines: Sequence[Claim], runs: YawProtectionRuns, more: Beyond) -> str:
    """The result in a few sentences."""
    parts = [
        count_held(lines),
        sentence("commanded", count=sum(c.basis == "command" for c in lines)),
        guarded_text(lambda: gust_words(runs.gusts), "The gust"),
        guarded_text(lambda: grid_words(more), "The grid of gusts"),
    ]
    return " ".join(parts)


def contents(results: Results, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    runs, more = results.runs, results.more
    lines = claims(runs, more.years)
    table = claims_table([c for c in lines if c.basis != "surrogate"])
    surrogate = claims_table([c for c in lines if c.basis == "surrogate"], "Surrogate against measurement")
    ratios = guarded_table("Ratios of loads", lambda: ratios_table(runs.gusts))
    strategies: list[Block] = [
        ratios,
        guarded_table("What makes the peaks", lambda: causes_table(runs.gusts)),
        guarded_text(lambda: slowed_words(runs.gusts), "Derating by speed"),
        *guarded(lambda: loads_tables(runs.gusts), lambda why: []),
        guarded_table("The log", lambda: log_table(runs.gusts, runs.recheck)),
    ]
    loops = guarded_table("Frequency of the speed loop", lambda: loops_table(runs))
    bins = guarded_table("Table 2 of the paper and ours", lambda: bins_table(runs))
    chapters = {
        "claims": Section("Claim by claim", [table, *reason_lines(REASONS)]),
        "strategies": Section("Loads of the strategies", strategies),
        "table2": Section("Surrogate against measurement", [sentence("surrogate"), loops, bins, surrogate]),
        "beyond": beyond.chapter(more, draw),
    }
    chapters |= {name: PARTS[name].chapter(part, draw) for name, part in results.parts.items()}
    facts = [
        ("turbines", ", ".join(turbine.name for turbine in runs.turbines)),
        ("calibration", guarded(partial(calibration_words, runs), str)),
        ("seeds", ", ".join(map(str, runs.setup.seeds))),
    ]
    files = [] if isinstance(more.grid, FailedResult) else [out / "grid.csv"]
    for file in files:
        more.grid.rows.to_csv(file, index=False, float_format="%.6g")
    return Contents(lead(lines, runs, more), chapters, facts, [brief(table), ratios], files)


@dataclass(frozen=True)
class OfTurbine:
    """The strategies in the gust, and what lies beyond the paper, of another turbine."""

    gusts: Gusts
    more: Beyond


def of_turbine(turbine: Turbine) -> Study[OfTurbine]:
    """The strategies on another turbine: in the gust, over the grid of gusts, in a year of wind."""

    def run_both(*, quick: bool, workers: int | None, progress: Progress, **_: Any) -> OfTurbine:
        begin = step_progress(span(progress, 0.0, 0.2), "gust with direction change")
        machine = with_yaw_rate(turbine, turbine.yaw.rate or YAW_RATE)
        speed = beyond.rated_wind(machine) + 2.0
        given = {"averages": [max(YAW_CONTROLS)], "speed": speed, "limited": turbine.rated_power * 2.0 / 3.0}
        pair = attempt("gust", run_gusts, {turbine.name: machine}, 2 if quick else 4, workers, begin, **given)
        gusts = pair if isinstance(pair, FailedResult) else pair[0]
        more = beyond.study(machine, quick, speed=speed, workers=workers, progress=span(progress, 0.2, 0.8))
        return OfTurbine(gusts, more)

    def contents_of(results: OfTurbine, out: Path, draw: Draw) -> Contents:
        g, more = results.gusts, results.more
        ratios = guarded_table("Ratios of loads", lambda: ratios_table(g))
        drawn = [
            draw(
                f"gust_{words.replace('-', '_')}_{time:g}s",
                f"The strategies, {words} change within {time:g} s",
                lambda sign=sign, time=time: figures.gust_runs(g.first(sign, time)),  # type: ignore[misc]
            )
            for time, (sign, words) in product(TIMES, SIGNS.items())
        ]
        slower = guarded_text(lambda: slowed_words(g), "Derating by speed")
        chapters = {
            "strategies": Section("Loads of the strategies", [ratios, slower, *drawn]),
            "beyond": beyond.chapter(more, draw),
        }
        lead = f"{guarded_text(lambda: gust_words(g), 'The gust')} {guarded_text(lambda: grid_words(more), 'The grid')}"
        facts = [
            ("turbine", turbine.name),
            ("turbulence", f"class {beyond.WIND_CLASS}, for limits and production"),
            ("year", f"the paper's site: mean wind {beyond.site().mean:g} m/s, intensities of its Table 2"),
        ]
        return Contents(lead, chapters, facts, [ratios])

    title = "Yaw-error limits and derating of Wang et al. (2021)"
    return applied(STUDY, turbine, title, run=run_both, contents=contents_of)


STUDY: Study[Results] = Study(
    name="wang2021",
    title="Wang et al. (2021): derate and look again instead of shutting down, reproduced",
    source="Wang, Y., Cai, X., Xu, B., Li, Z. (2021): yaw error strategy of a wind turbine by multibody dynamics. "
    "Frontiers in Energy Research 9, 711927.",
    run=run,
    runs=lambda results: results.runs,
    figures=FIGURES,
    contents=contents,
    parts=tuple(PARTS),
    applied=of_turbine,
    needs=("pandas",),
)
