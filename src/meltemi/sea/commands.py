"""``meltemi sea``: generation and evaluation of seas."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import meltemi
from meltemi.app.options import sea_of_options
from meltemi.app.signatures import POSITIVE
from meltemi.app.terminal import OutOption, print_table, suggest, write_figure, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.sea.conditions import Sea


def sea(
    target: Annotated[str, "HEIGHT,PERIOD[,DIRECTION] in m, s, deg; or a YAML file of a sea."],
    depth: Annotated[float, "Of the water [m].", POSITIVE] = 30.0,
    duration: Annotated[float, "Of the series [s].", POSITIVE] = 600.0,
    regular: Annotated[bool, "A regular wave of this height and period."] = False,
    seed: Annotated[int | None, "Of the waves [1]."] = None,
    spectrum: Annotated[str | None, "jonswap, pierson_moskowitz, white [jonswap]."] = None,
    crest: Annotated[float | None, "Height of an embedded crest [m], at 60 s."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Generate a sea; write the series of its elevation and kinematics, a table and a plot."""
    given = {"seed": seed, "spectrum": spectrum, "crest": None if crest is None else {"height": crest}}
    described = _described(target, regular, {name: value for name, value in given.items() if value is not None})
    from meltemi.core.csvfile import write_columns
    from meltemi.sea.plots import plot_sea
    from meltemi.sea.statistics import SeaSeries, sea_series, sea_statistics

    series: SeaSeries = sea_series(described, depth, duration)
    head, rows = sea_statistics(series)
    columns = [("time", "s"), ("elevation", "m")]
    columns += [(f"{name} at {z:g} m", unit) for z in series.height for name, unit in (("u", "m/s"), ("a", "m/s^2"))]
    files = [
        write_columns(out / "sea.csv", columns, series.table()),
        meltemi.io.write_csv(out / "statistics.csv", head, rows),
        write_figure(out / "sea.png", plot_sea(described, series)),
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
