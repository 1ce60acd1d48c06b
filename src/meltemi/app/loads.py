"""``meltemi loads``: load bases after the design load cases of IEC 61400-1."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import controller_of_options
from meltemi.app.terminal import OutOption, print_table, results_in, say
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.loadbase.plan import Plan

loads = typer.Typer(
    help="Load bases: all design load cases of IEC 61400-1 for a turbine.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@loads.callback()
def group() -> None:
    """Load bases: all design load cases of IEC 61400-1 for a turbine."""


@loads.command("plan")
def plan_(
    turbine: Annotated[
        str,
        typer.Argument(help="A turbine's name or YAML file, an OpenFAST deck (.fst), or the folder of a load base."),
    ],
    wind_class: Annotated[
        str | None, typer.Option("--class", "--wind-class", help="Wind turbine class of IEC 61400-1, e.g. IB.")
    ] = None,
    edition: Annotated[int, typer.Option("--edition", help="Edition of IEC 61400-1: 3, 4.")] = 4,
    table: Annotated[
        Path | None, typer.Option("--table", help="Changes of the table: YAML, or Excel as --excel writes it.")
    ] = None,
    site: Annotated[
        Path | None, typer.Option("--site", help="Site conditions (JSON form of IEC 61400-15-1) instead of a class.")
    ] = None,
    site_turbine: Annotated[str | None, typer.Option("--site-turbine", help="ID of the turbine in that form.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One seed, three speeds: for a first look.")] = False,
    seeds: Annotated[int | None, typer.Option("--seeds", help="Number of turbulence seeds [6].")] = None,
    duration: Annotated[float | None, typer.Option("--duration", help="Evaluated duration [s] [600].")] = None,
    transient: Annotated[float | None, typer.Option("--transient", help="Initial transient [s] [60].")] = None,
    yaw_error: Annotated[float | None, typer.Option("--yaw-error", help="Usual yaw error [deg] [8].")] = None,
    inclination: Annotated[float | None, typer.Option("--inclination", help="Flow inclination [deg] [8].")] = None,
    rated_wind: Annotated[float | None, typer.Option("--rated-wind", help="V_r [m/s] [from steady operation].")] = None,
    cut_in: Annotated[float | None, typer.Option("--cut-in", help="V_in [m/s] [that of the turbine].")] = None,
    cut_out: Annotated[float | None, typer.Option("--cut-out", help="V_out [m/s] [that of the turbine].")] = None,
    v_maint: Annotated[float | None, typer.Option("--v-maint", help="V_maint [m/s] [18].")] = None,
    idle_pitch: Annotated[float | None, typer.Option("--idle-pitch", help="Pitch when parked [deg] [feather].")] = None,
    extreme_wind: Annotated[
        str | None, typer.Option("--extreme-wind", help="Extreme wind speed model: turbulent, steady [turbulent].")
    ] = None,
    years: Annotated[float | None, typer.Option("--years", help="Lifetime [years] [20].")] = None,
    controller: Annotated[
        str | None, typer.Option("--controller", help="Bladed-style controller library, or: rosco [supervised].")
    ] = None,
    controller_input: Annotated[
        Path | None, typer.Option("--controller-input", help="Input file of the controller library, e.g. DISCON.IN.")
    ] = None,
    excel: Annotated[bool, typer.Option("--excel", help="Also write the table as table.xlsx.")] = False,
    out: OutOption = Path("base"),
) -> None:
    """List all cases of a load base; writes campaign.yaml and plan.csv."""
    angles = {"inclination": inclination, "idle_pitch": idle_pitch}
    plain: dict[str, Any] = {"duration": duration, "transient": transient, "seeds": seeds, "yaw_error": yaw_error}
    plain |= {"rated_wind": rated_wind, "cut_in": cut_in, "cut_out": cut_out, "v_maint": v_maint}
    plain |= {"extreme_wind": extreme_wind, "years": years, "quick": quick or None}
    given = {name: value for name, value in plain.items() if value is not None}
    given |= {name: round(radians(value), 9) for name, value in angles.items() if value is not None}
    if controller is not None or controller_input is not None:
        named = {"--controller": controller, "--controller-input": controller_input}
        given["controller"] = controller_of_options({k: v for k, v in named.items() if v is not None})
    from meltemi.loadbase.campaign import FILE, make_campaign, read_campaign, write_campaign
    from meltemi.loadbase.changes import read_changes
    from meltemi.loadbase.plan import plan, write_plan

    if (Path(turbine) / FILE).is_file():
        named = {"--class": wind_class, "--table": table, "--site": site}
        if given or any(value is not None for value in named.values()):
            raise InputError(f"{turbine} is the folder of a load base; change its {FILE} instead of using options")
        campaign, out = read_campaign(turbine), Path(turbine)
    else:
        if (wind_class is None) == (site is None):
            raise InputError("give one of --class (for instance --class IB), --site")
        if site is not None:
            from meltemi.loadbase.site import read_site

            given["site"] = read_site(site, site_turbine)
            given = {"inclination": given["site"].inclination} | given
        elif site_turbine is not None:
            raise InputError("--site-turbine needs --site")
        if table is not None:
            given["changes"] = read_changes(table, edition)
        campaign = make_campaign(turbine, wind_class or given["site"].wind_class(edition), edition, **given)
    planned = plan(campaign)
    _show(planned)
    with results_in(out):
        files = [write_campaign(campaign, out), write_plan(planned, out)]
        if excel:
            from meltemi.loadbase.excel import write_excel

            files.append(write_excel(planned.table, out / "table.xlsx"))
    for file in files:
        print(f"wrote {file}")


def _show(plan: Plan) -> None:
    """Print the rows of the plan, totals, and what cannot run."""
    from meltemi.core.threads import available_cores
    from meltemi.loadbase.plan import TIMES

    c, rows = plan.campaign, []
    for row in plan.summary():
        cannot = str(row.unsupported) if row.unsupported else ""
        rows.append(
            [row.name, row.situation, row.wind, row.type, row.factor, str(row.cases), f"{row.hours:.1f}", cannot]
        )
    all_hours = sum(row.hours for row in plan.summary())
    lacking = sum(row.unsupported for row in plan.summary())
    rows.append(["total", "", "", "", "", str(len(plan.cases)), f"{all_hours:.1f}", str(lacking or "")])
    head = ["DLC", "situation", "wind", "loads", "factor", "cases", "hours", "cannot run"]
    where = c.site.name if c.site is not None else f"class {c.iec_class.name}"
    title = f"{Path(c.turbine).name}: {plan.table.title}, {where}"
    print_table(title, head, rows, text_columns=4)
    print(
        f"V_in {c.cut_in:g}, V_r {c.rated_wind:g}, V_out {c.cut_out:g}, V_ref {c.iec_class.v_ref:g} m/s; hours "
        "simulated, initial transients included"
    )
    cores = available_cores()
    print(
        f"{plan.hours:.0f} h take about {plan.hours * 60.0 / TIMES / cores:.0f} min on {cores} "
        f"core{'s' if cores > 1 else ''} at {TIMES:g} times real time each"
    )
    for why, names in plan.missing().items():
        say(f"cannot run (DLC {', '.join(names)}): {why}")
    assumed = len(plan.table.assumptions())
    print(f"{assumed} values of the table come from practice, not from the standard (docs: load case tables)")
