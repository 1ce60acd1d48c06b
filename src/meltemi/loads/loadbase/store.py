"""Results of a load base on disk: one Parquet file for each group of finished cases, and tables of them.

A file is written under a temporary name, flushed to the disk and renamed; its name is the hash of its content. A file
is therefore complete or absent, several processes may write at the same time, and damage is noticed. A case is
identified by its key and counts once, even if two files have it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, Status, did_you_mean
from meltemi.core.extras import need
from meltemi.core.stores import keep_bytes
from meltemi.loads.loadbase.jobs import CaseRow
from meltemi.loads.loadbase.reduction import Reduced
from meltemi.postprocess.cycles import Cycles
from meltemi.postprocess.extremes import COMPONENTS, DRIVERS

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

FOLDER = "results"
"""Folder of the results in that of a load base."""
ABANDONED = 3600.0
"""Age [s] from which an unfinished file of a killed process is removed."""
PLAIN = (
    *("status", "message", "warnings", "simulated", "wind_seconds", "simulation_seconds", "reduction_seconds"),
    *("version", "stops"),
)
NESTED = {
    "statistics": ("channel", "mean", "std", "min", "max"),
    "extremes": ("interface", "driver", "time", *COMPONENTS),
    "durations": ("load", "low", "high", "time", "revolutions"),
    "duties": ("drive", "travel", "time", "moving", "starts", "reversals", "rms_rate", "largest_rate"),
    "equivalent": ("channel", "range"),
}
"""Tables of which each case has several rows, and their columns; the first ones are texts."""
CYCLES = ("range", "mean", "count")
DROPPED = 11
"""Number of last bits of ranges and means of cycles that are omitted, an error of at most 1.2e-4 of their value."""
TABLES = ("cases", *NESTED, "cycles")


class StoredCase(NamedTuple):
    """File and row of the result of a case, and its status."""

    file: Path
    row: int
    status: Status


class ResultStore:
    """Results in the folder of a load base.

    Attributes:
      folder: folder of the files.
      places: file and row of all cases by key.
      unreadable: files that cannot be read, with the reason; their cases count as missing.
    """

    def __init__(self, base: str | Path) -> None:
        _parquet()
        self.folder = Path(base) / FOLDER
        self.places: dict[str, StoredCase] = {}
        self.unreadable: dict[Path, str] = {}
        self._seen: set[Path] = set()
        self.refresh()

    def refresh(self) -> None:
        """Read the files that were written since the last call."""
        new = {path for path in self.folder.glob("*.parquet") if path not in self._seen}
        for path in sorted(new, key=_age):
            self._seen.add(path)
            try:
                table = read_file(path, ["key", "status"])
                cases = [(str(case["key"]), Status[str(case["status"])]) for case in table.to_pylist()]
            except FileNotFoundError:
                continue
            except (OSError, ValueError, KeyError) as error:
                self.unreadable[path] = str(error)
                continue
            for i, (key, status) in enumerate(cases):
                before = self.places.get(key)
                if before is None or not before.status.complete:
                    self.places[key] = StoredCase(path, i, status)

    def write(self, rows: Sequence[CaseRow]) -> Path:
        """Write finished cases.

        Raises:
          InputError: the file cannot be written; no part of it is left.
        """
        return write_file(table_of(rows), self.folder)

    def tidy(self) -> None:
        """Remove unfinished files of killed processes."""
        for path in self.folder.glob(".*.part"):
            with suppress(OSError):
                if time() - path.stat().st_mtime > ABANDONED:
                    path.unlink()

    def table(
        self, keys: Mapping[str, Sequence[str]], what: str = "cases", channels: Sequence[str] | None = None
    ) -> pd.DataFrame:
        """A table of the results of cases, in their order.

        Args:
          keys: names of the cases with each key.
          what: ``cases``, ``statistics``, ``extremes``, ``durations``, ``duties``, ``equivalent`` or ``cycles``.
          channels: only these, for statistics and cycles.

        Raises:
          InputError: there is no such table or channel, or a file cannot be read.
        """
        import pandas as pd

        if what not in TABLES:
            raise InputError(f"load base: no table {what!r}: {did_you_mean(what, TABLES)}")
        files = self._files(keys)
        order = [name for names in keys.values() for name in names]
        parts = [part for file, rows in files.items() for part in _parts(file, rows, what, channels)]
        columns = {"cases": PLAIN, "cycles": ("channel", *CYCLES)} | NESTED
        frame = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["case", *columns[what]])
        frame["case"] = pd.Categorical(frame["case"], categories=list(dict.fromkeys(order)))
        frame = frame.sort_values("case", kind="stable", ignore_index=True)
        if channels is not None and what == "statistics":
            frame = frame[frame["channel"].isin(channels)].reset_index(drop=True)
        return frame.set_index(frame.pop("case").astype(str)) if what == "cases" else frame

    def cycles(self, keys: Mapping[str, Sequence[str]]) -> Iterator[tuple[str, list[str], NDArray[np.intp], Cycles]]:
        """Cycles file by file and channel by channel, in less memory than their table.

        Args:
          keys: names of the cases with each key.

        Returns:
          channel, names of cases, place among them of the case of each cycle (n,), and the cycles.

        Raises:
          InputError: a file cannot be read.
        """
        import pyarrow.compute as pc

        for file, rows in self._files(keys).items():
            with _as_written(file):
                table = read_file(file, ["key", "cycles"])
                if "cycles" not in table.column_names:
                    continue
                for channel, column in zip(*_fields(table.column("cycles")), strict=True):
                    lists = column.take([i for i, _ in rows])
                    parts = (np.asarray(part, dtype=float) for part in pc.list_flatten(lists).flatten())
                    yield channel, [name for _, name in rows], pc.list_parent_indices(lists).to_numpy(), Cycles(*parts)

    def _files(self, keys: Mapping[str, Sequence[str]]) -> dict[Path, list[tuple[int, str]]]:
        """Rows and names of cases by file."""
        files: dict[Path, list[tuple[int, str]]] = {}
        for place, names in ((self.places[key], names) for key, names in keys.items() if key in self.places):
            files.setdefault(place.file, []).extend((place.row, name) for name in names)
        return files


def _age(path: Path) -> tuple[int, str]:
    try:
        return path.stat().st_mtime_ns, path.name
    except OSError:
        return 0, path.name


def _parquet() -> Any:
    need("a load base", "pandas", "pyarrow")
    import pyarrow.parquet as pq

    return pq


def table_of(rows: Sequence[CaseRow]) -> pa.Table:
    """Table with one row for each case: lists for nested tables, and cycles by channel."""
    import pyarrow as pa

    columns: dict[str, Any] = {name: [getattr(row, name) for row in rows] for name in ("key", "name", "message")}
    columns["status"] = [row.status.name for row in rows]
    columns["warnings"] = pa.array([list(row.warnings) for row in rows], pa.list_(pa.string()))
    columns |= {name: [getattr(row, name) for row in rows] for name in PLAIN if name.endswith("seconds")}
    columns |= {name: [getattr(row, name) for row in rows] for name in ("simulated", "version")}
    columns["stops"] = pa.array([row.reduced.stops if row.reduced else None for row in rows], pa.int64())
    nested = [_nested_columns(row.reduced) if row.reduced else None for row in rows]
    for name, fields in NESTED.items():
        columns[name] = _lists([tables and tables[name] for tables in nested], fields)
    kept = [row.reduced.cycles if row.reduced else {} for row in rows]
    if channels := list(dict.fromkeys(name for cycles in kept for name in cycles)):
        short = [{name: (rounded(c[0]), rounded(c[1]), c[2]) for name, c in cycles.items()} for cycles in kept]
        lists = [_lists([cycles.get(name) for cycles in short], CYCLES, np.float32) for name in channels]
        columns["cycles"] = pa.StructArray.from_arrays(lists, channels)
    return pa.table(columns)


def rounded(values: ArrayLike) -> NDArray[np.float32]:
    """Values in single precision with fewer bits, which take half of the space."""
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    mask = np.uint32(0xFFFFFFFF << DROPPED & 0xFFFFFFFF)
    return ((bits + np.uint32(1 << (DROPPED - 1))) & mask).view(np.float32)


def _lists(parts: Sequence[Any], fields: Sequence[str], kind: Any = np.float64) -> Any:
    """Array of lists of records: of each part a sequence by field, or None for an empty list."""
    import pyarrow as pa

    lengths = [0 if part is None else len(part[0]) for part in parts]
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    arrays = []
    for k, field in enumerate(fields):
        given = [part[k] for part in parts if part is not None]
        if field in ("channel", "interface", "driver", "load", "drive"):
            arrays.append(pa.array([text for texts in given for text in texts], pa.string()))
        else:
            arrays.append(pa.array(np.concatenate([*given, np.zeros(0)]).astype(kind)))
    return pa.ListArray.from_arrays(pa.array(offsets), pa.StructArray.from_arrays(arrays, list(fields)))


def _nested_columns(r: Reduced) -> dict[str, list[Any]]:
    """Columns of the nested tables of a case, in the order of ``NESTED``."""
    times = np.concatenate([*(times for times, _ in r.extremes.values()), np.zeros(0)])
    loads = np.concatenate([*(loads for _, loads in r.extremes.values()), np.zeros((0, 6))])
    levels = np.concatenate([*r.durations.values(), np.zeros((0, 4))])
    duties = ([getattr(duty, name) for duty in r.duties.values()] for name in NESTED["duties"][1:])
    return {
        "statistics": [list(r.channels), *r.statistics.T],
        "extremes": [[name for name in r.extremes for _ in DRIVERS], list(DRIVERS) * len(r.extremes), times, *loads.T],
        "durations": [[name for name, rows in r.durations.items() for _ in rows], *levels.T],
        "duties": [list(r.duties), *duties],
        "equivalent": [list(r.equivalent), list(r.equivalent.values())],
    }


def write_file(table: pa.Table, folder: Path) -> Path:
    """Write a table under the hash of its content, all of it or nothing.

    Raises:
      InputError: the file cannot be written.
    """
    import pyarrow as pa

    sink, kind = pa.BufferOutputStream(), table.schema
    channels = [field.name for field in kind.field("cycles").type] if "cycles" in kind.names else []
    numbers = [f"cycles.{name}.list.element.{part}" for name in channels for part in CYCLES[:2]]
    texts = [f"{name}.list.element.{fields[0]}" for name, fields in NESTED.items()]
    _parquet().write_table(
        table, sink, compression="zstd", use_dictionary=[*texts, "version"], use_byte_stream_split=numbers
    )
    data = sink.getvalue()
    return keep_bytes(folder / f"{hashlib.sha256(data).hexdigest()[:32]}.parquet", data)


def read_file(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read columns of a file; those that it does not have are left out.

    Raises:
      ValueError: the content does not match its hash.
      OSError: it cannot be read.
    """
    import pyarrow as pa

    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest()[:32] != path.stem:
        raise ValueError("damaged: its content is not what was written")
    file = _parquet().ParquetFile(pa.BufferReader(data))
    return file.read(columns=columns, use_threads=False)


