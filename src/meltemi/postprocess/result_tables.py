"""What files, tables, notebooks and other packages show of a result."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.display import rounded
from meltemi.core.errors import Status
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result

if TYPE_CHECKING:
    from meltemi.core.hdf5 import Variable
    from meltemi.core.representation import Card

CONVENTIONS = "CF-1.11"
UNITS = {"-": "1"}
"""Units in the spelling of UDUNITS, where it differs: that of the climate and forecast conventions (CF), which pint
and cf-xarray read."""


def labelled(result: Result) -> tuple[dict[str, Variable], dict[str, object]]:
    """Series with units, frames, signs and descriptions, and attributes of the whole, as files and xarray have them."""
    variables: dict[str, Variable] = {}
    variables["time"] = ("time",), result.time, {"units": "s", "long_name": "simulation time", "axis": "T"}
    for channel, series in zip(result.channels, result.data.T, strict=True):
        unit, factor = channel.display_unit
        about = {
            "units": UNITS.get(channel.unit, channel.unit),
            "unit_in_tables": unit,
            "factor_to_tables": factor,
            "long_name": channel.description,
            "frame": channel.frame,
            "positive_direction": channel.sign,
            "openfast_name": channel.alias,
        }
        variables[channel.name] = ("time",), series, about
    return variables, {
        "Conventions": CONVENTIONS,
        "title": result.title or "time series of a wind turbine",
        "source": f"meltemi {result.meta.get('meltemi', '')}".strip(),
        "status": int(result.status),
        "status_name": result.status.name,
        "message": result.message,
        "unit_system": "SI: angles in rad, rotational speeds in rad/s; tables and plots use unit_in_tables",
        "meta": json.dumps(result.meta, default=str),
    }


def channel_statistics(result: Result) -> Iterator[tuple[Channel, tuple[float, float, float, float]]]:
    """Channels with mean, standard deviation, minimum and maximum after the transient, in engineering units.

    Raises:
      InputError: there are no samples.
    """
    for channel, series in zip(result.channels, result.evaluated.data.T, strict=True):
        x = series * channel.display_unit[1]
        yield channel, (float(x.mean()), float(x.std()), float(x.min()), float(x.max()))


def card(result: Result) -> Card:
    """Status, statistics of the channels in engineering units with a line of each, messages, events, origin."""
    from meltemi.core.representation import Card, Fold, badge

    kind = "good" if result.status is Status.OK else "doubtful" if result.status.complete else "bad"
    remarks = [*filter(None, [result.message]), *map(str, result.findings), *result.warnings]
    facts = [("status", badge(result.status.name, kind)), ("time", result.span())]
    for name, unit in (("transient", "s"), ("output_step", "s"), ("controller", ""), ("real_time_factor", "")):
        if result.meta.get(name):
            facts.append((name.replace("_", " "), f"{result.meta[name]} {unit}".strip()))
    rows = channel_rows(result)
    head = ["channel", "OpenFAST", "unit", "mean", "std", "min", "max", ""]
    after = "after the transient" if result.meta.get("transient") else ""
    sections = [
        *([Fold("Messages", [[words] for words in remarks], [""], open=True)] if remarks else []),
        Fold(f"{len(result.channels)} channels", rows, head, note=after, open=True),
    ]
    if result.log:
        log = [[f"{entry.time:.2f}", entry.source, entry.what, entry.reason] for entry in result.log]
        sections.append(Fold(f"{len(log)} events", log, ["time s", "source", "what", "reason"]))
    origin = [(k.replace("_", " "), str(v)) for k, v in result.meta.items() if isinstance(v, str | int | float)]
    sections.append(Fold("Origin", origin, note=f"meltemi {result.meta.get('meltemi', '')}"))
    return Card("Result", result.title, facts, sections if result.meta else sections[:-1])


def channel_rows(result: Result) -> list[list[str]]:
    """Names, unit, statistics and line of each channel; of those that a notebook leaves out, names."""
    from meltemi.core.representation import MOST_ROWS, sparkline

    data, rows = result.after_transient.data, []
    for i, channel in enumerate(result.channels[:MOST_ROWS]):
        unit, factor = channel.display_unit
        x = data[:, i] * factor
        numbers = [rounded(float(f(x))) if len(x) else "-" for f in (np.mean, np.std, np.min, np.max)]
        rows.append([channel.name, channel.alias, unit, *numbers, sparkline(x)])
    return rows + [[channel.name] for channel in result.channels[MOST_ROWS:]]
