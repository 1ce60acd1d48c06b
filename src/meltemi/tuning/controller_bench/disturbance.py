"""Noise, delay and test signals between a controller and the turbine, for a controller of any kind."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import interpreted, is_compiled
from meltemi.control.controller import Controller, compiled_entry
from meltemi.control.signals import Demands, Measurements
from meltemi.tuning.controller_bench.suite import NOISE, RELATIVE

Float = NDArray[np.float64]
Signal = Callable[[float], float]
Amplitude = Callable[[float], complex]


def disturbed(
    controller: Controller,
    *,
    noise: float = 0.0,
    delay: float = 0.0,
    probe: Signal | None = None,
    whirl: Amplitude | None = None,
    seed: int = 1,
) -> Controller:
    """A controller behind imperfect sensors and lines.

    Args:
      controller: controller of any kind; its sample instants stay the same.
      noise: factor on the standard deviations ``NOISE`` of white noise on the sensors, new at each call.
      delay: [s] delay of the pitch demands, rounded to sample times.
      probe: relative addition to the measured generator and rotor speed at a time [s].
      whirl: complex amplitude [N m] at a time [s] of which the real part in the direction of each of three blades is
        added to its measured out-of-plane moment.
      seed: seed of the noise.
    """

    def fresh() -> Controller:
        inner = controller.fresh() if controller.fresh is not None else controller
        call, rng = _callable(inner), np.random.default_rng(seed)
        waiting: deque[Float] = deque()
        commanded = np.empty(0)
        pitch = [Demands.index(f"pitch_{b + 1}") for b in range(3)]
        scales = _scales() * noise

        def update(state: Float, measurements: Any, demands: Any, dt: float) -> None:
            nonlocal commanded
            sensed = measurements.array.copy()
            if probe is not None:
                sensed[_SPEEDS] *= 1.0 + probe(float(measurements.time))
            if whirl is not None:
                sensed[_MOMENTS] += (whirl(float(measurements.time)) * np.exp(1j * (sensed[_AZIMUTH] + _BLADES))).real
            if noise:
                size = np.where(_SHARES, np.abs(sensed), 1.0)
                sensed += scales * size * rng.standard_normal(len(sensed))
            if not len(commanded):
                commanded = demands.array.copy()
                waiting.extend(commanded[pitch].copy() for _ in range(round(delay / dt)))
            call(state, sensed, commanded, dt)
            late = commanded.copy()
            if waiting:
                waiting.append(commanded[pitch].copy())
                late[pitch] = waiting.popleft()
            demands.array[:] = late

        return replace(inner, update=update, fresh=None)

    words = f"{controller.name}, noise {noise:g}, delay {delay:g} s, seed {seed}"
    return Controller(
        update=_unbound, name=words, sample_time=controller.sample_time, yaws=controller.yaws, fresh=fresh
    )


def _unbound(*_: Any) -> None:
    raise AssertionError("each run has a copy by fresh()")


_SPEEDS = [Measurements.index("generator_speed"), Measurements.index("rotor_speed")]
_AZIMUTH = Measurements.index("azimuth")
_MOMENTS = [Measurements.index(f"out_of_plane_moment_{b + 1}") for b in range(3)]
_BLADES = 2.0 * np.pi / 3.0 * np.arange(3)
_SHARES = np.array([name.rstrip("_0123456789") in RELATIVE for name in Measurements.names])


def _scales() -> Float:
    return np.array([NOISE.get(name.rstrip("_0123456789"), 0.0) for name in Measurements.names])


def _callable(controller: Controller) -> Callable[[Float, Float, Float, float], None]:
    """The update of a controller on vectors, compiled or not."""
    update: Any = controller.update
    if is_compiled(update) and not interpreted():
        compiled: Callable[[Float, Float, Float, float], None] = compiled_entry(update)
        return compiled
    return lambda state, sensed, commanded, dt: update(state, Measurements(sensed), Demands(commanded), dt)
