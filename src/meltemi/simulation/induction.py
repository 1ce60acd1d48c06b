"""Induction models as parts of the machine: they receive the loads of all nodes and return the induced velocities.

Such a part replaces the momentum balance and the dynamic inflow of its turbine; loads of blade elements, dynamic stall
and all else stay. Its record extends :class:`InductionSystem`. It has a variant of ``induced_velocities``
(``aero/lifting_line.py``), called in each evaluation, and, where it has states, of the functions here.

Reference: docs/development/induction.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.lifting_line import LiftingLine, LineAir
from meltemi.compiler import KernelRecord, Table, by_record, hook, kernel, number
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.simulation.bladed.rotor import BladedRotor
from meltemi.simulation.parts import Part, StateRows
from meltemi.simulation.step import begin_parts_step, settle_induction
from meltemi.simulation.system import System

SWEEPS, SETTLED = 50, 1e-6
"""Evaluations that settle an induction model at the start of a run, at most; [m/s] change at which they end."""


class InductionTime(Table):
    """Progress of an induction model."""

    elapsed: float = number("s", "state: time since the last step of the induction model")


class InductionSystem(System, LineAir):
    """A turbine with an induction model."""

    induction_time: InductionTime


@by_record
def induction_step(m: InductionSystem) -> float:
    """[s] time step of the model, rounded to whole steps of the turbine, at least one; by default one."""
    raise NotImplementedError


@hook
def advance_induction(dt: float, m: InductionSystem) -> None:
    """Advance the states of the model by its step ``dt`` [s], by the loads of the last evaluation."""


@induction_step.variant
@kernel
def _(m: InductionSystem) -> float:
    return 0.0


@begin_parts_step.variant
@kernel
def _(dt: float, m: InductionSystem) -> None:
    time = m.induction_time
    time.elapsed += dt
    if time.elapsed > induction_step(m) - 0.5 * dt:
        advance_induction(time.elapsed, m)
        time.elapsed = 0.0


def settle_part(case: Any, name: str, sweeps: int = SWEEPS, settled: float = SETTLED, system: Any = None) -> None:
    """Settle an induction model at the present motion, until the array ``name`` with its velocities [m/s] stays.

    Args:
      sweeps, settled: sweeps at most; [m/s] change of the velocities at which they end.
      system: record of the case in which it settles, by default its system.
    """
    accelerations = case["a"].copy()
    case.evaluate(0.0)
    for _ in range(sweeps):
        before = case[name].copy()
        settle_induction(case.system if system is None else system)
        case.evaluate(0.0)
        if not np.max(np.abs(case[name] - before)) > settled:  # the geometry stays, so this is the velocity
            break
    case["a"][:] = accelerations  # those of steady operation are prescribed, not those of the instant


@dataclass(frozen=True)
class InductionPart(Part):
    """Base of induction models.

    Attributes:
      n_blades: number of blades.
      line_ends: ends of the lifting lines, see ``LineAir``.
    """

    replaces_momentum: ClassVar[bool] = True
    has_adjoint: ClassVar[bool] = False
    system: ClassVar[type[KernelRecord] | None] = InductionSystem
    signals: ClassVar[dict[str, type[Table]]] = {"lifting_line": LiftingLine, "induction_time": InductionTime}
    n_blades: int
    line_ends: NDArray[np.float64]

    @classmethod
    def on(cls, turbine: Any, rotor: Any, **others: Any) -> Self:
        """The part of a turbine with a rotor.

        Args:
          others: further fields of the part.

        Raises:
          InputError: the rotor has no blades.
        """
        if not isinstance(rotor, BladedRotor):
            raise InputError(f"{turbine.name}: an induction model needs blades, not a power coefficient")
        position, edges = rotor.blade_layout.position, rotor.blade_layout.edges
        before = np.clip(np.arange(len(edges)) - 1, 0, len(position) - 2)
        ends = (edges - position[before]) / np.diff(position)[before]
        return cls(n_blades=turbine.n_blades, line_ends=ends, **others)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals, by blade and node where they have these axes."""
        sizes = {"blade": self.n_blades, "node": len(self.line_ends) - 1}
        return {name: table.shape(**sizes) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """All other arrays of its records."""
        return {"line_ends": self.line_ends}

    def states(self) -> Sequence[StateRows]:
        """States of linear models: none, unless the model defines them with ``part_rates``.

        Raises:
          UnsupportedError: the model has not defined them.
        """
        raise UnsupportedError(
            f"linear models: the induction model {type(self).__name__} has no rates of its states; linearise the "
            "turbine without it, with the momentum balance"
        )

    def begin(self, case: Any) -> None:
        """Settle the model at the present motion; errors as of :meth:`alone`."""
        self.alone(case)
        settle_part(case, "lifting_line")

    def alone(self, case: Any) -> None:
        """Check that no other part computes the induced velocities.

        Raises:
          InputError: the turbine has another induction model.
        """
        names = [type(part).__name__ for part in case.parts if part.replaces_momentum]
        if len(names) > 1:
            raise InputError(
                f"expected one induction model, found {len(names)}: {', '.join(names)}; remove all but one"
            )
