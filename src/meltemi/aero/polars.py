"""Polars on a uniform grid of the angle of attack, and their look-up."""

from __future__ import annotations

from math import floor, pi
from typing import NamedTuple

from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.tables import PolarPoint
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole

Float = NDArray[float64]

LIFT, DRAG, MOMENT, ATTACHMENT, ATTACHED, SEPARATED = PolarPoint.slots(
    "lift drag moment attachment attached_lift separated_lift"
)


class Place(NamedTuple):
    """A place between two rows of a polar."""

    row: int
    weight: float


@kernel
def locate(polars: Float, alpha: float) -> Place:
    """Rows around the angle of attack ``alpha`` [rad], any angle."""
    last = polars.shape[1] - 1
    turns = (alpha + pi) * (0.5 / pi)
    x = (turns - floor(turns)) * last
    row = min(max(whole(x), 0), last - 1)  # what is no number must not lead out of the table
    return Place(row, x - row)


@kernel
def coefficient(polars: Float, g: int, at: Place, column: int) -> float:
    """Coefficient of polar ``g`` at a place, linear between rows."""
    a = polars[g, at.row, column]
    return a + at.weight * (polars[g, at.row + 1, column] - a)
