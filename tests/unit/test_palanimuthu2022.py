"""The parts of the reproduction that need no simulation: claims from formulas, errors of the paper."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from meltemi import InputError
from meltemi.analyses.performance import performance_of
from meltemi.app.cli import app
from meltemi.papers.claim import reason_lines
from meltemi.papers.palanimuthu2022 import page, paper
from meltemi.papers.palanimuthu2022.beyond import climate, coordination, machines, power
from meltemi.papers.palanimuthu2022.claims import REASONS, formula_claims
from meltemi.papers.palanimuthu2022.figure6 import (
    closed_gains,
    gain_claims,
    humidity_of_ratio,
    kinetic_gains,
    mean_gains,
    settled_pair,
)
from meltemi.papers.palanimuthu2022.figures.look import label
from meltemi.papers.palanimuthu2022.machine import BLADES, CURVES, FORMULA, rotor
from meltemi.papers.palanimuthu2022.page import FIGURES
from meltemi.papers.palanimuthu2022.readings import printed_density, readings, time_constant
from meltemi.papers.palanimuthu2022.run_claims import bench_claims, limiting, range_of_speed, schemes_table
from meltemi.papers.palanimuthu2022.runs import (
    INTERVAL,
    PLAIN,
    SMALL,
    TURBULENT,
    PowerControlRuns,
    PowerControlSetup,
    Reading,
    Steps,
    staircase,
)
from meltemi.papers.verdict import UNCHECKED
from meltemi.postprocess.ensemble import EnsembleTable, ensemble_table
from meltemi.power_control.rotor import rotor_tables
from meltemi.report.plots import new_figure
from meltemi.reports.blocks import Picture, Section, Table
from meltemi.reports.markdown import alone, documented
from meltemi.simulation.channels import standard
from meltemi.simulation.result import Result
from meltemi.studies.power_schemes import coordination as schemes
from meltemi.studies.power_schemes import costs
from meltemi.tuning.run_store import FailedResult
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

DIFFER = {"moist", "pairs", "warm", "most", "rating"}
"""Reasons of the lines that differ: contradictions in the paper, and what depends on a coefficient it does not give."""


def test_formulas_give_the_papers_numbers() -> None:
    found = formula_claims()
    assert {c.reason for c in found if c.outcome not in ("held", "unchecked")} == DIFFER
    assert {c.reason for c in found if c.reason} <= set(REASONS)
    assert {c.basis for c in found} == {"paper"}


def recorded(time: np.ndarray, **columns: np.ndarray) -> Result:
    """A run with these channels."""
    data = np.stack([np.broadcast_to(c, time.shape) for c in columns.values()], axis=1).astype(float)
    return Result(time, data, tuple(standard()[name] for name in columns))


@pytest.mark.parametrize(
    ("curve", "humidity", "won"), [("M1", 0.0, (40.9, 53.4)), ("M1", 0.4, (52.1, 52.9)), ("M2", 0.1, (58.2, 71.3))]
)
def test_settled_gains_of_figure_6(curve: str, humidity: float, won: tuple[float, float]) -> None:
    steps = Steps(curve, humidity, SMALL, {}, (40.0, -10.0), 0.0)
    assert closed_gains(steps) == pytest.approx(1e3 * np.array(won), abs=100.0)


@pytest.mark.parametrize("curve", [*CURVES, "M2"])
def test_every_curve_has_the_papers_best_point(curve: str) -> None:
    assert rotor(curve).best() == pytest.approx((9.5085, 0.48), abs=1e-5)


def test_the_ratio_of_the_gains_tells_the_inertia() -> None:
    """Of readings that are not fitted, dry and moist: the light rotor has the paper's ratio, the heavy one has not."""
    won = {PLAIN: (40.9e3, 44.2e3), Reading("Heier"): (45.4e3, 48.7e3)}
    won |= {Reading("M1", 0.0, SMALL): (40.9e3, 53.7e3), Reading("M1", 0.4, SMALL): (52.2e3, 53.2e3)}
    won |= {Reading("M2", 0.1, SMALL): (58.2e3, 71.3e3), PLAIN._replace(converters=True): (1.0, 9.0)}
    hot, cold, ratio = gain_claims({reading: np.array(gains) for reading, gains in won.items()})
    assert {hot.verdict, cold.verdict} == {UNCHECKED + "power coefficient and humidity are not given"}
    assert (
        cold.ours
        == "44.2 to 48.7 kW with 2.93e+09 kg m² (2 readings); 53.2 to 53.7 kW with 4.872e+06 kg m² (2 readings)"
    )
    assert (ratio.verdict, ratio.paper) == ("differs (2.93e+09 kg m²) / holds (4.872e+06 kg m²)", "1.225")
    assert "1.081 at most with 2.93e+09 kg m²" in ratio.ours and "1.225 at 10 % (M1) to 10 % (M1)" in ratio.ours
    light = {reading: np.array(gains) for reading, gains in won.items() if reading != PLAIN}
    light[Reading("Heier")] = np.array([45e3, 56e3])
    assert gain_claims(light)[2].verdict == "holds"


