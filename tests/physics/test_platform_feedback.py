"""Feedback of a floater's motion to the pitch: its rule, and the linear model under the law beside a run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import meltemi
from meltemi.analyses.linear import linearise
from meltemi.control import BaselineController
from meltemi.core.errors import InputError
from meltemi.tuning import platform_feedback
from meltemi.tuning.platform_feedback import pitch_damping, tune_platform_feedback, under

SPEED, PUSH = 16.0, 5e-4
"""[m/s]; [rad/s] of the platform in pitch."""


@pytest.fixture(scope="module")
def model() -> Any:
    return meltemi.build(meltemi.load_turbine("iea15mw-volturnus"))


def with_feedback(turbine: Any, gain: float) -> Any:
    return turbine.replace(**{"control.pitch.motion_gain": gain, "control.pitch.motion_frequency": 0.2186})


@pytest.mark.long
@pytest.mark.parametrize(("gain", "damping"), [(0.0, 0.055), (0.021, 0.098)])
def test_a_pushed_platform_moves_as_the_linear_model_under_the_law(model: Any, gain: float, damping: float) -> None:
    """What a push adds to a run; it has the sign and the size of the feedback."""
    turbine = with_feedback(model.turbine, gain)
    model = meltemi.build(turbine)
    point = meltemi.operating_point(model, SPEED)

    def pitch(push: float) -> Any:
        def pushed(case: Any, unsettled: bool) -> None:
            case["v"][model.coordinates.index("base pitch")] += push

        run = meltemi.Run(
            model=model, wind=point.wind, duration=100.0, start=point, controller=BaselineController(turbine)
        )
        simulation = meltemi.Simulation(run, starting=pushed)
        simulation.advance(simulation.n_steps)
        result = simulation.result()
        return result.time, np.asarray(result["platform_pitch"])

    (time, moved), (_, still) = pitch(PUSH), pitch(0.0)
    outputs = ("generator_speed", "tower_top_acceleration_x")
    linear = linearise(model, point, inputs=("generator_torque", "pitch"), outputs=outputs)
    A, x = under(linear, turbine.control), np.zeros(len(linear.states) + 4)
    step, rows = expm(0.5 * A), []
    x[linear.states.index("v base pitch")] = PUSH
    for _ in np.arange(0.0, 100.0, 0.5):
        rows.append(x[linear.states.index("q base pitch")])
        x = step @ x
    found = np.interp(np.arange(0.0, 100.0, 0.5), time - time[0], moved - still)
    assert np.abs(found - rows).max() < 0.05 * np.abs(rows).max()
    assert pitch_damping(linear, turbine.control, 0.2186) == pytest.approx(damping, abs=0.003)


@pytest.mark.long
def test_the_gain_is_the_slope_of_the_steady_pitch(model: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform_feedback, "MARGIN_POINTS", 2)
    monkeypatch.setattr(platform_feedback, "rated_wind", lambda model: 11.0)
    text = (Path(__file__).parents[2] / "docs/guide/floating.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    page: dict[str, Any] = {}
    exec(code, page)
    found = page["feedback"]
    assert page["turbine"].control == found.control
    low, high = (meltemi.operating_point(model, float(u)).pitch for u in found.wind_speed)
    assert found.gain == pytest.approx((high - low) / np.diff(found.wind_speed)[0])
    assert found.frequency == pytest.approx(2.0 * np.pi / 28.7, rel=0.002)
    assert np.all(found.damping > found.damping_without + 0.02)
    assert found.control.pitch.motion_gain == found.gain and found.control.pitch.motion_frequency == found.frequency


def test_turbines_on_land_have_no_platform() -> None:
    with pytest.raises(InputError, match="nrel5mw does not float"):
        tune_platform_feedback(meltemi.build(meltemi.load_turbine("nrel5mw")))
