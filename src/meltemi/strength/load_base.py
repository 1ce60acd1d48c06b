"""Tower welds and plies of blades from a load base: the cycles that its cases keep, and its design loads (G-6, G-25).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.loads.loadbase.campaign import read_campaign
from meltemi.loads.loadbase.coverage import Results, lost_shares, read_results, shared_repetitions
from meltemi.loads.loadbase.interfaces import TURNED, Interface, interfaces_of, stations
from meltemi.loads.loadbase.plan import plan as plan_of
from meltemi.loads.loadbase.settings import STANDARD
from meltemi.loads.loadbase.signals import rose_channel
from meltemi.loads.loadbase.ultimate import Evaluation, blade_groups, runs_of, ultimate_tables
from meltemi.postprocess.cycles import Cycles, cycle_load, sum_cycles
from meltemi.postprocess.extremes import COMPONENTS
from meltemi.sections.blade import load_rotation
from meltemi.sections.layup import Layup
from meltemi.strength.criteria import SnLine, goodman_damage
from meltemi.strength.plies import BladeStrength, StationLoads, judged_blade
from meltemi.strength.tube import buckling_utilisation
from meltemi.strength.welds import SIX, Weld, WeldFatigue, WeldPlan, curve_of, judged, station_welds, tube_of
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]

LEAST = 0.05
"""Share of the largest range of a load of a blade in the lifetime below which its cycles are left out: they do less
than 1e-9 of the damage at slope 10 (NREL 5 MW)."""


def _opened(folder: str | Path) -> tuple[Results, Turbine, list[str]]:
    """Results and turbine of a load base, and warnings of missing cases of fatigue."""
    planned = plan_of(read_campaign(folder))
    results = read_results(planned, folder)
    warnings = [
        f"{row}: {100.0 * share:.0f} % of its occurrences have no results: damage is too small"
        for row, share in lost_shares(results).items()
        if share > 0.0
    ]
    return results, aeroelastic(load_turbine(planned.campaign.turbine), "meltemi stress"), warnings


def _ultimate(results: Results, interfaces: Sequence[Interface]) -> pd.DataFrame:
    """Design loads of interfaces, those of all blades together: contemporaneous, with the factors of their cases."""
    evaluation = Evaluation(results, runs_of(results), STANDARD.extrapolation, 1, [])
    return ultimate_tables(evaluation, interfaces, results.plan.table.factors.favourable)[0]


def tower_interfaces(turbine: Turbine) -> dict[float, Interface]:
    """Interfaces of the tower by height [m] above its base."""
    (_, heights), named = stations(turbine), {each.name: each for each in interfaces_of(turbine)}
    places = {0.0: "tower_base", turbine.tower.length: "yaw_bearing"}
    places |= {height: f"tower_station_{n}" for n, height in enumerate(heights, start=1)}
    return {height: named[places[height]] for height in sorted(places)}


def base_weld_fatigue(
    folder: str | Path, plan: WeldPlan | None = None, *, turbine: Turbine | None = None, factors: str | None = None
) -> tuple[list[WeldFatigue], list[str]]:
    """Fatigue of tower welds over the lifetime of a load base, from bending alone (G-6), and buckling of the shell.

    Damage is evaluated in directions of 30 degrees; in bases that have cycles of two components at a station,
    fore-aft and side-to-side. A weld between stations has the cycles of the one below, with ranges by which the
    equivalent load is linear between both, which is too much where their loads are out of step; its buckling is linear
    between those by the design loads of both.

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
    results, own, warnings = _opened(folder)
    known, years, repetitions = tower_interfaces(own), results.plan.campaign.years, shared_repetitions(results)
    plan, parts = station_welds(known, plan, factors), defaultdict[str, list[Cycles]](list)
    angles = {rose_channel(each, a): a for each in known.values() for a in (0, 90, *TURNED)}
    for channel, names, codes, cycles in results.store.cycles(results.keys) if results.present else ():
        if channel in angles:
            weight = np.array([repetitions.get(name, 0.0) for name in names])[codes]
            parts[channel].append(cycles._replace(counts=weight * cycles.counts))
    counted = {channel: sum_cycles(each, means=False) for channel, each in parts.items()}
    extremes = _ultimate(results, list(known.values()))
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
        fatigue = judged(weld, tube, plan, np.radians([place for place, _ in places]), stresses, years, loads_at)
        if len(extremes):
            rows = [extremes.loc[known[h].name, list(COMPONENTS)].to_numpy(float).T for h in loads_at]
            loads = [dict(zip(SIX, each, strict=True)) for each in rows]
            used = [buckling_utilisation(each, tube, own.tower.length, plan.shell) for each in loads]
            fatigue = replace(fatigue, buckling=float(np.interp(weld.height, loads_at, used)))
        found.append(fatigue)
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


