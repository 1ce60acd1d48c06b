"""Quantities by which control schemes are compared, evaluated from a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from math import pi

import numpy as np
from numpy.typing import NDArray

from meltemi.core.units import display
from meltemi.postprocess.ensemble import actuator_travel
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.result import Result
from meltemi.tuning.power_reference import tracking_error

Float = NDArray[np.float64]

BLADE_SLOPE, STEEL_SLOPE = 10.0, 4.0


@dataclass(frozen=True)
class Quantity:
    """A scalar evaluated from a run.

    Attributes:
      name: begins with OpenFAST's name of the channel.
      unit: engineering unit.
      factor: factor from SI to that unit.
      of: function from a result to the value in SI.
      slope: m of the S-N curve if it is an equivalent load.
      about: description.
    """

    name: str
    unit: str
    factor: float
    of: Callable[[Result], float] = field(repr=False)
    slope: float | None = None
    about: str = ""


def hub_moments(result: Result) -> tuple[Float, Float]:
    """(T,) tilt and yaw moment on the hub [N m], from the blades' out-of-plane root moments: sum M_i cos psi_i, sin."""
    moments = np.stack([result[name] for name in ("RootMyc1", "RootMyc2", "RootMyc3") if name in result])
    angles = np.stack([result["azimuth"] + 2.0 * pi * i / len(moments) for i in range(len(moments))])
    return (moments * np.cos(angles)).sum(axis=0), (moments * np.sin(angles)).sum(axis=0)


def _travel(result: Result, beginning: str) -> float:
    """[rad/s] actuator travel per second, mean over the blades, sum over the flaps of a blade."""
    names = [name for name in result.names if name.startswith(beginning)]
    blades = len([name for name in result.names if name.startswith("pitch_")])
    return sum(actuator_travel(result, name) for name in names) / blades


_SERIES: dict[str, Callable[[Result], Float]] = {
    "Mtilt": lambda result: hub_moments(result)[0],
    "Myaw": lambda result: hub_moments(result)[1],
    "power": lambda result: result["generator_power"],
    "rotor speed": lambda result: result["rotor_speed"],
}
"""Series of quantities whose name does not begin with a channel."""


def _statistic(result: Result, series: str, statistic: str, slope: float) -> float:
    """A statistic of a series: ``mean``, ``std``, ``max``, or ``DEL`` with the slope of its S-N curve."""
    x = _SERIES[series](result) if series in _SERIES else result[series]
    if statistic == "DEL":
        return damage_equivalent_load(x, duration=float(result.time[-1] - result.time[0]), slope=slope)
    return float(getattr(x, statistic)())


def _quantities(
    series: str, statistics: str, unit: str, about: str = "", slope: float = BLADE_SLOPE
) -> Iterator[Quantity]:
    """Statistics of a series in the SI unit ``unit``; the first one carries the description."""
    for statistic in statistics.split():
        of = partial(_statistic, series=series, statistic=statistic, slope=slope)
        m = slope if statistic == "DEL" else None
        yield Quantity(f"{series} {statistic}", *display(unit), of, m, about)
        about = ""


_RATE = display("rad/s", angular_rate_in_degrees=True)
QUANTITIES: tuple[Quantity, ...] = (
    *_quantities("RootMyc1", "std DEL mean", "N m", "out-of-plane root moment"),
    *_quantities("RootMxc1", "std DEL", "N m", "in-plane root moment"),
    *_quantities("Mtilt", "mean std DEL", "N m", "tilt moment of the blades on the hub"),
    *_quantities("Myaw", "mean std DEL", "N m", "yaw moment of the blades on the hub"),
    *_quantities("OoPDefl1", "mean std max", "m", "out-of-plane tip deflection"),
    *_quantities("IPDefl1", "std", "m", "in-plane tip deflection"),
    *_quantities("TwrBsMyt", "DEL", "N m", "fore-aft moment at the tower base", STEEL_SLOPE),
    *_quantities("YawBrMyp", "DEL", "N m", "tilt moment at the yaw bearing", STEEL_SLOPE),
    *_quantities("YawBrMzp", "DEL", "N m", "yaw moment at the yaw bearing", STEEL_SLOPE),
    *_quantities("power", "mean std", "W", "electrical"),
    *_quantities("rotor speed", "std", "rad/s"),
    Quantity("pitch travel", *_RATE, lambda r: _travel(r, "pitch_"), about="mean of |rate|, mean of the blades"),
    Quantity("flap travel", *_RATE, lambda r: _travel(r, "flap_"), about="mean of |rate|, sum of a blade's flaps"),
)
"""Compared quantities, in the order of the tables."""
TRACKING = Quantity("tracking error", *display("W"), tracking_error, about="rms deviation from the power reference")
"""Compared, too, where there is a power reference."""
