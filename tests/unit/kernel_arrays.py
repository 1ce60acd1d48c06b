"""Plain arrays passed to a compiled function in a kind of number, through a record of their own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Annotated, Any

import numba
from numpy.typing import NDArray

from meltemi.compiler import KernelRecord, Kind, loose
from meltemi.compiler.kernels import FAST_MATH
from meltemi.compiler.records import CONSTANT, NODES

compiled = loose
"""For functions that compiled ones call: without machine code of their own."""


def call(
    function: Callable[..., Any],
    *arrays: Any,
    kind: Kind,
    nodes: Collection[int] = (),
    slopes: Sequence[Any] | None = None,
) -> None:
    """Call a function of arrays.

    Args:
      kind: of the numbers.
      nodes: places of the arrays whose last axis is read in lanes.
      slopes: derivatives of the arrays, for duals; None for those without.
    """
    names = [f"x{i}" for i in range(len(arrays))]
    given = dict(zip(names, slopes or [None] * len(arrays), strict=True))
    members = {}
    for i, (name, array) in enumerate(zip(names, arrays, strict=True)):
        marks = [array.ndim, *([NODES] if i in nodes else []), *([CONSTANT] if given[name] is None else [])]
        members[name] = Annotated[(NDArray[array.dtype.type], *marks)]
    cls = type("Arrays", (KernelRecord,), {"__annotations__": members, "__module__": __name__})
    made: dict[str, Any] = {"__name__": __name__, "function": compiled(function)}
    exec(f"def outer(m):\n    function({', '.join(f'm.{name}' for name in names)})", made)
    numba.njit(fastmath=FAST_MATH, error_model="numpy")(made["outer"])(
        cls(kind, dict(zip(names, arrays, strict=True)), given)
    )


def row_by_row(operations: Sequence[Callable[[Any, Any], Any]]) -> Callable[[Any, Any, Any], None]:
    """Function of arrays x, y, out that applies each operation to all pairs of its row: compiled at once."""
    made: dict[str, Any] = {f"f{i}": compiled(operation) for i, operation in enumerate(operations)}
    lines = [f"        out[{i}, n] = f{i}(x[{i}, n], y[{i}, n])" for i in range(len(operations))]
    exec("\n".join(["def every(x, y, out):", "    for n in range(x.shape[1]):", *lines]), made)
    every: Callable[[Any, Any, Any], None] = made["every"]
    return every
