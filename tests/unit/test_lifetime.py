"""Weights of a lifetime, annual energy, load durations, duty of actuators."""

from __future__ import annotations

from math import exp, pi

import numpy as np
import pytest

from meltemi import InputError
from meltemi.loads.durations import (
    actuator_duty,
    count_stops,
    duration_load,
    load_duration,
)
from meltemi.loads.energy import YEAR, annual_energy
from meltemi.postprocess.cycles import cycle_load, damage_sum, rainflow_cycles, sum_cycles
from meltemi.postprocess.ensemble import lifetime_del, rayleigh_weights, speed_exceedance, weibull_weights
from meltemi.postprocess.fatigue import damage_equivalent_load

SPEEDS = np.arange(4.0, 25.0, 2.0)
EDGES = np.arange(3.0, 26.0, 2.0)
LIFETIME = 20.0 * YEAR

# wind speeds


def test_tails_go_to_the_end_bins_or_stay_outside() -> None:
    outside = rayleigh_weights(SPEEDS, 10.0, EDGES.tolist())
    ends = rayleigh_weights(SPEEDS, 10.0, EDGES.tolist(), tails="end_bins")
    low, high = 1.0 - exp(-pi / 4.0 * 0.09), exp(-pi / 4.0 * 6.25)
    assert ends.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(ends - outside, [low, *[0.0] * 9, high], atol=1e-15)
    beyond = speed_exceedance([3.0, 25.0], 10.0)
    assert 1.0 - beyond[0] + beyond[1] + outside.sum() == pytest.approx(1.0, abs=1e-15)
    with pytest.raises(InputError, match="tails must be"):
        weibull_weights(SPEEDS, 10.0, 2.0, tails="none")  # type: ignore[arg-type]


# lifetime


def test_lifetime_cycles_are_the_lifetime_load() -> None:
    """Cycles weighted with their occurrence, against the power mean of the runs' loads (F-10)."""
    rng = np.random.default_rng(1)
    runs = [(1.0 + 0.1 * v) * rng.standard_normal(3000) for v in SPEEDS]
    loads = [damage_equivalent_load(x, duration=600.0, slope=4.0) for x in runs]
    weights = LIFETIME / 600.0 * rayleigh_weights(SPEEDS, 10.0, EDGES.tolist())
    life = sum_cycles([rainflow_cycles(x) for x in runs], weights.tolist())
    expected = lifetime_del(SPEEDS, loads, slope=4.0, mean_speed=10.0, edges=EDGES.tolist())
    assert cycle_load(life, slope=4.0, reference=LIFETIME) == pytest.approx(expected, rel=1e-4)
    parts = [damage_sum(sum_cycles([rainflow_cycles(x)], [w]), 4.0) for x, w in zip(runs, weights, strict=True)]
    assert sum(parts) == pytest.approx(damage_sum(life, 4.0), rel=1e-4)


# energy


def test_annual_energy_by_hand() -> None:
    found = annual_energy([[1e6, 3e6], [4e6, 4e6]], [0.25, 0.5], availability=0.9)
    hours = 8760.0 * 0.9
    assert found.energy / 3.6e9 == pytest.approx(hours * (0.25 * 2.0 + 0.5 * 4.0))
    # one degree of freedom: all scatter is that of the first speed, std sqrt(2) MW over two seeds
    assert found.half_width / 3.6e9 == pytest.approx(12.706 * hours * 0.25 * 1.0, rel=1e-4)
    assert found.parts.sum() == pytest.approx(found.energy)
    assert np.isnan(annual_energy([[1e6]], [1.0]).half_width)
    assert annual_energy([[1e6, 1e6]], [1.0]).half_width == 0.0


def test_the_interval_of_the_energy_covers() -> None:
    rng = np.random.default_rng(2)
    p = rayleigh_weights(SPEEDS, 10.0)
    mean, std = 5e6 * np.minimum((SPEEDS / 11.4) ** 3, 1.0), 2e5 * np.ones(len(SPEEDS))
    truth = YEAR * float(p @ mean)
    inside = 0
    for _ in range(400):
        found = annual_energy([m + s * rng.standard_normal(6) for m, s in zip(mean, std, strict=True)], p)
        inside += abs(found.energy - truth) < found.half_width
    assert 0.92 < inside / 400 < 0.98


