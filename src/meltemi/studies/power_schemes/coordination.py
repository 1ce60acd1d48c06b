"""Coordination of pitch, torque and yaw, compared in turbulent wind with slow direction changes.

Every candidate has the same winds: IEC normal turbulence with superposed changes of direction and speed within the
hour as Gauss-Markov processes: meandering of 0.6 m/s along and across in twenty minutes at any wind speed (after
Mahrt 2011, J. Appl. Meteorol. Climatol. 50, 144-152), and a drift of the direction with the weather of 15 degrees in
three hours.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.performance import performance_of
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.control.controller import Controller
from meltemi.control_laws.load_control import LoadControl
from meltemi.control_laws.yaw import YawControl
from meltemi.controllers.tuning import tune_ipc
from meltemi.environment.grid import PowerGrid
from meltemi.iec.winds import ntm
from meltemi.postprocess.ensemble import EnsembleTable, actuator_travel, ensemble_table
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.power_control.coordinated import CoordinatedController, Coordination
from meltemi.power_control.settings import PowerControl
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, panel
from meltemi.reports.ensemble_tables import change_bar
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.power_schemes.compared import Progress, SchemeSetup, by_seed
from meltemi.studies.power_schemes.costs import ROOT, SHAFT, STEP, TOWER, few_modes
from meltemi.studies.servo_duty import BEARING_SLOPE, servo_duty
from meltemi.turbine.definition import Turbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.superposition import with_gust
from meltemi.wind.fields import WindBox, WindSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

MEANDER, MEANDER_TIME = 0.6, 1200.0
"""[m/s], [s]."""
DRIFT, DRIFT_TIME = math.radians(15.0), 10800.0
"""[rad], [s]."""
TOP = "yaw_moment_z"
CHANNELS = ("generator_power", "pitch_1", "yaw_command", "yaw_error", "yaw_threshold", TOWER, ROOT, SHAFT, TOP)
ENERGY, PITCH, TURNED, STARTS = "energy", "pitch travel", "yaw travel", "starts of the yaw drive"
PITCH_STARTS, SWING = "starts of the pitch servo", "equivalent oscillation of the pitch"
TOWER_LOAD, ROOT_LOAD, TOP_LOAD = "tower base fore-aft DEL", "blade root DEL", "yaw bearing torsion DEL"
SLOPES = {SWING: BEARING_SLOPE, TOWER_LOAD: 4.0, ROOT_LOAD: 10.0, TOP_LOAD: 4.0}
UNITS = {
    ENERGY: ("MWh", 1.0 / 3.6e9),
    PITCH: ("deg/min", np.degrees(60.0)),
    PITCH_STARTS: ("1/min", 60.0),
    SWING: ("deg", np.degrees(1.0)),
    TURNED: ("deg/h", np.degrees(3600.0)),
    STARTS: ("1/h", 3600.0),
    TOWER_LOAD: ("MN m", 1e-6),
    ROOT_LOAD: ("MN m", 1e-6),
    TOP_LOAD: ("MN m", 1e-6),
}
SHOWN = (PITCH, TURNED, TOWER_LOAD, ROOT_LOAD, TOP_LOAD)
"""Beside the energy, whose percents would be lost on their scale."""
MOVES = 1e-4
"""[rad/s] yaw rate above which the drive turns: a fiftieth of the drive's rate."""


@dataclass(frozen=True)
class Candidate:
    """A coordination scheme.

    Attributes:
      scheme: scheme of the power control.
      relief: whether the dead band of the yaw control follows the power reserve.
      individual: whether individual pitch control is active.
      dead_band: [rad] dead band of the yaw control.
    """

    scheme: str
    relief: bool = False
    individual: bool = False
    dead_band: float = YawControl().dead_band


