"""Power references of the command line."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi import InputError
from meltemi.simulation.channels import standard
from meltemi.simulation.result import Result
from meltemi.tuning.compare import WHOLE
from meltemi.tuning.comparison_report import series_figure
from meltemi.tuning.power_reference import power_grid


def test_a_share_and_a_series_of_rated_power(tmp_path: Path) -> None:
    assert power_grid("0.75", 4e6).power_reference == pytest.approx(3e6)
    path = tmp_path / "steps.csv"
    path.write_text("time, share\n0, 1\n60, 0.5\n")
    series = power_grid(str(path), 4e6).power_reference
    assert series.time.tolist() == [0.0, 60.0] and series.value.tolist() == [4e6, 2e6]  # type: ignore[union-attr]


def test_the_series_of_a_comparison_show_what_was_asked_for() -> None:
    time = np.linspace(0.0, 90.0, 91)
    asked = np.where(time < 60.0, 4e6, 2e6)
    names = ("wind_x", "generator_power", "power_reference")
    run = Result(time, np.stack([0.0 * time, 0.9 * asked, asked], axis=1), tuple(standard()[name] for name in names))
    comparison: Any = SimpleNamespace(windows={WHOLE: (30.0, 90.0)}, schemes=("A0",), results=lambda scheme: run)
    power = series_figure(comparison).axes[1]
    assert power.get_ylabel() == "[kW]"
    (line,) = (line for line in power.get_lines() if line.get_label() == "power reference")
    assert (line.get_ydata()[0], line.get_ydata()[-1]) == (4000.0, 2000.0)  # type: ignore[index]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("half", "--power 'half': expected a share of rated power, e.g. 0.75, or a CSV file of time,share"),
        ("75", "a power reference of 75: expected a share of rated power, 0 to 1"),
        ("none.csv", "none.csv: cannot be read"),
        ("head.csv", "head.csv: expected the columns time,share"),
        ("word.csv", "word.csv: expected two numbers in each row after time,share"),
        ("much.csv", "a power reference of 1.5: expected a share"),
        ("back.csv", "back.csv: time must not decrease, but entry 2 is 0 s"),
    ],
)
def test_what_is_no_reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, said: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path("head.csv").write_text("t,p\n0,1\n")
    Path("word.csv").write_text("time,share\n0,x\n")
    Path("much.csv").write_text("time,share\n0,1.5\n")
    Path("back.csv").write_text("time,share\n9,1\n0,1\n")
    with pytest.raises(InputError, match=said):
        power_grid(text, 1e6)
