"""Claims of Figures 10 to 13 on the simulated turbine, with and without rain."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import product

import numpy as np

from meltemi.environment.rain import Rain
from meltemi.environment.site import Environment
from meltemi.simulation.disk.point import disk_point
from meltemi.simulation.rotors import build
from meltemi_papers.claim import Claim
from meltemi_papers.palanimuthu2022.figures.rain_power import STORM
from meltemi_papers.palanimuthu2022.machine import BLADES, turbine
from meltemi_papers.palanimuthu2022.paper import claim

WINDS, SPEEDS, PITCHES = (8.0, 10.0, 12.0), (0.45, 0.6, 0.75), (0.0, 4.0, 8.0)
"""[m/s], [rad/s], [deg]."""
SIZES = (1.0, 2.0, 3.0)
"""[mm] of drops."""
Point = tuple[float, float, float]


def rain_gaps(rain: Rain, points: Iterable[Point]) -> dict[Point, tuple[float, float]]:
    """Power [W] without rain and its loss in rain by wind speed, rotor speed and pitch, if driven by the wind."""
    machine = turbine(BLADES)
    dry, wet = (build(machine, environment=Environment(rain=r)) for r in (None, rain))
    found = {}
    for v, speed, pitch in points:
        at = {"rotor_speed": speed, "pitch": math.radians(pitch)}
        power, left = (float(disk_point(m, v, **at)["aerodynamic_power"]) for m in (dry, wet))
        if power > 0.0:
            found[v, speed, pitch] = power, power - left
    return found


def rain_claims() -> list[Claim]:
    """Claims on the loss: everywhere, with the cubes of wind speed and drop size, at any rotor speed and pitch."""
    storm = rain_gaps(STORM, product(WINDS, SPEEDS, PITCHES))
    below = all(gap > 0.0 for _, gap in storm.values())
    whole = {at: gap for at, (power, gap) in storm.items() if gap < 0.999 * power}  # rain stops the rotor at most
    per_wind = [np.array([gap for at, gap in whole.items() if at[0] == v]) for v in WINDS]
    same = max(float(np.ptp(gaps) / gaps.mean()) for gaps in per_wind)
    cubes = np.array([gaps.mean() / v**3 for v, gaps in zip(WINDS, per_wind, strict=True)])
    at = (10.0, 0.6, 0.0)
    sizes = np.array([rain_gaps(STORM.replace(diameter=d), [at])[at][1] / d**3 for d in SIZES])
    odd = [float(np.ptp(x) / x.mean()) for x in (cubes, sizes)]
    return [
        claim("rain below", f"{'everywhere' if below else 'not everywhere'} ({len(storm)} points of operation)", below),
        claim("gap over wind", f"off by {100 * odd[0]:.2g} and {100 * odd[1]:.1g} %", max(odd) <= 0.01),
        claim("gap over speed", f"{len(whole)} points: off by {100 * same:.1g} %", same <= 0.01),
    ]
