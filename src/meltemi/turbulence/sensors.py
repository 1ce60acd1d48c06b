"""Sensors on a mast, and the mean wind that fits them.

Reference: docs/theory/wind.md (W-47 to W-49).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record, Samples, Vector
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

MOST_MISSING = 0.2
"""Share of the samples of a sensor that may be missing."""
STRONGEST = 300.0
"""[m/s] or [rad] of a sample."""


class Sensor(Record):
    """Series measured at one place of a mast.

    A sonic anemometer gives ``u`` and ``v``, a cup ``speed``, a vane ``direction``, a cup with a vane beside it both;
    ``w`` is optional. A missing sample is NaN.

    Raises:
      InputError: the sensor measures nothing, or both velocity and speed, the lists differ in length, the time does not
        increase, or more than a fifth of the samples is missing.
    """

    height: float = Field(gt=0.0, le=1000.0)
    """[m; 2 to 300] above ground."""
    across: float = Field(default=0.0, ge=-1e4, le=1e4)
    """[m; -500 to 500] from the vertical plane through the tower axis along the mean wind, to the left looking
    downwind."""
    time: Vector
    """(T,) [s] increasing; time 0 is the start of the simulation."""
    u: Samples | None = None
    """(T,) [m/s] along x of the inertial axes, including the mean."""
    v: Samples | None = None
    """(T,) [m/s] along y, to the left looking along x."""
    w: Samples | None = None
    """(T,) [m/s] upwards."""
    speed: Samples | None = None
    """(T,) [m/s; 1 to 80] horizontal speed."""
    direction: Samples | None = None
    """(T,) [rad] wind direction, clockwise seen from above, 0 along x."""
    noise: float = Field(default=0.0, ge=0.0, le=10.0)
    """[m/s; 0.01 to 1] standard deviation of the errors of the velocities, independent from sample to sample."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        n, series = len(self.time), self.series
        if n < 2 or np.any(np.diff(self.time) <= 0.0):
            raise ValueError("time needs at least 2 entries and must increase")
        if not series:
            raise ValueError("the sensor measures nothing: give u and v, speed, direction, or w")
        if ("u" in series) != ("v" in series):
            raise ValueError("u and v are given together; a speed without direction is speed")
        if "u" in series and series.keys() & {"speed", "direction"}:
            raise ValueError("u and v contain speed and direction: give only one of both")
        for name, x in series.items():
            if len(x) != n:
                raise ValueError(f"{name} must have {n} entries like time, found {len(x)}")
            if np.any(beyond := np.abs(x) > STRONGEST):
                raise ValueError(f"{name}: entry {int(beyond.argmax()) + 1} is beyond {STRONGEST:g}")
            if (missing := np.mean(np.isnan(x))) > MOST_MISSING:
                raise ValueError(
                    f"{100.0 * missing:.3g} % of {name} is missing, expected at most {100.0 * MOST_MISSING:g} %: "
                    f"shorten the series or leave {name} out"
                )
        return self

    @property
    def series(self) -> dict[str, Float]:
        """What it measures, by name."""
        names = ("u", "v", "w", "speed", "direction")
        return {name: x for name in names if (x := getattr(self, name)) is not None}


SPEED, DIRECTION = {"u", "speed"}, {"u", "direction"}
"""Series that contain the horizontal speed, and the wind direction."""


def horizontal(sensor: Sensor) -> Complex:
    """Velocity (T,) [m/s] as speed times exp(i direction) (W-47): a cup alone has direction 0, a vane alone speed 1."""
    if sensor.u is not None and sensor.v is not None:
        return sensor.u - 1j * sensor.v
    speed = 1.0 if sensor.speed is None else sensor.speed
    return speed * np.exp(1j * (np.zeros(len(sensor.time)) if sensor.direction is None else sensor.direction))


