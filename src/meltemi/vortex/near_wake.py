"""The coupled near wake: the vortices that each blade trails over a quarter turn, and momentum's wake behind them.

Momentum sees annuli, no blades. Here the circulation of each blade trails vortices from the edges between its elements.
Their velocity over the first quarter turn, that of an arc in closed form, acts at the nodes of the blade. Behind that,
momentum's wake begins: its mean velocities over the annuli are those of vortex cylinders that begin a quarter turn
downstream. One factor for the rotor, near 1, leaves the thrust to the momentum balance.

How the velocity of an arc builds up follows from four exponential functions of the azimuth, the same for all vortices
and nodes. So each vortex has four lagged circulations as states. Close to a vortex they change within a step, and with
them the circulation that feeds them: a step solves for the circulations of all nodes at its end, with the slope of
attached lift. The circulation is that of the dynamic stall model, which has the lag by the shed vorticity.

Reference: docs/theory/vortices.md (VW-25 to VW-34); Beddoes (1987); Pirrung et al. (2016); Li et al. (2022, 2025).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sin, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.bem import loss_factor
from meltemi.aero.rotor import induce, induced_velocity, momentum_velocity, quasi_steady, quotient
from meltemi.compiler import Array2, Array3, Constant, Nodes, Numbers, Table, kernel, number, numbers, total, whole
from meltemi.core.errors import InputError
from meltemi.simulation.arena import aligned
from meltemi.simulation.bladed.rotor import BladedRotor, to_lanes
from meltemi.simulation.channels import Channel
from meltemi.simulation.induction import settle_part
from meltemi.simulation.parts import Part, StateRows
from meltemi.simulation.step import begin_parts_step, part_rates, settle_induction
from meltemi.simulation.system import System

Float = NDArray[np.float64]
QUARTER = 0.5 * np.pi
AGES = 0.6 / 4.0 ** np.arange(3.0, -1.0, -1.0)
"""[rad] ages of the exponential functions; each is four times the one before, so one exponential has all decays."""
OLDEST = float(AGES[-1])
FIT_AGES = np.geomspace(2e-3, QUARTER, 60)
"""[rad] ages at which the functions fit the velocity of the arcs."""
ENDLESS = 1e6
"""[s] a step after which the near wake is steady."""
BEGIN, BEGINS = 0.25, 17
"""Middle of the table of distances between rotor and far wake, over the radius of the rotor; their number."""
MOST, STILL = 2.0, 1e-6
"""Largest factor of the far wake; [m/s] least speed of an edge through the air, and bound of quotients."""


class NearWake(Table, axes="blade edge", title="near wake"):
    """States of the trailing vortices, one for each edge of an element of a blade."""

    trailed = numbers("m^2/s", "state: circulation of the vortex, with a lag", ("1", "2", "3", "4"))

    blades: int
    edges: int


class Trail(Table, axes="edge"):
    """What the vortices of all blades have in common."""

    radius: Numbers = number("m", "distance of the edge from the shaft")
    cosine: Numbers = number("-", "cosine of its angle to the rotor plane, negative if the rotor turns back")
    rate: Numbers = number("rad/s", "rate at which the vortex ages: speed of the edge through the air over its radius")
    grown = numbers("-", "share of the circulation in the states after a step; 1/s: its rate", ("1", "2", "3", "4"))

    edges: int


class NearRotor(Table):
    """Coupling of near and far wake."""

    speed: float = number("m/s", "velocity of the air through the rotor, along the shaft")
    factor: float = number("-", "factor of the far wake, with which the thrust is that of the momentum balance")


class NearSystem(System):
    """A turbine with a coupled near wake.

    Attributes:
      near_reach: (age, edge, node) [1/m] velocity at a node by lagged circulations of a vortex in the rotor plane.
      near_cylinders: (distance, node, node) velocity at the last node by momentum's of the first one's annulus.
      near_velocity: (blade, node) [m/s] velocity of the near wake, normal to the strip, upwind.
      near_mean: (2, blade, node) [m/s] mean velocities over the annuli by momentum, axial and tangential.
      near_matrix: (node or blade, node) columns of the equations of the circulations, then right-hand sides.
      near_means, near_entry: the last two, node by node.
    """

    near_wake: NearWake
    d_near_wake: NearWake
    near_rotor: NearRotor
    near_trail: Trail
    near_reach: Constant[Nodes[Array3]]
    near_cylinders: Constant[Nodes[Array3]]
    near_velocity: Nodes[Array2]
    near_mean: Nodes[Array3]
    near_means: Array3
    near_matrix: Nodes[Array2]
    near_entry: Array2

    SAME = {"near_means": "near_mean", "near_entry": "near_matrix"}  # noqa: RUF012


# velocities ---------------------------------------------------------------------------------------------


@induce.variant
@kernel
def _(t: float, m: NearSystem) -> None:
    quasi_steady(t, m)
    trail_velocity(m)
    far_wake(m)


@kernel
def over_ages(x1: float, x2: float, x3: float, x4: float, m: NearSystem, e: int, n: int) -> float:
    """Sum over the ages at a node, for a vortex."""
    reach = m.near_reach
    return reach[0, e, n] * x1 + reach[1, e, n] * x2 + (reach[2, e, n] * x3 + reach[3, e, n] * x4)


@kernel
def trail_velocity(m: NearSystem) -> None:
    """Velocity of the trailed vortices at the nodes of their blade (VW-27, VW-28)."""
    trail, G = m.near_trail, m.near_wake.trailed
    across = m.near_rotor.speed = m.rotor.axial_wind * (1.0 - m.rotor.induction)
    for e in range(trail.edges):
        along = m.machine.rotor_speed * trail.radius[e]
        speed = sqrt(along * along + across * across + STILL * STILL)
        trail.cosine[e], trail.rate[e] = along / speed, speed / trail.radius[e]
    for b in range(m.flow.blades):
        for n in range(m.flow.nodes):
            w = 0.0
            for e in range(trail.edges):
                w += trail.cosine[e] * over_ages(G[0, b, e], G[1, b, e], G[2, b, e], G[3, b, e], m, e, n)
            m.near_velocity[b, n] = w


@kernel
def far_wake(m: NearSystem) -> None:
    """Momentum's velocity behind the near wake, by the factor that leaves the thrust to momentum (VW-32 to VW-34)."""
    flow, nodes, near, mean, table = m.flow, m.aero_nodes, m.near_rotor, m.near_mean, m.near_cylinders
    begin = QUARTER * abs(near.speed) / max(abs(m.machine.rotor_speed) * m.rotor.tip_radius, STILL)
    place = begin / (begin + BEGIN) * (table.shape[0] - 1)
    i = min(whole(place), table.shape[0] - 2)
    missing, behind = 0.0, 0.0
    for n in range(flow.nodes):
        for b in range(flow.blades):
            a, ap = flow.steady_axial[b, n], flow.steady_tangential[b, n]
            F = loss_factor(nodes.tip_number[b, n], nodes.hub_number[b, n], abs(sin(m.memory.phi[b, n])))
            mean[0, b, n], mean[1, b, n] = F * a * flow.vx[b, n], F * ap * flow.vy[b, n]
            missing += total(thrust_weight(m, b, n) * (a * flow.vx[b, n] - m.near_velocity[b, n]))
    for n in range(flow.nodes):
        for b in range(flow.blades):
            flow.steady_axial[b, n] = flow.steady_tangential[b, n] = 0.0
        for j in range(table.shape[1]):
            P = table[i, j, n] + (place - i) * (table[i + 1, j, n] - table[i, j, n])
            for b in range(flow.blades):
                flow.steady_axial[b, n] += P * m.near_means[0, b, j]
                flow.steady_tangential[b, n] += P * m.near_means[1, b, j]
        for b in range(flow.blades):
            behind += total(thrust_weight(m, b, n) * flow.steady_axial[b, n])
    k = near.factor = min(max(missing * behind / max(behind * behind, STILL), 0.0), MOST)
    for b in range(flow.blades):
        for n in range(flow.nodes):
            flow.steady_axial[b, n] = quotient(k * flow.steady_axial[b, n], flow.vx[b, n])
            flow.steady_tangential[b, n] = quotient(k * flow.steady_tangential[b, n], flow.vy[b, n])


