"""Finite elements of a frame: Timoshenko beams between joints, cables, springs, rigid links, releases, masses, feet.

Every node has six displacements (x, y, z, and rotations about them, inertial axes). Rigid links, releases and clamped
feet are eliminated: the displacements of all nodes are a linear function of the free coordinates, of which the last six
are the motion of the tower's base, to which the joints of the interface are rigidly connected.

Loads on a frame are either on nodes, (n, 6), or on the ends of elements, (e, 2, 6), which tell to which side of a joint
they belong; section loads are exact with the latter. Both are in inertial axes.

Reference: docs/theory/frames.md (F-1 to F-14).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.definition import TOLERANCE, Foot, Frame, Member, Releases, Section
from meltemi.sea.pile_beam import pile_head
from meltemi.sea.support import Support
from meltemi.structure.beam import shape_functions, transfer
from meltemi.structure.members import rigid_body

Float = NDArray[np.float64]
Int = NDArray[np.int64]

GAUSS_X, GAUSS_W = (np.polynomial.legendre.leggauss(4)[0] + 1.0) / 2.0, np.polynomial.legendre.leggauss(4)[1] / 2.0
"""Points and weights along an element of length 1: exact for products of cubic displacements."""
SINGULAR, SHIFT = 1e-12, 1e-14
"""Least eigenvalue of a stiffness matrix scaled to a diagonal of ones, and what makes it regular for the search."""
MOTIONS = ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z")
BASE = "tower base"


class Properties(NamedTuple):
    """Geometry of a section; areas [m^2], moments [m^4], about the member's axes x and y."""

    area: float
    shear_x: float
    shear_y: float
    inertia_x: float
    inertia_y: float
    torsion: float
    hole: float
    """[m^2] area inside the wall."""
    breadth: float
    """[m] outer diameter, or that of a rod or square with the sides' mean."""


def properties(first: Section, last: Section, x: float) -> Properties:
    """Section at a fraction ``x`` of a member whose dimensions change linearly (F-1 to F-3)."""

    def between(name: str, otherwise: float | None = None) -> float:
        a, b = (getattr(each, name) for each in (first, last))
        if a is None or b is None:
            assert otherwise is not None
            return otherwise
        return float(a + (b - a) * x)

    nu = 0.5 * first.elastic_modulus / first.shear_modulus - 1.0
    if first.kind == "tube":
        d = between("diameter")
        hole = max(d - 2.0 * between("thickness", 0.5 * d), 0.0)
        area, inertia = 0.25 * np.pi * (d**2 - hole**2), np.pi / 64.0 * (d**4 - hole**4)
        shear = area * _shear_of_tube(nu, hole / d)
        return Properties(area, shear, shear, inertia, inertia, 2.0 * inertia, 0.25 * np.pi * hole**2, d)
    if first.kind == "rectangle":
        w, h = between("width"), between("height")
        t = between("thickness", 0.5 * min(w, h))
        a, b = max(w - 2.0 * t, 0.0), max(h - 2.0 * t, 0.0)
        area = w * h - a * b
        shear_x, shear_y = (area * _shear_of_box(nu, *sides) for sides in ((w, h, t, a * b), (h, w, t, a * b)))
        moments = (w * h**3 - a * b**3) / 12.0, (h * w**3 - b * a**3) / 12.0
        long, short = max(w, h), min(w, h)
        torsion = long * short**3 * (1.0 / 3.0 - 0.21 * short / long * (1.0 - (short / long) ** 4 / 12.0))
        if a * b > 0.0:
            torsion = 2.0 * t * (w - t) ** 2 * (h - t) ** 2 / (w + h - 2.0 * t)
        return Properties(area, shear_x, shear_y, *moments, torsion, a * b, 0.5 * (w + h))
    area = between("area")
    x_area, y_area = (between(name, 5.0 / 6.0 * area) for name in ("shear_area_x", "shear_area_y"))
    rest = (between(name) for name in ("inertia_x", "inertia_y", "torsion"))
    return Properties(area, x_area, y_area, *rest, 0.0, first.breadth)


