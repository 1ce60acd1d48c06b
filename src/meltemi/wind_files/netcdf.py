"""Wind boxes as netCDF4 (``.nc``)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.files import replacing
from meltemi.core.hdf5 import Variable, attributes, read_hdf5, to_netcdf
from meltemi.wind.fields import WindBox
from meltemi.wind_files.common import box_or_error

if TYPE_CHECKING:
    import h5py

SCALARS = {"dt": "s", "dy": "m", "dz": "m", "bottom": "m", "speed": "m s-1", "hub_height": "m", "direction": "rad"}
"""Attributes with their units, which are written as ``NAME_units``."""
AXES = {
    "u": "wind downwind, in the axes of the box",
    "v": "wind to the left looking downwind, in the axes of the box",
    "w": "wind upwards",
}


def write_wind_netcdf(box: WindBox, path: str | Path, compression: int = 0) -> list[Path]:
    """Write a wind box as netCDF4: u, v, w over time, z, y, in single precision as they are in memory.

    Everything else of the box is in the attributes of the file, so it is read back as it was. Any program that reads
    netCDF reads it, xarray without options.

    Args:
      box: wind box to write.
      path: ends with ``.nc``.
      compression: 0 for none to 9 for the most; turbulence becomes little smaller.

    Returns:
      The path.

    Raises:
      InputError: the file cannot be written.
    """
    if compression not in range(10):
        raise InputError(f"compression must be a whole number from 0 to 9, found {compression!r}")
    path = Path(path)
    nt, nz, ny, _ = box.velocity.shape
    attributes: dict[str, object] = {"Conventions": "CF-1.11", "title": box.label, "source": box.source}
    attributes |= {"periodic": int(box.periodic), "written_by": "meltemi"}
    for name, unit in SCALARS.items():
        if (value := getattr(box, name)) is not None:
            attributes |= {name: float(value), f"{name}_units": unit}
    variables: dict[str, Variable] = {
        c: (("time", "z", "y"), box.velocity[..., i], {"units": "m s-1", "long_name": text})
        for i, (c, text) in enumerate(AXES.items())
    }
    for name, values, unit, axis, text, more in (
        ("time", box.dt * np.arange(nt), "s", "T", "time after the first plane", {}),
        ("z", box.bottom + box.dz * np.arange(nz), "m", "Z", "height above ground", {"positive": "up"}),
        ("y", box.dy * np.arange(ny) - 0.5 * box.width, "m", "Y", "to the left looking downwind", {}),
    ):
        variables[name] = (name,), values, {"units": unit, "axis": axis, **more, "long_name": text}
    with replacing(path) as (partial,):
        to_netcdf(variables, attributes, partial, compression)
    return [path]


def read_wind_netcdf(path: str | Path) -> WindBox:
    """Read a wind box that :func:`write_wind_netcdf` wrote.

    Raises:
      InputError: the file is missing, truncated, or does not contain a wind box.
    """
    path = Path(path)
    kind = "a wind box of meltemi; expected netCDF4 with u, v, w over time, z, y and the attributes "
    velocity, about = read_hdf5(path, _content, kind + ", ".join(SCALARS))
    return box_or_error(path, velocity=velocity, **about | {"source": about["source"] or path.name})


def _content(file: h5py.File) -> tuple[NDArray[np.float32], dict[str, Any]]:
    about = attributes(file)
    (shape,) = {file[name].shape for name in AXES}
    velocity = np.empty((*shape, 3), np.float32)
    for i, name in enumerate(AXES):
        velocity[..., i] = file[name]
    content: dict[str, Any] = {name: float(about[name]) for name in SCALARS if name != "hub_height" or name in about}
    return velocity, content | {"periodic": bool(about["periodic"]), "source": str(about["source"])}
