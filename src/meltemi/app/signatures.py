"""Commands whose arguments and options are declared in the signature of their function, in a line each.

A parameter without a default is an argument of the command, one with a default is an option of its name::

    def flutter(
        turbine: Annotated[str, "A turbine's name or YAML file.", TURBINES],
        seeds: Annotated[int, "Number of wind fields.", Range(1, 1000)] = 2,
        deep_stall: Annotated[Literal["given", "plate"], "Polars in deep stall."] = "given",
        channels: Annotated[tuple[str, ...], "Channels, separated by commas."] = (),
        with_view: Annotated[bool, "--view", "Also write the moving mode shapes (HTML)."] = False,
    ) -> None:

The type is followed by the help, other names of the option, which begin with ``-``, the completion of its values in
a shell, and its range. Choices (``Literal``) and ranges are checked before the function is called, and the folder of an
``OutOption`` is there and can be written. A record (data class) in place of an option has one for each of its fields.
Whatever Typer takes is passed on as it is.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from math import inf
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import typer
from typer.models import ParameterInfo

from meltemi.app.terminal import Folder, folder_for, output
from meltemi.core.errors import InputError, closest, did_you_mean

JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, typer.Option("--json", help="Print tables, files and messages as JSON.")],
)
CONTEXT = inspect.Parameter("typer_context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)


@dataclass(frozen=True)
class Range:
    """Least and largest value of an option; ``above``: the least one itself is not allowed."""

    least: float
    most: float = inf
    above: bool = False

    def check(self, option: str, value: float) -> None:
        """Raise InputError for a value beyond the range."""
        if self.least <= value <= self.most and not (self.above and value == self.least):
            return
        least, most, shown = (str(x) if isinstance(x, int) else f"{x:g}" for x in (self.least, self.most, value))
        if self.above:
            expected = f"more than {least}" if self.most == inf else f"more than {least} and at most {most}"
        else:
            expected = f"{least} or more" if self.most == inf else f"{least} to {most}"
        raise InputError(f"{option} {shown}: expected {expected}")


POSITIVE = Range(0, above=True)


def with_options(function: Callable[..., None]) -> Callable[..., None]:
    """A function as Typer takes it, with its options, those of the records that it takes, and ``--json``."""
    hints, parameters = get_type_hints(function, include_extras=True), inspect.signature(function).parameters
    records = {name: hints[name] for name in parameters if is_dataclass(hints.get(name))}
    options: list[_Option] = []
    for name, parameter in parameters.items():
        if name in records:
            inner = get_type_hints(records[name], include_extras=True)
            options += [_Option(p, inner[p.name]) for p in inspect.signature(records[name]).parameters.values()]
        else:
            options.append(_Option(parameter, hints.get(name, str)))

    def call(typer_context: typer.Context, as_json: bool, **words: Any) -> None:
        path = typer_context.command_path.removeprefix(typer_context.find_root().command_path)
        with output(path.strip(), as_json):
            values = {option.name: option.value(words[option.name]) for option in options}
            for name, record in records.items():
                values[name] = record(**{f.name: values.pop(f.name) for f in fields(record)})
            function(**values)

    shown = [*(option.shown for option in options), JSON, CONTEXT]
    call.__doc__, call.__name__ = function.__doc__, function.__name__
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in shown}
    vars(call)["__signature__"] = inspect.Signature(shown)
    return call


class _Option:
    """A parameter of a command: as Typer takes it, and the value that the function gets."""

    def __init__(self, parameter: inspect.Parameter, hint: Any) -> None:
        kind, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        named = [mark for mark in marks if isinstance(mark, str) and mark.startswith("-")]
        about = [mark for mark in marks if isinstance(mark, str) and mark not in named]
        self.name, self.default, default = parameter.name, parameter.default, parameter.default
        self.option = (named[0] if named else f"--{self.name.replace('_', '-')}").partition("/")[0]
        self.range = next((mark for mark in marks if isinstance(mark, Range)), None)
        inner = next(each for each in (*_of_union(kind), kind) if each is not type(None))
        self.choices: tuple[str, ...] = get_args(inner) if get_origin(inner) is Literal else ()
        self.several, self.folder = inner == tuple[str, ...], any(isinstance(mark, Folder) for mark in marks)
        if self.choices or self.several:
            kind = str if default else str | None
            default = ",".join(default) or None if isinstance(default, tuple) else default
        if about:
            complete = next((mark for mark in marks if callable(mark)), self._complete if self.choices else None)
            words: dict[str, Any] = {"help": about[-1], "autocompletion": complete}
            if default is inspect.Parameter.empty and not named:
                kind = Annotated[kind, typer.Argument(**words)]
            else:
                kind = Annotated[kind, typer.Option(*(named or [self.option] * (default is False)), **words)]
        elif any(isinstance(mark, ParameterInfo) for mark in marks):
            kind = hint
        self.shown = inspect.Parameter(self.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)

    def _complete(self, incomplete: str) -> list[str]:
        return [name for name in self.choices if name.startswith(incomplete)]

    def value(self, given: Any) -> Any:
        """The value of what is given.

        Raises:
          InputError: it is none of the choices, or out of range, or the folder cannot be written.
        """
        if given is None:
            return self.default if self.several else None
        if self.several:
            return names_of(given)
        if self.choices and given not in self.choices:
            words = [*self.choices[:-2], " or ".join(self.choices[-2:])]
            near = closest(given, self.choices)
            hint = did_you_mean(given, self.choices) if near else f"expected {', '.join(words)}"
            raise InputError(f"{self.option} {given!r}: {hint}")
        if self.folder:
            return folder_for(given, self.option)
        if self.range:
            self.range.check(self.option, given)
        return given


def _of_union(kind: Any) -> tuple[Any, ...]:
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else ()


def names_of(text: str) -> tuple[str, ...]:
    """Names that commas separate in a text."""
    return tuple(name.strip() for name in text.split(",") if name.strip())
