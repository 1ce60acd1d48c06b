"""Columns of files of measurements: CSV, Parquet, netCDF, MATLAB 5 and 7.3, and data frames."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.core.files import bytes_of, reading, text_of
from meltemi.core.formats import FileFormat, with_suffix
from meltemi.core.hdf5 import BEGIN, attributes, read_hdf5

if TYPE_CHECKING:
    import h5py

Columns = dict[str, NDArray[Any]]
"""(T,) numbers, or texts and dates of time stamps, by the name of the column."""
LARGEST = 1_000_000_000
"""[bytes] of a file."""
MATLAB_HEAD = 512
"""[bytes] in front of the HDF5 part of a MAT file of version 7.3."""
FORMATS = tuple(
    FileFormat(name=suffix[1:], suffix=suffix, text=text, module=__name__, reader=reader, writer="", begins=begins)
    for suffix, text, reader, begins in (
        (".csv", "comma-separated values", "read_csv", ()),
        (".txt", "values separated by commas, semicolons or tabulators", "read_csv", ()),
        (".dat", "values separated by commas, semicolons or tabulators", "read_csv", ()),
        (".parquet", "Parquet", "read_parquet", (b"PAR1",)),
        (".nc", "netCDF4", "read_hdf5_columns", (BEGIN,)),
        (".h5", "HDF5", "read_hdf5_columns", (BEGIN,)),
        (".mat", "MATLAB 7.3", "read_matlab73", (b"MATLAB 7.3",)),
        (".mat", "MATLAB 5", "read_matlab5", (b"MATLAB 5.0",)),
    )
)
"""Formats of measurements."""


def read_columns_of(path: Path) -> Columns:
    """All columns of a file.

    Raises:
      InputError: the file is missing, damaged, or of no known format.
      MissingPackageError: Parquet without pyarrow.
    """
    with reading(path, LARGEST) as (file, _):
        begin = file.read(16)
    formats = with_suffix(FORMATS, path, "file of measurements")
    for each in formats:
        if each.fits(begin):
            columns: Columns = each.read(path)
            return columns
    raise InputError(f"{path}: not a file of {' or '.join(each.text for each in formats)}; its first bytes are others")


def read_csv(path: Path) -> Columns:
    """Columns of a text: a row of names, rows of units or the like without numbers, rows of numbers.

    Separators are tabulators, semicolons (with decimal points or commas) or commas; rows that begin with # are skipped,
    and so is the first row of a TOA5 file. Texts remain in columns that have no number in their first row.
    """
    lines = [line for line in text_of(path, LARGEST).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    lines = lines[1:] if lines and lines[0].lstrip('"').startswith("TOA5") else lines
    if not lines:
        raise InputError(f"{path}: is empty; expected a row of names and rows of numbers")
    separator = max("\t;,", key=lines[0].count)
    rows = list(csv.reader(lines, delimiter=separator))
    names = [name.strip() for name in rows[0]]
    if separator == ";":
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    first = next((i for i in range(1, len(rows)) if any(_is_number(cell) for cell in rows[i])), 0)
    if not first or len(names) < 1:
        raise InputError(f"{path}: expected a row of names and rows of numbers, found no row of numbers")
    short = next((i for i in range(first, len(rows)) if len(rows[i]) != len(names)), 0)
    if short:
        raise InputError(
            f"{path}: expected {len(names)} cells in each row, found {len(rows[short])}: {lines[short][:60]!r}"
        )
    return {name: _cells([row[i] for row in rows[first:]], name, path) for i, name in enumerate(names)}


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return cell.strip().lower() not in ("nan", "inf")


def _cells(cells: Sequence[str], name: str, path: Path) -> NDArray[Any]:
    """Numbers of a column, NaN where a cell is empty; texts if its first filled cell is a text."""
    filled = next((cell for cell in cells if cell.strip() and cell.strip().lower() != "nan"), "nan")
    if not _is_number(filled) and filled != "nan":
        return np.array([cell.strip() for cell in cells])
    try:
        return np.array([cell if cell.strip() else "nan" for cell in cells]).astype(float)
    except ValueError:
        bad = next(cell for cell in cells if cell.strip() and not _is_number(cell) and cell.strip().lower() != "nan")
        raise InputError(f"{path}: column {name!r}: expected numbers, found {bad[:40]!r}") from None


def read_parquet(path: Path) -> Columns:
    """Columns of a Parquet file, by pyarrow."""
    need("Parquet files", "pyarrow")
    from pyarrow import ArrowException, parquet

    try:
        table = parquet.read_table(BytesIO(bytes_of(path, LARGEST)))
        columns = {name: table[name].to_numpy() for name in table.column_names}
    except (ArrowException, OSError, ValueError) as error:
        raise InputError(f"{path}: not a Parquet file, or damaged ({str(error).splitlines()[0][:100]})") from None
    zoned = {field.name for field in table.schema if getattr(field.type, "tz", None)}  # in UTC in the file
    return {name: _in_utc(x) if name in zoned else x for name, x in columns.items()}


def read_hdf5_columns(path: Path, offset: int = 0) -> Columns:
    """Rows of numbers in an HDF5 file by their path; times in ``seconds since`` a date become seconds since 1970."""

    def take(file: h5py.File) -> Columns:
        import h5py

        columns: Columns = {}

        def add(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and max(item.shape, default=0) == item.size:
                x = np.asarray(item[()], float).reshape(-1)
                unit = str(attributes(item).get("units", ""))
                since = (
                    np.datetime64(unit[14:].strip().removesuffix("Z"), "us")
                    if unit.startswith("seconds since")
                    else None
                )
                columns[name] = x if since is None else x + since.astype(float) * 1e-6

        file.visititems(add)
        return columns

    return read_hdf5(path, take, "a file of measurements", offset)


def read_matlab73(path: Path) -> Columns:
    """Rows of numbers of a MAT file of version 7.3; fields of structures as ``structure/field``."""
    return read_hdf5_columns(path, MATLAB_HEAD)


def read_matlab5(path: Path) -> Columns:
    """Rows of numbers and texts of a MAT file of version 5; fields of structures as ``structure/field``."""
    from scipy.io import loadmat

    try:
        content = loadmat(BytesIO(bytes_of(path, LARGEST)), squeeze_me=True, chars_as_strings=True)
    except Exception as error:  # scipy raises anything on damaged files
        raise InputError(f"{path}: not a MAT file, or damaged ({type(error).__name__})") from None
    columns: Columns = {}

    def add(prefix: str, value: Any) -> None:
        if isinstance(value, np.void) or (isinstance(value, np.ndarray) and value.dtype.names and not value.ndim):
            for name in value.dtype.names or ():
                inner = value[name]
                add(
                    f"{prefix}/{name}",
                    inner.item()
                    if isinstance(inner, np.ndarray) and inner.dtype.hasobject and not inner.ndim
                    else inner,
                )
        elif isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiuUS":
            columns[prefix] = value

    for name, value in content.items():
        if not name.startswith("__"):
            add(name, value)
    return columns


def columns_of_frame(frame: Any) -> Columns:
    """Columns of a data frame of pandas, its index among them as ``index`` or under its name."""
    columns: Mapping[Any, Any] = {frame.index.name or "index": frame.index} | dict(frame.items())
    return {
        str(name): _in_utc(x.to_numpy("M8[us]")) if getattr(x.dtype, "tz", None) else np.asarray(x)
        for name, x in columns.items()
    }


def _in_utc(dates: NDArray[Any]) -> NDArray[Any]:
    """Texts of dates that are in UTC."""
    return np.datetime_as_string(dates, timezone="UTC")
