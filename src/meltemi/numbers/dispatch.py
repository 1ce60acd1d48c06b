"""Functions with a variant for each class of records: single dispatch that kernels resolve when they are compiled.

    @by_record
    def evaluate(t: float, dt: float, m: AnySystem) -> None:
        "Everything at one instant."

    @evaluate.variant
    def _(t: float, dt: float, m: System) -> None: ...

The annotation of a variant says for which class of records it is. In plain Python and from the host the same call works.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, ParamSpec, TypeVar, get_type_hints

from numba.extending import overload

from meltemi.maths.records import Record
from meltemi.numbers.records import RecordType

P = ParamSpec("P")
R = TypeVar("R")


class Variants(Generic[P, R]):
    """A function that chooses its text by the class of the record among its arguments."""

    def __init__(self, function: Callable[P, R]) -> None:
        self.__doc__, self.__name__, self.__module__ = function.__doc__, function.__name__, function.__module__
        self.texts: dict[type[Record], Callable[P, R]] = {}
        overload(self, strict=False)(self._compiled)

    def variant(self, text: Callable[..., R]) -> Callable[..., R]:
        """Register a variant for the class of records in its annotations."""
        (record,) = (hint for hint in get_type_hints(text).values() if isinstance(hint, type) and issubclass(hint, Record))
        self.texts[record] = text
        return text

    def of(self, record: type[Record]) -> Callable[P, R]:
        """The variant for a class of records.

        Raises:
          TypeError: there is none.
        """
        for each in record.__mro__:
            if each in self.texts:
                return self.texts[each]
        raise TypeError(f"{self.__name__} has no variant for {record.__name__}")

    def _compiled(self, *args: Any) -> Any:
        (record,) = {a.cls for a in args if isinstance(a, RecordType) and self._known(a.cls)}
        return self.of(record)

    def _known(self, record: type[Record]) -> bool:
        return any(each in self.texts for each in record.__mro__)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        (record,) = {type(a) for a in args if isinstance(a, Record) and self._known(type(a))}
        return self.of(record)(*args, **kwargs)


def by_record(function: Callable[P, R]) -> Variants[P, R]:
    """Make a function whose text depends on the class of the record that it gets."""
    return Variants(function)
