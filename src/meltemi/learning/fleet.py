"""Turbines of learning environments: models, winds, episodes, and their steps in compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import EntryPoint, by_address, is_compiled, typeof, types
from meltemi.control.controller import UPDATE, Controller, StartPoint, compiled_entry
from meltemi.controllers.schemes import fitted, make_controller
from meltemi.controllers.specification import specification, uses_flaps
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.series import TimeSeries
from meltemi.environment.grid import PowerGrid
from meltemi.iec.winds import ntm
from meltemi.learning.kernels import (
    AGENT,
    COMMANDS,
    TERMS,
    WORDS,
    AgentState,
    CounterState,
    EpisodeState,
    Slot,
    compiled,
    update,
)
from meltemi.learning.sensors import load_scale, sensors_of
from meltemi.learning.settings import MODELS, TASKS, EnvironmentSettings, Weights
from meltemi.postprocess.counting import DEPTH
from meltemi.postprocess.fatigue import usual_slope
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build, default_step, operating_point
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid, wind_grid_for
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]
OUTPUT_STEP = 0.05
"""[s] longest interval between the rows of loads that the reward reads."""
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
RESET_OPTIONS = ("wind_speed", "turbulence_seed", "begin", "azimuth", "misalignment")


@lru_cache(maxsize=64)
def field(wind: TurbulentWind, grid: WindGrid, duration: float) -> WindBox:
    """The field of a turbulent wind, shared by all environments of the process."""
    return generate_field(wind, grid, duration)


@lru_cache(maxsize=8)
def library_model(turbine: str, options: ModelOptions) -> Model[Any]:
    """The model of a turbine of the library, shared by all environments of the process."""
    return build(load_turbine(turbine), options)


@lru_cache(maxsize=256)
def _library_point(turbine: str, options: ModelOptions, speed: float) -> OperatingPoint:
    return operating_point(library_model(turbine, options), speed)


class TaskSetup:
    """Common data of all episodes of an environment.

    Args:
      task: name of the task, see ``TASKS``.
      settings: settings of the environment.

    Raises:
      InputError: a sensor or channel is unknown, or the turbine does not suit the task.
    """

    def __init__(self, task: str, settings: EnvironmentSettings) -> None:
        self.task, self.settings = task, settings
        options = settings.model if isinstance(settings.model, ModelOptions) else MODELS[settings.model]
        if task == "Yaw":
            options = options.replace(yaw="driven")
        self.options = options
        given, law = settings.turbine, specification(settings.controller)
        if not isinstance(given, str) or uses_flaps(law):
            given = fitted(load_turbine(given) if isinstance(given, str) else given, law)
        self.model = library_model(given, options) if isinstance(given, str) else build(given, options)
        self.given, self.below = given, make_controller(law, self.model)
        if not is_compiled(self.below.update) or self.below.sample_time is not None:
            raise InputError(
                f"controller {self.below.name}: the environments take controllers that are compiled (numba.njit) and "
                "called at every time step"
            )
        turbine: AnyTurbine = self.model.turbine
        self.turbine, self.dt = turbine, default_step(self.model)
        self.step, self.duration = settings.of(task, "step"), settings.of(task, "duration")
        self.substeps = self._steps("step", self.step)
        self.begin_steps, self.steps = self._steps("transient", settings.transient), round(self.duration / self.step)
        if self.steps < 1 or abs(self.steps * self.step - self.duration) > 1e-6 * self.duration:
            raise InputError(f"duration {self.duration:g} s is not a multiple of the step of {self.step:g} s")
        self.output_step = self.dt * max(math.floor(OUTPUT_STEP / self.dt + 1e-9), 1)
        known = sensors_of(turbine)
        self.sensor_names: tuple[str, ...] = settings.of(task, "sensors")
        for name in self.sensor_names:
            if name not in known:
                raise InputError(f"sensors: no sensor {name!r}: {did_you_mean(name, known)}")
        self.sensors = np.array([known[name] for name in self.sensor_names], dtype=np.float64)
        self.action_names = TASKS[task].actions[: turbine.n_blades if task == "IPC" else None]
        self.commands = self._commands()
        weights: Weights = settings.of(task, "weights")
        self.weights = np.array([getattr(weights, name) for name in TERMS], dtype=np.float64)
        self.points: dict[float, OperatingPoint] = {}
        self.grid = wind_grid_for(turbine, settings.wind_points)

    def _steps(self, name: str, seconds: float) -> int:
        n = round(seconds / self.dt)
        if abs(n * self.dt - seconds) > 1e-6 * max(seconds, self.dt) or (n < 1 and name == "step"):
            raise InputError(f"{name} {seconds:g} s is not a multiple of the time step of {self.dt:g} s of the model")
        return n

    def _commands(self) -> Float:
        """(5, 1 + actions) commands of actions: offset, gains."""
        s, control = self.settings, self.turbine.control
        low, high = control.pitch.minimum, control.pitch.maximum
        most = control.torque.maximum_torque
        absolute = s.action == "absolute"
        middle = {"pitch": 0.5 * (high + low), "torque": 0.5 * most, "yaw_rate": 0.0}
        half = {"pitch": 0.5 * (high - low), "torque": 0.5 * most} if absolute else {}
        half = {"pitch": s.pitch_range, "torque": s.torque_range * most} | half
        if self.turbine.yaw:
            half["yaw_rate"] = self.turbine.yaw.rate
        table = np.zeros((len(COMMANDS), 1 + len(self.action_names)))
        for j, action in enumerate(self.action_names):
            for k, command in enumerate(COMMANDS):
                if command.startswith(action):
                    kind = command.rstrip("_123")
                    table[k, 0] = middle[kind] if absolute else 0.0
                    table[k, 1 + j] = half[kind]
        return table

    @cached_property
    def shares(self) -> tuple[float, float]:
        """Weights of the underlying controller in the demands of pitch and torque."""
        absolute = self.settings.action == "absolute"
        has_gain = [bool(np.any(self.commands[rows, 1:])) for rows in (slice(0, 3), slice(3, 4))]
        return float(not (absolute and has_gain[0])), float(not (absolute and has_gain[1]))

    def point(self, speed: float) -> OperatingPoint:
        """Steady operation at a wind speed."""
        if isinstance(self.given, str):
            return _library_point(self.given, self.options, speed)
        if speed not in self.points:
            self.points[speed] = operating_point(self.model, speed)
        return self.points[speed]

    def wind_speed(self, seed: int) -> float:
        """Mean wind speed [m/s] of a turbulence seed: evenly distributed over the range by the golden ratio."""
        low, high = self.settings.wind_speeds
        return round(low + (high - low) * (seed * GOLDEN % 1.0), 2)

    def controller(self) -> Controller:
        """The controller through which the agent acts."""
        turbine = self.turbine

        below, control = self.below, turbine.control
        entry = EntryPoint(compiled_entry(below.update), UPDATE)

        def init(start: StartPoint) -> Float:
            x = np.concatenate([AgentState.zeros(), below.initial_state(start)])
            state = AgentState(x[:AGENT])
            state.wrapper, state.code = entry.wrapper, entry.code
            state.reference_speed = control.pitch.reference_speed
            state.maximum_torque, state.torque_rate = control.torque.maximum_torque, control.torque.rate_limit
            state.minimum_pitch, state.maximum_pitch = control.pitch.minimum, control.pitch.maximum
            state.pitch_rate, state.yaws = control.pitch.rate_limit, float(self.task == "Yaw")
            state.pitch_share = state.torque_share = 1.0
            state.leak, state.follows = self.settings.leak, float(self.task == "Power")
            state.efficiency = turbine.drivetrain.generator_efficiency
            state.last_torque = start.generator_torque
            for blade in range(turbine.n_blades):
                state.last_pitch[blade] = start.pitch
            return x

        return Controller(update=update, init=init, name="environment", yaws=self.task == "Yaw" or below.yaws)

    def reference(self, rng: np.random.Generator) -> PowerGrid | None:
        """Grid with the random power reference of an episode."""
        if self.task != "Power":
            return None
        s, end = self.settings, self.settings.transient + self.duration
        low, high = s.reference_range
        times = np.arange(0.0, end + s.reference_hold, s.reference_hold)
        levels = rng.uniform(low, high, len(times)) * self.turbine.rated_power
        return PowerGrid(power_reference=TimeSeries(time=np.repeat(times, 2)[1:], value=np.repeat(levels, 2)[:-1]))


class Episode:
    """One episode of one turbine.

    Args:
      setup: the environment.
      rng: random generator for quantities that the options do not set.
      options: ``wind_speed`` [m/s], ``turbulence_seed``, ``begin`` [s] within the turbulence, ``azimuth`` [rad],
        ``misalignment`` [rad].

    Raises:
      InputError: an option is unknown.
    """

    def __init__(self, setup: TaskSetup, rng: np.random.Generator, options: Mapping[str, Any]) -> None:
        s = setup.settings
        for name in options:
            if name not in RESET_OPTIONS:
                raise InputError(f"reset: no option {name!r}: {did_you_mean(name, RESET_OPTIONS)}")
        most = s.of(setup.task, "misalignment")
        random = {
            "turbulence_seed": s.seeds[rng.integers(len(s.seeds))],
            "begin": rng.uniform(0.0, s.wind_duration),
            "azimuth": rng.uniform(0.0, 2.0 * math.pi),
            "misalignment": rng.uniform(-most, most) if most else 0.0,
        } | dict(options)
        self.seed = int(random["turbulence_seed"])
        self.speed = float(random.get("wind_speed", setup.wind_speed(self.seed)))
        length = s.transient + setup.duration
        wind = ntm(self.speed, s.wind_class, seed=self.seed, points=s.wind_points, dt=s.wind_step)
        box = field(wind, setup.grid, length + s.wind_duration)
        passes = 1.5 * setup.grid.width / self.speed + 2.0
        planes = math.ceil((length + passes) / box.dt) + 1
        first = max(min(int(float(random["begin"]) / box.dt), len(box.velocity) - planes), 0)
        self.wind = replace(
            box,
            velocity=box.velocity[first : first + planes],
            direction=float(random["misalignment"]),
            source=wind.label,
        )
        self.start = replace(setup.point(self.speed), azimuth=float(random["azimuth"]))
        self.facts = {"wind_speed": self.speed, "turbulence_seed": self.seed, "begin": first * box.dt}
        self.run = Run(
            setup.model,
            self.wind,
            duration=length,
            controller=setup.controller(),
            channels=(*s.loads, *s.channels) or ("generator_power",),
            output_step=setup.output_step,
            start=self.start,
            grid=setup.reference(rng),
            transient=s.transient,
            sea=s.sea.replace(seed=self.seed) if s.sea is not None and hasattr(s.sea, "seed") else s.sea,
        )
        self.simulation = Simulation(self.run)
        self._fill(setup)

    def _fill(self, setup: TaskSetup) -> None:
        """Prepare the records of the compiled loop."""
        run, s, turbine = self.simulation, setup.settings, setup.turbine
        case, names = run.case, [channel.name for channel in run.channels]
        episode = EpisodeState.of(
            substeps=setup.substeps,
            last_step=1 + setup.begin_steps + setup.substeps * setup.steps,
            overspeed=s.overspeed * turbine.control.pitch.reference_speed,
            rated_power=turbine.rated_power,
            rated_speed=turbine.control.pitch.reference_speed,
            yaw_drive=(turbine.yaw.rate if turbine.yaw else 0.0) or 1.0,
            time_step=run.dt,
            output_step=run.output_step,
            counting=float(s.load_measure == "rainflow"),
        )
        counters = []
        for name, weight in s.loads.items():
            channel = run.channels[names.index(name)] if name in names else None
            slope = usual_slope(channel) if channel else None
            if channel is None or slope is None:
                raise InputError(f"loads: {name!r} is not the meltemi name of a load channel, see `meltemi channels`")
            if any(channel in each.channels for each in run.derived):
                raise InputError(
                    f"loads: {name!r} is computed after the time loop, and no reward; it may be in channels"
                )
            scale = load_scale(turbine, name)
            counter = CounterState.of(column=names.index(name), scale=scale, weight=weight)
            counter.cycles.slope = slope
            counters.append(counter.array)
        arrays = {
            "law": case.controller_state[:AGENT],
            "measured": case.measured,
            "clock": case.clock.array,
            "episode": episode.array,
            "output": run.loop.output,
            "counters": np.array(counters).reshape(len(counters), len(CounterState)),
            "points": np.zeros((len(counters), 2, DEPTH)),
            "sensors": setup.sensors,
            "commands": setup.commands,
            "ring": np.zeros((1 + s.delay, len(setup.sensors))),
            "weights": setup.weights,
        }
        self.slot, self.law = Slot("floats", arrays), AgentState(case.controller_state[:AGENT])
        self.counters = arrays["counters"]
        self.records = (*run.loop.records, self.slot)

    def result(self) -> Result:
        """Result up to now."""
        run = self.simulation
        run.derive(run.loop.output[: int(run.case.clock.row)])  # the fleet's loop does not
        return run.result()

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()


class Fleet:
    """Turbines that are advanced together; observations, rewards and their components are rows of arrays.

    Args:
      setup: common data of the episodes.
      n: number of turbines.
      threads: number of threads.
    """

    def __init__(self, setup: TaskSetup, n: int, threads: int = 1) -> None:
        self.setup, self.n = setup, n
        self.episodes: list[Episode] = [None] * n  # type: ignore[list-item]
        self.words = np.zeros((n, WORDS), dtype=np.int64)
        self.noise = np.zeros((n, len(setup.sensors)))
        self.observations = np.zeros((n, len(setup.sensors)), dtype=np.float32)
        self.rewards, self.terms = np.zeros(n), np.zeros((n, len(TERMS)))
        self.ended = np.zeros(n, dtype=np.int64)
        self.threads = min(threads, n)
        self.pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None
        self._functions: Any = None
        self._idle = np.zeros((n, len(setup.action_names)), dtype=np.float32)

    def begin(self, i: int, rng: np.random.Generator, options: Mapping[str, Any] | None = None) -> None:
        """Begin an episode of turbine ``i`` and fill its row of the observations."""
        setup = self.setup
        if self.episodes[i] is not None:
            self.episodes[i].close()
        episode = self.episodes[i] = Episode(setup, rng, options or {})
        if self._functions is None:
            run = episode.simulation
            functions = (run.loop.controller, *run.loop.physics)
            kinds = [typeof(each) for each in (*functions, *episode.records)]
            loop = by_address(run.loop.function, types.int64, *kinds[:-1])
            self._functions = compiled(loop.type, *kinds), loop, *functions
        self.words[i] = [record.address for record in episode.records]
        self._noise(i, rng)
        self._march(np.array([i]), self._idle, 1 + setup.begin_steps, True)
        episode.law.pitch_share, episode.law.torque_share = setup.shares

    def step(self, which: NDArray[np.int64], actions: NDArray[np.float32], rngs: list[np.random.Generator]) -> None:
        """Advance some of the turbines by one step of the environment under actions (n, actions).

        Raises:
          InputError: no episode is running, or the actions have another shape.
        """
        if any(episode is None for episode in self.episodes):
            raise InputError("step: no episode is running; begin one by reset()")
        if actions.shape != self._idle.shape:
            names = ", ".join(self.setup.action_names)
            shape = " x ".join(map(str, actions.shape))
            raise InputError(
                f"step: expected {self.n} x {len(self.setup.action_names)} actions ({names}), found {shape}"
            )
        if self.setup.settings.noise > 0.0:
            for i in which:
                self._noise(i, rngs[i])
        if self.pool is None:
            self._march(which, actions, 0, False)
        else:
            parts = np.array_split(which, self.threads)
            list(self.pool.map(lambda part: self._march(part, actions, 0, False), parts))

    def _noise(self, i: int, rng: np.random.Generator) -> None:
        if self.setup.settings.noise > 0.0:
            self.noise[i] = self.setup.settings.noise * rng.standard_normal(self.noise.shape[1])

    def _march(self, which: NDArray[np.int64], actions: NDArray[np.float32], steps: int, first: bool) -> None:
        if len(which):
            filled = (self.observations, self.rewards, self.terms, self.ended)
            step, *functions = self._functions
            records = self.episodes[which[0]].records
            step(self.words, which, actions, self.noise, steps, first, *filled, *functions, *records)

    def components(self, i: int) -> dict[str, float]:
        """Weighted components of the last reward of a turbine."""
        return {f"reward_{name}": float(x) for name, x in zip(TERMS, self.terms[i], strict=True)}

    def close(self) -> None:
        """Release the threads and the simulations."""
        if self.pool is not None:
            self.pool.shutdown()
        for episode in self.episodes:
            if episode is not None:
                episode.close()
