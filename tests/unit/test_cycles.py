"""Load cycles: residue, sums over runs, Markov matrices, means, equivalent loads of a lifetime."""

from __future__ import annotations

from collections import Counter
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meltemi import InputError
from meltemi.postprocess.cycles import (
    Cycles,
    bin_cycles,
    cycle_load,
    damage_sum,
    goodman_cycles,
    markov_matrix,
    rainflow_cycles,
    sum_cycles,
)
from meltemi.postprocess.fatigue import damage_equivalent_load

steady = settings(derandomize=True, deadline=None, max_examples=100)
series = st.lists(st.integers(-20, 20).map(float), min_size=2, max_size=60)
SLOPES = (3.0, 4.0, 5.0, 8.0, 10.0, 12.0)
ASTM = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]
"""The example of ASTM E1049-85, figure 6."""


def random_load(seed: int, n: int = 12000) -> np.ndarray:
    """Something slow, a tone and noise."""
    rng = np.random.default_rng(seed)
    t = 0.05 * np.arange(n)
    slow = np.cumsum(rng.standard_normal(n))
    slow /= np.ptp(slow)
    return 1e6 * (4.0 + 3.0 * slow + np.sin(2.0 * pi * 0.2 * t + rng.uniform(0.0, 6.0)) + 0.2 * rng.standard_normal(n))


def together(parts: list[Cycles], weights: list[float]) -> Cycles:
    """All cycles, none of them binned."""
    scaled = [c._replace(counts=w * c.counts) for c, w in zip(parts, weights, strict=True)]
    return Cycles(*(np.concatenate(part) for part in zip(*scaled, strict=True)))


def tally(cycles: Cycles) -> Counter[tuple[float, float]]:
    counts: Counter[tuple[float, float]] = Counter()
    for r, m, n in zip(*cycles, strict=True):
        counts[round(float(r), 9), round(float(m), 9)] += float(n)
    return counts


# residue


def test_the_example_of_the_standard_repeated() -> None:
    # E1049-85, 5.4.5, figure 7: the history starts at its peak D = 5; cycles E-F, A-B, H-C and D-G
    assert tally(rainflow_cycles(ASTM, "repeated")) == {
        (4.0, 1.0): 1.0,
        (3.0, -0.5): 1.0,
        (7.0, 0.5): 1.0,
        (9.0, 0.5): 1.0,
    }


@steady
@given(x=series)
def test_a_repeated_series_has_the_cycles_that_each_repetition_adds(x: list[float]) -> None:
    """The series after itself, counted with half cycles: from the fourth time on each adds the same whole ones."""
    added = tally(rainflow_cycles(np.tile(x, 5)))
    added.subtract(tally(rainflow_cycles(np.tile(x, 4))))
    assert {key: n for key, n in added.items() if n} == tally(rainflow_cycles(x, "repeated"))


def test_the_residue_of_a_rise_is_half_or_one_cycle() -> None:
    assert damage_equivalent_load([0.0, 3.0], duration=1.0, slope=4.0) == pytest.approx(3.0 * 0.5**0.25)
    assert damage_equivalent_load([0.0, 3.0], duration=1.0, slope=4.0, residue="repeated") == pytest.approx(3.0)
    with pytest.raises(InputError, match="residue must be 'half' or 'repeated', found 'whole'"):
        rainflow_cycles([0.0, 3.0], "whole")  # type: ignore[arg-type]


def test_two_sines() -> None:
    """A slow sine of amplitude 5 with a fast one of amplitude 1, 20 times its frequency.

    A fast cycle closes on a slope that is lost in it: range 2 (1 - e), e small; once in a slow cycle it is part of the
    large range, 2 (5 + 1) but for the place of the last crest. Counted by hand: 19 small cycles for each large one.
    """
    t = np.linspace(0.0, 1.0, 200_001)
    x = 5.0 * np.cos(2.0 * pi * 10.0 * t) + np.cos(2.0 * pi * 200.0 * t)
    ranges, means, counts = rainflow_cycles(x, "repeated")
    large = ranges > 6.0
    assert counts[large].sum() == 10.0 and counts[~large].sum() == 190.0
    assert ranges[large] == pytest.approx(12.0, abs=0.07)  # crest and trough of the fast one are not quite in step
    assert np.all(ranges[~large] < 2.0 + 1e-3)
    assert means[large] == pytest.approx(0.0, abs=0.04)


