"""Gains of an imported turbine from its own aerodynamics, for the command line."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from meltemi.core.errors import InputError
from meltemi.exchange.report import ImportedTurbine
from meltemi.exchange.windio.control import GAINS
from meltemi.tuning.baseline_tuning import tune_baseline


def with_own_gains(imported: ImportedTurbine, given: Mapping[str, Any]) -> ImportedTurbine:
    """An import with gains from the turbine's own aerodynamics, which keep margins; or why it has none.

    Args:
      given: values of the control by key path that were supplied beside the file, and stay.
    """
    try:
        found = tune_baseline(imported.turbine)
    except InputError as error:
        return _noted(imported, f"NREL 5 MW by similarity, margins unknown ({error})")
    tuned = dataclasses.replace(imported, turbine=imported.turbine.replace(control=found.control.replace(**given)))
    return _noted(tuned, f"tune_baseline: {found.frequency:.3g} rad/s, the fastest with margins")


def _noted(imported: ImportedTurbine, why: str) -> ImportedTurbine:
    """With the note on pitch gains replaced."""
    new = [dataclasses.replace(note, why=why) if note.what == GAINS else note for note in imported.notes]
    return dataclasses.replace(imported, notes=tuple(new))
