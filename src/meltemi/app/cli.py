"""The command ``meltemi``: parse arguments, call the library, print.

Everything heavy is imported inside the commands, so that help and lists answer at once.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import TextIOWrapper
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

import meltemi
from meltemi.app.commands import CommandGroup, Commands
from meltemi.app.docs import docs
from meltemi.app.options import (
    CHANNELS,
    TURBINES,
    WIND,
    YAML,
    ControllerOption,
    RunOptions,
    TurbineArgument,
    WakeOption,
    controller_of,
    is_case,
    load_aeroelastic,
    of_options,
    sea_of_options,
    turbine_key,
    wind_changed,
    wind_of_options,
)
from meltemi.app.scans import at_speeds, finish, speeds_of
from meltemi.app.terminal import (
    OutOption,
    print_table,
    progress_bar,
    remove_empty_folders,
    say,
    simulation_bar,
    suggest,
    warn,
    write_figure,
    write_results,
    wrote,
)
from meltemi.core.errors import InputError, MeltemiError, Status, did_you_mean

if TYPE_CHECKING:
    from meltemi.cases.case import LoadCase
    from meltemi.report.tables import Rows
    from meltemi.simulation.result import Result
    from meltemi.simulation.run import Run

MOVING = ("hybrid", "free")
"""Wakes of vortices that move, which ``meltemi run`` draws and which have no steady operation."""
VORTICES = ("near", *MOVING)
"""Vortex wakes, which ``meltemi run`` compares with momentum theory."""

app = CommandGroup(
    "Aeroelastic simulation of controlled wind turbines in turbulent wind, with load analysis.",
    Commands,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Entry point: expected errors become one line and exit status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # names of files need not be UTF-8
    debug = "--debug" in sys.argv
    if debug:
        sys.argv.remove("--debug")
    try:
        app(standalone_mode=True)
    except MeltemiError as error:
        if debug:
            raise
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(0)
    except OSError as error:  # a name too long, a disk that is full
        if debug:
            raise
        print(f"error: {error.filename or 'files'}: {error.strerror or error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)


def _version(value: bool) -> None:
    if value:
        print(f"meltemi {meltemi.__version__}")
        raise typer.Exit


@app.callback()
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of errors.")] = False,
) -> None:
    """Aeroelastic simulation of controlled wind turbines in turbulent wind, with load analysis."""
    context.call_on_close(remove_empty_folders)


@app.command()
def run(
    target: Annotated[
        str, "A turbine's name, the YAML file of a turbine or a case, or an OpenFAST deck (.fst).", TURBINES
    ],
    options: RunOptions,
    yaw: Annotated[float | None, "Yaw of the nacelle [deg], counter-clockwise from above [0]."] = None,
    transient: Annotated[float | None, "Initial transient, excluded from statistics [s] [0]."] = None,
    outb: Annotated[bool, "Also write the result as OpenFAST's binary output."] = False,
    with_view: Annotated[bool, "--view", "Also write the turbine in three dimensions (HTML)."] = False,
    save_state: Annotated[Path | None, "Save the state at the end, for --continue."] = None,
    resume: Annotated[Path | None, "--continue", "Continue the same case from a saved state."] = None,
    until: Annotated[float | None, "Stop at this time [s], before the end of the case."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Simulate a case; writes a table, a plot and a result file."""
    case, written = _case(target, options.given())
    path = Path(target)
    folder = path.parent if written else Path()
    from meltemi.cases.case import case_run, case_turbine, self_contained
    from meltemi.core.usual import unusual_numbers
    from meltemi.core.yamlfile import write_record
    from meltemi.simulation.simulate import march

    settings = {} if transient is None else {"transient": f"{transient:g}"}
    settings |= {} if yaw is None else {"options.nacelle_yaw": f"{yaw:g} deg"}
    settings |= {} if options.wake is None else {"options.wake": options.wake}
    settings |= {"view": "true"} if options.wake in MOVING else {}
    changed = written and bool(settings or options.given())
    if changed and path.resolve() == (out / "case.yaml").resolve():
        raise InputError(
            f"{path} describes the results in {out}, and options change it; choose another folder with --out"
        )
    case = case.replace(**settings) if settings else case
    # the run itself warns of the others
    warn(text for text in unusual_numbers(case) if not text.startswith(("wind.", "environment.", "sea.")))
    with _named(path if written else None):
        turbine = case_turbine(case, folder)
    with TemporaryDirectory() as kept, _named(path if written else None):
        described = replace(case_run(case, turbine, folder, Path(kept)), view=with_view or case.view)
        if not written:
            described, case = _recorded(described, case)
        with simulation_bar(f"{turbine.name}, {case.duration:g} s", case.duration, "s") as progress:
            simulation = meltemi.Simulation(described)
            warn(() if resume is None else meltemi.io.restore_state(simulation, resume), "note")
            if until is not None:
                meltemi.io.stop_at(simulation, until)
            march(simulation, progress)
        result = simulation.result()
        files = _write(result, out, outb) + _library_files(Path(kept), out)
        if save_state is not None:
            files.append(meltemi.io.save_state(simulation, save_state))
        if result.scene is not None:
            files.append(meltemi.plots.view(result).write(out / "turbine.html"))
        if not (written and path.resolve() == (out / "case.yaml").resolve()):
            write_record(self_contained(case, folder), out / "case.yaml")
            files.append(out / "case.yaml")
        beside = None
        if case.options.wake in VORTICES and result.status.complete and (resume, until) == (None, None):
            by_momentum = case_run(case.replace(**{"options.wake": "momentum"}), turbine, folder)
            beside = _beside_momentum(result, replace(by_momentum, channels=described.channels))
            files.append(meltemi.io.write_csv(out / "momentum.csv", *beside))
    _show(result, f", after {case.transient:g} s" if case.transient else "")
    if beside is not None:
        print_table(f"Vortex wake ({case.options.wake}) beside momentum theory", *beside, text_columns=3)
        print(
            "cosine, sine: of the azimuth of blade 1, which is 0 where it points up; difference: what momentum misses"
        )
    wrote(*files)
    suggest(*_after_run(case, folder, out))
    _tell(result)


