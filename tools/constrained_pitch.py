"""Tables and figure of docs/guide/constrained-pitch.md.

    python tools/constrained_pitch.py

The first table is in the wind of the paper, the second over a lifetime in the turbine's class. Runs that were finished
are kept in the folder given by ``--out`` until the end.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import meltemi
from meltemi.controllers.tuning import tune_ipc
from meltemi.core.files import write_text
from meltemi.postprocess.ensemble import ensemble_load, lifetime_del, rayleigh_weights
from meltemi.report.plots import save
from meltemi.wind.iec.winds import ntm
from meltemi_reports.blocks import Table
from meltemi_reports.ensemble_tables import with_interval
from meltemi_reports.markdown import table_lines
from meltemi_studies.constrained_pitch import FULL, NONE, Norm, Trade, controllers, plot_trades, trades
from meltemi_tuning.compare import BLADE_SLOPE, Comparison, compare
from meltemi_tuning.run_store import run_store

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


def trade_table(found: list[Trade], caption: str) -> Table:
    """Table of controllers in one wind."""
    rows = [
        [
            each.name,
            with_interval(each.travel, 2),
            f"{with_interval(each.load, 1, '+', 100.0)} %",
            *(f"{with_interval(x, 0, factor=100.0)} %" for x in (each.actuation, each.reduction)),
        ]
        for each in found
    ]
    head = ["control", "pitch travel over that of none", "RootMyc1 DEL", "share of the travel added"]
    return Table([*head, "share of the load taken"], rows, caption)


def lifetime_table(by_speed: dict[float, Comparison]) -> Table:
    """Table of lifetime loads and travel."""
    speeds, weights = list(by_speed), rayleigh_weights(list(by_speed), MEAN_WIND)
    load, travel = {}, {}
    for name in next(iter(by_speed.values())).schemes:
        each = [ensemble_load(c.values("RootMyc1 DEL", name), BLADE_SLOPE) for c in by_speed.values()]
        load[name] = lifetime_del(speeds, each, slope=BLADE_SLOPE, mean_speed=MEAN_WIND)
        travel[name] = float(
            np.average([c.values("pitch travel", name).mean() for c in by_speed.values()], weights=weights)
        )
    rows = []
    for name in load:
        shares = [100.0 * (x[name] - x[NONE]) / (x[FULL] - x[NONE]) for x in (travel, load)]
        change = 100.0 * (load[name] / load[NONE] - 1.0)
        row = [name, f"{np.degrees(travel[name]):.3f}", f"{travel[name] / travel[NONE]:.1f}", f"{change:+.1f} %"]
        rows.append([*row, *(f"{x:.0f} %" for x in shares)])
    head = ["control", "pitch travel deg/s", "over that of none", "RootMyc1 DEL", "share of the travel added"]
    note = f"Speeds: {', '.join(f'{u:g}' for u in speeds)} m/s, class IB, {len(SEEDS) // 2} seeds each."
    return Table([*head, "share of the load taken"], rows, f"Lifetime, Rayleigh with {MEAN_WIND:g} m/s", note=note)


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
    with run_store(out, "constrained pitch", "meltemi_studies"):
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
    tables = [trade_table(found, f"{turbine.name} at {SPEED:g} m/s, {len(SEEDS)} seeds"), lifetime_table(by_speed)]
    text = PAGE.read_text(encoding="utf-8")
    begin, end = "<!-- tables -->", "<!-- end of tables -->"
    made = "\n".join(["", *(line for table in tables for line in (*table_lines(table), "")), ""])
    write_text(PAGE, text.partition(begin)[0] + begin + made + end + text.partition(end)[2])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
