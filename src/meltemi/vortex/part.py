"""Vortex wakes as a part of the machine.

Reference: docs/theory/vortices.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar

import numpy as np

from meltemi.compiler import KernelRecord, Table, kernel
from meltemi.core.errors import InputError
from meltemi.simulation.induction import InductionPart, settle_part
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.parts import StateRows
from meltemi.simulation.step import DIVERGED, check_parts
from meltemi.simulation.system import March
from meltemi.vortex import line, start, wake  # noqa: F401 - their kernels act at the hooks
from meltemi.vortex.drawn import vortex_lines
from meltemi.vortex.filaments import CORES, LAMB, ROWS
from meltemi.vortex.tables import (
    BoundFlow,
    BoundInfluence,
    VortexParameters,
    VortexState,
    VortexSystem,
    WakeDrift,
    WakeZone,
)

SWEEPS, SETTLED = 60, 2e-3
"""Sweeps that settle a wake at the start of a run, at most; [m/s] change of the velocities at which they end."""
VORTICES = (4, 2)
"""Vortices of a blade in the second and third zone."""
SIDES = (pi / 6.0, pi / 3.0)
"""[rad] azimuth of their filaments, at least."""
VISCOSITY = 1.464e-5
"""[m^2/s] kinematic viscosity of air."""
PAIRS, LONGEST = 5e8, 3600.0
"""[1/s] velocities of a vortex by another one that a core computes; [s] longest revolution that is accepted."""


@check_parts.variant
@kernel
def _(m: VortexSystem, run: March) -> None:
    if m.vortex_state.fault > 0.0:
        run.clock.status = DIVERGED


@dataclass(frozen=True)
class VortexPart(InductionPart):
    """A vortex wake.

    Attributes:
      vortex: parameters.
    """

    settles: ClassVar[bool] = True
    system: ClassVar[type[KernelRecord] | None] = VortexSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        **InductionPart.signals,
        "vortex_state": VortexState,
        "wake_1": WakeZone,
        "wake_2": WakeZone,
        "wake_3": WakeZone,
        "drift_1": WakeDrift,
        "drift_2": WakeDrift,
        "drift_3": WakeDrift,
        "bound": BoundFlow,
        "bound_influence": BoundInfluence,
    }
    vortex: Any

    def zones(self) -> list[dict[str, int]]:
        """Sizes of the zones, with room for the panels that wait to be merged."""
        p, n = VortexParameters(self.vortex), len(self.line_ends) - 1
        ages = (p.panels_1 + p.merge_2 + 2, p.panels_2 + p.merge_3 + 2, p.panels_3 + 1)
        edges = (n + 1, *VORTICES)
        return [{"blade": self.n_blades, "age": int(a), "edge": e} for a, e in zip(ages, edges, strict=True)]

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        n = len(self.line_ends) - 1
        sizes = {"blade": self.n_blades, "node": n, "element": n, "source": n}
        each = {
            name: {**sizes, **zone} for z, zone in enumerate(self.zones(), 1) for name in (f"wake_{z}", f"drift_{z}")
        }
        return {name: table.shape(**each.get(name, sizes)) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Parameters and work arrays."""
        p, n = VortexParameters(self.vortex), len(self.line_ends) - 1
        counts = [z["blade"] * z["age"] * (2 * z["edge"] - 1) for z in self.zones()]
        filaments = (sum(counts) + self.n_blades * (2 * n + (n + 1) * line.PIECES)) * (2 if p.ground else 1)
        return {
            **super().arrays(),
            "vortex": self.vortex.copy(),
            "wake_sources": np.zeros((ROWS, filaments)),
            "wake_sources32": np.zeros((ROWS, filaments), dtype=np.float32),
            "wake_point": np.zeros(3),
            "wake_point32": np.zeros(3, dtype=np.float32),
        }

    def begin(self, case: Any) -> None:
        """Settle the wake at the present motion.

        Raises:
          InputError: the turbine has another induction model.
        """
        self.alone(case)
        # in linear models the wake has no derivatives
        settle_part(case, "lifting_line", SWEEPS, SETTLED, case.plain if case.slopes else case.system)

    def states(self) -> Sequence[StateRows]:
        """None: linear models keep the wake where it is."""
        return ()

    def vortex_lines(self, case: Any) -> Any:
        """Vortices for a view."""
        return vortex_lines(case, self.vortex)

    def why(self, case: Any) -> str:
        """Reason for which the wake ended a run."""
        state = case.view("vortex_state")
        if not state["fault"]:
            return ""
        blade, age = state["fault"], state["fault_age"]
        return (
            f"vortex wake: a vortex of blade {blade:.0f}, {age:.1f} s old, is lost: its velocity has grown without "
            "bound; use a larger vortices.wake_core or a smaller vortices.azimuth_step"
        )


def part_of(turbine: Any, options: ModelOptions, rotor: Any) -> VortexPart:
    """The vortex wake of a turbine.

    Raises:
      InputError: the rotor has no blades, or a revolution of the wake would take more than an hour.
    """
    o = options.vortices
    revolution = 2.0 * pi / o.azimuth_step
    merge_2 = max(round(SIDES[0] / o.azimuth_step), 1)
    merge_3 = max(round(SIDES[1] / (o.azimuth_step * merge_2)), 1)
    panels_1 = max(round(o.lattice * revolution), 1)
    panels_2 = max(round((o.free - o.lattice) * revolution / merge_2), 1)
    panels_3 = max(round((o.length - max(o.free, o.lattice)) * revolution / (merge_2 * merge_3)), 1)
    values = VortexParameters.of(
        azimuth_step=o.azimuth_step,
        radius=turbine.rotor_radius,
        panels_1=panels_1,
        panels_2=panels_2,
        panels_3=panels_3,
        merge_2=merge_2,
        merge_3=merge_3,
        shed=round(o.shed * revolution),
        core=CORES.index(o.core),
        blade_core=o.blade_core,
        wake_core=o.wake_core,
        growth=4.0 * LAMB * o.eddy_viscosity * VISCOSITY,
        ground=o.ground,
        mean_wind=o.wind == "mean",
        free=options.wake == "free",
    )
    part = VortexPart.on(turbine, rotor, vortex=values.array)
    counts = [zone["blade"] * zone["age"] * zone["edge"] for zone in part.zones()]
    moved = sum(counts[:2]) / (1 if options.wake == "free" else wake.REFRESHED)
    seconds = 2.0 * sum(counts) * (2 if o.ground else 1) * moved * revolution / PAIRS
    if seconds > LONGEST:
        raise InputError(
            f"vortices: a wake of {sum(counts):,} vortices would take about {seconds / 3600.0:,.0f} h a revolution; "
            f"expected at most 1 h: use a larger azimuth_step than {o.azimuth_step:g} rad or a smaller lattice than "
            f"{o.lattice:g} revolutions"
        )
    return part
