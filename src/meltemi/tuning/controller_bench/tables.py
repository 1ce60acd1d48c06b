"""Tables of the test bench: criteria, leaderboard, lifetime, margins."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from meltemi.core.units import display
from meltemi.postprocess.ensemble import EnsembleTable
from meltemi.report.tables import Rows, number
from meltemi.reports.blocks import Cell, Marked, Table
from meltemi.reports.ensemble_tables import change_text
from meltemi.tuning.controller_bench.margins import OpenLoop
from meltemi.tuning.controller_bench.verdicts import NAMES, SLOPES, CriterionVerdict, LoopMargins, Standing, decibel

Verdicts = Mapping[str, Sequence[CriterionVerdict]]

MOMENT = display("N m")
RATE = display("rad/s", angular_rate_in_degrees=True)
UNITS: dict[str, tuple[str, float]] = {
    **{f"{load} {what}": MOMENT for load in SLOPES for what in ("DEL", "max")},
    "energy": ("GWh/year", 1.0 / 3.6e12),
    "power std": ("kW", 1e-3),
    "power mean": ("kW", 1e-3),
    "end power": ("kW", 1e-3),
    "generator speed std": ("%", 100.0),
    "generator speed max": ("%", 100.0),
    "end speed": ("%", 100.0),
    "tower clearance": ("%", 100.0),
    "pitch travel": RATE,
    "flap travel": RATE,
    "tracking error": ("kW", 1e-3),
    "pitch rate max": RATE,
    "stop time": ("s", 1.0),
}
"""Engineering units of the numbers of runs, and factors from SI or shares."""


def named(quantity: str) -> str:
    """A quantity in words."""
    channel, _, rest = quantity.partition(" ")
    return f"{NAMES[channel]}, {rest}" if channel in NAMES else quantity


def verdict_rows(verdicts: Verdicts) -> Rows:
    """Header and rows of all verdicts, one per controller and criterion."""
    head = ["controller", "criterion", "value", "± 95 %", "limit", "unit", "verdict", "where"]
    rows = [
        [name, v.criterion, value_text(v.value), value_text(v.half_width), value_text(v.limit), v.unit, v.word, v.where]
        for name, criteria in verdicts.items()
        for v in criteria
    ]
    return head, rows


def value_text(x: float) -> str:
    """A number of a verdict."""
    return "" if math.isnan(x) else f"{x:.3g}" if math.isfinite(x) else "none"


def criteria_table(verdicts: Verdicts) -> Table:
    """Criteria as rows, controllers as columns, the reference first."""
    criteria = list(dict.fromkeys(v.criterion for results in verdicts.values() for v in results))
    by_name = {name: {v.criterion: v for v in results} for name, results in verdicts.items()}
    rows = []
    for criterion in criteria:
        first = next(results[criterion] for results in by_name.values() if criterion in results)
        sign = "≥" if criterion in LEAST else "≤"
        row: list[Cell] = [criterion, f"{sign} {value_text(first.limit)} {first.unit}".strip()]
        for j, results in enumerate(by_name.values()):
            v = results.get(criterion)
            if v is None:
                row.append("-" if j else "reference")  # no run to judge
                continue
            width = "" if math.isnan(v.half_width) else f" ± {v.half_width:.2g}"
            text = f"{value_text(v.value)}{width}" if v.value == v.value else v.where
            kind = "doubtful" if "limit" in v.word else "good" if v.passed else "bad"
            row.append(text if v.passed is None else Marked(text, kind))
        rows.append(row)
    note = "✗: fails. ~: the limit lies within the 95 % interval. Energy and loads are changes."
    return Table(["criterion", "limit", *verdicts], rows, text_columns=2, note=note)


LEAST = (
    "tower clearance",
    *(f"speed loop: {kind} margin" for kind in ("phase", "gain", "delay")),
    *(f"blade loops: {kind} margin" for kind in ("phase", "gain")),
    "energy",
    "start",
)
"""Criteria whose limit is a lower bound."""


BOARD: dict[str, Callable[[Standing], str]] = {
    "energy\n%": lambda s: change_text(s.energy),
    "blade\nDEL %": lambda s: change_text(s.blade_load),
    "tower\nDEL %": lambda s: change_text(s.tower_load),
    "travel\ndeg/s": lambda s: value_text(math.degrees(s.pitch_travel)),
    "speed\n%": lambda s: value_text(100.0 * s.speed),
    "clearance\n%": lambda s: value_text(100.0 * s.clearance),
    "speed\nloop\ndeg": lambda s: _phase(s.speed_loop),
    "speed\nloop\ndB": lambda s: _gain(s.speed_loop),
    "blade\nloops\ndeg": lambda s: _phase(s.blade_loops),
    "blade\nloops\ndB": lambda s: _gain(s.blade_loops),
}
"""Columns of the leaderboard after controller and failed criteria."""


def _phase(loop: LoopMargins | None) -> str:
    return "" if loop is None else _margin(math.degrees(loop.phase_margin), loop)


def _gain(loop: LoopMargins | None) -> str:
    return "" if loop is None else _margin(decibel(loop.gain_margin), loop)


def _margin(value: float, loop: LoopMargins) -> str:
    """The smallest margin, an upper bound where the loop had no linear response at some wind speed."""
    if math.isnan(value) and loop.nonlinear:
        return "not linear"
    return f"≤ {value_text(value)}" if loop.nonlinear and math.isfinite(value) else value_text(value)


CHANGES = 3
"""Number of the first columns that are changes, which do not apply to the reference."""


def leaderboard_rows(standings: Iterable[Standing], reference: str) -> Rows:
    """Header and rows of the leaderboard."""
    rows = []
    for standing in standings:
        base = standing.controller == reference
        cells = [of(standing) or "-" for of in BOARD.values()]
        cells = ["0"] * CHANGES + cells[CHANGES:] if base else cells
        name = standing.controller + (" (reference)" if base else "")
        rows.append([name, f"{standing.failed} of {standing.judged}", *cells])
    return ["controller", "failed", *BOARD], rows


def lifetime_rows(tables: Mapping[str, EnsembleTable | None]) -> Rows:
    """Header and rows of lifetime quantities: means of the first controller, and changes of the others against it."""
    reference, *others = tables
    base = tables[reference]
    head = ["quantity", "unit", reference, *(f"{name}\nchange %" for name in others)]
    rows = []
    for quantity in base.quantities if base else ():
        assert base is not None
        unit, factor = UNITS[quantity]
        row = [named(quantity), unit, number(base.entry(quantity, reference).value.mean * factor)]
        for name in others:
            table = tables[name]
            row.append(change_text(table.entry(quantity, name).change) if table else "-")
        rows.append(row)
    return head, rows


def margin_rows(speed_loops: Mapping[str, Iterable[OpenLoop]], blade_loops: Mapping[str, Iterable[OpenLoop]]) -> Rows:
    """Header and rows of the margins of speed and blade loops by controller and wind speed."""
    head = ["controller", "loop", "wind m/s", "crossover rad/s", "phase margin deg", "gain margin dB"]
    head += ["delay margin s", "largest 1/|1+L|", "repeatability %"]
    kinds = (("speed loop", speed_loops), ("blade loops", blade_loops))
    rows = []
    for name, kind, loops in (
        (name, kind, by_controller[name])
        for name in speed_loops
        for kind, by_controller in kinds
        if name in by_controller
    ):
        for loop in loops:
            values = [loop.crossover, math.degrees(loop.phase_margin), decibel(loop.gain_margin)]
            values += [loop.delay_margin, loop.sensitivity, 100.0 * loop.repeatability]
            texts = ["no linear response" if math.isnan(x) else "none" if math.isinf(x) else number(x) for x in values]
            if kind == "blade loops":
                texts[3] = "-"  # a delay turns tones of the blades, not amplitudes
            rows.append([name, kind, f"{loop.wind_speed:g}", *texts])
    return head, rows
