"""Dynamic stall at one node: the static limit, indicial and harmonic response, separation, fading."""

from __future__ import annotations

import cmath
from collections.abc import Callable
from math import atan2, cos, exp, hypot, pi, radians, sin, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plain import plain, record, table
from scipy.integrate import solve_ivp

from meltemi.aero import polars as look_up
from meltemi.aero import variants
from meltemi.aero.polars import SectionCoefficients, ramp, wrap
from meltemi.aero.rotor import section_coefficients
from meltemi.aero.stall import hansen
from meltemi.aero.stall import section as flow_past
from meltemi.aero.stall.hansen import Stall, StallInput
from meltemi.aero.stall.section import (
    CAMBER,
    MAX_REDUCED_RATE,
    NO_ROTATION,
    OPENFAST,
    Rotation,
    SectionFlow,
    angle_at_three_quarters,
    section_rotation,
)
from meltemi.aero.tables import (
    AeroMemory,
    AeroNode,
    AeroOptions,
    AeroParameters,
    BladeFlow,
    FlapIncrement,
    FlapParameters,
    PolarPoint,
    SectionConstants,
    StallState,
)
from meltemi.compiler import Array3, KernelRecord, View
from meltemi.core.variants import number

STATIC, HANSEN = (number(variants.StallModel, name) for name in ("static", "hansen"))
LIFT, DRAG, MOMENT, ATTACHMENT, ATTACHED, SEPARATED = PolarPoint.slots(
    "lift drag moment attachment attached_lift separated_lift"
)
SLOPE, ZERO_LIFT, DRAG_FLOOR, DYNAMIC = SectionConstants.slots("slope zero_lift drag_floor dynamic")
Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=200)
AT_REST = Rotation(0.0, 0.0, 0.0)
GRID = np.linspace(-pi, pi, 1441)
RATE = 2.0 * 60.0 / 3.0
"""[1/s] U / (c/2) of a section with 3 m chord at 60 m/s."""


@pytest.fixture(scope="module")
def aero() -> Float:
    """The constants of the model's authors; for the whole module, as Hypothesis wants it."""
    array = AeroParameters.zeros()
    values = {"a1": 0.165, "a2": 0.335, "b1": 0.0455, "b2": 0.3, "pressure": 1.5, "separation": 6.0}
    for name, value in values.items():
        View(AeroParameters, array)[f"stall_{name}"] = value
    return array


class Foil(KernelRecord):
    """What the kernels of a section take of the record of the aerodynamics."""

    aero: AeroParameters
    aero_options: AeroOptions
    polars: PolarPoint
    section: SectionConstants


def foil(aero: Float, polars: Float, section: Float, reversed_flow: int = 1) -> Any:
    """Polars as kernels see them."""
    options = np.zeros(len(AeroOptions), dtype=np.int64)
    options[AeroOptions.index("reversed_flow")] = reversed_flow
    return Foil("floats", {"aero": aero, "aero_options": options, "polars": polars, "section": section})


def flow_at(
    g: int, alpha: float, rate: float = RATE, rotation: Rotation = AT_REST, weight: float = 1.0, behind: float = 0.0
) -> SectionFlow:
    """Flow past a section without flaps."""
    return SectionFlow(g, float(alpha), behind, rate, rotation, 0.0, weight)


def turned(pitching: float) -> Rotation:
    """A section that pitches."""
    return Rotation(pitching, pitching, 0.0)


def stall_steady(aero: Float, polars: Float, section: Float, g: int, alpha: float, pitching: float) -> Stall:
    return hansen.stall_steady(flow_at(g, alpha, rotation=turned(pitching)), foil(aero, polars, section))


def stall_advance(
    aero: Float,
    polars: Float,
    section: Float,
    g: int,
    y: Stall,
    old: StallInput,
    alpha: float,
    rate: float,
    pitching: float,
    weight: float,
    dt: float,
) -> tuple[Stall, StallInput]:
    x = flow_at(g, alpha, rate, turned(pitching), weight)
    return hansen.stall_advance(dt, y, old, x, foil(aero, polars, section))


def stall_derivative(
    aero: Float, polars: Float, section: Float, g: int, y: Stall, alpha: float, rate: float, pitching: float
) -> Stall:
    return hansen.stall_derivative(y, flow_at(g, alpha, rate, turned(pitching)), foil(aero, polars, section))


def stall_coefficients(
    aero: Float, polars: Float, section: Float, g: int, y: Stall, alpha: float, rotation: Rotation
) -> SectionCoefficients:
    return hansen.stall_coefficients(y, flow_at(g, alpha, rotation=rotation), foil(aero, polars, section))


