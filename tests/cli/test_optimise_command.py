"""``meltemi optimise``: messages before any run, and a whole search with resumption."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from ruamel.yaml import YAML

from meltemi import InputError, load_turbine
from meltemi.analysis import optimise
from meltemi.core.yamlfile import read_record, validated
from meltemi.designs.commands import optimise as command
from meltemi.designs.design import Teller, _Study, read_design
from meltemi.designs.settings import Design

ROOT = Path(__file__).parents[2]

KEYS: dict[str, Any] = {
    "turbine": "nrel5mw",
    "variables": {"controller.proportional_gain": {"low": 0.3, "high": 3.0, "relative": True}},
    "objective": {"std rotor_speed": 0.7, "travel pitch_1": 0.3},
    "constraints": {"energy": {"least": 0.99}},
    "case": {"duration": 12.0, "transient": 4.0, "wind": {"intensity": 0.14, "points": 9}},
    "cases": [{"speed": 18.0, "seeds": [3]}],
    "proof": {"seeds": [5, 6]},
    "iterations": 4,
}


def written(tmp_path: Path, **changes: Any) -> Path:
    file = tmp_path / "design.yaml"
    YAML(typ="safe", pure=True).dump(KEYS | changes, file)
    return file


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"turbine": "nrel5w"}, "no turbine 'nrel5w'"),
        ({"variables": {"controller.gain": {"low": 1, "high": 2}}}, "design.yaml: variables: the controller has no"),
        ({"objective": {"dell x": 1.0}}, "design.yaml: terms: 'dell x' begins with no kind of term"),
        ({"case": {"duration": -1.0}}, "cases 1: duration"),
        ({"proof": {"seed": [1]}}, "did you mean 'seeds'"),
        ({"proof": {"seeds": [3, 4]}}, "the optimiser sees 18 m/s, seed 3: choose other seeds"),
        ({"proof": {"cases": [{"speed": -3.0}]}}, "speed"),
    ],
)
def test_messages_before_any_run(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        optimise(written(tmp_path, **changes), out=tmp_path)
    assert not (tmp_path / "history.jsonl").exists()


def test_the_design_of_the_page_is_that_of_the_examples() -> None:
    page = (ROOT / "docs/guide/designs.md").read_text()
    block = page.partition('```yaml title="design.yaml"\n')[2].partition("```")[0]
    example = read_record(ROOT / "examples/design.yaml", Design)
    assert validated(YAML(typ="safe").load(block), Design, "page") == example


@pytest.mark.parametrize("file", sorted((ROOT / "examples").glob("design*.yaml")), ids=lambda file: file.stem)
def test_the_designs_of_the_examples_are_valid(file: Path) -> None:
    """Variables, terms, cases and the unseen ones, up to the first run."""
    content = read_design(file)
    study = _Study(content, file.parent, None, False, 1, Teller())
    start = study.variables
    assert np.all((start.low <= start.start) & (start.start <= start.high))
    assert len(start.each) >= len(content.variables)
    assert {term.name for term in study.terms} == {*content.objective, *content.constraints}
    assert len(study.unseen) > 3


@pytest.mark.long
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only")
def test_a_search_its_files_and_its_resumption(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, out = written(tmp_path), tmp_path / "out"
    out.mkdir()
    command(file, out=out, workers=1)
    text = capsys.readouterr()
    assert "iteration 1: objective" in text.err and "gradient in 18 m/s, seed 3" in text.err
    names = {path.name for path in out.iterdir()}
    assert names == {"designed.yaml", "design.html", "design.json", "comparison.csv", "variables.csv", "progress.png",
                     "history.jsonl"}  # fmt: skip
    designed, result = load_turbine(out / "designed.yaml"), json.loads((out / "design.json").read_text())
    gain = load_turbine("nrel5mw").control.pitch.proportional_gain
    assert designed.control.pitch.proportional_gain == pytest.approx(
        result["variables"]["controller.proportional_gain"] * gain
    )
    assert result["objective"] < 1.0
    with (out / "comparison.csv").open() as table:
        for row in csv.DictReader(table):  # one definition of start, end and change
            change = 100.0 * (float(row["end"]) / float(row["start"]) - 1.0)
            assert float(row["change [%]"]) == pytest.approx(change, abs=0.05)
    with pytest.raises(InputError, match="add --resume to continue it"):
        command(file, out=out, workers=1)
    history = (out / "history.jsonl").read_text().splitlines()
    (out / "history.jsonl").write_text("\n".join(history[: len(history) // 2]))
    command(file, out=out, workers=1, resume=True)
    assert json.loads((out / "design.json").read_text())["variables"] == result["variables"]
    monkeypatch.chdir(tmp_path)
    code = (ROOT / "docs/guide/designs.md").read_text().partition("```python\n")[2].partition("```")[0]
    exec(compile(code, "designs.md", "exec"), {})
    assert "controller.proportional_gain" in capsys.readouterr().out


@pytest.mark.long
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only")
@pytest.mark.parametrize("path", ["controller.proportional_gain", "turbine.tower.mass", "turbine.blade.chord"])
def test_absurd_bounds_are_told_with_the_variable(path: str, tmp_path: Path) -> None:
    path = path.replace("blade.chord", "blade.aerodynamics.chord")
    wide = {"low": -1e12, "high": 1e12} | ({"relative": True} if path.startswith("controller") else {})
    file = written(tmp_path, variables={path: wide}, constraints={})
    with pytest.raises(InputError, match=f"variables: '{path}': neighbours of the start cannot be evaluated .*bounds"):
        optimise(file, workers=1)


@pytest.mark.long
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only")
def test_a_term_that_is_zero_in_the_middle_case_and_stops_that_are_told(tmp_path: Path) -> None:
    """At 5 m/s the pitch rests; the supervisor's stop is an event of which the gradient knows nothing."""
    stop = {"controller": "supervised", "events": [{"type": "request", "request": "emergency_stop", "at": 8.0}]}
    cases = [{"speed": 18.0, "seeds": [3]}, {"speed": 5.0, "seeds": [3]}, {"speed": 12.0, "seeds": [3], "other": stop}]
    told: list[str] = []
    file = written(tmp_path, objective={"rate pitch_1": 1.0}, cases=cases, constraints={}, iterations=1)
    found = optimise(file, workers=1, unchecked=True, teller=Teller(line=told.append))
    assert found.check is not None and found.check.case == "5 m/s, seed 3"
    (words,) = [line for line in told if line.startswith("changes of the supervisor's state")]
    assert "in 1 of 3 runs" in words and "12 m/s, seed 3" in words
