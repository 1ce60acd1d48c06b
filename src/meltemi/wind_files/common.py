"""Shared functions of the readers and writers of wind files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.files import reading as reading
from meltemi.core.files import replacing as replacing
from meltemi.core.files import text_of as text_of
from meltemi.wind.fields import WindBox

CHUNK = 1 << 18
"""Number of values that are converted at a time, so that a field is not in memory three times."""


def spans(planes: int, per_plane: int) -> Iterator[slice]:
    """Slices of planes with about CHUNK numbers each."""
    step = max(CHUNK // per_plane, 1)
    return (slice(i, min(i + step, planes)) for i in range(0, planes, step))


def numbers(file: BinaryIO, kind: str, count: int, path: Path) -> NDArray[Any]:
    """The next ``count`` numbers of a file whose size has been checked."""
    values = np.fromfile(file, kind, count)
    if values.size < count:
        raise InputError(f"{path}: cut off: it was shortened while being read")
    return values


def decimal(value: float) -> float:
    """The shortest decimal number that has this single-precision value: 0.1, not 0.10000000149."""
    return float(str(np.float32(value)))


def is_number(word: str) -> bool:
    """Whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def middle(box: WindBox) -> float:
    """Hub height [m] to write: that of the box or, if missing, of the grid centre."""
    return box.hub_height if box.hub_height is not None else 0.5 * (box.bottom + box.top)


def refuse_direction(box: WindBox, what: str) -> None:
    """Raise an error for a box with a direction if the format cannot store it."""
    if box.direction:
        raise InputError(
            f"{box.label}: {what} cannot store the direction of {np.degrees(box.direction):g} deg: write "
            "dataclasses.replace(box, direction=0.0) and specify the direction in the program that reads the file "
            "(or write .nc, which stores it)"
        )


def box_or_error(path: Path, **box: Any) -> WindBox:
    """Create a wind box; errors name the file."""
    try:
        return WindBox(**box)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
