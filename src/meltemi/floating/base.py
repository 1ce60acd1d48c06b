"""A floating platform as the base of a tower: its records and its motion.

Its six motions are those of the tower's base: three displacements, then a rotation vector. The hull of a flexible
platform also moves with the modes of tower and frame, and the water and the lines act on the mean of its motion.

Reference: docs/theory/floating.md (W-7), docs/theory/frames.md (F-73).
"""

from __future__ import annotations

from math import atan2, sqrt
from typing import NamedTuple

from meltemi.compiler import (
    Array1,
    Array2,
    Array3,
    Constant,
    Numbers,
    Rot,
    Single,
    Table,
    Vec,
    Vectors,
    kernel,
    number,
    xyz,
)
from meltemi.compiler import rotation as matrix
from meltemi.floating.mooring import Moorings
from meltemi.floating.moving_base import MovingBase, base_motion, base_row
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import cross
from meltemi.simulation.system import System


class Floater(Table):
    """Constants of the platform."""

    mass: float = number("kg", "mass of the platform with ballast")
    centre: Vec = xyz("m", "centre of mass, from the platform's point")
    inertia: Vec = xyz("kg m^2", "moments of inertia about the centre of mass")
    displaced: float = number("kg", "mass of the displaced water at rest")
    buoyancy_x: float = number("m", "x of the centre of buoyancy")
    buoyancy_y: float = number("m", "y of the centre of buoyancy")
    step: float = number("s", "interval between the samples of the waves")
    period: float = number("s", "period after which the waves repeat")
    bed: float = number("m", "height of the sea bed")
    current: Vec = xyz("m/s", "velocity of the water at the height of the centre of mass, without waves")


class RadiationState(Table, axes="mode"):
    """Memory of radiated waves: complex amplitudes of decaying oscillations."""

    real: Numbers = number("m", "state: real part")
    imaginary: Numbers = number("m", "state: imaginary part")


class DragStrip(Table, axes="strip", title="strip"):
    """Constants of the pieces of members that have drag."""

    place: Vectors = xyz("m", "position of the piece on the platform")
    axis: Vectors = xyz("-", "direction of the member")
    drag: Numbers = number("kg/m", "drag across the member over velocity squared")
    plate: Numbers = number("kg/m", "drag along the member over velocity squared")


class PlatformState(Table):
    """Motion of the platform's point, and loads about it."""

    elevation: float = number("m", "elevation of the surface at the origin")
    displacement: Vec = xyz("m", "displacement of the platform's point")
    angle: Vec = xyz("rad", "roll, pitch, yaw: rotations about x, then y, then z")
    orientation: Rot = matrix("-", "orientation of the hull")
    velocity: Vec = xyz("m/s", "velocity of the platform's point")
    spin: Vec = xyz("rad/s", "angular velocity")
    bias: Vec = xyz("m/s^2", "acceleration of the point without that of coordinates")
    force: Vec = xyz("N", "force of the water: buoyancy, waves, radiation with added mass, drag")
    moment: Vec = xyz("N m", "moment of the water about the platform's point")
    mooring_force: Vec = xyz("N", "force of the mooring lines")
    mooring_moment: Vec = xyz("N m", "moment of the mooring lines about the platform's point")
    offset: float = number("m", "horizontal distance of the point from its place at rest")
    tilt: float = number("rad", "tilt of the platform's vertical axis")


class FloaterSystem(System, MovingBase, Moorings):
    """A floating turbine.

    Attributes:
      float_matrices: (5, 6, 6) as rows of (30, 6): added mass, stiffness of the water, further stiffness, linear and
        quadratic damping; that of the water over gravity.
      float_waves: (T, 7) elevation, and forces and moments of the waves.
      float_lines, float_forces: (M, 3), (H, M, 12) waves that push the platform where it is: frequency, wave numbers,
        and forces at its headings, real parts first.
      float_pole, float_input, float_output: (P, 2), (P, 12), (P, 12) oscillations of the radiation, real parts first.
      float_decay: (P, 5) step, what the oscillations keep over it, and the integral of that, real parts first.
      float_flow: (T, 3 P) velocity of the water at the strips.
      hull_shape: (k, 6) mean motion of the hull of a flexible platform by the k modes of tower and frame; of a rigid
        one (0, 6).
      platform_columns: (k + 6, 6) velocities of the platform's point, linear and angular, by unit rates of these modes
        and of the base's motions.
      base_six: (7, 6) forces and moments, or other pairs of vectors, in the rows ``BODY_VELOCITY`` to ``WHOLE_LOAD``.
    """

    floater: Floater
    platform: PlatformState
    radiation: Single[RadiationState]
    d_radiation: Single[RadiationState]
    strip: Single[DragStrip]
    float_flow: Constant[Array2]
    float_matrices: Constant[Array2]
    float_waves: Constant[Array2]
    float_lines: Constant[Array2]
    float_forces: Constant[Array3]
    float_pole: Constant[Array2]
    float_decay: Array2
    float_input: Constant[Array2]
    float_output: Constant[Array2]
    hull_shape: Constant[Array2]
    platform_columns: Array2
    base_six: Array2


