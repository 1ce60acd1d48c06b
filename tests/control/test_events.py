"""Events: each changes what it should, from its instant on and not before; what the controller sees, what is recorded.

The law of these tests moves everything by the clock alone, so that a fault shows in what it concerns and in nothing
that a controller makes of it, and hands on what it measures as its reports, which are channels.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import (
    Controller,
    InputError,
    Model,
    Result,
    Simulation,
    Status,
    SteadyWind,
    Turbine,
    simulate,
)
from meltemi.control import signals as s
from meltemi.simulation.events import KINDS
from meltemi.simulation.run import Run

WIND = SteadyWind(speed=13.0, shear_exponent=0.2)
DT, AT = 0.01, 1.0
K = 100
"""The instant at AT."""
SEEN = ("operating_state", "power_setpoint", "yaw_error", "yaw_threshold")
"""Reports in which the law hands on the request, the power limit, the grid, and the measured generator speed."""
CHANNELS = (
    *("pitch_1", "pitch_2", "pitch_3", "flap_1_angle_1", "flap_1_angle_2", "generator_torque", "brake_torque"),
    *("nacelle_yaw", "rotor_speed", "generator_speed", "root_moment_out_of_plane_1", *SEEN),
)


@numba.njit
def by_the_clock(state: Any, measured: Any, demands: Any, dt: float) -> None:
    t = measured[s.TIME]
    demands[s.GENERATOR_TORQUE] = 4.0e4
    demands[s.BRAKE] = 0.01
    demands[s.YAW_RATE_DEMAND] = 0.004
    for b in range(3):
        demands[s.PITCH_DEMAND + b] = 0.11 + 0.02 * np.sin(3.0 * t + b)
        demands[s.FLAP_DEMAND + b] = 0.1 * np.sin(5.0 * t + b)
    demands[s.OPERATING_STATE] = measured[s.REQUEST]
    demands[s.POWER_SETPOINT] = measured[s.POWER_LIMIT]
    demands[s.YAW_ERROR] = measured[s.GRID]
    demands[s.YAW_THRESHOLD] = measured[s.GENERATOR_SPEED]


@pytest.fixture(scope="module")
def machine(turbine: Turbine) -> Model:
    """With actuators of second order, flaps and a driven yaw bearing."""
    options = meltemi.ModelOptions(yaw="driven", time_step=DT)
    turbine = turbine.replace(**{"pitch_actuator.kind": "second_order"})
    return meltemi.build(meltemi.turbine.with_flaps(turbine, meltemi.turbine.naca64618_flap()), options)


def ran(machine: Model, *events: dict[str, Any], seconds: float = 2.0, controller: Any = by_the_clock) -> Result:
    law = Controller(controller) if not isinstance(controller, Controller) else controller
    result = simulate(
        machine, WIND, duration=seconds, controller=law, channels=CHANNELS, output_step=DT, events=list(events)
    )
    assert result.status is Status.OK
    return result


@pytest.fixture(scope="module")
def plain(machine: Model) -> Result:
    return ran(machine)


def changed(result: Result, plain: Result) -> dict[str, int]:
    """Channels that are not the same bit for bit, each with the first instant at which it is not."""
    different = result.data != plain.data
    return {name: int(np.argmax(different[:, i])) for i, name in enumerate(result.names) if different[:, i].any()}


Series = NDArray[np.float64]
MACHINE = {"rotor_speed", "generator_speed", "root_moment_out_of_plane_1"}
CASES: dict[str, tuple[dict[str, Any], str, int, Any]] = {
    # event, the channel it concerns, the first instant of change after K, what the channel must be from then on
    "pitch_stuck": ({"blade": 2}, "pitch_2", 1, lambda x, t: x[K]),
    "pitch_runaway": ({"blade": 3, "rate": -0.05}, "pitch_3", 1, None),
    "flap_stuck": ({"blade": 2}, "flap_1_angle_2", 1, lambda x, t: x[K]),
    "grid_loss": ({}, "generator_torque", 0, lambda x, t: 0.0),
    "generator_fault": ({}, "generator_torque", 0, lambda x, t: 0.0),
    "sensor_offset": ({"sensor": "generator_speed", "offset": 2.5}, "yaw_threshold", 0, lambda x, t: x[K:] + 2.5),
    "sensor_drift": (
        {"sensor": "generator_speed", "rate": 0.5},
        *("yaw_threshold", 1, lambda x, t: x[K:] + 0.5 * (t[K:] - AT)),
    ),
    "sensor_loss": ({"sensor": "generator_speed"}, "yaw_threshold", 1, lambda x, t: x[K]),
    "request": ({"request": "normal_stop"}, "operating_state", 0, lambda x, t: s.REQUESTS.index("normal_stop")),
    "power_limit": ({"power": 2e6}, "power_setpoint", 0, lambda x, t: 2e6),
    "brake": ({"share": 0.5}, "brake_torque", 0, lambda x, t: 50.0 * x[K]),
    "brake_fault": ({}, "brake_torque", 0, lambda x, t: 0.0),
    "yaw_stuck": ({}, "nacelle_yaw", 0, None),
    "yaw_runaway": ({"rate": 0.01}, "nacelle_yaw", 0, None),
}


def test_every_kind_of_event_is_tested() -> None:
    assert {kind.model_fields["type"].default for kind in KINDS} == {
        *CASES,
        "voltage_dip",  # by the electrical tests
        "line_loss",  # by those of moving lines
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", CASES)
def test_it_changes_what_it_should_from_its_instant_on_and_nothing_before(
    machine: Model, plain: Result, kind: str
) -> None:
    keys, channel, after, expected = CASES[kind]
    result = ran(machine, {"at": AT, "type": kind, **keys})
    first = changed(result, plain)
    assert first[channel] == K + after
    assert min(first.values()) >= K
    if expected is not None:
        np.testing.assert_allclose(result[channel][K:], expected(plain[channel], plain.time), rtol=1e-12)
    if channel in SEEN:  # what the law does not act on is in no other channel: those are the truth
        assert set(first) == {channel}
    else:
        assert set(first) >= MACHINE - ({"root_moment_out_of_plane_1"} if channel == "brake_torque" else set())
        others = {c for c in CHANNELS[:8] if c != channel} & set(first)
        assert others <= {"nacelle_yaw"}, "other actuators do not notice"
        assert ("yaw_error" in first) == (kind == "grid_loss")
    (entry,) = result.log
    assert (entry.time, entry.source) == (AT, "event")


def test_a_runaway_goes_at_its_rate_to_the_end_of_the_range(machine: Model) -> None:
    events = [{"at": AT, "type": "pitch_runaway", "blade": b, "rate": r} for b, r in ((2, -0.05), (3, 0.3))]
    result = ran(machine, *events, seconds=6.5)
    actuator = machine.turbine.pitch_actuator
    steady = slice(K + 80, K + 120)
    for name, rate, end in (("pitch_2", -0.05, actuator.minimum), ("pitch_3", 0.3, actuator.maximum)):
        np.testing.assert_allclose(np.diff(result[name][steady]) / DT, rate, rtol=1e-9)
        assert result[name][-1] == pytest.approx(end, abs=2e-3)
    assert result.log[0].what == "pitch of blade 2 runs away towards fine"


def test_a_generator_fault_may_have_too_much_torque_and_a_yaw_runaway_has_its_own_rate(machine: Model) -> None:
    result = ran(
        machine,
        {"at": AT, "until": 1.3, "type": "generator_fault", "share": 2.0},
        {"at": 1.3, "type": "generator_fault"},
        {"at": AT, "type": "yaw_runaway", "rate": -0.02},
        {"at": AT, "type": "yaw_stuck"},
    )
    torque = result["generator_torque"]
    assert np.all(torque[K : K + 30] == 8.0e4) and np.all(torque[K + 30 :] == 0.0)
    drift = np.polyfit(result.time[K + 20 :], result["nacelle_yaw"][K + 20 :], 1)[0]
    assert drift == pytest.approx(-0.02, rel=0.05)


def test_with_the_ideal_actuator(turbine: Turbine) -> None:
    model = meltemi.build(
        turbine.replace(**{"pitch_actuator.kind": "ideal"}), meltemi.ModelOptions(time_step=DT, torsion_modes=0)
    )
    stuck = {"at": AT, "until": 1.5, "type": "pitch_stuck", "blade": 2}
    runaway = {"at": AT, "type": "pitch_runaway", "blade": 3, "rate": 0.1}
    law = Controller(by_the_clock)
    free, result = (
        simulate(
            model,
            WIND,
            duration=2.0,
            controller=law,
            output_step=DT,
            channels=["pitch_1", "pitch_2", "pitch_3"],
            events=e,
        )
        for e in ((), (stuck, runaway))
    )
    assert np.array_equal(result["pitch_1"], free["pitch_1"])
    before = K - 1  # it does not follow the demand of the instant K
    assert np.all(result["pitch_2"][K:150] == free["pitch_2"][before])
    assert np.array_equal(result["pitch_2"][150:], free["pitch_2"][150:])
    np.testing.assert_allclose(result["pitch_3"][K:], free["pitch_3"][before] + 0.1 * (free.time[K:] - AT), rtol=1e-12)


def test_what_ends_ends(machine: Model, plain: Result) -> None:
    """At the given instant; a time between two instants acts from the later one."""
    result = ran(
        machine,
        {"at": 0.503, "until": 1.0, "type": "sensor_loss", "sensor": "generator_speed", "holds": "zero"},
        {"at": 1.0, "until": 1.5, "type": "sensor_loss", "sensor": "generator_speed"},
        {"at": 0.5, "until": 1.0, "type": "generator_fault"},
        {"at": 0.5, "until": 1.0, "type": "pitch_stuck", "blade": 1},
        {"at": 0.5, "until": 1.0, "type": "power_limit", "power": 1e6},
    )
    seen, time = result["yaw_threshold"], result.time
    assert np.all(seen[51:100] == 0.0) and seen[50] > 100.0
    assert np.all(seen[100:150] == seen[100]) and np.all(np.diff(seen[150:]) != 0.0)
    off = (time >= 0.5 - 1e-9) & (time < 1.0 - 1e-9)
    assert np.array_equal(result["generator_torque"] == 0.0, off)
    assert np.array_equal(result["power_setpoint"] == 1e6, off)
    assert np.all(np.isinf(result["power_setpoint"][~off]))
    assert np.all(result["pitch_1"][50:101] == plain["pitch_1"][50])
    assert abs(result["pitch_1"][-1] - plain["pitch_1"][-1]) < 1e-3  # follows again
    assert [round(entry.time, 9) for entry in result.log] == [0.5, 0.5, 0.5, 0.51, 1.0, 1.0, 1.0, 1.0, 1.0, 1.5]
    assert result.log[-1].what == "sensor generator_speed lost, gives its last value: over"


def test_the_order_of_the_list_is_nothing(machine: Model) -> None:
    events: list[dict[str, Any]] = [
        {"at": 0.2, "until": 0.4, "type": "sensor_offset", "sensor": "generator_speed", "offset": 3.0},
        {"at": 0.4, "type": "sensor_drift", "sensor": "generator_speed", "rate": 3.0},
        {"at": 0.4, "until": 0.7, "type": "pitch_stuck", "blade": 2},
        {"at": 0.7, "type": "pitch_runaway", "blade": 2, "rate": 0.1},
        {"at": 0.7, "type": "request", "request": "start"},
        {"at": 0.8, "type": "request", "request": "emergency_stop"},
    ]
    one, two = (ran(machine, *some, seconds=1.0) for some in (events, events[::-1]))
    assert np.array_equal(one.data, two.data)
    assert one.log == two.log and len(one.log) == 8
    assert one["operating_state"][[69, 70, 80]].tolist() == [0.0, 1.0, 3.0]


def test_a_controller_acts_on_what_it_sees(machine: Model, plain: Result) -> None:
    """In plain Python, each 0.1 s: from its next call on."""

    def law(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 300.0 * measured[s.GENERATOR_SPEED]
        demands[s.OPERATING_STATE] = measured[s.PITCH + 1]

    law_of_10_hz = Controller(law, sample_time=0.1)
    free = ran(machine, controller=law_of_10_hz, seconds=1.0)
    offset = {"at": 0.45, "type": "sensor_offset", "sensor": "generator_speed", "offset": 1.0}
    lost = {"at": 0.45, "type": "sensor_loss", "sensor": "pitch_2", "holds": "zero"}
    result = ran(machine, offset, lost, controller=law_of_10_hz, seconds=1.0)
    assert min(changed(result, free).values()) == 50
    assert result["generator_torque"][50] - free["generator_torque"][50] == pytest.approx(300.0)
    assert np.all(result["operating_state"][50:] == 0.0) and result["pitch_2"][50] == free["pitch_2"][50] != 0.0


def test_stepped_from_outside_and_reset(machine: Model) -> None:
    """The same bits, and measurements as the law inside sees them."""
    events: list[dict[str, Any]] = [
        {"at": 0.0, "type": "sensor_loss", "sensor": "out_of_plane_moment_1"},
        {"at": 0.3, "type": "sensor_offset", "sensor": "generator_speed", "offset": 5.0},
        {"at": 0.5, "type": "grid_loss"},
        {"at": 0.6, "until": 0.8, "type": "pitch_stuck", "blade": 1},
    ]
    inside = ran(machine, *events, seconds=1.0)
    run = Simulation(
        Run(
            machine,
            WIND,
            duration=1.0,
            controller=meltemi.control.ConstantController(),
            channels=CHANNELS,
            output_step=DT,
            events=events,
        )
    )
    state = np.zeros(1)
    for _ in range(2):
        measured, demands = run.reset(), run.case["demands"].copy()
        assert measured["grid"] == 1.0
        first = measured["out_of_plane_moment_1"]
        while not run.finished:
            by_the_clock(state, measured.array, demands, DT)
            measured = run.step(demands)
        assert measured["grid"] == 0.0 and measured["out_of_plane_moment_1"] == first
        assert np.array_equal(run.result().data, inside.data)
        assert run.result().log == inside.log


def test_log_and_meta(machine: Model, tmp_path: Any) -> None:
    """Events and what the controller says, by time; kept in files; only what has happened."""

    def log(state: Any) -> list[meltemi.control.LogEntry]:
        return [meltemi.control.LogEntry(0.5, "supervisor", "production -> stop", "grid lost")]

    law = Controller(by_the_clock, log=log)
    grid = {"at": 0.5, "until": 0.9, "type": "grid_loss"}
    result = ran(machine, grid, controller=law, seconds=1.0)
    assert [(e.source, e.what) for e in result.log] == [
        ("event", "grid lost"),
        ("supervisor", "production -> stop"),
        ("event", "grid lost: over"),
    ]
    assert result.meta["events"] == [{"type": "grid_loss", **grid}]
    back = meltemi.io.read_netcdf(meltemi.io.write_netcdf(result, tmp_path / "run.nc"))
    assert back.log == result.log
    run = Simulation(Run(machine, WIND, duration=1.0, events=[grid]))
    run.advance(60)
    assert [entry.what for entry in run.result().log] == ["grid lost"]
    assert ran(machine, seconds=0.1).log == ()


def test_the_supervisor_notices(model: Model) -> None:
    """At the same instant; the log has the cause before what is made of it."""
    law = meltemi.control.SupervisedController(model.turbine)
    result = simulate(model, WIND, duration=2.0, controller=law, events=[meltemi.events.GridLoss(at=1.0)])
    cause, reaction = result.log
    assert (cause.source, reaction.source) == ("event", "supervisor")
    assert cause.time == reaction.time == 1.0 and reaction.what.endswith("emergency stop")


def test_in_a_batch(machine: Model) -> None:
    cases = [
        meltemi.Run(
            machine,
            WIND,
            duration=0.5,
            controller=Controller(by_the_clock),
            channels=CHANNELS,
            output_step=DT,
            events=events,
        )
        for events in ((), [meltemi.events.GridLoss(at=0.2)], [{"at": 0.2, "type": "pitch_stuck", "blade": 4}])
    ]
    free, lost, wrong = meltemi.simulate_batch(cases, workers=1)
    assert np.flatnonzero(lost.value["generator_torque"] == 0.0)[0] == 20
    assert np.all(free.value["generator_torque"] > 0.0)
    assert wrong.status is Status.FAILED and "events.0.blade: " in wrong.message


@pytest.mark.parametrize(
    ("events", "words"),
    [
        ([{"at": 1.0, "type": "pitch_stuk", "blade": 1}], "events.0.type: .*did you mean 'pitch_stuck'"),
        ([{"at": 1.0, "type": "pitch_stuck", "blade": 4}], "events.0.blade: expected less than or equal to 3, found 4"),
        ([{"at": 3.0, "type": "grid_loss"}], "events.0.at: 3 s is not before the end of the run at 2 s"),
        ([{"at": 2.0, "type": "grid_loss"}], "events.0.at: 2 s is not before the end of the run at 2 s"),
        ([{"at": -1.0, "type": "grid_loss"}], "events.0.at: expected greater than or equal to 0"),
        ([{"at": 1.0, "until": 1.0, "type": "grid_loss"}], "events.0: until 1 s must be later than at 1 s"),
        ([{"at": 1.001, "until": 1.002, "type": "grid_loss"}], "events.0.until: .* within its time step of 0.01 s"),
        ([{"at": 1.0, "type": "flap_stuck", "blade": 1, "flap": 2}], "events.0.flap: there is no flap 2; .* has 1"),
        ([{"at": 1.0, "type": "sensor_loss", "sensor": "pich_2"}], "events.0.sensor: .*did you mean 'pitch_2'"),
        ([{"at": 1.0, "type": "sensor_loss", "sensor": "flap_2_1"}], "events.0.sensor: .* did you mean 'flap_1_1'"),
        ([{"at": 1.0, "type": "pitch_runaway", "blade": 1, "rate": 0.0}], "events.0: rate must not be zero"),
        (
            [{"at": 0.5, "type": "pitch_stuck", "blade": 1}, {"at": 0.2, "type": "pitch_stuck", "blade": 1}],
            "events.0 at 0.5 s and events.1, which acts from 0.2 s permanently, "
            "contradict each other .pitch of blade 1.",
        ),
        (
            [{"at": 0.5, "type": "request", "request": "start"}, {"at": 0.5, "type": "request", "request": "none"}],
            "contradict each other .request of the operator.",
        ),
    ],
)
def test_what_is_refused(machine: Model, events: list[dict[str, Any]], words: str) -> None:
    with pytest.raises(InputError, match=words):
        simulate(machine, WIND, duration=2.0, events=events)


def test_a_blade_that_the_turbine_does_not_have(turbine: Turbine) -> None:
    from meltemi.simulation.events import read_events, schedule

    two = turbine.replace(n_blades=2)
    for event, words in (
        ({"type": "pitch_stuck", "blade": 3}, "events.0.blade: nrel5mw has 2 blades, found 3"),
        (
            {"type": "sensor_loss", "sensor": "pitch_3"},
            "events.0.sensor: nrel5mw has no 'pitch_3'; did you mean 'pitch_",
        ),
        ({"type": "flap_stuck", "blade": 1}, "events.0.flap: there is no flap 1; nrel5mw has none"),
        ({"type": "line_loss", "line": 1}, "events.0.line: nrel5mw has 0 mooring lines, found 1"),
    ):
        with pytest.raises(InputError, match=words):
            schedule(read_events([{"at": 0.0, **event}]), two, DT, 10)


@numba.njit
def stops(state: Any, measured: Any, demands: Any, dt: float) -> None:
    """Held at constant power until the grid is lost or a stop is asked for, then feathered."""
    stop = measured[s.GRID] < 0.5 or measured[s.REQUEST] >= 2.0
    demands[s.GENERATOR_TORQUE] = 0.0 if stop else 4.3e4
    for b in range(3):
        held = 0.35 + 0.03 * (measured[s.GENERATOR_SPEED] - 122.9)
        demands[s.PITCH_DEMAND + b] = min(measured[s.PITCH + b] + 0.14, 1.5) if stop else max(held, 0.0)


@pytest.mark.parametrize(
    "faults",
    [
        [{"type": "grid_loss"}],
        [{"type": "request", "request": "emergency_stop"}, {"type": "pitch_stuck", "blade": 2}],
        [{"type": "grid_loss"}, {"type": "pitch_runaway", "blade": 1, "rate": -0.15}],
        [{"type": "grid_loss"}, {"type": "sensor_loss", "sensor": "pitch_3", "holds": "zero"}],
        [{"type": "request", "request": "normal_stop"}, {"type": "brake"}],
    ],
    ids=["grid", "stuck", "runaway", "sensor", "brake"],
)
def test_a_stop_in_strong_wind_brings_the_rotor_down_whatever_fails(
    machine: Model, faults: list[dict[str, Any]]
) -> None:
    """Two blades are enough to stop; nothing diverges."""
    wind = meltemi.TurbulentWind(speed=22.0, intensity=0.15, points=7)
    events = [{"at": 10.0, **fault} for fault in faults]
    names = ["rotor_speed", "tip_out_of_plane_1", "pitch_1"]
    result = simulate(machine, wind, duration=60.0, controller=Controller(stops), channels=names, events=events)
    assert result.status is Status.OK
    before, after = result.between(0.0, 10.0)["rotor_speed"], result.between(50.0, 60.0)["rotor_speed"]
    assert before.min() > 1.0 and np.abs(after).max() < 0.4 * before.min()
    assert np.abs(result["tip_out_of_plane_1"]).max() < 15.0
