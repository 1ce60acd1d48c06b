"""Claims of the paper that need runs: Figures 7, 20 and 21."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.claim import Claim, claim_group, listed
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figure6 import temperature_claims
from meltemi.papers.palanimuthu2022.machine import BLADES, FORMULA, density, rotor
from meltemi.papers.palanimuthu2022.paper import claim, sentence
from meltemi.papers.palanimuthu2022.runs import (
    AHEAD,
    COLD,
    HOT,
    PHYSICAL,
    RAMPS,
    SCHEMES,
    SETTLING,
    PowerControlRuns,
    aero_power,
)
from meltemi.papers.verdict import Verdict, by_reading, enough
from meltemi.postprocess.ensemble import EnsembleTable, MeanEstimate, actuator_travel, mean_interval
from meltemi.power_control.tables import NUMBER
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.result import Result
from meltemi.studies.power_schemes.coordination import (
    PITCH,
    PITCH_STARTS,
    PROPOSAL,
    ROOT_LOAD,
    STARTS,
    SWING,
    TOWER_LOAD,
    TURNED,
    ProposalComparison,
)

Float = NDArray[np.float64]
ENOUGH = 9.6
"""[m/s] lowest steady wind speed at which the turbine delivers 15 MW."""
WEAK_END = 55.0
"""[s] time until which the wind of the ramps is 9 m/s and the rotor settled."""
MOVES = np.radians(0.01)
"""[rad/s] pitch rate above which a blade is moving."""


def run_claims(runs: PowerControlRuns, bench: ProposalComparison) -> list[Claim]:
    """All claims that need runs."""
    return [
        *claim_group("temperature in steps", "Fig. 6", lambda: temperature_claims(runs)),
        *claim_group("humidity in steps", "Fig. 7", lambda: _humidity(runs)),
        *claim_group("two climates", "Fig. 20", lambda: _climates(runs)),
        *claim_group("15 MW under four schemes", "Fig. 21", lambda: _limited(runs)),
        *claim_group("fatigue and coordination", "§ 5", lambda: bench_claims(bench)),
    ]


def _humidity(runs: PowerControlRuns) -> list[Claim]:
    steps = runs.humidity
    one, two, three = (steps.settled(case, "", aero_power) for case in ("i", "ii", "iii"))
    air = density(35.0, np.array(steps.levels))
    wet, warm = (100.0 * float(a / b - 1.0) for a, b in ((air[-1], air[0]), (density(40.0), density(-10.0))))
    first, second = listed(1e-3 * (three - one), ".1f"), listed(1e-3 * (three - two), ".2f")
    power, won = (100.0 * (three[-1] / base - 1.0) for base in (three[0], two[-1]))
    return [
        claim("moist power", np.all(three > one) and np.all(three[1:] > two[1:]), first=first, second=second),
        claim("moist impact", wet=wet, power=power, warm=warm, won=won),
    ]


def _climates(runs: PowerControlRuns) -> list[Claim]:
    one, two = (runs.climate[RAMPS, case] for case in ("i", "ii"))
    expected = 100.0 * (HOT.at([0.0])[-1][0] / COLD.at([0.0])[-1][0] - 1.0)
    inside = (one.time > WEAK_END - 5.0) & (one.time < WEAK_END)
    power, torque = (
        100.0 * float(two[name][inside].mean() / one[name][inside].mean() - 1.0)
        for name in ("aerodynamic_power", "generator_torque")
    )
    pitch = [float(np.degrees(r["pitch_1"][(r.time > 270.0) & (r.time < 300.0)].mean())) for r in (one, two)]
    begins = [float(r.time[np.argmax(np.degrees(r["pitch_1"]) > 0.5)]) for r in (one, two)]
    near = abs(power - expected) <= 0.2 and abs(torque - expected) <= 0.2
    return [
        claim("climate power", near, power=power, torque=torque, change=expected),
        claim("climate pitch", begins[1] > begins[0] and pitch[1] < pitch[0], begins=begins, pitch=pitch),
    ]


def judged(result: Result) -> Result:
    """The result without its initial transient."""
    return result.between(SETTLING, float(result.time[-1]))


def limiting(result: Result) -> NDArray[np.bool_]:
    """Samples in which the controller limits the power."""
    return np.asarray(np.round(result["power_state"]) != NUMBER["maximum_power"])


def pitch_travel(result: Result) -> float:
    """Pitch travel [deg]."""
    part = judged(result)
    return float(np.degrees(actuator_travel(part, "pitch_1") * (part.time[-1] - part.time[0])))


def moving(result: Result) -> float:
    """Fraction of the time in which the pitch moves."""
    part = judged(result)
    return float(np.mean(np.abs(np.diff(part["pitch_1"]) / np.diff(part.time)) > MOVES))


def mean_speed(runs: PowerControlRuns, model: str, scheme: str) -> float:
    """Mean rotor speed [rad/s] while power is limited, in the ramps."""
    part = judged(runs.limited[model, PHYSICAL, RAMPS, scheme])
    return float(part["rotor_speed"][limiting(part)].mean())


def range_of_speed(part: Result, ahead: Result) -> Claim:
    """Range of rotor speed of A2 while it limits the power, and the highest speed with anticipation."""
    ours = float(ahead["rotor_speed"][limiting(ahead)].max())
    speeds = part["rotor_speed"][limiting(part)]
    low, high = rotor(BLADES).speed_for(paper.REFERENCE), paper.SPEED
    under, over = float(speeds.min()) - low, float(speeds.max()) - high
    share = float(np.mean((speeds >= low) & (speeds <= high)))
    ends = {"least": speeds.min(), "most": speeds.max(), "under": 100 * under / low, "over": 100 * over / high}
    varies = under <= 0.1 * (high - low) and over >= -0.1 * (high - low) and share > 0.5
    return claim("range of A2", varies, low=low, high=high, share=100.0 * share, ours=ours, **ends)


def _limited(runs: PowerControlRuns) -> list[Claim]:
    claims = []
    for scheme, case in (("A0", "i"), ("A2", "ii")):
        parts = [judged(r) for (m, j, _, s), r in runs.limited.items() if (m, j, s) == (BLADES, PHYSICAL, scheme)]
        power = mean_interval([float(p["generator_power"][p["wind_x"] > ENOUGH].mean()) * 1e-6 for p in parts])
        near = enough(len(runs.setup.seeds), abs(power.mean * 1e6 - paper.REFERENCE) <= 0.5e6)
        claims.append(claim("limited power", near, power=with_interval(power, 2), n=power.n, scheme=scheme, case=case))
    low, speed = rotor(FORMULA).speed_for(paper.REFERENCE), mean_speed(runs, FORMULA, "A0")
    change = 100.0 * (speed / low - 1.0)
    claims.append(claim("limited speed", abs(change) <= 0.35, speed=speed, change=change, low=low))
    fixed, ahead = (judged(runs.limited[BLADES, PHYSICAL, RAMPS, scheme]) for scheme in ("A2", AHEAD))
    claims.append(range_of_speed(fixed, ahead))
    saved = {inertia: travel_change(runs, inertia, "A2") for inertia in runs.setup.inertias}
    words = ", ".join(f"{percent(x)} ({inertia:.4g} kg m²)" for inertia, x in saved.items())
    less = enough(len(runs.setup.seeds), all(falls(x) for x in saved.values()))
    return [*claims, claim("limited travel", less, changes=words)]


def percent(change: MeanEstimate, digits: int = 0) -> str:
    """Text of a change, with the half-width of its interval if there are several seeds."""
    return "not defined" if np.isnan(change.mean) else f"{with_interval(change, digits, '+', 100.0)} %"


def falls(change: MeanEstimate) -> bool:
    """Whether the interval, or the value of a single seed, is below zero."""
    return (change.high if change.n > 1 else change.mean) < 0.0


def changes_of(table: EnsembleTable, scheme: str) -> dict[str, MeanEstimate]:
    """Changes of a scheme by quantity."""
    changes = {quantity: table.entry(quantity, scheme).change for quantity in table.quantities}
    return {quantity: change for quantity, change in changes.items() if change is not None}


def bench_claims(bench: ProposalComparison) -> list[Claim]:
    """Claims on loads and on the coordination of pitch, torque and yaw."""
    alone, together = (changes_of(bench.conventional, name) for name in (PROPOSAL, "all three"))
    loads, travels, servo = (TOWER_LOAD, ROOT_LOAD), (PITCH, TURNED), (PITCH, PITCH_STARTS, SWING)

    def judged_by(names: tuple[str, ...], changes: dict[str, MeanEstimate]) -> Verdict:
        return enough(bench.conventional.seeds, all(falls(changes[name]) for name in names))

    def changes_text(changes: dict[str, MeanEstimate], names: tuple[str, ...]) -> str:
        return ", ".join(f"{name} {percent(changes[name])}" for name in names)

    drives = (*servo, TURNED, STARTS)
    less = {"of the pitch servo": judged_by(servo, alone), "of tower and blades": judged_by(loads, alone)}
    spared = judged_by(loads, together)
    return [
        claim("fatigue", by_reading(less), servo=changes_text(alone, servo), loads=changes_text(alone, loads)),
        claim("coordination", judged_by(travels, together), travels=changes_text(together, travels)),
        claim("coordinated loads", spared, drives=changes_text(together, drives), loads=changes_text(together, loads)),
    ]


def travel_change(runs: PowerControlRuns, inertia: float, scheme: str) -> MeanEstimate:
    """Change of the pitch travel of a scheme against A0 in the turbulent winds, with an inertia [kg m^2]."""
    results, base = (in_turbulence(runs, inertia, name) for name in (scheme, "A0"))
    return mean_interval([pitch_travel(results[wind]) / pitch_travel(base[wind]) - 1.0 for wind in base])


def in_turbulence(runs: PowerControlRuns, inertia: float, scheme: str) -> dict[str, Result]:
    """Results of a scheme with limited power in the turbulent winds, by wind, with an inertia [kg m^2]."""
    key = (BLADES, inertia, scheme)
    return {w: r for (m, j, w, s), r in runs.limited.items() if (m, j, s) == key and w != RAMPS}


def schemes_table(runs: PowerControlRuns) -> Table:
    """Table of Figure 21, over the turbulent winds."""
    rows = []
    for inertia, scheme in product(runs.setup.inertias, (*SCHEMES, AHEAD)):
        results = [judged(r) for r in in_turbulence(runs, inertia, scheme).values()]
        if not results:
            continue
        full = [r["generator_power"][r["wind_x"] > ENOUGH] * 1e-6 for r in results]
        speeds = [r["rotor_speed"] for r in results]
        columns = (
            ([x.mean() for x in full], 3),
            ([x.std() for x in full], 3),
            ([pitch_travel(r) for r in results], 0),
            ([100.0 * moving(r) for r in results], 0),
            ([x.min() for x in speeds], 3),
            ([x.max() for x in speeds], 3),
        )
        cells = [f"{np.mean(values):.{digits}f}" for values, digits in columns]
        backwards = min(float(x.min()) for x in speeds) < 0.0
        rows.append([f"{inertia:.4g}", f"{scheme}: no result, turns backwards" if backwards else scheme, *cells])
    head = [
        *("J [kg m²]", "scheme", "mean power [MW]", "its std [MW]", "pitch travel [deg]", "pitch moves [% of time]"),
        *("lowest speed [rad/s]", "highest"),
    ]
    note = sentence("schemes", seeds=len(runs.setup.seeds), settling=SETTLING, enough=ENOUGH)
    return Table(head, rows, "Figure 21: schemes of active power control at 15 MW", text_columns=2, note=note)
