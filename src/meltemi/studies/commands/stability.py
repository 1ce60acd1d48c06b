"""``meltemi flutter`` and ``meltemi parked``: stability over rotor speed, and at standstill over yaw and pitch."""

from __future__ import annotations

from math import degrees, pi, radians
from pathlib import Path
from typing import Annotated

import typer

from meltemi.app.options import TurbineArgument
from meltemi.app.scans import angles_of, finish, speeds_of
from meltemi.app.terminal import OutOption, folder_for, print_table, say, simulation_bar, suggest, wrote
from meltemi.core.errors import InputError


def flutter(
    turbine: TurbineArgument,
    rotor_speeds: Annotated[
        str | None, typer.Option("--rotor-speeds", help="Rotor speeds [rpm], e.g. 8:24:1 [0.6 to 2 times rated].")
    ] = None,
    wind_speed: Annotated[float, typer.Option(help="Wind speed [m/s]; 1 is almost still air.")] = 1.0,
    pitch: Annotated[float | None, typer.Option(help="Pitch angle of all blades [deg] [smallest].")] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compute the damping of the modes over rotor speed, and the flutter limit: table, plot, CSV."""
    from meltemi.core.yamlfile import validated
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic
    from meltemi.wind.fields import SteadyWind

    described = aeroelastic(load_turbine(turbine), "meltemi flutter")
    turns = None
    if rotor_speeds is not None:
        turns = [w * pi / 30.0 for w in speeds_of(rotor_speeds, "--rotor-speeds", "rpm")]
        if turns != sorted(set(turns)):
            raise InputError(f"--rotor-speeds {rotor_speeds!r}: expected increasing speeds")
    angle = None if pitch is None else radians(angles_of(f"{pitch:g}", "--pitch")[0])
    wind = validated({"speed": wind_speed}, SteadyWind, "--wind-speed")
    from meltemi.report.plots import save
    from meltemi.report.tables import number, write_csv
    from meltemi.studies.flutter import flutter as stability_over_speed
    from meltemi.studies.stability import flutter_rows, limit_text, plot_flutter

    folder_for(out)
    with simulation_bar("flutter", len(turns or ()), "points") as progress:
        found = stability_over_speed(described, turns, wind=wind, pitch=angle, progress=progress)
    rows = [
        [number(speed * 30.0 / pi), number(100.0 * least)]
        for speed, least in zip(found.rotor_speed, found.least, strict=True)
    ]
    title = f"{described.name}: least damped blade mode, wind {found.wind_speed:g} m/s"
    print_table(title, ["rotor rpm", "damping %"], rows, 0, all_rows=flutter_rows(found))
    print(limit_text(found))
    wrote(write_csv(out / "flutter.csv", *flutter_rows(found)))
    wrote(save(plot_flutter(found, described.name), out / "flutter.png"))
    suggest("parked", turbine, "--out", out)
    finish({speed * 30.0 / pi: why for speed, why in found.failures.items()}, unit="rpm")


def parked(
    turbine: TurbineArgument,
    wind_speed: Annotated[float, typer.Option(help="Wind speed at hub height [m/s].")] = 50.0,
    shear: Annotated[float, typer.Option(help="Power-law exponent.")] = 0.11,
    yaw: Annotated[str, typer.Option(help="Yaw misalignments [deg], e.g. -30,0,30 or first:last:step.")] = (
        "-180:180:10"
    ),
    pitch: Annotated[str, typer.Option(help="Pitch angles [deg].")] = "0:90:15",
    deep_stall: Annotated[str, typer.Option("--deep-stall", help="Polars in deep stall: given, plate.")] = "given",
    out: OutOption = Path("out"),
) -> None:
    """Compute the damping of a turbine at standstill over yaw misalignment and pitch: table, plot, CSV."""
    from meltemi.core.yamlfile import validated
    from meltemi.simulation.options import ModelOptions
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic
    from meltemi.wind.fields import SteadyWind

    described = aeroelastic(load_turbine(turbine), "meltemi parked")
    yaws, pitches = angles_of(yaw, "--yaw"), angles_of(pitch, "--pitch")
    wind = validated({"speed": wind_speed}, SteadyWind, "--wind-speed")
    wind = validated({"speed": wind_speed, "shear_exponent": shear}, SteadyWind, "--shear")
    options = validated({"deep_stall": deep_stall}, ModelOptions, "--deep-stall")
    from meltemi.report.plots import save
    from meltemi.report.tables import number, write_csv
    from meltemi.studies.parked_modes import parked_stability
    from meltemi.studies.stability import parked_rows, plot_parked

    folder_for(out)
    with simulation_bar("parked", len(yaws) * len(pitches), "points") as progress:
        found = parked_stability(
            described,
            [radians(angle) for angle in yaws],
            [radians(angle) for angle in pitches],
            wind=wind,
            options=options,
            progress=progress,
        )
    rows = [[number(angle), *(number(100.0 * d) for d in row)] for angle, row in zip(yaws, found.damping, strict=True)]
    title = f"{described.name} at standstill, {wind.speed:g} m/s: smallest damping ratio [%] over yaw and pitch [deg]"
    print_table(title, ["yaw", *(f"pitch {number(angle)}" for angle in pitches)], rows, 0, all_rows=parked_rows(found))
    wrote(write_csv(out / "parked.csv", *parked_rows(found)))
    print(f"{(found.damping < 0.0).sum()} of {found.damping.size} points have a mode with negative damping (unstable)")
    wrote(save(plot_parked(found, described.name), out / "parked.png"))
    suggest("loads", "plan", turbine, "--class", "IB", "--quick")
    for (where, angle), why in found.failures.items():
        say(f"failed at a yaw of {degrees(where):g} deg and a pitch of {degrees(angle):g} deg: {why}")
    if found.failures:
        raise typer.Exit(1)
