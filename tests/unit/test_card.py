"""Batches on a graphics card: memory is moved and the same loop runs there; tested without a card."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys

import numpy as np
import pytest

import meltemi
from meltemi.compiler import record_at
from meltemi.core.errors import InputError, Status
from meltemi.cuda import march as card
from meltemi.cuda import single_precision
from meltemi.loadcases.batch import memory_of
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march

pytestmark = pytest.mark.filterwarnings("ignore::numba.core.errors.NumbaPerformanceWarning")
MODEL = meltemi.build(meltemi.load_turbine("pmsg20mw"))


def run_of(wind: float) -> Run:
    return Run(MODEL, wind, duration=2.0, output_step=0.1)


def march_alone(wind: float) -> Result:
    march(run := Simulation(run_of(wind)))
    return run.result()


def march_moved(image: card.Image, runs: list[Simulation]) -> None:
    """March runs to their ends in the memory of an image, and copy it back."""
    words = image.at(image.content.ctypes.data)
    for i, run in enumerate(runs):
        records = [
            record_at(type(r))(words, i, first) for r, first in zip(card.records_of(run), image.first, strict=True)
        ]
        run.loop.function(run.n_steps, run.loop.controller, *run.loop.physics, *records)
        assert not run.finished  # its own memory has not changed
    image.restore()


def test_runs_march_in_moved_memory() -> None:
    runs = [Simulation(run_of(wind), numbers="floats") for wind in (8.0, 9.0, 8.0)]
    image = card.Image(runs)
    march_moved(image, runs)
    for run, wind in zip(runs, (8.0, 9.0, 8.0), strict=True):
        assert run.finished
        np.testing.assert_array_equal(run.result().data, march_alone(wind).data)


def test_shared_memory_is_moved_once_and_the_rest_for_each_run() -> None:
    runs = [Simulation(run_of(8.0), numbers="floats") for _ in range(2)]
    one, two = card.Image(runs[:1]), card.Image(runs)
    assert len(two.content) < 2 * len(one.content)
    outputs = [run.loop.output.ctypes.data for run in runs]
    assert all(any(begin == output for begin, _, _ in two.parts) for output in outputs)
    assert len(card.Image([*runs, *runs]).parts) == 2 * len(two.parts)


def test_cases_share_a_field_of_which_a_group_holds_one() -> None:
    described = meltemi.TurbulentWind(speed=9.0, intensity=0.1, periodic=True, points=7)
    field = meltemi.wind.unit_turbulence(meltemi.wind.generate_field(described, MODEL.turbine, 60.0))
    winds = [meltemi.wind.SharedTurbulence(meltemi.SteadyWind(speed=v), field, 0.1 * v, 20.0 * v) for v in (8.0, 9.0)]
    cases = [Run(MODEL, wind, duration=2.0, output_step=0.1) for wind in winds]
    runs = [Simulation(case, numbers="floats") for case in cases]
    image, size = card.Image(runs), field.velocity.nbytes
    assert size < image.content.nbytes < 2 * size
    held = memory_of(runs[0]) | memory_of(runs[1])
    assert sum(held.values()) == size + 2 * runs[0].loop.output.nbytes
    march_moved(image, runs)
    for run, case in zip(runs, cases, strict=True):
        march(alone := Simulation(case))
        np.testing.assert_array_equal(run.result().data, alone.result().data)
    assert not np.array_equal(runs[0].result()["wind_x"], runs[1].result()["wind_x"])


def test_a_run_that_has_ended_stays_as_it_is() -> None:
    run = Simulation(run_of(8.0), numbers="floats")
    run.case.clock.status = int(Status.DIVERGED)
    run.loop.march(10)
    assert run.case.clock.step == 0


def test_plain_python_controllers_are_refused() -> None:
    controller = meltemi.Controller(update=lambda x, m, d, dt: None, name="mine")
    with pytest.raises(InputError, match="'mine' cannot run on a graphics card: it is plain Python"):
        card.compiled_update(controller)


def test_missing_packages_and_cards_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="device must be one of cpu, cuda, cuda-single, found 'gpu'"):
        meltemi.simulate_batch([run_of(8.0)], device="gpu")
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: False)
    with pytest.raises(InputError, match=r"pip install 'numba-cuda\[cu12\]>=0.28,<0.31'"):
        meltemi.simulate_batch([run_of(8.0)], device="cuda")


BATCH = """
import numpy as np, meltemi
from meltemi import loadcases
from tests.unit.test_card import run_of
cases = [run_of(8.0), run_of(9.0)]
card, processor = (meltemi.simulate_batch(cases, device=device) for device in ("cuda", "cpu"))
for a, b in zip(card, processor, strict=True):
    assert a.ok and b.ok, (a, b)
    np.testing.assert_array_equal(a.value.data, b.value.data)
