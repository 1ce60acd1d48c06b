"""HAWC2 turbulence boxes: three files of single-precision numbers without a header."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_record, write_record
from meltemi.wind.fields import WindBox
from meltemi.wind_files.common import box_or_error, numbers, reading, replacing, spans

NAME = re.compile(r"(?P<base>.*?)(?P<sign>[-_.]?)(?P<component>[uvwUVW])(?P<suffix>(\.bin|\.turb)?)", re.IGNORECASE)
Front = Literal["last", "first"]
SAME = ("dy", "dz", "speed", "hub_height", "periodic", "direction")
"""Names that a box and its grid have in common."""
LEAST, SAMPLE = 10_000, 1 << 18
"""Points, at least and at most, from which the divergence of a box is estimated."""


class Hawc2Grid(Record):
    """Grid data missing in the files of a HAWC2 box; meltemi writes them as ``NAME.hawc2.yaml``."""

    planes: int = Field(ge=2)
    """Points along the wind."""
    columns: int = Field(ge=2)
    """Points across."""
    rows: int = Field(ge=2)
    """Points upwards."""
    dx: float = Field(gt=0.0)
    """[m] spacing of planes."""
    dy: float = Field(gt=0.0)
    """[m] spacing of columns."""
    dz: float = Field(gt=0.0)
    """[m] spacing of rows."""
    speed: float = Field(gt=0.0)
    """[m/s] mean wind speed, at which the box is convected."""
    hub_height: float | None = Field(default=None, gt=0.0)
    """[m]; by default the box suits any turbine."""
    bottom: float | None = Field(default=None, gt=0.0)
    """[m] height of the lowest row; by default the grid is centred on the hub."""
    profile: Literal["power", "none"] = "power"
    """Mean wind to be added: a power law, or none if the files contain it."""
    shear_exponent: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """Shear exponent of the power law; 0 adds the speed at every height."""
    mean_u: Vector | None = None
    """[m/s] mean of each row from the lowest up, added instead of the profile."""
    mean_v: Vector | None = None
    """[m/s] mean lateral velocity of each row."""
    mean_w: Vector | None = None
    """[m/s] mean vertical velocity of each row."""
    periodic: bool = True
    """The field repeats after its last plane."""
    direction: float = 0.0
    """[rad] wind direction of the box, clockwise from above."""
    box_front: Front = "last"
    """End of the box that reaches the turbine first: its last plane, as in HAWC2, or its first, as in InflowWind."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.hub_height is None and self.bottom is None:
            raise ValueError("hub_height or bottom must be given")
        if self.hub_height is None and self.profile == "power" and self.mean_u is None and self.shear_exponent:
            raise ValueError("a power law needs the hub_height")
        for name in ("mean_u", "mean_v", "mean_w"):
            values = getattr(self, name)
            if values is not None and len(values) != self.rows:
                raise ValueError(f"{name} must have {self.rows} entries, one for each row, found {len(values)}")
        if self.lowest <= 0.0:
            raise ValueError(f"the lowest row would be at {self.lowest:g} m, below the ground: specify bottom")
        return self

    @property
    def lowest(self) -> float:
        """Height [m] of the lowest row."""
        if self.bottom is not None:
            return self.bottom
        return (self.hub_height or 0.0) - 0.5 * (self.rows - 1) * self.dz

    def means(self) -> NDArray[np.float64]:
        """(rows, 3) [m/s] mean wind to be added to the velocities of the files."""
        mean = np.zeros((self.rows, 3))
        if self.mean_u is None and self.profile == "power":
            z = self.lowest + self.dz * np.arange(self.rows)
            mean[:, 0] = self.speed * (z / (self.hub_height or 1.0)) ** self.shear_exponent
        for i, values in enumerate((self.mean_u, self.mean_v, self.mean_w)):
            if values is not None:
                mean[:, i] = values
        return mean


