"""The Python on the pages runs as it stands there."""

from __future__ import annotations

import csv
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import write_programs

import meltemi
from meltemi.app.cli import main
from meltemi.cases.case import read_case
from meltemi.controllers import schemes, tuning
from meltemi.loads.surrogate.model import LoadModel, Polynomials, Surrogate, write_surrogate
from meltemi.loads.surrogate.space import site_space
from meltemi.tuning import baseline_tuning
from meltemi.validation.channel_map import read_channel_map

ROOT = Path(__file__).parents[2]
PAGES = (
    "README.md",
    "docs/getting-started.md",
    "docs/guide/controllers.md",
    "docs/guide/comparing.md",
    "docs/guide/own-controller.md",
    "docs/guide/batches.md",
    "docs/guide/validation.md",
    "docs/guide/scale.md",
    pytest.param(
        "docs/guide/load-base.md", marks=pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs pyarrow")
    ),
    pytest.param(
        "docs/guide/surrogate.md", marks=pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs pyarrow")
    ),
    pytest.param(
        "docs/guide/learning.md", marks=pytest.mark.skipif(find_spec("gymnasium") is None, reason="needs gymnasium")
    ),
    "docs/guide/results.md",
    "docs/guide/saved-states.md",
    "docs/guide/strength.md",
    pytest.param(
        "docs/guide/controller-libraries.md",
        marks=pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler"),
    ),
    "docs/guide/view.md",
    "docs/guide/events.md",
    "docs/guide/electrical.md",
    "docs/guide/operating-points.md",
    pytest.param("docs/guide/power-control.md", marks=pytest.mark.long),
    "docs/guide/frames.md",
    "docs/guide/linear.md",
    "docs/guide/observer.md",
    "docs/guide/coordination.md",
    "docs/guide/power-turbines.md",
    pytest.param("docs/guide/sensitivities.md", marks=pytest.mark.long),
    "docs/guide/supervision.md",
    "docs/guide/wind.md",
    "docs/guide/air-and-rain.md",
    "docs/guide/yaw.md",
    "docs/guide/icing.md",
    "docs/guide/sections.md",
    "docs/migrate/windio.md",
    "docs/migrate/openfast.md",
)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_code_on_the_page_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks with the title of a file are that file; those of the title ``printed`` are what is printed. Loops are
    tuned at one operating point, gains at few."""
    monkeypatch.setattr(schemes, "linear_models", lambda model, progress=None: tuning.linear_models(model, [18.0]))
    monkeypatch.setattr(baseline_tuning, "MARGIN_POINTS", 1)
    monkeypatch.setattr(baseline_tuning, "POINTS", 3)
    code, texts = "\n".join(blocks(page, "python")), blocks(page, 'text title="printed"')
    assert "import meltemi" in code
    written = files(page, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    exec(compile(code, page, "exec"), {"__name__": "page"})
    for path in written:
        sys.modules.pop(path.stem, None)
    out = capsys.readouterr().out
    assert all(text in out for text in texts)
    plots = re.findall(r'(?:savefig|\.write)\("(.*?)"\)', code)
    assert plots
    for plot in plots:
        assert (tmp_path / plot).stat().st_size > 10_000


FILLED = {"turbine": "nrel5mw", "wind": "{kind: steady, speed: 12.0}", "duration": "600.0"}
"""What a case needs, for pages that show only the keys they speak of."""


@pytest.mark.parametrize("page", sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md")))
def test_cases_on_the_page_are_cases(page: str, tmp_path: Path) -> None:
    for text in blocks(page, "yaml"):
        if "coefficient:" in text:  # keys of a turbine
            continue
        if "loggers:" in text:
            (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
            read_channel_map(tmp_path / "map.yaml")
            continue
        rest = "".join(f"{key}: {value}\n" for key, value in FILLED.items() if f"{key}:" not in text)
        path = tmp_path / "case.yaml"
        path.write_text(text + rest, encoding="utf-8")
        read_case(path)


def test_the_plan_on_its_page(capsys: pytest.CaptureFixture[str]) -> None:
    page = "docs/guide/load-case-tables.md"
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), {"__name__": "page"})
    assert capsys.readouterr().out == "".join(blocks(page, 'text title="printed"'))


@pytest.mark.slow
def test_the_library_on_its_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled by the line on the page, it holds power and speed."""
    page = "docs/guide/bladed-controllers.md"
    (law,), (line,) = blocks(page, 'c title="law.c"'), blocks(page, 'sh title="compile"')
    if shutil.which("cc") is None:
        pytest.skip("needs a C compiler")
    monkeypatch.chdir(tmp_path)
    Path("law.c").write_text(law, encoding="utf-8")
    subprocess.run(shlex.split(line), check=True)
    found: dict[str, Any] = {"__name__": "page"}
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), found)
    assert Path("law.png").stat().st_size > 10_000
    library, baseline = (found[name].between(20.0, 60.0) for name in ("library", "baseline"))
    for name in ("RotSpeed", "GenPwr"):
        assert library[name].mean() == pytest.approx(baseline[name].mean(), rel=0.02)


