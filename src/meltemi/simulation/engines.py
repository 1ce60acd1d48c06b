"""Both kinds of turbines behind one front: what a run, a study or the command line asks of a model.

A model of blades and tower and one of a power coefficient have the same controllers, events, winds, channels and
results; what differs between them is told here, once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, overload

from meltemi.core.errors import InputError
from meltemi.environment.grid import PowerGrid
from meltemi.environment.site import Environment
from meltemi.maths.records import Kind
from meltemi.simulation import modes, trim
from meltemi.simulation.case import BaseCase, Case, Stations
from meltemi.simulation.channels import Channel, catalogue, find
from meltemi.simulation.machine import AnyModel
from meltemi.simulation.model import Model
from meltemi.simulation.model import build as build_aeroelastic
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.power.case import PowerCase
from meltemi.simulation.power.channels import find_power_channel, power_channels
from meltemi.simulation.power.model import PowerModel, build_power
from meltemi.simulation.power.point import power_point
from meltemi.simulation.trim import OperatingPoint
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine
from meltemi.wind.fields import Wind
from meltemi.wind.turbulence.field import AnyWind

LONGEST_STEP = modes.OUTPUT_STEP
SHARE_OF_TIME = 0.1
"""Longest default time step of a turbine of a power coefficient over the time in which rated torque stops it."""
SHORTEST_STEP = 1e-5
"""[s] no shorter time step is taken unasked: a run would seem to hang."""


@dataclass(frozen=True)
class Engine:
    """What a kind of model has.

    Attributes:
      case: its arrays for a run; arguments as for ``Case``.
      time_step: (model) [s], by default; runs take that of :func:`default_step`.
      step_cause: (model) in words, what makes this time step so short.
      channels: (model, stations) all it can record, by name.
      channel: (name, model, channels) one of them.
      operating_point: (model, wind, rotor_speed=, pitch=).
      reach: (turbine) [m] how far the rotor extends up- and downwind of the tower axis.
      brake_inertia: (turbine) [kg m^2] on the generator's shaft, that a brake stops.
      tables: arrays of the model that may change with the turbine's description.
    """

    case: Callable[..., BaseCase]
    time_step: Callable[[Any], float]
    step_cause: Callable[[Any], str]
    channels: Callable[[Any, Stations], dict[str, Channel]]
    channel: Callable[[str, Any, dict[str, Channel]], Channel]
    operating_point: Callable[..., OperatingPoint]
    reach: Callable[[Any], float]
    brake_inertia: Callable[[Any], float]
    tables: tuple[str, ...]


def _aeroelastic_channels(model: Model, stations: Stations) -> dict[str, Channel]:
    return catalogue(
        model.n_blades,
        model.n_nodes,
        len(stations.blade),
        len(stations.tower),
        model.coordinates,
        model.n_flaps,
        model.n_gear_stages,
        model.has_electrical,
    )


def _power_step(model: PowerModel) -> float:
    """[s] a divisor of 0.05 s that is not above these limits."""
    longest = min(_power_limits(model).values())
    return LONGEST_STEP / max(math.ceil(LONGEST_STEP / longest - 1e-9), 1)


def _power_limits(model: PowerModel) -> dict[str, float]:
    """[s] by cause: for torsion as for other machines, for the speed a share of its time under torque."""
    shaft, control = model.turbine.drivetrain, model.turbine.control
    inertia = model.parameter("disk.inertia") + shaft.gear_ratio**2 * model.parameter("structure.generator_inertia")
    speed = control.pitch.reference_speed / shaft.gear_ratio
    cause = f"the rotor has little inertia for its power, drivetrain.rotor_inertia {shaft.rotor_inertia:g} kg m^2"
    limits = {cause: SHARE_OF_TIME * inertia * speed**2 / control.torque.rated_power}
    if shaft.stiffness is not None:
        other = shaft.gear_ratio**2 * shaft.generator_inertia
        frequency = math.sqrt(shaft.stiffness * (1.0 / shaft.rotor_inertia + 1.0 / other))
        cause = (
            f"drivetrain.stiffness {shaft.stiffness:g} N m/rad is large for drivetrain.rotor_inertia "
            f"{shaft.rotor_inertia:g} kg m^2 and drivetrain.generator_inertia {shaft.generator_inertia:g} kg m^2"
        )
        limits[cause] = modes.STEP_LIMIT / frequency
    return limits


def _power_cause(model: PowerModel) -> str:
    limits = _power_limits(model)
    return min(limits, key=limits.__getitem__)


AEROELASTIC = Engine(
    case=Case,
    time_step=modes.time_step,
    step_cause=lambda model: (
        f"coordinate {modes.fastest_coordinate(model)!r} is very stiff for its inertia, with "
        f"{modes.highest_frequency(model):.3g} rad/s"
    ),
    channels=_aeroelastic_channels,
    channel=lambda name, model, available: find(name, available),
    operating_point=trim.operating_point,
    reach=lambda t: t.nacelle.overhang + t.rotor_radius * math.sin(t.hub.precone + t.nacelle.tilt),
    brake_inertia=lambda t: t.drivetrain.generator_inertia,
    tables=tuple(
        "structure blade_nodes blade_edges shape second modal tip_shape tip_second top_shape top_second tower_matrix "
        "tower_weight tower_nodes tower_shape aero aero_nodes polars section tower_flow actuators electrical".split()
    ),
)
POWER = Engine(
    case=PowerCase,
    time_step=_power_step,
    step_cause=_power_cause,
    channels=lambda model, stations: power_channels(model),
    channel=lambda name, model, available: find_power_channel(name, model, available),
    operating_point=power_point,
    reach=lambda t: 0.0,
    brake_inertia=lambda t: t.drivetrain.inertia / t.drivetrain.gear_ratio**2,
    tables=("structure", "aero", "disk", "coefficient", "values", "actuators", "electrical"),
)


def engine_of(model: AnyModel) -> Engine:
    """The engine of a model."""
    return POWER if isinstance(model, PowerModel) else AEROELASTIC


def default_step(model: AnyModel) -> float:
    """Time step [s] of a run: that of the options, else the engine's.

    Raises:
      InputError: the engine's is so short that runs would seem to hang.
    """
    if model.options.time_step is not None:
        return model.options.time_step
    engine = engine_of(model)
    dt = engine.time_step(model)
    if dt < SHORTEST_STEP:
        raise InputError(
            f"{model.turbine.name}: its time step would be {dt:.2g} s, {1.0 / dt:.2g} steps for each second of a run: "
            f"{engine.step_cause(model)}; check these values, or set options.time_step"
        )
    return dt


@overload
def build(turbine: Turbine, options: ModelOptions | None = None, environment: Environment | None = None) -> Model: ...
@overload
def build(
    turbine: PowerTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> PowerModel: ...
@overload
def build(
    turbine: AnyTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> Model | PowerModel: ...
def build(
    turbine: AnyTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> Model | PowerModel:
    """Make a model of a turbine.

    Raises:
      UnsupportedError: the turbine or the options ask for something that is not modelled.
      InputError: options name something that does not exist, or concern what the turbine does not have, or modes
        cannot be computed.
    """
    if isinstance(turbine, PowerTurbine):
        return build_power(turbine, options, environment)
    return build_aeroelastic(turbine, options, environment)


def new_case(
    model: AnyModel,
    wind: Wind,
    stations: Stations | None = None,
    *,
    numbers: Kind = "lanes",
    grid: PowerGrid | None = None,
) -> BaseCase:
    """Arrays of one simulation of a model in a wind."""
    return engine_of(model).case(model, wind, stations, numbers=numbers, grid=grid)


def operating_point(
    model: AnyModel, wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation of a turbine in steady wind.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; of an unsteady wind the mean is taken.
      rotor_speed: [rad/s]; by default where torque balances under the turbine's torque law.
      pitch: [rad]; by default the smallest, or above rated the one that holds the reference speed.

    Raises:
      InputError: the wind cannot turn the rotor.
    """
    return engine_of(model).operating_point(model, wind, rotor_speed=rotor_speed, pitch=pitch)
