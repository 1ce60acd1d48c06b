"""Bladed-style binary fields (``.wnd``) with the summary file (``.sum``) of TurbSim."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

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
    text_of,
)

ID = -99
COMPONENTS = {1: 1, 2: 1, 3: 3, 5: 3, 4: None, 7: None, 8: None}
"""Number of components by type of turbulence; None: it is in the header."""
IMPROVED = struct.Struct("<l6f")  # type 4: components; latitude, roughness, height, intensities of u, v, w [%]
GENERAL = struct.Struct("<2l")  # types 7 and 8: size of the header, components
GRID = struct.Struct("<3flf3f4l")  # dz, dy, dx; half the planes; speed; 3 lengths; unused, seed, rows, columns
LENGTHS = struct.Struct("<6f")  # of v and w, if there are three components
SIGNATURE = "summary in the layout of TurbSim, written by meltemi"
TAIL = {7: 8, 8: 64}
"""[bytes] length of the end of the header by type: coherence, or the input of Mann's generator."""


@dataclass(frozen=True)
class _Header:
    kind: int
    intensity: tuple[float, ...]
    dz: float
    dy: float
    dx: float
    speed: float
    half: int
    rows: int
    columns: int
    components: int
    size: int


@dataclass(frozen=True)
class _Summary:
    clockwise: bool
    hub_height: float
    speed: float
    intensity: tuple[float, ...]
    height_offset: float
    periodic: bool
    left_handed: bool


def read_bladed(path: str | Path) -> WindBox:
    """Read a Bladed-style field of TurbSim or InflowWind: ``NAME.wnd`` and ``NAME.sum`` in the same folder.

    The file holds 16-bit integers, thousandths of a standard deviation about the mean speed: u, v, w of a point
    together, points from right to left (looking downwind), from left to right if the summary says *clockwise*, rows
    from bottom to top. Intensities come from the header (type 4) or the summary; hub height, height of the grid,
    periodicity and whether v is positive to the right (*left-hand rule*, Bladed's convention) from the summary. The
    header counts pairs of planes; one more is read if it is there. Types 1 to 5, 7 and 8; with one component v and w
    are zero. Tower files (``.twr``) are not used.

    Fields of Bladed itself, which have no summary and no mean wind, are not read.

    Source: TurbSim user's guide (B. Jonkman 2016), on Bladed-style binary files; OpenFAST,
    InflowWind_IO.f90, Bladed_ReadHeader1, Bladed_ReadTurbSimSummary and Bladed_ReadGrids.

    Raises:
      InputError: a file is missing, of another format or truncated, or the files do not belong together.
    """
    path = Path(path)
    with reading(path) as (file, size):
        h = _header(file, size, path)
        summary = _summary(path.with_suffix(".sum"), path)
        if abs(summary.speed - h.speed) > 0.1:
            raise InputError(
                f"{path}: its mean speed is {h.speed:g} m/s, but {path.with_suffix('.sum').name} has "
                f"{summary.speed:g} m/s: the two files do not belong together"
            )
        per_plane = h.rows * h.columns * h.components
        planes = 2 * h.half
        if size < h.size + 2 * per_plane * planes:
            raise InputError(f"{path}: cut off: {size} bytes, expected {h.size + 2 * per_plane * planes}")
        if size >= h.size + 2 * per_plane * (planes + 1):
            planes += 1
        intensity = [b if b > 0.0 else s for b, s in zip(h.intensity, summary.intensity, strict=True)]
        scale, offset = _scales(intensity, h.speed, summary.left_handed)
        velocity = np.zeros((planes, h.rows, h.columns, 3), np.float32)
        order = slice(None, None, -1 if summary.clockwise else 1)
        n = h.components
        for span in spans(planes, per_plane):
            raw = numbers(file, "<i2", per_plane * (span.stop - span.start), path)
            raw = raw.reshape(-1, h.rows, h.columns, n)[:, :, order]
            with np.errstate(over="ignore"):
                velocity[span, :, :, :n] = (offset[:n] + scale[:n] * raw).astype(np.float32)
    height = (h.rows - 1) * decimal(h.dz)
    dt = float(f"{decimal(h.dx) / decimal(h.speed):.10g}")
    return box_or_error(
        path,
        velocity=velocity,
        dt=dt,
        dy=decimal(h.dy),
        dz=decimal(h.dz),
        bottom=round(summary.hub_height - summary.height_offset - 0.5 * height, 6),
        speed=decimal(h.speed),
        hub_height=summary.hub_height,
        periodic=summary.periodic,
        source=path.name,
    )


