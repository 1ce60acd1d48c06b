"""The parts of docs/development/extensions.md, put into a copy of the package as the page says, run and behave."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from meltemi.app.signatures import with_options

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "development" / "extensions.md").read_text(encoding="utf-8")
BLADES = "simulation/blades"
BEHIND = {
    "simulation/tables.py, last field of Summary": 'number("W", "mechanical power of the low-speed shaft")\n',
    "simulation/step.py, at the end of whole_machine": "    s.rotor_power = rotor_speed(m) * c.chain.apex_moment.x\n",
    "control/actuators.py, field of Actuators": '    pitch_maximum: float = number("rad", "upper pitch limit")\n',
    "turbine/definition.py, field of PitchActuator": '    """[rad; 0.1 to 1.7] largest pitch."""\n',
    "simulation/model.py, in actuator_array": "    p.pitch_minimum, p.pitch_maximum = a.minimum, a.maximum\n",
    "control/actuators.py, in pitch_advance": "        angle, rate = pitch.angle[b] - offset, pitch.rate[b]\n",
}
"""Ends of the lines behind which the lines of the page stand."""
RUN = """
import sys, numpy as np, meltemi
from meltemi import ModelOptions, Start, SteadyWind
from meltemi.simulation.case import Case, Stations

turbine = meltemi.load_turbine("nrel5mw")
small = dict(blade_nodes=5, tower_nodes=3, time_step=0.025, torsion_modes=0, flap_modes=2, edge_modes=1)


def moving(model):
    case = Case(model, SteadyWind(speed=12.0), Stations(blade=(20.0,)), numbers=sys.argv[1])
    Start(rotor_speed=1.2, pitch=0.05).put(case)
    case["q"][model.n_core :] = 0.3
    case["v"][model.n_core :] = 0.1
    case.evaluate(0.0)
    if sys.argv[1] != "duals":
        case.loads(0.0)
    return case


# blades without displacements of second order are the modal ones without them
modal = meltemi.build(turbine, ModelOptions(**small, blade_model="modal"))
first = meltemi.build(turbine, ModelOptions(**small, blade_model="first_order"))
rotor = modal.rotor
straight = modal.with_arrays(second=0.0 * rotor.second, tip_second=0.0 * rotor.tip_second)
found, expected, other = moving(first), moving(straight), moving(modal)
assert type(found.system).__module__.endswith("first_order")
for name in ("a", "motion") if sys.argv[1] == "duals" else ("a", "motion", "root", "station", "chain"):
    np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-9 * np.abs(expected[name]).max())
    assert np.abs(found[name] - other[name]).max() > 1e-6 * np.abs(other[name]).max(), name
assert first.content_hash() != modal.content_hash()

# channels: of both kinds of rotors, or of one
disk = meltemi.build(meltemi.load_turbine("pmsg20mw"))
if sys.argv[1] == "floats":
    undeflected = Start(rotor_speed=1.0, coordinates={})
    run = meltemi.simulate(modal, 10.0, duration=0.1, start=undeflected, channels=("hub_height",))
    assert 85.0 < run["hub_height"][-1] < 95.0
    names = ("generator_loss", "generator_power", "generator_speed", "generator_torque")
    run = meltemi.simulate(disk, 10.0, duration=0.5, channels=names)
    assert np.allclose(run["generator_loss"], run[names[2]] * run[names[3]] - run[names[1]])
    try:
        meltemi.simulate(disk, 10.0, duration=0.5, channels=("hub_height",))
    except meltemi.InputError:
        pass
    else:
        raise AssertionError("a disk has no deflected hub")

# the dead band: differences of the demand within it do not move the blades
for demand, moves in ((0.105, False), (0.12, True)):
    for band in (0.0, 0.01):
        equipped = disk.turbine.replace(**{"pitch_actuator.dead_band": band})
        case = Case(meltemi.build(equipped), SteadyWind(speed=10.0))
        from meltemi.control.actuators import pitch_advance

        case.view("pitch")["angle"] = 0.1
        case.control.demands.pitch[0] = demand
        pitch_advance(0.1, case.control)
        assert (case.view("pitch")["angle"][0] != 0.1) == (moves or band == 0.0)
