"""The momentum balance of one strip: solved everywhere, by the equations of Ning and Buhl."""

from __future__ import annotations

from collections.abc import Callable
from math import acos, atan2, cos, exp, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meltemi.aero import bem
from meltemi.aero.bem import LOSS_FLOOR, PHI_HIGH, PHI_LOW, Induction, Onset, Strip, loss_factor
from meltemi.aero.tables import AeroOptions, AeroParameters, PolarPoint
from meltemi.compiler import KernelRecord, View

Float = NDArray[np.float64]
HUB = 0.0238
"""Relative hub radius of the reference turbine."""
ITERATIONS = 30

LIFT, DRAG = PolarPoint.slots("lift drag")


class Foils(KernelRecord):
    """What the momentum balance takes of the record of the aerodynamics."""

    aero: AeroParameters
    aero_options: AeroOptions
    polars: PolarPoint


def seen(
    polars: Float, axial_drag: float, tangential_drag: float, buhl: int, iterations: int = 0, tolerance: float = 0.0
) -> Any:
    """Polars and options as kernels see them."""
    aero, options = AeroParameters.zeros(), np.zeros(len(AeroOptions), dtype=np.int64)
    view = View(AeroParameters, aero)
    view["induction_tolerance"] = tolerance
    view["axial_drag"], view["tangential_drag"] = axial_drag, tangential_drag
    options[AeroOptions.index("high_induction")], options[AeroOptions.index("iterations")] = buhl, iterations
    return Foils("floats", {"aero": aero, "aero_options": options, "polars": polars})


def strip_at(
    x: float, vx: float, vy: float, *, theta: float = 0.0, solidity: float = 0.05, polar: int = 0, blades: int = 3
) -> Strip:
    """A strip at relative radius x."""
    return Strip(
        vx, vy, theta, solidity, blades * (1.0 - x) / (2.0 * x), blades * (x - HUB) / (2.0 * HUB), polar, 0.02, 1.0
    )


def solve(
    strip: Strip, polars: Float, phi: float = 0.1, slope: float = 1.0, buhl: int = 1, drag: float = 0.0
) -> Induction:
    return bem.induction(phi, slope, strip, seen(polars, drag, drag, buhl, ITERATIONS))


def random_strips(n: int, seed: int, polars: Float) -> list[Strip]:
    """Strips of a rotor in every kind of wind and rotation, zero and backwards included, at any pitch."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < n:
        x = float(rng.uniform(0.03, 0.998))
        vx = float(rng.choice([0.0, rng.uniform(-30.0, 30.0), rng.uniform(0.0, 30.0), 0.0]))
        vy = float(rng.choice([0.0, rng.uniform(-90.0, 90.0), rng.uniform(0.0, 90.0)]))
        theta = float(rng.uniform(-pi, pi) if rng.random() < 0.2 else rng.uniform(-0.3, 1.6))
        solidity = float(min(rng.uniform(0.002, 0.05) / x, 0.5))
        if abs(vx) + abs(vy) > 0.0:
            found.append(strip_at(x, vx, vy, theta=theta, solidity=solidity, polar=int(rng.integers(len(polars)))))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("drag", [0.0, 1.0])
def test_the_balance_is_met_in_every_wind_and_rotation(polars: tuple[Float, Float], drag: float) -> None:
    rng = np.random.default_rng(11)
    for strip in random_strips(3000, 1, polars[0]):
        solution = solve(strip, polars[0], phi=float(rng.uniform(-1.0, 2.5)), drag=drag)
        assert abs(solution.residual) < 1e-10, strip
        assert np.isfinite(solution).all()


@pytest.mark.slow
def test_a_warm_start_changes_nothing_that_matters(polars: tuple[Float, Float]) -> None:
    for strip in random_strips(1500, 2, polars[0]):
        cold = solve(strip, polars[0])
        warm = solve(strip, polars[0], cold.phi, cold.slope)
        assert warm.a == pytest.approx(cold.a, abs=1e-9)
        assert warm.ap == pytest.approx(cold.ap, abs=1e-9)


@pytest.mark.parametrize("drag", [0.0, 1.0])
def test_every_guess_finds_the_same_solution(polars: tuple[Float, Float], drag: float) -> None:
    """In the operation of a turbine, from a windmill's inflow angles to those of a propeller and of reversed flow."""
    rng = np.random.default_rng(5)
    for _ in range(300):
        x, vx, speed_ratio = rng.uniform(0.25, 0.97), rng.uniform(4.0, 20.0), rng.uniform(4.0, 11.0)
        theta = 0.24 * (1.0 - x) + rng.uniform(0.0, 0.2)
        strip = strip_at(x, vx, x * speed_ratio * vx, theta=theta, solidity=0.025 / x)
        found = [solve(strip, polars[0], phi=phi, drag=drag).a for phi in (-0.7, -0.2, -0.02, 0.1, 0.5, 1.5, 2.2)]
        assert np.ptp(found) < 1e-9, strip
        assert max(found) < 1.0


