"""``meltemi farm``: a farm from a file, or a row of turbines, with a table and a figure of the wake losses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import meltemi
from meltemi.app.options import (
    TURBINES,
    YAML,
    Options,
    controller_of,
    is_case,
    of_options,
    shard_of,
    turbine_key,
    wind_of_options,
)
from meltemi.app.scans import angles_of
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, warn, write_results, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.farm.layout import FarmCase
    from meltemi.farm.report import FarmComparison
    from meltemi.farm.rose_study import RoseResult
    from meltemi.farm.simulation import FarmResult

SPEED, INTENSITY, DURATION, TRANSIENT = 9.0, 0.1, 600.0, 30.0
WIND = {"--wind-speed": SPEED, "--turbulence": INTENSITY, "--seed": 1}
"""Wind of a row by default: below rated wind speed, where wakes cost power."""
DEL = "DEL: damage-equivalent load, 1 Hz, of the blade root out of plane (slope 10) and the tower base fore-aft (4)"


@dataclass(frozen=True)
class RowOptions(Options):
    """Options of a row, or of another layout; the file of a farm has all of them."""

    row: Annotated[int | None, "Turbines of a row, one behind the other [3]."] = None
    spacing: Annotated[float | None, "Between them, in rotor diameters [5]."] = None
    layout: Annotated[Path | None, "Positions of a FAST.Farm file (.fstf), windIO plant or FLORIS input (.yaml)."] = (
        None
    )
    wind_speed: Annotated[float | None, "Mean wind speed at hub height [m/s] [9]."] = None
    turbulence: Annotated[float | None, "Turbulence intensity [0.1]; 0 is a wind without turbulence."] = None
    wind_file: Annotated[Path | None, "Wind file in place of these: .bts, .wnd, .bin, .nc."] = None
    direction: Annotated[float | None, "Wind direction [deg], clockwise from above; turbines face it [0: along x]."] = (
        None
    )
    seed: Annotated[int | None, "Seed of the turbulence [1]."] = None
    duration: Annotated[float | None, "Duration of the simulation [s] [600]."] = None
    wakes: Annotated[str | None, "Constants: fast.farm, curled, iec, madsen, keck, none [fast.farm]."] = None
    added_turbulence: Annotated[
        bool | None, "--added-turbulence/--no-added-turbulence", "Small-scale turbulence that wakes add [yes]."
    ] = None
    yaw: Annotated[
        str | None, "Yaw of the turbines from the wind [deg], counter-clockwise from above, e.g. 20,0,0."
    ] = None


def farm(
    target: Annotated[str, "YAML file of a farm, or a turbine for a row of them.", TURBINES],
    options: RowOptions,
    against: Annotated[Path | None, "Another run to compare with: output folder of a farm, or the file of one."] = None,
    alone: Annotated[
        bool | None, "--alone/--no-alone", "Also simulate without wakes, to compare [unless --against]."
    ] = None,
    three_dimensional: Annotated[bool, "--view", "Also write the farm in three dimensions (HTML)."] = False,
    rose: Annotated[Path | None, "In all winds of a rose: FLORIS (.csv), windIO (.yaml), PyWake (.nc)."] = None,
    seeds: Annotated[int, "Seeds in each direction and speed of --rose.", Range(1, 1000)] = 1,
    shard: Annotated[str | None, "Of --rose only every N-th wind, beginning with the k-th: k/N, e.g. 3/16."] = None,
    dask: Annotated[str | None, "Where --rose runs: address of a Dask scheduler, or: local."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Simulate turbines in each other's wakes: power and loads by turbine, and the losses due to wakes."""
    given = options.given()
    case, folder = _case_of(target, given)
    if rose is not None:
        suggest("farm", target, *_words(given), "--out", f"{out}-one")  # figure and series of one wind
        if not _rose(case, folder.resolve(), rose, seeds, out, shard_of(shard), dask):
            suggest("farm", target, *_words(given), "--rose", rose, "--seeds", seeds, "--out", out)
        return
    if shard is not None or dask is not None:
        raise InputError("--shard and --dask divide the winds of --rose FILE: give a wind rose, or leave them out")
    if three_dimensional:
        case = case.replace(view=True)
    other = None if against is None else _other(against, len(case.positions))
    runs = [(case, folder)]
    if case.wakes.model != "none" and (against is None if alone is None else alone):
        runs.append((case.replace(wakes={"model": "none"}, view=False), folder))
    bare = len(runs) > 1
    if isinstance(other, tuple):
        runs.append(other)
    results = _simulated(runs)
    files = _report(results[0], results[1] if bare else None, case, out)
    if other is not None:
        files += _compare(results[0], results[-1] if isinstance(other, tuple) else other, str(against), out)
    if Path(target).resolve() != (out / "farm.yaml").resolve():
        from meltemi.cases.case import self_contained
        from meltemi.core.yamlfile import write_record

        write_record(self_contained(case, folder), out / "farm.yaml")
        files.append(out / "farm.yaml")
    wrote(*files)
    suggest(*_next(case, target, given, out))
    for i, each in enumerate(results[0].turbines):
        warn((*each.warnings, *each.findings), f"T{i + 1}")
    if any(each.findings for each in results[0].turbines):
        raise typer.Exit(1)


