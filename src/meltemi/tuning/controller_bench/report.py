"""Files of the test bench: HTML page, tables as CSV, Parquet and JSON, and the leaderboard in Markdown."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from meltemi.core.files import write_text
from meltemi.postprocess.ensemble import MeanEstimate
from meltemi.report.tables import Rows, markdown_table, number, write_csv
from meltemi.reports import blocks
from meltemi.reports.blocks import Axis, Beside, Block, Chart, Code, Curve, Document, Marked, Section, Table
from meltemi.reports.ensemble_tables import change_text
from meltemi.reports.html import write_page
from meltemi.reports.rendering import report_folder
from meltemi.tuning.controller_bench import tables
from meltemi.tuning.controller_bench.bench import ControllerBench
from meltemi.tuning.controller_bench.verdicts import NAMES, SLOPES, CriterionVerdict, decibel

RADAR = {
    "RootMyc1 DEL": "blade\nout of plane",
    "RootMxc1 DEL": "blade\nin plane",
    "TwrBsMyt DEL": "tower\nfore-aft",
    "TwrBsMxt DEL": "tower\nside-side",
    "YawBrMyp DEL": "yaw bearing\ntilt",
    "YawBrMzp DEL": "yaw bearing\nyaw",
    "power std": "power\nstd",
    "generator speed std": "speed\nstd",
}
"""Quantities of the radar, and their names there."""
COMPARED = ("RootMyc1 DEL", "TwrBsMyt DEL", "power mean")
"""Quantities of the table of robustness."""


def extreme_rows(bench: ControllerBench) -> Rows:
    """Header and rows of the largest loads of production and extreme events."""
    extremes = {name: bench.extremes(name) for name in bench.controllers}
    head = ["load", "unit", *(text for name in bench.controllers for text in (name, "case"))]
    unit, factor = tables.MOMENT
    rows = []
    for load in SLOPES:
        row = [NAMES[load], unit]
        for name in bench.controllers:
            value = extremes[name].get(load)
            row += [number(value[0] * factor), value[1]] if value else ["-", "-"]
        rows.append(row)
    return head, rows


def situation_rows(bench: ControllerBench, group: str) -> Rows:
    """Header and rows of the situations of a group: extremes of each controller, and changes against the reference."""
    operation = group == "operation"
    head = ["situation", "controller", "runs", "speed %"]
    if operation:
        head += ["stop s", "end speed %", "end power kW"]
    else:
        head += ["clearance %", *(f"{tables.named(q)}\nchange %" for q in COMPARED)]
    rows = []
    for situation in dict.fromkeys(c.situation for c in bench.cases if c.situation.group == group):
        total = sum(c.situation is situation for c in bench.cases)
        for name in bench.controllers:
            numbers = bench.of(name, situation=situation.name)
            row = [situation.name, name, f"{len(numbers)} of {total}"]
            if numbers:
                row.append(number(100.0 * max(n["generator speed max"] for n in numbers.values())))
                if operation:
                    times = max(n["stop time"] for n in numbers.values())
                    row += ["-" if situation.starts or not math.isfinite(times) else number(times)]
                    row += [number(100.0 * max(n["end speed"] for n in numbers.values()))]
                    row += [number(1e-3 * min(n["end power"] for n in numbers.values()))]
                else:
                    row.append(number(100.0 * min(n["tower clearance"] for n in numbers.values())))
                    row += [_change(bench, name, situation.name, q) for q in COMPARED]
            rows.append(row + [""] * (len(head) - len(row)))
    return head, rows


def _change(bench: ControllerBench, controller: str, situation: str, quantity: str) -> str:
    if controller == bench.reference:
        return "reference"
    change: MeanEstimate | None = bench.paired(controller, situation, quantity)
    return change_text(change)


def run_rows(bench: ControllerBench) -> Rows:
    """Header and rows of all runs: case, controller, status and numbers in SI or as shares."""
    quantities = list(dict.fromkeys(q for numbers in bench.numbers.values() for q in numbers))
    head = ["case", "situation", "group", "wind_speed", "seed", "controller", "message", *quantities]
    rows = []
    for case in bench.cases:
        for name in bench.controllers:
            run = bench.numbers.get((case.name, name), {})
            first = [case.name, case.situation.name, case.situation.group, f"{case.speed:g}"]
            first.append("" if case.seed is None else str(case.seed))
            values = [f"{run[q]:.9g}" if q in run and math.isfinite(run[q]) else "" for q in quantities]
            rows.append([*first, name, bench.failures.get((case.name, name), ""), *values])
    return head, rows


def content(bench: ControllerBench) -> dict[str, Any]:
    """Everything of a bench as plain data, for JSON."""

    def table(rows: Rows) -> list[dict[str, str]]:
        return [dict(zip((" ".join(h.split()) for h in rows[0]), row, strict=True)) for row in rows[1]]

    return {
        "turbine": bench.turbine,
        "wind_class": bench.wind_class,
        "reference": bench.reference,
        "controllers": dict(bench.about),
        "limits": bench.limits.content(),
        "leaderboard": table(tables.leaderboard_rows(bench.leaderboard(), bench.reference)),
        "verdicts": table(tables.verdict_rows(bench.all_verdicts())),
        "lifetime": table(tables.lifetime_rows(bench.lifetimes())),
        "margins": table(tables.margin_rows(bench.loops, bench.blade_loops)),
        "runs": table(run_rows(bench)),
    }


def write_bench(bench: ControllerBench, out: str | Path, *, repeat: str = "", footer: str = "") -> list[Path]:
    """Write page, tables, JSON and leaderboard of a test bench into a folder; Parquet if pyarrow is installed.

    Args:
      bench: from :func:`~meltemi.tuning.controller_bench.study.bench_controllers`.
      out: folder, created if needed.
      repeat: how to reproduce the bench, such as a command line.
      footer: last line of the page.

    Returns:
      The files.

    Raises:
      InputError: a file cannot be written.
    """
    out, verdicts = report_folder(out), bench.all_verdicts()
    files = [
        write_csv(out / "verdicts.csv", *tables.verdict_rows(verdicts)),
        write_csv(out / "lifetime.csv", *tables.lifetime_rows(bench.lifetimes())),
        write_csv(out / "margins.csv", *tables.margin_rows(bench.loops, bench.blade_loops)),
        write_csv(out / "runs.csv", *run_rows(bench)),
        write_text(out / "bench.json", json.dumps(content(bench), indent=1, ensure_ascii=False) + "\n"),
        write_text(out / "leaderboard.md", leaderboard_text(bench)),
    ]
    if find_spec("pyarrow") and find_spec("pandas"):
        files.append(_parquet(bench, out / "runs.parquet"))
    return [*files, write_page(out / "bench.html", bench_document(bench, repeat, footer))]


def bench_document(bench: ControllerBench, repeat: str = "", footer: str = "") -> Document:
    """The page of a test bench: verdicts, criteria, loads, margins, situations."""
    title, verdicts = f"{bench.turbine}: controllers on the test bench", bench.all_verdicts()
    hours = sum(case.duration for case in bench.cases) / 3600.0
    facts = [
        ("Turbine", bench.turbine),
        ("Class", bench.wind_class),
        ("Reference", bench.reference),
        ("Suite", f"{len(bench.cases)} cases, {hours:.1f} hours of operation for each controller"),
        *((f"Controller {name}", about) for name, about in bench.about.items()),
    ]
    lead = Beside([_verdict_block(name, verdicts[name], name == bench.reference) for name in bench.controllers])
    return Document(title, _sections(bench, repeat), facts=facts, lead=lead, footer=footer)


def _parquet(bench: ControllerBench, path: Path) -> Path:
    import pandas as pd

    from meltemi.core.files import replacing

    head, rows = run_rows(bench)
    frame = pd.DataFrame(rows, columns=head)
    for name in (*head[7:], "wind_speed"):
        frame[name] = pd.to_numeric(frame[name])
    with replacing(path) as (partial,):
        frame.to_parquet(partial, index=False)
    return path


def _verdict_block(name: str, criteria: Sequence[CriterionVerdict], base: bool) -> blocks.VerdictBlock:
    failed = [v for v in criteria if v.passed is False]
    judged = sum(v.passed is not None for v in criteria)
    heading = f"{name}: {'passes' if not failed else f'fails {len(failed)} of'} {judged} criteria"
    heading += " (reference)" if base else ""
    lines = []
    for v in failed:
        where = f" ({v.where})" if v.where else ""
        value, limit = (f"{tables.value_text(x)} {v.unit}".rstrip() for x in (v.value, v.limit))
        lines.append(f"{v.criterion} {value}, limit {limit}{where}")
    lines += [f"{v.criterion}: {v.where}" for v in criteria if v.passed is None]
    return blocks.VerdictBlock("bad" if failed else "good", heading, lines)


def _sections(bench: ControllerBench, repeat: str) -> list[Section]:
    text = "Changes are against {}, in the same winds, formed seed by seed, with their 95 % intervals."
    lifetime = Table(
        *tables.lifetime_rows(bench.lifetimes()), text_columns=2, note=text.format(bench.reference) + LIFETIME
    )
    margins = Table(*tables.margin_rows(bench.loops, bench.blade_loops), text_columns=2)
    sections = [
        Section("Criteria", [tables.criteria_table(bench.all_verdicts())]),
        Section("Production", [*_radar(bench), lifetime]),
        Section("Stability margins", [MARGINS, *_margin_charts(bench), margins]),
        Section(
            "Extreme events",
            [Table(*situation_rows(bench, "extreme"), text_columns=2), Table(*extreme_rows(bench), text_columns=1)],
        ),
        Section("Robustness", [ROBUSTNESS, Table(*situation_rows(bench, "robustness"), text_columns=2)]),
        Section("Operation", [OPERATION, Table(*situation_rows(bench, "operation"), text_columns=2)]),
        Section("Suite", [_suite_table(bench)]),
    ]
    if bench.failures:
        rows = [[case, name, message] for (case, name), message in bench.failures.items()]
        sections.insert(1, Section("Failed runs", [Table(["case", "controller", "message"], rows, text_columns=3)]))
    return [*sections, Section("Reproduction", [Code(repeat)])] if repeat else sections


LIFETIME = (
    " DEL: lifetime damage-equivalent load, 1 Hz, slope 10 for blades and 4 for tower and yaw bearing, weighted by the "
    "Rayleigh distribution of the class. Speed and power: standard deviations; speeds over the reference speed."
)
MARGINS = (
    "Measured in the closed loop: small sines are added to the measured generator speed in steady wind, and the speed "
    "loop is opened at that sensor. It contains torque and pitch, filters, actuators and sampling. Blade loops are "
    "opened at the root moments of all blades, in multiblade coordinates; a controller that does not use them has none."
)
ROBUSTNESS = "The controllers are tuned for the nominal turbine; the plant, its sensors or its actuators differ."
OPERATION = (
    "Controllers of meltemi run with its supervisor here. A controller that does not respond to a request does not "
    "offer the function, which is neither a pass nor a failure."
)


def radar_values(bench: ControllerBench) -> dict[str, list[float]]:
    """Lifetime loads and variations of each controller over those of the reference, in the order of ``RADAR``."""
    by_controller = {}
    for name in bench.controllers:
        if table := bench.lifetime(name):
            changes = [table.entry(quantity, name).change for quantity in RADAR]
            by_controller[name] = [1.0 + (c.mean if c else 0.0) for c in changes]
    return by_controller


def _radar(bench: ControllerBench) -> list[Block]:
    by_controller = radar_values(bench)
    if not by_controller:
        return []
    angles = [360.0 * i / len(RADAR) for i in range(len(RADAR))]
    curves = [Curve(name, angles, [100.0 * x for x in values]) for name, values in by_controller.items()]
    y = Axis("of the reference", "%", start=100.0 * radar_start(by_controller))
    caption = "over those of the reference; smaller is better."
    return [
        Chart(
            "Lifetime loads and variations", Axis("quantity"), y, curves, caption, polar=True, spokes=[*RADAR.values()]
        )
    ]


def radar_start(by_controller: Mapping[str, Sequence[float]]) -> float:
    """Value at the centre of the radar: half the reference, or zero if something is nearly as small."""
    return 0.5 if min(min(values) for values in by_controller.values()) > 0.6 else 0.0


def _margin_charts(bench: ControllerBench) -> list[Block]:
    wind, limits = Axis("wind speed", "m/s"), bench.limits
    shown = []
    kinds: tuple[tuple[str, str, str, Callable[[float], float], float], ...] = (
        ("Phase margin", "deg", "phase_margin", math.degrees, limits.phase_margin),
        ("Gain margin", "dB", "gain_margin", decibel, limits.gain_margin),
    )
    curves_of = ("speed loop", bench.loops), ("blade loops", bench.blade_loops)
    for (title, unit, attribute, in_unit, limit), (where, of) in product(kinds, curves_of):
        curves = []
        for name, loops in of.items():
            margins = [getattr(loop, attribute) for loop in loops]
            values = [in_unit(v) if math.isfinite(v) else math.nan for v in margins]
            curves.append(
                Curve(name, [loop.wind_speed for loop in loops], values, colour=bench.controllers.index(name))
            )
        ends = [bench.speeds[0], bench.speeds[-1]]
        curves.append(Curve("limit", ends, [in_unit(limit)] * 2, dash="5 4", colour=len(bench.controllers)))
        if of:
            shown.append(Chart(f"{title} of the {where}", wind, Axis(title.lower(), unit, start=0.0), curves))
    return [Beside(shown[i : i + 2]) for i in range(0, len(shown), 2)]


def _suite_table(bench: ControllerBench) -> Table:
    head = ["situation", "", "wind", "wind speeds m/s", "seeds", "evaluated s", "runs"]
    rows = []
    for s in dict.fromkeys(c.situation for c in bench.cases):
        cases = [c for c in bench.cases if c.situation is s]
        speeds = ", ".join(f"{v:g}" for v in s.speeds)
        rows.append([s.name, s.about, s.wind, speeds, str(s.seeds or "-"), f"{s.duration:g}", str(len(cases))])
    return Table(head, rows, text_columns=4)


def leaderboard_text(bench: ControllerBench) -> str:
    """The leaderboard and the criteria as Markdown tables."""
    head, rows = tables.leaderboard_rows(bench.leaderboard(), bench.reference)
    table = tables.criteria_table(bench.all_verdicts())
    marks = {"good": "", "bad": " **fails**", "doubtful": " (limit within interval)"}
    cells = [[f"{cell}{marks[cell.kind] if isinstance(cell, Marked) else ''}" for cell in row] for row in table.rows]
    return "\n".join(
        [*markdown_table([" ".join(h.split()) for h in head], rows), "", *markdown_table(table.head, cells), ""]
    )
