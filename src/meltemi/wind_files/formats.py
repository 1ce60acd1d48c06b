"""Formats of wind files: the table, reading and writing by it. How to add one: docs/development/file-formats.md."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.core.errors import InputError
from meltemi.core.files import reading
from meltemi.core.formats import FileFormat, with_name, with_suffix

if TYPE_CHECKING:
    from meltemi.wind.fields import WindBox, WindSeries
    from meltemi.wind.turbulent import HubSeries
    from meltemi.wind_files.hawc2 import Hawc2Grid


@dataclass(frozen=True)
class WindFormat(FileFormat):
    """One format of wind files; the note names programs that read it.

    Attributes:
      holds: classes that can be written, by name.
      lacks_grid: its files do not contain the grid, which is the second argument of the reader.
      no_wind: why ``read_wind`` rejects its files, and what to do instead; empty if it reads them.
    """

    holds: tuple[str, ...] = ("WindBox",)
    lacks_grid: bool = False
    no_wind: str = ""

    @property
    def title(self) -> str:
        """Text and suffix, for messages."""
        return f"{self.text} ({self.suffix})"


def _row(name: str, suffix: str, text: str, functions: str, note: str, **more: Any) -> WindFormat:
    module, read, write = f"meltemi.wind_files.{name}", f"read_{functions}", f"write_{functions}"
    return WindFormat(name=name, suffix=suffix, text=text, module=module, reader=read, writer=write, note=note, **more)


BLADED = tuple(first.to_bytes(2, "little", signed=True) for first in (-99, -1, -2, -3))
HUB = "contains hub-height wind only: read it with meltemi.io.read_hub_csv, and pass it as hub_series to "
FORMATS = (
    _row("bts", ".bts", "TurbSim full field", "bts", "OpenFAST (WindType 3), FAST.Farm"),
    _row("bladed", ".wnd", "Bladed-style full field with its .sum", "bladed", "OpenFAST (WindType 4)", begins=BLADED),
    _row("uniform", ".wnd", "uniform wind as text", "wnd", "OpenFAST (WindType 2)", holds=("WindSeries",)),
    _row("hawc2", ".bin", "HAWC2 turbulence box", "hawc2", "HAWC2, OpenFAST (WindType 5)", lacks_grid=True),
    _row("netcdf", ".nc", "netCDF4", "wind_netcdf", "xarray, any program for netCDF4"),
    _row(
        *("hub_csv", ".csv", "wind at the hub", "hub_csv", "spreadsheets"),
        holds=("WindBox", "HubSeries"),
        no_wind=f"{HUB}meltemi.TurbulentWind",
    ),
)
"""All formats. Where several have one suffix, the first that fits the content is read, and the first that holds the
wind is written."""
WINDS = tuple(f for f in FORMATS if not f.no_wind)
"""Formats that :func:`read_wind` reads."""


def read_wind(path: str | Path, grid: Hawc2Grid | None = None) -> WindBox | WindSeries:
    """Read a wind file; suffix and content determine the format: ``.bts``, ``.wnd``, ``.bin``, ``.nc``.

    A ``.wnd`` file is a Bladed-style field if it begins with the number -99 in 16 bits, else uniform wind as text.
    Wind at the hub (``.csv``) is no wind by itself: see :func:`read_hub_csv`.

    Args:
      path: wind file; for a HAWC2 box any of the three files.
      grid: grid of HAWC2 files without a ``.hawc2.yaml`` in their folder; these may be without suffix, as ``NAME_u``.

    Raises:
      InputError: the format is unknown, or the file is missing, damaged or of another format.
    """
    path = Path(path)
    named = grid is None or path.suffix.lower() in {f.suffix for f in FORMATS}
    candidates = with_suffix(FORMATS, path, "wind file") if named else [f for f in FORMATS if f.lacks_grid]
    if grid is not None and not candidates[0].lacks_grid:
        those = ", ".join(f.title for f in FORMATS if f.lacks_grid)
        raise InputError(f"{path}: grid= applies to {those} only, this is a {candidates[0].title}")
    if candidates[0].no_wind:
        raise InputError(f"{path}: {candidates[0].no_wind}")
    if len(candidates) > 1:
        with reading(path) as (file, _):
            begin = file.read(16)
        candidates = [f for f in candidates if f.fits(begin)]
    wind: WindBox | WindSeries = (
        candidates[0].read(path, grid) if candidates[0].lacks_grid else candidates[0].read(path)
    )
    return wind


def write_wind(wind: WindBox | WindSeries | HubSeries, path: str | Path, format: str | None = None) -> list[Path]:  # noqa: A002
    """Write a wind file, atomically.

    Args:
      wind: a box, or a series (``.wnd``), or wind at the hub (``.csv``).
      path: the suffix tells the format: ``.bts``, ``.wnd`` (a box: Bladed-style, a series: uniform wind), ``.bin``,
        ``.nc``, ``.csv`` (of a box the wind at its hub).
      format: name of the format, in place of the suffix: bts, bladed, uniform, hawc2, netcdf, hub_csv.

    Returns:
      Paths of all files that were written.

    Raises:
      InputError: the format is unknown or does not support the wind, or a file cannot be written.
    """
    path = Path(path)
    kind = "wind file"
    candidates = with_suffix(FORMATS, path, kind) if format is None else [with_name(FORMATS, format, kind)]
    for one in candidates:
        if type(wind).__name__ in one.holds:
            written: list[Path] = one.write(wind, path)
            return written
    able = ", ".join(f"{f.suffix} ({f.text})" for f in FORMATS if type(wind).__name__ in f.holds)
    every = list(dict.fromkeys(name for f in FORMATS for name in f.holds))
    raise InputError(
        f"{path}: {candidates[0].title} cannot store a {type(wind).__name__}; "
        + (f"one is written as {able}" if able else f"only {', '.join(every[:-1])} and {every[-1]} are written")
    )
