"""Errors and ambiguities of the paper: its statement, our reading, and computed results of both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from meltemi.environment.air import CELSIUS, R_DRY, R_VAPOUR, site_pressure, vapour_pressure
from meltemi.environment.drops import MM_PER_HOUR, WATER, drop_count, mean_diameter, spectrum_slope, water_content
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi_papers.claim import rows_of
from meltemi_papers.palanimuthu2022 import paper
from meltemi_papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi_reports.blocks import Table

STATED = rows_of("palanimuthu2022", "readings.csv")
"""The paper's words and our reading, by number."""
DROP = paper.DROP * 1e-3
"""[m]."""
INERTIAS = {"2.93e9 (rotor of the reference blades)": 2.93e9, "4.872e9": 4.872e9, "4.872e6 (as printed)": 4.872e6}
"""[kg m^2] readings of Table 1's "4.872 Mnm"."""


@dataclass(frozen=True)
class Reading:
    """An ambiguity of the paper and our reading of it.

    Attributes:
      key: number in the list of the paper's errors.
      paper: what it says.
      theirs: what this gives.
      reading: how we read it.
      ours: what that gives.
    """

    key: str
    paper: str
    theirs: str
    reading: str
    ours: str


def _ruled(key: str, theirs: str, ours: str) -> Reading:
    return Reading(key=key, theirs=theirs, ours=ours, **STATED[key])


def printed_density(temperature: float, humidity: float, altitude: float, zero: float) -> float:
    """[kg/m^3] of air of a temperature [degC] with another zero [K] in the dry part, as the paper prints eq. (2)."""
    kelvin = temperature + CELSIUS
    vapour = float(vapour_pressure(kelvin, humidity))
    dry = float(site_pressure(kelvin, altitude)) - vapour
    return dry / (R_DRY * (temperature + zero)) + vapour / (R_VAPOUR * kelvin)


def time_constant(inertia: float, wind: float = 10.0) -> float:
    """[s] time constant of the rotor speed under the optimal torque law: J / (3 K_T omega)."""
    made = rotor(FORMULA)
    ratio, _ = made.best()
    return inertia / (3.0 * made.gain() * ratio * wind / made.radius)


def inertia_constant(inertia: float) -> float:
    """[s] kinetic energy at rated speed over rated power."""
    return 0.5 * inertia * paper.SPEED**2 / paper.STATOR_POWER


def _four(humidity: float, zero: float = CELSIUS) -> str:
    return " / ".join(f"{printed_density(t, humidity, h, zero):.4f}" for t, h in paper.DENSITIES)


def _storm_loss(**changes: float | str) -> float:
    settings = {"rate": paper.RATE, "mode": "seed", "diameter": paper.DROP, **changes}
    return float(rain_power_loss(rain_parameters(Rain(**settings), paper.RADIUS), paper.WIND))  # type: ignore[arg-type]


def _mega(watts: float) -> str:
    return f"{watts * 1e-6:.3g} MW"


