"""Vortex wakes in the view, in saved states and beside momentum, by runs of a few seconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import meltemi
from meltemi import Result
from meltemi.scene.record import Scene
from meltemi.simulation.simulate import Simulation

pytestmark = pytest.mark.long
SPEED, DURATION = 10.0, 6.0


@pytest.fixture(scope="module")
def model() -> meltemi.Model:
    return meltemi.build(meltemi.load_turbine("nrel5mw"), meltemi.ModelOptions(wake="hybrid", nacelle_yaw=0.35))


@pytest.fixture(scope="module")
def seen(model: meltemi.Model) -> Result:
    return meltemi.simulate(model, SPEED, duration=DURATION, view=True)


@pytest.fixture(scope="module")
def lines(seen: Result) -> np.ndarray:
    """(frame, blade, line, point, 4)."""
    return Scene({}, seen.scene.arrays).track("vortices")


def test_lines_begin_at_the_blades(seen: Result, lines: np.ndarray, model: meltemi.Model) -> None:
    R, apex = model.turbine.rotor_radius, model.turbine.hub_height
    distance = np.linalg.norm(lines[:, :, 3, 0, :3] - [0.0, 0.0, apex], axis=-1)
    assert np.abs(distance - R).max() < 0.08 * R  # the apex is upwind of the tower, the blades bend
    roots = np.linalg.norm(lines[:, :, 0, 0, :3] - [0.0, 0.0, apex], axis=-1)
    assert roots.max() < 0.15 * R
    # blade 1 points up at azimuth 0, and the nacelle is turned counter-clockwise
    step, psi = seen.scene.about["vortices"]["step"], seen["azimuth"]
    now = np.interp(np.arange(len(lines)) * step, seen.time, np.unwrap(psi))
    height = lines[:, 0, 3, 0, 2] - apex
    assert np.abs(height - R * np.cos(now)).max() < 0.08 * R


def test_tip_vortices_leave_downwind_at_a_speed_between_wake_and_wind(seen: Result, lines: np.ndarray) -> None:
    """Axial induction is near 0.3; point k is k/12 of a revolution old."""
    revolution = 2.0 * np.pi / seen["rotor_speed"].mean()
    middle = lines.mean(axis=(0, 1))[3, :, 0]
    speed = (middle[36] - middle[0]) / (3.0 * revolution)
    assert 0.5 * SPEED < speed < 0.95 * SPEED
    assert np.all(np.diff(middle[:60]) > 0.0)


def test_a_steady_wake_turns_with_the_rotor(seen: Result, lines: np.ndarray) -> None:
    """A third of a revolution later each vortex is where that of the next blade was."""
    turned = np.unwrap(seen["azimuth"])
    at = np.arange(len(lines)) * seen.scene.about["vortices"]["step"]
    before = at[at < np.interp(turned[-1] - 2.1, turned, seen.time) - 0.5]
    after = np.interp(np.interp(before, seen.time, turned) + 2.0 * np.pi / 3.0, turned, seen.time)
    tips = lines[:, :, 3, :40, :3]
    apart = CubicSpline(at, tips)(after) - np.roll(tips[: len(before)], -1, axis=1)
    assert len(before) > 5
    assert np.linalg.norm(apart, axis=-1).max() < 0.12 * 63.0


def test_strengths_are_negative_at_roots_and_sum_to_nothing(lines: np.ndarray) -> None:
    strength = lines[..., 3]
    assert strength[:, :, 3].mean() > 10.0
    assert strength[:, :, 0].mean() < -10.0
    assert np.abs(strength.sum(axis=2)).max() < 0.2 * np.abs(strength).max()


def test_the_view_changes_no_number(seen: Result, model: meltemi.Model) -> None:
    plain = meltemi.simulate(model, SPEED, duration=DURATION)
    assert np.array_equal(plain.data, seen.data)


def test_a_restored_run_continues_to_the_bit(seen: Result, model: meltemi.Model, tmp_path: Path) -> None:
    run = meltemi.Run(model, SPEED, duration=DURATION, view=True)
    first, second = Simulation(run), Simulation(run)
    first.advance(int(0.4 * first.n_steps))
    meltemi.io.restore_state(second, meltemi.io.save_state(first, tmp_path / "state.npz"))
    second.advance(second.n_steps)
    assert np.array_equal(second.result().data, seen.data)
    about = second.result().scene.about["vortices"]
    assert about["begin"] == pytest.approx(first.time, abs=0.01)
