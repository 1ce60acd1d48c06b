"""``power_control``: the power control of a turbine as a controller, and its section for others that contain it."""

from __future__ import annotations

import math

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.control.controller import Controller, StartPoint
from meltemi.control.integrator import INTEGRAL, IntegratorState, integrator_settings
from meltemi.control.power_control import state as p
from meltemi.control.power_control.law import power_step
from meltemi.control.power_control.rotor import RotorTables, rotor_tables
from meltemi.control.power_control.settings import SCHEMES, PowerControl
from meltemi.control.power_control.tables import CONDITIONS, NUMBER
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.units import rpm
from meltemi.environment.site import STANDARD
from meltemi.maths.tables import View
from meltemi.turbine.electrical import nominal_frequency
from meltemi.turbine.performance import RotorPerformance
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine
from meltemi.turbine.scaling.blade import blade_moments

Float = NDArray[float64]

NEAR = 0.99
"""Of the pitch loop's reference, where rated power is reached at the latest, as in the baseline law."""
FILTERED = 0.5
"""Of the speed filter's corner, that the speed loop has at most."""
SPEED_LOOP = 0.6 / rpm(12.1)
"""Frequency of the speed loop of the NREL 5 MW over its rated rotor speed (Jonkman et al. 2009)."""


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    power_step(x, 0, measured, demands, dt)


def power_control(
    turbine: AnyTurbine,
    performance: RotorPerformance,
    settings: PowerControl | None = None,
    *,
    sample_time: float | None = None,
    name: str = "power control",
) -> Controller:
    """A controller that follows a power reference, and the wind where there is less than is asked for.

    ``coordinated`` puts a yaw control and individual pitch beside it.

    Args:
      turbine: gives speeds, limits of torque and pitch, and inertia; its gains are not used.
      performance: of its rotor, from ``performance_of(turbine)``.
      settings: by default optimal torque with fixed density and the scheme ``hold``.
      sample_time: [s] between calls; by default every time step.
      name: for messages.

    Returns:
      The controller. Channels: ``power_state`` the number of its state, ``power_setpoint``, ``wind_estimate``.

    Raises:
      InputError: settings that contradict each other or the turbine, or a performance that does not suit.
    """
    section = power_section(turbine, performance, settings or PowerControl())

    def init(start: StartPoint) -> Float:
        x = section.copy()
        start_power(x, 0, start)
        return x

    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        uses_loads=False,
        state_names=tuple(power_names(section)),
        warnings=lambda x: power_warnings(x, 0),
    )


