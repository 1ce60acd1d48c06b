"""Time series of air and grid over a run, as the array that ``conditions_now`` reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.series import on_times, union, values
from meltemi.environment.gases import CELSIUS, R_DRY, STANDARD_TEMPERATURE
from meltemi.environment.grid import NOMINAL_FREQUENCY, PowerGrid
from meltemi.environment.site import Environment

if TYPE_CHECKING:
    from meltemi.environment.air import Air

Float = NDArray[np.float64]

DENSITY_ERROR = 5e-5
"""Relative error of an interpolated density."""
HALVINGS = 8
"""Largest number of halvings of an interval in which the air changes."""


def _density_times(air: Air, times: Float) -> Float:
    """Times between which the density is linear within ``DENSITY_ERROR``, although temperature etc. are linear.

    Intervals are halved as often as needed, so that slow changes need no further times and constant air none.
    """
    for _ in range(HALVINGS):
        density, wide = air.at(times)[-1], np.diff(times) > 0.0
        begin, end, first, last = times[:-1][wide], times[1:][wide], density[:-1][wide], density[1:][wide]
        middle = 0.5 * (begin + end)
        coarse = np.zeros(len(middle), dtype=bool)
        for share in (0.25, 0.5, 0.75):
            exact = air.at(begin + share * (end - begin))[-1]
            coarse |= np.abs(first + share * (last - first) - exact) > DENSITY_ERROR * exact
        coarse &= (begin < middle) & (middle < end)
        if not coarse.any():
            break
        times = np.sort(np.concatenate([times, middle[coarse]]))
    return times


def conditions_array(
    environment: Environment, grid: PowerGrid | None, rated_power: float, frequency: float = NOMINAL_FREQUENCY
) -> Float:
    """(rows, n) conditions of a run; n = 1 if they are constant.

    A given density is taken as that of dry air of 15 degC, at the corresponding pressure.

    Args:
      rated_power: [W] default power reference of the grid.
      frequency: [Hz] default frequency of the grid.

    Raises:
      InputError: a power reference above the rated power.
    """
    grid = grid or PowerGrid()
    if grid.power_reference is not None and values(grid.power_reference).max() > rated_power * (1.0 + 1e-9):
        raise InputError(
            f"grid: power_reference {values(grid.power_reference).max():g} W is above the turbine's rated power of "
            f"{rated_power:g} W"
        )
    reference = rated_power if grid.power_reference is None else grid.power_reference
    of_the_grid = (
        grid.voltage,
        frequency if grid.frequency is None else grid.frequency,
        reference,
        grid.reactive_power,
    )
    if (air := environment.air) is None:
        times = union(*of_the_grid)
        temperature, humidity = np.full(len(times), STANDARD_TEMPERATURE + CELSIUS), np.zeros(len(times))
        density = np.full(len(times), environment.air_density)
        pressure = density * R_DRY * temperature
    else:
        times = union(air.temperature, air.humidity, 0.0 if air.pressure is None else air.pressure, *of_the_grid)
        times = _density_times(air, times)
        temperature, humidity, pressure, density = air.at(times)
    return np.array(
        [times, density, temperature, humidity, pressure, *(on_times(quantity, times) for quantity in of_the_grid)]
    )
