"""Strains and stresses in each ply from the loads at a section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]


@dataclass(frozen=True)
class PlyStates:
    """Strains and stresses at points of the plies, by unit loads of the section.

    The order of components is 11, 22, 33, 23, 13, 12 in the axes of the material, with engineering shear strains;
    that of
    loads is force along x, y, z, moment about x, y, z.

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

    def under(self, loads: Numbers) -> tuple[Numbers, Numbers]:
        """(..., Q, 6) strains and stresses [Pa] under loads (..., 6)."""
        return np.einsum("qij,...j->...qi", self.strain, loads), np.einsum("qij,...j->...qi", self.stress, loads)


class WithStates(Protocol):
    """A model of a section that knows the states of its plies."""

    def states(self) -> PlyStates:
        """Strains and stresses of the plies by unit loads."""


def ply_states(model: WithStates) -> PlyStates:
    """Strains and stresses of a section's plies, on their two faces (thin-walled) or in the middle of elements.

    Args:
      model: of :func:`~meltemi.sections.thin_walled.thin_walled_section` or
        :func:`~meltemi.sections.elements.finite_element_section`.
    """
    return model.states()
