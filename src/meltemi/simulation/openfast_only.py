"""Channels that OpenFAST has and meltemi has not, by patterns of their names.

From the lists of OpenFAST 5.0: ``ValidParamAry`` in ``*_IO.f90``, ``*_IO_Params.f90``, ``*_BldNdOuts_IO.f90``,
``HydroDyn_Output.f90``, ``Morison_Output.f90``, ``SeaState_Output.f90``, ``SubDyn_Output_Params.f90``,
``InflowWind_Subs.f90`` and ``MDIO_ProcessOutList`` of ``MoorDyn_IO.f90``.
"""

from __future__ import annotations

import csv
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple


class OpenfastOnly(NamedTuple):
    """Channels of one kind; in ``names``, a regular expression irrespective of case, ``#`` is a number."""

    module: str
    names: str
    what: str
    instead: str


@cache
def openfast_only() -> dict[re.Pattern[str], OpenfastOnly]:
    """All kinds by their pattern."""
    with (Path(__file__).parent / "openfast_only.csv").open(newline="", encoding="utf-8") as file:
        kinds = [OpenfastOnly(**row) for row in csv.DictReader(file)]
    return {re.compile(kind.names.replace("#", r"\d+"), re.IGNORECASE): kind for kind in kinds}


def why_missing(name: str) -> str | None:
    """Why there is no channel of a name that OpenFAST knows, and what comes near; None if OpenFAST knows it neither."""
    for pattern, kind in openfast_only().items():
        if pattern.fullmatch(name.strip().lstrip("-_")):
            near = f"; similar: {kind.instead}" if kind.instead else ""
            return f"a channel of {kind.module} ({kind.what}), not available here{near}"
    return None
