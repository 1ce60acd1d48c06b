"""Power references of the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from meltemi import InputError
from meltemi_tuning.power_reference import power_grid


def test_a_share_and_a_series_of_rated_power(tmp_path: Path) -> None:
    assert power_grid("0.75", 4e6).power_reference == pytest.approx(3e6)
    path = tmp_path / "steps.csv"
    path.write_text("time, share\n0, 1\n60, 0.5\n")
    series = power_grid(str(path), 4e6).power_reference
    assert series.time.tolist() == [0.0, 60.0] and series.value.tolist() == [4e6, 2e6]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("half", "--power 'half': expected a share of rated power, e.g. 0.75, or a CSV file of time,share"),
        ("75", "a power reference of 75: expected a share of rated power, 0 to 1"),
        ("none.csv", "none.csv: cannot be read"),
        ("head.csv", "head.csv: expected the columns time,share"),
        ("word.csv", "word.csv: expected two numbers in each row after time,share"),
        ("much.csv", "a power reference of 1.5: expected a share"),
    ],
)
def test_what_is_no_reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, said: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path("head.csv").write_text("t,p\n0,1\n")
    Path("word.csv").write_text("time,share\n0,x\n")
    Path("much.csv").write_text("time,share\n0,1.5\n")
    with pytest.raises(InputError, match=said):
        power_grid(text, 1e6)
