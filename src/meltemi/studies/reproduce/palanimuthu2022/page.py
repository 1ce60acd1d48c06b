"""Everything on one page and in files: claims, errors of the paper, figures, diagrams, what lies beyond."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.report.html import Picture, Section, Table, write_page
from meltemi.report.plots import save
from meltemi.studies.reproduce.claim import Claim, brief, claims_table
from meltemi.studies.reproduce.markdown import table_lines
from meltemi.studies.reproduce.palanimuthu2022 import beyond, diagrams
from meltemi.studies.reproduce.palanimuthu2022.claims import REASONS, formula_claims
from meltemi.studies.reproduce.palanimuthu2022.figures import climate, plane, rain, rain_power
from meltemi.studies.reproduce.palanimuthu2022.figures import runs as run_figures
from meltemi.studies.reproduce.palanimuthu2022.machine import FORMULA
from meltemi.studies.reproduce.palanimuthu2022.readings import readings, readings_table
from meltemi.studies.reproduce.palanimuthu2022.run_claims import (
    gains,
    gains_table,
    mean_speed,
    run_claims,
    schemes_table,
)
from meltemi.studies.reproduce.palanimuthu2022.runs import QUICK, Progress, Runs, Setup, run_all
from meltemi.studies.reproduce.study import Reproduction, write_tables

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
SHARE = 0.3
"""Of the time that the paper's part takes, where something lies beyond it."""

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
    out: Path, *, quick: bool = False, workers: int | None = None, progress: Progress = lambda share, what: None
) -> Reproduction:
    """Run everything and write it.

    Args:
      out: folder for page, tables and figures; it must exist.
      quick: few runs: a look, nothing to judge by.
      workers: threads.
      progress: called with the share that is done and what is under way.
    """
    began = time.perf_counter()
    setup = QUICK if quick else Setup()
    share = SHARE if beyond.PARTS else 1.0
    runs = run_all(setup, workers=workers, progress=lambda done, what: progress(share * done, what))
    found = [*formula_claims(), *run_claims(runs)]
    tables = _tables(runs, found)
    drawn = {name: (text, draw(runs)) for name, (text, draw) in FIGURES.items()}
    verdicts = {}
    for number, name in enumerate(beyond.PARTS):
        part = import_module(f"{beyond.__name__}.{name}")
        begin, length = share + (1.0 - share) * number / len(beyond.PARTS), (1.0 - share) / len(beyond.PARTS)
        more = part.study(
            runs,
            workers=workers,
            progress=lambda done, what, b=begin, n=length: progress(b + n * done, what),
        )
        tables |= part.tables(more)
        drawn |= part.figures(more)
        verdicts[name] = part.verdict(more)
    files = [save(figure, out / f"{name}.png") for name, (_, figure) in drawn.items()]
    files += write_tables(tables, out)
    captions = {name: text for name, (text, _) in drawn.items()}
    path = out / f"{NAME}.md"
    path.write_text(markdown(found, tables, captions, verdicts), encoding="utf-8")
    files.append(path)
    facts = [
        ("turbine", "pmsg20mw: PMSG of 20 MW, radius 138 m"),
        ("seeds", ", ".join(str(seed) for seed in setup.seeds)),
        ("computed in", f"{time.perf_counter() - began:.0f} s"),
    ]
    sections = _sections(out, tables, captions, verdicts)
    files.append(write_page(out / f"{NAME}.html", TITLE, sections, facts=facts, lead=lead(found), footer=SOURCE))
    return Reproduction([brief(claims_table(found))], lead(found), files)


def _tables(runs: Runs, found: list[Claim]) -> Files:
    dry = runs.temperature["M1, dry, 4.872e6 kg m²"]
    won = dict(zip(dry.levels, gains(dry), strict=True))
    speeds = mean_speed(runs, FORMULA, "A0"), mean_speed(runs, FORMULA, "A1")
    return {
        "claims": ("Claim by claim", [claims_table(found)]),
        "readings": ("Where the paper errs or is silent", [readings_table(readings(won, speeds))]),
        "gains": ("Figure 6 in numbers", [gains_table(runs)]),
        "schemes": ("Figure 21 in numbers", [schemes_table(runs)]),
    }


def _part_of(name: str) -> str:
    """The part beyond the paper that a file belongs to; empty if it is the paper's."""
    return next((part for part in beyond.PARTS if name.startswith(part)), "")


def _sections(out: Path, tables: Files, captions: dict[str, str], verdicts: dict[str, str]) -> list[Section]:
    sections = []
    for name, (heading, made) in tables.items():
        content: list[str | Table | Picture] = list(made)
        if name == "claims":
            content += [f"{key}: {words}" for key, words in _used(made[0]).items()]
        if name in verdicts:
            content = [verdicts[name], *content]
            content += [Picture(out / f"{n}.png", t) for n, t in captions.items() if _part_of(n) == name]
        sections.append(Section(heading, content))
    own = [Picture(out / f"{n}.png", t) for n, t in captions.items() if not _part_of(n)]
    sections.append(Section("The paper's figures", own))
    return sections


def _used(table: Table) -> dict[str, str]:
    """Reasons that stand in the table of claims."""
    at = list(table.head).index("reason")
    return {row[at]: REASONS[row[at]] for row in table.rows if row[at]}


def lead(found: list[Claim]) -> str:
    """The result in a sentence."""
    held = sum(c.verdict == "holds" for c in found)
    return f"{held} of {len(found)} lines hold. " + (HERE / "lead.md").read_text(encoding="utf-8").strip()


def markdown(found: list[Claim], tables: Files, captions: dict[str, str], verdicts: dict[str, str]) -> str:
    """Tables and figures for the documentation."""
    parts = [(HERE / "before.md").read_text(encoding="utf-8"), lead(found), ""]
    for name, (heading, made) in tables.items():
        parts += [f"## {heading}", ""]
        if name in verdicts:
            parts += [verdicts[name], ""]
            parts += [f"![{t}]({NAME}/{n}.png)\n" for n, t in captions.items() if _part_of(n) == name]
        for table in made:
            parts += [*table_lines(table), ""]
        if name == "claims":
            parts += [f"*{key}:* {words}\n" for key, words in _used(made[0]).items()]
    parts += ["## The paper's figures", ""]
    parts += [f"![{t}]({NAME}/{n}.png)\n" for n, t in captions.items() if not _part_of(n)]
    parts.append((HERE / "after.md").read_text(encoding="utf-8"))
    return "\n".join(parts)
