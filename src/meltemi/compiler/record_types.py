"""Tables and records in kernels, for every number type: floats, lanes, duals.

Access to fields and entries is generated inline, without reference counts: the host owns the memory. A record is the
address of its words, which nothing writes while kernels run; so their loads are marked as invariant, and stores of a
kernel into arrays do not force it to load them again. One module: types, boxing and access of tables and of records are
two halves of the same layout.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.boxing import unbox_unsupported
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr_generic, lower_setattr_generic
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import NativeValue, models, overload, register_model, typeof_impl, unbox

from meltemi.compiler.groups import GroupType, join, split
from meltemi.compiler.lanes import WIDTH, LaneArrayType, PlacesType, int_lanes, lanes, splat
from meltemi.compiler.records import KernelRecord as KernelRecord
from meltemi.compiler.records import RecordMember, leading, members
from meltemi.compiler.tables import Table, TableClass

_F64, _I64, _I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
_VF, _VL = ir.VectorType(_F64, WIDTH), ir.VectorType(_I64, WIDTH)
FLOATS, LANES, DUALS, INTS = "floats", "lanes", "duals", "ints"


class Numbers(NamedTuple):
    """A number type of records and tables: type of an entry, type of an array by its dimensions, and code that loads an
    entry from the addresses of its value and of its derivatives."""

    entry: Any
    array: Callable[[int], Any]
    load: Callable[[Any, Any, Any, Any], Any]


class _Registered(dict[str, Numbers]):
    """Number types by name; those of ``ELSEWHERE`` register themselves when they are first used."""

    def __missing__(self, kind: str) -> Numbers:
        import_module(ELSEWHERE[kind])
        return self[kind]


ELSEWHERE = {DUALS: "meltemi.compiler.duals"}
NUMBERS = _Registered(
    {
        FLOATS: Numbers(
            types.float64, lambda n: types.Array(types.float64, n, "C"), lambda c, b, data, _: b.load(data, typ=_F64)
        ),
        INTS: Numbers(
            types.int64, lambda n: types.Array(types.int64, n, "C"), lambda c, b, data, _: b.load(data, typ=_I64)
        ),
        LANES: Numbers(lanes, LaneArrayType, lambda c, b, data, _: vector_at(b, data)),
    }
)


# entries of fields ----------------------------------------------------------------------------------


def named(cls: Any) -> str:
    """Name of a class that no other class has: types of kernels, and their caches, are distinguished by name."""
    return f"{cls.__module__}.{cls.__qualname__}"


class FieldType(types.Type):
    """Entries of one field of a table: number type, class of an entry, number of axes, rows of an outer axis, and
    ``step`` from one entry to the next: 1, or the number of fields where fields are last."""

    def __init__(self, kind: str, cls: Any, ndim: int, outer: int, step: int) -> None:
        self.kind, self.cls, self.ndim, self.outer, self.step = kind, cls, ndim, outer, step
        super().__init__(name=f"Field[{kind},{cls.__name__ if cls else 'number'},{ndim},{outer},{step}]")

    @property
    def entry(self) -> Any:
        """Type of an entry."""
        number = NUMBERS[self.kind].entry
        return GroupType(self.cls, number) if self.cls else number

    @property
    def parts(self) -> int:
        """Number of values of an entry."""
        return len(self.cls.__slots__) if self.cls else 1


class TableType(types.Type):
    """An array of a table."""

    def __init__(self, table: Any, kind: str) -> None:
        self.table, self.kind, self.ndim = table, kind, len(table.axes)
        super().__init__(name=f"{named(table)}[{kind}]")

    @property
    def key(self) -> Any:
        """Identity of the type: two modules may use the same name."""
        return self.table, self.kind


@register_model(FieldType)
@register_model(TableType)
class _EntriesModel(models.StructModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        pointer = types.CPointer(types.int64 if frontend.kind == INTS else types.float64)
        fields = [("data", pointer)] + [("slopes", pointer)] * (frontend.kind == DUALS)
        super().__init__(manager, frontend, fields + [(f"n{i}", types.intp) for i in range(frontend.ndim)])


def _shape(kind: Any, proxy: Any) -> list[Any]:
    return [getattr(proxy, f"n{i}") for i in range(kind.ndim)]


def _product(builder: Any, lengths: Any) -> Any:
    result = ir.Constant(_I64, 1)
    for n in lengths:
        result = n if getattr(result, "constant", None) == 1 else builder.mul(result, n)
    return result


def _onwards(builder: Any, kind: str, pointer: Any, entries: Any) -> Any:
    """The pointer advanced by a number of entries."""
    if kind == LANES:
        entries = builder.mul(entries, entries.type(WIDTH))
    return builder.gep(pointer, [entries], source_etype=_I64 if kind == INTS else _F64)


def _slopes_onwards(builder: Any, pointer: Any, entries: Any) -> Any:
    return builder.gep(pointer, [builder.mul(entries, entries.type(WIDTH))], source_etype=_F64)


def vector_at(builder: Any, pointer: Any) -> Any:
    """Eight entries at an address."""
    return builder.load(builder.bitcast(pointer, _VF.as_pointer()), align=8, typ=_VF)


def _store(builder: Any, kind: str, value: Any, data: Any, slopes: Any) -> None:
    if kind == LANES:
        builder.store(value, builder.bitcast(data, _VF.as_pointer()), align=8)
    elif kind == DUALS:
        builder.store(builder.extract_value(value, 0), data)
        builder.store(builder.extract_value(value, 1), builder.bitcast(slopes, _VF.as_pointer()), align=8)
    else:
        builder.store(value, data)


def _places(builder: Any, kind: Any, proxy: Any, at: list[Any]) -> list[tuple[Any, Any]]:
    """Pointers to the values of an entry, and to their derivatives."""
    shape = _shape(kind, proxy)
    flat = at[0] if at else ir.Constant(_I64, 0)
    if kind.outer:
        flat = builder.mul(flat, flat.type(kind.outer))
    for n, k in zip(shape[1:], at[1:], strict=True):
        flat = builder.add(builder.mul(flat, n), k)
    if kind.step > 1:
        flat = builder.mul(flat, flat.type(kind.step))
    rows = _product(builder, shape[1:] if kind.outer else shape)
    result = []
    for part in range(kind.parts):
        place = flat if part == 0 else builder.add(flat, builder.mul(rows, ir.Constant(_I64, part)))
        slopes = _slopes_onwards(builder, proxy.slopes, place) if kind.kind == DUALS else None
        result.append((_onwards(builder, kind.kind, proxy.data, place), slopes))
    return result


def _read(context: Any, builder: Any, kind: Any, proxy: Any, at: list[Any]) -> Any:
    values = [NUMBERS[kind.kind].load(context, builder, *place) for place in _places(builder, kind, proxy, at)]
    return join(context, builder, kind.entry, values) if kind.cls else values[0]


def _write(builder: Any, kind: Any, proxy: Any, at: list[Any], value: Any) -> None:
    values = split(builder, kind.entry, value) if kind.cls else [value]
    for x, place in zip(values, _places(builder, kind, proxy, at), strict=True):
        _store(builder, kind.kind, x, *place)


def _index(field: Any, index: Any) -> Any:
    if field.ndim == 1 and isinstance(index, types.Integer):
        return types.intp
    if field.ndim == 1 and index == int_lanes and field.kind == FLOATS:
        return index
    if field.ndim > 1 and isinstance(index, types.BaseTuple) and len(index) == field.ndim:
        if int_lanes in tuple(index):
            return PlacesType(int_lanes, field.ndim) if field.kind == FLOATS and field.cls is None else None
        return types.UniTuple(types.intp, field.ndim) if all(isinstance(i, types.Integer) for i in index) else None
    return None


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        field, index = args
        at = _index(field, index) if isinstance(field, FieldType) else None
        if at is None:
            return None
        entry = field.entry
        if at == int_lanes or isinstance(at, PlacesType):
            entry = GroupType(field.cls, lanes) if field.cls else lanes
        return signature(entry, field, at)


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        field, index, value = args
        at = _index(field, index) if isinstance(field, FieldType) else None
        if at is None or self.context.can_convert(value, field.entry) is None:
            return None
        return signature(types.none, field, at, field.entry)


def _at(builder: Any, kind: Any, index: Any) -> list[Any]:
    return cgutils.unpack_tuple(builder, index) if isinstance(kind, types.BaseTuple) else [index]


@lower_builtin(operator.getitem, FieldType, types.BaseTuple)
@lower_builtin(operator.getitem, FieldType, types.Integer)
def _get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    proxy = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    return _read(context, builder, sig.args[0], proxy, _at(builder, sig.args[1], args[1]))


@lower_builtin(operator.getitem, FieldType, type(int_lanes))
@lower_builtin(operator.getitem, FieldType, PlacesType)
def _look_up(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Gather eight entries."""
    kind = sig.args[0]
    proxy = cgutils.create_struct_proxy(kind)(context, builder, args[0])
    index = cgutils.unpack_tuple(builder, args[1]) if isinstance(sig.args[1], PlacesType) else [args[1]]
    at = builder.sext(index[0], _VL)
    for n, i in zip(_shape(kind, proxy)[1:], index[1:], strict=True):
        at = builder.add(builder.mul(at, splat(builder, n)), builder.sext(i, _VL))
    if kind.step > 1:
        at = builder.mul(at, ir.Constant(_VL, [kind.step] * WIDTH))
    parts = []
    for part in range(kind.parts):
        offset = builder.mul(proxy.n0, ir.Constant(_I64, part))
        row = builder.gep(proxy.data, [offset], source_etype=_F64)
        vector = ir.Constant(_VF, ir.Undefined)
        for k in range(WIDTH):
            place = builder.gep(row, [builder.extract_element(at, _I32(k))], source_etype=_F64)
            vector = builder.insert_element(vector, builder.load(place, typ=_F64), _I32(k))
        parts.append(vector)
    return join(context, builder, sig.return_type, parts) if kind.cls else parts[0]


