"""Numbers with exact derivatives: duals, forward, and taped numbers, in reverse.

A kernel that reads from a *dual array* computes with duals instead of floats: values with their derivatives by eight
parameters. It so returns the derivatives of its results by the parameters of the input derivatives (forward
differentiation):

    (x, dx) (y, dy) = (x y, y dx + x dy),   f((x, dx)) = (f(x), f'(x) dx)

Eight derivatives fill one register, so they cost little more than one. A *taped* number has its place on the tape
(``numbers.tape``) instead, where every operation stores its partial derivatives; a sweep backwards yields the
derivatives of one result by any number of parameters.

Comparisons use values only: a derivative is that of the branch that was taken.

Reference: Griewank & Walther (2008), Evaluating Derivatives, chapters 3 and 4.
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

from meltemi.maths.generic import beyond, crossed, floor, largest, last, running, total, where, whole, zero
from meltemi.numbers.lanes import WIDTH, lanes, splat
from meltemi.numbers.tape import append

N_DERIVATIVES = WIDTH

_F64, _I64, _I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_VF = ir.VectorType(_F64, WIDTH)
_NUMBER = (types.Float, types.Integer)


# types ----------------------------------------------------------------------------------------------


class ActiveType(types.Type):
    """A float64 value and what carries its derivatives: eight of them, or a place on the tape.

    Attributes:
      slopes: number type of the derivatives or the place.
      words: 8-byte words of an entry in the array of derivatives or places.
    """

    def __init__(self, name: str, slopes: Any, words: int) -> None:
        self.slopes, self.words = slopes, words
        super().__init__(name=name)

    def can_convert_from(self, context: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, _NUMBER) else None

    def unify(self, context: Any, other: Any) -> Any:
        return self if isinstance(other, _NUMBER) else None


class ActiveArrayType(types.Type):
    """An array of values and the array of their derivatives or places."""

    def __init__(self, number: ActiveType, ndim: int) -> None:
        self.number, self.ndim = number, ndim
        super().__init__(name=f"ActiveArray({number.name},{ndim})")


class IndexType(types.UniTuple):
    """Index of an entry, or of a subarray, of a dual array."""


dual = ActiveType("dual", lanes, WIDTH)
taped = ActiveType("taped", types.int64, 1)
register_model(IndexType)(models.UniTupleModel)


@register_model(ActiveType)
class _ActiveModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        super().__init__(manager, frontend, [("value", types.float64), ("slopes", frontend.slopes)])


@register_model(ActiveArrayType)
class _ActiveArrayModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        pointer = types.CPointer(types.float64)
        members = [("values", pointer), ("slopes", pointer), ("shape", types.UniTuple(types.intp, frontend.ndim))]
        super().__init__(manager, frontend, members)


class _Active:
    """LLVM values of a number with derivatives during code generation."""

    def __init__(self, kind: Any, value: Any, slopes: Any | None) -> None:
        self.kind, self.value, self.slopes = kind, value, slopes  # no slopes: a constant


def _is_active(kind: Any) -> bool:
    return isinstance(kind, ActiveType)


def _take(context: Any, builder: Any, kind: Any, x: Any) -> _Active:
    if _is_active(kind):
        return _Active(kind, builder.extract_value(x, 0), builder.extract_value(x, 1))
    return _Active(kind, context.cast(builder, x, kind, types.float64), None)


def _make(context: Any, builder: Any, kind: Any, value: Any, slopes: Any | None) -> Any:
    """LLVM value of a number; without slopes that of a constant."""
    proxy = cgutils.create_struct_proxy(kind)(context, builder)
    proxy.value = value
    proxy.slopes = slopes if slopes is not None else _I64(0) if kind == taped else ir.Constant(_VF, [0.0] * WIDTH)
    return proxy._getvalue()


ONE, MINUS_ONE = "1", "-1"
"""Partial derivatives that need no multiplication."""


def _result(context: Any, builder: Any, value: Any, *terms: tuple[_Active, Any]) -> Any:
    """LLVM value of a result with partial derivatives by arguments of which at least one has slopes."""
    terms = tuple((x, partial) for x, partial in terms if x.slopes is not None)
    kind = terms[0][0].kind
    if kind == taped:
        if len(terms) == 1 and terms[0][1] is ONE:
            return _make(context, builder, kind, value, terms[0][0].slopes)
        signs = {ONE: _F64(1.0), MINUS_ONE: _F64(-1.0)}
        place = append(builder, [(x.slopes, signs[p] if isinstance(p, str) else p) for x, p in terms])
        return _make(context, builder, kind, value, place)
    slopes = None
    for x, partial in terms:
        term = x.slopes if isinstance(partial, str) else builder.fmul(x.slopes, splat(builder, partial))
        if slopes is None:
            slopes = builder.fneg(term) if partial is MINUS_ONE else term
        else:
            slopes = builder.fsub(slopes, term) if partial is MINUS_ONE else builder.fadd(slopes, term)
    return _make(context, builder, kind, value, slopes)


@lower_cast(types.Float, ActiveType)
@lower_cast(types.Integer, ActiveType)
def _to_active(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return _make(context, builder, new, context.cast(builder, x, old, types.float64), None)


# operations -----------------------------------------------------------------------------------------


def _operation(function: Any, count: int, result: Any, generate: Any) -> None:
    """Implement ``function`` for ``count`` arguments of which at least one has derivatives.

    Args:
      result: its type; None for a number with derivatives.
      generate: (context, builder, *numbers) -> LLVM value.
    """

    class Rule(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            kind = next((a for a in args if _is_active(a)), None)
            if kws or len(args) != count or kind is None or not all(a == kind or isinstance(a, _NUMBER) for a in args):
                return None
            return signature(result or kind, *(kind if a == kind else types.float64 for a in args))

    infer_global(function)(Rule)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        numbers = [_take(context, builder, kind, x) for kind, x in zip(sig.args, args, strict=True)]
        return generate(context, builder, *numbers)

    choices = [(ActiveType,), (types.Float,)]
    kinds = [(ActiveType,)] if count == 1 else [(a[0], b[0]) for a in choices for b in choices if ActiveType in a + b]
    for kind in kinds:
        lower_builtin(function, *kind)(lower)


def _sum(sign: str) -> Any:
    def generate(context: Any, builder: Any, x: _Active, y: _Active) -> Any:
        value = getattr(builder, sign)(x.value, y.value)
        return _result(context, builder, value, (x, ONE), (y, ONE if sign == "fadd" else MINUS_ONE))

    return generate


def _product(context: Any, builder: Any, x: _Active, y: _Active) -> Any:
    return _result(context, builder, builder.fmul(x.value, y.value), (x, y.value), (y, x.value))


def _ratio(context: Any, builder: Any, x: _Active, y: _Active) -> Any:
    """(x / y)' = x' / y - (x / y) y' / y."""
    value = builder.fdiv(x.value, y.value)
    inverse = builder.fdiv(ir.Constant(_F64, 1.0), y.value)
    return _result(context, builder, value, (x, inverse), (y, builder.fneg(builder.fmul(value, inverse))))


