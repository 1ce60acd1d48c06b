"""HAWC2 turbulence boxes referenced by imported models, as the wind of a case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from meltemi.core.errors import InputError
from meltemi.wind_files.hawc2 import Front, box_names

Profile = Literal["none", "constant", "log", "power"]


def box_case(
    files: Sequence[Path],
    points: Sequence[int],
    steps: Sequence[float],
    *,
    speed: float,
    height: float,
    front: Front,
    profile: Profile,
    value: float = 0.0,
) -> dict[str, Any]:
    """The ``wind`` of a case file for a box, with the absolute path.

    Args:
      files: box files of u, v and w.
      points, steps: numbers and spacings [m] of planes, columns and rows.
      speed: mean wind speed [m/s] at ``height`` [m], the height of the centre of the box.
      front: end of the box that reaches the turbine first.
      profile: profile of the mean wind; ``value`` is its roughness length [m] or its exponent.

    Raises:
      InputError: the names of the files differ in more than the letter of the component.
    """
    if list(files) != box_names(files[0], "read")[0]:
        names = ", ".join(file.name for file in files)
        raise InputError(f"the names of the files ({names}) must differ in u, v, w only, as box_u.bin: rename them")
    grid: dict[str, Any] = dict(zip(("planes", "columns", "rows"), map(int, points), strict=True))
    grid |= dict(zip(("dx", "dy", "dz"), map(float, steps), strict=True))
    grid |= {"speed": speed, "hub_height": height, "box_front": front}
    if profile == "none":
        grid["profile"] = "none"
    elif profile == "power":
        grid["shear_exponent"] = value
    elif profile == "log":
        z = height + grid["dz"] * (np.arange(grid["rows"]) - 0.5 * (grid["rows"] - 1))
        shape = np.log(np.maximum(z / value, 1.0)) / np.log(height / value)
        grid["mean_u"] = [float(u) for u in speed * shape]
    return {"kind": "file", "file": str(files[0].absolute()), "grid": grid}
