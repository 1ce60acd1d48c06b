"""Declarative tables: the one description of every array the kernels use.

A :class:`Table` lists fields (name, unit, meaning) that share one shape. From it come the named
offsets that kernels index with, the host-side views, the channel catalogue, perturbation by name,
and the reference pages of the docs. Nowhere else is the layout of an array written down.

An array of a table is contiguous ``float64`` with the field first: ``array[FIELD]``,
``array[FIELD, blade]`` or ``array[FIELD, blade, node]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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


@dataclass(frozen=True, slots=True)
class Table:
    """Fields that share a shape.

    Attributes:
      name: what the rows describe, e.g. ``"aerodynamic node"``.
      axes: names of the axes after the field axis, from ``blade``, ``node``, ``mode``.
      fields: the rows, in the order of the array.
    """

    name: str
    axes: tuple[str, ...]
    fields: tuple[Field, ...]

    def __post_init__(self) -> None:
        names = self.names
        if len(set(names)) != len(names):
            raise ValueError(f"table {self.name!r} has a field twice")

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f.name for f in self.fields)

    def index(self, name: str) -> int:
        """Row of the named field; an unknown name is answered with the closest ones."""
        try:
            return self.names.index(name)
        except ValueError:
            raise InputError(f"{self.name} has no {name!r}: {did_you_mean(name, self.names)}") from None

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
    """A table from lines ``name | unit | meaning``; blank lines are ignored."""
    rows = [[part.strip() for part in line.split("|", 2)] for line in text.splitlines() if line.strip()]
    return Table(name, tuple(axes.split()), tuple(Field(*row) for row in rows))


class View:
    """Host-side view of a table's array: ``view["chord"]`` is the row, written through."""

    __slots__ = ("array", "table")

    def __init__(self, table: Table, array: NDArray[np.float64]) -> None:
        self.table = table
        self.array = array

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        row: NDArray[np.float64] = self.array[self.table.index(name)]
        return row

    def __setitem__(self, name: str, value: object) -> None:
        self.array[self.table.index(name)] = value

    def __repr__(self) -> str:
        return f"<{self.table.name}: {', '.join(self.table.names)}>"
