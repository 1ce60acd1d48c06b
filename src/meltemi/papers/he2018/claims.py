"""Claims of the paper against our results.

Nothing is tuned to the paper. Its numbers are those of one minute of one seed, and are judged by the single minutes of
all our seeds; directions by the means over seeds. Neither the model of its turbine nor the edition of its wind is
certain, so a claim has a verdict in each reading of both. ``reasons`` says why a number differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import acos, nan, pi, sin, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from meltemi.papers.claim import UNCHECKED, UNJUDGED, Claim, by_reading, claim_group, enough, reasons_of, rows_of
from meltemi.papers.he2018.designs import ADDED, WHOLE_LEAD
from meltemi.papers.he2018.runs import (
    CALM,
    CLASS_B,
    EDITION_2,
    FAST,
    FAST_MODEL,
    FULL,
    HALF,
    LESS,
    MODEL_PARTS,
    PAPER,
    SHORT,
    SPEED,
    THREE,
    LoadControlRuns,
)
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.spectra import decibels, spectral_peak
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.tuning.compare import WHOLE, Comparison
from meltemi.turbine.flaps import naca64618_flap

Float = NDArray[np.float64]
Stated = Mapping[str, str]
"""A row of ``claims.csv``."""

PEAK_WIDTH = 0.04
"""[Hz] half-width in which a peak is sought: twice the resolution of the spectra."""
EDGEWISE = (0.95, 1.3)
"""[Hz] of the first edgewise mode."""
LEAST_P = 0.05
"""Two-sided probability from which one more minute of ours may be the paper's."""
FEWEST_MINUTES = 40
"""Below which no probability would be below ``LEAST_P``."""
FEW = 3
"""Minutes as far as the paper's up to which a claim is said to hold by few."""
BY_FEW = ": holds by few"
"""What is said then."""
TABLE_1_PITCH = 17.47
"""[deg] of NREL's report at 20 m/s."""
TABLE_1_WITHIN = 0.1
"""[deg]."""
EACH = " / "
"""Between verdicts in several readings, in their order."""


def change(c: Comparison, quantity: str, scheme: str, window: str = WHOLE, base: str = "cpc") -> Float:
    """(seeds,) change [%] of the magnitude of a quantity relative to another scheme."""
    a, b = (np.abs(c.values(quantity, name, window)) for name in (scheme, base))
    return np.asarray(100.0 * (a / b - 1.0))


def percent(values: Float) -> str:
    """Mean of changes and half-width of its 95 % confidence interval."""
    return f"{with_interval(mean_interval(values), 3 if np.abs(values).max() < 0.1 else 1, '+')} %"


def harmonic_amplitude(result: Result, channel: str, harmonic: int) -> float:
    """Half the mean peak-to-peak value of a channel's harmonic of the azimuth, in its unit."""
    psi = harmonic * result["azimuth"]
    x = result[channel] - result[channel].mean()
    return float(np.hypot(2.0 * np.mean(x * np.cos(psi)), 2.0 * np.mean(x * np.sin(psi))))


def edgewise(c: Comparison, scheme: str) -> float:
    """[N m] standard deviation of RootMxc1 at the first edgewise mode, over all seeds."""
    s = c.spectrum("RootMxc1", scheme)
    inside = (s.frequency >= EDGEWISE[0]) & (s.frequency <= EDGEWISE[1])
    return sqrt(float(s.density[inside].sum()) * s.resolution)


def claims(runs: LoadControlRuns, readings: Mapping[str, Comparison] | None = None) -> list[Claim]:
    """All claims of ``claims.csv``, judged in all readings of model and wind.

    Args:
      runs: all of them.
      readings: the paper's schemes by name of the reading; those of the runs by default.
    """
    found = []
    for stated in rows_of("he2018", "claims.csv").values():
        judge = partial(_judged, runs, readings or runs.judged, stated)
        found += claim_group(stated["item"], stated["where"], judge)
    return found


def not_detuned(readings: Mapping[str, Comparison]) -> dict[str, Comparison]:
    """The readings with flaps beside an IPC that stays as it is in the place of CPFC."""
    return {name: replace(c, runs={**c.runs, "cpfc": c.runs[ADDED]}) for name, c in readings.items()}


