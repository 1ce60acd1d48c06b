"""``meltemi stress``: fatigue of tower welds, and strength of blade sections, from results or a load base."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import meltemi
from meltemi.app.options import TURBINES, load_aeroelastic
from meltemi.app.scans import values_of
from meltemi.app.signatures import POSITIVE, Range
from meltemi.app.terminal import OutOption, print_table, suggest, warn, write_results, wrote
from meltemi.core.errors import InputError
from meltemi.core.formats import suffixes
from meltemi.postprocess.formats import FORMATS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from meltemi.simulation.result import Result
    from meltemi.strength.plies import BladeStrength
    from meltemi.strength.welds import WeldFatigue


def stress(
    results: Annotated[list[Path], f"Results of one turbine ({suffixes(FORMATS)}), or the folder of a load base."],
    welds: Annotated[Path | None, "YAML file of tower welds: height, category, ... [detail D at each station]."] = None,
    layup: Annotated[
        Path | None, "Layup of the blade, as of 'meltemi section': strength of its plies in place of welds."
    ] = None,
    turbine: Annotated[str | None, "Turbine's name or YAML file [that of the result].", TURBINES] = None,
    factors: Annotated[str | None, "Partial factors of a standard, by name [welds: none; plies: iec61400-5]."] = None,
    load_factor: Annotated[
        float, "Partial factor of the loads for plies and buckling; a load base has its own.", Range(0.5, 3)
    ] = 1.35,
    blade: Annotated[int, "Blade whose layup is judged; of a load base all are.", Range(1, 3)] = 1,
    shares: Annotated[str | None, "Shares of the lifetime of the results, e.g. 0.2,0.5,0.3 [equal]."] = None,
    stations: Annotated[
        str | None, "Places of stations 1, 2, ... [m] along tower or blade, of files without them."
    ] = None,
    years: Annotated[float, "Design lifetime [years]; a load base has its own.", POSITIVE] = 20.0,
    out: OutOption = Path("out"),
) -> None:
    """Damage and life of tower welds, or with --layup strength of a blade's plies: tables and a plot."""
    from meltemi.sections.files import find_layup
    from meltemi.strength.welds import read_welds

    if welds is not None and layup is not None:
        raise InputError("--welds and --layup: give one of them")
    for path in results:
        if path.suffix.lower() in (".yaml", ".yml"):
            raise InputError(
                f"{path}: not a result: 'meltemi stress' takes results of one turbine ({suffixes(FORMATS)}) or the "
                "folder of a load base; a turbine's file is given by --turbine, welds by --welds, a layup by --layup"
            )
    parts = None if shares is None else values_of(shares, "--shares")
    places = None if stations is None else values_of(stations, "--stations")
    plan = None if welds is None else read_welds(welds)
    plies, set_of = None if layup is None else find_layup(layup), factors or "iec61400-5"
    if len(results) == 1 and results[0].is_dir():
        from meltemi.strength.load_base import base_blade_strength, base_weld_fatigue

        for option, given in (("--shares", shares), ("--stations", stations)):
            if given is not None:
                raise InputError(f"{option}: not with a load base, which has cycles, weights and stations of its own")
        base, other = results[0], load_aeroelastic(turbine, "meltemi stress") if turbine else None
        if plies is None:
            found = base_weld_fatigue(base, plan, turbine=other, factors=factors)
            _welds(*found, f"{base.name}: welds of the tower over the lifetime", out)
        else:
            strength = base_blade_strength(base, plies, turbine=other, factors=set_of)
            _plies(strength, f"{base.name}: plies of the blades, factors {set_of}", out)
        suggest("loads", "report", base)
        return
    read = [meltemi.read_result(path) for path in results]
    name = turbine or _named(results[0], read[0])
    machine = load_aeroelastic(name, "meltemi stress")
    if plies is None:
        from meltemi.strength.welds import weld_fatigue

        found = weld_fatigue(
            read, machine, plan, shares=parts, years=years, stations=places, factors=factors, load_factor=load_factor
        )
        _welds(*found, f"{name}: welds of the tower over {years:g} years", out)
    else:
        from meltemi.strength.plies import blade_strength

        strength = blade_strength(
            read, machine, plies, factors=set_of, load_factor=load_factor, blade=blade, shares=parts, years=years,
            stations=places, names=[path.name for path in results],
        )  # fmt: skip
        _plies(strength, f"{name}: plies of blade {blade}, factors {set_of}", out)
    suggest("inspect", name)


def _welds(found: Sequence[WeldFatigue], warnings: Sequence[str], title: str, out: Path) -> None:
    from meltemi.strength.weld_report import plot_welds, short_weld_rows, weld_rows

    rows = weld_rows(found)
    files = write_results(out / "welds", rows, plot_welds(found, title))
    print_table(title, *short_weld_rows(rows), text_columns=2, all_rows=rows)
    warn(warnings)
    wrote(*files)


def _plies(strength: BladeStrength, title: str, out: Path) -> None:
    from meltemi.report.tables import write_csv
    from meltemi.strength.blade_report import layer_rows, panel_rows, plot_blade_strength, worst_rows

    every = layer_rows(strength)
    files = write_results(out / "layers", every, plot_blade_strength(strength, title))
    files.append(write_csv(out / "panels.csv", *panel_rows(strength)))
    print_table(title, *worst_rows(strength), text_columns=1, all_rows=every)
    print("an index of 1 is failure with all partial factors; damage without factor of the loads")
    warn(strength.warnings)
    wrote(*files)


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
