"""Seas given by their wave components or by an elevation series, as from another program or a buoy."""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Vector
from meltemi.sea.airy import GRAVITY, WaveComponents
from meltemi.sea.conditions import Sea, along


class ComponentSea(Sea):
    """Sea as a sum of given waves."""

    kind: Literal["components"] = "components"
    frequency: Vector
    """(M,) [rad/s] frequencies above zero."""
    amplitude: Vector
    """(M,) [m] amplitudes."""
    phase: Vector
    """(M,) [rad] phases at the origin at time 0: 0 is a crest."""
    direction: Vector | float = 0.0
    """(M,) [rad] directions of travel, clockwise from above as that of the wind; or one for all."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(self.frequency)
        if n == 0 or np.any(self.frequency <= 0.0):
            raise ValueError("frequency: expected at least one, all above 0")
        for name in ("amplitude", "phase", "direction"):
            value = np.asarray(getattr(self, name))
            if value.ndim and len(value) != n:
                raise ValueError(f"{name} must have {n} entries like frequency, found {len(value)}")
        return self

    @property
    def label(self) -> str:
        return f"sea of {len(self.frequency)} given waves"

    def components(self, depth: float, duration: float, gravity: float = GRAVITY) -> WaveComponents:
        direction = np.broadcast_to(along(np.asarray(self.direction)), self.frequency.shape)
        amplitude = self.amplitude * np.exp(1j * self.phase)
        return WaveComponents(np.asarray(self.frequency), amplitude, np.asarray(direction), _common(self.frequency))


def _common(frequency: Vector) -> float | None:
    """Period [s] of a sum of waves whose frequencies are multiples of one step; None if they are not."""
    if len(frequency) == 1:
        return 2.0 * math.pi / float(frequency[0])
    steps = np.diff(np.sort(frequency))
    number = frequency / steps[steps > 0.0].min() if np.any(steps > 0.0) else frequency / frequency[0]
    # the step from rounded frequencies: the mean over all multiples
    step = float((frequency * np.round(number)).sum() / max((np.round(number) ** 2).sum(), 1e-300))
    if np.abs(frequency / step - np.round(frequency / step)).max() > 1e-3:
        return None
    return 2.0 * math.pi / step


class ElevationSea(Sea):
    """Waves along one direction with a given elevation at the origin."""

    kind: Literal["elevation"] = "elevation"
    elevation: Vector
    """(N,) [m] elevation at constant time steps from time 0 on; it repeats after the last."""
    time_step: float = Field(gt=0.0, le=5.0)
    """[s] time step of the elevation."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] direction of travel, clockwise from above as that of the wind."""

    @property
    def label(self) -> str:
        return f"sea of a given elevation, {self.time_step * len(self.elevation):g} s"

    def components(self, depth: float, duration: float, gravity: float = GRAVITY) -> WaveComponents:
        period = self.time_step * len(self.elevation)
        if period < duration:
            raise InputError(f"sea.elevation: the series of {period:g} s is shorter than the run of {duration:g} s")
        amplitude = np.fft.rfft(self.elevation)[1:] * (2.0 / len(self.elevation))
        if len(self.elevation) % 2 == 0:
            amplitude = amplitude[:-1]
        frequency = 2.0 * math.pi / period * np.arange(1, len(amplitude) + 1)
        kept = np.abs(amplitude) > 1e-9 * max(np.abs(amplitude).max(initial=0.0), 1e-12)
        direction = np.full(int(kept.sum()), along(self.direction))
        return WaveComponents(frequency[kept], amplitude[kept], direction, period)
