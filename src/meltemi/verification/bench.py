"""``meltemi bench``: compile time, run time and memory, part by part.

Everything that start-up could hide is measured in new processes: import, compilation into an empty cache,
start from a filled one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sin
from pathlib import Path
from typing import Any

from meltemi.compiler import Kind, njit, processor, statistics, versions
from meltemi.control.baseline import BaselineController
from meltemi.control.constant import ConstantController
from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, MeltemiError
from meltemi.core.extras import skipped
from meltemi.sea.irregular import IrregularSea
from meltemi.simulation.case import Case
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.plan import first_point
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march, simulate
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid
from meltemi.verification.env_bench import environment_rows
from meltemi.verification.env_bench import timed_environments as timed_environments
from meltemi.verification.measure import peak_memory
from meltemi.verification.steps import needs
from meltemi.verification.steps import timed_steps as timed_steps
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import TurbulentWind

CHANNELS = (
    "time wind_x azimuth rotor_speed generator_torque generator_power pitch_1 rotor_aero_thrust rotor_torque "
    "root_moment_out_of_plane_1 root_moment_out_of_plane_2 root_moment_out_of_plane_3 root_moment_in_plane_1 "
    "root_moment_in_plane_2 root_moment_in_plane_3 tip_out_of_plane_1 tip_in_plane_1 tower_top_fore_aft "
    "tower_top_side_side tower_base_moment_fore_aft tower_base_moment_side_side yaw_moment_x yaw_moment_y yaw_moment_z "
    "shaft_tilt_moment generator_speed"
).split()
"""25 channels beside the time."""
BATCH_CASES = 3
"""Cases a core in the timed batch."""
REPEATS = 3
"""Timed runs of each kind, of which the fastest counts: what else runs on a machine only adds time."""
VARIANTS: dict[str, dict[str, Any]] = {
    "one torsion mode a blade": {},
    "second-order blades": {"blade_model": "modal"},
    "torsion locked": {"locked": ("torsion",)},
    "no torsion modes": {"torsion_modes": 0},
    "static polars, quasi-steady wake": {"stall": "static", "inflow": "quasi_steady"},
    "40 nodes a blade": {"blade_nodes": 40},
}
"""Options of the timed runs."""
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
OPENFAST = (
    ("as shipped, DT 0.00625 s", 4.0),
    ("as shipped, DT 0.0125 s", 6.6),
    ("dynamic inflow and dynamic stall, DT 0.01 s", 7.2),
    ("quasi-steady wake and static polars, DT 0.01 s", 8.2),
)
"""OpenFAST 5.0.0, the same turbine and controller: settings and times real time, by CPU time on one core."""
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
TURBSIM = "277 to 640 s for 31 x 31 points, u coherent"
"""TurbSim's time for such a field, by CPU time on one core; about a fifth of it if built with flush-to-zero."""


