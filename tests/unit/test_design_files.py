"""Linear models and rotor tables as files of other programs."""

from __future__ import annotations

import ast
import shutil
import subprocess
from dataclasses import dataclass, replace
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Model, Turbine
from meltemi.analyses.linear import LinearModel
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.io import export_rosco, linear_set, read_rosco_table, rosco_settings, write_linear_set, write_rosco_table
from meltemi.tuning.baseline_tuning import BaselineTuning

READER = r"""
program read_table  ! by line numbers, as ROSCO does
  real :: pitch(4), ratio(3), cp(3,4), ct(3,4), cq(3,4)
  integer :: i
  open(unit=10, file='table.txt', status='old')
  call skip(4); read(10,*) pitch; call skip(1); read(10,*) ratio; call skip(5)
  do i = 1, 3; read(10,*) cp(i,:); end do
  call skip(4)
  do i = 1, 3; read(10,*) ct(i,:); end do
  call skip(4)
  do i = 1, 3; read(10,*) cq(i,:); end do
  print '(6F9.4)', pitch(4), ratio(3), cp(2,3), ct(1,4), cq(3,1), cq(3,4)
contains
  subroutine skip(n)
    integer, intent(in) :: n
    integer :: j
    do j = 1, n; read(10,*); end do
  end subroutine
end program
"""


@dataclass
class Point:
    """The part of an operating point that a set has."""

    wind: Any
    pitch: float = 0.1
    rotor_speed: float = 1.2
    generator_torque: float = 4e4


def models() -> list[LinearModel]:
    random = np.random.default_rng(1)
    found = []
    for speed in (8.0, 12.0, 16.0):
        point: Any = Point(meltemi.SteadyWind(speed=speed), pitch=0.01 * speed)
        sizes = ((2, 2), (2, 3), (1, 2), (1, 3))
        names = (("q a", "v a"), ("pitch", "wind_speed", "yaw"), ("rotor_speed",))
        units = (("m", "m/s"), ("rad", "m/s", "rad"), ("rad/s",))
        values = (random.random(2), random.random(3), random.random(1))
        found.append(LinearModel(*(random.random(n) for n in sizes), *names, *units, *values, None, point))
    return found


def test_matlab_reads_a_set(tmp_path: Path) -> None:
    """SciPy's reader of the format: operating points last, names as cells, values of the operating points."""
    from scipy.io import loadmat

    made = models()
    found = loadmat(write_linear_set(made, tmp_path / "set.mat", turbine="nrel5mw"), squeeze_me=True)
    assert found["A"].shape == (2, 2, 3) and found["B"].shape == (2, 3, 3)
    for i, model in enumerate(made):
        for name in ("A", "B"):
            np.testing.assert_array_equal(found[name][..., i], getattr(model, name))
        np.testing.assert_array_equal(found["u0"][:, i], model.u0)
    assert list(found["states"]) == ["q a", "v a"] and list(found["input_units"]) == ["rad", "m/s", "rad"]
    assert found["wind_speed"].tolist() == [8.0, 12.0, 16.0] and found["pitch"].tolist() == [0.08, 0.12, 0.16]
    assert "nrel5mw" in str(found["description"]) and "fixed frame" in str(found["description"])


@pytest.mark.slow
def test_python_reads_a_set(tmp_path: Path) -> None:
    """xarray, then python-control: the matrices at a wind speed, by name, and interpolated for a schedule."""
    import xarray as xr

    made = models()
    with xr.open_dataset(write_linear_set(made, tmp_path / "set.nc"), engine="h5netcdf") as data:
        at = data.sel(wind_speed=12.0)
        np.testing.assert_array_equal(at.A, made[1].A)
        assert float(at.B.sel(state="v a", input="yaw")) == made[1].B[1, 2]
        assert data.pitch.attrs["units"] == "rad" and list(data.state_units.values) == ["m", "m/s"]
        between = data.interp(wind_speed=10.0)
        np.testing.assert_allclose(between.A, 0.5 * (made[0].A + made[1].A), rtol=1e-14)
        control = pytest.importorskip("control")
        system = control.ss(at.A.values, at.B.values, at.C.values, at.D.values)
        np.testing.assert_allclose(system(1.0j), control.ss(*(getattr(made[1], n) for n in "ABCD"))(1.0j))


def test_sets_that_are_none_are_refused(tmp_path: Path, model: Model) -> None:
    made = models()
    with pytest.raises(InputError, match="no models"):
        write_linear_set([], tmp_path / "set.mat")
    with pytest.raises(InputError, match=r"\.mat or \.nc"):
        write_linear_set(made, tmp_path / "set.txt")
    with pytest.raises(InputError, match="different states"):
        write_linear_set([made[0], replace(made[1], states=("q b", "v b"))], tmp_path / "set.mat")
    with pytest.raises(InputError, match="ascending"):
        linear_set(model, [12.0, 8.0])


@pytest.fixture
def table() -> RotorPerformance:
    power = np.arange(12.0).reshape(3, 4) / 20.0
    return RotorPerformance(np.array([5.0, 7.5, 10.0]), np.radians([0.0, 5.0, 10.0, 15.0]), power, power + 1, power + 2)


