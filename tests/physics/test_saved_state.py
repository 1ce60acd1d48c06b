"""Saved states of runs: the rest has the bits of a run that was not interrupted."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Run, Simulation, SteadyWind, Turbine, TurbulentWind
from meltemi.control import Controller, SupervisedController
from meltemi.core.private import SIGNATURE
from meltemi.io import restore_state, save_state, stop_at
from meltemi.simulation.tables import Clock, Watch

STUCK = {"at": 0.4, "type": "pitch_stuck", "blade": 2, "until": 1.5}
EVENTS = [
    STUCK,
    {"at": 0.5, "type": "sensor_drift", "sensor": "generator_speed", "rate": 0.1},
    {"at": 1.2, "type": "grid_loss"},
]


def interrupted(run: Run, at: float, path: Path, later: Run | None = None) -> tuple[Any, Any]:
    """Result of a run, and that of the same run saved at a time and continued by another simulation."""
    first = Simulation(run)
    stop_at(first, at)
    first.advance(10**9)
    assert first.finished and abs(first.time - at) < 2 * first.dt
    save_state(first, path)
    second = Simulation(later or run)
    assert restore_state(second, path) == []
    second.advance(10**9)
    whole = Simulation(later or run)
    whole.advance(10**9)
    for one, other in zip(whole.moving, second.moving, strict=True):
        pointer = one is whole.case.measured  # with the address of a callback
        np.testing.assert_array_equal(one[:-1] if pointer else one, other[:-1] if pointer else other)
    return whole.result(), second.result()


def same_bits(one: Any, other: Any) -> None:
    assert one.status is other.status
    assert one.data.tobytes() == other.data.tobytes() and np.array_equal(one.time, other.time)
    assert one.log == other.log and one.findings == other.findings and one.warnings == other.warnings


@pytest.mark.parametrize("at", [0.45, 1.0, 1.3])
def test_a_run_continues_bit_for_bit_while_events_act(
    model: Model, turbine: Turbine, tmp_path: Path, at: float
) -> None:
    """Before, between and after events: a blade that sticks, a drifting sensor, grid loss and the stop that follows."""
    wind = TurbulentWind(speed=14.0, intensity=0.14)
    run = Run(model, wind, duration=2.0, controller=SupervisedController(turbine), events=EVENTS, channels=("all",))
    whole, continued = interrupted(run, at, tmp_path / "run.state")
    same_bits(whole, continued)
    assert len(whole.log) > 3 and len(whole.time) == 41


def test_what_comes_may_be_another_story(model: Model, tmp_path: Path) -> None:
    """A longer duration and a further event in steady wind: as if they had been given from the beginning."""
    run = Run(model, SteadyWind(speed=11.0, shear_exponent=0.2), duration=1.0, events=[STUCK | {"until": 0.9}])
    later = replace(run, duration=1.6, events=(*run.events, {"at": 1.2, "type": "grid_loss"}))
    same_bits(*interrupted(run, 1.0, tmp_path / "run.state", later))


def test_a_callback_and_an_event_of_the_hand_continue(model: Model, tmp_path: Path) -> None:
    """Plain Python with a state vector; the address of the callback is that of the new process."""

    def law(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        state[0] += dt
        demands.generator_torque = 40e3 + 100.0 * state[0]
        demands.pitch[:] = 0.01 * state[0]

    run = Run(model, 8.0, duration=0.6, controller=Controller(law))
    same_bits(*interrupted(run, 0.3, tmp_path / "run.state"))
    first, second = Simulation(run), Simulation(run)
    first.advance(20)
    first.act(meltemi.events.Brake(at=0.0, share=0.5))
    first.advance(20)
    save_state(first, tmp_path / "run.state")
    restore_state(second, tmp_path / "run.state")
    first.advance(10**6), second.advance(10**6)
    same_bits(first.result(), second.result())
    assert [entry.what for entry in second.log()] == ["brake applied"]


def test_states_of_another_run_are_refused_with_the_reason(model: Model, turbine: Turbine, tmp_path: Path) -> None:
    run, path = Run(model, 8.0, duration=0.5), tmp_path / "run.state"
    first = Simulation(run)
    first.advance(30)
    save_state(first, path)
    others = {
        "another wind": replace(run, wind=9.0),
        "another controller": replace(run, controller=SupervisedController(turbine)),
        "other channels": replace(run, channels=("rotor_speed",)),
        "another output_step": replace(run, output_step=0.1),
        "another start": replace(run, start=meltemi.Start(rotor_speed=1.0)),
        "longer duration": replace(run, duration=0.2),
        "events before the saved time": replace(run, events=[{"at": 0.1, "type": "grid_loss"}]),
    }
    for words, other in others.items():
        with pytest.raises(InputError, match=words):
            restore_state(Simulation(other), path)
    with pytest.raises(InputError, match="until: expected a time from"):
        stop_at(first, 0.1)
    turbulent = Run(model, TurbulentWind(speed=8.0, intensity=0.1), duration=0.5)
    save_state(Simulation(turbulent), path)
    with pytest.raises(InputError, match="give the whole duration"):
        restore_state(Simulation(replace(turbulent, duration=30.0)), path)


def test_damaged_files_and_runs_that_cannot_be_saved(model: Model, tmp_path: Path) -> None:
    run, path = Run(model, 8.0, duration=0.5), tmp_path / "run.state"
    simulation = Simulation(run)
    good = save_state(simulation, path).read_bytes()
    for content in (b"", good[:1000], good[:200] + b"?" * 50 + good[250:], b"text", good[SIGNATURE:]):
        path.write_bytes(content)
        with pytest.raises(InputError, match="no state of a run that you saved"):
            restore_state(simulation, path)
    closing = Simulation(replace(run, controller=Controller(meltemi.control.ConstantController().update, close=int)))
    with pytest.raises(InputError, match="separate process"):
        save_state(closing, path)
    simulation.case.clock.status = int(meltemi.Status.DIVERGED)
    with pytest.raises(InputError, match="has failed"):
        save_state(simulation, path)


def test_every_byte_and_the_user_who_saved_it_count(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A flipped bit anywhere, or another user's key, and nothing of the file is looked at."""
    simulation, path = Simulation(Run(model, 8.0, duration=0.5)), tmp_path / "run.state"
    good = save_state(simulation, path).read_bytes()
    for at in range(0, len(good), 997):
        path.write_bytes(good[:at] + bytes([good[at] ^ 1]) + good[at + 1 :])
        with pytest.raises(InputError, match="changed afterwards"):
            restore_state(simulation, path)
    path.write_bytes(good)
    monkeypatch.setattr("meltemi.studies.saved_state.user_key", lambda: bytes(SIGNATURE))
    with pytest.raises(InputError, match="states of other users"):
        restore_state(simulation, path)