def power_section(turbine: AnyTurbine, performance: RotorPerformance, settings: PowerControl) -> Float:
    """Settings and tables of a power control, to be put into a state vector and set to a start by ``start_power``.

    Raises:
      InputError: as ``power_control``.
    """
    torque, pitch, drive = turbine.control.torque, turbine.control.pitch, turbine.drivetrain
    rotor = rotor_tables(performance, pitch.minimum)
    ratio, efficiency = drive.gear_ratio, drive.generator_efficiency
    inertia = settings.inertia or shaft_inertia(turbine)
    reference = pitch.reference_speed
    heard = turbine.control.filter_frequency
    for name in ("frequency", "tracking_frequency"):
        given = getattr(settings, name)
        if given is not None and given >= heard:
            raise InputError(
                f"power control: {name} {given:g} rad/s is not below the {heard:g} rad/s (control.filter_frequency) of "
                f"the filter through which {turbine.name} hears its speed"
            )
    frequency = settings.frequency or own_frequency(turbine, rotor, inertia)
    x = np.zeros(p.TABLES)
    view = View(p.PowerControlState, x[: len(p.PowerControlState)])
    view["filter_frequency"], view["reference_speed"] = heard, reference
    for field in ("cut_in_speed", "optimal_speed", "rated_power", "maximum_torque"):
        view[field] = getattr(torque, field)
    view["torque_rate"] = torque.rate_limit
    # where the optimal torque would not reach rated power by then, a line as in the baseline law leads there (C-5)
    rated_speed = max(torque.rated_speed, NEAR * reference)
    synchronous = rated_speed / (1.0 + torque.slip)
    view["rated_speed"], view["synchronous_speed"] = rated_speed, synchronous
    view["transition_slope"] = torque.rated_power / rated_speed / (rated_speed - synchronous)
    view["minimum_pitch"], view["maximum_pitch"], view["pitch_rate"] = pitch.minimum, pitch.maximum, pitch.rate_limit
    view["efficiency"], view["gear_ratio"], view["inertia"] = efficiency, ratio, inertia
    # a rotor of hardly any inertia turns as its power bids: the loop is then made for that stiffness, T / Omega
    view["loop_inertia"] = max(inertia, torque.rated_power / (reference / ratio) ** 2 / frequency)
    view["gear_efficiency"] = 1.0 if isinstance(turbine, PowerTurbine) else turbine.drivetrain.gearbox_efficiency
    view["radius"] = turbine.rotor_radius
    view["best_ratio"], view["best_coefficient"] = rotor.best
    view["tracks_ratio"] = settings.torque == "tip_speed_ratio"
    view["air"] = ("fixed", "temperature", "weather").index(settings.density)
    view["density"], view["assumed_pressure"] = settings.air_density, settings.air_pressure
    view["scheme"] = tuple(SCHEMES.values()).index(settings.scheme)
    margin = settings.recovery_speed or 0.02 * reference / ratio
    view["recovery_margin"] = margin * ratio
    if margin * ratio >= reference:
        raise InputError(
            f"power_control: recovery_speed {margin:g} rad/s must be less than the rotor's {reference / ratio:g} rad/s"
        )
    view["reference_rate"] = (settings.reference_rate or 0.1 * torque.rated_power * efficiency) / efficiency
    view["frequency"], view["damping_ratio"] = frequency, settings.damping_ratio
    # C-85: at rated power and speed the torque of the air rises by 3 T / V with the wind
    rated = torque.rated_power / (reference / ratio)
    area = 0.5 * STANDARD * math.pi * turbine.rotor_radius**2 * rotor.best[1]
    wind = (torque.rated_power / area) ** (1.0 / 3.0)
    view["estimator_gain"] = (settings.estimator_frequency or frequency) * inertia / (3.0 * rated / wind)
    view["available_time"] = 5.0
    _set_droop(view, settings, turbine)
    view["reference"] = view["grid_rating"] = turbine.rated_power
    # the rate 3 K omega / J at which the optimal torque itself comes back to its tip-speed ratio
    optimal = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * rotor.best[1] / rotor.best[0] ** 3
    tracking = settings.tracking_frequency or min(3.0 * optimal * reference / ratio / inertia, frequency)
    x[p.TORQUE_LOOP : p.TORQUE_LOOP + len(IntegratorState)] = integrator_settings(
        proportional_gain=2.0 * settings.damping_ratio * tracking * inertia / ratio**2,
        integral_gain=tracking**2 * inertia / ratio**2,
    )
    n, m, k = len(rotor.tip_speed_ratio), len(rotor.pitch), len(rotor.share)
    view["ratios"], view["ratio_first"], view["ratio_step"] = n, rotor.tip_speed_ratio[0], rotor.ratio_step
    view["pitches"], view["pitch_first"], view["pitch_step"] = m, rotor.pitch[0], rotor.pitch_step
    view["shares"], view["share_first"], view["share_step"] = k, rotor.share[0], rotor.share[1] - rotor.share[0]
    tip = turbine.rotor_radius / (rotor.best_ratio * ratio)
    gains = 0.5 * math.pi * turbine.rotor_radius**2 * rotor.best_power * view["gear_efficiency"] * tip**3
    sensitivity = rotor.sensitivity
    if m == 1:  # nothing is known of the pitch but the turbine's own gains
        unit = inertia * frequency**2 / (optimal * (reference / ratio) ** 2)
        sensitivity = np.full((1, k), unit / (ratio**2 * pitch.integral_gain / ratio))
    return np.concatenate([x, rotor.power.reshape(-1), sensitivity.reshape(-1), gains])


def _set_droop(view: View, settings: PowerControl, turbine: AnyTurbine) -> None:
    droop, rated, nominal = settings.droop, turbine.rated_power, nominal_frequency(turbine.electrical)
    if droop is not None and droop.nominal is not None:
        nominal = droop.nominal
    view["nominal_frequency"], view["inertia_time"] = nominal, 0.2
    if droop is None:
        return
    view["dead_band"], view["droop_gain"] = droop.dead_band, rated / (droop.droop * nominal)
    view["reserve"], view["available_time"] = droop.reserve, droop.available_time
    view["inertia_gain"], view["inertia_time"] = 2.0 * droop.inertia * rated / nominal, droop.inertia_time


