"""Functions with a variant for each class of records: single dispatch, resolved by kernels at compile time.

    @by_record
    def evaluate(t: float, dt: float, m: AnySystem) -> None:
        "Everything at one instant."

    @evaluate.variant
    def _(t: float, dt: float, m: System) -> None: ...

The annotation of the argument ``m`` is the class of records of a variant. The same call works in plain Python and
from the host.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any, Generic, ParamSpec, TypeVar, get_type_hints

from numba.extending import overload

from meltemi.numbers.records import Record, RecordType

P = ParamSpec("P")
R = TypeVar("R")


class Variants(Generic[P, R]):
    """A function that dispatches on the class of the record ``m`` among its arguments."""

    def __init__(self, function: Callable[P, R]) -> None:
        self.__doc__, self.__name__, self.__module__ = function.__doc__, function.__name__, function.__module__
        self.place = list(signature(function).parameters).index("m")
        self.texts: dict[type[Record], Callable[..., R]] = {}
        overload(self, strict=False)(self._compiled)

    def variant(self, text: Callable[..., R]) -> Callable[..., R]:
        """Register a variant for the class of records in the annotation of ``m``."""
        self.texts[get_type_hints(text)["m"]] = text
        return text

    def of(self, record: type[Record]) -> Callable[..., R]:
        """The variant for a class of records.

        Raises:
          TypeError: no variant is registered.
        """
        for each in record.__mro__:
            if each in self.texts:
                return self.texts[each]
        raise TypeError(f"{self.__name__} has no variant for {record.__name__}")

    def _compiled(self, *args: Any) -> Any:
        record = args[self.place]
        text: Any = self.of(record.cls) if isinstance(record, RecordType) else None
        return getattr(text, "py_func", text)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        record: Any = args[self.place]
        return self.of(type(record))(*args, **kwargs)


def by_record(function: Callable[P, R]) -> Variants[P, R]:
    """Make a function dispatch on the class of its record."""
    return Variants(function)
