"""Currents through an inductor under a controlled voltage, in a rotating frame: exact steps.

Both sides of the converter are the same circuit in their dq axes, which rotate with the angular frequency w:

    L di/dt = y - s - (R + j w L) i          i = i_d + j i_q

with the voltage s of the source (electromotive force, grid) and y, which the converter holds over a step. The
current control has an internal model of the circuit, and active damping: current follows its reference like
1 / (1 + s/rate), and disturbances decay as fast, at every length of the step.

Reference: docs/theory/electrical.md (E-6 to E-12); Harnefors & Nee (1998), IEEE Trans. Ind. Appl. 34(1):133.
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

from meltemi.compiler import kernel
from meltemi.maths.phasors import Phasor, magnitude, polar, real_product

LEAST_SQUARE = 1e-12
"""[A^2] lower limit of a mean square, so that its root has a slope."""


@kernel
def limited(y: Phasor, most: float) -> Phasor:
    """Limit the amplitude of a voltage to ``most`` (E-12)."""
    size = magnitude(y)
    return (most / size if size > most else 1.0) * y


# exact steps ----------------------------------------------------------------------------------------


class Circuit(NamedTuple):
    """A circuit and its current control over one step: Z, alpha, beta, gamma, fade, k, m, delta of the theory."""

    impedance: Phasor
    keep: Phasor
    gain: Phasor
    mean: Phasor
    fade: float
    lead: Phasor
    cross: Phasor
    slow: float


@kernel
def circuit(resistance: float, inductance: float, w: float, rate: float, h: float) -> Circuit:
    """Coefficients of a step of ``h`` [s] (E-7 to E-10).

    Args:
      w: [rad/s] angular velocity of the frame.
      rate: [rad/s] bandwidth of the current control.
    """
    Z = Phasor(resistance, w * inductance)
    damping = resistance * h / inductance
    decay = exp(-damping)
    keep = polar(decay, -w * h)
    mean = (keep - Phasor(1.0, 0.0)) / Phasor(-damping, -w * h)
    gain = (h / inductance) * mean
    fade = (1.0 - decay * decay) / (2.0 * damping)
    slow = exp(-rate * h)
    lead = Phasor(1.0 - slow, 0.0) / gain
    cross = (Phasor(slow, 0.0) - keep) / gain
    return Circuit(Z, keep, gain, mean, fade, lead, cross, slow)


class Driven(NamedTuple):
    """Result of a step: current and integral part at its end; mean current and its mean square; the voltage."""

    current: Phasor
    hold: Phasor
    mean: Phasor
    square: float
    voltage: Phasor


@kernel
def drive(c: Circuit, i: Phasor, hold: Phasor, wanted: Phasor, source: Phasor, most: float) -> Driven:
    """One step of current and current control (E-7 to E-12).

    Args:
      i: [A] current at the beginning.
      hold: [V] integral part, which represents the voltage of the source.
      wanted: [A] reference.
      source: [V] constant over the step.
      most: [V] largest amplitude of the converter's voltage.
    """
    inner = c.cross * i
    y = limited(c.lead * (wanted - i) + hold + inner, most)
    hold = c.slow * hold + (1.0 - c.slow) * (y - inner)  # with the limited voltage: anti-windup
    end = (y - source) / c.impedance
    off = i - end
    swing = c.mean * off
    square = real_product(end, end) + 2.0 * real_product(end, swing) + c.fade * real_product(off, off)
    # rounding may make the square of a vanishing current negative
    return Driven(c.keep * i + c.gain * (y - source), hold, end + swing, max(square, LEAST_SQUARE), y)


# limit of short steps -------------------------------------------------------------------------------


class Smooth(NamedTuple):
    """A circuit and its current control in the limit of short steps."""

    impedance: Phasor
    inductance: float
    rate: float
    lead: float
    cross: Phasor


@kernel
def smooth(resistance: float, inductance: float, w: float, rate: float) -> Smooth:
    """Coefficients in the limit of short steps (E-6); arguments of :func:`circuit`."""
    Z = Phasor(resistance, w * inductance)
    lead = rate * inductance
    return Smooth(Z, inductance, rate, lead, Phasor(resistance - lead, w * inductance))


class Rates(NamedTuple):
    """Rates of current [A/s] and integral part [V/s], and the voltage [V] of the converter."""

    current: Phasor
    hold: Phasor
    voltage: Phasor


@kernel
def drive_rates(c: Smooth, i: Phasor, hold: Phasor, wanted: Phasor, source: Phasor, most: float) -> Rates:
    """Rates in the limit of short steps (E-6, E-12); arguments of :func:`drive`."""
    inner = c.cross * i
    y = limited(c.lead * (wanted - i) + hold + inner, most)
    return Rates((1.0 / c.inductance) * (y - (source + c.impedance * i)), c.rate * (y - inner - hold), y)


@kernel
def steady_hold(resistance: float, inductance: float, w: float, rate: float, h: float, i: Phasor, y: Phasor) -> Phasor:
    """[V] Integral part in steady operation at the current ``i`` and the voltage ``y``.

    The other arguments are those of :func:`circuit`; ``h`` = 0 is the limit of short steps.
    """
    cross = smooth(resistance, inductance, w, rate).cross
    if h > 0.0:
        cross = circuit(resistance, inductance, w, rate, h).cross
    return y - cross * i
