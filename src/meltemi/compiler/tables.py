"""Declarative tables: the single description of every array of the kernels.

    class BladeMotion(Table, axes="blade node"):
        position: Vectors = xyz("m", "node from the rotor apex, blade axes")

A table lists fields (name, unit, meaning) that share one shape. It defines the rows of the fields in the array, the
host-side views, the channel catalogue, parameters by name, and the reference pages of the docs. The layout of an array
is not written down anywhere else. An array of a table is contiguous ``float64`` with the field first: ``array[row]``,
``array[row, blade]`` or ``array[row, blade, node]``. Tables of which all fields are read together, such as a polar,
have the fields last.

On an instance a field is an array of entries, ``motion.position[b, n]``, or without axes a number, vector or matrix;
``motion.blades`` and ``motion.nodes`` are the lengths of its axes.

Tables without axes nest: ``part`` is a table within a table, ``parts`` are several, ``series`` are numbers whose count
is the value of another field. All are in one vector, so that laws contain others by name, ``x.loops[i].tilt``.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, TypeVar

from meltemi.compiler.algebra import Phasor, Rot, Sym, Vec

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_BLADES, MAX_FLAPS, MAX_LINES = 3, 4, 24
Index = int | tuple[int, ...]
T = TypeVar("T")


class Entries(Protocol[T]):
    """Entries of a field by blade and node, or along the axes of its table."""

    def __getitem__(self, index: Index, /) -> T: ...
    def __setitem__(self, index: Index, value: T, /) -> None: ...


Numbers = Entries[float]
Vectors = Entries[Vec]
Rotations = Entries[Rot]
Symmetrics = Entries[Sym]


class Field:
    """Declaration of a field of a table; on an instance, its entries in the array.

    Attributes:
      unit: unit of its numbers.
      doc: meaning.
      kind: ``Vec``, ``Rot`` or ``Sym``; None for plain numbers.
      parts: suffixes of the names of its rows; empty for one row.
      shape: lengths of its own axes, which precede those of the table; a name refers to the field with the length.
      table: table of its entries, in place of numbers.
      prefix: prefix of the names of the entries of ``table``.
      count: number of rows of a field of fixed length.
      row: first row; undefined for a field of variable length.
    """

    def __init__(
        self,
        unit: str,
        doc: str,
        kind: Any = None,
        parts: tuple[str, ...] = (),
        shape: tuple[int | str, ...] = (),
        table: type[Table] | None = None,
        prefix: str | None = None,
    ) -> None:
        self.unit, self.doc, self.kind = unit, doc, kind
        self.parts = kind.__slots__ if kind else parts
        self.shape, self.table, self.prefix = shape, table, prefix
        self.row = -1
        self.fixed = not any(isinstance(n, str) for n in shape) and not (table and table.tail)
        self.count = 0
        if self.fixed:
            numbers = len(table) if table else len(kind.__slots__) if kind else 1
            self.count = math.prod(int(n) for n in shape) * numbers

    def __set_name__(self, owner: Any, name: str) -> None:
        self.owner, self.name = owner, name

    def __len__(self) -> int:
        """Number of rows of a field of fixed length."""
        return self.count

    def lengths(self, array: Any) -> tuple[int, ...]:
        """Lengths of its own axes in an array of the table."""
        return tuple(int(array[self.owner.fields[n].row]) if isinstance(n, str) else n for n in self.shape)

    def first(self, array: Any) -> int:
        """Index of the field's first number in an array of the table."""
        if self.fixed:
            return self.row
        place = len(self.owner)
        for field in self.owner.tail:
            if field is self:
                break
            place += field.extent(array)
        return place

    def step(self, array: Any) -> int:
        """Number of values of one entry."""
        return self.table.extent(array[self.first(array) :]) if self.table else 1

    def extent(self, array: Any) -> int:
        """Number of values of all entries."""
        count = math.prod(self.lengths(array))
        return len(self) if self.fixed else count and count * self.step(array)

    def names(self, array: Any = None) -> list[str]:
        """Names of its rows; for a field of variable length they need an array of the table."""
        ends = [""]
        for n in () if self.parts else self.lengths(array):
            ends = [f"{end}_{i}" for end in ends for i in range(1, n + 1)]
        if self.table is None:
            return [f"{self.name}_{part}" for part in self.parts] or [f"{self.name}{end}" for end in ends]
        prefix = self.name if self.prefix is None else self.prefix
        begins = self.parts or [f"{prefix}{end}" for end in ends]
        inner = self.table.names_of(None if self.fixed else array[self.first(array) :]) if begins else ()
        return [f"{begin}_{name}" if begin else name for begin in begins for name in inner]

    def rows(self) -> list[TableRow]:
        """Rows of a field of fixed length."""
        inner = self.table.rows if self.table else (TableRow(self.name, self.unit, self.doc),)
        pairs = zip(self.names(), itertools.cycle(inner), strict=False)
        return [TableRow(name, row.unit, row.doc) for name, row in pairs]

    def __get__(self, table: Table | None, owner: Any) -> Any:
        if table is None:
            return self
        if self.table is not None:
            return _Parts(table, self) if self.shape else _Parts(table, self)[0]
        if not table.axes and self.kind is None and self.fixed:  # as controllers in Python read them
            if not self.shape:
                return table.array[self.row]
            return table.array[self.row : self.row + self.count].reshape(self.shape)
        if table.axes or self.shape:
            return _Rows(table, self)
        return self.kind(*table.array[self.row : self.row + self.count])

    def __set__(self, table: Table, value: Any) -> None:
        try:
            if not self.fixed or self.table:
                first = self.first(table.array)
                table.array[first : first + self.extent(table.array)] = numbers_of(value)
            elif self.kind is None and not self.shape:
                table.array[self.row] = value
            else:
                table.array[self.row : self.row + self.count] = [*value] if self.kind else value
        except (TypeError, ValueError):  # of a controller in Python, most often
            many = "a number" if not self.shape and self.kind is None else f"{self.extent(table.array)} numbers"
            from meltemi.core.errors import InputError

            raise InputError(f"{self.name}: expected {many}, found {value!r:.60}") from None


