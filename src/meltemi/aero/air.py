"""The record of the aerodynamics: what its kernels read and write."""

from __future__ import annotations

from meltemi.aero.tables import (
    AeroMemory,
    AeroNode,
    AeroOptions,
    AeroParameters,
    BladeFlow,
    FlapIncrement,
    FlapParameters,
    InflowState,
    PolarPoint,
    RotorFlow,
    SectionConstants,
    StallState,
    TowerFlow,
)
from meltemi.compiler import Array3, Constant, Nodes, Single
from meltemi.turbine.exchange import Exchange
from meltemi.wind.velocity import WindField


class Air(Exchange, WindField):
    """Parameters, states and flow of the rotor and the tower, and the wind."""

    # parameters
    aero: AeroParameters
    aero_options: AeroOptions
    aero_nodes: AeroNode
    polars: PolarPoint
    section: SectionConstants
    flap_nodes: Constant[Nodes[Array3]]
    increments: Constant[FlapIncrement]
    flap: FlapParameters
    # states
    inflow: InflowState
    stall: StallState
    memory: AeroMemory
    d_inflow: InflowState
    d_stall: StallState
    # flow
    flow: BladeFlow
    rotor: RotorFlow
    tower_flow: Single[TowerFlow]
    tower_lanes: TowerFlow
