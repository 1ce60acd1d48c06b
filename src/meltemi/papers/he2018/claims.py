"""Claims of the paper against our results.

Nothing is tuned to the paper. Its numbers are those of one minute of one seed, and are judged by the single minutes of
all our seeds in the wind of the class; directions by the means over seeds. ``reasons`` says why a number differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import acos, nan, pi, sin, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from meltemi.papers.claim import UNCHECKED, UNJUDGED, Claim, claim_group, enough, reasons_of, rows_of
from meltemi.papers.he2018.designs import ADDED, WHOLE_LEAD
from meltemi.papers.he2018.runs import CLASS_B, FAST_MODEL, PAPER, SPEED, Runs
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
THREE = ("cpc", "ipc", "cpfc")
LEAST_P = 0.05
"""Two-sided probability from which one more minute of ours may be the paper's."""
FEWEST_MINUTES = 40
"""Below which no probability would be below ``LEAST_P``."""
TABLE_1 = (np.radians(17.47), 12.1 * pi / 30.0, 5.297e6)
"""[rad], [rad/s], [W] pitch, rotor speed and shaft power of NREL's report at 20 m/s, and tolerances."""
TABLE_1_WITHIN = (np.radians(0.1), 0.05 * pi / 30.0, 5e3)


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


def claims(runs: Runs) -> list[Claim]:
    """All claims of ``claims.csv``."""
    found = []
    for stated in rows_of("he2018", "claims.csv").values():
        found += claim_group(stated["item"], stated["where"], partial(_judged, runs, stated))
    return found


def _judged(runs: Runs, stated: Stated) -> list[Claim]:
    of, tolerance = KINDS[stated["kind"]]
    if isinstance(of, _Once):
        ours, verdict = of.judge(runs, stated)
    else:
        found = {name: of(c, stated) for name, c in runs.readings.items()}
        ours = "; ".join(f"{text} ({name})" for name, (text, _) in found.items())
        verdict = str(enough(len(runs.setup.seeds), found[CLASS_B][1]))
    names = ("item", "paper", "where", "basis", "reason")
    words = {name: stated[name] for name in names} | ({"reason": ""} if verdict == "holds" else {})
    return [Claim(**words, ours=ours, verdict=verdict, tolerance=tolerance)]  # type: ignore[arg-type]


Kind = Callable[[Comparison, Stated], tuple[str, str]]
"""Ours and the verdict in a reading of the wind."""


@dataclass(frozen=True)
class _Once:
    """What does not depend on the reading of the wind: ours and the verdict."""

    judge: Callable[[Runs, Stated], tuple[str, str]]


def _change(c: Comparison, stated: Stated, window: str = WHOLE) -> Float:
    """(seeds,) [%]."""
    scheme, _, base = stated["scheme"].partition("/")
    return change(c, stated["quantity"], scheme, window, base or "cpc")


def _near(c: Comparison, stated: Stated) -> tuple[str, str]:
    x, paper = np.ravel([_change(c, stated, name) for name in minutes(c)]), float(stated["paper"].removesuffix(" %"))
    within = int(min(np.sum(x <= paper), np.sum(x >= paper)))
    p = min(2.0 * within / len(x), 1.0)
    low, high = np.percentile(x, [5.0, 95.0])
    ours = f"{percent(_change(c, stated))}; minutes {low:+.1f} to {high:+.1f} %, "
    ours += f"p = {p:.2g}" if within else f"none of {len(x)} as far"
    if stated["scheme"] == "cpfc" and ADDED in c.schemes:
        ours += f"; not detuned {percent(change(c, stated['quantity'], ADDED))}"
    if len(x) < FEWEST_MINUTES:
        return ours, f"{UNJUDGED}it needs {FEWEST_MINUTES} minutes, there are {len(x)}"
    effect = "smaller effect" if abs(x.mean()) < abs(paper) else "larger effect"
    return ours, "holds" if p >= LEAST_P else effect


def minutes(c: Comparison) -> list[str]:
    """Windows of a minute, one after the other."""
    return [name for name in c.windows if name not in (WHOLE, PAPER)]


