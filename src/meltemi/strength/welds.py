"""Fatigue of the welds of a tubular tower: nominal stress, detail category, damage and life (G-2 to G-5).

Reference: docs/theory/strength.md.

S-N curves are those of :mod:`meltemi.postprocess.sn`, cycles those of the project's rainflow counting.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf, nan
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.shown import Brief
from meltemi.core.yamlfile import read_mapping, read_record, validated
from meltemi.loads.energy import YEAR
from meltemi.postprocess.cycles import Cycles, cycle_load, rainflow_cycles, sum_cycles
from meltemi.postprocess.sn import Curve, Environment, sn_curve
from meltemi.simulation.result import Result
from meltemi.strength.tube import Shell, Tube, buckling_utilisation, shear_stress, shell_stresses, tube_at
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

DIRECTIONS = 24
"""Places round the shell at which damage is evaluated."""
SIX = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
BASE = (*(f"tower_base_{name}" for name in SIX[:3]), "tower_base_moment_side_side", "tower_base_moment_fore_aft")
FILE = Path(__file__).with_name("factors.yaml")


class FatigueFactors(Record):
    """Partial factors of a standard."""

    stress: float = Field(default=1.0, gt=0.0, le=3.0)
    """Factor [-; 1 to 1.4] on stress ranges."""
    damage: float = Field(default=1.0, ge=1.0, le=10.0)
    """Design fatigue factor [-; 1 to 3] on the damage of the lifetime."""
    source: str = ""


class Weld(Record):
    """A weld all round a tower."""

    height: float
    """[m; 0 to 200] above the tower base."""
    name: str = ""
    category: str = "D"
    """Detail of DNV-RP-C203, such as D, or category of EN 1993-1-9, such as "90"."""
    environment: Environment = "air"
    """Air, cathodic protection, or free corrosion."""
    diameter: float | None = Field(default=None, gt=0.1, lt=50.0)
    """[m; 3 to 12] outer diameter; by default that of the turbine."""
    thickness: float | None = Field(default=None, gt=0.001, lt=0.5)
    """[m; 0.015 to 0.1] wall; by default that of the turbine's diameter and stiffness."""
    scf: float = Field(default=1.0, ge=0.5, le=10.0)
    """Stress concentration factor [-; 1 to 2] that the category does not have, such as of a misalignment."""
    exponent: float | None = Field(default=None, ge=0.0, le=0.5)
    """Exponent of the effect of thickness, in place of that of the curve."""


