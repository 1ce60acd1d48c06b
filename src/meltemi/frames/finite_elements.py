"""Finite elements of a frame: Timoshenko beams between joints, cables, springs, rigid links, releases, masses, feet.

Every node has six displacements (x, y, z, and rotations about them, inertial axes). Rigid links, releases and clamped
feet are eliminated: the displacements of all nodes are a linear function of the free coordinates, of which the last six
are the motion of the tower's base, to which the joints of the interface are rigidly connected.

Loads on a frame are either on nodes, (n, 6), or on the ends of elements, (e, 2, 6), which tell to which side of a joint
they belong; section loads are exact with the latter. Both are in inertial axes.

Reference: docs/theory/frames.md (F-1 to F-14).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.checks import TOLERANCE
from meltemi.frames.definition import Foot, Frame, JointMass, Member, Releases
from meltemi.frames.sections import Properties, properties
from meltemi.sea.pile_beam import pile_head
from meltemi.sea.support import Support
from meltemi.structure.beam import shape_functions, transfer
from meltemi.structure.members import rigid_body

Float = NDArray[np.float64]
Int = NDArray[np.int64]

GAUSS_X, GAUSS_W = (
    0.5 * each + shift for each, shift in zip(np.polynomial.legendre.leggauss(4), (0.5, 0.0), strict=True)
)
"""Points and weights along an element of length 1: exact for products of cubic displacements."""
SINGULAR, SHIFT = 1e-12, 1e-14
"""Least eigenvalue of a stiffness matrix scaled to a diagonal of ones, and what makes it regular for the search."""
MOTIONS = ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z")
BASE = "tower base"
PAIR = np.array([[1.0, -1.0], [-1.0, 1.0]])


class Released(NamedTuple):
    """Node of the end of a member at a joint with a release."""

    node: int
    joint: str
    release: Releases


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
      steel, fill, growth: (e,) [kg/m] mass per length of the member, of the liquid inside, and of marine growth.
      properties: sections of beams; None for others.
    """

    member: Int
    nodes: Int
    axes: Float
    length: Float
    stiffness: Float
    mass: Float
    steel: Float
    fill: Float
    growth: Float
    properties: tuple[Properties | None, ...]

    @property
    def beam(self) -> NDArray[np.bool_]:
        """(e,) which are beams."""
        return np.array([section is not None for section in self.properties])

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
      transformation: (6n, f) sparse, displacements of nodes from the free coordinates; the last six are the base's.
      held: (6n, 6c) sparse, displacements of nodes by motions of the c clamped feet.
      clamped: (c,) names of clamped joints.
      sprung: names of feet that are not clamped.
      joint_weight: (n, 6) loads of masses at joints, on nodes, under a gravity of 1 m/s^2.
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
    transformation: Any
    held: Any
    clamped: tuple[str, ...]
    sprung: tuple[str, ...]
    joint_weight: Float

    @property
    def weight(self) -> Float:
        """(e, 2, 6) loads on the elements' ends by the members' mass (steel alone) under a gravity of 1 m/s^2."""
        return self.line_loads(np.outer(self.elements.steel, [0.0, 0.0, -1.0]))

    @property
    def pretension(self) -> Float:
        """(e, 2, 6) loads of cables on their ends as installed."""
        tension = np.array([m.pretension if m.kind == "cable" else 0.0 for m in self.frame.members.values()])
        pull = tension[self.elements.member, None] * self.elements.axes[:, :, 2]
        loads = np.zeros((len(pull), 2, 6))
        loads[:, 0, :3], loads[:, 1, :3] = pull, -pull
        return loads

    def nodal(self, ends: Float) -> Float:
        """(..., n, 6) loads on nodes from loads (..., e, 2, 6) on the elements' ends."""
        n, e = len(self.points), len(self.elements.length)
        at_nodes = scipy.sparse.csr_array(
            (np.ones(2 * e), (self.elements.nodes.reshape(-1), np.arange(2 * e))), (n, 2 * e)
        )
        first = np.moveaxis(ends.reshape(*ends.shape[:-3], 2 * e, 6), -2, 0)
        loads: Float = np.moveaxis((at_nodes @ first.reshape(2 * e, -1)).reshape(n, *first.shape[1:]), 0, -2)
        return loads

    def line_loads(self, force: Float) -> Float:
        """(e, 2, 6) loads on the elements' ends by forces per length (e, 3) [N/m], with fixed-end moments (F-7)."""
        e = self.elements
        loads = np.zeros((len(force), 2, 6))
        loads[:, :, :3] = 0.5 * (e.length[:, None] * force)[:, None]  # cables and rigid links have no fixed ends
        N = _shapes(e.length[e.beam], e.axes[e.beam])[:, :, :3]
        spread = np.einsum("g,e,egji,ej->ei", GAUSS_W, e.length[e.beam], N, force[e.beam], optimize=True)
        loads[e.beam] = spread.reshape(-1, 2, 6)
        return loads

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
      InputError: rigid links connect feet with each other or with the interface.
    """
    feet = {foot.joint: foot for foot in frame.feet} | ({} if clamp is None else {clamp: Foot(joint=clamp)})
    clamped = tuple(name for name, foot in feet.items() if foot.soil is None and foot.stiffness is None)
    links = _links(frame)
    points, member_nodes, released = _nodes(frame, anchored={*links, *feet})
    tops = np.array([frame.joints[name] for name in frame.interface])
    at = tops[0] if len(tops) == 1 else np.array([0.0, 0.0, tops[:, 2].max()])
    points = np.vstack([points, at if base is None else base])
    n, joint = len(points), {name: i for i, name in enumerate(frame.joints)}
    elements = _elements(frame, points, member_nodes)
    springs = [((node, joint[name]), _release_spring(release)) for node, name, release in released]
    grounds = {joint[name]: _ground(frame, foot) for name, foot in feet.items() if name not in clamped}
    masses = [(joint[each.joint], _body(each)) for each in frame.masses]
    ground, ground_mass, ground_damping = (
        _at_nodes([(node, matrices[i]) for node, matrices in grounds.items()], n) for i in range(3)
    )
    K = elements.matrix(elements.stiffness, n) + _at_nodes(springs, n)
    M = elements.matrix(elements.mass, n) + ground_mass + _at_nodes(masses, n)
    T = _constraints(points, joint | {BASE: n - 1}, links, tuple(feet), released)
    fixed = [6 * joint[name] + i for name in clamped for i in range(6)]
    last = [*range(6 * n - 6, 6 * n)]
    # coordinates that nothing resists and nothing moves, as rotations where only cables end, are left out
    used = sum(np.abs(T * (X @ T)).sum(axis=0) for X in (K + ground, M)) > 0.0
    used[fixed] = used[last] = False
    joint_weight = np.zeros((n, 6))
    for node, body in masses:
        joint_weight[node] -= body[:, 2]
    return Assembly(
        frame=frame,
        points=points,
        members=tuple(frame.members),
        elements=elements,
        joint_nodes=joint,
        member_nodes=member_nodes,
        stiffness=K,
        ground=ground,
        ground_damping=ground_damping,
        mass=M,
        transformation=scipy.sparse.csr_array(T[:, [*np.flatnonzero(used), *last]]),
        held=scipy.sparse.csr_array(T[:, fixed]),
        clamped=clamped,
        sprung=tuple(name for name in feet if name not in clamped),
        joint_weight=joint_weight,
    )


# nodes and constraints --------------------------------------------------------------------------


def _links(frame: Frame) -> dict[str, list[str]]:
    """Joints, and the tower's base, to which each is rigidly connected."""
    links: dict[str, list[str]] = {}
    pairs = [member.joints for member in frame.members.values() if member.kind == "rigid"]
    for a, b in [*pairs, *((BASE, name) for name in frame.interface)]:
        links.setdefault(a, []).append(b)
        links.setdefault(b, []).append(a)
    return links


