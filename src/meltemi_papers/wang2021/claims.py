"""Claims of the paper against our results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.ensemble import mean_interval
from meltemi_papers.claim import UNCHECKED, UNJUDGED, Claim, claim_group, claims_of, reasons_of
from meltemi_papers.wang2021.gust import (
    DERATE,
    EMERGENCY,
    IGNORE,
    MACHINE,
    RATIOS,
    SIGNS,
    STOP,
    Gust,
    Gusts,
    Setting,
    ordered,
    spread,
)
from meltemi_papers.wang2021.runs import AS_SCALED, STOP_AT, Runs
from meltemi_papers.wang2021.table2 import FITTED, MOMENT, POWER, Table2
from meltemi_papers.wang2021.winds import measured
from meltemi_studies.machine_loads import TOP_SHEAR
from meltemi_studies.yaw_gusts import transitions
from meltemi_tuning.run_store import survivors

Float = NDArray[np.float64]
claim = claims_of("wang2021")
POWER_BAND, HELD_BAND, MOMENT_BAND = 1435.0 / 1380.0 - 1.0, 2036.0 / 2011.0 - 1.0, 0.07
"""Differences between simulation and measurement that the paper states for V1, for V2, and for Blade My in V2."""
PLATEAU = 11
"""First bin in which the measured power no longer leaves its plateau."""
HALF, DIGIT = 0.5, 0.05
"""Of "about 50 %", and half a unit of its first digit."""


def claims(runs: Runs) -> list[Claim]:
    """All claims."""
    found = []
    for name, table in runs.tables.items():
        of = partial(_table2, name, table)
        found += [replace(c, basis="surrogate") for c in claim_group(f"power and moments, {name}", "Table 2", of)]
    found += claim_group("V1, start-up", "Fig. 4", lambda: _start_up(runs))
    found += claim_group("V2, power limit and stop", "Fig. 5", lambda: _power_stage(runs))
    found += claim_group("the strategies in the gust", "Fig. 10", lambda: _strategies(runs.gusts))
    found += claim_group("loads of the strategies", "Fig. 10", lambda: _loads(runs.gusts))
    if runs.setup.quick:
        found = [c if c.verdict.startswith(UNCHECKED) else replace(c, verdict=f"{UNJUDGED}too few runs") for c in found]
    return [replace(c, reason="") if c.verdict == "holds" else c for c in found]


def _table2(name: str, found_by_us: Table2) -> list[Claim]:
    """Our surrogate against the measurement, which the paper's model is never compared with."""
    rows, table = measured(), found_by_us.whole()
    bins = np.array([r.bin for r in rows])
    power, spread_of_power = table.column(POWER, "mean"), table.column(POWER, "std")
    moment, moment_std = table.column(MOMENT, "mean"), table.column(MOMENT, "std")
    target, judged = np.array([r.power_mean for r in rows]), ~np.isin(bins, FITTED) | (name == AS_SCALED)
    found = []
    ranges = (
        ("4 to 8 m/s", 3, 7, POWER_BAND, "V1", "rotor" if name == AS_SCALED else "calibration"),
        ("near rated", 8, 9, POWER_BAND, "V1", "rotor" if name == AS_SCALED else "calibration"),
        ("plateau", 10, 18, HELD_BAND, "V2", "plateau"),
    )
    for words, low, high, band, source, reason in ranges:
        inside = (bins >= low) & (bins <= high) & judged
        change = power[inside] / target[inside] - 1.0
        found.append(
            claim(
                "mean power",
                f"{_change(change)} (bins {', '.join(str(k) for k in bins[inside])})",
                _known(change) or bool(np.abs(change).max() <= band),
                words=words,
                name=name,
                band=100.0 * band,
                source=source,
                reason=reason,
            )
        )
    peak, own = int(np.nanargmax(spread_of_power)), table.scatter(POWER, "std")
    above = np.flatnonzero(bins >= PLATEAU)
    wanted = np.array([rows[i].power_std for i in above])
    line = np.polyval(np.polyfit(above, wanted, 1), above)
    scatter = 2.0 * float(np.std(wanted - line, ddof=2))
    off = np.abs(spread_of_power[above] - wanted)
    near = off <= scatter + own[above]
    found += [
        claim(
            "power std",
            f"{spread_of_power[peak]:.0f} ± {own[peak]:.0f} kW in bin {bins[peak]}",
            bins[peak] == 7 and abs(spread_of_power[peak] - rows[6].power_std) <= own[peak],
            name=name,
        ),
        claim(
            "plateau std",
            f"{spread(spread_of_power[above], '.0f')} kW, ± {own[above].max():.0f}; {near.sum()} of {len(above)} bins",
            _known(off) or bool(near.all()),
            name=name,
            band=scatter,
        ),
    ]
    top = int(np.nanargmax(moment))
    ratio, paper_ratio = moment[-1] / moment[top], rows[-1].moment_mean / max(r.moment_mean for r in rows)
    level = moment[top] / max(r.moment_mean for r in rows) - 1.0
    rising = int(np.sum(np.diff(moment_std[7:]) > 0.0))
    found += [
        claim("moment peak", f"bin {bins[top]}", bins[top] == 8, name=name),
        claim("moment level", f"{moment[top]:.0f} kNm ({100 * level:+.1f} %)", abs(level) <= MOMENT_BAND, name=name),
        claim("moment end", f"{ratio:.2f}", abs(ratio / paper_ratio - 1.0) <= MOMENT_BAND, name=name),
        claim(
            "moment std",
            f"rises in {rising} of {len(moment_std) - 8}, to {moment_std[-1]:.0f} kNm",
            np.all(np.diff(moment_std[7:]) > 0.0),
            name=name,
        ),
    ]
    return found


