"""What functions written for any number type need beyond arithmetic, here for plain floats."""

from __future__ import annotations

from math import frexp, ldexp
from typing import NamedTuple

import numpy as np

from meltemi.core.kernel import kernel

SQRT_HALF = 0.7071067811865476


class Split(NamedTuple):
    """A positive number, mantissa 2^exponent."""

    mantissa: float
    exponent: float


@kernel
def where(condition: bool, yes: float, no: float) -> float:
    """``yes`` where the condition holds, else ``no``."""
    return yes if condition else no


@kernel
def floor(x: float) -> float:
    """Largest whole number not above x, as a float."""
    return float(np.floor(x))


@kernel
def two_to(n: float) -> float:
    """2^n for a whole number n from -1022 to 1023."""
    return ldexp(1.0, int(n))


@kernel
def split(x: float) -> Split:
    """Mantissa in [sqrt(1/2), sqrt(2)) and exponent of a positive normal number."""
    m, e = frexp(x)
    if m < SQRT_HALF:
        return Split(2.0 * m, float(e - 1))
    return Split(m, float(e))
