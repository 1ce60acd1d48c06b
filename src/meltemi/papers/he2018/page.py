"""Page of the study: claims, ceilings, gains, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from meltemi.controllers.names import SCHEMES
from meltemi.papers.claim import Claim, brief, claims_table, reason_lines
from meltemi.papers.he2018 import beyond, search
from meltemi.papers.he2018.claims import claims, counts_words, not_detuned, reasons, verdicts_table
from meltemi.papers.he2018.figures import FIGURES, bode, over_speeds
from meltemi.papers.he2018.measures import CEILINGS, change, likelihood, percent, reached, sentence
from meltemi.papers.he2018.runs import BEST, CLASS_B, PAPER, PREVIEWS, LoadControlRuns, run_all
from meltemi.papers.study import Contents, Draw, Study, applied, guarded_table, guarded_text
from meltemi.papers.verdict import UNJUDGED
from meltemi.reports.blocks import Block, Section, Subsection, Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.tuning.compare import WHOLE
from meltemi.tuning.run_store import guarded
from meltemi.turbine.definition import Turbine


def ceiling_table(runs: LoadControlRuns) -> Table:
    """Table of ceilings and of the fractions that are reached."""
    rows, window = [], False
    for reading, c in runs.readings.items():
        window = PAPER in c.windows
        for scheme, n in CEILINGS.items():
            whole, part = (
                [f"{100.0 * c.ceiling_change(n, name, of).mean:+.1f} %" for name in ("std", "load")]
                for of in (WHOLE, PAPER if window else WHOLE)
            )
            shares = [f"{with_interval(reached(c, scheme, name), 0, factor=100.0)} %" for name in ("std", "load")]
            removed = " and ".join(f"{k}P" for k in range(1, n + 1))
            rows.append([reading, removed, *whole, scheme.upper(), *shares, *(part if window else [])])
    head = ["wind", "removed ideally", "std", "DEL", "scheme", "share of std", "share of DEL"]
    head += [f"std\n{PAPER}", f"DEL\n{PAPER}"] if window else []
    note = "RootMyc1 of CPC with the bands of a quarter of 1P about 1P, or 1P and 2P, taken out."
    return Table(head, rows, "Ceilings", text_columns=2, note=note)


def gains_table(runs: LoadControlRuns) -> Table:
    """Table of tuned gains."""
    rows = []
    for name, scheme in SCHEMES.items():
        for tuning in runs.bench.tunings.get(scheme.loops, ()):
            loop, points = tuning.loop, tuning.points
            gains = [f"{loop.integral_gain:.3e}", f"{loop.proportional_gain:.3e}"]
            shape = [f"{np.degrees(loop.offset):.1f}", f"{loop.filter_damping:.2f}"]
            bandwidth = f"{min(p.bandwidth for p in points):.2f} to {max(p.bandwidth for p in points):.2f}"
            phase, gain = min(p.phase_margin for p in points), min(p.gain_margin for p in points)
            margins = [f"{np.degrees(phase):.0f}", f"{gain:.1f}", f"{max(p.sensitivity for p in points):.2f}"]
            where = [name, f"{loop.harmonic}P {loop.actuator}"]
            rows.append([*where, *gains, *shape, bandwidth, *margins, f"{tuning.factor:.2f}"])
    head = ["scheme", "loop", "k_I\nrad/(N m s)", "k_P\nrad/(N m)", "offset\ndeg", "filter\ndamping"]
    head += ["bandwidth\nrad/s", "phase margin\ndeg", "gain margin", "largest\n1/|1+L|", "factor"]
    note = "Margins over all frequencies up to half the sampling rate, smallest of all operating points."
    return Table(head, rows, "Gains by the rule, from the linear model of the turbine", text_columns=2, note=note)


def _lead(runs: LoadControlRuns, lines: list[Claim], beside: list[Claim]) -> str:
    c = runs.readings[CLASS_B]
    share = {scheme: f"{100.0 * reached(c, scheme, 'std').mean:.0f} %" for scheme in CEILINGS}
    ideal, worst = (percent(change(c, "RootMyc1 std", scheme)) for scheme in (BEST, PREVIEWS[-1]))
    tower = percent(change(c, "TwrBsMyt DEL", PREVIEWS[-1]))
    wind = guarded(lambda: search.intensity_text(search.estimate(runs)), lambda why: "")

    def std(scheme: str) -> str:
        return ", ".join(percent(change(c, "RootMyc1 std", scheme)) for c in runs.judged.values())

    numbers = {"ipc": std("ipc"), "cpfc": std("cpfc"), "ipc_share": share["ipc"], "cpfc_share": share["cpfc"]}
    numbers |= {"counts": counts_words(lines, beside, list(runs.judged)), "wind": wind}
    probabilities = ", ".join(likelihood(c) for c in runs.judged.values())
    return sentence("lead", probabilities=probabilities, ideal=ideal, worst=worst, tower=tower, **numbers)


def _chapters(runs: LoadControlRuns, draw: Draw, *, paper: bool) -> dict[str, Section]:
    """Contents that do not depend on the paper's numbers, and for its turbine those that hold only for it."""
    divided = "Division of frequencies and the edgewise mode" if paper else "Division of frequencies"
    built = Subsection(
        "Which scheme we would build", [guarded_text(partial(beyond.verdict, runs), "Which scheme to build")]
    )
    not_detuned = guarded_text(partial(beyond.not_detuned, runs), "CPFC that is not detuned")
    wanted: dict[str, tuple[str, list[Callable[[LoadControlRuns], Table]]]] = {
        "ceilings": ("How much was there to gain", [ceiling_table]),
        "gains": ("Gains", [gains_table]),
        "division": (divided, [partial(beyond.division, edge=paper)]),
        "best": ("The best combination beside the paper's", [partial(beyond.best, reading=r) for r in runs.readings]),
        "rivals": ("Rivals and parts", [beyond.rivals]),
        "travel": ("Flap loops at equal travel", [beyond.equal_travel]),
        "below_rated": ("Below rated", [beyond.below_rated]),
        "lifetime": ("A lifetime, and what the actuators pay", [beyond.lifetime]),
    }
    cpfc = SCHEMES["cpfc"].loops
    tunings = zip(cpfc, runs.bench.tunings[cpfc], strict=True)
    loops = {f"{harmonic}P {actuator}": tuning for (actuator, harmonic), tuning in tunings}
    below: dict[str, list[Block]] = {
        "gains": [draw("bode", "Loops of CPFC", lambda: bode(loops))],
        "division": [not_detuned, *([beyond.DIVISION] if paper else [])],
        "best": [beyond.LIDAR],
        "lifetime": [
            draw("beyond_speeds", "Beyond the paper: changes over wind speed", lambda: over_speeds(runs)),
            *([built] if paper else []),
        ],
    }
    return {
        name: Section(heading, [*(guarded_table(heading, partial(of, runs)) for of in several), *below.get(name, [])])
        for name, (heading, several) in wanted.items()
    }


