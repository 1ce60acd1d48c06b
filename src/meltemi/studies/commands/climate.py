"""``meltemi climate``: density, rain, power and loads of a turbine over a year of weather."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from meltemi.app.options import TurbineArgument, WorkersOption, check_workers
from meltemi.app.terminal import OutOption, folder_for, print_table, say, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError


def climate(
    turbine: TurbineArgument,
    site: Annotated[
        str, typer.Option("--climate", help="A climate's name or YAML file, hourly weather as CSV, or an EPW file.")
    ],
    wind_class: Annotated[str, typer.Option("--wind-class", "--class", help="Turbulence of IEC 61400-1.")] = "IB",
    altitude: Annotated[float | None, typer.Option(help="Altitude of a weather file without pressures [m].")] = None,
    wind_height: Annotated[
        float | None, typer.Option(help="Height of the wind of a weather file [m] [EPW: 10, CSV: that of the hub].")
    ] = None,
    shear: Annotated[float, typer.Option(help="Power-law exponent with which it is taken to the hub.")] = 0.14,
    seeds: Annotated[int, typer.Option("--seeds", help="Seeds of the turbulence.")] = 2,
    duration: Annotated[float, typer.Option("--duration", help="Judged time of each run [s], after 30 s.")] = 300.0,
    workers: WorkersOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Compute energy and loads of a year of weather against standard air: tables, plot, hourly or monthly CSV."""
    check_workers(workers)
    from meltemi.iec.classes import as_class
    from meltemi.studies.climate.weather import periods
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic

    described = aeroelastic(load_turbine(turbine), "meltemi climate")
    as_class(wind_class, None)
    _check(
        ("--altitude", altitude, -500.0, 9000.0),
        ("--wind-height", wind_height, 1.0, 500.0),
        ("--shear", shear, 0.0, 0.5),
        ("--seeds", seeds, 1, 1000),
        ("--duration", duration, 20.0, 1e5),
    )
    given = {"altitude": altitude, "wind_height": wind_height}
    weather = Path(site).suffix.lower() in (".csv", ".epw")
    if not weather and any(value is not None for value in given.values()):
        raise InputError(f"--altitude and --wind-height belong to weather files; the climate {site} has its own")
    year = periods(site, **{key: value for key, value in given.items() if value is not None}, shear_exponent=shear)
    from meltemi.report.plots import save
    from meltemi.report.tables import number as written
    from meltemi.report.tables import write_csv
    from meltemi.studies.climate.response import ICED, SHED, WET, ResponseSetup, respond
    from meltemi.studies.climate.tables import energy_table, load_table, month_table, years_figure
    from meltemi.studies.climate.year import SiteYears
    from meltemi.tuning.run_store import run_store

    states: tuple[str, ...] = (ICED, SHED) if year.icing_hours.any() else ()
    states += (WET,) if any(hours.any() for hours in year.rain_hours.values()) else ()
    low, high = described.cut_in + 1.0, described.cut_out - 1.0
    speeds = tuple(np.linspace(low, high, 1 + max(4, round((high - low) / 1.8))).round(1).tolist())
    extent = ResponseSetup(
        speeds=speeds, seeds=tuple(range(1, seeds + 1)), length=duration, states=states, wind_class=wind_class
    )
    folder_for(out)
    with run_store(out, repr(("climate", described.content_hash(), extent))) as book:
        with simulation_bar("climate") as progress:
            response = respond(described, extent, workers=workers, progress=lambda share, what: progress(share))
        failed = dict(book.failed)
    found = SiteYears.of(response, [year])
    (result,) = found.years.values()
    tables = {"energy": energy_table(found), "loads": load_table(found), "months": month_table(result)}
    for table in tables.values():
        print_table(f"{described.name}, {year.name}: {table.caption}", table.head, table.texts)
    if year.missing:
        print(f"{year.missing} hours without temperature, humidity or wind are left out")
    files = [
        write_csv(out / f"{name}.csv", [" ".join(h.split()) for h in t.head], t.texts) for name, t in tables.items()
    ]
    head = ["period", "month", "temperature [degC]", "humidity [-]", "density [kg/m³]", "mean power [kW]"]
    columns = year.temperature, year.humidity, result.density, result.by_period / year.hours / 3.6e6
    rows = [[str(m), *map(written, x)] for m, *x in zip(year.month, *columns, strict=True)]
    files.append(write_csv(out / "periods.csv", head, [[str(i), *row] for i, row in enumerate(rows, start=1)]))
    wrote(*files, save(years_figure(found), out / "climate.png"))
    suggest("power-curve", turbine, "--out", out)
    for cell, why in failed.items():
        say(f"failed: {cell}: {why}")
    if failed:
        raise typer.Exit(1)


def _check(*ranges: tuple[str, float | None, float, float]) -> None:
    """Test that options lie within their ranges, where they are given."""
    for option, number, low, high in ranges:
        if number is not None and not low <= number <= high:
            raise InputError(f"{option} {number:g}: expected {low:g} to {high:g}")
