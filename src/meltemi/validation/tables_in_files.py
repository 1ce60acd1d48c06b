"""Tables in files of measurements: CSV, Parquet, netCDF, MATLAB 5 and 7.3, and data frames of pandas.

Columns are read by the file's suffix; the channel map makes times and SI values of them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.core.files import bytes_of, reading, text_of
from meltemi.core.formats import hint
from meltemi.core.hdf5 import attributes, read_hdf5
from meltemi.validation.channel_map import Logger, Sensor, Statistic, TimeStamps

if TYPE_CHECKING:
    import h5py

Columns = dict[str, NDArray[Any]]  # (T,) numbers, or texts and dates of time stamps, by the name of the column
Float = NDArray[np.float64]
DATENUM_1970 = 719529.0  # MATLAB's day number of 1970-01-01
LARGEST = 1_000_000_000  # [bytes] of a file
MATLAB_HEAD = 512  # [bytes] in front of the HDF5 part of a MAT file of version 7.3
NUMBER = re.compile(r'\s*"?\s*[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?\s*"?\s*')


def read_tables(folder: Path, key: str, logger: Logger) -> dict[str, Columns]:
    """Columns of all files of a logger in a folder, or of one file; ``key`` of the logger is for messages.

    A file for each statistic makes one table, of columns such as ``mean/P``, and those of the first file for its times.

    Raises:
      InputError: there are no files; or as of :func:`read_columns_of`.
    """
    if logger.statistics:
        tables = {statistic: read_columns_of(folder / name) for statistic, name in logger.statistics.items()}
        first = next(iter(logger.statistics))
        prefixed = {f"{statistic}/{name}": x for statistic, table in tables.items() for name, x in table.items()}
        return {logger.statistics[first]: {**tables[first], **prefixed}}
    paths = [folder] if folder.is_file() else sorted(path for path in folder.glob(logger.files) if path.is_file())
    if not paths:
        others = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
        raise InputError(f"{folder}: no file {logger.files!r} of logger {key!r}; it has {others or 'no files'}")
    return {path.name: read_columns_of(path) for path in paths}


def read_columns_of(path: Path) -> Columns:
    """All columns of a file, by its suffix.

    Raises:
      InputError: the file is missing, damaged, or of no known format.
      MissingPackageError: pandas, or pyarrow for Parquet, is not installed.
    """
    need("a file of measurements", "pandas")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise InputError(f"{path}: {suffix!r} is not the suffix of a file of measurements; {hint(suffix, READERS)}")
    try:
        return READERS[suffix](path)
    except InputError:
        raise
    except Exception as error:  # packages raise anything on damaged files
        reason = next(iter(str(error).splitlines()), "")[:100]
        raise InputError(f"{path}: not a {suffix} file, or damaged ({type(error).__name__}: {reason})") from None


def read_csv(path: Path) -> Columns:
    """Columns of a text: a row of names, rows of units or the like without numbers, rows of numbers.

    Separators are tabulators, semicolons (also with decimal commas) or commas. Rows that begin with # are skipped, and
    so is the first row of a TOA5 file.
    """
    import pandas as pd

    lines = [line for line in text_of(path, LARGEST).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    lines = lines[1:] if lines and lines[0].lstrip('"').startswith("TOA5") else lines
    if not lines:
        raise InputError(f"{path}: is empty; expected a row of names and rows of numbers")
    separator = max("\t;,", key=lines[0].count)
    first = next((i for i, x in enumerate(lines) if i and any(map(NUMBER.fullmatch, x.split(separator)))), 0)
    if not first:
        raise InputError(f"{path}: expected a row of names and rows of numbers, found no row of numbers")
    cells = len(next(csv.reader(lines[:1], delimiter=separator)))
    for line in lines[first:]:  # pandas fills short rows
        if (n := line.count(separator) + 1) != cells:
            raise InputError(f"{path}: expected {cells} cells in each row, found {n}: {line[:60]!r}")
    text = "\n".join([lines[0], *lines[first:]])
    decimal = "," if separator == ";" and re.search(r"\d,\d", text) else "."
    frame = pd.read_csv(StringIO(text), sep=separator, decimal=decimal, skipinitialspace=True, low_memory=False)
    return {str(name).strip(): np.asarray(x) for name, x in frame.items()}


def read_parquet(path: Path) -> Columns:
    """Columns of a Parquet file."""
    need("a Parquet file", "pyarrow")
    import pandas as pd

    return columns_of_frame(pd.read_parquet(BytesIO(bytes_of(path, LARGEST))))


def read_hdf5_columns(path: Path, offset: int = 0) -> Columns:
    """Rows of numbers of an HDF5 file by their path; times ``since`` a date become seconds since 1970."""
    import pandas as pd

    def take(file: h5py.File) -> Columns:
        import h5py

        columns: Columns = {}

        def add(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and max(item.shape, default=0) == item.size:
                x = np.asarray(item[()], float).reshape(-1)
                unit, _, date = str(attributes(item).get("units", "")).partition(" since ")
                if date:
                    x = x * pd.Timedelta(1, unit).total_seconds() + pd.Timestamp(date).timestamp()
                columns[name] = x

        file.visititems(add)
        return columns

    return read_hdf5(path, take, "a file of measurements", offset)


def read_matlab(path: Path) -> Columns:
    """Rows of numbers and texts of a MAT file; fields of structures as ``structure/field``."""
    from scipy.io import loadmat

    with reading(path, LARGEST) as (file, _):
        version = file.read(10)
    if version == b"MATLAB 7.3":
        return read_hdf5_columns(path, MATLAB_HEAD)
    return dict(_rows("", loadmat(BytesIO(bytes_of(path, LARGEST)), simplify_cells=True)))


def _rows(prefix: str, fields: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    for name, value in fields.items():
        if isinstance(value, dict):
            yield from _rows(f"{prefix}{name}/", value)
        elif isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiuU":
            yield prefix + name, value


def columns_of_frame(frame: Any) -> Columns:
    """Columns of a dictionary, or of a data frame of pandas, whose index is ``index`` or under its name."""
    index = {} if isinstance(frame, dict) else {frame.index.name or "index": frame.index}
    return {str(name): np.asarray(x) for name, x in {**index, **frame}.items()}


READERS: dict[str, Callable[[Path], Columns]] = {  # by suffix
    **dict.fromkeys((".csv", ".txt", ".dat"), read_csv),
    ".parquet": read_parquet,
    **dict.fromkeys((".nc", ".h5"), read_hdf5_columns),
    ".mat": read_matlab,
}


def table_of(
    file: str, columns: Columns, logger: Logger, sensors: Mapping[str, Sensor]
) -> tuple[Float, dict[tuple[str, Statistic | None], Float]]:
    """Times [s] since 1970, as stamped, and SI values by channel, and by statistic if the logger has statistics."""
    values = {}
    for name, sensor in sensors.items():
        for statistic, label in logger.columns_of(sensor).items():
            raw = _column(file, columns, label, name)
            if raw.dtype.kind not in "fiub":
                bad = next((text for text in map(str, raw) if not NUMBER.fullmatch(text) and text != "nan"), "")
                raise InputError(f"{file}: column {label!r} of {name}: expected numbers, found {bad[:40]!r}")
            x = np.where(np.isin(raw, logger.missing) | ~np.isfinite(raw), np.nan, raw)
            values[name, statistic] = sensor.in_si(x, statistic), label
    first = next(iter(values.values()))[0]
    time = _times(file, columns, logger.time) if logger.time else np.arange(len(first), dtype=float)
    for x, label in values.values():
        if len(x) != len(time):
            raise InputError(
                f"{file}: column {label!r} has {len(x)} samples for {len(time)} times; columns of another rate belong "
                "to a logger of their own"
            )
    return time, {key: x for key, (x, _) in values.items()}


def _column(file: str, columns: Columns, name: str, what: str) -> NDArray[Any]:
    """A column by its name, with or without its unit in brackets."""
    short = {re.sub(r"\s*[\[(].*", "", key): key for key in columns}
    if name not in columns and name not in short:
        hint = did_you_mean(name, columns)
        raise InputError(f"{file}: no column {name!r} for {what}: {hint}; correct the channel map")
    return columns[name if name in columns else short[name]]


def _times(file: str, columns: Columns, stamps: TimeStamps) -> Float:
    """[s] since 1970 of a column of dates, texts or numbers."""
    column = _column(file, columns, stamps.column, "the time")
    numbers = column.dtype.kind in "fiu"
    if numbers and stamps.form == "iso":
        raise InputError(
            f"{file}: column {stamps.column!r}: expected dates such as 2024-05-01 12:00:00, found numbers; give "
            "time.form: posix, matlab or seconds"
        )
    try:
        dates = [] if numbers else [stamps.posix(datetime.fromisoformat(str(each))) for each in column]
        begin = stamps.posix(datetime.strptime(Path(file).name, stamps.name)) if stamps.name else 0.0
    except ValueError as error:
        raise InputError(f"{file}: no date in column {stamps.column!r}, or in the name: {error}") from None
    time = column.astype(float) if numbers else np.array(dates)
    if not np.all(np.isfinite(time)):
        row = int(np.argmin(np.isfinite(time)))
        raise InputError(f"{file}: column {stamps.column!r}: row {row + 1} of the numbers has no time; remove the row")
    return (time - DATENUM_1970) * 86400.0 if stamps.form == "matlab" and numbers else time + begin
