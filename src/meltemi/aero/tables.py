"""Tables of the aerodynamics.

The *strip frame* w of a blade node: x normal to the local blade axis, y towards the trailing edge, z
along the blade as it is coned, prebent and bent; pitch, twist and torsion are not part of it.
"""

from __future__ import annotations

from meltemi.compiler import Numbers, Rotations, Table, Vec, Vectors, number, rotation, xyz


class AeroParameters(Table, title="aerodynamics"):
    """Scalar parameters."""

    air_density: float = number("kg/m^3", "density of the air")
    tip_factor: float = number("-", "distance of the tip from the shaft over that of the outermost node")
    inflow_lead: float = number("-", "share of the quasi-steady induced velocity that acts through the second lag only")
    inflow_time: float = number("s", "time constant of the first lag, when constant")
    induction_tolerance: float = number("-", "residual of the momentum balance at which its iterations end")
    skew_factor: float = number("-", "factor of the induction's redistribution in skewed wake")
    axial_drag: float = number("-", "1: drag counts in the axial momentum balance")
    tangential_drag: float = number("-", "1: drag counts in the tangential momentum balance")
    fade_begin: float = number("-", "tip-speed ratio below which there is no induction")
    fade_end: float = number("-", "tip-speed ratio above which induction is full")
    stall_a1: float = number("-", "Wagner function: first amplitude")
    stall_a2: float = number("-", "second amplitude")
    stall_b1: float = number("-", "first rate, in semi-chords")
    stall_b2: float = number("-", "second rate, in semi-chords")
    stall_pressure: float = number("-", "pressure lag, in semi-chords")
    stall_separation: float = number("-", "separation lag, in semi-chords")
    chord_angle: float = number("-", "angle of the chord: 0: in the plane of the strip, 1: the last of three rotations")


class AeroOptions(Table, title="aerodynamic options", integer=True):
    """Options of the model, selected at run time."""

    wake: int = number("-", "0: no induction, 1: blade-element momentum")
    high_induction: int = number("-", "0: momentum theory throughout, 1: Buhl, 2: Madsen's polynomial")
    skew: int = number("-", "0: none, 1: Glauert's redistribution")
    inflow: int = number("-", "model: 0: quasi-steady, 1: constant time, 2: time from wind and induction")
    stall: int = number("-", "model: 0: static polars, 1: Hansen-Gaunaa-Madsen")
    stall_rotation: int = number(
        "-", "rotation of a section about its span: 0: ignored, 1: acts like camber, 2: as OpenFAST"
    )
    reversed_flow: int = number("-", "dynamic stall model in reversed flow: 0: static polar, 1: wake lag")
    tower: int = number("-", "influence of the tower: 0: none, 1: potential flow, 2: the same on the lower half")
    tower_drag: int = number("-", "1: drag on the tower")
    iterations: int = number("-", "largest number of iterations of the induction solver at each evaluation")
    skew_momentum: int = number("-", "momentum of a rotor in skewed flow: 0: axial, 1: Glauert, 2: vortex cylinder")


class AeroNode(Table, axes="blade node", title="aerodynamic node"):
    """Constants of the blade nodes."""

    chord: Numbers = number("m", "chord")
    section: Rotations = rotation("-", "orientation of the undeformed section: normal, chord, span; blade axes")
    centre: Vectors = xyz("m", "aerodynamic centre from the node's reference point, blade axes")
    length: Numbers = number(
        "m", "length of the blade that the node represents, along the arc of the aerodynamic centres"
    )
    solid_length: Numbers = number("m", "blades times chord over 2 pi: solidity times radius")
    tip_number: Numbers = number("-", "blades (arc to the tip) / (2 arc), for Prandtl's tip loss")
    hub_number: Numbers = number("-", "blades (arc from the root) / (2 hub radius), for the hub loss")
    end: Numbers = number("-", "1 where the loss factor vanishes: no load can be balanced by momentum there")
    polar: Numbers = number("-", "index of the polar")
    area: Numbers = number("-", "share of the node in averages over the disk")
    ring: Numbers = number("-", "share of the node in the mean induction, around 70 % of the radius")


class PolarPoint(Table, title="polar", axes="polar angle", fields_last=True):
    """Polars, on a uniform grid of the angle of attack over the full circle."""

    lift: Numbers = number("-", "static lift coefficient")
    drag: Numbers = number("-", "static drag coefficient")
    moment: Numbers = number("-", "static moment coefficient about the aerodynamic centre")
    attachment: Numbers = number("-", "degree of attachment (1: fully attached)")
    attached_lift: Numbers = number("-", "lift coefficient when fully attached")
    separated_lift: Numbers = number("-", "lift coefficient when fully separated")


class SectionConstants(Table, title="section", axes="polar", fields_last=True):
    """Constants of the polars."""

    slope: Numbers = number("1/rad", "slope of the lift in attached flow")
    zero_lift: Numbers = number("rad", "angle of attack without lift")
    drag_floor: Numbers = number("-", "drag coefficient at the angle of zero lift")
    dynamic: Numbers = number("-", "1: dynamic stall applies")


class FlapParameters(Table, axes="flap blade", title="flap"):
    """State of the flaps' actuators."""

    angle: Numbers = number("rad", "deflection, trailing edge towards the pressure side when positive")
    rate: Numbers = number("rad/s", "rate of the deflection")
    acceleration: Numbers = number("rad/s^2", "acceleration of the deflection over the last step")
    held: Numbers = number(
        "rad", "deflection before a jump at this instant; while the equations are evaluated, after it"
    )
    switches: Numbers = number("-", "limits that a difference step would have reached or left, in derivative runs")