for _functions, _generate in (
    ((operator.add, operator.iadd), _sum("fadd")),
    ((operator.sub, operator.isub), _sum("fsub")),
    ((operator.mul, operator.imul), _product),
    ((operator.truediv, operator.itruediv), _ratio),
):
    for _function in _functions:
        _operation(_function, 2, None, _generate)


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


def _number_of(context: Any, builder: Any, x: _Active, kind: Any) -> Any:
    return _make(context, builder, kind, x.value, x.slopes)


def _choice(sign: str) -> Any:
    """Minimum and maximum: the first argument unless the second is beyond it."""

    def generate(context: Any, builder: Any, x: _Active, y: _Active) -> Any:
        kind = x.kind if x.slopes is not None else y.kind
        beyond = builder.fcmp_ordered(sign, y.value, x.value)
        return builder.select(beyond, *(_number_of(context, builder, each, kind) for each in (y, x)))

    return generate


_operation(min, 2, None, _choice("<"))
_operation(max, 2, None, _choice(">"))
_operation(operator.neg, 1, None, lambda c, b, x: _result(c, b, b.fneg(x.value), (x, MINUS_ONE)))
for _function in (total, largest, running, last):
    _operation(_function, 1, None, lambda c, b, x: _number_of(c, b, x, x.kind))
