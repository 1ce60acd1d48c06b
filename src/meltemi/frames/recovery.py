"""Section loads of a frame's members and reactions of its feet by static recovery (mode acceleration).

External loads minus inertia act on the elements of the frame at rest; the section loads that they cause are in exact
equilibrium with them, whichever modes the motion is made of.

Reference: docs/theory/frames.md (F-25 to F-29).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.frames.finite_elements import Assembly

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Recovery:
    """Loads of sections and feet from loads on a frame.

    Rows are (force x, y, z, moment x, y, z) of each section in the member's axes: the load of the part beyond the
    section (towards the second joint) on the part before it, tension positive; then of each foot in inertial axes:
    the load of the ground on the frame about the foot.

    Attributes:
      sections: (s,) member and fraction of its length.
      feet: (c,) names of joints.
      nodal: (r, 6n) of loads on nodes; those on the elements' ends belong to it as loads on their nodes.
      element: (s,) element of each section.
      cut: (s, 6, 12) what its loads on its ends contribute directly.
    """

    sections: tuple[tuple[str, float], ...]
    feet: tuple[str, ...]
    nodal: Float
    element: NDArray[np.int64]
    cut: Float

    @property
    def interface(self) -> Float:
        """(r, 6) of the load of the tower on the interface, about the tower's base."""
        return self.nodal[:, -6:]

    def loads(self, nodes: Float, ends: Float | None = None) -> Float:
        """(..., r) loads.

        Args:
          nodes: (..., n, 6) all loads on nodes, of the elements' ends (``Assembly.nodal``) too.
          ends: (..., e, 2, 6) those of them that are on the elements' ends; without them the loads of a member's
            ends lack half of the load on the element there.
        """
        result: Float = nodes.reshape(*nodes.shape[:-2], -1) @ self.nodal.T
        return result if ends is None else result + self.direct(ends)

    def direct(self, ends: Float) -> Float:
        """(..., r) what loads (..., e, 2, 6) on the elements' ends contribute beside those on nodes."""
        at = ends[..., self.element, :, :].reshape(*ends.shape[:-3], len(self.element), 12)
        section = -np.einsum("sij,...sj->...si", self.cut, at).reshape(*ends.shape[:-3], -1)
        return np.concatenate([section, np.zeros((*section.shape[:-1], 6 * len(self.feet)))], axis=-1)


@one_blas_thread
def recovery(assembly: Assembly, sections: Sequence[tuple[str, float]]) -> Recovery:
    """Matrices of the loads of some sections, and of all feet.

    Args:
      sections: member and fraction of its length from its first joint, 0 to 1.

    Raises:
      InputError: a member that is not there, or is a rigid link; the frame is a mechanism.
    """
    e, n = assembly.elements, len(assembly.points)
    element, cut = np.zeros(len(sections), dtype=np.int64), np.zeros((len(sections), 6, 12))
    for i, (name, x) in enumerate(sections):
        if name not in assembly.member_nodes or assembly.frame.members[name].kind == "rigid":
            beams = [each for each, m in assembly.frame.members.items() if m.kind != "rigid"]
            raise InputError(f"section loads: no member {name!r} that deforms: {did_you_mean(name, beams)}")
        mine = np.flatnonzero(e.member == assembly.members.index(name))
        place = min(max(x, 0.0), 1.0) * len(mine)
        part = min(int(place), len(mine) - 1)
        element[i] = mine[part]
        cut[i] = _cut(e.axes[mine[part]], float(e.length[mine[part]]), place - part)
    internal = (cut @ e.stiffness[element]).reshape(-1, 12)
    rows = np.repeat(np.arange(6 * len(sections)), 12)
    columns = np.repeat(e.flat[element], 6, axis=0).reshape(-1)
    by_displacement = scipy.sparse.csr_array((internal.reshape(-1), (rows, columns)), (6 * len(sections), 6 * n))
    # clamped feet carry the elements' forces less the loads on them, springs of others what they are moved
    T, held = assembly.transformation, assembly.held.T
    sprung = [6 * assembly.joint_nodes[name] + i for name in assembly.sprung for i in range(6)]
    stacked = scipy.sparse.vstack([by_displacement, held @ assembly.stiffness, -assembly.ground[sprung]])
    nodal = assembly.solver().solve((stacked @ T).T.toarray()).T @ T.T
    first = 6 * len(sections)
    nodal[first : first + held.shape[0]] -= held.toarray()
    feet = (*assembly.clamped, *assembly.sprung)
    return Recovery(tuple(sections), feet, nodal, element, cut)


def _cut(axes: Float, length: float, x: float) -> Float:
    """(6, 12) section loads at a fraction ``x`` of an element under uniform load by the forces on its ends (F-27)."""
    cut = np.zeros((6, 12))
    cut[:, :6], cut[:, 6:] = -(1.0 - x) * np.eye(6), x * np.eye(6)
    # the moment of a uniform load, whose sum is that of the ends' forces: z x (V2 - V1), with V1 the load on what is
    # before the element
    bow = 0.5 * length * x * (1.0 - x) * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    cut[3:, :3] += bow
    cut[3:, 6:9] += bow
    turned = np.zeros((12, 12))
    for i in range(0, 12, 3):
        turned[i : i + 3, i : i + 3] = axes.T
    return cut @ turned
