"""Lanes: eight floats that undergo the same operations at once, in the vector registers of the processor.

A kernel that reads ``A[field, blade, n]`` gets a float if A is a NumPy array. If A is a *lane array* it gets
eight: those of nodes 8 n to 8 n + 7, and ``A.shape[-1]`` is the number of such groups. So kernels are written once,
for one node, and the type of their arrays determines the number of nodes per operation.

Lanes have +, -, \\*, /, comparisons (their result is a *mask*; combine masks by & and |), ``abs``, ``min``,
``max``, ``math.sqrt``, the elementary functions of ``math``, and the functions of ``generic``. They have no
branches: ``where`` replaces ``if``. An integer part (``whole``) may be used as an index into a
NumPy array; this gathers eight entries.

LLVM's own vectoriser does not achieve this: it cannot prove that the arrays of a kernel do not overlap.

Numbers: IEEE arithmetic in every lane, so lanes differ from floats only in the rounding of elementary
functions and in the order of sums over nodes.
"""

from __future__ import annotations

import math
import operator
from typing import Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import intrinsic, models, overload, register_model

from meltemi.compiler import elementary
from meltemi.compiler.generic import (
    anywhere,
    beyond,
    crossed,
    floor,
    held,
    largest,
    last,
    neighbours,
    reverse,
    running,
    split,
    total,
    two_to,
    where,
    whole,
    zero,
)

WIDTH = 8
"""Lanes per number: a register of AVX-512, two of AVX2."""
N_DERIVATIVES = WIDTH
"""Derivatives of a dual number, see ``duals``."""

_F64, _I64, _I32, _BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(32), ir.IntType(1)
_VF, _VI, _VM = (ir.VectorType(t, WIDTH) for t in (_F64, _I32, _BIT))
_VL = ir.VectorType(_I64, WIDTH)
_BYTES = 8


# types ----------------------------------------------------------------------------------------------


class LanesType(types.Type):
    """Eight float64."""

    def can_convert_from(self, context: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, (types.Float, types.Integer)) else None

    def unify(self, context: Any, other: Any) -> Any:
        return self if isinstance(other, (types.Float, types.Integer)) else None


class IntLanesType(types.Type):
    """Eight int32: indices into an array."""


class MaskType(types.Type):
    """Eight booleans."""


class PlacesType(types.UniTuple):
    """Eight indices into an array."""


class LaneArrayType(types.Type):
    """An array whose last axis is read eight entries at a time."""

    def __init__(self, ndim: int) -> None:
        self.ndim = ndim
        super().__init__(name=f"LaneArray({ndim})")


lanes, int_lanes, mask = LanesType("lanes"), IntLanesType("int_lanes"), MaskType("mask")


def _primitive(cls: Any, backend: Any) -> None:
    @register_model(cls)
    class _Model(models.PrimitiveModel):
        def __init__(self, manager: Any, frontend: Any) -> None:
            super().__init__(manager, frontend, backend)


_primitive(LanesType, _VF)
_primitive(IntLanesType, _VI)
_primitive(MaskType, _VM)
register_model(PlacesType)(models.UniTupleModel)


@register_model(LaneArrayType)
class _LaneArrayModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        members = [("data", types.CPointer(types.float64)), ("shape", types.UniTuple(types.intp, frontend.ndim))]
        super().__init__(manager, frontend, members)


@infer_getattr
class _LaneArrayAttributes(AttributeTemplate):
    key = LaneArrayType

    def resolve_shape(self, array: Any) -> Any:
        return types.UniTuple(types.intp, array.ndim)


@lower_getattr(LaneArrayType, "shape")
def _shape(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value).shape


# conversion -----------------------------------------------------------------------------------------


