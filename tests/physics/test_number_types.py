"""One machine in floats, in lanes and in duals: the same numbers, and exact derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import ModelOptions, Stations, SteadyWind, Turbine
from meltemi.aero.tables import AeroMemory, AeroOptions, AeroParameters, BladeFlow
from meltemi.analyses import linear
from meltemi.compiler import Kind
from meltemi.simulation.case import Case
from meltemi.simulation.plan import model_channels
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation

pytestmark = pytest.mark.slow

Float = NDArray[np.float64]
LAST = 3.06


def turbulent(speed: float, intensity: float, duration: float) -> meltemi.WindBox:
    wind = meltemi.TurbulentWind(speed=speed, intensity=intensity)
    return meltemi.wind.generate_field(wind, meltemi.load_turbine("nrel5mw"), duration)


def series() -> meltemi.WindSeries:
    """Everything a series may have, changing."""
    columns = "speed direction vertical horizontal_shear exponent vertical_shear gust".split()
    values = ([10.0, 12.0], [0.2, 0.4], [0.5, 1.0], [0.1, -0.1], [0.1, 0.2], [0.05, 0.1], [0.0, 1.0])
    return meltemi.WindSeries(time=[0.0, 5.0], **dict(zip(columns, values, strict=True)))


WINDS: dict[str, Callable[[], Any]] = {
    "sheared, yawed": lambda: SteadyWind(speed=11.0, shear_exponent=0.2, direction=0.3, upflow=0.1, veer=1e-3),
    "logarithmic": lambda: SteadyWind(speed=18.0, roughness=0.03, direction=-0.2),
    "storm": lambda: SteadyWind(speed=40.0, direction=1.2),
    "still": lambda: SteadyWind(speed=0.0),
    "series": series,
    "box": lambda: turbulent(11.0, 0.18, 20.0),
}


def disturbed(turbine: Turbine, options: dict[str, Any], wind: Any, numbers: Kind) -> Case:
    """A deflected, moving machine after three steps of the states of the air, with all of its loads.

    Iterations of the momentum balance run to their end: where they stop early, rounding decides where.
    """
    model = meltemi.build(turbine, ModelOptions().replace(**{"advanced.induction_tolerance": 0.0} | options))
    case = Case(model, wind, Stations((10.0, 30.0), (40.0,)), numbers=numbers)
    rng = np.random.default_rng(5)
    n, generator = len(model.coordinates), model.coordinates.index("generator")
    case["q"][:], case["v"][:] = 0.1 * rng.standard_normal(n), 0.2 * rng.standard_normal(n)
    case["q"][generator], case["v"][generator] = 0.7, 1.25
    case["pitch"][:2] = 0.05 + 0.05 * rng.standard_normal(case["pitch"][:2].shape)
    case.view("drive")["generator_torque"] = 3e4
    dt = 0.02
    case.settle(LAST - 3 * dt)
    for step in (2, 1, 0):
        case["q"][:] += dt * case["v"]
        case["v"][:] += 0.05 * rng.standard_normal(n)
        case.evaluate(LAST - step * dt, dt)
    case.rates()
    case.loads(LAST)
    return case


CHANGES: dict[str, tuple[dict[str, Any], str]] = {
    **{wind: ({}, wind) for wind in WINDS},
    **{f"{n} nodes, {wind}": ({"blade_nodes": n}, wind) for n in (8, 25, 33) for wind in ("sheared, yawed", "box")},
    **{
        f"{name} {value}": ({name: value}, "sheared, yawed")
        for name, values in {
            "wake": ("none",),
            "tip_loss": (False,),
            "hub_loss": (False,),
            "axial_drag": (True,),
            "tangential_drag": (True,),
            "skew": ("none",),
            "inflow": ("constant", "quasi_steady"),
            "stall": ("static",),
            "advanced.stall_rotation": ("openfast", "none"),
            "advanced.chord_angle": ("openfast",),
            "rotational_augmentation": ("snel", "chaviaropoulos_hansen"),
            "tower_influence": ("lower_half", "powles", "eames", "none"),
            "tower_drag": (False,),
            "torsion_modes": (0, 2),
            "flap_modes": (0,),
            "locked": (("tower", "drivetrain"),),
            "advanced.induction_iterations": (2, 20),
            "advanced.induction_tolerance": (0.0, 1e-5),
        }.items()
        for value in values
    },
    # in the light load of strong wind: without the correction a heavy load may have no solution
    "high_induction none": ({"advanced.high_induction": "none"}, "logarithmic"),
    "positions": ({"blade_nodes": (0.0, 10.0, 20.0, 35.0, 50.0, 61.5)}, "sheared, yawed"),
    "quasi-steady, static": ({"inflow": "quasi_steady", "stall": "static", "wake": "none"}, "box"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_lanes_give_what_floats_give(turbine: Turbine, what: str) -> None:
    options, wind = CHANGES[what]
    agree(*(disturbed(turbine, options, WINDS[wind](), kind) for kind in ("floats", "lanes")))


def test_lanes_with_ice_on_one_blade(turbine: Turbine) -> None:
    iced = meltemi.turbine.with_ice(turbine, meltemi.turbine.Icing(blades=(2,)))
    clean, floats, lanes = (
        disturbed(machine, {}, WINDS["sheared, yawed"](), kind)
        for machine, kind in ((turbine, "floats"), (iced, "floats"), (iced, "lanes"))
    )
    agree(floats, lanes)
    drag = BladeFlow.index("drag")
    more = floats["flow"][drag] > 1.5 * clean["flow"][drag]
    assert more[1].any() and not more[[0, 2]].any()


def agree(floats: Case, lanes: Case) -> None:
    """All that was computed is the same but for rounding."""
    # differences of nearly equal numbers: the residual, and the solver's guess of its slope
    noise = {"flow": BladeFlow.index("residual"), "memory": AeroMemory.index("slope"), "rotor": -1}
    assert np.abs(lanes["flow"] - floats["flow"])[noise["flow"]].max() < 1e-7
    for name in (*floats.signals.views, *floats.aero_state.views, "d_inflow", "d_stall", "body", "core_mass"):
        one, two = floats[name].copy(), lanes[name].copy()
        assert one.shape == two.shape
        assert np.isfinite(one).all() and np.isfinite(two).all()
        if name in noise:
            one[noise[name]] = two[noise[name]] = 0.0
        for first, second in [(one, two), *zip(one, two, strict=True)]:
            # the whole array, and each of its rows, which have different units; found are 1e-12 and less but for the
            # coarse blade of "positions", where the momentum balance is nearly indifferent: 2e-12, rows 7e-12
            limit = 1e-11 if first is one else 1e-10
            size = np.max(np.abs(first), initial=0.0)
            assert np.max(np.abs(second - first), initial=0.0) <= limit * size + 1e-16 * np.abs(one).max(initial=0.0), (
                name
            )


def test_nodes_that_fill_lanes_have_no_weight(turbine: Turbine) -> None:
    """Whatever they hold, nothing is different."""
    cases = [disturbed(turbine, {"blade_nodes": 20}, WINDS["box"](), "lanes") for _ in range(2)]
    filled = list(cases[1].aero_state.views.values())
    assert all(array.shape[-1] == 24 for array in filled)
    for array in filled:
        array[..., 20:] *= 1.01
    for case in cases:
        case.evaluate(LAST + 0.02, 0.02)
        case.loads(LAST + 0.02)
    for name in cases[0].signals.views:
        if name not in ("rotor", "flow", "motion"):
            np.testing.assert_array_equal(cases[0][name], cases[1][name])


def compared(turbine: Turbine, speed: float, duration: float, options: dict[str, Any]) -> tuple[Float, Float]:
    """(time, channels) of floats, and of lanes, in turbulence; without those that are nothing but rounding."""
    model = meltemi.build(turbine, ModelOptions().replace(**options))
    wind = turbulent(speed, 0.16, duration)
    found = []
    for numbers in ("floats", "lanes"):
        run = Simulation(Run(model, wind, duration=duration, channels=["all"]), numbers=numbers)
        while not run.finished:
            run.advance(1000)
        result = run.result()
        assert result.status is meltemi.Status.OK
        keep = [name not in ("induction_residual", "azimuth") for name in result.names]
        angle = np.stack([np.cos(result["azimuth"]), np.sin(result["azimuth"])], axis=1)
        found.append(np.hstack([result.data[:, keep], angle]))
    return found[0], found[1]


def worst(one: Float, two: Float) -> float:
    """Largest difference, relative to each channel's largest entry; channels below 1e-4, such as the induction where
    the loss factor vanishes, are differences of numbers of the order of one, with their rounding."""
    size = np.maximum(np.abs(one).max(axis=0), 1e-4)
    return float(np.max(np.abs(two - one) / size))


@pytest.mark.long
@pytest.mark.parametrize("torsion", [0, 1])
@pytest.mark.parametrize("speed", [8.0, 18.0])
def test_a_minute_of_turbulence(turbine: Turbine, speed: float, torsion: int) -> None:
    assert worst(*compared(turbine, speed, 60.0, {"torsion_modes": torsion})) < 1e-10


@pytest.mark.long
@pytest.mark.parametrize("torsion", [0, 1])
@pytest.mark.parametrize("speed", [8.0, 11.0, 18.0])
def test_rounding_does_not_grow_in_ten_minutes(turbine: Turbine, speed: float, torsion: int) -> None:
    floats, lanes = compared(turbine, speed, 600.0, {"torsion_modes": torsion})
    assert worst(floats, lanes) < 1e-9
    deviation = floats.std(axis=0)
    largest = np.abs(floats).max(axis=0)
    rounded = np.where(largest > 1e-4, largest, 1.0)  # small ones are differences of numbers of the order of one
    moves = deviation > 1e-6 * rounded  # 1e-9 of less would be below the rounding
    np.testing.assert_allclose(lanes.std(axis=0)[moves], deviation[moves], rtol=1e-9)
    assert np.max(np.abs(lanes.mean(axis=0) - floats.mean(axis=0))[moves] / deviation[moves]) < 1e-9


# derivatives --------------------------------------------------------------------------------------------

EVERY_INPUT = (
    "generator_torque pitch pitch_1 wind_speed vertical_wind wind_direction horizontal_shear vertical_shear "
    "shear_exponent yaw yaw_rate"
).split()
STEPS = (1e-5, 1e-6)
"""Of the differences, in the unit of each state and input."""

SITUATIONS: dict[str, tuple[float, float, dict[str, Any]]] = {
    "9 m/s": (9.0, 0.3, {}),
    "14 m/s": (14.0, 1.1, {}),
    "20 m/s": (20.0, 2.0, {}),
    "variants": (16.0, 4.0, {"inflow": "constant", "advanced.stall_rotation": "openfast", "tower_influence": "none"}),
    "no wake": (12.0, 5.0, {"wake": "none", "advanced.stall_rotation": "none", "skew": "none"}),
    "static": (12.0, 5.0, {"stall": "static", "inflow": "quasi_steady", "torsion_modes": 0}),
    "gears": (11.0, 3.0, {"drivetrain": "multibody", "stall": "static", "torsion_modes": 0}),
}


class Difference:
    """Rates and outputs of a case of floats for small changes of states and inputs."""

    def __init__(self, model: meltemi.Model, point: meltemi.analysis.OperatingPoint, azimuth: float, rows: Any) -> None:
        self.case, self.rows = Case(model, point.wind, numbers="floats"), rows
        self.case["aero"][AeroParameters.index("induction_tolerance")] = 0.0
        self.case["aero_options"][AeroOptions.index("iterations")] = linear.ITERATIONS
        point.put(self.case, azimuth)
        self.begin = {name: array.copy() for name, array in self.case.arrays.items() if name != "box"}

    def __call__(self, column: linear.Variable, change: float) -> Float:
        """All rows with a change of one state or input."""
        for name, array in self.begin.items():
            self.case[name][...] = array
        for (name, i), weight in column.moves:
            self.case[name].reshape(-1)[i] += change * weight
        linear.evaluate_rates(self.case, True)
        signals = self.case.signals.vector
        return np.array(
            [signals[i] if a == "signals" else self.case[a].flat[i] for a, i in (r.shows for r in self.rows)]
        )


BY_HAND = ("9 m/s", "20 m/s")


@pytest.mark.long
@pytest.mark.parametrize(
    "what", [pytest.param(what, marks=pytest.mark.long) if what in BY_HAND else what for what in SITUATIONS]
)
def test_derivatives_are_those_of_differences(geared: Turbine, what: str) -> None:
    """Entry by entry, for all kinds of states, inputs and outputs.

    A derivative is that of the branch on which the state stands. Central differences straddle two branches where a
    corner lies within their step, and then give a mixture of both. There are two kinds of corners:

    * polars are linear between the rows of their table. Where a node's angle of attack is within the step of a
      row, the difference to one side, or one over a shorter step, is the derivative.
    * the attachment's state acts as min(max(x4, 0), 1). Where the flow is fully attached it stands exactly at 1:
      beyond, nothing changes, so that central differences are half of the derivative. Inside is where it can move,
      and there the derivative must be that of the difference to the inner side.
    """
    speed, azimuth, options = SITUATIONS[what]
    model = meltemi.build(geared.replace(**{"pitch_actuator.kind": "second_order"}), ModelOptions().replace(**options))
    point = meltemi.operating_point(model, SteadyWind(speed=speed, shear_exponent=0.14, direction=0.1))
    case = linear.linear_case(model, point)
    channels = model_channels(model)
    fixed = (("q", "generator"), ("summary", "time"))
    shown = [
        channel
        for name, channel in channels.items()
        # the residual is rounding, and so is its derivative
        if not (
            channel.wrap or channel.source[0] == "demands" or channel.source in fixed or name == "induction_residual"
        )
    ]
    x = linear._states(case, point, [azimuth], True)
    kinds = ("q blade", "v blade", "q tower", " inflow ", " stall ", " pitch rate", "yaw command", "gear mode")
    optional = {
        " inflow ": "none" in options.values() or "quasi_steady" in options.values(),
        " stall ": "stall" in options,
        "gear mode": options.get("drivetrain") != "multibody",
    }
    for kind in kinds:
        assert any(kind in s.name for s in x) or optional.get(kind), kind
    columns = (*x, *linear._inputs(case, point, EVERY_INPUT))
    rows = (*x, *linear._outputs(case, shown))
    point.put(case, azimuth)
    exact = linear.jacobian(case, columns, rows)
    at = Difference(model, point, azimuth, rows)
    middle = at(columns[0], 0.0)
    # and the rounding of differences
    limit = 1e-6 * np.abs(exact).max(axis=1) + 1e-9 * np.abs(middle) + 1e-15
    corners = 0
    for k, column in enumerate(columns):
        (array, i), _ = column.moves[0]
        inner = {1.0: -1, 0.0: 1}.get(case[array].flat[i]) if column.name.endswith("attachment") else None
        left = np.full(len(rows), np.inf)
        for h in STEPS:
            value = {s: at(column, s * h) for s in (-2, -1, 1, 2)}
            one_sided = {s: (4.0 * value[s] - 3.0 * middle - value[2 * s]) / (2.0 * s * h) for s in (-1, 1)}
            central = (value[1] - value[-1]) / (2.0 * h)
            valid = [one_sided[inner]] if inner else [central, *one_sided.values()]
            if h == STEPS[0] and not inner:
                corners += int((np.abs(central - exact[:, k]) > limit).sum())
            left = np.min([left, *(np.abs(found - exact[:, k]) for found in valid)], axis=0)
        bad = left > limit
        assert not bad.any(), (
            column.name,
            [(rows[r].name, float(left[r]), float(limit[r])) for r in np.flatnonzero(bad)],
        )
    assert corners < 3e-3 * exact.size
