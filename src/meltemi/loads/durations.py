"""Time and revolutions at load levels, and the duty of actuators.

Equations L-30 to L-33 of ``docs/theory/design-loads.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.postprocess.inputs import floats, number, one_row, positive

Float = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class LoadDuration(Brief):
    """Load-duration distribution (LDD): time and revolutions at levels of a load and of the rotor speed.

    Attributes:
      load_edges: (L + 1,) edges of the levels, in the unit of the load.
      speed_edges: (S + 1,) [rad/s] edges of the levels of the shaft speed.
      time: (L, S) [s] time at each level.
      revolutions: (L, S) revolutions of the shaft at each level.
    """

    load_edges: Float
    speed_edges: Float
    time: Float
    revolutions: Float


@dataclass(frozen=True)
class ActuatorDuty:
    """Duty of an actuator.

    Attributes:
      travel: sum of the absolute changes, in the unit of the position.
      time: [s] duration of the series.
      moving: [s] time in which it moves.
      starts: number of movements.
      reversals: number of changes of direction, with or without a pause.
      rms_rate, largest_rate: root mean square and largest rate, in the unit of the position per second.
    """

    travel: float
    time: float
    moving: float
    starts: int
    reversals: int
    rms_rate: float
    largest_rate: float


def load_duration(
    load: ArrayLike, shaft_speed: ArrayLike, *, dt: float, load_edges: ArrayLike, speed_edges: ArrayLike = (-inf, inf)
) -> LoadDuration:
    """Time and revolutions at levels of a load, for bearings and gears.

    Args:
      load: (T,) series of a load, such as the torque.
      shaft_speed: (T,) [rad/s] speed of the shaft that carries the load; revolutions of either sense count.
      dt: [s] interval between the values; each stands for this time.
      load_edges: (L + 1,) ascending edges; a bin contains its lower edge, the last one both.
      speed_edges: (S + 1,) [rad/s] ascending edges in the same sense; a single bin by default.

    Raises:
      InputError: shapes differ, edges do not ascend, ``dt`` is not positive, or values lie outside the edges.
    """
    x, w = floats(load, "load_duration: load"), floats(shaft_speed, "load_duration: shaft_speed")
    edges = floats(load_edges, "load_duration"), floats(speed_edges, "load_duration")
    positive(dt, "load_duration: dt")
    if x.ndim != 1 or w.shape != x.shape:
        raise InputError(f"load_duration: load and speed must be (T,); found {x.shape} and {w.shape}")
    for name, values, e in (("load", x, edges[0]), ("shaft_speed", w, edges[1])):
        if e.ndim != 1 or len(e) < 2 or not np.all(np.diff(e) > 0.0):
            raise InputError(f"load_duration: edges of {name} must be at least two ascending numbers")
        if not np.all((values >= e[0]) & (values <= e[-1])):
            raise InputError(
                f"load_duration: {name} lies between {values.min():g} and {values.max():g}, "
                f"edges between {e[0]:g} and {e[-1]:g}"
            )
    samples, angle = np.histogram2d(x, w, edges)[0], np.histogram2d(x, w, edges, weights=np.abs(w))[0]
    return LoadDuration(*edges, dt * samples, dt / (2.0 * pi) * angle)


def duration_load(duration: LoadDuration, *, exponent: float = 10.0 / 3.0) -> float:
    """Equivalent load of a bearing or gear: (sum u |L|^p / sum u)^(1/p) over revolutions u (L-31).

    Args:
      duration: distribution whose loads are taken at the middles of the bins, which must be finite.
      exponent: exponent p of the life: 3 for ball bearings, 10/3 for roller bearings.

    Raises:
      InputError: the outer bins are open, nothing turns, or ``exponent`` is not positive.
    """
    positive(exponent, "duration_load: exponent")
    if not np.all(np.isfinite(duration.load_edges)):
        raise InputError("duration_load: the edges of the load must be finite")
    turns = duration.revolutions.sum(axis=1)
    if not turns.sum() > 0.0:
        raise InputError("duration_load: the shaft does not turn")
    levels = np.abs(0.5 * (duration.load_edges[1:] + duration.load_edges[:-1]))
    top = float(levels[turns > 0.0].max())
    if top == 0.0:
        return 0.0
    return float(top * (np.sum(turns * (levels / top) ** exponent) / turns.sum()) ** (1.0 / exponent))


def actuator_duty(position: ArrayLike, *, dt: float, threshold: float = 0.0) -> ActuatorDuty:
    """Travel, moving time, starts and reversals of a pitch or yaw drive (L-32, L-33).

    Args:
      position: (T,) series of the position, such as a pitch angle.
      dt: [s] interval between the values.
      threshold: rate in the unit of the position per second above which the actuator moves. Travel counts all changes.

    Raises:
      InputError: there are fewer than two values, or ``dt`` is not positive or ``threshold`` negative.
    """
    x = floats(position, "actuator_duty: position")
    positive(dt, "actuator_duty: dt")
    wrong = x.ndim != 1 or len(x) < 2 or not np.all(np.isfinite(x))
    if wrong or not number(threshold, "actuator_duty: threshold") >= 0.0:
        raise InputError("actuator_duty: at least two finite values are required, dt positive, threshold not negative")
    rate = np.diff(x) / dt
    sense = np.where(np.abs(rate) > threshold, np.sign(rate), 0.0)
    moves = sense != 0.0
    directions = sense[moves]
    return ActuatorDuty(
        travel=float(np.abs(np.diff(x)).sum()),
        time=dt * len(rate),
        moving=dt * int(moves.sum()),
        starts=int(moves[0]) + int(np.sum(moves[1:] & ~moves[:-1])),
        reversals=int(np.sum(directions[1:] != directions[:-1])),
        rms_rate=float(np.sqrt(np.mean(rate**2))),
        largest_rate=float(np.abs(rate).max()),
    )


def count_stops(speed: ArrayLike, *, on: float, off: float) -> int:
    """Number of stops: how often the rotor speed falls to ``off`` after it had reached ``on``.

    Args:
      speed: (T,) rotor speed; the power, which is zero in every lull near cut-in, is no sign of a stop.
      on: lowest speed of operation.
      off: highest speed of standstill, below ``on``, so that ripple about a single level does not count.

    Raises:
      InputError: ``off`` does not lie below ``on``.
    """
    if not number(off, "count_stops: off") < number(on, "count_stops: on"):
        raise InputError(f"count_stops: off must lie below on, found {off!r} and {on!r}")
    x = one_row(speed, "count_stops: speed", least=0)
    state = np.where(x >= on, 1, np.where(x <= off, -1, 0))
    known = state[state != 0]
    return int(np.sum((known[1:] < 0) & (known[:-1] > 0)))
