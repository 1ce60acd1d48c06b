"""All simulations of the reproduction: the paper's set-up, alternative schemes, other wind speeds, other winds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from meltemi.analyses.linear import LinearModel
from meltemi.control.controller import Controller
from meltemi.control_laws.load_control import FeedForward, HarmonicLoop, LoadControl, LoadController, SpeedNotch
from meltemi.controllers.names import SCHEMES, Target
from meltemi.controllers.tuning import LoopTuning, linear_models, scaled, speed_notch, tune_loops
from meltemi.iec.winds import ntm
from meltemi.papers.study import Progress
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.studies.preview import LidarErrors, measured, preview_of, steady_pitch
from meltemi.tuning.compare import WHOLE, Comparison, compare
from meltemi.tuning.run_store import FailedResult, attempt
from meltemi.turbine.definition import Turbine
from meltemi.turbine.flaps import with_flaps
from meltemi.turbine.library import load_turbine
from meltemi.wind.fields import SteadyWind, Wind, WindBox
from meltemi.wind.turbulent import AnyWind

Made = Controller | Callable[[Wind], Controller]

ADDED, WHOLE_LEAD = "ipc as it is, with flaps", "cpfc, whole lead"
NARROW = 0.5
"""Damping ratio of narrow band-pass filters: that of 1P passes 2P with a gain of 0.55."""
Tunings = Mapping[tuple[Target, ...], tuple[LoopTuning, ...]]


def _loops(tunings: Tunings, scheme: str) -> tuple[HarmonicLoop, ...]:
    return tuple(tuning.loop for tuning in tunings[SCHEMES[scheme].loops])


def added(tunings: Tunings) -> tuple[HarmonicLoop, ...]:
    """The paper's loops: flaps added to an unchanged IPC."""
    return _loops(tunings, "ipc") + _loops(tunings, "flaps")


def designs(model: BladedModel, linear: Sequence[LinearModel], tunings: Tunings) -> dict[str, tuple[HarmonicLoop, ...]]:
    """Loops of 1P pitch and 2P flaps that deviate from the tuning rule.

    "Whole lead" has a proportional part that compensates the full delay of the band-pass, "narrow" narrow band-passes.
    """

    of = partial(_loops, tunings)

    def led(loops: Iterable[HarmonicLoop]) -> tuple[HarmonicLoop, ...]:
        nP = linear[0].point.rotor_speed
        return tuple(
            loop.replace(proportional_gain=loop.integral_gain / (loop.filter_damping * loop.harmonic * nP))
            for loop in loops
        )

    def narrow(scheme: str) -> tuple[HarmonicLoop, ...]:
        narrow_tuning = tune_loops(model, SCHEMES[scheme].loops, linear=linear, filter_damping=NARROW)
        return tuple(tuning.loop for tuning in narrow_tuning)

    not_detuned = added(tunings)
    return {
        ADDED: not_detuned,
        WHOLE_LEAD: led(of("cpfc")),
        f"{ADDED}, whole lead": led(not_detuned),
        "ipc, narrow": narrow("ipc"),
        "cpfc, narrow": narrow("cpfc"),
    }


SLOW, DECAY, LOST = 0.25, 10.0, 0.3
LIDARS: Mapping[str, LidarErrors] = {
    "30 % lost": LidarErrors(lost=LOST),
    "evolving turbulence": LidarErrors(decay=DECAY),
    "4 beams": LidarErrors(beams=4),
    "4 beams, 0.25 rad/s": LidarErrors(SLOW, beams=4),
    "all errors, 0.25 rad/s": LidarErrors(SLOW, 4, DECAY, LOST),
}
"""Errors of the measurement, by name. Their sizes are assumed."""


