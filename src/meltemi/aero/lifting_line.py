"""Lifting lines: what induction models that need all nodes of a rotor read, and the velocity that they return.

A blade is a line of elements, one for each node, with a bound vortex along the aerodynamic centres. Before the blade
elements are evaluated, ``induce`` places the elements, lets the model compute the induced velocity at each
(:func:`induced_velocities`), and resolves it normal to and along the strips. Elements are numbers of blade and node,
never lanes. Only the records of parts with such a model have this; others keep the momentum balance.

The bound vortex of positive circulation G points to the tip; its lift per length in the relative wind U is
density times U x G (Kutta & Joukowski).

Reference: docs/development/induction.md.
"""

from __future__ import annotations

from math import atan2, sqrt

from meltemi.aero import inflow
from meltemi.aero.air import Air
from meltemi.aero.flaps import flap_increment
from meltemi.aero.polars import coefficient, locate, wrap
from meltemi.aero.rotor import camber, induce, induced_velocity, quotient
from meltemi.aero.tables import AeroNode, BladeFlow, InflowState
from meltemi.compiler import Array1, Array3, Constant, Single, Table, Vec, Vectors, by_record, kernel, whole, xyz
from meltemi.maths.vectors import cross, dot
from meltemi.turbine.exchange import BladeMotion


class LiftingLine(Table, axes="blade node"):
    """Elements of the lifting lines, inertial axes."""

    position: Vectors = xyz("m", "aerodynamic centre of the node, where the induced velocity is needed")
    inner_end: Vectors = xyz("m", "end of the element towards the root")
    outer_end: Vectors = xyz("m", "end of the element towards the tip")
    normal: Vectors = xyz("-", "x axis of the strip: normal to the blade, downwind")
    along: Vectors = xyz("-", "y axis of the strip, towards the trailing edge")
    onset: Vectors = xyz("m/s", "relative wind without induction")
    induced: Vectors = xyz("m/s", "induced velocity: the result of the model")


class LineAir(Air):
    """The aerodynamics of a rotor with lifting lines.

    Attributes:
      line_ends: position of each end of the elements of a blade from one node, over the distance to the next.
      node_constants ... node_inflow: arrays of the blades, node by node.
    """

    lifting_line: Single[LiftingLine]
    line_ends: Constant[Array1]
    node_constants: Single[AeroNode]
    node_motion: Single[BladeMotion]
    node_flow: Single[BladeFlow]
    node_inflow: Single[InflowState]
    node_flaps: Constant[Array3]

    SAME = {  # noqa: RUF012
        "node_constants": "aero_nodes",
        "node_motion": "motion",
        "node_flow": "flow",
        "node_inflow": "inflow",
        "node_flaps": "flap_nodes",
    }


@by_record
def induced_velocities(t: float, m: LineAir) -> None:
    """Compute ``m.lifting_line.induced`` at all elements at time ``t`` [s].

    It depends on the states of the model and on the present geometry and onset flow; states change elsewhere, since a
    step may have several evaluations. Circulations are those of the last evaluation, or of an iteration here
    (:func:`static_circulation`).
    """


@induce.variant
@kernel
def _(t: float, m: LineAir) -> None:
    place_elements(m)
    induced_velocities(t, m)
    resolve_velocities(m)


@induced_velocity.variant
@kernel
def _(dt: float, m: LineAir, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    return m.inflow.x[b, n], m.inflow.y[b, n]


@kernel
def place_elements(m: LineAir) -> None:
    """Position, axes and onset flow of all elements, from the motion and the relative wind of this evaluation."""
    line, motion, frame, flow, hub = m.lifting_line, m.node_motion, m.frame, m.node_flow, m.machine.hub_position
    for b in range(line.blades):
        R, cp, sp = frame.orientation[b], frame.cos_pitch[b], frame.sin_pitch[b]
        for n in range(line.nodes):
            offset = motion.orientation[b, n] @ m.node_constants.centre[b, n]
            cb, sb = flow.cos_bend[b, n], flow.sin_bend[b, n]
            line.position[b, n] = hub + R @ (motion.position[b, n] + offset)
            line.normal[b, n] = R @ Vec(cb * cp, cb * sp, -sb)
            line.along[b, n] = R @ Vec(-sp, cp, 0.0)
            line.onset[b, n] = flow.wind[b, n] - R @ (motion.velocity[b, n] + cross(motion.spin[b, n], offset))
        for n in range(line.nodes):
            line.inner_end[b, n] = element_end(m, b, n)
            line.outer_end[b, n] = element_end(m, b, n + 1)


@kernel
def element_end(m: LineAir, b: int, e: int) -> Vec:
    """Position [m] of the inner end of element ``e``, or of the outer end of the one before; inertial axes."""
    n = min(max(e - 1, 0), m.lifting_line.nodes - 2)
    p = m.lifting_line.position[b, n]
    return p + m.line_ends[e] * (m.lifting_line.position[b, n + 1] - p)


@kernel
def resolve_velocities(m: LineAir) -> None:
    """Induced velocities in strip axes, their factors, and the mean and time constant of the rotor."""
    line, flow, mean = m.lifting_line, m.node_flow, 0.0
    for b in range(line.blades):
        for n in range(line.nodes):
            u = line.induced[b, n]
            wx, wy = -dot(u, line.normal[b, n]), dot(u, line.along[b, n])
            m.node_inflow.x[b, n], m.node_inflow.y[b, n] = wx, wy
            flow.steady_axial[b, n] = quotient(wx, flow.vx[b, n])
            flow.steady_tangential[b, n] = quotient(wy, flow.vy[b, n])
            mean += m.node_constants.ring[b, n] * flow.steady_axial[b, n]
    m.rotor.induction = mean
    m.rotor.inflow_time = inflow.time_constant(m.aero_options.inflow, m)


@kernel
def circulation(m: LineAir, b: int, n: int) -> float:
    """[m^2/s] bound circulation of an element, from the lift of the last evaluation, with dynamic stall and flaps."""
    flow = m.node_flow
    return 0.5 * m.node_constants.chord[b, n] * flow.speed[b, n] * flow.lift[b, n]


@kernel
def static_circulation(u: Vec, m: LineAir, b: int, n: int) -> float:
    """[m^2/s] bound circulation of an element at the induced velocity ``u``, from the static polar with flaps.

    For models that iterate with the blade elements within an evaluation. As in the momentum balance it is that of the
    lift in curved flow.
    """
    line, flow, nodes = m.lifting_line, m.node_flow, m.node_constants
    un = flow.vx[b, n] + dot(u, line.normal[b, n])
    ut = flow.vy[b, n] + dot(u, line.along[b, n])
    speed, chord = sqrt(un * un + ut * ut), nodes.chord[b, n]
    alpha = wrap(atan2(un, ut) - flow.theta[b, n] + camber(flow.rotation[b, n], chord, speed, m))
    lift = coefficient(m.polars.lift, whole(nodes.polar[b, n]), locate(alpha, m))
    if m.node_flaps.shape[0] > 0:
        lift += flap_increment(alpha, m.node_flaps, m, b, n).lift
    return 0.5 * chord * speed * lift