def _air() -> list[Reading]:
    drops = [100.0 * (1.0 - density(t, 0.4, 2000.0) / density(t, 0.4)) for t in (-10.0, 35.0)]
    across = [100.0 * (1.0 - density(35.0, 0.4, h) / density(-10.0, 0.4, h)) for h in (0.0, 2000.0)]
    weights = [100.0 * (1.0 - density(t, 1.0) / density(t)) for t in (0.0, 10.0, 20.0, 35.0)]
    low, high = (float(density(15.0)) * p / 101325.0 for p in (98000.0, 104000.0))
    plain = rotor(FORMULA).power(paper.WIND * rotor(FORMULA).best()[0] / paper.RADIUS, paper.WIND)
    over = [paper.POWER * float(density(t)) / STANDARD for t in (10.0, -10.0)]
    inland = [float(density(15.0, 0.0, h)) for h in (0.0, 1500.0)]
    return [
        _ruled("E-E1", _four(0.4, 273.5), f"{_four(0.4)}; printed are the latter"),
        _ruled(
            "E-E2",
            f"{_four(0.2)}; {across[0]:.1f}, {across[1]:.1f} % are from -10 to 35 °C at 0 and 2,000 m",
            f"{_four(0.4)}; over 2,000 m {drops[0]:.1f} % at -10, {drops[1]:.1f} % at 35 °C",
        ),
        _ruled(
            "E-E3",
            f"1,040 to 980 hPa: {high:.4f} to {low:.4f} kg/m³",
            f"980 to 1,040 hPa: {low:.4f} to {high:.4f} kg/m³",
        ),
        _ruled(
            "E-E4",
            f"0 to 100 %: -{weights[0]:.2f} % at 0, -{weights[1]:.2f} % at 10 °C",
            f"-{weights[2]:.2f} % at 20, -{weights[3]:.2f} % at 35 °C",
        ),
        _ruled(
            "E-E20",
            f"at 10 °C 21.2 MW become {_mega(over[0])}",
            f"{_mega(over[1])} at -10 °C; with C_p 0.48 {float(plain) * 1e-6:.2f} MW at 15 °C",
        ),
        _ruled(
            "E-E21",
            f"{inland[0]:.4f} kg/m³",
            f"at 1,500 m {inland[1]:.4f} kg/m³, {100.0 * (inland[1] / inland[0] - 1.0):.1f} %",
        ),
    ]


def _machine() -> list[Reading]:
    made = rotor(FORMULA)
    ratio, c = made.best()
    power = 0.5 * STANDARD * made.area * paper.WIND**3
    current = paper.STATOR_POWER / (math.sqrt(3.0) * paper.GRID_VOLTAGE)
    losses = [3.0 * current**2 * r for r in (1.75, 1.75e-3)]
    speed = ratio * 10.0 / made.radius
    wrong, right = made.gain() * ratio**2, made.gain()
    rated = made.wind_for(paper.STATOR_POWER), made.wind_for(paper.POWER)
    much = float(made.power(ratio * 14.0 / made.radius, 14.0))

    def reading(inertia: float) -> str:
        return f"H {inertia_constant(inertia):.2g} s, time constant {time_constant(inertia):.2g} s"

    physical, large, small = INERTIAS.values()
    return [
        _ruled(
            "E-E5",
            f"0.75 rad/s: λ = {paper.SPEED * paper.RADIUS / paper.WIND:.3f}; 21.2 MW: C_p = {paper.POWER / power:.4f}",
            f"{c * power * 1e-6:.2f} MW ({100.0 * (c * power / paper.POWER - 1.0):+.1f} %) at "
            f"{ratio * paper.WIND / made.radius:.4f} rad/s",
        ),
        _ruled("E-E6", f"4.872e6 kg m²: {reading(small)}; 4.872e9: {reading(large)}", reading(physical)),
        _ruled("E-E7", f"{_mega(losses[0])} lost at 20 MW", f"{losses[1] * 1e-3:.1f} kW lost"),
        _ruled(
            "E-E8",
            f"{wrong:.3g} N m s²: {wrong * speed**2 * 1e-6:.0f} MN m at the best point of 10 m/s",
            f"{right:.4g} N m s²: {right * speed**2 * 1e-6:.1f} MN m, the air's own",
        ),
        _ruled("E-E19", "(2) is a density", f"P_opt at 10 m/s: {right * speed**3 * 1e-6:.2f} MW at {speed:.4f} rad/s"),
        _ruled("E-E23", "0 MW", f"at 14 m/s 20 of {much * 1e-6:.1f} MW that the best point would give"),
        _ruled(
            "E-E24",
            f"friction takes {200.0 * paper.SPEED**2:.0f} W, the rest is nowhere; 21.2 MW at {rated[1]:.2f} m/s",
            f"20 MW at {rated[0]:.2f} m/s",
        ),
    ]


