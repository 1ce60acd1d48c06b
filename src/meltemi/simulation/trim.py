"""Steady operation in steady wind: rotor speed and pitch from the balance of torque and the controller's steady law.

The motion at each trial is that of ``simulation.orbit``; if its search does not converge, the motion is continued from
a rotor in vacuum, with smaller corrections (``meltemi.analyses.continuation``).

Reference: docs/theory/simulation.md (M-10 to M-16).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np

from meltemi.control.baseline import parameters, steady_torque
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.operating_point import NotConverged, OperatingPoint, check_prescribed, no_balance, steady_wind
from meltemi.simulation.orbit import FULL, NEARLY, PITCH_SCAN, Orbit
from meltemi.wind.turbulent import AnyWind

Balance = Callable[..., tuple[float, float, bool]]
SCAN = 9
"""Number of rotor speeds at which the balance of torque is evaluated first."""
STALLED = 3.0
"""Tip-speed ratio below which a rotor stalls, so that pitch angles are tried."""
SETTLE_SWEEPS, SECANT_STEPS, SEARCHES = 3, 5, 4
BALANCE = 1e-4
"""Largest residual torque over rated torque at the end of a search."""
TOLERANCE, ROUGH = 1e-5, 1e-4
"""Relative change of rotor speed or pitch at which the search ends; and the one without the harmonics of the motion."""
UNBALANCED = 30.0
"""Multiple of BALANCE beyond which a search has failed."""
CLOSE = 0.97
"""Fraction of the reference speed above which the search is repeated if the first one predicted the reference speed
in error."""


@one_blas_thread
def operating_point(
    model: BladedModel, wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation of a turbine in steady wind.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; for an unsteady wind its mean.
      rotor_speed: [rad/s]; by default the speed at which the torque balances under the turbine's torque law.
      pitch: [rad]; by default the smallest, or above rated the one that holds the reference speed.

    Raises:
      InputError: the wind cannot turn the rotor, or a prescribed value is beyond any range.
    """
    steady = steady_wind(wind, model.turbine.hub_height)
    check_prescribed("operating_point", model.turbine, rotor_speed, pitch)
    try:
        quick = Orbit(model, steady)
        point = _search(quick, rotor_speed, pitch)
        enough = UNBALANCED * BALANCE * model.turbine.rated_power / point.rotor_speed
        # a prescribed speed may be one where nothing converges; the speed of the search is accepted by its balance
        settled = rotor_speed is None or quick.moved < NEARLY * model.turbine.rotor_radius
        if settled and (rotor_speed is not None or abs(point.imbalance) <= enough or model.has_electrical):
            return point if rotor_speed is None else _judged(point, quick)
    except NotConverged:
        pass
    careful = import_module("meltemi.analyses.continuation")
    orbit = careful.CarefulOrbit(model, steady)
    return _judged(_search(orbit, rotor_speed, pitch, partial(careful.balance_carefully, _balance_speed)), orbit)


def _judged(point: OperatingPoint, orbit: Orbit) -> OperatingPoint:
    """An operating point with a warning if its motion is unstable."""
    unstable = orbit.unstable()
    return replace(point, warnings=(f"steady operation is unstable: {unstable}",)) if unstable else point


def rigid_point(model: BladedModel, wind: AnyWind) -> OperatingPoint:
    """Steady operation of the same turbine with all degrees of freedom of deflection locked: a fallback start."""
    orbit = Orbit(model, steady_wind(wind, model.turbine.hub_height))
    orbit.free_core, orbit.free_blade = orbit.free_core[:0], orbit.free_blade[:0]
    return _search(orbit, None, None)


