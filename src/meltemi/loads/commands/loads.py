"""``meltemi loads``: load bases after the design load cases of IEC 61400-1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import radians
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import typer

import meltemi
from meltemi.app.commands import CommandGroup
from meltemi.app.options import CONTROLLER, CONTROLLERS, TURBINES, ControllerInputOption, WorkOptions, controller_of
from meltemi.app.scans import values_of
from meltemi.app.terminal import (
    OutOption,
    folder_for,
    print_table,
    progress_bar,
    say,
    simulation_bar,
    suggest,
    warn,
    write_figure,
    wrote,
)
from meltemi.core.errors import InputError
from meltemi.core.extras import missing

if TYPE_CHECKING:
    from meltemi.iec.classes import Edition, WindClass
    from meltemi.loads.loadbase.campaign import Campaign
    from meltemi.loads.loadbase.engine import BaseStatus, Progress
    from meltemi.loads.loadbase.plan import Plan
    from meltemi.loads.loadbase.timing import Cost

BaseArgument = Annotated[Path, "Folder of a load base, as plan writes it."]
SettingsOption = Annotated[Path | None, "Settings of the evaluation (YAML), such as extrapolation: weibull."]
REPORTED = 30.0
"""Time [s] between lines of progress where there is no terminal."""
MOST_PROBLEMS = 20
"""Largest number of cases that status lists."""

loads = CommandGroup(
    "Load bases: the design load cases of IEC 61400-1 on land, 61400-3-1 and 61400-3-2 at sea, for a turbine."
)


@dataclass(frozen=True)
class PlanOptions:
    """Options of a campaign; angles in degrees."""

    wind_class: Annotated[str | None, "--class", "--wind-class", "Wind turbine class of IEC 61400-1, e.g. IB."] = None
    edition: Annotated[int, "Edition of IEC 61400-1: 3, 4."] = 4
    standard: Annotated[
        Literal["61400-1", "61400-3-1", "61400-3-2"], "61400-1; in the sea 61400-3-1: fixed, 61400-3-2: floating."
    ] = "61400-1"
    table: Annotated[Path | None, "Changes of the table: YAML, or Excel as --excel writes it."] = None
    site: Annotated[
        Path | None,
        "Site conditions (JSON form of IEC 61400-15-1) instead of a class; in the sea a YAML file or a name.",
    ] = None
    site_turbine: Annotated[str | None, "ID of the turbine in that form."] = None
    neighbours: Annotated[str | None, "With --site: distances of neighbours in rotor diameters, e.g. 5,5,7."] = None
    slope: Annotated[float | None, "S-N slope of their effective turbulence [10]."] = None
    quick: Annotated[bool, "One seed, three speeds: for a first test."] = False
    seeds: Annotated[int | None, "Number of turbulence seeds [6]."] = None
    duration: Annotated[float | None, "Evaluated duration [s] [600]."] = None
    transient: Annotated[float | None, "Initial transient [s] [60]."] = None
    yaw_error: Annotated[float | None, "Usual yaw error [deg] [8]."] = None
    inclination: Annotated[float | None, "Flow inclination [deg] [8]."] = None
    rated_wind: Annotated[float | None, "V_r [m/s] [from steady operation]."] = None
    cut_in: Annotated[float | None, "V_in [m/s] [that of the turbine]."] = None
    cut_out: Annotated[float | None, "V_out [m/s] [that of the turbine]."] = None
    v_maint: Annotated[float | None, "V_maint [m/s] [18]."] = None
    idle_pitch: Annotated[float | None, "Pitch when parked [deg] [feather]."] = None
    extreme_wind: Annotated[str | None, "Extreme wind speed model: turbulent, steady [turbulent]."] = None
    years: Annotated[float | None, "Lifetime [years] [20]."] = None
    controller: Annotated[
        str | None, f"Controller: {CONTROLLER} [supervised; rosco for a turbine with its settings].", CONTROLLERS
    ] = None
    controller_input: ControllerInputOption = None

    def given(self, turbine: str) -> dict[str, Any]:
        """Settings of a campaign from the options, angles in radians; the default controller is that of the turbine."""
        names = "duration transient seeds yaw_error rated_wind cut_in cut_out v_maint extreme_wind years".split()
        names += ["inclination", "idle_pitch"]
        settings: dict[str, Any] = {name: value for name in names if (value := getattr(self, name)) is not None}
        settings |= {name: round(radians(settings[name]), 9) for name in names[-2:] if name in settings}
        if self.controller is not None or self.controller_input is not None:
            settings["controller"] = controller_of(self.controller, self.controller_input)
        else:
            from meltemi.tuning.turbine_controller import turbine_controller

            controller, note = turbine_controller(meltemi.load_turbine(turbine), otherwise="supervised")
            settings |= {"controller": controller} if controller == "rosco" else {}
            if note:
                say(f"note: {note}")
        return settings | ({"quick": True} if self.quick else {})

    def campaign(self, turbine: str) -> Campaign:
        """The campaign of a turbine."""
        from meltemi.loads.loadbase.excel import read_changes
        from meltemi.loads.loadbase.table import AT_SEA

        at_sea = self.standard in AT_SEA
        of_class, settings = self._at_sea() if at_sea else self._on_land()
        settings |= self.given(turbine)
        if self.table is not None:
            settings["changes"] = read_changes(self.table, self.standard if at_sea else self.edition)
        with simulation_bar("operating points of the plan"):
            return meltemi.loads.make_campaign(turbine, of_class, self.edition, **settings)

    def _on_land(self) -> tuple[str | WindClass, dict[str, Any]]:
        """Class and site of a campaign on land."""
        from meltemi.loads.loadbase.site import read_site

        if (self.wind_class is None) == (self.site is None):
            raise InputError("give either --class (for instance --class IB) or --site FILE")
        if self.slope is not None and self.neighbours is None:
            raise InputError("--slope needs --neighbours")
        if self.wind_class is not None:
            if self.site_turbine is not None:
                raise InputError("--site-turbine needs --site")
            if self.neighbours is not None:
                raise InputError("--neighbours needs --site: the ambient turbulence that their wakes add to")
            return self.wind_class, {}
        site = read_site(cast("Path", self.site), self.site_turbine)
        if self.neighbours is not None:
            slope = site.slope if self.slope is None else self.slope
            site = site.replace(neighbours=tuple(values_of(self.neighbours, "--neighbours")), slope=slope)
        # the edition is checked with the campaign
        return site.wind_class(cast("Edition", self.edition)), {"site": site, "inclination": site.inclination}

    def _at_sea(self) -> tuple[str | WindClass, dict[str, Any]]:
        """Class and site of a campaign in the sea."""
        from meltemi.loads.loadbase.metocean import list_metocean, read_metocean

        if self.neighbours is not None or self.slope is not None:
            raise InputError(f"--neighbours: effective turbulence is for sites on land, not --standard {self.standard}")
        if self.site is None or self.site_turbine is not None:
            raise InputError(
                f"--standard {self.standard} needs --site with the conditions of a site in the sea, without "
                "--site-turbine: a YAML file as 'meltemi loads metocean template' writes it, or one of "
                f"{', '.join(list_metocean())}"
            )
        if self.edition != 4:
            raise InputError(
                f"--edition {self.edition}: the table of IEC {self.standard} begins with edition 4; leave it out"
            )
        site = read_metocean(self.site)
        return self.wind_class or site.wind_class, {"standard": self.standard, "metocean": site}


@loads.command("plan")
def plan_(
    turbine: Annotated[
        str, "A turbine's name or YAML file, an OpenFAST deck (.fst), or the folder of a load base.", TURBINES
    ],
    options: PlanOptions,
    excel: Annotated[bool, "Also write the table as table.xlsx."] = False,
    out: Annotated[Path, "Folder for the results."] = Path("base"),
) -> None:
    """List all cases of a load base; writes campaign.yaml and plan.csv."""
    from meltemi.core.usual import unusual_numbers
    from meltemi.loads.loadbase.campaign import FILE
    from meltemi.loads.loadbase.plan import write_plan
    from meltemi.loads.loadbase.timing import finished_cost, timed_cost

    if (Path(turbine) / FILE).is_file():
        if options != PlanOptions(edition=options.edition, site_turbine=options.site_turbine):
            raise InputError(f"{turbine} is the folder of a load base; change its {FILE} instead of using options")
        campaign, out = meltemi.loads.read_campaign(turbine), Path(turbine)
    else:
        campaign = options.campaign(turbine)
    warn(unusual_numbers(campaign))
    planned = meltemi.loads.plan(campaign)
    _show(planned)
    _warn(planned)
    folder_for(out)
    with simulation_bar("timing"):
        cost = finished_cost(planned, out) or timed_cost(planned)
    if cost:
        print(f"{planned.hours:.0f} h of simulated time: {_duration_words(cost, planned.hours)}")
    files = [meltemi.loads.write_campaign(campaign, out), write_plan(planned, out)]
    if excel:
        from meltemi.loads.loadbase.excel import write_excel

        files.append(write_excel(planned.table, out / "table.xlsx"))
    wrote(*files)
    suggest("loads", "run", out)
    if words := missing(("pandas", "pyarrow", "openpyxl")):
        say(f"to run and report it needs {words}")


def _duration_words(cost: Cost, hours: float) -> str:
    """Processor and wall time of simulated hours, and how they were estimated."""
    from meltemi.core.threads import available_cores

    seconds, cores = 3600.0 * hours * cost.rate, available_cores()
    processor, wall = duration_text(seconds), duration_text(seconds / cores)
    where = f", {wall} on {cores} free cores" if cores > 1 else ""
    return f"about {processor} of processor time{where} (estimate from {cost.source})"


def duration_text(seconds: float) -> str:
    """A duration with two digits: 45 s, 3.7 min, 12 h."""
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            value = seconds / size
            return f"{value:.1f} {unit}" if value < 10.0 else f"{value:.0f} {unit}"
    return f"{seconds:.0f} s"


def _show(plan: Plan) -> None:
    """Print the rows of the plan, totals, and reasons for which cases cannot run."""
    c, summary = plan.campaign, plan.summary()
    rows = [[*row.texts, str(row.unsupported or "")] for row in summary]
    hours, lacking = sum(row.hours for row in summary), sum(row.unsupported for row in summary)
    rows.append(["total", "", "", "", "", str(len(plan.cases)), f"{hours:.1f}", str(lacking or "")])
    head = ["DLC", "situation", "wind", "loads", "factor", "cases", "hours", "cannot run"]
    title = f"{c.turbine_name}: {plan.table.title}, {c.where}"
    print_table(title, head, rows, text_columns=4)
    print(
        f"V_in {c.cut_in:g}, V_r {c.rated_wind:g}, V_out {c.cut_out:g}, V_ref {c.iec_class.v_ref:g} m/s; hours "
        "simulated, initial transients included"
    )
    for why, names in plan.missing().items():
        say(f"cannot run (DLC {', '.join(names)}): {why}")
    assumed = len(plan.table.assumptions())
    print(f"{assumed} values of the table come from practice or memory, not from the standard (docs: load case tables)")


@loads.command()
def metocean(
    site: Annotated[str, typer.Argument(help="A site of the package: iea22, weis; or template.")] = "template",
    out: Annotated[Path, "File to write."] = Path("metocean.yaml"),
) -> None:
    """Write the conditions of a site in the sea as a file, to be edited."""
    from meltemi.core.files import write_text
    from meltemi.loads.loadbase.metocean import metocean_file

    text = metocean_file(site).read_text(encoding="utf-8")
    if out.exists():
        raise InputError(f"{out}: exists already; choose another name with --out, or remove it")
    wrote(write_text(out, text))
    suggest("loads", "plan", "iea15mw-monopile", "--standard", "61400-3-1", "--site", out, "--quick")


@dataclass(frozen=True)
class ExecutionOptions(WorkOptions):
    """Options for the execution of missing runs."""

    device: Annotated[str, "cpu; cuda or cuda-single: a graphics card."] = "cpu"
    retry: Annotated[bool, "Rerun failed cases."] = False

    def given(self) -> dict[str, Any]:
        """Arguments of ``run_base`` and ``run_surrogate``."""
        return asdict(self) | self.divided()


@loads.command("run")
def run_(
    base: BaseArgument,
    options: ExecutionOptions,
    expect: Annotated[str, "Refuse a plan with another hash than that of submit."] = "",
) -> None:
    """Run the missing cases of a load base."""
    planned = _planned(base)
    folder_for(base, "load base")
    given = options.given() | {"expect": expect}
    try:
        with simulation_bar("load cases", len(planned.cases), "cases") as bar:
            state = meltemi.loads.run_base(planned, base, progress=progress_lines(bar), **given)
    except KeyboardInterrupt:
        state = meltemi.loads.base_status(planned, base)
        say(
            f"{state.done} of {state.total} cases are kept, {state.hours:.1f} h are missing; the same command continues"
        )
        raise
    _show_status(state, base, planned)


@dataclass(frozen=True)
class SubmitOptions:
    """Options of job scripts."""

    slurm: Annotated[bool, "For Slurm."] = False
    pbs: Annotated[bool, "For PBS (OpenPBS)."] = False
    array: Annotated[bool, "One script for the array of any scheduler."] = False
    now: Annotated[bool, "Submit the jobs, too."] = False
    tasks: Annotated[int | None, "Tasks of the array [of a quarter of an hour]."] = None
    cores: Annotated[int, "Cores of a task."] = 4
    lines: Annotated[str, "--options", "Further options for the scheduler, e.g. '--partition=short'."] = ""
    portable: Annotated[bool, "Machine code for all x86 processors with AVX2, for clusters of several kinds."] = False

    @property
    def scheduler(self) -> str:
        """The one that is chosen."""
        chosen = [name for name in ("slurm", "pbs", "array") if getattr(self, name)]
        if len(chosen) != 1:
            raise InputError("give one of --slurm, --pbs and --array")
        return chosen[0]


@loads.command()
def warmup(base: BaseArgument) -> None:
    """Compile what the cases of a load base need, once for all processes that share the folder of machine code."""
    from meltemi.compiler import cache_folder
    from meltemi.loads.loadbase.timing import compile_base

    planned = _planned(base)
    with simulation_bar("short runs"):
        failed = compile_base(planned)
    print(f"machine code is in {cache_folder()}{f'; {failed} short runs failed' if failed else ''}")
    suggest("loads", "run", base)


@loads.command("submit")
def submit_(base: BaseArgument, options: SubmitOptions) -> None:
    """Write job scripts that run the missing cases of a load base on a cluster; with --now submit them."""
    from meltemi.cluster.scripts import submit, write_scripts
    from meltemi.loads.loadbase.engine import plan_hash
    from meltemi.loads.loadbase.jobs import jobs_of
    from meltemi.loads.loadbase.timing import base_size, finished_cost, timed_cost

    scheduler, planned = options.scheduler, _planned(base)
    folder_for(base, "load base")
    with simulation_bar("timing"):
        cost = finished_cost(planned, base) or timed_cost(planned)
        if cost is None:
            raise InputError(f"{base}: no case runs to its end here, so nothing can be estimated")
        size = base_size(planned, base, cost, options.cores, options.tasks)
    words = ["--expect", plan_hash(jobs_of(planned))]
    files = write_scripts(scheduler, base, size, words, lines=options.lines, portable=options.portable)
    each = f"{size.cores} cores, {size.megabytes} MB, at most {duration_text(60.0 * size.minutes)}"
    print(f"{size.tasks} tasks of {each} (estimate from {cost.source})")
    wrote(*files)
    if options.now:
        print(submit(scheduler, files[-1]))
    suggest("loads", "status", base)


def _planned(base: Path) -> Plan:
    planned = meltemi.loads.plan(meltemi.loads.read_campaign(base))
    _warn(planned)
    return planned


def _warn(plan: Plan) -> None:
    """Print the warnings that hold for all cases."""
    from meltemi.loads.loadbase.coverage import turbine_warnings

    warn(turbine_warnings(plan))


def progress_lines(bar: Callable[[float], None]) -> Callable[[Progress], None]:
    """Callback that shows progress as a bar, and as lines where there is no terminal."""
    from rich.console import Console

    terminal, last = Console(stderr=True).is_terminal, [monotonic()]

    def tell(progress: Progress) -> None:
        bar(progress.share)
        if not terminal and monotonic() - last[0] > REPORTED and progress.seconds_left is not None:
            last[0] = monotonic()
            left = f"{duration_text(progress.seconds_left)} left"
            say(f"{progress.done} of {progress.total} cases, {100.0 * progress.share:.0f} %, {left}")

    return tell


@loads.command()
def status(base: BaseArgument) -> None:
    """Show the completed, failed and missing cases of a load base."""
    planned = _planned(base)
    _show_status(meltemi.loads.base_status(planned, base), base, planned)


def _show_status(state: BaseStatus, base: Path, plan: Plan) -> None:
    from meltemi.loads.loadbase.timing import finished_cost

    columns = ("cases", "ok", "doubtful", "failed", "missing", "unsupported")
    rows = [[row.dlc, *(str(getattr(row, name) or "") for name in columns)] for row in state.dlcs]
    rows.append(["total", *(str(sum(getattr(row, name) for row in state.dlcs) or "") for name in columns)])
    print_table("Load base", ["DLC", *columns[:-1], "cannot run"], rows, text_columns=1)
    left = f"{state.done} of {state.total} cases done, {state.hours:.1f} h to be simulated"
    cost = finished_cost(plan, base) if state.hours else None
    print(f"{left}, {_duration_words(cost, state.hours)}" if cost else left)
    suggest("loads", "run" if state.done < state.total else "report", base)
    for name, why in list(state.problems.items())[:MOST_PROBLEMS]:
        say(f"{name}: {why}")
    if (more := len(state.problems) - MOST_PROBLEMS) > 0:
        say(f"and {more} more")
    for file, why in state.unreadable.items():
        say(f"{file} counts as missing: {why}")
    if state.outdated:
        say(f"{state.outdated} results of other inputs, such as an earlier controller, are not used")


@loads.command()
def show(
    base: BaseArgument,
    case: Annotated[str, "Name of a case, e.g. dlc1.3-14-y0-s04."],
    plot: Annotated[bool, "Also write a plot."] = False,
    out: Annotated[Path | None, "Folder for the files [cases in that of the base]."] = None,
) -> None:
    """Simulate a case of a load base again; writes its series."""
    from meltemi.loads.loadbase.engine import same_numbers

    planned = _planned(base)
    folder = folder_for(out or base / "cases")
    seconds = planned.case(case).duration + planned.case(case).transient
    with simulation_bar(case, seconds, "s") as progress:
        result = meltemi.loads.show_case(planned, case, progress)
    files = [meltemi.io.write_netcdf(result, folder / f"{case}.nc")]
    if plot and len(result.time) > 1:
        files.append(write_figure(folder / f"{case}.png", meltemi.plot(result)))
    print(f"{case}: {result.status}{f', {result.message}' if result.message else ''}")
    for entry in result.log:
        print(f"{entry.time:8.2f} s  {entry.what}{f': {entry.reason}' if entry.reason else ''}")
    warn(result.warnings)
    same = same_numbers(planned, base, case, result)
    known = "equal to the load base in all digits" if same else "NOT that of the load base"
    print(f"result: {'not in the load base' if same is None else known}")
    wrote(*files)
    suggest(*(("loads", "report", base) if same else ("loads", "status", base)))


@loads.command()
def report(
    base: BaseArgument,
    against: Annotated[Path | None, "Another load base, to which utilisations refer."] = None,
    limits: Annotated[Path | None, "Limits of loads (YAML), to which utilisations refer."] = None,
    settings: SettingsOption = None,
    project: Annotated[
        Path | None, "Project, author, revision, date (YAML) [project.yaml in the base's folder]."
    ] = None,
    word: Annotated[bool, "Also write report.docx, with the same content."] = False,
) -> None:
    """Write the report of a load base: one HTML file, its tables as Excel and CSV, on demand a Word file."""
    from meltemi.loads.loadbase.project import read_project
    from meltemi.loads.loadbase.report import read_limits
    from meltemi.loads.loadbase.settings import read_settings

    if against is not None and limits is not None:
        raise InputError("give either --against or --limits")
    planned, given = _planned(base), None if limits is None else read_limits(limits)
    title, of = read_project(base, project), read_settings(settings)
    other = None if against is None else (str(against), meltemi.loads.design_loads(_planned(against), against, of))
    folder_for(base, "load base")
    with progress_bar("report"):
        design = meltemi.loads.design_loads(planned, base, of)
        files = meltemi.loads.write_report(
            planned, base, against=other, limits=given, design=design, project=title, word=word
        )
    wrote(*files)
    without = design.problems.index[design.problems["state"].isin(["missing", "failed", "unsupported"])]
    ran = next((case.name for case in planned.cases if case.name not in without), None)
    suggest(*(("loads", "show", base, ran, "--plot") if ran else ("loads", "run", base)))


@loads.command()
def compare(
    base: BaseArgument,
    other: Annotated[Path, "Folder of the other load base, the reference."],
    out: OutOption = Path("comparison"),
    settings: SettingsOption = None,
) -> None:
    """Compare two load bases: two controllers, two turbines, or a change."""
    from meltemi.loads.loadbase.settings import read_settings

    bases = [(str(folder), _planned(folder)) for folder in (base, other)]
    of = read_settings(settings)
    with progress_bar("comparison"):
        files = meltemi.loads.write_base_comparison(bases[0], bases[1], out, of)
    wrote(*files)
    suggest("loads", "report", base, "--against", other)
