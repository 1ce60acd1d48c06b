"""Turbines for which a fixed pitch increases the loads of tower and blades, and why: A2 against A0 on three turbines.

Two causes are tested separately: the width of the speed range that A2 leaves to the rotor, and the pitch control
of the speed, which A2 uses at its upper end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from meltemi.analyses.performance import performance_of
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.environment.site import STANDARD
from meltemi.papers.palanimuthu2022.beyond import loaded, part_chapter
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.study import Draw, Progress, span
from meltemi.postprocess.ensemble import EnsembleTable, ensemble_table
from meltemi.power_control.controller import PowerController, default_frequency, shaft_inertia
from meltemi.power_control.rotor import rotor_tables
from meltemi.power_control.settings import PowerControl
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import change_bar, change_text
from meltemi.studies.power_schemes.costs import (
    ENERGY,
    FRONT_LEVEL,
    FULL,
    PITCH,
    QUICK,
    ROOT_LOAD,
    SLOPES,
    STEADY,
    TOWER_LOAD,
    rows_of,
)
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MACHINES = ("iea22mw", "iea15mw", "nrel5mw")
SLOW = 0.5
"""Factor on the frequency of the speed loop."""
NARROW = 0.9
"""Lower end of the narrow range, share of its upper end: about that of the IEA 15 MW."""
BASE, HELD, NARROWED, FAST = "A0", "A2", "A2, narrow range", "A1"
SLOW_BASE, SLOW_HELD, SLOW_FAST = (f"{scheme}, slow loop" for scheme in (BASE, HELD, FAST))
SHOWN = (PITCH, TOWER_LOAD, ROOT_LOAD, ENERGY)


@dataclass(frozen=True)
class SchemeChanges:
    """Results of a turbine.

    Attributes:
      low: lower end of the speed range of A2 over rated speed.
      frequency: [rad/s] frequency of its speed loop.
      changes: changes against A0.
      slow: changes of the schemes with the slow loop against A0 with the slow loop.
    """

    low: float
    frequency: float
    changes: EnsembleTable
    slow: EnsembleTable


Results = Mapping[str, SchemeChanges]


def lower_speed(turbine: Turbine, performance: RotorPerformance, level: float) -> float:
    """Rotor speed over rated speed at which the optimal torque gives this share of rated power."""
    best, most = rotor_tables(performance, turbine.control.pitch.minimum).best
    gain = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * most / best**3
    speed = (level * turbine.rated_power / turbine.drivetrain.generator_efficiency / gain) ** (1.0 / 3.0)
    return float(speed / turbine.rated_rotor_speed)


def study(quick: bool, *, turbine: Turbine | None = None, workers: int | None, progress: Progress) -> Results:
    """The schemes on the three turbines, or on another one."""
    turbines = [turbine] if turbine else [loaded(name) for name in MACHINES]
    length = 1.0 / len(turbines)
    return {t.name: _machine(t, quick, workers, span(progress, i * length, length)) for i, t in enumerate(turbines)}


def _machine(turbine: Turbine, quick: bool, workers: int | None, progress: Progress) -> SchemeChanges:
    performance = performance_of(turbine)
    tables = rotor_tables(performance, turbine.control.pitch.minimum)
    frequency = default_frequency(turbine, tables, shaft_inertia(turbine))
    low = lower_speed(turbine, performance, FRONT_LEVEL)
    slow = {"frequency": SLOW * frequency}
    settings: dict[str, dict[str, Any]] = {BASE: {"scheme": "A0"}, HELD: {"scheme": "A2"}}
    settings |= {SLOW_BASE: {"scheme": "A0", **slow}, SLOW_HELD: {"scheme": "A2", **slow}}
    settings |= {FAST: {"scheme": "A1"}, SLOW_FAST: {"scheme": "A1", **slow}}
    if low < NARROW:
        settings[NARROWED] = {"scheme": "A2", "upper_speed": low / NARROW * turbine.rated_rotor_speed}
    laws = {
        name: PowerController(turbine, performance, PowerControl.model_validate(each))
        for name, each in settings.items()
    }
    demands = [(STEADY, FRONT_LEVEL)]
    (rows,) = rows_of(
        turbine, QUICK if quick else FULL, demands, laws, workers, progress, f"machines, {turbine.name}"
    ).values()
    alone = {seed: {name: row[name] for name in (SLOW_BASE, SLOW_HELD, SLOW_FAST)} for seed, row in rows.items()}
    return SchemeChanges(low, frequency, ensemble_table(rows, SLOPES), ensemble_table(alone, SLOPES))


def changes_table(results: Results) -> Table:
    """Table of changes against A0 by turbine."""
    rows = []
    for name, machine in results.items():
        lines = [(machine.changes, scheme, BASE) for scheme in machine.changes.schemes[1:]]
        lines += [(machine.slow, scheme, SLOW_BASE) for scheme in (SLOW_HELD, SLOW_FAST)]
        for table, scheme, base in lines:
            changes = [change_text(table.entry(quantity, scheme).change) for quantity in SHOWN]
            where = [name, f"{100.0 * machine.low:.0f} to 100", f"{machine.frequency:.3f}"]
            rows.append([*where, scheme, base, *changes])
    head = ["turbine", "range of A2 [% of rated speed]", "speed loop [rad/s]", "scheme", "against"]
    head += [f"{quantity} [%]" for quantity in SHOWN]
    note = sentence("machines", level=100.0 * FRONT_LEVEL, speed=FULL.speed, slow=SLOW, narrow=100 * NARROW)
    return Table(head, rows, "Changes by turbine, range and loop", text_columns=5, note=note)


def machines_figure(results: Results) -> Figure:
    """Bars of the changes of the loads by turbine and scheme."""
    figure, axes = new_figure(1, 2, size=(9.5, 4.4), share=False)
    for ax, quantity in zip(axes[0], (TOWER_LOAD, ROOT_LOAD), strict=True):
        names: list[str] = []
        for name, machine in results.items():
            for i, scheme in enumerate(machine.changes.schemes[1:]):
                mean, half = change_bar(machine.changes.entry(quantity, scheme).change)
                look: dict[str, Any] = {"color": COLOURS[i], "error_kw": {"linewidth": 0.9, "capsize": 2}}
                ax.barh(len(names), mean, 0.7, xerr=half, **look)
                names.append(f"{name}: {scheme}")
        ax.set_yticks(range(len(names)), names)
        ax.invert_yaxis()
        panel(ax, f"{quantity}, change against A0 [%]", "")
        ax.set_ylabel("")
    axes[0, 1].set_yticklabels([])
    return figure


def chapter(results: Results, draw: Draw, *, applied: bool = False) -> Section:
    """Chapter of the turbines."""
    words = f"Loads at {100.0 * FRONT_LEVEL:.0f} % of rated power by turbine, against A0; bars: 95 % intervals"
    figure = draw("machines_loads", words, lambda: machines_figure(results))
    heading = "for which turbines tower and blades pay, and why"
    return part_chapter(heading, lambda: verdict(results), [figure], lambda: [changes_table(results)], applied=applied)


def verdict(results: Results) -> str:
    """Conclusion, from the results."""

    def changes_text(quantity: str, scheme: str, names: Iterable[str], *, slow: bool = False) -> str:
        tables = {name: results[name].slow if slow else results[name].changes for name in names}
        return ", ".join(
            f"{change_text(table.entry(quantity, scheme).change)} % ({name})" for name, table in tables.items()
        )

    def tower_and_root(scheme: str, names: Iterable[str], *, slow: bool = False) -> dict[str, str]:
        loads = {"tower": TOWER_LOAD, "root": ROOT_LOAD}
        return {name: changes_text(load, scheme, names, slow=slow) for name, load in loads.items()}

    ranges = ", ".join(f"{100 * machine.low:.0f} % of rated speed on ({name})" for name, machine in results.items())
    fast = {"fast": changes_text(TOWER_LOAD, FAST, results)}
    fast |= {"slow_fast": changes_text(TOWER_LOAD, SLOW_FAST, results, slow=True)}
    lines = [
        sentence("free speed", level=100.0 * FRONT_LEVEL, ranges=ranges, **tower_and_root(HELD, results)),
        sentence("speed loop", slow=SLOW, **fast, **tower_and_root(SLOW_HELD, results, slow=True)),
    ]
    if narrow := [name for name, machine in results.items() if NARROWED in machine.changes.schemes]:
        lines.append(sentence("narrow range", narrow=100 * NARROW, **tower_and_root(NARROWED, narrow)))
    return "\n\n".join(lines)
