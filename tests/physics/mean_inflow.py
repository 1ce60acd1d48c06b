"""An induction model of another package: one induced velocity for the rotor, from the mean circulation of all nodes.

dw/dt = (gain mean(circulation) - w) / time,   in Euler steps of its own
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from meltemi.aero.lifting_line import circulation, induced_velocities
from meltemi.compiler import Table, kernel, number
from meltemi.simulation.induction import InductionPart, InductionSystem, advance_induction, induction_step
from meltemi.simulation.parts import ParameterTables, StateRows
from meltemi.simulation.step import part_rates, settle_induction


class MeanInflow(Table, title="mean inflow"):
    gain: float = number("1/m", "induced velocity over mean circulation")
    time: float = number("s", "time constant")
    step: float = number("s", "time step of the model")


class MeanVelocity(Table):
    velocity: float = number("m/s", "state: induced velocity, against the shaft")


class MeanSystem(InductionSystem):
    mean: MeanInflow
    mean_velocity: MeanVelocity
    d_mean_velocity: MeanVelocity


@kernel
def mean_circulation(m: MeanSystem) -> float:
    result = 0.0
    for b in range(m.lifting_line.blades):
        for n in range(m.lifting_line.nodes):
            result += circulation(m, b, n) / (m.lifting_line.blades * m.lifting_line.nodes)
    return result


@kernel
def rate(m: MeanSystem) -> float:
    return (m.mean.gain * mean_circulation(m) - m.mean_velocity.velocity) / m.mean.time


@induced_velocities.variant
@kernel
def _(t: float, m: MeanSystem) -> None:
    for b in range(m.lifting_line.blades):
        for n in range(m.lifting_line.nodes):
            m.lifting_line.induced[b, n] = -m.mean_velocity.velocity * m.machine.shaft


@induction_step.variant
@kernel
def _(m: MeanSystem) -> float:
    return m.mean.step


@advance_induction.variant
@kernel
def _(dt: float, m: MeanSystem) -> None:
    m.mean_velocity.velocity += dt * rate(m)


@settle_induction.variant
@kernel
def _(m: MeanSystem) -> None:
    m.mean_velocity.velocity += 0.5 * m.mean.time * rate(m)


@part_rates.variant
@kernel
def _(m: MeanSystem) -> None:
    m.d_mean_velocity.velocity = rate(m)


@dataclass(frozen=True)
class MeanPart(InductionPart):
    system: ClassVar[Any] = MeanSystem
    signals: ClassVar[Any] = {**InductionPart.signals, "mean_velocity": MeanVelocity}
    parameter_tables: ClassVar[ParameterTables] = ((MeanInflow, "mean", MeanInflow.names),)
    mean: Any

    def arrays(self) -> dict[str, Any]:
        return {**super().arrays(), "mean": self.mean.copy(), "d_mean_velocity": MeanVelocity.zeros()}

    def states(self) -> Sequence[StateRows]:
        return (StateRows("mean_velocity", "d_mean_velocity", ("mean induced velocity",), ("m/s",)),)


class WithoutRates(MeanPart):
    """The same, of which linear models know no states."""

    states = InductionPart.states  # type: ignore[assignment]


def part_of(turbine: Any, options: Any, rotor: Any) -> MeanPart:
    return MeanPart.on(turbine, rotor, mean=MeanInflow.of(**turbine.extensions["mean_inflow"]).array)