def _nodes(frame: Frame, anchored: set[str]) -> tuple[Float, dict[str, Int], list[Released]]:
    """Nodes of joints, inner ones of members, and those of ends at releases; the members' nodes; and the releases.

    Args:
      anchored: joints whose rotations belong to something else than their beams; at others the first beam has them.
    """
    joint = {name: i for i, name in enumerate(frame.joints)}
    points, held = [*map(np.asarray, frame.joints.values())], set(anchored)
    nodes: dict[str, Int] = {}
    released: list[Released] = []
    for name, member in frame.members.items():
        ends, inner = [joint[each] for each in member.joints], []
        if member.kind == "beam":
            for side, each in enumerate(member.joints):
                if each in frame.releases and each in held:
                    released.append(Released(len(points), each, frame.releases[each]))
                    ends[side] = len(points)
                    points.append(points[joint[each]])
                held.add(each)
            a, b = (points[node] for node in ends)
            inner = [*range(len(points), len(points) + frame.divisions - 1)]
            points += [a + (b - a) * (i / frame.divisions) for i in range(1, frame.divisions)]
        nodes[name] = np.array([ends[0], *inner, ends[1]])
    return np.array(points), nodes, released


def _constraints(
    points: Float, node: dict[str, int], links: dict[str, list[str]], feet: tuple[str, ...], released: list[Released]
) -> Any:
    """(6n, 6n + r) displacements of nodes from those of leaders, and from the r free rotations at releases (F-8, F-9).

    The base leads the interface, a foot what is rigidly connected with it.
    """
    free = [release_directions(each.release) for each in released]
    n, turns = 6 * len(points), sum(each.shape[1] for each in free)
    T = scipy.sparse.eye_array(n, n + turns, format="lil")
    reached: set[str] = set()
    for root in (*feet, BASE, *links):
        queue = [] if root in reached else [root]
        reached.add(root)
        for leader in queue:
            for name in links.get(leader, ()):
                if name in reached:
                    continue
                if root in feet and (name == BASE or name in feet):
                    other = "the interface" if name == BASE else f"the foot {name!r}"
                    raise InputError(f"frame.members: rigid links connect the foot {root!r} with {other}; use a beam")
                reached.add(name)
                queue.append(name)
                arm = transfer(points[node[name]] - points[node[leader]])
                T[_six(node[name])] = arm @ T[_six(node[leader])].toarray()
    column = n
    for each, directions in zip(released, free, strict=True):
        keep, more = np.eye(6), column + directions.shape[1]
        keep[3:, 3:] -= directions @ directions.T
        T[_six(each.node)] = keep @ T[_six(node[each.joint])].toarray()
        T[6 * each.node + 3 : 6 * each.node + 6, column:more] = directions
        column = more
    result = scipy.sparse.csc_array(T)
    result.eliminate_zeros()
    return result


