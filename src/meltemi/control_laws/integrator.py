"""PI or PID law with limits and anti-windup, one for each axis of a controller.

    wanted = k_p e + I + k_d de/dt,   demand = wanted within [low, high]

The limits are arguments of every call: the present capability of the actuator by angle, by rate, or after other
demands. The integral I is in the unit of the demand, so gains may change without a jump. Anti-windup is either

- clamping (``tracking_time`` 0): while the demand is at a limit, the integral takes no step that leads further beyond;
- back-calculation (``tracking_time`` T > 0): the integral is drawn towards the limit with the time constant T.

Where the limits act later, as on the blades after the inverse of the multi-blade coordinates, use wide limits here
and call ``back_calculate`` with the limited demand. Settings and state are a table, ``Integrator``.

Reference: docs/theory/control.md (C-24 to C-26); Åström and Hägglund (2006), section 3.5.
"""

from __future__ import annotations

from math import exp, isfinite

from meltemi.compiler import Table, crossed, kernel, number
from meltemi.core.errors import InputError


class Integrator(Table):
    """Settings and state of an axis."""

    proportional_gain: float = number("demand/error", "k_p")
    integral_gain: float = number("demand/error/s", "k_i")
    derivative_gain: float = number("demand s/error", "k_d")
    derivative_frequency: float = number("rad/s", "corner of the low-pass of the derivative")
    tracking_time: float = number("s", "T of back-calculation; 0: clamping")
    integral: float = number("demand", "state: integral part I of the demand")
    derivative: float = number("error/s", "state: filtered derivative of the error")
    error: float = number("error", "state: that of the last call")
    switches: float = number("-", "limits within the difference step of a parameter, in derivative runs")


@kernel
def integrator(x: Integrator, error: float, low: float, high: float, dt: float) -> float:
    """One call of the law (C-24 to C-26).

    Args:
      x: settings and state.
      error: control error, of any unit; multiplied by the gain schedule, if any.
      low: limit of the demand now.
      high: limit of the demand now.
      dt: [s] since the last call.

    Returns:
      The demand, within the limits.
    """
    keep = exp(-x.derivative_frequency * dt)
    x.derivative = keep * x.derivative + (1.0 - keep) * (error - x.error) / dt
    x.error = error
    step = x.integral_gain * error * dt
    wanted = x.proportional_gain * error + x.integral + step + x.derivative_gain * x.derivative
    x.switches += crossed(wanted - low) + crossed(wanted - high)
    demand = min(max(wanted, low), high)
    if x.tracking_time > 0.0:
        x.integral += step
        back_calculate(x, wanted, demand, dt)
    elif (demand - wanted) * step >= 0.0:
        x.integral += step
    return demand


@kernel
def back_calculate(x: Integrator, wanted: float, done: float, dt: float) -> None:
    """Anti-windup by back-calculation from the limited demand (C-26).

    Without ``tracking_time`` the integral follows at once.
    """
    share = 1.0
    if x.tracking_time > 0.0:
        share = 1.0 - exp(-dt / x.tracking_time)
    x.integral += share * (done - wanted)


def integrator_settings(
    *,
    proportional_gain: float = 0.0,
    integral_gain: float = 0.0,
    derivative_gain: float = 0.0,
    derivative_frequency: float = 0.0,
    tracking_time: float = 0.0,
    integral: float = 0.0,
    error: float = 0.0,
) -> Integrator:
    """Validated settings and initial state of an axis.

    Args:
      proportional_gain: k_p, of any sign, as the other gains.
      integral_gain: k_i.
      derivative_gain: k_d.
      derivative_frequency: [rad/s] corner of the derivative's low-pass; needed with a derivative gain.
      tracking_time: [s] time constant of back-calculation; 0: clamping.
      integral: integral at the start, in the unit of the demand.
      error: error at the start, so that the derivative begins at zero.

    Raises:
      InputError: a number is out of range.
    """
    values = {
        "proportional_gain": proportional_gain,
        "integral_gain": integral_gain,
        "derivative_gain": derivative_gain,
        "derivative_frequency": derivative_frequency,
        "tracking_time": tracking_time,
        "integral": integral,
        "error": error,
    }
    for name, value in values.items():
        if not isfinite(value):
            raise InputError(f"integrator: {name} must be a finite number, found {value!r}")
    for name in ("derivative_frequency", "tracking_time"):
        if values[name] < 0.0:
            raise InputError(f"integrator: {name} must be zero or positive, found {values[name]!r}")
    if derivative_gain != 0.0 and derivative_frequency == 0.0:
        raise InputError("integrator: a derivative_gain needs a derivative_frequency [rad/s], found 0")
    return Integrator.of(**values)
