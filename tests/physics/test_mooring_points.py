"""Free points of mooring lines: several lines in a row, clump weights, bridles; static and moving."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import meltemi
from meltemi.analyses.linear import linearise
from meltemi.core.errors import InputError
from meltemi.exchange.openfast.mooring import read_mooring
from meltemi.exchange.openfast.text import read_input
from meltemi.exchange.openfast_writer.water import mooring
from meltemi.exchange.report import Notes
from meltemi.floating.balance import check_reach, lines_load
from meltemi.floating.floater import FloaterPart
from meltemi.floating.moorings import AtRest, MooringLine, MooringPoint, at_rest, shapes
from meltemi.floating.platform import Platform
from meltemi.floating.rao import steady_point, wave_driven
from meltemi.io import restore_state, save_state, stop_at

CHAIN = {"mass": 685.0, "diameter": 0.333, "stiffness": 3.27e9}
ROPE = {"mass": 120.0, "diameter": 0.25, "stiffness": 4e8}
ANCHOR = [-837.6, 0.0, -200.0]
DEPTH, DENSITY = 200.0, 1025.0
BASE_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def line(fairlead: Any, anchor: Any, length: float, kind: Any = CHAIN, **more: Any) -> MooringLine:
    return MooringLine(fairlead=fairlead, anchor=anchor, length=length, **(kind | more))


def rest(*lines: MooringLine, **points: MooringPoint) -> AtRest:
    return at_rest(lines, points, DEPTH, DENSITY)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("length", [100.0, 300.0, 500.0, 800.0])
def test_equal_lines_in_a_row_are_one_line(length: float, friction: float) -> None:
    """Wherever they meet: off the bed, or on it."""
    whole = rest(line([-58, 0, -14], ANCHOR, 850.0, friction=friction))
    both = rest(
        line([-58, 0, -14], "joint", length, friction=friction),
        line("joint", ANCHOR, 850.0 - length, friction=friction),
        joint=MooringPoint(),
    )
    assert both.force[0] == pytest.approx(whole.force[0], rel=1e-11)
    assert both.tension[1, 1] == pytest.approx(whole.tension[0, 1], rel=1e-11)
    ends = [both.upper[1], both.lower[1]]
    assert np.abs(np.array(ends) - [both.lower[0], ANCHOR]).max() < 1e-6
    (shape,) = shapes(whole, [line([-58, 0, -14], ANCHOR, 850.0)], DENSITY, 851)
    if not friction:
        assert both.lower[0] == pytest.approx(shape[round(length)], abs=1e-6)


def test_a_clump_weight_in_the_middle_of_two_light_lines() -> None:
    """W = 2 T sin a, half the span = L (1 + T / EA) cos a."""
    light = {"mass": 1e-6 + DENSITY * 0.25 * np.pi * 0.01, "diameter": 0.1, "stiffness": 1e8}
    mass, volume, half, L = 40e3, 5.0, 100.0, 104.0
    found = rest(
        line([0.0, 0.0, -20.0], "clump", L, light),
        line("clump", [2 * half, 0.0, -20.0], L, light),
        clump=MooringPoint(mass=mass, volume=volume),
    )
    W = 9.80665 * (mass - DENSITY * volume)

    def gap(angle: float) -> float:
        return L * (1.0 + W / (2.0 * np.sin(angle) * 1e8)) * np.cos(angle) - half

    angle = brentq(gap, 0.05, 1.5)
    assert found.tension[0] == pytest.approx(W / (2.0 * np.sin(angle)), rel=1e-6)
    assert found.lower[0] == pytest.approx([half, 0.0, -20.0 - half * np.tan(angle)], rel=1e-6)


def test_a_clump_weight_on_the_bed_carries_no_more_than_its_weight() -> None:
    """Once it lies there, more weight changes nothing."""
    lines = line([-58, 0, -14], "clump", 300.0), line("clump", ANCHOR, 550.0)
    free, low, heavy = (rest(*lines, clump=MooringPoint(mass=mass)) for mass in (5e3, 60e3, 500e3))
    assert free.lower[0, 2] > -197.0 and low.lower[0, 2] == pytest.approx(-200.0, abs=1e-6)
    assert heavy.force == pytest.approx(low.force, rel=1e-9)


def layouts() -> dict[str, tuple[tuple[MooringLine, ...], dict[str, MooringPoint]]]:
    row = line([-58, 0, -14], "p", 300.0), line("p", ANCHOR, 550.0, ROPE)
    buoyed = line([-58, 0, -14], "p", 300.0, ROPE), line("p", ANCHOR, 550.0)
    bridle = (
        line([-50, 20, -14], "p", 60.0),
        line([-50, -20, -14], "p", 64.0, ROPE),
        line("p", [-837.6, 50, -200], 800.0),
    )
    below = *bridle[:2], line("p", "c", 300.0, ROPE), line("c", [-837.6, 50, -200], 440.0)
    above = line([-50, 20, -14], "c", 30.0), line("c", "p", 30.0), *bridle[1:]
    return {
        "clump": (row, {"p": MooringPoint(mass=20e3, volume=2.5)}),
        "buoy": (buoyed, {"p": MooringPoint(mass=10e3, volume=60.0)}),
        "bridle": (bridle, {"p": MooringPoint()}),
        "heavy bridle": (bridle, {"p": MooringPoint(mass=30e3, volume=4.0)}),
        "clump below a bridle": (below, {"p": MooringPoint(), "c": MooringPoint(mass=50e3, volume=6.0)}),
        "clump in a bridle": (above, {"p": MooringPoint(), "c": MooringPoint(mass=5e3, volume=0.6)}),
    }


@pytest.mark.parametrize("name", layouts())
def test_points_are_where_moorpy_has_them(name: str) -> None:
    """Within 0.01 % of tensions and 1 cm; MoorPy's sea bed pushes from 2 m above it, so nothing touches it here."""
    moorpy = pytest.importorskip("moorpy")
    lines, points = layouts()[name]
    system = moorpy.System(depth=DEPTH, rho=DENSITY, g=9.80665)
    found = at_rest(lines, points, DEPTH, DENSITY)
    ends = {each.anchor: low for each, low in zip(lines, found.lower, strict=True) if isinstance(each.anchor, str)}
    first = {label: place + np.array([3.0, 2.0, 5.0]) for label, place in ends.items()}
    number: dict[str, int] = {}
    for label, point in points.items():
        system.addPoint(0, first[label], m=point.mass, v=point.volume)
        number[label] = len(system.pointList)
    for i, each in enumerate(lines):
        ends = []
        for end in (each.anchor, each.fairlead):
            if not isinstance(end, str):
                system.addPoint(1, list(end))
            ends.append(number[end] if isinstance(end, str) else len(system.pointList))
        weight = 9.80665 * each.wet_mass(DENSITY)
        system.lineTypes[f"{i}"] = {
            "name": f"{i}",
            "d_vol": each.diameter,
            "m": each.mass,
            "EA": each.stiffness,
            "EAd": 0,
        }
        system.lineTypes[f"{i}"] |= {"w": weight, "MBL": 1e9, "cost": 0, "notes": "", "material": ""}
        system.addLine(each.length, f"{i}", pointA=ends[0], pointB=ends[1])
    system.initialize()
    system.solveEquilibrium(tol=1e-5)
    known = np.array([[each.TB, each.TA] for each in system.lineList])
    assert found.tension == pytest.approx(known, rel=1e-4)
    assert np.abs(found.lower - [each.rA for each in system.lineList]).max() < 0.01


