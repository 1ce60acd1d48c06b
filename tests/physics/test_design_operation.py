"""Terms of the linear model in operation: against the commands that have the same numbers, and their derivatives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numba
import pytest

from meltemi import load_turbine
from meltemi.analyses.campbell import campbell
from meltemi.analyses.modes import natural_modes
from meltemi.core.yamlfile import validated
from meltemi.designs.derivatives import moved
from meltemi.designs.design import Teller, _Study
from meltemi.designs.settings import Design
from meltemi.designs.terms import of_turbine
from meltemi.tuning.platform_feedback import pitch_damping
from meltemi.tuning.speed_loop import speed_loops, speed_responses

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="linear models exist in compiled code only"),
]
TERMS = ("damping base pitch at 14", "damping 1st edge forward whirl at 14", "damping 1st tower side-side at 8",
         "sensitivity speed at 14", "sensitivity pitch at 14", "frequency base pitch", "mass moorings")  # fmt: skip


def study(**changes: Any) -> _Study:
    content = {
        "turbine": "iea15mw-volturnus",
        "variables": {"controller.motion_gain": {"low": -0.05, "high": 0.2, "start": 0.02},
                      "controller.filter_frequency": {"low": 0.3, "high": 3.0, "relative": True},
                      "tower.thickness": {"low": 0.7, "high": 1.3},
                      "turbine.platform.lines.*.length": {"low": 0.97, "high": 1.03}},
        "objective": {"mass tower": 1.0}, "constraints": {name: {"most": 1.0} for name in TERMS},
        "case": {"duration": 20.0, "wind": {"intensity": 0.1}}, "cases": [{"speed": 14.0}],
    }  # fmt: skip
    return _Study(validated(content | changes, Design, "design"), Path(), None, False, 1, Teller())


def test_values_are_those_of_the_commands_and_derivatives_those_of_differences() -> None:
    given = study()
    runs = given.runs
    x = runs.variables.start
    found = runs.statistics(x).of_turbine
    model = runs.model(x, runs.cases[0].case)
    law, linear = model.turbine.control, runs.operation.linear(x, 14.0)
    assert found["damping base pitch at 14"] == pytest.approx(pitch_damping(linear, law, 0.2), rel=1e-8)
    held = campbell(model, wind_speeds=[8.0, 14.0])
    edge, side = (held.labels.index(name) for name in ("1st edge forward whirl", "1st tower side-side"))
    # the law acts on the speed, and these modes hardly move it: pitch and torque are held in the diagram
    assert found["damping 1st edge forward whirl at 14"] == pytest.approx(held.damping[edge, 1], rel=0.01)
    assert found["damping 1st tower side-side at 8"] == pytest.approx(held.damping[side, 0], rel=0.01)
    still = study(variables={"controller.proportional_gain": {"low": 0.3, "high": 3.0, "relative": True}}).runs
    (loop,) = speed_loops(
        load_turbine("iea15mw-volturnus").control, [linear.point], speed_responses(model, [linear.point])
    )
    without = still.statistics(still.variables.start).of_turbine
    for name in ("sensitivity speed at 14", "sensitivity pitch at 14"):
        assert loop.sensitivity <= without[name] < 1.01 * loop.sensitivity
    slopes = given.derivatives._fixed(x) * runs.variables.scale
    rows = {t.name: slopes[i] for i, t in enumerate(runs.of_turbine)}
    assert rows["mass moorings"] == pytest.approx([0.0, 0.0, 0.0, 0.25 * 0.06 * found["mass moorings"]])
    for p in range(len(x)):
        h = 0.003 * runs.variables.scale[p]
        low, high = (runs.statistics(moved(x, p, sign * h)).of_turbine for sign in (-1.0, 1.0))
        for name, row in rows.items():
            difference = (high[name] - low[name]) / 0.006
            # steady operation is found to 1e-5
            assert row[p] == pytest.approx(difference, rel=2e-3, abs=1e-5 * abs(found[name])), (name, p)


def test_a_mode_keeps_its_name_where_the_blades_have_most_of_it() -> None:
    """With a wall 1.5 % thinner the blades have more of the tower's second mode than the tower itself."""
    runs = study(constraints={"frequency 1st tower fore-aft": {"most": 1.0}}).runs
    x, case = runs.variables.start, runs.cases[0].case
    (term,) = [t for t in runs.of_turbine if t.kind == "frequency"]
    thinner = runs.model(moved(x, 2, -0.0152), case)
    assert term.of not in {mode.name for mode in natural_modes(thinner)}
    assert of_turbine(term, thinner) == pytest.approx(of_turbine(term, runs.model(x, case)), rel=5e-3)