def write_bladed(box: WindBox, path: str | Path) -> list[Path]:
    """Write a Bladed-style field and its summary file for OpenFAST (InflowWind, WindType 4).

    Type 4, three components, from right to left, with Bladed's left-hand rule for v, which InflowWind knows since
    2022. The standard deviation that scales a component is its mean over the grid, or 1/20 of the largest deviation
    from the mean speed (from zero for v and w) if that is more; a step is 1/1000 of it, and velocities are kept
    within half a step. A box without a hub height gets that of the middle of its grid. An odd number of planes is
    written in full; InflowWind reads all of them.

    Source: as for :func:`read_bladed`; OpenFAST, IfW_FFWind_Base.f90, WrBinBladed, has the same scales.

    Args:
      box: wind box to write.
      path: ends with ``.wnd``; the summary has the same name with ``.sum``.

    Returns:
      Paths of both files.

    Raises:
      InputError: the box has a direction, the path ends with ``.sum``, a summary of another program has the name
        (that of TurbSim for a ``.bts`` file, say), or a file cannot be written.
    """
    path = Path(path)
    refuse_direction(box, "a Bladed .wnd file")
    if path.suffix.lower() == ".sum":
        raise InputError(f"{path}: expected the name of the field, {path.with_suffix('.wnd').name}")
    note = path.with_suffix(".sum")
    if note.is_file() and SIGNATURE not in text_of(note):
        raise InputError(
            f"{path}: {note.name} in the same folder is of another program and would be lost: "
            "choose another name for the field"
        )
    nt, nz, ny, _ = box.velocity.shape
    speed = float(np.float32(box.speed))
    percent = [float(np.float32(100.0 * s / speed)) for s in _deviations(box.velocity, speed)]
    scale, offset = _scales(percent, speed, left_handed=True)
    # rounded as in the file, so that the lowest row keeps its height
    hub, height = middle(box), (nz - 1) * decimal(box.dz)
    header = struct.pack("<2h", ID, 4)
    header += IMPROVED.pack(3, 0.0, 0.0, box.bottom + 0.5 * height, *percent)
    header += GRID.pack(box.dz, box.dy, box.dt * box.speed, nt // 2, speed, 0.0, 0.0, 0.0, 0, 0, nz, ny)
    header += LENGTHS.pack(*[0.0] * 6)
    summary = _SUMMARY.format(
        signature=SIGNATURE,
        hub=hub,
        height=height,
        width=box.width,
        speed=speed,
        percent=percent,
        shift=hub - 0.5 * height - box.bottom,
        base=box.bottom,
        periodic="Creating a PERIODIC output file.\n" if box.periodic else "",
    )
    paths = [path, note]
    with replacing(*paths) as (field, text):
        with field.open("wb") as file:
            file.write(header)
            for span in spans(nt, 3 * nz * ny):
                file.write(np.rint((box.velocity[span] - offset) / scale).astype("<i2").tobytes())
        text.write_text(summary, encoding="ascii")
    return paths


# InflowWind looks for these words in this order, and for "periodic" anywhere after the height offset; old versions
# want "TurbSim" in the second line.
_SUMMARY = """
TurbSim - {signature}

         F  Clockwise rotation when looking downwind?
  {hub:.9g}  Hub height [m]
  {height:.9g}  Grid height [m]
  {width:.9g}  Grid width [m]

BLADED-style binary scaling parameters:

  UBar  = {speed:.9g} m/s
  TI(u) = {percent[0]:.9g} %
  TI(v) = {percent[1]:.9g} %
  TI(w) = {percent[2]:.9g} %

  Height offset = {shift:.9g} m
  Grid Base     = {base:.9g} m

{periodic}Creating a BLADED LEFT-HAND RULE output file.
"""


def _header(file: BinaryIO, size: int, path: Path) -> _Header:
    """Read the header, up to the first plane."""

    def take(layout: struct.Struct) -> tuple[float, ...]:
        data = file.read(layout.size)
        if len(data) < layout.size:
            raise InputError(f"{path}: not a Bladed .wnd file (truncated in its header, only {size} bytes)")
        return layout.unpack(data)

    (first,) = take(struct.Struct("<h"))
    if first in (-1, -2, -3):
        raise InputError(
            f"{path}: the old Bladed format (its first number is {first}) is not supported, only the new one ({ID}): "
            "write it again with TurbSim or Bladed"
        )
    if first != ID:
        raise InputError(f"{path}: not a Bladed .wnd file (its first number is {first}, expected {ID})")
    (kind,) = (int(k) for k in take(struct.Struct("<h")))
    if kind not in COMPONENTS:
        raise InputError(
            f"{path}: its type of turbulence is {kind}, expected one of {', '.join(map(str, sorted(COMPONENTS)))}"
        )
    intensity: tuple[float, ...] = (-1.0, -1.0, -1.0)
    components = COMPONENTS[kind]
    if kind == 4:
        components, intensity = int((head := take(IMPROVED))[0]), head[4:]
    elif components is None:
        components = int(take(GENERAL)[1])
    if components not in (1, 3):
        raise InputError(f"{path}: it has {components} components, expected 1 or 3")
    grid = take(GRID)
    dz, dy, dx, half, speed, rows, columns = *grid[:5], *grid[10:]
    if components == 3:
        take(LENGTHS)
    take(struct.Struct(f"{TAIL.get(kind, 0)}x"))
    if min(half, rows, columns) < 1:
        raise InputError(
            f"{path}: not a Bladed .wnd file (its header has {rows} rows, {columns} columns, {half} pairs of planes)"
        )
    if not np.all(np.isfinite([dz, dy, dx, speed, *intensity])) or min(dz, dy, dx, speed) <= 0.0:
        raise InputError(f"{path}: the header has a step, speed or intensity that is not a positive number")
    counts = int(half), int(rows), int(columns), components
    return _Header(kind, intensity, dz, dy, dx, speed, *counts, size=file.tell())


def _summary(path: Path, field: Path) -> _Summary:
    """Data of the summary file used by InflowWind; entries are searched in sequence, as in InflowWind."""
    if not path.is_file():
        raise InputError(
            f"{field}: requires {path.name} in the same folder, the summary of TurbSim with hub height and intensities"
        )
    lines = iter(text_of(path).splitlines())
    clockwise = False
    hub = ""
    for line in lines:
        upper = line.upper()
        if "CLOCKWISE" in upper:
            clockwise = upper.lstrip(" .")[:1] in ("T", "Y")
        if "HUB HEIGHT" in upper or "ZHUB" in upper:
            hub = line.split()[0]
            break
    speed = next((line for line in lines if "UBAR" in line.upper()), "")
    percent = [next(lines, "") for _ in range(3)] if speed else []
    shift, periodic, left_handed = "= 0.0", False, False
    for line in lines:
        upper = line.upper()
        if "HEIGHT OFFSET" in upper:
            shift = line
            break
    for line in lines:
        periodic |= "PERIODIC" in line.upper()
        left_handed |= "BLADED LEFT-HAND RULE" in line.upper()
    wanted = {"hub height": f"= {hub}", "UBar": speed, "height offset": shift}
    wanted |= dict(zip(("TI(u)", "TI(v)", "TI(w)"), [*percent, "", "", ""], strict=False))
    values: dict[str, float] = {}
    for name, line in wanted.items():
        try:
            values[name] = float(line.partition("=")[2].partition("%")[0].split()[0])
        except (ValueError, IndexError):
            values[name] = float("nan")
        if not np.isfinite(values[name]):
            raise InputError(
                f"{path}: no {name} in it; expected a summary of TurbSim with lines for the hub height, UBar and the "
                "three intensities"
            )
    intensity = tuple(values[f"TI({c})"] for c in "uvw")
    if min(intensity) < 0.0:
        raise InputError(f"{path}: an intensity is {min(intensity):g} %, expected a positive number")
    return _Summary(
        clockwise, values["hub height"], values["UBar"], intensity, values["height offset"], periodic, left_handed
    )


def _scales(percent: list[float], speed: float, left_handed: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity [m/s] per count, and velocity at count 0, of each component."""
    scale = 0.001 * speed * np.array(percent) / 100.0
    scale[1] *= -1.0 if left_handed else 1.0
    return scale, np.array([speed, 0.0, 0.0])


def _deviations(velocity: NDArray[np.float32], speed: float) -> NDArray[np.float64]:
    """Standard deviations [m/s] that scale the components."""
    mean = velocity.mean(axis=0, dtype=float)
    squares, most = np.zeros(3), np.zeros(3)
    for span in spans(len(velocity), velocity[0].size):
        part = velocity[span]
        squares += np.sum((part - mean) ** 2, axis=(0, 1, 2))
        most = np.maximum(most, np.max(np.abs(part - np.array([speed, 0.0, 0.0])), axis=(0, 1, 2)))
    deviation = np.sqrt(squares / (velocity.size // 3))
    return np.maximum(np.maximum(deviation, 0.05 * most), 0.01)
