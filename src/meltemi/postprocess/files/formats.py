"""Formats of result files, and their detection."""

from __future__ import annotations

from pathlib import Path

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.hdf5 import BEGIN
from meltemi.postprocess.files.netcdf import read_netcdf, write_netcdf
from meltemi.postprocess.files.out import read_out, write_out
from meltemi.postprocess.files.outb import KINDS, read_outb, write_outb
from meltemi.simulation.result import Result
from meltemi.wind.files.common import reading

WRITERS = {".nc": write_netcdf, ".outb": write_outb, ".out": write_out}
"""Writers by file suffix."""


def read_result(path: str | Path) -> Result:
    """Read a result from meltemi's netCDF or from OpenFAST's binary or text output, detected by content.

    Of OpenFAST's channels those that the catalogue has get our names, units and signs; the others keep their name, with
    SI units where they are known.

    Raises:
      InputError: the file is missing, empty, damaged, cut, or of none of these formats.
    """
    path = Path(path)
    with reading(path) as (file, size):
        begin = file.read(len(BEGIN))
    if size == 0:
        raise InputError(f"{path}: is empty")
    if begin == BEGIN:
        return read_netcdf(path)
    if b"\0" in begin:
        if int.from_bytes(begin[:2], "little") not in KINDS:
            raise InputError(f"{path}: no result: neither netCDF of meltemi (.nc) nor output of OpenFAST (.outb, .out)")
        return read_outb(path)
    return read_out(path)


def write_result(result: Result, path: str | Path) -> Path:
    """Write a result in the format of the suffix: ``.nc``, or OpenFAST's ``.outb`` and ``.out``.

    Only netCDF keeps all digits, channels' descriptions, status and meta data.

    Raises:
      InputError: there is no such format, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise InputError(f"{path}: {did_you_mean(path.suffix, WRITERS)}")
    return WRITERS[path.suffix.lower()](result, path)
