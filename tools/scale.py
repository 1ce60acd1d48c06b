"""Seconds, euros, memory and disk of a thousand to ten million cases of ten minutes, from what a few cases cost here.

    python tools/scale.py measure scale.json                     4 minutes of processor time; needs meltemi[loads,dask]
    python tools/scale.py page scale.json docs/guide/scale.md    writes the tables into the page
    python tools/scale.py sharing                                scatter over seeds, and over shifts of one field

Times are processor times: other programs on the machine change them little.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import meltemi
from meltemi.cuda.march import Image
from meltemi.loadcases.batch import CHUNK
from meltemi.loads.loadbase import engine, store
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.jobs import jobs_of
from meltemi.loads.loadbase.plan import Plan, plan
from meltemi.postprocess.files import write_netcdf
from meltemi.postprocess.summary import Summary, counted, summary
from meltemi.report.tables import markdown_table
from meltemi.simulation.simulate import march

SECONDS, SPEED, SIGMA = 600.0, 12.0, 1.92
BATCHES = (20, 100, 400)
"""Numbers of short cases of which the peak memory is measured."""
SHORT = (40, 200)
"""Numbers of short cases, whose difference gives the overhead of a case."""
CASES = (10**3, 10**4, 10**5, 10**6, 10**7)

# Assumptions [EUR/h], a dollar taken as a euro: 60 W of a laptop at 0.30 EUR/kWh; 0.085 a core, 3.06 $ for c5.18xlarge
# with 36 cores (example of the EC2 user guide, "Spot price per unit hour"); 2.50 to 3.50 $ for an H100
# (mercatus-ai.com/blog/cloud-gpu-pricing, May 2026). Read in November 2026.
LAPTOP, SERVER, CLUSTER = (8, 0.018), (64, 5.44), (1024, 87.0)
"""Cores and price."""
CARD_PRICE = 3.0
CARD_RATE = 1.0e6
"""Time steps a second on an H100, measured with groups of 8192 cases: docs/guide/graphics-cards.md."""


# measurements ---------------------------------------------------------------------------------------------


def timed(action: Callable[[], Any]) -> tuple[float, Any]:
    """[s] of processor time of this thread, and what the action returned."""
    began = time.thread_time()
    found = action()
    return time.thread_time() - began, found


def case_costs() -> dict[str, float]:
    """Parts of a case with the default channels."""
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine)
    wind = meltemi.TurbulentWind(speed=SPEED, intensity=SIGMA / SPEED, periodic=True)
    march(warm := meltemi.Simulation(meltemi.Run(model, wind, duration=1.0)))
    summary(warm.result()).equivalent_loads()
    found: dict[str, float] = {}
    found["point_s"], _ = timed(lambda: meltemi.operating_point(model, 13.37))
    found["field_s"], box = timed(lambda: meltemi.wind.generate_field(wind, turbine, SECONDS))
    meltemi.Simulation(meltemi.Run(model, box, duration=SECONDS))  # its operating point is then known
    found["prepare_s"], run = timed(lambda: meltemi.Simulation(meltemi.Run(model, box, duration=SECONDS)))
    found["march_s"], _ = timed(lambda: march(run))
    found["reduce_s"], _ = timed(lambda: summary(run.result()).equivalent_loads())
    with tempfile.TemporaryDirectory() as folder:
        found["file_s"], path = timed(lambda: write_netcdf(run.result(), Path(folder, "case.nc")))
        found["file_bytes"] = path.stat().st_size
    unit = meltemi.wind.unit_turbulence(box)
    unit.content_hash()

    def shared(begin: float) -> meltemi.Simulation:
        mean = meltemi.SteadyWind(speed=SPEED, shear_exponent=0.2)
        own = meltemi.wind.SharedTurbulence(mean, unit, SIGMA, begin)
        made = meltemi.Simulation(
            meltemi.Run(model, own, duration=SECONDS), numbers="floats" if begin else "lanes", held_steps=CHUNK
        )
        counted(made)
        return made

    shared(0.0)
    found["prepare_shared_s"], few = timed(lambda: shared(0.0))
    found["march_shared_s"], _ = timed(lambda: march(few))
    found["summary_s"], kept = timed(lambda: few.sink.summary(few.result(), few.output_step))
    one, two = (Image([shared(begin) for begin in range(1, 1 + n)]).content.nbytes for n in (1, 2))
    found |= {
        "steps": run.n_steps,
        "series_bytes": run.result().data.nbytes,
        "field_bytes": box.velocity.nbytes,
        "summary_bytes": kept.statistics.nbytes + kept.damages.nbytes,
        "card_bytes": two - one,
    }
    return found


def base_costs() -> dict[str, float]:
    """Of a load base: a case as it is stored, and the work of the engine with very short cases."""
    whole = plan(make_campaign("nrel5mw", "IB", duration=SECONDS))
    rows: list[Any] = []
    chosen = [job for job in jobs_of(whole) if job.cycles][:2]
    engine.OnThreads(workers=1)([chosen], rows.extend)
    with tempfile.TemporaryDirectory() as folder:
        size = store.write_file(store.table_of(rows), Path(folder)).stat().st_size
    found = {"base_bytes": size / len(rows), "base_reduce_s": min(row.reduction_seconds for row in rows)}
    brief = plan(make_campaign("nrel5mw", "IB", duration=2.0, transient=1.0))
    able = [case for case in brief.cases if case.type == "fatigue" and not case.unsupported]
    for name, dask in (("threads", None), ("dask", "local")):
        less, more = (engine_seconds(replace(brief, cases=tuple(able[:n])), dask) for n in SHORT)
        found[f"{name}_s"] = (more - less) / (SHORT[1] - SHORT[0])
    return found


def engine_seconds(few: Plan, dask: str | None) -> float:
    """[s] of this process to run a plan, without the cases themselves."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.process_time()
        engine.run_base(few, folder, dask=dask)
        spent, cases = time.process_time() - began, engine.base_table(few, folder)
    parts = cases[["wind_seconds", "simulation_seconds", "reduction_seconds"]]
    return spent - (0.0 if dask else float(parts.to_numpy().sum()))


