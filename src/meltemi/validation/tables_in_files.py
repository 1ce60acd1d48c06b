"""Columns of files of measurements: CSV, Parquet, netCDF, MATLAB 5 and 7.3, and data frames of pandas."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.core.files import bytes_of, reading, text_of
from meltemi.core.formats import hint
from meltemi.core.hdf5 import attributes, read_hdf5

if TYPE_CHECKING:
    import h5py

Columns = dict[str, NDArray[Any]]  # (T,) numbers, or texts and dates of time stamps, by the name of the column
LARGEST = 1_000_000_000  # [bytes] of a file
MATLAB_HEAD = 512  # [bytes] in front of the HDF5 part of a MAT file of version 7.3
NUMBER = re.compile(r'\s*"?\s*[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?\s*"?\s*')


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
