"""A farm in all winds of a rose: mean power, energy, wake losses and lifetime loads of each turbine.

The work is a list of pieces of a batch, one for each direction, speed and seed. A piece can be called again, in any
process that sees the folder: it reads what it has finished before, and otherwise simulates the farm with and without
wakes and writes a table of turbines. What identifies it is in the name of its file.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.cases.case import case_turbine
from meltemi.core.errors import InputError
from meltemi.core.files import write_text
from meltemi.core.fingerprint import fingerprint
from meltemi.core.stores import code_identity
from meltemi.farm.layout import FarmCase
from meltemi.farm.report import CHANNELS, LOADS, along_wind
from meltemi.farm.rose import WindRose, farm_direction
from meltemi.farm.simulation import FarmResult, simulate_case
from meltemi.loadcases.batch import Batch, Piece
from meltemi.postprocess.fatigue import equivalent_loads

Float = NDArray[np.float64]
FOLDER = "pieces"
"""Folder of finished pieces in the output folder."""
SLOPES = {name: 10.0 if name.startswith("root") else 4.0 for name in LOADS}
"""Slopes of the S-N curves: blades, steel."""
HOURS = 8760.0
"""[h] of a year, the convention of energy yields."""
VALUES = {"power": "W", "power_no_wakes": "W", "wind_speed": "m/s"} | dict.fromkeys(LOADS, "N m")
"""Quantities of a piece by turbine, and their units: mean powers and wind speed, equivalent loads."""


@dataclass(frozen=True)
class RosePiece(Piece):
    """A farm in one wind, whose ``work`` returns values by turbine, a list for each of :data:`VALUES`.

    Attributes:
      bin: indices of direction and speed in the rose.
      file: that has the values once they are known.
    """

    bin: tuple[int, int] = (0, 0)
    file: Path = Path()


def rose_pieces(case: FarmCase, folder: Path, rose: WindRose, seeds: int, out: Path) -> list[RosePiece]:
    """The pieces of a farm in a rose, the most probable bins first; below cut-in and above cut-out there are none.

    Args:
      case: farm; its wind becomes a turbulent one of each direction and speed.
      folder: to which the paths of the case are relative.
      rose: probabilities; with its turbulence intensity, otherwise that of the wind of the case.
      seeds: number of seeds in each bin; a seed is the same field in all directions and speeds.
      out: output folder.
    """
    code, turbine, pieces = code_identity("meltemi.farm"), case_turbine(case, folder), list[RosePiece]()
    case = case.replace(channels=list(CHANNELS), view=False)
    for i, j in sorted(rose.bins(), key=lambda each: -rose.probability[each]):
        direction, speed = float(rose.directions[i]), float(rose.speeds[j])
        if not turbine.cut_in <= speed <= turbine.cut_out:
            continue
        intensity = getattr(case.wind, "intensity", None) if rose.intensity is None else float(rose.intensity[i, j])
        if intensity is None:
            raise InputError("farm: a wind rose needs a turbulence intensity: of the rose, or of a turbulent wind")
        for seed in range(1, seeds + 1):
            wind = {"kind": "turbulence", "speed": speed, "intensity": intensity, "seed": seed}
            one = case.replace(wind=wind | {"direction": farm_direction(direction)})
            key = fingerprint(code, one.model_dump_json(), str(folder.resolve()))
            name = f"{direction:g} deg, {speed:g} m/s, seed {seed}"
            file = out / FOLDER / f"wd{direction:g}-ws{speed:g}-seed{seed}-{str(key)[:16]}.json"
            pieces.append(RosePiece(name, partial(finished, one, folder, file), bin=(i, j), file=file))
    return pieces


def finished(case: FarmCase, folder: Path, file: Path) -> dict[str, list[float]]:
    """Values of a farm in one wind by turbine: those of its file, or those of runs, which are then written there."""
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        values = {name: [float(x) for x in kept[name]] for name in VALUES}
        if all(len(each) == len(case.positions) for each in values.values()):
            return values
    except (OSError, ValueError, KeyError, TypeError):
        pass  # it is missing, or damaged
    result = simulate_case(case, folder)
    bare = result if case.wakes.model == "none" else simulate_case(case.replace(wakes={"model": "none"}), folder)
    values = values_of(result, bare)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(file, json.dumps(values))
    return values


def values_of(result: FarmResult, bare: FarmResult) -> dict[str, list[float]]:
    """Lists by turbine of :data:`VALUES`, of a farm with wakes and without."""
    turbines = [along_wind(each.evaluated, result.direction) for each in result.turbines]
    loads = [equivalent_loads(each, tuple(LOADS)) for each in turbines]
    return {
        "power": [float(each["generator_power"].mean()) for each in turbines],
        "power_no_wakes": [float(each.evaluated["generator_power"].mean()) for each in bare.turbines],
        "wind_speed": [float(each["wind_x"].mean()) for each in turbines],
    } | {name: [each[name] for each in loads] for name in LOADS}


@dataclass(frozen=True)
class RoseResult:
    """Power and loads of the turbines of a farm in a wind rose.

    Attributes:
      rose: the wind rose.
      values: (turbines, wd, ws) means over the seeds of each of :data:`VALUES`: of loads those of equal damage. NaN in
        bins without probability, or where all seeds failed.
      failed: reason by piece that failed.
    """

    rose: WindRose
    values: dict[str, Float]
    failed: dict[str, str]

    @property
    def weights(self) -> Float:
        """(wd, ws) probabilities of the bins with results."""
        return np.where(np.isfinite(self.values["power"]).all(axis=0), self.rose.probability, 0.0)

    def mean(self, name: str) -> Float:
        """(turbines,) mean of a power [W] over the year; nothing in winds that are not in the rose."""
        return np.asarray((np.nan_to_num(self.values[name]) * self.weights).sum(axis=(1, 2)))

    def lifetime(self, name: str) -> Float:
        """(turbines,) equivalent load [N m] of a life, at 1 Hz over all of its time."""
        m = SLOPES[name]
        return np.asarray((np.nan_to_num(self.values[name]) ** m * self.weights).sum(axis=(1, 2)) ** (1.0 / m))

    def by_sector(self, name: str) -> tuple[Float, Float]:
        """(turbines, wd) equivalent load [N m] while the wind is from a sector, and the sector's share of damage."""
        m = SLOPES[name]
        damage = (np.nan_to_num(self.values[name]) ** m * self.weights).sum(axis=2)
        time, whole = self.weights.sum(axis=1), damage.sum(axis=1, keepdims=True)
        loads = (damage / np.where(time > 0.0, time, np.inf)) ** (1.0 / m)
        return loads, damage / np.where(whole > 0.0, whole, np.inf)


