"""Preview of the rotor-averaged wind: the collective pitch moves before the wind arrives.

    theta_p = theta_ss(V_f(t + lead)),   the integral of the collective law moves with the change of theta_p

with theta_ss the pitch of steady operation and V_f the low-passed wind averaged over the rotor. What is previewed needs
no speed error any more; the collective law takes what is left. The lead makes up for the low-pass and the actuator. The
wind is given as a series that is known beforehand: no lidar is modelled, so this is the most that preview can do.

Settings, state, series and table lie in a vector from the place ``at`` on, one behind the other: ``PREVIEW``, the
series of wind speeds, the table of pitch.

Reference: docs/theory/control.md (C-39, C-40); Schlipf, Schlipf and Kühn (2013), Wind Energy 16, 1107-1129.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.control.filters import low_pass
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole
from meltemi.maths.tables import Table, View, number

Float = NDArray[float64]


class PreviewState(Table, title="preview"):
    """Settings and state of a preview."""

    samples: float = number("-", "of the series of wind speeds")
    time_step: float = number("s", "between them")
    lead: float = number("s", "by which the series is read ahead")
    frequency: float = number("rad/s", "corner of the low-pass")
    entries: float = number("-", "of the table of pitch")
    first_speed: float = number("m/s", "of the table")
    spacing: float = number("m/s", "of the table")
    speed: float = number("m/s", "state of the low-pass")
    pitch: float = number("rad", "state: steady pitch of the last call")


SAMPLES, TIME_STEP, LEAD, CORNER, ENTRIES, FIRST, SPACING, SPEED, PITCH = PreviewState.slots(
    "samples time_step lead frequency entries first_speed spacing speed pitch"
)
SERIES = len(PreviewState)


@kernel
def between(x: Float, at: int, n: int, place: float) -> float:
    """Linear between ``n`` values from ``at`` on, at a place counted in values; held before and after."""
    place = min(max(place, 0.0), n - 1.0)
    i = min(whole(place), n - 2)
    return x[at + i] + (place - i) * (x[at + i + 1] - x[at + i])


@kernel
def preview_change(x: Float, at: int, time: float, dt: float) -> float:
    """Change of the steady pitch [rad] that the coming wind asks for, since the last call (C-39)."""
    samples, entries = whole(x[at + SAMPLES]), whole(x[at + ENTRIES])
    coming = between(x, at + SERIES, samples, (time + x[at + LEAD]) / x[at + TIME_STEP])
    speed = low_pass(x, at + SPEED, coming, x[at + CORNER], dt)
    pitch = between(x, at + SERIES + samples, entries, (speed - x[at + FIRST]) / x[at + SPACING])
    change = pitch - x[at + PITCH]
    x[at + PITCH] = pitch
    return change


def preview_settings(
    wind: Sequence[float] | Float,
    time_step: float,
    *,
    lead: float,
    frequency: float,
    first_speed: float,
    spacing: float,
    pitch: Sequence[float] | Float,
) -> Float:
    """Checked settings, series and table, for a slice of a controller's state vector.

    Args:
      wind: (T,) [m/s] averaged over the rotor, from time zero on.
      time_step: [s] between its values.
      lead: [s] by which it is read ahead.
      frequency: [rad/s] corner of the low-pass.
      first_speed: [m/s] of the table.
      spacing: [m/s] of the table.
      pitch: (n,) [rad] of steady operation at these speeds.

    Raises:
      InputError: a number that cannot be, or fewer than two values.
    """
    series, steady = np.asarray(wind, dtype=float), np.asarray(pitch, dtype=float)
    for name, values in (("wind", series), ("pitch", steady)):
        if values.ndim != 1 or len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(f"preview: {name} must be a row of at least two finite numbers")
    for name, value in (("time_step", time_step), ("frequency", frequency), ("spacing", spacing)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"preview: {name} must be a positive number, found {value!r}")
    if not (np.isfinite(lead) and lead >= 0.0):
        raise InputError(f"preview: lead must be zero or a positive time [s], found {lead!r}")
    x = PreviewState.zeros()
    view = View(PreviewState, x)
    view["samples"], view["time_step"], view["lead"], view["frequency"] = len(series), time_step, lead, frequency
    view["entries"], view["first_speed"], view["spacing"] = len(steady), first_speed, spacing
    start = float(np.interp(lead, time_step * np.arange(len(series)), series))
    view["speed"] = start
    view["pitch"] = np.interp(start, first_speed + spacing * np.arange(len(steady)), steady)
    return np.concatenate([x, series, steady])
