"""Names of modes by their kinetic and potential energy: closed forms, floating turbines, soil, curves that veer."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.analyses.campbell import campbell, follow, participation
from meltemi.analyses.modes import Mode, eigenmodes

HERTZ = 2.0 * np.pi
BASE = ("surge", "sway", "heave", "roll", "pitch", "yaw")
PERIODS = {
    "nrel5mw-spar": (125.7, 31.2, 29.8, 8.3),
    "iea15mw-volturnus": (130.2, 20.1, 28.7, 85.7),
    "iea22mw-semi": (110.4, 18.0, 28.8, 88.7),
}
"""[s] periods of surge, heave, pitch and yaw, of the page on floating turbines."""
TOWER = {"nrel5mw-spar": (0.46, 0.47), "iea15mw-volturnus": (0.50, 0.58), "iea22mw-semi": (0.29, 0.30)}
"""[Hz] first tower modes at rest, side-side and fore-aft."""


def symmetric(n: int) -> NDArray[np.float64]:
    square = np.random.default_rng(n).normal(size=(n, n))
    return square @ square.T + n * np.eye(n)


def test_shares_are_those_of_kinetic_and_potential_energy() -> None:
    """(M-47): without damping, phi_i (M phi)_i and phi_i (K phi)_i over their sums of magnitudes."""
    M, K = symmetric(5), np.diag([1.0, 4.0, 9.0, 16.0, 25.0]) + 0.1 * symmetric(5)
    modes = eigenmodes(np.asarray(-np.linalg.solve(M, K), dtype=float), np.zeros((5, 5)), tuple("abcde"))
    assert len(modes) == 5
    for mode in modes:
        phi = mode.shape.real
        for matrix in (M, K):
            energy = np.abs(phi * (matrix @ phi))
            np.testing.assert_allclose(mode.energy / mode.energy.sum(), energy / energy.sum(), atol=1e-9)


def test_names_do_not_depend_on_the_units_of_a_coordinate() -> None:
    """In metres and radians, in millimetres and degrees; damped, with gyroscopic forces."""
    names = ("base surge", "base pitch", "tower 1st fore-aft", "1st flap collective")
    M, K = symmetric(4), np.diag([0.1, 0.4, 20.0, 50.0])
    gyroscopic = np.random.default_rng(5).normal(size=(4, 4))
    C = 0.02 * K + 0.3 * (gyroscopic - gyroscopic.T)
    scale = np.array([1e3, 180.0 / np.pi, 1.0, 1e-2])
    found = []
    for s in (np.ones(4), scale):
        units = np.outer(s, 1.0 / s)
        stiffness, damping = (np.asarray(-np.linalg.solve(M, X) * units, dtype=float) for X in (K, C))
        found.append(eigenmodes(stiffness, damping, names))
    assert len(found[0]) == 4
    assert len({int(np.argmax(np.abs(mode.shape))) for mode in found[1]}) == 1  # amplitudes tell nothing
    for one, two in zip(*found, strict=True):
        np.testing.assert_allclose(one.energy / one.energy.sum(), two.energy / two.energy.sum(), rtol=1e-7)
        assert one.name == two.name
    assert list(follow([found[0]], [0])) == list(follow([found[1]], [0]))


def veering(x: float) -> list[Mode]:
    """Two coupled coordinates, the stiffness of one falling with x and that of the other rising."""
    K = -np.array([[2.0 - x, 0.05], [0.05, 1.0 + x]])
    return eigenmodes(K, np.zeros((2, 2)), ("tower 1st fore-aft", "base heave"))


def test_names_cross_where_curves_veer_and_each_is_given_once() -> None:
    xs = np.linspace(0.0, 1.0, 21)
    found = [veering(x) for x in xs]
    curves = follow(found, range(len(xs)))
    assert set(curves) == {"1st tower fore-aft", "base heave"}
    for i, x in enumerate(xs):
        modes = [curve[i] for curve in curves.values()]
        assert {id(mode) for mode in modes} == {id(mode) for mode in found[i]}
        tower = curves["1st tower fore-aft"][i]
        assert tower is not None
        if abs(x - 0.5) > 0.06:
            assert tower is found[i][1 if x < 0.5 else 0]
            assert participation(tower)["1st tower fore-aft"] > 0.5


def test_a_mode_of_the_wake_leaves_the_name_to_the_platform() -> None:
    """Two modes with half of their energy in surge; the one with a damping ratio of 0.76 has no other name either."""
    names = ("base surge", "base pitch")
    ratios = (0.05, 0.76)
    wake, surge = (
        Mode(0.05, ratio, names, np.array([1.0, 0.1 + 0j]), np.array(energy))
        for ratio, energy in zip(ratios[::-1], ([0.5, 0.4], [0.5, 0.1]), strict=True)
    )
    pitch = Mode(0.2, 0.2, names, np.array([0.1, 1.0 + 0j]), np.array([0.05, 0.9]))
    curves = follow([[wake, surge, pitch]], [0])
    assert curves == {"base surge": [surge], "base pitch": [pitch]}


@pytest.mark.parametrize("name", PERIODS)
def test_floating_turbines_have_each_rigid_motion_once(name: str) -> None:
    model = meltemi.build(meltemi.load_turbine(name))
    diagram = campbell(model, rotor_speeds=[0.0], air=False)
    assert len(set(diagram.labels)) == len(diagram.labels)
    found = dict(zip(diagram.labels, diagram.frequency[:, 0] / HERTZ, strict=True))
    assert set(diagram.labels[:6]) == {f"base {motion}" for motion in BASE}
    for motion, period in zip(("surge", "heave", "pitch", "yaw"), PERIODS[name], strict=True):
        assert 1.0 / found[f"base {motion}"] == pytest.approx(period, rel=0.01), motion
    for one, other in (("sway", "surge"), ("roll", "pitch")):  # the platform is symmetric
        assert found[f"base {one}"] == pytest.approx(found[f"base {other}"], rel=0.02)
    for way, frequency in zip(("side-side", "fore-aft"), TOWER[name], strict=True):
        assert found[f"1st tower {way}"] == pytest.approx(frequency, rel=0.02)
    modes = meltemi.analysis.natural_modes(model)
    assert {mode.name for mode in modes[:6]} == {f"base {motion}" for motion in BASE}
    assert "base heave 1.00" in diagram.participation("base heave", 0)


def test_a_platform_keeps_its_names_and_gravity_while_the_rotor_turns() -> None:
    """Without gravity the VolturnUS-S would rise and lose the stiffness that its weight gives."""
    model = meltemi.build(meltemi.load_turbine("iea15mw-volturnus"))
    diagram = campbell(model, rotor_speeds=[0.0, 0.4], air=False)
    assert set(diagram.labels[:6]) == {f"base {motion}" for motion in BASE}
    still, turning = diagram.frequency[:6].T
    np.testing.assert_allclose(turning, still, rtol=0.01)


def test_springs_of_soil_leave_the_names_of_a_tower() -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    stiffness = np.diag([2e9, 2e9, 4e10, 6e11, 6e11, 2e11])
    options = meltemi.ModelOptions(fore_aft_modes=3, side_side_modes=3)
    labels, lowest = [], []
    for changes in ({}, {"foundation": {"stiffness": stiffness, "mass": 1e6}}):
        diagram = campbell(meltemi.build(turbine.replace(**changes), options), rotor_speeds=[0.0, 1.0], air=False)
        assert len(set(diagram.labels)) == len(diagram.labels)
        labels.append(diagram.labels)
        lowest.append(diagram.frequency[:2, 0])
    assert set(labels[0]) == set(labels[1])
    assert labels[1][:2] == ("1st tower side-side", "1st tower fore-aft")
    assert np.all(lowest[1] < 0.99 * lowest[0])