def simulate_rose(
    pieces: Sequence[RosePiece],
    rose: WindRose,
    turbines: int,
    progress: Callable[[float], None] | None = None,
    shard: tuple[int, int] = (1, 1),
    dask: str | None = None,
) -> RoseResult:
    """Call all pieces, and weigh their values; a piece that fails is entered with its reason, and the others go on.

    Args:
      pieces: of :func:`rose_pieces`.
      rose: the wind rose.
      turbines: number of turbines.
      progress: callback with the completed fraction.
      shard, dask: as of :class:`~meltemi.loadcases.batch.Batch`; a farm occupies all cores of a machine.

    Raises:
      KeyboardInterrupt: Ctrl-C; finished pieces are kept.
    """
    batch = Batch(pieces, workers=1, progress=progress, shard=shard, dask=dask)
    outcomes = batch.run()
    if batch.interrupted:
        raise KeyboardInterrupt
    bins = {piece.name: piece.bin for piece in pieces}
    found: dict[tuple[int, int], list[dict[str, list[float]]]] = {}
    failed = {outcome.name: outcome.message for outcome in outcomes if not outcome.ok}
    for outcome in outcomes:
        if outcome.ok:
            found.setdefault(bins[outcome.name], []).append(outcome.value)
    values = {name: np.full((turbines, *rose.probability.shape), np.nan) for name in VALUES}
    for (i, j), seeds in found.items():
        for name, table in values.items():
            each, m = np.array([one[name] for one in seeds]), SLOPES.get(name, 1.0)
            table[:, i, j] = np.mean(each**m, axis=0) ** (1.0 / m)
    return RoseResult(rose, values, failed)


def long_rows(result: RoseResult) -> tuple[list[str], list[list[Any]]]:
    """Header and rows by direction, speed and turbine."""
    head = ["wd", "ws", "turbine", "probability", *(f"{name} [{unit}]" for name, unit in VALUES.items())]
    rows: list[list[Any]] = []
    for i, j in result.rose.bins():
        where = float(result.rose.directions[i]), float(result.rose.speeds[j])
        for k in range(len(result.values["power"])):
            numbers = [float(result.values[name][k, i, j]) for name in VALUES]
            rows.append([*where, k + 1, float(result.rose.probability[i, j]), *numbers])
    return head, rows


def turbine_rows(result: RoseResult) -> tuple[list[str], list[list[Any]]]:
    """Header and rows by turbine, and of the farm: mean power, annual energy with and without wakes, lifetime loads."""
    head = ["turbine", "power [W]", "AEP [MWh]", "AEP without wakes [MWh]", "wake loss [%]"]
    head += [f"{name} lifetime DEL [N m]" for name in LOADS]
    power, free = result.mean("power"), result.mean("power_no_wakes")
    loads = np.array([result.lifetime(name) for name in LOADS])
    rows = [[f"T{k + 1}", *_energy(power[k], free[k]), *map(float, loads[:, k])] for k in range(len(power))]
    return head, [*rows, ["farm", *_energy(power.sum(), free.sum()), *[""] * len(LOADS)]]


def _energy(power: float, free: float) -> list[float]:
    loss = 100.0 * (1.0 - power / free) if free > 0.0 else 0.0
    return [float(power), float(power * HOURS * 1e-6), float(free * HOURS * 1e-6), float(loss)]


def sector_rows(result: RoseResult) -> tuple[list[str], list[list[Any]]]:
    """Header and rows by turbine and sector: probability, equivalent loads, shares in the damage of a life."""
    head, by = ["turbine", "wd", "probability"], {name: result.by_sector(name) for name in LOADS}
    head += [f"{name} {what}" for name in LOADS for what in ("DEL [N m]", "share of damage")]
    time = result.weights.sum(axis=1)
    rows: list[list[Any]] = []
    for k in range(len(result.values["power"])):
        for i, direction in enumerate(result.rose.directions):
            cells = [float(each[k, i]) for both in by.values() for each in both]
            rows.append([k + 1, float(direction), float(time[i]), *cells])
    return head, rows