def polynomial(thrust: float) -> float:
    """Induction factor of HAWC2 (Madsen et al. 2020)."""
    return 0.2460 * thrust + 0.0586 * thrust**2 + 0.0883 * thrust**3


@pytest.mark.parametrize("s", [0.0, 1e-4, 0.03, 0.2, 0.7, 1.0])
def test_madsens_balance_is_his_polynomial(s: float) -> None:
    """Newton's steps end at rounding for every load; where all flow is turned the thrust coefficient is 1.682."""
    for kappa in np.geomspace(1e-6, 3.0, 40):
        y = bem.madsen_axial(s, kappa)
        assert 1.0 - s / y == pytest.approx(polynomial(4.0 * kappa / y**2), abs=1e-12)
    kappa = 0.02
    turned = bem.madsen_axial(0.0, kappa)
    assert 4.0 * kappa / turned**2 == pytest.approx(1.6822, abs=1e-4)
    step = 1e-6
    slopes = [(bem.madsen_axial(x, kappa) - turned) / x for x in (step, -step)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)


def test_madsens_strip_takes_thrust_along_the_shaft_and_torque_without_loss(polars: tuple[Float, Float]) -> None:
    """The solved strip has the polynomial's thrust, of n^2 of its force, and the angular momentum of 4 pi r g."""
    for x, theta, lean in ((0.5, 0.1, 1.0), (0.95, 0.02, 1.0), (0.6, 0.08, 0.97), (0.8, 0.04, 0.9)):
        strip = strip_at(x, 8.0, 8.0 * 7.5 * x, theta=theta, solidity=0.025 / x)._replace(lean=lean)
        found = solve(strip, polars[0], buhl=bem.MADSEN)
        assert abs(found.residual) < 1e-10
        s, c = sin(found.phi), cos(found.phi)
        table = polars[0][0, :, LIFT].ravel()
        lift = float(np.interp(found.phi - theta, np.linspace(-pi, pi, len(table)), table))
        F = loss_factor(strip.tip_number, strip.hub_number, s)
        speed = (1.0 - found.a) / s
        assert found.a == pytest.approx(polynomial(strip.solidity * lift * c * lean**2 * speed**2 / F), abs=1e-6)
        assert found.a < 0.75  # the flow is that through the annulus
        turned = strip.solidity * lift * s * lean * (1.0 + found.ap) / (4.0 * s * c)
        assert found.ap == pytest.approx(turned, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("axial_drag", "tangential_drag"), [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0)])
def test_the_balance_has_one_solution_whatever_the_drag(
    polar_of: Callable[..., tuple[Float, Float]], axial_drag: float, tangential_drag: float
) -> None:
    """A scan over inflow, solidity, pitch and drag: the residual changes its sign once between -pi/4 and 3 pi/4."""
    fine = np.geomspace(1e-5, 0.25 * pi, 120)
    angles = np.concatenate([-fine[::-1], [0.0], fine, np.linspace(0.25 * pi, PHI_HIGH, 60)[1:]])
    grid = np.linspace(-pi, pi, 1441)
    rng = np.random.default_rng(7)
    for _ in range(40):
        attached = 1.0 / (1.0 + np.exp((np.abs(grid) - rng.uniform(0.15, 0.3)) / 0.05))
        lift = attached * 2.0 * pi * np.sin(grid + rng.uniform(0.0, 0.1)) + (1.0 - attached) * 1.1 * np.sin(2.0 * grid)
        drag = 10.0 ** rng.uniform(-3.0, -0.7) + rng.uniform(0.1, 2.0) * np.sin(grid) ** 2
        polar = polar_of(lift, drag)[0]
        for _ in range(10):
            x = float(rng.uniform(0.1, 0.99))
            inflow = atan2(1.0, x * rng.uniform(1.0, 14.0))
            theta = float(rng.choice([rng.uniform(-0.1, 0.5), 0.67 * inflow + rng.uniform(-0.2, 0.05)]))
            solidity = float(min(rng.uniform(0.01, 0.06) / x, 0.3))
            strip = strip_at(x, sin(inflow), cos(inflow), theta=theta, solidity=solidity)
            onset, m = Onset(strip.vx, strip.vy, 1.0, 1.0), seen(polar, axial_drag, tangential_drag, 1)
            residual = np.array([bem.balance(float(phi), strip, onset, m).residual for phi in angles])
            assert np.count_nonzero(np.diff(np.sign(residual))) == 1, (
                strip,
                angles[:-1][np.diff(np.sign(residual)) != 0],
            )
            assert residual[0] < 0.0 < residual[-1]


