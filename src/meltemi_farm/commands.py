"""``meltemi farm``: a farm from a file, or a row of turbines, with a table and a figure of what its wakes cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import TURBINES, controller_of_options, is_case, wind_of_options
from meltemi.app.scans import angles_of
from meltemi.app.terminal import OutOption, folder_for, print_table, say, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi_farm.layout import FarmCase
    from meltemi_farm.simulation import FarmResult

SPEED, INTENSITY, DURATION, TRANSIENT = 9.0, 0.1, 600.0, 30.0
"""Of a row without other options: below rated wind, where wakes cost power."""


def farm(
    target: Annotated[
        str, typer.Argument(help="YAML file of a farm, or a turbine for a row of them.", autocompletion=TURBINES)
    ],
    row: Annotated[int | None, typer.Option("--row", help="Turbines of a row, one behind the other [3].")] = None,
    spacing: Annotated[float | None, typer.Option("--spacing", help="Between them, in rotor diameters [5].")] = None,
    layout: Annotated[
        Path | None,
        typer.Option("--layout", help="Positions of a FAST.Farm file (.fstf), windIO plant or FLORIS input (.yaml)."),
    ] = None,
    wind_speed: Annotated[float | None, typer.Option(help="Mean wind speed at hub height [m/s] [9].")] = None,
    turbulence: Annotated[
        float | None, typer.Option(help="Turbulence intensity [0.1]; 0 is a wind without turbulence.")
    ] = None,
    direction: Annotated[
        float | None, typer.Option(help="Wind direction [deg], clockwise from above; turbines face it [0: along x].")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the turbulence [1].")] = None,
    duration: Annotated[float | None, typer.Option(help="Duration of the simulation [s] [600].")] = None,
    wakes: Annotated[
        str | None, typer.Option("--wakes", help="Constants: fast.farm, curled, iec, madsen, keck, none [fast.farm].")
    ] = None,
    yaw: Annotated[
        str | None,
        typer.Option(
            "--yaw", help="Yaw of the turbines from the wind [deg], counter-clockwise from above, e.g. 20,0,0."
        ),
    ] = None,
    alone: Annotated[bool, typer.Option(help="Also simulate without wakes, to compare.")] = True,
    seen: Annotated[bool, typer.Option("--view", help="Also write the farm in three dimensions (HTML).")] = False,
    out: OutOption = Path("out"),
) -> None:
    """Simulate turbines in each other's wakes: power and loads by turbine, and what the wakes cost."""
    from time import perf_counter

    from meltemi.core.yamlfile import read_record, write_record
    from meltemi_farm.layout import FarmCase

    options: dict[str, Any] = {"--row": row, "--spacing": spacing, "--layout": layout, "--wind-speed": wind_speed}
    options |= {"--turbulence": turbulence, "--direction": direction, "--seed": seed, "--duration": duration}
    options |= {"--wakes": wakes, "--yaw": yaw}
    given = {name: value for name, value in options.items() if value is not None}
    path = Path(target)
    if path.suffix in (".yaml", ".yml") and (is_case(path) or not path.exists()):
        if given:
            raise InputError(f"{path} is the file of a farm, which defines its own run; remove {', '.join(given)}")
        case, folder = read_record(path, FarmCase), path.parent
    else:
        case, folder = _row_case(target, given), Path()
    if seen:
        case = case.replace(view=True)
    from meltemi.loadcases.case import self_contained
    from meltemi.postprocess.files import write_netcdf
    from meltemi.report.plots import save
    from meltemi.report.tables import write_csv
    from meltemi_farm.report import SHOWN, cost_rows, plot_farm

    folder_for(out)
    began = perf_counter()
    result, before = _simulated(case, folder, alone)
    seconds = perf_counter() - began
    head, rows = cost_rows(result, before)
    label = f"{case.turbine}, wakes {case.wakes.model}: {result[0].meta['wind']}"
    print_table(label, *cost_rows(result, before, SHOWN), all_rows=(head, rows))
    print(
        "DEL: damage-equivalent load, 1 Hz, of the blade root out of plane (slope 10) and the tower base fore-aft (4); "
        "%: change by the wakes"
    )
    runs = len(result) * (2 if before else 1)
    print(
        f"{runs} x {case.duration:g} s simulated in {seconds:.1f} s, {runs * case.duration / seconds:.0f} times real "
        f"time ({int(result.facts.get('planes', 0))} planes at the end, {int(result.facts.get('crossed', 0))} crossed "
        "and dropped)"
    )
    files = [write_netcdf(each, out / f"turbine_{i + 1}.nc") for i, each in enumerate(result.turbines)]
    files.append(write_csv(out / "farm.csv", head, rows))
    files.append(save(plot_farm(result, before, label), out / "farm.png"))
    if case.view:
        from meltemi.plots import view

        files.append(view({f"T{i + 1}": each for i, each in enumerate(result.turbines)}).write(out / "farm.html"))
    if path.resolve() != (out / "farm.yaml").resolve():
        write_record(self_contained(case, folder), out / "farm.yaml")
        files.append(out / "farm.yaml")
    wrote(*files)
    suggest(*_next(case, target, given, out))
    for i, each in enumerate(result.turbines):
        for words in (*each.warnings, *map(str, each.findings)):
            say(f"T{i + 1}: {words}")
    if any(each.findings for each in result.turbines):
        raise typer.Exit(1)


