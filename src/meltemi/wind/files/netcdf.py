"""Wind boxes as netCDF4 (``.nc``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox
from meltemi.wind.files.common import box_or_error, reading, replacing

SCALARS = {"dt": "s", "dy": "m", "dz": "m", "bottom": "m", "speed": "m s-1", "hub_height": "m", "direction": "rad"}
"""Attributes with their units, which are written beside them as ``NAME_units``."""
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
      box: what to write.
      path: ends with ``.nc``.
      compression: 0 for none to 9 for the most; turbulence becomes little smaller.

    Returns:
      The path.

    Raises:
      InputError: the file cannot be written.
    """
    import xarray as xr

    if compression not in range(10):
        raise InputError(f"compression must be a whole number from 0 to 9, found {compression!r}")
    path = Path(path)
    nt, nz, ny, _ = box.velocity.shape
    dims = ("time", "z", "y")
    attributes: dict[str, object] = {"Conventions": "CF-1.11", "title": box.label, "source": box.source}
    attributes |= {"periodic": int(box.periodic), "written_by": "meltemi"}
    for name, unit in SCALARS.items():
        if (value := getattr(box, name)) is not None:
            attributes |= {name: float(value), f"{name}_units": unit}
    data = xr.Dataset(
        {
            c: (dims, box.velocity[..., i], {"units": "m s-1", "long_name": text})
            for i, (c, text) in enumerate(AXES.items())
        },
        coords={
            "time": (
                "time",
                box.dt * np.arange(nt),
                {"units": "s", "axis": "T", "long_name": "time after the first plane"},
            ),
            "z": (
                "z",
                box.bottom + box.dz * np.arange(nz),
                {"units": "m", "axis": "Z", "positive": "up", "long_name": "height above ground"},
            ),
            "y": (
                "y",
                box.dy * np.arange(ny) - 0.5 * box.width,
                {"units": "m", "axis": "Y", "long_name": "to the left looking downwind"},
            ),
        },
        attrs=attributes,
    )
    packed = {"compression": "gzip", "compression_opts": compression, "shuffle": True} if compression else {}
    encoding = {name: {"_FillValue": None} | (packed if name in AXES else {}) for name in (*AXES, *dims)}
    with replacing(path) as (partial,):
        data.to_netcdf(partial, engine="h5netcdf", encoding=encoding)
    return [path]


def read_wind_netcdf(path: str | Path) -> WindBox:
    """Read a wind box that :func:`write_wind_netcdf` wrote.

    Raises:
      InputError: the file is missing, cut off, or does not hold a wind box.
    """
    import h5py
    import xarray as xr

    path = Path(path)
    with reading(path) as (_, size):
        pass
    try:
        with h5py.File(path) as file:  # h5netcdf complains on the terminal if it meets damage first
            _ = [dict(part.attrs) for part in (file, *file.values())]
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as data:
            shape = tuple(int(data.sizes[name]) for name in ("time", "z", "y"))
            # compression makes a file a thousand times smaller at most
            if 12 * shape[0] * shape[1] * shape[2] > 1100 * size:
                raise InputError(f"{path}: cut off: {size} bytes cannot hold a field of {shape} points")
            velocity = np.empty((*shape, 3), np.float32)
            for i, name in enumerate(AXES):
                velocity[..., i] = data[name].transpose("time", "z", "y").values
            attributes = data.attrs
            scalars = {name: float(attributes[name]) for name in SCALARS if name != "hub_height" or name in attributes}
            rest = {"periodic": bool(attributes["periodic"]), "source": str(attributes["source"]) or path.name}
    except InputError:
        raise
    except Exception as error:  # a damaged file can make HDF5 and what is above it raise anything
        reason = next(iter(str(error).splitlines()), "")[:100]
        raise InputError(
            f"{path}: not a wind box of meltemi; expected netCDF4 with u, v, w over time, z, y and the attributes "
            f"{', '.join(SCALARS)} ({type(error).__name__}: {reason})"
        ) from None
    return box_or_error(path, {"velocity": velocity, **scalars, **rest})
