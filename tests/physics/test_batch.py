"""Batches: the same bits as single runs; a case that fails harms no other; little memory; Ctrl-C keeps what is done."""

from __future__ import annotations

import _thread
import gc
import json
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import (
    Controller,
    InputError,
    Model,
    ModelOptions,
    Outcome,
    Result,
    Run,
    Start,
    Status,
    SteadyWind,
    WindBox,
    WindSeries,
    simulate,
    simulate_batch,
)
from meltemi.control import signals as s
from meltemi.loadcases.batch import Batch, Piece, told_to_end
from meltemi.simulation import points


def box(seed: int, speed: float = 11.0) -> WindBox:
    wind = meltemi.TurbulentWind(speed=speed, intensity=0.14, seed=seed, points=9)
    return meltemi.wind.generate_field(wind, meltemi.load_turbine("nrel5mw"), 3.0)


def raising(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    if measurements[s.TIME] >= 0.5:
        raise RuntimeError("sensor lost")


@pytest.mark.slow
def test_a_batch_gives_the_bits_of_single_runs(model: Model) -> None:
    other = model.with_parameters(**{"aerodynamics.air_density": 1.1})
    slow = meltemi.control.BaselineController(model.turbine, sample_time=0.1)
    cases = [
        Run(model, lambda: box(1), duration=3.0),
        Run(other, lambda: box(1), duration=3.0),
        Run(model, lambda: box(2), duration=3.0, controller=slow),
        Run(lambda: model, SteadyWind(speed=9.0), duration=2.0, channels=["rotor_speed", "RootMyc1"]),
        Run(model, box(3), duration=3.0, start=Start(rotor_speed=1.2, generator_torque=3e4)),
    ]
    outcomes = simulate_batch(cases, workers=3)
    alone = [
        simulate(model, box(1), duration=3.0),
        simulate(other, box(1), duration=3.0),
        simulate(model, box(2), duration=3.0, controller=slow),
        simulate(model, SteadyWind(speed=9.0), duration=2.0, channels=["rotor_speed", "RootMyc1"]),
        simulate(model, box(3), duration=3.0, start=cases[4].start),
    ]
    assert [o.name for o in outcomes] == [f"case_{i:04d}" for i in range(1, 6)]
    for outcome, run in zip(outcomes, alone, strict=True):
        assert outcome.ok
        assert outcome.message == ""
        assert np.array_equal(outcome.value.data, run.data)
        assert outcome.value.meta["case"] == outcome.name
    assert not np.array_equal(alone[0].data, alone[1].data)


def test_outcomes_are_told_in_the_calling_thread_and_not_kept(model: Model) -> None:
    told: dict[str, tuple[Any, Any]] = {}

    def done(outcome: Outcome) -> None:
        told[outcome.name] = (outcome.value, threading.current_thread())

    cases = [Run(model, SteadyWind(speed=speed), duration=1.0, name=f"v{speed:g}") for speed in (8.0, 9.0, 10.0)]
    shares: list[float] = []
    settings: dict[str, Any] = {"reduce": lambda result: result["rotor_speed"][-1], "progress": shares.append}
    assert simulate_batch(cases, workers=2, done=done, **settings) == []
    assert shares[-1] == 1.0
    assert {name: value for name, (value, _) in told.items()} == {
        case.name: simulate(model, case.wind, duration=1.0)["rotor_speed"][-1] for case in cases
    }
    assert {thread for _, thread in told.values()} == {threading.current_thread()}


def test_shared_turbulence_gives_the_loads_of_the_field_it_was_taken_from(model: Model) -> None:
    described = meltemi.TurbulentWind(speed=11.0, intensity=0.14, periodic=True, shear_exponent=0.2)
    field = meltemi.wind.generate_field(described, model.turbine, 40.0)
    mean = SteadyWind(speed=11.0, shear_exponent=0.2)
    shared = meltemi.wind.SharedTurbulence(mean, meltemi.wind.unit_turbulence(field), 0.14 * 11.0)
    start = meltemi.operating_point(model, mean)
    runs = [Run(model, wind, duration=40.0, start=start) for wind in (field, shared)]
    whole, parts = (outcome.value for outcome in simulate_batch(runs, series=False))
    for name, load in whole.equivalent_loads().items():
        assert parts.equivalent_loads()[name] == pytest.approx(load, rel=0.01), name
    assert parts["wind_x"]["std"] == pytest.approx(whole["wind_x"]["std"], rel=1e-3)


def test_cases_that_fail_harm_no_other(model: Model) -> None:
    wild = meltemi.build(model.turbine, ModelOptions(time_step=0.1))
    small = WindBox(np.full((60, 3, 3, 3), 10.0, np.float32), dt=0.1, dy=10.0, dz=10.0, bottom=80.0, speed=10.0)

    def no_wind() -> WindBox:
        raise FileNotFoundError("field.bts")

    good = Run(model, lambda: box(1), duration=3.0)
    fails = {
        "diverges": Run(wild, SteadyWind(speed=11.0), duration=3.0, start=Start(rotor_speed=1.2), output_step=0.1),
        "raises": Run(model, SteadyWind(speed=11.0), duration=2.0, controller=Controller(raising)),
        "small": Run(model, small, duration=3.0),
        "missing": Run(model, no_wind, duration=3.0),
        "short": Run(model, SteadyWind(speed=11.0), duration=-1.0),
        "no model": Run("nrel5mw", SteadyWind(speed=11.0), duration=1.0),  # type: ignore[arg-type]
    }
    cases = [Run(**{**vars(case), "name": name}) for name, case in fails.items()]
    cases[2:2] = [good]
    cases += [good, Run(**{**vars(good), "name": "raises"})]
    outcomes = simulate_batch(cases, workers=2)
    by_name: dict[str, Outcome] = {}
    for outcome in outcomes:
        by_name.setdefault(outcome.name, outcome)
    expected: dict[str, tuple[Status, type[BaseException] | None, str]] = {
        "diverges": (Status.DIVERGED, None, "diverged"),
        "raises": (Status.CONTROLLER_RAISED, None, "sensor lost"),
        "small": (Status.FAILED, InputError, "wide"),
        "missing": (Status.FAILED, FileNotFoundError, "field.bts"),
        "short": (Status.FAILED, InputError, "duration"),
        "no model": (Status.FAILED, InputError, "found str"),
    }
    for name, (status, error, words) in expected.items():
        outcome = by_name[name]
        assert (outcome.status, outcome.error) == (status, error), outcome
        assert words in outcome.message
        assert not outcome.ok
        assert (outcome.value is None) == (status is Status.FAILED)
    assert len(by_name["raises"].value.time) == 10
    twice = outcomes[-1]
    assert (twice.name, twice.status, twice.error) == ("raises", Status.FAILED, InputError)
    alone = simulate(model, box(1), duration=3.0)
    for i in (2, len(cases) - 2):
        assert np.array_equal(outcomes[i].value.data, alone.data)


def test_reduce_keeps_only_what_it_returns_and_may_fail(model: Model) -> None:
    def peak(result: Result) -> float:
        if result.meta["case"] == "bad":
            raise ZeroDivisionError("nothing there")
        return float(result["RootMyc1"].max())

    names = ["good", "bad", "other"]
    cases = [Run(model, SteadyWind(speed=11.0), duration=0.5, name=name) for name in names]
    good, bad, other = simulate_batch(cases, reduce=peak)
    assert good.value == other.value > 1e6
    assert (bad.status, bad.error, bad.value) == (Status.FAILED, ZeroDivisionError, None)


def test_files_appear_as_soon_as_a_case_is_done(model: Model, tmp_path: Path) -> None:
    seen: list[list[str]] = []

    def cases() -> Iterator[Run]:
        for name in ("a", "b", "c"):
            seen.append(sorted(path.name for path in tmp_path.glob("runs/*.nc")))
            yield Run(model, SteadyWind(speed=11.0), duration=0.5, name=name)

    outcomes = simulate_batch(cases(), out=tmp_path / "runs", workers=1)
    assert seen == [[], ["a.nc"], ["a.nc", "b.nc"]]
    for outcome in outcomes:
        assert outcome.value == tmp_path / "runs" / f"{outcome.name}.nc"
        assert meltemi.io.read_netcdf(outcome.value).meta["case"] == outcome.name
    (bad,) = simulate_batch([Run(model, SteadyWind(speed=11.0), duration=0.5, name="../up")], out=tmp_path / "runs")
    assert bad.error is InputError
    assert not (tmp_path / "up.nc").exists()


@pytest.mark.slow
def test_only_as_many_winds_as_workers_are_in_memory(model: Model) -> None:
    alive = most = 0
    lock = threading.Lock()

    def count(change: int) -> None:
        nonlocal alive, most
        with lock:
            alive += change
            most = max(most, alive)

    def cases() -> Iterator[Run]:
        for seed in range(8):

            def wind(seed: int = seed) -> WindBox:
                made = box(seed)
                count(1)
                weakref.finalize(made, count, -1)
                return made

            yield Run(model, wind, duration=0.5, controller=Controller(lambda state, measured, demands, dt: None))

    gc.disable()  # what reference counts do not free stays
    try:
        outcomes = simulate_batch(cases(), workers=2, reduce=lambda result: result.status)
        assert all(outcome.ok for outcome in outcomes)
        assert most <= 2
        assert alive == 0
    finally:
        gc.enable()


def test_progress_rises_to_one(model: Model) -> None:
    shares: list[float] = []
    cases = [Run(model, SteadyWind(speed=11.0), duration=20.0) for _ in range(4)]
    simulate_batch(cases, workers=2, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_an_operating_point_is_found_once(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[float] = []
    original = points.operating_point

    def counted(model: Model, wind: Any) -> Any:
        calls.append(wind.speed)
        time.sleep(0.1)
        return original(model, wind)

    monkeypatch.setattr(points, "operating_point", counted)
    winds = [SteadyWind(speed=speed) for speed in (9.01, 9.02, 9.01, 9.02)]
    assert all(outcome.ok for outcome in simulate_batch([Run(model, wind, duration=0.5) for wind in winds], workers=4))
    assert sorted(calls) == [9.01, 9.02]


@pytest.mark.parametrize("change", [{"workers": 0}, {"workers": 1.5}])
def test_bad_arguments(model: Model, change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="workers"):
        simulate_batch([], **change)


@pytest.mark.parametrize("cases", [{"a": {}}, [{"wind": 8.0}], [None]])
def test_what_is_no_run_is_named(cases: Any) -> None:
    with pytest.raises(InputError, match="cases: expected meltemi.Run.*as number 1"):
        simulate_batch(cases)


def test_no_cases_no_outcomes() -> None:
    assert simulate_batch([]) == []


def test_an_iterable_that_fails_says_so(model: Model) -> None:
    def cases() -> Iterator[Run]:
        yield Run(model, SteadyWind(speed=11.0), duration=0.5)
        raise KeyError("table of seeds")

    with pytest.raises(KeyError, match="table of seeds"):
        simulate_batch(cases(), workers=2)


INTERRUPTED = """
import json, signal, threading, time, os, meltemi
model = meltemi.build(meltemi.load_turbine("nrel5mw"))
wind = meltemi.SteadyWind(speed=11.0)
meltemi.simulate(model, wind, duration=0.5)
lengths = [0.5, *[5000.0] * 5]
cases = [meltemi.Run(model, wind, duration=duration, channels=["rotor_speed"]) for duration in lengths]
threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT)).start()
outcomes = meltemi.simulate_batch(cases, workers=2)
print(json.dumps([(int(o.status), len(o.value.time)) for o in outcomes]))
"""


def test_an_interrupt_at_the_end_of_the_last_case_is_told(model: Model) -> None:
    def late(result: Result) -> float:
        _thread.interrupt_main()
        return float(result["rotor_speed"][-1])

    case = Run(model, SteadyWind(speed=11.0), duration=0.5)
    batch = Batch([case], reduce=late, workers=1)
    assert ([o.status for o in batch.run()], batch.interrupted) == ([Status.OK], True)
    batch = Batch([case], workers=1)
    assert batch.run()
    assert not batch.interrupted


def test_who_raises_what_the_keyboard_raises_ends_the_batch(model: Model) -> None:
    def raising(wind: Any) -> Controller:
        raise KeyboardInterrupt

    case = Run(model, SteadyWind(speed=11.0), duration=0.5)
    batch = Batch([replace(case, controller=raising), case], workers=1)
    assert ([o.error for o in batch.run()], batch.interrupted) == ([KeyboardInterrupt], True)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process")
def test_interrupt_keeps_what_is_done() -> None:
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=60, check=True)
    first, *others = json.loads(done.stdout)
    assert first == [Status.OK, 11]
    assert len(others) == 2  # the others were not begun
    assert all(status == Status.INTERRUPTED and 100 < rows < 100_000 for status, rows in others)


@pytest.mark.slow
def test_finished_cases_are_kept(tmp_path: Path) -> None:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))

    def run(speeds: tuple[float, ...] = (8.0, 9.0), **options: Any) -> list[Outcome]:
        cases = (Run(lambda: model, u, duration=2.0, name=f"case {i}") for i, u in enumerate(speeds))
        return simulate_batch(cases, out=tmp_path, workers=2, **options)

    assert [o.reused for o in run()] == [False, False]
    first = (tmp_path / "case 0.nc").read_bytes()
    again = run()
    assert [(o.reused, o.ok, o.value) for o in again] == [(True, True, tmp_path / f"case {i}.nc") for i in range(2)]
    assert (tmp_path / "case 0.nc").read_bytes() == first
    assert [o.reused for o in run((8.0, 9.5))] == [True, False]  # other inputs
    assert [o.value for o in run((8.0, 9.5), reduce=lambda r: len(r.time))] == [41, 41]
    assert [o.reused for o in run((8.0, 9.5), rerun=True)] == [False, False]
    (tmp_path / "case 0.nc").write_bytes(first[:-100])
    assert [o.reused for o in run((8.0, 9.5))] == [False, True]  # damaged
    law = meltemi.control.BaselineController(model.turbine)
    told = Run(model, 8.0, duration=2.0, controller=law, name="law")
    other = replace(told, controller=meltemi.control.BaselineController(model.turbine, sample_time=0.1))
    unknown = replace(told, controller=replace(law, fresh=lambda: law))
    kept = [simulate_batch([case], out=tmp_path)[0].reused for case in (told, told, other, unknown, unknown)]
    assert kept == [False, True, False, False, False]


