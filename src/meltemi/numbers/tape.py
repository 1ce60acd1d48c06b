"""The tape of reverse differentiation: every operation on taped numbers, with its partial derivatives.

A *taped* number is a value and its place on the tape. An operation z = f(x, y) appends one entry, the places of x and
y and the partial derivatives of f; place 0 is that of constants. With the adjoints of the results at hand, one sweep
backwards over the entries yields those of all variables, whatever their number:

    adjoint[x] += df/dx adjoint[z],    adjoint[y] += df/dy adjoint[z]

There is one tape in a process, so runs with taped numbers must not overlap.

Reference: Griewank & Walther (2008), Evaluating Derivatives, chapters 3 and 4; docs/theory/adjoint.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numpy.typing import NDArray

from meltemi.core.errors import MeltemiError
from meltemi.core.kernel import kernel

Float = NDArray[np.float64]
CAPACITY = 1 << 22
"""Entries of the tape: an evaluation of a turbine with 20 nodes a blade takes some 100,000."""
_SYMBOL = "meltemi_tape"
_COUNT, _LAST, _LINKS, _PARTIALS = range(4)
_HEAD = np.array([1, 1, 0, 0], dtype=np.int64)
_F64, _I64, _I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
llvmlite.binding.add_symbol(_SYMBOL, _HEAD.ctypes.data)


class Tape:
    """The memory of the tape.

    Attributes:
      links: (entries, 2) places of the arguments of each entry.
      partials: (entries, 2) derivatives with respect to them.
      adjoints: (entries,) of the places; zero between sweeps.
    """

    def __init__(self) -> None:
        self.links = np.zeros((CAPACITY, 2), dtype=np.int32)  # untouched pages take no memory
        self.partials, self.adjoints = np.zeros((CAPACITY, 2)), np.zeros(CAPACITY)
        _HEAD[:] = 1, CAPACITY - 1, self.links.ctypes.data, self.partials.ctypes.data

    @property
    def count(self) -> int:
        """The next place.

        Raises:
          MeltemiError: the tape is full.
        """
        if _HEAD[_COUNT] >= _HEAD[_LAST]:
            raise MeltemiError(f"adjoint: the tape is full with {CAPACITY} operations; use fewer nodes")
        return int(_HEAD[_COUNT])

    @count.setter
    def count(self, place: int) -> None:
        _HEAD[_COUNT] = place

    def sweep(self, end: int) -> None:
        """Carry the adjoints of all entries from ``end`` on to their arguments."""
        sweep(end, self.count, self.links, self.partials, self.adjoints)


@kernel
def sweep(end: int, count: int, links: Any, partials: Float, adjoints: Float) -> None:
    """Adjoints of the arguments of the entries from ``count - 1`` down to ``end``; those of the entries become 0."""
    for i in range(count - 1, end - 1, -1):
        adjoint = adjoints[i]
        if adjoint != 0.0:
            adjoints[i] = 0.0
            adjoints[links[i, 0]] += partials[i, 0] * adjoint
            adjoints[links[i, 1]] += partials[i, 1] * adjoint
    adjoints[0] = 0.0


def append(builder: Any, terms: Sequence[tuple[Any, Any]]) -> Any:
    """Generate an entry for one or two (place, partial derivative); returns its place, 0 if all places are."""
    module = builder.module
    head = module.globals.get(_SYMBOL)
    if head is None:
        head = ir.GlobalVariable(module, ir.ArrayType(_I64, len(_HEAD)), _SYMBOL)
        head.linkage = "external"
    domain = module.add_metadata([ir.MetaDataString(module, "meltemi.tape")])
    counter = module.add_metadata([module.add_metadata([ir.MetaDataString(module, "meltemi.tape.count"), domain])])

    def word(i: int) -> Any:
        return builder.gep(head, [_I32(0), _I32(i)])

    def load(i: int) -> Any:
        loaded = builder.load(word(i), typ=_I64)
        if i == _COUNT:
            loaded.set_metadata("alias.scope", counter)
        else:
            loaded.set_metadata("invariant.load", module.add_metadata([]))
        return loaded

    def store(value: Any, pointer: Any) -> None:
        builder.store(value, pointer).set_metadata("noalias", counter)

    n = load(_COUNT)
    first, *others = [place for place, _ in terms]
    links = builder.inttoptr(load(_LINKS), _I64.as_pointer())
    partials = builder.inttoptr(load(_PARTIALS), _F64.as_pointer())
    both = builder.or_(first, builder.shl(others[0], _I64(32))) if others else first
    store(both, builder.gep(links, [n], source_etype=_I64))
    begin = builder.shl(n, _I64(1))
    for k, partial in enumerate([partial for _, partial in terms] + [_F64(0.0)] * (2 - len(terms))):
        store(partial, builder.gep(partials, [builder.or_(begin, _I64(k))], source_etype=_F64))
    active = builder.icmp_unsigned("!=", both, _I64(0))
    following = builder.add(n, builder.zext(active, _I64))
    most = load(_LAST)
    following = builder.select(builder.icmp_unsigned("<", following, most), following, most)
    builder.store(following, word(_COUNT)).set_metadata("alias.scope", counter)
    return builder.select(active, n, _I64(0))