class _Parts:
    """Tables within a table."""

    def __init__(self, table: Table, field: Field) -> None:
        self.array, self.table = table.array, field.table
        self.first, self.step = field.first(table.array), field.step(table.array)

    def __getitem__(self, index: int) -> Any:
        first = self.first + self.step * index
        assert self.table is not None
        return self.table(self.array[first : first + self.step])


class _Rows:
    """Entries of one field in a table's array."""

    def __init__(self, table: Table, field: Field) -> None:
        self.array, self.field, self.last = table.array, field, table.fields_last
        self.outer = len(type(table)) if table.outer else 0
        self.lengths, self.first = field.lengths(table.array), field.first(table.array)

    def __getitem__(self, index: Index) -> Any:
        return self._entry(index) if self.field.kind is None else self.field.kind(*self._rows(index))

    def __setitem__(self, index: Index, value: Any) -> None:
        if self.field.kind is None:
            self.array[self._place(index)] = value
        else:
            self._rows(index)[:] = [*value]

    def _rows(self, index: Index) -> Any:
        at = index if isinstance(index, tuple) else (index,)
        first = self.first
        if self.outer:
            first, at = first + self.outer * at[0], at[1:]
        return self.array[(slice(first, first + len(self.field)), *at)]

    def _place(self, index: Index) -> tuple[int, ...]:
        at = index if isinstance(index, tuple) else (index,)
        if self.last:
            return (*at, self.first)
        if self.outer:
            return (self.first + self.outer * at[0], *at[1:])
        leading, others = at[: len(self.lengths)], at[len(self.lengths) :]
        place = 0
        for i, n in zip(leading, self.lengths, strict=True):
            place = place * n + i
        return (self.first + place, *others)

    def _entry(self, index: Index) -> Any:
        return self.array[self._place(index)]


def numbers_of(value: Any) -> Any:
    """The values of a table, of several tables, or of an array, as one vector."""
    import numpy as np

    if isinstance(value, Table):
        return value.array
    if isinstance(value, (list, tuple)) and any(isinstance(each, Table) for each in value):
        return np.concatenate([each.array for each in value])
    return np.ravel(value)


def number(unit: str, doc: str) -> Any:
    """A field of one number."""
    return Field(unit, doc)


def xyz(unit: str, doc: str) -> Any:
    """A field of vectors."""
    return Field(unit, doc, Vec)


def dq(unit: str, doc: str) -> Any:
    """A field of phasors, with rows d and q."""
    return Field(unit, doc, Phasor)


def rotation(unit: str, doc: str) -> Any:
    """A field of rotation matrices, row by row."""
    return Field(unit, doc, Rot)


def symmetric(unit: str, doc: str) -> Any:
    """A field of symmetric matrices."""
    return Field(unit, doc, Sym)


def blades(unit: str, doc: str) -> Any:
    """A field of one number per blade: ``demands.pitch[b]``."""
    return Field(unit, doc, parts=tuple(f"{b + 1}" for b in range(MAX_BLADES)), shape=(MAX_BLADES,))