def _recorded(described: Run, case: LoadCase) -> tuple[Run, LoadCase]:
    """A run and its case without the channels that OpenFAST has, but not this turbine, each with a note."""
    from meltemi.cases.recordable import recordable
    from meltemi.simulation.plan import model_channels

    assert isinstance(described.model, meltemi.Model)
    names, missing = recordable(case.channels, model_channels(described.model, described.stations))
    if missing and not names:
        name, why = next(iter(missing.items()))
        raise InputError(f"no channel {name!r}: {why}")
    warn((f"channel {name} is not recorded: {why}" for name, why in missing.items()), "note")
    return replace(described, channels=names), case.replace(channels=names)


def _case(target: str, given: dict[str, Any]) -> tuple[LoadCase, bool]:
    """The case of a target and options, and whether it is that of a case file."""
    path = Path(target)
    if path.suffix.lower() == ".fst":
        return _case_of_deck(path, given), False
    if given.get("--start") == "deck":
        raise InputError("--start deck: only available for OpenFAST decks (.fst)")
    if is_case(path) or (path.suffix in YAML and not (given or path.exists())):
        return _case_of_file(path, given), True
    return _case_of_options(target, given), False


def _beside_momentum(result: Result, by_momentum: Run) -> Rows:
    """Table of a result with a vortex wake beside the same run by momentum theory."""
    from meltemi.report.momentum import beside_momentum
    from meltemi.simulation.simulate import march

    simulation = meltemi.Simulation(replace(by_momentum, view=False))
    with simulation_bar("the same by momentum theory", by_momentum.duration, "s") as progress:
        march(simulation, progress)
    return beside_momentum(result, simulation.result())


