"""Simulations of measured records, in several wind fields through the measured series of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from meltemi.cases.case import LoadCase, case_controller, case_turbine
from meltemi.core.errors import InputError, did_you_mean
from meltemi.gradients.sensitivity import turbine_values
from meltemi.simulation.model import Model
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.tuning.run_store import FailedResult, cells
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import aeroelastic
from meltemi.turbulence.conditioned import conditioned_fields
from meltemi.turbulence.grid import WIDTH
from meltemi.turbulence.sensors import Sensor as WindSensor
from meltemi.validation.channel_map import known_channel
from meltemi.validation.comparison import ComparedRecord
from meltemi.validation.conditions import RecordConditions, conditions_of, given_conditions
from meltemi.validation.gauges import Calibration
from meltemi.validation.measurements import MeasuredRecord, Signal
from meltemi.validation.reduction import ReducedRecord, like, reduce_record
from meltemi.validation.settings import Validation
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind

OUTPUT_STEP = 0.05
"""[s] of simulated series, or the next multiple of the step of the case."""
STEP, SPACING = 0.2, 3.5
"""[s, m] of the planes and points of a wind field, unless the file says otherwise."""
FACTORS = {
    "lift": "turbine.airfoils.*.lift",
    "drag": "turbine.airfoils.*.drag",
    "blade_stiffness": "turbine.blade.structure.flap_stiffness",
    "blade_mass": "turbine.blade.structure.mass",
}
"""Parameters that are factors on lists of the turbine's description, with their paths in ``sensitivity``."""
PATHS = {"air_density": "aerodynamics.air_density", "pitch_offset": "pitch_offset", **FACTORS}
"""Parameters of the model: ``pitch_offset`` [rad]; others are relative changes. Beside them there are ``yaw_error``
[rad], which turns the wind, and ``gauge_gain.CHANNEL`` and ``gauge_zero.CHANNEL`` of the readings."""
ROTOR = ("rotor_speed", "azimuth")
"""Channels by which multiples of the rotor frequency are separated."""


@dataclass(frozen=True)
class Prepared:
    """A record, ready to be simulated."""

    record: MeasuredRecord
    signals: Mapping[str, Signal]  # compared channels and those of the rotor
    conditions: RecordConditions
    measured: ReducedRecord


@dataclass(frozen=True)
class Simulator:
    """The turbine of a validation in the wind of any record."""

    settings: Validation
    case: LoadCase
    folder: Path  # of the paths in the case
    turbine: Turbine
    parameters: Mapping[str, float] = field(default_factory=dict)  # changes of uncertain parameters, see PATHS
    models: dict[float | None, Model[Any]] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(cls, settings: Validation, case: LoadCase, folder: Path) -> Simulator:
        """Load the turbine of a case.

        Raises:
          InputError: it cannot be read, or is no aeroelastic one.
        """
        if settings.integration == "implicit":
            case = case.replace(options=case.options.replace(integration="implicit"))
        return cls(settings, case, folder, aeroelastic(case_turbine(case, folder), "meltemi validate"))

    def at(self, parameters: Sequence[str], values: Iterable[float]) -> Simulator:
        """The same with parameters changed."""
        return replace(self, parameters=dict(zip(parameters, map(float, values), strict=True)), models={})

    def model(self, air_density: float | None) -> Model[Any]:
        """The turbine, with its parameters, in air of a density; None: that of the case."""
        if air_density not in self.models:
            site, change = self.case.environment, self.parameters
            air = (air_density or site.density) * (1.0 + change.get("air_density", 0.0))
            places: dict[str, Any] = {}
            for name in change.keys() & FACTORS.keys():
                found = turbine_values(name, self.turbine, FACTORS[name].split(".")[1:])
                places |= {path: (1.0 + change[name]) * x for path, x in found.items()}
            turbine = self.turbine.replace(**places) if places else self.turbine
            model: Model[Any] = build(turbine, self.case.options, site.replace(air_density=air, air=None))
            if offset := change.get("pitch_offset", 0.0):
                blades = range(1, turbine.n_blades + 1)
                model = model.with_parameters(**{f"actuators.pitch_offset_{b}": offset for b in blades})
            self.models[air_density] = model
        return self.models[air_density]

    def gauge(self, channel: str) -> tuple[float, float]:
        """Gain and zero by which a gauge reads a channel."""
        gain, zero = (self.parameters.get(f"{kind}.{channel}", 0.0) for kind in ("gauge_gain", "gauge_zero"))
        return 1.0 + gain, zero

    def prepared(self, record: MeasuredRecord, compared: Sequence[str]) -> Prepared:
        """Wind, air and statistics of a record.

        Raises:
          InputError: a sensor is missing, or a channel has no samples.
        """
        s = self.settings
        given = given_conditions(s.conditions, record.file)
        turbulence = {"coherent": "all", "dt": STEP, "points": points_across(self.turbine), **s.turbulence}
        conditions = conditions_of(record, s.channels, given, self.turbine.hub_height, s.transient, turbulence)
        names = [name for name in dict.fromkeys((*compared, *ROTOR)) if name in record.signals]
        signals = {name: record[name] for name in names if len(record[name].finite) > 1}
        return Prepared(record, signals, conditions, reduce_record(signals, [n for n in compared if n in signals]))

    def run(self, prepared: Prepared, seed: int) -> Run:
        """The simulation of a record in the field of a seed."""
        s, c = self.settings, prepared.conditions
        duration, turn = s.transient + prepared.record.length, self.parameters.get("yaw_error", 0.0)
        model = self.model(c.air_density)
        return Run(
            model,
            partial(field_of, c.sensors, c.wind.replace(seed=seed), self.turbine, duration, c.distance, turn),
            duration=duration,
            transient=s.transient,
            controller=case_controller(self.case, model, self.folder),
            channels=tuple(dict.fromkeys((*prepared.signals, *ROTOR))),
            output_step=self.case.output_step * max(round(OUTPUT_STEP / self.case.output_step), 1),
            name=self.name_of(prepared, seed),
        )

    def name_of(self, prepared: Prepared, seed: int) -> str:
        """Name of a run with its parameters: those of gauges change what is kept of it, but not the run."""
        return ", ".join([prepared.record.name, f"seed {seed}", *(f"{k} {x!r}" for k, x in self.parameters.items())])

    def reduced(self, prepared: Prepared, result: Result) -> ReducedRecord:
        """What is compared of a simulation: what its gauges would read."""
        signals = like(result, prepared.signals, prepared.record.begin, self.settings.transient)
        for name in prepared.measured.values:
            gain, zero = self.gauge(name)
            signals[name] = replace(signals[name], values=gain * signals[name].values + zero)
        return reduce_record(signals, list(prepared.measured.values))