def _judged(runs: LoadControlRuns, readings: Mapping[str, Comparison], stated: Stated) -> list[Claim]:
    of, tolerance = KINDS[stated["kind"]]
    if isinstance(of, _Once):
        ours, verdict = of.judge(runs, stated)
    else:
        found = {name: of(c, stated) for name, c in readings.items()}
        ours = "; ".join(f"{name}: {text}" for name, (text, _) in found.items())
        verdict = by_reading({name: str(enough(len(runs.setup.seeds), v)) for name, (_, v) in found.items()})
        if stated["why"]:
            verdict = UNCHECKED + f"because {stated['why']}"
    plain = verdict == "holds" and stated["basis"] != "command"
    names = ("item", "paper", "where", "basis", "reason")
    words = {name: stated[name] for name in names} | ({"reason": ""} if plain else {})
    return [Claim(**words, ours=ours, verdict=verdict, tolerance=tolerance)]  # type: ignore[arg-type]


def in_readings(claim: Claim, readings: Sequence[str]) -> list[str]:
    """Verdicts of a claim in each of the readings."""
    parts = claim.verdict.split(EACH)
    if len(parts) == 1:
        return parts * len(readings)
    return [part.removesuffix(f" ({reading})") for part, reading in zip(parts, readings, strict=True)]


Kind = Callable[[Comparison, Stated], tuple[str, str]]
"""Ours and the verdict in a reading of model and wind."""


@dataclass(frozen=True)
class _Once:
    """What needs no runs in turbulence: ours and the verdict."""

    judge: Callable[[LoadControlRuns, Stated], tuple[str, str]]


def _change(c: Comparison, stated: Stated, window: str = WHOLE) -> Float:
    """(seeds,) [%]."""
    scheme, _, base = stated["scheme"].partition("/")
    return change(c, stated["quantity"], scheme, window, base or "cpc")


def as_far(c: Comparison, stated: Stated) -> tuple[Float, int, float]:
    """(minutes,) changes [%], how many of them lie as far as the paper's, and the two-sided probability."""
    x, paper = np.ravel([_change(c, stated, name) for name in minutes(c)]), float(stated["paper"].removesuffix(" %"))
    within = int(min(np.sum(x <= paper), np.sum(x >= paper)))
    return x, within, min(2.0 * within / len(x), 1.0)


def _near(c: Comparison, stated: Stated) -> tuple[str, str]:
    x, within, p = as_far(c, stated)
    low, high = np.percentile(x, [5.0, 95.0])
    ours = f"{percent(_change(c, stated))}; 5 to 95 % of minutes {low:+.1f} to {high:+.1f} %, "
    ours += f"{within} of {len(x)} as far (p = {p:.2g})" if within else f"none of {len(x)} as far"
    if len(x) < FEWEST_MINUTES:
        return ours, f"{UNJUDGED}it needs {FEWEST_MINUTES} minutes, there are {len(x)}"
    if p < LEAST_P:
        smaller = abs(x.mean()) < abs(float(stated["paper"].removesuffix(" %")))
        return ours, "smaller effect" if smaller else "larger effect"
    return f"{ours}{BY_FEW}" if within <= FEW else ours, "holds"


def minutes(c: Comparison) -> list[str]:
    """Windows of a minute, one after the other."""
    return [name for name in c.windows if name not in (WHOLE, PAPER)]


def _falls(c: Comparison, stated: Stated) -> tuple[str, str]:
    values = _change(c, stated)
    e = mean_interval(values)
    return percent(values), "holds" if e.high < 0.0 else "falls in the mean only" if e.mean < 0.0 else "does not fall"


def _raised(c: Comparison, stated: Stated) -> tuple[str, str]:
    n, f = int(stated["quantity"]), c.rotor_frequency()
    with_ipc, without = (
        np.array([spectral_peak(run.spectra["RootMyc1"], n * f, PEAK_WIDTH).density for run in c.runs[scheme]])
        for scheme in (stated["scheme"], "cpc")
    )
    e = mean_interval(10.0 * np.log10(with_ipc / without))
    verdict = "holds" if e.low > 0.0 else "rises in the mean only" if e.mean > 0.0 else "does not rise"
    return f"{with_interval(e, 1, '+')} dB", verdict


def _feedforward(c: Comparison, stated: Stated) -> tuple[str, str]:
    found = {
        "alone": change(c, stated["quantity"], "feedforward"),
        "beside the feedback": change(c, stated["quantity"], "ipc", base="feedback"),
    }
    falls = [name for name, values in found.items() if mean_interval(values).high < 0.0]
    verdict = {0: "does not fall", 1: f"falls {falls[0]} only" if falls else ""}.get(len(falls), "holds")
    return ", ".join(f"{name} {percent(values)}" for name, values in found.items()), verdict


