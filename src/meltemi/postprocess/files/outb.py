"""OpenFAST's binary output (``.outb``).

All numbers are little-endian (``WrBinFAST`` and ``ReadFASTbinary`` of OpenFAST):

| bytes | what |
|---|---|
| int16 | kind: 1 with times, 2 with a time step, 3 with a time step and float64 data, 4 as 2 with the length of names |
| int16 | kind 4: characters of a name, else 10 |
| int32, int32 | channels C without the time, rows T |
| 2 float64 | kind 1: scale and offset of the times, else the first time and the time step |
| C, C float32 | scale and offset of each channel, not in kind 3 |
| int32, text | description |
| C + 1 names, C + 1 units | the time first, units in parentheses |
| T int32 | kind 1: times |
| T C | int16, or float64 in kind 3, row after row |

The value of a packed number is (number - offset) / scale.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.files.openfast import OutputColumns, columns_of, result_of
from meltemi.simulation.result import Result
from meltemi.wind_files.common import reading, replacing

Float = NDArray[np.float64]

WITH_TIME, WITHOUT_TIME, UNPACKED, LONG_NAMES = 1, 2, 3, 4
KINDS = (WITH_TIME, WITHOUT_TIME, UNPACKED, LONG_NAMES)
SHORT = 10
"""Characters of names and units but in the fourth kind."""
LEVELS = 65532
"""Number of levels of int16, less a margin for the rounding of the offset to float32."""
LARGEST = 1e37
"""Value, and scale: float32 ends at 3e38."""
LARGEST_OFFSET = 2.0**23
"""Largest number at which float32 resolves halves."""


def read_outb(path: str | Path) -> Result:
    """Read a binary output of OpenFAST 2 to 5, in SI units; see :func:`meltemi.postprocess.files.openfast.result_of`.

    The complete rows of a cut file, such as that of an interrupted run, are read; the result's ``warnings`` say so.

    Raises:
      InputError: the file is missing, damaged, of another kind, or cut before its first row ends.
    """
    path = Path(path)
    with reading(path) as (file, size):
        content = file.read()
    return result_of(_columns(content, size, path), path)


def _columns(content: bytes, size: int, path: Path) -> OutputColumns:
    place = 0

    def take(dtype: str, n: int, what: str) -> NDArray[np.generic]:
        nonlocal place
        end = place + n * np.dtype(dtype).itemsize
        if n < 0 or end > size:
            wanted = "a negative number of bytes" if n < 0 else f"{end} bytes"
            raise InputError(f"{path}: cut or damaged: {wanted} up to its {what}, but {size} bytes are there")
        values = np.frombuffer(content, dtype, n, place)
        place = end
        return values

    kind = int(take("<i2", 1, "kind")[0])
    if kind not in KINDS:
        raise InputError(f"{path}: not an OpenFAST binary output (its first number is {kind}, expected 1 to 4)")
    width = int(take("<i2", 1, "length of names")[0]) if kind == LONG_NAMES else SHORT
    if width < 1:
        raise InputError(f"{path}: damaged: names of {width} characters")
    n, rows = (int(v) for v in take("<i4", 2, "size"))
    if n < 1:
        raise InputError(f"{path}: damaged: its header gives {n} channels")
    first, second = (float(v) for v in take("<f8", 2, "times"))
    with np.errstate(invalid="ignore"):  # damaged values may be NaN
        scale, offset = (take("<f4", n, "scales").astype(float) for _ in range(2)) if kind != UNPACKED else (1.0, 0.0)
    description = _text(take("u1", int(take("<i4", 1, "description")[0]), "description"))
    names, units = (
        [_text(row) for row in take("u1", (n + 1) * width, "names").reshape(n + 1, width)] for _ in range(2)
    )
    announced, warning = rows, ""
    ticks = take("<i4", rows, "times").astype(float) if kind == WITH_TIME else None
    whole = (size - place) // (n * (8 if kind == UNPACKED else 2))
    if 0 < whole < rows:
        rows, warning = whole, f"{path.name} is cut: {whole} of {announced} rows are there"
        size, ticks = place + rows * n * (8 if kind == UNPACKED else 2), None if ticks is None else ticks[:rows]
    packed = take("<f8" if kind == UNPACKED else "<i2", rows * n, "data")
    if place != size:
        raise InputError(f"{path}: damaged: {size - place} bytes more than its header gives")
    with np.errstate(all="ignore"):  # a channel of NaN has no scale
        data = (packed.reshape(rows, n).astype(float) - offset) / scale
        time = first + second * np.arange(rows, dtype=float) if ticks is None else (ticks - second) / first
    return OutputColumns(tuple(names[1:]), tuple(u.strip("()") for u in units[1:]), time, data, description, warning)


def _text(codes: NDArray[np.generic]) -> str:
    return codes.tobytes().decode("utf-8", errors="replace").replace("\0", " ").strip()


def write_outb(result: Result, path: str | Path) -> Path:
    """Write a result as OpenFAST's binary output, in its names and units.

    Numbers are packed into 16 bits, which leaves an error of at most 1/131064 of the range of a channel, or 6e-8 of
    its largest value if that is more (:func:`packed`). Of names and units with up to ten characters the file is of
    kind 2, else of kind 4.

    Raises:
      InputError: a value is not a number, the times are uneven, or the file cannot be written.
    """
    path = Path(path)
    table = columns_of(result)
    fits = np.abs(table.data) < LARGEST
    if not np.all(fits):
        row, i = np.argwhere(~fits)[0]
        raise InputError(
            f"{path}: {result.names[i]} is not a number below {LARGEST:g} at {result.time[row]:g} s, for which .outb "
            "has no room: write .nc, or the part before by Result.between"
        )
    names, units = ["Time", *table.names], ["(s)", *(f"({u})" for u in table.units)]
    codes = [[text.encode() for text in texts] for texts in (names, units)]
    longest = max(len(code) for texts in codes for code in texts)
    width = max(SHORT, longest)
    description = table.description.encode()
    scale, offset, numbers = packed(table.data)
    with replacing(path) as (partial,), partial.open("wb") as file:
        file.write(struct.pack("<h", WITHOUT_TIME) if longest <= SHORT else struct.pack("<hh", LONG_NAMES, width))
        file.write(struct.pack("<iidd", len(table.names), len(table.time), *_steps(table.time, path)))
        file.write(scale.astype("<f4").tobytes() + offset.astype("<f4").tobytes())
        file.write(struct.pack("<i", len(description)) + description)
        file.write(b"".join(code.ljust(width) for texts in codes for code in texts))
        file.write(numbers.tobytes())
    return path


def packed(data: Float) -> tuple[Float, Float, NDArray[np.int16]]:
    """Scales (C,), offsets (C,) and packed numbers (T, C) of data (T, C): number = scale data + offset.

    The range of a channel takes up the 16 bits, but for a range that float32, in which scales and offsets are held,
    does not resolve.
    """
    low, high = (f(data, axis=0) if len(data) else np.zeros(data.shape[1]) for f in (np.min, np.max))
    middle, spread = 0.5 * low + 0.5 * high, high - low
    with np.errstate(divide="ignore"):
        scale = np.minimum(LEVELS / spread, LARGEST_OFFSET / np.abs(middle))
    scale = np.where(np.isfinite(scale), np.minimum(scale, LARGEST), 1.0).astype("<f4").astype(float)
    offset = (-middle * scale).astype("<f4").astype(float)
    return scale, offset, np.rint(data * scale + offset).astype("<i2")


def _steps(time: Float, path: Path) -> tuple[float, float]:
    """First time and time step."""
    if len(time) < 2:
        return (float(time[0]) if len(time) else 0.0), 1.0
    step = float(time[-1] - time[0]) / (len(time) - 1)
    if np.max(np.abs(time - (time[0] + step * np.arange(len(time))))) > 1e-6 * step:
        raise InputError(f"{path}: the times are not evenly spaced, as .outb needs them: write .nc")
    return float(time[0]), step
