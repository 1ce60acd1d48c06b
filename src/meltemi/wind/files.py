"""Wind files: TurbSim full fields (``.bts``) and uniform wind (``.wnd``)."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.wind.fields import WindBox, WindSeries

_HEADER = struct.Struct("<h4l6f6fl")


def read_bts(path: str | Path) -> WindBox:
    """Read a TurbSim full-field file.

    The layout is that of the TurbSim user's guide (B. Jonkman 2016), appendix E: a header, a
    description, then for each time step the grid as 16-bit integers, component by component, from right
    to left (looking downwind: y from negative to positive) and bottom to top. Tower points below the
    grid are not used.

    Raises:
      InputError: the file is missing, is no such file, or is cut off.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    if len(data) < _HEADER.size:
        raise InputError(f"{path}: not a TurbSim .bts file (only {len(data)} bytes)")
    fields = _HEADER.unpack_from(data)
    kind, nz, ny, n_tower, nt = fields[:5]
    dz, dy, dt, speed, hub_height, bottom = fields[5:11]
    slope, offset = np.array(fields[11:17:2], np.float32), np.array(fields[12:17:2], np.float32)
    n_text = fields[17]
    if kind not in (7, 8) or min(nz, ny, nt) < 1 or n_tower < 0 or not 0 <= n_text <= 100_000:
        raise InputError(f"{path}: not a TurbSim .bts file (its first number is {kind}, expected 7 or 8)")
    begin = _HEADER.size + n_text
    per_step = 3 * (nz * ny + n_tower)
    if len(data) < begin + 2 * per_step * nt:
        raise InputError(f"{path}: cut off: {len(data)} bytes, expected {begin + 2 * per_step * nt}")
    if np.any(slope == 0.0) or min(dz, dy, dt, speed) <= 0.0:
        raise InputError(f"{path}: the header has a zero scale or step")
    raw = np.frombuffer(data, dtype="<i2", count=per_step * nt, offset=begin).reshape(nt, per_step)
    grid = raw[:, : 3 * nz * ny].reshape(nt, nz, ny, 3)
    velocity = (grid.astype(np.float32) - offset) / slope
    try:
        return WindBox(
            velocity=velocity,
            dt=round(float(dt), 7),
            dy=float(dy),
            dz=float(dz),
            bottom=float(bottom),
            speed=float(speed),
            hub_height=float(hub_height),
            periodic=kind == 8,
            source=path.name,
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_wnd(path: str | Path) -> WindSeries:
    """Read a uniform wind file: time, speed, direction, vertical speed, horizontal shear, power-law
    exponent, linear vertical shear, gust, and optionally the upflow angle; angles in degrees. Upflow turns speed
    and gust up, as in OpenFAST.

    Raises:
      InputError: the file is missing or a line cannot be read; the message names the line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        text = line.split("!", 1)[0].replace(",", " ").split()
        if not text:
            continue
        try:
            values = [float(word) for word in text]
        except ValueError:
            if not rows and not _is_number(text[0]):
                continue  # a header without a comment sign
            raise InputError(f"{path}:{number}: expected numbers, found {line.strip()[:60]!r}") from None
        if len(values) < 8:
            raise InputError(f"{path}:{number}: expected 8 or 9 numbers, found {len(values)}")
        rows.append([*values, 0.0][:9])
    if not rows:
        raise InputError(f"{path}: no rows of wind")
    t = np.array(rows)
    level, up = np.cos(np.radians(t[:, 8])), np.sin(np.radians(t[:, 8]))
    with np.errstate(invalid="ignore"):  # the record names what is no finite number
        vertical = t[:, 3] + up * (t[:, 1] + t[:, 7])
    data = {
        "time": t[:, 0],
        "speed": level * t[:, 1],
        "direction": np.radians(t[:, 2]),
        "vertical": vertical,
        "horizontal_shear": t[:, 4],
        "exponent": t[:, 5],
        "vertical_shear": t[:, 6],
        "gust": level * t[:, 7],
        "source": path.name,
    }
    return validated(data, WindSeries, str(path))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