def _beside(c: Comparison, stated: Stated) -> tuple[str, str]:
    tuned, as_it_is = (percent(change(c, stated["quantity"], s, base="ipc")) for s in ("cpfc", ADDED))
    return f"{tuned}; beside an IPC that stays as it is {as_it_is}", ""


def _travel(c: Comparison, stated: Stated) -> tuple[str, str]:
    ratio, swing = c.values("pitch travel", stated["scheme"]) / c.values("pitch travel", "cpc"), THREE[1:]
    each = ", ".join(f"{s.upper()} {np.degrees(c.values('pitch travel', s).mean()):.2f}" for s in swing)
    return f"{with_interval(mean_interval(ratio), 1)} times that of CPC ({each} deg/s)", ""


def _unnoticed(c: Comparison, stated: Stated) -> tuple[str, str]:
    values = _change(c, stated)
    base = c.values(stated["quantity"], stated["scheme"].partition("/")[2] or "cpc")
    scatter = 100.0 * float(base.std(ddof=1) / base.mean()) if len(base) > 1 else 0.0
    ours = f"{percent(values)} (scatter {scatter:.{3 if scatter < 0.1 else 1}f} %)"
    return ours, "holds" if abs(values.mean()) <= scatter else "differs"


def _order(c: Comparison, stated: Stated) -> tuple[str, str]:
    cpc, ipc, cpfc = (c.values(stated["quantity"], scheme) for scheme in THREE)
    in_order = (cpfc < ipc) & (ipc < cpc)
    return f"in {in_order.sum()} of {len(cpc)} seeds", "holds" if in_order.all() else "not in every seed"


def _peak(c: Comparison, stated: Stated) -> tuple[str, str]:
    n = int(stated["quantity"])
    before, after = (above_neighbours(c, scheme, n) for scheme in ("cpc", stated["scheme"]))
    verdict = "holds" if after <= 0.0 else "reduced" if after < before else "does not fall"
    return f"{before:+.1f} dB with CPC, {after:+.1f} dB left", verdict


def above_neighbours(c: Comparison, scheme: str, harmonic: int) -> float:
    """[dB] peak of RootMyc1 at a multiple of the rotor frequency above the mean level half a one to either side."""
    spectrum, f = c.spectrum("RootMyc1", scheme), c.rotor_frequency()
    low, peak, high = (spectral_peak(spectrum, (harmonic + k) * f, PEAK_WIDTH).density for k in (-0.5, 0.0, 0.5))
    return decibels(peak, sqrt(low * high))


def _pitch(c: Comparison, stated: Stated) -> tuple[str, str]:
    ipc, cpc = (c.results(scheme).between(*c.windows[WHOLE]) for scheme in ("ipc", "cpc"))
    share = share_at(ipc["pitch_1"] - cpc["pitch_1"], ipc.time, c.rotor_frequency())
    size, offset = np.degrees([harmonic_amplitude(ipc, "pitch_1", 1), ipc["pitch_1"].mean() - cpc["pitch_1"].mean()])
    return f"{100 * share:.0f} % at 1P, {size:.2f} deg, mean {offset:+.2f} deg", "holds" if share > 0.5 else "differs"


def _flaps(c: Comparison, stated: Stated) -> tuple[str, str]:
    part = c.results("cpfc").between(*c.windows[WHOLE])
    x = part["flap_1_angle_1"]
    share = share_at(x, part.time, 2.0 * c.rotor_frequency(), 0.25)
    largest = np.degrees(np.abs(x).max())
    return f"{100 * share:.0f} % at 2P, at most {largest:.1f} deg", "holds" if share > 0.5 else "differs"


def share_at(x: Float, time: Float, frequency: float, half_width: float = 0.5) -> float:
    """Share of the variance within ``half_width`` times a frequency [Hz] of it."""
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2
    distance = np.abs(np.fft.rfftfreq(len(x), float(time[1] - time[0])) - frequency)
    return float(power[distance < half_width * frequency].sum() / max(power.sum(), 1e-300))


def _absolute(runs: LoadControlRuns, stated: Stated) -> tuple[str, str]:
    c = runs.readings[CLASS_B]
    units = {q.name: (q.unit, q.factor) for q in c.quantities}
    told = []
    for name in stated["quantity"].split(";"):
        unit, factor = units[name]
        told.append(
            ", ".join(f"{s.upper()} {factor * float(c.values(name, s).mean()):.4g}" for s in THREE) + f" {unit}"
        )
    return "; ".join(told) + f" ({CLASS_B})", UNCHECKED + f"because {stated['why']}"


