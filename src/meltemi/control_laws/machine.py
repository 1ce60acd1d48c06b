"""State machines as readable tables, and the kernel that steps them.

A machine has states, conditions and transitions. Every call makes at most one transition: the first line of its
table with the present state and with all conditions true. The numbers of states begin with 1.

Reference: docs/theory/control.md (C-63).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Numbers, kernel

Int = NDArray[np.int64]
FROM, TO, LINE, FIRST = range(4)
"""Columns of a machine: states by number, line of the table, then conditions from 1 on (negative: not); 0: none."""


@dataclass(frozen=True)
class Transition:
    """A line of a machine: from states, to a state, when all conditions hold (``not`` before one: when it does not)."""

    sources: tuple[str, ...]
    target: str
    conditions: tuple[str, ...]


def cells(text: str) -> list[list[str]]:
    """Cells of a table whose lines stand below each other, with bars between columns."""
    return [[cell.strip() for cell in line.split("|")] for line in text.strip().splitlines()]


def transitions(text: str, groups: Mapping[str, Sequence[str]] | None = None) -> tuple[Transition, ...]:
    """Transitions of a table ``states | target | conditions``; ``groups`` are names for several states."""
    groups_by_state = groups or {}
    return tuple(
        Transition(
            tuple(state for name in sources.split() for state in groups_by_state.get(name, (name,))),
            target,
            tuple(name.strip() for name in conditions.split(",")),
        )
        for sources, target, conditions in cells(text)
    )


def machine(states: Sequence[str], conditions: Sequence[str], lines: Sequence[Transition]) -> Int:
    """A machine for kernels, by order of priority: (rows, columns), see ``FROM``."""
    number = {state: i + 1 for i, state in enumerate(states)}
    place = {condition: i + 1 for i, condition in enumerate(conditions)}
    most = max(len(t.conditions) for t in lines)
    rows = []
    for line, t in enumerate(lines):
        signed = [-place[c[4:]] if c.startswith("not ") else place[c] for c in t.conditions]
        signed += [0] * (most - len(signed))
        rows += [[number[source], number[t.target], line, *signed] for source in t.sources]
    return np.array(rows, dtype=np.int64)


@kernel
def transition(machine: Int, state: int, holds: Numbers) -> int:
    """Row of the transition from a state, -1 for none.

    Args:
      state: number of the present state.
      holds: values of the conditions, 1 for true and 0 for false.
    """
    for row in range(machine.shape[0]):
        if machine[row, FROM] != state:
            continue
        changed = True
        for k in range(FIRST, machine.shape[1]):
            c = machine[row, k]
            if (c > 0 and holds[c - 1] < 0.5) or (c < 0 and holds[-c - 1] > 0.5):
                changed = False
        if changed:
            return row
    return -1
