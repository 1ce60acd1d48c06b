"""Layout of the arrays that the aerodynamic kernels use.

The *strip frame* w of a blade node: x normal to the local blade axis, y towards the trailing edge, z
along the blade as it is coned, prebent and bent; pitch, twist and torsion are not part of it.
"""

from __future__ import annotations

from meltemi.maths.tables import table

AERO = table(
    "aerodynamics",
    "",
    """
    air_density      | kg/m^3 | density of the air
    tip_factor       | -      | distance of the tip from the shaft over that of the outermost node
    inflow_lead      | -      | share of the quasi-steady induced velocity that acts through the second lag only
    inflow_time      | s      | time constant of the first lag, when constant
    skew_factor      | -      | of the induction's redistribution in skewed wake
    axial_drag       | -      | 1: drag counts in the axial momentum balance
    tangential_drag  | -      | 1: drag counts in the tangential momentum balance
    fade_begin       | -      | tip-speed ratio below which there is no induction
    fade_end         | -      | tip-speed ratio above which induction is full
    stall_a1         | -      | Wagner function: first amplitude
    stall_a2         | -      | second amplitude
    stall_b1         | -      | first rate, in semi-chords
    stall_b2         | -      | second rate, in semi-chords
    stall_pressure   | -      | pressure lag, in semi-chords
    stall_separation | -      | separation lag, in semi-chords
    sweep_flap       | -      | share of the product of slopes in and out of plane in the chord's angle
    tower_cut        | -      | 1: tower influence only on the lower half of the rotor
    """,
)
"""Scalar parameters."""

AERO_OPTIONS = table(
    "aerodynamic options",
    "",
    """
    wake           | - | 0: no induction, 1: blade-element momentum
    high_induction | - | 0: momentum theory throughout, 1: Buhl
    skew           | - | 0: none, 1: Glauert's redistribution
    inflow         | - | 0: quasi-steady, 1: constant time, 2: time from wind and induction
    stall          | - | 0: static polars, 1: Hansen-Gaunaa-Madsen
    stall_rotation | - | rotation of a section about its span: 0: ignored, 1: acts like camber, 2: as OpenFAST
    tower          | - | 0: no influence of the tower, 1: potential flow
    tower_drag     | - | 1: drag on the tower
    iterations     | - | of the induction solver at each evaluation
    """,
)
"""Options, run-time integers."""

AERO_NODE = table(
    "aerodynamic node",
    "blade node",
    """
    chord        | m   | chord
    twist        | rad | aerodynamic twist, towards feather
    centre xyz   | m   | aerodynamic centre from the node's reference point, blade axes
    slope_x      | rad | prebend: lean of the undeformed section, downwind at zero pitch
    slope_y      | rad | sweep: lean of the undeformed section, towards the trailing edge
    length       | m   | of blade that the node stands for, along the arc of the aerodynamic centres
    solid_length | m   | blades times chord over 2 pi: solidity times radius
    tip_number   | -   | blades (arc to the tip) / (2 arc), for Prandtl's tip loss
    hub_number   | -   | blades (arc from the root) / (2 hub radius), for the hub loss
    end          | -   | 1 where the loss factor vanishes: no load can be balanced by momentum there
    polar        | -   | index of the polar
    area         | -   | share of the node in averages over the disk
    ring         | -   | share of the node in the mean induction, around 70 % of the radius
    """,
)
"""Constants of the blade nodes."""

POLAR = table(
    "polar",
    "",
    """
    lift           | - | static lift coefficient
    drag           | - | static drag coefficient
    moment         | - | static moment coefficient about the aerodynamic centre
    attachment     | - | degree of attachment (1: fully attached)
    attached_lift  | - | lift coefficient when fully attached
    separated_lift | - | lift coefficient when fully separated
    """,
)
"""Columns of a polar, on a uniform grid of the angle of attack over the full circle."""

SECTION = table(
    "section",
    "",
    """
    slope      | 1/rad | slope of the lift in attached flow
    zero_lift  | rad   | angle of attack without lift
    drag_floor | -     | drag coefficient at the angle of zero lift
    dynamic    | -     | 1: dynamic stall applies
    """,
)
"""Columns of constants of a polar."""

