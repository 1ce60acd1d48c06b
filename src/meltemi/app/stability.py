"""``meltemi flutter``: damping over rotor speed and the flutter limit."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.scans import finish, speeds_of
from meltemi.app.terminal import OutOption, print_table, progress_bar, results_in


def flutter(
    turbine: Annotated[str, typer.Argument(help="A turbine's name or YAML file.")],
    rotor_speeds: Annotated[
        str | None, typer.Option("--rotor-speeds", help="Rotor speeds [rpm], e.g. 8:24:1 [0.6 to 2 times rated].")
    ] = None,
    wind_speed: Annotated[float, typer.Option(help="Wind speed [m/s]; 1 is almost still air.")] = 1.0,
    pitch: Annotated[float | None, typer.Option(help="Pitch angle of all blades [deg] [smallest].")] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compute the damping of the modes over rotor speed, and the flutter limit: table, plot, CSV."""
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic

    described = aeroelastic(load_turbine(turbine), "meltemi flutter")
    turns = None
    if rotor_speeds:
        turns = [w * pi / 30.0 for w in speeds_of(rotor_speeds, "--rotor-speeds", "rpm")]
    from meltemi.report.plots import save
    from meltemi.report.stability import flutter_rows, limit_text, plot_flutter
    from meltemi.report.tables import number, write_csv
    from meltemi.simulation.flutter import flutter as stability_over_speed

    with results_in(out):
        with progress_bar("flutter") as progress:
            found = stability_over_speed(
                described,
                turns,
                wind=wind_speed,
                pitch=None if pitch is None else radians(pitch),
                progress=progress,
            )
        rows = [
            [number(speed * 30.0 / pi), number(100.0 * least)]
            for speed, least in zip(found.rotor_speed, found.least, strict=True)
        ]
        title = f"{described.name}: least damped blade mode, wind {found.wind_speed:g} m/s"
        print_table(title, ["rotor rpm", "damping %"], rows)
        print(limit_text(found))
        print(f"wrote {write_csv(out / 'flutter.csv', *flutter_rows(found))}")
        print(f"wrote {save(plot_flutter(found, described.name), out / 'flutter.png')}")
    finish({speed * 30.0 / pi: why for speed, why in found.failures.items()})
