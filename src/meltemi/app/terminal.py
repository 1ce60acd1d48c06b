"""Output of the commands: progress, tables, files and the next command as text or JSON; the output folder."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress
from dataclasses import dataclass, field
from datetime import timedelta
from io import StringIO
from pathlib import Path
from time import monotonic
from typing import Annotated, Any

import typer

from meltemi.core.errors import InputError, MeltemiError
from meltemi.core.files import check_name


class Folder:
    """Marks an option whose folder is there, and can be written, when the command begins (:func:`folder_for`)."""


OutOption = Annotated[Path, "Folder for the results.", Folder()]


@contextmanager
def simulation_bar(what: str, amount: float = 0.0, unit: str = "") -> Iterator[Callable[[float], None]]:
    """A :func:`progress_bar` of work that simulates: a first compilation is announced above it, and shared."""
    from meltemi.compiler import announce

    if announce():
        from meltemi.app.warmup import compile_beside

        compile_beside("stepping")  # with the section loads, which a run needs last
    with progress_bar(what, amount, unit) as done:
        yield done


@contextmanager
def progress_bar(what: str, amount: float = 0.0, unit: str = "") -> Iterator[Callable[[float], None]]:
    """A progress bar with rate and time left on a terminal, otherwise none; it moves to and fro until a share is known.

    Args:
      what: text beside the bar.
      amount: amount of the whole work, in ``unit``, for the rate; 0 shows no rate.
      unit: counted items, such as runs; ``s`` is simulated time.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    console = Console(stderr=True)
    first: list[tuple[float, float]] = []
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[speed]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None, speed="")  # moves to and fro until a share is known

        def done(share: float) -> None:
            if not first:  # what was there before, and preparation, do not count
                first.append((share, monotonic()))
            gained, seconds = share - first[0][0], monotonic() - first[0][1]
            words = filter(None, (rate(gained * amount, seconds, unit), time_left(gained, seconds, 1.0 - share)))
            bar.update(task, total=1.0, completed=share, speed=", ".join(words))

        yield done


def rate(amount: float, seconds: float, unit: str) -> str:
    """Amount per time, by the unit of time in which it is above one: ``12 runs/min``; simulated time in times real
    time; empty if nothing was done or counted."""
    if not (amount > 0.0 and seconds > 0.0):
        return ""
    speed = amount / seconds
    if unit == "s":
        return f"{speed:.3g} times real time"
    span, name = next(((s, n) for s, n in ((1.0, "s"), (60.0, "min")) if speed * s >= 1.0), (3600.0, "h"))
    return f"{speed * span:.3g} {unit}/{name}"


def time_left(gained: float, seconds: float, rest: float) -> str:
    """Time for the rest of the work, from the time that a part of it took: ``0:01:20 left``."""
    if not (gained > 0.0 and seconds > 0.0):
        return ""
    return f"{timedelta(seconds=round(seconds * rest / gained))} left"


@dataclass
class _Output:
    """Output of the running command, printed or kept for JSON."""

    json: bool = False
    tables: list[dict[str, Any]] = field(default_factory=list)
    values: dict[str, Any] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    next: str = ""


_OUTPUT = [_Output()]
"""The last one is that of the running command."""


@contextmanager
def output(command: str, as_json: bool) -> Iterator[None]:
    """The output of a command: text that ends with the next command, or one JSON object and nothing else."""
    now, text = _Output(as_json), StringIO()
    _OUTPUT.append(now)
    try:
        with redirect_stdout(text) if as_json else nullcontext():
            yield
    except typer.Exit:  # of incomplete results
        _end(command, now, text.getvalue())
        raise
    except (MeltemiError, OSError) as error:  # the entry point prints it to stderr
        if as_json:
            now.values["error"], now.next = str(error), ""
            _end(command, now, text.getvalue())
        raise
    else:
        _end(command, now, text.getvalue())
    finally:
        _OUTPUT.pop()


def _end(command: str, now: _Output, text: str) -> None:
    if not now.json:
        if now.next:
            print(f"next: {now.next}")
        return
    import json

    report = {"command": command, "tables": now.tables, **now.values, "notes": text.splitlines()}
    report |= {"messages": now.messages, "files": now.files, "next": now.next}
    print(json.dumps(report, indent=1, ensure_ascii=False))