def _facts(runs: LoadControlRuns) -> list[tuple[str, str]]:
    turbine, setup = runs.bench.model.turbine, runs.setup
    flaps = ", ".join(f"{100.0 * flap.begin:.0f} to {100.0 * flap.end:.0f} %" for flap in turbine.blade.flaps)
    actuator = f"{turbine.pitch_actuator.natural_frequency:g} rad/s"
    return [
        ("turbine", f"{turbine.name}, flaps {flaps} of the span, pitch actuator {actuator}"),
        ("wind", "20 m/s, von Karman, shear exponent 0.2; " + "; ".join(runs.readings)),
        ("seeds", ", ".join(str(seed) for seed in setup.seeds)),
        ("runs", f"{setup.duration:g} s, the first {setup.transient:g} s not judged"),
    ]


def contents(runs: LoadControlRuns, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    lines = claims(runs)
    beside = guarded(lambda: claims(runs, not_detuned(runs.judged)), lambda why: [])
    words = sentence("claims", seeds=len(runs.setup.seeds), readings=", ".join(runs.judged))

    def verdicts() -> Table:
        return guarded_table("Verdicts by model and wind", lambda: verdicts_table(lines, beside, list(runs.judged)))

    why = reason_lines(guarded(partial(reasons, runs), lambda why: {"reasons": UNJUDGED + why}))
    winds = [guarded_table("Other winds", partial(of, runs)) for of in (beyond.winds, search.search_table)]
    likely: list[Block] = [
        guarded_text(lambda: search.wind_estimate_text(search.estimate(runs)), "The most likely wind"),
        draw("likelihood", "Likelihood of the paper's changes by wind", lambda: search.surface(runs)),
    ]
    return Contents(
        lead=guarded_text(partial(_lead, runs, lines, beside), "What came of it"),
        chapters={
            "readings": Section("By model and wind", [verdicts()]),
            "claims": Section("Claim by claim", [claims_table(lines), words, *why]),
            "winds": Section("In which wind the paper's figures hold", [*winds, *likely]),
            **_chapters(runs, draw, paper=True),
        },
        facts=_facts(runs),
        shown=[brief(claims_table(lines)), verdicts(), guarded_table("Ceilings", lambda: ceiling_table(runs))],
    )


def of_turbine(turbine: Turbine) -> Study[LoadControlRuns]:
    """The schemes on another turbine, in the wind of the class."""

    def contents_of(runs: LoadControlRuns, out: Path, draw: Draw) -> Contents:
        lead, rivals = guarded_text(partial(beyond.findings_text, runs), "The schemes"), partial(beyond.rivals, runs)
        return Contents(lead, _chapters(runs, draw, paper=False), _facts(runs), [guarded_table("Schemes", rivals)])

    words = "Combined pitch and flap control of He et al. (2018)"
    return applied(STUDY, turbine, words, run=partial(run_all, turbine=turbine), contents=contents_of)


STUDY: Study[LoadControlRuns] = Study(
    name="he2018",
    title="He et al. (2018): combined individual pitch and flap control, reproduced",
    source="He, K., Qi, L., Zheng, L., Chen, Y. (2018): Combined pitch and trailing edge flap control for load "
    "mitigation of wind turbines. Energies 11, 2519.",
    run=run_all,
    figures=FIGURES,
    contents=contents,
    texts=("rosco.md", "after.md"),
    applied=of_turbine,
)