INFLOW = table(
    "inflow state",
    "blade node",
    """
    reduced_x | m/s | lagged induced velocity without its lead, normal to the strip
    x         | m/s | induced velocity, normal to the strip
    reduced_y | m/s | the same as reduced_x, tangential
    y         | m/s | induced velocity, tangential
    """,
)
"""States of the dynamic inflow."""

STALL = table(
    "stall state",
    "blade node",
    """
    wake_1     | rad | effective angle of attack, first lag
    wake_2     | rad | effective angle of attack, second lag
    pressure   | -   | lagged attached lift coefficient
    attachment | -   | lagged degree of attachment
    """,
)
"""States of the dynamic stall."""

MEMORY = table(
    "aerodynamic memory",
    "blade node",
    """
    phi        | rad   | inflow angle of the last evaluation: where the solver begins
    slope      | 1/rad | slope of the residual there
    induced_x  | m/s   | quasi-steady induced velocity of the last step
    induced_y  | m/s   | the same, tangential
    time       | s     | time constant of the first inflow lag of the last step
    alpha      | rad   | angle of attack at three quarters of the chord of the last step
    rate       | 1/s   | relative speed over half the chord of the last step
    pressure   | -     | attached lift coefficient of the last step
    attachment | -     | static degree of attachment of the last step
    switches   | -     | times the stall model would have come or gone within a difference step, in derivative runs
    """,
)
"""What integrator and solver remember of the last step; not part of the physical state."""

FLOW = table(
    "blade flow",
    "blade node",
    """
    wind xyz        | m/s | wind at the aerodynamic centre, tower influence included, inertial axes
    vx              | m/s | relative wind normal to the strip, without induction
    vy              | m/s | relative wind along the strip, towards the trailing edge, without induction
    radius          | m   | distance from the shaft
    theta           | rad | pitch, twist and torsion together
    cos_bend        | -   | cosine of the out-of-plane slope of the blade
    sin_bend        | -   | sine of it; positive when the blade bends downwind
    rotation        | rad/s | rotation of the section about its span, nose up
    pitching        | rad/s | the part of it that is relative to the rotor: pitch and elastic torsion
    steady_axial    | -   | quasi-steady axial induction factor
    steady_tangential | - | quasi-steady tangential induction factor
    residual        | -   | of the momentum balance
    axial           | -   | axial induction factor
    tangential      | -   | tangential induction factor
    phi             | rad | inflow angle
    alpha           | rad | angle of attack at the aerodynamic centre
    speed           | m/s | relative wind in the strip's plane
    lift            | -   | lift coefficient
    drag            | -   | drag coefficient
    moment          | -   | moment coefficient
    normal_force    | N/m | load normal to the strip
    driving_force   | N/m | load along the strip, positive when it drives the rotor
    pitching_moment | N m/m | load about the strip's axis, nose up
    """,
)
"""Flow and loads at the blade nodes."""

ROTOR = table(
    "rotor flow",
    "",
    """
    wind xyz   | m/s | wind averaged over the disk, relative to the hub, inertial axes
    axial_wind | m/s | its component along the shaft
    skew       | rad | angle between it and the shaft
    skew_axis xyz | - | unit vector of its component in the rotor plane
    tip_ratio  | -   | tip-speed ratio
    fade       | -   | weight of the induction
    induction  | -   | mean quasi-steady axial induction around 70 % of the radius
    inflow_time| s   | time constant of the first inflow lag
    tip_radius | m   | largest distance of a node from the shaft
    force xyz  | N   | aerodynamic force on the rotor, inertial axes
    moment xyz | N m | aerodynamic moment about the rotor apex, inertial axes
    thrust     | N   | the force along the shaft, downwind
    torque     | N m | the moment about the shaft, driving
    residual   | -   | largest residual of the momentum balance
    """,
)
"""Rotor averages and sums."""

TOWER_FLOW = table(
    "tower flow",
    "node",
    """
    height    | m   | of the undeflected node above ground
    diameter  | m   | of the tower
    drag      | -   | drag coefficient
    length    | m   | of tower that the node stands for
    x         | m   | deflected axis, inertial axes
    y         | m   | the same
    wind xyz  | m/s | wind relative to the tower, inertial axes
    force xyz | N   | of the wind on the node, inertial axes
    """,
)
"""Tower nodes: geometry, deflection and wind; the heights are equidistant."""
