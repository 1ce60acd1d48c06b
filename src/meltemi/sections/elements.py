"""Section by finite elements with warping in three directions (B-20 to B-23): the method of Giavotto et al. (1983).

Elements have eight nodes and lie in layers through the walls, one for each ply. Where a ply ends, its elements end in
triangles, so that the mesh holds together without ties.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sections.layup import Section
from meltemi.sections.properties import PlyStates, SectionModel, assembled, central_solution, mass_matrix
from meltemi.sections.thin_walled import check_web, far_apart
from meltemi.sections.walls import Columns, Shell, at_arc, columns_of, depths

Numbers = NDArray[Any]
Ints = NDArray[np.intp]

PIECES = 120
"""Elements round the contour, at least."""
SPACINGS = (1.0, 1.3, 0.8, 1.7)
THINNEST = 1e-7
"""[m] thinner elements are left out."""
POINTS = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 9.0


@dataclass(frozen=True)
class Mesh:
    """Elements of a section.

    Attributes:
      nodes: (N, 2) [m].
      elements: (n, 8) nodes: corners in turn, then the middles of the sides between them; -1 is none.
      ply: (n,) index of ``section.plies``.
      column: (n,) column of the shell or, counted on, of a web.
      along: (n, 2) direction s of the walls.
    """

    nodes: Numbers
    elements: Ints
    ply: Ints
    column: Ints
    along: Numbers


def mesh_of(section: Section, pieces: int = PIECES) -> Mesh:
    """Mesh of a section.

    Args:
      pieces: elements round the contour, at least; webs have elements of the same size.

    Raises:
      InputError: walls or webs overlap; the message names the section.
    """
    for factor in SPACINGS:  # where a wall folds at a corner of the contour, other nodes may not
        mesh = _mesh(section, round(factor * pieces))
        area = np.min([operators(mesh, a, b)[3].real for a in POINTS for b in POINTS], axis=0)
        if np.all(area > 0.0):
            return mesh
    worst = int(np.argmin(area))
    x, y = np.mean(mesh.nodes[mesh.elements[worst]].real, axis=0)
    raise InputError(
        f"{section.name}: the wall is too thick for its curvature at x {x:.3g} m, y {y:.3g} m "
        f"({section.plies[mesh.ply[worst]].name}); the thin-walled model has no such limit"
    )


def _mesh(section: Section, pieces: int) -> Mesh:
    shell = Shell(section)
    feet = [_feet(shell, w, 1.0 / pieces) for w in range(len(section.webs))]
    taken = [(f.real.min(), f.real.max()) for pair in feet for f in pair]
    for i, (a, b) in enumerate(taken):
        if any(a < d and c < b for c, d in taken[:i]):
            names = ", ".join(web.name for web in section.webs)
            raise InputError(f"{section.name}: webs {names} overlap where they meet the shell")
    columns = columns_of(shell, 1.0 / pieces, [f for pair in feet for f in pair], ramps=True)
    grid = _Grid(shell, columns, 1.0 / pieces)
    for w, pair in enumerate(feet):
        grid.add_web(w, pair, pieces)
    return grid.mesh()


def _faces(shell: Shell, w: int) -> tuple[Numbers, Numbers, Numbers]:
    """Distances of the faces of a web's plies from its middle line [m], a point of this line, and the direction
    across it."""
    web = shell.section.webs[w]
    t = np.array([ply.thickness for ply in check_web(shell.section, w)])
    a, b = at_arc(shell.contour, np.array([web.start, web.end])).real
    along = (b - a) / np.hypot(*(b - a))
    return np.concatenate([[0.0], np.cumsum(t)]) - 0.5 * np.sum(t), a, np.array([along[1], -along[0]])


def _feet(shell: Shell, w: int, spacing: float) -> tuple[Numbers, Numbers]:
    """Arcs at which the faces of a web's plies meet the shell, on both sides."""
    section = shell.section
    web = section.webs[w]
    faces, a, normal = _faces(shell, w)

    def off(s: Numbers) -> Numbers:
        inner = at_arc(shell.contour, s) + shell.total(s.real)[:, None] * shell.normal(s.real, spacing)
        return (inner - a) @ normal - faces

    arcs = []
    for start, sign in ((web.start, -1.0), (web.end, 1.0)):
        s = start + sign * faces.real / shell.length
        for _ in range(8):
            s = s - sign * off(s).real / shell.length
        arcs.append(
            s - sign * off(s) / shell.length if np.iscomplexobj(faces) or np.iscomplexobj(shell.thickness) else s
        )
    return arcs[0], arcs[1]


