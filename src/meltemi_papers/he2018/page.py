"""Page of the study: claims, conditions, ceilings, checks, gains, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from meltemi.postprocess.ensemble import MeanEstimate
from meltemi.report.html import Table
from meltemi.report.tables import number
from meltemi.report.tuning_plots import plot_tuning
from meltemi.studies.run_store import guarded
from meltemi.studies.scheme_names import SCHEMES
from meltemi_papers.claim import UNJUDGED, reason_lines
from meltemi_papers.he2018 import beyond
from meltemi_papers.he2018.checks import checks
from meltemi_papers.he2018.claims import Row, acceptances, ceilings, change, claims, minutes, percent, reasons
from meltemi_papers.he2018.figures import FIGURES, over_speeds
from meltemi_papers.he2018.runs import CLASS_B, Runs, run_all
from meltemi_papers.study import Chapter, Content, Contents, Draw, Study, tabled, worded


def row_cells(row: Row) -> list[str]:
    """Cells of a claim."""
    ours = [text for pair in row.ours for text in pair]
    return [row.quantity, row.scheme, row.paper, *ours, " / ".join(row.verdict), row.reason, row.where]


def claims_table(runs: Runs) -> Table:
    """Table of claims."""
    n = len(runs.setup.seeds)
    head = ["quantity", "scheme", "paper"]
    groups = [("", 3)]
    for reading in runs.readings:
        head += [f"{runs.setup.transient:g}-{runs.setup.duration:g} s", "{:g}-{:g} s".format(*runs.setup.window)]
        groups.append((reading, 2))
    head += ["verdict", "reason", "where"]
    groups.append(("", 3))
    rows = [row_cells(row) for row in claims(runs)]
    note = f"Changes against CPC, means over {n} seeds with 95 % intervals; verdicts for the two readings of the wind."
    return Table(head, rows, "Claims of the paper", text_columns=3, groups=groups, note=note)


def brief_claims(runs: Runs) -> Table:
    """The table for a terminal, without time window, reasons and places."""
    full = claims_table(runs)
    kept = [0, 1, 2, *range(3, 3 + 2 * len(runs.readings), 2), len(full.head) - 3]
    head = ["quantity", "scheme", "paper", *runs.readings, "verdict"]
    return Table(head, [[row[i] for i in kept] for row in full.rows], full.caption, text_columns=2)


def acceptance_table(runs: Runs) -> Table:
    """Table of conditions that must hold in every seed."""
    head, rows = ["condition"], []
    for reading in runs.readings:
        head += [f"{reading}\nseeds that hold", "least margin"]
    for row in acceptances(runs):
        cells = [row.condition]
        for (held, of), words in zip(row.held, row.numbers, strict=True):
            cells += [f"{held} of {of}", words]
        rows.append(cells)
    return Table(head, rows, "Conditions in every seed", note="Margin: positive where the condition holds.")


def ceiling_table(runs: Runs) -> Table:
    """Table of ceilings and of the fractions that are reached."""

    def share(e: MeanEstimate) -> str:
        return f"{100.0 * e.mean:.0f}" + (f" ± {100.0 * e.half_width:.0f}" if e.n > 1 else "") + " %"

    rows = [
        [
            r.reading,
            r.removed,
            f"{r.std:+.1f} %",
            f"{r.load:+.1f} %",
            r.scheme.upper(),
            share(r.std_share),
            share(r.load_share),
            f"{r.window_std:+.1f} %",
            f"{r.window_load:+.1f} %",
        ]
        for r in ceilings(runs)
    ]
    window = "{:g}-{:g} s".format(*runs.setup.window)
    head = ["wind", "removed ideally", "std", "DEL", "scheme", "share of std", "share of DEL"]
    head += [f"std\n{window}", f"DEL\n{window}"]
    note = "RootMyc1 of CPC with the bands of a quarter of 1P about 1P, or 1P and 2P, taken out; target: 80 % of std."
    return Table(head, rows, "Ceilings", text_columns=2, note=note)


def checks_table(runs: Runs) -> Table:
    """Table of the checks of equations."""
    rows = [
        [c.item, number(c.expected), number(c.found), f"{c.tolerance:g}", c.unit, "holds" if c.ok else "differs"]
        for c in checks(runs)
    ]
    head = ["equation", "expected", "found", "tolerance", "unit", "verdict"]
    note = (
        "Pitch at 20 m/s: the blades twist towards feather under their loads, so they need less pitch; those of the "
        "paper's code are stiff in torsion."
    )
    return Table(head, rows, "The paper's equations, on our parts", note=note)


def gains_table(runs: Runs) -> Table:
    """Table of tuned gains."""
    rows = []
    for name, scheme in SCHEMES.items():
        for tuning in runs.bench.tunings.get(scheme.loops, ()):
            loop, points = tuning.loop, tuning.points
            rows.append(
                [
                    name,
                    f"{loop.harmonic}P {loop.actuator}",
                    f"{loop.integral_gain:.3e}",
                    f"{loop.proportional_gain:.3e}",
                    f"{np.degrees(loop.offset):.1f}",
                    f"{loop.filter_damping:.2f}",
                    f"{min(p.bandwidth for p in points):.2f} to {max(p.bandwidth for p in points):.2f}",
                    f"{np.degrees(min(p.phase_margin for p in points)):.0f}",
                    f"{min(p.gain_margin for p in points):.1f}",
                    f"{max(p.sensitivity for p in points):.2f}",
                    f"{tuning.factor:.2f}",
                ]
            )
    head = ["scheme", "loop", "k_I\nrad/(N m s)", "k_P\nrad/(N m)", "offset\ndeg", "filter\ndamping"]
    head += ["bandwidth\nrad/s", "phase margin\ndeg", "gain margin", "largest\n1/|1+L|", "factor"]
    return Table(head, rows, "Gains by the rule, from the turbine's own linear model", text_columns=2)


def _lead(runs: Runs) -> str:
    found = {(r.reading, r.scheme): r for r in ceilings(runs)}
    ipc, cpfc = found[CLASS_B, "ipc"], found[CLASS_B, "cpfc"]
    c = runs.readings[CLASS_B]
    one, two = (percent(change(c, "RootMyc1 std", scheme)) for scheme in ("ipc", "cpfc"))
    rows = acceptances(runs)
    held, of = (sum(pair[k] for row in rows for pair in row.held) for k in (0, 1))
    everywhere = sum(row.everywhere for row in rows)
    return (
        f"Of {len(rows)} conditions on the order of the schemes, on mean tilt and yaw moments and on the peaks at 1P "
        f"and 2P, {everywhere} hold in every seed of both winds ({held} of {of} single cases). In the class's wind IPC "
        f"changes the standard deviation of the root moment by {one} and CPFC by {two}; the paper has -47.9 and "
        f"-55.3 %. More is hardly there: ideal removal of 1P would give {ipc.std:+.1f} %, of 1P and 2P "
        f"{cpfc.std:+.1f} %. IPC reaches {100 * ipc.std_share.mean:.0f} % of that, CPFC "
        f"{100 * cpfc.std_share.mean:.0f} %."
    )


def contents(runs: Runs, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""

    def in_minutes(runs: Runs) -> Table:
        return beyond.minutes_table([("ipc", minutes(runs, "ipc"), -47.9), ("cpfc", minutes(runs, "cpfc"), -55.3)])

    wanted: dict[str, tuple[str, list[Callable[[Runs], Table]]]] = {
        "claims": ("Claim by claim", [claims_table]),
        "conditions": ("In every seed", [acceptance_table]),
        "ceilings": ("How much was there to gain", [ceiling_table]),
        "winds": ("In which wind the paper's figures hold", [beyond.winds, in_minutes]),
        "equations": ("The equations", [checks_table]),
        "gains": ("Gains", [gains_table]),
        "rivals": ("Rivals, parts and preview", [beyond.rivals]),
        "travel": ("Flap loops at equal travel", [beyond.equal_travel]),
        "below_rated": ("Below rated", [beyond.below_rated]),
        "lifetime": ("A lifetime, and what the actuators pay", [beyond.lifetime]),
    }
    cpfc = SCHEMES["cpfc"].loops
    tunings = zip(cpfc, runs.bench.tunings[cpfc], strict=True)
    loops = {f"{harmonic}P {actuator}": tuning for (actuator, harmonic), tuning in tunings}
    below: dict[str, list[Content]] = {
        "claims": [*reason_lines(guarded(partial(reasons, runs), lambda why: {"reasons": UNJUDGED + why}))],
        "gains": [draw("bode", "Loops of CPFC", lambda: plot_tuning(loops))],
        "lifetime": [
            draw("beyond_speeds", "Beyond the paper: changes over wind speed", lambda: over_speeds(runs)),
            "### Which scheme we would build",
            worded(partial(beyond.verdict, runs), "Which scheme to build"),
        ],
    }
    turbine, setup = runs.bench.model.turbine, runs.setup
    return Contents(
        lead=worded(partial(_lead, runs), "What came of it"),
        chapters={
            name: Chapter(heading, [*(tabled(heading, partial(of, runs)) for of in several), *below.get(name, [])])
            for name, (heading, several) in wanted.items()
        },
        facts=[
            ("turbine", f"{turbine.name}, flaps 66 to 96 % of the span, pitch actuator 11.11 rad/s"),
            ("wind", "20 m/s, von Karman, shear exponent 0.2; " + "; ".join(runs.readings)),
            ("seeds", ", ".join(str(seed) for seed in setup.seeds)),
            ("runs", f"{setup.duration:g} s, the first {setup.transient:g} s not judged"),
        ],
        shown=[
            tabled("Claims of the paper", lambda: brief_claims(runs)),
            tabled("Conditions in every seed", lambda: acceptance_table(runs)),
            tabled("Ceilings", lambda: ceiling_table(runs)),
        ],
    )


STUDY = Study(
    name="he2018",
    title="He et al. (2018): combined individual pitch and flap control, reproduced",
    source="He, K., Qi, L., Zheng, L., Chen, Y. (2018): Combined pitch and trailing edge flap control for load "
    "mitigation of wind turbines. Energies 11, 2519.",
    run=run_all,
    figures=FIGURES,
    contents=contents,
    texts=("duel.md", "after.md"),
)
