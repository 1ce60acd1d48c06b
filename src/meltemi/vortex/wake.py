"""The step of a vortex wake: a row leaves the blades, old rows merge, and all vortices move with the flow.

Reference: docs/theory/vortices.md (VW-9 to VW-20).
"""

from __future__ import annotations

from math import pi, sin, sqrt
from typing import Any

from meltemi.compiler import Rot, Vec, kernel, whole
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import cross, dot, norm
from meltemi.simulation.induction import advance_induction, induction_step
from meltemi.vortex.filaments import TINY, induced, store
from meltemi.vortex.line import (
    PIECES,
    arc_point,
    control_point,
    core2_at,
    factorise,
    influence,
    into,
    line_end,
    moved,
    root_axes,
)
from meltemi.vortex.tables import VortexSystem, WakeDrift, WakeZone
from meltemi.wind.velocity import wind_velocity

LARGEST_CHORD = 1.2
"""[rad] azimuth of a filament beyond which the correction of its bend stays."""
LONGEST = 0.1
"""Longest way of the wind in a step of the wake, over the radius: the limit for rotors that hardly turn."""
LEAST_WIND, FAR = 1.0, 1e5
"""[m/s] wind that limits the step in still air; [m] distance from the hub beyond which a vortex is lost."""
REFRESHED = 5
"""Steps of the wake in which a wake with averaged velocities computes all of them once."""


@induction_step.variant
@kernel
def _(m: VortexSystem) -> float:
    return m.vortex_state.step


@kernel
def wake_step(m: VortexSystem) -> float:
    """[s] length of the following step of the wake (VW-9)."""
    p = m.vortex
    longest = LONGEST * p.radius / max(norm(m.rotor.wind), LEAST_WIND)
    return min(p.azimuth_step / max(abs(m.machine.rotor_speed), 1e-9), longest)


@advance_induction.variant
@kernel
def _(dt: float, m: VortexSystem) -> None:
    """The step of the wake that ends here took ``dt``; begin the next one, until whose end the wake moves at once."""
    state = m.vortex_state
    late = dt - state.step  # a step is a whole number of time steps
    shift(m.wake_1, whole(state.rows_1), late)
    shift(m.wake_2, whole(state.rows_2), late)
    shift(m.wake_3, whole(state.rows_3), late)
    state.step, state.begin = wake_step(m), state.time
    state.turn += 1.0
    shed_row(m)
    merge_rows(m)
    convect(m)
    renew_line(m)
    if not (lost(m.wake_1, m, 1) or lost(m.wake_2, m, 2)):
        lost(m.wake_3, m, 3)


@kernel
def shift(zone: WakeZone, rows: int, dt: float) -> None:
    """Move the vortices of a zone by their last velocity."""
    for b in range(zone.blades):
        for r in range(rows):
            for e in range(zone.edges):
                zone.position[b, r, e] += dt * zone.velocity[b, r, e]


# rows ---------------------------------------------------------------------------------------------------


@kernel
def make_room(zone: WakeZone, rows: int) -> int:
    """Free row 0 of a zone, and count it; the oldest row of a full zone is lost."""
    rows = min(rows, zone.ages - 1)
    for b in range(zone.blades):
        for k in range(rows):
            r = rows - k
            for e in range(zone.edges):
                zone.position[b, r, e] = zone.position[b, r - 1, e]
                zone.velocity[b, r, e] = zone.velocity[b, r - 1, e]
                zone.width2[b, r, e] = zone.width2[b, r - 1, e]
                zone.circulation[b, r, e] = zone.circulation[b, r - 1, e]
    return rows + 1


@kernel
def trailing_edge(m: VortexSystem, b: int, e: int) -> Vec:
    """Position [m] of the trailing edge, three quarters of the chord behind the bound vortex."""
    last = m.lifting_line.nodes - 1
    i, j = max(e - 1, 0), min(e, last)
    chord = (
        m.node_constants.chord[b, i] * m.lifting_line.along[b, i]
        + m.node_constants.chord[b, j] * m.lifting_line.along[b, j]
    )
    return line_end(m, b, e) + 0.375 * chord


