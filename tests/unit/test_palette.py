"""Colours that are told apart by readers of all kinds of sight, and no others anywhere."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from meltemi.papers.wang2021.beyond import heat_map
from meltemi.report.palette import COLOURS, INK, ON_DARK, curve
from meltemi.report.plots import new_figure

ROOT = Path(__file__).parents[2]
SIGHT = {
    "full": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
}
"""Machado, Oliveira, Fernandes (2009), table 1, severity 1, on linear RGB."""
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def lab(colour: str, sight: str) -> np.ndarray:
    """CIELAB of what an eye sees, white being sRGB's."""
    rgb = np.asarray(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    x = XYZ @ np.clip(np.asarray(SIGHT[sight]) @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    f = np.where(x > 216 / 24389, np.cbrt(x), (24389 / 27 * x + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize(("colours", "least"), [(COLOURS[:7], 20.0), (COLOURS, 15.0)])
def test_colours_differ(colours: tuple[str, ...], least: float, sight: str) -> None:
    """Red #d1495b and green #66a182 were 82 apart for full sight and 18 for the green-blind; the closest of ten, 5."""
    seen = [lab(c, sight) for c in colours]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > least
    assert all(lab(c, sight)[0] < 80.0 for c in colours), "too light on white"


def test_many_curves_look_different() -> None:
    """Colours and markers of ten each made the 1st and the 11th alike."""
    looks = {tuple(curve(j).values())[:2] for j in range(110)}
    assert len(looks) == 110


@pytest.mark.parametrize("sight", SIGHT)
def test_colours_differ_on_a_dark_page(sight: str) -> None:
    seen = [lab(c, sight) for c in ON_DARK]
    assert len(ON_DARK) == len(COLOURS)
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 13.0
    assert all(lab(c, sight)[0] > 50.0 for c in ON_DARK), "too dark on black"


def test_no_colour_stands_elsewhere() -> None:
    """Figures take their colours from the palette; cards in notebooks have some for light and dark ground."""
    files = [*(ROOT / "src").rglob("*.py"), *(ROOT / "tools").glob("*.py")]
    found = [f.name for f in files if re.search(r"#[0-9a-fA-F]{6}\b", f.read_text(encoding="utf-8"))]
    assert sorted(found) == ["palette.py", "representation.py"]


def test_numbers_on_dark_fields_are_white() -> None:
    """Numbers of a map are read on its darkest red and blue, too."""
    ax = new_figure(1, size=(3.0, 2.0))[1][0, 0]
    heat_map(ax, np.arange(3.0), np.zeros(1), np.array([[-60.0, 0.0, 60.0]]), "a", text="+.0f", low=-60.0, high=60.0)
    assert [words.get_color() for words in ax.texts] == ["white", INK, "white"]
