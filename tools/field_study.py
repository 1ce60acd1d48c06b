"""The V27 of the SWiFT site in eleven ten-minute records against its simulations, and experiments on the deviations.

    python tools/field_study.py

writes ``docs/verification/field.csv``: measured statistics and those of every seed, of which ``tools/field_page.py``
makes tables and figures; about 15 minutes of two cores. Records and deck lie in ``../shared/reference/swift_v27``
beside the repository.
"""

from __future__ import annotations

import csv
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from comparisons.swift import map_of_the_guide, write_folder
from meltemi.cases.case import read_case
from meltemi.simulation.result import Result
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.measurements import MeasuredRecord, read_measurements
from meltemi.validation.reduction import STATISTICS, ReducedRecord, like
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import Prepared, Simulator, compared_channels, simulate_records

SWIFT = ROOT.parent / "shared/reference/swift_v27"
TABLE = ROOT / "docs/verification/field.csv"
SEEDS = 5
CONDITIONS = {
    "neutral_*": {"air_density": 1.02, "shear_exponent": 0.14},
    "stable_*": {"air_density": 1.06, "shear_exponent": 0.50},
    "unstable_*": {"air_density": 1.09, "shear_exponent": 0.14},
}
"""Of the benchmarks (README of the records)."""
POWER, TORQUE, SPEED, FLAP = "generator_power", "generator_torque", "rotor_speed", "root_moment_flap_1"
WIND = "u_32m"
SHOWN = ("mean", "std", "DEL, m = 10")
RPM = math.pi / 30.0
REGION_2 = (700.0 * RPM, 1150.0 * RPM)
"""[rad/s] generator speeds of region 2, between the lowest speed and the bend of the torque near rated speed."""
REGION_3 = (1195.0 * RPM, 1230.0 * RPM)
"""[rad/s] generator speeds near rated speed."""
BLOCK, MOST_LAG = 50, 12
"""Samples of a block of 5 s; most blocks that wind and power are shifted."""


