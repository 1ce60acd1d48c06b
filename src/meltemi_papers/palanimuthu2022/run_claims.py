"""Claims of the paper that need runs: Figures 7, 20, 21, and all together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.control.power_control.tables import NUMBER
from meltemi.environment.site import STANDARD
from meltemi.postprocess.ensemble import MeanEstimate, actuator_travel, mean_interval
from meltemi.report.html import Table
from meltemi.simulation.result import Result
from meltemi_papers.claim import Claim, claim_group, listed
from meltemi_papers.palanimuthu2022 import paper
from meltemi_papers.palanimuthu2022.figure6 import kilo, temperature_claims
from meltemi_papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi_papers.palanimuthu2022.paper import claim
from meltemi_papers.palanimuthu2022.rain_claims import rain_claims
from meltemi_papers.palanimuthu2022.runs import (
    COLD,
    HOT,
    PHYSICAL,
    RAMPS,
    SCHEMES,
    SETTLING,
    STEADY,
    Runs,
    aero_power,
    power_ratio,
    ratio,
)

Float = NDArray[np.float64]
OVER_FIXED, OVER_DRY = (26.8, 30.2, 33.8, 37.6, 41.7, 45.9), (0.0, 0.1, 0.4, 0.9, 1.6, 2.6)
"""[kW] of case iii over i and ii in Figure 7, by the paper's equations with M1."""
WEAK_END = 55.0
"""[s] until which the wind of the ramps is 9 m/s and the rotor settled."""
MOVES = np.radians(0.01)
"""[rad/s] above which the pitch is moving."""


