"""Everything on one page and in files: claims, errors of the paper, figures, diagrams, what lies beyond."""

from __future__ import annotations

import textwrap
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.environment.rain import Rain
from meltemi.report.html import Picture, Section, Table, write_page
from meltemi.report.plots import save
from meltemi.studies.journal import attempt, guarded, journal
from meltemi_papers.claim import UNJUDGED, Claim, brief, claims_table, count_held
from meltemi_papers.markdown import alone, documented, picture_line, table_lines
from meltemi_papers.palanimuthu2022 import beyond, diagrams
from meltemi_papers.palanimuthu2022.claims import REASONS, formula_claims
from meltemi_papers.palanimuthu2022.figure6 import gains, gains_table, mean_gains
from meltemi_papers.palanimuthu2022.figures import climate, plane, rain, rain_power
from meltemi_papers.palanimuthu2022.figures import runs as run_figures
from meltemi_papers.palanimuthu2022.figures.rain_power import STORM, loss
from meltemi_papers.palanimuthu2022.machine import FORMULA
from meltemi_papers.palanimuthu2022.paper import RATE, WIND
from meltemi_papers.palanimuthu2022.readings import readings, readings_table
from meltemi_papers.palanimuthu2022.run_claims import (
    mean_speed,
    run_claims,
    schemes_table,
    travel_ratio,
)
from meltemi_papers.palanimuthu2022.runs import (
    LITERAL,
    PHYSICAL,
    PLAIN,
    QUICK,
    Progress,
    Runs,
    Setup,
    run_all,
)
from meltemi_papers.study import Drawn, Reproduction, drawn, failed_tables, picture, tabled, write_tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HERE = Path(__file__).parent
NAME = "palanimuthu2022"
TITLE = "Palanimuthu et al. (2022): a 20 MW turbine in its climate and on the grid, reproduced"
SOURCE = (
    "Palanimuthu, K., Mayilsamy, G., Basheer, A. A., Lee, S.-R., Song, D., Joo, Y. H. (2022): A review of recent "
    "aerodynamic power extraction challenges in coordinated pitch, yaw, and torque control of large-scale wind turbine "
    "systems. Energies 15(21), 8161."
)
PAPER = 0.02
"""Share of the time that the paper's part takes, where something beyond it is run."""

FIGURES: dict[str, tuple[str, Callable[[Runs], Figure]]] = {
    "fig01_system": ("Figure 1: the system, from its environment to the grid", lambda runs: diagrams.system()),
    "fig02_humidity": ("Figure 2: density over temperature and humidity", lambda runs: climate.humidity()),
    "fig03_altitude": ("Figure 3: density over temperature and altitude", lambda runs: climate.altitude()),
    "fig04_temperature": (
        "Figure 4: power over rotor speed by temperature",
        lambda runs: climate.power_by_temperature(),
    ),
    "fig05_altitude": ("Figure 5: power over rotor speed by altitude", lambda runs: climate.power_by_altitude()),
    "fig06_temperature_steps": (
        "Figure 6: optimal torque while the temperature falls in steps",
        run_figures.temperature_steps,
    ),
    "fig07_humidity_steps": ("Figure 7: optimal torque while the humidity rises in steps", run_figures.humidity_steps),
    "fig08_drops": ("Figure 8: drops of the eight classes of rain", lambda runs: rain.drops()),
    "fig09_wetted_area": (
        "Figure 9: wetted area over speed; dots: smallest, by (13)",
        lambda runs: rain.wetted(),
    ),
    "fig10_rain_wind": ("Figure 10: power over wind at constant rotor speeds", lambda runs: rain_power.over_wind()),
    "fig11_rain_speed": (
        "Figure 11: power over rotor speed by wind, and the loci of the best points",
        lambda runs: rain_power.over_speed(),
    ),
    "fig12_rain_pitch": ("Figure 12: power over rotor speed by pitch", lambda runs: rain_power.by_pitch()),
    "fig13_drop_size": ("Figure 13: power over rotor speed by the size of drops", lambda runs: rain_power.by_drop()),
    "fig14_drop_number": (
        "Figure 14: power over rotor speed by number and density of drops",
        lambda runs: rain_power.by_number(),
    ),
    "fig15_climate": ("Figure 15: from weather to power", lambda runs: diagrams.climate()),
    "fig16_coordination": (
        "Figure 16: pitch, torque and yaw under one controller",
        lambda runs: diagrams.coordination(),
    ),
    "fig17_rated_speed": ("Figure 17: pitch from rated speed on (A1)", plane.rated_speed),
    "fig18_hold": ("Figure 18: pitch held between the speeds (A2)", plane.hold),
    "fig19_wide_hold": ("Figure 19: pitch held down to the speed that suits it (A3)", plane.wide_hold),
    "fig20_climates": ("Figure 20: two climates", run_figures.climates),
    "fig21_limited_power": ("Figure 21: 15 MW under four schemes", run_figures.limited),
}
Files = dict[str, tuple[str, list[Table]]]


