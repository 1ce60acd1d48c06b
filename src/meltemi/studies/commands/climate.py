"""``meltemi climate``: density, rain, power and loads of a turbine over a year of weather."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np

import meltemi
from meltemi.app.options import TurbineArgument, WorkOptions, load_aeroelastic
from meltemi.app.scans import cells, finish
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, write_figure, wrote
from meltemi.core.errors import InputError


def climate(
    turbine: TurbineArgument,
    site: Annotated[str, "--climate", "A climate's name or YAML file, hourly weather as CSV, or an EPW file."],
    work: WorkOptions,
    wind_class: Annotated[str, "--wind-class", "--class", "Turbulence of IEC 61400-1."] = "IB",
    altitude: Annotated[float | None, "Altitude of a weather file without pressures [m].", Range(-500, 9000)] = None,
    wind_height: Annotated[
        float | None, "Height of the wind of a weather file [m] [EPW: 10, CSV: that of the hub].", Range(1, 500)
    ] = None,
    shear: Annotated[float, "Power-law exponent with which it is taken to the hub.", Range(0, 0.5)] = 0.14,
    seeds: Annotated[int, "Seeds of the turbulence.", Range(1, 1000)] = 2,
    duration: Annotated[float, "Judged time of each run [s], after 30 s.", Range(20, 1e5)] = 300.0,
    out: OutOption = Path("out"),
) -> None:
    """Compute energy and loads of a year of weather against standard air: tables, plot, hourly or monthly CSV."""
    from meltemi.iec.classes import as_class
    from meltemi.studies.climate.weather import periods

    described = load_aeroelastic(turbine, "meltemi climate")
    as_class(wind_class, None)
    given = {"altitude": altitude, "wind_height": wind_height}
    weather = Path(site).suffix.lower() in (".csv", ".epw")
    if not weather and any(value is not None for value in given.values()):
        raise InputError(f"--altitude and --wind-height belong to weather files; the climate {site} defines both")
    year = periods(site, **{key: value for key, value in given.items() if value is not None}, shear_exponent=shear)
    from meltemi.report.tables import number
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
    with run_store(out, repr(("climate", described.content_hash(), extent)), **work.divided()) as book:
        with simulation_bar("climate") as progress:
            response = respond(described, extent, workers=work.workers, progress=lambda share, what: progress(share))
        failed = dict(book.failed)
    sites = SiteYears.of(response, [year])
    (result,) = sites.years.values()
    tables = {"energy": energy_table(sites), "loads": load_table(sites), "months": month_table(result)}
    for table in tables.values():
        print_table(f"{described.name}, {year.name}: {table.caption}", table.head, table.texts)
    if year.missing:
        print(f"{year.missing} hours without temperature, humidity or wind are left out")
    files = [
        meltemi.io.write_csv(out / f"{name}.csv", [" ".join(h.split()) for h in t.head], t.texts)
        for name, t in tables.items()
    ]
    head = ["period", "month", "temperature [degC]", "humidity [-]", "density [kg/m³]", "mean power [kW]"]
    columns = year.temperature, year.humidity, result.density, result.by_period / year.hours / 3.6e6
    rows = [[str(m), *map(number, x)] for m, *x in zip(year.month, *columns, strict=True)]
    files.append(
        meltemi.io.write_csv(out / "periods.csv", head, [[str(i), *row] for i, row in enumerate(rows, start=1)])
    )
    wrote(*files, write_figure(out / "climate.png", years_figure(sites)))
    suggest("power-curve", turbine, "--out", out)
    finish(cells(failed))
