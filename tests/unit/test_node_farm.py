"""Kernels of wakes, in plain Python: mixing, transport, merging, averages, and the march of planes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table

from meltemi.compiler import members
from meltemi.farm import averages, curled, field, march
from meltemi.farm.curled import CurledField
from meltemi.farm.eddies import eddies_of
from meltemi.farm.field import PlaneField, Planes, VisiblePlanes, WakeField, Wakes
from meltemi.farm.march import Mixing
from meltemi.maths.vectors import Vec
from meltemi.wind.fields import SteadyWind, wind_arrays
from meltemi.wind.velocity import WindField, series_now

Float = NDArray[np.float64]
U, DR = 8.0, 5.0


def near(found: Any, expected: Any, tolerance: float = 1e-6) -> None:
    scale = max(float(np.abs([*expected]).max()), 1e-12)
    np.testing.assert_allclose([*found], [*expected], rtol=0.0, atol=tolerance * scale)


def wakes(profile: Any, cls: type[WakeField] = WakeField, way: float = 10.0, **values: float) -> Any:
    """Wakes (wakes, planes, points, 3) along x from the origin at 90 m, planes ``way`` apart, in a wind of 8 m/s."""
    box = np.array(profile, dtype=np.float32)
    n, planes = box.shape[:2]
    place = np.zeros((3, n, planes))
    place[0], place[2] = way * np.arange(planes), 90.0
    normal = np.zeros_like(place)
    normal[0] = 1.0
    sizes = {"wake": n, "plane": planes}
    m = record(
        cls, planes=table(Planes, sizes, centre=place, normal=normal, wind=np.full((n, planes), U)), profile=box,
        wakes=Wakes.of(spacing=DR, reach=DR * (box.shape[2] - 1), ceiling=1e9, eddy_spacing=4.0, **values),
        visible=table(VisiblePlanes, {"wake": n}, first=[0] * n, last=[planes - 1] * n, wake=range(n)),
        longest=np.full((2, n), way),
        eddies=np.zeros((2, 2, 3, 3), np.float32),
    )  # fmt: skip
    air = WindField("floats", wind_arrays(SteadyWind(speed=U), 90.0, 100.0))
    for name in members(WindField):
        setattr(m, name, getattr(air, name))
    return m


def rings(count: int, *values: Any) -> Float:
    """(1, 2, count, 3) profiles of two planes, of axial, radial velocity and turbulence."""
    return np.array([[np.stack(np.broadcast_arrays(*each, np.zeros(count))[:3], axis=-1) for each in values]])


# a wake -------------------------------------------------------------------------------------------------


def test_a_point_between_planes_has_what_is_linear_between_them() -> None:
    """Planes that move and turn: axial velocity along the mean normal, radial one away from the centre (K-10)."""
    j = np.arange(8.0)
    m = wakes(rings(8, (-4.0 + 0.3 * j, 0.1 * j, 0.2 + 0.05 * j), (-3.0 + 0.2 * j, 0.2 * j, 0.3 + 0.02 * j)))
    m.planes.normal[0, 1], m.planes.velocity[0, 0] = Vec(0.8, 0.6, 0.0), Vec(0.0, 2.0, 0.0)
    q, late, w = np.array([3.0, 13.0, 101.0]), 1.5, 0.3
    assert plain(field.before)(Vec(*q), late, m, 0, 1) == pytest.approx(0.8 * (3.0 - 10.0) + 0.6 * 13.0)
    n = 0.7 * np.array([1.0, 0.0, 0.0]) + 0.3 * np.array([0.8, 0.6, 0.0])
    aside = q - (0.7 * np.array([0.0, 3.0, 90.0]) + 0.3 * np.array([10.0, 0.0, 90.0]))
    aside -= (n @ aside) * n
    found = plain(field.between)(Vec(*q), late, w, m, 0, 0)
    r = np.linalg.norm(aside)
    x = r / DR
    axial, radial = 0.7 * (-4.0 + 0.3 * x) + 0.3 * (-3.0 + 0.2 * x), 0.7 * 0.1 * x + 0.3 * 0.2 * x
    assert found.axial == pytest.approx(axial, rel=1e-6)
    near(found.velocity, axial * n + radial / r * aside)
    assert found.turbulence == pytest.approx(0.7 * (0.2 + 0.05 * x) + 0.3 * (0.3 + 0.02 * x), rel=1e-6)
    beyond = plain(field.between)(Vec(3.0, 13.0, 131.0), late, w, m, 0, 0)
    assert (beyond.axial, beyond.turbulence) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("merging", "expected"), [(field.LINEAR, -5.0), (field.QUADRATIC, -np.sqrt(13)), (field.LARGEST, -3)]
)
def test_wakes_that_overlap_merge_as_asked(merging: float, expected: float) -> None:
    m = wakes(np.concatenate([rings(8, (v, 0.0, 0.0), (v, 0.0, 0.0)) for v in (-2.0, -3.0)]), merging=merging)
    m.wakes.origin_x, m.wakes.origin_y, m.wakes.time = 100.0, -50.0, 10.0
    m.planes.velocity[0, 0] = m.planes.velocity[0, 1] = Vec(0.0, 3.0, 0.0)
    near(plain(field.wakes_velocity)(Vec(-96.0, 54.0, 92.0), 11.0, m), (expected, 0.0, 0.0))
    near(plain(field.wakes_velocity)(Vec(-89.0, 54.0, 92.0), 11.0, m), (0.0, 0.0, 0.0))  # behind the last plane
    near(plain(field.wakes_velocity)(Vec(-101.0, 54.0, 92.0), 11.0, m), (0.0, 0.0, 0.0))
    near(plain(field.wakes_velocity)(Vec(-96.0, 86.5, 92.0), 11.0, m), (-2.0, 0.0, 0.0))  # one of both only


def test_oblique_wakes_merge_along_their_mean_direction() -> None:
    """The part along it, weighed by the deficits, is the root of the sum of squares or the largest one; what is across
    adds up (K-12)."""
    m = wakes(np.concatenate([rings(8, (v, 0.5, 0.0), (v, 0.5, 0.0)) for v in (-2.0, -3.0)]))
    for i in range(2):
        m.planes.normal[1, i], m.planes.centre[1, i] = Vec(0.8, 0.36, 0.48), Vec(8.0 * i, 3.6 * i, 90.0 + 4.8 * i)
    q, normals = np.array([3.0, 4.0, 95.0]), np.array([[1.0, 0.0, 0.0], [0.8, 0.36, 0.48]])
    velocities = []
    for n, axial in zip(normals, (-2.0, -3.0), strict=True):
        aside = q - np.array([0.0, 0.0, 90.0])
        aside -= (aside @ n) * n
        velocities.append(axial * n + 0.5 * aside / np.linalg.norm(aside))
    mean = 2.0 * normals[0] + 3.0 * normals[1]
    mean /= np.linalg.norm(mean)
    along = np.array(velocities) @ mean
    for merging, merged in ((field.QUADRATIC, -np.hypot(*along)), (field.LARGEST, along[1])):
        m.wakes.merging = merging
        expected = np.sum(velocities, axis=0) + (merged - along.sum()) * mean
        near(plain(field.wakes_velocity)(Vec(*q), 0.0, m), expected)


def test_turbulence_of_wakes_adds_by_squares_to_eddies_that_travel() -> None:
    m = wakes(
        np.concatenate([rings(8, (0.0, 0.0, v), (0.0, 0.0, v)) for v in (0.3, 0.4)]), merging=field.LINEAR, added=1.0
    )
    m.wakes.eddy_speed_x, m.wakes.eddy_speed_y = 2.0, 1.0
    random = np.random.default_rng(1).normal(size=(4, 4, 4, 3))
    m.eddies = np.concatenate([random, random[:, :, :1]], axis=2).astype(np.float32)  # by x, z, y
    q, t = np.array([5.0, -7.0, 93.0]), 3.0
    place = (q - t * np.array([2.0, 1.0, 0.0])) / 4.0
    low = np.floor(place).astype(int)
    a, b, c = place - low
    expected = np.zeros(3)
    for i, k, j in np.ndindex(2, 2, 2):
        share = (a if i else 1 - a) * (b if j else 1 - b) * (c if k else 1 - c)
        expected += share * random[(low[0] + i) % 4, (low[2] + k) % 4, (low[1] + j) % 4]
    near(plain(field.eddy)(Vec(*q), t, m), expected)
    near(plain(field.wakes_velocity)(Vec(*q), t, m), 0.5 * expected)


def test_a_point_that_rounding_places_at_the_end_of_the_eddies_is_at_their_begin() -> None:
    m = wakes(rings(8, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    random = np.random.default_rng(1).normal(size=(4, 4, 4, 3))
    m.eddies = np.concatenate([random, random[:, :, :1]], axis=2).astype(np.float32)
    for i in range(3):
        q = np.array([5.0, 7.0, 9.0])
        q[i] = 0.0
        beside = q.copy()
        beside[i] = -1e-20  # modulo 4 in double precision: 4
        near(plain(field.eddy)(Vec(*beside), 0.0, m), [*plain(field.eddy)(Vec(*q), 0.0, m)])


def test_eddies_have_the_spectrum_of_von_karman() -> None:
    """(K-14): half a diameter is their length, the box is made of independent normal numbers without divergence."""
    box = eddies_of(5)
    u = box[:, :, :-1].transpose(3, 0, 2, 1).astype(float)  # component, x, y, z
    np.testing.assert_array_equal(box[:, :, 0], box[:, :, -1])
    assert u.std(axis=(1, 2, 3)) == pytest.approx(np.ones(3), rel=1e-5)
    assert np.abs(u.mean(axis=1)).max() < 1e-6 > np.abs(u.mean(axis=2)).max()
    n = u.shape[1]
    k = 2.0 * np.pi * np.fft.fftfreq(n, 0.04)
    waves = np.stack(np.meshgrid(k, k, k, indexing="ij"))
    square = (waves**2).sum(axis=0)
    white = np.fft.fftn(np.random.default_rng(5).standard_normal(u.shape), axes=(1, 2, 3))
    some = (slice(None), slice(1, 12), slice(1, 12), slice(1, 12))  # wave numbers of one sign, up to 27
    waves, square, white = waves[some], square[some[1:]], white[some]
    white -= waves * (waves * white).sum(axis=0) / square
    amplitude = (np.fft.fftn(u, axes=(1, 2, 3))[some] / white).real
    # E(k) / k^2 = k^2 / (k^2 + 1 / L^2)^(17/6) with L = 0.5
    expected = np.sqrt(square) / (square + 4.0) ** (17.0 / 12.0)
    for c in range(3):
        scale = np.median(amplitude[c] / expected)
        assert amplitude[c] / scale == pytest.approx(expected, rel=2e-2)


# mixing -------------------------------------------------------------------------------------------------


def test_viscosity_follows_turbulence_deficit_and_slope() -> None:
    """Of a linear deficit (K-6): ambient part, and the larger one of the mixing length and of the deepest deficit."""
    V, nu = np.array([-4.0, -3.0, -2.0, -1.0, 0.0]), np.empty(5)
    c = Mixing.of(radius=60.0, ambient=0.02, power=2.0, shear=0.01, gradient=1.0, slowest=1.0, rotor_wide=1.0)
    plain(march.viscosity)(V, 10.0, 0.3, 0.7, 0.5, 0.2, c, nu)
    outside, least, steep = 0.02 * 0.7 * 0.09 * 60.0 * 10.0, 60.0 * 6.0, 3600.0 * 1.0 / 0.2
    half = 3600.0 * 0.5 / 0.2
    near(nu, outside + 0.005 * np.array([least, steep, steep, steep, half]))
    c.slowest, c.gradient = 0.0, 0.0
    plain(march.viscosity)(V, 10.0, 0.0, 0.7, 0.5, 0.2, c, nu)
    near(nu, np.full(5, 2e-4 * 60.0 * 10.0 + 0.005 * 60.0 * 4.0))
    c.rotor_wide = 0.0
    width = plain(march.half_width)(V, 0.2)
    assert width == pytest.approx(2.5 * 0.2)  # deficits 3, 6, 5 in rings: 14 of 14
    plain(march.viscosity)(V, 10.0, 0.0, 0.7, 0.5, 0.2, c, nu)
    near(nu, np.full(5, 2e-4 * 60.0 * 10.0 + 0.005 * width * 4.0))


def test_a_small_gaussian_deficit_widens_and_draws_air_in() -> None:
    """In a constant viscosity nu the width^2 grows with 4 nu x / U; the radial velocity is that of continuity, halfway
    between both planes; added turbulence has the factors of deficit and slope (K-7, K-8, K-14)."""
    r, width, A, nu, way = DR * np.arange(60.0), 60.0**2, 1e-3, 8.0, 10.0
    m = wakes(rings(60, (-A * np.exp(-(r**2) / width), 0.0, 0.0), (0.0, 0.0, 0.0)))
    m.planes.intensity[0, 0] = 0.1
    c = Mixing.of(radius=40.0, ambient=nu / (0.7 * 0.1 * 40.0 * U), power=1.0, slowest=1.0)
    along = np.array([[0.7, 0.0], [0.0, 0.0], [0.0, 0.3], [0.0, 1.2]])
    plain(march.age)(m, 0, 0, 1.0, way, c, along, np.zeros((6, 60)))
    rate = 4.0 * nu / U
    after, middle = width + rate * way, width + 0.5 * rate * way
    V = -A * width / after * np.exp(-(r**2) / after)
    found = np.asarray(m.profile[0, 1, :, 0], dtype=np.float64)
    near(found[1:], V[1:], 5e-4)
    # the equation of FAST.Farm at the centre mixes half as fast as that of a ring
    sides = nu / DR * (found[1] + m.profile[0, 0, 1, 0] - found[0] - m.profile[0, 0, 0, 0])
    assert DR * (U - A) / way * (found[0] + A) == pytest.approx(sides, rel=1e-3)
    inwards = -0.5 * A * width * rate * r / middle**2 * np.exp(-(r**2) / middle)
    near(m.profile[0, 1, 5:, 1], inwards[5:], 0.02)  # further in, of what the centre mixes too little
    change = found - m.profile[0, 0, :, 0]
    flux = np.cumsum((np.arange(59) + 0.5) * DR * 0.5 * (change[1:] + change[:-1])) / way
    near(m.profile[0, 1, :, 1], [0.0, *(-flux / np.arange(1.0, 60.0))], 1e-4)
    slope = np.abs(np.gradient(found, DR))[1:-1]
    near(m.profile[0, 1, 1:-1, 2], (0.3 * np.abs(found[1:-1]) + 1.2 * 40.0 * slope) / U, 1e-5)
    assert m.profile[0, 1, 0, 2] == pytest.approx(0.3 * abs(found[0]) / U)
    plain(march.age)(m, 0, 0, 1.0, 0.0, c, along, np.zeros((6, 60)))
    near(m.profile[0, 1, :, 0], m.profile[0, 0, :, 0])  # without way nothing ages


def test_viscosity_of_curled_wakes_follows_slopes_in_and_around_the_plane() -> None:
    """K-22: outside + own max(|dV/dr| + |dV/(r dt)|, least), here of V = 0.3 y - 0.2 z."""
    line = DR * np.arange(-3.0, 4.0)
    z, y = np.meshgrid(line, line, indexing="ij")
    r, nu = np.maximum(np.hypot(y, z), 1e-9), np.zeros((7, 7))
    most = plain(curled.eddy_viscosity)(0.3 * y - 0.2 * z, y / r, z / r, DR, 1.5, 20.0, 0.25, nu)
    slope = np.abs(0.3 * y - 0.2 * z) / r + np.abs(0.3 * z + 0.2 * y) / r
    expected = 1.5 + 20.0 * np.maximum(slope, 0.25)
    near(nu[1:-1, 1:-1].ravel(), expected[1:-1, 1:-1].ravel())
    assert most == pytest.approx(expected[1:-1, 1:-1].max())
    assert not nu[0].any() and not nu[:, -1].any()


def test_a_plane_of_a_curled_wake_mixes_and_is_carried() -> None:
    """V = y^2 + 2 z^2 + 3 y - z with a viscosity of 1 + 0.1 y + 0.2 z: d(nu dV)/dx - v dV, exact for squares (K-21)."""
    line = DR * np.arange(-3.0, 4.0)
    z, y = np.meshgrid(line, line, indexing="ij")
    V, nu, new = y**2 + 2.0 * z**2 + 3.0 * y - z, 1.0 + 0.1 * y + 0.2 * z, np.zeros((7, 7))
    vy, vz, dt = 0.4 + 0.01 * z, -0.3 + 0.02 * y, 0.1
    plain(curled.advected)(V, vy, vz, nu, 0.5 * dt / DR**2, 0.5 * dt / DR, new)
    rate = 0.1 * (2.0 * y + 3.0) + 0.2 * (4.0 * z - 1.0) + nu * 6.0 - vy * (2.0 * y + 3.0) - vz * (4.0 * z - 1.0)
    near(new[1:-1, 1:-1].ravel(), (V + dt * rate)[1:-1, 1:-1].ravel())


def curled_plane(V: Float, vy: Any, vz: Any, around: Float) -> Any:
    """A curled wake of two planes; V (side, side)."""
    plane = np.stack([V, np.broadcast_to(vy, V.shape), np.broadcast_to(vz, V.shape)], axis=-1).reshape(-1, 3)
    m = wakes(np.array([[plane, 0.5 * plane]]), CurledField)
    m.around, m.wakes.reach = around.reshape(2, 1, *V.shape), DR * (len(V) // 2)
    for i in range(2):
        plain(march.totals)(m, 0, i)
    return m


def test_a_curled_wake_ages_by_ambient_and_own_mixing() -> None:
    """One explicit step of a plane with a ridge along z, against (K-21, K-22) written out."""
    line = DR * np.arange(-3.0, 4.0)
    z, y = np.meshgrid(line, line, indexing="ij")
    r = np.maximum(np.hypot(y, z), 1e-9)
    V = -4.0 + 0.02 * y**2
    m = curled_plane(V, 0.5, -0.2, np.array([y / r, z / r]).reshape(2, -1))
    m.planes.intensity[0, 0] = 0.1
    c, dt = Mixing.of(radius=20.0, ambient=0.06, shear=0.02, power=1.0), 0.05
    along = np.array([[0.8, 0.0], [0.5, 0.0], [0.0, 0.4], [0.0, 1.5]])
    plain(march.age)(m, 0, 0, dt, 1.0, c, along, np.zeros((6, 49)))
    nu, slope = np.zeros((7, 7)), 0.04 * np.abs(y) * (np.abs(y) + np.abs(z)) / r
    nu[1:-1, 1:-1] = (0.06 * 0.8 * 0.1 * 20.0 * U + 0.02 * 0.5 * 400.0 * np.maximum(slope, (U - 4.0) / 20.0))[
        1:-1, 1:-1
    ]
    flux = 0.5 * (nu[:, 1:] + nu[:, :-1]) * np.diff(V, axis=1) / DR
    rate = np.diff(flux[1:-1], axis=1) / DR - 0.5 * 0.04 * y[1:-1, 1:-1]
    found = m.profile[0, 1, :, 0].reshape(7, 7)
    near(found[1:-1, 1:-1].ravel() - V[1:-1, 1:-1].ravel(), (dt * rate).ravel(), 1e-4)
    assert np.all(m.profile[0, 1, :, 1] == np.float32(0.5)) and np.all(m.profile[0, 1, :, 2] == np.float32(-0.2))
    assert m.planes.eddies_deficit[0, 1] == pytest.approx(0.4 / U)
    assert m.planes.eddies_slope[0, 1] == pytest.approx(1.5 * 20.0 / U)


def test_a_curled_wake_ages_in_as_many_steps_as_are_stable() -> None:
    """Four steps of time give what one does to 1 %: the number of steps is chosen inside."""
    line = DR * np.arange(-6.0, 7.0)
    z, y = np.meshgrid(line, line, indexing="ij")
    r = np.maximum(np.hypot(y, z), 1e-9)
    V, c = -4.0 * np.exp(-(r**2) / 15.0**2), Mixing.of(radius=20.0, ambient=0.6, power=1.0)
    along, found = np.ones((4, 2)), []
    for parts in (1, 4):
        m = curled_plane(V, 1.0, 2.0, np.array([y / r, z / r]).reshape(2, -1))
        m.planes.intensity[0, 0] = 0.3
        for _ in range(parts):
            plain(march.age)(m, 0, 0, 8.0 / parts, 1.0, c, along, np.zeros((6, 169)))
            m.profile[0, 0] = m.profile[0, 1]
        found.append(m.profile[0, 1, :, 0].copy())
    assert np.abs(found[0] - found[1]).max() < 0.01 * np.abs(found[1]).max()


def test_trailing_vortices_reach_to_the_corners_of_a_turned_plane() -> None:
    """(K-19), outside of their cores."""
    radius, half, step = 60.0, 11, 9.0
    sheet = curled.vortex_sheet(radius, step, half)
    place = (0.02 * np.arange(2, 100) - 1.0) * radius
    circulation = 0.02 * place / np.sqrt(radius**2 - place**2)
    reach = np.sqrt(2.0) * half * step
    for angle in np.linspace(0.0, 2.0 * np.pi, 9):
        beside, along = reach * np.cos(angle), reach * np.sin(angle)
        away = beside**2 + (along - place) ** 2
        psi = (circulation * np.log(away / (2.0 * curled.CORE * radius) ** 2)).sum() / (4.0 * np.pi)
        assert float(sheet.ev(beside, along)) == pytest.approx(psi, rel=1e-4, abs=1e-6)
        slope = (circulation * (along - place) / away).sum() / (2.0 * np.pi)
        assert float(sheet.ev(beside, along, dy=1)) == pytest.approx(slope, rel=2e-3, abs=2e-6)


def test_a_point_in_a_curled_plane_is_bilinear() -> None:
    line = DR * np.arange(-3.0, 4.0)
    z, y = np.meshgrid(line, line, indexing="ij")
    r = np.maximum(np.hypot(y, z), 1e-9)
    V = 0.1 * y - 0.2 * z + 0.01 * y * z - 3.0
    m = curled_plane(V, 0.05 * y + 0.02 * z, 0.03 * y * z / 5.0, np.array([y / r, z / r]).reshape(2, -1))
    m.wakes.added, m.planes.eddies_deficit[0, 0], m.planes.eddies_slope[0, 1] = 1.0, 0.2, 0.5
    a, b, w = 7.3, -4.1, 0.4  # to the left and upwards
    found, share = plain(field.between)(Vec(2.0, a, 90.0 + b), 0.0, w, m, 0, 0), 1.0 - 0.5 * w
    axial = share * (0.1 * a - 0.2 * b + 0.01 * a * b - 3.0)
    assert found.axial == pytest.approx(axial, rel=1e-5)
    near(found.velocity, (axial, share * (0.05 * a + 0.02 * b), share * 0.006 * a * b), 1e-5)
    dy, dz, r0 = share * (0.1 + 0.01 * b), share * (-0.2 + 0.01 * a), np.hypot(a, b)
    slope = (abs(dy * a + dz * b) + abs(dz * a - dy * b)) / r0
    assert found.turbulence == pytest.approx(0.6 * 0.2 * abs(axial) + 0.4 * 0.5 * slope, rel=1e-5)
    outside = plain(field.between)(Vec(2.0, 15.1, 90.0), 0.0, w, m, 0, 0)
    near(outside.velocity, (0.0, 0.0, 0.0))


# planes -------------------------------------------------------------------------------------------------


def test_planes_drift_with_their_velocity_and_drop_what_they_catch_up_with() -> None:
    m = wakes(rings(4, *[(-float(i), 0.0, 0.0) for i in range(5)]), way=10.0)
    for i in range(5):
        m.planes.velocity[0, i], m.planes.axial[0, i] = Vec(5.0, 1.0, 0.0), 4.0
        m.planes.travelled[0, i] = 10.0 * i
    m.planes.velocity[0, 1] = Vec(14.0, 0.0, 0.0)  # passes the next one
    c, still = Mixing.of(radius=20.0, power=1.0), np.zeros((4, 6))
    assert plain(march.march)(m, 0, 4, 2.0, 0.75, c, still) == 4
    p = m.planes
    near([p.centre[0, i].x for i in range(1, 4)], (10.0, 38.0, 40.0))
    near([p.axial[0, i] for i in range(1, 4)], (0.75 * 4.0 + 0.25 * 5.0, 0.75 * 4.0 + 0.25 * 14.0, 4.25))
    near([p.travelled[0, i] for i in range(1, 4)], (10.0, 38.0, 40.0))
    assert p.centre[0, 1].y == 2.0
    near(m.profile[0, 1:4, 1, 0], (0.0, -1.0, -3.0), 2e-2)


def test_an_observer_looks_at_planes_that_cut_its_disk() -> None:
    m = wakes(np.concatenate([rings(4, *[(-1.0, 0.0, 0.0)] * 6)] * 2))
    m.planes.centre[1, 0] = Vec(0.0, 0.0, 90.0)
    count, near_ones = np.array([6, 6]), np.array([1, 0])

    def seen(x: float, y: float, normal: Vec, radius: float = 12.0) -> tuple[int, int]:
        plain(averages.select_planes)(m, count, near_ones, Vec(x, y, 90.0), normal, radius, 1.0)
        assert m.visible.first[1] == m.visible.last[1]
        return m.visible.first[0], m.visible.last[0]

    assert seen(25.0, 0.0, Vec(1.0, 0.0, 0.0)) == (2, 3)
    assert seen(20.5, 0.0, Vec(1.0, 0.0, 0.0)) == (1, 3)
    assert seen(25.0, 0.0, Vec(0.0, 1.0, 0.0)) == (1, 4)  # it reaches 13 m to both sides
    assert seen(25.0, 27.9, Vec(1.0, 0.0, 0.0)) == (2, 3)
    assert seen(25.0, 28.1, Vec(1.0, 0.0, 0.0)) == (2, 2)  # beside 15 m of the wake, 12 m and 1 m
    assert seen(-1.5, 0.0, Vec(1.0, 0.0, 0.0))[1] == 0
    assert seen(51.5, 0.0, Vec(1.0, 0.0, 0.0))[1] == 0


def points_of(radius: float) -> Float:
    """(3, 4) points to the left, right, above and below, of unequal weights."""
    return np.array([[radius, -radius, 0.0, 0.0], [0.0, 0.0, radius, -radius], [1.0, 2.0, 3.0, 4.0]])


def test_averages_weigh_points_of_a_disk_above_the_ground() -> None:
    m = wakes(rings(8, (-2.0, 0.0, 0.0), (-2.0, 0.0, 0.0)), PlaneField)
    mean, points = plain(averages.mean_wind), points_of(20.0)
    plain(series_now)(0.0, m)
    centre, n = Vec(5.0, 30.0, 90.0), Vec(1.0, 0.0, 0.0)
    u, square, share = mean(m, 0.0, centre, n, 0.0, points, 20.0, averages.DISTURBED)
    near(u, (U - 0.2 * 2.0, 0.0, 0.0))  # to the right, 10 m from the centre, only: weight 2 of 10
    assert square == pytest.approx(0.8 * U**2 + 0.2 * (U - 2.0) ** 2)
    assert share == pytest.approx(0.1)
    near(mean(m, 0.0, centre, n, 0.0, points, 20.0, averages.AMBIENT)[0], (U, 0.0, 0.0))
    near(mean(m, 0.0, centre, n, 0.0, points, 20.0, averages.ALONG)[0], (U - 0.4, 0.0, 0.0))
    # turned by 90 deg: what was to the left is below or above, and the right point takes its place
    turned = mean(m, 0.0, centre, n, 0.5 * np.pi, points, 20.0, averages.DISTURBED)[0]
    near(turned, (U - 0.3 * 2.0, 0.0, 0.0))
    above = plain(averages.share_above)
    m.wind.box_z = 10.0
    for z, part in ((10.0, 0.5), (13.0, 1.0), (8.5, 0.0), (10.9, 0.8)):
        assert above(z, 20.0, m) == pytest.approx(part)
    m.wakes.ceiling = 100.0
    assert above(100.0, 20.0, m) == pytest.approx(0.5) and above(98.5, 20.0, m) == pytest.approx(1.0)
    assert plain(averages.reach_of)(points) == pytest.approx(20.0)


def test_planes_drift_with_the_mean_wind_and_their_deflection() -> None:
    """Ambient averages with lateral drift by way and yaw, and by the mean deficit (K-9)."""
    m = wakes(rings(8, *[(-2.0 - i, 0.0, 0.0) for i in range(4)]), PlaneField)
    m.drift = points_of(20.0)
    m.planes.normal[0, 2] = Vec(0.8, 0.6, 0.0)
    m.planes.yaw[0, 1] = m.planes.yaw[0, 2] = 0.2
    turn = np.array([0.01, -0.3, 0.5, 17.0])
    plain(averages.drift)(m, 0, np.array([4]), np.array([1]), 0.0, averages.AMBIENT, np.zeros(0), turn)
    way = (0.01 - 0.06) * U
    near(m.planes.velocity[0, 0], (U, 0.01 * U, 0.0))
    near(m.planes.velocity[0, 1], (U, way, 0.0))
    deep = 0.5 * -4.0
    near(m.planes.velocity[0, 2], (U - 0.8 * way * 0.6, 0.8 * way * 0.8 + 0.6 * deep, 0.0))
    assert plain(averages.deficit)(m, 0, 2, 17.0) == pytest.approx(-4.0)


def test_every_other_plane_drifts_as_its_neighbours_do_on_average() -> None:
    m = wakes(rings(8, *[(-1.0 - i * i, 0.0, 0.0) for i in range(4)]), PlaneField)
    m.drift = points_of(20.0)
    plain(averages.drift)(m, 0, np.array([4]), np.array([1]), 0.0, averages.DISTURBED, np.zeros(8), np.zeros(4))
    u = [m.planes.velocity[0, i].x for i in range(4)]
    assert u[0] > u[2] > u[3]
    assert u[1] == pytest.approx(0.5 * (u[0] + u[2]))


def test_the_wind_over_the_farm_is_horizontal() -> None:
    m = wakes(rings(8, (-2.0, 0.0, 0.0), (-2.0, 0.0, 0.0)), PlaneField)
    air = WindField("floats", wind_arrays(SteadyWind(speed=U, direction=0.4, upflow=0.2), 90.0, 100.0))
    for name in members(WindField):
        setattr(m, name, getattr(air, name))
    speed = np.zeros((2, 1))
    none, one = np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.int64)
    plain(averages.horizontal)(m, 0.0, 2 * one, none, np.array([5.0, -5.0]), np.zeros(1), 90.0, speed)
    assert speed[:, 0] == pytest.approx([U, U])
    plain(averages.horizontal)(m, 0.0, 2 * one, one, np.array([5.0, -5.0]), np.zeros(1), 90.0, speed)
    assert speed[:, 0] == pytest.approx([np.hypot(U * np.cos(0.4) - 2.0, U * np.sin(0.4)), U])


def test_points_miss_a_part_of_the_own_wake() -> None:
    m = wakes(rings(8, *[(-2.0, 0.0, 0.0)] * 4), PlaneField)
    m.drift = points_of(20.0)
    own = np.array([0.5, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    plain(averages.drift)(m, 0, np.array([4]), np.array([1]), 0.0, averages.DISTURBED, own, np.zeros(4))
    near(m.planes.velocity[0, 0], (U - 2.0 - 0.1 * 0.75 * 2.0, 0.0, 0.0))


def test_the_mean_deficit_is_that_of_rings() -> None:
    m = wakes(rings(8, (-np.arange(8.0), 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert plain(averages.deficit)(m, 0, 0, 17.0) == pytest.approx(-(1 + 4 + 9) / 6)


def test_a_rotor_has_the_mean_wind_of_its_disk() -> None:
    m = wakes(rings(8, (-2.0, 0.0, 0.0), (-2.0, 0.0, 0.0)), PlaneField)
    m.disk, m.span = points_of(20.0), points_of(30.0)
    along, intensity = plain(averages.rotor_wind)(m, 0.0, Vec(5.0, 0.0, 90.0), Vec(0.8, 0.6, 0.0))
    assert along == pytest.approx(0.8 * U)
    assert intensity == pytest.approx(0.0, abs=1e-7)
    seen, free = plain(averages.rotor_mean)(
        m, 0.0, np.array([2]), np.array([1]), Vec(5.0, 40.0, 90.0), Vec(1.0, 0.0, 0.0)
    )
    near(free, (U, 0.0, 0.0))
    near(seen, (U - 0.4, 0.0, 0.0))


def test_planes_that_are_skipped_are_those_that_a_look_at_each_leaves_out() -> None:
    """A wake that bends, with uneven planes: the same range without a limit of the change from one to the next."""
    random, count = np.random.default_rng(1), 60
    m = wakes(rings(4, *[(-1.0, 0.0, 0.0)] * count))
    x = np.cumsum(random.uniform(4.0, 30.0, count))
    for i in range(count):
        lean = 0.3 * np.sin(x[i] / 200.0)
        m.planes.centre[0, i] = Vec(x[i], 60.0 * np.sin(x[i] / 150.0), 90.0)
        m.planes.normal[0, i] = Vec(np.cos(lean), np.sin(lean), 0.0)
    select, one, found = plain(averages.select_planes), np.array([1]), set()
    for place in random.uniform((-50.0, -90.0), (x[-1] + 50.0, 90.0), (60, 2)):
        ranges = []
        for limited in (True, False):
            m.longest[:] = 1e9
            if limited:
                plain(averages.longest)(m, 0, count)
            select(m, np.array([count]), one, Vec(*place, 90.0), Vec(1.0, 0.0, 0.0), 20.0, 2.0)
            ranges.append((m.visible.first[0], m.visible.last[0], m.visible.wake[0]))
        assert ranges[0] == ranges[1]
        found.add(ranges[0])
    assert len(found) > 20
