"""Elementary functions: within a few units in the last place of values with 70 digits."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from decimal import Decimal, localcontext
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.compiler import elementary

Float = NDArray[np.float64]
DIGITS = 70
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534")


def sine(x: Decimal) -> Decimal:
    """Sine by its series, after the nearest multiple of pi is subtracted."""
    n = (x / PI).to_integral_value()
    x -= n * PI
    term = total = x
    k = 1
    while abs(term) > Decimal(10) ** (1 - DIGITS) * abs(total):
        k += 2
        term *= -x * x / (k * (k - 1))
        total += term
    return -total if n % 2 else total


def cosine(x: Decimal) -> Decimal:
    return sine(x + PI / 2)


def arctangent(y: Decimal, x: Decimal) -> Decimal:
    """Angle of the point (x, y) by the series of atan, after its angle is halved four times."""
    if y < 0:
        return -arctangent(-y, x)
    if x < 0:
        return PI - arctangent(y, -x)
    if x < y:
        return PI / 2 - arctangent(x, y)
    t = y / x
    for _ in range(4):
        t /= 1 + (1 + t * t).sqrt()
    power = total = t
    k = 1
    while abs(power) > Decimal(10) ** (1 - DIGITS) * abs(total):
        k += 2
        power *= -t * t
        total += power / k
    return 16 * total


def hyperbolic_tangent(x: Decimal) -> Decimal:
    e = (2 * x).exp()
    return (e - 1) / (e + 1)


EXACT: dict[str, Callable[..., Decimal]] = {
    "exp": Decimal.exp,
    "expm1": lambda x: x.exp() - 1,
    "log": Decimal.ln,
    "sin": sine,
    "cos": cosine,
    "tan": lambda x: sine(x) / cosine(x),
    "tanh": hyperbolic_tangent,
    "atan2": arctangent,
    "acos": lambda x: arctangent((1 - x * x).sqrt(), x),
}
ULP = {
    "exp": 1.2,
    "expm1": 2.5,
    "log": 1.0,
    "sin": 2.5,
    "cos": 2.5,
    "tan": 3.5,
    "tanh": 2.5,
    "atan2": 2.5,
    "acos": 1.5,
}
"""Largest error allowed, in units in the last place."""


def arguments(name: str, n: int) -> Float:
    """Random arguments over the range of a function, evenly and by order of magnitude, and special ones."""
    random = np.random.default_rng(3)

    def even(low: float, high: float) -> Float:
        return random.uniform(low, high, n)

    def sizes(low: float, high: float) -> Float:
        return 10.0 ** even(low, high) * random.choice([-1.0, 1.0], n)

    if name == "exp":
        found = [even(-708.0, 709.7), even(-2.0, 2.0), sizes(-20.0, 0.0), [0.0, -708.0, 709.78, 0.5 * math.log(2.0)]]
    elif name == "expm1":
        found = [even(-708.0, 708.9), even(-2.0, 2.0), sizes(-20.0, 0.0), [0.0, -708.0, 709.0, -0.5 * math.log(2.0)]]
    elif name == "log":
        near = [math.sqrt(0.5), np.nextafter(math.sqrt(0.5), 0.0), np.nextafter(1.0, 0.0), np.nextafter(1.0, 2.0)]
        found = [10.0 ** even(-307.0, 308.0), even(0.5, 2.0), 1.0 + sizes(-15.0, -1.0), [1.0, 2.0**-1022, *near]]
    elif name == "tanh":
        found = [even(-22.0, 22.0), even(-1.0, 1.0), sizes(-20.0, 1.0), [0.0, 0.17328, 700.0, -1e300]]
    elif name == "acos":
        # from 1 - 1e-16 on, where the angle is 1e-8
        found = [even(-1.0, 1.0), 1.0 - 10.0 ** even(-16.0, 0.0), 10.0 ** even(-16.0, 0.0) - 1.0, sizes(-20.0, -1.0)]
        found.append([-1.0, -0.5, 0.0, 0.5, 1.0, np.nextafter(1.0, 0.0)])
    elif name == "atan2":
        axes = [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        steep = np.tan(np.pi / 8.0 * np.arange(1.0, 4.0))
        seams = np.stack([steep, np.ones(3)], axis=1)
        anywhere = np.stack([sizes(-9.0, 9.0), sizes(-9.0, 9.0)], axis=1)
        return np.concatenate([random.normal(size=(2 * n, 2)), anywhere, axes, seams])
    else:
        # near multiples of pi/2 most digits cancel
        quarters = np.concatenate([np.arange(1.0, 65.0), np.floor(even(1.0, 6.3e5))]) * (0.5 * np.pi)
        eighths = np.arange(-31.0, 32.0, 2.0) * (0.25 * np.pi)
        found = [even(-4.0, 4.0), even(-1e6, 1e6), sizes(-20.0, 6.0), quarters, eighths, [0.0, 1e6]]
    return np.concatenate([np.asarray(f, dtype=float) for f in found])[:, np.newaxis]


@cache
def cases(name: str, n: int) -> list[tuple[list[float], Decimal]]:
    with localcontext(prec=DIGITS):
        return [(a, EXACT[name](*map(Decimal, a))) for a in arguments(name, n).tolist()]


def error(name: str, n: int) -> float:
    """Largest error [ulp]."""
    f, largest = getattr(elementary, name), 0.0
    with localcontext(prec=DIGITS):
        for args, exact in cases(name, n):
            try:
                value = f(*args)
            except OverflowError:
                return math.inf
            if not math.isfinite(value):
                return math.inf
            largest = max(largest, float(abs(Decimal(value) - exact)) / math.ulp(float(exact)))
    return largest


@pytest.mark.slow
@pytest.mark.parametrize("name", ULP)
def test_error_in_the_last_place(name: str) -> None:
    assert error(name, 1000) < ULP[name]


CONSTANTS = [
    name
    for name, value in vars(elementary).items()
    if isinstance(value, float) and name not in ("EXP_LOW", "EXP_HIGH", "TANH_ONE", "TAN_PI_8")
]


@pytest.mark.parametrize("constant", CONSTANTS)
def test_no_constant_can_change(constant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of any constant by 2 % is noticed by the test above, with a tenth of its arguments."""
    for name, found in list(vars(elementary).items()):
        if hasattr(found, "py_func"):
            monkeypatch.setattr(elementary, name, found.py_func)
    monkeypatch.setattr(elementary, constant, 1.02 * getattr(elementary, constant))
    if group := re.fullmatch(r"(EXP|LOG|SIN|COS|ATAN|ASIN|TAN)_[PQ]?\d+", constant):
        first = {"ATAN": "atan2", "ASIN": "acos"}
        names = [first.get(group[1], group[1].lower())]
    else:
        names = list(ULP)
    assert any(error(name, 100) > 1.2 * ULP[name] for name in names)


