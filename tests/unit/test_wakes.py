"""Wakes alone: the march against tables of other codes, momentum, a closed form, merging (docs/theory/wakes.md)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from meltemi.core.errors import InputError
from meltemi.farm.averages import observe
from meltemi.farm.curled import Curled
from meltemi.farm.field import between
from meltemi.farm.march import Mixing, age, half_width, one_step, totals, viscosity
from meltemi.farm.release import load_coefficients
from meltemi.farm.sets import (
    FINE_RINGS,
    SETS,
    WakeSet,
    average_points,
    disk_mean,
    fast_farm_inlet,
    jinc,
    quadrature_error,
    smooth_filter,
)
from meltemi.farm.settings import WakeSettings
from meltemi.farm.wakes import FarmWakes, RotorState, mixing_of
from meltemi.loads.effective import effective_intensity, farm_turbulence, wake_turbulence
from meltemi.maths.vectors import Vec
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]
D, U = 126.0, 8.0
PLACES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15)
CENTRE = {
    (0.8, 0.06): (0.498, 0.498, 0.497, 0.496, 0.481, 0.450, 0.415, 0.379, 0.345, 0.289, 0.244, 0.196),
    (0.8, 0.10): (0.498, 0.497, 0.496, 0.488, 0.458, 0.416, 0.376, 0.338, 0.304, 0.252, 0.212, 0.170),
    (0.8, 0.14): (0.498, 0.497, 0.493, 0.475, 0.432, 0.383, 0.342, 0.304, 0.272, 0.223, 0.187, 0.150),
    (0.4, 0.10): (0.203, 0.203, 0.203, 0.201, 0.192, 0.177, 0.161, 0.145, 0.132, 0.110, 0.093, 0.076),
}
"""Centre deficit over the wind by thrust coefficient and turbulence intensity: an independent march of FAST.Farm's
equations, radial step 5 m, steps of 8 m."""
JDWM_PLACES = (2, 3, 4, 5, 6, 7, 8, 10, 12, 15)
JDWM = {
    ("iec", 0.06): (0.554, 0.511, 0.440, 0.382, 0.338, 0.305, 0.278, 0.235, 0.202, 0.169),
    ("iec", 0.14): (0.552, 0.496, 0.414, 0.353, 0.309, 0.277, 0.251, 0.210, 0.180, 0.150),
    ("madsen", 0.06): (0.533, 0.493, 0.456, 0.423, 0.394, 0.367, 0.344, 0.298, 0.260, 0.221),
    ("madsen", 0.14): (0.487, 0.419, 0.369, 0.330, 0.300, 0.275, 0.254, 0.219, 0.191, 0.162),
    ("keck", 0.06): (0.542, 0.470, 0.393, 0.332, 0.287, 0.253, 0.227, 0.190, 0.165, 0.139),
    ("keck", 0.14): (0.486, 0.393, 0.321, 0.271, 0.234, 0.207, 0.186, 0.155, 0.134, 0.112),
}
"""Mean deficit over the rotor disk, over the wind, of jDWM 0.8 (DTU Wind Energy), thrust coefficient 0.8."""


def steady_wake(
    model: WakeSet,
    thrust: float | Float,
    intensity: float,
    *,
    speed: float,
    diameter: float,
    length: float,
    spacing: float,
    way: float,
    points: int = 60,
) -> tuple[Float, Float, Float, Float]:
    """Profiles along a wake that does not meander, in uniform steady wind.

    Args:
      model: set of constants.
      thrust: thrust coefficient, uniform over the rotor or at each point of the profile.
      intensity: ambient turbulence intensity.
      speed: [m/s] wind.
      diameter: [m] of the rotor.
      length: [m] of the wake.
      spacing: [m] between the points of a profile.
      way: [m] between profiles.
      points: of a profile.

    Returns:
      Distances (X,) and radii (R,) [m], axial and radial velocities (X, R) [m/s] of the wake.
    """
    r, radius = spacing * np.arange(points, dtype=np.float64), 0.5 * diameter
    local = np.where(r <= radius, thrust, 0.0)
    steps = math.ceil(length / way - 1e-9)
    x = way * np.arange(steps + 1, dtype=np.float64)
    V, Vr = np.zeros((steps + 1, points)), np.zeros((steps + 1, points))
    V[0] = model.inlet(r, local, radius, speed)
    along, constants = model.filters(x / diameter), mixing_of(model, diameter)
    nu, work = np.empty(points), np.empty(points)
    for i in range(steps):
        viscosity(V[i], speed, intensity, along[0, i], along[1, i], spacing, constants, nu)
        one_step(V[i], Vr[i], nu, speed, way, spacing, V[i + 1], Vr[i + 1], work)
    return x, r, V, Vr


def at(x: Float, profiles: Float, place: float) -> Float:
    i = min(int(place / (x[1] - x[0])), len(x) - 2)
    w = place / (x[1] - x[0]) - i
    result: Float = (1.0 - w) * profiles[i] + w * profiles[i + 1]
    return result


@pytest.mark.parametrize(("thrust", "intensity"), CENTRE)
def test_march_has_the_deficits_of_an_independent_one(thrust: float, intensity: float) -> None:
    x, r, V, _ = steady_wake(
        SETS["fast.farm"], thrust, intensity, speed=U, diameter=D, length=15.0 * D, spacing=5.0, way=8.0
    )
    found = [-at(x, V, place * D)[0] / U for place in PLACES]
    assert np.allclose(found, CENTRE[thrust, intensity], atol=0.002)
    momentum = 2.0 * np.pi * np.sum(r * -V * (U + V), axis=1) * 5.0
    assert np.allclose(momentum[16:], momentum[16], rtol=2e-3)
    assert momentum[16] == pytest.approx(momentum[0], rel=0.012)
    if thrust == 0.8:
        assert momentum[0] == pytest.approx(2.883e5, rel=1e-3)


@pytest.mark.parametrize(("name", "intensity"), JDWM)
def test_sets_of_the_iec_family_have_the_deficits_of_jdwm(name: str, intensity: float) -> None:
    """jDWM writes 2**pi for 2 pi in the IEC filter; Keck's mixing length needs a coarser profile, and jDWM leaves the
    gradient of the viscosity out, by which it does not conserve momentum."""
    model, points, tolerance = SETS[name], 401, 0.0025
    if name == "iec":

        def typed(x: Float) -> Float:
            y = np.clip(x / 4.0, 0.0, 1.0) ** 1.5
            return np.where(x >= 4.0, 1.0, y - np.sin(2.0 * np.pi * y) / 2.0**np.pi)

        model = replace(model, ambient_filter=typed)
    if name == "keck":
        points, tolerance = 101, 0.01
    spacing = 2.0 * D / (points - 1)
    _, r, V, _ = steady_wake(
        model, 0.8, intensity, speed=U, diameter=D, length=15.0 * D, spacing=spacing, way=0.025 * D, points=points
    )
    found = [disk_mean(r, -V[round(place * 40)], 0.5 * D) / U for place in JDWM_PLACES]
    assert np.allclose(found, JDWM[name, intensity], atol=tolerance)


def test_small_deficits_diffuse_as_in_the_closed_form() -> None:
    """At small thrust with a constant viscosity the deficit is the diffusion of a disk: at the centre
    1 - exp(-R^2 / (4 nu x / U))."""
    model = replace(SETS["fast.farm"], shear=0.0, ambient_filter=np.ones_like)
    x, _, V, _ = steady_wake(
        model, 1e-4, 0.3, speed=U, diameter=D, length=20.0 * D, spacing=D / 100.0, way=2.0, points=400
    )
    spread = 4.0 * 0.05 * 0.3 * 0.5 * D * x[200:]
    expected = V[0, 0] * (1.0 - np.exp(-((0.5 * D) ** 2) / spread))
    assert np.allclose(V[200:, 0], expected, rtol=0.02)


def test_high_thrust_has_a_gaussian_inlet() -> None:
    r = np.arange(0.0, 200.0, 5.0)
    V = fast_farm_inlet(r, np.full_like(r, 1.4), 63.0, 10.0)
    assert V[0] == pytest.approx(-10.0 * (0.3 / (2.0 * 1.4**2 - 1.0) + 0.2), rel=1e-3)
    assert np.all(np.diff(V) > 0.0)
    assert np.all(np.isfinite(fast_farm_inlet(r, np.full_like(r, 5.0), 63.0, 10.0)))


def test_half_width_encloses_most_of_a_disk() -> None:
    V = np.where(np.arange(100) <= 50, -1.0, 0.0)
    assert half_width(V, 1.0) == pytest.approx(np.sqrt(0.95) * 50.0, abs=1.0)


def test_filters_begin_and_end_as_the_standard_has_them() -> None:
    assert np.allclose(smooth_filter(np.array([0.0, 4.0, 9.0])), [0.0, 1.0, 1.0])
    x, model = np.array([0.0, 3.0, 25.0]), SETS["fast.farm"]
    assert np.allclose(model.filters(x)[:, [0, 2]], [[1.0, 1.0], [0.2, 1.0]])
    assert np.allclose(model.added(x)[:, [0, 2]], [[0.0, 0.6], [0.0, 3.0]])


@pytest.mark.parametrize("name", SETS)
def test_averages_of_drift_have_their_diameter(name: str) -> None:
    points, model = average_points(SETS[name], D, 12), SETS[name]
    reach = np.hypot(points[:, 0], points[:, 1]).max()
    assert reach == pytest.approx((1.11657 if model.windowed else 0.5) * model.meander * D, rel=0.05)
    assert np.allclose(points[:, :2].T @ points[:, 2], 0.0, atol=1e-6 * points[:, 2].sum())


@pytest.mark.parametrize("rings", [8, 16, 32])
def test_what_points_miss_of_a_wake_is_added_to_their_average(rings: int) -> None:
    """The wake of a rotor with a sharp edge, against the closed form of the integral, a sum over 20,000 radii."""
    model, r = SETS["fast.farm"], 5.0 * np.arange(60, dtype=np.float64)
    profile = np.where(r <= 70.0, -4.0 + 2.0 * np.cos(r / 20.0), 0.0)
    points = average_points(model, D, rings)
    exact = average_points(model, D, FINE_RINGS)
    fine = np.linspace(1e-6, 0.5 * 7.015586669815619 / np.pi * 1.9 * D, 20001)
    weight = fine * np.array([jinc(x / (1.9 * D)) * jinc(x / (3.8 * D)) for x in fine])
    expected = np.sum(weight * np.interp(fine, r, profile)) / weight.sum()
    plain = points[:, 2] @ np.interp(np.hypot(points[:, 0], points[:, 1]), r, profile) / points[:, 2].sum()
    found = plain + quadrature_error(points, exact, r) @ profile / points[:, 2].sum()
    assert found == pytest.approx(expected, rel=2e-4)
    assert abs(plain / expected - 1.0) > 10.0 * abs(found / expected - 1.0)


def test_planes_are_shown_as_they_are_half_a_step_on() -> None:
    wakes = developed(PLAIN, [rotor()], ROW[:1])
    n, before = int(wakes.count[0]), wakes.profile[0].copy()
    wakes.exchange(0, rotor(), 2.0, wakes.along()[0])
    # an observer that stands across the wake sees all of its planes
    axis, one = Vec(0.0, 1.0, 0.0), np.ones(1, dtype=np.int64)
    seen = wakes.observers[0]
    observe(seen, 2.0, wakes.count, one, Vec(800.0, 0.0, 90.0), axis, 3e3, 15.0, 15.0, wakes.profile)
    halfway = 0.5 * (before[: n - 1] + wakes.profile[0, 1:n])  # the rotor is steady: a plane becomes its neighbour
    assert np.allclose(wakes.shown[0, 1 : n - 2], halfway[1 : n - 2], atol=1e-3)
    assert np.abs(before[: n - 1] - halfway).max() > 0.05


def rotor(thrust: float = 0.8, *, yaw: float = 0.0, speed: float = U) -> RotorState:
    r = np.linspace(1.0, 63.0, 30)
    axis = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    load = np.array([1.225 * np.pi * r * thrust * max(speed * np.cos(yaw), 1.0) ** 2, 0.0 * r])
    return RotorState(np.array([0.0, 0.0, 90.0]), axis, np.array([speed, 0.0, 0.0]), r, load, 1.225)


def developed(settings: WakeSettings, rotors: list[RotorState], places: Float, speed: float = U) -> FarmWakes:
    n, wind = len(places), SteadyWind(speed=speed)
    wakes = FarmWakes(settings, wind, places, [D] * n, [90.0] * n, wind, 2.0)
    wakes.develop(lambda i, share: rotors[i], lambda f: [f(i) for i in range(n)])
    return wakes


PLAIN = WakeSettings(added_turbulence=False)
ROW = np.array([[0.0, 0.0], [5.0 * D, 0.0], [10.0 * D, 0.0]])


def test_a_rotor_sees_the_wake_of_the_one_before_but_not_its_own() -> None:
    wakes = developed(PLAIN, [rotor()] * 2, ROW[:2])
    first, second = (wakes.rotor_wind(i, rotor(), 0.0)[0][0] for i in range(2))
    assert first == pytest.approx(U, abs=1e-9)
    _, r, V, _ = steady_wake(SETS["fast.farm"], 0.8, 0.0, speed=U, diameter=D, length=5.0 * D, spacing=5.0, way=10.0)
    assert second - U == pytest.approx(V[-1, r <= 0.5 * D].mean(), rel=0.03)


@pytest.mark.parametrize("name", SETS)
def test_a_positive_yaw_angle_pushes_the_wake_to_the_right(name: str) -> None:
    wakes = developed(PLAIN.replace(model=name), [rotor(yaw=np.radians(20.0)), rotor()], ROW[:2])
    x, y = wakes.paths()[0][:2]
    assert -0.6 * D < np.interp(5.0 * D, x, y) < -0.1 * D


def test_merging_orders_as_its_names_say() -> None:
    found = {}
    for merging in ("quadratic", "linear", "largest"):
        wakes = developed(PLAIN.replace(merging=merging), [rotor()] * 3, ROW)
        found[merging] = U - wakes.rotor_wind(2, rotor(), 0.0)[0][0]
    assert found["linear"] > 1.05 * found["quadratic"] > 1.1 * found["largest"]


@pytest.mark.parametrize("name", ["fast.farm", "curled"])
def test_rotors_at_rest_or_in_wind_from_behind_or_from_the_side_leave_finite_wakes(name: str) -> None:
    still, behind, beside = rotor(0.0), rotor(speed=-5.0), rotor(yaw=np.radians(80.0))
    for state in (still, behind, beside):
        wakes = developed(PLAIN.replace(model=name), [state, rotor()], ROW[:2])
        assert np.all(np.isfinite(wakes.profile))
        assert np.isfinite(wakes.rotor_wind(1, rotor(), 0.0)).all()


def test_planes_that_catch_up_are_dropped() -> None:
    wakes = developed(PLAIN, [rotor()] * 2, ROW[:2])
    wakes.planes["velocity"][0, 0, 3] = 30.0  # a gust carries one plane past those ahead
    before = int(wakes.count[0])
    wakes.exchange(0, rotor(), 2.0, wakes.along()[0])
    assert wakes.crossed > 0
    assert wakes.count[0] <= before
    x = wakes.planes["centre"][0, 0, : wakes.count[0]]
    assert np.all(np.diff(x) > 0.0)


def test_a_uniform_wake_is_drawn_as_it_is() -> None:
    """Of a top hat deficit and radius are its own, also of one that is cut off the plane's centre."""
    wakes = developed(PLAIN, [rotor(0.0)], ROW[:1])
    wakes.count[0] = 2
    inside = wakes.shape.r < 57.0
    wakes.profile[0, :2, :, 0] = np.outer([-1.0, -3.0], inside)
    for i in range(2):
        totals(wakes.fields[0], 0, i)
    last = wakes.shape.r[inside][-1]
    *_, deficit, radius = wakes.paths()[0]
    assert deficit == pytest.approx([1.0, 3.0])
    assert radius == pytest.approx([np.sqrt(last * (last + wakes.shape.r[1]))] * 2)


