"""Terms of designs that need no run: masses, the tower as a tube, and linear models under the law."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from meltemi import InputError, Turbine, load_turbine
from meltemi.analyses.linear import LinearModel
from meltemi.designs.masses import masses
from meltemi.designs.operation import LAW, under_law, value_and_slopes
from meltemi.designs.settings import VariableSetting
from meltemi.designs.terms import of_turbine, term_of
from meltemi.designs.tower import area_and_second_moment, put_walls, strain_per_moment, wall_thickness
from meltemi.designs.variables import Variables, variables_of
from meltemi.tuning.speed_loop import FREQUENCIES, speed_loops
from meltemi.turbine.definition import Tower


def turbine(name: str) -> Turbine:
    found = load_turbine(name)
    assert isinstance(found, Turbine)
    return found


def tower_of(variables: Variables, *x: float) -> Tower:
    changed = variables.apply(x)
    assert isinstance(changed, Turbine)
    return changed.tower


FLOATER = turbine("iea15mw-volturnus")


# ------------------------------------------------------------------------------------------------------ masses


def test_masses_are_those_of_the_description() -> None:
    kg = masses(FLOATER)
    assert kg["platform"] == 17.838e6 and kg["moorings"] == pytest.approx(3 * 850.0 * 685.0)
    assert kg["rotor"] == pytest.approx(3.0 * kg["blade"] + FLOATER.hub.mass)
    assert kg["nacelle"] == FLOATER.nacelle.mass and {"support", "frame"}.isdisjoint(kg)
    pile = turbine("iea15mw-monopile").support
    assert pile is not None
    ring = lambda z: (  # noqa: E731
        np.pi * np.interp(z, pile.position, pile.thickness)
        * (np.interp(z, pile.position, pile.diameter) - np.interp(z, pile.position, pile.thickness))
    )  # fmt: skip
    volume = sum(quad(ring, a, b)[0] for a, b in zip(pile.position[:-1], pile.position[1:], strict=True))
    expected = pile.density * volume + sum(each.mass for each in pile.masses)
    assert masses(load_turbine("iea15mw-monopile"))["support"] == pytest.approx(expected, rel=1e-9)


def test_a_frame_has_the_mass_of_its_tubes_and_joints() -> None:
    jacket = turbine("nrel5mw-jacket")
    frame: Any = jacket.frame
    steel = 0.0
    for member in frame.members.values():
        ends, tube = [np.asarray(frame.joints[name]) for name in member.joints], frame.sections[member.section]
        ring = np.pi * tube.thickness * (tube.diameter - tube.thickness)
        steel += tube.density * ring * float(np.linalg.norm(ends[1] - ends[0]))
    assert masses(jacket)["frame"] == pytest.approx(steel + 666e3, rel=1e-9)  # the transition piece


def test_a_part_that_is_none_has_one_sentence() -> None:
    with pytest.raises(InputError, match="'mass moring': did you mean 'moorings'"):
        of_turbine(term_of("mass moring", 1.0), SimpleNamespace(turbine=FLOATER))  # type: ignore[arg-type]


# --------------------------------------------------------------------------------------------- the tower as a tube


def test_changed_walls_have_mass_and_stiffness_of_the_changed_tube() -> None:
    E, G, rho = 210e9, 80.8e9, 8500.0
    diameter, thickness = np.array([8.0, 7.0, 4.0]), np.array([0.06, 0.04, 0.02])

    def tube(d: Any, t: Any) -> dict[str, Any]:
        area, second = area_and_second_moment(d, t)
        return {"diameter": list(d), "mass": rho * area, "fore_aft_stiffness": E * second,
                "side_side_stiffness": E * second, "torsion_stiffness": 2.0 * G * second,
                "axial_stiffness": E * area, "shear_stiffness": None}  # fmt: skip

    tower = tube(diameter, thickness)
    np.testing.assert_allclose(wall_thickness(diameter, tower["fore_aft_stiffness"]), thickness, rtol=1e-10)
    wider, thicker = np.array([1.1, 1.0, 0.9]), np.array([1.3, 0.8, 1.0])
    put_walls(tower, {"tower.diameter": wider, "tower.thickness": thicker})
    for name, values in tube(wider * diameter, thicker * thickness).items():
        if values is not None:
            np.testing.assert_allclose(tower[name], values, rtol=1e-10, err_msg=name)
    with pytest.raises(InputError, match="thicker than the tower's radius"):
        put_walls(tower, {"tower.thickness": np.full(3, 90.0)})
    with pytest.raises(InputError, match=r"no steel tube of 8.8 m has the bending stiffness of station 1"):
        put_walls(tower | {"fore_aft_stiffness": [1e15, 1e10, 1e10]}, {})


def test_the_modulus_hardly_matters() -> None:
    """The walls of this tower are of 200 GPa: mass 8346 kg/m^3 times the area to five digits."""
    tower, factor = FLOATER.tower, 1.3
    d, second = np.asarray(tower.diameter), np.asarray(tower.fore_aft_stiffness) / 200e9
    t = 0.5 * (d - (d**4 - 64.0 / np.pi * second) ** 0.25)
    assert np.asarray(tower.mass)[:-1] == pytest.approx(8346.0 * area_and_second_moment(d, t)[0][:-1], rel=2e-6)
    variables = variables_of({"tower.thickness": VariableSetting(low=0.5, high=2.0)}, FLOATER, {})
    changed = tower_of(variables, factor)
    area, moment = area_and_second_moment(d, factor * t)
    np.testing.assert_allclose(changed.mass[:-1], 8346.0 * area[:-1], rtol=2e-4)
    np.testing.assert_allclose(changed.fore_aft_stiffness, 200e9 * moment, rtol=5e-4)
    np.testing.assert_allclose(changed.diameter, d)


def test_variables_of_the_tower() -> None:
    both = {"tower.thickness": VariableSetting(low=0.5, high=2.0, knots=2),
            "tower.diameter": VariableSetting(low=0.9, high=1.1)}  # fmt: skip
    variables = variables_of(both, FLOATER, {})
    assert variables.names == ["tower.thickness[1/2]", "tower.thickness[2/2]", "tower.diameter"]
    same, tower = tower_of(variables, 1.0, 1.0, 1.0), FLOATER.tower
    np.testing.assert_allclose(same.fore_aft_stiffness, tower.fore_aft_stiffness, rtol=1e-12)
    wider = tower_of(variables, 1.0, 1.0, 1.1)
    np.testing.assert_allclose(wider.mass / tower.mass, 1.1, rtol=2e-3)  # of a thin tube
    np.testing.assert_allclose(wider.fore_aft_stiffness / tower.fore_aft_stiffness, 1.1**3, rtol=4e-3)
    with pytest.raises(InputError, match=r"did you mean 'tower.thickness'"):
        variables_of({"tower.thicknes": VariableSetting(low=0.5, high=2.0)}, FLOATER, {})
    with pytest.raises(InputError, match=r"'tower.diameter' is a factor: leave add out"):
        variables_of({"tower.diameter": VariableSetting(low=-0.5, high=2.0, add=True)}, FLOATER, {})


def test_the_strain_is_that_of_bending() -> None:
    """M = 1e8 N m on a tube of 10 m and 0.1 m of 210 GPa: stress M D / 2 I over the modulus."""
    _, second = area_and_second_moment(np.array([10.0]), np.array([0.1]))
    turbine = SimpleNamespace(tower=SimpleNamespace(diameter=[10.0], fore_aft_stiffness=210e9 * second))
    stress = 1e8 * 5.0 / float(second[0])
    assert 1e8 * strain_per_moment(turbine) == pytest.approx(stress / 210e9)
    term = term_of("del tower_base_strain", 1.0)
    with pytest.raises(InputError, match="pmsg20mw has no tower"):
        strain_per_moment(load_turbine("pmsg20mw"))
    assert term.strain and not term_of("del TwrBsMyt", 1.0).strain


# ----------------------------------------------------------------------------------- linear models under the law


def oscillators(motion: float = 0.0) -> tuple[LinearModel, Any]:
    """A rotor whose speed the pitch brakes, beside a platform of 0.2 rad/s with 5 % and a tower of 3 rad/s with 1 %."""
    names = ("q base pitch", "q tower 1st fore-aft", "v base pitch", "v tower 1st fore-aft", "v generator")
    A = np.zeros((5, 5))
    A[0, 2] = A[1, 3] = 1.0
    for i, (w, zeta) in enumerate([(0.2, 0.05), (3.0, 0.01)]):
        A[2 + i, i], A[2 + i, 2 + i] = -(w**2), -2.0 * zeta * w
    A[4, 4], A[4, 2] = -0.05, -0.02
    B = np.zeros((5, 2))
    B[4], B[2, 1], B[3, 1] = (-1e-9, -0.6), 0.05, 0.3
    C = np.vstack([np.eye(5)[4], A[2] + A[3]])
    point: Any = SimpleNamespace(pitch=0.2, generator_speed=0.79, wind=SimpleNamespace(speed=14.0))
    units = ("rad", "m", "rad/s", "m/s", "rad/s")
    linear = LinearModel(A, B, C, np.vstack([np.zeros(2), B[2] + B[3]]), names, ("generator_torque", "pitch"),
                         ("generator_speed", "tower_top_acceleration_x"), units, ("N m", "rad"), ("rad/s", "m/s^2"),
                         np.zeros(5), np.zeros(2), np.zeros(2), None, point)  # fmt: skip
    return linear, FLOATER.control.replace(**{"pitch.motion_gain": motion, "pitch.motion_frequency": 0.2})


def test_a_mode_that_the_law_does_not_move_has_its_own_damping() -> None:
    linear, law = oscillators()
    still = replace(linear, B=0.0 * linear.B, D=0.0 * linear.D)
    for name, expected in (("base pitch", 0.05), ("1st tower fore-aft", 0.01)):
        value, _ = value_and_slopes(term_of(f"damping {name} at 14", 1.0), still, under_law(still, law))
        assert value == pytest.approx(expected, rel=1e-9)
    both, _ = value_and_slopes(term_of("damping * at 14", 1.0), still, under_law(still, law))
    # the soft minimum of both: 0.1 / 200 is the distance at which a second mode counts by 1 / e
    assert 0.01 - 0.1 / 200.0 < both <= 0.01


def test_the_sensitivity_is_that_of_the_opened_loop() -> None:
    linear, law = oscillators()
    response = linear.response(1j * FREQUENCIES)[:, 0]
    expected = speed_loops(law, [linear.point], [response])[0].sensitivity
    for loop in ("speed", "pitch"):  # the same without motion and with constant torque: one loop of one signal
        value, _ = value_and_slopes(term_of(f"sensitivity {loop} at 14", 1.0), linear, under_law(linear, law))
        assert expected <= value < expected + np.log(len(FREQUENCIES)) / 200.0
    moving, other = oscillators(0.5)
    values = [value_and_slopes(term_of(f"sensitivity {loop} at 14", 1.0), moving, under_law(moving, other))[0]
              for loop in ("speed", "pitch")]  # fmt: skip
    assert abs(values[0] - values[1]) > 0.01 * values[0]


@pytest.mark.parametrize("name", ["damping base pitch at 14", "damping 1st tower fore-aft at 14", "damping * at 14",
                                  "sensitivity speed at 14", "sensitivity pitch at 14"])  # fmt: skip
def test_derivatives_by_the_matrix(name: str) -> None:
    linear, law = oscillators(0.02)
    term, matrix = term_of(name, 1.0), under_law(linear, law)
    assert matrix.shape == (5 + len(LAW) + 2,) * 2
    way = np.random.default_rng(7).normal(size=matrix.shape) * (np.abs(matrix) > 0.0) * matrix
    way[5 + len(LAW) :, 5 + len(LAW) :] = 0.0
    _, slopes = value_and_slopes(term, linear, matrix)
    low, high = (value_and_slopes(term, linear, matrix + sign * 1e-5 * way)[0] for sign in (-1.0, 1.0))
    assert np.sum(slopes * way) == pytest.approx((high - low) / 2e-5, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "damping base pitch",
            "expected a name and a wind speed .m/s., for instance: damping 1st tower",
        ),
        ("sensitivity at 14", "for instance: sensitivity speed at 14"),
        ("sensitivity sped at 14", "the loop is opened at the speed or the pitch, not 'sped'"),
        ("damping base pich at 14", "did you mean 'base pitch'"),
    ],
)
def test_terms_of_operation_that_mean_nothing(name: str, words: str) -> None:
    linear, law = oscillators()
    with pytest.raises(InputError, match=words):
        value_and_slopes(term_of(name, 1.0), linear, under_law(linear, law))
