"""Gust and wind step against OpenFAST."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from comparisons import reference_table, source_of
from comparisons.measure import extremes
from meltemi.postprocess.statistics import means_over_revolutions
from meltemi.report.plots import plot
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import simulate
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable, difference, relative
from meltemi.wind.fields import WindSeries

Float = NDArray[np.float64]
CHANNELS = ("azimuth", "Wind1VelX", "GenPwr", "RotSpeed", "BldPitch1", "RtFldFxh", "RootMyc1", "OoPDefl1", "TTDspFA",
            "TwrBsMyt")  # fmt: skip


def gust_wind() -> WindSeries:
    """The extreme operating gust of the reference: IEC 61400-1 ed. 3, 6.3.2.2, T = 10.5 s, from 80 s."""
    amplitude, period, begin = 5.18862, 10.5, 80.0
    time = np.concatenate([[0.0], begin + np.arange(0.0, period + 0.025, 0.05), [1e4]])
    x = np.clip((time - begin) / period, 0.0, 1.0)
    gust = -0.37 * amplitude * np.sin(3.0 * np.pi * x) * (1.0 - np.cos(2.0 * np.pi * x))
    return WindSeries(time=time, speed=12.0, exponent=0.2, gust=gust, source="extreme operating gust at 12 m/s")


def step_wind() -> WindSeries:
    """From 10 to 11 m/s at 120 s."""
    time = np.array([0.0, 120.0, 120.1, 1e4])
    return WindSeries(time=time, speed=[10.0, 10.0, 11.0, 11.0], source="wind step from 10 to 11 m/s")


def gust() -> CheckTable:
    """Extremes of the gust and when they occur."""
    rows: list[Check] = []
    results: list[Result] = []
    for aero in "AB":
        result = simulate(deck_model(aero), gust_wind(), duration=140.0, channels=CHANNELS).between(80.0, 120.0)
        results.append(result)
        for r in reference_table("gust", set=aero):
            channel, span = r["channel"], float(r["peak_to_peak"])
            low, at_low, high, at_high = extremes(result.time, result[channel])
            unit, where = result.channel(channel).unit, f"set {aero}"
            for name, value, at in (("minimum", low, at_low), ("maximum", high, at_high)):
                reference, theirs = float(r[name]), float(r[f"at_{name}"])
                deviation = 100.0 * (value - reference) / span
                rows.append(Check(f"{channel} {name}", where, unit, reference, value, deviation, "%", 4.0))
                rows.append(difference(f"{channel} time of {name}", where, "s", theirs, at, 0.3, measure="s"))
    figure = plot(results, ["Wind1VelX", "RotSpeed", "BldPitch1", "RootMyc1", "TwrBsMyt"], ["options A", "options B"])
    title = "Extreme operating gust against OpenFAST (percent of the channel's peak-to-peak)"
    return CheckTable("gust", title, source_of("gust"), rows, figures={"gust": figure})


def step() -> CheckTable:
    """Means before and after a wind step, and the largest azimuthal average."""
    rows: list[Check] = []
    for aero in "AB":
        result = simulate(deck_model(aero), step_wind(), duration=200.0, channels=CHANNELS)
        t = result.time
        for r in reference_table("step", set=aero):
            channel = r["channel"]
            unit, where = result.channel(channel).unit, f"set {aero}"
            before = result[channel][(t >= 110.0) & (t < 120.0)].mean()
            after = result[channel][(t >= 190.0) & (t < 200.0)].mean()
            means, ends = means_over_revolutions(t, result["azimuth"], result[channel])
            rows.append(relative(f"{channel} before", where, unit, float(r["before"]), float(before), 2.0))
            rows.append(relative(f"{channel} after", where, unit, float(r["after"]), float(after), 2.0))
            largest = float(means[ends > 120.0].max())
            rows.append(relative(f"{channel} largest of a revolution", where, unit, float(r["largest"]), largest, 2.0))
    return CheckTable("wind step", "Wind step against OpenFAST", source_of("step"), rows)
