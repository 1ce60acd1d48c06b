"""A surrogate campaign: turbine, variables and loads; its points as a table; its runs and their equivalent loads."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.cases.case import LoadCase
from meltemi.controllers.specification import BaselineCase, FixedCase, NamedCase, PowerCase
from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import replacing, text_of
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record, validated, write_record
from meltemi.loads.loadbase.engine import Execution, run_jobs
from meltemi.loads.loadbase.jobs import Job, case_key, names_by_key
from meltemi.loads.loadbase.store import ResultStore
from meltemi.loads.surrogate.space import UNITS, USUAL, Space, site_space, space_filling
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

Float = NDArray[np.float64]
FILE, DESIGN = "surrogate.yaml", "design.csv"
LOADS = {
    "root_moment_out_of_plane": 10.0,
    "root_moment_in_plane": 10.0,
    "tower_base_moment_fore_aft": 4.0,
    "tower_base_moment_side_side": 4.0,
    "shaft_tilt_moment": 4.0,
    "shaft_yaw_moment": 4.0,
    "rotor_torque": 4.0,
}
"""Default loads of a surrogate, with the slopes of their S-N curves."""
SETS = ("train", "check")
BLOCK = 4096
"""Number of cases that are prepared together, so that memory does not grow with the number of cases."""


class SurrogateCampaign(Record):
    """Description of a load surrogate, from which its points and runs follow."""

    turbine: str
    """Name in the library, or path of a turbine file."""
    variables: tuple[str, ...] = USUAL
    """Names of the site variables."""
    bounds: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Constant bounds by variable, in SI units, in place of the usual ones."""
    loads: dict[str, float] = Field(default_factory=lambda: dict(LOADS))
    """S-N slope by load. A load of the blade roots without number stands for all blades."""
    method: Literal["sobol", "latin"] = "sobol"
    """Space-filling design."""
    points: int = Field(default=256, ge=1, le=10_000_000)
    """Points of the fit, each with one seed, different from those of the others."""
    repeats: int = Field(default=16, ge=0)
    """Points of the fit that are repeated with other seeds, for the scatter."""
    checks: int = Field(default=32, ge=0)
    """Held-out points."""
    seeds: int = Field(default=6, ge=2, le=1000)
    """Seeds of repeated and held-out points."""
    realisation: int = Field(default=1, ge=1, le=1000)
    """Number of the realisation, from which points and seeds follow."""
    duration: float = Field(default=600.0, gt=0.0)
    """Evaluated duration [s; 30 to 4000]."""
    transient: float = Field(default=60.0, ge=0.0)
    """Initial transient [s; 10 to 2000], not evaluated."""
    controller: NamedCase = BaselineCase()
    """Controller, as in a case file; power control where ``power_reference`` is a variable."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Model options, as in a case file."""
    turbulence: dict[str, Any] = Field(default_factory=dict)
    """Settings of the turbulent winds: spectrum, points and so on, as in a case file."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if isinstance(self.controller, FixedCase):
            raise ValueError("controller: fixed holds torque and pitch and cannot produce")
        if self.options.get("nacelle_yaw"):
            raise ValueError("options.nacelle_yaw: yaw errors are directions of the wind, the variable yaw_error")
        if "power_reference" in self.variables and not isinstance(self.controller, PowerCase):
            raise ValueError("variables: power_reference needs controller: {kind: power}")
        if not self.loads or min(self.loads.values()) <= 0.0:
            raise ValueError("loads: name at least one, with a positive slope")
        if self.repeats > self.points:
            raise ValueError(f"repeats: {self.repeats} of {self.points} points")
        return self

    def space(self) -> Space:
        """Space of the variables.

        Raises:
          InputError: the turbine cannot be read, or a variable or bound is not valid.
        """
        t = aeroelastic(load_turbine(self.turbine), "meltemi surrogate")
        return site_space(
            hub_height=t.hub_height,
            rotor_radius=t.rotor_radius,
            cut_in=t.cut_in,
            cut_out=t.cut_out,
            rated_power=t.control.torque.rated_power,
            variables=self.variables,
            bounds=self.bounds,
        )

    def channels(self) -> dict[str, tuple[str, ...]]:
        """Channels of each load.

        Raises:
          InputError: the turbine has no such load.
        """
        from meltemi.loads.loadbase.interfaces import interfaces_of

        turbine = aeroelastic(load_turbine(self.turbine), "meltemi surrogate")
        single = {name for each in interfaces_of(turbine) for name in each.channels if "station" not in name}
        single |= {f"root_moment_{name}_{b}" for name in ("flap", "edge") for b in range(1, turbine.n_blades + 1)}
        known: dict[str, tuple[str, ...]] = {name: (name,) for name in sorted(single)}
        for name in sorted(single):
            if name.startswith("root_"):
                known[name[:-2]] = (*known.get(name[:-2], ()), name)
        for name in self.loads:
            if name not in known:
                raise InputError(f"loads: no load {name!r}: {did_you_mean(name, known)}")
        return {name: known[name] for name in self.loads}


@dataclass(frozen=True)
class SurrogateDesign:
    """Points of a campaign, one row for each run.

    Attributes:
      space: space of the variables.
      point: (n,) number of the point; its runs have the same values and different seeds.
      seed: (n,) seed of the turbulence.
      check: (n,) whether the point is held out.
      values: (n, d) values of the variables.
    """

    space: Space
    point: NDArray[np.int64]
    seed: NDArray[np.int64]
    check: NDArray[np.bool_]
    values: Float

    def __len__(self) -> int:
        return len(self.point)

    def part(self, rows: NDArray[np.bool_]) -> SurrogateDesign:
        """The design with some of its runs."""
        return SurrogateDesign(self.space, self.point[rows], self.seed[rows], self.check[rows], self.values[rows])

    def extended(self, values: Float, seeds: int = 1) -> SurrogateDesign:
        """The design with further points (k, d) of the fit, each with so many seeds."""
        k = len(values)
        return SurrogateDesign(
            self.space,
            np.concatenate([self.point, np.repeat(np.arange(k) + self.point.max() + 1, seeds)]),
            np.concatenate([self.seed, np.arange(k * seeds) + self.seed.max() + 1]),
            np.concatenate([self.check, np.zeros(k * seeds, dtype=bool)]),
            np.concatenate([self.values, np.repeat(values, seeds, axis=0)]),
        )


def surrogate_design(campaign: SurrogateCampaign) -> SurrogateDesign:
    """Points of a campaign; held-out ones are further points of the same sequence.

    Raises:
      InputError: as for :meth:`SurrogateCampaign.space`.
    """
    c, space, channels = campaign, campaign.space(), [name for names in campaign.channels().values() for name in names]
    ends = space.bounds(np.array(space.ends))
    for values in (ends[0].min(axis=0), ends[1].max(axis=0)):
        validated(_content(c, channels, dict(zip(space.names, values, strict=True))), LoadCase, "runs of the campaign")
    n = c.points + c.checks
    germ = space_filling(len(space.variables), n, c.method, seed=c.realisation)
    several = np.zeros(n, dtype=bool)
    several[: c.repeats] = several[c.points :] = True
    point = np.repeat(np.arange(n), np.where(several, c.seeds, 1))
    seed = 1_000_000_000 * c.realisation + np.arange(len(point))
    return SurrogateDesign(space, point, seed, point >= c.points, space.points(germ)[point])


def write_surrogate_campaign(campaign: SurrogateCampaign, design: SurrogateDesign, folder: Path) -> list[Path]:
    """Write ``surrogate.yaml`` and ``design.csv``.

    Raises:
      InputError: a file cannot be written.
    """
    lines = [",".join(["point", "set", "seed", *(f"{name} [{UNITS[name]}]" for name in design.space.names)])]
    for point, check, seed, row in zip(design.point, design.check, design.seed, design.values, strict=True):
        lines.append(",".join([str(point), SETS[int(check)], str(seed), *map(repr, row.tolist())]))
    with replacing(folder / FILE, folder / DESIGN) as (first, second):  # both or none
        second.write_text("\n".join(lines) + "\n", encoding="utf-8")
        write_record(campaign, first)
    return [folder / FILE, folder / DESIGN]


def read_surrogate_campaign(folder: str | Path) -> tuple[SurrogateCampaign, SurrogateDesign]:
    """Read a campaign and its points.

    Raises:
      InputError: there is no campaign, or a file is not valid.
    """
    folder = Path(folder)
    if not (folder / FILE).is_file():
        raise InputError(f"{folder}: no {FILE}; 'meltemi surrogate design TURBINE --out FOLDER' writes one")
    campaign = read_record(folder / FILE, SurrogateCampaign)
    space, path = campaign.space(), folder / DESIGN
    rows = csv.reader(StringIO(text_of(path), newline=None))
    head = ["point", "set", "seed", *(f"{name} [{UNITS[name]}]" for name in space.names)]
    point, seed, check, values = array("q"), array("q"), array("b"), array("d")
    good = next(rows, None) == head
    for number, row in enumerate(rows if good else (), 2):
        try:
            numbers = [float(x) for x in row[3:]]
            if len(row) != len(head) or not np.all(np.isfinite(numbers)):
                raise ValueError
            check.append(SETS.index(row[1]))
            point.append(int(row[0]))
            seed.append(int(row[2]))
            values.extend(numbers)
        except (ValueError, OverflowError, IndexError):
            raise InputError(
                f"{path}: line {number}: expected {len(head)} entries as in the head, set train or check"
            ) from None
    if not point:
        raise InputError(f"{path}: expected rows below the head {','.join(head)}")
    columns = np.array(point), np.array(seed), np.array(check, dtype=bool)
    return campaign, SurrogateDesign(space, *columns, np.array(values).reshape(len(point), -1))


@dataclass(frozen=True)
class SurrogateRun(Execution):
    """Runs of a surrogate.

    Attributes:
      folder: folder of the campaign; results are written to ``results`` in it.
    """

    folder: str | Path


@arguments_of(SurrogateRun)
def run_surrogate(run: SurrogateRun) -> tuple[int, int, int]:
    """Run the cases of a campaign that are missing; the arguments are the fields of :class:`SurrogateRun`.

    Returns:
      Numbers of runs with loads, of those that failed, and of those that are missing.

    Raises:
      InputError: as for ``run_base``.
    """
    campaign, design = read_surrogate_campaign(run.folder)
    store = ResultStore(run.folder)
    for block in _blocks(campaign, design):
        run_jobs(block, store, run)
    stored = [store.places.get(job.key) for block in _blocks(campaign, design) for job in block]
    complete = [place.status.complete for place in stored if place is not None]
    return sum(complete), len(complete) - sum(complete), len(stored) - len(complete)


def _blocks(campaign: SurrogateCampaign, design: SurrogateDesign) -> Iterator[list[Job]]:
    known: dict[str, str] = {}
    channels = campaign.channels()
    slopes = {channel: campaign.loads[load] for load, names in channels.items() for channel in names}
    for begin in range(0, len(design), BLOCK):
        block = []
        for row in range(begin, min(begin + BLOCK, len(design))):
            content = _content(campaign, list(slopes), dict(zip(design.space.names, design.values[row], strict=True)))
            content["wind"]["seed"] = int(design.seed[row])
            block.append(Job(f"run-{row:07d}", case_key(content, False, known, slopes), content, False, slopes))
        yield block


def _content(c: SurrogateCampaign, channels: Sequence[str], at: Mapping[str, float]) -> dict[str, Any]:
    """Content of a case file."""
    x = {name: float(value) for name, value in at.items()}
    wind = {"kind": "turbulence", "speed": x["speed"], "intensity": x.get("turbulence_intensity", 0.1)}
    names = {"shear_exponent": "shear_exponent", "inclination": "upflow", "yaw_error": "direction"}
    wind |= {key: x[name] for name, key in names.items() if name in x}
    path = Path(c.turbine)
    content: dict[str, Any] = {
        "turbine": str(path.absolute()) if path.is_file() else c.turbine,
        "wind": wind | c.turbulence,
        "duration": c.transient + c.duration,
        "transient": c.transient,
        "channels": [*channels, "generator_power"],
        "controller": c.controller.model_dump(mode="json", exclude_defaults=True) | {"kind": c.controller.kind},
    }
    content |= {"options": dict(c.options)} if c.options else {}
    if "air_density" in x:
        content["environment"] = {"air_density": x["air_density"]}
    if "power_reference" in x:
        content["grid"] = {"power_reference": x["power_reference"]}
    return content


def surrogate_loads(folder: str | Path) -> tuple[SurrogateCampaign, SurrogateDesign, Float]:
    """Equivalent loads of the completed runs of a campaign.

    Returns:
      the campaign, the points of these runs, and (n, L) equivalent loads at 1 Hz [N, N m]; over blades the range with
      their mean damage.

    Raises:
      InputError: there is no campaign, or no run of it.
    """
    campaign, design = read_surrogate_campaign(folder)
    channels, store = campaign.channels(), ResultStore(folder)
    jobs = [job for block in _blocks(campaign, design) for job in block]
    keys = names_by_key(job for job in jobs if job.key in store.places and store.places[job.key].status.complete)
    table = store.table(keys, "equivalent").astype({"case": str})
    ranges = table.pivot(index="case", columns="channel", values="range").reindex([job.name for job in jobs])
    loads = np.empty((len(design), len(channels)))
    for i, (load, names) in enumerate(channels.items()):
        m = campaign.loads[load]
        loads[:, i] = (ranges.reindex(columns=names) ** m).mean(axis=1, skipna=False) ** (1.0 / m)
    complete = np.all(np.isfinite(loads), axis=1)
    if not complete.any():
        raise InputError(f"{folder}: no results; 'meltemi surrogate run {folder}' computes them")
    return campaign, design.part(complete), loads[complete]
