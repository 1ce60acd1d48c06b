"""Arrays as kernels of a number type see them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic

from meltemi.numbers.lanes import WIDTH, LaneArrayType, lane_view

FLOATS, LANES = None, WIDTH
"""Kinds of numbers."""


def viewer(nodes: Collection[int]) -> Callable[[Any, Any], Any]:
    """A compiled function ``(kind, arrays)`` that gives a tuple of arrays the views of a kind of number.

    Args:
      nodes: places in the tuple of the arrays whose last axis is read in lanes.
    """

    @intrinsic  # type: ignore[untyped-decorator]
    def view(typing_context: Any, kind: Any, arrays: Any) -> Any:
        in_lanes = set() if isinstance(kind, types.NoneType) else nodes
        new = types.Tuple([LaneArrayType(a.ndim) if i in in_lanes else a for i, a in enumerate(arrays)])

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            old = cgutils.unpack_tuple(builder, args[1])
            items = [lane_view(context, builder, arrays[i], x) if i in in_lanes else x for i, x in enumerate(old)]
            result = context.make_tuple(builder, new, items)
            context.nrt.incref(builder, new, result)
            return result

        return new(kind, arrays), generate

    return view
