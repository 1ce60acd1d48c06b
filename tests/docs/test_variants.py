"""The models of docs/variants.md, put into a copy of the package as the page says, run and behave as they should."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "variants.md").read_text(encoding="utf-8")
RUN = """
import sys, numpy as np, meltemi
from meltemi import ModelOptions, Start, SteadyWind
from meltemi.control.actuators import pitch_advance
from meltemi.simulation.case import Case

options = dict(blade_nodes=6, tower_nodes=3, time_step=0.02, torsion_modes=0, flap_modes=1, edge_modes=0)
turbine = meltemi.load_turbine("nrel5mw")


def settled(direction=0.0, **chosen):
    case = Case(meltemi.build(turbine, ModelOptions(**options, **chosen)), SteadyWind(speed=12.0, direction=direction),
                numbers=sys.argv[1])
    Start(rotor_speed=1.2, pitch=0.05).put(case)
    case.settle(0.0)
    return case


def close(a, b, tolerance=1e-9):
    np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance)


# stall: in steady flow the static polar, but for a product of interpolated columns
oye, static = (settled(stall=name, advanced=dict(stall_rotation="none")) for name in ("oye", "static"))
lift = [case.view("flow")["lift"] for case in (oye, static)]
close(*lift, tolerance=5e-3)
# the derivative is that of the step
oye["stall"][3] -= 0.1
before = oye["stall"].copy()
oye.evaluate(0.0)
oye.rates()
rates = oye["d_stall"].copy()
oye.evaluate(0.0, 1e-6)
change = (oye["stall"] - before) / 1e-6
assert np.abs(rates[3]).max() > 1.0 and not rates[:3].any()
moving = rates[3] != 0.0
close(change[3][moving], rates[3][moving], tolerance=2e-3 * np.abs(rates).max())
# inflow: the same steady state, with another time constant
travel, variable = settled(inflow="travel"), settled(inflow="variable")
close(travel["inflow"], variable["inflow"])
rotor = travel.view("rotor")
close(rotor["inflow_time"], rotor["tip_radius"] / rotor["axial_wind"])
# tower influence: only behind the tower
wake, none = settled(tower_influence="wake"), settled(tower_influence="none")
close(wake.view("flow")["wind"], none.view("flow")["wind"])
# actuators: 63 % of a step of the demand after the time constant, at most the limit of the rate; one state a blade
lag = turbine.replace(**{"pitch_actuator.kind": "first_order", "pitch_actuator.natural_frequency": 2.0})
model = meltemi.build(lag, ModelOptions(**options))
case = Case(model, SteadyWind(speed=12.0), numbers=sys.argv[1])
case.control.demands.array[:] = 0.0
case.view("demands")["pitch"] = 0.01
for _ in range(50):
    pitch_advance(0.01, case.control)
close(case.view("pitch")["angle"], 0.01 * (1.0 - np.exp(-1.0)))
close(case.view("pitch")["rate"], 0.02 * np.exp(-1.0))
case.view("demands")["pitch"] = 1.0
before = case.view("pitch")["angle"].copy()
pitch_advance(0.01, case.control)
close(case.view("pitch")["angle"] - before, 0.01 * lag.pitch_actuator.rate_limit)
if sys.argv[1] == "floats":
    disk = meltemi.load_turbine("pmsg20mw")
    for kind, count in (("first_order", 1), ("second_order", 2), ("ideal", 0)):
        model = meltemi.build(disk.replace(**{"pitch_actuator.kind": kind, "pitch_actuator.natural_frequency": 2.0}))
        point = meltemi.operating_point(model, 14.0)
        linear = meltemi.analysis.linearise(model, point, outputs=("rotor_speed",))
        assert sum("pitch" in name for name in linear.states) == 3 * count
        if kind == "first_order":
            assert np.abs(np.linalg.eigvals(linear.A) + 2.0).min() < 1e-9

"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with the files and lines of the page."""
    source = tmp_path_factory.mktemp("package")
    copy = source / "meltemi"
    shutil.copytree(ROOT / "src" / "meltemi", copy, ignore=shutil.ignore_patterns("__pycache__"))
    files = dict(re.findall(r"`src/meltemi/((?:aero|control)/\w+/\w+\.py)`:\n\n```python\n(.*?)```", PAGE, re.DOTALL))
    lines = re.findall(r"```python\n((\w+) = Literal.*)\n```", PAGE)
    assert len(files) == len(lines) == 4
    for name, text in files.items():
        assert not (copy / name).exists()
        (copy / name).write_text(text, encoding="utf-8")
    for line, name in lines:
        register = copy / ("turbine/exchange.py" if name == "ActuatorModel" else "aero/variants.py")
        text, n = re.subn(rf"^{name} = .*$", line, register.read_text(encoding="utf-8"), flags=re.MULTILINE)
        assert n == 1
        register.write_text(text, encoding="utf-8")
    return source


def run(package: Path, numbers: str, **environment: str) -> None:
    found = subprocess.run(
        [sys.executable, "-c", RUN, numbers],
        env={**os.environ, "PYTHONPATH": str(package), **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert found.returncode == 0, found.stderr[-3000:]


@pytest.mark.slow
def test_the_models_of_the_page_run(package: Path) -> None:
    run(package, "floats", NUMBA_DISABLE_JIT="1")


@pytest.mark.long
@pytest.mark.parametrize("numbers", ["floats", "lanes", "duals"])
def test_they_compile_for_every_number_type(package: Path, tmp_path: Path, numbers: str) -> None:
    run(package, numbers, MELTEMI_CACHE_DIR=str(tmp_path))
