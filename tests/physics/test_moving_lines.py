"""Mooring lines of lumped masses: statics, convergence, what moves them, beside lines in their static shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import meltemi
from comparisons.floating import base_at
from meltemi.core.errors import InputError
from meltemi.io import restore_state, save_state, stop_at
from meltemi.sea.airy import GRAVITY
from meltemi.simulation.step import begin_parts_step

pytestmark = pytest.mark.long

SHOWN = ("platform_surge", "platform_heave", "line_1_fairlead_tension", "line_2_anchor_tension", "mooring_force_z")


def case(
    duration: float,
    step: float | None = None,
    heave: float = 1.0,
    line: Any = None,
    shown: float = 0.1,
    events: Any = (),
    sea: Any = None,
    away: float = 0.0,
    integration: str = "implicit",
    **changes: Any,
) -> meltemi.Run:
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    lines = tuple(each.replace(**(line or {})) for each in turbine.platform.lines)
    platform = turbine.platform.replace(**{"line_model": "dynamic", "segments": 20, "lines": lines} | changes)
    rigid = {"flap_modes": 0, "edge_modes": 0, "torsion_modes": 0, "locked": ("generator",)}
    options = meltemi.ModelOptions().replace(**rigid, time_step=step, integration=integration)
    return meltemi.Run(
        meltemi.build(turbine.replace(platform=platform), options),
        0.1,
        duration=duration,
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates={"base heave": heave, "base surge": away}),
        channels=(
            *SHOWN,
            "line_1_anchor_tension",
            "line_2_fairlead_tension",
            "mooring_force_x",
            "water_force_x",
            "water_force_y",
        ),
        output_step=shown,
        events=events,
        sea=sea,
    )


def run(duration: float, *args: Any, **changes: Any) -> meltemi.Result:
    simulation = meltemi.Simulation(case(duration, *args, **changes))
    simulation.advance(simulation.n_steps)
    return simulation.result()


def test_lines_hang_as_continuous_ones_do() -> None:
    """The first sample has static shapes, the next one points in equilibrium; a half of a segment hangs on the body."""
    errors = []
    for segments in (10, 20, 40):
        found = run(0.025, 0.0125, -0.35, shown=0.0125, segments=segments)
        errors.append([found[name][1] / found[name][0] - 1.0 for name in SHOWN[2:]])
    assert np.abs(errors[2]).max() < 0.001
    assert np.abs(errors[2]).max() < 0.35 * np.abs(errors[1]).max() < 0.35**2 * np.abs(errors[0]).max()


def test_the_step_of_the_turbine_is_short_enough() -> None:
    """The tension converges with the square of an explicit step, without a limit of stability (W-27).

    With implicit ones it does so linearly, as lines follow the platform of a step, but from a twentieth of the error.
    """

    def tension(step: float, integration: str = "explicit") -> Any:
        found = run(40.0, step, line={"friction": 0.5}, integration=integration)
        return found["line_1_fairlead_tension"][50:]

    fine, half, whole = (tension(h) for h in (0.003125, 0.0125, 0.025))
    assert np.std(half - fine) < 0.02 * np.std(fine)
    assert np.std(half - fine) < 0.3 * np.std(whole - fine)
    assert np.std(tension(0.025, "implicit") - fine) < 0.1 * np.std(whole - fine)


def test_the_step_does_not_damp_waves_along_the_line() -> None:
    """Without drag and axial damping a line that has been released keeps ringing, whatever the step."""
    free = {"drag": 0.0, "axial_drag": 0.0, "damping_ratio": 0.0}
    size = []
    for step in (0.00625, 0.025):
        tension = run(60.0, step, line=free)["line_1_anchor_tension"]
        slow = np.convolve(tension, np.ones(51) / 51.0, "same")
        size.append(np.std((tension - slow)[300:550]))
    assert size[1] == pytest.approx(size[0], rel=0.03)


def cycle(kind: str, friction: float) -> tuple[float, float]:
    """Work [J] on the lines over a slow closed cycle of the fairleads in surge and heave, and what goes to and fro."""
    steps, dt = (8000, 0.1) if kind == "dynamic" else (4000, 0.2)
    given = {"drag": 0.0, "axial_drag": 0.0, "friction": friction}
    simulation = meltemi.Simulation(case(1.0, 0.0125, 0.0, given, line_model=kind))
    simulation.advance(1)
    of = simulation.case
    first = of.model.coordinates.index("base surge")
    angle = 2.0 * np.pi * np.arange(steps + 1) / steps
    turn = angle - np.sin(angle)  # begins and ends at rest
    place = 6.0 * np.stack([np.sin(turn), 0.0 * turn, 1.0 - np.cos(turn)])
    of["q"][:], of["v"][:], of["a"][:] = 0.0, 0.0, 0.0
    if kind == "dynamic":
        of["line_state"][:] = 0.0
    work, flow, last = 0.0, 0.0, np.zeros(3)
    for k in range(steps + 1):
        of["q"][first : first + 3] = place[:, k]
        if kind == "dynamic":
            of["v"][first : first + 3] = (place[:, k] - place[:, max(k - 1, 0)]) / dt
            begin_parts_step(dt, of.system)
            of["v"][:] = 0.0
        of.evaluate(0.0)
        force = np.array([of.view("platform")["mooring_force"]]).ravel()
        change = -0.5 * (force + last) @ (place[:, k] - place[:, k - 1]) if k else 0.0
        work, flow, last = work + change, flow + abs(change), force
    return work, flow


@pytest.mark.parametrize(("kind", "most"), [("static", 1e-7), ("dynamic", 1e-5)])
def test_a_slow_cycle_costs_no_energy(kind: str, most: float) -> None:
    """Without drag and friction the force on the fairleads has a potential; axial damping is of second order."""
    work, flow = cycle(kind, 0.0)
    assert abs(work) < most * flow


def test_friction_of_the_bed_costs_energy() -> None:
    """Less than the friction of all that lies on the bed over the whole path of the fairleads."""
    work, flow = cycle("dynamic", 0.2)
    weight, path = 3.0 * 595.7 * 9.81 * 850.0, 2.0 * np.pi * 6.0
    assert 1e-4 * flow < work < 0.2 * weight * path


def test_the_platform_feels_the_same_mean_pull_and_more_damping() -> None:
    moving, static = run(200.0), run(200.0, line_model="static")
    for name in SHOWN:
        assert moving[name].mean() == pytest.approx(static[name].mean(), rel=0.01, abs=0.1), name
    tension = "line_1_fairlead_tension"
    assert np.std(moving[tension]) > 1.05 * np.std(static[tension])


@pytest.mark.parametrize("change", [{"damping_ratio": 0.0}, {"friction": 0.6}, {"drag": 0.0}, {"added_mass": 0.0}])
def test_every_constant_of_a_line_matters(change: dict[str, float]) -> None:
    name = "line_1_fairlead_tension"
    assert np.std(run(20.0, line=change)[name] - run(20.0)[name]) > 1.0


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_a_lost_line_no_longer_pulls(kind: str) -> None:
    """Up to then nothing differs; then the force on the platform changes by the tension of the line (in x and z)."""
    loss = [{"at": 2.0, "type": "line_loss", "line": 1}]
    whole, lost = run(4.0, line_model=kind), run(4.0, line_model=kind, events=loss)
    at, tension = 20, "line_1_fairlead_tension"
    assert (lost.data[:at] == whole.data[:at]).all()
    assert (lost[tension][at:] == 0.0).all() and (lost["line_1_anchor_tension"][at:] == 0.0).all()
    change = [lost[f"mooring_force_{axis}"][at] - whole[f"mooring_force_{axis}"][at] for axis in "xz"]
    assert np.hypot(*change) == pytest.approx(whole[tension][at], rel=1e-6)
    assert lost["platform_surge"][-1] > whole["platform_surge"][-1] + 0.05
    assert [(entry.time, entry.what) for entry in lost.log] == [(2.0, "mooring line 1 lost")]
    slope, loads = 3.0, meltemi.loads.equivalent_loads(whole, [tension])
    assert loads[tension] == meltemi.loads.damage_equivalent_load(whole[tension], duration=4.0, slope=slope)


def test_a_run_of_moving_lines_is_continued(tmp_path: Path) -> None:
    whole, first, second = (meltemi.Simulation(case(4.0)) for _ in range(3))
    whole.advance(whole.n_steps)
    stop_at(first, 2.0)
    first.advance(first.n_steps)
    save_state(first, tmp_path / "run.state")
    restore_state(second, tmp_path / "run.state")
    second.advance(second.n_steps)
    assert (second.result().data == whole.result().data).all()


def test_segments_have_limits() -> None:
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    with pytest.raises(InputError, match="segments"):
        turbine.platform.replace(segments=2)


def test_a_current_pushes_on_the_hull_by_its_quadratic_damping() -> None:
    """The first sample, at rest: D u |u| along the current (W-10), of which added mass takes its share."""
    angle, platform = 0.3, meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    D = platform.quadratic_damping

    def push(speed: float, share: float = 1.0) -> Any:
        water = meltemi.environment.StillWater(current=meltemi.environment.Current(uniform=speed, direction=angle))
        found = run(0.025, 0.0125, line_model="static", sea=water, quadratic_damping=share * D)
        return np.array([found[f"water_force_{axis}"][0] for axis in "xy"])

    rest = push(0.0)
    one, double, stiff = push(0.5) - rest, push(1.0) - rest, push(0.5, 2.0) - rest
    assert double == pytest.approx(4.0 * one, rel=1e-6) and stiff == pytest.approx(2.0 * one, rel=1e-6)
    along = 0.5 * np.array([np.cos(angle), -np.sin(angle)])
    share = one / (D[0, 0] * along * np.abs(along))
    assert 0.5 < share[0] < 1.0 and share[1] == pytest.approx(share[0], rel=0.1)


def test_a_free_platform_moves_alike_whatever_its_heading() -> None:
    """Pitch of 6 deg is let go without lines and air: buoyancy and tower turn with the platform (W-8, W-30)."""
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    platform = turbine.platform.replace(lines=(), line_model="dynamic")
    options = meltemi.ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, locked=("generator", "yaw"))
    model = meltemi.build(turbine.replace(platform=platform), options)
    loads = [f"tower_base_moment_{way}" for way in ("fore_aft", "side_side")]
    found = [
        meltemi.simulate(
            model.with_parameters(**{"aerodynamics.air_density": 0.0}),
            0.1,
            duration=40.0,
            controller=meltemi.control.ConstantController(),
            start=meltemi.Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates=base_at(0.0, -0.35, 6.0, heading)),
            channels=("platform_pitch", "platform_roll", *loads),
            output_step=0.5,
        )
        for heading in (0.0, 20.0)
    ]
    size = np.abs(found[0]["platform_pitch"]).max()
    assert size > 0.1
    for result in found:
        assert np.abs(result["platform_roll"]).max() < 0.01 * size
        assert np.abs(result[loads[1]]).max() < 0.01 * np.abs(result[loads[0]]).max()
    for name in ("platform_pitch", loads[0]):
        assert np.abs(found[1][name] - found[0][name]).max() < 0.015 * np.abs(found[0][name]).max()


def test_loads_at_the_tower_base_move_the_platform() -> None:
    """Mass times acceleration of the platform is its weight, the water and the tower, while it turns fast and far."""
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    platform, step = turbine.platform.replace(lines=()), 0.01
    options = meltemi.ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, locked=("generator",), time_step=step)
    axes, turns = ("surge", "sway", "heave"), ("roll", "pitch", "yaw")
    base = dict(zip((f"base {name}" for name in turns), (0.05, -0.1, 0.15), strict=True))
    found = meltemi.simulate(
        meltemi.build(turbine.replace(platform=platform), options).with_parameters(**{"aerodynamics.air_density": 0.0}),
        0.1,
        duration=8.0,
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates=base, velocities={"base pitch": 0.1}),
        channels=(
            *(f"platform_{name}" for name in (*axes, *turns)),
            *(f"water_force_{x}" for x in "xyz"),
            *(f"tower_base_force_{x}" for x in "xyz"),
        ),
        output_step=step,
    )
    R = Rotation.from_euler("ZYX", np.stack([found[f"platform_{name}"] for name in turns[::-1]], axis=1))
    place = np.stack([found[f"platform_{name}"] for name in axes], axis=1) + R.apply(np.array(platform.centre))
    needed = platform.mass * (np.diff(place, 2, axis=0) / step**2 + [0.0, 0.0, GRAVITY])
    pushed = np.stack([found[f"water_force_{x}"] for x in "xyz"], axis=1)
    pushed += R.apply(np.stack([found[f"tower_base_force_{x}"] for x in "xyz"], axis=1))
    error = (pushed[1:-1] - needed)[50:]
    assert (np.abs(error).max(axis=0) < 2e-3 * np.ptp(pushed, axis=0)).all()


def test_lines_that_hang_straight_down_hardly_pull() -> None:
    """A platform 250 m downwind, past where its lines downwind are slack: it comes back, and nothing diverges."""
    found = run(60.0, line_model="static", away=250.0)
    assert found.status.complete
    assert found["platform_surge"][-1] < found["platform_surge"][0]
    hanging = found["line_2_fairlead_tension"][0]
    assert 0.9e6 < hanging < 1.3e6  # the weight in water of the length above the bed


def test_static_lines_have_less_fatigue() -> None:
    """In a regular wave, what the sea does to the tension runs along the line: static ones have far less of it."""
    sea = meltemi.environment.RegularSea(height=6.0, period=10.0)
    tension, late = "line_2_fairlead_tension", slice(600, None)
    moving, static = (run(100.0, line_model=kind, heave=-0.35, sea=sea) for kind in ("dynamic", "static"))
    loads = [
        meltemi.loads.damage_equivalent_load(each[tension][late], duration=40.0, slope=3.0) for each in (moving, static)
    ]
    assert loads[1] < 0.8 * loads[0]
    assert any("static shapes" in words for words in static.warnings) and not moving.warnings


def test_a_line_that_diverges_is_named() -> None:
    """Nothing damps a line of 30 times the stiffness in a storm; the run ends, and says which line it is."""
    line = {"stiffness": 1e11, "damping_ratio": 0.0, "drag": 0.0, "axial_drag": 0.0}
    sea = meltemi.environment.IrregularSea(height=12.0, period=11.0)
    with pytest.raises(meltemi.RunError, match=r"mooring line \d diverges, with 30 segments: give it drag"):
        run(200.0, line=line, sea=sea, segments=30).raise_for_status()
