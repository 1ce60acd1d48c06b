"""Claims of the paper against our results: over all seeds, and in the time window of its figures.

Nothing is tuned to the paper. A verdict compares a number with the paper's within a tolerance, or a direction with its
sign; ``reasons`` says why a number differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.spectra import decibels, spectral_peak
from meltemi.simulation.result import Result
from meltemi.studies.compare import WHOLE, Comparison
from meltemi.studies.run_store import guarded
from meltemi_papers.claim import UNJUDGED, reasons_of, rows_of
from meltemi_papers.he2018.runs import PAPER, Runs

Float = NDArray[np.float64]

PEAK_WIDTH = 0.04
"""[Hz] half-width in which a peak is sought: twice the resolution of the spectra."""


@dataclass(frozen=True)
class Row:
    """A claim of the paper and our result.

    Attributes:
      quantity: what it is about.
      scheme: of control.
      paper: what the paper says.
      ours: by reading of the wind, over all seeds and in the paper's window.
      verdict: by reading of the wind.
      reason: key of ``reasons``; empty if there is nothing to explain.
      where: in the paper.
    """

    quantity: str
    scheme: str
    paper: str
    ours: tuple[tuple[str, str], ...]
    verdict: tuple[str, ...]
    reason: str
    where: str


@dataclass(frozen=True)
class Acceptance:
    """A condition that must hold in every seed.

    Attributes:
      condition: in words.
      held: by reading, in how many seeds of how many.
      numbers: by reading, of the seed that comes nearest to breaking it.
    """

    condition: str
    held: tuple[tuple[int, int], ...]
    numbers: tuple[str, ...]

    @property
    def everywhere(self) -> bool:
        """The condition holds in every seed of every reading."""
        return all(held == of > 0 for held, of in self.held)


def change(c: Comparison, quantity: str, scheme: str, window: str = WHOLE, base: str = "cpc") -> Float:
    """(seeds,) change [%] of the magnitude of a quantity relative to another scheme."""
    a, b = (np.abs(c.values(quantity, name, window)) for name in (scheme, base))
    return np.asarray(100.0 * (a / b - 1.0))


def percent(values: Float) -> str:
    """Mean of changes and half-width of its 95 % confidence interval."""
    e = mean_interval(values)
    return f"{e.mean:+.1f}" + (f" ± {e.half_width:.1f}" if e.n > 1 else "") + " %"


def peak_change(c: Comparison, scheme: str, harmonic: int, seed: int | None = None) -> float:
    """[dB] change of the peak of RootMyc1 at a multiple of the rotor frequency, relative to CPC."""
    f = harmonic * c.rotor_frequency()
    both = [
        c.spectrum("RootMyc1", name) if seed is None else c.runs[name][seed].spectra["RootMyc1"]
        for name in (scheme, "cpc")
    ]
    ours, base = (spectral_peak(spectrum, f, PEAK_WIDTH) for spectrum in both)
    return decibels(ours.density, base.density)


def harmonic_amplitude(result: Result, channel: str, harmonic: int) -> float:
    """Half the mean peak-to-peak value of a channel's harmonic of the azimuth, in its unit."""
    psi = harmonic * result["azimuth"]
    x = result[channel] - result[channel].mean()
    return float(np.hypot(2.0 * np.mean(x * np.cos(psi)), 2.0 * np.mean(x * np.sin(psi))))


Measure = Callable[[Comparison, str], str]
"""Words for a comparison and the name of a window."""
Judge = Callable[[Comparison], str]


def claims(runs: Runs) -> list[Row]:
    """All claims of ``claims.csv``; ``limit`` is a tolerance or an allowed value."""
    rows: list[Row] = []
    for stated in rows_of("he2018", "claims.csv").values():
        of, judge = KINDS[stated["kind"]](stated["quantity"], stated["scheme"], stated["paper"], stated["limit"])

        def one(c: Comparison, of: Measure = of, judge: Judge = judge) -> tuple[tuple[str, str], str]:
            return (of(c, WHOLE), of(c, PAPER)), judge(c)

        found = [guarded(partial(one, c), lambda why: (("", ""), UNJUDGED + why)) for c in runs.readings.values()]
        ours, verdicts = zip(*found, strict=True)
        words = [stated[name] for name in ("reason", "where")]
        rows.append(Row(stated["item"], stated["scheme"].upper(), stated["paper"], ours, verdicts, *words))
    return rows


def _changes(name: str, scheme: str, base: str = "cpc") -> Measure:
    def words(c: Comparison, window: str) -> str:
        values = change(c, name, scheme, window, base)
        return f"{float(values.mean()):+.3f} %" if np.abs(values).max() < 0.1 else percent(values)

    return words


