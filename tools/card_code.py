"""Machine code of the time loop for a graphics card, without one: registers, spills and the mix of instructions.

    python tools/card_code.py [nrel5mw] [--registers 128] [--series] [--single]

Needs ``meltemi[cuda]``, whose packages contain NVIDIA's compiler and assembler.
"""

import argparse
import re
import subprocess
import tempfile
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import nvidia.cuda_nvcc
from numba.cuda import api, dispatcher

import meltemi
from meltemi.cuda import march as card
from meltemi.cuda import single_precision
from meltemi.loadcases.batch import CHUNK
from meltemi.postprocess.summary import counted
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation

ARITHMETIC = {"add", "sub", "mul", "fma", "div", "sqrt", "rcp", "neg", "abs", "min", "max"}
ARCHITECTURE = (9, 0)


def ptx_of(name: str, *, series: bool = False, single: bool = False) -> str:
    """The kernel of a turbine under its baseline controller in NVIDIA's intermediate code.

    Args:
      series: keep the series, in place of statistics and rainflow damage.
      single: evaluate in single precision.
    """
    for module in (api, dispatcher):  # functions of the card ask it for its architecture
        module.get_current_device = lambda: SimpleNamespace(compute_capability=ARCHITECTURE)
    case = Run(meltemi.build(meltemi.load_turbine(name)), 12.0, duration=1.0)
    run = Simulation(case, numbers="floats", held_steps=None if series else CHUNK)
    if not series:
        counted(run)
    kernel = card.kernel_of(run)
    from numba import cuda

    with single_precision.on_card() if single else nullcontext():
        return cuda.compile_ptx(kernel.py_func, card.SIGNATURE, cc=ARCHITECTURE, fastmath=False)[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("turbine", nargs="?", default="nrel5mw")
    parser.add_argument("--registers", type=int, default=255)
    parser.add_argument("--series", action="store_true", help="keep the time series in place of statistics")
    parser.add_argument("--single", action="store_true", help="evaluate in single precision")
    chosen = parser.parse_args()
    began = time.perf_counter()
    ptx = ptx_of(chosen.turbine, series=chosen.series, single=chosen.single)
    print(f"compiled in {time.perf_counter() - began:.0f} s")
    mix = Counter(re.findall(r"^\t(?:@!?%p\d+ )?([a-z]\w*(?:\.\w+)*)\s", ptx, re.MULTILINE))
    double, single = (
        sum(n for word, n in mix.items() if word.endswith(kind) and word.split(".")[0] in ARITHMETIC)
        for kind in (".f64", ".f32")
    )
    memory = sum(n for word, n in mix.items() if word.split(".")[0] in ("ld", "st") and ".param" not in word)
    print(f"{mix.total()} instructions: {double} float64 and {single} float32 arithmetic, {memory} loads and stores")
    print(mix.most_common(12))
    assembler = next(Path(next(iter(nvidia.cuda_nvcc.__path__))).rglob("bin/ptxas"))
    with tempfile.TemporaryDirectory() as folder:
        (file := Path(folder, "march.ptx")).write_text(ptx, encoding="utf-8")
        words = [assembler, "-v", "-arch=sm_90", f"-maxrregcount={chosen.registers}", file, "-o", "/dev/null"]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stderr
    print("\n".join(line for line in said.splitlines() if "bytes" in line or "registers" in line))


if __name__ == "__main__":
    main()
