"""Errors and ambiguities of the paper: its statement, our reading, and the results of both."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from meltemi.environment.air import site_pressure, vapour_pressure
from meltemi.environment.drops import MM_PER_HOUR, WATER, drop_count, mean_diameter, spectrum_slope, water_content
from meltemi.environment.gases import CELSIUS, R_DRY, R_VAPOUR
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi.papers.claim import listed, rows_of
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi.papers.palanimuthu2022.runs import LARGE, PHYSICAL, SMALL
from meltemi.reports.blocks import Table

DROP = paper.DROP * 1e-3
"""[m] diameter of the drops."""
Numbers = Mapping[str, Sequence[Any]]
"""Values of the braces in ``readings.csv``, by the number of an error."""


class PaperError(NamedTuple):
    """An error or gap of the paper and our reading of it.

    Attributes:
      key: number of the error.
      paper: statement of the paper.
      theirs: result of the statement.
      reading: our reading.
      ours: result of our reading.
    """

    key: str
    paper: str
    theirs: str
    reading: str
    ours: str


def printed_density(temperature: float, humidity: float, altitude: float, zero: float) -> float:
    """Density [kg/m^3] of air at a temperature [degC] with another zero [K] in the dry part, as printed in eq. (2)."""
    kelvin = temperature + CELSIUS
    vapour = float(vapour_pressure(kelvin, humidity))
    dry = float(site_pressure(kelvin, altitude)) - vapour
    return dry / (R_DRY * (temperature + zero)) + vapour / (R_VAPOUR * kelvin)


def time_constant(inertia: float, wind: float = 10.0) -> float:
    """Time constant [s] of the rotor speed under the optimal torque law: J / (3 K_T omega)."""
    formula = rotor(FORMULA)
    ratio, _ = formula.best()
    return inertia / (3.0 * formula.gain() * ratio * wind / formula.radius)


def inertia_constant(inertia: float) -> float:
    """Kinetic energy at rated speed over rated power [s]."""
    return 0.5 * inertia * paper.SPEED**2 / paper.STATOR_POWER


def _four(humidity: float, zero: float = CELSIUS) -> str:
    return " / ".join(f"{printed_density(t, humidity, h, zero):.4f}" for t, h in paper.DENSITIES)


def _storm_loss(**changes: float | str) -> float:
    """Power loss [MW] in a storm."""
    settings = {"rate": paper.RATE, "mode": "seed", "diameter": paper.DROP, **changes}
    return 1e-6 * float(rain_power_loss(rain_parameters(Rain(**settings), paper.RADIUS), paper.WIND))  # type: ignore[arg-type]


def _air() -> Numbers:
    drops = [100.0 * (1.0 - density(t, 0.4, 2000.0) / density(t, 0.4)) for t in (-10.0, 35.0)]
    across = [100.0 * (1.0 - density(35.0, 0.4, h) / density(-10.0, 0.4, h)) for h in (0.0, 2000.0)]
    plain = rotor(FORMULA).power(paper.WIND * rotor(FORMULA).best()[0] / paper.RADIUS, paper.WIND)
    over = [1e-6 * paper.POWER * float(density(t)) / STANDARD for t in (10.0, -10.0)]
    inland = [float(density(15.0, 0.0, h)) for h in (0.0, 1500.0)]
    return {
        "E-E1": (_four(0.4, 273.5), _four(0.4)),
        "E-E2": (_four(0.2), across, _four(0.4), drops),
        "E-E3": [float(density(15.0)) * p / 101325.0 for p in (98000.0, 104000.0)],
        "E-E4": [100.0 * (1.0 - density(t, 1.0) / density(t)) for t in (0.0, 10.0, 20.0, 35.0)],
        "E-E20": (*over, 1e-6 * float(plain)),
        "E-E21": (*inland, 100.0 * (inland[1] / inland[0] - 1.0)),
    }


def _machine() -> Numbers:
    formula = rotor(FORMULA)
    ratio, c = formula.best()
    power = 0.5 * STANDARD * formula.area * paper.WIND**3
    current = paper.STATOR_POWER / (math.sqrt(3.0) * paper.GRID_VOLTAGE)
    speed = ratio * 10.0 / formula.radius
    wrong, right = formula.gain() * ratio**2, formula.gain()
    rated = formula.wind_for(paper.STATOR_POWER), formula.wind_for(paper.POWER)
    points = paper.SPEED * paper.RADIUS / paper.WIND, paper.POWER / power
    ours = c * power * 1e-6, 100.0 * (c * power / paper.POWER - 1.0), ratio * paper.WIND / formula.radius
    return {
        "E-E5": (*points, *ours),
        "E-E6": [
            f"H {inertia_constant(j):.2g} s, time constant {time_constant(j):.2g} s" for j in (PHYSICAL, LARGE, SMALL)
        ],
        "E-E7": (3.0 * current**2 * 1.75 * 1e-6, 3.0 * current**2 * 1.75e-3 * 1e-3),
        "E-E8": (wrong, wrong * speed**2 * 1e-6, right, right * speed**2 * 1e-6),
        "E-E19": (right * speed**3 * 1e-6, speed),
        "E-E23": [float(formula.power(ratio * 14.0 / formula.radius, 14.0)) * 1e-6],
        "E-E24": (200.0 * paper.SPEED**2, *reversed(rated)),
    }


def _rain() -> Numbers:
    water = [math.pi * WATER * 8e6 / slope**4 for slope in (410.0, float(spectrum_slope(MM_PER_HOUR)))]
    rate = paper.RATE * MM_PER_HOUR
    count = float(drop_count(rate))
    force = WATER * math.pi * DROP**2 * paper.WIND**2 / 3.0  # (7)
    volume, section, area = math.pi * DROP**3 * count / 6.0, 0.25 * math.pi * DROP**2, math.pi * paper.RADIUS**2
    storm, falling = _storm_loss(), Rain(rate=1.0, mode="seed").falling
    line = force * volume / section
    return {
        "E-E9": (water[0], water[1] * 1e3),
        "E-E10": (force * volume * area * section, line * area * 1e-3),
        "E-E11": (line * 2.0 * paper.RADIUS, line * area * 1e-3),
        "E-E12": (_storm_loss(water_density=STANDARD) * 1e3, storm),
        "E-E13": (_storm_loss(drop_speed=falling), storm),
        "E-E14": (_storm_loss(diameter=0.3), storm),
        "E-E15": (count, float(mean_diameter(rate)) * 1e3),
        "E-E22": (WATER * volume * 1e3, storm, float(water_content(rate)) * 1e3, _storm_loss(mode="integrated")),
    }


def _control(gains: Mapping[float, float], speeds: tuple[float, float]) -> Numbers:
    low, high = (rotor(model).speed_for(paper.REFERENCE) for model in (FORMULA, BLADES))
    at = [rotor(BLADES).speed_for(paper.REFERENCE, STANDARD, float(b)) for b in np.radians([2.0, 4.0, 6.0, 8.0])]
    return {
        "E-E16": [1e-3 * gains[t] for t in (30.0, 40.0, -10.0)],
        "E-E17": (*speeds, low, high),
        "E-E18": (listed(at, ".3f"), high),
    }


def readings(gains: Mapping[float, float], speeds: tuple[float, float]) -> list[PaperError]:
    """All errors and gaps of the paper with both readings: the rows of ``readings.csv``.

    Args:
      gains: [W] mean gains over the intervals by temperature [degC], Figure 6 with M1 and the default inertia.
      speeds: [rad/s] mean rotor speed of A0 and A1 while power is limited.
    """
    numbers = {**_air(), **_machine(), **_rain(), **_control(gains, speeds)}
    stated = rows_of("palanimuthu2022", "readings.csv").items()
    return [PaperError(key, **{name: text.format(*numbers[key]) for name, text in row.items()}) for key, row in stated]


def readings_table(readings: Sequence[PaperError]) -> Table:
    """Table of the results of both readings."""
    head = ["", "the paper", "which gives", "read as", "which gives"]
    return Table(head, readings, "Errors and gaps of the paper, both readings", text_columns=len(head))
