"""Rotation by a rotation vector theta, with its angular velocity and acceleration.

    R = 1 + (1 - a^2 d) theta~ + c theta~ theta~,   w = theta' + c theta x theta' + d theta x (theta x theta')

with a = |theta|, c = (1 - cos a) / a^2, d = (a - sin a) / a^3. The series of c and d hold to rounding up to 1 rad, and
to 1e-8 up to 3 rad; they need no distinction of small angles, so that lanes can evaluate them.

Reference: docs/theory/structure.md (S-13, S-14); Géradin & Cardona (2001), Flexible Multibody Dynamics, chapter 4.
"""

from __future__ import annotations

from math import atan2, factorial, sqrt

from meltemi.compiler import kernel
from meltemi.maths.vectors import Rot, Vec, cross, dot

C0, C1, C2, C3, C4, C5, C6, C7 = ((-1.0) ** k / factorial(2 * k + 2) for k in range(8))
D0, D1, D2, D3, D4, D5, D6, D7 = ((-1.0) ** k / factorial(2 * k + 3) for k in range(8))


@kernel
def coefficients(a2: float) -> tuple[float, float]:
    """Coefficients c and d for the square of the angle."""
    c = C0 + a2 * (C1 + a2 * (C2 + a2 * (C3 + a2 * (C4 + a2 * (C5 + a2 * (C6 + a2 * C7))))))
    d = D0 + a2 * (D1 + a2 * (D2 + a2 * (D3 + a2 * (D4 + a2 * (D5 + a2 * (D6 + a2 * D7))))))
    return c, d


@kernel
def slopes(a2: float) -> tuple[float, float]:
    """Derivatives of c and d by the square of the angle."""
    c = C1 + a2 * (2.0 * C2 + a2 * (3.0 * C3 + a2 * (4.0 * C4 + a2 * (5.0 * C5 + a2 * (6.0 * C6 + a2 * 7.0 * C7)))))
    d = D1 + a2 * (2.0 * D2 + a2 * (3.0 * D3 + a2 * (4.0 * D4 + a2 * (5.0 * D5 + a2 * (6.0 * D6 + a2 * 7.0 * D7)))))
    return c, d


@kernel
def _matrix(theta: Vec, s: float, c: float) -> Rot:
    """1 + s theta~ + c theta~ theta~."""
    x, y, z = theta.x, theta.y, theta.z
    return Rot(
        1.0 - c * (y * y + z * z),
        c * x * y - s * z,
        c * x * z + s * y,
        c * x * y + s * z,
        1.0 - c * (x * x + z * z),
        c * y * z - s * x,
        c * x * z - s * y,
        c * y * z + s * x,
        1.0 - c * (x * x + y * y),
    )


@kernel
def rotation(theta: Vec) -> Rot:
    """Rotation by |theta| [rad] about theta."""
    a2 = dot(theta, theta)
    c, d = coefficients(a2)
    return _matrix(theta, 1.0 - a2 * d, c)


@kernel
def tangent(theta: Vec) -> Rot:
    """Matrix T of the angular velocity T rate of the rotation by ``theta`` that changes at ``rate``."""
    c, d = coefficients(dot(theta, theta))
    return _matrix(theta, c, d)


@kernel
def rotation_vector(R: Rot) -> Vec:
    """Rotation vector [rad] of a rotation by less than pi."""
    v = 0.5 * Vec(R.zy - R.yz, R.xz - R.zx, R.yx - R.xy)
    s = sqrt(dot(v, v) + 1e-300)
    return atan2(s, 0.5 * (R.xx + R.yy + R.zz - 1.0)) / s * v


@kernel
def angular_velocity(theta: Vec, rate: Vec) -> Vec:
    """Angular velocity [rad/s] of the rotation by ``theta`` that changes at ``rate``, in the axes that it rotates."""
    c, d = coefficients(dot(theta, theta))
    once = cross(theta, rate)
    return rate + c * once + d * cross(theta, once)


@kernel
def angular_acceleration(theta: Vec, rate: Vec) -> Vec:
    """Time derivative [rad/s^2] of this angular velocity at a constant ``rate``."""
    a2 = dot(theta, theta)
    _, d = coefficients(a2)
    dc, dd = slopes(a2)
    once = cross(theta, rate)
    change = 2.0 * dot(theta, rate) * (dc * once + dd * cross(theta, once))
    return change + d * cross(rate, once)
