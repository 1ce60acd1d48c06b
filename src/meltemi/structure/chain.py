"""The chain of bodies from the ground to the blades, by Kane's method: motion, equations and their solution.

Bodies in their order: tower with what it stands on, nacelle, shaft with hub and generator, and the blades, which meet
at the rotor apex. Each has a separate file with its motion, equations, implicit terms and loads; this one calls them.
For each coordinate r the generalised active and inertia forces balance:

    sum_bodies  T_r . (F - m a) + W_r . (M - dH/dt) = 0

With a = sum_j T_j dv_j/dt + known part this is M dv/dt = f. Each blade is first reduced to one body about the rotor
apex; only this enters the equations of the coordinates below it.

Reference: docs/theory/structure.md (S-25 to S-47), docs/theory/simulation.md (M-41 to M-45); Kane & Levinson (1985),
chapter 6; docs/development/bodies.md.
"""

from __future__ import annotations

from meltemi.compiler import kernel
from meltemi.maths.solve import solve_arrow
from meltemi.maths.vectors import Vec
from meltemi.structure.blades import blade_frames, blade_implicit, blade_loads, blade_motion, station_loads
from meltemi.structure.gears import gear_equations
from meltemi.structure.nacelle import nacelle_equations, nacelle_loads, nacelle_motion, yaw_bearing, yaw_implicit
from meltemi.structure.shaft import drivetrain, hub_loads, hub_motion, rotor, torsion_implicit
from meltemi.structure.tables import SectionLoads, Structure
from meltemi.structure.tower import top_deflection, tower_equations, tower_implicit, tower_loads, tower_top


@kernel
def motion(m: Structure) -> None:
    """Motion of all bodies from coordinates and velocities."""
    tower_top(m)
    nacelle_motion(m)
    hub_motion(m)
    blade_frames(m)
    blade_motion(m)


@kernel
def assemble(dt: float, m: Structure) -> None:
    """Mass matrix and forces of the coordinates below the blades, and their coupling to the blades.

    Args:
      dt: [s] time step, as in ``simulation.step.equations``.
    """
    gravity = Vec(0.0, 0.0, -m.structure.gravity)
    m.core_mass[:] = 0.0
    m.core_force[:] = 0.0
    tower_equations(m)
    rotor(m, gravity)
    nacelle_equations(m, gravity)
    drivetrain(m)
    yaw_bearing(m)
    gear_equations(dt, m)


@kernel
def implicit_terms(dt: float, m: Structure) -> None:
    """Complete the assembled equations of a step for the coordinates with implicit stiffness and damping (M-43).

    These act with the motion at the end of the step.
    """
    tower_implicit(dt, m)
    yaw_implicit(dt, m)
    torsion_implicit(dt, m)
    blade_implicit(dt, m)


@kernel
def chain_loads(m: Structure, s: SectionLoads, everywhere: bool) -> None:
    """Forces and moments that the outboard part of the turbine exerts on the inboard one at a cut (S-41 to S-47).

    They are external loads minus inertia of everything outboard, never stiffness times deflection, so that they do not
    depend on the number of modes. Called after :func:`accelerations`. ``apex`` has the load of the bodies so far.

    Args:
      everywhere: include stations of tower and blades, in addition to roots, hub and yaw bearing.
    """
    blade_loads(m, s)
    hub_loads(m, s)
    nacelle_loads(m, s)
    top_deflection(m, s)
    if everywhere:
        tower_loads(m, s)
        station_loads(m, s)


@kernel
def lock(m: Structure) -> None:
    """Eliminate locked coordinates from the equations: they keep their velocity (zero acceleration)."""
    A, g, D, C, f, locked = m.core_mass, m.core_force, m.arm_mass, m.coupling, m.arm_force, m.locked
    n_core = m.columns.coordinates
    n_blades, n_modes = m.link.blades, m.link.modes
    for i in range(n_core):
        if locked[i] > 0.0:
            g[i] = 0.0
            for j in range(n_core):
                A[i, j] = 0.0
                A[j, i] = 0.0
            A[i, i] = 1.0
            for b in range(n_blades):
                for k in range(n_modes):
                    C[b, k, i] = 0.0
    for b in range(n_blades):
        for k in range(n_modes):
            if locked[n_core + n_modes * b + k] > 0.0:
                f[b, k] = 0.0
                for j in range(n_modes):
                    D[b, k, j] = 0.0
                    D[b, j, k] = 0.0
                D[b, k, k] = 1.0
                for j in range(n_core):
                    C[b, k, j] = 0.0


@kernel
def accelerations(m: Structure) -> None:
    """Solve the assembled equations, which are overwritten, for the second derivatives of all coordinates."""
    n_core, n_blades, n_modes = m.columns.coordinates, m.link.blades, m.link.modes
    lock(m)
    solve_arrow(m.arm_mass, m.coupling, m.arm_force, m.core_mass, m.core_force, n_blades, n_modes, n_core)
    for i in range(n_core):
        m.a[i] = m.core_force[i]
    for b in range(n_blades):
        for k in range(n_modes):
            m.a[n_core + n_modes * b + k] = m.arm_force[b, k]
