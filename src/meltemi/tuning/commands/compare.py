"""``meltemi compare``: comparison of control schemes in the same wind fields."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meltemi.app.options import (
    TurbineArgument,
    WindOptions,
    WorkersOption,
    check_workers,
    completing,
    wind_of_options,
    with_options,
)
from meltemi.app.terminal import OutOption, folder_for, made_by, print_table, say, simulation_bar, suggest, wrote
from meltemi.controllers.names import NAMES, labelled
from meltemi.core.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from meltemi.tuning.compare import Comparison
    from meltemi.turbine.definition import Turbine
    from meltemi.wind.turbulent import TurbulentWind

MOST_SEEDS = 1000
SCHEMES = "cpc,ipc,cpfc"
ACTUATORS = ("second_order", "ideal")
HELP = "\n".join(
    [
        "Compare control schemes in the same wind fields.",
        "",
        "Each scheme runs in wind fields of several seeds; writes tables, figures and an HTML page.",
        "",
        "\b",
        "Controllers:",
        *(f"  {name:12s} {about}" for name, about in NAMES.items()),
        "  own.py       a Python file with controller(turbine), module:function, or a library",
    ]
)


@with_options
def compare(
    turbine: TurbineArgument,
    options: WindOptions,
    seeds: Annotated[int, typer.Option("--seeds", help="Number of wind fields.")] = 6,
    seed: Annotated[int, typer.Option("--seed", help="First seed; the others follow.")] = 1,
    duration: Annotated[float, typer.Option("--duration", help="Duration of each run [s].")] = 700.0,
    transient: Annotated[float, typer.Option("--transient", help="Initial transient, not evaluated [s].")] = 100.0,
    controllers: Annotated[
        str | None,
        typer.Option(
            "--controllers",
            help="Controllers, separated by commas; changes are relative to the first [cpc,ipc,cpfc; before them rosco "
            "for a turbine with settings of ROSCO].",
            autocompletion=completing(lambda: NAMES, several=True),
        ),
    ] = None,
    pitch_actuator: Annotated[
        str | None, typer.Option("--pitch-actuator", help="second_order, ideal [that of the turbine].")
    ] = None,
    power: Annotated[
        str | None,
        typer.Option("--power", help="Power reference: a share of rated power, or a CSV file of time,share [none]."),
    ] = None,
    workers: WorkersOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare control schemes in the same wind fields."""
    given = options.given()
    names = [name.strip() for name in (controllers or SCHEMES).split(",") if name.strip()]
    labelled(names)
    _check_seeds(seed, seeds)
    check_workers(workers)
    from meltemi.controllers.schemes import design_controllers, equipped, located
    from meltemi.controllers.specification import digest, specification
    from meltemi.controllers.trial import try_controllers
    from meltemi.tuning.turbine_controller import turbine_controller
    from meltemi.turbine.library import load_turbine
    from meltemi.turbine.power_turbine import aeroelastic

    described = _with_actuator(aeroelastic(load_turbine(turbine), "meltemi compare"), pitch_actuator)
    if controllers is None:
        own, note = turbine_controller(described, otherwise=names[0])
        names = list(dict.fromkeys((own, *names)))
        if note:
            say(f"note: {note}")
    bare, described = described, equipped(described, names)
    winds = _winds(given, described, duration, range(seed, seed + seeds))
    grid = None
    if power is not None:
        from meltemi.tuning.power_reference import check_followers, power_grid

        check_followers(names)
        grid = power_grid(power, described.rated_power)
    from meltemi.simulation.rotors import build
    from meltemi.tuning import compare as study
    from meltemi.tuning import comparison_report as report
    from meltemi.tuning.run_store import run_store

    study.check_duration(duration, transient)
    if described is not bare:
        source = described.blade.flaps[0].source
        say(f"note: {bare.name} has no flaps; those of the scheme are added, their increments assumed: {source}")
    began = time.perf_counter()
    folder_for(out)
    with run_store(
        out, repr(("compare", transient, [digest(located(specification(name), described)) for name in names], grid))
    ):
        model = build(described)
        with simulation_bar("tuning") as progress:
            designed = design_controllers(
                model, names, shear_exponent=min(max(winds[0].shear_exponent, 0.0), 0.99), progress=progress
            )
        try_controllers(designed.controllers, model)
        tuned = time.perf_counter()
        what, total = f"{len(names)} schemes, {seeds} winds, {duration:g} s", len(names) * seeds
        with simulation_bar(what, total, "runs") as progress:
            comparison = study.compare(
                model,
                designed.controllers,
                winds,
                duration=duration,
                transient=transient,
                grid=grid,
                workers=workers,
                progress=progress,
            )
        ran = time.perf_counter()
        wind = _wind_label(given, winds[0])
        title = f"{described.name}: {', '.join(comparison.schemes)} in the same wind fields"
        facts = _facts(described, wind, [w.seed for w in winds], duration, transient)
        facts += [("Power reference", f"{power} of rated power")] if power else []
        files = report.write_comparison(comparison, out, design=designed, title=title, facts=facts, **made_by())
    _show(comparison, f"{described.name}: {wind}, {len(comparison.winds)} seeds")
    print(
        f"{total} runs of {duration:g} s in {ran - tuned:.1f} s ({total * duration / (ran - tuned):.0f} times real "
        f"time), tuning in {tuned - began:.1f} s"
    )
    wrote(*files)
    suggest("loads", "plan", turbine, "--class", given.get("--wind-class", "IB"), "--quick")
    for warning in comparison.warnings():
        say(f"warning: {warning}")
    if comparison.failures:
        for failure in comparison.failures:
            say(f"excluded: {study.failure_line(failure)}")
        raise typer.Exit(1)


