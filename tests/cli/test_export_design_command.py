"""``meltemi export-controller``, ``export-linear``, ``export-rosco``."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from terminal import Command

from meltemi.io import read_rosco_table


def test_wrong_input_is_refused_in_a_line(command: Command, tmp_path: Path) -> None:
    for arguments, words in (
        (("export-controller", "ipcc", "--turbine", "nrel5mw"), "did you mean 'ipc'"),
        (("export-controller", "baseline", "--turbine", "nrel5mv"), "nrel5mw"),
        (
            ("export-controller", "fixed", "--turbine", "nrel5mw", "--out", tmp_path / "x.txt"),
            "name of a shared library",
        ),
        (("export-linear", "nrel5mw", "--out", tmp_path / "x.txt"), "expected the ending .mat or .nc"),
        (("export-linear", "nrel5mw", "--wind-speeds", "a"), "--wind-speeds"),
    ):
        ran = command(*arguments)
        assert ran.status == 2 and words in ran.err and len(ran.err.splitlines()) == 1, ran
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_an_exported_controller_runs_by_the_next_command(command: Command, tmp_path: Path) -> None:
    library = tmp_path / "libbaseline.so"
    ran = command("export-controller", "baseline", "--turbine", "nrel5mw", "--out", library)
    assert ran.status == 0 and sorted(ran.files) == [tmp_path / "libbaseline.in", library]
    given = ("--controller", library, "--controller-input", tmp_path / "libbaseline.in", "--out", tmp_path / "out")
    assert command("run", "nrel5mw", "--wind-speed", 12, "--duration", 0.5, *given).status == 0
    assert "parameters of" in (tmp_path / "out" / "run.SrvD.controller.log").read_text()


@pytest.mark.slow
def test_models_and_tables_are_written(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "linear.nc"
    ran = command("export-linear", "nrel5mw", "--wind-speeds", "12", "--outputs", "rotor_speed", "--out", out)
    assert ran.status == 0 and list(ran.files) == [out]
    ran = command("export-rosco", "nrel5mw", "--out", tmp_path)
    assert ran.status == 0 and read_rosco_table(tmp_path / "Cp_Ct_Cq.nrel5mw.txt").power.max() == pytest.approx(
        0.48, abs=0.02
    )
