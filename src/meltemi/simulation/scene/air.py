"""Wind of a scene: velocities in a section across the mean wind through the tower's axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.maths.vectors import Vec
from meltemi.simulation.scene.record import Scene, track_arrays
from meltemi.wind.fields import SharedTurbulence, SteadyWind, Wind, WindBox, WindSeries, wind_field
from meltemi.wind.turbulence.field import generate_field
from meltemi.wind.turbulence.grid import WindGrid
from meltemi.wind.turbulent import TurbulentWind
from meltemi.wind.velocity import WindField, series_now, wind_velocity

POINTS, RATE, LONGEST = 15, 5.0, 600.0
"""Of a wind alone: points along each side, [Hz] largest rate, [s] longest time that is drawn."""
USUAL_HEIGHT, USUAL_SIZE = 90.0, 65.0
"""[m] hub height and half width at which a wind without grid is drawn."""
USUAL_DURATION = 60.0
"""[s] of a wind without end."""
FULL = 127
"""Largest number of 8 bits."""


@dataclass(frozen=True)
class CrossSection:
    """A section across the wind.

    Attributes:
      height: [m] of its middle.
      half_width, half_height: [m].
      points: along each side.
      diameter: [m] of the rotor, over which the linear shear of a series acts.
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


def usual_field(wind: TurbulentWind) -> WindBox:
    """Field of a turbulent wind without turbine."""
    spacing = 2.0 * USUAL_SIZE / (wind.points - 1)
    grid = WindGrid(
        points_y=wind.points,
        points_z=wind.points,
        dy=spacing,
        dz=spacing,
        bottom=USUAL_HEIGHT - USUAL_SIZE,
        hub_height=USUAL_HEIGHT,
    )
    return generate_field(wind, grid, USUAL_DURATION)


def wind_scene(wind: Wind) -> Scene:
    """Scene of a wind alone, with the wind in the middle of the section as a plot: at most its first 600 s."""
    if isinstance(wind, SharedTurbulence):
        raise InputError("view: shared turbulence consists of a mean wind and a field: show one of them")
    if isinstance(wind, WindBox):
        height, up, across = 0.5 * (wind.bottom + wind.top), 0.5 * (wind.top - wind.bottom), 0.5 * wind.width
        begin, end = float(wind.passing[0]), float(wind.passing[-1])
    else:
        height, up, across = wind.reference_height or USUAL_HEIGHT, USUAL_SIZE, USUAL_SIZE
        begin, end = (
            (float(wind.time[0]), float(wind.time[-1])) if isinstance(wind, WindSeries) else (0.0, USUAL_DURATION)
        )
    begin, end = max(begin, 0.0), min(max(end, begin + 1.0), max(begin, 0.0) + LONGEST)
    about, arrays = wind_section(wind, CrossSection(height, across, up, POINTS, 2.0 * across), begin, end, RATE)
    about["alone"] = True
    middle = POINTS // 2
    found = Scene(
        {"kind": "wind", "begin": begin, "duration": end - begin, "steps": {"wind": 1.0 / RATE}, "wind": about}, arrays
    )
    series = found.arrays["wind.amplitude"][:, middle, middle] * arrays["wind.scale"] + arrays["wind.mean"]
    if len(series) > 1:
        titles = ("downwind", "to the left", "up")
        plots = [
            {"title": f"Wind {name}, in the middle", "unit": "m/s", "lines": [{"name": name, "column": i}]}
            for i, name in enumerate(titles)
        ]
        found.about["plots"] = plots
        found.about["steps"]["plot"] = 1.0 / RATE
        arrays |= track_arrays("plot", series.astype(float))
    return found
