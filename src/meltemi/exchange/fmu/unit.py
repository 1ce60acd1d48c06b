"""Implementation of a turbine's unit: the methods that pythonfmu and pythonfmu3 call for the master."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from meltemi.cases.case import LoadCase, case_run, case_turbine
from meltemi.control.signals import CALLBACK
from meltemi.core.yamlfile import read_record
from meltemi.exchange.fmu.library import end_with_python
from meltemi.exchange.fmu.variables import model_description, variables_of
from meltemi.simulation.simulate import Simulation
from meltemi.wind.fields import SteadyWind

CASE, ABOUT = "case.yaml", "about.json"
"""Files in the resources of the unit: the case that it runs, and the head of its description."""


class Unit:
    """Mixin of the classes ``Fmi2Slave`` and ``Fmi3Slave``; it precedes them in the list of bases and overrides their
    methods.

    The state is that of ``Simulation.moving`` (docs/guide/saved-states.md) and the values that the master has set.
    """

    log_queue: list[Any]

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self._folder, self._wind_file = Path(given["resources"]), ""
        self._about: dict[str, str] = json.loads((self._folder / ABOUT).read_text("utf-8"))
        self.modelName = self._about["modelIdentifier"]
        self._begin()
        for path in self._folder.parent.glob(f"binaries/*/{self.modelName}.so"):
            end_with_python(path)

    def _begin(self) -> None:
        """Prepare the run at its start."""
        case = read_record(self._folder / CASE, LoadCase)
        if self._wind_file:
            keys = case.model_dump(mode="json", exclude_defaults=True)
            case = LoadCase(**keys | {"wind": {"kind": "file", "file": str(Path(self._wind_file).absolute())}})
        run = case_run(case, case_turbine(case, self._folder), self._folder)
        self._run = Simulation(run, held_steps=2)  # samples are not stored: the master records them
        self._endless = isinstance(self._run.wind, SteadyWind)
        self._variables = variables_of(self._run, case.controller.kind)
        arrays = {v.array: self._run.case[v.array] for v in self._variables if v.array}
        arrays[""] = self._run.case.signals.vector
        self._places = [(arrays[v.array], v.index if len(v.index) > 1 else v.index[0]) for v in self._variables]
        self._places += [(np.zeros(1), 0), (self._run.case.measured, 0)]  # the wind file, which is text; time
        self._set = [i for i, v in enumerate(self._variables) if v.causality != "output"]
        self._run.reset()

    def to_xml(self, model_options: Any = None) -> Element:
        """The model description."""
        starts = self.get_real(range(len(self._variables)))
        experiment = {"stopTime": f"{self._run.duration:g}", "stepSize": repr(self._run.dt)}
        return model_description(self._variables, starts, self._about["version"], self._about, experiment)

    def get_real(self, references: Sequence[int]) -> list[float]:
        """Values of variables."""
        return [float(array[index]) for array, index in map(self._places.__getitem__, references)]

    def set_real(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs and parameters."""
        for i, value in zip(references, values, strict=True):
            array, index = self._places[i]
            array[index] = value

    get_float64, set_float64 = get_real, set_real

    def get_string(self, references: Sequence[int]) -> list[str]:
        """The wind file."""
        return [self._wind_file for _ in references]

    def set_string(self, references: Sequence[int], values: Sequence[str]) -> None:
        """Set the wind file, before the initialization is over."""
        self._wind_file = values[-1]

    def exit_initialization_mode(self) -> None:
        """Begin the run; with a wind file the run is prepared again, with the values that the master has set."""
        if self._wind_file:
            described, values = self._variables, self.get_real(self._set)
            self._begin()
            now = {v.name: place for v, place in zip(self._variables, self._places[:-2], strict=True)}
            # value references stay: inputs of the wind act no longer, and go nowhere
            self._places = [now.get(v.name, (np.zeros(1), 0)) for v in described] + self._places[-2:]
            self._variables, self._set = described, [i for i, v in enumerate(described) if v.causality != "output"]
            self.set_real(self._set, values)
        self._run._measure()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance to the end of a communication step, which is a multiple of the time step of the run."""
        run, steps = self._run, round(step_size / self._run.dt)
        if steps < 1 or abs(steps * run.dt - step_size) > 1e-6 * run.dt:
            return self._refuse(f"the communication step {step_size:g} s is no multiple of the time step {run.dt:g} s")
        if abs(current_time - run.time) > 1e-3 * run.dt:
            return self._refuse(f"the unit is at {run.time:g} s, not at {current_time:g} s")
        clock = run.case.clock
        if self._endless:
            run.n_steps = int(clock.step) + steps + 1
        elif int(clock.step) + steps > run.n_steps:
            return self._refuse(f"the wind ends at {run.duration:g} s")
        clock.want_loads = 1
        for _ in range(steps):
            clock.row = 0
            run.advance(1)
        if run.finished and not run.status.complete:
            return self._refuse(run.message)
        run._measure()
        return True

    def _refuse(self, why: str) -> bool:
        self.log(why, self._status())  # type: ignore[attr-defined]
        return False

    def _status(self) -> Any:
        """The status ``discard`` of the standard that the class implements."""
        from importlib import import_module

        name = "pythonfmu3" if self._about["version"] == "3.0" else "pythonfmu"
        return getattr(import_module(f"{name}.enums"), "Fmi3Status" if name[-1] == "3" else "Fmi2Status").discard

    def _get_fmu_state(self) -> dict[str, Any]:
        state = {f"moving_{i}": array.copy() for i, array in enumerate(self._run.moving)}
        return state | {"set": np.array(self.get_real(self._set))}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        address = self._run.case.measured[CALLBACK]  # of this process
        for i, array in enumerate(self._run.moving):
            array[...] = state[f"moving_{i}"]
        self._run.case.measured[CALLBACK] = address
        self.set_real(self._set, state["set"])

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        file = io.BytesIO()
        np.savez(file, **state)
        return file.getvalue()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        with np.load(io.BytesIO(state), allow_pickle=False) as archive:
            return dict(archive)
