"""Limits of the model's validity, checked in every step (``simulation.watch``), since extremes fall between outputs.

Each criterion is a quantity with an upper limit and a lower level for a warning. The time loop stores its largest value
and the times at which it first exceeds both; a run with a violation of a limit ends as ``Status.DOUBTFUL``.

Reference: docs/theory/simulation.md (M-35 to M-37b).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.tables import TowerFlow
from meltemi.compiler import View
from meltemi.simulation.tables import Watch
from meltemi.simulation.watch import BENDING, DEFLECTION, EDGE, PITCH, POWER, REVERSED, SPEED, TIP, TOWER
from meltemi.structure.tables import BladeNode

if TYPE_CHECKING:
    from meltemi.simulation.bladed.rotor import BladedModel
    from meltemi.simulation.model import Model

Float = NDArray[float64]


class Criterion(NamedTuple):
    """Unit and messages of a criterion.

    Attributes:
      unit: unit of the values.
      violation: text about a violated limit; empty without a limit.
      notice: text about a reached lower level; empty without one.
    """

    unit: str
    violation: str = ""
    notice: str = ""


CRITERIA = {
    SPEED: Criterion("rad/s", "rotor faster than 1.5 times its rated speed", "rotor overspeed"),
    REVERSED: Criterion("W", "generator drives a rotor that turns backwards"),
    POWER: Criterion("W", "aerodynamic power above that of the wind through the rotor (10 s mean), by"),
    PITCH: Criterion("rad", "pitch angle beyond half a turn"),
    DEFLECTION: Criterion("m", "deflection of the blade's tip beyond the model's range"),
    TOWER: Criterion("m", "blade within the tower's surface, by"),
    TIP: Criterion("m", notice="a blade comes close to the tower: distance of its tip from the surface"),
    BENDING: Criterion("m", notice="the blades bend beyond the range of their model: tip deflection (10 s mean)"),
    EDGE: Criterion("m/s", notice="growing edgewise vibration, as by stall: speed of the blade's tip"),
}
OVERSPEED = 1.5
"""Multiple of rated speed, beyond the design range of any turbine."""
MOTORING = 0.01
"""Largest fraction of rated power that drives a rotor backwards; a run may begin with a little."""
EXCESS = 0.1
"""Allowed excess over the wind power, as a fraction of rated power: the disk mean of turbulence understates it."""
WIND_POWER = 1.0
"""Fraction of the wind power that is the limit; strong turbulence exceeds Betz's limit, a steady one, for seconds."""
MOST_DEFLECTION = 0.3
"""Limit over the blade length; no model of the blades is verified there."""
MOST_PITCH = np.pi
FAST = 1.2
"""Multiple of rated speed above which a run has a warning; protection systems stop the rotor before."""
CLOSE = 0.3
"""Fraction of the clearance of the undeflected rotor below which a run has a warning, unless options give it."""
RANGES: dict[str, float] = {"modal": 0.1, "geometrically_exact": 0.2}
"""Largest mean tip deflection over the blade length for which each structural model of the blades is accurate: modes of
second order have errors of 1.4 % of the flapwise deflection and 0.4 degrees of twist there, exact blades of 0.2 % and
0.1 degrees. Others: no limit."""
VIBRATION, PERIODS = 0.01, 10.0
"""Amplitude over the blade length from which a growing edgewise vibration gives a warning; periods in an interval."""


def new_watch(model: Model[Any]) -> Float:
    """(columns of ``Watch``, criteria) table at the start of a run."""
    turbine = model.turbine
    rated, power = turbine.rated_rotor_speed, turbine.rated_power
    watch = View(Watch, Watch.zeros(criterion=len(CRITERIA)))
    blade = getattr(turbine, "blade", None)
    watch["limit"] = np.inf
    watch["limit"][SPEED], watch["limit"][PITCH], watch["limit"][TOWER] = OVERSPEED * rated, MOST_PITCH, 0.0
    watch["limit"][REVERSED], watch["limit"][POWER] = MOTORING * power, EXCESS * power
    watch["notice"], watch["worst"], watch["first"], watch["noticed"] = np.inf, -np.inf, -1.0, -1.0
    watch["notice"][SPEED] = FAST * rated
    watch["scale"][POWER] = WIND_POWER * 0.5 * np.pi * turbine.rotor_radius**2
    watch["place"], watch["before"], watch["earlier"] = (
        -1.0,
        np.inf,
        np.inf,
    )  # growth takes three intervals
    if blade is not None:
        watch["limit"][DEFLECTION] = MOST_DEFLECTION * blade.length
        given = model.options.tower_clearance
        watch["notice"][TIP] = -(CLOSE * undeflected_clearance(model) if given is None else given)
        watch["notice"][BENDING] = RANGES.get(model.options.blade_model, np.inf) * blade.length
        member = model.rotor.blade
        if "1st edge" in member.names:
            k = member.names.index("1st edge")
            frequency = np.sqrt(member.modes.stiffness[k, k] / member.modes.mass[k, k])
            watch["place"][EDGE], watch["scale"][EDGE] = k, 2.0 * np.pi / frequency * PERIODS
            watch["notice"][EDGE] = VIBRATION * blade.length * frequency
    return watch.array


def undeflected_clearance(model: BladedModel) -> float:
    """[m] distance of the tip of an undeflected blade that points down from the surface of the tower."""
    turbine, tower = model.turbine, View(TowerFlow, model.rotor.tower_flow)
    tilt, cone, nacelle = turbine.nacelle.tilt, turbine.hub.precone, turbine.nacelle
    x, _, z = View(BladeNode, model.rotor.blade_nodes[:, 0])["position"][:, -1]
    down = z * np.cos(cone) + x * np.sin(cone)
    along = x * np.cos(cone) - z * np.sin(cone) - nacelle.overhang  # from the tower's axis, along the shaft
    ahead = along * np.cos(tilt) - down * np.sin(tilt)
    height = tower["height"][-1] + nacelle.shaft_height - along * np.sin(tilt) - down * np.cos(tilt)
    return float(abs(ahead) - 0.5 * np.interp(height, tower["height"], tower["diameter"]))


def notices(watch: Float) -> list[dict[str, Any]]:
    """Criteria with a warning and without a violation, in order of time, as :func:`violations` has them."""
    table = View(Watch, watch)
    rows = []
    for i, criterion in CRITERIA.items():
        if criterion.notice and table["noticed"][i] >= 0.0 and table["first"][i] < 0.0:
            sign = -1.0 if i == TIP else 1.0  # a penetration, as a distance
            value, limit, time = (float(table[name][i]) for name in ("worst", "notice", "noticed"))
            row = {"what": criterion.notice, "value": sign * value, "limit": sign * limit, "unit": criterion.unit}
            rows.append(row | {"time": time})
    return sorted(rows, key=lambda row: row["time"])


def violations(watch: Float) -> list[dict[str, Any]]:
    """Violated criteria in order of time: ``what``, ``value``, ``limit``, ``unit``, ``time`` [s]."""
    table = View(Watch, watch)
    rows = []
    for i, criterion in CRITERIA.items():
        if table["first"][i] >= 0.0:
            value, limit, time = (float(table[name][i]) for name in ("worst", "limit", "first"))
            row = {"what": criterion.violation, "value": value, "limit": limit, "unit": criterion.unit}
            rows.append(row | {"time": time})
    return sorted(rows, key=lambda row: row["time"])
