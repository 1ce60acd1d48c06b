"""Derivatives of statistics: against differences, and by hand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError
from meltemi.gradients.weights import del_gradient, max_gradient, mean_gradient, min_gradient, std_gradient
from meltemi.postprocess.cycles import cycle_ends, rainflow_cycles
from meltemi.postprocess.fatigue import damage_equivalent_load

Float = NDArray[np.float64]
TIME = np.linspace(0.0, 60.0, 311)
PARAMETERS = np.array([3.0, 1.2, 0.7, 0.4, -0.5, 0.02])
"""Mean, three amplitudes, a phase, a trend."""


def series(p: Float) -> Float:
    a, b, c, d, phase, trend = p
    slow, fast = np.sin(2.0 * pi * 0.11 * TIME + phase), np.cos(2.0 * pi * 0.83 * TIME + 2.0 * phase)
    return a + b * slow + c * fast + d * slow * fast**2 + trend * TIME**1.5 / 10.0


def derivatives(p: Float) -> Float:
    _, b, c, d, phase, _ = p
    x, y = 2.0 * pi * 0.11 * TIME + phase, 2.0 * pi * 0.83 * TIME + 2.0 * phase
    by_phase = b * np.cos(x) - 2.0 * c * np.sin(y)
    by_phase += d * (np.cos(x) * np.cos(y) ** 2 - 4.0 * np.sin(x) * np.cos(y) * np.sin(y))
    columns = [np.ones_like(TIME), np.sin(x), np.cos(y), np.sin(x) * np.cos(y) ** 2, by_phase, TIME**1.5 / 10.0]
    return np.stack(columns, axis=1)


def differences(f: Callable[[Float], float], h: float = 1e-5) -> Float:
    """Central differences of fourth order at the parameters."""
    found = []
    for unit in h * np.eye(len(PARAMETERS)):
        near, far = (f(PARAMETERS + k * unit) - f(PARAMETERS - k * unit) for k in (1, 2))
        found.append((8.0 * near - far) / (12.0 * h))
    return np.array(found)


def load(slope: float) -> Callable[..., tuple[float, Float]]:
    return lambda x, dx: del_gradient(x, dx, duration=60.0, slope=slope, f_eq=0.7)


CASES: dict[str, tuple[Callable[..., tuple[float, Float]], Callable[[Float], float]]] = {
    "mean": (mean_gradient, lambda x: float(x.mean())),
    "std": (std_gradient, lambda x: float(x.std())),
    "min": (min_gradient, lambda x: float(x.min())),
    "max": (max_gradient, lambda x: float(x.max())),
} | {
    f"load, slope {m}": (load(m), lambda x, m=m: damage_equivalent_load(x, duration=60.0, slope=m, f_eq=0.7))
    for m in (1.0, 3.0, 4.0, 10.0)
}


@pytest.mark.parametrize("name", CASES)
def test_gradients_are_those_of_differences(name: str) -> None:
    gradient_of, value_of = CASES[name]
    value, gradient = gradient_of(series(PARAMETERS), derivatives(PARAMETERS))
    assert value == value_of(series(PARAMETERS))  # the same bits
    np.testing.assert_allclose(gradient, differences(lambda p: value_of(series(p))), rtol=1e-9, atol=3e-10)


def test_small_changes_leave_the_turning_points_in_place() -> None:
    """What the test above relies on."""
    ends = cycle_ends(series(PARAMETERS))
    assert len(ends[0]) > 40
    for unit in 2e-5 * np.concatenate([np.eye(6), -np.eye(6)]):
        assert all(np.array_equal(a, b) for a, b in zip(cycle_ends(series(PARAMETERS + unit)), ends, strict=True))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("slope", [1.0, 4.0, 10.0])
def test_each_value_of_a_random_series_by_itself(seed: int, slope: float) -> None:
    x = np.random.default_rng(seed).normal(size=60)

    def value(y: Float) -> float:
        return damage_equivalent_load(y, duration=10.0, slope=slope)

    _, gradient = del_gradient(x, np.eye(60), duration=10.0, slope=slope)
    h = 1e-5
    expected = [
        (8.0 * (value(x + u) - value(x - u)) - value(x + 2.0 * u) + value(x - 2.0 * u)) / (12.0 * h)
        for u in h * np.eye(60)
    ]
    np.testing.assert_allclose(gradient, expected, rtol=0.0, atol=2e-9)


def test_a_load_has_the_gradient_of_its_scale_and_none_of_its_level() -> None:
    # S_eq is homogeneous: along x itself its derivative is S_eq; along a constant it is zero
    x = series(PARAMETERS)
    value, gradient = del_gradient(x, np.stack([x, np.ones_like(x)], axis=1), duration=60.0, slope=7.0)
    assert gradient[0] == pytest.approx(value, rel=1e-13)
    assert gradient[1] == pytest.approx(0.0, abs=1e-13)


def test_the_gradient_of_half_a_cycle_by_hand() -> None:
    # S = x3 - x0, n = 1/2, N_eq = 2, m = 2: S_eq = S / 2
    x = [1.0, 2.0, 2.5, 5.0]
    value, gradient = del_gradient(x, np.eye(4), duration=2.0, slope=2.0)
    assert value == 2.0
    assert gradient.tolist() == [-0.5, 0.0, 0.0, 0.5]


def test_cycles_lie_between_turning_points() -> None:
    x = np.random.default_rng(8).integers(-5, 6, 300).astype(float)  # with plateaus
    first, second, counts = cycle_ends(x)
    ranges, means, same = rainflow_cycles(x)
    assert np.array_equal(ranges, np.abs(x[first] - x[second]))
    assert np.array_equal(means, 0.5 * (x[first] + x[second]))
    assert np.array_equal(counts, same)
    assert np.all(first < second)
    places = np.flatnonzero(np.append(True, np.diff(x) != 0.0))
    turns = [places[0], places[-1]]
    for (a, b), c in zip(pairwise(places), places[2:], strict=False):
        if (x[b] - x[a]) * (x[c] - x[b]) < 0.0:
            turns.append(b)
    assert set(first) | set(second) == set(turns)


@pytest.mark.parametrize("function", [mean_gradient, std_gradient, min_gradient, max_gradient, load(4.0)])
def test_a_constant_series(function: Callable[..., tuple[float, Float]]) -> None:
    value, gradient = function(np.full(7, 0.1), np.ones((7, 2)))
    spreads = function not in (mean_gradient, min_gradient, max_gradient)
    assert value == (0.0 if spreads else pytest.approx(0.1, rel=1e-15))
    assert gradient.tolist() == ([0.0, 0.0] if spreads else [1.0, 1.0])


def test_the_first_of_equal_extremes_is_held() -> None:
    x, dx = [1.0, 3.0, 0.0, 3.0, 0.0], np.arange(5.0)[:, np.newaxis]
    assert max_gradient(x, dx)[1].tolist() == [1.0]
    assert min_gradient(x, dx)[1].tolist() == [2.0]


@pytest.mark.parametrize(
    ("x", "dx"), [([], np.zeros((0, 2))), ([1.0, 2.0], np.zeros((3, 2))), ([1.0, 2.0], [0.0, 0.0]), ([[1.0]], [[1.0]])]
)
def test_shapes_must_fit(x: Any, dx: Any) -> None:
    with pytest.raises(InputError, match=r"must be \(T, P\)"):
        mean_gradient(x, dx)


@pytest.mark.parametrize("name", ["duration", "slope", "f_eq"])
def test_durations_slopes_and_frequencies_must_be_positive(name: str) -> None:
    arguments = {"duration": 10.0, "slope": 4.0, name: 0.0}
    with pytest.raises(InputError, match=f"{name} must be positive"):
        del_gradient([0.0, 1.0], np.zeros((2, 1)), **arguments)
