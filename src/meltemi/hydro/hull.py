"""Hull of circular members and boxes: description and distance function.

Reference: docs/theory/floating.md (W-35).
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector
from meltemi.floating.members import Member

Float = NDArray[np.float64]


class Box(Record):
    """A pontoon or plate of rectangular section."""

    start: Vector
    """(3,) [m] middle of one end: x, y, and height above still water."""
    end: Vector
    """(3,) [m] middle of the other end."""
    width: float = Field(gt=0.0)
    """[m] horizontal width."""
    height: float = Field(gt=0.0)
    """[m] height, normal to axis and width."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("start", "end"):
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} must have 3 entries, x, y, z [m], found {len(getattr(self, name))}")
        if not np.hypot(*(self.end - self.start)[:2]) > 0.0:
            raise ValueError("a box must not be upright: start and end have the same x and y")
        return self


class Hull(Record):
    """Hull of a platform for potential flow: members and boxes may overlap and form one body."""

    depth: float = Field(gt=1.0)
    """[m] water depth."""
    members: tuple[Member, ...] = ()
    """Circular columns, pontoons and plates, as of a platform; the part of columns above water is ignored."""
    boxes: tuple[Box, ...] = ()
    """Pontoons and plates of rectangular section."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        ends = [x for each in self.members for x in (each.start, each.end)]
        ends += [x for each in self.boxes for x in (each.start, each.end)]
        if not any(x[2] < 0.0 for x in ends):
            raise ValueError("members or boxes must reach below still water, which is at height 0")
        if self.bounds()[0][2] <= -self.depth:
            raise ValueError(f"the hull touches the sea bed at -{self.depth:g} m")
        return self

    def bounds(self) -> tuple[Float, Float]:
        """(3,), (3,) [m] least and largest coordinates."""
        ends = [(each.start, each.end, 0.5 * max(each.diameters)) for each in self.members]
        ends += [(each.start, each.end, 0.5 * float(np.hypot(each.width, each.height))) for each in self.boxes]
        low = np.min([np.minimum(a, b) - _aside(a, b) * r for a, b, r in ends], axis=0)
        high = np.max([np.maximum(a, b) + _aside(a, b) * r for a, b, r in ends], axis=0)
        return low, high

    def distance(self, x: Float) -> Float:
        """(...) [m] signed distance at points (..., 3): zero on the surface, negative inside, exact near it (W-35)."""
        parts = [_round(each, x) for each in self.members] + [_box(each, x) for each in self.boxes]
        distance: Float = np.min(parts, axis=0)
        return distance


def _aside(a: Float, b: Float) -> Float:
    """(3,) extent of a member beyond its axis along x, y, z, over its radius."""
    e = (b - a) / np.linalg.norm(b - a)
    shares: Float = np.sqrt(np.maximum(1.0 - e**2, 0.0))
    return shares


def _round(member: Member, x: Float) -> Float:
    way = member.end - member.start
    length = float(np.linalg.norm(way))
    r = x - member.start
    s = r @ (way / length)
    first, last = member.diameters
    slope = 0.5 * (last - first) / length
    radial = np.sqrt(np.maximum(np.einsum("...i,...i->...", r, r) - s**2, 0.0)) - 0.5 * first - slope * s
    distance: Float = np.maximum(radial / np.sqrt(1.0 + slope**2), np.maximum(-s, s - length))
    return distance


def _box(box: Box, x: Float) -> Float:
    way = box.end - box.start
    e = way / np.linalg.norm(way)
    side = np.array([-e[1], e[0], 0.0]) / np.hypot(e[0], e[1])
    r = x - 0.5 * (box.start + box.end)
    sizes = (float(np.linalg.norm(way)), box.width, box.height)
    distance: Float = np.max(
        [np.abs(r @ d) - 0.5 * n for d, n in zip((e, side, np.cross(e, side)), sizes, strict=True)], axis=0
    )
    return distance
