"""Kernels of modal blades, in plain Python: a section of four point masses that moves with two modes of a blade."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table

from meltemi.compiler import Rot, Sym, Vec
from meltemi.structure.blades import collect_modal_blades, modal_node_load, modal_tip, node_motion
from meltemi.structure.tables import (
    ApexColumns,
    BladeBody,
    BladeLink,
    BladeNode,
    BladePartial,
    BladeSecond,
    BladeShape,
    SectionLoads,
    Structure,
    StructureParameters,
    TipShape,
)
from meltemi.turbine.exchange import BladeFrame, BladeLoad, BladeMotion

Float = NDArray[np.float64]
PHI, PSI = np.array([[0.9, 0.2, -0.05], [-0.3, 0.8, 0.02]]), np.array([[-0.02, 0.05, 0.1], [0.06, 0.01, -0.08]])
"""[mode, component] displacement and rotation of the section."""
SECOND = np.array([[[0.01, 0.0, -0.03], [0.02, 0.01, -0.01]], [[0.02, 0.01, -0.01], [0.0, 0.02, -0.05]]])
"""[mode, mode, component]"""
REST = np.array([1.5, -0.4, 30.0])
MASSES = np.array([3.0, 4.0, 2.0, 5.0])
PLACES = np.array([[0.5, 0.2, 0.1], [-0.8, 0.3, -0.2], [0.1, -0.6, 0.4], [0.9, 0.1, -0.3]])
Q, V = np.array([0.6, -0.4]), np.array([1.3, 0.7])
SPIN, SPIN_RATE = np.array([1.2, 0.1, -0.2]), np.array([0.3, -0.2, 0.1])
VELOCITY, ACCELERATION = np.array([8.0, -3.0, 1.0]), np.array([0.7, 0.4, -0.9])
FORCE, MOMENT, G = np.array([40.0, 30.0, -5.0]), np.array([6.0, -4.0, 9.0]), 9.81
ROOT = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])
FIRST = 3
K, D = np.array([[50.0, 8.0], [8.0, 70.0]]), np.array([[2.0, 0.3], [0.4, 3.0]])


def blade(q: Float = Q, v: Float = V) -> Any:
    node, mode = {"blade": 1, "node": 1}, {"mode": 2, "blade": 1, "node": 1}
    arms = PLACES[:, :, None] * PLACES[:, None]
    inertia = np.einsum("i,ijk->jk", MASSES, np.einsum("ijj->i", arms)[:, None, None] * np.eye(3) - arms)
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    nodes = table(BladeNode, node, mass=MASSES.sum())
    nodes.position[0, 0], nodes.moment[0, 0] = Vec(*REST), Vec(*(MASSES @ PLACES))
    nodes.inertia[0, 0] = Sym(*six)
    frame, load = table(BladeFrame, {"blade": 1}), table(BladeLoad, node)
    frame.orientation[0] = Rot(*ROOT.ravel())
    frame.velocity[0], frame.acceleration[0] = Vec(*VELOCITY), Vec(*ACCELERATION)
    frame.spin[0], frame.spin_rate[0] = Vec(*SPIN), Vec(*SPIN_RATE)
    load.force[0, 0], load.moment[0, 0] = Vec(*FORCE), Vec(*MOMENT)
    shape, second = table(BladeShape, mode), table(BladeSecond, {"pair": 4, "blade": 1, "node": 1})
    for k in range(2):
        shape.displacement[k, 0, 0], shape.rotation[k, 0, 0] = Vec(*PHI[k]), Vec(*PSI[k])
        for j in range(2):
            second.displacement[2 * k + j, 0, 0] = Vec(*SECOND[k, j])
    m = record(
        Structure, q=np.concatenate([np.zeros(FIRST), q]), v=np.concatenate([np.zeros(FIRST), v]),
        a=np.zeros(FIRST + 2), shape=shape, second=second, blade_nodes=nodes, frame=frame, load=load,
        motion=table(BladeMotion, node), partial=table(BladePartial, mode), body=table(BladeBody, {"blade": 1}),
        link=table(BladeLink, {"blade": 1, "mode": 2}), columns=table(ApexColumns, {"coordinate": FIRST}),
        structure=StructureParameters.of(gravity=G), modal=np.array([K, D])[:, None],
        arm_mass=np.zeros((1, 2, 2)), arm_force=np.zeros((1, 2)),
    )  # fmt: skip
    plain(node_motion)(m, FIRST, 0, 0)
    return m


def matrix(R: Any) -> Float:
    return np.array([[R.xx, R.xy, R.xz], [R.yx, R.yy, R.yz], [R.zx, R.zy, R.zz]])


def places(q: Float) -> Float:
    """(5, 3) of the node and of the masses, blade axes."""
    m = blade(q)
    r = np.array([*m.motion.position[0, 0]])
    return np.vstack([r, r + PLACES @ matrix(m.motion.orientation[0, 0]).T])


H = 1e-4
SLOPES = np.array([(places(Q + H * e) - places(Q - H * e)) / (2.0 * H) for e in np.eye(2)])
"""Partial velocities (mode, place, component)."""
MOVING = np.einsum("k,kpc->pc", V, SLOPES)
BENDING = (places(Q + H * V) - 2.0 * places(Q) + places(Q - H * V)) / H**2


def accelerations() -> Float:
    """(5, 3) without second derivatives of the coordinates: of a rotating frame, and of the way in it."""
    p = places(Q)
    return ACCELERATION + np.cross(SPIN_RATE, p) + np.cross(SPIN, np.cross(SPIN, p) + 2.0 * MOVING) + BENDING


def test_the_node_moves_with_its_modes_in_the_frame_of_the_blade() -> None:
    m = blade()
    r = REST + Q @ PHI + 0.5 * np.einsum("k,j,kjc->c", Q, Q, SECOND)
    assert [*m.motion.position[0, 0]] == pytest.approx(r)
    assert [*m.motion.velocity[0, 0]] == pytest.approx(VELOCITY + np.cross(SPIN, r) + MOVING[0], rel=1e-6)
    assert [*m.motion.acceleration[0, 0]] == pytest.approx(accelerations()[0], rel=1e-5)
    for k in range(2):
        assert [*m.partial.velocity[k, 0, 0]] == pytest.approx(SLOPES[k, 0], rel=1e-6)
        turned = np.cross([*m.partial.rotation[k, 0, 0]], places(Q)[1:] - r)
        assert turned == pytest.approx(SLOPES[k, 1:] - SLOPES[k, 0], abs=1e-6)


def test_a_blade_is_the_sum_of_its_masses() -> None:
    """Newton's law of every mass, and Kane's equations of the modes."""
    m = blade()
    plain(collect_modal_blades)(m)
    p, slopes = places(Q), SLOPES[:, 1:]
    fall = ROOT.T @ [0.0, 0.0, -G] - accelerations()[1:]
    F, about = MASSES[:, None] * fall, p[1:]
    near = {"rel": 2e-5, "abs": 2e-3}
    assert m.body.mass[0] == pytest.approx(MASSES.sum())
    assert [*m.body.moment[0]] == pytest.approx(MASSES @ about)
    J = m.body.inertia[0]
    square = np.einsum("i,ij,ik->jk", MASSES, about, about)
    full = np.trace(square) * np.eye(3) - square
    assert [J.xx, J.yy, J.zz, J.xy, J.xz, J.yz] == pytest.approx(full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    assert [*m.body.force[0]] == pytest.approx(FORCE + F.sum(axis=0), **near)
    torque = MOMENT + np.cross(p[0], FORCE) + np.cross(about, F).sum(axis=0)
    assert [*m.body.torque[0]] == pytest.approx(torque, **near)
    for k in range(2):
        P = MASSES[:, None] * slopes[k]
        assert [*m.link.linear[0, k]] == pytest.approx(P.sum(axis=0), **near)
        assert [*m.link.angular[0, k]] == pytest.approx(np.cross(about, P).sum(axis=0), **near)
        push = SLOPES[k, 0] @ FORCE + np.array([*m.partial.rotation[k, 0, 0]]) @ MOMENT
        push += (slopes[k] * F).sum() - K[k] @ Q - D[k] @ V
        assert m.arm_force[0, k] == pytest.approx(push, **near)
        for j in range(k + 1):
            assert m.arm_mass[0, k, j] == pytest.approx((slopes[j] * P).sum(), **near)


def test_the_load_of_a_node_has_all_accelerations() -> None:
    m = blade()
    root, turning, a = np.array([0.4, -0.7, 0.2]), np.array([0.05, 0.3, -0.1]), np.array([2.0, -3.0])
    m.a[FIRST:] = a
    F, M = plain(modal_node_load)(m, Vec(*root), Vec(*turning), 0, 0)
    p = places(Q)
    moving = accelerations() + root + np.cross(turning, p) + np.einsum("k,kpc->pc", a, SLOPES)
    fall = MASSES[:, None] * (ROOT.T @ [0.0, 0.0, -G] - moving[1:])
    assert [*F] == pytest.approx(FORCE + fall.sum(axis=0), rel=2e-5, abs=2e-3)
    assert [*M] == pytest.approx(MOMENT + np.cross(p[1:] - p[0], fall).sum(axis=0), rel=2e-5, abs=2e-3)


def test_the_tip_is_deflected_as_a_node_is() -> None:
    m = blade()
    shape = table(TipShape, {"mode": 2})
    for k in range(2):
        shape.displacement[k], shape.rotation[k] = Vec(*PHI[k]), Vec(*PSI[k])
    s = record(SectionLoads, tip_shape=shape, tip_second=SECOND.transpose(2, 0, 1))
    u, theta = plain(modal_tip)(m, s, 0)
    assert [*u] == pytest.approx(Q @ PHI + 0.5 * np.einsum("k,j,kjc->c", Q, Q, SECOND))
    assert [*theta] == pytest.approx(Q @ PSI)