loadcases.batch.GROUP = 1  # two groups, of which one is prepared while the other one marches
card, processor = (meltemi.simulate_batch(cases, device=device, series=False) for device in ("cuda", "cpu"))
for a, b in zip(card, processor, strict=True):
    np.testing.assert_array_equal(a.value.statistics, b.value.statistics)
    np.testing.assert_array_equal(a.value.damages, b.value.damages)
    assert a.value.samples == 21
print("agreed")
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("numba_cuda") is None, reason="needs numba-cuda: meltemi[cuda]")
def test_a_batch_in_the_simulator_of_a_card_agrees_with_the_processor() -> None:
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    done = subprocess.run([sys.executable, "-c", BATCH], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "agreed", done.stderr


CODE = """
define double @_ZN7meltemi4aero3bem7balance(double %x, ptr %p) {
  %y = load double, ptr %p, align 8
  %z = fmul nsz contract double %x, %y
  %1 = call contract double @llvm.sqrt.f64(double %z)
  %n = load i64, ptr %p, align 8
  ret double %1
}
define double @_ZN7meltemi10simulation4step7predict(double %x) {
  %z = fmul double %x, %x
  ret double %z
}
"""


def test_evaluations_are_rounded_to_single_precision() -> None:
    made = single_precision.rounded(CODE)
    assert made.count("fptrunc double") == made.count("fpext float") == 3
    assert made.endswith(CODE[CODE.index("define double @_ZN7meltemi10") :].rstrip())  # the step is not
    lines = made.splitlines()
    assert [line.split(" = ")[0].strip() for line in lines if "fpext" in line] == ["%y", "%z", "%1"]


@pytest.mark.long
def test_equivalent_loads_in_single_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend("tools")
    tool = importlib.import_module("single_precision")
    wind = meltemi.TurbulentWind(speed=12.0, intensity=0.16, seed=1, points=9)
    case = Run(meltemi.build(meltemi.load_turbine("nrel5mw")), wind, duration=30.0, channels=tool.LOADS)
    exact, coarse = (Simulation(case, numbers="floats") for _ in range(2))
    march(exact)
    a, b = exact.result(), tool.rounded_march(coarse)(coarse)
    deviation = np.abs(b.data - a.data).max(axis=0) / a.data.std(axis=0)
    assert np.all((deviation > 1e-7) & (deviation < 2e-3))
    loads = meltemi.equivalent_loads(b)
    assert meltemi.equivalent_loads(a) == pytest.approx(loads, rel=2e-4)


PTX = """
import sys
sys.path.insert(0, "tools")
import card_code
for single in (False, True):
    print(card_code.ptx_of("pmsg20mw", single=single))
    print("next")
"""


def missing() -> str:
    """What compilation for a card needs and is not installed."""
    for name in ("numba_cuda", "nvidia", "nvidia.cuda_nvcc"):
        if importlib.util.find_spec(name) is None:
            return f"needs {name}: meltemi[cuda]"
    return ""


@pytest.mark.slow
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_the_loop_compiles_for_a_card() -> None:
    done = subprocess.run([sys.executable, "-c", PTX], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    double, single, _ = done.stdout.split("next")
    for code in (double, single):
        assert ".target sm_90" in code and "march_and_count" in code and "fma.rn.f64" in code
        assert "cosf" not in code
    assert single.count("mul.f32") > double.count("mul.f32") + 20


def has_card() -> bool:
    try:
        card.check()
    except InputError:
        return False
    return True


@pytest.mark.skipif(not has_card(), reason="needs numba-cuda and a graphics card")
def test_a_batch_on_a_card_agrees_with_the_processor() -> None:
    cases = [run_of(8.0), run_of(9.0)]
    for a, b in zip(*(meltemi.simulate_batch(cases, device=d) for d in ("cuda", "cpu")), strict=True):
        np.testing.assert_allclose(a.value.data, b.value.data, rtol=1e-9, atol=1e-12 * np.abs(b.value.data).max())
