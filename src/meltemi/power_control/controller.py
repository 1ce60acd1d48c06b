"""``PowerController``, and the settings of a power control for controllers that contain one."""

from __future__ import annotations

import math

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.compiler import kernel
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.integrator import integrator_settings
from meltemi.core.errors import InputError
from meltemi.core.units import rpm
from meltemi.electrical.system import nominal_frequency
from meltemi.environment.site import STANDARD
from meltemi.power_control.law import power_step
from meltemi.power_control.rotor import RotorTables, rotor_tables
from meltemi.power_control.settings import SCHEMES, PowerControl
from meltemi.power_control.state import PowerControlState
from meltemi.power_control.tables import NUMBER
from meltemi.turbine.moments import blade_moments
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine

Float = NDArray[float64]

NEAR = 0.99
"""Share of the pitch loop's reference speed at which rated power is reached at the latest, as in the baseline law."""
FILTERED = 0.5
"""Largest frequency of the speed loop over the corner frequency of the speed filter."""
SPEED_LOOP = 0.6 / rpm(12.1)
"""Frequency of the speed loop of the NREL 5 MW over its rated rotor speed (Jonkman et al. 2009)."""


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    power_step(PowerControlState(state), Measurements(measurements), Demands(demands), dt)


def PowerController(
    turbine: AnyTurbine,
    performance: RotorPerformance,
    settings: PowerControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "power control",
) -> Controller:
    """Controller that tracks a power reference, and maximises power below it.

    ``CoordinatedController`` adds yaw control and individual pitch.

    Args:
      turbine: turbine with speeds, limits of torque and pitch, and inertia; its gains are not used.
      performance: performance of its rotor, from ``performance_of(turbine)``.
      settings: settings; by default optimal torque with fixed density and the scheme ``hold``.
      sample_time: [s] time between calls; by default every time step.
      name: name for messages.

    Returns:
      The controller. Channels: ``power_state`` the number of its state, ``power_setpoint``, ``wind_estimate``.

    Raises:
      InputError: settings are inconsistent with each other or with the turbine, or the performance is not suitable.
    """
    template = power_settings(turbine, performance, settings or PowerControl())

    return Controller(
        update=update,
        init=lambda start: power_start(template, start),
        sample_time=sample_time,
        name=name,
        uses_loads=False,
        state_names=PowerControlState.names_of(template.array),
        warnings=lambda x: power_warnings(PowerControlState(x)),
    )


