"""The plan of a load base: all cases of a table for a turbine, with names, seeds, factors and weights."""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from meltemi.cases.case import LoadCase
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import replacing
from meltemi.core.record import Record
from meltemi.core.representation import Card, Fold
from meltemi.core.shown import Shown
from meltemi.core.yamlfile import validated
from meltemi.iec.classes import extreme_speed
from meltemi.iec.models import MODELS
from meltemi.loads.loadbase.campaign import Campaign
from meltemi.loads.loadbase.metocean import Waves
from meltemi.loads.loadbase.ranges import counts, numbers
from meltemi.loads.loadbase.situations import Setting, Variant, case_content, missing, timed
from meltemi.loads.loadbase.table import Fault, LoadCaseRow, LoadTable, names_in
from meltemi.loads.loadbase.weights import HOURS, edges, time_share
from meltemi.loads.loadbase.wording import in_words

if TYPE_CHECKING:
    import pandas as pd

FILE = "plan.csv"
STEADY_DURATION = 100.0
"""Evaluated duration [s] of an idling or locked rotor in steady wind."""
FREQUENT, RARE = 10.0, 50.0
"""Return periods [years] of faults between which the factor falls."""
PRACTICE = (
    *("normal_rate", "emergency_rate", "pitch_imbalance", "mass_imbalance", "idle_pitch", "start_margin"),
    *("wind_stops", "years"),
)
"""Keys of a campaign whose defaults come from practice."""
FEW = 3
"""Number of wind speeds of a quick plan."""
SWEEP = 4
"""Largest number of yaw errors of a row in a quick plan."""
MOST = 2_000_000
"""Largest number of cases of a plan."""


@dataclass(frozen=True)
class Weight:
    """Factors of the weight of a case in the lifetime.

    Attributes:
      state: state of the turbine; empty if the case is counted by occurrences.
      low, high: [m/s] edges of the bin of the wind speed.
      yaw_share: share of the time with its yaw error and its sea.
      runs: number of cases that share the time or the occurrences.
      occurrences: [1/year] occurrences.
      share: share of the lifetime of this case.
      repetitions: number of occurrences of the case in the lifetime.
    """

    state: str
    low: float
    high: float
    yaw_share: float
    runs: int
    occurrences: float
    share: float
    repetitions: float


@dataclass(frozen=True)
class PlannedCase:
    """One case of a load base.

    Attributes:
      name: name, unique and independent of other rows, e.g. ``dlc1.3-14-y0-s04``.
      row: name of its row in the table.
      dlc: design load case.
      title: title of its row.
      variant: wind model, speed, yaw error and so on.
      seed: seed of the turbulence, from the name; None without turbulence.
      duration, transient: [s] evaluated duration, and initial transient before it.
      type: ultimate or fatigue.
      factor: partial safety factor for loads.
      characteristic: rule of the characteristic value.
      weight: weight in the lifetime; None for ultimate loads.
      unsupported: reason for which it cannot run; empty if it can.
      setting: conditions from which its content follows.
    """

    name: str
    row: str
    dlc: str
    title: str
    variant: Variant
    seed: int | None
    duration: float
    transient: float
    type: str
    factor: float
    characteristic: str
    weight: Weight | None
    unsupported: str
    setting: Setting = field(repr=False, compare=False)

    @property
    def content(self) -> dict[str, Any]:
        """Content of its case file; paths are absolute."""
        return case_content(self.setting)

    def case(self) -> LoadCase:
        """The load case as a record.

        Raises:
          InputError: the content is not valid.
        """
        return validated(self.content, LoadCase, self.name)