class FlapIncrement(Table, title="flap increment", axes="flap angle", fields_last=True):
    """Increments of the coefficients by flaps, on a uniform grid: deflections, angle of attack by angle of attack."""

    lift: Numbers = number("-", "lift coefficient")
    drag: Numbers = number("-", "drag coefficient")
    moment: Numbers = number("-", "moment coefficient")


class InflowState(Table, axes="blade node"):
    """States of the dynamic inflow."""

    reduced_x: Numbers = number("m/s", "lagged induced velocity without its lead, normal to the strip")
    x: Numbers = number("m/s", "induced velocity, normal to the strip")
    reduced_y: Numbers = number("m/s", "lagged induced velocity without its lead, tangential")
    y: Numbers = number("m/s", "induced velocity, tangential")


class StallState(Table, axes="blade node"):
    """States of the dynamic stall."""

    wake_1: Numbers = number("rad", "effective angle of attack, first lag")
    wake_2: Numbers = number("rad", "effective angle of attack, second lag")
    pressure: Numbers = number("-", "lagged attached lift coefficient")
    attachment: Numbers = number("-", "lagged degree of attachment")


class AeroMemory(Table, axes="blade node", title="aerodynamic memory"):
    """Memory of integrator and solver from the last step; not part of the physical state."""

    phi: Numbers = number("rad", "inflow angle of the last evaluation")
    change: Numbers = number("rad", "change of the inflow angle in the last step: the solver begins at their sum")
    slope: Numbers = number("1/rad", "slope of the residual there")
    induced_x: Numbers = number("m/s", "quasi-steady induced velocity of the last step")
    induced_y: Numbers = number("m/s", "quasi-steady induced velocity, tangential")
    time: Numbers = number("s", "time constant of the first inflow lag of the last step")
    alpha: Numbers = number("rad", "angle of attack at three quarters of the chord of the last step")
    rate: Numbers = number("1/s", "relative speed over half the chord of the last step")
    pressure: Numbers = number("-", "attached lift coefficient of the last step")
    attachment: Numbers = number("-", "static degree of attachment of the last step")
    switches: Numbers = number(
        "-", "times the stall model would have come or gone within a difference step, in derivative runs"
    )


class BladeFlow(Table, axes="blade node"):
    """Flow and loads at the blade nodes."""

    wind: Vectors = xyz("m/s", "wind at the aerodynamic centre, tower influence included, inertial axes")
    vx: Numbers = number("m/s", "relative wind normal to the strip, without induction")
    vy: Numbers = number("m/s", "relative wind along the strip, towards the trailing edge, without induction")
    radius: Numbers = number("m", "distance from the shaft")
    theta: Numbers = number("rad", "pitch, twist and torsion together")
    cos_bend: Numbers = number("-", "cosine of the out-of-plane slope of the blade")
    sin_bend: Numbers = number("-", "sine of it; positive when the blade bends downwind")
    rotation: Numbers = number("rad/s", "rotation of the section about its span, nose up")
    pitching: Numbers = number("rad/s", "the part of it that is relative to the rotor: pitch and elastic torsion")
    steady_axial: Numbers = number("-", "quasi-steady axial induction factor")
    steady_tangential: Numbers = number("-", "quasi-steady tangential induction factor")
    residual: Numbers = number("-", "residual of the momentum balance")
    axial: Numbers = number("-", "axial induction factor")
    tangential: Numbers = number("-", "tangential induction factor")
    phi: Numbers = number("rad", "inflow angle")
    alpha: Numbers = number("rad", "angle of attack at the aerodynamic centre")
    speed: Numbers = number("m/s", "relative wind in the strip's plane")
    lift: Numbers = number("-", "lift coefficient")
    drag: Numbers = number("-", "drag coefficient")
    moment: Numbers = number("-", "moment coefficient")
    normal_force: Numbers = number("N/m", "load normal to the strip")
    driving_force: Numbers = number("N/m", "load along the strip, positive when it drives the rotor")
    pitching_moment: Numbers = number("N m/m", "load about the strip's axis, nose up")


class RotorFlow(Table):
    """Rotor averages and sums."""

    wind: Vec = xyz("m/s", "wind averaged over the disk, relative to the hub, inertial axes")
    axial_wind: float = number("m/s", "mean wind along the shaft")
    skew: float = number("rad", "angle between this wind and the shaft")
    skew_axis: Vec = xyz("-", "unit vector of the component of this wind in the rotor plane")
    tip_ratio: float = number("-", "tip-speed ratio")
    fade: float = number("-", "weight of the induction")
    induction: float = number("-", "mean quasi-steady axial induction around 70 % of the radius")
    inflow_time: float = number("s", "time constant of the first inflow lag")
    tip_radius: float = number("m", "largest distance of a node from the shaft")
    force: Vec = xyz("N", "aerodynamic force on the rotor, inertial axes")
    moment: Vec = xyz("N m", "aerodynamic moment about the rotor apex, inertial axes")
    thrust: float = number("N", "force along the shaft, downwind")
    torque: float = number("N m", "driving moment about the shaft")
    residual: float = number("-", "largest residual of the momentum balance")


class TowerFlow(Table, axes="node"):
    """Tower nodes: geometry, deflection and wind; the heights are equidistant."""

    height: Numbers = number("m", "height of the undeflected node above ground")
    diameter: Numbers = number("m", "diameter of the tower")
    drag: Numbers = number("-", "drag coefficient")
    length: Numbers = number("m", "length of the tower that the node represents")
    x: Numbers = number("m", "deflected axis, inertial axes")
    y: Numbers = number("m", "deflection")
    wind: Vectors = xyz("m/s", "wind relative to the tower, inertial axes")
    force: Vectors = xyz("N", "drag of the wind on the node, inertial axes")
