"""Steady operation of a power-coefficient turbine: roots of the torque balance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from meltemi.aero.coefficient import RotorCoefficient, known
from meltemi.control.baseline import parameters, steady_torque
from meltemi.core.errors import InputError
from meltemi.simulation.case import Case
from meltemi.simulation.disk.channels import disk_channels
from meltemi.simulation.disk.rotor import DiskModel
from meltemi.simulation.operating_point import NotConverged, OperatingPoint, check_prescribed, no_balance, steady_wind
from meltemi.simulation.start import set_actuators
from meltemi.structure.equations import GENERATOR, TORSION
from meltemi.turbine.power_turbine import PowerTurbine
from meltemi.wind.turbulent import AnyWind

SCAN = 61
"""Number of rotor speeds, from a tenth of the reference speed up to it, at which the torque balance is evaluated."""


def disk_point(
    model: DiskModel, wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation in steady wind; arguments and errors as for ``operating_point``."""
    turbine = model.turbine
    steady = steady_wind(wind, turbine.hub_height)
    check_prescribed("operating_point", turbine, rotor_speed, pitch)
    case, coefficient = Case(model, steady), RotorCoefficient(model.rotor.coefficient)
    law, control, ratio = parameters(turbine.control), turbine.control, turbine.drivetrain.gear_ratio
    reference = turbine.rated_rotor_speed
    rotor, friction = case.view("rotor"), turbine.drivetrain.friction

    def left_over(speed: float, angle: float) -> float:
        """Residual torque [N m]."""
        torque = float(steady_torque(law, ratio * speed, angle))
        set_actuators(case, angle, torque)
        case["v"][GENERATOR] = speed
        case.evaluate(0.0)
        return float(rotor["torque"]) - friction * speed - ratio * torque

    angle = control.pitch.minimum if pitch is None else pitch
    if rotor_speed is None and model.locked[GENERATOR] > 0.0:
        rotor_speed = reference
    if rotor_speed is None:
        rotor_speed, angle = _balance(left_over, case, turbine, steady.speed, angle, may_pitch=pitch is None)
    imbalance = left_over(rotor_speed, angle)
    if not known(float(rotor["tip_ratio"]), angle, coefficient):
        where = f"it runs at a tip-speed ratio of {float(rotor['tip_ratio']):.2f}"
        raise _unknown(turbine, steady.speed, f"{where} and a pitch of {math.degrees(angle):.2f} degrees")
    if turbine.drivetrain.stiffness is not None:
        # without acceleration the shaft carries the driving torque of the rotor
        case["q"][TORSION] = (float(rotor["torque"]) - friction * rotor_speed) / turbine.drivetrain.stiffness
        case.evaluate(0.0)
    case.control.drive.generator_torque = torque_demand = float(steady_torque(law, ratio * rotor_speed, angle))
    case.begin_parts()
    imbalance += ratio * (
        torque_demand - float(case.control.drive.generator_torque)
    )  # the torque that the generator cannot deliver is left
    case.loads(0.0)
    q, v = case["q"].copy(), case["v"].copy()
    channels = disk_channels(model)
    return OperatingPoint(
        wind=steady,
        rotor_speed=rotor_speed,
        pitch=angle,
        generator_speed=ratio * rotor_speed,
        generator_torque=torque_demand,
        imbalance=imbalance,
        q=q,
        v=v,
        aero=np.zeros(0),
        revolution=np.concatenate([q, v])[None],
        means=case.signals.vector.copy(),
        channels=channels,
        places={name: case.place(channel) for name, channel in channels.items()},
    )


def _balance(
    left_over: Callable[[float, float], float],
    case: Case,
    turbine: PowerTurbine,
    wind_speed: float,
    angle: float,
    *,
    may_pitch: bool,
) -> tuple[float, float]:
    """Rotor speed [rad/s] at which the torques balance, and pitch [rad]; errors as for ``operating_point``."""
    from scipy.optimize import brentq

    reference, most = turbine.rated_rotor_speed, turbine.control.pitch.maximum
    speeds = reference * np.linspace(0.1, 1.0, SCAN)
    lefts = [left_over(float(speed), angle) for speed in speeds]
    falling = [i for i in range(SCAN - 1) if lefts[i] > 0.0 >= lefts[i + 1]]
    if lefts[-1] > 0.0 and may_pitch:
        coefficient = RotorCoefficient(case.model.rotor.coefficient)
        if not known(float(case.view("rotor")["tip_ratio"]), most, coefficient):
            raise _unknown(turbine, wind_speed, "it would have to pitch")
        if left_over(reference, most) > 0.0:
            raise NotConverged(
                f"no steady operation at a wind speed of {wind_speed:g} m/s: at its largest pitch of "
                f"{math.degrees(most):g} degrees {turbine.name} still produces more than rated power; "
                "increase control.pitch.maximum or reduce the wind speed"
                + f" (its cut_out is {turbine.cut_out:g} m/s)"
                * (wind_speed > turbine.cut_out)
            )
        return reference, float(brentq(lambda x: left_over(reference, x), angle, most, xtol=1e-13))
    if lefts[-1] > 0.0:
        return reference, angle
    if falling:
        low, high = float(speeds[falling[-1]]), float(speeds[falling[-1] + 1])
        return float(brentq(lambda x: left_over(x, angle), low, high, xtol=1e-13)), angle
    left_over(float(speeds[int(np.argmax(lefts))]), angle)
    loss, kept = (float(case.view("disk_flow")[name]) for name in ("rain_loss", "aerodynamic_power"))
    rain = f"; rain takes {100.0 * loss / (loss + kept):.0f} % of the rotor's power" if loss > 0.0 else ""
    raise no_balance(wind_speed, rain)


def _unknown(turbine: PowerTurbine, speed: float, where: str) -> InputError:
    return InputError(
        f"{turbine.name}: at a wind speed of {speed:g} m/s {where}, where its {turbine.coefficient.kind!r} coefficient "
        "is not known; take another model of the coefficient"
    )
