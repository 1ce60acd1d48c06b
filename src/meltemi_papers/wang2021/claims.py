"""Claims of the paper against our results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meltemi.control.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.postprocess.ensemble import mean_interval
from meltemi.studies.run_store import survivors
from meltemi_papers.claim import UNJUDGED, Claim, claim_group, claims_of, listed, reasons_of
from meltemi_papers.wang2021.gust import DERATE, IGNORE, SHORT, STOP, Gust, transitions
from meltemi_papers.wang2021.loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION
from meltemi_papers.wang2021.runs import AS_SCALED, Runs
from meltemi_papers.wang2021.table2 import FITTED, MOMENT, POWER, Table2
from meltemi_papers.wang2021.winds import GUST_BEGIN, measured

Float = NDArray[np.float64]
claim = claims_of("wang2021")
PEAK_BIN = 8
"""Of the mean flapwise moment, measured."""
CHECKS = ((7.5, 52.5), (8.8, 48.6), (10.0, 45.0), (15.0, 42.0), (20.0, 39.0), (25.0, 36.0), (30.0, 33.0), (40.0, 30.0))
"""[m/s], [deg] of the interpolated law."""


def claims(runs: Runs) -> list[Claim]:
    """All claims."""
    found = []
    for name, table in runs.tables.items():
        found += claim_group(f"power and moments, {name}", "Table 2", lambda: _table2(name, table.whole()))  # noqa: B023
    found += claim_group("V1, start-up", "Fig. 4", lambda: _start_up(runs))
    found += claim_group("V2, power limit and stop", "Fig. 5", lambda: _power_stage(runs))
    found += _laws()
    found += claim_group("the strategies in the gust", "Figs 9, 10", lambda: _gust(runs.gust))
    found += claim_group("recheck after 30 s", "Fig. 8", lambda: _recheck(runs.gust))
    return [replace(c, reason="") if c.verdict == "holds" else c for c in found]


def _spread(change: Float) -> str:
    return f"{100.0 * change.min():+.1f} to {100.0 * change.max():+.1f} %"


def _table2(name: str, table: Table2) -> list[Claim]:
    rows = measured()
    bins = np.array([r.bin for r in rows])
    power, spread = table.column(POWER, "mean"), table.column(POWER, "std")
    moment, moment_std = table.column(MOMENT, "mean"), table.column(MOMENT, "std")
    target, judged = np.array([r.power_mean for r in rows]), ~np.isin(bins, FITTED) | (name == AS_SCALED)
    found = []
    why = "rotor" if name == AS_SCALED else "calibration"
    for words, low, high, band in (("4 to 8 m/s", 3, 7, 0.10), ("near rated", 8, 9, 0.07), ("plateau", 10, 18, 0.02)):
        inside = (bins >= low) & (bins <= high) & judged
        change = power[inside] / target[inside] - 1.0
        verdict: object = np.abs(change).max() <= band
        if np.isnan(change).any():
            verdict = f"{UNJUDGED}no wind of bin {', '.join(str(k) for k in bins[inside][np.isnan(change)])}"
        seen = f"{bins[inside][0]} to {bins[inside][-1]}"
        found.append(
            claim(
                "mean power",
                f"{_spread(change)} (bins {seen})",
                verdict,
                words=words,
                name=name,
                band=100 * band,
                reason=why,
            )
        )
    above = bins >= 12
    peak = int(np.nanargmax(spread))
    factor = np.exp(np.abs(np.log(spread[above] / [r.power_std for r in rows if r.bin >= 12])))
    found.append(
        claim("power std", f"{spread[peak]:.0f} kW in bin {bins[peak]}", 54.5 <= spread[peak] <= 218.0, name=name)
    )
    found.append(
        claim(
            "plateau std",
            f"{spread[above].min():.1f} to {spread[above].max():.1f} kW",
            f"{UNJUDGED}bins without wind" if np.isnan(factor).any() else factor.max() <= 2.0,
            name=name,
        )
    )
    top = int(np.nanargmax(moment))
    ratio = moment[-1] / moment[top]
    level = moment[top] / max(r.moment_mean for r in rows) - 1.0
    rising = int(np.sum(np.diff(moment_std[7:]) > 0.0))
    near = abs(int(bins[top]) - PEAK_BIN) <= 1
    found += [
        claim("moment peak", f"bin {bins[top]}", near, name=name),
        claim("moment level", f"{moment[top]:.0f} kNm ({100 * level:+.1f} %)", abs(level) <= 0.2, name=name),
        claim("moment end", f"{ratio:.2f}", abs(ratio - 0.48) <= 0.15, name=name),
        claim(
            "moment std",
            f"rises in {rising} of {len(moment_std) - 8}, to {moment_std[-1]:.0f} kNm",
            np.all(np.diff(moment_std[7:]) > 0.0),
            name=name,
        ),
    ]
    return found


def _words(values: Sequence[float], unit: str, digits: int = 0) -> str:
    e = mean_interval(np.array(values))
    return f"{e.mean:.{digits}f}" + (f" ± {e.half_width:.{digits}f}" if e.n > 1 else "") + f" {unit}"


def _start_up(runs: Runs) -> list[Claim]:
    v1 = [float(r.between(180.0, 240.0)["generator_power"].mean()) * 1e-3 for r in survivors(runs.start_up)]
    one = float(np.mean(v1))
    return [claim("V1", f"{_words(v1, 'kW')} ({100 * (one / 1380 - 1):+.1f} %)", abs(one / 1380.0 - 1.0) <= 0.07)]


def _power_stage(runs: Runs) -> list[Claim]:
    results = survivors(runs.power_stage)
    v2 = [float(r.between(360.0, 430.0)["generator_power"].mean()) * 1e-3 for r in results]
    over = [float(r["rotor_speed"].max()) * 30.0 / np.pi for r in results]
    end = [float(np.abs(r.between(470.0, 480.0)["generator_power"]).max()) * 1e-3 for r in results]
    two = float(np.mean(v2))
    return [
        claim(
            "V2",
            f"{_words(v2, 'kW')} ({100 * (two / 2011 - 1):+.2f} % of the measured, {100 * (two / 2036 - 1):+.2f} %)",
            abs(two / 2011.0 - 1.0) <= 0.015,
        ),
        claim("V2 stop", f"{max(end):.1f} kW, {max(over):.2f} rpm", max(end) < 1.0 and max(over) < 12.6 * 1.15),
    ]


def _laws() -> list[Claim]:
    law, steps = YawProtection(law="interpolated"), YawProtection(law="stepwise")
    speeds = np.array([c for c, _ in CHECKS])
    off = np.abs(np.degrees(yaw_threshold(law, speeds)) - [b for _, b in CHECKS]).max()
    at = np.degrees(yaw_threshold(steps, np.array([0.0, 10.0, 10.1, 35.0, 35.1])))
    fine = np.linspace(0.0, 50.0, 500_001)
    jump = float(np.abs(np.diff(np.degrees(yaw_threshold(law, fine)))).max())
    return [
        claim(
            "stepwise law", listed(at) + " deg", np.allclose(at, [60.0, 60.0, 45.0, 45.0, 30.0], rtol=0.0, atol=1e-9)
        ),
        claim("base points", f"largest difference {off:.1e} deg at {len(CHECKS)} speeds", off < 1e-9),
        claim("continuous law", f"largest step over 0.0001 m/s: {jump:.1e} deg", jump < 1e-2),
    ]


def unfiltered_trigger(law: YawProtection, rise: float, hub_height: float, step: float = 0.01) -> float:
    """[s] time at which the direction of Figure 9 exceeds the threshold, without filters and with fixed nacelle."""
    t = np.arange(-30.0, 30.0 + step, step)
    s = 0.5 * (1.0 - np.cos(np.pi * np.clip((t - GUST_BEGIN) / 10.0, 0.0, 1.0)))
    speed, change = 10.67 + rise * s, np.radians(720.0 / 10.67) * s
    window = round(30.0 / step)
    summed = np.cumsum(speed)
    mean = (summed[window:] - summed[:-window]) / window
    over = change[window:] > yaw_threshold(law, mean)
    return float(t[window:][np.argmax(over)])


def _gust(g: Gust) -> list[Claim]:
    s1, s2, _s3 = (g.results[name] for name in (STOP, DERATE, IGNORE))
    u, v = s2["wind_x"], s2["wind_y"]
    speed, turned = float(np.hypot(u[-1], v[-1])), float(np.degrees(np.arctan2(-v[-1], u[-1])))
    raw = [unfiltered_trigger(YawProtection(law=law), 14.33, 120.0) for law in ("interpolated", "stepwise")]
    first = [g.first_pitch(name) for name in (STOP, DERATE, IGNORE)]
    begin = next((e.time for e in transitions(s1, "stop")), np.nan)
    derated = next((e.time for e in transitions(s2, "derate")), np.nan)
    held = g.power(DERATE, derated + 30.0) * 1e-3 if np.isfinite(derated) else np.array([np.nan])
    full = g.power(IGNORE, 80.0) * 1e-3
    bend, twist, shear = ((g.ratio(n, STOP), g.ratio(n, IGNORE)) for n in (YAW_BENDING, YAW_TORSION, TOP_SHEAR))
    near = [0.35 <= r <= 0.65 for r in (*bend, *twist)]
    tops = [g.peak(name, TOP_SHEAR) for name in (STOP, DERATE, IGNORE)]
    late = g.late()
    return [
        claim(
            "gust wind", f"{speed:.2f} m/s, {turned:.1f} deg", abs(speed - 25.0) < 0.05 and abs(turned - 67.48) < 0.05
        ),
        claim("passing", f"{raw[0]:.2f} s, {raw[1]:.2f} s", abs(raw[0] - 16.05) <= 0.1 and abs(raw[1] - 16.10) <= 0.1),
        claim("pitch begins", listed(first, ".1f") + " s", all(16.0 <= x <= 19.0 for x in first)),
        claim(
            "pitch parts",
            f"{g.parting(STOP):.1f}, {g.parting(DERATE):.1f} s",
            all(16.0 <= g.parting(name) <= 19.0 for name in (STOP, DERATE)),
        ),
        claim(
            "S1 feathers",
            f"triggered at {begin:.2f} s, 85 deg at {g.feathered(STOP):.1f} s",
            g.feathered(STOP) - begin <= 15.0,
        ),
        claim(
            "S2 power",
            f"{held.mean():.0f} kW ({held.min():.0f} to {held.max():.0f}) from 30 s after the trigger",
            abs(held.mean() / 2000.0 - 1.0) <= 0.02,
        ),
        claim(
            "last power",
            f"{g.power(STOP, 80.0).mean() * 1e-3:.0f} and {full.mean():.0f} kW",
            abs(float(g.power(STOP, 80.0).mean())) < 1e3 and abs(float(full.mean()) / 3000.0 - 1.0) <= 0.02,
        ),
        claim(
            "yaw bearing", f"bending {bend[0]:.2f}, {bend[1]:.2f}; torsion {twist[0]:.2f}, {twist[1]:.2f}", any(near)
        ),
        claim("tower top order", listed(tops, ".3f") + f" {LOADS[TOP_SHEAR].unit}", tops[0] < tops[1] < tops[2]),
        claim("tower top", f"{shear[1]:.2f}", 0.35 <= shear[1] <= 0.70),
        claim("late loads", listed(late, ".2f"), any(0.35 <= x <= 0.65 for x in late)),
    ]


def _recheck(g: Gust) -> list[Claim]:
    recheck = transitions(g.results[SHORT], "stop")
    return [
        claim("recheck", f"stop at {recheck[0].time:.2f} s: {recheck[0].reason}" if recheck else "no stop", recheck)
    ]


REASONS = reasons_of("wang2021")
"""Why numbers differ."""