# sums over runs


@pytest.mark.parametrize("slope", SLOPES)
def test_cells_keep_the_damage(slope: float) -> None:
    for seed in range(5):
        cycles = rainflow_cycles(random_load(seed))
        for means in (True, False):
            binned = bin_cycles(cycles, means=means)
            assert damage_sum(binned, slope) == pytest.approx(damage_sum(cycles, slope), rel=1e-3)
            if slope == 10.0:
                assert damage_sum(binned, slope) == pytest.approx(damage_sum(cycles, slope), rel=1e-12)
            assert binned.counts.sum() == pytest.approx(cycles.counts.sum(), rel=1e-12)
            assert (binned.counts @ binned.means) == pytest.approx(cycles.counts @ cycles.means, rel=1e-12)
    assert len(binned.ranges) < 0.25 * len(cycles.ranges)


@pytest.mark.parametrize("slope", SLOPES)
def test_the_worst_cell_keeps_the_damage(slope: float) -> None:
    """Half of the cycles at each edge of one cell: the bound of L-3."""
    for ratio in (0.05, 1.0, 20.0):
        edges = 2.0 ** (np.array([7.0, 8.0]) / 40.0) * np.array([1.0 + 1e-9, 1.0 - 1e-9])
        cycles = Cycles(edges, np.zeros(2), np.array([1.0, ratio]))
        binned = bin_cycles(cycles)
        assert len(binned.ranges) == 1
        assert damage_sum(binned, slope) == pytest.approx(damage_sum(cycles, slope), rel=1e-3)


def test_sums_of_runs_are_the_cells_of_all_their_cycles() -> None:
    parts = [rainflow_cycles(random_load(seed)) for seed in range(4)]
    weights = [3.0, 1.0, 1e4, 0.5]
    whole = bin_cycles(together(parts, weights), means=False)
    added = sum_cycles([bin_cycles(c, means=False) for c in parts], weights, means=False)
    order, other = np.argsort(whole.ranges), np.argsort(added.ranges)
    np.testing.assert_allclose(added.ranges[other], whole.ranges[order], rtol=1e-12)
    np.testing.assert_allclose(added.counts[other], whole.counts[order], rtol=1e-12)
    one_by_one = Cycles(*(np.zeros(0) for _ in range(3)))
    for part, weight in zip(parts, weights, strict=True):
        one_by_one = sum_cycles([one_by_one, part], [1.0, weight], means=False)
    np.testing.assert_allclose(np.sort(one_by_one.ranges), whole.ranges[order], rtol=1e-12)


@pytest.mark.parametrize("slope", SLOPES)
def test_sums_keep_damage_with_the_influence_of_means(slope: float) -> None:
    parts = [rainflow_cycles((1.0 + 0.2 * seed) * random_load(seed)) for seed in range(4)]
    weights = [1e5, 3e4, 7.0, 0.1]
    strength = 3.0 * max(float(np.abs(c.means).max()) for c in parts)
    added = goodman_cycles(sum_cycles([bin_cycles(c) for c in parts], weights), strength)
    exact = goodman_cycles(together(parts, weights), strength)
    assert damage_sum(added, slope) == pytest.approx(damage_sum(exact, slope), rel=1e-3)


def test_weights_count_runs() -> None:
    cycles = rainflow_cycles(random_load(1))
    twice, weighted = sum_cycles([cycles, cycles]), sum_cycles([cycles], [2.0])
    np.testing.assert_allclose(twice.counts, weighted.counts)
    assert len(sum_cycles([]).ranges) == 0 and len(sum_cycles([cycles], [0.0]).ranges) == 0
    for bad in ([1.0], [1.0, -1.0], [1.0, np.nan]):
        with pytest.raises(InputError, match="a finite weight for each series"):
            sum_cycles([cycles, cycles], bad)


def test_cells_scale_with_octaves() -> None:
    cycles = rainflow_cycles(random_load(2))
    one, eight = bin_cycles(cycles), bin_cycles(cycles._replace(ranges=8.0 * cycles.ranges, means=8.0 * cycles.means))
    np.testing.assert_allclose(eight.ranges, 8.0 * one.ranges, rtol=1e-12)
    np.testing.assert_array_equal(eight.counts, one.counts)


