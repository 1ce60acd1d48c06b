"""Equilibrium of parked and idling rotors, and of rotors at a prescribed speed: initial states of parked runs.

A rotor at standstill is in equilibrium: with settled inflow and stall, only the generator may have an acceleration,

    a_j(q) = 0   for all free j but the generator,

and a free generator accelerates under the residual torque. A rotating rotor has the periodic motion of
:mod:`meltemi.simulation.trim`. A released rotor comes to rest at the first azimuth at which its torque falls through
zero or, if there is none, idles at the first speed at which the mean torque balances.

Reference: docs/theory/simulation.md (M-16a, M-16b).
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.continuation import CarefulOrbit, in_steps
from meltemi.analyses.modes import growing
from meltemi.core.errors import InputError
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.bladed.rotor import BladedModel, channels_at_instants, with_blades, with_static_gears
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import NotConverged, OperatingPoint, steady_wind
from meltemi.simulation.orbit import FARTHEST, FULL, SETTLED
from meltemi.simulation.start import set_actuators
from meltemi.simulation.step import equations
from meltemi.simulation.trim import root
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import AnyWind

Float = NDArray[np.float64]
Idling = Literal["idling"]

SLOWEST, FASTEST, FASTER = 2e-3, 1.3, 1.6
"""Idling speeds over the reference speed, smallest and largest, and the ratio of successive trial speeds."""
SPACING = np.pi / 18.0
"""[rad] spacing of the azimuths at which the torque of a rotor at rest is evaluated."""
STEPS = 40
PERTURBATION = 1e-4
"""[m or rad] perturbation for finite differences."""
EXACT = 1e-10
"""Largest correction over the rotor radius at which a turbine at standstill is in equilibrium."""


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
    """Equilibrium of a turbine at standstill or at a given rotor speed without control, to start a run or for mean
    loads.

    A rotor at rest stays at rest if its generator is locked (options); a free one accelerates smoothly from rest under
    the torque ``imbalance``.

    wind: wind speed [m/s] at hub height, or a wind; for an unsteady wind its mean. Its ``direction`` is the
      yaw misalignment.
        rotor_speed: [rad/s], 0 at rest; ``"idling"`` releases the rotor: it comes to rest at the next azimuth at which
          its torque balances, if there is one, else it rotates at the speed at which the mean torque balances.
      pitch: [rad] pitch angle of all blades; by default feather, the largest pitch of the actuator.
      azimuth: [rad] azimuth of blade 1.
      generator_torque: [N m] generator torque.

    Raises:
      InputError: there is no equilibrium, or the rotor runs away instead of idling.
      UnsupportedError: the turbine is a power-coefficient turbine.
    """
    model = with_blades(model, "parked_point")
    steady = steady_wind(wind, model.turbine.hub_height)
    angle = model.turbine.pitch_actuator.maximum if pitch is None else pitch
    orbit = CarefulOrbit(model, steady)
    orbit.level = FULL
    if rotor_speed == "idling":
        if model.locked[model.rows.generator] > 0.0:
            raise InputError('parked_point: rotor_speed "idling" needs a generator that is not locked (options.locked)')
        standing, way = _rest_azimuth(model, steady, angle, azimuth, generator_torque)
        if standing is not None:
            return standing
        _idle(orbit, way, angle, generator_torque)
    elif rotor_speed == 0.0:
        return _stand(model, steady, angle, azimuth, generator_torque)
    else:
        orbit.sweep(float(rotor_speed), angle, generator_torque)
    unstable = orbit.unstable()
    return orbit.finish(azimuth, (f"the turning rotor is unstable: {unstable}",) if unstable else ())


@one_blas_thread
def standing_point(model: BladedModel, wind: SteadyWind, pitch: float, azimuth: float) -> OperatingPoint:
    """Equilibrium at standstill without a check of its stability; arguments and errors as for :func:`parked_point`."""
    return _stand(model, wind, pitch, azimuth, 0.0, judged=False)


def _rest_azimuth(
    model: BladedModel, wind: SteadyWind, pitch: float, azimuth: float, torque: float
) -> tuple[OperatingPoint | None, float]:
    """Azimuth at which a free rotor, released at an azimuth, comes to rest, if any, and its sense of rotation.

    Feathered blades damp the rotor's motion so strongly that it creeps to where its torque at rest falls through zero.
    """

    def left_over(x: float) -> float:
        return way * _stand(model, wind, pitch, azimuth + way * x, torque, False).imbalance

    way = 1.0
    if left_over(0.0) < 0.0:
        way = -1.0
    before = 0.0
    sector = 2.0 * np.pi / (model.n_blades if model.turbine.blades_alike else 1)
    for x in np.arange(1.0, sector / SPACING + 0.5) * SPACING:
        if left_over(x) <= 0.0:
            rest = azimuth + way * root(left_over, before, x, x - before)
            return _stand(model, wind, pitch, float(rest % (2.0 * np.pi)), torque), way
        before = x
    return None, way


def _idle(orbit: CarefulOrbit, way: float, pitch: float, torque: float) -> None:
    """Bring an orbit to the speed, in one sense of rotation, at which its mean torque balances."""
    model, wind = orbit.model, orbit.wind
    reference = model.turbine.rated_rotor_speed

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
    """Equilibrium at standstill; with ``judged``, its stability is checked."""
    case = Case(with_static_gears(model), wind)
    set_actuators(case, pitch, torque)
    case.control.drive.yaw_held = 1.0
    generator = model.rows.generator
    q, radius = case["q"], model.turbine.rotor_radius
    q[generator] = azimuth
    free = np.flatnonzero((case["locked"] == 0.0) & (np.arange(len(q)) != generator))
    density = float(case.plain.aero.air_density)

    def accelerations() -> Float:
        case.settle(0.0)
        return np.array(case["a"][free])

    def balanced(share: float) -> bool:
        """Newton's method with a fraction of the air density."""
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
            f"{np.degrees(pitch):.3g} deg: the wind deflects blades or tower beyond the validity of second-order "
            "displacements; use less wind, another pitch angle, or fewer modes (options)"
        )
    unstable = growing(case) if judged else ""
    case.settle(0.0)
    case.begin_parts()
    case.loads(0.0)
    equations(0.0, 0.0, case.system)  # with all forces applied
    left_over = float(case["core_force"][generator])
    channels = channels_at_instants(model)
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
        aero=case.aero_states(),
        revolution=np.concatenate([state, case["v"], case.aero_states()])[None],
        means=case.signals.vector.copy(),
        channels=channels,
        places={name: case.place(channel) for name, channel in channels.items()},
        warnings=(f"the parked rotor is unstable: {unstable}",) if unstable else (),
        azimuth=azimuth,
    )