compare.__doc__ = HELP  # with the names of controllers


def _show(comparison: Comparison, title: str) -> None:
    """Print the tables of a comparison."""
    from meltemi.tuning import comparison_report as report

    head, rows, groups = report.main_rows(comparison)
    spanned = [name for name, span in groups for _ in range(span)]
    head = [f"{scheme}\n{name}" if scheme else name for scheme, name in zip(spanned, head, strict=True)]
    print_table(title, head, rows, text_columns=2)
    print(report.notes(comparison))
    if report.by_blade(comparison):
        what = "Ideal removal of 1P and 2P (a reference, not a bound)"
        title = f"{what}, and the share of its change reached by the schemes"
        print_table(title, *report.ceiling_rows(comparison), text_columns=3)


def _check_seeds(first: int, n: int) -> None:
    if not 1 <= n <= MOST_SEEDS:
        raise InputError(f"--seeds {n}: expected a number of seeds from 1 to {MOST_SEEDS}")
    if not 0 <= first < 2**63 - n:
        raise InputError(f"--seed {first}: expected a number from 0 to {2**63 - n - 1}")


def _with_actuator(turbine: Turbine, kind: str | None) -> Turbine:
    if kind is None:
        return turbine
    if kind not in ACTUATORS:
        raise InputError(f"--pitch-actuator {kind}: {did_you_mean(kind, ACTUATORS)}")
    return turbine.replace(**{"pitch_actuator.kind": kind})


def _winds(given: Mapping[str, Any], turbine: Turbine, duration: float, seeds: range) -> list[TurbulentWind]:
    """The wind with each seed."""
    from meltemi.cases.case import LoadCase, case_wind
    from meltemi.core.yamlfile import validated
    from meltemi.wind.turbulent import TurbulentWind

    described = wind_of_options(given)
    data = {"turbine": turbine.name, "wind": described, "duration": duration}
    found = case_wind(validated(data, LoadCase, "command line"), turbine, Path())
    if not isinstance(found, TurbulentWind):
        raise InputError(f"{found.label} is not turbulent, so seeds do not apply: use --ntm, --iec ETM or --turbulence")
    return [found.replace(seed=each) for each in seeds]


def _wind_label(given: Mapping[str, Any], wind: TurbulentWind) -> str:
    """Label of the wind without its seed."""
    model = [given["--iec"]] if "--iec" in given else []
    model += [f"class {given['--wind-class']}"] if model and "--wind-class" in given else []
    return ", ".join([*([" ".join(model)] if model else []), wind.label.rpartition(", seed")[0]])


def _facts(turbine: Turbine, wind: str, seeds: list[int], duration: float, transient: float) -> list[tuple[str, str]]:
    actuator = "ideal" if turbine.pitch_actuator.kind == "ideal" else "second order"
    n = len(turbine.blade.flaps)
    flaps = f", {n} flap{'s' * (n > 1)} per blade" if n else ""
    return [
        ("Turbine", f"{turbine.name}, pitch actuator {actuator}{flaps}"),
        ("Wind", wind),
        ("Seeds", str(seeds[0]) if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"),
        ("Duration", f"{duration:g} s each, evaluated after {transient:g} s"),
    ]