def test_from_a_nearby_solution_the_tolerance_leaves_little(polars: tuple[Float, Float]) -> None:
    worst = 0.0
    for strip in random_strips(1000, 3, polars[0]):
        if strip.vx > 3.0 and strip.vy > 10.0 and abs(strip.theta) < 0.5:
            before = solve(strip._replace(vx=strip.vx * 0.99), polars[0])
            now = bem.induction(before.phi, before.slope, strip, seen(polars[0], 0.0, 0.0, 1, 5, 1e-6))
            worst = max(worst, abs(now.a - solve(strip, polars[0], before.phi, before.slope).a))
    # a change of the wind by a per cent in one time step, far more than turbulence brings
    assert 0.0 < worst < 1e-5


def test_still_air_is_no_problem(polars: tuple[Float, Float]) -> None:
    for vx, vy in ((0.0, 0.0), (1e-9, 0.0), (0.0, -1e-9), (-0.0, -0.0)):
        solution = solve(strip_at(0.7, vx, vy), polars[0])
        assert np.isfinite(solution).all()


def test_factors_are_bounded(polars: tuple[Float, Float]) -> None:
    for strip in random_strips(500, 4, polars[0]):
        solution = solve(strip, polars[0])
        assert -1.0 <= solution.a <= 1.5
        assert -1.0 <= solution.ap <= 1.0
        assert PHI_LOW <= solution.phi <= PHI_HIGH


def coefficients(polars: Float, strip: Strip, phi: float) -> tuple[float, float]:
    """Lift and drag at an inflow angle, by NumPy's interpolation."""
    grid = np.linspace(-pi, pi, polars.shape[1])
    alpha = (phi - strip.theta + pi) % (2.0 * pi) - pi
    return float(np.interp(alpha, grid, polars[strip.polar, :, LIFT])), float(
        np.interp(alpha, grid, polars[strip.polar, :, DRAG])
    )


@pytest.mark.parametrize(("axial_drag", "tangential_drag"), [(0.0, 0.0), (1.0, 1.0)])
@pytest.mark.parametrize("buhl", [0, 1])
def test_solutions_are_those_of_classical_momentum_theory(
    polars: tuple[Float, Float], axial_drag: float, tangential_drag: float, buhl: int
) -> None:
    # forces on the annulus from the momentum theorem and from the blade element must be the same
    light = heavy = 0
    rng = np.random.default_rng(8)
    for _ in range(1000):
        strip = strip_at(
            float(rng.uniform(0.15, 0.98)),
            float(rng.uniform(3.0, 20.0)),
            float(rng.uniform(20.0, 90.0)),
            theta=float(rng.uniform(-0.05, 0.3)),
            solidity=float(rng.uniform(0.01, 0.08)),
            polar=int(rng.integers(6)),
        )
        a, ap, _, _, residual = bem.induction(0.1, 1.0, strip, seen(polars[0], axial_drag, tangential_drag, buhl, 60))
        if not (-0.3 < a < 0.95) or abs(ap) > 0.5:
            continue
        phi = atan2(strip.vx * (1.0 - a), strip.vy * (1.0 + ap))
        s, c = sin(phi), cos(phi)
        cl, cd = coefficients(polars[0], strip, phi)
        F = (2.0 / pi) ** 2 * acos(exp(-strip.tip_number / s)) * acos(exp(-strip.hub_number / s))
        thrust = strip.solidity * (cl * c + axial_drag * cd * s) * (1.0 - a) ** 2 / s**2
        torque = strip.solidity * (cl * s - tangential_drag * cd * c) * (1.0 - a) * (1.0 + ap) / (s * c)
        flow = 1.0 - a
        if a <= 0.4 or not buhl:
            momentum = 4.0 * F * a * flow
            light += 1
        else:  # Buhl (2005), equation 17, and the flow that takes up this thrust
            momentum = 8.0 / 9.0 + (4.0 * F - 40.0 / 9.0) * a + (50.0 / 9.0 - 4.0 * F) * a * a
            flow = momentum / (4.0 * F * a)
            heavy += 1
        # the balance is met to 1e-10 in the inflow angle; dividing by sin(phi)^2 costs two digits
        assert thrust == pytest.approx(momentum, abs=1e-7)
        assert torque == pytest.approx(4.0 * F * ap * flow, abs=1e-7)
        assert abs(residual) < 1e-10
    assert light > 300
    assert heavy > 50 or not buhl