def power_settings(turbine: AnyTurbine, performance: RotorPerformance, settings: PowerControl) -> PowerControlState:
    """Settings and tables of a power control; ``power_start`` adds the initial state.

    Raises:
      InputError: as ``PowerController``.
    """
    torque, pitch, drive = turbine.control.torque, turbine.control.pitch, turbine.drivetrain
    rotor = rotor_tables(performance, pitch.minimum)
    ratio, efficiency = drive.gear_ratio, drive.generator_efficiency
    inertia = settings.inertia or shaft_inertia(turbine)
    reference = pitch.reference_speed
    corner = turbine.control.filter_frequency
    for name in ("frequency", "tracking_frequency"):
        given = getattr(settings, name)
        if given is not None and given >= corner:
            raise InputError(
                f"power control: {name} {given:g} rad/s must be below the corner frequency of the speed filter of "
                f"{turbine.name}, control.filter_frequency = {corner:g} rad/s"
            )
    frequency = settings.frequency or default_frequency(turbine, rotor, inertia)
    n, m, k = len(rotor.tip_speed_ratio), len(rotor.pitch), len(rotor.share)
    x = PowerControlState.of(ratios=n, pitches=m, shares=k, power_coefficient=rotor.power)
    upper = reference / ratio if settings.upper_speed is None else settings.upper_speed
    if not upper <= reference / ratio * (1.0 + 1e-9):
        raise InputError(
            f"PowerController: upper_speed {upper:g} rad/s must not be above the rotor's {reference / ratio:g} rad/s"
        )
    x.filter_frequency, x.reference_speed = corner, upper * ratio if settings.upper_speed else reference
    for name in ("cut_in_speed", "optimal_speed", "rated_power", "maximum_torque"):
        setattr(x, name, getattr(torque, name))
    x.torque_rate = torque.rate_limit
    # if the optimal torque does not reach rated power at that speed, a line as in the baseline law does (C-5)
    rated_speed = max(torque.rated_speed, NEAR * reference)
    synchronous = rated_speed / (1.0 + torque.slip)
    x.rated_speed, x.synchronous_speed = rated_speed, synchronous
    x.transition_slope = torque.rated_power / rated_speed / (rated_speed - synchronous)
    x.minimum_pitch, x.maximum_pitch, x.pitch_rate = pitch.minimum, pitch.maximum, pitch.rate_limit
    x.efficiency, x.gear_ratio, x.inertia = efficiency, ratio, inertia
    # the speed of a rotor with little inertia follows its power: the loop is then designed for the stiffness T / Omega
    x.loop_inertia = max(inertia, torque.rated_power / (reference / ratio) ** 2 / frequency)
    x.gear_efficiency = 1.0 if isinstance(turbine, PowerTurbine) else turbine.drivetrain.gearbox_efficiency
    x.radius = turbine.rotor_radius
    x.best_ratio, x.best_coefficient = rotor.best
    x.tracks_ratio = settings.torque == "tip_speed_ratio"
    x.air = ("fixed", "temperature", "weather").index(settings.density)
    x.density, x.assumed_pressure = settings.air_density, settings.air_pressure
    x.scheme = tuple(SCHEMES.values()).index(settings.scheme)
    margin = settings.recovery_speed or 0.02 * reference / ratio
    x.recovery_margin = margin * ratio
    if margin * ratio >= reference:
        raise InputError(
            f"PowerController: recovery_speed {margin:g} rad/s must be less than the rotor's "
            f"{reference / ratio:g} rad/s"
        )
    x.reference_rate = (settings.reference_rate or 0.1 * torque.rated_power * efficiency) / efficiency
    x.frequency, x.damping_ratio = frequency, settings.damping_ratio
    x.anticipation = settings.anticipation
    # C-85: at rated power and speed the aerodynamic torque increases by 3 T / V with the wind
    rated = torque.rated_power / (reference / ratio)
    area = 0.5 * STANDARD * math.pi * turbine.rotor_radius**2 * rotor.best[1]
    wind = (torque.rated_power / area) ** (1.0 / 3.0)
    x.estimator_gain = (settings.estimator_frequency or frequency) * inertia / (3.0 * rated / wind)
    x.available_time = 5.0
    _set_droop(x, settings, turbine)
    x.reference = x.grid_rating = turbine.rated_power
    # the rate 3 K omega / J at which the optimal torque returns to its tip-speed ratio
    optimal = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * rotor.best[1] / rotor.best[0] ** 3
    tracking = settings.tracking_frequency or min(3.0 * optimal * reference / ratio / inertia, frequency)
    x.torque_loop = integrator_settings(
        proportional_gain=2.0 * settings.damping_ratio * tracking * inertia / ratio**2,
        integral_gain=tracking**2 * inertia / ratio**2,
    )
    x.ratio_first, x.ratio_step = rotor.tip_speed_ratio[0], rotor.ratio_step
    x.pitch_first, x.pitch_step = rotor.pitch[0], rotor.pitch_step
    x.share_first, x.share_step = rotor.share[0], rotor.share[1] - rotor.share[0]
    tip = turbine.rotor_radius / (rotor.best_ratio * ratio)
    x.optimal_gain = 0.5 * math.pi * turbine.rotor_radius**2 * rotor.best_power * x.gear_efficiency * tip**3
    x.sensitivity = rotor.sensitivity
    if m == 1:  # no information on the pitch sensitivity except the gains of the turbine
        unit = inertia * frequency**2 / (optimal * (reference / ratio) ** 2)
        x.sensitivity = np.full((1, k), unit / (ratio**2 * pitch.integral_gain / ratio))
    return x


