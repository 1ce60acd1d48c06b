"""Power coefficients: the formulas' optimum to its digits, tables between and beyond their entries, bad input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator

import meltemi
from meltemi import InputError, load_turbine
from meltemi.aero.coefficient import (
    akima_slopes,
    known,
    looked_up,
    power_coefficient,
    rotor_coefficients,
    thrust_coefficient,
)
from meltemi.analysis import performance_of
from meltemi.core.yamlfile import validated
from meltemi.turbine import CalibratedCoefficient, HeierCoefficient, PowerTurbine, TableCoefficient
from meltemi.turbine.power_turbine import Coefficient, aeroelastic

DEG = np.pi / 180.0


def c_p(coefficient: Coefficient, ratio: float, pitch: float = 0.0) -> float:
    return float(power_coefficient(ratio, pitch, rotor_coefficients(coefficient)))


def table(f: Any, ratios: Any, pitches: Any, **more: Any) -> TableCoefficient:
    return TableCoefficient(
        tip_speed_ratio=ratios, pitch=pitches, power=f(np.asarray(ratios)[:, None], np.asarray(pitches)), **more
    )


def test_the_formula_is_that_of_its_source_before_it_is_stretched() -> None:
    own = HeierCoefficient().peak
    assert own[0] == pytest.approx(8.1001, abs=1e-4)  # MathWorks: 8.1 and 0.48
    assert own[1] == pytest.approx(0.48001, abs=1e-5)
    plain = HeierCoefficient(tip_speed_ratio=own[0], maximum=own[1])
    # 0.5176 (116/l - 5) exp(-21/l) + 0.0068 l' by hand at 6 and 10 degrees
    x = 1.0 / (6.0 + 0.8) - 0.035 / 1001.0
    assert c_p(plain, 6.0, 10.0 * DEG) == pytest.approx(
        0.5176 * (116 * x - 4 - 5) * np.exp(-21 * x) + 0.0408, abs=1e-12
    )


@pytest.mark.parametrize("coefficient", [HeierCoefficient(), CalibratedCoefficient()])
def test_the_maximum_lies_where_the_paper_has_it(coefficient: Coefficient) -> None:
    at = np.linspace(9.3, 9.7, 401)
    values = [c_p(coefficient, x) for x in at]
    assert at[int(np.argmax(values))] == pytest.approx(9.5085, abs=1e-3)
    assert c_p(coefficient, 9.5085) == pytest.approx(0.48, abs=5e-8)


def test_the_stretched_maximum_is_exact_and_settable() -> None:
    moved = HeierCoefficient(tip_speed_ratio=8.0, maximum=0.45)
    assert c_p(moved, 8.0) == pytest.approx(0.45, abs=1e-14)
    assert c_p(moved, 8.001) < 0.45 > c_p(moved, 7.999)


def test_a_pitch_below_zero_is_taken_as_zero_by_the_formula() -> None:
    assert c_p(HeierCoefficient(), 8.0, -1.0 * DEG) == c_p(HeierCoefficient(), 8.0)


def test_the_calibrated_formula_knows_its_range() -> None:
    p = rotor_coefficients(CalibratedCoefficient()).coefficient
    assert known(9.0, 0.0, p)
    assert not known(6.9, 0.0, p)
    assert not known(11.6, 0.0, p)
    assert not known(9.0, 0.01, p)


def test_a_table_gives_its_entries_and_is_smooth_between_them() -> None:
    bem = load_turbine("pmsg20mw-bem").coefficient
    assert isinstance(bem, TableCoefficient)
    c = rotor_coefficients(bem)
    for i, ratio in enumerate(bem.tip_speed_ratio):
        for j, pitch in enumerate(bem.pitch):
            assert power_coefficient(ratio, pitch, c) == pytest.approx(bem.power[i, j], abs=1e-14)
    # value and slopes are continuous across the lines of the table
    e = 1e-7
    for ratio, pitch in ((9.0, 2.5 * DEG), (7.3, 5.0 * DEG)):
        for dx, dy in ((e, 0.0), (0.0, e)):
            left, mid, right = (c_p(bem, ratio + k * dx, pitch + k * dy) for k in (-1.0, 0.0, 1.0))
            assert (mid - left) / e == pytest.approx((right - mid) / e, abs=1e-5)


def test_a_table_is_of_third_order_between_its_entries() -> None:
    def f(x: Any, y: Any) -> Any:
        return 0.4 * np.sin(x / 4.0) * np.cos(2.0 * y)

    errors = []
    for n in (9, 17, 33):
        fine = table(f, np.linspace(2.0, 12.0, n), np.linspace(0.0, 0.4, n))
        # away from maxima, where the weights of the slopes change, and from the edges
        errors.append(
            max(abs(c_p(fine, x, y) - f(x, y)) for x in np.linspace(8.0, 10.0, 21) for y in np.linspace(0.1, 0.3, 7))
        )
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.min() > 2.5


def test_beyond_a_table_coefficients_go_on_straight_but_not_below_the_smallest() -> None:
    bem = load_turbine("pmsg20mw-bem").coefficient
    last = bem.pitch[-1]
    slope = (c_p(bem, 5.0, last) - c_p(bem, 5.0, last - 1e-6)) / 1e-6
    assert c_p(bem, 5.0, last + 2 * DEG) == pytest.approx(0.088 + 2 * DEG * slope, abs=1e-6)
    assert c_p(bem, 14.0, 25 * DEG) == pytest.approx(-0.2, abs=1e-12)
    # a rotor that stands still has no power, but a torque
    assert c_p(bem, 1e-3) == pytest.approx(1e-3 * c_p(bem, 1e-4) / 1e-4, rel=0.01)
    assert c_p(bem, 1e-3) > 0.0


def test_thrust_comes_from_tables_that_have_it() -> None:
    ratios, pitches = [4.0, 8.0, 12.0], [0.0, 0.1, 0.2]
    with_thrust = table(lambda x, y: 0.1 + 0.02 * x - y, ratios, pitches, thrust=np.full((3, 3), 0.7))
    c = rotor_coefficients(with_thrust)
    assert thrust_coefficient(7.0, 0.05, c) == pytest.approx(0.7)
    assert looked_up(0, 8.0, 0.1, c) == pytest.approx(0.16)
    assert thrust_coefficient(7.0, 0.05, rotor_coefficients(HeierCoefficient())) == 0.0


def test_slopes_of_a_straight_line_are_exact() -> None:
    x = np.array([0.0, 1.0, 1.5, 4.0, 6.0])
    assert akima_slopes(x, (3.0 * x - 1.0)[:, None]).ravel() == pytest.approx([3.0] * 5)
    values = np.array([0.1, 0.35, 0.48, 0.3, 0.27])
    expected = Akima1DInterpolator(x, values, method="makima").derivative()(x)
    assert akima_slopes(x, values[:, None]).ravel() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tip_speed_ratio": [4.0, 6.0]}, "tip_speed_ratio needs at least 3 entries that increase"),
        ({"pitch": [0.0, 5.0, 10.0]}, "pitch is in radians, but reaches 10; if these are degrees, multiply by pi/180"),
        ({"power": [[0.1, 0.1, 0.1]] * 2}, r"power must have a row for each of 3 tip-speed ratios with 3 pitch angles"),
        ({"power": [[1.1, 0.1, 0.1]] * 3}, "its largest coefficient is 1.1, not between 0 and 1"),
        ({"thrust": [[0.1, 0.1]] * 3}, r"thrust must have a row .* has \(3, 2\)"),
        ({"tip_speed_ratio": [0.0, 6.0, 8.0]}, "must be above zero"),
    ],
)
def test_a_table_that_cannot_be_says_why(change: dict[str, Any], words: str) -> None:
    good = {"tip_speed_ratio": [4.0, 6.0, 8.0], "pitch": [0.0, 0.1, 0.2], "power": [[0.1, 0.2, 0.1]] * 3}
    TableCoefficient(**good)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=words):
        TableCoefficient(**(good | change))  # type: ignore[arg-type]


@pytest.mark.parametrize("change", [{"maximum": 0.7}, {"tip_speed_ratio": 0.001}, {"tip_speed_ratio": 100.0}])
def test_a_maximum_that_no_rotor_has_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(InputError, match="less than or equal to|greater than or equal to"):
        HeierCoefficient(**change)
    assert HeierCoefficient(maximum=16.0 / 27.0).maximum > 0.59


def test_a_formula_without_a_maximum_is_refused() -> None:
    with pytest.raises(InputError, match="no maximum between tip-speed ratios of 4 and 15"):
        HeierCoefficient(constants=(0.0, 116.0, 0.4, 5.0, 21.0, 0.0068))


def test_a_file_with_an_unknown_coefficient_names_the_known_ones(tmp_path: Any) -> None:
    content = load_turbine("pmsg20mw").content()
    content["coefficient"] = {"kind": "heyer"}
    with pytest.raises(InputError, match="did you mean 'heier'"):
        validated(content, PowerTurbine, "t.yaml")


def test_a_turbine_of_a_coefficient_survives_a_file(tmp_path: Any) -> None:
    for name in ("pmsg20mw", "pmsg20mw-bem"):
        turbine = load_turbine(name)
        meltemi.io.write_turbine(turbine, tmp_path / "t.yaml")
        assert load_turbine(tmp_path / "t.yaml") == turbine


def test_numbers_of_table_1() -> None:
    t = load_turbine("pmsg20mw")
    K = t.control.torque.optimal_gain
    assert pytest.approx(5.377e7, rel=1e-4) == K  # at 1.225 kg/m^3
    assert pytest.approx(0.5 * 1.225 * np.pi * 138**5 * 0.48 / 9.5085**3, rel=1e-12) == K
    assert K * t.control.torque.rated_speed**3 == pytest.approx(20e6, rel=1e-10)
    # 20 MW over the power of the air at 10.44 m/s
    assert (20e6 / (0.5 * 1.225 * np.pi * 138**2 * 0.48)) ** (1 / 3) == pytest.approx(10.44, abs=0.005)
    for inertia, seconds in ((2.93e9, 41), (4.872e9, 68), (4.872e6, 0.07)):
        J = t.replace(**{"drivetrain.rotor_inertia": inertia}).drivetrain.inertia
        assert pytest.approx(seconds, rel=0.025) == 0.5 * J * 0.75**2 / 20e6
    a = t.pitch_actuator
    assert 2.0 * a.damping_ratio / a.natural_frequency == pytest.approx(0.3, rel=1e-6)
    assert (a.minimum / DEG, a.maximum / DEG, a.rate_limit / DEG) == pytest.approx((0.0, 25.0, 8.0), abs=1e-5)


def test_figures_4_and_5_scale_with_the_density_alone() -> None:
    coefficient = load_turbine("pmsg20mw").coefficient
    speed = np.linspace(0.6, 0.9, 301)
    ratio = speed * 138.0 / 10.715
    peak = 0.5 * np.pi * 138**2 * 10.715**3 * max(c_p(coefficient, x) for x in ratio) / 1e6
    # 21.64 MW where the paper has 21.2, and its 0.75 rad/s within 2 %
    assert 1.225 * peak == pytest.approx(21.64, abs=0.01)
    assert speed[int(np.argmax([c_p(coefficient, x) for x in ratio]))] == pytest.approx(0.75, rel=0.02)
    for density, power in ((1.1272, 19.51), (1.3414, 23.21), (0.9660, 16.72)):
        assert density * peak * 21.20 / 21.64 == pytest.approx(power, rel=1e-3)


def test_performance_is_the_turbines_own() -> None:
    seen = performance_of(load_turbine("pmsg20mw-bem"))
    assert seen.power[6, 0] == pytest.approx(0.495)
    assert np.isnan(seen.thrust).all()
    assert seen.torque == pytest.approx(seen.power / seen.tip_speed_ratio[:, None])
    formula = performance_of(load_turbine("pmsg20mw"))
    assert formula.power.max() == pytest.approx(0.48, abs=1e-4)
    assert formula.pitch[-1] == pytest.approx(25 * DEG, abs=1e-6)
    only = performance_of(load_turbine("pmsg20mw").replace(coefficient=CalibratedCoefficient()))
    assert only.pitch == pytest.approx([0.0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "words"),
    [
        (lambda t: aeroelastic(t, "meltemi export"), "meltemi export: pmsg20mw is a power-coefficient turbine"),
        (lambda t: meltemi.io.write_openfast(t, "nowhere"), "write_openfast: pmsg20mw"),
        (lambda t: meltemi.analysis.rotor_performance(t, [8.0], [0.0]), "performance_of has the coefficients"),
        (lambda t: meltemi.analysis.natural_modes(meltemi.build(t)), "natural_modes: pmsg20mw"),
        (lambda t: meltemi.analysis.campbell(meltemi.build(t), wind_speeds=[8.0]), "campbell: pmsg20mw"),
        (lambda t: meltemi.turbine.with_flaps(t), "PowerTurbine has no 'blade.flaps'"),
    ],
)
def test_what_needs_blades_refuses_a_turbine_without(what: Any, words: str, tmp_path: Any) -> None:
    with pytest.raises(InputError, match=words):
        what(load_turbine("pmsg20mw"))
    assert not (tmp_path / "nowhere").exists()