def flaps(unit: str, doc: str) -> Any:
    """A field of one number for each of up to four flaps per blade: ``demands.flap[flap, b]``."""
    parts = tuple(f"{flap + 1}_{b + 1}" for flap in range(MAX_FLAPS) for b in range(MAX_BLADES))
    return Field(unit, doc, parts=parts, shape=(MAX_FLAPS, MAX_BLADES))


def numbers(unit: str, doc: str, names: Iterable[str]) -> Any:
    """A field of several named numbers: ``x.limit[i]``."""
    return Field(unit, doc, parts=tuple(names), shape=(len(tuple(names)),))


def series(unit: str, doc: str, *lengths: str) -> Any:
    """A field of variable length: ``x.wind[i]``; ``lengths`` are the names of the fields with the lengths of its axes.

    Fields of variable length follow the others.
    """
    return Field(unit, doc, shape=lengths)


def part(table: type[T], doc: str = "", *, prefix: str | None = None) -> Any:
    """Another table within a table without axes: ``x.filter.speed``.

    Args:
      prefix: prefix of the names of its rows; by default the name of the field.
    """
    return Field("", doc, table=table, prefix=prefix)  # type: ignore[arg-type]


def parts(table: type[T], count: int | str | tuple[str, ...], doc: str = "", *, prefix: str | None = None) -> Any:
    """Several tables of one class and size: ``x.loops[i].speed``.

    Args:
      count: their number, or the prefixes of the row names of each; or the name of the field that holds their number:
        then the field follows those of fixed length.
      prefix: prefix of the names of its rows, before the number of the part; by default the name of the field.
    """
    if isinstance(count, tuple):
        return Field("", doc, parts=count, shape=(len(count),), table=table)  # type: ignore[arg-type]
    return Field("", doc, shape=(count,), table=table, prefix=prefix)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class TableRow:
    """One row of a table's array."""

    name: str
    unit: str
    doc: str


class TableClass(type):
    """Metaclass of tables; the length of a table is the number of its rows."""

    rows: tuple[TableRow, ...]

    def __len__(cls) -> int:
        return len(cls.rows)


