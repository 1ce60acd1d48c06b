"""Channels of a list that a model can record."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

from meltemi.core.errors import InputError
from meltemi.simulation.channels import DEFAULT, Channel, ChannelSet, catalogue, channels_of_group, every_kind, find
from meltemi.simulation.openfast_only import why_missing


def recordable(names: Iterable[str], available: dict[str, Channel]) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names of channels without those that OpenFAST has, but a model has not, and why for each of them.

    Args:
      names: meltemi's, OpenFAST's, ``all``, and patterns with ``*``.
      available: channels of the model.

    Raises:
      InputError: a name that neither has.
    """
    missing: dict[str, str] = {}
    names = tuple(names)
    for name in names:
        if name == "all" or "*" in name or name in DEFAULT:
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
    many = catalogue(ChannelSet(nodes=100, blade_stations=9, tower_stations=9))
    every = (every_kind() | many | {c.name: c for c in channels_of_group("line", 30)}).values()
    return frozenset(name.lower() for channel in every for name in channel.names[1:])