def _show(result: Result, after: str) -> None:
    """Print statistics and events of a result, and the times of its run."""
    from meltemi.report.tables import statistics_rows

    meta = result.meta
    if result.sampled:
        print_table(f"{result.title}{after}", *statistics_rows(result), text_columns=3)
        print("DEL: damage-equivalent load, 1 Hz, slope 10 for blades, 3 for mooring lines, 4 for other loads")
        print("time series in result.nc are in SI units: rad and rad/s, W, N, N m")
    if result.log:
        happened = [[f"{entry.time:.2f}", entry.source, entry.what, entry.reason] for entry in result.log]
        print_table("Events", ["time s", "source", "what", "reason"], happened, text_columns=4)
    if meta.get("lines"):
        print(meta["lines"])
    print(
        f"{result.time[-1] if len(result.time) else 0.0:g} s simulated in {meta['run_seconds']:.2f} s: "
        f"{meta['real_time_factor']:g} times real time (time step {meta['time_step']:g} s, "
        f"preparation {meta['prepare_seconds']:.1f} s, compilation {meta['compile_seconds']:.1f} s)"
    )


def _tell(result: Result) -> None:
    """Print warnings and findings; ends the command with the status of the run."""
    from meltemi.report.tables import early_extremes

    warn((*result.warnings, *filter(None, [early_extremes(result) if result.sampled else ""])))
    if result.status is Status.DOUBTFUL:
        warn(result.findings, "DOUBTFUL")
        raise typer.Exit(1)
    if result.status is not Status.OK:
        say(f"the run ended early: {result.message}")
        raise typer.Exit(130 if result.status is Status.INTERRUPTED else 1)


def _after_run(case: LoadCase, folder: Path, out: Path) -> tuple[object, ...]:
    """The next command after a run: the turbine in turbulence after steady wind, otherwise over all wind speeds."""
    if Path(case.turbine).suffix == ".fst":
        return ("import", folder / case.turbine, "--out", out)
    turbine = folder / case.turbine if (folder / case.turbine).is_file() else case.turbine
    if case.wind.kind != "steady" or not case.wind.speed:
        return ("power-curve", turbine, "--out", out)
    wind = ("--wind-speed", f"{case.wind.speed:g}", "--turbulence", 0.14)
    return ("run", turbine, *wind, "--duration", 660, "--transient", 60, "--view", "--out", f"{out}-turbulent")


@contextmanager
def _named(path: Path | None) -> Iterator[None]:
    """Add the name of the case file to errors that occur after it was read."""
    try:
        yield
    except MeltemiError as error:
        if path is None or str(path) in str(error):
            raise
        raise type(error)(f"{path}: {error}") from None


def _case_of_file(path: Path, given: dict[str, Any]) -> LoadCase:
    """The case of a file, with options overriding it."""
    case = meltemi.io.read_case(path)
    changes: dict[str, Any] = {"start": given["--start"]} if "--start" in given else {}
    if given.keys() & {"--controller", "--controller-input"}:
        changes["controller"] = controller_of(given.get("--controller"), given.get("--controller-input"))
    return _changed(case, given, changes)


def _changed(case: LoadCase, given: dict[str, Any], changes: dict[str, Any]) -> LoadCase:
    """A case with the wind and the run that options name, and other changes."""
    changes |= _run_of_options(given)
    if wind := {name: given[name] for name in WIND & given.keys()}:
        changes["wind"] = wind_changed(wind, case.wind.model_dump(exclude_unset=True), type(case.wind).model_fields)
    if not changes:
        return case
    return of_options(case.model_dump(exclude_unset=True) | changes, type(case))


def _case_of_deck(path: Path, given: dict[str, Any]) -> LoadCase:
    """The case of an OpenFAST deck: its wind, models, controller and duration, with options overriding them."""
    deck = meltemi.io.read_deck(path)
    for words in deck.brief(path):
        say(words)
    controller, note = meltemi.io.deck_controller(deck)
    if {"--controller", "--controller-input"} & given.keys():
        controller, note = controller_of(given.get("--controller"), given.get("--controller-input")), ""
    if note:
        say(f"note: {note}")
    case = meltemi.io.deck_case(deck, path.absolute(), started=given.get("--start") == "deck", controller=controller)
    return _changed(case, given, {})