_operation(whole, 1, types.int64, lambda c, b, x: b.fptosi(x.value, _I64))


def _call(builder: Any, name: str, x: Any) -> Any:
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(x.type, [x.type]), name)
    return builder.call(function, [x])


def _magnitude(context: Any, builder: Any, x: _Active) -> Any:
    negative = builder.fcmp_ordered("<", x.value, ir.Constant(_F64, 0.0))
    sign = builder.select(negative, _F64(-1.0), _F64(1.0))
    return _result(context, builder, _call(builder, "llvm.fabs.f64", x.value), (x, sign))


def _root(context: Any, builder: Any, x: _Active) -> Any:
    """Square root, with zero slope at zero, where the slope is infinite."""
    value = _call(builder, "llvm.sqrt.f64", x.value)
    positive = builder.fcmp_ordered(">", value, ir.Constant(_F64, 0.0))
    rate = builder.select(positive, builder.fdiv(ir.Constant(_F64, 0.5), value), ir.Constant(_F64, 0.0))
    return _result(context, builder, value, (x, rate))


_operation(abs, 1, None, _magnitude)
_operation(math.sqrt, 1, None, _root)
for _function in (floor, math.floor):
    _operation(_function, 1, types.float64, lambda c, b, x: _call(b, "llvm.floor.f64", x.value))


class _Where(AbstractTemplate):
    key = where

    def generic(self, args: Any, kws: Any) -> Any:
        kind = next((a for a in args[1:] if _is_active(a)), None)
        if kind is None or not isinstance(args[0], types.Boolean):
            return None
        return signature(kind, types.boolean, kind, kind)


infer_global(where)(_Where)