def simulator(folder: Path, seeds: int = SEEDS) -> tuple[Simulator, list[MeasuredRecord]]:
    """The deck as ``meltemi import`` reads it, and the records from files of CSV."""
    fst = SWIFT / "deck/OpenFAST_model/SNLV27_OF2.fst"
    command = [sys.executable, "-m", "meltemi", "import", str(fst), "--out", str(folder / "deck")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    (folder / "records").mkdir()
    write_folder(SWIFT / "records", folder / "records")
    channels = ChannelMap(**YAML(typ="safe").load(map_of_the_guide()))
    settings = Validation(
        case="deck/case.yaml", channels=channels, conditions=CONDITIONS, range_only=(FLAP,), seeds=seeds
    )
    case = folder / settings.case
    return Simulator.of(settings, read_case(case), case.parent), read_measurements(folder / "records", channels)


def drive(record: MeasuredRecord, ratio: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Power, torque and generator speed where all three are measured."""
    P, Q, w = (record[name].values for name in (POWER, TORQUE, SPEED))
    there = np.isfinite(P + Q + w)
    return P[there], Q[there], ratio * w[there]


def experiments(base: Simulator, records: Sequence[MeasuredRecord]) -> dict[str, tuple[Simulator, str]]:
    """Simulators, and patterns of the records that they repeat; none of their numbers is fitted to a deviation."""
    s, turbine, law = base.settings, base.turbine, base.turbine.control.torque
    P, Q, w = (np.concatenate(x) for x in zip(*(drive(r, turbine.drivetrain.gear_ratio) for r in records), strict=True))
    inside = (w > REGION_2[0]) & (w < REGION_2[1])
    factor = P[inside].sum() / (Q * w)[inside].sum() / turbine.drivetrain.generator_efficiency
    near = (w > REGION_3[0]) & (w < REGION_3[1])
    slope, level = np.polyfit(w[near], Q[near], 1)
    synchronous, rated = -level / slope, (law.maximum_torque - level) / slope
    print(f"torque x {factor:.4f}; near rated {slope * RPM:.2f} N m/rpm, slip {rated / synchronous - 1.0:.3f}")
    slip = {"slip": rated / synchronous - 1.0, "rated_speed": rated, "rated_power": law.maximum_torque * rated}
    low = np.percentile(w[w < REGION_2[0]], [1.0, 99.0])

    def torque(**keys: float) -> Simulator:
        return replace(base, turbine=turbine.replace(**{f"control.torque.{k}": x for k, x in keys.items()}), models={})

    def mast(**place: float) -> Simulator:
        dump = s.channels.model_dump()
        for name in (WIND, "v_32m", "w_32m"):
            dump["loggers"]["swift"]["channels"][name] |= place
        return replace(base, settings=s.replace(channels=ChannelMap(**dump)), models={})

    def wind(**keys: float) -> Simulator:
        return replace(base, settings=s.replace(turbulence=keys), models={})

    flat = {pattern: each.replace(shear_exponent=0.14) for pattern, each in s.conditions.items()}
    scaled = {name: factor * getattr(law, name) for name in ("optimal_gain", "maximum_torque", "rated_power")}
    return {
        "deck": (WithBlocks(s, base.case, base.folder, turbine), "*"),
        "torque": (torque(**scaled), "*"),
        "slip": (torque(**slip), "neutral_*"),
        "lowest speed": (torque(cut_in_speed=low[0], optimal_speed=low[1]), "stable_*"),
        "shear 0.14": (replace(base, settings=s.replace(conditions=flat), models={}), "stable_*"),
        "mast 20 m aside": (mast(lateral=20.0), "*"),
        "yaw 8 deg": (base.at(["yaw_error"], [math.radians(8.0)]), "*"),
        "17 points": (wind(points=17), "*_03.csv"),
        "dt 0.05 s": (wind(dt=0.05), "*_03.csv"),
        "mast at tower": (mast(upwind=0.0), "*"),
        "mast 10 m aside": (mast(lateral=10.0), "*"),
    }


class WithBlocks(Simulator):
    """A simulator that also correlates blocks of power and wind."""

    def reduced(self, prepared: Prepared, result: Result) -> ReducedRecord:
        reduced, record = super().reduced(prepared, result), prepared.record
        signals = like(result, prepared.signals, record.begin, self.settings.transient)
        pair = blocks(signals[POWER].values, record[WIND].values)
        return replace(reduced, values={**reduced.values, "blocks": np.array(pair)})


def blocks(power: np.ndarray, wind: np.ndarray) -> tuple[float, float]:
    """Largest correlation of blocks of power with those of the wind, and the lag [s] of the power."""
    n = len(power) // BLOCK
    there = [np.interp(np.arange(len(x)), np.flatnonzero(np.isfinite(x)), x[np.isfinite(x)]) for x in (power, wind)]
    p, u = (x[: n * BLOCK].reshape(n, BLOCK).mean(axis=1) for x in there)
    pairs = ((p[max(0, k) : n + min(0, k)], u[max(0, -k) : n - max(0, k)], 0.1 * BLOCK * k)
             for k in range(-MOST_LAG, MOST_LAG + 1))  # fmt: skip
    return max((float(np.corrcoef(a, b)[0, 1]), lag) for a, b, lag in pairs)


def run(folder: Path) -> Iterator[dict[str, Any]]:
    """Rows of the comparison, of its experiments, and of what the records say of drive and wind."""
    base, records = simulator(folder)
    names = compared_channels(base.settings)
    for name, (some, pattern) in experiments(base, records).items():
        compared, failed = simulate_records(some, [r for r in records if fnmatch(r.file, pattern)], names)
        print(name, failed, flush=True)
        for each in compared:
            for channel in each.measured.values:
                for statistic in SHOWN:
                    i = STATISTICS.index(statistic)
                    yield row(name, each.name, channel, statistic, each.measured.values[channel][i],
                              [k.values[channel][i] for k in each.simulated])  # fmt: skip
            if name == "deck":
                yield row(name, each.name, "wind", "mean", each.wind_speed)
                yield row(name, each.name, "wind", "turbulence", each.turbulence)
                record = next(r for r in records if r.name == each.name)
                measured = blocks(record[POWER].values, record[WIND].values)
                for i, statistic in enumerate(("correlation", "lag")):
                    yield row("blocks", each.name, POWER, statistic, measured[i],
                              [k.values["blocks"][i] for k in each.simulated])  # fmt: skip
    yield from drives(base, experiments(base, records)["slip"][0], records)


def drives(deck: Simulator, slope: Simulator, records: Sequence[MeasuredRecord]) -> Iterator[dict[str, Any]]:
    """Rows of what the records say of the drive, and of the laws of its torque near rated speed."""
    ratio = deck.turbine.drivetrain.gear_ratio
    yield row("drive", "deck", POWER, "efficiency", deck.turbine.drivetrain.generator_efficiency)
    for record in records:
        P, Q, w = drive(record, ratio)
        yield row("drive", record.file, POWER, "over torque and speed", P.sum() / (Q * w).sum())
        yield row("drive", record.file, TORQUE, "over speed squared", np.median(Q / w**2) * RPM**2)
    drawn = [drive(r, ratio) for r in records if r.file.startswith("neutral")]
    _, Q, w = (np.concatenate(x) for x in zip(*drawn, strict=True))
    for rpm in range(1125, 1235, 10):
        some = Q[abs(w / RPM - rpm) < 5.0]
        yield row("near rated", "neutral", TORQUE, str(rpm), some.mean(), [some.std()])
    for name, simulator in (("deck", deck), ("slope", slope)):
        law = simulator.turbine.control.torque
        synchronous = law.rated_speed / (1.0 + law.slip)
        for rpm in np.linspace(1125.0, 1245.0, 61):
            rise = (rpm * RPM - synchronous) / (law.rated_speed - synchronous) * law.maximum_torque
            yield row(
                "law",
                name,
                TORQUE,
                f"{rpm:.0f}",
                min(max(law.optimal_gain * (rpm * RPM) ** 2, rise), law.maximum_torque),
            )


def row(name: str, record: str, channel: str, statistic: str, measured: float, simulated: Sequence[float] = ()) -> Any:
    """A row of field.csv."""
    seeds = {f"seed {k + 1}": f"{x:.6g}" for k, x in enumerate(simulated)}
    head = {"experiment": name, "record": record.split(".csv")[0], "channel": channel, "statistic": statistic}
    return head | {"measured": f"{measured:.6g}"} | seeds


def main() -> None:
    """Write the file."""
    head = ["experiment", "record", "channel", "statistic", "measured", *(f"seed {k + 1}" for k in range(SEEDS))]
    with tempfile.TemporaryDirectory() as folder:
        rows = list(run(Path(folder)))
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, head, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
