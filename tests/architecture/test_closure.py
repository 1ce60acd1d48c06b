"""What one must read to follow a simulation: the lines that it imports, and what must not be among them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import meltemi
from meltemi.core.stores import CORE

PACKAGE = Path(meltemi.__file__).parent
MEASURE = """
import json, sys
from pathlib import Path
{what}
files = {{name: module.__file__ for name, module in sys.modules.items() if name.startswith("meltemi")}}
print(json.dumps({{name: len(Path(file).read_text("utf-8").splitlines()) for name, file in files.items()}}))
"""
SIMULATE = """
import meltemi
from meltemi import SteadyWind, Start, build, load_turbine, simulate
start = Start(rotor_speed=1.2, coordinates={})
simulate(build(load_turbine("nrel5mw")), SteadyWind(speed=12.0), duration=0.05, start=start)
"""
BATCH = """
import meltemi
from meltemi import Run, SteadyWind, build, load_turbine, simulate_batch
from meltemi.simulation.events import GridLoss
run = Run(build(load_turbine("nrel5mw")), SteadyWind(speed=12.0), duration=0.1, events=[GridLoss(at=0.05)])
assert all(outcome.status.complete for outcome in simulate_batch([run], workers=1))
"""
"""From an operating point that is searched for, with an event, in a batch."""
BY_REGISTRATION = (
    "aero.lifting_line compiler.duals environment.drops environment.rain simulation.disk simulation.flaps "
    "simulation.ice simulation.induction simulation.rain structure.gear_train turbine.gearbox "
    "turbine.icing turbine.power_turbine"
).split()
"""Modules of the core that a plain simulation reaches by registration only, as all that stands on the core."""
MOST_LINES = 25_500
"""Of all packages of the core, which one person holds."""


def imported(what: str) -> dict[str, int]:
    """Lines of the modules of meltemi that some statements import, by name."""
    found = subprocess.run(
        [sys.executable, "-c", MEASURE.format(what=what)],
        capture_output=True,
        text=True,
        check=True,
    )
    lines: dict[str, int] = json.loads(found.stdout.splitlines()[-1])
    return lines


@pytest.mark.parametrize(
    ("what", "most", "most_physics"),
    [
        pytest.param("import meltemi.simulation.step", 9_000, 5_700, id="step"),
        pytest.param(SIMULATE, 19_000, 15_500, id="simulate"),
        pytest.param(BATCH, 22_000, 18_000, id="batch"),
    ],
)
def test_the_core_stays_small(what: str, most: int, most_physics: int) -> None:
    lines = imported(what)
    aside = tuple(f"meltemi.{other}." for other in BY_REGISTRATION)
    core = ("meltemi.namespaces.", *(f"meltemi.{name}." for name in CORE))
    inside = [name for name in lines if name != "meltemi"]
    entered = [name for name in inside if f"{name}.".startswith(aside) or not f"{name}.".startswith(core)]
    assert not entered, f"imported, not reached by registration: {', '.join(entered)}"
    largest = sorted(lines, key=lambda name: -lines[name])
    shown = ", ".join(f"{name} {lines[name]}" for name in largest)
    assert sum(lines.values()) <= most, f"{sum(lines.values())} lines in {len(lines)} modules: {shown}"
    physics = sum(n for name, n in lines.items() if not name.startswith("meltemi.compiler"))
    assert physics <= most_physics, f"{physics} lines without the compiler layer: {shown}"


def test_the_packages_of_the_core_stay_small() -> None:
    lines = {
        name: sum(len(file.read_text(encoding="utf-8").splitlines()) for file in (PACKAGE / name).rglob("*.py"))
        for name in CORE
    }
    assert sum(lines.values()) <= MOST_LINES, f"{sum(lines.values())}: {lines}"
