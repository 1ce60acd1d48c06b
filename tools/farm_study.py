"""Derating and wake steering in a row of three and a farm of 3 x 3: power and fatigue loads by turbine.

    python tools/farm_study.py OUT [--quick]

writes ``runs.csv`` (a row a run and turbine; runs that it has are not repeated) and ``tables.md``, the tables of
``docs/verification/farm-control.md``. NREL 5 MW, six seeds of the row and four of the farm, 600 s after 240 s; about
20 minutes of a core, seed by seed.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

import meltemi
from meltemi.control import Droop, PowerControl, PowerController
from meltemi.loads.loadbase.weights import Weibull
from meltemi.postprocess.fatigue import equivalent_loads

D = 126.0
LOADS = {
    "root_moment_out_of_plane_1": "blade root out of plane",
    "tower_base_moment_fore_aft": "tower base fore-aft",
    "yaw_moment_z": "yaw bearing torsion",
}
SLOPES = (10.0, 4.0, 4.0)
SPEEDS = {7.0: (6.0, 8.0), 9.0: (8.0, 10.5), 12.0: (10.5, 13.5)}
"""[m/s] of the runs, and the bins that each stands for."""
WEIBULL = Weibull(9.6, 2.0)
SEEDS = {"row": 6, "farm": 4}
INTENSITY = 0.08
RESERVE = 0.1
TRANSIENT = 240.0
"""[s] left out: set-points act on the last turbine after the wind has passed the row."""
STUDENT = {2: 12.71, 3: 4.303, 4: 3.182, 5: 2.776, 6: 2.571}
"""95 % quantile of the t distribution by the number of seeds."""
LAYOUTS = {
    "row": [(5.0 * D * i, 0.0) for i in range(3)],
    "farm": [(5.0 * D * i, 3.0 * D * j) for j in range(3) for i in range(3)],
}
STRATEGIES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "plain": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "derated": ((0.0, 0.0, 0.0), (RESERVE, 0.0, 0.0)),
    "steered": ((20.0, 15.0, 0.0), (0.0, 0.0, 0.0)),
}
"""Yaw angles [deg] and shares of the available power that are kept, by place along the wind."""
HEAD = ["layout", "speed", "seed", "strategy", "turbine", "power", *LOADS]


def simulated(layout: str, speed: float, seed: int, strategy: str, model: Any, performance: Any, seconds: float) -> Any:
    """Rows of one run."""
    positions, (yaw, reserve) = LAYOUTS[layout], STRATEGIES[strategy]
    places = [round(x / (5.0 * D)) for x, _ in positions]
    controllers = [
        PowerController(model.turbine, performance, PowerControl(droop=Droop(reserve=reserve[i]))) for i in places
    ]
    result = meltemi.simulate_farm(
        meltemi.Farm(model, positions, yaw=[math.radians(yaw[i]) for i in places]),
        meltemi.TurbulentWind(speed=speed, intensity=INTENSITY, seed=seed),
        duration=seconds + TRANSIENT,
        transient=TRANSIENT,
        controllers=controllers,
        channels=("generator_power", *LOADS),
        threads=1,
    )
    for i, each in enumerate(result.turbines):
        loads = equivalent_loads(each.evaluated, list(LOADS))
        power = float(each.evaluated["generator_power"].mean())
        yield [layout, speed, seed, strategy, i + 1, power, *(loads[name] for name in LOADS)]


def mean(changes: Iterable[float]) -> str:
    """Mean of changes [%] over seeds, and half of its interval of 95 %."""
    x = np.array(list(changes))
    wide = STUDENT.get(len(x), 2.0) * x.std(ddof=1) / math.sqrt(len(x)) if len(x) > 1 else math.nan
    return f"{x.mean():+.1f} ± {wide:.1f}"


def tables(rows: list[dict[str, Any]]) -> str:
    """Markdown of all tables."""
    value = {(r["layout"], r["speed"], r["seed"], r["strategy"], r["turbine"]): r for r in rows}
    text = []
    for layout, speeds in (("row", SPEEDS), ("farm", {9.0: SPEEDS[9.0]})):
        n = len(LAYOUTS[layout])
        shares = {v: WEIBULL.between(*ends) for v, ends in speeds.items()}
        seeds = sorted({r["seed"] for r in rows if r["layout"] == layout})

        def lifetime(seed: int, strategy: str, turbine: int, name: str, slope: float) -> float:
            total = sum(w * value[layout, v, seed, strategy, turbine][name] ** slope for v, w in shares.items())  # noqa: B023
            return float(total ** (1.0 / slope))

        columns = {"power": 1.0} | dict(zip(LOADS, SLOPES, strict=True))
        text += [f"\n{layout}: change in %, mean over seeds and 95 % interval\n"]
        text += [f"| strategy | turbine | power | {' | '.join(LOADS.values())} |", "|---|---|---|---|---|---|"]
        for strategy in list(STRATEGIES)[1:]:
            for turbine in range(1, n + 1):
                cells = [
                    mean(
                        100.0 * (lifetime(s, strategy, turbine, c, m) / lifetime(s, "plain", turbine, c, m) - 1.0)
                        for s in seeds
                    )
                    for c, m in columns.items()
                ]
                text.append(f"| {strategy} | T{turbine} | {' | '.join(cells)} |")

            def whole(seed: int, which: str) -> float:
                return sum(lifetime(seed, which, t, "power", 1.0) for t in range(1, n + 1))  # noqa: B023

            change = mean(100.0 * (whole(s, strategy) / whole(s, "plain") - 1.0) for s in seeds)
            text.append(f"| {strategy} | all | {change} | | | |")
        text += [
            "\n| turbine, plain | power kW | blade root MN m | tower base MN m | yaw bearing MN m |",
            "|---|---|---|---|---|",
        ]
        for turbine in range(1, n + 1):
            cells = [float(np.mean([lifetime(s, "plain", turbine, c, m) for s in seeds])) for c, m in columns.items()]
            power = cells[0] / sum(shares.values()) * 1e-3
            text.append(f"| T{turbine} | {power:.0f} | {' | '.join(f'{c * 1e-6:.2f}' for c in cells[1:])} |")
    return "\n".join(text) + "\n"


def main() -> None:
    """Run what is missing, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true", help="two seeds, 60 s")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    path, seconds = given.out / "runs.csv", 60.0 if given.quick else 600.0
    seeds = range(1, 3 if given.quick else max(SEEDS.values()) + 1)
    turbine = meltemi.load_turbine("nrel5mw")
    model, performance = meltemi.build(turbine), meltemi.analysis.performance_of(turbine)
    if not path.exists():
        path.write_text(",".join(HEAD) + "\n")
    done = {(r["layout"], float(r["speed"]), int(r["seed"]), r["strategy"]) for r in csv.DictReader(path.open())}
    runs = [("row", v) for v in SPEEDS] + [("farm", 9.0)]
    for key in ((layout, v, s, k) for s in seeds for layout, v in runs for k in STRATEGIES):
        if key not in done and key[2] <= SEEDS[key[0]]:
            found = list(simulated(*key, model, performance, seconds))
            with path.open("a", newline="") as file:
                csv.writer(file).writerows(found)
            print(*key, flush=True)
    kinds: dict[str, Any] = {"layout": str, "strategy": str, "seed": int, "turbine": int}
    rows = [{k: kinds.get(k, float)(v) for k, v in row.items()} for row in csv.DictReader(path.open())]
    (given.out / "tables.md").write_text(tables(rows))


if __name__ == "__main__":
    main()
