"""``compare``: control schemes on the same turbine in the same wind fields, with confidence intervals.

Every scheme runs in every wind, in parallel; a wind field is generated once for all schemes. Each run gives the
quantities of ``quantities.py`` after the initial transient (and in further windows), spectra, and for the first scheme
the ceiling: the loads that ideal removal of 1P, and of 1P and 2P, would leave. It is a reference, not a bound.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.control.controller import Controller
from meltemi.core.errors import InputError
from meltemi.core.representation import Card, Fold, badge
from meltemi.core.shown import Brief
from meltemi.environment.grid import PowerGrid
from meltemi.loadcases.store import Outcome
from meltemi.postprocess.bands import IdealRemoval, harmonic_bands, ideal_removal
from meltemi.postprocess.ensemble import EnsembleTable, MeanEstimate, ensemble_table, mean_interval
from meltemi.postprocess.spectra import RESOLUTION, PowerSpectrum, average_spectra, power_spectrum, rotor_frequency
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.channels import find, standard
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.tuning.quantities import BLADE_SLOPE, QUANTITIES, TRACKING, Quantity
from meltemi.tuning.run_store import current, resumed
from meltemi.wind.fields import Wind
from meltemi.wind.turbulent import AnyWind, realised

Float = NDArray[np.float64]

TRANSIENT = 100.0
"""[s] initial transient, excluded from the evaluation."""
SHORTEST = 20.0
"""[s] shortest evaluated time, needed to separate 1P and 2P."""
FEWEST_SEGMENTS = 3
"""Smallest number of segments of a spectrum; short runs have a coarser resolution."""
HALF_BAND = 0.25
"""Half-width of the bands of a ceiling, in rotor frequencies."""
SPECTRA = ("RootMyc1", "RootMxc1")
CHANNELS = (
    *("wind_x", "rotor_speed", "azimuth", "generator_power", "RootMyc1", "RootMyc2", "RootMyc3", "RootMxc1"),
    *("OoPDefl1", "IPDefl1", "pitch_1", "pitch_2", "pitch_3", "TwrBsMyt", "YawBrMyp", "YawBrMzp"),
)
"""Channels that every run records, in addition to the flap angles."""


@dataclass(frozen=True)
class RunSummary:
    """Evaluation of one run.

    Attributes:
      numbers: quantities by window and name, SI.
      spectra: spectra by channel, after the transient.
      ceilings: ideal removal of 1P, and of 1P and 2P, from RootMyc1.
      moment: (T,) RootMyc1 [N m] after the transient, as recorded.
      ceilings_window: ideal removal in each further window, by its name.
      result: the time series; None unless they are kept.
      warnings: warnings of the run.
    """

    numbers: Mapping[str, Mapping[str, float]]
    spectra: Mapping[str, PowerSpectrum] = field(repr=False)
    ceilings: tuple[IdealRemoval, IdealRemoval]
    moment: Float = field(repr=False)
    ceilings_window: Mapping[str, tuple[IdealRemoval, IdealRemoval]]
    result: Result | None = field(default=None, repr=False)
    warnings: tuple[str, ...] = ()


WHOLE = "whole"
"""Name of the window after the initial transient."""


@dataclass(frozen=True, repr=False)
class Comparison(Brief):
    """Control schemes in the same wind fields.

    Attributes:
      schemes: names of the schemes; the first is the reference of changes.
      winds: labels of the winds, one for each seed.
      seeds: seeds of the winds; None for a wind without one.
      runs: ``runs[scheme][k]`` is the evaluation in wind k; the first one contains the time series.
      windows: [s] begin and end of each window, by name; ``whole`` is the time after the transient.
      quantities: evaluated quantities.
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

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} runs failed" if self.failures else ""
        return f"<Comparison of {', '.join(self.schemes)} in {len(self.winds)} winds{failed}>"

    def card(self) -> Card:
        """Loads of the schemes, and their changes against the first."""
        from meltemi.reports.ensemble_tables import scheme_rows

        begin, end = self.windows[WHOLE]
        facts = [("schemes", ", ".join(self.schemes)), ("winds", str(len(self.winds)))]
        facts.append(("evaluated", f"{begin:g} to {end:g} s"))
        head, rows, groups = scheme_rows(self.table(), self.units(), means=True)
        spanned = [name for name, span in groups for _ in range(span)]
        head = [f"{scheme} {name}".strip() for scheme, name in zip(spanned, head, strict=True)]
        sections = [Fold("Loads", rows, head, note=f"changes are against {self.schemes[0]}", open=True)]
        sections.append(Fold("Winds", [[label] for label in self.winds], ["wind"], note=str(len(self.winds))))
        if warnings := self.warnings():
            sections.append(Fold("Messages", [[words] for words in warnings], [""], open=True))
        if self.failures:
            facts.append(("excluded", badge(f"{len(self.failures)} runs", "bad")))
            sections.append(Fold("Excluded", [[failure_line(each)] for each in self.failures], [""]))
        return Card("Comparison", f"{len(self.schemes)} control schemes in the same wind fields", facts, sections)

    def values(self, quantity: str, scheme: str, window: str = WHOLE) -> Float:
        """(seeds,) values of a quantity in SI."""
        return np.array([run.numbers[window][quantity] for run in self.runs[scheme]])

    def table(self, window: str = WHOLE, *, confidence: float = 0.95) -> EnsembleTable:
        """Means over seeds, changes by seed, confidence intervals, equivalent loads of the ensemble."""
        numbers = {
            k: {scheme: self.runs[scheme][k].numbers[window] for scheme in self.schemes} for k in range(len(self.winds))
        }
        slopes = {q.name: q.slope for q in self.quantities if q.slope is not None}
        return ensemble_table(numbers, slopes, confidence=confidence)

    def units(self) -> dict[str, tuple[str, float]]:
        """Engineering unit and factor from SI by quantity, for ``ensemble_rows``."""
        return {q.name: (q.unit, q.factor) for q in self.quantities}

    def spectrum(self, channel: str, scheme: str) -> PowerSpectrum:
        """Mean power spectral density of a channel over the seeds.

        Raises:
          InputError: the channel has no spectra.
        """
        kept = {find(name, standard()).name: name for name in SPECTRA}
        name = find(channel, standard()).name
        if name not in kept:
            raise InputError(f"spectrum of {channel!r}: there are those of {' and '.join(SPECTRA)}")
        return average_spectra([run.spectra[kept[name]] for run in self.runs[scheme]])

    def ceiling_change(self, harmonics: int, quantity: Literal["std", "load"], window: str = WHOLE) -> MeanEstimate:
        """Change of RootMyc1 of the first scheme when 1P (``harmonics`` 1), or 1P and 2P (2), are removed ideally."""
        return self._ceiling(harmonics, f"{quantity}_change", window)

    def ceiling_left(self, harmonics: int, quantity: Literal["std", "load"], window: str = WHOLE) -> MeanEstimate:
        """RootMyc1 [N m] after that removal, mean over seeds."""
        return self._ceiling(harmonics, f"{quantity}_left", window)

    def _ceiling(self, harmonics: int, attribute: str, window: str) -> MeanEstimate:
        runs = self.runs[self.schemes[0]]
        ceilings = [run.ceilings if window == WHOLE else run.ceilings_window[window] for run in runs]
        return mean_interval([getattr(pair[harmonics - 1], attribute) for pair in ceilings])

    def warnings(self) -> list[str]:
        """Warnings of the runs, one line per scheme."""
        lines = []
        for scheme, runs in self.runs.items():
            warned = [run.warnings for run in runs if run.warnings]
            if warned:
                lines.append(f"scheme {scheme!r} in {len(warned)} of {len(runs)} winds: {'; '.join(warned[0])}")
        return lines

    def rotor_frequency(self) -> float:
        """[Hz] rotor frequency of the first scheme in the first wind, after the transient."""
        return rotor_frequency(self.results(self.schemes[0]).between(*self.windows[WHOLE]))

    def results(self, scheme: str) -> Result:
        """Time series in the first wind."""
        result = self.runs[scheme][0].result
        assert result is not None
        return result


