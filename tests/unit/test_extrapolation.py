"""Extrapolation of extreme loads: fits, long-term load, bands, both simplified ways."""

from __future__ import annotations

from math import log

import numpy as np
import pytest
from scipy.stats import gumbel_r, skew

from meltemi import InputError
from meltemi.loads.extrapolation import (
    FIFTY_YEARS,
    ExtremeFit,
    extrapolate,
    fit_extremes,
)
from meltemi.postprocess.ensemble import rayleigh_weights

SPEEDS = np.arange(4.0, 25.0, 2.0)
P = rayleigh_weights(SPEEDS, 10.0)
LOCATION = 8.0 + 4.0 * np.exp(-(((SPEEDS - 12.0) / 6.0) ** 2))
SCALE = 0.05 * LOCATION * (1.0 + 0.05 * SPEEDS)


def gumbel_extremes(rng: np.random.Generator, seeds: int, blocks: int = 1) -> list[np.ndarray]:
    """Extremes like those of a blade root: largest about rated wind speed, scatter that grows with the speed."""
    return [rng.gumbel(a, b, (seeds, blocks)) for a, b in zip(LOCATION, SCALE, strict=True)]


def long_term(blocks: int = 1) -> float:
    """Exact load of 50 years of ``gumbel_extremes``, from a table of its exceedance."""
    x = np.linspace(LOCATION.max(), 40.0, 200_001)
    q = sum(
        p * -np.expm1(-blocks * np.exp(-(x - a) / b)) for p, a, b in zip(P, LOCATION, SCALE, strict=True)
    )  # the largest of Gumbel's is Gumbel's
    return float(np.interp(-np.log(FIFTY_YEARS), -np.log(q), x))


# fits


@pytest.mark.parametrize("n", [6, 15, 300])
def test_gumbel_by_maximum_likelihood(n: int) -> None:
    """Against SciPy's fit, an independent code."""
    x = np.random.default_rng(n).gumbel(50.0, 3.0, n)
    fit = fit_extremes(x)
    assert (fit.location, fit.scale) == pytest.approx(gumbel_r.fit(x), rel=1e-5)
    assert fit.extremes == n and np.isnan(fit.shape)


@pytest.mark.parametrize("seed", range(4))
def test_weibull_has_the_moments_of_the_sample(seed: int) -> None:
    x = 20.0 + 4.0 * np.random.default_rng(seed).weibull(1.6, 40)
    fit = fit_extremes(x, "weibull")
    y = np.random.default_rng(9).weibull(fit.shape, 2_000_000) * fit.scale + fit.location
    assert y.mean() == pytest.approx(x.mean(), rel=1e-3)
    assert y.std() == pytest.approx(x.std(ddof=1), rel=3e-3)
    assert skew(y) == pytest.approx(skew(x, bias=False), abs=0.01)


def test_fits_of_many_extremes_find_the_distribution() -> None:
    rng = np.random.default_rng(1)
    fit = fit_extremes(rng.gumbel(50.0, 3.0, 200_000))
    assert (fit.location, fit.scale) == (pytest.approx(50.0, abs=0.03), pytest.approx(3.0, rel=0.01))
    fit = fit_extremes(20.0 + 4.0 * rng.weibull(1.6, 200_000), "weibull")
    assert (fit.location, fit.scale, fit.shape) == (
        pytest.approx(20.0, abs=0.05),
        pytest.approx(4.0, rel=0.02),
        pytest.approx(1.6, rel=0.02),
    )


@pytest.mark.parametrize("distribution", ["gumbel", "weibull"])
def test_fits_scale_with_the_load(distribution: str) -> None:
    x = np.random.default_rng(3).gumbel(50.0, 3.0, 30)
    one, other = fit_extremes(x, distribution), fit_extremes(1e6 * x - 7e6, distribution)  # type: ignore[arg-type]
    assert other.quantile(1e-6) == pytest.approx(1e6 * one.quantile(1e-6) - 7e6, rel=1e-8)
    for q in (0.5, 1e-3, 3.8e-7):
        assert one.exceedance(one.quantile(q)) == pytest.approx(q, rel=1e-9)


def test_distributions_differ() -> None:
    x = gumbel_extremes(np.random.default_rng(4), 30)
    assert extrapolate(x, P, resamples=5).load != pytest.approx(
        extrapolate(x, P, distribution="weibull", resamples=5).load, rel=0.01
    )


@pytest.mark.parametrize(
    ("extremes", "distribution", "words"),
    [
        (
            np.arange(5.0),
            "gumbel",
            "5 extremes are too few for a gumbel distribution, which needs 6: simulate more seeds",
        ),
        (np.arange(14.0), "weibull", "14 extremes are too few for a weibull distribution, which needs 15"),
        (np.ones(20), "gumbel", "all extremes are equal"),
        (np.full(20, np.nan), "gumbel", "finite"),
        (np.arange(20.0), "gumbal", "no distribution 'gumbal': did you mean 'gumbel'"),
        (np.arange(20.0), {"gumbel"}, "no distribution {'gumbel'}: did you mean"),
    ],
)
def test_fits_that_make_no_sense_are_refused(extremes: np.ndarray, distribution: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_extremes(extremes, distribution)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=words):
        extrapolate([np.arange(20.0), extremes], [0.5, 0.5], distribution=distribution)  # type: ignore[arg-type]


# long-term loads


