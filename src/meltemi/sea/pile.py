"""A pile in the sea as a part of the machine: loads of waves, current and soil, added mass, section loads.

The kinematics of the water are a field at fixed heights (``sea.field``), which is still water unless a run has a sea.

Reference: docs/theory/sea.md (H-24 to H-36).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import (
    WIDTH,
    Array1,
    Array2,
    Constant,
    KernelRecord,
    Numbers,
    Single,
    Table,
    Vec,
    Vectors,
    View,
    kernel,
    number,
    total,
    whole,
    xyz,
)
from meltemi.maths.rotations import rotation
from meltemi.maths.vectors import cross
from meltemi.sea import pile_beam as pile
from meltemi.sea.field import AHEAD, BEHIND
from meltemi.sea.support import Support
from meltemi.simulation.channels import Channel, channels_of_group
from meltemi.simulation.parts import ParameterTables, Part
from meltemi.simulation.step import outer_forces, outer_section_loads
from meltemi.simulation.system import Outputs, System
from meltemi.turbine.exchange import TowerShape

Float = NDArray[np.float64]
FEATURE = "the pile and the sea"
NONE, VERTICAL, EXTRAPOLATION, WHEELER = 0, 1, 2, 3
"""Stretching, in the order of ``sea.conditions.Stretching``."""


class PileWater(Table, title="water"):
    """The water around the pile."""

    density: float = number("kg/m^3", "density of the water")
    depth: float = number("m", "depth of still water")
    level: float = number("m", "level of still water above mean sea level")
    stretching: float = number("-", "how the kinematics continue to the surface")
    step: float = number("s", "interval between the samples of the field")
    period: float = number("s", "period after which the field repeats")


class PileNode(Table, axes="node"):
    """Constants of the pieces of the pile; they move with their middle."""

    height: Numbers = number("m", "middle of the piece above mean sea level")
    low: Numbers = number("m", "lower edge of the piece")
    high: Numbers = number("m", "upper edge of the piece")
    mass: Numbers = number("kg", "mass of the piece")
    lateral: Numbers = number("kg", "mass that moves sideways, with the water inside and the growth")
    inertia: Vectors = xyz("kg m^2", "moments of inertia of the piece about its middle")
    soil: Numbers = number("N/m", "stiffness of the soil around the piece")
    soil_damping: Numbers = number("N s/m", "damping of the soil around the piece")
    drag: Numbers = number("m", "half the drag coefficient times the diameter")
    inertial: Numbers = number("m^2", "coefficient of the water's acceleration times the section")
    added: Numbers = number("m^2", "coefficient of added mass times the section")


class PileLoad(Table, axes="node"):
    """Loads of the water on the pieces of the pile."""

    velocity: Vectors = xyz("m/s", "velocity of the piece")
    force: Vectors = xyz("N", "force of the water without that of the piece's acceleration, inertial axes")
    added: Numbers = number("kg", "added mass")


class PileStationLoad(Table, axes="station"):
    """Section loads of the pile; the first station is the mudline."""

    place: Vectors = xyz("m", "place of the station, inertial axes")
    force: Vectors = xyz("N", "force of the upper part on the lower part, inertial axes")
    moment: Vectors = xyz("N m", "moment of the upper part on the lower part, inertial axes")


class SeaState(Table):
    """The sea at the turbine, and its loads on the whole pile."""

    elevation: float = number("m", "elevation of the surface above still water at the pile's axis")
    force: Vec = xyz("N", "force of the water on the pile, with added mass and the water inside")
    moment: Vec = xyz("N m", "moment of this force about the axis at still water")
    reaction: Vec = xyz("N", "force of the ground on the pile at the mudline")
    reaction_moment: Vec = xyz("N m", "moment of the ground on the pile at the mudline")


class PileSystem(System):
    """A turbine on a pile in the sea.

    Attributes:
      sea_levels: (P,) [m] heights of the points of the field from still water, increasing to 0.
      sea_field: (T, 5 + 4 P) elevation, then velocity x and y and acceleration x and y at each point, and last their
        vertical derivatives at still water.
      sea_now: (5 + 4 P,) the field at the present instant.
      sea_current: (2, N) [m/s] along x and y at the nodes.
      pile_stations: (S,) [m] heights of the stations of section loads, first the mudline.
    """

    water: PileWater
    sea: SeaState
    sea_levels: Constant[Array1]
    sea_field: Constant[Array2]
    sea_now: Array1
    sea_current: Constant[Array2]
    pile_nodes: Single[PileNode]
    pile_shape: Single[TowerShape]
    pile_load: Single[PileLoad]
    pile_stations: Constant[Array1]
    pile_station: PileStationLoad
    pile_station_shape: Single[TowerShape]
    pile_shape_rows: TowerShape
    pile_load_rows: PileLoad

    SAME = {"pile_shape_rows": "pile_shape", "pile_load_rows": "pile_load"}  # noqa: RUF012


class Instant(NamedTuple):
    """Place in the field: first row, and weights of four of them."""

    row: int
    a: float
    b: float
    c: float
    d: float


@kernel
def cubic(t: float, step: float, period: float) -> Instant:
    """Rows and weights of Lagrange's cubic interpolation at time ``t`` in samples ``step`` apart (H-22)."""
    if period < 1e9:
        t -= period * whole(t / period)
    x = t / step
    row = whole(x)
    s = x - row
    a, b = -s * (s - 1.0) * (s - 2.0) / 6.0, (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0
    c, d = -(s + 1.0) * s * (s - 2.0) / 2.0, (s + 1.0) * s * (s - 1.0) / 6.0
    return Instant(row, a, b, c, d)


@kernel
def at(now: Instant, f: Float, column: int) -> float:
    """A column of a field over time at an instant."""
    i = now.row
    return now.a * f[i, column] + now.b * f[i + 1, column] + now.c * f[i + 2, column] + now.d * f[i + 3, column]


@kernel
def stretched(kind: float, z: float, elevation: float, depth: float) -> float:
    """Height at which the kinematics of a point at height ``z`` under the surface are taken (H-26), at most 0."""
    if kind == WHEELER:
        return depth * (depth + z) / (depth + elevation) - depth
    return min(z, 0.0)


@kernel
def morison(
    density: float, drag: float, inertial: float, ux: float, uy: float, ax: float, ay: float
) -> tuple[float, float]:
    """Force per length [N/m] on a vertical cylinder in relative velocity (ux, uy) and acceleration (ax, ay) (H-24)."""
    push = density * drag * sqrt(ux * ux + uy * uy)
    return push * ux + density * inertial * ax, push * uy + density * inertial * ay


@kernel
def wet_part(n: int, m: PileSystem) -> tuple[float, float]:
    """Heights [m] between which the water touches node ``n``; it does not if they do not increase."""
    w, node = m.water, m.pile_nodes
    surface = w.level if w.stretching == NONE else w.level + m.sea.elevation
    return max(node.low[n], w.level - w.depth), min(node.high[n], surface)


@kernel
def water_force(n: int, low: float, high: float, m: PileSystem) -> None:
    """Load of the water on node ``n``, wet from ``low`` to ``high``, and its added mass."""
    w, node, load, levels, f = m.water, m.pile_nodes, m.pile_load, m.sea_levels, m.sea_now
    elevation, wet = m.sea.elevation, high - low
    z = 0.5 * (low + high) - w.level
    place = stretched(w.stretching, z, elevation, w.depth)
    last = levels.shape[0] - 1
    i = min(n, last)
    while i > 0 and levels[i] > place:
        i -= 1
    while i < last - 1 and levels[i + 1] <= place:
        i += 1
    i = min(i, last - 1)
    share = (place - levels[i]) / (levels[i + 1] - levels[i])
    share = min(max(share, 0.0), 1.0)
    j, k = 1 + 4 * i, 5 + 4 * i
    ux, uy = (1.0 - share) * f[j] + share * f[k], (1.0 - share) * f[j + 1] + share * f[k + 1]
    ax, ay = (1.0 - share) * f[j + 2] + share * f[k + 2], (1.0 - share) * f[j + 3] + share * f[k + 3]
    if w.stretching == EXTRAPOLATION and z > 0.0:
        s = 5 + 4 * last
        ux += z * f[s]
        uy += z * f[s + 1]
        ax += z * f[s + 2]
        ay += z * f[s + 3]
    v = load.velocity[n]
    ux += m.sea_current[0, n] - v.x
    uy += m.sea_current[1, n] - v.y
    fx, fy = morison(w.density, node.drag[n], node.inertial[n], ux, uy, ax, ay)
    load.force[n] = Vec(wet * fx, wet * fy, 0.0)
    load.added[n] = w.density * node.added[n] * wet


@outer_forces.variant
@kernel
def pile_forces(t: float, m: PileSystem) -> None:
    """Forces of water on the coordinates of tower and pile, and its added mass in their mass matrix (H-25)."""
    shape, w, load, rows = m.pile_shape_rows, m.water, m.pile_load, m.pile_load_rows
    now = cubic(t, w.step, w.period)
    for j in range(m.sea_now.shape[0]):
        m.sea_now[j] = at(now, m.sea_field, j)
    m.sea.elevation = m.sea_now[0]
    for n in range(rows.nodes):
        u = Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            u += m.v[k] * shape.displacement[k, n]
        rows.velocity[n] = u
    for n in range(m.pile_nodes.nodes):
        low, high = wet_part(n, m)
        if high > low:
            water_force(n, low, high, m)
        else:
            load.force[n] = Vec(0.0, 0.0, 0.0)
            load.added[n] = 0.0
    for k in range(shape.modes):
        push = 0.0
        for n in range(rows.nodes):
            s, F = shape.displacement[k, n], rows.force[n]
            push += s.x * F.x + s.y * F.y
        m.core_force[k] += total(push)
        for j in range(k + 1):
            added = 0.0
            for n in range(rows.nodes):
                s, r = shape.displacement[k, n], shape.displacement[j, n]
                added += rows.added[n] * (s.x * r.x + s.y * r.y)
            m.core_mass[k, j] += total(added)


@kernel
def piece_load(n: int, m: PileSystem) -> tuple[Vec, Vec, Vec]:
    """Displacement of node ``n``, and force and moment of all but the neighbouring pieces on it, with inertia."""
    shape, node, load = m.pile_shape, m.pile_nodes, m.pile_load
    u, du, a, turning = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(shape.modes):
        s = shape.displacement[k, n]
        u += m.q[k] * s
        du += m.v[k] * s
        a += m.a[k] * s
        turning += m.a[k] * shape.rotation[k, n]
    moving, F = node.lateral[n] + load.added[n], load.force[n]
    spring, damper = node.soil[n], node.soil_damping[n]
    fx = F.x - moving * a.x - spring * u.x - damper * du.x
    fy = F.y - moving * a.y - spring * u.y - damper * du.y
    J = node.inertia[n]
    M = Vec(-J.x * turning.x, -J.y * turning.y, -J.z * turning.z)
    return u, Vec(fx, fy, -node.mass[n] * (m.structure.gravity + a.z)), M


@outer_section_loads.variant
@kernel
def pile_section_loads(m: PileSystem, s: Outputs) -> None:
    """Loads at stations of the pile from those at the tower base down, and of the water on all of it (H-36)."""
    q, node, shape, out, sea = m.q, m.pile_nodes, m.pile_shape, m.pile_station, m.sea
    base, moved, turned = Vec(0.0, 0.0, m.structure.tower_base), Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(shape.modes):
        moved += q[k] * m.tower_shape.displacement[k, 0]
        turned += q[k] * m.tower_shape.rotation[k, 0]
    base += Vec(moved.x, moved.y, 0.0)
    # the deflection of the tower is relative to its base
    s.chain.top_deflection -= moved + cross(turned, Vec(0.0, 0.0, m.structure.tower_length))
    for i in range(out.stations):
        place = Vec(0.0, 0.0, m.pile_stations[i])
        for k in range(shape.modes):
            station = m.pile_station_shape.displacement[k, i]
            place += q[k] * Vec(station.x, station.y, 0.0)
        out.place[i] = place
        out.force[i] = s.tower_station.force[0]
        out.moment[i] = s.tower_station.moment[0] + cross(base - place, s.tower_station.force[0])
    for n in range(node.nodes):
        u, F, M = piece_load(n, m)
        for i in range(out.stations):
            cut = m.pile_stations[i]
            if cut < node.high[n]:
                middle, G, N = Vec(u.x, u.y, 0.5 * (max(node.low[n], cut) + node.high[n])), F, M
                if cut > node.low[n]:
                    share = (node.high[n] - cut) / (node.high[n] - node.low[n])
                    G, N = share * F, share * M
                out.force[i] += G
                out.moment[i] += N + cross(middle - out.place[i], G)
    # loads of the tower base are in its axes, which tilt with it
    tilted = rotation(turned).T
    s.tower_station.force[0] = tilted @ s.tower_station.force[0]
    s.tower_station.moment[0] = tilted @ s.tower_station.moment[0]
    sea.reaction = -1.0 * out.force[0]
    sea.reaction_moment = -1.0 * out.moment[0]
    force, moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for n in range(node.nodes):
        a = Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            a += m.a[k] * shape.displacement[k, n]
        moving = m.pile_load.added[n] + node.lateral[n] - node.mass[n]
        F = m.pile_load.force[n] - moving * Vec(a.x, a.y, 0.0)
        force += F
        moment += cross(Vec(0.0, 0.0, node.height[n] - m.water.level), F)
    sea.force = force
    sea.moment = moment


@dataclass(frozen=True)
class PilePart(Part):
    """Pile of a model, in still water."""

    system: ClassVar[type[KernelRecord] | None] = PileSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        "sea": SeaState,
        "pile_load": PileLoad,
        "pile_station": PileStationLoad,
    }
    parameter_tables: ClassVar[ParameterTables] = ((PileWater, "water", PileWater.names),)
    water: Float
    pile_nodes: Float
    pile_shape: Float
    pile_stations: Float
    pile_station_shape: Float

    @property
    def shown(self) -> tuple[str, ...]:
        """Elevation, force of the water, reactions of the ground."""
        reactions = ("mudline_reaction_force_x", "mudline_reaction_moment_x", "mudline_reaction_moment_y")
        return ("wave_elevation", "sea_force_x", *reactions)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        sizes = {"node": self.pile_nodes.shape[1], "station": len(self.pile_stations)}
        return {name: table.shape(**sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Constants of the pile, and the field of still water."""
        names = ("water", "pile_nodes", "pile_shape", "pile_stations", "pile_station_shape")
        return {
            **{name: getattr(self, name).copy() for name in names},
            "sea_levels": np.array([-1.0, 0.0]),
            "sea_field": np.zeros((AHEAD + BEHIND + 2, 1 + 4 * 3)),
            "sea_now": np.zeros(1 + 4 * 3),
            "sea_current": np.zeros((2, self.pile_nodes.shape[1])),
        }

    def channels(self) -> Sequence[Channel]:
        """The sea, its loads, those of the ground, and section loads."""
        stations = channels_of_group("pile_station", len(self.pile_stations) - 1)
        return (*channels_of_group("sea"), *stations)


def part_of(turbine: Any, options: Any, rotor: Any) -> PilePart:
    """The pile of a turbine; arguments and errors as for ``simulation.parts.parts_of``."""
    support: Support = turbine.support
    member, foot = rotor.tower, float(support.position[0])
    edges = pile.pile_edges(support)
    z = 0.5 * (edges[1:] + edges[:-1])
    pieces = member.beam.rigid_pieces(edges - foot, member.beam.at(z - foot, "axis"))
    # pieces without length at the top fill the lanes
    more = -len(z) % WIDTH
    pieces, edges = np.pad(pieces, ((0, more), (0, 0), (0, 0))), np.append(edges, np.full(more, edges[-1]))
    z = 0.5 * (edges[1:] + edges[:-1])
    nodes = PileNode.zeros(node=len(z))
    v = View(PileNode, nodes)
    v["height"], v["low"], v["high"] = z, edges[:-1], edges[1:]
    v["mass"], v["lateral"] = pieces[:, 2, 2], pieces[:, 0, 0]
    v["inertia"] = np.stack([pieces[:, 3, 3], pieces[:, 4, 4], pieces[:, 5, 5]])
    diameter = pile.outer_diameter(support, z)
    section = 0.25 * np.pi * diameter**2
    drag, added, pressure = (pile.coefficient(support, name, z) for name in ("drag", "added_mass", "pressure"))
    v["drag"], v["inertial"], v["added"] = 0.5 * drag * diameter, (added + pressure) * section, added * section
    if support.hydrodynamics.diffraction == "maccamy_fuchs":
        v["inertial"] = 2.0 * section
    if support.soil is not None:
        springs = pile.soil_springs(support, support.soil)
        some = slice(0, len(springs.height))
        v["soil"][some] = springs.stiffness
        lag = 2.0 * support.soil.damping / pile.first_frequency(member.modes)
        v["soil_damping"][some] = lag * springs.stiffness
    stations = np.array([-support.depth, *support.load_stations])
    k = len(member.names)
    water = PileWater.zeros()
    w = View(PileWater, water)
    w["density"], w["depth"], w["step"], w["period"] = support.water_density, support.depth, 1.0, 1.0
    return PilePart(
        water=water,
        pile_nodes=nodes,
        pile_shape=_shape(member, z - foot, k),
        pile_stations=stations,
        pile_station_shape=_shape(member, stations - foot, k),
    )


def _shape(member: Any, z: Float, k: int) -> Float:
    """(6 k, n) shapes of the modes at coordinates (n,) [m] of the member."""
    return np.ascontiguousarray(member.modes.at(z).transpose(0, 2, 1).reshape(6 * k, len(z)))
