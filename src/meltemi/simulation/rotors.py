"""Kinds of rotors, and the interface to them for runs, studies and the command line.

A rotor with blades on a tower and a disk with a power coefficient share controllers, events, winds, channels and
results. The differences are here, once for each kind: another kind is a folder of its own and an entry in ``KINDS``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, overload

from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.simulation import modes, trim
from meltemi.simulation.bladed.build import build_bladed
from meltemi.simulation.bladed.rotor import BladedModel, BladedRotor
from meltemi.simulation.channels import Channel, catalogue, find
from meltemi.simulation.disk.channels import disk_channels, find_disk_channel
from meltemi.simulation.disk.point import disk_point
from meltemi.simulation.disk.rotor import DiskModel, DiskRotor, build_disk
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.trim import OperatingPoint
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine
from meltemi.wind.turbulence.field import AnyWind

LONGEST_STEP = modes.OUTPUT_STEP
SHARE_OF_TIME = 0.1
"""Longest default time step of a power-coefficient turbine over the time in which rated torque stops its rotor."""
SHORTEST_STEP = 1e-5
"""[s] shortest default time step: with a shorter one a run would seem to hang."""


@dataclass(frozen=True)
class RotorKind:
    """Functions for a kind of rotor.

    Attributes:
      turbine: class of its turbines.
      build: (turbine, options, environment) -> the model.
      time_step: (model) -> [s] default of this kind of rotor; :func:`default_step` has that of a run.
      step_weights: (model, time step) -> (2, n) of the coordinates that take implicit steps, see ``StepWeights``.
      step_cause: (model) -> reason for a very short time step.
      channels: (model, stations) -> all channels, by name.
      channel: (name, model, channels) -> one channel.
      operating_point: (model, wind, rotor_speed=, pitch=) -> steady operation.
      reach: (turbine) -> [m] how far the rotor extends up- and downwind of the tower axis.
      brake_inertia: (turbine) -> [kg m^2] inertia that a brake stops, on the generator's shaft.
      tables: arrays of the model that may differ between descriptions of a turbine.
    """

    turbine: type
    build: Callable[..., Model[Any]]
    time_step: Callable[[Any], float]
    step_weights: Callable[[Any, float], Any]
    step_cause: Callable[[Any], str]
    channels: Callable[[Any, Stations], dict[str, Channel]]
    channel: Callable[[str, Any, dict[str, Channel]], Channel]
    operating_point: Callable[..., OperatingPoint]
    reach: Callable[[Any], float]
    brake_inertia: Callable[[Any], float]
    tables: tuple[str, ...]


def _bladed_channels(model: BladedModel, stations: Stations) -> dict[str, Channel]:
    return catalogue(
        model.n_blades,
        model.rotor.n_nodes,
        len(stations.blade),
        len(stations.tower),
        model.coordinates,
        model.n_flaps,
        model.rotor.gear_stages,
        model.has_electrical,
    )


def _disk_step(model: DiskModel) -> float:
    """[s] largest fraction of 0.05 s that does not exceed these limits."""
    longest = min(_disk_limits(model).values())
    return LONGEST_STEP / max(math.ceil(LONGEST_STEP / longest - 1e-9), 1)


def _disk_limits(model: DiskModel) -> dict[str, float]:
    """[s] by cause: for torsion as for other turbines, for the speed a fraction of its time under torque."""
    shaft, control = model.turbine.drivetrain, model.turbine.control
    inertia = model.parameter("disk.inertia") + shaft.gear_ratio**2 * model.parameter("structure.generator_inertia")
    speed = model.turbine.rated_rotor_speed
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


def _disk_cause(model: DiskModel) -> str:
    limits = _disk_limits(model)
    return min(limits, key=limits.__getitem__)


BLADED = RotorKind(
    turbine=Turbine,
    build=build_bladed,
    time_step=modes.time_step,
    step_weights=modes.step_weights,
    step_cause=lambda model: (
        f"coordinate {modes.fastest_coordinate(model)!r} is very stiff for its inertia, with "
        f"{modes.highest_frequency(model):.3g} rad/s"
    ),
    channels=_bladed_channels,
    channel=lambda name, model, available: find(name, available),
    operating_point=trim.operating_point,
    reach=lambda t: t.nacelle.overhang + t.rotor_radius * math.sin(t.hub.precone + t.nacelle.tilt),
    brake_inertia=lambda t: t.drivetrain.generator_inertia,
    tables=tuple(
        "structure blade_nodes blade_edges shape second modal tip_shape tip_second top_shape top_second tower_matrix "
        "tower_weight tower_nodes tower_shape aero aero_nodes polars section tower_flow actuators electrical".split()
    ),
)
DISK = RotorKind(
    turbine=PowerTurbine,
    build=build_disk,
    time_step=_disk_step,
    step_weights=lambda model, dt: 0.0,
    step_cause=_disk_cause,
    channels=lambda model, stations: disk_channels(model),
    channel=find_disk_channel,
    operating_point=disk_point,
    reach=lambda t: 0.0,
    brake_inertia=lambda t: t.drivetrain.inertia / t.drivetrain.gear_ratio**2,
    tables=("structure", "aero", "disk", "coefficient", "values", "actuators", "electrical"),
)


KINDS: dict[type, RotorKind] = {BladedRotor: BLADED, DiskRotor: DISK}
"""Kinds by the class of a model's rotor."""


def kind_of(model: Model[Any]) -> RotorKind:
    """The kind of a model's rotor."""
    return KINDS[type(model.rotor)]


def default_step(model: Model[Any]) -> float:
    """Time step [s] of a run: that of the options, or the default of its kind of rotor.

    Raises:
      InputError: the default is too short for runs of useful length.
    """
    if model.options.time_step is not None:
        return model.options.time_step
    kind = kind_of(model)
    dt = kind.time_step(model)
    if dt < SHORTEST_STEP:
        raise InputError(
            f"{model.turbine.name}: its time step would be {dt:.2g} s, {1.0 / dt:.2g} steps for each second of a run: "
            f"{kind.step_cause(model)}; check these values, or set options.time_step"
        )
    return dt


@overload
def build(
    turbine: Turbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> BladedModel: ...
@overload
def build(
    turbine: PowerTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> DiskModel: ...
@overload
def build(
    turbine: AnyTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> Model[Any]: ...
def build(
    turbine: AnyTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> Model[Any]:
    """Make a model of a turbine.

    Raises:
      UnsupportedError: the turbine or the options request a feature that is not modelled.
      InputError: an option names an unknown coordinate or concerns a component that the turbine does not have, or modes
        cannot be computed.
    """
    kind = next(kind for kind in KINDS.values() if isinstance(turbine, kind.turbine))
    return kind.build(turbine, options, environment)


def operating_point(
    model: Model[Any], wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation of a turbine in steady wind.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; for an unsteady wind its mean.
      rotor_speed: [rad/s]; by default the speed at which the torque balances under the turbine's torque law.
      pitch: [rad]; by default the smallest, or above rated the one that holds the reference speed.

    Raises:
      InputError: the wind cannot turn the rotor.
    """
    return kind_of(model).operating_point(model, wind, rotor_speed=rotor_speed, pitch=pitch)