SPEED, SHEAR = 20.0, 0.2
PAPER = "100-160 s"
"""Name of the window in which the paper discusses its figures."""
EDITION_2, CLASS_B = "ed. 2, TI 14 %", "NTM class B, 14.4 %"
READINGS: Mapping[str, dict[str, Any]] = {CLASS_B: {"wind_class": "IIB"}, EDITION_2: {"edition": 2, "intensity": 0.14}}
"""Two ways to read the paper's wind: the class whose I_ref is 0.14, or an intensity of 0.14."""
READ_AS = {EDITION_2: (0.14, 0.5), CLASS_B: (0.144, 1.0)}
"""Intensity, and length scale over that of edition 3; the coherence of edition 2 decays less, too."""
GRID = {
    **{f"TI {intensity} %": (0.01 * intensity, 1.0) for intensity in (12, 10, 8, 5)},
    **{f"TI {intensity} %, half the lengths": (0.01 * intensity, 0.5) for intensity in (12, 8)},
    **{f"TI {intensity} %, twice the lengths": (0.01 * intensity, 2.0) for intensity in (12, 8)},
}
"""Winds of other intensity and length scale."""
THREE = ("cpc", "ipc", "cpfc")
PARTS = (*THREE, "feedforward", "feedback", "flaps")
HALF = "feedforward, half of it"
"""Feed-forward alone with half of the weights."""
STATED = (*THREE, "feedforward", "feedback", ADDED, HALF)
"""Schemes of which the paper states something, with two variants; they run in every reading of model and wind."""
RIVALS = ("ipc2", "flaps12", "cpfc12")
ALL_SPEEDS = ("cpc", "ipc", "cpfc", "ipc2", "flaps12")
"""Schemes that are run at every wind speed."""
TRAVEL = "cpfc12 at equal travel"
PREVIEW, BEST = "preview", "preview and cpfc"
PREVIEWS = (PREVIEW, "preview and ipc", BEST, *(f"{BEST}: {name}" for name in LIDARS))
TUNING_SEEDS = (101, 102, 103)
"""Winds in which the flap loops are tuned for load; the schemes are judged in others."""
SHARES_1P, SHARES_2P = (0.0, 0.5, 1.0), (0.3, 0.6, 1.0)
"""Factors on the flap gains at 1P and 2P that are tried."""


@dataclass(frozen=True)
class LoadControlSetup:
    """Extent of the simulations.

    Attributes:
      seeds: turbulence seeds.
      duration: [s] duration of a run.
      transient: [s] excluded initial transient.
      window: [s] time window that the paper discusses.
      speeds: [m/s] wind speeds in addition to the paper's.
      study_seeds: seeds for the study of winds.
      grid: simulate the grid of winds for the estimate of the paper's wind, which takes many minutes.
    """

    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    duration: float = 700.0
    transient: float = 100.0
    window: tuple[float, float] = (100.0, 160.0)
    speeds: tuple[float, ...] = (8.0, 11.0, 12.0, 16.0, 24.0)
    study_seeds: tuple[int, ...] = (1, 2, 3, 4)
    grid: bool = True

    @property
    def windows(self) -> dict[str, tuple[float, float]]:
        """Windows for ``compare``: that of the paper, and consecutive ones of the same length."""
        length = self.window[1] - self.window[0]
        begins = np.arange(self.transient, self.duration - length + 1e-9, length)
        return {PAPER: self.window} | {f"from {u:g} s": (u, u + length) for u in begins.tolist()}


QUICK = LoadControlSetup(seeds=(1,), duration=170.0, speeds=(8.0, 24.0), study_seeds=(1,), grid=False)
"""A look at everything in little time; its numbers are too few to judge by."""


@dataclass(frozen=True)
class TunedTurbine:
    """A turbine model with tuned controllers.

    Attributes:
      model: turbine with the paper's flaps and a second-order pitch actuator.
      linear: linear model for the tuning.
      notch: notch filter of the generator speed, common to all schemes.
      tunings: loops tuned together, by actuator.
      designs: other designs of loops.
    """

    model: BladedModel
    linear: tuple[LinearModel, ...] = field(repr=False)
    notch: SpeedNotch
    tunings: Tunings
    designs: Mapping[str, tuple[HarmonicLoop, ...]]

    def controller(self, name: str) -> Controller:
        """Controller of a scheme or design."""
        if name == HALF:
            return self.composed(name, [], feedforward=True, weight=0.5)
        feedforward = name in self.designs or SCHEMES[name].feedforward
        return self.composed(name, self.loops(name), feedforward=feedforward)

    def loops(self, name: str) -> list[HarmonicLoop]:
        """Feedback loops of a scheme or design."""
        if name in self.designs:
            return list(self.designs[name])
        return [tuning.loop for tuning in self.tunings[SCHEMES[name].loops]]

    def composed(
        self, name: str, loops: list[HarmonicLoop], *, feedforward: bool, weight: float = 1.0, **more: Any
    ) -> Controller:
        """Load controller with given loops; ``weight`` is the weight of the feed-forward."""
        weights = FeedForward(gain=weight, shear_exponent=SHEAR, tower_shadow=True) if feedforward else None
        settings = LoadControl(feedforward=weights, loops=tuple(loops), notch=self.notch, **more)
        return LoadController(self.model.turbine, settings, name=name)


