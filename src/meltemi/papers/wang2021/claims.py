"""Claims of the paper against our results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.claim import Claim, claim_group, claims_of, listed, reasons_of
from meltemi.papers.verdict import Verdict, judgement, only_for, unjudged
from meltemi.papers.wang2021.gust import (
    DERATE,
    EMERGENCY,
    IGNORE,
    INTERPOLATED,
    MACHINE,
    RATIOS,
    SIGNS,
    STOP,
    Gust,
    Gusts,
    GustSetting,
    ordered,
    spread,
)
from meltemi.papers.wang2021.lifetime import over_parts, paired
from meltemi.papers.wang2021.runs import AS_SCALED, CALIBRATED, STOP_AT, YawProtectionRuns
from meltemi.papers.wang2021.table2 import FITTED, MOMENT, POWER, Table2
from meltemi.papers.wang2021.winds import GUST_BEGIN, POWER_SPEED, TIMES, measured
from meltemi.postprocess.ensemble import mean_interval
from meltemi.reports.ensemble_tables import with_interval
from meltemi.studies.machine_loads import TOP_SHEAR, YAW_BENDING
from meltemi.studies.wind_year import StrategyYear
from meltemi.studies.yaw_gusts import transitions
from meltemi.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.tuning.run_store import survivors

Float = NDArray[np.float64]
claim = claims_of("wang2021")
POWER_BAND, HELD_BAND, MOMENT_BAND = 1435.0 / 1380.0 - 1.0, 2036.0 / 2011.0 - 1.0, 0.07
"""Differences between simulation and measurement that the paper states for V1, for V2, and for Blade My in V2."""
PLATEAU = 11
"""First bin in which the measured power always stays at its plateau."""
HALF, DIGIT = 0.5, 0.05
"""Number of "about 50 %", and half a unit of its first digit."""


def claims(runs: YawProtectionRuns, years: Sequence[StrategyYear]) -> list[Claim]:
    """All claims."""
    lines = []
    for name, table in runs.tables.items():
        of = partial(_table2, name, table)
        lines += [replace(c, basis="surrogate") for c in claim_group(f"power and moments, {name}", "Table 2", of)]
    lines += claim_group("V1, start-up", "Fig. 4", lambda: _start_up(runs))
    lines += claim_group("V2, power limit and stop", "Fig. 5", lambda: _power_stage(runs))
    lines += claim_group("the strategies in the gust", "Fig. 10", lambda: _strategies(runs.gusts))
    lines += claim_group("loads of the strategies", "Fig. 10", lambda: _loads(runs.gusts))
    lines += claim_group("availability and threshold", "conclusion", lambda: _of_years(runs.gusts, years))
    if runs.setup.quick:
        few = judgement(unjudged("too few runs"))
        lines = [c if c.outcome == "unchecked" else replace(c, judgement=few) for c in lines]
    return [replace(c, reason="") if c.outcome == "held" else c for c in lines]


def _table2(name: str, simulated: Table2) -> list[Claim]:
    """Our surrogate against the measurement, which the paper's model is never compared with."""
    rows, table = measured(), simulated.whole()
    bins = np.array([r.bin for r in rows])
    power, spread_of_power = table.column(POWER, "mean"), table.column(POWER, "std")
    moment, moment_std = table.column(MOMENT, "mean"), table.column(MOMENT, "std")
    target, judged = np.array([r.power_mean for r in rows]), ~np.isin(bins, FITTED) | (name == AS_SCALED)
    lines = []
    ranges = (
        ("4 to 8 m/s", 3, 7, POWER_BAND, "V1", "rotor" if name == AS_SCALED else "calibration"),
        ("near rated", 8, 9, POWER_BAND, "V1", "rotor" if name == AS_SCALED else "calibration"),
        ("plateau", 10, 18, HELD_BAND, "V2", "plateau"),
    )
    for words, low, high, band, source, reason in ranges:
        inside = (bins >= low) & (bins <= high) & judged
        change = power[inside] / target[inside] - 1.0
        near = _in_all_bins(change, np.abs(change).max() <= band)
        ours = {"change": f"{spread(100.0 * change, '+.1f')} %", "bins": listed(bins[inside])}
        stated = {"words": words, "band": 100.0 * band, "source": source, "reason": reason}
        lines.append(claim("mean power", near, name=name, **ours, **stated))
    peak, error = int(np.nanargmax(spread_of_power)), table.scatter(POWER, "std")
    above = np.flatnonzero(bins >= PLATEAU)
    wanted = np.array([rows[i].power_std for i in above])
    line = np.polyval(np.polyfit(above, wanted, 1), above)
    scatter = 2.0 * float(np.std(wanted - line, ddof=2))
    off = np.abs(spread_of_power[above] - wanted)
    near = off <= scatter + error[above]
    as_wide = bins[peak] == 7 and abs(spread_of_power[peak] - rows[6].power_std) <= error[peak]
    plateau = {"std": spread(spread_of_power[above], ".0f"), "error": error[above].max(), "band": scatter}
    top, largest = int(np.nanargmax(moment)), max(r.moment_mean for r in rows)
    ratio, level = moment[-1] / moment[top], moment[top] / largest - 1.0
    as_low = abs(ratio / (rows[-1].moment_mean / largest) - 1.0) <= MOMENT_BAND
    rises = np.diff(moment_std[7:]) > 0.0
    rising = {"rising": rises.sum(), "n": len(rises), "last": moment_std[-1]}
    return [
        *lines,
        claim("power std", as_wide, name=name, std=spread_of_power[peak], error=error[peak], bin=bins[peak]),
        claim("plateau std", _in_all_bins(off, near.all()), name=name, near=near.sum(), n=len(above), **plateau),
        claim("moment peak", bins[top] == 8, name=name, bin=bins[top]),
        claim("moment level", abs(level) <= MOMENT_BAND, name=name, moment=moment[top], off=100.0 * level),
        claim("moment end", as_low, name=name, ratio=ratio),
        claim("moment std", rises.all(), name=name, **rising),
    ]


