"""Steady operation over wind speed, denser where power reaches its rated value and thrust its peak."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from meltemi.analyses.controlled_point import controlled_point
from meltemi.control.controller import Controller
from meltemi.core.errors import MeltemiError
from meltemi.simulation import rotors
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.turbine.power_turbine import AnyTurbine

HALVINGS = 5
"""Bisections of the wind speeds that bracket rated wind speed: from 1 m/s to 3 cm/s."""
PEAK_HALVINGS = 3
"""Bisections of the intervals beside the largest thrust, whose curve is flat unless the peak is at rated wind."""
RATED_PITCH = 1e-3
"""[rad] pitch above the smallest one at which the turbine counts as above rated."""
FINEST = 0.05
"""[m/s] interval below which none is halved."""
THRUST = "rotor_aero_thrust"


def above_rated(turbine: AnyTurbine, point: OperatingPoint) -> bool:
    """Whether the blades are pitched to limit the power."""
    return point.pitch > turbine.control.pitch.minimum + RATED_PITCH


def whole_speeds(turbine: AnyTurbine) -> list[float]:
    """[m/s] whole numbers from cut-in to cut-out wind speed."""
    return [float(u) for u in range(math.ceil(turbine.cut_in), math.floor(turbine.cut_out) + 1)]


def curve_size(turbine: AnyTurbine, wind_speeds: Sequence[float] | None = None) -> int:
    """Largest number of points of :func:`power_curve`."""
    return len(wind_speeds) if wind_speeds is not None else len(whole_speeds(turbine)) + HALVINGS + 2 * PEAK_HALVINGS


def power_curve(
    model: Model[Any], wind_speeds: Sequence[float] | None = None, controller: Controller | None = None
) -> Iterator[tuple[float, OperatingPoint | str]]:
    """Wind speed [m/s] and operating point, or the reason why there is none, of each point of a power curve.

    Args:
      wind_speeds: [m/s]; by default all whole numbers from cut-in to cut-out, and then points that bracket rated wind
        speed and the peak of thrust.
      controller: controller of the runs: with one, the points are the means of runs in steady wind
        (:func:`controlled_point`).
    """
    points: dict[float, OperatingPoint] = {}

    def at(speed: float) -> tuple[float, OperatingPoint | str]:
        try:
            point = rotors.operating_point(model, speed)
            points[speed] = controlled_point(model, controller, point) if controller else point
        except (MeltemiError, ValueError, ArithmeticError) as error:
            return speed, str(error)
        return speed, points[speed]

    yield from map(at, whole_speeds(model.turbine) if wind_speeds is None else wind_speeds)
    if wind_speeds is not None:
        return
    for _ in range(HALVINGS):
        above = [u for u in sorted(points) if above_rated(model.turbine, points[u])]
        below = [u for u in sorted(points) if above and u < above[0]]
        if not below:
            break
        yield at(0.5 * (below[-1] + above[0]))
    for _ in range(PEAK_HALVINGS):
        thrust = {u: points[u][THRUST] for u in sorted(points) if THRUST in points[u].channels}
        peak = max(range(len(thrust)), key=[*thrust.values()].__getitem__, default=0)
        for low, high in pairwise([*thrust][max(peak - 1, 0) : peak + 2]):
            if high - low > FINEST:
                yield at(0.5 * (low + high))
