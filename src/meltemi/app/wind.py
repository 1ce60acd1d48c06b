"""``meltemi wind``: generation of IEC 61400-1 winds, evaluation of wind files."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import IEC_MODELS, TURBINES, ClassOption, DirectionOption, EditionOption, SpectrumOption
from meltemi.app.terminal import OutOption, folder_for, print_table, progress_bar, suggest, wrote
from meltemi.core.errors import InputError
from meltemi.core.formats import suffixes
from meltemi.wind.formats import FORMATS, WINDS

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine
    from meltemi.wind.fields import SteadyWind, WindBox, WindSeries
    from meltemi.wind.iec.models import IecModel
    from meltemi.wind.turbulent import TurbulentWind

SUFFIXES = {f.name: f.suffix for f in WINDS}
FIELDS, SERIES = ([f.name for f in WINDS if kind in f.holds] for kind in ("WindBox", "WindSeries"))
"""Names of the formats of a field and of a series."""
FIGURES = ("series", "spectra", "coherence", "section", "profile")
"""Names of all figures of a wind."""


def wind(
    model: Annotated[
        str | None,
        typer.Argument(help="NTM, ETM, EWM1, EWM50, NWP, EOG, EDC, ECD, ECG, EWSH, EWSV.", autocompletion=IEC_MODELS),
    ] = None,
    source: Annotated[
        Path | None, typer.Option("--from", help=f"Evaluate a wind file instead: {suffixes(FORMATS)}.")
    ] = None,
    wind_class: ClassOption = None,
    speed: Annotated[float | None, typer.Option("--speed", "--wind-speed", help="Mean at hub height [m/s].")] = None,
    turbine: Annotated[
        str | None, typer.Option("--turbine", help="A turbine's name or YAML file [nrel5mw].", autocompletion=TURBINES)
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Of the turbulence [1].")] = None,
    duration: Annotated[float | None, typer.Option("--duration", help="Duration of the simulation [s] [600].")] = None,
    edition: EditionOption = None,
    intensity: Annotated[
        float | None, typer.Option("--intensity", help="Turbulence intensity, e.g. 0.14, in place of the class's.")
    ] = None,
    spectrum: SpectrumOption = None,
    coherent: Annotated[
        str | None, typer.Option("--coherent", help="Components coherent across the rotor: u, all [u].")
    ] = None,
    shear: Annotated[float | None, typer.Option("--shear", help="Power-law exponent [that of the model].")] = None,
    direction: DirectionOption = None,
    points: Annotated[int | None, typer.Option("--points", help="Grid points across [25].")] = None,
    dt: Annotated[float | None, typer.Option("--dt", help="Between planes [s] [0.1].")] = None,
    width: Annotated[float | None, typer.Option("--width", help="Of the grid [m] [1.2 diameters].")] = None,
    periodic: Annotated[bool, typer.Option("--periodic", help="Periodic, as long as the simulation.")] = False,
    unscaled: Annotated[bool, typer.Option("--unscaled", help="Do not scale to the exact deviation.")] = False,
    hub_series: Annotated[
        Path | None, typer.Option("--hub-series", help="CSV file with the wind at the hub, which the field reproduces.")
    ] = None,
    gust: Annotated[
        str | None, typer.Option("--gust", help="Gust superimposed on the turbulence: EOG, ECD, ECG, EDC, EWSH, EWSV.")
    ] = None,
    sign: Annotated[int | None, typer.Option("--sign", help="Of a direction change or shear: 1, -1 [1].")] = None,
    begin: Annotated[float | None, typer.Option("--begin", help="Of a transient [s] [60].")] = None,
    years: Annotated[int | None, typer.Option("--years", help="Of the gusts of edition 2: 1, 50.")] = None,
    steady: Annotated[bool, typer.Option("--steady", help="EWM: steady in place of turbulent.")] = False,
    file_format: Annotated[
        str | None,
        typer.Option("--format", help=f"Of a field: {', '.join(FIELDS)} [bts]; of a series: {', '.join(SERIES)}."),
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Generate a wind of IEC 61400-1 or evaluate a wind file: table, plots, field."""
    settings = {
        "seed": seed,
        "spectrum": spectrum,
        "coherent": coherent,
        "shear_exponent": shear,
        "direction": None if direction is None else radians(direction),
        "points": points,
        "dt": dt,
        "periodic": periodic or None,
        "scaled": False if unscaled else None,
    }
    named = {"wind_class": wind_class, "edition": edition, "speed": speed, "intensity": intensity}
    transient = {"sign": sign, "begin": begin, "years": years}
    every = settings | named | transient | {"steady": steady or None}
    options: dict[str, Any] = {name: v for name, v in every.items() if v is not None}
    fields = {"--duration": duration, "--width": width, "--hub-series": hub_series, "--gust": gust}
    of_field = [option for option, value in fields.items() if value is not None]
    if (model is None) == (source is None):
        raise InputError("specify either a model (such as NTM) or --from FILE")
    from meltemi.turbine.library import load_turbine

    if source is not None:
        if given := [*(_option(n) for n in options), *of_field]:
            raise InputError(f"{', '.join(given)}: a wind file is used unchanged; omit these options")
        found = _read(source)
        _check_format(file_format, found)
        described = load_turbine(turbine) if turbine else None
        folder_for(out)
        _look(found, described, out, file_format)
        whole = source.suffix.lower() != ".csv"  # a run takes no hub-height series
        wind_options = ("--wind-file", source) if whole else ("--wind-speed", 12, "--turbulence", 0.14)
        suggest("run", turbine or "nrel5mw", *wind_options, "--out", f"{out}-run")
        return
    assert model is not None
    used = load_turbine(turbine or "nrel5mw")
    from meltemi.wind.fields import SteadyWind
    from meltemi.wind.iec.models import MODELS, iec_wind
    from meltemi.wind.turbulent import TurbulentWind

    onto = {n: options.pop(n) for n in transient if gust is not None and n in options}
    name = model.upper()
    if name in MODELS:  # otherwise the error reports it
        _check_options(MODELS[name], options)
    if hub_series is not None and name in MODELS and MODELS[name].kind == "turbulent" and not steady:
        from meltemi.wind.files import read_hub_csv

        options["hub_series"] = read_hub_csv(hub_series)
    made: SteadyWind | WindSeries | TurbulentWind = iec_wind(name, turbine=used, **options)
    if of_field and not isinstance(made, TurbulentWind):
        raise InputError(f"{of_field[0]}: {name} does not generate a turbulent field; remove the option")
    _check_format(file_format, made)
    seconds = 600.0 if duration is None else duration
    added = None
    if gust is not None and isinstance(made, TurbulentWind):
        onto |= {n: options[n] for n in named if n in options} | {"speed": made.speed}
        added = _gust(gust.upper(), used, onto, seconds, periodic)
    folder_for(out)
    if isinstance(made, TurbulentWind):
        box = _field(made, used, seconds, width, added)
        box = replace(box, source=f"{name}, {box.label}")
        _look(box, used, out, file_format or "bts", made if added is None else None)
    else:
        _look(made, used, out, "uniform")
    file = out / f"wind{SUFFIXES[file_format or 'bts' if isinstance(made, TurbulentWind) else 'uniform']}"
    of_run = ("--wind-file", file) if not isinstance(made, SteadyWind) else ("--wind-speed", f"{made.speed:g}")
    suggest("run", turbine or "nrel5mw", *of_run, "--duration", f"{seconds:g}", "--out", f"{out}-run")