@dataclass(frozen=True)
class RowSummary:
    """A row of a plan: number of cases, and simulated hours including transients."""

    name: str
    dlc: str
    situation: str
    wind: str
    cases: int
    hours: float
    type: str
    factor: str
    unsupported: int

    @property
    def texts(self) -> list[str]:
        """Name, situation, wind, type, factor, cases and hours as the cells of a table."""
        return [self.name, self.situation, self.wind, self.type, self.factor, str(self.cases), f"{self.hours:.1f}"]


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """All cases of a load base.

    Attributes:
      campaign: campaign that it expands.
      table: table of the edition, with the changes of the campaign.
      cases: cases in the order of the table.
    """

    campaign: Campaign
    table: LoadTable
    cases: tuple[PlannedCase, ...]

    def __repr__(self) -> str:
        return f"Plan({self.campaign.turbine!r}, {len(self.cases)} cases, {self.hours:.1f} h simulated)"

    def card(self) -> Card:
        """Number of cases and hours, by row of the table."""
        c = self.campaign
        speeds = f"V_in {c.cut_in:g}, V_r {c.rated_wind:g}, V_out {c.cut_out:g}, V_ref {c.iec_class.v_ref:g} m/s"
        facts = [
            ("load cases", f"{self.table.title}, {c.where}"),
            ("cases", f"{len(self.cases)}, {self.hours:.1f} h simulated"),
            ("wind speeds", speeds),
        ]
        rows = [row.texts for row in self.summary()]
        head = ["DLC", "situation", "wind", "loads", "factor", "cases", "hours"]
        lacking = [[why, ", ".join(names)] for why, names in self.missing().items()]
        sections = [Fold("Design load cases", rows, head, note=f"{len(rows)} rows"), c.card().folded("Campaign")]
        if lacking:
            sections.append(Fold("Cannot run", lacking, ["what is missing", "DLC"]))
        return Card("Plan", c.turbine_name, facts, sections)

    @property
    def hours(self) -> float:
        """Simulated time [h] of the cases that can run, including transients."""
        return sum(c.duration + c.transient for c in self.cases if not c.unsupported) / 3600.0

    def case(self, name: str) -> PlannedCase:
        """The case of a name.

        Raises:
          InputError: there is no such case.
        """
        for each in self.cases:
            if each.name == name:
                return each
        raise InputError(f"no case {name!r} in the plan; {did_you_mean(name, [each.name for each in self.cases])}")

    def summary(self) -> list[RowSummary]:
        """The rows of the table with their number of cases."""
        rows = []
        for name, row in self.table.rows.items():
            cases = [c for c in self.cases if c.row == name]
            factors = sorted({c.factor for c in cases})
            factor = " to ".join(f"{f:g}" for f in dict.fromkeys(factors[:1] + factors[-1:]))
            wind = ", ".join(dict.fromkeys(_wind_words(c) for c in cases))
            hours, lacking = (
                sum(c.duration + c.transient for c in cases) / 3600.0,
                sum(bool(c.unsupported) for c in cases),
            )
            head = (name, self.table.dlc(name), row.situation, wind)
            rows.append(RowSummary(*head, len(cases), hours, row.type, factor, lacking))
        return rows

    def missing(self) -> dict[str, list[str]]:
        """Reasons for which cases cannot run, with the rows concerned."""
        rows: dict[str, list[str]] = {}
        for c in self.cases:
            if c.unsupported and c.row not in rows.setdefault(c.unsupported, []):
                rows[c.unsupported].append(c.row)
        return rows

    def assumptions(self) -> list[tuple[str, str, str]]:
        """Values that come from practice, in words: part or row, quantity, value with unit."""
        of_campaign: list[tuple[str, Record, str]] = [("campaign", self.campaign, key) for key in PRACTICE]
        return [(part, *in_words(record, key)) for part, record, key in (*self.table.assumptions(), *of_campaign)]

    def frame(self) -> pd.DataFrame:
        """One row a case, as in ``plan.csv``."""
        import pandas as pd

        head, rows = _columns(self)
        return pd.DataFrame(rows, columns=head).set_index("case")


def plan(campaign: Campaign) -> Plan:
    """Expand a campaign to all its cases.

    Raises:
      InputError: the table does not fit the campaign: a range that does not ascend, weights of another number than yaw
        errors, two cases of one name, more than two million cases; or the first case of a row is not a valid case.
    """
    table = campaign.table()
    cases: list[PlannedCase] = []
    for name in table.rows:
        try:
            of_row = list(_cases(name, campaign, table))
        except ValueError as error:
            raise InputError(f"rows.{name}: {error}") from None
        if not of_row:
            raise InputError(f"rows.{name}: it has no cases")
        cases += of_row
        if len(cases) > MOST:
            raise InputError(f"rows.{name}: the plan has more than {MOST} cases")
        for first in {(c.variant.model, c.variant.fault): c for c in reversed(of_row) if not c.unsupported}.values():
            first.case()
    names: set[str] = set()
    for case in cases:
        if case.name in names:
            raise InputError(f"rows.{case.row}: two cases have the name {case.name}")
        names.add(case.name)
    return Plan(campaign, table, tuple(cases))


