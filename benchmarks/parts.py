"""Timed parts beyond those of ``meltemi bench``: derivatives, controllers, turbines at sea, fields."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sin
from typing import Any

from meltemi.compiler import njit
from meltemi.control.baseline import BaselineController
from meltemi.control.constant import ConstantController
from meltemi.control.controller import Controller
from meltemi.sea.irregular import IrregularSea
from meltemi.simulation.plan import first_point
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march, simulate
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid
from meltemi.verification.bench import CHANNELS, REPEATS, nrel5mw, peak_memory, timed, turbulence
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import TurbulentWind

LOAD_CONTROL = "one flap a blade, load control (CPFC)"
"""Name of the timed run with 1P feedback to pitch, 2P feedback to flaps, and feed-forward."""
FLOATERS = {f"iea15mw-volturnus at sea, {kind} lines": kind for kind in ("static", "dynamic")}
"""Timed runs of a floating turbine in turbulence and an irregular sea, by the model of its lines."""
PARAMETERS = (
    "controller.proportional_gain",
    "controller.integral_gain",
    "controller.filter_frequency",
    "pitch_offset",
    "actuators.pitch_offset_1",
    "aerodynamics.air_density",
    "structure.hub_mass",
    "structure.shaft_damping",
)
"""Of the timed run with derivatives."""
FIELDS: dict[str, tuple[int, dict[str, Any]]] = {
    "31 x 31, Kaimal, u coherent": (31, {}),
    "31 x 31, Kaimal, u, v, w coherent": (31, {"coherent": "all"}),
    "31 x 31, Mann": (31, {"spectrum": "mann"}),
    "61 x 61, Kaimal, u, v, w coherent": (61, {"coherent": "all"}),
    "61 x 61, Mann": (61, {"spectrum": "mann"}),
}
"""Turbulent fields that are timed: points across and up, and settings."""
FIELD_SECONDS, FIELD_STEP = 700.0, 0.05
"""[s] they last, and between planes."""


def beyond() -> dict[str, float]:
    """[s] compile time of features that compile on first use, after a first run."""
    from meltemi.analyses.linear import linearise
    from meltemi.control_laws.load_control import LoadController
    from meltemi.gradients.sensitivity import sensitivity

    model, wind = nrel5mw(), SteadyWind(speed=12.0)
    simulate(model, wind, duration=1.0)
    found: dict[str, float] = {}

    def measured(name: str, work: Callable[[], Any]) -> None:
        began = time.perf_counter()
        work()
        found[name] = round(time.perf_counter() - began, 2)

    fast = Controller(njit(_individual_pitch), init=lambda start: [start.generator_torque, start.pitch])
    measured("a compiled controller of 30 lines", lambda: simulate(model, wind, duration=1.0, controller=fast))
    slow = Controller(_nothing)
    measured(
        "the interface of controllers in plain Python", lambda: simulate(model, wind, duration=1.0, controller=slow)
    )
    measured("load control", lambda: simulate(model, wind, duration=1.0, controller=LoadController(model.turbine)))
    point = operating_point(model, wind)
    measured("derivatives of an evaluation (linear models)", lambda: linearise(model, point, azimuth=0.0))
    measured("Mann's turbulence", lambda: turbulence(1.0, spectrum="mann"))
    measured("derivatives of a run", lambda: sensitivity(Run(model, wind, duration=1.0), ["pitch_offset"]))
    return found


def timed_runs(duration: float) -> dict[str, Any]:
    """Time a step with load control and at sea."""
    return {LOAD_CONTROL: timed_load_control(turbulence(duration), duration), **timed_floaters(duration)}


def timed_derivatives(duration: float) -> dict[str, Any]:
    """Time a step one node at a time, with eight derivatives, and of the adjoint."""
    from meltemi.gradients.sensitivity import directions, seed

    model, wind = nrel5mw(), turbulence(duration)
    controller, start = BaselineController(model.turbine), operating_point(model, wind)
    ways = directions(model, PARAMETERS, controller, first_point(model, wind, start), {})
    return {
        "floats": timed(model, wind, duration, numbers="floats", start=start),
        "derivatives": timed(
            model, wind, duration, numbers="duals", start=start, prepare=lambda case: seed(case, ways)
        ),
        "gradient": timed_gradient(Run(model, wind, duration=duration, channels=CHANNELS, start=start)),
    }


def timed_gradient(run: Run) -> dict[str, float]:
    """Time step of a run, and of its adjoint by the controller's state and by tables too, measured in turn."""
    from meltemi.gradients.adjoint import gradient
    from meltemi.gradients.weights import std_weights

    load = "tower_base_moment_fore_aft"

    def objective(result: Any) -> tuple[float, dict[str, Any]]:
        value, weights = std_weights(result[load])
        return value, {load: weights}

    chosen = {"by_controller": PARAMETERS[:3], "by_all": PARAMETERS}
    least = dict.fromkeys(("run", *chosen), float("inf"))
    for _ in range(1 + REPEATS):  # the first compiles
        simulation = Simulation(run)
        march(simulation)
        least["run"] = min(least["run"], simulation.run_seconds)
        for name, parameters in chosen.items():
            least[name] = min(least[name], gradient(run, objective, parameters).seconds[1])
    return {name: round(1e6 * seconds / simulation.n_steps, 2) for name, seconds in least.items()}


