"""``tune_baseline``: gains of the baseline controller from the aerodynamics of the turbine.

The rule of the authors of the law:

The speed of the rotor under the pitch loop is an oscillator (Jonkman et al. 2009, section 7.3):

    I phi'' + N (-dP/dtheta) / Omega (K_P phi' + K_I phi) = 0       I: rotor and N^2 generator, N: gear ratio

so a frequency w and a damping ratio zeta require

    K_P = 2 I Omega zeta w / (N (-dP/dtheta)),    K_I = I Omega w^2 / (N (-dP/dtheta))

dP/dtheta is the sensitivity of the rotor's power to collective pitch at operating points from rated wind to cut-out,
with induced velocities and deflections held ("frozen wake"); for a power-coefficient turbine it follows from the
coefficient. A linear fit over pitch gives its value at zero pitch and the pitch at which it has doubled, where the
gains are halved.

The frequency is that of the NREL 5 MW, 0.6 rad/s, scaled with the rated rotor speed: 2.1 revolutions per oscillation
for any rotor. Lags of filter and actuator, wake, tower and blades, and constant power are not in the rule: scaled to
15 MW its loop is unstable at rated wind. Therefore the frequency is lowered until the loop has margins in the linear
model of the turbine (``speed_loop``), with a low-pass that costs 7 deg of phase, and gains fall half as fast.

The optimal gain is torque over speed squared at the largest power coefficient, or at a given tip-speed ratio, limited
such that rated power is not exceeded below rated speed.

Reference: Jonkman et al. (2009), NREL/TP-500-38060; docs/theory/control.md (C-9a to C-9f).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.core.units import rpm
from meltemi.simulation.bladed.rotor import BladedModel, BladedRotor
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build, operating_point
from meltemi.structure.tables import BladeNode
from meltemi.tuning.speed_loop import keep_margins, speed_loops, speed_responses
from meltemi.turbine.definition import BaselineControl
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine

Float = NDArray[np.float64]

FREQUENCY, FREQUENCY_SPEED = 0.6, rpm(12.1)
"""[rad/s] frequency of the speed loop of the NREL 5 MW, and its rated rotor speed."""
DAMPING = 0.7
POINTS = 8
"""Operating points from rated wind to cut-out."""
AZIMUTHS = 4
"""Rotor positions in a third of a revolution over which the sensitivity is averaged."""
STEP = math.radians(0.1)
"""[rad] step of the pitch, to both sides."""
ABOVE_RATED, MARGIN_POINTS = 1.1, 4
"""Lowest wind speed with margins over rated wind speed; operating points from there to cut-out."""
FREQUENCY_FRACTIONS = np.linspace(0.2, 1.0, 81)
"""Fractions of the frequency that are tried."""
SCHEDULE = 4.0
"""Halving pitch of the law over that of the sensitivity: 2 for a constant frequency, since the law schedules its whole
demand; twice that, since margins grow with the wind."""
CORNER = 8.0
"""Least corner frequency of the low-pass over the frequency of the loop."""
PART_SPEED = 0.8
"""Rotor speed over its reference at which the optimal gain is evaluated."""
RATIOS = 4.0, 14.0
"""Range of the search for the optimal tip-speed ratio."""


@dataclass(frozen=True, repr=False)
class BaselineTuning(Brief):
    """Gains of the baseline controller and the quantities behind them.

    Attributes:
      control: baseline control of the turbine with the new gains.
      frequency: [rad/s] frequency of the speed loop, by (C-9b).
      damping_ratio: damping ratio of the speed loop.
      inertia: [kg m^2] inertia of rotor and generator about the shaft.
      wind_speed: (n,) [m/s] wind speeds of the operating points.
      pitch: (n,) [rad] pitch there.
      sensitivity: (n,) [W/rad] sensitivity of the power to pitch.
      sensitivity_at_zero: [W/rad] value of the linear fit at zero pitch.
      tip_speed_ratio: tip-speed ratio of region 2, at minimum pitch.
      power_coefficient: power coefficient there, referred to the rotor radius without cone.
    """

    control: BaselineControl
    frequency: float
    damping_ratio: float
    inertia: float
    wind_speed: Float
    pitch: Float
    sensitivity: Float
    sensitivity_at_zero: float
    tip_speed_ratio: float
    power_coefficient: float


def tune_baseline(
    turbine: AnyTurbine,
    *,
    frequency: float | None = None,
    damping_ratio: float = DAMPING,
    tip_speed_ratio: float | None = None,
    margins: bool = True,
    options: ModelOptions | None = None,
) -> BaselineTuning:
    """Tune pitch gains, gain schedule, low-pass and optimal torque gain of the baseline controller.

    Speeds, limits and rated power are unchanged.

    Args:
      turbine: turbine of either kind.
      frequency: [rad/s] largest frequency of the loop; by default 0.6 rad/s times the rated rotor speed over 12.1 rpm.
      damping_ratio: damping ratio of the speed loop.
      tip_speed_ratio: tip-speed ratio of region 2; by default that of the largest power coefficient.
      margins: lower the frequency until the loop keeps phase and gain margin; without, the authors' rule as published.
      options: options of the model; dynamic stall is switched off.

    Raises:
      InputError: a number is not above zero, the wind does not drive the rotor, the power does not decrease with
        pitch, or even a fifth of the frequency has no margins.
    """
    reference = turbine.rated_rotor_speed
    if frequency is None:
        frequency = FREQUENCY * reference / FREQUENCY_SPEED
    numbers = {"frequency": frequency, "damping_ratio": damping_ratio, "tip_speed_ratio": tip_speed_ratio}
    for name, value in numbers.items():
        if value is not None and not value > 0.0:
            raise InputError(f"tune_baseline: {name} must be above zero, found {value!r}")
    full_options = options or ModelOptions()
    options = full_options
    if not isinstance(turbine, PowerTurbine):
        options = options.replace(stall="static", inflow="variable")
    model = build(turbine, options)
    best, gain, coefficient = _optimal(model, PART_SPEED * reference, tip_speed_ratio)
    ratio, torque, pitch_control = turbine.drivetrain.gear_ratio, turbine.control.torque, turbine.control.pitch
    most = torque.rated_power / torque.rated_speed**3  # more would be above rated power below rated speed
    control = turbine.control.replace(**{"torque.optimal_gain": min(gain / ratio**3, most)})
    model = build(turbine.replace(control=control), model.options)
    rated = rated_wind(model)
    speeds = np.linspace(rated, turbine.cut_out, POINTS)
    points = [operating_point(model, float(u)) for u in speeds]
    pitch = np.array([point.pitch for point in points])
    sensitivity = np.array([_sensitivity(model, point) for point in points])
    slope, at_zero = np.polyfit(pitch, sensitivity, 1)
    if at_zero >= 0.0 or slope >= 0.0:
        raise InputError(
            f"tune_baseline: the power of {turbine.name} does not fall ever faster with pitch ({at_zero:.3g} W/rad at "
            f"zero pitch, then {slope:.3g} W/rad^2): look at its polars, twist and rated speed"
        )
    inertia = _inertia(model)
    unit = inertia * reference / (ratio * -at_zero)
    source = f"{control.source}; gains by tune_baseline".lstrip("; ")

    def law(w: float) -> BaselineControl:
        tuned = pitch_control.replace(
            proportional_gain=2.0 * damping_ratio * w * unit,
            integral_gain=w**2 * unit,
            gain_halving_pitch=float(at_zero / slope) * (SCHEDULE if margins else 1.0),
        )
        corner = max(control.filter_frequency, CORNER * w) if margins else control.filter_frequency
        return control.replace(pitch=tuned, filter_frequency=corner, source=source)

    if margins:
        full = build(turbine.replace(control=control), full_options)
        above = [
            operating_point(full, float(u)) for u in np.linspace(ABOVE_RATED * rated, turbine.cut_out, MARGIN_POINTS)
        ]
        responses = speed_responses(full, above)
        tried = (float(share * frequency) for share in FREQUENCY_FRACTIONS)
        kept = list(takewhile(lambda w: keep_margins(speed_loops(law(w), above, responses)), tried))
        if not kept:
            raise InputError(
                f"tune_baseline: the speed loop of {turbine.name} has no margins even at a fifth of {frequency:.3g} "
                "rad/s: give a lower frequency, or margins=False"
            )
        frequency = kept[-1]
    control = law(frequency)
    return BaselineTuning(
        control=control,
        frequency=frequency,
        damping_ratio=damping_ratio,
        inertia=inertia,
        wind_speed=speeds,
        pitch=pitch,
        sensitivity=sensitivity,
        sensitivity_at_zero=float(at_zero),
        tip_speed_ratio=best,
        power_coefficient=coefficient,
    )


def _optimal(model: Model[Any], speed: float, wanted: float | None) -> tuple[float, float, float]:
    """Tip-speed ratio, by default the best at the smallest pitch; torque over speed squared and power coefficient."""
    from scipy.optimize import minimize_scalar

    turbine = model.turbine
    R, rho = turbine.rotor_radius, model.environment.density
    pitch = turbine.control.pitch.minimum

    def torque(tip_ratio: float) -> float:
        point = operating_point(model, speed * R / tip_ratio, rotor_speed=speed, pitch=pitch)
        return point["rotor_aero_torque"]

    def lost(tip_ratio: float) -> float:
        return -torque(tip_ratio) * tip_ratio**3  # power over the cube of the wind speed

    best = wanted or float(minimize_scalar(lost, bounds=RATIOS, method="bounded", options={"xatol": 0.01}).x)
    best_torque = torque(best)
    if best_torque <= 0.0:
        raise InputError(f"tune_baseline: the wind does not drive the rotor of {turbine.name} at its smallest pitch")
    return best, best_torque / speed**2, best_torque * speed / (0.5 * rho * math.pi * R**2 * (speed * R / best) ** 3)


def rated_wind(model: Model[Any]) -> float:
    """[m/s] rated wind speed: where the pitch leaves its minimum."""
    low, high = model.turbine.cut_in, model.turbine.cut_out
    smallest = model.turbine.control.pitch.minimum
    for _ in range(8):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if operating_point(model, middle).pitch > smallest + 1e-6 else (middle, high)
    return high


def _sensitivity(model: Model[Any], point: OperatingPoint) -> float:
    """[W/rad] derivative of power by pitch at an operating point, with deflections and induced velocities held."""
    case = Case(model, point.wind)
    rotor = case.view("rotor")
    torque = np.zeros(2)
    for psi in 2.0 * math.pi / model.n_blades / AZIMUTHS * np.arange(AZIMUTHS):
        for side, sign in enumerate((-1.0, 1.0)):
            point.put(case, float(psi))
            case.view("pitch")["angle"] = point.pitch + sign * STEP
            for _ in range(3):
                case.evaluate(0.0)
            torque[side] += rotor["torque"] / AZIMUTHS
    return float(point.rotor_speed * (torque[1] - torque[0]) / (2.0 * STEP))


def _inertia(model: Model[Any]) -> float:
    """[kg m^2] inertia of blades, hub and generator about the shaft."""
    if not isinstance(model.rotor, BladedRotor):
        assert isinstance(model.turbine, PowerTurbine)
        return model.turbine.drivetrain.inertia
    drive = model.turbine.drivetrain
    return rotor_inertia(model) + drive.gear_ratio**2 * drive.generator_inertia


def rotor_inertia(model: BladedModel) -> float:
    """[kg m^2] inertia of blades and hub about the shaft."""
    turbine = model.turbine
    nodes = View(BladeNode, model.rotor.blade_nodes)
    x, y, z = nodes["position"]
    across = x * math.sin(turbine.hub.precone) + z * math.cos(turbine.hub.precone)
    return float(np.sum(nodes["mass"] * (across**2 + y**2))) + turbine.hub.inertia
