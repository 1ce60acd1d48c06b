"""Finite elements of a beam with general 6 x 6 sections, and their natural modes.

The element is derived from equilibrium: between two nodes the internal force is constant and the internal moment linear
for any section, so statics are exact except for the quadrature, there is no locking, coupling of any kind (bend-twist,
extension-twist, offsets) is included, and shear flexibility may be zero. The mass matrix is consistent with cubic
bending and linear stretch and twist.

Generalised displacements of a node are (u_x, u_y, u_z, theta_x, theta_y, theta_z); section matrices
relate forces and moments (F, M) to strains and curvatures in the same order.

Reference: docs/theory/structure.md (S-1 to S-9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

Float = NDArray[np.float64]

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(3)


def skew(v: Float) -> Float:
    """(..., 3, 3) matrix of the cross product: skew(a) b = a x b."""
    S = np.zeros((*v.shape, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -z, y, -x
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = z, -y, x
    return S


def transfer(offset: Float) -> Float:
    """(..., 6, 6) matrix from the motion of a rigid body's reference point to that of its point at ``offset``."""
    T = np.zeros((*offset.shape[:-1], 6, 6))
    T[..., :3, :3] = T[..., 3:, 3:] = np.eye(3)
    T[..., :3, 3:] = -skew(offset)
    return T


def sums(weights: Float, A: Float, T: Float) -> Float:
    """(m, k, k) sums of T^T A T over quadrature points: ``weights`` (n, m), ``A`` (n, l, l), ``T`` (n, l, k)."""
    return np.tensordot(weights.T, T.transpose(0, 2, 1) @ A @ T, 1)


@dataclass(frozen=True)
class Beam:
    """A beam described by sections, linear between stations.

    Attributes:
      position: (S,) [m] coordinate of the stations along the z axis, increasing.
      axis: (S, 3) [m] points of the beam's reference axis.
      stiffness: (S, 6, 6) section stiffness in the axes of the whole beam.
      mass: (S, 6, 6) section mass per length about the reference axis, in the same axes.
    """

    position: Float
    axis: Float
    stiffness: Float
    mass: Float

    def at(self, z: Float, field: str) -> Float:
        """Values of ``axis``, ``stiffness`` or ``mass`` at coordinates ``z`` (n,)."""
        values = getattr(self, field)
        i = np.clip(np.searchsorted(self.position, z, side="right") - 1, 0, len(self.position) - 2)
        w = (z - self.position[i]) / (self.position[i + 1] - self.position[i])
        w = w.reshape(-1, *([1] * (values.ndim - 1)))
        result: Float = (1.0 - w) * values[i] + w * values[i + 1]
        return result

    def pieces(self, edges: Float) -> tuple[Float, Float]:
        """Quadrature points and weights (arc length) over consecutive intervals, split at the stations.

        Returns:
          z: (n, 1) points; weights: (n, m) with one column per interval between ``edges`` (m + 1,).
        """
        cuts = np.unique(
            np.concatenate([edges, self.position[(self.position > edges[0]) & (self.position < edges[-1])]])
        )
        half = 0.5 * np.diff(cuts)
        z = (0.5 * (cuts[1:] + cuts[:-1])[:, None] + half[:, None] * GAUSS_X).reshape(-1)
        stretch = np.linalg.norm(np.diff(self.at(cuts, "axis"), axis=0), axis=1) / np.diff(cuts)
        w = (half[:, None] * GAUSS_W * stretch[:, None]).reshape(-1)
        owner = np.clip(np.searchsorted(edges, z) - 1, 0, len(edges) - 2)
        weights = np.zeros((len(z), len(edges) - 1))
        weights[np.arange(len(z)), owner] = w
        return z, weights

    def rigid_pieces(self, edges: Float, nodes: Float) -> Float:
        """Inertia of the beam cut at ``edges`` (n + 1,), each piece rigid and moving with its node.

        Args:
          edges: [m] coordinates of the cuts.
          nodes: (n, 3) [m] reference points of the pieces.

        Returns:
          (n, 6, 6) mass matrices of the pieces about their nodes.
        """
        z, weights = self.pieces(edges)
        return sums(weights, self.at(z, "mass"), transfer(self.at(z, "axis") - nodes[weights.argmax(axis=1)]))