def _in_all_bins(values: Float, holds: bool) -> bool | Verdict:
    """Verdict on values in bins, if every bin has some wind."""
    return unjudged("bins without wind") if np.isnan(values).any() else holds


def _words(values: Sequence[float] | Float, unit: str, digits: int = 0) -> str:
    return f"{with_interval(mean_interval(values), digits)} {unit}"


def _start_up(runs: YawProtectionRuns) -> list[Claim]:
    powers = [r.between(180.0, 240.0)["generator_power"] * 1e-3 for r in survivors(runs.start_up)]
    mean = [float(p.mean()) for p in powers]
    simulated, measured_one = (100.0 * (float(np.mean(mean)) / stated - 1.0) for stated in (1435.0, 1380.0))
    return [
        claim("V1", mean=_words(mean, "kW"), simulated=simulated, measured=measured_one),
        claim("V1 speed"),
        claim("V1 scatter", std=_words([float(p.std()) for p in powers], "kW")),
        claim("V1 moment"),
        claim("V1 loads"),
    ]


def _power_stage(runs: YawProtectionRuns) -> list[Claim]:
    results = survivors(runs.power_stage)
    limited = [r.between(360.0, 430.0) for r in results]
    v2 = [float(r["generator_power"].mean()) * 1e-3 for r in limited]
    moment = [float(r[MOMENT].mean()) * 1e-3 for r in limited]
    speed, flap = np.array([(r.speed, r.moment_mean) for r in measured()]).T
    at_wind = np.interp([float(r["wind_x"].mean()) for r in limited], speed, flap)
    change = np.array(moment) / at_wind - 1.0
    by_speed = [(r.speed, r.moment_std) for r in measured()]
    scatter = np.array([float(r[MOMENT].std()) * 1e-3 for r in limited])
    varies = scatter / np.interp([float(r["wind_x"].mean()) for r in limited], *np.array(by_speed).T)
    in_bins = np.interp(POWER_SPEED, speed, runs.tables[CALIBRATED].column(MOMENT, "std"))
    in_bins /= np.interp(POWER_SPEED, *np.array(by_speed).T)
    similar = {
        "the 70 s of the run": _near(varies),
        "ten minutes, from bins 9 and 10": abs(in_bins - 1.0) <= MOMENT_BAND,
    }
    end = [float(np.abs(r.between(470.0, 480.0)["generator_power"]).max()) * 1e-3 for r in results]
    after = [r.between(STOP_AT, np.inf) for r in results]
    fall = [float(r.time[np.argmax(r["generator_power"] < 1e3)]) - STOP_AT for r in after]
    off, off_measured = (float(np.mean(v2)) / stated - 1.0 for stated in (2036.0, 2011.0))
    return [
        claim("V2", mean=_words(v2, "kW"), simulated=100.0 * off, measured=100.0 * off_measured),
        claim("V2 moment", abs(change.mean()) <= MOMENT_BAND, change=_words(100.0 * change, "%", 1)),
        claim("V2 variance", only_for(similar), run=_words(varies, "", 2).strip(), bins=in_bins),
        claim("V2 stop", max(end) < 1.0, power=max(end)),
        claim("V2 fall", time=_words(fall, "s", 1)),
        claim("V2 loads"),
    ]