def _change(change: Float) -> str:
    return f"{spread(100.0 * change, '+.1f')} %"


def _known(values: Float) -> str:
    """Verdict on a bin without wind; empty if every bin has some."""
    return f"{UNJUDGED}bins without wind" if np.isnan(values).any() else ""


def _words(values: Sequence[float], unit: str, digits: int = 0) -> str:
    e = mean_interval(np.array(values))
    return f"{e.mean:.{digits}f}" + (f" ± {e.half_width:.{digits}f}" if e.n > 1 else "") + f" {unit}"


def _start_up(runs: Runs) -> list[Claim]:
    powers = [r.between(180.0, 240.0)["generator_power"] * 1e-3 for r in survivors(runs.start_up)]
    mean = [float(p.mean()) for p in powers]
    one = float(np.mean(mean))
    return [
        claim(
            "V1",
            f"{_words(mean, 'kW')} ({100 * (one / 1435 - 1):+.1f} %, {100 * (one / 1380 - 1):+.1f} %)",
            UNCHECKED + "the paper does not give the wind of that minute; ours is read from the power",
        ),
        claim("V1 speed", "", UNCHECKED + "the measured course of the wind and the speed is not published"),
        claim(
            "V1 scatter",
            f"std {_words([float(p.std()) for p in powers], 'kW')}",
            UNCHECKED + "the paper gives the std of neither",
        ),
        claim("V1 moment", "", UNCHECKED + "the paper gives neither moment, nor the wind of the run"),
        claim("V1 loads", "", UNCHECKED + "the paper does not name these loads"),
    ]


def _power_stage(runs: Runs) -> list[Claim]:
    results = survivors(runs.power_stage)
    held = [r.between(360.0, 430.0) for r in results]
    v2 = [float(r["generator_power"].mean()) * 1e-3 for r in held]
    moment = [float(r[MOMENT].mean()) * 1e-3 for r in held]
    speed, flap = np.array([(r.speed, r.moment_mean) for r in measured()]).T
    at_wind = np.interp([float(r["wind_x"].mean()) for r in held], speed, flap)
    change = np.array(moment) / at_wind - 1.0
    end = [float(np.abs(r.between(470.0, 480.0)["generator_power"]).max()) * 1e-3 for r in results]
    after = [r.between(STOP_AT, np.inf) for r in results]
    fall = [float(r.time[np.argmax(r["generator_power"] < 1e3)]) - STOP_AT for r in after]
    two = float(np.mean(v2))
    return [
        claim(
            "V2",
            f"{_words(v2, 'kW')} ({100 * (two / 2036 - 1):+.2f} %, {100 * (two / 2011 - 1):+.2f} %)",
            abs(two / 2036.0 - 1.0) <= HELD_BAND,
        ),
        claim(
            "V2 moment",
            f"{_words(list(100.0 * change), '%', 1)}",
            abs(change.mean()) <= MOMENT_BAND,
        ),
        claim("V2 stop", f"{max(end):.1f} kW", max(end) < 1.0),
        claim("V2 fall", f"no power {_words(fall, 's', 1)} after the stop began", UNCHECKED + "no times are given"),
        claim("V2 loads", "", UNCHECKED + "the paper does not name these loads"),
    ]


