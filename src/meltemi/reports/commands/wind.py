"""``meltemi wind``: generation of IEC 61400-1 winds, evaluation of wind files."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import meltemi
from meltemi.app.options import (
    IEC_MODELS,
    TURBINES,
    ClassOption,
    DirectionOption,
    EditionOption,
    Options,
    SpectrumOption,
)
from meltemi.app.terminal import OutOption, print_table, progress_bar, suggest, write_figure, wrote
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.formats import suffixes
from meltemi.wind_files.formats import FORMATS, WINDS

if TYPE_CHECKING:
    from meltemi.iec.models import IecModel
    from meltemi.turbine.power_turbine import AnyTurbine
    from meltemi.wind.fields import SteadyWind, WindBox, WindSeries
    from meltemi.wind.turbulent import TurbulentWind

SUFFIXES = {f.name: f.suffix for f in WINDS}
FIELDS, SERIES = ([f.name for f in WINDS if kind in f.holds] for kind in ("WindBox", "WindSeries"))
"""Names of the formats of a field and of a series."""
FIGURES = ("series", "spectra", "coherence", "section", "profile")
"""Names of all figures of a wind."""


@dataclass(frozen=True)
class IecOptions:
    """Options of a wind of IEC 61400-1, under the names of its settings."""

    wind_class: ClassOption = None
    speed: Annotated[float | None, "--speed", "--wind-speed", "Mean at hub height [m/s]."] = None
    seed: Annotated[int | None, "Of the turbulence [1]."] = None
    edition: EditionOption = None
    intensity: Annotated[float | None, "Turbulence intensity, e.g. 0.14, in place of the class's."] = None
    spectrum: SpectrumOption = None
    coherent: Annotated[str | None, "Components coherent across the rotor: u, all [u]."] = None
    shear_exponent: Annotated[float | None, "--shear", "Power-law exponent [that of the model]."] = None
    direction: DirectionOption = None
    points: Annotated[int | None, "Grid points across [25]."] = None
    dt: Annotated[float | None, "Between planes [s] [0.1]."] = None
    periodic: Annotated[bool, "Periodic, as long as the simulation."] = False
    unscaled: Annotated[bool, "Do not scale to the exact deviation."] = False
    sign: Annotated[int | None, "Of a direction change or shear: 1, -1 [1]."] = None
    begin: Annotated[float | None, "Of a transient [s] [60]."] = None
    years: Annotated[int | None, "Of the gusts of edition 2: 1, 50."] = None
    steady: Annotated[bool, "EWM: steady in place of turbulent."] = False

    def settings(self) -> dict[str, Any]:
        """The given settings, in SI units."""
        settings = {name: value for name, value in asdict(self).items() if value is not None and value is not False}
        if settings.pop("unscaled", False):
            settings["scaled"] = False
        return settings | ({"direction": radians(settings["direction"])} if "direction" in settings else {})


@dataclass(frozen=True)
class FieldOptions(Options):
    """Options of a turbulent field."""

    duration: Annotated[float | None, "Duration of the simulation [s] [600]."] = None
    width: Annotated[float | None, "Of the grid [m] [1.2 diameters]."] = None
    hub_series: Annotated[Path | None, "CSV file with the wind at the hub, which the field reproduces."] = None
    gust: Annotated[str | None, "Gust superimposed on the turbulence: EOG, ECD, ECG, EDC, EWSH, EWSV."] = None


def wind(
    *,
    model: Annotated[
        str | None,
        typer.Argument(help="NTM, ETM, EWM1, EWM50, NWP, EOG, EDC, ECD, ECG, EWSH, EWSV.", autocompletion=IEC_MODELS),
    ] = None,
    source: Annotated[Path | None, "--from", f"Evaluate a wind file instead: {suffixes(FORMATS)}."] = None,
    iec: IecOptions,
    field: FieldOptions,
    turbine: Annotated[str | None, "A turbine's name or YAML file [nrel5mw].", TURBINES] = None,
    file_format: Annotated[
        str | None, "--format", f"Of a field: {', '.join(FIELDS)} [bts]; of a series: {', '.join(SERIES)}."
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Generate a wind of IEC 61400-1 or evaluate a wind file: table, plots, field."""
    if model is not None and source is None:
        options = _generate(model.upper(), iec.settings(), field, turbine or "nrel5mw", file_format, out)
    elif source is not None and model is None:
        if given := [*map(_option, iec.settings()), *field.given()]:
            raise InputError(f"{', '.join(given)}: a wind file is used unchanged; omit these options")
        options = _evaluate(source, turbine, file_format, out)
    else:
        raise InputError("specify either a model (such as NTM) or --from FILE")
    suggest("run", turbine or "nrel5mw", *options, "--out", f"{out}-run")


