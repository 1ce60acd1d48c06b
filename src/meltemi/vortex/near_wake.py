"""The coupled near wake: the vortices that each blade trails over a quarter turn, and momentum's far wake.

Momentum sees an annulus, not the blade. Here the circulation of each blade trails vortices from the edges between its
elements, and their velocity over the first quarter turn, which is that of an arc in closed form, acts at the nodes of
that blade. What the rest of the wake does is the mean velocity over the annulus by momentum, the loss factor times
the induction, in one share for the whole rotor: near and far wake together have the thrust of the momentum balance.

Of an arc's velocity, the share that is younger than an age follows from few exponential functions of the azimuth, the
same for all vortices and nodes. So each vortex has four lagged circulations as states. Close to a vortex they change
within a step, and with them the circulation that feeds them: a step solves for the circulations of all nodes at its
end, with the slope of attached lift. The circulation is that of the dynamic stall model, which has the shed vorticity.

Reference: docs/theory/vortices.md (VW-25 to VW-34); Beddoes (1987); Madsen & Rathmann (2004); Pirrung et al. (2016).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sin, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.bem import loss_factor
from meltemi.aero.polars import coefficient, locate, wrap
from meltemi.aero.rotor import flapped, induce, induced_velocity, momentum_velocity, quasi_steady, quotient
from meltemi.compiler import (
    Array1,
    Array2,
    Array3,
    Constant,
    Nodes,
    Numbers,
    Single,
    Table,
    kernel,
    number,
    total,
    where,
    whole,
)
from meltemi.compiler.tables import numbers
from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedRotor, to_lanes
from meltemi.simulation.channels import Channel
from meltemi.simulation.parts import Part, StateRows
from meltemi.simulation.step import begin_parts_step, part_rates, settle_induction
from meltemi.simulation.system import System

Float = NDArray[np.float64]
QUARTER = 0.5 * np.pi
AGES = 0.6 / 4.0 ** np.arange(3.0, -1.0, -1.0)
"""[rad] ages of the exponential functions. Each is four times the one before, so one exponential has all decays."""
FIT_AGES = np.geomspace(2e-3, QUARTER, 60)
"""[rad] ages at which the functions fit the velocity of the arcs."""
OLDEST = float(AGES[-1])
ENDLESS = 1e6
"""[s] a step after which the near wake is steady."""
BEGIN, BEGINS = 0.25, 17
"""Distance of the far wake from the rotor over its radius in the middle of the table of cylinders; their number."""
ROUND = 720
"""Points of the integral around a cylinder."""
MOST = 2.0
"""Largest factor of the far wake."""
STILL = 1e-6
"""[m/s] least speed of a trailing edge through the air, and least mean velocity of the far wake."""
SWEEPS, SETTLED = 100, 1e-6
"""Evaluations that settle the near wake at the start of a run, at most; [m/s] change at which they end."""


class NearWake(Table, axes="blade edge", title="near wake"):
    """States of the trailing vortices, one for each edge between the elements of a blade."""

    trailed = numbers(
        "m^2/s", "state: circulation of the vortex, with the lag of an age of the wake", ("1", "2", "3", "4")
    )

    blades: int
    edges: int


class Trail(Table, axes="edge"):
    """The same edge of all blades."""

    radius: Numbers = number("m", "distance from the shaft")
    cosine: Numbers = number("-", "cosine of the angle between the vortex and the rotor plane")
    grown = numbers("-", "share of the new circulation in the states after this step", ("1", "2", "3", "4"))

    edges: int


class NearNode(Table, axes="node"):
    """Constants of the nodes for the share of the far wake."""

    weight: Numbers = number("m^3", "change of the rotor's thrust with the velocity at the node, in proportion")
    inner_radius: Numbers = number("m", "distance of the inner edge from the shaft")
    outer_radius: Numbers = number("m", "distance of the outer edge")
    inner_gain: Numbers = number("m^2", "sum over the nodes of weight and velocity of a quarter turn from there")
    outer_gain: Numbers = number("m^2", "the same from the outer edge")


class NearRotor(Table):
    """The near wake of the rotor."""

    speed: float = number("m/s", "velocity of the air through the rotor, along the shaft")
    factor: float = number("-", "factor of the far wake, with which the thrust is that of the momentum balance")


class NearSystem(System):
    """A turbine with a coupled near wake.

    Attributes:
      near_reach: (age, edge, node) [1/m] velocity at a node by the lagged circulations, for a vortex in the rotor plane.
      near_cylinders: (begin, node, node) velocity at a node, the last, by momentum's velocity of the annulus of another.
      near_mean: (2, blade, node) [m/s] mean velocities over the annuli by momentum, axial and tangential.
      near_means, near_entry: these and ``near_matrix`` node by node.
      near_velocity: (blade, node) [m/s] induced velocity of the near wake, normal to the strip, upwind.
      near_matrix: (node or blade, node) columns of the equations of the circulations, then right-hand sides.
    """

    near_wake: Single[NearWake]
    d_near_wake: Single[NearWake]
    near_rotor: NearRotor
    near_trail: Single[Trail]
    near_nodes: Constant[NearNode]
    near_reach: Constant[Nodes[Array3]]
    near_cylinders: Constant[Nodes[Array3]]
    near_mean: Nodes[Array3]
    near_means: Array3
    near_velocity: Nodes[Array2]
    near_matrix: Nodes[Array2]
    near_entry: Array2

    SAME = {"near_means": "near_mean", "near_entry": "near_matrix"}  # noqa: RUF012


# velocities ---------------------------------------------------------------------------------------------


@induce.variant
@kernel
def _(t: float, m: NearSystem) -> None:
    quasi_steady(t, m)
    far_wake(m)
    trail_velocity(m)


@kernel
def cosine(radius: float, m: NearSystem) -> float:
    """Cosine of the angle between a vortex trailed at a radius and the rotor plane, negative if it turns back (VW-28)."""
    along, across = m.machine.rotor_speed * radius, m.near_rotor.speed
    return along / sqrt(along * along + across * across + STILL * STILL)


@kernel
def far_wake(m: NearSystem) -> None:
    """Momentum's velocity behind the near wake, by a factor that leaves the rotor's thrust unchanged (VW-32 to VW-34)."""
    flow, nodes, near, p, mean = m.flow, m.aero_nodes, m.near_rotor, m.near_nodes, m.near_mean
    near.speed = m.rotor.axial_wind * (1.0 - m.rotor.induction)
    missing, behind = 0.0, 0.0
    for b in range(flow.blades):
        for n in range(flow.nodes):
            vx, vy, phi = flow.vx[b, n], flow.vy[b, n], m.memory.phi[b, n]
            a, ap, alpha = flow.steady_axial[b, n], flow.steady_tangential[b, n], phi - flow.theta[b, n]
            added, _ = flapped(alpha, m, b, n)
            lift = coefficient(m.polars.lift, whole(nodes.polar[b, n]), locate(wrap(alpha), m)) + added.lift
            un, ut = (1.0 - a) * vx, (1.0 + ap) * vy
            circulation = 0.5 * nodes.chord[b, n] * sqrt(un * un + ut * ut) * lift
            trailed = cosine(p.outer_radius[n], m) * p.outer_gain[n] - cosine(p.inner_radius[n], m) * p.inner_gain[n]
            F = loss_factor(nodes.tip_number[b, n], nodes.hub_number[b, n], abs(sin(phi)))
            counts = where(nodes.end[b, n] > 0.0, 0.0, 1.0)  # where the loss factor vanishes momentum knows no velocity
            missing += total(counts * (p.weight[n] * a * vx - circulation * trailed))
            mean[0, b, n], mean[1, b, n] = F * a * vx, F * ap * vy
    begin = QUARTER * abs(near.speed) / max(abs(m.machine.rotor_speed) * m.rotor.tip_radius, STILL)
    place = begin / (begin + BEGIN) * (m.near_cylinders.shape[0] - 1)
    i = min(whole(place), m.near_cylinders.shape[0] - 2)
    share = place - i
    for n in range(flow.nodes):
        for b in range(flow.blades):
            flow.steady_axial[b, n] = flow.steady_tangential[b, n] = 0.0 * flow.vx[b, n]
        for j in range(m.near_cylinders.shape[1]):
            low = m.near_cylinders[i, j, n]
            P = low + share * (m.near_cylinders[i + 1, j, n] - low)
            for b in range(flow.blades):
                flow.steady_axial[b, n] += P * m.near_means[0, b, j]
                flow.steady_tangential[b, n] += P * m.near_means[1, b, j]
        for b in range(flow.blades):
            behind += total(where(nodes.end[b, n] > 0.0, 0.0, p.weight[n]) * flow.steady_axial[b, n])
    some = abs(behind) > STILL
    k = near.factor = min(max(where(some, missing / where(some, behind, 1.0), 1.0), 0.0), MOST)
    for b in range(flow.blades):
        for n in range(flow.nodes):
            flow.steady_axial[b, n] = quotient(k * flow.steady_axial[b, n], flow.vx[b, n])
            flow.steady_tangential[b, n] = quotient(k * flow.steady_tangential[b, n], flow.vy[b, n])


@kernel
def trail_velocity(m: NearSystem) -> None:
    """Induced velocity of the trailed vortices at the nodes of their blade (VW-27, VW-28)."""
    flow, trail, reach, w = m.flow, m.near_trail, m.near_reach, m.near_velocity
    for e in range(trail.edges):
        trail.cosine[e] = cosine(trail.radius[e], m)
    for b in range(flow.blades):
        for n in range(flow.nodes):
            w[b, n] = 0.0 * flow.vx[b, n]
        for e in range(trail.edges):
            c, G = trail.cosine[e], m.near_wake.trailed
            x1, x2, x3, x4 = c * G[0, b, e], c * G[1, b, e], c * G[2, b, e], c * G[3, b, e]
            for n in range(flow.nodes):
                w[b, n] += reach[0, e, n] * x1 + reach[1, e, n] * x2 + (reach[2, e, n] * x3 + reach[3, e, n] * x4)


@induced_velocity.variant
@kernel
def _(dt: float, m: NearSystem, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    """Far wake with dynamic inflow and skew, and the near wake, whose velocity is across the vortices."""
    wx, wy = momentum_velocity(dt, m, sin_skew, b, n)
    near = m.rotor.fade * m.near_velocity[b, n]
    return wx + near, wy + near * quotient(m.near_rotor.speed, m.machine.rotor_speed * m.flow.radius[b, n])


# states -------------------------------------------------------------------------------------------------


@kernel
def trail_speed(e: int, m: NearSystem) -> float:
    """[rad/s] speed of an edge through the air over its radius: the rate at which its vortex ages."""
    along, across, r = m.machine.rotor_speed * m.near_trail.radius[e], m.near_rotor.speed, m.near_trail.radius[e]
    return sqrt(along * along + across * across) / r


@kernel
def circulations(dt: float, m: NearSystem) -> None:
    """Circulations of all nodes after ``dt``, by one Newton step (VW-31); they are the last columns of the matrix.

    The equations G + S (w(G) - w) = G_now have the same matrix for all blades. It has rows in lanes, and each column in
    turn is eliminated from all other rows.
    """
    flow, nodes, trail, reach, A, at = m.flow, m.aero_nodes, m.near_trail, m.near_reach, m.near_matrix, m.near_entry
    N = trail.edges - 1
    for e in range(trail.edges):
        decay = exp(-trail_speed(e, m) * dt / OLDEST)
        for k in range(3, -1, -1):
            trail.grown[k, e] = 1.0 - decay
            decay *= decay
            decay *= decay
    for n in range(flow.nodes):
        S = 0.5 * nodes.chord[0, n] * m.section.slope[whole(nodes.polar[0, n])]
        inner = 0.0 * S
        for e in range(trail.edges):
            c, g = trail.cosine[e], trail.grown
            x = reach[0, e, n] * g[0, e] + reach[1, e, n] * g[1, e] + (reach[2, e, n] * g[2, e] + reach[3, e, n] * g[3, e])
            outer = c * S * x
            if e > 0:
                A[e - 1, n] = outer - inner
            inner = outer
        for b in range(flow.blades):
            A[N + b, n] = 0.5 * nodes.chord[b, n] * flow.speed[b, n] * flow.lift[b, n]
            for e in range(trail.edges):
                c, g, G = trail.cosine[e], trail.grown, m.near_wake.trailed
                x1, x2 = c * g[0, e] * G[0, b, e], c * g[1, e] * G[1, b, e]
                x3, x4 = c * g[2, e] * G[2, b, e], c * g[3, e] * G[3, b, e]
                x = reach[0, e, n] * x1 + reach[1, e, n] * x2 + (reach[2, e, n] * x3 + reach[3, e, n] * x4)
                A[N + b, n] += S * x
    for i in range(N):
        at[i, i] += 1.0
    for i in range(N):
        pivot = at[i, i]
        at[i, i] = pivot - 1.0  # then the row i keeps the factor itself
        for j in range(i + 1, N + flow.blades):
            factor = at[j, i] / pivot
            for n in range(flow.nodes):
                A[j, n] -= factor * A[i, n]


@kernel
def advance(dt: float, m: NearSystem) -> None:
    """Advance the states by ``dt`` (VW-30)."""
    circulations(dt, m)
    trail, at, N = m.near_trail, m.near_entry, m.near_trail.edges - 1
    for b in range(m.near_wake.blades):
        inner = 0.0
        for e in range(trail.edges):
            outer = 0.0
            if e < N:
                outer = at[N + b, e]
            for k in range(4):
                G = m.near_wake.trailed[k, b, e]
                m.near_wake.trailed[k, b, e] = G + trail.grown[k, e] * (inner - outer - G)
            inner = outer


@begin_parts_step.variant
@kernel
def _(dt: float, m: NearSystem) -> None:
    advance(dt, m)


@settle_induction.variant
@kernel
def _(m: NearSystem) -> None:
    advance(ENDLESS, m)


@part_rates.variant
@kernel
def _(m: NearSystem) -> None:
    circulations(0.0, m)  # those of the last evaluation
    at, N = m.near_entry, m.near_trail.edges - 1
    for b in range(m.near_wake.blades):
        inner = 0.0
        for e in range(m.near_trail.edges):
            outer = 0.0
            if e < N:
                outer = at[N + b, e]
            rate = trail_speed(e, m) / OLDEST
            for k in range(3, -1, -1):
                m.d_near_wake.trailed[k, b, e] = rate * (inner - outer - m.near_wake.trailed[k, b, e])
                rate *= 4.0
            inner = outer


# the part -----------------------------------------------------------------------------------------------


def arc_velocity(trail: Float, point: Float, azimuth: Float) -> Float:
    """[1/m] velocity at a radius on the blade by a vortex of unit circulation, from another radius over an arc (VW-26).

    Args:
      trail, point: [m] radii of vortex and point.
      azimuth: [rad] length of the arc, in the rotor plane.

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
    x, y = trail[:, None], point[None, :]
    steady = arc_velocity(x, y, np.array(QUARTER))
    younger = arc_velocity(x[..., None], y[..., None], FIT_AGES)
    share = 1.0 - np.exp(-FIT_AGES[:, None] / AGES)
    rest = younger - steady[..., None] * share[:, -1]
    some = np.einsum("ka,ena->ken", np.linalg.pinv(share[:, :-1] - share[:, -1:]), rest)
    return np.concatenate([some, steady[None] - some.sum(axis=0, keepdims=True)])


