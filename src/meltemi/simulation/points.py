"""Operating points that several runs start from, computed once: a model in winds with the same mean needs one."""

from __future__ import annotations

import threading
from collections import OrderedDict
from concurrent.futures import Future

from meltemi.simulation.engines import operating_point
from meltemi.simulation.machine import AnyModel
from meltemi.simulation.trim import OperatingPoint, steady_wind
from meltemi.wind.fields import Wind

KEEP = 32
"""Points that are remembered, most recently used first."""

_LOCK = threading.Lock()
_POINTS: OrderedDict[tuple[str, str], Future[OperatingPoint]] = OrderedDict()


def shared_point(model: AnyModel, wind: Wind) -> OperatingPoint:
    """The operating point in which a run begins; threads that ask for the same one wait for the first of them.

    Raises:
      InputError: as ``operating_point``.
    """
    steady = steady_wind(wind, model.turbine.hub_height)
    key = (model.content_hash(), steady.content_hash())
    with _LOCK:
        found = _POINTS.get(key)
        point = _POINTS[key] = found or Future()
        _POINTS.move_to_end(key)
        while len(_POINTS) > KEEP:
            _POINTS.popitem(last=False)
    if found is None:
        try:
            point.set_result(operating_point(model, steady))
        except BaseException as error:
            with _LOCK:
                _POINTS.pop(key, None)
            point.set_exception(error)
    return point.result()
