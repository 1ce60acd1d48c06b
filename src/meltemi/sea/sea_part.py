"""The sea of a run as a part that replaces still water around the pile of a turbine.

Reference: docs/theory/sea.md (H-21 to H-23).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.sea.conditions import Sea, StillWater, Stretching
from meltemi.sea.field import sea_field
from meltemi.sea.pile import PileNode, PilePart, PileWater
from meltemi.simulation.model import Model
from meltemi.simulation.parts import Part

Float = NDArray[np.float64]


@dataclass(frozen=True)
class SeaPart(Part):
    """Arrays of the pile's records in a sea.

    Attributes:
      water, sea_levels, sea_field, sea_current: see ``PileSystem``.
    """

    water: Float
    sea_levels: Float
    sea_field: Float
    sea_current: Float

    def arrays(self) -> dict[str, Any]:
        """Arrays that replace those of still water."""
        return {name: getattr(self, name) for name in ("sea_levels", "sea_field", "sea_current")} | {
            "water": self.water.copy(),
            "sea_now": np.zeros(self.sea_field.shape[1]),
        }


@dataclass(frozen=True)
class Joined(Part):
    """The sea of a run for several parts."""

    parts: tuple[Part, ...]

    def arrays(self) -> dict[str, Any]:
        """Arrays that replace those of still water."""
        return {name: array for part in self.parts for name, array in part.arrays().items()}


def steady_sea(model: Model[Any], sea: Sea) -> Model[Any]:
    """The model in water with level and current of a sea, and on a floating platform with the mean drift of its waves.

    For analyses of steady operation, from ``operating_point`` and ``power_curve`` to ``linearise``; a run in a sea
    begins there with ``start=operating_point(steady_sea(model, sea), wind)``.

    Raises:
      InputError: the turbine is not offshore, or a run rejects the sea.
    """
    still = StillWater(level=sea.level, current=sea.current, stretching=sea.stretching)
    floats = next((part for part in model.parts if hasattr(part, "in_steady_sea")), None)
    if floats is None:
        steady = sea_part(still, model, 1.0, (0.0, 0.0))
    else:
        steady = floats.in_steady_sea(sea, still, model.environment.gravity)
    return replace(model, parts=(*model.parts, steady))


def sea_part(sea: Sea, model: Model[Any], duration: float, origin: tuple[float, float]) -> Part:
    """The sea of a run of a model.

    Raises:
      InputError: the turbine is not offshore, waves break, or the sea is too short.
    """
    gravity = model.environment.gravity
    own = [part.in_sea(sea, duration, origin, gravity) for part in model.parts if hasattr(part, "in_sea")]
    if own:  # a frame, a floating platform, or both
        return own[0] if len(own) == 1 else Joined(tuple(own))
    pile = next((part for part in model.parts if isinstance(part, PilePart)), None)
    if pile is None:
        raise InputError(
            f"sea: {model.turbine.name} stands on land; give it a support or a frame (turbine.support, turbine.frame), "
            "or choose a turbine at sea, such as iea15mw-monopile or nrel5mw-jacket"
        )
    support = model.turbine.support
    depth = support.depth + sea.level
    if depth <= 1.0:
        raise InputError(f"sea.level: {sea.level:g} m leaves {depth:g} m of water at a depth of {support.depth:g} m")
    waves = sea.components(depth, duration, gravity)
    node = View(PileNode, pile.pile_nodes)
    z = node["height"] - sea.level
    levels = np.append(z[(z < -1e-6) & (z > -depth)], 0.0)
    levels = np.append(-depth, levels) if sea.stretching == "wheeler" else levels
    radius = None
    if support.hydrodynamics.diffraction == "maccamy_fuchs":
        radius = np.interp(levels + sea.level, node["height"], np.sqrt(node["inertial"] / (2.0 * np.pi)))
    field = sea_field(waves, depth, levels, duration, radius=radius, slope=True, gravity=gravity, origin=origin)
    samples = len(field.elevation)
    kinematics = np.concatenate([field.velocity, field.acceleration], axis=-1).reshape(samples, -1)
    water = pile.water.copy()
    v = View(PileWater, water)
    v["depth"], v["level"] = depth, sea.level
    v["stretching"] = float(get_args(Stretching).index(sea.stretching))
    v["step"], v["period"] = field.dt, field.period
    current = np.zeros((2, len(z))) if sea.current is None else sea.current.at(z, depth).T
    return SeaPart(
        water=water,
        sea_levels=levels,
        sea_field=np.ascontiguousarray(np.concatenate([field.elevation[:, None], kinematics], axis=1)),
        sea_current=np.ascontiguousarray(current),
    )
