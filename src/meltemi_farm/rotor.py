"""What a rotor gives to its wake: thrust along the blade, wind, axis and place, read from a run in progress.

Reference: docs/theory/wakes.md (K-1).
"""

from __future__ import annotations

from math import cos, sin

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.tables import Table, number, xyz
from meltemi.maths.vectors import Vec, dot
from meltemi.numbers.dispatch import by_record
from meltemi.simulation.disk.system import DiskSystem
from meltemi.simulation.system import AnySystem, System
from meltemi.structure.kinematics import YAW

Float = NDArray[float64]


class RotorSums(Table, title="rotor of a wake"):
    """Sums over the samples of an exchange."""

    samples: float = number("-", "number of them")
    hub: Vec = xyz("m", "rotor apex, axes of the turbine")
    shaft: Vec = xyz("-", "its direction")
    wind: Vec = xyz("m/s", "mean wind over the rotor, relative to the hub")


@by_record
def thrust(x: Float, f: Float, m: AnySystem) -> Vec:
    """Add the radius [m] of each node, and the thrust per length of all blades [N/m] there; the rotor's direction."""
    raise NotImplementedError


@thrust.variant
@kernel
def _(x: Float, f: Float, m: System) -> Vec:
    blades = m.flow.blades
    for n in range(x.shape[0]):
        for b in range(blades):
            x[n] += m.flow.radius[b, n] / blades
            f[n] += dot(m.load.force[b, n], m.frame.shaft[b]) / max(m.aero_nodes.length[b, n], 1e-9)
    return m.machine.shaft


@thrust.variant
@kernel
def _(x: Float, f: Float, m: DiskSystem) -> Vec:
    """A disk has the thrust coefficient everywhere: its thrust per length grows with the radius."""
    last = x.shape[0] - 1
    for n in range(last + 1):
        r = m.disk.radius * (n + 1.0) / (last + 1.0)
        x[n] += r
        f[n] += 2.0 * m.rotor.thrust * r / (m.disk.radius * m.disk.radius)
    yaw = m.q[YAW]
    return Vec(cos(yaw), sin(yaw), 0.0)


@kernel
def sample(sums: RotorSums, x: Float, f: Float, m: AnySystem) -> None:
    """Add the present state of a rotor to the sums."""
    sums.samples += 1.0
    sums.hub += m.machine.hub_position
    sums.shaft += thrust(x, f, m)
    sums.wind += m.rotor.wind
