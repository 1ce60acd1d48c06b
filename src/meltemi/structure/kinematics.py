"""From generalised coordinates to the motion of tower top, nacelle, hub, blade roots and blade nodes.

Coordinates q, in this order: tower modes, yaw, generator azimuth (seen from the low-speed shaft),
drivetrain torsion (rotor minus generator), then the modes of each blade. Velocities v = dq/dt.

Every velocity is linear in v: velocity = sum_j (partial velocity)_j v_j; every acceleration is
sum_j (partial velocity)_j dv_j/dt plus a known part that depends on q and v alone. Partial
velocities of the rotor apex are the columns T_j (linear) and W_j (angular) of ``columns``.

Reference: docs/theory/structure.md (S-10 to S-24); Kane & Levinson (1985), chapters 2 and 4.
"""

from __future__ import annotations

from math import cos, pi, sin

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.access import put1, put2, put3, put_rot1, put_rot2, rot1, vec1, vec2, vec3
from meltemi.maths.vectors import (
    Vec,
    about_x,
    about_y,
    about_z,
    cross,
    dot,
    rotation_vector,
)
from meltemi.structure.tables import BladeNode, StructureParameters
from meltemi.turbine.exchange import (
    ACCELERATION,
    APEX_ACCELERATION,
    APEX_VELOCITY,
    AZIMUTH,
    BLADE_AZIMUTH,
    COS_PITCH,
    HUB_ACCELERATION,
    HUB_POSITION,
    HUB_VELOCITY,
    NACELLE,
    NACELLE_SPIN,
    NACELLE_SPIN_RATE,
    POSITION,
    ROOT_ORIENTATION,
    ROOT_SHAFT,
    ROOT_SPIN,
    ROOT_SPIN_RATE,
    ROTATION,
    ROTOR_SPEED,
    ROTOR_SPIN,
    ROTOR_SPIN_RATE,
    SHAFT,
    SIN_PITCH,
    SPIN,
    SPIN_RATE,
    TOP,
    TOP_ACCELERATION,
    TOP_POSITION,
    TOP_SPIN,
    TOP_SPIN_RATE,
    TOP_VELOCITY,
    VELOCITY,
)

Float = NDArray[float64]

YAW, GENERATOR, TORSION = 0, 1, 2
"""Coordinates after those of the tower."""
N_SHAFT = 3
"""How many they are."""

TOWER_BASE, TOWER_LENGTH, SHAFT_HEIGHT, OVERHANG, TILT, PRECONE = StructureParameters.slots(
    "tower_base tower_length shaft_height overhang tilt precone"
)
(NODE_POSITION,) = BladeNode.slots("position")


@kernel
def angular_velocity(theta: Vec, rate: Vec) -> Vec:
    """Angular velocity of the frame exp(theta) whose rotation vector changes at ``rate`` [rad/s] (S-13)."""
    a2 = dot(theta, theta)
    c = 0.5 - a2 / 24.0
    d = 1.0 / 6.0 - a2 / 120.0
    once = cross(theta, rate)
    return rate + c * once + d * cross(theta, once)


@kernel
def tower_top(
    q: Float, v: Float, p: Float, top_shape: Float, top_second: Float, columns: Float, machine: Float
) -> None:
    """Motion of the tower top; its partial velocities fill the first columns (S-11 to S-14).

    Args:
      top_shape: (6, tower modes) shapes at the tower top.
      top_second: (3, tower modes, tower modes) displacements of second order there.
    """
    n = top_shape.shape[1]
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(n):
        phi = Vec(top_shape[0, k], top_shape[1, k], top_shape[2, k])
        z, zd = nothing, nothing
        for m in range(n):
            Z = Vec(top_second[0, k, m], top_second[1, k, m], top_second[2, k, m])
            z += q[m] * Z
            zd += v[m] * Z
        T = phi + z
        put2(columns, 0, k, T)
        u += q[k] * (phi + 0.5 * z)
        du += v[k] * T
        bias += v[k] * zd
        w = Vec(top_shape[3, k], top_shape[4, k], top_shape[5, k])
        theta += q[k] * w
        rate += v[k] * w
    for k in range(n):
        w = Vec(top_shape[3, k], top_shape[4, k], top_shape[5, k])
        put2(columns, 3, k, angular_velocity(theta, w))
    put1(machine, TOP_POSITION, u + Vec(0.0, 0.0, p[TOWER_BASE] + p[TOWER_LENGTH]))
    put1(machine, TOP_VELOCITY, du)
    put1(machine, TOP_ACCELERATION, bias)
    put1(machine, TOP_SPIN, angular_velocity(theta, rate))
    put1(machine, TOP_SPIN_RATE, 1.0 / 6.0 * cross(rate, cross(theta, rate)))
    put_rot1(machine, TOP, rotation_vector(theta))


