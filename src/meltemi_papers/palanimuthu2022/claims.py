"""Claims of the paper that follow from formulas (those from runs: ``run_claims``). Nothing is tuned to them."""

from __future__ import annotations

import math

import numpy as np

from meltemi.environment.drops import INTERCEPT, LARGEST, SMALLEST, spectrum_slope
from meltemi.environment.rain import RAIN_CLASSES, Rain, driest_speed, wetness
from meltemi.environment.site import STANDARD
from meltemi_papers.claim import Claim, listed, reasons_of
from meltemi_papers.palanimuthu2022 import paper
from meltemi_papers.palanimuthu2022.figures.rain_power import STORM, loss
from meltemi_papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor, turbine
from meltemi_papers.palanimuthu2022.paper import claim

SPREADS = {-10.0: 0.1, 20.0: 0.9, 35.0: 2.1, 40.0: 2.8}
"""[%] by [degC] which the density falls from dry to saturated air, by the paper's formulas."""
MOIST = """
-10  1.3414 1.3411 1.3408 1.3405 1.3402 1.3399
0    1.2922 1.2917 1.2911 1.2905 1.2899 1.2893
15   1.2250 1.2234 1.2219 1.2203 1.2187 1.2172
20   1.2041 1.2020 1.1999 1.1978 1.1957 1.1936
35   1.1455 1.1407 1.1359 1.1311 1.1263 1.1214
40   1.1272 1.1210 1.1148 1.1086 1.1024 1.0962
"""
"""[degC] and, at sea level, density [kg/m^3] at the humidities of Figure 7, by the paper's formulas."""
HIGH = """
-10  1.3408 1.2565 1.1775 1.1034 1.0340
0    1.2911 1.2127 1.1391 1.0700 1.0051
15   1.2219 1.1514 1.0849 1.0223 0.9633
25   1.1783 1.1124 1.0501 0.9913 0.9358
35   1.1359 1.0741 1.0157 0.9604 0.9081
"""
"""The same at the altitudes of Figure 3 and a humidity of 40 %."""
PEAKS = {-10.0: 23.21, 0.0: 22.36, 10.0: 21.57, 20.0: 20.84, 30.0: 20.15, 40.0: 19.51}
"""[MW] by [degC] of Figure 4: 21.2 MW times density over 1.225."""
HIGH_PEAKS = {0.0: 21.20, 500.0: 19.98, 1000.0: 18.83, 1500.0: 17.75, 2000.0: 16.72}
"""[MW] by [m] of Figure 5, made alike."""
WIDE = {
    0.0: 0.663,
    1.0: 0.716,
    2.0: 0.759,
    3.0: 0.777,
    4.0: 0.731,
    5.0: 0.667,
    6.0: 0.616,
    8.0: 0.538,
    10.0: 0.487,
    12.0: 0.446,
}
"""[rad/s] by [deg] at which 15 MW are the most that a pitched rotor gives, from another blade-element computation."""


def formula_claims() -> list[Claim]:
    """All claims that need no run."""
    return [*_air(), *_power(), *_rain(), *_speeds()]


def _off_table() -> tuple[float, int]:
    """[kg/m^3] largest difference from the density tables, and number of their entries."""
    off = []
    for row in MOIST.split("\n")[1:-1]:
        t, *expected = map(float, row.split())
        off.append(density(t, np.array(paper.HUMIDITIES)) - expected)
    for row in HIGH.split("\n")[1:-1]:
        t, *expected = map(float, row.split())
        off.append(density(t, 0.4, np.array(paper.ALTITUDES)) - expected)
    every = np.abs(np.concatenate(off))
    return float(every.max()), len(every)


def _air() -> list[Claim]:
    standard = float(density(15.0))
    spread = {t: 100.0 * (1.0 - float(density(t, 1.0) / density(t))) for t in SPREADS}
    off = max(abs(spread[t] - expected) for t, expected in SPREADS.items())
    moist = np.linspace(0.0, 1.0, 21)
    bent = max(
        float(np.abs(density(t, moist) / density(t) - (1.0 - 0.01 * spread[t] * moist)).max()) * 100.0 for t in SPREADS
    )
    table, values = _off_table()
    found = {key: float(density(key[0], 0.4, key[1])) for key in paper.DENSITIES}
    exact = all(round(found[key], 4) == printed for key, printed in paper.DENSITIES.items())
    fall = [100.0 * (1.0 - found[t, 2000.0] / found[t, 0.0]) for t in (-10.0, 35.0)]
    return [
        claim("dry air", f"{standard:.5f} kg/m³", abs(standard - 1.225) <= 5e-5),
        claim("tables of density", f"largest difference {table:.1e} kg/m³", table <= 5e-5, values=values),
        claim(
            "humidity",
            listed(spread.values(), ".2f") + f" %; off the line by {bent:.1g} points",
            off <= 0.05 and bent <= 0.05,
            falls=listed(SPREADS.values()),
        ),
        claim(
            "four densities", listed(found.values(), ".4f"), exact, densities=listed(paper.DENSITIES.values(), ".4f")
        ),
        claim("altitude", f"{fall[0]:.1f}, {fall[1]:.1f} %", abs(fall[0] - 15.5) <= 0.5 and abs(fall[1] - 12.0) <= 0.5),
    ]


