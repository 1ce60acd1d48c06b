"""Turbines of the windIO package."""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.core.extras import BY_NAME, need

WINDIO = "windIO/examples/turbine"
"""Folder of the turbines in the package."""


def windio_file(name: str, wanted_for: str) -> Path:
    """Path of a turbine file in the windIO package, without importing it.

    Raises:
      InputError: the package is not installed, or has no such file.
    """
    need(f"turbine {wanted_for}", "windIO")
    package = distribution("windIO")
    path = Path(str(package.locate_file(f"{WINDIO}/{name}")))
    if not path.is_file():
        install = f"pip install {BY_NAME['windIO']!r}"
        raise InputError(f"windIO {package.version} has no {WINDIO}/{name}, the data of {wanted_for}: {install}")
    return path
