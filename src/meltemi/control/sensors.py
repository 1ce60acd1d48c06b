"""What real sensors do to a signal: noise and transport delay, as parts for controllers.

The sampling of a sensor is the ``sample_time`` of the controller, its bandwidth a ``low_pass`` of
``meltemi.control.filters``. State and settings of a part lie in a vector from the place ``at`` on.

Noise is white and normal, and a function of seed, stream and count alone: the bits are those of Philox 2x32-10
(Salmon et al. 2011), turned into a normal number after Box and Muller (1958). A run can be repeated, two sensors
with different streams never share a number, and no number depends on the order of calls.

Reference: docs/theory/control.md (C-20 and C-21).
"""

from __future__ import annotations

from math import cos, log, pi, sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole

Float = NDArray[float64]

NOISE_STATES = 3
"""Seed, stream and count of a noise part."""

_MASK = 0xFFFFFFFF
_MULTIPLIER, _KEY_STEP, _ROUNDS = 0xD256D193, 0x9E3779B9, 10


@kernel
def philox(count: int, stream: int, seed: int) -> tuple[int, int]:
    """Two random 32-bit numbers of an address of two, under a key (Philox 2x32-10)."""
    left, right, key = count & _MASK, stream & _MASK, seed & _MASK
    for _ in range(_ROUNDS):
        # a product beyond 63 bits wraps, which leaves the 64 bits that are used as they are
        product = left * _MULTIPLIER
        left, right = ((product >> 32) & _MASK) ^ key ^ right, product & _MASK
        key = (key + _KEY_STEP) & _MASK
    return left, right


@kernel
def normal(count: int, stream: int, seed: int) -> float:
    """Normal number of mean 0 and standard deviation 1 at an address (C-20)."""
    a, b = philox(count, stream, seed)
    return sqrt(-2.0 * log((a + 0.5) / 4294967296.0)) * cos(2.0 * pi * (b + 0.5) / 4294967296.0)


@kernel
def noise(x: Float, at: int, deviation: float) -> float:
    """The next number of a white noise; add it to a signal.

    Args:
      x: vector that holds seed, stream and count from the place ``at`` on, see ``noise_start``.
      deviation: standard deviation, in the unit of the signal.
    """
    count = whole(x[at + 2])
    x[at + 2] = count + 1
    return deviation * normal(count, whole(x[at + 1]), whole(x[at]))


def noise_start(x: Float, at: int, seed: int, stream: int = 0) -> None:
    """Set a noise part to its first number.

    Args:
      seed: of a run, from 0 to 2^32 - 1.
      stream: of a sensor, from 0 to 2^32 - 1; sensors of one seed need different ones.

    Raises:
      InputError: one of them is out of range.
    """
    for name, value in (("seed", seed), ("stream", stream)):
        if value != int(value) or not 0 <= value <= _MASK:
            raise InputError(f"noise: {name} must be a whole number from 0 to {_MASK}, found {value!r}")
    x[at], x[at + 1], x[at + 2] = seed, stream, 0.0


def delay_states(samples: int) -> int:
    """How many places of a vector a delay takes.

    Raises:
      InputError: ``samples`` is no whole number from 0 on.
    """
    if samples != int(samples) or samples < 0:
        raise InputError(f"delay: samples must be a whole number from 0 on, found {samples!r}")
    return 1 + samples


@kernel
def delay(x: Float, at: int, signal: float, samples: int) -> float:
    """The signal of ``samples`` calls ago, exactly (C-21).

    Args:
      x: vector that holds, from the place ``at`` on, which value is the oldest, then the values.
      signal: of any unit.
      samples: number of sample times; with 0 the signal comes back at once.
    """
    if samples < 1:
        return signal
    oldest = min(max(whole(x[at]), 0), samples - 1)
    output = x[at + 1 + oldest]
    x[at + 1 + oldest] = signal
    x[at] = (oldest + 1) % samples
    return output


@kernel
def delay_start(x: Float, at: int, signal: float, samples: int) -> None:
    """State of a delay that has had a constant signal for long."""
    x[at] = 0.0
    for i in range(samples):
        x[at + 1 + i] = signal