def test_a_curled_wake_is_drawn_about_its_centroid() -> None:
    y, z, _ = SHAPE.places
    plane = np.zeros((SHAPE.points, 3))
    plane[:, 0] = np.where(np.hypot(y - 20.0, z + 10.0) < 60.0, -2.0, 0.0)
    wakes = wakes_of(plane, 0.5 * plane)
    x, left, up, *_, deficit, radius = wakes.paths()[0]
    assert x == pytest.approx([0.0, 1.0])
    assert left == pytest.approx([20.0, 20.0], abs=1.0)
    assert up == pytest.approx([80.0, 80.0], abs=1.0)
    assert deficit == pytest.approx([2.0, 1.0])
    assert radius == pytest.approx([60.0, 60.0], rel=0.03)


# curled wakes (K-19 to K-24)

CURLED = WakeSettings(model="curled", added_turbulence=False)
SHAPE = Curled(SETS["curled"], D / 16.0 * np.arange(60), D)
SIDE = round(SHAPE.points**0.5)
NONE = Mixing.of(radius=0.5 * D, rotor_wide=1.0, gradient=1.0, slowest=1.0)
"""No mixing but the least one."""


def wakes_of(*planes: Float) -> FarmWakes:
    """A wake of some planes, a metre apart, along x."""
    wakes = developed(CURLED, [rotor(0.0)], ROW[:1])
    wakes.count[0] = len(planes)
    for i, plane in enumerate(planes):
        wakes.profile[0, i] = plane
        wakes.planes["centre"][:, 0, i] = (float(i), 0.0, 90.0)
        wakes.planes["normal"][:, 0, i] = (1.0, 0.0, 0.0)
        wakes.planes["velocity"][:, 0, i] = 0.0
        wakes.planes["wind"][0, i], wakes.planes["intensity"][0, i] = U, 0.1
        totals(wakes.fields[0], 0, i)
    wakes.planes["fastest"][0] = np.abs(wakes.profile[0, ..., 1:]).sum(axis=2).max(axis=1)
    return wakes


