"""``meltemi flutter`` and ``meltemi parked``: stability over rotor speed, and at standstill over yaw and pitch."""

from __future__ import annotations

from math import degrees, pi, radians
from pathlib import Path
from typing import Annotated

import meltemi
from meltemi.app.options import TurbineArgument, load_aeroelastic, of_options
from meltemi.app.scans import angles_of, at_speeds, finish, speeds_of
from meltemi.app.terminal import OutOption, print_table, simulation_bar, suggest, write_results, wrote
from meltemi.core.errors import InputError


def flutter(
    turbine: TurbineArgument,
    rotor_speeds: Annotated[str | None, "Rotor speeds [rpm], e.g. 8:24:1 [0.6 to 2 times rated]."] = None,
    wind_speed: Annotated[float, "Wind speed [m/s]; 1 is almost still air."] = 1.0,
    pitch: Annotated[float | None, "Pitch angle of all blades [deg] [smallest]."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compute the damping of the modes over rotor speed, and the flutter limit: table, plot, CSV."""
    described = load_aeroelastic(turbine, "meltemi flutter")
    turns = None
    if rotor_speeds is not None:
        turns = [w * pi / 30.0 for w in speeds_of(rotor_speeds, "--rotor-speeds", "rpm")]
        if turns != sorted(set(turns)):
            raise InputError(f"--rotor-speeds {rotor_speeds!r}: expected increasing speeds")
    angle = None if pitch is None else radians(angles_of(f"{pitch:g}", "--pitch")[0])
    wind = of_options({"speed": wind_speed}, meltemi.SteadyWind, "--wind-speed")
    from meltemi.report.tables import number
    from meltemi.studies.stability import flutter_rows, limit_text

    with simulation_bar("flutter", len(turns or ()), "points") as progress:
        diagram = meltemi.analysis.flutter(described, turns, wind=wind, pitch=angle, progress=progress)
    rows = [
        [number(speed * 30.0 / pi), number(100.0 * least)]
        for speed, least in zip(diagram.rotor_speed, diagram.least, strict=True)
    ]
    title = f"{described.name}: least damped blade mode, wind {diagram.wind_speed:g} m/s"
    print_table(title, ["rotor rpm", "damping %"], rows, 0, all_rows=flutter_rows(diagram))
    print(limit_text(diagram))
    wrote(*write_results(out / "flutter", flutter_rows(diagram), meltemi.plots.plot_flutter(diagram, described.name)))
    suggest("parked", turbine, "--out", out)
    finish(at_speeds({speed * 30.0 / pi: why for speed, why in diagram.failures.items()}, "rpm"))


def parked(
    turbine: TurbineArgument,
    wind_speed: Annotated[float, "Wind speed at hub height [m/s]."] = 50.0,
    shear: Annotated[float, "Power-law exponent."] = 0.11,
    yaw: Annotated[str, "Yaw misalignments [deg], e.g. -30,0,30 or first:last:step."] = "-180:180:10",
    pitch: Annotated[str, "Pitch angles [deg]."] = "0:90:15",
    deep_stall: Annotated[str, "Polars in deep stall: given, plate."] = "given",
    out: OutOption = Path("out"),
) -> None:
    """Compute the damping of a turbine at standstill over yaw misalignment and pitch: table, plot, CSV."""
    described = load_aeroelastic(turbine, "meltemi parked")
    yaws, pitches = angles_of(yaw, "--yaw"), angles_of(pitch, "--pitch")
    wind = of_options({"speed": wind_speed}, meltemi.SteadyWind, "--wind-speed")
    wind = of_options({"speed": wind_speed, "shear_exponent": shear}, meltemi.SteadyWind, "--shear")
    options = of_options({"deep_stall": deep_stall}, meltemi.ModelOptions, "--deep-stall")
    from meltemi.report.tables import number
    from meltemi.studies.stability import parked_rows

    with simulation_bar("parked", len(yaws) * len(pitches), "points") as progress:
        axes = ([radians(angle) for angle in angles] for angles in (yaws, pitches))
        result = meltemi.analysis.parked_stability(described, *axes, wind=wind, options=options, progress=progress)
    rows = [[number(angle), *(number(100.0 * d) for d in row)] for angle, row in zip(yaws, result.damping, strict=True)]
    title = f"{described.name} at standstill, {wind.speed:g} m/s: smallest damping ratio [%] over yaw and pitch [deg]"
    print_table(title, ["yaw", *(f"pitch {number(angle)}" for angle in pitches)], rows, 0, all_rows=parked_rows(result))
    print(
        f"{(result.damping < 0.0).sum()} of {result.damping.size} points have a mode with negative damping (unstable)"
    )
    wrote(*write_results(out / "parked", parked_rows(result), meltemi.plots.plot_parked(result, described.name)))
    suggest("loads", "plan", turbine, "--class", "IB", "--quick")
    finish(
        f"failed at a yaw of {degrees(where):g} deg and a pitch of {degrees(angle):g} deg: {why}"
        for (where, angle), why in result.failures.items()
    )
