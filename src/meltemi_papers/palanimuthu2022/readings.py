"""Where the paper errs or is unclear: its words, our reading, and what each of them gives, computed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from meltemi.environment.air import CELSIUS, R_DRY, R_VAPOUR, site_pressure, vapour_pressure
from meltemi.environment.drops import MM_PER_HOUR, WATER, drop_count, mean_diameter, spectrum_slope, water_content
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.environment.site import STANDARD
from meltemi.report.html import Table
from meltemi_papers.palanimuthu2022 import paper
from meltemi_papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor

DROP = paper.DROP * 1e-3
"""[m]."""
INERTIAS = {"2.93e9 (rotor of the reference blades)": 2.93e9, "4.872e9": 4.872e9, "4.872e6 (as printed)": 4.872e6}
"""[kg m^2] readings of Table 1's "4.872 Mnm"."""


@dataclass(frozen=True)
class Reading:
    """A ruling.

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


def printed_density(temperature: float, humidity: float, altitude: float, zero: float) -> float:
    """[kg/m^3] of air of a temperature [degC] with another zero [K] in the dry part, as the paper prints eq. (2)."""
    kelvin = temperature + CELSIUS
    vapour = float(vapour_pressure(kelvin, humidity))
    dry = float(site_pressure(kelvin, altitude)) - vapour
    return dry / (R_DRY * (temperature + zero)) + vapour / (R_VAPOUR * kelvin)


def time_constant(inertia: float, wind: float = 10.0) -> float:
    """[s] in which the speed settles under the optimal law: J / (3 K_T omega)."""
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
        Reading("E-E1", "273.5 in (2)", _four(0.4, 273.5), "273.15", f"{_four(0.4)}; printed are the latter"),
        Reading(
            "E-E2",
            "humidity 20 %; fall of 15.5 and 12 % over 2,000 m",
            f"{_four(0.2)}; {across[0]:.1f}, {across[1]:.1f} % are from -10 to 35 °C at 0 and 2,000 m",
            "humidity 40 %, pairs exchanged",
            f"{_four(0.4)}; over 2,000 m {drops[0]:.1f} % at -10, {drops[1]:.1f} % at 35 °C",
        ),
        Reading(
            "E-E3",
            "density grows when the pressure decreases",
            f"1,040 to 980 hPa: {high:.4f} to {low:.4f} kg/m³",
            "it grows with the pressure",
            f"980 to 1,040 hPa: {low:.4f} to {high:.4f} kg/m³",
        ),
        Reading(
            "E-E4",
            "humidity matters below 20 °C",
            f"0 to 100 %: -{weights[0]:.2f} % at 0, -{weights[1]:.2f} % at 10 °C",
            "it matters above",
            f"-{weights[2]:.2f} % at 20, -{weights[3]:.2f} % at 35 °C",
        ),
        Reading(
            "E-E20",
            "more than rated power at temperatures below zero",
            f"at 10 °C 21.2 MW become {_mega(over[0])}",
            "at all below 15 °C",
            f"{_mega(over[1])} at -10 °C; with C_p 0.48 {float(plain) * 1e-6:.2f} MW at 15 °C",
        ),
        Reading(
            "E-E21",
            "onshore the altitude can be taken as 0",
            f"{inland[0]:.4f} kg/m³",
            "offshore; onshore it is a parameter",
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
        Reading(
            "E-E5",
            "C_p 0.48 at 10.715 m/s, 0.75 rad/s, 21.2 MW",
            f"0.75 rad/s: λ = {paper.SPEED * paper.RADIUS / paper.WIND:.3f}; 21.2 MW: C_p = {paper.POWER / power:.4f}",
            "C_p 0.48 at λ = 9.5085",
            f"{c * power * 1e-6:.2f} MW ({100.0 * (c * power / paper.POWER - 1.0):+.1f} %) at "
            f"{ratio * paper.WIND / made.radius:.4f} rad/s",
        ),
        Reading(
            "E-E6",
            "J = 4.872 Mnm",
            f"4.872e6 kg m²: {reading(small)}; 4.872e9: {reading(large)}",
            "2.93e9 kg m², the blades' own",
            reading(physical),
        ),
        Reading(
            "E-E7", "R_g = 1750 mΩ", f"{_mega(losses[0])} lost at 20 MW", "1.75 mΩ", f"{losses[1] * 1e-3:.1f} kW lost"
        ),
        Reading(
            "E-E8",
            "K_T with λ",
            f"{wrong:.3g} N m s²: {wrong * speed**2 * 1e-6:.0f} MN m at the best point of 10 m/s",
            "λ³",
            f"{right:.4g} N m s²: {right * speed**2 * 1e-6:.1f} MN m, the air's own",
        ),
        Reading(
            "E-E19",
            "MPPT from (1) and (2)",
            "(2) is a density",
            "from (1)",
            f"P_opt at 10 m/s: {right * speed**3 * 1e-6:.2f} MW at {speed:.4f} rad/s",
        ),
        Reading(
            "E-E23",
            "region 3: power kept to a minimum",
            "0 MW",
            "limited to rated",
            f"at 14 m/s 20 of {much * 1e-6:.1f} MW that the best point would give",
        ),
        Reading(
            "E-E24",
            "21.2 MW of the air, 20 MW of the stator, B_m 200 N m s/rad",
            f"friction takes {200.0 * paper.SPEED**2:.0f} W, the rest is nowhere; 21.2 MW at {rated[1]:.2f} m/s",
            "rated by the stator",
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
        Reading(
            "E-E9",
            "Λ = 4.1 I^0.21 per cm",
            f"{water[0]:.2f} kg of water in 1 m³ at 1 mm/h",
            "4.1 I^-0.21 per mm",
            f"{water[1] * 1e3:.3f} g",
        ),
        Reading(
            "E-E10",
            "F_d = F(τ) alpha W S, put into (10)",
            f"{force * volume * area * section:.3g} N m⁴",
            "F(τ) alpha W / S, put into (6)",
            f"{force * volume * area / section * 1e-3:.0f} kN",
        ),
        Reading(
            "E-E11",
            "W is a width (or a function, or a swept area); a is the swept area",
            f"with W = 2R: {force * volume / section * 2.0 * paper.RADIUS:.0f} N/m",
            "W is an area, a half the thickness of the spheroid",
            f"with W = πR²: {force * volume / section * area * 1e-3:.0f} kN",
        ),
        Reading(
            "E-E12",
            "rain term with the density of air",
            f"{_storm_loss(water_density=STANDARD) * 1e-3:.1f} kW",
            "of water",
            f"{storm * 1e-6:.2f} MW",
        ),
        Reading(
            "E-E13",
            "V_w in (11), v_r in (14)",
            f"v_r = fall speed of 3 mm drops: {_mega(_storm_loss(drop_speed=Rain(rate=1.0, mode='seed').falling))}",
            "v_r = V_w",
            _mega(storm),
        ),
        Reading(
            "E-E14",
            "Fig. 14: 0.3 mm in the text, 3 mm in the caption; density sigma",
            f"0.3 mm: {_mega(_storm_loss(diameter=0.3))}",
            "3 mm; number N of drops",
            f"3 mm: {_mega(storm)}",
        ),
        Reading(
            "E-E15",
            "Fig. 8: a distribution in the text, the shape of a drop in the caption",
            "no number",
            "n(d)",
            f"32 mm/h: {count:.0f} drops in 1 m³, {float(mean_diameter(rate)) * 1e3:.2f} mm in the mean by mass",
        ),
        Reading(
            "E-E22",
            "all N drops have one diameter",
            f"{many * 1e3:.1f} g of water in 1 m³ at 32 mm/h: {_mega(storm)}",
            "integrated over the spectrum",
            f"{float(water_content(rate)) * 1e3:.2f} g: {_mega(_storm_loss(mode='integrated'))}",
        ),
    ]


def _control(gains: dict[float, float], speeds: tuple[float, float]) -> list[Reading]:
    formula, blades = rotor(FORMULA), rotor(BLADES)
    low = formula.speed_for(paper.REFERENCE)
    angles = np.radians([2.0, 4.0, 6.0, 8.0])
    at = ", ".join(f"{blades.speed_for(paper.REFERENCE, STANDARD, float(b)):.3f}" for b in angles)
    return [
        Reading(
            "E-E16",
            "Fig. 6: six steps of 100 s, gains in 100-200 s and 600-700 s",
            f"without a lead-in 100-200 s has 30 °C: {gains[30.0] * 1e-3:.1f} kW; 600-700 s has nothing",
            "100 s at 15 °C before",
            f"40 °C {gains[40.0] * 1e-3:.1f} kW, -10 °C {gains[-10.0] * 1e-3:.1f} kW (of the air, at the end; M1, "
            "2.93e9 kg m²)",
        ),
        Reading(
            "E-E17",
            "Fig. 17: pitch from rated speed; Fig. 21, case i: held at the optimum speed",
            f"A1: mean {speeds[1]:.3f} rad/s while it limits",
            "case i is A0",
            f"A0: mean {speeds[0]:.3f} rad/s; ω_l = {low:.3f} (M1), {blades.speed_for(paper.REFERENCE):.3f} rad/s (M3)",
        ),
        Reading(
            "E-E18",
            "Fig. 19 has the caption of Fig. 18",
            "no number",
            "the scheme of largest range, A3",
            f"ω_opt at 2, 4, 6, 8° (M3): {at} rad/s, against ω_l = {blades.speed_for(paper.REFERENCE):.3f}",
        ),
    ]


def readings(gains: dict[float, float], speeds: tuple[float, float]) -> list[Reading]:
    """All, in the order of their numbers.

    Args:
      gains: [W] by temperature [degC] of Figure 6 with M1 and the default inertia, at the end of the intervals.
      speeds: [rad/s] mean rotor speed of A0 and A1 while power is limited.
    """
    found = [*_air(), *_machine(), *_rain(), *_control(gains, speeds)]
    return sorted(found, key=lambda r: int(r.key.removeprefix("E-E")))


def readings_table(found: list[Reading]) -> Table:
    """Both readings as numbers."""
    head = ["", "the paper", "which gives", "read as", "which gives"]
    rows = [[r.key, r.paper, r.theirs, r.reading, r.ours] for r in found]
    return Table(head, rows, "Errors and gaps of the paper, both readings", text_columns=len(head))