def test_equal_gains_times_the_printed_density_are_the_papers_pair_too() -> None:
    """With Heier's constants and the humidity of Figure 3, fitted to nothing."""
    gains = settled_pair("Heier", 0.4)
    assert gains == pytest.approx([57.9e3, 58.1e3], abs=60.0)
    assert [gains[0], 1.225 * gains[1]] == pytest.approx([paper.GAINS[40.0], paper.GAINS[-10.0]], rel=6e-3)
    assert humidity_of_ratio("M2") == pytest.approx(0.1, abs=1e-3)


def test_a_rotor_that_slows_down_gives_its_energy_to_the_generator() -> None:
    time = np.linspace(0.0, 200.0, 801)
    slowing = np.interp(time, [0.0, 100.0, 200.0], [0.69, 0.69, 0.67])
    given = np.where(time > 100.0, 0.5 * 2e9 * (0.69**2 - 0.67**2) / 100.0, 0.0)
    results = {
        "i": recorded(time, rotor_speed=slowing, generator_power=1e7 + given),
        "ii": recorded(time, rotor_speed=np.array(0.69), generator_power=np.array(1e7)),
    }
    steps = Steps("M1", 0.0, 2e9, results, (40.0,), 100.0)
    assert kinetic_gains(steps) == pytest.approx(-272e3, rel=1e-3)
    assert mean_gains(steps, "generator_power") == pytest.approx(kinetic_gains(steps), rel=1e-9)


@pytest.mark.parametrize(("highest", "verdict"), [(0.754, "holds"), (0.76, "holds"), (0.7, "differs")])
def test_speeds_count_while_the_controller_limits_by_its_own_state(highest: float, verdict: str) -> None:
    time = np.linspace(0.0, 1.0, 5)
    state, speed = np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.array([0.5, 0.68, highest, 0.74, 0.69])
    run = recorded(time, power_state=state, rotor_speed=speed, generator_power=np.array(15e6), wind_x=np.array(11.0))
    assert limiting(run).tolist() == [False, True, True, True, True]
    found = range_of_speed(run, run)
    assert (found.verdict, found.reason) == (verdict, "overshoot") and found.tolerance.startswith("qualitative")


def test_every_ruling_stands_with_both_readings() -> None:
    found = readings(dict.fromkeys(paper.TEMPERATURES, 1.0), (0.65, 0.7))
    assert [r.key for r in found] == [f"E-E{i}" for i in range(1, 25)]
    assert all(r.theirs != r.ours for r in found)
    assert "16.1 MW" in found[6].theirs and "16.1 kW" in found[6].ours


@pytest.mark.parametrize(
    ("zero", "humidity", "expected"),
    [
        (273.15, 0.4, (1.3408, 1.0340, 1.1359, 0.9081)),  # printed
        (273.5, 0.4, (1.3390, 1.0327, 1.1346, 0.9070)),
        (273.15, 0.2, (1.3411, 1.0343, 1.1407, 0.9129)),
    ],
)
def test_readings_of_the_density(zero: float, humidity: float, expected: tuple[float, ...]) -> None:
    found = [printed_density(t, humidity, h, zero) for t, h in paper.DENSITIES]
    assert np.round(found, 4) == pytest.approx(expected, abs=1e-9)


def test_readings_of_the_inertia() -> None:
    assert [time_constant(j) for j in (2.93e9, 4.872e9, 4.872e6)] == pytest.approx([26.0, 44.0, 0.044], rel=0.02)


def test_the_law_of_another_density_settles_beside_the_best_point() -> None:
    made = rotor(FORMULA)
    assert made.settled(1.225, 1.225) == pytest.approx(9.5085, abs=1e-3)
    assert made.settled(1.225, 1.3) > 9.5085 > made.settled(1.225, 1.15)
    assert made.settled_power(10.0, 1.225, 1.3) < made.settled_power(10.0, 1.3, 1.3)


def test_steps_follow_a_lead_in() -> None:
    steps = staircase((40.0, 30.0), INTERVAL, 15.0)
    assert steps.time.tolist() == [0.0, 100.0, 100.0, 200.0, 200.0, 300.0]
    assert steps.value.tolist() == [15.0, 15.0, 40.0, 40.0, 30.0, 30.0]


