"""``tune_baseline``: the published gains of the NREL 5 MW, and what its options do."""

from __future__ import annotations

import math

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Turbine
from meltemi.analysis import BaselineTuning, tune_baseline
from meltemi.tuning.speed_loop import speed_loops, speed_responses
from meltemi.turbine.library import library_entries

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def tuning(turbine: Turbine) -> BaselineTuning:
    return tune_baseline(turbine, margins=False)


@pytest.mark.long
def test_the_nrel5mw_gets_its_published_gains(turbine: Turbine, tuning: BaselineTuning) -> None:
    # TP-500-38060, Tables 7-1 and 7-2; the deviations: +2.0 %, +2.0 %, -1.8 %, 5.76 instead of 6.30 deg, +0.1 %
    published, found = turbine.control.pitch, tuning.control.pitch
    assert tuning.frequency == pytest.approx(0.6, rel=1e-4)
    assert tuning.inertia == pytest.approx(43784725.0, rel=0.002)
    assert tuning.sensitivity_at_zero == pytest.approx(-25.52e6, rel=0.03)
    assert found.proportional_gain == pytest.approx(published.proportional_gain, rel=0.03)
    assert found.integral_gain == pytest.approx(published.integral_gain, rel=0.03)
    assert found.gain_halving_pitch == pytest.approx(published.gain_halving_pitch, rel=0.10)


@pytest.mark.long
def test_the_optimal_gain_is_that_of_the_flexible_rotor(turbine: Turbine, tuning: BaselineTuning) -> None:
    # published: C_P 0.482 at a tip-speed ratio of 7.55; the gain goes with the inverse cube of the ratio
    assert tuning.power_coefficient == pytest.approx(0.482, abs=0.005)
    assert tuning.tip_speed_ratio == pytest.approx(7.55, rel=0.05)
    R, lam = turbine.rotor_radius, tuning.tip_speed_ratio
    gain = 0.5 * 1.225 * np.pi * R**5 * tuning.power_coefficient / lam**3 / 97.0**3
    assert tuning.control.torque.optimal_gain == pytest.approx(gain, rel=1e-3)


@pytest.mark.long
def test_the_optimal_gain_holds_the_ratio_that_is_asked_for(turbine: Turbine) -> None:
    asked = tune_baseline(turbine, tip_speed_ratio=7.55, margins=False)
    assert asked.tip_speed_ratio == 7.55
    assert asked.control.torque.optimal_gain == pytest.approx(turbine.control.torque.optimal_gain, rel=0.02)


@pytest.mark.long
def test_frequency_damping_and_ratio_set_the_gains_and_rated_power_is_not_passed_below_rated_speed(
    turbine: Turbine, tuning: BaselineTuning
) -> None:
    small = turbine.replace(**{"control.torque.rated_power": 3e6})
    other = tune_baseline(small, frequency=0.3, damping_ratio=1.4, tip_speed_ratio=6.0, margins=False)
    a, b = tuning.control.pitch, other.control.pitch
    assert b.integral_gain / b.proportional_gain == pytest.approx(0.3 / 2.8, rel=1e-6)
    assert a.integral_gain / a.proportional_gain == pytest.approx(0.6 / 1.4, rel=1e-4)
    assert b.proportional_gain * other.sensitivity_at_zero == pytest.approx(
        a.proportional_gain * tuning.sensitivity_at_zero, rel=1e-5
    )  # half the frequency, twice the damping
    assert other.tip_speed_ratio == 6.0
    torque = other.control.torque
    assert torque.optimal_gain * torque.rated_speed**3 == pytest.approx(3e6)


def test_nonsense_is_refused(turbine: Turbine) -> None:
    for name in ("frequency", "damping_ratio", "tip_speed_ratio"):
        with pytest.raises(InputError, match=f"tune_baseline: {name} must be above zero, found -1"):
            tune_baseline(turbine, **{name: -1.0})


@pytest.mark.long
@pytest.mark.parametrize(("name", "ratio"), [("iea15mw", 9.0), ("iea22mw", None)])
def test_the_gains_of_the_library_are_those_of_the_rule(name: str, ratio: float | None) -> None:
    assert library_entries()[name].windio
    turbine = meltemi.load_turbine(name)
    found, stored = tune_baseline(turbine, tip_speed_ratio=ratio).control, turbine.control
    assert found.torque.optimal_gain == pytest.approx(stored.torque.optimal_gain, rel=0.005)
    assert found.filter_frequency == pytest.approx(stored.filter_frequency, rel=1e-3)
    for gain in ("proportional_gain", "integral_gain", "gain_halving_pitch"):
        assert getattr(found.pitch, gain) == pytest.approx(getattr(stored.pitch, gain), rel=0.005)


@pytest.mark.long
def test_margins_lower_the_frequency_and_widen_filter_and_schedule(turbine: Turbine, tuning: BaselineTuning) -> None:
    found = tune_baseline(turbine, tip_speed_ratio=7.55)
    assert 0.6 * tuning.frequency < found.frequency < 0.9 * tuning.frequency
    assert found.control.filter_frequency == pytest.approx(8.0 * found.frequency)
    assert found.control.pitch.gain_halving_pitch == pytest.approx(
        4.0 * tuning.control.pitch.gain_halving_pitch, rel=0.05
    )
    point = meltemi.operating_point(meltemi.build(turbine), 1.1 * tuning.wind_speed[0])
    responses = speed_responses(meltemi.build(turbine), [point])
    (usual,), (kept,) = (speed_loops(each.control, [point], responses) for each in (tuning, found))
    assert usual.phase_margin < math.radians(25.0) and kept.phase_margin > math.radians(29.5)
    assert kept.gain_margin > 2.0


@pytest.mark.long
def test_a_loop_of_the_linear_model_tells_when_a_run_oscillates() -> None:
    """With ever more gain the IEA 15 MW turns unstable where the loop passes -1."""
    pytest.importorskip("windIO")
    turbine = meltemi.load_turbine("iea15mw")
    model = meltemi.build(turbine)
    point = meltemi.operating_point(model, 11.3)
    responses = speed_responses(model, [point])
    (loop,) = speed_loops(turbine.control, [point], responses)
    assert 1.6 < loop.gain_margin < 2.6
    growth = []
    for factor in (1.6, 2.6):
        law = turbine.control.replace(
            **{f"pitch.{g}": factor * getattr(turbine.control.pitch, g) for g in ("proportional_gain", "integral_gain")}
        )
        run = meltemi.simulate(
            meltemi.build(turbine.replace(control=law)), meltemi.SteadyWind(speed=11.3), duration=260.0, start=point
        )
        early, late = (run["rotor_speed"][(run.time > t) & (run.time < t + 60.0)].std() for t in (60.0, 200.0))
        growth.append(late / early)
    assert growth[0] < 1.02 and growth[1] > 3.0
