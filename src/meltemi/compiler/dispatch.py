"""Functions with a variant for each class of records: single dispatch, resolved by kernels at compile time.

    @by_record
    def evaluate(t: float, dt: float, m: AnySystem) -> None:
        "Everything at one instant."

    @evaluate.variant
    def _(t: float, dt: float, m: System) -> None: ...

The annotation of the argument ``m`` is the class of records of a variant. The same call works in plain Python and
from the host.

A *hook* calls the variants of all classes that a record joins (:func:`joined`) instead of the closest one:
there the parts of a machine act.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from inspect import signature
from types import CodeType, ModuleType
from typing import Any, Generic, ParamSpec, TypeVar, get_type_hints

from numba import types
from numba.core.typing.templates import AbstractTemplate, infer, infer_global

from meltemi.compiler.kernels import in_turn
from meltemi.compiler.linking import NARROWER
from meltemi.compiler.record_types import KernelRecord, RecordType
from meltemi.compiler.records import leading

P = ParamSpec("P")
R = TypeVar("R")


class Variants(Generic[P, R]):
    """A function that dispatches on the class of one record among its arguments."""

    def __init__(self, function: Callable[P, R], on: str) -> None:
        self.__doc__, self.__name__, self.__module__ = function.__doc__, function.__name__, function.__module__
        names = list(signature(function).parameters)
        self.place, self.parameters = names.index(on), len(names)
        self.on, self.texts = on, dict[type[KernelRecord], Callable[..., R]]()
        template = type(f"Variants({self.__name__})", (_Template,), {"key": self, "variants": self})
        infer(template)
        infer_global(self, types.Function(template))

    def variant(self, text: Callable[..., R]) -> Callable[..., R]:
        """Register a variant for the class of records in its annotation."""
        self.texts[get_type_hints(text)[self.on]] = text
        return text

    def called(self, record: type[KernelRecord]) -> list[Callable[..., R]]:
        """The function that a call with a class of records calls."""
        return [self.texts[each] for each in record.__mro__ if each in self.texts][:1]

    def of(self, record: type[KernelRecord]) -> Callable[..., R]:
        """The variant for a class of records.

        Raises:
          TypeError: no variant is registered.
        """
        for variant in self.called(record):
            return variant
        raise TypeError(f"{self.__name__} has no variant for {record.__name__}")

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        record: Any = args[self.place]
        return self.of(type(record))(*args, **kwargs)


class Hook(Variants[P, None]):
    """A function that calls the variants of all classes of a record, in the order of their bases; none is needed."""

    def __init__(self, function: Callable[P, None], on: str) -> None:
        super().__init__(function, on)
        self.chains: dict[type[KernelRecord], Callable[..., None]] = {}

    def called(self, record: type[KernelRecord]) -> list[Callable[..., None]]:
        """The function that a call with a class of records calls."""
        return [self.texts[each] for each in record.__mro__ if each in self.texts]

    def of(self, record: type[KernelRecord]) -> Callable[..., None]:
        """The variants for a class of records, one after the other."""
        if record not in self.chains:
            called = self.called(record)
            self.chains[record] = called[0] if len(called) == 1 else in_turn(called, self.parameters)
        return self.chains[record]


class _Template(AbstractTemplate):  # type: ignore[misc]
    """Typing of calls in kernels: those of the variant, which is a kernel as well, for the same device."""

    variants: Variants[Any, Any]

    def _kernel(self, args: Any) -> Any:
        record = args[self.variants.place]
        return self.context.resolve_value_type(self.variants.of(record.cls))

    def generic(self, args: Any, kws: Any) -> Any:
        """Signature of a call."""
        return self._kernel(args).get_call_type(self.context, args, kws)

    def get_impl_key(self, sig: Any) -> Any:
        """Compiled function of a signature."""
        return self._kernel(sig.args).get_impl_key(sig)


def by_record(function: Callable[P, R]) -> Variants[P, R]:
    """Make a function dispatch on the class of its record ``m``."""
    return Variants(function, "m")


def by_control(function: Callable[P, R]) -> Variants[P, R]:
    """Make a function dispatch on the class of its record ``c``."""
    return Variants(function, "c")


def hook(function: Callable[P, None]) -> Hook[P]:
    """Make a function the place at which parts of the turbine, its record ``m``, act."""
    return Hook(function, "m")


def control_hook(function: Callable[P, None]) -> Hook[P]:
    """Make a function the place at which parts of the control, its record ``c``, act."""
    return Hook(function, "c")


# machine code that several classes of records share -----------------------------------------------------------


def narrowed(kind: RecordType, function: Callable[..., Any], parameter: str) -> RecordType:
    """The record that a kernel takes as a parameter, where one with further members is passed.

    It is the record with the fewest members at which the kernel does the same. So kernels that no part of a machine
    changes are compiled once for machines with and without parts.
    """
    declared, cls = _hints(function).get(parameter), kind.cls
    if isinstance(declared, type):
        for base in leading(cls):
            if not (issubclass(base, declared) and _does_the_same(function, cls, base)):
                break
            cls = base
    return RecordType(cls, kind.kind)


NARROWER[RecordType] = narrowed


@cache
def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    try:
        return get_type_hints(function)
    except NameError:  # of a local class, or one that only type checkers import
        return {}


@cache
def _does_the_same(function: Callable[..., Any], record: type[KernelRecord], base: type[KernelRecord]) -> bool:
    """Whether all variants that a kernel reaches are the same for a class of records and for a base of it."""
    visited, ahead = set[Any](), [function]
    while ahead:
        one = ahead.pop()
        if one in visited:
            continue
        visited.add(one)
        for each in _mentioned(one):
            called = [each]
            if isinstance(each, Variants):
                called = each.called(record)
                if called != each.called(base):
                    return False
            ahead += [text for text in (getattr(kernel, "py_func", None) for kernel in called) if callable(text)]
    return True


def _mentioned(function: Any) -> Iterator[Any]:
    """The values of all names in the code of a function, and of functions in it; of modules, their members."""
    names, codes = set[str](), [function.__code__]
    while codes:
        code = codes.pop()
        names.update(code.co_names)
        codes += [each for each in code.co_consts if isinstance(each, CodeType)]
    ahead = [function.__globals__[name] for name in names if name in function.__globals__]
    ahead += [cell.cell_contents for cell in function.__closure__ or ()]
    modules = set[ModuleType]()
    while ahead:
        value = ahead.pop()
        if not isinstance(value, ModuleType):
            yield value
        elif value not in modules:
            modules.add(value)
            ahead += [vars(value)[name] for name in names if name in vars(value)]
