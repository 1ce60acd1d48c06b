"""Write ``docs/performance.md``: the figures of ``meltemi bench`` and of the parts beside this file.

Hours: ``python -m benchmarks.page``, or with another file as its argument.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.environments import environment_rows
from benchmarks.parts import FIELD_SECONDS, FIELD_STEP, FIELDS
from benchmarks.steps import needs
from meltemi.core.extras import skipped
from meltemi.core.files import write_text
from meltemi.verification.bench import benchmark, child

HERE = Path(__file__).parent
TEMPLATE = HERE / "performance.md"
OPENFAST = (
    ("as shipped, DT 0.00625 s", 4.0),
    ("as shipped, DT 0.0125 s", 6.6),
    ("dynamic inflow and dynamic stall, DT 0.01 s", 7.2),
    ("quasi-steady wake and static polars, DT 0.01 s", 8.2),
)
"""OpenFAST 5.0.0, the same turbine and controller: settings and times real time, by CPU time on one core."""
TURBSIM = "277 to 640 s for 31 x 31 points, u coherent"
"""TurbSim's time for such a field, by CPU time on one core; about a fifth of it if built with flush-to-zero."""


def measured(duration: float = 600.0) -> dict[str, Any]:
    """Figures of ``meltemi bench`` with these beside them.

    ``runs`` with load control and at sea, ``floats`` and ``derivatives`` (one node at a time, with eight derivatives),
    ``gradient`` (microseconds a step of a run, and of its adjoint), ``steps``, ``controllers``, ``environments``,
    ``fields`` (seconds and peak memory of making turbulence), ``beyond`` (seconds that compile on first use).
    """
    for words in skipped(needs()).values():
        print(words, flush=True)
    figures, short = benchmark(duration=duration, say=print), min(duration, 120.0)
    with tempfile.TemporaryDirectory(prefix="meltemi-bench-") as folder:

        def part(call: str, module: str = "parts") -> Any:
            print(call, "...", flush=True)
            return child(call, folder, f"benchmarks.{module}")

        return {
            **figures,
            "beyond": part("beyond()"),
            "runs": figures["runs"] | part(f"timed_runs({duration!r})"),
            **part(f"timed_derivatives({short!r})"),
            "steps": part(f"timed_steps({duration!r})", "steps"),
            "controllers": part(f"timed_controllers({short!r})"),
            "environments": part("timed_environments()", "environments"),
            "fields": {name: part(f"timed_field({name!r})") for name in FIELDS},
        }


def step_rows(figures: dict[str, Any]) -> list[tuple[str, str, dict[str, float]]]:
    return [(turbine, name, run) for turbine, ways in figures["steps"].items() for name, run in ways.items()]


def page(figures: dict[str, Any]) -> str:
    """The page of the documentation, from the figures of :func:`measured`."""
    f = figures
    one, eight = (f[name]["us_per_step"] for name in ("floats", "derivatives"))
    shown = {
        "runs": [
            f"| {name} | {run['time_step_s']:g} | {run['us_per_step']:.1f} | **{run['real_time_factor']:.0f}** |"
            for name, run in f["runs"].items()
        ],
        "steps": [
            f"| {turbine} | {name} | {1e3 * run['time_step_s']:.2f} | {run['us_per_step']:.1f} | "
            f"**{run['real_time_factor']:.0f}** | {100.0 * run['std']:.2f} | {100.0 * run['load']:.2f} |"
            for turbine, name, run in step_rows(f)
        ],
        "openfast": [f"| {name} | {factor:g} |" for name, factor in OPENFAST],
        "fields": [
            f"| {name} | **{field['seconds']:.2f}** | {field['peak_memory_mb']} |"
            for name, field in f["fields"].items()
        ],
        "environments": environment_rows(f["environments"]),
        "stages": [f"| {name} | {seconds:.1f} | {n} |" for name, (seconds, n) in f["stages"].items()],
        "beyond": [f"| {name} | {seconds:.1f} |" for name, seconds in f["beyond"].items()],
    }
    return TEMPLATE.read_text(encoding="utf-8").format(
        **f | {key: "\n".join(lines) for key, lines in shown.items()},
        turbsim=TURBSIM,
        field=f"{FIELD_SECONDS:g} s at {1.0 / FIELD_STEP:g} Hz, 12 m/s",
        faster=one / f["runs"]["one torsion mode a blade"]["us_per_step"],
        duals_ratio=eight / one,
        adjoint_ratios=[each / f["gradient"]["run"] for each in f["gradient"].values()],
        lost=100.0 * f["batch_loss"],
    )


if __name__ == "__main__":
    target = Path(sys.argv[1] if sys.argv[1:] else HERE.parent / "docs/performance.md")
    target.touch()  # hours before it is written
    write_text(target, page(measured()))