def _strategies(g: Gusts) -> list[Claim]:
    """Effects of each strategy on the paper's machine, over all phases, yaw controls and directions."""

    def over_all(of: Callable[[Gust], float]) -> Float:
        return g.over_all(of, MACHINE)

    begins = [over_all(lambda each, name=name: each.first_pitch(name)) for name in (STOP, DERATE, IGNORE)]  # type: ignore[misc]
    derated = [over_all(lambda each, of=of: of(each.derated_power())) for of in (np.mean, np.min, np.max)]  # type: ignore[misc]
    last = [over_all(lambda each, name=name: float(each.power(name, 80.0).mean()) * 1e-3) for name in (STOP, IGNORE)]  # type: ignore[misc]
    feathered = [over_all(lambda each, name=name: each.feathered(name)) for name in (STOP, EMERGENCY)]  # type: ignore[misc]
    stops = over_all(lambda each: len(transitions(each.results[IGNORE], "stop")))
    normal, emergency = (spread(x, ".1f") for x in feathered)
    left = np.abs(last[0]).max()
    stopped = np.isfinite(feathered).all() and left < 1.0
    mean, least, most = derated
    near = np.abs(mean / 2000.0 - 1.0).max() <= HELD_BAND
    return [
        claim(
            "pitch begins",
            times="; ".join(spread(x, ".1f") for x in begins),
            after=spread(np.concatenate(begins) - GUST_BEGIN, ".1f"),
        ),
        claim("S1 stops", stopped, normal=normal, emergency=emergency, power=left),
        claim("S2 power", near, mean=spread(mean, ".0f"), least=least.min(), most=most.max()),
        claim("S2 stop"),
        claim("S3 stop", not stops.any(), power=spread(last[1], ".0f")),
    ]


def _near(ratios: Float) -> bool:
    """Whether the mean of ratios, by seed, is one within the paper's band for the mean moment."""
    return bool(abs(ratios.mean() - 1.0) <= MOMENT_BAND + 2.0 * _error(ratios))


def about_half(ratios: Float) -> bool:
    """Whether the mean of ratios, by phase, is "about 0.5"."""
    return bool(abs(ratios.mean() - HALF) <= DIGIT + 2.0 * _error(ratios))


def _error(values: Float) -> float:
    """Standard error of a mean."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def _settings(g: Gusts) -> Iterator[tuple[str, list[GustSetting]]]:
    """Settings of the paper's machine, one for each yaw control, by direction and rise time in words."""
    settings = [setting for setting in g.phases if setting.machine == MACHINE]
    for time, (sign, direction) in product(TIMES, SIGNS.items()):
        yield f"{direction} within {time:g} s", [s for s in settings if (s.sign, s.time) == (sign, time)]


