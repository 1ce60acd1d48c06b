"""Groups of commands: the option ``--json`` of each, and the commands of other packages.

These register them as entry points of the group ``meltemi.commands``.

An entry point is a function as Typer takes it, whose docstring is the help and whose arguments are the options, or a
``Typer`` with commands of its own. The module it stands in is imported by ``meltemi --help``, so it leaves what is
heavy to the function; another command does not import it.
"""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from meltemi.app.terminal import output, say
from meltemi.core.errors import InputError, RunError, Status

GROUP = "meltemi.commands"
SECTIONS = {
    "Simulate": "run power-curve campbell flutter parked farm yaw-limits live",
    "Look at inputs and results": "turbines inspect channels wind sea diff view observe",
    "Design loads": "loads surrogate climate",
    "Control": "compare bench-controller export-controller export-rosco export-linear",
    "Platforms": "hydro rao",
    "Other programs": "import export export-fmu",
    "Verification": "verify reproduce bench",
    "Help and files": "docs template warmup",
}
"""Commands of the help, by what they are for; those of other packages come last."""


class Group(TyperGroup):
    """Commands whose output is text that ends with the next command, or JSON."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name, with the option ``--json``."""
        found = super().get_command(ctx, cmd_name)
        return found if found is None or isinstance(found, TyperGroup) else _with_output(found)


def _with_output(command: Any) -> Any:
    """The command, printing through :func:`meltemi.app.terminal.output`."""
    if any(p.name == _JSON for p in command.params):
        return command
    command.params.append(_json_option())
    invoke = command.invoke

    def invoked(ctx: typer.Context) -> Any:
        with output(ctx.command_path.removeprefix(ctx.find_root().command_path).strip(), ctx.meta.get(_JSON, False)):
            return invoke(ctx)

    command.invoke = invoked
    return command


_JSON = "as_json"


def _json_option() -> Any:
    """The option ``--json``, as Typer makes it of a function's argument."""

    def chosen(ctx: typer.Context, value: bool) -> None:
        ctx.meta[_JSON] = value

    about = "Print tables, files and messages as JSON."

    def function(
        as_json: bool = typer.Option(False, "--json", help=about, callback=chosen, expose_value=False),
    ) -> None:
        """Only its option is used."""

    alone = typer.Typer(add_completion=False)
    alone.command()(function)
    return next(p for p in typer.main.get_command(alone).params if p.name == _JSON)


class Commands(Group):
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

        found = entry_points(group=GROUP)
        for entry in sorted(found if name is None else found.select(name=name)):
            if entry.name not in self.commands:
                self.add_command(_command(entry), entry.name)


def _command(entry: Any) -> Any:
    """The registered command, or one that reports why it cannot be loaded."""
    try:
        function = entry.load()
    except Exception as error:
        why = f"{entry.name}: {entry.value}, which a package registers, cannot be loaded: {error}"

        def function() -> None:
            raise InputError(why)

        function.__doc__ = "Cannot be loaded."
    if isinstance(function, typer.Typer):
        return typer.main.get_group(function)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(entry.name)(function)
    return typer.main.get_command(alone)
