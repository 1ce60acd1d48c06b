"""``meltemi yaw-limits``: the yaw errors that load limits allow, and the supervisor's settings for them."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import meltemi
from meltemi.app.options import TurbineArgument, WorkOptions, load_aeroelastic, of_options, turbine_key
from meltemi.app.scans import angles_of, cells, finish, numbers_of, speeds_of
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, say, simulation_bar, suggest, write_results, wrote
from meltemi.core.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float = NDArray[np.float64]


def yaw_limits(
    turbine: TurbineArgument,
    work: WorkOptions,
    wind_class: Annotated[str, "--wind-class", "--class", "Class of IEC 61400-1."] = "IB",
    wind_speeds: Annotated[str | None, "Wind speeds [m/s], e.g. 5:25:5 [seven, cut-in to cut-out]."] = None,
    yaw_errors: Annotated[str, "Sizes of the yaw error [deg]; both signs are run."] = "0:75:15",
    load_limits: Annotated[
        str | None,
        "Limits [MN m, shear MN, clearance m], e.g. yaw-bearing-bending=18,tip-clearance=4 "
        "[those of extreme turbulence].",
    ] = None,
    allowance: Annotated[
        float, "Factor on the loads of extreme turbulence where no limits are given.", Range(0.1, 100)
    ] = 1.1,
    strategy: Annotated[str, "Beyond the threshold: derate, stop, ignore."] = "derate",
    recheck: Annotated[float, "Time after which a derated turbine looks again [s]."] = 90.0,
    seeds: Annotated[int, "Number of wind fields.", Range(1, 1000)] = 2,
    duration: Annotated[float, "Judged time of each run [s], after 30 s.", Range(10, 1e5)] = 150.0,
    out: OutOption = Path("out"),
) -> None:
    """Find the yaw errors that load limits allow over wind speed: table, plot, a case with these settings."""
    from meltemi.core.yamlfile import write_record
    from meltemi.iec.classes import as_class

    described = load_aeroelastic(turbine, "meltemi yaw-limits")
    as_class(wind_class, None)
    speeds = None if wind_speeds is None else _ascending("--wind-speeds", speeds_of(wind_speeds))
    errors = _ascending("--yaw-errors", [radians(angle) for angle in angles_of(yaw_errors, "--yaw-errors")])
    from meltemi.studies import yaw_limits as study
    from meltemi.tuning.run_store import run_store

    limit = None if load_limits is None else _limits(load_limits)
    settings = {"strategy": strategy, "recheck_time": recheck}
    of_options(settings, meltemi.control.YawProtection, "--strategy, --recheck")
    model = meltemi.build(described, meltemi.ModelOptions(yaw="held"))
    with (
        run_store(out, repr(("yaw-limits", described.content_hash())), **work.divided()) as book,
        simulation_bar("yaw limits") as progress,
    ):
        limits = study.find_limits(
            model, range(1, seeds + 1), wind_class=wind_class, speeds=speeds, errors=errors, limit=limit,
            allowance=allowance, length=duration, workers=work.workers, progress=progress,
        )  # fmt: skip
        failed = dict(book.failed)
    head, rows = study.limit_rows(limits)
    print_table(f"{described.name}: largest load over its limit, over the yaw error", head, rows)
    print(f"limits: {study.limit_words(limits)}")
    least, *_, most = np.degrees(limits.errors)
    if free := _listed(limits.speeds[limits.use.max(axis=1) <= 1.0]):
        print(f"no limit is reached at {free} m/s: {most:g} deg is the largest of --yaw-errors")
    if over := _listed(limits.speeds[limits.use[:, 0] > 1.0]):
        say(f"warning: at {over} m/s loads exceed their limits at {least:g} deg already: no yaw error is allowed")
    case = _case(turbine_key(turbine), described.cut_out, *limits.base_points, settings)
    write_record(of_options(case, meltemi.io.LoadCase, "yaw_limits.yaml"), out / "yaw_limits.yaml")
    wrote(*write_results(out / "yaw_limits", (head, rows), study.plot_limits(limits)), out / "yaw_limits.yaml")
    suggest("run", out / "yaw_limits.yaml", "--out", out / "run")
    finish(cells(failed))


def _listed(speeds: Float) -> str:
    return ", ".join(f"{v:g}" for v in speeds)


def _ascending(option: str, values: list[float]) -> list[float]:
    if len(values) < 2 or values != sorted(set(values)) or values[0] < 0.0:
        raise InputError(f"{option}: expected at least two increasing values, none of them negative")
    return values


def _case(turbine: str, cut_out: float, speeds: Float, thresholds: Float, settings: dict[str, Any]) -> dict[str, Any]:
    """A case with these base points, in the gust with direction change that does not exceed the cut-out wind speed.

    It begins at the highest of their wind speeds from which that is so, at the lowest if there is none.
    """
    from meltemi.iec.gusts import COHERENT_GUST

    speed = max((v for v in speeds if v + COHERENT_GUST <= cut_out), default=speeds[0])
    protection = settings | {"wind_speeds": speeds.tolist(), "thresholds": thresholds.round(4).tolist()}
    return {
        "turbine": turbine,
        "wind": {"kind": "iec", "model": "ECD", "speed": float(speed), "begin": 20.0},
        "duration": 200.0,
        "options": {"yaw": "driven"},
        "controller": {"kind": "supervised", "yaw": {}, "protection": protection},
    }


def _limits(text: str) -> dict[str, float]:
    """Load limits by name from name=number, separated by commas."""
    from meltemi.studies.yaw_limits import UNITS

    names = {name.replace(" ", "-"): name for name in UNITS}
    values = numbers_of(text, "--load-limits", "name=number")
    for name, value in values.items():
        if name not in names:
            raise InputError(f"--load-limits: no load {name!r}: {did_you_mean(name, names)}")
        if not 0.0 < value < float("inf"):
            raise InputError(f"--load-limits {name}={value:g}: expected a positive number")
    return {names[name]: value for name, value in values.items()}
