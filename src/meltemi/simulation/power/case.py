"""One simulation's own arrays of a turbine of a power coefficient."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.flaps import FlapParameters
from meltemi.aero.tables import RotorFlow
from meltemi.control.faults import healthy
from meltemi.control.signals import Demands
from meltemi.core.errors import InputError
from meltemi.core.kernel import announce
from meltemi.electrical.tables import ElectricState
from meltemi.environment.conditions import Conditions, conditions_array
from meltemi.environment.grid import PowerGrid
from meltemi.maths.records import Kind
from meltemi.maths.tables import Table
from meltemi.numbers.duals import N_DERIVATIVES
from meltemi.numbers.views import FLOATS
from meltemi.simulation.case import LEAST_BRAKE_SPEED, Arena, BaseCase, Stations
from meltemi.simulation.electric import ELECTRIC_PARTS, deliver
from meltemi.simulation.power import step
from meltemi.simulation.power.model import PowerModel
from meltemi.simulation.step import Summary
from meltemi.simulation.validity import new_watch
from meltemi.structure.tables import BladeRootLoad, Gears, MachineLoad
from meltemi.turbine.electrical import nominal_frequency
from meltemi.turbine.exchange import Drive, Machine, PitchMotion
from meltemi.wind.fields import Wind, WindBox, wind_arrays
from meltemi.wind.velocity import WindField

Float = NDArray[np.float64]

CONSTANT = frozenset("times box conditions ratios pitches rain points watch".split())
"""Arrays that have no derivatives."""


class PowerCase(BaseCase):
    """Arrays of one simulation of a turbine of a power coefficient in a wind.

    Args:
      numbers: "duals" computes with derivatives; there are no nodes to be computed in lanes.
    """

    tables: ClassVar[dict[str, type[Table]]] = {
        "summary": Summary,
        "machine": Machine,
        "rotor": RotorFlow,
        "disk_flow": step.DiskFlow,
        "chain": MachineLoad,
        "root": BladeRootLoad,
        "pitch": PitchMotion,
        "flap": FlapParameters,
        "drive": Drive,
        "gears": Gears,
        "demands": Demands,
        "outside": Conditions,
        "electric": ElectricState,
    }
    time_loop: ClassVar[staticmethod[..., Any]] = staticmethod(step.advance)
    run_parts: ClassVar[tuple[str, ...]] = tuple(step.RUN_PARTS)
    model: PowerModel

    def __init__(
        self,
        model: PowerModel,
        wind: Wind,
        stations: Stations | None = None,
        *,
        numbers: Kind = "floats",
        grid: PowerGrid | None = None,
    ) -> None:
        announce("power")
        if stations is not None and (stations.blade or stations.tower):
            raise InputError(
                f"{model.turbine.name}: blade_stations and tower_stations need blades and a tower, which a turbine of "
                "a power coefficient does not have"
            )
        duals = numbers == "duals"
        self.model = model
        turbine, n = model.turbine, len(model.coordinates)
        sizes = {"blade": model.n_blades, "flap": 0, "mode": 0}
        shapes = {name: table.shape(**sizes) for name, table in self.tables.items()}
        self.signals = Arena({"q": (n,), "v": (n,), "a": (n,), **shapes}, duals=duals)
        self.aero_state, self.spare = Arena({}), np.zeros(0)
        self.arrays = {
            **self.signals.views,
            "locked": model.locked.copy(),
            "structure": model.structure,
            "aero": model.aero.copy(),
            "disk": model.disk,
            "coefficient": model.coefficient,
            "ratios": model.ratios,
            "pitches": model.pitches,
            "values": model.values,
            "rain": model.rain,
            "points": model.points if isinstance(wind, WindBox) else np.zeros((2, 1)),
            "faults": healthy(),
            "watch": new_watch(model),
            "conditions": conditions_array(
                model.environment, grid, turbine.rated_power, nominal_frequency(turbine.electrical)
            ),
            "actuators": model.actuators,
            **wind_arrays(wind, turbine.hub_height, turbine.rotor_diameter),
            "electrical": model.electrical,
            "d_electric": ElectricState.zeros(),
            "columns": np.zeros((6, n)),
        }
        self._prepare(model)
        self.arrays["drive"][Drive.index("brake_speed")] = LEAST_BRAKE_SPEED
        self.arrays["drive"][Drive.index("yaw_held")] = 1.0
        self._electric_parts = tuple(self.arrays[name] for name in ELECTRIC_PARTS)
        self.numbers: tuple[Any, ...] = (FLOATS, FLOATS)
        self._electric_numbers = FLOATS
        self.slopes: dict[str, Float] = dict(self.signals.slope_views)
        if duals:
            for name, array in self.arrays.items():
                if name not in self.slopes and name not in CONSTANT:
                    self.slopes[name] = np.zeros((*array.shape, N_DERIVATIVES))
            for name in ("measured", "v_old", "a_old"):
                self.slopes[name] = np.zeros((*getattr(self, name).shape, N_DERIVATIVES))
            self.slopes["signals"] = self.signals.slopes
            self._electric_numbers = self.kinds(ELECTRIC_PARTS)
            self.numbers = (FLOATS, self.kinds(step.PARTS))
        field = WindField(numbers, self.arrays, self.slopes)
        self.parts = tuple(field if name == "field" else self.arrays[name] for name in step.PARTS)

    def evaluate(self, t: float, dt: float = 0.0) -> None:
        """Compute everything at time ``t`` for the present state."""
        step.evaluate(t, self.numbers, self.parts)

    def loads(self, t: float) -> None:
        """Compute the summary after an evaluation."""
        step.observe(t, self.model.turbine.drivetrain.generator_efficiency, self.numbers, self.parts)
        if self.model.has_electrical:
            deliver(self._electric_numbers, self._electric_parts)

    def kernel_parts(self) -> tuple[Any, ...]:
        """Kinds of number, and the machine's arrays."""
        return self.numbers, self.parts