def run_claims(runs: Runs) -> list[Claim]:
    """All claims that need runs."""
    return [
        *claim_group("temperature in steps", "Fig. 6", lambda: temperature_claims(runs)),
        *claim_group("humidity in steps", "Fig. 7", lambda: _humidity(runs)),
        *rain_claims(),
        *claim_group("two climates", "Fig. 20", lambda: _climates(runs)),
        *claim_group("15 MW under four schemes", "Fig. 21", lambda: _limited(runs)),
    ]


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
    wins = (three - one, np.array(OVER_FIXED)), (three - two, np.array(OVER_DRY))
    apart = max(float(np.abs(x - 1e3 * e).max()) for x, e in wins)
    wet, warm = (100.0 * float(a / b - 1.0) for a, b in ((air[-1], air[0]), (density(40.0), density(-10.0))))
    return [
        claim(
            "moist power",
            f"iii - i {kilo(three - one)} kW; iii - ii {kilo(three - two, 2)} kW",
            bool(np.all(three - one > 0.0) and np.all(three[1:] > two[1:]) and np.all(two > one)) and apart <= 1e3,
            fixed=listed(OVER_FIXED),
            dry=listed(OVER_DRY),
        ),
        claim("moist closed form", f"largest difference {off * 1e-3:.3f} kW", off <= 1e3),
        claim(
            "moist impact",
            f"density {wet:+.1f} %, power {100 * (three[-1] / three[0] - 1):+.1f} %; -10 to 40 °C makes {warm:+.1f} %; "
            f"to know the humidity in the torque law wins {100 * (three[-1] / two[-1] - 1):.3f} %",
            abs(wet) >= abs(warm) or "overstated",
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
    # of the runs: below rated the power goes with the wind's cube
    cold, hot = (
        float(r["wind_x"][inside].mean() * np.cbrt(paper.POWER / aero_power(r)[inside].mean())) for r in (one, two)
    )
    pitch = [float(np.degrees(r["pitch_1"][(r.time > 270.0) & (r.time < 300.0)].mean())) for r in (one, two)]
    begins = [float(r.time[np.argmax(np.degrees(r["pitch_1"]) > 0.5)]) for r in (one, two)]
    return [
        claim(
            "climate power",
            f"{power:+.2f}, {torque:+.2f} %",
            abs(power + 7.08) <= 0.3 and abs(torque + 7.08) <= 0.3,
            change=100 * (expected - 1),
        ),
        claim(
            "climate ratios", f"{abs(speed):.3f}, {same[0]:.3f}, {same[1]:.3f} % apart", max(abs(speed), *same) <= 1.0
        ),
        claim("climate wind", f"{cold:.2f}, {hot:.2f} m/s: x {hot / cold:.4f}", abs(hot / cold / 1.0248 - 1.0) <= 0.01),
        claim(
            "climate pitch",
            f"at {begins[0]:.1f} and {begins[1]:.1f} s; {pitch[0]:.2f} and {pitch[1]:.2f}°",
            begins[1] > begins[0] and pitch[1] < pitch[0],
        ),
    ]


def judged(result: Result) -> Result:
    """The result without its initial transient."""
    return result.between(SETTLING, float(result.time[-1]))


def limiting(result: Result) -> NDArray[np.bool_]:
    """Samples in which the controller limits the power."""
    return np.asarray(np.round(result["power_state"]) != NUMBER["maximum_power"])


def pitch_travel(result: Result) -> float:
    """[deg] pitch travel."""
    part = judged(result)
    return float(np.degrees(actuator_travel(part, "pitch_1") * (part.time[-1] - part.time[0])))


def moving(result: Result) -> float:
    """Fraction of the time in which the pitch moves."""
    part = judged(result)
    return float(np.mean(np.abs(np.diff(part["pitch_1"]) / np.diff(part.time)) > MOVES))


def mean_speed(runs: Runs, model: str, scheme: str) -> float:
    """[rad/s] of the rotor while power is limited, in the ramps."""
    part = judged(runs.limited[model, PHYSICAL, RAMPS, scheme])
    return float(part["rotor_speed"][limiting(part)].mean())


def range_of_speed(part: Result) -> Claim:
    """Range of rotor speed of A2 while it limits the power."""
    speeds = part["rotor_speed"][limiting(part)]
    low, high = rotor(BLADES).speed_for(paper.REFERENCE), paper.SPEED
    under, over = speeds.min() / low - 1.0, speeds.max() / high - 1.0
    beyond = float(np.sum(speeds > 1.01 * high) * (part.time[1] - part.time[0]))
    return claim(
        "range of A2",
        f"{speeds.min():.3f} to {speeds.max():.3f} rad/s ({100 * under:+.1f}, {100 * over:+.1f} %); "
        f"{beyond:.1f} s more than 1 % above ω_r",
        under >= -0.01 and over <= 0.01,
        low=low,
        high=high,
    )


def _limited(runs: Runs) -> list[Claim]:
    found = []
    for scheme, case in (("A0", "i"), ("A2", "ii")):
        powers = []
        for (model, inertia, _, name), result in runs.limited.items():
            if (model, inertia, name) == (BLADES, PHYSICAL, scheme):
                part = judged(result)
                powers.append(float(part["generator_power"][part["wind_x"] > 9.6].mean()) / paper.REFERENCE - 1.0)
        found.append(
            claim(
                "limited power",
                f"{100 * min(powers):+.2f} to {100 * max(powers):+.2f} % ({len(powers)} winds)",
                max(abs(x) for x in powers) <= 0.01,
                scheme=scheme,
                case=case,
            )
        )
    for model in (FORMULA, BLADES):
        low = rotor(model).speed_for(paper.REFERENCE)
        speed = mean_speed(runs, model, "A0")
        found.append(
            claim(
                "limited speed",
                f"{speed:.4f} rad/s ({100 * (speed / low - 1):+.2f} %)",
                abs(speed / low - 1.0) <= 0.01,
                model=model,
                low=low,
                source="Table 1" if model == FORMULA else model,
                reason="" if model == FORMULA else "M3",
            )
        )
    found.append(range_of_speed(judged(runs.limited[BLADES, PHYSICAL, RAMPS, "A2"])))
    for inertia in runs.setup.inertias:
        saved = travel_ratio(runs, inertia, "A2")
        change, width = 100.0 * (saved.mean - 1.0), 100.0 * saved.half_width
        found.append(
            claim(
                "limited travel",
                f"{change:+.0f} %" + (f" ± {width:.0f}" if saved.n > 1 else ""),
                change <= -20.0,
                inertia=inertia,
            )
        )
    return found


def travel_ratio(runs: Runs, inertia: float, scheme: str) -> MeanEstimate:
    """Ratio of the pitch travel of a scheme to that of A0 in the turbulent winds, with an inertia [kg m^2]."""
    winds = [w for m, j, w, s in runs.limited if (m, j, s) == (BLADES, inertia, "A0") and w != RAMPS]
    pairs = [(runs.limited[BLADES, inertia, w, scheme], runs.limited[BLADES, inertia, w, "A0"]) for w in winds]
    return mean_interval(np.array([pitch_travel(a) / pitch_travel(b) for a, b in pairs]))


def schemes_table(runs: Runs) -> Table:
    """Table of Figure 21, over the turbulent winds."""
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
            backwards = bool(min(float(r["rotor_speed"].min()) for r in results) < 0.0)
            rows.append([f"{inertia:.4g}", f"{scheme}: no result, turns backwards" if backwards else scheme, *cells])
    head = [
        *("J [kg m²]", "scheme", "mean power [MW]", "its std [MW]", "pitch travel [deg]", "pitch moves [% of time]"),
        *("lowest speed [rad/s]", "highest"),
    ]
    note = (
        f"Means over {len(runs.setup.seeds)} seeds of ten minutes at 11 m/s, 10 %, without the first {SETTLING:g} s; "
        "power where the wind is above 9.6 m/s. M3, 15 °C. With 4.872e6 kg m² no scheme holds speed or power; where "
        "the rotor even turns backwards, the row is no result."
    )
    return Table(head, rows, "Figure 21: schemes of active power control at 15 MW", text_columns=2, note=note)
