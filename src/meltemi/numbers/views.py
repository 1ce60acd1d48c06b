"""Arrays in the types that kernels of a number type take."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from llvmlite import ir
from numba.core import cgutils, config, types
from numba.extending import intrinsic

from meltemi.numbers.duals import DualArrayType, dual_view
from meltemi.numbers.lanes import WIDTH, LaneArrayType, lane_view

FLOATS, LANES = None, WIDTH
"""Number types; the third one, duals, is given by the tuple of the arrays of derivatives."""


def viewer(nodes: Collection[int] = ()) -> Callable[[Any, Any], Any]:
    """A compiled function ``(kind, arrays)`` that returns a tuple of arrays in the types of a number type.

    Args:
      nodes: indices in the tuple of the arrays whose last axis is read in lanes.
    """
    if config.DISABLE_JIT:
        return lambda kind, arrays: arrays

    @intrinsic
    def view(typing_context: Any, kind: Any, arrays: Any) -> Any:
        def seen_as(i: int) -> Any:
            if isinstance(kind, types.BaseTuple) and isinstance(kind[i], types.Array):
                return DualArrayType(arrays[i].ndim)
            if isinstance(kind, types.Integer) and i in nodes:
                return LaneArrayType(arrays[i].ndim)
            return arrays[i]

        new = types.Tuple([seen_as(i) for i in range(len(arrays))])

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            items = cgutils.unpack_tuple(builder, args[1])
            slopes = cgutils.unpack_tuple(builder, args[0]) if isinstance(kind, types.BaseTuple) else []
            for i, x in enumerate(items):
                if isinstance(new[i], LaneArrayType):
                    items[i] = lane_view(context, builder, arrays[i], x)
                elif isinstance(new[i], DualArrayType):
                    items[i] = dual_view(context, builder, arrays[i], x, kind[i], slopes[i])
                elif isinstance(new[i], types.Array):
                    # without ownership: the host keeps the memory, so no reference counts are needed
                    array = context.make_array(new[i])(context, builder, x)
                    array.meminfo = ir.Constant(array.meminfo.type, None)
                    array.parent = ir.Constant(array.parent.type, None)
                    items[i] = array._getvalue()
            return context.make_tuple(builder, new, items)

        return new(kind, arrays), generate

    return view