RIVAL = "pitch and torque, dead band of 15 deg"
"""The obvious rival of a dead band that follows the power: a fixed one as wide as that may become."""
CANDIDATES: dict[str, Candidate] = {
    "each for itself": Candidate("A0"),
    "pitch and torque": Candidate("A2"),
    "pitch and yaw": Candidate("A0", relief=True),
    RIVAL: Candidate("A2", dead_band=Coordination().widest_band),
    "all three": Candidate("A2", relief=True),
    "all three, wide hold": Candidate("A3", relief=True),
    "all three, individual pitch": Candidate("A2", relief=True, individual=True),
}
"""The first is the base: pitch at the optimal speed, and a yaw control that knows nothing of power."""


CONVENTIONAL, PROPOSAL = "each for itself", "pitch and torque"
OURS = ("pitch and yaw", "all three", "all three, wide hold", RIVAL)
"""Names of candidates: the paper's conventional scheme, the scheme that it proposes, and those of this package."""

HOURS = SchemeSetup(speed=13.0, levels=(0.6, 1.0), length=3600.0, begin=200.0, points=15)
QUICK = replace(HOURS, seeds=(1, 2), levels=(0.6,), length=200.0, begin=100.0, points=11)
LEVEL = 0.75
"""Share of rated power in the shorter comparison: Figure 21 of Palanimuthu et al. (2022)."""
Tables = Mapping[float, EnsembleTable]
"""Tables by share of rated power."""


def markov(rng: np.random.Generator, deviation: float, time: float, step: float, n: int) -> Float:
    """(n,) Gauss-Markov process with a standard deviation and time scale [s], starting at zero."""
    share = math.exp(-step / time)
    x = np.zeros(n)
    for i in range(1, n):
        x[i] = share * x[i - 1] + deviation * math.sqrt(1.0 - share * share) * rng.standard_normal()
    return x


def turning_wind(turbine: Turbine, setup: SchemeSetup, seed: int) -> WindBox:
    """A turbulent wind field with slowly varying mean speed and direction."""
    duration, step = setup.begin + setup.length, 10.0
    reach = turbine.rotor_diameter / setup.speed + 60.0
    box = generate_field(
        ntm(setup.speed, "IB", seed=seed, points=setup.points, periodic=False), turbine, duration + reach
    )
    n = int((duration + 2.0 * reach) / step) + 2
    rng = np.random.default_rng(1000 + seed)
    along = setup.speed + markov(rng, MEANDER, MEANDER_TIME, step, n)
    across = markov(rng, MEANDER, MEANDER_TIME, step, n)
    direction = np.arctan2(across, along) + markov(rng, DRIFT, DRIFT_TIME, step, n)
    return with_gust(box, WindSeries(time=step * np.arange(n) - reach, speed=along, direction=direction))


def controllers(model: BladedModel, performance: RotorPerformance, names: Iterable[str]) -> dict[str, Controller]:
    """Controllers of candidates; individual pitch control at 1P, tuned by stability margins."""
    assert isinstance(model.turbine, Turbine)
    chosen = {name: CANDIDATES[name] for name in names}
    load = LoadControl(loops=(tune_ipc(model).loop,)) if any(c.individual for c in chosen.values()) else None
    return {
        name: CoordinatedController(
            model.turbine,
            performance,
            power=PowerControl.model_validate({"scheme": candidate.scheme}),
            yaw=YawControl(dead_band=candidate.dead_band),
            relief=Coordination() if candidate.relief else None,
            load=load if candidate.individual else None,
            name=name,
        )
        for name, candidate in chosen.items()
    }


def quantities(result: Result) -> dict[str, float]:
    """Energy, loads and actuator duty of a run."""
    loads, servo = equivalent_loads(result, [TOWER, ROOT, TOP]), servo_duty(result)
    turning = np.abs(np.diff(result["yaw_command"]) / STEP) > MOVES
    hours = float(result.time[-1] - result.time[0])
    return {
        ENERGY: float(result["generator_power"].mean()) * hours,
        PITCH: servo.travel,
        PITCH_STARTS: servo.starts,
        SWING: servo.oscillation,
        TURNED: actuator_travel(result, "yaw_command"),
        STARTS: float(np.sum(np.diff(turning.astype(int)) > 0)) / hours,
        TOWER_LOAD: loads[TOWER],
        ROOT_LOAD: loads[ROOT],
        TOP_LOAD: loads[TOP],
    }