def _six(node: int) -> slice:
    return slice(6 * node, 6 * node + 6)


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
    assert release.axis is not None
    axis = (release.axis / np.linalg.norm(release.axis))[:, None]
    across: Float = np.linalg.svd(axis.T)[2][1:].T
    return axis if release.kind == "pin" else across


def _release_spring(release: Releases) -> Float:
    """(12, 12) stiffness between the end of a member and its joint."""
    k, free = np.zeros((6, 6)), release_directions(release)
    k[3:, 3:] = release.stiffness * free @ free.T
    return np.kron(PAIR, k)


# elements ---------------------------------------------------------------------------------------


def _elements(frame: Frame, points: Float, member_nodes: dict[str, Int]) -> Elements:
    members = list(frame.members.values())
    pairs = [(i, *ends) for i, name in enumerate(frame.members) for ends in pairwise(member_nodes[name].tolist())]
    member, nodes = np.array([p[0] for p in pairs]), np.array([p[1:] for p in pairs])
    chord = points[nodes[:, 1]] - points[nodes[:, 0]]
    length, e = np.linalg.norm(chord, axis=1), len(pairs)
    axes = np.array([member_axes(c, members[i].spin) for c, i in zip(chord, member, strict=True)])
    sections: list[Properties | None] = [None] * e
    stiffness, rotary = np.ones((e, 6)), np.zeros((e, 3))
    steel, fill, growth = (np.array([members[i].line_mass for i in member]), np.zeros(e), np.zeros(e))
    for k, i in enumerate(member.tolist()):
        each = members[i]
        if each.kind == "beam":
            first, last = frame.sections[each.section], frame.sections[each.end_section or each.section]
            inside = k - int(np.searchsorted(member, i))
            p = sections[k] = properties(first, last, (inside + 0.5) / frame.divisions)
            E, G, rho = first.elastic_modulus, first.shear_modulus, first.density
            stiffness[k] = G * p.shear_x, G * p.shear_y, E * p.area, E * p.inertia_x, E * p.inertia_y, G * p.torsion
            rotary[k] = rho * p.inertia_x, rho * p.inertia_y, rho * (p.inertia_x + p.inertia_y)
            steel[k] = rho * p.area
            fill[k], growth[k] = _fill_and_growth(frame, each, p, points[nodes[k], 2])
    beam = np.array([p is not None for p in sections])
    K, M, per_length = np.zeros((e, 12, 12)), np.zeros((e, 12, 12)), np.zeros((e, 6, 6))
    per_length[:, :3, :3] = (steel + fill + growth)[:, None, None] * np.eye(3)
    per_length[:, 3:, 3:] = np.einsum("eij,ej,ekj->eik", axes, rotary, axes)
    K[beam] = _beam_stiffness(stiffness[beam], length[beam], axes[beam])
    # consistent with cubic bending and linear stretch and twist, with rotary inertia (F-6)
    N = _shapes(length[beam], axes[beam])
    M[beam] = np.einsum("g,e,egji,ejk,egkl->eil", GAUSS_W, length[beam], N, per_length[beam], N, optimize=True)
    for k in np.flatnonzero(~beam).tolist():
        K[k], M[k] = _without_section(members[member[k]], float(length[k]), axes[k, :, 2])
    return Elements(member, nodes, axes, length, K, M, steel, fill, growth, tuple(sections))


