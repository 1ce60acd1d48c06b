"""Measurements on a graphics card: agreement with the processor, steps a second over the number of runs.

    python tools/card_bench.py [--turbine nrel5mw] [--json FILE]      some 5 minutes; needs meltemi[cuda] and a card
    ncu --clock-control none --launch-skip 1 --launch-count 1 --kernel-name regex:march \\
        --metrics sm__sass_thread_inst_executed_op_dadd_pred_on.sum,sm__sass_thread_inst_executed_op_dmul_pred_on.sum,\\
sm__sass_thread_inst_executed_op_dfma_pred_on.sum,dram__bytes.sum,gpu__time_duration.sum \\
        python tools/card_bench.py --profile                          operations and bytes, for the roofline
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from numba import cuda

import meltemi
from meltemi.cuda import march as card
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march

SEEDS, COUNTS, STEPS = 8, (32, 256, 1024, 4096, 8192, 16384, 32768), 100
LIMIT = 400.0
"""[s] after which no further measurement begins."""


def runs_of(turbine: str, duration: float, output_step: float, count: int = SEEDS) -> list[Simulation]:
    """Runs of one model in turbulence of several seeds."""
    model = meltemi.build(meltemi.load_turbine(turbine))
    winds = [meltemi.TurbulentWind(speed=12.0, intensity=0.16, seed=seed) for seed in range(1, count + 1)]
    return [
        Simulation(Run(model, wind, duration=duration, output_step=output_step), numbers="floats") for wind in winds
    ]


def agreement(turbine: str) -> float:
    """Largest difference of any channel over 60 s, relative to its largest value."""
    (here,), (there,) = runs_of(turbine, 60.0, 0.05, 1), runs_of(turbine, 60.0, 0.05, 1)
    march(here)
    card.march_together([there])
    a, b = here.result().data, there.result().data
    return float(np.max(np.abs(a - b).max(axis=0) / np.maximum(np.abs(a).max(axis=0), 1e-12)))


def timed(runs: list[Simulation], registers: int | None, block: int, repeats: int = 3) -> dict[str, float]:
    """Time of launches of ``STEPS`` time steps, after one of warming up."""
    began = time.perf_counter()
    kernel, image = card.kernel_of(runs[0], registers), card.Image(runs)
    memory = cuda.to_device(image.content)
    words, counts = cuda.to_device(image.at(card.address(memory))), cuda.to_device(np.full(len(runs), STEPS))
    moved, seconds = time.perf_counter() - began, []
    for _ in range(repeats + 1):
        began = time.perf_counter()
        kernel[-(-len(runs) // block), block](counts, words)
        cuda.synchronize()
        seconds.append(time.perf_counter() - began)
    best, dt = min(seconds[1:]), runs[0].dt
    rate = len(runs) * STEPS / best
    return {
        "runs": len(runs),
        "block": block,
        "registers": next(iter(kernel.get_regs_per_thread().values())),
        "local_bytes": next(iter(kernel.get_local_mem_per_thread().values())),
        "bytes_a_run": image.content.nbytes / len(runs),
        "move_s": moved,
        "first_launch_s": seconds[0],
        "steps_a_second": rate,
        "times_real_time": rate * dt,
        "s_for_100000_runs_of_600_s": 1e5 * 600.0 / dt / rate,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turbine", default="nrel5mw")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--profile", action="store_true", help="two launches of 8192 runs, for ncu")
    chosen = parser.parse_args()
    card.check()
    began = time.perf_counter()
    seeds = runs_of(chosen.turbine, 60.0, 1.0)
    print(f"{cuda.get_current_device().name!r}: {len(seeds)} runs prepared in {time.perf_counter() - began:.0f} s")
    if chosen.profile:
        print(timed(seeds * 1024, None, card.BLOCK, repeats=1))
        return
    found = [{"largest_difference": agreement(chosen.turbine)}]
    print(found[0], flush=True)
    plan = [(n, None, 32) for n in COUNTS] + [(8192, None, 128), (8192, 128, 32), (16384, 128, 32), (32768, 128, 64)]
    for count, registers, block in plan:
        if time.perf_counter() - began > LIMIT:
            print(f"not measured for lack of time: {count} runs, {registers} registers, blocks of {block}")
            continue
        each = seeds * (count // len(seeds))
        found.append(timed(each, registers, block))
        print({name: float(f"{value:.4g}") for name, value in found[-1].items()}, flush=True)
        if chosen.json:
            chosen.json.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
