"""Feed-forward of the collective pitch from a preview of the rotor-averaged wind.

    theta_p = theta_ss(V_f(t + lead)),   the integral of the collective law moves with the change of theta_p

with theta_ss the pitch of steady operation and V_f the low-passed wind averaged over the rotor. Previewed
changes need no speed error; the collective law controls the rest. The lead compensates the low-pass filter and the
actuator. The wind is a series: the wind itself, for the best possible preview, or lidar measurements of it
(``meltemi.analysis.lidar_preview``).

Reference: docs/theory/control.md (C-39, C-40); Schlipf, Schlipf and Kühn (2013), Wind Energy 16, 1107-1129.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Numbers, Table, kernel, number, part, series, whole
from meltemi.control_laws.filters import LowPass, low_pass
from meltemi.control_laws.lookup import linear
from meltemi.core.errors import InputError

Float = NDArray[float64]


class PreviewState(Table, title="preview"):
    """Settings and state of a preview."""

    samples: float = number("-", "number of wind speeds in the series")
    time_step: float = number("s", "interval of the series")
    lead: float = number("s", "lead time")
    frequency: float = number("rad/s", "corner frequency of the low-pass filter")
    entries: float = number("-", "number of entries of the pitch table")
    first_speed: float = number("m/s", "first wind speed of the pitch table")
    spacing: float = number("m/s", "wind speed interval of the pitch table")
    speed: LowPass = part(LowPass, "of the wind ahead")
    pitch: float = number("rad", "state: steady pitch of the last call")
    wind: Numbers = series("m/s", "averaged over the rotor, from time zero on", "samples")
    steady_pitch: Numbers = series("rad", "pitch of steady operation", "entries")


@kernel
def preview_change(x: PreviewState, time: float, dt: float) -> float:
    """Change of the steady pitch [rad] for the previewed wind since the last call (C-39)."""
    coming = linear(x.wind, whole(x.samples), (time + x.lead) / x.time_step)
    speed = low_pass(x.speed, coming, x.frequency, dt)
    pitch = linear(x.steady_pitch, whole(x.entries), (speed - x.first_speed) / x.spacing)
    change = pitch - x.pitch
    x.pitch = pitch
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
) -> PreviewState:
    """Validated settings, series and table.

    Args:
      wind: (T,) [m/s] averaged over the rotor, from time zero on.
      time_step: [s] time between its values.
      lead: [s] lead time.
      frequency: [rad/s] corner of the low-pass.
      first_speed: [m/s] first wind speed of the table.
      spacing: [m/s] spacing of the table.
      pitch: (n,) [rad] pitch of steady operation at these speeds.

    Raises:
      InputError: a number is out of range, or there are fewer than two values.
    """
    known, steady = np.asarray(wind, dtype=float), np.asarray(pitch, dtype=float)
    for name, values in (("wind", known), ("pitch", steady)):
        if values.ndim != 1 or len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(f"preview: {name} must be a row of at least two finite numbers")
    for name, value in (("time_step", time_step), ("frequency", frequency), ("spacing", spacing)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"preview: {name} must be a positive number, found {value!r}")
    if not (np.isfinite(lead) and lead >= 0.0):
        raise InputError(f"preview: lead must be zero or a positive time [s], found {lead!r}")
    start = float(np.interp(lead, time_step * np.arange(len(known)), known))
    return PreviewState.of(
        time_step=time_step,
        lead=lead,
        frequency=frequency,
        first_speed=first_speed,
        spacing=spacing,
        speed=LowPass.of(integrator=start),
        pitch=np.interp(start, first_speed + spacing * np.arange(len(steady)), steady),
        wind=known,
        steady_pitch=steady,
    )
