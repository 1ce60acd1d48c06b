"""Ice in the arrays of a model: mass at the blade nodes and polars of iced sections.

The mode shapes remain those of the clean blade: a Ritz basis, with the ice in its mass. Frequencies and loads include
the ice; everything else is unchanged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import PolarPoint, SectionConstants
from meltemi.structure.beam import Beam, section_mass
from meltemi.structure.members import NodeLayout
from meltemi.turbine.definition import Turbine
from meltemi.turbine.icing import Icing, ice_mass, ice_stations, leading_edge, penalty_factors, penalty_share

Float = NDArray[np.float64]
Polars = tuple[Float, Float, NDArray[np.int64]]

LIFTS = [PolarPoint.index(name) for name in ("lift", "attached_lift", "separated_lift")]
DRAG = PolarPoint.index("drag")
SLOPE, DRAG_FLOOR, ZERO_LIFT = (SectionConstants.index(name) for name in "slope drag_floor zero_lift".split())


def ice_pieces(turbine: Turbine, icing: Icing, beam: Beam, layout: NodeLayout) -> Float:
    """(nodes, 6, 6) inertia about the nodes of the ice along an iced blade, at its leading edge."""
    z = ice_stations(turbine)
    axis = beam.at(z, "axis")
    offset = np.zeros((len(z), 3))
    offset[:, :2] = leading_edge(turbine.blade, z) - axis[:, :2]
    mass = section_mass(ice_mass(turbine, icing, z), offset, np.zeros((len(z), 3)))
    ice = Beam(z, axis, np.zeros_like(mass), mass)
    return ice.rigid_pieces(layout.edges, beam.at(layout.position, "axis"))


def iced_polars(
    turbine: Turbine, icing: Icing, position: Float, polars: Float, section: Float, index: NDArray[np.int64]
) -> Polars:
    """Polars of clean blades, followed by those of the nodes with ice.

    All components of the lift are scaled by the same factor, so that they still add up to the static polar, and the
    degree of attachment is that of the clean section.

    Args:
      position: (n,) [m] distance of the nodes from the root.
      polars: (g, rows, columns) on the grid over the full circle; section: (g, constants); index: (n,).

    Returns:
      polars, constants and (blades, n) indices.
    """
    nearest = np.repeat(index[None, :], turbine.n_blades, axis=0)
    grid = np.linspace(-np.pi, np.pi, polars.shape[1])
    more, constants, iced = list(polars), list(section), index.copy()
    for i, share in enumerate(penalty_share(turbine, icing, position)):
        clean = polars[index[i]]
        if share == 0.0 or np.ptp(clean[:, LIFTS[0]]) < 0.01:  # a cylinder has no leading edge to degrade
            continue
        lift, drag = penalty_factors(icing, share, grid)
        polar, constant = clean.copy(), section[index[i]].copy()
        polar[:, LIFTS] *= lift[:, None]
        polar[:, DRAG] *= drag
        constant[SLOPE] *= 1.0 - icing.lift_penalty * share
        constant[DRAG_FLOOR] *= float(np.interp(constant[ZERO_LIFT], grid, drag))
        iced[i] = len(more)
        more.append(polar)
        constants.append(constant)
    for blade in icing.on(turbine.n_blades):
        nearest[blade - 1] = iced
    return np.stack(more), np.stack(constants), nearest
