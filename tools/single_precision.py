"""Errors of equivalent loads by evaluations in single precision, on the processor.

    python tools/single_precision.py [--turbine nrel5mw] [--speed 12] [--seeds 3] [--duration 600]

The time loop is compiled with the pass of ``device="cuda-single"``, which rounds what it computes to single precision.
"""

import argparse
import ctypes
from collections.abc import Callable

import llvmlite.binding as llvm
import numba
import numpy as np

import meltemi
from meltemi.compiler import OPTIONS, linked_code, loose
from meltemi.control.controller import of_vectors
from meltemi.cuda.single_precision import rounded
from meltemi.simulation import step
from meltemi.simulation.simulate import march

LOADS = ("RootMyc1", "RootMxc1", "TwrBsMyt", "TwrBsMxt", "YawBrMyp", "YawBrMzp", "RotTorq")


def rounded_march(sample: meltemi.Simulation) -> Callable[[meltemi.Simulation], meltemi.Result]:
    """A function that marches runs like ``sample``, in floats, in single precision."""
    loop, update = loose(step.advance), numba.njit(**OPTIONS)(of_vectors(sample.controller.update))

    def whole(n, controller, run, c, m, one, plain, sections):
        loop(n, controller, step.evaluate, step.observe, run, c, m, one, plain, sections)

    kinds = [numba.types.int64, numba.typeof(update), *map(numba.typeof, sample.loop.records)]
    code, name = linked_code(whole, kinds)
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(rounded(code)), machine)
    engine.finalize_object()
    pointers, numbers = ctypes.c_void_p, ctypes.c_int64
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int32, pointers, pointers, numbers, numbers, *[pointers] * len(sample.loop.records)
    )
    function = prototype(engine.get_function_address(name))
    results = np.zeros(8, dtype=np.int64)

    def marched(run: meltemi.Simulation, _: object = engine) -> meltemi.Result:
        at = results.ctypes.data
        assert function(at, at + 32, run.n_steps, 0, *(record.address for record in run.loop.records)) == 0
        return run.result()

    return marched


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turbine", default="nrel5mw")
    parser.add_argument("--speed", type=float, default=12.0, help="[m/s]")
    parser.add_argument("--intensity", type=float, default=0.16)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--duration", type=float, default=600.0, help="[s]")
    chosen = parser.parse_args()
    model = meltemi.build(meltemi.load_turbine(chosen.turbine))
    marched, errors = None, []
    for seed in range(1, chosen.seeds + 1):
        wind = meltemi.TurbulentWind(speed=chosen.speed, intensity=chosen.intensity, seed=seed)
        case = meltemi.Run(model, wind, duration=chosen.duration, channels=LOADS)
        exact, coarse = (meltemi.Simulation(case, numbers="floats") for _ in range(2))
        marched = marched or rounded_march(coarse)
        march(exact)
        a, b = (meltemi.equivalent_loads(result) for result in (exact.result(), marched(coarse)))
        errors.append([100.0 * (b[name] / a[name] - 1.0) for name in a])
    for name, each in zip(a, np.abs(errors).max(axis=0), strict=True):
        print(f"{name:30s} largest error of {chosen.seeds} seeds {each:.4f} %")


if __name__ == "__main__":
    main()
