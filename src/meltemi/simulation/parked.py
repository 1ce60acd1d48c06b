"""Rotors that stand, idle or turn at a given speed, in equilibrium with wind and weight: where parked runs begin.

A standing rotor is at rest: with settled air, no coordinate but the generator's is accelerated,

    a_j(q) = 0   for all free j but the generator,

and a free generator takes the rotor with it as the torque that is left over has it. A turning rotor has the periodic
motion of :mod:`meltemi.simulation.trim`. A rotor that is let go comes to rest at the first azimuth at which its torque
falls through zero, or, where there is none, idles at the first speed at which the mean torque balances.

Reference: docs/theory/simulation.md (M-16a, M-16b).
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.control.baseline import parameters
from meltemi.core.errors import InputError
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.bladed.rotor import BladedModel, with_blades, with_static_gears
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.modes import growing
from meltemi.simulation.start import hold
from meltemi.simulation.step import equations
from meltemi.simulation.trim import (
    FARTHEST,
    FULL,
    SETTLED,
    CarefulOrbit,
    NotConverged,
    OperatingPoint,
    channels_of,
    in_steps,
    root,
    steady_wind,
)
from meltemi.structure.kinematics import GENERATOR
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulence.field import AnyWind

Float = NDArray[np.float64]
Idling = Literal["idling"]

SLOWEST, FASTEST, FASTER = 2e-3, 1.3, 1.6
"""Shares of the reference speed between which a rotor idles, and the ratio of two that are tried."""
SPACING = np.pi / 18.0
"""[rad] between azimuths at which the torque of a rotor at rest is looked at."""
STEPS = 40
PERTURBATION = 1e-4
"""[m or rad]."""
EXACT = 1e-10
"""Correction, as a share of the rotor's radius, at which a standing machine is in equilibrium."""


@one_blas_thread
def parked_point(
    model: Model[Any],
    wind: float | AnyWind,
    *,
    rotor_speed: float | Idling = 0.0,
    pitch: float | None = None,
    azimuth: float = 0.0,
    generator_torque: float = 0.0,
) -> OperatingPoint:
    """Equilibrium of a machine whose rotor stands or turns without control, to start a run in or for its mean loads.

    A rotor at rest whose generator is locked (options) stays there; a free one sets off smoothly, under the torque
    that ``imbalance`` tells.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; of an unsteady wind the mean is taken. Its ``direction`` is the
        error of the yaw.
      rotor_speed: [rad/s], 0 at rest; ``"idling"`` lets the rotor go: it comes to rest at the next azimuth at which
        its torque balances, if there is one, else it turns at the speed at which the mean torque does.
      pitch: [rad] of all blades; by default the pitch actuator's largest, feathered.
      azimuth: [rad] of blade 1.
      generator_torque: [N m].

    Raises:
      InputError: there is no equilibrium, or the rotor runs away instead of idling.
      UnsupportedError: a turbine of a power coefficient.
    """
    model = with_blades(model, "parked_point")
    steady = steady_wind(wind, model.turbine.hub_height)
    angle = model.turbine.pitch_actuator.maximum if pitch is None else pitch
    orbit = CarefulOrbit(model, steady)
    orbit.level = FULL
    if rotor_speed == "idling":
        if model.locked[len(model.rotor.tower.names) + GENERATOR] > 0.0:
            raise InputError('parked_point: rotor_speed "idling" needs a generator that is not locked (options.locked)')
        standing, way = _swing_out(model, steady, angle, azimuth, generator_torque)
        if standing is not None:
            return standing
        _idle(orbit, way, angle, generator_torque)
    elif rotor_speed == 0.0:
        return _stand(model, steady, angle, azimuth, generator_torque)
    else:
        orbit.sweep(float(rotor_speed), angle, generator_torque)
    unstable = orbit.unstable()
    return orbit.finish(azimuth, (f"the turning rotor is unstable: {unstable}",) if unstable else ())


