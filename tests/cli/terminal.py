"""How tests call the command line."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import typer

from meltemi.app.cli import app

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


def succeeded(ran: Ran, folder: Path, *names: str) -> None:
    """The command ended well and wrote exactly these files, which it names."""
    assert ran.status == 0, ran
    assert ran.err == ""
    assert sorted(ran.files) == sorted(folder / name for name in names)
    assert sorted(folder.iterdir()) == sorted(ran.files)
    assert all(path.stat().st_size > 0 for path in ran.files)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in ran.files if path.suffix == ".png")


def refused(ran: Ran, out: Path, *parts: str) -> None:
    """Nothing was computed or written, and the message says all these things."""
    assert ran.status == 2
    assert ran.out == ""
    assert ran.err.startswith("error: ")
    assert "Traceback" not in ran.err
    assert "pydantic" not in ran.err
    for part in parts:
        assert part in ran.err
    if out.is_dir():
        assert list(out.rglob("*")) == []


def check_next(line: str) -> None:
    """The command that a ``next:`` line names exists, and takes its options and arguments."""
    words = shlex.split(line)
    assert words[:2] == ["next:", "meltemi"], line
    group: Any = typer.main.get_command(app)
    context = group.make_context("meltemi", words[2:])
    while hasattr(group, "resolve_command"):
        name, command, rest = group.resolve_command(context, [*context._protected_args, *context.args])
        context, group = command.make_context(name, rest, parent=context), command


Command = Callable[..., Ran]
