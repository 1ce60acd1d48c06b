"""The electrical system over a time step of the turbine, in sub-steps; its rates; and its steady state.

Each sub-step: the machine's current under the torque demand; the grid's current under the control of the DC link;
energies; protection. All powers are exact means over the sub-step, so that energy is conserved to rounding at any
length of it.

Reference: docs/theory/electrical.md (E-1 to E-28).
"""

from __future__ import annotations

from math import pi, sin, sqrt

from meltemi.compiler import kernel, whole
from meltemi.electrical.circuit import circuit, drive, drive_rates, smooth, steady_hold
from meltemi.electrical.control import (
    LEAST_VOLTAGE,
    SQRT_2,
    energy_control,
    grid_reference,
    protection,
    stator_reference,
)
from meltemi.electrical.tables import Electrical, ElectricalParameters
from meltemi.maths.phasors import Phasor, imaginary_product, magnitude, polar, real_product

SQRT_3 = sqrt(3.0)
UNLIMITED = 1e30
"""[V] The terminal voltage of a blocked converter is not limited."""
LEAST_ENERGY = 1e-9
"""Lower limit of the energy of the DC link over C V^2 at its nominal voltage, so that its root has a slope."""
SWEEPS = 30
"""Iterations of the losses in steady operation."""


# powers and energies --------------------------------------------------------------------------------


@kernel
def converter_loss(share: float, square: float, standing: float, drop: float, ohms: float) -> float:
    """[W] loss of a converter (E-16).

    Args:
      share: voltage of the DC link over the nominal one.
      square: [A^2] mean square of the current.
      standing, drop, ohms: [W], [V], [Ohm] parameters of the loss.
    """
    return standing * share * share + drop * sqrt(square) + ohms * square


@kernel
def machine_loss(dc: float, square: float, p: ElectricalParameters) -> float:
    """[W] loss of the machine's converter at the voltage ``dc`` of the DC link."""
    return converter_loss(dc / p.dc_voltage, square, p.machine_standing, p.machine_drop, p.machine_ohms)


@kernel
def grid_loss(dc: float, square: float, p: ElectricalParameters) -> float:
    """[W] loss of the grid's converter at the voltage ``dc`` of the DC link."""
    return converter_loss(dc / p.dc_voltage, square, p.grid_standing, p.grid_drop, p.grid_ohms)


@kernel
def chopper(dc: float, p: ElectricalParameters) -> float:
    """[W] power dissipated in the brake resistor (E-22)."""
    duty = min(max((dc - p.chopper_begin) / (p.chopper_full - p.chopper_begin), 0.0), 1.0)
    return duty * p.chopper_conductance * dc * dc


@kernel
def stored_energy(e: Electrical) -> float:
    """[J] energy in DC link and inductors."""
    p, i, g = e.electrical, e.electric.stator, e.electric.grid
    return e.electric.dc_energy + 0.75 * (
        p.stator_inductance * real_product(i, i) + p.filter_inductance * real_product(g, g)
    )


@kernel
def record_powers(speed: float, voltage: float, e: Electrical) -> None:
    """Record torque, powers and DC link voltage of the states at one instant (E-25)."""
    p, x = e.electrical, e.electric
    i, g, dc = x.stator, x.grid, sqrt(2.0 * x.dc_energy / p.capacitance)
    square, filtered = real_product(i, i), real_product(g, g)
    v = polar(voltage * p.grid_peak, x.grid_angle)
    x.torque = 1.5 * p.pole_pairs * p.flux * i.q + p.iron_drag * speed
    x.mechanical_power = x.torque * speed
    x.copper_loss = 1.5 * p.stator_resistance * square
    x.iron_loss = p.iron_drag * speed * speed
    x.converter_loss = machine_loss(dc, square, p) + grid_loss(dc, filtered, p)
    x.filter_loss = 1.5 * p.filter_resistance * filtered
    x.chopper_power = chopper(dc, p)
    x.grid_power, x.reactive_power = 1.5 * real_product(v, g), 1.5 * imaginary_product(v, g)
    x.dc_link_voltage = dc


# steady operation -----------------------------------------------------------------------------------


