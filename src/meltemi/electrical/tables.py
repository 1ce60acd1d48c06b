"""Arrays of the electrical system: parameters, states and recorded quantities.

Peak values of a phase in dq axes, generator convention: a current out of the machine, and into the grid, is positive.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import KernelRecord, Table, dq, number
from meltemi.electrical.system import RESERVE, ElectricalSystem
from meltemi.maths.phasors import Phasor

Float = NDArray[np.float64]


class ElectricalParameters(Table, title="electrical"):
    """Parameters."""

    pole_pairs: float = number("-", "number of pole pairs")
    flux: float = number("Wb", "flux linkage of the magnets with a phase")
    stator_resistance: float = number("Ohm", "resistance of a phase")
    stator_inductance: float = number("H", "inductance of a phase")
    iron_drag: float = number("N m s", "iron and stray losses over the square of the speed")
    machine_limit: float = number("A", "current limit of the machine-side converter")
    machine_standing: float = number("W", "no-load loss of the machine-side converter at nominal DC-link voltage")
    machine_drop: float = number("V", "loss of the machine-side converter per current")
    machine_ohms: float = number("Ohm", "loss of the machine-side converter per square of the current")
    grid_limit: float = number("A", "current limit of the grid-side converter")
    grid_standing: float = number("W", "no-load loss of the grid-side converter at nominal DC-link voltage")
    grid_drop: float = number("V", "loss of the grid-side converter per current")
    grid_ohms: float = number("Ohm", "loss of the grid-side converter per square of the current")
    filter_resistance: float = number("Ohm", "resistance of a phase of the filter")
    filter_inductance: float = number("H", "inductance of a phase of the filter")
    grid_peak: float = number("V", "nominal phase voltage of the grid, peak")
    grid_current: float = number("A", "rated current of the grid side")
    nominal_frequency: float = number("rad/s", "nominal angular frequency of the grid")
    dc_voltage: float = number("V", "nominal DC-link voltage")
    capacitance: float = number("F", "capacitance of the DC link")
    dc_highest: float = number("V", "DC-link voltage above which the turbine trips")
    dc_lowest: float = number("V", "DC-link voltage below which the turbine trips")
    reserve: float = number("-", "fraction of the voltage limit that steady operation uses")
    chopper_conductance: float = number("S", "conductance of the chopper; 0: none")
    chopper_begin: float = number("V", "DC-link voltage at which the chopper begins to conduct")
    chopper_full: float = number("V", "DC-link voltage at which the duty cycle of the chopper is 1")
    chopper_heat: float = number("J", "heat of the chopper at which the turbine trips")
    chopper_cooling: float = number("1/s", "cooling rate of the chopper")
    current_rate: float = number("rad/s", "bandwidth of the current controls")
    voltage_rate: float = number("rad/s", "natural frequency of the control of the DC link's voltage")
    lock_rate: float = number("rad/s", "natural frequency of the phase-locked loop")
    substep: float = number("s", "longest step of the controls")
    support_gain: float = number("-", "reactive current over rated current, per unit of voltage deviation")
    dead_band: float = number("-", "voltage deviation beyond which the grid is supported")
    zero_time: float = number("s", "duration of zero voltage that is ridden through")
    recovery_time: float = number("s", "time after which the voltage must be back in its band")
    highest_voltage: float = number("-", "voltage above which the turbine trips")
    lowest_frequency: float = number("Hz", "frequency below which the turbine trips")
    highest_frequency: float = number("Hz", "frequency above which the turbine trips")


class ElectricState(Table, title="electric"):
    """States and recorded quantities: powers and torque are means over a time step, the rest is at its end."""

    stator: Phasor = dq("A", "state: stator current, d along the magnets' flux, q leading it, which gives the torque")
    stator_hold: Phasor = dq("V", "state: integral part of its control")
    grid: Phasor = dq("A", "state: grid current, d in phase with the phase-locked loop, q leading by a quarter period")
    grid_hold: Phasor = dq("V", "state: integral part of its control")
    dc_energy: float = number("J", "state: energy of the DC link")
    dc_hold: float = number("W", "state: integral part of the control of its voltage")
    grid_angle: float = number("rad", "state: angle of the grid's voltage in the axes of the phase-locked loop")
    lock_hold: float = number("rad/s", "state: integral part of the phase-locked loop")
    heat: float = number("J", "state: heat in the chopper")
    low_time: float = number("s", "state: time since the grid's voltage left its band")
    trip: float = number("-", "state: number of the protection that has tripped, 0 for none")
    off_time: float = number("s", "state: time since the trip")
    torque: float = number("N m", "torque on the generator's shaft, against its rotation")
    mechanical_power: float = number("W", "mechanical power from the shaft")
    copper_loss: float = number("W", "copper loss of the stator")
    iron_loss: float = number("W", "iron loss of the machine, with stray losses")
    converter_loss: float = number("W", "loss of both converters")
    filter_loss: float = number("W", "loss of the filter")
    chopper_power: float = number("W", "power dissipated in the brake resistor")
    stored_power: float = number("W", "rate of the energy in DC link and inductors")
    grid_power: float = number("W", "active power into the grid")
    reactive_power: float = number("var", "reactive power into the grid")
    dc_link_voltage: float = number("V", "voltage of the DC link")
    stator_voltage: float = number("V", "voltage at the machine's terminals")
    converter_voltage: float = number("V", "voltage of the grid's converter")


TRIPS = (
    "none",
    "overvoltage of the DC link",
    "undervoltage of the DC link",
    "grid voltage low for too long",
    "overvoltage of the grid",
    "frequency of the grid",
    "chopper too hot",
)
"""Protections by their numbers."""

N_STATES = ElectricState.index("heat")
"""States of the linear model: all but the protection's."""