@kernel
def shed_row(m: VortexSystem) -> None:
    """Let the panels behind the blades go with the circulation of the last evaluation, and begin new ones (VW-10)."""
    zone, line = m.wake_1, m.lifting_line
    m.vortex_state.rows_1 = 1.0 * make_room(zone, whole(m.vortex_state.rows_1))
    for b in range(line.blades):
        for e in range(line.nodes + 1):
            width = norm(line_end(m, b, min(e + 1, line.nodes)) - line_end(m, b, max(e - 1, 0)))
            width *= 0.5 if 0 < e < line.nodes else 1.0
            zone.position[b, 0, e] = trailing_edge(m, b, e)
            zone.velocity[b, 0, e] = Vec(0.0, 0.0, 0.0)
            zone.width2[b, 0, e] = width * width
            zone.circulation[b, 0, e] = m.bound.circulation[b, e] if e < line.nodes else 0.0


@kernel
def merge_rows(m: VortexSystem) -> None:
    """Merge the oldest panels of a zone to one of the next where they are enough (VW-11)."""
    p, state = m.vortex, m.vortex_state
    first, count = whole(p.panels_1), whole(p.merge_2)
    if whole(state.rows_1) - 1 >= first + count:
        state.rows_2 = 1.0 * make_room(m.wake_2, whole(state.rows_2))
        merge(m.wake_1, m.wake_2, first, count)
        state.rows_1 = first + 1.0
    first, count = whole(p.panels_2), whole(p.merge_3)
    if whole(state.rows_2) - 1 >= first + count:
        state.rows_3 = 1.0 * make_room(m.wake_3, whole(state.rows_3))
        merge(m.wake_2, m.wake_3, first, count)
        state.rows_2 = first + 1.0


@kernel
def merge(upper: WakeZone, lower: WakeZone, first: int, count: int) -> None:
    """Set row 0 of the lower zone to row ``first`` of the upper one, its panels to the mean of ``count`` panels there.

    The trailed vortices are split where the circulation is largest, and each side in groups of equal strength; a group
    becomes one vortex at its centre, whose core also has the spread of the group (VW-12, VW-13).
    """
    for b in range(upper.blades):
        ends, total, peak, most = upper.edges - 1, 0.0, 0, -1.0
        for e in range(ends + 1):
            total += abs(trailed(upper, b, first, count, e))
            if e < ends and abs(panel_mean(upper, b, first, count, e)) > most:
                most, peak = abs(panel_mean(upper, b, first, count, e)), e
        half, e = lower.edges // 2, 0
        peak = min(max(peak, half - 1), ends - half)  # each side needs a vortex for each group
        for g in range(lower.edges):
            tip = g >= half
            begin, end = (peak + 1, ends + 1) if tip else (0, peak + 1)
            if g == half:
                e = begin
            side = 0.0
            for i in range(begin, end):
                side += abs(trailed(upper, b, first, count, i))
            share = (g - half + 1.0 if tip else g + 1.0) / half
            last = g == half - 1 or g == lower.edges - 1
            before, weight, centre, square, width2 = 0.0, 0.0, Vec(0.0, 0.0, 0.0), 0.0, 0.0
            for i in range(begin, e):
                before += abs(trailed(upper, b, first, count, i))
            # at least one vortex a group, and one for each that follows
            following = half - 1 - (g - half if tip else g)
            while e < end - following:
                w = abs(trailed(upper, b, first, count, e)) + 1e-6 * total + 1e-12
                if weight > 0.0 and not last and before + 0.5 * w > share * side:
                    break
                x = upper.position[b, first, e]
                before += w
                weight += w
                centre += w * x
                square += w * dot(x, x)
                width2 += w * upper.width2[b, first, e]
                e += 1
            centre = (1.0 / weight) * centre
            lower.position[b, 0, g] = centre
            lower.velocity[b, 0, g] = upper.velocity[b, first, max(e - 1, 0)]
            lower.width2[b, 0, g] = width2 / weight + max(square / weight - dot(centre, centre), 0.0)
            lower.circulation[b, 0, g] = panel_mean(upper, b, first, count, e - 1) if g < lower.edges - 1 else 0.0