def start_power(x: Float, at: int, start: StartPoint) -> None:
    """Set the section from the place ``at`` on to an operating point, from which no demand jumps."""
    view = View(p.PowerControlState, x[at : at + len(p.PowerControlState)])
    view["speed"], view["pitch"], view["torque"] = start.generator_speed, start.pitch, start.generator_torque
    view["slow_pitch"] = start.pitch
    view["upper"] = view["recovery"] = start.generator_speed
    view["wind"], view["last_speed"] = max(start.wind_speed, 0.5), start.generator_speed / float(view["gear_ratio"])
    view["heard_torque"], view["heard_pitch"] = start.generator_torque, start.pitch
    view["setpoint"] = view["rated_power"]
    area = 0.5 * math.pi * float(view["density"] * view["radius"] ** 2 * view["best_coefficient"])
    view["available"] = min(area * start.wind_speed**3, float(view["rated_power"]))
    view["slow_frequency"] = view["nominal_frequency"]
    pitched = start.pitch > float(view["minimum_pitch"]) + 1e-6
    view["state"] = NUMBER["speed_limit" if pitched else "maximum_power"]
    x[at + p.PITCH_LOOP + INTEGRAL] = start.pitch
    x[at + p.TORQUE_LOOP + INTEGRAL] = start.generator_torque


def power_names(section: Float) -> list[str]:
    """Of the entries of a section."""
    view = View(p.PowerControlState, section[: len(p.PowerControlState)])
    n, m, k = (int(view[name]) for name in ("ratios", "pitches", "shares"))
    return [
        *p.PowerControlState.names,
        *(f"holds_{name}" for name in CONDITIONS),
        *(f"pitch_loop_{name}" for name in IntegratorState.names),
        *(f"torque_loop_{name}" for name in IntegratorState.names),
        *(f"power_coefficient_{i + 1}_{j + 1}" for i in range(n) for j in range(m)),
        *(f"sensitivity_{j + 1}_{i + 1}" for j in range(m) for i in range(k)),
        *(f"optimal_gain_{j + 1}" for j in range(m)),
    ]


def power_warnings(x: Float, at: int) -> list[str]:
    """What is to be said at the end of a run."""
    if x[at + p.OVER] < 0.5:
        return []
    rated = x[at + p.GRID_RATING]
    return [f"power control: a reference above rated power was asked for; it was taken as {rated:.4g} W"]


def own_frequency(turbine: AnyTurbine, rotor: RotorTables, inertia: float) -> float:
    """[rad/s] of the speed loop that the turbine's own collective law makes at rated power (C-86a).

    At the pitch where its gains are halved, with the sensitivity that the rotor has there; where the rotor is known at
    one pitch only, in proportion to rated speed as for the NREL 5 MW.
    """
    pitch, rated = turbine.control.pitch, turbine.control.torque.rated_power
    ratio = turbine.drivetrain.gear_ratio
    speed = pitch.reference_speed / ratio
    if len(rotor.pitch) == 1:
        return SPEED_LOOP * speed
    best_ratio, best_power = rotor.best
    optimal = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * best_power / best_ratio**3 * speed**3
    at_share = [np.interp((rated / optimal) ** (1.0 / 3.0), rotor.share, row) for row in rotor.sensitivity]
    slope = float(np.interp(pitch.gain_halving_pitch, rotor.pitch, at_share)) * optimal / speed
    own = math.sqrt(0.5 * pitch.integral_gain * ratio * slope / inertia)
    return min(own, FILTERED * turbine.control.filter_frequency)


def shaft_inertia(turbine: AnyTurbine) -> float:
    """[kg m^2] of blades, hub and generator about the low-speed shaft."""
    if isinstance(turbine, PowerTurbine):
        return turbine.drivetrain.inertia
    hub, drive = turbine.hub, turbine.drivetrain
    _, blade = blade_moments(turbine.blade.structure, hub.radius)
    blades = turbine.n_blades * blade * math.cos(hub.precone) ** 2
    return blades + hub.inertia + drive.gear_ratio**2 * drive.generator_inertia