def _near(name: str, scheme: str, paper: float, tolerance: float, base: str = "cpc") -> Judge:
    def judge(c: Comparison) -> str:
        mean = float(change(c, name, scheme, base=base).mean())
        if abs(mean - paper) <= tolerance:
            return "holds"
        return "smaller effect" if mean > paper else "larger effect"

    return judge


def _falls(name: str, scheme: str) -> Judge:
    def judge(c: Comparison) -> str:
        e = mean_interval(change(c, name, scheme))
        high = e.high if e.n > 1 else e.mean
        return "holds" if high < 0.0 else ("in the mean" if e.mean < 0.0 else "does not hold")

    return judge


def _by_90(name: str, scheme: str) -> Judge:
    return lambda c: "holds" if change(c, name, scheme).max() <= -90.0 else "smaller effect"


def _within(name: str, scheme: str, most: float) -> Judge:
    return lambda c: "holds" if abs(float(change(c, name, scheme).mean())) <= most else "differs"


def _peaks(scheme: str, harmonic: int) -> Measure:
    # a minute is too short for a spectrum of 0.02 Hz
    return lambda c, window: f"{peak_change(c, scheme, harmonic):+.1f} dB" if window == WHOLE else ""


def _peak_within(scheme: str, harmonic: int, limit: float) -> Judge:
    """A peak must fall to the limit [dB] if that is negative, else stay within it."""

    def judge(c: Comparison) -> str:
        value = peak_change(c, scheme, harmonic)
        if limit > 0.0:
            return "holds" if abs(value) <= limit else "differs"
        return "holds" if value <= limit else "smaller effect"

    return judge


def _pitching(scheme: str) -> Measure:
    def words(c: Comparison, window: str) -> str:
        part = c.results(scheme).between(*c.windows[window])
        rate = np.degrees(np.abs(np.gradient(part["pitch_1"], part.time)).max())
        return f"{np.degrees(harmonic_amplitude(part, 'pitch_1', 1)):.2f} deg, at most {rate:.1f} deg/s"

    return words


def _two_to_four(scheme: str) -> Judge:
    def judge(c: Comparison) -> str:
        part = c.results(scheme).between(*c.windows[WHOLE])
        return "holds" if 2.0 <= np.degrees(harmonic_amplitude(part, "pitch_1", 1)) <= 4.0 else "differs"

    return judge


def _flapping(c: Comparison, window: str) -> str:
    part = c.results("cpfc").between(*c.windows[window])
    x = np.degrees(part["flap_1_angle_1"])
    rate = float(np.abs(np.gradient(x, part.time)).max())
    return f"{100 * _share_of_2p(c, window):.0f} % at 2P, {x.min():.1f} to {x.max():.1f} deg, at most {rate:.0f} deg/s"


def _mostly_2p(c: Comparison) -> str:
    return "holds" if _share_of_2p(c, WHOLE) > 0.5 else "differs"


def _share_of_2p(c: Comparison, window: str) -> float:
    """Share of the flaps' variance within half a rotor frequency of 2P."""
    part = c.results("cpfc").between(*c.windows[window])
    x = part["flap_1_angle_1"] - part["flap_1_angle_1"].mean()
    power = np.abs(np.fft.rfft(x)) ** 2
    frequency = np.fft.rfftfreq(len(x), float(part.time[1] - part.time[0])) / c.rotor_frequency()
    return float(power[(frequency > 1.5) & (frequency < 2.5)].sum() / max(power.sum(), 1e-300))


def _number(paper: str) -> float:
    return float(paper.removesuffix(" %"))


KINDS: Mapping[str, Callable[[str, str, str, str], tuple[Measure, Judge]]] = {
    "near": lambda name, s, paper, limit: (_changes(name, s), _near(name, s, _number(paper), float(limit))),
    "near, over IPC": lambda name, s, paper, limit: (
        _changes(name, s, "ipc"),
        _near(name, s, _number(paper), float(limit), "ipc"),
    ),
    "falls": lambda name, s, *_: (_changes(name, s), _falls(name, s)),
    "by 90 %": lambda name, s, *_: (_changes(name, s), _by_90(name, s)),
    "within": lambda name, s, _, limit: (_changes(name, s), _within(name, s, float(limit))),
    "1P peak": lambda _, s, __, limit: (_peaks(s, 1), _peak_within(s, 1, float(limit))),
    "2P peak": lambda _, s, __, limit: (_peaks(s, 2), _peak_within(s, 2, float(limit))),
    "pitch": lambda _, s, *__: (_pitching(s), _two_to_four(s)),
    "flaps": lambda *_: (_flapping, _mostly_2p),
}
"""What a claim is measured and judged by."""