"""


def code(*titles: str) -> list[str]:
    """Blocks of Python without a title, or with these."""
    marks = [rf' title="{re.escape(title)}"' for title in titles] or [""]
    return [text for mark in marks for text in re.findall(rf"^```\w+{mark}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with the files and lines of the page."""
    source = tmp_path_factory.mktemp("package")
    copy = source / "meltemi"
    shutil.copytree(ROOT / "src" / "meltemi", copy, ignore=shutil.ignore_patterns("__pycache__"))
    for title, line in BEHIND.items():
        (added,) = code(title)
        path = copy / title.split(",")[0]
        text = path.read_text(encoding="utf-8")
        assert text.count(line) == 1, title
        path.write_text(text.replace(line, line + added), encoding="utf-8")
    with (copy / "simulation" / "channels.csv").open("a", encoding="utf-8") as file:
        file.writelines(code("rows of simulation/channels.csv"))
    ((name, model),) = re.findall(rf"`src/meltemi/{BLADES}/([a-z]\w+\.py)`:\n\n```python\n(.*?)```", PAGE, re.DOTALL)
    (copy / BLADES / name).write_text(model, encoding="utf-8")
    (line,) = re.findall(r"```python\n(BladeModel = Literal.*)\n```", PAGE)
    register = copy / BLADES / "__init__.py"
    text, n = re.subn(r"^BladeModel = .*$", line, register.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert n == 1
    register.write_text(text, encoding="utf-8")
    return source


def run(package: Path, text: str, *arguments: str, **environment: str) -> str:
    found = subprocess.run(
        [sys.executable, "-c", text, *arguments],
        env={**os.environ, "PYTHONPATH": str(package), **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert found.returncode == 0, found.stderr[-3000:]
    return found.stdout


@pytest.mark.slow
def test_the_parts_of_the_page_run(package: Path) -> None:
    run(package, RUN, "floats", NUMBA_DISABLE_JIT="1")


@pytest.mark.long
@pytest.mark.parametrize("numbers", ["floats", "lanes", "duals"])
def test_they_compile_for_every_number_type(package: Path, tmp_path: Path, numbers: str) -> None:
    run(package, RUN, numbers, MELTEMI_CACHE_DIR=str(tmp_path))


@pytest.mark.long
@pytest.mark.parametrize("word", ["foundation = {", "WakeTurbine("])
def test_the_programs_of_the_page_print_what_it_says(tmp_path: Path, word: str) -> None:
    """A motion of the base with the period of the closed form; a kind of rotor."""
    ((program, printed),) = [
        pair
        for pair in re.findall(
            r'^```python\n(import.*?|from.*?)^```\n\n```text title="printed"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL
        )
        if word in pair[0]
    ]
    path = tmp_path / "program.py"
    path.write_text(program, encoding="utf-8")
    start = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import program"
    assert run(ROOT / "src", start, NUMBA_DISABLE_JIT="1") == printed


def test_the_command_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a package that has the rest of what it names."""
    typer, testing = pytest.importorskip("typer"), pytest.importorskip("typer.testing")
    (text,) = (block for block in code() if "def fatigue" in block)
    (home := tmp_path / "my_package").mkdir()
    (home / "__init__.py").touch()
    (home / "commands.py").write_text(text, encoding="utf-8")
    (home / "lifetime.py").write_text(
        "def lifetime(turbine, years, out, progress):\n    (out / 'loads').write_text(turbine)\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    ((module, name),) = re.findall(r'^fatigue = "([\w.]+):(\w+)"$', PAGE, re.MULTILINE)
    app = typer.Typer()
    app.command()(with_options(getattr(__import__(module, fromlist=[name]), name)))
    ran = testing.CliRunner().invoke(app, ["nrel5mw", "--out", str(tmp_path / "out")])
    assert ran.exit_code == 0, ran.output
    assert (tmp_path / "out" / "loads").read_text() == "nrel5mw"
    for each in [each for each in sys.modules if each.startswith("my_package")]:
        monkeypatch.delitem(sys.modules, each)
