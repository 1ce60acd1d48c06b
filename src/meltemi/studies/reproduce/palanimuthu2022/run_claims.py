"""Lines of the paper that need runs: Figures 6, 7, 20 and 21."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import STANDARD
from meltemi.postprocess.ensemble import Estimate, mean_interval, travel
from meltemi.report.html import Table
from meltemi.simulation.result import Result
from meltemi.studies.reproduce.claim import Claim, holds
from meltemi.studies.reproduce.palanimuthu2022 import paper
from meltemi.studies.reproduce.palanimuthu2022.machine import BLADES, CALIBRATED, FORMULA, density, rotor
from meltemi.studies.reproduce.palanimuthu2022.runs import (
    COLD,
    CONVERTERS,
    HOT,
    PHYSICAL,
    RAMPS,
    SCHEMES,
    SETTLING,
    STEADY,
    Runs,
    Steps,
    aero_power,
    power_ratio,
    ratio,
)

Float = NDArray[np.float64]
WEAK_END = 55.0
"""[s] until which the wind of the ramps is 9 m/s and the rotor settled."""
MOVES = np.radians(0.01)
"""[rad/s] above which the pitch is moving."""


def gains(steps: Steps) -> Float:
    """(levels,) [W] of the air that case ii wins at the end of each interval."""
    return steps.settled("ii", "", aero_power) - steps.settled("i", "", aero_power)


def closed_gains(steps: Steps) -> Float:
    """(levels,) [W] the same in closed form, without losses and without motion."""
    made = rotor(steps.model)
    best = [0.5 * float(rho) * made.area * made.best()[1] * STEADY**3 for rho in _densities(steps)]
    fixed = [made.settled_power(STEADY, STANDARD, float(rho)) for rho in _densities(steps)]
    return np.array(best) - np.array(fixed)


def _densities(steps: Steps) -> Float:
    return density(np.array(steps.levels), steps.humidity)


def run_claims(runs: Runs) -> list[Claim]:
    """Every line that needs runs."""
    return [*_temperature(runs), *_humidity(runs), *_climates(runs), *_limited(runs)]


def _kilo(values: Float, digits: int = 1) -> str:
    return ", ".join(f"{x * 1e-3:.{digits}f}" for x in values)


def _temperature(runs: Runs) -> list[Claim]:
    found = []
    literal = next(s for s in runs.temperature.values() if s.model == FORMULA and s.inertia != PHYSICAL)
    best = literal.settled("ii", "", ratio), literal.settled("ii", "", power_ratio)
    fixed = literal.settled("i", "", ratio)
    off = np.abs(best[0] / paper.TIP_SPEED_RATIO - 1.0).max(), np.abs(best[1] / paper.POWER_COEFFICIENT - 1.0).max()
    found += [
        Claim(
            "case ii: λ and C_p at all temperatures",
            "9.5085, 0.48",
            f"{best[0].min():.4f} to {best[0].max():.4f}, {best[1].min():.4f} to {best[1].max():.4f}",
            holds(bool(off[0] <= 0.005 and off[1] <= 0.01)),
            "Fig. 6",
            tolerance="0.5 %, 1 %",
        ),
        Claim(
            "case i: λ from 40 to -10 °C",
            "gradually increased",
            ", ".join(f"{x:.3f}" for x in fixed),
            holds(bool(np.all(np.diff(fixed) > 0.0))),
            "Fig. 6",
        ),
    ]
    for name, steps in runs.temperature.items():
        if name == CONVERTERS:
            continue  # the same shaft
        won, closed = gains(steps), closed_gains(steps)
        ends = won[[0, -1]]
        band = 0.02 if steps.model == CALIBRATED else 0.35
        ratios = ends / np.array([paper.GAINS[40.0], paper.GAINS[-10.0]]) - 1.0
        ok = bool(np.all(np.abs(ratios) <= band) and ends[1] > ends[0] and np.all(won > 0.0))
        found.append(
            Claim(
                f"gain of case ii at 40 and -10 °C, {name}",
                "58.2, 71.3 kW",
                f"{_kilo(ends)} kW ({100 * ratios[0]:+.0f}, {100 * ratios[1]:+.0f} %); "
                f"closed form {_kilo(closed[[0, -1]])}",
                holds(ok),
                "Fig. 6",
                "" if steps.model == CALIBRATED else "formula",
                f"{100 * band:g} %",
            )
        )
    return found


def _humidity(runs: Runs) -> list[Claim]:
    steps, made = runs.humidity, rotor(FORMULA)
    one, two, three = (steps.settled(case, "", aero_power) for case in ("i", "ii", "iii"))
    air = density(35.0, np.array(steps.levels))
    dry = float(density(35.0))
    expected = np.array(
        [
            [made.settled_power(STEADY, assumed or float(rho), float(rho)) for assumed in (STANDARD, dry, 0.0)]
            for rho in air
        ]
    )
    off = max(float(np.abs(x - expected[:, k]).max()) for k, x in enumerate((one, two, three)))
    return [
        Claim(
            "power: case iii over ii over i, 0 to 100 %",
            "case iii greater than i and ii",
            f"iii - i {_kilo(three - one)} kW; iii - ii {_kilo(three - two, 2)} kW",
            holds(bool(np.all(three - one > 0.0) and np.all(three[1:] > two[1:]) and np.all(two > one))),
            "Fig. 7",
        ),
        Claim(
            "power of the three cases against their closed forms",
            "C_p/λ³ law",
            f"largest difference {off * 1e-3:.3f} kW",
            holds(off <= 1e3),
            "Fig. 7",
            tolerance="1 kW",
        ),
        Claim(
            "humidity, 0 to 100 % at 35 °C",
            "enormously impacts the density",
            f"power {100 * (three[-1] / three[0] - 1):+.1f} %; to know it in the torque law wins "
            f"{100 * (three[-1] / two[-1] - 1):.3f} %",
            holds(bool(three[-1] < 0.99 * three[0]), "small"),
            "Fig. 7",
            "small",
        ),
    ]


def _climates(runs: Runs) -> list[Claim]:
    one, two = (runs.climate[RAMPS, case] for case in ("i", "ii"))
    expected = HOT.at([0.0])[-1][0] / COLD.at([0.0])[-1][0]
    inside = (one.time > WEAK_END - 5.0) & (one.time < WEAK_END)

    def change(of: Float, to: Float) -> float:
        return 100.0 * float(to[inside].mean() / of[inside].mean() - 1.0)

    power, torque = change(aero_power(one), aero_power(two)), change(one["generator_torque"], two["generator_torque"])
    same = [abs(change(f(one), f(two))) for f in (ratio, power_ratio)]
    speed = change(one["rotor_speed"], two["rotor_speed"])
    cold, hot = (rotor(FORMULA).wind_for(paper.POWER, float(air.at([0.0])[-1][0])) for air in (COLD, HOT))
    pitch = [float(np.degrees(r["pitch_1"][(r.time > 270.0) & (r.time < 300.0)].mean())) for r in (one, two)]
    begins = [float(r.time[np.argmax(np.degrees(r["pitch_1"]) > 0.5)]) for r in (one, two)]
    return [
        Claim(
            "P and T below rated, case ii against i",
            f"{100 * (expected - 1):+.2f} % (of the density)",
            f"{power:+.2f}, {torque:+.2f} %",
            holds(abs(power + 7.08) <= 0.3 and abs(torque + 7.08) <= 0.3),
            "Fig. 20",
            tolerance="0.3 points",
        ),
        Claim(
            "ω, λ, C_p below rated, case ii against i",
            "equal",
            f"{speed:+.3f}, {same[0]:.3f}, {same[1]:.3f} % apart",
            holds(max(abs(speed), *same) <= 1.0),
            "Fig. 20",
            tolerance="1 %",
        ),
        Claim(
            "wind that gives 21.2 MW: cases i, ii",
            "10.64, 10.91 m/s: x 1.0248 (of the density)",
            f"{cold:.2f}, {hot:.2f} m/s: x {hot / cold:.4f}",
            holds(abs(hot / cold / 1.0248 - 1.0) <= 0.01),
            "Fig. 20",
            tolerance="1 %",
        ),
        Claim(
            "pitch in case ii: begins later and is lower (ramps, 12 m/s)",
            "later, lower",
            f"at {begins[0]:.1f} and {begins[1]:.1f} s; {pitch[0]:.2f} and {pitch[1]:.2f}°",
            holds(begins[1] > begins[0] and pitch[1] < pitch[0]),
            "Fig. 20",
        ),
    ]


def judged(result: Result) -> Result:
    """Without the begin."""
    return result.between(SETTLING, float(result.time[-1]))


def limiting(result: Result) -> NDArray[np.bool_]:
    """While there is more wind than the reference needs, and has been for some time."""
    return np.asarray((result["wind_x"] > 9.6) & (result["generator_power"] > 0.98 * paper.REFERENCE))


def pitch_travel(result: Result) -> float:
    """[deg]."""
    part = judged(result)
    return float(np.degrees(travel(part, "pitch_1") * (part.time[-1] - part.time[0])))


def moving(result: Result) -> float:
    """Share of the time in which the pitch moves."""
    part = judged(result)
    return float(np.mean(np.abs(np.diff(part["pitch_1"]) / np.diff(part.time)) > MOVES))


def mean_speed(runs: Runs, model: str, scheme: str) -> float:
    """[rad/s] of the rotor while power is limited, in the ramps."""
    part = judged(runs.limited[model, PHYSICAL, RAMPS, scheme])
    return float(part["rotor_speed"][limiting(part)].mean())


def _limited(runs: Runs) -> list[Claim]:
    found = []
    for scheme, case in (("A0", "i"), ("A2", "ii")):
        powers = []
        for (model, inertia, _, name), result in runs.limited.items():
            if (model, inertia, name) == (BLADES, PHYSICAL, scheme):
                part = judged(result)
                powers.append(float(part["generator_power"][part["wind_x"] > 9.6].mean()) / paper.REFERENCE - 1.0)
        found.append(
            Claim(
                f"power of {scheme} (case {case}) where the wind is above 9.6 m/s",
                "15 MW",
                f"{100 * min(powers):+.2f} to {100 * max(powers):+.2f} % ({len(powers)} winds)",
                holds(max(abs(x) for x in powers) <= 0.01),
                "Fig. 21",
                "recovery",
                "1 %",
            )
        )
    for model in (FORMULA, BLADES):
        low = rotor(model).speed_for(paper.REFERENCE)
        speed = mean_speed(runs, model, "A0")
        found.append(
            Claim(
                f"speed of A0 while it limits, {model}",
                f"ω_l = {low:.4f} rad/s",
                f"{speed:.4f} rad/s ({100 * (speed / low - 1):+.2f} %)",
                holds(abs(speed / low - 1.0) <= 0.01),
                "Fig. 21",
                "M3",
                "1 %",
            )
        )
    part = judged(runs.limited[BLADES, PHYSICAL, RAMPS, "A2"])
    speeds = part["rotor_speed"][limiting(part)]
    low = rotor(BLADES).speed_for(paper.REFERENCE)
    found.append(
        Claim(
            "speed of A2 while it limits (ramps)",
            f"between ω_l = {low:.3f} and ω_r = {paper.SPEED:g} rad/s",
            f"{speeds.min():.3f} to {speeds.max():.3f} rad/s",
            holds(bool(speeds.min() > 0.97 * low and speeds.max() < 1.05 * paper.SPEED)),
            "Fig. 21",
            "speed",
        )
    )
    for inertia in runs.setup.inertias:
        saved = travel_ratio(runs, inertia, "A2")
        change, width = 100.0 * (saved.mean - 1.0), 100.0 * saved.half_width
        found.append(
            Claim(
                f"pitch travel of A2 against A0 in turbulence, J {inertia:.4g} kg m²",
                "less pitch action",
                f"{change:+.0f} %" + (f" ± {width:.0f}" if saved.n > 1 else ""),
                holds(change <= -20.0),
                "Fig. 21",
                "buffer",
                "20 %",
            )
        )
    return found


def travel_ratio(runs: Runs, inertia: float, scheme: str) -> Estimate:
    """Pitch travel of a scheme over that of A0 in the turbulent winds, with an inertia [kg m^2]."""
    winds = [w for m, j, w, s in runs.limited if (m, j, s) == (BLADES, inertia, "A0") and w != RAMPS]
    pairs = [(runs.limited[BLADES, inertia, w, scheme], runs.limited[BLADES, inertia, w, "A0"]) for w in winds]
    return mean_interval(np.array([pitch_travel(a) / pitch_travel(b) for a, b in pairs]))


def gains_table(runs: Runs) -> Table:
    """Figure 6 in numbers: at the end of each interval, over all of it, and in closed form."""
    rows = []
    for name, steps in runs.temperature.items():
        over = steps.means("ii", "generator_power") - steps.means("i", "generator_power")
        where = "grid" if name == CONVERTERS else "generator"
        rows += [
            [name, "closed form", *(f"{x * 1e-3:.1f}" for x in closed_gains(steps))],
            [name, "end of the interval", *(f"{x * 1e-3:.1f}" for x in gains(steps))],
            [name, f"mean of the interval, {where}", *(f"{x * 1e-3:.1f}" for x in over)],
        ]
    rows.append(["paper", "", "58.2", *[""] * (len(paper.TEMPERATURES) - 2), "71.3"])
    head = ["reading", "", *(f"{t:g} °C" for t in paper.TEMPERATURES)]
    note = (
        "kW of case ii against case i, 10 m/s. With the blades' inertia the rotor still moves at the end of an "
        "interval and gives or takes kinetic energy within it; with 4.872e6 kg m² it follows at once."
    )
    return Table(head, rows, "Figure 6: what the adapted law wins", text_columns=2, note=note)


def schemes_table(runs: Runs) -> Table:
    """Figure 21 in numbers, over the turbulent winds."""
    rows = []
    for inertia in runs.setup.inertias:
        for scheme in SCHEMES:
            results = [
                judged(r)
                for (m, j, w, s), r in runs.limited.items()
                if (m, j, s) == (BLADES, inertia, scheme) and w != RAMPS
            ]
            full = [r["generator_power"][r["wind_x"] > 9.6] for r in results]
            values = (
                np.array([x.mean() for x in full]) * 1e-6,
                np.array([x.std() for x in full]) * 1e-6,
                np.array([pitch_travel(r) for r in results]),
                100.0 * np.array([moving(r) for r in results]),
                np.array([r["rotor_speed"].min() for r in results]),
                np.array([r["rotor_speed"].max() for r in results]),
            )
            cells = [f"{v.mean():.{d}f}" for v, d in zip(values, (3, 3, 0, 0, 3, 3), strict=True)]
            rows.append([f"{inertia:.4g}", scheme, *cells])
    head = [
        *("J [kg m²]", "scheme", "mean power [MW]", "its std [MW]", "pitch travel [deg]", "pitch moves [% of time]"),
        *("lowest speed [rad/s]", "highest"),
    ]
    note = (
        f"Means over {len(runs.setup.seeds)} seeds of ten minutes at 11 m/s, 10 %, without the first {SETTLING:g} s; "
        "power where the wind is above 9.6 m/s. M3, 15 °C."
    )
    return Table(head, rows, "Figure 21: schemes of active power control at 15 MW", text_columns=2, note=note)
