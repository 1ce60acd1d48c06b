"""Load case of an imported model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from meltemi.cases.case import LoadCase
from meltemi.controllers.names import controller_keys
from meltemi.core.yamlfile import validated
from meltemi.exchange.report import ImportedModel
from meltemi.simulation.channels import DEFAULT
from meltemi.tuning.turbine_controller import turbine_controller

STAND_IN = {"kind": "steady", "speed": 10.0, "shear_exponent": 0.2}
"""Wind of a case whose deck has a wind that case files do not support."""


def deck_case(
    deck: ImportedModel, turbine: str | Path, *, started: bool = False, controller: Mapping[str, Any] | None = None
) -> LoadCase:
    """Wind, sea, duration, channels, model options, gravity and air density of an OpenFAST deck or HAWC2 model.

    Args:
      deck: imported model from :func:`read_deck` or :func:`import_hawc2`.
      turbine: turbine file of the case: the main file of the deck, or a turbine file written from it.
      started: begin at the rotor speed, pitch and azimuth of the deck instead of in steady operation.
      controller: controller keys of the case; a library takes settings and time step from the deck where they are not
        given. The baseline controller by default, see :func:`deck_controller`.

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
    if controller is not None:
        data["controller"] = _library_keys(deck) | dict(controller) if controller["kind"] == "bladed" else controller
    if deck.sea is not None:
        data["sea"] = deck.sea
    if started:
        data["start"] = {**deck.start, "undeflected": True}
    return validated(data, LoadCase, str(turbine))


def deck_controller(deck: ImportedModel) -> tuple[dict[str, Any], str]:
    """Keys of the controller with which a deck runs, and a note, see :func:`turbine_controller`."""
    name, note = turbine_controller(deck.turbine)
    return dict(controller_keys(name)), note


def _library_keys(deck: ImportedModel) -> dict[str, Any]:
    """Case keys of a controller library with the settings that the deck gives to its library."""
    library = getattr(deck, "library", {})
    keys = {"input": library.get("input") or deck.turbine.control.discon, "sample_time": library.get("step")}
    keys |= {name: library[name] for name in ("procedure", "individual_pitch") if name in library}
    return {name: value for name, value in keys.items() if value is not None}
