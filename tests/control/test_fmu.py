"""Functional mock-up units: turbines as units against ``step()``, and units as controllers against the same law."""

from __future__ import annotations

import atexit
import ctypes
import gc
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model
from meltemi.cases.case import LoadCase, case_run, case_turbine
from meltemi.control import Controller, make_controller
from meltemi.core.extras import missing
from meltemi.exchange.fmu.library import end_with_python
from meltemi.exchange.fmu.variables import base_units
from meltemi.io import export_fmu, fmu_controller
from meltemi.simulation.simulate import Simulation

fmpy = pytest.importorskip("fmpy", reason="needs FMPy")
pytestmark = pytest.mark.skipif(bool(missing(["pythonfmu", "pythonfmu3"])), reason="needs pythonfmu and pythonfmu3")
BOTH = pytest.mark.parametrize("fmi", ["2.0", "3.0"])
CHANNELS = ("RootMyc1", "generator_power")
Exported = Callable[..., Path]


def case_of(turbine: str = "nrel5mw", controller: str = "fixed", **keys: Any) -> LoadCase:
    wind = keys.pop("wind", {"kind": "steady", "speed": 13.0})
    return LoadCase(turbine=turbine, wind=wind, duration=20.0, controller=controller, **{"channels": CHANNELS, **keys})


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """Units by controller and version, each written once."""
    made: dict[tuple[str, str], Path] = {}

    def export(controller: str, fmi: Any) -> Path:
        if (controller, fmi) not in made:
            path = tmp_path_factory.mktemp("unit") / "turbine.fmu"
            made[controller, fmi] = export_fmu(case_of(controller=controller), path, fmi=fmi)
        return made[controller, fmi]

    return export


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

    def saved(self) -> tuple[Any, bytes]:
        """The state, and its bytes."""
        unit = self.unit
        state = unit.getFMUstate() if self.two else unit.getFMUState()
        return state, unit.serializeFMUstate(state) if self.two else unit.serializeFMUState(state)

    def restore(self, state: Any, time: float) -> None:
        """Go back to a state, or to one of bytes."""
        if isinstance(state, bytes):
            state = self.unit.deSerializeFMUstate(state) if self.two else self.unit.deserializeFMUState(state)
        (self.unit.setFMUstate if self.two else self.unit.setFMUState)(state)
        self.time = time

    def end(self) -> None:
        self.unit.terminate()
        self.unit.freeInstance()

    def step(self, dt: float) -> None:
        self.unit.doStep(currentCommunicationPoint=self.time, communicationStepSize=dt)
        self.time += dt

    def outputs(self) -> list[float]:
        return self.get(*[name for name, causality in self.causality.items() if causality == "output"])


@pytest.mark.parametrize("fmi", [pytest.param("2.0", marks=pytest.mark.slow), "3.0"])
def test_a_turbine_as_unit_has_the_bits_of_step(exported: Exported, tmp_path: Path, fmi: Any) -> None:
    master = Master(exported("fixed", fmi), tmp_path)
    case = case_of(output_step=0.01)
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
    assert run.dt == 0.01  # channels are those of the last time step
    assert master.get("root_moment_out_of_plane_1", "generator_power") == list(run.result().data[-1])


@BOTH
def test_validation_units_icon_and_documentation(exported: Exported, fmi: Any) -> None:
    from zipfile import ZipFile

    from fmpy.validation import validate_fmu

    path = exported("fixed", fmi)
    assert validate_fmu(str(path)) == []
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


def test_base_units_of_units() -> None:
    assert base_units("N m") == {"kg": 1, "m": 2, "s": -2}
    assert base_units("m/s^2") == {"m": 1, "s": -2}
    assert base_units("N m/m") == {"kg": 1, "m": 1, "s": -2}
    assert base_units("-") == {}