def paper_turbine(turbine: Turbine | None = None) -> Turbine:
    """The NREL 5 MW, or another turbine, with the paper's flaps and a second-order pitch actuator: by default 11.11
    rad/s and damping ratio 0.6."""
    turbine = turbine or load_turbine("nrel5mw")
    return (turbine if turbine.flaps else with_flaps(turbine)).replace(**{"pitch_actuator.kind": "second_order"})


def bench(model: BladedModel, schemes: tuple[str, ...] = (*PARTS, *RIVALS)) -> TunedTurbine:
    """Tune all controllers for a model."""
    linear = tuple(linear_models(model))
    wanted = {SCHEMES[name].loops for name in schemes}
    tunings = {loops: tune_loops(model, loops, linear=linear) for loops in sorted(wanted)}
    others = designs(model, linear, tunings) if "cpfc12" in schemes else {}
    others |= {ADDED: added(tunings)} if {"ipc", "flaps"} <= set(schemes) else {}
    return TunedTurbine(model, linear, speed_notch(linear[0]), tunings, others)


@dataclass(frozen=True)
class LoadControlRuns:
    """Results of all simulations.

    Attributes:
      setup: extent of the simulations.
      bench: turbine and controllers.
      readings: full model at the paper's wind speed, by the reading of its wind; that of the class includes the
        alternative schemes.
      fast: the paper's schemes with the paper's degrees of freedom in FAST, by the reading of the wind.
      speeds: wind of the class at other wind speeds.
      studies: cpc, ipc and cpfc in other winds, and with another model, by what is different.
      shares: factors of the flap gains at 1P and 2P that were best at equal travel.
      travel: candidates by their factors: DEL of RootMyc1 [N m] and flap travel [rad/s], means over the tuning seeds.
    """

    setup: LoadControlSetup
    bench: TunedTurbine = field(repr=False)
    readings: Mapping[str, Comparison] = field(repr=False)
    fast: Mapping[str, Comparison] = field(repr=False)
    speeds: Mapping[float, Comparison] = field(repr=False)
    studies: Mapping[str, Comparison] = field(repr=False)
    shares: tuple[float, float]
    travel: Mapping[str, tuple[float, float]] = field(repr=False)

    @property
    def judged(self) -> dict[str, Comparison]:
        """The comparisons by which the paper is judged: all readings of its model and of its wind."""
        both = ((FAST, self.fast), (FULL, self.readings))
        return {f"{model}, {SHORT[wind]}": c for model, comparisons in both for wind, c in comparisons.items()}

    def study(self, name: str) -> Comparison:
        """A study; if it was not run, its use raises an error with the reason."""
        missing: Any = FailedResult(f"{name}: not run")
        return self.studies.get(name, missing)


