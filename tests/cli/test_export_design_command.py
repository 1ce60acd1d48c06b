"""``meltemi export-controller``, ``export-fmu``, ``export-linear``, ``export-rosco``."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from terminal import STEADY, Command

from meltemi.io import read_rosco_table


@pytest.mark.slow
@pytest.mark.parametrize("fmi", ["2.0", pytest.param("3.0", marks=pytest.mark.long)])
def test_a_unit_has_what_the_options_say(command: Command, tmp_path: Path, fmi: str) -> None:
    """Of a turbine and of a case, in whose place options stand."""
    fmpy = pytest.importorskip("fmpy", reason="needs FMPy")
    validation = pytest.importorskip("fmpy.validation")
    pytest.importorskip("pythonfmu" if fmi == "2.0" else "pythonfmu3")
    case = tmp_path / "case.yaml"
    case.write_text(STEADY + "channels: [RotSpeed]\n")

    def described(*arguments: object) -> dict[str, str | None]:
        ran = command("export-fmu", *arguments, "--fmi", fmi, "--out", tmp_path / "made.fmu")
        assert ran.status == 0 and ran.files == [tmp_path / "made.fmu"], ran
        assert validation.validate_fmu(str(ran.files[0])) == []
        description = fmpy.read_model_description(str(ran.files[0]))
        assert description.fmiVersion == fmi and description.coSimulation.canGetAndSetFMUstate
        return {v.name: v.start for v in description.modelVariables}

    plain = described("nrel5mw", "--channels", "RootMyc1,GenPwr")
    assert plain["wind_speed"] == "12.0" and "demand.generator_torque" not in plain
    assert {"root_moment_out_of_plane_1", "generator_power"} < plain.keys() and "rotor_speed" not in plain
    own = described(case)
    assert own["wind_speed"] == "10.0" and "rotor_speed" in own and "generator_power" not in own
    given = described(case, "--controller", "fixed", "--wind-speed", 9, "--channels", "GenPwr")
    assert given["wind_speed"] == "9.0" and "demand.generator_torque" in given and "rotor_speed" not in given


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