def _peaks(unit: str, expected: dict[float, float], ours: dict[float, float], where: str) -> Claim:
    """Peaks of power [W] over a quantity, and the expected ones [MW]."""
    found = [ours[x] * 1e-6 for x in expected]
    near = all(abs(x / peak - 1.0) <= 0.025 for x, peak in zip(found, expected.values(), strict=True))
    powers, places = listed(expected.values(), ".2f"), listed(expected, ",.0f")
    return claim("peaks", f"{listed(found, '.2f')} MW", near, places=places, unit=unit, powers=powers, where=where)


def _power() -> list[Claim]:
    from scipy.optimize import brentq

    made = rotor(FORMULA)
    best, _ = made.best()
    grid = np.linspace(0.5, 1.0, 5001)
    at = {t: made.power(grid, paper.WIND, 0.0, float(density(t))) for t in PEAKS}
    peaks = {t: float(p.max()) for t, p in at.items()}
    speeds = [float(grid[np.argmax(p)]) for p in at.values()]
    standard = float(made.power(best * paper.WIND / made.radius, paper.WIND))
    heights = {h: float(made.power(grid, paper.WIND, 0.0, float(density(15.0, 0.0, h))).max()) for h in HIGH_PEAKS}
    ratios = [peaks[t] / standard * STANDARD / float(density(t)) - 1.0 for t in PEAKS]
    warmest = float(brentq(lambda t: float(density(t)) - STANDARD, -10.0, 40.0))
    speed = best * paper.WIND / made.radius
    electric = paper.POLE_PAIRS * paper.SPEED * paper.FLUX * math.sqrt(1.5)
    gain, law = made.gain(), turbine().control.torque.optimal_gain
    return [
        claim(
            "peak",
            f"{standard * 1e-6:.2f} MW ({100 * (standard / paper.POWER - 1):+.1f} %) at "
            f"{speed:.4f} rad/s ({100 * (speed / paper.SPEED - 1):+.1f} %)",
            abs(standard / paper.POWER - 1.0) <= 0.025 and abs(speeds[0] / paper.SPEED - 1.0) <= 0.025,
        ),
        claim(
            "peaks by density",
            f"largest deviation {max(abs(r) for r in ratios):.1e}",
            max(abs(r) for r in ratios) <= 1e-6,
        ),
        _peaks("°C", PEAKS, peaks, "Fig. 4"),
        _peaks("m", HIGH_PEAKS, heights, "Fig. 5"),
        claim("speed of the peak", f"{min(speeds):.4f} to {max(speeds):.4f} rad/s", max(speeds) - min(speeds) < 1e-9),
        claim("over rated", f"below {warmest:.1f} °C", warmest <= 0.0),
        claim(
            "voltage",
            f"{electric:,.0f} V ({100 * (electric / paper.VOLTAGE - 1):+.2f} %)",
            abs(electric / paper.VOLTAGE - 1.0) <= 0.01,
        ),
        claim(
            "K_T",
            f"{gain * 1e-6:.2f} and {law * 1e-6:.2f} MN m s²",
            abs(gain / 5.377e7 - 1.0) <= 1e-3 and abs(law / gain - 1.0) <= 1e-3,
        ),
    ]


def counted_pressure(rain: Rain) -> float:
    """[Pa] of (6) to (10) step by step, with sums over the spectrum in place of closed forms, over v_r^2."""
    slope = float(spectrum_slope(rain.intensity))
    d = np.linspace(SMALLEST, LARGEST, 20001)
    n = INTERCEPT * np.exp(-slope * d)
    if rain.mode == "seed":
        diameter = rain.diameter * 1e-3
        force = rain.water_density * math.pi * diameter**2 / 3.0  # (7) over v_r^2
        share = math.pi * diameter**3 / 6.0 * float(np.trapezoid(n, d))  # (8), (9)
        return force * share / (0.25 * math.pi * diameter**2)  # (6)
    return float(np.trapezoid(4.0 / 3.0 * rain.water_density * math.pi / 6.0 * d**3 * n, d))


def shadow(radius: float, half: float, rain: tuple[float, float, float]) -> float:
    """[m^3/s] rain that hits a spheroid of a radius and half thickness [m]: projected area times rain velocity.

    Summed over the spheroid's surface: half of the size of the rain's velocity [m/s] along each piece's normal.
    """
    polar = (np.arange(400) + 0.5) * np.pi / 400.0
    turn = ((np.arange(800) + 0.5) * 2.0 * np.pi / 800.0)[:, None]
    across = radius * half * np.sin(polar) ** 2
    along = radius**2 * np.sin(polar) * np.cos(polar)
    met = rain[0] * along + (rain[1] * np.cos(turn) + rain[2] * np.sin(turn)) * across
    return float(0.5 * np.abs(met).sum() * (np.pi / 400.0) * (2.0 * np.pi / 800.0))