def benchmark(*, duration: float = 600.0, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Measure on this machine: on one core, and a batch on all.

    Args:
      duration: [s] of the timed runs.
      say: called with what is going on.

    Raises:
      InputError: ``duration`` is not positive.

    Returns:
      ``machine`` (processor, versions, date), ``import_s``, ``stages`` (compilation: seconds and signatures by stage),
      ``cold_compile_s``, ``signatures``, ``beyond`` (what compiles on first use), ``cached_start_s``, ``runs``
      (microseconds a step, real-time factor and step of each variant, and with load control), ``floats`` and
      ``derivatives`` (the first variant one node at a time, and with eight derivatives), ``gradient`` (microseconds a
      step of the first variant, and of its adjoint), ``steps`` (of three turbines,
      see :mod:`meltemi.verification.steps`), ``controllers``, ``environments`` (see
      :mod:`meltemi.verification.env_bench`), ``fields`` (seconds and peak memory of making turbulence),
      ``peak_memory_mb`` (the wind field not counted), ``cores``,
      ``batch_cases``, ``batch_real_time_factor``, ``batch_loss`` (share lost against cores times one core),
      ``batch_peak_memory_mb`` (all counted), ``case``.
    """
    if not 0.0 < duration < float("inf"):
        raise InputError(f"bench: duration must be a positive number of seconds, found {duration!r}")
    for words in skipped(needs()).values():
        say(words)
    say("import ...")
    importing, empty = zip(*((_seconds("import meltemi"), _seconds("pass")) for _ in range(5)), strict=True)
    import_s = min(importing) - min(empty)
    with tempfile.TemporaryDirectory(prefix="meltemi-bench-") as folder:
        say("compilation into an empty cache ...")
        stages = _child(f"stages({2.0!r})", folder)
        say("start from the cache ...")
        cached_start_s = min(
            _seconds("from meltemi.verification.bench import stages; stages(2.0)", folder) for _ in range(2)
        )
        say("what compiles on first use ...")
        beyond = _child("beyond()", folder)
        say(f"runs of {duration:g} s ...")
        runs = _child(f"timed_runs({duration!r})", folder)
        say("time steps of three turbines ...")
        steps = _child(f"timed_steps({duration!r})", folder)
        say("controllers ...")
        controllers = _child(f"timed_controllers({min(duration, 120.0)!r})", folder)
        say("learning environments ...")
        environments = _child("timed_environments()", folder)
        say("turbulent fields ...")
        fields = {name: _child(f"timed_field({name!r})", folder) for name in FIELDS}
        say(f"a batch of runs of {duration:g} s on all cores ...")
        batch = _child(f"timed_batch({duration!r})", folder)
    return {
        "machine": machine(),
        "import_s": round(import_s, 3),
        "stages": stages,
        "cold_compile_s": round(sum(seconds for seconds, _ in stages.values()), 1),
        "signatures": sum(count for _, count in stages.values()),
        "beyond": beyond,
        "cached_start_s": round(cached_start_s, 2),
        **runs,
        "steps": steps,
        "controllers": controllers,
        "environments": environments,
        "fields": fields,
        **batch,
        "case": (
            "NREL 5 MW in turbulence (12 m/s), 2 flap + 1 edge + 1 torsion modes a blade, 4 tower modes, drivetrain "
            f"torsion, dynamic inflow and stall, 20 nodes a blade, {len(CHANNELS) - 1} channels at 20 Hz, baseline "
            "controller at every step"
        ),
    }


def machine() -> dict[str, str]:
    """Processor, versions and date."""
    import platform
    from datetime import UTC, datetime

    import numpy

    import meltemi

    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": (
            f"meltemi {meltemi.__version__}, Python {platform.python_version()}, Numba {versions()['numba']}, "
            f"llvmlite {versions()['llvmlite']}, NumPy {numpy.__version__}"
        ),
        "date": datetime.now(UTC).date().isoformat(),
    }


def _environment(folder: str | None) -> dict[str, str]:
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **one, **({"MELTEMI_CACHE_DIR": folder} if folder else {})}


def _run(code: str, folder: str | None) -> str:
    """Output of a new process."""
    done = subprocess.run([sys.executable, "-c", code], env=_environment(folder), capture_output=True, text=True)
    if done.returncode:
        raise MeltemiError(f"bench: {done.stderr.strip().splitlines()[-1] if done.stderr else 'a process failed'}")
    return done.stdout


def _seconds(code: str, folder: str | None = None) -> float:
    """Time of a whole process."""
    began = time.perf_counter()
    _run(code, folder)
    return time.perf_counter() - began


def _child(call: str, folder: str) -> dict[str, Any]:
    """Result of a call of this module in a new process."""
    result: dict[str, Any] = json.loads(
        _run(f"import json, meltemi.verification.bench as b; print(json.dumps(b.{call}))", folder)
    )
    return result


def stages(duration: float) -> dict[str, tuple[float, int]]:
    """A first run in stages: seconds each takes, and the number of signatures it compiles."""
    found: dict[str, tuple[float, int]] = {}
    model, wind = _model(), SteadyWind(speed=12.0)
    case = Case(model, wind)
    marks = [(time.perf_counter(), statistics()[0])]

    def mark(name: str) -> None:
        marks.append((time.perf_counter(), statistics()[0]))
        (t0, n0), (t1, n1) = marks[-2:]
        found[name] = (round(t1 - t0, 2), n1 - n0)

    case.evaluate(0.0)
    mark("evaluation of the coupled machine")
    case.loads(0.0)
    mark("section loads")
    start = operating_point(model, wind)
    mark("operating point")
    simulate(model, wind, duration=duration, start=start, channels=CHANNELS)
    mark("controller and time loop")
    _turbulence(duration)
    mark("turbulence")
    return found


def beyond() -> dict[str, float]:
    """[s] compile time of features that compile on first use, after a first run."""
    from meltemi.analyses.linear import linearise
    from meltemi.control_laws.load_control import LoadController
    from meltemi.gradients.sensitivity import sensitivity

    model, wind = _model(), SteadyWind(speed=12.0)
    simulate(model, wind, duration=1.0)
    found: dict[str, float] = {}

    def timed(name: str, work: Callable[[], Any]) -> None:
        began = time.perf_counter()
        work()
        found[name] = round(time.perf_counter() - began, 2)

    fast = Controller(njit(_individual_pitch), init=lambda start: [start.generator_torque, start.pitch])
    timed("a compiled controller of 30 lines", lambda: simulate(model, wind, duration=1.0, controller=fast))
    slow = Controller(_nothing)
    timed("the interface of controllers in plain Python", lambda: simulate(model, wind, duration=1.0, controller=slow))
    timed("load control", lambda: simulate(model, wind, duration=1.0, controller=LoadController(model.turbine)))
    point = operating_point(model, wind)
    timed("derivatives of an evaluation (linear models)", lambda: linearise(model, point, azimuth=0.0))
    timed("Mann's turbulence", lambda: _turbulence(1.0, spectrum="mann"))
    timed("derivatives of a run", lambda: sensitivity(Run(model, wind, duration=1.0), ["pitch_offset"]))
    return found


def _model(**options: Any) -> Any:
    return build(load_turbine("nrel5mw"), ModelOptions(**options))


def _turbulence(duration: float, **settings: Any) -> Any:
    return generate_field(TurbulentWind(speed=12.0, intensity=0.14, **settings), load_turbine("nrel5mw"), duration)


def _timed(
    model: Any,
    wind: Any,
    duration: float,
    *,
    numbers: Kind = "lanes",
    prepare: Callable[[Case], None] | None = None,
    **arguments: Any,
) -> dict[str, float]:
    """Time step of the fastest of several runs."""
    best = float("inf")
    for _ in range(REPEATS):
        described = Run(model, wind, duration=duration, channels=CHANNELS, **arguments)
        run = Simulation(described, numbers=numbers, prepare=prepare)
        march(run)
        run.result().raise_for_status()
        best = min(best, run.run_seconds)
    return {
        "us_per_step": round(1e6 * best * run.dt / duration, 2),
        "real_time_factor": round(duration / best),
        "time_step_s": run.dt,
    }


def timed_runs(duration: float) -> dict[str, Any]:
    """Time a step of each variant, and peak memory of the first."""
    from meltemi.gradients.sensitivity import directions, seed

    wind = _turbulence(duration)
    runs: dict[str, dict[str, float]] = {}
    for name, options in VARIANTS.items():
        runs[name] = _timed(_model(**options), wind, duration)
        if len(runs) == 1:
            peak = round((peak_memory() - wind.velocity.nbytes) / 1e6)
    runs[LOAD_CONTROL] = timed_load_control(wind, duration)
    runs |= timed_floaters(duration)
    model, short = _model(), min(duration, 120.0)
    controller, start = BaselineController(model.turbine), operating_point(model, wind)
    ways = directions(model, PARAMETERS, controller, first_point(model, wind, start), {})
    floats = _timed(model, wind, short, numbers="floats", start=start)
    duals = _timed(model, wind, short, numbers="duals", start=start, prepare=lambda case: seed(case, ways))
    gradients = timed_gradient(Run(model, wind, duration=short, channels=CHANNELS, start=start))
    return {"runs": runs, "floats": floats, "derivatives": duals, "gradient": gradients, "peak_memory_mb": peak}


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
    return _timed(build(turbine), wind, duration, controller=LoadController(turbine, settings))


def timed_floaters(duration: float) -> dict[str, dict[str, float]]:
    """Time a step of a floating turbine with each model of its lines."""
    turbine, sea = load_turbine("iea15mw-volturnus"), IrregularSea(height=3.0, period=9.0)
    wind = generate_field(TurbulentWind(speed=14.0, intensity=0.12), turbine, duration)
    return {
        name: _timed(build(turbine.replace(**{"platform.line_model": kind})), wind, duration, sea=sea)
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
    model, wind = _model(), _turbulence(duration)
    law = BaselineController(model.turbine)
    built_in = _timed(model, wind, duration)["us_per_step"]
    with_loads = _timed(model, wind, duration, controller=replace(law, uses_loads=True))["us_per_step"]
    update = law.update

    @njit
    def compiled(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        update(state, measurements, demands, dt)
        moment = measurements.out_of_plane_moment
        mean = (moment[0] + moment[1] + moment[2]) / 3.0
        for blade in range(3):
            demands.pitch[blade] += 4e-9 * (moment[blade] - mean)

    def us(controller: Controller) -> float:
        return float(_timed(model, wind, duration, controller=controller)["us_per_step"])

    eighty = _model(time_step=0.0125)
    individual = Controller(
        _individual_pitch, init=lambda start: [start.generator_torque, start.pitch], sample_time=0.0125
    )
    stepped = Simulation(Run(model, wind, duration=duration, controller=ConstantController(), channels=CHANNELS))
    stepped.reset()
    began, calls = time.perf_counter(), 2000
    for _ in range(calls):
        stepped.step()
    outside = (time.perf_counter() - began) / calls * 1e6
    return {
        "section loads at every step": round(with_loads - built_in, 2),
        "compiled": round(us(Controller(compiled, init=law.init)) - with_loads, 2),
        "empty, in plain Python": round(us(Controller(_nothing, uses_loads=False)) - us(ConstantController()), 2),
        "individual pitch in plain Python at 80 Hz, real-time factor": _timed(
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


def timed_batch(duration: float) -> dict[str, Any]:
    """Time a batch on all cores and on one core, generation of winds and preparation of cases included."""
    from meltemi.core.threads import available_cores
    from meltemi.loadcases.batch import completed, simulate_batch

    model = _model()

    def cases(seeds: range) -> list[Run]:
        winds = [TurbulentWind(speed=12.0, intensity=0.14, seed=seed) for seed in seeds]
        return [Run(model, wind, duration=duration, channels=CHANNELS) for wind in winds]

    def factor(some: list[Run], workers: int) -> float:
        began = time.perf_counter()
        outcomes = simulate_batch(some, workers=workers, reduce=lambda result: result.raise_for_status().status)
        seconds = time.perf_counter() - began
        completed(outcomes)
        return len(some) * duration / seconds

    simulate(model, SteadyWind(speed=12.0), duration=1.0, channels=CHANNELS)
    cores = available_cores()
    one = factor(cases(range(BATCH_CASES)), 1)
    together = factor(cases(range(BATCH_CASES, BATCH_CASES * (cores + 1))), cores)
    return {
        "cores": cores,
        "batch_cases": BATCH_CASES * cores,
        "batch_real_time_factor": round(together, 1),
        "batch_loss": round(1.0 - together / (cores * one), 3),
        "batch_peak_memory_mb": round(peak_memory() / 1e6),
    }


def report_lines(figures: dict[str, Any]) -> list[str]:
    """The figures for the terminal."""
    f = figures
    m = f["machine"]
    ratio = f["derivatives"]["us_per_step"] / f["floats"]["us_per_step"]

    def line(name: str, value: float, unit: str, note: str = "", digits: int = 1) -> str:
        return f"{name:52s} {value:9.{digits}f} {unit:3s} {note}".rstrip()

    lines = [f["case"], f"{m['processor']}, {m['cores']} cores, {m['system']}; {m['versions']}; {m['date']}"]
    lines += [line("import meltemi", f["import_s"], "s", digits=3)]
    lines += [line("cold compilation", f["cold_compile_s"], "s", f"{f['signatures']} signatures")]
    lines += [line(f"  {name}", seconds, "s", f"{n} signatures") for name, (seconds, n) in f["stages"].items()]
    lines += [line(f"on first use: {name}", seconds, "s") for name, seconds in f["beyond"].items()]
    lines += [line("start from the cache", f["cached_start_s"], "s", "a new process that simulates 2 s")]
    for name, run in f["runs"].items():
        note = f"{run['us_per_step']:.1f} us a step of {run['time_step_s']:g} s"
        lines.append(line(f"real-time factor, {name}", run["real_time_factor"], "", note, 0))
    for turbine, name, run in _step_rows(f):
        errors = f"deviations up to {100.0 * run['std']:.2f} % (std), {100.0 * run['load']:.2f} % (equivalent load)"
        note = f"{run['us_per_step']:.1f} us a step of {run['time_step_s']:.3g} s, {errors}"
        lines.append(line(f"{turbine}, {name}", run["real_time_factor"], "", note, 0))
    lines.append(line("one node at a time (floats)", f["floats"]["us_per_step"], "us", "a step"))
    lines.append(line("with eight derivatives (duals)", f["derivatives"]["us_per_step"], "us", f"{ratio:.2f} x floats"))
    run, *adjoints = f["gradient"].values()
    for what, value in zip(("the controller's parameters", "all parameters"), adjoints, strict=True):
        lines.append(line(f"adjoint, gradient by {what}", value, "us", f"a step, {value / run:.2f} runs"))
    for name, value in f["controllers"].items():
        factor = "factor" in name
        lines.append(line(f"controller: {name}", value, "" if factor else "us", "" if factor else "a call more"))
    for name, env in f["environments"].items():
        note = f"of 0.1 s on one core, {env['per_second_all']:.0f} on all"
        lines.append(line(f"environment steps a second, model {name}", env["per_second"], "", note, 0))
    for name, field in f["fields"].items():
        note = f"{FIELD_SECONDS:g} s at {1.0 / FIELD_STEP:g} Hz, {field['peak_memory_mb']} MB"
        lines.append(line(f"turbulence, {name}", field["seconds"], "s", note, 2))
    lines.append(line("peak memory", f["peak_memory_mb"], "MB", "without the wind field", 0))
    batch = f"{f['batch_cases']} cases with their winds on {f['cores']} cores"
    lines.append(line("real-time factor of a batch", f["batch_real_time_factor"], "", batch, 0))
    lines.append(line("lost by the batch", 100.0 * f["batch_loss"], "%", "against cores times one core"))
    lines.append(line("peak memory of the batch", f["batch_peak_memory_mb"], "MB", "with the winds", 0))
    return lines


def _step_rows(figures: dict[str, Any]) -> list[tuple[str, str, dict[str, float]]]:
    return [(turbine, name, run) for turbine, ways in figures["steps"].items() for name, run in ways.items()]


def page(figures: dict[str, Any]) -> str:
    """The benchmark page of the documentation."""
    f = figures
    one, eight = (f[name]["us_per_step"] for name in ("floats", "derivatives"))
    shown = {
        "runs": [
            f"| {name} | {run['time_step_s']:g} | {run['us_per_step']:.1f} | **{run['real_time_factor']:.0f}** |"
            for name, run in f["runs"].items()
        ],
        "steps": [
            f"| {turbine} | {name} | {1e3 * run['time_step_s']:.2f} | {run['us_per_step']:.1f} | "
            f"**{run['real_time_factor']:.0f}** | {100.0 * run['std']:.2f} | {100.0 * run['load']:.2f} |"
            for turbine, name, run in _step_rows(f)
        ],
        "openfast": [f"| {name} | {factor:g} |" for name, factor in OPENFAST],
        "fields": [
            f"| {name} | **{field['seconds']:.2f}** | {field['peak_memory_mb']} |"
            for name, field in f["fields"].items()
        ],
        "environments": environment_rows(f["environments"]),
        "stages": [f"| {name} | {seconds:.1f} | {n} |" for name, (seconds, n) in f["stages"].items()],
        "beyond": [f"| {name} | {seconds:.1f} |" for name, seconds in f["beyond"].items()],
    }
    return (
        (Path(__file__).parent / "bench_page.md")
        .read_text(encoding="utf-8")
        .format(
            **f | {key: "\n".join(lines) for key, lines in shown.items()},
            turbsim=TURBSIM,
            field=f"{FIELD_SECONDS:g} s at {1.0 / FIELD_STEP:g} Hz, 12 m/s",
            faster=one / f["runs"]["one torsion mode a blade"]["us_per_step"],
            duals_ratio=eight / one,
            adjoint_ratios=[each / f["gradient"]["run"] for each in f["gradient"].values()],
            lost=100.0 * f["batch_loss"],
        )
    )
