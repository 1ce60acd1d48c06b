"""The record of a turbine with blades: everything that its equations of motion and section loads see."""

from __future__ import annotations

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
from meltemi.numbers.records import Record
from meltemi.structure.tables import (
    BladeRootLoad,
    BladeStationLoad,
    GearLoads,
    GearRows,
    MachineLoad,
    Structure,
    TowerNode,
    TowerStationLoad,
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


class SectionLoads(Record):
    """What section loads need beside the system, and the loads; never in lanes."""

    gear_rows: GearRows
    gear_shape: Array2
    blade_edges: Array1
    tip_shape: Array2
    tip_second: Array3
    tower_nodes: TowerNode
    tower_drag: Array2
    blade_stations: Constant[Array1]
    tower_stations: Constant[Array1]
    apex: Array1
    root: BladeRootLoad
    chain: MachineLoad
    gear_loads: GearLoads
    station: BladeStationLoad
    tower_station: TowerStationLoad
    summary: Array1
