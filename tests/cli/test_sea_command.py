"""``meltemi sea``, and seas on the command line of ``meltemi run``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from terminal import Command

from meltemi.core.csvfile import read_columns


def test_a_sea_is_written_with_table_and_figure(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "out"
    ran = command("sea", "4,10", "--duration", 200, "--depth", 40, "--out", out)
    assert ran.status == 0, ran.err
    assert "JONSWAP sea 4 m, 10 s, seed 1" in ran.out and "significant wave height" in ran.out
    assert {path.name for path in out.iterdir()} == {"sea.csv", "statistics.csv", "sea.png"}
    heads, data = read_columns(out / "sea.csv")
    assert heads[:3] == [("time", "s"), ("elevation", "m"), ("u at 0 m", "m/s")]
    assert 4.0 * np.std(data[:, 1]) == pytest.approx(4.0, rel=0.3)


def test_a_sea_may_be_a_file_or_regular(command: Command, tmp_path: Path) -> None:
    (tmp_path / "sea.yaml").write_text("{kind: regular, height: 3.0, period: 9.0, direction: 20 deg}")
    for number, target in enumerate(((tmp_path / "sea.yaml",), ("3,9,20", "--regular"))):
        ran = command("sea", *target, "--duration", 60, "--out", tmp_path / f"out{number}")
        assert ran.status == 0 and "regular wave 3 m, 9 s" in ran.out, ran.err
    first, second = ((tmp_path / f"out{n}" / "sea.csv").read_bytes() for n in (0, 1))
    assert first == second


def test_a_run_takes_a_sea(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "out"
    ran = command("run", "nrel5mw-monopile", "--wind-speed", 9, "--sea", "2,8,30", "--duration", 5, "--out", out)
    assert ran.status == 0, ran.err
    assert "ReactMYss" in ran.out and "Wave1Elev" in ran.out
    again = command("run", out / "case.yaml", "--out", tmp_path / "again")
    assert again.status == 0, again.err
    assert (tmp_path / "again" / "statistics.csv").read_bytes() == (out / "statistics.csv").read_bytes()