def test_nothing_is_induced_without_lift(polars: tuple[Float, Float]) -> None:
    nothing = np.zeros_like(polars[0])
    for strip in random_strips(300, 5, polars[0]):
        solution = solve(strip._replace(polar=0), nothing)
        if abs(strip.vx) > 0.5 and abs(strip.vy) > 0.5:
            assert solution.a == pytest.approx(0.0, abs=1e-10)
            assert solution.ap == pytest.approx(0.0, abs=1e-10)
            assert solution.phi == pytest.approx(atan2(abs(strip.vx), abs(strip.vy)), abs=1e-10)


@pytest.fixture(scope="module")
def symmetric(polar_of: Callable[..., tuple[Float, Float]]) -> Float:
    """A flat plate: odd lift, even drag."""
    grid = np.linspace(-pi, pi, 1441)
    return polar_of(np.sin(2.0 * grid) * 1.5, 0.01 + 1.2 * np.sin(grid) ** 2)[0]


def test_wind_from_behind_and_backward_rotation_are_mirror_images(symmetric: Float) -> None:
    for strip in random_strips(300, 6, symmetric):
        if strip.vx <= 0.0 or strip.vy <= 0.0:
            continue
        forward = solve(strip, symmetric)
        behind = solve(strip._replace(vx=-strip.vx, theta=-strip.theta), symmetric)
        backward = solve(strip._replace(vy=-strip.vy, theta=pi - strip.theta), symmetric)
        for mirrored in (behind, backward):
            assert mirrored.a == pytest.approx(forward.a, abs=1e-9)
            assert mirrored.ap == pytest.approx(forward.ap, abs=1e-9)


@settings(derandomize=True, deadline=None, max_examples=200)
@given(tip=st.floats(1e-3, 50.0), hub=st.floats(1e-3, 50.0), s=st.floats(1e-3, 1.0))
def test_prandtls_factor(tip: float, hub: float, s: float) -> None:
    expected = (2.0 / pi * acos(exp(-tip / s))) * (2.0 / pi * acos(exp(-hub / s)))
    assert loss_factor(tip, hub, s) == pytest.approx(max(expected, LOSS_FLOOR), rel=1e-14)


def test_prandtls_factor_vanishes_at_the_tip_and_is_one_far_from_both_ends() -> None:
    assert loss_factor(0.0, 5.0, 0.1) == LOSS_FLOOR
    assert loss_factor(5.0, 0.0, 0.1) == LOSS_FLOOR
    assert loss_factor(1e9, 1e9, 0.1) == pytest.approx(1.0, rel=1e-15)
    assert loss_factor(5.0, 5.0, 0.0) == pytest.approx(1.0, rel=1e-15)
    # Glauert's example: three blades at 90 % of the radius, sin(phi) = 0.1, f = 3 * 0.1 / (2 * 0.9 * 0.1)
    assert loss_factor(3.0 * 0.1 / (2.0 * 0.9), 1e9, 0.1) == pytest.approx(2.0 / pi * acos(exp(-5.0 / 3.0)), rel=1e-14)


def test_prandtls_factor_rises_from_the_tip_inwards() -> None:
    factors = [loss_factor(number, 1e9, 0.1) for number in np.linspace(0.0, 2.0, 50)]
    assert np.all(np.diff(factors) > 0.0)


CONSTANT_LIFT = np.zeros((1, 1441, 6))
CONSTANT_LIFT[0, :, LIFT] = 1.0


def axial(solidity: float, phi: float, tip_number: float = 1e9, buhl: int = 1) -> float:
    """s / (1 - a) at an inflow angle for lift coefficient 1."""
    strip = Strip(10.0, 50.0, 0.0, solidity, tip_number, 1e9, 0, 0.02, 1.0)
    return bem.balance(phi, strip, Onset(0.2, 0.98, 1.0, 1.0), seen(CONSTANT_LIFT, 0.0, 0.0, buhl)).axial


