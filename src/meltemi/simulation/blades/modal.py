"""Modal blades: small deflections, of second order in the coordinates of the modes (docs/theory/structure.md, S-21).

Their kernels are the variants for all turbines: ``modal_motion``, ``collect_modal_blades``, ``modal_tip`` and
``modal_node_load`` of ``structure.blades``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.simulation.system import System as System
from meltemi.structure.members import ModalMember, NodeLayout
from meltemi.turbine.definition import Turbine


def arrays(turbine: Turbine, blade: ModalMember, layout: NodeLayout) -> dict[str, NDArray[np.float64]]:
    """Arrays that the records have beyond those of every turbine with blades: none.

    Args:
      turbine: description of the turbine.
      blade: a blade of the turbine with its modes.
      layout: nodes of a blade.
    """
    return {}
