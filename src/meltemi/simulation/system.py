"""The record of a turbine with blades: everything that its equations of motion and section loads see."""

from __future__ import annotations

import meltemi.numbers.records  # noqa: F401 - by it kernels know what a record is
from meltemi.aero.air import Air
from meltemi.maths.records import Array1
from meltemi.structure.tables import (
    SectionLoads,
    Structure,
)


class System(Structure, Air):
    """Coordinates, parameters, and what an evaluation leaves; the coordinates are in the order of the model's."""


class Outputs(SectionLoads):
    """Section loads and the summary of the turbine."""

    summary: Array1
