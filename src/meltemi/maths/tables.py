"""Declarative tables: the one description of every array the kernels use.

    class BladeMotion(Table, axes="blade node"):
        position: Vectors = xyz("m", "node from the rotor apex, blade axes")

A table lists fields (name, unit, meaning) that share one shape. From it come the places of the fields in the array, the
host-side views, the channel catalogue, perturbation by name, and the reference pages of the docs. Nowhere else is the
layout of an array written down. An array of a table is contiguous ``float64`` with the field first: ``array[row]``,
``array[row, blade]`` or ``array[row, blade, node]``. What is looked up as a whole at one place, such as a polar, has
the fields last.

On an instance a field is its entries, ``motion.position[b, n]``, or without axes a number, vector or matrix;
``motion.blades`` and ``motion.nodes`` are the lengths of its axes.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from meltemi.core.errors import InputError, did_you_mean
from meltemi.maths.algebra import Phasor, Rot, Sym, Vec

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_BLADES, MAX_FLAPS = 3, 4
Index = int | tuple[int, ...]
T = TypeVar("T")


class Entries(Protocol[T]):
    """Entries of a field by blade and node, or along whatever axes its table has."""

    def __getitem__(self, index: Index, /) -> T: ...
    def __setitem__(self, index: Index, value: T, /) -> None: ...


Numbers = Entries[float]
Vectors = Entries[Vec]
Rotations = Entries[Rot]
Symmetrics = Entries[Sym]


class Field:
    """Declaration of a field of a table; on an instance, what the array holds.

    Attributes:
      unit: of its numbers.
      doc: meaning.
      kind: ``Vec``, ``Rot``, ``Sym`` or ``Phasor``; None for plain numbers.
      parts: ends of the names of its rows; empty for one row.
      lengths: of the axes of a field of plain numbers before those of its table: blades, flaps and blades.
      row: the first one.
    """

    def __init__(
        self, unit: str, doc: str, kind: Any = None, parts: tuple[str, ...] = (), lengths: tuple[int, ...] = ()
    ) -> None:
        self.unit, self.doc, self.kind = unit, doc, kind
        self.parts = kind.__slots__ if kind else parts
        self.lengths = lengths
        self.row = -1

    def __len__(self) -> int:
        return max(len(self.parts), 1)

    def __get__(self, table: Table | None, owner: Any) -> Any:
        if table is None:
            return self
        if table.axes or (self.parts and not self.kind):
            return _Rows(table, self)
        rows = table.array[self.row : self.row + len(self)]
        return self.kind(*rows) if self.kind else rows[0]

    def __set__(self, table: Table, value: Any) -> None:
        table.array[self.row : self.row + len(self)] = [*value] if self.kind else value


class _Rows:
    """Entries of one field in a table's array."""

    def __init__(self, table: Table, field: Field) -> None:
        self.array, self.field, self.last = table.array, field, table.fields_last
        self.outer = len(type(table)) if table.outer else 0

    def __getitem__(self, index: Index) -> Any:
        return self._entry(index) if self.field.kind is None else self.field.kind(*self._rows(index))

    def __setitem__(self, index: Index, value: Any) -> None:
        if self.field.kind is None:
            self.array[self._place(index)] = value
        else:
            self._rows(index)[:] = [*value]

    def _rows(self, index: Index) -> Any:
        at = index if isinstance(index, tuple) else (index,)
        first = self.field.row
        if self.outer:
            first, at = first + self.outer * at[0], at[1:]
        return self.array[(slice(first, first + len(self.field)), *at)]

    def _place(self, index: Index) -> tuple[int, ...]:
        at = index if isinstance(index, tuple) else (index,)
        if self.last:
            return (*at, self.field.row)
        if self.outer:
            return (self.field.row + self.outer * at[0], *at[1:])
        part = 0
        for length in self.field.lengths:
            part, at = length * part + at[0], at[1:]
        return (self.field.row + part, *at)

    def _entry(self, index: Index) -> Any:
        return self.array[self._place(index)]


def number(unit: str, doc: str) -> Any:
    """A field of one number."""
    return Field(unit, doc)


def xyz(unit: str, doc: str) -> Any:
    """A field of vectors."""
    return Field(unit, doc, Vec)


def rotation(unit: str, doc: str) -> Any:
    """A field of rotation matrices, row by row."""
    return Field(unit, doc, Rot)


def symmetric(unit: str, doc: str) -> Any:
    """A field of symmetric matrices."""
    return Field(unit, doc, Sym)


def dq(unit: str, doc: str) -> Any:
    """A field of phasors."""
    return Field(unit, doc, Phasor)


def blades(unit: str, doc: str) -> Any:
    """A field of one number a blade: ``demands.pitch[b]``."""
    return each(tuple(f"{b + 1}" for b in range(MAX_BLADES)), unit, doc)


def flaps(unit: str, doc: str) -> Any:
    """A field of one number for each of up to four flaps of each blade: ``demands.flap[flap, b]``."""
    parts = tuple(f"{flap + 1}_{b + 1}" for flap in range(MAX_FLAPS) for b in range(MAX_BLADES))
    return Field(unit, doc, parts=parts, lengths=(MAX_FLAPS, MAX_BLADES))


def each(names: tuple[str, ...], unit: str, doc: str) -> Any:
    """A field of one number for each of some names."""
    return Field(unit, doc, parts=names, lengths=(len(names),))


@dataclass(frozen=True, slots=True)
class Row:
    """One row of a table's array."""

    name: str
    unit: str
    doc: str


class TableType(type):
    """Class of tables, whose length is the number of their rows."""

    rows: tuple[Row, ...]

    def __len__(cls) -> int:
        return len(cls.rows)