def test_forces_on_free_points_balance() -> None:
    """At a junction far from where the search begins, with a leg that is slack."""
    found = rest(
        line([-50, 20, -14], "p", 60.0),
        line([-50, -20, -14], "p", 150.0),
        line("p", [-837.6, 400, -200], 900.0),
        p=MooringPoint(mass=8e3),
    )
    place = found.lower[0]
    assert found.lower[1] == pytest.approx(place, abs=1e-6) and found.upper[2] == pytest.approx(place, abs=1e-6)
    total = np.array([0.0, 0.0, -9.80665 * 8e3])
    for i, weight in ((0, 60.0), (1, 150.0)):
        way = found.upper[i] - found.lower[i]
        H = found.horizontal[i] / np.hypot(*way[:2])
        wet = line([0, 0, 0], "p", 1.0).wet_mass(DENSITY)
        total += [H * way[0], H * way[1], found.vertical[i] - 9.80665 * wet * weight]
    way = found.upper[2] - found.lower[2]
    H = found.horizontal[2] / np.hypot(*way[:2])
    total -= [H * way[0], H * way[1], found.vertical[2]]
    assert np.abs(total).max() < 1e-4 * found.tension.max()
    assert found.tension[1, 1] < 0.2 * found.tension[0, 1]


@pytest.mark.parametrize(
    ("lines", "points", "says"),
    [
        ([line([-58, 0, -14], "p", 300.0)], {}, "line 1 ends at 'p', which is not one of points"),
        ([line([-58, 0, -14], "p", 300.0)], {"p": MooringPoint()}, "p must be the anchor of a line"),
        ([line("p", ANCHOR, 300.0), line("p", ANCHOR, 300.0)], {"p": MooringPoint()}, "p must be the anchor of a line"),
        (
            [line("p", "q", 9.0), line("q", "p", 9.0)],
            {"p": MooringPoint(), "q": MooringPoint()},
            "line 1 belongs to a ring",
        ),
        (
            [
                *(line([-58, y, -14], "p", 99.0) for y in (5, -5)),
                line("p", "q", 300.0),
                *(line("q", [-837.6, y, -200], 500.0) for y in (50, -50)),
            ],
            {"p": MooringPoint(), "q": MooringPoint()},
            "from p to q lines join two points",
        ),
    ],
)
def test_points_that_join_nothing_are_refused(lines: Any, points: Any, says: str) -> None:
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    with pytest.raises(InputError, match=says):
        platform.replace(lines=tuple(lines), points=points)


