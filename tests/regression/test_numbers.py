"""Our own numbers do not change unnoticed.

``numbers.json`` holds what this package gave when they were last looked at. A change that moves them on
purpose remakes the file and says so in CHANGELOG.md:

    python tests/regression/test_numbers.py
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import meltemi
from meltemi import ModelOptions, SteadyWind, simulate
from meltemi.wind.fields import Wind

FILE = Path(__file__).with_name("numbers.json")
CHANNELS = (
    "rotor_speed pitch_1 generator_power rotor_thrust root_moment_out_of_plane_1 root_moment_in_plane_1 "
    "tip_out_of_plane_1 tower_top_fore_aft tower_base_moment_fore_aft yaw_moment_z"
).split()
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


MAKERS: dict[str, Callable[[], dict[str, dict[str, float]]]] = {
    "steady": steady,
    "turbulent": turbulent,
    "turbulent, no torsion": partial(turbulent, torsion_modes=0),
    "turbulent, quasi-steady": partial(turbulent, inflow="quasi_steady", stall="static"),
    "parked": parked,
    "modes": modes,
}


@pytest.mark.parametrize("what", MAKERS)
def test_numbers_are_those_of_the_file(what: str) -> None:
    expected = json.loads(FILE.read_text(encoding="utf-8"))[what]
    found = MAKERS[what]()
    assert found.keys() == expected.keys()
    for name, numbers in expected.items():
        floor = max(TOLERANCE * numbers.pop("scale", 1.0), ROUNDING)
        for key, value in numbers.items():
            assert found[name][key] == pytest.approx(value, rel=TOLERANCE, abs=floor), (name, key)


if __name__ == "__main__":
    FILE.write_text(json.dumps({what: make() for what, make in MAKERS.items()}, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {FILE}")
