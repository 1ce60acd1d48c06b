"""Wind around the tower and on it: potential flow by hand, its end above the top, drag."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plain import plain, record, table

from meltemi.aero.air import Air
from meltemi.aero.tables import AeroOptions, AeroParameters, TowerFlow
from meltemi.aero.tower_flow import eames, lower_half, powles, tower_load, tower_wind
from meltemi.aero.tower_flow.potential import influence as added_by
from meltemi.compiler import Array1, Single, View
from meltemi.maths.vectors import Vec
from meltemi.turbine.exchange import BladeFrame, TowerShape
from meltemi.wind.fields import SteadyWind, wind_arrays
from meltemi.wind.velocity import WindField, series_now

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=200)
TOP, N = 80.0, 9
RADIUS = 2.0
angles = st.floats(-pi, pi)


class TowerInWind(WindField):
    """What the kernels of the tower see."""

    q: Array1
    v: Array1
    tower_shape: TowerShape
    tower_push: Array1
    aero: AeroParameters
    aero_options: AeroOptions
    tower_flow: Single[TowerFlow]
    tower_lanes: TowerFlow


SHAPE = np.zeros((12, N))
"""Two modes, six rows each: displacements along and across, and rotations that do not matter here."""
SHAPE[0], SHAPE[1] = np.linspace(0.0, 1.0, N) ** 2, 0.1 * np.linspace(0.0, 1.0, N)
SHAPE[7] = np.linspace(0.0, 1.0, N) ** 3
SHAPE[2:6] = SHAPE[8:12] = 77.0
STANDING = np.zeros(3)


def seen(tower: Float, q: Float = STANDING, v: Float = STANDING, shape: Float = SHAPE, density: float = 1.2) -> Any:
    """A tower with these arrays in a sheared wind, as kernels see it."""
    wind = SteadyWind(speed=11.0, shear_exponent=0.2, direction=0.3)
    aero, options = AeroParameters.zeros(), np.ones(len(AeroOptions), dtype=np.int64)
    View(AeroParameters, aero)["air_density"] = density
    arrays = {
        "q": q,
        "v": v,
        "tower_shape": shape,
        "tower_push": np.full(len(shape) // 6, 99.0),
        "aero": aero,
        "aero_options": options,
        "tower_flow": tower,
        "tower_lanes": tower,
    }
    return TowerInWind("floats", {**wind_arrays(wind, 90.0, 126.0), **arrays})


def influence(tower: Float, p: Vec) -> Vec:
    """[m/s] that the tower adds to the wind at a point."""
    return added_by(p, seen(tower), 0)


def cylinder(wind: Any = (10.0, 0.0), **rows: Any) -> Float:
    """A tower of constant diameter in uniform wind or one for each node, with some rows changed."""
    array = TowerFlow.zeros(node=N)
    view = View(TowerFlow, array)
    view["height"] = np.linspace(0.0, TOP, N)
    view["diameter"], view["drag"], view["length"] = 2.0 * RADIUS, 1.0, TOP / N
    for row, values in zip(("wind_x", "wind_y", "wind_z"), wind, strict=False):
        view[row] = values
    for name, values in rows.items():
        view[name] = values
    return array


def around(W: float, direction: float, R: float, dx: float, dy: float) -> tuple[float, float]:
    """Velocity that a cylinder adds to a stream: the gradient of -W R^2 / zeta in the complex plane."""
    zeta = complex(dx, dy) * np.exp(-1j * direction)
    added = -W * R**2 / zeta**2  # u - i v along and across the stream
    vector = complex(added.real, -added.imag) * np.exp(1j * direction)
    return vector.real, vector.imag


@steady
@given(
    r=st.floats(1.0, 38.0),
    psi=angles,
    direction=angles,
    W=st.floats(0.1, 40.0),
    z=st.floats(0.0, TOP),
)
def test_the_flow_is_that_around_a_cylinder(r: float, psi: float, direction: float, W: float, z: float) -> None:
    tower = cylinder((W * cos(direction), W * sin(direction)))
    dx, dy = RADIUS * r * cos(psi), RADIUS * r * sin(psi)
    assume(r > 1.0 + 1e-9)
    found = influence(tower, Vec(dx, dy, z))
    assert found.z == 0.0
    assert found[:2] == pytest.approx(around(W, direction, RADIUS, dx, dy), abs=1e-12 * W)


@pytest.mark.parametrize(
    ("x", "y", "u", "v"),
    [
        (-1.0, 0.0, -1.0, 0.0),  # the stagnation point in front
        (1.0, 0.0, -1.0, 0.0),  # and behind
        (0.0, 1.0, 1.0, 0.0),  # twice the wind at the sides
        (0.0, -1.0, 1.0, 0.0),
        (-2.5, 0.0, -0.16, 0.0),  # where a blade passes
        (-sqrt(2.0), sqrt(2.0), 0.0, 0.25),  # aside in front: away from the tower
        (-sqrt(2.0), -sqrt(2.0), 0.0, -0.25),
        (sqrt(2.0), sqrt(2.0), 0.0, -0.25),  # behind: back again
    ],
)
def test_well_known_points(x: float, y: float, u: float, v: float) -> None:
    found = influence(cylinder((8.0, 0.0)), Vec(RADIUS * x, RADIUS * y, 40.0))
    assert found == pytest.approx((8.0 * u, 8.0 * v, 0.0), abs=1e-12)


@steady
@given(psi=angles, direction=angles)
def test_no_wind_goes_through_the_wall(psi: float, direction: float) -> None:
    tower = cylinder((9.0 * cos(direction), 9.0 * sin(direction)))
    r = RADIUS * (1.0 + 1e-12)
    found = influence(tower, Vec(r * cos(psi), r * sin(psi), 40.0))
    u, v = 9.0 * cos(direction) + found.x, 9.0 * sin(direction) + found.y
    assert u * cos(psi) + v * sin(psi) == pytest.approx(0.0, abs=1e-9)


@steady
@given(r=st.floats(0.0, 1.0), psi=angles)
def test_inside_the_tower_the_wind_stays_bounded(r: float, psi: float) -> None:
    x, y = r * cos(psi), r * sin(psi)
    found = influence(cylinder((10.0, 0.0)), Vec(RADIUS * x, RADIUS * y, 40.0))
    # A-44 with r_T = 1
    assert found == pytest.approx((10.0 * (y * y - x * x), -20.0 * x * y, 0.0), abs=1e-12)


def test_in_still_air_there_is_none() -> None:
    assert influence(cylinder((0.0, 0.0)), Vec(-5.0, 0.0, 40.0)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


# height


def test_radius_wind_and_axis_are_those_at_the_height() -> None:
    h = np.linspace(0.0, TOP, N)
    tower = cylinder((8.0 + h / 20.0, h / 40.0), diameter=6.0 - h / 40.0, x=h / 100.0, y=-h / 200.0)
    for z in (0.0, 13.0, 44.4, TOP):
        R, wind = 3.0 - z / 80.0, complex(8.0 + z / 20.0, z / 40.0)
        expected = around(abs(wind), float(np.angle(wind)), R, -7.0 - z / 100.0, 2.0 + z / 200.0)
        found = influence(tower, Vec(-7.0, 2.0, z))
        # heights are taken a billionth of a node below the top
        assert found[:2] == pytest.approx(expected, abs=1e-7)


def test_below_the_tower_it_is_as_at_its_base() -> None:
    tower = cylinder(height=np.linspace(10.0, 90.0, N), diameter=np.linspace(6.0, 4.0, N))
    assert influence(tower, Vec(-7.0, 2.0, 3.0)) == influence(tower, Vec(-7.0, 2.0, 10.0))


def test_above_the_top_the_cylinder_shrinks_to_nothing() -> None:
    tower = cylinder()
    at_top = influence(tower, Vec(-6.0, 1.0, TOP))
    for above in (0.0, 0.25, 0.5, 0.9):
        zeta = cos(0.5 * pi * above)
        found = influence(tower, Vec(-6.0, 1.0, TOP + above * RADIUS))
        assert found[:2] == pytest.approx(around(10.0, 0.0, zeta * RADIUS, -6.0, 1.0), abs=1e-9)
        # a smaller cylinder, the influence goes with its section
        assert found[:2] == pytest.approx((zeta**2 * at_top.x, zeta**2 * at_top.y), abs=1e-9)


@pytest.mark.parametrize("above", [1.0, 1.5, 20.0])
@pytest.mark.parametrize("x", [-6.0, -1.0, 0.0])
def test_a_radius_above_the_top_there_is_none(above: float, x: float) -> None:
    assert influence(cylinder(), Vec(x, 1.0, TOP + above * RADIUS)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_the_end_above_the_top_is_smooth() -> None:
    z = TOP + RADIUS * np.linspace(-0.1, 1.2, 1301)
    u = np.array([influence(cylinder(), Vec(-6.0, 0.0, float(h))).x for h in z])
    assert np.all(np.diff(u) >= -1e-12)
    # cos^2: slope at most pi/2 of the whole in a radius
    assert np.abs(np.diff(u)).max() <= 0.5 * pi * 1e-3 * abs(u[0]) * 1.01


# wind on the tower


@pytest.mark.slow
def test_the_wind_on_the_tower_is_relative_to_its_motion() -> None:
    tower = cylinder()
    q, v = np.array([0.5, -0.3, 9.0]), np.array([1.5, 0.4, 9.0])  # what follows the tower's modes is not looked at
    m = seen(tower, q, v)
    series_now(0.0, m)
    tower_wind(0.0, m)
    view, h = View(TowerFlow, tower), np.linspace(0.0, TOP, N)
    np.testing.assert_allclose(view["x"], 0.5 * SHAPE[0], rtol=1e-14)
    np.testing.assert_allclose(view["y"], 0.5 * SHAPE[1] - 0.3 * SHAPE[7], rtol=1e-14, atol=1e-16)
    speed = 11.0 * (h / 90.0) ** 0.2
    expected = [
        speed * cos(0.3) - 1.5 * SHAPE[0],
        -speed * sin(0.3) - 1.5 * SHAPE[1] - 0.4 * SHAPE[7],  # a positive direction blows to the right
        0.0 * h,
    ]
    np.testing.assert_allclose(view["wind"][:, 1:], np.array(expected)[:, 1:], rtol=0.0, atol=1e-12)


@steady
@given(W=st.floats(0.0, 60.0), direction=angles, density=st.floats(0.0, 1.5), drag=st.floats(0.0, 2.0))
def test_drag_on_the_tower(W: float, direction: float, density: float, drag: float) -> None:
    u, v = W * cos(direction), W * sin(direction)
    tower = cylinder((u, v), drag=drag)
    m = seen(tower, density=density)
    tower_load(m)
    load = m.tower_push
    force = 0.5 * density * drag * 2.0 * RADIUS * TOP / N * W * np.array([u, v, 0.0])
    found = View(TowerFlow, tower)["force"]
    np.testing.assert_allclose(found, force[:, None] * np.ones(N), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(load[0], (SHAPE[0] * found[0] + SHAPE[1] * found[1]).sum(), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(load[1], (SHAPE[7] * found[1]).sum(), rtol=1e-12, atol=1e-9)


def test_drag_takes_no_part_of_the_vertical_wind() -> None:
    tower = cylinder((3.0, 4.0, 50.0))
    tower_load(seen(tower))
    force = View(TowerFlow, tower)["force"][:, 0]
    assert force == pytest.approx(0.5 * 1.2 * 2.0 * RADIUS * TOP / N * 5.0 * np.array([3.0, 4.0, 0.0]), rel=1e-13)


def test_a_tower_without_modes_bears_its_drag() -> None:
    tower = cylinder()
    tower_load(seen(tower, shape=np.zeros((0, N))))
    assert np.all(View(TowerFlow, tower)["force"][0] > 0.0)


def test_the_lower_half_has_the_flow_of_the_cylinder_for_blades_that_point_down() -> None:
    m = seen(cylinder())
    m = record(Air, **{name: getattr(m, name) for name in ("tower_flow", "aero_options")})
    m.frame = table(BladeFrame, {"blade": 3}, azimuth=(0.5 * pi + 0.01, 0.5 * pi - 0.01, pi))
    p = Vec(-3.0 * RADIUS, 0.4 * RADIUS, 50.0)
    whole = [*plain(added_by)(p, m, 0)]
    assert whole[0] < 0.0
    assert [*plain(lower_half.influence)(p, m, 0)] == [*plain(lower_half.influence)(p, m, 2)] == whole
    assert [*plain(lower_half.influence)(p, m, 1)] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("direction", [0.0, 0.4])
@pytest.mark.parametrize(
    ("wake", "x", "y"), [(powles, 9.0, 0.0), (powles, 6.0, 1.3), (eames, 9.0, 0.0), (eames, 9.0, -0.7)]
)
def test_a_wake_takes_its_deficit_from_the_wind_at_the_tower(wake: Any, x: float, y: float, direction: float) -> None:
    """(A-53 to A-55) beside the flow of the cylinder; half a radius above the top half of it, in front none."""
    W, drag = 8.0, 0.6
    along, across = np.array([cos(direction), sin(direction)]), np.array([-sin(direction), cos(direction)])
    m = seen(cylinder(W * along, drag=drag))
    m = record(Air, tower_flow=m.tower_flow)
    width = (x * x + y * y) ** 0.25
    lost = drag / width * cos(0.5 * pi * y / width) ** 2
    if wake is eames:
        lost = drag / (sqrt(2.0 * pi) * 0.1 * x) * np.exp(-0.5 * (y / (0.1 * x)) ** 2)
    for side, height, share in ((1.0, 40.0, 1.0), (1.0, TOP + 0.5 * RADIUS, 0.5), (-1.0, 40.0, 0.0)):
        place = RADIUS * (side * x * along + y * across)
        p = Vec(place[0], place[1], height)
        found = np.array([*plain(wake.influence)(p, m, 0)]) - [*plain(added_by)(p, m, 0)]
        assert found == pytest.approx(np.append(-min(lost, 0.5) * share * W * along, 0.0), abs=1e-12)