def _case_of(target: str, given: dict[str, Any]) -> tuple[FarmCase, Path]:
    """The farm of a file, or a row by options, and the folder to which its paths are relative."""
    from meltemi.core.yamlfile import read_record
    from meltemi.farm.layout import FarmCase

    path = Path(target)
    if is_case(path) or (path.suffix in YAML and not path.exists()):
        if given:
            words = ", ".join(word for word in map(str, _words(given)) if word.startswith("--"))
            raise InputError(f"{path} is the file of a farm, which defines the run; remove {words}")
        return read_record(path, FarmCase), path.parent
    return _row_case(target, given), Path()


def _other(path: Path, count: int) -> FarmResult | tuple[FarmCase, Path]:
    """The reference run: results in a folder, or a farm file, which is simulated.

    Raises:
      InputError: the path is neither, or the numbers of turbines differ.
    """
    from meltemi.core.yamlfile import read_record
    from meltemi.farm.layout import FarmCase
    from meltemi.farm.report import check_counts
    from meltemi.farm.stored import read_farm

    if path.is_dir():
        stored = read_farm(path)
        check_counts(count, len(stored), f"--against {path}")
        return stored
    if not (path.suffix in YAML and path.is_file()):
        raise InputError(f"--against {path}: expected the output folder of meltemi farm, or the file of a farm (.yaml)")
    case = read_record(path, FarmCase)
    check_counts(count, len(case.positions), f"--against {path}")
    return case.replace(view=False), path.parent


def _rose(
    case: FarmCase, folder: Path, file: Path, seeds: int, out: Path, shard: tuple[int, int], dask: str | None
) -> bool:
    """Simulate a farm in all winds of a rose; print and write energy and loads, or return that winds are missing."""
    from meltemi.farm.rose import read_rose
    from meltemi.farm.rose_study import long_rows, rose_pieces, sector_rows, simulate_rose, turbine_rows
    from meltemi.report.tables import write_csv

    rose = read_rose(file)
    pieces = rose_pieces(case, folder, rose, seeds, out.resolve())
    hours = len(pieces) * case.duration / 3600.0
    with simulation_bar(f"{len(pieces)} winds of {file}", hours, "h") as progress:
        result = simulate_rose(pieces, rose, len(case.positions), progress, shard, dask)
    if others := sum(not piece.file.is_file() for piece in pieces) - len(result.failed):
        print(f"{others} of {len(pieces)} winds are those of other shards, and not finished: no tables yet")
        _warn_failed(result)
        return False
    if shard != (1, 1):
        result = simulate_rose(pieces, rose, len(case.positions))  # reads what all shards have written
    head, rows = turbine_rows(result)
    cells = [[each if isinstance(each, str) else f"{each:.4g}" for each in row] for row in rows]
    print_table(f"{case.turbine}, {case.wakes.words}: a year in {file.name}", head[:5], [row[:5] for row in cells])
    print(f"probability of the winds with results: {result.weights.sum():.4g} of {rose.probability.sum():.4g}")
    tables = {"turbines": (head, rows), "rose": long_rows(result), "sectors": sector_rows(result)}
    wrote(*(write_csv(out / f"{name}.csv", *table) for name, table in tables.items()))
    _warn_failed(result)
    return True


def _warn_failed(result: RoseResult) -> None:
    warn([f"{name}: {why}" for name, why in result.failed.items()])
    if result.failed:
        raise typer.Exit(1)


def _report(result: FarmResult, before: FarmResult | None, case: FarmCase, out: Path) -> list[Path]:
    """Print and write the effects of the wakes; return the files."""
    from meltemi.farm.report import SHOWN, cost_rows
    from meltemi.farm.stored import write_farm

    head, rows = cost_rows(result, before)
    label = f"{case.turbine}, {case.wakes.words}: {result[0].meta['wind']}"
    print_table(label, *cost_rows(result, before, SHOWN), all_rows=(head, rows))
    print(f"{DEL}; %: change by the wakes" if before else DEL)
    figure = meltemi.plots.plot_farm(result, before, label)
    files = [*write_farm(result, out), *write_results(out / "farm", (head, rows), figure)]
    if case.view:
        results = {f"T{i + 1}": each for i, each in enumerate(result.turbines)}
        files.append(meltemi.plots.view(results).write(out / "farm.html"))
    return files


def _compare(result: FarmResult, other: FarmResult, name: str, out: Path) -> list[Path]:
    """Print and write the gain in power over another run and the change in loads; return the files."""
    from meltemi.farm.report import compare_farms, comparison_rows, differences, plot_comparison

    comparison: FarmComparison = compare_farms(result, other)
    label = f"change against {name}"
    print_table(label, *comparison_rows(comparison, values=False), all_rows=comparison_rows(comparison))
    print(f"%: change of mean power and of equivalent loads. {comparison.words()}")
    print(f"differs from {name} in: {', '.join(differences(result, other)) or 'nothing'}")
    return write_results(out / "against", comparison_rows(comparison), plot_comparison(comparison, label))