def velocity_at(plane: Float, y: float, z: float) -> Vec:
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
        v = velocity_at(plane, y, z)
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


def test_eddies_of_curled_wakes_follow_deficit_and_slopes() -> None:
    """Of a Gaussian deficit, K-14 with factors of 0.5 s/m and 3 s, at the radius of its width."""
    r = SHAPE.places[2]
    plane = np.zeros((SHAPE.points, 3))
    plane[:, 0] = -4.0 * np.exp(-(r**2) / 40.0**2)
    wakes = wakes_of(plane, plane)
    wakes.planes["eddies_deficit"][0, :2], wakes.planes["eddies_slope"][0, :2] = 0.5, 3.0
    point = Vec(0.5, 24.0, 90.0 + 32.0)
    assert between(point, 0.0, 0.5, wakes.fields[0], 0, 0).turbulence == 0.0
    wakes.fields[0].wakes.added = 1.0
    expected = (0.5 + 3.0 * 2.0 / 40.0) * 4.0 * np.exp(-1.0)
    assert between(point, 0.0, 0.5, wakes.fields[0], 0, 0).turbulence == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("yaw", [20.0, -20.0])
def test_a_yawed_rotor_pushes_its_wake_aside_and_curls_it(yaw: float) -> None:
    wakes = developed(CURLED, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2])
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
        developed(CURLED, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2]).profile[0, 30, :, 0].reshape(SIDE, SIDE)
        for yaw in (20.0, -20.0)
    )
    upside = left[::-1, ::-1]  # the vortices that are counted are not symmetric about the axis, but about its turn
    assert np.abs(left).max() > 1.0
    assert np.allclose(upside, right, atol=2e-3)


