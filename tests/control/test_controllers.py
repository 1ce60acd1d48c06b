"""The plug-in contract: compiled and plain controllers, what ends a run, the order at a sample instant."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi import Controller, InputError, Model, ModelOptions, RunError, Start, Status, SteadyWind, Turbine, simulate
from meltemi.compiler import statistics
from meltemi.control import signals as s

WIND = SteadyWind(speed=11.0)
BEGIN = Start(rotor_speed=1.2, generator_torque=3e4)


@numba.njit
def hold(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    demands[s.GENERATOR_TORQUE] = 3.0e4


@numba.njit
def damp(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    state[0] += dt
    demands[s.GENERATOR_TORQUE] = 3.0e4 + 100.0 * (measurements[s.GENERATOR_SPEED] - 116.0)


def test_swapping_compiled_controllers_compiles_nothing_else(model: Model) -> None:
    simulate(model, WIND, duration=1.0, controller=Controller(update=hold), start=BEGIN)
    before = statistics()
    result = simulate(model, WIND, duration=1.0, controller=Controller(update=damp), start=BEGIN)
    assert statistics() == before
    assert result.status is Status.OK


@pytest.mark.long
def test_a_second_process_finds_all_in_the_cache() -> None:
    code = """
import json, meltemi, numba
from meltemi.control import signals as s
from meltemi.compiler import statistics
model = meltemi.build(meltemi.load_turbine("nrel5mw"))
wind = meltemi.SteadyWind(speed=11.0)
def plain(state, measurements, demands, dt):
    demands[s.GENERATOR_TORQUE] = 3.0e4
own = [meltemi.Controller(update=update) for update in (numba.njit(plain), plain)]
for controller in (None, meltemi.control.ConstantController(), *own):
    meltemi.simulate(model, wind, duration=1.0, controller=controller)
