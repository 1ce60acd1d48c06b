"""Claims of Figure 6: power gain of a torque law that accounts for the air temperature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import STANDARD
from meltemi.papers.claim import Claim, listed
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.machine import CALIBRATED, FORMULA, density, rotor
from meltemi.papers.palanimuthu2022.paper import claim, sentence
from meltemi.papers.palanimuthu2022.runs import (
    HUMID,
    INTERVAL,
    LARGE,
    PHYSICAL,
    PLAIN,
    SMALL,
    STEADY,
    PowerControlRuns,
    Reading,
    Steps,
    power_ratio,
    ratio,
)
from meltemi.papers.verdict import by_reading
from meltemi.reports.blocks import Table

Float = NDArray[np.float64]
RATIO = round(paper.GAINS[-10.0] / paper.GAINS[40.0], 3)
"""Ratio of the gains that the paper prints, of 600 to 700 s over those of 100 to 200 s."""
ROUNDED = 0.002
"""Change of the ratio by half a unit of the last digits of the gains."""


def mean_gains(steps: Steps, channel: str = "aerodynamic_power") -> Float:
    """(levels,) [W] mean gain of a power channel in case ii over each interval."""
    return steps.means("ii", channel) - steps.means("i", channel)


def kinetic_gains(steps: Steps) -> Float:
    """(levels,) [W] part of the gain of generator power from kinetic energy of the rotor."""
    ends = steps.lead + INTERVAL * np.arange(len(steps.levels) + 1)
    delivered = {}
    for case in ("i", "ii"):
        result = steps.results[case]
        delivered[case] = -np.diff(0.5 * steps.inertia * np.interp(ends, result.time, result["rotor_speed"]) ** 2)
    return np.asarray((delivered["ii"] - delivered["i"]) / INTERVAL)


def closed_gains(steps: Steps) -> Float:
    """(levels,) [W] gain of aerodynamic power in closed form, quasi-steady and without losses."""
    model_rotor = rotor(steps.model)
    air = density(np.array(steps.levels), steps.humidity)
    best = [0.5 * float(rho) * model_rotor.area * model_rotor.best()[1] * STEADY**3 for rho in air]
    fixed = [model_rotor.settled_power(STEADY, STANDARD, float(rho)) for rho in air]
    return np.array(best) - np.array(fixed)


def temperature_claims(runs: PowerControlRuns) -> list[Claim]:
    """Claims on tip-speed ratios and power coefficients of both cases and on gains of case ii."""
    plain = runs.temperature[PLAIN]
    best, power = plain.settled("ii", "", ratio), plain.settled("ii", "", power_ratio)
    fixed = plain.settled("i", "", ratio)
    off = np.abs(best - paper.TIP_SPEED_RATIO).max(), np.abs(power - paper.POWER_COEFFICIENT).max()
    ends = [(x.min(), x.max()) for x in (best, power)]
    return [
        claim("adapted ratios", off[0] <= 5e-5 and off[1] <= 5e-3, ratio=ends[0], power=ends[1]),
        claim("fixed ratios", np.all(np.diff(fixed) > 0.0), ratios=listed(fixed, ".2f")),
        *gain_claims({reading: mean_gains(steps)[[0, -1]] for reading, steps in runs.temperature.items()}),
    ]


def settled_pair(model: str, humidity: float) -> Float:
    """(2,) [W] gains at 40 and -10 degC in closed form."""
    return closed_gains(Steps(model, humidity, SMALL, {}, (40.0, -10.0), 0.0))


def humidity_of_ratio(model: str) -> float:
    """Humidity at which the settled gains of a curve have the paper's ratio; NaN if none exists."""
    humidity = np.linspace(0.0, 1.0, 41)
    ratios = np.array([ratio_of(settled_pair(model, float(h))) for h in humidity])
    return float(np.interp(-RATIO, -ratios, humidity, left=np.nan, right=np.nan))


def ratio_of(gains: Float) -> float:
    """Ratio of the gains at -10 and 40 degC."""
    return float(gains[-1] / gains[0])


