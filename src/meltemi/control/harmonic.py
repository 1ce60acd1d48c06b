"""One feedback loop at a multiple of the rotor speed: blade moments in, pitch or flap demands of the blades out.

    moments -> band-pass about nP -> multi-blade coordinates of nP -> PI or PID law for tilt and for yaw
            -> back to the blades, ahead by the phase offset

The reference of both axes is zero, so what is left of the blades' moments at nP goes to zero. Gains are in demand over
moment; a positive one takes a moment down that falls with the demand, as with pitch; flaps need a negative one. Gains
may fall with the collective pitch, as those of the collective law do. Settings and state of a loop lie in a vector from
the place ``at`` on: ``HARMONIC``, two places of band-pass for each blade, and the two axes (``INTEGRATOR``).

Reference: docs/theory/control.md (C-27 to C-30).
"""

from __future__ import annotations

from math import cos, sin

from numpy import float64
from numpy.typing import NDArray

from meltemi.control.filters import SECOND_ORDER_STATES, band_pass
from meltemi.control.integrator import IntegratorState, give_back, integrator
from meltemi.control.multiblade import add_to_blades, to_fixed
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole
from meltemi.maths.tables import MAX_BLADES, Numbers, Table, blades, number

Float = NDArray[float64]


class HarmonicState(Table, title="harmonic loop"):
    """Settings of a loop and what the last call gave."""

    harmonic: float = number("-", "multiple n of the rotor speed")
    damping: float = number("-", "damping ratio of the band-pass about nP; 0: none")
    offset: float = number("rad", "of the harmonic's phase, by which the demand leads")
    halving_pitch: float = number("rad", "collective pitch at which the gains are halved; 0: they stay")
    authority: float = number("rad", "limit of the tilt and of the yaw demand")
    group: float = number("-", "of actuators that the loop moves: 0 pitch, 1 to 4 that flap")
    tilt: float = number("rad", "demand of the last call")
    yaw: float = number("rad", "demand of the last call")
    signal: Numbers = blades("N m", "band-passed moments of the last call")


ORDER, DAMPING, OFFSET, HALVING, AUTHORITY, GROUP, TILT, YAW, SIGNAL = HarmonicState.slots(
    "harmonic damping offset halving_pitch authority group tilt yaw signal"
)
FILTERS = len(HarmonicState)
TILT_AXIS = FILTERS + SECOND_ORDER_STATES * MAX_BLADES
YAW_AXIS = TILT_AXIS + len(IntegratorState)
LOOP_STATES = YAW_AXIS + len(IntegratorState)
"""How many places of a vector a loop takes."""
LOOP_NAMES = (
    *HarmonicState.names,
    *(f"band_pass_{blade + 1}_{state + 1}" for blade in range(MAX_BLADES) for state in range(SECOND_ORDER_STATES)),
    *(f"{axis}_{name}" for axis in ("tilt", "yaw") for name in IntegratorState.names),
)
"""What stands in them."""


@kernel
def harmonic_loop(
    x: Float, at: int, moments: int, blades: int, azimuth: float, speed: float, pitch: float, dt: float
) -> None:
    """One call: new tilt and yaw demand in ``x[at + TILT]`` and ``x[at + YAW]`` (C-27, C-28).

    Args:
      x: vector with settings and state from the place ``at`` on.
      moments: place in ``x`` of the blades' moments [N m].
      blades: their number.
      azimuth: [rad] of the first blade.
      speed: [rad/s] of the rotor.
      pitch: [rad] collective, for the schedule of the gains.
      dt: [s] since the last call.
    """
    n = whole(x[at + ORDER])
    for i in range(blades):
        x[at + SIGNAL + i] = x[moments + i]
        if x[at + DAMPING] > 0.0:
            place = at + FILTERS + SECOND_ORDER_STATES * i
            x[at + SIGNAL + i] = band_pass(x, place, x[moments + i], n * speed, x[at + DAMPING], dt)
    tilt, yaw = to_fixed(x, at + SIGNAL, blades, azimuth, n)
    if x[at + HALVING] > 0.0:
        schedule = 1.0 / (1.0 + pitch / x[at + HALVING])
        tilt, yaw = schedule * tilt, schedule * yaw
    most = x[at + AUTHORITY]
    x[at + TILT] = integrator(x, at + TILT_AXIS, tilt, -most, most, dt)
    x[at + YAW] = integrator(x, at + YAW_AXIS, yaw, -most, most, dt)


@kernel
def add_demands(x: Float, at: int, demands: int, blades: int, azimuth: float) -> None:
    """Add the loop's demands of the blades to those from the place ``demands`` of ``x`` on (C-29)."""
    add_to_blades(x, demands, blades, x[at + TILT], x[at + YAW], azimuth, whole(x[at + ORDER]), x[at + OFFSET])


@kernel
def take_back(x: Float, at: int, missing: int, blades: int, azimuth: float, dt: float) -> None:
    """Draw both integrals to what the actuators can do (C-30).

    Args:
      missing: place in ``x`` of what each blade does less than was demanded of it [rad].
    """
    tilt, yaw = to_fixed(x, missing, blades, azimuth, whole(x[at + ORDER]))
    c, s = cos(x[at + OFFSET]), sin(x[at + OFFSET])
    give_back(x, at + TILT_AXIS, 0.0, c * tilt - s * yaw, dt)
    give_back(x, at + YAW_AXIS, 0.0, s * tilt + c * yaw, dt)
