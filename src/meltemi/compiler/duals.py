"""Dual numbers: a value with its derivatives by eight parameters, propagated exactly through every operation.

A kernel that reads from a *dual array* computes with duals instead of floats, and so returns the derivatives of its
results by the parameters of the input derivatives (forward differentiation):

    (x, dx) (y, dy) = (x y, y dx + x dy),   f((x, dx)) = (f(x), f'(x) dx)

Comparisons use values only: a derivative is that of the branch that was taken. Eight derivatives fill one
register, so they cost little more than one.

Reference: Griewank & Walther (2008), Evaluating Derivatives, chapter 3.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.cpython import slicing
from numba.extending import intrinsic, models, overload, register_model

from meltemi.compiler import record_types as records
from meltemi.compiler.generic import (
    beyond,
    crossed,
    floor,
    held,
    largest,
    last,
    reverse,
    running,
    total,
    where,
    whole,
    zero,
)
from meltemi.compiler.lanes import N_DERIVATIVES as N_DERIVATIVES
from meltemi.compiler.lanes import WIDTH, lanes, splat

_F64, _I64, _I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_VF = ir.VectorType(_F64, WIDTH)
_NUMBER = (types.Float, types.Integer)


# types ----------------------------------------------------------------------------------------------


class DualType(types.Type):
    """A float64 value and eight derivatives."""

    def can_convert_from(self, context: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, _NUMBER) else None

    def unify(self, context: Any, other: Any) -> Any:
        return self if isinstance(other, _NUMBER) else None


class DualArrayType(types.Type):
    """An array of values and the array of their derivatives."""

    def __init__(self, ndim: int) -> None:
        self.ndim = ndim
        super().__init__(name=f"DualArray({ndim})")


class IndexType(types.UniTuple):
    """Index of an entry, or of a subarray, of a dual array."""


dual = DualType("dual")
register_model(IndexType)(models.UniTupleModel)


@register_model(DualType)
class _DualModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        super().__init__(manager, frontend, [("value", types.float64), ("slopes", lanes)])


@register_model(DualArrayType)
class _DualArrayModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        pointer = types.CPointer(types.float64)
        members = [("values", pointer), ("slopes", pointer), ("shape", types.UniTuple(types.intp, frontend.ndim))]
        super().__init__(manager, frontend, members)


class _Dual:
    """LLVM values of a dual during code generation."""

    def __init__(self, value: Any, slopes: Any | None) -> None:
        self.value, self.slopes = value, slopes  # no slopes: a constant


def _take(context: Any, builder: Any, kind: Any, x: Any) -> _Dual:
    if kind == dual:
        return _Dual(builder.extract_value(x, 0), builder.extract_value(x, 1))
    return _Dual(context.cast(builder, x, kind, types.float64), None)


def make_dual(context: Any, builder: Any, value: Any, slopes: Any | None) -> Any:
    """LLVM value of a dual; without slopes that of a constant."""
    proxy = cgutils.create_struct_proxy(dual)(context, builder)
    proxy.value = value
    proxy.slopes = ir.Constant(_VF, [0.0] * WIDTH) if slopes is None else slopes
    return proxy._getvalue()


@lower_cast(types.Float, DualType)
@lower_cast(types.Integer, DualType)
def _to_dual(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return make_dual(context, builder, context.cast(builder, x, old, types.float64), None)


# operations -----------------------------------------------------------------------------------------


def _operation(function: Any, count: int, result: Any, generate: Any) -> None:
    """Implement ``function`` for ``count`` arguments of which at least one is a dual.

    Args:
      generate: (context, builder, *duals) -> LLVM value.
    """

    class Rule(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != count or dual not in args:
                return None
            if not all(a == dual or isinstance(a, _NUMBER) for a in args):
                return None
            return signature(result, *(dual if a == dual else types.float64 for a in args))

    infer_global(function)(Rule)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        numbers = [_take(context, builder, kind, x) for kind, x in zip(sig.args, args, strict=True)]
        return generate(context, builder, *numbers)

    choices = [(DualType,), (types.Float,)]
    kinds = [(DualType,)] if count == 1 else [(a[0], b[0]) for a in choices for b in choices if DualType in a + b]
    for kind in kinds:
        lower_builtin(function, *kind)(lower)


def _sum(sign: str) -> Any:
    def generate(context: Any, builder: Any, x: _Dual, y: _Dual) -> Any:
        add = getattr(builder, sign)
        if y.slopes is None:
            slopes = x.slopes
        elif x.slopes is None:
            slopes = y.slopes if sign == "fadd" else builder.fneg(y.slopes)
        else:
            slopes = add(x.slopes, y.slopes)
        return make_dual(context, builder, add(x.value, y.value), slopes)

    return generate


def _product(context: Any, builder: Any, x: _Dual, y: _Dual) -> Any:
    terms = [builder.fmul(a.slopes, splat(builder, b.value)) for a, b in ((x, y), (y, x)) if a.slopes is not None]
    slopes = terms[0] if len(terms) == 1 else builder.fadd(*terms)
    return make_dual(context, builder, builder.fmul(x.value, y.value), slopes)


def _ratio(context: Any, builder: Any, x: _Dual, y: _Dual) -> Any:
    """(x / y)' = (x' - (x / y) y') / y."""
    value = builder.fdiv(x.value, y.value)
    inverse = splat(builder, builder.fdiv(ir.Constant(_F64, 1.0), y.value))
    if y.slopes is None:
        return make_dual(context, builder, value, builder.fmul(x.slopes, inverse))
    change = builder.fmul(y.slopes, splat(builder, value))
    change = builder.fneg(change) if x.slopes is None else builder.fsub(x.slopes, change)
    return make_dual(context, builder, value, builder.fmul(change, inverse))