def peak_memory(count: int) -> None:
    """Print the peak memory [bytes] of a batch of short cases, each with its own wind field."""
    model = meltemi.build(meltemi.load_turbine("nrel5mw"))
    runs = (
        meltemi.Run(model, meltemi.TurbulentWind(speed=SPEED, intensity=0.16, seed=seed), duration=2.0)
        for seed in range(count)
    )
    meltemi.simulate_batch(runs, series=False, done=lambda outcome: None)
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    print(1024 * int(line.split()[1]))  # resource.getrusage would count the parent process, too


def measure(file: Path) -> None:
    """Measure everything."""
    found: dict[str, Any] = case_costs()
    print(found, flush=True)
    found |= base_costs()
    words = [sys.executable, __file__, "memory"]
    found["peak_bytes"] = {
        str(n): int(subprocess.run([*words, str(n)], capture_output=True, text=True, check=True).stdout)
        for n in BATCHES
    }
    found |= {"date": time.strftime("%Y-%m-%d"), "cores": os.cpu_count(), "load": os.getloadavg()[0]}
    file.write_text(json.dumps(found, indent=1), encoding="utf-8")


LOADS = ("root_moment_out_of_plane_1", "tower_base_moment_fore_aft", "tower_base_moment_side_side", "rotor_torque")


def sharing(count: int = 12) -> None:
    """Print the scatter of equivalent loads over seeds, and over begins in one field."""
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine)

    def field(seed: int, duration: float = SECONDS) -> meltemi.WindBox:
        wind = meltemi.TurbulentWind(speed=SPEED, intensity=SIGMA / SPEED, seed=seed, periodic=True)
        return meltemi.wind.unit_turbulence(meltemi.wind.generate_field(wind, turbine, duration))

    def loads(winds: list[tuple[meltemi.WindBox, float]]) -> np.ndarray:
        mean = meltemi.SteadyWind(speed=SPEED, shear_exponent=0.2)
        shared = (meltemi.wind.SharedTurbulence(mean, box, SIGMA, begin) for box, begin in winds)
        runs = (
            meltemi.Run(model, wind, duration=SECONDS + 60.0, transient=60.0, channels=LOADS, name=f"{i}")
            for i, wind in enumerate(shared)
        )
        kept = meltemi.simulate_batch(runs, series=False, reduce=Summary.equivalent_loads)
        return np.array([[outcome.value[name] for name in LOADS] for outcome in kept])

    one, rng = field(100), np.random.default_rng(1)
    begins = rng.uniform(0.0, SPEED * SECONDS, count)
    print("channels:", *LOADS)
    for name, winds in (
        ("seeds", [(field(seed), 0.0) for seed in range(count)]),
        ("begins", [(one, begin) for begin in begins]),
    ):
        found = loads(winds)
        print(f"{name}: standard deviation [%]", np.round(100.0 * found.std(axis=0, ddof=1) / found.mean(axis=0), 1))


