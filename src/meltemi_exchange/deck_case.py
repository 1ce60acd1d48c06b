"""Load case of an imported model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from meltemi.core.yamlfile import validated
from meltemi.loadcases.case import LoadCase
from meltemi.simulation.channels import DEFAULT
from meltemi_exchange.report import ImportedModel

STAND_IN = {"kind": "steady", "speed": 10.0, "shear_exponent": 0.2}
"""Wind of a case whose deck has a wind that case files do not support."""


def deck_case(deck: ImportedModel, turbine: str | Path, *, started: bool = False) -> LoadCase:
    """Wind, sea, duration, channels, model options, gravity and air density of an OpenFAST deck or HAWC2 model.

    Args:
      deck: from :func:`read_deck` or :func:`import_hawc2`.
      turbine: what the case names: the main file of the deck, or a turbine file written from it.
      started: begin at the rotor speed, pitch and azimuth of the deck, as its program does, instead of in steady
        operation.

    Raises:
      InputError: the run of the deck is not supported.
    """
    data: dict[str, Any] = {
        "turbine": str(turbine),
        "wind": deck.wind or STAND_IN,
        "duration": deck.duration,
        "output_step": deck.output_step,
        "options": deck.options,
        "environment": deck.environment,
    }
    if deck.output:
        data |= deck.output | {"channels": tuple(dict.fromkeys((*DEFAULT, *deck.output["channels"])))}
    if deck.sea is not None:
        data["sea"] = deck.sea
    if started:
        data["start"] = {**deck.start, "undeflected": True}
    return validated(data, LoadCase, str(turbine))
