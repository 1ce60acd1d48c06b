"""Quantities exchanged between subsystems: motion, loads, actuator outputs.

Structure, aerodynamics and control never see each other; they share these arrays.

Axes: ``blade``, ``node`` (along a blade or the tower). Frames: i inertial, t tower top, n nacelle, s shaft,
b blade (pitched); see ``docs/conventions.md``. "Known" accelerations are those that remain when all second
derivatives of the generalised coordinates are zero.
"""

from __future__ import annotations

from meltemi.maths.algebra import Rot, Vec
from meltemi.maths.records import Array1, Record
from meltemi.maths.tables import Numbers, Rotations, Table, Vectors, number, rotation, xyz


class Machine(Table):
    """Motion of tower top, nacelle and hub, inertial axes."""

    top_position: Vec = xyz("m", "tower top, inertial axes")
    top_velocity: Vec = xyz("m/s", "the same")
    top_acceleration: Vec = xyz("m/s^2", "the same, known part")
    top_spin: Vec = xyz("rad/s", "angular velocity of the tower top")
    top_spin_rate: Vec = xyz("rad/s^2", "its derivative, known part")
    top: Rot = rotation("-", "orientation R_it of the tower top")
    nacelle: Rot = rotation("-", "orientation R_in of the nacelle")
    nacelle_spin: Vec = xyz("rad/s", "angular velocity of the nacelle")
    nacelle_spin_rate: Vec = xyz("rad/s^2", "its derivative, known part")
    shaft: Vec = xyz("-", "direction of the shaft, downwind")
    hub_position: Vec = xyz("m", "rotor apex")
    hub_velocity: Vec = xyz("m/s", "the same")
    hub_acceleration: Vec = xyz("m/s^2", "the same, known part")
    rotor_spin: Vec = xyz("rad/s", "angular velocity of the rotor")
    rotor_spin_rate: Vec = xyz("rad/s^2", "its derivative, known part")
    azimuth: float = number("rad", "of blade 1 at the rotor end of the shaft, 0 when it points up")
    rotor_speed: float = number("rad/s", "of the rotor end of the shaft, relative to the nacelle")


class BladeFrame(Table, axes="blade"):
    """Motion of the blade roots."""

    orientation: Rotations = rotation("-", "R_ib")
    velocity: Vectors = xyz("m/s", "of the rotor apex, blade axes")
    acceleration: Vectors = xyz("m/s^2", "of the rotor apex, known part, blade axes")
    spin: Vectors = xyz("rad/s", "angular velocity of the blade root, blade axes")
    spin_rate: Vectors = xyz("rad/s^2", "its derivative, known part")
    shaft: Vectors = xyz("-", "direction of the shaft, downwind, blade axes")
    cos_pitch: Numbers = number("-", "cosine of the pitch angle")
    sin_pitch: Numbers = number("-", "sine of the pitch angle")
    azimuth: Numbers = number("rad", "of the blade, 0 when it points up")


class BladeMotion(Table, axes="blade node"):
    """Motion of the blade nodes."""

    position: Vectors = xyz("m", "node from the rotor apex, blade axes")
    velocity: Vectors = xyz("m/s", "in the inertial frame, blade axes")
    acceleration: Vectors = xyz("m/s^2", "known part")
    rotation: Vectors = xyz("rad", "elastic rotation of the section")
    spin: Vectors = xyz("rad/s", "angular velocity of the section")
    spin_rate: Vectors = xyz("rad/s^2", "its derivative, known part")


class BladeLoad(Table, axes="blade node"):
    """External loads on the blade nodes, gravity apart."""

    force: Vectors = xyz("N", "aerodynamic force on the node, blade axes")
    moment: Vectors = xyz("N m", "aerodynamic moment about the node, blade axes")


class Drive(Table):
    """What the control side does to the structure."""

    generator_torque: float = number("N m", "on the generator's shaft, against the rotor's rotation when positive")
    brake_torque: float = number("N m", "of the brake on the generator's shaft, against its rotation")
    brake_speed: float = number("rad/s", "generator speed within which the brake's dry friction is smoothed")
    yaw_command: float = number("rad", "yaw angle that the yaw drive holds")
    yaw_command_rate: float = number("rad/s", "rate at which it turns")
    yaw_held: float = number("-", "1 when the drive holds the bearing through its spring and damper, 0 when it lets go")
    yaw_drive_rate: float = number("rad/s", "at which the drive turns; the command's, unless the brake slips")
    yaw_rubs: float = number(
        "-", "1 while the bearing's friction acts in parallel to the drive, which turns or is free"
    )
    yaw_rest: float = number("rad", "yaw angle at which the friction's spring is free")
    yaw_rest_rate: float = number("rad/s", "of the same: the nacelle's while it slides, 0 while it sticks")
    yaw_drive_torque: float = number("N m", "of the drive and its brake on the nacelle, counter-clockwise from above")
    yaw_friction_torque: float = number("N m", "of the parallel friction on the nacelle")
    yaw_switches: float = number("-", "limits that a difference step would have reached, in derivative runs")


class PitchMotion(Table, axes="blade", title="pitch"):
    """State of the pitch actuators."""

    angle: Numbers = number("rad", "pitch angle")
    rate: Numbers = number("rad/s", "its rate")
    acceleration: Numbers = number("rad/s^2", "its acceleration over the last step")
    switches: Numbers = number("-", "limits that a difference step would have reached or left, in derivative runs")


class TowerShape(Table, axes="mode node", outer=1):
    """Modes of the tower."""

    displacement: Vectors = xyz("-", "of the nodes, inertial axes")
    rotation: Vectors = xyz("rad/m", "of the nodes, inertial axes")


class Exchange(Record):
    """What structure and aerodynamics read of each other and of the control side.

    Coordinates ``q`` and velocities ``v`` begin with those of the tower's modes, on which ``tower_push`` (modes,) is
    the generalised force of the wind.
    """

    q: Array1
    v: Array1
    tower_shape: TowerShape
    tower_push: Array1
    machine: Machine
    frame: BladeFrame
    motion: BladeMotion
    load: BladeLoad
    pitch: PitchMotion
    drive: Drive
