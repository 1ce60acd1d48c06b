"""Wind velocity at a point and time, against formulas by hand.

Frames: x downwind for direction 0, y to the left, z up; a positive direction blows towards -y.
"""

from __future__ import annotations

from math import cos, log, radians, sin, tan
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meltemi.maths.vectors import Vec
from meltemi.wind.fields import (
    SharedTurbulence,
    SteadyWind,
    Wind,
    WindBox,
    WindSeries,
    mean_before,
    mean_speed,
    unit_turbulence,
    wind_field,
)
from meltemi.wind.velocity import WindNow, series_now, wind_velocity

HUB, DIAMETER = 90.0, 126.0
SINGLE = 2e-6 if numba.config.DISABLE_JIT else 1e-12
"""Relative: boxes are stored in single precision; without compilation NumPy computes in it, too."""
steady = settings(derandomize=True, deadline=None, max_examples=100)


def velocity(wind: Wind, p: tuple[float, float, float], t: float = 0.0) -> Vec:
    field = wind_field(wind, HUB, DIAMETER)
    series_now(t, field)
    return wind_velocity(Vec(*p), t, field)


@steady
@given(z=st.floats(0.5, 300.0), exponent=st.floats(-0.3, 0.5), reference=st.floats(10.0, 150.0))
def test_power_law(z: float, exponent: float, reference: float) -> None:
    wind = SteadyWind(speed=11.0, shear_exponent=exponent, reference_height=reference)
    u, v, w = velocity(wind, (5.0, -7.0, z))
    assert u == pytest.approx(11.0 * (z / reference) ** exponent, rel=1e-13)  # exp(a log x) against a power
    assert (v, w) == (0.0, 0.0)


def test_the_reference_height_is_the_hub_unless_given() -> None:
    assert velocity(SteadyWind(speed=8.0, shear_exponent=0.2), (0.0, 0.0, HUB)).x == pytest.approx(8.0, rel=1e-15)


@steady
@given(z=st.floats(0.5, 300.0), roughness=st.floats(1e-4, 0.4), reference=st.floats(10.0, 150.0))
def test_logarithmic_law(z: float, roughness: float, reference: float) -> None:
    wind = SteadyWind(speed=9.0, roughness=roughness, shear_exponent=0.3, reference_height=reference)
    u = velocity(wind, (0.0, 0.0, z)).x
    assert u == pytest.approx(9.0 * log(z / roughness) / log(reference / roughness), rel=1e-12)


def test_no_wind_below_the_roughness_length() -> None:
    assert velocity(SteadyWind(speed=9.0, roughness=0.5), (0.0, 0.0, 0.3)).x == 0.0


@pytest.mark.parametrize("z", [0.0, -5.0])
def test_points_in_the_ground_have_finite_wind(z: float) -> None:
    for wind in (SteadyWind(speed=9.0, shear_exponent=0.2), SteadyWind(speed=9.0, shear_exponent=-0.2)):
        assert np.isfinite([*velocity(wind, (0.0, 0.0, z))]).all()


@steady
@given(
    z=st.floats(10.0, 200.0),
    direction=st.floats(-3.1, 3.1),
    veer=st.floats(-0.01, 0.01),
    upflow=st.floats(-0.3, 0.3),
)
def test_direction_veer_and_upflow(z: float, direction: float, veer: float, upflow: float) -> None:
    wind = SteadyWind(speed=10.0, shear_exponent=0.14, direction=direction, veer=veer, upflow=upflow)
    u, v, w = velocity(wind, (3.0, 4.0, z))
    horizontal = 10.0 * (z / HUB) ** 0.14
    turned = direction + veer * (z - HUB)
    assert u == pytest.approx(horizontal * cos(turned), abs=1e-12)
    assert v == pytest.approx(-horizontal * sin(turned), abs=1e-12)
    assert w == pytest.approx(horizontal * tan(upflow), abs=1e-12)


def test_a_positive_direction_blows_to_the_right_looking_downwind() -> None:
    u, v, _ = velocity(SteadyWind(speed=10.0, direction=radians(30.0)), (0.0, 0.0, HUB))
    assert (u, v) == (pytest.approx(10.0 * cos(radians(30.0))), pytest.approx(-5.0))


def series(**columns: Any) -> WindSeries:
    """A series with zeros where nothing is given."""
    n = len(columns["time"])
    names = "speed direction vertical horizontal_shear exponent vertical_shear gust".split()
    return WindSeries(**{name: np.zeros(n) for name in names} | columns)


