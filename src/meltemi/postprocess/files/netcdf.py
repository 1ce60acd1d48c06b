"""Results as netCDF files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.errors import Status
from meltemi.core.files import replacing
from meltemi.core.hdf5 import attributes, read_hdf5, to_netcdf
from meltemi.scene.record import packed, unpacked
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result, labelled

if TYPE_CHECKING:
    import h5py


def write_netcdf(result: Result, path: str | Path) -> Path:
    """Write a result as netCDF4, atomically.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    variables, about = labelled(result)
    about["channels"] = json.dumps([_plain(c) for c in result.channels])
    if result.scene is not None:
        scene = np.frombuffer(packed(result.scene), np.uint8)
        variables["scene"] = ("scene_bytes",), scene, {"long_name": "motion and wind for meltemi view"}
    with replacing(path) as (partial,):
        to_netcdf(variables, about, partial)
    return path


def read_netcdf(path: str | Path) -> Result:
    """Read a result that :func:`write_netcdf` wrote.

    Raises:
      InputError: the file is missing, damaged or no such file.
    """
    return read_hdf5(Path(path), _result, "a result of meltemi")


def _result(file: h5py.File) -> Result:
    about = attributes(file)
    channels = tuple(_channel(entry) for entry in json.loads(about["channels"]))
    if len({channel.name for channel in channels}) < len(channels):
        raise ValueError("two channels have the same name")
    time = file["time"][:]
    return Result(
        time=time,
        data=np.stack([file[c.name][:] for c in channels], axis=1) if channels else np.zeros((len(time), 0)),
        channels=channels,
        status=Status(about["status"]),
        message=about["message"],
        meta=json.loads(about["meta"]),
        scene=unpacked(file["scene"][:].tobytes()) if "scene" in file else None,
    )


def _plain(channel: Channel) -> dict[str, object]:
    return {name: getattr(channel, name) for name in Channel.__slots__}


def _channel(entry: dict[str, object]) -> Channel:
    return Channel(**{name: tuple(v) if isinstance(v, list) else v for name, v in entry.items()})  # type: ignore[arg-type]