@contextmanager
def _as_written(file: Path) -> Iterator[None]:
    """Raise InputError for a file that is damaged or of another form."""
    try:
        yield
    except (OSError, ValueError, LookupError, TypeError, AttributeError, NotImplementedError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else error
        raise InputError(f"{file}: cannot be read ({why}); remove it and run its cases again") from None


def _parts(
    file: Path, rows: Sequence[tuple[int, str]], what: str, channels: Sequence[str] | None
) -> Iterator[pd.DataFrame]:
    """Tables of the cases in a file."""
    import pandas as pd

    columns = [f"cycles.{name}" for name in channels] if what == "cycles" and channels else [what]
    places, names = [i for i, _ in rows], [name for _, name in rows]
    with _as_written(file):
        table = read_file(file, ["key", *(PLAIN if what == "cases" else columns)])
        if what == "cases":
            cases = table.select(list(PLAIN)).take(places).to_pandas().assign(case=names)
            if wrong := [lines for lines in cases["warnings"] if not isinstance(lines, list | np.ndarray)]:
                raise TypeError(f"warnings are {wrong[0]!r:.40}, not a list of texts")
            yield cases.assign(warnings=[[*lines] for lines in cases["warnings"]])
        elif what in NESTED:
            flat = _flat(table.column(what).take(places), names)
            yield pd.DataFrame({name: flat[name] for name in ("case", *NESTED[what])})
        elif "cycles" in table.column_names:
            for name, column in zip(*_fields(table.column("cycles")), strict=True):
                flat = _flat(column.take(places), names)
                yield pd.DataFrame({"case": flat["case"], "channel": name, **{part: flat[part] for part in CYCLES}})


def _fields(column: Any) -> tuple[list[str], list[Any]]:
    """Names and columns of a column of records."""
    whole = column.combine_chunks()
    return [field.name for field in whole.type], whole.flatten()


def _flat(column: Any, names: Sequence[str]) -> dict[str, Any]:
    """Columns of a column of lists of records, with the case of each."""
    import pyarrow as pa
    import pyarrow.compute as pc

    whole = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    cases = np.array(names, dtype=object)[pc.list_parent_indices(whole).to_numpy()]
    inner = pc.list_flatten(whole)
    fields = zip(inner.type, inner.flatten(), strict=True)
    return {"case": cases, **{field.name: values.to_numpy(zero_copy_only=False) for field, values in fields}}
