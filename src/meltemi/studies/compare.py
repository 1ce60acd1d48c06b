"""``compare``: control schemes on the same turbine in the same winds, as numbers with their confidence.

Every scheme runs in every wind, in parallel; a wind's field is made once for all schemes. From each run come the
quantities of ``QUANTITIES`` over the time after a transient (and over further windows), spectra, and for the first
scheme the ceiling: what ideal removal of 1P, and of 1P and 2P, would leave.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.control.controller import Controller
from meltemi.core.display import Brief
from meltemi.core.errors import InputError
from meltemi.loadcases.batch import Outcome
from meltemi.postprocess.bands import IdealRemoval, harmonic_bands, ideal_removal
from meltemi.postprocess.ensemble import EnsembleTable, MeanEstimate, actuator_travel, ensemble_table, mean_interval
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.postprocess.spectra import (
    RESOLUTION,
    PowerSpectrum,
    average_spectra,
    power_spectrum,
    rotor_frequency,
)
from meltemi.simulation.channels import find, standard
from meltemi.simulation.model import Model
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.studies.run_store import SizedCases, current, resumed
from meltemi.wind.fields import Wind
from meltemi.wind.turbulence.field import AnyWind, realised

Float = NDArray[np.float64]

TRANSIENT = 100.0
"""[s] at the begin of a run that are not judged."""
BLADE_SLOPE, STEEL_SLOPE = 10.0, 4.0
SHORTEST = 20.0
"""[s] that must be judged, for 1P and 2P to be told apart."""
FEWEST_SEGMENTS = 3
"""Of the spectra of short runs, whose resolution is coarser for it."""
HALF_BAND = 0.25
"""Half-width of the bands of a ceiling, in rotor frequencies."""
SPECTRA = ("RootMyc1", "RootMxc1")
CHANNELS = (
    "wind_x",
    "rotor_speed",
    "azimuth",
    "generator_power",
    "RootMyc1",
    "RootMyc2",
    "RootMyc3",
    "RootMxc1",
    "OoPDefl1",
    "IPDefl1",
    "pitch_1",
    "pitch_2",
    "pitch_3",
    "TwrBsMyt",
    "YawBrMyp",
    "YawBrMzp",
)
"""What every run records; and the flaps' angles where there are any."""


@dataclass(frozen=True)
class Quantity:
    """A number of a run.

    Attributes:
      name: with the channel's name in OpenFAST first.
      unit: for people.
      factor: from SI to it.
      of: gives it in SI from a result.
      slope: m of the S-N curve where it is an equivalent load.
      about: in words.
    """

    name: str
    unit: str
    factor: float
    of: Callable[[Result], float] = field(repr=False)
    slope: float | None = None
    about: str = ""


def hub_moments(result: Result) -> tuple[Float, Float]:
    """(T,) tilt and yaw moment on the hub [N m], from the blades' out-of-plane root moments: sum M_i cos psi_i, sin."""
    names = [name for name in ("RootMyc1", "RootMyc2", "RootMyc3") if name in result]
    angles = [result["azimuth"] + 2.0 * pi * i / len(names) for i in range(len(names))]
    tilt, yaw = np.zeros(len(result.time)), np.zeros(len(result.time))
    for name, angle in zip(names, angles, strict=True):
        tilt += result[name] * np.cos(angle)
        yaw += result[name] * np.sin(angle)
    return tilt, yaw


def _load(series: Float, result: Result, slope: float) -> float:
    return damage_equivalent_load(series, duration=float(result.time[-1] - result.time[0]), slope=slope)


def _travel(result: Result, beginning: str) -> float:
    """[rad/s] mean over the blades, and sum over flaps of a blade."""
    names = [name for name in result.names if name.startswith(beginning)]
    blades = len([name for name in result.names if name.startswith("pitch_")])
    return sum(actuator_travel(result, name) for name in names) / blades


