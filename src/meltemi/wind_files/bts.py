"""TurbSim full-field files (``.bts``)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox
from meltemi.wind_files.common import (
    box_or_error,
    decimal,
    middle,
    numbers,
    reading,
    refuse_direction,
    replacing,
    spans,
)

HEADER = struct.Struct("<h4l6f6fl")
COUNTS = 65535.0
"""Range of a 16-bit integer, from -32768 to 32767."""


def read_bts(path: str | Path) -> WindBox:
    """Read a TurbSim full-field file.

    Source: TurbSim user's guide (B. Jonkman 2016), appendix D. A header, a description, then for each time step
    the grid as 16-bit integers: u, v, w of a point together, points from right to left (looking downwind: y from
    negative to positive), rows from bottom to top. Tower points below the grid, which follow each step's grid, are
    not used.

    Raises:
      InputError: the file is missing, of another format, or truncated.
    """
    path = Path(path)
    with reading(path) as (file, size):
        if size < HEADER.size:
            raise InputError(f"{path}: not a TurbSim .bts file (only {size} bytes)")
        fields = HEADER.unpack(file.read(HEADER.size))
        kind, nz, ny, n_tower, nt = fields[:5]
        dz, dy, dt, speed, hub_height, bottom = fields[5:11]
        slope, offset = np.array(fields[11:17:2], np.float32), np.array(fields[12:17:2], np.float32)
        n_text = fields[17]
        if kind not in (7, 8):
            raise InputError(f"{path}: not a TurbSim .bts file (its first number is {kind}, expected 7 or 8)")
        if min(nz, ny, nt) < 1 or n_tower < 0 or not 0 <= n_text <= 100_000:
            raise InputError(
                f"{path}: not a TurbSim .bts file (its header has {nz} rows, {ny} columns, {n_tower} tower points, "
                f"{nt} steps and {n_text} characters)"
            )
        begin = HEADER.size + n_text
        per_step = 3 * (nz * ny + n_tower)
        if size < begin + 2 * per_step * nt:
            raise InputError(f"{path}: cut off: {size} bytes, expected {begin + 2 * per_step * nt}")
        if np.any(slope == 0.0) or min(dz, dy, dt, speed) <= 0.0:
            raise InputError(f"{path}: the header has a zero scale or step")
        if not np.all(np.isfinite(fields[5:17])):
            raise InputError(f"{path}: the header has a scale, step, height or speed that is not a finite number")
        file.seek(begin)
        velocity = np.empty((nt, nz, ny, 3), np.float32)
        for span in spans(nt, per_step):
            raw = numbers(file, "<i2", per_step * (span.stop - span.start), path).reshape(-1, per_step)
            with np.errstate(over="ignore"):  # the box reports values that are not finite
                velocity[span] = (raw[:, : 3 * nz * ny].reshape(-1, nz, ny, 3).astype(np.float32) - offset) / slope
    return box_or_error(
        path,
        velocity=velocity,
        dt=decimal(dt),
        dy=float(dy),
        dz=float(dz),
        bottom=float(bottom),
        speed=float(speed),
        hub_height=float(hub_height),
        periodic=kind == 8,
        source=path.name,
    )


def write_bts(box: WindBox, path: str | Path) -> list[Path]:
    """Write a TurbSim full-field file for OpenFAST (InflowWind, WindType 3).

    Each component is scaled so that it fills the range of 16-bit integers; velocities are kept within half a step,
    1/131070 of the component's range. Number 7, or 8 for a periodic box; no tower points. A box without a hub
    height gets that of the middle of its grid.

    A file of TurbSim that is read and written again has the same grid, steps, speed and heights, bit by bit. Its
    description and tower points are lost, and the scales differ if a tower point had the highest or lowest speed,
    so velocities agree within half a step and not always bit by bit.

    Source: as for :func:`read_bts`.

    Returns:
      The path.

    Raises:
      InputError: the box has a direction, or the file cannot be written.
    """
    path = Path(path)
    refuse_direction(box, "a .bts file")
    nt, nz, ny, _ = box.velocity.shape
    slope, offset = _scales(box.velocity)
    text = f"Written by meltemi: {box.label}".encode("ascii", "replace")[:200]
    scales = [float(x) for pair in zip(slope, offset, strict=True) for x in pair]
    steps = (box.dz, box.dy, box.dt, box.speed, middle(box), box.bottom)
    header = HEADER.pack(8 if box.periodic else 7, nz, ny, 0, nt, *steps, *scales, len(text))
    with replacing(path) as (partial,), partial.open("wb") as file:
        file.write(header + text)
        for span in spans(nt, 3 * nz * ny):
            counts = np.rint(box.velocity[span] * slope + offset)  # in double precision
            file.write(np.clip(counts, -32768, 32767).astype("<i2").tobytes())
    return [path]


def _scales(velocity: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Slope and offset of each component, counts = slope * velocity + offset, rounded to what the file can hold."""
    flat = velocity.reshape(-1, 3)
    low, high = flat.min(axis=0).astype(float), flat.max(axis=0).astype(float)
    constant = high - low < 1e-30  # a constant component needs the single count 0, without rounding
    slope = np.where(constant, 1.0, COUNTS / np.where(constant, 1.0, high - low)).astype(np.float32).astype(float)
    offset = np.where(constant, -low, -32768.0 - slope * low).astype(np.float32).astype(float)
    return slope, offset
