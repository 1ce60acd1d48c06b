"""Ice as data: its law, the mass of the nodes, the polars under it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Turbine, UnsupportedError
from meltemi.aero.tables import AeroNode, PolarPoint, SectionConstants
from meltemi.compiler import View
from meltemi.structure.tables import BladeNode
from meltemi.turbine import Icing, with_ice
from meltemi.turbine.icing import ice_mass, law_mass, leading_edge, penalty_factors

LIFT, DRAG, ATTACHMENT, ATTACHED, SEPARATED = (
    PolarPoint.index(name) for name in ("lift", "drag", "attachment", "attached_lift", "separated_lift")
)


@pytest.fixture(scope="module")
def clean(turbine: Turbine) -> Model:
    return meltemi.build(turbine)


def test_law(turbine: Turbine) -> None:
    # rho k c_t (c_max + c_t), k of 63 m, and 1.5 m at the tip
    k = 0.00675 + 0.3 * math.exp(-0.32 * 63.0)
    assert law_mass(turbine, Icing(tip_chord=1.5)) == pytest.approx(700.0 * k * 1.5 * (4.652 + 1.5), rel=1e-9)
    assert law_mass(turbine, Icing(mass=40.0, amount=0.5)) == 20.0
    # the tip of this blade is rounded to 1.42 m in its last two metres; its contour points at 1.91 m
    assert law_mass(turbine, Icing()) == pytest.approx(law_mass(turbine, Icing(tip_chord=1.79)), rel=0.05)
    # zero at the shaft, linear to half the radius, constant
    found = ice_mass(turbine, Icing(mass=40.0), np.array([0.0, 14.25, 30.0, 61.5]))
    assert found == pytest.approx([40.0 * 1.5 / 31.5, 20.0, 40.0, 40.0], rel=1e-12)


def test_law_of_iec(turbine: Turbine) -> None:
    """0.125 kg/m^3 times the chord at 85 % of the radius times the radius, linear to the tip."""
    a, inner, R = turbine.blade.aerodynamics, turbine.hub.radius, turbine.rotor_radius
    chord = np.interp(0.85 * R - inner, a.position, a.chord)
    assert law_mass(turbine, Icing(law="iec", amount=2.0)) == pytest.approx(0.25 * chord * R, rel=1e-12)
    z = np.array([0.0, 20.0, turbine.blade.length])
    assert ice_mass(turbine, Icing(law="iec"), z) == pytest.approx(0.125 * chord * (z + inner), rel=1e-12)
    assert ice_mass(turbine, Icing(law="iec", mass=30.0), z)[-1] == 30.0
    assert Icing(law="iec") != Icing()


def test_mass_and_moment_of_the_nodes_in_closed_form(turbine: Turbine, clean: Model) -> None:
    iced = meltemi.build(with_ice(turbine, Icing(blades=(2,), mass=50.0)))
    before, after = View(BladeNode, clean.rotor.blade_nodes), View(BladeNode, iced.rotor.blade_nodes)
    assert np.array_equal(before.array[:, [0, 2]], after.array[:, [0, 2]])
    mass = after["mass"][1] - before["mass"][1]
    z = after["position"][2, 1]
    first = after["moment"][2, 1] - before["moment"][2, 1] + mass * z
    inner, R = turbine.hub.radius, turbine.rotor_radius
    assert mass.sum() == pytest.approx(50.0 * (0.75 * R - inner**2 / R), rel=1e-9)
    # integral of mu r dr
    assert first.sum() == pytest.approx(50.0 * (11.0 / 24.0 * R**2 - 2.0 / 3.0 * inner**3 / R), rel=1e-9)
    # it hangs at the leading edge: ahead of the pitch axis by a quarter of the chord more than the aerodynamic centre
    fine = np.linspace(0.0, turbine.blade.length, 20001)
    edge = ice_mass(turbine, Icing(mass=50.0), fine)[:, None] * leading_edge(turbine.blade, fine)
    moved = after["moment"][:2, 1] - before["moment"][:2, 1]
    assert moved.sum(axis=1) == pytest.approx(np.trapezoid(edge, fine, axis=0), rel=2e-3)
    # inertia about the node: of points, without any about the span but by their distance from it
    inertia = after["inertia"][:, 1] - before["inertia"][:, 1]
    assert np.all(inertia[2] > 0.99 * (moved**2).sum(axis=0) / mass)


def test_leading_edge_turns_with_the_twist(turbine: Turbine) -> None:
    a = turbine.blade.aerodynamics
    for twist, ahead in ((0.0, (0.0, -0.25)), (math.pi / 2.0, (-0.25, 0.0))):
        content = a.content() | {"twist": [twist] * len(a.position), "centre_x": None, "centre_y": None}
        blade = turbine.blade.model_copy(update={"aerodynamics": type(a).model_validate(content)})
        found = leading_edge(blade, a.position)
        assert found == pytest.approx(np.outer(a.chord, ahead), abs=1e-12)


def test_polars_under_ice(turbine: Turbine, clean: Model) -> None:
    icing = Icing(blades=(1,), lift_penalty=0.3, drag_penalty=1.5)
    iced = meltemi.build(with_ice(turbine, icing))
    index = View(AeroNode, iced.rotor.aero_nodes)["polar"].astype(int)
    assert np.array_equal(index[1:], View(AeroNode, clean.rotor.aero_nodes)["polar"][1:])
    before, after = clean.rotor.polars[index[1]], iced.rotor.polars[index[0]]
    grid = np.linspace(-np.pi, np.pi, before.shape[1])
    outer = np.linspace(0.0, 1.0, 20) > 0.7
    near, deep, behind = (int(np.argmin(np.abs(grid - np.radians(a)))) for a in (6.0, 60.0, 175.0))
    assert after[outer, near, LIFT] == pytest.approx(0.7 * before[outer, near, LIFT])
    assert after[outer, near, DRAG] == pytest.approx(2.5 * before[outer, near, DRAG])
    for row in (deep, behind):
        assert np.array_equal(after[:, row], before[:, row])
    # cylinders at the root stay as they are
    assert np.array_equal(after[0], before[0])
    # the parts of the dynamic stall make the static lift that the section has now
    dynamic = iced.rotor.section[index[0], SectionConstants.index("dynamic")] > 0.0
    f = after[..., ATTACHMENT]
    static = f * after[..., ATTACHED] + (1.0 - f) * after[..., SEPARATED]
    inside = np.abs(grid) < np.radians(45.0)
    assert static[dynamic][:, inside] == pytest.approx(after[dynamic][:, inside][..., LIFT], abs=2e-3)
    slope = SectionConstants.index("slope")
    assert iced.rotor.section[index[0], slope][outer] == pytest.approx(0.7 * iced.rotor.section[index[1], slope][outer])


def test_factors_fade_out() -> None:
    lift, drag = penalty_factors(Icing(), 0.5, np.radians([0.0, -20.0, 30.0, 40.0, -180.0]))
    assert lift == pytest.approx([0.9, 0.9, 0.95, 1.0, 1.0])
    assert drag == pytest.approx([2.0, 2.0, 1.5, 1.0, 1.0])


def test_ice_of_nothing_changes_nothing(turbine: Turbine, clean: Model) -> None:
    nothing = meltemi.build(with_ice(turbine, Icing(amount=0.0, lift_penalty=0.0, drag_penalty=0.0)))
    assert np.array_equal(nothing.rotor.blade_nodes, clean.rotor.blade_nodes)
    index, was = (View(AeroNode, model.rotor.aero_nodes)["polar"].astype(int) for model in (nothing, clean))
    assert np.array_equal(nothing.rotor.polars[index], clean.rotor.polars[was])
    back = meltemi.build(with_ice(with_ice(turbine, Icing()), None))
    assert all(np.array_equal(back.array(name), clean.array(name)) for name in ("blade_nodes", "aero_nodes"))
    assert back.content_hash() == clean.content_hash()


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        {"blades": (1, 2)},
        {"amount": 0.5},
        {"mass": 10.0},
        {"density": 500.0},
        {"tip_chord": 1.0},
        {"lift_penalty": 0.1},
        {"drag_penalty": 1.0},
        {"penalty_begin": 0.2},
        {"penalty_full": 0.8},
    ],
    ids=lambda change: next(iter(change)),
)
def test_every_option_changes_something(turbine: Turbine, change: dict[str, Any]) -> None:
    one, two = (meltemi.build(with_ice(turbine, icing)) for icing in (Icing(), Icing(**change)))
    mass = not np.array_equal(one.rotor.blade_nodes, two.rotor.blade_nodes)
    air = one.rotor.polars.shape != two.rotor.polars.shape or not np.array_equal(one.rotor.polars, two.rotor.polars)
    names = set(change)
    assert mass == bool(names & {"blades", "amount", "mass", "density", "tip_chord"})
    assert air == bool(names & {"lift_penalty", "drag_penalty", "penalty_begin", "penalty_full"})
    assert one.content_hash() != two.content_hash()


def test_a_turbine_file_with_ice(turbine: Turbine, tmp_path: Path) -> None:
    iced = with_ice(turbine, Icing(blades=(3,), amount=0.5))
    meltemi.io.write_turbine(iced, tmp_path / "iced.yaml")
    again = meltemi.load_turbine(tmp_path / "iced.yaml")
    assert again == iced != turbine


def test_a_case_with_ice(turbine: Turbine) -> None:
    from meltemi.cases.case import case_turbine

    case = meltemi.io.LoadCase(turbine="nrel5mw", wind={"kind": "steady", "speed": 9.0}, duration=1.0)
    assert case_turbine(case, Path()) == turbine
    assert case_turbine(case.replace(icing=Icing(amount=2.0)), Path()).icing == Icing(amount=2.0)


def test_what_cannot_be(turbine: Turbine, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"names blade 4; the rotor has blades 1 to 3"):
        with_ice(turbine, Icing(blades=(4,)))
    with pytest.raises(InputError, match="names blade 3; the rotor has blades 1 to 2"):
        with_ice(turbine, Icing(blades=(3,))).replace(n_blades=2)
    with pytest.raises(InputError, match="names one twice"):
        Icing(blades=(1, 1))
    with pytest.raises(UnsupportedError, match="a deck has no ice"):
        meltemi.io.write_openfast(with_ice(turbine, Icing()), tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_turbine_of_a_power_coefficient_has_no_blades_for_ice() -> None:
    with pytest.raises(InputError, match="pmsg20mw: ice needs a turbine with blades, this one is only a power coeff"):
        with_ice(meltemi.load_turbine("pmsg20mw"), Icing())  # type: ignore[arg-type]
