"""Series and statistics of a sea.

Reference: docs/theory/sea.md (H-1 to H-12).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meltemi.sea.conditions import Sea
from meltemi.sea.field import AHEAD, sea_field

Float = NDArray[np.float64]
SHARES = (0.0, 0.25, 0.5, 1.0)
"""Heights of the series below still water, over the depth."""


@dataclass(frozen=True)
class SeaSeries:
    """Elevation and kinematics along the mean direction of a sea.

    Attributes:
      time, elevation: (T,) [s], [m] time and elevation.
      height: (P,) [m] heights from still water.
      velocity, acceleration: (T, P) [m/s], [m/s^2] along x of a sea that is turned to travel along it.
      spectrum: frequencies [rad/s] and variances [m^2] of the waves.
    """

    time: Float
    elevation: Float
    height: Float
    velocity: Float
    acceleration: Float
    spectrum: tuple[Float, Float]

    def table(self) -> Float:
        """(T, 2 + 2 P) time, elevation, and velocity and acceleration at each height."""
        pairs = np.stack([self.velocity, self.acceleration], axis=-1).reshape(len(self.time), -1)
        return np.column_stack([self.time, self.elevation, pairs])


def sea_series(sea: Sea, depth: float, duration: float) -> SeaSeries:
    """Series of a sea in water of a depth [m] over a duration [s].

    Raises:
      InputError: waves break, or the sea is too short.
    """
    waves = sea.components(depth, duration)
    height = 0.0 - depth * np.array(SHARES)
    field = sea_field(waves, depth, height, duration)
    mean = np.angle(np.sum(abs(waves.amplitude) ** 2 * np.exp(1j * waves.direction))) if len(waves.direction) else 0.0
    x, y = np.cos(mean), np.sin(mean)
    rows = AHEAD + np.arange(max(1, round(duration / field.dt)))
    rows = AHEAD + (rows - AHEAD) % max(1, round(min(field.period, duration) / field.dt))
    current = np.zeros(len(height)) if sea.current is None else sea.current.at(height, depth) @ [x, y]
    return SeaSeries(
        time=field.dt * np.arange(len(rows), dtype=np.float64),
        elevation=field.elevation[rows],
        height=height,
        velocity=(field.velocity[rows] @ [x, y]) + current,
        acceleration=field.acceleration[rows] @ [x, y],
        spectrum=(waves.frequency, 0.5 * np.abs(waves.amplitude, dtype=np.float64) ** 2),
    )


def sea_statistics(series: SeaSeries) -> tuple[list[str], list[list[str]]]:
    """Table: of the waves and of the series significant height, periods, largest crest, trough and wave."""
    w, variance = series.spectrum
    head = ["quantity", "waves", "series", "unit"]
    eta = series.elevation - series.elevation.mean()
    up = np.flatnonzero((eta[:-1] < 0.0) & (eta[1:] >= 0.0))
    heights = [np.ptp(eta[a:b]) for a, b in pairwise(up)]
    step = series.time[1] - series.time[0] if len(series.time) > 1 else 0.0
    between = step * float(np.mean(np.diff(up))) if len(up) > 1 else np.nan
    below, m0, m2 = (float((variance * w**n).sum()) for n in (-1, 0, 2))
    if m0 <= 0.0:
        return head, [["significant wave height", "0", "0", "m"]]
    rows = [
        ("significant wave height", 4.0 * np.sqrt(m0), 4.0 * eta.std(), "m"),
        ("mean period (zero up-crossing)", 2.0 * np.pi * np.sqrt(m0 / m2), between, "s"),
        ("energy period", 2.0 * np.pi * below / m0, np.nan, "s"),
        ("peak period", 2.0 * np.pi / w[np.argmax(variance)], np.nan, "s"),
        ("highest crest", np.nan, eta.max(), "m"),
        ("deepest trough", np.nan, eta.min(), "m"),
        ("highest wave", np.nan, max(heights, default=np.nan), "m"),
        ("largest velocity at still water", np.nan, abs(series.velocity[:, 0]).max(), "m/s"),
    ]
    return head, [[name, *("-" if np.isnan(v) else f"{v:.4g}" for v in (a, b)), unit] for name, a, b, unit in rows]
