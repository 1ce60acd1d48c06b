"""Readable error messages for invalid function calls."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache, wraps
from numbers import Real
from types import UnionType
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from meltemi.core.errors import InputError, MeltemiError, did_you_mean

P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S")
LISTS = Sequence, Iterable, Collection
"""Type hints of what is given as a list; a text, which has them, too, is none."""


def arguments_of(record: Callable[P, S]) -> Callable[[Callable[[S], R]], Callable[P, R]]:
    """Decorator: a function of one record is called with the fields of the record as its arguments.

    The arguments, their defaults and their documentation stand once, in the data class. Type checkers and editors see
    the signature of the data class, and so does ``help``, with the attributes of its docstring as arguments.
    """

    def decorate(function: Callable[[S], R]) -> Callable[P, R]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            return function(record(*args, **kwargs))

        shown = inspect.signature(record).replace(return_annotation=function.__annotations__["return"])
        kinds = [kind for kind in inspect.getmro(cast("type", record)) if is_dataclass(kind)]  # with inherited fields
        attributes = "\n".join(inspect.cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2] for kind in kinds)
        summary, section, rest = inspect.cleandoc(function.__doc__ or "").partition("\nReturns:\n")
        call.__doc__ = f"{summary}\nArgs:\n{attributes}\n{section}{rest}"
        vars(call)["__signature__"], vars(call)["__record__"] = shown, record
        del vars(call)["__wrapped__"]  # the decorated function has another signature
        return call

    return decorate


def explained(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator: raise InputError for Python errors that are caused by the arguments.

    Arguments are checked only after a failure: valid calls have no overhead.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except OSError as error:
            if error.filename is None:
                raise
            raise InputError(f"{error.filename}: {error.strerror}") from error
        except Exception as error:
            # errors of the package itself are kept, unless it took the letters of a text for a list
            if words := _mistake(function, args, kwargs, texts_only=isinstance(error, MeltemiError)):
                raise InputError(f"{function.__name__}: {words}") from error
            raise

    vars(call)["explained"] = True
    return call


def _mistake(function: Callable[..., Any], args: Any, kwargs: Any, *, texts_only: bool) -> str:
    """Message about invalid arguments of a call, or only about texts in place of lists; empty if they are valid."""
    signature = inspect.signature(function)
    try:
        given = signature.bind(*args, **kwargs).arguments
    except TypeError as error:
        if texts_only:
            return ""
        unknown = [name for name in kwargs if name not in signature.parameters]
        if unknown:
            return f"unknown argument {unknown[0]!r}; {did_you_mean(unknown[0], signature.parameters)}"
        return f"{error}; valid arguments are {', '.join(signature.parameters)}"
    catching = (p.name for p in signature.parameters.values() if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD))
    for name in catching:
        given.pop(name, None)
    if texts_only:
        hints = hints_of(function)
        given = {n: value for n, value in given.items() if isinstance(value, str) and _is_list(hints.get(n))}
    return _unfit(given, function)


def _unfit(values: dict[str, Any], of: Any, path: str = "") -> str:
    """Message about the first value that does not match the type hints of ``of``, a function or data class."""
    hints = hints_of(of)
    for name, value in values.items():
        if not _fits(value, hints.get(name, Any)):
            shown = repr(value)
            return (
                f"{path}{name}: expected {' or '.join(_names(hints[name]))}, "
                f"found {shown if len(shown) <= 60 else type(value).__name__}"
            )
        if is_dataclass(value) and not isinstance(value, type):
            inner = {f.name: getattr(value, f.name) for f in fields(value)}
            if words := _unfit(inner, type(value), f"{path}{name}."):
                return words
    return ""


@cache
def hints_of(of: Any) -> dict[str, Any]:
    """Type hints of a function or data class, also of names that are imported for type checkers only."""
    of = getattr(of, "__record__", of)
    try:
        return get_type_hints(of)
    except NameError:
        home = sys.modules[of.__module__]
    names: dict[str, Any] = {}
    for node in ast.parse(inspect.getsource(home)).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            imports: list[ast.stmt] = [each for each in node.body if isinstance(each, ast.ImportFrom | ast.Import)]
            with suppress(ImportError):  # an optional package that is missing
                exec(compile(ast.Module(imports, []), home.__name__, "exec"), names)
    try:
        return get_type_hints(of, localns=names)
    except NameError:
        return {}


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value matches a type hint, judged by its class."""
    origin = get_origin(hint)
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in get_args(hint))
    if origin is Annotated:
        return _fits(value, get_args(hint)[0])
    if origin is Literal:
        return value in get_args(hint)
    kind = origin or hint
    if isinstance(value, str) and kind in LISTS:
        return False
    if kind is float:
        return isinstance(value, Real) and not isinstance(value, bool)
    try:
        return isinstance(value, kind)
    except TypeError:  # a protocol, or no class at all
        wanted = vars(kind) if getattr(kind, "_is_protocol", False) else ()
        return all(hasattr(value, name) for name in wanted if not name.startswith("_"))


def _is_list(hint: Any) -> bool:
    """Whether a list matches a type hint."""
    origin = get_origin(hint)
    return any(map(_is_list, get_args(hint))) if origin in (Union, UnionType) else origin in LISTS


def _names(hint: Any) -> list[str]:
    """Readable names of the types of a hint."""
    origin = get_origin(hint)
    if origin in (Union, UnionType):
        return list(dict.fromkeys(name for each in get_args(hint) for name in _names(each)))
    if origin is Annotated:
        return _names(get_args(hint)[0])
    if origin is Literal:
        return [repr(each) for each in get_args(hint)]
    kind = origin or hint
    if kind in LISTS:
        inner = [name for each in get_args(hint) for name in _names(each)]
        return [f"a list of {' or '.join(word.removeprefix('a ') + 's' for word in inner) or 'values'}"]
    special = {float: "a number", str: "a text", type(None): "None", Callable: "a function"}
    return [special.get(kind, getattr(kind, "__name__", str(kind)))]
