"""Contracts of the kernels: nothing is compiled twice, chunks and order change no bit, the cache notices edits."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Model, ModelOptions, Stations, SteadyWind, Turbine, simulate
from meltemi.analyses.modes import natural_modes
from meltemi.compiler import statistics
from meltemi.core.stores import CORE, SIMULATOR
from meltemi.io import write_bts
from meltemi.wind import generate_field

ROOT = Path(__file__).parents[2]
WIND = SteadyWind(speed=11.0)


def box() -> meltemi.WindBox:
    wind = meltemi.TurbulentWind(speed=11.0, intensity=0.14)
    return meltemi.wind.generate_field(wind, meltemi.load_turbine("nrel5mw"), 5.0)


def read_only_box() -> meltemi.WindBox:
    b = box()
    velocity = b.velocity.copy()
    velocity.setflags(write=False)
    return meltemi.WindBox(velocity, dt=b.dt, dy=b.dy, dz=b.dz, bottom=b.bottom, speed=b.speed, periodic=b.periodic)


def swapped_box() -> meltemi.WindBox:
    """The same velocities in another order in memory."""
    b = box()
    velocity = np.asfortranarray(b.velocity)
    return meltemi.WindBox(velocity, dt=b.dt, dy=b.dy, dz=b.dz, bottom=b.bottom, speed=b.speed, periodic=b.periodic)


CHANGES: dict[str, Callable[[Turbine], Any]] = {
    "options": lambda t: simulate(
        meltemi.build(
            t,
            ModelOptions(
                wake="none", inflow="quasi_steady", stall="static", skew="none", tower_influence="none", yaw="free"
            ),
        ),
        WIND,
        duration=1.0,
    ),
    "other options": lambda t: simulate(
        meltemi.build(
            t.replace(**{"pitch_actuator.kind": "second_order"}),
            ModelOptions(
                yaw="driven",
                inflow="constant",
                advanced={"stall_rotation": "openfast", "chord_angle": "openfast"},
            ),
        ),
        SteadyWind(speed=11.0, roughness=0.03, veer=1e-3, upflow=0.1),
        duration=1.0,
    ),
    "series": lambda t: simulate(
        meltemi.build(t), meltemi.WindSeries(time=[0.0, 0.5], speed=[10.0, 11.0]), duration=1.0
    ),
    "foundation": lambda t: simulate(
        meltemi.build(t.replace(foundation={"stiffness": np.diag([1e9, 1e9, 1e10, 1e11, 1e11, 1e11]).tolist()})),
        WIND,
        duration=1.0,
    ),
    "modes": lambda t: simulate(
        meltemi.build(t, ModelOptions(flap_modes=3, edge_modes=2, torsion_modes=0, fore_aft_modes=1)),
        WIND,
        duration=1.0,
    ),
    "no modes": lambda t: simulate(
        meltemi.build(
            t, ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, fore_aft_modes=0, side_side_modes=0)
        ),
        WIND,
        duration=1.0,
    ),
    "gearbox": lambda t: simulate(
        meltemi.build(
            t.replace(**{"drivetrain.gearbox": meltemi.turbine.size_gearbox(ratio=97.0, rated_torque=4e6)}),
            ModelOptions(drivetrain="multibody"),
        ),
        WIND,
        duration=1.0,
    ),
    "locked": lambda t: simulate(meltemi.build(t, ModelOptions(locked=("blades", "tower"))), WIND, duration=1.0),
    "nodes": lambda t: simulate(meltemi.build(t, ModelOptions(blade_nodes=33, tower_nodes=11)), WIND, duration=1.0),
    "two blades": lambda t: simulate(meltemi.build(t.replace(n_blades=2)), WIND, duration=1.0),
    "channels": lambda t: simulate(
        meltemi.build(t), WIND, duration=1.0, channels=["all"], stations=Stations((10.0, 30.0), (40.0,))
    ),
    "one channel": lambda t: simulate(meltemi.build(t), WIND, duration=1.0, channels=["rotor_speed"]),
    "box": lambda t: simulate(meltemi.build(t), box(), duration=1.0),
    "read-only box": lambda t: simulate(meltemi.build(t), read_only_box(), duration=1.0),
    "box in another order": lambda t: simulate(meltemi.build(t), swapped_box(), duration=1.0),
    "parameters": lambda t: simulate(
        meltemi.build(t).with_parameters(**{"aerodynamics.air_density": 1.1}), WIND, duration=1.0
    ),
    "corrections": lambda t: simulate(meltemi.build(t, ModelOptions(advanced={"corrections": 2})), WIND, duration=1.0),
    "modes of the machine": lambda t: natural_modes(meltemi.build(t)),
    "performance": lambda t: meltemi.analysis.rotor_performance(t, [7.0], [0.0]),
}


@pytest.mark.parametrize("what", CHANGES)
def test_nothing_is_compiled_again(turbine: Turbine, model: Model, what: str) -> None:
    simulate(model, box(), duration=1.0)
    before = statistics()
    result = CHANGES[what](turbine)
    assert statistics() == before
    if isinstance(result, meltemi.Result):
        assert result.status is meltemi.Status.OK


def test_length_of_chunks_changes_no_bit(model: Model) -> None:
    runs = []
    for steps in (1, 7, 1000):
        run = meltemi.Simulation(meltemi.Run(model, box(), duration=4.0, channels=["all"]))
        while not run.finished:
            run.advance(steps)
        runs.append(run.result().data)
    assert np.array_equal(runs[0], runs[1])
    assert np.array_equal(runs[0], runs[2])


def test_runs_repeat_bit_by_bit_alone_and_side_by_side(model: Model) -> None:
    alone = [simulate(model, box(), duration=3.0).data for _ in range(2)]
    assert np.array_equal(*alone)
    found: dict[int, Any] = {}

    def work(i: int) -> None:
        found[i] = simulate(model, box(), duration=3.0).data

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(alone[0], data) for data in found.values())


def test_the_warm_start_is_a_mere_guess(turbine: Turbine) -> None:
    """A disturbed memory of the induction solver changes loads by less than 1e-6."""
    model = meltemi.build(turbine)
    start = meltemi.operating_point(model, WIND)
    loads = []
    for disturbed in (False, True):
        run = meltemi.Simulation(
            meltemi.Run(model, WIND, duration=2.0, start=start, channels=["RootMyc1", "RtFldFxh", "TwrBsMyt"])
        )
        while not run.finished:
            if disturbed:
                memory = run.case["memory"]
                memory[0] += 0.02 * np.sin(np.arange(memory[0].size)).reshape(memory[0].shape)
            run.advance(20)
        loads.append(run.result().data)
    scale = np.max(np.abs(loads[0]), axis=0)
    assert np.max(np.abs(loads[1] - loads[0]) / scale) < 1e-6


def child(code: str, *, check: bool = True, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, check=False
    )
    if check and done.returncode:
        raise AssertionError(done.stderr)
    return done.stdout


def test_an_edited_callee_in_another_file_is_noticed(tmp_path: Path) -> None:
    """Numba's own cache would give the old result."""
    package = tmp_path / "src" / "meltemi"
    shutil.copytree(ROOT / "src" / "meltemi", package, ignore=shutil.ignore_patterns("__pycache__"))
    code = """
from meltemi.maths.vectors import Sym, Vec
from meltemi.structure.equations import inertia_about
print(inertia_about(Sym(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1.0, Vec(0.0, 0.0, 0.0), Vec(3.0, 4.0, 0.0)).zz)
"""
    where = {"PYTHONPATH": str(package.parent), "MELTEMI_CACHE_DIR": str(tmp_path / "cache")}
    assert float(child(code, **where)) == 25.0
    vectors = package / "maths" / "vectors.py"
    text = vectors.read_text(encoding="utf-8")
    assert "return a.x * b.x + a.y * b.y + a.z * b.z" in text
    vectors.write_text(text.replace("return a.x * b.x +", "return 2.0 * a.x * b.x +"), encoding="utf-8")
    assert float(child(code, **where)) == 34.0
    assert len(list((tmp_path / "cache" / "kernels").iterdir())) == 2


