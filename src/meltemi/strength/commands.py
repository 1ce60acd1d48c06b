"""``meltemi stress``: fatigue of tower welds, and strength of blade sections, from results or a load base."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import meltemi
from meltemi.app.options import TURBINES
from meltemi.app.scans import values_of
from meltemi.app.signatures import POSITIVE
from meltemi.app.terminal import OutOption, print_table, suggest, warn, write_results, wrote
from meltemi.core.errors import InputError
from meltemi.core.formats import suffixes
from meltemi.postprocess.formats import FORMATS

if TYPE_CHECKING:
    from meltemi.simulation.result import Result
    from meltemi.turbine.definition import Turbine


def stress(
    results: Annotated[list[Path], f"Results of one turbine ({suffixes(FORMATS)}), or the folder of a load base."],
    welds: Annotated[Path | None, "YAML file of welds: height, category, ... [detail D at each station]."] = None,
    turbine: Annotated[str | None, "Turbine's name or YAML file [that of the result].", TURBINES] = None,
    shares: Annotated[str | None, "Shares of the lifetime of the results, e.g. 0.2,0.5,0.3 [equal]."] = None,
    stations: Annotated[str | None, "Heights of the tower's stations 1, 2, ... [m], of files that lack them."] = None,
    years: Annotated[float, "Design lifetime [years]; a load base has its own.", POSITIVE] = 20.0,
    out: OutOption = Path("out"),
) -> None:
    """Stresses and fatigue of tower welds over the lifetime: table and plot of damage and life."""
    from meltemi.strength.load_base import base_fatigue
    from meltemi.strength.weld_report import plot_welds, short_weld_rows, weld_rows
    from meltemi.strength.welds import read_welds, weld_fatigue

    plan = None if welds is None else read_welds(welds)
    if len(results) == 1 and results[0].is_dir():
        for option, given in (("--shares", shares), ("--stations", stations)):
            if given is not None:
                raise InputError(f"{option}: a load base has weights and stations of its own")
        found, warnings = base_fatigue(results[0], plan, turbine=_turbine(turbine) if turbine else None)
        title = f"{results[0].name}: welds of the tower over the lifetime of the load base"
    else:
        read = [meltemi.read_result(path) for path in results]
        described = _turbine(turbine or _named(results[0], read[0]))
        heights = None if stations is None else values_of(stations, "--stations")
        parts = None if shares is None else values_of(shares, "--shares")
        found, warnings = weld_fatigue(read, described, plan, shares=parts, years=years, stations=heights)
        title = f"{described.name}: welds of the tower over {years:g} years"
    rows = weld_rows(found)
    files = write_results(out / "welds", rows, plot_welds(found, title))
    print_table(title, *short_weld_rows(rows), text_columns=2, all_rows=rows)
    warn(warnings)
    wrote(*files)
    suggest("inspect", turbine or "nrel5mw")


def _turbine(name: str) -> Turbine:
    from meltemi.app.options import load_aeroelastic

    return load_aeroelastic(name, "meltemi stress")


def _named(path: Path, result: Result) -> str:
    """Name of the turbine of a result, if it is one of the library.

    Raises:
      InputError: it is not.
    """
    from meltemi.turbine.library import list_turbines

    name = str(result.meta.get("turbine", ""))
    if name not in list_turbines():
        raise InputError(f"{path}: its turbine {name!r} is not in the library: give its file, --turbine FILE")
    return name
