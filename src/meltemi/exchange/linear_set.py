"""Sets of linear models over wind speed with names, units and operating points, as MATLAB and netCDF files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import meltemi
from meltemi.analyses.linear import LinearModel, linearise
from meltemi.core.errors import InputError
from meltemi.core.files import replacing
from meltemi.core.hdf5 import Variable, to_netcdf
from meltemi.simulation.model import Model
from meltemi.simulation.rotors import operating_point

Float = NDArray[np.float64]
MATRICES = {"A": ("state", "state"), "B": ("state", "input"), "C": ("output", "state"), "D": ("output", "input")}
VALUES = {"x0": "state", "u0": "input", "y0": "output"}
SCHEDULE = {"wind_speed": "m/s", "pitch": "rad", "rotor_speed": "rad/s", "generator_torque": "N m"}
"""Quantities of the operating points, over which a controller may interpolate."""


def linear_set(
    model: Model[Any],
    wind_speeds: Sequence[float],
    inputs: Sequence[str] = ("generator_torque", "pitch", "wind_speed"),
    outputs: Sequence[str] = ("rotor_speed", "tower_top_fore_aft"),
    progress: Callable[[float], None] | None = None,
) -> list[LinearModel]:
    """Linear models in the fixed frame at the operating points of steady wind speeds, for :func:`write_linear_set`.

    Args:
      model: turbine model.
      wind_speeds: [m/s] wind speeds in ascending order.
      inputs: as for ``linearise``.
      outputs: names of channels.
      progress: callback with the completed fraction.

    Raises:
      InputError: the wind speeds do not ascend, or a name is unknown.
    """
    if not len(wind_speeds) or np.any(np.diff(wind_speeds) <= 0.0):
        raise InputError(f"linear_set: expected wind speeds in ascending order, found {list(wind_speeds)}")
    models = []
    for i, speed in enumerate(wind_speeds):
        models.append(linearise(model, operating_point(model, float(speed)), inputs, outputs))
        if progress is not None:
            progress((i + 1) / len(wind_speeds))
    return models


@dataclass(frozen=True)
class _Stacked:
    """Arrays of a set by name, operating points in the first dimension, and the names common to its models."""

    arrays: dict[str, Float]
    names: dict[str, tuple[str, ...]]
    units: dict[str, tuple[str, ...]]


def _stacked(models: Sequence[LinearModel]) -> _Stacked:
    first = models[0]
    for other in models:
        if (other.states, other.inputs, other.outputs) != (first.states, first.inputs, first.outputs):
            raise InputError("write_linear_set: the models have different states, inputs or outputs")
    arrays = {name: np.array([getattr(m, name) for m in models]) for name in (*MATRICES, *VALUES)}
    arrays |= {"wind_speed": np.array([m.point.wind.speed for m in models])}
    arrays |= {name: np.array([getattr(m.point, name) for m in models]) for name in SCHEDULE if name != "wind_speed"}
    kinds = ("state", "input", "output")
    names = {kind: tuple(getattr(first, f"{kind}s")) for kind in kinds}
    return _Stacked(arrays, names, {kind: tuple(getattr(first, f"{kind}_units")) for kind in kinds})


def write_linear_set(models: Sequence[LinearModel], path: str | Path, *, turbine: str = "") -> Path:
    """Write linear models of one turbine over wind speed as a ``.mat`` or ``.nc`` file.

    In MATLAB the operating points are the last dimension, so that ``ss(A, B, C, D)`` is an array of systems; in netCDF
    the first, ``data.A[i]``. Both have ``wind_speed``, ``pitch``, ``rotor_speed`` and ``generator_torque`` of the
    operating points for scheduling, names and SI units of states, inputs and outputs, and their values ``x0``, ``u0``,
    ``y0``.

    Args:
      models: models with the same names, such as those of :func:`linear_set`.
      path: output file.
      turbine: turbine name for the description in the file.

    Returns:
      The path.

    Raises:
      InputError: there are no models, they differ in their names, or the file cannot be written.
    """
    path = Path(path)
    if not models:
        raise InputError("write_linear_set: there are no models")
    stacked = _stacked(models)
    frame = "fixed frame" if models[0].azimuth is None else f"blade 1 at {models[0].azimuth:g} rad"
    about = f"linear models of {turbine or 'a turbine'} for deviations from steady operation, {frame}, SI units"
    with replacing(path) as (partial,):
        if path.suffix == ".mat":
            _write_mat(stacked, partial, about)
        elif path.suffix == ".nc":
            _write_netcdf(stacked, partial, about)
        else:
            raise InputError(f"{path}: expected the ending .mat or .nc")
    return path


def _write_mat(stacked: _Stacked, path: Path, about: str) -> None:
    from scipy.io import savemat

    content: dict[str, Any] = {name: np.moveaxis(array, 0, -1) for name, array in stacked.arrays.items()}
    for kind, names in stacked.names.items():
        content[f"{kind}s"] = np.array(names, dtype=object).reshape(-1, 1)
        content[f"{kind}_units"] = np.array(stacked.units[kind], dtype=object).reshape(-1, 1)
    content |= {"schedule": np.array(list(SCHEDULE), dtype=object).reshape(-1, 1), "description": about}
    content |= {"meltemi": meltemi.__version__}
    savemat(path, content, appendmat=False, do_compression=True, oned_as="column")


def _write_netcdf(stacked: _Stacked, path: Path, about: str) -> None:
    variables: dict[str, Variable] = {}
    for name, (row, column) in MATRICES.items():
        # two dimensions of a matrix must have different names: columns of A are states, too
        dimensions = ("wind_speed", row, f"{column}_column" if column == row else column)
        variables[name] = dimensions, stacked.arrays[name], {}
    for name, kind in VALUES.items():
        variables[name] = ("wind_speed", kind), stacked.arrays[name], {}
    for name, unit in SCHEDULE.items():
        variables[name] = ("wind_speed",), stacked.arrays[name], {"units": unit}
    for kind, names in stacked.names.items():
        variables[kind] = (kind,), np.array(names, object), {}
        variables[f"{kind}_units"] = (kind,), np.array(stacked.units[kind], object), {}
    variables["state_column"] = ("state_column",), np.array(stacked.names["state"], object), {}
    labels = " ".join(f"{kind}_units" for kind in stacked.names)
    to_netcdf(variables, {"description": about, "meltemi": meltemi.__version__, "coordinates": labels}, path)
