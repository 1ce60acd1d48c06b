"""Measurements of a nacelle lidar: a sensor for controllers, and a preview.

The line-of-sight speed of a beam with the unit vector n, upwind, focused at F, is the wind along it, weighted over the
probe volume: v = -int W(r - F) n . u(p + r n) dr, positive towards the lidar. W is Gaussian for pulsed lidars, with the
full width at half maximum of the pulse, and for continuous-wave ones 1 / (pi z_R (1 + (s / z_R)^2)) with the Rayleigh
length z_R = lambda F^2 / (pi a^2).

Reference: docs/theory/control.md (C-97 to C-100).
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.compiler import Vec, kernel
from meltemi.control_laws.lidar import LidarSensor
from meltemi.control_laws.load_control import Preview
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.studies.preview import FREQUENCY, SPACING, pitch_lead, steady_pitch
from meltemi.turbine.definition import Turbine
from meltemi.wind.fields import Wind, mean_speed, wind_field
from meltemi.wind.velocity import WindField, series_now, wind_velocity

Float = NDArray[np.float64]
POINTS = {"pulsed": 9, "continuous": 256}
"""Points of a probe volume."""


class Lidar(Record):
    """A nacelle lidar that measures upwind."""

    kind: Literal["pulsed", "continuous"] = "pulsed"
    """Pulsed, with the same probe length at all ranges; or continuous-wave, focused at each range."""
    beams: tuple[tuple[float, float], ...] = ((0.26, 0.0), (0.0, 0.26), (-0.26, 0.0), (0.0, -0.26))
    """Azimuth and elevation [rad] of each beam from the upwind direction of the level shaft: positive to the left
    looking downwind, and up."""
    ranges: tuple[float, ...] = (50.0, 80.0, 110.0, 140.0, 170.0, 200.0)
    """[m] distances along each beam from the lidar."""
    sample_time: float = Field(default=1.0, gt=0.0)
    """[s] duration of a scan of all beams."""
    probe_length: float = Field(default=30.0, ge=0.0)
    """[m] full width at half maximum of the probe volume, pulsed."""
    wavelength: float = Field(default=1.55e-6, gt=0.0)
    """[m] wavelength, continuous-wave."""
    aperture: float = Field(default=0.028, gt=0.0)
    """[m] radius of the beam at the lens, continuous-wave."""
    position: tuple[float, float, float] = (5.0, 0.0, 3.0)
    """[m] position from the rotor apex: downwind, to the left looking downwind, up."""
    blade_width: float = Field(default=0.0, ge=0.0)
    """[m] width of blades that block beams where these cross the rotor plane; 0 for none, as on a spinner."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.beams or not self.ranges or min(self.ranges) <= 0.0:
            raise ValueError("a lidar needs a beam and a range or more, and ranges above 0")
        if any(math.hypot(*beam) >= 1.5 for beam in self.beams):
            raise ValueError("beams must look upwind, within 1.5 rad")
        return self

    def directions(self) -> Float:
        """(B, 3) unit vectors of the beams, inertial axes."""
        a, e = np.array(self.beams).T
        unit: Float = np.stack([-np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)
        return unit

    def probe(self, focus: float) -> tuple[Float, Float]:
        """Distances [m] along a beam and weights of a range (C-98)."""
        if self.kind == "pulsed":
            x, w = np.polynomial.hermite_e.hermegauss(POINTS["pulsed"])
            return focus + self.probe_length / math.sqrt(8.0 * math.log(2.0)) * x, w / w.sum()
        rayleigh = self.wavelength * focus**2 / (math.pi * self.aperture**2)
        n = POINTS["continuous"]
        angle = math.pi * ((np.arange(n) + 0.5) / n - 0.5)
        at = focus + rayleigh * np.tan(angle)
        weight = np.where(at > 0.0, 1.0, 0.0)
        return at, weight / weight.sum()


@kernel
def line_of_sight(t: float, start: Vec, n: Vec, at: Float, weight: Float, m: WindField) -> float:
    """Line-of-sight speed [m/s] of a beam from ``start`` at time ``t`` (C-97)."""
    speed = 0.0
    for k in range(len(at)):
        r = at[k]
        u = wind_velocity(Vec(start.x + r * n.x, start.y + r * n.y, max(start.z + r * n.z, 0.0)), t, m)
        speed -= weight[k] * (u.x * n.x + u.y * n.y + u.z * n.z)
    return speed


def line_of_sight_speeds(turbine: Turbine, wind: Wind, lidar: Lidar, duration: float) -> Float:
    """(scans, B, ranges) [m/s] line-of-sight speeds of a run (C-97); see :func:`measure_lidar`."""
    if not duration > 0.0:
        raise InputError(f"measure_lidar: duration must be positive, found {duration!r}")
    field, n = wind_field(wind, turbine.hub_height, turbine.rotor_diameter), lidar.directions()
    apex = np.array([-turbine.nacelle.overhang * math.cos(turbine.nacelle.tilt), 0.0, turbine.hub_height])
    start = Vec(*(float(c) for c in apex + lidar.position))
    probes = [lidar.probe(focus) for focus in lidar.ranges]
    scans = math.ceil(duration / lidar.sample_time) + 1
    beams = [Vec(*(float(c) for c in row)) for row in n]
    speed = np.empty((scans, len(n), len(probes)))
    for k in range(scans):
        for i, beam in enumerate(beams):
            t = (k + i / len(n)) * lidar.sample_time
            series_now(t, field)
            speed[k, i] = [line_of_sight(t, start, beam, at, weight, field) for at, weight in probes]
    return speed


def measure_lidar(turbine: Turbine, wind: Wind, lidar: Lidar, duration: float) -> LidarSensor:
    """Lidar sensor of a run, for the state of a controller.

    Args:
      turbine: turbine with a fixed nacelle and the shaft along the inertial x axis.
      wind: wind of the run.
      lidar: settings of the lidar.
      duration: [s] duration of the run.

    Raises:
      InputError: the duration is not positive.
    """
    speed, n = line_of_sight_speeds(turbine, wind, lidar, duration), lidar.directions()
    # crossing of a beam with the rotor plane, looking downwind: azimuth zero is up, clockwise
    across = np.array(lidar.position) + (lidar.position[0] / -n[:, :1]) * n
    radius = np.maximum(np.hypot(across[:, 1], across[:, 2]), 1e-3)
    blocked = np.arcsin(np.minimum(0.5 * lidar.blade_width / radius, 1.0)) if lidar.position[0] > 0.0 else 0.0 * radius
    return LidarSensor.of(
        ranges=len(lidar.ranges),
        sample_time=lidar.sample_time,
        speed=speed.ravel(),
        line_of_sight=speed[0].ravel(),
        share=-n[:, 0],
        shadow=np.arctan2(-across[:, 1], across[:, 2]),
        half_width=blocked,
        scan=np.zeros(len(n)),
        seen=np.ones(len(n)),
    )


def lidar_preview(
    model: BladedModel,
    wind: Wind,
    lidar: Lidar,
    duration: float,
    table: tuple[float, Float] | None = None,
    *,
    frequency: float = FREQUENCY,
) -> Preview:
    """Preview from the measurements of a lidar instead of the wind itself, see ``preview_of``; blades block no beam.

    A range is used if the travel time of the wind from there to the rotor exceeds the lead time plus a scan.

    Args:
      model: turbine model.
      wind: wind of the run.
      lidar: settings of the lidar.
      duration: [s] duration of the run.
      table: pitch table from ``steady_pitch``, for several winds of one model.
      frequency: [rad/s] corner frequency of the low-pass filter.

    Raises:
      InputError: all ranges are too short.
    """
    turbine = model.turbine
    mean, lead = mean_speed(wind, turbine.hub_height), pitch_lead(model, frequency)
    share = -lidar.directions()[:, 0]
    speed = line_of_sight_speeds(turbine, wind, lidar, duration) / share[:, None]
    ahead = (np.outer(share, lidar.ranges) - lidar.position[0]) / mean
    use = [g for g in range(len(lidar.ranges)) if ahead[:, g].min() >= lead + lidar.sample_time]
    if not use:
        raise InputError(
            f"lidar: the farthest range is {ahead.max():.1f} s ahead, but the preview needs "
            f"{lead + lidar.sample_time:.1f} s"
        )
    dt = lidar.sample_time
    times = dt * np.arange(math.ceil(duration / dt) + math.ceil(lead / dt) + 2)
    each = [
        np.interp(times, dt * (np.arange(len(speed)) + i / len(share)) + ahead[i, g], speed[:, i, g])
        for i in range(len(share))
        for g in use
    ]
    first, pitch = table or steady_pitch(model)
    return Preview(
        wind=np.mean(each, axis=0),
        time_step=dt,
        lead=lead,
        frequency=frequency,
        first_speed=first,
        spacing=SPACING,
        pitch=pitch,
    )
