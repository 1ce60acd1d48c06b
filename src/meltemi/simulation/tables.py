"""Arrays of a run that belong to no subsystem."""

from __future__ import annotations

from meltemi.compiler import Numbers, Table, Vec, number, xyz


class Settings(Table):
    """Constants of a run."""

    time_step: float = number("s", "time step of the run")
    efficiency: float = number("-", "efficiency of the generator")
    held_share: float = number("-", "share of torque, pitch and flap angles before a jump in those at its instant")


class TurbineSummary(Table, title="summary"):
    """Quantities of the whole turbine."""

    time: float = number("s", "simulation time")
    wind: Vec = xyz("m/s", "undisturbed wind on the tower axis at the height of the undeflected hub, inertial axes")
    hub_wind: Vec = xyz("m/s", "undisturbed wind at the deflected hub, inertial axes")
    generator_speed: float = number("rad/s", "speed of the generator's shaft")
    generator_torque: float = number("N m", "torque on the generator's shaft")
    power: float = number("W", "electrical")
    rotor_power: float = number("W", "mechanical power of the low-speed shaft")


class Clock(Table, integer=True):
    """Progress of a run."""

    step: int = number("-", "instant")
    status: int = number("-", "status, see ``core.errors.Status``")
    row: int = number("-", "next row of the output")
    next_event: int = number("-", "index of the next event")
    every_output: int = number("-", "time steps between outputs")
    every_control: int = number("-", "time steps between calls of the controller")
    corrections: int = number("-", "additional evaluations in each step")
    want_loads: int = number("-", "1: evaluate section loads in each step, for the controller")


class Watch(Table, axes="criterion"):
    """Validity criteria of a run."""

    limit: Numbers = number("of the criterion", "largest valid value")
    notice: Numbers = number("of the criterion", "value above which the run has a warning")
    worst: Numbers = number("of the criterion", "largest value")
    first: Numbers = number("s", "time of the first violation; negative if there is none")
    noticed: Numbers = number("s", "time of the first value above that of a warning; negative if there is none")
    scale: Numbers = number("of the criterion", "parameter of the criterion")
    state: Numbers = number("of the criterion", "state of the criterion")
    last: Numbers = number("s", "time of the last evaluation")
    since: Numbers = number("s", "begin of the present interval of a vibration")
    before: Numbers = number("of the criterion squared", "mean square over the interval before")
    earlier: Numbers = number("of the criterion squared", "mean square over the one before that")
    place: Numbers = number("-", "index of the coordinate of a vibration among those of a blade; negative if none")