def test_a_rotor_sees_the_velocity_across_of_the_wake_before() -> None:
    found = []
    for yaw in (0.0, 20.0):
        wakes = developed(CURLED, [rotor(yaw=np.radians(yaw)), rotor()], ROW[:2])
        found.append(wakes.rotor_wind(1, rotor(), 0.0)[0])
    assert abs(found[0][1]) < 0.02 < -found[1][1]


def test_effective_turbulence_has_the_formulas_of_both_editions() -> None:
    """By hand: V 10 m/s, sigma 1 m/s, d 5, C_T 0.8: 10 / (1.5 + 4 / 0.8944) = 1.6744 and hypot 1.9503;
    edition 3: 9.48683 / (1.5 + 1.5 * 3.16228) = 1.51949."""
    assert wake_turbulence(10.0, 1.0, 5.0, 0.8) == pytest.approx(1.9503, abs=1e-4)
    assert wake_turbulence(10.0, 1.0, 5.0, edition=3) == pytest.approx(np.hypot(1.51949, 1.0), abs=1e-4)
    assert effective_intensity(10.0, 0.1, [], slope=10.0) == pytest.approx(0.1)
    assert effective_intensity(10.0, 0.1, [12.0], slope=10.0) == pytest.approx(0.1)
    eight = effective_intensity(10.0, 0.1, [5.0] * 8, slope=4.0, thrust=0.8)
    assert eight == pytest.approx((0.52 + 0.48 * 1.9503**4) ** 0.25 / 10.0, rel=1e-4)
    assert 0.1 < eight < effective_intensity(10.0, 0.1, [5.0] * 8, slope=10.0, thrust=0.8) < 0.195
    assert farm_turbulence(10.0, 1.0, 5.0, 5.0, 0.8) == pytest.approx(0.5 * (1.0 + np.hypot(1.7, 1.0)), rel=2e-3)


