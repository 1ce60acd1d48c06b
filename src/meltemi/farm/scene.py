"""Three-dimensional scene of a farm: positions of the turbines, and wakes as stations with a width and a deficit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meltemi.scene.record import Scene, track_arrays
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
Planes = NDArray[np.float32]
SPACING = 0.5
"""Rotor diameters between stations of a wake."""


def farm_scenes(
    results: Sequence[Result], positions: Float, planes: Sequence[Sequence[Planes]], step: float, diameter: float
) -> tuple[Result, ...]:
    """The results with scenes of the farm where they have scenes; the first includes the wakes as a track ``wakes``.

    Positions are (turbines, 2) [m]; ``planes`` are the planes of each wake (``WakeTrack``), every ``step`` [s] from 0;
    ``diameter`` [m] is the largest rotor diameter.
    """
    if any(result.scene is None for result in results):
        return tuple(results)
    low, high, about, arrays = positions.min(axis=0), positions.max(axis=0), {}, {}
    if planes:
        longest = max(p[3, -1] for each in planes for p in each)
        at = np.arange(SPACING, max(longest / diameter, 1.0), SPACING) * diameter

        def stations(p: Planes) -> list[Float]:  # no deficit where a wake has ended
            return [np.interp(at, p[3], p[c], right=0.0 if c > 6 else None) for c in (0, 1, 2, 7, 8)]

        # (E, wakes, stations, 5): centre, deficit, radius
        values = np.array([[stations(p) for p in each] for each in planes]).swapaxes(2, 3)
        ends = values[..., :2].reshape(-1, 2)
        low, high = np.minimum(low, ends.min(axis=0)), np.maximum(high, ends.max(axis=0))
        speed = float(np.mean([np.hypot(p[4], p[5]).mean() for p in planes[-1]]))
        numbers = {"largest": float(values[..., 3].max()), "spacing": SPACING * diameter, "drift": speed}
        about = {"wakes": numbers | {"count": len(planes[0]), "stations": len(at)}}
        arrays = track_arrays("wakes", values.reshape(len(values), -1))
    farm = {"centre": (0.5 * (low + high)).tolist(), "half": (0.5 * (high - low) + 0.5 * diameter).tolist()}
    scenes = []
    for result, place in zip(results, positions, strict=True):
        old = result.scene
        assert old is not None
        new = {"farm": farm, "place": place.tolist(), "steps": old.about["steps"] | {"wakes": step}}
        scenes.append(replace(result, scene=Scene(old.about | new | about, old.arrays | arrays)))
        about, arrays = {}, {}
    return tuple(scenes)