@kernel
def nacelle_and_hub(q: Float, v: Float, p: Float, columns: Float, machine: Float) -> None:
    """Motion of nacelle, shaft and rotor apex; all columns become those of the apex (S-15 to S-18)."""
    n = columns.shape[1] - N_SHAFT
    R_it = rot1(machine, TOP)
    w_t, b_t = vec1(machine, TOP_SPIN), vec1(machine, TOP_SPIN_RATE)
    # yaw: about the tower top's z axis
    yaw_axis = Vec(R_it.xz, R_it.yz, R_it.zz)
    yaw_rate = v[n + YAW]
    R_in = R_it @ about_z(q[n + YAW])
    w_n = w_t + yaw_rate * yaw_axis
    b_n = b_t + yaw_rate * cross(w_t, yaw_axis)
    # shaft: its x axis points downwind; with positive tilt the upwind end is up
    c, s = cos(p[TILT]), sin(p[TILT])
    shaft = R_in @ Vec(c, 0.0, -s)
    speed = v[n + GENERATOR] + v[n + TORSION]
    w_r = w_n + speed * shaft
    b_r = b_n + speed * cross(w_n, shaft)
    # rotor apex H, at d from the tower top
    d = p[SHAFT_HEIGHT] * yaw_axis - p[OVERHANG] * shaft
    turning = cross(w_n, d)
    put1(machine, HUB_POSITION, vec1(machine, TOP_POSITION) + d)
    put1(machine, HUB_VELOCITY, vec1(machine, TOP_VELOCITY) + turning)
    put1(
        machine,
        HUB_ACCELERATION,
        vec1(machine, TOP_ACCELERATION) + (cross(b_n, d) + cross(w_n, turning)),
    )
    put_rot1(machine, NACELLE, R_in)
    put1(machine, NACELLE_SPIN, w_n)
    put1(machine, NACELLE_SPIN_RATE, b_n)
    put1(machine, SHAFT, shaft)
    put1(machine, ROTOR_SPIN, w_r)
    put1(machine, ROTOR_SPIN_RATE, b_r)
    machine[AZIMUTH] = q[n + GENERATOR] + q[n + TORSION]
    machine[ROTOR_SPEED] = speed
    for k in range(n):
        put2(columns, 0, k, vec2(columns, 0, k) + cross(vec2(columns, 3, k), d))
    put2(columns, 0, n + YAW, cross(yaw_axis, d))
    put2(columns, 3, n + YAW, yaw_axis)
    for k in range(n + GENERATOR, n + TORSION + 1):
        put2(columns, 0, k, Vec(0.0, 0.0, 0.0))
        put2(columns, 3, k, shaft)


