"""``meltemi surrogate``: equivalent loads as a function of site conditions, and sites compared with design classes."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from warnings import catch_warnings, simplefilter

import meltemi
from meltemi.app.commands import CommandGroup
from meltemi.app.options import (
    TURBINES,
    ControllerInputOption,
    ControllerOption,
    TurbineArgument,
    controller_of,
    of_options,
    turbine_key,
)
from meltemi.app.scans import numbers_of, pairs_of, values_of
from meltemi.app.signatures import Range
from meltemi.app.terminal import (
    OutOption,
    folder_for,
    print_table,
    print_values,
    progress_bar,
    say,
    simulation_bar,
    suggest,
    warn,
    write_figure,
    write_results,
    wrote,
)
from meltemi.core.errors import InputError
from meltemi.core.extras import missing
from meltemi.loads.commands.loads import ExecutionOptions, progress_lines

if TYPE_CHECKING:
    from meltemi.loads.surrogate.model import Surrogate

FolderArgument = Annotated[Path, "Folder of a surrogate campaign, as design writes it."]
FileArgument = Annotated[Path, "File of a surrogate, as fit writes it."]
ClassOption = Annotated[str, "--class", "--wind-class", "Wind turbine class of IEC 61400-1."]
TurbineOption = Annotated[str | None, "Refuse a surrogate of another turbine.", TURBINES]
EditionOption = Annotated[int, "Edition of IEC 61400-1: 3, 4."]
MODEL = "surrogate.json"

surrogate = CommandGroup("Load surrogates: equivalent loads as a function of site conditions.")


@surrogate.command()
def design(
    turbine: TurbineArgument,
    variables: Annotated[tuple[str, ...] | None, "Site variables, e.g. speed,turbulence_intensity [six]."] = None,
    bounds: Annotated[str | None, "Constant bounds in SI units, e.g. air_density=0.9:1.3."] = None,
    loads: Annotated[str | None, "Loads with S-N slopes, e.g. tower_base_moment_fore_aft=4 [seven]."] = None,
    method: Annotated[str, "Space-filling design: sobol, latin."] = "sobol",
    points: Annotated[int, "Points of the fit."] = 256,
    repeats: Annotated[int, "Points of the fit with several seeds."] = 16,
    checks: Annotated[int, "Held-out points."] = 32,
    seeds: Annotated[int, "Seeds of repeated and held-out points."] = 6,
    duration: Annotated[float, "Evaluated duration [s]."] = 600.0,
    transient: Annotated[float, "Initial transient [s]."] = 60.0,
    controller: ControllerOption = None,
    controller_input: ControllerInputOption = None,
    realisation: Annotated[int, "Number of the realisation: points and seeds follow from it."] = 1,
    out: OutOption = Path("surrogate"),
) -> None:
    """Choose the points of a surrogate; writes surrogate.yaml and design.csv."""
    from meltemi.core.usual import unusual_numbers
    from meltemi.loads.surrogate.space import UNITS

    given: dict[str, Any] = {"turbine": turbine_key(turbine), "method": method}
    given |= {"points": points, "repeats": repeats, "checks": checks, "seeds": seeds, "realisation": realisation}
    given |= {"duration": duration, "transient": transient} | ({} if variables is None else {"variables": variables})
    if bounds is not None:
        given["bounds"] = {name: _interval(text) for name, text in pairs_of(bounds, "--bounds").items()}
    if loads is not None:
        given["loads"] = numbers_of(loads, "--loads", "NAME=VALUE")
    if controller is not None or controller_input is not None:
        given["controller"] = controller_of(controller, controller_input)
    campaign = of_options(given, meltemi.loads.SurrogateCampaign, "meltemi surrogate design")
    warn(unusual_numbers(campaign))
    planned = meltemi.loads.surrogate_design(campaign)
    files = meltemi.loads.write_surrogate_campaign(campaign, planned, out)
    low, high = planned.values.min(axis=0), planned.values.max(axis=0)
    rows = []
    for name, a, b in zip(planned.space.names, low, high, strict=True):
        unit, k = ("deg", degrees(1.0)) if name in ("inclination", "yaw_error") else (UNITS[name], 1.0)
        rows.append([name, f"{a * k:.4g}", f"{b * k:.4g}", unit])
    print_table(f"{turbine}: points", ["variable", "lowest", "highest", "unit"], rows)
    hours = len(planned) * (duration + transient) / 3600.0
    print(f"{points} points of the fit, {checks} held-out points: {len(planned)} runs, {hours:.0f} h simulated")
    wrote(*files)
    suggest("surrogate", "run", out)
    if words := missing(("pandas", "pyarrow")):
        say(f"to run it needs {words}")


def _interval(text: str) -> list[float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        raise InputError(f"--bounds: {text!r}: expected two numbers, LOW:HIGH") from None
    return [low, high]


@surrogate.command()
def run(folder: FolderArgument, options: ExecutionOptions) -> None:
    """Run the missing points of a surrogate."""
    from meltemi.loads.surrogate.campaign import read_surrogate_campaign

    n = len(read_surrogate_campaign(folder)[1])
    folder_for(folder, "surrogate")
    with simulation_bar("points", n, "runs") as bar:
        done, failed, missing = meltemi.loads.run_surrogate(folder, progress=progress_lines(bar), **options.given())
    print(f"{done} of {n} runs done, {failed} failed, {missing} missing")
    suggest("surrogate", "fit" if done else "run", folder)


@surrogate.command()
def fit(
    folder: FolderArgument,
    kind: Annotated[str, "polynomial (chaos expansion), gaussian (process)."] = "polynomial",
    degree: Annotated[int, "Largest degree of the polynomials."] = 12,
) -> None:
    """Fit a surrogate to the runs and validate it at held-out points; writes surrogate.json, a table and a plot."""
    from meltemi.loads.surrogate.report import fit_rows, influence_rows

    folder_for(folder, "surrogate")
    with progress_bar("fit"):
        campaign, points, values = meltemi.loads.surrogate_loads(folder)
        fitted = meltemi.loads.fit_surrogate(campaign, points, values, kind, degree)
        files = [
            meltemi.loads.write_surrogate(fitted, folder / MODEL),
            meltemi.io.write_csv(folder / "fit.csv", *fit_rows(fitted)),
            write_figure(folder / "validation.png", meltemi.plots.plot_surrogate(fitted, points, values)),
        ]
    print_table(f"{fitted.turbine}: {kind} surrogate, equivalent loads at 1 Hz", *fit_rows(fitted))
    f = fitted.facts
    print(f"{f['points']} points ({f['runs']} runs); errors at {f['checks']} held-out points ({f['check_runs']} runs)")
    head, rows = influence_rows(fitted)
    if rows:
        print_table("Total Sobol indices of the logarithm of the load", head, rows)
    print_values("verdict", fitted.verdict, lambda text: [f"verdict: {text}"])
    wrote(*files)
    _next(fitted, folder / MODEL, "surrogate", "evaluate", folder / MODEL, "--at", "speed=10,turbulence_intensity=0.12")


def _next(fitted: Surrogate, file: Path, *words: object) -> None:
    """Suggest the next command; for a surrogate that is not usable, to double its points."""
    from meltemi.loads.surrogate.campaign import FILE

    points = int(fitted.facts.get("points", 64))
    if fitted.usable:
        suggest(*words)
    elif (file.parent / FILE).is_file():
        suggest("surrogate", "refine", file.parent, "--points", points)
    else:
        suggest("surrogate", "design", fitted.turbine, "--points", 2 * points)


@surrogate.command()
def refine(
    folder: FolderArgument,
    points: Annotated[int, "Number of further points.", Range(1)] = 64,
    wind_class: ClassOption = "IB",
    edition: EditionOption = 4,
    site: Annotated[Path | None, "Site (YAML, or JSON of IEC 61400-15-1)."] = None,
) -> None:
    """Add points where the error of the lifetime loads is largest; extends design.csv."""
    from meltemi.loads.surrogate.campaign import read_surrogate_campaign

    table = meltemi.loads.class_table(wind_class, edition) if site is None else meltemi.loads.read_site_table(site)
    campaign, whole = read_surrogate_campaign(folder)
    _, some, values = meltemi.loads.surrogate_loads(folder)
    fitted = meltemi.loads.fit_surrogate(campaign, some, values)
    chosen = meltemi.loads.further_points(fitted, points, table.density, seed=int(whole.seed.max()) % 2**31)
    files = meltemi.loads.write_surrogate_campaign(campaign, whole.extended(chosen), folder)
    mean = ", ".join(f"{name} {value:.3g}" for name, value in zip(fitted.space.names, chosen.mean(axis=0), strict=True))
    where = "" if fitted.usable else ", which fill the space, since the surrogate is not usable"
    print(f"{points} further points{where}; their means: {mean}")
    wrote(*files)
    suggest("surrogate", "run", folder)


@surrogate.command()
def evaluate(
    file: FileArgument,
    at: Annotated[str, "--at", "Values in SI units, e.g. speed=10,turbulence_intensity=0.12."],
    clip: Annotated[bool, "Take the nearest bound for values outside."] = False,
    turbine: TurbineOption = None,
) -> None:
    """Evaluate a surrogate at one point."""
    from meltemi.loads.surrogate.report import value_rows

    fitted = _loaded(file, turbine)
    values = fitted(outside="clip" if clip else "error", **numbers_of(at, "--at", "NAME=VALUE"))
    print_table(f"{fitted.turbine}: equivalent loads at 1 Hz", *value_rows(fitted, values), 2)
    _next(fitted, file, "surrogate", "site", file, "SITE.yaml", "--class", "IB")


@surrogate.command()
def site(
    file: FileArgument,
    conditions: Annotated[Path, "Site: YAML with sectors, or the JSON form of IEC 61400-15-1."],
    wind_class: ClassOption = "IB",
    edition: EditionOption = 4,
    site_turbine: Annotated[str | None, "ID of the turbine in the JSON form."] = None,
    neighbours: Annotated[str | None, "Distances of neighbours in rotor diameters, e.g. 5,5,7."] = None,
    turbine: TurbineOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare lifetime loads at a site with those of a design class; writes a table and a plot."""
    from meltemi.loads.surrogate.report import suitability_rows

    fitted, table = _loaded(file, turbine), meltemi.loads.read_site_table(conditions, site_turbine)
    if neighbours is not None:
        table = table.replace(neighbours=tuple(values_of(neighbours, "--neighbours")))
    suitability = meltemi.loads.site_suitability(fitted, table, meltemi.loads.class_table(wind_class, edition))
    head, rows = suitability_rows(suitability)
    files = write_results(out / "suitability", (head, rows), meltemi.plots.plot_suitability(suitability))
    print_table(f"{fitted.turbine}: {table.name or 'site'} over class {wind_class}", head, rows)
    for name, share in suitability.outside.items():
        say(f"{name} is outside the surrogate for {100.0 * share:.3g} % of the site's time: the nearest bound counts")
    print_values("verdict", suitability.verdict, lambda text: [f"verdict: {text}, for fatigue in production"])
    wrote(*files)
    _next(fitted, file, "loads", "plan", fitted.turbine, "--class", wind_class)


def _loaded(file: Path, turbine: str | None) -> Surrogate:
    """The surrogate of a file, which must be of the turbine if one is named; warns if it is not usable."""
    with catch_warnings(record=True) as caught:
        simplefilter("always")
        fitted = meltemi.loads.load_surrogate(file, None if turbine is None else meltemi.load_turbine(turbine))
    warn(each.message for each in caught)
    return fitted
