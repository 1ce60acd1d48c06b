"""Exported controllers, loaded back through the host of controller libraries."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Turbine
from meltemi.control import BladedController, Controller, make_controller
from meltemi.control_laws.kalman import kalman_step
from meltemi.exchange.controller_library.library import _compile
from meltemi.exchange.controller_library.starts import POLYNOMIAL, STEP, TABLE, start_rules
from meltemi.io import export_controller
from meltemi.simulation.plan import first_point, planned, wind_of
from meltemi.simulation.points import initial_state
from meltemi.turbine import naca64618_flap, with_flaps

NEEDS_C = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
LONG = [pytest.param(name, marks=pytest.mark.long) for name in ("A0", "A1", "A2", "A3", "ipc")]
TURBULENCE = meltemi.TurbulentWind(speed=18.0, intensity=0.14)
CHANNELS = ("pitch_1", "rotor_speed", "generator_power", "generator_torque", "RootMyc1")


def of_start(init: Any) -> Controller:
    return Controller(lambda state, measurements, demands, dt: None, init=init)


def test_rules_of_the_start_are_found(turbine: Turbine) -> None:
    """A constant, polynomials, a step and a smooth function of one quantity each are exact or interpolated."""

    def init(start: Any) -> list[float]:
        p = start.pitch
        return [7.0, start.generator_speed, 3.0 * p + 2.0 * p * p, 6.0 if start.wind_speed > 12.3 else 1.0, np.exp(-p)]

    first, rules, inexact = start_rules(of_start(init), turbine)
    assert first[0] == 7.0
    kinds = {rule.entry: (rule.quantity, rule.kind) for rule in rules}
    assert kinds == {1: (0, POLYNOMIAL), 2: (1, POLYNOMIAL), 3: (3, STEP), 4: (1, TABLE)}
    by_entry = {rule.entry: rule for rule in rules}
    assert (by_entry[1].a, by_entry[1].b, by_entry[1].c) == (0.0, 1.0, 0.0)
    assert by_entry[2].b == pytest.approx(3.0, rel=1e-12) and by_entry[2].c == pytest.approx(2.0, rel=1e-12)
    assert by_entry[3].a == pytest.approx(12.3, rel=1e-9) and (by_entry[3].b, by_entry[3].c) == (1.0, 6.0)
    assert [entry for entry, _ in inexact] == [4] and inexact[0][1] < 1e-6


def test_what_a_library_cannot_contain_is_refused(turbine: Turbine, tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "lib.so"
    with pytest.raises(InputError, match="plain Python"):
        export_controller(of_start(lambda start: [0.0]), turbine, path)
    with pytest.raises(InputError, match="name of a shared library"):
        export_controller(meltemi.control.BaselineController(turbine), turbine, tmp_path / "lib.txt")
    outside = Controller(meltemi.control.ConstantController().update, close=int)
    with pytest.raises(InputError, match="keeps its state outside"):
        export_controller(outside, turbine, path)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(InputError, match="needs a C compiler"):
        _compile(["-v"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@NEEDS_C
def test_a_law_that_makes_arrays_is_refused(turbine: Turbine, tmp_path: Path) -> None:
    @numba.njit
    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands.generator_torque = np.sort(state.copy())[0]

    with pytest.raises(InputError, match=r"needs .*NRT.*arrays"):
        export_controller(Controller(update), turbine, tmp_path / "lib.so")


def deviations(
    model: Model, controller: Controller, wind: Any, folder: Path, channels: tuple[str, ...] = CHANNELS, **given: Any
) -> dict[str, float]:
    """Largest difference of each channel between a run and one under the exported library, over its standard deviation.

    Both begin with the same state; records of the interface have seven digits.
    """
    turbine = model.turbine
    made = export_controller(controller, turbine, folder / "libmade.so")
    run = meltemi.Run(model, wind, duration=20.0, channels=channels, **given)
    field, _ = wind_of(run, plan := planned(run))
    start, _ = initial_state(plan.model, field, None)
    begin = controller.initial_state(first_point(plan.model, field, start))
    with made.parameters.open("a") as file:
        for rule in start_rules(controller, turbine)[1]:
            name = controller.state_names[rule.entry] if controller.state_names else f"state_{rule.entry}"
            file.write(f"{name} {float(begin[rule.entry])!r}\n")
    library = BladedController(
        turbine, made.library, made.parameters, folder=folder, sample_time=controller.sample_time
    )
    wanted, found = (
        meltemi.simulate(model, wind, duration=20.0, channels=channels, controller=law, **given)
        for law in (controller, library)
    )
    return {name: float(np.abs(found[name] - wanted[name]).max() / wanted[name].std()) for name in channels}


@pytest.mark.slow
@NEEDS_C
@pytest.mark.parametrize("name", ["baseline", "supervised", *LONG])
def test_a_library_gives_the_run_to_rounding(model: Model, tmp_path: Path, name: str) -> None:
    """The library exports one symbol."""
    found = deviations(model, make_controller(name, model), TURBULENCE, tmp_path)
    assert max(found.values()) < 2e-5, found
    (log,) = tmp_path.rglob("*.controller.log")
    assert "parameters of" in log.read_text() and "end after 1201 calls" in log.read_text()
    if shutil.which("nm"):
        shown = subprocess.run(
            ["nm", "-D", "--defined-only", tmp_path / "libmade.so"], capture_output=True, text=True, check=True
        )
        assert [line.split()[-1] for line in shown.stdout.splitlines()] == ["DISCON"]


@pytest.mark.long
@NEEDS_C
def test_flaps_leave_by_their_records(turbine: Turbine, tmp_path: Path) -> None:
    """One flap on each blade; the interface has no records for two."""
    one = meltemi.build(with_flaps(turbine))
    law = make_controller("cpfc", one)
    found = deviations(one, law, TURBULENCE, tmp_path, (*CHANNELS, "flap_1_angle_1", "flap_1_angle_3"))
    assert max(found.values()) < 2e-5, found
    flap = naca64618_flap()
    inner, outer = flap.replace(end=0.85), flap.replace(begin=0.85)
    with pytest.raises(InputError, match="2 flaps on each blade"):
        export_controller(law, with_flaps(turbine, inner, outer), tmp_path / "libtwo.so")


@pytest.mark.long
@NEEDS_C
def test_preview_of_the_wind_leaves_in_the_state(model: Model, turbine: Turbine, tmp_path: Path) -> None:
    box = meltemi.wind.generate_field(TURBULENCE, turbine, 20.0)
    seen = meltemi.control.LoadControl(preview=meltemi.analysis.preview_of(model, box))
    found = deviations(model, meltemi.control.LoadController(turbine, seen), box, tmp_path)
    assert max(found.values()) < 2e-5, found


@pytest.mark.long
@NEEDS_C
def test_coordinated_power_yaw_and_pitch_leave(turbine: Turbine, tmp_path: Path) -> None:
    """Individual pitch, a yaw drive under a dead band that the surplus of wind widens, and power control in one law."""
    model = meltemi.build(turbine, meltemi.ModelOptions(yaw="driven"))
    law = meltemi.control.CoordinatedController(
        turbine,
        meltemi.analysis.performance_of(turbine),
        yaw=meltemi.control.YawControl(),
        relief=meltemi.control.Coordination(),
        load=meltemi.control.LoadControl(
            loops=(meltemi.control.HarmonicLoop(harmonic=1, actuator="pitch", integral_gain=1e-9),)
        ),
    )
    found = deviations(model, law, TURBULENCE, tmp_path)
    assert max(found.values()) < 2e-5, found


@pytest.mark.long
@NEEDS_C
def test_an_observer_leaves_in_the_state(model: Model, tmp_path: Path) -> None:
    observer = meltemi.analysis.observer(model)
    estimator = observer.start(14.0)
    wind, velocity = estimator.place("rotor-effective wind"), estimator.place("v tower 1st fore-aft")

    @numba.njit
    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        pitch = (measurements.pitch[0] + measurements.pitch[1] + measurements.pitch[2]) / 3.0
        speed = measurements.generator_speed
        top = (measurements.fore_aft_acceleration, measurements.side_side_acceleration)
        kalman_step(state, (measurements.torque, pitch), (speed, top[0], top[1]))
        demands.generator_torque = 5.0e6 / 0.944 / speed
        for b in range(3):
            demands.pitch[b] = 0.151 + 0.02 * (state[wind] - 14.0) + 0.01 * (speed - 122.9) + 0.02 * state[velocity]

    law = Controller(update, lambda start: estimator.memory.copy(), 0.04, "observer")
    found = deviations(model, law, meltemi.TurbulentWind(speed=14.0, intensity=0.1), tmp_path)
    assert max(found.values()) < 2e-5, found


@pytest.mark.slow
@NEEDS_C
def test_own_controllers_parameters_sample_time_and_messages(model: Model, turbine: Turbine, tmp_path: Path) -> None:
    @numba.njit
    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        state[1] += 1.0
        demands.generator_torque = state[0] + state[1]
        for blade in range(3):
            demands.pitch[blade] = 0.05

    own = Controller(update, lambda s: [4e4, 0.0, s.pitch], 0.05, "own", state_names=("torque", "calls", "begin"))
    made = export_controller(own, turbine, tmp_path / "libown.so")
    assert "torque 40000.0\n" in made.parameters.read_text() and "begin" not in made.parameters.read_text()
    assert "humidity" in made.unmeasured and "generator_speed" not in made.unmeasured

    def torque(text: str | None = None, **more: Any) -> Any:
        if text is not None:
            made.parameters.write_text(text)
        library = BladedController(turbine, made.library, **more)
        found = meltemi.simulate(model, 12.0, duration=0.2, controller=library, channels=["generator_torque"])
        return found["generator_torque"].round(3).tolist()

    expected = [40001.0, 40002.0, 40003.0, 40004.0, 40005.0]
    assert torque() == expected  # the file beside the library, which is the default input
    assert torque("torque 30000 # edited\n\n") == [value - 1e4 for value in expected]
    other = tmp_path / "other.in"
    other.write_text("calls 100\n")
    assert torque(input_file=other) == [value + 100.0 for value in expected]
    for text in ("torqe 1.0", "torque one", "torque"):
        with pytest.raises(meltemi.RunError, match=r"libown.in, line 1: expected the name of a parameter of own"):
            torque(text)
    with pytest.raises(meltemi.RunError, match="its sample time, 0.05 s, is not a multiple"):
        torque("", sample_time=0.02)


@pytest.mark.slow
@NEEDS_C
def test_the_interface_is_called_as_others_do(turbine: Turbine, tmp_path: Path) -> None:
    """Directly from C: number of blades, collective pitch, contactor, and the last call."""
    made = export_controller(meltemi.control.BaselineController(turbine), turbine, tmp_path / "libdirect.so")
    discon = ctypes.CDLL(str(made.library)).DISCON
    swap, fail, text = (ctypes.c_float * 3300)(), ctypes.c_int(), ctypes.create_string_buffer(4096)
    root = ctypes.create_string_buffer(str(tmp_path / "root").encode())

    def call(status: float) -> None:
        swap[0] = status
        discon(swap, ctypes.byref(fail), ctypes.create_string_buffer(b""), root, text)

    swap[2], swap[3], swap[19], swap[22], swap[26], swap[60] = 0.01, 0.1, 122.9, 4.3e4, 15.0, 2.0
    call(0.0)
    assert fail.value == -1 and b"made for nrel5mw with 3 blades, called for 2" in text.value
    swap[60], swap[32], swap[33] = 3.0, 0.1, 0.1
    call(0.0)
    assert fail.value == 0 and swap[34] == 1.0 and swap[54] == swap[55] == 0.0
    assert swap[44] == pytest.approx(swap[41], rel=1e-6) and swap[41] == pytest.approx(0.1, abs=1e-3)
    assert swap[46] == pytest.approx(4.3e4, rel=0.02)
    swap[19] = float("nan")
    call(1.0)
    assert fail.value == -1 and b"not finite" in text.value
    call(-1.0)
    assert "end after 2 calls" in (tmp_path / "root.controller.log").read_text()