@pytest.mark.slow
def test_the_lidar_on_its_page_runs() -> None:
    """In a controller, which scans in a run, and as a preview."""
    turbine = meltemi.load_turbine("nrel5mw")
    wind = meltemi.TurbulentWind(speed=12.0, intensity=0.1, points=5)
    box = meltemi.wind.generate_field(wind, turbine, 40.0)
    found: dict[str, Any] = {"meltemi": meltemi, "turbine": turbine, "model": meltemi.build(turbine), "box": box}
    code = "\n".join(blocks("docs/guide/controllers.md", 'python title="lidar"'))
    exec(compile(code.replace("duration=600.0", "duration=10.0"), "page", "exec"), found)
    assert meltemi.simulate(found["model"], box, duration=1.0, controller=found["controller"]).status.complete
    assert found["seen"].preview is not None


def test_the_gearbox_on_its_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Means follow the ratio; the two meshes of a stage carry the same."""
    found: dict[str, Any] = {"__name__": "page"}
    exec(compile("\n".join(blocks("docs/guide/turbine-file.md", "python")), "page", "exec"), found)
    assert "high_speed_shaft_torque" in capsys.readouterr().out
    mean = {name: found["result"][name].mean() for name in found["loads"]}
    assert mean["main_shaft_torque"] == pytest.approx(97.0 * mean["high_speed_shaft_torque"], rel=1e-3)
    assert mean["stage_1_sun_force"] == pytest.approx(mean["stage_1_ring_force"], rel=1e-3)


def test_a_file_format_is_one_module_and_one_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The modules and rows of the page are put in their places, then its examples run."""
    from meltemi.core.formats import FileFormat
    from meltemi.wind_files.formats import WindFormat

    page = "docs/development/file-formats.md"
    for kind, files in (("wind_files", "wind_files"), ("postprocess", "postprocess/files")):
        table, home = import_module(f"meltemi.{kind}.formats"), import_module(f"meltemi.{files.replace('/', '.')}")
        ((name, code),) = re.findall(
            rf'^```python title="{files}/(\w+\.py)"\n(.*?)^```', text_of(page), re.MULTILINE | re.DOTALL
        )
        (row,) = blocks(page, f'python title="row in {kind}/formats.py"')
        (tmp_path / kind).mkdir()
        (tmp_path / kind / name).write_text(code, encoding="utf-8")
        monkeypatch.setattr(home, "__path__", [*home.__path__, str(tmp_path / kind)])
        made = eval(row, {"WindFormat": WindFormat, "FileFormat": FileFormat})
        monkeypatch.setattr(table, "FORMATS", (made, *table.FORMATS))
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), {"__name__": "page"})
    assert capsys.readouterr().out == "".join(blocks(page, 'text title="printed"'))
    (tmp_path / "damaged.npz").write_bytes(b"PK\3\4 and no archive")
    with pytest.raises(meltemi.InputError, match=r"damaged\.npz: no archive of a wind box"):
        meltemi.read_wind("damaged.npz")
    with pytest.raises(meltemi.InputError, match=r"supported are \.npz, \.bts"):
        meltemi.read_wind("field.np")
    for kind in ("wind_files.archive", "postprocess.files.csv_table"):
        sys.modules.pop(f"meltemi.{kind}")