def test_progress_is_no_more_than_is_known() -> None:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))

    def shares(**options: int) -> list[float]:
        seen: list[float] = []
        cases = (Run(model, 8.0 + 0.1 * i, duration=400.0) for i in range(6))
        simulate_batch(cases, workers=1, progress=seen.append, **options)  # type: ignore[arg-type]
        return seen

    for seen in (shares(), shares(total=6)):
        assert seen == sorted(seen)
        assert seen[-1] == 1.0
    waiting = Batch(Run(model, 8.0, duration=400.0) for _ in range(6))
    waiting.outcomes[0] = Outcome("first", Status.OK)
    assert waiting._share() == 0.0
    waiting.total = 6
    assert waiting._share() == pytest.approx(1.0 / 6.0)
    with pytest.raises(InputError, match="workers must be an integer from 1 to 1000, found 1000000000"):
        simulate_batch([], workers=10**9)


def test_a_series_begins_in_its_upflow(model: Model) -> None:
    """As steady wind of the same inclination; without it the state is another one."""
    speed, upflow = 11.0, np.radians(8.0)
    series = WindSeries(time=[0.0, 1.0], speed=[speed, speed], vertical=speed * np.tan(upflow))
    begun, _ = points.initial_state(model, series)
    expected, _ = points.initial_state(model, SteadyWind(speed=speed, upflow=upflow))
    level, _ = points.initial_state(model, SteadyWind(speed=speed))
    assert begun["RootMyb1"] == pytest.approx(expected["RootMyb1"], rel=1e-9)
    assert abs(begun["RootMyb1"] / level["RootMyb1"] - 1.0) > 1e-3


def test_a_piece_learns_that_its_batch_is_told_to_end() -> None:
    def work() -> bool:
        before = told_to_end()
        _thread.interrupt_main()
        deadline = time.monotonic() + 20.0
        while not told_to_end() and time.monotonic() < deadline:
            time.sleep(0.01)
        return not before and told_to_end()

    batch = Batch([Piece("waits", work)], workers=1)
    assert [o.value for o in batch.run()] == [True] and batch.interrupted
    assert not told_to_end()