def _by_control(words: str, settings: Sequence[GustSetting], holds: Callable[[GustSetting], bool]) -> dict[str, bool]:
    """Verdicts by yaw control; one for all if they agree."""
    verdicts = {f"{words} with {s.average:g} s": holds(s) for s in settings}
    agree = len(set(verdicts.values())) == 1
    return {f"{words} with every yaw control": next(iter(verdicts.values()))} if agree else verdicts


def _halves(g: Gusts, which: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """Ratios of derating by direction and rise time, and in which settings they are about half."""
    ratios, holds = [], dict[str, bool]()
    for (load, against), (words, settings) in product(which, list(_settings(g))):
        name = f"{load} over {against[:2]}"
        ratios.append(f"{name} {spread(np.concatenate([g.ratios(s, load, against) for s in settings]))} {words}")
        holds |= _by_control(
            f"{name} {words}",
            settings,
            lambda s, of=(load, against): about_half(g.ratios(s, *of)),  # type: ignore[misc]
        )
    return {"holds": only_for(holds), "ratios": "; ".join(ratios)}


def _loads(g: Gusts) -> list[Claim]:
    """The paper's statements on loads, in all settings of its machine, for all components that they may mean."""
    bearing = [(load, against) for load, against in RATIOS if load != TOP_SHEAR]
    rises, phases = dict[str, bool](), []
    for words, settings in _settings(g):
        rise = {s: g.values(s, ordered) for s in settings}
        rises |= _by_control(words, settings, lambda s, of=rise: bool(of[s].all()))  # type: ignore[misc]
        phases += [f"{x.sum():.0f} of {len(x)} {words} with {s.average:g} s" for s, x in rise.items()]
    return [
        claim("bearing half", **_halves(g, bearing)),
        claim("top half", **_halves(g, [(TOP_SHEAR, IGNORE)])),
        claim("tower top order", only_for(rises), phases="; ".join(phases)),
    ]


def _of_years(g: Gusts, years: Sequence[StrategyYear]) -> list[Claim]:
    """Benefit of derating and of the interpolated threshold in a year, and of the threshold in the gust."""
    fronts = sorted({y.fronts for y in years})
    more = {n: paired(years, "S2", "S1", n, lambda y: 100.0 * y.available) for n in fronts}
    stops = {n: paired(years, "S1 interpolated", "S1", n, lambda y: y.stops) for n in fronts}
    shares = {n: [100.0 * over_parts(years, s, n, lambda y: y.available).mean() for s in ("S1", "S2")] for n in fronts}
    ratios = np.concatenate([g.ratios(s, YAW_BENDING, STOP, INTERPOLATED) for s in g.shown])
    jump = np.degrees(np.abs(np.diff(yaw_threshold(YawProtection(), np.arange(0.0, 50.0, 0.1)))).max())
    better = {
        "no jump over the wind speed": bool(jump < 1.0),
        "fewer stops a year": all(e.high < 0.0 for e in stops.values()),
        "less bending at the bearing when it stops": bool(ratios.mean() + 2.0 * _error(ratios) < 1.0),
    }
    return [
        claim(
            "availability",
            only_for({f"{n} fronts a year": e.low > 0.0 for n, e in more.items()}),
            shares="; ".join(f"{one:.3f} and {two:.3f} % with {n} fronts" for n, (one, two) in shares.items()),
            more="; ".join(with_interval(e, 3, "+") for e in more.values()),
        ),
        claim(
            "threshold",
            only_for(better),
            jump=jump,
            stops="; ".join(f"{with_interval(e, 1, '+')} with {n} fronts" for n, e in stops.items()),
            ratios=spread(ratios),
        ),
    ]


REASONS = reasons_of("wang2021")
"""Why numbers differ."""