def run_all(
    *,
    quick: bool,
    workers: int | None,
    progress: Progress,
    partly: Callable[[LoadControlRuns], object],
    parts: Sequence[str],
    turbine: Turbine | None = None,
) -> LoadControlRuns:
    """Run all simulations; ``partly`` is called with the complete runs of the paper, the others marked as missing."""
    setup = QUICK if quick else LoadControlSetup()
    n, few = len(setup.seeds), len(setup.study_seeds)
    progress(0.0, "tuning")
    b = bench(build(paper_turbine(turbine)))
    candidates = (len(SHARES_1P) * len(SHARES_2P) + 1) * min(n, len(TUNING_SEEDS))
    at_20 = 2 * len({*PARTS, *STATED, *PREVIEWS}) + len(RIVALS) + len(b.designs)
    at_20 += 2 * len(STATED) if turbine is None else 0
    studied = {name: study for name, study in STUDIES.items() if setup.grid or name not in GRID}
    total = 20.0 + candidates + (at_20 + len(ALL_SPEEDS) * len(setup.speeds)) * n
    total += sum((n if study.all_seeds else few) * len(study.schemes) for study in studied.values())
    done = 20.0

    def run(
        what: str, controllers: Mapping[str, Made], winds: list[AnyWind], model: BladedModel | None = None
    ) -> Comparison:
        nonlocal done
        begin, size = done, len(controllers) * len(winds)
        comparison = attempt(
            what,
            compare,
            model or b.model,
            controllers,
            winds,
            duration=setup.duration,
            transient=setup.transient,
            windows=setup.windows if turbine is None else None,
            workers=workers,
            progress=lambda share: progress((begin + share * size) / total, what),
        )
        done += size
        return comparison

    flap_loops = attempt("flap loops", _equal_travel, b, setup, lambda c, w: run("flap loops at equal travel", c, w))
    shares, travel, best = (flap_loops, flap_loops, flap_loops) if isinstance(flap_loops, FailedResult) else flap_loops
    previews = attempt("preview", _previews, b)
    readings = {}
    stated, fast = STATED if turbine is None else (), dict[str, Any]()
    benches: dict[ModelOptions | None, Any] = {None: b}
    for name, reading in (READINGS if turbine is None else {CLASS_B: READINGS[CLASS_B]}).items():
        winds = [wind_of(seed, SPEED, **reading) for seed in setup.seeds]
        controllers: dict[str, Made] = {scheme: b.controller(scheme) for scheme in dict.fromkeys((*PARTS, *stated))}
        if name == CLASS_B:
            controllers |= {scheme: b.controller(scheme) for scheme in (*RIVALS, *b.designs)}
            controllers |= {} if isinstance(best, FailedResult) else {TRAVEL: best}
        controllers |= {} if isinstance(previews, FailedResult) else previews
        readings[name] = run(name, controllers, winds)
        if turbine is None:
            fast[name] = _with(benches, FAST_MODEL, b, f"{FAST}, {name}", STATED, winds, run)
    later: Any = FailedResult("not run yet")
    partly(LoadControlRuns(setup, b, readings, fast, dict.fromkeys(setup.speeds, later), {}, shares, travel))
    speeds: dict[float, Comparison] = {}
    studies: dict[str, Any] = {}
    at_all: dict[str, Made] = {scheme: b.controller(scheme) for scheme in ALL_SPEEDS}
    for u in setup.speeds:
        winds = [wind_of(seed, u, **READINGS[CLASS_B]) for seed in setup.seeds]
        speeds[u] = run(f"{u:g} m/s", at_all, winds)
    for name, study in studied.items() if turbine is None else ():
        winds = [study.wind(seed) for seed in (setup.seeds if study.all_seeds else setup.study_seeds)]
        if isinstance(winds[0], SteadyWind):
            winds = winds[:1]
        studies[name] = _with(benches, study.model, b, name, study.schemes, winds, run)
    progress(1.0, "done")
    return LoadControlRuns(setup, b, readings, fast, speeds, studies, shares, travel)


def wind_of(seed: int, speed: float, **more: Any) -> AnyWind:
    """The paper's wind for a seed and wind speed, with the settings of a reading or study."""
    options: dict[str, Any] = {"spectrum": "vonkarman", "shear_exponent": SHEAR, "wind_class": None} | more
    return ntm(speed, seed=seed, **options)


def _of_grid(first: int, intensity: float, length: float, seed: int) -> AnyWind:
    """A wind of the grid, with seeds that no other wind uses."""
    return wind_of(first + seed, SPEED, intensity=intensity, length_factor=length)


FAST, FULL = "FAST's model", "full model"
"""Models by which the paper is judged: that of its FAST, and the library's with all that the former leaves out."""
FAST_MODEL = ModelOptions(torsion_modes=0, stall="static", inflow="quasi_steady")
"""Blades as in ElastoDyn, which the paper's FAST has."""
SHORT = {CLASS_B: "class B", EDITION_2: "ed. 2"}


@dataclass(frozen=True)
class WindStudy:
    """Schemes in another wind, or with another model.

    Attributes:
      wind: wind for a seed.
      model: None for the full model.
      schemes: schemes to compare.
      all_seeds: use the seeds of the paper's comparisons, for differences by seed.
    """

    wind: Callable[[int], AnyWind]
    model: ModelOptions | None = None
    schemes: tuple[str, ...] = THREE
    all_seeds: bool = False


def _class_b(seed: int, **more: Any) -> AnyWind:
    return wind_of(seed, SPEED, **READINGS[CLASS_B], **more)


def _steady(seed: int) -> AnyWind:
    return SteadyWind(speed=SPEED, shear_exponent=SHEAR)


