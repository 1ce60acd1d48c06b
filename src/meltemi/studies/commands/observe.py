"""``meltemi observe``: wind and loads from measured signals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import meltemi
from meltemi.app.options import TURBINES, load_aeroelastic, of_options
from meltemi.app.scans import pairs_of
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, warn, write_figure, wrote
from meltemi.core.errors import InputError


def observe(
    signals: Annotated[Path, "Signals: a CSV file with units in its head, or a result file."],
    turbine: Annotated[str, "--turbine", "A turbine's name or YAML file.", TURBINES],
    names: Annotated[str | None, "Names of columns, e.g. GEN_RPM=generator_speed,P=generator_power."] = None,
    density: Annotated[float | None, "Density of the air [kg/m^3] [1.225]."] = None,
    intensity: Annotated[
        float, "--reference-intensity", "Of the turbulence: 0.16, 0.14, 0.12 in class A, B, C."
    ] = 0.16,
    shear: Annotated[float, "Power-law exponent of the mean wind."] = 0.2,
    samples: Annotated[int, "Samples for the bands of equivalent loads.", Range(0, 1000)] = 8,
    transient: Annotated[float, "Excluded from equivalent loads [s]."] = 20.0,
    out: OutOption = Path("out"),
) -> None:
    """Estimate wind and loads from speed, power, pitch and tower-top acceleration; writes tables and a plot."""
    pairs = pairs_of(names, "--names", "COLUMN=CHANNEL") if names else {}
    described = load_aeroelastic(turbine, "meltemi observe")
    air = of_options({} if density is None else {"air_density": density}, meltemi.Environment, "--density")
    expected = of_options(
        {"reference_intensity": intensity}, meltemi.analysis.ExpectedTurbulence, "--reference-intensity"
    )
    if signals.suffix.lower() == ".csv":
        measured = meltemi.io.read_signals(signals, pairs)
    elif pairs:
        raise InputError(f"--names: only for CSV files, and {signals} is none")
    else:
        measured = meltemi.read_result(signals)
    if not 0.0 <= transient < measured.time[-1] - measured.time[0]:
        raise InputError(f"--transient {transient:g}: must be at least 0 and less than the series lasts")
    measured = replace(measured, meta=measured.meta | {"transient": float(measured.time[0]) + transient})
    from meltemi.studies.observer_plots import estimate_rows, load_rows

    with simulation_bar(f"observer of {described.name}") as progress:
        model = meltemi.build(described, environment=air)
        observer = meltemi.analysis.observer(model, turbulence=expected, shear_exponent=shear, progress=progress)
    estimate = observer.estimate(measured, samples=samples)
    files = [
        meltemi.io.write_netcdf(estimate.result, out / "estimate.nc"),
        meltemi.io.write_csv(out / "estimate.csv", *estimate_rows(estimate)),
        meltemi.io.write_csv(out / "equivalent-loads.csv", *load_rows(estimate, measured)),
        write_figure(out / "estimate.png", meltemi.plots.plot_estimate(estimate, measured)),
    ]
    wind = estimate.result.evaluated["rotor_effective_wind"]
    print_table(f"{described.name}: damage-equivalent loads, 1 Hz", *load_rows(estimate, measured), text_columns=2)
    print(f"rotor-effective wind {wind.mean():.2f} m/s, standard deviation {wind.std():.2f} m/s")
    print("estimate: of the estimated series alone; expected: with the part that the signals do not show, 90 % band")
    wrote(*files)
    warn(estimate.result.warnings)
    common = set(estimate.result.names) & set(measured.names)
    suggest(*(("diff", out / "estimate.nc", signals) if common and not pairs else ("inspect", turbine)), "--out", out)
