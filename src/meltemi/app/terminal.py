"""Shared functions of the commands: progress bar, tables, output folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from subprocess import DEVNULL, Popen
from typing import Annotated, Any

import typer

from meltemi.core.errors import InputError
from meltemi.core.files import check_name

OutOption = Annotated[Path, typer.Option("--out", help="Folder for the results.")]

_BESIDE: list[Popen[bytes]] = []
"""Processes that compile for this one."""


@contextmanager
def progress_bar(what: str, *, compiles: bool = True) -> Iterator[Callable[[float], None]]:
    """A progress bar on a terminal, otherwise none; the first compilation of ``compiles`` is announced."""
    from meltemi.core.kernel import announce
    from meltemi.core.threads import available_cores

    if compiles and announce() and available_cores() > 1:  # said before the bar, which would wrap it
        # section loads, which a run needs last, are compiled by a second process meanwhile
        command = [sys.executable, "-m", "meltemi.studies.warmup", "section loads"]
        _BESIDE.append(Popen(command, stdout=DEVNULL, stderr=DEVNULL))
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def say(text: str) -> None:
    """Print a message to stderr."""
    print(text, file=sys.stderr)


def print_table(*arguments: Any, **keywords: Any) -> None:
    """Print a table as :func:`meltemi.report.tables.rich_table` makes it."""
    from rich.console import Console

    from meltemi.report.tables import rich_table

    console = Console()
    wide = console if console.is_terminal else Console(width=160)
    wide.print(rich_table(*arguments, **keywords))


@contextmanager
def results_in(out: Path) -> Iterator[Path]:
    """The output folder, for a command that reports an interruption."""
    try:
        yield folder_for(out)
    except KeyboardInterrupt:
        say("interrupted")
        raise


def folder_for(out: Path, option: str = "--out") -> Path:
    """The output folder, tested to be writable before the computation starts.

    What is made of it goes again at the end of the command if nothing has been written into it.
    """
    try:
        check_name(out)
        _MADE.extend(folder for folder in (out, *out.parents) if not folder.exists())
        out.mkdir(parents=True, exist_ok=True)
        probe = out / f".meltemi-probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(f"{option} {out}: cannot be written ({error.strerror or error})") from None
    return out


_MADE: list[Path] = []
"""Folders by this command, inner ones first."""


def remove_empty_folders() -> None:
    """Remove the empty folders that the command created."""
    while _MADE:
        with suppress(OSError):  # only empty ones can be removed
            _MADE.pop(0).rmdir()
