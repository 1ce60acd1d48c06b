"""Arrays of ``structure.gears`` from the data of a gearbox: a torsional chain, reduced by Craig and Bampton.

Angles of all parts are relative to the nacelle. The ends, rotor and generator, are coordinates of the turbine; the
parts between them have the static motion due to the ends, and modes with both ends fixed.

Reference: docs/theory/structure.md (S-49 to S-58); Craig & Bampton (1968).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.structure.tables import GearModes, GearRows
from meltemi.turbine.definition import Drivetrain

Float = NDArray[np.float64]
HOUSING = "housing"
"""Name of the spring of a ring in its housing, which has no channel."""


@dataclass(frozen=True)
class GearTrain:
    """A drivetrain as rotating bodies and springs between them; the first body is the rotor's end of the main shaft,
    the last one the generator's end, both without inertia.

    Attributes:
      bodies: names of the bodies.
      inertia: (N,) [kg m^2] inertia of each body about its axis; the orbital inertia of planets is in that of the
        carrier.
      speed: (N,) [-] speed in rigid motion over that of the rotor, negative if opposite to it; 0 for a ring.
      springs: names of the springs, from the rotor on.
      deflection: (E, N) [m or rad] deflection of a spring for unit angles of the bodies; positive when the rotor
        drives.
      stiffness: (E,) [N/m or N m/rad] stiffness of each spring.
      number: (E,) number of equal springs in parallel: planets.
    """

    bodies: tuple[str, ...]
    inertia: Float
    speed: Float
    springs: tuple[str, ...]
    deflection: Float = field(repr=False)
    stiffness: Float
    number: Float

    @property
    def stiffness_matrix(self) -> Float:
        """(N, N) [N m/rad] stiffness of all bodies."""
        return self.deflection.T @ ((self.number * self.stiffness)[:, None] * self.deflection)


@dataclass(frozen=True)
class ReducedTrain:
    """The drivetrain reduced to rotation of nacelle and generator, torsion, and modes (S-52 to S-54).

    Attributes:
      inertia: (3, 3) [kg m^2] inertia matrix of the nacelle's rotation about the shaft, generator, torsion.
      frequency: (K,) [rad/s] frequencies of the modes with both ends fixed.
      modal_inertia: [kg m^2] inertia of each mode.
      coupling: (3, K) [kg m^2] coupling of the modes and these three.
      factor: (E,) static load of each spring over the torque of the main shaft.
      shape: (E, K) [N/rad or N m/rad] load of each spring in each mode.
    """

    inertia: Float
    frequency: Float
    modal_inertia: float
    coupling: Float
    factor: Float
    shape: Float

    @property
    def static_loads(self) -> Float:
        """(E, 3) load of each spring due to accelerations of the three, in quasi-static motion of the parts."""
        result: Float = -(self.shape / (self.modal_inertia * self.frequency**2)) @ self.coupling.T
        return result


def gear_train(drivetrain: Drivetrain) -> GearTrain:
    """Bodies and springs of a drivetrain that has a gearbox."""
    gearbox = drivetrain.gearbox
    assert gearbox is not None
    bodies: list[tuple[str, float, float]] = [("rotor end", 0.0, 1.0)]
    springs: list[tuple[str, dict[int, float], float, int]] = []
    speed = 1.0
    into, out_stiffness = "main shaft", drivetrain.main_shaft_stiffness

    def shaft(sense: float) -> None:
        """Add the spring between the last body and the next one."""
        n = len(bodies)
        springs.append((into, {n - 1: sense, n: -sense}, out_stiffness, 1))

    for number, s in enumerate(gearbox.planetary, 1):
        shaft(1.0)
        c = len(bodies)
        orbit, planet, sun, ring = s.orbit_radius, s.planet_radius, s.sun_radius, s.ring_radius
        bodies.append((f"carrier {number}", s.carrier_inertia + s.planets * s.planet_mass * orbit**2, speed))
        bodies.append((f"planets {number}", s.planets * s.planet_inertia, -speed * orbit / planet))
        at_ring = {c: orbit, c + 1: planet}
        if s.ring_inertia is not None and s.ring_stiffness is not None:
            at_ring[c + 2] = -ring
            bodies.append((f"ring {number}", s.ring_inertia, 0.0))
        k = len(bodies)
        springs.append((f"stage {number} sun", {c: orbit, c + 1: -planet, k: -sun}, s.sun_mesh, s.planets))
        springs.append((f"stage {number} ring", at_ring, s.ring_mesh, s.planets))
        if s.ring_stiffness is not None:
            springs.append((f"stage {number} {HOUSING}", {k - 1: 1.0}, s.ring_stiffness, 1))
        speed *= s.ratio
        bodies.append((f"sun {number}", s.sun_inertia, speed))
        into, out_stiffness = f"stage {number} shaft", s.shaft_stiffness
    if (p := gearbox.parallel) is not None:
        shaft(1.0)
        w = len(bodies)
        bodies.append(("wheel", p.wheel_inertia, speed))
        speed *= -p.ratio
        bodies.append(("pinion", p.pinion_inertia, speed))
        mesh = {w: p.ratio * p.pinion_radius, w + 1: p.pinion_radius}
        springs.append((f"stage {len(gearbox.stages)} mesh", mesh, p.mesh, 1))
        into, out_stiffness = f"stage {len(gearbox.stages)} shaft", p.shaft_stiffness
    shaft(gearbox.sense)
    bodies.append(("generator end", 0.0, speed))
    deflection = np.zeros((len(springs), len(bodies)))
    for row, (_, arms, _, _) in zip(deflection, springs, strict=True):
        for body, arm in arms.items():
            row[body] = arm
    return GearTrain(
        bodies=tuple(name for name, _, _ in bodies),
        inertia=np.array([J for _, J, _ in bodies]),
        speed=np.array([r for _, _, r in bodies]),
        springs=tuple(name for name, _, _, _ in springs),
        deflection=deflection,
        stiffness=np.array([k for _, _, k, _ in springs]),
        number=np.array([float(n) for _, _, _, n in springs]),
    )


def reduced(train: GearTrain) -> ReducedTrain:
    """Reduce the parts between rotor and generator to static motion and modes (S-52 to S-54)."""
    K, J, speed = train.stiffness_matrix, train.inertia[1:-1], train.speed[1:-1]
    inner = slice(1, -1)
    torsion = np.concatenate([[1.0], -np.linalg.solve(K[inner, inner], K[inner, 0]), [0.0]])
    root = np.sqrt(J)
    square, vector = np.linalg.eigh(K[inner, inner] / np.outer(root, root))
    # all modes are scaled to the inertia of the gears referred to the rotor, so that amplitudes are angles
    modal = float(J @ speed**2)
    phi = np.zeros((len(K), len(J)))
    phi[inner] = vector / root[:, None] * np.sqrt(modal)
    spins = np.stack([np.ones_like(J), speed, torsion[inner]])
    loads = train.stiffness[:, None] * train.deflection
    return ReducedTrain(
        inertia=(spins * J) @ spins.T,
        frequency=np.sqrt(square),
        modal_inertia=modal,
        coupling=(spins * J) @ phi[inner],
        factor=loads @ torsion / (torsion @ K @ torsion),
        shape=loads @ phi,
    )


def gear_arrays(drivetrain: Drivetrain, *, multibody: bool) -> tuple[Float, Float, Float, Float]:
    """Arrays of the kernels: inertia (6,), tables ``GearModes`` and ``GearRows``, and loads of the modes (parts,
    modes).

    Args:
      multibody: whether the modes are included; without them the parts follow rotor and generator quasi-statically.
    """
    assert drivetrain.gearbox is not None
    train = gear_train(drivetrain)
    r = reduced(train)
    n = len(r.frequency) if multibody else 0
    shown = [not name.endswith(HOUSING) for name in train.springs]
    modes, rows = GearModes.zeros(mode=n), GearRows.zeros(part=sum(shown))
    m, e = View(GearModes, modes), View(GearRows, rows)
    m["frequency"], m["damping"] = r.frequency[:n], drivetrain.gearbox.damping_ratio
    m["inertia"], m["coupling"] = r.modal_inertia, r.coupling[:, :n]
    e["factor"] = r.factor[shown]
    if n == 0:
        e["inertia"] = r.static_loads[shown].T
    J = r.inertia
    inertia = np.array([J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])
    return inertia, modes, rows, np.ascontiguousarray(r.shape[shown, :n])
