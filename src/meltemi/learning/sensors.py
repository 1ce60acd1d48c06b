"""Sensors of the learning environments, with ranges from the limits of the turbine."""

from __future__ import annotations

import math
from typing import NamedTuple

from meltemi.control.signals import Measurements
from meltemi.learning.kernels import AgentState
from meltemi.turbine.power_turbine import AnyTurbine


class Sensor(NamedTuple):
    """Signal of a sensor, and the values that correspond to -1 and 1 in an observation.

    Attributes:
      derived: whether the controller computes the signal from measurements; otherwise it is a measurement.
      row: row of ``Measurements`` or ``AgentState``.
      low, high: limits in SI units.
    """

    derived: bool
    row: int
    low: float
    high: float


HIGHEST_PITCH = 0.6
"""[rad] largest pitch angle of the range: what production needs."""
ACCELERATION, VELOCITY = 2.0, 1.0
"""[m/s^2], [m/s] ranges of the tower top's motion."""
TOWER_SHARE, BLADE_SHARE = 0.35, 0.7
"""Ranges that count as one in the load component, over the moments of the mean thrust at rated wind speed; near the
equivalent loads of the NREL 5 MW in class B turbulence."""


def thrust_moments(turbine: AnyTurbine) -> tuple[float, float]:
    """Moments [N m] of the mean thrust at rated power, by momentum theory, at the tower base and at a blade root."""
    radius, density = turbine.rotor_radius, 1.225
    area = math.pi * radius**2
    speed = (turbine.rated_power / (0.5 * density * area * 0.45)) ** (1.0 / 3.0)
    thrust = 0.5 * density * area * speed**2 * 0.75
    return thrust * turbine.hub_height, thrust / turbine.n_blades * 2.0 / 3.0 * radius


def load_scale(turbine: AnyTurbine, channel: str) -> float:
    """Reference range [N m] of a load."""
    tower, blade = thrust_moments(turbine)
    return BLADE_SHARE * blade if channel.startswith(("root", "station", "node")) else TOWER_SHARE * tower


def sensors_of(turbine: AnyTurbine) -> dict[str, Sensor]:
    """The sensors of a turbine by name."""
    control, rated = turbine.control, turbine.rated_power
    speed = 1.5 * control.pitch.reference_speed
    low, high = control.pitch.minimum, min(control.pitch.maximum, HIGHEST_PITCH)
    moment, rate = 2.0 * thrust_moments(turbine)[1], 2.0 * (turbine.yaw.rate if turbine.yaw else 0.0) or 0.01
    measured: dict[str, tuple[float, float]] = {
        "generator_speed": (0.0, speed),
        "rotor_speed": (0.0, 1.5 * turbine.rated_rotor_speed),
        "torque": (0.0, control.torque.maximum_torque),
        "power": (0.0, 1.2 * rated),
        **{f"pitch_{b + 1}": (low, high) for b in range(turbine.n_blades)},
        **{f"out_of_plane_moment_{b + 1}": (-moment, moment) for b in range(turbine.n_blades)},
        **{f"in_plane_moment_{b + 1}": (-moment, moment) for b in range(turbine.n_blades)},
        "yaw": (-math.pi, math.pi),
        "yaw_rate": (-rate, rate),
        "wind_speed": (0.0, 30.0),
        "fore_aft_acceleration": (-ACCELERATION, ACCELERATION),
        "side_side_acceleration": (-ACCELERATION, ACCELERATION),
        "power_reference": (0.0, 1.2 * rated),
    }
    derived: dict[str, tuple[float, float]] = {
        "azimuth_sine": (-1.0, 1.0),
        "azimuth_cosine": (-1.0, 1.0),
        "tilt_moment": (-moment, moment),
        "yaw_moment": (-moment, moment),
        "fore_aft_velocity": (-VELOCITY, VELOCITY),
        "side_side_velocity": (-VELOCITY, VELOCITY),
        "yaw_error": (-1.0, 1.0),
        "power_error": (-rated, rated),
    }
    sensors = {name: Sensor(False, Measurements.index(name), *ends) for name, ends in measured.items()}
    return sensors | {name: Sensor(True, AgentState.index(name), *ends) for name, ends in derived.items()}