def _run_of_options(given: dict[str, Any]) -> dict[str, Any]:
    """Keys of a case that describe the run, from options."""
    keys = {key: given[f"--{key}"] for key in ("duration", "sea", "channels") if f"--{key}" in given}
    return keys | ({"sea": sea_of_options(keys["sea"])} if "sea" in keys else {})


def _case_of_options(target: str, given: dict[str, Any]) -> LoadCase:
    wind = wind_of_options(given)
    data: dict[str, Any] = {
        "turbine": turbine_key(target),
        "wind": wind,
        "controller": controller_of(given.get("--controller"), given.get("--controller-input")),
        "duration": _usual_duration(wind),
    }
    return of_options(data | _run_of_options(given), meltemi.io.LoadCase)


def _usual_duration(wind: dict[str, Any]) -> float:
    """[s] usual duration of a run: a minute, which begins with the gust if there is one."""
    from meltemi.iec.gusts import BEGIN
    from meltemi.iec.models import MODELS

    model = MODELS.get(wind.get("model", ""))
    return 60.0 + (wind.get("begin", BEGIN) if model and model.kind == "transient" else 0.0)


def _write(result: Result, out: Path, outb: bool) -> list[Path]:
    from meltemi.postprocess.files import write_outb
    from meltemi.report.tables import statistics_rows

    files = [meltemi.io.write_netcdf(result, out / "result.nc")]
    if result.sampled:
        files.append(meltemi.io.write_csv(out / "statistics.csv", *statistics_rows(result)))
    if outb:
        files.append(write_outb(result, out / "result.outb"))
    if len(result.time) > 1:
        files.append(write_figure(out / "result.png", meltemi.plot(result)))
    for stale in {out / "statistics.csv", out / "result.png", out / "momentum.csv"}.difference(files):
        stale.unlink(missing_ok=True)  # of an earlier run
    return files


def _library_files(kept: Path, out: Path) -> list[Path]:
    """Copy the output and files of a controller library to the results."""
    files = [file for file in sorted(kept.glob("*/*")) if file.is_file() and file.stat().st_size]
    return [Path(shutil.copyfile(file, out / file.name)) for file in files]


@app.command()
def turbines() -> None:
    """List the turbines of the library."""
    from meltemi.core.extras import missing
    from meltemi.turbine.library import library_entries, packages_of

    rows = [
        [
            name,
            entry.verified,
            f"{entry.source}; {entry.licence}",
            f"{entry.rated_power / 1e6:g}",
            f"{entry.rotor_diameter:g}",
            f"{entry.hub_height:.1f}",
        ]
        for name, entry in sorted(library_entries().items(), key=lambda item: item[1].rated_power)
    ]
    head = ["name", "verified by", "source; licence", "rated MW", "rotor m", "hub m"]
    print_table("Library", head, rows, text_columns=3)
    for name in library_entries():
        if words := missing(packages_of(name)):
            say(f"{name} needs {words}")
    suggest("inspect", "nrel5mw")


@app.command()
def channels(
    explain: Annotated[str | None, "Channel, by its meltemi or OpenFAST name.", CHANNELS] = None,
    search: Annotated[str | None, "Only channels whose name or description contains this text."] = None,
) -> None:
    """List the output channels, or explain one of them."""
    from meltemi.simulation.channels import ChannelSet, catalogue, every_kind, find

    if explain is not None:
        many = catalogue(ChannelSet(nodes=20, blade_stations=3, tower_stations=3, flaps=4))
        c = find(explain, every_kind() | many)
        unit, factor = c.display_unit
        print(f"{c.name}")
        print(f"  OpenFAST     {c.alias or 'no equivalent channel'}")
        if c.also:
            print(f"  also         {', '.join(c.also)}")
        print(f"  what         {c.description}")
        print(f"  unit         {c.unit}" + (f" (shown in {unit}, times {factor:g})" if unit != c.unit else ""))
        print(f"  axes         {c.frame}")
        print(f"  positive     {c.sign}")
        suggest("run", "nrel5mw", "--wind-speed", 12, "--channels", c.name)
        return
    text = (search or "").lower()
    chosen = [c for c in every_kind().values() if text in f"{' '.join(c.names)} {c.description}".lower()]
    if not chosen:
        raise InputError(f"--search {search!r}: no channel name or description contains it; see: meltemi channels")
    rows = [[c.name, c.alias, c.unit, c.sign, c.description] for c in chosen]
    print_table("Channels", ["name", "OpenFAST", "unit", "positive", "what"], rows, text_columns=5)
    suggest("channels", "--explain", chosen[0].name)
    print("Blade nodes are numbered from 1 at the root: node_<n>_alpha_<blade>. Coordinates are 'q <name>'.")