@kernel
def blade_frames(p: Float, pitch: Float, machine: Float, frame: Float) -> None:
    """Orientation and motion of the blade roots (S-19, S-20).

    Args:
      pitch: (3, blades) pitch angle, its rate and acceleration.
    """
    n_blades = frame.shape[1]
    R_is = rot1(machine, NACELLE) @ about_y(p[TILT])
    shaft = vec1(machine, SHAFT)
    v_h, a_h = vec1(machine, HUB_VELOCITY), vec1(machine, HUB_ACCELERATION)
    w_r, b_r = vec1(machine, ROTOR_SPIN), vec1(machine, ROTOR_SPIN_RATE)
    for b in range(n_blades):
        angle, rate, rate2 = pitch[0, b], pitch[1, b], pitch[2, b]
        azimuth = machine[AZIMUTH] + b * (2.0 * pi / n_blades)
        R_ib = R_is @ about_x(azimuth) @ (about_y(-p[PRECONE]) @ about_z(-angle))
        w, known = R_ib.T @ w_r, R_ib.T @ b_r
        # pitching by +angle to feather is a turn by -angle about the blade's z axis
        axis = Vec(0.0, 0.0, -1.0)
        put_rot2(frame, ROOT_ORIENTATION, b, R_ib)
        put2(frame, APEX_VELOCITY, b, R_ib.T @ v_h)
        put2(frame, APEX_ACCELERATION, b, R_ib.T @ a_h)
        put2(frame, ROOT_SPIN, b, w + rate * axis)
        put2(frame, ROOT_SPIN_RATE, b, known + (rate2 * axis + rate * cross(w, axis)))
        put2(frame, ROOT_SHAFT, b, R_ib.T @ shaft)
        frame[COS_PITCH, b] = cos(angle)
        frame[SIN_PITCH, b] = sin(angle)
        frame[BLADE_AZIMUTH, b] = azimuth


@kernel
def node_motion(
    q: Float,
    v: Float,
    first: int,
    shape: Float,
    second: Float,
    nodes: Float,
    frame: Float,
    partial: Float,
    motion: Float,
    b: int,
    n: int,
) -> None:
    """Motion of one blade node (S-21 to S-24).

    Args:
      first: index of the blade's first coordinate in q.
      shape: (6 modes, blades, nodes) displacement and rotation of each mode at the nodes.
      second: (3 modes modes, blades, nodes) displacements of second order.
      partial: (3 modes, blades, nodes) becomes the partial velocities of the nodes in the modes.
    """
    n_modes = shape.shape[0] // 6
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(n_modes):
        z, zd = nothing, nothing
        for m in range(n_modes):
            Z = vec3(second, 3 * (n_modes * k + m), b, n)
            z += q[first + m] * Z
            zd += v[first + m] * Z
        phi, psi = vec3(shape, 6 * k, b, n), vec3(shape, 6 * k + 3, b, n)
        t = phi + z
        put3(partial, 3 * k, b, n, t)
        u += q[first + k] * (phi + 0.5 * z)
        du += v[first + k] * t
        bias += v[first + k] * zd
        theta += q[first + k] * psi
        rate += v[first + k] * psi
    r = vec3(nodes, NODE_POSITION, b, n) + u
    w, w_rate = vec2(frame, ROOT_SPIN, b), vec2(frame, ROOT_SPIN_RATE, b)
    turning = cross(w, r)
    put3(motion, POSITION, b, n, r)
    put3(motion, VELOCITY, b, n, vec2(frame, APEX_VELOCITY, b) + (turning + du))
    # a = a_H + dw/dt x r + w x (w x r) + 2 w x du/dt + second-order part of d2u/dt2
    spinning = cross(w, turning + 2.0 * du)
    a = vec2(frame, APEX_ACCELERATION, b) + (cross(w_rate, r) + (spinning + bias))
    put3(motion, ACCELERATION, b, n, a)
    put3(motion, ROTATION, b, n, theta)
    put3(motion, SPIN, b, n, w + rate)
    put3(motion, SPIN_RATE, b, n, w_rate + cross(w, rate))


@kernel
def blade_motion(
    q: Float,
    v: Float,
    n_core: int,
    shape: Float,
    second: Float,
    nodes: Float,
    frame: Float,
    partial: Float,
    motion: Float,
) -> None:
    """Motion of all blade nodes; ``n_core`` is the number of coordinates before those of the blades."""
    n_modes = shape.shape[0] // 6
    for b in range(motion.shape[1]):
        for n in range(motion.shape[2]):
            node_motion(q, v, n_core + n_modes * b, shape, second, nodes, frame, partial, motion, b, n)
