"""Where the controller library of an installed rosco package lies."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from meltemi.core.errors import InputError

SUFFIXES = (".so", ".dylib", ".dll")


def find_rosco() -> Path:
    """Path of ROSCO's controller library, for :func:`bladed_controller`.

    The rosco package is looked up, not imported: its Python side needs packages that the library does not.

    Raises:
      InputError: the package is not installed, or has no library.
    """
    try:
        package = distribution("rosco")
    except PackageNotFoundError:
        raise InputError(
            "the rosco package is not installed: pip install --no-deps 'rosco>=2.10,<3' "
            "(or give the path of a controller library)"
        ) from None
    for suffix in SUFFIXES:
        path = Path(str(package.locate_file(f"rosco/lib/libdiscon{suffix}")))
        if path.is_file():
            return path
    raise InputError(f"rosco {package.version} has no controller library in {package.locate_file('rosco/lib')}")