def test_a_single_speed_is_its_quantile() -> None:
    x = np.random.default_rng(5).gumbel(50.0, 3.0, 40)
    fit = fit_extremes(x)
    found = extrapolate([x], [1.0], resamples=5)
    assert found.load == pytest.approx(fit.location - fit.scale * log(-np.log1p(-3.8e-7)), rel=1e-9)
    halved = extrapolate([x, x], [0.3, 0.2], resamples=5)
    assert halved.load == pytest.approx(float(fit.quantile(2.0 * 3.8e-7)), rel=1e-9)
    assert all((f.location, f.scale) == pytest.approx((fit.location, fit.scale), rel=1e-12) for f in halved.fits)


@pytest.mark.parametrize("blocks", [1, 4])
def test_many_seeds_find_the_load_of_50_years(blocks: int) -> None:
    found = extrapolate(gumbel_extremes(np.random.default_rng(6), 20_000 // blocks, blocks), P, resamples=3)
    assert found.load == pytest.approx(long_term(blocks), rel=0.01)


def test_blocks_and_runs_agree() -> None:
    """The largest of four blocks of Gumbel's distribution has the location that ln 4 scales higher."""
    x = np.random.default_rng(7).gumbel(50.0, 3.0, (20_000, 4))
    blocks, runs = (extrapolate([y], [0.5], resamples=2).load for y in (x, x.max(axis=1)))
    assert blocks == pytest.approx(runs, rel=0.01)
    fit = fit_extremes(x)
    assert blocks == pytest.approx(fit.location + fit.scale * (log(4.0) - log(2.0 * FIFTY_YEARS)), rel=1e-5)


def test_the_probability_of_50_years() -> None:
    assert pytest.approx(600.0 / (50.0 * 365.25 * 86400.0), rel=2e-3) == FIFTY_YEARS


def test_smallest_loads_mirror_largest() -> None:
    x = gumbel_extremes(np.random.default_rng(8), 15)
    up, down = extrapolate(x, P, resamples=50), extrapolate([-y for y in x], P, smallest=True, resamples=50)
    assert (down.load, down.low, down.high) == (-up.load, -up.high, -up.low)
    np.testing.assert_array_equal(down.levels, -up.levels)
    np.testing.assert_array_equal(down.exceedance, up.exceedance)


def test_what_a_plot_shows() -> None:
    x = gumbel_extremes(np.random.default_rng(9), 15)
    found = extrapolate(x, P, resamples=100)
    assert np.all(np.diff(found.exceedance) < 0.0)
    assert np.all(found.band[0] <= found.exceedance * 1.001) and np.all(found.exceedance <= found.band[1] * 1.001)
    assert np.interp(found.load, found.levels, np.log(found.exceedance)) == pytest.approx(log(3.8e-7), abs=0.05)
    loads, shares = found.points
    assert (
        loads[0] == max(float(y.max()) for y in x) and np.all(np.diff(loads) <= 0.0) and np.all(np.diff(shares) > 0.0)
    )
    assert shares[-1] == pytest.approx(P.sum() * 15.0 / 16.0)
    # the runs scatter about the weighted distributions
    middle = np.interp(-np.log(shares[20:-40]), -np.log(found.exceedance), found.levels)
    assert np.max(np.abs(middle / loads[20:-40] - 1.0)) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("seeds", "bias", "half_width"), [(15, 0.06, 0.25), (60, 0.02, 0.12)])
def test_bias_and_coverage(seeds: int, bias: float, half_width: float) -> None:
    """Bounds of what the theory page states from more samples."""
    truth, rng = long_term(), np.random.default_rng(10)
    runs = [extrapolate(gumbel_extremes(rng, seeds), P, resamples=80, seed=k) for k in range(60)]
    assert abs(np.mean([r.load for r in runs]) / truth - 1.0) < bias
    assert sum(r.low < truth < r.high for r in runs) >= 52
    assert np.mean([r.high - r.low for r in runs]) < 2.0 * half_width * truth


def test_bands_repeat_and_follow_their_confidence() -> None:
    x = gumbel_extremes(np.random.default_rng(11), 15)
    one, again, other = (extrapolate(x, P, resamples=50, seed=s) for s in (1, 1, 2))
    assert (one.low, one.high) == (again.low, again.high) != (other.low, other.high)
    assert one.load == other.load
    narrow = extrapolate(x, P, resamples=50, confidence=0.5)
    assert one.low < narrow.low < narrow.high < one.high


@pytest.mark.parametrize(
    ("p", "more", "words"),
    [
        ([0.5], {}, "2 wind speeds need as many probabilities"),
        ([0.7, 0.6], {}, "with a sum up to 1"),
        ([0.1, 0.1], {"probability": 0.3}, "probability must lie between 0 and 0.2"),
        ([0.5, 0.5], {"resamples": 0}, "resamples must be positive"),
        ([0.5, 0.5], {"confidence": {}}, "confidence: expected a number"),
        ([0.5, 0.5], {"resamples": 2.5}, "resamples: expected a number"),
    ],
)
def test_impossible_weights_are_refused(p: list[float], more: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        extrapolate([np.arange(20.0), np.arange(20.0)], p, **more)  # type: ignore[arg-type]


def test_records_of_fits_are_plain_numbers() -> None:
    fit = ExtremeFit("gumbel", 0.0, 1.0, float("nan"), 10)
    assert float(fit.exceedance(0.0)) == pytest.approx(1.0 - np.exp(-1.0))
