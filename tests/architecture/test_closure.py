"""What one must read to follow a simulation: the lines that it imports, and what must not be among them."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from meltemi.core.stores import CORE

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
simulate(build(load_turbine("nrel5mw")), SteadyWind(speed=12.0), duration=0.01, start=start)
"""
BY_REGISTRATION = (
    "aero.lifting_line control.supervisor core.representation electrical environment.drops environment.rain "
    "numbers.duals simulation.disk simulation.electric simulation.events simulation.flaps simulation.ice "
    "simulation.induction simulation.rain simulation.scene structure.gear_train turbine.electrical turbine.gearbox "
    "turbine.icing turbine.power_turbine wind.turbulence"
).split()
"""Modules of the core that a plain simulation reaches by registration only, as all that stands on the core."""


def imported(what: str) -> dict[str, int]:
    """Lines of the modules of meltemi that some statements import, by name."""
    found = subprocess.run(
        [sys.executable, "-c", MEASURE.format(what=what)],
        capture_output=True,
        text=True,
        check=True,
    )
    lines: dict[str, int] = json.loads(found.stdout)
    return lines


@pytest.mark.parametrize(("what", "most"), [(SIMULATE, 19_000), ("import meltemi.simulation.step", 9_000)])
def test_the_core_stays_small(what: str, most: int) -> None:
    lines = imported(what)
    aside = tuple(f"meltemi.{other}." for other in BY_REGISTRATION)
    core = ("meltemi.namespaces.", *(f"meltemi.{name}." for name in CORE))
    inside = [name for name in lines if name != "meltemi"]
    entered = [name for name in inside if f"{name}.".startswith(aside) or not f"{name}.".startswith(core)]
    assert not entered, f"imported, not reached by registration: {', '.join(entered)}"
    largest = sorted(lines, key=lambda name: -lines[name])
    shown = ", ".join(f"{name} {lines[name]}" for name in largest)
    assert sum(lines.values()) <= most, f"{sum(lines.values())} lines in {len(lines)} modules: {shown}"
