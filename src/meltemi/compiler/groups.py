"""Groups of numbers in kernels: dataclasses with operators, for every number type.

Kernels can create, read and pass a class registered by :func:`group`; its components have one number type, that of
its arguments. Its operators are its own methods, compiled unchanged (:func:`operators`), so that Python and kernels
share one source. A group of floats is converted to another number type where the two meet, so that sums may begin with
zeros of floats.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr_generic
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import NativeValue, box, models, overload, register_model, typeof_impl, unbox


class GroupType(types.Type):
    """A group ``cls`` of numbers of type ``dtype``."""

    def __init__(self, cls: Any, dtype: Any) -> None:
        self.cls, self.dtype = cls, dtype
        super().__init__(name=f"{cls.__name__}[{dtype}]")

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """Conversion from the group with another number type, if its numbers can be converted."""
        same = isinstance(other, GroupType) and other.cls is self.cls
        return Conversion.safe if same and context.can_convert(other.dtype, self.dtype) is not None else None

    def unify(self, context: Any, other: Any) -> Any:
        """The group with the number type that can represent both."""
        if not (isinstance(other, GroupType) and other.cls is self.cls):
            return None
        dtype = context.unify_pairs(self.dtype, other.dtype)
        return None if dtype is None else GroupType(self.cls, dtype)


def parts_of(cls: Any) -> list[str]:
    """Names of the components of a group."""
    return [field.name for field in fields(cls)]


@register_model(GroupType)
class _GroupModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        super().__init__(manager, frontend, [(part, frontend.dtype) for part in parts_of(frontend.cls)])


def split(builder: Any, kind: Any, value: Any) -> list[Any]:
    """LLVM values of the components of a group."""
    return [builder.extract_value(value, i) for i in range(len(parts_of(kind.cls)))]


def join(context: Any, builder: Any, kind: Any, values: Any) -> Any:
    """LLVM value of a group with these components."""
    result = ir.Constant(context.get_value_type(kind), ir.Undefined)
    for i, value in enumerate(values):
        result = builder.insert_value(result, value, i)
    return result


@lower_cast(GroupType, GroupType)
def _convert(context: Any, builder: Any, old: Any, new: Any, value: Any) -> Any:
    parts = [context.cast(builder, x, old.dtype, new.dtype) for x in split(builder, old, value)]
    return join(context, builder, new, parts)


# registration of classes ----------------------------------------------------------------------------


def group(cls: type) -> None:
    """Register a frozen dataclass of numbers for kernels.

    Its properties may only rearrange its components.
    """

    class Rule(AbstractTemplate):
        key = cls

        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != len(parts_of(cls)):
                return None
            kind = self.context.unify_types(*(types.float64 if isinstance(a, types.Integer) else a for a in args))
            return None if kind is None else signature(GroupType(cls, kind), *args)

    infer_global(cls, types.Function(Rule))

    @lower_builtin(cls, types.VarArg(types.Any))
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        parts = [context.cast(builder, x, kind, sig.return_type.dtype) for x, kind in zip(args, sig.args, strict=True)]
        return join(context, builder, sig.return_type, parts)

    typeof_impl.register(cls)(lambda value, context: GroupType(cls, types.float64))


@infer_getattr
class _GroupAttributes(AttributeTemplate):
    key = GroupType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        if name in parts_of(kind.cls):
            return kind.dtype
        return kind if isinstance(getattr(kind.cls, name, None), property) else None


@lower_getattr_generic(GroupType)
def _part(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    parts = parts_of(kind.cls)
    if name in parts:
        return builder.extract_value(value, parts.index(name))
    places = getattr(kind.cls(*range(len(parts))), name)
    return join(context, builder, kind, [builder.extract_value(value, getattr(places, part)) for part in parts])


@unbox(GroupType)
def _unbox(kind: Any, value: Any, c: Any) -> Any:
    parts = []
    for part in parts_of(kind.cls):
        number = c.pyapi.object_getattr_string(value, part)
        parts.append(c.unbox(kind.dtype, number).value)
        c.pyapi.decref(number)
    failed = c.builder.icmp_unsigned("!=", c.pyapi.err_occurred(), c.pyapi.get_null_object())
    return NativeValue(join(c.context, c.builder, kind, parts), is_error=failed)


@box(GroupType)
def _box(kind: Any, value: Any, c: Any) -> Any:
    instance = c.pyapi.unserialize(c.pyapi.serialize_object(kind.cls))
    numbers = [c.box(kind.dtype, x) for x in split(c.builder, kind, value)]
    result = c.pyapi.call_function_objargs(instance, numbers)
    for each in (instance, *numbers):
        c.pyapi.decref(each)
    return result


# operators ------------------------------------------------------------------------------------------


def operators(meanings: Mapping[Callable[..., Any], Mapping[tuple[type | None, ...], Callable[..., Any]]]) -> None:
    """Implement operators and functions for groups.

    Args:
      meanings: functions to compile, by operator and by the classes of its arguments; None is a number.
    """
    for function, texts in meanings.items():
        _overload(function, texts)


def _overload(function: Callable[..., Any], texts: Mapping[tuple[type | None, ...], Callable[..., Any]]) -> None:
    @overload(function, strict=False)
    def choose(*args: Any) -> Any:
        if not any(isinstance(a, GroupType) for a in args):
            return None
        return texts.get(tuple(a.cls if isinstance(a, GroupType) else None for a in args))