def _cases(name: str, campaign: Campaign, table: LoadTable) -> Iterator[PlannedCase]:
    defaults, values = campaign.defaults(table), campaign.symbols(table)
    row = timed(table.rows[name], defaults.duration, defaults.transient, defaults.begin)
    steady = row.steady
    if row.storms and campaign.extreme_wind == "steady" and not steady:
        steady = True
        row = row.replace(yaw=row.yaw_steady or row.yaw, characteristic="largest", duration=STEADY_DURATION)
    few = campaign.quick
    models = names_in(row.wind)
    written = () if row.speeds is None else numbers(row.speeds, values)
    if any(speed <= 0.0 for speed in written):
        raise ValueError(f"speeds: {row.speeds!r} gives {min(written):g} m/s, which is not above zero")
    speeds = _some_speeds(sorted(written), campaign.rated_wind) if few else sorted(written)
    yaws = _list(row.yaw, values)
    shares = dict(zip(yaws, _yaw_shares(row, len(yaws), values), strict=True))
    yaws = [*yaws[:: math.ceil(len(yaws) / SWEEP)]] if few and len(yaws) > SWEEP else yaws
    senses = [None] if row.senses is None else [1 if s == "+" else -1 for s in names_in(row.senses)]
    azimuths, instants = _list(row.azimuths, values), _list(row.instants, values)
    if few:
        azimuths, instants = azimuths[:1], instants[:1]
    faults: Sequence[str | None] = names_in(row.faults) or [None]
    rules = counts(row.seeds if row.seeds is not None else str(defaults.seeds), values)
    occurrences = _occurrences(row, written, values)
    if row.sea is not None and campaign.metocean is None:
        raise ValueError(f"sea: {row.sea} needs the conditions of a site in the sea (metocean)")
    bins = edges(speeds)
    for model in models:
        storm = model.startswith("EWM")
        years: Literal[1, 50] = 1 if model == "EWM1" else 50
        for i, speed in enumerate([extreme_speed(campaign.iec_class, years=years, steady=steady)] if storm else speeds):
            speed = round(speed, 9)
            turbulent = MODELS[model].kind == "turbulent" and not steady
            n = 1 if few else _last(rules, speed)
            seeds: Sequence[int | None] = range(1, n + 1) if turbulent else [None]
            others = [senses, azimuths, instants, faults, seeds]
            runs = math.prod(map(len, others))
            seas = _seas(row, campaign, speed, bins[i : i + 2], values)
            for yaw, waves in product(yaws, seas):
                weight = None
                if row.type == "fatigue":
                    share, yearly = shares[yaw] * (waves.share if waves else 1.0), occurrences.get(speed, 0.0)
                    weight = _weight(row, table, campaign, bins[i : i + 2], share, runs, yearly)
                for sense, azimuth, instant, fault, seed in product(*others):
                    variant = Variant(model, speed, yaw, sense, azimuth, instant, fault, seed, waves)
                    yield _planned(name, row, variant, steady, weight, campaign, table, len(models) > 1)


def _seas(
    row: LoadCaseRow, campaign: Campaign, speed: float, ends: list[float], values: dict[str, float]
) -> Sequence[Waves | None]:
    """Seas of a row at a wind speed; in a quick plan the most frequent one."""
    site = campaign.metocean
    if row.sea is None or site is None:
        return [None]
    if site.lacks(row.sea):
        return [Waves(0.0, 0.0)]  # cases that cannot run
    turned = [0.0] if row.misalignment is None else list(numbers(row.misalignment, values))
    levels: list[Any] = names_in(row.levels) or ["mean"]
    seas = site.waves(row.sea, speed, ends[0], ends[1], turned, levels)
    if not campaign.quick:
        return seas
    return [replace(max(seas, key=lambda each: (each.share, each.level, -abs(each.misalignment))), share=1.0)]


def _last(rules: Sequence[tuple[float, int]], speed: float) -> int:
    """Number of seeds at a speed: that of the last rule that applies."""
    return [n for least, n in rules if speed >= least - 1e-9][-1]


def _list(text: str | None, values: dict[str, float]) -> list[Any]:
    return [None] if text is None else list(numbers(text, values))


def _some_speeds(speeds: Sequence[float], rated: float) -> list[float]:
    """First and last speed, and the one nearest to the rated one."""
    if len(speeds) <= FEW:
        return list(speeds)
    nearest = min(speeds[1:-1], key=lambda speed: abs(speed - rated))
    return [speeds[0], nearest, speeds[-1]]


def _yaw_shares(row: LoadCaseRow, n: int, values: dict[str, float]) -> list[float]:
    if row.yaw_weights is None:
        return [1.0 / n] * n
    shares = numbers(row.yaw_weights, values, once=False)
    if len(shares) != n:
        raise ValueError(f"yaw_weights: {len(shares)} for {n} yaw errors")
    if abs(sum(shares) - 1.0) > 1e-6 or min(shares) < 0.0:
        raise ValueError(f"yaw_weights: their sum must be 1, and none negative, found {row.yaw_weights!r}")
    return list(shares)


