"""Safe file access: reading with a size limit, atomic writing."""

from __future__ import annotations

import os
import stat
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from meltemi.core.errors import InputError

LARGEST_TEXT = 256_000_000
"""[bytes] largest size of a text that is read as a whole."""


@contextmanager
def reading(path: Path, largest: int | None = None) -> Iterator[tuple[BinaryIO, int]]:
    """Open a regular file for reading; yields it with its size in bytes.

    Args:
      path: path of a regular file; devices and pipes may have no end.
      largest: [bytes] largest allowed size.

    Raises:
      InputError: the file cannot be opened or read, is no regular file, or is larger.
    """
    try:
        kind = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a null character
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if not stat.S_ISREG(kind):  # a pipe would wait for its writer when it is opened
        what = "a folder" if stat.S_ISDIR(kind) else "a device or a pipe"
        raise InputError(f"{path}: cannot be read (it is {what}, expected a file)")
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if largest is not None and size > largest:
                raise InputError(f"{path}: cannot be read ({size / 1e6:.0f} MB, expected at most {largest / 1e6:g} MB)")
            yield file, size
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def bytes_of(path: Path, largest: int = LARGEST_TEXT) -> bytes:
    """Content of a file, limited to its size (zero for endless system files).

    Raises:
      InputError: as in :func:`reading`.
    """
    with reading(path, largest) as (file, size):
        return file.read(size)


def text_of(path: Path, largest: int = LARGEST_TEXT) -> str:
    """Content of a text file; invalid UTF-8 bytes are replaced.

    Raises:
      InputError: as in :func:`reading`.
    """
    return bytes_of(path, largest).decode("utf-8-sig", errors="replace")


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary names in the same folder, renamed to the given ones when all is written.

    Raises:
      InputError: a file cannot be written; those that were there before are then still there.
    """
    partial: list[Path] = []
    try:
        for path in paths:
            check_name(path)
            if path.exists() and not path.is_file():
                raise InputError(f"{path}: cannot be written (it is {'a folder' if path.is_dir() else 'not a file'})")
            if not path.parent.is_dir():
                raise InputError(f"{path}: cannot be written (the folder {path.parent} does not exist)")
        # with the process's number, so that two that write one file do not write into each other's
        partial += [path.with_name(f".{path.name}.{os.getpid()}.part") for path in paths]
        yield partial
        for new, path in zip(partial, paths, strict=True):
            new.replace(path)
    except OSError as error:
        raise InputError(f"{paths[0]}: cannot be written ({error.strerror or error})") from None
    finally:
        for new in partial:
            with suppress(OSError):
                new.unlink()


def write_text(path: Path, text: str) -> Path:
    """Write a text file atomically.

    Raises:
      InputError: the file cannot be written.
    """
    with replacing(path) as (partial,):
        partial.write_text(text, encoding="utf-8")
    return path


def check_name(path: Path) -> None:
    """Reject output file names with control characters or invalid text.

    Raises:
      InputError: the name has control characters, or bytes that are no text.
    """
    if any(unicodedata.category(c) in ("Cc", "Cs") for c in str(path)):
        raise InputError(f"{str(path)!r}: cannot be written (the name contains control characters or invalid text)")
