"""Pitch travel, loads and tracking errors of schemes of limited power in turbulence.

All changes are relative to A0, which pitches at the lowest speed at which the reference is met. At full power this is
a slow rotor: it loses energy in every lull, and the usual controller there is A1.

The schemes hold a share of rated power, or follow a regulation signal about it, in the same winds. The signal resembles
those of grid operators for secondary control: no mean, all periods from 40 s to ten minutes, an amplitude of at most a
tenth of rated power; a turbine at full power can only follow it downwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.performance import performance_of
from meltemi.control.controller import Controller
from meltemi.core.series import TimeSeries
from meltemi.environment.grid import PowerGrid
from meltemi.iec.winds import ntm
from meltemi.postprocess.ensemble import EnsembleTable, actuator_travel, ensemble_table
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.power_control.controller import PowerController
from meltemi.power_control.settings import PowerControl
from meltemi.report.palette import COLOURS, curve
from meltemi.report.plots import new_figure, panel
from meltemi.reports.ensemble_tables import half_bar
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.power_schemes.compared import Progress, SchemeSetup, by_seed
from meltemi.turbine.definition import Turbine
from meltemi.turbulence.field import generate_field

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

UPPER, FRONT_LEVEL = (0.88, 0.91, 0.94, 0.97), 0.75
"""Shares of rated speed that A2 holds at most, and of rated power that is asked for then."""
FAST = ModelOptions(
    flap_modes=2, edge_modes=1, torsion_modes=1, fore_aft_modes=1, side_side_modes=1, locked=("drivetrain",)
)
"""A direct drive's shaft is stiff: without it the time step is three times as long. The tower's loads are 7 to 10 %
lower than with all modes, other loads 2 %."""
STEP = 0.05
"""[s] interval between records."""


def few_modes(turbine: Turbine) -> ModelOptions:
    """Options of the model: ``FAST``, with the shaft free where there is a gearbox."""
    return FAST if turbine.drivetrain.gear_ratio == 1.0 else FAST.replace(locked=())


MOVES = np.radians(0.1)
"""[rad/s] pitch rate above which a blade counts as moving."""
TOWER, ROOT, SHAFT = "tower_base_moment_fore_aft", "root_moment_out_of_plane_1", "rotor_torque"
CHANNELS = ("generator_power", "power_reference", "rotor_speed", "pitch_1", TOWER, ROOT, SHAFT)
PITCH, MOVING, TRACKING = "pitch travel", "time with moving pitch", "tracking error"
ENERGY, SPEED = "mean power", "scatter of speed"
TOWER_LOAD, ROOT_LOAD, SHAFT_LOAD = "tower base fore-aft DEL", "blade root DEL", "shaft torque DEL"
SLOPES = {TOWER_LOAD: 4.0, ROOT_LOAD: 10.0, SHAFT_LOAD: 4.0}
UNITS = {
    PITCH: ("deg/min", np.degrees(60.0)),
    MOVING: ("%", 100.0),
    TRACKING: ("% of rated", 100.0),
    ENERGY: ("MW", 1e-6),
    SPEED: ("% of rated", 100.0),
    TOWER_LOAD: ("MN m", 1e-6),
    ROOT_LOAD: ("MN m", 1e-6),
    SHAFT_LOAD: ("MN m", 1e-6),
}
SHOWN = (PITCH, TRACKING, TOWER_LOAD, ROOT_LOAD, SHAFT_LOAD)
FRONT = (TOWER_LOAD, ROOT_LOAD, ENERGY)
STEADY, FOLLOWING = "steady", "following"
SCHEMES = ("A0", "A1", "A2", "A3")
"""Schemes of the power control; changes refer to the first."""


FULL = SchemeSetup(speed=12.0, levels=(0.4, 0.6, 0.8, 1.0), length=600.0, begin=100.0, points=21)
QUICK = replace(FULL, seeds=(1, 2), levels=(0.6, 1.0), length=60.0, begin=40.0, points=11)

Tables = Mapping[tuple[str, float], EnsembleTable]
"""Tables by demand (steady or following) and level."""


def regulation_signal(seed: int, duration: float, step: float = 2.0) -> tuple[Float, Float]:
    """Times [s] and a signal between -1 and 1 with equal power at all periods from 40 s to ten minutes."""
    n = int(duration / step) + 2
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(2 * n, step)
    inside = (frequency > 1.0 / 600.0) & (frequency < 1.0 / 40.0)
    spectrum = np.where(inside, np.exp(2j * np.pi * rng.random(len(frequency))), 0.0)
    signal: Float = np.fft.irfft(spectrum)[:n]
    return step * np.arange(n, dtype=float), signal / np.abs(signal).max()


def reference(setup: SchemeSetup, rated: float, level: float, signal: str, seed: int) -> float | TimeSeries:
    """Power reference [W] of the operator."""
    if signal == STEADY:
        return level * rated
    time, value = regulation_signal(seed, setup.begin + setup.length)
    return TimeSeries(time=time, value=rated * np.minimum(level + 0.1 * value, 1.0))


def quantities(result: Result, rated_power: float, rated_speed: float) -> dict[str, float]:
    """Power, pitch duty, loads and tracking error of a run."""
    loads = equivalent_loads(result, [TOWER, ROOT, SHAFT])
    power, pitch = result["generator_power"], result["pitch_1"]
    return {
        PITCH: actuator_travel(result, "pitch_1"),
        MOVING: float(np.mean(np.abs(np.diff(pitch)) > MOVES * STEP)),
        TRACKING: float(np.sqrt(np.mean((power - result["power_reference"]) ** 2))) / rated_power,
        SPEED: float(result["rotor_speed"].std()) / rated_speed,
        ENERGY: float(power.mean()),
        TOWER_LOAD: loads[TOWER],
        ROOT_LOAD: loads[ROOT],
        SHAFT_LOAD: loads[SHAFT],
    }


@dataclass(frozen=True)
class Costs:
    """Results of the schemes.

    Attributes:
      tables: comparison of the schemes, by demand.
      front: comparison of A2 with other upper speeds, at ``FRONT_LEVEL`` of rated power; the first scheme is A2.
    """

    tables: Tables
    front: EnsembleTable


def study(turbine: Turbine, quick: bool, *, workers: int | None, progress: Progress) -> Costs:
    """The schemes at all levels in all winds, and A2 with other upper speeds; ``quick``: few short runs."""
    setup, schemes = (QUICK, ("A0", "A2")) if quick else (FULL, SCHEMES)
    performance = performance_of(turbine)
    demands = [(signal, level) for signal in (STEADY, FOLLOWING) for level in setup.levels]
    rated = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio

    def law(**settings: Any) -> Controller:
        return PowerController(turbine, performance, PowerControl.model_validate(settings))

    def compared(
        questions: Sequence[tuple[str, float]], laws: Mapping[str, Controller], begin: float, end: float, what: str
    ) -> Tables:
        """The controllers in all winds, by demand, in a part of the progress."""

        def part(share: float, step: str) -> None:
            progress(begin + (end - begin) * share, step)

        rows = rows_of(turbine, setup, questions, laws, workers, part, what)
        return {question: ensemble_table(of, SLOPES) for question, of in rows.items()}

    costs = compared(demands, {scheme: law(scheme=scheme) for scheme in schemes}, 0.0, 0.75, "schemes")
    others = {f"A2, {100.0 * x:.0f} %": law(scheme="A2", upper_speed=x * rated) for x in UPPER[:: 3 if quick else 1]}
    laws = {"A2": law(scheme="A2"), "A0": law(scheme="A0"), "A1": law(scheme="A1"), **others}
    front = compared([(STEADY, FRONT_LEVEL)], laws, 0.75, 1.0, "upper speeds")
    return Costs(costs, next(iter(front.values())))


def rows_of(
    turbine: Turbine,
    setup: SchemeSetup,
    questions: Sequence[tuple[str, float]],
    laws: Mapping[str, Controller],
    workers: int | None,
    progress: Progress,
    what: str,
) -> dict[tuple[str, float], dict[int, dict[str, dict[str, float]]]]:
    """Quantities of controllers by demand, seed and name; ``what`` names the comparison."""
    model = build(turbine, few_modes(turbine))
    start, duration = operating_point(model, setup.speed), setup.begin + setup.length

    def reduced(result: Result) -> dict[str, float]:
        return quantities(result.between(setup.begin, duration), turbine.rated_power, turbine.rated_rotor_speed)

    def cases(seed: int) -> Iterator[Run]:
        wind = generate_field(ntm(setup.speed, "IB", seed=seed, points=setup.points), turbine, duration)
        for signal, level in questions:
            grid = PowerGrid(power_reference=reference(setup, turbine.rated_power, level, signal, seed))
            for scheme, law in laws.items():
                given: dict[str, Any] = {"channels": CHANNELS, "output_step": STEP, "start": start, "grid": grid}
                yield Run(
                    model, wind, duration=duration, controller=law, name=f"{what}, {signal} {level:g} {scheme}", **given
                )

    return by_seed(setup.seeds, questions, tuple(laws), cases, reduced, workers=workers, progress=progress, what=what)


def front_figure(front: EnsembleTable) -> Figure:
    """Loads over pitch travel, for A2 with several upper speeds between A0 and A1."""
    figure, axes = new_figure(1, len(FRONT), size=(10.0, 4.0), share=False)
    unit, factor = UNITS[PITCH]
    for ax, quantity in zip(axes[0], FRONT, strict=True):
        for i, scheme in enumerate(front.schemes):
            x, y = (front.entry(name, scheme).value for name in (PITCH, quantity))
            size = UNITS[quantity][1]
            look = curve(i) | {"linestyle": "none", "markersize": 5, "elinewidth": 0.8, "label": scheme}
            ax.errorbar(x.mean * factor, y.mean * size, half_bar(y, size), half_bar(x, factor), **look)
        panel(ax, quantity, UNITS[quantity][0])
        ax.set_xlabel(f"{PITCH} [{unit}]")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def efficient(front: EnsembleTable, quantities: Sequence[str]) -> list[str]:
    """Pareto-optimal schemes: no other has more energy and less of all other quantities, by their means."""

    def costs(scheme: str) -> Float:
        means = {name: front.entry(name, scheme).value.mean for name in quantities}
        return np.array([-x if name == ENERGY else x for name, x in means.items()])

    every = {scheme: costs(scheme) for scheme in front.schemes}
    return [
        scheme
        for scheme, values in every.items()
        if not any(
            np.all(other <= values) and np.any(other < values) for name, other in every.items() if name != scheme
        )
    ]


def costs_figure(tables: Tables) -> Figure:
    """Changes over the power level with 95 % confidence intervals; lower row with a regulation signal."""
    figure, axes = new_figure(len(SHOWN), 2, size=(9.0, 2.4 * len(SHOWN)), share=False)
    for row, signal in zip(axes.T, (STEADY, FOLLOWING), strict=True):
        levels = [level for kind, level in tables if kind == signal]
        schemes = tables[signal, levels[0]].schemes
        for ax, quantity in zip(row, SHOWN, strict=True):
            unit, factor = UNITS[quantity]
            for i, scheme in enumerate(schemes):
                entries = [tables[signal, level].entry(quantity, scheme).value for level in levels]
                ax.errorbar(
                    100.0 * np.array(levels) + 0.8 * (i - 1.5),
                    [entry.mean * factor for entry in entries],
                    [half_bar(entry, factor) for entry in entries],
                    color=COLOURS[i],
                    marker="o",
                    markersize=4,
                    linewidth=1.2,
                    capsize=2,
                    label=scheme,
                )
            panel(ax, f"{quantity}, {signal}", unit)
            ax.set_ylim(bottom=0.0)
        row[-1].set_xlabel("asked for [% of rated power]")
    axes[0, 0].legend()
    return figure
