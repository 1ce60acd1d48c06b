"""A developed wake for the start of a run: the helices that the present circulation would have left (VW-21 to VW-23).

Each blade trails vortices of its present circulation, which have moved with the mean wind and with induced velocities
by age and edge. These, the circulation and the velocities at the blades are found in turn.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from meltemi.compiler import Vec, kernel, whole
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import dot
from meltemi.simulation.step import settle_induction
from meltemi.vortex.line import FIRST_GUESS
from meltemi.vortex.tables import VortexSystem, WakeDrift, WakeZone
from meltemi.vortex.wake import (
    around,
    at_blades,
    begin_at_end,
    centre_of,
    mean_wind,
    merge,
    refresh,
    revolution,
    shed_row,
    store_present,
    wake_step,
)

SHARE, CALM = 0.5, 12.0
"""Share of the change of the velocities in a sweep; sweeps after which it falls, as the roll-up of a wake is never at
rest."""


@settle_induction.variant
@kernel
def _(m: VortexSystem) -> None:
    """One sweep: place all vortices; a share of the changes at the blades, and of every second by age, counts."""
    state = m.vortex_state
    step = state.step = wake_step(m)
    share = SHARE * min(CALM / max(state.turn, 1.0), 1.0)
    if state.rows_1 < 1.0:
        guess(m.drift_1, m, step, 0.0)
        guess(m.drift_2, m, step * m.vortex.merge_2, step * m.vortex.panels_1)
    build(m, step)
    count, odd = store_present(m), whole(state.turn) % 2
    for r in range(odd, whole(state.rows_1), 2):
        refresh(m.wake_1, m.drift_1, m, 1, r, count, share)
    for r in range(odd, whole(state.rows_2), 2):
        refresh(m.wake_2, m.drift_2, m, 2, r, count, share)
    state.step = 0.0  # the blades are where they are
    at_blades(m, rotation(Vec(0.0, 0.0, 0.0)), step, share)
    begin_at_end(m)
    state.step, state.begin = step, state.time - step
    state.turn += 1.0
    m.induction_time.elapsed = step  # a row leaves the blades at once


@kernel
def guess(drift: WakeDrift, m: VortexSystem, step: float, age: float) -> None:
    """Set the induced velocities of a zone to those of a vortex cylinder, rows ``step`` [s] apart from ``age`` [s]."""
    w, R = FIRST_GUESS * m.rotor.axial_wind, m.vortex.radius
    for r in range(drift.ages):
        z = (age + step * r) * (m.rotor.axial_wind - w)
        for e in range(drift.edges):
            drift.axial[r, e] = -w * (1.0 + z / sqrt(z * z + R * R))
            drift.radial[r, e] = drift.tangential[r, e] = 0.0


@kernel
def build(m: VortexSystem, step: float) -> None:
    """Set all vortices to those that the present circulation would have left in a wake that moves steadily (VW-21)."""
    state, p = m.vortex_state, m.vortex
    state.rows_1 = 0.0
    shed_row(m)
    state.rows_1, state.rows_2, state.rows_3 = p.panels_1 + 1.0, p.panels_2 + 1.0, p.panels_3 + 1.0
    trace(m.wake_1, m.drift_1, m, step, whole(state.rows_1), 1)
    merge(m.wake_1, m.wake_2, whole(p.panels_1), 1)
    trace(m.wake_2, m.drift_2, m, step * p.merge_2, whole(state.rows_2), 0)
    merge(m.wake_2, m.wake_3, whole(p.panels_2), 1)
    rows, half, mean = whole(state.rows_2), m.drift_2.edges // 2, 0.0
    first = max(rows - revolution(m), 0)
    for r in range(first, rows):
        for e in range(half, m.drift_2.edges):
            mean += m.drift_2.axial[r, e] / (half * (rows - first))
    for r in range(m.drift_3.ages):
        for e in range(m.drift_3.edges):
            m.drift_3.axial[r, e] = mean
    trace(m.wake_3, m.drift_3, m, step * p.merge_2 * p.merge_3, whole(state.rows_3), 0)


@kernel
def trace(zone: WakeZone, drift: WakeDrift, m: VortexSystem, step: float, rows: int, lead: int) -> None:
    """Set the rows of a zone to the steady path of the vortices of its row 0 (VW-22).

    Row r was where row 0 is, or with ``lead`` 1 where it would be a step earlier, when the rotor was (r + lead) steps
    before its present azimuth; since then it has moved with the mean wind and the induced velocity.
    """
    s, wind, spin = m.machine.shaft, mean_wind(m), dot(m.machine.rotor_spin, m.machine.shaft)
    for e in range(zone.edges):
        first = centre_of(zone, m, 0, e)
        for b in range(zone.blades):
            begin = zone.position[b, 0, e]
            away, about, distance = around(begin, first, m)
            axial, angle = dot(begin - first, s), 0.0
            for r in range(rows):
                last = max(r - 1, 0)
                if r + lead > 0:
                    axial += 0.5 * step * (drift.axial[last, e] + drift.axial[r, e])
                    distance += 0.5 * step * (drift.radial[last, e] + drift.radial[r, e])
                    about_axis = 0.5 * step * (drift.tangential[last, e] + drift.tangential[r, e])
                    angle += about_axis / max(distance, 1e-3) - step * spin
                e_r = cos(angle) * away + sin(angle) * about
                e_t = cos(angle) * about - sin(angle) * away
                age = step * (r + lead)
                zone.position[b, r, e] = first + age * wind + axial * s + distance * e_r
                zone.velocity[b, r, e] = (
                    wind + drift.axial[r, e] * s + drift.radial[r, e] * e_r + drift.tangential[r, e] * e_t
                )
                zone.width2[b, r, e] = zone.width2[b, 0, e]
                zone.circulation[b, r, e] = zone.circulation[b, 0, e]
