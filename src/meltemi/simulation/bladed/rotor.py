"""Arrays of a rotor with flexible blades on a flexible tower, and those of its cases."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroMemory, AeroNode, AeroParameters, BladeFlow, InflowState, StallState, TowerFlow
from meltemi.compiler import WIDTH, KernelRecord, Table, members
from meltemi.core.errors import InputError
from meltemi.simulation.arena import aligned
from meltemi.simulation.blades import BladeModel, blade_model
from meltemi.simulation.channels import Channel, ChannelSet, catalogue
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.parts import ParameterTables
from meltemi.simulation.system import COMMON_SIGNALS, Outputs
from meltemi.structure.equations import N_SHAFT
from meltemi.structure.members import ModalMember, NodeLayout
from meltemi.structure.tables import (
    BladeBody,
    BladeNode,
    BladeStationLoad,
    GearLoads,
    StructureParameters,
    TowerStationLoad,
)
from meltemi.turbine.definition import Turbine
from meltemi.turbine.exchange import BladeFrame, BladeLoad, BladeMotion
from meltemi.wind.fields import Wind

Float = NDArray[np.float64]

SIGNALS = COMMON_SIGNALS | {
    "gear_loads": GearLoads,
    "flow": BladeFlow,
    "motion": BladeMotion,
    "station": BladeStationLoad,
    "tower_station": TowerStationLoad,
}
STATES: dict[str, type[Table]] = {"inflow": InflowState, "stall": StallState, "memory": AeroMemory}
WEIGHTS = {
    "tower_flow": [TowerFlow.index("length")],
    "blade_nodes": [row for row, name in enumerate(BladeNode.names) if not name.startswith("position")],
    "aero_nodes": [AeroNode.index(name) for name in ("length", "area", "ring")],
}
"""Rows that weight a node in sums: zero for the nodes that pad the last lanes."""


def filled(array: Float, nodes: int, weights: Iterable[int] = ()) -> Float:
    """Constants of the nodes, padded to ``nodes`` by copies of the last one whose rows ``weights`` are zero."""
    missing = nodes - array.shape[-1]
    result = aligned((*array.shape[:-1], nodes))
    result[...] = np.concatenate([array, np.repeat(array[..., -1:], missing, axis=-1)], axis=-1)
    for row in weights:
        result[row, ..., nodes - missing :] = 0.0
    return result


def to_lanes(nodes: int, lanes: bool) -> int:
    """Number of nodes, rounded up to whole lanes."""
    return -(-nodes // WIDTH) * WIDTH if lanes else nodes


@dataclass(frozen=True, repr=False)
class BladedRotor:
    """Rotor with flexible blades on a flexible tower; see ``simulation.model.Rotor``.

    Attributes:
      blade, tower: the flexible members.
      blade_layout, tower_layout: their nodes.
      gear_stages: number of planetary stages and of all stages of the gearbox; zero where they are not modelled.
      blade_model: name of the structural model of the blades.
      blade_arrays: arrays of this model, by their names in its records; every case has a copy.
      gear_modes ... flap_actuators: arrays of the kernels, see the tables of their layers.
    """

    in_lanes: ClassVar[bool] = True
    sections: ClassVar[type[KernelRecord]] = Outputs
    signals: ClassVar[dict[str, type[Table]]] = SIGNALS
    parameter_tables: ClassVar[ParameterTables] = (
        (StructureParameters, "structure", StructureParameters.names),
        (AeroParameters, "aero", AeroParameters.names),
    )
    blade: ModalMember
    tower: ModalMember
    blade_layout: NodeLayout
    tower_layout: NodeLayout
    gear_stages: tuple[int, int]
    blade_model: BladeModel
    blade_arrays: dict[str, Float]
    gear_modes: Float
    gear_rows: Float
    gear_shape: Float
    blade_nodes: Float
    blade_edges: Float
    shape: Float
    second: Float
    modal: Float
    tip_shape: Float
    tip_second: Float
    top_shape: Float
    top_second: Float
    tower_matrix: Float
    tower_weight: Float
    tower_nodes: Float
    tower_shape: Float
    aero_options: NDArray[np.int64]
    aero_nodes: Float
    polars: Float
    section: Float
    tower_flow: Float
    flap_nodes: Float
    increments: Float
    flap_actuators: Float

    @property
    def system(self) -> type[KernelRecord]:
        """Class of the records that the kernels take; that of the structural model of the blades."""
        record: type[KernelRecord] = blade_model(self.blade_model).System
        return record

    @property
    def node_arrays(self) -> list[str]:
        """Arrays whose last axis is the nodes of a blade or of the tower, padded to whole lanes."""
        record: Any = self.system
        return [name for name, member in members(record).items() if member.in_lanes]

    @property
    def n_nodes(self) -> int:
        """Number of nodes of each blade."""
        return len(self.blade_layout.position)

    @property
    def n_core(self) -> int:
        """Number of coordinates except those of the blades."""
        return len(self.tower.names) + N_SHAFT

    @property
    def n_flaps(self) -> int:
        """Number of flaps of each blade."""
        return len(self.flap_nodes)

    def check(self, stations: Stations, turbine: Turbine) -> None:
        """Raise InputError for stations beyond the ends of blades or tower."""
        for name, places, length in (
            ("blade_stations", stations.blade, turbine.blade.length),
            ("tower_stations", stations.tower, turbine.tower.length),
        ):
            for place in places:
                if not 0.0 <= place <= length:
                    raise InputError(f"{name}: {place:g} m is not between 0 and {length:g} m, the end of the member")

    def _sizes(self, turbine: Turbine, lanes: bool) -> dict[str, int]:
        return {
            "blade": turbine.n_blades,
            "node": to_lanes(self.n_nodes, lanes),
            "flap": self.n_flaps,
            "mode": self.gear_modes.shape[1],
            "part": self.gear_rows.shape[1],
        }

    def shapes(self, turbine: Turbine, stations: Stations, lanes: bool) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        sizes, number = self._sizes(turbine, lanes), {"tower_station": 1 + len(stations.tower)}
        return {
            name: table.shape(**sizes, station=number.get(name, len(stations.blade)))
            for name, table in self.signals.items()
        }

    def states(self, turbine: Turbine, lanes: bool) -> dict[str, tuple[int, ...]]:
        """Shapes of the states of inflow and stall, and of the memory of integrator and solver."""
        return {name: table.shape(**self._sizes(turbine, lanes)) for name, table in STATES.items()}

    def arrays(self, turbine: Turbine, wind: Wind, stations: Stations, lanes: bool) -> dict[str, Any]:
        """All other arrays of its records; those of nodes are padded to whole lanes."""
        sizes = self._sizes(turbine, lanes)
        B, nodes, K, M, nc = turbine.n_blades, sizes["node"], len(self.blade.names), len(self.tower.names), self.n_core
        tower_nodes = to_lanes(self.tower_flow.shape[1], lanes)
        tower_flow = filled(self.tower_flow, tower_nodes, WEIGHTS["tower_flow"])
        arrays = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in MEMBERS}
        arrays |= {name: array.copy() for name, array in self.blade_arrays.items()}
        weights = WEIGHTS | {name: range(len(array)) for name, array in self.blade_arrays.items()}
        of_nodes = {
            name: filled(arrays[name], tower_nodes if name == "tower_shape" else nodes, weights.get(name, ()))
            for name in self.node_arrays
            if name in arrays
        }
        return {
            **arrays,
            **of_nodes,
            "aero_options": self.aero_options.copy(),
            "columns": np.zeros((6, nc)),
            "frame": BladeFrame.zeros(**sizes),
            "partial": aligned((6 * K, B, nodes)),
            "load": aligned(BladeLoad.shape(**sizes)),
            "d_inflow": aligned(InflowState.shape(**sizes)),
            "d_stall": aligned(StallState.shape(**sizes)),
            "body": BladeBody.zeros(blade=B),
            "link": np.zeros((6, B, K)),
            "arm_mass": np.zeros((B, K, K)),
            "arm_force": np.zeros((B, K)),
            "core_mass": np.zeros((nc, nc)),
            "core_force": np.zeros(nc),
            "coupling": np.zeros((B, K, nc)),
            "tower_flow": tower_flow,
            "tower_lanes": tower_flow,
            "tower_push": np.zeros(M),
            "tower_drag": tower_flow[-3:],
            "tower_piece": np.zeros((9, self.tower_nodes.shape[1])),
            "apex": np.zeros(6),
            "blade_stations": np.array(stations.blade, dtype=float),
            "tower_stations": np.array((0.0, *stations.tower), dtype=float),
        }

    def share_slopes(self, slopes: dict[str, Any]) -> None:
        """Derivatives of the members that show an array of the tower once more."""
        slopes["tower_lanes"], slopes["tower_drag"] = slopes["tower_flow"], slopes["tower_flow"][-3:]

    def shown(self, arrays: dict[str, Any]) -> dict[str, Any]:
        """The arrays without the nodes that pad the last lanes."""
        N, NT = self.n_nodes, self.tower_flow.shape[1]
        ends = {"tower_flow": NT, "tower_drag": NT, **{name: NT if "tower" in name else N for name in self.node_arrays}}
        return {name: array[..., : ends[name]] if name in ends else array for name, array in arrays.items()}


MEMBERS = ("blade", "tower", "blade_layout", "tower_layout", "gear_stages", "blade_model", "blade_arrays")
BladedModel = Model[BladedRotor]


def bladed_channels(model: BladedModel, stations: Stations) -> dict[str, Channel]:
    """All channels of a model and of its parts, by name."""
    return catalogue(
        ChannelSet(
            blades=model.n_blades,
            nodes=model.rotor.n_nodes,
            blade_stations=len(stations.blade),
            tower_stations=len(stations.tower),
            coordinates=model.coordinates,
            flaps=model.n_flaps,
            gears=model.rotor.gear_stages,
            further=tuple(channel for part in model.parts for channel in part.channels()),
        )
    )


def channels_at_instants(model: BladedModel) -> dict[str, Channel]:
    """Channels that have a value at an instant, by name."""
    later = {name for part in model.parts for name in part.afterwards}
    return {name: c for name, c in bladed_channels(model, Stations()).items() if c.source[0] not in later}


def with_static_gears(model: BladedModel) -> BladedModel:
    """The model with a gearbox whose parts follow rotor and generator quasi-statically, without gearbox modes.

    Steady operation, default time step and modes in vacuum need only the slow motion.
    """
    if not model.rotor.gear_modes.shape[1]:
        return model
    from meltemi.structure.gear_train import gear_arrays

    _, modes, rows, shape = gear_arrays(model.turbine.drivetrain, multibody=False)
    return model.with_arrays(gear_modes=modes, gear_rows=rows, gear_shape=shape)


def with_blades(model: Model[Any], what: str) -> BladedModel:
    """The model, which must have blades and a tower for ``what``.

    Raises:
      InputError: the model has a rotor with a power coefficient.
    """
    if not isinstance(model.rotor, BladedRotor):
        from meltemi.turbine.power_turbine import aeroelastic

        aeroelastic(model.turbine, what)
    return model
