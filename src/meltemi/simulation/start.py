"""Initial conditions of runs that do not begin in steady operation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from meltemi.compiler import kernel
from meltemi.core.errors import InputError, did_you_mean
from meltemi.simulation.case import Case
from meltemi.simulation.system import System
from meltemi.turbine.imbalance import deviations

GEAR_SWEEPS = 8
"""Number of sweeps; each reduces the residual by the gears' fraction of the inertia of rotor and generator."""


@kernel
def settle_gears(m: System) -> None:
    """Set the modes of a gearbox to their static deflection under the present accelerations."""
    for k in range(m.gears.modes):
        w = m.gear_modes.frequency[k]
        m.gears.angle[k] += m.gears.acceleration[k] / (w * w)


@dataclass(frozen=True)
class Start:
    """Initial conditions. Inflow and stall start in their steady state.

    A run begins with the deflections of mean wind, gravity and rotation (``parked_point``), unless coordinates or
    velocities are named: then those not named are zero. ``coordinates={}`` begins undeflected.

    Attributes:
      rotor_speed: [rad/s]; ``"idling"`` is the speed at which the mean torque balances.
      pitch: [rad] pitch angle of all blades.
      generator_torque: [N m] generator torque.
      coordinates, velocities: values by the names in ``Model.coordinates``, in m, rad, m/s and rad/s; those of a
        platform are also ``platform_surge`` to ``platform_yaw``, as its channels.
      azimuth: [rad] azimuth of blade 1.
    """

    rotor_speed: float | Literal["idling"] = 0.0
    pitch: float = 0.0
    generator_torque: float = 0.0
    coordinates: Mapping[str, float] | None = None
    velocities: Mapping[str, float] = field(default_factory=dict)
    azimuth: float = 0.0

    def put(self, case: Case) -> None:
        """Write the initial conditions into a case, with settled inflow and stall; errors as of :meth:`set`."""
        self.set(case)
        case.settle(0.0)

    def set(self, case: Case) -> None:
        """Write the initial conditions into a case.

        Raises:
          InputError: a coordinate is unknown.
        """
        names = case.model.coordinates
        set_actuators(case, self.pitch, self.generator_torque)
        placed = {"yaw": case.model.options.nacelle_yaw} | dict(self.coordinates or {})
        for array, values in (("q", placed), ("v", self.velocities)):
            case[array][:] = 0.0
            for given, value in values.items():
                name = given.replace("platform_", "base ", 1)
                if name not in names:
                    raise InputError(f"start: no coordinate {given!r}: {did_you_mean(name, names)}")
                case[array][names.index(name)] = value
        generator = case.model.rows.generator
        case["q"][generator] += self.azimuth
        assert self.rotor_speed != "idling", "points.initial_state determines that speed"
        case["v"][generator] += self.rotor_speed


def set_actuators(case: Case, pitch: float, torque: float) -> None:
    """Set actuators and demands to a pitch angle and a generator torque, with zero rates.

    Raises:
      InputError: the pitch is beyond half a turn.
    """
    if not abs(pitch) <= math.pi:
        raise InputError(f"pitch {pitch:g} rad is not between -pi and pi; from degrees: math.radians")
    case["pitch"][:] = 0.0
    case.view("pitch")["angle"] = pitch + deviations(case.model.turbine, "pitch")
    case.control.drive.generator_torque = torque
    case["gears"][:] = 0.0
    demands = case.control.demands
    demands.array[:] = 0.0
    demands.generator_torque = torque
    for blade in range(case.model.n_blades):
        demands.pitch[blade] = pitch


def begin(case: Case) -> None:
    """Evaluate all quantities at time 0 after the state was set, as the first step needs them."""
    for _ in range(GEAR_SWEEPS if case["gears"].size else 1):
        case.evaluate(0.0)
        if "gear_modes" in case.arrays:  # independent of the number of modes: no further compilation
            settle_gears(case.system)
    case.loads(0.0)
    case.v_old[:], case.a_old[:] = case["v"], case["a"]
