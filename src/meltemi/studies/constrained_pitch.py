"""Output-constrained individual pitch control: only the pitch travel that a limit of the load requires.

The 1P component of the blade root moments is controlled to a reference instead of to zero: the component without
individual pitch, limited to a maximum. Below the limit the demand vanishes. A limit of zero is conventional individual
pitch control, an infinite one is none; in between load is traded for travel. The loop is that of the load
controller; its input is the moments minus the reference.

Reference: Hummel, Kober, Mulders (2025), Wind Energ. Sci. 10, 2005-2025; docs/guide/constrained-pitch.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf
from typing import TYPE_CHECKING, Any, Literal

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
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import heading, new_figure
from meltemi.tuning.compare import Comparison
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Norm = Literal["l2", "linf"]
"""Of what the limit is one: of the size of tilt and yaw part together, or of each."""
ESTIMATE = 2.0
"""[rad/s] corner with which the moment follows the pitch demand, as in the published code."""
NOTCH_DAMPING = 0.2
"""Of the notch at three times the rotor speed, where 2P and 4P of the blades appear in tilt and yaw."""
NONE, FULL = "none", "full"
"""Names of no and of full individual pitch control."""


class Constraint(Table, title="output constraint"):
    """Settings and state in front of those of the load controller."""

    limit: float = number("N m", "of the moment at 1P")
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


def controllers(
    turbine: Turbine, loop: HarmonicLoop, plant: complex, limits: Mapping[Norm, Sequence[float]]
) -> dict[str, Controller]:
    """Controllers for several limits [N m] by norm, by name; first those without and with full individual pitch."""
    ends = [constrained_pitch(turbine, loop, plant, limit) for limit in (inf, 0.0)]
    more = [constrained_pitch(turbine, loop, plant, limit, norm) for norm, each in limits.items() for limit in each]
    return {controller.name: controller for controller in (*ends, *more)}


@dataclass(frozen=True)
class Trade:
    """Load and pitch travel of a controller between no and full individual pitch: means over seeds, 95 % intervals.

    Attributes:
      name: name of the controller.
      travel: pitch travel over that without individual pitch.
      load: relative change of the load.
      actuation: additional travel over that of full individual pitch.
      reduction: load reduction over that of full individual pitch.
    """

    name: str
    travel: MeanEstimate
    load: MeanEstimate
    actuation: MeanEstimate
    reduction: MeanEstimate


def trades(c: Comparison, quantity: str = "RootMyc1 DEL") -> list[Trade]:
    """Trade of a load for travel by all controllers of :func:`controllers`, formed seed by seed.

    Args:
      c: comparison of all controllers in the same winds.
      quantity: name of the load.
    """
    trade_list = []
    travel0, travel1 = (c.values("pitch travel", name) for name in (NONE, FULL))
    load0, load1 = (c.values(quantity, name) for name in (NONE, FULL))
    for name in c.schemes:
        travel, load = c.values("pitch travel", name), c.values(quantity, name)
        shares = (travel - travel0) / (travel1 - travel0), (load - load0) / (load1 - load0)
        trade_list.append(Trade(name, *map(mean_interval, (travel / travel0, load / load0 - 1.0, *shares))))
    return trade_list


def plot_trades(
    curves: Mapping[str, Sequence[Trade]], published: Mapping[str, tuple[float, float]] | None = None
) -> Figure:
    """Share of the reduction over share of the actuation [%], a curve for each set of trades, and published points."""
    figure, axes = new_figure(1, size=(7.4, 4.6))
    ax = axes[0, 0]
    ax.plot([0.0, 100.0], [0.0, 100.0], color=INK, linewidth=0.8, linestyle=":", label="load in proportion to travel")
    for colour, (label, each) in zip(COLOURS, curves.items(), strict=False):
        ordered = sorted(each, key=lambda trade: trade.actuation.mean)
        x, y = ([100.0 * getattr(trade, name).mean for trade in ordered] for name in ("actuation", "reduction"))
        width = [100.0 * trade.reduction.half_width for trade in ordered]
        ax.errorbar(x, y, yerr=width, color=colour, marker="o", markersize=4, capsize=2, label=label)
    for label, (added, reduced) in (published or {}).items():
        ax.plot(100.0 * added, 100.0 * reduced, color=INK, marker="D", linestyle="", label=label)
    ax.set_xlabel("share of the travel that full individual pitch adds [%]")
    ax.set_ylabel("[%]")
    ax.legend(loc="lower right")
    heading(ax, "Share of the load that full individual pitch takes")
    return figure
