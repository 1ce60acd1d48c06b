"""Groups of commands, and the commands of other packages.

These register them as entry points of the group ``meltemi.commands``.

An entry point is a function whose docstring is the help and whose arguments are the options
(:mod:`meltemi.app.signatures`), or a ``Typer`` with subcommands. ``meltemi --help`` imports its module, so heavy
imports belong into the function; another command does not import it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperGroup

from meltemi.app.signatures import with_options
from meltemi.app.terminal import say
from meltemi.core.errors import InputError, RunError, Status

Function = TypeVar("Function", bound=Callable[..., None])
GROUP = "meltemi.commands"
SECTIONS = {
    "Simulate": "run power-curve campbell flutter parked farm yaw-limits live",
    "Look at inputs and results": "turbines inspect channels wind sea diff view observe",
    "Design loads": "loads stress surrogate climate",
    "Control": "compare bench-controller export-controller export-rosco export-linear",
    "Platforms": "hydro rao",
    "Other programs": "import export export-fmu",
    "Verification": "validate verify reproduce bench",
    "Help and files": "docs template warmup",
}
"""Commands of the help, by what they are for; those of other packages come last."""


class CommandGroup(typer.Typer):
    """A group of commands that take their options from the signatures of their functions."""

    def __init__(self, about: str, kind: type[TyperGroup] = TyperGroup, **settings: Any) -> None:
        super().__init__(cls=kind, help=about, no_args_is_help=True, rich_markup_mode=None, **settings)

    def command(self, *names: Any, **settings: Any) -> Callable[[Function], Function]:
        """Decorator: a function is a command, see :func:`with_options`; it is returned as it is."""
        register = super().command(*names, **settings)

        def decorate(function: Function) -> Function:
            register(with_options(function))
            return function

        return decorate


class Commands(TyperGroup):
    """Commands of meltemi, and those of other packages, loaded when an unknown name is used."""

    def invoke(self, ctx: Any) -> Any:
        """Run a command; Ctrl-C, also in a run that it needs, ends it in a line, with exit status 130."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, RunError) as error:
            if isinstance(error, RunError) and getattr(error.result, "status", None) is not Status.INTERRUPTED:
                raise
            say("interrupted")
            raise typer.Exit(130) from None

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, ours first."""
        self._add_registered()
        return super().list_commands(ctx)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands of the help in sections."""
        names = self.list_commands(ctx)
        wide = max(map(len, names))
        lines = {name: self.get_command(ctx, name).get_short_help_str(formatter.width - 6 - wide) for name in names}
        of_others = " ".join(name for name in names if name not in " ".join(SECTIONS.values()).split())
        for title, members in {**SECTIONS, "Of other packages": of_others}.items():
            if rows := [(name.ljust(wide), lines[name]) for name in members.split() if name in lines]:
                with formatter.section(title):
                    formatter.write_dl(rows)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name."""
        if cmd_name not in self.commands:
            self._add_registered(name=cmd_name)
        return super().get_command(ctx, cmd_name)

    def _add_registered(self, name: str | None = None) -> None:
        from importlib.metadata import entry_points

        registered = entry_points(group=GROUP)
        for entry in sorted(registered if name is None else registered.select(name=name)):
            if entry.name not in self.commands:
                self.add_command(_command(entry), entry.name)


def _command(entry: Any) -> Any:
    """The registered command, or one that reports why it cannot be loaded."""
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    try:
        function = entry.load()
        if isinstance(function, typer.Typer):
            return typer.main.get_group(function)
        alone.command(entry.name)(with_options(function))
    except Exception as error:
        why = f"{entry.name}: {entry.value}, which a package registers, cannot be loaded: {error}"

        def fail() -> None:
            """Cannot be loaded."""
            raise InputError(why)

        alone.command(entry.name)(with_options(fail))
    return typer.main.get_command(alone)