def _set_droop(x: PowerControlState, settings: PowerControl, turbine: AnyTurbine) -> None:
    droop, rated, nominal = settings.droop, turbine.rated_power, nominal_frequency(turbine.electrical)
    if droop is not None and droop.nominal is not None:
        nominal = droop.nominal
    x.nominal_frequency, x.inertia_time = nominal, 0.2
    if droop is None:
        return
    x.dead_band, x.droop_gain = droop.dead_band, rated / (droop.droop * nominal)
    x.reserve, x.available_time = droop.reserve, droop.available_time
    x.inertia_gain, x.inertia_time = 2.0 * droop.inertia * rated / nominal, droop.inertia_time


def power_start(template: PowerControlState, start: StartPoint) -> PowerControlState:
    """Initial state at an operating point, without a jump of the demands."""
    x = template.copy()
    x.speed, x.pitch, x.torque = start.generator_speed, start.pitch, start.generator_torque
    x.slow_pitch = start.pitch
    x.upper = x.recovery = start.generator_speed
    x.wind, x.last_speed = max(start.wind_speed, 0.5), start.generator_speed / x.gear_ratio
    x.filtered_torque, x.filtered_pitch = start.generator_torque, start.pitch
    x.setpoint = x.rated_power
    area = 0.5 * math.pi * float(x.density * x.radius**2 * x.best_coefficient)
    x.available = min(area * start.wind_speed**3, x.rated_power)
    x.slow_frequency = x.nominal_frequency
    pitched = start.pitch > x.minimum_pitch + 1e-6
    x.state = NUMBER["speed_limit" if pitched else "maximum_power"]
    x.pitch_loop.integral = start.pitch
    x.torque_loop.integral = start.generator_torque
    return x


def power_warnings(x: PowerControlState) -> list[str]:
    """Warnings at the end of a run."""
    if x.over < 0.5:
        return []
    return [f"power control: the power reference exceeds rated power; it is limited to {x.grid_rating:.4g} W"]


def default_frequency(turbine: AnyTurbine, rotor: RotorTables, inertia: float) -> float:
    """Frequency [rad/s] of the speed loop of the turbine's collective law at rated power (C-86a).

    At the pitch where its gains are halved, with the sensitivity that the rotor has there, at most the one that has a
    damping ratio of 0.7 with these gains (C-9b); of a rotor known at one pitch only, that of the
    NREL 5 MW in relation to rated speed.

    Raises:
      InputError: power does not decrease with pitch there.
    """
    pitch, rated = turbine.control.pitch, turbine.control.torque.rated_power
    ratio, speed = turbine.drivetrain.gear_ratio, turbine.rated_rotor_speed
    if len(rotor.pitch) == 1:
        return SPEED_LOOP * speed
    best_ratio, best_power = rotor.best
    optimal = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * best_power / best_ratio**3 * speed**3
    at_share = [np.interp((rated / optimal) ** (1.0 / 3.0), rotor.share, row) for row in rotor.sensitivity]
    slope = float(np.interp(pitch.gain_halving_pitch, rotor.pitch, at_share)) * optimal / speed
    if not slope * pitch.integral_gain > 0.0:
        raise InputError(
            f"{turbine.name}: rotor power does not fall with pitch at gain_halving_pitch = "
            f"{math.degrees(pitch.gain_halving_pitch):.3g} deg, so the frequency of the speed loop of power control "
            "is not defined; correct control.pitch.gain_halving_pitch, or give the frequency of the settings"
        )
    frequency = math.sqrt(0.5 * pitch.integral_gain * ratio * slope / inertia)
    damped = 2.0 * 0.7 * pitch.integral_gain / max(pitch.proportional_gain, 1e-9 * pitch.integral_gain)
    return min(frequency, damped, FILTERED * turbine.control.filter_frequency)


def shaft_inertia(turbine: AnyTurbine) -> float:
    """Moment of inertia [kg m^2] of blades, hub and generator about the low-speed shaft."""
    if isinstance(turbine, PowerTurbine):
        return turbine.drivetrain.inertia
    hub, drive = turbine.hub, turbine.drivetrain
    _, blade = blade_moments(turbine.blade.structure, hub.radius)
    blades = turbine.n_blades * blade * math.cos(hub.precone) ** 2
    return blades + hub.inertia + drive.gear_ratio**2 * drive.generator_inertia