# tables ---------------------------------------------------------------------------------------------------


def span(seconds: float) -> str:
    """Seconds in the largest unit that fits."""
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def memory(size: float) -> str:
    """Bytes in the largest unit that fits."""
    for scale, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size:.0f} B"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join(markdown_table(head, rows))


def money(seconds: float, price: float) -> str:
    """Time and euros."""
    euros = seconds / 3600.0 * price
    shown = f"{euros:.0f}" if euros >= 10.0 else f"{euros:.2g}" if euros >= 0.01 else "under 0.01"
    return f"{span(seconds)}, {shown} €"


def blocks(m: dict[str, Any]) -> dict[str, str]:
    """Tables of the page by name."""
    case = m["field_s"] + m["point_s"] + m["prepare_s"] + m["march_s"] + m["reduce_s"]
    host = m["prepare_shared_s"] + m["summary_s"]
    parts = [
        ("wind field of its own", m["field_s"]),
        ("operating point, once for each mean wind, so for each field", m["point_s"]),
        ("preparation: arrays, checks, controller", m["prepare_s"]),
        ("preparation, turbulence shared", m["prepare_shared_s"]),
        ("600 s simulated", m["march_s"]),
        ("600 s simulated, turbulence shared, statistics and rainflow counted on the way", m["march_shared_s"]),
        ("statistics and equivalent loads of series", m["reduce_s"]),
        ("statistics and equivalent loads of a run without series", m["summary_s"]),
        ("statistics, cycles, extremes, durations of a load base", m["base_reduce_s"]),
        ("engine of a load base with threads", m["threads_s"]),
        ("scheduler and writing process of a load base with Dask", m["dask_s"]),
    ]
    machines = [
        ("laptop, 8 cores", case / LAPTOP[0], LAPTOP[1]),
        ("server, 64 cores, several processes", case / SERVER[0], SERVER[1]),
        ("16 servers, a shard each", case / CLUSTER[0], CLUSTER[1]),
        ("16 servers, one scheduler of Dask", max(case / CLUSTER[0], m["dask_s"]), CLUSTER[1]),
    ]
    machines.append(("one H100", max(m["steps"] / CARD_RATE, host), CARD_PRICE))
    rows = [[name, *(money(n * seconds, price) for n in CASES)] for name, seconds, price in machines]
    kept = [
        ("time series in files, 37 channels at 20 Hz", m["file_bytes"]),
        ("rows of a load base, cases of fatigue", m["base_bytes"]),
        ("summaries", m["summary_bytes"]),
    ]
    return {
        "parts": table(["part of a case", "processor time"], [[name, f"{1e3 * s:.3g} ms"] for name, s in parts]),
        "time": table(["", *(f"{n:,} cases" for n in CASES)], rows),
        "disk": table(
            ["kept", "a case", *(f"{n:,}" for n in CASES)],
            [[name, memory(size), *(memory(n * size) for n in CASES)] for name, size in kept],
        ),
        "memory": table(
            ["cases", *m["peak_bytes"]], [["peak memory", *(memory(size) for size in m["peak_bytes"].values())]]
        ),
        "facts": (
            f"Measured on {m['date']}, on two cores of a server that other programs used, too. A case takes\n"
            f"{case:.2f} s of a core. A wind field has {memory(m['field_bytes'])}, the series of a case in memory\n"
            f"{memory(m['series_bytes'])}, a run without series on a card {memory(m['card_bytes'])} besides its model."
        ),
    }


def page(file: Path, target: Path) -> None:
    """Replace what stands between the marks of a page."""
    text = target.read_text(encoding="utf-8")
    for name, block in blocks(json.loads(file.read_text(encoding="utf-8"))).items():
        begin, end = f"<!-- {name} -->\n", f"\n<!-- end of {name} -->"
        before, _, rest = text.partition(begin)
        text = before + begin + block + end + rest.partition(end)[2]
    target.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["measure", file]:
            measure(Path(file))
        case ["memory", count]:
            peak_memory(int(count))
        case ["sharing"]:
            sharing()
        case ["page", file, target]:
            page(Path(file), Path(target))
        case _:
            print(__doc__)
