"""Formats of result files: the table, reading and writing by it. How to add one: docs/development/file-formats.md."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.errors import InputError
from meltemi.core.files import reading
from meltemi.core.formats import FileFormat, with_suffix

if TYPE_CHECKING:
    from meltemi.simulation.result import Result

FILES = "meltemi.postprocess.files"
FORMATS = (
    FileFormat(
        name="netcdf",
        suffix=".nc",
        text="netCDF of meltemi",
        module=f"{FILES}.netcdf",
        reader="read_netcdf",
        writer="write_netcdf",
        begins=(b"\x89HDF\r\n\x1a\n",),
        note="everything: all digits, axes and signs of the channels, status, metadata",
    ),
    FileFormat(
        name="outb",
        suffix=".outb",
        text="binary output of OpenFAST 2 to 5",
        module=f"{FILES}.outb",
        reader="read_outb",
        writer="write_outb",
        begins=tuple(kind.to_bytes(2, "little") for kind in (1, 2, 3, 4)),
        note="names, units, description; numbers packed into 16 bits",
    ),
    FileFormat(
        name="out",
        suffix=".out",
        text="text output of OpenFAST 2 to 5",
        module=f"{FILES}.out",
        reader="read_out",
        writer="write_out",
        note="names, units, description; seven digits",
    ),
    FileFormat(
        name="csv",
        suffix=".csv",
        text="comma-separated values with units in the head",
        module=f"{FILES}.signals",
        reader="read_signals",
        writer="write_signals",
        note="names, units; all digits",
    ),
)
"""All formats; their note says what they preserve. The first that fits the content is read. Texts have no typical first
bytes: their suffix decides, and any other suffix means output of OpenFAST."""
FIRST = 8
"""[bytes] length of the beginning of a file that identifies its format; a text has no zero in it."""


def read_result(path: str | Path) -> Result:
    """Read a result from meltemi's netCDF, from OpenFAST's binary or text output, detected by content, or from CSV.

    Of OpenFAST's channels those that the catalogue has get our names, units and signs; the others keep their name, with
    SI units where they are known.

    Raises:
      InputError: the file is missing, empty, damaged, cut, or of none of these formats.
    """
    path = Path(path)
    with reading(path) as (file, size):
        begin = file.read(FIRST)
    if size == 0:
        raise InputError(f"{path}: is empty")
    texts = {f.suffix: f for f in FORMATS if not f.begins}
    text = texts.get(path.suffix.lower(), texts[".out"])
    for f in FORMATS:
        if f.fits(begin) and (f.begins or (f is text and b"\0" not in begin)):
            result: Result = f.read(path)
            return result
    raise InputError(f"{path}: no result: none of " + ", ".join(f"{f.text} ({f.suffix})" for f in FORMATS))


def write_result(result: Result, path: str | Path) -> Path:
    """Write a result in the format of the suffix: ``.nc``, OpenFAST's ``.outb`` and ``.out``, or ``.csv``.

    Only netCDF keeps all digits, channels' descriptions, status and meta data.

    Raises:
      InputError: there is no such format, or the file cannot be written.
    """
    path = Path(path)
    written: Path = with_suffix(FORMATS, path, "result file")[0].write(result, path)
    return written
