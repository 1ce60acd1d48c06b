"""Controller gains of an imported turbine from its aerodynamics, for the command line."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from meltemi.core.errors import InputError
from meltemi.exchange.report import ImportedTurbine
from meltemi.exchange.windio.control import GAINS
from meltemi.tuning.baseline_tuning import tune_baseline


def with_tuned_gains(imported: ImportedTurbine, given: Mapping[str, Any]) -> ImportedTurbine:
    """The import with gains tuned to the aerodynamics of the turbine and its stability margins, or a note why not.

    Args:
      given: supplementary control values by key path, which are not replaced.
    """
    try:
        tuning = tune_baseline(imported.turbine)
    except InputError as error:
        return _noted(imported, f"NREL 5 MW by similarity, margins unknown ({error})")
    tuned = dataclasses.replace(imported, turbine=imported.turbine.replace(control=tuning.control.replace(**given)))
    return _noted(tuned, f"tune_baseline: {tuning.frequency:.3g} rad/s, the fastest with margins")


def _noted(imported: ImportedTurbine, why: str) -> ImportedTurbine:
    """The import with another note on its pitch gains."""
    new = [dataclasses.replace(note, why=why) if note.what == GAINS else note for note in imported.notes]
    return dataclasses.replace(imported, notes=tuple(new))
