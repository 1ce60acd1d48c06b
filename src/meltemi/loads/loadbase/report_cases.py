"""Sections of the report of a load base about its cases: statistics, list, load case table, assumptions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.core.errors import InputError
from meltemi.loads.loadbase.design import DesignLoads
from meltemi.loads.loadbase.engine import base_table
from meltemi.loads.loadbase.interfaces import known_channels
from meltemi.loads.loadbase.plan import Plan, PlannedCase
from meltemi.loads.loadbase.wording import in_words
from meltemi.reports.blocks import Block, CaseName, Cell, Marked, Statistics, Table
from meltemi.simulation.channels import find

if TYPE_CHECKING:
    import pandas as pd

OF_BLADE = re.compile(r"_\d$")
"""Ending of the channels of a blade."""
FIRST = "tower base moment fore aft"
"""Channel that the chart shows first."""
KEY_CHANNELS = {
    "tower base moment fore aft": ("max", "tower base\nlargest fore-aft"),
    "root moment out of plane": ("max", "blade root\nlargest out-of-plane"),
    "tip clearance": ("min", "least tip\nclearance"),
    "rotor speed": ("max", "largest\nrotor speed"),
}
"""Extremes in the list of cases, with the heads of their columns."""


def statistics(plan: Plan, folder: str | Path) -> pd.DataFrame:
    """Statistics in the units of the report, over all blades together.

    Returns:
      index (channel in words, case); columns min, mean, max, unit: the smallest and largest of all blades.
    """
    import pandas as pd

    raw = base_table(plan, folder, "statistics")
    if not len(raw):
        empty = pd.MultiIndex.from_tuples([], names=["channel", "case"])
        return pd.DataFrame(columns=["min", "mean", "max", "unit"], index=empty)
    raw, known = raw[~raw["channel"].str.contains("@")], known_channels(plan.campaign.blades)
    channel = raw["channel"]
    units = {name: _unit(name, known) for name in channel.unique()}
    words = {name: OF_BLADE.sub("", name).replace("_", " ") for name in units}
    ends = ["min", "mean", "max"]
    values = raw[ends].mul(channel.map({name: factor for name, (_, factor) in units.items()}), axis=0)
    frame = values.assign(channel=channel.map(words), case=raw["case"].astype(str))
    merged = frame.groupby(["channel", "case"], sort=False).agg({end: end for end in ends})
    of_words = {words[name]: unit for name, (unit, _) in units.items()}
    return merged.assign(unit=merged.index.get_level_values("channel").map(of_words))


def _unit(name: str, known: dict[str, Any]) -> tuple[str, float]:
    try:
        return find(name, known).display_unit
    except InputError:
        return "", 1.0


def statistics_chart(bases: Sequence[tuple[str, Plan, pd.DataFrame]]) -> list[Block]:
    """Chart of the statistics of all cases for a channel that the reader chooses.

    Args:
      bases: name, plan and :func:`statistics` of one or several load bases.
    """
    content, channels = list[dict[str, object]](), 0
    for name, plan, table in bases:
        cases = [case.name for case in plan.cases]
        dlcs = list(dict.fromkeys(case.dlc for case in plan.cases))
        series = []
        for channel in table.index.unique("channel"):
            part = table.loc[channel].reindex(cases)
            ends = {end: part[end].to_numpy(float) for end in ("min", "mean", "max")}
            series.append({"label": channel, "unit": part["unit"].dropna().iloc[0]} | ends)
        axes = [
            {"label": "wind speed", "unit": "m/s", "values": [case.variant.speed for case in plan.cases]},
            {"label": "yaw error", "unit": "deg", "values": [case.variant.yaw or 0.0 for case in plan.cases]},
        ]
        dlc = [dlcs.index(case.dlc) for case in plan.cases]
        content.append({"name": name, "dlcs": dlcs, "dlc": dlc, "channels": series, "across": axes})
        channels += len(series)
    if not channels:
        return []
    caption = "Each point is a case; click on it for its command. Blades: largest and smallest value of all blades."
    return [Statistics(content, FIRST, caption)]


def case_table(plan: Plan, table: pd.DataFrame, d: DesignLoads) -> list[Block]:
    """All cases with conditions, state and main extremes; ``table``: their :func:`statistics`."""
    channels = table.index.unique("channel")
    keys = {channel: table.loc[channel] for channel in KEY_CHANNELS if channel in channels}
    heads = [f"{KEY_CHANNELS[channel][1]} {extremes['unit'].iloc[0]}" for channel, extremes in keys.items()]
    values = [extremes[KEY_CHANNELS[channel][0]].to_dict() for channel, extremes in keys.items()]
    problems = d.problems[["state", "message"]].to_dict("index")
    rows: list[list[Cell]] = []
    for case in plan.cases:
        v, problem = case.variant, problems.get(case.name, {"state": "ok", "message": ""})
        yaw, seed = None if v.yaw is None else f"{v.yaw:g}", None if v.seed is None else str(v.seed)
        state = "ok" if problem["state"] == "ok" else Marked(problem["state"], problem["state"])
        cells: list[Cell] = [
            CaseName(case.name),
            case.dlc,
            v.model,
            v.speed,
            yaw,
            event_of(case),
            seed,
            f"{case.factor:g}",
        ]
        rows.append([*cells, *(value.get(case.name) for value in values), state, problem["message"]])
    head = ["case", "DLC", "wind", "speed\nm/s", "yaw\ndeg", "event", "seed", "factor", *heads, "state", "message"]
    ids = [f"case-0-{case.name}" for case in plan.cases]
    paper = f"All {len(rows)} cases are listed in plan.csv, those with a message in tables/problems.csv."
    return [Table(head, rows, ids=ids, paper=paper)]


def event_of(case: PlannedCase) -> str:
    """Sense, azimuth, instant, fault and sea of a case, in words."""
    v = case.variant
    sense = "" if v.sense is None else "+" if v.sense > 0 else "-"
    azimuth = "" if v.azimuth is None else f"{v.azimuth:g}°"
    instant = "" if v.instant is None else f"{v.instant:g} s"
    sea = "" if v.waves is None else f"waves {v.waves.height:.3g} m {v.waves.period:.3g} s {v.waves.misalignment:g}°"
    level = f"level {v.waves.level:g} m" if v.waves and v.waves.level else ""
    return " ".join(filter(None, (sense, azimuth, instant, (v.fault or "").replace("_", " "), sea, level)))


def assumption_tables(plan: Plan, d: DesignLoads) -> list[Block]:
    """Load case table of the computation, and values that come from practice."""
    rows: list[list[Cell]] = []
    for row in plan.summary():
        numbers = d.coverage.loc[row.name] if row.name in d.coverage.index else None
        counts = [str(numbers[state] or "") if numbers is not None else "" for state in ("ok", "doubtful", "failed")]
        lacking = "" if numbers is None else str(numbers["missing"] + numbers["unsupported"] or "")
        incomplete = numbers is not None and not numbers["complete"]
        title = plan.table.rows[row.name].title
        name, *texts, cases, hours = row.texts
        texts = [name, title, *texts, plan.table.rows[name].characteristic, cases, hours]
        rows.append([*texts, *counts, Marked(lacking, "bad") if incomplete else lacking])
    head = "DLC,title,situation,wind,loads,factor,value,cases,hours,ok,doubtful,failed,lacking".split(",")
    table = Table(head, rows, caption="Design load cases")
    settings = d.settings
    if settings.undeflected is None and math.isfinite(d.undeflected):
        settings = settings.replace(undeflected=d.undeflected)
    evaluated = [[*in_words(settings, key)] for key in type(settings).model_fields]
    practice = [[*each] for each in plan.assumptions()]
    text = (
        f"Source of the load case table: {plan.table.source}. The following {len(practice)} values come from practice "
        "or memory, not from the standard."
    )
    return [
        table,
        Table(["setting", "value"], evaluated, "Settings of the evaluation", text_columns=2),
        text,
        Table(["part", "quantity", "value"], practice, "Values from practice", text_columns=3),
    ]
