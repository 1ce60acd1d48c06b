"""Polars from shapes: measured coefficients, closed form of the extension, and shapes that are refused."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from meltemi import InputError
from meltemi.studies.shape_polar import FULL, checked_shape, extended_polar, polar_of_shape, viterna
from meltemi.turbine.definition import Airfoil

HAS_NETWORK = find_spec("neuralfoil") is not None
needs_network = pytest.mark.skipif(not HAS_NETWORK, reason="needs neuralfoil: pip install 'neuralfoil>=0.3.2,<0.4'")


def naca_0012(n: int = 61) -> np.ndarray:
    """NACA 0012, its trailing edge closed, from it over the upper side."""
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, n)))
    t = 0.6 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    return np.concatenate([np.stack([x, t], 1)[::-1], np.stack([x, -t], 1)[1:]])


LADSON = np.array(
    [
        (-3.99, -0.4363, 0.00871),
        (-1.98, -0.2213, 0.00792),
        (0.04, -0.0013, 0.00811),
        (2.00, 0.2213, 0.00814),
        (4.06, 0.4365, 0.00814),
        (6.09, 0.6558, 0.00851),
        (8.09, 0.8689, 0.00985),
        (10.18, 1.0809, 0.01165),
        (12.10, 1.2644, 0.01299),
    ]
)
"""NACA 0012 at Re 6 million, Mach 0.15, tripped with 180 grit: Ladson (1988), NASA TM 4074."""


@needs_network
@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # of packages that it brings
def test_measured_naca_0012() -> None:
    polar = polar_of_shape(naca_0012(), 6e6, trip=0.05)
    alpha, lift, drag = LADSON.T
    found = [np.interp(np.radians(alpha), polar.angle_of_attack, x) for x in (polar.lift, polar.drag)]
    assert np.abs(found[0] - lift).max() < 0.08
    assert np.abs(found[1] / drag - 1.0).max() < 0.12
    assert polar.relative_thickness == pytest.approx(0.12, abs=1e-3)
    assert "trip 0.05, confidence 0." in polar.source
    up, down = (np.interp(angle, polar.angle_of_attack, polar.lift) for angle in (0.1, -0.1))
    assert up == pytest.approx(-down, abs=1e-3)  # a symmetric airfoil
    upside_down = polar_of_shape(naca_0012()[::-1], 6e6, trip=0.05)
    assert upside_down.lift == pytest.approx(polar.lift, abs=0.02)


@pytest.mark.skipif(HAS_NETWORK, reason="neuralfoil is installed")
def test_without_the_network() -> None:
    with pytest.raises(InputError, match="polar_of_shape needs neuralfoil, which is not installed: pip install"):
        polar_of_shape(naca_0012(), 6e6)


def test_viterna_by_hand() -> None:
    """At stall the coefficients of stall, across the flow 1.11 + 0.018 AR without lift, a flat plate in between."""
    stall = np.radians(15.0)
    lift, drag = viterna(np.array([stall, 0.5 * np.pi]), stall, 1.4, 0.03, 10.0)
    assert lift == pytest.approx([1.4, 0.0], abs=1e-12)
    assert drag == pytest.approx([0.03, 1.29], abs=1e-12)
    plate = 1.29 * np.sin(stall) * np.cos(stall), 1.29 * np.sin(stall) ** 2
    lift, drag = viterna(np.radians([30.0, 60.0]), stall, *plate, 10.0)
    assert lift == pytest.approx(1.29 * np.sin(np.radians([60.0, 120.0])) / 2.0)
    assert drag == pytest.approx(1.29 * np.sin(np.radians([30.0, 60.0])) ** 2)


def test_the_full_circle() -> None:
    alpha = np.radians(np.linspace(-12.0, 15.0, 28))
    given = 2.0 * np.pi * (alpha + 0.05), 0.01 + 0.1 * alpha**2, np.full_like(alpha, -0.08)
    lift, drag, moment = extended_polar(alpha, *given, 10.0)
    inside = (alpha[0] <= FULL) & (alpha[-1] >= FULL)
    for full, part in zip((lift, drag, moment), given, strict=True):
        assert full[inside] == pytest.approx(np.interp(FULL[inside], alpha, part))
    assert drag.min() > 0.0
    at = [int(np.argmin(np.abs(FULL - np.radians(a)))) for a in (-180.0, -90.0, 90.0, 180.0)]
    assert lift[at] == pytest.approx(0.0, abs=1e-5)
    assert drag[at[1:3]] == pytest.approx(1.29, abs=1e-9)
    assert moment[at[1:3]] == pytest.approx([1.29 / 4.0, -1.29 / 4.0], abs=1e-9)  # the force at half the chord
    assert np.abs(np.diff(lift)).max() < 0.7 * lift.max() / 15.0 * 5.0 + 1e-3  # from behind, in steps of 5 degrees
    assert np.abs(np.diff(drag)).max() < 0.15
    behind = np.radians(120.0) < FULL
    assert np.all(lift[behind][:-1] <= 0.0)
    airfoil = Airfoil(angle_of_attack=FULL, lift=lift, drag=drag, moment=moment)
    assert len(airfoil.lift) == len(FULL)


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (naca_0012()[:-20], "the shape is not closed: its ends are"),
        (naca_0012()[[*range(40), 45, 44, 43, 42, 41, 40, *range(46, 121)]], "the shape crosses itself near"),
        (naca_0012() * [1.0, np.nan], "coordinates must be 20 pairs or more"),
        (naca_0012()[::10], "coordinates must be 20 pairs or more"),
        ([1.0, 2.0, 3.0], "coordinates must be 20 pairs or more"),
        ("shape.dat", "expected numbers in a regular list"),
    ],
)
def test_refused_shapes(shape: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        polar_of_shape(shape, 1e6)  # type: ignore[arg-type]


@pytest.mark.parametrize(("reynolds", "words"), [(1e3, "expected 1e4 to 1e8"), ("1e6", "must be a number")])
def test_refused_numbers(reynolds: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        polar_of_shape(naca_0012(), reynolds)  # type: ignore[arg-type]


def test_shapes_are_turned_and_scaled() -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    turned = 2.5 * naca_0012() @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
    assert checked_shape(turned) == pytest.approx(naca_0012(), abs=1e-9)
    cambered = naca_0012() + 0.02 * np.stack([np.zeros(121), np.sin(np.pi * naca_0012()[:, 0])], 1)
    assert checked_shape(cambered[::-1]) == pytest.approx(checked_shape(cambered), abs=1e-9)