@pytest.mark.slow
@BOTH
def test_every_input_and_parameter_changes_something(exported: Exported, tmp_path: Path, fmi: Any) -> None:
    plain = None
    changes = {"": 0.0, "wind_speed": 14.0, "wind_direction": 0.2, "shear_exponent": 0.2, "air_density": 1.0}
    changes |= {"pitch_offset_1": 0.02, "grid_frequency": 49.0}
    master = Master(exported("baseline", fmi), tmp_path)
    begin, _ = master.saved()
    for name, value in changes.items():
        master.restore(begin, 0.0)
        if name:
            master.set(**{name: value})
        for _ in range(50):
            master.step(0.01)
        found = master.outputs()
        plain = found if plain is None else plain
        assert (found != plain) == bool(name), name
    assert master.causality.keys() >= changes.keys() - {""}


@pytest.mark.slow
@BOTH
def test_a_saved_state_continues_with_the_same_bits(exported: Exported, tmp_path: Path, fmi: Any) -> None:
    """In the same instance, and from its bytes in another one."""
    path = exported("baseline", fmi)
    master = Master(path, tmp_path / "unit")
    master.set(wind_speed=15.0)
    master.step(0.5)
    state, data = master.saved()
    master.step(0.5)
    first = master.outputs()
    master.set(wind_speed=9.0)
    master.step(0.5)
    assert master.outputs() != first
    for again, kept in ((master, state), (Master(path, tmp_path / "other"), data)):
        again.restore(kept, 0.5)
        assert again.get("wind_speed") == [15.0]
        again.step(0.5)
        assert again.outputs() == first


@pytest.mark.slow
@BOTH
def test_instances_live_and_end_apart(exported: Exported, tmp_path: Path, fmi: Any) -> None:
    """Four, two at a time: each follows its own wind; whatever Python has collected, the next one begins."""
    path, found = exported("baseline", fmi), []
    for i in range(2):
        pair = [Master(path, tmp_path / f"{i}{j}") for j in range(2)]
        for master, speed in zip(pair, (9.0, 15.0), strict=True):
            master.set(wind_speed=speed)
        for _ in range(5):
            for master in pair:
                master.step(0.1)
        found.append([master.outputs() for master in pair])
        for master in pair:
            master.end()
        gc.collect()
    assert found[0] == found[1] and found[0][0] != found[0][1]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="ends well elsewhere")
@BOTH
def test_libraries_end_with_python(exported: Exported, tmp_path: Path, fmi: Any, monkeypatch: Any) -> None:
    """Asked for by the unit and by the host of units as controllers, for the library that the master has loaded."""
    ends, register = list[Any](), atexit.register
    monkeypatch.setattr(atexit, "register", lambda end: (ends.append(end), register(end)))
    master = Master(exported("fixed", fmi), tmp_path)
    end_with_python(master.unit.dll._name)
    address = ctypes.cast(master.unit.dll.finalizePythonInterpreter, ctypes.c_void_p).value
    asked = [end for end in ends if getattr(end, "__name__", "") == "finalizePythonInterpreter"]
    assert [ctypes.cast(end, ctypes.c_void_p).value for end in asked] == 2 * [address]
    end_with_python("libc.so.6")  # a library of another kind
    end_with_python(tmp_path / "none.so")
    assert len(ends) == 2


@pytest.mark.slow
def test_a_wind_file_takes_the_place_of_the_wind_inputs(exported: Exported, tmp_path: Path) -> None:
    from meltemi.io import write_wnd

    wind = meltemi.wind.WindSeries(time=[0.0, 1.0, 30.0], speed=[13.0, 11.0, 11.0])
    write_wnd(wind, tmp_path / "step.wnd")
    master = Master(exported("fixed", "3.0"), tmp_path / "unit", wind_file=str(tmp_path / "step.wnd"))
    for speed in (9.0, 20.0):
        master.set(wind_speed=speed)
        master.step(0.75)
    assert master.get("measured.wind_speed") == pytest.approx([11.0])
    with pytest.raises(Exception, match="DoStep"):  # the wind ends
        master.step(40.0)


