"""``meltemi rao``: operators and the fit of the radiation, as files and in words."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import Command


@pytest.mark.long
def test_operators_and_the_fit_of_the_radiation_are_written(command: Command, tmp_path: Path) -> None:
    told = command("rao", "nrel5mw-spar", "--duration", 0, "--out", tmp_path)
    assert told.status == 0
    assert "oscillations, error" in told.out and "negative damping" in told.out
    assert [path.name for path in told.files] == ["rao_linear.csv", "rao.png", "radiation.png"]
    assert all(path.stat().st_size > 1_000 for path in told.files)
