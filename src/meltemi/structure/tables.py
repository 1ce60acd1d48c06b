"""Layout of the arrays of the structural kernels.

The quantities that structure and aerodynamics exchange are in ``turbine.exchange``.
"""

from __future__ import annotations

from meltemi.compiler import (
    Array1,
    Array2,
    Array3,
    Array4,
    Constant,
    KernelRecord,
    Numbers,
    Sym,
    Symmetrics,
    Table,
    Vec,
    Vectors,
    number,
    symmetric,
    xyz,
)
from meltemi.turbine.exchange import Exchange


class StructureParameters(Table, title="structure"):
    """Scalar parameters of the structure."""

    gravity: float = number("m/s^2", "gravitational acceleration")
    tower_base: float = number("m", "height of the tower base above ground")
    tower_length: float = number("m", "distance from tower base to tower top")
    top_mass: float = number("kg", "mass fixed to the tower top, below the yaw bearing")
    shaft_height: float = number("m", "height of the intersection of shaft and yaw axis above the tower top")
    overhang: float = number("m", "distance from this intersection to the rotor apex, upwind along the shaft")
    tilt: float = number("rad", "shaft tilt, upwind end up")
    precone: float = number("rad", "precone, upwind positive")
    hub_radius: float = number("m", "distance from rotor apex to blade root")
    tip: Vec = xyz("m", "blade tip from the rotor apex, undeformed, blade axes")
    hub_mass: float = number("kg", "mass of the hub")
    hub_centre: float = number("m", "hub's centre of mass along the shaft from the apex, downwind")
    hub_inertia: float = number("kg m^2", "inertia of the hub about the shaft")
    nacelle_mass: float = number("kg", "mass of the nacelle")
    nacelle_centre: Vec = xyz("m", "nacelle's centre of mass from the tower top, nacelle axes")
    nacelle_inertia: Vec = xyz("kg m^2", "moments of inertia of the nacelle about axes through its centre of mass")
    gear_ratio: float = number("-", "ratio of generator to rotor speed")
    generator_sense: float = number("-", "1 when it rotates in the sense of the rotor, -1 when opposite to it")
    generator_inertia: float = number("kg m^2", "inertia of the generator about its shaft")
    gearbox_efficiency: float = number("-", "efficiency of the gearbox: power out over power in")
    shaft_stiffness: float = number("N m/rad", "torsional stiffness of the drivetrain, low-speed side")
    shaft_damping: float = number("N m s/rad", "torsional damping of the drivetrain, low-speed side")
    gears: Sym = symmetric("kg m^2", "inertia of the gearbox: x nacelle rotation along shaft, y generator, z torsion")
    yaw_stiffness: float = number("N m/rad", "stiffness of the yaw bearing with engaged drive")
    yaw_damping: float = number("N m s/rad", "damping of the yaw bearing with engaged drive")


class GearModes(Table, axes="mode"):
    """Modes of the gearbox between rotor and generator."""

    frequency: Numbers = number("rad/s", "natural frequency with rotor and generator fixed")
    damping: Numbers = number("-", "damping ratio")
    inertia: Numbers = number("kg m^2", "modal mass: all modes are scaled to the gears' inertia referred to the rotor")
    coupling: Vectors = xyz("kg m^2", "coupling to nacelle rotation about the shaft, generator, torsion")


class Gears(Table, axes="mode"):
    """State of the gearbox modes."""

    angle: Numbers = number("rad", "amplitude of the mode, referred to the rotor")
    rate: Numbers = number("rad/s", "first derivative of the amplitude")
    acceleration: Numbers = number("rad/s^2", "second derivative of the amplitude")


class GearRows(Table, axes="part"):
    """Coefficients of the loads of shafts and meshes; those of the modes are in ``gear_shape``."""

    factor: Numbers = number("- or 1/m", "static load over the torque of the main shaft")
    inertia: Vectors = xyz("kg m^2 or kg m", "quasi-static load per acceleration of nacelle, generator, torsion")


class GearLoads(Table, axes="part"):
    """Loads of shafts and meshes, from the rotor on: main shaft; meshes and output shaft of each stage."""

    load: Numbers = number("N m or N", "torque of a shaft, or force of a mesh along its pitch circle")


