"""Claims of Figure 6: power gain of a torque law that takes the air temperature into account."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import STANDARD
from meltemi.papers.claim import Claim, listed
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.machine import CALIBRATED, density, rotor
from meltemi.papers.palanimuthu2022.paper import claim
from meltemi.papers.palanimuthu2022.runs import INTERVAL, PLAIN, STEADY, Reading, Runs, Steps, power_ratio, ratio
from meltemi.reports.blocks import Table

Float = NDArray[np.float64]
STATED = np.array([paper.GAINS[40.0], paper.GAINS[-10.0]])
"""[W] in 100 to 200 s and 600 to 700 s."""


def mean_gains(steps: Steps, channel: str = "aerodynamic_power") -> Float:
    """(levels,) [W] mean gain of a power in case ii over each interval."""
    return steps.means("ii", channel) - steps.means("i", channel)


def kinetic_gains(steps: Steps) -> Float:
    """(levels,) [W] part of the gain of the generator that stems from kinetic energy of the rotor."""
    ends = steps.lead + INTERVAL * np.arange(len(steps.levels) + 1)
    given = {}
    for case in ("i", "ii"):
        result = steps.results[case]
        given[case] = -np.diff(0.5 * steps.inertia * np.interp(ends, result.time, result["rotor_speed"]) ** 2)
    return np.asarray((given["ii"] - given["i"]) / INTERVAL)


def closed_gains(steps: Steps) -> Float:
    """(levels,) [W] gain of aerodynamic power in closed form, quasi-steady and without losses."""
    made = rotor(steps.model)
    air = density(np.array(steps.levels), steps.humidity)
    best = [0.5 * float(rho) * made.area * made.best()[1] * STEADY**3 for rho in air]
    fixed = [made.settled_power(STEADY, STANDARD, float(rho)) for rho in air]
    return np.array(best) - np.array(fixed)


def temperature_claims(runs: Runs) -> list[Claim]:
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


def gain_claims(won: dict[Reading, Float]) -> list[Claim]:
    """Claims on the mean gains [W] of aerodynamic power at 40 and -10 degC, over the readings that are not fitted."""
    every = {r: gains for r, gains in won.items() if r.model != CALIBRATED and not r.converters}
    of_humidity = {r.humidity: gains[0] for r, gains in every.items() if r == PLAIN._replace(humidity=r.humidity)}
    humidity = np.array(sorted(of_humidity))
    hot = np.array([of_humidity[h] for h in humidity])
    needed = 100.0 * float(np.interp(STATED[0], hot, humidity))
    reached = hot.min() <= STATED[0] <= hot.max()
    cold = {r.model: gains[1] for r, gains in every.items() if r.humidity == 0.0 and r.inertia == PLAIN.inertia}
    none = f"; none of {len(cold)} published curves with the paper's best point reaches it"
    moist = ", ".join(f"{x * 1e-3:.1f} kW at {100 * h:g} %" for h, x in zip(humidity, hot, strict=True))
    curves = ", ".join(f"{name} {x * 1e-3:.1f}" for name, x in cold.items())
    return [
        claim("gain hot", gains=moist, needed=f"; 58.2 kW need {needed:.0f} %" if reached else ""),
        claim("gain cold", gains=curves, none=none if max(cold.values()) < STATED[1] else ""),
    ]


def gains_table(runs: Runs) -> Table:
    """Table of Figure 6: gains at 40 and -10 degC by what the paper leaves open."""
    rows = []
    for reading, steps in runs.temperature.items():
        generated = mean_gains(steps, "generator_power"), kinetic_gains(steps)
        columns = closed_gains(steps), mean_gains(steps), *generated
        name = reading.model + (", fitted" if reading.model == CALIBRATED else "")
        cells = [f"{gains[k] * 1e-3:.1f}" for gains in columns for k in (0, -1)]
        what = [name + (", grid power" if reading.converters else ""), f"{rotor(reading.model).curvature():.1f}"]
        rows.append([*what, f"{100 * reading.humidity:g}", f"{reading.inertia:.4g}", *cells])
    rows.append(["paper", "", "", "", "", "", "58.2", "71.3"])
    head = ["C_p", "sharpness", "humidity [%]", "J [kg m²]", *["40 °C", "-10 °C"] * 4]
    groups = [("", 4), ("settled", 2), ("mean, aerodynamic", 2), ("mean, generator", 2), ("of it by the rotor", 2)]
    note = (
        "kW of case ii against case i at 10 m/s; settled: in closed form; means over 100 to 200 and 600 to 700 s, from "
        "40 °C on. Sharpness: curvature of C_p at its maximum, -C_p'' λ²/C_p. All curves have the paper's maximum of "
        "0.48 at 9.5085. M1 has the constants of the MathWorks block, Heier those of 1998; Slootweg and constant speed "
        "are from Slootweg et al. (2003), Dai and De Kooning from Saint-Drenan et al. (2020), Feng, Llano, Ahmed, sine "
        "and fifth degree from Carranza Castillo et al. (2023); M3 scaled is the curve of the blades of a public 20 MW "
        "design; M2 is fitted to the paper's two gains. In the table M3 scaled the "
        "controller finds its best point at 9.46. While the rotor of case i changes its speed it gives kinetic energy "
        "to the generator, or takes it."
    )
    return Table(head, rows, "Gain of the adapted law, by what the paper leaves open", 1, groups, note)
