"""Steady rotor performance: power, thrust and torque coefficients over tip-speed ratio and pitch angle."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict

import numpy as np
from numpy.typing import ArrayLike

from meltemi.aero.coefficient import power_coefficient, rotor_coefficients, thrust_coefficient
from meltemi.analyses.rotor_performance import Float, RotorPerformance
from meltemi.core.errors import InputError
from meltemi.simulation.case import Case
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.turbine.power_turbine import AnyTurbine, CalibratedCoefficient, PowerTurbine, TableCoefficient, aeroelastic
from meltemi.wind.fields import SteadyWind

KEEP = 16
"""Number of turbines in the cache of rotor performance."""
RATIO_STEP, MOST_RATIO = 0.25, 16.0
PITCH_STEP, MOST_PITCH = math.radians(1.0), math.radians(30.0)
RIGID = ("tower", "yaw", "generator", "drivetrain", "blades")


def rotor_performance(
    turbine: AnyTurbine,
    tip_speed_ratio: ArrayLike,
    pitch: ArrayLike,
    *,
    options: ModelOptions | None = None,
    wind_speed: float = 8.0,
    straight: bool = True,
    azimuths: int = 12,
) -> RotorPerformance:
    """Performance coefficients of the rigid rotor.

    Args:
      tip_speed_ratio: values above zero.
      pitch: [rad] pitch angles.
      options: aerodynamic models; their steady variants are used.
      wind_speed: [m/s]; the coefficients do not depend on it.
      straight: whether the rotor is taken without tilt, cone and tower influence; otherwise the rotor as built.
      azimuths: positions over one sector between blades, for the rotor as built.

    Raises:
      InputError: a tip-speed ratio is not above zero, or the turbine has no blades.
    """
    turbine = aeroelastic(turbine, "rotor_performance (performance_of has the coefficients)")
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
    generator = model.rows.generator
    R, rho = turbine.rotor_radius, model.environment.density
    area = np.pi * R**2
    thrust, torque = np.zeros((2, len(ratios), len(pitches)))
    for i, ratio in enumerate(ratios):
        case["v"][generator] = ratio * wind_speed / R
        for j, angle in enumerate(pitches):
            case.view("pitch")["angle"] = angle
            for psi in 2.0 * np.pi / model.n_blades / azimuths * np.arange(azimuths):
                case["q"][generator] = psi
                for _ in range(8):
                    case.evaluate(0.0)
                thrust[i, j] += rotor["thrust"] / azimuths
                torque[i, j] += rotor["torque"] / azimuths
    force = 0.5 * rho * area * wind_speed**2
    c_q = torque / (force * R)
    return RotorPerformance(ratios, pitches, c_q * ratios[:, None], thrust / force, c_q)


_LOCK = threading.Lock()
_KNOWN: OrderedDict[str, RotorPerformance] = OrderedDict()


def performance_of(turbine: AnyTurbine) -> RotorPerformance:
    """Coefficients of a turbine's rotor, computed once, for tip-speed ratios from 1 to 16 and pitch up to 30 degrees.

    Those of an aeroelastic turbine are for the rigid rotor as built, with tilt, cone and tower; those of a
    power-coefficient turbine are those of its description, at the entries of a table, and NaN where it has no data.
    """
    if isinstance(turbine, PowerTurbine):
        return _of_coefficient(turbine)
    key = turbine.content_hash()
    with _LOCK:  # other threads wait for the one that computes
        if key not in _KNOWN:
            ratios = np.arange(1.0, MOST_RATIO + 1e-9, RATIO_STEP)
            _KNOWN[key] = rotor_performance(turbine, ratios, _pitches(turbine), straight=False)
            while len(_KNOWN) > KEEP:
                _KNOWN.popitem(last=False)
        return _KNOWN[key]


def _pitches(turbine: AnyTurbine) -> Float:
    least, most = turbine.pitch_actuator.minimum, min(turbine.pitch_actuator.maximum, MOST_PITCH)
    least = max(least, -math.radians(5.0))
    return np.linspace(least, most, round((most - least) / PITCH_STEP) + 1)


def _of_coefficient(turbine: PowerTurbine) -> RotorPerformance:
    described = turbine.coefficient
    record = rotor_coefficients(described)
    if isinstance(described, TableCoefficient):
        ratios, pitches = np.array(described.tip_speed_ratio), np.array(described.pitch)
    elif isinstance(described, CalibratedCoefficient):
        ratios, pitches = np.arange(7.0, 11.51, RATIO_STEP), np.zeros(1)
    else:
        ratios, pitches = np.arange(1.0, MOST_RATIO + 1e-9, RATIO_STEP), _pitches(turbine)
    power = np.array([[power_coefficient(r, b, record) for b in pitches] for r in ratios])
    thrust = np.full_like(power, np.nan)
    if isinstance(described, TableCoefficient) and described.thrust is not None:
        thrust = np.array([[thrust_coefficient(r, b, record) for b in pitches] for r in ratios])
    return RotorPerformance(ratios, pitches, power, thrust, power / ratios[:, None])
