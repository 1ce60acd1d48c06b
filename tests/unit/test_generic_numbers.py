"""What functions for any number type need, for plain floats."""

from __future__ import annotations

import math

import numpy as np

from meltemi.compiler import floor, where
from meltemi.compiler.generic import split, two_to


def test_split_is_exact_and_in_range() -> None:
    near_root = [math.sqrt(0.5), np.nextafter(math.sqrt(0.5), 0.0), math.sqrt(2.0), np.nextafter(math.sqrt(2.0), 0.0)]
    many = 10.0 ** np.random.default_rng(1).uniform(-307.0, 308.0, 1000)
    for x in [1.0, 0.5, 2.0, 2.0**-1022, 1.7e308, *map(float, near_root), *many.tolist()]:
        m, e = split(x)
        assert math.sqrt(0.5) <= m < math.sqrt(2.0)
        assert math.ldexp(m, int(e)) == x


def test_powers_of_two_are_exact() -> None:
    for n in range(-1022, 1024):
        assert two_to(float(n)) == 2.0**n


def test_floor_and_where() -> None:
    assert [floor(x) for x in (-1.5, -1.0, -0.5, 0.0, 0.5, 1e17)] == [-2.0, -1.0, -1.0, 0.0, 0.0, 1e17]
    assert isinstance(floor(2.5), float)
    assert where(True, 1.0, 2.0) == 1.0
    assert where(False, 1.0, 2.0) == 2.0