@pytest.mark.parametrize("phi", [0.03, 0.1, 0.4])
@pytest.mark.parametrize("tip_number", [1e9, 0.1, 0.02])
def test_momentum_theory_and_buhl_join_smoothly_at_an_induction_of_four_tenths(phi: float, tip_number: float) -> None:
    s = sin(phi)
    F = loss_factor(tip_number, 1e9, s)
    # kappa = solidity * c / (4 F) = 2/3 s^2 there
    junction = (2.0 / 3.0) * s * s * 4.0 * F / cos(phi)
    at = axial(junction, phi, tip_number)
    assert 1.0 - s / at == pytest.approx(0.4, abs=1e-12)
    h = 1e-5
    below, above = (axial(junction * (1.0 + d), phi, tip_number) for d in (-h, h))
    # the value is continuous, and so is the slope: both differences are h times the same slope, to h^2
    assert above - at == pytest.approx(at - below, rel=20.0 * h / F)
    assert above > at > below


@pytest.mark.parametrize("phi", [1e-3, 0.1, 0.5])
@pytest.mark.parametrize("tip_number", [1e9, 0.1])
def test_heavy_loading_follows_buhls_parabola(phi: float, tip_number: float) -> None:
    s, F = sin(phi), loss_factor(tip_number, 1e9, sin(phi))
    for kappa in s * s * np.array([0.7, 1.0, 3.0, 30.0]):
        a = 1.0 - s / axial(4.0 * F * kappa / cos(phi), phi, tip_number)
        thrust = 4.0 * F * kappa * (1.0 - a) ** 2 / s**2
        expected = 8.0 / 9.0 + (4.0 * F - 40.0 / 9.0) * a + (50.0 / 9.0 - 4.0 * F) * a * a
        assert a > 0.4
        assert thrust == pytest.approx(expected, rel=1e-10)


def test_the_balance_is_continuous_through_zero_inflow_angle_with_buhl() -> None:
    found = [axial(0.08, phi) for phi in (-1e-7, 0.0, 1e-7)]
    # at s = 0: sqrt(2 F kappa) with F = 1 and kappa = 0.02
    np.testing.assert_allclose(found, sqrt(2.0 * 0.02), rtol=0.0, atol=1e-6)


def test_without_buhl_momentum_theory_goes_on() -> None:
    s = sin(0.1)
    for solidity in (0.01, 0.1, 0.5):
        kappa = solidity * cos(0.1) / 4.0
        assert axial(solidity, 0.1, buhl=0) == pytest.approx(s + kappa / s, rel=1e-13)


@given(s=st.floats(-0.5, 1.0), kappa=st.floats(1e-3, 3.0), angle=st.floats(0.02, 1.4))
@settings(max_examples=200, deadline=None)
@example(s=-0.5, kappa=0.125, angle=1.25)  # two inflections before the root
def test_momentum_in_skewed_flow_is_solved(s: float, kappa: float, angle: float) -> None:
    t, lean = np.tan(angle), np.tan(0.6 * angle)
    y = bem.skewed_axial(s, kappa, t)
    assert (y - s) * sqrt(s * s + t * t * y * y) == pytest.approx(kappa, rel=1e-4)
    added, along = lean * (t - lean), 1.0 + lean * lean
    y = bem.cylinder_axial(s, kappa, added, along)
    assert (y - s) * (added * y + along * s) == pytest.approx(kappa, rel=1e-6)
    assert y > 0.0


@pytest.mark.parametrize("kappa", [0.01, 0.05, 0.2])
def test_momentum_in_hardly_skewed_flow_is_that_of_axial_flow(kappa: float) -> None:
    s = 0.6
    assert bem.skewed_axial(s, kappa, 0.02) == pytest.approx(s + kappa / s, rel=2e-3)
    lean = np.tan(0.6 * 0.02)
    assert bem.cylinder_axial(s, kappa, lean * (0.02 - lean), 1.0 + lean**2) == pytest.approx(s + kappa / s, rel=2e-3)


def test_glauerts_momentum_theory_of_a_yawed_disk() -> None:
    """Burton et al. (2011), 3.10: C_T = 4 a sqrt(1 - a (2 cos g - a)) with the velocity of the wind as reference."""
    for yaw in np.radians([10.0, 30.0, 50.0]):
        for factor in (0.05, 0.2, 0.3):
            a = factor / np.cos(yaw)  # of the velocity normal to the disk
            s = 0.1  # sine of the inflow angle; the thrust coefficient for W is 4 kappa (1 - a)^2 / s^2
            y, t = s / (1.0 - a), np.tan(yaw)
            kappa = (y - s) * np.hypot(s, t * y)
            assert bem.skewed_axial(s, kappa, t) == pytest.approx(y, rel=1e-6)
            thrust = 4.0 * kappa * (1.0 - a) ** 2 / s**2 * np.cos(yaw) ** 2
            assert thrust == pytest.approx(4.0 * factor * np.sqrt(1.0 - factor * (2.0 * np.cos(yaw) - factor)))