def _row_case(target: str, given: dict[str, Any]) -> FarmCase:
    """A row of turbines, one behind the other."""
    from meltemi.core.yamlfile import validated
    from meltemi.turbine.library import load_turbine
    from meltemi_farm.layout import FarmCase
    from meltemi_farm.report import CHANNELS

    positions, settings = _positions(given, load_turbine(target).rotor_diameter)
    wind: dict[str, Any] = {"--wind-speed": SPEED, "--turbulence": INTENSITY, "--seed": 1}
    wind |= {name: given[name] for name in (*wind, "--direction") if name in given}
    if not wind["--turbulence"]:
        del wind["--turbulence"], wind["--seed"]
    duration = given.get("--duration", DURATION)
    data: dict[str, Any] = {
        "turbine": str(Path(target).absolute()) if Path(target).is_file() else target,
        "positions": positions,
        "wind": wind_of_options(wind),
        "controller": controller_of_options({}),
        "duration": duration,
        "transient": TRANSIENT if duration > 2.0 * TRANSIENT else 0.0,
        "channels": list(CHANNELS),
        "wakes": settings | ({"model": given["--wakes"]} if "--wakes" in given else {}),
    }
    if "--yaw" in given:
        data["yaw"] = [f"{angle:g} deg" for angle in angles_of(given["--yaw"], "--yaw")]
    return validated(data, FarmCase, "command line")


def _positions(given: dict[str, Any], diameter: float) -> tuple[Any, dict[str, Any]]:
    """Positions [m] of a layout or of a row, and wake settings of the layout."""
    from meltemi_farm.layout import CLOSEST, MOST_TURBINES

    if "--layout" in given:
        from meltemi_farm.sources import read_layout

        if other := sorted(given.keys() & {"--row", "--spacing"}):
            raise InputError(f"give one of {other[0]}, --layout")
        found = read_layout(given["--layout"], diameter)
        for words in found.notes:
            say(f"{given['--layout']}: {words}")
        return found.positions, found.wakes
    count, spacing = given.get("--row", 3), given.get("--spacing", 5.0)
    if not 1 <= count <= MOST_TURBINES:
        raise InputError(f"--row {count}: expected 1 to {MOST_TURBINES} turbines")
    if not spacing >= CLOSEST:
        raise InputError(f"--spacing {spacing:g}: expected {CLOSEST:g} rotor diameters or more, behind the near wake")
    return [(round(i * spacing * diameter, 1), 0.0) for i in range(count)], {}


def _simulated(case: FarmCase, folder: Path, alone: bool) -> tuple[FarmResult, FarmResult | None]:
    """The farm with wakes, and without."""
    from meltemi_farm.simulation import simulate_case

    with_wakes = case.wakes.model != "none"
    total = (1 + (alone and with_wakes)) * case.duration
    what = f"{len(case.positions)} turbines, {case.duration:g} s"
    with simulation_bar(what, total * len(case.positions), "s") as progress:
        share = case.duration / total
        result = simulate_case(case, folder, lambda s: progress(share * s))
        if not (alone and with_wakes):
            return result, None
        none = case.replace(wakes={"model": "none"}, view=False)
        return result, simulate_case(none, folder, lambda s: progress(share * (1.0 + s)))


def _next(case: FarmCase, target: str, given: dict[str, Any], out: Path) -> tuple[object, ...]:
    """A row with its first turbine turned; after that, two of its turbines side by side."""
    count = len(case.positions)
    if count == 1:
        return ("run", target, "--wind-speed", SPEED, "--turbulence", INTENSITY)
    if given.keys() & {"--yaw", "--row", "--layout"} or Path(target).suffix in (".yaml", ".yml"):
        return ("diff", out / "turbine_1.nc", out / "turbine_2.nc", "--out", out)
    options = [word for option in given.items() for word in option]
    return ("farm", target, *options, "--yaw", "20" + ",0" * (count - 1), "--out", f"{out}-yawed")