class Electrical(KernelRecord):
    """Electrical system: parameters, states with recorded quantities, and rates of the states."""

    electrical: ElectricalParameters
    electric: ElectricState
    d_electric: ElectricState


def electrical_array(system: ElectricalSystem) -> Float:
    """Parameters for the kernels."""
    p = ElectricalParameters(ElectricalParameters.zeros())
    m, dc, ride, control = system.machine, system.dc_link, system.ride_through, system.control
    p.pole_pairs, p.flux = m.pole_pairs, m.flux
    p.stator_resistance, p.stator_inductance = m.resistance, m.inductance
    p.iron_drag = m.iron_loss / m.rated_speed**2
    for name, converter in (("machine", system.machine_converter), ("grid", system.grid_converter)):
        setattr(p, f"{name}_limit", converter.current)
        setattr(p, f"{name}_standing", converter.standing_loss)
        setattr(p, f"{name}_drop", converter.voltage_drop)
        setattr(p, f"{name}_ohms", converter.resistance)
    p.filter_resistance, p.filter_inductance = system.filter.resistance, system.filter.inductance
    p.grid_peak, p.grid_current = system.grid_peak, system.rated_grid_current
    p.nominal_frequency = 2.0 * math.pi * system.frequency
    p.dc_voltage, p.capacitance, p.reserve = dc.voltage, dc.capacitance, RESERVE
    p.dc_highest, p.dc_lowest = dc.highest * dc.voltage, dc.lowest * dc.voltage
    p.chopper_begin, p.chopper_full, p.chopper_heat = dc.voltage, 2.0 * dc.voltage, np.inf
    if dc.chopper is not None:
        p.chopper_conductance = 1.0 / dc.chopper.resistance
        p.chopper_begin, p.chopper_full = dc.chopper.begin * dc.voltage, dc.chopper.full * dc.voltage
        p.chopper_heat, p.chopper_cooling = dc.chopper.heat, 1.0 / dc.chopper.cooling_time
    for name in ("current", "voltage", "lock"):
        setattr(p, f"{name}_rate", 2.0 * math.pi * getattr(control, f"{name}_bandwidth"))
    p.substep, p.support_gain = control.longest_step, ride.gain
    for name in "dead_band zero_time recovery_time highest_voltage lowest_frequency highest_frequency".split():
        setattr(p, name, getattr(ride, name))
    array: Float = p.array
    return array
