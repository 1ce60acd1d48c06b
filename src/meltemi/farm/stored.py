"""Results of a farm in a folder, a file for each turbine, as ``meltemi farm`` writes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.farm.settings import WakeSettings
from meltemi.farm.simulation import FarmResult
from meltemi.postprocess.files import read_netcdf, write_netcdf


def write_farm(result: FarmResult, folder: str | Path) -> list[Path]:
    """Write ``turbine_1.nc`` and so on into a folder; return their paths.

    Raises:
      InputError: a file cannot be written.
    """
    return [write_netcdf(each, Path(folder) / f"turbine_{i + 1}.nc") for i, each in enumerate(result.turbines)]


def read_farm(folder: str | Path) -> FarmResult:
    """Read a farm written by :func:`write_farm`; without the paths of the wakes and the wind over the farm.

    Raises:
      InputError: the folder has no farm, a turbine is missing, or its file is damaged.
    """
    folder = Path(folder)
    count = len(list(folder.glob("turbine_*.nc")))
    if not count:
        raise InputError(f"{folder}: no results of a farm: expected the output folder of meltemi farm (turbine_1.nc)")
    results = tuple(read_netcdf(folder / f"turbine_{i + 1}.nc") for i in range(count))
    for i, each in enumerate(results):
        if "farm" not in each.meta:
            raise InputError(
                f"{folder}: turbine_{i + 1}.nc has no position in a farm: an earlier version of meltemi "
                f"wrote it; simulate it again, or give its farm file ({folder / 'farm.yaml'})"
            )
    places = [each.meta["farm"] for each in results]
    return FarmResult(
        results,
        np.array([place["position"] for place in places]),
        np.array([place["yaw"] for place in places]),
        tuple(place["diameter"] for place in places),
        tuple(place["hub_height"] for place in places),
        validated(places[0]["wakes"], WakeSettings, f"{folder}: wakes"),
        direction=places[0]["direction"],
    )