def static_coefficients(polars: Float, g: int, alpha: float) -> SectionCoefficients:
    m = foil(AeroParameters.zeros(), polars, np.zeros((len(polars), len(SectionConstants))))
    return look_up.static_coefficients(float(alpha), g, m)


def model_weight(section: Float, g: int, alpha: float, speed: float) -> float:
    m = foil(AeroParameters.zeros(), np.zeros((len(section), 2, len(PolarPoint))), section)
    return flow_past.model_weight(float(alpha), speed, g, m)


@pytest.fixture(scope="module")
def plate(polar_of: Callable[..., tuple[Float, Float]]) -> tuple[Float, Float]:
    """A flat plate: lift 2 pi alpha up to 15 degrees, without drag; it stalls far beyond."""
    limit = radians(15.0)
    lift = 2.0 * pi * np.clip(GRID, -limit, limit) * np.cos(0.5 * GRID) ** 2
    lift[np.abs(GRID) <= limit + 1e-9] = 2.0 * pi * GRID[np.abs(GRID) <= limit + 1e-9]
    return polar_of(lift, np.zeros_like(GRID))


def march(
    aero: Float,
    airfoil: tuple[Float, Float],
    alpha: Callable[[float], float],
    end: float,
    n: int,
    *,
    start: float | None = None,
    g: int = 0,
) -> list[tuple[float, Stall]]:
    """Times and states for an angle of attack over time, from the steady state at ``start``."""
    polars, section = airfoil
    y = stall_steady(aero, polars, section, g, alpha(0.0) if start is None else start, 0.0)
    dt = end / n
    # with a step of zero the inputs are those of the first instant and the state stays
    y, old = stall_advance(
        aero, polars, section, g, y, StallInput(0.0, RATE, 0.0, 0.0), alpha(0.0), RATE, 0.0, 1.0, 0.0
    )
    found = [(0.0, y)]
    for i in range(1, n + 1):
        y, old = stall_advance(aero, polars, section, g, y, old, alpha(i * dt), RATE, 0.0, 1.0, dt)
        found.append((i * dt, y))
    return found


# static limit


