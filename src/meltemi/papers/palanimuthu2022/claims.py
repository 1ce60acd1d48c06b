"""Claims of the paper that follow from formulas (those from runs: ``run_claims``). Nothing is tuned to them."""

from __future__ import annotations

import math
from itertools import product
from typing import Final

import numpy as np

from meltemi.environment.rain import Rain, driest_speed, wetness
from meltemi.environment.site import STANDARD
from meltemi.papers.claim import Claim, claim_group, listed, reasons_of
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.rain import HALF, STORM, loss
from meltemi.papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi.papers.palanimuthu2022.paper import claim
from meltemi.papers.palanimuthu2022.runs import HUMID
from meltemi.papers.verdict import by_reading
from meltemi.studies.rain_drops import rain_loads
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

WINDS, SPEEDS, PITCHES = (8.0, 10.0, 12.0), (0.45, 0.6, 0.75), (0.0, 4.0, 8.0)
"""[m/s], [rad/s], [deg] at which drops meet the blades."""
TAILS, FASTEST = (0.5, 2.0, 10.0), 100.0
"""[m/s] components of the rain in the direction of travel; up to where the wetted area is searched."""
STATED_HUMIDITY = 0.2
"""Relative humidity of Figure 3 according to the paper's text."""
RAIN = "rain on the blades of a turbine"
BLADES_IN_RAIN: Final = "iea22mw"


def formula_claims() -> list[Claim]:
    """All claims that need no run."""
    return [*_air(), *_power(), _wetted(), *claim_group(RAIN, "(14)", _rain), _extra_range()]


def _air() -> list[Claim]:
    standard = float(density(15.0))
    spread = {t: 100.0 * (1.0 - float(density(t, 1.0) / density(t))) for t in (-10.0, 10.0, 20.0, 30.0, 40.0)}
    by_humidity = {h: [float(density(t, h, z)) for t, z in paper.DENSITIES] for h in (STATED_HUMIDITY, HUMID)}
    printed = list(paper.DENSITIES.values())
    exact = {f"{100 * h:g} %": [round(x, 4) for x in densities] == printed for h, densities in by_humidity.items()}
    ours = "; ".join(f"{listed(densities, '.4f')} at {100 * h:g} %" for h, densities in by_humidity.items())
    fall = [100.0 * (1.0 - float(density(t, HUMID, 2000.0) / density(t, HUMID))) for t in (-10.0, 35.0)]
    most = 100.0 * (float(density(40.0, 1.0) / density(-10.0)) - 1.0)
    fallen = abs(fall[0] - 15.5) <= 0.05 and abs(fall[1] - 12.0) <= 0.5
    cold = max(spread[t] for t in (-10.0, 10.0)) > min(spread[t] for t in (30.0, 40.0))
    return [
        claim("dry air", round(standard, 3) == 1.225, density=standard),
        claim("four densities", by_reading(exact), densities=listed(printed, ".4f"), found=ours),
        claim("altitude", fallen, fall=listed(fall, ".1f")),
        claim("humidity", cold, fall=listed(spread.values(), ".1f"), at=listed(spread)),
        claim("weather", 19.5 <= -most <= 30.5, most=most),
    ]


def _power() -> list[Claim]:
    from scipy.optimize import brentq

    formula = rotor(FORMULA)
    speed = formula.best()[0] * paper.WIND / formula.radius
    power = float(formula.power(speed, paper.WIND))
    warmest = float(brentq(lambda t: float(density(t)) - STANDARD, -10.0, 40.0))
    electric = paper.POLE_PAIRS * paper.SPEED * paper.FLUX * math.sqrt(1.5)
    more, faster, higher = (
        100.0 * (ours / stated - 1.0)
        for ours, stated in ((power, paper.POWER), (speed, paper.SPEED), (electric, paper.VOLTAGE))
    )
    peak = abs(power - paper.POWER) <= 0.05e6 and abs(speed - paper.SPEED) <= 0.005
    grid = np.linspace(0.5, 1.0, 2001)
    by_altitude = [formula.power(grid, paper.WIND, 0.0, float(density(15.0, 0.0, h))) for h in paper.ALTITUDES]
    powers, at = [float(p.max()) * 1e-6 for p in by_altitude], [float(grid[p.argmax()]) for p in by_altitude]
    lower = bool(np.all(np.diff(powers) < 0.0)) and np.ptp(at) <= grid[1] - grid[0]
    return [
        claim("peak", peak, power=power * 1e-6, more=more, speed=speed, faster=faster),
        claim(
            "peak altitude",
            lower,
            powers=listed(powers, ".2f"),
            at=listed(paper.ALTITUDES),
            speeds=f"{at[0]:.3f}",
        ),
        claim("over rated", warmest >= 0.0, warmest=warmest),
        claim("voltage", abs(electric - paper.VOLTAGE) <= 50.0, voltage=electric, more=higher),
    ]


def _rain() -> list[Claim]:
    blades, rain = aeroelastic(load_turbine(BLADES_IN_RAIN), RAIN), Rain(rate=paper.RATE)
    lost = [rain_loads(blades, rain, v, w, math.radians(b)).power for v, w, b in product(WINDS, SPEEDS, PITCHES)]
    one_size, all_sizes = (float(loss(r, paper.WIND)[0]) * 1e-6 for r in (STORM, rain))
    return [
        claim("rain below", min(lost) > 0.0, least=min(lost) * 1e-3, most=max(lost) * 1e-3, n=len(lost)),
        claim("rain size", one=one_size, all=all_sizes),
    ]


def _wetted() -> Claim:
    """Minimum of (12) by search, against (13), and whether a minimum exists without tail wind."""
    speeds = np.geomspace(0.05, FASTEST, 20001)
    off = []
    for tail, cross, fall in product(TAILS, (0.0, 5.0), (2.0, 6.5)):
        least = speeds[wetness(speeds, paper.RADIUS, HALF, tail=tail, cross=cross, fall=fall).argmin()]
        off.append(abs(least / driest_speed(paper.RADIUS, HALF, tail, cross, fall) - 1.0))
    none = all(np.all(np.diff(wetness(speeds, paper.RADIUS, HALF, tail=t, fall=6.5)) < 0.0) for t in (-5.0, 0.0))
    holds = none and max(off) <= 1e-3
    return claim("wetted", holds, off=100.0 * max(off), n=len(off), tails=listed(TAILS), fastest=FASTEST)


def _extra_range() -> Claim:
    """Whether a pitched rotor delivers 15 MW at a lower speed than one at fine pitch."""
    angles = np.arange(0.5, 12.01, 0.05)
    begins = {}
    for name in (BLADES, FORMULA):
        model = rotor(name)
        low = model.speed_for(paper.REFERENCE)
        wider = [b for b in angles if model.speed_for(paper.REFERENCE, STANDARD, math.radians(float(b))) < low]
        begins[name] = f"{name}: {f'from {wider[0]:.1f}° of pitch on' if wider else 'none up to 12°'}"
    return claim("extra range", "none" not in begins[BLADES], begins="; ".join(begins.values()))


REASONS = reasons_of("palanimuthu2022")
"""Why numbers differ, or what there is to know."""
