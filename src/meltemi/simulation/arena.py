"""Contiguous memory for the arrays of a simulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import N_DERIVATIVES, WIDTH

Float = NDArray[np.float64]


def aligned(shape: tuple[int, ...]) -> Float:
    """Array of zeros whose memory begins at a multiple of 64 bytes, the width of the vector registers."""
    size = int(np.prod(shape))
    spare = np.zeros(size + WIDTH)
    begin = (-spare.ctypes.data // spare.itemsize) % WIDTH
    return spare[begin : begin + size].reshape(shape)


class Arena:
    """Arrays as consecutive views of one contiguous vector, each beginning at a multiple of 64 bytes.

    With ``duals``, a second vector and views of it hold the derivatives of every entry.
    """

    def __init__(self, shapes: dict[str, tuple[int, ...]], *, duals: bool = False) -> None:
        self.begin: dict[str, int] = {}
        at = 0
        for name, shape in shapes.items():
            self.begin[name] = at
            at += -(-int(np.prod(shape)) // WIDTH) * WIDTH
        self.vector = aligned((at,))
        self.slopes = aligned((at if duals else 0, N_DERIVATIVES))
        self.views: dict[str, Float] = {}
        self.slope_views: dict[str, Float] = {}
        for name, shape in shapes.items():
            entries = slice(self.begin[name], self.begin[name] + int(np.prod(shape)))
            self.views[name] = self.vector[entries].reshape(shape)
            if duals:
                self.slope_views[name] = self.slopes[entries].reshape(*shape, N_DERIVATIVES)

    def place(self, name: str, index: tuple[int, ...]) -> int:
        """Index of an entry of a view in the vector."""
        at = 0
        for i, n in zip(index, self.views[name].shape, strict=True):
            at = n * at + i
        return self.begin[name] + at