BODY_VELOCITY, WATER_LOAD, FURTHER_LOAD, PLACE, AGAINST_CURRENT, BODY_DRAG, WHOLE_LOAD = range(7)
"""Rows of ``base_six``: velocity in the platform's axes; load of the water without added mass; further load; position;
velocity against the current, and drag, in the platform's axes; load of the water with added mass."""


@kernel
def six(i: int, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Force and moment, or what else is in a row of ``base_six``."""
    x = m.base_six
    return Vec(x[i, 0], x[i, 1], x[i, 2]), Vec(x[i, 3], x[i, 4], x[i, 5])


@kernel
def keep_six(i: int, u: Vec, w: Vec, m: FloaterSystem) -> None:
    """Put two vectors into a row of ``base_six``."""
    x = m.base_six
    x[i, 0], x[i, 1], x[i, 2], x[i, 3], x[i, 4], x[i, 5] = u.x, u.y, u.z, w.x, w.y, w.z


@kernel
def first_moving(m: FloaterSystem) -> int:
    """Index of the first coordinate that moves the hull."""
    return base_row(m) - m.hull_shape.shape[0]


@kernel
def column(k: int, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Velocity of the platform's point, and angular velocity, by unit rate of the ``k``-th coordinate that moves it."""
    J = m.platform_columns
    return Vec(J[k, 0], J[k, 1], J[k, 2]), Vec(J[k, 3], J[k, 4], J[k, 5])


@kernel
def keep_column(k: int, T: Vec, W: Vec, m: FloaterSystem) -> None:
    """Set the velocities that :func:`column` returns."""
    J = m.platform_columns
    J[k, 0], J[k, 1], J[k, 2] = T.x, T.y, T.z
    J[k, 3], J[k, 4], J[k, 5] = W.x, W.y, W.z


class Motion(NamedTuple):
    """Orientation and angular velocity of the platform, and displacement and velocity of its point."""

    orientation: Rot
    spin: Vec
    displacement: Vec
    velocity: Vec


@kernel
def hull_mean(x: Array1, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Mean displacement and rotation of the hull by the modes, with amplitudes or their rates ``x``; base axes."""
    H, u, tilt = m.hull_shape, Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(H.shape[0]):
        u += x[k] * Vec(H[k, 0], H[k, 1], H[k, 2])
        tilt += x[k] * Vec(H[k, 3], H[k, 4], H[k, 5])
    return u, tilt


@kernel
def point_motion(m: FloaterSystem) -> Motion:
    """Motion of the platform's point by the present coordinates (W-7, F-73)."""
    q, v, k, down = m.q, m.v, base_row(m), Vec(0.0, 0.0, -m.structure.tower_base)
    theta, rate = Vec(q[k + 3], q[k + 4], q[k + 5]), Vec(v[k + 3], v[k + 4], v[k + 5])
    R, w = rotation(theta), angular_velocity(theta, rate)
    arm = R @ down
    place, velocity = Vec(q[k], q[k + 1], q[k + 2]) + arm - down, Vec(v[k], v[k + 1], v[k + 2]) + cross(w, arm)
    if m.hull_shape.shape[0] > 0:
        (u, tilt), (du, tilting) = hull_mean(q, m), hull_mean(v, m)
        place, velocity = place + R @ u, velocity + (R @ du + cross(w, R @ u))
        R, w = R @ rotation(tilt), w + R @ tilting
    return Motion(R, w, place, velocity)


@base_motion.variant
@kernel
def platform_motion(m: FloaterSystem) -> None:
    """Motion of the tower's base, and of the platform's point with its partial velocities (W-7, F-73)."""
    p, base, C, first, q, v, H = m.platform, m.base, m.base_columns, base_row(m), m.q, m.v, m.hull_shape
    theta, rate = Vec(q[first + 3], q[first + 4], q[first + 5]), Vec(v[first + 3], v[first + 4], v[first + 5])
    R, w, known = rotation(theta), angular_velocity(theta, rate), angular_acceleration(theta, rate)
    base.position = Vec(q[first], q[first + 1], q[first + 2] + m.structure.tower_base)
    base.velocity = Vec(v[first], v[first + 1], v[first + 2])
    base.acceleration = Vec(0.0, 0.0, 0.0)
    base.orientation, base.spin, base.spin_rate = R, w, known
    Q, p.spin, p.displacement, p.velocity = point_motion(m)
    arm = R @ (Vec(0.0, 0.0, -m.structure.tower_base) + hull_mean(q, m)[0])
    p.orientation = Q
    p.angle = Vec(atan2(Q.zy, Q.zz), atan2(-Q.zx, sqrt(Q.xx * Q.xx + Q.yx * Q.yx)), atan2(Q.yx, Q.xx))
    p.bias = cross(known, arm) + cross(w, cross(w, arm) + 2.0 * (R @ hull_mean(v, m)[0]))
    n = H.shape[0]
    for k in range(n):
        keep_column(k, R @ Vec(H[k, 0], H[k, 1], H[k, 2]), R @ Vec(H[k, 3], H[k, 4], H[k, 5]), m)
    for k in range(6):
        e = Vec(1.0 * (k % 3 == 0), 1.0 * (k % 3 == 1), 1.0 * (k % 3 == 2))
        T, W = e, 0.0 * e
        if k >= 3:
            T, W = 0.0 * e, angular_velocity(theta, e)
        C.linear[k], C.angular[k] = T, W
        keep_column(n + k, T + cross(W, arm), W, m)