for _functions, _generate in (
    ((operator.add, operator.iadd), _sum("fadd")),
    ((operator.sub, operator.isub), _sum("fsub")),
    ((operator.mul, operator.imul), _product),
    ((operator.truediv, operator.itruediv), _ratio),
):
    for _function in _functions:
        _operation(_function, 2, dual, _generate)


def _comparison(sign: str) -> Any:
    """Comparison of the values; NaN is unequal to everything, and every other comparison with it is false."""
    name = "fcmp_unordered" if sign == "!=" else "fcmp_ordered"
    return lambda context, builder, x, y: getattr(builder, name)(sign, x.value, y.value)


for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _operation(_function, 2, types.boolean, _comparison(_sign))


def _choice(sign: str) -> Any:
    """Minimum and maximum: the first argument unless the second is beyond it."""

    def generate(context: Any, builder: Any, x: _Dual, y: _Dual) -> Any:
        beyond = builder.fcmp_ordered(sign, y.value, x.value)
        return builder.select(
            beyond, make_dual(context, builder, y.value, y.slopes), make_dual(context, builder, x.value, x.slopes)
        )

    return generate


_operation(min, 2, dual, _choice("<"))
_operation(max, 2, dual, _choice(">"))
_operation(operator.neg, 1, dual, lambda c, b, x: make_dual(c, b, b.fneg(x.value), b.fneg(x.slopes)))
for _function in (total, largest, running, last):
    _operation(_function, 1, dual, lambda c, b, x: make_dual(c, b, x.value, x.slopes))
_operation(whole, 1, types.int64, lambda c, b, x: b.fptosi(x.value, _I64))


def _call(builder: Any, name: str, x: Any) -> Any:
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(x.type, [x.type]), name)
    return builder.call(function, [x])


def _magnitude(context: Any, builder: Any, x: _Dual) -> Any:
    negative = builder.fcmp_ordered("<", x.value, ir.Constant(_F64, 0.0))
    slopes = builder.select(negative, builder.fneg(x.slopes), x.slopes)
    return make_dual(context, builder, _call(builder, "llvm.fabs.f64", x.value), slopes)