def test_a_series_is_linear_between_rows_and_constant_outside() -> None:
    wind = series(time=[1.0, 2.0, 4.0], speed=[10.0, 14.0, 6.0])
    for t, expected in ((-9.0, 10.0), (1.0, 10.0), (1.25, 11.0), (2.0, 14.0), (3.0, 10.0), (4.0, 6.0), (99.0, 6.0)):
        assert velocity(wind, (0.0, 0.0, HUB), t).x == pytest.approx(expected, rel=1e-15)


@steady
@given(t=st.floats(-1.0, 11.0), seed=st.integers(0, 1000))
def test_every_column_is_interpolated_like_numpy_does(t: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns = dict(zip(WindNow.names, rng.standard_normal((8, 17)), strict=True))
    columns["time"] = np.sort(rng.uniform(0.0, 10.0, 17))
    field = wind_field(WindSeries(**columns), HUB, DIAMETER)
    series_now(t, field)
    for name in WindNow.names[1:]:
        expected = np.interp(t, columns["time"], columns[name])
        assert getattr(field.now, name) == pytest.approx(expected, abs=1e-12)


def test_a_single_row_is_constant() -> None:
    wind = series(time=[5.0], speed=[7.0])
    assert [velocity(wind, (0.0, 0.0, HUB), t).x for t in (0.0, 5.0, 9.0)] == [7.0, 7.0, 7.0]


@steady
@given(x=st.floats(-60.0, 60.0), y=st.floats(-60.0, 60.0), z=st.floats(20.0, 160.0), direction=st.floats(-1.5, 1.5))
def test_shears_and_gust_of_a_series(x: float, y: float, z: float, direction: float) -> None:
    wind = series(
        time=[0.0],
        speed=[12.0],
        direction=[direction],
        vertical=[0.7],
        horizontal_shear=[0.1],
        exponent=[0.2],
        vertical_shear=[-0.05],
        gust=[1.5],
        reference_length=110.0,
    )
    across = y * cos(direction) + x * sin(direction)  # to the left looking along the wind
    speed = 12.0 * ((z / HUB) ** 0.2 + (0.1 * across - 0.05 * (z - HUB)) / 110.0) + 1.5
    u, v, w = velocity(wind, (x, y, z))
    assert u == pytest.approx(speed * cos(direction), abs=1e-12)
    assert v == pytest.approx(-speed * sin(direction), abs=1e-12)
    assert w == 0.7


def test_linear_shears_act_over_the_rotor_diameter_unless_given() -> None:
    wind = series(time=[0.0], speed=[10.0], horizontal_shear=[0.2])
    left, right = (velocity(wind, (0.0, y, HUB)).x for y in (0.5 * DIAMETER, -0.5 * DIAMETER))
    assert left - right == pytest.approx(2.0, rel=1e-14)


NT, NZ, NY = 6, 4, 5
DT, DY, DZ, BOTTOM, SPEED = 0.5, 10.0, 15.0, 30.0, 8.0


def box(velocities: np.ndarray | None = None, **changes: Any) -> WindBox:
    """A small box of whole numbers, so that single precision is exact."""
    if velocities is None:
        velocities = np.random.default_rng(4).integers(-50, 50, (NT, NZ, NY, 3)).astype(np.float32)
    settings = {"dt": DT, "dy": DY, "dz": DZ, "bottom": BOTTOM, "speed": SPEED} | changes
    return WindBox(velocity=velocities, **settings)


WIDTH = (NY - 1) * DY


def at_plane(i: float, x: float = 0.0, lead: float = 0.5 * WIDTH) -> float:
    """Time at which plane ``i`` passes x: plane 0 stands half the width downwind at time 0, periodic at the tower."""
    return i * DT - (lead - x) / SPEED


@pytest.mark.parametrize("i", range(NT))
def test_grid_points_have_their_own_velocity(i: int) -> None:
    field = box(periodic=True)
    for k in range(NZ):
        for j in range(NY):
            found = velocity(field, (2.0, -0.5 * WIDTH + j * DY, BOTTOM + k * DZ), at_plane(i, 2.0, 0.0))
            # edges are met a millionth of a cell inside
            np.testing.assert_allclose(found, field.velocity[i, k, j], rtol=0.0, atol=2e-4)


def test_first_plane_stands_half_the_width_downwind_at_time_zero() -> None:
    field = box()
    found = velocity(field, (0.5 * WIDTH, -0.5 * WIDTH + DY, BOTTOM + DZ), 0.0)
    np.testing.assert_allclose(found, field.velocity[0, 1, 1], rtol=SINGLE, atol=SINGLE)


def test_first_plane_of_a_periodic_box_stands_at_the_tower_at_time_zero() -> None:
    field = box(periodic=True)
    found = velocity(field, (0.0, -0.5 * WIDTH + DY, BOTTOM + DZ), 0.0)
    np.testing.assert_allclose(found, field.velocity[0, 1, 1], rtol=SINGLE, atol=SINGLE)


def trilinear(i: Any, k: Any, j: Any) -> np.ndarray:
    return np.stack([3.0 + i + 2.0 * j - k + 0.5 * i * j * k, i * k - 4.0 * j, 7.0 + j * k - i], axis=-1)


@steady
@given(i=st.floats(0.0, NT - 1.01), k=st.floats(0.0, NZ - 1.01), j=st.floats(0.0, NY - 1.01), x=st.floats(-20.0, 20.0))
def test_interpolation_is_exact_for_a_trilinear_field(i: float, k: float, j: float, x: float) -> None:
    planes, rows, columns = np.meshgrid(np.arange(NT), np.arange(NZ), np.arange(NY), indexing="ij")
    field = box(trilinear(planes, rows, columns).astype(np.float32))
    found = velocity(field, (x, -0.5 * WIDTH + j * DY, BOTTOM + k * DZ), at_plane(i, x))
    np.testing.assert_allclose(found, trilinear(i, k, j), rtol=0.0, atol=60.0 * SINGLE)


@steady
@given(t=st.floats(-20.0, 20.0), n=st.integers(-5, 5), y=st.floats(-15.0, 15.0), z=st.floats(35.0, 70.0))
def test_a_periodic_box_repeats_after_all_its_planes(t: float, n: int, y: float, z: float) -> None:
    field = box(periodic=True)
    # positions lose digits as time grows: 1e-14 s times 200 (m/s)/s
    np.testing.assert_allclose(
        velocity(field, (0.0, y, z), t),
        velocity(field, (0.0, y, z), t + n * NT * DT),
        rtol=0.0,
        atol=1e-11 + 100 * SINGLE,
    )


def test_a_periodic_box_goes_from_its_last_plane_to_its_first() -> None:
    field = box(periodic=True)
    found = velocity(field, (0.0, -0.5 * WIDTH + DY, BOTTOM + DZ), at_plane(NT - 0.75, lead=0.0))
    expected = 0.75 * field.velocity[-1, 1, 1] + 0.25 * field.velocity[0, 1, 1]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=50.0 * SINGLE)


