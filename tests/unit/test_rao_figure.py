"""Frequencies, units and figure of response amplitude operators."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meltemi.floating.rao import CHANNELS, WIDEST, Operators, resonant_frequencies
from meltemi.floating.rao_plots import plot_operators

SURGE, PITCH = (0.046, 0.002), (0.22, 0.02)
"""Natural frequency [rad/s] and damping ratio."""


def operators() -> Operators:
    """Oscillators in surge, pitch and the tower base; sway, roll and yaw of rounding."""
    resonances = np.array([SURGE, PITCH])
    w = resonant_frequencies(resonances, 5.0)
    value = np.zeros((len(w), len(CHANNELS)), dtype=np.complex128)
    for name, (w0, d), size in (
        ("platform_surge", SURGE, 1.0),
        ("platform_heave", PITCH, 1.0),
        ("platform_pitch", PITCH, 0.01),
        ("tower_base_moment_fore_aft", PITCH, 4e8),
        ("platform_sway", SURGE, 1e-5),
        ("platform_roll", PITCH, 1e-7),
        ("platform_yaw", PITCH, 1e-7),
    ):
        value[:, CHANNELS.index(name)] = size * w0**2 / (w0**2 - w**2 + 2j * d * w0 * w)
    return Operators(w, CHANNELS, ("m",) * 3 + ("rad",) * 3 + ("N m",), value, resonances)


@pytest.mark.parametrize(("w0", "d"), [SURGE, PITCH])
def test_frequencies_resolve_the_peak_of_a_resonance(w0: float, d: float) -> None:
    w = resonant_frequencies(np.array([SURGE, PITCH]), 5.0)
    assert w[0] == pytest.approx(0.5 * SURGE[0]) and w[-1] == pytest.approx(5.0) and np.all(np.diff(w) > 0.0)
    size = 1.0 / np.abs(1.0 - (w / w0) ** 2 + 2j * d * w / w0)
    assert size.max() == pytest.approx(0.5 / d, rel=0.01)  # of an oscillator at its natural frequency
    near = np.abs(w / w0 - 1.0) < WIDEST
    over = np.maximum(size[near][1:], size[near][:-1]) / np.minimum(size[near][1:], size[near][:-1])
    assert over.max() < 2.2  # no step of the curve is higher
    assert len(w) < 400


def test_without_resonances_frequencies_are_those_of_waves() -> None:
    w = resonant_frequencies(np.zeros((0, 2)), 4.0)
    assert w[0] == pytest.approx(0.1) and w[-1] == pytest.approx(4.0)
    assert np.diff(np.log(w)) == pytest.approx(np.log(40.0) / (len(w) - 1))


def test_motions_that_symmetry_leaves_nothing_of_are_named() -> None:
    assert operators().silent() == ["platform_sway", "platform_roll", "platform_yaw"]
    alone = Operators(np.array([0.1, 2.0]), ("platform_yaw",), ("rad",), np.full((2, 1), 1e-9 + 0j))
    assert alone.silent() == []  # who asks for it gets it


def test_moments_are_in_meganewton_metres() -> None:
    units = dict(zip(CHANNELS, operators().readable, strict=True))
    assert units["tower_base_moment_fore_aft"] == ("MN m", 1e-6)
    assert units["platform_pitch"] == ("deg", pytest.approx(57.2958)) and units["platform_surge"] == ("m", 1.0)
    small = Operators(np.array([0.1, 2.0]), ("a", "b"), ("N m", "N"), np.full((2, 2), 5e4 + 0j))
    assert small.readable == [("kN m", 1e-3), ("kN", 1e-3)]


def test_the_figure_shows_resonances_and_leaves_rounding_out() -> None:
    found = operators()
    axes: Any = plot_operators("a floater", [("linear", found, None)]).axes
    assert [ax.get_title(loc="left") for ax in axes] == ["surge", "heave", "pitch", "tower base moment fore aft"]
    assert axes[-1].get_ylabel() == "[MN m/m]" and "sway, roll, yaw" in axes[-1].get_xlabel()
    left, right = axes[0].get_xlim()
    for w, _ in found.resonances:
        assert left < w / (2.0 * np.pi) < right
        assert any(line.get_xdata()[0] == w / (2.0 * np.pi) for line in axes[0].lines[1:])
    low, high = axes[1].get_ylim()  # heave: 25 times its static response, inside
    assert low < 1.0 and high > 0.5 / PITCH[1]
