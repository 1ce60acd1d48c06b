"""The induction model of docs/development/induction.md: the page prints what it says, and that is the closed form."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from programs import run, write_programs

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "development" / "induction.md").read_text(encoding="utf-8")
STEPS = """
from wing import case
from meltemi.simulation.step import begin_parts_step

def drag():
    for _ in range(8):  # iterations of the circulation
        case.evaluate(0.0)
    return float(case.view("rotor")["thrust"])

along, steady = case["wake"].copy(), drag()
turned = case["wake"][...] = [0.8, 0.0, 0.6]
other = drag()
assert abs(other / steady - 1.0) > 0.05, (other, steady)
for _ in range(4):
    begin_parts_step(0.1, case.system)
    assert (case["wake"] == turned).all()
begin_parts_step(0.1, case.system)  # the fifth completes the half second of the model
assert (case["wake"] == along).all()
assert abs(drag() / steady - 1.0) < 1e-4
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """The package of the page, as pip would leave it there."""
    write_programs(PAGE, tmp_path)
    (entry,) = re.findall(r"^```toml\n\[project\.entry-points\.\"(.*?)\"\]\n(.*?) = \"(.*?)\"\n```", PAGE, re.MULTILINE)
    info = tmp_path / "lifting_line-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lifting_line\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[{}]\n{} = {}\n".format(*entry), encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_an_elliptic_wing_has_lift_drag_and_downwash_of_the_closed_form(files: Path) -> None:
    (printed,) = re.findall(r'^```text title="printed"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
    assert run(files, "wing.py", NUMBA_DISABLE_JIT="1") == printed
    lift, exact_lift, drag, exact_drag, least, most = (float(x) for x in re.findall(r"\d\.\d+", printed))
    assert lift == pytest.approx(exact_lift, rel=0.01)
    assert drag == pytest.approx(exact_drag, rel=0.02)
    assert 0.97 < least < most < 1.03


@pytest.mark.slow
def test_the_wake_turns_at_its_own_steps_and_the_loads_follow(files: Path) -> None:
    run(files, "-c", STEPS, NUMBA_DISABLE_JIT="1")
