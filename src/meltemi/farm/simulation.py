"""``simulate_farm``: turbines run in parallel, and exchange their wakes every few seconds.

Reference: docs/theory/wakes.md (K-15).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.cases.case import case_run, case_turbine
from meltemi.compiler import View
from meltemi.control.actuators import Actuators
from meltemi.control.faults import Faults
from meltemi.control.signals import Measurements
from meltemi.core.errors import InputError, RunError
from meltemi.core.threads import available_cores
from meltemi.farm.layout import Farm, FarmCase, check_layout
from meltemi.farm.quick import quick
from meltemi.farm.rotor import RotorSums, sample
from meltemi.farm.scene import farm_scenes
from meltemi.farm.settings import WakeSettings
from meltemi.farm.wakes import LEAST_WIND, FarmWakes, RotorState
from meltemi.farm.wind import wind_and_positions
from meltemi.loadcases.batch import told_to_end
from meltemi.simulation import step
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint, steady_wind
from meltemi.simulation.plan import multiple, step_of
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.simulation.start import Start
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import AnyWind

Float = NDArray[np.float64]
SAMPLES = 8
"""Samples of each rotor between two exchanges."""
STEP = 2.0
"""[s] longest interval between exchanges by default."""
MOST_PITCH = 0.5
"""[rad] largest pitch offset of a set-point."""
LEVEL = 0.125
"""Step between the operating points with which wakes develop, over the mean wind."""
START = 0.02
"""Step between the operating points in which turbines start: few are computed for many turbines."""


class RotorReader:
    """Mean state of a rotor over samples."""

    def __init__(self, case: Case) -> None:
        self.case, self.sums = case, RotorSums.of()
        n = case["flow"].shape[-1] if "flow" in case.arrays else 25
        self.radius, self.load = np.zeros(n), np.zeros((2, n))

    def sample(self) -> None:
        """Add the present state."""
        quick(sample, self.sums, self.radius, self.load, self.case.plain)

    def state(self) -> RotorState:
        """The mean of the samples since the last call."""
        s, n = self.sums, max(self.sums.samples, 1.0)
        hub, shaft, wind = (np.array([v.x, v.y, v.z]) / n for v in (s.hub, s.shaft, s.wind))
        order = np.argsort(self.radius)
        density = float(self.case.plain.aero.air_density)
        state = RotorState(hub, shaft, wind, self.radius[order] / n, self.load[:, order] / n, density)
        for array in (s.array, self.radius, self.load):
            array[:] = 0.0
        return state


@dataclass(frozen=True)
class SetPoint:
    """Demands of a farm controller to a turbine until the next exchange.

    Attributes:
      yaw: [rad] yaw angle of the nacelle from the direction of the mean wind, counter-clockwise from above, which the
        yaw drive approaches at its rate; None for no change. The model needs ``ModelOptions(yaw="driven")``.
      power: [W] power limit, for controllers that follow it, such as the supervised one.
      pitch: [rad] offset of the pitch from the demand of the turbine controller, subject to the actuators.
    """

    yaw: float | None = None
    power: float = math.inf
    pitch: float = 0.0


FarmControl = Callable[[float, Sequence[View]], Sequence[SetPoint]]
"""Called at each exchange with the time [s] and the measurements of the turbines, whose ``yaw`` and
``wind_direction`` are from the direction of the mean wind; returns a set-point for each."""


Watch = Callable[[FarmWakes, float], None]
"""Called at each exchange with the wakes and the time [s]."""


class FarmTurbine:
    """Turbine of a running farm, with the samples of its rotor for its wake.

    ``direction`` [rad] is the mean wind direction, the reference of the angles of set-points and measurements.
    """

    def __init__(self, run: Run, direction: float) -> None:
        self.simulation, self.direction = Simulation(run), direction
        self.reader = RotorReader(self.simulation.case)
        self.yaw: float | None = None
        self._actuators = View(Actuators, self.simulation.case["actuators"])
        self.pitch_offset = np.array(self._actuators["pitch_offset"])

    def march(self, steps: int) -> None:
        """Advance a number of time steps, sampling the rotor in between."""
        run, done = self.simulation, 0
        for i in range(SAMPLES):
            until = steps * (i + 1) // SAMPLES
            if self.yaw is not None:
                turn = nacelle_yaw(self.yaw, self.direction) - float(run.case.view("drive")["yaw_command"])
                turn = math.remainder(turn, 2.0 * math.pi)
                run.case.view("demands")["yaw_rate"] = turn / (max(until - done, 1) * run.dt)
            run.advance(until - done)
            self.reader.sample()
            done = until

    def demand(self, point: SetPoint) -> None:
        """Follow a set-point from now on.

        Raises:
          InputError: the set-point is not finite, or the model has no yaw drive.
        """
        run = self.simulation
        if point.yaw is not None:
            if run.model.options.yaw != "driven":
                raise InputError(
                    "farm: a set-point of yaw needs turbines with a yaw drive: build them with "
                    f'ModelOptions(yaw="driven"), found {run.model.options.yaw!r}'
                )
            if not abs(point.yaw) <= math.pi:
                raise InputError(f"farm: a set-point of yaw must be within pi rad, found {point.yaw!r}")
        if not abs(point.pitch) <= MOST_PITCH:
            raise InputError(f"farm: a set-point of pitch must be within {MOST_PITCH} rad, found {point.pitch!r}")
        if not point.power >= 0.0:
            raise InputError(f"farm: a set-point of power must be 0 W or more, found {point.power!r}")
        self.yaw = point.yaw
        self._actuators["pitch_offset"] = self.pitch_offset + point.pitch
        run.case["faults"][Faults.index("power_limit")] = point.power
        run.case.clock.next_event = max(int(run.case.clock.next_event), 1)  # the controller receives the limit

    def measurements(self) -> View:
        """Present measurements of the sensors, also before the first call of the turbine controller."""
        run = self.simulation
        t = float(run.case.clock.step) * run.dt
        step.sense(t, int(run.case.clock.next_event), run.case.control, run.case.system)
        measured = View(Measurements, run.case.measured.copy())
        for name, sign in (("yaw", 1.0), ("wind_direction", -1.0)):
            measured[name] = math.remainder(measured[name] + sign * self.direction, 2.0 * math.pi)
        return measured


def nacelle_yaw(yaw: float, direction: float) -> float:
    """[rad] angle within half a turn of a nacelle at a yaw [rad] from a wind of a direction [rad] (K-25)."""
    return math.remainder(yaw - direction, 2.0 * math.pi)


def yawed_models(models: Sequence[Model[Any]], yaw: Float, direction: float) -> list[Model[Any]]:
    """Models with nacelles at yaw angles [rad] from a wind direction [rad]; equal models remain shared.

    Raises:
      InputError: a model already has a ``nacelle_yaw``.
    """
    if any(model.options.nacelle_yaw for model in models):
        raise InputError(
            "farm: options.nacelle_yaw: turbines of a farm face the wind; their angles from it are the farm's yaw"
        )
    by_yaw = {(id(model), 0.0): model for model in models}
    turned = []
    for model, angle in zip(models, yaw, strict=True):
        key = id(model), nacelle_yaw(float(angle), direction)
        if key not in by_yaw:
            by_yaw[key] = replace(model, options=model.options.replace(nacelle_yaw=key[1]))
        turned.append(by_yaw[key])
    return turned


def begin_at(given: Any, model: Model[Any]) -> OperatingPoint | Start | None:
    """The start of a run; an operating point at nacelle yaw 0 is rotated to the nacelle yaw of ``model``."""
    start: OperatingPoint | Start | None = given() if callable(given) else given
    if not (isinstance(start, OperatingPoint) and model.options.nacelle_yaw):
        return start
    row = np.zeros_like(start.revolution[0])
    row[model.coordinates.index("yaw")] = model.options.nacelle_yaw
    return replace(start, q=start.q + row[: len(start.q)], revolution=start.revolution + row)


@dataclass(frozen=True)
class WakeTrack:
    """Path of one wake over time.

    Attributes:
      time: (E,) [s] times of the exchanges.
      planes: for each exchange a (9, n) array: centre x, y, z, travelled path [m], velocity x, y, z [m/s],
        and deficit [m/s] and radius [m] of a top hat with the same integrals of deficit and squared deficit.
    """

    time: Float
    planes: list[NDArray[np.float32]] = field(repr=False)

    def centre(self, x: float) -> Float:
        """(E, 3) [m] centre of the wake after a travelled path ``x`` [m]; NaN where the wake ends before."""
        centre = np.full((len(self.time), 3), np.nan)
        for e, p in enumerate(self.planes):
            if p.shape[1] > 1 and x <= p[3, -1]:
                centre[e] = [np.interp(x, p[3], p[c]) for c in range(3)]
        return centre


@dataclass(frozen=True)
class FarmResult:
    """Results of the turbines of a farm, and paths of its wakes.

    ``result[1].data`` is the data of the second turbine, as from :func:`meltemi.simulate`.

    Attributes:
      turbines: result of each turbine.
      positions: (turbines, 2) [m] positions.
      yaw: (turbines,) [rad] yaw of the nacelles from the wind.
      diameters, hubs: [m] rotor diameters and hub heights.
      settings: settings of the wakes.
      wakes: path of each wake; empty without wakes.
      view: wind speed over the farm at the end, at the first hub's height: x, y [m] and (x, y) [m/s].
      facts: numbers of planes and exchanges, elapsed time [s].
      direction: [rad] mean wind direction, clockwise from above.
    """

    turbines: tuple[Result, ...]
    positions: Float
    yaw: Float
    diameters: tuple[float, ...]
    hubs: tuple[float, ...]
    settings: WakeSettings
    wakes: tuple[WakeTrack, ...] = ()
    view: tuple[Float, Float, Float] | None = field(default=None, repr=False)
    facts: dict[str, float] = field(default_factory=dict)
    direction: float = 0.0

    def __getitem__(self, i: int) -> Result:
        return self.turbines[i]

    def __len__(self) -> int:
        return len(self.turbines)

    def wake(self, i: int) -> WakeTrack:
        """The path of a turbine's wake.

        Raises:
          InputError: the run had no wakes.
        """
        if not self.wakes:
            raise InputError("the farm was simulated without wakes")
        return self.wakes[i]


def simulate_farm(  # noqa: PLR0913 - options of a simulation, each with a default
    farm: Farm,
    wind: float | AnyWind,
    *,
    duration: float,
    controllers: Any = None,
    start: Any = None,
    control: FarmControl | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Watch | None = None,
    **options: Any,
) -> FarmResult:
    """Simulate turbines in one wind and in each other's wakes.

    Args:
      farm: turbines, positions, wakes.
      wind: as for :func:`meltemi.simulate`; a turbulent wind becomes a field over the whole farm.
      duration: [s] simulated time.
      controllers: a controller for all turbines, or a list with one for each; by default the baseline controller.
      start: initial state for all turbines, or a list; by default steady operation in developed wakes.
      control: farm controller, called at each exchange with the time [s] and the turbines' measurements; it returns a
        :class:`SetPoint` for each.
      threads: number of threads; by default one per core.
      progress: callback with the completed fraction.
      watch: callback with the wakes and the time [s] at each exchange.
      options: further fields of :class:`meltemi.Run`, the same for all turbines: ``channels``, ``output_step``,
        ``transient``, ``events``, ``stations``, ``view``.

    Raises:
      InputError: turbines are too close, the wind field is too small, or an argument is not valid.
      RunError: the run of a turbine ended early; ``error.result`` is the result of that turbine.
    """
    runs = farm_runs(farm, wind, duration, controllers, start, **options)
    return march_farm(runs, farm.places(), farm.settings, farm.angles(), control, threads, progress, watch)


def farm_runs(farm: Farm, wind: Any, duration: float, controllers: Any, start: Any, **options: Any) -> list[Run]:
    """A run for each turbine of a farm; arguments as of :func:`simulate_farm`."""
    models = farm.models()
    control, begin = (_for_each(x, len(models), s) for x, s in ((controllers, "controllers"), (start, "start")))
    return [
        Run(model, wind, duration=duration, controller=control[i], start=begin[i], **options)
        for i, model in enumerate(models)
    ]


def simulate_case(case: FarmCase, folder: Path, progress: Callable[[float], None] | None = None) -> FarmResult:
    """Simulate the farm of a file; paths in it are relative to ``folder``. Errors as of :func:`simulate_farm`."""
    turbine = case_turbine(case, folder)
    model = build(turbine, case.options, case.environment)
    runs = [case_run(case, turbine, folder, model=model) for _ in case.positions]
    yaw = np.array(case.yaw or [0.0] * len(runs))
    return march_farm(runs, np.array(case.positions), case.wakes, yaw, progress=progress)


def _for_each(given: Any, n: int, what: str) -> list[Any]:
    if isinstance(given, list | tuple):
        if len(given) != n:
            raise InputError(f"farm: {what}: expected one for each of {n} turbines, found {len(given)}")
        return list(given)
    return [given] * n


def march_farm(
    runs: Sequence[Run],
    positions: Float,
    settings: WakeSettings,
    yaw: Float,
    control: FarmControl | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Watch | None = None,
) -> FarmResult:
    """Simulate a farm whose turbines are runs with one wind; arguments and errors as of :func:`simulate_farm`."""
    if threads is not None and not (isinstance(threads, int) and threads > 0):
        raise InputError(f"farm: threads: expected an integer of 1 or more, or None for all cores, found {threads!r}")
    march = FarmMarch(runs, positions, settings, yaw, threads or available_cores(), control, watch)
    march.to_end(progress)
    turbines = [turbine.simulation.model.turbine for turbine in march.turbines]
    diameters, hubs = tuple(t.rotor_diameter for t in turbines), tuple(t.hub_height for t in turbines)
    results = tuple(turbine.simulation.result() for turbine in march.turbines)
    for i, (run, result) in enumerate(zip(runs, results, strict=True)):
        if not (run.partial or result.status.complete):
            raise RunError(f"turbine {i + 1}: {result.message or result.status.message}", result)
    shift, facts = positions - march.places, march.facts()
    tracks, view = march.tracks(shift), march.view(shift)
    results = farm_scenes(results, positions, march.planes, facts.get("step", 1.0), max(diameters))
    places = [
        {"position": [float(x), float(y)], "yaw": float(angle), "diameter": diameter, "hub_height": hub}
        for (x, y), angle, diameter, hub in zip(positions, yaw, diameters, hubs, strict=True)
    ]
    shared = {"direction": march.mean.direction, "wakes": settings.model_dump(mode="json")}
    results = tuple(
        replace(each, meta={**each.meta, "farm": place | shared}) for each, place in zip(results, places, strict=True)
    )
    return FarmResult(results, positions, yaw, diameters, hubs, settings, tracks, view, facts, march.mean.direction)


class FarmMarch:
    """A farm in progress: its turbines, its wakes, and the exchanges between them.

    ``places`` are the positions (turbines, 2) [m] in the axes of the wind; arguments as of :func:`march_farm`. It has
    to be closed.
    """

    def __init__(
        self,
        runs: Sequence[Run],
        positions: Float,
        settings: WakeSettings,
        yaw: Float,
        threads: int,
        control: FarmControl | None = None,
        watch: Watch | None = None,
    ) -> None:
        self.threads, self.control, self.watch = threads, control, watch
        self.pool = ThreadPoolExecutor(threads) if threads > 1 else None
        models = [run.model() if callable(run.model) else run.model for run in runs]
        turbines = [model.turbine for model in models]
        check_layout(positions, [t.rotor_diameter for t in turbines], yaw)
        given = runs[0].wind() if callable(runs[0].wind) else runs[0].wind
        wind, places = wind_and_positions(given, turbines, positions, runs[0].duration)
        self.places = places
        self.mean = steady_wind(wind, turbines[0].hub_height)
        models = yawed_models(models, yaw, self.mean.direction)
        self.runs = runs = [
            replace(run, model=model, wind=wind, start=begin_at(run.start, model), origin=(float(x), float(y)))
            for run, model, (x, y) in zip(runs, models, places, strict=True)
        ]
        self.wakes: FarmWakes | None = None
        self.done = 0
        self.times, self.planes = list[float](), list[list[NDArray[np.float32]]]()
        step, self.steps = _exchange_step(runs, settings, self.mean.speed)
        if settings.model != "none":
            if self.mean.speed < LEAST_WIND:
                raise InputError(
                    f"farm: wakes need a mean wind of {LEAST_WIND:g} m/s or more, found {self.mean.speed:g} m/s: they "
                    'would not leave their rotors; give more wind, or the wakes "none"'
                )
            diameters, hubs = [t.rotor_diameter for t in turbines], [t.hub_height for t in turbines]
            self.wakes = FarmWakes(settings, wind, places, diameters, hubs, self.mean, step)
            starts = self._develop(self.wakes)
            parts = self.wakes.parts
            runs = [
                replace(run, other_wind=part, start=start) for run, part, start in zip(runs, parts, starts, strict=True)
            ]
        self.turbines = [FarmTurbine(run, self.mean.direction) for run in runs]

    def _develop(self, wakes: FarmWakes) -> list[OperatingPoint | Start]:
        """Let the wakes develop before the run, in its wind; return the initial states of the turbines."""
        given = [run.start for run in self.runs]
        known: dict[tuple[int, int, int], RotorState] = {}

        def start(i: int, share: float) -> tuple[SteadyWind, OperatingPoint | Start]:
            wind = self.mean.replace(speed=share * self.mean.speed)
            return wind, initial_state(self.runs[i].model, wind, given[i])[0]  # type: ignore[arg-type]

        def steady(i: int, level: int) -> RotorState:
            key = id(self.runs[i].model), id(given[i]), level
            if key not in known:
                known[key] = _steady_rotor(self.runs[i], *start(i, level * LEVEL))
            return known[key]

        def rotor(i: int, share: float) -> RotorState:
            level = math.ceil(share / LEVEL - 1e-9)
            w = level - share / LEVEL
            return steady(i, level) if w < 1e-6 else steady(i, level).mixed(steady(i, level - 1), w)

        shares = wakes.develop(rotor, self._for_all)
        return [start(i, START * max(round(float(share) / START), 1))[1] for i, share in enumerate(shares)]

    def _for_all(self, function: Callable[[int], Any]) -> list[Any]:
        """Call a function for all turbines, on threads."""
        every, threads = range(len(self.runs)), self.threads
        if self.pool is None:
            return [function(i) for i in every]
        parts = list(self.pool.map(lambda first: [function(i) for i in every[first::threads]], range(threads)))
        return [parts[i % threads][i // threads] for i in every]

    def to_end(self, progress: Callable[[float], None] | None) -> None:
        """Advance all turbines to the end of their runs.

        Raises:
          KeyboardInterrupt: the batch of which the farm is a piece is told to end.
        """
        try:
            while not all(turbine.simulation.finished for turbine in self.turbines):
                if told_to_end():
                    raise KeyboardInterrupt
                self._record(self.done)
                self._set_demands(self.done)
                self.exchange()
                if progress is not None:
                    progress(min(turbine.simulation.share for turbine in self.turbines))
        finally:
            self.close()

    def exchange(self) -> None:
        """Advance all turbines and their wakes to the next exchange."""
        march = self.pool.map if self.pool else map
        list(march(lambda turbine, steps: turbine.march(steps), self.turbines, self.steps))
        self.done += 1
        if self.wakes is not None:
            states = [turbine.reader.state() for turbine in self.turbines]
            self.wakes.advance(states, self.done * self.wakes.step, self._for_all)

    def close(self) -> None:
        """Release the turbines and the threads."""
        if self.pool is not None:
            self.pool.shutdown()
        for turbine in self.turbines:
            turbine.simulation.close()

    def _set_demands(self, done: int) -> None:
        """Call the farm controller, and pass its set-points to the turbines until the next exchange."""
        if self.control is None:
            return
        first = self.turbines[0]
        points = self.control(done * self.steps[0] * first.simulation.dt, [t.measurements() for t in self.turbines])
        given = [isinstance(each, SetPoint) for each in points] if isinstance(points, Sequence) else []
        if not all(given) or len(given) != len(self.turbines):
            raise InputError(
                f"farm: the controller returned {str(points)[:60]}, expected a list of {len(self.turbines)} SetPoint"
            )
        for turbine, point in zip(self.turbines, points, strict=True):
            turbine.demand(point)

    def _record(self, done: int) -> None:
        """Record the paths of the wakes, and pass them to the watch callback."""
        if self.wakes is not None:
            t = done * self.wakes.step
            self.times.append(t)
            self.planes.append(self.wakes.paths())
            if self.watch is not None:
                self.watch(self.wakes, t)

    def tracks(self, shift: Float) -> tuple[WakeTrack, ...]:
        """Paths of the wakes, in the axes of the layout."""
        if self.wakes is None:
            return ()
        for each in self.planes:
            for k, planes in enumerate(each):
                planes[:2] += shift[k, :, None]
        return tuple(WakeTrack(np.array(self.times), [each[k] for each in self.planes]) for k in range(len(self.runs)))

    def view(self, shift: Float) -> tuple[Float, Float, Float] | None:
        """Wind speed over the farm at the end, in the axes of the layout."""
        if self.wakes is None:
            return None
        x, y, speed = self.wakes.horizontal()
        return x + shift[0, 0], y + shift[0, 1], speed

    def facts(self) -> dict[str, float]:
        """Key figures of the simulation."""
        if self.wakes is None:
            return {}
        wakes = self.wakes
        return {"step": wakes.step, "planes": float(wakes.count.sum()), "crossed": float(wakes.crossed)}


def _exchange_step(runs: Sequence[Run], settings: WakeSettings, speed: float) -> tuple[float, list[int]]:
    """Time [s] between exchanges, and the number of time steps of each turbine in that time."""
    steps = [step_of(run, run.model) for run in runs]  # type: ignore[arg-type]
    given = settings.step
    if given is None:
        diameter = min(run.model.turbine.rotor_diameter for run in runs)  # type: ignore[union-attr]
        longest = max(steps)
        given = longest * max(round(min(STEP, 0.19 * diameter / max(speed, 1.0)) / longest), 1)
    return given, [multiple(given, dt, "farm: wakes.step") for dt in steps]


def _steady_rotor(run: Run, wind: SteadyWind, start: OperatingPoint | Start) -> RotorState:
    """State of a rotor in steady operation."""
    case = Case(run.model, wind)  # type: ignore[arg-type]
    start.put(case)
    case.begin_parts()
    case.evaluate(0.0)
    reader = RotorReader(case)
    reader.sample()
    return reader.state()
