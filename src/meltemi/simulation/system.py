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
from meltemi.control.actuators import PitchMotion
from meltemi.maths.records import Array1, Array2, Array3, Array4, Box, Constant, Nodes, Single
from meltemi.numbers.records import Record
from meltemi.structure.tables import (
    BladeBody,
    BladeNode,
    BladeRootLoad,
    BladeStationLoad,
    GearLoads,
    GearModes,
    GearRows,
    Gears,
    MachineLoad,
    StructureParameters,
    TowerNode,
    TowerStationLoad,
)
from meltemi.turbine.exchange import BladeFrame, BladeLoad, BladeMotion, Drive, Machine
from meltemi.wind.velocity import WindNow, WindParameters


class System(Record):
    """Coordinates, parameters, and what an evaluation leaves; the coordinates are in the order of the model's."""

    # state
    q: Array1
    v: Array1
    a: Array1
    gears: Gears
    inflow: InflowState
    stall: StallState
    memory: AeroMemory
    # structure
    locked: Array1
    structure: StructureParameters
    blade_nodes: BladeNode
    shape: Nodes[Array3]
    second: Nodes[Array3]
    modal: Array4
    top_shape: Array2
    top_second: Array3
    tower_matrix: Array3
    tower_weight: Array1
    tower_shape: Nodes[Array2]
    gear_modes: GearModes
    # aerodynamics
    aero: AeroParameters
    aero_options: AeroOptions
    aero_nodes: AeroNode
    polars: Array3
    section: Array2
    flap_nodes: Constant[Nodes[Array3]]
    increments: Constant[Array3]
    # wind
    wind: WindParameters
    series: Array2
    now: WindNow
    box: Box
    # what the control side does
    pitch: PitchMotion
    drive: Drive
    flap: FlapParameters
    # motion
    columns: Array2
    machine: Machine
    frame: BladeFrame
    partial: Nodes[Array3]
    motion: BladeMotion
    # aerodynamic loads
    flow: BladeFlow
    rotor: RotorFlow
    tower_flow: Single[TowerFlow]
    tower_lanes: TowerFlow
    load: BladeLoad
    tower_push: Array1
    d_inflow: InflowState
    d_stall: StallState
    # equations of motion
    body: BladeBody
    link: Array3
    arm_mass: Array3
    arm_force: Array2
    core_mass: Array2
    core_force: Array1
    coupling: Array3


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
