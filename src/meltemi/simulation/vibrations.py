"""Vibrations of the turbine about its equilibrium in vacuum, and the default time step that resolves them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel, with_static_gears
from meltemi.simulation.case import Case
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]
T = TypeVar("T")

KEEP = 64
"""Number of models whose step and vibrations are remembered."""
STEP_LIMIT = 0.4
"""Largest product of angular frequency and default time step (docs/theory/simulation.md, M-5)."""
IMPLICIT_LIMIT, IMPLICIT_PARTS = 0.8, 3
"""Largest product with implicit stiffness and damping of all coordinates, and the fewest steps within OUTPUT_STEP."""
RESIDUAL_PARTS = 5
"""Fewest steps within OUTPUT_STEP with residual modes: loads within 0.2 % (docs/theory/simulation.md)."""
STIFF, BAND = 2.0, 20.0
"""A coordinate is stiff if its frequency exceeds that of softer ones by this factor, and by this factor BAND [rad/s];
for the shaft the latter is enough."""
LARGEST_ANGLE = 2.5
"""[rad] largest phase of a vibration over an implicit step; faster ones keep it."""
SHAFT_ANGLE = 2.6
"""[rad] largest phase of a stiff shaft over a default step."""
MOST_DAMPING = 0.5
"""Largest damping ratio to which the implicit step is fitted."""
OUTPUT_STEP = 0.05
"""[s] default time steps are integer fractions of this interval."""


def of_model(function: Callable[[BladedModel], T]) -> Callable[[BladedModel], T]:
    """Compute a property of a model once for all runs of it."""
    known: dict[str, T] = {}

    @wraps(function)
    def cached(model: BladedModel) -> T:
        key = model.content_hash()
        if key not in known:
            if len(known) >= KEEP:
                known.clear()
            known[key] = function(model)
        return known[key]

    return cached


def vacuum_case(model: BladedModel) -> Case:
    """A case without air or wind."""
    still = with_static_gears(model).with_parameters(**{"aerodynamics.air_density": 0.0})
    return Case(still, SteadyWind(speed=0.0))


def derivative_matrix(case: Case, which: str, step: float = 1e-4) -> Float:
    """(n, n) central differences of all accelerations with respect to ``"q"`` or ``"v"``."""
    x = case[which]
    n = len(x)
    J = np.zeros((n, n))
    for j in range(n):
        x0 = x[j]
        x[j] = x0 + step
        case.evaluate(0.0)
        ahead = case["a"].copy()
        x[j] = x0 - step
        case.evaluate(0.0)
        J[:, j] = (ahead - case["a"]) / (2.0 * step)
        x[j] = x0
    return J


def equilibrium(case: Case, free: NDArray[np.intp]) -> None:
    """Move the free coordinates to the equilibrium, where their accelerations vanish (Newton), at constant
    velocities."""
    for _ in range(8):
        case.evaluate(0.0)
        J = derivative_matrix(case, "q")[np.ix_(free, free)]
        case.evaluate(0.0)
        finite(J, case["a"])
        step = np.linalg.lstsq(J, case["a"][free], rcond=1e-10)[0]
        case["q"][free] -= step
        if np.max(np.abs(step), initial=0.0) < 1e-10:
            break


def finite(*arrays: Float) -> None:
    """Raise InputError where derivatives about the equilibrium are not finite."""
    if not all(np.all(np.isfinite(array)) for array in arrays):
        raise InputError(
            "natural modes: there is no equilibrium at rest. Second-order displacements are not valid for very high "
            "modes: use fewer modes (options)"
        )


def highest_frequency(model: BladedModel) -> float:
    """[rad/s] highest natural frequency of the assembled turbine at rest."""
    return _fastest(model)[0]


def fastest_coordinate(model: BladedModel) -> str:
    """Name of the coordinate that determines the default time step."""
    return _fastest(model, ~stiff(model))[1]


def _fastest(model: BladedModel, some: Any = True) -> tuple[float, str]:
    """Highest frequency [rad/s] with all but ``some`` coordinates locked, and the largest coordinate of its mode."""
    case = vacuum_case(model)
    free = np.flatnonzero((model.locked == 0.0) & some)
    stiffness = -derivative_matrix(case, "q")[np.ix_(free, free)]
    finite(stiffness)
    if not len(free):
        return 0.0, ""
    squares, shapes = np.linalg.eig(stiffness)
    i = int(np.argmax(np.abs(squares)))
    return float(np.sqrt(np.abs(squares[i]))), model.coordinates[free[int(np.argmax(np.abs(shapes[:, i])))]]


@of_model
def single_vibrations(model: BladedModel) -> Float:
    """(2, n) angular frequency [rad/s] and damping ratio of each coordinate alone, in vacuum at rest (M-38)."""
    case = vacuum_case(model)
    stiffness, damping = (-np.diag(derivative_matrix(case, which)) for which in ("q", "v"))
    frequency = np.sqrt(np.maximum(stiffness, 0.0))
    arms = slice(model.n_core, None), (model.n_blades, -1)
    for each in (frequency, damping):  # gravity tells the blades apart; their mean keeps the rotor symmetric
        each[arms[0]] = np.tile(each[arms[0]].reshape(arms[1]).mean(axis=0), model.n_blades)
    properties = np.array([frequency, 0.5 * damping / np.maximum(frequency, 1e-6)])
    properties.setflags(write=False)
    return properties


def stiff(model: BladedModel) -> NDArray[np.bool_]:
    """(n,) coordinates that do not limit the default step: a fast shaft, residual modes, any far above all others."""
    frequency = single_vibrations(model)[0]
    result = np.array(["residual" in name for name in model.coordinates])
    shaft = model.rows.torsion
    result[shaft] = frequency[shaft] > STIFF * BAND
    order = np.argsort(frequency)
    rising = frequency[order]
    gap = np.flatnonzero(rising[1:] > STIFF * np.maximum(rising[:-1], BAND))
    if len(gap):
        result[order[gap[0] + 1 :]] = True
    return result


def step_weights(model: BladedModel, dt: float) -> Float:
    """(2, n) beta dt^2 [s^2] and kappa dt [s] of each coordinate; zero where its step is explicit (M-44)."""
    frequency, damping = single_vibrations(model)
    weights = np.array([fitted_step(w * dt, z) for w, z in zip(frequency, damping, strict=True)]).T
    weights *= np.array([[dt * dt], [dt]])
    if model.options.integration == "explicit":
        weights *= frequency * dt > STEP_LIMIT
    return weights


def fitted_step(x: float, damping: float) -> tuple[float, float]:
    """Beta and kappa of the implicit step with the exact vibration of one oscillator (M-44).

    Args:
      x: angular frequency times time step.
      damping: ratio to critical.
    """
    lost = damping * x
    angle, damping = min(max(x, 1e-2), LARGEST_ANGLE), min(max(damping, 1e-6), MOST_DAMPING)
    x = max(x, angle)
    z = np.exp(angle * (1j * np.sqrt(1.0 - damping**2) - damping))
    free = -1.0 / x**2 - z / (z - 1.0) ** 2 - damping / x * (z + 1.0) / (z - 1.0)
    delay = 2.0 * damping / x * (z - 1.0) / z
    kappa = -free.imag / delay.imag
    beta = free.real + kappa * delay.real
    # a velocity that lags more would be unstable
    return beta, min(kappa, (1.0 + x * x * (beta - 0.25)) / max(8.0 * lost, 1e-9))


@of_model
def time_step(model: BladedModel) -> float:
    """Default time step [s]: the largest fraction of 0.05 s that resolves the highest frequency that is not stiff.

    A stiff shaft, which jumps of the torque set vibrating, has at most SHAFT_ANGLE.
    """
    residual = any("residual" in name for name in model.coordinates)
    explicit = STEP_LIMIT, RESIDUAL_PARTS if residual else 2
    limit, fewest = explicit if model.options.integration == "explicit" else (IMPLICIT_LIMIT, IMPLICIT_PARTS)
    shaft = single_vibrations(model)[0][model.rows.torsion] * (model.locked[model.rows.torsion] == 0.0)
    rate = max(_fastest(model, ~stiff(model))[0] / limit, float(np.max(shaft, initial=0.0)) / SHAFT_ANGLE)
    return OUTPUT_STEP / max(fewest, int(np.ceil(OUTPUT_STEP * rate)))