class Table(metaclass=TableType):
    """Fields that share a shape.

    Attributes:
      title: what the rows describe, e.g. ``"blade motion"``.
      axes: names of the axes after the field axis, from ``blade``, ``node``, ``mode``.
      fields: as declared, by name.
      rows: of the array, in its order; of a vector or matrix one for each component.
      names: of the rows.
      integer: its numbers are whole.
      outer: 1 if the first axis stands before the fields: ``array[len(table) * mode + row, blade, node]``.
      fields_last: the fields, numbers all of them, stand last: ``array[polar, angle, row]``.
    """

    title: ClassVar[str]
    axes: ClassVar[tuple[str, ...]]
    fields: ClassVar[dict[str, Field]]
    rows: ClassVar[tuple[Row, ...]]
    names: ClassVar[tuple[str, ...]]
    integer: ClassVar[bool]
    outer: ClassVar[int]
    fields_last: ClassVar[bool]

    def __init_subclass__(
        cls, axes: str = "", title: str = "", integer: bool = False, outer: int = 0, fields_last: bool = False
    ) -> None:
        cls.title = title or re.sub(r"(?<=.)([A-Z])", r" \1", cls.__name__).lower()
        cls.axes, cls.integer, cls.outer, cls.fields_last = tuple(axes.split()), integer, outer, fields_last
        cls.fields = {name: field for name, field in vars(cls).items() if isinstance(field, Field)}
        rows: list[Row] = []
        for name, field in cls.fields.items():
            field.row = len(rows)
            names = [f"{name}_{part}" for part in field.parts] or [name]
            rows += [Row(each, field.unit, field.doc) for each in names]
        cls.rows, cls.names = tuple(rows), tuple(row.name for row in rows)
        if len(set(cls.names)) != len(rows) or any(hasattr(Table, name) or name == "array" for name in cls.fields):
            raise ValueError(f"table {cls.title!r} has a field twice, or one with a name of its own attributes")
        if fields_last and (outer or any(len(field) > 1 for field in cls.fields.values())):
            raise ValueError(f"table {cls.title!r}: only numbers can stand last")

    blades: int
    nodes: int
    modes: int
    flaps: int
    parts: int
    stations: int
    pairs: int
    coordinates: int
    polars: int
    angles: int

    def __init__(self, array: Any) -> None:
        self.array = array
        for axis, n in zip(self.axes, self.lengths(array), strict=True):
            setattr(self, f"{axis}s", n)

    @classmethod
    def lengths(cls, array: Any) -> tuple[int, ...]:
        """Lengths of the axes of an array of this table."""
        if cls.fields_last:
            lengths: tuple[int, ...] = array.shape[:-1]
            return lengths
        return (array.shape[0] // len(cls), *array.shape[1:]) if cls.outer else array.shape[1:]

    @classmethod
    def index(cls, name: str) -> int:
        """Row of the named field, the first one of a vector or matrix; unknown names get the closest ones."""
        if name in cls.fields:
            return cls.fields[name].row
        if name in cls.names:
            return cls.names.index(name)
        raise InputError(f"{cls.title} has no {name!r}: {did_you_mean(name, cls.names)}")

    @classmethod
    def slots(cls, names: str) -> tuple[int, ...]:
        """Rows of several fields, for unpacking into the constants that kernels index with."""
        return tuple(cls.index(name) for name in names.split())

    @classmethod
    def shape(cls, **sizes: int) -> tuple[int, ...]:
        """Shape of this table's array; ``sizes`` gives the length of every axis."""
        lengths = [sizes[axis] for axis in cls.axes]
        if cls.fields_last:
            return (*lengths, len(cls))
        return (len(cls) * lengths[0], *lengths[1:]) if cls.outer else (len(cls), *lengths)

    @classmethod
    def zeros(cls, **sizes: int) -> NDArray[np.float64]:
        """A new array of this table."""
        import numpy as np

        return np.zeros(cls.shape(**sizes))


_MAKERS = {"": number, "xyz": xyz, "rotation": rotation, "symmetric": symmetric, "blades": blades, "flaps": flaps}


def table(name: str, axes: str, text: str) -> type[Table]:
    """A table from lines ``name | unit | meaning`` or ``name kind | unit | meaning``."""
    fields: dict[str, Any] = {"__module__": sys._getframe(1).f_globals["__name__"]}  # as of a class declared there
    for line in text.splitlines():
        if line.strip():
            key, unit, doc = (part.strip() for part in line.split("|", 2))
            base, _, kind = key.partition(" ")
            if base in fields:
                raise ValueError(f"table {name!r} has a field twice")
            fields[base] = _MAKERS[kind.strip()](unit, doc)
    return TableType(name.title().replace(" ", ""), (Table,), fields, axes=axes, title=name)  # type: ignore[return-value]


class View:
    """Host-side view of a table's array: ``view["chord"]`` is the row (or rows), written through."""

    __slots__ = ("array", "table")

    def __init__(self, table: type[Table], array: NDArray[np.float64]) -> None:
        self.table = table
        self.array = array

    def rows(self, name: str) -> int | slice:
        """Places of a field's rows in the array."""
        row = self.table.index(name)
        field = self.table.fields.get(name)
        return slice(row, row + len(field)) if field and field.parts else row

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        row: NDArray[np.float64] = self.array[self.rows(name)]
        return row

    def __setitem__(self, name: str, value: Any) -> None:
        self.array[self.rows(name)] = value

    def keys(self) -> tuple[str, ...]:
        """Names of all rows, so that ``dict(view)`` works."""
        return self.table.names

    def __repr__(self) -> str:
        return f"<{self.table.title}: {', '.join(self.table.names)}>"