def points_across(turbine: Turbine) -> int:
    """Points of a wind field across: an odd number, at most ``SPACING`` apart where 25 of them allow it."""
    return min(max(2 * math.ceil(0.5 * WIDTH * turbine.rotor_diameter / SPACING) + 1, 9), 25)


def field_of(
    sensors: Sequence[WindSensor], wind: TurbulentWind, turbine: Turbine, duration: float, distance: float, turn: float
) -> WindBox:
    """The wind field through the series of a record."""
    (box,) = conditioned_fields(sensors, wind, turbine, duration, distance=distance).fields
    return replace(box, direction=box.direction + turn)


def compared_channels(settings: Validation) -> tuple[str, ...]:
    """Channels that are measured and simulated.

    Raises:
      InputError: a name in ``compare`` is not measured, or no channel is left.
    """
    measured = [name for name, _, sensor in settings.channels.sensors() if sensor.kind != "position"]
    known = [name for name in dict.fromkeys(measured) if (c := known_channel(name)) and not c.name.startswith("wind_")]
    for name in settings.compare:
        if name not in known:
            raise InputError(f"compare: {name!r} is not measured: {did_you_mean(name, known)}")
    names = tuple(settings.compare or known)
    if not names:
        raise InputError("channels: none of the measured channels is one of the simulation")
    return names


def gauges_of(settings: Validation, calibrations: Sequence[Calibration]) -> tuple[set[str], tuple[str, ...]]:
    """Raw gauges that are not calibrated, which cannot be compared; and those whose zero is not known."""
    known = {name for each in calibrations for name, use in zip(each.channels, each.use, strict=True) if use == "all"}
    raw = {
        n for n, _, sensor in settings.channels.sensors() if sensor.kind == "gauge" and sensor.si[0] in ("mV/V", "V")
    }
    return raw - known, tuple(name for name in settings.range_only if name not in known)


def simulate_records(
    simulator: Simulator,
    records: Sequence[MeasuredRecord],
    compared: Sequence[str],
    *,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[list[ComparedRecord], dict[str, str]]:
    """Simulate records in all seeds; finished runs of the open ``run_store`` are read.

    Returns:
      The compared records, and the reasons of failed ones by name.

    Raises:
      KeyboardInterrupt: Ctrl-C.
    """
    ready, failed = [], {}
    for record in records:
        try:
            ready.append(simulator.prepared(record, compared))
        except InputError as error:
            failed[record.name] = str(error)
    n = simulator.settings.seeds
    of_run = {simulator.name_of(each, seed): (each, seed) for each in ready for seed in range(1, n + 1)}
    values = cells(
        (simulator.run(each, seed) for each, seed in of_run.values()),
        reduce=lambda result: simulator.reduced(of_run[result.meta["case"]][0], result),
        workers=workers,
        progress=progress,
        total=len(of_run),
    )
    done = []
    for k, each in enumerate(ready):
        c, simulated = each.conditions, []
        for value in values[k * n : (k + 1) * n]:
            if isinstance(value, FailedResult):
                failed.setdefault(each.record.name, value.why)
            else:
                simulated.append(value)
        if simulated:
            density = c.air_density or simulator.case.environment.density
            wind = c.wind.speed, c.wind.intensity, density, c.wind.shear_exponent
            done.append(ComparedRecord(each.record.name, *wind, each.measured, tuple(simulated)))
    return done, failed
