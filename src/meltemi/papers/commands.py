"""``meltemi reproduce``: reproduction of a published study."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated

from meltemi.app.options import TURBINES, WorkOptions, completing, load_aeroelastic
from meltemi.app.scans import cells, finish
from meltemi.app.terminal import OutOption, print_table, say, simulation_bar, suggest, warn, wrote
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need, skipped

STUDIES = {
    "he2018": "combined individual pitch and flap control of the NREL 5 MW (Energies 11, 2519)",
    "wang2021": "yaw-error thresholds, derating instead of shutdown (Front. Energy Res. 9, 711927)",
    "palanimuthu2022": "a 20 MW turbine in its climate and on the grid (Energies 15, 8161)",
}


def reproduce(
    study: Annotated[
        str, "Which one: " + "; ".join(f"{k}: {v}" for k, v in STUDIES.items()), completing(lambda: STUDIES)
    ],
    work: WorkOptions,
    quick: Annotated[bool, "Few, short runs, for a first impression only."] = False,
    rosco: Annotated[bool, "he2018: only the comparison of its load control with ROSCO."] = False,
    beyond: Annotated[
        tuple[str, ...] | None, "Parts beyond palanimuthu2022 or wang2021, as gusts,budget, or all."
    ] = None,
    turbine: Annotated[
        str | None, "Apply the paper's methods to another turbine: a separate page, without claims.", TURBINES
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Reproduce a published study: comparison of all claims, figures and page."""
    if study not in STUDIES:
        raise InputError(f"no study {study!r}: {did_you_mean(study, STUDIES)}")
    if turbine is not None and (rosco or beyond is not None):
        raise InputError(f"--turbine runs all of {study} that applies to another turbine: without --rosco and --beyond")
    if rosco:
        if study != "he2018":
            raise InputError(f"--rosco belongs to he2018; {study} has no such part")
        _rosco(quick, work, out)
        return
    parts = () if beyond is None else _parts(study, beyond)
    from meltemi.papers import study as study_module

    page = import_module(f"meltemi.papers.{study}.page")
    chosen = page.STUDY
    if turbine is not None:
        chosen = chosen.applied(load_aeroelastic(turbine, f"meltemi reproduce {study} --turbine"))
    need(f"reproduce {study}", *chosen.needs)
    for words in skipped(chosen.parts_need).values() if turbine is None else ():
        say(words)
    with simulation_bar(study) as progress:
        result = study_module.reproduce(
            chosen,
            out,
            quick=quick,
            workers=work.workers,
            progress=lambda share, what: progress(share),
            parts=parts,
            **work.divided(),
        )
    for table in result.tables:
        print_table(table.caption, table.head, table.texts, text_columns=len(table.head))
    print(result.lead)
    warn((f"{cell}: {why}" for cell, why in result.doubtful.items()), "DOUBTFUL")
    wrote(*result.files)
    again = ("reproduce", study, *(("--turbine", turbine) if turbine else ()), "--out", out)
    suggest(*(again if quick or result.failed else ("verify", "--out", out)))
    finish(cells(result.failed))


def _parts(study: str, names: tuple[str, ...]) -> Sequence[str]:
    """The parts beyond a paper of these names."""
    parts = import_module(f"meltemi.papers.{study}.page").STUDY.parts
    if not parts:
        raise InputError(f"--beyond is an option of palanimuthu2022 and wang2021; {study} always runs all of its parts")
    requested = tuple(parts) if names == ("all",) else names
    for name in requested:
        if name not in parts:
            raise InputError(f"--beyond: no part {name!r}: {did_you_mean(name, [*parts, 'all'])}")
    if study == "palanimuthu2022":
        need("--beyond", "windIO")  # their turbine is iea22mw
    return requested


def _rosco(quick: bool, work: WorkOptions, out: Path) -> None:
    from meltemi.bladed_controllers.rosco import find_rosco
    from meltemi.tuning.run_store import run_store

    find_rosco()
    with run_store(out, f"rosco, quick {quick}", "meltemi.papers", **work.divided()):
        from meltemi.papers.he2018.rosco import brief, chapter, compare_with_rosco, comparison_tables, findings
        from meltemi.papers.he2018.runs import QUICK, LoadControlSetup
        from meltemi.papers.study import write_chapter

        with simulation_bar("he2018 compared with ROSCO") as progress:
            setup = QUICK if quick else LoadControlSetup()
            comparison = compare_with_rosco(setup, workers=work.workers, progress=lambda share, what: progress(share))
        files = write_chapter(chapter(comparison), "rosco", out)
    for table in map(brief, comparison_tables(comparison)):
        print_table(table.caption, table.head, table.texts)
    for line in findings(comparison):
        print(line)
    wrote(*files)
    suggest("reproduce", "he2018", *(("--rosco",) if quick else ()), "--out", out)
