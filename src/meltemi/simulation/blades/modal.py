"""Modal blades: small deflections, of second order in the coordinates of the modes (docs/theory/structure.md, S-21).

Their kernels are the variants for all turbines: ``modal_motion`` (``structure.kinematics``), ``collect_modal_blades``
(``structure.dynamics``), ``modal_tip`` and ``modal_node_load`` (``structure.section_loads``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.simulation.system import System as System
from meltemi.structure.members import Member, NodeLayout


def arrays(blade: Member, layout: NodeLayout) -> dict[str, NDArray[np.float64]]:
    """Arrays that the records have beyond those of every turbine with blades: none.

    Args:
      blade: a blade with its modes.
      layout: its nodes.
    """
    return {}
