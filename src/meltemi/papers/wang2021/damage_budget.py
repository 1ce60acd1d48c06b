"""Derating planned on a lifetime damage budget: the best distribution of a budget over the wind speeds.

Requate, Meyer and Hofmann (2023), Wind Energ. Sci. 8, 1727, distribute the damage budget of a failure mode over the
lifetime by reducing power. Here the budget is a share of the damage that
production at full power causes in a year at the paper's site; the plan is the share of time at each power limit in
each wind speed bin that keeps the damage within the budget with the largest production: a linear programme. It is
compared with one limit in all winds for the same budget, and for both ways to limit the power: at rated speed (A1)
and at the lowest speed that gives the power (A0).

Plans are computed with half of the seeds and judged with the other half, and vice versa.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.performance import performance_of
from meltemi.iec.winds import ntm, nwp
from meltemi.papers.study import Draw, Progress, answer_chapter, step_progress
from meltemi.papers.wang2021.words import sentence
from meltemi.postprocess.ensemble import mean_interval, weibull_weights
from meltemi.power_control.coordinated import CoordinatedController
from meltemi.power_control.settings import PowerControl, Scheme
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.events import PowerLimit
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.machine_loads import BLADE_ROOT, CHANNELS, LOADS, TOWER_BASE, YAW_BENDING, fatigue
from meltemi.studies.yaw_gusts import FAST
from meltemi.tuning.run_store import attempt, cells
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
SPEEDS = (5.0, 7.0, 9.0, 11.0, 13.0, 17.0, 21.0)
"""[m/s] wind speeds of the runs."""
LEVELS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Power limits over rated power; the first is full power."""
SCHEMES: Mapping[str, Scheme] = {"A1": "rated_speed", "A0": "optimal_speed"}
"""Ways to limit the power; the first one's full power is the base."""
BUDGETS = (0.9, 0.75)
"""Permitted damage over that at full power."""
WIND_CLASS, LEAD, LENGTH = "IIIB", 60.0, 300.0
"""Class of the turbulence; initial transient [s] and judged time [s] of a run."""
ALIKE, PLANNED = "one limit", "planned over the wind"
"""Kinds of plans."""
SPENT = (TOWER_BASE, YAW_BENDING, BLADE_ROOT)
"""Loads whose damage is budgeted."""


@dataclass(frozen=True)
class DamageRates:
    """Power and damage rates of production.

    Attributes:
      power: (speeds, levels, seeds) [W] mean power by scheme.
      damage: (speeds, levels, seeds) damage rate by scheme and load, as L^m of the load in its unit.
      shares: (speeds,) shares of the year.
    """

    power: Mapping[str, Float]
    damage: Mapping[tuple[str, str], Float]
    shares: Float


def study(turbine: Turbine, mean_wind: float, quick: bool, *, workers: int | None, progress: Progress) -> DamageRates:
    """Run production under the power limits."""
    seeds, length = ((1, 2), 20.0) if quick else ((1, 2, 3, 4), LENGTH)
    model = build(turbine, FAST.replace(yaw="held"))
    starts = {v: attempt(f"steady operation at {v:g} m/s", operating_point, model, nwp(v)) for v in SPEEDS}
    laws = {
        name: CoordinatedController(turbine, performance_of(turbine), power=PowerControl(scheme=scheme))
        for name, scheme in SCHEMES.items()
    }
    keys = list(product(SCHEMES, SPEEDS, LEVELS, seeds))
    cases = [
        Run(
            model=model,
            wind=ntm(speed, WIND_CLASS, seed=seed),
            duration=LEAD + length,
            controller=laws[name],
            events=(PowerLimit(at=0.0, power=level * turbine.rated_power),),
            channels=(*CHANNELS, "generator_power"),
            start=starts[speed],
            name=f"{name} {speed:g} m/s {level:g} of rated seed {seed}",
        )
        for name, speed, level, seed in keys
    ]

    def rates(result: Result) -> dict[str, float]:
        part = result.between(LEAD, np.inf)
        loads = {load: fatigue(part, load) ** LOADS[load].slope for load in SPENT}
        return {"power": float(part["generator_power"].mean())} | loads

    results = cells(
        cases, reduce=rates, workers=workers, progress=step_progress(progress, "production under power limits")
    )
    shape = (len(SCHEMES), len(SPEEDS), len(LEVELS), len(seeds))

    def column(of: str) -> Float:
        return np.reshape([each[of] for each in results], shape)

    power = dict(zip(SCHEMES, column("power"), strict=True))
    damage = {(name, load): column(load)[i] for i, name in enumerate(SCHEMES) for load in SPENT}
    return DamageRates(power, damage, weibull_weights(SPEEDS, mean_wind, 2.0, tails="end_bins"))