def bridled(spread: float = 12.0, leg: float = 55.0, **clump: float) -> dict[str, Any]:
    """Three bridles, with a clump weight below each."""
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    lines, points = [], {}
    for i, each in enumerate(platform.lines):
        assert not isinstance(each.anchor, str) and not isinstance(each.fairlead, str)
        kind = each.model_dump(exclude={"fairlead", "anchor", "length", "strength"})
        aside = spread * np.array([-each.anchor[1], each.anchor[0], 0.0]) / np.hypot(*each.anchor[:2])
        points |= {f"b{i}": MooringPoint(), f"c{i}": MooringPoint(**clump)}
        half = kind | {name: 0.5 * kind[name] for name in ("mass", "stiffness")}
        half |= {name: kind[name] / 2**0.5 for name in ("diameter", "drag", "axial_drag")}
        lines += [line(each.fairlead + s * aside, f"b{i}", leg, half) for s in (1.0, -1.0)]
        lines += [line(f"b{i}", f"c{i}", 240.0, kind), line(f"c{i}", each.anchor, 850.0 - 240.0 - leg, kind)]
    return {"lines": tuple(lines), "points": points}


def simulation(duration: float, step: float | None = None, events: Any = (), **changes: Any) -> meltemi.Simulation:
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    platform = turbine.platform.replace(**(bridled() | changes))
    options = meltemi.ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, time_step=step, locked=("generator",))
    start = {"base heave": -0.5, "base surge": 3.0, "base yaw": 0.02}
    names = [f"line_{i}_{end}_tension" for i in range(1, len(platform.lines) + 1) for end in ("fairlead", "anchor")]
    case = meltemi.Run(
        meltemi.build(turbine.replace(platform=platform), options),
        0.1,
        duration=duration,
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates=start),
        channels=("platform_surge", "platform_yaw", *(f"mooring_force_{axis}" for axis in "xyz"), *names),
        output_step=step or 0.1,
        events=events,
    )
    return meltemi.Simulation(case)


def result(*args: Any, **changes: Any) -> meltemi.Result:
    run = simulation(*args, **changes)
    run.advance(run.n_steps)
    return run.result()


def in_a_row(leg: float) -> dict[str, Any]:
    """Each line of the platform in three pieces."""
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    lines = []
    for i, each in enumerate(platform.lines):
        kind = each.model_dump(exclude={"fairlead", "anchor", "length", "strength"})
        lines += [line(each.fairlead, f"b{i}", leg, kind), line(f"b{i}", f"c{i}", 240.0, kind)]
        lines += [line(f"c{i}", each.anchor, 850.0 - 240.0 - leg, kind)]
    return {"lines": tuple(lines), "points": {f"{x}{i}": MooringPoint() for i in range(3) for x in "bc"}}


