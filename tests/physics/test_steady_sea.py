"""Steady operation in water with level and current, and with the mean drift of waves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.analyses.linear import linearise
from meltemi.analyses.power_curve import power_curve
from meltemi.core.errors import InputError
from meltemi.environment import Current, IrregularSea, StillWater, steady_sea
from meltemi.floating.balance import check_reach
from meltemi.floating.floater import FloaterPart
from meltemi.floating.moorings import at_rest
from meltemi.floating.rao import steady_point, wave_driven
from meltemi.floating.waves import mean_drift

pytestmark = pytest.mark.slow
RIGID = meltemi.ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0)


def model_of(name: str, **platform: Any) -> Any:
    turbine = meltemi.load_turbine(name)
    if platform:
        assert turbine.platform is not None
        turbine = turbine.replace(platform=turbine.platform.replace(**platform))
    return meltemi.build(turbine, RIGID)


@pytest.fixture(scope="module")
def floats() -> Any:
    return model_of("iea15mw-volturnus")


def test_a_current_pushes_a_pile_by_its_drag() -> None:
    """1/2 rho C_D D u^2 over the depth; with 3 m more water over 3 m more."""
    model = model_of("iea15mw-monopile")
    rest = meltemi.operating_point(model, 14.0)["mudline_reaction_force_x"]
    for level in (0.0, 3.0):
        sea = StillWater(level=level, current=Current(uniform=0.8))
        found = meltemi.operating_point(steady_sea(model, sea), 14.0)["mudline_reaction_force_x"]
        assert rest - found == pytest.approx(0.5 * 1025.0 * 10.0 * 0.8**2 * (30.0 + level), rel=2e-3)


def test_lines_hold_a_platform_against_the_current(floats: Any) -> None:
    """Their pull changes by the drag of the current, and by what the thrust changes with the tilt."""
    still = meltemi.operating_point(floats, 14.0)
    found = meltemi.operating_point(steady_sea(floats, StillWater(current=Current(uniform=0.8))), 14.0)
    drag = floats.turbine.platform.quadratic_damping[0, 0] * 0.8**2
    more = [found[name] - still[name] for name in ("mooring_force_x", "rotor_aero_thrust")]
    assert -more[0] == pytest.approx(drag + more[1], rel=0.02)
    assert found["platform_surge"] > still["platform_surge"] + 3.0


def test_a_level_lifts_a_platform_from_its_anchors(floats: Any) -> None:
    """As the platform in deeper water, with deeper anchors; too high a level is refused."""
    platform = floats.turbine.platform
    deeper = [line.replace(anchor=line.anchor - np.array([0.0, 0.0, 3.0])) for line in platform.lines]
    known = meltemi.operating_point(model_of("iea15mw-volturnus", depth=203.0, lines=deeper), 14.0)
    found = meltemi.operating_point(steady_sea(floats, StillWater(level=3.0)), 14.0)
    for name in ("platform_surge", "platform_heave", "platform_pitch", "line_1_fairlead_tension"):
        assert found[name] == pytest.approx(known[name], rel=1e-9), name
    tension = at_rest(platform.lines, {}, platform.depth, 1025.0).tension[0, 0]
    assert at_rest(deeper, {}, 203.0, 1025.0).tension[0, 0] > 1.02 * tension
    taut = platform.replace(lines=[line.replace(length=795.0) for line in platform.lines])
    check_reach(taut, "lines")
    with pytest.raises(
        InputError, match=r"sea.level: line 1: the ends are .* % further apart than its length of 795 m"
    ):
        check_reach(taut, "sea.level", 49.0)


def test_waves_push_by_their_mean_drift(floats: Any) -> None:
    sea, platform = IrregularSea(height=4.0, period=10.0, seed=2), floats.turbine.platform
    still, found = (meltemi.operating_point(each, 14.0) for each in (floats, steady_sea(floats, sea)))
    (part,) = (each for each in floats.parts if isinstance(each, FloaterPart))
    force = mean_drift(sea, part.coefficients, platform, 9.80665)[0]
    thrust = found["rotor_aero_thrust"] - still["rotor_aero_thrust"]
    assert force > 1e4
    assert still["mooring_force_x"] - found["mooring_force_x"] == pytest.approx(force + thrust, rel=0.05)
    none = model_of("iea15mw-volturnus", drift="none")
    assert meltemi.operating_point(steady_sea(none, sea), 14.0)["platform_surge"] == pytest.approx(
        still["platform_surge"], abs=1e-6
    )


@pytest.mark.long
def test_a_run_in_a_current_stays_where_it_begins() -> None:
    """With static lines: the drag of the current on moving ones is not in steady operation, and moves 0.14 m."""
    floats = model_of("iea15mw-volturnus", line_model="static")
    sea = StillWater(current=Current(uniform=0.8, direction=0.3))
    point = meltemi.operating_point(steady_sea(floats, sea), 14.0)
    controller = meltemi.control.ConstantController()
    moved = []
    for start in (point, meltemi.operating_point(floats, 14.0)):
        run = meltemi.simulate(
            floats, 14.0, duration=60.0, controller=controller, start=start, sea=sea,
            channels=("platform_surge", "platform_sway"), output_step=1.0,
        )  # fmt: skip
        moved.append(np.ptp(run["platform_surge"]) + np.ptp(run["platform_sway"]))
    assert moved[0] < 0.02 and moved[1] > 1.0


@pytest.mark.long
def test_a_linear_model_has_the_damping_of_the_current(floats: Any) -> None:
    """A velocity v along the current u changes the drag by 2 D u v."""
    speed, damping = 0.8, floats.turbine.platform.quadratic_damping
    linear = []
    for sea in (StillWater(), StillWater(current=Current(uniform=speed))):
        model = steady_sea(floats, sea)
        linear.append(linearise(model, steady_point(model, 0.0), (), ("platform_surge",)))
    (part,) = (each for each in floats.parts if isinstance(each, FloaterPart))
    surge, heave = (linear[0].states.index(f"v base {motion}") for motion in ("surge", "heave"))
    change = linear[1].A[surge, surge] - linear[0].A[surge, surge]
    force = -2.0 * speed * damping[:, 0]
    assert change == pytest.approx(float(wave_driven(linear[0], part).B[surge] @ force), rel=0.05)
    assert abs(linear[1].A[heave, heave] - linear[0].A[heave, heave]) < 0.05 * abs(change)


def test_power_curves_and_land(floats: Any) -> None:
    sea = StillWater(current=Current(uniform=1.0))
    surge = []
    for model in (floats, steady_sea(floats, sea)):
        ((_, point),) = power_curve(model, [8.0])
        assert not isinstance(point, str), point
        surge.append(point["platform_surge"])
    assert surge[1] > surge[0] + 3.0
    with pytest.raises(InputError, match="stands on land"):
        steady_sea(model_of("nrel5mw"), sea)