def cylinder_velocity(radius: Float, point: Float, distance: float) -> Float:
    """Velocity along the axis by a half-infinite vortex cylinder, over its strength, upstream of its end (VW-32).

    Args:
      radius, point: [m] radii of cylinder and point.
      distance: [m] between the end and the plane of the point.
    """
    turn = 2.0 * np.pi * (np.arange(ROUND) + 0.5) / ROUND
    x, y = radius[..., None], point[..., None]
    away = np.sqrt(x * x + y * y - 2.0 * x * y * np.cos(turn) + distance * distance)
    velocity: Float = (x * (x - y * np.cos(turn)) / (away * (away + distance))).mean(axis=-1) / 2.0
    return velocity


def cylinders(edges: Float, point: Float, radius: float) -> Float:
    """(begin, node, node) velocity at a node by momentum's velocity of other annuli, whose steps are vortex cylinders."""
    table = np.zeros((BEGINS, len(point), len(point)))
    table[0] = np.eye(len(point))
    for i in range(1, BEGINS - 1):
        begin = radius * BEGIN * i / (BEGINS - 1.0 - i)
        table[i] = 2.0 * np.diff(cylinder_velocity(edges[:, None], point, begin), axis=0)
    return table


@dataclass(frozen=True)
class NearPart(Part):
    """A coupled near wake.

    Attributes:
      n_blades, n_nodes: numbers of blades and of the nodes of each.
      reach, cylinders, nodes: arrays of the record, padded to whole lanes.
      radius: (edge,) [m] distances of the vortices from the shaft.
    """

    system: ClassVar[Any] = NearSystem
    signals: ClassVar[dict[str, type[Table]]] = {"near_wake": NearWake, "near_rotor": NearRotor}
    n_blades: int
    n_nodes: int
    reach: Float
    cylinders: Float
    nodes: Float
    radius: Float

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        sizes = {"blade": self.n_blades, "edge": len(self.radius)}
        return {name: table.shape(**sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """All other arrays of its records."""
        from meltemi.simulation.arena import aligned

        padded, trail = self.reach.shape[-1], Trail.zeros(edge=len(self.radius))
        trail[Trail.index("radius")] = self.radius
        return {
            "d_near_wake": NearWake.zeros(blade=self.n_blades, edge=len(self.radius)),
            "near_trail": trail,
            "near_nodes": self.nodes,
            "near_reach": self.reach,
            "near_cylinders": self.cylinders,
            "near_mean": aligned((2, self.n_blades, padded)),
            "near_velocity": aligned((self.n_blades, padded)),
            "near_matrix": aligned((self.n_nodes + self.n_blades, padded)),
        }

    def channels(self) -> Sequence[Channel]:
        """Factor of the far wake."""
        return (Channel("far_wake_factor", "", "-", "inertial", "", "couples near and far wake", ("near_rotor", "factor")),)

    def states(self) -> Sequence[StateRows]:
        """States of linear models: four for each vortex."""
        shape = self.shapes()["near_wake"]
        names = tuple(f"blade {b + 1} vortex {e + 1} circulation {k + 1}" for k, b, e in np.ndindex(*shape))
        return (StateRows("near_wake", "d_near_wake", names, ("m^2/s",) * len(names)),)

    def begin(self, case: Any) -> None:
        """Settle the near wake at the present motion.

        Raises:
          InputError: the turbine has an induction model besides.
        """
        names = [type(part).__name__ for part in case.parts if part.replaces_momentum]
        if names:
            raise InputError(f"wake near: it needs momentum's far wake, which {names[0]} replaces; remove one of both")
        accelerations = case["a"].copy()
        case.evaluate(0.0)
        for _ in range(SWEEPS):
            before = case["near_velocity"].copy()
            settle_induction(case.system)
            case.evaluate(0.0)
            if not np.max(np.abs(case["near_velocity"] - before)) > SETTLED:
                break
        case["a"][:] = accelerations  # those of steady operation are prescribed, not those of the instant


def part_of(turbine: Any, options: Any, rotor: Any) -> NearPart:
    """The coupled near wake of a turbine with a rotor.

    Raises:
      InputError: the rotor has no blades.
    """
    if not isinstance(rotor, BladedRotor):
        raise InputError(f"{turbine.name}: wake near needs blades, not a power coefficient")
    layout, hub, N = rotor.blade_layout, turbine.hub.radius, rotor.n_nodes
    edges = np.maximum(hub + layout.edges, 1e-3 * turbine.rotor_radius)
    # a node at the end of the blade, where a vortex leaves, stands for the middle of its element
    at_end = np.isin(layout.position, layout.edges[[0, -1]])
    point = np.where(at_end, 0.5 * (edges[1:] + edges[:-1]), hub + layout.position)
    padded, chord = to_lanes(N, True), rotor.aero_nodes[0, 0]
    near_reach, nodes = np.zeros((len(AGES), N + 1, padded)), NearNode.zeros(node=padded)
    near_reach[..., :N] = reach(edges, point)
    weight = chord * point * np.diff(edges)
    gain = near_reach.sum(axis=0)[:, :N] @ weight
    nodes[:, :N] = weight, edges[:-1], edges[1:], gain[:-1], gain[1:]
    near_cylinders = np.zeros((BEGINS, N, padded))
    near_cylinders[..., :N] = cylinders(edges, point, turbine.rotor_radius)
    return NearPart(turbine.n_blades, N, near_reach, near_cylinders, nodes, edges)
