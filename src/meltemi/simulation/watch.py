"""Kernels that compare each step with the limits of the model's validity (``simulation.validity``).

Reference: docs/theory/simulation.md (M-35 to M-37b).
"""

from __future__ import annotations

from math import sqrt

from meltemi.compiler import kernel
from meltemi.simulation.system import AnySystem, System, generator_speed, rotor_speed
from meltemi.simulation.tables import Watch

SPEED, REVERSED, POWER, PITCH, DEFLECTION, TOWER, TIP, BENDING, EDGE = range(9)
"""Criteria: columns of ``Watch``."""
MEAN_TIME = 10.0
"""[s] time constant of the exponential mean."""
GROWTH = 1.5
"""Ratio of the speeds in successive intervals of a growing edgewise vibration."""


@kernel
def record_criterion(watch: Watch, i: int, t: float, value: float) -> None:
    """Record the value of a criterion at time ``t``."""
    if value > watch.worst[i]:
        watch.worst[i] = value
    if value > watch.limit[i] and watch.first[i] < 0.0:
        watch.first[i] = t
    if value > watch.notice[i] and watch.noticed[i] < 0.0:
        watch.noticed[i] = t


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
    """Check the deflection of the blade tips, the clearance between blade axes and tower, and edgewise vibrations."""
    watch_edges(t, m, watch)
    motion, tower, hub = m.motion, m.tower_flow, m.machine.hub_position
    last, tip = tower.nodes - 1, motion.nodes - 1
    bottom = tower.height[0]
    top, step = tower.height[last], tower.height[1] - bottom
    mean = 0.0
    for b in range(motion.blades):
        bent = motion.position[b, tip] - m.blade_nodes.position[b, tip]
        deflection = sqrt(bent.x * bent.x + bent.y * bent.y)
        record_criterion(watch, DEFLECTION, t, deflection)
        mean += deflection / motion.blades
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
            inside = 0.5 * width - sqrt(x * x + y * y)
            record_criterion(watch, TOWER, t, inside)
            if n == tip:
                record_criterion(watch, TIP, t, inside)
    dt = max(t - watch.last[BENDING], 0.0)
    watch.last[BENDING] = t
    watch.state[BENDING] += (mean - watch.state[BENDING]) * min(dt / MEAN_TIME, 1.0)
    record_criterion(watch, BENDING, t, watch.state[BENDING])


@kernel
def watch_edges(t: float, m: System, watch: Watch) -> None:
    """Check whether the edgewise vibration of the blades grows from one interval to the next and the next."""
    k, n = int(watch.place[EDGE]), m.columns.coordinates
    if k < 0:
        return
    blades = m.motion.blades
    modes = (m.v.shape[0] - n) // blades
    dt = max(t - watch.last[EDGE], 0.0)
    watch.last[EDGE] = t
    for b in range(blades):
        v = m.v[n + b * modes + k]
        watch.state[EDGE] += v * v * dt
    length = t - watch.since[EDGE]
    if length < watch.scale[EDGE]:
        return
    square = 2.0 * watch.state[EDGE] / length
    grows = GROWTH * GROWTH
    if square > grows * watch.before[EDGE] > grows * grows * watch.earlier[EDGE]:
        record_criterion(watch, EDGE, t, sqrt(square))
    watch.earlier[EDGE], watch.before[EDGE] = watch.before[EDGE], square
    watch.state[EDGE], watch.since[EDGE] = 0.0, t
