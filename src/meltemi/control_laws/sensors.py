"""Measurement noise and transport delay of sensors, as parts of controllers.

The sampling of a sensor is the ``sample_time`` of the controller, its bandwidth a ``low_pass`` of
``meltemi.control_laws.filters``. State and settings of a part are a table, ``Noise`` or ``Delay``.

Noise is white and normal, and a function of seed, stream and count alone: the bits are those of Philox 2x32-10
(Salmon et al. 2011), converted to a normal number after Box and Muller (1958). A run can be repeated, two sensors
with different streams never share a number, and no number depends on the order of calls.

Reference: docs/theory/control.md (C-20 and C-21).
"""

from __future__ import annotations

from math import cos, log, pi, sqrt

from meltemi.compiler import Numbers, Table, kernel, number, series, whole
from meltemi.core.errors import InputError


class Noise(Table):
    """Settings and state of white noise."""

    seed: float = number("-", "seed of the run, 0 to 2^32 - 1")
    stream: float = number("-", "number of the sensor, 0 to 2^32 - 1")
    count: float = number("-", "number of random numbers drawn")


class Delay(Table):
    """Settings and state of a transport delay."""

    samples: float = number("-", "delay in sample times")
    oldest: float = number("-", "index of the oldest value")
    value: Numbers = series("signal", "values of the last calls", "samples")


_MASK = 0xFFFFFFFF
_MULTIPLIER, _KEY_STEP, _ROUNDS = 0xD256D193, 0x9E3779B9, 10


@kernel
def philox(count: int, stream: int, seed: int) -> tuple[int, int]:
    """Two random 32-bit numbers of an address of two, under a key (Philox 2x32-10)."""
    left, right, key = count & _MASK, stream & _MASK, seed & _MASK
    for _ in range(_ROUNDS):
        # a product beyond 63 bits wraps around, which does not change the 64 bits in use
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
def noise(x: Noise, deviation: float) -> float:
    """Next sample of white noise, to be added to a signal.

    Args:
      x: settings and state, see ``noise_start``.
      deviation: standard deviation, in the unit of the signal.
    """
    count = whole(x.count)
    x.count = count + 1
    return deviation * normal(count, whole(x.stream), whole(x.seed))


def noise_start(seed: int, stream: int = 0) -> Noise:
    """Initial state of a noise.

    Args:
      seed: seed of a run, from 0 to 2^32 - 1.
      stream: stream of a sensor, from 0 to 2^32 - 1; sensors with one seed need different streams.

    Raises:
      InputError: one of them is out of range.
    """
    for name, value in (("seed", seed), ("stream", stream)):
        if value != int(value) or not 0 <= value <= _MASK:
            raise InputError(f"noise: {name} must be a whole number from 0 to {_MASK}, found {value!r}")
    return Noise.of(seed=seed, stream=stream)


@kernel
def delay(x: Delay, signal: float) -> float:
    """The signal of ``samples`` calls ago, exactly (C-21).

    Args:
      x: settings and state, see ``delay_start``; with 0 samples the signal is returned at once.
      signal: signal of any unit.
    """
    samples = whole(x.samples)
    if samples < 1:
        return signal
    oldest = min(max(whole(x.oldest), 0), samples - 1)
    output = x.value[oldest]
    x.value[oldest] = signal
    x.oldest = (oldest + 1) % samples
    return output


def delay_start(samples: int, signal: float = 0.0) -> Delay:
    """Steady state of a delay for a constant signal.

    Args:
      samples: number of sample times.
      signal: signal of any unit.

    Raises:
      InputError: ``samples`` is no whole number from 0 on.
    """
    if samples != int(samples) or samples < 0:
        raise InputError(f"delay: samples must be a whole number from 0 on, found {samples!r}")
    return Delay.of(value=[signal] * int(samples))
