"""Potential-flow coefficients of a platform, from files of WAMIT, a dataset of Capytaine, or one compact file.

Reference: docs/theory/floating.md (W-1, W-2, W-43, W-44); WAMIT user manual, chapter 4.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of
from meltemi.floating.capytaine import read_capytaine
from meltemi.floating.platform import Platform
from meltemi.floating.potential import NO_FORCE, NONE, HydroCoefficients, about_still_water

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

DATA = Path(__file__).parent / "data"
LARGEST = 200_000_000
"""[bytes] largest size of a file."""
MOST_BODIES = 20


def platform_coefficients(platform: Platform) -> HydroCoefficients:
    """Coefficients of a platform; those of several bodies as of one.

    Raises:
      InputError: as for :func:`bodies_coefficients`.
    """
    c = bodies_coefficients(platform)
    if not platform.bodies:
        return c
    places, volumes = zip(*((each.place, each.volume) for each in platform.bodies), strict=True)
    return about_still_water(c, np.array(places), np.array(volumes))


def bodies_coefficients(platform: Platform) -> HydroCoefficients:
    """Coefficients of all bodies of a platform, about a point of each.

    Raises:
      InputError: as for :func:`read_coefficients`; or the file has another number of bodies, or forces of second order.
    """
    c = read_coefficients(platform.coefficients)
    if (found := len(c.infinite) // 6) != max(given := len(platform.bodies), 1):
        raise InputError(
            f"platform.bodies: {given} bodies, but {platform.coefficients} has motions of {found}; give place and "
            "volume of each, in the order of its motions"
        )
    if platform.bodies and len(c.drift) + len(c.sums):
        raise InputError(f"platform.bodies: {platform.coefficients} has forces of second order, which need one body")
    return c


def read_coefficients(name: str) -> HydroCoefficients:
    """Coefficients of a library platform by name, of a compact file ``.npz``, of a dataset of Capytaine ``.nc``, or of
    WAMIT files by their common path.

    Raises:
      InputError: a file is missing, or does not have what it needs.
    """
    if name.endswith(".nc"):
        return read_capytaine(Path(name))
    path = Path(name) if name.endswith(".npz") else DATA / f"{name}.npz"
    if not path.is_file():
        if Path(f"{name}.1").is_file():
            return read_wamit(Path(name))
        known = sorted(each.stem for each in DATA.glob("*.npz"))
        raise InputError(
            f"platform.coefficients: no library platform, and no file {name}.1: {did_you_mean(name, known)} (or give "
            "the path of WAMIT files without .1, .3, .hst)"
        )
    try:
        with np.load(BytesIO(bytes_of(path, LARGEST)), allow_pickle=False) as data:
            names = [f.name for f in fields(HydroCoefficients) if f.name in data or not f.name.startswith("sums")]
            single: dict[str, Any] = {name: data[name] for name in names}
            arrays = {name: a.astype(np.result_type(a.dtype, np.float64)) for name, a in single.items()}
            if arrays["drift"].ndim == 3:  # files of one heading, or none
                arrays["drift"] = arrays["drift"][None][: len(arrays["drift_heading"])]
            coefficients = HydroCoefficients(**arrays)
    except DAMAGED as error:
        raise InputError(
            f"{path}: not a file of coefficients, or damaged ({error}); let meltemi import write it again"
        ) from None
    _check(path, coefficients)
    return coefficients


DAMAGED = (
    *(KeyError, ValueError, TypeError, AttributeError, IndexError, OSError, EOFError, RuntimeError, SyntaxError),
    *(OverflowError, MemoryError, zipfile.BadZipFile, zlib.error),
)
"""Exceptions for a compact file that is cut, or has other bytes or content."""


def _check(path: Path, c: HydroCoefficients) -> None:
    """Refuse arrays whose shapes do not fit each other, or that are not finite."""
    f, h, n = c.frequency.size, c.heading.size, max(6 * (len(c.infinite) // 6), 6)
    shapes: dict[str, tuple[int, ...]] = {"frequency": (f,), "heading": (h,), "excitation": (f, h, n)}
    shapes |= {"added_mass": (f, n, n), "damping": (f, n, n), "infinite": (n, n), "hydrostatic": (n, n)}
    for name, grid, headings in (
        ("drift", c.drift_frequency, c.drift_heading),
        ("sums", c.sums_frequency, c.sums_heading),
    ):
        shapes |= {f"{name}_frequency": (grid.size,), f"{name}_heading": (headings.size,)}
        shapes |= {name: (headings.size, grid.size, grid.size, 6)}
    for name, shape in shapes.items():
        array = getattr(c, name)
        if array.shape != shape or not np.all(np.isfinite(array)):
            problem = "values that are not finite" if array.shape == shape else f"shape {array.shape}"
            raise InputError(f"{path}: {name}: expected finite numbers of shape {shape}, found {problem}")
    for name in ("frequency", "heading"):
        values = getattr(c, name)
        if not len(values) or np.any(np.diff(values) <= 0.0):
            raise InputError(f"{path}: {name}: expected numbers that increase")


def write_coefficients(coefficients: HydroCoefficients, path: Path) -> None:
    """Write a compact file, in single precision."""
    single = {np.dtype(np.float64): np.float32, np.dtype(np.complex128): np.complex64}
    arrays = {f.name: getattr(coefficients, f.name) for f in fields(coefficients)}
    np.savez_compressed(path, **{name: a.astype(single[a.dtype]) for name, a in arrays.items()})


def read_wamit(path: Path) -> HydroCoefficients:
    """Coefficients from files ``.1``, ``.3``, ``.hst``, of reference length 1 m, and ``.12d``, ``.12s`` if there are.

    Motions 7 to 12 are those of a second body, and so on.

    Raises:
      InputError: a file is missing or is not one of WAMIT's.
    """
    radiation, (i, j) = _table(path, ".1", 4, slice(1, 3))
    waves, (k,) = _table(path, ".3", 7, slice(2, 3))
    rest, stiff = _table(path, ".hst", 3, slice(0, 2))
    n = 6 * (int(max(i.max(), j.max(), k.max(), stiff.max())) // 6 + 1)
    infinite, hydrostatic = np.zeros((2, n, n))
    hydrostatic[*stiff] = rest[:, 2]
    # period -1 is zero frequency, 0 infinite frequency: no damping there
    finite, limit = radiation[:, 0] > 0.0, radiation[:, 0] == 0.0
    if not limit.any():
        raise InputError(f"{path}.1: no rows of period 0, the added mass at infinite frequency; let WAMIT compute them")
    infinite[i[limit], j[limit]] = radiation[limit, 3]
    period, where = np.unique(radiation[finite, 0], return_inverse=True)
    frequency = 2.0 * np.pi / period
    added, damping = np.zeros((2, len(period), n, n))
    added[where, i[finite], j[finite]] = radiation[finite, 3]
    damping[where, i[finite], j[finite]] = radiation[finite, 4]
    damping *= frequency[:, None, None]
    periods, at = np.unique(waves[:, 0], return_inverse=True)
    if len(periods) != len(period) or not np.allclose(periods, period, rtol=1e-5):
        raise InputError(f"{path}.3: its periods are not those of {path.name}.1; the files do not belong together")
    heading, along = np.unique(waves[:, 1], return_inverse=True)
    excitation = np.zeros((len(period), len(heading), n), dtype=np.complex128)
    excitation[at, along, k] = waves[:, 5] + 1j * waves[:, 6]
    back = slice(None, None, -1)  # by rising frequency
    return HydroCoefficients(
        frequency[back], added[back], damping[back], infinite, heading, excitation[back], hydrostatic,
        *_pairs(path, ".12d", -1.0), *_pairs(path, ".12s", 1.0),
    )  # fmt: skip


def _pairs(path: Path, end: str, sign: float) -> tuple[Float, Complex, Float]:
    """Frequencies, forces of pairs of waves of one heading each, and headings, from a file of second order if there is
    one; by exchange of the waves forces are conjugate (sign -1) or equal (1)."""
    if not path.with_name(path.name + end).is_file():
        return NONE, NO_FORCE, NONE
    q, (k,) = _table(path, end, 9, slice(4, 5))
    one = q[:, 2] == q[:, 3]
    q, k = q[one], k[one]
    period, place = np.unique(q[:, :2], return_inverse=True)
    heading, h = np.unique(q[:, 2], return_inverse=True)
    a, b = len(period) - 1 - place.reshape(-1, 2).T  # by rising frequency
    force = np.zeros((len(heading), len(period), len(period), 6), dtype=np.complex128)
    force[h, b, a, k] = q[:, 7] + sign * 1j * q[:, 8]
    force[h, a, b, k] = q[:, 7] + 1j * q[:, 8]
    return 2.0 * np.pi / period[::-1], force, heading


def _table(path: Path, end: str, least: int, modes: slice) -> tuple[Float, NDArray[np.int64]]:
    """(N, C) numbers of a file, and (M, N) modes of some columns, counted from 0; lines of text are skipped, rows with
    fewer columns have zeros there."""
    name = path.with_name(path.name + end)
    rows = []
    for line in bytes_of(name, LARGEST).decode("latin-1").splitlines():
        try:
            rows.append([float(each) for each in line.replace("D", "E").split()])
        except ValueError:
            continue
    rows = [row for row in rows if len(row) >= least]
    if not rows:
        raise InputError(f"{name}: expected at least {least} numbers in a row, found none; is it a file of WAMIT?")
    width = max(map(len, rows))
    table = np.array([row + [0.0] * (width - len(row)) for row in rows])
    columns = table[:, modes].T.astype(np.int64) - 1
    most = 6 if end.startswith(".12") else 6 * MOST_BODIES
    if columns.min() < 0 or columns.max() >= most:
        raise InputError(
            f"{name}: modes must be from 1 to {most}, found {columns.min() + 1} to {columns.max() + 1}"
            + " (forces of second order are those of one body)" * (most == 6)
        )
    return table, columns