def test_ends_of_the_ranges() -> None:
    e = elementary
    assert e.exp(-1e9) == e.exp(-math.inf) == e.exp(-709.0) == 0.0
    assert e.exp(710.0) == e.exp(1e9) == e.exp(math.inf) == math.inf
    assert e.tanh(-1e9) == e.tanh(-math.inf) == -1.0
    assert e.tanh(1e9) == e.tanh(math.inf) == 1.0
    assert e.atan2(0.0, 0.0) == 0.0
    assert e.acos(1.0) == e.log(1.0) == e.tan(0.0) == e.tanh(0.0) == 0.0
    assert e.exp(0.0) == e.cos(0.0) == 1.0
    assert e.acos(-1.0) == e.atan2(0.0, -1.0) == math.pi
    assert e.sincos(0.0) == (0.0, 1.0)


def test_both_sides_of_zero_are_alike() -> None:
    e = elementary
    for x in np.random.default_rng(5).uniform(0.0, 30.0, 500).tolist():
        assert e.tanh(-x) == -e.tanh(x)
        assert e.atan2(-x, 1.0) == -e.atan2(x, 1.0)
        assert e.sincos(x) == (e.sin(x), e.cos(x))
        assert e.sincos(-x) == (-e.sincos(x).sin, e.sincos(x).cos)