def test_effective_turbulence_refuses_what_it_has_no_formula_for() -> None:
    with pytest.raises(InputError, match="edition 4 needs a positive thrust coefficient"):
        wake_turbulence(10.0, 1.0, 5.0)
    with pytest.raises(InputError, match="at least 2 diameters"):
        wake_turbulence(10.0, 1.0, 1.0, 0.8)
    with pytest.raises(InputError, match="at most 8 neighbours, found 9"):
        effective_intensity(10.0, 0.1, [5.0] * 9, slope=4.0, thrust=0.8)


def test_the_load_on_a_profile_keeps_its_sum_and_first_moment() -> None:
    """A load that ends between two points, as at the tip of a blade."""
    spacing, ends = 5.04, 62.9
    r, local = spacing * np.arange(60), np.empty((2, 60))
    x = np.array([0.0, 20.0, ends])
    load_coefficients(x, np.array([50.0 * x, -50.0 * x]), spacing, 1e3, 1.0 / np.pi, 50.0, local)
    assert np.allclose(local[0, :10], -local[1, :10])
    found = -(50.0**2) * r * local[1]  # thrust is cut off below zero, where the projection overshoots beyond the tip
    for moment in (0, 1):
        exact = 50.0 * ends ** (moment + 2) / (moment + 2)
        assert np.trapezoid(found * r**moment, r) == pytest.approx(exact, rel=2e-3)
    assert found[5] == pytest.approx(50.0 * r[5], rel=2e-3)  # linear loads are kept as they are


def test_loads_may_lie_in_memory_in_any_order() -> None:
    """Sorted by radius they do not lie row by row."""
    state = rotor()
    turned = replace(state, load=np.asfortranarray(state.load))
    r = 5.04 * np.arange(60)
    assert np.array_equal(turned.coefficients(r, 63.0, U), state.coefficients(r, 63.0, U))
