"""Input and output of controllers: measurements and demands, by name.

A controller is a function ``update(state, measurements, demands, dt)`` that changes ``state`` and
``demands`` in place, in plain Python or compiled::

    def update(state, measurements, demands, dt):
        demands.generator_torque = 2.33 * measurements.generator_speed ** 2
        for blade in range(3):
            demands.pitch[blade] = 0.0

Entries by number are supported, too: the constants of this module are their places.
"""

from __future__ import annotations

from meltemi.compiler import Numbers, Table, Vec, blades, flaps, number, xyz


class Measurements(Table):
    """Measurements of the turbine's sensors at an instant; loads are those of the previous time step."""

    time: float = number("s", "simulation time")
    generator_speed: float = number("rad/s", "generator speed")
    rotor_speed: float = number("rad/s", "rotor speed, at the rotor end of the shaft")
    azimuth: float = number("rad", "azimuth angle of blade 1, 0 when it points up, clockwise looking downwind")
    torque: float = number("N m", "generator torque")
    power: float = number("W", "electrical power")
    pitch: Numbers = blades("rad", "pitch angle of each blade")
    out_of_plane_moment: Numbers = blades("N m", "root bending moment of each blade, out of the rotor plane (RootMyc)")
    in_plane_moment: Numbers = blades("N m", "root bending moment of each blade, in the rotor plane (RootMxc)")
    yaw: float = number("rad", "yaw angle of the nacelle, counter-clockwise from above")
    yaw_rate: float = number("rad/s", "yaw rate, counter-clockwise from above")
    wind_speed: float = number("m/s", "horizontal wind speed at the hub, undisturbed")
    wind_direction: float = number("rad", "wind direction at the hub, clockwise from above")
    fore_aft_acceleration: float = number("m/s^2", "acceleration of the tower top, downwind")
    side_side_acceleration: float = number("m/s^2", "acceleration of the tower top, to the left looking downwind")
    flap: Numbers = flaps("rad", "deflection of flap i of each blade, one flap behind the other")
    rotor_power: float = number("W", "mechanical power of the low-speed shaft")
    hub_moment: Vec = xyz("N m", "moment of the rotor on the shaft at its apex, shaft axes (not rotating)")
    yaw_bearing_moment: Vec = xyz("N m", "moment of the nacelle on the tower, tower-top axes (not yawing)")
    nacelle_turning: Vec = xyz("rad/s^2", "angular acceleration of the nacelle, shaft axes (not rotating)")
    air_temperature: float = number("K", "temperature of the air")
    humidity: float = number("-", "relative humidity of the air")
    air_pressure: float = number("Pa", "pressure of the air")
    grid_voltage: float = number("-", "voltage at the terminals over the nominal voltage")
    grid_frequency: float = number("Hz", "frequency of the grid")
    grid: float = number("-", "1 while there is a grid that takes power, 0 while there is none")
    request: float = number("-", "last operator request, its number in REQUESTS")
    power_limit: float = number("W", "limit of the electrical power by the operator; infinite without one")
    power_reference: float = number("W", "electrical power requested by the operator; rated power without a request")
    n_blades: float = number("-", "number of blades")
    callback: float = number("-", "internal: address of a controller in plain Python")


TIME, GENERATOR_SPEED, ROTOR_SPEED, AZIMUTH = Measurements.slots("time generator_speed rotor_speed azimuth")
TORQUE, POWER, PITCH, YAW, YAW_RATE = Measurements.slots("torque power pitch yaw yaw_rate")
OUT_OF_PLANE_MOMENT, IN_PLANE_MOMENT = Measurements.slots("out_of_plane_moment in_plane_moment")
WIND_SPEED, WIND_DIRECTION, NACELLE_TURNING = Measurements.slots("wind_speed wind_direction nacelle_turning")
FORE_AFT_ACCELERATION, SIDE_SIDE_ACCELERATION = Measurements.slots("fore_aft_acceleration side_side_acceleration")
FLAP, ROTOR_POWER, HUB_MOMENT, YAW_BEARING_MOMENT = Measurements.slots("flap rotor_power hub_moment yaw_bearing_moment")
AIR_TEMPERATURE, HUMIDITY, AIR_PRESSURE = Measurements.slots("air_temperature humidity air_pressure")
GRID_VOLTAGE, GRID_FREQUENCY, GRID, REQUEST = Measurements.slots("grid_voltage grid_frequency grid request")
POWER_LIMIT, POWER_REFERENCE = Measurements.slots("power_limit power_reference")
N_BLADES, CALLBACK = Measurements.slots("n_blades callback")

REQUESTS = ("none", "start", "normal_stop", "emergency_stop")
"""Operator requests; their numbers are their places."""


class Demands(Table):
    """Demands of a controller, which keep their values until they are changed.

    The last six are reports of the controller, which are recorded and have no effect.
    """

    generator_torque: float = number("N m", "torque on the generator's shaft")
    pitch: Numbers = blades("rad", "pitch angle of each blade")
    brake: float = number("-", "share of the full brake torque")
    yaw_rate: float = number("rad/s", "demanded rate of the yaw drive, counter-clockwise from above")
    flap: Numbers = flaps("rad", "deflection of flap i of each blade, trailing edge towards the pressure side")
    reactive_power: float = number("var", "delivered to the grid, by turbines with converters")
    operating_state: float = number("-", "report: number of the supervisor's state")
    power_setpoint: float = number("W", "report: electrical power that is not to be exceeded")
    yaw_error: float = number(
        "rad", "report: as the yaw control sees it, wind direction minus nacelle direction, clockwise"
    )
    yaw_threshold: float = number("rad", "report: its limit at present")
    power_state: float = number("-", "report: number of the power control's state")
    wind_estimate: float = number("m/s", "report: wind speed that a controller estimates from power, speed and pitch")


GENERATOR_TORQUE, PITCH_DEMAND, BRAKE, YAW_RATE_DEMAND, FLAP_DEMAND, REACTIVE_POWER = Demands.slots(
    "generator_torque pitch brake yaw_rate flap reactive_power"
)
OPERATING_STATE, POWER_SETPOINT, YAW_ERROR, YAW_THRESHOLD, POWER_STATE, WIND_ESTIMATE = Demands.slots(
    "operating_state power_setpoint yaw_error yaw_threshold power_state wind_estimate"
)
REPORTS = ("operating_state", "power_setpoint", "yaw_error", "yaw_threshold", "power_state", "wind_estimate")
"""Demands that are reports."""

MOST_TORQUE, MOST_PITCH, MOST_FLAP, MOST_REACTIVE = 5.0, 0.5, 1.6, 2.0
"""A torque demand may reach this multiple of the turbine's largest torque, a pitch demand go this far [rad] beyond
the actuator's range, a flap be asked for this deflection [rad], a converter for this multiple of rated power. A
controller that asks for more ends the run with its name and time."""
