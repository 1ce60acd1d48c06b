"""Rigid motions of the tower base as coordinates: closed forms, and a foundation described both ways."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi import InputError, ModelOptions, Start, build, load_turbine, simulate
from meltemi.analysis import linearise, natural_modes, operating_point
from meltemi.cases.case import LoadCase, case_start
from meltemi.control.constant import ConstantController
from meltemi.simulation.plan import model_channels
from meltemi.structure.members import BASE_MOTIONS
from meltemi.turbine.definition import Foundation, Turbine

MASS = 5.0e6
STIFFNESS = np.diag([2e8, 2e8, 4e9, 6e11, 6e11, 2e11])
STIFFNESS[0, 4] = STIFFNESS[4, 0] = -4e9
STIFFNESS[1, 3] = STIFFNESS[3, 1] = 4e9


@pytest.fixture(scope="module")
def turbine() -> Turbine:
    found = load_turbine("nrel5mw")
    assert isinstance(found, Turbine)
    return found


def on(turbine: Turbine, *motions: str) -> Turbine:
    mass = np.diag([MASS, MASS, MASS, 1e-3, 1e-3, 1e-3])
    return turbine.replace(foundation={"motions": motions, "mass": mass, "stiffness": STIFFNESS})


@pytest.mark.parametrize("motion", ["surge", "sway", "heave"])
def test_a_translation_moves_the_whole_turbine(turbine: Turbine, motion: str) -> None:
    """Frequency of a mass on a spring; blades, tower and nacelle are rigid."""
    rigid = ModelOptions(locked=("tower", "blades", "yaw", "generator", "drivetrain"))
    model = build(on(turbine, motion), rigid)
    assert model.coordinates[4] == f"base {motion}"
    (mode,) = natural_modes(model)
    tower, blade = turbine.tower, turbine.blade.structure
    assert blade.mass is not None
    mass = MASS + tower.top_mass + turbine.nacelle.mass + turbine.hub.mass
    mass += np.trapezoid(tower.mass, tower.position) + 3 * np.trapezoid(blade.mass, blade.position)
    place = BASE_MOTIONS.index(motion)
    assert mode.frequency == pytest.approx(np.sqrt(STIFFNESS[place, place] / mass), rel=1e-4)


def test_a_foundation_may_be_described_by_motions_of_the_base(turbine: Turbine) -> None:
    """Springs and a mass below the tower, once within the tower's modes and once as coordinates of their own."""
    on_springs = turbine.replace(foundation=Foundation(stiffness=STIFFNESS, mass=MASS).content())
    many = ModelOptions(fore_aft_modes=4, side_side_modes=4)
    within = natural_modes(build(on_springs, many))
    beside = natural_modes(build(on(turbine, "surge", "sway", "roll", "pitch"), many))
    fixed = natural_modes(build(turbine, many))
    first = [[mode.frequency for mode in modes[:8]] for modes in (within, beside, fixed)]
    np.testing.assert_allclose(first[1][:2], first[0][:2], rtol=1e-4)
    np.testing.assert_allclose(first[1], first[0], rtol=5e-3)  # by other shapes of the tower
    assert first[2][0] > 1.02 * first[1][0]


def test_the_nacelle_nods_with_the_base(turbine: Turbine) -> None:
    """The acceleration that a controller measures, of a rigid turbine: positive while the top speeds up downwind."""
    rigid = ModelOptions(locked=("tower", "blades", "yaw", "generator", "drivetrain"), time_step=0.005)
    still = Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates={"base pitch": 0.02})
    swing = simulate(
        build(on(turbine, "pitch"), rigid), 0.1, duration=1.0, start=still, controller=ConstantController(),
        channels=["v base pitch", "NcIMURAys"], output_step=0.005,
    )  # fmt: skip
    expected = np.gradient(swing["v base pitch"], swing.time)[2:-2]
    found = swing["nacelle_nodding_acceleration"][2:-2]
    assert expected[0] < -0.01
    np.testing.assert_allclose(found, expected, atol=0.003 * np.abs(expected).max())


@pytest.mark.slow
def test_states_have_the_units_of_their_channels(turbine: Turbine) -> None:
    model = build(on(turbine, "surge", "pitch"), ModelOptions(locked=("tower", "blades")))
    linear = linearise(model, operating_point(model, 9.0), (), ())
    units = {name: unit for name, unit in zip(linear.states, linear.state_units, strict=True) if " base " in name}
    assert units == {"q base surge": "m", "q base pitch": "rad", "v base surge": "m/s", "v base pitch": "rad/s"}
    channels = model_channels(model)
    assert all(channels[name].unit == unit for name, unit in units.items())


def test_a_damper_of_the_foundation_damps_the_tower(turbine: Turbine) -> None:
    """Within the modes of the tower and beside them alike."""
    many, gain = ModelOptions(fore_aft_modes=4, side_side_modes=4), []
    for motions in ((), ("surge", "sway", "roll", "pitch")):
        foundation = {"motions": motions, "mass": MASS, "stiffness": STIFFNESS}
        free, damped = (
            natural_modes(build(turbine.replace(foundation={**foundation, "damping": damping}), many))[0].damping
            for damping in (0.0, 2e7)
        )
        gain.append(damped - free)
    assert gain[0] > 1e-4
    assert gain[1] == pytest.approx(gain[0], rel=0.05)


def test_what_a_foundation_cannot_be_is_refused() -> None:
    for change, said in (
        ({"mass": -1.0}, "mass must be symmetric and positive semidefinite"),
        ({"damping": np.eye(5)}, r"damping must have shape \(6, 6\)"),
        ({"motions": ("surge", "surge")}, "motions must differ"),
    ):
        with pytest.raises(InputError, match=said):
            Foundation(**{"stiffness": STIFFNESS, **change})


def test_a_start_names_motions_of_a_platform_as_their_channels(turbine: Turbine) -> None:
    """A free decay: pitch begins where the case says, and swings with the period of the mode."""
    case = LoadCase(
        turbine="nrel5mw",
        wind={"kind": "steady", "speed": 0.0},
        controller={"kind": "fixed"},
        start={"pitch": 1.57, "undeflected": True, "coordinates": {"platform_pitch": 0.01, "base surge": -0.2}},
        duration=1.0,
    )
    start = case_start(case, turbine)
    assert start is not None
    model = build(on(turbine, "surge", "pitch"))
    moved = ["q base surge", "q base pitch"]
    begun = simulate(model, 0.0, duration=0.025, output_step=0.025, start=start, channels=moved)
    assert begun.data[0] == pytest.approx([-0.2, 0.01])
    with pytest.raises(InputError, match="no coordinate 'platform_ptich'"):
        simulate(model, 0.0, duration=0.1, start=Start(coordinates={"platform_ptich": 0.1}))
    with pytest.raises(InputError, match="add undeflected: true"):
        case.replace(start={"coordinates": {"platform_pitch": 0.01}})
