"""Page of the study: claims, errors of the paper, figures, results beyond the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meltemi.papers.claim import Claim, brief, claims_table, count_held, reason_lines
from meltemi.papers.palanimuthu2022 import beyond
from meltemi.papers.palanimuthu2022.beyond.coordination import bench, bench_chapter
from meltemi.papers.palanimuthu2022.claims import BLADES_IN_RAIN, RAIN, REASONS, formula_claims
from meltemi.papers.palanimuthu2022.figure6 import curves_table, gains_table, mean_gains
from meltemi.papers.palanimuthu2022.figures import climate, rain
from meltemi.papers.palanimuthu2022.figures import runs as run_figures
from meltemi.papers.palanimuthu2022.machine import FORMULA
from meltemi.papers.palanimuthu2022.paper import sentence
from meltemi.papers.palanimuthu2022.readings import readings, readings_table
from meltemi.papers.palanimuthu2022.run_claims import (
    changes_of,
    mean_speed,
    percent,
    run_claims,
    schemes_table,
    travel_change,
)
from meltemi.papers.palanimuthu2022.runs import (
    PHYSICAL,
    PLAIN,
    QUICK,
    SMALL,
    PowerControlRuns,
    PowerControlSetup,
    Reading,
    run_all,
)
from meltemi.papers.study import Contents, Draw, Progress, Study, applied, guarded_table, guarded_text, run_parts, span
from meltemi.papers.verdict import FEWEST_SEEDS
from meltemi.reports.blocks import Section, Table
from meltemi.studies.climate.tables import energy_table
from meltemi.studies.power_schemes.coordination import (
    ENERGY,
    PITCH,
    PROPOSAL,
    ROOT_LOAD,
    TOWER_LOAD,
    TURNED,
    ProposalComparison,
)
from meltemi.studies.power_schemes.costs import PITCH as TRAVEL
from meltemi.studies.power_schemes.costs import TOWER_LOAD as TOWER
from meltemi.studies.power_schemes.costs import efficient
from meltemi.tuning.run_store import attempt
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import packages_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER = 0.1
"""Share of the time for the default page, where something beyond it is run."""
GENTLE = "pitch and yaw"
"""Our coordination with A0 instead of A2."""


@dataclass(frozen=True)
class Results:
    """The paper's runs, its schemes on an aeroelastic turbine, its claims, and parts beyond it by name."""

    runs: PowerControlRuns
    bench: ProposalComparison
    claims: Sequence[Claim]
    parts: Mapping[str, Any] = field(default_factory=dict)


FIGURES: dict[str, tuple[str, Callable[[PowerControlRuns], Figure]]] = {
    "fig02_humidity": ("Figure 2: density over temperature and humidity", lambda runs: climate.humidity()),
    "fig03_altitude": ("Figure 3: density over temperature and altitude", lambda runs: climate.altitude()),
    "fig04_temperature": ("Figure 4: power over rotor speed by temperature", lambda runs: climate.by_temperature()),
    "fig05_altitude": ("Figure 5: power over rotor speed by altitude", lambda runs: climate.by_altitude()),
    "fig06_temperature_steps": (
        "Figure 6: optimal torque while the temperature falls in steps",
        run_figures.temperature_steps,
    ),
    "fig07_humidity_steps": ("Figure 7: optimal torque while the humidity rises in steps", run_figures.humidity_steps),
    "fig08_drops": ("Figure 8: drops of the eight classes of rain", lambda runs: rain.drops()),
    "fig09_wetted_area": ("Figure 9: wetted area over speed; dots: smallest, by (13)", lambda runs: rain.wetted()),
    "fig10_rain_wind": ("Figure 10: power over wind at constant rotor speeds", lambda runs: rain.over_wind()),
    "fig11_rain_speed": (
        "Figure 11: power over rotor speed by wind, and the loci of the best points",
        lambda runs: rain.over_speed(),
    ),
    "fig12_rain_pitch": ("Figure 12: power over rotor speed by pitch", lambda runs: rain.by_pitch()),
    "fig13_drop_size": ("Figure 13: power over rotor speed by the size of drops", lambda runs: rain.by_drop()),
    "fig14_drop_number": (
        "Figure 14: power over rotor speed by number and density of drops",
        lambda runs: rain.by_number(),
    ),
    "fig17_rated_speed": ("Figure 17: pitch from rated speed on (A1)", partial(run_figures.plane, scheme="A1")),
    "fig18_hold": ("Figure 18: pitch held between the speeds (A2)", partial(run_figures.plane, scheme="A2")),
    "fig19_wide_hold": (
        "Figure 19: pitch held down to the speed that suits it (A3)",
        partial(run_figures.plane, scheme="A3"),
    ),
    "fig20_climates": ("Figure 20: two climates", run_figures.climates),
    "fig21_limited_power": ("Figure 21: 15 MW under four schemes", run_figures.limited),
}


def run(
    *, quick: bool, workers: int | None, progress: Progress, partly: Callable[[Results], object], parts: Sequence[str]
) -> Results:
    """Simulate the paper's runs, then parts beyond it; ``partly`` is called with the results so far before each."""
    paper = PAPER if parts else 1.0
    runs = run_all(QUICK if quick else PowerControlSetup(), workers=workers, progress=span(progress, 0.0, 0.4 * paper))
    bench_progress = span(progress, 0.4 * paper, 0.6 * paper)
    loads = attempt("on an aeroelastic turbine", bench, quick, workers=workers, progress=bench_progress)
    results = Results(runs, loads, [*formula_claims(), *run_claims(runs, loads)])
    studies = {name: partial(_part(name).study, quick, workers=workers) for name in parts}
    done = run_parts(studies, span(progress, paper, 1.0 - paper), lambda some: partly(replace(results, parts=some)))
    return replace(results, parts=done)