@pytest.mark.slow
@pytest.mark.parametrize("g", range(6))
def test_in_steady_flow_all_coefficients_are_those_of_the_polar(
    aero: Float, polars: tuple[Float, Float], g: int
) -> None:
    for alpha in np.radians(np.linspace(-90.0, 90.0, 721)):  # the rows of the polar
        y = stall_steady(aero, *polars, g, alpha, 0.0)
        found = stall_coefficients(aero, *polars, g, y, alpha, AT_REST)
        # the states hold sums of angles and come back through a division by the lift slope: rounding times slopes
        assert found == pytest.approx(static_coefficients(polars[0], g, alpha), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("g", range(6))
def test_between_rows_the_lift_differs_by_interpolation_only(aero: Float, polars: tuple[Float, Float], g: int) -> None:
    for alpha in np.radians(np.linspace(-40.0, 40.0, 640) + 0.05):
        y = stall_steady(aero, *polars, g, alpha, 0.0)
        found = stall_coefficients(aero, *polars, g, y, alpha, AT_REST)
        static = static_coefficients(polars[0], g, alpha)
        # a product of two interpolated columns against the interpolated product: at most a quarter of the product
        # of their changes over a quarter of a degree, df < 0.15 and d(C_L,fa - C_L,fs) < 0.1
        assert found.lift == pytest.approx(static.lift, abs=0.25 * 0.15 * 0.1)
        assert found.drag == pytest.approx(static.drag, abs=1e-9)
        assert found.moment == pytest.approx(static.moment, abs=1e-9)


@pytest.mark.parametrize("g", range(6))
def test_the_tables_split_the_static_lift(polars: tuple[Float, Float], g: int) -> None:
    polar, section = polars[0][g], polars[1][g]
    f = polar[:, ATTACHMENT]
    np.testing.assert_allclose(
        f * polar[:, ATTACHED] + (1.0 - f) * polar[:, SEPARATED], polar[:, LIFT], rtol=0.0, atol=1e-12
    )
    assert np.all((f >= 0.0) & (f <= 1.0))
    assert f.max() == 1.0
    assert np.all(f[np.abs(GRID) > radians(60.0)] == 0.0)
    line = section[SLOPE] * (GRID - section[ZERO_LIFT])
    below = polar[:, LIFT] * np.sign(line) < np.abs(line)
    np.testing.assert_allclose(polar[below, ATTACHED], line[below], rtol=1e-12)
    near = np.abs(GRID) < radians(10.0)
    ratio = np.clip(polar[near, LIFT] / line[near], 0.25, 1.0)
    np.testing.assert_allclose(f[near], (2.0 * np.sqrt(ratio) - 1.0) ** 2, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@steady
@given(alpha=st.floats(-pi, pi), g=st.integers(0, 5), pitching=st.floats(-0.2, 0.2))
def test_nothing_changes_in_the_steady_state(
    aero: Float, polars: tuple[Float, Float], alpha: float, g: int, pitching: float
) -> None:
    y = stall_steady(aero, *polars, g, alpha, pitching)
    np.testing.assert_allclose(stall_derivative(aero, *polars, g, y, alpha, RATE, pitching), 0.0, rtol=0.0, atol=1e-11)
    after, old = stall_advance(
        aero, *polars, g, y, StallInput(alpha, RATE, y.pressure, y.attachment), alpha, RATE, pitching, 1.0, 0.7
    )
    np.testing.assert_allclose(after, y, rtol=0.0, atol=1e-12)
    assert old == pytest.approx((alpha, RATE, y.pressure, y.attachment), abs=1e-12)


@pytest.mark.parametrize("degrees", [-12.0, 4.0, 14.0, 25.0, 38.0])
def test_at_constant_angle_lift_and_drag_settle_at_the_polar(
    aero: Float, polars: tuple[Float, Float], degrees: float
) -> None:
    alpha = radians(degrees)
    for g in range(6):
        _, y = march(aero, polars, lambda t: alpha, 5.0, 100, start=0.0, g=g)[-1]
        found = stall_coefficients(aero, *polars, g, y, alpha, AT_REST)
        # the slowest lag is left with exp(-0.0455 * 200) = 1e-4 of its share of a sixth
        assert found == pytest.approx(static_coefficients(polars[0], g, alpha), abs=2e-4)


# indicial response of attached flow


def jones(s: float) -> float:
    """Wagner's function as Jones (1938) writes it, of the distance in semi-chords."""
    return 1.0 - 0.165 * exp(-0.0455 * s) - 0.335 * exp(-0.3 * s)


def test_a_step_of_the_angle_gives_wagners_function(aero: Float, plate: tuple[Float, Float]) -> None:
    before, after = radians(2.0), radians(8.0)
    for t, y in march(aero, plate, lambda t: after, 3.0, 60, start=before):
        s = t * RATE
        angle = before + (after - before) * jones(s)
        assert hansen.effective_angle(y, flow_at(0, after), foil(aero, *plate)) == pytest.approx(angle, abs=1e-14)
        # the flow is attached whatever the lags of pressure and separation
        found = stall_coefficients(aero, *plate, 0, y, after, AT_REST)
        assert y.attachment == pytest.approx(1.0, abs=1e-12)
        assert found.lift == pytest.approx(2.0 * pi * angle, abs=1e-12)
        # the lift stands on the flow behind the wake
        assert found.drag == pytest.approx((after - angle) * found.lift, abs=1e-12)


def test_jones_approximation_is_wagners_function() -> None:
    # Garrick (1938): (s + 2) / (s + 4) within 2 %, Jones within 1 %
    for s in np.linspace(0.0, 40.0, 41):
        assert jones(s) == pytest.approx((s + 2.0) / (s + 4.0), rel=0.03)


@pytest.mark.parametrize("n", [1, 7])
def test_the_wake_of_a_ramp_is_exact_whatever_the_step(aero: Float, plate: tuple[Float, Float], n: int) -> None:
    end, slope = 0.5, 0.1
    _, y = march(aero, plate, lambda t: slope * t, end, n)[-1]
    for found, A, b in ((y.wake_1, 0.165, 0.0455), (y.wake_2, 0.335, 0.3)):
        # x' = b RATE (A slope t - x) from rest
        tau = 1.0 / (b * RATE)
        assert found == pytest.approx(A * slope * (end - tau * (1.0 - exp(-end / tau))), rel=1e-12)


@pytest.mark.parametrize("k", [0.01, 0.05, 0.2])
def test_an_oscillation_gives_theodorsens_function(aero: Float, plate: tuple[Float, Float], k: float) -> None:
    # reduced frequency k = omega c / (2 U); after 300 semi-chords the start is forgotten to exp(-0.0455 * 300)
    omega, amplitude = k * RATE, radians(3.0)
    end = (300.0 + 2.0 * pi / k) / RATE
    n = round(end * omega / (2.0 * pi) * 200)
    found = march(aero, plate, lambda t: amplitude * sin(omega * t), end, n)
    C = 1.0 - 0.165 * 1j * k / (1j * k + 0.0455) - 0.335 * 1j * k / (1j * k + 0.3)
    for t, y in found[-200::10]:
        lift = stall_coefficients(aero, *plate, 0, y, amplitude * sin(omega * t), AT_REST).lift
        exact = 2.0 * pi * amplitude * (C * cmath.exp(1j * omega * t)).imag
        # second order: (2 pi / 200)^2 / 12 of the amplitude of the lags
        assert lift == pytest.approx(exact, abs=2e-4 * 2.0 * pi * amplitude)


# reversed flow


@pytest.mark.parametrize("k", [0.05, 0.3, 0.8])
@pytest.mark.parametrize("pitching", [0.0, 1.0])
def test_reversed_flow_is_the_mirror_image(
    aero: Float, polar_of: Callable[..., tuple[Float, Float]], k: float, pitching: float
) -> None:
    # a plate that oscillates about its middle, alike from both sides: lift at the quarter of the chord that leads
    behind = np.arcsin(np.sin(GRID)) * np.sign(np.cos(GRID))
    lift = 2.0 * pi * np.where(np.abs(behind) < 0.5, behind, 0.5 * np.sin(2.0 * GRID))
    moment = np.where(np.cos(GRID) < 0.0, 0.5 * lift, 0.0)
    plate = polar_of(lift, np.zeros_like(GRID), moment)
    omega, amplitude = k * RATE, radians(3.0)

    def angle(t: float) -> float:  # in the middle, and that of the rotation at three quarters from the leading edge
        return amplitude * (sin(omega * t) + 0.5 * k * cos(omega * t))

    for t, y in march(aero, plate, angle, 6.0 * pi / omega, 300)[100::10]:
        turning = amplitude * k * cos(omega * t)
        rotation = Rotation(turning, pitching * turning, 0.0)
        c, r = (
            hansen.stall_coefficients(y, flow_at(0, angle(t), rotation=rotation, behind=b), foil(aero, *plate))
            for b in (0.0, 1.0)
        )
        assert r.lift == pytest.approx(c.lift, abs=1e-12)  # the normal force changes its sign
        assert r.moment - 0.25 * r.lift == pytest.approx(c.moment + 0.25 * c.lift, abs=1e-12)  # about the middle
        # along the chord; the apparent-mass lift, normal to the chord, is of second order there
        suction = c.lift * (angle(t) - turning) - c.drag
        second_order = pi * pitching * turning**2
        assert r.lift * angle(t) - r.drag == pytest.approx(suction + second_order, abs=1e-12)


def test_reversed_flow_may_have_the_static_polar(polars: tuple[Float, Float]) -> None:
    static = foil(AeroParameters.zeros(), *polars, reversed_flow=0)
    assert flow_past.model_weight(radians(175.0), 50.0, 0, static) == 0.0


# separation


def test_the_advance_converges_to_the_differential_equation_with_second_order(
    aero: Float, polars: tuple[Float, Float]
) -> None:
    def alpha(t: float) -> float:
        return radians(14.0) + radians(6.0) * sin(6.0 * t)

    start = stall_steady(aero, *polars, 3, alpha(0.0), 0.0)
    truth = solve_ivp(
        lambda t, y: stall_derivative(aero, *polars, 3, Stall(*y), alpha(t), RATE, 0.0),
        (0.0, 0.6),
        start,
        rtol=1e-10,
        atol=1e-12,
        max_step=1e-3,
    ).y[:, -1]
    errors = [
        np.abs(np.array(march(aero, polars, alpha, 0.6, n, g=3)[-1][1]) - truth).max() for n in (30, 60, 120, 240)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # the polar has corners at its rows, which cost some of the order now and then
    assert np.mean(orders) == pytest.approx(2.0, abs=0.3)
    assert errors[-1] < 2e-3


def test_separation_lags_behind_by_its_time_constant(aero: Float, polars: tuple[Float, Float]) -> None:
    # with a pressure that stays, the attachment goes to its static value with T_f semi-chords
    alpha = radians(25.0)
    y = stall_steady(aero, *polars, 3, alpha, 0.0)
    old = StallInput(alpha, RATE, y.pressure, y.attachment)
    dt = 6.0 / RATE  # one time constant
    after, _ = stall_advance(aero, *polars, 3, y._replace(attachment=1.0), old, alpha, RATE, 0.0, 1.0, dt)
    assert after.attachment - y.attachment == pytest.approx((1.0 - y.attachment) * exp(-1.0), rel=1e-12)
    assert after.pressure == pytest.approx(y.pressure, rel=1e-12)


def test_pressure_lags_behind_by_its_time_constant(aero: Float, plate: tuple[Float, Float]) -> None:
    y = stall_steady(aero, *plate, 0, 0.1, 0.0)
    old = StallInput(0.1, RATE, y.pressure, y.attachment)
    after, _ = stall_advance(aero, *plate, 0, y._replace(pressure=0.0), old, 0.1, RATE, 0.0, 1.0, 1.5 / RATE)
    assert after.pressure == pytest.approx(y.pressure * (1.0 - exp(-1.0)), rel=1e-12)


def test_lift_overshoots_the_polar_on_the_way_into_stall_and_falls_short_on_the_way_out(
    aero: Float, polars: tuple[Float, Float]
) -> None:
    def alpha(t: float) -> float:
        return radians(15.0) - radians(8.0) * cos(4.0 * t)

    found = march(aero, polars, alpha, pi, 1000, g=3)[-500:]  # the second of two periods
    lift = [stall_coefficients(aero, *polars, 3, y, alpha(t), AT_REST).lift for t, y in found]
    static = [static_coefficients(polars[0], 3, alpha(t)).lift for t, _ in found]
    up, down = 125, 375
    assert alpha(found[up][0]) == pytest.approx(alpha(found[down][0]), abs=1e-2)
    assert lift[up] > static[up] + 0.05
    assert lift[down] < static[down] - 0.05
    assert max(lift) > max(static) + 0.2


@steady
@given(seed=st.integers(0, 10**6), g=st.integers(0, 5), dt=st.floats(1e-4, 1.0))
def test_states_stay_bounded_whatever_the_flow_and_step(
    aero: Float, polars: tuple[Float, Float], seed: int, g: int, dt: float
) -> None:
    rng = np.random.default_rng(seed)
    y, old = Stall(0.0, 0.0, 0.0, 1.0), StallInput(0.0, RATE, 0.0, 1.0)
    for _ in range(20):
        alpha, rate = float(rng.uniform(-pi, pi)), float(rng.uniform(0.0, 200.0))
        y, old = stall_advance(aero, *polars, g, y, old, alpha, rate, float(rng.uniform(-1.5, 1.5)), 1.0, dt)
        assert abs(y.wake_1) <= 0.165 * pi
        assert abs(y.wake_2) <= 0.335 * pi
        assert 0.0 <= y.attachment <= 1.0
        assert abs(y.pressure) <= abs(polars[1][g, SLOPE]) * (pi + 0.2) + 1.5 * pi


@steady
@given(
    wakes=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.2, 0.2)),
    x4=st.floats(0.0, 1.0),
    alpha=st.floats(-0.7, 0.7),
    g=st.integers(0, 5),
    turning=st.floats(-0.3, 0.3),
    pitching=st.floats(-0.3, 0.3),
    tilt=st.floats(-0.3, 0.3),
)
def test_coefficients_by_hand(
    aero: Float,
    polars: tuple[Float, Float],
    wakes: tuple[float, float],
    x4: float,
    alpha: float,
    g: int,
    turning: float,
    pitching: float,
    tilt: float,
) -> None:
    effective = 0.5 * alpha + sum(wakes)

    def at(column: int) -> float:
        return float(np.interp(effective, GRID, polars[0][g, :, column]))

    f, floor = at(ATTACHMENT), polars[1][g, DRAG_FLOOR]
    circulatory = x4 * at(ATTACHED) + (1.0 - x4) * at(SEPARATED)
    separation = 0.5 * (sqrt(f) - sqrt(x4)) - 0.25 * (f - x4)
    found = stall_coefficients(aero, *polars, g, Stall(*wakes, 99.0, x4), alpha, Rotation(turning, pitching, tilt))
    # places in the polar are found to 1e-13 of a row; the root of a small f doubles the number of lost digits
    assert found.lift == pytest.approx(circulatory + pi * pitching, abs=1e-9)
    drag = at(DRAG) + (alpha - effective + tilt) * circulatory + (at(DRAG) - floor) * separation
    assert found.drag == pytest.approx(drag, abs=1e-6)
    assert found.moment == pytest.approx(at(MOMENT) - 0.25 * pi * (turning + pitching), abs=1e-9)


# rotation


@steady
@given(
    alpha=st.floats(-3.1, 3.1), speed=st.floats(0.1, 100.0), rotation=st.floats(-3.0, 3.0), chord=st.floats(0.1, 5.0)
)
def test_rotation_adds_to_the_flow_half_a_chord_behind(
    alpha: float, speed: float, rotation: float, chord: float
) -> None:
    found = angle_at_three_quarters(alpha, speed, rotation, chord)
    x, y = speed * cos(alpha), speed * sin(alpha) + 0.5 * chord * rotation
    if hypot(x, y) > 1e-6:
        assert wrap(found - atan2(y, x)) == pytest.approx(0.0, abs=1e-12)


def test_without_rotation_the_angle_is_that_at_the_aerodynamic_centre() -> None:
    for alpha in np.linspace(-3.1, 3.1, 63):
        assert angle_at_three_quarters(alpha, 50.0, 0.0, 3.0) == pytest.approx(alpha, abs=1e-14)


def test_what_the_variants_of_rotation_take() -> None:
    # rotation 2 rad/s, of which the section pitches with 0.5 rad/s, T = 0.1 s
    assert section_rotation(NO_ROTATION, 2.0, 0.5, 10.0) == (0.0, 0.0, 0.0)
    assert section_rotation(CAMBER, 2.0, 0.5, 10.0) == pytest.approx((0.2, 0.05, 0.0))
    assert section_rotation(OPENFAST, 2.0, 0.5, 10.0) == pytest.approx((0.2, 0.2, 0.2))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_section_that_turns_faster_than_the_air_passes_is_limited(sign: float) -> None:
    limit = sign * MAX_REDUCED_RATE
    assert section_rotation(CAMBER, sign * 100.0, sign * 90.0, 10.0) == (limit, limit, 0.0)


def test_pitching_gives_the_added_mass_of_the_flat_plate(aero: Float, plate: tuple[Float, Float]) -> None:
    # thin aerofoil theory: pi T omega at once in the lift, -pi/2 T omega in the moment about the quarter chord
    alpha, pitching = 0.05, 0.02
    y = stall_steady(aero, *plate, 0, alpha, 0.0)
    still = stall_coefficients(aero, *plate, 0, y, alpha, AT_REST)
    moved = stall_coefficients(aero, *plate, 0, y, alpha, Rotation(pitching, pitching, 0.0))
    assert moved.lift - still.lift == pytest.approx(pi * pitching, abs=1e-14)
    assert moved.moment - still.moment == pytest.approx(-0.5 * pi * pitching, abs=1e-14)
    assert moved.drag == still.drag


@pytest.mark.parametrize(
    ("alpha", "reversed_flow", "angle", "reversed_"),
    [
        (0.1, 1, atan2(60.0 * sin(0.1) + 0.5 * 0.8 * 3.0, 60.0 * cos(0.1)), 0.0),
        (-1.5, 1, atan2(-60.0 * sin(1.5) + 0.5 * 0.8 * 3.0, 60.0 * cos(1.5)), 0.0),
        (1.6, 1, 1.6 - pi, 1.0),
        (-1.6, 1, pi - 1.6, 1.0),
        (3.0, 1, 3.0 - pi, 1.0),
        (3.0, 0, atan2(60.0 * sin(3.0) + 0.5 * 0.8 * 3.0, 60.0 * cos(3.0)), 0.0),
    ],
)
def test_flow_past_a_section_from_before_and_behind(
    alpha: float, reversed_flow: int, angle: float, reversed_: float
) -> None:
    one = {"blade": 1, "node": 1}
    m = record(
        Node,
        flow=table(BladeFlow, one, alpha=alpha, speed=60.0, rotation=0.8, pitching=0.3),
        aero_options=table(AeroOptions, {}, stall_rotation=CAMBER, reversed_flow=reversed_flow),
        aero_nodes=table(AeroNode, one, chord=3.0, polar=1.0),
        section=table(SectionConstants, {"polar": 2}, dynamic=(0.0, 1.0)),
    )
    found = plain(flow_past.section_flow)(0.05, m, 0, 0)
    assert found[:4] == pytest.approx((1, angle, reversed_, 40.0))
    assert found.rotation == pytest.approx((0.8 / 40.0, 0.3 / 40.0, 0.0))
    assert (found.flap, found.weight) == (0.05, plain(flow_past.model_weight)(alpha, 60.0, 1, m))


@pytest.mark.parametrize("flap", [0.1, -0.2])
def test_the_lift_of_a_flap_builds_up_as_its_wake_does(aero: Float, polars: tuple[Float, Float], flap: float) -> None:
    """(A-33, A-48): the polar has the whole of it, so the effective angle first lacks what the wake takes."""
    m, before = foil(aero, *polars), flow_at(0, 0.05)
    after = before._replace(flap=flap)
    y = plain(hansen.stall_steady)(before, m)
    assert plain(hansen.effective_angle)(y, before, m) == pytest.approx(0.05)
    assert plain(hansen.effective_angle)(y, after, m) == pytest.approx(0.05 - (0.165 + 0.335) * flap)
    assert plain(hansen.effective_angle)(plain(hansen.stall_steady)(after, m), after, m) == pytest.approx(0.05)


# fading


@pytest.mark.parametrize(
    ("degrees", "speed", "expected"),
    [
        (0.0, 50.0, 1.0),
        (40.0, 50.0, 1.0),
        (42.5, 50.0, 0.5),
        (45.0, 50.0, 0.0),
        (120.0, 50.0, 0.0),
        (135.0, 50.0, 0.0),
        (137.5, 50.0, 0.5),
        (140.0, 50.0, 1.0),
        (180.0, 50.0, 1.0),
        (0.0, 0.0, 0.0),
        (0.0, 0.01, 0.0),
        (0.0, 0.505, 0.5),
        (0.0, 1.0, 1.0),
        (42.5, 0.505, 0.25),
    ],
)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_weight_of_the_model(
    polars: tuple[Float, Float], degrees: float, speed: float, expected: float, sign: float
) -> None:
    assert model_weight(polars[1], 0, sign * radians(degrees), speed) == pytest.approx(expected, abs=1e-12)


def test_sections_without_dynamic_stall_have_no_weight(polars: tuple[Float, Float]) -> None:
    section = polars[1].copy()
    section[2, DYNAMIC] = 0.0
    assert model_weight(section, 2, 0.1, 50.0) == 0.0
    assert model_weight(section, 1, 0.1, 50.0) == 1.0


def test_weights_fall_smoothly(polars: tuple[Float, Float]) -> None:
    weights = np.array([model_weight(polars[1], 0, a, 50.0) for a in np.radians(np.linspace(39.0, 46.0, 701))])
    assert np.all(np.diff(weights) <= 0.0)
    # a hundredth of a degree in five, half a cosine: at most pi/2 of the mean slope
    assert np.abs(np.diff(weights)).max() <= 0.5 * pi * 0.01 / 5.0 * (1.0 + 1e-9)
    assert np.abs(np.diff(weights, 2)).max() < 1e-4


@steady
@given(x=st.floats(-10.0, 10.0))
def test_ramp_is_half_a_cosine(x: float) -> None:
    assert ramp(x, -1.0, 3.0) == pytest.approx(0.5 - 0.5 * cos(pi * min(max((x + 1.0) / 4.0, 0.0), 1.0)), abs=1e-15)


@steady
@given(angle=st.floats(-1e3, 1e3))
def test_wrapped_angles_are_the_same_angle(angle: float) -> None:
    found = wrap(angle)
    assert -pi <= found <= pi
    assert cos(found) == pytest.approx(cos(angle), abs=1e-12)
    assert sin(found) == pytest.approx(sin(angle), abs=1e-12)


def test_where_the_model_is_off_the_state_is_the_steady_one(aero: Float, polars: tuple[Float, Float]) -> None:
    y, old = Stall(0.1, -0.2, 3.0, 0.4), StallInput(0.0, RATE, 0.0, 1.0)
    alpha = radians(60.0)
    after, _ = stall_advance(aero, *polars, 0, y, old, alpha, RATE, 0.0, 0.0, 0.01)
    assert after == pytest.approx(stall_steady(aero, *polars, 0, alpha, 0.0), abs=1e-15)


def test_while_the_model_fades_the_state_goes_on(aero: Float, polars: tuple[Float, Float]) -> None:
    # only the coefficients are blended, so the state does not depend on the length of the step
    y, old = Stall(0.1, -0.2, 3.0, 0.4), StallInput(0.5, RATE, 2.0, 0.5)
    states = [stall_advance(aero, *polars, 0, y, old, 0.72, RATE, 0.0, w, 0.01)[0] for w in (0.001, 0.5, 1.0)]
    assert states[0] == states[1] == states[2]
    assert states[0] != pytest.approx(stall_steady(aero, *polars, 0, 0.72, 0.0), abs=1e-3)


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_with_a_step_of_zero_the_state_stays(aero: Float, polars: tuple[Float, Float], weight: float) -> None:
    y = Stall(0.1, -0.2, 3.0, 0.4)
    after, old = stall_advance(aero, *polars, 0, y, StallInput(9.0, 9.0, 9.0, 9.0), 0.2, RATE, 0.1, weight, 0.0)
    assert after == pytest.approx(y, abs=1e-15)
    assert old[:2] == (0.2, RATE)


# variants at a node


def node(model: int, alpha: float, speed: float = 60.0, turn: float = 0.0) -> dict[str, Float]:
    """Arrays of one node in a flow, for ``section_coefficients``."""
    options = np.zeros(len(AeroOptions), dtype=np.int64)
    options[AeroOptions.index("stall")] = model
    options[AeroOptions.index("stall_rotation")] = CAMBER
    nodes, flow = AeroNode.zeros(blade=1, node=1), BladeFlow.zeros(blade=1, node=1)
    nodes[AeroNode.index("chord")] = 3.0
    for name, value in {"alpha": alpha, "speed": speed, "rotation": turn, "pitching": turn}.items():
        flow[BladeFlow.index(name)] = value
    memory, stall = AeroMemory.zeros(blade=1, node=1), StallState.zeros(blade=1, node=1)
    stall[StallState.index("wake_1")], stall[StallState.index("attachment")] = 0.02, 0.6
    return {"options": options, "nodes": nodes, "flow": flow, "memory": memory, "stall": stall}


class Node(KernelRecord):
    """What a node's coefficients take of the record of the aerodynamics."""

    aero: AeroParameters
    aero_options: AeroOptions
    aero_nodes: AeroNode
    polars: PolarPoint
    section: SectionConstants
    flap_nodes: Array3
    increments: FlapIncrement
    flap: FlapParameters
    flow: BladeFlow
    memory: AeroMemory
    stall: StallState


def evaluated(aero: Float, airfoil: tuple[Float, Float], at: dict[str, Float], dt: float = 0.0) -> SectionCoefficients:
    no_flaps = {"flap_nodes": (0, 1, 1), "increments": (0, 1, 3), "flap": (4, 0, 1)}
    m = Node(
        "floats",
        {
            "aero": aero,
            "aero_options": at["options"],
            "aero_nodes": at["nodes"],
            "polars": airfoil[0],
            "section": airfoil[1],
            **{name: np.zeros(shape) for name, shape in no_flaps.items()},
            **{name: at[name] for name in ("flow", "memory", "stall")},
        },
    )
    section_coefficients(dt, m, 0, 0)
    return SectionCoefficients(*(float(at["flow"][BladeFlow.index(name), 0, 0]) for name in ("lift", "drag", "moment")))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-170.0, -20.0, 0.0, 8.0, 42.0, 90.0])
