"""Tables and figure of docs/guide/constrained-pitch.md.

    python tools/constrained_pitch.py

The first table is in the wind of the paper, the second over a lifetime in the turbine's class.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

import meltemi
from meltemi.controllers.tuning import tune_ipc
from meltemi.core.files import write_text
from meltemi.iec.winds import ntm
from meltemi.postprocess.ensemble import lifetime_del, rayleigh_weights
from meltemi.report.plots import save
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.reports.markdown import table_lines
from meltemi.studies.constrained_pitch import FULL, NONE, Norm, Trade, controllers, plot_trades, trades
from meltemi.tuning.compare import BLADE_SLOPE, Comparison, compare
from meltemi.tuning.run_store import run_store

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
