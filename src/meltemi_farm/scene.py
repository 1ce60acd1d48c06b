"""A farm in three dimensions: the places of its turbines, and its wakes as stations with a width and a deficit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from meltemi.simulation.result import Result
from meltemi.simulation.scene.record import track_arrays

if TYPE_CHECKING:
    from meltemi_farm.simulation import WakeTrack

SPACING, DRIFT = 0.5, 0.8
"""Rotor diameters between stations of a wake; drift of the drawn rings over the wind."""


def farm_scenes(
    results: Sequence[Result], positions: np.ndarray, wakes: Sequence[WakeTrack], diameter: float, speed: float
) -> tuple[Result, ...]:
    """The results, where they have scenes, with those of a farm; the first has the wakes as a track ``wakes``.

    Args:
      results, positions, wakes: of the turbines; positions (turbines, 2) [m].
      diameter: [m] of the largest rotor.
      speed: [m/s] of the mean wind.
    """
    if any(result.scene is None for result in results):
        return tuple(results)
    low, high, about, arrays = positions.min(axis=0), positions.max(axis=0), {}, {}
    if wakes:
        longest = max(each[3, -1] for wake in wakes for each in wake.planes)
        at = np.arange(SPACING, max(longest / diameter, 1.0), SPACING) * diameter
        # (E, wakes, stations, 5): centre, deficit and radius; none where a wake has ended
        values = np.array(
            [
                [[np.interp(at, p[3], p[c], right=0.0 if c > 6 else None) for c in (0, 1, 2, 7, 8)] for p in planes]
                for planes in zip(*(wake.planes for wake in wakes), strict=True)
            ]
        ).swapaxes(2, 3)
        ends = values[..., :2].reshape(-1, 2)
        low, high = np.minimum(low, ends.min(axis=0)), np.maximum(high, ends.max(axis=0))
        numbers = {"largest": float(values[..., 3].max()), "spacing": SPACING * diameter, "drift": DRIFT * speed}
        about = {"wakes": numbers | {"count": len(wakes), "stations": len(at)}}
        arrays = track_arrays("wakes", values.reshape(len(values), -1))
        time = wakes[0].time
        arrays["step"] = float(time[1] - time[0]) if len(time) > 1 else 1.0
    step = arrays.pop("step", 1.0)
    farm = {"centre": (0.5 * (low + high)).tolist(), "half": (0.5 * (high - low) + 0.5 * diameter).tolist()}
    made = []
    for i, (result, place) in enumerate(zip(results, positions, strict=True)):
        assert result.scene is not None
        old = result.scene.about
        new = old | {"farm": farm, "place": place.tolist(), "steps": old["steps"] | {"wakes": step}}
        scene = replace(
            result.scene, about=new | ({} if i else about), arrays=result.scene.arrays | ({} if i else arrays)
        )
        made.append(replace(result, scene=scene))
    return tuple(made)
