"""Fatigue, energy and duty of a load base over its lifetime.

Equations L-1 to L-10, L-30 to L-34, L-36, L-39, L-40 of ``docs/theory/design-loads.md``.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.shown import Brief
from meltemi.loads.durations import LoadDuration, duration_load
from meltemi.loads.energy import YEAR, AnnualEnergy, annual_energy
from meltemi.loads.loadbase.coverage import Results, shared_repetitions
from meltemi.loads.loadbase.interfaces import Interface
from meltemi.loads.loadbase.reduction import OCTAVES
from meltemi.loads.loadbase.settings import DesignSettings
from meltemi.loads.loadbase.signals import Extremes, rose_channel
from meltemi.loads.loadbase.ultimate import blade_groups, family, speed_shares
from meltemi.postprocess.cycles import Cycles, Float, Index, goodman_cycles
from meltemi.postprocess.extremes import COMPONENTS

if TYPE_CHECKING:
    import pandas as pd

RANGES, MEANS = 50, 20
"""Numbers of bins of a Markov matrix."""
EXPONENTS = (3.0, 10.0 / 3.0)
"""Life exponents of ball and roller bearings."""


@dataclass(frozen=True, repr=False)
class MarkovMatrix(Brief):
    """Cycles of the lifetime by range and mean.

    Attributes:
      range_edges: (R + 1,) edges of the ranges, in the unit of the load.
      mean_edges: (M + 1,) edges of the means, in the unit of the load.
      counts: (R, M) numbers of cycles.
    """

    range_edges: Float
    mean_edges: Float
    counts: Float


def labels_of(interfaces: Sequence[Interface], lines: Mapping[str, str]) -> dict[str, tuple[str, str, int]]:
    """Interface, load and blade (0: none) of each channel of fatigue; a channel of two interfaces belongs to the first.

    Args:
      lines: names of mooring lines by the channels of their tensions.
    """
    labels: dict[str, tuple[str, str, int]] = {channel: (line, "F", 0) for channel, line in lines.items()}
    for name, members in blade_groups(interfaces).items():
        for n, each in enumerate(members, start=1):
            blade = n if len(members) > 1 else 0
            for channel, load in zip(each.channels, COMPONENTS, strict=True):
                labels.setdefault(channel, (name, load, blade))
            for angle in range(30, 180, 30) if each.rose else ():
                labels.setdefault(rose_channel(each, angle), (name, f"M@{angle}", blade))
            if name == "blade_root":
                labels |= {f"root_moment_{load}_{n}": (name, load, n) for load in ("flap", "edge")}
    return labels


def fatigue_loads(
    results: Results,
    extremes: Extremes,
    interfaces: Sequence[Interface],
    lines: Mapping[str, str],
    settings: DesignSettings,
) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, MarkovMatrix]]:
    """Equivalent loads, shares and Markov matrices of the lifetime, see ``DesignLoads`` (L-4 to L-6, L-40).

    Args:
      extremes: extremes of the channels, which bound ranges and means.
      lines: names of its mooring lines by the channels of their tensions.
      settings: slopes, reference and strengths.

    Raises:
      InputError: a strength belongs to no channel, or a mean reaches it.
    """
    import pandas as pd

    strengths, m = settings.strengths, np.array(settings.slopes, dtype=float)
    labels, repetitions = labels_of(interfaces, lines), shared_repetitions(results)
    known = {*labels, *map(family, labels)}
    for name in strengths:
        if name not in known:
            raise InputError(f"strengths: no channel {name!r}: {did_you_mean(name, known)}")
    cases = {case.name: i for i, case in enumerate(results.present)}
    weight = np.array([repetitions.get(name, 0.0) for name in cases])
    conditions = list(dict.fromkeys((c.dlc, c.variant.speed) for c in results.present if c.weight))
    place = np.array([conditions.index((c.dlc, c.variant.speed)) if c.weight else 0 for c in results.present])
    counted = np.array([bool(c.weight) for c in results.present], dtype=bool)
    # sums by case, and counts by equal weights, are exact: their bits do not depend on which cases share a file
    weights, group = np.unique(weight, return_inverse=True)
    scales, matrices, damage = dict[str, float](), dict[str, MarkovMatrix](), dict[str, Float]()
    counts = dict[str, Float]()
    for channel, names, codes, cycles in results.store.cycles(results.keys) if conditions else ():
        if channel not in labels or not len(codes):
            continue
        if channel not in damage:
            low, high = extremes.values(channel, "min")[counted].min(), extremes.values(channel, "max")[counted].max()
            matrices[channel] = _empty_matrix(float(low), float(high))
            scales[channel] = float(matrices[channel].range_edges[-1])
            damage[channel] = np.zeros((len(m), len(cases)))
            counts[channel] = np.zeros((len(weights), RANGES * MEANS))
        at = np.array([cases[name] for name in names])
        _add(counts[channel], matrices[channel], group[at][codes], cycles)
        strength = strengths.get(channel, strengths.get(family(channel)))
        ranges = cycles.ranges if strength is None else _corrected(channel, cycles, strength)
        logs = np.log(np.maximum(ranges / scales[channel], 1e-300))
        for k, slope in enumerate(m):
            sums = np.bincount(codes, cycles.counts * np.exp(slope * logs), len(names))
            np.add.at(damage[channel][k], at, weight[at] * sums)
    order = [name for name in labels if name in damage]
    for name in order:
        damage[name] = np.array([np.bincount(place, sums, len(conditions)) for sums in damage[name]])
        matrices[name].counts[:] = (weights @ counts[name]).reshape(RANGES, MEANS)
    loads = [
        [*labels[name], *(scales[name] * (damage[name].sum(axis=1) / settings.reference) ** (1.0 / m)).tolist()]
        for name in order
    ]
    columns = ["interface", "load", "blade", *m.tolist()]
    with np.errstate(invalid="ignore"):
        shares = [damage[name] / damage[name].sum(axis=1)[:, None] for name in order]
    index = pd.MultiIndex.from_tuples(
        [(name, *condition) for name in order for condition in conditions], names=["channel", "dlc", "speed"]
    )
    flat = np.concatenate([x.T for x in shares] or [np.zeros((0, len(m)))])
    return (
        pd.DataFrame(loads, index=pd.Index(order, name="channel"), columns=columns),
        pd.DataFrame(flat, index=index, columns=m.tolist()),
        {name: matrices[name] for name in order},
    )


def _empty_matrix(low: float, high: float) -> MarkovMatrix:
    """Matrix for a load between two values, a little wider, since stored ranges and means are rounded."""
    margin = 1e-3 * max(abs(low), abs(high))
    edges = np.linspace(0.0, 1.001 * (high - low), RANGES + 1), np.linspace(low - margin, high + margin, MEANS + 1)
    return MarkovMatrix(*edges, np.zeros((RANGES, MEANS)))


def _corrected(channel: str, cycles: Cycles, strength: float) -> Float:
    try:
        return goodman_cycles(cycles, strength).ranges
    except InputError as error:
        raise InputError(f"strengths: {channel}: {error}") from None


def _add(counts: Float, matrix: MarkovMatrix, group: Index, cycles: Cycles) -> None:
    """Count cycles in the bins of a matrix, by group (groups, bins)."""
    places = []
    for x, edges in ((cycles.ranges, matrix.range_edges), (cycles.means, matrix.mean_edges)):
        n, width = len(edges) - 1, edges[-1] - edges[0]
        share = (x - edges[0]) / width if width > 0.0 else np.zeros(len(x))
        places.append(np.clip((share * n).astype(np.intp), 0, n - 1))
    np.add.at(counts, (group, places[0] * MEANS + places[1]), cycles.counts)


def rose_fatigue(fatigue: pd.DataFrame, interfaces: Sequence[Interface], slopes: Sequence[float]) -> pd.DataFrame:
    """Lifetime equivalent moment in each direction, of the worst blade; index (interface, angle [deg]) (L-17)."""
    import pandas as pd

    lines = []
    for name, members in blade_groups(each for each in interfaces if each.rose).items():
        for angle in range(0, 360, 30):
            channels = [channel for each in members if (channel := rose_channel(each, angle % 180)) in fatigue.index]
            if channels:
                lines.append((name, angle, *fatigue.loc[channels, [*slopes]].max()))
    return pd.DataFrame(lines, columns=["interface", "angle", *slopes]).set_index(["interface", "angle"])


def energy_of(results: Results, extremes: Extremes, availability: float) -> tuple[AnnualEnergy | None, pd.DataFrame]:
    """Annual energy in production, and the power at each wind speed (L-9, L-10, L-36)."""
    import pandas as pd

    head = ["speed", "power", "half_width", "runs", "probability", "energy"]
    row = production_row(results)
    planned = sorted({c.variant.speed for c in results.plan.cases if c.row == row})
    strata: dict[tuple[float, float], list[int]] = {}
    for i, case in enumerate(results.present):
        if case.row == row and case.weight:
            strata.setdefault((case.variant.speed, case.variant.yaw or 0.0), []).append(i)
    if not strata:
        return None, pd.DataFrame(columns=head).set_index("speed")
    shares = defaultdict[float, float](float)
    yaw = {key: results.present[members[0]].weight.yaw_share for key, members in strata.items()}  # type: ignore[union-attr]
    for (speed, _), share in yaw.items():
        shares[speed] += share
    of_speed = dict(zip(planned, speed_shares(results.plan.campaign, planned), strict=True))
    power = extremes.values("generator_power", "mean")
    samples = [power[members] for members in strata.values()]
    weights = [of_speed[speed] * yaw[speed, error] / shares[speed] for speed, error in strata]
    total = annual_energy(samples, weights, availability=availability)
    lines = []
    for speed in sorted(shares):
        members = [k for k, key in enumerate(strata) if key[0] == speed]
        part = annual_energy([samples[k] for k in members], [weights[k] for k in members], availability=availability)
        seconds = YEAR * availability * of_speed[speed]
        runs = sum(len(samples[k]) for k in members)
        mean, half = (part.energy / seconds, part.half_width / seconds) if seconds > 0.0 else (np.nan, np.nan)
        lines.append((speed, mean, half, runs, of_speed[speed], part.energy))
    return total, pd.DataFrame(lines, columns=head).set_index("speed")


def production_row(results: Results) -> str | None:
    """Row of fatigue in production with the time that the other states leave."""
    table = results.plan.table
    for name, row in table.rows.items():
        state = None if row.state is None else table.states[row.state]
        if state is not None and row.situation == "production" and state.inside is None and state.hours is None:
            return name
    return None


def stops_of(results: Results) -> pd.DataFrame:
    """Number of stops per year, by row (L-39)."""
    import pandas as pd

    repetitions, years = shared_repetitions(results), results.plan.campaign.years
    frame = results.table("cases")
    stops = defaultdict[str, float](float)
    for case in results.present:
        if case.weight:
            stops[case.row] += float(frame.at[case.name, "stops"]) * repetitions[case.name] / years
    return pd.DataFrame({"stops": stops}).rename_axis("row")


def duties_of(results: Results) -> pd.DataFrame:
    """Annual duty of the drives; see ``DesignLoads.duties`` (L-32, L-33, L-39)."""
    import pandas as pd

    repetitions, years = shared_repetitions(results), results.plan.campaign.years
    frame = results.table("duties")
    lines = {}
    for drive, cases in frame.groupby("drive", sort=False) if len(frame) else ():
        w = _weights(cases, repetitions) / years
        names = ("time", "travel", "moving", "starts", "reversals")
        time, *sums = (float(w @ cases[name].to_numpy(float)) for name in names)
        square = float(w @ (cases["time"] * cases["rms_rate"] ** 2).to_numpy(float))
        rms, moving = (np.sqrt(square / time), sums[1] / time) if time > 0.0 else (np.nan, np.nan)
        worst = cases.loc[cases["largest_rate"].idxmax()]
        lines[drive] = [*sums, rms, worst["largest_rate"], str(worst["case"]), moving]
    head = "travel moving starts reversals rms_rate largest_rate case moving_share".split()
    return pd.DataFrame.from_dict(lines, orient="index", columns=head).rename_axis("drive")


def _weights(rows: pd.DataFrame, repetitions: Mapping[str, float]) -> Float:
    """Occurrences in the lifetime of the case of each row; 0 for cases that do not count."""
    return rows["case"].astype(str).map(repetitions).fillna(0.0).to_numpy(float)


def durations_of(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Load-duration distributions of the lifetime, and their equivalent loads (L-30, L-31).

    Levels below the largest one over 2^8 are one level, as in the results of each case.
    """
    import pandas as pd

    repetitions = shared_repetitions(results)
    frame = results.table("durations")
    head = ["load", "low", "high", "time", "revolutions"]
    parts, loads = [], {}
    for load, cases in frame.groupby("load", sort=False) if len(frame) else ():
        cases = cases.assign(weight=_weights(cases, repetitions)).query("weight > 0")
        if cases.empty:
            continue
        low, high, weight, *amounts = cases[["low", "high", "weight", "time", "revolutions"]].to_numpy(float).T
        small = max(-low.min(), high.max()) / 2.0**OCTAVES
        about = (np.abs(low) <= small * (1.0 + 1e-9)) & (np.abs(high) <= small * (1.0 + 1e-9))
        ends = np.where(about, -small, low), np.where(about, small, high)
        levels = pd.DataFrame(dict(zip(head[1:], (*ends, *(weight * x for x in amounts)), strict=True)))
        levels = levels.groupby(["low", "high"], as_index=False).sum()
        levels.insert(0, "load", load)
        parts.append(levels)
        if levels["revolutions"].sum() > 0.0:
            loads[load] = [_equivalent(levels, p) for p in EXPONENTS]
    whole = pd.concat(parts) if parts else pd.DataFrame(columns=head)
    equivalent = pd.DataFrame.from_dict(loads, orient="index", columns=list(EXPONENTS)).rename_axis("load")
    return whole.set_index(head[:3]), equivalent


def _equivalent(levels: pd.DataFrame, exponent: float) -> float:
    """Equivalent load of the levels that occur; gaps between them have no revolutions."""
    low, high = levels["low"].to_numpy(float), levels["high"].to_numpy(float)
    edges = np.unique(np.concatenate([low, high]))
    turns = np.zeros((len(edges) - 1, 1))
    np.add.at(turns[:, 0], np.searchsorted(edges, low), levels["revolutions"].to_numpy(float))
    return duration_load(LoadDuration(edges, np.array([-np.inf, np.inf]), turns, turns), exponent=exponent)
