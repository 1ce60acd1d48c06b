"""``meltemi diff``: what it prints and writes of two results, and what it refuses."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from terminal import Command, refused

import meltemi
from meltemi import Result
from meltemi.simulation.channels import ChannelSet, catalogue

KNOWN = catalogue(ChannelSet(nodes=2))
NAMES = ("rotor_speed", "root_moment_out_of_plane_1", "azimuth", "node_1_alpha_1", "mean_induction")


def result(step: float = 0.05, shift: float = 0.0, names: tuple[str, ...] = NAMES) -> Result:
    time = np.arange(0.0, 60.01, step)
    data = np.stack([(1.0 + shift) * (i + 2.0 + np.sin((i + 1.0) * time)) for i in range(len(names))], axis=1)
    return Result(time, data, tuple(KNOWN[name] for name in names))


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """Ours as netCDF, theirs as .outb at half the rate and a tenth higher."""
    theirs = result(0.1, 0.1, NAMES[:3])
    theirs.meta["description"] = "OpenFAST"
    return meltemi.write_result(result(), tmp_path / "ours.nc"), meltemi.write_result(theirs, tmp_path / "theirs.outb")


def test_two_results(command: Command, tmp_path: Path, pair: tuple[Path, Path]) -> None:
    out = tmp_path / "out"
    ran = command("diff", *pair, "--begin", 10, "--out", out)
    assert (ran.status, ran.err) == (0, "")
    assert ran.files == [out / "differences.csv", out / "differences.png"]
    assert sorted(out.iterdir()) == ran.files
    assert ran.files[1].read_bytes().startswith(b"\x89PNG")
    for said in (
        "ours.nc against theirs.outb",
        "the first is interpolated onto the time step of the other, 0.1 s",
        "compared from 10 to 60 s",
        "only in ours.nc: node_1_alpha_1, mean_induction\n",
    ):
        assert said in ran.out
    with ran.files[0].open(newline="") as file:
        rows = {row["channel"]: row for row in csv.DictReader(file)}
    assert list(rows) == ["rotor_speed", "root_moment_out_of_plane_1"]
    for row in rows.values():  # 1 against 1.1
        for change in ("mean [%]", "std [%]"):
            assert float(row[change]) == pytest.approx(100.0 * (1.0 / 1.1 - 1.0), abs=0.02)
    assert float(rows["root_moment_out_of_plane_1"]["DEL [%]"]) == pytest.approx(-9.09, abs=0.1)
    assert rows["root_moment_out_of_plane_1"]["mean theirs.outb"]


def test_channels_and_the_end(command: Command, tmp_path: Path, pair: tuple[Path, Path]) -> None:
    ran = command("diff", *pair, "--channels", "RootMOoP1, LSSTipPxa", "--end", 30, "--out", tmp_path)
    assert ran.status == 0
    assert "compared from 0 to 30 s" in ran.out
    assert "only in" not in ran.out
    with (tmp_path / "differences.csv").open(newline="") as file:
        assert [row["OpenFAST"] for row in csv.DictReader(file)] == ["RootMyc1", "Azimuth"]


@pytest.mark.slow
def test_files_of_one_name_are_told_apart(command: Command, tmp_path: Path) -> None:
    paths = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        paths.append(meltemi.write_result(result(), tmp_path / folder / "result.out"))
    ran = command("diff", *paths, "--out", tmp_path)
    assert f"mean {paths[0]},mean {paths[1]}" in (tmp_path / "differences.csv").read_text()
    assert ran.status == 0


def test_what_cannot_be_compared(command: Command, tmp_path: Path, pair: tuple[Path, Path]) -> None:
    ours, theirs = pair
    out = tmp_path / "out"
    refused(command("diff", ours, tmp_path / "missing.outb", "--out", out), out, "missing.outb: cannot be read")
    refused(command("diff", ours, theirs, "--begin", 100, "--out", out), out, "no time in common")
    refused(command("diff", ours, theirs, "--channels", "RotSped", "--out", out), out, "did you mean RotSpeed")
    (tmp_path / "cut.outb").write_bytes(theirs.read_bytes()[:-1])
    ran = command("diff", ours, tmp_path / "cut.outb", "--out", tmp_path / "warned")
    assert ran.status == 0 and "warning: cut.outb is cut: " in ran.err
    (tmp_path / "cut.outb").write_bytes(theirs.read_bytes()[:50])
    refused(command("diff", ours, tmp_path / "cut.outb", "--out", out), out, "cut.outb: cut or damaged")
