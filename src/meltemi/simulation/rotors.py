"""Kinds of rotors, and the interface to them for runs, studies and the command line.

A rotor with blades on a tower and a disk with a power coefficient share controllers, events, winds, channels and
results. The differences are here, once for each kind: another kind is another folder and a line in ``KINDS``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, overload

from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.options import ModelOptions

if TYPE_CHECKING:
    from meltemi.simulation.bladed.rotor import BladedModel
    from meltemi.simulation.channels import Channel
    from meltemi.simulation.disk.rotor import DiskModel
    from meltemi.simulation.operating_point import OperatingPoint
    from meltemi.turbine.definition import Turbine
    from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine
    from meltemi.wind.turbulent import AnyWind

BETZ = 16.0 / 27.0
"""Largest power coefficient in a steady, uniform wind."""
SHORTEST_STEP = 1e-5
"""[s] shortest default time step: with a shorter one a run would seem to hang."""


@dataclass(frozen=True)
class RotorKind:
    """Functions for a kind of rotor.

    Attributes:
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


KINDS = {"Turbine": "meltemi.simulation.kinds.bladed", "PowerTurbine": "meltemi.simulation.kinds.disk"}
"""Modules whose ``KIND`` is that of a class of turbines; a kind is imported with the first of its turbines."""
GROUP = "meltemi.rotors"
"""Entry points of kinds in other packages, by the class of their turbines."""


@cache
def _kind(turbine: Any) -> RotorKind:
    names = [each.__name__ for each in turbine.__mro__]
    if builtin := [name for name in names if name in KINDS]:
        kind: RotorKind = import_module(KINDS[builtin[0]]).KIND
    else:
        from importlib.metadata import entry_points

        kind = next(entry.load() for name in names for entry in entry_points(group=GROUP, name=name))
    return kind


def kind_of(model: Model[Any]) -> RotorKind:
    """The kind of a model's rotor."""
    turbine: Any = type(model.turbine)
    return _kind(turbine)


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
    return _kind(type(turbine)).build(turbine, options, environment)


BY_MOMENTUM = "steady operation is that of momentum theory: a vortex wake that moves develops in runs only"


def without_wake(model: Model[Any]) -> Model[Any]:
    """The model without parts that settle at the start of runs: the momentum balance stands for their wakes."""
    if not any(part.settles for part in model.parts):
        return model
    return replace(model, parts=tuple(part for part in model.parts if not part.settles))


def operating_point(
    model: Model[Any], wind: float | AnyWind, *, rotor_speed: float | None = None, pitch: float | None = None
) -> OperatingPoint:
    """Steady operation of a turbine in steady wind.

    Args:
      wind: wind speed [m/s] at hub height, or a wind; for an unsteady wind its mean.
      rotor_speed: [rad/s]; by default the speed at which the torque balances under the turbine's torque law.
      pitch: [rad]; by default the smallest, or above rated the one that holds the reference speed.

    Returns:
      The operating point; with a wake that settles at the start of runs it is that of the momentum balance, with a
      warning.

    Raises:
      InputError: the wind cannot turn the rotor.
    """
    balanced = without_wake(model)
    point = kind_of(model).operating_point(balanced, wind, rotor_speed=rotor_speed, pitch=pitch)
    if balanced is not model:
        point = replace(point, warnings=(*point.warnings, BY_MOMENTUM))
    speed = point.wind.speed
    available = 0.5 * point["air_density"] * math.pi * model.turbine.rotor_radius**2 * speed**3
    power = point["rotor_aero_torque"] * point.rotor_speed
    if power <= BETZ * available:
        return point
    words = f"at {speed:g} m/s the rotor takes {power / available:.3f} of the wind's power, above Betz's limit of 16/27"
    return replace(point, warnings=(*point.warnings, f"{words}: are the polars right?"))