def reproduce(
    out: Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    progress: Progress = lambda share, what: None,
    parts: Sequence[str] = (),
) -> Reproduction:
    """Run everything and write it.

    Args:
      out: folder for page, tables and figures; it must exist.
      quick: few runs: a look, nothing to judge by.
      workers: threads.
      progress: called with the share that is done and what is under way.
      parts: of what lies beyond the paper (``beyond.PARTS``), which take long. Each writes its section to a file of
        its own; the page has all sections that lie in the folder.
    """
    began = time.perf_counter()
    setup = QUICK if quick else Setup()
    paper = PAPER if parts else 1.0
    with journal(out, f"{NAME}, quick {quick}", "meltemi_papers") as book:
        runs = run_all(setup, workers=workers, progress=lambda done, what: progress(paper * done, what))
        found = [*formula_claims(), *run_claims(runs)]
        summary = lead(found, runs)
        tables = _tables(runs, found)
        pictures = {name: drawn(name, text, partial(draw, runs), out) for name, (text, draw) in FIGURES.items()}
        files = [file for _, file in pictures.values() if file] + write_tables(tables, out)
        own = Section("The paper's figures", [picture(*pair) for pair in pictures.values()])
        sections: list[Section] = []

        def write() -> tuple[list[Path], str]:
            """The page of what was run so far."""
            failed = failed_tables()
            text = markdown(summary, tables | failed, pictures, out)
            path = out / f"{NAME}.md"
            path.write_text(alone(text), encoding="utf-8")
            facts = [
                ("turbine", "pmsg20mw: PMSG of 20 MW, radius 138 m"),
                ("seeds", ", ".join(str(seed) for seed in setup.seeds)),
                ("computed in", f"{time.perf_counter() - began:.0f} s"),
            ]
            all_ = [*_paper_sections(tables | failed), *sections, own]
            page = write_page(out / f"{NAME}.html", TITLE, all_, facts=facts, lead=summary, footer=SOURCE)
            return [path, page, *write_tables(failed, out)], text

        for number, name in enumerate(parts):
            write()
            begin, length = paper + (1.0 - paper) * number / len(parts), (1.0 - paper) / len(parts)
            section, written = _beyond(name, out, runs, workers, partial(_told, progress, begin, length))
            sections.append(section)
            files += written
        written, text = write()
        shown = [brief(claims_table(found))]
        return Reproduction(shown, summary, [*files, *written], documented(text, NAME), **book.problems())


def _told(progress: Progress, begin: float, length: float, done: float, what: str) -> None:
    progress(begin + length * done, what)


def _beyond(name: str, out: Path, runs: Runs, workers: int | None, progress: Progress) -> tuple[Section, list[Path]]:
    """Run a part of what lies beyond the paper; its section and the files that were written."""
    part = import_module(f"{beyond.__name__}.{name}")
    found = attempt(name, part.study, runs, workers=workers, progress=progress)

    def lost(why: str) -> Files:
        return {name: (f"Beyond the paper: {name}", [Table([name], [[f"cannot be made: {why}"]], name)])}

    tables: Files = guarded(lambda: part.tables(found), lost)
    figures: dict[str, tuple[str, Figure]] = guarded(lambda: part.figures(found), lambda why: {})
    verdict: str = guarded(lambda: part.verdict(found), lambda why: UNJUDGED + why)
    files = [save(figure, out / f"{file}.png") for file, (_, figure) in figures.items()]
    files += write_tables(tables, out)
    heading = next(iter(tables.values()))[0]
    lines = [f"## {heading}", "", verdict, ""]
    lines += [f"![{text}]({file}.png)\n" for file, (text, _) in figures.items()]
    made = [table for _, several in tables.values() for table in several]
    for table in made:
        lines += [*table_lines(table), ""]
    path = out / f"{name}.md"
    path.write_text("\n".join(lines), encoding="utf-8")
    pictures = [Picture(out / f"{file}.png", text) for file, (text, _) in figures.items()]
    return Section(heading, [*verdict.split("\n\n"), *pictures, *made]), [*files, path]


