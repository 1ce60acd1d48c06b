"""Preview settings from a wind and a turbine: rotor-averaged wind speed, and pitch of steady operation.

The lead time compensates the delays of the low-pass filter and of the pitch actuator.

Reference: docs/theory/control.md (C-39, C-41).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.control.load_control import Preview
from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.trim import operating_point
from meltemi.wind.fields import Wind, WindBox

Float = NDArray[np.float64]

FREQUENCY = 1.0
"""[rad/s] corner of the low-pass filter: eddies of higher frequencies are smaller than the rotor."""
SPACING = 1.0
"""[m/s] wind speed step of the pitch table."""


def rotor_average(box: WindBox, hub_height: float, radius: float) -> Float:
    """(T,) [m/s] longitudinal wind speed of each plane, averaged over the grid points inside the rotor disk.

    Raises:
      InputError: no point of the grid lies inside.
    """
    rows, columns = box.velocity.shape[1:3]
    z = box.bottom + box.dz * np.arange(rows) - hub_height
    y = box.dy * (np.arange(columns) - 0.5 * (columns - 1))
    inside = z[:, None] ** 2 + y[None, :] ** 2 <= radius**2
    if not inside.any():
        raise InputError("preview: no point of the wind's grid lies inside the rotor")
    average: Float = box.velocity[:, inside, 0].mean(axis=1, dtype=np.float64)
    return average


def steady_pitch(model: BladedModel) -> tuple[float, Float]:
    """First wind speed [m/s], and pitch [rad] of steady operation from there to beyond cut-out, in steps of 1 m/s."""
    turbine = model.turbine
    speeds = np.arange(turbine.cut_in, turbine.cut_out + 10.0 + 1e-9, SPACING)
    return float(speeds[0]), np.array([operating_point(model, float(u)).pitch for u in speeds])


def pitch_lead(model: BladedModel, frequency: float) -> float:
    """[s] delay of a low-pass of the given corner [rad/s] and of the pitch actuator (C-41)."""
    actuator = model.turbine.pitch_actuator
    if actuator.kind == "ideal":
        return 1.0 / frequency
    return 1.0 / frequency + 2.0 * actuator.damping_ratio / actuator.natural_frequency


def preview_of(
    model: BladedModel, wind: Wind, table: tuple[float, Float] | None = None, *, frequency: float = FREQUENCY
) -> Preview:
    """Preview of a wind box, with a lead time equal to the delays of low-pass filter and pitch actuator.

    Args:
      model: of the turbine.
      wind: a box; other winds have no average over the rotor.
      table: from :func:`steady_pitch`, for several winds of one model.
      frequency: [rad/s] corner of the low-pass filter.

    Raises:
      InputError: the wind is not a box.
    """
    if not isinstance(wind, WindBox):
        raise InputError(f"preview: expected a wind box, found {type(wind).__name__}")
    turbine = model.turbine
    first, pitch = table or steady_pitch(model)
    average = rotor_average(wind, turbine.hub_height, turbine.rotor_radius)
    # plane k passes the tower at box.passing[k]; the rotor stands an overhang upwind of it
    passing = wind.passing - turbine.nacelle.overhang / wind.speed
    even = np.interp(wind.dt * np.arange(len(average)), passing, average)
    return Preview(
        wind=even,
        time_step=wind.dt,
        lead=pitch_lead(model, frequency),
        frequency=frequency,
        first_speed=first,
        spacing=SPACING,
        pitch=pitch,
    )