def read_hawc2(path: str | Path, grid: Hawc2Grid | None = None) -> WindBox:
    """Read a HAWC2 turbulence box.

    Each file holds one component: planes, in each the columns, in each column the rows from bottom to top. u is
    positive downwind, v to the left, w up. The mean wind is not in the files and is added from ``grid``.

    HAWC2 (``box_front="last"``) has plane 0 at the tower at time 0, then the last plane, the last but one and so on;
    column 0 is on the right looking downwind. InflowWind (``"first"``) turns the box about the vertical, but not the
    velocities: planes 0, 1, 2 and so on pass, with column 0 on the left. A warning is issued if the divergence of the
    flow would have less than two thirds of its variance in the other order.

    Source: output of HAWC2 13.0.4 (h2lib-tests 13.2.2103); OpenFAST, InflowWind_IO.f90, IfW_HAWC_Init.

    Args:
      path: path of one of the three files, ``NAME-u.bin``, ``NAME_u.bin``, ``NAMEu.bin``, ``NAME_u``, ``NAME_u.turb``.
      grid: size, steps, speed and mean wind; read from ``NAME.hawc2.yaml`` if not given.

    Raises:
      InputError: a file is missing or has another size than the grid, or nothing describes the grid.
    """
    path = Path(path)
    paths, note = box_names(path, "read")
    if grid is None:
        if not note.is_file():
            if not path.is_file():
                with reading(path):
                    pass
            raise InputError(
                f"{path}: HAWC2 files do not contain their grid, and {note.name} is missing in their folder: specify "
                "grid=meltemi.io.Hawc2Grid(planes=..., columns=..., rows=..., dx=..., dy=..., dz=..., speed=..., "
                "hub_height=...)"
            )
        grid = read_record(note, Hawc2Grid)
        if "box_front" not in grid.model_fields_set:
            raise InputError(
                f"{note}: box_front is missing: add 'box_front: last' for a box that HAWC2 plays, 'box_front: first' "
                "for one that InflowWind plays or meltemi wrote without this key"
            )
    planes, *plane = shape = grid.planes, grid.columns, grid.rows
    velocity, means, (order, across) = np.empty(0), grid.means(), _order(planes, grid.box_front)
    for c, one in enumerate(paths):
        with reading(one) as (file, size):
            if size != 4 * math.prod(shape):
                raise InputError(
                    f"{one}: {size} bytes, expected {4 * math.prod(shape)} for {planes} planes of {grid.columns} "
                    f"columns and {grid.rows} rows of 4 bytes"
                )
            if c == 0:
                velocity = np.empty((planes, grid.rows, grid.columns, 3), np.float32)
            for span in spans(planes, math.prod(plane)):
                raw = numbers(file, "<f4", math.prod(plane) * (span.stop - span.start), one)
                part = raw.reshape(-1, *plane)[:, across].transpose(0, 2, 1)
                with np.errstate(all="ignore"):  # the box reports values that are not finite
                    velocity[order[span], :, :, c] = part + means[:, c, None]
    same = {name: getattr(grid, name) for name in SAME}
    dt = float(f"{grid.dx / grid.speed:.14g}")
    box = box_or_error(path, velocity=velocity, dt=dt, bottom=grid.lowest, source=path.name, **same)
    divergence, turned = divergences(box)
    if turned < divergence / 1.5:
        other = "first" if grid.box_front == "last" else "last"
        ratio = divergence / turned
        text = f"its divergence has {ratio:.2g} times the variance that it would have with box_front: {other}"
        warnings.warn(f"{path}: read with box_front: {grid.box_front}, {text}; check the order", stacklevel=2)
    return box


