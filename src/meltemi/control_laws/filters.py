"""Discrete low-pass, band-pass and notch filters with a variable centre frequency, for controllers.

With s the Laplace variable, w the corner or centre frequency and zeta the damping ratio:

    low-pass   w / (s + w)
    band-pass  2 zeta w s / (s^2 + 2 zeta w s + w^2)
    notch      (s^2 + w^2) / (s^2 + 2 zeta w s + w^2)

Their integrators follow the trapezoidal rule with g = tan(w dt / 2) in place of w dt / 2 (bilinear transform,
prewarped), so each is exact at w: the band-pass has gain 1 and no phase there, the notch nothing, the low-pass
1 / sqrt(2) and -45 degrees. The states are those of the two integrators. Their sum of squares never grows without
input, for any w and zeta in each call: a centre that follows the rotor speed cannot make a filter unstable.

The states of a filter are a table, ``LowPass`` or ``SecondOrder``, which a controller includes in the table of its
state by ``part``. To start at a constant signal without a jump, call ``low_pass_start`` or ``second_order_start`` once.

Reference: docs/theory/control.md (C-14 to C-17); Zavalishin (2012), sections 3.10 and 4.1; Wishnick (2014).
"""

from __future__ import annotations

import cmath
from math import isfinite, pi, tan

from meltemi.compiler import Table, kernel, number
from meltemi.core.errors import InputError


class LowPass(Table, title="low-pass filter"):
    """State of a low-pass filter."""

    integrator: float = number("signal", "state of the integrator")


class SecondOrder(Table, title="second-order filter"):
    """States of a band-pass or notch filter."""

    first: float = number("signal", "state of the first integrator")
    second: float = number("signal", "state of the second integrator")


_LAST = 1.5
"""Largest half angle w dt / 2 a filter uses: near half the sampling rate (pi / 2) the tangent would change its sign."""


@kernel
def half_angle(w: float, dt: float) -> float:
    """Prewarped g = tan(w dt / 2) of a frequency [rad/s] of either sign, limited to half the sampling rate."""
    return tan(min(0.5 * abs(w) * dt, _LAST))


@kernel
def low_pass(x: LowPass, signal: float, w: float, dt: float) -> float:
    """One call of a first-order low-pass (C-15).

    Args:
      x: state of the filter.
      signal: the input, of any unit.
      w: [rad/s] corner frequency.
      dt: [s] since the last call.

    Returns:
      The output, in the input's unit.
    """
    g = half_angle(w, dt)
    change = g / (1.0 + g) * (signal - x.integrator)
    output = x.integrator + change
    x.integrator = output + change
    return output


@kernel
def band(x: SecondOrder, signal: float, w: float, zeta: float, dt: float) -> float:
    """Band-pass part of a signal; the step of both second-order filters (C-16)."""
    g, k = half_angle(w, dt), 2.0 * zeta
    first = (x.first + g * (signal - x.second)) / (1.0 + g * (g + k))
    second = x.second + g * first
    x.first = 2.0 * first - x.first
    x.second = 2.0 * second - x.second
    return k * first


@kernel
def band_pass(x: SecondOrder, signal: float, w: float, zeta: float, dt: float) -> float:
    """One call of a second-order band-pass (C-16).

    Args:
      x: states of the filter.
      signal: the input, of any unit.
      w: [rad/s] centre frequency, at which gain is 1 and phase 0.
      zeta: damping ratio; the width between gains of 1 / sqrt(2) is 2 zeta w.
      dt: [s] since the last call.

    Returns:
      The output, in the input's unit.
    """
    return band(x, signal, w, zeta, dt)


@kernel
def notch(x: SecondOrder, signal: float, w: float, zeta: float, dt: float) -> float:
    """One call of a notch: the signal minus its band-pass part; arguments as for ``band_pass`` (C-16)."""
    return signal - band(x, signal, w, zeta, dt)


@kernel
def low_pass_start(x: LowPass, signal: float) -> None:
    """Set a low-pass to its steady state for a constant signal."""
    x.integrator = signal


@kernel
def second_order_start(x: SecondOrder, signal: float) -> None:
    """Set a band-pass or notch to its steady state for a constant signal."""
    x.first = 0.0
    x.second = signal


def response(kind: str, frequency: float, w: float, zeta: float, dt: float) -> complex:
    """Frequency response of a discrete filter, for the design of phase offsets (C-17).

    Args:
      kind: ``low_pass``, ``band_pass`` or ``notch``.
      frequency: [rad/s] frequency of the signal, below half the sampling rate.
      w: [rad/s] corner or centre frequency.
      zeta: damping ratio; a low-pass has none.
      dt: [s] time between calls; 0 for the continuous filter.
    """
    if frequency * dt >= pi:
        raise InputError(f"response: {frequency:g} rad/s is not below half the sampling rate, {pi / dt:g} rad/s")
    s = 1j * frequency / w if dt == 0.0 else 1j * tan(0.5 * frequency * dt) / half_angle(w, dt)
    if kind == "low_pass":
        return 1.0 / (1.0 + s)
    below = s * s + 2.0 * zeta * s + 1.0
    if kind == "band_pass":
        return 2.0 * zeta * s / below
    if kind == "notch":
        return (s * s + 1.0) / below
    raise InputError(f"response: kind must be 'low_pass', 'band_pass' or 'notch', found {kind!r}")


def lag(*responses: complex) -> float:
    """Phase [rad] by which a chain of frequency responses lags behind its input."""
    return -sum(cmath.phase(g) for g in responses)


def check_harmonic(harmonic: int, speed: float, sample_time: float, blades: int = 3) -> None:
    """Check that sample time and number of blades allow control at a multiple of the rotor speed.

    Args:
      harmonic: multiple n of the rotor speed.
      speed: [rad/s] largest rotor speed.
      sample_time: [s] time between calls.
      blades: number of blades.

    Raises:
      InputError: n is no positive integer; n times the speed is not below half the sampling rate; or the blades
        cannot distinguish cosine and sine part, since 2 n is a multiple of their number.
    """
    if harmonic != int(harmonic) or harmonic < 1:
        raise InputError(f"harmonic must be a whole number from 1 on, found {harmonic!r}")
    for name, value in (("speed", speed), ("sample_time", sample_time)):
        if not (isfinite(value) and value > 0.0):
            raise InputError(f"harmonic {harmonic}: {name} must be positive, found {value!r}")
    highest = pi / sample_time
    if harmonic * speed >= highest:
        raise InputError(
            f"harmonic {harmonic} of {speed:g} rad/s is {harmonic * speed:g} rad/s, not below half the sampling rate, "
            f"{highest:g} rad/s: use a sample_time below {pi / (harmonic * speed):.4g} s"
        )
    if (2 * harmonic) % blades == 0:
        raise InputError(
            f"harmonic {harmonic}: {blades} blades cannot tell its cosine from its sine part; "
            "2 n must be no multiple of their number"
        )
