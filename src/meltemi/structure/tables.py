"""Layout of the arrays that the structural kernels use.

What structure and aerodynamics exchange is in ``turbine.exchange``.
"""

from __future__ import annotations

from meltemi.maths.tables import table

STRUCTURE = table(
    "structure",
    "",
    """
    gravity           | m/s^2      | gravitational acceleration
    tower_base        | m          | height of the tower base above ground
    tower_length      | m          | tower base to tower top
    top_mass          | kg         | fixed to the tower top, below the yaw bearing
    shaft_height      | m          | tower top to the point where shaft and yaw axis meet
    overhang          | m          | from there to the rotor apex, upwind along the shaft
    tilt              | rad        | shaft tilt, upwind end up
    precone           | rad        | blades lean upwind
    hub_radius        | m          | rotor apex to blade root
    tip xyz           | m          | blade tip from the rotor apex, undeformed, blade axes
    hub_mass          | kg         | hub
    hub_centre        | m          | hub's centre of mass along the shaft from the apex, downwind
    hub_inertia       | kg m^2     | hub about the shaft
    nacelle_mass      | kg         | nacelle
    nacelle_centre xyz| m          | nacelle's centre of mass from the tower top, nacelle axes
    nacelle_inertia xyz| kg m^2    | nacelle about its axes through its centre of mass
    gear_ratio        | -          | generator over rotor speed
    generator_sense   | -          | 1 when it turns as the rotor does, -1 when against it
    generator_inertia | kg m^2     | generator about its own shaft
    gearbox_efficiency| -          | power out over power in
    shaft_stiffness   | N m/rad    | drivetrain torsion, low-speed side
    shaft_damping     | N m s/rad  | the same
    gears symmetric   | kg m^2     | of a gearbox's parts: x nacelle's spin along the shaft, y generator, z torsion
    yaw_stiffness     | N m/rad    | yaw bearing held by its drive
    yaw_damping       | N m s/rad  | the same
    """,
)
"""Scalar parameters."""

GEAR_MODE = table(
    "gear modes",
    "mode",
    """
    frequency    | rad/s  | with rotor and generator held
    damping      | -      | ratio
    inertia      | kg m^2 | modal mass: all modes are scaled to the gears' inertia seen from the rotor
    coupling xyz | kg m^2 | with the nacelle's spin along the shaft, the generator, the torsion
    """,
)
"""Modes of the parts between rotor and generator."""

GEARS = table(
    "gears",
    "mode",
    """
    angle        | rad     | amplitude of the mode, seen from the rotor
    rate         | rad/s   | its derivative
    acceleration | rad/s^2 | its second derivative
    """,
)
"""State of these modes."""

GEAR_ROW = table(
    "gear rows",
    "part",
    """
    factor      | - or 1/m         | static load over the torque of the main shaft
    inertia xyz | kg m^2 or kg m   | load from accelerations of the same three, of parts without states
    """,
)
"""What makes the loads of shafts and meshes; their part from the modes is in ``gear_shape``."""

GEAR_LOAD = table(
    "gear loads",
    "part",
    """
    load | N m or N | torque of a shaft, or force of a mesh along its pitch circle
    """,
)
"""Loads of shafts and meshes, from the rotor on: main shaft; of each stage its meshes and the shaft that goes out."""

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

ROOT_LOAD = table(
    "blade root load",
    "blade",
    """
    force xyz          | N   | at the blade root, coned axes (not pitching)
    moment xyz         | N m | the same
    pitched_force xyz  | N   | the same, blade axes (pitching)
    pitched_moment xyz | N m | the same
    tip xyz            | m   | deflection of the tip, coned axes
    pitched_tip xyz    | m   | the same, blade axes
    tip_rotation xyz   | rad | elastic rotation of the tip, blade axes
    clearance          | m   | distance of the tip from the yaw axis, or from the tower top when above it
    """,
)
"""Loads that each blade exerts on the hub, and its deflection."""

MACHINE_LOAD = table(
    "machine load",
    "",
    """
    apex_force xyz          | N       | of the rotor on the shaft at the apex, shaft axes (not rotating)
    apex_moment xyz         | N m     | the same
    rotating_force xyz      | N       | the same, axes that rotate with blade 1
    rotating_moment xyz     | N m     | the same
    yaw_force xyz           | N       | at the yaw bearing on the tower, tower-top axes (not yawing)
    yaw_moment xyz          | N m     | the same
    top_deflection xyz      | m       | of the tower top, inertial axes
    top_rotation xyz        | rad     | of the tower top
    top_acceleration xyz    | m/s^2   | of the tower top, tower-top axes, without gravity
    rotor_acceleration      | rad/s^2 | of the rotor about the shaft, relative to the nacelle
    nacelle_force xyz       | N       | at the yaw bearing on the tower, nacelle axes (yawing)
    nacelle_moment xyz      | N m     | the same
    """,
)
"""Loads and motion along the chain from rotor to ground."""

STATION_LOAD = table(
    "blade station load",
    "blade station",
    """
    force xyz  | N   | of the outer part of the blade on the inner one, blade axes
    moment xyz | N m | the same
    """,
)
"""Section loads at stations of the blades."""

TOWER_STATION_LOAD = table(
    "tower station load",
    "station",
    """
    force xyz  | N   | of the upper part on the lower one, inertial axes
    moment xyz | N m | the same
    """,
)
"""Section loads at stations of the tower."""
