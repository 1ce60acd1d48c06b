"""The section of the power control in a state vector: settings, states, two loops, then tables of the rotor."""

from __future__ import annotations

from meltemi.control.integrator import INTEGRATOR
from meltemi.control.power_control.tables import CONDITIONS
from meltemi.maths.tables import table

POWER = table(
    "power control",
    "",
    """
    filter_frequency   | rad/s       | of the generator speed's low-pass
    cut_in_speed       | rad/s       | of the generator, below which there is no torque
    optimal_speed      | rad/s       | where the optimal torque begins
    rated_speed        | rad/s       | of the torque law
    synchronous_speed  | rad/s       | at which the line below rated speed has no torque
    transition_slope   | N m s/rad   | of that line
    rated_power        | W           | mechanical
    grid_rating        | W           | electrical, into the grid
    maximum_torque     | N m         | limit
    torque_rate        | N m/s       | limit
    reference_speed    | rad/s       | upper speed of A1 to A3
    minimum_pitch      | rad         | fine pitch
    maximum_pitch      | rad         | limit
    pitch_rate         | rad/s       | limit
    efficiency         | -           | state: electrical over mechanical power
    gear_ratio         | -           | generator speed over rotor speed
    gear_efficiency    | -           | of the gearbox
    radius             | m           | of the rotor
    inertia            | kg m^2      | of rotor and generator about the shaft
    loop_inertia       | kg m^2      | that the pitch gains are made for
    best_ratio         | -           | tip-speed ratio of the largest power coefficient
    best_coefficient   | -           | the largest power coefficient
    tracks_ratio       | -           | 1: torque by the tip-speed ratio, 0: by the speed's square
    air                | -           | density: 0 fixed, 1 temperature, 2 weather
    assumed_pressure   | Pa          | of the air, with 1
    scheme             | -           | 0 to 3: A0 to A3
    recovery_margin    | rad/s       | of the generator above the lower speed, where pitch begins to fall
    reference_rate     | W/s         | mechanical, of the set-point
    frequency          | rad/s       | of the speed loop
    damping_ratio      | -           | of the speed loop
    estimator_gain     | m/rad       | of the wind estimate
    droop_gain         | W/Hz        | electrical; 0: no droop
    dead_band          | Hz          | of the frequency
    nominal_frequency  | Hz          | of the grid
    reserve            | -           | share of the available power; with droop or reserve
    inertia_gain       | W s/Hz      | electrical, of synthetic inertia
    inertia_time       | s           | of the filter of the frequency's rate
    available_time     | s           | of the filter of the available power
    speed              | rad/s       | state: filtered generator speed
    torque             | N m         | state: last torque demand
    pitch              | rad         | state: last pitch demand
    slow_pitch         | rad         | state: filtered pitch demand, by which gains are scheduled
    density            | kg/m^3      | state: of the air, as the law takes it
    wind               | m/s         | state: wind estimate
    last_speed         | rad/s       | state: filtered speed of the rotor at the last call
    heard_torque       | N m         | state: filtered generator torque
    heard_pitch        | rad         | state: filtered mean pitch
    available          | W           | state: filtered available power, mechanical
    slow_frequency     | Hz          | state: filtered frequency of the grid
    reference          | W           | state: last reference of the operator, electrical
    setpoint           | W           | state: power that the law follows, mechanical
    lower              | rad/s       | state: generator speed from which the set-point is met
    upper              | rad/s       | state: generator speed that the pitch holds
    recovery           | rad/s       | state: generator speed at which the pitch falls
    state              | -           | state: number
    spares             | -           | state: 1 from a held pitch on until the optimal torque is there again (A3)
    limited            | -           | state: 1 from a limited power on until the speed that tracking holds is reached
    over               | -           | state: calls with a reference above rated power
    switches           | -           | state: branches that a difference step would have changed, in derivative runs
    ratio_first        | -           | first tip-speed ratio of the table
    ratio_step         | -           | its step
    ratios             | -           | how many
    pitch_first        | rad         | first pitch of the tables
    pitch_step         | rad         | its step
    pitches            | -           | how many
    share_first        | -           | first speed share of the table of sensitivities
    share_step         | -           | its step
    shares             | -           | how many
    """,
)
"""Settings, states and the sizes of tables."""

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
) = range(len(POWER))

HOLDS = len(POWER)
"""Conditions of the machine, 1 where one holds."""
PITCH_LOOP = HOLDS + len(CONDITIONS)
TORQUE_LOOP = PITCH_LOOP + len(INTEGRATOR)
TABLES = TORQUE_LOOP + len(INTEGRATOR)
"""Power coefficients by ratio and pitch, sensitivities by pitch and share, optimal gains by pitch."""