def test_the_null_variant_is_the_static_polar(aero: Float, polars: tuple[Float, Float], degrees: float) -> None:
    alpha = radians(degrees)
    at = node(STATIC, alpha, turn=1.0)
    before = at["stall"].copy()
    assert evaluated(aero, polars, at, 0.01) == static_coefficients(polars[0], 0, alpha)
    assert np.array_equal(at["stall"], before)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("degrees", "speed", "same"), [(8.0, 60.0, False), (44.0, 60.0, False), (46.0, 60.0, True), (8.0, 0.005, True)]
)
def test_far_from_attached_flow_the_dynamic_variant_is_the_static_one(
    aero: Float, polars: tuple[Float, Float], degrees: float, speed: float, same: bool
) -> None:
    found = evaluated(aero, polars, node(HANSEN, radians(degrees), speed))
    static = static_coefficients(polars[0], 0, radians(degrees))
    assert (found == pytest.approx(static, abs=1e-12)) is same


@pytest.mark.slow
def test_the_coefficients_of_a_node_are_blended(aero: Float, polars: tuple[Float, Float]) -> None:
    alpha = radians(42.5)
    at = node(HANSEN, alpha)
    state = Stall(*(float(v) for v in at["stall"][:, 0, 0]))
    dynamic = stall_coefficients(aero, *polars, 0, state, alpha, AT_REST)
    static = static_coefficients(polars[0], 0, alpha)
    expected = 0.5 * (np.array(dynamic) + np.array(static))
    assert evaluated(aero, polars, at) == pytest.approx(tuple(expected), abs=1e-12)