class _CountedLoad(NamedTuple):
    """Cycles of a load in all cases of the lifetime, their case (n,), and means (cases,) of the load."""

    cycles: Cycles
    codes: NDArray[np.intp]
    means: Float


def base_blade_strength(
    folder: str | Path, layup: Layup, *, turbine: Turbine | None = None, factors: str = "iec61400-5"
) -> BladeStrength:
    """Strength of plies, spar caps and sandwich faces at the blade stations of a load base, the worst of all blades.

    Ultimate loads are the design loads of a station: contemporaneous loads of the 14 instants at which a load or
    resultant is extreme, with the factors of their design load cases. Fatigue has the cycles of the six loads of all
    cases with their occurrences; since a base does not keep when they occur, their damages are added as if in phase,
    which is an upper bound (G-25). The root is not judged: its loads are kept in axes that do not pitch.

    Args:
      folder: folder of the load base.
      layup: layup of the blade.
      turbine: with another blade than that of the base, of the same length.
      factors: name of partial factors of materials.

    Raises:
      InputError: there is no such base, it has no ultimate loads, or the layup is of another blade.
    """
    results, own, warnings = _opened(folder)
    own = turbine or own
    every = [each for each in interfaces_of(own) if each.name.startswith("blade_station_")]
    points = blade_groups(every)
    counted, extremes = _counted(results, every), _ultimate(results, every)
    if not len(extremes):
        raise InputError(f"{folder}: no ultimate loads: 'meltemi loads run' simulates their cases")
    cases = extremes["case"].unique()

    def of_station(place: float, name: str) -> StationLoads:
        turn, rows = load_rotation(own, place), extremes.loc[name]
        loads, time = rows[list(COMPONENTS)].to_numpy(float) @ turn.T, rows["time"].to_numpy(float)
        mine = [np.flatnonzero(rows["case"] == case) for case in cases]
        none = np.full(1, np.nan), np.zeros((1, len(SIX)))  # no load is extreme here in this case
        each = [(time[i], loads[i]) if len(i) else none for i in mine]

        def damage(unit: Float, line: SnLine) -> float:
            stress, worst = turn.T @ unit, float("nan")  # without cases of fatigue
            for blade in points[name] if counted else ():
                found = [counted[channel] for channel in blade.channels]
                means, total = np.stack([each.means for each in found], axis=1) * stress, 0.0
                for k, (cycles, codes, _) in enumerate(found):
                    middle = stress[k] * cycles.means + (means.sum(axis=1) - means[:, k])[codes]
                    part = Cycles(abs(stress[k]) * cycles.ranges, middle, cycles.counts)
                    total += goodman_damage(part, line) ** (1.0 / line.m)
                worst = float(np.fmax(worst, total**line.m))
            return worst

        return StationLoads(place, [at for at, _ in each], [load for _, load in each], damage)

    found = judged_blade(own, layup, factors, map(of_station, stations(own)[0], points), tuple(map(str, cases)))
    return replace(found, warnings=(*warnings, *found.warnings))


def _counted(results: Results, interfaces: Sequence[Interface]) -> dict[str, _CountedLoad]:
    """Cycles of the channels of interfaces in the lifetime, case by case."""
    wanted = {channel for each in interfaces for channel in each.channels}
    repetitions = shared_repetitions(results)
    place = {name: i for i, name in enumerate(repetitions)}
    parts = defaultdict[str, list[tuple[Cycles, NDArray[np.intp]]]](list)
    for channel, names, codes, cycles in results.store.cycles(results.keys) if results.present else ():
        if channel in wanted:
            weight, at = (np.array([of.get(name, 0) for name in names])[codes] for of in (repetitions, place))
            kept = weight > 0.0
            cycles = cycles._replace(counts=weight * cycles.counts)
            parts[channel].append((Cycles(*(each[kept] for each in cycles)), at[kept]))
    means = results.table("statistics", sorted(wanted)).pivot(index="channel", columns="case", values="mean")
    counted = {}
    for channel, each in parts.items():
        cycles = Cycles(*map(np.concatenate, zip(*(cycles for cycles, _ in each), strict=True)))
        kept = cycles.ranges >= LEAST * cycles.ranges.max(initial=0.0)
        codes = np.concatenate([codes for _, codes in each])[kept]
        mean = means.loc[channel, list(place)].to_numpy(float)
        counted[channel] = _CountedLoad(Cycles(*(x[kept] for x in cycles)), codes, mean)
    return counted