UNREACHABLE = ("roughness", "veer")
"""Settings that only Python and case files have."""


def _option(name: str) -> str:
    """The command-line option of a setting."""
    special = {"shear_exponent": "--shear", "scaled": "--unscaled"}
    return special.get(name, f"--{name.replace('_', '-')}")


def _check_options(model: IecModel, options: dict[str, Any], of: str = "") -> None:
    """Raise an error for options that do not apply to a model, and for missing required options."""
    from meltemi.wind.iec.models import SITUATION

    steady = "steady" in options and model.make_steady is not None
    takes = model.takes(steady=steady)
    for name in options:
        if name not in (*takes, *SITUATION):
            valid = [_option(n) for n in takes if n not in (*SITUATION, *UNREACHABLE)]
            raise InputError(
                f"{_option(name)} is no option of {of}{model.name}{' --steady' * steady} ({model.title}); "
                f"it has {', '.join(valid)}"
            )
    if missing := [_option(n) for n in model.needs(steady=steady) if n not in options and n != "turbine"]:
        raise InputError(f"{of}{model.name} ({model.title}) needs {' and '.join(missing)}")


def _check_format(name: str | None, wind: SteadyWind | WindSeries | WindBox | TurbulentWind) -> None:
    """Check that the kind of wind can be written in this format, before the computation starts."""
    if name is None:
        return
    from meltemi.core.errors import did_you_mean
    from meltemi.wind.fields import SteadyWind, WindSeries

    if name not in SUFFIXES:
        raise InputError(f"--format {name}: {did_you_mean(name, SUFFIXES)}")
    if isinstance(wind, SteadyWind):
        raise InputError(f"--format {name}: {wind.label} needs no file; leave it out")
    what, valid = ("a series", SERIES) if isinstance(wind, WindSeries) else ("a field", FIELDS)
    if name not in valid:
        expected = " or ".join([", ".join(valid[:-1]), valid[-1]] if len(valid) > 1 else valid)
        raise InputError(f"--format {name}: {wind.label} is {what}; expected {expected}")


