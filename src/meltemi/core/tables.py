"""Declarative tables: the definition of every kernel array.

A :class:`Table` lists fields (name, unit, meaning) that share one shape. From it come the named
offsets that kernels index with, the host-side views, the channel catalogue, perturbation by name,
and the reference pages of the docs. Nowhere else is the layout of an array written down.

An array of a table is contiguous ``float64`` with the field first: ``array[FIELD]``,
``array[FIELD, blade]`` or ``array[FIELD, blade, node]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from meltemi.core.errors import InputError, did_you_mean

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Field:
    """One row of a table."""

    name: str
    unit: str
    doc: str


PARTS = {
    "xyz": ("x", "y", "z"),
    "rotation": ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),
    "symmetric": ("xx", "yy", "zz", "xy", "xz", "yz"),
    "blades": ("1", "2", "3"),
    "flaps": tuple(f"{flap}_{blade}" for flap in range(1, 5) for blade in range(1, 4)),
}
"""Fields that are vectors, rotation matrices (row by row), symmetric matrices, one number a blade or one for each of up
to four flaps of each blade."""
MAX_BLADES = len(PARTS["blades"])
MAX_FLAPS = len(PARTS["flaps"]) // MAX_BLADES


@dataclass(frozen=True, slots=True)
class Table:
    """Fields of one array, with a common shape.

    Attributes:
      name: what the rows describe, e.g. ``"blade motion"``.
      axes: names of the axes after the field axis, from ``blade``, ``node``, ``mode``.
      fields: the rows, in the order of the array.
    """

    name: str
    axes: tuple[str, ...]
    fields: tuple[Field, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f.name for f in self.fields)

    def __len__(self) -> int:
        return len(self.fields)

    def index(self, name: str) -> int:
        """Row of the named field, the first row of a vector or matrix; errors suggest the closest names."""
        names = self.names
        for candidate in (name, f"{name}_x", f"{name}_xx", f"{name}_1", f"{name}_1_1"):
            if candidate in names:
                return names.index(candidate)
        raise InputError(f"{self.name} has no {name!r}: {did_you_mean(name, names)}")

    def slots(self, names: str) -> tuple[int, ...]:
        """Rows of several fields, for unpacking into the constants that kernels index with."""
        return tuple(self.index(name) for name in names.split())

    def shape(self, **sizes: int) -> tuple[int, ...]:
        """Shape of this table's array; ``sizes`` gives the length of every axis."""
        return (len(self.fields), *(sizes[axis] for axis in self.axes))

    def zeros(self, **sizes: int) -> NDArray[np.float64]:
        """A new array of this table."""
        import numpy as np

        return np.zeros(self.shape(**sizes))


def table(name: str, axes: str, text: str) -> Table:
    """A table from lines ``name | unit | meaning`` or ``name parts | unit | meaning``, see :data:`PARTS`."""
    fields: list[Field] = []
    for line in text.splitlines():
        if not line.strip():
            continue
        key, unit, doc = (part.strip() for part in line.split("|", 2))
        base, *parts = key.split()
        if parts:
            fields += [Field(f"{base}_{part}", unit, doc) for part in PARTS[parts[0]]]
        else:
            fields.append(Field(base, unit, doc))
    if len({f.name for f in fields}) != len(fields):
        raise ValueError(f"table {name!r} has a field twice")
    return Table(name, tuple(axes.split()), tuple(fields))


class View:
    """View of a table's array by field names: ``view["chord"]`` is a view of its row (or rows)."""

    __slots__ = ("array", "table")

    def __init__(self, table: Table, array: NDArray[np.float64]) -> None:
        self.table = table
        self.array = array

    def rows(self, name: str) -> int | slice:
        """Indices of a field's rows in the array."""
        row = self.table.index(name)
        for parts in PARTS.values():
            rows = slice(row, row + len(parts))
            if self.table.names[rows] == tuple(f"{name}_{part}" for part in parts):
                return rows
        return row

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        row: NDArray[np.float64] = self.array[self.rows(name)]
        return row

    def __setitem__(self, name: str, value: Any) -> None:
        self.array[self.rows(name)] = value

    def keys(self) -> tuple[str, ...]:
        """Names of all rows, so that ``dict(view)`` works."""
        return self.table.names

    def __repr__(self) -> str:
        return f"<{self.table.name}: {', '.join(self.table.names)}>"
