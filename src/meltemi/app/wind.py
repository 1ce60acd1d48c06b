"""``meltemi wind``: make a wind of IEC 61400-1, or look at a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.terminal import OutOption, folder_for, print_table, progress_bar
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.turbine.definition import Turbine
    from meltemi.wind.fields import SteadyWind, WindBox, WindSeries
    from meltemi.wind.turbulent import TurbulentWind

SpectrumOption = Annotated[
    str | None, typer.Option("--spectrum", help="Of turbulence: kaimal, vonkarman, mann [kaimal].")
]
ClassOption = Annotated[str | None, typer.Option("--class", help="Wind turbine class of IEC 61400-1, e.g. IIB.")]
EditionOption = Annotated[int | None, typer.Option("--edition", help="Of IEC 61400-1: 2, 3, 4 [3].")]
SUFFIXES = {"bts": ".bts", "bladed": ".wnd", "hawc2": ".bin", "netcdf": ".nc"}
"""Of a field in each format."""


def wind(
    model: Annotated[
        str | None, typer.Argument(help="NTM, ETM, EWM1, EWM50, NWP, EOG, EDC, ECD, ECG, EWSH, EWSV.")
    ] = None,
    source: Annotated[
        Path | None, typer.Option("--from", help="Instead: look at a wind file, .bts, .wnd, .bin, .nc, .csv.")
    ] = None,
    wind_class: ClassOption = None,
    speed: Annotated[float | None, typer.Option("--speed", help="Mean at hub height [m/s].")] = None,
    turbine: Annotated[str | None, typer.Option("--turbine", help="A turbine's name or YAML file [nrel5mw].")] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Of the turbulence [1].")] = None,
    duration: Annotated[float | None, typer.Option("--duration", help="Of the run it is for [s] [600].")] = None,
    edition: EditionOption = None,
    intensity: Annotated[
        float | None, typer.Option("--intensity", help="Of turbulence, e.g. 0.14, in place of the class's.")
    ] = None,
    spectrum: SpectrumOption = None,
    coherent: Annotated[
        str | None, typer.Option("--coherent", help="Components coherent across the rotor: u, all [u].")
    ] = None,
    shear: Annotated[float | None, typer.Option("--shear", help="Power-law exponent [that of the model].")] = None,
    points: Annotated[int | None, typer.Option("--points", help="Grid points across [25].")] = None,
    dt: Annotated[float | None, typer.Option("--dt", help="Between planes [s] [0.1].")] = None,
    width: Annotated[float | None, typer.Option("--width", help="Of the grid [m] [1.2 diameters].")] = None,
    periodic: Annotated[bool, typer.Option("--periodic", help="As long as the run, and begins again.")] = False,
    unscaled: Annotated[bool, typer.Option("--unscaled", help="Keep the sample's own standard deviation.")] = False,
    hub_series: Annotated[
        Path | None, typer.Option("--hub-series", help="CSV file with the wind at the hub that the field has.")
    ] = None,
    gust: Annotated[
        str | None, typer.Option("--gust", help="A transient on the turbulence: EOG, ECD, ECG, EDC, EWSH, EWSV.")
    ] = None,
    sign: Annotated[int | None, typer.Option("--sign", help="Of a direction change or shear: 1, -1 [1].")] = None,
    begin: Annotated[float | None, typer.Option("--begin", help="Of a transient [s] [60].")] = None,
    years: Annotated[int | None, typer.Option("--years", help="Of the gusts of edition 2: 1, 50.")] = None,
    steady: Annotated[bool, typer.Option("--steady", help="EWM: steady in place of turbulent.")] = False,
    file_format: Annotated[
        str | None, typer.Option("--format", help="Of a field: bts, bladed, hawc2, netcdf [bts].")
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Make a wind or look at a file: table, plots, field."""
    settings = {
        "seed": seed,
        "spectrum": spectrum,
        "coherent": coherent,
        "shear_exponent": shear,
        "points": points,
        "dt": dt,
        "periodic": periodic or None,
        "scaled": False if unscaled else None,
    }
    named = {"wind_class": wind_class, "edition": edition, "speed": speed, "intensity": intensity, "years": years}
    transient = {"sign": sign, "begin": begin}
    options: dict[str, Any] = {name: v for name, v in (settings | named | transient).items() if v is not None}
    if (model is None) == (source is None):
        raise InputError("give one of a model (like NTM) and --from FILE")
    from meltemi.turbine.library import load_turbine

    if source is not None:
        own = {"--duration": duration, "--width": width, "--hub-series": hub_series, "--gust": gust}
        given = [*(_option(n) for n in options), *(n for n, v in own.items() if v is not None)]
        if given or steady:
            raise InputError(f"{', '.join(given) or '--steady'}: a wind file is looked at as it is")
        _look(_read(source), load_turbine(turbine) if turbine else None, out, file_format)
        return
    assert model is not None
    used = load_turbine(turbine or "nrel5mw")
    if gust is not None:
        onto = {n: options.pop(n) for n in transient if n in options}
        onto |= {n: options[n] for n in named if n in options}
    if hub_series is not None:
        from meltemi.wind.files import read_hub_csv

        options["hub_series"] = read_hub_csv(hub_series)
    from meltemi.wind.iec.models import iec_wind
    from meltemi.wind.turbulent import TurbulentWind

    made: SteadyWind | WindSeries | WindBox | TurbulentWind = iec_wind(
        model.upper(), turbine=used, steady=steady or None, **options
    )
    target = None
    if isinstance(made, TurbulentWind):
        target = made
        added = None if gust is None else iec_wind(gust.upper(), turbine=used, **onto)
        made = _field(made, used, 600.0 if duration is None else duration, width, added, out)
    else:
        _only_turbulent({"--width": width, "--gust": gust, "--format": file_format, "--duration": duration}, model)
    _look(made, used, out, file_format or "bts", target if gust is None else None)


