"""Uniform wind as text (``.wnd``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.wind.fields import WindSeries
from meltemi.wind_files.common import is_number, reading, replacing, text_of

COLUMNS = ("time", "speed", "direction", "vertical", "horizontal_shear", "exponent", "vertical_shear", "gust")
HEAD = """\
! Time Speed Direction Vertical Horizontal PowerLaw LinearVertical Gust Upflow
!                      speed    shear      exponent shear          speed angle
! (s)  (m/s) (deg)     (m/s)    (-)        (-)      (-)            (m/s) (deg)
"""


def read_wnd(path: str | Path) -> WindSeries:
    """Read a uniform wind file (InflowWind, WindType 2).

    Its columns are time, speed, direction, vertical speed, horizontal shear, power-law exponent, linear vertical
    shear, gust, and optionally the upflow angle; angles in degrees. Upflow turns speed and gust up, as in OpenFAST.

    Source: InflowWind manual (Platt, B. Jonkman, J. Jonkman 2016), uniform wind files.

    Raises:
      InputError: the file is missing or a line cannot be read; the message names the line.
    """
    path = Path(path)
    with reading(path) as (file, _):
        if file.read(2) == b"\x9d\xff":  # -99
            raise InputError(f"{path}: a Bladed-style field, not uniform wind: read it with meltemi.read_wind")
    lines = text_of(path).splitlines()
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        text = line.split("!", 1)[0].replace(",", " ").split()
        if not text:
            continue
        try:
            values = [float(word) for word in text]
        except ValueError:
            if not rows and not is_number(text[0]):
                continue  # a header without a comment sign
            raise InputError(f"{path}:{number}: expected numbers, found {line.strip()[:60]!r}") from None
        if len(values) < 8:
            raise InputError(f"{path}:{number}: expected 8 or 9 numbers, found {len(values)}")
        rows.append([*values, 0.0][:9])
    if not rows:
        raise InputError(f"{path}: no rows of wind")
    t = np.array(rows)
    with np.errstate(all="ignore"):  # the record reports values that are not finite by their name
        level, up = np.cos(np.radians(t[:, 8])), np.sin(np.radians(t[:, 8]))
        data = {
            "time": t[:, 0],
            "speed": level * t[:, 1],
            "direction": np.radians(t[:, 2]),
            "vertical": t[:, 3] + up * (t[:, 1] + t[:, 7]),
            "horizontal_shear": t[:, 4],
            "exponent": t[:, 5],
            "vertical_shear": t[:, 6],
            "gust": level * t[:, 7],
            "source": path.name,
        }
    return validated(data, WindSeries, str(path))


def write_wnd(wind: WindSeries, path: str | Path) -> list[Path]:
    """Write a uniform wind file for OpenFAST (InflowWind, WindType 2).

    Nine columns with twelve digits; the upflow angle is zero, as it is part of the vertical speed. The reference
    height and length are not in such a file: they are in InflowWind's input.

    Source: as for :func:`read_wnd`.

    Returns:
      The path.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    columns = [getattr(wind, name) for name in COLUMNS]
    columns[2] = np.degrees(wind.direction)
    rows = "".join(" ".join(f"{x:.12g}" for x in (*row, 0.0)) + "\n" for row in zip(*columns, strict=True))
    label = " ".join(wind.label.split())
    with replacing(path) as (partial,):
        partial.write_text(f"! Written by meltemi: {label}\n{HEAD}{rows}", encoding="utf-8")
    return [path]