@pytest.mark.parametrize(
    ("powers", "p", "availability"), [([[1.0]], [0.5, 0.5], 1.0), ([[]], [1.0], 1.0), ([[1.0]], [1.0], 1.5)]
)
def test_impossible_energy_is_refused(powers: list[list[float]], p: list[float], availability: float) -> None:
    with pytest.raises(InputError):
        annual_energy(powers, p, availability=availability)


# load durations


def test_load_durations_of_a_ramp() -> None:
    """The load grows evenly, the shaft turns at one and then at two revolutions a second."""
    t = (np.arange(1000) + 0.5) / 100.0
    speed = 2.0 * pi * np.where(t < 5.0, 1.0, 2.0)
    found = load_duration(t, speed, dt=0.01, load_edges=[0.0, 2.0, 6.0, 10.0], speed_edges=[0.0, 9.0, 18.0])
    np.testing.assert_allclose(found.time, [[2.0, 0.0], [3.0, 1.0], [0.0, 4.0]])
    np.testing.assert_allclose(found.revolutions, [[2.0, 0.0], [3.0, 2.0], [0.0, 8.0]])
    # levels 1, 4 and 8 with 2, 5 and 8 revolutions
    expected = ((2.0 * 1.0 + 5.0 * 4.0**3 + 8.0 * 8.0**3) / 15.0) ** (1.0 / 3.0)
    assert duration_load(found, exponent=3.0) == pytest.approx(expected)


def test_the_equivalent_bearing_load_converges() -> None:
    """A load that grows evenly from 0 to 10: (10^p / (p + 1))^(1/p)."""
    t = (np.arange(100_000) + 0.5) / 1e4
    p = 10.0 / 3.0
    exact = 10.0 * (1.0 / (p + 1.0)) ** (1.0 / p)
    error = []
    for bins in (5, 10, 20):
        edges = np.linspace(0.0, 10.0, bins + 1)
        error.append(abs(duration_load(load_duration(t, np.ones_like(t), dt=1e-4, load_edges=edges)) / exact - 1.0))
    assert error[0] < 0.01
    assert error[1] == pytest.approx(error[0] / 4.0, rel=0.05) and error[2] == pytest.approx(error[1] / 4.0, rel=0.05)


def test_durations_outside_the_edges_are_refused() -> None:
    with pytest.raises(InputError, match="load lies between 0 and 3, edges between 0 and 2"):
        load_duration([0.0, 3.0], [1.0, 1.0], dt=1.0, load_edges=[0.0, 2.0])
    with pytest.raises(InputError, match="shaft_speed lies"):
        load_duration([0.0, 1.0], [1.0, -1.0], dt=1.0, load_edges=[0.0, 2.0], speed_edges=[0.0, 2.0])
    with pytest.raises(InputError, match="does not turn"):
        duration_load(load_duration([0.5], [0.0], dt=1.0, load_edges=[0.0, 1.0]))


# actuators


def test_duty_of_an_actuator() -> None:
    position = [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.5, 1.5]
    duty = actuator_duty(position, dt=0.5)
    assert (duty.travel, duty.time, duty.moving, duty.starts, duty.reversals) == (3.5, 4.0, 2.0, 2, 2)
    assert duty.largest_rate == 2.0 and duty.rms_rate == pytest.approx(np.sqrt((4.0 + 4.0 + 4.0 + 1.0) / 8.0))
    slow = actuator_duty(position, dt=0.5, threshold=1.5)
    assert (slow.travel, slow.moving, slow.reversals) == (3.5, 1.5, 1)


def test_duty_of_a_sine() -> None:
    t = np.linspace(0.0, 100.0, 100_001)
    duty = actuator_duty(0.1 * np.sin(2.0 * pi * 0.2 * t), dt=1e-3)
    assert duty.travel == pytest.approx(4 * 0.1 * 20, rel=1e-5)
    assert duty.rms_rate == pytest.approx(0.1 * 2.0 * pi * 0.2 / np.sqrt(2.0), rel=1e-4)
    assert (duty.starts, duty.reversals) == (1, 40)


def test_stops_count_with_hysteresis() -> None:
    speed = [5.0, 4.0, 0.0, 1.0, 0.0, 3.0, 5.0, 2.0, 5.0, 0.0]
    assert count_stops(speed, on=4.0, off=0.5) == 2
    assert count_stops(speed, on=4.0, off=2.5) == 3
    assert count_stops([0.0, 5.0], on=4.0, off=0.5) == 0
    with pytest.raises(InputError, match="off must lie below on"):
        count_stops(speed, on=1.0, off=1.0)
