"""Currents through an inductor under a controlled voltage, in a turning frame: exact steps.

Both sides of the converter are the same circuit in their dq axes, which turn with the angular frequency w:

    L di/dt = y - s - (R + j w L) i          i = i_d + j i_q

with the voltage s of the source (electromotive force, grid) and y, which the converter holds over a step. The
current control has an internal model of the circuit, and active damping: current follows its reference like
1 / (1 + s/rate), and disturbances decay as fast, at every length of the step.

Reference: docs/theory/electrical.md (E-6 to E-12); Harnefors & Nee (1998), IEEE Trans. Ind. Appl. 34(1):133.
"""

from __future__ import annotations

from math import cos, exp, sin, sqrt
from typing import NamedTuple

from meltemi.core.kernel import kernel


class Phasor(NamedTuple):
    """d + j q."""

    d: float
    q: float


@kernel
def plus(a: Phasor, b: Phasor) -> Phasor:
    """a + b."""
    return Phasor(a.d + b.d, a.q + b.q)


@kernel
def minus(a: Phasor, b: Phasor) -> Phasor:
    """a - b."""
    return Phasor(a.d - b.d, a.q - b.q)


@kernel
def scaled(s: float, a: Phasor) -> Phasor:
    """s a."""
    return Phasor(s * a.d, s * a.q)


@kernel
def times(a: Phasor, b: Phasor) -> Phasor:
    """a b."""
    return Phasor(a.d * b.d - a.q * b.q, a.d * b.q + a.q * b.d)


@kernel
def over(a: Phasor, b: Phasor) -> Phasor:
    """a / b."""
    square = b.d * b.d + b.q * b.q
    return Phasor((a.d * b.d + a.q * b.q) / square, (a.q * b.d - a.d * b.q) / square)


@kernel
def along(a: Phasor, b: Phasor) -> float:
    """Real part of a times the conjugate of b: of voltage and current, 2/3 of the active power."""
    return a.d * b.d + a.q * b.q


@kernel
def ahead(a: Phasor, b: Phasor) -> float:
    """Imaginary part of the same: 2/3 of the reactive power."""
    return a.q * b.d - a.d * b.q


class Circuit(NamedTuple):
    """A circuit and its current control over one step."""

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
      w: [rad/s] of the frame.
      rate: [rad/s] bandwidth of the current control.
    """
    Z = Phasor(resistance, w * inductance)
    damping = resistance * h / inductance
    a = Phasor(-damping, -w * h)
    decay = exp(-damping)
    keep = Phasor(decay * cos(w * h), -decay * sin(w * h))
    mean = over(Phasor(keep.d - 1.0, keep.q), a)
    gain = scaled(h / inductance, mean)
    fade = (1.0 - decay * decay) / (2.0 * damping)
    slow = exp(-rate * h)
    lead = over(Phasor(1.0 - slow, 0.0 * w), gain)
    cross = over(Phasor(slow - keep.d, -keep.q), gain)
    return Circuit(Z, keep, gain, mean, fade, lead, cross, slow)


@kernel
def smooth(resistance: float, inductance: float, w: float, rate: float) -> tuple[float, Phasor]:
    """``lead`` and ``cross`` in the limit of short steps (E-6)."""
    return rate * inductance, Phasor(resistance - rate * inductance, w * inductance)


@kernel
def limited(y: Phasor, most: float) -> Phasor:
    """A voltage with at most the amplitude ``most``."""
    size = sqrt(along(y, y))
    return scaled(most / size if size > most else 1.0, y)


LEAST_SQUARE = 1e-12
"""[A^2] that a mean square is at least, so that its root has a slope."""


class Driven(NamedTuple):
    """What a step leaves: current and integral part at its end; mean current and its mean square; the voltage."""

    current: Phasor
    hold: Phasor
    mean: Phasor
    square: float
    voltage: Phasor


@kernel
def drive(c: Circuit, i: Phasor, hold: Phasor, wanted: Phasor, source: Phasor, most: float) -> Driven:
    """One step of current and current control (E-7 to E-12).

    Args:
      i: [A] current at the begin.
      hold: [V] integral part, which stands for the source's voltage.
      wanted: [A] reference.
      source: [V] held.
      most: [V] amplitude that the converter can make.
    """
    inner = times(c.cross, i)
    y = limited(plus(plus(times(c.lead, minus(wanted, i)), hold), inner), most)
    # what the voltage was, not what it should have been: the integral part does not run away at the limit
    hold = plus(scaled(c.slow, hold), scaled(1.0 - c.slow, minus(y, inner)))
    push = minus(y, source)
    new = plus(times(c.keep, i), times(c.gain, push))
    end = over(push, c.impedance)
    off = minus(i, end)
    swing = times(c.mean, off)
    square = along(end, end) + 2.0 * along(end, swing) + c.fade * along(off, off)
    # where the current is next to nothing, rounding may leave less
    return Driven(new, hold, plus(end, swing), max(square, LEAST_SQUARE), y)