def _row_case(target: str, given: dict[str, Any]) -> FarmCase:
    """A row of turbines, one behind the other."""
    from meltemi.farm.layout import FarmCase
    from meltemi.farm.report import CHANNELS

    positions, settings = _positions(given, meltemi.load_turbine(target).rotor_diameter)
    wind: dict[str, Any] = {} if "--wind-file" in given else dict(WIND)
    wind |= {name: given[name] for name in (*WIND, "--wind-file", "--direction") if name in given}
    if not wind.get("--turbulence", True):
        del wind["--turbulence"], wind["--seed"]
    if "--wakes" in given:
        settings["model"] = given["--wakes"]
    if "--added-turbulence" in given:
        settings["added_turbulence"] = given["--added-turbulence"]
    duration = given.get("--duration", DURATION)
    data: dict[str, Any] = {
        "turbine": turbine_key(target),
        "positions": positions,
        "wind": wind_of_options(wind),
        "controller": controller_of(),
        "duration": duration,
        "transient": TRANSIENT if duration > 2.0 * TRANSIENT else 0.0,
        "channels": list(CHANNELS),
        "wakes": settings,
    }
    if "--yaw" in given:
        data["yaw"] = [f"{angle:g} deg" for angle in angles_of(given["--yaw"], "--yaw")]
    return of_options(data, FarmCase)


def _positions(given: dict[str, Any], diameter: float) -> tuple[Any, dict[str, Any]]:
    """Positions [m] of a layout or of a row, and wake settings of the layout."""
    from meltemi.farm.layout import CLOSEST, MOST_TURBINES

    if "--layout" in given:
        if other := sorted(given.keys() & {"--row", "--spacing"}):
            raise InputError(f"give one of {other[0]}, --layout")
        layout = meltemi.io.read_layout(given["--layout"], diameter)
        warn(layout.notes, str(given["--layout"]))
        return layout.positions, layout.wakes
    count, spacing = given.get("--row", 3), given.get("--spacing", 5.0)
    if not 1 <= count <= MOST_TURBINES:
        raise InputError(f"--row {count}: expected 1 to {MOST_TURBINES} turbines")
    if not spacing >= CLOSEST:
        raise InputError(f"--spacing {spacing:g}: expected {CLOSEST:g} rotor diameters or more, behind the near wake")
    # a field of a file begins downwind of its origin: place the row upwind of it
    first = 1 - count if "--wind-file" in given else 0
    return [(round((first + i) * spacing * diameter, 1), 0.0) for i in range(count)], {}


def _simulated(runs: list[tuple[FarmCase, Path]]) -> list[FarmResult]:
    """Simulate farms one after the other; print the ratio of simulated to elapsed time."""
    from time import perf_counter

    from meltemi.farm.simulation import simulate_case

    durations = [case.duration for case, _ in runs]
    total, turbines = sum(durations), len(runs[0][0].positions)
    began, results = perf_counter(), []
    with simulation_bar(f"{turbines} turbines, {durations[0]:g} s", total, "s") as progress:
        for i, (case, folder) in enumerate(runs):
            part = _part(progress, sum(durations[:i]) / total, case.duration / total)
            results.append(simulate_case(case, folder, part))
    seconds, facts = perf_counter() - began, results[0].facts
    print(
        f"{len(runs)} run{'s' * (len(runs) > 1)} of {turbines} turbines, {total:g} s of the farm in {seconds:.1f} s: "
        f"{total / seconds:.3g} times real time, {turbines * total / seconds:.3g} for a turbine "
        f"({int(facts.get('planes', 0))} planes at the end, {int(facts.get('crossed', 0))} crossed and dropped)"
    )
    return results


def _part(progress: Callable[[float], None], begin: float, share: float) -> Callable[[float], None]:
    """Progress callback for a part of the work."""

    def done(completed: float) -> None:
        progress(begin + share * completed)

    return done


def _words(given: dict[str, Any]) -> list[object]:
    """Text of options as on a command line."""
    words: list[object] = []
    for name, value in given.items():
        words += [name if value else f"--no-{name[2:]}"] if isinstance(value, bool) else [name, value]
    return words


def _next(case: FarmCase, target: str, given: dict[str, Any], out: Path) -> tuple[object, ...]:
    """Suggested next command: the row with its first turbine yawed, or two of its turbines side by side."""
    count = len(case.positions)
    if count == 1:
        return ("run", target, "--wind-speed", SPEED, "--turbulence", INTENSITY)
    if given.keys() & {"--yaw", "--row", "--layout"} or Path(target).suffix in YAML:
        return ("diff", out / "turbine_1.nc", out / "turbine_2.nc", "--out", out)
    steered = ("--yaw", "20" + ",0" * (count - 1), "--against", out, "--out", f"{out}-yawed")
    return ("farm", target, *_words(given), *steered)