def _turbine(runs: LoadControlRuns, stated: Stated) -> tuple[str, str]:
    turbine = runs.bench.model.turbine
    models = {FAST: build(turbine, FAST_MODEL), FULL: runs.bench.model}
    pitch = {name: float(np.degrees(operating_point(model, SPEED).pitch)) for name, model in models.items()}
    ours = ", ".join(f"{name} {angle:.2f} deg" for name, angle in pitch.items())
    near = {model: "holds" if abs(x - TABLE_1_PITCH) <= TABLE_1_WITHIN else "differs" for model, x in pitch.items()}
    return ours, by_reading({name: near[name.partition(",")[0]] for name in runs.judged})


def thin_airfoil(chord_fraction: float) -> tuple[float, float]:
    """Lift and moment about the quarter chord [1/rad] that a plain flap adds (Glauert 1927; Katz, Plotkin 2001, 5.4).

    Args:
      chord_fraction: length of the flap over the chord.
    """
    hinge = acos(2.0 * chord_fraction - 1.0)
    return 2.0 * (pi - hinge + sin(hinge)), -0.5 * sin(hinge) * (1.0 - (2.0 * chord_fraction - 1.0))


def flap_slopes() -> tuple[float, float]:
    """Lift and moment [1/rad] of the increments in use, at zero angle of attack, from the smallest deflections."""
    table = naca64618_flap().increments
    zero = int(np.argmin(np.abs(table.deflection)))
    sides = table.deflection[zero + 1] - table.deflection[zero - 1]
    row = int(np.argmin(np.abs(table.angle_of_attack)))
    lift = table.lift[row, zero + 1] - table.lift[row, zero - 1]
    moment = table.moment[zero + 1] - table.moment[zero - 1]
    return float(lift / sides), float(moment / sides)


def _flap(runs: LoadControlRuns, stated: Stated) -> tuple[str, str]:
    (lift, moment), (ideal, ideal_moment) = flap_slopes(), thin_airfoil(naca64618_flap().chord_fraction)
    ours = (
        f"{lift * pi / 180:.4f} per deg, {lift / ideal:.2f} of thin-airfoil theory ({ideal * pi / 180:.4f}); moment "
        f"{moment * pi / 180:.4f}, {moment / ideal_moment:.2f} of it"
    )
    return ours, "holds" if 0.0 < lift < ideal else "differs"


KINDS: Mapping[str, tuple[Kind | _Once, str]] = {
    "near": (_near, f"two-sided p of at least {LEAST_P:g} among the single minutes of all seeds"),
    "raised": (_raised, "95 % interval of our mean over seeds, above zero"),
    "feedforward": (_feedforward, "95 % intervals of our means over seeds, below zero"),
    "travel": (_travel, ""),
    "beside": (_beside, ""),
    "falls": (_falls, "95 % interval of our mean over seeds, below zero"),
    "unnoticed": (_unnoticed, "standard deviation of the reference's own value over seeds"),
    "order": (_order, "in every seed"),
    "peak": (_peak, "no higher than midway to its neighbours"),
    "pitch": (_pitch, "more than half of the variance"),
    "flaps": (_flaps, "more than half of the variance"),
    "absolute": (_Once(_absolute), ""),
    "turbine": (_Once(_turbine), f"{TABLE_1_WITHIN:g} deg"),
    "flap slope": (_Once(_flap), "none: a limit"),
}
"""What judges a claim, and the tolerance."""


CEILINGS = {"ipc": 1, "cpfc": 2}
"""Multiples of the rotor speed up to which the ideal removal goes that a scheme is compared with."""


def reached(c: Comparison, scheme: str, quantity: Literal["std", "load"]) -> MeanEstimate:
    """Change of RootMyc1 by a scheme over that by ideal removal of its harmonics, formed for each seed."""
    name = {"std": "RootMyc1 std", "load": "RootMyc1 DEL"}[quantity]
    removed = [getattr(run.ceilings[CEILINGS[scheme] - 1], f"{quantity}_change") for run in c.runs["cpc"]]
    return mean_interval(change(c, name, scheme) / (100.0 * np.array(removed)))


