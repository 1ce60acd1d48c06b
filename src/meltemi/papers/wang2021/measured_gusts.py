"""Strategies in gusts with the rise times of measured ones, with simultaneous changes of speed and direction.

Hannesdóttir and Kelly (2019), Wind Energ. Sci. 4, 385, compare ramps measured at three sites with the coherent gust
with direction change of IEC 61400-1. Their abstract says: the amplitudes of the speed do not exceed the standard's; the
rise time is on average around 200 s, not 10 s; the direction changes more than in the standard several times, but then
within a minute or more. So the gusts here rise within 10 s to 200 s by 10 m/s, which stays below cut-out, and
turn by the standard's angle and by half as much again; a column says what is reported of such turns.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from meltemi.iec.gusts import RISE_TIME
from meltemi.papers.study import Draw, Progress, answer_chapter, step_progress
from meltemi.papers.wang2021.costs import KWH, STRATEGIES, by_wind, longest
from meltemi.papers.wang2021.winds import GUST_SPEED
from meltemi.papers.wang2021.words import sentence
from meltemi.postprocess.ensemble import mean_interval
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.studies.machine_loads import BLADE_ROOT, TOWER_BASE, YAW_BENDING
from meltemi.studies.yaw_gusts import GustGrid, GustResults, run_grid
from meltemi.studies.yaw_limits import BasePoints
from meltemi.turbine.definition import Turbine

TURN = np.radians(720.0 / GUST_SPEED)
"""[rad] direction change of the standard at this wind speed."""
RISE = 10.0
"""[m/s] rise of the wind speed."""
SLOW = 60.0
"""[s] rise time below which no direction change beyond the standard's has been measured."""
JOINT = GustGrid(
    speeds=(GUST_SPEED,),
    rises=(RISE,),
    changes=(TURN, 1.5 * TURN),
    times=(RISE_TIME, 20.0, SLOW, 200.0),
    yaw_rates=(float(np.radians(0.5)),),
    rechecks=(90.0,),
    length=280.0,
)
SHOWN = (YAW_BENDING, TOWER_BASE, BLADE_ROOT)


def study(
    turbine: Turbine, ours: BasePoints | None, quick: bool, *, workers: int | None, progress: Progress
) -> GustResults:
    """Run the strategies in the gusts; ``ours`` are base points from loads."""
    grid = JOINT if not quick else GustGrid(**{**vars(JOINT), "times": (20.0, SLOW), "seeds": (1,), "length": 120.0})
    return run_grid(
        turbine, grid, ours, workers=workers, progress=step_progress(progress, "gusts as slow as measured ones")
    )


def measured(time: float, change: float) -> str:
    """Text on measured gusts with a rise time [s] and direction change [rad]."""
    if change <= TURN + 1e-9:
        return "the standard's turn"
    return "beyond it, size not given" if time >= SLOW else "none so fast"


def gusts_table(results: GustResults) -> Table:
    """Table of stops, energy and loads by rise time, direction change and strategy."""
    rows = []
    every = longest(results)
    for time, change in product(results.grid.times, results.grid.changes):
        gusts = every[(every["time"] == time) & np.isclose(every["change"], change)]
        for name in STRATEGIES:
            runs = gusts[gusts["strategy"] == name]
            if not len(runs):
                continue
            recheck = runs["recheck"].max()
            energy = with_interval(mean_interval(-by_wind(gusts, name, recheck, "energy") / KWH), 0)
            loads = [mean_interval(100.0 * by_wind(gusts, name, recheck, f"{load}, extreme")) for load in SHOWN]
            where = [f"{time:g}", f"{np.degrees(change):.0f}", measured(time, change), name]
            shares = [f"{100.0 * runs[of].mean():.0f}" for of in ("stops", "derates")]
            peak = f"{runs[f'{YAW_BENDING}, extreme'].max():.1f}"
            rows.append([*where, *shares, energy, *(with_interval(e, 0, "+") for e in loads), peak])
    head = ["within\ns", "change\ndeg", "measured", "strategy", "stops\n%", "derates\n%", "energy lost\nkWh a gust"]
    head += [f"{load}\nextreme %" for load in SHOWN] + [f"{YAW_BENDING}\nlargest MN m"]
    note = sentence("measured", speed=GUST_SPEED, rise=RISE, seeds=len(results.grid.seeds))
    return Table(head, rows, "The strategies in gusts that rise more slowly", text_columns=4, note=note)


def verdict(results: GustResults) -> str:
    """Conclusion on the strategies in slow gusts."""
    rows = longest(results)
    slow = rows[rows["time"] >= SLOW]
    fast = rows[(rows["time"] < SLOW) & np.isclose(rows["change"], results.grid.changes[0])]
    numbers: dict[str, object] = {}
    for word, part in (("fast", fast), ("slow", slow)):
        share = 100.0 * part.groupby("strategy")["stops"].mean()
        passed = 100.0 * (part[part["strategy"] == "S2"]["derates"] > 0).mean()
        numbers |= {f"{word}_S1": share["S1"], f"{word}_S2": share["S2"], f"{word}_passed": passed}
        for name, column in (("S1", "stop"), ("S2", "derate")):
            recheck = part[part["strategy"] == name]["recheck"].max()
            energy = mean_interval(-by_wind(part, name, recheck, "energy") / KWH)
            bending = mean_interval(100.0 * by_wind(part, name, recheck, f"{YAW_BENDING}, extreme"))
            numbers |= {f"{word}_{column}_lost": with_interval(energy, 0)}
            numbers |= {f"{word}_{column}": with_interval(bending, 0, "+")}
        numbers[f"{word}_peak"] = part[part["strategy"] == "S3"][f"{YAW_BENDING}, extreme"].max()
    return sentence("slow gusts", **numbers)


def chapter(rows: GustResults, draw: Draw) -> Section:
    """Chapter of the gusts that rise as slowly as measured ones."""
    return answer_chapter(
        "Beyond the paper: gusts as slow as measured ones", lambda: verdict(rows), [], lambda: [gusts_table(rows)]
    )
