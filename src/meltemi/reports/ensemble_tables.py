"""Tables of ensembles for terminals and files."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan, nan

from meltemi.postprocess.ensemble import EnsembleTable, MeanEstimate
from meltemi.report.tables import Rows, number


def ensemble_rows(table: EnsembleTable, units: Mapping[str, tuple[str, float]] | None = None) -> Rows:
    """Header and rows of an ensemble, one per quantity and scheme, for ``rich_table`` and ``write_csv``.

    Changes are in percent; the half-width of its interval follows each number, empty where there is none.

    Args:
      table: table to show.
      units: unit and factor to it by quantity, such as ``channel.display_unit``; SI as given by default.
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
    interval. The equivalent load of the ensemble follows below, if there are several seeds.

    Args:
      table: table to show.
      units: units as for ``ensemble_rows``.
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


UNDECIDED = "?"
"""Text in place of an estimate from two seeds whose interval contains zero."""


def significant(e: MeanEstimate, resolution: float = 0.0) -> bool:
    """Whether an estimate is significant: one from two numbers is not if its interval contains zero.

    Of two numbers Student's interval is six times as wide as of many (12.7 instead of 2.0 standard errors): zero within
    it is no sign of a small effect. A single number is itself, and has no interval.

    Args:
      e: mean and interval.
      resolution: resolution of the printed number: a narrower interval says that the mean is zero.
    """
    return e.n != 2 or not e.low <= 0.0 <= e.high or e.half_width < resolution


def with_interval(e: MeanEstimate, digits: int, sign: str = "", factor: float = 1.0) -> str:
    """A mean times a factor, with the half-width of its interval; ``UNDECIDED`` if it is not :func:`significant`."""
    if not significant(e, 0.5 * 10.0**-digits / abs(factor)):
        return UNDECIDED
    width = f" ± {abs(factor) * e.half_width:.{digits}f}" if e.n > 1 else ""
    return f"{factor * e.mean:{sign}.{digits}f}{width}"


def half_bar(e: MeanEstimate, factor: float = 1.0) -> float:
    """Length of an error bar, times a factor; NaN where the estimate is not :func:`significant`."""
    return abs(factor) * e.half_width if significant(e) else nan


def change_bar(change: MeanEstimate | None) -> tuple[float, float]:
    """Length of the bar of a change [%] and of its error bar; NaN where it is missing or not :func:`significant`."""
    if change is None or not significant(change, 5e-4):
        return nan, nan
    return 100.0 * change.mean, 100.0 * change.half_width


def change_text(change: MeanEstimate | None) -> str:
    """A change in percent, with the half-width of its interval; ``UNDECIDED`` if it is not :func:`significant`."""
    if change is None or isnan(change.mean):
        return "-"
    large = max(abs(change.mean), 0.0 if isnan(change.half_width) else change.half_width) >= 1.0
    return with_interval(change, 0 if large else 1, "+", 100.0)


def _percent(share: float, sign: str = "") -> str:
    """Format a percentage with one decimal, large ones without decimals."""
    percent = 100.0 * share
    return "-" if isnan(percent) else f"{percent:{sign}.{1 if abs(percent) < 100.0 else 0}f}"
