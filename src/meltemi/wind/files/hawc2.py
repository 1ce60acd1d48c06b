"""HAWC2 turbulence boxes: three files of single-precision numbers without a header."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_record, write_record
from meltemi.wind.fields import WindBox
from meltemi.wind.files.common import box_or_error, numbers, reading, replacing, spans

NAME = re.compile(r"(?P<base>.*?)(?P<sign>[-_.]?)(?P<component>[uvwUVW])(?P<suffix>\.bin)", re.IGNORECASE)


class Hawc2Grid(Record):
    """Grid data missing in the files of a HAWC2 box; meltemi writes them as ``NAME.hawc2.yaml``."""

    planes: int = Field(ge=2)
    """Points along the wind."""
    columns: int = Field(ge=2)
    """Points across."""
    rows: int = Field(ge=2)
    """Points upwards."""
    dx: float = Field(gt=0.0)
    """[m] between planes."""
    dy: float = Field(gt=0.0)
    """[m] between columns."""
    dz: float = Field(gt=0.0)
    """[m] between rows."""
    speed: float = Field(gt=0.0)
    """[m/s] mean wind speed, at which the box is convected."""
    hub_height: float | None = Field(default=None, gt=0.0)
    """[m]; by default the box suits any turbine."""
    bottom: float | None = Field(default=None, gt=0.0)
    """[m] height of the lowest row; by default the grid is centred on the hub."""
    profile: Literal["power", "none"] = "power"
    """Mean wind to be added: a power law, or none if the files contain it."""
    shear_exponent: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """Of the power law [-]; 0 adds the speed at every height."""
    mean_u: Vector | None = None
    """[m/s] mean of each row from the lowest up, added instead of the profile."""
    mean_v: Vector | None = None
    """[m/s] likewise."""
    mean_w: Vector | None = None
    """[m/s] likewise."""
    periodic: bool = True
    """The field repeats after its last plane."""
    direction: float = 0.0
    """[rad] from which the box is turned."""

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
        """[m] height of the lowest row."""
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
    """Read a HAWC2 turbulence box, as HAWC2 and InflowWind (WindType 5) do.

    Each file holds one component: planes in the order in which they pass the turbine, in each the columns from left
    to right looking downwind (against y), in each column the rows from bottom to top. u is positive downwind, v to
    the left, w up. The mean wind is not in the files and is added as ``grid`` says.

    Mann's generator writes with x downwind, so its last plane should pass first; the codes take the first one first
    all the same (OpenFAST issue 256), and so does this function.
    ``dataclasses.replace(box, velocity=box.velocity[::-1])`` turns the box round.

    Source: OpenFAST, InflowWind_IO.f90, IfW_HAWC_Init.

    Args:
      path: of one of the three files, ``NAME-u.bin``, ``NAME_u.bin`` or ``NAMEu.bin``.
      grid: size, steps, speed and mean wind; read from ``NAME.hawc2.yaml`` if not given.

    Raises:
      InputError: a file is missing or has another size than the grid, or nothing describes the grid.
    """
    path = Path(path)
    paths, note = _names(path, "read")
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
    shape = grid.planes, grid.columns, grid.rows
    expected = 4 * shape[0] * shape[1] * shape[2]
    for one in paths:
        with reading(one) as (_, size):
            if size != expected:
                raise InputError(
                    f"{one}: {size} bytes, expected {expected} for {shape[0]} planes of {shape[1]} columns and "
                    f"{shape[2]} rows of 4 bytes"
                )
    velocity = np.empty((shape[0], shape[2], shape[1], 3), np.float32)
    means = grid.means()
    for c, one in enumerate(paths):
        with reading(one) as (file, _):
            for span in spans(shape[0], shape[1] * shape[2]):
                raw = numbers(file, "<f4", shape[1] * shape[2] * (span.stop - span.start), one)
                part = raw.reshape(-1, shape[1], shape[2])[:, ::-1].transpose(0, 2, 1)
                with np.errstate(all="ignore"):  # the box says what is not finite
                    velocity[span, :, :, c] = part + means[:, c, None]
    return box_or_error(
        path,
        velocity=velocity,
        dt=float(f"{grid.dx / grid.speed:.14g}"),
        dy=grid.dy,
        dz=grid.dz,
        bottom=grid.lowest,
        speed=grid.speed,
        hub_height=grid.hub_height,
        periodic=grid.periodic,
        direction=grid.direction,
        source=path.name,
    )


def write_hawc2(box: WindBox, path: str | Path) -> list[Path]:
    """Write a box for HAWC2: ``NAME-u.bin``, ``NAME-v.bin``, ``NAME-w.bin`` and ``NAME.hawc2.yaml``.

    The files hold single-precision numbers in the order of :func:`read_hawc2`, without the mean of each component
    over time and width at each height. These means, the grid and all else are in the ``.yaml`` file, a
    :class:`Hawc2Grid`, with which the box is read back as it was. HAWC2 and InflowWind need the numbers of points,
    the steps, the mean speed and a shear in their own input, must not scale the turbulence (``dont_scale 1``), and
    take every box as periodic.

    Source: as for :func:`read_hawc2`.

    Args:
      box: what to write.
      path: ``NAME.bin``, or the name of one of the files, such as ``NAME_u.bin``.

    Returns:
      Paths of the four files.

    Raises:
      InputError: the name is another one, or a file cannot be written.
    """
    path = Path(path)
    paths, note = _names(path, "write")
    v = box.velocity
    means = v.mean(axis=(0, 2), dtype=float)
    grid = Hawc2Grid(
        planes=v.shape[0],
        columns=v.shape[2],
        rows=v.shape[1],
        dx=box.dt * box.speed,
        dy=box.dy,
        dz=box.dz,
        speed=box.speed,
        hub_height=box.hub_height,
        bottom=box.bottom,
        profile="none",  # the means take its place
        mean_u=means[:, 0],
        mean_v=means[:, 1],
        mean_w=means[:, 2],
        periodic=box.periodic,
        direction=box.direction,
    )
    with replacing(*paths, note) as (*partial, text):
        for c, one in enumerate(partial):
            with one.open("wb") as file:
                for span in spans(v.shape[0], v[0].size // 3):
                    part = (v[span, :, :, c] - means[:, c, None]).transpose(0, 2, 1)[:, ::-1]
                    file.write(part.astype("<f4").tobytes())
        write_record(grid, text)
    return [*paths, note]


def _names(path: Path, purpose: Literal["read", "write"]) -> tuple[list[Path], Path]:
    """Names of the three files and of the description, from one of them."""
    match = NAME.fullmatch(path.name)
    # a name to write, such as menu.bin, may end with one of the letters by chance
    if match is not None and (match["sign"] or not match["base"] or purpose == "read"):
        letters = "UVW" if match["component"].isupper() else "uvw"
        names = [f"{match['base']}{match['sign']}{c}{match['suffix']}" for c in letters]
        return [path.with_name(name) for name in names], path.with_name(f"{match['base'] or 'box'}.hawc2.yaml")
    if purpose == "write" and path.suffix.lower() == ".bin":
        return [path.with_name(f"{path.stem}-{c}.bin") for c in "uvw"], path.with_name(f"{path.stem}.hawc2.yaml")
    raise InputError(f"{path}: expected the name of a file of HAWC2, such as {path.stem or 'field'}-u.bin")
