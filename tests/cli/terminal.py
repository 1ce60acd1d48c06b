"""How tests call the command line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

STEADY = """\
turbine: nrel5mw
wind: {kind: steady, speed: 10.0}
duration: 5.0
"""
"""The shortest case."""


class Ran(NamedTuple):
    """How a command ended, and what it printed."""

    status: int
    out: str
    err: str

    @property
    def files(self) -> list[Path]:
        """The files it says it wrote."""
        return [Path(name) for name in re.findall(r"^wrote (.+)$", self.out, re.MULTILINE)]


Command = Callable[..., Ran]
