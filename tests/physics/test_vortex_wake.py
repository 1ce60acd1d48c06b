"""Wakes of wings and rotors that are set by hand: conservation, closed forms, and what each option changes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from vortex_lines import goldstein, velocity
from vortex_rotor import STILL, Float, by_hand, place, radial, rows_of, settle, solved, stored, turn

from meltemi import ModelOptions, SteadyWind, Turbine, build, load_turbine
from meltemi.aero.tables import AeroNode
from meltemi.compiler import View
from meltemi.simulation.case import Case
from meltemi.vortex.filaments import CORES
from meltemi.vortex.wake import at_blades, convect, merge, merge_rows, shed_row

SPAN, WIND, ALPHA, ASPECT = 120.0, 10.0, np.radians(5.0), 8.0
AWAY = np.array([1e6, 2e6])
"""[m] where the other blades are."""
HUB = np.array([0.0, 0.0, 90.0])
TIME = 40.0
"""[s] of the motion of two vortices."""


def wing(turbine: Turbine, y: Float, **vortices: Any) -> Case:
    """A wing along the y axis, which the first blade is, across the wind."""
    case = by_hand(turbine, nodes=len(y) - 1, core="none", **vortices)
    turn(case, WIND, 0.0)
    ends = np.zeros((3, len(y), 3))
    ends[:, :, 1], ends[1:, :, 2] = y, AWAY[:, None]
    place(case, ends)
    return case


def spaced(n: int) -> Float:
    """(n + 1,) ends of elements over a span from -1 to 1, narrower towards both tips as on blades."""
    j = np.linspace(0.0, 1.0, n // 2 + 1)
    half = 0.5 * j + 0.5 * np.sin(0.5 * np.pi * j)
    return np.concatenate([-half[::-1], half[1:]])


@pytest.mark.parametrize(("n", "lift", "drag"), [(20, 0.002, 0.012), (40, 0.0015, 0.006)])
def test_an_elliptical_wing(turbine: Turbine, n: int, lift: float, drag: float) -> None:
    """Lift and induced drag of Prandtl's wing with the polar 2 pi alpha."""
    y = 0.5 * SPAN * spaced(n)
    root = 4.0 * SPAN / (np.pi * ASPECT)
    middle, width = 0.5 * (y[1:] + y[:-1]), np.diff(y)
    chord = root * np.sqrt(1.0 - (2.0 * middle / SPAN) ** 2)
    G, w = solved(wing(turbine, y), chord, WIND, ALPHA, step=0.6)
    area, exact = 0.25 * np.pi * SPAN * root, 2.0 * np.pi * ALPHA / (1.0 + 2.0 / ASPECT)
    assert 2.0 * (G * width).sum() / (WIND * area) == pytest.approx(exact, rel=lift)
    assert -2.0 * (G * w * width).sum() / (WIND**2 * area) == pytest.approx(exact**2 / (np.pi * ASPECT), rel=drag)


@pytest.mark.parametrize(("lattice", "tolerance"), [(0.5, 0.008), (2.0, 0.003)])
def test_the_rotor_of_prandtl_and_goldstein(turbine: Turbine, lattice: float, tolerance: float) -> None:
    """Optimum circulation: its wake moves like a rigid screw, half as fast at the blades; between 0.1 and 0.85 R."""
    nodes, R, advance, w, step = 20, 60.0, 1.0 / 8.0, 1.0, np.radians(10.0)
    case = by_hand(turbine, nodes=nodes, lattice=lattice)
    speed = WIND / (advance * R)
    turn(case, WIND, speed)
    j = np.linspace(0.0, 1.0, nodes + 1)
    r = R * (0.5 * j + 0.5 * np.sin(0.5 * np.pi * j))
    place(case, radial(np.maximum(r, 1e-6)))
    x = 0.5 * (r[1:] + r[:-1]) / R
    G = 2.0 * np.pi * advance * R * w / 3.0 * goldstein(x, advance)
    u = settle(case, np.tile(G, (3, 1)), step / speed)
    azimuth = 2.0 * np.pi * np.arange(3)[:, None] / 3.0
    around = u[2] * np.cos(azimuth) - u[1] * np.sin(azimuth)
    flow = np.arctan2(advance, x)
    normal = (u[0] * np.cos(flow) + around * np.sin(flow)) / np.cos(flow)
    inside = (x > 0.1) & (x < 0.85)
    np.testing.assert_allclose(normal[:, inside], -0.5 * w, rtol=tolerance)
    assert np.ptp(normal, axis=0).max() < 1e-12  # blades alike
    np.testing.assert_array_less(around, 0.0)  # the wake turns against the rotor