def reasons(runs: LoadControlRuns) -> dict[str, str]:
    """Reasons for differences, by key, each with the experiment that shows it."""
    c = runs.readings[CLASS_B]
    calm, less = ({FAST: runs.study(f"{FAST}, {name}"), FULL: runs.study(name)} for name in (CALM, LESS))
    loops = {scheme: runs.bench.loops(scheme)[0] for scheme in THREE[1:]}
    parts = {**{name: runs.study(name) for name in MODEL_PARTS}, "with all three": runs.fast[CLASS_B]}
    over = partial(change, quantity="RootMyc1 std", scheme="cpfc", base="ipc")
    second = {name: x for name, x in runs.judged.items() if name.endswith(SHORT[EDITION_2])}
    words = {
        "shares": _each(runs.judged, lambda c: f"{share_of_harmonics(c):.0f} %"),
        "asked": f"{100.0 * (1.0 - (1.0 - 0.553) ** 2):.0f}",
        "less": _each(less, lambda c: ", ".join(_change_and_p(c, row) for row in STATED_MYC)),
        "over": percent(over(c)),
        "parts": ", ".join(
            f"{with_interval(mean_interval(over(x) - over(c)), 1, '+')} percentage points {name}"
            for name, x in parts.items()
        ),
        "second": _each(second, lambda c: f"{percent(over(c, quantity='RootMyc1 DEL'))} and {percent(over(c))}"),
        "edge": _each({FAST: runs.fast[CLASS_B], FULL: c}, _edge),
        "whole": percent(change(c, "RootMxc1 DEL", WHOLE_LEAD)),
        "likely": _each(runs.judged, likelihood),
        "factor": f"{loops['cpfc'].integral_gain / loops['ipc'].integral_gain:.2f}",
        "half": _each(runs.judged, lambda c: percent(change(c, "RootMyc1 DEL", HALF))),
        "calm": _each(calm, lambda c: _alone(c, "feedforward")),
        "calm_half": _each(calm, lambda c: _alone(c, HALF)),
    }
    return {key: text.format(**words) for key, text in reasons_of("he2018").items()}


def _each(found: Mapping[str, Comparison], told: Callable[[Comparison], str]) -> str:
    return "; ".join(f"{name}: {told(c)}" for name, c in found.items())


def _change_and_p(c: Comparison, stated: Stated) -> str:
    x, within, _ = as_far(c, stated)
    what = f"{stated['quantity'].split()[1]} {percent(_change(c, stated))} by {stated['scheme'].upper()}"
    return f"{what} ({within} of {len(x)} minutes as far)"


def _edge(c: Comparison) -> str:
    return ", ".join(f"{edgewise(c, scheme) * 1e-3:.0f} kN m with {scheme.upper()}" for scheme in THREE)


def _alone(c: Comparison, scheme: str) -> str:
    return percent(change(c, "RootMyc1 DEL", scheme))


def share_of_harmonics(c: Comparison) -> float:
    """[%] of the variance of RootMyc1 with CPC in the bands of 1P and 2P."""
    left = np.array([1.0 + run.ceilings[1].std_change for run in c.runs["cpc"]])
    return 100.0 * (1.0 - float(np.mean(left**2)))


STATED_MYC = [rows_of("he2018", "claims.csv")[key] for key in ("1", "2", "24", "25")]
"""Standard deviation and equivalent load of RootMyc1, by IPC and CPFC."""
PAPER_CHANGES = [
    (row["quantity"], row["scheme"], float(row["paper"].removesuffix(" %")))
    for row in rows_of("he2018", "claims.csv").values()
    if row["kind"] == "near" and row["basis"] == "paper" and not row["quantity"].endswith("mean")
]
"""Quantity, scheme and change [%] of the paper's standard deviations and equivalent loads."""


def in_minutes(c: Comparison) -> tuple[Float, Float]:
    """(windows,) [s] begin of the minutes, and (windows seeds, 8) changes [%] in each."""
    begins = {name: c.windows[name][0] for name in minutes(c)}
    x = [np.ravel([change(c, quantity, scheme, w) for w in begins]) for quantity, scheme, _ in PAPER_CHANGES]
    return np.array(list(begins.values())), np.transpose(x)


def probability(c: Comparison) -> float:
    """Probability that one more minute lies as far from the mean of all minutes as the paper's, by Hotelling's T^2.

    The changes are the paper's of standard deviations and equivalent loads together. NaN with too few minutes.

    Reference: Anderson (2003), An Introduction to Multivariate Statistical Analysis, section 5.2.
    """
    x = in_minutes(c)[1].T
    p, n = x.shape
    if n <= p:
        return nan
    off = np.array([paper for *_, paper in PAPER_CHANGES]) - x.mean(axis=1)
    distance = n / (n + 1.0) * float(off @ np.linalg.solve(np.cov(x), off))
    return float(f.sf(distance * (n - p) / (p * (n - 1.0)), p, n - p))


def likelihood(c: Comparison) -> str:
    """The probability in words."""
    p = probability(c)
    return "unknown" if np.isnan(p) else f"{p:.2f}"
