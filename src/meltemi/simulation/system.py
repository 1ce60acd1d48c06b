"""Records of a simulation: the bladed turbine, the common part of all turbines, control, and the run."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.aero.tables import AeroParameters, FlapParameters, RotorFlow
from meltemi.compiler import Array1, Array2, Constant, Ints, KernelRecord, Table, kernel
from meltemi.control.actuators import Actuation
from meltemi.control.signals import Demands
from meltemi.environment.conditions import Conditions
from meltemi.simulation.tables import Clock, Settings, TurbineSummary, Watch
from meltemi.structure.equations import generator_row, torsion_row
from meltemi.structure.tables import (
    BladeRootLoad,
    Coordinates,
    Gears,
    MachineLoad,
    SectionLoads,
    StepWeights,
    Structure,
    StructureParameters,
)
from meltemi.turbine.exchange import Drive, Machine, PitchMotion
from meltemi.wind.velocity import WindField


class AnySystem(WindField, Coordinates):
    """Members common to turbines with any kind of rotor."""

    q: Array1
    v: Array1
    a: Array1
    weights: StepWeights
    locked: Array1
    structure: StructureParameters
    aero: AeroParameters
    rotor: RotorFlow
    machine: Machine
    pitch: PitchMotion
    drive: Drive


COMMON_SIGNALS: dict[str, type[Table]] = {
    "summary": TurbineSummary,
    "machine": Machine,
    "rotor": RotorFlow,
    "chain": MachineLoad,
    "root": BladeRootLoad,
    "pitch": PitchMotion,
    "flap": FlapParameters,
    "drive": Drive,
    "gears": Gears,
    "demands": Demands,
    "outside": Conditions,
}
"""Arrays that a channel may record of any turbine, by the tables that describe them."""


class System(Structure, Air, AnySystem):
    """A turbine with flexible blades and tower; its coordinates are in the order of the model's."""


@kernel
def generator_speed(m: AnySystem) -> float:
    """[rad/s] speed of the generator's shaft."""
    return m.structure.gear_ratio * m.v[generator_row(m)]


@kernel
def rotor_speed(m: AnySystem) -> float:
    """[rad/s] speed of the rotor end of the shaft."""
    return m.v[generator_row(m)] + m.v[torsion_row(m)]


@kernel
def rotor_azimuth(m: AnySystem) -> float:
    """[rad] azimuth of blade 1 at the rotor end of the shaft."""
    return m.q[generator_row(m)] + m.q[torsion_row(m)]


class Control(Actuation):
    """Interface of controller and turbine: signals, actuators, conditions, measured loads."""

    settings: Constant[Settings]
    conditions: Constant[Array2]
    outside: Conditions
    root: BladeRootLoad
    chain: MachineLoad
    summary: TurbineSummary


class March(KernelRecord):
    """A run in progress.

    Attributes:
      events: (n, 3) table of events, see ``control.faults.apply_events``.
      limits: largest demands.
      v_old, a_old: velocities and accelerations of the last instant.
      aero_state, spare: states and memory of inflow and stall as one vector, and a copy of it for corrections.
      signals: every quantity that a channel may record.
      places: indices of the recorded channels in the signals; ``output`` is (rows, channels).
    """

    clock: Clock
    events: Constant[Array2]
    limits: Constant[Array1]
    controller_state: Array1
    v_old: Array1
    a_old: Array1
    aero_state: Array1
    spare: Array1
    signals: Array1
    places: Ints
    output: Array2
    watch: Constant[Watch]


class Outputs(SectionLoads):
    """Section loads of the turbine with blades and tower."""
