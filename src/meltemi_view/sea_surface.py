"""The surface of the sea around a turbine, for its view: the elevation along the waves, as a track."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meltemi.simulation.result import Result
from meltemi.simulation.scene.record import Scene, track_arrays

POINTS, REACH, ERROR = 161, 6.0, 0.02
"""Points along the waves; half their length over the rotor radius; [m] largest error of the track."""


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
    from meltemi_sea.field import AHEAD, summed, times
    from meltemi_sea.kinds import sea_of

    sea = sea_of(content, "sea")
    depth = water["depth"] + sea.level
    waves = sea.components(depth, float(result.time[-1]))
    w, way = waves.frequency, waves.direction
    about = scene.about["turbine"] | {"water": water | {"level": sea.level, "reach": 0.0, "direction": 0.0}}
    if not len(w):
        return replace(scene, about=scene.about | {"turbine": about})
    main = float(np.angle(np.sum(np.abs(waves.amplitude) ** 2 * np.exp(1j * way))))
    reach = REACH * about["rotor_radius"]
    along = np.outer(np.linspace(-reach, reach, POINTS), wave_number(w, depth) * np.cos(way - main))
    lines = waves.amplitude * np.exp(1j * (w * scene.about["begin"] - along))
    dt, _, total = times(waves, float(result.time[-1]))
    surface = summed(waves, lines, dt, AHEAD + int(scene.about["duration"] / dt) + 2, total)[:, AHEAD:]
    about["water"] |= {"reach": reach, "direction": main}
    track = track_arrays("sea", surface.T[:, None, :, None], ERROR)
    steps = scene.about["steps"] | {"sea": dt}
    return Scene(scene.about | {"turbine": about, "steps": steps}, scene.arrays | track)
