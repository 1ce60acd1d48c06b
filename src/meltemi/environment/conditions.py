"""Time-varying air and grid conditions of a run, as kernel arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.series import on_times, union, values
from meltemi.environment.air import R_DRY, Air
from meltemi.environment.grid import NOMINAL_FREQUENCY, PowerGrid
from meltemi.maths.tables import Table, number

if TYPE_CHECKING:
    from meltemi.environment.site import Environment

Float = NDArray[float64]

DENSITY_ERROR = 5e-5
"""Relative, of a density that is interpolated."""
HALVINGS = 8
"""At most, of an interval in which the air changes."""


class Conditions(Table):
    """Conditions: columns of their time series, and of the present values."""

    time: float = number("s", "time, non-decreasing")
    air_density: float = number("kg/m^3", "air density")
    air_temperature: float = number("K", "air temperature")
    humidity: float = number("-", "relative humidity")
    air_pressure: float = number("Pa", "air pressure")
    grid_voltage: float = number("-", "voltage at the terminals over the nominal voltage")
    grid_frequency: float = number("Hz", "grid frequency")
    power_reference: float = number(
        "W", "active electrical power requested by the operator; rated power without a request"
    )
    reactive_power: float = number("var", "reactive power to the grid, requested by the operator")


@kernel
def conditions_now(t: float, conditions: Float, density: float, now: Conditions) -> None:
    """Interpolate conditions in time.

    Args:
      conditions: (rows of ``Conditions``, n), the first of them the time.
      density: [kg/m^3] that holds while conditions are constant (n = 1), where it is a parameter of the model.
      now: gets the conditions at time ``t``.
    """
    times, n = conditions[0], conditions.shape[1]
    i, j = 0, n - 1
    if t >= times[j]:
        i = j
    elif t < times[0]:  # not at it: where it stands twice, the value after the jump holds
        j = 0
    while j - i > 1:
        k = (i + j) // 2
        if times[k] <= t:
            i = k
        else:
            j = k
    span = times[j] - times[i]
    share = (t - times[i]) / span if span > 0.0 else 0.0
    for row in range(conditions.shape[0]):
        a, b = conditions[row, i], conditions[row, j]
        now.array[row] = a if a == b else a + share * (b - a)
    now.time = t
    if n == 1:
        now.air_density = density


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
      rated_power: [W] the power reference of a grid that asks for nothing.
      frequency: [Hz] nominal, of a grid that says nothing else.

    Raises:
      InputError: a power reference above the rated power.
    """
    grid = grid or PowerGrid()
    if grid.power_reference is not None and values(grid.power_reference).max() > rated_power * (1.0 + 1e-9):
        raise InputError(
            f"grid: power_reference {values(grid.power_reference).max():g} W is above the turbine's rated power of "
            f"{rated_power:g} W"
        )
    air = environment.air or Air()
    reference = rated_power if grid.power_reference is None else grid.power_reference
    of_the_grid = (
        grid.voltage,
        frequency if grid.frequency is None else grid.frequency,
        reference,
        grid.reactive_power,
    )
    times = union(air.temperature, air.humidity, 0.0 if air.pressure is None else air.pressure, *of_the_grid)
    times = _density_times(air, times)
    temperature, humidity, pressure, density = air.at(times)
    if environment.air is None:
        density = np.full(len(times), environment.air_density)
        pressure = density * R_DRY * temperature
    return np.array(
        [times, density, temperature, humidity, pressure, *(on_times(quantity, times) for quantity in of_the_grid)]
    )
