"""What the readers and writers of wind files share."""

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
"""Numbers that are converted at once, so that a field is not in memory three times."""


def spans(planes: int, per_plane: int) -> Iterator[slice]:
    """Slices of planes with about CHUNK numbers each."""
    step = max(CHUNK // per_plane, 1)
    return (slice(i, min(i + step, planes)) for i in range(0, planes, step))


def numbers(file: BinaryIO, kind: str, count: int, path: Path) -> NDArray[Any]:
    """The next ``count`` numbers of a file whose size has been checked."""
    values = np.fromfile(file, kind, count)
    if values.size < count:
        raise InputError(f"{path}: cut off: it became shorter while it was read")
    return values


def decimal(value: float) -> float:
    """The shortest decimal number that has this single-precision value: 0.1, not 0.10000000149."""
    return float(str(np.float32(value)))


def is_number(word: str) -> bool:
    """The word can be read as a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def middle(box: WindBox) -> float:
    """[m] hub height to write: that of the box or, for want of it, of the grid's middle."""
    return box.hub_height if box.hub_height is not None else 0.5 * (box.bottom + box.top)


def refuse_direction(box: WindBox, what: str) -> None:
    """Refuse a turned box where a format has no place for the direction."""
    if box.direction:
        raise InputError(
            f"{box.label}: {what} cannot hold the direction of {np.degrees(box.direction):g} deg: write "
            "dataclasses.replace(box, direction=0.0) and give the direction to the program that reads the file "
            "(or write .nc, which holds it)"
        )


def box_or_error(path: Path, box: dict[str, object]) -> WindBox:
    """A wind box; what it refuses is said with the file's name."""
    try:
        return WindBox(**box)  # type: ignore[arg-type]
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
