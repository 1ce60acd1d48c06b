"""One simulation's own arrays, and the calls that move them.

Everything a run changes stands in two contiguous vectors: the *state* (coordinates, velocities, inflow,
stall, actuators) and the *signals* (whatever was computed on the way and may be recorded). The arrays
the kernels see are views of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numba
import numpy as np
from numpy.typing import NDArray

from meltemi.aero.flaps import FlapParameters
from meltemi.aero.rotor import derivatives, settle
from meltemi.aero.tables import (
    AIR_DENSITY,
    AeroMemory,
    AeroNode,
    BladeFlow,
    InflowState,
    RotorFlow,
    StallState,
    TowerFlow,
)
from meltemi.control.controller import Controller, Entry, StartPoint
from meltemi.control.faults import healthy
from meltemi.control.signals import (
    GRID,
    MOST_FLAP,
    MOST_PITCH,
    MOST_REACTIVE,
    MOST_TORQUE,
    N_BLADES,
    POWER_LIMIT,
    REPORTS,
    Demands,
    Measurements,
)
from meltemi.core.errors import InputError
from meltemi.core.kernel import announce
from meltemi.electrical.tables import TRIPS, ElectricState
from meltemi.environment.conditions import Conditions, conditions_array
from meltemi.environment.grid import PowerGrid
from meltemi.maths.records import Kind, members
from meltemi.maths.tables import Table, View
from meltemi.numbers.duals import N_DERIVATIVES
from meltemi.numbers.lanes import WIDTH
from meltemi.numbers.views import FLOATS
from meltemi.simulation import step
from meltemi.simulation.channels import Channel
from meltemi.simulation.electric import ELECTRIC_PARTS, begin_electric, deliver, rates_of_electric
from meltemi.simulation.machine import AnyModel
from meltemi.simulation.model import Model
from meltemi.simulation.step import (
    CORRECTIONS,
    EVERY_CONTROL,
    EVERY_OUTPUT,
    N_CLOCK,
    RUN_PARTS,
    WANT_LOADS,
    Summary,
    evaluate,
    observe,
    surroundings,
)
from meltemi.simulation.system import Outputs, System
from meltemi.simulation.validity import new_watch
from meltemi.structure.tables import (
    BladeBody,
    BladeNode,
    BladeRootLoad,
    BladeStationLoad,
    GearLoads,
    Gears,
    MachineLoad,
    TowerStationLoad,
)
from meltemi.turbine.electrical import nominal_frequency
from meltemi.turbine.exchange import BladeFrame, BladeLoad, BladeMotion, Drive, Machine, PitchMotion
from meltemi.wind.fields import Wind, wind_arrays

Float = NDArray[np.float64]
LEAST_BRAKE_SPEED = 0.05
"""[rad/s] of the generator, within which the brake's dry friction is smoothed at least."""


