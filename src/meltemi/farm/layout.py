"""Wind farms: turbines, their positions and the settings of their wakes, in Python and as a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, model_validator

from meltemi.cases.case import LoadCase
from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.farm.settings import WakeSettings
from meltemi.simulation.model import Model
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
CLOSEST = 2.0
"""Rotor diameters between turbines: nearer ones are in the near wake, for which there is no model."""
MOST_TURBINES = 200
LARGEST = 1e5
"""[m] largest coordinate of a position."""
MOST_YAW = math.radians(60.0)


def _pairs(given: Any) -> Any:
    """Positions unchanged; raises ValueError for a turbine whose position is not two values."""
    for i, each in enumerate(given if isinstance(given, list | tuple) else ()):
        if np.shape(each) != (2,):
            raise ValueError(f"turbine {i + 1}: expected two numbers, x and y in m, such as [630, 0], found {each}")
    return given


def _numbers(given: Any, what: str, checked: Callable[[Any], Any] = lambda values: values) -> Float:
    """An argument as an array; raises InputError if it is not numeric."""
    try:
        return np.array(checked(given), dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"farm: {what}: {error}") from None


class FarmCase(LoadCase):
    """Complete description of the simulation of a farm: a load case with positions and wakes."""

    positions: Annotated[tuple[tuple[float, float], ...], BeforeValidator(_pairs)]
    """Positions (x, y) [m] of the turbines: x downwind for wind direction 0, y to the left."""
    yaw: tuple[float, ...] = ()
    """[rad] constant yaw of each nacelle from the wind, counter-clockwise from above; by default 0: all face the
    wind."""
    wakes: WakeSettings = WakeSettings()

    @model_validator(mode="after")
    def _check_layout(self) -> Self:
        try:
            check_layout(np.array(self.positions), (), self.yaw or [0.0] * len(self.positions))
        except InputError as error:
            raise ValueError(str(error)) from None
        return self


@dataclass(frozen=True)
class Farm:
    """Turbines in one wind and in each other's wakes.

    Attributes:
      turbine: name, description or model of all turbines, or one for each.
      positions: (x, y) [m] position of each: x downwind for wind direction 0, y to the left looking downwind.
      wakes: name of a set of constants (``fast.farm``, ``iec``, ``madsen``, ``keck``, ``none``), or settings.
      yaw: [rad] constant yaw of all nacelles, or of each, from the direction of the mean wind (for a wind series, at
        its start); counter-clockwise from above. At 0 they face the wind.

    Raises:
      InputError: turbines are closer than two rotor diameters, or lengths of lists do not match.
    """

    turbine: str | AnyTurbine | Model[Any] | Sequence[str | AnyTurbine | Model[Any]]
    positions: Sequence[tuple[float, float]]
    wakes: str | WakeSettings = "fast.farm"
    yaw: float | Sequence[float] = 0.0

    @property
    def settings(self) -> WakeSettings:
        """Settings of the wake model."""
        given = self.wakes
        return given if isinstance(given, WakeSettings) else validated({"model": given}, WakeSettings, "farm: wakes")

    def models(self, options: ModelOptions | None = None) -> list[Model[Any]]:
        """A model for each turbine; turbines of one description share one."""
        given = self.turbine
        each = list(given) if isinstance(given, list | tuple) else [given] * len(self.positions)
        if len(each) != len(self.positions):
            raise InputError(f"farm: expected a turbine for each of {len(self.positions)} positions, found {len(each)}")
        built: dict[int, Model[Any]] = {}
        for one in each:
            if id(one) not in built:
                built[id(one)] = one if isinstance(one, Model) else build(load_turbine(one), options or ModelOptions())  # type: ignore[arg-type]
        return [built[id(one)] for one in each]

    def places(self) -> Float:
        """(turbines, 2) [m] positions."""
        return _numbers(list(self.positions), "positions", _pairs)

    def angles(self) -> Float:
        """(turbines,) [rad] yaw from the wind."""
        angles = _numbers(self.yaw, "yaw [rad]")
        return angles if angles.ndim else np.full(len(self.positions), angles)


def check_layout(positions: Float, diameters: Sequence[float], yaw: Sequence[float] | Float) -> None:
    """Reject positions that are not finite or too far away, turbines that are too close, and excessive yaw.

    Args:
      positions: (turbines, 2) [m] positions.
      diameters: [m] rotor diameters, where they are known.
      yaw: [rad] yaw angles.

    Raises:
      InputError: naming the two turbines, their distance and the least one.
    """
    if not 1 <= len(positions) <= MOST_TURBINES:
        raise InputError(f"farm: positions: expected 1 to {MOST_TURBINES} turbines, found {len(positions)}")
    if len(yaw) != len(positions):
        raise InputError(f"farm: yaw: expected an angle for each of {len(positions)} turbines, found {len(yaw)}")
    if not np.all(np.abs(positions) <= LARGEST):
        raise InputError(f"farm: positions: expected numbers within {LARGEST:g} m")
    for i, angle in enumerate(yaw):
        if not abs(angle) <= MOST_YAW:
            raise InputError(
                f"farm: yaw of turbine {i + 1} is {math.degrees(angle):.4g} deg ({angle:.4g} rad), expected within "
                f"{math.degrees(MOST_YAW):g} deg; a number in a file is in rad, a text may have a unit: 20 deg"
            )
    for i, diameter in enumerate(diameters):
        for j in range(i):
            least = CLOSEST * max(diameter, diameters[j])
            apart = math.dist(positions[i], positions[j])
            if apart < least:
                raise InputError(
                    f"farm: turbines {j + 1} and {i + 1} are {apart:.0f} m apart, expected at least {least:.0f} m "
                    f"({CLOSEST:g} rotor diameters): closer ones are in the near wake, which is not modelled"
                )