def _shear_of_tube(nu: float, r: float) -> float:
    """Share of a tube's area that carries shear, by Poisson's ratio and inner over outer diameter (Steinboeck 2013)."""
    a = (1.0 + r * r) ** 2
    return (
        6.0 * (1.0 + nu) ** 2 * a / (a * (7.0 + 14.0 * nu + 8.0 * nu**2) + 4.0 * r**2 * (5.0 + 10.0 * nu + 4 * nu**2))
    )


def _shear_of_box(nu: float, height: float, width: float, t: float, inner: float) -> float:
    """That of a rectangle under shear along ``height``: solid, or a box of thin walls (Cowper 1966)."""
    if inner == 0.0:
        return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
    m = n = (width - t) / (height - t)
    webs = 12.0 + 72.0 * m + 150.0 * m**2 + 90.0 * m**3 + nu * (11.0 + 66.0 * m + 135.0 * m**2 + 90.0 * m**3)
    flanges = 10.0 * n**2 * ((3.0 + nu) * m + 3.0 * m**2)
    return 10.0 * (1.0 + nu) * (1.0 + 3.0 * m) ** 2 / (webs + flanges)


@dataclass(frozen=True)
class Elements:
    """Elements of beams (``divisions`` each), cables, rigid links and springs (one each), in the members' order.

    Attributes:
      member: (e,) index of the member.
      nodes: (e, 2) its nodes.
      axes: (e, 3, 3) columns are the member's x, y, z in inertial axes.
      length: (e,) [m].
      stiffness: (e, 12, 12) of the displacements of both nodes.
      mass: (e, 12, 12) with water inside and growth; without the water around.
      water: (e, 12, 12) added mass of still water around it.
      steel: (e,) [kg/m] mass per length of the member, of water inside, and of marine growth.
      fill: (e,) [kg/m].
      growth: (e,) [kg/m].
      properties: sections of beams; None for others.
    """

    member: Int
    nodes: Int
    axes: Float
    length: Float
    stiffness: Float
    mass: Float
    water: Float
    steel: Float
    fill: Float
    growth: Float
    properties: tuple[Properties | None, ...]

    @property
    def flat(self) -> Int:
        """(e, 12) indices of the elements' displacements in those of all nodes, (6n,)."""
        result: Int = (6 * self.nodes[:, :, None] + np.arange(6)).reshape(-1, 12)
        return result

    def matrix(self, blocks: Float, nodes: int) -> Any:
        """(6n, 6n) sparse sum of the elements' (e, 12, 12) matrices."""
        rows, columns = np.repeat(self.flat, 12, axis=1).reshape(-1), np.tile(self.flat, (1, 12)).reshape(-1)
        return scipy.sparse.csr_array((blocks.reshape(-1), (rows, columns)), shape=(6 * nodes, 6 * nodes))

    def at(self, element: Int, x: Float) -> Float:
        """(p, 6, 12) motion of points at fractions ``x`` (p,) of some elements by the displacements of their nodes.

        Its transpose makes loads on a point into loads on the elements' ends.
        """
        chord = self.length[element, None] * self.axes[element, :, 2]
        result: Float = shape_functions(x, chord)
        return result