@kernel
def panel_mean(zone: WakeZone, b: int, first: int, count: int, e: int) -> float:
    """[m^2/s] mean circulation of ``count`` panels from age ``first``."""
    mean = 0.0
    for r in range(first, first + count):
        mean += zone.circulation[b, r, e] / count
    return mean


@kernel
def trailed(zone: WakeZone, b: int, first: int, count: int, e: int) -> float:
    """[m^2/s] mean circulation of the vortex that these panels trail at an edge, positive away from the blade."""
    inner = panel_mean(zone, b, first, count, e - 1) if e > 0 else 0.0
    return inner - (panel_mean(zone, b, first, count, e) if e < zone.edges - 1 else 0.0)


# filaments ----------------------------------------------------------------------------------------------


@kernel
def centre_of(zone: WakeZone, m: VortexSystem, r: int, e: int) -> Vec:
    """Point on the axis of the wake [m]: mean position of the vortices of all blades; a straight axis for one blade."""
    c = Vec(0.0, 0.0, 0.0)
    if zone.blades < 2:
        wind, hub = mean_wind(m), m.machine.hub_position
        return hub + (dot(zone.position[0, r, e] - hub, wind) / max(dot(wind, wind), TINY)) * wind
    for b in range(zone.blades):
        c += (1.0 / zone.blades) * zone.position[b, r, e]
    return c


@kernel
def bend(angle: float) -> float:
    """Ratio of the radius of a polygon to that of the circle of its area, by the azimuth of its sides (VW-15)."""
    t = min(abs(angle), LARGEST_CHORD)
    return sqrt(t / sin(t)) if t > 1e-6 else 1.0


@kernel
def rows_of(m: VortexSystem, number: int) -> int:
    """Rows of a zone, by its number from 1."""
    state = m.vortex_state
    counts = (state.rows_1, state.rows_2, state.rows_3)
    return whole(counts[number - 1])


@kernel
def steps_of(m: VortexSystem, number: int) -> float:
    """Steps of the wake in a panel of a zone."""
    p = m.vortex
    return (p.merge_2 if number > 1 else 1.0) * (p.merge_3 if number > 2 else 1.0)


@kernel
def age_of(m: VortexSystem, number: int, r: float) -> float:
    """Age of row r of a zone since the youngest row, in steps of the wake; r may be between rows."""
    age = r * steps_of(m, number)
    for before in range(1, number):  # the last row of a zone is the first one of the next
        age += (rows_of(m, before) - 1) * steps_of(m, before)
    return age


@kernel
def wider(m: VortexSystem, number: int, r: int, step: float) -> float:
    """Factor of the radius of row r of a zone: none at the blades, in full from the fifth row on."""
    factor = bend(steps_of(m, number) * step * m.machine.rotor_speed) - 1.0
    return 1.0 + factor * (min(0.25 * r, 1.0) if number == 1 else 1.0)


@kernel
def point_of(zone: WakeZone, m: VortexSystem, b: int, r: int, e: int, wide: float) -> Vec:
    """Place of a vortex's filaments: its own, further from the axis of the wake by the factor ``wide``."""
    x, s = zone.position[b, r, e], m.machine.shaft
    d = x - centre_of(zone, m, r, e)
    return x + (wide - 1.0) * (d - dot(d, s) * s)


@kernel
def put(s: Any, j: int, m: VortexSystem, begin: Vec, end: Vec, circulation: float, core2: float) -> int:
    """Store a filament, and its mirror image if the ground is one; the next column."""
    core = whole(m.vortex.core)
    store(s, j, begin, end, circulation, core2, core)
    if m.vortex.ground > 0.0:
        store(s, j + 1, Vec(begin.x, begin.y, -begin.z), Vec(end.x, end.y, -end.z), -circulation, core2, core)
        return j + 2
    return j + 1


