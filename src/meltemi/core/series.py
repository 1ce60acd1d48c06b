"""Quantities that may vary in time."""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Discriminator, Tag, model_validator

from meltemi.core.record import Record, Vector


class TimeSeries(Record):
    """A quantity over time: interpolated linearly, constant before the first and after the last time.

    A time that stands twice is a jump.
    """

    time: Vector
    """(n,) [s] times from the start of the run, not decreasing."""
    value: Vector
    """(n,) values in the unit of the quantity."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.time) == 0:
            raise ValueError("time: at least one entry is needed")
        if len(self.value) != len(self.time):
            raise ValueError(f"value has {len(self.value)} entries, but time has {len(self.time)}")
        if np.any(np.diff(self.time) < 0.0):
            i = int(np.flatnonzero(np.diff(self.time) < 0.0)[0])
            raise ValueError(f"time must not decrease, but entry {i + 2} is {self.time[i + 1]:g} s")
        if np.any(self.time[2:] == self.time[:-2]):
            raise ValueError("time: an entry may be repeated once, for a step")
        return self


def _which(given: Any) -> str:
    return "TimeSeries" if isinstance(given, dict | TimeSeries) else "number"


Varying = Annotated[
    Annotated[float, Tag("number")] | Annotated[TimeSeries, Tag("TimeSeries")],
    Discriminator(_which),  # so that the error names the alternative that was meant
]
"""A constant or a series."""


def values(quantity: Varying) -> NDArray[np.float64]:
    """All values at the given times."""
    return quantity.value if isinstance(quantity, TimeSeries) else np.array([quantity])


def on_times(quantity: Varying, times: ArrayLike) -> NDArray[np.float64]:
    """The quantity at non-decreasing ``times``; at a repeated time, the values before and after the step."""
    at = np.asarray(times, dtype=np.float64)
    if not isinstance(quantity, TimeSeries):
        return np.full(len(at), float(quantity))
    t, x = quantity.time, quantity.value
    after = np.interp(at, t, x)  # at a jump, NumPy gives the value after it
    first = np.searchsorted(t, at, side="left")
    jumps = (np.searchsorted(t, at, side="right") - first == 2) & np.append(np.diff(at) == 0.0, False)
    return np.where(jumps, x[np.minimum(first, len(t) - 1)], after)


def changing(time: ArrayLike, *columns: ArrayLike) -> tuple[float, float] | None:
    """[s] begin and end of the changes of quantities that are given at the same times; None if none changes."""
    at = np.asarray(time, dtype=np.float64)
    moved = np.flatnonzero(np.any(np.diff(np.stack(columns)) != 0.0, axis=0))
    return (float(at[moved[0]]), float(at[moved[-1] + 1])) if len(moved) else None


def union(*quantities: Varying) -> NDArray[np.float64]:
    """All times at which a quantity is given, steps twice; 0 if all are constant."""
    series = [q.time for q in quantities if isinstance(q, TimeSeries)]
    if not series:
        return np.zeros(1)
    times = [t for t in np.unique(np.concatenate(series)) for _ in range(max(int(np.sum(s == t)) for s in series))]
    return np.array(times)
