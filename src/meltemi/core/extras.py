"""Optional packages: which are missing, and how to install them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, distribution

from meltemi.core.errors import InputError

REQUIREMENTS = (
    "anywidget>=0.9,<1",
    "capytaine>=3.0,<4",
    "control>=0.10,<0.12",
    "cyipopt>=1.4,<2",
    "distributed>=2024.8",
    "fmpy>=0.3.20,<0.4",
    "gymnasium>=1.0,<2",
    "neuralfoil>=0.3.2,<0.4",
    "numba-cuda[cu12]>=0.28,<0.31",
    "openpyxl>=3.1,<4",
    "pandas>=2.2,<4",
    "pettingzoo>=1.24,<2",
    "pyarrow>=18",
    "pythonfmu3>=0.3.4,<0.4",
    "pythonfmu>=0.7,<0.8",
    "python-docx>=1.1,<2",
    "rosco>=2.10,<3",
    "scikit-learn>=1.5,<2",
    "websockets>=14",
    "windIO>=2.1,<3",
    "xarray>=2024.7,<2028",
)
"""Requirements of the extras of ``pyproject.toml``: messages name packages, as the package index has no meltemi."""
BY_NAME = {re.split(r"[\[><=]", requirement)[0]: requirement for requirement in REQUIREMENTS}
ALONE = {"rosco": "--no-deps "}
"""Packages whose library works without what they require."""


class MissingPackageError(InputError):
    """An optional package is not installed."""


def installed(package: str) -> bool:
    """Whether a package is installed, without importing it."""
    try:
        distribution(package)
    except PackageNotFoundError:
        return False
    return True


def missing(packages: Sequence[str]) -> str:
    """Which of some packages are missing, with the command that installs them; empty if all are installed."""
    lacking = [name for name in packages if not installed(name)]
    if not lacking:
        return ""
    wanted = " ".join(shlex.quote(BY_NAME[name]) for name in lacking)
    names, are = " and ".join(lacking), "is" if len(lacking) == 1 else "are"
    return f"{names}, which {are} not installed: pip install {''.join(ALONE.get(name, '') for name in lacking)}{wanted}"


def need(what: str, *packages: str) -> None:
    """Refuse a feature whose packages are not installed.

    Raises:
      MissingPackageError: a package is missing.
    """
    if words := missing(packages):
        raise MissingPackageError(f"{what} needs {words}")


def skipped(needs: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """The features that are skipped because a package is missing, with the sentence for the start of a command.

    Args:
      needs: packages by the name of what needs them.
    """
    return {what: f"skipped: {what}: needs {words}" for what, names in needs.items() if (words := missing(names))}