@kernel
def store_zone(
    s: Any, j: int, zone: WakeZone, m: VortexSystem, number: int, factor: float, youngest: float, step: float
) -> int:
    """Store the filaments of a zone from column ``j``, with cores of ``factor`` widths; the next column (VW-14).

    Args:
      youngest, step: [s] age of the youngest row of the wake; length of its steps.
    """
    rows, shed = rows_of(m, number), whole(m.vortex.shed) if number == 1 else 1
    for b in range(zone.blades):
        for r in range(rows):
            wide, next_wide = wider(m, number, r, step), wider(m, number, r + 1, step)
            x = point_of(zone, m, b, r, 0, wide)
            for e in range(zone.edges):
                core2 = core2_at(zone, m, b, r, e, factor, youngest + step * age_of(m, number, r + 0.5))
                if r < rows - 1:
                    inner = zone.circulation[b, r, e - 1] if e > 0 else 0.0
                    G = inner - (zone.circulation[b, r, e] if e < zone.edges - 1 else 0.0)
                    j = put(s, j, m, x, point_of(zone, m, b, r + 1, e, next_wide), G, core2)
                if e < zone.edges - 1:
                    outer = point_of(zone, m, b, r, e + 1, wide)
                    if shed <= r < rows - 1 and (r > 0 or number == 1):
                        G = zone.circulation[b, r, e] - (zone.circulation[b, r - 1, e] if r > 0 else 0.0)
                        j = put(s, j, m, x, outer, G, core2)
                    x = outer
    return j


@kernel
def store_wake(s: Any, m: VortexSystem, factor: float, age: float, step: float) -> int:
    """Store the filaments of all zones; ``age`` [s] is that of the youngest row. Returns their number."""
    j = store_zone(s, 0, m.wake_1, m, 1, factor, age, step)
    j = store_zone(s, j, m.wake_2, m, 2, factor, age, step)
    return store_zone(s, j, m.wake_3, m, 3, factor, age, step)


@kernel
def store_blade(s: Any, j: int, m: VortexSystem, turn: Rot, b: int, factor: float, age: float) -> int:
    """Store the bound vortices of a blade, and those from it to the youngest row, ``age`` [s]; the next column."""
    zone, p, G, n = m.wake_1, m.vortex, m.bound.circulation, m.lifting_line.nodes
    for e in range(n + 1):
        begin = moved(m, turn, line_end(m, b, e))
        strength = (G[b, e - 1] if e > 0 else 0.0) - (G[b, e] if e < n else 0.0)
        core2 = core2_at(zone, m, b, 0, e, factor, 0.0)
        row = zone.position[b, 0, e]
        for k in range(PIECES):
            j = put(s, j, m, arc_point(m, begin, row, age, k), arc_point(m, begin, row, age, k + 1), strength, core2)
        if e < n:
            end = moved(m, turn, line_end(m, b, e + 1))
            j = put(s, j, m, begin, end, G[b, e], factor * factor * dot(end - begin, end - begin))
            if p.shed < 1.0:
                j = put(s, j, m, zone.position[b, 0, e], zone.position[b, 0, e + 1], -G[b, e], core2)
    return j


# motion -------------------------------------------------------------------------------------------------


@kernel
def induced_in_wake(zone: WakeZone, m: VortexSystem, b: int, r: int, e: int, wide: float, count: int) -> Vec:
    """Induced velocity [m/s] of a vortex, where its filaments are, in single precision."""
    x = point_of(zone, m, b, r, e, wide)
    m.wake_point32[0], m.wake_point32[1], m.wake_point32[2] = x.x, x.y, x.z
    u, v, w = induced(m.wake_point32, m.wake_sources32, 0, count, whole(m.vortex.core))
    return Vec(0.0 + u, 0.0 + v, 0.0 + w)


@kernel
def wind_at(x: Vec, m: VortexSystem, mean: Vec) -> Vec:
    """Wind [m/s] that moves a vortex."""
    if m.vortex.mean_wind > 0.0:
        return mean
    return wind_velocity(Vec(x.x, x.y, max(x.z, 0.01)), m.vortex_state.time, m)


@kernel
def mean_wind(m: VortexSystem) -> Vec:
    """Wind [m/s] over the rotor, inertial axes."""
    return m.rotor.wind + m.machine.hub_velocity


