"""Flow past a section in unsteady motion, for the stall models: angle of attack, rotation, fading into the polar.

A coned or bent blade turns about its span with the rotor: the flow is curved, which acts like camber (in
alpha and in the moment). It is no pitching: the air beside the section is not accelerated, so there is no
added mass in it. OpenFAST takes both for the same; that is a variant.

The models give way to the static polar between 40 and 45 degrees and below 1 m/s.

Reference: docs/theory/aerodynamics.md (A-31, A-32, A-41); curved flow as Migliore, Wolfe & Fanucci (1980), J. Energy
4(2).
"""

from __future__ import annotations

from math import atan2, cos, pi, sin
from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.aero.bem import STILL
from meltemi.aero.polars import ramp
from meltemi.core.kernel import kernel
from meltemi.maths.generic import crossed, where, whole

NO_ROTATION, CAMBER, OPENFAST = 0, 1, 2
"""Values of ``AeroOptions.stall_rotation``."""

FADE_FROM, FADE_TO = 40.0 * pi / 180.0, 45.0 * pi / 180.0
"""[rad] angles of attack between which the model gives way to the static polar."""
SLOW_FROM, SLOW_TO = 0.01, 1.0
"""[m/s] the same for the relative speed."""
MAX_REDUCED_RATE = 1.5
"""Limit of T omega: beyond, the section turns faster than the air passes it."""


class Rotation(NamedTuple):
    """Rotation of a section about its span, in angles: T omega in all, T omega of pitching, tilt of the lift."""

    turning: float
    pitching: float
    tilt: float


class SectionFlow(NamedTuple):
    """What drives a stall model.

    Attributes:
      polar: its number.
      alpha: [rad] angle of attack at 3/4 chord.
      rate: [1/s] relative speed over half the chord.
      rotation: of the section.
      flap: [rad] angle that stands for the lift of its flaps (A-48).
      weight: of the model against the static polar (A-41).
    """

    polar: int
    alpha: float
    rate: float
    rotation: Rotation
    flap: float
    weight: float


@kernel
def section_flow(flap: float, m: Air, b: int, n: int) -> SectionFlow:
    """Flow past the section at a node; ``flap`` [rad] is the angle that stands for the lift of its flaps."""
    flow, variant, chord = m.flow, m.aero_options.stall_rotation, m.aero_nodes.chord[b, n]
    g, alpha, speed = whole(m.aero_nodes.polar[b, n]), flow.alpha[b, n], flow.speed[b, n]
    rate = 2.0 * max(speed, STILL) / chord
    turn = where(variant != NO_ROTATION, flow.rotation[b, n], 0.0)
    alpha_34 = angle_at_three_quarters(alpha, speed, turn, chord)
    rotation = section_rotation(variant, turn, flow.pitching[b, n], rate)
    return SectionFlow(g, alpha_34, rate, rotation, flap, model_weight(alpha, speed, g, m))


@kernel
def model_weight(alpha: float, speed: float, g: int, m: Air) -> float:
    """Weight of the stall model against the static polar (A-41)."""
    fade = (1.0 - ramp(abs(alpha), FADE_FROM, FADE_TO)) * ramp(speed, SLOW_FROM, SLOW_TO)
    return m.section.dynamic[g] * fade


@kernel
def count_switches(m: Air, b: int, n: int) -> None:
    """Count that the model comes or goes within the difference step of a derivative run."""
    flow, g = m.flow, whole(m.aero_nodes.polar[b, n])
    crossings = crossed(abs(flow.alpha[b, n]) - FADE_TO) + crossed(flow.speed[b, n] - SLOW_FROM)
    m.memory.switches[b, n] += m.section.dynamic[g] * crossings


@kernel
def angle_at_three_quarters(alpha: float, speed: float, rotation: float, chord: float) -> float:
    """Angle of attack [rad] at 3/4 chord from that at the aerodynamic centre, half a chord ahead (A-31)."""
    return atan2(speed * sin(alpha) + 0.5 * rotation * chord, speed * cos(alpha))


@kernel
def reduced_rate(rotation: float, rate: float) -> float:
    """T omega, limited."""
    return min(max(rotation / rate, -MAX_REDUCED_RATE), MAX_REDUCED_RATE)


@kernel
def section_rotation(variant: int, rotation: float, pitching: float, rate: float) -> Rotation:
    """What the rotation of a section [rad/s], and the pitching in it, do (A-32)."""
    turning = where(variant == NO_ROTATION, 0.0, reduced_rate(rotation, rate))
    return Rotation(
        turning,
        where(variant == CAMBER, reduced_rate(pitching, rate), turning),
        where(variant == OPENFAST, turning, 0.0),
    )