def _part(name: str) -> Any:
    return import_module(f"{beyond.__name__}.{name}")


def _lead(runs: PowerControlRuns, loads: ProposalComparison) -> str:
    def gain(inertia: float) -> str:
        steps = runs.temperature[Reading(FORMULA, inertia=inertia)]
        return " and ".join(f"{x * 1e-3:.1f}" for x in mean_gains(steps)[[0, -1]])

    gains = sentence("gain", physical=gain(PHYSICAL), printed=gain(SMALL))
    if loads.conventional.seeds < FEWEST_SEEDS:
        return gains
    travel = percent(travel_change(runs, PHYSICAL, "A2"))
    cost, ours, gentle = (
        {quantity: percent(x, 1 if quantity == ENERGY else 0) for quantity, x in changes_of(table, name).items()}
        for table, name in ((loads.conventional, PROPOSAL), (loads.proposal, "all three"), (loads.proposal, GENTLE))
    )
    names = {"pitch": PITCH, "root": ROOT_LOAD, "tower": TOWER_LOAD, "energy": ENERGY, "turned": TURNED}
    schemes = {"cost": cost, "ours": ours, "gentle": gentle}
    numbers = {f"{scheme}_{name}": of[quantity] for scheme, of in schemes.items() for name, quantity in names.items()}
    return sentence("lead", gains=gains, travel=travel, **numbers)


def _readings(runs: PowerControlRuns) -> Table:
    dry = runs.temperature[PLAIN]
    won = dict(zip(dry.levels, mean_gains(dry), strict=True))
    return readings_table(readings(won, (mean_speed(runs, FORMULA, "A0"), mean_speed(runs, FORMULA, "A1"))))


def contents(results: Results, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    runs, table = results.runs, claims_table(results.claims)
    used = {claim.reason: REASONS[claim.reason] for claim in results.claims if claim.reason}
    chapters = {"claims": Section("Claim by claim", [table, *reason_lines(used)])}
    wanted: dict[str, tuple[str, tuple[Callable[[PowerControlRuns], Table], ...]]] = {
        "readings": ("Where the paper errs or is silent", (_readings,)),
        "gains": ("Figure 6 in numbers", (curves_table, gains_table)),
        "schemes": ("Figure 21 in numbers", (schemes_table,)),
    }
    chapters |= {
        name: Section(words, [guarded_table(words, partial(of, runs)) for of in each])
        for name, (words, each) in wanted.items()
    }
    chapters["bench"] = bench_chapter(results.bench, draw)
    chapters |= {name: _part(name).chapter(part, draw) for name, part in results.parts.items()}
    lead = f"{count_held(results.claims)} {guarded_text(partial(_lead, runs, results.bench), 'The rest')}"
    turbine, seeds = "pmsg20mw: PMSG of 20 MW, radius 138 m", ", ".join(map(str, runs.setup.seeds))
    return Contents(lead, chapters, [("turbine", turbine), ("seeds", seeds)], [brief(table)])


def of_turbine(turbine: Turbine) -> Study[Mapping[str, Any]]:
    """The schemes, the coordination and the climates on another turbine."""

    def run_all_parts(*, quick: bool, workers: int | None, progress: Progress, **_: Any) -> dict[str, Any]:
        names = beyond.PARTS
        studies = {name: partial(_part(name).study, quick, turbine=turbine, workers=workers) for name in names}
        return run_parts(studies, progress)

    def contents_of(parts: Mapping[str, Any], out: Path, draw: Draw) -> Contents:
        chapters = {name: _part(name).chapter(part, draw, applied=True) for name, part in parts.items()}
        lead = guarded_text(lambda: _efficient_text(efficient(parts["power"].front, (TRAVEL, TOWER))), "Limited power")
        year = guarded_table("A year", lambda: energy_table(parts["climate"]))
        return Contents(lead, chapters, [("turbine", turbine.name)], [year])

    title = "Limited power, coordination and climates of Palanimuthu et al. (2022)"
    return applied(STUDY, turbine, title, run=run_all_parts, contents=contents_of)


def _efficient_text(names: Sequence[str]) -> str:
    return f"Not beaten in pitch travel and load of the tower base at 75 % of rated power: {'; '.join(names)}."


STUDY: Study[Results] = Study(
    name="palanimuthu2022",
    title="Palanimuthu et al. (2022): a 20 MW turbine in its climate and on the grid, reproduced",
    source="Palanimuthu, K., Mayilsamy, G., Basheer, A. A., Lee, S.-R., Song, D., Joo, Y. H. (2022): A review of "
    "recent aerodynamic power extraction challenges in coordinated pitch, yaw, and torque control of large-scale wind "
    "turbine systems. Energies 15(21), 8161.",
    run=run,
    runs=lambda results: results.runs,
    figures=FIGURES,
    contents=contents,
    parts=beyond.PARTS,
    applied=of_turbine,
    parts_need=dict.fromkeys((RAIN, "loads on an aeroelastic turbine"), packages_of(BLADES_IN_RAIN)),
)
