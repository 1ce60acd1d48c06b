"""Initial states of a controller as rules, each in one quantity of the operating point, from calls of ``init``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.control.controller import Controller, StartPoint
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
INPUTS = ("generator_speed", "pitch", "generator_torque", "wind_speed", "mean_wind")
"""Quantities of an operating point, in the order of the library."""
POLYNOMIAL, STEP, TABLE = 0, 1, 2
POINTS = 1025
"""Number of points of a table over one quantity."""
EXACT = 1e-11
"""Relative difference up to which a rule represents the controller."""


@dataclass(frozen=True)
class StartRule:
    """Dependence of an entry of the state on a quantity of the operating point.

    Attributes:
      entry: index in the state vector; ``quantity``: index in ``INPUTS``.
      kind: polynomial a + b x + c x^2; step, b below a and c above; or a table of equal steps from a to b.
    """

    entry: int
    quantity: int
    kind: int
    a: float
    b: float
    c: float = 0.0
    table: tuple[float, ...] = ()


def start_rules(controller: Controller, turbine: AnyTurbine) -> tuple[Float, list[StartRule], list[tuple[int, float]]]:
    """State at one operating point, rules for the entries that depend on it, and (entry, difference) of inexact ones.

    An entry that depends on several quantities gets a table over the one that changes it most, with the others at the
    middle of their ranges; its largest relative difference over random points is reported.
    """
    low, high = _ranges(turbine)
    points = np.random.default_rng(0).uniform(low, high, (40, len(INPUTS)))
    states = np.array([_state(controller, x) for x in points])
    rules, inexact = [], []
    for entry in np.flatnonzero(np.ptp(states, axis=0) > 0.0):
        rule = _polynomial(int(entry), points, states[:, entry]) or _tabulated(controller, int(entry), low, high)
        rules.append(rule)
        scale = float(np.abs(states[:, entry]).max())
        largest_error = max(abs(value_of(rule, x) - y) for x, y in zip(points, states[:, entry], strict=True))
        if largest_error > EXACT * scale:
            inexact.append((int(entry), largest_error / scale))
    return _state(controller, 0.5 * (low + high)), rules, inexact


def value_of(rule: StartRule, x: Any) -> float:
    """The entry at the quantities ``x`` of an operating point, as the library computes it."""
    at = float(x[rule.quantity])
    if rule.kind == POLYNOMIAL:
        return rule.a + at * (rule.b + at * rule.c)
    if rule.kind == STEP:
        return rule.b if at < rule.a else rule.c
    return float(np.interp(at, np.linspace(rule.a, rule.b, len(rule.table)), rule.table))


def _ranges(turbine: AnyTurbine) -> tuple[Float, Float]:
    control = turbine.control
    speed, torque = control.pitch.reference_speed, control.torque.maximum_torque
    pitch = max(turbine.pitch_actuator.minimum, 0.0)
    low = (0.0, pitch, 0.0, 0.0, 0.0)
    return np.array(low), np.array((1.2 * speed, pitch + 0.5, torque, 30.0, 30.0))


def _state(controller: Controller, x: Any) -> Float:
    speed, pitch, torque, wind, mean = (float(value) for value in x)
    return controller.initial_state(StartPoint(wind, speed, pitch, torque, mean))


def _polynomial(entry: int, points: Float, values: Float) -> StartRule | None:
    for quantity in range(len(INPUTS)):
        x = points[:, quantity]
        size = x.max()
        powers = np.vander(x / size, 3, increasing=True)
        fitted = np.linalg.lstsq(powers, values)[0]
        fitted[np.abs(fitted) < 1e-13 * np.abs(fitted).max()] = 0.0
        a, b, c = (float(value) for value in fitted / size ** np.arange(3))
        b = round(b, 12) if abs(b - round(b)) < 1e-12 else b
        rule = StartRule(entry, quantity, POLYNOMIAL, a, b, c)
        if max(abs(value_of(rule, p) - y) for p, y in zip(points, values, strict=True)) <= EXACT * np.abs(values).max():
            return rule
    return None


def _tabulated(controller: Controller, entry: int, low: Float, high: Float) -> StartRule:
    middle = 0.5 * (low + high)

    def at(quantity: int, value: float) -> float:
        x = middle.copy()
        x[quantity] = value
        return float(_state(controller, x)[entry])

    coarse = [[at(k, v) for v in np.linspace(low[k], high[k], 33)] for k in range(len(INPUTS))]
    quantity = int(np.argmax(np.ptp(coarse, axis=1)))
    begin, end, values = float(low[quantity]), float(high[quantity]), coarse[quantity]
    if len(set(values)) == 2 and np.count_nonzero(np.diff(values)) == 1:
        below, above = begin, end
        for _ in range(60):
            between = 0.5 * (below + above)
            below, above = (between, above) if at(quantity, between) == values[0] else (below, between)
        return StartRule(entry, quantity, STEP, above, values[0], values[-1])
    table = tuple(at(quantity, float(v)) for v in np.linspace(begin, end, POINTS))
    return StartRule(entry, quantity, TABLE, begin, end, table=table)
