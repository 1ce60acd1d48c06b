"""The geometrically exact beam against closed forms and published solutions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

from meltemi.structure.beam import Beam, section_axes
from meltemi.verification.exact_beam import DeadLoads, Deflection, deflect

Float = NDArray[np.float64]
NONE = np.zeros(3)


def uniform(K: Float, axis: Float, twist: float = 0.0) -> Beam:
    """A beam with the same section everywhere; ``twist`` [rad] at its end, linear."""
    z = axis[:, 2]
    Q = section_axes(twist * np.linspace(0.0, 1.0, len(z)), np.gradient(axis, z, axis=0))
    return Beam(z, axis, Q @ np.tile(K, (len(z), 1, 1)) @ Q.transpose(0, 2, 1), np.tile(np.eye(6), (len(z), 1, 1)))


def straight(length: float, n: int) -> Float:
    return np.linspace(0.0, length, n)[:, None] * np.array([0.0, 0.0, 1.0])


def at_the_tip(beam: Beam, force: Float = NONE, moment: Float = NONE, **how: int) -> Deflection:
    none = np.zeros((len(beam.position), 3))
    return deflect(beam, DeadLoads(none, none, np.asarray(force, dtype=float), np.asarray(moment, dtype=float)), **how)


LINEAR = {"increments": 1, "steps": 1}
"""For small loads on many sections."""


STIFF = 1e10
BENDING = np.diag([STIFF, STIFF, STIFF, 2.0, 3.0, 4.0])


def test_a_moment_at_the_tip_makes_a_circle() -> None:
    """Half a turn about y: the axis is a semicircle of radius L / pi."""
    found = at_the_tip(uniform(BENDING, straight(1.0, 11)), moment=np.array([0.0, 3.0 * np.pi, 0.0]))
    np.testing.assert_allclose(found.position[-1], [2.0 / np.pi, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.rotation[-1].as_rotvec(), [0.0, np.pi, 0.0], atol=1e-6)


def elastica(load: float) -> tuple[float, float]:
    """Tip of a cantilever of unit length and stiffness under a transverse tip load: along, across (Frisch-Fay 1962)."""

    def lack(k: float) -> float:
        return float(ellipk(k * k) - ellipkinc(np.arcsin(1.0 / (k * np.sqrt(2.0))), k * k)) - np.sqrt(load)

    k = brentq(lack, 1.0 / np.sqrt(2.0) + 1e-12, 1.0 - 1e-12)
    slope = np.arcsin(2.0 * k * k - 1.0)
    phi = np.linspace(np.arcsin(1.0 / (k * np.sqrt(2.0))), 0.5 * np.pi, 200_001)
    ds = 1.0 / np.sqrt(load) / np.sqrt(1.0 - (k * np.sin(phi)) ** 2)
    across = np.trapezoid((2.0 * (k * np.sin(phi)) ** 2 - 1.0) * ds, phi)
    return float(np.sqrt(2.0 * np.sin(slope) / load)), float(across)


@pytest.mark.slow
@pytest.mark.parametrize("load", [1.0, 4.0, 10.0])
def test_the_elastica(load: float) -> None:
    found = at_the_tip(uniform(BENDING, straight(1.0, 11)), force=np.array([3.0 * load, 0.0, 0.0]))
    along, across = elastica(load)
    np.testing.assert_allclose(found.position[-1], [across, 0.0, along], atol=2e-6)
    # dead load: the root moment is the load times its arm
    np.testing.assert_allclose(found.root_moment, [0.0, 3.0 * load * along, 0.0], atol=1e-4)


def arc(n: int) -> Float:
    """Axis of an eighth of a circle of radius 100 in the plane y = 0."""
    angle = np.linspace(0.0, np.pi / 4.0, n)
    return 100.0 * np.stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)


BEND = np.diag([4.16667e6, 4.16667e6, 1e7, 8.333e5, 8.333e5, 8.333e5])


@pytest.mark.slow
def test_a_moment_in_its_plane_changes_the_radius_of_an_arc() -> None:
    """The curvature grows by M / EI: here to a quarter of a circle."""
    found = at_the_tip(uniform(BEND, arc(81)), moment=np.array([0.0, 8.333e3, 0.0]), steps=1)
    np.testing.assert_allclose(found.position[-1], [50.0, 0.0, 50.0], atol=0.01)


def test_a_small_load_across_an_arc_bends_and_twists_it() -> None:
    """Castigliano: P R^3 ((a - sin 2a / 2) / 2 EI + (3 a - 4 sin a + sin 2a / 2) / 2 GJ), and shear."""
    a, K = np.pi / 4.0, np.diag([4.16667e6, 4.16667e6, 1e7, 8e5, 8e5, 5e5])
    bent = (a - 0.5 * np.sin(2.0 * a)) / (2.0 * 8e5)
    twisted = (3.0 * a - 4.0 * np.sin(a) + 0.5 * np.sin(2.0 * a)) / (2.0 * 5e5)
    expected = 1e6 * (bent + twisted) + 100.0 * a / 4.16667e6
    found = at_the_tip(uniform(K, arc(81)), force=np.array([0.0, 1.0, 0.0]), **LINEAR)
    assert found.position[-1][1] == pytest.approx(expected, rel=1e-3)


@pytest.mark.long
def test_the_bend_of_bathe_and_bolourchi() -> None:
    """A load of 600 across an arc: between the first published tip and that of a spectral element code, 2 % apart.

    Sources: Bathe & Bolourchi (1979); https://kynema.github.io/kynema/testing/curved.html, 12 nodes.
    """
    found = at_the_tip(uniform(BEND, arc(81)), force=np.array([0.0, 600.0, 0.0]), steps=1)
    moved = np.abs(found.position[-1] - arc(81)[-1])
    assert np.all((np.array([13.4, 53.4, 23.5]) < moved) & (moved < np.array([13.72080, 53.57765, 23.64597])))


@pytest.mark.slow
def test_the_composite_box_of_beamdyn() -> None:
    """Coupled section, tip force of 150 lb.

    Source: Wang et al. (2017), Wind Energy 20, 1439-1462, static analysis of a composite beam. BeamDyn adds the stretch
    by twist, 0.5 (K_55 + K_66) kappa_1^2: over K_11 and the length that is -3.3e-4 of its axial displacement.
    """
    K = 1e3 * np.diag([88.56, 38.78, 1368.17, 0.0, 0.0, 0.0])
    # axes there: 1 along the beam, 2 and 3 across; here x and y across, z along
    box = 1e3 * np.array([[16.96, 17.61, -0.351], [17.61, 59.12, -0.370], [-0.351, -0.370, 141.47]])
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    K[3:, 3:] = turn @ box @ turn.T
    found = at_the_tip(uniform(K, straight(10.0, 11)), force=np.array([0.0, 150.0, 0.0]))
    twist = np.gradient(found.rotation.as_rotvec()[:, 2], 1.0)
    stretch = -np.trapezoid(0.5 * (59.12 + 141.47) / 1368.17 * twist**2, dx=1.0)
    assert stretch == pytest.approx(-3.3e-4, rel=0.05)
    moved = found.position[-1] - np.array([0.0, 0.0, 10.0 - stretch])
    np.testing.assert_allclose(moved, [-0.06484, 1.22998, -0.09064], atol=3e-4)
    turned = found.rotation[-1].as_rotvec()
    size = np.linalg.norm(turned)
    np.testing.assert_allclose(4.0 * np.tan(size / 4.0) / size * turned, [-0.17985, 0.00488, 0.18445], rtol=1e-3)


@pytest.mark.long
def test_the_twisted_beam_of_macneal_and_harder() -> None:
    """A rectangle of 1.1 x 0.32, twisted by a right angle, under unit tip loads: closed form, and published figures.

    Source: MacNeal & Harder (1985), Finite Elements in Analysis and Design 1, 3-20; 0.3 % from the closed form.
    """
    E, width, thickness = 29e6, 1.1, 0.32
    A, G, J = width * thickness, E / 2.44, 0.333 * width * thickness**3 * (1.0 - 0.63 * thickness / width)
    K = np.diag([*[G * A * 5.0 / 6.0] * 2, E * A, E * A * width**2 / 12.0, E * A * thickness**2 / 12.0, G * J])
    beam = uniform(K, straight(12.0, 241), twist=np.pi / 2.0)
    across = at_the_tip(beam, force=np.array([1.0, 0.0, 0.0]), **LINEAR).position[-1][0]
    along = at_the_tip(beam, force=np.array([0.0, 1.0, 0.0]), **LINEAR).position[-1][1]
    z = np.linspace(0.0, 12.0, 2401)
    share = np.sin(0.5 * np.pi * z / 12.0) ** 2
    shear = 12.0 / K[0, 0]
    for found, first, second in ((across, K[4, 4], K[3, 3]), (along, K[3, 3], K[4, 4])):
        bending = np.trapezoid((12.0 - z) ** 2 * ((1.0 - share) / first + share / second), z)
        assert found == pytest.approx(bending + shear, rel=1e-4)
    assert sorted([across, along]) == pytest.approx([0.001754, 0.005424], rel=5e-3)


@pytest.mark.long
def test_errors_fall_with_the_fourth_power_of_the_step() -> None:
    beam, force = uniform(BENDING, straight(1.0, 3), twist=0.8), np.array([6.0, 4.0, 2.0])
    none = np.zeros((3, 3))
    tips = [deflect(beam, DeadLoads(none, none, force, NONE), steps=n).position[-1] for n in (2, 4, 8, 32)]
    errors = [float(np.linalg.norm(tip - tips[-1])) for tip in tips[:-1]]
    assert all(12.0 < a / b < 22.0 for a, b in pairwise(errors)), errors


@pytest.mark.slow
def test_a_load_along_the_beam_is_the_sum_of_its_pieces() -> None:
    """A distributed load and couple against many tip loads at the ends of parts: root force and moment, balance."""
    beam = uniform(BENDING, straight(1.0, 21), twist=0.4)
    z = beam.position[:, None]
    force, moment = np.hstack([2.0 + z, -z, 0.0 * z]), np.hstack([0.0 * z, 0.3 + 0.0 * z, 0.1 * z])
    found = deflect(beam, DeadLoads(force, moment, np.array([0.0, 0.5, 0.0]), NONE))
    fine = np.linspace(0.0, 1.0, 2001)
    r = np.stack([np.interp(fine, beam.position, found.position[:, i]) for i in range(3)], axis=1)
    f, c = (np.stack([np.interp(fine, beam.position, a[:, i]) for i in range(3)], axis=1) for a in (force, moment))
    expected = np.trapezoid(np.cross(r, f) + c, fine, axis=0) + np.cross(r[-1], [0.0, 0.5, 0.0])
    np.testing.assert_allclose(found.root_moment, expected, atol=2e-3)