def section_axes(twist: Float, tangent: Float) -> Float:
    """(S, 6, 6) rotation of section quantities into the axes of the whole beam (S-1).

    Args:
      twist: (S,) [rad] rotation of the sections about the beam's axis, towards feather.
      tangent: (S, 3) along the beam's axis, of any length; the z axis of a section is the tangent, reached from the
        z axis of the whole beam by the shortest rotation.
    """
    c, s, o, one = np.cos(twist), np.sin(twist), np.zeros_like(twist), np.ones_like(twist)
    # twist is a rotation by -twist about z (docs/conventions.md)
    R = np.stack([np.stack([c, s, o], -1), np.stack([-s, c, o], -1), np.stack([o, o, one], -1)], -2)
    t = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    turn = skew(np.cross(np.array([0.0, 0.0, 1.0]), t))
    R = (np.eye(3) + turn + turn @ turn / (1.0 + t[:, 2])[:, None, None]) @ R
    Q = np.zeros((len(twist), 6, 6))
    Q[:, :3, :3] = Q[:, 3:, 3:] = R
    return Q


def section_mass(m: Float, centre: Float, inertia: Float) -> Float:
    """(S, 6, 6) mass per length about the reference axis.

    Args:
      m: (S,) [kg/m] mass per length.
      centre: (S, 3) [m] centre of mass from the reference axis.
      inertia: (S, 3) [kg m] inertia about x, y, z through the centre of mass.
    """
    M = np.zeros((len(m), 6, 6))
    M[:, :3, :3] = m[:, None, None] * np.eye(3)
    M[:, 3:, 3:] = np.einsum("si,ij->sij", inertia, np.eye(3))
    T = transfer(centre)
    result: Float = T.transpose(0, 2, 1) @ M @ T
    return result


@dataclass(frozen=True)
class Mesh:
    """Assembled finite elements of a beam, clamped at its first node.

    Attributes:
      z: (n,) [m] coordinates of the nodes.
      points: (n, 3) [m] nodes.
      flexibility: (6n, 6n - 6) factor G: loads f on the nodes displace them by G G^T f.
      mass: (6n, 6n) mass matrix.
    """

    z: Float
    points: Float
    flexibility: Float
    mass: Float