@pytest.mark.long
@pytest.mark.parametrize(("kind", "bounds"), [("static", (1e-3, 5e-3, 0.07)), ("dynamic", (1e-6, 1e-5, 1e-4))])
def test_a_bridle_without_width_is_a_row_of_lines(kind: str, bounds: tuple[float, ...]) -> None:
    """Legs with half the properties of the line, at the same fairlead; static ones have their inertia at their ends."""
    row, tied = (result(60.0, line_model=kind, **lines) for lines in (in_a_row(60.0), bridled(0.0, 60.0)))
    for name, bound in zip(("platform_surge", "mooring_force_x", "mooring_force_z"), bounds, strict=True):
        assert np.std(tied[name] - row[name]) < bound * np.std(row[name]), name
        assert tied[name][0] == pytest.approx(row[name][0], rel=1e-7), name


@pytest.mark.long
def test_static_lines_in_a_row_move_as_one() -> None:
    """Drag and inertia act at other points of the line."""
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    alone: dict[str, Any] = {"lines": platform.lines, "points": {}}
    one, row = (result(60.0, line_model="static", **lines) for lines in (alone, in_a_row(60.0)))
    for name in ("platform_surge", "mooring_force_x", "mooring_force_z"):
        assert np.std(row[name] - one[name]) < 1e-3 * np.std(one[name]), name


@pytest.mark.long
def test_moving_lines_begin_at_rest_with_their_points() -> None:
    """The first sample has static shapes, the next one points in equilibrium: of second order in the segments."""
    errors = []
    for segments in (8, 16, 32):
        found = result(0.025, 0.0125, line_model="dynamic", segments=segments, **bridled(mass=20e3, volume=2.5))
        names = [f"line_{i}_{end}_tension" for i in (1, 2, 3, 4) for end in ("fairlead", "anchor")]
        errors.append(max(abs(found[name][1] / found[name][0] - 1.0) for name in [*names, "mooring_force_z"]))
    assert errors[2] < 0.01 and errors[2] < 0.35 * errors[0]


@pytest.mark.long
def test_slow_motions_pull_alike_on_static_and_moving_lines() -> None:
    static, moving = (
        result(100.0, line_model=kind, **bridled(mass=20e3, volume=2.5)) for kind in ("static", "dynamic")
    )
    for name in ("platform_surge", "mooring_force_z", "line_1_fairlead_tension", "line_4_anchor_tension"):
        assert moving[name].mean() == pytest.approx(static[name].mean(), rel=0.02, abs=0.1), name


@pytest.mark.long
@pytest.mark.parametrize("kind", ["static", "dynamic"])
@pytest.mark.parametrize("what", ["mass", "drag_area", "added_mass"])
def test_every_constant_of_a_point_matters(what: str, kind: str) -> None:
    clump = {"mass": 20e3, "volume": 5.0, "drag_area": 10.0, "added_mass": 1.0}
    one, other = (
        result(10.0, line_model=kind, segments=8, **bridled(**(clump | {what: share * clump[what]})))
        for share in (1.0, 1.5)
    )
    assert np.std(one["line_1_fairlead_tension"] - other["line_1_fairlead_tension"]) > 1.0


@pytest.mark.long
@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_loss_of_a_leg_and_of_what_is_below(kind: str) -> None:
    """Without a leg the other one carries the bridle; without a line below, both hang between their fairleads."""
    found = {
        which: result(4.0, line_model=kind, segments=8, events=[{"at": 2.0, "type": "line_loss", "line": which}])
        for which in (1, 4)
    }
    tension = {which: [each[f"line_{i}_fairlead_tension"] for i in (1, 2, 3, 4)] for which, each in found.items()}
    leg, below = (np.array(tension[which])[:, -1] for which in (1, 4))
    assert leg[0] == 0.0 and leg[1] > 1.5 * tension[1][1][0] and leg[3] > 0.7 * tension[1][3][0]
    assert (below[2:] == 0.0).all() and below[0] == pytest.approx(below[1], rel=0.01)
    assert 0.0 < below[0] < 0.15 * tension[4][0][19]