print(json.dumps(statistics()))
"""
    runs = [
        json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
        for _ in range(2)
    ]
    signatures, compiled = runs[1]
    assert signatures >= 5  # those called from Python; what they call stands inside them
    assert compiled == 0


def test_plain_python_gives_the_same_as_compiled(model: Model) -> None:
    results = [
        simulate(model, WIND, duration=5.0, controller=Controller(update=update), start=BEGIN)
        for update in (damp, damp.py_func)
    ]
    assert np.array_equal(results[0].data, results[1].data)


def test_sampling_period(model: Model) -> None:
    calls: list[float] = []

    def count(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        calls.append(measurements[s.TIME])
        assert dt == pytest.approx(0.1)

    simulate(model, WIND, duration=1.0, controller=Controller(update=count, sample_time=0.1), start=BEGIN)
    assert calls == pytest.approx(np.arange(11) * 0.1)
    with pytest.raises(InputError, match="multiple"):
        simulate(model, WIND, duration=1.0, controller=Controller(update=count, sample_time=0.0333), start=BEGIN)


def test_a_controller_says_what_it_noticed(model: Model) -> None:
    def noticed(state: Any) -> list[str]:
        return [f"state is {state[0]:.2f}"]

    controller = Controller(damp, warnings=noticed)
    result = simulate(model, WIND, duration=1.0, controller=controller, start=BEGIN)
    assert result.warnings == ("state is 1.02",) and result.between(0.5, 1.0).warnings == result.warnings
    assert repr(result).endswith("OK; state is 1.02>")
    assert simulate(model, WIND, duration=1.0, controller=Controller(hold), start=BEGIN).warnings == ()
    mute = Controller(damp, name="mute", warnings=lambda state: [state[9]])
    (line,) = simulate(model, WIND, duration=1.0, controller=mute, start=BEGIN).warnings
    assert line.startswith("warnings of the controller 'mute' raised IndexError")


def scalar(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    demands.generator_torque = np.ones(2)


def row(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    demands.pitch = [0.1] * 5


def given_back(state: Any, measurements: Any, demands: Any, dt: float) -> dict[str, float]:
    return {"generator_torque": 4e4}


@pytest.mark.parametrize(
    ("update", "words"),
    [
        (scalar, "'scalar' failed: generator_torque: expected a number, found array"),
        (row, "'row' failed: pitch: expected 3 numbers, found"),
        (given_back, "'given_back' failed: update returns dict, which nobody reads; it sets what it wants"),
    ],
)
def test_what_no_demand_can_be_is_told(model: Model, update: Any, words: str) -> None:
    with pytest.raises(RunError, match=words):
        simulate(model, WIND, duration=1.0, controller=Controller(update), start=BEGIN)


def test_a_controller_is_made_fresh_for_every_run_and_closed_after_it(model: Model) -> None:
    """However the run ends, and if it is dropped before it ends."""
    made: list[list[float]] = []
    closed: list[int] = []

    def fresh() -> Controller:
        mine: list[float] = []
        made.append(mine)
        number = len(made)

        def update(state: Any, measured: Any, demands: Any, dt: float) -> None:
            mine.append(float(measured[s.TIME]))
            if number == 2 and measured[s.TIME] > 0.1:
                raise ValueError

        return Controller(update, close=lambda: closed.append(number))

    controller = Controller(hold, fresh=fresh)
    same: dict[str, Any] = {"duration": 0.2, "controller": controller, "start": BEGIN, "partial": True}
    ends = [simulate(model, WIND, **same).status for _ in range(2)]
    assert ends == [Status.OK, Status.CONTROLLER_RAISED]
    assert [mine[0] for mine in made] == [0.0, 0.0] and len(made[0]) > len(made[1])
    assert set(closed) == {1, 2}
    dropped = meltemi.Simulation(meltemi.Run(model, WIND, duration=0.2, controller=controller, start=BEGIN))
    dropped.advance(3)
    assert 3 not in closed
    del dropped
    assert 3 in closed


def test_state_vector_persists_between_calls(model: Model) -> None:
    seen: list[float] = []

    def integrate(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        state[1] += dt
        seen.append(state[1])

    controller = Controller(update=integrate, init=lambda start: np.array([start.pitch, 5.0]), sample_time=0.5)
    simulate(model, WIND, duration=2.0, controller=controller, start=BEGIN)
    assert seen == pytest.approx([5.5, 6.0, 6.5, 7.0, 7.5])


def failing(kind: str) -> Any:
    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        if measurements[s.TIME] >= 0.5:
            if kind == "raises":
                raise RuntimeError("sensor lost")
            demands[s.PITCH_DEMAND + 1] = np.nan if kind == "nan" else 4.0

    return update


@pytest.mark.parametrize(
    ("kind", "status", "words"),
    [
        ("raises", Status.CONTROLLER_RAISED, "RuntimeError: sensor lost"),
        ("nan", Status.CONTROLLER_DEMAND, "pitch_2 = nan"),
        ("range", Status.CONTROLLER_DEMAND, "pitch_2 = 4 (limit 2.0708)"),
    ],
)
@pytest.mark.parametrize("compiled", [False, True])
def test_what_a_controller_does_wrong_ends_its_run_alone(
    model: Model, kind: str, status: Status, words: str, compiled: bool
) -> None:
    update = failing(kind)
    if compiled:
        if kind == "raises":

            @numba.njit
            def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
                if measurements[s.TIME] >= 0.5:
                    raise RuntimeError

            words = "compiled code"
        else:
            bad = np.nan if kind == "nan" else 4.0

            @numba.njit
            def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
                if measurements[s.TIME] >= 0.5:
                    demands[s.PITCH_DEMAND + 1] = bad

    with pytest.raises(meltemi.RunError, match=re.escape(words)) as caught:
        simulate(model, WIND, duration=2.0, controller=Controller(update=update, name="mine"), start=BEGIN)
    result = caught.value.result
    assert result.status is status and result.message == str(caught.value) and result.message in repr(result)
    assert "'mine'" in result.message
    assert "t = 0.500" in result.message
    assert words in result.message
    assert result.time[-1] == pytest.approx(0.45)
    assert np.all(np.isfinite(result.data))
    # the next run is not touched by it
    assert simulate(model, WIND, duration=1.0, controller=Controller(update=hold), start=BEGIN).status is Status.OK


def test_a_controller_that_cannot_be_compiled_is_refused(model: Model) -> None:
    @numba.njit
    def wrong(state: Any, measurements: Any) -> None:
        state[0] = "text"

    with pytest.raises(InputError, match="wrong"):
        simulate(model, WIND, duration=1.0, controller=Controller(update=wrong), start=BEGIN)
    with pytest.raises(InputError, match="must be a function"):
        Controller(update=3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="sample_time"):
        Controller(update=hold, sample_time=-1.0)
    with pytest.raises(InputError, match="finite"):
        simulate(model, WIND, duration=1.0, controller=Controller(hold, init=lambda start: [np.nan]), start=BEGIN)


def test_order_at_a_sample_instant(turbine: Turbine) -> None:
    """Sample, control, actuators, physics, record: the torque asked for at t is what the record of t shows."""
    asked: list[tuple[float, float, float]] = []

    def ramp(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 3e4 + 1e3 * measurements[s.TIME]
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = 0.01 * measurements[s.TIME]
        asked.append((measurements[s.TIME], measurements[s.TORQUE], demands[s.GENERATOR_TORQUE]))

    ideal = meltemi.build(turbine.replace(**{"pitch_actuator.kind": "ideal"}))
    names = ["time", "generator_torque", "pitch_1"]
    result = simulate(
        ideal, WIND, duration=1.0, controller=Controller(update=ramp), start=BEGIN, channels=names, output_step=0.01
    )
    assert result["generator_torque"] == pytest.approx(3e4 + 1e3 * result.time)
    assert result["pitch_1"] == pytest.approx(0.01 * result.time)
    # what the sensor gives is the torque that acted until then
    times, measured, demanded = np.array(asked).T
    assert measured[1:] == pytest.approx(demanded[:-1])
    assert times == pytest.approx(result.time)


def test_measurements_agree_with_the_record(model: Model) -> None:
    rows: list[np.ndarray] = []

    def watch(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        rows.append(measurements.copy())

    wind = SteadyWind(speed=11.0, shear_exponent=0.2)
    names = "generator_speed rotor_speed pitch_2 RootMyc3 RootMxc1 nacelle_yaw wind_x YawBrTAxp GenPwr".split()
    result = simulate(model, wind, duration=3.0, controller=Controller(update=watch), channels=names, output_step=0.01)
    seen = np.array(rows)
    pairs = [
        (s.GENERATOR_SPEED, "generator_speed", 0),
        (s.ROTOR_SPEED, "rotor_speed", 0),
        (s.PITCH + 1, "pitch_2", 0),
        (s.YAW, "nacelle_yaw", 0),
        (s.POWER, "GenPwr", 0),
        # loads and wind are those of the step before
        (s.OUT_OF_PLANE_MOMENT + 2, "RootMyc3", 1),
        (s.IN_PLANE_MOMENT, "RootMxc1", 1),
        (s.WIND_SPEED, "wind_x", 1),
    ]
    for place, name, late in pairs:
        recorded = result[name][: len(seen) - late]
        scale = np.max(np.abs(recorded)) + 1e-9
        assert np.max(np.abs(seen[late:, place] - recorded)) < 1e-4 * scale, name
    assert np.all(seen[:, s.N_BLADES] == 3)


@pytest.mark.parametrize("every", [1, 3])
def test_a_controller_sees_the_accelerations_of_the_instant_of_its_call(model: Model, every: int) -> None:
    """(M-46) of what is recorded, from the undeflected start on, whose acceleration stands for the one before."""
    calls: list[tuple[float, float, float]] = []

    def watch(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        calls.append(
            (
                measurements.fore_aft_acceleration,
                measurements.side_side_acceleration,
                measurements.nacelle_turning.y,
            )
        )

    law, step = Controller(watch, sample_time=every * 0.01), 0.01
    start = Start(rotor_speed=1.2, generator_torque=3e4, coordinates={})
    names = ["YawBrTAxp", "YawBrTAyp", "NcIMURAys"]
    result = simulate(model, WIND, duration=2.0, controller=law, start=start, channels=names, output_step=step)
    seen, now = np.array(calls), np.array([result[name] for name in names]).T
    expected = np.concatenate([now[:1], now[:1], 2.0 * now[1:-1] - now[:-2]])[::every]
    size = np.abs(now).max(axis=0)
    assert np.all(np.abs(seen - expected)[1:] <= 1e-9 * size)
    late = np.abs(now[every - 1 : -1 : every] - now[every::every])[1:].mean(axis=0)
    assert np.all(np.abs(seen[1:] - now[every::every])[1:].mean(axis=0) < 0.4 * late)


def test_feedback_of_motion_does_not_depend_on_the_output(model: Model) -> None:
    """Its acceleration is that of each call, not of the last record."""
    gains = {"control.pitch.motion_gain": 0.02, "control.pitch.motion_frequency": 0.5}
    fed, start = meltemi.build(model.turbine.replace(**gains)), Start(rotor_speed=1.267, pitch=0.15, coordinates={})
    fine, coarse = (
        simulate(fed, SteadyWind(speed=14.0), duration=2.0, start=start, channels=["pitch_1"], output_step=step)
        for step in (0.05, 0.5)
    )
    assert np.array_equal(fine["pitch_1"][::10], coarse["pitch_1"]) and np.ptp(fine["pitch_1"]) > 1e-3


def test_baseline_holds_the_speed_above_rated(model: Model) -> None:
    wind = meltemi.TurbulentWind(speed=18.0, intensity=0.1)
    result = simulate(model, wind, duration=60.0, channels=["RotSpeed", "GenPwr", "BldPitch1"])
    assert result["RotSpeed"].mean() == pytest.approx(12.1 * np.pi / 30.0, rel=0.01)
    assert result["GenPwr"].mean() == pytest.approx(5e6, rel=0.01)
    assert result["BldPitch1"].std() > 0.01


@pytest.mark.slow
def test_options_of_a_controller_reach_it(turbine: Turbine) -> None:
    slow = turbine.replace(**{"control.pitch.rate_limit": 0.002})
    wind = meltemi.TurbulentWind(speed=14.0, intensity=0.15)
    fast_run, slow_run = (
        simulate(meltemi.build(t, ModelOptions(torsion_modes=0)), wind, duration=40.0, channels=["BldPitch1"])
        for t in (turbine, slow)
    )
    rate = np.max(np.abs(np.diff(slow_run["pitch_1"]))) / 0.05
    assert rate < 0.0035 < np.max(np.abs(np.diff(fast_run["pitch_1"]))) / 0.05


@pytest.mark.parametrize(
    ("write", "words"),
    [
        (
            lambda demands: demands.__setitem__(slice(s.PITCH_DEMAND, s.PITCH_DEMAND + 3), [0.1, 0.1]),
            "ValueError.*shape",
        ),
        (lambda demands: demands.__setitem__(len(demands), 0.0), "IndexError.*out of bounds"),
        (lambda demands: demands.__setitem__(s.GENERATOR_TORQUE, np.zeros(3)), "Error"),
    ],
)
def test_writing_a_wrong_shape_ends_the_run(model: Model, write: Any, words: str) -> None:
    def shapeless(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        if measurements[s.TIME] >= 0.5:
            write(demands)

    result = simulate(model, WIND, duration=1.0, controller=Controller(shapeless), start=BEGIN, partial=True)
    assert result.status is Status.CONTROLLER_RAISED
    assert "'shapeless'" in result.message and "t = 0.500" in result.message
    assert re.search(words, result.message)


def test_a_state_that_is_no_vector_is_refused(model: Model) -> None:
    for state in (np.zeros((2, 2)), np.array([1j]), ["a"]):
        with pytest.raises(InputError, match="'hold': init must give a vector"):
            simulate(model, WIND, duration=1.0, controller=Controller(hold, init=lambda start, state=state: state))


def test_a_torque_no_generator_has_ends_the_run(model: Model) -> None:
    def greedy(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 1e7

    result = simulate(model, WIND, duration=1.0, controller=Controller(greedy), start=BEGIN, partial=True)
    assert result.status is meltemi.Status.CONTROLLER_DEMAND
    assert "'greedy' returned generator_torque = 1e+07 (limit 237015)" in result.message


def test_an_interrupt_in_a_python_controller_interrupts(model: Model) -> None:
    def stopped(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        if measurements[s.TIME] > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(meltemi.RunError, match="interrupted") as caught:
        simulate(model, WIND, duration=1.0, controller=Controller(stopped), start=BEGIN)
    result = caught.value.result
    assert result.status is meltemi.Status.INTERRUPTED
    assert 0.4 < result.time[-1] < 0.6
