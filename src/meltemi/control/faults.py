"""Faults of the turbine, and requests of grid and operator, as one vector that events change.

An event sets one entry of the vector at one instant; its end restores the old value. Actuators read the entries that
concern them (``control/actuators.py``); measurements of a controller pass through :func:`report`. Recorded channels
are the true values.

Reference: docs/guide/events.md.
"""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import MAX_LINES, Numbers, Table, blades, flaps, kernel, number, numbers
from meltemi.control.signals import Measurements

Float = NDArray[float64]

SENSORS = Measurements.names[Measurements.index("time") + 1 : Measurements.index("grid")]
"""Measurements that come from a sensor, which may fail."""
SENSOR_UNITS = {row.name: row.unit for row in Measurements.rows if row.name in SENSORS}


class Faults(Table):
    """Numbers that events change."""

    grid: float = number("-", "1 while there is a grid, 0 while there is none and no torque")
    voltage: float = number("-", "share of the grid's voltage that a dip leaves")
    request: float = number("-", "last operator request, a number of REQUESTS")
    power_limit: float = number("W", "operator's power limit; infinite without one")
    generator: float = number("-", "torque over its demand, 1 without a fault")
    brake: float = number("-", "1 while it follows its demand, 0 without torque")
    brake_applied: float = number("-", "share of the full brake torque, regardless of the demand")
    yaw_drive: float = number("-", "1 while it follows its demand, 0 when it stands still")
    yaw_run: float = number("rad/s", "rate of a yaw runaway; 0: none")
    pitch_stuck: Numbers = blades("-", "1: the blade keeps its angle")
    pitch_run: Numbers = blades("rad/s", "rate of a pitch runaway, towards feather when positive; 0: none")
    flap_stuck: Numbers = flaps("-", "1: the flap keeps its deflection")
    line_lost: Numbers = numbers("-", "1: the mooring line has parted", [str(i + 1) for i in range(MAX_LINES)])
    offset: Numbers = numbers("unit of the sensor", "added to the measurement", SENSORS)
    drift: Numbers = numbers("unit of the sensor/s", "rate of the sensor's drift", SENSORS)
    drift_begin: Numbers = numbers("s", "begin of the drift", SENSORS)
    lost: Numbers = numbers("-", "1: the next value is kept, 2: the kept value is given, 3: zero is given", SENSORS)
    held: Numbers = numbers("unit of the sensor", "value that is kept", SENSORS)


FIRST, N_SENSORS = Measurements.index(SENSORS[0]), len(SENSORS)
KEEP_NEXT, KEPT, ZERO = 1.0, 2.0, 3.0
"""Values of ``lost``."""


def healthy() -> Float:
    """A turbine without faults, on a grid, without an operator request."""
    f = Faults(Faults.zeros())
    f.grid = f.voltage = f.generator = f.brake = f.yaw_drive = 1.0
    f.power_limit = float("inf")
    return f.array


@kernel
def apply_events(step: int, following: int, events: Float, faults: Faults) -> int:
    """Apply the events that are due.

    Args:
      step: number of the instant.
      following: index of the first pending event.
      events: (n, 3) step, row of ``Faults``, value; by time.

    Returns:
      The index of the first pending event.
    """
    while following < events.shape[0] and events[following, 0] <= step:
        faults.array[int(events[following, 1])] = events[following, 2]
        following += 1
    return following


@kernel
def report(t: float, f: Faults, measured: Measurements) -> None:
    """Replace the true ``measured`` values by those of faulty sensors; add the requests of grid and operator."""
    measured.grid = f.grid
    measured.request = f.request
    measured.power_limit = f.power_limit
    x = measured.array
    for i in range(N_SENSORS):
        lost = f.lost[i]
        if lost == ZERO:
            x[FIRST + i] = 0.0
        elif lost == KEPT:
            x[FIRST + i] = f.held[i]
        else:
            x[FIRST + i] += f.offset[i] + f.drift[i] * (t - f.drift_begin[i])
            if lost == KEEP_NEXT:
                f.held[i] = x[FIRST + i]
                f.lost[i] = KEPT