def splat(builder: Any, x: Any) -> Any:
    """Vector with the scalar ``x`` in every lane."""
    v = builder.insert_element(ir.Constant(ir.VectorType(x.type, WIDTH), ir.Undefined), x, _I32(0))
    return builder.shuffle_vector(v, v, ir.Constant(ir.VectorType(_I32, WIDTH), [0] * WIDTH))


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _to_lanes(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return splat(builder, context.cast(builder, x, old, types.float64))


@lower_cast(types.Integer, IntLanesType)
def _to_int_lanes(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return splat(builder, context.cast(builder, x, old, types.int32))


@lower_cast(IntLanesType, LanesType)
def _int_to_lanes(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return builder.sitofp(x, _VF)


@lower_cast(types.Boolean, MaskType)
def _to_mask(context: Any, builder: Any, old: Any, new: Any, x: Any) -> Any:
    return splat(builder, context.cast(builder, x, old, types.boolean))


@lower_cast(types.UniTuple, PlacesType)
@lower_cast(types.Tuple, PlacesType)
def _to_places(context: Any, builder: Any, old: Any, new: Any, index: Any) -> Any:
    at = cgutils.unpack_tuple(builder, index)
    places = [context.cast(builder, i, t, int_lanes) for i, t in zip(at, old, strict=True)]
    return context.make_tuple(builder, new, places)


# operations -----------------------------------------------------------------------------------------

_NUMBER = (types.Float, types.Integer)


def _operation(function: Any, kinds: tuple[Any, ...], result: Any, generate: Any) -> None:
    """Implement ``function`` for the given argument types; plain numbers may replace all arguments but one.

    Args:
      generate: (builder, *LLVM values) -> LLVM value.
    """
    plain = {lanes: _NUMBER, int_lanes: (types.Integer,), mask: (types.Boolean,)}

    class Rule(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != len(kinds) or not any(a in (lanes, int_lanes, mask) for a in args):
                return None
            if lanes in kinds and not any(a == lanes or isinstance(a, types.Float) for a in args):
                return None  # integers stay integers
            for a, kind in zip(args, kinds, strict=True):
                if a != kind and not isinstance(a, plain[kind]) and (a, kind) != (int_lanes, lanes):
                    return None
            return signature(result, *kinds)

    infer_global(function)(Rule)

    @lower_builtin(function, *(type(kind) for kind in kinds))
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return generate(builder, *args)


def _both(name: str) -> Any:
    return lambda builder, x, y: getattr(builder, name)(x, y)


def _call(name: str, vector: Any = _VF) -> Any:
    """Code generator for a call of an LLVM function on vectors."""

    def generate(builder: Any, *args: Any) -> Any:
        kind = ir.FunctionType(vector, [a.type for a in args])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)

    return generate


for _symbol, _in_place, _float_name, _int_name in (
    (operator.add, operator.iadd, "fadd", "add"),
    (operator.sub, operator.isub, "fsub", "sub"),
    (operator.mul, operator.imul, "fmul", "mul"),
    (operator.truediv, operator.itruediv, "fdiv", ""),
):
    for _function in (_symbol, _in_place):
        if _int_name:
            _operation(_function, (int_lanes, int_lanes), int_lanes, _both(_int_name))
        _operation(_function, (lanes, lanes), lanes, _both(_float_name))

for _symbol, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _operation(_symbol, (int_lanes, int_lanes), mask, lambda b, x, y, s=_sign: b.icmp_signed(s, x, y))
    _operation(_symbol, (lanes, lanes), mask, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y))
_operation(operator.ne, (int_lanes, int_lanes), mask, lambda b, x, y: b.icmp_signed("!=", x, y))
_operation(operator.ne, (lanes, lanes), mask, lambda b, x, y: b.fcmp_unordered("!=", x, y))
_operation(operator.and_, (mask, mask), mask, _both("and_"))
_operation(operator.or_, (mask, mask), mask, _both("or_"))
_operation(operator.neg, (lanes,), lanes, lambda b, x: b.fneg(x))
_operation(abs, (lanes,), lanes, _call(f"llvm.fabs.v{WIDTH}f64"))
_operation(math.sqrt, (lanes,), lanes, _call(f"llvm.sqrt.v{WIDTH}f64"))
for _function in (floor, math.floor):
    _operation(_function, (lanes,), lanes, _call(f"llvm.floor.v{WIDTH}f64"))
# as in Python's min and max: the first argument unless the second is beyond it
_operation(min, (lanes, lanes), lanes, lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x))
_operation(max, (lanes, lanes), lanes, lambda b, x, y: b.select(b.fcmp_ordered(">", y, x), y, x))
_operation(min, (int_lanes, int_lanes), int_lanes, lambda b, x, y: b.select(b.icmp_signed("<", y, x), y, x))
_operation(max, (int_lanes, int_lanes), int_lanes, lambda b, x, y: b.select(b.icmp_signed(">", y, x), y, x))
_operation(where, (mask, lanes, lanes), lanes, lambda b, c, x, y: b.select(c, x, y))
_operation(where, (mask, int_lanes, int_lanes), int_lanes, lambda b, c, x, y: b.select(c, x, y))
_operation(whole, (lanes,), int_lanes, lambda b, x: b.fptosi(x, _VI))


def _fold(name: str) -> Any:
    """Code generator for the pairwise reduction of the lanes by an operation: halves, quarters, eighths."""

    def generate(builder: Any, x: Any) -> Any:
        width = WIDTH
        while width > 1:
            width //= 2
            parts = [
                builder.shuffle_vector(x, x, ir.Constant(ir.VectorType(_I32, width), [first + i for i in range(width)]))
                for first in (0, width)
            ]
            if name == "max":
                x = builder.select(builder.fcmp_ordered(">", parts[1], parts[0]), parts[1], parts[0])
            else:
                x = getattr(builder, name)(*parts)
        return builder.extract_element(x, _I32(0))

    return generate


def _running_sum(builder: Any, x: Any) -> Any:
    """Sums over the lanes up to each one, by adding the lanes 1, 2 and 4 before."""
    nothing, step = ir.Constant(_VF, [0.0] * WIDTH), 1
    while step < WIDTH:
        places = [WIDTH - step + i for i in range(WIDTH)]  # lanes of nothing, then of x
        x = builder.fadd(x, builder.shuffle_vector(nothing, x, ir.Constant(ir.VectorType(_I32, WIDTH), places)))
        step *= 2
    return x


_operation(running, (lanes,), lanes, _running_sum)
_operation(last, (lanes,), types.float64, lambda b, x: b.extract_element(x, _I32(WIDTH - 1)))
_operation(crossed, (lanes,), types.float64, lambda b, x: ir.Constant(_F64, 0.0))
_operation(total, (lanes,), types.float64, _fold("fadd"))
_operation(largest, (lanes,), types.float64, _fold("max"))
_operation(anywhere, (mask,), types.boolean, _fold("or_"))


def _power_of_two(builder: Any, n: Any) -> Any:
    """2^n by setting the exponent bits."""
    i = builder.sext(builder.fptosi(n, _VI), _VL)
    constant = [ir.Constant(_VL, [k] * WIDTH) for k in (1023, 52)]
    return builder.bitcast(builder.shl(builder.add(i, constant[0]), constant[1]), _VF)


_operation(two_to, (lanes,), lanes, _power_of_two)


def _mantissa(builder: Any, x: Any) -> Any:
    """Mantissa in [sqrt(1/2), sqrt(2)) and exponent."""
    constant = {k: ir.Constant(_VL, [k] * WIDTH) for k in (0x3FE6A09E667F3BCD, 52, -1 << 52, 1023)}
    base = constant[0x3FE6A09E667F3BCD]  # the bits of sqrt(1/2)
    bits = builder.bitcast(x, _VL)
    above = builder.sub(bits, base)
    exponent = builder.ashr(above, constant[52])
    # a product with 2^-exponent, as exact as changing the bits, has a derivative
    less = builder.sub(builder.shl(constant[1023], constant[52]), builder.and_(above, constant[-1 << 52]))
    return builder.fmul(x, builder.bitcast(less, _VF)), builder.sitofp(builder.trunc(exponent, _VI), _VF)


class _Split(AbstractTemplate):
    key = split

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(types.UniTuple(lanes, 2), lanes) if tuple(args) == (lanes,) else None


infer_global(split)(_Split)


@lower_builtin(split, LanesType)
def _lower_split(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return context.make_tuple(builder, sig.return_type, _mantissa(builder, args[0]))


for _function, _ours in (
    (math.exp, elementary.exp),
    (math.expm1, elementary.expm1),
    (math.log, elementary.log),
    (math.sin, elementary.sin),
    (math.cos, elementary.cos),
    (math.tan, elementary.tan),
    (math.acos, elementary.acos),
    (math.tanh, elementary.tanh),
):

    def _overload_one(function: Any, ours: Any) -> None:
        @overload(function, strict=False)
        def choose(x: Any) -> Any:
            return (lambda x: ours(x)) if x == lanes else None

    _overload_one(_function, _ours)


REVERSE = "meltemi_reverse"
"""A word that is zero; code that is differentiated in reverse has a 1 in its place."""
_NEVER = np.zeros(1, dtype=np.int64)
llvmlite.binding.add_symbol(REVERSE, _NEVER.ctypes.data)


@intrinsic
def _in_reverse(typing_context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = builder.module.globals.get(REVERSE) or cgutils.add_global_variable(builder.module, _I64, REVERSE)
        load = builder.load(word, typ=_I64)
        load.set_metadata("invariant.load", builder.module.add_metadata([]))
        return builder.icmp_unsigned("!=", load, _I64(0))

    return types.boolean(), generate


@intrinsic
def _fence(typing_context: Any, x: Any) -> Any:
    """x behind a mark that reverse differentiation does not pass, and that costs nothing."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        name = f"llvm.arithmetic.fence.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, ir.FunctionType(_VF, [_VF]), name), args)

    return lanes(lanes), generate


@overload(reverse, strict=False)
def _reverse(x: Any) -> Any:
    return (lambda x: _in_reverse()) if x == lanes else None


@overload(held, strict=False)
def _held(x: Any) -> Any:
    return (lambda x: _fence(x)) if x == lanes else None


@overload(beyond, strict=False)
def _beyond(x: Any, bound: Any) -> Any:
    return (lambda x, bound: abs(x) > bound) if x == lanes else None


@overload(math.atan2, strict=False)
def _atan2(y: Any, x: Any) -> Any:
    atan2 = elementary.atan2
    return (lambda y, x: atan2(y, x)) if lanes in (y, x) else None


# arrays ---------------------------------------------------------------------------------------------


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        array, index = args
        if not isinstance(index, types.BaseTuple):
            return None
        if isinstance(array, LaneArrayType) and len(index) == array.ndim:
            return signature(lanes, array, types.UniTuple(types.intp, array.ndim))
        if isinstance(array, types.Array) and len(index) == array.ndim and int_lanes in tuple(index):
            return signature(lanes, array, PlacesType(int_lanes, array.ndim))
        return None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        array, index, value = args
        if not (isinstance(array, LaneArrayType) and isinstance(index, types.BaseTuple) and len(index) == array.ndim):
            return None
        if value != lanes and not isinstance(value, _NUMBER):
            return None
        return signature(types.none, array, types.UniTuple(types.intp, array.ndim), lanes)


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    """Pointer to the lanes at an index."""
    proxy = cgutils.create_struct_proxy(kind)(context, builder, array)
    shape, at = cgutils.unpack_tuple(builder, proxy.shape), cgutils.unpack_tuple(builder, index)
    flat = at[0]
    for length, i in zip(shape[1:], at[1:], strict=True):
        flat = builder.add(builder.mul(flat, length), i)
    flat = builder.mul(flat, flat.type(WIDTH))
    return builder.bitcast(builder.gep(proxy.data, [flat], source_etype=_F64), _VF.as_pointer())


@lower_builtin(operator.getitem, LaneArrayType, types.UniTuple)
def _load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_place(context, builder, sig.args[0], *args), align=_BYTES, typ=_VF)


@lower_builtin(operator.setitem, LaneArrayType, types.UniTuple, LanesType)
def _store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _place(context, builder, sig.args[0], *args[:2]), align=_BYTES)
    return context.get_dummy_value()


@lower_builtin(operator.getitem, types.Array, PlacesType)
def _look_up(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Gather eight entries of a C-contiguous array."""
    kind = sig.args[0]
    array = context.make_array(kind)(context, builder, args[0])
    shape, at = cgutils.unpack_tuple(builder, array.shape), cgutils.unpack_tuple(builder, args[1])
    flat = builder.sext(at[0], _VL)
    for length, i in zip(shape[1:], at[1:], strict=True):
        flat = builder.add(builder.mul(flat, splat(builder, length)), builder.sext(i, _VL))
    entry = context.get_data_type(kind.dtype)
    vector = ir.Constant(ir.VectorType(entry, WIDTH), ir.Undefined)
    for k in range(WIDTH):
        place = builder.gep(array.data, [builder.extract_element(flat, _I32(k))], source_etype=entry)
        vector = builder.insert_element(vector, builder.load(place, typ=entry), _I32(k))
    return vector if kind.dtype == types.float64 else builder.fpext(vector, _VF)


class _Neighbours(AbstractTemplate):
    key = neighbours

    def generic(self, args: Any, kws: Any) -> Any:
        box, *at = args
        if not (isinstance(box, types.Array) and box.ndim == 4 and int_lanes in at):
            return None
        return signature(types.UniTuple(lanes, 6), box, int_lanes, int_lanes, int_lanes)


infer_global(neighbours)(_Neighbours)


def _shuffle(builder: Any, x: Any, y: Any, places: list[int]) -> Any:
    return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(_I32, len(places)), places))


@lower_builtin(neighbours, types.Array, IntLanesType, IntLanesType, IntLanesType)
def _lower_neighbours(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Load four and two numbers of each lane at once, and transpose them; single numbers would take thrice as long."""
    array = context.make_array(sig.args[0])(context, builder, args[0])
    shape = cgutils.unpack_tuple(builder, array.shape)
    flat = builder.sext(args[1], _VL)
    for length, i in zip(shape[1:3], args[2:], strict=True):
        flat = builder.add(builder.mul(flat, splat(builder, length)), builder.sext(i, _VL))
    flat = builder.mul(flat, ir.Constant(_VL, [3] * WIDTH))
    entry = ir.FloatType()
    fours: list[Any] = []
    twos: list[Any] = []
    for lane in range(WIDTH):
        place = builder.gep(array.data, [builder.extract_element(flat, _I32(lane))], source_etype=entry)
        for first, count, parts in ((0, 4, fours), (4, 2, twos)):
            kind = ir.VectorType(entry, count)
            at = builder.bitcast(builder.gep(place, [_I32(first)], source_etype=entry), kind.as_pointer())
            parts.append(builder.load(at, align=4, typ=kind))
    # lanes 0 to 3 in the lower half of a register, 4 to 7 in the upper one
    halves = [_shuffle(builder, fours[i], fours[i + 4], [*range(8)]) for i in range(4)]
    vectors = []
    for mixed in ([0, 8, 1, 9, 4, 12, 5, 13], [2, 10, 3, 11, 6, 14, 7, 15]):
        a, b = (_shuffle(builder, halves[i], halves[i + 1], mixed) for i in (0, 2))
        vectors += [_shuffle(builder, a, b, [i, i + 1, i + 8, i + 9, i + 4, i + 5, i + 12, i + 13]) for i in (0, 2)]
    pairs = [_shuffle(builder, twos[i], twos[i + 1], [*range(4)]) for i in (0, 2, 4, 6)]
    a, b = (_shuffle(builder, pairs[i], pairs[i + 2], [*range(8)]) for i in (0, 1))
    vectors += [_shuffle(builder, a, b, [i, i + 2, i + 8, i + 10, i + 4, i + 6, i + 12, i + 14]) for i in (0, 1)]
    return context.make_tuple(builder, sig.return_type, [builder.fpext(x, _VF) for x in vectors])


class _Zero(AbstractTemplate):
    key = zero

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(lanes, *args) if isinstance(args[0], LaneArrayType) else None


infer_global(zero)(_Zero)


@lower_builtin(zero, LaneArrayType)
def _zero(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return ir.Constant(_VF, [0.0] * WIDTH)