class Table(metaclass=TableClass):
    """Fields that share a shape.

    Attributes:
      title: subject of the rows, e.g. ``"blade motion"``.
      axes: names of the axes after the field axis, from ``blade``, ``node``, ``mode``.
      fields: declared fields, by name.
      rows: rows of the array in order; of a vector or matrix one for each component.
      names: names of the rows.
      tail: fields of variable length, which follow the others.
      integer: whether the numbers are integers.
      outer: 1 if the first axis precedes the fields: ``array[len(table) * mode + row, blade, node]``.
      fields_last: whether the fields, which must be numbers, are the last axis: ``array[polar, angle, row]``.
    """

    title: ClassVar[str]
    axes: ClassVar[tuple[str, ...]]
    fields: ClassVar[dict[str, Field]]
    rows: ClassVar[tuple[TableRow, ...]]
    names: ClassVar[tuple[str, ...]]
    tail: ClassVar[tuple[Field, ...]] = ()
    integer: ClassVar[bool]
    outer: ClassVar[int]
    fields_last: ClassVar[bool]

    def __init_subclass__(
        cls, axes: str = "", title: str = "", integer: bool = False, outer: int = 0, fields_last: bool = False
    ) -> None:
        cls.title = title or re.sub(r"(?<=.)([A-Z])", r" \1", cls.__name__).lower()
        cls.axes, cls.integer, cls.outer, cls.fields_last = tuple(axes.split()), integer, outer, fields_last
        cls.fields = {name: field for name, field in vars(cls).items() if isinstance(field, Field)}
        rows: list[TableRow] = []
        for field in cls.fields.values():
            field.row = len(rows)
            if field.fixed:
                rows += field.rows()
        cls.tail = tuple(field for field in cls.fields.values() if not field.fixed)
        if [*cls.fields.values()][len(cls.fields) - len(cls.tail) :] != [*cls.tail]:
            raise ValueError(f"table {cls.title!r}: fields of fixed length must precede those of variable length")
        cls.rows, cls.names = tuple(rows), tuple(row.name for row in rows)
        if len(set(cls.names)) != len(rows) or any(hasattr(Table, name) or name == "array" for name in cls.fields):
            raise ValueError(f"table {cls.title!r}: a field name occurs twice or is an attribute of tables")
        if fields_last and (outer or any(len(field) > 1 for field in cls.fields.values())):
            raise ValueError(f"table {cls.title!r}: with fields_last only fields of one number are allowed")

    array: Any
    blades: int
    nodes: int
    modes: int
    ages: int
    edges: int
    sources: int
    flaps: int
    parts: int
    stations: int
    pairs: int
    coordinates: int
    polars: int
    angles: int

    def __init__(self, array: Any) -> None:
        self.array = array.array if isinstance(array, Table) else array
        for axis, n in zip(self.axes, self.lengths(self.array), strict=True):
            setattr(self, f"{axis}s", n)

    def __getitem__(self, place: Any) -> Any:
        return self.array[place]

    def __setitem__(self, place: Any, value: Any) -> None:
        self.array[place] = value

    def __len__(self) -> int:
        return len(self.array)

    def copy(self) -> Self:
        """The table with a copy of the array."""
        return type(self)(self.array.copy())

    def __array__(self, *args: Any, **kwargs: Any) -> Any:
        return self.array.__array__(*args, **kwargs)

    @classmethod
    def of(cls, **values: Any) -> Self:
        """A new table without axes: numbers by name, arrays for series, tables for parts; otherwise zero.

        Lengths follow from the arguments.
        """
        import numpy as np

        new = cls(np.zeros(len(cls)))
        behind = []
        for name in values:
            cls.index(name)
        for field in cls.tail:
            given = values.pop(field.name, None)
            if given is not None:
                lengths = np.shape(given) if field.table is None else (len(given),) if field.shape else ()
                for n, length in zip(field.shape, lengths, strict=True):
                    if isinstance(n, str):
                        setattr(new, n, length)
            behind.append((field, given))
        for name, value in values.items():
            setattr(new, name, value)
        arrays = [new.array]
        for field, given in behind:
            if given is None:
                count = math.prod(field.lengths(new.array))
                given = np.zeros(count) if field.table is None else [field.table.of() for _ in range(count)]
            arrays.append(numbers_of(given))
        return cls(np.concatenate(arrays))

    @classmethod
    def extent(cls, array: Any) -> int:
        """Number of values of the table at the beginning of an array, including the fields of variable length."""
        return len(cls) + sum(field.extent(array) for field in cls.tail)

    @classmethod
    def names_of(cls, array: Any) -> tuple[str, ...]:
        """Names of all values of the table at the beginning of an array."""
        return (*cls.names, *(name for field in cls.tail for name in field.names(array)))

    @classmethod
    def lengths(cls, array: Any) -> tuple[int, ...]:
        """Lengths of the axes of an array of this table."""
        if cls.fields_last:
            lengths: tuple[int, ...] = array.shape[:-1]
            return lengths
        return (array.shape[0] // len(cls), *array.shape[1:]) if cls.outer else array.shape[1:]

    @classmethod
    def index(cls, name: str) -> int:
        """Row of the named field, the first one of a vector or matrix; InputError with the closest names if unknown."""
        if name in cls.fields:
            return cls.fields[name].row
        if name in cls.names:
            return cls.names.index(name)
        from meltemi.core.errors import InputError, did_you_mean

        raise InputError(f"{cls.title} has no {name!r}: {did_you_mean(name, cls.names)}")

    @classmethod
    def slots(cls, names: str) -> tuple[int, ...]:
        """Rows of several fields, for unpacking into index constants."""
        return tuple(cls.index(name) for name in names.split())

    @classmethod
    def shape(cls, **sizes: int) -> tuple[int, ...]:
        """Shape of this table's array; ``sizes`` are the lengths of its axes."""
        lengths = [sizes[axis] for axis in cls.axes]
        if cls.fields_last:
            return (*lengths, len(cls))
        return (len(cls) * lengths[0], *lengths[1:]) if cls.outer else (len(cls), *lengths)

    @classmethod
    def zeros(cls, **sizes: int) -> NDArray[np.float64]:
        """A new array of this table."""
        import numpy as np

        return np.zeros(cls.shape(**sizes))


class View:
    """Host-side view of a table's array: ``view["chord"]`` is the row (or rows), for reading and writing."""

    __slots__ = ("array", "table")

    def __init__(self, table: type[Table], array: NDArray[np.float64]) -> None:
        self.table = table
        self.array = array

    def rows(self, name: str) -> int | slice:
        """Indices of a field's rows in the array."""
        row = self.table.index(name)
        field = self.table.fields.get(name)
        return slice(row, row + len(field)) if field and field.parts else row

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        row: NDArray[np.float64] = self.array[self.rows(name)]
        return row

    def __setitem__(self, name: str, value: Any) -> None:
        self.array[self.rows(name)] = value

    def keys(self) -> tuple[str, ...]:
        """Names of all rows, as ``dict(view)`` needs them."""
        return self.table.names

    def __repr__(self) -> str:
        return f"<{self.table.title}: {', '.join(self.table.names)}>"