def divergences(box: WindBox) -> tuple[float, float]:
    """Variance [1/s^2] of the divergence of a box, and of the box rotated about the vertical without its velocities.

    Central differences of the first planes; turning changes the sign of the derivatives along and across the wind. Both
    are 0 for a box that is too small to tell.
    """
    shape = box.velocity.shape
    if min(shape[:3]) < 3 or math.prod(shape[:3]) < LEAST:
        return 0.0, 0.0
    v = box.velocity[: max(SAMPLE // (shape[1] * shape[2]), 3)].astype(float)
    level = (v[1:-1, 1:-1, 2:, 1] - v[1:-1, 1:-1, :-2, 1]) / (2.0 * box.dy)
    level -= (v[2:, 1:-1, 1:-1, 0] - v[:-2, 1:-1, 1:-1, 0]) / (2.0 * box.dt * box.speed)
    up = (v[1:-1, 2:, 1:-1, 2] - v[1:-1, :-2, 1:-1, 2]) / (2.0 * box.dz)
    return float(np.var(up + level)), float(np.var(up - level))


def write_hawc2(box: WindBox, path: str | Path, box_front: Front = "last") -> list[Path]:
    """Write a box for HAWC2: ``NAME-u.bin``, ``NAME-v.bin``, ``NAME-w.bin`` and ``NAME.hawc2.yaml``.

    The files hold single-precision numbers in the order of :func:`read_hawc2`, without the mean of each component
    over time and width at each height. These means, the grid and all else are in the ``.yaml`` file, a
    :class:`Hawc2Grid`, with which the box is read back as it was. HAWC2 and InflowWind need the numbers of points,
    the steps, the mean speed and a shear in their input, must not scale the turbulence (``dont_scale 1``), and
    take every box as periodic. At time 0 plane 0 is at the y of ``center_pos0``, which shall be :attr:`WindBox.lead`.

    Source: as for :func:`read_hawc2`.

    Args:
      box: wind box to write.
      path: ``NAME.bin``, or the name of one of the files, such as ``NAME_u.bin``.
      box_front: end that reaches the turbine first; for HAWC2 ``"last"``, for InflowWind ``"first"``.

    Returns:
      Paths of the four files.

    Raises:
      InputError: the name does not fit, or a file cannot be written.
    """
    path = Path(path)
    paths, note = box_names(path, "write")
    v = box.velocity
    means = v.mean(axis=(0, 2), dtype=float)
    grid = Hawc2Grid(
        planes=v.shape[0],
        columns=v.shape[2],
        rows=v.shape[1],
        dx=box.dt * box.speed,
        bottom=box.bottom,
        profile="none",  # replaced by the means
        box_front=box_front,
        **dict(zip(("mean_u", "mean_v", "mean_w"), means.T, strict=True)),
        **{name: getattr(box, name) for name in SAME},
    )
    order, across = _order(len(v), box_front)
    with replacing(*paths, note) as (*partial, text):
        for c, one in enumerate(partial):
            with one.open("wb") as file:
                for span in spans(v.shape[0], v[0].size // 3):
                    part = (v[order[span], :, :, c] - means[:, c, None]).transpose(0, 2, 1)[:, across]
                    file.write(part.astype("<f4").tobytes())
        write_record(grid, text)
    return [*paths, note]


def _order(planes: int, box_front: Front) -> tuple[NDArray[np.int64], slice]:
    """The order of the planes and of the columns of a file in a box, and of those of a box in a file."""
    last = box_front == "last"
    return np.arange(planes) * (-1 if last else 1) % planes, slice(None, None, 1 if last else -1)


def box_names(path: Path, purpose: Literal["read", "write"]) -> tuple[list[Path], Path]:
    """Names of the three files and of the description, from one of them."""
    match = NAME.fullmatch(path.name)
    # a file name to write, such as menu.bin, may happen to end with one of the letters
    if match is not None and (match["sign"] or not match["base"] or purpose == "read"):
        letters = "UVW" if match["component"].isupper() else "uvw"
        names = [f"{match['base']}{match['sign']}{c}{match['suffix']}" for c in letters]
        return [path.with_name(name) for name in names], path.with_name(f"{match['base'] or 'box'}.hawc2.yaml")
    if purpose == "write" and path.suffix.lower() == ".bin":
        return [path.with_name(f"{path.stem}-{c}.bin") for c in "uvw"], path.with_name(f"{path.stem}.hawc2.yaml")
    raise InputError(f"{path}: expected the name of a file of HAWC2, such as {path.stem or 'field'}-u.bin")
