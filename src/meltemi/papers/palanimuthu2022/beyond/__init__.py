"""Results beyond the paper.

A part is a module of this package with two functions: ``study(quick, *, turbine, workers, progress)`` runs it and
returns the results; ``chapter(results, draw, *, applied)`` presents them in text, figures and tables. Names of files
begin with that of the module.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from meltemi.papers.study import answer_chapter
from meltemi.reports.blocks import Block, Section, Table
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

PARTS = ("machines", "power", "coordination", "climate", "farm")
"""Parts in the order of the page."""


def loaded(name: str) -> Turbine:
    """An aeroelastic turbine of the library."""
    return aeroelastic(load_turbine(name), "loads in turbulence")


def part_chapter(
    words: str,
    verdict: Callable[[], str],
    drawings: Sequence[Block],
    tables: Callable[[], Sequence[Table]],
    *,
    applied: bool,
) -> Section:
    """Chapter of a part; applied to another turbine it is without the verdict, which is on the review's."""
    heading = words[0].upper() + words[1:] if applied else f"Beyond the paper: {words}"
    return answer_chapter(heading, None if applied else verdict, drawings, tables)