def aligned(shape: tuple[int, ...]) -> Float:
    """Zeros that begin at a multiple of 64 bytes, as the processor's widest registers like it."""
    size = int(np.prod(shape))
    spare = np.zeros(size + WIDTH)
    begin = (-spare.ctypes.data // spare.itemsize) % WIDTH
    return spare[begin : begin + size].reshape(shape)


class Arena:
    """Views cut one after another from one contiguous vector, each beginning at a multiple of 64 bytes.

    With ``duals`` there is a second vector, and views of it, with the derivatives of every entry.
    """

    def __init__(self, shapes: dict[str, tuple[int, ...]], *, duals: bool = False) -> None:
        self.begin: dict[str, int] = {}
        at = 0
        for name, shape in shapes.items():
            self.begin[name] = at
            at += -(-int(np.prod(shape)) // WIDTH) * WIDTH
        self.vector = aligned((at,))
        self.slopes = aligned((at if duals else 0, N_DERIVATIVES))
        self.views: dict[str, Float] = {}
        self.slope_views: dict[str, Float] = {}
        for name, shape in shapes.items():
            entries = slice(self.begin[name], self.begin[name] + int(np.prod(shape)))
            self.views[name] = self.vector[entries].reshape(shape)
            if duals:
                self.slope_views[name] = self.slopes[entries].reshape(*shape, N_DERIVATIVES)

    def place(self, name: str, index: tuple[int, ...]) -> int:
        """Place in the vector of one entry of a view."""
        return self.begin[name] + int(np.ravel_multi_index(index, self.views[name].shape))


SIGNAL_TABLES: dict[str, type[Table]] = {
    "summary": Summary,
    "machine": Machine,
    "rotor": RotorFlow,
    "chain": MachineLoad,
    "root": BladeRootLoad,
    "pitch": PitchMotion,
    "flap": FlapParameters,
    "drive": Drive,
    "gears": Gears,
    "gear_loads": GearLoads,
    "demands": Demands,
    "outside": Conditions,
    "electric": ElectricState,
    "flow": BladeFlow,
    "motion": BladeMotion,
    "station": BladeStationLoad,
    "tower_station": TowerStationLoad,
}
"""Arrays a channel may ask for, by the table that describes them; q, v and a come on top."""


CONSTANT = frozenset(
    "times box conditions aero_options flap_nodes increments blade_stations tower_stations watch".split()
)
"""Arrays that have no derivatives."""
FILLED = [name for name, member in members(System).items() if member.in_lanes]
"""Arrays whose last axis are the nodes of a blade or of the tower, which fill up the last lanes."""
WEIGHTS = {
    "tower_flow": [TowerFlow.index("length")],
    "blade_nodes": [row for row, name in enumerate(BladeNode.names) if not name.startswith("position")],
    "aero_nodes": [AeroNode.index(name) for name in ("length", "area", "ring")],
}
"""Rows by which a node counts in sums: zero for the nodes that only fill up the last lanes."""


def filled(name: str, array: Float, nodes: int) -> Float:
    """Constants of the nodes, continued to ``nodes`` by copies of the last one that carry no weight."""
    missing = nodes - array.shape[-1]
    result = aligned((*array.shape[:-1], nodes))
    result[...] = np.concatenate([array, np.repeat(array[..., -1:], missing, axis=-1)], axis=-1)
    for row in WEIGHTS.get(name, ()):
        result[row, ..., nodes - missing :] = 0.0
    return result


@dataclass(frozen=True)
class Stations:
    """Where section loads are wanted [m]: along the blades from the root, along the tower from its base.

    The tower base itself is always there, as the first station of the tower.
    """

    blade: tuple[float, ...] = ()
    tower: tuple[float, ...] = ()


class BaseCase:
    """What the cases of all kinds of models have.

    Attributes:
      tables: signal arrays by the tables that describe them.
      time_loop: the function that marches; ``run_parts`` are the arrays of a run that it takes.
      model: what is simulated.
      signals: whatever a channel may ask for; views of one vector.
      aero_state: states of inflow and stall, the same.
      arrays: everything by its name.
      slopes: derivatives of arrays by the same names, with duals.
      controller, controller_state, entry: of the controller that was bound.
    """

    tables: ClassVar[dict[str, type[Table]]]
    time_loop: ClassVar[staticmethod[..., Any]]
    run_parts: ClassVar[tuple[str, ...]]
    model: AnyModel
    signals: Arena
    aero_state: Arena
    arrays: dict[str, Any]
    slopes: dict[str, Float]
    spare: Float
    _electric_parts: tuple[Any, ...]
    _electric_numbers: Any
    controller: Controller
    controller_state: Float
    entry: Entry

    def _prepare(self, model: AnyModel) -> None:
        """Vectors between machine and controller, and those of a run."""
        nq = len(model.coordinates)
        self.measured, self.limits = Measurements.zeros(), Demands.zeros()
        self.measured[N_BLADES] = model.n_blades
        most, actuator = View(Demands, self.limits), model.turbine.pitch_actuator
        most["generator_torque"] = MOST_TORQUE * model.turbine.control.torque.maximum_torque
        most["pitch"] = MOST_PITCH + max(abs(actuator.minimum), abs(actuator.maximum))
        most["brake"] = most["yaw_rate"] = 1.0
        most["flap"] = MOST_FLAP
        most["reactive_power"] = MOST_REACTIVE * model.turbine.rated_power
        for name in REPORTS:
            most[name] = np.inf
        self.measured[GRID], self.measured[POWER_LIMIT] = 1.0, np.inf
        self.events = np.zeros((0, 3))
        self.v_old, self.a_old = np.zeros(nq), np.zeros(nq)
        self.clock = np.zeros(N_CLOCK, dtype=np.int64)
        self.clock[[EVERY_OUTPUT, EVERY_CONTROL]] = 1

    def __getitem__(self, name: str) -> Any:
        return self.arrays[name]

    def kinds(self, names: Sequence[str]) -> tuple[Any, ...]:
        """Arrays of derivatives, None for an array that has none: duals as a kind of number."""
        return tuple(self.slopes.get(name) for name in names)

    def view(self, name: str) -> View:
        """A signal array with its rows by name."""
        return View(self.tables[name], self.arrays[name])

    def place(self, channel: Channel) -> int:
        """Where a channel stands in the vector of signals."""
        array, row = channel.source
        if array in ("q", "v"):
            return self.signals.place(array, (self.model.coordinates.index(row),))
        return self.signals.place(array, (self.view(array).table.index(row), *channel.index))

    def bind(self, controller: Controller, start: StartPoint) -> Entry:
        """Give the case a controller, started at an operating point."""
        self.controller = controller = controller if controller.fresh is None else controller.fresh()
        self.controller_state = controller.initial_state(start)
        self.clock[WANT_LOADS] = int(controller.uses_loads)
        duals = bool(self.slopes)
        if duals:
            self.slopes["controller_state"] = np.zeros((*self.controller_state.shape, N_DERIVATIVES))
        self.entry = Entry(controller, self.controller_state, self.measured, self.arrays["demands"], duals=duals)
        return self.entry

    def air(self) -> Float:
        """States and memory of inflow and stall as one vector, whatever the kind of number."""
        return np.concatenate([np.zeros(0), *(self.arrays[name].reshape(-1) for name in self.aero_state.views)])

    def put_air(self, values: Float) -> None:
        """Set what :meth:`air` gives."""

    def evaluate(self, t: float, dt: float = 0.0) -> None:
        """Compute everything at time ``t`` for the present state."""
        raise NotImplementedError

    def settle(self, t: float) -> None:
        """Bring inflow and stall into the steady state of the present motion."""
        self.evaluate(t)

    def rates(self) -> None:
        """Compute the time derivatives of the states of inflow and stall after an evaluation."""

    def loads(self, t: float) -> None:
        """Compute section loads and the summary after an evaluation."""
        raise NotImplementedError

    def begin_electric(self, dt: float = 0.0) -> None:
        """Set weather and grid, and bring the electrical system into steady operation at the present speed and torque.

        Args:
          dt: [s] of the steps that follow.
        """
        surroundings(0.0, self["conditions"], float(self["aero"][AIR_DENSITY]), self["faults"], self["outside"])
        if self.model.has_electrical:
            begin_electric(dt, self._electric_numbers, self._electric_parts)

    def electric_rates(self) -> None:
        """Time derivatives of the electrical system, and its torque on the shaft; before an evaluation."""
        if self.model.has_electrical:
            rates_of_electric(self._electric_numbers, self._electric_parts)

    @property
    def trip(self) -> str:
        """Why the electrical system has tripped; empty if it has not."""
        number = int(self.view("electric")["trip"])
        return TRIPS[number] if number else ""

    def sample(self, t: float) -> None:
        """What the sensors give at time ``t`` into ``measured``."""
        step.sample(t, *self.sample_arguments())

    def sample_arguments(self) -> tuple[Any, ...]:
        """Arguments of ``step.sample`` after the time."""
        return (
            self["q"],
            self["v"],
            self.model.n_core,
            self["structure"],
            self["drive"],
            self["pitch"],
            self["flap"],
            self["actuators"],
            self["root"],
            self["chain"],
            self["summary"],
            self.model.turbine.drivetrain.generator_efficiency,
            self["outside"],
            self["electrical"],
            self["electric"],
            self.measured,
        )

    def run_arrays(self, names: Sequence[str], output: Float) -> tuple[Any, ...]:
        """The arrays of a run under way."""
        arrays = {
            **self.arrays,
            "spare": self.spare,
            "aero_state": self.aero_state.vector,
            "controller_state": self.controller_state,
            "measured": self.measured,
            "v_old": self.v_old,
            "a_old": self.a_old,
            "signals": self.signals.vector,
            "output": output,
        }
        return tuple(arrays[name] for name in names)

    def kernel_parts(self) -> tuple[Any, ...]:
        """The machine as the time loop takes it."""
        raise NotImplementedError

    def advance_arguments(self, dt: float, places: Any, output: Float) -> tuple[Any, ...]:
        """Arguments of the time loop after the number of steps and the controller."""
        return (
            dt,
            self.model.turbine.drivetrain.generator_efficiency,
            self.clock,
            self.limits,
            self.events,
            places,
            self.kinds(self.run_parts) if self.slopes else FLOATS,
            self.run_arrays(self.run_parts, output),
            *self.kernel_parts(),
        )


class Case(BaseCase):
    """Arrays of one simulation of a model in a wind.

    ``case[name]`` is the array without the nodes that fill up the last lanes; ``system`` and ``sections`` are the same
    memory as the kernels take it, ``one`` the system node by node, ``plain`` in plain numbers.

    Args:
      numbers: the kind of number to compute in: "lanes" treats the nodes of a blade eight at a time, "floats"
        one by one, "duals" with derivatives, which stand in ``slopes`` by the names of the arrays.
    """

    tables: ClassVar[dict[str, type[Table]]] = SIGNAL_TABLES
    time_loop: ClassVar[staticmethod[..., Any]] = staticmethod(step.advance)
    run_parts: ClassVar[tuple[str, ...]] = tuple(RUN_PARTS)
    model: Model

    def __init__(
        self,
        model: Model,
        wind: Wind,
        stations: Stations | None = None,
        *,
        numbers: Kind = "lanes",
        grid: PowerGrid | None = None,
    ) -> None:
        announce()
        stations = stations or Stations()
        lanes, duals = numbers == "lanes" and not numba.config.DISABLE_JIT, numbers == "duals"
        self.model = model
        turbine = model.turbine
        for name, places, length in (
            ("blade_stations", stations.blade, turbine.blade.length),
            ("tower_stations", stations.tower, turbine.tower.length),
        ):
            for place in places:
                if not 0.0 <= place <= length:
                    raise InputError(f"{name}: {place:g} m is not between 0 and {length:g} m, the end of the member")
        B, N = model.n_blades, model.n_nodes
        K, nq, nc = len(model.blade.names), len(model.coordinates), model.n_core
        M, NT = len(model.tower.names), model.tower_flow.shape[1]
        fill = -(-N // WIDTH) * WIDTH if lanes else N
        gears, gear_parts = model.gear_modes.shape[1], model.gear_rows.shape[1]
        sizes = {"blade": B, "node": fill, "flap": model.n_flaps, "mode": gears, "part": gear_parts}
        self.signals = Arena(
            {
                "q": (nq,),
                "v": (nq,),
                "a": (nq,),
                **{
                    name: table.shape(
                        **sizes,
                        station=1 + len(stations.tower) if name == "tower_station" else len(stations.blade),
                    )
                    for name, table in SIGNAL_TABLES.items()
                },
            },
            duals=duals,
        )
        self.aero_state = Arena(
            {
                "inflow": InflowState.shape(**sizes),
                "stall": StallState.shape(**sizes),
                "memory": AeroMemory.shape(**sizes),
            },
            duals=duals,
        )
        tower_fill = -(-NT // WIDTH) * WIDTH if lanes else NT
        tower_flow = filled("tower_flow", model.tower_flow, tower_fill)
        arrays: dict[str, Any] = {
            **self.signals.views,
            **self.aero_state.views,
            "locked": model.locked.copy(),
            "structure": model.structure,
            "gear_modes": model.gear_modes,
            "gear_rows": model.gear_rows,
            "gear_shape": model.gear_shape,
            "blade_nodes": filled("blade_nodes", model.blade_nodes, fill),
            "blade_edges": model.blade_edges,
            "shape": filled("shape", model.shape, fill),
            "second": filled("second", model.second, fill),
            "modal": model.modal,
            "tip_shape": model.tip_shape,
            "tip_second": model.tip_second,
            "top_shape": model.top_shape,
            "top_second": model.top_second,
            "tower_matrix": model.tower_matrix,
            "tower_weight": model.tower_weight,
            "tower_nodes": model.tower_nodes,
            "tower_shape": filled("tower_shape", model.tower_shape, tower_fill),
            "faults": healthy(),
            "watch": new_watch(model),
            "conditions": conditions_array(
                model.environment, grid, turbine.rated_power, nominal_frequency(turbine.electrical)
            ),
            "actuators": model.actuators,
            "aero": model.aero.copy(),
            "aero_options": model.aero_options.copy(),
            "aero_nodes": filled("aero_nodes", model.aero_nodes, fill),
            "polars": model.polars,
            "flap_nodes": filled("flap_nodes", model.flap_nodes, fill),
            "increments": model.increments,
            "flap_actuators": model.flap_actuators,
            "section": model.section,
            **wind_arrays(wind, turbine.hub_height, turbine.rotor_diameter),
            "electrical": model.electrical,
            "d_electric": ElectricState.zeros(),
            "columns": np.zeros((6, nc)),
            "frame": BladeFrame.zeros(**sizes),
            "partial": aligned((3 * K, B, fill)),
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
            "apex": np.zeros(6),
            "blade_stations": np.array(stations.blade, dtype=float),
            "tower_stations": np.array((0.0, *stations.tower), dtype=float),
        }
        assert len(model.tower_layout.position) == NT
        self._prepare(model)
        self.spare = np.zeros_like(self.aero_state.vector)
        self.clock[CORRECTIONS] = model.options.corrections
        ends = {"tower_flow": NT, "tower_drag": NT, **{name: NT if "tower" in name else N for name in FILLED}}
        self.arrays = {name: array[..., : ends[name]] if name in ends else array for name, array in arrays.items()}
        self.arrays["drive"][Drive.index("brake_speed")] = LEAST_BRAKE_SPEED
        self.arrays["drive"][Drive.index("yaw_held")] = float(model.options.yaw != "free")
        arrays["memory"][AeroMemory.index("phi")] = 0.1
        arrays["memory"][AeroMemory.index("slope")] = 1.0
        self.slopes = {**self.signals.slope_views, **self.aero_state.slope_views}
        if duals:
            for name, array in arrays.items():
                if name not in self.slopes and name not in CONSTANT:
                    self.slopes[name] = np.zeros((*array.shape, N_DERIVATIVES))
            self.slopes["tower_lanes"] = self.slopes["tower_flow"]
            self.slopes["tower_drag"] = self.slopes["tower_flow"][-3:]
        one: Kind = "duals" if duals else "floats"
        self.system = System("lanes" if lanes else one, arrays, self.slopes)
        self.one, self.plain = System(one, arrays, self.slopes), System("floats", arrays)
        self.sections = Outputs(one, arrays, self.slopes)
        self._electric_parts = tuple(arrays[name] for name in ELECTRIC_PARTS)
        self._electric_numbers = self.kinds(ELECTRIC_PARTS) if duals else FLOATS
        if duals:
            for name in ("measured", "v_old", "a_old", "spare"):
                self.slopes[name] = np.zeros((*getattr(self, name).shape, N_DERIVATIVES))
            self.slopes["aero_state"], self.slopes["signals"] = self.aero_state.slopes, self.signals.slopes

    def air(self) -> Float:
        """States and memory of inflow and stall as one vector, whatever the kind of number."""
        return np.concatenate([self.arrays[name].reshape(-1) for name in self.aero_state.views])

    def put_air(self, values: Float) -> None:
        """Set what :meth:`air` gives, with the last node's copies."""
        at = 0
        for name, array in self.aero_state.views.items():
            shown = self.arrays[name]
            shown[...] = values[at : at + shown.size].reshape(shown.shape)
            array[..., shown.shape[-1] :] = shown[..., -1:]
            at += shown.size
        # between azimuths a Fourier series overshoots: the attachment must not leave its range
        attachment = self.aero_state.views["stall"][StallState.index("attachment")]
        np.clip(attachment, 0.0, 1.0, out=attachment)

    def evaluate(self, t: float, dt: float = 0.0) -> None:
        """Compute everything at time ``t`` for the present state."""
        evaluate(t, dt, self.system, True)

    def settle(self, t: float) -> None:
        """Bring inflow and stall into the steady state of the present motion."""
        for _ in range(6):
            self.evaluate(t)
            settle(self.system)
        self.evaluate(t)

    def rates(self) -> None:
        """Compute the time derivatives of the states of inflow and stall after an evaluation."""
        derivatives(self.system)

    def loads(self, t: float) -> None:
        """Compute section loads and the summary after an evaluation."""
        observe(t, self.model.turbine.drivetrain.generator_efficiency, self.one, self.sections, True)
        if self.model.has_electrical:
            deliver(self._electric_numbers, self._electric_parts)

    def kernel_parts(self) -> tuple[Any, ...]:
        """The machine as the time loop takes it."""
        return self.system, self.one, self.plain, self.sections
