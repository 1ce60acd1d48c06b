"""Damage-equivalent loads of series and results.

* Ranges are not binned unless ``bins`` is given; then every cycle has the range of its bin's upper edge.
* Cycles are not corrected for their mean (Goodman).
* Equivalent load: DEL = (sum_i n_i S_i^m / N_eq)^(1/m) with N_eq = f_eq T: a load of constant range, f_eq
  times a second, that does the same damage. f_eq is 1 Hz unless said otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.errors import InputError
from meltemi.postprocess.cycles import Residue, cycle_load, rainflow_cycles
from meltemi.postprocess.inputs import one_row, positive, whole
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result


def check_equivalent(duration: float, slope: float, f_eq: float) -> None:
    """Refuse numbers of an equivalent load that are not positive."""
    for name, value in (("duration", duration), ("slope", slope), ("f_eq", f_eq)):
        positive(value, f"damage_equivalent_load: {name}")


def damage_equivalent_load(
    series: ArrayLike,
    *,
    duration: float,
    slope: float,
    f_eq: float = 1.0,
    bins: int | None = None,
    residue: Residue = "half",
) -> float:
    """Damage-equivalent load (a range), in the unit of the series.

    Args:
      series: (T,) values.
      duration: [s] duration of the series.
      slope: m of the S-N curve, e.g. 10 for glass fibre, 4 for welded steel.
      f_eq: [Hz] frequency of the equivalent load.
      bins: number of bins for the ranges; none by default.
      residue: "half" cycles, or those of the series "repeated": see :func:`rainflow_cycles`.

    Raises:
      InputError: ``duration``, ``slope``, ``f_eq`` or ``bins`` is not positive, or there are fewer than two values or
        some that are not finite.
    """
    check_equivalent(duration, slope, f_eq)
    n = None if bins is None else whole(bins, "damage_equivalent_load: bins")
    cycles = rainflow_cycles(one_row(series, "damage_equivalent_load", least=2), residue)
    if n is not None and len(cycles.ranges):
        width = cycles.ranges.max() / n
        cycles = cycles._replace(ranges=np.ceil(cycles.ranges / width - 1e-12) * width)
    return cycle_load(cycles, slope=slope, reference=f_eq * duration)


def usual_slope(channel: Channel) -> float | None:
    """Customary S-N slope of a channel: 10 for blades, 4 for steel, 3 for chains of mooring lines, None if no load."""
    name = channel.name.lower()
    if channel.unit not in ("N", "N m"):
        return None
    chain = name.startswith(("line_", "fairten", "anchten"))  # DNV-OS-E301, 2.2.1: m = 3
    return 10.0 if name.startswith(("root", "station", "spn")) else 3.0 if chain else 4.0  # Spn: OpenFAST's stations


def equivalent_loads(
    result: Result, names: Sequence[str] | None = None, f_eq: float = 1.0, *, slopes: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Damage-equivalent loads of the load channels of a result, without its initial transient, in SI units.

    Args:
      names: names of the channels; by default all loads.
      f_eq: [Hz] frequency of the equivalent load.
      slopes: m of the S-N curve by channel, else the usual one; a channel that is no load takes part if it has one.

    Raises:
      InputError: a name is unknown, ``f_eq`` or a slope is not positive, or there are less than two samples.
    """
    given = {result.channel(name).name: m for name, m in (slopes or {}).items()}
    loads: dict[str, float] = {}
    result = result.evaluated
    if len(result.time) < 2:
        raise InputError("equivalent_loads: the result has one sample; at least two are needed")
    duration = float(result.time[-1] - result.time[0])
    for channel in result.channels if names is None else [result.channel(name) for name in names]:
        slope = given.get(channel.name, usual_slope(channel))
        if slope is not None:
            loads[channel.name] = damage_equivalent_load(
                result[channel.name], duration=duration, slope=slope, f_eq=f_eq
            )
    return loads
