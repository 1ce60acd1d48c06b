"""Results beyond the paper.

A part is a module of this package with two functions: ``study(quick, *, turbine, workers, progress)`` runs it and
returns the results; ``chapter(results, draw, *, applied)`` presents them in text, figures and tables. Names of files
begin with that of the module.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from meltemi.papers.study import Chapter, Drawing, answer_chapter
from meltemi.reports.blocks import Table

PARTS = ("machines", "power", "coordination", "climate", "farm")
"""In the order of the page."""


def part_chapter(
    words: str,
    verdict: Callable[[], str],
    drawings: Sequence[Drawing],
    tables: Callable[[], Sequence[Table]],
    *,
    applied: bool,
) -> Chapter:
    """Chapter of a part; applied to another turbine without the verdict, which is on the review's turbine."""
    heading = words[0].upper() + words[1:] if applied else f"Beyond the paper: {words}"
    return answer_chapter(heading, None if applied else verdict, drawings, tables)
