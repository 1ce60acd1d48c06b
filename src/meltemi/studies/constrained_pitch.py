"""Output-constrained individual pitch control: only the pitch travel that a limit of the load requires.

The 1P component of the blade root moments is controlled to a reference instead of to zero: the component without
individual pitch, limited to a maximum. Below the limit the demand vanishes. A limit of zero is conventional individual
pitch control, an infinite one is none; in between load is traded for travel. The loop is that of the load
controller; its input is the moments minus the reference.

Reference: Hummel, Kober, Mulders (2025), Wind Energ. Sci. 10, 2005-2025; docs/guide/constrained-pitch.md.
"""

from __future__ import annotations

from math import hypot, inf
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Table, kernel, number, part, whole
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws import load_control
from meltemi.control_laws.filters import SecondOrder, notch
from meltemi.control_laws.load_control import HarmonicLoop, LoadControl, LoadController
from meltemi.control_laws.multiblade import add_to_blades, to_fixed
from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
Norm = Literal["l2", "linf"]
"""Norm that is limited: of the tilt and yaw part together (l2), or of each of them (linf)."""
ESTIMATE = 2.0
"""[rad/s] corner with which the moment follows the pitch demand, as in the published code."""
NOTCH_DAMPING = 0.2
"""Damping ratio of the notch at three times the rotor speed, where 2P and 4P of the blades appear in tilt and yaw."""
NONE, FULL = "none", "full"
"""Names of no and of full individual pitch control."""


class Constraint(Table, title="output constraint"):
    """Settings and state in front of those of the load controller."""

    limit: float = number("N m", "limit of the moment at 1P")
    together: float = number("-", "1: of both components together, 0: of each")
    real: float = number("N m/rad", "plant at 1P, real part")
    imaginary: float = number("N m/rad", "plant at 1P, imaginary part")
    tilt: float = number("rad", "pitch demand, delayed as the moment follows it")
    yaw: float = number("rad", "pitch demand, delayed as the moment follows it")
    tilt_notch: SecondOrder = part(SecondOrder, "of the tilt moment")
    yaw_notch: SecondOrder = part(SecondOrder, "of the yaw moment")


OWN = len(Constraint.names)


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    x, measured = Constraint(state), Measurements(measurements)
    blades, azimuth = whole(measured.n_blades), measured.azimuth
    tilt, yaw = to_fixed(measured.out_of_plane_moment, blades, azimuth, 1)
    nodding = blades * measured.rotor_speed
    tilt = notch(x.tilt_notch, tilt, nodding, NOTCH_DAMPING, dt) - (x.real * x.tilt + x.imaginary * x.yaw)
    yaw = notch(x.yaw_notch, yaw, nodding, NOTCH_DAMPING, dt) - (x.real * x.yaw - x.imaginary * x.tilt)
    if x.together > 0.0:
        kept = min(x.limit / max(hypot(tilt, yaw), 1.0), 1.0)
        tilt, yaw = kept * tilt, kept * yaw
    else:
        tilt, yaw = min(max(tilt, -x.limit), x.limit), min(max(yaw, -x.limit), x.limit)
    constrained = measurements.copy()
    add_to_blades(Measurements(constrained).out_of_plane_moment, blades, -tilt, -yaw, azimuth, 1, 0.0)
    load_control.update(state[OWN:], constrained, demands, dt)
    tilt, yaw = to_fixed(Demands(demands).pitch, blades, azimuth, 1)
    share = min(ESTIMATE * dt, 1.0)
    x.tilt += share * (tilt - x.tilt)
    x.yaw += share * (yaw - x.yaw)


def constrained_pitch(
    turbine: Turbine, loop: HarmonicLoop, plant: complex, limit: float, norm: Norm = "l2"
) -> Controller:
    """Collective pitch of the turbine's file and output-constrained individual pitch at 1P.

    Args:
      turbine: controlled turbine.
      loop: loop of 1P pitch, such as that of :func:`meltemi.controllers.tuning.tune_ipc`.
      plant: [N m/rad] response of the root moments to the pitch demand at 1P (C-32), such as that of its points.
      limit: [N m] limit of the moment at 1P; 0 is full individual pitch control, ``inf`` none.
      norm: norm of the moments that is limited.

    Raises:
      InputError: the loop is not of 1P pitch, or the limit is negative.
    """
    if (loop.harmonic, loop.actuator) != (1, "pitch"):
        raise InputError(f"constrained_pitch: loop is of {loop.harmonic}P {loop.actuator}, it must be of 1P pitch")
    if not limit >= 0.0:
        raise InputError(f"constrained_pitch: limit {limit:g} N m must be 0 or larger, or inf")
    if limit == inf:
        return LoadController(turbine, LoadControl(), name=NONE)
    name = f"{norm} {limit * 1e-6:g} MN m" if limit else FULL
    inner = LoadController(turbine, LoadControl(loops=(loop,)), name=name)
    x = Constraint.of(limit=limit, together=float(norm == "l2"), real=plant.real, imaginary=plant.imag)

    def init(start: StartPoint) -> Float:
        law: Any = inner.init(start)
        return np.concatenate([x.array, law.array])

    return Controller(update=update, init=init, name=name, uses_loads=True)
