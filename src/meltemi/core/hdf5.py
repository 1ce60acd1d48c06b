"""HDF5 (netCDF4) files that may be damaged: HDF5 may then fail, return wrong values or hang.

A file written here ends with a checksum, which HDF5 passes over: where it fits, the file is whole and read at once.
Any program that changes a file through HDF5 cuts the checksum off. A file without it is read in a separate process
first, which may crash or hang.
"""

from __future__ import annotations

import io
import subprocess
import sys
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.errors import InputError
from meltemi.core.files import reading

if TYPE_CHECKING:
    import h5py

T = TypeVar("T")
Variable = tuple[tuple[str, ...], ArrayLike, Mapping[str, object]]
"""Dimensions, values (numbers or names) and attributes of a variable, as xarray takes them too."""
BEGIN = b"\x89HDF\r\n\x1a\n"
SEAL = b"\nmeltemi: crc32 of the bytes before is "
LENGTH = len(SEAL) + 9
PATIENCE = 30.0
"""[s] time limit of a process for a file without a checksum, in addition to that for its size."""
BYTES_A_SECOND = 5e6
EXPANSION = 1100
"""Bytes that a byte of a file may stand for: compression makes a file a thousand times smaller at most."""
PROBE = Path(__file__).with_name("probe.py")


def to_netcdf(
    variables: Mapping[str, Variable], attributes: Mapping[str, object], path: Path, compression: int = 0
) -> None:
    """Write labelled arrays as netCDF4, with the checksum at the end.

    The file is written in memory first: where a disk has no room, HDF5 would crash the process.

    Args:
      variables: variables by name.
      attributes: attributes of the file.
      path: path of the file.
      compression: 0 for none to 9 for the most.

    Raises:
      OSError: there is no room, or the file cannot be written otherwise.
    """
    import h5netcdf
    import h5py

    packed = {"compression": "gzip", "compression_opts": compression, "shuffle": True} if compression else {}
    memory = io.BytesIO()
    with h5netcdf.File(memory, "w") as file:
        file.attrs.update(attributes)
        for name, (dimensions, values, about) in variables.items():
            values = np.asarray(values)
            for dimension, size in zip(dimensions, values.shape, strict=True):
                if dimension not in file.dimensions:
                    file.dimensions[dimension] = size
            kind = h5py.string_dtype() if values.dtype == object else values.dtype
            file.create_variable(name, dimensions, kind, data=values, **packed).attrs.update(about)
    with path.open("wb") as disk:
        disk.write(memory.getbuffer())
        disk.write(SEAL + b"%08x\n" % zlib.crc32(memory.getbuffer()))


def read_hdf5(path: Path, take: Callable[[h5py.File], T], kind: str, offset: int = 0) -> T:
    """Read a file with ``take``, after a check of its integrity.

    Args:
      path: path of the file.
      take: called with the open file; any exception in it means that the file is of another kind.
      kind: expected kind of file, for messages.
      offset: [bytes] of another program's head in front of the HDF5 part.

    Raises:
      InputError: the file is missing, damaged, or not of this kind.
    """
    with reading(path) as (file, size):
        file.seek(offset)
        if file.read(len(BEGIN)) != BEGIN:
            raise InputError(f"{path}: not {kind} (it is not an HDF5 file)")
        file.seek(max(size - LENGTH, 0))
        end = file.read(LENGTH)
        if not end.startswith(SEAL):
            _probe(path, size, kind)
        elif file.seek(0) == 0 and end != SEAL + b"%08x\n" % _checksum(file, size - LENGTH):
            raise InputError(f"{path}: this file is damaged (its checksum does not match its content)")
    import h5py

    try:
        with h5py.File(path, "r") as content:
            wanted = _wanted(content)
            if wanted > EXPANSION * size:
                raise InputError(
                    f"{path}: not {kind}, or forged: its {size / 1e6:.3g} MB stand for {wanted / 1e9:.3g} GB, more "
                    "than compression can give"
                )
            return take(content)
    except InputError:
        raise
    except Exception as error:  # HDF5 and what is above it raise anything
        reason = next(iter(str(error).splitlines()), "")[:100]
        raise InputError(f"{path}: not {kind} ({type(error).__name__}: {reason})") from None


def _wanted(file: h5py.File) -> int:
    """Bytes of all values of a file."""
    import h5py

    total = 0

    def add(name: str, item: Any) -> None:
        nonlocal total
        if isinstance(item, h5py.Dataset):
            total += int(item.size or 0) * item.dtype.itemsize

    file.visititems(add)
    return total


def attributes(item: h5py.HLObject) -> dict[str, Any]:
    """Attributes of a file or variable as plain values."""
    return {name: _plain(value) for name, value in item.attrs.items()}


def _plain(value: Any) -> Any:
    value = np.asarray(value)
    if value.size != 1:
        return value if value.size else ""
    one = value.item()
    return one.decode() if isinstance(one, bytes) else one


def _checksum(file: BinaryIO, count: int) -> int:
    """Checksum of the next ``count`` bytes."""
    total = 0
    while count > 0 and (part := file.read(min(count, 1 << 22))):
        total, count = zlib.crc32(part, total), count - len(part)
    return total


def _probe(path: Path, size: int, kind: str) -> None:
    """Read a complete file in another process, to test it.

    Raises:
      InputError: reading fails there, or does not end.
    """
    command = [sys.executable, "-P", str(PROBE), str(path), str(EXPANSION)]
    limit = PATIENCE + size / BYTES_A_SECOND
    try:
        done = subprocess.run(command, capture_output=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        raise InputError(f"{path}: not {kind}, or damaged (HDF5 reads on after {limit:.0f} s)") from None
    if done.returncode:
        why = done.stderr.decode(errors="replace").strip().splitlines()
        raise InputError(f"{path}: not {kind}, or damaged ({why[-1][:200] if why else 'HDF5 crashes'})")
