"""``meltemi warmup``: compilation of all kernels in advance.

Numba compiles under one lock, so threads do not help: each stage runs in a separate process. Stages are independent;
they share the compiled kernels through the cache.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from subprocess import DEVNULL, Popen, run
from typing import Any

from meltemi.compiler import cache_folder, statistics
from meltemi.core.errors import InputError, MeltemiError, did_you_mean
from meltemi.core.threads import available_cores
from meltemi.simulation.run import Run


@dataclass(frozen=True)
class Stage:
    """Result of one compilation stage.

    Attributes:
      name: name of the stage.
      seconds: wall time of its process.
      signatures: number of signatures used, of functions called from Python.
      compiled: number of these that were not in the cache.
    """

    name: str
    seconds: float
    signatures: int
    compiled: int


def warmup(
    stages: Iterable[str] | None = None,
    *,
    workers: int | None = None,
    done: Callable[[Stage], None] = lambda stage: None,
) -> Path:
    """Compile all kernels, several stages at a time.

    Args:
      stages: names from ``STAGES``; by default all.
      workers: simultaneous processes; by default one per core.
      done: callback for each finished stage.

    Returns:
      The cache folder.

    Raises:
      InputError: there is no such stage, or no cache folder can be written.
      MeltemiError: a stage failed.
    """
    names = list(STAGES if stages is None else stages)
    for name in names:
        if name not in STAGES:
            raise InputError(f"warmup: no stage {name!r}: {did_you_mean(name, STAGES)}")
    folder = cache_folder()
    if folder is None:
        raise InputError(
            "warmup: no folder for machine code can be written, so every process compiles anew; "
            "set MELTEMI_CACHE_DIR to one that can"
        )
    with ThreadPoolExecutor(max(1, workers or available_cores())) as pool:
        for future in as_completed([pool.submit(_process, name) for name in names]):
            done(future.result())
    return folder


def compile_beside(name: str) -> None:
    """Compile a stage in a second process while this one continues; with a single core, not at all."""
    if available_cores() > 1:
        _BESIDE.append(Popen(_command(name), stdout=DEVNULL, stderr=DEVNULL))


_BESIDE: list[Popen[bytes]] = []
"""Processes that compile for this one."""


def _command(name: str) -> list[str]:
    return [sys.executable, "-m", "meltemi.app.warmup", name]


def _process(name: str) -> Stage:
    began = time.perf_counter()
    ended = run(_command(name), capture_output=True, text=True)
    if ended.returncode:
        words = ended.stderr.strip().splitlines()
        raise MeltemiError(f"warmup: {name}: {words[-1] if words else f'exit status {ended.returncode}'}")
    return Stage(name, time.perf_counter() - began, **json.loads(ended.stdout))


def _machine(turbine: Any = "nrel5mw", **options: Any) -> tuple[Any, Any]:
    """A model and a wind; all turbines, winds and options, but for ``blade_model`` and
    ``electrical``, use the same machine code."""
    from meltemi.simulation.options import ModelOptions
    from meltemi.simulation.rotors import build
    from meltemi.turbine.library import load_turbine
    from meltemi.wind.fields import SteadyWind

    described = load_turbine(turbine) if isinstance(turbine, str) else turbine
    return build(described, ModelOptions(**options)), SteadyWind(speed=12.0)


def _runs() -> None:
    """Trim, time loops, built-in controllers and controllers in plain Python."""
    from meltemi.control.controller import Controller
    from meltemi.control_laws.load_control import LoadController
    from meltemi.postprocess.cycles import bin_cycles, rainflow_cycles
    from meltemi.simulation.simulate import simulate

    _march("pmsg20mw")
    model, wind = _machine()
    simulate(model, wind, duration=0.1)
    simulate(model, wind, duration=0.1, controller=LoadController(model.turbine))
    result = simulate(model, wind, duration=0.1, controller=Controller(lambda state, measurements, demands, dt: None))
    bin_cycles(rainflow_cycles(result["rotor_speed"]))


def _march(turbine: Any = "nrel5mw", **options: Any) -> None:
    """A short run."""
    from meltemi.simulation.simulate import simulate

    simulate(*_machine(turbine, **options), duration=0.1)


def _electrical() -> None:
    """Time loop of a turbine with an electrical system."""
    from meltemi.electrical.system import size_electrical
    from meltemi.turbine.library import load_turbine

    turbine = load_turbine("nrel5mw")
    law = turbine.control
    sized = size_electrical(rated_power=law.torque.rated_power, rated_speed=law.pitch.reference_speed)
    _march(turbine.replace(electrical=sized), electrical="averaged")


def _turbulence() -> None:
    """Turbulent wind fields."""
    from meltemi.turbine.library import load_turbine
    from meltemi.turbulence.field import generate_field
    from meltemi.wind.turbulent import TurbulentWind

    generate_field(TurbulentWind(speed=12.0, intensity=0.1, spectrum="mann", points=5), load_turbine("nrel5mw"), 1.0)


def _stepping() -> None:
    """Simulations advanced step by step by the user, and section loads of the output.

    Beside a first run, what that reaches late comes first: it then finds it compiled.
    """
    from meltemi.aero.rotor import loads, quasi_steady
    from meltemi.compiler import compile_for_kernels, float64, typeof
    from meltemi.control.constant import ConstantController
    from meltemi.control.faults import apply_events
    from meltemi.simulation.case import Case
    from meltemi.simulation.step import actuate, sense
    from meltemi.structure.chain import assemble

    case = Case(*_machine())
    m, c = typeof(case.system), typeof(case.control)
    late: Any = (loads, float64, m), (quasi_steady, float64, m), (assemble, float64, m), (actuate, float64, c, m)
    for function, *kinds in late:
        compile_for_kernels(function, *kinds)
    ConstantController()
    apply_events(0, 0, case.events, case.control.faults)
    sense(0.0, 0, case.control, case.system)
    case.loads(0.0)


def _derivatives() -> None:
    """Linear models and sensitivities, with dual numbers."""
    from meltemi.analyses.linear import linearise
    from meltemi.analysis import operating_point, sensitivity
    from meltemi.control.dual_updates import dual_entry
    from meltemi.control_laws.load_control import LoadController

    model, wind = _machine()
    start = operating_point(model, wind)
    linearise(model, start, azimuth=0.0)
    sensitivity(Run(model, wind, duration=0.1, start=start), ["pitch_offset"])
    dual_entry(LoadController(model.turbine))


def _gradients() -> None:
    """Gradients by the adjoint, for parameters of the turbine and of its controller."""
    from meltemi.analysis import gradient

    run = Run(*_machine(), duration=0.1)
    for parameter in ("pitch_offset", "controller.proportional_gain"):
        gradient(run, lambda result: (0.0, {}), [parameter])


STAGES: dict[str, Callable[[], None]] = {
    "derivatives": _derivatives,
    "gradients": _gradients,
    "runs": _runs,
    "modal blades": partial(_march, blade_model="modal"),
    "electrical": _electrical,
    "sea": partial(_march, "nrel5mw-monopile"),  # the sea is data
    "stepping": _stepping,
    "turbulence": _turbulence,
}
"""Stages by name, the longest first."""


if __name__ == "__main__":
    STAGES[sys.argv[1]]()
    signatures, compiled = statistics()
    print(json.dumps({"signatures": signatures, "compiled": compiled}))
