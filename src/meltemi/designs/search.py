"""Optimisers behind one interface: SciPy's, and Ipopt where it is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from warnings import catch_warnings

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from meltemi.core.extras import need
from meltemi.designs.problem import Problem

Float = NDArray[np.float64]
FIRST_STEP = 1.0
"""Length of the first step in scales of the variables: optimisers take the negative gradient, of which the unit is that
of the objective."""


def search(problem: Problem, *, method: str, iterations: int, tolerance: float, step: Callable[[Float], None]) -> str:
    """Search for the minimum of a problem; returns why the search ended.

    Args:
      method: slsqp, trust-constr, l-bfgs-b or ipopt.
      iterations: largest number of iterations.
      tolerance: change of the objective at the end.
      step: called with the variables after each iteration.

    Raises:
      InputError: Ipopt is not installed.
    """
    low, high = problem.scaled(problem.variables.low), problem.scaled(problem.variables.high)
    margins = len(problem.limits)

    first = problem.scaled(problem.variables.start)
    steepness = float(np.linalg.norm(problem.jacobian(problem.variables.start)[0] * problem.variables.scale))
    unit = steepness / FIRST_STEP or 1.0
    close = tolerance / unit

    def value(y: Float) -> float:
        return problem.trial(problem.unscaled(y)).objective / unit

    def slope(y: Float) -> Float:
        return problem.jacobian(problem.unscaled(y))[0] * problem.variables.scale / unit

    def limits(y: Float) -> Float:
        return problem.trial(problem.unscaled(y)).margins / unit

    def limit_slopes(y: Float) -> Float:
        return problem.jacobian(problem.unscaled(y))[1:] * problem.variables.scale / unit

    last = first

    def told(y: Float, *_: Any) -> None:
        nonlocal last
        if not np.array_equal(y, last):
            last = np.array(y)
            step(problem.unscaled(y))

    def gradient(y: Float) -> Float:  # which is that of an accepted trial
        told(y)
        return slope(y)

    options: dict[str, Any] = {"maxiter": iterations}
    constraints: Any = ()
    if method == "slsqp":
        options["ftol"] = close  # also the violation of limits that it allows
    elif method == "trust-constr":
        options |= {"gtol": close, "xtol": 1e-3 * tolerance, "initial_tr_radius": 1.0}
        constraints = [NonlinearConstraint(limits, 0.0, np.inf, jac=limit_slopes)] if margins else ()
    elif method == "l-bfgs-b":
        options |= {"ftol": tolerance, "gtol": 0.1 * close}
    if method == "ipopt":
        need("method: ipopt", "cyipopt")
        from cyipopt import minimize_ipopt

        options = {"max_iter": iterations, "tol": close, "acceptable_tol": 10.0 * close, "print_level": 0}
        options |= {"hessian_approximation": "limited-memory", "sb": "yes"}
        of_method: dict[str, Any] = {"options": options, "bounds": list(zip(low, high, strict=True))}
        minimise: Any = minimize_ipopt  # which has no callback
    else:
        of_method = {"options": options, "bounds": Bounds(low, high), "method": method}
        minimise = minimize
    if method in ("l-bfgs-b", "trust-constr"):  # that of SLSQP is called with trials that the line search refuses
        gradient, of_method["callback"] = slope, told
    if margins and method != "trust-constr":
        constraints = [{"type": "ineq", "fun": limits, "jac": limit_slopes}]
    with catch_warnings(action="ignore", category=UserWarning):  # of a limit whose curvature is zero
        found = minimise(value, first, jac=gradient, constraints=constraints, **of_method)
    told(found.x)
    message = found.message
    return message.decode() if isinstance(message, bytes) else str(message)


def multipliers(problem: Problem, x: Float, first: float, margin: float = 1e-4) -> tuple[dict[str, float], float]:
    """Multipliers of active limits and bounds at a design, and what of the gradient they leave (D-22).

    Args:
      first: norm of the scaled gradient at the start.
      margin: limits and bounds within this of their values count as active.

    Returns:
      By text of a limit: change of the objective if the limit is tightened by one, in the limit's unit; by the name of
      a variable: change of the objective per scale of the variable beyond its bound. And the norm of the scaled
      gradient that remains, over that at the start.
    """
    from scipy.optimize import nnls

    trial, rows = problem.trial(x), problem.jacobian(x) * problem.variables.scale
    names = [limit.text for limit in problem.limits]
    active = [(names[k], rows[1 + k]) for k in range(len(names)) if trial.margins[k] <= margin]
    y = problem.scaled(x)
    for p, v in enumerate(problem.variables.each):
        unit = np.zeros(len(x))
        if y[p] - problem.scaled(problem.variables.low)[p] <= margin:
            unit[p] = 1.0
        elif problem.scaled(problem.variables.high)[p] - y[p] <= margin:
            unit[p] = -1.0
        if unit.any():
            active.append((v.name, unit))
    if not active:
        return {}, float(np.linalg.norm(rows[0])) / (first or 1.0)
    found, rest = nnls(np.array([row for _, row in active]).T, rows[0])
    return {name: float(value) for (name, _), value in zip(active, found, strict=True)}, float(rest) / (first or 1.0)