def _rain() -> list[Claim]:
    rains = [Rain(rate=r, mode="seed", diameter=d) for r in RAIN_CLASSES.values() for d in (0.3, 1.0, 2.0, 3.0)]
    rains += [Rain(rate=r) for r in RAIN_CLASSES.values()]
    area = math.pi * paper.RADIUS**2
    counted = [counted_pressure(r) * paper.WIND**3 * area for r in rains]
    ours = [float(loss(r, paper.WIND)[0]) for r in rains]
    off = max(abs(a / b - 1.0) for a, b in zip(ours, counted, strict=True))
    flat = [float(wetness(s, paper.RADIUS, 2.0, tail=2.0, cross=1.0, fall=6.5)) / area for s in (paper.WIND, 1e6)]
    counted_area = shadow(paper.RADIUS, 2.0, (2.0 - paper.WIND, 1.0, -6.5)) / paper.WIND / area
    dry = driest_speed(paper.RADIUS, 2.0, 2.0, 1.0, 6.5)
    s = np.linspace(0.5, 25.0, 200001)
    lowest = float(s[np.argmin(wetness(s, paper.RADIUS, 2.0, tail=2.0, cross=1.0, fall=6.5))])
    against = np.diff(wetness(s, paper.RADIUS, 2.0, tail=-2.0, cross=1.0, fall=6.5))
    counts = np.array([float(loss(Rain(rate=r, mode="seed"), 10.0)[0]) for r in RAIN_CLASSES.values()])
    numbers = np.array([counted_pressure(Rain(rate=r, mode="seed")) for r in RAIN_CLASSES.values()])
    sigmas = np.array([250.0, 500.0, 1000.0])
    lost = [float(loss(Rain(rate=32.0, mode="seed", water_density=x), 10.0)[0]) for x in sigmas]
    linear = max(
        float(np.ptp(counts / numbers) / np.mean(counts / numbers)),
        float(np.ptp(lost / sigmas) / np.mean(lost / sigmas)),
    )
    return [
        claim(
            "loss",
            f"largest difference {100 * off:.2g} %; 32 mm/h, 3 mm: {float(loss(STORM, paper.WIND)[0]) * 1e-6:.3f} MW",
            off <= 0.005,
        ),
        claim(
            "wetted area",
            f"{flat[0]:.4f}; {flat[1]:.6f}",
            abs(flat[0] - counted_area) <= 1e-3 and abs(flat[1] - 1.0) <= 1e-3,
            counted_area=counted_area,
        ),
        claim(
            "least wetness",
            f"found {lowest:.4f} m/s; {'falls' if bool(np.all(against < 0.0)) else 'rises'} throughout",
            abs(lowest - dry) < 1e-3 and bool(np.all(against < 0.0)),
            dry=dry,
        ),
        claim("drops", f"largest deviation {100 * linear:.1e} %", linear <= 0.01),
    ]


def _speeds() -> list[Claim]:
    made = rotor(BLADES)
    found = {b: made.speed_for(paper.REFERENCE, STANDARD, math.radians(b)) for b in WIDE}
    off = {b: found[b] / x - 1.0 for b, x in WIDE.items()}
    low = found[0.0]
    angles = np.arange(0.5, 12.01, 0.05)
    speeds = np.array([made.speed_for(paper.REFERENCE, STANDARD, float(np.radians(b))) for b in angles])
    begins = float(angles[np.max(np.flatnonzero(speeds >= low))])
    formula = rotor(FORMULA)
    heier = min(formula.speed_for(paper.REFERENCE, STANDARD, math.radians(b)) for b in (2.0, 5.0, 8.0, 10.0))
    return [
        claim(
            "speeds by pitch",
            listed(found.values(), ".3f") + " rad/s",
            max(abs(x) for x in off.values()) <= 0.03,
            angles=listed(WIDE),
            speeds=listed(WIDE.values(), ".3f"),
        ),
        claim(
            "extra range",
            f"from {begins:.1f}° of pitch on with M3; M1 has none up to 10° ({heier:.3f} against "
            f"{formula.speed_for(paper.REFERENCE):.3f} rad/s)",
            4.0 <= begins <= 6.0 and heier > formula.speed_for(paper.REFERENCE),
        ),
        claim(
            "optimum speed",
            f"{formula.speed_for(paper.REFERENCE):.4f} rad/s, {formula.wind_for(paper.REFERENCE):.3f} m/s",
            abs(formula.speed_for(paper.REFERENCE) / 0.6534 - 1.0) < 1e-3,
        ),
    ]


REASONS = reasons_of("palanimuthu2022")
"""Why numbers differ, or what there is to know."""
