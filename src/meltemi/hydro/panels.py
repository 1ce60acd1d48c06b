"""Panels on the surface of a hull under still water, by dual contouring of its distance function.

A grid of cells has one vertex in each cell that the surface crosses, where the tangent planes at the crossings of the
cell's edges meet, so that edges and corners of the hull stay sharp. Panels join the vertices about each crossing.

Reference: docs/theory/floating.md (W-35, W-36); Ju, Losasso, Schaefer & Warren (2002).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.hydro.hull import Hull

Float = NDArray[np.float64]
THIN = 1e-3
"""Height of the first layer of cells below still water over that of others; its vertices are moved to still water."""
SHARP = 0.05
"""Least curvature of an edge: of the squared normals' deviations over those along the mean normal."""
BISECTIONS = 30
MOST_CELLS = 5e6
"""Largest number of cells of a grid, which takes some ten seconds."""
FINE = (2.0, 4.0)
"""Refinement of the grids of the hydrostatics over that of the panels."""


@dataclass(frozen=True)
class Panels:
    """Panels with normals into the water.

    Attributes:
      vertices: (V, 3) [m] coordinates.
      faces: (P, 4) indices of vertices; a triangle repeats one.
    """

    vertices: Float
    faces: NDArray[np.int64]

    def moments(self) -> Float:
        """(10,) volume, its first moments, waterplane area, and its moments about x, y: y, x, yy, xx, xy (W-36)."""
        a, b, c, d = (self.vertices[self.faces[:, k]] for k in range(4))
        total = np.zeros(10)
        for p, q, r in ((a, b, c), (a, c, d)):
            up = 0.5 * np.cross(q - p, r - p)[:, 2]
            for x in (0.5 * (p + q), 0.5 * (q + r), 0.5 * (r + p)):  # exact for quadratic functions
                one = np.ones(len(x))
                u, v, w = x.T
                terms = np.array([w, u * w, v * w, 0.5 * w**2, -one, -v, -u, -(v**2), -(u**2), -u * v])
                total += terms @ up / 3.0
        return total

    @property
    def area(self) -> float:
        """Area [m^2] of the panels."""
        a, b, c, d = (self.vertices[self.faces[:, k]] for k in range(4))
        return float(0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1).sum())


def panels_of(hull: Hull, size: float) -> Panels:
    """Panels of a size [m] with the displacement of the hull; the surface is moved slightly outwards for it (W-36)."""
    plain = contour(hull.distance, *hull.bounds(), size)
    offset = (hull_moments(hull, size)[0] - plain.moments()[0]) / plain.area
    return contour(lambda x: hull.distance(x) - offset, *hull.bounds(), size)


def hull_moments(hull: Hull, size: float) -> Float:
    """(10,) moments as of :meth:`Panels.moments`, extrapolated from two finer grids with second-order error (W-36)."""
    coarse, fine = (contour(hull.distance, *hull.bounds(), size / n).moments() for n in FINE)
    return fine + (fine - coarse) / ((FINE[1] / FINE[0]) ** 2 - 1.0)


