"""A farm in three dimensions: the places of its turbines, and its wakes as stations with a width and a deficit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.simulation.result import Result
from meltemi.simulation.scene.record import Scene, track_arrays

if TYPE_CHECKING:
    from meltemi_farm.simulation import WakeTrack

Float = NDArray[np.float64]
SPACING, DRIFT = 0.5, 0.8
"""Rotor diameters between stations of a wake; drift of the drawn rings over the wind."""


def farm_scenes(
    results: Sequence[Result], positions: Float, wakes: Sequence[WakeTrack], diameter: float, speed: float
) -> tuple[Result, ...]:
    """The results, where they have scenes, with those of a farm; the first has the wakes as a track ``wakes``.

    Positions are (turbines, 2) [m]; ``diameter`` [m] of the largest rotor, ``speed`` [m/s] of the mean wind.
    """
    if any(result.scene is None for result in results):
        return tuple(results)
    low, high, about, arrays, step = positions.min(axis=0), positions.max(axis=0), {}, {}, 1.0
    if wakes:
        longest = max(each[3, -1] for wake in wakes for each in wake.planes)
        at = np.arange(SPACING, max(longest / diameter, 1.0), SPACING) * diameter

        def stations(p: NDArray[np.float32]) -> list[Float]:  # no deficit where a wake has ended
            return [np.interp(at, p[3], p[c], right=0.0 if c > 6 else None) for c in (0, 1, 2, 7, 8)]

        # (E, wakes, stations, 5): centre, deficit, radius
        values = np.array([[stations(p) for p in each] for each in zip(*(wake.planes for wake in wakes), strict=True)])
        values, step = values.swapaxes(2, 3), float(wakes[0].time[1:2].sum()) or 1.0  # exchanges begin at 0
        ends = values[..., :2].reshape(-1, 2)
        low, high = np.minimum(low, ends.min(axis=0)), np.maximum(high, ends.max(axis=0))
        numbers = {"largest": float(values[..., 3].max()), "spacing": SPACING * diameter, "drift": DRIFT * speed}
        about = {"wakes": numbers | {"count": len(wakes), "stations": len(at)}}
        arrays = track_arrays("wakes", values.reshape(len(values), -1))
    farm = {"centre": (0.5 * (low + high)).tolist(), "half": (0.5 * (high - low) + 0.5 * diameter).tolist()}
    made = []
    for result, place in zip(results, positions, strict=True):
        old = result.scene
        assert old is not None
        new = {"farm": farm, "place": place.tolist(), "steps": old.about["steps"] | {"wakes": step}}
        made.append(replace(result, scene=Scene(old.about | new | about, old.arrays | arrays)))
        about, arrays = {}, {}
    return tuple(made)
