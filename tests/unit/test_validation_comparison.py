"""Statistics of records against closed forms; what seeds and sensors can resolve against random draws."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from meltemi import InputError
from meltemi.simulation.channels import every_kind
from meltemi.simulation.result import Result
from meltemi.validation.comparison import (
    Agreement,
    ComparedRecord,
    Comparison,
    agreement,
    power_curve,
    prediction_half,
)
from meltemi.validation.measurements import Signal
from meltemi.validation.reduction import (
    BANDS,
    ORDERS,
    RANGE_ONLY,
    SECTORS,
    STATISTICS,
    ReducedRecord,
    like,
    reduce_record,
)

Float = NDArray[np.float64]
BEGIN, RATE = 1_714_564_800.0, 50.0
TIME = BEGIN + np.arange(30_000) / RATE
"""Ten minutes."""
SPEED = 1.3
"""[rad/s]."""
P1 = STATISTICS.index("1P")


def signal(values: Float) -> Signal:
    return Signal(TIME, values, RATE)


def statistic(reduced: ReducedRecord, name: str) -> float:
    return float(reduced.values["x"][STATISTICS.index(name)])


def random(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("order", range(1, ORDERS + 1))
@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("source", ["azimuth", "rotor_speed"])
def test_a_multiple_of_the_rotor_frequency_is_in_its_order_only(order: int, turn: float, source: str) -> None:
    t, amplitude = TIME - BEGIN, 3.0
    # the speed varies by a fifth, over which a Fourier transform in time would smear the higher orders
    speed = turn * SPEED * (1.0 + 0.2 * np.sin(0.05 * t))
    angle = turn * SPEED * (t + 0.2 * (1.0 - np.cos(0.05 * t)) / 0.05)
    rotor = signal(angle % (2.0 * np.pi)) if source == "azimuth" else signal(speed)
    reduced = reduce_record({source: rotor, "x": signal(7.0 + amplitude * np.sin(order * angle + 0.4))}, ["x"])
    orders = reduced.values["x"][P1:]
    assert orders[order - 1] == pytest.approx(amplitude / np.sqrt(2.0), rel=0.01)
    assert np.all(np.delete(orders, order - 1) < 0.02 * amplitude)
    assert statistic(reduced, "mean") == pytest.approx(7.0, abs=0.02)
    assert statistic(reduced, "std") == pytest.approx(amplitude / np.sqrt(2.0), rel=0.01)
    assert statistic(reduced, "max") == pytest.approx(7.0 + amplitude, rel=1e-3)
    assert statistic(reduced, "min") == pytest.approx(7.0 - amplitude, rel=1e-3)
    assert set(reduced.sectors) == ({"x"} if source == "azimuth" else set())


def test_orders_need_four_turns_and_a_rotor() -> None:
    few = reduce_record({"rotor_speed": signal(np.full(len(TIME), 0.03)), "x": signal(np.sin(TIME))}, ["x"])
    none = reduce_record({"x": signal(np.sin(TIME))}, ["x"])
    for reduced in (few, none):
        assert np.all(np.isnan(reduced.values["x"][P1:])) and np.all(np.isfinite(reduced.values["x"][:P1]))


def test_density_of_white_noise_and_of_a_sine() -> None:
    noise = reduce_record({"x": signal(5.0 + 0.5 * random().standard_normal(len(TIME)))}, ["x"]).spectra["x"]
    frequencies = np.arange(1, 3001) / 600.0
    count = np.histogram(frequencies, BANDS)[0]
    assert np.all(np.isnan(noise) == (count == 0))
    expected = 2.0 * 0.5**2 / RATE
    # each density has the relative standard deviation 1 / sqrt(lines in the band)
    assert np.all(np.abs(noise[count > 0] / expected - 1.0) < 4.0 / np.sqrt(count[count > 0]))
    assert noise[count > 100] == pytest.approx(expected, rel=0.2)

    line, amplitude = 90.0 / 600.0, 2.0
    sine = reduce_record({"x": signal(amplitude * np.sin(2.0 * np.pi * line * (TIME - BEGIN)))}, ["x"]).spectra["x"]
    band = int(np.searchsorted(BANDS, line, side="right")) - 1
    power = sine * count / 600.0
    assert power[band] == pytest.approx(amplitude**2 / 2.0, rel=1e-9)
    assert np.nansum(np.delete(power, band)) < 1e-9


def test_azimuth_averages() -> None:
    angle = 0.3 + SPEED * (TIME - BEGIN)
    x = 4.0 + np.cos(angle)
    sectors = reduce_record({"azimuth": signal(angle % (2.0 * np.pi)), "x": signal(x)}, ["x"]).sectors["x"]
    edges = np.linspace(0.0, 2.0 * np.pi, SECTORS + 1)
    assert sectors == pytest.approx(4.0 + np.diff(np.sin(edges)) / np.diff(edges), abs=2e-3)


@pytest.mark.parametrize(("name", "slope"), [("DEL, m = 4", 4.0), ("DEL, m = 10", 10.0)])
def test_equivalent_load_of_a_sine(name: str, slope: float) -> None:
    amplitude, frequency = 3.0, 0.2
    reduced = reduce_record({"x": signal(1.0 + amplitude * np.sin(2.0 * np.pi * frequency * (TIME - BEGIN)))}, ["x"])
    # N cycles of the range 2 A, for a load of 1 Hz
    assert statistic(reduced, name) == pytest.approx(2.0 * amplitude * frequency ** (1.0 / slope), rel=5e-3)


def test_gaps_are_left_out() -> None:
    t = TIME - BEGIN
    x = 5.0 + np.sin(2.0 * np.pi * t) + np.cos(SPEED * t)
    rotor = {"rotor_speed": signal(np.full(len(t), SPEED))}
    whole = reduce_record({**rotor, "x": signal(x)}, ["x"])
    gaps = np.where(random().random(len(t)) < 0.02, np.nan, x)  # single samples
    sparse = reduce_record({**rotor, "x": signal(gaps)}, ["x"])
    assert statistic(sparse, "mean") == pytest.approx(np.nanmean(gaps), rel=1e-14)
    assert statistic(sparse, "std") == pytest.approx(np.nanstd(gaps), rel=1e-12)
    for name in STATISTICS:
        assert statistic(sparse, name) == pytest.approx(statistic(whole, name), rel=0.01, abs=0.01)
    gaps = x.copy()
    gaps[round(100 * RATE) : round(160 * RATE)] = np.nan  # 60 periods of the sine about the mean
    kept = np.r_[x[: round(100 * RATE)], x[round(160 * RATE) :]]
    assert statistic(reduce_record({"x": signal(gaps)}, ["x"]), "mean") == pytest.approx(kept.mean(), rel=1e-12)
    with pytest.raises(InputError, match="x has no samples"):
        reduce_record({"x": signal(np.full(len(t), np.nan))}, ["x"])


def test_simulated_series_become_like_measured_ones() -> None:
    transient = 20.0
    time = np.arange(0.0, 620.25, 0.25)
    angle = 0.5 * time
    channels = tuple(every_kind()[name] for name in ("generator_power", "azimuth"))
    result = Result(time, np.column_stack([2.0 * time, angle % (2.0 * np.pi)]), channels)
    measured = np.zeros(len(TIME))
    measured[100:200] = np.nan
    signals = {"generator_power": signal(measured), "azimuth": signal(np.zeros(len(TIME)))}
    alike = like(result, signals, BEGIN, transient)
    power, azimuth = alike["generator_power"], alike["azimuth"]
    assert np.array_equal(np.isnan(power.values), np.isnan(measured)) and np.array_equal(power.time, TIME)
    there = ~np.isnan(measured)
    assert power.values[there] == pytest.approx(2.0 * (TIME[there] - BEGIN + transient))
    # between the samples about 2 pi there is no fall to zero
    assert azimuth.values == pytest.approx(0.5 * (TIME - BEGIN + transient), abs=1e-9)


LEVELS = np.linspace(2.0, 9.0, 11)


def drawn(draw: np.random.Generator, seeds: int, accuracy: float = 0.0, shift: float = 0.0) -> tuple[Float, Float]:
    """Measured (11,) and simulated (11, K) values of a right model whose mean is shifted, of a sensor with an error."""
    measured = (LEVELS + 0.4 * draw.standard_normal(11)) * (1.0 + accuracy * draw.standard_normal())
    return measured, LEVELS[:, None] + 0.4 * draw.standard_normal((11, seeds)) + shift


def judged(measured: Float, simulated: Float, accuracy: float = 0.0) -> Agreement:
    result = agreement("generator_power", "mean", measured, simulated, accuracy)
    assert result is not None
    return result


def test_agreement_is_that_of_a_plain_computation() -> None:
    x, y = drawn(random(), 5)
    y[3, 2:] = np.nan  # two seeds failed
    x[7] = np.nan
    a = judged(x, y)
    rows = [r for r in range(11) if r != 7]
    means = np.array([np.nanmean(y[r]) for r in rows])
    deviations = (means - x[rows]) / np.mean(np.abs(x[rows]))
    interval = stats.t.interval(0.95, 9, loc=deviations.mean(), scale=stats.sem(deviations))
    assert a.bias == pytest.approx(deviations.mean(), rel=1e-12)
    assert (a.bias - a.half, a.bias + a.half) == pytest.approx(interval, rel=1e-12)
    assert a.scatter == pytest.approx(deviations.std(ddof=1), rel=1e-12)
    assert (a.records, a.seeds) == (10, 5)
    assert (a.measured, a.simulated) == pytest.approx((x[rows].mean(), means.mean()), rel=1e-12)
    slope, intercept = np.polyfit(x[rows], means, 1)
    assert (a.slope, a.intercept) == pytest.approx((slope, intercept), rel=1e-9)
    assert a.correlation == pytest.approx(np.corrcoef(x[rows], means)[0, 1], rel=1e-12)
    within = []
    for r in rows:
        seeds = y[r][np.isfinite(y[r])]
        n = len(seeds)
        half = stats.t.ppf(0.975, n - 1) * seeds.std(ddof=1) * np.sqrt(1.0 + 1.0 / n)
        within.append(abs(seeds.mean() - x[r]) <= half)
    assert a.covered == pytest.approx(np.mean(within))


def test_bias_is_simulated_less_measured_over_the_magnitude_measured() -> None:
    x = np.array([-4.0, -6.0])
    assert judged(x, x[:, None] + [[0.4, 0.6]]).bias == pytest.approx(0.1)  # too high, though the mean is negative
    assert judged(-x, -x[:, None] - [[0.4, 0.6]]).bias == pytest.approx(-0.1)
    assert agreement("x", "mean", np.zeros(2), np.ones((2, 2))) is None
    assert agreement("x", "mean", np.full(2, np.nan), np.ones((2, 2))) is None


@pytest.mark.parametrize("accuracy", [0.0, 0.02])
def test_a_right_model_is_inside_what_can_be_resolved(accuracy: float) -> None:
    draw, n = random(1), 2000
    results = [judged(*drawn(draw, 5, accuracy), accuracy) for _ in range(n)]
    inside = np.mean([abs(a.bias) <= a.resolvable for a in results])
    assert abs(inside - 0.95) <= 0.02
    assert np.mean([a.verdict == "inside" for a in results]) == inside
    if not accuracy:
        assert abs(np.mean([a.covered for a in results]) - 0.95) <= 0.02


def test_a_shifted_model_is_outside_by_the_excess() -> None:
    x, y = drawn(random(2), 5)
    right, shift = judged(x, y), 0.5 * LEVELS.mean()
    for sign in (1.0, -1.0):
        a = judged(x, y + sign * shift)
        assert a.bias == pytest.approx(right.bias + sign * shift / x.mean(), rel=1e-12)
        assert a.resolvable == pytest.approx(right.resolvable, rel=1e-12)
        assert a.outside == pytest.approx(abs(a.bias) - a.resolvable, rel=1e-12)
        assert a.verdict == f"outside by {100.0 * a.outside:.1f} %"
    assert right.outside == 0.0


def test_one_seed_resolves_nothing() -> None:
    a = judged(*drawn(random(), 1))
    assert a.verdict == "not resolved: one seed" and np.isnan(a.resolvable) and np.isnan(a.outside)
    assert np.isnan(a.covered) and np.isfinite(a.half)
    one = judged(np.array([3.0]), np.array([[3.1, 3.2]]))
    assert one.bias == pytest.approx(0.05) and np.isnan(one.half) and np.isfinite(one.resolvable)


def test_one_seed_more_is_in_its_interval() -> None:
    draw, n = random(3), 20_000
    for seeds in (2, 5):
        x = draw.standard_normal((n, seeds + 1))
        half = prediction_half(x[:, 1:].std(axis=1, ddof=1), np.full(n, seeds))
        inside = np.mean(np.abs(x[:, 0] - x[:, 1:].mean(axis=1)) <= half)
        assert abs(inside - 0.95) <= 0.006


def compared(name: str, speed: float, density: float, measured: float, simulated: tuple[float, ...]) -> ComparedRecord:
    def reduced(mean: float) -> ReducedRecord:
        return ReducedRecord({"generator_power": np.r_[mean, np.arange(1.0, len(STATISTICS))]}, {}, {})

    return ComparedRecord(name, speed, 0.1, density, 0.2, reduced(measured), tuple(map(reduced, simulated)))


def test_power_curve() -> None:
    dense = 1.225 * 1.03**3
    records = (
        compared("a", 8.1, 1.225, 100.0, (110.0, 112.0)),
        compared("b", 8.0 / 1.03, dense, 104.0, (107.0,)),  # 8 m/s at 1.225 kg/m^3
        compared("c", 7.76, 1.225, 90.0, (91.0, 93.0)),
        compared("d", 8.26, 1.225, 130.0, (120.0, 122.0)),  # from 8.25 m/s on the next bin begins
        compared("e", 8.26, 1.225, np.nan, (500.0,)),
    )
    first, second = power_curve(Comparison(records, ("generator_power",))).itertuples()
    assert (first.speed, first.records) == (pytest.approx((8.1 + 8.0 + 7.76) / 3.0), 3)
    assert (first.measured, first.simulated) == (pytest.approx(98.0), pytest.approx((111.0 + 107.0 + 92.0) / 3.0))
    assert first.measured_error == pytest.approx(stats.sem([100.0, 104.0, 90.0]))
    assert first.simulated_error == pytest.approx(stats.sem([111.0, 107.0, 92.0]))
    assert (second.speed, second.records, second.measured, second.simulated) == pytest.approx((8.26, 1, 130.0, 121.0))
    assert np.isnan(second.measured_error)


def test_an_uncalibrated_gauge_has_no_mean_least_and_largest_value() -> None:
    records = tuple(compared(f"{k}", 8.0, 1.2, 5.0 + k, (5.1, 5.2)) for k in range(2))
    names = {a.statistic for a in Comparison(records, ("generator_power",), ("generator_power",)).agreements()}
    assert names == set(RANGE_ONLY) == set(STATISTICS) - {"mean", "min", "max"}
    assert {a.statistic for a in Comparison(records, ("generator_power",)).agreements()} == set(STATISTICS)
