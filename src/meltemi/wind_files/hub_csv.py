"""Hub-height wind as comma-separated values (``.csv``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.csvfile import read_columns, write_columns
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import validated
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import HubSeries
from meltemi.wind_files.common import middle

NAMES = {"u": "u", "v": "v", "w": "w", "wind_x": "u", "wind_y": "v", "wind_z": "w"}
"""Components by the names of columns: their symbols, or the channels of a result."""


def read_hub_csv(path: str | Path) -> HubSeries:
    """Read measured hub-height wind: columns ``time [s]``, ``u [m/s]`` and optionally ``v [m/s]``, ``w [m/s]``.

    ``wind_x``, ``wind_y`` and ``wind_z``, the channels of a run, are read as well.

    Raises:
      InputError: the file is missing or a line cannot be read; the message names the line.
    """
    path = Path(path)
    heads, data = read_columns(path)
    columns = {"time": data[:, 0]}
    for (name, unit), x in zip(heads[1:], data.T[1:], strict=True):
        if name not in NAMES:
            raise InputError(f"{path}: unknown column {name!r}; {did_you_mean(name, NAMES)}")
        if unit != "m/s":
            raise InputError(f"{path}: {name} is in {unit!r}, expected 'm/s'")
        if NAMES[name] in columns:
            raise InputError(f"{path}: the component {NAMES[name]!r} appears twice")
        columns[NAMES[name]] = x
    if "u" not in columns:
        raise InputError(f"{path}: no column 'u [m/s]'; expected time, u and optionally v, w")
    return validated(columns, HubSeries, str(path))


def write_hub_csv(wind: WindBox | HubSeries, path: str | Path) -> list[Path]:
    """Write hub-height wind, with the units in the header.

    Of a box it is the wind of each plane at its hub height (the middle of the grid if missing), in the middle of
    its width, linear between grid points, in the axes of the box. The time is that at which the plane passes the
    tower in a run: planes that are downwind of the tower at the start of the run have negative times.

    Returns:
      The path.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    series = hub_series(wind) if isinstance(wind, WindBox) else wind
    columns = {name: x for name in "uvw" if (x := getattr(series, name)) is not None}
    heads = [("time", "s"), *((name, "m/s") for name in columns)]
    return [write_columns(path, heads, np.column_stack([series.time, *columns.values()]))]


def hub_series(box: WindBox, height: float | None = None) -> HubSeries:
    """The hub-height wind of a box, at the times at which its planes pass the tower.

    Args:
      box: wind box.
      height: [m] height; by default the hub height of the box or, if missing, that of the middle of its grid.

    Raises:
      InputError: the height is outside the box.
    """
    z = middle(box) if height is None else height
    if not box.bottom <= z <= box.top:
        raise InputError(f"{box.label}: a height of {z:g} m is outside the box, {box.bottom:g} to {box.top:g} m")
    rows, columns = box.velocity.shape[1:3]
    k = min(int((z - box.bottom) / box.dz), rows - 2)
    j = min((columns - 1) // 2, columns - 2)
    b, d = 0.5 * (columns - 1) - j, (z - box.bottom) / box.dz - k
    corners: NDArray[np.float64] = box.velocity[:, k : k + 2, j : j + 2].astype(float)
    at_hub = np.einsum("tkjc,k,j->tc", corners, [1.0 - d, d], [1.0 - b, b])
    return HubSeries(time=np.round(box.passing, 9), u=at_hub[:, 0], v=at_hub[:, 1], w=at_hub[:, 2])
