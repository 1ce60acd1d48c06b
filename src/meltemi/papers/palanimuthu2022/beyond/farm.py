"""Derating and misalignment under load constraints, and farm power tracking with power margins.

After Croce et al. (2024), Wind Energ. Sci. 9, 1211-1227: derating can compensate the additional loads of a
misalignment, so that wake steering stays within the loads of the aligned turbine; and Tamaro et al. (2025), Wind
Energ. Sci. 10, 2705: set-points that maximise the power reserves of the turbines follow a reference better in lulls.
The methods in simplified form and none of the numbers: two turbines in a row, loads from aeroelastic simulation, a
steady wake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.performance import performance_of
from meltemi.environment.grid import PowerGrid
from meltemi.environment.site import STANDARD
from meltemi.iec.winds import ntm
from meltemi.papers.palanimuthu2022.beyond import loaded, part_chapter
from meltemi.papers.palanimuthu2022.beyond.machines import SLOW
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.study import Draw, Progress, span, step_progress
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.power_control.controller import PowerController, default_frequency, shaft_inertia
from meltemi.power_control.rotor import rotor_tables
from meltemi.power_control.settings import PowerControl
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import change_text, with_interval
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.power_schemes.compared import SchemeSetup
from meltemi.studies.power_schemes.costs import ROOT, STEP, TOWER, few_modes
from meltemi.studies.power_schemes.gaussian_wake import waked_speed
from meltemi.tuning.run_store import FailedResultError, cells, survivors
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
MACHINES = ("nrel5mw", "iea15mw")
ANGLES = tuple(math.radians(angle) for angle in (-20.0, 0.0, 20.0))
SHARES = (1.0, 0.9, 0.8)
"""Demands over the power in the mean wind, which falls with the cube of the cosine of the misalignment."""
SPACING = 5.0
"""Rotor diameters between the two turbines."""
INTENSITY = 0.06
"""Turbulence intensity: weak, as wake steering requires."""
DEMAND = 0.9
"""Power demand over the power of the aligned farm in the mean wind."""
FULL = SchemeSetup(speed=9.0, levels=SHARES, length=300.0, begin=100.0, points=15)
QUICK = replace(FULL, seeds=(1, 2), length=60.0, begin=40.0, points=11)
TOP = "yaw_moment_z"
LOADS = {TOWER: "tower base fore-aft DEL", ROOT: "blade root DEL", TOP: "yaw bearing torsion DEL"}
CHANNELS = ("generator_power", "rotor_aero_thrust", *LOADS)


class FarmSetPoint(NamedTuple):
    """Wind direction [rad], clockwise from above, 0 when aligned; demanded share of power."""

    angle: float
    share: float


ALIGNED = FarmSetPoint(0.0, 1.0)
Numbers = Mapping[str, Float]
"""(seeds,) powers [W], thrusts [N] and equivalent loads [N m] of a point."""
SPLITS = ("equal shares", "largest margin, aligned", "largest margin, steered")


@dataclass(frozen=True)
class TwoTurbineResults:
    """Results of a turbine, and of two of them in a row.

    Attributes:
      turbine: name of the turbine.
      points: set-points of the upstream turbine.
      margins: misalignment [rad], power demands of both turbines [W], and smallest margin [W], by split.
      errors: (seeds,) root mean square of the power deficit of the farm over its demand, by split.
    """

    turbine: Turbine
    points: Mapping[FarmSetPoint, Numbers]
    margins: Mapping[str, tuple[float, tuple[float, float], float]]
    errors: Mapping[str, Float]

    def change(self, point: FarmSetPoint, name: str) -> MeanEstimate:
        """Change against the aligned turbine without derating."""
        return mean_interval(self.points[point][name] / self.points[ALIGNED][name] - 1.0)

    def within(self, point: FarmSetPoint) -> bool:
        """Whether no mean load exceeds that of the aligned turbine."""
        return all(self.change(point, name).mean <= 0.0 for name in LOADS)

    def speed(self, point: FarmSetPoint) -> float:
        """Wind speed at the downstream turbine over that upstream."""
        force = 0.5 * STANDARD * math.pi * self.turbine.rotor_radius**2 * FULL.speed**2
        thrust = float(self.points[point]["rotor_aero_thrust"].mean()) / force
        return waked_speed(min(thrust, 0.96), point.angle, INTENSITY, SPACING)

    def speed_at(self, angle: float, power: float) -> float:
        """Wind speed ratio at a misalignment [rad] and mean power [W] upstream, by interpolation."""
        row = sorted(
            (float(self.points[p]["generator_power"].mean()), self.speed(p)) for p in self.points if p.angle == angle
        )
        return float(np.interp(power, *np.array(row).T))

    def both(self, point: FarmSetPoint) -> Float:
        """(seeds,) [W] power of two turbines, the second aligned; below rated its power goes with the cubed wind."""
        up, down = self.points[point]["generator_power"], self.points[ALIGNED]["generator_power"]
        return np.asarray(up + down * self.speed(point) ** 3)

    def gain(self, point: FarmSetPoint) -> MeanEstimate:
        """Change of the power of both turbines relative to both aligned."""
        return mean_interval(self.both(point) / self.both(ALIGNED) - 1.0)


Results = Mapping[str, TwoTurbineResults]


def study(quick: bool, *, turbine: Turbine | None = None, workers: int | None, progress: Progress) -> Results:
    """Both studies on two turbines, or on another one."""
    turbines = [turbine] if turbine else [loaded(name) for name in MACHINES]
    setup, length = QUICK if quick else FULL, 1.0 / len(turbines)
    return {t.name: _farm(t, setup, workers, span(progress, i * length, length)) for i, t in enumerate(turbines)}


def _cases(
    model: BladedModel, setup: SchemeSetup, wanted: Sequence[tuple[str, float, float, float, int]]
) -> Iterator[Run]:
    """Runs by name, misalignment [rad], power reference [W], mean wind [m/s] and seed."""
    turbine = model.turbine
    assert isinstance(turbine, Turbine)
    performance = performance_of(turbine)
    tables = rotor_tables(performance, turbine.control.pitch.minimum)
    # see the chapter on three turbines (beyond/machines.py)
    slow = SLOW * default_frequency(turbine, tables, shaft_inertia(turbine))
    law = PowerController(turbine, performance, PowerControl(scheme="optimal_speed", frequency=slow))
    starts = {v: operating_point(model, v) for v in {each[3] for each in wanted}}
    for name, angle, power, v, seed in wanted:
        wind = ntm(v, "IB", seed=seed, points=setup.points, direction=angle)
        wind = wind.replace(intensity=INTENSITY * setup.speed / v)
        given: dict[str, Any] = {"channels": CHANNELS, "output_step": STEP, "start": starts[v]}
        grid = PowerGrid(power_reference=min(power, turbine.rated_power))
        yield Run(model, wind, duration=setup.begin + setup.length, controller=law, grid=grid, name=name, **given)


def _farm(turbine: Turbine, setup: SchemeSetup, workers: int | None, progress: Progress) -> TwoTurbineResults:
    model, performance = build(turbine, few_modes(turbine)), performance_of(turbine)
    flow = 0.5 * STANDARD * math.pi * turbine.rotor_radius**2 * setup.speed**3
    available = float(performance.power.max()) * flow * turbine.drivetrain.generator_efficiency
    end = setup.begin + setup.length

    def reduced(result: Result) -> dict[str, float]:
        part = result.between(setup.begin, end)
        means = {name: float(part[name].mean()) for name in ("generator_power", "rotor_aero_thrust")}
        return means | equivalent_loads(part, list(LOADS))

    grid = list(product(ANGLES, setup.levels))
    wanted = []
    for (angle, share), seed in product(grid, setup.seeds):
        power = share * available * math.cos(angle) ** 3 if share < 1.0 else turbine.rated_power
        name = f"farm, {turbine.name}, {math.degrees(angle):g} deg, {share:g}, seed {seed}"
        wanted.append((name, angle, power, setup.speed, seed))
    first_part = span(progress, 0.0, 0.6)
    report = step_progress(first_part, "derating")
    results = iter(cells(_cases(model, setup, wanted), reduce=reduced, workers=workers, progress=report))
    points = {}
    for angle, share in grid:
        rows = survivors(next(results) for _ in setup.seeds)
        if len(rows) < len(setup.seeds):
            raise FailedResultError(f"farm, {turbine.name}: not every seed reached its end")
        points[FarmSetPoint(angle, share)] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    farm = TwoTurbineResults(turbine, points, {}, {})
    farm = replace(farm, margins=splits(farm))
    return replace(farm, errors=_errors(farm, model, setup, workers, span(progress, 0.6, 0.4)))


def splits(farm: TwoTurbineResults) -> dict[str, tuple[float, tuple[float, float], float]]:
    """Misalignment, powers and smallest margin of the splits of the demand, by the steady wake.

    The power of the upstream turbine determines its thrust, by interpolation over the simulated shares, and so the
    wind of the downstream turbine. Equal shares: equal fractions of the available power when aligned; largest margin:
    the split whose smaller margin is largest.
    """
    mean = {point: float(numbers["generator_power"].mean()) for point, numbers in farm.points.items()}
    have = (mean[ALIGNED], mean[ALIGNED] * farm.speed(ALIGNED) ** 3)
    demand = DEMAND * sum(have)

    def margin(angle: float, up: float) -> float:
        return min(mean[FarmSetPoint(angle, 1.0)] - up, mean[ALIGNED] * farm.speed_at(angle, up) ** 3 - (demand - up))

    equal = DEMAND * have[0]
    by_split = {SPLITS[0]: (0.0, (equal, demand - equal), margin(0.0, equal))}
    for name, angles in ((SPLITS[1], (0.0,)), (SPLITS[2], ANGLES)):
        options = product(angles, np.linspace(0.3 * demand, 0.9 * demand, 241))
        angle, up = max(options, key=lambda each: margin(each[0], float(each[1])))
        by_split[name] = (angle, (float(up), demand - float(up)), margin(angle, float(up)))
    return by_split


def _errors(
    farm: TwoTurbineResults, model: BladedModel, setup: SchemeSetup, workers: int | None, progress: Progress
) -> dict[str, Float]:
    """Power deficits of the splits in turbulence; both turbines have independent winds."""
    end, wanted = setup.begin + setup.length, []
    for (split, (angle, powers, _)), seed in product(farm.margins.items(), setup.seeds):
        v = round(setup.speed * farm.speed_at(angle, powers[0]), 3)
        name = f"farm, {farm.turbine.name}, {split}, seed {seed}"
        wanted.append((f"{name}, up", angle, powers[0], setup.speed, seed))
        wanted.append((f"{name}, down", 0.0, powers[1], v, seed + 100))

    def power(result: Result) -> Float:
        return np.asarray(result.between(setup.begin, end)["generator_power"])

    report = step_progress(progress, "following")
    series = iter(cells(_cases(model, setup, wanted), reduce=power, workers=workers, progress=report))
    lacks: dict[str, list[float]] = {split: [] for split in farm.margins}
    for (split, (_, powers, _)), _seed in product(farm.margins.items(), setup.seeds):
        demand = sum(powers)
        lack = np.minimum(next(series) + next(series) - demand, 0.0) / demand
        lacks[split].append(float(np.sqrt(np.mean(lack**2))))
    return {split: np.array(values) for split, values in lacks.items()}


def loads_table(results: Results) -> Table:
    """Table of the set-points of the upstream turbine: its power and loads, and the power of both."""
    rows = []
    for name, farm in results.items():
        for point in sorted(farm.points, key=lambda p: (abs(p.angle), p.angle, -p.share)):
            changes = [
                change_text(farm.change(point, each)) for each in ("generator_power", "rotor_aero_thrust", *LOADS)
            ]
            where = [name, f"{math.degrees(point.angle):+.0f}", f"{100 * point.share:.0f}"]
            rows.append([*where, *changes, "yes" if farm.within(point) else "no", change_text(farm.gain(point))])
    head = ["turbine", "misalignment [deg]", "asked for [%]", "power [%]", "thrust [%]"]
    head += [*(f"{load} [%]" for load in LOADS.values()), "within", "power of both [%]"]
    note = sentence("farm loads", speed=FULL.speed, intensity=100 * INTENSITY, spacing=SPACING)
    return Table(head, rows, "Derating and misalignment of the upstream turbine", text_columns=3, note=note)


def margins_table(results: Results) -> Table:
    """Table of the splits of the power demand between both turbines."""
    rows = []
    for name, farm in results.items():
        base = farm.errors[SPLITS[0]]
        for split, (angle, (up, down), least) in farm.margins.items():
            error = farm.errors[split]
            change = "" if split == SPLITS[0] else change_text(mean_interval(error / base - 1.0))
            powers = [f"{x * 1e-6:.2f}" for x in (up, down, least)]
            lack = with_interval(mean_interval(100.0 * error), 1)
            rows.append([name, split, f"{math.degrees(angle):+.0f}", *powers, lack, change])
    head = ["turbine", "split", "misalignment [deg]", "upstream [MW]", "downstream [MW]", "smaller margin [MW]"]
    head += ["lack of power [%]", "its change [%]"]
    note = sentence("farm margins", demand=100 * DEMAND)
    return Table(head, rows, "Following power with margins", text_columns=3, note=note)


def chapter(results: Results, draw: Draw, *, applied: bool = False) -> Section:
    """Chapter of derating, misalignment and margins."""
    heading = "derating and misalignment under load constraints, and margins of a farm"
    return part_chapter(
        heading, lambda: verdict(results), [], lambda: [loads_table(results), margins_table(results)], applied=applied
    )


def verdict(results: Results) -> str:
    """Conclusion, from the results."""
    lines = [sentence("farm source")]
    for name, farm in results.items():
        allowed = {p: farm.gain(p) for p in farm.points if p == ALIGNED or farm.within(p)}
        free = max(farm.points, key=lambda p: farm.gain(p).mean)
        best = max(allowed, key=lambda p: allowed[p].mean)
        safe = [p for p in allowed if p.angle != 0.0]
        words = "; ".join(f"{math.degrees(p.angle):+.0f}° at {100 * p.share:.0f} %" for p in safe) or "none"
        lack = mean_interval(farm.errors[SPLITS[2]] / farm.errors[SPLITS[0]] - 1.0)
        equal, aligned, steered = (farm.margins[split][2] * 1e-6 for split in SPLITS)
        angle = math.degrees(farm.margins[SPLITS[2]][0])
        added = f"{angle:+.0f}° add {steered - aligned:.2f} MW" if angle else "no misalignment tried adds any"
        points = {"free": _set_point_text(free), "best": _set_point_text(best)}
        gains = {"free_gain": change_text(farm.gain(free)), "best_gain": change_text(farm.gain(best))}
        margins = {"added": added, "steered": steered, "equal": equal, "lack": change_text(lack)}
        lines.append(sentence("farm", name=name, safe=words, **points, **gains, **margins))
    return "\n\n".join([*lines, sentence("farm limits")])


def _set_point_text(point: FarmSetPoint) -> str:
    where = f"{math.degrees(point.angle):+.0f}°" if point.angle else "aligned"
    return f"{where} at {100 * point.share:.0f} %"
