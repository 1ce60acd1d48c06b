"""The mean of a signal over a window that moves with time, exact.

The window is a ring of blocks. A block is one sample where the ring has room for all of the window; else as many as
needed, and the window moves block by block. Before the window is full the mean is that since the start, unless the
value before the start is known: then the window begins full of it. The running sum is made anew whenever the ring has
gone round, so rounding does not grow with time.

State and settings lie in a vector from the place ``at`` on.

Reference: docs/theory/control.md (C-60).
"""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole
from meltemi.maths.tables import Table, number

Float = NDArray[float64]


class MovingMean(Table):
    """What stands before the ring."""

    window: float = number("s", "over which the mean is taken")
    room: float = number("-", "of the ring, in blocks")
    known: float = number("-", "1: the value before the start is known")
    before: float = number("signal", "that value")
    per_block: float = number("-", "samples of a block; 0 before the first call")
    blocks: float = number("-", "of the window")
    oldest: float = number("-", "place of the oldest block")
    filled: float = number("-", "blocks that are filled")
    sum: float = number("signal", "of the blocks")
    part: float = number("signal", "sum of the block that begins")
    count: float = number("-", "its samples")


WINDOW, ROOM, KNOWN, BEFORE, PER_BLOCK, BLOCKS, OLDEST, FILLED, SUM, PART, COUNT = range(len(MovingMean))
RING = len(MovingMean)


def mean_states(room: int) -> int:
    """How many places of a vector a moving mean takes."""
    return RING + room


def mean_start(x: Float, at: int, window: float, room: int, before: float | None = None) -> None:
    """Set a moving mean to its beginning: window [s], blocks of its ring, and the signal before, if it is known."""
    x[at : at + mean_states(room)] = 0.0
    x[at + WINDOW], x[at + ROOM] = window, room
    if before is not None:
        x[at + KNOWN], x[at + BEFORE] = 1.0, before


@kernel
def moving_mean(x: Float, at: int, signal: float, dt: float) -> float:
    """One call: the mean of the signal over the window, in the signal's unit (C-60)."""
    if x[at + PER_BLOCK] < 1.0:
        samples, room = max(whole(x[at + WINDOW] / dt + 0.5), 1), whole(x[at + ROOM])
        x[at + PER_BLOCK] = float((samples + room - 1) // room)
        x[at + BLOCKS] = float(max(samples // whole(x[at + PER_BLOCK]), 1))
        if x[at + KNOWN] > 0.5:
            x[at + FILLED] = x[at + BLOCKS]
            for i in range(whole(x[at + BLOCKS])):
                x[at + RING + i] = x[at + BEFORE] * x[at + PER_BLOCK]
                x[at + SUM] += x[at + RING + i]
    per, blocks = whole(x[at + PER_BLOCK]), whole(x[at + BLOCKS])
    x[at + PART] += signal
    x[at + COUNT] += 1.0
    if whole(x[at + COUNT]) >= per:
        oldest = whole(x[at + OLDEST])
        x[at + SUM] += x[at + PART] - x[at + RING + oldest]
        x[at + RING + oldest] = x[at + PART]
        x[at + PART], x[at + COUNT] = 0.0, 0.0
        x[at + FILLED] = float(min(whole(x[at + FILLED]) + 1, blocks))
        oldest += 1
        if oldest >= blocks:
            oldest = 0
            x[at + SUM] = 0.0
            for i in range(blocks):
                x[at + SUM] += x[at + RING + i]
        x[at + OLDEST] = float(oldest)
    filled = whole(x[at + FILLED])
    if filled < blocks:
        return (x[at + SUM] + x[at + PART]) / (filled * per + whole(x[at + COUNT]))
    return x[at + SUM] / (blocks * per)