@lower_builtin(operator.setitem, FieldType, types.BaseTuple, types.Any)
@lower_builtin(operator.setitem, FieldType, types.Integer, types.Any)
def _set(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    proxy = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    _write(builder, sig.args[0], proxy, _at(builder, sig.args[1], args[1]), args[2])
    return context.get_dummy_value()


# tables ---------------------------------------------------------------------------------------------


class PartsType(types.Type):
    """Tables within a table."""

    def __init__(self, table: Any, kind: str) -> None:
        self.table, self.kind, self.ndim = table, kind, 1
        super().__init__(name=f"Parts[{named(table)},{kind}]")

    @property
    def key(self) -> Any:
        """Identity of the type, as for tables."""
        return self.table, self.kind


register_model(PartsType)(_EntriesModel)  # its one length is that of an entry


def _field(kind: Any, name: str) -> Any:
    """Type of a field."""
    declared = kind.table.fields.get(name)
    if declared is None:
        return None
    if declared.table is not None:
        return PartsType(declared.table, kind.kind) if declared.shape else TableType(declared.table, kind.kind)
    step = len(kind.table) if kind.table.fields_last else 1
    ndim = len(declared.shape) + kind.ndim
    return FieldType(kind.kind, declared.kind, ndim, len(kind.table) * kind.table.outer, step)


def _array_type(kind: Any) -> Any:
    """Type of the whole array of a table, the field first."""
    return NUMBERS[kind.kind].array(kind.ndim + 1 - kind.table.outer)


def _length(kind: Any, name: str) -> int | None:
    """Axis with the length ``blades`` or ``nodes``."""
    axes = [f"{axis}s" for axis in kind.table.axes]
    return axes.index(name) if name in axes else None


@infer_getattr
class _TableAttributes(AttributeTemplate):
    key = TableType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        if _length(kind, name) is not None:
            return types.intp
        if name == "array":
            return _array_type(kind)
        field = _field(kind, name)
        return field.entry if isinstance(field, FieldType) and not field.ndim else field


def _lengths(builder: Any, field: Any, data: Any) -> list[Any]:
    """Lengths of a field's own axes in the table that begins at ``data``."""

    def held(name: str) -> Any:
        place = _onwards(builder, FLOATS, data, ir.Constant(_I64, field.owner.fields[name].row))
        return builder.fptosi(builder.load(place, typ=_F64), _I64)

    return [held(n) if isinstance(n, str) else ir.Constant(_I64, n) for n in field.shape]


def _first(builder: Any, field: Any, data: Any) -> Any:
    """First value of a field of a table without axes; after fields of variable length known only at run time."""
    if field.fixed:
        return ir.Constant(_I64, field.row)
    place = ir.Constant(_I64, len(field.owner))
    for other in field.owner.tail[: field.owner.tail.index(field)]:
        numbers = [*_lengths(builder, other, data), _step(builder, other, data)]
        place = builder.add(place, _product(builder, numbers))
    return place


def _step(builder: Any, field: Any, data: Any) -> Any:
    """Number of values of one entry of a field of a table without axes."""
    if field.table is None:
        return ir.Constant(_I64, 1)
    return _extent(builder, field.table, _onwards(builder, FLOATS, data, _first(builder, field, data)))


def _extent(builder: Any, table: Any, data: Any) -> Any:
    """Number of values of the table without axes that begins at ``data``."""
    if not table.tail:
        return ir.Constant(_I64, len(table))
    last = table.tail[-1]
    numbers = [*_lengths(builder, last, data), _step(builder, last, data)]
    return builder.add(_first(builder, last, data), _product(builder, numbers))


def _rows_of(context: Any, builder: Any, kind: Any, proxy: Any, name: str) -> tuple[Any, Any]:
    """Type and proxy of a field."""
    field, declared = _field(kind, name), kind.table.fields[name]
    result = cgutils.create_struct_proxy(field)(context, builder)
    shape = _shape(kind, proxy)
    inner = [] if kind.table.fields_last else shape[kind.table.outer :]
    before = _product(builder, [*inner, _first(builder, declared, proxy.data)])
    result.data = _onwards(builder, kind.kind, proxy.data, before)
    if kind.kind == DUALS:
        result.slopes = _slopes_onwards(builder, proxy.slopes, before)
    if isinstance(field, PartsType):
        shape = [_step(builder, declared, proxy.data)]
    elif isinstance(field, FieldType):
        shape = [*_lengths(builder, declared, proxy.data), *shape]
    for i, n in enumerate(shape):
        setattr(result, f"n{i}", n)
    return field, result


@infer_global(operator.getitem)
class _GetPart(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        parts, index = args
        if not (isinstance(parts, PartsType) and isinstance(index, types.Integer)):
            return None
        return signature(TableType(parts.table, parts.kind), parts, types.intp)


@lower_builtin(operator.getitem, PartsType, types.Integer)
def _part(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    proxy = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
    before = builder.mul(args[1], proxy.n0)
    result = cgutils.create_struct_proxy(sig.return_type)(context, builder)
    result.data = _onwards(builder, sig.args[0].kind, proxy.data, before)
    if sig.args[0].kind == DUALS:
        result.slopes = _slopes_onwards(builder, proxy.slopes, before)
    return result._getvalue()


# tables of the vectors of a controller: created in kernels from arrays, and passed to them from Python


@typeof_impl.register(TableClass)
def type_of_class(table: Any, context: Any) -> Any:
    """Type of the class of a table, which is a function."""
    return types.Function(_maker(table))


@cache
def _maker(table: Any) -> Any:
    """Implement the constructor of a table without axes from a vector in kernels."""

    class Rule(AbstractTemplate):
        key = _MAKE

        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != 1 or table.axes:
                return None
            (array,) = args
            if isinstance(array, TableType) and array.table is table:
                return signature(array, array)
            if isinstance(array, types.Array) and (array.ndim, array.layout, array.dtype) == (1, "C", types.float64):
                return signature(TableType(table, FLOATS), array)
            return signature(TableType(table, DUALS), array) if array == NUMBERS[DUALS].array(1) else None

    return Rule


def _MAKE() -> None:
    """Represents the class of a table in calls from kernels."""


@lower_builtin(_MAKE, types.Array)
def make_table(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Code of the constructor of a table from a vector."""
    result = cgutils.create_struct_proxy(sig.return_type)(context, builder)
    if sig.return_type.kind == DUALS:
        vector = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
        result.data, result.slopes = vector.values, vector.slopes
    else:
        result.data = context.make_array(sig.args[0])(context, builder, args[0]).data
    return result._getvalue()


@lower_builtin(_MAKE, TableType)
def _make_again(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return args[0]


@overload(operator.getitem, strict=False)
def _read_place(table: Any, place: Any) -> Any:
    """Entries of a vector by index, as of the array."""
    return (lambda table, place: table.array[place]) if isinstance(table, TableType) else None


@overload(operator.setitem, strict=False)
def _write_place(table: Any, place: Any, value: Any) -> Any:
    if not isinstance(table, TableType):
        return None

    def write(table: Any, place: Any, value: Any) -> None:
        table.array[place] = value

    return write


@overload(len, strict=False)
def _length_of(table: Any) -> Any:
    return (lambda table: table.array.shape[0]) if isinstance(table, TableType) else None


def _numpy_array(context: Any, builder: Any, kind: Any, data: Any, shape: Any) -> Any:
    """A NumPy array that does not own its memory."""
    array = context.make_array(kind)(context, builder)
    size = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    strides: list[Any] = []
    stride = ir.Constant(_I64, size)
    for n in reversed(shape):
        strides.insert(0, stride)
        stride = builder.mul(stride, n)
    array.data, array.itemsize = builder.bitcast(data, array.data.type), ir.Constant(_I64, size)
    array.nitems = _product(builder, shape)
    array.shape, array.strides = cgutils.pack_array(builder, shape), cgutils.pack_array(builder, strides)
    array.meminfo = ir.Constant(array.meminfo.type, None)
    array.parent = ir.Constant(array.parent.type, None)
    return array._getvalue()


def _array(context: Any, builder: Any, kind: Any, data: Any, slopes: Any, shape: Any) -> Any:
    """An array of the given type: NumPy, lanes or duals."""
    if isinstance(kind, types.Array):
        return _numpy_array(context, builder, kind, data, shape)
    proxy = cgutils.create_struct_proxy(kind)(context, builder)
    proxy.shape = context.make_tuple(builder, types.UniTuple(types.intp, kind.ndim), shape)
    if isinstance(kind, LaneArrayType):
        proxy.data = data
    else:
        proxy.values, proxy.slopes = data, slopes
    return proxy._getvalue()


@typeof_impl.register(Table)
def _typeof_table(value: Any, context: Any) -> Any:
    if not value.array.flags.c_contiguous:
        raise TypeError(f"kernels accept a {type(value).__name__} of a contiguous array only")
    return TableType(type(value), INTS if type(value).integer else FLOATS)


@unbox(TableType)
def _unbox_table(kind: Any, value: Any, c: Any) -> Any:
    """A table passed by the host: plain numbers in a contiguous array."""
    if kind.kind not in (FLOATS, INTS):
        return unbox_unsupported(kind, value, c)
    array_type, array = _array_type(kind), c.pyapi.object_getattr_string(value, "array")
    unboxed = c.unbox(array_type, array)
    native = c.context.make_array(array_type)(c.context, c.builder, unboxed.value)
    proxy = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    proxy.data = native.data
    shape = cgutils.unpack_tuple(c.builder, native.shape)
    if kind.table.outer:
        shape[0] = c.builder.sdiv(shape[0], ir.Constant(_I64, len(kind.table)))
    for i, n in enumerate(shape[1 - kind.table.outer :]):
        setattr(proxy, f"n{i}", n)
    c.pyapi.decref(array)  # the table keeps it alive
    return NativeValue(proxy._getvalue(), is_error=unboxed.is_error)


@lower_getattr_generic(TableType)
def _table_get(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    proxy = cgutils.create_struct_proxy(kind)(context, builder, value)
    axis = _length(kind, name)
    if axis is not None:
        return getattr(proxy, f"n{axis}")
    if name == "array":
        n, lengths = _extent(builder, kind.table, proxy.data), _shape(kind, proxy)
        shape = [builder.mul(lengths[0], n), *lengths[1:]] if kind.table.outer else [n, *lengths]
        if kind.table.fields_last:
            shape = [*lengths, n]
        slopes = proxy.slopes if kind.kind == DUALS else None
        return _array(context, builder, _array_type(kind), proxy.data, slopes, shape)
    field, rows = _rows_of(context, builder, kind, proxy, name)
    entry = isinstance(field, FieldType) and not field.ndim
    return _read(context, builder, field, rows, []) if entry else rows._getvalue()


@lower_setattr_generic(TableType)
def _table_set(context: Any, builder: Any, sig: Any, args: Any, name: str) -> Any:
    kind, entry = sig.args
    proxy = cgutils.create_struct_proxy(kind)(context, builder, args[0])
    field, rows = _rows_of(context, builder, kind, proxy, name)
    _write(builder, field, rows, [], context.cast(builder, args[1], entry, field.entry))


# records --------------------------------------------------------------------------------------------


class RecordType(types.Type):
    """A group of tables and arrays."""

    def __init__(self, cls: Any, kind: str) -> None:
        self.cls, self.kind = cls, kind
        super().__init__(name=f"{named(cls)}[{kind}]")

    @property
    def key(self) -> Any:
        """Identity of the type: two modules may use the same name."""
        return self.cls, self.kind

    def can_convert_to(self, context: Any, other: Any) -> Any:
        """A record begins with the members of its class's first base."""
        begins = isinstance(other, RecordType) and other.kind == self.kind and other.cls in leading(self.cls)
        return Conversion.safe if begins else None


@lower_cast(RecordType, RecordType)
def _as_base(context: Any, builder: Any, kind: Any, other: Any, value: Any) -> Any:
    return value


def _type_of(record: Any, member: RecordMember) -> Any:
    """Type of a member."""
    kind = record.kind
    if (kind == LANES and not member.in_lanes) or (kind == DUALS and member.constant):
        kind = FLOATS
    if member.table is not None:
        return TableType(member.table, INTS if member.table.integer else kind)
    if kind in (LANES, DUALS):
        return NUMBERS[kind].array(member.ndim)
    return types.Array(numba.from_dtype(np.dtype(member.dtype)), member.ndim, "C")


def _begin(record: Any, wanted: str) -> int:
    """Index of a member's first word."""
    at = 0
    for name, member in members(record.cls).items():
        if name == wanted:
            return at
        at += 2 + member.ndim
    raise KeyError(wanted)


@register_model(RecordType)
class _RecordModel(models.PrimitiveModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        super().__init__(manager, frontend, _I64.as_pointer())


@infer_getattr
class _RecordAttributes(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, record: Any, name: str) -> Any:
        member = members(record.cls).get(name)
        return None if member is None else _type_of(record, member)


@lower_getattr_generic(RecordType)
def _record_get(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    def word(i: int) -> Any:
        load = builder.load(builder.gep(value, [_I32(first + i)], source_etype=_I64), typ=_I64)
        load.set_metadata("invariant.load", builder.module.add_metadata([]))
        return load

    member, first = members(kind.cls)[name], _begin(kind, name)
    member_type = _type_of(kind, member)
    entry = _I64 if getattr(member_type, "kind", "") == INTS else _F64
    data, slopes = (builder.inttoptr(word(i), entry.as_pointer()) for i in range(2))
    shape = [word(2 + i) for i in range(member.ndim)]
    if member.table is None:
        return _array(context, builder, member_type, data, slopes, shape)
    proxy = cgutils.create_struct_proxy(member_type)(context, builder)
    proxy.data = data
    if member_type.kind == DUALS:
        proxy.slopes = slopes
    for i, n in enumerate(shape):
        setattr(proxy, f"n{i}", n)
    return proxy._getvalue()


@typeof_impl.register(KernelRecord)
def _typeof(value: Any, context: Any) -> Any:
    NUMBERS[value.kind]  # its rules are known before anything is compiled for it
    return RecordType(type(value), value.kind)


@cache
def record_at(cls: type[KernelRecord]) -> Any:
    """Function for kernels, ``(words, i, first)``: the record of floats whose words begin at ``words[i, first]``."""

    def record(words: Any, i: int, first: int) -> Any:
        instance: Any = object.__new__(cls)
        instance.kind, instance.address = FLOATS, words.ctypes.data + (i * words.shape[1] + first) * words.itemsize
        return instance

    class Rule(AbstractTemplate):
        key = record

        def generic(self, args: Any, kws: Any) -> Any:
            return signature(RecordType(cls, FLOATS), args[0], types.intp, types.intp)

    infer_global(record, types.Function(Rule))

    @lower_builtin(record, types.Array, types.Integer, types.Integer)
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        array = context.make_array(sig.args[0])(context, builder, args[0])
        return cgutils.get_item_pointer(context, builder, sig.args[0], array, args[1:])

    return record


@unbox(RecordType)
def _unbox(kind: Any, value: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(value, "address")
    address = c.builder.inttoptr(c.pyapi.long_as_longlong(number), _I64.as_pointer())
    c.pyapi.decref(number)
    return NativeValue(address)
