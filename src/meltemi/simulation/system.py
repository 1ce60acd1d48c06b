"""The record of a turbine with blades: everything that its equations of motion and section loads see."""

from __future__ import annotations

import meltemi.numbers.records  # noqa: F401 - by it kernels know what a record is
from meltemi.aero.flaps import FlapParameters
from meltemi.aero.tables import (
    AeroMemory,
    AeroNode,
    AeroOptions,
    AeroParameters,
    BladeFlow,
    InflowState,
    RotorFlow,
    StallState,
    TowerFlow,
)
from meltemi.maths.records import Array1, Array2, Array3, Box, Constant, Nodes, Single
from meltemi.structure.tables import (
    SectionLoads,
    Structure,
)
from meltemi.wind.velocity import WindNow, WindParameters


class System(Structure):
    """Coordinates, parameters, and what an evaluation leaves; the coordinates are in the order of the model's."""

    # aerodynamic state
    inflow: InflowState
    stall: StallState
    memory: AeroMemory
    d_inflow: InflowState
    d_stall: StallState
    # aerodynamics
    aero: AeroParameters
    aero_options: AeroOptions
    aero_nodes: AeroNode
    polars: Array3
    section: Array2
    flap_nodes: Constant[Nodes[Array3]]
    increments: Constant[Array3]
    flap: FlapParameters
    # wind
    wind: WindParameters
    series: Array2
    now: WindNow
    box: Box
    # flow
    flow: BladeFlow
    rotor: RotorFlow
    tower_flow: Single[TowerFlow]
    tower_lanes: TowerFlow


class Outputs(SectionLoads):
    """Section loads and the summary of the turbine."""

    summary: Array1