def test_what_cannot_be_exported_or_stepped_is_refused(exported: Exported, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected the ending \.fmu"):
        export_fmu(case_of(), tmp_path / "turbine.zip")
    with pytest.raises(InputError, match=r"expected '2.0' or '3.0'"):
        export_fmu(case_of(), tmp_path / "turbine.fmu", fmi="1.0")  # type: ignore[arg-type]
    master = Master(exported("fixed", "3.0"), tmp_path / "unit")
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
from {package} import {number}, {causality}, {base}


class Law({base}):
    def __init__(self, **given):
        super().__init__(**given)
        self.values, self.filtered = {{}}, 0.0
        for name, causality in {variables}:
            self.values[name] = 0.0
            put = lambda value, name=name: self.values.update({{name: value}})
            kind = getattr({causality}, causality)
            take = lambda name=name: self.values[name]
            self.register_variable({number}(name, causality=kind, getter=take, setter=put), nested=False)

    def do_step(self, time, dt):
        x = self.values
        {step}
        return True
"""
WORDS = {
    "2.0": {"package": "pythonfmu", "base": "Fmi2Slave", "number": "Real", "causality": "Fmi2Causality"},
    "3.0": {"package": "pythonfmu3", "base": "Fmi3Slave", "number": "Float64", "causality": "Fmi3Causality"},
}
CONTROLLER = {
    "variables": [("generator_speed", "input"), ("generator_torque", "output"), ("pitch", "output")],
    "step": "x['generator_torque'], x['pitch'] = 4.3e4, 0.1 + 0.01 * (x['generator_speed'] - 122.9)",
}


def unit_of(folder: Path, name: str, words: dict[str, Any], fmi: str = "2.0") -> Path:
    from importlib import import_module

    script, clock = folder / f"{name}.py", [("time", "independent")] * (fmi == "3.0")
    script.write_text(LAW.format(**WORDS[fmi], **words | {"variables": words["variables"] + clock}))
    builder = import_module(f"{WORDS[fmi]['package']}.builder").FmuBuilder
    return Path(builder.build_FMU(script, folder / "built")).rename(folder / f"{name}.fmu")


@BOTH
def test_a_controller_as_unit_has_the_bits_of_the_same_law_here(model: Model, tmp_path: Path, fmi: str) -> None:
    def law(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands.generator_torque = 4.3e4
        for blade in range(3):
            demands.pitch[blade] = 0.1 + 0.01 * (measurements.generator_speed - 122.9)

    name = f"law_unit_{fmi[0]}"
    path = unit_of(tmp_path, name, CONTROLLER, fmi)
    runs = [
        meltemi.simulate(model, 13.0, duration=2.0, controller=each)
        for each in (Controller(law), make_controller(str(path), model), fmu_controller(path, model.turbine))
    ]
    assert np.array_equal(runs[0].data, runs[1].data) and np.array_equal(runs[0].data, runs[2].data)
    assert runs[1].meta["controller"] == name


@BOTH
def test_a_generator_as_unit_gives_the_torque_and_leaves_the_pitch(model: Model, tmp_path: Path, fmi: str) -> None:
    """Its torque lags behind what the baseline law demands by a time constant of 0.2 s, explicitly."""
    lag = (
        "self.filtered += dt / 0.2 * (x['demand.generator_torque'] - self.filtered); "
        "x['generator_torque'] = self.filtered"
    )
    variables = [("demand.generator_torque", "input"), ("generator_torque", "output")]
    path = unit_of(tmp_path, f"generator_unit_{fmi[0]}", {"variables": variables, "step": lag}, fmi)
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
    with pytest.raises(
        InputError, match=r"'generator_sped' is not a variable of a turbine: did you mean .*generator_speed"
    ):
        make_controller(str(path), model)
    path = unit_of(tmp_path, "idle_unit", {"variables": [("generator_speed", "input")], "step": "pass"})
    with pytest.raises(InputError, match="none of its outputs is a demand"):
        fmu_controller(path, turbine)
    with pytest.raises(InputError, match="missing"):
        make_controller(str(tmp_path / "missing.fmu"), model)
