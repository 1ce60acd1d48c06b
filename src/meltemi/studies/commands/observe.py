"""``meltemi observe``: wind and loads from measured signals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.options import TURBINES
from meltemi.app.terminal import OutOption, folder_for, print_table, say, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError


def observe(
    signals: Annotated[Path, typer.Argument(help="Signals: a CSV file with units in its head, or a result file.")],
    turbine: Annotated[str, typer.Option("--turbine", help="A turbine's name or YAML file.", autocompletion=TURBINES)],
    names: Annotated[
        str | None, typer.Option("--names", help="Names of columns, e.g. GEN_RPM=generator_speed,P=generator_power.")
    ] = None,
    density: Annotated[float | None, typer.Option("--density", help="Density of the air [kg/m^3] [1.225].")] = None,
    intensity: Annotated[
        float, typer.Option("--reference-intensity", help="Of the turbulence: 0.16, 0.14, 0.12 in class A, B, C.")
    ] = 0.16,
    shear: Annotated[float, typer.Option("--shear", help="Power-law exponent of the mean wind.")] = 0.2,
    samples: Annotated[int, typer.Option("--samples", help="Samples for the bands of equivalent loads.")] = 8,
    transient: Annotated[float, typer.Option("--transient", help="Excluded from equivalent loads [s].")] = 20.0,
    out: OutOption = Path("out"),
) -> None:
    """Estimate wind and loads from speed, power, pitch and tower-top acceleration; writes tables and a plot."""
    if not 0 <= samples <= 1000:
        raise InputError(f"--samples {samples}: expected 0 to 1000")
    pairs = [pair.partition("=") for pair in (names or "").split(",") if pair.strip()]
    if any(not (own.strip() and sign and channel.strip()) for own, sign, channel in pairs):
        raise InputError(f"--names {names!r}: expected COLUMN=CHANNEL, separated by commas")
    from dataclasses import replace

    from meltemi.core.yamlfile import validated
    from meltemi.environment.site import Environment
    from meltemi.postprocess.files import read_result
    from meltemi.postprocess.files.netcdf import write_netcdf
    from meltemi.postprocess.files.signals import read_signals
    from meltemi.simulation.rotors import build
    from meltemi.studies.observer import ExpectedTurbulence, observer
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic

    described = aeroelastic(load_turbine(turbine), "meltemi observe")
    air = validated({} if density is None else {"air_density": density}, Environment, "--density")
    if signals.suffix.lower() == ".csv":
        measured = read_signals(signals, {own.strip(): channel.strip() for own, _, channel in pairs})
    elif pairs:
        raise InputError(f"--names: only for CSV files, and {signals} is none")
    else:
        measured = read_result(signals)
    if not 0.0 <= transient < measured.time[-1] - measured.time[0]:
        raise InputError(f"--transient {transient:g}: must be at least 0 and less than the series lasts")
    measured = replace(measured, meta=measured.meta | {"transient": float(measured.time[0]) + transient})
    from meltemi.report.plots import save
    from meltemi.report.tables import write_csv
    from meltemi.studies.observer_plots import estimate_rows, load_rows, plot_estimate

    folder_for(out)
    with simulation_bar(f"observer of {described.name}") as progress:
        model = build(described, environment=air)
        made = observer(model, turbulence=ExpectedTurbulence(intensity), shear_exponent=shear, progress=progress)
    found = made.estimate(measured, samples=samples)
    files = [
        write_netcdf(found.result, out / "estimate.nc"),
        write_csv(out / "estimate.csv", *estimate_rows(found)),
        write_csv(out / "equivalent-loads.csv", *load_rows(found, measured)),
        save(plot_estimate(found, measured), out / "estimate.png"),
    ]
    wind = found.result.evaluated["rotor_effective_wind"]
    print_table(f"{described.name}: damage-equivalent loads, 1 Hz", *load_rows(found, measured), text_columns=2)
    print(f"rotor-effective wind {wind.mean():.2f} m/s, standard deviation {wind.std():.2f} m/s")
    print("estimate: of the estimated series alone; expected: with the part that the signals do not show, 90 % band")
    wrote(*files)
    for warning in found.result.warnings:
        say(f"warning: {warning}")
    common = set(found.result.names) & set(measured.names)
    suggest(*(("diff", out / "estimate.nc", signals) if common and not pairs else ("inspect", turbine)), "--out", out)
