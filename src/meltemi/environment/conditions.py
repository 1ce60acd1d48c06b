"""Air and grid at an instant of a run; ``environment.course`` has their time series."""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Table, kernel, number

Float = NDArray[float64]


class Conditions(Table):
    """Columns of the time series of conditions, and of the present values."""

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
      now: output, the conditions at time ``t``.
    """
    times, n = conditions[0], conditions.shape[1]
    i, j = 0, n - 1
    if t >= times[j]:
        i = j
    elif t < times[0]:  # strictly later: at a repeated time, the value after the jump holds
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