class _Grid:
    """Nodes and elements while they are made; the node of a place is known by a key."""

    def __init__(self, shell: Shell, columns: Columns, spacing: float) -> None:
        self.shell, self.columns, self.section = shell, columns, shell.section
        middle = 0.5 * (columns.s[1:] + columns.s[:-1])
        self.curved, self.across = at_arc(shell.contour, middle), shell.normal(middle.real, spacing)
        self.depth = depths(shell, columns)
        self.points: list[Numbers] = []
        self.known: dict[tuple[Any, ...], int] = {}
        self.made: list[tuple[list[int], int, int, Numbers]] = []
        self.bonded = {**{a: a for a, _ in columns.bonded}, **{b: a for a, b in columns.bonded}}
        self.last = len(columns.present)
        self.ends = self.last + (not columns.closed)
        self.thick = np.diff(self.depth, axis=1).real > THINNEST
        for c in range(self.last):
            self._column(c)

    def _node(self, key: tuple[Any, ...], point: Numbers) -> int:
        if key not in self.known:
            self.known[key] = len(self.points)
            self.points.append(point)
        return self.known[key]

    def _level(self, j: int, k: int) -> int:
        """The interface that is at the same place as interface k of node j: that outside of absent plies."""
        while k > 0 and not self.thick[j, k - 1]:
            k -= 1
        return k

    def _place(self, j: int, depth: complex) -> Numbers:
        return self.columns.outer[j] + depth * self.columns.inward[j]

    def corner(self, j: int, k: int) -> int:
        """Node of interface k at node j of the contour."""
        inner = k == self.depth.shape[1] - 1
        j, k = j % self.ends, self._level(j, k)
        if j in self.bonded and (inner or k == self._level(j, self.depth.shape[1] - 1)):
            a = self.bonded[j]
            return self._node(("bond", a), self._place(j, self.depth[j, k]))
        return self._node((j, k), self._place(j, self.depth[j, k]))

    def side(self, j: int, k: int) -> int:
        """Node in the middle of ply k at node j."""
        j = j % self.ends
        if not self.thick[j, k]:
            return self.corner(j, k)
        return self._node((j, "side", k), self._place(j, 0.5 * (self.depth[j, k] + self.depth[j, k + 1])))

    def middle(self, c: int, k: int) -> int:
        """Node in the middle of interface k of a column."""
        a, b = c % self.ends, (c + 1) % self.ends
        while k > 0 and not (self.thick[a, k - 1] or self.thick[b, k - 1]):
            k -= 1
        one, two = self.corner(a, k), self.corner(b, k)
        outer, curved = self.columns.outer, self.curved[c]
        if self.columns.smooth[c] and self.columns.smooth[c + 1]:
            point = curved + 0.5 * (self.depth[a, k] + self.depth[b, k]) * self.across[c]
        else:
            point = 0.5 * (self.points[one] + self.points[two])
            sag = curved - 0.5 * (outer[c] + outer[c + 1])
            bowed = np.hypot(*sag.real) > 0.05 * np.hypot(*(outer[c + 1] - outer[c]).real)  # a corner left out
            if not bowed and not (a in self.bonded and b in self.bonded):
                point = point + sag
        return self._node(("middle", min(one, two), max(one, two)), point)

    def _column(self, c: int) -> None:
        here = self.columns.present[c]
        if not here.any():
            return
        n = self.last
        neighbours = [(c - 1) % n, (c + 1) % n] if self.columns.closed else [max(c - 1, 0), min(c + 1, n - 1)]
        a, b = c % self.ends, (c + 1) % self.ends
        t = (self.columns.outer[c + 1] - self.columns.outer[c]).real
        for slot in range(self.depth.shape[1] - 1):
            if not (self.thick[a, slot] or self.thick[b, slot]):
                continue
            same = self.shell.slots == slot
            ply = next(k for at in (c, *neighbours) for k in np.flatnonzero(self.columns.present[at] & same))
            corners = [self.corner(a, slot), self.corner(b, slot), self.corner(b, slot + 1), self.corner(a, slot + 1)]
            middles = [self.middle(c, slot), self.side(b, slot), self.middle(c, slot + 1), self.side(a, slot)]
            self._add(corners + middles, self.shell.plies[ply], c, t)

    def _add(self, nodes: list[int], ply: int, column: int, along: Numbers) -> None:
        turned = [nodes[i] for i in (3, 2, 1, 0, 6, 5, 4, 7)]  # from x to y: n is to the right of s
        self.made.append((turned, ply, column, along / np.hypot(*along)))

    def add_web(self, w: int, feet: tuple[Numbers, Numbers], pieces: int) -> None:
        """Elements of a web between the inner nodes of the shell."""
        s, deep = self.columns.s.real, self.depth.shape[1] - 1
        rows = []
        for arcs in feet:
            nodes = [int(np.argmin(np.abs(s - arc))) for arc in arcs.real]
            if any(abs(j - i) != 1 for i, j in itertools.pairwise(nodes)):
                raise InputError(
                    f"{self.section.name}: web {self.section.webs[w].name} meets the shell where a ply or the contour "
                    "ends, or another web; move one of them by the web's thickness"
                )
            ends = [self.corner(j, deep) for j in nodes]
            between = [self.middle(min(i, j), deep) for i, j in itertools.pairwise(nodes)]
            rows.append((ends, between))
        a, b = (np.array([self.points[i] for i in ends]) for ends, _ in rows)
        size = np.sqrt(np.sum((b[0] - a[0]).real ** 2))
        n = max(int(np.ceil(size / self.shell.length * pieces)), 2)
        column = self.last + 1000 * w
        plies = [i for i, ply in enumerate(self.section.plies) if ply.web == w]

        faces, origin, normal = _faces(self.shell, w)

        def at(f: float, p: Numbers, q: Numbers, distance: complex) -> Numbers:
            point = (1.0 - f) * p + f * q
            return point + (distance - (point - origin) @ normal) * normal

        def line(k: int, m: int) -> int:  # node m of 2 n steps along face k
            if m in (0, 2 * n):
                return rows[m // (2 * n)][0][k]
            return self._node(("web", w, k, m), at(m / (2 * n), a[k], b[k], faces[k]))

        def across(k: int, m: int) -> int:  # node in the middle of ply k
            if m in (0, 2 * n):
                return rows[m // (2 * n)][1][k]
            ends = 0.5 * (a[k] + a[k + 1]), 0.5 * (b[k] + b[k + 1])
            return self._node(("web", w, "side", k, m), at(m / (2 * n), *ends, 0.5 * (faces[k] + faces[k + 1])))

        for m in range(n):
            for k, ply in enumerate(plies):
                p, q, r = 2 * m, 2 * m + 1, 2 * m + 2
                nodes = [line(k, p), line(k, r), line(k + 1, r), line(k + 1, p)]
                nodes += [line(k, q), across(k, r), line(k + 1, q), across(k, p)]
                self._add(nodes, ply, column + m, (b[k] - a[k]).real)

    def mesh(self) -> Mesh:
        elements, ply, column, along = (np.array(each) for each in zip(*self.made, strict=True))
        used, places = np.unique(elements, return_inverse=True)
        return Mesh(np.array(self.points)[used], places.reshape(elements.shape), ply, column, along)


def shapes(a: float, b: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(8,) shape functions of an element with eight nodes, and (2, 8) their derivatives."""
    xa, xb = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
    ca, cb = 1.0 + a * xa, 1.0 + b * xb
    low, right, high, left, A, B = 1.0 - b, 1.0 + a, 1.0 + b, 1.0 - a, 0.5 * (1.0 - a * a), 0.5 * (1.0 - b * b)
    N = [*(0.25 * ca * cb * (a * xa + b * xb - 1.0)), A * low, B * right, A * high, B * left]
    by_a = [*(0.25 * xa * cb * (2.0 * a * xa + b * xb)), -a * low, B, -a * high, -B]
    by_b = [*(0.25 * xb * ca * (a * xa + 2.0 * b * xb)), -A, -b * right, A, -b * left]
    return np.array(N), np.array([by_a, by_b])


def material_axes(section: Section, mesh: Mesh) -> NDArray[np.float64]:
    """(n, 6, 6) strains in the axes of the material from those in the section's (B-21).

    Orders: 11, 22, 33, 23, 13, 12; and xx, yy, zz, yz, xz, xy.
    """
    angle = np.array([ply.angle for ply in section.plies])[mesh.ply]
    c, s = np.cos(angle), np.sin(angle)
    t = mesh.along.real
    x, y, zero = t[:, 0], t[:, 1], np.zeros(len(t))
    axes = np.stack([[s * x, s * y, c], [c * x, c * y, -s], [y, -x, zero]]).transpose(2, 0, 1)
    p, q = np.array([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]).T
    one, two = axes[:, p], axes[:, q]
    return np.where(p == q, 0.5, 1.0)[:, None] * (one[:, :, p] * two[:, :, q] + one[:, :, q] * two[:, :, p])


def operators(mesh: Mesh, a: float, b: float) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers]:
    """Strains at a point of all elements, in the order xx, yy, zz, yz, xz, xy (B-20).

    Returns:
      (n, 6, 6) by beam strains, (n, 6, 24) by warping, (n, 6, 24) by its derivative along the blade; (n,) area for each
      unit of the element's own coordinates; (n, 2) point.
    """
    N, D = shapes(a, b)
    corners = mesh.nodes[mesh.elements]
    J = np.einsum("dk,nkc->ndc", D, corners)
    area = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    dx = (J[:, 1, 1, None] * D[0] - J[:, 0, 1, None] * D[1]) / area[:, None]
    dy = (J[:, 0, 0, None] * D[1] - J[:, 1, 0, None] * D[0]) / area[:, None]
    point = np.einsum("k,nkc->nc", N, corners)
    n = len(corners)
    SZ, B, SN = (np.zeros((n, 6, m), dtype=corners.dtype) for m in (6, 24, 24))
    x, y = point.T
    SZ[:, 2, 2], SZ[:, 2, 3], SZ[:, 2, 4] = 1.0, y, -x
    SZ[:, 3, 1], SZ[:, 3, 5] = 1.0, x
    SZ[:, 4, 0], SZ[:, 4, 5] = 1.0, -y
    B[:, 0, 0::3] = B[:, 5, 1::3] = B[:, 4, 2::3] = dx
    B[:, 1, 1::3] = B[:, 5, 0::3] = B[:, 3, 2::3] = dy
    SN[:, 2, 2::3] = SN[:, 3, 1::3] = SN[:, 4, 0::3] = N
    return SZ, B, SN, area, point


def finite_element_section(section: Section, pieces: int = PIECES) -> SectionModel:
    """Stiffness and mass of a section by two-dimensional finite elements with warping.

    Args:
      pieces: elements round the contour, at least; the error falls with their number to the fourth power where the
        solution is smooth, and squared at corners.

    Raises:
      InputError: the section cannot be meshed; the message says why.
    """
    mesh = mesh_of(section, pieces)
    T = material_axes(section, mesh)
    materials = [section.materials[ply.material] for ply in section.plies]
    stiff = np.stack([material.stiffness for material in materials])[mesh.ply]
    Q, density = T.transpose(0, 2, 1) @ stiff @ T, np.array([material.density for material in materials])[mesh.ply]
    parts: dict[str, Any] = dict.fromkeys("ECMRLA", 0.0)
    first: Any = 0.0
    mass: Any = 0.0
    for (a, wa), (b, wb) in itertools.product(zip(POINTS, WEIGHTS, strict=True), repeat=2):
        SZ, B, SN, area, point = operators(mesh, a, b)
        dA, (x, y) = wa * wb * area, point.T
        Bt, St, Zt = (dA[:, None, None] * each.transpose(0, 2, 1) for each in (B, SN, SZ))
        QB, QS, QZ = Q @ B, Q @ SN, Q @ SZ
        products = (Bt @ QB, Bt @ QS, St @ QS, Bt @ QZ, St @ QZ, Zt @ QZ)
        parts = {name: parts[name] + product for name, product in zip(parts, products, strict=True)}
        rho = density * dA
        first = first + np.stack([np.sum(rho * f) for f in (1.0, x, y, x * x, y * y, x * y)])
        mass = mass + rho
    ply_mass = np.zeros(len(section.plies), dtype=mesh.nodes.dtype)
    np.add.at(ply_mass, mesh.ply, mass)
    dof = (3 * mesh.elements[:, :, None] + np.arange(3)).reshape(len(mesh.elements), 24)
    i, j, k = far_apart(mesh.nodes.real)
    in_plane = 3 * j + int(abs(mesh.nodes[j, 0] - mesh.nodes[i, 0]) > abs(mesh.nodes[j, 1] - mesh.nodes[i, 1]))
    pins = np.array([3 * i, 3 * i + 1, 3 * i + 2, in_plane, 3 * j + 2, 3 * k + 2])
    K, u_0, u_1, psi = central_solution(assembled(parts, dof, pins), section.name)

    def states() -> PlyStates:
        SZ, B, SN, _, point = operators(mesh, 0.0, 0.0)
        strain = T @ (SZ @ psi + B @ u_0[dof] + SN @ u_1[dof])
        return PlyStates(mesh.ply, mesh.column, point, strain, stiff @ strain)

    return SectionModel(section, K, mass_matrix(first), ply_mass, mesh, states)
