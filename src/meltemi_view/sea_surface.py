"""The surface of the sea around a turbine, for its view: the elevation along the waves, as a track."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meltemi.simulation.result import Result
from meltemi.simulation.scene.record import Scene, track_arrays

RATE, POINTS, REACH, ERROR = 4.0, 161, 6.0, 0.02
"""[Hz] of the track; points along the waves; half its length over the rotor radius; [m] largest error."""


def with_sea(scene: Scene, result: Result) -> Scene:
    """The scene of a turbine in water with the elevation of the sea; waves of several directions as if of their mean.

    Args:
      scene: of the run.
      result: whose metadata describe the sea.
    """
    water, content = scene.about["turbine"].get("water"), result.meta.get("sea")
    if water is None or not isinstance(content, dict):
        return scene
    from meltemi_sea.airy import wave_number
    from meltemi_sea.kinds import sea_of

    sea = sea_of(content, "sea")
    depth = water["depth"] + sea.level
    waves = sea.components(depth, float(result.time[-1]))
    kept = np.abs(waves.amplitude) > 1e-3 * np.abs(waves.amplitude).max(initial=0.0)
    w, a, way = waves.frequency[kept], waves.amplitude[kept], waves.direction[kept]
    about = scene.about["turbine"] | {"water": water | {"level": sea.level, "reach": 0.0, "direction": 0.0}}
    if not len(w):
        return replace(scene, about=scene.about | {"turbine": about})
    main = float(np.angle(np.sum(np.abs(a) ** 2 * np.exp(1j * way))))
    reach = REACH * about["rotor_radius"]
    place = np.exp(-1j * np.outer(wave_number(w, depth) * np.cos(way - main), np.linspace(-reach, reach, POINTS)))
    time = scene.about["begin"] + np.arange(int(scene.about["duration"] * RATE) + 2) / RATE
    parts = np.array_split(time, max(1, len(time) // 512))
    surface = np.vstack([(np.exp(1j * np.outer(part, w)) @ (a[:, None] * place)).real for part in parts])
    about["water"] |= {"reach": reach, "direction": main}
    track = track_arrays("sea", surface[:, None, :, None], ERROR)
    steps = scene.about["steps"] | {"sea": 1.0 / RATE}
    return Scene(scene.about | {"turbine": about, "steps": steps}, scene.arrays | track)