def _tables(runs: Runs, found: list[Claim]) -> Files:
    def both() -> Table:
        dry = runs.temperature[PLAIN]
        won = dict(zip(dry.levels, gains(dry), strict=True))
        speeds = mean_speed(runs, FORMULA, "A0"), mean_speed(runs, FORMULA, "A1")
        return readings_table(readings(won, speeds))

    one, six, twenty_one = "Where the paper errs or is silent", "Figure 6 in numbers", "Figure 21 in numbers"
    return {
        "claims": ("Claim by claim", [claims_table(found)]),
        "readings": (one, [tabled(one, both)]),
        "gains": (six, [tabled(six, lambda: gains_table(runs))]),
        "schemes": (twenty_one, [tabled(twenty_one, lambda: schemes_table(runs))]),
    }


def _paper_sections(tables: Files) -> list[Section]:
    sections = []
    for name, (heading, made) in tables.items():
        content: list[str | Table | Picture] = list(made)
        if name == "claims":
            content += [f"{key}: {words}" for key, words in _used(made[0]).items()]
        sections.append(Section(heading, content))
    return sections


def _used(table: Table) -> dict[str, str]:
    """Reasons that stand in the table of claims."""
    at = list(table.head).index("reason")
    return {row[at]: REASONS[row[at]] for row in table.rows if row[at]}


def lead(found: list[Claim], runs: Runs) -> str:
    """The result in a few sentences."""
    return f"{count_held(found)} {guarded(partial(_lead, runs), lambda why: f'The rest {UNJUDGED}{why}.')}"


def _lead(runs: Runs) -> str:
    plain = runs.temperature[PLAIN]
    won, over = ([x * 1e-3 for x in of(plain)[[0, -1]]] for of in (gains, mean_gains))
    still = [x * 1e-3 for x in gains(runs.temperature[LITERAL])[[0, -1]]]
    one_size, all_sizes = (float(loss(r, WIND)[0]) * 1e-6 for r in (STORM, Rain(rate=RATE)))
    saved = 100.0 * (1.0 - travel_ratio(runs, PHYSICAL, "A2").mean)
    return (
        "The paper's formulas give its numbers to the digit once its slips are "
        "mended; what differs most is what its text says of them, and its inertia taken literally. Figure 6 differs, "
        f"too: for its gains of 58 and 71 kW the air gives {won[0]:.0f} and {won[1]:.0f} kW at the end of the "
        "intervals, with the inertia of the blades and the usual curve of the power coefficient, and the generator "
        f"{over[0]:.0f} and {over[1]:.0f} kW in the mean over them, as the rotor gives and takes kinetic energy. With "
        f"hardly any inertia it is {still[0]:.0f} and {still[1]:.0f} kW, and with a curve that is fitted to them the "
        f"paper's own. Rain of {RATE:g} mm/h takes {one_size:.1f} MW as the paper counts "
        f"drops, {all_sizes:.2f} MW with drops of all sizes. To hold the pitch between two speeds (A2) saves "
        f"{saved:.0f} % of its travel at the same power."
    )


def markdown(summary: str, tables: Files, pictures: Drawn, out: Path) -> str:
    """Tables and figures for the documentation, with the sections of the parts that lie in the folder."""
    parts = [(HERE / "before.md").read_text(encoding="utf-8"), *textwrap.wrap(summary, 118), ""]
    for name, (heading, made) in tables.items():
        parts += [f"## {heading}", ""]
        for table in made:
            parts += [*table_lines(table), ""]
        if name == "claims":
            parts += [f"*{key}:* {words}\n" for key, words in _used(made[0]).items()]
    files = [out / f"{name}.md" for name in beyond.PARTS]
    parts += [file.read_text(encoding="utf-8") for file in files if file.is_file()]
    parts += ["## The paper's figures", ""]
    parts += [f"{picture_line(*pair)}\n" for pair in pictures.values()]
    parts.append((HERE / "after.md").read_text(encoding="utf-8"))
    return "\n".join(parts)
