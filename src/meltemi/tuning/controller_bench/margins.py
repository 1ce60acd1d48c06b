"""Margins of the speed loop and of the blade loops of any controller, measured in the closed loop.

A multisine d of small amplitude is added to the measured generator speed in steady wind, once with either sign. Half
the difference of the two runs is the response y to it alone, without the periodic motion of the rotor. The loop opened
at the sensor is L = -y / (y + d). It is independent of the kind of controller and contains torque and pitch,
actuators, filters and sampling.

Loops on the root moments of three blades are opened in multiblade coordinates, in the same way: tilt and yaw part are
one complex amplitude M, of which the blades have Re(M exp(i psi_b)) (docs/theory/control.md, C-32). Positive and
negative frequencies w of M are different tones W + w of the blades, so lines have one sign or the other, never both:
the response of a rotor that is not isotropic at the mirrored frequency is on no line.

Reference: docs/guide/controller-bench.md; Pintelon and Schoukens (2012), System Identification, chapter 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

PHASE_MARGIN, GAIN_MARGIN = math.radians(30.0), 2.0
"""[rad] phase margin and factor of the gain margin (6 dB) that loops must have."""
AMPLITUDE = 3e-4
"""Amplitude of a line at low frequency over the speed: small enough for the linear range, large against rounding."""
CORNER = 0.2
"""[Hz] frequency above which amplitudes fall, so that pitch rates stay small."""
LOWEST, HIGHEST, LINES = 0.02, 2.0, 40
"""[Hz] range of the lines, and about how many."""
REPEATABLE = 0.05
"""Largest difference of two successive periods over the response: beyond, the loop is not linear or not damped."""
STEP = 0.05
"""[s] interval between recorded samples."""


@dataclass(frozen=True)
class Multisine:
    """Test signal.

    Attributes:
      period: [s] period of the signal; two of them are evaluated.
      settling: [s] time before them, in which motions of a damping ratio of 0.01 at 1 rad/s decay to a seventh.
      sign: sign of the signal.
    """

    period: float = 100.0
    settling: float = 200.0
    sign: float = 1.0

    @property
    def duration(self) -> float:
        """[s] duration of a run."""
        return self.settling + 2.0 * self.period

    @cached_property
    def lines(self) -> Float:
        """(F,) frequencies [Hz], multiples of 1 / period, about evenly spaced in their logarithm."""
        return np.unique(np.maximum(np.round(np.geomspace(LOWEST, HIGHEST, LINES) * self.period), 1.0)) / self.period

    @cached_property
    def _waves(self) -> tuple[Float, Float, Float]:
        """Frequencies [rad/s], phases and amplitudes."""
        f = self.lines
        return 2.0 * math.pi * f, math.pi * np.arange(len(f)) ** 2 / len(f), AMPLITUDE / (1.0 + np.abs(f) / CORNER)

    def __call__(self, time: float) -> float:
        """Share of the speed at a time [s]."""
        w, phase, size = self._waves
        return self.sign * float(size @ np.cos(w * time + phase))


@dataclass(frozen=True)
class Whirl(Multisine):
    """Test signal of the blade loops: a complex amplitude, whose lines have either sign by turns."""

    @cached_property
    def lines(self) -> Float:
        """(F,) frequencies [Hz] in ascending order, twice as many as of the speed loop."""
        once = np.unique(np.maximum(np.round(np.geomspace(LOWEST, HIGHEST, 2 * LINES) * self.period), 1.0))
        return np.sort(once * np.where(np.arange(len(once)) % 2, -1.0, 1.0)) / self.period

    def amplitude(self, time: float) -> complex:
        """Amplitude of the moments at a time [s], over :func:`moment_scale`."""
        w, phase, size = self._waves
        return self.sign * complex(size @ np.exp(1j * (w * time + phase)))


@dataclass(frozen=True)
class OpenLoop:
    """Frequency response of an opened loop at a wind speed.

    Attributes:
      wind_speed: [m/s] wind speed.
      frequency: (F,) [rad/s] frequencies, ascending; of either sign for the complex amplitude of blade loops.
      response: (F,) L, opened at the sensors.
      repeatability: difference of two periods over the response.
    """

    wind_speed: float
    frequency: Float = field(repr=False)
    response: Complex = field(repr=False)
    repeatability: float

    @property
    def linear(self) -> bool:
        """Whether the response is that of a damped, linear loop, so that there are margins."""
        return bool(np.all(np.isfinite(self.response))) and self.repeatability < REPEATABLE

    @property
    def crossover(self) -> float:
        """[rad/s] highest frequency at which the gain is one; 0 if it is below one everywhere."""
        at, share = self._passings(np.abs(self.response) - 1.0)
        return (
            float(np.abs(self.frequency[at] + share * np.diff(self.frequency)[at]).max(initial=0.0))
            if self.linear
            else math.nan
        )

    @property
    def phase_margin(self) -> float:
        """[rad] smallest distance of the phase from half a turn where the gain is one; infinite without crossover."""
        return float(self._phases()[1].min(initial=math.inf)) if self.linear else math.nan

    @property
    def delay_margin(self) -> float:
        """[s] further delay that the loop tolerates."""
        w, late = self._phases(lags=True)
        return float((late / w).min(initial=math.inf)) if self.linear else math.nan

    @property
    def gain_margin(self) -> float:
        """Smallest factor, up or down, on the gain at which the loop oscillates; infinite if there is none."""
        at, share = self._passings(self.response.imag)
        real = self.response.real[at] + share * np.diff(self.response.real)[at]
        factors = np.abs(1.0 / real[real < 0.0])
        return float(np.maximum(factors, 1.0 / factors).min(initial=math.inf)) if self.linear else math.nan

    @property
    def sensitivity(self) -> float:
        """Largest value of 1 / |1 + L|, the amplification of disturbances by the loop."""
        return float((1.0 / np.abs(1.0 + self.response)).max()) if self.linear else math.nan

    def _phases(self, *, lags: bool = False) -> tuple[Float, Float]:
        """Frequencies [rad/s] where the gain is one, and distances of its phase from half a turn [rad], or lags."""
        at, share = self._passings(np.abs(self.response) - 1.0)
        phase = np.unwrap(np.angle(self.response))
        crossing = phase[at] + share * np.diff(phase)[at]
        w = self.frequency[at] + share * np.diff(self.frequency)[at]
        lag = np.mod(crossing + math.pi, 2.0 * math.pi)
        return w, lag if lags else np.minimum(lag, 2.0 * math.pi - lag)

    def _passings(self, x: Float) -> tuple[NDArray[np.int64], Float]:
        """Indices after which x changes its sign, and the shares of the steps at which it does.

        Between the signs of the frequency there is the pole of an integrator, and no passing.
        """
        at = np.flatnonzero((x[:-1] * x[1:] < 0.0) & (self.frequency[:-1] * self.frequency[1:] > 0.0))
        return at, x[at] / (x[at] - x[at + 1])


def speed_loop(wind_speed: float, signal: Multisine, up: Float, down: Float) -> OpenLoop:
    """The loop from the speeds of two runs.

    Args:
      wind_speed: [m/s] wind speed of both runs.
      signal: test signal of the first run.
      up, down: (T,) [rad/s] generator speed of the runs with either sign, from 0 on in steps of ``STEP``.
    """
    n = round(signal.period / STEP)
    y = 0.5 * (up - down) / (0.5 * (up + down)[-2 * n :].mean())
    return _opened(wind_speed, signal, y, np.array([signal(t) for t in _last(signal, len(up))]))


def blade_loop(wind_speed: float, signal: Whirl, up: Complex, down: Complex, *, delay: float = 0.0) -> OpenLoop:
    """The loop from the moments of two runs, by :func:`moment_amplitude`.

    Args:
      wind_speed: [m/s] wind speed of both runs.
      signal: test signal of the first run.
      up, down: (T,) amplitudes of the runs with either sign, from 0 on in steps of ``STEP``.
      delay: [s] delay of the loads at the controller: a time step.
    """
    d = np.array([signal.amplitude(t) for t in _last(signal, len(up))])
    return _opened(wind_speed, signal, 0.5 * (up - down), d, delay)


def moment_scale(turbine: Turbine) -> float:
    """[N m] unit of the test signal of blade loops: the rated torque of the rotor per blade."""
    return turbine.rated_power / turbine.rated_rotor_speed / turbine.n_blades


def moment_amplitude(moments: Sequence[Float], azimuth: Float, scale: float, delay: float = 0.0) -> Complex:
    """(T,) complex amplitude M of the blades' moments, tilt minus i yaw part (C-32), as the controller receives it.

    Args:
      moments: (T,) [N m] root moments of each blade.
      azimuth: (T,) [rad] azimuth of the first blade, in steps below half a turn.
      scale: [N m] unit of the moments.
      delay: [s] delay of the moments at the controller, at the azimuth of its call.
    """
    turned = np.unwrap(azimuth)
    late = turned + delay * np.gradient(turned, STEP)
    parts = [m * np.exp(-1j * (late + 2.0 * math.pi * b / len(moments))) for b, m in enumerate(moments)]
    amplitude: Complex = 2.0 / (len(moments) * scale) * np.sum(parts, axis=0)
    return amplitude


def _last(signal: Multisine, samples: int) -> Float:
    """[s] times of the samples of the last period of a run, without its end."""
    return np.asarray(STEP * np.arange(samples)[-round(signal.period / STEP) - 1 : -1], dtype=np.float64)


def _opened(
    wind_speed: float, signal: Multisine, y: Float | Complex, d: Float | Complex, delay: float = 0.0
) -> OpenLoop:
    """L from the response in a run and the test signal in its last period."""
    n = len(d)
    lines = np.round(signal.lines * signal.period).astype(int)
    late = np.exp(-2j * math.pi * signal.lines * delay)
    first, last = (late * np.fft.fft(x)[lines] for x in (y[-2 * n - 1 : -n - 1], y[-n - 1 : -1]))
    spread = float(np.linalg.norm(last - first)) / max(float(np.linalg.norm(last)), 1e-300)
    Y, D = 0.5 * (first + last), np.fft.fft(d)[lines]
    return OpenLoop(wind_speed, 2.0 * math.pi * signal.lines, -Y / (Y + D), spread)
