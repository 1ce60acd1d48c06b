"""Our own numbers do not change unnoticed.

``numbers.json`` holds the results of one version of the physics. A change that moves them on purpose increases
``meltemi.core.physics.PHYSICS``, remakes the file and says so in CHANGELOG.md:

    python tests/regression/test_numbers.py

One instant of a moving turbine needs no compilation: ``NUMBA_DISABLE_JIT=1 pytest tests/regression -k instant``.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import ModelOptions, SteadyWind, simulate
from meltemi.compiler import View, members
from meltemi.core.physics import PHYSICS
from meltemi.simulation.case import Case
from meltemi.wind.fields import Wind

FILE = Path(__file__).with_name("numbers.json")
CHANNELS = (
    "rotor_speed pitch_1 generator_power rotor_thrust root_moment_out_of_plane_1 root_moment_in_plane_1 "
    "tip_out_of_plane_1 tower_top_fore_aft tower_base_moment_fore_aft yaw_moment_z"
).split()
AIR = ("inflow", "stall", "memory", "d_inflow", "d_stall")
"""States of the air and their rates."""
ROUNDING = 1e-15
"""In SI: the speed of a locked rotor is rounding error."""
TOLERANCE = 1e-8
"""Relative to the largest value of a series; another processor rounds otherwise."""


def steady() -> dict[str, dict[str, float]]:
    model = meltemi.build(meltemi.load_turbine("nrel5mw"))
    points = {f"{u:g} m/s": meltemi.operating_point(model, u) for u in (5.0, 8.0, 12.0, 18.0, 24.0)}
    return {name: {channel: point[channel] for channel in CHANNELS} for name, point in points.items()}


def run(wind: Wind, options: ModelOptions, **keywords: Any) -> dict[str, dict[str, float]]:
    turbine = meltemi.load_turbine("nrel5mw")
    result = simulate(meltemi.build(turbine, options), wind, duration=20.0, channels=CHANNELS, **keywords)
    series = {c: result[c] for c in CHANNELS}
    return {c: {"mean": x.mean(), "std": x.std(), "last": x[-1], "scale": abs(x).max()} for c, x in series.items()}


def turbulent(**options: Any) -> dict[str, dict[str, float]]:
    wind = meltemi.TurbulentWind(speed=12.0, intensity=0.14, seed=3)
    return run(wind, ModelOptions(**options))


def parked() -> dict[str, dict[str, float]]:
    wind = SteadyWind(speed=30.0, direction=0.5, shear_exponent=0.2)
    return run(
        wind,
        ModelOptions(locked=("generator",)),
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(pitch=1.5),
    )


def modes() -> dict[str, dict[str, float]]:
    found = meltemi.analysis.natural_modes(meltemi.build(meltemi.load_turbine("nrel5mw")))
    return {f"mode {i}": {"frequency": m.frequency, "damping": m.damping} for i, m in enumerate(found)}


def instant() -> dict[str, dict[str, float]]:
    """Every quantity of a turbine in motion, in wind of all kinds of shear: sums with decreasing weights over its
    entries, after steps of inflow and stall."""
    wind = SteadyWind(speed=13.0, direction=0.2, shear_exponent=0.14, veer=0.001, upflow=0.1)
    stations = meltemi.Stations(blade=(20.0, 41.0), tower=(15.0, 60.0))
    case = Case(meltemi.build(meltemi.load_turbine("nrel5mw")), wind, stations)
    n = len(case["q"])
    case["q"][:], case["v"][:] = 0.3 * np.sin(1.0 + np.arange(n)), 0.2 * np.cos(3.0 * np.arange(n))
    case["v"][case.model.coordinates.index("generator")] = 1.2
    case.view("pitch")["angle"], case.view("pitch")["rate"] = (0.1, 0.12, 0.08), 0.02
    for t in (0.0, 0.05):
        case.evaluate(t, t)
        case["q"][:] += 0.05 * case["v"]
    case.rates()
    case.loads(0.05)
    found = {"accelerations": {name: float(a) for name, a in zip(case.model.coordinates, case["a"], strict=True)}}
    tables = {
        **case.tables,
        **{name: member.table for name, member in members(type(case.system)).items() if name in AIR},
    }
    for name, table in tables.items():
        for row in table.names:
            x = np.ravel(View(table, case[name])[row])
            weights = 1.0 / (1.0 + np.arange(len(x)))
            scale = float(weights @ abs(x))
            if scale > 0.0 and row != "residual":
                found[f"{name}.{row}"] = {"sum": float(weights @ x), "scale": scale}
    return found


MAKERS: dict[str, Callable[[], dict[str, dict[str, float]]]] = {
    "steady": steady,
    "turbulent": turbulent,
    "turbulent, no torsion": partial(turbulent, torsion_modes=0),
    "turbulent, quasi-steady": partial(turbulent, inflow="quasi_steady", stall="static"),
    "parked": parked,
    "modes": modes,
    "instant": instant,
}


def moved(what: str, found: dict[str, dict[str, float]], stored: dict[str, Any]) -> list[str]:
    """Names of the numbers that differ from those of the file."""
    expected = stored.get(what, {})
    names = [name for name in found if name not in expected] + [name for name in expected if name not in found]
    for name in sorted(found.keys() & expected.keys()):
        floor = max(TOLERANCE * expected[name].get("scale", 1.0), ROUNDING)
        for key, value in expected[name].items():
            if key != "scale" and found[name][key] != pytest.approx(value, rel=TOLERANCE, abs=floor):
                names.append(f"{what}, {name}, {key}: {found[name][key]} instead of {value}")
    return names


@pytest.mark.parametrize("what", MAKERS)
def test_numbers_are_those_of_the_file(what: str) -> None:
    names = moved(what, MAKERS[what](), json.loads(FILE.read_text(encoding="utf-8")))
    assert not names, "\n".join([f"{len(names)} results moved", *names])


def test_the_file_is_of_this_version_of_the_physics() -> None:
    assert json.loads(FILE.read_text(encoding="utf-8"))["physics"] == PHYSICS


def remake() -> str:
    """Write the file, unless numbers moved under an unchanged version."""
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    found = {what: make() for what, make in MAKERS.items()}
    changed = [name for what, numbers in found.items() if what in stored for name in moved(what, numbers, stored)]
    if changed and stored["physics"] == PHYSICS:
        return "\n".join([*changed, f"{len(changed)} results moved: increase PHYSICS in meltemi/core/physics.py first"])
    FILE.write_text(json.dumps({"physics": PHYSICS, **found}, indent=1) + "\n", encoding="utf-8")
    return f"wrote {FILE}"


if __name__ == "__main__":
    print(remake())
