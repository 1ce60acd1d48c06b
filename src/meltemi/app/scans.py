"""Values of scans from the command line, and messages on failed points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import typer

from meltemi.app.terminal import say
from meltemi.core.errors import InputError

MOST = 1000
"""Largest number of values of a scan."""


def finish(failed: Iterable[str], *, interrupted: bool = False) -> None:
    """Print what failed to stderr, and exit with status 1 if anything did."""
    failures = list(failed)
    for words in failures:
        say(words)
    if interrupted:
        say("interrupted; partial results are written")
        raise typer.Exit(130)
    if failures:
        raise typer.Exit(1)


def at_speeds(failures: Mapping[float, str], unit: str = "m/s") -> list[str]:
    """Messages on the failed points of a scan, for :func:`finish`."""
    return [f"failed at {value:.4g} {unit}: {why}" for value, why in failures.items()]


def cells(failures: Mapping[str, str]) -> list[str]:
    """Messages on the failed runs of a study, for :func:`finish`."""
    return [f"failed: {cell}: {why}" for cell, why in failures.items()]


def values_of(text: str, option: str) -> list[float]:
    """Numbers from text such as 4,6,8 or 4:24:2.

    Raises:
      InputError: it is something else, or more than 1000 numbers.
    """
    try:
        if ":" not in text:
            return [float(x) for x in text.split(",")]
        first, last, step = (float(x) for x in text.split(":"))
    except ValueError:
        raise InputError(f"{option} {text!r}: expected 4,6,8 or 4:24:2 (first:last:step)") from None
    if not (step > 0.0 and last >= first):
        raise InputError(
            f"{option} {text!r}: expected first:last:step with a positive step and a last value not below the first"
        )
    if not (last - first) / step < MOST:
        raise InputError(f"{option} {text!r}: more than {MOST} values; take a larger step")
    return [first + i * step for i in range(int((last - first) / step + 1e-9) + 1)]


def pairs_of(text: str, option: str, expected: str = "NAME=VALUE") -> dict[str, str]:
    """Values by name from text such as a=1,b=2:3.

    Raises:
      InputError: it is something else.
    """
    pairs = [part.partition("=") for part in text.split(",") if part.strip()]
    if not pairs or any(not (name.strip() and sign and value.strip()) for name, sign, value in pairs):
        raise InputError(f"{option} {text!r}: expected {expected}, separated by commas")
    return {name.strip(): value.strip() for name, _, value in pairs}


def numbers_of(text: str, option: str, expected: str = "NAME=NUMBER") -> dict[str, float]:
    """Numbers by name from text, as :func:`pairs_of`."""
    try:
        return {name: float(value) for name, value in pairs_of(text, option, expected).items()}
    except ValueError:
        raise InputError(f"{option} {text!r}: expected {expected}, separated by commas") from None


def angles_of(text: str, option: str) -> list[float]:
    """Angles [deg] from text, as :func:`values_of`, none beyond half a turn."""
    angles = values_of(text, option)
    if not all(abs(angle) <= 180.0 for angle in angles):
        raise InputError(f"{option} {text!r}: expected angles between -180 and 180 deg")
    return angles


def speeds_of(text: str, option: str = "--wind-speeds", unit: str = "m/s", *, zero: bool = False) -> list[float]:
    """Speeds from text, as :func:`values_of`.

    Raises:
      InputError: a speed is not positive (with ``zero``: negative) or above 100.
    """
    speeds = values_of(text, option)
    if not all(0.0 < speed <= 100.0 or (zero and speed == 0.0) for speed in speeds):
        raise InputError(f"{option} {text!r}: expected speeds between 0 and 100 {unit}")
    return speeds