def _fill_and_growth(frame: Frame, member: Member, section: Properties, heights: Float) -> tuple[float, float]:
    """[kg/m] liquid inside and marine growth, averaged over an element with ends at heights (2,) (F-11)."""
    low, high = float(min(heights)), float(max(heights))

    def share(bottom: float, top: float) -> float:
        if high - low < TOLERANCE:
            return float(bottom <= 0.5 * (low + high) < top)
        return max(min(high, top) - max(low, bottom), 0.0) / (high - low)

    level, density = frame.liquid(member) or (-np.inf, 0.0)
    fill = density * section.hole * (1.0 if level >= high else share(-np.inf, level))
    around = ((g, g.thickness * (section.breadth + g.thickness)) for g in frame.growth)
    return fill, sum(g.density * np.pi * ring * share(g.bottom, g.top) for g, ring in around)


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


def _without_section(member: Member, length: float, z: Float) -> tuple[Float, Float]:
    """(12, 12) stiffness and mass of a spring, or of a cable or a rigid link, which have that of a line (F-11)."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    if member.kind == "spring":
        spring = np.zeros((6, 6)) if member.stiffness is None else np.asarray(member.stiffness)
        return np.kron(PAIR, spring), M
    along, ends = np.outer(z, z), np.array([0, 1, 2, 6, 7, 8])
    if member.kind == "cable":
        assert member.axial_stiffness is not None
        slack = length / (1.0 + member.pretension / member.axial_stiffness)
        K[np.ix_(ends, ends)] = member.axial_stiffness / slack * np.kron(PAIR, along)
    across = np.eye(3) - along
    line = np.kron([[13.0 / 35.0, 9.0 / 70.0], [9.0 / 70.0, 13.0 / 35.0]], across)
    line += np.kron([[1.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0]], along)
    M[np.ix_(ends, ends)] = member.line_mass * length * line
    return K, M


def _body(mass: JointMass) -> Float:
    """(6, 6) inertia of a mass about its joint."""
    xx, yy, zz, xy, xz, yz = np.zeros(6) if mass.inertia is None else mass.inertia
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return rigid_body(mass.mass, np.zeros(3) if mass.centre is None else mass.centre, inertia)


def _ground(frame: Frame, foot: Foot) -> tuple[Float, Float, Float]:
    """Stiffness and mass (6, 6) of the ground under a foot, and its stiffness times twice its damping ratio (F-12)."""
    mass = np.zeros((6, 6)) if foot.mass is None else np.asarray(foot.mass)
    if foot.soil is None:
        return np.asarray(foot.stiffness), mass, np.zeros((6, 6))
    assert foot.pile_section is not None and foot.pile_length is not None
    section = frame.sections[foot.pile_section]
    pile = Support(  # its mudline is 1 m below still water; only what is below the mudline counts
        depth=1.0,
        position=np.array([-1.0 - foot.pile_length, 1.0]),
        diameter=np.full(2, section.breadth),
        thickness=np.full(2, section.thickness or 0.4999 * section.breadth),
        elastic_modulus=section.elastic_modulus,
        shear_modulus=section.shear_modulus,
        density=section.density,
        soil=foot.soil,
        flooded=None,
    )
    stiffness, own, soil = pile_head(pile)
    return stiffness, mass + own, 2.0 * foot.soil.damping * soil


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
    beam, z = e.beam, e.axes[e.beam, :, 2]
    turn = (np.eye(3) - z[:, :, None] * z[:, None])[:, None] @ _shapes(e.length[beam], e.axes[beam])[:, :, 3:]
    K = np.zeros_like(e.stiffness)
    weights = tension[beam] * e.length[beam]
    K[beam] = np.einsum("g,e,egji,egjk->eik", GAUSS_W, weights, turn, turn, optimize=True)
    return e.matrix(K, len(assembly.points))