def test_a_box_that_does_not_repeat_keeps_its_end_planes() -> None:
    field = box()
    y, z = -0.5 * WIDTH + DY, BOTTOM + DZ
    np.testing.assert_allclose(
        velocity(field, (0.0, y, z), -1e3), field.velocity[0, 1, 1], rtol=0.0, atol=50.0 * SINGLE
    )
    # the last plane is met a millionth of a step before its time
    np.testing.assert_allclose(velocity(field, (0.0, y, z), 1e3), field.velocity[-1, 1, 1], rtol=0.0, atol=2e-4)


@steady
@given(x=st.floats(-30.0, 30.0), t=st.floats(0.0, 10.0), tau=st.floats(-3.0, 3.0), y=st.floats(-15.0, 15.0))
def test_the_field_travels_with_its_speed(x: float, t: float, tau: float, y: float) -> None:
    field = box(periodic=True)
    np.testing.assert_allclose(
        velocity(field, (x, y, 50.0), t),
        velocity(field, (x + SPEED * tau, y, 50.0), t + tau),
        rtol=0.0,
        atol=1e-10 + 100 * SINGLE,
    )


def test_beyond_its_sides_a_box_keeps_the_values_of_its_edge() -> None:
    field = box(periodic=True)
    for outside, inside in (
        ((0.0, 999.0, 50.0), (0.0, 0.5 * WIDTH, 50.0)),
        ((0.0, -999.0, 50.0), (0.0, -0.5 * WIDTH, 50.0)),
        ((0.0, 3.0, 999.0), (0.0, 3.0, BOTTOM + (NZ - 1) * DZ)),
    ):
        np.testing.assert_allclose(velocity(field, outside, 1.3), velocity(field, inside, 1.3), rtol=SINGLE, atol=1e-12)


