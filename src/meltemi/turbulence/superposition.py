"""Superposition of a coherent gust on turbulence.

Reference: docs/theory/iec.md (W-23); the axes and the time of a plane are those of docs/theory/wind.md (W-2, W-5).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox, WindSeries


def with_gust(box: WindBox, gust: WindSeries) -> WindBox:
    """Superpose the gust, direction change and shear of a series on a turbulent box.

    Each plane receives the values of the series at the time when it passes the tower axis. Mean speed, profile and
    direction are the box's; the series adds its gust, vertical speed and linear shears, and the changes of its speed
    and direction since its beginning. The turbulence is rotated with the wind direction.

    Args:
      box: turbulent field.
      gust: series, for example from ``eog`` or ``ecd``.

    Returns:
      The box with the gust, at the times of the series for the tower axis.

    Raises:
      InputError: the profile of the series changes in time, its shear has no reference length or height, the box is
        periodic, so that the gust would repeat, or the gust is outside the box.
    """
    if np.ptp(gust.exponent) > 0.0:
        raise InputError(f"{gust.label}: a power law that changes in time cannot be added to a box")
    if box.periodic:
        raise InputError(f"{box.label}: it is periodic, and the gust would repeat: generate it with periodic=False")
    velocity, time = box.velocity, box.passing
    if (span := gust.changes) and not (span[0] < time[-1] and span[1] > time[0]):
        raise InputError(f"{gust.label}: it begins at {span[0]:g} s, but the box ends at {time[-1]:g} s")

    def now(name: str, *, change: bool = False) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        column = getattr(gust, name)
        return np.interp(time, gust.time, column - column[0] if change else column)[:, None, None]

    added = now("speed", change=True) + now("gust")
    turned = now("direction", change=True)
    if np.any(gust.horizontal_shear) or np.any(gust.vertical_shear):
        height = gust.reference_height or box.hub_height
        if gust.reference_length is None or height is None:
            raise InputError(f"{gust.label}: its shear needs a reference_length and a reference_height")
        y = (np.arange(velocity.shape[2]) * box.dy - 0.5 * box.width) * np.cos(turned)
        z = np.arange(velocity.shape[1])[:, None] * box.dz + box.bottom - height
        shear = now("horizontal_shear") * y + now("vertical_shear") * z
        added = added + now("speed") * shear / gust.reference_length
    u, v, w = (velocity[..., c].astype(np.float64) for c in range(3))
    u, c, s = u + added, np.cos(turned), np.sin(turned)
    combined = np.stack([u * c + v * s, v * c - u * s, w + now("vertical")], axis=-1).astype(np.float32)
    return replace(box, velocity=combined, source=f"{box.label} with {gust.label}")