@kernel
def electric_begin(
    dt: float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, e: Electrical
) -> None:
    """Bring the electrical system into steady operation.

    The arguments are those of :func:`electric_advance`; ``dt`` is that of the following steps, 0 for the limit of short
    ones.
    """
    p, x = e.electrical, e.electric
    x.grid_angle = x.heat = x.low_time = x.trip = x.off_time = x.stored_power = 0.0
    dc, h = p.dc_voltage, dt / (whole(dt / p.substep) + 1)
    x.dc_energy = 0.5 * p.capacitance * dc * dc
    # the machine side
    R, L, w = p.stator_resistance, p.stator_inductance, p.pole_pairs * speed
    i = stator_reference(torque - p.iron_drag * speed, w, dc / SQRT_3, p)
    y = Phasor(0.0, -w * p.flux) + Phasor(R, w * L) * i
    incoming = -1.5 * real_product(y, i) - machine_loss(dc, real_product(i, i), p)
    x.stator, x.stator_hold = i, steady_hold(R, L, w, p.current_rate, h, i, y)
    x.stator_voltage = magnitude(y)
    # the grid side delivers the incoming power less its losses
    R, L, w = p.filter_resistance, p.filter_inductance, 2.0 * pi * frequency
    peak = max(voltage, LEAST_VOLTAGE) * p.grid_peak
    g = Phasor(0.0, 0.0)
    for _ in range(SWEEPS):
        square = real_product(g, g)
        lost = grid_loss(dc, square, p) + 1.5 * R * square
        g = grid_reference((incoming - lost) / (1.5 * peak), reactive, voltage, p)
    y = Phasor(voltage * p.grid_peak, 0.0) + Phasor(R, w * L) * g
    x.grid, x.grid_hold = g, steady_hold(R, L, w, p.current_rate, h, g, y)
    x.dc_hold = 1.5 * peak * g.d - incoming
    x.lock_hold = w - p.nominal_frequency
    x.converter_voltage = magnitude(y)
    record_powers(speed, voltage, e)


# rates ----------------------------------------------------------------------------------------------


@kernel
def electric_rates(
    torque: float, reactive: float, speed: float, voltage: float, frequency: float, e: Electrical
) -> None:
    """Rates of the states in the limit of short steps, and the recorded powers at this instant (E-26).

    The arguments are those of :func:`electric_advance`.
    """
    p, x, rates = e.electrical, e.electric, e.d_electric
    record_powers(speed, voltage, e)
    dc = x.dc_link_voltage
    most = dc / SQRT_3
    # the machine side
    w = p.pole_pairs * speed
    machine = smooth(p.stator_resistance, p.stator_inductance, w, p.current_rate)
    wanted = stator_reference(torque - p.iron_drag * speed, w, most, p)
    m = drive_rates(machine, x.stator, x.stator_hold, wanted, Phasor(0.0, -w * p.flux), most)
    incoming = -1.5 * real_product(m.voltage, x.stator) - machine_loss(dc, real_product(x.stator, x.stator), p)
    rates.stator, rates.stator_hold = m.current, m.hold
    # the grid side, in axes that rotate with the phase-locked loop
    control = energy_control(incoming, x.dc_energy, x.dc_hold, reactive, voltage, p)
    lock, s = p.lock_rate if voltage > LEAST_VOLTAGE else 0.0, sin(x.grid_angle)
    w = p.nominal_frequency + x.lock_hold + SQRT_2 * lock * s
    grid = smooth(p.filter_resistance, p.filter_inductance, w, p.current_rate)
    source = polar(voltage * p.grid_peak, x.grid_angle)
    o = drive_rates(grid, x.grid, x.grid_hold, control.current, source, most)
    lost = grid_loss(dc, real_product(x.grid, x.grid), p)
    rates.grid, rates.grid_hold = o.current, o.hold
    rates.dc_energy = incoming - 1.5 * real_product(o.voltage, x.grid) - lost - chopper(dc, p)
    rates.dc_hold = control.rate
    rates.lock_hold = lock * lock * s
    rates.grid_angle = 2.0 * pi * frequency - w
    x.stator_voltage, x.converter_voltage = magnitude(m.voltage), magnitude(o.voltage)


# time steps -----------------------------------------------------------------------------------------


@kernel
def locked_speed(h: float, voltage: float, frequency: float, e: Electrical) -> float:
    """[rad/s] Speed of the axes of the grid side over a sub-step of the phase-locked loop (E-21)."""
    p, x = e.electrical, e.electric
    lock, s = p.lock_rate if voltage > LEAST_VOLTAGE else 0.0, sin(x.grid_angle)
    x.lock_hold += h * lock * lock * s
    w = p.nominal_frequency + x.lock_hold + SQRT_2 * lock * s
    x.grid_angle += h * (2.0 * pi * frequency - w)
    return w