_K, _D = 1e-3, 180.0 / pi
QUANTITIES: tuple[Quantity, ...] = (
    Quantity("RootMyc1 std", "kN m", _K, lambda r: float(r["RootMyc1"].std()), about="out-of-plane root moment"),
    Quantity("RootMyc1 DEL", "kN m", _K, lambda r: _load(r["RootMyc1"], r, BLADE_SLOPE), BLADE_SLOPE),
    Quantity("RootMyc1 mean", "kN m", _K, lambda r: float(r["RootMyc1"].mean())),
    Quantity("RootMxc1 std", "kN m", _K, lambda r: float(r["RootMxc1"].std()), about="in-plane root moment"),
    Quantity("RootMxc1 DEL", "kN m", _K, lambda r: _load(r["RootMxc1"], r, BLADE_SLOPE), BLADE_SLOPE),
    Quantity(
        "Mtilt mean",
        "kN m",
        _K,
        lambda r: float(hub_moments(r)[0].mean()),
        about="tilt moment of the blades on the hub",
    ),
    Quantity("Mtilt std", "kN m", _K, lambda r: float(hub_moments(r)[0].std())),
    Quantity("Mtilt DEL", "kN m", _K, lambda r: _load(hub_moments(r)[0], r, BLADE_SLOPE), BLADE_SLOPE),
    Quantity(
        "Myaw mean", "kN m", _K, lambda r: float(hub_moments(r)[1].mean()), about="yaw moment of the blades on the hub"
    ),
    Quantity("Myaw std", "kN m", _K, lambda r: float(hub_moments(r)[1].std())),
    Quantity("Myaw DEL", "kN m", _K, lambda r: _load(hub_moments(r)[1], r, BLADE_SLOPE), BLADE_SLOPE),
    Quantity("OoPDefl1 mean", "m", 1.0, lambda r: float(r["OoPDefl1"].mean()), about="out-of-plane tip deflection"),
    Quantity("OoPDefl1 std", "m", 1.0, lambda r: float(r["OoPDefl1"].std())),
    Quantity("OoPDefl1 max", "m", 1.0, lambda r: float(r["OoPDefl1"].max())),
    Quantity("IPDefl1 std", "m", 1.0, lambda r: float(r["IPDefl1"].std()), about="in-plane tip deflection"),
    Quantity(
        "TwrBsMyt DEL",
        "kN m",
        _K,
        lambda r: _load(r["TwrBsMyt"], r, STEEL_SLOPE),
        STEEL_SLOPE,
        "fore-aft moment at the tower base",
    ),
    Quantity(
        "YawBrMyp DEL",
        "kN m",
        _K,
        lambda r: _load(r["YawBrMyp"], r, STEEL_SLOPE),
        STEEL_SLOPE,
        "tilt moment at the yaw bearing",
    ),
    Quantity(
        "YawBrMzp DEL",
        "kN m",
        _K,
        lambda r: _load(r["YawBrMzp"], r, STEEL_SLOPE),
        STEEL_SLOPE,
        "yaw moment at the yaw bearing",
    ),
    Quantity("power mean", "kW", _K, lambda r: float(r["generator_power"].mean()), about="electrical"),
    Quantity("power std", "kW", _K, lambda r: float(r["generator_power"].std())),
    Quantity("rotor speed std", "rpm", 30.0 / pi, lambda r: float(r["rotor_speed"].std())),
    Quantity("pitch travel", "deg/s", _D, lambda r: _travel(r, "pitch_"), about="mean of |rate|, mean of the blades"),
    Quantity("flap travel", "deg/s", _D, lambda r: _travel(r, "flap_"), about="the same, sum of a blade's flaps"),
)
"""What is compared, in the order of tables."""


@dataclass(frozen=True)
class RunSummary:
    """What is kept of one run.

    Attributes:
      numbers: quantities by window and name, SI.
      spectra: by channel, of the time after the transient.
      ceilings: of RootMyc1, for removal of 1P and of 1P and 2P.
      moment: (T,) RootMyc1 [N m] after the transient, as recorded.
      ceilings_window: the same judged in each further window, by its name.
      result: the series; None unless wanted.
      warnings: of the run.
    """

    numbers: Mapping[str, Mapping[str, float]]
    spectra: Mapping[str, PowerSpectrum] = field(repr=False)
    ceilings: tuple[IdealRemoval, IdealRemoval]
    moment: Float = field(repr=False)
    ceilings_window: Mapping[str, tuple[IdealRemoval, IdealRemoval]]
    result: Result | None = field(default=None, repr=False)
    warnings: tuple[str, ...] = ()


WHOLE = "whole"
"""Name of the time after the transient."""