def _swing_out(
    model: BladedModel, wind: SteadyWind, pitch: float, azimuth: float, torque: float
) -> tuple[OperatingPoint | None, float]:
    """Where a free rotor comes to rest that is let go at an azimuth, if anywhere, and the sense in which it turns.

    Feathered blades damp the rotor's motion so much that it creeps to where its torque at rest falls through zero.
    """

    def left_over(x: float) -> float:
        return way * _stand(model, wind, pitch, azimuth + way * x, torque, False).imbalance

    way = 1.0
    if left_over(0.0) < 0.0:
        way = -1.0
    before = 0.0
    icing = model.turbine.icing
    alike = icing is None or len(icing.on(model.n_blades)) == model.n_blades
    sector = 2.0 * np.pi / (model.n_blades if alike else 1)
    for x in np.arange(1.0, sector / SPACING + 0.5) * SPACING:
        if left_over(x) <= 0.0:
            rest = azimuth + way * root(left_over, before, x, x - before)
            return _stand(model, wind, pitch, float(rest % (2.0 * np.pi)), torque), way
        before = x
    return None, way


def _idle(orbit: CarefulOrbit, way: float, pitch: float, torque: float) -> None:
    """Bring an orbit to the speed, in one sense or the other, at which its mean torque balances."""
    model, wind = orbit.model, orbit.wind
    reference = float(parameters(model.turbine.control).reference_speed) / model.turbine.drivetrain.gear_ratio

    def drives(x: float) -> float:
        return way * orbit.sweep(way * x, pitch, torque)

    speed = SLOWEST * reference
    if drives(speed) <= 0.0:
        return
    while drives(FASTER * speed) > 0.0:
        speed *= FASTER
        if speed > FASTEST * reference:
            raise InputError(
                f"no idling at a wind speed of {wind.speed:g} m/s and a pitch of {np.degrees(pitch):.3g} deg: the wind "
                f"drives the rotor beyond {30.0 / np.pi * way * speed:.3g} rpm; take a pitch closer to feather, or "
                "give a rotor_speed"
            )
    drives(root(drives, speed, FASTER * speed, (FASTER - 1.0) * speed))


def _stand(
    model: BladedModel, wind: SteadyWind, pitch: float, azimuth: float, torque: float, judged: bool = True
) -> OperatingPoint:
    """Equilibrium at rest, ``judged`` for its stability."""
    case = Case(with_static_gears(model), wind)
    hold(case, pitch, torque)
    case.control.drive.yaw_held = 1.0
    generator = len(model.rotor.tower.names) + GENERATOR
    q, radius = case["q"], model.turbine.rotor_radius
    q[generator] = azimuth
    free = np.flatnonzero((case["locked"] == 0.0) & (np.arange(len(q)) != generator))
    density = float(case.plain.aero.air_density)

    def accelerations() -> Float:
        case.settle(0.0)
        return np.array(case["a"][free])

    def balanced(share: float) -> bool:
        """Newton's method in a share of the air's density."""
        case.plain.aero.air_density = share * density
        moved = 0.0
        for _ in range(STEPS):
            base = accelerations()
            J = np.empty((len(free), len(free)))
            for column, j in enumerate(free):
                q[j] += PERTURBATION
                J[:, column] = (accelerations() - base) / PERTURBATION
                q[j] -= PERTURBATION
            if not np.all(np.isfinite(J)):
                return False
            change = np.linalg.lstsq(J, base, rcond=1e-12)[0]
            moved = float(np.max(np.abs(change), initial=0.0))
            q[free] -= change * min(1.0, FARTHEST * radius / max(moved, 1e-30))
            if moved < EXACT * radius:
                return True
        return moved < SETTLED * radius

    if in_steps(balanced, [q, case.aero_state.vector]) < 1.0:
        raise NotConverged(
            f"parked_point: no equilibrium at rest in a wind of {wind.speed:g} m/s at a pitch of "
            f"{np.degrees(pitch):.3g} deg: the wind bends blades or tower beyond what displacements of second order "
            "hold for; take less wind, another pitch, or fewer modes (options)"
        )
    unstable = growing(case) if judged else ""
    case.settle(0.0)
    case.begin_electric()
    case.loads(0.0)
    equations(0.0, 0.0, case.system)  # with the forces in place
    left_over = float(case["core_force"][generator])
    channels = channels_of(model)
    state = case["q"].copy()
    state[generator] -= azimuth
    return OperatingPoint(
        wind=wind,
        rotor_speed=0.0,
        pitch=pitch,
        generator_speed=0.0,
        generator_torque=torque,
        imbalance=left_over,
        q=state,
        v=case["v"].copy(),
        aero=case.air(),
        revolution=np.concatenate([state, case["v"], case.air()])[None],
        means=case.signals.vector.copy(),
        channels=channels,
        places={name: case.place(channel) for name, channel in channels.items()},
        warnings=(f"the standing rotor is unstable: {unstable}",) if unstable else (),
        azimuth=azimuth,
    )
