"""Reasons why our results differ from the paper's, each with the experiment that shows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from meltemi.papers.claim import reasons_of, rows_of
from meltemi.papers.he2018.claims import Stated, as_far, scheme_change
from meltemi.papers.he2018.designs import WHOLE_LEAD
from meltemi.papers.he2018.measures import change, edgewise, likelihood, percent, share_of_harmonics
from meltemi.papers.he2018.runs import (
    CALM,
    CLASS_B,
    EDITION_2,
    FAST,
    FULL,
    HALF,
    LESS,
    MODEL_PARTS,
    SHORT,
    THREE,
    LoadControlRuns,
)
from meltemi.postprocess.ensemble import mean_interval
from meltemi.reports.ensemble_tables import with_interval
from meltemi.tuning.compare import Comparison

STATED_MYC = [rows_of("he2018", "claims.csv")[key] for key in ("1", "2", "24", "25")]
"""Standard deviation and equivalent load of RootMyc1, by IPC and CPFC."""


def reasons(runs: LoadControlRuns) -> dict[str, str]:
    """Reasons for differences, by key, each with the experiment that shows it."""
    c = runs.readings[CLASS_B]
    calm, less = ({FAST: runs.study(f"{FAST}, {name}"), FULL: runs.study(name)} for name in (CALM, LESS))
    loops = {scheme: runs.bench.loops(scheme)[0] for scheme in THREE[1:]}
    parts = {**{name: runs.study(name) for name in MODEL_PARTS}, "with all three": runs.fast[CLASS_B]}
    over = partial(change, quantity="RootMyc1 std", scheme="cpfc", base="ipc")
    second = {name: x for name, x in runs.judged.items() if name.endswith(SHORT[EDITION_2])}
    words = {
        "shares": _each(runs.judged, lambda c: f"{share_of_harmonics(c):.0f} %"),
        "asked": f"{100.0 * (1.0 - (1.0 - 0.553) ** 2):.0f}",
        "less": _each(less, lambda c: ", ".join(_change_and_p(c, row) for row in STATED_MYC)),
        "over": percent(over(c)),
        "parts": ", ".join(
            f"{with_interval(mean_interval(over(x) - over(c)), 1, '+')} percentage points {name}"
            for name, x in parts.items()
        ),
        "second": _each(second, lambda c: f"{percent(over(c, quantity='RootMyc1 DEL'))} and {percent(over(c))}"),
        "edge": _each({FAST: runs.fast[CLASS_B], FULL: c}, _edge),
        "whole": percent(change(c, "RootMxc1 DEL", WHOLE_LEAD)),
        "likely": _each(runs.judged, likelihood),
        "factor": f"{loops['cpfc'].integral_gain / loops['ipc'].integral_gain:.2f}",
        "half": _each(runs.judged, lambda c: percent(change(c, "RootMyc1 DEL", HALF))),
        "calm": _each(calm, lambda c: _alone(c, "feedforward")),
        "calm_half": _each(calm, lambda c: _alone(c, HALF)),
    }
    return {key: text.format(**words) for key, text in reasons_of("he2018").items()}


def _each(found: Mapping[str, Comparison], words: Callable[[Comparison], str]) -> str:
    return "; ".join(f"{name}: {words(c)}" for name, c in found.items())


def _change_and_p(c: Comparison, stated: Stated) -> str:
    x, within, _ = as_far(c, stated)
    what = f"{stated['quantity'].split()[1]} {percent(scheme_change(c, stated))} by {stated['scheme'].upper()}"
    return f"{what} ({within} of {len(x)} minutes as far)"


def _edge(c: Comparison) -> str:
    return ", ".join(f"{edgewise(c, scheme) * 1e-3:.0f} kN m with {scheme.upper()}" for scheme in THREE)


def _alone(c: Comparison, scheme: str) -> str:
    return percent(change(c, "RootMyc1 DEL", scheme))
