"""Geometrically exact blades: statics, kinematics, and independence of the description's reference axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import meltemi
from meltemi import ModelOptions, SteadyWind, Turbine
from meltemi.compiler import View
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.case import Case
from meltemi.structure.beam import section_axes, skew
from meltemi.structure.blades import blade_motion
from meltemi.turbine.exchange import BladeFrame
from meltemi.verification.far_bending import compare

pytestmark = pytest.mark.slow

Float = NDArray[np.float64]
EXACT, SECOND = "geometrically_exact", "modal"


@pytest.fixture(scope="module")
def iea22mw() -> Turbine:
    return meltemi.load_turbine("iea22mw")


def model_of(turbine: Turbine, **options: Any) -> BladedModel:
    return with_blades(meltemi.build(turbine, ModelOptions(**options)), "a test")


# statics ------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("name", ["iea15mw", "iea22mw"])
def test_statics_are_those_of_the_exact_beam(name: str) -> None:
    for row in compare(name, shares=(0.1, 0.2)):
        assert row.band is not None
        assert abs(row.deviation) <= row.band, row


@pytest.mark.long
def test_second_order_blades_are_wrong_where_exact_ones_are_right() -> None:
    tip, twist, _ = compare("iea22mw", ModelOptions(blade_model=SECOND), shares=(0.2,))
    assert tip.deviation > 5.0
    assert abs(twist.deviation) > 1.0


@pytest.mark.long
def test_twist_converges_with_the_modes() -> None:
    """The defaults are within 0.1 deg of many modes, at a deflection of a tenth of the length; fewer are not."""

    def twist(**options: Any) -> float:
        return float(np.degrees(compare("iea22mw", ModelOptions(**options), shares=(0.1,))[1].ours))

    many = twist(flap_modes=8, edge_modes=6, torsion_modes=5)
    assert abs(twist() - many) < 0.1
    natural = [
        twist(flap_modes=f, edge_modes=e, torsion_modes=t, residual_modes=0) for f, e, t in ((3, 2, 2), (4, 3, 3))
    ]
    assert abs(natural[0] - many) > abs(natural[1] - many) > 0.0
    assert abs(natural[0] - many) > 0.2


def test_twist_of_the_tip_with_many_natural_and_residual_modes(iea22mw: Turbine) -> None:
    """Residual modes that stretch a little do not take the place of the stretch and twist the tip back, by 12 %."""

    def twist(**options: Any) -> float:
        return float(meltemi.operating_point(model_of(iea22mw, **options), 14.0)["tip_twist_1"])

    many = {"flap_modes": 8, "edge_modes": 6, "torsion_modes": 5}
    natural = twist(**many, residual_modes=0)
    assert twist(**many) == pytest.approx(natural, rel=0.01)
    assert twist() == pytest.approx(natural, rel=0.01)


def test_small_deflections_are_those_of_the_second_order_blade(turbine: Turbine) -> None:
    """The difference of both is of third order in the deflection."""
    away = []
    for size in (0.4, 0.2):
        places = []
        for blade_model in (EXACT, SECOND):
            case = bent_case(model_of(turbine, blade_model=blade_model, blade_nodes=40), size, 0.0)
            places.append(case.view("motion")["position"][:, 0])
        away.append(np.abs(places[0] - places[1]).max())
    assert np.log2(away[0] / away[1]) == pytest.approx(3.0, abs=0.5)


# kinematics ---------------------------------------------------------------------------------------------


def bent_case(model: BladedModel, size: float, rate: float) -> Case:
    """A blade whose root is at rest, with coordinates of the order of ``size`` and velocities of ``rate``."""
    case = Case(model, SteadyWind(speed=1.0))
    n, K = model.n_core, len(model.rotor.blade.names)
    pattern = np.cos(1.7 * np.arange(K)) / (1.0 + np.arange(K))
    case.evaluate(0.0)
    case["q"][n : n + K] = size * pattern
    case["v"][n : n + K] = rate * np.sin(2.3 * np.arange(K) + 1.0)
    move(case)
    return case


def move(case: Case) -> None:
    for name in ("velocity", "acceleration", "spin", "spin_rate"):
        View(BladeFrame, case["frame"])[name] = 0.0
    blade_motion(case.one)


@pytest.mark.parametrize("blade_model", [EXACT, SECOND])
def test_velocities_and_accelerations_are_derivatives_of_the_position(iea22mw: Turbine, blade_model: str) -> None:
    model = model_of(iea22mw, blade_model=blade_model)
    n, K = model.n_core, len(model.rotor.blade.names)
    case = bent_case(model, 2.0, 3.0)
    q0, rate = case["q"].copy(), case["v"].copy()
    motion, step = case.view("motion"), 1e-3
    found = {name: np.array(motion[name][:, 0]) for name in ("velocity", "acceleration", "spin", "spin_rate")}
    partial = case["partial"].reshape(K, 6, model.n_blades, -1)[:, :, 0].copy()
    places, sections = [], []
    for s in (-step, 0.0, step):
        case["q"][:] = q0 + s * rate
        move(case)
        places.append(np.array(motion["position"][:, 0]))
        sections.append(Rotation.from_matrix(motion["orientation"][:, 0].T.reshape(-1, 3, 3)))
    first, second = (places[2] - places[0]) / (2.0 * step), (places[2] - 2.0 * places[1] + places[0]) / step**2
    turns = [(sections[i + 1] * sections[i].inv()).as_rotvec().T / step for i in (0, 1)]
    np.testing.assert_allclose(found["velocity"], first, atol=1e-5 * np.abs(first).max())
    np.testing.assert_allclose(found["acceleration"], second, atol=1e-4 * np.abs(second).max())
    np.testing.assert_allclose(found["spin"], 0.5 * (turns[0] + turns[1]), atol=1e-4 * np.abs(turns[0]).max())
    rates = (turns[1] - turns[0]) / step
    np.testing.assert_allclose(found["spin_rate"], rates, atol=1e-3 * np.abs(rates).max())
    np.testing.assert_allclose(np.einsum("k,kcn->cn", rate[n : n + K], partial[:, :3]), found["velocity"], atol=1e-9)
    np.testing.assert_allclose(np.einsum("k,kcn->cn", rate[n : n + K], partial[:, 3:]), found["spin"], atol=1e-9)


QUANTITIES = ("rotor_aero_torque", "rotor_aero_thrust", "root_moment_flap_1", "tip_flap_1")

# reference axis -----------------------------------------------------------------------------------------


def with_axis_moved(turbine: Turbine, x: float, y: float) -> Turbine:
    """The same blade, described about an axis that is moved by x, y [m] (blade axes)."""
    s = turbine.blade.structure
    assert s.stiffness_matrix is not None and s.mass_matrix is not None
    zero = np.zeros(len(s.position))
    axis_x, axis_y = (zero if a is None else a for a in (s.axis_x, s.axis_y))
    tangent = np.gradient(np.stack([axis_x, axis_y, s.position], axis=1), s.position, axis=0)
    axes = section_axes(s.twist, tangent)[:, :3, :3]
    offset = np.einsum("sji,j->si", axes, np.array([x, y, 0.0]))
    # moments about the new axis: M' = M - offset x F, so K' = P K P^T, and alike the momenta
    P = np.tile(np.eye(6), (len(offset), 1, 1))
    P[:, 3:, :3] = -skew(offset)
    moved = {
        f"blade.structure.{name}": P @ matrix @ P.transpose(0, 2, 1)
        for name, matrix in (("stiffness_matrix", s.stiffness_matrix), ("mass_matrix", s.mass_matrix))
    }
    return turbine.replace(**moved, **{"blade.structure.axis_x": axis_x + x, "blade.structure.axis_y": axis_y + y})


def test_the_reference_axis_does_not_matter(iea22mw: Turbine) -> None:
    found = []
    for turbine in (iea22mw, with_axis_moved(iea22mw, 0.15, 0.4)):
        point = meltemi.operating_point(model_of(turbine, blade_nodes=40), 10.0, rotor_speed=0.64, pitch=0.0)
        found.append([point[name] for name in QUANTITIES])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-3)
