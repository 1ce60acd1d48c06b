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
from meltemi.papers.palanimuthu2022.figures import climate, plane, rain, rain_power
from meltemi.papers.palanimuthu2022.figures import runs as run_figures
from meltemi.papers.palanimuthu2022.machine import FORMULA
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
from meltemi.papers.study import Contents, Draw, Progress, Study, applied, guarded_table, guarded_text, span
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
"""Share of the time that the default page takes, where something beyond it is run."""


@dataclass(frozen=True)
class Found:
    """The paper's runs, its schemes on an aeroelastic turbine, its claims, and parts beyond it by name."""

    runs: PowerControlRuns
    bench: ProposalComparison
    claims: Sequence[Claim]
    parts: Mapping[str, Any] = field(default_factory=dict)


FIGURES: dict[str, tuple[str, Callable[[PowerControlRuns], Figure]]] = {
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
    "fig09_wetted_area": ("Figure 9: wetted area over speed; dots: smallest, by (13)", lambda runs: rain.wetted()),
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
    "fig17_rated_speed": ("Figure 17: pitch from rated speed on (A1)", plane.rated_speed),
    "fig18_hold": ("Figure 18: pitch held between the speeds (A2)", plane.hold),
    "fig19_wide_hold": ("Figure 19: pitch held down to the speed that suits it (A3)", plane.wide_hold),
    "fig20_climates": ("Figure 20: two climates", run_figures.climates),
    "fig21_limited_power": ("Figure 21: 15 MW under four schemes", run_figures.limited),
}


def run(
    *, quick: bool, workers: int | None, progress: Progress, partly: Callable[[Found], object], parts: Sequence[str]
) -> Found:
    """Simulate the paper's runs, then parts beyond it; ``partly`` is called with the results so far before each."""
    paper = PAPER if parts else 1.0
    runs = run_all(QUICK if quick else PowerControlSetup(), workers=workers, progress=span(progress, 0.0, 0.4 * paper))
    told = span(progress, 0.4 * paper, 0.6 * paper)
    loads = attempt("on an aeroelastic turbine", bench, quick, workers=workers, progress=told)
    found = Found(runs, loads, [*formula_claims(), *run_claims(runs, loads)])
    length = (1.0 - paper) / max(len(parts), 1)
    for number, name in enumerate(parts):
        partly(found)
        told = span(progress, paper + number * length, length)
        part = attempt(name, _part(name).study, runs.setup.quick, workers=workers, progress=told)
        found = replace(found, parts={**found.parts, name: part})
    return found


def _part(name: str) -> Any:
    return import_module(f"{beyond.__name__}.{name}")


def _lead(runs: PowerControlRuns, loads: ProposalComparison) -> str:
    won = [
        " and ".join(f"{x * 1e-3:.1f}" for x in mean_gains(runs.temperature[Reading(FORMULA, inertia=j)])[[0, -1]])
        for j in (PHYSICAL, SMALL)
    ]
    gains = (
        "For the mean gains of 58.2 and 71.3 kW in Figure 6 the usual power coefficient gives "
        f"{won[0]} kW with the inertia of the blades and {won[1]} kW with the printed one."
    )
    if loads.conventional.seeds < FEWEST_SEEDS:
        return gains
    cost = changes_of(loads.conventional, PROPOSAL)
    ours, gentle = (changes_of(loads.proposal, name) for name in ("all three", "pitch and yaw"))
    return (
        f"{gains} To hold the pitch between two speeds (A2) instead of one (A0) changes pitch travel by "
        f"{percent(travel_change(runs, PHYSICAL, 'A2'))} at 15 MW; on the IEA 22 MW, where it is "
        f"{percent(cost[PITCH])}, the damage-equivalent load of the blade root changes by {percent(cost[ROOT_LOAD])} "
        f"and that of the tower base by {percent(cost[TOWER_LOAD])}. Ours against A2: a yaw control that knows of the "
        f"power to spare changes yaw travel by {percent(ours[TURNED])} and energy by {percent(ours[ENERGY], 1)}; with "
        f"A0 beside it instead of A2 the blade root's load changes by {percent(gentle[ROOT_LOAD])}, the tower base's "
        f"by {percent(gentle[TOWER_LOAD])}, pitch travel by {percent(gentle[PITCH])} and energy by "
        f"{percent(gentle[ENERGY], 1)}."
    )


def _readings(runs: PowerControlRuns) -> Table:
    dry = runs.temperature[PLAIN]
    won = dict(zip(dry.levels, mean_gains(dry), strict=True))
    return readings_table(readings(won, (mean_speed(runs, FORMULA, "A0"), mean_speed(runs, FORMULA, "A1"))))


def contents(found: Found, out: Path, draw: Draw) -> Contents:
    """Chapters, lead and facts of the page."""
    runs, table = found.runs, claims_table(found.claims)
    used = {claim.reason: REASONS[claim.reason] for claim in found.claims if claim.reason}
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
    chapters["bench"] = bench_chapter(found.bench, draw)
    return Contents(
        lead=f"{count_held(found.claims)} {guarded_text(partial(_lead, runs, found.bench), 'The rest')}",
        chapters=chapters | {name: _part(name).chapter(part, draw) for name, part in found.parts.items()},
        facts=[
            ("turbine", "pmsg20mw: PMSG of 20 MW, radius 138 m"),
            ("seeds", ", ".join(str(seed) for seed in runs.setup.seeds)),
        ],
        shown=[brief(table)],
    )


def of_turbine(turbine: Turbine) -> Study[Mapping[str, Any]]:
    """The schemes, the coordination and the climates on another turbine."""

    def run_parts(*, quick: bool, workers: int | None, progress: Progress, **_: Any) -> dict[str, Any]:
        return {
            name: attempt(
                name,
                _part(name).study,
                quick,
                turbine=turbine,
                workers=workers,
                progress=span(progress, i / len(beyond.PARTS), 1.0 / len(beyond.PARTS)),
            )
            for i, name in enumerate(beyond.PARTS)
        }

    def contents_of(found: Mapping[str, Any], out: Path, draw: Draw) -> Contents:
        chapters = {name: _part(name).chapter(part, draw, applied=True) for name, part in found.items()}
        lead = guarded_text(lambda: _said_of(efficient(found["power"].front, (TRAVEL, TOWER))), "Limited power")
        year = guarded_table("A year", lambda: energy_table(found["climate"]))
        return Contents(lead, chapters, [("turbine", turbine.name)], [year])

    words = "Limited power, coordination and climates of Palanimuthu et al. (2022)"
    return applied(STUDY, turbine, words, run=run_parts, contents=contents_of, runs=lambda found: found, parts_need={})


def _said_of(names: Sequence[str]) -> str:
    return f"Not beaten in pitch travel and load of the tower base at 75 % of rated power: {'; '.join(names)}."


STUDY: Study[Found] = Study(
    name="palanimuthu2022",
    title="Palanimuthu et al. (2022): a 20 MW turbine in its climate and on the grid, reproduced",
    source="Palanimuthu, K., Mayilsamy, G., Basheer, A. A., Lee, S.-R., Song, D., Joo, Y. H. (2022): A review of "
    "recent aerodynamic power extraction challenges in coordinated pitch, yaw, and torque control of large-scale wind "
    "turbine systems. Energies 15(21), 8161.",
    run=run,
    runs=lambda found: found.runs,
    figures=FIGURES,
    contents=contents,
    parts=beyond.PARTS,
    applied=of_turbine,
    parts_need=dict.fromkeys((RAIN, "loads on an aeroelastic turbine"), packages_of(BLADES_IN_RAIN)),
)
