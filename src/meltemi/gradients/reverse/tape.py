"""The tape: code that appends values to it in the forward pass, and that goes back on it."""

from __future__ import annotations

from meltemi.gradients.reverse.code import size_of

HEAD = 128
"""[bytes] begin of the memory: the end of the tape, and a place that masked entries may use."""
SHADOW = (1 << 26) + 64 * 33
"""[bytes] distance of the adjoint of a number from it."""
VECTOR, NUMBER = 64, 8
"""[bytes] units of the records of functions with vectors in most blocks, and of others, whose end is padded."""


def padded() -> list[str]:
    """Code that continues the tape at a multiple of ``VECTOR``, with its former end before that."""
    return [
        "  %pad.end = load ptr, ptr %tape",
        "  %pad.at = ptrtoint ptr %pad.end to i64",
        f"  %pad.more = add i64 %pad.at, {VECTOR - 1 + NUMBER}",
        f"  %pad.whole = and i64 %pad.more, -{VECTOR}",
        "  %pad.new = inttoptr i64 %pad.whole to ptr",
        f"  %pad.word = getelementptr i8, ptr %pad.new, i64 -{NUMBER}",
        "  store ptr %pad.end, ptr %pad.word, align 8",
        "  store ptr %pad.new, ptr %tape",
    ]


def unpadded() -> list[str]:
    """Code that goes back to that end."""
    return [
        f"  %pad.word = getelementptr i8, ptr %tape.0, i64 -{NUMBER}",
        "  %pad.end = load ptr, ptr %pad.word, align 8",
        "  store ptr %pad.end, ptr %tape",
    ]


def pushed(n: str, entries: list[tuple[str, str, int]], size: int, unit: int) -> list[str]:
    """Code that appends values to the tape: type, name and place of each in a record of a size."""
    if not entries:
        return []
    lines = [f"  %tape.at{n} = load ptr, ptr %tape"]
    for i, (kind, name, at) in enumerate(entries):
        align = min(size_of(kind)[1], unit)
        lines.append(f"  %tape.{n}.{i} = getelementptr i8, ptr %tape.at{n}, i64 {at}")
        lines.append(f"  store {kind} {name}, ptr %tape.{n}.{i}, align {align}")
    lines.append(f"  %tape.next{n} = getelementptr i8, ptr %tape.at{n}, i64 {size}")
    lines.append(f"  store ptr %tape.next{n}, ptr %tape")
    return lines


def popped(label: str, size: int) -> list[str]:
    """Code that goes back on the tape by a record."""
    return [
        f"  %tape.of.{label} = load ptr, ptr %tape",
        f"  %tape.{label} = getelementptr i8, ptr %tape.of.{label}, i64 -{size}",
        f"  store ptr %tape.{label}, ptr %tape",
    ]
