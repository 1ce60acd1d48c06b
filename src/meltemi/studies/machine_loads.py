"""Turbine loads: resultants at yaw bearing, tower and blade root, their extremes and equivalent loads.

The bearing is at the tower top, so the bearing moments and the shear force of the tower top are section loads at one
point.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
STEEL, GLASS = 4.0, 10.0
"""Slopes of S-N curves."""


def _size(*names: str) -> Callable[[Result], Float]:
    return lambda r: np.asarray(np.sqrt(sum(r[name] ** 2 for name in names)))


YAW_BENDING, YAW_TORSION, TOP_SHEAR = "yaw bearing bending", "yaw bearing torsion", "tower top shear"
TOWER_BASE, BLADE_ROOT = "tower base bending", "blade root flap"


@dataclass(frozen=True)
class Load:
    """Definition of a load.

    Attributes:
      unit: engineering unit.
      factor: factor from SI units to it.
      size: function for the magnitude whose extreme is evaluated.
      component: channel for the fatigue, along the initial wind direction.
      slope: S-N slope.
    """

    unit: str
    factor: float
    size: Callable[[Result], Float]
    component: str
    slope: float = STEEL


LOADS: Mapping[str, Load] = {
    YAW_BENDING: Load("MN m", 1e-6, _size("yaw_moment_x", "yaw_moment_y"), "yaw_moment_y"),
    YAW_TORSION: Load("MN m", 1e-6, _size("yaw_moment_z"), "yaw_moment_z"),
    TOP_SHEAR: Load("MN", 1e-6, _size("yaw_force_x", "yaw_force_y"), "yaw_force_x"),
    TOWER_BASE: Load(
        "MN m", 1e-6, _size("tower_base_moment_fore_aft", "tower_base_moment_side_side"), "tower_base_moment_fore_aft"
    ),
    BLADE_ROOT: Load("MN m", 1e-6, _size("root_moment_flap_1"), "root_moment_flap_1", GLASS),
}
CHANNELS = (
    *("yaw_force_x", "yaw_force_y", "yaw_force_z", "yaw_moment_x", "yaw_moment_y", "yaw_moment_z"),
    *("tower_base_moment_fore_aft", "tower_base_moment_side_side", "root_moment_flap_1"),
)
"""Channels that these loads need."""


def extreme(result: Result, name: str) -> float:
    """Largest magnitude of a load, in engineering units."""
    load = LOADS[name]
    return float(load.size(result).max() * load.factor)


def fatigue(result: Result, name: str) -> float:
    """Damage-equivalent load at 1 Hz over the run, in engineering units."""
    load = LOADS[name]
    duration = float(result.time[-1] - result.time[0])
    return load.factor * damage_equivalent_load(result[load.component], duration=duration, slope=load.slope)
