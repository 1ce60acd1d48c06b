"""Chapters on the coordination of pitch, torque and yaw: :mod:`meltemi.studies.power_schemes.coordination`."""

from __future__ import annotations

from meltemi.papers.palanimuthu2022.beyond import loaded, part_chapter
from meltemi.papers.palanimuthu2022.beyond.power import TURBINE, slow_base
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.study import Draw, Progress, answer_chapter
from meltemi.postprocess.ensemble import EnsembleTable
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import change_text, scheme_rows
from meltemi.studies.power_schemes import coordination
from meltemi.studies.power_schemes.coordination import (
    ENERGY,
    LEVEL,
    PITCH,
    ROOT_LOAD,
    TOWER_LOAD,
    TURNED,
    UNITS,
    ProposalComparison,
    Tables,
    coordination_figure,
)
from meltemi.turbine.definition import Turbine


def study(quick: bool, *, turbine: Turbine | None = None, workers: int | None, progress: Progress) -> Tables:
    """All candidates on the review's aeroelastic turbine, or another one."""
    return coordination.study(turbine or loaded(TURBINE), quick, workers=workers, progress=progress)


def bench(quick: bool, *, workers: int | None, progress: Progress) -> ProposalComparison:
    """The comparison on the default page."""
    return coordination.bench(loaded(TURBINE), quick, workers=workers, progress=progress)


def bench_chapter(comparison: ProposalComparison, draw: Draw) -> Section:
    """Chapter of the comparison on the default page."""
    heading = "The paper's proposal and ours on an aeroelastic turbine"
    words = "Changes against A0 on an aeroelastic 22 MW turbine in hours of turbulent wind that turns; 95 % intervals"
    figure = draw("bench", words, lambda: coordination_figure({LEVEL: comparison.conventional}))

    def bench_tables() -> list[Table]:
        conditions = f"{100.0 * LEVEL:.0f} % of rated power asked for; changes in percent with 95 % intervals"
        return [
            _table(comparison.conventional, f"Against the conventional scheme, {conditions}"),
            _table(comparison.proposal, f"Best of ours against the paper's proposal, {conditions}"),
        ]

    return answer_chapter(heading, lambda: sentence("bench", n=comparison.conventional.seeds), [figure], bench_tables)


def chapter(ensembles: Tables, draw: Draw, *, applied: bool = False) -> Section:
    """Chapter of the coordination schemes."""
    words = "Coordination on an aeroelastic turbine in hours of turbulent wind that turns; bars: 95 % intervals"
    figure = draw("coordination_changes", words, lambda: coordination_figure(ensembles))
    heading = "which coordination wins"
    return part_chapter(heading, lambda: verdict(ensembles), [figure], lambda: tables(ensembles), applied=applied)


def tables(ensembles: Tables) -> list[Table]:
    """One table for each level."""
    words = "{:.0f} % of rated power asked for; changes in percent with 95 % intervals"
    return [_table(ensemble, words.format(100.0 * level)) for level, ensemble in ensembles.items()]


def _table(ensemble: EnsembleTable, caption: str) -> Table:
    """Means of the first scheme and changes of the others."""
    _, rows, _ = scheme_rows(ensemble, UNITS, means=False)
    return Table(["quantity", "unit", *ensemble.schemes], rows, caption=f"{caption}.", text_columns=2)


def _pitch_of_each_blade(table: EnsembleTable) -> str:
    """Pitch travel of individual pitch control relative to the same scheme without it."""
    single, shared = "all three, individual pitch", "all three"
    if not {single, shared} <= set(table.schemes):
        return ""
    first = table.schemes[0]
    changes = [table.entry(PITCH, name).change for name in (single, shared)]
    individual, other = (1.0 + (0.0 if change is None else change.mean) for change in changes)
    return f" {sentence('individual', ratio=individual, first=first, other=individual / other, shared=shared)}"


def verdict(ensembles: Tables) -> str:
    """Conclusion, from the results."""
    quantities, lines = (ENERGY, PITCH, TURNED, TOWER_LOAD, ROOT_LOAD), []
    for level, table in ensembles.items():
        words = []
        for name in table.schemes[1:]:
            changes = [f"{each} {change_text(table.entry(each, name).change)} %" for each in quantities]
            words.append(f"*{name}*: {', '.join(changes)}")
        base = f" {slow_base()}: part of the energy that the others add is that base's loss." if level == 1.0 else ""
        numbers = {"level": 100.0 * level, "base": table.schemes[0], "changes": "; ".join(words)}
        lines.append(sentence("coordination", **numbers) + _pitch_of_each_blade(table) + base)
    return "\n\n".join(lines)