def acceptances(runs: Runs) -> list[Acceptance]:
    """Conditions that must hold in every seed."""
    found = []

    def each(condition: str, unit: str, margin: Callable[[Comparison], Float]) -> None:
        """``margin`` is positive where the condition holds."""

        def judge(c: Comparison) -> tuple[tuple[int, int], str]:
            m = margin(c)
            return (int((m > 0.0).sum()), len(m)), f"{float(m.min()):+.1f} {unit}"

        all_ = [guarded(partial(judge, c), lambda why: ((0, 0), UNJUDGED + why)) for c in runs.readings.values()]
        held, numbers = zip(*all_, strict=True)
        found.append(Acceptance(condition, held, numbers))

    for name in ("RootMyc1 std", "RootMyc1 DEL", "OoPDefl1 std"):
        each(f"{name}: IPC < CPC", "%", _below(name, "ipc", "cpc"))
        each(f"{name}: CPFC < IPC", "%", _below(name, "cpfc", "ipc"))
    for name in ("Mtilt mean", "Myaw mean"):
        each(f"|{name}| falls by 90 % with IPC", "points", _below(name, "ipc", "cpc", 90.0))
    for scheme, n, decibels_down in (("ipc", 1, 10.0), ("cpfc", 2, 6.0)):
        condition = f"{n}P peak of RootMyc1 falls by {decibels_down:g} dB with {scheme.upper()}"
        each(condition, "dB", _peak_below(scheme, n, decibels_down))
    return found


def _below(name: str, scheme: str, base: str, by: float = 0.0) -> Callable[[Comparison], Float]:
    return lambda c: -by - change(c, name, scheme, base=base)


def _peak_below(scheme: str, harmonic: int, by: float) -> Callable[[Comparison], Float]:
    return lambda c: np.array([-by - peak_change(c, scheme, harmonic, k) for k in range(len(c.winds))])


@dataclass(frozen=True)
class CeilingRow:
    """Reduction by ideal removal of harmonics, and the fraction that a scheme reaches; means over seeds.

    Attributes:
      reading: of the wind.
      scheme: whose share it is.
      removed: harmonics.
      std, load: change [%] of std and DEL of RootMyc1 after ideal removal.
      std_share, load_share: change of the scheme over that, formed for each seed.
      window_std, window_load: ceilings in the paper's window.
    """

    reading: str
    scheme: str
    removed: str
    std: float
    load: float
    std_share: MeanEstimate
    load_share: MeanEstimate
    window_std: float
    window_load: float


def ceilings(runs: Runs) -> list[CeilingRow]:
    """Ceiling of the controlled harmonics, for each reading and scheme."""
    rows = []
    for reading, c in runs.readings.items():
        for scheme, which, removed in (("ipc", 0, "1P"), ("cpfc", 1, "1P and 2P")):
            limits = [run.ceilings[which] for run in c.runs["cpc"]]
            window = [run.ceilings_window[PAPER][which] for run in c.runs["cpc"]]
            std, load = np.array([x.std_change for x in limits]), np.array([x.load_change for x in limits])
            rows.append(
                CeilingRow(
                    reading=reading,
                    scheme=scheme,
                    removed=removed,
                    std=100.0 * float(std.mean()),
                    load=100.0 * float(load.mean()),
                    std_share=mean_interval(change(c, "RootMyc1 std", scheme) / (100.0 * std)),
                    load_share=mean_interval(change(c, "RootMyc1 DEL", scheme) / (100.0 * load)),
                    window_std=100.0 * float(np.mean([x.std_change for x in window])),
                    window_load=100.0 * float(np.mean([x.load_change for x in window])),
                )
            )
    return rows


def reasons(runs: Runs) -> dict[str, str]:
    """Reasons for differences and agreement, by key."""
    held = {}
    for reading, c in runs.readings.items():
        left = np.array([1.0 + run.ceilings[1].std_change for run in c.runs["cpc"]])
        held[reading] = 100.0 * (1.0 - float(np.mean(left**2)))
    shares = " and ".join(f"{share:.0f} % ({reading})" for reading, share in held.items())
    asked = 100.0 * (1.0 - (1.0 - 0.553) ** 2)
    return {key: words.format(asked=asked, shares=shares) for key, words in reasons_of("he2018").items()}


def minutes(runs: Runs, scheme: str, length: float = 60.0, every: float = 10.0) -> Float:
    """Change [%] of the standard deviation of RootMyc1 in each minute of all seeds and readings."""
    found = []
    for c in runs.readings.values():
        result = c.results("cpc")
        dt = float(result.time[1] - result.time[0])
        n, stride = round(length / dt), round(every / dt)
        for ours, base in zip(c.runs[scheme], c.runs["cpc"], strict=True):
            for i in range(0, len(base.moment) - n, stride):
                found.append(100.0 * (ours.moment[i : i + n].std() / base.moment[i : i + n].std() - 1.0))
    return np.array(found)