@pytest.mark.parametrize(
    ("name", "place", "value"),
    [
        ("clock", Clock.index("row"), 7),
        ("clock", Clock.index("step"), -3),
        ("clock", Clock.index("next_event"), 2),
        ("clock", Clock.index("status"), 3),
        ("clock", Clock.index("every_output"), 0),
        ("watch", Watch.index("place"), 50.0),
    ],
)
def test_numbers_that_kernels_use_as_indices_are_those_of_the_run(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, place: int, value: float
) -> None:
    """A file with a valid signature, too: it may come of a defect, or of a later version."""
    simulation, path = Simulation(Run(model, 8.0, duration=0.5)), tmp_path / "run.state"
    simulation.advance(10)
    save_state(simulation, path)
    before = [array.copy() for array in simulation.moving]

    def forged(data: bytes, key: bytes) -> bytes:
        with np.load(BytesIO(data[SIGNATURE:])) as found:
            arrays = dict(found)
        arrays[name][place] = value
        content = BytesIO()
        np.savez(content, **arrays)
        return content.getvalue()

    monkeypatch.setattr("meltemi.studies.saved_state.verified", forged)
    with pytest.raises(InputError, match="counters are not those"):
        restore_state(simulation, path)
    for one, other in zip(before, simulation.moving, strict=True):
        np.testing.assert_array_equal(one, other)


def test_another_program_is_noted(model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = Simulation(Run(model, 8.0, duration=0.5))
    save_state(simulation, tmp_path / "run.state")
    monkeypatch.setattr("meltemi.studies.saved_state.PHYSICS", 99)
    (note,) = restore_state(simulation, tmp_path / "run.state")
    assert "physics" in note and "rounding" in note


@pytest.mark.slow
def test_parts_of_the_machine_continue(tmp_path: Path) -> None:
    """Electrical system in a voltage dip, and a pile in irregular waves."""
    wind, path = TurbulentWind(speed=12.0, intensity=0.14), tmp_path / "run.state"
    electric = meltemi.build(meltemi.load_turbine("pmsg20mw"), meltemi.ModelOptions(electrical="averaged"))
    dip = [{"at": 0.4, "type": "voltage_dip", "voltage": 0.3, "until": 0.8}]
    same_bits(*interrupted(Run(electric, 9.0, duration=1.2, events=dip, channels=("all",)), 0.6, path))
    pile = meltemi.build(meltemi.load_turbine("nrel5mw-monopile"))
    sea = meltemi.environment.IrregularSea(height=3.0, period=9.0)
    same_bits(*interrupted(Run(pile, wind, duration=1.2, sea=sea, channels=("all",)), 0.6, path))
    disk = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    same_bits(*interrupted(Run(disk, 10.0, duration=4.0), 2.0, path))