def _root(context: Any, builder: Any, x: _Dual) -> Any:
    """Square root, with zero slope at zero, where the slope is infinite."""
    value = _call(builder, "llvm.sqrt.f64", x.value)
    positive = builder.fcmp_ordered(">", value, ir.Constant(_F64, 0.0))
    rate = builder.select(positive, builder.fdiv(ir.Constant(_F64, 0.5), value), ir.Constant(_F64, 0.0))
    return make_dual(context, builder, value, builder.fmul(x.slopes, splat(builder, rate)))


_operation(abs, 1, dual, _magnitude)
_operation(math.sqrt, 1, dual, _root)
for _function in (floor, math.floor):
    _operation(_function, 1, types.float64, lambda c, b, x: _call(b, "llvm.floor.f64", x.value))


class _Where(AbstractTemplate):
    key = where

    def generic(self, args: Any, kws: Any) -> Any:
        if dual not in args[1:] or not isinstance(args[0], types.Boolean):
            return None
        return signature(dual, types.boolean, dual, dual)


infer_global(where)(_Where)


@lower_builtin(where, types.Boolean, DualType, DualType)
def _where(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(*args)


def _within_step(context: Any, builder: Any, x: _Dual) -> Any:
    """1 where the value is smaller than one of its derivatives, which are the changes over a finite difference."""
    size = ir.FunctionType(_VF, [_VF])
    change = builder.call(cgutils.get_or_insert_function(builder.module, size, f"llvm.fabs.v{WIDTH}f64"), [x.slopes])
    near = splat(builder, _call(builder, "llvm.fabs.f64", x.value))
    beyond = builder.fcmp_ordered(">", change, near)
    bits = builder.bitcast(beyond, ir.IntType(WIDTH))
    return builder.uitofp(builder.icmp_unsigned("!=", bits, bits.type(0)), _F64)


_operation(crossed, 1, types.float64, _within_step)


@overload(beyond, strict=False)
def _beyond(x: Any, bound: Any) -> Any:
    return (lambda x, bound: bound == bound) if x == dual else None


@overload(reverse, strict=False)
def _reverse(x: Any) -> Any:
    return (lambda x: False) if x == dual else None


@overload(held, strict=False)
def _held(x: Any) -> Any:
    return (lambda x: x) if x == dual else None


# elementary functions -------------------------------------------------------------------------------


@intrinsic
def value(typing_context: Any, x: Any) -> Any:
    """The value of a dual."""
    return types.float64(dual), lambda context, builder, signature, args: builder.extract_value(args[0], 0)


@intrinsic
def chain(typing_context: Any, f: Any, slope: Any, x: Any) -> Any:
    """The dual with value f and the derivatives of x times a slope."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        slopes = builder.fmul(builder.extract_value(args[2], 1), splat(builder, args[1]))
        return make_dual(context, builder, args[0], slopes)

    return dual(types.float64, types.float64, dual), generate


def _sin(x: Any) -> Any:
    return chain(math.sin(value(x)), math.cos(value(x)), x)


def _cos(x: Any) -> Any:
    return chain(math.cos(value(x)), -math.sin(value(x)), x)


def _tan(x: Any) -> Any:
    t = math.tan(value(x))
    return chain(t, 1.0 + t * t, x)


def _exp(x: Any) -> Any:
    e = math.exp(value(x))
    return chain(e, e, x)


def _expm1(x: Any) -> Any:
    e = math.expm1(value(x))
    return chain(e, e + 1.0, x)


def _log(x: Any) -> Any:
    return chain(math.log(value(x)), 1.0 / value(x), x)


def _acos(x: Any) -> Any:
    """Arc cosine, with zero slope at -1 and 1, where the slope is infinite."""
    c = value(x)
    return chain(math.acos(c), -1.0 / math.sqrt(1.0 - c * c) if abs(c) < 1.0 else 0.0, x)


def _tanh(x: Any) -> Any:
    t = math.tanh(value(x))
    return chain(t, 1.0 - t * t, x)


def _sinh(x: Any) -> Any:
    return chain(math.sinh(value(x)), math.cosh(value(x)), x)


def _cosh(x: Any) -> Any:
    return chain(math.cosh(value(x)), math.sinh(value(x)), x)


def _define(function: Any, implementation: Any) -> None:
    @overload(function, strict=False)
    def choose(x: Any) -> Any:
        return implementation if x == dual else None


for _function, _implementation in (
    (math.sin, _sin),
    (math.cos, _cos),
    (math.tan, _tan),
    (math.exp, _exp),
    (math.expm1, _expm1),
    (math.log, _log),
    (math.acos, _acos),
    (math.tanh, _tanh),
    (math.sinh, _sinh),
    (math.cosh, _cosh),
):
    _define(_function, _implementation)


@intrinsic
def as_dual(typing_context: Any, x: Any) -> Any:
    """Conversion of a number to a dual."""
    return dual(dual), lambda context, builder, signature, args: args[0]


@overload(math.atan2, strict=False)
def _atan2(y: Any, x: Any) -> Any:
    if dual not in (y, x):
        return None

    def atan2(y: Any, x: Any) -> Any:
        a, b = value(as_dual(y)), value(as_dual(x))
        r2 = a * a + b * b
        inverse = 1.0 / r2 if r2 > 0.0 else 0.0
        angle = chain(0.0, b * inverse, as_dual(y)) - chain(0.0, a * inverse, as_dual(x))
        return angle + math.atan2(a, b)

    return atan2


# arrays ---------------------------------------------------------------------------------------------


@infer_getattr
class _DualArrayAttributes(AttributeTemplate):
    key = DualArrayType

    def resolve_shape(self, array: Any) -> Any:
        return types.UniTuple(types.intp, array.ndim)


@lower_getattr(DualArrayType, "shape")
def _shape(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value).shape


def _index(array: Any, index: Any) -> Any:
    """The index as a tuple type: of all axes, or of the first ones for a subarray."""
    if isinstance(index, types.Integer):
        return IndexType(types.intp, 1)
    if isinstance(index, types.BaseTuple) and len(index) <= array.ndim:
        return IndexType(types.intp, len(index)) if all(isinstance(i, types.Integer) for i in index) else None
    return None


@lower_cast(types.Integer, IndexType)
@lower_cast(types.UniTuple, IndexType)
@lower_cast(types.Tuple, IndexType)
def _to_index(context: Any, builder: Any, old: Any, new: Any, index: Any) -> Any:
    single = isinstance(old, types.Integer)
    kinds, at = ([old], [index]) if single else (list(old), cgutils.unpack_tuple(builder, index))
    places = [context.cast(builder, i, kind, types.intp) for kind, i in zip(kinds, at, strict=True)]
    return context.make_tuple(builder, new, places)


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        array, index = args
        if not isinstance(array, DualArrayType):
            return None
        at = _index(array, index)
        if at is None:
            return None
        left = array.ndim - len(at)
        return signature(DualArrayType(left) if left else dual, array, at)


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        array, index, x = args
        if not isinstance(array, DualArrayType):
            return None
        if isinstance(index, types.SliceType) and not index.has_step:
            if x == array:
                return signature(types.none, array, index, array)
            return signature(types.none, array, index, dual)
        at = _index(array, index)
        if at is None or len(at) != array.ndim or not (x == dual or isinstance(x, _NUMBER)):
            return None
        return signature(types.none, array, at, dual)


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> tuple[Any, Any, Any]:
    """Pointers to value and derivatives at an index, and the lengths of the remaining axes."""
    proxy = cgutils.create_struct_proxy(kind)(context, builder, array)
    shape, at = cgutils.unpack_tuple(builder, proxy.shape), cgutils.unpack_tuple(builder, index)
    flat = at[0]
    for axis in range(1, len(shape)):
        flat = builder.mul(flat, shape[axis])
        if axis < len(at):
            flat = builder.add(flat, at[axis])
    values = builder.gep(proxy.values, [flat], source_etype=_F64)
    slopes = builder.gep(proxy.slopes, [builder.mul(flat, flat.type(WIDTH))], source_etype=_F64)
    return values, slopes, shape[len(at) :]


@lower_builtin(operator.getitem, DualArrayType, IndexType)
def _load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values, slopes, left = _place(context, builder, sig.args[0], *args)
    if left:
        proxy = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        proxy.values, proxy.slopes = values, slopes
        proxy.shape = context.make_tuple(builder, types.UniTuple(types.intp, len(left)), left)
        return proxy._getvalue()
    vector = builder.load(builder.bitcast(slopes, _VF.as_pointer()), align=8, typ=_VF)
    return make_dual(context, builder, builder.load(values, typ=_F64), vector)


def _write(builder: Any, x: Any, values: Any, slopes: Any) -> None:
    builder.store(builder.extract_value(x, 0), values)
    builder.store(builder.extract_value(x, 1), builder.bitcast(slopes, _VF.as_pointer()), align=8)


@lower_builtin(operator.setitem, DualArrayType, IndexType, DualType)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values, slopes, _ = _place(context, builder, sig.args[0], *args[:2])
    _write(builder, args[2], values, slopes)
    return context.get_dummy_value()


def _places(context: Any, builder: Any, kind: Any, index: Any, array: Any) -> tuple[Any, Any]:
    """The first entry and the number of entries of a slice of the first axis."""
    first, *others = cgutils.unpack_tuple(builder, array.shape)
    rows = context.make_helper(builder, kind, index)
    slicing.fix_slice(builder, rows, first)
    begin, count = rows.start, slicing.get_slice_length(builder, rows)
    for length in others:
        begin, count = builder.mul(begin, length), builder.mul(count, length)
    return begin, count


def _nth(builder: Any, array: Any, i: Any) -> tuple[Any, Any]:
    return (
        builder.gep(array.values, [i], source_etype=_F64),
        builder.gep(array.slopes, [builder.mul(i, i.type(WIDTH))], source_etype=_F64),
    )


@lower_builtin(operator.setitem, DualArrayType, types.SliceType, DualType)
def _fill(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """A[i:j] = x."""
    to = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    begin, count = _places(context, builder, sig.args[1], args[1], to)
    with cgutils.for_range(builder, count) as loop:
        _write(builder, args[2], *_nth(builder, to, builder.add(begin, loop.index)))
    return context.get_dummy_value()


@lower_builtin(operator.setitem, DualArrayType, types.SliceType, DualArrayType)
def _copy(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """A[i:j] = B, where B has the shape of the slice."""
    to = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    source = cgutils.create_struct_proxy(sig.args[2])(context, builder, args[2])
    begin, count = _places(context, builder, sig.args[1], args[1], to)
    with cgutils.for_range(builder, count) as loop:
        values, slopes = _nth(builder, source, loop.index)
        vector = builder.load(builder.bitcast(slopes, _VF.as_pointer()), align=8, typ=_VF)
        x = make_dual(context, builder, builder.load(values, typ=_F64), vector)
        _write(builder, x, *_nth(builder, to, builder.add(begin, loop.index)))
    return context.get_dummy_value()


class _Zero(AbstractTemplate):
    key = zero

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(dual, *args) if isinstance(args[0], DualArrayType) else None


infer_global(zero)(_Zero)


@lower_builtin(zero, DualArrayType)
def _zero(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return make_dual(context, builder, ir.Constant(_F64, 0.0), None)


# tables and records ---------------------------------------------------------------------------------


def _load_entry(context: Any, builder: Any, data: Any, slopes: Any) -> Any:
    return make_dual(context, builder, builder.load(data, typ=_F64), records.vector_at(builder, slopes))


records.NUMBERS[records.DUALS] = records.Numbers(dual, DualArrayType, _load_entry)
lower_builtin(records._MAKE, DualArrayType)(records.make_table)
