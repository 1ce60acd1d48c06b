"""``meltemi view``: results and winds in three dimensions, as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import meltemi
from meltemi.app.terminal import suggest, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.simulation.result import Result
    from meltemi.wind.fields import Wind

ThemeOption = Annotated[Literal["light", "dark"] | None, "light or dark [that of the reader's system]."]


def view(
    files: Annotated[
        list[Path], "Result (.nc) or output folder of a run or farm with --view; two to compare; or a wind file."
    ],
    out: Annotated[Path, "--out", "-o", "HTML file to write."] = Path("turbine.html"),
    channels: Annotated[tuple[str, ...], "Channels to plot, separated by commas [main loads and signals]."] = (),
    theme: ThemeOption = None,
) -> None:
    """Show a result, two results or a wind in three dimensions, in one HTML file for any browser."""
    if len(files) > 2:
        raise InputError(f"a view shows one or two results, found {len(files)}")
    if len(files) == 1 and (turbines := sorted(files[0].glob("turbine_*.nc"), key=_number)):
        files = turbines  # of a farm
    from meltemi.view.view import result_view, wind_view

    look, inputs = meltemi.plots.Look(theme=theme or ""), [_read(path) for path in files]
    results = {name: r for name, r in zip(_names(files), inputs, strict=True) if isinstance(r, meltemi.Result)}
    if len(results) == len(inputs):
        wrote(result_view(results, channels, look).write(out))
        if len(files) == 2:
            suggest("diff", *(path / "result.nc" if path.is_dir() else path for path in files))
        elif channels:
            suggest("channels")
        else:
            suggest("view", files[0], "--channels", "RootMyc1,TwrBsMyt", "--out", out)
        return
    winds = [r for r in inputs if not isinstance(r, meltemi.Result)]
    if len(inputs) > 1:
        raise InputError(f"{files[inputs.index(winds[0])]}: a wind is viewed alone; leave the other file out")
    if channels:
        raise InputError("--channels: only available for results; leave it out")
    wrote(wind_view(winds[0], look).write(out))
    suggest("run", "nrel5mw", "--wind-file", files[0], "--view", "--out", out.with_suffix(""))


def _number(path: Path) -> int:
    digits = path.stem.rpartition("_")[2]
    return int(digits) if digits.isdigit() else 0


def _names(files: list[Path]) -> list[str]:
    """Names of the results: those of the files or, where these are equal, of their folders, or both."""
    names = [path.stem for path in files]
    if len(set(names)) < len(names):
        names = [(path if path.is_dir() else path.absolute().parent).name for path in files]
    if len(set(names)) < len(names):
        names = [f"{(path if path.is_dir() else path.parent).name}/{path.stem}" for path in files]
    return names if len(set(names)) == len(names) else [f"{i + 1}: {name}" for i, name in enumerate(names)]


def _read(path: Path) -> Result | Wind:
    """Read a result or a wind file.

    Raises:
      InputError: the file is neither.
    """
    from meltemi.wind_files.formats import FORMATS

    path = path / "result.nc" if path.is_dir() else path
    suffixes = {f.suffix for f in FORMATS} - {".csv"}
    if path.suffix.lower() not in suffixes:
        return meltemi.read_result(path)
    if path.suffix.lower() != ".nc":
        return meltemi.read_wind(path)
    try:
        return meltemi.read_result(path)
    except InputError as error:
        try:
            return meltemi.read_wind(path)
        except InputError:
            raise error from None
