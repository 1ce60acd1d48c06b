"""Fit of uncertain parameters against closed forms; what a parameter means in simulation and derivative."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from meltemi import InputError, Turbine
from meltemi.cases.case import LoadCase
from meltemi.control.baseline import BaselineController
from meltemi.control.controller import StartPoint
from meltemi.gradients.sensitivity import Direction, direction, tables
from meltemi.simulation.model import Model
from meltemi.validation import fit
from meltemi.validation.comparison import ComparedRecord, Comparison
from meltemi.validation.fit import Linear, Posterior, checked, data_of, fitted, posterior, prior, whitened
from meltemi.validation.reduction import STATISTICS, ReducedRecord
from meltemi.validation.report import HEADLINE
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import PATHS, Simulator

Float = NDArray[np.float64]
FLAP = "root_moment_flap_1"
CHANNELS = {
    "wind_speed": {"column": "u", "unit": "m/s", "component": "speed", "height": 90.0},
    "generator_power": {"column": "P", "unit": "kW", "kind": "power"},
    FLAP: {"column": "M", "unit": "kN m", "kind": "gauge"},
}
COMPARED = ("generator_power", FLAP)
SETTINGS = Validation(
    case="case.yaml",
    channels={"loggers": {"one": {"time": {"column": "t"}, "channels": CHANNELS}}},
    priors={"drag": 0.5},
)
CASE = LoadCase(turbine="nrel5mw", wind={"kind": "steady", "speed": 9.0}, duration=5.0)


@pytest.fixture(scope="module")
def simulator(turbine: Turbine) -> Simulator:
    return Simulator(SETTINGS, CASE, Path(), turbine)


def problem(seed: int = 0, n: int = 12) -> tuple[Float, Float, Float]:
    """Deviations, derivatives and prior standard deviations of three parameters of different size."""
    draw = np.random.default_rng(seed)
    scale = np.array([1.0, 1e-3, 1e5])
    return draw.standard_normal(n), draw.standard_normal((n, 3)) / scale, 0.7 * scale


def test_posterior_is_that_of_linear_regression() -> None:
    y, slopes, width = problem()
    estimate, covariance = posterior(y, slopes, width, np.zeros(3))
    expected = np.linalg.inv(slopes.T @ slopes + np.diag(width**-2.0))
    assert covariance == pytest.approx(expected, rel=1e-9)
    assert estimate == pytest.approx(-expected @ slopes.T @ y, rel=1e-9)

    def evidence(some: list[int]) -> float:
        of_data = np.eye(12) + (slopes[:, some] * width[some] ** 2) @ slopes[:, some].T
        return float(multivariate_normal(np.zeros(12), of_data).logpdf(y))

    gains = [evidence([0, 1, 2]) - evidence([k for k in range(3) if k != p]) for p in range(3)]
    found = Posterior(("a", "b", "c"), width, estimate, covariance, 1.0, 1, 8)
    assert found.evidence == pytest.approx(gains, rel=1e-9)


def interval(width: float, draw: np.random.Generator, freedom: int = 4) -> tuple[bool, bool]:
    """Whether the intervals by Student's and by the normal distribution contain a truth drawn from the prior."""
    truth, slopes = width * draw.standard_normal(1), np.ones((3, 1))
    variance = draw.chisquare(freedom) / freedom  # of the data, as some seeds show it; the true one is 1
    y, J = (x / np.sqrt(variance) for x in (draw.standard_normal(3) - slopes @ truth, slopes))
    estimate, covariance = posterior(y, J, np.array([width]), np.zeros(1))
    found = Posterior(("a",), np.array([width]), estimate, covariance, 1.0, 1, freedom)
    error = np.abs(estimate - truth)[0]
    return bool(error <= found.half[0]), bool(error <= 1.96 * np.sqrt(covariance[0, 0]))


def test_intervals_contain_the_truth_where_few_seeds_show_the_variance() -> None:
    draw, n = np.random.default_rng(2), 4000
    student, normal = np.mean([interval(10.0, draw) for _ in range(n)], axis=0)
    assert abs(student - 0.95) < 0.01 and normal < 0.9
    student, normal = np.mean([interval(0.02, draw) for _ in range(n)], axis=0)  # the prior decides, which is known
    assert abs(student - 0.95) < 0.01 and abs(student - normal) < 0.005


def test_correlated_data_of_which_some_are_missing() -> None:
    """Two records of four statistics: generalised least squares."""
    draw = np.random.default_rng(8)
    size = np.array([1.0, 1e3, 1e-3, 1e6])
    root = draw.standard_normal((4, 4)) * size[:, None]
    covariance, width = root @ root.T, np.array([0.5, 2.0])
    y, slopes = draw.standard_normal((2, 4)) * size, draw.standard_normal((2, 4, 2)) * size[:, None]
    y[1, 2] = np.nan
    some = np.isfinite(y.ravel())
    W = np.kron(np.eye(2), covariance)[np.ix_(some, some)]
    d, J = y.ravel()[some], slopes.reshape(8, 2)[some]
    estimate, spread = posterior(*whitened(y, slopes, covariance), width, np.zeros(2))
    expected = np.linalg.inv(J.T @ np.linalg.solve(W, J) + np.diag(width**-2.0))
    assert spread == pytest.approx(expected, rel=1e-6)
    assert estimate == pytest.approx(-expected @ J.T @ np.linalg.solve(W, d), rel=1e-6)


