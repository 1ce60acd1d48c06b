"""The parts of the reproduction that need no simulation: claims from formulas, errors of the paper, diagrams."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from meltemi import InputError
from meltemi.app.cli import app
from meltemi.report.block_diagram import Block, Wire, plot_blocks
from meltemi.report.html import Table
from meltemi.studies.reproduce.palanimuthu2022 import diagrams, paper
from meltemi.studies.reproduce.palanimuthu2022.claims import REASONS, counted_pressure, formula_claims
from meltemi.studies.reproduce.palanimuthu2022.figures.rain_power import STORM
from meltemi.studies.reproduce.palanimuthu2022.machine import FORMULA, rotor
from meltemi.studies.reproduce.palanimuthu2022.page import FIGURES, markdown
from meltemi.studies.reproduce.palanimuthu2022.readings import printed_density, readings, time_constant
from meltemi.studies.reproduce.palanimuthu2022.runs import INTERVAL, staircase

WRONG_IN_THE_PAPER = {"pairs", "over"}
"""Reasons of the lines that cannot hold: what the text says of its own, right numbers."""


def test_formulas_give_the_papers_numbers() -> None:
    found = formula_claims()
    assert {c.reason for c in found if c.verdict != "holds"} == WRONG_IN_THE_PAPER
    assert {c.reason for c in found if c.reason} <= set(REASONS)


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


def test_the_pressure_of_drops_of_one_size() -> None:
    volume = np.pi / 6.0 * 0.003**3 * 3314.0  # of the drops in a cubic metre, whose number the paper's formula gives
    assert counted_pressure(STORM) == pytest.approx(4.0 / 3.0 * 1000.0 * volume, rel=1e-3)


def test_steps_follow_a_lead_in() -> None:
    steps = staircase((40.0, 30.0), INTERVAL, 15.0)
    assert steps.time.tolist() == [0.0, 100.0, 100.0, 200.0, 200.0, 300.0]
    assert steps.value.tolist() == [15.0, 15.0, 40.0, 40.0, 30.0, 30.0]


def test_every_figure_of_the_paper_is_there() -> None:
    assert [int(name[3:5]) for name in FIGURES] == list(range(1, 22))


def test_wires_join_blocks() -> None:
    blocks = {"a": Block("a", (0.0, 0.0), (1.0, 0.5)), "b": Block("b", (3.0, 1.0), (1.0, 0.5))}
    figure = plot_blocks(blocks, [Wire("a.right", "b.bottom-0.25", "x", via=((2.75, 0.0),))])
    arrow = next(t for t in figure.axes[0].texts if getattr(t, "arrow_patch", None) is not None)
    assert arrow.xy == (2.75, 0.75)
    for wrong, said in (("c.left", "no block 'c'"), ("b.lift", "did you mean 'left'?")):
        with pytest.raises(InputError, match=re.escape(said)):
            plot_blocks(blocks, [Wire("a.right", wrong)])
    for draw in (diagrams.system, diagrams.climate, diagrams.coordination):
        draw()


def test_a_misspelt_study_is_refused_with_the_closest_name(tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["reproduce", "palanimutu2022", "--out", str(tmp_path / "out")])
    assert isinstance(found.exception, InputError)
    assert "did you mean 'palanimuthu2022'?" in str(found.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("study", "parts", "said"),
    [
        ("wang2021", "climate", "belongs to palanimuthu2022"),
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
    text = markdown("All holds.", {"claims": ("Claims", [table])}, {"fig01": "the system"}, tmp_path)
    assert "## A year" in text
    assert text.count(f"*pairs:* {REASONS['pairs']}") == 1
    assert "![the system](palanimuthu2022/fig01.png)" in text


@pytest.mark.long
def test_a_quick_look_writes_everything(tmp_path: Path) -> None:
    arguments = ["reproduce", "palanimuthu2022", "--quick", "--out", str(tmp_path)]
    found = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert found.exit_code == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert {f"{name}.png" for name in FIGURES} <= names
    assert {"palanimuthu2022.html", "palanimuthu2022.md", "claims.csv", "readings.csv", "schemes.csv"} <= names
