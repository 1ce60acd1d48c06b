"""Frequencies of the assembled machine in vacuum, and the time step they allow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

STEP_LIMIT = 0.4
"""Largest product of angular frequency and default time step (docs/theory/simulation.md, M-5)."""
OUTPUT_STEP = 0.05
"""[s] default time steps divide this."""


def vacuum_case(model: Model) -> Case:
    """A case without air or wind."""
    return Case(model.with_parameters(**{"aerodynamics.air_density": 0.0}), SteadyWind(speed=0.0))


def derivative_matrix(case: Case, which: str, step: float = 1e-4) -> Float:
    """(n, n) central differences of all accelerations with respect to ``"q"`` or ``"v"``."""
    x = case[which]
    n = len(x)
    J = np.zeros((n, n))
    for j in range(n):
        x0 = x[j]
        x[j] = x0 + step
        case.evaluate(0.0)
        ahead = case["a"].copy()
        x[j] = x0 - step
        case.evaluate(0.0)
        J[:, j] = (ahead - case["a"]) / (2.0 * step)
        x[j] = x0
    return J


def highest_frequency(model: Model) -> float:
    """[rad/s] of the assembled machine at rest."""
    case = vacuum_case(model)
    free = np.flatnonzero(model.locked == 0.0)
    stiffness = -derivative_matrix(case, "q")[np.ix_(free, free)]
    return float(np.sqrt(np.max(np.abs(np.linalg.eigvals(stiffness))))) if len(free) else 0.0


def time_step(model: Model) -> float:
    """Default time step [s]: the largest fraction of 0.05 s that resolves the highest frequency."""
    frequency = highest_frequency(model)
    return OUTPUT_STEP / max(2, int(np.ceil(OUTPUT_STEP * frequency / STEP_LIMIT)))