def plan(power: Float, damage: Float, shares: Float, budget: float, *, alike: bool = False) -> Float:
    """Shares of time at each limit with the largest energy within a damage budget: a linear programme.

    Args:
      power, damage: (speeds, levels) [W] and damage rate; the first level is full power.
      shares: (speeds,) shares of the year.
      budget: share of the damage at full power.
      alike: the same limits at all wind speeds.

    Returns:
      (speeds, levels) shares, each row with the sum one; NaN where no limits keep the budget.
    """
    from scipy.optimize import linprog

    speeds, levels = power.shape
    gain, cost = shares[:, None] * power, shares[:, None] * damage
    most = budget * cost[:, 0].sum()
    if alike:
        solution = linprog(-gain.sum(0), A_ub=cost.sum(0)[None], b_ub=[most], A_eq=np.ones((1, levels)), b_eq=[1.0])
        return np.tile(_solved(solution, levels), (speeds, 1))
    ones = np.kron(np.eye(speeds), np.ones(levels))
    solution = linprog(-gain.ravel(), A_ub=cost.ravel()[None], b_ub=[most], A_eq=ones, b_eq=np.ones(speeds))
    return _solved(solution, speeds * levels).reshape(speeds, levels)


def _solved(solution: Any, size: int) -> Float:
    return np.asarray(solution.x) if solution.success else np.full(size, np.nan)


@dataclass(frozen=True)
class PlanOutcome:
    """Outcome of a kind of plan with seeds not used for the plan, one entry per seed.

    Attributes:
      energy: relative change of the annual energy.
      damage: damage of the budgeted load over that at full power.
      limits: (speeds,) mean power limit over rated power.
    """

    energy: Float
    damage: Float
    limits: Float


def judged(rates: DamageRates, scheme: str, load: str, budget: float, *, alike: bool = False) -> PlanOutcome:
    """Outcome of plans from each half of the seeds, judged with the other half."""
    power, damage = rates.power[scheme], rates.damage[scheme, load]
    n = power.shape[-1]
    halves = (np.arange(n) < n // 2, np.arange(n) >= n // 2)
    energy, left, limits = np.zeros(n), np.zeros(n), []
    for planning, others in (halves, halves[::-1]):
        x = plan(power[..., planning].mean(-1), damage[..., planning].mean(-1), rates.shares, budget, alike=alike)
        weights = rates.shares[:, None] * x
        for of, into in ((power, energy), (damage, left)):
            full = np.einsum("i,ik->k", rates.shares, of[:, 0])
            into[others] = (np.einsum("ij,ijk->k", weights, of) / full)[others]
        limits.append(x @ np.array(LEVELS))
    return PlanOutcome(energy - 1.0, left, np.mean(limits, axis=0))


def kinds(rates: DamageRates, load: str, budget: float) -> dict[str, PlanOutcome]:
    """Outcomes for a budget: limits by wind speed or the same in all winds, by scheme."""
    words = {True: ALIKE, False: PLANNED}
    return {
        f"{words[alike]}, {scheme}": judged(rates, scheme, load, budget, alike=alike)
        for scheme, alike in product(SCHEMES, words)
    }


def _text(values: Float, sign: str = "", factor: float = 1.0, unit: str = "") -> str:
    """Text of mean and interval over the seeds, if there is a plan."""
    return "no plan" if np.isnan(values).any() else with_interval(mean_interval(factor * values), 2, sign) + unit


def budget_table(rates: DamageRates) -> Table:
    """Table of energy and damage of the plans by budgeted load."""
    rows = []
    for load, budget in product(SPENT, BUDGETS):
        for name, kept in kinds(rates, load, budget).items():
            limits = ["-" if np.isnan(x) else f"{100.0 * x:.0f}" for x in kept.limits]
            numbers = [_text(kept.energy, "+", 100.0), _text(kept.damage)]
            rows.append([load, f"{100.0 * budget:.0f}", name, *numbers, *limits])
    head = ["budgeted load", "budget\n%", "plan", "energy\n%", "damage over\nfull power"]
    head += [f"limit at\n{speed:g} m/s, %" for speed in SPEEDS]
    seeds = next(iter(rates.power.values())).shape[-1]
    slopes = ", ".join(f"{load} {LOADS[load].slope:g}" for load in SPENT)
    note = sentence("plans", wind_class=WIND_CLASS, seeds=seeds, slopes=slopes)
    return Table(head, rows, "Energy and damage of planned derating", text_columns=3, note=note)


def verdict(rates: DamageRates) -> str:
    """Conclusion on the value of planning for the first load and the smaller budget."""
    load, budget = SPENT[0], BUDGETS[-1]
    lost = {name: kept.energy for name, kept in kinds(rates, load, budget).items()}
    energy = "; ".join(f"{name} {_text(x, '+', 100.0, ' %')}" for name, x in lost.items())
    saved = {scheme: lost[f"{PLANNED}, {scheme}"] - lost[f"{ALIKE}, {scheme}"] for scheme in SCHEMES}
    both = {scheme: x for scheme, x in saved.items() if not np.isnan(x).any()}  # with a plan of both kinds
    texts = [f"{_text(x, '+', 100.0, ' points')} with {scheme}" for scheme, x in both.items()]
    worth = " and ".join(texts) or "nothing to compare"
    return sentence("budget", load=load, budget=100.0 * budget, energy=energy, saved=worth)


def chapter(rates: DamageRates, draw: Draw) -> Section:
    """Chapter of derating on a damage budget."""
    heading = "Beyond the paper: derating on a damage budget"
    return answer_chapter(heading, lambda: verdict(rates), [], lambda: [budget_table(rates)])
