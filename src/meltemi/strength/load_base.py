"""Fatigue of tower welds over the lifetime of a load base, from the cycles that its cases keep (G-6).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.loads.loadbase.campaign import read_campaign
from meltemi.loads.loadbase.coverage import lost_shares, read_results, shared_repetitions
from meltemi.loads.loadbase.interfaces import TURNED, Interface, interfaces_of, stations
from meltemi.loads.loadbase.plan import plan as plan_of
from meltemi.loads.loadbase.signals import rose_channel
from meltemi.postprocess.cycles import Cycles, cycle_load, sum_cycles
from meltemi.strength.welds import Weld, WeldFatigue, WeldPlan, curve_of, judged, station_welds, tube_of
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

Float = NDArray[np.float64]


def tower_interfaces(turbine: Turbine) -> dict[float, Interface]:
    """Interfaces of the tower by height [m] above its base."""
    (_, heights), named = stations(turbine), {each.name: each for each in interfaces_of(turbine)}
    places = {0.0: "tower_base", turbine.tower.length: "yaw_bearing"}
    places |= {height: f"tower_station_{n}" for n, height in enumerate(heights, start=1)}
    return {height: named[places[height]] for height in sorted(places)}


def base_weld_fatigue(
    folder: str | Path, plan: WeldPlan | None = None, *, turbine: Turbine | None = None, factors: str | None = None
) -> tuple[list[WeldFatigue], list[str]]:
    """Fatigue of tower welds over the lifetime of a load base, from bending alone (G-6).

    At the tower base damage is evaluated in directions of 30 degrees; elsewhere, where a base has cycles of the two
    components only, fore-aft and side-to-side. A weld between stations has the cycles of the one below, with ranges by
    which the equivalent load is linear between both, which is too much where their loads are out of step.

    Args:
      folder: folder of the load base.
      plan: welds and standard; by default a weld of detail D in air at each station, without factors.
      turbine: with another tower section than that of the base.
      factors: name of partial factors, in place of those of the plan.

    Returns:
      fatigue of each weld, and warnings, such as of missing cases.

    Raises:
      InputError: there is no such base, or it has no results of fatigue.
    """
    planned = plan_of(read_campaign(folder))
    own = aeroelastic(load_turbine(planned.campaign.turbine), "meltemi stress")
    results, known, years = read_results(planned, folder), tower_interfaces(own), planned.campaign.years
    plan, parts, repetitions = (
        station_welds(known, plan, factors),
        defaultdict[str, list[Cycles]](list),
        shared_repetitions(results),
    )
    angles = {rose_channel(each, a): a for each in known.values() for a in (0, 90, *TURNED)}
    for channel, names, codes, cycles in results.store.cycles(results.keys) if results.present else ():
        if channel in angles:
            weight = np.array([repetitions.get(name, 0.0) for name in names])[codes]
            parts[channel].append(cycles._replace(counts=weight * cycles.counts))
    counted = {channel: sum_cycles(each, means=False) for channel, each in parts.items()}
    warnings = [
        f"{row}: {100.0 * share:.0f} % of its occurrences have no results: damage is too small"
        for row, share in lost_shares(results).items()
        if share > 0.0
    ]
    found = []
    for weld in plan.welds:
        tube, words = tube_of(weld, turbine or own)
        warnings += [words] * bool(words)
        moments, loads_at = moments_at(weld, known, counted, curve_of(weld, plan.edition).m[0])
        if not moments:
            raise InputError(f"{folder}: no cycles of the tower: 'meltemi loads run' simulates the fatigue cases")
        # the moment about the direction a bends the shell most a quarter turn from it, on both sides
        places = sorted(((a + turn) % 360, a) for a in moments for turn in (90, 270))
        stresses = [
            Cycles(c.ranges / tube.modulus, c.means / tube.modulus, c.counts) for c in (moments[a] for _, a in places)
        ]
        at = np.radians([place for place, _ in places])
        found.append(judged(weld, tube, plan, at, stresses, years, float("nan"), loads_at))
    return found, warnings


def moments_at(
    weld: Weld, known: dict[float, Interface], counted: Mapping[str, Cycles], slope: float
) -> tuple[dict[int, Cycles], tuple[float, ...]]:
    """Cycles of moments [N m] at a weld by direction [deg] of the first half turn, and heights [m] of the stations."""

    def cycles_of(height: float) -> dict[int, Cycles]:
        return {a: counted[c] for a in range(0, 180, 30) if (c := rose_channel(known[height], a)) in counted}

    below, above = ([h for h in known if sign * (h - weld.height) <= 1e-6] for sign in (1, -1))
    if not below or not above:
        raise InputError(f"weld at {weld.height:g} m: the tower reaches from {min(known):g} to {max(known):g} m")
    low, high = max(below), min(above)
    if high <= low:
        return cycles_of(low), (low,)
    first, second, share = cycles_of(low), cycles_of(high), (weld.height - low) / (high - low)
    moments = {}
    for a in first.keys() & second.keys():
        loads = [cycle_load(c[a], slope=slope, reference=1.0) for c in (first, second)]
        source, load = (first[a], loads[0]) if loads[0] > 0.0 else (second[a], loads[1])
        ratio = ((1.0 - share) * loads[0] + share * loads[1]) / load if load > 0.0 else 0.0
        moments[a] = Cycles(ratio * source.ranges, ratio * source.means, source.counts)
    return moments, (low, high)