def test_negligible_and_empty_cycles_are_left_out() -> None:
    found = bin_cycles(Cycles(np.array([1.0, 1e-9, 0.0, 2.0]), np.zeros(4), np.array([1.0, 1e3, 5.0, 0.0])))
    assert found.ranges == pytest.approx([1.0]) and found.counts == pytest.approx([1.0])


# Markov matrices


def test_a_markov_matrix_is_the_table_of_the_cycles() -> None:
    table = markov_matrix(rainflow_cycles(ASTM), [2.5, 3.5, 5.0, 8.5, 9.0], [-1.5, 0.25, 1.5])
    # ranges 3, 4, 4, 8, 9, 8, 6 with means -0.5, -1, 1, 1, 0.5, 0, 1
    np.testing.assert_array_equal(table, [[0.5, 0.0], [0.5, 1.0], [0.5, 1.0], [0.0, 0.5]])
    with pytest.raises(InputError, match=r"ranges lie between 3 and 9, edges between 0 and 8"):
        markov_matrix(rainflow_cycles(ASTM), [0.0, 8.0], [-5.0, 5.0])
    with pytest.raises(InputError, match="ascending"):
        markov_matrix(rainflow_cycles(ASTM), [0.0], [-5.0, 5.0])


@pytest.mark.parametrize("bins", [5, 10, 20])
def test_coarse_matrices_converge_with_the_square_of_the_width(bins: int) -> None:
    """Ranges spread evenly from 0 to 1, m = 4: middles of bins of width w do 1 - 5/6 w^2 + 7/48 w^4 of the damage."""
    n = 200_000
    cycles = Cycles((np.arange(n) + 0.5) / n, np.zeros(n), np.ones(n))
    edges = np.linspace(0.0, 1.0, bins + 1)
    table = markov_matrix(cycles, edges, [-1.0, 1.0])
    middles = Cycles(0.5 * (edges[1:] + edges[:-1]), np.zeros(bins), table[:, 0])
    w = 1.0 / bins
    expected = 1.0 - 5.0 / 6.0 * w**2 + 7.0 / 48.0 * w**4
    assert damage_sum(middles, 4.0) / damage_sum(cycles, 4.0) == pytest.approx(expected, abs=2e-5)


# means


def test_goodman_by_hand() -> None:
    cycles = Cycles(np.array([2.0, 2.0, 2.0]), np.array([0.0, 5.0, -5.0]), np.ones(3))
    np.testing.assert_allclose(goodman_cycles(cycles, 10.0).ranges, [2.0, 4.0, 4.0])
    np.testing.assert_allclose(goodman_cycles(cycles, 10.0, mean=5.0).ranges, [1.0, 2.0, 2.0])
    np.testing.assert_allclose(goodman_cycles(cycles, 10.0, mean=5.0).means, 5.0)
    np.testing.assert_allclose(goodman_cycles(cycles, 1e12).ranges, 2.0)
    for strength, words in ((5.0, "a mean of magnitude 5 reaches the strength 5"), (0.0, "must be positive")):
        with pytest.raises(InputError, match=words):
            goodman_cycles(cycles, strength)


# equivalent loads


def test_equivalent_loads_of_a_lifetime() -> None:
    """A cosine of 600 s, 1e5 times: at 1 Hz, and for 1e7 cycles."""
    t = np.linspace(0.0, 600.0, 120_001)
    once = rainflow_cycles(3.0 * np.cos(2.0 * pi * 0.5 * t))
    life = sum_cycles([once], [1e5])
    for slope in SLOPES:
        assert cycle_load(life, slope=slope, reference=6e7) == pytest.approx(6.0 * 0.5 ** (1.0 / slope), rel=1e-5)
        assert cycle_load(life, slope=slope, reference=1e7) == pytest.approx(6.0 * 3.0 ** (1.0 / slope), rel=1e-5)
        assert damage_sum(life, slope) == pytest.approx(3e7 * 6.0**slope, rel=1e-4)
    for arguments in ({"slope": 0.0, "reference": 1.0}, {"slope": 4.0, "reference": float("nan")}):
        with pytest.raises(InputError, match="must be positive"):
            cycle_load(life, **arguments)