@kernel
def convect(m: VortexSystem) -> None:
    """Move the vortices until the end of the step (VW-16 to VW-18)."""
    state = m.vortex_state
    count = store_present(m)
    convect_zone(m.wake_1, m.drift_1, m, 1, count)
    convect_zone(m.wake_2, m.drift_2, m, 2, count)
    # the rest moves with the tip vortices of the last revolution of the free part
    zone, rows, mean, wind = m.wake_2, whole(state.rows_2), Vec(0.0, 0.0, 0.0), mean_wind(m)
    first, half = max(rows - revolution(m), 0), zone.edges // 2
    share = 1.0 / (zone.blades * half * (rows - first))
    for b in range(zone.blades):
        for r in range(first, rows):
            for e in range(half, zone.edges):
                mean += share * (zone.velocity[b, r, e] - wind_at(zone.position[b, r, e], m, wind))
    zone = m.wake_3
    for b in range(zone.blades):
        for r in range(whole(state.rows_3)):
            for e in range(zone.edges):
                zone.velocity[b, r, e] = wind + mean
    shift(zone, whole(state.rows_3), state.step)


@kernel
def revolution(m: VortexSystem) -> int:
    """Number of rows of the second zone that leave the rotor in a revolution."""
    return whole(2.0 * pi / (m.vortex.azimuth_step * m.vortex.merge_2) + 0.5)


@kernel
def store_present(m: VortexSystem) -> int:
    """Store all filaments at the begin of the step, for velocities in the wake; returns their number."""
    state, s, factor = m.vortex_state, m.wake_sources32, m.vortex.wake_core
    step, state.step = state.step, 0.0  # the blades are where they are
    count = store_wake(s, m, factor, 0.0, step)
    for b in range(m.lifting_line.blades):
        count = store_blade(s, count, m, rotation(Vec(0.0, 0.0, 0.0)), b, factor, 0.0)
    state.step = step
    return count


@kernel
def convect_zone(zone: WakeZone, drift: WakeDrift, m: VortexSystem, number: int, count: int) -> None:
    """Velocities of the vortices of a zone, and their motion: of second order but for the row that has just begun."""
    state, wind, turn, free = m.vortex_state, mean_wind(m), whole(m.vortex_state.turn), m.vortex.free > 0.0
    for r in range(rows_of(m, number)):
        wide, new = wider(m, number, r, state.step), r == 0 and number == 1
        if not free and (turn + r) % REFRESHED == 0:
            refresh(zone, drift, m, number, r, count, 1.0)
        for e in range(zone.edges):
            centre = centre_of(zone, m, r, e)
            for b in range(zone.blades):
                x, before = zone.position[b, r, e], zone.velocity[b, r, e]
                if free:
                    v = induced_in_wake(zone, m, b, r, e, wide, count)
                else:
                    v = drift_at(x, centre, drift, m, r, e)
                v += wind_at(x, m, wind)
                zone.velocity[b, r, e] = v
                zone.position[b, r, e] = x + state.step * (v if new else 1.5 * v - 0.5 * before)


@kernel
def around(x: Vec, centre: Vec, m: VortexSystem) -> tuple[Vec, Vec, float]:
    """Unit vectors away from the axis of the wake and around it, and the distance from it."""
    d, s = x - centre, m.machine.shaft
    away = d - dot(d, s) * s
    distance = max(norm(away), 1e-6)
    e = (1.0 / distance) * away
    return e, cross(s, e), distance


@kernel
def drift_at(x: Vec, centre: Vec, drift: WakeDrift, m: VortexSystem, r: int, e: int) -> Vec:
    """Induced velocity [m/s] of a vortex by its age and edge (VW-17)."""
    away, about, _ = around(x, centre, m)
    return drift.axial[r, e] * m.machine.shaft + drift.radial[r, e] * away + drift.tangential[r, e] * about


