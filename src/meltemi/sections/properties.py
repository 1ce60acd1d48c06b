"""Stiffness of a section from the energy of its strains and warping, and what follows from it.

Equations (B-n) are in ``docs/theory/sections.md``. Both models describe displacements of the section by beam strains
and by warping at nodes; they differ in the matrices of their strain energy only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.sections.layup import Section

Numbers = NDArray[Any]


@dataclass(frozen=True)
class Energy:
    """Matrices of the strain energy of a section per length (B-4), for W degrees of freedom of warping.

    Attributes:
      E, C, M: (W, W) sparse: warping with warping, with its derivative along the blade, derivative with derivative.
      R, L: (W, 6) warping, and its derivative, with the beam strains.
      A: (6, 6) beam strains.
      pins: degrees of freedom that are held, so that warping contains no motion of the section as a whole.
    """

    E: Any
    C: Any
    M: Any
    R: Numbers
    L: Numbers
    A: Numbers
    pins: NDArray[np.intp]


def assembled(parts: Mapping[str, Numbers], dof: NDArray[np.intp], pins: NDArray[np.intp]) -> Energy:
    """Energy of a section from the matrices of its elements: (n, k, k), (n, k, 6) and (n, 6, 6) by name, and their
    degrees of freedom (n, k)."""
    from scipy.sparse import csr_matrix

    count, k = int(dof.max()) + 1, dof.shape[1]
    rows, cols = np.repeat(dof, k, axis=1).ravel(), np.tile(dof, (1, k)).ravel()
    sparse = {name: csr_matrix((parts[name].ravel(), (rows, cols)), shape=(count, count)) for name in "ECM"}
    R, L = np.zeros((2, count, 6), dtype=parts["R"].dtype)
    np.add.at(R, dof, parts["R"])
    np.add.at(L, dof, parts["L"])
    return Energy(**sparse, R=R, L=L, A=np.sum(parts["A"], axis=0), pins=pins)


@dataclass(frozen=True)
class PlyStates:
    """Strains and stresses at points of the plies, by unit loads of the section.

    Points are on both faces of plies (thin walls), or in the middle of elements. The order of components is 11, 22, 33,
    23, 13, 12 in the axes of the material, with engineering shear strains; that of loads is force along x, y, z, moment
    about x, y, z.

    Attributes:
      ply: (Q,) index of ``section.plies``.
      wall: (Q,) index of the wall (thin-walled: ``model.mesh.walls``; finite elements: column of elements).
      position: (Q, 2) [m] x and y.
      strain: (Q, 6, 6) [1/N, 1/(N m)] components by loads.
      stress: (Q, 6, 6) [Pa/N, Pa/(N m)] components by loads.
    """

    ply: NDArray[np.intp]
    wall: NDArray[np.intp]
    position: Numbers
    strain: Numbers
    stress: Numbers

    def at(self, points: NDArray[np.intp]) -> PlyStates:
        """The states of some points, real."""
        return PlyStates(*(getattr(self, each.name)[points].real for each in fields(self)))

    def under(self, loads: Numbers) -> tuple[Numbers, Numbers]:
        """(..., Q, 6) strains and stresses [Pa] under loads (..., 6)."""
        return np.einsum("qij,...j->...qi", self.strain, loads), np.einsum("qij,...j->...qi", self.stress, loads)


@dataclass(frozen=True)
class SectionModel:
    """A section as a beam.

    Attributes:
      section: what it is computed from.
      stiffness: (6, 6) [N, N m, N m^2] force along x, y, z and moment about x, y, z from the strains of the beam.
      mass: (6, 6) [kg/m, kg, kg m] momenta from velocities.
      ply_mass: (plies,) [kg/m] mass of each ply.
      mesh: of the model, for figures.
      states: makes the strains and stresses of the plies by unit loads.
    """

    section: Section
    stiffness: Numbers
    mass: Numbers
    ply_mass: Numbers
    mesh: Any
    states: Callable[[], PlyStates]


def central_solution(energy: Energy, name: str) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Stiffness of a section and its central solutions for six unit loads (B-6 to B-9).

    Returns:
      Stiffness (6, 6); by unit load warping (W, 6), its derivative along the blade (W, 6), beam strains (6, 6).

    Raises:
      InputError: parts of the section do not hold together.
    """
    from scipy.sparse.csgraph import connected_components
    from scipy.sparse.linalg import splu

    apart = f"{name}: the walls do not hold together: a part without connection, or walls in one line"
    if connected_components(abs(energy.E.real) + abs(energy.C.real) > 0.0, directed=False)[0] > 1:
        raise InputError(apart)
    free = np.setdiff1d(np.arange(energy.R.shape[0]), energy.pins)
    try:
        with np.errstate(all="ignore"):
            solve = splu(energy.E[free][:, free].tocsc()).solve
            R, L = energy.R[free], energy.L[free]
            X = solve(R)
            S = energy.A - R.T @ X
            # dT/dz = 0, dM/dz = -e_z x T (B-5)
            slope = np.zeros((6, 6))
            slope[3, 1], slope[4, 0] = 1.0, -1.0
            psi_1 = np.linalg.solve(S, slope)
            u_1 = -X @ psi_1
            C, M = energy.C[free][:, free], energy.M[free][:, free]
            Y = solve((C.T @ u_1 - C @ u_1) + L @ psi_1)
            psi_0 = np.linalg.solve(S, np.eye(6) - L.T @ u_1 - R.T @ Y)
            u_0 = Y - X @ psi_0
    except (RuntimeError, np.linalg.LinAlgError):
        raise InputError(apart) from None
    flexibility = (
        u_0.T @ (energy.E[free][:, free] @ u_0 + C @ u_1 + R @ psi_0)
        + u_1.T @ (C.T @ u_0 + M @ u_1 + L @ psi_0)
        + psi_0.T @ (R.T @ u_0 + L.T @ u_1 + energy.A @ psi_0)
    )
    if not np.all(np.isfinite(flexibility)):
        raise InputError(apart)
    K = np.linalg.inv(flexibility)
    full = np.zeros((2, energy.R.shape[0], 6), dtype=u_0.dtype)
    full[:, free] = u_0, u_1
    return 0.5 * (K + K.T), *full, psi_0


