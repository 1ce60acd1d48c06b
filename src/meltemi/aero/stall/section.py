"""Flow past a section in unsteady motion, for the stall models: angle of attack, rotation, fading into the polar.

A coned or bent blade turns about its span with the rotor: the flow is curved, which acts like camber (in
alpha and in the moment). It is not pitching: the air beside the section is not accelerated, so there is no
added mass in it. OpenFAST does not distinguish the two; that is a variant.

In reversed flow the trailing edge leads: the lift acts at 3/4 chord, and the angle at the aerodynamic centre drives it.
The models fade into the static polar between 40 and 45 degrees from the chord and below 1 m/s.

Reference: docs/theory/aerodynamics.md (A-31, A-32, A-41, A-42c); curved flow as Migliore, Wolfe & Fanucci (1980), J.
Energy 4(2).
"""

from __future__ import annotations

from math import atan2, cos, pi, sin
from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.aero.bem import STILL
from meltemi.aero.polars import ramp
from meltemi.compiler import crossed, kernel, where, whole

NO_ROTATION, CAMBER, OPENFAST = 0, 1, 2
"""Values of ``AeroOptions.stall_rotation``."""

FADE_FROM, FADE_TO = 40.0 * pi / 180.0, 45.0 * pi / 180.0
"""[rad] angles of attack, from the chord, between which the model fades into the static polar."""
SLOW_FROM, SLOW_TO = 0.01, 1.0
"""[m/s] relative speeds between which it does the same."""
MAX_REDUCED_RATE = 1.5
"""Limit of T omega, beyond which the section turns faster than the air passes it."""


class Rotation(NamedTuple):
    """Reduced rotation of a section about its span: total T omega, T omega of pitching, tilt of the lift [rad]."""

    turning: float
    pitching: float
    tilt: float


class SectionFlow(NamedTuple):
    """Input of a stall model at a node.

    Attributes:
      polar: number of the polar.
      alpha: [rad] angle of attack at 3/4 chord; in reversed flow that from behind at the aerodynamic centre.
      reversed: 1 in reversed flow, else 0.
      rate: [1/s] relative speed over half the chord.
      rotation: reduced rotation of the section.
      flap: [rad] equivalent angle of its flaps (A-48).
      weight: weight of the stall model against the static polar (A-41).
    """

    polar: int
    alpha: float
    reversed: float
    rate: float
    rotation: Rotation
    flap: float
    weight: float


@kernel
def section_flow(flap: float, m: Air, b: int, n: int) -> SectionFlow:
    """Flow past the section at a node; ``flap`` [rad] is the equivalent angle of its flaps."""
    flow, variant, chord = m.flow, m.aero_options.stall_rotation, m.aero_nodes.chord[b, n]
    g, alpha, speed = whole(m.aero_nodes.polar[b, n]), flow.alpha[b, n], flow.speed[b, n]
    rate = 2.0 * max(speed, STILL) / chord
    turn = where(variant != NO_ROTATION, flow.rotation[b, n], 0.0)
    behind = from_behind(alpha, m)
    angle = where(behind > 0.0, alpha - where(alpha > 0.0, pi, -pi), angle_at_three_quarters(alpha, speed, turn, chord))
    rotation = section_rotation(variant, turn, flow.pitching[b, n], rate)
    return SectionFlow(g, angle, behind, rate, rotation, flap, model_weight(alpha, speed, g, m))


@kernel
def from_behind(alpha: float, m: Air) -> float:
    """1 where the model is that of reversed flow, else 0."""
    return m.aero_options.reversed_flow * where(abs(alpha) > 0.5 * pi, 1.0, 0.0)


@kernel
def model_weight(alpha: float, speed: float, g: int, m: Air) -> float:
    """Weight of the stall model against the static polar (A-41)."""
    from_chord = where(from_behind(alpha, m) > 0.0, pi - abs(alpha), abs(alpha))
    fade = (1.0 - ramp(from_chord, FADE_FROM, FADE_TO)) * ramp(speed, SLOW_FROM, SLOW_TO)
    return m.section.dynamic[g] * fade


@kernel
def count_switches(m: Air, b: int, n: int) -> None:
    """Count where the model would switch on or off within the difference step of a derivative run."""
    flow, g = m.flow, whole(m.aero_nodes.polar[b, n])
    ends = crossed(abs(flow.alpha[b, n]) - FADE_TO) + crossed(pi - abs(flow.alpha[b, n]) - FADE_TO)
    crossings = ends + crossed(flow.speed[b, n] - SLOW_FROM)
    m.memory.switches[b, n] += m.section.dynamic[g] * crossings


@kernel
def angle_at_three_quarters(alpha: float, speed: float, rotation: float, chord: float) -> float:
    """Angle of attack [rad] at 3/4 chord from that at the aerodynamic centre, half a chord ahead (A-31)."""
    return atan2(speed * sin(alpha) + 0.5 * rotation * chord, speed * cos(alpha))


@kernel
def reduced_rate(rotation: float, rate: float) -> float:
    """Reduced rotation T omega, limited."""
    return min(max(rotation / rate, -MAX_REDUCED_RATE), MAX_REDUCED_RATE)


@kernel
def section_rotation(variant: int, rotation: float, pitching: float, rate: float) -> Rotation:
    """Effect of the rotation of a section [rad/s] and of its part from pitching, by the chosen variant (A-32)."""
    turning = where(variant == NO_ROTATION, 0.0, reduced_rate(rotation, rate))
    return Rotation(
        turning,
        where(variant == CAMBER, reduced_rate(pitching, rate), turning),
        where(variant == OPENFAST, turning, 0.0),
    )