@pytest.mark.long
@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_a_run_with_points_is_continued(kind: str, tmp_path: Path) -> None:
    whole, first, second = (simulation(4.0, line_model=kind, segments=8) for _ in range(3))
    whole.advance(whole.n_steps)
    stop_at(first, 2.0)
    first.advance(first.n_steps)
    save_state(first, tmp_path / "run.state")
    restore_state(second, tmp_path / "run.state")
    second.advance(second.n_steps)
    assert (second.result().data == whole.result().data).all()


@pytest.mark.long
def test_linear_models_have_the_stiffness_of_bridles() -> None:
    """A displacement changes the forces on the platform as by finite differences of lines at rest (W-41)."""
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    platform = turbine.platform.replace(**bridled(20.0, 50.0, mass=20e3, volume=2.5))
    options = meltemi.ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, locked=("generator", "yaw"))
    model = meltemi.build(turbine.replace(platform=platform), options)
    linear = linearise(model, steady_point(model, 0.0), (), ("platform_surge",))
    (part,) = (each for each in model.parts if isinstance(each, FloaterPart))
    driven = wave_driven(linear, part)
    rows = [i for i, name in enumerate(linear.states) if name.startswith("v ")]
    columns = [linear.states.index(f"q base {motion}") for motion in ("surge", "sway", "heave")]
    found = -np.linalg.lstsq(driven.B[rows], linear.A[np.ix_(rows, columns)], rcond=None)[0][:3]
    place = np.array([linear.x0[linear.states.index(f"q base {m}")] for m in BASE_MOTIONS])
    tilted = Rotation.from_rotvec(place[3:]).apply([0.0, 0.0, -turbine.tower.base_height])
    place[:3] += tilted + np.array([0.0, 0.0, turbine.tower.base_height])
    known = np.zeros((3, 3))
    for k in range(3):
        ahead, behind = (lines_load(platform, place + s * 0.01 * np.eye(6)[k]) for s in (1.0, -1.0))
        known[:, k] = -(ahead - behind)[:3] / 0.02
    known[2, 2] += DENSITY * 9.80665 * part.coefficients.hydrostatic[2, 2]
    assert np.abs(found - known).max() < 1e-3 * np.abs(known[:2, :2]).max()


def test_points_are_written_for_moordyn_and_read_again(tmp_path: Path) -> None:
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    assert turbine.platform is not None
    platform = turbine.platform.replace(**bridled(mass=20e3, volume=2.5, drag_area=3.0, added_mass=1.0))
    (tmp_path / "MoorDyn.dat").write_text(mooring("title", platform))
    back = read_mooring(read_input(tmp_path / "MoorDyn.dat", "mooring"), platform.depth, Notes())
    made = Platform.model_validate(platform.model_dump() | back)
    one, other = (at_rest(each.lines, each.points, each.depth, DENSITY) for each in (platform, made))
    assert other.force == pytest.approx(one.force, rel=1e-6)
    assert [point.drag_area for point in made.points.values()] == [0.0, 3.0] * 3


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"trunk": 700.0}, "line 1, 3: the ends are .* % further apart than its length of 755 m"),
        ({"leg": 10.0}, "line 1, 2: the ends are 20 % further apart than its length of 20 m"),
    ],
)
def test_bridles_that_are_too_short_are_refused(changes: dict[str, float], says: str) -> None:
    """From the fairlead to the anchor, and from one fairlead to the other."""
    leg, trunk = changes.get("leg", 55.0), changes.get("trunk", 800.0)
    lines = [line([-58, y, -14], "p", leg) for y in (12.0, -12.0)] + [line("p", ANCHOR, trunk)]
    platform = Platform(
        depth=DEPTH, mass=1e7, centre=[0, 0, -10], inertia=[1e9] * 3, volume=1e4, coefficients="iea15mw-volturnus",
        lines=lines, points={"p": MooringPoint()},
    )  # fmt: skip
    with pytest.raises(InputError, match=says):
        check_reach(platform, "platform.lines")
    check_reach(platform.replace(lines=[each.replace(length=1.3 * each.length) for each in lines]), "platform.lines")
