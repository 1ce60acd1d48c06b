"""Registered models of stall, inflow and tower influence.

The name of a model is that of its file: ``aero/stall/hansen.py`` is the stall model "hansen". The place of the name is
the number of the model in kernels (``AeroOptions``). docs/variants.md explains how to add one.
"""

from __future__ import annotations

from typing import Literal

StallModel = Literal["static", "hansen"]
InflowModel = Literal["quasi_steady", "constant", "variable"]
TowerInfluence = Literal["none", "potential", "lower_half", "powles", "eames"]
RotationalAugmentation = Literal["none", "snel", "chaviaropoulos_hansen"]
