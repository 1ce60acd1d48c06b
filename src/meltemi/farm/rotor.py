"""Input of a wake from its rotor: loads along the blade, wind, axis and position, read from a run in progress.

Reference: docs/theory/wakes.md (K-1).
"""

from __future__ import annotations

from math import cos, sin

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Table, by_record, kernel, number, xyz
from meltemi.maths.vectors import Vec, cross, dot
from meltemi.simulation.disk.system import DiskSystem
from meltemi.simulation.system import AnySystem, System
from meltemi.structure.equations import YAW

Float = NDArray[float64]


class RotorSums(Table, title="rotor of a wake"):
    """Sums over the samples between two exchanges."""

    samples: float = number("-", "number of them")
    hub: Vec = xyz("m", "rotor apex, axes of the turbine")
    shaft: Vec = xyz("-", "its direction")
    wind: Vec = xyz("m/s", "mean wind over the blades, relative to the hub")


@by_record
def add_rotor(sums: RotorSums, x: Float, f: Float, m: AnySystem) -> None:
    """Add direction and wind to the sums, the radius [m] of the nodes to x, and thrust and driving force per length
    [N/m] of all blades to f (2, n)."""
    raise NotImplementedError


@add_rotor.variant
@kernel
def _(sums: RotorSums, x: Float, f: Float, m: System) -> None:
    """The wind is the mean over the span, as AeroDyn passes it to FAST.Farm, not over the disk."""
    blades, wind, span = m.flow.blades, Vec(0.0, 0.0, 0.0), 0.0
    for n in range(x.shape[0]):
        for b in range(blades):
            length = m.aero_nodes.length[b, n]
            x[n] += m.flow.radius[b, n] / blades
            force, shaft = m.load.force[b, n], m.frame.shaft[b]
            f[0, n] += dot(force, shaft) / max(length, 1e-9)
            moment = m.load.moment[b, n] + cross(m.motion.position[b, n], force)
            f[1, n] += dot(moment, shaft) / max(length * m.flow.radius[b, n], 1e-9)
            wind += length * m.flow.wind[b, n]
            span += length
    sums.shaft += m.machine.shaft
    sums.wind += (1.0 / span) * wind - m.machine.hub_velocity


@add_rotor.variant
@kernel
def _(sums: RotorSums, x: Float, f: Float, m: DiskSystem) -> None:
    """A disk has a uniform thrust coefficient: the thrust per length grows with the radius; the driving force per
    length is constant."""
    last, yaw = x.shape[0] - 1, m.q[YAW]
    for n in range(last + 1):
        r = m.disk.radius * (n + 1.0) / (last + 1.0)
        x[n] += r
        f[0, n] += 2.0 * m.rotor.thrust * r / (m.disk.radius * m.disk.radius)
        f[1, n] += 2.0 * m.rotor.torque / (m.disk.radius * m.disk.radius)
    sums.shaft += Vec(cos(yaw), sin(yaw), 0.0)
    sums.wind += m.rotor.wind


@kernel
def sample(sums: RotorSums, x: Float, f: Float, m: AnySystem) -> None:
    """Add the present state of a rotor to the sums."""
    sums.samples += 1.0
    sums.hub += m.machine.hub_position
    add_rotor(sums, x, f, m)
