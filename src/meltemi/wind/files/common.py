"""What the readers and writers of wind files share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox

CHUNK = 1 << 18
"""Numbers that are converted at once, so that a field is not in memory three times."""


@contextmanager
def reading(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """A file opened for reading, and its size in bytes.

    Raises:
      InputError: it cannot be opened or read.
    """
    try:
        with path.open("rb") as file:
            yield file, os.fstat(file.fileno()).st_size
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def text_of(path: Path) -> str:
    """Content of a text file; bytes that are no UTF-8 are replaced.

    Raises:
      InputError: it cannot be read.
    """
    with reading(path) as (file, _):
        return file.read().decode("utf-8-sig", errors="replace")


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary names beside the given ones, put in their place when all is written.

    Raises:
      InputError: a file cannot be written; those that were there before are then still there.
    """
    partial = [path.with_name(f".{path.name}.part") for path in paths]
    try:
        for path in paths:
            if path.is_dir():
                raise InputError(f"{path}: cannot be written (it is a folder)")
            if not path.parent.is_dir():
                raise InputError(f"{path}: cannot be written (there is no folder {path.parent})")
        yield partial
        for new, path in zip(partial, paths, strict=True):
            new.replace(path)
    except OSError as error:
        raise InputError(f"{paths[0]}: cannot be written ({error.strerror or error})") from None
    finally:
        for new in partial:
            with suppress(OSError):
                new.unlink()


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
