"""The first-order lag, stepped exactly for an input that changes linearly over the step."""

from __future__ import annotations

from math import exp
from typing import NamedTuple

from meltemi.core.kernel import kernel
from meltemi.maths.generic import where


class Lag(NamedTuple):
    """Weights of the state and of the inputs at both ends of a step."""

    state: float
    before: float
    after: float


@kernel
def lag(h: float) -> Lag:
    """Weights for a step of ``h`` time constants (A-30): y1 = state y0 + before u0 + after u1.

    Solves dy/dt = (u - y) / tau exactly for linear u; h = 0 leaves y unchanged.
    """
    e = exp(-h)
    # (1 - exp(-h)) / h, by its series where the quotient would lose digits
    mean = where(h < 1e-3, 1.0 - h * (0.5 - h * (1.0 / 6.0 - h * (1.0 / 24.0))), (1.0 - e) / max(h, 1e-3))
    return Lag(e, mean - e, 1.0 - mean)


@kernel
def lagged(w: Lag, y: float, before: float, after: float) -> float:
    """State at the end of the step."""
    return w.state * y + w.before * before + w.after * after