def _falls(c: Comparison, stated: Stated) -> tuple[str, str]:
    values = _change(c, stated)
    e = mean_interval(values)
    return percent(values), "holds" if e.high < 0.0 else "falls in the mean only" if e.mean < 0.0 else "does not fall"


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


def _absolute(runs: Runs, stated: Stated) -> tuple[str, str]:
    c = runs.readings[CLASS_B]
    units = {q.name: (q.unit, q.factor) for q in c.quantities}
    told = []
    for name in stated["quantity"].split(";"):
        unit, factor = units[name]
        told.append(
            ", ".join(f"{s.upper()} {factor * float(c.values(name, s).mean()):.4g}" for s in THREE) + f" {unit}"
        )
    return "; ".join(told) + f" ({CLASS_B})", UNCHECKED + f"because {stated['why']}"


def _turbine(runs: Runs, stated: Stated) -> tuple[str, str]:
    turbine = runs.bench.model.turbine
    point, stiff = (operating_point(m, SPEED) for m in (runs.bench.model, build(turbine, FAST_MODEL)))
    power = stiff.generator_torque * stiff.rotor_speed * turbine.drivetrain.gear_ratio
    off = np.abs(np.subtract((stiff.pitch, stiff.rotor_speed, power), TABLE_1))
    ours = (
        f"blades stiff in torsion as the paper's: {np.degrees(stiff.pitch):.2f} deg, "
        f"{stiff.rotor_speed * 30.0 / pi:.2f} rpm, {power * 1e-6:.3f} MW; ours {np.degrees(point.pitch):.2f} deg"
    )
    return ours, "holds" if np.all(off <= TABLE_1_WITHIN) else "differs"


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


def _flap(runs: Runs, stated: Stated) -> tuple[str, str]:
    (lift, moment), (ideal, ideal_moment) = flap_slopes(), thin_airfoil(naca64618_flap().chord_fraction)
    ours = (
        f"{lift * pi / 180:.4f} per deg, {lift / ideal:.2f} of thin-airfoil theory ({ideal * pi / 180:.4f}); moment "
        f"{moment * pi / 180:.4f}, {moment / ideal_moment:.2f} of it"
    )
    return ours, "holds" if 0.0 < lift < ideal else "differs"


KINDS: Mapping[str, tuple[Kind | _Once, str]] = {
    "near": (_near, f"two-sided p of at least {LEAST_P:g} among the single minutes of all seeds"),
    "falls": (_falls, "95 % interval of our mean over seeds, below zero"),
    "unnoticed": (_unnoticed, "standard deviation of the reference's own value over seeds"),
    "order": (_order, "in every seed"),
    "peak": (_peak, "no higher than midway to its neighbours"),
    "pitch": (_pitch, "more than half of the variance"),
    "flaps": (_flaps, "more than half of the variance"),
    "absolute": (_Once(_absolute), ""),
    "turbine": (_Once(_turbine), "0.1 deg, and the digits of speed and power"),
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


def reasons(runs: Runs) -> dict[str, str]:
    """Reasons for differences, by key."""
    held = {}
    for reading, c in runs.readings.items():
        left = np.array([1.0 + run.ceilings[1].std_change for run in c.runs["cpc"]])
        held[reading] = 100.0 * (1.0 - float(np.mean(left**2)))
    c = runs.readings[CLASS_B]
    loops = {scheme: runs.bench.loops(scheme)[0] for scheme in ("ipc", "cpfc")}
    edge = ", ".join(f"{edgewise(c, scheme) * 1e-3:.0f} kN m with {scheme.upper()}" for scheme in THREE)
    words = {
        "shares": " and ".join(f"{share:.0f} % ({reading})" for reading, share in held.items()),
        "asked": f"{100.0 * (1.0 - (1.0 - 0.553) ** 2):.0f}",
        "edge": f"{edge} ({CLASS_B})",
        "whole": percent(change(c, "RootMxc1 DEL", WHOLE_LEAD)),
        "likely": " and ".join(f"{likelihood(c)} ({reading})" for reading, c in runs.readings.items()),
        "factor": f"{loops['cpfc'].integral_gain / loops['ipc'].integral_gain:.2f}",
    }
    return {key: text.format(**words) for key, text in reasons_of("he2018").items()}


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
