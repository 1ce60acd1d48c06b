"""Output-constrained individual pitch: the 1P moment ends at its limit, and what is below it is left alone."""

from __future__ import annotations

from math import inf, pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError
from meltemi.control.controller import StartPoint, compiled_entry
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.load_control import HarmonicLoop
from meltemi.studies.constrained_pitch import FULL, NONE, constrained_pitch

PLANT = -2e8 + 1.5e8j
"""[N m/rad] of pitch at 1P."""
LOOP = HarmonicLoop(harmonic=1, integral_gain=1.2e-9, filter_damping=1.0, offset=float(np.angle(-1.0 / PLANT)))
WITHOUT = 2.4e6 - 1.8e6j
"""[N m] 1P moment without individual pitch, 3 MN m."""
SPEED, DT, BLADES = 0.8, 0.05, np.arange(3) * 2.0 * pi / 3.0
RATED = 122.9096
"""[rad/s] of the generator, at which the collective pitch stays."""


def settled(limit: float, norm: Any = "l2") -> tuple[complex, complex]:
    """Moment at 1P and pitch demand at 1P in the end, on a rotor that follows its pitch at once."""
    controller = constrained_pitch(meltemi.load_turbine("nrel5mw"), LOOP, PLANT, limit, norm)
    start = StartPoint(wind_speed=15.0, generator_speed=RATED, pitch=0.18, generator_torque=4e4)
    state: Any = controller.init(start)  # type: ignore[misc]
    state = np.array(getattr(state, "array", state))
    update = compiled_entry(controller.update)
    measured, demands = Measurements.of(n_blades=3.0, rotor_speed=SPEED, generator_speed=RATED), Demands.of()
    moment, pitch = WITHOUT, 0.0j
    for k in range(4000):
        measured.azimuth = SPEED * DT * k
        turned = np.exp(1j * (measured.azimuth + BLADES))
        moment = WITHOUT + PLANT * pitch
        for b in range(3):
            measured.out_of_plane_moment[b] = 5e6 + (moment * turned[b]).real
        update(state, measured.array, demands.array, DT)
        asked = np.array([demands.pitch[b] for b in range(3)])
        pitch = 2.0 / 3.0 * complex(np.sum(asked * turned.conj()))
    return moment, pitch


def test_the_moment_ends_at_its_limit_with_the_phase_that_it_had() -> None:
    moment, pitch = settled(1e6)
    assert abs(moment) == pytest.approx(1e6, rel=0.02)
    assert np.angle(moment / WITHOUT) == pytest.approx(0.0, abs=0.03)
    assert pitch == pytest.approx((WITHOUT / abs(WITHOUT) * 1e6 - WITHOUT) / PLANT, rel=0.03)


def test_each_part_ends_at_its_own_limit() -> None:
    moment, _ = settled(2e6, "linf")
    assert (moment.real, moment.imag) == pytest.approx((2e6, -1.8e6), rel=0.03)


def test_below_the_limit_there_is_no_individual_pitch() -> None:
    assert abs(settled(3.2e6)[1]) < 1e-5
    assert abs(settled(inf)[1]) < 1e-12


def test_without_a_limit_it_is_individual_pitch_control() -> None:
    moment, pitch = settled(0.0)
    assert abs(moment) < 0.01 * abs(WITHOUT)
    assert pitch == pytest.approx(-WITHOUT / PLANT, rel=0.01)


def test_it_is_for_pitch_at_1p_and_a_limit_of_a_load() -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    with pytest.raises(InputError, match="limit -1 N m must be 0 or larger, or inf"):
        constrained_pitch(turbine, LOOP, PLANT, -1.0)
    with pytest.raises(InputError, match="loop is of 2P pitch, it must be of 1P pitch"):
        constrained_pitch(turbine, LOOP.replace(harmonic=2), PLANT, 1e6)


def test_shares_are_of_what_full_individual_pitch_adds_and_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "tools")
    from constrained_pitch import controllers, trades

    names = list(controllers(meltemi.load_turbine("nrel5mw"), LOOP, PLANT, {"l2": [1e6], "linf": [2e6]}))
    assert names == [NONE, FULL, "l2 1 MN m", "linf 2 MN m"]
    numbers = {
        "pitch travel": {NONE: [1.0, 2.0], FULL: [5.0, 10.0], "half": [3.0, 6.0]},
        "RootMyc1 DEL": {NONE: [10.0, 20.0], FULL: [6.0, 12.0], "half": [7.0, 14.0]},
    }
    c: Any = SimpleNamespace(schemes=(NONE, FULL, "half"), values=lambda q, s: np.array(numbers[q][s]))
    half = trades(c)[2]
    assert (half.travel.mean, half.load.mean) == pytest.approx((3.0, -0.3))
    assert (half.actuation.mean, half.reduction.mean) == pytest.approx((0.5, 0.75))
