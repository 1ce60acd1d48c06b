"""``meltemi sea``: generation and evaluation of seas."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import sea_of_options
from meltemi.app.terminal import OutOption, folder_for, print_table, suggest, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.sea.conditions import Sea


def sea(
    target: Annotated[str, typer.Argument(help="HEIGHT,PERIOD[,DIRECTION] in m, s, deg; or a YAML file of a sea.")],
    depth: Annotated[float, typer.Option("--depth", help="Of the water [m].")] = 30.0,
    duration: Annotated[float, typer.Option("--duration", help="Of the series [s].")] = 600.0,
    regular: Annotated[bool, typer.Option("--regular", help="A regular wave of this height and period.")] = False,
    seed: Annotated[int | None, typer.Option(help="Of the waves [1].")] = None,
    spectrum: Annotated[
        str | None, typer.Option("--spectrum", help="jonswap, pierson_moskowitz, white [jonswap].")
    ] = None,
    crest: Annotated[float | None, typer.Option("--crest", help="Height of an embedded crest [m], at 60 s.")] = None,
    out: OutOption = Path("out"),
) -> None:
    """Generate a sea; write the series of its elevation and kinematics, a table and a plot."""
    given = {"seed": seed, "spectrum": spectrum, "crest": None if crest is None else {"height": crest}}
    described = _described(target, regular, {name: value for name, value in given.items() if value is not None})
    if not (depth > 0.0 and duration > 0.0):
        raise InputError(f"--depth and --duration must be positive, found {depth:g} m and {duration:g} s")
    from meltemi.core.csvfile import write_columns
    from meltemi.report.plots import save
    from meltemi.report.tables import write_csv
    from meltemi.sea.plots import plot_sea
    from meltemi.sea.statistics import SeaSeries, sea_series, sea_statistics

    series: SeaSeries = sea_series(described, depth, duration)
    folder_for(out)
    head, rows = sea_statistics(series)
    columns = [("time", "s"), ("elevation", "m")]
    columns += [(f"{name} at {z:g} m", unit) for z in series.height for name, unit in (("u", "m/s"), ("a", "m/s^2"))]
    figure = plot_sea(described, series)
    files = [
        write_columns(out / "sea.csv", columns, series.table()),
        write_csv(out / "statistics.csv", head, rows),
        save(figure, out / "sea.png"),
    ]
    print_table(described.label, head, rows)
    wrote(*files)
    suggest("run", "iea15mw-monopile", "--wind-speed", 12, "--sea", target, "--out", out)


def _described(target: str, regular: bool, given: dict[str, Any]) -> Sea:
    """The sea of the command line."""
    from meltemi.core.yamlfile import read_mapping
    from meltemi.sea.irregular import IrregularSea
    from meltemi.sea.kinds import sea_of
    from meltemi.sea.regular import RegularSea

    if Path(target).suffix in (".yaml", ".yml"):
        if given or regular:
            raise InputError(f"{target} describes the sea; remove the other options")
        return sea_of(read_mapping(Path(target)), target)
    keys = sea_of_options(target)
    if regular:
        if given:
            raise InputError(f"--regular: a regular wave has no {', '.join(given)}")
        return RegularSea(height=keys["height"], period=keys["period"], direction=keys["direction"])
    if given.get("spectrum") == "white":
        highest = 4.0 * radians(360.0) / keys["period"]
        return IrregularSea(height=keys["height"], direction=keys["direction"], frequencies=(0.1, highest), **given)
    return sea_of(keys | given, "command line")