@dataclass(frozen=True)
class Centres:
    """Points [m] of a section, in its axes, and its principal directions.

    Attributes:
      shear: (2,) transverse forces there do not twist it; the line through those of all stations is the elastic axis.
      tension: (2,) axial forces there do not bend it; bending is about axes through it (neutral axis).
      mass: (2,) centre of mass.
      direction: [rad] of the principal axis of the smaller bending stiffness from the y axis, towards x: as twist is
        positive, towards feather.
      bending: (2,) [N m^2] principal bending stiffness, smaller one first.
    """

    shear: Numbers
    tension: Numbers
    mass: Numbers
    direction: float
    bending: NDArray[np.float64]


def centres_of(stiffness: Numbers, mass: Numbers) -> Centres:
    """Centres of a section (B-10 to B-13) from its matrices (6, 6)."""
    F = np.linalg.inv(stiffness)
    shear = np.stack([-F[5, 1], F[5, 0]]) / F[5, 5]
    bend = np.stack([[F[3, 3], -F[3, 4]], [F[4, 3], -F[4, 4]]])
    y, x = np.linalg.solve(bend, -F[3:5, 2])
    EI = np.linalg.inv(F[3:5, 3:5]).real
    values, vectors = np.linalg.eigh(EI)
    about = vectors[:, 0] * np.sign(vectors[1, 0] or 1.0)  # the axis of weakest bending, along +y
    return Centres(
        shear=shear,
        tension=np.stack([x, y]),
        mass=np.stack([-mass[2, 4], mass[2, 3]]) / mass[0, 0],
        direction=float(np.arctan2(about[0], about[1])),
        bending=values,
    )


def mass_matrix(first: Numbers) -> Numbers:
    """(6, 6) mass matrix from the integrals (6,) of density times 1, x, y, x^2, y^2, x y (B-14)."""
    m, x, y, xx, yy, xy = first
    zero = 0.0 * m
    return np.array(
        [
            [m, zero, zero, zero, zero, -y],
            [zero, m, zero, zero, zero, x],
            [zero, zero, m, y, -x, zero],
            [zero, zero, y, yy, -xy, zero],
            [zero, zero, -x, -xy, xx, zero],
            [-y, x, zero, zero, zero, xx + yy],
        ]
    )
