"""Errors and run status, with their messages.

Files, the command line, functions and records in Python raise :class:`InputError` (where, what
was expected, the closest valid name, what to do); ``build`` raises :class:`UnsupportedError` for
features it does not have; a run that ends early raises :class:`RunError` with what it computed, or in
a batch has a :class:`Status`; one that leaves the range of validity of the model continues and reports it.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum
from typing import Any


class MeltemiError(Exception):
    """Base of all errors raised by this package; the command line prints them in one line."""


class InputError(MeltemiError):
    """Invalid user input: a file, a key, a value, a name."""


class PlacedError(ValueError):
    """A problem that a record finds in itself, with the keys from there to the place where it is."""

    def __init__(self, message: str, *keys: str | int) -> None:
        super().__init__(message)
        self.keys = keys


class UnknownNameError(InputError, KeyError):
    """A name that a mapping, such as a result, does not have."""

    __str__ = Exception.__str__  # a KeyError puts its message in quotes


class UnsupportedError(MeltemiError):
    """A turbine or option that requires a feature this package does not model."""


class RunError(MeltemiError):
    """A simulation ended early, or is doubtful (``Result.raise_for_status``).

    Attributes:
      result: the result up to then, if there is one.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


class Status(IntEnum):
    """Status of a simulation; 0 is success. Kernels set the number; the name is printed."""

    OK = 0
    DIVERGED = 1
    CONTROLLER_RAISED = 2
    CONTROLLER_DEMAND = 3
    INTERRUPTED = 4
    FAILED = 5
    UNKNOWN = 6
    DOUBTFUL = 7

    def __str__(self) -> str:
        return self.name

    __format__ = Enum.__format__  # of the name, as for other enumerations

    @property
    def complete(self) -> bool:
        """The run reached its end, whether or not within the range of validity of the model."""
        return self in (Status.OK, Status.DOUBTFUL)

    @property
    def message(self) -> str:
        """One sentence for the user, with a hint."""
        return _MESSAGES[self]


_MESSAGES: dict[Status, str] = {
    Status.OK: "completed",
    Status.DIVERGED: (
        "the motion diverged (a state became infinite or implausibly large): "
        "try a smaller time step or fewer modes, or inspect the last seconds of the result"
    ),
    Status.CONTROLLER_RAISED: "the controller raised an exception",
    Status.CONTROLLER_DEMAND: "the controller demanded a value that is not finite or out of range",
    Status.INTERRUPTED: "interrupted by the user; the result is incomplete",
    Status.UNKNOWN: "the rotor left the range of tip-speed ratio and pitch for which its power coefficient is defined",
    Status.DOUBTFUL: "completed, but outside the range of validity of the model; see the findings",
    Status.FAILED: "the case of a batch could not be prepared, or its result could not be reduced or written",
}


def closest(name: str, valid: Iterable[str], n: int = 3) -> list[str]:
    """Up to ``n`` valid names that look like ``name``, best first, ignoring case."""
    name, by_lower = str(name), {str(v).lower(): str(v) for v in valid}
    near = difflib.get_close_matches(name.lower(), by_lower, n=4 * n, cutoff=0.5)
    match = difflib.SequenceMatcher(b=name.lower())

    def rank(candidate: str) -> tuple[float, str]:
        match.set_seq1(candidate)
        return (-match.ratio(), candidate)

    return [by_lower[m] for m in sorted(near, key=rank)[:n]]


def place_of(name: str, inside: Mapping[str, Iterable[str]]) -> str:
    """Hint for an unknown key: where it stands one level further down, or the closest of the valid ones.

    Args:
      name: the key.
      inside: keys one level further down of each valid key.
    """
    deeper = [repr(f"{key}.{name}") for key, names in inside.items() if name in names]
    return f"did you mean {' or '.join(deeper)}?" if deeper else did_you_mean(name, inside)


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """Hint for a misspelt name: the closest valid names, or all of them if they are few."""
    valid = [str(each) for each in valid]
    near = closest(str(name), valid)
    if near:
        return f"did you mean {' or '.join(repr(v) for v in near)}?"
    if len(valid) <= 12:
        return f"valid are: {', '.join(sorted(valid))}"
    return f"none of the {len(valid)} valid names is close to it"
