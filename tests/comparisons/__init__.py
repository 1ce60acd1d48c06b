"""Comparisons with stored runs of OpenFAST, whose figures nobody can change: tests, and pages of the documentation."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.verification import table

DATA = Path(__file__).parent / "data"
reference_table = partial(table.reference_table, folder=DATA)
source_of = partial(table.source_of, folder=DATA)


@cache
def thinned(name: str) -> dict[str, NDArray[Any]]:
    """Arrays of a file of thinned reference data; ``about`` names the source (``tools/reference_tables.py``)."""
    with np.load(DATA / f"{name}.npz") as z:
        return dict(z)