def test_goldsteins_function() -> None:
    """Published values, which the tests of rotors rest on (panels of Okulov's helices, 240 a radius)."""
    x = np.array([0.3, 0.5, 0.7, 0.9, 0.95])
    np.testing.assert_allclose(goldstein(x, 1.0 / 8.0), [0.8356, 0.9340, 0.9476, 0.7780, 0.6068], atol=2e-3)
    np.testing.assert_allclose(goldstein(x, 1.0 / 4.0), [0.5772, 0.7465, 0.7631, 0.5564, 0.4149], atol=2e-3)


@pytest.mark.parametrize(
    ("advance", "w", "ratio", "power", "thrust"),
    [
        (1.0 / 2.0, 0.8058, 1.194, 0.2481, 0.4156),
        (1.0 / 4.0, 0.7237, 2.553, 0.4009, 0.6282),
        (1.0 / 6.0, 0.6976, 3.907, 0.4677, 0.7182),
        (1.0 / 8.0, 0.6863, 5.255, 0.5019, 0.7641),
    ],
)
def test_the_rotor_of_betz(
    turbine: Turbine, advance: float, w: float, ratio: float, power: float, thrust: float
) -> None:
    """Power and thrust coefficient of the best rotor of three blades (Okulov & Sorensen 2008), by Kutta and Joukowski.

    Its wake moves with half of w, the speed of the wake over the wind; ``ratio`` is tip speed over wind.
    """
    R, nodes, step = 60.0, 20, np.radians(10.0)
    case, speed = by_hand(turbine, nodes=nodes), ratio * WIND / R
    turn(case, WIND * (1.0 - 0.5 * w), speed)
    j = np.linspace(0.0, 1.0, nodes + 1)
    ends = R * np.maximum(0.5 * j + 0.5 * np.sin(0.5 * np.pi * j), 1e-7)
    place(case, radial(ends))
    r, width = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
    G = 2.0 * np.pi * advance * R * w * WIND / 3.0 * goldstein(r / R, advance)
    u = settle(case, np.tile(G, (3, 1)), step / speed)[:, 0]  # of the blade along y
    area = 0.5 * np.pi * R**2
    assert 3.0 * (G * speed * r * (WIND + u[0]) * width).sum() / (area * WIND**3) == pytest.approx(power, rel=0.004)
    assert 3.0 * (G * (speed * r - u[2]) * width).sum() / (area * WIND**2) == pytest.approx(thrust, rel=0.004)


def test_zones_join(turbine: Turbine) -> None:
    """A developed wake has no gap and no row twice: the last row of a zone is where the next one begins."""
    case = wing(turbine, 0.5 * SPAN * spaced(20))
    settle(case, [np.ones(20), np.zeros(20), np.zeros(20)], 0.6)
    for zone, following in ((1, 2), (2, 3)):
        assert rows_of(case, zone)["position"][0, 0, -1].max() == pytest.approx(
            rows_of(case, following)["position"][0, 0, 0].max(), rel=1e-9
        )


# conservation ---------------------------------------------------------------------------------------------------------


def shed(case: Case, circulations: Float, way: float) -> None:
    """Rows that leave the first blade with these circulations, each with ``way`` [m] of wind after it."""
    bound = case.view("bound")
    for G in circulations:
        bound["circulation"][0] = G
        shed_row(case.system)
        merge_rows(case.system)
        for zone in (1, 2, 3):
            case.view(f"wake_{zone}")["position"][0] += way