def say(text: str) -> None:
    """Print a message to stderr."""
    _OUTPUT[-1].messages.append(text)
    print(text, file=sys.stderr)


def warn(words: Iterable[object], kind: str = "warning") -> None:
    """Print messages of a kind to stderr."""
    for each in words:
        say(f"{kind}: {each}")


def made_by() -> dict[str, str]:
    """Command line and version, for the page of a command."""
    import meltemi

    return {"repeat": shlex.join(["meltemi", *sys.argv[1:]]), "footer": f"meltemi {meltemi.__version__}"}


def wrote(*files: Path) -> None:
    """Print the files that a command wrote."""
    for file in files:
        if _OUTPUT[-1].json:
            _OUTPUT[-1].files.append(str(file))
        else:
            print(f"wrote {file}")


def write_figure(file: Path, figure: Any) -> Path:
    """Write a figure of Matplotlib, which is then closed; returns the file."""
    from meltemi.report.plots import save

    return save(figure, file)


def write_results(name: Path, rows: Rows, figure: Any) -> list[Path]:
    """Write a table as ``name``.csv and a figure of Matplotlib as ``name``.png."""
    from meltemi.report.tables import write_csv

    return [write_csv(name.with_suffix(".csv"), *rows), write_figure(name.with_suffix(".png"), figure)]


def suggest(*words: object) -> None:
    """Set the command that the output ends with, as it is typed after ``meltemi``."""
    _OUTPUT[-1].next = shlex.join(["meltemi", *map(str, words)])


def print_values(name: str, values: Any, lines: Callable[[Any], Sequence[str]]) -> None:
    """Print values as lines, or with ``--json`` unchanged under a name."""
    if _OUTPUT[-1].json:
        _OUTPUT[-1].values[name] = values
        return
    for line in lines(values):
        print(line)


Rows = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Header and rows of a table."""


def print_table(
    title: str,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    text_columns: int = 1,
    *,
    all_rows: Rows | None = None,
) -> None:
    """Print a table as :func:`meltemi.report.tables.rich_table` makes it, or keep it for ``--json``.

    Args:
      title, head, rows: title, header and rows of the table.
      text_columns: the first columns, which are text.
      all_rows: header and rows for ``--json``, where the terminal shows a selection.
    """
    if _OUTPUT[-1].json:
        _OUTPUT[-1].tables.append(records(title, *(all_rows or (head, rows)), text_columns))
        return
    from rich.console import Console

    from meltemi.report.tables import rich_table

    console = Console()
    wide = console if console.is_terminal else Console(width=160)
    wide.print(rich_table(title, head, rows, text_columns))


def records(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int) -> dict[str, Any]:
    """A table for programs: title, units by column, and rows as objects with numbers in all digits."""
    from meltemi.report.tables import HEAD_UNIT

    names, units = [], {}
    for i, text in enumerate(" ".join(column.split()) or "item" for column in head):
        match = HEAD_UNIT.fullmatch(text)
        name = match[1] if match and match[1] not in names else text
        name = name if name not in names else f"{name} ({i + 1})"
        names.append(name)
        if match:
            units[name] = match[2]
    objects = [
        {name: _plain(cell, i < text_columns) for i, (name, cell) in enumerate(zip(names, row, strict=False))}
        for row in rows
    ]
    return {"title": title, "units": units, "rows": objects}


def _plain(cell: str, text: bool) -> str | float | int | None:
    """A cell as number where it is one; empty cells and those of missing numbers are null."""
    value = getattr(cell, "value", None)  # of a formatted number
    if value is None and not text and re.fullmatch(r"[+-]?\d+", cell):
        return int(cell)
    if value is None and not text:
        with suppress(ValueError):
            value = float(cell)
    if value is None:
        return str(cell) or None
    return value if abs(value) < float("inf") else None  # JSON has neither


def folder_for(out: Path, option: str = "--out") -> Path:
    """The output folder, tested to be writable before the computation starts.

    Folders created for it are removed at the end of the command if they are empty.
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
"""Folders that this command has created, inner ones first."""


def remove_empty_folders() -> None:
    """Remove the empty folders that the command created."""
    while _MADE:
        with suppress(OSError):  # only empty ones can be removed
            _MADE.pop(0).rmdir()