def test_posterior_does_not_depend_on_the_point_of_a_linear_model() -> None:
    y, slopes, width = problem()
    at = 2.0 * width
    there, zero = posterior(y + slopes @ at, slopes, width, at), posterior(y, slopes, width, np.zeros(3))
    for a, b in zip(there, zero, strict=True):
        assert a == pytest.approx(b, rel=1e-9)


def test_a_simulation_that_is_too_high_is_lowered() -> None:
    _, slopes, width = problem(n=200)
    theta = np.array([0.4, -2e-4, 5e4])
    precise = 1e4 * slopes
    estimate, covariance = posterior(precise @ theta, precise, width, np.zeros(3))
    assert estimate == pytest.approx(-theta, rel=1e-3)
    assert np.all(np.abs(estimate + theta) < 5.0 * np.sqrt(np.diag(covariance)))


def reduced(values: Float) -> ReducedRecord:
    """A record with the statistics (2, 3) of the first page, of power and flap moment."""
    rows = np.zeros((2, len(STATISTICS)))
    rows[:, [STATISTICS.index(name) for name in HEADLINE]] = values
    return ReducedRecord(dict(zip(("generator_power", FLAP), rows, strict=True)), {}, {})


def comparison(measured: Float, simulated: Float) -> Comparison:
    """Of (R, 2, 3) measured and (R, K, 2, 3) simulated statistics."""
    records = [
        ComparedRecord(f"{r}", 9.0, 0.1, 1.2, 0.2, reduced(x), tuple(map(reduced, y)))
        for r, (x, y) in enumerate(zip(measured, simulated, strict=True))
    ]
    return Comparison(tuple(records), ("generator_power", FLAP))