def contour(distance: Callable[[Float], Float], low: Float, high: Float, size: float) -> Panels:
    """Panels on the surface where a function of position is zero, below still water (W-35).

    Args:
      distance: function that is negative inside.
      low, high: (3,) [m] box that encloses the surface.
      size: [m] size of the cells.

    Raises:
      InputError: the number of cells exceeds the memory.
    """
    span = np.maximum(high, 0.0) - low
    if not (count := float(np.prod(span[:2] / size + 3.0)) * (-low[2] / size + 2.0)) <= MOST_CELLS:
        extent = " x ".join(f"{x:.3g}" for x in span)
        raise InputError(
            f"hull: {count:.1e} cells of {size:.3g} m for its {extent} m, at most {MOST_CELLS:.0e} are possible; check "
            "start and end of its members and boxes, or use larger panels"
        )
    axes = [
        size * (np.arange(np.floor(a / size) - 1.0, np.ceil(b / size) + 2.0) + 0.5)
        for a, b in zip(low[:2], high[:2], strict=True)
    ]
    layers = int(np.ceil(-low[2] / size)) + 2
    depth = np.concatenate([[0.0], -size * (THIN + np.arange(layers))])
    axes.append(depth[::-1])
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = distance(grid) < 0.0
    shape = np.array(inside.shape) - 1
    cells, places, normals, faces = [], [], [], []
    for axis in range(3):
        first = np.moveaxis(inside, axis, 0)
        crossed = np.moveaxis(first[1:] != first[:-1], 0, axis)
        at = np.argwhere(crossed)
        outward = ~inside[tuple(at.T)]  # viewed along the axis, from the water into the hull
        step = np.eye(3, dtype=np.int64)[axis]
        a, b = grid[tuple(at.T)], grid[tuple((at + step).T)]
        x = _crossing(distance, a, b, outward)
        n = _gradient(distance, x, 1e-4 * size)
        u, v = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3]]
        round_ = [at - u - v, at - v, at, at - u]
        for each in round_:
            keep = ((each >= 0) & (each < shape)).all(axis=1)
            cells.append(each[keep])
            places.append(x[keep])
            normals.append(n[keep])
        whole = np.all([((each >= 0) & (each < shape)).all(axis=1) for each in round_], axis=0)
        quads = np.stack([np.ravel_multi_index(each[whole].T, shape) for each in round_], axis=1)
        faces.append(np.where(outward[whole, None], quads[:, ::-1], quads))
    where, cell = np.unique(np.ravel_multi_index(np.concatenate(cells).T, shape), return_inverse=True)
    corner = np.stack(np.unravel_index(where, shape), axis=1)
    bounds = [np.stack([axes[k][corner[:, k] + i] for k in range(3)], axis=1) for i in (0, 1)]
    vertices = _vertices(cell, np.concatenate(places), np.concatenate(normals), len(where))
    smooth = vertices - distance(vertices)[:, None] * _gradient(distance, vertices, 1e-4 * size)
    near = np.abs(distance(vertices)) > 1e-9 * size
    vertices = np.where(near[:, None], smooth, vertices)
    vertices = np.clip(vertices, *bounds)
    vertices[corner[:, 2] == shape[2] - 1, 2] = 0.0
    return Panels(vertices, np.searchsorted(where, np.concatenate(faces)))


def _crossing(distance: Callable[[Float], Float], a: Float, b: Float, outward: NDArray[np.bool_]) -> Float:
    """Points on edges from a to b where the distance is zero, by bisection; end a is outside where ``outward``."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (a + b)
        as_a = ((distance(middle) >= 0.0) == outward)[:, None]
        a, b = np.where(as_a, middle, a), np.where(as_a, b, middle)
    return 0.5 * (a + b)


def _gradient(distance: Callable[[Float], Float], x: Float, h: float) -> Float:
    slopes = np.stack([distance(x + h * e) - distance(x - h * e) for e in np.eye(3)], axis=-1)
    gradient: Float = slopes / np.maximum(np.linalg.norm(slopes, axis=-1, keepdims=True), 1e-300)
    return gradient


def _vertices(cell: NDArray[np.int64], place: Float, normal: Float, count: int) -> Float:
    """(count, 3) least-squares intersection of the tangent planes in each cell, closest to the mean crossing."""
    many = np.bincount(cell, minlength=count)[:, None]
    mean = np.stack([np.bincount(cell, place[:, k], count) for k in range(3)], axis=1) / many
    A, r = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(A, cell, normal[:, :, None] * normal[:, None, :])
    np.add.at(r, cell, normal * np.einsum("ij,ij->i", normal, place - mean[cell])[:, None])
    values, vectors = np.linalg.eigh(A)
    inverse = np.where(values > SHARP * values[:, -1:], 1.0 / np.maximum(values, 1e-300), 0.0)
    return mean + np.einsum("cij,cj,ckj,ck->ci", vectors, inverse, vectors, r)
