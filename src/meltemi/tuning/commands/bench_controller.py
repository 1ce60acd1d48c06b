"""``meltemi bench-controller``: controllers through a fixed suite of cases, against a reference and limits."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

import meltemi
from meltemi.app.options import CONTROLLER, CONTROLLERS, TURBINES, WorkOptions, load_aeroelastic
from meltemi.app.terminal import OutOption, made_by, print_table, say, simulation_bar, suggest, wrote


def bench_controller(
    controllers: Annotated[list[str], f"Controllers: {CONTROLLER}.", CONTROLLERS],
    work: WorkOptions,
    turbine: Annotated[str, "A turbine's name or YAML file.", TURBINES] = "nrel5mw",
    reference: Annotated[str | None, "Controller against which changes are formed [baseline; with --power A1]."] = None,
    power: Annotated[str | None, "Power reference: a share of rated power, or a CSV file of time,share [none]."] = None,
    wind_class: Annotated[str, "--wind-class", "--class", "Class of IEC 61400-1, e.g. IIB."] = "IB",
    limits: Annotated[Path | None, "YAML file with other limits, e.g. over_speed: 1.2."] = None,
    quick: Annotated[bool, "Reduced suite, which takes about a minute."] = False,
    out: OutOption = Path("out"),
) -> None:
    """Test controllers in a fixed suite of cases against a reference; writes a page, tables and a leaderboard."""
    from meltemi.controllers.names import labelled
    from meltemi.controllers.schemes import located
    from meltemi.controllers.specification import digest, specification
    from meltemi.core.yamlfile import read_record
    from meltemi.iec.classes import as_class

    reference = reference or ("baseline" if power is None else "A1")
    names = _names(controllers, reference)
    as_class(wind_class, None)
    bounds = None if limits is None else read_record(limits, meltemi.analysis.BenchLimits)

    described = load_aeroelastic(turbine, "meltemi bench-controller")
    from meltemi.tuning.controller_bench.study import one_name
    from meltemi.tuning.power_reference import followed_grid

    grid = followed_grid(power, names, described.rated_power)
    names = list(dict.fromkeys(one_name(names, described)))
    labels = list(labelled(names))
    laws = [(name, digest(located(specification(name), described))) for name in names]
    inputs = repr(("bench-controller", wind_class, quick, grid, laws))
    from meltemi.tuning.controller_bench import tables
    from meltemi.tuning.run_store import run_store

    began = time.perf_counter()
    with run_store(out, inputs, **work.divided()):
        with simulation_bar(f"{len(labels)} controllers") as progress:
            bench = meltemi.analysis.bench_controllers(
                described, names, reference=labels[0], quick=quick, wind_class=wind_class, limits=bounds, grid=grid,
                workers=work.workers, progress=progress,
            )  # fmt: skip
        files = meltemi.analysis.write_bench(bench, out, **made_by())
    print_table(f"{bench.turbine}, class {wind_class}", *tables.leaderboard_rows(bench.leaderboard(), bench.reference))
    print(
        "changes against the reference in the same winds, with 95 % intervals; speed over its reference, clearance over"
    )
    print("that of the undeflected blade: worst case; phase and gain margins: smallest of all wind speeds")
    verdicts = bench.all_verdicts()
    failing = tables.verdict_rows(
        {name: [v for v in criteria if v.passed is False] for name, criteria in verdicts.items()}
    )
    print_table("Criteria that fail", *failing, text_columns=2, all_rows=tables.verdict_rows(verdicts))
    seconds = sum(case.duration for case in bench.cases) * len(labels)
    print(f"{seconds:.0f} s simulated in {time.perf_counter() - began:.0f} s")
    wrote(*files)
    suggest("compare", turbine, "--ntm", "--wind-class", wind_class, "--wind-speed", 18)
    if bench.failures:
        say(f"{len(bench.failures)} runs did not reach their end: see {out / 'bench.html'}")
        raise typer.Exit(1)


def _names(controllers: list[str], reference: str) -> list[str]:
    """The reference and the other controllers, without those whose package is missing."""
    from meltemi.controllers.names import labelled
    from meltemi.controllers.specification import check_files, specification
    from meltemi.core.extras import need, skipped

    labelled(controllers)
    absent = skipped({name: ("rosco",) for name in controllers if name.partition("@")[0] == "rosco"})
    if reference.partition("@")[0] == "rosco" or len(absent) == len(controllers):
        need("controller rosco", "rosco")
    for words in absent.values():
        say(words)
    names = list(dict.fromkeys((reference, *(name for name in controllers if name not in absent))))
    for name in names:
        check_files(specification(name))
    return names
