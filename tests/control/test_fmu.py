"""Functional mock-up units: turbines as units against ``step()``, and units as controllers against the same law."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model
from meltemi.control import Controller, make_controller
from meltemi.core.extras import missing
from meltemi.io import export_fmu, fmu_controller
from meltemi.loadcases.case import LoadCase, case_run, case_turbine
from meltemi.simulation.simulate import Simulation
from meltemi_exchange.fmu.variables import base_units

fmpy = pytest.importorskip("fmpy", reason="needs FMPy")
pytestmark = pytest.mark.skipif(bool(missing(["pythonfmu", "pythonfmu3"])), reason="needs pythonfmu and pythonfmu3")
BOTH = pytest.mark.parametrize("fmi", ["2.0", "3.0"])
CHANNELS = ("RootMyc1", "generator_power")


def case_of(turbine: str = "nrel5mw", controller: str = "fixed", **keys: Any) -> LoadCase:
    wind = keys.pop("wind", {"kind": "steady", "speed": 13.0})
    return LoadCase(turbine=turbine, wind=wind, duration=20.0, controller=controller, **{"channels": CHANNELS, **keys})


class Master:
    """A unit, stepped by FMPy, with its variables by name."""

    def __init__(self, path: Path, folder: Path, **texts: str) -> None:
        from fmpy.simulation import instantiate_fmu

        self.description = fmpy.read_model_description(str(path))  # which validates against the schema
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.causality = {v.name: v.causality for v in self.description.modelVariables}
        fmpy.extract(str(path), unzipdir=str(folder))
        self.unit = instantiate_fmu(str(folder), self.description, "CoSimulation")
        self.two = self.description.fmiVersion == "2.0"
        for name, text in texts.items():
            self.unit.setString([self.reference[name]], [text])
        if self.two:
            self.unit.setupExperiment()
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        self.time = 0.0

    def set(self, **values: float) -> None:
        put = self.unit.setReal if self.two else self.unit.setFloat64
        put([self.reference[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        take = self.unit.getReal if self.two else self.unit.getFloat64
        return list(take([self.reference[name] for name in names]))

    def step(self, dt: float) -> None:
        self.unit.doStep(currentCommunicationPoint=self.time, communicationStepSize=dt)
        self.time += dt

    def outputs(self) -> list[float]:
        return self.get(*[name for name, causality in self.causality.items() if causality == "output"])


@pytest.mark.parametrize("fmi", ["3.0"])  # 2.0 in a process of its own, below
def test_a_turbine_as_unit_has_the_bits_of_step(tmp_path: Path, fmi: Any) -> None:
    case = case_of()
    path = export_fmu(case, tmp_path / "turbine.fmu", fmi=fmi)
    master = Master(path, tmp_path / "unit")
    run = Simulation(case_run(case, case_turbine(case, Path()), Path()))
    here = run.reset()
    names = [name for name in dict(here) if f"measured.{name}" in master.reference]
    assert len(names) > 20
    for i in range(60):
        assert master.get(*[f"measured.{name}" for name in names]) == [here[name] for name in names]
        torque, pitch = 4.3e4 - 10.0 * i, 0.1 + 0.001 * i
        master.set(**{"demand.generator_torque": torque, **{f"demand.pitch_{b}": pitch for b in (1, 2, 3)}})
        master.step(run.dt)
        here = run.step({"generator_torque": torque, "pitch": pitch})
    result = run.result()
    # channels are those of the last time step, which is 0.01 s before; the samples here are every 0.05 s
    assert result.time[-1] == pytest.approx(0.55)
    fine = Simulation(case_run(case.replace(output_step=run.dt), case_turbine(case, Path()), Path()))
    for i in range(60):
        fine.step({"generator_torque": 4.3e4 - 10.0 * i, "pitch": 0.1 + 0.001 * i})
    assert master.get("root_moment_out_of_plane_1", "generator_power") == list(fine.result().data[-1])


@BOTH
def test_validation_units_icon_and_documentation(fmi: Any, tmp_path: Path) -> None:
    from zipfile import ZipFile

    path = export_fmu(case_of(), tmp_path / "turbine.fmu", fmi=fmi)
    assert fmpy.validation.validate_fmu(str(path)) == []
    with ZipFile(path) as file:
        names = file.namelist()
        assert ("model.png" if fmi == "2.0" else "terminalsAndIcons/icon.png") in names
        assert b"meltemi" in file.read("documentation/index.html")
    description = fmpy.read_model_description(str(path))
    units = {v.name: v.unit for v in description.modelVariables}
    assert units["wind_speed"] == "m/s" and units["demand.generator_torque"] == "N m"
    assert {v.name for v in description.modelVariables if v.variability == "tunable"} == {
        "shear_exponent",
        "air_density",
    }


@pytest.mark.slow
@pytest.mark.parametrize("test", ["bits_of_step"])
def test_the_same_of_fmi_2_in_a_process_of_its_own(test: str, tmp_path: Path) -> None:
    """The library of pythonfmu allows one instance in a process."""
    name = next(name for name in globals() if test in name)
    code = f"from pathlib import Path; import test_fmu; test_fmu.{name}(Path({str(tmp_path)!r}), '2.0')"
    subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, check=True)


def test_base_units_of_units() -> None:
    assert base_units("N m") == {"kg": 1, "m": 2, "s": -2}
    assert base_units("m/s^2") == {"m": 1, "s": -2}
    assert base_units("N m/m") == {"kg": 1, "m": 1, "s": -2}
    assert base_units("-") == {}


@pytest.mark.parametrize("fmi", ["3.0"])  # 2.0 in a process of its own, below
def test_every_input_and_parameter_changes_something(tmp_path: Path, fmi: Any) -> None:
    path = export_fmu(case_of(controller="baseline"), tmp_path / "turbine.fmu", fmi=fmi)
    plain = None
    changes = {"": 0.0, "wind_speed": 14.0, "wind_direction": 0.2, "shear_exponent": 0.2, "air_density": 1.0}
    changes |= {"pitch_offset_1": 0.02, "grid_frequency": 49.0}
    master = Master(path, tmp_path / "unit")
    begin = master.unit.getFMUState()
    for name, value in changes.items():
        master.unit.setFMUState(begin)
        master.time = 0.0
        if name:
            master.set(**{name: value})
        for _ in range(50):
            master.step(0.01)
        found = master.outputs()
        plain = found if plain is None else plain
        assert (found != plain) == bool(name), name
    assert master.causality.keys() >= changes.keys() - {""}


@pytest.mark.parametrize("fmi", ["3.0"])  # 2.0 in a process of its own, below
def test_a_saved_state_continues_with_the_same_bits(tmp_path: Path, fmi: Any) -> None:
    path = export_fmu(case_of(controller="baseline"), tmp_path / "turbine.fmu", fmi=fmi)
    master = Master(path, tmp_path / "unit")
    master.set(wind_speed=15.0)
    master.step(0.5)
    state = master.unit.getFMUState()
    data = getattr(master.unit, "serializeFMUState" if fmi == "3.0" else "serializeFMUstate")(state)
    master.step(0.5)
    first = master.outputs()
    master.set(wind_speed=9.0)
    master.step(0.5)
    again_in = [master] if fmi == "2.0" else [master, Master(path, tmp_path / "other")]  # another one, from the bytes
    for again in again_in:
        restored = getattr(again.unit, "deserializeFMUState" if fmi == "3.0" else "deSerializeFMUstate")(data)
        again.unit.setFMUState(restored)
        assert again.get("wind_speed") == [15.0]
        again.time = 0.5
        again.step(0.5)
        assert again.outputs() == first


def test_a_wind_file_takes_the_place_of_the_wind_inputs(tmp_path: Path) -> None:
    from meltemi.io import write_wnd

    wind = meltemi.wind.WindSeries(time=[0.0, 1.0, 30.0], speed=[13.0, 11.0, 11.0])
    write_wnd(wind, tmp_path / "step.wnd")
    path = export_fmu(case_of(), tmp_path / "turbine.fmu")
    master = Master(path, tmp_path / "unit", wind_file=str(tmp_path / "step.wnd"))
    for speed in (9.0, 20.0):
        master.set(wind_speed=speed)
        master.step(0.75)
    assert master.get("measured.wind_speed") == pytest.approx([11.0])
    with pytest.raises(Exception, match="DoStep"):  # the wind ends
        master.step(40.0)


def test_what_cannot_be_exported_or_stepped_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected the ending \.fmu"):
        export_fmu(case_of(), tmp_path / "turbine.zip")
    with pytest.raises(InputError, match=r"expected '2.0' or '3.0'"):
        export_fmu(case_of(), tmp_path / "turbine.fmu", fmi="1.0")  # type: ignore[arg-type]
    master = Master(export_fmu(case_of(), tmp_path / "turbine.fmu"), tmp_path / "unit")
    with pytest.raises(Exception, match="DoStep"):
        master.step(0.0125)


@pytest.mark.long
def test_a_power_coefficient_turbine_follows_the_power_that_is_set(tmp_path: Path) -> None:
    case = case_of("pmsg20mw", "A2", channels=("generator_power",))
    master = Master(export_fmu(case, tmp_path / "power.fmu"), tmp_path / "unit")
    master.set(power_reference=8e6)
    for _ in range(30):
        master.step(1.0)
    assert master.get("measured.power") == pytest.approx([8e6], rel=0.01)


LAW = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Law(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.values, self.filtered = {{}}, 0.0
        for name, causality in {variables}:
            self.values[name] = 0.0
            put = lambda value, name=name: self.values.update({{name: value}})
            kind = getattr(Fmi2Causality, causality)
            take = lambda name=name: self.values[name]
            self.register_variable(Real(name, causality=kind, getter=take, setter=put), nested=False)

    def do_step(self, time, dt):
        x = self.values
        {step}
        return True
"""
CONTROLLER = {
    "variables": [("generator_speed", "input"), ("generator_torque", "output"), ("pitch", "output")],
    "step": "x['generator_torque'], x['pitch'] = 4.3e4, 0.1 + 0.01 * (x['generator_speed'] - 122.9)",
}