def assemble(beam: Beam, z: Float) -> Mesh:
    """Finite elements between nodes at ``z`` (n,) [m], which begin and end with the beam."""
    n = len(z)
    points = beam.at(z, "axis")
    q, weights = beam.pieces(z)
    e = weights.argmax(axis=1)
    compliance, section = np.asarray(np.linalg.inv(beam.at(q, "stiffness")), float), beam.at(q, "mass")
    # internal wrench at the quadrature points from the wrench at the element's end
    B = transfer(points[e + 1] - beam.at(q, "axis")).transpose(0, 2, 1)
    root = np.asarray(np.linalg.cholesky(sums(weights, compliance, B)), float)
    # the part beyond an element moves with its end
    G = _carried(points, points[1:], root) * np.kron(np.tri(n, n - 1, -1), np.ones((6, 6)))
    N = shape_functions((q - z[e]) / (z[e + 1] - z[e]), points[e + 1] - points[e])
    M = np.zeros((6 * n, 6 * n))
    for k, part in enumerate(sums(weights, section, N)):
        M[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += part
    return Mesh(z, points, G, M)


def _carried(points: Float, origins: Float, motions: Float) -> Float:
    """(6m, k p) motion of points (m, 3) that move with bodies, from the motions (p, 6, k) of theirs at ``origins``."""
    result: Float = (transfer(points[:, None] - origins) @ motions).swapaxes(1, 2).reshape(6 * len(points), -1)
    return result


def shape_functions(x: Float, chord: Float) -> Float:
    """(m, 6, 12) motion at fractions ``x`` (m,) of elements along ``chord`` (m, 3) from the motion of their ends.

    Bending is cubic in displacement with sections normal to the deflected axis, stretch and twist are linear.
    """
    length = np.linalg.norm(chord, axis=1)
    t = chord / length[:, None]
    along, cross_t = t[:, :, None] * t[:, None], -skew(t)  # theta x t = cross_t theta
    across = np.eye(3) - along
    N = np.zeros((len(x), 6, 12))
    cubic = (1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2)
    slope = (6 * x**2 - 6 * x, 1 - 4 * x + 3 * x**2, 6 * x - 6 * x**2, 3 * x**2 - 2 * x)
    for end, linear in ((0, 1 - x), (1, x)):
        u, r = slice(6 * end, 6 * end + 3), slice(6 * end + 3, 6 * end + 6)
        h, g = cubic[2 * end], length * cubic[2 * end + 1]
        N[:, :3, u] = h[:, None, None] * across + linear[:, None, None] * along
        N[:, :3, r] = g[:, None, None] * cross_t
        h, g = slope[2 * end] / length, slope[2 * end + 1]
        N[:, 3:, u] = h[:, None, None] * skew(t)
        N[:, 3:, r] = g[:, None, None] * (skew(t) @ cross_t) + linear[:, None, None] * along
    return N


@dataclass(frozen=True)
class Modes:
    """Modes of a mesh: natural modes, or given mode shapes.

    Attributes:
      z: (n,) [m] nodes.
      points: (n, 3) [m] positions of the nodes.
      shape: (k, n, 6) displacements and rotations.
      stiffness: (k, k) generalised stiffness; diagonal for natural modes.
      mass: (k, k) generalised mass, of beam and everything it carries.
      mass_alone: (k, k) generalised mass of the beam alone.
    """

    z: Float
    points: Float
    shape: Float
    stiffness: Float
    mass: Float
    mass_alone: Float

    @property
    def frequency(self) -> Float:
        """(k,) [rad/s] natural frequency of each mode, without coupling to the others."""
        result: Float = np.sqrt(np.diag(self.stiffness) / np.diag(self.mass))
        return result

    @property
    def frequency_alone(self) -> Float:
        """(k,) [rad/s] natural frequency of each shape for the beam alone, without the masses it carries."""
        result: Float = np.sqrt(np.diag(self.stiffness) / np.diag(self.mass_alone))
        return result

    def pick(self, which: list[int]) -> Modes:
        """Some of the modes, in the given order."""
        some = np.ix_(which, which)
        squares = (square[some] for square in (self.stiffness, self.mass, self.mass_alone))
        return Modes(self.z, self.points, self.shape[which], *squares)

    def scaled(self, factor: Float) -> Modes:
        """Modes with every shape multiplied by its factor (k,)."""
        product = np.outer(factor, factor)
        squares = (square * product for square in (self.stiffness, self.mass, self.mass_alone))
        return Modes(self.z, self.points, self.shape * factor[:, None, None], *squares)

    def at(self, z: Float) -> Float:
        """(k, m, 6) shapes at coordinates ``z`` (m,), interpolated linearly between the mesh's nodes."""
        return interpolated(z, self.z, self.shape)


def interpolated(z: Float, nodes: Float, values: Float) -> Float:
    """(..., m, c) values at coordinates ``z`` (m,), linear between those (..., n, c) at nodes (n,)."""
    result = np.empty((*values.shape[:-2], len(z), values.shape[-1]))
    for i in np.ndindex(values.shape[:-2]):
        for c in range(values.shape[-1]):
            result[*i, :, c] = np.interp(z, nodes, values[*i, :, c])
    return result


def natural_modes(
    mesh: Mesh, n: int, *, tip_mass: Float | None = None, base: tuple[Float, Float] | None = None
) -> Modes:
    """The ``n`` lowest modes of a beam, clamped at its first node or on springs.

    Args:
      mesh: finite elements.
      n: number of modes.
      tip_mass: (6, 6) inertia of a rigid body carried by the last node, about that node.
      base: (6, 6) stiffness of springs under the first node and mass that moves with it; None clamps it.
    """
    G, M = mesh.flexibility, mesh.mass.copy()
    alone = mesh.mass.copy()
    if base is not None:
        ground = np.linalg.cholesky(np.linalg.inv(base[0]))
        G = np.hstack([_carried(mesh.points, mesh.points[:1], ground[None]), G])
        M[:6, :6] += base[1]
        alone[:6, :6] += base[1]
    if tip_mass is not None:
        M[-6:, -6:] += tip_mass
    value, shape = lowest_modes(G, M, n)
    shapes = shape.reshape(len(shape), -1, 6)
    return Modes(mesh.z, mesh.points, shapes, np.diag(value), np.eye(len(shape)), shape @ alone @ shape.T)


def lowest_modes(G: Float, M: Float, n: int) -> tuple[Float, Float]:
    """Squares (k,) of the ``n`` lowest frequencies, and modes (k, N) of unit mass; fewer if not all coordinates move.

    Args:
      G: (N, c) factor of the flexibility, G G^T.
      M: (N, N) mass matrix.
    """
    # with x = w G y the problem K x = w^2 M x is G^T M G y = y / w^2: no inverse is needed, the lowest modes are
    # computed first and to machine precision, and stiff directions and sections without inertia cause no difficulty
    total = G.shape[1]
    inverse, y = scipy.linalg.eigh(G.T @ M @ G, subset_by_index=(total - min(n, total), total - 1))
    moving = np.flatnonzero(inverse > 1e-12 * inverse[-1])[::-1]
    value = 1.0 / inverse[moving]
    return value, (G @ y[:, moving] * np.sqrt(value)).T


def residual_modes(mesh: Mesh, modes: Modes, loads: Float) -> Modes:
    """Natural modes, and after them those of the static deflection by ``loads`` (6n, s) that they leave out.

    With them statics under these loads are exact (S-67, S-68). They are orthogonal to each other and to the natural
    modes, and have unit mass (Géradin & Rixen (2015), Mechanical Vibrations, 3rd edition, sections 2.9 and 6.8).
    """
    flat = modes.shape.reshape(len(modes.shape), -1)
    left = mesh.flexibility @ (mesh.flexibility.T @ loads) - flat.T @ np.linalg.solve(modes.stiffness, flat @ loads)
    stiffness, y = scipy.linalg.eigh(left.T @ loads, left.T @ mesh.mass @ left)
    shape = np.concatenate([flat, (left @ y).T])
    mass = shape @ mesh.mass @ shape.T
    K = scipy.linalg.block_diag(modes.stiffness, np.diag(stiffness))
    return Modes(mesh.z, mesh.points, shape.reshape(-1, len(mesh.z), 6), K, mass, mass)


def ordinal(n: int) -> str:
    """Number of a mode in its name: 1st, 2nd, 3rd ..."""
    return f"{n}{({1: 'st', 2: 'nd', 3: 'rd'}).get(n, 'th')}"


def energy_shares(modes: Modes, mass: Float) -> Float:
    """(k, 3) fractions of a mode's kinetic energy in x and y translation and in rotation about z.

    Args:
      mass: (6n, 6n) mass matrix of the mesh.
    """
    flat = modes.shape.reshape(len(modes.shape), -1)
    by_component = ((flat @ mass) * flat).reshape(modes.shape.shape).sum(axis=1)
    result: Float = by_component[:, [0, 1, 5]] / by_component.sum(axis=1, keepdims=True)
    return result


def second_order(modes: Modes) -> Float:
    """Second-order displacements of the modes: u_2 = 1/2 sum_kl q_k q_l Z_kl.

    Bending and torsion of a section move the part beyond it along a curved line: the beam's end comes closer to its
    root (shortening), and a twisted section bends sideways. With the rotation R of a section, R' = R skew(kappa), and
    the curvature kappa linear in the q, the position follows from r' = R t; this is its second-order part (S-9).

    Returns:
      (k, k, n, 3) [1/m times the shapes squared] symmetric in the first two axes.
    """
    step = np.diff(modes.points, axis=0)
    middle = 0.5 * (modes.shape[:, 1:, 3:] + modes.shape[:, :-1, 3:])
    change = np.diff(modes.shape[:, :, 3:], axis=1)
    # rotation of second order: 1/2 integral of theta_k x dtheta_l, at the middle of each element
    turn = np.cross(middle[:, None], change[None, :])
    turned = np.cumsum(turn, axis=2) - 0.5 * turn
    bent = np.cross(middle[:, None], np.cross(middle[None, :], step)) + np.cross(turned, step)
    A = np.zeros((*turn.shape[:2], len(modes.z), 3))
    A[:, :, 1:] = np.cumsum(bent, axis=2)
    result: Float = 0.5 * (A + A.transpose(1, 0, 2, 3))
    return result