@kernel
def refresh(zone: WakeZone, drift: WakeDrift, m: VortexSystem, number: int, r: int, count: int, share: float) -> None:
    """Let a share of the mean induced velocity of a row be that of its present place."""
    wide = wider(m, number, r, m.vortex_state.step)
    for e in range(zone.edges):
        centre, axial, radial, tangential = centre_of(zone, m, r, e), 0.0, 0.0, 0.0
        for b in range(zone.blades):
            x = zone.position[b, r, e]
            away, about, _ = around(x, centre, m)
            u = induced_in_wake(zone, m, b, r, e, wide, count)
            axial += dot(u, m.machine.shaft) / zone.blades
            radial += dot(u, away) / zone.blades
            tangential += dot(u, about) / zone.blades
        drift.axial[r, e] += share * (axial - drift.axial[r, e])
        drift.radial[r, e] += share * (radial - drift.radial[r, e])
        drift.tangential[r, e] += share * (tangential - drift.tangential[r, e])


@kernel
def renew_line(m: VortexSystem) -> None:
    """Velocities and influence at the blades at the end of the step, where the wake is already (VW-8)."""
    begin_at_end(m)
    step = m.vortex_state.step
    at_blades(m, rotation(step * m.machine.rotor_spin), step, 1.0)


@kernel
def begin_at_end(m: VortexSystem) -> None:
    """Let velocities and influence at the begin of a step be those at the end of the one before."""
    bound, A, n = m.bound, m.bound_influence, m.lifting_line.nodes
    for b in range(m.lifting_line.blades):
        for i in range(n):
            bound.before[b, i] = bound.after[b, i]
            for j in range(n):
                A.before[b, i, j] = A.after[b, i, j]


@kernel
def beyond(m: VortexSystem) -> Vec:
    """Velocity [m/s] at the hub by what the wake leaves out: its last tip vortices as an endless cylinder (VW-19)."""
    zone, last = m.wake_3, whole(m.vortex_state.rows_3) - 1
    if last < 1:
        return Vec(0.0, 0.0, 0.0)
    tip, centre, G = zone.edges - 1, centre_of(zone, m, last, zone.edges - 1), 0.0
    for b in range(zone.blades):
        G += zone.circulation[b, last - 1, tip - 1]
    away = centre - m.machine.hub_position
    z = norm(away)
    radius = around(zone.position[0, last, tip], centre, m)[2]
    # circulation per length along the axis: all blades once a revolution
    per_length = G * m.machine.rotor_speed / (2.0 * pi * max(norm(zone.velocity[0, last, tip]), LEAST_WIND))
    return (-0.5 * per_length * (1.0 - z / sqrt(z * z + radius * radius)) / max(z, TINY)) * away


@kernel
def at_blades(m: VortexSystem, turn: Rot, step: float, share: float) -> None:
    """Compute velocities and influence at the blades after the rotation ``turn`` of the rotor.

    Args:
      step: [s] age of the youngest row, and length of the steps of the wake.
      share: share of the change of the velocities that counts.
    """
    p, s, bound, rest = m.vortex, m.wake_sources, m.bound, beyond(m)
    count = store_wake(s, m, p.blade_core, step, step)
    for b in range(m.lifting_line.blades):
        Q, last = turn @ root_axes(m, b), count
        for c in range(m.lifting_line.blades):
            if c != b:
                last = store_blade(s, last, m, turn, c, p.blade_core, step)
        for i in range(m.lifting_line.nodes):
            x = moved(m, turn, control_point(m, b, i))
            m.wake_point[0], m.wake_point[1], m.wake_point[2] = x.x, x.y, x.z
            u, v, w = induced(m.wake_point, s, 0, last, whole(p.core))
            bound.after[b, i] += share * (into(Q, Vec(u, v, w) + rest) - bound.after[b, i])
        influence(m, turn, b, step)
        factorise(m, b)


@kernel
def lost(zone: WakeZone, m: VortexSystem, number: int) -> bool:
    """Note the first vortex of a zone without a valid position; whether there is one."""
    for b in range(zone.blades):
        for r in range(rows_of(m, number)):
            for e in range(zone.edges):
                if not (norm(zone.position[b, r, e] - m.machine.hub_position) < FAR):
                    m.vortex_state.fault = b + 1.0
                    m.vortex_state.fault_age = age_of(m, number, 1.0 * r) * m.vortex_state.step
                    return True
    return False