def test_a_part_on_another_turbine_is_without_the_verdict_on_the_reviews() -> None:
    lost: Any = FailedResult("climate: it diverged")
    for part in (machines, power, coordination, climate):
        own, applied = (part.chapter(lost, lambda name, words, of: words, applied=a) for a in (0, 1))
        assert own.heading == f"Beyond the paper: {applied.heading[0].lower()}{applied.heading[1:]}"
        assert len(applied.content) == len(own.content) - 1 and "cannot be judged" in str(own.content[0])


def test_every_figure_of_the_paper_with_numbers_is_there() -> None:
    assert [int(name[3:5]) for name in FIGURES] == [k for k in range(2, 22) if k not in (15, 16)]  # drawings


def test_a_misspelt_study_is_refused_with_the_closest_name(tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["reproduce", "palanimutu2022", "--out", str(tmp_path / "out")])
    assert isinstance(found.exception, InputError)
    assert "did you mean 'palanimuthu2022'?" in str(found.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("study", "parts", "said"),
    [
        ("he2018", "climate", "is an option of palanimuthu2022 and wang2021"),
        ("palanimuthu2022", "climat", "did you mean 'climate'?"),
    ],
)
def test_parts_beyond_the_paper_have_names(study: str, parts: str, said: str, tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["reproduce", study, "--beyond", parts, "--out", str(tmp_path / "out")])
    assert isinstance(found.exception, InputError)
    assert said in str(found.exception)
    assert not (tmp_path / "out").exists()


def test_the_page_has_the_parts_that_lie_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "climate.md").write_text("## A year\n", encoding="utf-8")
    table = Table(["claim", "reason"], [["one", "pairs"], ["two", ""]])
    claims = Section("Claims", [table, *reason_lines({"pairs": REASONS["pairs"]})])
    figures = Section("Figures", [Picture(Path("fig01.png"), "the system")])
    text = page.STUDY.markdown("All holds.", {"claims": claims, "climate": Section("Twice", [])}, [figures], tmp_path)
    assert "## A year" in text and "## Twice" not in text
    assert text.count(f"*pairs:* {REASONS['pairs']}") == 1
    assert "![the system](fig01.png)" in text


def test_a_page_lies_among_its_pictures_or_in_the_documentation() -> None:
    text = "![rain, [mm]](fig09_rain.png) of [air and *rain*](../guide/air.md#r), [own](#above), [far](https://a.b/c)"
    assert alone(text) == "![rain, [mm]](fig09_rain.png) of air and *rain*, [own](#above), [far](https://a.b/c)"
    text = "![rain, [mm]](fig09_rain.png) of [air](../guide/air.md)"
    assert documented(text, "he2018") == "![rain, [mm]](he2018/fig09_rain.png) of [air](../guide/air.md)"


@pytest.mark.parametrize("study", ["he2018", "wang2021", "palanimuthu2022"])
def test_no_page_leads_out_of_its_folder(study: str) -> None:
    folder = Path(page.__file__).parents[1] / study
    written = "".join(alone(path.read_text(encoding="utf-8")) for path in folder.glob("*.md"))
    assert "](../" not in written and f"]({study}/" not in written


def coordination_of(level: float) -> schemes.Tables:
    """Three seeds in which only the pitch of each blade travels far, and all but the base win two percent."""

    def values(name: str, seed: int) -> dict[str, float]:
        far = {"each for itself": 1.0, "all three, individual pitch": 3.0}.get(name, 0.5)
        quantities = dict.fromkeys(schemes.UNITS, 1.0 + 0.01 * seed)
        energy = 1.0 if name == "each for itself" else 1.02
        return quantities | {schemes.PITCH: far, schemes.ENERGY: energy + 1e-4 * seed}

    by_seed = {seed: {name: values(name, seed) for name in schemes.CANDIDATES} for seed in (1, 2, 3)}
    return {level: ensemble_table(by_seed, schemes.SLOPES)}


def test_energy_has_a_scale_of_its_own() -> None:
    figure = schemes.coordination_figure(coordination_of(0.6))
    energy, others = figure.axes
    assert energy.get_ylim()[1] < 3.0 < 100.0 < others.get_ylim()[1]
    assert [len(ax.patches) for ax in (energy, others)] == [6, 30]


