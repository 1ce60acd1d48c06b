"""Coleman (multiblade) transformation at any multiple n of the rotor speed, for controllers.

    x_tilt = 2/N sum x_i cos(n psi_i),   x_yaw = 2/N sum x_i sin(n psi_i),   psi_i = psi + 2 pi (i - 1) / N
    x_i = x_tilt cos(n psi_i + phi) + x_yaw sin(n psi_i + phi)

A signal of the blades at exactly nP, a cos(n psi_i) + b sin(n psi_i), becomes the constants a and b, and the inverse
with phi = 0 gives it back. Other harmonics m of the blades leak in as n - m and n + m wherever these are multiples of
N: 1P in the coordinates of 2P appears as 3P. So filter the blades' signals about nP first. The factor 2/N keeps
amplitudes; the moment on the hub is N/2 times the result. Two n must be no multiple of N (``check_harmonic``).

These are kernels for any n with an offset. ``meltemi.maths.multiblade`` has the matrices of n = 1 for linear models.

Reference: docs/theory/control.md (C-18 and C-19); Bir (2008), NREL/CP-500-42553.
"""

from __future__ import annotations

from math import cos, pi, sin

from meltemi.compiler import Numbers, kernel


@kernel
def blade_angle(azimuth: float, blade: int, blades: int) -> float:
    """Azimuth [rad] of blade 0, 1, ... of ``blades`` from that of the first one."""
    return azimuth + 2.0 * pi * blade / blades


@kernel
def to_fixed(values: Numbers, blades: int, azimuth: float, harmonic: int) -> tuple[float, float]:
    """Tilt (cosine) and yaw (sine) component of a blade quantity (C-18).

    Args:
      values: blade values, such as ``measured.out_of_plane_moment``.
      blades: number N of blades.
      azimuth: [rad] azimuth of the first blade.
      harmonic: multiple n of the rotor speed.

    Returns:
      Both parts, in the unit of the values.
    """
    tilt, yaw = 0.0, 0.0
    for i in range(blades):
        angle = harmonic * blade_angle(azimuth, i, blades)
        tilt += values[i] * cos(angle)
        yaw += values[i] * sin(angle)
    return 2.0 / blades * tilt, 2.0 / blades * yaw


@kernel
def to_blade(tilt: float, yaw: float, blade: int, blades: int, azimuth: float, harmonic: int, offset: float) -> float:
    """Value for one blade from the tilt and yaw component (C-19).

    Args:
      tilt: cosine part, of any unit.
      yaw: sine part.
      blade: 0 for the first one.
      blades: number N of blades.
      azimuth: [rad] azimuth of the first blade.
      harmonic: multiple n of the rotor speed.
      offset: [rad] phase lead of the demand at the harmonic: the lag of filters and actuator.
    """
    angle = harmonic * blade_angle(azimuth, blade, blades) + offset
    return tilt * cos(angle) + yaw * sin(angle)


@kernel
def add_to_blades(
    values: Numbers, blades: int, tilt: float, yaw: float, azimuth: float, harmonic: int, offset: float
) -> None:
    """Add the values of all blades to ``values``, such as ``demands.pitch``; arguments as for ``to_blade``."""
    for i in range(blades):
        values[i] += to_blade(tilt, yaw, i, blades, azimuth, harmonic, offset)
