"""Tables and figure of docs/guide/constrained-pitch.md.

    python tools/constrained_pitch.py

The first table is in the wind of the paper, the second over a lifetime in the turbine's class.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import meltemi
from meltemi.control.controller import Controller
from meltemi.control_laws.load_control import HarmonicLoop
from meltemi.controllers.tuning import tune_ipc
from meltemi.core.files import write_text
from meltemi.iec.winds import ntm
from meltemi.postprocess.ensemble import MeanEstimate, lifetime_del, mean_interval, rayleigh_weights
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import heading, new_figure, save
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.reports.markdown import table_lines
from meltemi.studies.constrained_pitch import FULL, NONE, Norm, constrained_pitch
from meltemi.tuning.compare import Comparison, compare
from meltemi.tuning.quantities import BLADE_SLOPE
from meltemi.tuning.run_store import run_store
from meltemi.turbine.definition import Turbine

PAGE = Path(__file__).parents[1] / "docs" / "guide" / "constrained-pitch.md"
PICTURE = PAGE.parents[1] / "images" / "constrained-pitch.png"
TURBINE, SPEED = "iea15mw", 15.0
PAPER = {"speed": SPEED, "intensity": 0.08, "shear_exponent": 0.07}
"""Wind of the paper's turbulent case, of its published code."""
LIMITS = (1e6, 2e6, 3e6, 4e6)
"""[N m]."""
SEEDS = (1, 2, 3, 4, 5, 6)
LIFETIME_SPEEDS, MEAN_WIND = (8.0, 12.0, 16.0, 20.0, 24.0), 10.0
"""[m/s] simulated, and the yearly mean of class I."""
PUBLISHED = {"Hummel et al. (2025)": (0.50, 0.87)}


def controllers(
    turbine: Turbine, loop: HarmonicLoop, plant: complex, limits: Mapping[Norm, Sequence[float]]
) -> dict[str, Controller]:
    """Controllers for several limits [N m] by norm, by name; first those without and with full individual pitch."""
    ends = [constrained_pitch(turbine, loop, plant, limit) for limit in (inf, 0.0)]
    more = [constrained_pitch(turbine, loop, plant, limit, norm) for norm, each in limits.items() for limit in each]
    return {controller.name: controller for controller in (*ends, *more)}


@dataclass(frozen=True)
class Trade:
    """A controller between no and full individual pitch: means over seeds with 95 % intervals.

    Attributes:
      name: of the controller.
      travel: pitch travel over that without individual pitch.
      load: change of the load, a share.
      actuation: share of the travel that full individual pitch adds.
      reduction: share of the load that full individual pitch takes.
    """

    name: str
    travel: MeanEstimate
    load: MeanEstimate
    actuation: MeanEstimate
    reduction: MeanEstimate


def trades(c: Comparison, quantity: str = "RootMyc1 DEL") -> list[Trade]:
    """Trade of a load for travel by all controllers of :func:`controllers`, formed seed by seed.

    Args:
      c: all of them in the same winds.
      quantity: load that is traded.
    """
    found = []
    travel0, travel1 = (c.values("pitch travel", name) for name in (NONE, FULL))
    load0, load1 = (c.values(quantity, name) for name in (NONE, FULL))
    for name in c.schemes:
        travel, load = c.values("pitch travel", name), c.values(quantity, name)
        shares = (travel - travel0) / (travel1 - travel0), (load - load0) / (load1 - load0)
        found.append(Trade(name, *map(mean_interval, (travel / travel0, load / load0 - 1.0, *shares))))
    return found


def plot_trades(
    found: Mapping[str, Sequence[Trade]], published: Mapping[str, tuple[float, float]] | None = None
) -> Figure:
    """Share of the reduction over share of the actuation [%], a curve for each set of trades, and published points."""
    figure, axes = new_figure(1, size=(7.4, 4.6))
    ax = axes[0, 0]
    ax.plot([0.0, 100.0], [0.0, 100.0], color=INK, linewidth=0.8, linestyle=":", label="load in proportion to travel")
    for colour, (label, each) in zip(COLOURS, found.items(), strict=False):
        ordered = sorted(each, key=lambda trade: trade.actuation.mean)
        x, y = ([100.0 * getattr(trade, name).mean for trade in ordered] for name in ("actuation", "reduction"))
        width = [100.0 * trade.reduction.half_width for trade in ordered]
        ax.errorbar(x, y, yerr=width, color=colour, marker="o", markersize=4, capsize=2, label=label)
    for label, (added, taken) in (published or {}).items():
        ax.plot(100.0 * added, 100.0 * taken, color=INK, marker="D", linestyle="", label=label)
    ax.set_xlabel("share of the travel that full individual pitch adds [%]")
    ax.set_ylabel("[%]")
    ax.legend(loc="lower right")
    heading(ax, "Share of the load that full individual pitch takes")
    return figure