def timed_load_control(wind: Any, duration: float) -> dict[str, float]:
    """Time a step of CPFC (docs/guide/controllers.md), with flaps that the other runs do not have."""
    from meltemi.control_laws.load_control import FeedForward, HarmonicLoop, LoadControl, LoadController
    from meltemi.turbine.flaps import with_flaps

    degree = radians(1.0)
    pitch = HarmonicLoop(harmonic=1, integral_gain=0.4 * degree / 1190e3, offset=30 * degree)
    flaps = HarmonicLoop(harmonic=2, integral_gain=-0.2 * degree / 160e3, offset=57 * degree, actuator="flap")
    turbine = with_flaps(load_turbine("nrel5mw"))
    settings = LoadControl(loops=(pitch, flaps), feedforward=FeedForward())
    return timed(build(turbine), wind, duration, controller=LoadController(turbine, settings))


def timed_floaters(duration: float) -> dict[str, dict[str, float]]:
    """Time a step of a floating turbine with each model of its lines."""
    turbine, sea = load_turbine("iea15mw-volturnus"), IrregularSea(height=3.0, period=9.0)
    wind = generate_field(TurbulentWind(speed=14.0, intensity=0.12), turbine, duration)
    return {
        name: timed(build(turbine.replace(**{"platform.line_model": kind})), wind, duration, sea=sea)
        for name, kind in FLOATERS.items()
    }


def timed_field(name: str) -> dict[str, float]:
    """Time to generate a turbulent field, the fastest of several, and peak memory of the process, field included."""
    points, settings = FIELDS[name]
    step = 151.2 / (points - 1)
    grid = WindGrid(points_y=points, points_z=points, dy=step, dz=step, bottom=14.4, hub_height=90.0)
    wind = TurbulentWind(speed=12.0, intensity=0.14, dt=FIELD_STEP, periodic=True, **settings)
    generate_field(wind, grid, 10.0)  # compiles
    best = float("inf")
    for _ in range(REPEATS):
        began = time.perf_counter()
        generate_field(wind, grid, FIELD_SECONDS)
        best = min(best, time.perf_counter() - began)
    return {"seconds": round(best, 2), "peak_memory_mb": round(peak_memory() / 1e6)}


