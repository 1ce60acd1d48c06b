"""Wind roses: probabilities of wind directions and speeds, from tables of FLORIS, windIO and PyWake.

Directions are those of maps, from which the wind blows, clockwise from north; a farm has x to the east, y to the north.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.core.files import text_of
from meltemi.core.yamlfile import parse, read_text

Float = NDArray[np.float64]
COLUMNS = {
    "wd": ("wd", "wind_direction", "wind_directions"),
    "ws": ("ws", "wind_speed", "wind_speeds"),
    "probability": ("freq_val", "freq", "frequency", "probability", "P"),
    "ti": ("ti", "turbulence_intensity", "turbulence_intensities"),
}
"""Columns of a table, and their names in other programs."""
SPEEDS = tuple(float(x) for x in range(4, 26, 2))
"""[m/s] speeds of a rose of Weibull distributions by default."""
EAST = 270.0
"""[deg] direction on a map of the wind along x."""


@dataclass(frozen=True)
class WindRose:
    """Probabilities of the wind.

    Attributes:
      directions: (wd,) [deg] from which the wind blows, clockwise from north, increasing.
      speeds: (ws,) [m/s] wind speeds, increasing.
      probability: (wd, ws) probabilities; their sum is 1, or less where speeds without energy are left out.
      intensity: (wd, ws) turbulence intensities, or None.
    """

    directions: Float
    speeds: Float
    probability: Float
    intensity: Float | None = None

    def bins(self) -> Iterator[tuple[int, int]]:
        """Indices of direction and speed of all bins with a probability."""
        return ((int(i), int(j)) for i, j in np.argwhere(self.probability > 0.0))


def farm_direction(map_direction: float) -> float:
    """[rad] direction of a wind in a farm, within half a turn, of its direction [deg] on a map."""
    return math.remainder(math.radians(map_direction - EAST), 2.0 * math.pi)


def read_rose(path: str | Path, speeds: Sequence[float] = SPEEDS) -> WindRose:
    """Read a wind rose: long table of FLORIS (.csv), wind resource of windIO (.yaml), site of PyWake (.nc).

    Args:
      path: file.
      speeds: [m/s] centres of equally wide bins for Weibull distributions; tables have theirs.

    Raises:
      InputError: with file, key, and what was expected.
    """
    file = Path(path)
    readers = {".csv": _table, ".yaml": _resource, ".yml": _resource, ".nc": _site}
    if file.suffix.lower() not in readers:
        raise InputError(
            f"{file}: expected a wind rose: table of FLORIS (.csv), resource of windIO (.yaml), site of PyWake (.nc)"
        )
    return _checked(file, readers[file.suffix.lower()](file, np.array(speeds, dtype=np.float64)))


def _table(file: Path, _: Float) -> WindRose:
    """A row for each bin: wd, ws, freq_val and perhaps ti, as ``WindRose.read_csv_long`` of FLORIS reads them."""
    rows = list(csv.DictReader(text_of(file).removeprefix("\ufeff").splitlines(), skipinitialspace=True))
    heads = [str(name).strip() for name in (rows[0] if rows else {})]
    columns: dict[str, list[float]] = {}
    for name, names in COLUMNS.items():
        head = next((each for each in names if each in heads), None)
        if head is None and name == "ti":
            continue
        if head is None:
            raise InputError(f"{file}: expected a column {' or '.join(names)}; {did_you_mean(names[0], heads)}")
        try:
            columns[name] = [float(row[head]) for row in rows]
        except (TypeError, ValueError):
            raise InputError(f"{file}: column {head}: expected a number in each row") from None
    directions, i = np.unique(columns["wd"], return_inverse=True)
    speeds, j = np.unique(columns["ws"], return_inverse=True)
    tables = {name: np.zeros((len(directions), len(speeds))) for name in columns}
    if len({*zip(i.tolist(), j.tolist(), strict=True)}) < len(rows):
        raise InputError(f"{file}: a wind direction and speed appear twice, expected a row for each")
    for name, table in tables.items():
        table[i, j] = columns[name]
    return WindRose(directions, speeds, tables["probability"], tables.get("ti"))


def _resource(file: Path, speeds: Float) -> WindRose:
    """``wind_resource`` of windIO: a table of probabilities, or Weibull distributions by sector."""
    data = parse(read_text(file), file, "a wind resource of windIO")
    for key in ("site", "energy_resource"):
        data = data[key] if isinstance(data.get(key), dict) else data
    found = data.get("wind_resource", data)
    if not (isinstance(found, dict) and "wind_direction" in found):
        raise InputError(f"{file}: expected wind_resource with wind_direction; {did_you_mean('wind_resource', data)}")
    return _gridded(file, found, speeds)


def _site(file: Path, speeds: Float) -> WindRose:
    """Data set of a uniform site of PyWake: P by wd and ws, or Sector_frequency, Weibull_A and Weibull_k by wd."""
    need("a wind rose of netCDF", "xarray")
    import xarray as xr

    names = {"P": "probability", "Sector_frequency": "sector_probability", "Weibull_A": "weibull_a"}
    names |= {"Weibull_k": "weibull_k", "TI": "turbulence_intensity"}
    try:
        with xr.open_dataset(file) as site:
            axes = {"wind_direction": site["wd"].values.tolist()}
            axes |= {"wind_speed": site["ws"].values.tolist()} if "ws" in site and site["ws"].ndim else {}
            content = {
                ours: {"data": site[name].values.tolist(), "dims": list(map(str, site[name].dims))}
                for name, ours in names.items()
                if name in site
            }
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{file}: expected a site of PyWake with wd: {error}") from None
    return _gridded(file, axes | content, speeds)


def _gridded(file: Path, found: dict[str, Any], speeds: Float) -> WindRose:
    """A rose of arrays with named dimensions."""
    directions = _array(file, found, "wind_direction")
    size = len(directions)
    if "sector_probability" in found and "probability" not in found:
        share, scale, shape = (
            np.broadcast_to(_array(file, found, name), (size,))[:, None]
            for name in ("sector_probability", "weibull_a", "weibull_k")
        )
        width = float(speeds[1] - speeds[0]) if len(speeds) > 1 else 1.0
        more, less = (np.exp(-((np.maximum(speeds + w * width, 0.0) / scale) ** shape)) for w in (-0.5, 0.5))
        probability = share * (more - less)
    else:
        speeds, probability = _array(file, found, "wind_speed"), _array(file, found, "probability")
    intensity = None
    if "turbulence_intensity" in found:
        given = _array(file, found, "turbulence_intensity")
        along = given.ndim == 1 and _dims(found["turbulence_intensity"]) == ["wd"]
        intensity = np.array(np.broadcast_to(given[:, None] if along else given, (size, len(speeds))))
    if directions[-1] - directions[0] == 360.0:  # PyWake repeats the first sector
        directions, probability = directions[:-1], probability[:-1]
        intensity = None if intensity is None else intensity[:-1]
    return WindRose(directions, speeds, probability, intensity)


def _array(file: Path, found: dict[str, Any], name: str) -> Float:
    """An array of a resource, directions first; also without dimensions."""
    given = found.get(name)
    try:
        bare: Any = given["data"] if isinstance(given, dict) else given
        values = np.array(0.0 + bare if np.ndim(bare) == 0 else bare, dtype=np.float64)
    except (TypeError, ValueError, KeyError):
        words = f"expected numbers, found {str(given)[:60]}; {did_you_mean(name, found)}"
        raise InputError(f"{file}: {name}: {words}") from None
    return values.T if _dims(given)[:1] == ["ws"] and values.ndim == 2 else values


def _dims(given: Any) -> list[str]:
    """Dimensions of an array of a resource by the names of PyWake."""
    names = given.get("dims") if isinstance(given, dict) else None
    names = [names] if isinstance(names, str) else names or []
    return [{"wind_direction": "wd", "wind_speed": "ws"}.get(str(name), str(name)) for name in names]


def _checked(file: Path, rose: WindRose) -> WindRose:
    """The rose, if its probabilities can be those of a wind.

    Raises:
      InputError: they cannot.
    """
    shape, p = (len(rose.directions), len(rose.speeds)), rose.probability
    if p.shape != shape:
        raise InputError(f"{file}: probability: expected {shape[0]} directions x {shape[1]} speeds, found {p.shape}")
    if not (np.all(np.isfinite(p)) and np.all(p >= 0.0) and 0.0 < p.sum() <= 1.01):
        raise InputError(f"{file}: expected probabilities with a sum of at most 1, found {p.sum():.4g}: not percent")
    if np.any(np.diff(rose.directions) <= 0.0) or np.any(np.diff(rose.speeds) <= 0.0) or not np.all(rose.speeds > 0.0):
        raise InputError(f"{file}: expected increasing wind directions, and increasing speeds above 0")
    return rose
