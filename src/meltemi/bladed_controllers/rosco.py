"""ROSCO: path of the library of an installed package, and edited copies of its input file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.metadata import Distribution, distribution
from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need

SUFFIXES = (".so", ".dylib", ".dll")


def find_rosco() -> Path:
    """Path of ROSCO's controller library, for :func:`BladedController`.

    The rosco package is looked up, not imported: its Python side needs packages that the library does not.

    Raises:
      InputError: the package is not installed, or has no library.
    """
    package = _package()
    for suffix in SUFFIXES:
        path = Path(str(package.locate_file(f"rosco/lib/libdiscon{suffix}")))
        if path.is_file():
            return path
    raise InputError(f"rosco {package.version} has no controller library in {package.locate_file('rosco/lib')}")


def is_rosco(library: Path) -> bool:
    """Whether a library is that of the installed rosco package."""
    try:
        return library.samefile(find_rosco())
    except (InputError, OSError):
        return False


def _package() -> Distribution:
    need("controller rosco", "rosco")
    return distribution("rosco")


def rosco_example(name: str) -> Path:
    """Path of a file of ROSCO's examples, e.g. ``"Test_Cases/NREL-5MW/DISCON.IN"``.

    Raises:
      InputError: the package is not installed, or has no such file.
    """
    package = _package()
    path = Path(str(package.locate_file(f"Examples/{name}")))
    if not path.is_file():
        raise InputError(f"rosco {package.version} has no Examples/{name}")
    return path


def edit_discon(source: str | Path, target: str | Path, **changes: float | str | Sequence[float]) -> Path:
    """Copy a ``DISCON.IN`` with other values.

    Relative paths in it refer to the folder of the source; in the copy they are absolute, except changed ones.

    Args:
      source: original file.
      target: copy, overwritten if it exists.
      changes: new values by ROSCO's names, e.g. ``IPC_ControlMode=1, IPC_KI=(1e-8, 0.0)``.

    Returns:
      Path of the copy.

    Raises:
      InputError: a file cannot be read or written, or has no such name.
    """
    source, target = Path(source), Path(target)
    try:
        lines = source.read_text(encoding="utf-8", errors="surrogateescape").splitlines()
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror or error})") from None
    names = {match[1]: i for i, line in enumerate(lines) if (match := _NAME.search(line))}
    for name, value in changes.items():
        if name not in names:
            raise InputError(f"{source}: has no {name!r}; {did_you_mean(name, names)}")
        text = value if isinstance(value, str) else " ".join(f"{v:.10g}" for v in np.atleast_1d(value))
        lines[names[name]] = f"{text}  ! {name}"
    for name in _PATHS:
        match = _QUOTED.match(lines[names[name]]) if name in names and name not in changes else None
        if match and (source.parent / match[1]).is_file():
            lines[names[name]] = f'"{(source.parent / match[1]).absolute()}"  ! {name}'
    try:
        target.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="surrogateescape")
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror or error})") from None
    return target


_NAME = re.compile(r"!\s*(\w+)")
_QUOTED = re.compile(r"""\s*["'](.+?)["']""")
_PATHS = ("PerfFileName", "OL_Filename", "DLL_FileName", "DLL_InFile")
