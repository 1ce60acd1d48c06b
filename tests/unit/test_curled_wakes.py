"""Curled wakes: stream function against closed forms, transport and diffusion of the march, mirror symmetry
(docs/theory/wakes.md, K-19 to K-24)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from tests.unit.test_wakes import ROW, D, U, developed, rotor

from meltemi.maths.vectors import Vec
from meltemi_farm.curled import WIDE, Curled, CurledField
from meltemi_farm.field import between
from meltemi_farm.march import Mixing, age
from meltemi_farm.sets import SETS, disk_mean
from meltemi_farm.settings import WakeSettings
from meltemi_farm.wakes import FarmWakes, RotorState, mixing_of

Float = NDArray[np.float64]
PLAIN = WakeSettings(model="curled", added_turbulence=False)
SHAPE = Curled(SETS["curled"], D / 16.0 * np.arange(60), D)
SIDE = round(SHAPE.points**0.5)
NONE = Mixing.of(radius=0.5 * D, rotor_wide=1.0, gradient=1.0, slowest=1.0)
"""No mixing but the least one."""


def wakes_of(*planes: Float) -> FarmWakes:
    """A wake of some planes, a metre apart, along x."""
    wakes = developed(PLAIN, [rotor(0.0)], ROW[:1])
    wakes.count[0] = len(planes)
    for i, plane in enumerate(planes):
        wakes.profile[0, i] = plane
        wakes.planes["centre"][:, 0, i] = (float(i), 0.0, 90.0)
        wakes.planes["normal"][:, 0, i] = (1.0, 0.0, 0.0)
        wakes.planes["velocity"][:, 0, i] = 0.0
        wakes.planes["wind"][0, i], wakes.planes["intensity"][0, i] = U, 0.1
    return wakes


def at(plane: Float, y: float, z: float) -> Vec:
    """Velocity of the wake at a point of a plane [m]."""
    wakes = wakes_of(plane, plane)
    return between(Vec(0.5, y, 90.0 + z), 0.0, 0.5, wakes.fields[0], 0, 0).velocity


def inlet(*, skew: tuple[float, float] = (0.0, 0.0), driving: float = 0.0, shape: Curled = SHAPE) -> Float:
    """Plane behind a rotor in 10 m/s, of thrust coefficient 0.7."""
    inside = (shape.r > 0.0) & (shape.r <= 0.5 * D)
    load = np.array([np.where(inside, 0.7, 0.0), np.where(inside, driving, 0.0)])
    return shape.inlet({"load": load, "skew": np.array(skew), "ambient": 10.0}, 0.5 * D, 10.0)


def test_trailing_vortices_are_those_of_fast_farm() -> None:
    """Its own test: -0.217109 m/s to the left at (0, -1) m, -4.459746e-2 m/s up at (2, 1) m, of 100 vortices at a
    skew of 0.1 rad, turned by 0.2 rad."""
    shape = Curled(SETS["curled"], D / 60.0 * np.arange(150), D)
    plane = inlet(skew=(-np.sin(0.1) * np.cos(0.2), -np.sin(0.1) * np.sin(0.2)), shape=shape)
    share = disk_mean(shape.r, np.where((shape.r > 0.0) & (shape.r <= 0.5 * D), 1.0, 0.0), 0.5 * D)
    line = np.unique(shape.places[0])
    for component, expected, (y, z) in ((1, -0.217109, (0.0, -1.0)), (2, -4.459746e-2, (2.0, 1.0))):
        found = RegularGridInterpolator((line, line), plane[:, component].reshape(len(line), -1))([[z, y]])
        assert found == pytest.approx(expected * share, rel=0.005)


def test_swirl_is_against_the_rotor_and_conserves_its_moment() -> None:
    """Seen downwind the rotor turns clockwise, and the wake turns to the left above its centre."""
    plane, r = inlet(driving=0.05), 30.0
    for y, z in ((0.0, r), (r, 0.0), (0.0, -r), (-r, 0.0), (0.6 * r, 0.8 * r)):
        v = at(plane, y, z)
        a = 0.5 - 0.5 * np.sqrt(1.0 - 0.7)
        around = (v.y * z - v.z * y) / r
        assert around == pytest.approx(1.8 * 0.05 * 10.0 / (4.0 * (1.0 - a)), rel=0.03)  # points 7.9 m apart
        assert abs(v.y * y + v.z * z) / r < 0.01 * around


def aged(plane: Float, *, steps: int, dt: float, mixing: Mixing, along: Float, points: int = 1) -> Float:
    """A plane after some steps of time."""
    wakes = wakes_of(*[plane] * (steps + 1))
    work = np.empty((7, SHAPE.points))
    for i in range(steps):
        age(wakes.fields[0], 0, i, dt, 8.0 * dt, mixing, along, work)
    return np.asarray(wakes.profile[0, steps], dtype=np.float64)


def test_what_is_carried_across_is_not_lost() -> None:
    plane = inlet(skew=(-0.3, 0.1), driving=0.05)
    after = aged(plane, steps=10, dt=2.0, mixing=mixing_of(SETS["curled"], D), along=np.ones((4, 12)))
    assert after[:, 0].sum() == pytest.approx(plane[:, 0].sum(), rel=2e-3)
    y = SHAPE.places[0]
    first = 20.0 * (plane[:, 0] @ plane[:, 1]) / plane[:, 0].sum()  # way of its centroid, if it kept its shape
    assert (after[:, 0] @ y) / after[:, 0].sum() == pytest.approx(first, rel=0.15)


def test_a_velocity_across_carries_the_wake_with_it() -> None:
    """A uniform velocity of 2 m/s to the left, 1 m/s up for 10 s."""
    y, z, _ = SHAPE.places
    plane = np.zeros((SHAPE.points, 3))
    plane[:, 0] = -4.0 * np.exp(-(y**2 + z**2) / 40.0**2)
    plane[:, 1:] = 2.0, 1.0
    after = aged(plane, steps=5, dt=2.0, mixing=NONE, along=np.zeros((4, 7)))
    V = after[:, 0]
    assert (V @ y / V.sum(), V @ z / V.sum()) == pytest.approx((20.0, 10.0), abs=0.2)
    assert V.min() == pytest.approx(-4.0, rel=0.02)


def test_diffusion_is_that_of_the_closed_form() -> None:
    """A Gaussian deficit in a constant viscosity nu widens: width^2 = 40^2 + 4 nu t."""
    y, z, _ = SHAPE.places
    plane = np.zeros((SHAPE.points, 3))
    plane[:, 0] = -0.1 * np.exp(-(y**2 + z**2) / 40.0**2)
    mixing, t = Mixing.of(radius=0.5 * D, ambient=0.2, power=1.0, rotor_wide=1.0), 20.0
    nu = 0.2 * 0.1 * 0.5 * D * U
    after = aged(plane, steps=10, dt=2.0, mixing=mixing, along=np.array([[1.0] * 12, *[[0.0] * 12] * 3]))
    expected = -0.1 * 40.0**2 / (40.0**2 + 4.0 * nu * t)
    assert after[:, 0].min() == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("yaw", [20.0, -20.0])
def test_a_yawed_rotor_pushes_its_wake_aside_and_curls_it(yaw: float) -> None:
    wakes = developed(PLAIN, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2])
    x, y, *_ = wakes.paths()[0]
    aside = float(np.interp(5.0 * D, x, y))
    assert -0.6 * D < np.sign(yaw) * aside < -0.1 * D
    i = int(np.argmin(np.abs(x - 6.0 * D)))
    V = wakes.profile[0, i, :, 0].reshape(SIDE, SIDE)
    deep = V[[SIDE // 2 - 7, SIDE // 2, SIDE // 2 + 7]] ** 4  # 55 m below the hub, at its height, 55 m above
    low, middle, high = -np.sign(yaw) * (deep @ np.unique(SHAPE.places[0])) / deep.sum(axis=1)
    assert middle - 0.015 * D > max(low, high) > 0.0  # furthest aside in the middle: the kidney's shape


def test_a_wake_without_swirl_is_the_mirror_image_of_that_of_the_opposite_yaw() -> None:
    left, right = (
        developed(PLAIN, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2]).profile[0, 30, :, 0].reshape(SIDE, SIDE)
        for yaw in (20.0, -20.0)
    )
    upside = left[::-1, ::-1]  # the vortices that are counted are not symmetric about the axis, but about its turn
    assert np.abs(left).max() > 1.0
    assert np.allclose(upside, right, atol=2e-3)


def test_a_rotor_sees_the_velocity_across_of_the_wake_before() -> None:
    found = []
    for yaw in (0.0, 20.0):
        wakes = developed(PLAIN, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2])
        found.append(wakes.rotor_wind(1, rotor(), 0.0)[0])
    assert abs(found[0][1]) < 0.02 < -found[1][1]


def test_planes_reach_beyond_the_averages_of_rotors() -> None:
    assert CurledField is SHAPE.field
    assert SHAPE.reach == pytest.approx(WIDE * D, abs=0.03 * D)
    assert isinstance(rotor(), RotorState)