def unit_of(folder: Path, name: str, words: dict[str, Any]) -> Path:
    from pythonfmu.builder import FmuBuilder

    script = folder / f"{name}.py"
    script.write_text(LAW.format(**words))
    return Path(FmuBuilder.build_FMU(script, folder / f"{name}.fmu"))


def test_a_controller_as_unit_has_the_bits_of_the_same_law_here(model: Model, tmp_path: Path) -> None:
    def law(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands.generator_torque = 4.3e4
        for blade in range(3):
            demands.pitch[blade] = 0.1 + 0.01 * (measurements.generator_speed - 122.9)

    path = unit_of(tmp_path, "law_unit", CONTROLLER)
    runs = [
        meltemi.simulate(model, 13.0, duration=2.0, controller=each)
        for each in (Controller(law), make_controller(str(path), model), fmu_controller(path, model.turbine))
    ]
    assert np.array_equal(runs[0].data, runs[1].data) and np.array_equal(runs[0].data, runs[2].data)
    assert runs[1].meta["controller"] == "law_unit"


def test_a_generator_as_unit_gives_the_torque_and_leaves_the_pitch(model: Model, tmp_path: Path) -> None:
    """Its torque lags behind what the baseline law demands by a time constant of 0.2 s, explicitly."""
    lag = (
        "self.filtered += dt / 0.2 * (x['demand.generator_torque'] - self.filtered); "
        "x['generator_torque'] = self.filtered"
    )
    variables = [("demand.generator_torque", "input"), ("generator_torque", "output")]
    path = unit_of(tmp_path, "generator_unit", {"variables": variables, "step": lag})
    law = meltemi.control.BaselineController(model.turbine)
    held = [0.0]

    def lagged(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        law.update(state, measurements, demands, dt)
        held[0] += dt / 0.2 * (demands.generator_torque - held[0])
        demands.generator_torque = held[0]

    channels = ["generator_torque", "pitch_1", "rotor_speed"]
    here = meltemi.simulate(model, 8.0, duration=2.0, controller=Controller(lagged, init=law.init), channels=channels)
    unit = meltemi.simulate(model, 8.0, duration=2.0, controller=fmu_controller(path, model.turbine), channels=channels)
    assert np.array_equal(here.data, unit.data)
    assert here["generator_torque"][0] < 0.1 * here["generator_torque"][-1]


def test_units_that_are_no_controllers_are_refused(model: Model, tmp_path: Path) -> None:
    turbine = model.turbine
    (tmp_path / "none.fmu").write_text("nothing")
    with pytest.raises(InputError, match="no functional mock-up unit"):
        fmu_controller(tmp_path / "none.fmu", turbine)
    wrong = {"variables": [("pitch", "output"), ("generator_sped", "input")], "step": "pass"}
    path = unit_of(tmp_path, "wrong_unit", wrong)
    with pytest.raises(InputError, match=r"'generator_sped' is none of a turbine's: did you mean .*generator_speed"):
        make_controller(str(path), model)
    path = unit_of(tmp_path, "idle_unit", {"variables": [("generator_speed", "input")], "step": "pass"})
    with pytest.raises(InputError, match="none of its outputs is a demand"):
        fmu_controller(path, turbine)
    with pytest.raises(InputError, match="missing"):
        make_controller(str(tmp_path / "missing.fmu"), model)
