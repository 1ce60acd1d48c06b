"""Tables and sentences on the strategies in the paper's gust."""

from __future__ import annotations

from itertools import product

import numpy as np

from meltemi.papers.wang2021.gust import (
    AT_ONCE,
    DERATE,
    EMERGENCY,
    GENTLE,
    IGNORE,
    INTERPOLATED,
    RATIOS,
    SHORT,
    SIGNS,
    SLOWED,
    STOP,
    Gusts,
    ordered,
    peaks,
    spread,
)
from meltemi.papers.wang2021.winds import TIMES
from meltemi.papers.wang2021.words import sentence
from meltemi.reports.blocks import Table
from meltemi.simulation.result import Result
from meltemi.studies.machine_loads import TOP_SHEAR, YAW_BENDING

EXPERIMENTS = (
    (GENTLE, STOP, YAW_BENDING),
    (INTERPOLATED, STOP, YAW_BENDING),
    (AT_ONCE, DERATE, YAW_BENDING),
    (AT_ONCE, DERATE, TOP_SHEAR),
)
"""What is changed, what it is compared with, and of which load."""


def ratios_table(g: Gusts) -> Table:
    """Table of ratios of loads by setting, over the phases."""
    against = [(load, DERATE, other) for load, other in RATIOS]
    against += [(YAW_BENDING, STOP, IGNORE)]
    if all(EMERGENCY in x.results for phases in g.phases.values() for x in phases):
        against.append((YAW_BENDING, DERATE, EMERGENCY))
    head = ["machine", "yaw average\ns", "change", "within\ns"]
    head += [
        f"{load}\n{strategy[:2]} over {other if other == EMERGENCY else other[:2]}" for load, strategy, other in against
    ]
    head += ["tower top\nS1 < S2 < S3"]
    rows = []
    for s in g.phases:
        x = g.values(s, ordered)
        cells = [spread(g.ratios(s, load, other, strategy)) for load, strategy, other in against]
        rows.append([s.machine, f"{s.average:g}", SIGNS[s.sign], f"{s.time:g}", *cells, f"{x.sum():.0f} of {len(x)}"])
    note = (
        f"Smallest to largest over {len(next(iter(g.phases.values())))} azimuths of the rotor. The default yaw control "
        "averages over 30 s and starts after 10 s; the others start at once. The paper gives neither, and no "
        "direction; the change takes 20 s in its text and 10 s in the standard's gust."
    )
    return Table(head, rows, "Peaks of derating over those of stopping and ignoring", text_columns=1, note=note)


def causes_table(g: Gusts) -> Table:
    """Table of experiments on the causes of the peaks: each changes one parameter in the same gust and phase."""
    rows = []
    for s, (strategy, against, load) in product(g.shown, EXPERIMENTS):
        ratio = spread(g.ratios(s, load, against, strategy))
        rows.append([f"{strategy} over {against}", load, SIGNS[s.sign], f"{s.time:g}", ratio])
    for (sign, words), name, load in product(SIGNS.items(), (STOP, DERATE, IGNORE), (YAW_BENDING, TOP_SHEAR)):
        long, short = (
            g.values(next(s for s in g.shown if (s.sign, s.time) == (sign, time)), lambda x: x.peak(name, load))  # noqa: B023
            for time in TIMES
        )
        if len(long) == len(short):
            times = " over ".join(f"{time:g}" for time in TIMES)
            rows.append([f"{name} within {times} s", load, words, times, spread(long / short)])
    head = ["experiment", "load", "change", "within\ns", "ratio of the peaks"]
    note = "Default yaw control, 12.6 rpm; smallest to largest over the azimuths of the rotor."
    return Table(head, rows, "What makes the peaks", text_columns=4, note=note)


def loads_tables(g: Gusts) -> list[Table]:
    """Tables of peak loads after the start of the gust, by rise time and direction."""
    tables = []
    for time, (sign, words) in product(TIMES, SIGNS.items()):
        gust = g.first(sign, time)
        head = ["largest size after the gust began", *gust.results, "S2 over S1", "S2 over S3"]
        caption = f"Loads of the strategies, {words} change within {time:g} s, 12.6 rpm, default yaw control, "
        tables.append(Table(head, peaks(gust), f"{caption}first phase"))
    return tables


def log_table(g: Gusts, recheck: Result) -> Table:
    """Table of the supervisor's transitions."""
    results = {**g.first(1).results, SHORT: recheck}
    rows = [
        [name, f"{entry.time:.2f}", entry.what, entry.reason]
        for name, result in results.items()
        for entry in result.log
    ]
    return Table(["strategy", "time [s]", "transition", "reason"], rows, "The supervisor's log", text_columns=4)


def slowed_words(g: Gusts) -> str:
    """Text on derating by rotor speed against derating by torque, and on emergency against normal stops."""
    parts = []
    for setting in g.shown:
        whole = [x for x in g.phases[setting] if SLOWED in x.results and EMERGENCY in x.results]
        bending, shear, stop = (
            spread(np.array([x.ratio(load, against, strategy) for x in whole]))
            for load, against, strategy in (
                (YAW_BENDING, DERATE, SLOWED),
                (TOP_SHEAR, DERATE, SLOWED),
                (YAW_BENDING, STOP, EMERGENCY),
            )
        )
        kind = {"direction": SIGNS[setting.sign], "time": setting.time}
        parts.append(sentence("slowed ratio", bending=bending, shear=shear, stop=stop, **kind))
    return sentence("slowed", ratios="; ".join(parts))


def gust_words(g: Gusts) -> str:
    """Text on where derating has lower or higher loads than the other strategies in the paper's gust, by reading."""
    machine = next(iter(g.phases)).machine
    ratios, peaks_of_stopping, worst = [], [], {}
    for time, (sign, words) in product(TIMES, SIGNS.items()):
        kind = {"direction": words, "time": time}
        stop, ignore = (
            spread(g.over_all(lambda x, other=other: x.ratio(YAW_BENDING, other), machine, sign, time))  # type: ignore[misc]
            for other in (STOP, IGNORE)
        )
        ratios.append(sentence("ratio", stop=stop, ignore=ignore, **kind))
        stop_peak = float(np.median(g.over_all(lambda x: x.peak(STOP, YAW_BENDING), machine, sign, time)))
        peaks_of_stopping.append(sentence("peak", peak=stop_peak, **kind))
        worst[sentence("governs", **kind)] = float(
            g.over_all(lambda x: max(x.peak(name, YAW_BENDING) for name in x.results), machine, sign, time).max()
        )
    governs = max(worst, key=lambda words: worst[words])
    numbers = {"machine": machine, "ratios": "; ".join(ratios), "peaks": ", ".join(peaks_of_stopping)}
    return sentence("gust", governs=governs, **numbers)
