"""For which turbines tower and blades pay for a held pitch, and why: A2 against A0 on three of them, by experiment.

Two causes are tried by changing them alone: the width of the range of speeds that A2 leaves to the rotor, and the
speed loop through the pitch, which A2 uses at its upper end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from meltemi.control.power_control.controller import PowerController, default_frequency, shaft_inertia
from meltemi.control.power_control.rotor import rotor_tables
from meltemi.control.power_control.settings import PowerControl
from meltemi.environment.site import STANDARD
from meltemi.postprocess.ensemble import EnsembleTable
from meltemi.report.plots import new_figure, panel
from meltemi.simulation.performance import performance_of
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.performance import RotorPerformance
from meltemi.turbine.power_turbine import aeroelastic
from meltemi_papers.palanimuthu2022.beyond import part_chapter
from meltemi_papers.study import Chapter, Draw, Progress, span
from meltemi_reports.blocks import Table
from meltemi_reports.ensemble_tables import change_bar, change_text
from meltemi_studies.power_schemes.costs import (
    ENERGY,
    FRONT_LEVEL,
    FULL,
    PITCH,
    QUICK,
    ROOT_LOAD,
    STEADY,
    TOWER_LOAD,
    laws_compared,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MACHINES = ("iea22mw", "iea15mw", "nrel5mw")
SLOW = 0.5
"""Of the frequency of the speed loop."""
NARROW = 0.9
"""Lower end of the narrow range, share of its upper end: about that of the IEA 15 MW."""
BASE, HELD, SLOW_BASE, SLOW_HELD, NARROWED = "A0", "A2", "A0, slow loop", "A2, slow loop", "A2, narrow range"
SHOWN = (PITCH, TOWER_LOAD, ROOT_LOAD, ENERGY)


@dataclass(frozen=True)
class Machine:
    """Results of a turbine.

    Attributes:
      low: lower end of the range of A2, share of rated speed.
      frequency: [rad/s] of its speed loop.
      changes: against A0.
    """

    low: float
    frequency: float
    changes: EnsembleTable


Found = Mapping[str, Machine]


def lower_speed(turbine: Turbine, performance: RotorPerformance, level: float) -> float:
    """Share of rated speed at which the optimal torque gives this share of rated power."""
    best, most = rotor_tables(performance, turbine.control.pitch.minimum).best
    gain = 0.5 * STANDARD * math.pi * turbine.rotor_radius**5 * most / best**3
    met = (level * turbine.rated_power / turbine.drivetrain.generator_efficiency / gain) ** (1.0 / 3.0)
    return float(met / turbine.rated_rotor_speed)


def study(quick: bool, *, turbine: Turbine | None = None, workers: int | None, progress: Progress) -> Found:
    """The schemes on the three turbines, or on another one."""
    names = {t.name: t for t in ([turbine] if turbine else map(_loaded, MACHINES))}
    length = 1.0 / len(names)
    return {
        name: _machine(t, quick, workers, span(progress, i * length, length))
        for i, (name, t) in enumerate(names.items())
    }


def _loaded(name: str) -> Turbine:
    return aeroelastic(load_turbine(name), "loads in turbulence")


def _machine(turbine: Turbine, quick: bool, workers: int | None, progress: Progress) -> Machine:
    performance = performance_of(turbine)
    tables = rotor_tables(performance, turbine.control.pitch.minimum)
    frequency = default_frequency(turbine, tables, shaft_inertia(turbine))
    low = lower_speed(turbine, performance, FRONT_LEVEL)
    slow = {"frequency": SLOW * frequency}
    settings: dict[str, dict[str, Any]] = {BASE: {"scheme": "A0"}, HELD: {"scheme": "A2"}}
    settings |= {SLOW_BASE: {"scheme": "A0", **slow}, SLOW_HELD: {"scheme": "A2", **slow}}
    if low < NARROW:
        settings[NARROWED] = {"scheme": "A2", "upper_speed": low / NARROW * turbine.rated_rotor_speed}
    laws = {
        name: PowerController(turbine, performance, PowerControl.model_validate(each))
        for name, each in settings.items()
    }
    asked = [(STEADY, FRONT_LEVEL)]
    found = laws_compared(
        turbine, QUICK if quick else FULL, asked, laws, workers, progress, f"machines, {turbine.name}"
    )
    return Machine(low, frequency, found[asked[0]])


def changes_table(found: Found) -> Table:
    """Table of changes against A0 by turbine."""
    rows = []
    for name, machine in found.items():
        for scheme in machine.changes.schemes[1:]:
            changes = [change_text(machine.changes.entry(quantity, scheme).change) for quantity in SHOWN]
            rows.append([name, f"{100.0 * machine.low:.0f} to 100", f"{machine.frequency:.3f}", scheme, *changes])
    head = ["turbine", "range of A2 [% of rated speed]", "speed loop [rad/s]", "scheme"]
    head += [f"{quantity} [%]" for quantity in SHOWN]
    note = (
        f"{100.0 * FRONT_LEVEL:.0f} % of rated power asked for at {FULL.speed:g} m/s, class IB; changes against A0 "
        f"with 95 % intervals. Slow loop: {SLOW:g} of the frequency. Narrow range: from {100 * NARROW:.0f} % of its "
        "upper end."
    )
    return Table(head, rows, "Changes against A0 by turbine, range and loop", text_columns=4, note=note)


def machines_figure(found: Found) -> Figure:
    """Bars of the changes of the loads by turbine and scheme."""
    figure, axes = new_figure(1, 2, size=(9.5, 4.4), share=False)
    for ax, quantity in zip(axes[0], (TOWER_LOAD, ROOT_LOAD), strict=True):
        names = []
        for name, machine in found.items():
            for scheme in machine.changes.schemes[1:]:
                mean, half = change_bar(machine.changes.entry(quantity, scheme).change)
                ax.barh(len(names), mean, 0.7, xerr=half, error_kw={"linewidth": 0.9, "capsize": 2})
                names.append(f"{name}: {scheme}")
        ax.set_yticks(range(len(names)), names)
        ax.invert_yaxis()
        panel(ax, f"{quantity}, change against A0 [%]", "")
        ax.set_ylabel("")
    axes[0, 1].set_yticklabels([])
    return figure


def chapter(found: Found, draw: Draw, *, applied: bool = False) -> Chapter:
    """Chapter of the turbines."""
    words = f"Loads at {100.0 * FRONT_LEVEL:.0f} % of rated power by turbine, against A0; bars: 95 % intervals"
    figure = draw("machines_loads", words, lambda: machines_figure(found))
    heading = "for which turbines tower and blades pay, and why"
    return part_chapter(heading, lambda: verdict(found), [figure], lambda: [changes_table(found)], applied=applied)


def verdict(found: Found) -> str:
    """Conclusion, from the results."""

    def said(name: str, quantity: str, scheme: str) -> str:
        return f"{change_text(found[name].changes.entry(quantity, scheme).change)} %"

    lines = [
        "With its speed loop as it is, A2 changes the load of the tower base against A0 by "
        + ", ".join(f"{said(n, TOWER_LOAD, HELD)} ({n}, range from {100 * m.low:.0f} %)" for n, m in found.items())
        + ", and that of the blade root by "
        + ", ".join(f"{said(n, ROOT_LOAD, HELD)} ({n})" for n in found)
        + ".",
        f"With {SLOW:g} of the loop's frequency A2 changes the tower base, against A0 with its own loop, by "
        + ", ".join(f"{said(n, TOWER_LOAD, SLOW_HELD)} ({n})" for n in found)
        + ", and A0 with the slow loop by "
        + ", ".join(f"{said(n, TOWER_LOAD, SLOW_BASE)} ({n})" for n in found)
        + ".",
    ]
    narrow = [n for n, m in found.items() if NARROWED in m.changes.schemes]
    if narrow:
        lines.append(
            f"With a range from {100 * NARROW:.0f} % of its upper end on it is "
            + ", ".join(f"{said(n, TOWER_LOAD, NARROWED)} ({n})" for n in narrow)
            + "."
        )
    return " ".join(lines)
