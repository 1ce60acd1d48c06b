"""Arrays of a run that belong to no single subsystem."""

from __future__ import annotations

from meltemi.maths.algebra import Vec
from meltemi.maths.tables import Numbers, Table, number, xyz


class Settings(Table):
    """Numbers that a run keeps."""

    time_step: float = number("s", "of the run")
    efficiency: float = number("-", "of the generator")


class Summary(Table):
    """Quantities that belong to the whole machine."""

    time: float = number("s", "simulation time")
    wind: Vec = xyz("m/s", "undisturbed wind on the tower's axis, at the height of the undeflected hub, inertial axes")
    hub_wind: Vec = xyz("m/s", "the same at the hub, where it has moved to")
    generator_speed: float = number("rad/s", "of the generator's shaft")
    generator_torque: float = number("N m", "on the generator's shaft")
    power: float = number("W", "electrical")
    rotor_power: float = number("W", "mechanical, of the low-speed shaft")


class Clock(Table, integer=True):
    """Where a run stands."""

    step: int = number("-", "instant")
    status: int = number("-", "see ``core.errors.Status``")
    row: int = number("-", "next row of the output")
    next_event: int = number("-", "the first event that has not happened")
    every_output: int = number("-", "time steps between outputs")
    every_control: int = number("-", "time steps between calls of the controller")
    corrections: int = number("-", "further evaluations of each step")
    want_loads: int = number("-", "1: section loads in each step, for the controller")


class Watch(Table, axes="criterion"):
    """Criteria of validity over a run."""

    limit: Numbers = number("of the criterion", "above which the model is not valid")
    worst: Numbers = number("of the criterion", "largest value")
    first: Numbers = number("s", "time at which it was above the limit first; negative: never")
    scale: Numbers = number("of the criterion", "parameter of the quantity")
    state: Numbers = number("of the criterion", "state of the quantity")