@lower_builtin(where, types.Boolean, ActiveType, ActiveType)
def _where(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(*args)


def _within_step(context: Any, builder: Any, x: _Active) -> Any:
    """1 where the value is smaller than one of its derivatives, which are the changes over a finite difference."""
    if x.kind == taped:
        return _F64(0.0)
    size = ir.FunctionType(_VF, [_VF])
    change = builder.call(cgutils.get_or_insert_function(builder.module, size, f"llvm.fabs.v{WIDTH}f64"), [x.slopes])
    near = splat(builder, _call(builder, "llvm.fabs.f64", x.value))
    beyond = builder.fcmp_ordered(">", change, near)
    bits = builder.bitcast(beyond, ir.IntType(WIDTH))
    return builder.uitofp(builder.icmp_unsigned("!=", bits, bits.type(0)), _F64)


_operation(crossed, 1, types.float64, _within_step)


@overload(beyond, strict=False)
def _beyond(x: Any, bound: Any) -> Any:
    return (lambda x, bound: bound == bound) if _is_active(x) else None


# elementary functions -------------------------------------------------------------------------------


@intrinsic
def value(typing_context: Any, x: Any) -> Any:
    """The value of a number with derivatives."""
    return types.float64(x), lambda context, builder, signature, args: builder.extract_value(args[0], 0)


@intrinsic
def chain(typing_context: Any, f: Any, slope: Any, x: Any) -> Any:
    """The number with value f and the derivatives of x times a slope."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _result(context, builder, args[0], (_take(context, builder, x, args[2]), args[1]))

    return x(types.float64, types.float64, x), generate


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
        return implementation if _is_active(x) else None


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
def _as_active(typing_context: Any, x: Any, other: Any) -> Any:
    """A number in the type of it and another that has derivatives."""
    kind = x if _is_active(x) else other
    return kind(kind, other), lambda context, builder, signature, args: args[0]


@overload(math.atan2, strict=False)
def _atan2(y: Any, x: Any) -> Any:
    if not (_is_active(y) or _is_active(x)):
        return None

    def atan2(y: Any, x: Any) -> Any:
        up, along = _as_active(y, x), _as_active(x, y)
        a, b = value(up), value(along)
        r2 = a * a + b * b
        inverse = 1.0 / r2 if r2 > 0.0 else 0.0
        angle = chain(0.0, b * inverse, up) - chain(0.0, a * inverse, along)
        return angle + math.atan2(a, b)

    return atan2


# arrays ---------------------------------------------------------------------------------------------


@infer_getattr
class _ActiveArrayAttributes(AttributeTemplate):
    key = ActiveArrayType

    def resolve_shape(self, array: Any) -> Any:
        return types.UniTuple(types.intp, array.ndim)


@lower_getattr(ActiveArrayType, "shape")
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
        if not isinstance(array, ActiveArrayType):
            return None
        at = _index(array, index)
        if at is None:
            return None
        left = array.ndim - len(at)
        return signature(ActiveArrayType(array.number, left) if left else array.number, array, at)


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        array, index, x = args
        if not isinstance(array, ActiveArrayType):
            return None
        if isinstance(index, types.SliceType) and not index.has_step:
            if x == array:
                return signature(types.none, array, index, array)
            return signature(types.none, array, index, array.number)
        at = _index(array, index)
        if at is None or len(at) != array.ndim or not (x == array.number or isinstance(x, _NUMBER)):
            return None
        return signature(types.none, array, at, array.number)


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
    slopes = builder.gep(proxy.slopes, [builder.mul(flat, flat.type(kind.number.words))], source_etype=_F64)
    return values, slopes, shape[len(at) :]


@lower_builtin(operator.getitem, ActiveArrayType, IndexType)
def _load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values, slopes, left = _place(context, builder, sig.args[0], *args)
    if left:
        proxy = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        proxy.values, proxy.slopes = values, slopes
        proxy.shape = context.make_tuple(builder, types.UniTuple(types.intp, len(left)), left)
        return proxy._getvalue()
    return load_number(context, builder, sig.return_type, values, slopes)


def load_number(context: Any, builder: Any, kind: Any, values: Any, slopes: Any) -> Any:
    """Load a number from the addresses of its value and of its derivatives or place."""
    made = context.get_value_type(kind.slopes)
    found = builder.load(builder.bitcast(slopes, made.as_pointer()), align=8, typ=made)
    return _make(context, builder, kind, builder.load(values, typ=_F64), found)


def store_number(builder: Any, x: Any, values: Any, slopes: Any) -> None:
    """Store a number at the addresses of its value and of its derivatives or place."""
    found = builder.extract_value(x, 1)
    builder.store(builder.extract_value(x, 0), values)
    builder.store(found, builder.bitcast(slopes, found.type.as_pointer()), align=8)


@lower_builtin(operator.setitem, ActiveArrayType, IndexType, ActiveType)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values, slopes, _ = _place(context, builder, sig.args[0], *args[:2])
    store_number(builder, args[2], values, slopes)
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


def _nth(builder: Any, kind: Any, array: Any, i: Any) -> tuple[Any, Any]:
    return (
        builder.gep(array.values, [i], source_etype=_F64),
        builder.gep(array.slopes, [builder.mul(i, i.type(kind.number.words))], source_etype=_F64),
    )


@lower_builtin(operator.setitem, ActiveArrayType, types.SliceType, ActiveType)
def _fill(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """A[i:j] = x."""
    to = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    begin, count = _places(context, builder, sig.args[1], args[1], to)
    with cgutils.for_range(builder, count) as loop:
        store_number(builder, args[2], *_nth(builder, sig.args[0], to, builder.add(begin, loop.index)))
    return context.get_dummy_value()


@lower_builtin(operator.setitem, ActiveArrayType, types.SliceType, ActiveArrayType)
def _copy(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """A[i:j] = B, where B has the shape of the slice."""
    to = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    source = cgutils.create_struct_proxy(sig.args[2])(context, builder, args[2])
    begin, count = _places(context, builder, sig.args[1], args[1], to)
    with cgutils.for_range(builder, count) as loop:
        kind = sig.args[0]
        x = load_number(context, builder, kind.number, *_nth(builder, kind, source, loop.index))
        store_number(builder, x, *_nth(builder, kind, to, builder.add(begin, loop.index)))
    return context.get_dummy_value()


class _Zero(AbstractTemplate):
    key = zero

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(args[0].number, *args) if isinstance(args[0], ActiveArrayType) else None


infer_global(zero)(_Zero)


@lower_builtin(zero, ActiveArrayType)
def _zero(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _make(context, builder, sig.return_type, ir.Constant(_F64, 0.0), None)
