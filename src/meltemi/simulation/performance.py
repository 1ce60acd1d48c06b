"""Steady performance of the rotor: power, thrust and torque coefficients against tip-speed ratio and pitch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meltemi.control.actuators import ANGLE
from meltemi.core.errors import InputError
from meltemi.simulation.case import Case
from meltemi.simulation.model import build
from meltemi.simulation.options import ModelOptions
from meltemi.structure.kinematics import GENERATOR
from meltemi.turbine.definition import Turbine
from meltemi.turbine.performance import Performance
from meltemi.wind.fields import SteadyWind

RIGID = ("tower", "yaw", "generator", "drivetrain", "blades")


def rotor_performance(
    turbine: Turbine,
    tip_speed_ratio: Sequence[float],
    pitch: Sequence[float],
    *,
    options: ModelOptions | None = None,
    wind_speed: float = 8.0,
    straight: bool = True,
    azimuths: int = 12,
) -> Performance:
    """Coefficients of the rigid rotor.

    Args:
      tip_speed_ratio: values above zero.
      pitch: [rad].
      options: aerodynamic models; steady ones are used whatever is asked for in time.
      wind_speed: [m/s]; the coefficients do not depend on it.
      straight: without tilt, cone and tower; otherwise the rotor as built.
      azimuths: positions over one sector between blades, for the rotor as built.

    Raises:
      InputError: a tip-speed ratio is not above zero.
    """
    ratios, pitches = np.atleast_1d(np.asarray(tip_speed_ratio, float)), np.atleast_1d(np.asarray(pitch, float))
    if np.any(ratios <= 0.0):
        raise InputError("rotor_performance: tip-speed ratios must be above zero")
    chosen = (options or ModelOptions()).replace(
        locked=RIGID, inflow="quasi_steady", stall="static", flap_modes=0, edge_modes=0, torsion_modes=0
    )
    if straight:
        chosen = chosen.replace(tower_influence="none")
        turbine = turbine.replace(**{"nacelle.tilt": 0.0, "hub.precone": 0.0})
        azimuths = 1
    model = build(turbine, chosen)
    case = Case(model, SteadyWind(speed=wind_speed))
    rotor = case.view("rotor")
    generator = len(model.tower.names) + GENERATOR
    R, rho = turbine.rotor_radius, model.environment.density
    area = np.pi * R**2
    thrust, torque = np.zeros((2, len(ratios), len(pitches)))
    for i, ratio in enumerate(ratios):
        case["v"][generator] = ratio * wind_speed / R
        for j, angle in enumerate(pitches):
            case["pitch"][ANGLE] = angle
            for psi in 2.0 * np.pi / model.n_blades / azimuths * np.arange(azimuths):
                case["q"][generator] = psi
                for _ in range(8):
                    case.evaluate(0.0)
                thrust[i, j] += rotor["thrust"] / azimuths
                torque[i, j] += rotor["torque"] / azimuths
    force = 0.5 * rho * area * wind_speed**2
    c_q = torque / (force * R)
    return Performance(ratios, pitches, c_q * ratios[:, None], thrust / force, c_q)