def _evaluate(source: Path, turbine: str | None, file_format: str | None, out: Path) -> tuple[object, ...]:
    """Evaluate a wind file; returns the options of a run in it."""
    wind = _read(source)
    _check_format(file_format, wind)
    described = meltemi.load_turbine(turbine) if turbine else None
    _look(wind, described, out, file_format)
    whole = source.suffix.lower() != ".csv"  # a run takes no hub-height series
    return ("--wind-file", source) if whole else ("--wind-speed", 12, "--turbulence", 0.14)


def _generate(
    name: str, settings: dict[str, Any], field: FieldOptions, turbine: str, file_format: str | None, out: Path
) -> tuple[object, ...]:
    """Generate a wind of IEC 61400-1; returns the options of a run in it."""
    from meltemi.iec.models import MODELS, iec_wind

    used = meltemi.load_turbine(turbine)
    of_gust: tuple[str, ...] = () if field.gust is None else ("sign", "begin", "years")
    onto = {n: settings.pop(n) for n in of_gust if n in settings}
    if name in MODELS:  # otherwise the error reports it
        _check_options(MODELS[name], settings)
        if field.hub_series is not None and MODELS[name].kind == "turbulent" and "steady" not in settings:
            settings["hub_series"] = meltemi.io.read_hub_csv(field.hub_series)
    wind = iec_wind(name, turbine=used, **settings)
    if (given := [*field.given()]) and not isinstance(wind, meltemi.TurbulentWind):
        raise InputError(f"{given[0]}: {name} does not generate a turbulent field; remove the option")
    _check_format(file_format, wind)
    seconds = 600.0 if field.duration is None else field.duration
    if isinstance(wind, meltemi.TurbulentWind):
        added, kind = None, file_format or "bts"
        if field.gust is not None:
            onto |= {n: settings[n] for n in ("wind_class", "edition", "intensity") if n in settings}
            onto["speed"] = wind.speed
            added = _gust(field.gust.upper(), used, onto, seconds, "periodic" in settings)
        box = _field(wind, used, seconds, field.width, added)
        _look(replace(box, source=f"{name}, {box.label}"), used, out, kind, wind if added is None else None)
    else:
        kind = "uniform"
        _look(wind, used, out, kind)
    file = out / f"wind{SUFFIXES[kind]}"
    of_run = ("--wind-speed", f"{wind.speed:g}") if isinstance(wind, meltemi.SteadyWind) else ("--wind-file", file)
    return (*of_run, "--duration", f"{seconds:g}")


UNREACHABLE = ("roughness", "veer")
"""Settings that only Python and case files have."""


def _option(name: str) -> str:
    """The command-line option of a setting."""
    special = {"shear_exponent": "--shear", "scaled": "--unscaled"}
    return special.get(name, f"--{name.replace('_', '-')}")


def _check_options(model: IecModel, options: dict[str, Any], of: str = "") -> None:
    """Raise an error for options that do not apply to a model, and for missing required options."""
    from meltemi.iec.models import SITUATION

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
    if name not in SUFFIXES:
        raise InputError(f"--format {name}: {did_you_mean(name, SUFFIXES)}")
    if isinstance(wind, meltemi.SteadyWind):
        raise InputError(f"--format {name}: {wind.label} needs no file; leave it out")
    what, valid = ("a series", SERIES) if isinstance(wind, meltemi.WindSeries) else ("a field", FIELDS)
    if name not in valid:
        expected = " or ".join([", ".join(valid[:-1]), valid[-1]] if len(valid) > 1 else valid)
        raise InputError(f"--format {name}: {wind.label} is {what}; expected {expected}")


