"""Individual pitch or flap control at a multiple of the rotor speed, from the blade root moments.

    moments -> band-pass about nP -> multi-blade coordinates of nP -> PI or PID law for tilt and for yaw
            -> back to the blades, ahead by the phase offset

The reference of both axes is zero, so the blade moments at nP are controlled to zero. Gains are demand over moment; a
positive gain reduces a moment that decreases with the demand, as for pitch; flaps need a negative one. Gains may be
scheduled with the collective pitch, like those of the collective law.

Reference: docs/theory/control.md (C-27 to C-30).
"""

from __future__ import annotations

from math import cos, sin

from meltemi.compiler import MAX_BLADES, Entries, Numbers, Table, blades, kernel, number, part, parts, whole
from meltemi.control_laws.filters import SecondOrder, band_pass
from meltemi.control_laws.integrator import Integrator, back_calculate, integrator
from meltemi.control_laws.multiblade import add_to_blades, to_fixed


class HarmonicState(Table, title="harmonic loop"):
    """Settings and state of a loop."""

    harmonic: float = number("-", "multiple n of the rotor speed")
    damping: float = number("-", "damping ratio of the band-pass about nP; 0: none")
    offset: float = number("rad", "phase lead of the demand at the harmonic")
    halving_pitch: float = number("rad", "collective pitch at which the gains are halved; 0: constant gains")
    authority: float = number("rad", "limit of the tilt and of the yaw demand")
    group: float = number("-", "group of actuators of the loop: 0 pitch, 1 to 4 the number of a flap")
    tilt: float = number("rad", "demand of the last call")
    yaw: float = number("rad", "demand of the last call")
    signal: Numbers = blades("N m", "band-passed moments of the last call")
    band_pass: Entries[SecondOrder] = parts(SecondOrder, MAX_BLADES, "filter of each blade's moment")
    tilt_axis: Integrator = part(Integrator, "law of the tilt demand", prefix="tilt")
    yaw_axis: Integrator = part(Integrator, "law of the yaw demand", prefix="yaw")


@kernel
def harmonic_loop(
    x: HarmonicState, moment: Numbers, blades: int, azimuth: float, speed: float, pitch: float, dt: float
) -> None:
    """One call: new demands ``x.tilt`` and ``x.yaw`` (C-27, C-28).

    Args:
      x: settings and state.
      moment: blade moments [N m].
      blades: number of blades.
      azimuth: [rad] azimuth of the first blade.
      speed: [rad/s] rotor speed.
      pitch: [rad] collective pitch, for gain scheduling.
      dt: [s] since the last call.
    """
    n = whole(x.harmonic)
    for b in range(blades):
        x.signal[b] = moment[b]
        if x.damping > 0.0:
            x.signal[b] = band_pass(x.band_pass[b], moment[b], n * speed, x.damping, dt)
    tilt, yaw = to_fixed(x.signal, blades, azimuth, n)
    if x.halving_pitch > 0.0:
        schedule = 1.0 / (1.0 + pitch / x.halving_pitch)
        tilt, yaw = schedule * tilt, schedule * yaw
    most = x.authority
    x.tilt = integrator(x.tilt_axis, tilt, -most, most, dt)
    x.yaw = integrator(x.yaw_axis, yaw, -most, most, dt)


@kernel
def add_demands(x: HarmonicState, demand: Numbers, blades: int, azimuth: float) -> None:
    """Add the loop's demands to those of the blades (C-29)."""
    add_to_blades(demand, blades, x.tilt, x.yaw, azimuth, whole(x.harmonic), x.offset)


@kernel
def back_calculate_loop(x: HarmonicState, missing: Numbers, blades: int, azimuth: float, dt: float) -> None:
    """Anti-windup of both integrals by the demands after the limits of the actuators (C-30).

    Args:
      missing: [rad] demand of each blade after the limits minus that before.
    """
    tilt, yaw = to_fixed(missing, blades, azimuth, whole(x.harmonic))
    c, s = cos(x.offset), sin(x.offset)
    back_calculate(x.tilt_axis, 0.0, c * tilt - s * yaw, dt)
    back_calculate(x.yaw_axis, 0.0, s * tilt + c * yaw, dt)
