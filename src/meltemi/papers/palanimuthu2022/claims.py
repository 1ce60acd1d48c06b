"""Claims of the paper that follow from formulas (those from runs: ``run_claims``). Nothing is tuned to them."""

from __future__ import annotations

import math
from itertools import product
from typing import Final

import numpy as np

from meltemi.environment.rain import Rain
from meltemi.environment.site import STANDARD
from meltemi.papers.claim import Claim, claim_group, listed, reasons_of
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.rain_power import STORM, loss
from meltemi.papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi.papers.palanimuthu2022.paper import claim
from meltemi.studies.rain_drops import rain_loads
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

WINDS, SPEEDS, PITCHES = (8.0, 10.0, 12.0), (0.45, 0.6, 0.75), (0.0, 4.0, 8.0)
"""[m/s], [rad/s], [deg] at which drops meet the blades."""
RAIN = "rain on the blades of a turbine"
BLADES_IN_RAIN: Final = "iea22mw"


def formula_claims() -> list[Claim]:
    """All claims that need no run."""
    return [*_air(), *_power(), *claim_group(RAIN, "(14)", _rain), _extra_range()]


def _air() -> list[Claim]:
    standard = float(density(15.0))
    spread = {t: 100.0 * (1.0 - float(density(t, 1.0) / density(t))) for t in (-10.0, 10.0, 20.0, 30.0, 40.0)}
    found = {key: float(density(key[0], 0.4, key[1])) for key in paper.DENSITIES}
    exact = all(round(found[key], 4) == printed for key, printed in paper.DENSITIES.items())
    fall = [100.0 * (1.0 - found[t, 2000.0] / found[t, 0.0]) for t in (-10.0, 35.0)]
    printed, ours = (listed(values, ".4f") for values in (paper.DENSITIES.values(), found.values()))
    fallen = abs(fall[0] - 15.5) <= 0.05 and abs(fall[1] - 12.0) <= 0.5
    cold = max(spread[t] for t in (-10.0, 10.0)) > min(spread[t] for t in (30.0, 40.0))
    return [
        claim("dry air", round(standard, 3) == 1.225, density=standard),
        claim("four densities", exact, densities=printed, found=ours),
        claim("altitude", fallen, fall=listed(fall, ".1f")),
        claim("humidity", cold, fall=listed(spread.values(), ".1f"), at=listed(spread)),
    ]


def _power() -> list[Claim]:
    from scipy.optimize import brentq

    made = rotor(FORMULA)
    speed = made.best()[0] * paper.WIND / made.radius
    power = float(made.power(speed, paper.WIND))
    warmest = float(brentq(lambda t: float(density(t)) - STANDARD, -10.0, 40.0))
    electric = paper.POLE_PAIRS * paper.SPEED * paper.FLUX * math.sqrt(1.5)
    more, faster, higher = (
        100.0 * (ours / stated - 1.0)
        for ours, stated in ((power, paper.POWER), (speed, paper.SPEED), (electric, paper.VOLTAGE))
    )
    peak = abs(power - paper.POWER) <= 0.05e6 and abs(speed - paper.SPEED) <= 0.005
    return [
        claim("peak", peak, power=power * 1e-6, more=more, speed=speed, faster=faster),
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


def _extra_range() -> Claim:
    """Whether a pitched rotor gives 15 MW at a lower speed than one with fine pitch."""
    angles = np.arange(0.5, 12.01, 0.05)
    begins = {}
    for name in (BLADES, FORMULA):
        made = rotor(name)
        low = made.speed_for(paper.REFERENCE)
        wider = [b for b in angles if made.speed_for(paper.REFERENCE, STANDARD, math.radians(float(b))) < low]
        begins[name] = f"{name}: {f'from {wider[0]:.1f}° of pitch on' if wider else 'none up to 12°'}"
    return claim("extra range", "none" not in begins[BLADES], begins="; ".join(begins.values()))


REASONS = reasons_of("palanimuthu2022")
"""Why numbers differ, or what there is to know."""