def _gust(name: str, turbine: AnyTurbine, options: dict[str, Any], duration: float, periodic: bool) -> WindSeries:
    """The gust of ``--gust``, with the options that apply to it."""
    from meltemi.core.errors import did_you_mean
    from meltemi.wind.fields import WindSeries
    from meltemi.wind.iec.models import MODELS, SITUATION, iec_wind

    transients = [m.name for m in MODELS.values() if m.kind == "transient"]
    if name not in transients:
        raise InputError(f"--gust: unknown gust {name!r}; {did_you_mean(name, transients)}")
    takes = (*MODELS[name].takes(), *SITUATION, "sign", "begin", "years")
    options = {n: v for n, v in options.items() if n in takes}
    _check_options(MODELS[name], options, "--gust ")
    if periodic:
        raise InputError(f"--periodic: the field repeats, and --gust {name} would repeat; remove one of the two")
    found = iec_wind(name, turbine=turbine, **options)
    assert isinstance(found, WindSeries)
    if found.time[0] >= duration:
        raise InputError(f"--gust: {found.label} begins when the run of {duration:g} s is over; choose another --begin")
    return found


def _read(path: Path) -> WindBox | WindSeries:
    """Read any wind file; hub-height wind becomes a series."""
    import numpy as np

    from meltemi.wind.fields import WindSeries
    from meltemi.wind.files import read_hub_csv
    from meltemi.wind.formats import read_wind

    if path.suffix.lower() != ".csv":
        return read_wind(path)
    hub = read_hub_csv(path)
    v, w = (np.zeros_like(hub.u) if c is None else c for c in (hub.v, hub.w))
    return WindSeries(
        time=hub.time, speed=np.hypot(hub.u, v), direction=-np.arctan2(v, hub.u), vertical=w, source=path.name
    )


def _field(
    described: TurbulentWind,
    turbine: AnyTurbine,
    duration: float,
    width: float | None,
    gust: WindSeries | None,
) -> WindBox:
    from meltemi.wind.superposition import with_gust
    from meltemi.wind.turbulence.field import generate_field
    from meltemi.wind.turbulence.grid import wind_grid_for

    grid = wind_grid_for(turbine, described.points, width=width)
    with progress_bar(described.label, compiles=False) as progress:
        box = generate_field(described, grid, duration, progress)
    return box if gust is None else with_gust(box, gust)


def _look(
    found: SteadyWind | WindSeries | WindBox,
    turbine: AnyTurbine | None,
    out: Path,
    file_format: str | None,
    target: TurbulentWind | None = None,
) -> None:
    """Write the table, the figures and, if a format is given, the wind file."""
    from meltemi.report.plots import save
    from meltemi.report.tables import field_rows, series_rows, write_csv
    from meltemi.report.wind_plots import plot_wind
    from meltemi.wind.fields import SteadyWind, WindBox
    from meltemi.wind.formats import write_wind
    from meltemi.wind.statistics import field_statistics, series_statistics

    height = None if turbine is None else turbine.hub_height
    if isinstance(found, WindBox):
        head, rows = field_rows(field_statistics(found, height))
    else:
        head, rows = series_rows(series_statistics(found))
    figures = plot_wind(found, turbine, target=target)
    files: list[Path] = []
    if file_format is not None and not isinstance(found, SteadyWind):
        files += write_wind(found, out / f"wind{SUFFIXES[file_format]}", file_format)
    files.append(write_csv(out / "statistics.csv", head, rows))
    for name in FIGURES:
        if name in figures:
            files.append(save(figures[name], out / f"{name}.png"))
        else:
            (out / f"{name}.png").unlink(missing_ok=True)  # of another wind
    print_table(found.label, head, rows, text_columns=2)
    if isinstance(found, WindBox):
        print(_size(found))
    wrote(*files)


def _size(box: WindBox) -> str:
    """One sentence about grid and duration."""
    planes, rows, columns = box.velocity.shape[:3]
    return (
        f"{planes} planes every {box.dt:g} s ({planes * box.dt:g} s), {rows} rows from {box.bottom:g} m to "
        f"{box.top:g} m, {columns} columns across {box.width:g} m, {'periodic, ' if box.periodic else ''}carried at "
        f"{box.speed:g} m/s"
    )
