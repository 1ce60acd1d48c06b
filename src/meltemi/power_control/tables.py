"""State machine of the power control: states, conditions, transitions.

The four schemes share the table: A0 and A1 do not hold the pitch, A2 and A3 do.

Reference: docs/theory/control.md (C-83); Palanimuthu et al. (2022), Figs 17 to 19.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meltemi.control_laws.machine import cells, machine, transitions


@dataclass(frozen=True)
class PowerControlMode:
    """State of the power control.

    Attributes:
      pitch: ``fine``; ``held``; ``upper`` or ``recovery``: holds that speed.
    """

    name: str
    pitch: str
    doc: str


_STATES = """
maximum_power  | fine     | fine pitch, maximum power, below the speed at which the reference is met
power_tracking | fine     | fine pitch, power at its set-point, the rotor stores the rest as speed
speed_limit    | upper    | the pitch holds the upper speed
hold           | held     | the pitch is held, the rotor stores the rest as speed
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


STATES = tuple(PowerControlMode(*row) for row in cells(_STATES))
CONDITIONS = tuple(name for name, _ in cells(_CONDITIONS))
WORDS = dict(cells(_CONDITIONS))
TRANSITIONS = transitions(_TRANSITIONS)
PITCHES = ("fine", "held", "upper", "recovery")

NUMBER = {state.name: i + 1 for i, state in enumerate(STATES)}
MACHINE = machine([state.name for state in STATES], CONDITIONS, TRANSITIONS)
MODES = np.array([PITCHES.index(state.pitch) for state in STATES], dtype=np.int64)
"""Action of the pitch by state."""
