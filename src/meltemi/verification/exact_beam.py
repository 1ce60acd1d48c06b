"""Static deflection of a geometrically exact beam: an independent calculation for large blade deflections.

Reissner's beam with stretch, shear, bending and torsion under dead loads, along the undeformed reference axis:

    r' = R (t_0 + gamma),   R' = R kappa~,   m' = -r' x n - c,   (gamma, kappa) = K^-1 (R^T n, R^T m)

where r is the position, R the rotation from the undeformed section, t_0 the undeformed tangent, n and m the internal
force and moment in fixed axes; n follows from the loads alone. Shooting determines the moment at the root for which
that at the tip is the moment of the load. Nothing is shared with the modal blade but the section data.

Reference: Reissner (1981), J. Appl. Math. Phys. 32; Simo & Vu-Quoc (1986), Comput. Methods Appl. Mech. Eng. 58.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from meltemi.core.errors import InputError
from meltemi.structure.beam import Beam

Float = NDArray[np.float64]

STEPS = 4
"""Steps of the classical Runge-Kutta method between two stations."""


@dataclass(frozen=True)
class DeadLoads:
    """Loads that keep their direction.

    Attributes:
      force, moment: (S, 3) [N/m], [N] loads distributed along the arc at the beam's stations, linear between them, in
        the beam's axes.
      tip_force, tip_moment: (3,) [N], [N m] loads at the end.
    """

    force: Float
    moment: Float
    tip_force: Float
    tip_moment: Float


@dataclass(frozen=True)
class Deflection:
    """Deflected beam at the stations of its description.

    Attributes:
      position: (S, 3) [m] positions of the reference axis, in the beam's axes.
      rotation: (S,) rotations from the undeformed sections.
      root_moment: (3,) [N m] moment of the beam on its support.
    """

    position: Float
    rotation: Rotation
    root_moment: Float


def deflect(beam: Beam, loads: DeadLoads, increments: int = 4, steps: int = STEPS) -> Deflection:
    """Deflection of a beam clamped at its first station.

    Args:
      beam: sections along z.
      loads: dead loads.
      increments: number of increments of the load; each begins with the root moment of the last one.
      steps: number of steps of the integration between two stations.

    Raises:
      InputError: the shooting does not converge.
    """
    edges = np.diff(beam.axis, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    pieces = list(zip(edges / lengths[:, None], lengths, pairwise(beam.stiffness), pairwise(loads.force), strict=True))
    couples = list(pairwise(loads.moment))
    total = loads.tip_force + np.trapezoid(loads.force, np.append(0.0, np.cumsum(lengths)), axis=0)

    def march(root_moment: Float, share: float) -> Float:
        """(S, 10) position, quaternion and moment at the stations."""
        y = np.concatenate([beam.axis[0], [0.0, 0.0, 0.0, 1.0], root_moment])
        states, n = [y], share * total
        for (tangent, length, (K0, K1), (f0, f1)), (c0, c1) in zip(pieces, couples, strict=True):

            def slope(w: float, y: Float) -> Float:
                n_here = n - share * length * (w * f0 + 0.5 * w * w * (f1 - f0))  # noqa: B023
                K, c = K0 + w * (K1 - K0), share * (c0 + w * (c1 - c0))  # noqa: B023
                R = Rotation.from_quat(y[3:7]).as_matrix()
                strain = np.linalg.solve(K, np.concatenate([R.T @ n_here, R.T @ y[7:]]))
                dr, v, kappa = R @ (tangent + strain[:3]), y[3:6], strain[3:]  # noqa: B023
                dq = 0.5 * np.append(y[6] * kappa + np.cross(v, kappa), -v @ kappa)
                return np.concatenate([dr, dq, -np.cross(dr, n_here) - c]) * length  # noqa: B023

            h = 1.0 / steps
            for w in np.arange(steps) * h:
                k1 = slope(w, y)
                k2 = slope(w + 0.5 * h, y + 0.5 * h * k1)
                k3 = slope(w + 0.5 * h, y + 0.5 * h * k2)
                k4 = slope(w + h, y + h * k3)
                y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            n = n - share * 0.5 * length * (f0 + f1)
            states.append(y)
        return np.array(states)

    moment = np.zeros(3)
    for share in np.arange(1, increments + 1) / increments:
        scale = np.linalg.norm(total) * lengths.sum() + np.linalg.norm(loads.tip_moment) + 1e-300

        def lack(x: Float, share: float = float(share), scale: float = float(scale)) -> Float:
            residual: Float = march(x * scale, share)[-1, 7:] / scale - share * loads.tip_moment / scale
            return residual

        solution = root(lack, moment / scale, tol=1e-12)
        if np.abs(solution.fun).max() > 1e-9:
            raise InputError(f"exact beam: no root moment at {share:.0%} of the load: {solution.message}")
        moment = solution.x * scale
    y = march(moment, 1.0)
    return Deflection(y[:, :3], Rotation.from_quat(y[:, 3:7]), moment)
