"""Names and definitions of the control schemes, without heavy imports, so that commands can list them.

``ipc`` is CPC with feed-forward and 1P feedback to pitch, ``cpfc`` is ``ipc`` with 2P feedback to flaps: the load is
divided by frequency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from meltemi.core.errors import InputError, did_you_mean

Target = tuple[Literal["pitch", "flap"], int]
"""Actuator and harmonic of a loop."""
PITCH_1P: Target = ("pitch", 1)
PITCH_2P: Target = ("pitch", 2)
FLAP_1P: Target = ("flap", 1)
FLAP_2P: Target = ("flap", 2)


@dataclass(frozen=True)
class Scheme:
    """Parts of a load controller in addition to the collective pitch law.

    Attributes:
      about: description in one line.
      loops: feedback loops.
      feedforward: whether it has feed-forward by azimuth.
    """

    about: str
    loops: tuple[Target, ...] = ()
    feedforward: bool = False

    @property
    def flaps(self) -> bool:
        """Whether it requires flaps."""
        return any(actuator == "flap" for actuator, _ in self.loops)


SCHEMES: Mapping[str, Scheme] = {
    "cpc": Scheme("collective pitch"),
    "ipc": Scheme("feed-forward and 1P individual pitch", (PITCH_1P,), True),
    "cpfc": Scheme("ipc and 2P flaps", (PITCH_1P, FLAP_2P), True),
    "feedforward": Scheme("feed-forward by azimuth alone", (), True),
    "feedback": Scheme("1P individual pitch without feed-forward", (PITCH_1P,)),
    "flaps": Scheme("2P flaps alone", (FLAP_2P,)),
    "flaps12": Scheme("1P and 2P flaps, pitch collective", (FLAP_1P, FLAP_2P)),
    "ipc2": Scheme("ipc and 2P individual pitch", (PITCH_1P, PITCH_2P), True),
    "cpfc12": Scheme("ipc and 1P and 2P flaps", (PITCH_1P, FLAP_1P, FLAP_2P), True),
}


def check_schemes(names: Sequence[str]) -> None:
    """Check that names are schemes or Python files.

    Raises:
      InputError: a name is unknown or repeated, a file is missing, or there are no names.
    """
    if not names:
        raise InputError(f"schemes: name at least one of {', '.join(SCHEMES)}, or a Python file")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"schemes: {name!r} is named twice")
        if is_file(name):
            if not Path(name).is_file():
                raise InputError(f"{name}: there is no such file")
        elif name not in SCHEMES:
            raise InputError(f"no scheme {name!r}: {did_you_mean(name, SCHEMES)} (or give a Python file)")
    labels = [label(name) for name in names]
    for each in labels:
        if labels.count(each) > 1:
            raise InputError(f"schemes: two of them are called {each!r}")


def label(name: str) -> str:
    """Label of a scheme in tables and files."""
    return Path(name).stem if is_file(name) else name


def is_file(name: str) -> bool:
    """Whether a name is that of a Python file."""
    return name.endswith(".py")
