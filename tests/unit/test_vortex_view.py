"""Vortices of a view: frames between time steps, their track, and the table beside momentum theory."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi.core.errors import Status
from meltemi.postprocess.statistics import once_per_revolution
from meltemi.report.momentum import beside_momentum
from meltemi.scene.record import Scene
from meltemi.scene.vortices import FRAMES, VortexFrames
from meltemi.simulation.channels import standard
from meltemi.simulation.result import Result
from meltemi.turbine.definition import Turbine

RADIUS = 63.0


def helices(t: float) -> np.ndarray:
    """Three blades with two lines of thirty points behind a rotor that makes a revolution in five seconds."""
    age = np.arange(30.0) * 0.5
    about = 2.0 * np.pi / 5.0 * (t - age) + 2.0 * np.pi / 3.0 * np.arange(3.0)[:, None, None]
    r = np.array([5.0, RADIUS])[:, None]
    values = np.zeros((3, 2, 30, 4), dtype=np.float32)
    values[..., 0], values[..., 1], values[..., 2] = 7.0 * age, r * np.sin(about), r * np.cos(about)
    values[..., 3] = np.array([-80.0, 80.0])[:, None]
    return values


def test_frames_are_taken_at_equal_numbers_of_steps_from_where_a_run_begins() -> None:
    frames, step, pieces = VortexFrames(7), 3, []
    while step < 40:
        pieces.append(frames.take(step, lambda: helices(0.0)))
        step += min(pieces[-1], 5)  # the loop of the run may stop before
    assert list(frames.frames) == [3, 10, 17, 24, 31, 38]
    assert pieces[:4] == [7, 2, 7, 2]
    frames.take(0, lambda: helices(0.0))  # it has begun again
    assert list(frames.frames) == [0]


def test_a_revolution_has_the_same_number_of_frames_on_all_turbines(turbine: Turbine) -> None:
    every = VortexFrames.of(turbine, 0.01).every
    assert every * 0.01 * turbine.rated_rotor_speed == pytest.approx(2.0 * np.pi / FRAMES, rel=0.03)
    assert VortexFrames.of(turbine, 1.0).every == 1


def test_a_track_has_the_frames_of_a_time_in_16_bits() -> None:
    frames = VortexFrames(20, {step: helices(0.01 * step) for step in range(0, 2000, 20)})
    about, arrays = frames.track(0.01, 4.9, 15.0)
    assert about["vortices"] == pytest.approx(
        {"blades": 3, "lines": 2, "points": 30, "largest": 80.0, "step": 0.2, "begin": 0.1}
    )
    values = Scene({}, arrays).track("vortices")
    expected = np.stack([helices(5.0 + 0.2 * i) for i in range(51)])
    assert np.abs(values - expected).max() < 2.0 * RADIUS / 32767
    assert arrays["vortices.amplitude"].dtype == np.int16
    assert frames.track(0.01, 30.0, 40.0) == ({}, {})


def series(names: list[str], columns: list[np.ndarray], time: np.ndarray) -> Result:
    channels = tuple(standard()[name] for name in names)
    return Result(time, np.stack(columns, axis=1), channels, Status.OK, "", {})


def test_parts_once_per_revolution_are_those_of_the_last_whole_ones() -> None:
    time = np.arange(0.0, 23.0, 0.05)
    psi = 1.1 * time + 0.3
    x = 900.0 + 40.0 * np.cos(psi) - 25.0 * np.sin(psi) + 9.0 * np.cos(3.0 * psi)
    run = series(["azimuth", "root_moment_flap_1"], [psi % (2.0 * np.pi), x], time)
    cosine, sine = once_per_revolution(run, ["root_moment_flap_1"])["root_moment_flap_1"]
    assert cosine == pytest.approx(40.0, abs=0.2)
    assert sine == pytest.approx(-25.0, abs=0.2)
    assert once_per_revolution(run.between(0.0, 5.0), ["root_moment_flap_1"]) == {}


def test_a_wake_beside_momentum_states_units_and_differences() -> None:
    time = np.arange(0.0, 30.0, 0.05)
    psi = 1.2 * time
    names = ["azimuth", "generator_power", "root_moment_flap_1"]
    runs = [
        series(names, [psi % (2.0 * np.pi), np.full(len(time), power), 8e6 + sine * np.sin(psi)], time)
        for power, sine in ((3.3e6, -184e3), (3.0e6, -705e3))
    ]
    head, rows = beside_momentum(*runs)
    assert rows[0][1:] == ["mean", "kW", "3300", "3000", "300.0", "10.00"]
    sine = next(dict(zip(head, row, strict=True)) for row in rows if row[1] == "sine of the azimuth")
    assert (sine["unit"], float(sine["vortex wake"]), float(sine["momentum"])) == ("kN m", -184.0, -705.0)
    assert float(sine["difference"]) == pytest.approx(521.0)
    assert float(sine["%"]) == pytest.approx(73.9, abs=0.1)
    assert any(row[1] == "DEL 1 Hz" for row in rows)
    few = [run.between(0.0, 2.0) for run in runs]  # less than a revolution
    assert not any("azimuth" in row[1] for row in beside_momentum(*few)[1])
