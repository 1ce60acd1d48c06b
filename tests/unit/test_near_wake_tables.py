"""Tables of the coupled near wake: arcs in closed form, their build-up with age, vortex cylinders behind the rotor."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.vortex.near_wake import AGES, QUARTER, arc_velocity, cylinder_velocity, cylinders, reach

Float = NDArray[np.float64]
BEDDOES = {0.02: 0.97, 0.1: 0.93, 0.3: 0.96, -0.05: 1.06, -0.2: 1.11, -0.5: 1.05, -1.0: 0.78}
"""Beddoes' quarter turn over the exact one, by the distance from the vortex inwards over its radius."""


def arc(h: float, azimuth: float = QUARTER, lead: float = 0.0) -> tuple[float, float]:
    """Axial velocity upwind and tangential velocity, by quadrature of Biot and Savart's law for a helix of radius 1.

    Args:
      h: distance of the point from the vortex, inwards.
      lead: advance of the helix along the axis by angle.
    """
    ages = np.concatenate([[0.0], np.geomspace(1e-4 * abs(h), azimuth, 4000)])
    middle, half = 0.5 * (ages[1:] + ages[:-1]), np.diff(ages) / (2.0 * np.sqrt(3.0))
    axial = tangential = 0.0
    for sign in (-1.0, 1.0):
        b = middle + sign * half
        along = np.array([np.full_like(b, lead), -np.cos(b), -np.sin(b)])  # the blade turns towards the second axis
        away = np.array([-lead * b, np.sin(b), 1.0 - h - np.cos(b)])
        u = np.cross(along, away, axis=0) / (4.0 * np.pi * np.linalg.norm(away, axis=0) ** 3)
        axial += float((u[0] * 0.5 * np.diff(ages)).sum())
        tangential += float((u[1] * 0.5 * np.diff(ages)).sum())
    return axial, tangential


@pytest.mark.parametrize("h", [0.004, 0.02, 0.1, 0.3, 0.6, 0.95, -0.004, -0.05, -0.5, -1.0, -9.0])
def test_an_arc_has_the_velocity_of_its_quadrature(h: float) -> None:
    for azimuth in (0.01, 0.3, QUARTER):
        exact = arc_velocity(np.array(1.0), np.array(1.0 - h), np.array(azimuth))
        assert exact == pytest.approx(arc(h, azimuth)[0], rel=2e-6)
    assert np.sign(exact) == np.sign(h)  # a tip vortex slows the air inside and speeds it up outside


def test_the_published_approximation_differs_by_a_few_percent() -> None:
    """Exponentials of Beddoes with the constants 1.359 and -0.359 and the factor of 4, over the closed form."""
    for h, ratio in BEDDOES.items():
        p = 0.25 * np.pi * abs((1.0 + 0.5 * h) * np.log(1.0 - h))
        beddoes = p * (1.359 - 0.359 / 4.0) / (4.0 * np.pi * h * abs(h))
        exact = arc_velocity(np.array(1.0), np.array(1.0 - h), np.array(QUARTER))
        assert beddoes / exact == pytest.approx(ratio, abs=0.011)


@pytest.mark.parametrize("lead", [0.05, 0.1, 0.2, 0.5])
def test_a_helix_has_the_arc_s_velocity_turned_by_its_angle(lead: float) -> None:
    """Axial velocity times the cosine; tangential over axial velocity is its tangent: to 2 and 3 % near the vortex."""
    for h in (0.02, 0.1, -0.02, -0.1):
        axial, tangential = arc(h, lead=lead)
        flat = float(arc_velocity(np.array(1.0), np.array(1.0 - h), np.array(QUARTER)))
        assert axial == pytest.approx(flat / np.hypot(1.0, lead), rel=0.035 * min(1.0, 2.0 * lead) + 1e-3)
        assert abs(tangential / axial) == pytest.approx(lead, rel=0.03)


def test_the_states_build_up_the_velocity_of_an_arc() -> None:
    """The steady value is exact; before, the error is 4 % of it near a vortex and 13 % far away, where it is small."""
    inside = np.array([0.99, 0.95, 0.9, 0.7, 0.4, 1.01, 1.05, 1.2])
    table = reach(np.array([1.0]), inside)[:, 0]
    for i, point in enumerate(inside):
        steady = arc_velocity(np.array(1.0), np.array(point), np.array(QUARTER))
        assert table[:, i].sum() == pytest.approx(steady, rel=1e-12)
        ages = np.geomspace(2e-3, QUARTER, 300)
        build_up = (1.0 - np.exp(-ages[:, None] / AGES)) @ table[:, i]
        error = np.abs(build_up - arc_velocity(np.array(1.0), np.array(point), ages)).max() / abs(steady)
        assert error < (0.045 if 0.6 < point < 1.3 else 0.09)


def test_cylinders_have_known_velocities() -> None:
    """In closed form: Branlard & Gaunaa (2015) at r = 0.5 and 1 radius ahead; on the axis; in the plane of the end."""
    one = np.array([1.0])
    assert cylinder_velocity(one, np.array([0.5]), 1.0)[0] == pytest.approx(0.13027656, abs=1e-8)
    on_the_axis = 0.5 * (1.0 - 0.7 / np.hypot(1.0, 0.7))
    assert cylinder_velocity(one, np.array([1e-9]), 0.7)[0] == pytest.approx(on_the_axis, rel=1e-12)
    assert cylinder_velocity(one, np.array([0.8]), 1e-3)[0] == pytest.approx(0.5, abs=2e-3)
    assert cylinder_velocity(one, np.array([1.25]), 1e-3)[0] == pytest.approx(0.0, abs=2e-3)


def test_the_far_wake_begins_as_momentum_and_smooths_it_downstream() -> None:
    edges = np.linspace(2.0, 60.0, 21)
    table = cylinders(edges, 0.5 * (edges[1:] + edges[:-1]), 60.0)
    np.testing.assert_array_equal(table[0], np.eye(20))
    uniform = table.sum(axis=1)  # the velocity at each node for the same velocity in all annuli
    assert np.all(np.diff(uniform[:, :12], axis=0) < 0.0) and np.all(uniform[-1] == 0.0)
    assert 0.8 < uniform[4, 10] < 0.95 and uniform[4, -1] < 0.7 * uniform[4, 10]  # less at the edge than in the middle
    assert table[4, 10, 10] < 0.7 and table[4, 10, 11] > 0.05
