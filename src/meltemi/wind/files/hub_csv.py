"""Hub-height wind as comma-separated values (``.csv``)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import validated
from meltemi.wind.fields import WindBox
from meltemi.wind.files.common import is_number, middle, replacing, text_of
from meltemi.wind.turbulent import HubSeries

UNITS = {"time": ("s", "sec", "seconds"), "u": ("m/s",), "v": ("m/s",), "w": ("m/s",)}
NAMES = {"t": "time"}
HEADING = re.compile(r"(?P<name>[^\[(]*)(?:[\[(](?P<unit>[^\])]*)[\])])?")


def read_hub_csv(path: str | Path) -> HubSeries:
    """Read measured hub-height wind: columns ``time [s]``, ``u [m/s]`` and optionally ``v [m/s]``, ``w [m/s]``.

    Columns are in any order below a line of names; units in brackets are checked if present. Without names the
    columns are time, u, v, w. They are separated by commas, semicolons (numbers may then have decimal commas) or
    blanks. Empty lines and those that begin with ``#``, ``!`` or ``%`` are skipped.

    Raises:
      InputError: the file is missing or a line cannot be read; the message names the line.
    """
    path = Path(path)
    names: list[str] = []
    rows: list[list[float]] = []
    for number, line in enumerate(text_of(path).splitlines(), 1):
        if not line.strip() or line.lstrip()[0] in "#!%":
            continue
        cells = _cells(line)
        if not names:
            named = any(re.match(r"\s*[^\W\d]", cell) and not is_number(cell) for cell in cells)
            names = _names(line, f"{path}:{number}") if named else ["time", "u", "v", "w"][: len(cells)]
            if len(names) < 2 or (not named and len(cells) > 4):
                raise InputError(f"{path}:{number}: expected time, u and optionally v, w, found {line.strip()[:60]!r}")
            if named:
                continue
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise InputError(f"{path}:{number}: expected numbers, found {line.strip()[:60]!r}") from None
        if len(cells) != len(names):
            raise InputError(f"{path}:{number}: expected {len(names)} numbers, found {len(cells)}")
    if not rows:
        raise InputError(f"{path}: no rows of wind; expected a line 'time [s],u [m/s],v [m/s],w [m/s]' and numbers")
    return validated(dict(zip(names, np.array(rows).T, strict=True)), HubSeries, str(path))


def write_hub_csv(wind: WindBox | HubSeries, path: str | Path) -> list[Path]:
    """Write hub-height wind, with the units in the header.

    Of a box it is the wind of each plane at its hub height (the middle of the grid for want of it), in the middle of
    its width, linear between grid points, in the axes of the box. The time is that at which the plane passes the
    tower in a run: the planes that stand downwind of the tower when the run begins have negative times.

    Returns:
      The path.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    series = hub_series(wind) if isinstance(wind, WindBox) else wind
    columns = {"time [s]": series.time}
    for name in ("u", "v", "w"):
        if (values := getattr(series, name)) is not None:
            columns[f"{name} [m/s]"] = values
    rows = (",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True))
    with replacing(path) as (partial,):
        partial.write_text("\n".join([",".join(columns), *rows, ""]), encoding="utf-8")
    return [path]


def hub_series(box: WindBox, height: float | None = None) -> HubSeries:
    """The hub-height wind of a box, at the times at which its planes pass the tower.

    Args:
      box: any.
      height: [m]; by default the hub height of the box or, for want of it, that of the middle of its grid.

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


def _cells(line: str) -> list[str]:
    """Split a line into cells; the separator is detected."""
    if ";" in line:
        return [cell.strip(' "').replace(",", ".") for cell in line.strip().rstrip(";").split(";")]
    if "," in line:
        return [cell.strip(' "') for cell in line.strip().rstrip(",").split(",")]
    return [cell.strip('"') for cell in line.split()]


def _names(line: str, where: str) -> list[str]:
    """Names of the columns."""
    joined = re.sub(r"\s+(?=[\[(])", "", line)  # a blank before the unit separates nothing
    names: list[str] = []
    for cell in _cells(joined):
        match = HEADING.fullmatch(cell)
        name = match["name"].strip().lower() if match else cell
        name = NAMES.get(name, name)
        if match is None or name not in UNITS:
            raise InputError(f"{where}: unknown column {cell!r}; {did_you_mean(name, UNITS)}")
        unit = match["unit"]
        if unit is not None and unit.strip() not in UNITS[name]:
            raise InputError(f"{where}: {name} is in {unit.strip()!r}, expected {UNITS[name][0]!r}")
        if name in names:
            raise InputError(f"{where}: the column {name!r} appears twice")
        names.append(name)
    for name in ("time", "u"):
        if name not in names:
            raise InputError(f"{where}: no column {name!r}; expected 'time [s]', 'u [m/s]' and optionally v, w")
    return names
