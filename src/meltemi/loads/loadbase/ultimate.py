"""Ultimate loads of a load base: characteristic values of each row of the table, and which of them governs.

Equations L-11 to L-15, L-19 to L-29, L-35 to L-37 of ``docs/theory/design-loads.md``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.shown import Brief
from meltemi.loads.extrapolation import LEAST, Distribution, Extrapolation, Float, extrapolate, fit_extremes
from meltemi.loads.loadbase.coverage import Results
from meltemi.loads.loadbase.interfaces import Interface
from meltemi.loads.loadbase.settings import WAYS, Way
from meltemi.loads.loadbase.weights import distribution, edges
from meltemi.postprocess.extremes import (
    COMPONENTS,
    DRIVERS,
    ExtremeRow,
    Rule,
    characteristic_rows,
    characteristic_value,
    driver_values,
    extremes_table,
    factored_rows,
    governing_rows,
)

if TYPE_CHECKING:
    import pandas as pd

    from meltemi.loads.loadbase.campaign import Campaign

RULES: dict[str, Rule] = {"largest": "largest", "mean": "mean", "upper half": "upper_half"}
EXTRAPOLATED = "extrapolated"
BY_ROW = ["interface", "driver", "row", "characteristic", "factor", "design", "case", "runs", "lacking"]


@dataclass(frozen=True)
class Runs:
    """Runs of a row with the same partial safety factor.

    Attributes:
      row, dlc: row of the table, and its design load case.
      rule: rule of the characteristic value.
      factor: partial safety factor for loads.
      places: (R,) indices of the runs among the cases that are evaluated.
      names: (R,) names of the cases.
      groups: (R,) number of the group over which a mean is taken.
      speeds: (R,) [m/s] mean wind speeds.
      lacking: number of cases of the row without results.
    """

    row: str
    dlc: str
    rule: str
    factor: float
    places: NDArray[np.intp]
    names: tuple[str, ...]
    groups: NDArray[np.intp]
    speeds: Float
    lacking: int

    def size(self, run: int) -> int:
        """Number of runs in the group of a run."""
        return int(np.sum(self.groups == self.groups[run]))


@dataclass(frozen=True, repr=False)
class ExtrapolatedLoad(Brief):
    """Load of DLC 1.1 by all methods of extrapolation, without partial safety factor.

    Attributes:
      interface: name, or channel such as ``tip_out_of_plane``, or ``tip_towards_tower``.
      driver: load such as "My max"; "max" or "min" of a channel.
      unit: "N", "N m" or "m".
      speeds: (n,) [m/s] wind speeds.
      extremes: (seeds,) extremes of the runs at each speed.
      largest: most severe extreme.
      gumbel, weibull: extrapolations with their band; None where seeds are too few at all speeds.
      left_out: speeds [m/s] with too few seeds or without scatter, by distribution.
      quantiles: loads by the simplified methods of the table, in its order; empty in edition 3.
      factor: partial safety factor, which none of the loads contains.
    """

    interface: str
    driver: str
    unit: str
    speeds: Float
    extremes: tuple[Float, ...]
    largest: float
    gumbel: Extrapolation | None
    weibull: Extrapolation | None
    left_out: dict[str, tuple[float, ...]]
    quantiles: tuple[float, ...]
    factor: float

    def load(self, way: Way) -> float | None:
        """The load by one of the methods; None if the method cannot determine it."""
        if way == "gumbel" or way == "weibull":
            extrapolation = self.gumbel if way == "gumbel" else self.weibull
            return None if extrapolation is None else extrapolation.load
        place = WAYS.index(way) - 2
        return self.quantiles[place] if place < len(self.quantiles) else None


def runs_of(results: Results) -> list[Runs]:
    """Runs of all rows of ultimate loads, by factor.

    Means are taken over runs that differ in the seed only; those of "mean" also over yaw errors (L-35).
    """
    kinds: dict[tuple[str, float], list[int]] = {}
    for i, case in enumerate(results.present):
        if case.type == "ultimate":
            kinds.setdefault((case.row, case.factor), []).append(i)
    evaluated = [case.row for case in results.present]
    planned = [case.row for case in results.plan.cases]
    groups = []
    for (row, factor), places in kinds.items():
        cases = [results.present[i] for i in places]
        rule = cases[0].characteristic
        alike = [replace(c.variant, seed=None, yaw=None if rule == "mean" else c.variant.yaw) for c in cases]
        numbers = {variant: n for n, variant in enumerate(dict.fromkeys(alike))}
        names, speeds = tuple(c.name for c in cases), np.array([c.variant.speed for c in cases])
        of_mean, lacking = np.array([numbers[variant] for variant in alike]), planned.count(row) - evaluated.count(row)
        groups.append(Runs(row, cases[0].dlc, rule, factor, np.array(places), names, of_mean, speeds, lacking))
    return groups


def extrapolated_load(
    runs: Runs, values: Float, results: Results, names: tuple[str, str, str], *, smallest: bool, resamples: int
) -> ExtrapolatedLoad:
    """All extrapolations of an extreme value of the runs of DLC 1.1.

    Args:
      values: (R,) extremes of the runs.
      names: interface, driver, unit.
      smallest: whether the extremes are smallest values.
      resamples: number of bootstrap samples.
    """
    campaign, table = results.plan.campaign, results.plan.table.extrapolation
    planned = sorted({c.variant.speed for c in results.plan.cases if c.row == runs.row})
    weights = dict(zip(planned, speed_shares(campaign, planned), strict=True))
    speeds = sorted(set(runs.speeds.tolist()))
    samples = [values[runs.speeds == speed] for speed in speeds]
    extrapolations: dict[str, Extrapolation | None] = {}
    left_out: dict[str, tuple[float, ...]] = {}
    ways: tuple[Distribution, ...] = ("gumbel", "weibull")
    for way in ways:
        usable = [len(x) >= LEAST[way] and np.ptp(x) > 0.0 for x in samples]
        kept = [(x, weights[v]) for x, v, use in zip(samples, speeds, usable, strict=True) if use]
        left_out[way] = tuple(v for v in planned if v not in speeds or not usable[speeds.index(v)])
        extrapolations[way] = None
        if kept and sum(p for _, p in kept) > table.probability:
            x, p = zip(*kept, strict=True)
            extrapolations[way] = extrapolate(
                x, p, distribution=way, probability=table.probability, smallest=smallest, resamples=resamples
            )
    sign = -1.0 if smallest else 1.0
    fits = [fit_extremes(sign * x) for x in samples if len(x) >= LEAST["gumbel"] and np.ptp(x) > 0.0]
    quantiles = tuple(
        sign * factor * max(float(fit.quantile(1.0 - quantile)) for fit in fits)
        for factor, quantile in (table.quantiles if fits else ())
    )
    data = (np.array(speeds), tuple(samples), float(sign * (sign * values).max()))
    both = (extrapolations["gumbel"], extrapolations["weibull"])
    return ExtrapolatedLoad(*names, *data, *both, left_out, quantiles, runs.factor)


def speed_shares(campaign: Campaign, speeds: Sequence[float]) -> list[float]:
    """Probabilities of the bins of wind speeds between cut-in and cut-out among all time (L-36)."""
    wind, ends = distribution(campaign), np.clip(edges(speeds), campaign.cut_in, campaign.cut_out)
    return [wind.between(low, high) for low, high in pairwise(ends.tolist())]


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of characteristic values.

    Attributes:
      results: results of the load base.
      runs: runs of the rows of ultimate loads.
      way: method of extrapolation.
      resamples: number of bootstrap samples.
      extrapolations: all extrapolated loads so far.
    """

    results: Results
    runs: list[Runs]
    way: Way
    resamples: int
    extrapolations: list[ExtrapolatedLoad]

    def value(
        self, runs: Runs, values: Float, names: tuple[str, str, str], smallest: bool, keep: bool = True
    ) -> tuple[float, int] | None:
        """Characteristic value of (R,) extremes, and the run nearest to it; None if it cannot be determined."""
        sign = -1.0 if smallest else 1.0
        if runs.rule != EXTRAPOLATED:
            value, run = characteristic_value(sign * values, rule=RULES[runs.rule], speeds=runs.groups)
            return sign * value, run
        n = self.resamples if keep else 1
        load = extrapolated_load(runs, values, self.results, names, smallest=smallest, resamples=n)
        if keep and (load.gumbel or load.weibull or load.quantiles):
            self.extrapolations.append(load)
        design = load.load(self.way)
        return None if design is None else (design, int(np.argmin(np.abs(values - design))))


