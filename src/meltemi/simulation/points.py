"""Initial states of runs, computed once: runs of one model in winds with the same mean share one."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from importlib import import_module
from typing import Any

from meltemi.simulation.bladed.rotor import BladedModel, BladedRotor
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import NotConverged, OperatingPoint, steady_wind
from meltemi.simulation.rotors import operating_point, without_wake
from meltemi.simulation.start import Start
from meltemi.wind.fields import SteadyWind, Wind

KEEP = 32
"""Number of points in the cache, least recently used dropped first."""

_LOCK = threading.Lock()
_POINTS: OrderedDict[tuple[str, ...], Future[OperatingPoint]] = OrderedDict()
State = OperatingPoint | Start


def initial_state(model: Model[Any], wind: Wind, start: State | None = None) -> tuple[State, tuple[str, ...]]:
    """State in which a run begins, and warnings about it.

    Without a start it is steady operation; if there is none, that of the rigid turbine, or of a power-coefficient
    turbine at its reference speed. Initial conditions that name neither coordinates nor velocities are completed to an
    equilibrium; if there is none they are used as given. Wakes that settle at the start are left out before it.

    Raises:
      InputError: as ``operating_point`` if the wind does not turn the rotor, and as ``parked_point`` if an idling
        rotor runs away.
    """
    model = without_wake(model)
    try:
        if start is None:
            initial_point = shared_point(model, wind)
        elif isinstance(start, OperatingPoint):
            initial_point = start
        elif isinstance(model.rotor, BladedRotor) and start.coordinates is None and not start.velocities:
            initial_point = _parked(model, wind, start)
        else:
            return _at_rest(start), ()
        return initial_point, initial_point.warnings
    except NotConverged as error:
        words = (f"the run begins undeflected, with an initial transient: {error}",)
        if isinstance(start, Start):
            return _at_rest(start), words
        if isinstance(model.rotor, BladedRotor):
            from meltemi.simulation.trim import rigid_point

            return _once(model, wind, ("rigid",), lambda steady: rigid_point(model, steady)), words
        speed, most = model.turbine.rated_rotor_speed, model.turbine.control.pitch.maximum
        point = _once(
            model, wind, ("held",), lambda steady: operating_point(model, steady, rotor_speed=speed, pitch=most)
        )
        return point, (f"the run begins out of balance, at its reference speed and largest pitch: {error}",)


def _at_rest(start: Start) -> Start:
    """The initial conditions with the rotor at rest instead of idling."""
    return replace(start, rotor_speed=0.0) if start.rotor_speed == "idling" else start


def shared_point(model: Model[Any], wind: Wind) -> OperatingPoint:
    """The operating point in which a run begins; concurrent threads wait for the first computation of the same one.

    Raises:
      InputError: as ``operating_point``.
    """
    return _once(model, wind, (), lambda steady: operating_point(model, steady))


def _parked(model: BladedModel, wind: Wind, start: Start) -> OperatingPoint:
    def make(steady: SteadyWind) -> OperatingPoint:
        point: OperatingPoint = import_module("meltemi.analyses.parked").parked_point(
            model,
            steady,
            rotor_speed=start.rotor_speed,
            pitch=start.pitch,
            azimuth=start.azimuth,
            generator_torque=start.generator_torque,
        )
        return point

    return _once(model, wind, (repr(start),), make)


def _once(
    model: Model[Any], wind: Wind, kind: tuple[str, ...], make: Callable[[SteadyWind], OperatingPoint]
) -> OperatingPoint:
    steady = steady_wind(wind, model.turbine.hub_height)
    key = (model.content_hash(), steady.content_hash(), *kind)
    with _LOCK:
        cached = _POINTS.get(key)
        point = _POINTS[key] = cached or Future()
        _POINTS.move_to_end(key)
        while len(_POINTS) > KEEP:
            _POINTS.popitem(last=False)
    if cached is None:
        try:
            point.set_result(make(steady))
        except BaseException as error:
            with _LOCK:
                _POINTS.pop(key, None)
            point.set_exception(error)
    return point.result()