@dataclass(frozen=True, repr=False)
class Comparison(Brief):
    """Schemes in the same winds.

    Attributes:
      schemes: names; the first is the base of changes.
      winds: labels, one for each seed.
      seeds: of the winds; None where a wind has none.
      runs: ``runs[scheme][k]`` is what is kept of wind k; that of the first has the series.
      windows: [s] by name; ``whole`` is the time after the transient.
      quantities: what was computed.
      failures: runs that did not reach their end. A wind in which a scheme failed is left out for all; a scheme that
        failed in every wind is left out.
    """

    schemes: tuple[str, ...]
    winds: tuple[str, ...]
    seeds: tuple[int | None, ...]
    runs: Mapping[str, tuple[RunSummary, ...]] = field(repr=False)
    windows: Mapping[str, tuple[float, float]]
    quantities: tuple[Quantity, ...] = field(repr=False)
    failures: tuple[Outcome, ...] = ()

    def values(self, quantity: str, scheme: str, window: str = WHOLE) -> Float:
        """(seeds,) a quantity in SI."""
        return np.array([run.numbers[window][quantity] for run in self.runs[scheme]])

    def table(self, window: str = WHOLE, *, confidence: float = 0.95) -> EnsembleTable:
        """Means over seeds, changes seed by seed, intervals, equivalent loads of the ensemble."""
        numbers = {
            k: {scheme: self.runs[scheme][k].numbers[window] for scheme in self.schemes} for k in range(len(self.winds))
        }
        slopes = {q.name: q.slope for q in self.quantities if q.slope is not None}
        return ensemble_table(numbers, slopes, confidence=confidence)

    def units(self) -> dict[str, tuple[str, float]]:
        """Unit for people and factor to it, by quantity, for ``ensemble_rows``."""
        return {q.name: (q.unit, q.factor) for q in self.quantities}

    def spectrum(self, channel: str, scheme: str) -> PowerSpectrum:
        """Mean over seeds.

        Raises:
          InputError: of this channel spectra are not kept.
        """
        kept = {find(name, standard()).name: name for name in SPECTRA}
        name = find(channel, standard()).name
        if name not in kept:
            raise InputError(f"spectrum of {channel!r}: there are those of {' and '.join(SPECTRA)}")
        return average_spectra([run.spectra[kept[name]] for run in self.runs[scheme]])

    def ceiling_change(self, harmonics: int, quantity: Literal["std", "load"], window: str = WHOLE) -> MeanEstimate:
        """Change of RootMyc1 of the first scheme when 1P (``harmonics`` 1), or 1P and 2P (2), are removed ideally."""
        found = [_limits(run, window)[harmonics - 1] for run in self.runs[self.schemes[0]]]
        return mean_interval([c.std_change if quantity == "std" else c.load_change for c in found])

    def ceiling_left(self, harmonics: int, quantity: Literal["std", "load"], window: str = WHOLE) -> MeanEstimate:
        """What is left then [N m], mean over seeds."""
        found = [_limits(run, window)[harmonics - 1] for run in self.runs[self.schemes[0]]]
        return mean_interval([c.std_left if quantity == "std" else c.load_left for c in found])

    def warnings(self) -> list[str]:
        """What runs have to say, a line a scheme."""
        lines = []
        for scheme, runs in self.runs.items():
            told = [run.warnings for run in runs if run.warnings]
            if told:
                lines.append(f"scheme {scheme!r} in {len(told)} of {len(runs)} winds: {'; '.join(told[0])}")
        return lines

    def rotor_frequency(self) -> float:
        """[Hz] of the first scheme in the first wind, after the transient."""
        return rotor_frequency(self.results(self.schemes[0]).between(*self.windows[WHOLE]))

    def results(self, scheme: str) -> Result:
        """Series of the first wind."""
        found = self.runs[scheme][0].result
        assert found is not None
        return found


