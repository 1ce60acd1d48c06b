"""Results in netCDF files, and back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError, Status
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result


def write_netcdf(result: Result, path: str | Path) -> Path:
    """Write a result as netCDF4; the file appears only when it is complete.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    partial = path.with_name(f".{path.name}.part")
    data = result.to_xarray()
    data.attrs["channels"] = json.dumps([_plain(c) for c in result.channels])
    try:
        data.to_netcdf(partial, engine="h5netcdf")
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        partial.unlink(missing_ok=True)
    return path


def read_netcdf(path: str | Path) -> Result:
    """Read a result that :func:`write_netcdf` wrote.

    Raises:
      InputError: the file is missing or is no such file.
    """
    import xarray as xr

    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        with xr.open_dataset(path, engine="h5netcdf") as data:
            channels = tuple(_channel(entry) for entry in json.loads(data.attrs["channels"]))
            columns = [data[c.name].values for c in channels]
            return Result(
                time=data["time"].values.copy(),
                data=np.stack(columns, axis=1) if columns else np.zeros((len(data["time"]), 0)),
                channels=channels,
                status=Status(int(data.attrs["status"])),
                message=str(data.attrs["message"]),
                meta=json.loads(data.attrs["meta"]),
            )
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: not a result of meltemi ({type(error).__name__})") from None


def _plain(channel: Channel) -> dict[str, object]:
    return {name: getattr(channel, name) for name in Channel.__slots__}


def _channel(entry: dict[str, object]) -> Channel:
    return Channel(**{name: tuple(v) if isinstance(v, list) else v for name, v in entry.items()})  # type: ignore[arg-type]
