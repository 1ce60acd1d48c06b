"""``meltemi compare``: comparison of control schemes in the same wind fields."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import meltemi
from meltemi.app.options import (
    TurbineArgument,
    WindOptions,
    WorkOptions,
    completing,
    load_aeroelastic,
    of_options,
    wind_of_options,
)
from meltemi.app.scans import finish
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, made_by, print_table, say, simulation_bar, suggest, warn, wrote
from meltemi.controllers.names import NAMES, labelled
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.tuning.compare import Comparison
    from meltemi.turbine.definition import Turbine
    from meltemi.wind.turbulent import TurbulentWind

LAST_SEED = 2**63 - 1001
HELP = "\n".join(
    [
        "Compare control schemes in the same wind fields.",
        "",
        "Each scheme runs in wind fields of several seeds; writes tables, figures and an HTML page.",
        "",
        "\b",
        "Controllers:",
        *(f"  {name:12s} {about}" for name, about in NAMES.items()),
        "  mine.py      a Python file with controller(turbine), module:function, or a library",
    ]
)


def compare(
    turbine: TurbineArgument,
    options: WindOptions,
    work: WorkOptions,
    seeds: Annotated[int, "Number of wind fields.", Range(1, 1000)] = 6,
    seed: Annotated[int, "First seed; the others follow.", Range(0, LAST_SEED)] = 1,
    duration: Annotated[float, "Duration of each run [s]."] = 700.0,
    transient: Annotated[float, "Initial transient, not evaluated [s]."] = 100.0,
    controllers: Annotated[
        tuple[str, ...] | None,
        "Controllers, separated by commas; changes are relative to the first [cpc,ipc,cpfc; "
        "before them rosco for a turbine with settings of ROSCO].",
        completing(lambda: NAMES, several=True),
    ] = None,
    pitch_actuator: Annotated[
        Literal["second_order", "ideal"] | None, "second_order, ideal [that of the turbine]."
    ] = None,
    power: Annotated[str | None, "Power reference: a share of rated power, or a CSV file of time,share [none]."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare control schemes in the same wind fields."""
    given = options.given()
    names = ["cpc", "ipc", "cpfc"] if controllers is None else list(controllers)
    labelled(names)
    from meltemi.controllers.schemes import design_controllers, equipped, located
    from meltemi.controllers.specification import digest, specification
    from meltemi.controllers.trial import try_controllers
    from meltemi.tuning.turbine_controller import turbine_controller

    described = load_aeroelastic(turbine, "meltemi compare")
    if pitch_actuator is not None:
        described = described.replace(**{"pitch_actuator.kind": pitch_actuator})
    if controllers is None:
        controller, note = turbine_controller(described, otherwise=names[0])
        names = list(dict.fromkeys((controller, *names)))
        if note:
            say(f"note: {note}")
    bare, described = described, equipped(described, names)
    winds = _winds(given, described, duration, range(seed, seed + seeds))
    from meltemi.tuning.power_reference import followed_grid

    grid = followed_grid(power, names, described.rated_power)
    from meltemi.tuning import compare as study
    from meltemi.tuning import comparison_report as report
    from meltemi.tuning.run_store import run_store

    study.check_duration(duration, transient)
    if described is not bare:
        source = described.blade.flaps[0].source
        say(f"note: {bare.name} has no flaps; those of the scheme are added, their increments assumed: {source}")
    began = time.perf_counter()
    inputs = repr(("compare", transient, [digest(located(specification(name), described)) for name in names], grid))
    with run_store(out, inputs, **work.divided()):
        model = meltemi.build(described)
        with simulation_bar("tuning") as progress:
            designed = design_controllers(
                model, names, shear_exponent=min(max(winds[0].shear_exponent, 0.0), 0.99), progress=progress
            )
        try_controllers(designed.controllers, model)
        tuned = time.perf_counter()
        what, total = f"{len(names)} schemes, {seeds} winds, {duration:g} s", len(names) * seeds
        with simulation_bar(what, total, "runs") as progress:
            comparison = study.compare(
                model, designed.controllers, winds, duration=duration, transient=transient, grid=grid,
                workers=work.workers, progress=progress,
            )  # fmt: skip
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
    warn(comparison.warnings())
    finish(f"excluded: {study.failure_line(failure)}" for failure in comparison.failures)


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


def _winds(given: Mapping[str, Any], turbine: Turbine, duration: float, seeds: range) -> list[TurbulentWind]:
    """The wind with each seed."""
    from meltemi.cases.case import case_wind

    described = wind_of_options(given)
    data = {"turbine": turbine.name, "wind": described, "duration": duration}
    wind = case_wind(of_options(data, meltemi.io.LoadCase), turbine, Path())
    if not isinstance(wind, meltemi.TurbulentWind):
        raise InputError(f"{wind.label} is not turbulent, so seeds do not apply: use --ntm, --iec ETM or --turbulence")
    return [wind.replace(seed=each) for each in seeds]


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