def test_vortices_end_nowhere(turbine: Turbine) -> None:
    """Helmholtz: with any history of lift, what flows into the end of a filament leaves it; not at the oldest row."""
    case = wing(turbine, 0.5 * SPAN * spaced(8), shed=0.0)
    history = np.random.default_rng(1).uniform(-1.0, 2.0, (6, 8))
    shed(case, history, 6.0)
    case.view("bound")["circulation"][0] = history[0] - 1.0  # has changed since
    flux: dict[tuple[float, ...], float] = {}
    s = stored(case)
    s = s[:, np.abs(s[2]) < 1.0]  # of the wing
    for column in s.T:
        for point, sign in ((column[:3], -1.0), (column[:3] + column[3:6], 1.0)):
            key = tuple(np.round(point, 6) + 0.0)
            flux[key] = flux.get(key, 0.0) + sign * 4.0 * np.pi * column[6]
    oldest = max(x for x, _, _ in flux)
    inside = [value for (x, _, _), value in flux.items() if x < oldest]
    assert len(inside) > 50
    np.testing.assert_allclose(inside, 0.0, atol=1e-12)
    spanwise = s[:, np.abs(s[4]) > 1e-6]  # Kelvin: their sum is the vortex of the start, which the oldest row is
    element = np.searchsorted(case.view("lifting_line")["inner_end"][1, 0], spanwise[1] + 0.5 * spanwise[4]) - 1
    total = np.bincount(element, 4.0 * np.pi * spanwise[6] * np.sign(spanwise[4]))
    np.testing.assert_allclose(total, history[1], atol=1e-12)


def test_shed_rows_keep_their_circulation(turbine: Turbine) -> None:
    """A step of the wake changes no panel: each keeps what the blade had when it left, and the trailed sum is zero."""
    case = wing(turbine, 0.5 * SPAN * spaced(8))
    history = np.random.default_rng(2).uniform(-1.0, 2.0, (5, 8))
    shed(case, history, 6.0)
    panels = rows_of(case, 1)["circulation"][0]
    np.testing.assert_array_equal(panels[:, :-1], history[::-1])
    np.testing.assert_array_equal(panels[:, -1], 0.0)
    s = stored(case)
    trailed = s[:, (np.abs(s[3]) > 1e-6) & (np.abs(s[2]) < 1.0)]
    for x in np.unique(np.round(trailed[0] + 0.5 * trailed[3], 6)):
        assert abs(trailed[6][np.abs(trailed[0] + 0.5 * trailed[3] - x) < 1e-5].sum()) < 1e-13


@pytest.mark.parametrize("zones", [(1, 2), (2, 3)])
def test_merged_rows_keep_circulation_and_impulse(turbine: Turbine, zones: tuple[int, int]) -> None:
    """Panels of one sign: sum of the trailed vortices of a side, and their first moment."""
    case = wing(turbine, 0.5 * SPAN * spaced(20))
    upper, lower = (case.view(f"wake_{zone}") for zone in zones)
    edges = upper["position"].shape[-1]
    y = np.sort(np.random.default_rng(3).uniform(-60.0, 60.0, edges))
    G = np.append(np.sqrt(1.0 - ((y[1:] + y[:-1]) / 130.0) ** 2) * 50.0, 0.0)
    upper["position"][1], upper["circulation"][:] = y, G
    upper["circulation"][:, 4:] *= 1.0 + 0.1 * np.arange(upper["circulation"].shape[1] - 4)[:, None]
    first, count = 3, 4
    merge(getattr(case.system, f"wake_{zones[0]}"), getattr(case.system, f"wake_{zones[1]}"), first, count)
    mean = upper["circulation"][0, first : first + count].mean(axis=0)
    merged = lower["circulation"][0, 0]

    def trailed(panels: Float) -> Float:
        return -np.diff(panels, prepend=0.0)

    assert merged[-1] == 0.0
    assert abs(trailed(merged).sum()) < 1e-12
    assert merged.max() == pytest.approx(mean.max(), rel=1e-12)  # of each side
    moment = (trailed(mean) * y).sum()
    assert (trailed(merged) * lower["position"][1, 0, 0]).sum() == pytest.approx(moment, rel=1e-4)
    assert np.all(np.diff(lower["position"][1, 0, 0]) > 0.0)


# motion ---------------------------------------------------------------------------------------------------------------


def orbit(turbine: Turbine, steps: int) -> float:
    """[rad] turn of two long vortices about each other after 40 s."""
    case = by_hand(turbine, "free", nodes=5, core="none", lattice=1.0, shed=20.0, wind="mean")
    turn(case, 0.0, 0.0)
    away = 1e3 * np.arange(1.0, 7.0)
    place(case, np.stack(np.broadcast_arrays(-2e3, away, 1e4 + np.zeros((3, 1))), axis=2))
    wake, rows = case.view("wake_1"), 31
    x = 100.0 * (np.arange(rows) - 15.0)
    wake["position"][0, :, :rows] = x[:, None]
    wake["position"][1], wake["position"][2] = away, 1e4
    for b, y in ((0, 5.0), (1, -5.0)):
        wake["position"][:, b, :rows, 0] = np.stack([x, np.full(rows, y), np.zeros(rows)])
        wake["circulation"][b, :rows, 0] = -10.0
    state = case.view("vortex_state")
    state["rows_1"], state["step"] = rows, 0.0
    convect(case.system)  # velocities of the begin
    state["step"] = TIME / steps
    for _ in range(steps):
        convect(case.system)
    _, y, z = wake["position"][:, 0, 15, 0]
    return float(np.arctan2(z, y))


