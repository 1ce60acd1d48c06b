"""Limits of the model's validity, checked in every step, since extremes fall between outputs.

Each criterion is a quantity with an upper limit. The time loop stores its largest value and the time of the first
violation; a run with a violation ends as ``Status.DOUBTFUL``.

Reference: docs/theory/simulation.md (M-35 to M-37).
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.tables import View
from meltemi.simulation.system import AnySystem, System, generator_speed, rotor_speed
from meltemi.simulation.tables import Watch

if TYPE_CHECKING:
    from meltemi.simulation.model import Model

Float = NDArray[float64]

CRITERIA = SPEED, REVERSED, POWER, PITCH, DEFLECTION, TOWER = range(6)
WORDS = (
    ("rotor faster than 1.5 times its rated speed", "rad/s"),
    ("generator drives a rotor that turns backwards", "W"),
    ("aerodynamic power above that of the wind through the rotor (10 s mean), by", "W"),
    ("pitch angle beyond half a turn", "rad"),
    ("deflection of the blade's tip beyond the model's range", "m"),
    ("blade within the tower's surface, by", "m"),
)
"""Text of each criterion, and the unit of its value."""
OVERSPEED = 1.5
"""Multiple of rated speed, beyond the design range of any turbine."""
MOTORING = 0.01
"""Largest fraction of rated power that drives a rotor backwards; a run may begin with a little."""
EXCESS = 0.1
"""Allowed excess over the wind power, as a fraction of rated power: the disk mean of turbulence understates it."""
MEAN_TIME = 10.0
"""[s] time constant of the exponential mean."""
WIND_POWER = 1.0
"""Fraction of the wind power that is the limit; strong turbulence exceeds Betz's limit, a steady one, for seconds."""
BENDING = 0.3
"""Limit over the blade length, at which second-order kinematics have an error of about 3 % in the slope."""
MOST_PITCH = np.pi


def new_watch(model: Model[Any]) -> Float:
    """(columns of ``Watch``, criteria) at the start of a run."""
    turbine = model.turbine
    rated, power = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio, turbine.rated_power
    watch = View(Watch, Watch.zeros(criterion=len(CRITERIA)))
    blade = getattr(turbine, "blade", None)
    bending = np.inf if blade is None else BENDING * blade.length
    watch["limit"] = OVERSPEED * rated, MOTORING * power, EXCESS * power, MOST_PITCH, bending, 0.0
    watch["worst"], watch["first"] = -np.inf, -1.0
    watch["scale"][POWER] = WIND_POWER * 0.5 * np.pi * turbine.rotor_radius**2
    return watch.array


@kernel
def record_criterion(watch: Watch, i: int, t: float, value: float) -> None:
    """Record the value of a criterion at time ``t``."""
    if value > watch.worst[i]:
        watch.worst[i] = value
    if value > watch.limit[i] and watch.first[i] < 0.0:
        watch.first[i] = t


@kernel
def watch_shaft(t: float, dt: float, m: AnySystem, watch: Watch) -> None:
    """Check rotor speed, generator and pitch."""
    speed = rotor_speed(m)
    record_criterion(watch, SPEED, t, abs(speed))
    if generator_speed(m) < 0.0:
        record_criterion(watch, REVERSED, t, -m.drive.generator_torque * generator_speed(m))
    wind = m.rotor.wind
    u = sqrt(wind.x * wind.x + wind.y * wind.y + wind.z * wind.z)
    excess = m.rotor.torque * speed - watch.scale[POWER] * m.aero.air_density * u * u * u
    watch.state[POWER] += (excess - watch.state[POWER]) * min(dt / MEAN_TIME, 1.0)
    record_criterion(watch, POWER, t, watch.state[POWER])
    for b in range(m.pitch.blades):
        record_criterion(watch, PITCH, t, abs(m.pitch.angle[b]))


@kernel
def watch_blades(t: float, m: System, watch: Watch) -> None:
    """Check the deflection of the blade tips, and the clearance between blade axes and tower."""
    motion, tower, hub = m.motion, m.tower_flow, m.machine.hub_position
    last, tip = tower.nodes - 1, motion.nodes - 1
    bottom = tower.height[0]
    top, step = tower.height[last], tower.height[1] - bottom
    for b in range(motion.blades):
        bent = motion.position[b, tip] - m.blade_nodes.position[b, tip]
        record_criterion(watch, DEFLECTION, t, sqrt(bent.x * bent.x + bent.y * bent.y))
        R = m.frame.orientation[b]
        for n in range(tip, -1, -1):
            p = hub + R @ motion.position[b, n]
            if p.z >= top:
                break  # the rest of the blade is above, too
            place = max((p.z - bottom) / step, 0.0)
            i = min(int(place), last - 1)
            share = place - i
            x = p.x - tower.x[i] - share * (tower.x[i + 1] - tower.x[i])
            y = p.y - tower.y[i] - share * (tower.y[i + 1] - tower.y[i])
            width = tower.diameter[i] + share * (tower.diameter[i + 1] - tower.diameter[i])
            record_criterion(watch, TOWER, t, 0.5 * width - sqrt(x * x + y * y))


def violations(watch: Float) -> list[dict[str, Any]]:
    """Violated criteria in order of time: ``what``, ``value``, ``limit``, ``unit``, ``time`` [s]."""
    rows = [
        {"what": what, "value": float(worst), "limit": float(limit), "unit": unit, "time": float(first)}
        for (what, unit), (limit, worst, first, *_) in zip(WORDS, watch.T, strict=True)
        if first >= 0.0
    ]
    return sorted(rows, key=lambda row: row["time"])
