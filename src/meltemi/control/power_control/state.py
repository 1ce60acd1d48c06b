"""The section of the power control in a state vector: settings, states, two loops, then tables of the rotor."""

from __future__ import annotations

from meltemi.control.integrator import IntegratorState
from meltemi.control.power_control.tables import CONDITIONS
from meltemi.maths.tables import Table, number


class PowerControlState(Table, title="power control"):
    """Settings, states and the sizes of tables."""

    filter_frequency: float = number("rad/s", "of the generator speed's low-pass")
    cut_in_speed: float = number("rad/s", "of the generator, below which there is no torque")
    optimal_speed: float = number("rad/s", "where the optimal torque begins")
    rated_speed: float = number("rad/s", "of the torque law")
    synchronous_speed: float = number("rad/s", "at which the line below rated speed has no torque")
    transition_slope: float = number("N m s/rad", "of that line")
    rated_power: float = number("W", "mechanical")
    grid_rating: float = number("W", "electrical, into the grid")
    maximum_torque: float = number("N m", "limit")
    torque_rate: float = number("N m/s", "limit")
    reference_speed: float = number("rad/s", "upper speed of A1 to A3")
    minimum_pitch: float = number("rad", "fine pitch")
    maximum_pitch: float = number("rad", "limit")
    pitch_rate: float = number("rad/s", "limit")
    efficiency: float = number("-", "state: electrical over mechanical power")
    gear_ratio: float = number("-", "generator speed over rotor speed")
    gear_efficiency: float = number("-", "of the gearbox")
    radius: float = number("m", "of the rotor")
    inertia: float = number("kg m^2", "of rotor and generator about the shaft")
    loop_inertia: float = number("kg m^2", "that the pitch gains are made for")
    best_ratio: float = number("-", "tip-speed ratio of the largest power coefficient")
    best_coefficient: float = number("-", "the largest power coefficient")
    tracks_ratio: float = number("-", "1: torque by the tip-speed ratio, 0: by the speed's square")
    air: float = number("-", "density: 0 fixed, 1 temperature, 2 weather")
    assumed_pressure: float = number("Pa", "of the air, with 1")
    scheme: float = number("-", "0 to 3: A0 to A3")
    recovery_margin: float = number("rad/s", "of the generator above the lower speed, where pitch begins to fall")
    reference_rate: float = number("W/s", "mechanical, of the set-point")
    frequency: float = number("rad/s", "of the speed loop")
    damping_ratio: float = number("-", "of the speed loop")
    estimator_gain: float = number("m/rad", "of the wind estimate")
    droop_gain: float = number("W/Hz", "electrical; 0: no droop")
    dead_band: float = number("Hz", "of the frequency")
    nominal_frequency: float = number("Hz", "of the grid")
    reserve: float = number("-", "share of the available power; with droop or reserve")
    inertia_gain: float = number("W s/Hz", "electrical, of synthetic inertia")
    inertia_time: float = number("s", "of the filter of the frequency's rate")
    available_time: float = number("s", "of the filter of the available power")
    speed: float = number("rad/s", "state: filtered generator speed")
    torque: float = number("N m", "state: last torque demand")
    pitch: float = number("rad", "state: last pitch demand")
    slow_pitch: float = number("rad", "state: filtered pitch demand, by which gains are scheduled")
    density: float = number("kg/m^3", "state: of the air, as the law takes it")
    wind: float = number("m/s", "state: wind estimate")
    last_speed: float = number("rad/s", "state: filtered speed of the rotor at the last call")
    heard_torque: float = number("N m", "state: filtered generator torque")
    heard_pitch: float = number("rad", "state: filtered mean pitch")
    available: float = number("W", "state: filtered available power, mechanical")
    slow_frequency: float = number("Hz", "state: filtered frequency of the grid")
    reference: float = number("W", "state: last reference of the operator, electrical")
    setpoint: float = number("W", "state: power that the law follows, mechanical")
    lower: float = number("rad/s", "state: generator speed from which the set-point is met")
    upper: float = number("rad/s", "state: generator speed that the pitch holds")
    recovery: float = number("rad/s", "state: generator speed at which the pitch falls")
    state: float = number("-", "state: number")
    spares: float = number("-", "state: 1 from a held pitch on until the optimal torque is there again (A3)")
    limited: float = number("-", "state: 1 from a limited power on until the speed that tracking holds is reached")
    over: float = number("-", "state: calls with a reference above rated power")
    switches: float = number("-", "state: branches that a difference step would have changed, in derivative runs")
    ratio_first: float = number("-", "first tip-speed ratio of the table")
    ratio_step: float = number("-", "its step")
    ratios: float = number("-", "how many")
    pitch_first: float = number("rad", "first pitch of the tables")
    pitch_step: float = number("rad", "its step")
    pitches: float = number("-", "how many")
    share_first: float = number("-", "first speed share of the table of sensitivities")
    share_step: float = number("-", "its step")
    shares: float = number("-", "how many")


(
    FILTER,
    CUT_IN,
    OPTIMAL,
    RATED,
    SYNCHRONOUS,
    SLOPE,
    RATED_POWER,
    GRID_RATING,
    MAX_TORQUE,
    TORQUE_RATE,
    REFERENCE_SPEED,
    MIN_PITCH,
    MAX_PITCH,
    PITCH_RATE,
    EFFICIENCY,
    GEAR_RATIO,
    GEAR_EFFICIENCY,
    RADIUS,
    INERTIA,
    LOOP_INERTIA,
    BEST_RATIO,
    BEST_COEFFICIENT,
    TRACKS_RATIO,
    AIR,
    ASSUMED_PRESSURE,
    SCHEME,
    RECOVERY_MARGIN,
    REFERENCE_RATE,
    FREQUENCY,
    DAMPING,
    ESTIMATOR_GAIN,
    DROOP_GAIN,
    DEAD_BAND,
    NOMINAL_FREQUENCY,
    RESERVE,
    INERTIA_GAIN,
    INERTIA_TIME,
    AVAILABLE_TIME,
    SPEED,
    TORQUE,
    PITCH,
    SLOW_PITCH,
    DENSITY,
    WIND,
    LAST_SPEED,
    HEARD_TORQUE,
    HEARD_PITCH,
    AVAILABLE,
    SLOW_FREQUENCY,
    REFERENCE,
    SETPOINT,
    LOWER,
    UPPER,
    RECOVERY,
    STATE,
    SPARES,
    LIMITED,
    OVER,
    SWITCHES,
    RATIO_FIRST,
    RATIO_STEP,
    RATIOS,
    PITCH_FIRST,
    PITCH_STEP,
    PITCHES,
    SHARE_FIRST,
    SHARE_STEP,
    SHARES,
) = range(len(PowerControlState))

HOLDS = len(PowerControlState)
"""Conditions of the machine, 1 where one holds."""
PITCH_LOOP = HOLDS + len(CONDITIONS)
TORQUE_LOOP = PITCH_LOOP + len(IntegratorState)
TABLES = TORQUE_LOOP + len(IntegratorState)
"""Power coefficients by ratio and pitch, sensitivities by pitch and share, optimal gains by pitch."""