def compare(  # noqa: PLR0913 - options of a study, each with a default
    model: BladedModel,
    controllers: Mapping[str, Controller | Callable[[Wind], Controller]],
    winds: Sequence[AnyWind],
    *,
    duration: float = 700.0,
    transient: float = TRANSIENT,
    windows: Mapping[str, tuple[float, float]] | None = None,
    grid: PowerGrid | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Simulate every controller in every wind, and evaluate the runs.

    Args:
      model: model of the turbine, with all actuators that a controller moves.
      controllers: controllers by name, or functions from a wind to a controller; the first is the reference of changes.
      winds: one for each seed.
      duration: [s] duration of each run.
      transient: [s] initial transient, excluded from the evaluation.
      windows: [s] further evaluated parts, by name.
      grid: grid with a power reference that all controllers follow.
      workers: number of threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: there is nothing to compare, the windows do not fit, or all schemes failed in each wind.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    if not controllers or not winds:
        raise InputError("compare: at least one controller and one wind are needed")
    check_duration(duration, transient)
    judged = {WHOLE: (transient, duration), **(windows or {})}
    for name, (begin, end) in judged.items():
        if not 0.0 <= begin < end <= duration:
            raise InputError(f"compare: window {name!r} from {begin:g} to {end:g} s does not fit in {duration:g} s")
    quantities = QUANTITIES
    if grid is not None and grid.power_reference is not None:
        quantities = (*QUANTITIES, TRACKING)
    reduce = _Reducer(judged, quantities, len(controllers))
    cases, total = _cases(model, controllers, winds, duration, grid), len(controllers) * len(winds)
    outcomes = resumed(cases, reduce=reduce, workers=workers, progress=progress, total=total)
    return _comparison(outcomes, tuple(controllers), winds, judged, quantities)


class _Reducer:
    """Summaries of results; only those of the first wind in which no scheme fails have series.

    That wind may not be the first of all.
    """

    def __init__(
        self, windows: Mapping[str, tuple[float, float]], quantities: Sequence[Quantity], schemes: int
    ) -> None:
        self.windows, self.quantities, self.schemes = windows, quantities, schemes
        self.done: dict[int, int] = {}
        self.lock = threading.Lock()

    def __call__(self, result: Result) -> RunSummary:
        k = int(str(result.meta["case"]).partition(":")[0])
        keep = not any(j < k and self.done[j] == self.schemes for j in list(self.done))
        summary = _summary(result, self.windows, self.quantities, keep)
        with self.lock:
            self.done[k] = self.done.get(k, 0) + 1
        return summary


def _comparison(
    outcomes: Sequence[Outcome],
    names: Sequence[str],
    winds: Sequence[AnyWind],
    windows: Mapping[str, tuple[float, float]],
    quantities: tuple[Quantity, ...],
) -> Comparison:
    """The comparison of the schemes and winds in which no run failed."""
    by_name = {outcome.name: outcome for outcome in outcomes}
    failures = tuple(outcome for outcome in outcomes if not outcome.ok)
    for failure in failures:
        current().enter(failure_line(failure), failure.message)
    # a scheme that fails in every wind takes no other with it
    schemes = [s for s in names if any(by_name[f"{k}:{s}"].ok for k in range(len(winds)))]
    whole = [k for k in range(len(winds)) if schemes and all(by_name[f"{k}:{s}"].ok for s in schemes)]
    if not whole:
        first = f"; first of {len(failures)} failures: {failure_line(failures[0])}" if failures else ""
        raise InputError(f"compare: in no wind did all schemes reach the end of their runs{first}")

    def summary(k: int, scheme: str) -> RunSummary:  # with the series in the first wind only
        value: RunSummary = by_name[f"{k}:{scheme}"].value
        return value if k == whole[0] else replace(value, result=None)

    return Comparison(
        schemes=tuple(schemes),
        winds=tuple(winds[k].label for k in whole),
        seeds=tuple(getattr(winds[k], "seed", None) for k in whole),
        runs={s: tuple(summary(k, s) for k in whole) for s in schemes},
        windows=windows,
        quantities=quantities,
        failures=failures,
    )


def check_duration(duration: float, transient: float) -> None:
    """Check that enough of a run is left after the initial transient.

    Raises:
      InputError: less than ``SHORTEST`` is left.
    """
    if not 0.0 <= transient < duration:
        raise InputError(f"compare: transient {transient:g} s must lie below the duration {duration:g} s")
    if duration - transient < SHORTEST:
        raise InputError(
            f"compare: {duration - transient:g} s are left after the transient of {transient:g} s; "
            f"at least {SHORTEST:g} s are needed"
        )


def failure_line(outcome: Outcome) -> str:
    """Message with the scheme that failed, its wind, counted from 1, and the reason."""
    k, _, scheme = outcome.name.partition(":")
    return f"scheme {scheme!r} in wind {int(k) + 1}: {outcome.message}"


class SharedField:
    """A wind field that is generated for the first run that needs it and released after the last one."""

    def __init__(self, wind: AnyWind, model: BladedModel, duration: float, takers: int) -> None:
        self.wind, self.model, self.duration, self.left = wind, model, duration, takers
        self.field: Wind | None = None
        self.lock = threading.Lock()

    def content_hash(self) -> str:
        """Hash of the wind."""
        return self.wind.content_hash()

    def __call__(self) -> Wind:
        with self.lock:
            wind = self.field or realised(self.wind, self.model.turbine, self.duration)
            self.left -= 1
            self.field = wind if self.left else None
            return wind


def _cases(
    model: BladedModel,
    controllers: Mapping[str, Controller | Callable[[Wind], Controller]],
    winds: Sequence[AnyWind],
    duration: float,
    grid: PowerGrid | None,
) -> Iterator[Run]:
    flaps = [f"flap_{j + 1}_angle_{b + 1}" for j in range(model.n_flaps) for b in range(model.n_blades)]
    channels = [name for name in CHANNELS if not (name[-1] == "3" and model.n_blades < 3)] + flaps
    if grid is not None and grid.power_reference is not None:
        channels.append("power_reference")
    given: dict[str, Any] = {"duration": duration, "channels": channels, "grid": grid}
    for k, wind in enumerate(winds):
        shared = SharedField(wind, model, duration, len(controllers))
        for scheme, controller in controllers.items():
            yield Run(model, shared, controller=controller, name=f"{k}:{scheme}", **given)


def _summary(
    result: Result, windows: Mapping[str, tuple[float, float]], quantities: Sequence[Quantity], keep: bool
) -> RunSummary:
    parts = {name: result.between(begin, end) for name, (begin, end) in windows.items()}
    numbers = {name: {q.name: q.of(part) for q in quantities} for name, part in parts.items()}
    whole = parts[WHOLE]
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
