"""Where the time of a step goes, and how far it is from what a core could do.

``python -m benchmarks.roofline`` times longer and longer beginnings of an evaluation, and what the time loop adds, and
counts the floating-point operations of a step by running the same kernels in plain Python; it prints two tables.
"""

from __future__ import annotations

import dis
import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import Any

import numpy as np

from meltemi.compiler import loose
from meltemi.simulation import step
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.verification.bench import nrel5mw, turbulence

ELEMENTARY = 15
"""Operations that a square root, an exponential or a trigonometric function counts as."""
PARTS = {
    "motion of blades and tower": (step.motion,),
    "wind at the nodes": (step.series_now, step.tower_wind, step.relative_wind, step.disk_averages),
    "momentum balance": (step.induce,),
    "inflow, stall, loads": (step.loads, step.tower_load),
    "equations of motion": (step.collect_blades, step.assemble, step.implicit_terms),
    "accelerations": (step.accelerations,),
}
"""Kernels of an evaluation by part, in their order."""
CALLS = {
    step.motion: (), step.series_now: ("t",), step.tower_wind: ("t",), step.relative_wind: ("t",),
    step.disk_averages: (),
    step.induce: ("t",), step.loads: ("dt",), step.tower_load: (), step.collect_blades: (), step.assemble: ("dt",),
    step.implicit_terms: ("dt",), step.accelerations: (),
}  # fmt: skip
"""Their arguments before the record."""
REPEATS, EVALUATIONS = 7, 4000


def beginnings() -> dict[str, Callable[..., None]]:
    """Kernels ``(n, t, dt, m)`` that compute an evaluation up to and including each part, ``n`` times."""
    made: dict[str, Callable[..., None]] = {}
    kernels: list[Any] = []
    for name, added in PARTS.items():
        kernels += added
        lines = "".join(f"        f{i}({', '.join((*CALLS[f], 'm'))})\n" for i, f in enumerate(kernels))
        space: dict[str, Any] = {f"f{i}": f for i, f in enumerate(kernels)}
        exec(f"def beginning(n, t, dt, m):\n    for _ in range(n):\n{lines}", space)
        made[name] = loose(space["beginning"])
    return made


def least(work: Callable[[], Any]) -> float:
    """[s] of processor time of the fastest of several calls, the first left out."""
    work()
    times = []
    for _ in range(REPEATS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def microseconds() -> dict[str, float]:
    """[us] of a step by part: those of an evaluation, then the loop without outputs, and an output."""
    model, wind = nrel5mw(), turbulence(120.0)
    simulation = Simulation(Run(model, wind, duration=120.0))
    simulation.advance(600)
    case, dt, t = simulation.case, simulation.dt, 600 * simulation.dt
    found, before = {}, 0.0
    for name, beginning in beginnings().items():
        taken = 1e6 * least(lambda beginning=beginning: beginning(EVALUATIONS, t, 0.0, case.system)) / EVALUATIONS  # type: ignore[misc]
        found[name], before = taken - before, taken
    del dt
    found |= {"control, actuators, checks, prediction": 0.0, "output, 20 times a second": 0.0}
    rare, usual = (_step(model, wind, every) for every in (10.0, 0.05))
    found["control, actuators, checks, prediction"] = rare - before
    found["output, 20 times a second"] = usual - rare
    return found


def _step(model: Any, wind: Any, every: float) -> float:
    times = []
    for _ in range(REPEATS):
        simulation = Simulation(Run(model, wind, duration=120.0, output_step=every))
        began = time.process_time()
        march(simulation)
        times.append(1e6 * (time.process_time() - began) / simulation.n_steps)
    return min(times)


def operations() -> dict[str, int]:
    """Floating-point operations of one step by part, in a process that interprets the kernels."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    output = subprocess.run(
        [sys.executable, "-m", "benchmarks.roofline", "--count"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return dict(json.loads(output.splitlines()[-1]))


def counted() -> dict[str, int]:
    """The same, in this process: arithmetic of numbers, not of the vectors and records that do it by their methods."""
    from meltemi.wind.fields import SteadyWind

    simulation = Simulation(Run(nrel5mw(), SteadyWind(speed=12.0), duration=1.0), numbers="floats")
    simulation.advance(3)
    m, t, dt = simulation.case.system, simulation.dt * 3, simulation.dt
    found: Counter[str] = Counter()
    for name, kernels in PARTS.items():
        seen: Counter[str] = Counter()

        def trace(frame: FrameType, event: str, _: Any, seen: Counter[str] = seen) -> Any:
            frame.f_trace_opcodes = True
            if event == "call" and frame.f_code.co_name.startswith("__"):
                seen["methods"] += frame.f_code.co_name.strip("_") in METHODS
            if event == "opcode":
                instruction = OPCODES[frame.f_code].get(frame.f_lasti)
                seen[str(instruction)] += instruction is not None
            return trace

        def profile(_: FrameType, event: str, function: Any, seen: Counter[str] = seen) -> None:
            if event == "c_call" and getattr(function, "__module__", "") == "math":
                seen["elementary"] += 1

        sys.settrace(trace)
        sys.setprofile(profile)
        for each in kernels:
            each(*[{"t": t, "dt": dt}[word] for word in CALLS[each]], m)
        sys.settrace(None)
        sys.setprofile(None)
        found[name] = seen["arithmetic"] - seen["methods"] + ELEMENTARY * seen["elementary"]
    return dict(found)


METHODS = {"add", "sub", "mul", "truediv", "radd", "rsub", "rmul", "neg", "matmul", "iadd", "isub"}
"""Of vectors and rotations, whose operator is not one of numbers."""


class _Opcodes(dict[Any, dict[int, str]]):
    def __missing__(self, code: Any) -> dict[int, str]:
        names = ("BINARY_OP", "UNARY_NEGATIVE")
        self[code] = {i.offset: "arithmetic" for i in dis.get_instructions(code) if i.opname in names}
        return self[code]


OPCODES = _Opcodes()


def peak() -> float:
    """[operations/s] of one core in products of matrices that fit into its second-level cache."""
    from threadpoolctl import threadpool_limits

    A, n = np.random.default_rng(1).normal(size=(192, 192)), 192
    with threadpool_limits(1):
        seconds = least(lambda: [A @ A for _ in range(200)])
    return 200 * 2.0 * n**3 / seconds


def main() -> None:
    """Print both tables in Markdown."""
    taken, done, most = microseconds(), operations(), peak()
    print("| part of a step | µs | operations | billion a second |\n|---|---|---|---|")
    for name, each in taken.items():
        work = done.get(name)
        rate = f"{work:,} | {1e-3 * work / each:.1f}" if work else " | "
        print(f"| {name} | {each:.1f} | {rate} |")
    total, steps = sum(done.values()), sum(taken.values())
    print(f"| **together** | **{steps:.1f}** | {total:,} | {1e-3 * total / steps:.1f} |")
    print(f"\nProducts of matrices on the same core: {1e-9 * most:.0f} billion operations a second.")


if __name__ == "__main__":
    print(json.dumps(counted())) if "--count" in sys.argv else main()
