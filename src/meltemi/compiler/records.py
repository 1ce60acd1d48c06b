"""Records: groups of tables and arrays, the single argument of a kernel.

    class System(KernelRecord):
        q: Array1
        flow: BladeFlow
        tower_flow: Single[TowerFlow]

The annotation is the type of the member: a table, or a plain array by its number of dimensions. Kernels receive the
address of ``words``, which contain for each member the addresses of its numbers and of their derivatives, then the
lengths of its axes (``record_types``). A record keeps its arrays alive; none of them is replaced in its lifetime.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler.tables import Table

Float = NDArray[np.float64]
T = TypeVar("T")
Kind = Literal["floats", "lanes", "duals"]
SINGLE, NODES, CONSTANT = "single", "nodes", "constant"
Single = Annotated[T, SINGLE]
"""A table whose nodes are accessed one by one, never in lanes."""
Nodes = Annotated[T, NODES]
"""A plain array whose last axis is over nodes."""
Constant = Annotated[T, CONSTANT]
"""A member without derivatives."""
Array1 = Annotated[Float, 1]
Array2 = Annotated[Float, 2]
Array3 = Annotated[Float, 3]
Array4 = Annotated[Float, 4]
Ints = Annotated[NDArray[np.int64], 1, CONSTANT]
Box = Annotated[NDArray[np.float32], 4, CONSTANT]
LANES = 8
"""Entries of a lane array per access; equal to ``lanes.WIDTH``."""


class RecordMember(NamedTuple):
    """Type of a member of a record.

    Attributes:
      table: class of the table; None for a plain array.
      dtype: type of the array entries.
      ndim: number of axes of the table, or of dimensions of the array.
      in_lanes: whether the last axis is read in lanes if the record is.
      constant: whether the member has no derivatives.
    """

    table: Any
    dtype: Any
    ndim: int
    in_lanes: bool
    constant: bool


@cache
def members(record: Any) -> dict[str, RecordMember]:
    """Members of a record by name, from its annotations: those of its first base come first, in their order."""
    result: dict[str, RecordMember] = {}
    for base in record.__bases__ if record is not object else ():
        result |= members(base)
    for name, hint in get_type_hints(record, include_extras=True).items():
        kind, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if isinstance(kind, type) and issubclass(kind, Table):
            lanes = SINGLE not in marks and kind.axes[-1:] == ("node",)
            dtype = np.int64 if kind.integer else np.float64
            result[name] = RecordMember(kind, dtype, len(kind.axes), lanes, CONSTANT in marks or kind.integer)
        else:
            (ndim,) = (mark for mark in marks if isinstance(mark, int))
            dtype = next((t for t in (np.float32, np.int64) if t.__name__ in str(kind)), np.float64)  # type: ignore[assignment]
            result[name] = RecordMember(None, dtype, ndim, NODES in marks, CONSTANT in marks)
    return result


class KernelRecord:
    """A group of tables and arrays.

    Args:
      kind: number type of the kernels.
      arrays: contiguous arrays by the names of the members.
      slopes: derivatives of these arrays, for duals.
    """

    def __init__(self, kind: Kind, arrays: dict[str, Any], slopes: dict[str, Any] | None = None) -> None:
        self.kind = kind
        words: list[int] = []
        keep: list[Any] = []
        cls: Any = type(self)
        for name, member in members(cls).items():
            array = arrays[name]
            if not (array.flags.c_contiguous and array.dtype == member.dtype):
                raise TypeError(f"{type(self).__name__}.{name}: expected a contiguous array of {member.dtype.__name__}")
            setattr(self, name, array if member.table is None else member.table(array))
            shape = list(array.shape if member.table is None else member.table.lengths(array))
            if len(shape) != member.ndim:
                raise TypeError(f"{type(self).__name__}.{name}: expected {member.ndim} axes, found {len(shape)}")
            if kind == "lanes" and member.in_lanes:
                shape[-1] //= LANES
            slope = None if kind != "duals" or slopes is None or member.constant else slopes[name]
            words += [array.ctypes.data, 0 if slope is None else slope.ctypes.data, *shape]
            keep += [array, slope]
        self._keep, self.arrays = keep, keep[::2]
        self.words = np.array(words, dtype=np.int64)
        self.address = self.words.ctypes.data

    def __reduce__(self) -> Any:
        raise TypeError("a record contains memory addresses and cannot be copied; create it from its arrays")


def leading(cls: Any) -> Iterator[Any]:
    """A class of records, and those with whose members its own begin: its first base, the first of that, and so on."""
    while issubclass(cls, KernelRecord):
        yield cls
        cls = cls.__bases__[0]


@cache
def joined(*classes: Any) -> Any:
    """The class of records with the members of several, of the first before others; a kernel of any takes it."""
    kept = [each for each in classes if not any(each is not other and issubclass(other, each) for other in classes)]
    kept.sort(key=lambda each: not issubclass(each, classes[0]))
    if len(kept) == 1:
        return kept[0]
    name = "+".join(f"{each.__module__}:{each.__qualname__}".replace(".", "/") for each in kept)
    globals()[name] = cls = type(name, tuple(kept), {"__module__": __name__})
    return cls


def __getattr__(name: str) -> Any:
    """A joined class by its name, as cached machine code asks for it."""
    if ":" not in name:
        raise AttributeError(name)
    places = (part.replace("/", ".").split(":") for part in name.split("+"))
    return joined(*(getattr(import_module(module), inner) for module, inner in places))