def test_a_table_is_read_as_it_was_written(table: RotorPerformance, tmp_path: Path) -> None:
    found = read_rosco_table(write_rosco_table(table, tmp_path / "table.txt", name="x"))
    for name in ("tip_speed_ratio", "pitch", "power", "thrust", "torque"):
        np.testing.assert_allclose(getattr(found, name), getattr(table, name), rtol=1e-7, atol=1e-9)
    (tmp_path / "bad.txt").write_text("1 2 3\n4 5\n6\n7 8\n")
    with pytest.raises(InputError, match="three tables"):
        read_rosco_table(tmp_path / "bad.txt")
    with pytest.raises(InputError, match="thrust coefficient is not known"):
        write_rosco_table(replace(table, thrust=np.full((3, 4), np.nan)), tmp_path / "table.txt")


def by_words(path: Path) -> dict[str, NDArray[np.float64]]:
    """As ROSCO's toolbox 2.10.6 (``load_from_txt``): a word anywhere in a line, and what follows it."""
    found: dict[str, NDArray[np.float64]] = {}
    lines = iter(path.read_text().splitlines())
    for line in lines:
        for word in ("Pitch angle", "TSR"):
            if word in line:
                found[word] = np.array(next(lines).split(), dtype=float)
        for word in ("Power", "Thrust", "Torque"):
            if word in line:
                next(lines)
                found[word] = np.array([next(lines).split() for _ in found["TSR"]], dtype=float)
    return found


def test_words_of_the_toolbox_find_the_parts_of_a_table(table: RotorPerformance, tmp_path: Path) -> None:
    """Also where the name of the turbine has such a word."""
    found = by_words(write_rosco_table(table, tmp_path / "table.txt", name="Power TSR Pitch angle"))
    expected = (np.degrees(table.pitch), table.tip_speed_ratio, table.power, table.thrust, table.torque)
    for ours, theirs in zip(expected, found.values(), strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=1e-7)


@pytest.mark.rosco
def test_the_toolbox_of_rosco_reads_a_table(table: RotorPerformance, tmp_path: Path) -> None:
    """By the function of the package itself, without the packages that its module imports."""
    source = Path(str(distribution("rosco").locate_file("rosco/toolbox/utilities.py"))).read_text(encoding="utf-8")
    (load,) = (each for each in ast.parse(source).body if getattr(each, "name", "") == "load_from_txt")
    space: dict[str, Any] = {"np": np, "deg2rad": np.deg2rad(1)}
    exec(compile(ast.Module([load], []), "rosco", "exec"), space)
    found = space["load_from_txt"](write_rosco_table(table, tmp_path / "table.txt", name="Power TSR"))
    expected = (table.pitch, table.tip_speed_ratio, table.power, table.thrust, table.torque)
    for ours, theirs in zip(expected, found, strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gfortran") is None, reason="needs gfortran")
def test_fortran_reads_a_table_by_line_numbers(table: RotorPerformance, tmp_path: Path) -> None:
    write_rosco_table(table, tmp_path / "table.txt")
    (tmp_path / "reader.f90").write_text(READER)
    subprocess.run(["gfortran", "reader.f90", "-o", "reader"], cwd=tmp_path, check=True)
    read = subprocess.run([tmp_path / "reader"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert [float(x) for x in read.stdout.split()] == [15.0, 10.0, 0.3, 1.15, 2.4, 2.55]


def test_settings_of_rosco_and_an_edited_file(turbine: Turbine, tmp_path: Path, monkeypatch: Any) -> None:
    """Gains have ROSCO's sign and halve where the baseline's do; other settings of the file stay."""
    nothing = np.array([0.0, 0.4])
    tuning = BaselineTuning(turbine.control, 0.6, 0.7, 4.4e7, nothing, nothing, nothing, -1.0, 7.5, 0.48)
    found = rosco_settings(turbine, tuning)
    pitch = turbine.control.pitch
    assert found["PC_GS_KP"][0] == -pitch.proportional_gain and found["PC_GS_angles"][-1] == 0.4
    halved = np.interp(pitch.gain_halving_pitch, found["PC_GS_angles"], found["PC_GS_KI"])
    assert halved == pytest.approx(-0.5 * pitch.integral_gain, rel=1e-3)
    assert found["VS_GenEff"] == pytest.approx(94.4) and found["WE_Jtot"] == 4.4e7
    monkeypatch.setattr("meltemi.exchange.rosco_files.performance_of", lambda turbine: table_of())
    lines = [f"0  ! {name}" for name in (*found, "PerfFileName", "PerfTableSize", "F_LPFCornerFreq")]
    (tmp_path / "source.in").write_text("\n".join(lines) + "\n")
    first, second = export_rosco(turbine, tmp_path, tmp_path / "source.in", tuning)
    text = second.read_text()
    assert "4 3  ! PerfTableSize" in text and f'"{first}"  ! PerfFileName' in text and "0  ! F_LPFCornerFreq" in text
    (tmp_path / "source.in").write_text("0  ! PC_GS_n\n")
    with pytest.raises(InputError, match="has no 'PC_GS_angles'"):
        export_rosco(turbine, tmp_path, tmp_path / "source.in", tuning)


def table_of() -> RotorPerformance:
    power = np.ones((3, 4))
    return RotorPerformance(np.arange(3.0) + 5.0, np.arange(4.0) / 10.0, power, power, power)


@pytest.mark.slow
def test_a_set_of_a_turbine_is_that_of_its_models(model: Model, tmp_path: Path) -> None:
    (one,) = linear_set(model, [14.0], ("pitch",), ("rotor_speed",))
    alone = meltemi.analysis.linearise(model, meltemi.operating_point(model, 14.0), ("pitch",), ("rotor_speed",))
    np.testing.assert_array_equal(one.A, alone.A)
    assert write_linear_set([one], tmp_path / "set.nc").stat().st_size > 1000
