"""Rainflow counting and damage-equivalent loads.

* Cycles are counted by the rainflow method of ASTM E1049-85 (2017), section 5.4.4, on the turning points
  of the series; the residue counts as half cycles.
* Ranges are not binned unless ``bins`` is given; then every cycle has the range of its bin's upper edge.
* No correction for the mean (Goodman) is made.
* Equivalent load: DEL = (sum_i n_i S_i^m / N_eq)^(1/m) with N_eq = f_eq T: a load of constant range, f_eq
  times a second, that does the same damage. f_eq is 1 Hz unless said otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
Index = NDArray[np.intp]


def cycle_ends(series: ArrayLike) -> tuple[Index, Index, Float]:
    """Turning points of the cycles of a series.

    Args:
      series: (T,) values.

    Returns:
      for each cycle the places in the series of its first and its second turning point, and its count
      (1 or 0.5), each (n,). A plateau counts as its first value.

    Raises:
      InputError: the series contains values that are not finite.
    """
    import rainflow

    x = np.asarray(series, dtype=float)
    if not np.all(np.isfinite(x)):
        raise InputError("rainflow counting: the series contains values that are not finite")
    place = np.flatnonzero(np.append(True, np.diff(x) != 0.0)) if len(x) else np.zeros(0, dtype=np.intp)
    x = x[place]
    if len(x) > 1 and abs(np.sign(np.diff(x)).sum()) == len(x) - 1:  # half a cycle, of which the library finds none
        return place[:1], place[-1:], np.array([0.5])
    cycles = np.array([(a, b, c) for _, _, c, a, b in rainflow.extract_cycles(x)]).reshape(-1, 3)
    first, second = cycles[:, :2].astype(np.intp).T
    return place[first], place[second], cycles[:, 2]


def rainflow_cycles(series: ArrayLike) -> tuple[Float, Float, Float]:
    """Cycles of a series.

    Args:
      series: (T,) values.

    Returns:
      ranges, means and counts (1 or 0.5) of the cycles, each (n,).

    Raises:
      InputError: the series contains values that are not finite.
    """
    x = np.asarray(series, dtype=float)
    first, second, counts = cycle_ends(x)
    return np.abs(x[first] - x[second]), 0.5 * (x[first] + x[second]), counts


def equivalent_range(ranges: Float, counts: Float, *, duration: float, slope: float, f_eq: float) -> float:
    """Equivalent load range of cycles (F-8); see ``damage_equivalent_load``."""
    for name, value in (("duration", duration), ("slope", slope), ("f_eq", f_eq)):
        if not value > 0.0:
            raise InputError(f"damage_equivalent_load: {name} must be positive, found {value!r}")
    largest = float(ranges.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    return float(largest * (np.sum(counts * (ranges / largest) ** slope) / (f_eq * duration)) ** (1.0 / slope))


def damage_equivalent_load(
    series: ArrayLike, *, duration: float, slope: float, f_eq: float = 1.0, bins: int | None = None
) -> float:
    """Damage-equivalent load (a range), in the unit of the series.

    Args:
      series: (T,) values.
      duration: [s] that the series covers.
      slope: m of the S-N curve, e.g. 10 for glass fibre, 4 for welded steel.
      f_eq: [Hz] of the equivalent load.
      bins: number of bins for the ranges; none by default.

    Raises:
      InputError: ``duration``, ``slope``, ``f_eq`` or ``bins`` is not positive.
    """
    if bins is not None and bins < 1:
        raise InputError(f"damage_equivalent_load: bins must be at least 1, found {bins!r}")
    ranges, _, counts = rainflow_cycles(series)
    if bins is not None and len(ranges):
        width = ranges.max() / bins
        ranges = np.ceil(ranges / width - 1e-12) * width
    return equivalent_range(ranges, counts, duration=duration, slope=slope, f_eq=f_eq)


def usual_slope(channel: Channel) -> float | None:
    """Customary S-N slope of a channel: 10 for blades, 4 for steel, None if it is not a load."""
    if channel.unit not in ("N", "N m"):
        return None
    return 10.0 if channel.name.lower().startswith(("root", "station", "spn")) else 4.0  # Spn: OpenFAST's stations


def equivalent_loads(
    result: Result,
    names: Sequence[str] | None = None,
    f_eq: float = 1.0,
    *,
    slopes: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Damage-equivalent loads of the load channels of a result, without its initial transient, in SI units.

    Args:
      names: of the channels; by default all loads.
      f_eq: [Hz] of the equivalent load.
      slopes: m of the S-N curve by channel; for others 10 for blades, 4 for everything else. A channel that is no load
        takes part if it has one.

    Raises:
      InputError: a name is unknown, or ``f_eq`` or a slope is not positive.
    """
    given = {result.channel(name).name: m for name, m in (slopes or {}).items()}
    found: dict[str, float] = {}
    result = result.evaluated
    if len(result.time) < 2:
        return found
    duration = float(result.time[-1] - result.time[0])
    for channel in result.channels if names is None else [result.channel(name) for name in names]:
        slope = given.get(channel.name, usual_slope(channel))
        if slope is not None:
            found[channel.name] = damage_equivalent_load(
                result[channel.name], duration=duration, slope=slope, f_eq=f_eq
            )
    return found
