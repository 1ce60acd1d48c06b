"""Measures of the schemes' runs on which claims, reasons and figures rest."""

from __future__ import annotations

from math import acos, nan, pi, sin, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from meltemi.papers.claim import rows_of, sentences_of
from meltemi.papers.he2018.runs import PAPER
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.spectra import decibels, spectral_peak
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.result import Result
from meltemi.tuning.compare import WHOLE, Comparison
from meltemi.turbine.flaps import naca64618_flap

Float = NDArray[np.float64]
sentence = sentences_of("he2018")
PEAK_WIDTH = 0.04
"""[Hz] half-width in which a peak is sought: twice the resolution of the spectra."""
EDGEWISE = (0.95, 1.3)
"""[Hz] band of the first edgewise mode."""
CEILINGS = {"ipc": 1, "cpfc": 2}
"""Multiples of the rotor speed up to which the ideal removal goes that a scheme is compared with."""
PAPER_CHANGES = [
    (row["quantity"], row["scheme"], float(row["paper"].removesuffix(" %")))
    for row in rows_of("he2018", "claims.csv").values()
    if row["kind"] == "near" and row["basis"] == "paper" and not row["quantity"].endswith("mean")
]
"""Quantity, scheme and change [%] of the paper's standard deviations and equivalent loads."""


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


def minutes(c: Comparison) -> list[str]:
    """Windows of a minute, one after the other."""
    return [name for name in c.windows if name not in (WHOLE, PAPER)]


def above_neighbours(c: Comparison, scheme: str, harmonic: int) -> float:
    """[dB] peak of RootMyc1 at a multiple of the rotor frequency above the mean level half a one to either side."""
    spectrum, f = c.spectrum("RootMyc1", scheme), c.rotor_frequency()
    low, peak, high = (spectral_peak(spectrum, (harmonic + k) * f, PEAK_WIDTH).density for k in (-0.5, 0.0, 0.5))
    return decibels(peak, sqrt(low * high))


def share_at(x: Float, time: Float, frequency: float, half_width: float = 0.5) -> float:
    """Share of the variance within ``half_width`` times a frequency [Hz] of it."""
    power = np.abs(np.fft.rfft(x - x.mean())) ** 2
    distance = np.abs(np.fft.rfftfreq(len(x), float(time[1] - time[0])) - frequency)
    return float(power[distance < half_width * frequency].sum() / max(power.sum(), 1e-300))


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


def reached(c: Comparison, scheme: str, quantity: Literal["std", "load"]) -> MeanEstimate:
    """Change of RootMyc1 by a scheme over that by ideal removal of its harmonics, formed for each seed."""
    name = {"std": "RootMyc1 std", "load": "RootMyc1 DEL"}[quantity]
    removed = [getattr(run.ceilings[CEILINGS[scheme] - 1], f"{quantity}_change") for run in c.runs["cpc"]]
    return mean_interval(change(c, name, scheme) / (100.0 * np.array(removed)))


def share_of_harmonics(c: Comparison) -> float:
    """[%] share of the variance of RootMyc1 with CPC in the bands of 1P and 2P."""
    left = np.array([1.0 + run.ceilings[1].std_change for run in c.runs["cpc"]])
    return 100.0 * (1.0 - float(np.mean(left**2)))


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