@dataclass(frozen=True)
class Assembly:
    """Finite elements of a frame.

    Attributes:
      frame: its description.
      points: (n, 3) [m] nodes; the last is the tower's base.
      members: (m,) names.
      elements: the elements.
      joint_nodes: node of each joint.
      member_nodes: nodes of each member from its first joint to its second; at a release its end has a node of its own.
      stiffness: (6n, 6n) sparse, of elements, and springs of releases; without the ground.
      ground: (6n, 6n) sparse stiffness of the ground at feet that are not clamped.
      ground_damping: (6n, 6n) sparse damping of the ground times frequency, 2 zeta times its stiffness.
      mass: (6n, 6n) sparse, with water inside and growth; without the water around.
      water: (6n, 6n) sparse added mass of still water around the members.
      transformation: (6n, f) sparse, displacements of nodes from the free coordinates; the last six are the base's.
      held: (6n, 6c) sparse, displacements of nodes by motions of the c clamped feet.
      clamped: (c,) names of clamped joints.
      sprung: names of feet that are not clamped.
      weight: (e, 2, 6) loads on the elements' ends by the members' mass (steel alone) under a gravity of 1 m/s^2.
      joint_weight: (n, 6) those of masses at joints, on nodes.
      pretension: (e, 2, 6) loads of cables on their ends as installed.
    """

    frame: Frame
    points: Float
    members: tuple[str, ...]
    elements: Elements
    joint_nodes: dict[str, int]
    member_nodes: dict[str, Int]
    stiffness: Any
    ground: Any
    ground_damping: Any
    mass: Any
    water: Any
    transformation: Any
    held: Any
    clamped: tuple[str, ...]
    sprung: tuple[str, ...]
    weight: Float
    joint_weight: Float
    pretension: Float

    def nodal(self, ends: Float) -> Float:
        """(..., n, 6) loads on nodes from loads (..., e, 2, 6) on the elements' ends."""
        loads = np.zeros((*ends.shape[:-3], len(self.points), 6))
        for side in (0, 1):
            np.add.at(loads, (..., self.elements.nodes[:, side], slice(None)), ends[..., side, :])
        return loads

    def line_loads(self, force: Float) -> Float:
        """(e, 2, 6) loads on the elements' ends by forces per length (e, 3) [N/m], with fixed-end moments (F-7)."""
        return _line_loads(self.elements, force)

    def inertia(self, shapes: Float) -> Float:
        """(..., e, 2, 6) mass times acceleration (..., n, 6) of nodes; its negative is the load of inertia."""
        ends = shapes[..., self.elements.nodes, :]
        result: Float = np.einsum("eij,...ej->...ei", self.elements.mass, ends.reshape(*ends.shape[:-2], 12))
        return result.reshape(ends.shape)

    @property
    def free(self) -> Any:
        """(f, f) sparse stiffness of the free coordinates, with the ground."""
        T = self.transformation
        return scipy.sparse.csc_array(T.T @ (self.stiffness + self.ground) @ T)

    def solver(self, *, base: bool = False) -> Any:
        """Factors of the stiffness of the free coordinates; with ``base`` held the last six are left out.

        Raises:
          InputError: the frame is a mechanism; the message names a joint.
        """
        K = self.free
        K = K[:-6, :-6] if base else K
        diagonal = K.diagonal()
        D = scipy.sparse.diags_array(1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
        scaled = scipy.sparse.csc_array(D @ K @ D)
        try:
            shifted = scipy.sparse.linalg.splu(scaled + SHIFT * scipy.sparse.eye_array(K.shape[0], format="csc"))
            x = np.cos(np.arange(K.shape[0]))
            for _ in range(3):
                x = shifted.solve(x)
                x /= np.linalg.norm(x)
            least = float(x @ (scaled @ x))
        except RuntimeError:  # exactly singular
            least, x = 0.0, np.linalg.eigh(scaled.toarray())[1][:, 0]
        if least < SINGULAR:
            raise InputError(self._mechanism(D @ x))
        return scipy.sparse.linalg.splu(scipy.sparse.csc_array(K))

    def _mechanism(self, x: Float) -> str:
        moved = (self.transformation[:, : len(x)] @ x).reshape(-1, 6)
        scale = np.ptp(self.points, axis=0).max()
        size = np.abs(moved) * np.repeat([1.0, scale], 3)
        at = {node: f"frame.joints.{name}" for name, node in self.joint_nodes.items()}
        for name, nodes in self.member_nodes.items():
            at |= {int(node): f"frame.members.{name}" for node in nodes if int(node) not in at}
        node, motion = np.unravel_index(np.argmax(size), size.shape)
        place = at.get(int(node), BASE)
        return (
            f"{place}: the frame is a mechanism: it can {MOTIONS[motion]} there without resistance; "
            "add a member or a foot, or remove a release"
        )


def assemble(frame: Frame, base: Float | None = None, clamp: str | None = None) -> Assembly:
    """Finite elements of a frame.

    Args:
      base: (3,) [m] the tower's base; by default on the tower's axis at the height of the interface, or at its only
        joint.
      clamp: a joint that is clamped in place of feet, which a frame that floats does not have.

    Raises:
      InputError: rigid links connect feet with each other or with the interface, or a pile's section is not a tube.
    """
    return _Assembler(frame, base, clamp).result()


class _Assembler:
    """Nodes, elements and constraints of a frame in the order in which they depend on each other."""

    def __init__(self, frame: Frame, base: Float | None, clamp: str | None) -> None:
        self.frame = frame
        self.points = [np.asarray(place, float) for place in frame.joints.values()]
        self.joint = {name: i for i, name in enumerate(frame.joints)}
        self.feet = {} if clamp is None else {clamp: Foot(joint=clamp)}
        self.feet |= {foot.joint: foot for foot in frame.feet}
        tops = np.array([frame.joints[name] for name in frame.interface])
        at = tops[0] if len(tops) == 1 else np.array([0.0, 0.0, tops[:, 2].max()])
        self.links: dict[str, list[str]] = {name: [] for name in (*frame.joints, BASE)}
        pairs = [m.joints for m in frame.members.values() if m.kind == "rigid"]
        for a, b in [*pairs, *((BASE, name) for name in frame.interface)]:
            self.links[a].append(b)
            self.links[b].append(a)
        self.released: list[tuple[int, str, Releases]] = []
        self.member_nodes = self._nodes_of_members()
        self.joint[BASE] = len(self.points)
        self.points.append(at if base is None else np.asarray(base, float))

    def _nodes_of_members(self) -> dict[str, Int]:
        frame, used = self.frame, set()
        anchored = {name for name, others in self.links.items() if others} | set(self.feet)
        result = {}
        for name, member in frame.members.items():
            ends = [self.joint[joint] for joint in member.joints]
            inner: list[int] = []
            if member.kind == "beam":
                for side, joint in enumerate(member.joints):
                    # the first beam holds the joint's rotations, unless something else does
                    if joint in frame.releases and (joint in anchored or joint in used):
                        self.released.append((len(self.points), joint, frame.releases[joint]))
                        ends[side] = len(self.points)
                        self.points.append(self.points[self.joint[joint]])
                    used.add(joint)
                a, b = (self.points[node] for node in ends)
                for i in range(1, frame.divisions):
                    inner.append(len(self.points))
                    self.points.append(a + (b - a) * (i / frame.divisions))
            result[name] = np.array([ends[0], *inner, ends[1]])
        return result

    def result(self) -> Assembly:
        frame, points = self.frame, np.array(self.points)
        n = len(points)
        elements = self._elements(points)
        K, M = elements.matrix(elements.stiffness, n), elements.matrix(elements.mass, n)
        K = scipy.sparse.csr_array(K + self._release_springs(n))
        ground, ground_mass, damping = self._ground(n)
        masses = [(self.joint[each.joint], _body(each)) for each in frame.masses]
        M = scipy.sparse.csr_array(M + ground_mass + _at_nodes(masses, n))
        joint_weight = np.zeros((n, 6))
        for node, body in masses:
            joint_weight[node] -= body[:, 2]
        T, held, clamped = self._transformation(K + ground, M, points)
        down = np.outer(elements.steel, [0.0, 0.0, -1.0])
        return Assembly(
            frame=frame,
            points=points,
            members=tuple(frame.members),
            elements=elements,
            joint_nodes={name: node for name, node in self.joint.items() if name != BASE},
            member_nodes=self.member_nodes,
            stiffness=K,
            ground=ground,
            ground_damping=damping,
            mass=M,
            water=elements.matrix(elements.water, n),
            transformation=T,
            held=held,
            clamped=clamped,
            sprung=tuple(name for name in self.feet if name not in clamped),
            weight=_line_loads(elements, down),
            joint_weight=joint_weight,
            pretension=self._pretension(elements),
        )

    # elements -------------------------------------------------------------------------------------

    def _elements(self, points: Float) -> Elements:
        frame = self.frame
        members, names = list(frame.members.values()), list(frame.members)
        pairs = [(i, a, b) for i, name in enumerate(names) for a, b in pairwise(self.member_nodes[name].tolist())]
        member, nodes = np.array([p[0] for p in pairs]), np.array([p[1:] for p in pairs])
        chord = points[nodes[:, 1]] - points[nodes[:, 0]]
        length = np.linalg.norm(chord, axis=1)
        axes = np.array([member_axes(c, members[i].spin) for c, i in zip(chord, member, strict=True)])
        e = len(pairs)
        section = np.ones((e, 6))
        rotary, steel, fill, growth, added = (np.zeros(shape) for shape in ((e, 3), e, e, e, e))
        made: list[Properties | None] = [None] * e
        for k, i in enumerate(member):
            each, inside = members[i], k - int(np.searchsorted(member, i))
            steel[k] = each.line_mass
            if each.kind != "beam":
                continue
            first = frame.sections[each.section]
            last = frame.sections[each.end_section or each.section]
            p = made[k] = properties(first, last, (inside + 0.5) / frame.divisions)
            E, G, density = first.elastic_modulus, first.shear_modulus, first.density
            section[k] = G * p.shear_x, G * p.shear_y, E * p.area, E * p.inertia_x, E * p.inertia_y, G * p.torsion
            rotary[k] = density * p.inertia_x, density * p.inertia_y, density * (p.inertia_x + p.inertia_y)
            steel[k] = density * p.area
            heights = points[nodes[k], 2]
            fill[k], growth[k], added[k] = water_masses(frame, each, p, heights)
        beam = np.array([p is not None for p in made])
        K, M, W = (np.zeros((e, 12, 12)) for _ in range(3))
        K[beam] = _beam_stiffness(section[beam], length[beam], axes[beam])
        moving = np.zeros((e, 6, 6))
        moving[:, :3, :3] = (steel + fill + growth)[:, None, None] * np.eye(3)
        moving[:, 3:, 3:] = np.einsum("eij,ej,ekj->eik", axes, rotary, axes)
        around = np.zeros((e, 6, 6))
        around[:, :3, :3] = added[:, None, None] * (np.eye(3) - _along(axes))
        for matrix, per_length in ((M, moving), (W, around)):
            matrix[beam] = _consistent(per_length[beam], length[beam], axes[beam])
        for k in np.flatnonzero(~beam):
            each = members[member[k]]
            K[k], M[k] = _simple(each, float(length[k]), axes[k, :, 2])
        return Elements(member, nodes, axes, length, K, M, W, steel, fill, growth, tuple(made))

    def _pretension(self, elements: Elements) -> Float:
        tension = np.array([each.pretension if each.kind == "cable" else 0.0 for each in self.frame.members.values()])
        loads = np.zeros((len(elements.member), 2, 6))
        loads[:, 0, :3] = tension[elements.member, None] * elements.axes[:, :, 2]
        loads[:, 1] = -loads[:, 0]
        return loads

    # springs and the ground -----------------------------------------------------------------------

    def _release_springs(self, n: int) -> Any:
        total = scipy.sparse.csr_array((6 * n, 6 * n))
        for node, joint, release in self.released:
            if release.stiffness:
                free = release_directions(release)
                k = np.zeros((6, 6))
                k[3:, 3:] = release.stiffness * free @ free.T
                total = total + _at_nodes([((node, self.joint[joint]), np.kron([[1.0, -1.0], [-1.0, 1.0]], k))], n)
        return total

    def _ground(self, n: int) -> tuple[Any, Any, Any]:
        """Stiffness, mass, and stiffness times twice the damping ratio, of feet that are not clamped."""
        parts: list[list[tuple[int, Float]]] = [[], [], []]
        for name, foot in self.feet.items():
            node, damping = self.joint[name], np.zeros((6, 6))
            if foot.soil is not None:
                stiffness, mass, soil = self._pile(foot)
                damping = 2.0 * foot.soil.damping * soil
            elif foot.stiffness is not None:
                stiffness, mass = np.asarray(foot.stiffness), np.zeros((6, 6))
            else:
                continue
            mass = mass if foot.mass is None else mass + foot.mass
            for part, block in zip(parts, (stiffness, mass, damping), strict=True):
                part.append((node, block))
        return _at_nodes(parts[0], n), _at_nodes(parts[1], n), _at_nodes(parts[2], n)

    def _pile(self, foot: Foot) -> tuple[Float, Float, Float]:
        """Stiffness and mass (6, 6) of a pile at its head, and the soil's share of the stiffness (F-12)."""
        section = self.frame.sections.get(foot.pile_section or "")
        if section is None or section.kind != "tube" or foot.pile_length is None:
            raise InputError(
                f"frame.feet: the foot at joint {foot.joint!r} has soil and needs pile_length and pile_section, a tube"
            )
        wall = section.thickness or 0.4999 * section.breadth
        pile = Support(  # its mudline is 1 m below still water; only what is below the mudline counts
            depth=1.0,
            position=[-1.0 - foot.pile_length, 1.0],
            diameter=[section.breadth] * 2,
            thickness=[wall] * 2,
            elastic_modulus=section.elastic_modulus,
            shear_modulus=section.shear_modulus,
            density=section.density,
            soil=foot.soil,
            flooded=None,
        )
        return pile_head(pile)

    # constraints ----------------------------------------------------------------------------------

    def _transformation(self, K: Any, M: Any, points: Float) -> tuple[Any, Any, tuple[str, ...]]:
        """Displacements of nodes from the free coordinates and from motions of clamped feet (F-8 to F-10)."""
        n, joints = len(points), {node: name for name, node in self.joint.items()}
        clamped = tuple(name for name, foot in self.feet.items() if foot.soil is None and foot.stiffness is None)
        rows: dict[int, dict[int, Float]] = {}  # per node, what follows from blocks of coordinates
        copies = {node for node, *_ in self.released}
        roots = [self.joint[name] for name in (*self.feet, BASE)]
        roots += [node for node in range(n) if node not in copies and node not in roots]
        for root in roots:
            if root in rows:
                continue
            rows[root] = {6 * root: np.eye(6)}
            queue = deque([root] if root in joints else [])
            while queue:
                leader = queue.popleft()
                for name in self.links[joints[leader]]:
                    node = self.joint[name]
                    if node in rows:
                        continue
                    if joints[root] in self.feet and (name == BASE or name in self.feet):
                        raise InputError(
                            f"frame.members: rigid links connect the foot {joints[root]!r} with "
                            f"{'the interface' if name == BASE else f'the foot {name!r}'}; use a beam"
                        )
                    A = transfer(points[node] - points[leader])
                    rows[node] = {column: A @ block for column, block in rows[leader].items()}
                    queue.append(node)
        columns = 6 * n
        for node, joint, release in self.released:
            free = release_directions(release)
            keep, turn = np.eye(6), np.zeros((6, free.shape[1]))
            keep[3:, 3:] -= free @ free.T
            turn[3:] = free
            rows[node] = {column: keep @ block for column, block in rows[self.joint[joint]].items()}
            rows[node][columns] = turn
            columns += free.shape[1]
        T = scipy.sparse.lil_array((6 * n, columns))
        for node, blocks in rows.items():
            for column, block in blocks.items():
                T[6 * node : 6 * node + 6, column : column + block.shape[1]] = block
        T = scipy.sparse.csc_array(T)
        fixed = np.concatenate([np.zeros(0, int), *(6 * self.joint[name] + np.arange(6) for name in clamped)])
        base = 6 * self.joint[BASE] + np.arange(6)
        # coordinates that nothing resists and nothing moves, as rotations where only cables end, are left out
        diagonals = [np.abs((T * (X @ T)).sum(axis=0)) for X in (K, M)]
        used = diagonals[0] + diagonals[1] > 0.0
        used[fixed] = used[base] = False
        order = np.concatenate([np.flatnonzero(used), base])
        return scipy.sparse.csr_array(T[:, order]), scipy.sparse.csr_array(T[:, fixed]), clamped


def member_axes(chord: Float, spin: float = 0.0) -> Float:
    """(3, 3) axes x (horizontal), y, z (along) of a member as columns; those of an upright one are inertial (F-4)."""
    length, across = float(np.linalg.norm(chord)), float(np.hypot(chord[0], chord[1]))
    if across <= 1e-9 * max(length, TOLERANCE):
        axes = np.eye(3) if chord[2] >= 0.0 else np.diag([1.0, -1.0, -1.0])
    else:
        z = chord / length
        x = np.array([chord[1], -chord[0], 0.0]) / across
        axes = np.stack([x, np.cross(z, x), z], axis=1)
    c, s = np.cos(spin), np.sin(spin)
    result: Float = axes @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return result


def release_directions(release: Releases) -> Float:
    """(3, q) directions about which the end of a member turns freely."""
    if release.kind == "ball":
        return np.eye(3)
    axis = np.array([0.0, 1.0, 0.0]) if release.axis is None else np.asarray(release.axis, float)
    axis = axis / np.linalg.norm(axis)
    if release.kind == "pin":
        return axis[:, None]
    across: Float = np.linalg.svd(axis[None])[2][1:].T
    return across


def water_masses(frame: Frame, member: Member, section: Properties, heights: Float) -> tuple[float, float, float]:
    """[kg/m] water inside, marine growth, and added mass of still water, averaged over an element.

    Args:
      heights: (2,) [m] heights of its ends.
    """

    def share(bottom: float, top: float) -> float:
        low, high = float(min(heights)), float(max(heights))
        if high - low < TOLERANCE:
            return float(bottom <= 0.5 * (low + high) < top)
        return max(min(high, top) - max(low, bottom), 0.0) / (high - low)

    level = 0.0 if member.flooded and member.filled_to is None else member.filled_to
    density = frame.water_density if member.flooded else member.fill_density
    fill = 0.0 if level is None else density * section.hole * share(-np.inf, level)
    growth, d = 0.0, section.breadth
    coefficients = (
        frame.hydrodynamics if member.hydrodynamics is None else frame.other_hydrodynamics[member.hydrodynamics]
    )
    bare, added = share(-frame.depth - TOLERANCE, 0.0), 0.0
    for layer in frame.growth:
        covered, t = share(layer.bottom, layer.top), layer.thickness
        growth += layer.density * np.pi * (d + t) * t * covered
        wet = share(max(layer.bottom, -frame.depth), min(layer.top, 0.0)) if layer.bottom < 0.0 else 0.0
        grown = coefficients.added_mass if coefficients.grown_added_mass is None else coefficients.grown_added_mass
        added += grown * (d + 2.0 * t) ** 2 * wet
        bare -= wet
    added += coefficients.added_mass * d**2 * max(bare, 0.0)
    return fill, growth, 0.0 if member.potential_flow else 0.25 * np.pi * frame.water_density * added


def _along(axes: Float) -> Float:
    result: Float = axes[:, :, 2, None] * axes[:, None, :, 2]
    return result


def _beam_stiffness(section: Float, length: Float, axes: Float) -> Float:
    """(e, 12, 12) stiffness of uniform beams from their flexibility (F-5); sections (e, 6) in members' axes."""
    e = len(length)
    beyond = np.zeros((e, 4, 3))
    beyond[:, :, 2] = np.outer(length, 1.0 - GAUSS_X)
    B = transfer(beyond).swapaxes(-1, -2)
    flexibility = np.einsum("g,e,egij,ei,egik->ejk", GAUSS_W, length, B, 1.0 / section, B)
    bent = np.zeros((e, 6, 12))
    along = np.zeros((e, 3))
    along[:, 2] = length
    bent[:, :, :6], bent[:, :, 6:] = -transfer(along), np.eye(6)
    Q = np.zeros((e, 12, 12))
    for i in range(0, 12, 3):
        Q[:, i : i + 3, i : i + 3] = axes
    bent = bent @ Q.swapaxes(1, 2)
    K: Float = bent.swapaxes(1, 2) @ np.linalg.solve(flexibility, bent)
    return 0.5 * (K + K.swapaxes(1, 2))


def _shapes(length: Float, axes: Float) -> Float:
    """(e, 4, 6, 12) motion of the Gauss points of elements by that of their nodes."""
    chord = np.repeat(length[:, None] * axes[:, :, 2], 4, axis=0)
    return shape_functions(np.tile(GAUSS_X, len(length)), chord).reshape(-1, 4, 6, 12)


def _consistent(per_length: Float, length: Float, axes: Float) -> Float:
    """(e, 12, 12) mass consistent with cubic bending and linear stretch and twist, with rotary inertia (F-6)."""
    N = _shapes(length, axes)
    result: Float = np.einsum("g,e,egji,ejk,egkl->eil", GAUSS_W, length, N, per_length, N, optimize=True)
    return result


def _line_loads(elements: Elements, force: Float) -> Float:
    """(e, 2, 6) as :meth:`Assembly.line_loads`; cables and rigid links have half of the force at each end."""
    loads = np.zeros((len(force), 2, 6))
    loads[:, :, :3] = 0.5 * (elements.length[:, None] * force)[:, None]
    beam = np.array([p is not None for p in elements.properties])
    N = _shapes(elements.length[beam], elements.axes[beam])[:, :, :3]
    spread = np.einsum("g,e,egji,ej->ei", GAUSS_W, elements.length[beam], N, force[beam], optimize=True)
    loads[beam] = spread.reshape(-1, 2, 6)
    return loads


def _simple(member: Member, length: float, z: Float) -> tuple[Float, Float]:
    """(12, 12) stiffness and mass of a spring, or of a cable or a rigid link, which have that of a line (F-11)."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    if member.kind == "spring":
        spring = np.zeros((6, 6)) if member.stiffness is None else np.asarray(member.stiffness)
        return np.kron([[1.0, -1.0], [-1.0, 1.0]], spring), M
    along, ends = np.outer(z, z), np.array([0, 1, 2, 6, 7, 8])
    if member.kind == "cable":
        assert member.axial_stiffness is not None
        slack = length / (1.0 + member.pretension / member.axial_stiffness)
        K[np.ix_(ends, ends)] = member.axial_stiffness / slack * np.kron([[1.0, -1.0], [-1.0, 1.0]], along)
    across = np.eye(3) - along
    line = np.kron([[13.0 / 35.0, 9.0 / 70.0], [9.0 / 70.0, 13.0 / 35.0]], across)
    line += np.kron([[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]], along)
    M[np.ix_(ends, ends)] = member.line_mass * length * line
    return K, M


def _body(mass: Any) -> Float:
    """(6, 6) inertia of a mass about its joint."""
    xx, yy, zz, xy, xz, yz = np.zeros(6) if mass.inertia is None else mass.inertia
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return rigid_body(mass.mass, np.zeros(3) if mass.centre is None else mass.centre, inertia)


def _at_nodes(blocks: list[tuple[Any, Float]], n: int) -> Any:
    """(6n, 6n) sparse matrix of blocks (6, 6) of a node, or (12, 12) of two."""
    total = scipy.sparse.lil_array((6 * n, 6 * n))
    for nodes, block in blocks:
        at = (6 * np.atleast_1d(nodes)[:, None] + np.arange(6)).reshape(-1)
        total[np.ix_(at, at)] = total[np.ix_(at, at)].toarray() + block
    return scipy.sparse.csr_array(total)


def geometric_stiffness(assembly: Assembly, loads: Float) -> Any:
    """(6n, 6n) sparse stiffness by the axial forces under static loads (n, 6) on nodes (F-14)."""
    T, e = assembly.transformation, assembly.elements
    moved = (T @ assembly.solver().solve(T.T @ loads.reshape(-1))).reshape(-1, 6)
    ends = moved[e.nodes].reshape(-1, 12)
    force = np.einsum("eij,ej->ei", e.stiffness, ends)
    tension = np.einsum("ei,ei->e", force[:, 6:9] - force[:, :3], e.axes[:, :, 2]) / 2.0
    beam = np.array([p is not None for p in e.properties])
    turn = (np.eye(3) - _along(e.axes[beam]))[:, None] @ _shapes(e.length[beam], e.axes[beam])[:, :, 3:]
    K = np.zeros_like(e.stiffness)
    weights = tension[beam] * e.length[beam]
    K[beam] = np.einsum("g,e,egji,egjk->eik", GAUSS_W, weights, turn, turn, optimize=True)
    return e.matrix(K, len(assembly.points))
