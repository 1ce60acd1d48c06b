"""Designs by gradients: cost of a gradient, and of a search, against differences and derivative-free search.

    python benchmarks/designs.py                    # 20 variables, 2 runs of 60 s: some ten minutes on one core
    python benchmarks/designs.py --network --duration 40 --speeds 18 --evaluations 3000 --only differences cobyqa
    python benchmarks/designs.py --duration 600 --speeds 6 8 10 12 14 16 18 20 22 24 --seeds 6 --only gradients

Run-seconds are simulated seconds until 98 % of the improvement that the search by gradients finds; a gradient counts as
the runs whose processor time it takes, as measured here.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution, minimize

from meltemi.core.yamlfile import validated
from meltemi.designs.design import Teller, _Study
from meltemi.designs.settings import Design

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from tune_network import HIDDEN, INPUTS, PARAMETERS, controller

VARIABLES: dict[str, Any] = {
    **{f"controller.{n}": {"low": 0.4, "high": 3.0, "relative": True}
       for n in ("proportional_gain", "integral_gain", "gain_halving_pitch", "filter_frequency")},
    "turbine.blade.aerodynamics.twist": {"knots": 5, "add": True, "low": "-2 deg", "high": "2 deg"},
    "turbine.blade.aerodynamics.chord": {"knots": 5, "low": 0.85, "high": 1.15},
    "turbine.blade.structure.flap_stiffness": {"knots": 3, "low": 0.8, "high": 1.3},
    "turbine.tower.fore_aft_stiffness": {"knots": 3, "low": 0.8, "high": 1.3},
}  # fmt: skip
OBJECTIVE = {"del TwrBsMyt": 0.5, "del RootMyc1": 0.3, "std rotor_speed": 0.3, "travel pitch_1": 0.2, "energy": -0.3}


def network(turbine: Any) -> Any:
    """The controller of the example, with its weights at the start."""
    hidden = np.random.default_rng(1).normal(size=INPUTS * HIDDEN) / np.sqrt(INPUTS)
    return controller(SimpleNamespace(turbine=turbine), np.r_[hidden, np.zeros(2 * HIDDEN + 1)])  # type: ignore[arg-type]


class Enough(Exception):
    """The objective is reached, or the budget spent."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=60.0, help="[s], after 20 s")
    parser.add_argument("--speeds", type=float, nargs="+", default=[14.0, 20.0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--evaluations", type=int, default=1500, help="budget of derivative-free methods")
    parser.add_argument("--only", nargs="+", default=["gradients", "differences", "cobyqa", "nelder-mead", "evolution"])
    parser.add_argument("--gains", action="store_true", help="the four gains only")
    parser.add_argument("--network", action="store_true", help="the 113 parameters of examples/tune_network.py")
    a = parser.parse_args()
    variables = {k: v for k, v in VARIABLES.items() if k.startswith("controller.") or not a.gains}
    variables = {name: {"low": -3.0, "high": 3.0, "scale": 0.1} for name in PARAMETERS} if a.network else variables
    cases = [{"speed": v, "seeds": list(range(1, a.seeds + 1))} for v in a.speeds]
    law = {"kind": "python", "file": __file__, "function": "network"} if a.network else "baseline"
    case = {"controller": law, "duration": a.duration + 20.0, "transient": 20.0, "wind": {"intensity": 0.14}}
    keys = {"turbine": "nrel5mw", "variables": variables, "objective": OBJECTIVE, "case": case, "cases": cases}
    design = validated(keys | {"tolerance": 1e-5, "iterations": 40}, Design, "design")

    def study() -> _Study:
        found = _Study(design, Path(), None, False, 1 if len(cases) < 3 else None, Teller(line=print))
        found.runs.set_units()
        found.problem.begin()
        return found

    warm = study()  # compilation does not count
    x = warm.variables.start
    warm.problem.jacobian(x)
    work = {
        "values": lambda: warm.runs.statistics(x),
        "tables": lambda: warm.derivatives._tables(x, warm.cases[0].case),
        "gradient": lambda: slopes_of(warm, x),
    }
    spent = {}
    for name, each in work.items():
        began = time.process_time()
        each()
        spent[name] = time.process_time() - began
        print(f"{name}: {spent[name]:.3g} s of processor time, {len(x)} variables")
    runs_of_gradient = (spent["gradient"] - spent["tables"]) / spent["values"]
    per_trial = a.seeds * len(a.speeds) * (a.duration + 20.0)
    print(f"a gradient takes the time of {runs_of_gradient:.2f} trials, and {spent['tables']:.2g} s for its tables")
    print(f"central differences take {2 * len(x)} trials, one-sided ones {len(x)}")

    given, began, wall = study(), time.process_time(), time.perf_counter()
    from meltemi.designs.search import search

    gradients: list[Any] = []
    plain = given.problem.jacobian
    given.problem.jacobian = lambda y: (gradients.append(1), plain(y))[1]  # type: ignore[method-assign]
    ended = search(given.problem, method="slsqp", iterations=40, tolerance=1e-5, step=lambda y: None)
    asked = len([k for k in given.history.known if k.startswith("slopes")])
    trials = len([k for k in given.history.known if k.startswith("values")])
    target = given.problem.best().objective
    reach = target + 0.02 * (given.problem.trials[0].objective - target)
    cost = per_trial * until(given, reach, runs_of_gradient)
    print(f"{'method':14s}{'objective':>10s}{'trials':>8s}{'gradients':>10s}{'run-seconds':>13s}{'ratio':>8s}")
    print(f"{'gradients':14s}{target:10.5f}{trials:8d}{asked:10d}{cost:13.0f}{1.0:8.1f}   {ended}; "
          f"{time.process_time() - began:.0f} s of processor, {time.perf_counter() - wall:.0f} s wall")  # fmt: skip
    for method in [m for m in a.only if m != "gradients"]:
        compare(method, study(), reach, a.evaluations, per_trial, cost)


def until(study: _Study, reach: float, runs_of_gradient: float) -> float:
    """Trials until a search reached an objective, its gradients counted as trials."""
    spent, problem = 0.0, study.problem
    for key, entry in study.history.known.items():
        spent += runs_of_gradient if key.startswith("slopes") else 1.0
        if key.startswith("values") and "runs" in entry and problem._objective(problem._totals(entry)) <= reach:
            break
    return spent


def slopes_of(study: _Study, x: Any) -> Any:
    """A gradient of the objective, not from the history."""
    study.history.known = {k: v for k, v in study.history.known.items() if not k.startswith("slopes")}
    study.derivatives._starts.clear()
    return study.problem.jacobian(x)


def compare(method: str, study: _Study, reach: float, budget: int, per_trial: float, cost: float) -> None:
    """Trials of a method until it reaches an objective."""
    problem, best, count = study.problem, [np.inf], [0]

    def value(y: Any) -> float:
        count[0] += 1
        found = problem.trial(problem.unscaled(y)).objective
        problem.trials.clear()
        best[0] = min(best[0], found)
        if best[0] <= reach or count[0] >= budget:
            raise Enough
        return found

    low, high = problem.scaled(study.variables.low), problem.scaled(study.variables.high)
    start, bounds, began = np.zeros(len(low)), list(zip(low, high, strict=True)), time.process_time()
    try:
        if method == "differences":
            minimize(value, start, method="SLSQP", bounds=bounds, options={"eps": 1e-3, "maxiter": 200, "ftol": 1e-6})
        elif method == "evolution":
            differential_evolution(value, bounds, x0=start, seed=1, popsize=5, polish=False)
        else:
            minimize(value, start, method=method.upper() if method == "cobyqa" else "Nelder-Mead", bounds=bounds,
                     options={"maxfev": budget})  # fmt: skip
        ended = "ended by itself"
    except Enough:
        ended = "reached" if best[0] <= reach else "budget spent"
    spent = count[0] * per_trial
    print(
        f"{method:14s}{best[0]:10.5f}{count[0]:8d}{'':10s}{spent:13.0f}{spent / cost:8.1f}   {ended}; "
        f"{time.process_time() - began:.0f} s of processor",
        flush=True,
    )


if __name__ == "__main__":
    main()