def _option(name: str) -> str:
    """How a setting is called on the command line."""
    special = {"wind_class": "--class", "shear_exponent": "--shear", "scaled": "--unscaled"}
    return special.get(name, f"--{name.replace('_', '-')}")


def _only_turbulent(options: dict[str, Any], model: str) -> None:
    for name, value in options.items():
        if value is not None:
            raise InputError(f"{name}: {model.upper()} makes no turbulent field")


def _read(path: Path) -> WindBox | WindSeries:
    """Any wind file; wind at the hub is looked at as a series."""
    import numpy as np

    from meltemi.wind.fields import WindSeries
    from meltemi.wind.files import read_hub_csv, read_wind

    if path.suffix.lower() != ".csv":
        return read_wind(path)
    hub = read_hub_csv(path)
    v, w = (np.zeros_like(hub.u) if c is None else c for c in (hub.v, hub.w))
    return WindSeries(
        time=hub.time, speed=np.hypot(hub.u, v), direction=-np.arctan2(v, hub.u), vertical=w, source=path.name
    )


def _field(
    described: TurbulentWind,
    turbine: Turbine,
    duration: float,
    width: float | None,
    gust: SteadyWind | WindSeries | TurbulentWind | None,
    out: Path,
) -> WindBox:
    from meltemi.wind.fields import WindSeries
    from meltemi.wind.superposition import with_gust
    from meltemi.wind.turbulence.field import generate_field
    from meltemi.wind.turbulence.grid import grid_for

    if gust is not None and not isinstance(gust, WindSeries):
        raise InputError(f"--gust: {gust.label} is no transient; expected EOG, EDC, ECD, ECG, EWSH or EWSV")
    grid = grid_for(turbine, described.points, width=width)
    folder_for(out)
    with progress_bar(described.label, compiles=False) as progress:
        box = generate_field(described, grid, duration, progress)
    return box if gust is None else with_gust(box, gust)


def _look(
    found: SteadyWind | WindSeries | WindBox,
    turbine: Turbine | None,
    out: Path,
    file_format: str | None,
    target: TurbulentWind | None = None,
) -> None:
    """Table, figures and, if a format is given, the wind itself as a file."""
    from meltemi.core.errors import did_you_mean
    from meltemi.report.plots import save
    from meltemi.report.tables import field_rows, series_rows, write_csv
    from meltemi.report.wind_plots import plot_wind
    from meltemi.wind.fields import SteadyWind, WindBox
    from meltemi.wind.files import write_wind
    from meltemi.wind.statistics import field_statistics, series_statistics

    if file_format is not None and file_format not in SUFFIXES:
        raise InputError(f"--format {file_format}: {did_you_mean(file_format, SUFFIXES)}")
    height = None if turbine is None else turbine.hub_height
    if isinstance(found, WindBox):
        head, rows = field_rows(field_statistics(found, height))
    else:
        head, rows = series_rows(series_statistics(found))
    out = folder_for(out)
    files: list[Path] = []
    if file_format is not None and not isinstance(found, SteadyWind):
        if isinstance(found, WindBox):
            files += write_wind(found, out / f"wind{SUFFIXES[file_format]}", file_format)
        else:
            files += write_wind(found, out / "wind.wnd")
    files.append(write_csv(out / "statistics.csv", head, rows))
    for name, figure in plot_wind(found, turbine, target=target).items():
        files.append(save(figure, out / f"{name}.png"))
    print_table(found.label, head, rows, text_columns=2)
    if isinstance(found, WindBox):
        print(_size(found))
    for file in files:
        print(f"wrote {file}")


def _size(box: WindBox) -> str:
    """One sentence on grid and duration."""
    planes, rows, columns = box.velocity.shape[:3]
    return (
        f"{planes} planes every {box.dt:g} s ({planes * box.dt:g} s), {rows} rows from {box.bottom:g} m to "
        f"{box.top:g} m, {columns} columns across {box.width:g} m, {'periodic, ' if box.periodic else ''}carried at "
        f"{box.speed:g} m/s"
    )