def _strategies(g: Gusts) -> list[Claim]:
    """What each strategy does on the paper's machine, over all phases, yaw controls and directions."""

    def over_all(of: Callable[[Gust], float]) -> Float:
        return g.over_all(of, MACHINE)

    begins = [over_all(lambda each, name=name: each.first_pitch(name)) for name in (STOP, DERATE, IGNORE)]  # type: ignore[misc]
    derated = [over_all(lambda each, of=of: of(each.held())) for of in (np.mean, np.min, np.max)]  # type: ignore[misc]
    last = [over_all(lambda each, name=name: float(each.power(name, 80.0).mean()) * 1e-3) for name in (STOP, IGNORE)]  # type: ignore[misc]
    feathered = [over_all(lambda each, name=name: each.feathered(name)) for name in (STOP, EMERGENCY)]  # type: ignore[misc]
    stops = over_all(lambda each: len(transitions(each.results[IGNORE], "stop")))
    return [
        claim(
            "pitch begins",
            "; ".join(spread(x, ".1f") for x in begins) + " s",
            all(bool((np.abs(x - 18.0) <= 1.0).all()) for x in begins),
        ),
        claim(
            "S1 stops",
            f"85 deg at {spread(feathered[0], '.1f')} s (emergency stop {spread(feathered[1], '.1f')} s), "
            f"{np.abs(last[0]).max():.1f} kW",
            np.isfinite(feathered).all() and np.abs(last[0]).max() < 1.0,
        ),
        claim(
            "S2 power",
            f"mean {spread(derated[0], '.0f')} kW from 30 s after the trigger; {derated[1].min():.0f} to "
            f"{derated[2].max():.0f} kW",
            np.abs(derated[0] / 2000.0 - 1.0).max() <= HELD_BAND,
        ),
        claim("S2 stop", "", UNCHECKED + "the paper gives no recheck time; ours, 90 s, ends after the figure"),
        claim("S3 stop", f"{spread(last[1], '.0f')} kW in the last 20 s", not stops.any()),
    ]


def about_half(ratios: Float) -> bool:
    """Whether the mean of ratios, by phase, is "about 0.5"."""
    error = np.std(ratios, ddof=1) / np.sqrt(len(ratios)) if len(ratios) > 1 else 0.0
    return bool(abs(ratios.mean() - HALF) <= DIGIT + 2.0 * error)


def _where(holds: Mapping[str, bool]) -> object:
    """Verdict from those in several settings."""
    some = [words for words, each in holds.items() if each]
    return len(some) == len(holds) or (f"holds only for {'; '.join(some)}" if some else False)


def _halves(g: Gusts, own: Sequence[Setting], which: Sequence[tuple[str, str]]) -> tuple[str, object]:
    """Ratios of derating by direction, and in which settings they are about half."""
    told, holds = [], {}
    for load, against in which:
        for sign, direction in SIGNS.items():
            ratios = g.over_all(lambda each, of=(load, against): each.ratio(*of), MACHINE, sign)  # type: ignore[misc]
            told.append(f"{load} over {against[:2]} {spread(ratios)} {direction}")
        for setting in own:
            words = f"{load} over {against[:2]} with {setting.average:g} s, {SIGNS[setting.sign]}"
            holds[words] = about_half(g.ratios(setting, load, against))
    return "; ".join(told), _where(holds)


def _loads(g: Gusts) -> list[Claim]:
    """The paper's statements on loads, in all settings of its machine, for all components that they may mean."""
    own = [setting for setting in g.phases if setting.machine == MACHINE]
    bearing = [(load, against) for load, against in RATIOS if load != TOP_SHEAR]
    found = [
        claim("bearing half", *_halves(g, own, bearing)),
        claim("top half", *_halves(g, own, [(TOP_SHEAR, IGNORE)])),
    ]
    rises = {f"{s.average:g} s, {SIGNS[s.sign]}": g.values(s, ordered) for s in own}
    told = [f"{x.sum():.0f} of {len(x)} with {words}" for words, x in rises.items()]
    found.append(
        claim("tower top order", "; ".join(told), _where({words: bool(x.all()) for words, x in rises.items()}))
    )
    return found


REASONS = reasons_of("wang2021")
"""Why numbers differ."""
