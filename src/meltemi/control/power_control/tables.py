"""The machine of the power control as tables that a person reads: states, conditions, transitions.

At every call the first line applies whose state is the present one and whose conditions all hold. The four schemes
share the table: A0 and A1 do not hold the pitch, A2 and A3 do.

Reference: docs/theory/control.md (C-83); Palanimuthu et al. (2022), Figs 17 to 19.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Int = NDArray[np.int64]


@dataclass(frozen=True)
class State:
    """What pitch and torque do; numbers of the states begin with 1.

    Attributes:
      pitch: ``fine``; ``held``; ``upper`` or ``recovery``: holds that speed.
    """

    name: str
    pitch: str
    doc: str


@dataclass(frozen=True)
class Transition:
    """From states, to a state, when all conditions hold (``not`` before one: when it does not)."""

    sources: tuple[str, ...]
    target: str
    conditions: tuple[str, ...]


_STATES = """
maximum_power  | fine     | fine pitch, below the speed at which the reference is met: all that the wind gives
power_tracking | fine     | fine pitch, power as asked for, the speed takes up what is left
speed_limit    | upper    | the pitch holds the upper speed
hold           | held     | the pitch is held, the speed takes up what is left
recovery       | recovery | the pitch falls, to hold the lower speed
"""

_CONDITIONS = """
above_lower    | the speed is above that at which the reference is met
above_upper    | the speed is at or above the upper one
below_recovery | the speed is at or below that of recovery
fine           | the pitch is at its smallest
holds          | the scheme holds the pitch (A2, A3), and there is a range of speed for it
"""

_TRANSITIONS = """
maximum_power power_tracking hold recovery | speed_limit | above_upper
speed_limit    | power_tracking | fine, not above_upper
speed_limit    | hold           | holds, not above_upper
recovery       | power_tracking | fine
hold           | recovery       | below_recovery
recovery       | hold           | not below_recovery
maximum_power  | power_tracking | above_lower
power_tracking | maximum_power  | not above_lower
"""


def _rows(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.split("|")] for line in text.strip().splitlines()]


STATES = tuple(State(*row) for row in _rows(_STATES))
CONDITIONS = tuple(name for name, _ in _rows(_CONDITIONS))
WORDS = dict(_rows(_CONDITIONS))
TRANSITIONS = tuple(
    Transition(tuple(sources.split()), target, tuple(name.strip() for name in conditions.split(",")))
    for sources, target, conditions in _rows(_TRANSITIONS)
)
PITCHES = ("fine", "held", "upper", "recovery")

NUMBER = {state.name: i + 1 for i, state in enumerate(STATES)}
MOST = max(len(t.conditions) for t in TRANSITIONS)
FROM, TO, FIRST = 0, 1, 2


def _compiled() -> Int:
    """Rows for the kernel: from, to, conditions from 1 on (negative: not), by order of priority."""
    rows = []
    for t in TRANSITIONS:
        signed = [
            -CONDITIONS.index(c[4:]) - 1 if c.startswith("not ") else CONDITIONS.index(c) + 1 for c in t.conditions
        ]
        signed += [0] * (MOST - len(signed))
        rows += [[NUMBER[source], NUMBER[t.target], *signed] for source in t.sources]
    return np.array(rows, dtype=np.int64)


MACHINE = _compiled()
MODES = np.array([PITCHES.index(state.pitch) for state in STATES], dtype=np.int64)
"""What the pitch does, by state."""
