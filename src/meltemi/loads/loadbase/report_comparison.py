"""Two load bases side by side: two controllers, two turbines, or a change."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.units import display
from meltemi.loads.loadbase.design import DesignLoads, compare_bases, design_loads
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.report import FILE, facts, footer_text, governing_driver, utilisation, verdict
from meltemi.loads.loadbase.report_cases import statistics, statistics_chart
from meltemi.loads.loadbase.report_loads import GWH, LOADS, WITH, energy_words, load_heads, title_of, unit_of_driver
from meltemi.loads.loadbase.settings import STANDARD, DesignSettings
from meltemi.report.tables import write_csv
from meltemi.reports.blocks import (
    Axis,
    Beside,
    Block,
    CaseList,
    CaseName,
    CaseValue,
    Cell,
    Chart,
    Code,
    Curve,
    Document,
    Marked,
    Section,
    Subsection,
    Table,
    words,
)
from meltemi.reports.html import write_page
from meltemi.reports.rendering import report_folder

if TYPE_CHECKING:
    import pandas as pd

Base = tuple[str, Plan]
"""Folder of a load base, and its plan."""


def write_base_comparison(one: Base, other: Base, out: str | Path, settings: DesignSettings = STANDARD) -> list[Path]:
    """Write ``report.html`` and ``comparison.csv``: the loads of a load base over those of another one.

    Args:
      one: folder and plan of the load base.
      other: folder and plan of the reference.
      out: folder for the files.
      settings: settings of the evaluation of both.

    Returns:
      The two files.

    Raises:
      InputError: a file cannot be read or written.
    """
    designs = (design_loads(one[1], one[0], settings), design_loads(other[1], other[0], settings))
    document, out = base_comparison((one, other), designs), report_folder(out)
    rows = _plain_rows(compare_bases(*designs), [one[0], other[0]])
    return [write_page(out / FILE, document), write_csv(out / "comparison.csv", *rows)]


def base_comparison(bases: tuple[Base, Base], designs: tuple[DesignLoads, DesignLoads]) -> Document:
    """Two load bases side by side: verdicts, ratios, statistics, input; ``designs``: the design loads of both."""
    names, ratios = [folder for folder, _ in bases], compare_bases(*designs)
    tables = [(folder, plan, statistics(plan, folder)) for folder, plan in bases]
    verdicts = [
        Subsection(folder, [verdict(d, None, base)])
        for base, (folder, d) in enumerate(zip(names, designs, strict=True))
    ]
    sections = [
        Section("Ratios of loads", [_glance(ratios, names), *_energy(*designs, names)]),
        Section("All loads", [_all(ratios, names)]),
        Section("Statistics of all cases", statistics_chart(tables)),
        Section("Input", [_input(bases)]),
        Section("Commands", [Code(f"meltemi loads compare {names[0]} {names[1]}")]),
    ]
    return Document(
        f"Design loads: {names[0]} and {names[1]}",
        sections,
        facts=[("load base", names[0]), ("compared with", names[1])],
        lead=Beside(verdicts),
        footer=footer_text(),
        cases=[CaseList(folder, [case.name for case in plan.cases]) for folder, plan in bases],
    )


def _input(bases: tuple[Base, Base]) -> Table:
    """Facts of both computations, side by side."""
    both = zip(*(facts(plan) for _, plan in bases), strict=True)
    rows: list[list[Cell]] = [[name, one, other, "" if one == other else "differs"] for (name, one), (_, other) in both]
    return Table(["", bases[0][0], bases[1][0], ""], rows)


def _glance(ratios: pd.DataFrame, names: list[str]) -> Table:
    """Ratio of the largest magnitude of each component and interface."""
    ultimate = ratios.loc["ultimate"] if "ultimate" in ratios.index.get_level_values(0) else ratios.iloc[:0]
    rows: list[list[Cell]] = []
    for place in ultimate.index.unique(0):
        loads = ultimate.loc[place]
        cells: list[Cell] = [title_of(str(place))]
        for name in LOADS:
            worst = governing_driver(loads, name, "value")
            row, factor = loads.loc[worst], unit_of_driver(name)[1]
            values = " / ".join(words(float(row[key]) * factor) for key in ("value", "reference"))
            cells.append(CaseValue(ratio=utilisation(ratios, "ultimate", str(place), worst), note=values))
        rows.append(cells)
    caption = f"Governing ultimate loads of {names[0]} over those of {names[1]}, {WITH}"
    return Table(["interface", *load_heads(LOADS)], rows, caption=caption)


def _energy(a: DesignLoads, b: DesignLoads, names: list[str]) -> list[Block]:
    blocks: list[Block] = []
    if a.energy is not None and b.energy is not None:
        both, ratio = " and ".join(map(energy_words, (a.energy, b.energy))), a.energy.energy / b.energy.energy
        blocks.append(f"Annual energy production: {both}, ratio {ratio:.4f}.")
    curves = [
        Curve(name, d.powers.index.to_numpy(float), d.powers["power"].to_numpy(float) * display("W")[1])
        for name, d in zip(names, (a, b), strict=True)
        if len(d.powers)
    ]
    if curves:
        axes = Axis("wind speed", "m/s"), Axis("power", "kW", start=0.0)
        blocks.append(Chart("Mean power", *axes, curves, caption="of the production cases at each wind speed"))
    return blocks


def _unit(kind: str, load: str) -> tuple[str, float]:
    if kind == "energy":
        return "GWh", 1.0 / GWH
    if load == "tilt max":
        return "deg", 180.0 / math.pi
    return ("m", 1.0) if kind in ("clearance", "motion") else unit_of_driver(load)


def _all(ratios: pd.DataFrame, names: list[str]) -> Table:
    rows: list[list[Cell]] = []
    for (kind, place, load), row in ratios.iterrows():
        unit, factor = _unit(kind, load)
        ratio: Cell = f"{row.ratio:.3f}" if math.isfinite(row.ratio) else ""
        if row.ratio > 1.0 and kind in ("ultimate", "fatigue", "motion"):
            ratio = Marked(str(ratio), "over")
        names_of_cases = enumerate((row.case, row.reference_case))
        cases = [CaseName(name, base) if isinstance(name, str) and name else "" for base, name in names_of_cases]
        values = (float(row.value) * factor, float(row.reference) * factor)
        rows.append([kind, title_of(place), load, unit, *values, ratio, *cases])
    head = ["kind", "interface", "load", "unit", *names, "ratio", f"case\n{names[0]}", f"case\n{names[1]}"]
    return Table(head, rows)


def _plain_rows(ratios: pd.DataFrame, names: list[str]) -> tuple[list[str], list[list[str]]]:
    """Header and rows in SI units."""
    head = ["kind", "interface", "load", *names, "ratio", "case", "reference case"]
    keys = ("value", "reference", "ratio")
    return head, [
        [*place, *(f"{row[key]:.15g}" for key in keys), str(row["case"] or ""), str(row["reference_case"] or "")]
        for place, row in ratios.iterrows()
    ]
