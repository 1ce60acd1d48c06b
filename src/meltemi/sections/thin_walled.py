"""Section of thin walls: membrane and bending of laminates, warping along the blade (B-15 to B-19).

On straight pieces of wall with warping linear between nodes the flow of shear from torsion is that of Bredt, in any
number of cells, and that of transverse forces converges to Vlasov's with the square of the spacing.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sections.laminate import Laminate, laminate, rotation
from meltemi.sections.layup import Ply, Section
from meltemi.sections.properties import PlyStates, SectionModel, assembled, central_solution, mass_matrix
from meltemi.sections.walls import Shell, columns_of, depths

Numbers = NDArray[Any]

PIECES = 240
"""Pieces of the contour, at least."""
GAUSS = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)


@dataclass(frozen=True)
class Wall:
    """A straight piece of wall.

    Attributes:
      nodes: at its ends.
      plies: indices of ``section.plies`` and their thickness [m], from the side from which n points.
      laminate: its stiffness.
      curvature: [1/m] of the contour, positive towards n.
      link: it only carries shear, and has no mass: the end of a web within the shell.
    """

    nodes: tuple[int, int]
    plies: tuple[tuple[int, complex], ...]
    laminate: Laminate
    curvature: float = 0.0
    link: bool = False


@dataclass(frozen=True)
class Walls:
    """Walls of a section: ``nodes`` (N, 2) [m] in the middle of the walls, and pieces between them."""

    nodes: Numbers
    walls: tuple[Wall, ...]

    def ends(self, wall: Wall) -> tuple[Numbers, Numbers]:
        """Ends of a wall [m]."""
        return self.nodes[wall.nodes[0]], self.nodes[wall.nodes[1]]


def walls_of(section: Section, pieces: int = PIECES) -> Walls:
    """Middle lines of the walls of a section.

    Raises:
      InputError: the contour or the plies are not as they should be.
    """
    shell = Shell(section)
    feet = [np.array([arc]) for web in section.webs for arc in (web.start, web.end)]
    columns = columns_of(shell, 1.0 / pieces, feet)
    depth = depths(shell, columns)[:, -1]
    nodes = list(columns.outer + 0.5 * depth[:, None] * columns.inward)
    walls: list[tuple[tuple[int, int], tuple[tuple[int, complex], ...], float, bool]] = []

    def add(a: int, b: int, stack: list[tuple[int, complex]], curvature: float = 0.0, link: bool = False) -> None:
        walls.append(((a, b), tuple(stack), curvature, link))

    last = len(columns.present)
    for c, here in enumerate(columns.present):
        room = 0.5 * (columns.room[c] + columns.room[c + 1])
        stack: list[tuple[int, complex]] = []
        for k in np.flatnonzero(here):
            t = shell.thickness[k]
            t = room if t.real > room.real else t
            room = room - t
            if t.real > 1e-9:
                stack.append((shell.plies[k], t))
        if stack:
            t = (nodes[c + 1] - nodes[c]).real
            turn = -np.dot(columns.inward[c + 1] - columns.inward[c], t) / np.dot(t, t)
            smooth = columns.smooth[c] and columns.smooth[c + 1]
            add(c, 0 if columns.closed and c + 1 == last else c + 1, stack, float(turn) if smooth else 0.0)
    for a, b in columns.bonded:  # across the bonded edge
        full = np.flatnonzero(columns.present[a])
        add(a, b, [(shell.plies[k], shell.thickness[k]) for k in full], link=True)
    for w, web in enumerate(section.webs):
        ends: list[int] = [int(np.argmin(np.abs(columns.s.real - arc))) % last for arc in (web.start, web.end)]
        stack = [(i, ply.thickness) for i, ply in enumerate(section.plies) if ply.web == w]
        check_web(section, w)
        a, b = nodes[ends[0]], nodes[ends[1]]
        along = (b - a) / np.sqrt(np.sum((b - a) ** 2))
        slant = [max(v, -v, key=np.real) for v in (columns.inward[j] @ along for j in ends)]
        hidden = [0.5 * depth[j] / max(v, 0.2, key=np.real) for j, v in zip(ends, slant, strict=True)]
        inner = a + hidden[0] * along, b - hidden[1] * along
        n = max(int(np.sqrt(np.sum((b - a).real ** 2)) / shell.length * pieces), 4)
        line = [ends[0], *range(len(nodes), len(nodes) + n + 1), ends[1]]
        nodes += [inner[0] + f * (inner[1] - inner[0]) for f in np.linspace(0.0, 1.0, n + 1)]
        for piece, (p, q) in enumerate(itertools.pairwise(line)):
            add(p, q, stack, link=piece in (0, n + 1))
    used, pairs = np.unique([pair for pair, *_ in walls], return_inverse=True)
    pairs = pairs.reshape(-1, 2)
    known: dict[Any, Laminate] = {}
    made = []
    for (a, b), closed, (_, key, curvature, link) in zip(pairs, in_cells(pairs), walls, strict=True):
        what = (key, closed, round(curvature, 6))
        if what not in known:
            plies = [(section.plies[i], t) for i, t in key]
            known[what] = laminate(plies, section.materials, closed=closed, curvature=curvature)
        made.append(Wall((int(a), int(b)), key, known[what], curvature, link))
    return Walls(np.array([nodes[j] for j in used]), tuple(made))


def in_cells(pairs: NDArray[np.intp]) -> list[bool]:
    """Whether walls between nodes are part of closed cells: what remains when free ends are taken off, one by one."""
    degree = np.bincount(pairs.ravel())
    kept = np.ones(len(pairs), dtype=bool)
    while (ends := kept & np.any(degree[pairs] == 1, axis=1)).any():
        kept &= ~ends
        degree = np.bincount(pairs[kept].ravel(), minlength=len(degree))
    return kept.tolist()


def check_web(section: Section, web: int) -> list[Ply]:
    """Plies of a web.

    Raises:
      InputError: one does not reach from end to end.
    """
    plies = [ply for ply in section.plies if ply.web == web]
    for ply in plies:
        if ply.start > 1e-6 or ply.end < 1.0 - 1e-6:
            raise InputError(
                f"{section.name}: layer {ply.name} covers {ply.start:g} to {ply.end:g} of web "
                f"{section.webs[web].name}: layers of webs must reach from 0 to 1"
            )
    return plies


def thin_walled_section(section: Section, pieces: int = PIECES) -> SectionModel:
    """Stiffness and mass of a section as thin walls.

    Args:
      pieces: of the contour, at least.

    Raises:
      InputError: the section cannot be described so; the message says why.
    """
    mesh = walls_of(section, pieces)
    pairs = np.array([wall.nodes for wall in mesh.walls])
    link = np.array([wall.link for wall in mesh.walls])
    S = np.stack([wall.laminate.wall for wall in mesh.walls])
    S[link] *= np.outer(SHEAR, SHEAR)
    m = np.where(link, 0.0, np.stack([wall.laminate.mass for wall in mesh.walls]).T)
    parts: dict[str, Any] = dict.fromkeys("ECMRLA", 0.0)
    first: Any = 0.0
    for f in GAUSS:
        SZ, B, SN, ds, (x, y), (nx, ny) = strains(mesh, f)
        Bt, St, Zt = (0.5 * ds[:, None, None] * each.transpose(0, 2, 1) for each in (B, SN, SZ))
        products = (Bt @ S @ B, Bt @ S @ SN, St @ S @ SN, Bt @ S @ SZ, St @ S @ SZ, Zt @ S @ SZ)
        parts = {name: parts[name] + product for name, product in zip(parts, products, strict=True)}
        moments = (m[0], m[0] * x + m[1] * nx, m[0] * y + m[1] * ny)
        squares = tuple(
            m[0] * p * q + m[1] * (p * v + q * u) + m[2] * u * v
            for p, u, q, v in ((x, nx, x, nx), (y, ny, y, ny), (x, nx, y, ny))
        )
        first = first + 0.5 * np.stack(moments + squares) @ ds
    ply_mass = np.zeros(len(section.plies), dtype=S.dtype)
    for wall, length in zip(mesh.walls, ds, strict=True):
        faces = wall.laminate.faces
        for (i, t), low, high in zip(() if wall.link else wall.plies, faces[:-1], faces[1:], strict=False):
            share = 1.0 - 0.5 * wall.curvature * (low + high)
            ply_mass[i] += length * share * t * section.materials[section.plies[i].material].density
    K, u_0, u_1, psi = central_solution(assembled(parts, pairs, far_apart(mesh.nodes.real)), section.name)
    states = partial(_states, section, mesh, u_0, u_1, psi)
    return SectionModel(section, K, mass_matrix(first), ply_mass, mesh, states)


SHEAR = np.array([0.0, 1.0, 0.0, 0.0])


def strains(mesh: Walls, f: float) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers]:
    """Strains zz, zs and curvatures zz, zs at a fraction of all W walls, from what moves them (B-16 to B-18).

    Returns:
      (W, 4, 6) by beam strains, (W, 4, 2) by warping of the ends, (W, 4, 2) by its derivative along the blade; lengths
      (W,) [m]; points (2, W) [m]; directions n (2, W).
    """
    pairs = np.array([wall.nodes for wall in mesh.walls])
    turn = np.array([wall.curvature for wall in mesh.walls])
    a, b = mesh.nodes[pairs[:, 0]].T, mesh.nodes[pairs[:, 1]].T
    ds = np.sqrt(np.sum((b - a) ** 2, axis=0))
    tx, ty = (b - a) / ds
    x, y = point = a + f * (b - a)
    nx, ny = n = np.stack([ty, -tx])
    SZ, B, SN = (np.zeros((len(pairs), 4, m), dtype=ds.dtype) for m in (6, 2, 2))
    SZ[:, 0, 2], SZ[:, 0, 3], SZ[:, 0, 4] = 1.0, y, -x
    SZ[:, 1, 0], SZ[:, 1, 1], SZ[:, 1, 5] = tx, ty, x * ty - y * tx
    SZ[:, 2, 3], SZ[:, 2, 4] = ny, -nx
    B[:, 1, 0], B[:, 1, 1] = -1.0 / ds, 1.0 / ds
    SN[:, 0] = 1.0 - f, f
    SZ[:, 3] = turn[:, None] * SZ[:, 1]
    SZ[:, 3, 5] += 2.0
    B[:, 3] = turn[:, None] * B[:, 1]
    return SZ, B, SN, ds, point, n


def far_apart(nodes: NDArray[np.float64]) -> NDArray[np.intp]:
    """Three nodes that are not in one line, as far as that is possible."""
    a = int(np.argmin(nodes[:, 1]))
    d = nodes - nodes[a]
    b = int(np.argmax(np.hypot(*d.T)))
    c = int(np.argmax(np.abs(d[:, 0] * d[b, 1] - d[:, 1] * d[b, 0])))
    return np.array([a, b, c])


def _states(section: Section, mesh: Walls, u_0: Numbers, u_1: Numbers, psi: Numbers) -> PlyStates:
    """Plies on both of their faces in the middle of each wall."""
    points = [
        (w, i, depth)
        for w, wall in enumerate(mesh.walls)
        for (i, _), *faces in zip(wall.plies, wall.laminate.faces[:-1], wall.laminate.faces[1:], strict=True)
        for depth in (() if wall.link else faces)
    ]
    wall, ply = np.array([point[:2] for point in points]).T
    depth = np.array([point[2] for point in points])
    SZ, B, SN, _, middle, n = strains(mesh, 0.5)
    pairs = np.array([each.nodes for each in mesh.walls])
    held = SZ @ psi + B @ u_0[pairs] + SN @ u_1[pairs]
    free = np.stack([each.laminate.across for each in mesh.walls]) @ held
    membrane, curvature = (np.stack([held[:, k], free[:, k // 2], held[:, k + 1]], axis=1)[wall] for k in (0, 2))
    materials = [section.materials[each.material] for each in section.plies]
    stiff = np.stack([m.plane @ rotation(p.angle) for m, p in zip(materials, section.plies, strict=True)])
    stress = np.zeros((len(points), 6, 6), dtype=held.dtype)
    stress[:, [0, 1, 5]] = stiff[ply] @ (membrane + depth[:, None, None] * curvature)
    strain = np.stack([material.compliance for material in materials])[ply] @ stress
    return PlyStates(ply, wall, (middle[:, wall] + depth * n[:, wall]).T, strain, stress)
