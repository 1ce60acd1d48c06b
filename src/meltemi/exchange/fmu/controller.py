"""Functional mock-up units as controller, generator or drivetrain of a simulation, through FMPy."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from meltemi.control.baseline import BaselineController
from meltemi.control.controller import Controller
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.exchange.fmu.library import end_with_python
from meltemi.turbine.power_turbine import AnyTurbine


def fmu_controller(path: str | Path, turbine: AnyTurbine) -> Controller:
    """Controller that calls a co-simulation unit.

    The baseline law of the turbine is computed first. Outputs of the unit with names of demands (``generator_torque``,
    ``pitch_1``; ``pitch`` for all blades) replace its demands, so a generator or drivetrain provides the torque only.
    Inputs have names of measurements, or ``demand.NAME``: what the baseline law asks for. ``measured.NAME`` and
    ``demand.NAME`` are accepted for outputs and inputs alike. Each call sets the inputs of its instant, lets the unit
    step by the sample time, and takes its outputs.

    Args:
      path: path of the ``.fmu``; its code runs in this process, so use only units that you trust.
      turbine: controlled turbine.

    Raises:
      InputError: FMPy is missing, the file is no co-simulation unit of FMI 2.0 or 3.0, or a name or unit of its
        variables is unknown.
    """
    need(f"{path}: an FMU as controller", "fmpy")
    from fmpy import read_model_description

    path = Path(path)
    try:
        description = read_model_description(str(path))
    except Exception as error:
        raise InputError(f"{path}: no functional mock-up unit: {error}") from None
    if description.coSimulation is None or description.fmiVersion not in ("2.0", "3.0"):
        raise InputError(f"{path}: expected a co-simulation unit of FMI 2.0 or 3.0, found FMI {description.fmiVersion}")
    inputs = [_measured(path, v) for v in description.modelVariables if v.causality == "input"]
    outputs = [
        pair for v in description.modelVariables if v.causality == "output" for pair in _demanded(path, v, turbine)
    ]
    if not outputs:
        raise InputError(f"{path}: none of its outputs is a demand, such as generator_torque, pitch or pitch_1")
    step = description.defaultExperiment.stepSize if description.defaultExperiment else None
    law, name, sample_time = BaselineController(turbine), path.stem, None if step is None else float(step)

    def fresh() -> Controller:
        unit = _Unit(path, description, inputs, outputs)

        def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
            law.update(state, measurements, demands, dt)
            unit.step(measurements, demands, dt)

        return Controller(update, init=law.init, sample_time=sample_time, name=name, close=unit.close)

    return Controller(law.update, init=law.init, sample_time=sample_time, name=name, fresh=fresh)


def _measured(path: Path, variable: Any) -> tuple[int, bool, int]:
    """Value reference of an input, whether it is a demand of the baseline law, and its index."""
    name = variable.name
    table: Any = Demands if name.startswith("demand.") else Measurements
    plain = name.removeprefix("demand.").removeprefix("measured.")
    _check(path, "input", plain, variable.unit, table)
    return variable.valueReference, table is Demands, table.index(plain)


def _demanded(path: Path, variable: Any, turbine: AnyTurbine) -> list[tuple[int, int]]:
    """Value reference and index of each demand set by an output; empty for other outputs."""
    plain = variable.name.removeprefix("demand.")
    names = [f"pitch_{b + 1}" for b in range(turbine.n_blades)] if plain == "pitch" else [plain]
    if names[0] not in Demands.names:
        return []
    _check(path, "output", names[0], variable.unit, Demands)
    return [(variable.valueReference, Demands.index(name)) for name in names]


def _check(path: Path, what: str, name: str, unit: str | None, table: Any) -> None:
    if name not in table.names:
        raise InputError(f"{path}: {what} {name!r} is not a variable of a turbine: {did_you_mean(name, table.names)}")
    ours = {row.name: row.unit for row in table.rows}[name]
    if unit not in (None, "", ours, ours.replace(" ", "."), ours.replace(" ", "")):
        raise InputError(f"{path}: {what} {name} has the unit {unit!r}; expected {ours!r}")


class _Unit:
    """Instance of a unit from its first call to its termination."""

    def __init__(
        self, path: Path, description: Any, inputs: Sequence[tuple[int, bool, int]], outputs: Sequence[tuple[int, int]]
    ) -> None:
        from fmpy import extract, platform, supported_platforms
        from fmpy.simulation import instantiate_fmu

        self.folder: str | None = mkdtemp(prefix="meltemi_fmu_")
        try:
            extract(str(path), unzipdir=self.folder)
            self.unit: Any = instantiate_fmu(self.folder, description, "CoSimulation")
        except Exception as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            known = ", ".join(supported_platforms(str(path))) or "none"
            raise InputError(
                f"{path}: its library cannot be loaded here ({error}); it has one for {known}, this is {platform}"
            ) from None
        end_with_python(self.unit.dll._name)
        self.inputs, self.outputs, self.begun = inputs, outputs, False
        self.two = description.fmiVersion == "2.0"
        self.put = self.unit.setReal if self.two else self.unit.setFloat64
        self.get = self.unit.getReal if self.two else self.unit.getFloat64

    def step(self, measurements: Any, demands: Any, dt: float) -> None:
        """One call of the controller."""
        if not self.begun:
            if self.two:
                self.unit.setupExperiment(startTime=measurements.time)
                self.unit.enterInitializationMode()
            else:
                self.unit.enterInitializationMode(startTime=measurements.time)
        values = [(demands if demand else measurements).array[row] for _, demand, row in self.inputs]
        if values:
            self.put([reference for reference, _, _ in self.inputs], values)
        if not self.begun:
            self.unit.exitInitializationMode()
            self.begun = True
        self.unit.doStep(currentCommunicationPoint=measurements.time, communicationStepSize=dt)
        for (_, row), value in zip(self.outputs, self.get([i for i, _ in self.outputs]), strict=True):
            demands.array[row] = value

    def close(self) -> None:
        """Terminate the instance and remove its files; further calls do nothing."""
        if self.folder is not None:
            if self.begun:
                self.unit.terminate()
            self.unit.freeInstance()
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder = None