@kernel
def electric_advance(
    dt: float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, e: Electrical
) -> None:
    """Advance the electrical system by ``dt`` with constant inputs.

    Afterwards ``e.electric.torque`` is the mean torque on the shaft and ``e.electric.grid_power`` the mean power into
    the grid.

    Args:
      dt: [s].
      torque: [N m] demanded, on the generator's shaft.
      reactive: [var] demanded, delivered to the grid.
      speed: [rad/s] speed of the generator's shaft.
      voltage: [per unit] voltage of the grid.
      frequency: [Hz] frequency of the grid.
      e: parameters, states and recorded quantities.
    """
    # one function, 83 lines: both sides share the link within a substep, and parts would exchange a dozen numbers
    p, x = e.electrical, e.electric
    n = whole(dt / p.substep) + 1
    h, part = dt / n, 1.0 / n
    w = p.pole_pairs * speed
    machine = circuit(p.stator_resistance, p.stator_inductance, w, p.current_rate, h)
    force = Phasor(0.0, -w * p.flux)
    least = LEAST_ENERGY * p.capacitance * p.dc_voltage * p.dc_voltage
    before = stored_energy(e)
    x.torque = x.copper_loss = x.converter_loss = x.filter_loss = x.chopper_power = 0.0
    x.grid_power = x.reactive_power = 0.0
    for _ in range(n):
        blocked = x.trip > 0.0
        dc = sqrt(2.0 * x.dc_energy / p.capacitance)
        most = UNLIMITED if blocked else dc / SQRT_3
        # the machine side
        i, i_hold = x.stator, x.stator_hold
        wanted = stator_reference(torque - p.iron_drag * speed, w, dc / SQRT_3, p)
        if blocked:  # the present current decays, whatever the source does
            wanted, i_hold = i, force
        m = drive(machine, i, i_hold, wanted, force, most)
        incoming = -1.5 * real_product(m.voltage, m.mean) - machine_loss(dc, m.square, p)
        # the grid side, in axes that rotate with the phase-locked loop
        g, g_hold = x.grid, x.grid_hold
        source = polar(voltage * p.grid_peak, x.grid_angle)
        control = energy_control(incoming, x.dc_energy, x.dc_hold, reactive, voltage, p)
        ordered = control.current
        if blocked:
            ordered, g_hold = g, source
        else:
            x.dc_hold += h * control.rate
        turning = locked_speed(h, voltage, frequency, e)
        grid = circuit(p.filter_resistance, p.filter_inductance, turning, p.current_rate, h)
        o = drive(grid, g, g_hold, ordered, source, most)
        # energies
        left = x.dc_energy - 1.5 * h * (real_product(m.voltage, m.mean) + real_product(o.voltage, o.mean))
        if left < least:  # an empty link drives no current: both sides are short-circuited
            m = drive(machine, i, i_hold, wanted, force, 0.0)
            o = drive(grid, g, g_hold, ordered, source, 0.0)
            left = x.dc_energy
        x.stator, x.stator_hold, x.grid, x.grid_hold = m.current, m.hold, o.current, o.hold
        lost, burnt = machine_loss(dc, m.square, p) + grid_loss(dc, o.square, p), chopper(dc, p)
        if h * (lost + burnt) > left - least:  # losses never exceed the available energy
            share = (left - least) / (h * (lost + burnt))
            lost, burnt = share * lost, share * burnt
        x.dc_energy = max(left - h * (lost + burnt), least)
        # protection
        x.heat += h * (burnt - p.chopper_cooling * x.heat)
        x.low_time = x.low_time + h if voltage < 1.0 - p.dead_band else 0.0
        if blocked:
            x.off_time += h
        else:
            dc = sqrt(2.0 * x.dc_energy / p.capacitance)
            x.trip = protection(dc, voltage, frequency, x.low_time, x.heat, p)
        # means
        x.torque += part * (1.5 * p.pole_pairs * p.flux * m.mean.q + p.iron_drag * speed)
        x.copper_loss += part * 1.5 * p.stator_resistance * m.square
        x.converter_loss += part * lost
        x.filter_loss += part * 1.5 * p.filter_resistance * o.square
        x.chopper_power += part * burnt
        x.grid_power += part * 1.5 * real_product(source, o.mean)
        x.reactive_power += part * 1.5 * imaginary_product(source, o.mean)
        x.stator_voltage, x.converter_voltage = magnitude(m.voltage), magnitude(o.voltage)
    x.mechanical_power, x.iron_loss = x.torque * speed, p.iron_drag * speed * speed
    x.stored_power = (stored_energy(e) - before) / dt
    x.dc_link_voltage = sqrt(2.0 * x.dc_energy / p.capacitance)
