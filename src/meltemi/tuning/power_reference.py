"""Power references of comparisons: a share of rated power, or a series of shares from a CSV file."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from meltemi.controllers.specification import BaselineCase, FixedCase, SupervisedCase, specification
from meltemi.core.errors import InputError
from meltemi.core.files import text_of
from meltemi.core.series import TimeSeries
from meltemi.core.yamlfile import validated
from meltemi.environment.grid import PowerGrid
from meltemi.simulation.result import Result

HEAD = ["time", "share"]


def power_grid(text: str, rated_power: float) -> PowerGrid:
    """Grid with the power reference of an option: ``0.75``, or a CSV file with the columns time [s] and share.

    Raises:
      InputError: it is neither, or a share is not between 0 and 1.
    """
    try:
        return PowerGrid(power_reference=_share(text, "--power") * rated_power)
    except ValueError:
        path = Path(text)
    if path.suffix.lower() != ".csv":
        raise InputError(f"--power {text!r}: expected a share of rated power, e.g. 0.75, or a CSV file of time,share")
    head, *rows = csv.reader(line for line in text_of(path).splitlines() if line.strip()) or [[]]
    if [name.strip() for name in head] != HEAD or not rows:
        raise InputError(f"{path}: expected the columns {','.join(HEAD)} [s, share of rated power], and rows")
    try:
        time, share = zip(*((float(t), _share(x, str(path))) for t, x in rows), strict=True)
    except ValueError:
        raise InputError(f"{path}: expected two numbers in each row after {','.join(HEAD)}") from None
    series = {"time": np.array(time), "value": rated_power * np.array(share)}
    return PowerGrid(power_reference=validated(series, TimeSeries, str(path)))


def followed_grid(text: str | None, names: Iterable[str], rated_power: float) -> PowerGrid | None:
    """The grid of :func:`power_grid` where the option is given, which all of these controllers follow.

    Raises:
      InputError: the option is not valid, or one of meltemi's controllers does not follow a power reference.
    """
    if text is None:
        return None
    for name in names:
        if isinstance(specification(name), BaselineCase | SupervisedCase | FixedCase):
            raise InputError(
                f"--power: the controller {name!r} does not follow a power reference; name some of A0, A1, A2, A3, "
                "or a user's controller"
            )
    return power_grid(text, rated_power)


def _share(text: str, where: str) -> float:
    share = float(text)
    if not 0.0 < share <= 1.0:
        raise InputError(f"{where}: a power reference of {text.strip()}: expected a share of rated power, 0 to 1")
    return share


def tracking_error(result: Result) -> float:
    """[W] root mean square of the power's deviation from its reference."""
    return float(np.sqrt(np.mean((result["generator_power"] - result["power_reference"]) ** 2)))