def components(sensor: Sensor, wind: TurbulentWind, mean: Float) -> dict[int, Float]:
    """Velocities (T,) [m/s] in the axes of the field, by number of the component (W-47).

    Args:
      sensor: sensor.
      wind: its direction is that of the axes.
      mean: (3,) [m/s] mean wind at the sensor in these axes: a cup alone gives u, a vane alone v, to the first order of
        the fluctuations.
    """
    velocity, speed = horizontal(sensor) * cmath.exp(-1j * wind.direction), math.hypot(mean[0], mean[1])
    measured, result = sensor.series.keys(), {}
    if measured & SPEED and measured & DIRECTION:
        result = {0: velocity.real, 1: -velocity.imag}
    elif sensor.speed is not None:
        result = {0: sensor.speed + mean[0] - speed}
    elif sensor.direction is not None:
        result = {1: -speed * velocity.imag}
    return result if sensor.w is None else {**result, 2: sensor.w}


def measured_wind(
    sensors: Sequence[Sensor],
    hub_height: float,
    *,
    shear_exponent: float | None = None,
    veer: float | None = None,
    **options: Any,
) -> TurbulentWind:
    """The turbulent wind whose mean and intensity fit sensors.

    Speed and shear exponent fit the logarithms of the mean speeds over that of the height, direction and veer the mean
    directions over the height, by least squares (W-48, W-49). The mean of a velocity is that of its vector; that of a
    cup alone is the scalar mean, which is larger by half the lateral variance over the speed. The intensity is
    that of the mean variance of the longitudinal component, less that of the noise.

    Args:
      sensors: at least one measures the speed; time and place do not matter but for the height.
      hub_height: [m] where mean speed, direction and intensity hold.
      shear_exponent: [-] of the power law; by default fitted to speeds at two heights or more, 0.2 for one.
      veer: [rad/m]; by default fitted to directions at two heights or more, 0 for one.
      options: further fields of :class:`TurbulentWind`, such as ``spectrum``, ``coherent`` or ``seed``; a ``direction``
        [rad] holds if no sensor measures it.

    Raises:
      InputError: no sensor measures the speed, or a mean is out of the range of :class:`TurbulentWind`.
    """
    means = [(sensor, complex(np.nanmean(horizontal(sensor)))) for sensor in sensors]
    speeds = [(sensor.height, abs(mean)) for sensor, mean in means if sensor.series.keys() & SPEED]
    directions = [(sensor.height, cmath.phase(mean)) for sensor, mean in means if sensor.series.keys() & DIRECTION]
    if not speeds or min(speed for _, speed in speeds) <= 0.0:
        raise InputError("sensors: the mean wind needs a mean speed above 0: give u and v, or speed, of a sensor")
    z, speed = np.array(speeds).T
    default = TurbulentWind.model_fields["shear_exponent"].default
    level, exponent = _line(np.log(z / hub_height), np.log(speed), shear_exponent, default)
    turn = veer or 0.0
    if directions:
        z, angle = np.array(directions).T
        from_first, turn = _line(z - hub_height, np.angle(np.exp(1j * (angle - angle[0]))), veer, 0.0)
        options["direction"] = cmath.phase(cmath.exp(1j * (angle[0] + from_first)))
    wind = TurbulentWind(speed=math.exp(level), intensity=0.0, shear_exponent=exponent, veer=turn, **options)
    at = np.array([wind.speed, 0.0, 0.0])
    along = [(u, sensor.noise) for sensor in sensors if (u := components(sensor, wind, at).get(0)) is not None]
    variance = np.mean([max(float(np.nanvar(u)) - noise**2, 0.0) for u, noise in along])
    return wind.replace(intensity=math.sqrt(variance) / wind.speed)


def _line(x: Float, y: Float, slope: float | None, default: float) -> tuple[float, float]:
    """Intercept and slope of the line that fits points (n,); the slope is given or, for one abscissa, the default."""
    if slope is None:
        slope = float(np.cov(x, y, bias=True)[0, 1] / np.var(x)) if np.ptp(x) > 0.0 else default
    return float(np.mean(y - slope * x)), slope