def gain_claims(won: dict[Reading, Float]) -> list[Claim]:
    """Claims on the mean gains [W] of aerodynamic power at 40 and -10 degC, over the readings that are not fitted.

    Both levels depend on the curvature of the coefficient, which the paper does not give; their ratio hardly does. It
    decreases with the humidity, and with the inertia of a rotor that has not yet reached its new speed.
    """
    every = {
        r: gains
        for r, gains in won.items()
        if r.model != CALIBRATED and not r.converters and r.inertia in (PHYSICAL, LARGE, SMALL)
    }
    inertias = sorted({r.inertia for r in every}, reverse=True)
    of = {j: [(r, gains) for r, gains in every.items() if r.inertia == j] for j in inertias}
    dry = {j: {r.model: ratio_of(g) for r, g in of[j] if r.humidity == 0.0} for j in inertias}
    most = {j: max(ratios.values()) for j, ratios in dry.items()}

    def span(end: int) -> str:
        ends = {j: [gains[end] * 1e-3 for _, gains in of[j]] for j in inertias}
        spans = {j: f"{min(x):.1f} to {max(x):.1f} kW" if len(x) > 1 else f"{x[0]:.1f} kW" for j, x in ends.items()}
        return "; ".join(f"{words} with {j:.4g} kg m² ({len(ends[j])} readings)" for j, words in spans.items())

    reach = [model for model, ratio in dry[SMALL].items() if ratio >= RATIO]
    needed = sorted((h, model) for model in reach if np.isfinite(h := humidity_of_ratio(model)))
    ratio_text = "; ".join(f"{most[j]:.3f} at most with {j:.4g} kg m², in dry air" for j in inertias)
    if needed:
        (least, first), (largest, last) = needed[0], needed[-1]
        ends = f"{100 * least:.0f} % ({first}) to {100 * largest:.0f} % ({last})"
        ratio_text += f"; with {SMALL:.4g} it is {RATIO} at {ends}"
    verdicts = {f"{j:.4g} kg m²": most[j] >= RATIO - ROUNDED for j in inertias}
    ratio_claim = claim("gain ratio", by_reading(verdicts), ratios=ratio_text)
    return [claim("gain hot", gains=span(0)), claim("gain cold", gains=span(-1)), ratio_claim]


def curves_table(runs: PowerControlRuns) -> Table:
    """Table of Figure 6 by power coefficient: gains at 40 and -10 degC, and the humidity for their ratio."""
    light = {r: steps for r, steps in runs.temperature.items() if r.inertia == SMALL}
    rows = []
    for (model, humidity, *_), steps in light.items():
        if humidity > 0.0 and model != CALIBRATED:
            continue
        heavy = runs.temperature.get(Reading(model))
        moist = light.get(Reading(model, HUMID, SMALL))
        pairs = [mean_gains(x)[[0, -1]] * 1e-3 if x else None for x in (heavy, steps, moist)]
        cells = [text for x in pairs for text in ([f"{x[0]:.1f}", f"{x[1]:.1f}"] if x is not None else ["", ""])]
        ratios = ["" if x is None else f"{ratio_of(x):.3f}" for x in pairs]
        h = humidity_of_ratio(model)
        settled = [f"{100 * h:.0f}", *(f"{x * 1e-3:.1f}" for x in settled_pair(model, h))] if h == h else [""] * 3
        name = f"{model}, fitted at {100 * humidity:g} %" if model == CALIBRATED else model
        columns = [text for i, x in enumerate(ratios) for text in (*cells[2 * i : 2 * i + 2], x)]
        rows.append([name, f"{rotor(model).curvature():.1f}", *columns, *settled])
    rows.append(["paper", *[""] * 11, "58.2", "71.3"])
    head = ["C_p", "sharpness", *["40 °C", "-10 °C", "ratio"] * 3, "humidity [%]", "40 °C", "-10 °C"]
    groups = [("", 2), ("2.93e9 kg m², dry", 3), ("4.872e6 kg m², dry", 3)]
    groups += [("4.872e6 kg m², 40 %", 3), (f"settled, where the ratio is {RATIO}", 3)]
    return Table(head, rows, "Gain of the adapted law by power coefficient and inertia", 1, groups, sentence("curves"))


def gains_table(runs: PowerControlRuns) -> Table:
    """Table of Figure 6 with M1: gains at 40 and -10 degC by humidity, inertia and electrical parts."""
    rows = []
    for reading, steps in runs.temperature.items():
        if reading.model != FORMULA:
            continue
        generated = mean_gains(steps, "generator_power"), kinetic_gains(steps)
        columns = closed_gains(steps), mean_gains(steps), *generated
        cells = [f"{gains[k] * 1e-3:.1f}" for gains in columns for k in (0, -1)]
        what = "into the grid" if reading.converters else "of the stator"
        cells.insert(4, f"{ratio_of(columns[1]):.3f}")
        rows.append([f"{100 * reading.humidity:g}", f"{reading.inertia:.4g}", what, *cells])
    rows.append(["paper", "", "", "", "", "58.2", "71.3", f"{RATIO}", *[""] * 4])
    head = ["humidity [%]", "J [kg m²]", "power", *["40 °C", "-10 °C"] * 2, "ratio", *["40 °C", "-10 °C"] * 2]
    groups = [("", 3), ("settled", 2), ("mean, aerodynamic", 3), ("mean, electrical", 2), ("of it by the rotor", 2)]
    return Table(head, rows, "Gain of the adapted law with M1, by humidity and inertia", 3, groups, sentence("gains"))