Rows = dict[float, dict[int, dict[str, dict[str, float]]]]
"""Quantities by level, seed and candidate."""


def simulated(
    turbine: Turbine, setup: SchemeSetup, names: Sequence[str], *, workers: int | None, progress: Progress
) -> Rows:
    """Candidates at all levels in all winds."""
    model = build(turbine, few_modes(turbine).replace(yaw="driven"))
    start, laws = operating_point(model, setup.speed), controllers(model, performance_of(turbine), names)
    duration = setup.begin + setup.length

    def cases(seed: int) -> Iterator[Run]:
        wind = turning_wind(turbine, setup, seed)
        for level in setup.levels:
            given: dict[str, Any] = {"channels": CHANNELS, "output_step": STEP, "start": start}
            given["grid"] = PowerGrid(power_reference=level * turbine.rated_power)
            for name in names:
                yield Run(model, wind, duration=duration, controller=laws[name], name=f"{level:g} {name}", **given)

    return by_seed(
        setup.seeds,
        setup.levels,
        names,
        cases,
        lambda result: quantities(result.between(setup.begin, duration)),
        workers=workers,
        progress=progress,
        what="hours of coordination",
    )


def study(turbine: Turbine, quick: bool, *, workers: int | None, progress: Progress) -> Tables:
    """All candidates at all levels in all winds; ``quick``: few short runs."""
    setup = QUICK if quick else HOURS
    rows = simulated(turbine, setup, tuple(CANDIDATES), workers=workers, progress=progress)
    return {level: ensemble_table(of, SLOPES) for level, of in rows.items()}


@dataclass(frozen=True)
class ProposalComparison:
    """Comparison of the paper's proposal and ours in the same winds, with the power reference of Figure 21.

    Attributes:
      conventional: changes against the paper's conventional scheme.
      proposal: changes against the scheme that the paper proposes.
    """

    conventional: EnsembleTable
    proposal: EnsembleTable


def bench(turbine: Turbine, quick: bool, *, workers: int | None, progress: Progress) -> ProposalComparison:
    """The shorter comparison."""
    setup = replace(QUICK if quick else HOURS, levels=(LEVEL,))
    rows = simulated(turbine, setup, (CONVENTIONAL, PROPOSAL, *OURS), workers=workers, progress=progress)[LEVEL]
    rebased = {seed: {name: row[name] for name in (PROPOSAL, *OURS)} for seed, row in rows.items()}
    return ProposalComparison(ensemble_table(rows, SLOPES), ensemble_table(rebased, SLOPES))


def coordination_figure(tables: Tables) -> Figure:
    """Changes relative to an uncoordinated controller, with 95 % confidence intervals."""
    figure, axes = new_figure(len(tables), 2, size=(10.0, 3.6 * len(tables)), share=False)
    axes[0, 0].get_gridspec().set_width_ratios([1.0, 0.9 * len(SHOWN)])
    for (left, right), (level, table) in zip(axes, tables.items(), strict=True):
        _bars(left, table, (ENERGY,))
        _bars(right, table, SHOWN)
        panel(left, f"{100.0 * level:.0f} % of power asked for", "%")
        panel(right, f"changes against '{table.schemes[0]}', {100.0 * level:.0f} % of power asked for", "%")
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _bars(ax: Axes, table: EnsembleTable, shown: Sequence[str]) -> None:
    """Bar chart of changes, candidates side by side."""
    others = table.schemes[1:]
    width = 0.8 / len(others)
    for i, name in enumerate(others):
        means, halves = zip(*(change_bar(table.entry(quantity, name).change) for quantity in shown), strict=True)
        ax.bar(
            np.arange(len(shown)) + width * (i - 0.5 * (len(others) - 1)),
            means,
            width,
            yerr=halves,
            color=COLOURS[i],
            error_kw={"linewidth": 0.8, "capsize": 2},
            label=name,
        )
    ax.set_xticks(np.arange(len(shown)), [name.replace(" ", "\n", 2) for name in shown])
    ax.tick_params(labelsize=8)