def test_below_its_lowest_row_the_wind_falls_linearly_to_zero() -> None:
    field = box(periodic=True)
    bottom = np.array(velocity(field, (0.0, 3.0, BOTTOM), 0.3))
    for share in (0.75, 0.5, 0.1, 0.0, -1.0):
        found = velocity(field, (0.0, 3.0, share * BOTTOM), 0.3)
        np.testing.assert_allclose(found, max(share, 0.0) * bottom, rtol=0.0, atol=50.0 * SINGLE)


@steady
@given(direction=st.floats(-3.0, 3.0), x=st.floats(-15.0, 15.0), y=st.floats(-15.0, 15.0), t=st.floats(0.0, 5.0))
def test_a_turned_box_is_the_same_seen_along_the_wind(direction: float, x: float, y: float, t: float) -> None:
    # a point and a velocity of the straight box, turned clockwise from above by the direction
    c, s = cos(direction), sin(direction)
    straight, turned = box(periodic=True), box(periodic=True, direction=direction)
    u, v, w = velocity(straight, (x, y, 50.0), t)
    found = velocity(turned, (x * c + y * s, -x * s + y * c, 50.0), t)
    np.testing.assert_allclose(found, (u * c + v * s, -u * s + v * c, w), rtol=0.0, atol=1e-10 + 100 * SINGLE)


@pytest.mark.parametrize(
    "wind",
    [
        SteadyWind(speed=9.0),
        SteadyWind(speed=9.0, shear_exponent=0.2, reference_height=30.0),
        SteadyWind(speed=9.0, roughness=0.03, reference_height=30.0),
        SteadyWind(speed=9.0, direction=0.4, shear_exponent=0.2),
        series(time=[0.0, 1.0], speed=[9.0, 20.0], gust=[2.0, 0.0], exponent=[0.2, 0.2]),
    ],
)
def test_the_mean_speed_is_the_horizontal_wind_at_the_hub_at_the_start(wind: Wind) -> None:
    u, v, _ = velocity(wind, (0.0, 0.0, HUB))
    assert mean_speed(wind, HUB) == pytest.approx(np.hypot(u, v), rel=1e-13)


def test_the_mean_speed_of_a_series_is_that_at_the_hub() -> None:
    wind = series(time=[0.0], speed=[9.0], exponent=[0.2], reference_height=30.0)
    assert mean_speed(wind, HUB) == pytest.approx(velocity(wind, (0.0, 0.0, HUB)).x, rel=1e-13)


def test_the_mean_speed_of_a_box_is_the_mean_at_its_middle_near_the_hub() -> None:
    field = box()
    u = field.velocity[:, 3, 2, :2]  # row 3 stands at 75 m
    assert mean_speed(field, 76.0) == pytest.approx(np.hypot(*u.T).mean(), rel=1e-6)  # single precision
    assert mean_before(field, 76.0) == pytest.approx(np.hypot(*u.mean(axis=0)), rel=1e-6)


def test_shared_turbulence_is_a_mean_and_a_multiple_of_a_field_that_begins_later() -> None:
    rng, direction, speed, begin = np.random.default_rng(4), 0.3, 10.0, 37.0
    values = rng.standard_normal((40, 9, 9, 3)).astype(np.float32)
    box = WindBox(values, dt=0.5, dy=15.0, dz=15.0, bottom=20.0, speed=8.0, periodic=True)
    mean = SteadyWind(speed=speed, shear_exponent=0.2, direction=direction, upflow=0.1)
    moved = WindBox(values, 0.4, 15.0, 15.0, 20.0, speed=speed, periodic=True, direction=direction)
    for p in ((3.0, -20.0, 95.0), (-8.0, 44.0, 61.0), (0.0, 0.0, 5.0)):
        a, b = velocity(mean, p), velocity(moved, p, 2.0 + begin / speed)
        expected = [x + 1.5 * y for x, y in zip(a, b, strict=True)]
        assert [*velocity(SharedTurbulence(mean, box, 1.5, begin), p, 2.0)] == pytest.approx(expected, rel=10 * SINGLE)


def test_unit_turbulence_has_no_mean_and_a_standard_deviation_of_one_at_the_hub() -> None:
    profile = np.linspace(7.0, 9.0, 9)[:, None, None]
    values = (np.random.default_rng(5).standard_normal((400, 9, 9, 3)) * 1.7 + profile).astype(np.float32)
    unit = unit_turbulence(WindBox(values, dt=0.5, dy=15.0, dz=15.0, bottom=20.0, speed=8.0))
    np.testing.assert_allclose(unit.velocity.mean(axis=(0, 2)), 0.0, atol=1e-6)
    assert unit.velocity[:, 4, 4, 0].std() == pytest.approx(1.0, rel=1e-5)
