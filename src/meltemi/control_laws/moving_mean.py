"""Exact moving average of a signal.

The window is a ring buffer of blocks. A block is one sample if the buffer can hold the whole window, otherwise several,
and the window moves by blocks. Before the window is full the mean is that since the start, unless the
value before the start is known: then the window is initially filled with it. The running sum is recomputed after every
round of the buffer, so rounding errors do not grow with time.

State and settings are a table, ``MovingMean``.

Reference: docs/theory/control.md (C-60).
"""

from __future__ import annotations

from meltemi.compiler import Numbers, Table, kernel, number, series, whole


class MovingMean(Table):
    """Settings, state and ring buffer."""

    window: float = number("s", "averaging time")
    room: float = number("-", "capacity of the ring buffer in blocks")
    known: float = number("-", "1: the value before the start is known")
    before: float = number("signal", "value before the start")
    per_block: float = number("-", "samples in a block; 0 before the first call")
    blocks: float = number("-", "blocks in the averaging time")
    oldest: float = number("-", "index of the oldest block")
    filled: float = number("-", "number of complete blocks")
    sum: float = number("signal", "sum over all complete blocks")
    part: float = number("signal", "sum of the present block")
    count: float = number("-", "samples in the present block")
    block: Numbers = series("signal", "sum of a block", "room")


def mean_start(window: float, room: int, before: float | None = None) -> MovingMean:
    """Initial state of a moving mean.

    Args:
      window: [s] averaging time.
      room: size of the ring buffer in blocks.
      before: the signal before the start, if it is known.
    """
    known = {} if before is None else {"known": 1.0, "before": before}
    return MovingMean.of(window=window, room=room, **known)


@kernel
def moving_mean(x: MovingMean, signal: float, dt: float) -> float:
    """One call: the mean of the signal over the window, in the signal's unit (C-60)."""
    if x.per_block < 1.0:
        samples, room = max(whole(x.window / dt + 0.5), 1), whole(x.room)
        x.per_block = float((samples + room - 1) // room)
        x.blocks = float(max(samples // whole(x.per_block), 1))
        if x.known > 0.5:
            x.filled = x.blocks
            for i in range(whole(x.blocks)):
                x.block[i] = x.before * x.per_block
                x.sum += x.block[i]
    per, blocks = whole(x.per_block), whole(x.blocks)
    x.part += signal
    x.count += 1.0
    if whole(x.count) >= per:
        oldest = whole(x.oldest)
        x.sum += x.part - x.block[oldest]
        x.block[oldest] = x.part
        x.part, x.count = 0.0, 0.0
        x.filled = float(min(whole(x.filled) + 1, blocks))
        oldest += 1
        if oldest >= blocks:
            oldest = 0
            x.sum = 0.0
            for i in range(blocks):
                x.sum += x.block[i]
        x.oldest = float(oldest)
    filled = whole(x.filled)
    if filled < blocks:
        return (x.sum + x.part) / (filled * per + whole(x.count))
    return x.sum / (blocks * per)
