"""Preview settings from a wind and a turbine: rotor-averaged wind speed, errors of a lidar, pitch of steady operation.

The lead time compensates the delays of the low-pass filter and of the pitch actuator.

Reference: docs/theory/control.md (C-39, C-41).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from meltemi.control_laws.load_control import Preview
from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.trim import operating_point
from meltemi.wind.fields import Wind, WindBox

Float = NDArray[np.float64]

FREQUENCY = 1.0
"""[rad/s] corner of the low-pass filter: eddies of higher frequencies are smaller than the rotor."""
BEAM_RADIUS = 0.7
"""Radius of the beams of a lidar over the rotor radius."""
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
    """First wind speed [m/s], and pitch [rad] of steady operation from it to beyond cut-out in steps of 1 m/s."""
    turbine = model.turbine
    speeds = np.arange(turbine.cut_in, turbine.cut_out + 10.0 + 1e-9, SPACING)
    return float(speeds[0]), np.array([operating_point(model, float(u)).pitch for u in speeds])


def pitch_lead(model: BladedModel, frequency: float) -> float:
    """Delay [s] of a low-pass filter with a corner frequency [rad/s] and of the pitch actuator (C-41)."""
    actuator = model.turbine.pitch_actuator
    if actuator.kind == "ideal":
        return 1.0 / frequency
    return 1.0 / frequency + 2.0 * actuator.damping_ratio / actuator.natural_frequency


def preview_of(
    model: BladedModel, wind: Wind, table: tuple[float, Float] | None = None, *, frequency: float = FREQUENCY
) -> Preview:
    """Preview of a wind box, with a lead time equal to the delays of low-pass filter and pitch actuator.

    Args:
      model: turbine model.
      wind: wind box; other winds have no average over the rotor.
      table: pitch table from :func:`steady_pitch`, for several winds of one model.
      frequency: [rad/s] corner frequency of the low-pass filter.

    Raises:
      InputError: the wind is not a box.
    """
    if not isinstance(wind, WindBox):
        raise InputError(f"preview: expected a wind box, found {type(wind).__name__}")
    turbine = model.turbine
    first, pitch = table or steady_pitch(model)
    average = rotor_average(wind, turbine.hub_height, turbine.rotor_radius)
    # plane k passes the tower at box.passing[k]; the rotor is an overhang upwind of it
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


@dataclass(frozen=True)
class LidarErrors:
    """Errors of wind measurements upwind of the rotor; none by default.

    Attributes:
      frequency: [rad/s] corner frequency of the low-pass filter of the preview.
      beams: number of beams at 0.7 of the radius that are averaged; 0: the mean over the rotor.
      decay: [s] decay of the coherence exp(-decay f) between the measured wind and that at the rotor.
      lost: fraction of seconds without measurement, in which the last value is held.
    """

    frequency: float = FREQUENCY
    beams: int = 0
    decay: float = 0.0
    lost: float = 0.0


def measured(box: WindBox, model: BladedModel, lidar: LidarErrors) -> Float:
    """(T,) [m/s] wind speed at the rotor as measured by a lidar, at the times of a wind box from zero on."""
    turbine, rng = model.turbine, np.random.default_rng(1)
    u = rotor_average(box, turbine.hub_height, turbine.rotor_radius)
    if lidar.beams:
        rows, columns = box.velocity.shape[1:3]
        z = box.bottom + box.dz * np.arange(rows) - turbine.hub_height
        y = box.dy * (np.arange(columns) - 0.5 * (columns - 1))
        at = BEAM_RADIUS * turbine.rotor_radius * np.exp(2j * pi * (np.arange(lidar.beams) + 0.5) / lidar.beams)
        points = [(int(np.abs(z - p.real).argmin()), int(np.abs(y - p.imag).argmin())) for p in at]
        u = np.mean([box.velocity[:, row, column, 0] for row, column in points], axis=0, dtype=np.float64)
    if lidar.decay:
        tones = np.fft.rfft(u - u.mean())
        kept = np.exp(-0.5 * lidar.decay * np.fft.rfftfreq(len(u), box.dt))
        other = np.abs(tones) * np.exp(2j * pi * rng.random(len(tones)))
        u = u.mean() + np.fft.irfft(kept * tones + np.sqrt(1.0 - kept**2) * other, len(u))
    if lidar.lost:
        second = np.arange(len(u)) * box.dt // 1.0
        available = (rng.random(int(second[-1]) + 1) >= lidar.lost)[second.astype(int)]
        available[0] = True
        u = u[np.maximum.accumulate(np.where(available, np.arange(len(u)), 0))]
    return np.interp(box.dt * np.arange(len(u)), box.passing - turbine.nacelle.overhang / box.speed, u)
