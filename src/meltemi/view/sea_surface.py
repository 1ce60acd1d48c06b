"""Sea surface around a turbine for its view: elevation along the wave direction, as a track."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from meltemi.scene.record import Scene, track_arrays
from meltemi.simulation.result import Result

if TYPE_CHECKING:
    from meltemi.sea.airy import WaveComponents
    from meltemi.sea.conditions import Sea

POINTS, REACH, ERROR = 161, 6.0, 0.02
"""Points along the waves; half their length over the rotor radius; [m] largest error of the track."""


def with_sea(scene: Scene, result: Result) -> Scene:
    """The scene of an offshore turbine with the elevation of the sea.

    Args:
      scene: scene of the run.
      result: result whose metadata describe the sea.
    """
    water, content = scene.about["turbine"].get("water"), result.meta.get("sea")
    if water is None or not isinstance(content, dict):
        return scene
    from meltemi.sea.kinds import sea_of

    sea = sea_of(content, "sea")
    return surfaced(scene, sea, sea.components(water["depth"] + sea.level, float(result.time[-1])))


def surfaced(scene: Scene, sea: Sea, waves: WaveComponents) -> Scene:
    """The scene with the wave elevation of a sea; waves of several directions are drawn in their mean direction."""
    from meltemi.sea.airy import wave_number
    from meltemi.sea.field import AHEAD, summed, times

    water = scene.about["turbine"]["water"]
    w, way, end = waves.frequency, waves.direction, scene.about["begin"] + scene.about["duration"]
    about = scene.about["turbine"] | {"water": water | {"level": sea.level, "reach": 0.0, "direction": 0.0}}
    if not len(w):
        return replace(scene, about=scene.about | {"turbine": about})
    main = float(np.angle(np.sum(np.abs(waves.amplitude) ** 2 * np.exp(1j * way))))
    reach = REACH * about["rotor_radius"]
    along = np.outer(
        np.linspace(-reach, reach, POINTS), wave_number(w, water["depth"] + sea.level) * np.cos(way - main)
    )
    lines = waves.amplitude * np.exp(1j * (w * scene.about["begin"] - along))
    dt, _, total = times(waves, end)
    surface = summed(waves, lines, dt, AHEAD + int(scene.about["duration"] / dt) + 2, total)[:, AHEAD:]
    about["water"] |= {"reach": reach, "direction": main}
    track = track_arrays("sea", surface.T[:, None, :, None], ERROR)
    steps = scene.about["steps"] | {"sea": dt}
    return Scene(scene.about | {"turbine": about, "steps": steps}, scene.arrays | track)
