"""Wind of a scene: velocities in a section across the mean wind through the tower's axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.maths.vectors import Vec
from meltemi.wind.fields import SharedTurbulence, SteadyWind, Wind, WindSeries, wind_field
from meltemi.wind.velocity import WindField, series_now, wind_velocity

FULL = 127
"""Largest number of 8 bits."""


@dataclass(frozen=True)
class CrossSection:
    """A section across the wind.

    Attributes:
      height: [m] height of the middle.
      half_width, half_height: [m] half the extent across and up.
      points: along each side.
      diameter: [m] diameter of the rotor, over which the linear shear of a series acts.
    """

    height: float
    half_width: float
    half_height: float
    points: int
    diameter: float


def wind_section(
    wind: Wind, section: CrossSection, begin: float, end: float, rate: float
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Description of a section, and its velocities (T, Z, Y, 3) in 8 bits, inertial axes, at a rate [Hz]."""
    mean = wind.mean if isinstance(wind, SharedTurbulence) else wind
    direction = float(mean.direction[0] if isinstance(mean, WindSeries) else mean.direction)
    times = np.array([begin]) if isinstance(wind, SteadyWind) else np.arange(begin, end + 1.0 / rate, 1.0 / rate)
    about, arrays = sampled(wind_field(wind, section.height, section.diameter), section, times, direction)
    return about | {"label": wind.label}, arrays


def sampled(
    field: WindField, section: CrossSection, times: NDArray[np.float64], direction: float
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Description of a section, and its velocities (T, Z, Y, 3) in 8 bits, inertial axes, at some times [s]."""
    n = section.points
    across = np.linspace(-section.half_width, section.half_width, n)
    up = np.maximum(section.height + np.linspace(-section.half_height, section.half_height, n), 1.0)
    c, s = np.cos(direction), np.sin(direction)
    points = [Vec(float(y * s), float(y * c), float(z)) for z in up for y in across]
    values = np.empty((len(times), n * n, 3))
    for i, t in enumerate(times):
        series_now(float(t), field)
        for j, point in enumerate(points):
            u = wind_velocity(point, float(t), field)
            values[i, j] = u.x, u.y, u.z
    mean = values.mean(axis=(0, 1))
    scale = np.maximum(np.abs(values - mean).max(axis=(0, 1)) / FULL, 1e-6)
    about = {
        "points": n,
        "half_width": section.half_width,
        "half_height": section.half_height,
        "height": section.height,
        "heights": [round(float(z), 2) for z in up],
        "direction": direction,
        "diameter": section.diameter,
        "speed": float(np.hypot(mean[0], mean[1])),
    }
    arrays: dict[str, NDArray[Any]] = {
        "wind.amplitude": np.round((values - mean) / scale).astype(np.int8).reshape(len(times), n, n, 3),
        "wind.scale": scale.astype(np.float32),
        "wind.mean": mean.astype(np.float32),
    }
    return about, arrays
