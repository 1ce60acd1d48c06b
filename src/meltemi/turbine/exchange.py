"""Quantities exchanged between subsystems: motion, loads, actuator outputs.

Structure, aerodynamics and control exchange data only through these arrays.

Axes: ``blade``, ``node`` (along a blade or the tower). Frames: i inertial, t tower top, n nacelle, s shaft,
b blade (pitched); see ``docs/conventions.md``. "Known" accelerations are those that remain when all second
derivatives of the generalised coordinates are zero.
"""

from __future__ import annotations

from typing import Literal

from meltemi.compiler import Array1, KernelRecord, Numbers, Rot, Rotations, Table, Vec, Vectors, number, rotation, xyz

ActuatorModel = Literal["second_order", "ideal"]
"""Models of the actuators of pitch and flaps: files in ``control/actuator_models``."""


class Machine(Table):
    """Motion of tower top, nacelle and hub, inertial axes."""

    top_position: Vec = xyz("m", "tower top, inertial axes")
    top_velocity: Vec = xyz("m/s", "velocity of the tower top")
    top_acceleration: Vec = xyz("m/s^2", "acceleration of the tower top, known part")
    top_spin: Vec = xyz("rad/s", "angular velocity of the tower top")
    top_spin_rate: Vec = xyz("rad/s^2", "angular acceleration of the tower top, known part")
    top: Rot = rotation("-", "orientation R_it of the tower top")
    nacelle: Rot = rotation("-", "orientation R_in of the nacelle")
    nacelle_spin: Vec = xyz("rad/s", "angular velocity of the nacelle")
    nacelle_spin_rate: Vec = xyz("rad/s^2", "angular acceleration of the nacelle, known part")
    shaft: Vec = xyz("-", "direction of the shaft, downwind")
    hub_position: Vec = xyz("m", "position of the rotor apex")
    hub_velocity: Vec = xyz("m/s", "velocity of the rotor apex")
    hub_acceleration: Vec = xyz("m/s^2", "acceleration of the rotor apex, known part")
    rotor_spin: Vec = xyz("rad/s", "angular velocity of the rotor")
    rotor_spin_rate: Vec = xyz("rad/s^2", "angular acceleration of the rotor, known part")
    azimuth: float = number("rad", "azimuth of blade 1 at the rotor end of the shaft, 0 when it points up")
    rotor_speed: float = number("rad/s", "speed of the rotor end of the shaft, relative to the nacelle")


class BladeFrame(Table, axes="blade"):
    """Motion of the blade roots."""

    orientation: Rotations = rotation("-", "orientation R_ib of the blade root")
    velocity: Vectors = xyz("m/s", "velocity of the rotor apex, blade axes")
    acceleration: Vectors = xyz("m/s^2", "acceleration of the rotor apex, known part, blade axes")
    spin: Vectors = xyz("rad/s", "angular velocity of the blade root, blade axes")
    spin_rate: Vectors = xyz("rad/s^2", "angular acceleration of the blade root, known part")
    shaft: Vectors = xyz("-", "direction of the shaft, downwind, blade axes")
    cos_pitch: Numbers = number("-", "cosine of the pitch angle")
    sin_pitch: Numbers = number("-", "sine of the pitch angle")
    azimuth: Numbers = number("rad", "azimuth of the blade, 0 when it points up")


class BladeMotion(Table, axes="blade node"):
    """Motion of the blade nodes."""

    position: Vectors = xyz("m", "node from the rotor apex, blade axes")
    velocity: Vectors = xyz("m/s", "velocity in the inertial frame, blade axes")
    acceleration: Vectors = xyz("m/s^2", "acceleration, known part")
    orientation: Rotations = rotation("-", "orientation of the section, from the undeformed one, blade axes")
    spin: Vectors = xyz("rad/s", "angular velocity of the section")
    spin_rate: Vectors = xyz("rad/s^2", "angular acceleration of the section, known part")


class BladeLoad(Table, axes="blade node"):
    """External loads on the blade nodes, without gravity."""

    force: Vectors = xyz("N", "aerodynamic force on the node, blade axes")
    moment: Vectors = xyz("N m", "aerodynamic moment about the node, blade axes")


class Drive(Table):
    """Torques of the actuators on the structure, and state of the yaw drive."""

    generator_torque: float = number("N m", "torque on the generator's shaft, positive against the rotor's rotation")
    torque_held: float = number(
        "N m", "torque before a jump at this instant; while the equations are evaluated, after it"
    )
    brake_torque: float = number("N m", "brake torque on the generator's shaft, against its rotation")
    brake_speed: float = number("rad/s", "generator speed within which the brake's dry friction is smoothed")
    yaw_command: float = number("rad", "yaw angle commanded by the yaw drive")
    yaw_command_rate: float = number("rad/s", "rate of the commanded yaw angle")
    yaw_held: float = number("-", "1: the drive holds the bearing through its spring and damper; 0: free")
    yaw_drive_rate: float = number("rad/s", "yaw rate of the drive: the commanded one, unless the brake slips")
    yaw_rubs: float = number("-", "1: the bearing friction acts in parallel to the drive, which rotates or is free")
    yaw_rest: float = number("rad", "yaw angle at which the friction's spring is unloaded")
    yaw_rest_rate: float = number("rad/s", "rate of this angle: that of the nacelle while it slides, 0 while it sticks")
    yaw_drive_torque: float = number("N m", "torque of drive and brake on the nacelle, counter-clockwise from above")
    yaw_friction_torque: float = number("N m", "torque of the parallel friction on the nacelle")
    yaw_switches: float = number("-", "limits reached within the finite difference, in derivative runs")


class PitchMotion(Table, axes="blade", title="pitch"):
    """State of the pitch actuators."""

    angle: Numbers = number("rad", "pitch angle")
    rate: Numbers = number("rad/s", "pitch rate")
    acceleration: Numbers = number("rad/s^2", "pitch acceleration over the last step")
    held: Numbers = number("rad", "angle before a jump at this instant; while the equations are evaluated, after it")
    switches: Numbers = number("-", "limits reached or left within the finite difference, in derivative runs")


class TowerShape(Table, axes="mode node", outer=1):
    """Modes of the tower."""

    displacement: Vectors = xyz("-", "displacement of the nodes, inertial axes")
    rotation: Vectors = xyz("rad/m", "rotation of the nodes, inertial axes")


class Exchange(KernelRecord):
    """Record of the data that structure, aerodynamics and control exchange.

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
