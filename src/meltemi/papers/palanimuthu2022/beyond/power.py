"""Chapter on energy and loads of the schemes of limited power: :mod:`meltemi.studies.power_schemes`."""

from __future__ import annotations

from meltemi.papers.palanimuthu2022.beyond import loaded, part_chapter
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.study import Draw, Progress
from meltemi.postprocess.ensemble import EnsembleTable
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import scheme_rows
from meltemi.studies.power_schemes import costs as schemes
from meltemi.studies.power_schemes.costs import (
    ENERGY,
    FOLLOWING,
    FRONT_LEVEL,
    PITCH,
    ROOT_LOAD,
    SHAFT_LOAD,
    STEADY,
    TOWER_LOAD,
    TRACKING,
    UNITS,
    Costs,
    Tables,
    costs_figure,
    efficient,
    front_figure,
)
from meltemi.turbine.definition import Turbine

TURBINE = "iea22mw"
BASE_SPEED = 0.864
"""Share of rated speed at which the optimal torque meets rated power, and which A0 holds at full power."""


def study(quick: bool, *, turbine: Turbine | None = None, workers: int | None, progress: Progress) -> Costs:
    """The schemes on the review's aeroelastic turbine, or another one."""
    return schemes.study(turbine or loaded(TURBINE), quick, workers=workers, progress=progress)


def chapter(costs: Costs, draw: Draw, *, applied: bool = False) -> Section:
    """Chapter of the active-power schemes."""
    words = "Cost of the schemes on an aeroelastic turbine at 12 m/s, class IB; bars: 95 % intervals of the mean"
    front = f"A2 with upper speeds of so many percent of rated, at {100.0 * FRONT_LEVEL:.0f} % of rated power"
    drawings = [
        draw("power_costs", words, lambda: costs_figure(costs.tables)),
        draw("power_front", front, lambda: front_figure(costs.front)),
    ]
    heading = "what each scheme of limited power costs"
    return part_chapter(heading, lambda: verdict(costs), drawings, lambda: tables(costs), applied=applied)


def tables(costs: Costs) -> list[Table]:
    """One table for a constant and one for a varying power reference, and one of the upper speeds."""
    tables = []
    for signal, words in ((STEADY, "A steady reference"), (FOLLOWING, "A reference that follows a regulation signal")):
        rows = []
        for (kind, level), ensemble in costs.tables.items():
            if kind == signal:
                rows += [[f"{100.0 * level:.0f} %", *row] for row in scheme_rows(ensemble, UNITS, means=False)[1]]
        names = next(iter(costs.tables.values())).schemes
        head = ["asked for", "quantity", "unit", names[0], *(f"{name} against {names[0]}, %" for name in names[1:])]
        tables.append(Table(head, rows, caption=f"{words}; changes seed by seed with 95 % intervals.", text_columns=3))
    head = ["quantity", "unit", "A2", *(f"{name}, %" for name in costs.front.schemes[1:])]
    caption = f"Upper speeds of A2 at {100.0 * FRONT_LEVEL:.0f} % of rated power; changes against A2"
    return [*tables, Table(head, scheme_rows(costs.front, UNITS, means=False)[1], caption, text_columns=2)]


def range_of(tables: Tables, quantity: str, scheme: str) -> str:
    """Smallest and largest mean change of a quantity in percent, over levels and signals."""
    changes = [c.mean for t in tables.values() if (c := t.entry(quantity, scheme).change) is not None]
    return f"{100.0 * min(changes):+.0f} to {100.0 * max(changes):+.0f} %"


def best_scheme(table: EnsembleTable, quantity: str) -> str:
    """The scheme with the largest power, or with the smallest value of another quantity."""
    means = {scheme: table.entry(quantity, scheme).value.mean for scheme in table.schemes}
    return max(means, key=means.__getitem__) if quantity == ENERGY else min(means, key=means.__getitem__)


def slow_base() -> str:
    """Sentence on A0 at full power."""
    return sentence("slow base", speed=BASE_SPEED)


def _at_full_power(table: EnsembleTable) -> str:
    """Sentence on A2 and A1 at full power."""
    power, pitch = (
        100.0 * (table.entry(what, "A2").value.mean / table.entry(what, "A1").value.mean - 1.0)
        for what in (ENERGY, PITCH)
    )
    return f"{slow_base()}. Against A1, A2 makes {power:+.1f} % of power and {pitch:+.0f} % of pitch travel there."


def verdict(costs: Costs) -> str:
    """Conclusion, from the results."""
    tables = costs.tables
    first = next(iter(tables.values()))
    base, *others = first.schemes
    words = f"The schemes on an aeroelastic turbine ({TURBINE}) in turbulence, {first.seeds} seeds for each of "
    lines = [words + f"{len(tables)} combinations of level and signal; changes are means against {base}."]
    shown = (PITCH, TRACKING, ENERGY, TOWER_LOAD, ROOT_LOAD, SHAFT_LOAD)
    for scheme in others:
        lines.append(f"{scheme}: " + ", ".join(f"{what} {range_of(tables, what, scheme)}" for what in shown) + ".")
    best = []
    for what in shown:
        ranks = [best_scheme(table, what) for table in tables.values()]
        counts = {scheme: ranks.count(scheme) for scheme in first.schemes if scheme in ranks}
        best.append(f"{what} " + ", ".join(f"{scheme} in {n}" for scheme, n in counts.items()))
    lines.append(f"Best of {len(tables)}: " + "; ".join(best) + ".")
    if (STEADY, 1.0) in tables and {"A1", "A2"} <= set(others):
        lines.append(_at_full_power(tables[STEADY, 1.0]))
    front = {q: efficient(costs.front, (PITCH, ENERGY, q)) for q in (TOWER_LOAD, ROOT_LOAD)}
    lines.append(sentence("front", tower="; ".join(front[TOWER_LOAD]), root="; ".join(front[ROOT_LOAD])))
    return "\n\n".join(lines)
