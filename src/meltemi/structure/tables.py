"""Layout of the arrays that the structural kernels use.

What structure and aerodynamics exchange is in ``turbine.exchange``.
"""

from __future__ import annotations

from meltemi.core.tables import table

STRUCTURE = table(
    "structure",
    "",
    """
    gravity           | m/s^2      | gravitational acceleration
    tower_base        | m          | height of the tower base above ground
    tower_length      | m          | tower base to tower top
    shaft_height      | m          | tower top to the point where shaft and yaw axis meet
    overhang          | m          | from there to the rotor apex, upwind along the shaft
    tilt              | rad        | shaft tilt, upwind end up
    precone           | rad        | blades lean upwind
    hub_radius        | m          | rotor apex to blade root
    hub_mass          | kg         | hub
    hub_centre        | m          | hub's centre of mass along the shaft from the apex, downwind
    hub_inertia       | kg m^2     | hub about the shaft
    nacelle_mass      | kg         | nacelle
    nacelle_centre xyz| m          | nacelle's centre of mass from the tower top, nacelle axes
    nacelle_inertia xyz| kg m^2    | nacelle about its axes through its centre of mass
    gear_ratio        | -          | generator over rotor speed
    generator_inertia | kg m^2     | generator about its own shaft
    shaft_stiffness   | N m/rad    | drivetrain torsion, low-speed side
    shaft_damping     | N m s/rad  | the same
    yaw_stiffness     | N m/rad    | yaw bearing held by its drive
    yaw_damping       | N m s/rad  | the same
    """,
)
"""Scalar parameters."""

BLADE_NODE = table(
    "blade node",
    "blade node",
    """
    position xyz      | m      | reference point from the rotor apex, undeformed, blade axes
    mass              | kg     | piece of blade that moves with the node
    moment xyz        | kg m   | its first moment about the node
    inertia symmetric | kg m^2 | its inertia about the node
    """,
)
"""Constants of the blade nodes."""

TOWER_NODE = table(
    "tower node",
    "node",
    """
    height     | m      | above the tower base
    length     | m      | of the piece of tower that moves with the node
    mass       | kg     | the same piece
    inertia xyz| kg m^2 | its inertia about the node
    """,
)
"""Constants of the tower nodes."""

BODY = table(
    "blade body",
    "blade",
    """
    mass              | kg     | of the blade
    moment xyz        | kg m   | first moment about the rotor apex, blade axes
    inertia symmetric | kg m^2 | about the rotor apex, blade axes
    force xyz         | N      | external forces minus mass times known accelerations, blade axes
    torque xyz        | N m    | their moment about the rotor apex
    """,
)
"""A blade as one body, seen from the rotor apex."""