class BladeNode(Table, axes="blade node"):
    """Constants of the blade nodes."""

    position: Vectors = xyz("m", "reference point from the rotor apex, undeformed, blade axes")
    mass: Numbers = number("kg", "mass of the piece of blade that moves with the node")
    moment: Vectors = xyz("kg m", "first moment of the piece about the node")
    inertia: Symmetrics = symmetric("kg m^2", "inertia of the piece about the node")


class TowerNode(Table, axes="node"):
    """Constants of the tower nodes."""

    height: Numbers = number("m", "height above the tower base")
    length: Numbers = number("m", "length of the piece of tower that moves with the node")
    mass: Numbers = number("kg", "mass of the piece")
    inertia: Vectors = xyz("kg m^2", "inertia of the piece about the node")


class TowerPiece(Table, axes="node"):
    """Present loads of the pieces of the tower, axes of its base."""

    offset: Vectors = xyz("m", "deflection of the node")
    force: Vectors = xyz("N", "force of wind and gravity minus inertia")
    moment: Vectors = xyz("N m", "moment of inertia about the node")


class BladeBody(Table, axes="blade"):
    """A blade as one body about the rotor apex."""

    mass: Numbers = number("kg", "mass of the blade")
    moment: Vectors = xyz("kg m", "first moment about the rotor apex, blade axes")
    inertia: Symmetrics = symmetric("kg m^2", "inertia about the rotor apex, blade axes")
    force: Vectors = xyz("N", "external forces minus mass times known accelerations, blade axes")
    torque: Vectors = xyz("N m", "moment of these forces about the rotor apex, blade axes")


class BladeRootLoad(Table, axes="blade"):
    """Loads that each blade exerts on the hub, and deflection of its tip."""

    force: Vectors = xyz("N", "force at the blade root, coned axes (not pitching)")
    moment: Vectors = xyz("N m", "moment at the blade root, coned axes (not pitching)")
    pitched_force: Vectors = xyz("N", "force at the blade root, blade axes (pitching)")
    pitched_moment: Vectors = xyz("N m", "moment at the blade root, blade axes (pitching)")
    tip: Vectors = xyz("m", "deflection of the tip, coned axes")
    pitched_tip: Vectors = xyz("m", "deflection of the tip, blade axes")
    tip_rotation: Vectors = xyz("rad", "elastic rotation of the tip, blade axes")
    clearance: Numbers = number("m", "distance of the tip from the yaw axis, or from the tower top when above it")


class MachineLoad(Table):
    """Loads and motion from the rotor to the ground."""

    apex_force: Vec = xyz("N", "force of the rotor on the shaft at the apex, shaft axes (not rotating)")
    apex_moment: Vec = xyz("N m", "moment of the rotor on the shaft at the apex, shaft axes (not rotating)")
    rotating_force: Vec = xyz("N", "force of the rotor on the shaft at the apex, axes rotating with blade 1")
    rotating_moment: Vec = xyz("N m", "moment of the rotor on the shaft at the apex, axes rotating with blade 1")
    yaw_force: Vec = xyz("N", "force at the yaw bearing on the tower, tower-top axes (not yawing)")
    yaw_moment: Vec = xyz("N m", "moment at the yaw bearing on the tower, tower-top axes (not yawing)")
    top_deflection: Vec = xyz("m", "deflection of the tower top, inertial axes")
    top_rotation: Vec = xyz("rad", "rotation of the tower top")
    top_acceleration: Vec = xyz("m/s^2", "acceleration of the tower top, tower-top axes, without gravity")
    nacelle_turning: Vec = xyz("rad/s^2", "angular acceleration of the nacelle, shaft axes (not rotating)")
    next_acceleration: Vec = xyz("m/s^2", "acceleration of the tower top, extrapolated to the next instant")
    next_turning: Vec = xyz("rad/s^2", "angular acceleration of the nacelle, extrapolated to the next instant")
    rotor_acceleration: float = number("rad/s^2", "acceleration of the rotor about the shaft, relative to the nacelle")
    nacelle_force: Vec = xyz("N", "force at the yaw bearing on the tower, nacelle axes (yawing)")
    nacelle_moment: Vec = xyz("N m", "moment at the yaw bearing on the tower, nacelle axes (yawing)")


class BladeStationLoad(Table, axes="blade station"):
    """Section loads at stations of the blades."""

    force: Vectors = xyz("N", "force of the outboard part of the blade on the inboard part, blade axes")
    moment: Vectors = xyz("N m", "moment of the outboard part of the blade on the inboard part, blade axes")


