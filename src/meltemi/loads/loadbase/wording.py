"""Settings and assumptions of a load base in words and in the units of the report."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from meltemi.core.display import quantity
from meltemi.core.record import Record
from meltemi.core.units import unit_of
from meltemi.loads.loadbase.table import Fault
from meltemi.simulation.channels import find, standard
from meltemi.simulation.events import KINDS

UNIT = re.compile(r"\s*\[[^\]]*\]")
CLAUSE = re.compile(r"[;:]|\.(?:\s|$)|, also |, in place of ")
"""Ends the name of a field in its description."""
NAME = re.compile(r"(?<=[a-z])_(?=[a-z])")
"""Joins the words of a name; V_r stays."""


def in_words(record: Record, key: str) -> tuple[str, str]:
    """Name of a field, from its description, and its value with its unit: ("pitch rate of stops", "4 deg/s")."""
    described = type(record).model_fields[key].description or key.replace("_", " ")
    name = CLAUSE.split(UNIT.sub("", described))[0].strip()
    value = getattr(record, key)
    if isinstance(record, Fault) and key == "events":
        return "events", f"{record.title} ({'; '.join(map(event_words, value))})"
    unit = unit_of(described)
    return name[:1].lower() + name[1:] if name[1:2].islower() else name, value_words(value, unit, key)


def value_words(value: Any, unit: str = "", key: str = "") -> str:
    """A value in the units of the report; None and empty values are "none"."""
    if value is None or value == () or value == {}:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {value_words(each, unit, key)}" for name, each in value.items())
    if isinstance(value, tuple | list):
        return ", ".join(value_words(each, unit, key) for each in value)
    if isinstance(value, int | float):
        return quantity(value, unit, key)
    return f"{NAME.sub(' ', value)} {unit}".strip() if isinstance(value, str) else str(value)


def event_words(event: Mapping[str, Any]) -> str:
    """An event of a fault: "pitch runaway, blade 1, rate -emergency rate"."""
    kind = next(each for each in KINDS if each.model_fields["type"].default == event["type"])
    parts = [str(event["type"]).replace("_", " ")]
    for key, value in event.items():
        unit = "s" if key in ("after", "lasts") else ""
        if key in kind.model_fields and isinstance(value, int | float):
            sensor = event.get("sensor") if key == "offset" else None
            unit = find(sensor, standard()).unit if sensor else unit_of(kind.model_fields[key].description)
        if key != "type":
            text = value_words(value, unit, key)
            parts.append(text if key in ("sensor", "request") else f"{key} {text}")
    return ", ".join(parts)
