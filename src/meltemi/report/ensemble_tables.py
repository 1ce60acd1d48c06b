"""Tables of ensembles for the terminal and for files."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan

from meltemi.postprocess.ensemble import EnsembleTable, Estimate
from meltemi.report.tables import number


def ensemble_rows(
    table: EnsembleTable, units: Mapping[str, tuple[str, float]] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Head and rows of an ensemble, one for each quantity and scheme, for ``rich_table`` and ``write_csv``.

    Changes are in percent; after each number stands the half-width of its interval, empty where there is none.

    Args:
      table: what to show.
      units: by quantity the unit and the factor to it, such as ``channel.display_unit``; SI as given by default.
    """
    units = units or {}
    interval = f"± {100.0 * table.confidence:g} %"
    loads = any(entry.load is not None for entry in table)
    head = ["quantity", "scheme", "unit", "mean", interval, "change %", f"change {interval}"]
    if loads:
        head += ["ensemble DEL", "DEL change %"]
    rows = []
    for entry in table:
        unit, factor = units.get(entry.quantity, ("", 1.0))
        row = [entry.quantity, entry.scheme, unit, *_pair(entry.value, factor), *_pair(entry.change, 100.0)]
        if loads:
            row += [_number(entry.load, factor), _number(entry.load_change, 100.0)]
        rows.append(row)
    return head, rows


def _number(value: float | None, factor: float) -> str:
    return "" if value is None else number(value * factor)


def _pair(estimate: Estimate | None, factor: float) -> tuple[str, str]:
    if estimate is None:
        return "", ""
    width = "" if isnan(estimate.half_width) else number(estimate.half_width * abs(factor))
    return number(estimate.mean * factor), width