def _nothing(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    """A controller that does nothing."""


def _individual_pitch(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    """Individual pitch of 30 lines: torque, PI on the speed, and proportional control of tilt and yaw moments."""
    speed = measurements.generator_speed
    rated, torque_rated, torque_rate = 122.91, 43093.55, 15000.0
    gain, integral_gain, halving = 0.0188, 0.0081, 0.11
    # torque, rate-limited
    wanted = torque_rated * rated / max(speed, 1.0) if speed >= rated else 2.33 * speed * speed
    wanted = min(wanted, 47402.91)
    step = torque_rate * dt
    state[0] += min(max(wanted - state[0], -step), step)
    demands.generator_torque = state[0]
    # collective pitch
    error = speed - rated
    schedule = 1.0 / (1.0 + state[1] / halving)
    state[1] += integral_gain * schedule * error * dt
    state[1] = min(max(state[1], 0.0), 1.5)
    collective = min(max(state[1] + gain * schedule * error, 0.0), 1.5)
    # individual pitch against the moments of once a revolution
    azimuth, tilt, yaw = measurements.azimuth, 0.0, 0.0
    for blade in range(3):
        angle = azimuth + 2.0943951023931953 * blade
        moment = measurements.out_of_plane_moment[blade]
        tilt += cos(angle) * moment
        yaw += sin(angle) * moment
    for blade in range(3):
        angle = azimuth + 2.0943951023931953 * blade
        pitch = collective + 2e-9 * (tilt * cos(angle) + yaw * sin(angle))
        demands.pitch[blade] = pitch


def timed_controllers(duration: float) -> dict[str, float]:
    """Time of controllers beyond the built-in one, and of a step called from Python."""
    model, wind = nrel5mw(), turbulence(duration)
    law = BaselineController(model.turbine)
    built_in = timed(model, wind, duration)["us_per_step"]
    with_loads = timed(model, wind, duration, controller=replace(law, uses_loads=True))["us_per_step"]
    update = law.update

    @njit
    def compiled(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        update(state, measurements, demands, dt)
        moment = measurements.out_of_plane_moment
        mean = (moment[0] + moment[1] + moment[2]) / 3.0
        for blade in range(3):
            demands.pitch[blade] += 4e-9 * (moment[blade] - mean)

    def us(controller: Controller) -> float:
        return float(timed(model, wind, duration, controller=controller)["us_per_step"])

    eighty = nrel5mw(time_step=0.0125)
    individual = Controller(
        _individual_pitch, init=lambda start: [start.generator_torque, start.pitch], sample_time=0.0125
    )
    stepped = Simulation(Run(model, wind, duration=duration, controller=ConstantController(), channels=CHANNELS))
    stepped.reset()
    began, calls = time.perf_counter(), min(2000, stepped.n_steps)
    for _ in range(calls):
        stepped.step()
    outside = (time.perf_counter() - began) / calls * 1e6
    return {
        "section loads at every step": round(with_loads - built_in, 2),
        "compiled": round(us(Controller(compiled, init=law.init)) - with_loads, 2),
        "empty, in plain Python": round(us(Controller(_nothing, uses_loads=False)) - us(ConstantController()), 2),
        "individual pitch in plain Python at 80 Hz, real-time factor": timed(
            eighty, wind, duration, controller=individual
        )["real_time_factor"],
        "step() from Python": round(outside - with_loads, 2),
        "step of an observer": round(_observer_step(model), 2),
    }


def _observer_step(model: Any) -> float:
    """[us] of a step of an observer in a compiled controller."""
    from meltemi.control_laws.kalman import kalman_step
    from meltemi.studies.observer import observer

    @njit
    def steps(count: int, memory: Any, inputs: Any, measured: Any) -> None:
        for _ in range(count):
            kalman_step(memory, inputs, measured)

    made = observer(build(model.turbine.replace(cut_in=12.0, cut_out=14.0), model.options))
    memory, inputs, measured = made.start(12.5).memory, made.inputs[0], made.outputs[0, :3]
    best = 1e9
    for _ in range(20):
        began = time.perf_counter()
        steps(1000, memory, inputs, measured)
        best = min(best, time.perf_counter() - began)
    return best * 1e3
