"""Channels that OpenFAST has and meltemi has not, by patterns of their names.

From the lists of OpenFAST 5.0: ``ValidParamAry`` in ``*_IO.f90``, ``*_IO_Params.f90``, ``*_BldNdOuts_IO.f90``,
``HydroDyn_Output.f90``, ``Morison_Output.f90``, ``SeaState_Output.f90``, ``SubDyn_Output_Params.f90``,
``InflowWind_Subs.f90`` and ``MDIO_ProcessOutList`` of ``MoorDyn_IO.f90``.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

from meltemi.core.errors import InputError
from meltemi.simulation.channels import DEFAULT, Channel, Contents, catalogue, channels_of_group, every_kind, find


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


def recordable(names: Iterable[str], available: dict[str, Channel]) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names of channels without those that OpenFAST has, but a model has not, and why for each of them.

    Args:
      names: meltemi's, OpenFAST's, and ``all``.
      available: channels of the model.

    Raises:
      InputError: a name that neither has.
    """
    missing: dict[str, str] = {}
    names = tuple(names)
    for name in names:
        if name == "all" or name in DEFAULT:
            continue
        try:
            find(name, available)
        except InputError as error:
            if why_missing(name) is None and name.lower() not in _of_any_turbine():
                raise
            missing[name] = str(error).partition(": ")[2]
    return tuple(name for name in names if name not in missing), missing


@cache
def _of_any_turbine() -> frozenset[str]:
    """OpenFAST's names of channels that some turbine has, in lower case."""
    many = catalogue(Contents(nodes=100, blade_stations=9, tower_stations=9))
    every = (every_kind() | many | {c.name: c for c in channels_of_group("line", 30)}).values()
    return frozenset(name.lower() for channel in every for name in channel.names[1:])