def _rain() -> list[Reading]:
    one = MM_PER_HOUR
    slopes = (410.0, float(spectrum_slope(one)))
    water = [math.pi * WATER * 8e6 / slope**4 for slope in slopes]
    rate = paper.RATE * MM_PER_HOUR
    count = float(drop_count(rate))
    force = WATER * math.pi * DROP**2 * paper.WIND**2 / 3.0  # (7)
    volume, section, area = math.pi * DROP**3 * count / 6.0, 0.25 * math.pi * DROP**2, math.pi * paper.RADIUS**2
    storm, many = _storm_loss(), WATER * volume
    return [
        _ruled("E-E9", f"{water[0]:.2f} kg of water in 1 m³ at 1 mm/h", f"{water[1] * 1e3:.3f} g"),
        _ruled(
            "E-E10", f"{force * volume * area * section:.3g} N m⁴", f"{force * volume * area / section * 1e-3:.0f} kN"
        ),
        _ruled(
            "E-E11",
            f"with W = 2R: {force * volume / section * 2.0 * paper.RADIUS:.0f} N/m",
            f"with W = πR²: {force * volume / section * area * 1e-3:.0f} kN",
        ),
        _ruled("E-E12", f"{_storm_loss(water_density=STANDARD) * 1e-3:.1f} kW", f"{storm * 1e-6:.2f} MW"),
        _ruled(
            "E-E13",
            f"v_r = fall speed of 3 mm drops: {_mega(_storm_loss(drop_speed=Rain(rate=1.0, mode='seed').falling))}",
            _mega(storm),
        ),
        _ruled("E-E14", f"0.3 mm: {_mega(_storm_loss(diameter=0.3))}", f"3 mm: {_mega(storm)}"),
        _ruled(
            "E-E15",
            "no number",
            f"32 mm/h: {count:.0f} drops in 1 m³, {float(mean_diameter(rate)) * 1e3:.2f} mm in the mean by mass",
        ),
        _ruled(
            "E-E22",
            f"{many * 1e3:.1f} g of water in 1 m³ at 32 mm/h: {_mega(storm)}",
            f"{float(water_content(rate)) * 1e3:.2f} g: {_mega(_storm_loss(mode='integrated'))}",
        ),
    ]


def _control(gains: dict[float, float], speeds: tuple[float, float]) -> list[Reading]:
    formula, blades = rotor(FORMULA), rotor(BLADES)
    low = formula.speed_for(paper.REFERENCE)
    angles = np.radians([2.0, 4.0, 6.0, 8.0])
    at = ", ".join(f"{blades.speed_for(paper.REFERENCE, STANDARD, float(b)):.3f}" for b in angles)
    return [
        _ruled(
            "E-E16",
            f"without a lead-in 100-200 s has 30 °C: {gains[30.0] * 1e-3:.1f} kW; 600-700 s has nothing",
            f"40 °C {gains[40.0] * 1e-3:.1f} kW, -10 °C {gains[-10.0] * 1e-3:.1f} kW (aerodynamic, means; M1, dry, "
            "2.93e9 kg m²)",
        ),
        _ruled(
            "E-E17",
            f"A1: mean {speeds[1]:.3f} rad/s while it limits",
            f"A0: mean {speeds[0]:.3f} rad/s; ω_l = {low:.3f} (M1), {blades.speed_for(paper.REFERENCE):.3f} rad/s (M3)",
        ),
        _ruled(
            "E-E18",
            "no number",
            f"ω_opt at 2, 4, 6, 8° (M3): {at} rad/s, against ω_l = {blades.speed_for(paper.REFERENCE):.3f}",
        ),
    ]


def readings(gains: dict[float, float], speeds: tuple[float, float]) -> list[Reading]:
    """All readings, in the order of their numbers.

    Args:
      gains: [W] by temperature [degC] of Figure 6 with M1 and the default inertia, means over the intervals.
      speeds: [rad/s] mean rotor speed of A0 and A1 while power is limited.
    """
    found = {r.key: r for r in (*_air(), *_machine(), *_rain(), *_control(gains, speeds))}
    return [found[key] for key in STATED]


def readings_table(found: list[Reading]) -> Table:
    """Table of the results of both readings."""
    head = ["", "the paper", "which gives", "read as", "which gives"]
    rows = [[r.key, r.paper, r.theirs, r.reading, r.ours] for r in found]
    return Table(head, rows, "Errors and gaps of the paper, both readings", text_columns=len(head))
