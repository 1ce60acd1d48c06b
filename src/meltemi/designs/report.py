"""Files of a design: progress, turbine, controller, tables, and the page that compares start and end."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from meltemi.core.files import write_text
from meltemi.core.yamlfile import write_record
from meltemi.designs.design import DesignResult
from meltemi.designs.problem import Problem, Trial
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import figure_title, name_curves, new_figure, panel, save
from meltemi.report.tables import number, write_csv
from meltemi.reports.blocks import Block, Document, Marked, Picture, Section, Table
from meltemi.reports.html import write_page
from meltemi.reports.rendering import report_folder

NO_PROOF = "None: the search was interrupted, or proof.cases of a load base are not given."
MOST_NAMES = 16
"""Largest number of curves with names."""
TURBINE, CONTROLLER, LAYUP = "designed.yaml", "designed_controller.py", "designed_layup.yaml"
PAGE, PROGRESS = "design.html", "progress.png"


def write_progress(problem: Problem, trials: Sequence[Trial], out: Path) -> Path:
    """Draw objective, margins and variables of the iterations so far."""
    n, limits = np.arange(len(trials)), problem.limits
    figure, axes = new_figure(2 + bool(limits), size=(8.0, 6.6 if limits else 4.6))
    objective, variables = axes[0, 0], axes[-1, 0]
    objective.plot(n, [t.objective for t in trials], "o-", color=COLOURS[0])
    panel(objective, "Objective", "-")
    if limits:
        margins = axes[1, 0]
        rows = 100.0 * np.array([t.margins if not t.failed else np.full(len(limits), np.nan) for t in trials])
        for k, limit in enumerate(limits):
            margins.plot(n, rows[:, k], "o-", label=problem.terms[limit.term].name, markersize=2.5)
        margins.axhline(0.0, color=INK, linewidth=0.8)
        panel(margins, "Margins to the limits, over the values at the start; negative where violated", "%")
    low, high = problem.variables.low, problem.variables.high
    places = (np.array([t.x for t in trials]) - low) / (high - low)
    for p, name in enumerate(problem.variables.names):
        variables.plot(n, places[:, p], "o-", label=short(name), markersize=2.5)
    variables.set_ylim(-0.04, 1.04)
    panel(variables, "Variables between their bounds", "-", "iteration")
    if len(trials) < 12:
        variables.set_xticks(n)
    figure_title(figure, "Design by gradients")
    figure.draw_without_rendering()
    for ax, count in ((axes[1, 0], len(limits)), (variables, len(low))):
        if 0 < count <= MOST_NAMES:
            name_curves(ax)
    return save(figure, out / PROGRESS)


def short(name: str) -> str:
    """Last part of a path."""
    return ".".join(name.split(".")[-2:]).removeprefix("controller.").removeprefix("pitch.")


def variable_table(result: DesignResult) -> Table:
    """Variables at start and end, with their bounds."""
    rows = []
    for v, a, b in zip(result.problem.variables.each, result.start, result.end, strict=True):
        where = [words for words, bound in (("low", v.low), ("high", v.high)) if abs(b - bound) < 1e-3 * v.scale]
        factor = v.unit if v.unit != 1.0 else 1.0
        values = [number(x * factor) for x in (a, b, v.low, v.high)]
        rows.append([v.name, *values, ", ".join(where)])
    return Table(["variable", "start", "end", "low", "high", "at bound"], rows, "Variables", text_columns=1)


def change_table(result: DesignResult) -> Table:
    """Changes on runs that the optimiser did not see."""
    rows = []
    for each in result.proof:
        cells = [each.name, each.role, each.unit, number(each.start), number(each.end)]
        if each.change is None:
            rows.append([*cells, number(100.0 * (each.end / each.start - 1.0)), "", ""])
            continue
        c = each.change
        sure = abs(c.mean) > c.half_width
        rows.append([*cells, number(100.0 * c.mean), number(100.0 * c.half_width), "yes" if sure else "no"])
    head = ["term", "role", "unit", "start", "end", "change\n[%]", "95 %\n[%]", "distinct"]
    n = max((each.change.n for each in result.proof if each.change), default=0)
    return Table(head, rows, f"Start and end in {len(result.proof_cases)} runs that the optimiser did not see",
                 text_columns=3, note=f"Changes are paired: of the same {n} sets of wind fields, mean and half the "
                 "width of its confidence interval; distinct: zero lies outside of it.")  # fmt: skip


def sentences(result: DesignResult) -> list[str]:
    """What is active, multipliers in words, and what limits the result."""
    found = [f"search: {result.ended}" + ("" if result.interrupted else f" ({len(result.iterations) - 1} iterations)")]
    texts = {limit.text: limit for limit in result.problem.limits}
    for name, value in result.multipliers.items():
        if value <= 1e-6:
            continue
        if name in texts:
            share = number(value / abs(result.objective))
            found.append(f"active: {name}: a further 1 % of it would bring {share} % of the objective")
        else:
            found.append(f"active: {name} is at its bound: beyond it the objective would fall by {number(value)} per "
                         "scale of the variable")  # fmt: skip
    if not result.interrupted:
        found.append(
            f"gradient that limits and bounds leave: {number(100.0 * result.remainder)} % of that at the start"
        )
    for name, (value, extreme) in result.soft.items():
        found.append(f"{name}: the soft extreme {number(value)} stands for {number(extreme)} "
                     f"({number(100.0 * (value / extreme - 1.0))} %) in the first unseen run")  # fmt: skip
    if result.check is not None and not result.check.agrees:
        found.append("warning: the gradient did not agree with differences at the start; the end is a better design, "
                     "but not known to be the best")  # fmt: skip
    return found + [f"note: {each}" for each in result.notes]


def write_design(result: DesignResult, out: str | Path, *, repeat: str = "", footer: str = "") -> list[Path]:
    """Write turbine, controller, tables and page of a design.

    Args:
      out: folder, created if needed.
      repeat: how to reproduce it, such as a command line.
      footer: last line of the page.

    Returns:
      The files.

    Raises:
      InputError: a file cannot be written.
    """
    out = report_folder(out)
    write_record(result.turbine, out / TURBINE)
    files = [out / TURBINE]
    if result.entries:
        files.append(write_text(out / CONTROLLER, controller_text(result)))
    if (variables := result.problem.variables).layup is not None:
        write_record(variables.layup_at(result.end), out / LAYUP)
        files.append(out / LAYUP)
    for name, table in (("variables", variable_table(result)), ("comparison", change_table(result))):
        head = [" ".join(h.split()) for h in table.head]
        files.append(write_csv(out / f"{name}.csv", head, table.texts))
    content = {
        "variables": dict(zip(result.variables, map(float, result.end), strict=True)),
        "objective": result.objective,
        "ended": result.ended,
        "multipliers": result.multipliers,
        "simulated_seconds": result.seconds[0],
        "wall_seconds": result.seconds[1],
    }
    files.append(write_text(out / "design.json", json.dumps(content, indent=1) + "\n"))
    progress = write_progress(result.problem, result.iterations, out)
    changes = change_table(result)
    shown = [[Marked(c, "good") if j == 7 and c == "yes" else c for j, c in enumerate(row)] for row in changes.rows]
    blocks: list[Block] = [Table(changes.head, shown, changes.caption, changes.text_columns, note=changes.note)]
    check = result.check
    facts = [("Turbine", result.turbine.name), ("Variables", str(len(result.variables))),
             ("Runs a trial", str(len(result.problem.evaluator.cases))),
             ("Simulated", f"{result.seconds[0] / 3600.0:.3g} h in {result.seconds[1]:.0f} s")]  # fmt: skip
    if check is not None:
        facts.append(("Gradient", f"agrees with differences to {check.error:.1e}"))
    document = Document(
        title=f"Design by gradients: {result.turbine.name}",
        lead=f"The objective falls from {result.first.objective:.4g} to {result.objective:.4g}. {_distinct(result)}",
        facts=facts,
        sections=[
            Section("Start and end on unseen runs", blocks if result.proof else [NO_PROOF]),
            Section("Variables", [variable_table(result)]),
            Section("What holds the design", [each + "." for each in sentences(result)]),
            Section("Progress", [Picture(progress, "Objective, margins and variables after each iteration.")]),
        ],
        footer=" · ".join(filter(None, (repeat, footer))),
    )
    return [*files, progress, write_page(out / PAGE, document)]


def _distinct(result: DesignResult) -> str:
    sure = [c for c in result.proof if c.change is not None and abs(c.change.mean) > c.change.half_width]
    if not result.proof:
        return ""
    if not sure:
        return "On unseen runs no term changes by more than its confidence interval."
    return "On unseen runs: " + ", ".join(f"{c.name} {100.0 * c.change.mean:+.1f} %" for c in sure if c.change) + "."


def controller_text(result: DesignResult) -> str:
    """A Python file with the designed controller, for ``--controller`` and ``export-controller``."""
    case = result.problem.evaluator.cases[0].case
    return f'''"""Controller of a design by gradients."""

import meltemi
from meltemi.designs.runs import with_entries

GIVEN = {case.controller.model_dump()!r}
ENTRIES = {result.entries!r}


def controller(turbine):
    """The given controller, tuned for the turbine, with the designed entries of its state."""
    made = meltemi.control.make_controller(GIVEN, meltemi.build(turbine))
    return with_entries(made, ENTRIES)
'''