def test_motion_is_of_second_order(turbine: Turbine) -> None:
    """Two vortices of one sign: they turn with the circulation over pi times the square of their distance."""
    exact = 10.0 / (np.pi * 10.0**2) * TIME
    errors = np.array([orbit(turbine, steps) for steps in (3, 6, 12)]) - exact
    assert abs(errors[-1]) < 0.01 * exact
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.5)


# start of lift --------------------------------------------------------------------------------------------------------


def started(turbine: Turbine, row: float, **vortices: Any) -> Float:
    """(n, 2) semichords of way, and lift over its final value, of a long wing of chord 1 m at a sudden angle.

    Args:
      row: semichords of way between rows.
    """
    n = 11
    case = wing(turbine, np.linspace(-5e3, 5e3, n + 1), lattice=10.0, free=10.0, **vortices)
    View(AeroNode, case["node_constants"])["chord"] = 1.0
    case.view("lifting_line")["along"][0] = 1.0
    m, bound, own = case.system, case.view("bound"), case.view("bound_influence")
    G, result = np.zeros(n), []
    shed(case, [G], 0.5 * row)  # behind the vortex of the start
    for k in range(round(16.0 / row) + 1):
        shed(case, [G], 0.5 * row)
        at_blades(m, STILL, 0.5 * row, 1.0)
        wake, A = bound["after"][2, 0], own["after"][2, 0]
        G = np.linalg.solve(np.eye(n) - np.pi * A, np.pi * (1.0 + wake))
        result.append((k * row, G[n // 2] / np.pi))
    return np.array(result)


def test_the_start_of_lift(turbine: Turbine) -> None:
    """Shed vorticity delays it as Wagner computed, but less: points on the bound vortex see too little of the nearest.

    Therefore the dynamic stall model has the young shed vorticity by default: with it the wake itself delays nothing at
    the start.
    """
    lag, late = {}, started(turbine, 1.0, shed=2.0)
    for row in (1.0, 4.0):
        s, lift = started(turbine, row, shed=0.0).T
        wagner = 1.0 - 0.165 * np.exp(-0.0455 * s) - 0.335 * np.exp(-0.3 * s)
        assert np.all(np.diff(lift) > 0.0)
        assert lift[-1] == pytest.approx(1.0, abs=0.07)
        lag[row] = np.interp(4.0, s, 1.0 - lift) / np.interp(4.0, s, 1.0 - wagner)
    assert lag[1.0] == pytest.approx(0.606, abs=0.01)
    assert lag[4.0] == pytest.approx(0.416, abs=0.01)
    np.testing.assert_allclose(late[:, 1], 1.0, atol=1e-3)


# options --------------------------------------------------------------------------------------------------------------


def turning(turbine: Turbine, wake: str = "hybrid", **vortices: Any) -> tuple[Case, float]:
    """A rotor of constant circulation with its wake, and the mean induced velocity [m/s] in the middle of a blade."""
    case = by_hand(turbine, wake, nodes=10, **vortices)
    turn(case, WIND, 1.0)
    place(case, radial(np.linspace(2.0, 60.0, 11)))
    step = vortices.get("azimuth_step", np.radians(10.0))
    return case, float(settle(case, np.full((3, 10), 40.0), step)[0, :, 4:7].mean())


def test_sizes_of_the_zones(turbine: Turbine) -> None:
    """Shorter steps and later ages make more panels."""

    def sizes(**vortices: Any) -> tuple[float, float, float]:
        state = turning(turbine, **vortices)[0].view("vortex_state")
        return tuple(float(state[f"rows_{zone}"]) - 1.0 for zone in (1, 2, 3))  # type: ignore[return-value]

    assert sizes() == (18, 42, 96)
    assert sizes(azimuth_step=np.radians(5.0)) == (36, 42, 96)
    assert sizes(lattice=1.0) == (36, 36, 96)
    assert sizes(free=6.0) == (18, 66, 84)
    assert sizes(length=30.0) == (18, 42, 156)


def test_the_velocity_in_a_vortex_cylinder(turbine: Turbine) -> None:
    """Half of that far behind, with a wake of any length, which a cylinder closes; finer rows change little."""
    exact = -3.0 * 40.0 / (2.0 * 2.0 * np.pi * WIND)
    short, usual, long = (turning(turbine, length=length)[1] for length in (4.0, 20.0, 40.0))
    assert short != usual
    assert short == pytest.approx(long, rel=0.015)
    assert usual == pytest.approx(long, rel=0.001)
    assert long == pytest.approx(exact, rel=0.01)
    for vortices in ({"azimuth_step": np.radians(5.0)}, {"lattice": 1.0}, {"free": 8.0}):
        changed = turning(turbine, **vortices)[1]
        assert changed != usual
        assert changed == pytest.approx(usual, rel=0.01)


def test_cores(turbine: Turbine) -> None:
    """Each kind is another; larger ones and viscosity slow the wind less near the vortices; cores grow with age."""

    def spread(**vortices: Any) -> float:
        case, _ = turning(turbine, **vortices)
        return float(np.abs(case.view("bound")["after"]).max())

    kinds = [spread(core=core, blade_core=3.0) for core in CORES]
    assert len(set(kinds)) == len(CORES)
    assert kinds[CORES.index("none")] == max(kinds)
    assert spread(blade_core=4.0) < spread(blade_core=1.0)
    rigid, grown = (stored(turning(turbine, eddy_viscosity=each)[0], 0.5, 0.1) for each in (0.0, 1000.0))
    length2 = (rigid[3:6] ** 2).sum(axis=0)
    growth = (np.sqrt(grown[7]) - np.sqrt(rigid[7])) / length2 / (4.0 * 1.25643 * 1000.0 * 1.464e-5)  # [s] age
    assert growth[0] == pytest.approx(0.1 + 0.5 * np.radians(10.0), rel=1e-9)
    assert growth.max() > 0.9 * 20.0 * 2.0 * np.pi  # the oldest


def test_the_core_of_the_wake_slows_its_own_motion(turbine: Turbine) -> None:
    def fastest(wake_core: float) -> float:
        case, _ = turning(turbine, "free", wake_core=wake_core)
        convect(case.system)
        return float(np.linalg.norm(rows_of(case, 1)["velocity"], axis=0).max())

    assert fastest(3.0) < 0.9 * fastest(0.3)


def test_the_ground_mirrors_the_wake(turbine: Turbine) -> None:
    """No velocity through the plane z = 0; without it there is."""
    through = {}
    for ground in (False, True):
        case = by_hand(turbine, nodes=5, ground=ground)
        turn(case, WIND, 1.0)
        case.view("machine")["hub_position"] = HUB
        place(case, radial(np.linspace(2.0, 60.0, 6)) + HUB)
        settle(case, np.full((3, 5), 40.0), np.radians(10.0))
        s = stored(case)
        through[ground] = abs(velocity([20.0, 10.0, 0.0], s, core=0)[2])
    assert through[False] > 0.05
    assert through[True] < 1e-12


def test_the_wind_that_moves_the_wake(turbine: Turbine) -> None:
    """Local wind in shear is faster above than below, the mean is not; a free wake also shears by itself."""

    def above_less_below(wind: str) -> float:
        case = by_hand(turbine, nodes=5, wind=wind, field=SteadyWind(speed=10.0, shear_exponent=0.3))
        turn(case, WIND, 1.0)
        case.view("machine")["hub_position"] = HUB
        place(case, radial(np.linspace(2.0, 60.0, 6)) + HUB)
        settle(case, np.full((3, 5), 1e-3), np.radians(10.0))
        convect(case.system)
        rows = rows_of(case, 1)
        v, z = rows["velocity"][0, :, 0, -1], rows["position"][2, :, 0, -1]
        return float(v[z.argmax()] - v[z.argmin()])

    assert above_less_below("local") > 1.0
    assert abs(above_less_below("mean")) < 1e-3


def test_a_moored_turbine_can_have_a_vortex_wake() -> None:
    """The arrays of mooring lines and lifting lines do not share a name."""
    floater = build(load_turbine("iea15mw-volturnus"), ModelOptions(wake="hybrid"))
    case = Case(floater, SteadyWind(speed=9.0))
    assert case["line"].shape[-1] == 3  # mooring lines
    assert case["lifting_line"].shape[-1] == floater.options.blade_nodes
