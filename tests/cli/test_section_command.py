"""``meltemi section``: tables and figures of a layup, both models, refused input."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from terminal import Command

LAYUP = """
name: box
position: {grid: [0, 1], values: [0, 10]}
chord: 1.0
offset_y: 0.5
thickness: 0.3
shapes: [{thickness: 0.3, coordinates: [[1, 0], [1, 0.15], [0, 0.15], [0, -0.15], [1, -0.15], [1, 0]]}]
materials:
  metal: {density: 2700, E1: 7e10, E2: 7e10, E3: 7e10, G12: 2.7e10, G13: 2.7e10, G23: 2.7e10,
    nu12: 0.3, nu13: 0.3, nu23: 0.3}
layers: [{name: wall, material: metal, thickness: {grid: [0, 1], values: [0.02, 0.01]}}]
"""


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_tables_and_figures(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "box.yaml"
    file.write_text(LAYUP, encoding="utf-8")
    told = command("section", file, "--at", "0,1", "--pieces", 40, "--out", tmp_path / "out")
    assert told.status == 0, told.err
    assert "finite elements" in told.out and "difference" in told.out
    names = ["box-0.png", "box-1.png", "box-sections.csv", "box-matrices.csv", "box-masses.csv"]
    assert [path.name for path in told.files] == names
    table = rows(told.files[2])
    assert [row["model"] for row in table] == 2 * ["thin walls", "finite elements"]
    mass = [2700.0 * (0.3 - (1.0 - 2.0 * t) * (0.3 - 2.0 * t)) for t in (0.02, 0.01)]
    assert [float(row["mass [kg/m]"]) for row in table] == pytest.approx([mass[0]] * 2 + [mass[1]] * 2, rel=0.02)
    matrix = [row for row in rows(told.files[3]) if row["station"] == "0" and row["matrix"] == "stiffness"]
    assert float(matrix[2]["3"]) == pytest.approx(7e10 * mass[0] / 2700.0, rel=0.02)
    assert float(rows(told.files[4])[0]["mass [kg/m]"]) == pytest.approx(mass[0], rel=0.02)


@pytest.mark.parametrize(
    ("old", "new", "at", "words"),
    [
        ("material: metal, t", "material: metall, t", "0.5", "layer wall: no material 'metall': did you mean 'metal'"),
        ("E1: 7e10", "E1: -7e10", "0.5", "materials.metal.E1"),
        ("chord: 1.0", "chord: 1.0", "1.5", "--at 1.5: expected fractions of the span from 0 to 1"),
        ("name: box", "naem: box", "0.5", "naem"),
        ("0.02, 0.01", "0.2, 0.2", "0.5", "too thick"),
    ],
)
def test_refused(old: str, new: str, at: str, words: str, command: Command, tmp_path: Path) -> None:
    file = tmp_path / "box.yaml"
    file.write_text(LAYUP.replace(old, new), encoding="utf-8")
    told = command("section", file, "--at", at, "--model", "elements", "--out", tmp_path / "out")
    assert told.status != 0
    assert words in told.err
    assert "Traceback" not in told.err
    assert not list(tmp_path.glob("out/*"))