LESS = "TI 8 %"
"""Wind of the grid that the model of FAST meets, too."""
MODEL_PARTS = {
    "without torsion": ModelOptions(torsion_modes=0),
    "with static polars": ModelOptions(stall="static"),
    "with a quasi-steady wake": ModelOptions(inflow="quasi_steady"),
}
"""Effects that the model of FAST neglects, one by one."""
_OF_GRID = {name: partial(_of_grid, 10 * (k + 1), *wind) for k, (name, wind) in enumerate(GRID.items())}
CALM = "no turbulence"
STUDIES: Mapping[str, WindStudy] = {
    **{name: WindStudy(wind) for name, wind in _OF_GRID.items()},
    f"{FAST}, {LESS}": WindStudy(_OF_GRID[LESS], FAST_MODEL),
    CALM: WindStudy(_steady, schemes=STATED),
    f"{FAST}, {CALM}": WindStudy(_steady, FAST_MODEL, STATED),
    "shear exponent 0.3": WindStudy(partial(_class_b, shear_exponent=0.3)),
    "Kaimal": WindStudy(partial(_class_b, spectrum="kaimal")),
    "Mann": WindStudy(partial(_class_b, spectrum="mann")),
    **{name: WindStudy(_class_b, model, all_seeds=True) for name, model in MODEL_PARTS.items()},
}


def _with(
    benches: dict[ModelOptions | None, Any],
    options: ModelOptions | None,
    b: TunedTurbine,
    name: str,
    schemes: Sequence[str],
    winds: list[AnyWind],
    run: Callable[..., Comparison],
) -> Any:
    """Compare schemes tuned for a model of the same turbine in given winds; each model is tuned once."""
    if options not in benches:
        tuned = PARTS if options == FAST_MODEL else THREE
        benches[options] = attempt(name, bench, build(b.model.turbine, options), tuned)
    other = benches[options]
    if isinstance(other, FailedResult):
        return other
    return run(name, {scheme: other.controller(scheme) for scheme in schemes}, winds, other.model)


def _previews(b: TunedTurbine) -> dict[str, Made]:
    """Controllers with preview of the rotor-averaged wind for several schemes, with and without lidar errors."""
    table = steady_pitch(b.model)

    def make(name: str, scheme: str, lidar: LidarErrors) -> Made:
        def of(wind: Wind) -> Controller:
            assert isinstance(wind, WindBox)
            preview = preview_of(b.model, wind, table, frequency=lidar.frequency)
            if lidar != LidarErrors():
                preview = preview.replace(wind=measured(wind, b.model, lidar))
            return b.composed(name, b.loops(scheme), feedforward=scheme != "cpc", preview=preview)

        return of

    lidars = [LidarErrors()] * 3 + list(LIDARS.values())
    schemes = ["cpc", "ipc"] + ["cpfc"] * (1 + len(LIDARS))
    return {each[0]: make(*each) for each in zip(PREVIEWS, schemes, lidars, strict=True)}


def _equal_travel(
    b: TunedTurbine, setup: LoadControlSetup, run: Callable[[Mapping[str, Made], list[AnyWind]], Comparison]
) -> tuple[tuple[float, float], dict[str, tuple[float, float]], Controller]:
    """Factors of the flap gains at 1P and 2P with the smallest load at no more flap travel than CPFC."""
    pitch, flap_1, flap_2 = (tuning.loop for tuning in b.tunings[SCHEMES["cpfc12"].loops])
    tried: dict[str, tuple[float, float]] = {
        f"{100 * one:.0f} % 1P, {100 * two:.0f} % 2P": (one, two) for one in SHARES_1P for two in SHARES_2P
    }

    def candidate(name: str, shares: tuple[float, float]) -> Controller:
        flaps = [scaled(loop, share) for loop, share in zip((flap_1, flap_2), shares, strict=True) if share > 0.0]
        return b.composed(name, [pitch, *flaps], feedforward=True)

    controllers: dict[str, Made] = {"cpfc": b.controller("cpfc")}
    controllers |= {name: candidate(name, shares) for name, shares in tried.items()}
    winds = [wind_of(seed, SPEED, **READINGS[CLASS_B]) for seed in TUNING_SEEDS[: len(setup.seeds)]]
    comparison = run(controllers, winds)
    numbers = {
        name: (
            float(np.mean(comparison.values("RootMyc1 DEL", name, WHOLE))),
            float(np.mean(comparison.values("flap travel", name, WHOLE))),
        )
        for name in controllers
    }
    allowed = {name: load for name, (load, travel) in numbers.items() if name in tried and travel <= numbers["cpfc"][1]}
    best = min(allowed, key=lambda name: allowed[name]) if allowed else min(tried, key=lambda name: numbers[name][1])
    return tried[best], numbers, candidate(TRAVEL, tried[best])
