"""The rule of ``tune_ipc`` on loops whose margins are known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError
from meltemi.controllers import tuning
from meltemi.controllers.tuning import gain_reserve, largest, phase_reserve
from meltemi.tuning.tuning_plots import plot_tuning

SIDE = np.geomspace(1e-3, 8.0, 400)
W = np.concatenate([-SIDE[::-1], SIDE])


def delayed(bandwidth: float, delay: float, turned: float = 0.0) -> NDArray[np.complex128]:
    """An integrator with a delay [s], all of it turned by an angle [rad]."""
    return bandwidth / (1j * W) * np.exp(-1j * W * delay + 1j * turned)


@pytest.mark.parametrize(("bandwidth", "delay"), [(0.4, 1.0), (0.1, 2.5), (1.2, 0.5)])
def test_margins_of_an_integrator_with_delay(bandwidth: float, delay: float) -> None:
    L = delayed(bandwidth, delay)
    assert phase_reserve(W, L) == pytest.approx(0.5 * math.pi - bandwidth * delay, abs=1e-3)
    assert gain_reserve(W, L) == pytest.approx(0.5 * math.pi / (bandwidth * delay), rel=2e-3)


@pytest.mark.parametrize("turned", [-0.3, 0.2])
def test_a_wrong_offset_costs_phase_on_one_side(turned: float) -> None:
    # the side whose phase is already behind loses; the gain margin is that of the earlier crossing
    L = delayed(0.4, 1.0, turned)
    assert phase_reserve(W, L) == pytest.approx(0.5 * math.pi - 0.4 - abs(turned), abs=1e-3)
    assert gain_reserve(W, L) == pytest.approx((0.5 * math.pi - abs(turned)) / 0.4, rel=2e-3)


def test_both_sides_of_the_frequency_count() -> None:
    slow_on_one_side = np.where(W > 0.0, delayed(0.4, 1.0), delayed(0.4, 2.0))
    assert phase_reserve(W, slow_on_one_side) == pytest.approx(0.5 * math.pi - 0.8, abs=1e-3)
    assert gain_reserve(W, slow_on_one_side) == pytest.approx(0.5 * math.pi / 0.8, rel=2e-3)


def test_a_loop_without_crossings_has_infinite_margins() -> None:
    assert phase_reserve(W, 0.1 * np.ones(len(W), complex)) == math.inf
    assert gain_reserve(W, 1.0 / (1.0 + 1j * W)) == math.inf


@pytest.mark.parametrize(
    ("phase", "gain", "expected"),
    [
        (math.radians(60.0), 2.0, math.pi / 6.0),  # the phase binds
        (math.radians(80.0), 2.0, math.pi / 18.0),
        (math.radians(20.0), 4.0, math.pi / 8.0),  # the gain binds
    ],
)
def test_the_largest_gain_keeps_both_margins(phase: float, gain: float, expected: float) -> None:
    L = delayed(1.0, 1.0)
    found = largest(W, L, (0.0,), phase, gain)
    assert found == pytest.approx(expected, rel=2e-3)
    for factor, kept in ((0.99, True), (1.01, False)):
        reserves = phase_reserve(W, factor * found * L), gain_reserve(W, factor * found * L)
        assert (reserves[0] >= phase and reserves[1] >= gain) == kept


def test_a_resonance_limits_the_gain() -> None:
    # beyond its frequency it goes around a circle of the diameter 5, at 30 deg of which it enters the sector
    w = np.linspace(3.0, 5.0, 1000)
    resonance = -5.0j / (1.0 + 1j * (w - 4.0) / 0.2)
    found = largest(w, resonance, (0.0,), math.radians(60.0), 2.0)
    assert found == pytest.approx(1.0 / (5.0 * math.cos(math.radians(30.0))), rel=1e-3)
    assert largest(w, resonance.conj(), (0.0,), math.radians(60.0), 2.0) == pytest.approx(found)
    assert largest(w, -1j * resonance, (0.0,), math.radians(60.0), 2.0) == pytest.approx(0.1, rel=1e-3)  # on the axis


def test_the_delay_of_a_plant_is_found() -> None:
    P = 3.0 * np.exp(-0.7j * W) * np.exp(2.0j)
    assert tuning._delay(W, P) == pytest.approx(0.7)


def test_gains_fall_as_the_plant_grows() -> None:
    pitch = np.radians([5.0, 10.0, 20.0])
    begin, halving = tuning._schedule(pitch, 4.0 * (1.0 + pitch / 0.2))
    assert begin == pytest.approx(4.0) and halving == pytest.approx(0.2)
    assert tuning._schedule(pitch, np.array([3.0, 2.0, 1.0])) == (3.0, None)  # the largest, where it falls
    assert tuning._schedule(pitch[:1], np.array([3.0])) == (3.0, None)


# the picture


@dataclass
class Point:
    wind_speed: float
    frequency: NDArray[np.float64]
    together: NDArray[np.complex128]
    phase_margin: float
    gain_margin: float
    sensitivity: float


@dataclass
class Loop:
    points: tuple[Point, ...]


def point(wind_speed: float, delay: float) -> Point:
    L = delayed(0.4, delay)
    return Point(wind_speed, W, L, phase_reserve(W, L), gain_reserve(W, L), float((1.0 / np.abs(1.0 + L)).max()))


def texts(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.texts]


def test_bode_plots_tell_margins_and_units() -> None:
    loops = {"1P pitch": Loop((point(13.0, 1.0), point(25.0, 1.2))), "2P flap": Loop((point(13.0, 0.5),))}
    figure = plot_tuning(loops)
    gain, phase, sensitivity = figure.axes[:3]
    assert [ax.get_title(loc="left") for ax in figure.axes[::3]] == ["1P pitch: gain |L|", "2P flap: gain |L|"]
    assert [ax.get_ylabel() for ax in figure.axes[:3]] == ["[-]", "[deg]", "[-]"]
    assert figure.axes[-1].get_xlabel() == "frequency of the amplitude [Hz]"
    assert texts(gain) == ["gain margin 3.3"]  # pi/2 / (0.4 1.2)
    assert texts(phase) == ["phase margin 62 deg"]
    assert texts(sensitivity) == [f"largest {max(p.sensitivity for p in loops['1P pitch'].points):.2f}"]
    assert "13 m/s" in [text.get_text() for text in figure.legends[0].get_texts()]
    # both signs: of a delayed integrator they lie on each other
    positive, negative = (line for line in phase.lines[:2])
    assert np.allclose(positive.get_ydata(), negative.get_ydata())
    assert np.asarray(positive.get_ydata())[0] == pytest.approx(-90.0, abs=0.1)
    assert len(plot_tuning(loops["2P flap"]).axes) == 3
    with pytest.raises(InputError, match="no tunings"):
        plot_tuning({})
