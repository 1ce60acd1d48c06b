"""What has gone wrong with the machine, and what grid and operator say: one vector, which events write.

An event puts one number into one place of the vector at one instant; its end puts the old number back. Actuators read
the vector where it concerns them (``control/actuators.py``); what a controller sees passes through :func:`report`.
What is recorded stays the truth.

Reference: docs/guide/events.md.
"""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.control import signals as s
from meltemi.core.kernel import kernel
from meltemi.maths.tables import table

Float = NDArray[float64]

SENSORS = s.Measurements.names[s.TIME + 1 : s.GRID]
"""Measurements that come from a sensor, which may fail."""
SENSOR_UNITS = {field.name: field.unit for field in s.Measurements.rows if field.name in SENSORS}

_SENSOR_FAULTS = (
    ("offset", "", "added to the measurement"),
    ("drift", "/s", "rate at which it goes astray"),
    ("drift_begin", "s", "since when"),
    ("lost", "-", "1: the next value is kept, 2: the kept value is given, 3: zero is given"),
    ("held", "", "value that is kept"),
)

FAULTS = table(
    "faults",
    "",
    """
    grid               | -     | 1 while there is a grid, 0 while there is none and no torque
    voltage            | -     | what a dip leaves of the grid's voltage
    request            | -     | last word of the operator, a number of REQUESTS
    power_limit        | W     | that the operator sets; infinite without one
    generator          | -     | 1 while it follows its demand, 0 without torque
    brake              | -     | 1 while it follows its demand, 0 without torque
    brake_applied      | -     | share of the full brake torque, whatever is demanded
    yaw_drive          | -     | 1 while it follows its demand, 0 when it stands still
    pitch_stuck blades | -     | 1: the blade keeps its angle
    pitch_run blades   | rad/s | rate at which the blade runs away, towards feather when positive; 0: it does not
    flap_stuck flaps   | -     | 1: the flap keeps its deflection
    """
    + "\n".join(
        f"{fault}_{sensor.name} | {unit if unit in ('s', '-') else sensor.unit + unit} | {doc}"
        for fault, unit, doc in _SENSOR_FAULTS
        for sensor in s.Measurements.rows
        if sensor.name in SENSORS
    ),
)
"""Numbers that events change."""

GRID, VOLTAGE, REQUEST, POWER_LIMIT, GENERATOR, BRAKE, BRAKE_APPLIED, YAW_DRIVE = FAULTS.slots(
    "grid voltage request power_limit generator brake brake_applied yaw_drive"
)
PITCH_STUCK, PITCH_RUN, FLAP_STUCK = FAULTS.slots("pitch_stuck pitch_run flap_stuck")
OFFSET, DRIFT, DRIFT_BEGIN, LOST, HELD = (FAULTS.index(f"{fault}_{SENSORS[0]}") for fault, _, _ in _SENSOR_FAULTS)
FIRST, N_SENSORS = s.TIME + 1, len(SENSORS)
KEEP_NEXT, KEPT, ZERO = 1.0, 2.0, 3.0
"""Values of ``lost``."""


def healthy() -> Float:
    """A machine in order, on a grid, without a word of the operator."""
    faults = FAULTS.zeros()
    faults[[GRID, VOLTAGE, GENERATOR, BRAKE, YAW_DRIVE]] = 1.0
    faults[POWER_LIMIT] = float("inf")
    return faults


@kernel
def happen(step: int, following: int, events: Float, faults: Float) -> int:
    """Let the events happen that are due.

    Args:
      step: number of the instant.
      following: the first event that has not happened.
      events: (n, 3) step, place in ``faults``, value; by time.

    Returns:
      The first event that has still not happened.
    """
    while following < events.shape[0] and events[following, 0] <= step:
        faults[int(events[following, 1])] = events[following, 2]
        following += 1
    return following


@kernel
def report(t: float, faults: Float, measured: Float) -> None:
    """What the sensors report in place of the true ``measured``, and what grid and operator say."""
    measured[s.GRID] = faults[GRID]
    measured[s.REQUEST] = faults[REQUEST]
    measured[s.POWER_LIMIT] = faults[POWER_LIMIT]
    for i in range(N_SENSORS):
        lost = faults[LOST + i]
        if lost == ZERO:
            measured[FIRST + i] = 0.0
        elif lost == KEPT:
            measured[FIRST + i] = faults[HELD + i]
        else:
            measured[FIRST + i] += faults[OFFSET + i] + faults[DRIFT + i] * (t - faults[DRIFT_BEGIN + i])
            if lost == KEEP_NEXT:
                faults[HELD + i] = measured[FIRST + i]
                faults[LOST + i] = KEPT
