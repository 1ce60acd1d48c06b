"""Winds of Figures 20 and 21, which the paper shows but does not describe: turbulence, and a series of ramps."""

from __future__ import annotations

import numpy as np

from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid
from meltemi.wind.fields import WindSeries
from meltemi.wind.turbulent import TurbulentWind

LENGTH = 600.0
"""[s] duration of the winds."""
MEAN, INTENSITY = 11.0, 0.10
"""[m/s], [-] of the turbulence: it crosses rated wind again and again."""
COURSE = (
    *((0.0, 9.0), (60.0, 9.0), (120.0, 11.0), (210.0, 11.0), (240.0, 12.0)),
    *((300.0, 12.0), (345.0, 10.3), (420.0, 10.3), (470.0, 9.0), (600.0, 9.0)),
)
"""[s], [m/s]: 9, 11, 12, 10.3 and 9 m/s, with ramps between."""


def ramps() -> WindSeries:
    """Deterministic ramps of the wind speed."""
    time, speed = np.array(COURSE).T
    return WindSeries(time=time, speed=speed, source="ramps between 9 and 12 m/s")


def turbulent(hub_height: float, seed: int, length: float = LENGTH) -> WindSeries:
    """Kaimal turbulence at the hub, uniform over the rotor: the wind of a power-coefficient turbine.

    A rotor of 276 m averages smaller gusts; the fluctuations of this wind exceed those of the rotor-averaged wind.
    """
    wind = TurbulentWind(speed=MEAN, intensity=INTENSITY, seed=seed, shear_exponent=0.0, dt=0.25)
    grid = WindGrid(points_y=3, points_z=3, dy=1.0, dz=1.0, bottom=hub_height - 1.0, hub_height=hub_height)
    box = generate_field(wind, grid, length)
    n = round(length / box.dt) + 1
    row, column = grid.hub
    speed = np.asarray(box.velocity[:n, row, column, 0], np.float64)
    speed = (
        MEAN + (speed - speed.mean()) * INTENSITY * MEAN / speed.std()
    )  # statistics of these minutes, not of the whole field
    return WindSeries(time=np.arange(n) * box.dt, speed=speed, source=f"Kaimal turbulence, 11 m/s, 10 %, seed {seed}")
