"""The electrical system over a time step of the turbine, in sub-steps of its own; its rates; and its steady state.

Each sub-step: the machine's current under the torque; the grid's current under the control of the DC link; energies;
protection. All powers are exact means over the sub-step, so that energy is kept to rounding at any length of it.

Reference: docs/theory/electrical.md (E-1 to E-28).
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import NamedTuple

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.electrical.circuit import (
    Phasor,
    ahead,
    along,
    circuit,
    drive,
    limited,
    minus,
    plus,
    scaled,
    smooth,
    times,
)
from meltemi.electrical.control import (
    BAND,
    FLUX,
    GRID_PEAK,
    LEAST_VOLTAGE,
    POLE_PAIRS,
    STATOR_L,
    STATOR_R,
    grid_reference,
    protection,
    stator_reference,
)
from meltemi.electrical.tables import ElectricalParameters, ElectricState
from meltemi.maths.generic import whole, zero

Float = NDArray[float64]

ON, IRON, FILTER_R, FILTER_L, NOMINAL, DC_VOLTAGE, CAPACITANCE = ElectricalParameters.slots(
    "on iron_drag filter_resistance filter_inductance nominal_frequency dc_voltage capacitance"
)
CONDUCTANCE, BEGIN, FULL, COOLING, CURRENT_RATE, VOLTAGE_RATE, LOCK_RATE, SUBSTEP = ElectricalParameters.slots(
    "chopper_conductance chopper_begin chopper_full chopper_cooling current_rate voltage_rate lock_rate substep"
)
MACHINE, GRID = ElectricalParameters.slots("machine_standing grid_standing")
STATOR, STATOR_HOLD, GRID_I, GRID_HOLD, ENERGY, DC_HOLD, ANGLE, LOCK_HOLD = ElectricState.slots(
    "stator_d stator_hold_d grid_d grid_hold_d dc_energy dc_hold grid_angle lock_hold"
)
HEAT, LOW_TIME, TRIP, OFF_TIME, TORQUE, MECHANICAL, COPPER, IRON_LOSS, CONVERTER, FILTER, CHOPPER, STORED = (
    ElectricState.slots(
        "heat low_time trip off_time torque mechanical_power copper_loss iron_loss converter_loss filter_loss "
        "chopper_power stored_power"
    )
)
GRID_POWER, REACTIVE, DC_LINK, STATOR_VOLTAGE, CONVERTER_VOLTAGE = ElectricState.slots(
    "grid_power reactive_power dc_link_voltage stator_voltage converter_voltage"
)
SQRT_2, SQRT_3 = sqrt(2.0), sqrt(3.0)
UNLIMITED = 1e30
"""[V] a converter that is cut off has whatever voltage its terminals have."""
LEAST_ENERGY = 1e-9
"""Of the DC link, over C V^2 of its nominal voltage: nothing is taken below, so that its root has a slope."""
SWEEPS = 30
"""Of the losses in steady operation."""


class Wanted(NamedTuple):
    """References of the grid's current, and the rate of the control's integral part."""

    current: Phasor
    rate: float


@kernel
def two(x: Float, row: int) -> Phasor:
    """Two rows that are one."""
    return Phasor(x[row], x[row + 1])


@kernel
def store(x: Float, row: int, a: Phasor) -> None:
    """The opposite of :func:`two`."""
    x[row], x[row + 1] = a.d, a.q


@kernel
def converter_loss(p: Float, first: int, dc: float, square: float) -> float:
    """[W] of the converter whose parameters begin at ``first``, from the mean square of its current (E-16)."""
    part = dc / p[DC_VOLTAGE]
    return p[first] * part * part + p[first + 1] * sqrt(square) + p[first + 2] * square


@kernel
def chopper(p: Float, dc: float) -> float:
    """[W] burnt in the brake resistor (E-22)."""
    duty = min(max((dc - p[BEGIN]) / (p[FULL] - p[BEGIN]), 0.0), 1.0)
    return duty * p[CONDUCTANCE] * dc * dc


@kernel
def energy_control(p: Float, incoming: float, energy: float, hold: float, reactive: float, share: float) -> Wanted:
    """References of the grid's side, which holds the energy of the DC link (E-17 to E-20).

    Args:
      incoming: [W] from the machine's side.
      energy: [J] in the DC link.
      hold: [W] integral part.
      reactive, share: as in :func:`grid_reference`.
    """
    w = p[VOLTAGE_RATE]
    error = energy - 0.5 * p[CAPACITANCE] * p[DC_VOLTAGE] * p[DC_VOLTAGE]
    power = incoming + SQRT_2 * w * error + hold
    active = power / (1.5 * max(share, LEAST_VOLTAGE) * p[GRID_PEAK])
    current = grid_reference(p, active, reactive, share)
    # at the limit the integral part waits
    held = (active > current.d and error > 0.0) or (active < current.d and error < 0.0)
    return Wanted(current, 0.0 * error if held else w * w * error)


@kernel
def electric_begin_(
    p: Float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, electric: Float, dt: float
) -> None:
    """Steady operation; the arguments are those of :func:`electric_advance`, ``dt`` is that of the steps to come, or 0
    for the limit of short ones."""
    for row in range(electric.shape[0]):
        electric[row] = zero(electric)
    n = whole(dt / p[SUBSTEP]) + 1
    w = p[POLE_PAIRS] * speed
    electric[ENERGY] = 0.5 * p[CAPACITANCE] * p[DC_VOLTAGE] * p[DC_VOLTAGE]
    i = stator_reference(p, torque - p[IRON] * speed, w, p[DC_VOLTAGE] / SQRT_3)
    y = plus(Phasor(0.0 * w, -w * p[FLUX]), times(Phasor(p[STATOR_R], w * p[STATOR_L]), i))
    incoming = -1.5 * along(y, i) - converter_loss(p, MACHINE, p[DC_VOLTAGE], along(i, i))
    store(electric, STATOR, i)
    electric[STATOR_VOLTAGE] = sqrt(along(y, y))
    cross = smooth(p[STATOR_R], p[STATOR_L], w, p[CURRENT_RATE])[1]
    if dt > 0.0:
        cross = circuit(p[STATOR_R], p[STATOR_L], w, p[CURRENT_RATE], dt / n).cross
    store(electric, STATOR_HOLD, minus(y, times(cross, i)))
    # the grid's side takes what its own losses leave
    w = 2.0 * pi * frequency
    peak = max(voltage, LEAST_VOLTAGE) * p[GRID_PEAK]
    g = Phasor(0.0 * peak, 0.0 * peak)
    for _ in range(SWEEPS):
        square = along(g, g)
        lost = converter_loss(p, GRID, p[DC_VOLTAGE], square) + 1.5 * p[FILTER_R] * square
        g = grid_reference(p, (incoming - lost) / (1.5 * peak), reactive, voltage)
    y = plus(Phasor(voltage * p[GRID_PEAK], 0.0 * peak), times(Phasor(p[FILTER_R], w * p[FILTER_L]), g))
    store(electric, GRID_I, g)
    cross = smooth(p[FILTER_R], p[FILTER_L], w, p[CURRENT_RATE])[1]
    if dt > 0.0:
        cross = circuit(p[FILTER_R], p[FILTER_L], w, p[CURRENT_RATE], dt / n).cross
    store(electric, GRID_HOLD, minus(y, times(cross, g)))
    electric[DC_HOLD] = 1.5 * peak * g.d - incoming
    electric[LOCK_HOLD] = w - p[NOMINAL]
    electric[CONVERTER_VOLTAGE] = sqrt(along(y, y))
    present(p, speed, voltage, electric)


@kernel
def present(p: Float, speed: float, voltage: float, electric: Float) -> None:
    """What is recorded, but the rate of the stored energy and the voltages, from the states at one instant (E-25)."""
    i, g, dc = two(electric, STATOR), two(electric, GRID_I), sqrt(2.0 * electric[ENERGY] / p[CAPACITANCE])
    torque = 1.5 * p[POLE_PAIRS] * p[FLUX] * i.q + p[IRON] * speed
    square, filtered = along(i, i), along(g, g)
    peak = voltage * p[GRID_PEAK]
    v = Phasor(peak * cos(electric[ANGLE]), peak * sin(electric[ANGLE]))
    electric[TORQUE], electric[MECHANICAL] = torque, torque * speed
    electric[COPPER], electric[IRON_LOSS] = 1.5 * p[STATOR_R] * square, p[IRON] * speed * speed
    electric[CONVERTER] = converter_loss(p, MACHINE, dc, square) + converter_loss(p, GRID, dc, filtered)
    electric[FILTER], electric[CHOPPER] = 1.5 * p[FILTER_R] * filtered, chopper(p, dc)
    electric[GRID_POWER], electric[REACTIVE], electric[DC_LINK] = 1.5 * along(v, g), 1.5 * ahead(v, g), dc


@kernel
def electric_rates_(
    p: Float,
    torque: float,
    reactive: float,
    speed: float,
    voltage: float,
    frequency: float,
    electric: Float,
    rates: Float,
) -> None:
    """Rates of the states in the limit of short steps, and what is recorded at this instant (E-26).

    Args:
      rates: (rows,) get the rates of the states.
    """
    present(p, speed, voltage, electric)
    i, hold, energy = two(electric, STATOR), two(electric, STATOR_HOLD), electric[ENERGY]
    dc = electric[DC_LINK]
    most, rate, w = dc / SQRT_3, p[CURRENT_RATE], p[POLE_PAIRS] * speed
    wanted = stator_reference(p, torque - p[IRON] * speed, w, most)
    lead, cross = smooth(p[STATOR_R], p[STATOR_L], w, rate)
    inner = times(cross, i)
    y = limited(plus(plus(scaled(lead, minus(wanted, i)), hold), inner), most)
    drop = plus(Phasor(0.0 * w, -w * p[FLUX]), times(Phasor(p[STATOR_R], w * p[STATOR_L]), i))
    store(rates, STATOR, scaled(1.0 / p[STATOR_L], minus(y, drop)))
    store(rates, STATOR_HOLD, scaled(rate, minus(minus(y, inner), hold)))
    electric[STATOR_VOLTAGE] = sqrt(along(y, y))
    incoming = -1.5 * along(y, i) - converter_loss(p, MACHINE, dc, along(i, i))
    aim = energy_control(p, incoming, energy, electric[DC_HOLD], reactive, voltage)
    g, hold = two(electric, GRID_I), two(electric, GRID_HOLD)
    lock, s = p[LOCK_RATE] if voltage > LEAST_VOLTAGE else 0.0 * p[LOCK_RATE], sin(electric[ANGLE])
    w = p[NOMINAL] + electric[LOCK_HOLD] + SQRT_2 * lock * s
    lead, cross = smooth(p[FILTER_R], p[FILTER_L], w, rate)
    inner = times(cross, g)
    y = limited(plus(plus(scaled(lead, minus(aim.current, g)), hold), inner), most)
    peak = voltage * p[GRID_PEAK]
    source = Phasor(peak * cos(electric[ANGLE]), peak * s)
    drop = plus(source, times(Phasor(p[FILTER_R], w * p[FILTER_L]), g))
    store(rates, GRID_I, scaled(1.0 / p[FILTER_L], minus(y, drop)))
    store(rates, GRID_HOLD, scaled(rate, minus(minus(y, inner), hold)))
    electric[CONVERTER_VOLTAGE] = sqrt(along(y, y))
    rates[ENERGY] = incoming - 1.5 * along(y, g) - converter_loss(p, GRID, dc, along(g, g)) - chopper(p, dc)
    rates[DC_HOLD] = aim.rate
    rates[LOCK_HOLD] = lock * lock * s
    rates[ANGLE] = 2.0 * pi * frequency - w


@kernel
def electric_advance_(
    p: Float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, electric: Float, dt: float
) -> None:
    """March the electrical system by ``dt``, everything else held.

    Afterwards ``electric[TORQUE]`` is the mean torque on the shaft and ``electric[GRID_POWER]`` the mean power into
    the grid.

    Args:
      p: (rows,) parameters, table ELECTRICAL.
      torque: [N m] demanded, on the generator's shaft.
      reactive: [var] demanded, delivered to the grid.
      speed: [rad/s] of the generator's shaft.
      voltage: of the grid, share of the nominal one.
      frequency: [Hz] of the grid.
      electric: (rows,) states and what is recorded, table ELECTRIC.
      dt: [s].
    """
    n = whole(dt / p[SUBSTEP]) + 1
    h, part = dt / n, 1.0 / n
    w, rate = p[POLE_PAIRS] * speed, p[CURRENT_RATE]
    stator = circuit(p[STATOR_R], p[STATOR_L], w, rate, h)
    force = Phasor(0.0 * w, -w * p[FLUX])
    i, i_hold = two(electric, STATOR), two(electric, STATOR_HOLD)
    g, g_hold = two(electric, GRID_I), two(electric, GRID_HOLD)
    energy, dc_hold, angle, lock_hold = electric[ENERGY], electric[DC_HOLD], electric[ANGLE], electric[LOCK_HOLD]
    heat, low_time, trip = electric[HEAT], electric[LOW_TIME], electric[TRIP]
    before = energy + 0.75 * (p[STATOR_L] * along(i, i) + p[FILTER_L] * along(g, g))
    for row in range(TORQUE, electric.shape[0]):
        electric[row] = zero(electric)
    peak = voltage * p[GRID_PEAK]
    lock = p[LOCK_RATE] if voltage > LEAST_VOLTAGE else 0.0 * p[LOCK_RATE]
    floor = LEAST_ENERGY * p[CAPACITANCE] * p[DC_VOLTAGE] * p[DC_VOLTAGE]
    for _ in range(n):
        dc = sqrt(2.0 * energy / p[CAPACITANCE])
        on = 1.0 if trip == 0.0 else 0.0
        most = dc / SQRT_3 if trip == 0.0 else UNLIMITED + 0.0 * dc
        # the machine's side
        wanted = stator_reference(p, torque - p[IRON] * speed, w, dc / SQRT_3)
        if trip > 0.0:  # cut off: the current that there is fades, whatever the source does
            wanted, i_hold = i, force
        m = drive(stator, i, i_hold, wanted, force, most)
        incoming = -1.5 * along(m.voltage, m.mean) - converter_loss(p, MACHINE, dc, m.square)
        # the grid's side, in axes that turn with the phase-locked loop
        s = sin(angle)
        source = Phasor(peak * cos(angle), peak * s)
        lock_hold += h * lock * lock * s
        turning = p[NOMINAL] + lock_hold + SQRT_2 * lock * s
        grid = circuit(p[FILTER_R], p[FILTER_L], turning, rate, h)
        aim = energy_control(p, incoming, energy, dc_hold, reactive, voltage)
        ordered = aim.current
        if trip > 0.0:
            ordered, g_hold = g, source
        o = drive(grid, g, g_hold, ordered, source, most)
        dc_hold += on * h * aim.rate
        angle += h * (2.0 * pi * frequency - turning)
        # energies
        left = energy - 1.5 * h * (along(m.voltage, m.mean) + along(o.voltage, o.mean))
        if left < floor:  # an empty link drives no current: both sides are short-circuited
            m = drive(stator, i, i_hold, wanted, force, 0.0 * most)
            o = drive(grid, g, g_hold, ordered, source, 0.0 * most)
            left = energy + 0.0 * left
        i, i_hold, g, g_hold = m.current, m.hold, o.current, o.hold
        lost = converter_loss(p, MACHINE, dc, m.square) + converter_loss(p, GRID, dc, o.square)
        burnt = chopper(p, dc)
        if h * (lost + burnt) > left - floor:  # no more is lost than there is
            there = (left - floor) / (h * (lost + burnt))
            lost, burnt = there * lost, there * burnt
        energy = max(left - h * (lost + burnt), floor)
        heat += h * (burnt - p[COOLING] * heat)
        low_time = low_time + h if voltage < 1.0 - p[BAND] else 0.0 * low_time
        if trip > 0.0:
            electric[OFF_TIME] += h
        else:
            trip += protection(p, sqrt(2.0 * energy / p[CAPACITANCE]), voltage, frequency, low_time, heat)
        electric[TORQUE] += part * (1.5 * p[POLE_PAIRS] * p[FLUX] * m.mean.q + p[IRON] * speed)
        electric[COPPER] += part * 1.5 * p[STATOR_R] * m.square
        electric[CONVERTER] += part * lost
        electric[FILTER] += part * 1.5 * p[FILTER_R] * o.square
        electric[CHOPPER] += part * burnt
        electric[GRID_POWER] += part * 1.5 * along(source, o.mean)
        electric[REACTIVE] += part * 1.5 * ahead(source, o.mean)
        electric[STATOR_VOLTAGE] = sqrt(along(m.voltage, m.voltage))
        electric[CONVERTER_VOLTAGE] = sqrt(along(o.voltage, o.voltage))
    electric[MECHANICAL], electric[IRON_LOSS] = electric[TORQUE] * speed, p[IRON] * speed * speed
    after = energy + 0.75 * (p[STATOR_L] * along(i, i) + p[FILTER_L] * along(g, g))
    electric[STORED] = (after - before) / dt
    electric[DC_LINK] = sqrt(2.0 * energy / p[CAPACITANCE])
    store(electric, STATOR, i)
    store(electric, STATOR_HOLD, i_hold)
    store(electric, GRID_I, g)
    store(electric, GRID_HOLD, g_hold)
    electric[ENERGY], electric[DC_HOLD], electric[ANGLE], electric[LOCK_HOLD] = energy, dc_hold, angle, lock_hold
    electric[HEAT], electric[LOW_TIME], electric[TRIP] = heat, low_time, trip


@kernel
def electric_begin(dt, torque, reactive, speed, voltage, frequency, e):
    electric_begin_(e.electrical.array, torque, reactive, speed, voltage, frequency, e.electric.array, dt)


@kernel
def electric_advance(dt, torque, reactive, speed, voltage, frequency, e):
    electric_advance_(e.electrical.array, torque, reactive, speed, voltage, frequency, e.electric.array, dt)


@kernel
def electric_rates(torque, reactive, speed, voltage, frequency, e):
    electric_rates_(
        e.electrical.array, torque, reactive, speed, voltage, frequency, e.electric.array, e.d_electric.array
    )