@kernel
def thrust_weight(m: NearSystem, b: int, n: int) -> float:
    """[m^3/s] change of the thrust by the induced velocity at a node, in proportion; none where momentum is blocked."""
    nodes, vx, vy = m.aero_nodes, m.flow.vx[b, n], m.flow.vy[b, n]
    return (1.0 - nodes.end[b, n]) * nodes.length[b, n] * nodes.chord[b, n] * sqrt(vx * vx + vy * vy)


@induced_velocity.variant
@kernel
def _(dt: float, m: NearSystem, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    """The far wake with dynamic inflow and skew, and the near wake, whose velocity is across its vortices."""
    wx, wy = momentum_velocity(dt, m, sin_skew, b, n)
    near = m.rotor.fade * m.near_velocity[b, n]
    return wx + near, wy + near * quotient(m.near_rotor.speed, m.machine.rotor_speed * m.flow.radius[b, n])


# states -------------------------------------------------------------------------------------------------


@kernel
def circulations(dt: float, m: NearSystem) -> None:
    """Circulations of all nodes after ``dt``, by a Newton step (VW-31); they are the last columns of the matrix.

    All blades have the matrix of the first one. Its rows are in lanes; a column after the other is eliminated from all
    other rows.
    """
    flow, nodes, trail, A, at = m.flow, m.aero_nodes, m.near_trail, m.near_matrix, m.near_entry
    c, g, G, N = trail.cosine, trail.grown, m.near_wake.trailed, trail.edges - 1
    for e in range(trail.edges):
        decay = exp(-trail.rate[e] * dt / OLDEST)
        for k in range(3, -1, -1):
            g[k, e] = 1.0 - decay
            decay *= decay
            decay *= decay
    for n in range(flow.nodes):
        S = 0.5 * nodes.chord[0, n] * m.section.slope[whole(nodes.polar[0, n])]
        for b in range(flow.blades):
            A[N + b, n] = 0.5 * nodes.chord[b, n] * flow.speed[b, n] * flow.lift[b, n]
        inner = 0.0 * S
        for e in range(trail.edges):
            turned = abs(c[e]) * S  # where the flow turns back, so does the slope
            outer = turned * over_ages(g[0, e], g[1, e], g[2, e], g[3, e], m, e, n)
            if e > 0:
                A[e - 1, n] = outer - inner
            inner = outer
            for b in range(flow.blades):
                x1, x2, x3, x4 = g[0, e] * G[0, b, e], g[1, e] * G[1, b, e], g[2, e] * G[2, b, e], g[3, e] * G[3, b, e]
                A[N + b, n] += turned * over_ages(x1, x2, x3, x4, m, e, n)
    for i in range(N):
        at[i, i] += 1.0
    for i in range(N):
        pivot = at[i, i]
        at[i, i] = pivot - 1.0  # then row i keeps the factor itself
        for j in range(i + 1, N + flow.blades):
            factor = at[j, i] / pivot
            for n in range(flow.nodes):
                A[j, n] -= factor * A[i, n]


@kernel
def changes(m: NearSystem) -> None:
    """Changes of the states towards the circulations of :func:`circulations`, by the shares ``grown`` (VW-30)."""
    trail, G, N = m.near_trail, m.near_wake.trailed, m.near_trail.edges - 1
    for b in range(m.near_wake.blades):
        inner, outer = 0.0, 0.0
        for e in range(trail.edges):
            inner, outer = outer, 0.0
            if e < N:
                outer = m.near_entry[N + b, e]
            for k in range(4):
                m.d_near_wake.trailed[k, b, e] = trail.grown[k, e] * (inner - outer - G[k, b, e])


@begin_parts_step.variant
@kernel
def advance(dt: float, m: NearSystem) -> None:
    """Advance the states by ``dt`` [s]."""
    circulations(dt, m)
    changes(m)
    for b in range(m.near_wake.blades):
        for e in range(m.near_wake.edges):
            for k in range(4):
                m.near_wake.trailed[k, b, e] += m.d_near_wake.trailed[k, b, e]


@settle_induction.variant
@kernel
def _(m: NearSystem) -> None:
    advance(ENDLESS, m)


@part_rates.variant
@kernel
def _(m: NearSystem) -> None:
    circulations(0.0, m)  # those of the last evaluation
    for e in range(m.near_trail.edges):
        rate = m.near_trail.rate[e] / OLDEST
        for k in range(3, -1, -1):
            m.near_trail.grown[k, e] = rate
            rate *= 4.0
    changes(m)


# the part -----------------------------------------------------------------------------------------------


def arc_velocity(trail: Float, point: Float, azimuth: Float) -> Float:
    """[1/m] velocity at a radius on the blade by a vortex of unit circulation, an arc in the rotor plane (VW-26).

    Args:
      trail, point: [m] radii of the vortex and of the point.
      azimuth: [rad] length of the arc, which begins at the blade.

    Returns:
      Velocity normal to the plane, upwind if the vortex is outside the point.
    """
    from scipy.special import ellipeinc, ellipkinc

    h, half = trail - point, 0.5 * azimuth
    k = -4.0 * trail * point / (h * h)
    bend = ellipeinc(half, k) - k * np.sin(half) * np.cos(half) / np.sqrt(1.0 - k * np.sin(half) ** 2)
    velocity: Float = (ellipkinc(half, k) + h / (trail + point) * bend) / (4.0 * np.pi * np.abs(h))
    return velocity


def reach(trail: Float, point: Float) -> Float:
    """(age, edge, node) [1/m] velocities by the lagged circulations: a fit whose steady value is exact (VW-29)."""
    x, y = trail[:, None, None], point[:, None]
    steady, younger = arc_velocity(x, y, np.array([QUARTER])), arc_velocity(x, y, FIT_AGES)
    share = 1.0 - np.exp(-FIT_AGES[:, None] / AGES)
    fit = np.linalg.pinv(share[:, :-1] - share[:, -1:])
    some = np.einsum("ka,ena->ken", fit, younger - steady * share[:, -1])
    return np.concatenate([some, steady[None, ..., 0] - some.sum(axis=0, keepdims=True)])


def cylinder_velocity(radius: Float, point: Float, distance: float) -> Float:
    """Axial velocity by a half-infinite vortex cylinder over its strength, at a distance [m] before its begin (VW-32).

    Args:
      radius, point: [m] radii of the cylinder and of the point.
    """
    turn = 2.0 * np.pi * (np.arange(720) + 0.5) / 720.0
    x, y = radius[..., None], point[..., None]
    away = np.sqrt(x * x + y * y - 2.0 * x * y * np.cos(turn) + distance * distance)
    velocity: Float = 0.5 * (x * (x - y * np.cos(turn)) / (away * (away + distance))).mean(axis=-1)
    return velocity


def cylinders(edges: Float, point: Float, radius: float) -> Float:
    """(distance, node, node) velocity at a node by momentum's in another's annulus, between two cylinders (VW-33)."""
    table = np.zeros((BEGINS, len(point), len(point)))
    table[0] = np.eye(len(point))
    for i in range(1, BEGINS - 1):
        distance = radius * BEGIN * i / (BEGINS - 1.0 - i)
        table[i] = 2.0 * np.diff(cylinder_velocity(edges[:, None], point, distance), axis=0)
    return table


@dataclass(frozen=True)
class NearPart(Part):
    """A coupled near wake.

    Attributes:
      n_blades: number of blades.
      radius: (edge,) [m] distances of the vortices from the shaft.
      reach, cylinders: arrays of the record, padded to whole lanes.
    """

    has_adjoint: ClassVar[bool] = False
    system: ClassVar[Any] = NearSystem
    signals: ClassVar[dict[str, type[Table]]] = {"near_wake": NearWake, "near_rotor": NearRotor}
    n_blades: int
    radius: Float
    reach: Float
    cylinders: Float

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        return {name: table.shape(blade=self.n_blades, edge=len(self.radius)) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """All other arrays of its records."""
        trail, (_, nodes, padded) = Trail.zeros(edge=len(self.radius)), self.cylinders.shape
        trail[Trail.index("radius")] = self.radius
        return {
            "d_near_wake": np.zeros(self.shapes()["near_wake"]),
            "near_trail": trail,
            "near_reach": self.reach,
            "near_cylinders": self.cylinders,
            "near_velocity": aligned((self.n_blades, padded)),
            "near_mean": aligned((2, self.n_blades, padded)),
            "near_matrix": aligned((nodes + self.n_blades, padded)),
        }

    def channels(self) -> Sequence[Channel]:
        """Factor of the far wake."""
        return (Channel("far_wake_factor", "", "-", "inertial", "", "near and far wake", ("near_rotor", "factor")),)

    def states(self) -> Sequence[StateRows]:
        """States of linear models: four for each vortex."""
        each = np.ndindex(*self.shapes()["near_wake"])
        names = tuple(f"blade {b + 1} vortex {e + 1} circulation {k + 1}" for k, b, e in each)
        return (StateRows("near_wake", "d_near_wake", names, ("m^2/s",) * len(names)),)

    def begin(self, case: Any) -> None:
        """Settle the near wake at the present motion.

        Raises:
          InputError: the turbine has an induction model besides.
        """
        for part in (part for part in case.parts if part.replaces_momentum):
            raise InputError(f"wake near: it needs momentum, which {type(part).__name__} replaces; remove one of them")
        settle_part(case, "near_velocity")


def part_of(turbine: Any, options: Any, rotor: Any) -> NearPart:
    """The coupled near wake of a turbine with a rotor.

    Raises:
      InputError: the rotor has no blades.
    """
    if not isinstance(rotor, BladedRotor):
        raise InputError(f"{turbine.name}: wake near needs blades, not a power coefficient")
    layout, N, missing = rotor.blade_layout, rotor.n_nodes, to_lanes(rotor.n_nodes, True) - rotor.n_nodes
    edges = np.maximum(turbine.hub.radius + layout.edges, 1e-3 * turbine.rotor_radius)
    # a node at an end of the blade, where a vortex leaves, stands for the middle of its element
    at_end = np.isin(layout.position, layout.edges[[0, N]])
    point = np.where(at_end, 0.5 * (edges[1:] + edges[:-1]), turbine.hub.radius + layout.position)
    arrays = reach(edges, point), cylinders(edges, point, turbine.rotor_radius)
    return NearPart(turbine.n_blades, edges, *(np.pad(array, ((0, 0), (0, 0), (0, missing))) for array in arrays))