def test_the_fit_gives_what_must_be_changed_in_the_simulation(
    simulator: Simulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A model that is quadratic in the parameters, of which the truth is known."""
    draw, names = np.random.default_rng(4), ("pitch_offset", "drag")
    base, first, second = draw.uniform(5.0, 9.0, (7, 2, 3)), draw.normal(size=(7, 2, 3, 2)), draw.normal(size=(7, 2, 3))
    truth = np.array([0.006, -0.3])

    def values(at: Float) -> Float:
        return cast("Float", base + first @ at + 0.5 * second * at[1] ** 2)

    def linear(changed: Simulator, *_: Any) -> Linear:
        at = np.array([changed.parameters[name] for name in names])
        slopes = first + np.stack([np.zeros_like(second), second * at[1]], axis=-1)
        return Linear(values(at), slopes)

    monkeypatch.setattr(fit, "linear", linear)
    seeds = values(np.zeros(2))[:, None] + 1e-5 * draw.standard_normal((7, 4, 2, 3))
    monkeypatch.setattr(
        fit, "data_of", lambda *_: ((seeds.mean(axis=1) - values(truth)).reshape(7, 6), 1e-10 * np.eye(6), 21)
    )
    found = fitted(simulator, [], comparison(values(truth), seeds), names)
    assert found.estimate == pytest.approx(truth, abs=1e-4) and 2 < found.steps <= 4
    assert found.prior == pytest.approx([np.radians(0.5), 0.5])  # that of the file is preferred
    assert np.all(found.evidence > 3.0)


def test_data_are_deviations_with_the_covariance_of_the_seeds() -> None:
    draw, R, K = np.random.default_rng(5), 400, 4
    measured = draw.uniform(5.0, 9.0, (R, 2, 3))
    root = draw.standard_normal((6, 6))
    seeds = draw.standard_normal((R, K + 1, 6)) @ root.T  # one of them is what happened
    simulated = measured[:, None] + 0.3 + (seeds[:, 1:] - seeds[:, :1]).reshape(R, K, 2, 3)
    case = comparison(measured, simulated)
    deviation, covariance, freedom = data_of(case, list(case.channels))
    assert freedom == R * (K - 1)
    assert deviation == pytest.approx(np.mean(simulated - measured[:, None], axis=1).reshape(R, 6))
    expected = 1.25 * root @ root.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.all(np.abs(covariance - expected) < 0.15 * scale)
    assert np.all(np.diag(covariance) >= 0.9 * np.diag(expected))

    alone = data_of(replace(case, range_only=(FLAP,)), list(case.channels))[0]
    assert np.all(np.isnan(alone[:, 3])) and np.all(np.isfinite(np.delete(alone, 3, axis=1)))
    few, of_few, _ = data_of(case.some([0, 1, 2]), list(case.channels))  # of nine degrees of freedom for six data
    assert few.shape == (3, 6) and np.linalg.eigvalsh(of_few).min() > 0.0


def test_what_scatters_more_than_seeds_is_independent() -> None:
    draw = np.random.default_rng(9)
    measured, truth = draw.uniform(5.0, 9.0, (8, 2, 3)), draw.standard_normal((8, 1, 2, 3))
    one = comparison(measured, measured[:, None] + truth)
    deviation, covariance, _ = data_of(one, list(one.channels))
    assert covariance == pytest.approx(np.diag(np.var(deviation, axis=0, ddof=1)))  # one seed tells no covariance
    seeds = measured[:, None] + truth + 1e-3 * draw.standard_normal((8, 4, 2, 3))
    deviation, covariance, _ = data_of(comparison(measured, seeds), list(one.channels))
    assert np.diag(covariance) == pytest.approx(np.var(deviation, axis=0, ddof=1), rel=1e-9)
    assert np.all(np.abs(covariance - np.diag(np.diag(covariance))) < 1e-5)


def test_a_channel_that_a_record_has_not_does_not_count() -> None:
    measured = np.random.default_rng(6).uniform(5.0, 9.0, (3, 2, 3))
    case = comparison(measured, np.repeat(1.1 * measured[:, None], 3, axis=1))
    first = case.records[0]
    without = {"generator_power": first.measured.values["generator_power"]}
    lost = replace(first, measured=replace(first.measured, values=without))
    deviation, covariance, _ = data_of(replace(case, records=(lost, *case.records[1:])), list(case.channels))
    assert np.all(np.isnan(deviation[0, 3:])) and np.all(np.isfinite(deviation[1:]))
    assert np.all(np.isfinite(covariance))
    assert whitened(deviation, np.ones((3, 6, 1)), covariance)[0].shape == (15,)


def test_names_of_parameters() -> None:
    names = ("drag", "pitch_offset", "drag", f"gauge_zero.{FLAP}")
    assert checked(names, SETTINGS, COMPARED) == ("drag", "pitch_offset", f"gauge_zero.{FLAP}")
    with pytest.raises(InputError, match="no parameter 'drga' to fit: did you mean 'drag'"):
        checked(("drga",), SETTINGS, COMPARED)
    with pytest.raises(InputError, match=f"did you mean 'gauge_gain.{FLAP}'"):
        checked(("gauge_gain.root_moment_flap_2",), SETTINGS, COMPARED)
    with pytest.raises(InputError, match="no parameter 'gauge_gain.wind_speed' to fit"):  # measured, not compared
        checked(("gauge_gain.wind_speed",), SETTINGS, COMPARED)
    with pytest.raises(InputError, match="no parameter 'lfit' to fit: did you mean 'lift'"):
        checked((), SETTINGS.replace(priors={"lfit": 0.1}), COMPARED)


def test_priors() -> None:
    case = comparison(np.array([[[1.0, 2.0, 3.0], [-4.0, 5.0, 6.0]]] * 2), np.ones((2, 1, 2, 3)))
    assert prior("drag", SETTINGS, case) == 0.5 and prior("lift", SETTINGS, case) == 0.03
    assert prior(f"gauge_gain.{FLAP}", SETTINGS, case) == 0.03
    assert prior(f"gauge_zero.{FLAP}", SETTINGS, case) == pytest.approx(0.4)


def of_paths(model: Model[Any], name: str) -> Direction:
    return direction(model, name, BaselineController(model.turbine), StartPoint(9.0, 100.0, 0.0, 3e4))


def test_a_star_is_the_sum_of_the_single_airfoils(model: Model[Any]) -> None:
    together = of_paths(model, "turbine.airfoils.*.drag")
    singles = [of_paths(model, f"turbine.airfoils.{key}.drag") for key in model.turbine.airfoils]
    assert together.value == 1.0 and len(singles) > 5
    assert together.arrays.keys() == set().union(*(each.arrays for each in singles))
    for name, change in together.arrays.items():
        total = np.sum([each.arrays.get(name, np.zeros_like(change)) for each in singles], axis=0)
        np.testing.assert_allclose(total, change, rtol=0.0, atol=1e-9 * np.abs(change).max())


@pytest.mark.parametrize("name", PATHS)
def test_simulation_and_derivative_mean_the_same_parameter(name: str, simulator: Simulator) -> None:
    steps, base = (1e-3, 5e-4), simulator.model(1.1)
    sides = [[simulator.at([name], [sign * step]).model(1.1) for sign in (-1.0, 1.0)] for step in steps]
    way = of_paths(base, PATHS[name])
    scale = way.value if name == "air_density" else 1.0
    for array, change in way.arrays.items():
        coarse, fine = (
            np.subtract(*(tables(side).get(array, getattr(side, array, None)) for side in reversed(both)))
            / (2.0 * step)
            for step, both in zip(steps, sides, strict=True)
        )
        difference = (4.0 * fine - coarse) / 3.0  # a central difference alone is 2e-6 off in sums over mode shapes
        rounding = (
            1e-15 * np.abs(tables(base).get(array, getattr(base, array, 0.0))).max() / steps[-1]
        )  # of mode shapes
        most = 1e-6 * np.abs(scale * change).max() + rounding
        np.testing.assert_allclose(difference, scale * change, rtol=0.0, atol=most)