def _search(
    orbit: Orbit, rotor_speed: float | None, pitch: float | None, careful_balance: Balance | None = None
) -> OperatingPoint:
    """Steady operation by the motion of an orbit; arguments and errors as for :func:`operating_point`.

    Args:
      careful_balance: for an orbit that converges at every trial, or raises NotConverged; else ``_balance_speed``.
    """
    model, steady = orbit.model, orbit.wind
    control = model.turbine.control
    law = parameters(control)
    ratio = model.turbine.drivetrain.gear_ratio
    reference = model.turbine.rated_rotor_speed
    free = model.locked[model.coordinates.index("generator")] == 0.0

    def left_over(speed: float, angle: float) -> float:
        """Residual torque at a rotor speed and pitch."""
        return orbit.sweep(speed, angle, float(steady_torque(law, ratio * speed, angle)))

    angle = control.pitch.minimum if pitch is None else pitch
    if rotor_speed is None and not free:
        rotor_speed = reference
    search_speed, search_pitch, close = rotor_speed is None, False, False
    if rotor_speed is None:
        falling = model.environment.rain
        rain = "" if falling is None else f" in rain of {3.6e6 * falling.intensity:g} mm/h"
        most = angle if pitch is not None else control.pitch.maximum
        stalled = STALLED * steady.speed / model.turbine.rotor_radius
        balance = careful_balance or _balance_speed
        rotor_speed, angle, above = balance(left_over, reference, angle, most, stalled, steady.speed, rain)
        search_pitch = above and pitch is None
        search_speed = not above
        if search_pitch:
            angle = root(lambda x: left_over(reference, x), angle, control.pitch.maximum, 0.02, ROUGH)
    # the harmonics of the motion contribute a little to the mean torque: search once more, close by
    orbit.level = FULL
    for _ in range(SETTLE_SWEEPS):
        left_over(rotor_speed, angle)
    enough = BALANCE * control.torque.rated_power / reference
    for _ in range(SEARCHES):
        if search_speed:
            rotor_speed = _secant(partial(left_over, angle=angle), rotor_speed, 1e-3 * rotor_speed)
            if rotor_speed > reference:  # with the harmonics the rotor exceeds the reference speed
                rotor_speed, search_speed, search_pitch = reference, False, pitch is None
        if search_pitch:
            angle = _secant(lambda x: left_over(reference, x), angle, 1e-3)
            if angle < control.pitch.minimum:  # with the harmonics the rotor no longer reaches the reference speed
                angle, search_pitch, close = control.pitch.minimum, False, True
        if close:
            rotor_speed = root(partial(left_over, angle=angle), CLOSE * reference, reference, 0.01 * reference)
        for _ in range(SETTLE_SWEEPS):
            left_over(rotor_speed, angle)
        settled = careful_balance is not None and not (search_speed or search_pitch or close)
        if settled or abs(orbit.over_revolution) <= enough:
            break
        orbit.unlike = True
    return orbit.finish()


def _secant(f: Callable[[float], float], x: float, step: float) -> float:
    """Root close to ``x`` by the secant method."""
    x_old, f_old = x, f(x)
    x = x + step * np.sign(f_old) if f_old != 0.0 else x
    for _ in range(SECANT_STEPS):
        f_new = f(x)
        if f_new == f_old or abs(x - x_old) < 1e-9:
            break
        move = -f_new * (x - x_old) / (f_new - f_old)
        x_old, f_old, x = x, f_new, x + float(np.clip(move, -20.0 * step, 20.0 * step))
    return x


def _balance_speed(
    left_over: Callable[[float, float], float],
    reference: float,
    pitch: float,
    most: float,
    stalled: float,
    wind_speed: float,
    rain: str = "",
) -> tuple[float, float, bool]:
    """Rotor speed of stable torque balance, a pitch, and whether the rotor would exceed the reference speed.

    Args:
      most: [rad] largest pitch that is tried for a rotor that stalls at ``pitch``.
      stalled: [rad/s] rotor speed below which the rotor counts as stalled.
    """
    speeds = np.linspace(0.25, 1.0, SCAN) * reference
    values = [left_over(speed, pitch) for speed in speeds]
    if values[-1] > 0.0:
        return reference, pitch, True
    balanced_speed = 0.0
    for i in reversed(range(SCAN - 1)):
        if values[i] > 0.0 >= values[i + 1]:
            low, high = speeds[i], speeds[i + 1]
            balanced_speed = root(lambda x: left_over(x, pitch), low, high, 0.25 * (high - low), ROUGH)
            break
    if balanced_speed < stalled:
        for angle in np.arange(pitch + PITCH_SCAN, most, PITCH_SCAN):
            if left_over(reference, float(angle)) > 0.0:
                return reference, float(angle), True
    if balanced_speed == 0.0:
        raise no_balance(wind_speed, rain)
    return balanced_speed, pitch, False


def root(f: Callable[[float], float], low: float, high: float, step: float, tolerance: float = TOLERANCE) -> float:
    """Root of a falling function: widen from ``low`` until the sign changes, then false position (Illinois).

    Args:
      tolerance: relative change of the argument, or of the function, at which the search ends.
    """
    a, fa = low, f(low)
    if fa <= 0.0:
        return low
    b = a
    fb = fa
    while fb > 0.0:
        if b >= high:
            return high
        a, fa = b, fb
        b = min(b + step, high)
        step *= 1.6
        fb = f(b)
    side = 0
    for _ in range(40):
        x = (a * fb - b * fa) / (fb - fa)
        if abs(b - a) < tolerance * max(abs(b), 1e-3):
            return x
        fx = f(x)
        if abs(fx) < tolerance * max(abs(fa), abs(fb), 1e-9):
            return x
        if fx > 0.0:
            a, fa = x, fx
            fb = 0.5 * fb if side == 1 else fb
            side = 1
        else:
            b, fb = x, fx
            fa = 0.5 * fa if side == -1 else fa
            side = -1
    return x