def _occurrences(row: LoadCaseRow, speeds: Sequence[float], values: dict[str, float]) -> dict[float, float]:
    """Occurrences [1/year] by speed."""
    if row.occurrences is None:
        return {}
    yearly = numbers(row.occurrences, values, once=False)
    if len(yearly) == 1:
        yearly = yearly * len(speeds)
    if len(yearly) != len(speeds):
        raise ValueError(f"occurrences: {len(yearly)} for {len(speeds)} speeds ({row.speeds})")
    return {round(speed, 9): number for speed, number in zip(speeds, yearly, strict=True)}


def _weight(
    row: LoadCaseRow, table: LoadTable, campaign: Campaign, ends: list[float], yaw: float, runs: int, yearly: float
) -> Weight:
    assert row.duration is not None
    low, high = ends
    if row.state is None:
        return Weight("", low, high, yaw, runs, yearly, 0.0, yearly * campaign.years * yaw / runs)
    share = time_share(row.state, table.states, campaign, low, high) * yaw / runs
    repetitions = share * campaign.years * HOURS * 3600.0 / row.duration
    return Weight(row.state, low, high, yaw, runs, 0.0, share, repetitions)


def _planned(
    name: str,
    row: LoadCaseRow,
    v: Variant,
    steady: bool,
    weight: Weight | None,
    campaign: Campaign,
    table: LoadTable,
    several: bool,
) -> PlannedCase:
    parts = [
        *(f"dlc{name}", v.model.lower() if several else "", f"{v.speed:.6g}"),
        "" if v.yaw is None else f"y{v.yaw:.6g}",
        v.waves.name if v.waves else "",
        "" if v.sense is None else "p" if v.sense > 0 else "n",
        "" if v.azimuth is None else f"a{v.azimuth:.6g}",
        "" if v.instant is None else f"t{v.instant:.6g}",
        *(v.fault or "", "" if v.seed is None else f"s{v.seed:02d}"),
    ]
    full = "-".join(filter(None, parts))
    number = None if v.seed is None else seed_of(full, campaign.realisation)
    fault = None if v.fault is None else table.faults[v.fault]
    waves = None if v.waves is None else seed_of(f"{full} waves", campaign.realisation)
    setting = Setting(campaign, row, v, fault, steady, number, waves)
    assert row.duration is not None and row.transient is not None
    names, factor, lacking = (full, name, table.dlc(name), row.title), _factor(row, fault), missing(setting)
    return PlannedCase(
        *names, v, number, row.duration, row.transient, row.type, factor, row.characteristic, weight, lacking, setting
    )


def seed_of(name: str, realisation: int = 1) -> int:
    """Seed of a case, which follows from its name alone."""
    return int.from_bytes(hashlib.sha256(f"{realisation} {name}".encode()).digest()[:6], "big")


def _factor(row: LoadCaseRow, fault: Fault | None) -> float:
    """Partial safety factor; that of rare faults is lower."""
    if row.factor_rare is None or fault is None or fault.return_period is None:
        return row.factor
    share = min(max((fault.return_period - FREQUENT) / (RARE - FREQUENT), 0.0), 1.0)
    return round(row.factor + share * (row.factor_rare - row.factor), 6)


def _wind_words(case: PlannedCase) -> str:
    steady = ", steady" if case.setting.steady and case.variant.model.startswith("EWM") else ""
    return f"{case.variant.model}{steady}"


def _columns(plan: Plan) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of ``plan.csv``."""
    head = (
        "case dlc row situation wind steady speed yaw_deg wave_height wave_period misalignment_deg level sense "
        "azimuth_deg instant fault seed_number seed transient duration type factor characteristic state bin_low "
        "bin_high yaw_share runs occurrences share repetitions unsupported"
    ).split()
    rows = []
    for c in plan.cases:
        v, w = c.variant, c.weight
        weights = astuple(w) if w else ("",) * 8
        rows.append(
            [
                *(c.name, c.dlc, c.row, c.setting.row.situation, v.model, c.setting.steady, v.speed, v.yaw or 0.0),
                *((s.height, s.period, s.misalignment, s.level) if (s := v.waves) else (None,) * 4),
                *(v.sense, v.azimuth, v.instant, v.fault, v.seed, c.seed, c.transient, c.duration, c.type, c.factor),
                *(c.characteristic, *weights, c.unsupported),
            ]
        )
    return head, rows


def write_plan(plan: Plan, folder: str | Path) -> Path:
    """Write ``plan.csv``: one row a case.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(folder) / FILE
    head, rows = _columns(plan)
    with replacing(path) as (partial,), partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(["" if value is None else value for value in row] for row in rows)
    return path