def compare(
    model: Model,
    controllers: Mapping[str, Controller | Callable[[Wind], Controller]],
    winds: Sequence[AnyWind],
    *,
    duration: float = 700.0,
    transient: float = TRANSIENT,
    windows: Mapping[str, tuple[float, float]] | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run every controller in every wind and reduce the runs to numbers.

    Args:
      model: the turbine, with all actuators that a controller moves.
      controllers: by name, or functions that make one for a wind; the first is the base of changes.
      winds: one for each seed.
      duration: [s] of each run.
      transient: [s] at the begin that are not judged.
      windows: [s] further parts that are judged, by name.
      workers: threads.
      progress: called with the share that is done.

    Raises:
      InputError: there is nothing to compare, the windows do not fit, or no wind was survived by all schemes.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    if not controllers or not winds:
        raise InputError("compare: at least one controller and one wind are needed")
    check_duration(duration, transient)
    judged = {WHOLE: (transient, duration), **(windows or {})}
    for name, (begin, end) in judged.items():
        if not 0.0 <= begin < end <= duration:
            raise InputError(f"compare: window {name!r} from {begin:g} to {end:g} s does not fit in {duration:g} s")
    flaps = [f"flap_{j + 1}_angle_{b + 1}" for j in range(model.n_flaps) for b in range(model.n_blades)]
    channels = [name for name in CHANNELS if not (name[-1] == "3" and model.n_blades < 3)] + flaps
    names = [f"{k}:{scheme}" for k in range(len(winds)) for scheme in controllers]

    def cases() -> Iterator[Run]:
        for k, wind in enumerate(winds):
            shared = _Shared(wind, model, duration, len(controllers))
            for scheme, controller in controllers.items():
                yield Run(
                    model, shared, duration=duration, controller=controller, channels=channels, name=f"{k}:{scheme}"
                )

    done: dict[int, int] = {}
    lock = threading.Lock()

    def reduce(result: Result) -> RunSummary:
        # series are kept of the first wind in which no scheme fails, which may not be the first of all
        k = int(str(result.meta["case"]).partition(":")[0])
        keep = not any(j < k and done[j] == len(controllers) for j in list(done))
        summary = _summary(result, judged, keep)
        with lock:
            done[k] = done.get(k, 0) + 1
        return summary

    outcomes = resumed(SizedCases(cases, len(names)), reduce=reduce, workers=workers, progress=progress)
    by_name = {outcome.name: outcome for outcome in outcomes}
    failures = tuple(outcome for outcome in outcomes if not outcome.ok)
    for failure in failures:
        current().enter(failure_line(failure), failure.message)
    # a scheme that fails in every wind takes no other with it
    schemes = [s for s in controllers if any(by_name[f"{k}:{s}"].ok for k in range(len(winds)))]
    whole = [k for k in range(len(winds)) if schemes and all(by_name[f"{k}:{s}"].ok for s in schemes)]
    if not whole:
        first = failures[0] if failures else None
        raise InputError(
            "compare: no wind was survived by all schemes"
            + (f"; first of {len(failures)} failures: {failure_line(first)}" if first else "")
        )
    return Comparison(
        schemes=tuple(schemes),
        winds=tuple(winds[k].label for k in whole),
        seeds=tuple(getattr(winds[k], "seed", None) for k in whole),
        runs={s: tuple(_trimmed(by_name[f"{k}:{s}"].value, series=k == whole[0]) for k in whole) for s in schemes},
        windows=judged,
        quantities=QUANTITIES,
        failures=failures,
    )


def check_duration(duration: float, transient: float) -> None:
    """Refuse runs of which too little is judged.

    Raises:
      InputError: the transient is not below the duration, or hardly.
    """
    if not 0.0 <= transient < duration:
        raise InputError(f"compare: transient {transient:g} s must lie below the duration {duration:g} s")
    if duration - transient < SHORTEST:
        raise InputError(
            f"compare: {duration - transient:g} s are left after the transient of {transient:g} s; "
            f"at least {SHORTEST:g} s are needed"
        )


def failure_line(outcome: Outcome) -> str:
    """Which scheme failed in which wind, counted from 1, and why."""
    k, _, scheme = outcome.name.partition(":")
    return f"scheme {scheme!r} in wind {int(k) + 1}: {outcome.message}"


class _Shared:
    """A wind whose field is made when the first run asks for it and let go when the last has taken it."""

    def __init__(self, wind: AnyWind, model: Model, duration: float, takers: int) -> None:
        self.wind, self.model, self.duration, self.left = wind, model, duration, takers
        self.field: Wind | None = None
        self.lock = threading.Lock()

    def content_hash(self) -> str:
        """Of the wind that it gives."""
        return self.wind.content_hash()

    def __call__(self) -> Wind:
        with self.lock:
            found = self.field or realised(self.wind, self.model.turbine, self.duration)
            self.left -= 1
            self.field = found if self.left else None
            return found


def _trimmed(run: RunSummary, *, series: bool) -> RunSummary:
    return run if series else replace(run, result=None)


def _limits(run: RunSummary, window: str) -> tuple[IdealRemoval, IdealRemoval]:
    return run.ceilings if window == WHOLE else run.ceilings_window[window]


def _summary(result: Result, windows: Mapping[str, tuple[float, float]], keep: bool) -> RunSummary:
    numbers = {name: {q.name: q.of(part) for q in QUANTITIES} for name, part in _parts(result, windows)}
    whole = result.between(*windows[WHOLE])
    resolution = max(RESOLUTION, 0.5 * (FEWEST_SEGMENTS + 1) / (windows[WHOLE][1] - windows[WHOLE][0]))
    f = rotor_frequency(whole)
    bands = [harmonic_bands(f, multiples, HALF_BAND) for multiples in ((1,), (1, 2))]

    def limits(window: tuple[float, float]) -> tuple[IdealRemoval, IdealRemoval]:
        one, two = (ideal_removal(whole, "RootMyc1", bands=b, slope=BLADE_SLOPE, between=window) for b in bands)
        return one, two

    return RunSummary(
        numbers=numbers,
        spectra={name: power_spectrum(whole, name, resolution=resolution) for name in SPECTRA},
        ceilings=limits(windows[WHOLE]),
        moment=whole["RootMyc1"].copy(),
        ceilings_window={name: limits(w) for name, w in windows.items() if name != WHOLE},
        result=result if keep else None,
        warnings=result.warnings,
    )


def _parts(result: Result, windows: Mapping[str, tuple[float, float]]) -> Iterator[tuple[str, Result]]:
    for name, (begin, end) in windows.items():
        yield name, result.between(begin, end)