@pytest.mark.rosco
def test_moving_from_rosco(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Needs the rosco package, which the page says how to install."""
    try:
        meltemi.control.find_rosco()
    except meltemi.InputError as missing:
        pytest.skip(str(missing))
    test_code_on_the_page_runs("docs/migrate/rosco.md", tmp_path, monkeypatch, capsys)


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str, kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", text_of(page), re.MULTILINE | re.DOTALL)


def files(page: str, folder: Path) -> list[Path]:
    """Write the files whose text stands on a page."""
    return write_programs(text_of(page), folder)


def test_the_deck_of_the_page_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = blocks("docs/guide/openfast-decks.md", "python")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "page", "exec"), {"__name__": "page"})
    assert "1st flap mode of the blade" in capsys.readouterr().out
    assert (tmp_path / "deck" / "nrel5mw.fst").is_file()


@pytest.mark.long
def test_the_scaled_turbine_of_the_page_is_the_librarys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = "docs/guide/scaling.md"
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {"__name__": "page"}
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), found)
    assert "tower 1.19 times the rated rotor speed" in capsys.readouterr().out
    made, stored = meltemi.load_turbine("my-2mw.yaml"), meltemi.load_turbine("zr20-122")
    for gain in ("proportional_gain", "gain_halving_pitch"):
        assert getattr(made.control.pitch, gain) == pytest.approx(getattr(stored.control.pitch, gain), rel=1e-3)
    (fast,) = blocks(page, 'python title="with the paper\'s speed"')
    exec(compile(fast, page, "exec"), found)
    assert 100.0 < found["fast"].control.pitch.reference_speed / 40.49 * 77.5 < 104.0


TUTORIAL = "docs/guide/own-controller.md"


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [False, True])
def test_the_tutorials_controller_is_compared(
    compiled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command of the page, with a shorter run, fewer seeds and a tuning at one wind speed; compiled, too."""
    (path,) = files(TUTORIAL, tmp_path)
    if compiled:
        (line,) = blocks(TUTORIAL, 'python title="compiled"')
        text = path.read_text(encoding="utf-8")
        last = text.splitlines(keepends=True)[-1]
        assert last == line.replace("numba.njit(update)", "update")
        path.write_text("import numba\n" + text.replace(last, line), encoding="utf-8")
    (command,) = blocks(TUTORIAL, "sh")
    short = command.replace("--seeds 6 --duration 700", "--seeds 1 --duration 45 --transient 20")
    assert short != command
    monkeypatch.setattr(schemes, "linear_models", lambda model, progress=None: tuning.linear_models(model, [18.0]))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", shlex.split(short))
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    out = capsys.readouterr().out
    assert "my_ipc" in out and (tmp_path / "out" / "comparison.html").stat().st_size > 100_000
    with (tmp_path / "out" / "seeds.csv").open(newline="", encoding="utf-8") as file:
        std = {row["scheme"]: float(row["RootMyc1 std [kN m]"]) for row in csv.DictReader(file)}
    assert std["my_ipc"] < 0.8 * std["cpc"] and std["ipc"] < 0.8 * std["cpc"]


@pytest.mark.long
def test_the_example_tunes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(ROOT / "examples" / "tune_pitch.py"))
    example["main"](["--duration", "20", "--iterations", "1", "--out", str(tmp_path)])
    values = [float(value) for value in re.findall(r"J = (\d\.\d+)  ", capsys.readouterr().out)]
    assert values[0] == pytest.approx(1.0)
    assert min(values) < 0.99
    assert (tmp_path / "series.png").stat().st_size > 10_000


def test_readme_has_ten_lines() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 10


@pytest.mark.parametrize(("package", "title"), [("floris", "floris_loads.py"), ("py_wake", "pywake_loads.py")])
def test_wind_farm_programs_take_a_surrogate(package: str, title: str, tmp_path: Path) -> None:
    if find_spec(package) is None:
        pytest.skip(f"needs {package}")
    page = "docs/guide/surrogate.md"
    files(page, tmp_path)
    space = site_space(hub_height=90.0, rotor_radius=63.0, cut_in=3.0, cut_out=25.0, rated_power=5e6)
    basis = Polynomials(np.array([[0] * 6, [1] * 6]))
    load = LoadModel("tower_base", "N m", 4.0, space, basis, np.array([[14.0, 0.1]]), 0.05, {})
    (tmp_path / "surrogate").mkdir()
    write_surrogate(Surrogate("nrel5mw", space, {"tower_base": load}, {}), tmp_path / "surrogate" / "surrogate.json")
    ran = subprocess.run([sys.executable, title], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert title == "floris_loads.py" or "tower_base" in ran.stdout
