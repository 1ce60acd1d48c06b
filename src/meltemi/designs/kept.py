"""Values that are remembered, up to a number of them."""

from __future__ import annotations

from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V")


def keep(known: dict[K, V], key: K, value: V, most: int) -> V:
    """Remember a value, and forget the oldest beyond a number of them."""
    known[key] = value
    while len(known) > most:
        known.pop(next(iter(known)))
    return value