def _gust(name: str, turbine: AnyTurbine, options: dict[str, Any], duration: float, periodic: bool) -> WindSeries:
    """The gust of ``--gust``, with the options that apply to it."""
    from meltemi.iec.models import MODELS, SITUATION, iec_wind

    transients = [m.name for m in MODELS.values() if m.kind == "transient"]
    if name not in transients:
        raise InputError(f"--gust: unknown gust {name!r}; {did_you_mean(name, transients)}")
    takes = (*MODELS[name].takes(), *SITUATION, "sign", "begin", "years")
    options = {n: v for n, v in options.items() if n in takes}
    _check_options(MODELS[name], options, "--gust ")
    if periodic:
        raise InputError(f"--periodic: the field repeats, and --gust {name} would repeat; remove one of the two")
    gust = iec_wind(name, turbine=turbine, **options)
    assert isinstance(gust, meltemi.WindSeries)
    if gust.time[0] >= duration:
        raise InputError(f"--gust: {gust.label} begins when the run of {duration:g} s is over; choose another --begin")
    return gust


def _read(path: Path) -> WindBox | WindSeries:
    """Read any wind file; hub-height wind becomes a series."""
    import numpy as np

    if path.suffix.lower() != ".csv":
        return meltemi.read_wind(path)
    hub = meltemi.io.read_hub_csv(path)
    v, w = (np.zeros_like(hub.u) if c is None else c for c in (hub.v, hub.w))
    return meltemi.WindSeries(
        time=hub.time, speed=np.hypot(hub.u, v), direction=-np.arctan2(v, hub.u), vertical=w, source=path.name
    )


def _field(
    described: TurbulentWind, turbine: AnyTurbine, duration: float, width: float | None, gust: WindSeries | None
) -> WindBox:
    grid = meltemi.wind.wind_grid_for(turbine, described.points, width=width)
    with progress_bar(described.label) as progress:
        box = meltemi.wind.generate_field(described, grid, duration, progress)
    return box if gust is None else meltemi.wind.with_gust(box, gust)


def _look(
    wind: SteadyWind | WindSeries | WindBox,
    turbine: AnyTurbine | None,
    out: Path,
    file_format: str | None,
    target: TurbulentWind | None = None,
) -> None:
    """Write the table, the figures and, if a format is given, the wind file."""
    from meltemi.report.tables import field_rows, series_rows

    height = None if turbine is None else turbine.hub_height
    if isinstance(wind, meltemi.WindBox):
        head, rows = field_rows(meltemi.wind.field_statistics(wind, height))
    else:
        head, rows = series_rows(meltemi.wind.series_statistics(wind))
    figures = meltemi.plots.plot_wind(wind, turbine, target=target)
    files: list[Path] = []
    if file_format is not None and not isinstance(wind, meltemi.SteadyWind):
        files += meltemi.io.write_wind(wind, out / f"wind{SUFFIXES[file_format]}", file_format)
    files.append(meltemi.io.write_csv(out / "statistics.csv", head, rows))
    for name in FIGURES:
        if name in figures:
            files.append(write_figure(out / f"{name}.png", figures[name]))
        else:
            (out / f"{name}.png").unlink(missing_ok=True)  # of another wind
    print_table(wind.label, head, rows, text_columns=2)
    if isinstance(wind, meltemi.WindBox):
        print(_size(wind))
    wrote(*files)


def _size(box: WindBox) -> str:
    """One sentence about grid and duration."""
    planes, rows, columns = box.velocity.shape[:3]
    return (
        f"{planes} planes every {box.dt:g} s ({planes * box.dt:g} s), {rows} rows from {box.bottom:g} m to "
        f"{box.top:g} m, {columns} columns across {box.width:g} m, {'periodic, ' if box.periodic else ''}carried at "
        f"{box.speed:g} m/s"
    )