@pytest.mark.long
def test_another_processor_gives_the_same_within_1e_8(tmp_path: Path) -> None:
    """In one wind field: the synthesis in single precision rounds otherwise, 7e-8 of the speed."""
    field = tmp_path / "field.bts"
    wind = meltemi.TurbulentWind(speed=11.0, intensity=0.14)
    write_bts(generate_field(wind, meltemi.load_turbine("nrel5mw"), 60.0), field)
    code = f"""
import numpy as np, meltemi
options = meltemi.ModelOptions().replace(**{{"advanced.induction_tolerance": 0.0}})  # else rounding decides on its end
model = meltemi.build(meltemi.load_turbine("nrel5mw"), options)
wind = meltemi.io.read_bts(r"{field}")
np.save(r"{tmp_path}/NAME.npy", meltemi.simulate(model, wind, duration=60.0).data)
"""
    cache = str(tmp_path / "cache")
    child(code.replace("NAME", "host"))
    child(code.replace("NAME", "generic"), NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="", MELTEMI_CACHE_DIR=cache)
    host, generic = (np.load(tmp_path / f"{name}.npy") for name in ("host", "generic"))
    scale = np.max(np.abs(host), axis=0) + 1e-12
    difference = np.max(np.abs(generic - host), axis=0) / scale
    azimuth = 3  # wraps at a full turn
    assert np.max(np.delete(difference, azimuth)) < 1e-8
    assert not np.array_equal(host, generic)


@pytest.mark.long
def test_node_functions_pass_without_compilation() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-k", "node_", str(ROOT / "tests" / "unit")],
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]


def test_every_package_has_its_place_in_the_contract_and_the_core_is_the_lowest() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (rows,) = (each["layers"] for each in contracts if "meltemi.core" in each.get("layers", ()))
    layers = [name.strip() for row in rows for name in row.split("|")]
    packages = {file.parent.name for file in (ROOT / "src" / "meltemi").glob("*/__init__.py")}
    assert sorted(layers) == sorted(f"meltemi.{name}" for name in packages)
    assert sorted(layers[-len(CORE) :]) == sorted(f"meltemi.{name}" for name in CORE)
    assert sorted(layers[-len(SIMULATOR) :]) == sorted(f"meltemi.{name}" for name in SIMULATOR)


def test_what_runs_with_the_oldest_dependencies_skips_without_windio() -> None:
    """Turbines of windIO in tests of nodes and of the regression, which ``.ci/run`` runs without extras."""
    for file in (*(ROOT / "tests" / "unit").glob("test_node_*.py"), *(ROOT / "tests" / "regression").glob("test_*.py")):
        for text in re.split(r"^def ", file.read_text(encoding="utf-8"), flags=re.MULTILINE):
            asked = re.search(r'load_turbine\("iea', text) is None or 'importorskip("windIO")' in text
            assert asked, f"{file.name}: {text.partition('(')[0]} needs windIO"