@app.command("power-curve")
def power_curve(
    turbine: TurbineArgument,
    speeds: Annotated[str | None, "--wind-speeds", "Wind speeds [m/s], e.g. 4,6,8 or 4:24:2."] = None,
    wake: WakeOption = None,
    controller: ControllerOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Compute steady operation over wind speed: table, plot, CSV."""
    from meltemi.controllers.specification import specification

    if wake in MOVING:
        raise InputError(
            f"--wake {wake}: a vortex wake that moves develops in runs only; use near or momentum for power curves, or "
            f"meltemi run {turbine} --wake {wake}"
        )
    described = meltemi.load_turbine(turbine)
    wanted = speeds_of(speeds) if speeds is not None else None
    named = None if controller is None else specification(controller_of(controller))
    from meltemi.analyses.power_curve import curve_size
    from meltemi.analyses.power_curve import power_curve as points_of
    from meltemi.controllers.schemes import fitted
    from meltemi.report.tables import power_curve_rows

    warn(meltemi.turbine.plausibility_warnings(described))
    points, failures, interrupted, size = [], {}, False, curve_size(described, wanted)
    options = meltemi.ModelOptions(wake=wake or "momentum")
    model = meltemi.build(described if named is None else fitted(described, named), options)
    law = None if named is None else meltemi.control.make_controller(named, model)
    with simulation_bar("operating points", size, "points") as progress:
        try:
            for i, (speed, point) in enumerate(points_of(model, wanted, law), 1):
                if isinstance(point, str):
                    failures[speed] = point
                else:
                    points.append(point)
                progress(i / size)
        except KeyboardInterrupt:
            interrupted = True
    if not points:
        raise InputError("\n".join(failures.values()) or "interrupted before the first operating point was computed")
    points.sort(key=lambda point: point.wind.speed)
    head, rows = power_curve_rows(points, failures)
    print_table(f"{described.name}: steady operation", head, rows, 0)
    wrote(*write_results(out / "power_curve", (head, rows), meltemi.plots.plot_power_curve(points, model)))
    further = ("campbell", turbine) if isinstance(described, meltemi.Turbine) else ("run", turbine, "--wind-speed", 12)
    suggest(*further, "--out", out)
    finish(at_speeds(failures), interrupted=interrupted)


app.command()(docs)


SHOWN_POINTS = 6
"""Most operating points of a Campbell diagram that are printed; of more, those at equal distances."""


@app.command()
def campbell(
    turbine: TurbineArgument,
    speeds: Annotated[str | None, "--wind-speeds", "Wind speeds [m/s], e.g. 4,6,8 or 4:24:2."] = None,
    rotor_speeds: Annotated[str | None, "Instead: rotor speeds [rpm], in vacuum; 0 is standstill."] = None,
    wake: WakeOption = None,
    vacuum: Annotated[bool, "Structure in vacuum, generator speed constant."] = False,
    with_view: Annotated[bool, "--view", "Also write the moving mode shapes (HTML)."] = False,
    out: OutOption = Path("out"),
) -> None:
    """Compute natural frequencies and damping ratios: table, plot, CSV."""
    if speeds is not None and rotor_speeds is not None:
        raise InputError("give one of --wind-speeds, --rotor-speeds")
    described = load_aeroelastic(turbine, "meltemi campbell")
    turns = None
    if rotor_speeds is not None:
        turns = [w * pi / 30.0 for w in speeds_of(rotor_speeds, "--rotor-speeds", "rpm", zero=True)]
    winds = speeds_of(speeds) if speeds is not None else None
    from meltemi.analyses.power_curve import whole_speeds
    from meltemi.report.tables import campbell_rows, number

    winds = winds or whole_speeds(described)
    with simulation_bar("Campbell diagram", len(turns or winds), "points") as progress:
        model = meltemi.build(described, meltemi.ModelOptions(wake=wake or "momentum"))
        diagram = meltemi.analysis.campbell(
            model,
            wind_speeds=None if turns else winds,
            rotor_speeds=turns,
            air=not (vacuum or turns),
            progress=progress,
        )
    last = len(diagram.rotor_speed) - 1
    shown = dict.fromkeys(round(i * last / (SHOWN_POINTS - 1)) for i in range(SHOWN_POINTS))
    operation = zip(diagram.wind_speed, diagram.rotor_speed, strict=True)
    over = [f"{w:g} m/s" if w == w else f"{turn * 30.0 / pi:.4g} rpm" for w, turn in operation]
    columns = [
        (f"{what}\nat {over[i]}", numbers[:, i])
        for i in shown
        for what, numbers in (("Hz", diagram.frequency / (2.0 * pi)), ("damping %", 100.0 * diagram.damping))
    ]
    # shown once, at the first operating point with the mode
    energy = [next(filter(None, (diagram.participation(label, i, 2) for i in shown)), "") for label in diagram.labels]
    rows = [[label, *(number(float(v[j])) for _, v in columns), energy[j]] for j, label in enumerate(diagram.labels)]
    print_table(
        f"{described.name}: modes {'with air' if diagram.air else 'in vacuum'}",
        ["mode", *(n for n, _ in columns), "energy"],
        rows,
        all_rows=campbell_rows(diagram),
    )
    if len(shown) <= last:
        print(f"{len(shown)} of {last + 1} operating points; campbell.csv has all of them")
    figure = meltemi.plots.plot_campbell(diagram, described.name)
    wrote(*write_results(out / "campbell", campbell_rows(diagram), figure))
    if with_view:
        wrote(meltemi.plots.modes_view(model, diagram).write(out / "modes.html"))
    suggest("flutter", turbine, "--out", out)
    if turns:
        finish(at_speeds({u * 30.0 / pi: why for u, why in diagram.failures.items()}, "rpm"))
    finish(at_speeds(diagram.failures))


@app.command()
def warmup() -> None:
    """Compile all kernels, on all cores."""
    import time

    from meltemi.app.warmup import STAGES, Stage, warmup

    say(f"Compiling for this machine: this happens once. {len(STAGES)} stages, one process each ...")
    began = time.perf_counter()
    rows: list[list[str]] = []
    with progress_bar("stages", len(STAGES), "stages") as progress:

        def done(stage: Stage) -> None:
            rows.append([stage.name, str(stage.signatures), str(stage.compiled), f"{stage.seconds:.1f}"])
            progress(len(rows) / len(STAGES))

        folder = warmup(done=done)
    print_table("Machine code", ["stage", "signatures", "compiled", "time s"], rows)
    print(f"ready in {time.perf_counter() - began:.1f} s: machine code in {folder}")
    suggest("run", "nrel5mw", "--wind-speed", 12)


@app.command()
def template(
    what: Annotated[str, typer.Argument(help="Template to write: case, farm, turbine.")] = "case",
    out: Annotated[Path | None, "Output file; by default the terminal."] = None,
) -> None:
    """Write a commented template file."""
    from importlib.resources import files

    from meltemi.core.files import write_text

    places = {"case": ("meltemi.cases", "template.yaml", "run"), "farm": ("meltemi.farm", "template.yaml", "farm")}
    places["turbine"] = ("meltemi.turbine", "data/nrel5mw.yaml", "inspect")
    if what not in places:
        raise InputError(f"template {what!r}: {did_you_mean(what, list(places))}")
    package, file, following = places[what]
    text = (files(package) / file).read_text(encoding="utf-8")
    if out is None:  # to be redirected into a file: no further lines
        print(text, end="")
        return
    if out.exists():
        raise InputError(f"{out}: the file already exists; choose another name")
    write_text(out, text)
    wrote(out)
    suggest(following, out)


if __name__ == "__main__":
    main()
