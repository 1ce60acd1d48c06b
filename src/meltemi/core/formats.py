"""File formats as rows of a table: what every list of formats, every message and every choice of a format reads.

A format is a module with a function that reads and one that writes, and one row in the table of its kind of files.
The functions are imported at first use, so that a table costs nothing to look at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from meltemi.core.errors import InputError, did_you_mean


@dataclass(frozen=True)
class FileFormat:
    """One format of files.

    Attributes:
      name, suffix: name and suffix of the format.
      text: description, for lists and messages.
      module, reader, writer: module of its functions, and their names.
      begins: first bytes of its files, where another format may have the same suffix; empty: any.
      note: column of the documentation.
    """

    name: str
    suffix: str
    text: str
    module: str
    reader: str
    writer: str
    begins: tuple[bytes, ...] = ()
    note: str = ""

    @property
    def read(self) -> Callable[..., Any]:
        """The function that reads."""
        reader: Callable[..., Any] = getattr(import_module(self.module), self.reader)
        return reader

    @property
    def write(self) -> Callable[..., Any]:
        """The function that writes."""
        writer: Callable[..., Any] = getattr(import_module(self.module), self.writer)
        return writer

    def fits(self, begin: bytes) -> bool:
        """Whether a file with these first bytes may be of this format."""
        return not self.begins or begin.startswith(self.begins)


F = TypeVar("F", bound=FileFormat)


def with_suffix(formats: Sequence[F], path: Path, kind: str) -> list[F]:
    """Formats with the suffix of a path; ``kind`` of files, such as ``wind file``, is for the message.

    Raises:
      InputError: there is none; the message lists the suffixes.
    """
    matching = [f for f in formats if f.suffix == path.suffix.lower()]
    if not matching:
        raise InputError(
            f"{path}: {path.suffix or 'a name without suffix'!r} is not the suffix of a {kind}; "
            f"{hint(path.suffix, [f.suffix for f in formats])}"
        )
    return matching


def with_name(formats: Sequence[F], name: str, kind: str) -> F:
    """The format of a name.

    Raises:
      InputError: there is none; the message lists the names.
    """
    for f in formats:
        if f.name == name:
            return f
    raise InputError(f"unknown {kind} format {name!r}; {hint(name, [f.name for f in formats])}")


def suffixes(formats: Iterable[FileFormat]) -> str:
    """The suffixes of formats, for help texts: ``.bts, .wnd, .bin``."""
    return ", ".join(dict.fromkeys(f.suffix for f in formats))


def hint(name: str, valid: Iterable[str]) -> str:
    """Hint with the closest and all valid names."""
    valid = list(dict.fromkeys(valid))
    near = did_you_mean(name, valid)
    return f"{near} " * near.startswith("did") + f"supported are {', '.join(valid)}"
