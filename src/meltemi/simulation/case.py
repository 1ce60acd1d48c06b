"""Arrays of one simulation, and the kernels that act on them.

All variables of a run are in two contiguous vectors: the *state* (coordinates, velocities, inflow, stall, actuators)
and the *signals* (every computed quantity that may be recorded). The arrays that kernels take are views of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroMemory, StallState
from meltemi.compiler import N_DERIVATIVES, Kind, View, announce, interpreted, joined, members, without_dispatch
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.entry import Entry
from meltemi.control.faults import healthy
from meltemi.control.signals import MOST_FLAP, MOST_PITCH, MOST_REACTIVE, MOST_TORQUE, REPORTS, Demands, Measurements
from meltemi.environment.course import conditions_array
from meltemi.environment.grid import NOMINAL_FREQUENCY, PowerGrid
from meltemi.simulation.arena import Arena
from meltemi.simulation.channels import Channel
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.parts import Part
from meltemi.simulation.step import (
    begin_parts,
    evaluate,
    inflow_rates,
    observe,
    part_drive_rates,
    part_rates,
    settle_inflow,
    surroundings,
)
from meltemi.simulation.system import Control, March
from meltemi.simulation.tables import Clock, Settings
from meltemi.simulation.validity import new_watch
from meltemi.structure.tables import StepWeights
from meltemi.wind.fields import Wind, wind_arrays

Float = NDArray[np.float64]
LEAST_BRAKE_SPEED = 0.05
"""[rad/s] smallest generator speed within which the dry friction of the brake is smoothed."""
SWEEPS = 6
"""Sweeps that settle inflow and stall."""


class Case:
    """Arrays of one simulation of a model in a wind.

    ``case[name]`` is the array without the nodes that pad the last lanes; ``system``, ``sections`` and ``control`` are
    records of the same memory for kernels, ``one`` the system node by node, ``plain`` the system in plain floats.

    Args:
      parts: parts of the run besides those of the model: the effects of the sea or of other turbines.
      origin: (x, y) [m] position of the turbine in the axes of the wind.
      numbers: number type of the computation: "lanes" evaluates eight nodes of a blade at a time, "floats" one node at
        a time, "duals" with derivatives, which are in ``slopes`` by the names of the arrays.

    Attributes:
      model: the simulated model.
      parts: the parts of model and run.
      tables: tables of the signals by name.
      signals: every quantity that a channel may record; views of one vector.
      aero_state: states of inflow and stall; views of one vector.
      arrays: all arrays by name.
      slopes: derivatives of arrays by the same names, with duals.
      controller, controller_state, entry: the bound controller, its state and its compiled entry point.
    """

    def __init__(
        self,
        model: Model[Any],
        wind: Wind,
        stations: Stations | None = None,
        *,
        numbers: Kind = "lanes",
        grid: PowerGrid | None = None,
        parts: Sequence[Part] = (),
        origin: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        announce()
        rotor, turbine, stations = model.rotor, model.turbine, stations or Stations()
        rotor.check(stations, turbine)
        lanes, duals = numbers == "lanes" and rotor.in_lanes and not interpreted(), numbers == "duals"
        self.model, nq = model, len(model.coordinates)
        coordinates = {"q": (nq,), "v": (nq,), "a": (nq,)}
        self.parts = (*model.parts, *parts)
        self.tables = dict(rotor.signals)
        shapes = {**coordinates, **rotor.shapes(turbine, stations, lanes)}
        for part in self.parts:
            self.tables |= part.signals
            shapes |= part.shapes()
        self.signals = Arena(shapes, duals=duals)
        self.aero_state = Arena(rotor.states(turbine, lanes), duals=duals)
        self.measured, self.limits = Measurements.zeros(), _largest_demands(model)
        self.settings, self.clock = Settings(Settings.zeros()), Clock(np.zeros(len(Clock), dtype=np.int64))
        self.v_old, self.a_old, self.events = np.zeros(nq), np.zeros(nq), np.zeros((0, 3))
        self.spare = np.zeros_like(self.aero_state.vector)
        frequency = NOMINAL_FREQUENCY if turbine.electrical is None else turbine.electrical.frequency
        arrays: dict[str, Any] = {
            **self.signals.views,
            **self.aero_state.views,
            "locked": model.locked.copy(),
            "structure": model.structure.copy(),
            "aero": model.aero.copy(),
            "actuators": model.actuators.copy(),
            "faults": healthy(),
            "watch": new_watch(model),
            "conditions": conditions_array(model.environment, grid, turbine.rated_power, frequency),
            **wind_arrays(wind, turbine.hub_height, turbine.rotor_diameter, origin),
            "measured": self.measured,
            "settings": self.settings.array,
            "v_old": self.v_old,
            "a_old": self.a_old,
            "weights": StepWeights.zeros(coordinate=nq),
            "spare": self.spare,
            **rotor.arrays(turbine, wind, stations, lanes),
        }
        for part in self.parts:
            arrays |= part.arrays()
        system, control = self._classes()
        # members of blade models and parts that show an array once more, node by node
        same = {name: of for each in system.__mro__ for name, of in vars(each).get("SAME", {}).items()}
        arrays |= {name: arrays[of] for name, of in same.items()}
        self.arrays = rotor.shown(arrays)
        self.slopes = {**self.signals.slope_views, **self.aero_state.slope_views}
        if duals:
            records = (system, rotor.sections, control, March)
            constant = {name for record in records for name, member in members(record).items() if member.constant}
            for name, array in arrays.items():
                if name not in self.slopes and name not in constant:
                    self.slopes[name] = np.zeros((*array.shape, N_DERIVATIVES))
            rotor.share_slopes(self.slopes)
            self.slopes |= {name: self.slopes[of] for name, of in same.items() if of in self.slopes}
            self.slopes["aero_state"], self.slopes["signals"] = self.aero_state.slopes, self.signals.slopes
        one: Kind = "duals" if duals else "floats"
        self.system: Any = system("lanes" if lanes else one, arrays, self.slopes)
        self.one: Any = system(one, arrays, self.slopes)
        self.plain: Any = system("floats", arrays)
        self.sections: Any = rotor.sections(one, arrays, self.slopes)
        self.control: Any = control(one, arrays, self.slopes)
        self._begin()

    def _classes(self) -> tuple[Any, Any]:
        """Classes of the records of system and control, with the members of all parts."""
        systems: list[Any] = [part.system for part in self.parts if part.system]
        controls: list[Any] = [part.control for part in self.parts if part.control]
        return joined(self.model.rotor.system, *systems), joined(Control, *controls)

    def _begin(self) -> None:
        """Set the initial values of a case."""
        turbine, options, measured = self.model.turbine, self.model.options, self.control.measured
        measured.n_blades, measured.grid, measured.power_limit = self.model.n_blades, 1.0, np.inf
        self.clock.every_output = self.clock.every_control = 1
        self.clock.corrections = options.advanced.corrections
        self.settings.efficiency = turbine.drivetrain.generator_efficiency
        self.view("drive")["brake_speed"] = LEAST_BRAKE_SPEED
        self.view("drive")["yaw_held"] = float(options.yaw != "free")
        self.view("drive")["yaw_command"] = self["q"][self.model.coordinates.index("yaw")] = options.nacelle_yaw
        memory = self.aero_state.views.get("memory", AeroMemory.zeros(blade=0, node=0))
        memory[AeroMemory.index("phi")] = 0.1
        memory[AeroMemory.index("slope")] = 1.0

    def __getitem__(self, name: str) -> Any:
        return self.arrays[name]

    def view(self, name: str) -> View:
        """A signal array with access to its rows by name."""
        return View(self.tables[name], self.arrays[name])

    def place(self, channel: Channel) -> int:
        """Index of a channel in the vector of signals."""
        array, row = channel.source
        if array in ("q", "v"):
            return self.signals.place(array, (self.model.coordinates.index(row),))
        return self.signals.place(array, (self.tables[array].index(row), *channel.index))

    def bind(self, controller: Controller, start: StartPoint) -> Entry:
        """Attach a controller, initialised at an operating point."""
        self.controller = controller = controller if controller.fresh is None else controller.fresh()
        self.controller_state = controller.initial_state(start)
        rub = self.model.turbine.pitch_actuator.friction
        self.clock.want_loads = int(controller.uses_loads or (rub is not None and rub.coefficient > 0.0))
        duals = bool(self.slopes)
        if duals:
            self.slopes["controller_state"] = np.zeros((*self.controller_state.shape, N_DERIVATIVES))
        self.entry = Entry(controller, self.controller_state, self.measured, self.arrays["demands"], duals=duals)
        return self.entry

    def aero_states(self) -> Float:
        """States and memory of inflow and stall as one vector, whatever the number type."""
        return np.concatenate([np.zeros(0), *(self.arrays[name].reshape(-1) for name in self.aero_state.views)])

    def set_aero_states(self, values: Float) -> None:
        """Set the vector that :meth:`aero_states` returns, and the copies of the last node that pad the lanes."""
        at = 0
        for name, array in self.aero_state.views.items():
            shown = self.arrays[name]
            shown[...] = values[at : at + shown.size].reshape(shown.shape)
            array[..., shown.shape[-1] :] = shown[..., -1:]
            at += shown.size
        if "stall" in self.aero_state.views:
            # between azimuths a Fourier series overshoots: the attachment must stay within its range
            attachment = self.aero_state.views["stall"][StallState.index("attachment")]
            np.clip(attachment, 0.0, 1.0, out=attachment)

    def evaluate(self, t: float, dt: float = 0.0) -> None:
        """Evaluate all quantities at time ``t`` for the present state."""
        self._evaluate(t, dt, self.system)

    @cached_property
    def _evaluate(self) -> Any:
        return without_dispatch(evaluate.of(type(self.system)), 0.0, 0.0, self.system)

    def settle(self, t: float) -> None:
        """Set inflow and stall to their steady state for the present motion."""
        for _ in range(SWEEPS):
            self.evaluate(t)
            settle_inflow(self.system)
        self.evaluate(t)

    def rates(self) -> None:
        """Compute the time derivatives of the states of inflow, stall and parts after an evaluation."""
        inflow_rates(self.system)
        if self.parts:
            part_rates(self.system)

    def loads(self, t: float) -> None:
        """Compute section loads and the summary after an evaluation."""
        self._observe(t, self.control, self.one, self.sections, True)

    @cached_property
    def _observe(self) -> Any:
        return without_dispatch(observe, 0.0, self.control, self.one, self.sections, True)

    def begin_parts(self, dt: float = 0.0) -> None:
        """Set air and grid, and bring the parts into steady operation; ``dt`` [s] as for ``step.begin_parts``."""
        surroundings(0.0, self.control, self.system)
        if self.parts:
            begin_parts(dt, self.control, self.system)
        for part in self.parts:
            part.begin(self)

    def drive_rates(self) -> None:
        """Compute the time derivatives of parts of the drive, and their torque on the shaft, before an evaluation."""
        if self.parts:
            part_drive_rates(self.control, self.system)

    def run(self, places: Any, output: Float) -> March:
        """Record of a run that stores the signals at ``places`` in ``output``."""
        arrays = {
            **self.arrays,
            "clock": self.clock.array,
            "events": self.events,
            "limits": self.limits,
            "controller_state": self.controller_state,
            "aero_state": self.aero_state.vector,
            "signals": self.signals.vector,
            "places": places,
            "output": output,
        }
        return March(self.one.kind, arrays, self.slopes)


def _largest_demands(model: Model[Any]) -> Float:
    """Demands above which a run ends."""
    most, actuator = View(Demands, Demands.zeros()), model.turbine.pitch_actuator
    most["generator_torque"] = MOST_TORQUE * model.turbine.control.torque.maximum_torque
    most["pitch"] = MOST_PITCH + max(abs(actuator.minimum), abs(actuator.maximum))
    most["brake"] = most["yaw_rate"] = 1.0
    most["flap"] = MOST_FLAP
    most["reactive_power"] = MOST_REACTIVE * model.turbine.rated_power
    for name in REPORTS:
        most[name] = np.inf
    return most.array