def ultimate_tables(
    evaluation: Evaluation, interfaces: Sequence[Interface], favourable: float
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Design loads of all interfaces with factor, and the loads of each row; see ``DesignLoads``."""
    import pandas as pd

    kept = evaluation.results.table("extremes")
    if not len(kept):
        return _no_matrix(), pd.DataFrame(columns=BY_ROW).set_index(BY_ROW[:3])
    order = pd.Index([case.name for case in evaluation.results.present]).get_indexer(kept["case"])
    kept = kept.iloc[np.argsort(order, kind="stable")]
    of_interface = kept.groupby("interface").indices
    matrices: list[pd.DataFrame] = []
    lines: dict[tuple[str, str, str], tuple[float, tuple[Any, ...]]] = {}
    for name, members in blade_groups(interfaces).items():
        plane = members[0].plane
        loads, times, blades = worst_member([kept.iloc[of_interface[each.name]] for each in members], plane)
        tables = []
        for runs in evaluation.runs:
            rows = _rows(evaluation, runs, name, loads[runs.places], plane)
            if not rows:
                continue
            tables.append(factored_rows(rows, favourable=favourable))
            for row, design in zip(rows, tables[-1], strict=True):
                size = runs.size(runs.names.index(row.case))
                line = (row.value, design.factor, design.value, row.case, size, runs.lacking)
                key = (name, row.driver, runs.row)
                if key not in lines or design.severity > lines[key][0]:  # a row may have several factors
                    lines[key] = (design.severity, line)
        if tables:
            rows = governing_rows(tables)
            matrices.append(_matrix(evaluation, name, rows, times, blades))
    by_row = pd.DataFrame([(*key, *line) for key, (_, line) in lines.items()], columns=BY_ROW)
    return pd.concat(matrices) if matrices else _no_matrix(), by_row.set_index(BY_ROW[:3]).sort_index()


def _no_matrix() -> pd.DataFrame:
    import pandas as pd

    head = [*extremes_table(()).columns, "row", "dlc", "blade", "time", "rule", "runs", "lacking", "state"]
    return pd.DataFrame(columns=["interface", "driver", *head]).set_index(["interface", "driver"])


def _rows(evaluation: Evaluation, runs: Runs, name: str, loads: Float, plane: str) -> tuple[ExtremeRow, ...]:
    """Characteristic rows (14) of an interface; none where the extrapolation has too few seeds."""
    if runs.rule != EXTRAPOLATED:
        rule = RULES[runs.rule]
        return characteristic_rows(loads, plane, runs.names, rule=rule, factor=runs.factor, speeds=runs.groups)
    scaled = []
    for k, row in enumerate(
        characteristic_rows(loads, plane, runs.names, rule="largest", factor=runs.factor, speeds=runs.groups)
    ):
        unit = "N m" if row.driver.startswith("M") else "N"
        values = driver_values(loads[:, k], plane)[:, k]
        value = evaluation.value(runs, values, (name, row.driver, unit), row.driver.endswith("min"))
        if value is None and np.ptp(values) > 0.0:
            return ()
        ratio = value[0] / row.value if value and value[0] * row.value > 0.0 else 1.0
        scaled.append(replace(row, loads=tuple(ratio * x for x in row.loads), scale=ratio))
    return tuple(scaled)


def _matrix(
    evaluation: Evaluation, name: str, rows: Sequence[ExtremeRow], times: Float, blades: NDArray[np.intp]
) -> pd.DataFrame:
    """Governing rows with the facts of their cases."""
    import pandas as pd

    results = evaluation.results
    places = {case.name: i for i, case in enumerate(results.present)}
    runs_by_case = {name: runs for runs in evaluation.runs for name in runs.names}
    more = []
    for k, row in enumerate(rows):
        runs, i = runs_by_case[row.case], places[row.case]
        size = runs.size(runs.names.index(row.case))
        more.append((runs.row, runs.dlc, blades[i, k], times[i, k], runs.rule, size, runs.lacking))
    table = extremes_table(rows).reset_index()
    table[["row", "dlc", "blade", "time", "rule", "runs", "lacking"]] = pd.DataFrame(more)
    table["state"] = [results.states[row.case] for row in rows]
    table.insert(0, "interface", name)
    return table.set_index(["interface", "driver"])


def blade_groups(interfaces: Iterable[Interface]) -> dict[str, list[Interface]]:
    """Interfaces by name without the number of the blade: those of all blades together."""
    groups: dict[str, list[Interface]] = {}
    for each in interfaces:
        groups.setdefault(family(each.name), []).append(each)
    return groups


def family(name: str) -> str:
    """Name without the number of the blade, which is its last part."""
    stem, _, last = name.rpartition("_")
    return stem if last.isdigit() and name.startswith(OF_BLADES) else name


OF_BLADES = ("blade_", "root_", "station_", "tip_", "pitch_")
"""Prefixes of the names of interfaces and channels of single blades."""


def worst_member(parts: Sequence[pd.DataFrame], plane: str) -> tuple[Float, Float, NDArray[np.intp]]:
    """Loads (R, 14, 6), times (R, 14) and blade (R, 14) of the extremes of each run at the worst of several interfaces.

    Args:
      parts: extremes of all runs, in their order, at one interface, or at that of each blade.
      plane: transverse axes.
    """
    shape = (len(parts), -1, len(DRIVERS))
    loads = np.stack([part[list(COMPONENTS)].to_numpy(float) for part in parts]).reshape(*shape, 6)
    times = np.stack([part["time"].to_numpy(float) for part in parts]).reshape(shape)
    k = np.arange(len(DRIVERS))
    signs = np.where([driver.endswith("min") for driver in DRIVERS], -1.0, 1.0)
    values = signs * driver_values(loads, plane)[..., k, k]
    worst = values.argmax(axis=0)
    runs = np.arange(loads.shape[1])[:, None]
    blades = worst + 1 if len(parts) > 1 else np.zeros_like(worst)
    return loads[worst, runs, k], times[worst, runs, k], blades


def each_row(
    evaluation: Evaluation, values: Float, names: tuple[str, str, str], smallest: bool, *, keep: bool = False
) -> list[tuple[Runs, float, int]]:
    """Characteristic value of (cases,) extremes in each row: its runs, the value, the place of the nearest run."""
    rows = []
    for runs in evaluation.runs:
        value = evaluation.value(runs, values[runs.places], names, smallest, keep)
        if value is not None:
            rows.append((runs, *value))
    return rows
