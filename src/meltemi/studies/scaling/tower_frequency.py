"""``scale_turbine`` with the tower frequency of the assembled turbine."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import numpy as np

from meltemi.analyses.modes import natural_modes
from meltemi.core.calls import explained
from meltemi.core.errors import InputError
from meltemi.simulation.rotors import build
from meltemi.studies.scaling import turbine as rigid
from meltemi.turbine.definition import Turbine

P = ParamSpec("P")
FORE_AFT = "tower 1st fore-aft"
TOLERANCE, MOST_TRIALS = 1e-4, 10


def _of_the_machine(scaled: Callable[P, Turbine]) -> Callable[P, Turbine]:
    """Decorator: the tower frequency is that of the assembled turbine at rest, not of a rigid body on a clamped tower.

    Flexible blades, gravity and the foundation reduce the frequency by some 4 %, nearly independent of its value: a few
    iterations suffice.
    """

    @explained
    @wraps(scaled)
    def scale_turbine(*args: P.args, **kwargs: P.kwargs) -> Turbine:
        turbine, wanted = scaled(*args, **kwargs), kwargs.get("tower_frequency")
        if wanted is None:
            return turbine
        assert isinstance(wanted, int | float)  # others are rejected before
        target = float(wanted)
        for _ in range(MOST_TRIALS):
            frequency = first_fore_aft(turbine)
            if abs(frequency / wanted - 1.0) < TOLERANCE:
                return turbine
            target *= wanted / frequency
            kwargs["tower_frequency"] = target
            turbine = scaled(*args, **kwargs)
        raise InputError(f"scale_turbine: no tower gives the turbine a tower_frequency of {wanted:g} Hz")

    return scale_turbine


def first_fore_aft(turbine: Turbine) -> float:
    """Frequency [Hz] of the mode of a turbine at rest with the largest first fore-aft tower motion."""
    modes = [mode for mode in natural_modes(build(turbine)) if FORE_AFT in mode.coordinates]
    most = max(modes, key=lambda mode: abs(mode.shape[mode.coordinates.index(FORE_AFT)]))
    return most.frequency / (2.0 * np.pi)


scale_turbine = _of_the_machine(rigid.scale_turbine)