class TowerStationLoad(Table, axes="station"):
    """Section loads at stations of the tower."""

    force: Vectors = xyz("N", "force of the upper part on the lower part, inertial axes")
    moment: Vectors = xyz("N m", "moment of the upper part on the lower part, inertial axes")


class ApexColumns(Table, title="columns", axes="coordinate"):
    """Partial velocities of the rotor apex by the coordinates below the blades."""

    linear: Vectors = xyz("- or m", "partial velocity of the apex, inertial axes")
    angular: Vectors = xyz("rad/m or -", "partial angular velocity of the body moved by the coordinate, inertial axes")


class TopShape(Table, axes="mode"):
    """Tower modes at the tower top."""

    displacement: Vectors = xyz("-", "displacement of the tower top")
    rotation: Vectors = xyz("rad/m", "rotation of the tower top")


class TipShape(Table, axes="mode"):
    """Modes of a blade at its tip."""

    displacement: Vectors = xyz("-", "displacement of the tip, blade axes")
    rotation: Vectors = xyz("rad/m", "rotation of the tip, blade axes")


class TowerDrag(Table, axes="node"):
    """Wind loads on the tower."""

    force: Vectors = xyz("N", "force on the node, inertial axes")


class ApexLoad(Table):
    """Load passed on along the structure: of the blades at the apex, then at the yaw bearing."""

    force: Vec = xyz("N", "force, inertial axes")
    moment: Vec = xyz("N m", "moment, inertial axes")


class BladeShape(Table, axes="mode blade node", outer=1):
    """Modes of the blades."""

    displacement: Vectors = xyz("-", "displacement of the nodes, blade axes")
    rotation: Vectors = xyz("rad/m", "rotation of the sections, blade axes")


class BladeSecond(Table, axes="pair blade node", outer=1):
    """Second-order displacements by pairs of modes, in row k modes + j."""

    displacement: Vectors = xyz("1/m", "displacement of the nodes, blade axes")


class BladePartial(Table, axes="mode blade node", outer=1):
    """Partial velocities of the blade nodes relative to the blade root."""

    velocity: Vectors = xyz("-", "partial velocity of the nodes by the mode, blade axes")
    rotation: Vectors = xyz("rad/m", "partial angular velocity of the sections by the mode, blade axes")


class BladeLink(Table, axes="blade mode"):
    """Momentum of a blade about the apex for each mode at unit speed, blade axes."""

    linear: Vectors = xyz("kg", "momentum")
    angular: Vectors = xyz("kg m", "angular momentum at unit speed")


class StepWeights(Table, axes="coordinate"):
    """Weights of the time step of the coordinates; zero where stiffness and damping are explicit."""

    position: Numbers = number("s^2", "beta h^2, position per acceleration at the end of the step")
    lag: Numbers = number("s", "kappa h, of the velocity per change of acceleration over the step")
    expected: Numbers = number("m/s^2 or rad/s^2", "acceleration at the end of the step, extrapolated")


class Coordinates(KernelRecord):
    """Record of which the number of coordinates below the blades is known: that of the columns."""

    columns: ApexColumns


class Structure(Exchange, Coordinates):
    """Record of the structural kernels."""

    # state
    a: Array1
    gears: Gears
    weights: StepWeights
    # parameters
    locked: Array1
    structure: StructureParameters
    blade_nodes: BladeNode
    shape: BladeShape
    second: BladeSecond
    modal: Array4
    top_shape: TopShape
    top_second: Array3
    tower_matrix: Array3
    tower_weight: Array1
    gear_modes: GearModes
    # motion
    partial: BladePartial
    # equations of motion
    body: BladeBody
    link: BladeLink
    arm_mass: Array3
    arm_force: Array2
    core_mass: Array2
    core_force: Array1
    coupling: Array3


class SectionLoads(KernelRecord):
    """Additional record of the section loads: stations, and the loads; never in lanes."""

    gear_rows: GearRows
    gear_shape: Array2
    blade_edges: Array1
    tip_shape: TipShape
    tip_second: Array3
    tower_nodes: TowerNode
    tower_piece: TowerPiece
    tower_drag: TowerDrag
    blade_stations: Constant[Array1]
    tower_stations: Constant[Array1]
    apex: ApexLoad
    root: BladeRootLoad
    chain: MachineLoad
    gear_loads: GearLoads
    station: BladeStationLoad
    tower_station: TowerStationLoad
