"""Tables of ensembles for terminals and files."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan

from meltemi.postprocess.ensemble import EnsembleTable, MeanEstimate
from meltemi.report.tables import number


def ensemble_rows(
    table: EnsembleTable, units: Mapping[str, tuple[str, float]] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Header and rows of an ensemble, one per quantity and scheme, for ``rich_table`` and ``write_csv``.

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


def _pair(estimate: MeanEstimate | None, factor: float) -> tuple[str, str]:
    if estimate is None:
        return "", ""
    width = "" if isnan(estimate.half_width) else number(estimate.half_width * abs(factor))
    return number(estimate.mean * factor), width


def scheme_rows(
    table: EnsembleTable, units: Mapping[str, tuple[str, float]] | None = None, *, means: bool = True
) -> tuple[list[str], list[list[str]], list[tuple[str, int]]]:
    """Header, rows and column groups of an ensemble, with one group of columns per scheme.

    One row a quantity: the first scheme's mean, of the others mean and change in percent, with the half-width of its
    interval. Below each equivalent load stands that of the ensemble, if there are several seeds.

    Args:
      table: what to show.
      units: see ``ensemble_rows``.
      means: show means of the other schemes, too.
    """
    units = units or {}
    base, *others = table.schemes
    head = ["quantity", "unit", base, *(name for _ in others for name in (["mean"] if means else []) + ["change %"])]
    groups = [("", 3), *((scheme, 2 if means else 1) for scheme in others)]
    rows = []
    for quantity in table.quantities:
        unit, factor = units.get(quantity, ("", 1.0))
        entries = [table.entry(quantity, scheme) for scheme in table.schemes]
        row, together = [quantity, unit], ["  of all seeds", unit]
        for entry in entries:
            first = entry.scheme == base
            if first or means:
                row.append(number(entry.value.mean * factor))
                together.append(_number(entry.load, factor))
            if not first:
                row.append(change_text(entry.change))
                change = entry.load_change
                together.append("" if change is None else _percent(change, "+"))
        rows.append(row)
        if entries[0].load is not None and table.seeds > 1:
            rows.append(together)
    return head, rows, groups


def with_interval(e: MeanEstimate, digits: int, sign: str = "", factor: float = 1.0) -> str:
    """A mean, times a factor, and the half-width of its confidence interval, if it is one of several numbers."""
    width = f" ± {abs(factor) * e.half_width:.{digits}f}" if e.n > 1 else ""
    return f"{factor * e.mean:{sign}.{digits}f}{width}"


def change_text(change: MeanEstimate | None) -> str:
    """A change in percent with the half-width of its interval, if available."""
    if change is None or isnan(change.mean):
        return "-"
    return _percent(change.mean, "+") + ("" if isnan(change.half_width) else f" ± {_percent(change.half_width)}")


def _percent(share: float, sign: str = "") -> str:
    """Format a percentage with one decimal, large ones without decimals."""
    percent = 100.0 * share
    return "-" if isnan(percent) else f"{percent:{sign}.{1 if abs(percent) < 100.0 else 0}f}"