class WeldPlan(Record):
    """Welds of a tower, and the standard by which they are judged."""

    edition: str = "2016"
    """Year of DNV-RP-C203, ``EN1993``, or path of a YAML file with S-N curves."""
    factors: str | FatigueFactors = "none"
    """Name of partial factors, such as iec61400-1-ed4, or factors."""
    welds: tuple[Weld, ...] = Field(min_length=1)
    shell: Shell = Shell()
    """For buckling of the shell at the welds."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.judged()
        for weld in self.welds:
            curve_of(weld, self.edition)
        return self

    def judged(self) -> FatigueFactors:
        """The partial factors.

        Raises:
          InputError: there are none of this name.
        """
        if isinstance(self.factors, FatigueFactors):
            return self.factors
        if self.factors not in fatigue_factors():
            raise InputError(f"factors {self.factors!r}: {did_you_mean(self.factors, fatigue_factors())}")
        return fatigue_factors()[self.factors]


@cache
def fatigue_factors() -> dict[str, FatigueFactors]:
    """Partial factors that come with the package, by name."""
    return {name: validated(data, FatigueFactors, f"{FILE}: {name}") for name, data in read_mapping(FILE).items()}


def curve_of(weld: Weld, edition: str) -> Curve:
    """S-N curve of a weld.

    Raises:
      InputError: there is none.
    """
    curve = sn_curve(weld.category, weld.environment, edition)
    return curve if weld.exponent is None else curve.replace(exponent=weld.exponent)


def read_welds(path: str | Path) -> WeldPlan:
    """Read welds from a YAML file with the keys ``edition``, ``factors`` and ``welds``.

    Raises:
      InputError: the file is missing, or does not describe welds.
    """
    return read_record(path, WeldPlan)


@dataclass(frozen=True, repr=False)
class WeldFatigue(Brief):
    """Fatigue of a weld.

    Attributes:
      weld, tube, curve: the weld, its section and its S-N curve.
      angles: (A,) [rad] places round the shell, from downwind to the left.
      damage: (A,) damage of the lifetime with the factor on stress, without the design fatigue factor.
      cycles: stress cycles [N/m^2] of the lifetime at the worst place, with all factors.
      load: [N/m^2] damage-equivalent range of 1 Hz of these cycles, for the first slope of the curve.
      life: [years] to a damage of 1 over the design fatigue factor.
      utilisation: damage times the design fatigue factor.
      loads_at: [m] heights of the stations whose loads were taken.
      shear: [N/m^2] largest shear stress; NaN where it is not known.
      buckling: largest compression of the shell with the factors of loads over its resistance; NaN without ultimate
        loads.
    """

    weld: Weld
    tube: Tube
    curve: Curve
    angles: Float
    damage: Float
    cycles: Cycles = field(repr=False)
    load: float
    life: float
    utilisation: float
    loads_at: tuple[float, ...]
    shear: float = nan
    buckling: float = nan

    @property
    def worst(self) -> float:
        """Place [rad] with the largest damage."""
        return float(self.angles[int(self.damage.argmax())])


def numbered_stations(part: Result, of: str, pattern: str, places: Sequence[float] | None) -> dict[float, int]:
    """Numbers of the stations whose channels have the pattern, by place [m]; by default the places are the result's.

    Raises:
      InputError: the place of one is not known.
    """
    known = list((part.meta.get("stations") or {}).get(of, ()) if places is None else places)
    found = {}
    for n in sorted(int(match[1]) for name in part.names if (match := re.fullmatch(pattern, name))):
        if n > len(known):
            raise InputError(f"the place of {of} station {n} is not known: give those of all stations (--stations)")
        found[float(known[n - 1])] = n
    return found


def tower_loads(
    result: Result, turbine: Turbine, stations: Sequence[float] | None = None
) -> dict[float, dict[str, Float]]:
    """Section loads (T,) of a result after its transient, by height [m] of the stations that have bending moments.

    Args:
      result: the result.
      turbine: its turbine.
      stations: [m] heights of the tower's stations 1, 2, ...; by default those that the result states.

    Raises:
      InputError: there are none, or their heights are not known.
    """
    part = result.evaluated
    names: dict[float, Sequence[str]] = {0.0: (*BASE, "tower_base_moment_torsion")}
    for height, n in numbered_stations(part, "tower", r"tower_station_(\d+)_moment_y", stations).items():
        names[height] = [f"tower_station_{n}_{load}" for load in SIX]
    names[turbine.tower.length] = [f"yaw_{load}" for load in SIX]
    found = {}
    for height, channels in names.items():
        known = {load: part[name] for load, name in zip(SIX, channels, strict=True) if name in part}
        if {"moment_x", "moment_y"} <= known.keys():
            found[height] = known
    if not found:
        raise InputError(
            "stress: the result has no bending moments of the tower, such as tower_base_moment_fore_aft and _side_side"
        )
    return dict(sorted(found.items()))


def loads_between(
    known: Mapping[float, Mapping[str, Float]], height: float
) -> tuple[dict[str, Float], tuple[float, ...]]:
    """Loads at a height, linear between the stations below and above it; above the highest those of it.

    Raises:
      InputError: there is no station at or below the height.
    """
    below = [h for h in known if h <= height + 1e-6]
    above = [h for h in known if h >= height - 1e-6]
    if not below:
        raise InputError(
            f"weld at {height:g} m: no station at or below it has loads; the lowest is at {min(known):g} m"
        )
    a, b = max(below), min(above, default=max(below))
    share = (height - a) / (b - a) if b > a else 0.0
    both = known[a].keys() & known[b].keys()
    return {load: (1.0 - share) * known[a][load] + share * known[b][load] for load in both}, tuple(sorted({a, b}))


def station_welds(known: Iterable[float], plan: WeldPlan | None, factors: str | None) -> WeldPlan:
    """A weld of detail D at each station with loads, unless there is a plan; with other factors, if there are any."""
    plan = plan or WeldPlan(welds=tuple(Weld(height=h, name=f"{h:g} m") for h in known))
    return plan if factors is None else plan.replace(factors=factors)


def common(known: Sequence[Mapping[float, object]]) -> list[float]:
    """Stations [m] that all results have.

    Raises:
      InputError: there are none.
    """
    if not (found := sorted(set.intersection(*map(set, known)))):
        raise InputError("stress: the results have no station in common")
    return found


def parts_of(results: Sequence[Result], shares: Sequence[float] | None, years: float) -> Float:
    """(R,) how often the series of each result occurs in a lifetime [years], by shares of it; equal ones by default.

    Raises:
      InputError: shares are not those of the results, a result is too short, or their turbines differ.
    """
    if len(turbines := {str(r.meta["turbine"]) for r in results if "turbine" in r.meta}) > 1:
        raise InputError(f"stress: the results are of different turbines: {', '.join(sorted(turbines))}")
    p = np.full(len(results), 1.0 / max(len(results), 1)) if shares is None else np.asarray(shares, dtype=float)
    if p.shape != (len(results),) or np.any(p < 0.0) or not 0.0 < p.sum() <= 1.0 + 1e-9:
        raise InputError(f"shares: expected {len(results)}, one for each result, with a sum above 0 and up to 1")
    spans = [float(np.ptp(result.evaluated.time)) for result in results]
    if min(spans, default=0.0) <= 0.0:
        raise InputError("stress: a result has less than two samples after its transient")
    return p * years * YEAR / np.array(spans)


def weld_fatigue(
    results: Sequence[Result],
    turbine: Turbine,
    plan: WeldPlan | None = None,
    *,
    shares: Sequence[float] | None = None,
    years: float = 20.0,
    stations: Sequence[float] | None = None,
    factors: str | None = None,
    load_factor: float = 1.35,
) -> tuple[list[WeldFatigue], list[str]]:
    """Fatigue of tower welds over a lifetime that consists of the series of results (G-2 to G-5), and buckling there.

    Args:
      results: results with bending moments of the tower.
      turbine: their turbine.
      plan: welds and standard; by default a weld of detail D in air at each station with loads, without factors.
      shares: share of the lifetime of each result; equal ones by default.
      years: design lifetime [years].
      stations: see :func:`tower_loads`.
      factors: name of partial factors, in place of those of the plan.
      load_factor: partial factor of the loads for buckling; fatigue has 1.

    Returns:
      fatigue of each weld, and warnings.

    Raises:
      InputError: loads are missing, a weld does not fit the tower, or shares are not those of the results.
    """
    known, repeated = [tower_loads(result, turbine, stations) for result in results], parts_of(results, shares, years)
    plan = station_welds(common(known), plan, factors)
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    found, warnings = [], []
    for weld in plan.welds:
        tube, words = tube_of(weld, turbine)
        warnings += [words] * bool(words)
        loads = [loads_between(each, weld.height) for each in known]
        stresses = [shell_stresses(each, tube, angles) for each, _ in loads]
        counted = [[rainflow_cycles(s[a]) for s in stresses] for a in range(len(angles))]
        cycles = [sum_cycles(parts, [*repeated]) for parts in counted]
        shear = max(shear_stress(each, tube) for each, _ in loads)
        buckling = load_factor * max(buckling_utilisation(x, tube, turbine.tower.length, plan.shell) for x, _ in loads)
        weld_of = judged(weld, tube, plan, angles, cycles, years, loads[0][1])
        found.append(replace(weld_of, shear=shear, buckling=buckling))
    return found, warnings


def tube_of(weld: Weld, turbine: Turbine) -> tuple[Tube, str]:
    """Section of a weld, and a warning; what the weld gives takes precedence over the turbine.

    Raises:
      InputError: the weld does not fit the tower.
    """
    if weld.diameter is not None and weld.thickness is not None:
        return Tube(weld.diameter, weld.thickness), ""
    tube, words = tube_at(turbine, weld.height)
    given = Tube(weld.diameter or tube.diameter, weld.thickness or tube.thickness)
    return given, "" if weld.thickness else words


def judged(
    weld: Weld,
    tube: Tube,
    plan: WeldPlan,
    angles: Float,
    cycles: Sequence[Cycles],
    years: float,
    loads_at: tuple[float, ...],
) -> WeldFatigue:
    """Damage and life of a weld from the cycles of nominal stress [N/m^2] of its lifetime at each place (G-4, G-5)."""
    factors, curve = plan.judged(), curve_of(weld, plan.edition)
    raised = [Cycles(weld.scf * factors.stress * c.ranges, weld.scf * c.means, c.counts) for c in cycles]
    damage = np.array([curve.damage(c, tube.thickness) for c in raised])
    use, worst = factors.damage * float(damage.max()), raised[int(damage.argmax())]
    load = cycle_load(worst, slope=curve.m[0], reference=years * YEAR)
    life = years / use if use > 0.0 else inf
    return WeldFatigue(weld, tube, curve, angles, damage, worst, load, life, use, loads_at)
