"""The first-order lag, stepped exactly for an input that changes linearly over the step."""

from __future__ import annotations

from math import expm1
from typing import NamedTuple

from meltemi.compiler import kernel, where


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
    moved = h > 0.0
    lost = -expm1(-h)
    mean = where(moved, lost / where(moved, h, 1.0), 1.0)
    return Lag(1.0 - lost, mean - (1.0 - lost), 1.0 - mean)


@kernel
def lagged(w: Lag, y: float, before: float, after: float) -> float:
    """State at the end of the step."""
    return w.state * y + w.before * before + w.after * after