def trade_table(found: list[Trade], caption: str, note: str = "") -> Table:
    """Table of controllers, with what they trade."""
    rows = []
    for each in found:
        row = [each.name, with_interval(each.travel, 2), f"{with_interval(each.load, 1, '+', 100.0)} %"]
        rows.append([*row, *(f"{with_interval(x, 0, factor=100.0)} %" for x in (each.actuation, each.reduction))])
    head = ["control", "pitch travel over that of none", "RootMyc1 DEL", "share of the travel added"]
    return Table([*head, "share of the load taken"], rows, caption, note=note)


def over_lifetime(by_speed: dict[float, Comparison]) -> list[Trade]:
    """Trades of lifetime loads and travel, a lifetime for each seed."""
    speeds = list(by_speed)
    weights = rayleigh_weights(speeds, MEAN_WIND)

    def values(quantity: str, name: str) -> NDArray[np.float64]:
        each = np.array([c.values(quantity, name) for c in by_speed.values()])
        if quantity == "pitch travel":
            return np.asarray(np.average(each, axis=0, weights=weights))
        return np.array([lifetime_del(speeds, x, slope=BLADE_SLOPE, mean_speed=MEAN_WIND) for x in each.T])

    return trades(SimpleNamespace(schemes=next(iter(by_speed.values())).schemes, values=values))  # type: ignore[arg-type]


def verdict(found: list[Trade]) -> str:
    """The controller that adds nearest to half of the travel, beside what is published."""
    ((travel, load),) = PUBLISHED.values()
    near = min((each for each in found if each.name.startswith("l2")), key=lambda x: abs(x.actuation.mean - travel))
    inside = "inside" if near.reduction.low <= load <= near.reduction.high else "outside"
    added, taken = (with_interval(x, 0, factor=100.0) for x in (near.actuation, near.reduction))
    return (
        f"With {near.name.replace('l2', 'a limit of')} of $\\ell_2$ control adds "
        f"{added} % of the travel that full individual pitch adds, and takes {taken} % of the load that it takes; the "
        f"published {100 * load:.0f} % "
        f"at {100 * travel:.0f} % are {inside} this interval."
    )


def main(out: Path) -> None:
    """Simulate, and write tables and figure."""
    turbine = meltemi.load_turbine(TURBINE)
    model = meltemi.build(turbine)
    tuning = tune_ipc(model)
    plant = min(tuning.points, key=lambda point: abs(point.wind_speed - SPEED)).plant
    out.mkdir(parents=True, exist_ok=True)
    norms: tuple[Norm, ...] = ("l2", "linf")
    every = controllers(turbine, tuning.loop, plant, dict.fromkeys(norms, LIMITS))
    few = controllers(turbine, tuning.loop, plant, {"l2": LIMITS[:3]})
    with run_store(out, "constrained pitch", "meltemi.studies"):
        winds = [meltemi.TurbulentWind(seed=seed, **PAPER) for seed in SEEDS]
        c = compare(model, every, winds)
        by_speed = {
            u: compare(model, few, [ntm(u, seed=seed, wind_class="IB") for seed in SEEDS[::2]]) for u in LIFETIME_SPEEDS
        }
    found = trades(c)
    curves = {
        norm: [each for each in found if each.name in (NONE, FULL) or each.name.startswith(norm)] for norm in norms
    }
    save(plot_trades(curves, PUBLISHED), PICTURE)
    note = f"{', '.join(f'{u:g}' for u in by_speed)} m/s, class IB, {len(SEEDS) // 2} seeds, intervals over seeds."
    tables = [
        trade_table(found, f"{TURBINE} at {SPEED:g} m/s, {len(SEEDS)} seeds"),
        trade_table(over_lifetime(by_speed), f"{TURBINE}, lifetime, Rayleigh with {MEAN_WIND:g} m/s", note),
    ]
    text = PAGE.read_text(encoding="utf-8")
    begin, end = "<!-- tables -->", "<!-- end of tables -->"
    lines = [line for table in tables for line in (*table_lines(table), "")]
    made = "\n".join(["", "", verdict(found), "", *lines, ""])
    write_text(PAGE, text.partition(begin)[0] + begin + made + end + text.partition(end)[2])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