def test_loads_and_actuation_are_judged_by_intervals() -> None:
    def of(names: tuple[str, ...], seeds: tuple[int, ...] = (1, 2, 3, 4)) -> EnsembleTable:
        row = dict.fromkeys(schemes.UNITS, 1.0)
        spared = row | {schemes.PITCH: 0.5, schemes.TURNED: 0.4, schemes.TOWER_LOAD: 1.3}
        spared |= {schemes.PITCH_STARTS: 0.8, schemes.SWING: 0.9}
        return ensemble_table(
            {
                seed: {
                    n: {q: x + 1e-3 * seed * (n != names[0]) for q, x in (spared if n != names[0] else row).items()}
                    for n in names
                }
                for seed in seeds
            },
            schemes.SLOPES,
        )

    ours = (schemes.PROPOSAL, *schemes.OURS)
    found = bench_claims(schemes.ProposalComparison(of((schemes.CONVENTIONAL, *ours)), of(ours)))
    assert [c.verdict for c in found] == [
        "holds (of the pitch servo) / differs (of tower and blades)",
        "holds",
        "differs",  # the tower
    ]
    assert "pitch travel -50 ± 0 %" in found[0].ours and "tower base fore-aft DEL +30" in found[0].ours
    few = schemes.ProposalComparison(of((schemes.CONVENTIONAL, *ours), (1, 2)), of(ours, (1, 2)))
    assert {c.verdict for c in bench_claims(few)} == {"cannot be judged: it needs 4 seeds, there are 2"}


def test_changes_say_against_what() -> None:
    for level, slow in ((0.6, False), (1.0, True)):
        words = coordination.verdict(coordination_of(level))
        assert (
            "3.0 times as far as the pitch of *each for itself*, and 6.0 times as far as that of *all three*" in words
        )
        assert ("the usual controller at full power is A1" in words) == slow


def test_what_turns_backwards_is_no_result() -> None:
    time = np.linspace(0.0, 100.0, 201)
    found = {}
    for scheme, lowest in (("A0", 0.5), ("A1", 0.5), ("A2", 0.5), ("A3", -0.5)):
        speed = np.where(time > 80.0, lowest, 0.7)
        same = {"generator_power": np.array(15e6), "wind_x": np.array(11.0), "pitch_1": 0.001 * time}
        found[BLADES, SMALL, f"{TURBULENT} 1", scheme] = recorded(time, rotor_speed=speed, **same)
    none = Steps("M1", 0.0, SMALL, {}, (), 0.0)
    table = schemes_table(PowerControlRuns(PowerControlSetup(seeds=(1,), inertias=(SMALL,)), {}, none, {}, found))
    assert [row[1] for row in table.rows] == ["A0", "A1", "A2", "A3: no result, turns backwards"]


def test_labels_of_axes_have_one_size() -> None:
    _, axes = new_figure(1, size=(3.0, 2.0))
    label(axes[0, 0], "x", "y")
    sizes = [axes[0, 0].yaxis.get_tick_params(which=which)["labelsize"] for which in ("major", "minor")]
    assert sizes == [8, 8]  # Figure 9 has less than a decade in its middle panel, where minor ticks have labels


def test_what_no_other_beats_is_efficient() -> None:
    rows = {"A0": (4.0, 1.0, 1.0), "A1": (1.0, 2.0, 1.2), "A2": (2.0, 1.5, 1.1), "bad": (3.0, 1.6, 1.05)}

    def of(seed: int) -> dict[str, dict[str, float]]:
        keys = (costs.PITCH, costs.TOWER_LOAD, costs.ENERGY)
        return {s: dict(zip(keys, (x + 0.01 * seed for x in v), strict=True)) for s, v in rows.items()}

    table = ensemble_table({seed: of(seed) for seed in (1, 2)}, {costs.TOWER_LOAD: 4.0})
    assert costs.efficient(table, (costs.PITCH, costs.TOWER_LOAD)) == ["A0", "A1", "A2"]
    assert costs.efficient(table, (costs.ENERGY, costs.PITCH)) == ["A1"]


@pytest.mark.long
def test_the_base_of_the_schemes_at_full_power_is_slow() -> None:
    turbine = aeroelastic(load_turbine(power.TURBINE), "loads in turbulence")
    best, c = rotor_tables(performance_of(turbine), turbine.control.pitch.minimum).best
    gain = 0.5 * 1.225 * np.pi * turbine.rotor_radius**5 * c / best**3
    met = (turbine.rated_power / turbine.drivetrain.generator_efficiency / gain) ** (1.0 / 3.0)
    rated = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio
    assert met / rated == pytest.approx(power.BASE_SPEED, abs=5e-4)


@pytest.mark.long
def test_a_quick_look_writes_everything(tmp_path: Path) -> None:
    arguments = ["reproduce", "palanimuthu2022", "--quick", "--out", str(tmp_path)]
    found = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert found.exit_code == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert {f"{name}.png" for name in FIGURES} <= names
    text = (tmp_path / "palanimuthu2022.md").read_text(encoding="utf-8")
    assert all((tmp_path / link).is_file() for link in re.findall(r"\]\(([^)#]+)\)", text))
    assert "nan" not in re.findall(r"[a-z]+", text.lower())
    assert {"palanimuthu2022.html", "palanimuthu2022.md", "claims.csv", "readings.csv", "schemes.csv"} <= names
