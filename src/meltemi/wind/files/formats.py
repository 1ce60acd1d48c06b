"""Formats of wind files, and their detection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError, did_you_mean
from meltemi.wind.fields import WindBox, WindSeries
from meltemi.wind.files.bladed import read_bladed, write_bladed
from meltemi.wind.files.bts import read_bts, write_bts
from meltemi.wind.files.common import reading
from meltemi.wind.files.hawc2 import Hawc2Grid, read_hawc2, write_hawc2
from meltemi.wind.files.hub_csv import read_hub_csv, write_hub_csv
from meltemi.wind.files.netcdf import read_wind_netcdf, write_wind_netcdf
from meltemi.wind.files.uniform import read_wnd, write_wnd
from meltemi.wind.turbulent import HubSeries


@dataclass(frozen=True)
class WindFormat:
    """One format of wind files.

    Attributes:
      name, suffix: by which it is asked for.
      text: what it is.
      holds: records that can be written.
      read, write: the functions.
    """

    name: str
    suffix: str
    text: str
    holds: tuple[type, ...]
    read: Callable[..., Any]
    write: Callable[..., list[Path]]


FORMATS = (
    WindFormat("bts", ".bts", "TurbSim full field", (WindBox,), read_bts, write_bts),
    WindFormat("bladed", ".wnd", "Bladed-style full field with its .sum", (WindBox,), read_bladed, write_bladed),
    WindFormat("uniform", ".wnd", "uniform wind as text", (WindSeries,), read_wnd, write_wnd),
    WindFormat("hawc2", ".bin", "turbulence box of HAWC2", (WindBox,), read_hawc2, write_hawc2),
    WindFormat("netcdf", ".nc", "netCDF4", (WindBox,), read_wind_netcdf, write_wind_netcdf),
    WindFormat("hub_csv", ".csv", "wind at the hub", (WindBox, HubSeries), read_hub_csv, write_hub_csv),
)
"""All formats; where two have one suffix, the content decides."""


def read_wind(path: str | Path, grid: Hawc2Grid | None = None) -> WindBox | WindSeries:
    """Read a wind file; the suffix determines the format: ``.bts``, ``.wnd``, ``.bin``, ``.nc``.

    A ``.wnd`` file is a Bladed-style field if it begins with the number -99 in 16 bits, else uniform wind as text.
    Wind at the hub (``.csv``) is no wind by itself: see :func:`read_hub_csv`.

    Args:
      path: of the file; of a box of HAWC2 any of the three.
      grid: for HAWC2 files without a ``.hawc2.yaml`` in their folder.

    Raises:
      InputError: there is no such format, or the file is missing, damaged or of another kind.
    """
    path = Path(path)
    found = _by_suffix(path)
    if grid is not None and found[0].name != "hawc2":
        raise InputError(f"{path}: grid= applies to HAWC2 files (.bin) only, this is a {found[0].text} ({path.suffix})")
    if found[0].name == "hub_csv":
        raise InputError(
            f"{path}: contains hub-height wind only: read it with meltemi.io.read_hub_csv, and pass it as hub_series "
            "to meltemi.TurbulentWind"
        )
    if found[0].name == "hawc2":
        return read_hawc2(path, grid)
    if path.suffix.lower() == ".wnd":
        with reading(path) as (file, _):
            first = int.from_bytes(file.read(2), "little", signed=True)
        return read_bladed(path) if first in (-99, -1, -2, -3) else read_wnd(path)
    return found[0].read(path)


def write_wind(wind: WindBox | WindSeries | HubSeries, path: str | Path, format: str | None = None) -> list[Path]:  # noqa: A002
    """Write a wind file, atomically.

    Args:
      wind: a box, or a series (``.wnd``), or wind at the hub (``.csv``).
      path: the suffix tells the format: ``.bts``, ``.wnd`` (a box: Bladed-style, a series: uniform wind), ``.bin``,
        ``.nc``, ``.csv`` (of a box the wind at its hub).
      format: its name instead: bts, bladed, uniform, hawc2, netcdf, hub_csv.

    Returns:
      Paths of all files that were written.

    Raises:
      InputError: there is no such format, it does not hold such a wind, or a file cannot be written.
    """
    path = Path(path)
    if format is None:
        found = _by_suffix(path)
    else:
        found = [f for f in FORMATS if f.name == format]
        if not found:
            raise InputError(f"unknown wind file format {format!r}; {_hint(format, [f.name for f in FORMATS])}")
    for one in found:
        if isinstance(wind, one.holds):
            return one.write(wind, path)
    able = ", ".join(f"{f.suffix} ({f.text})" for f in FORMATS if isinstance(wind, f.holds))
    raise InputError(
        f"{path}: {found[0].text} ({found[0].suffix}) cannot store a {type(wind).__name__}; "
        + (f"one is written as {able}" if able else "only WindBox, WindSeries and HubSeries are written")
    )


def _by_suffix(path: Path) -> list[WindFormat]:
    """Formats with the suffix of a path."""
    found = [f for f in FORMATS if f.suffix == path.suffix.lower()]
    if not found:
        raise InputError(
            f"{path}: {path.suffix or 'a name without suffix'!r} is not the suffix of a wind file; "
            f"{_hint(path.suffix, [f.suffix for f in FORMATS])}"
        )
    return found


def _hint(name: str, valid: list[str]) -> str:
    """Hint with the closest and all valid names."""
    valid = list(dict.fromkeys(valid))
    near = did_you_mean(name, valid)
    return f"{near} " * near.startswith("did") + f"supported are {', '.join(valid)}"
