"""The default step resolves every mode: the time integration hardly changes their damping."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Environment, Model, ModelOptions, SteadyWind
from meltemi.analyses.modes import natural_modes
from meltemi.simulation.vibrations import derivative_matrix, time_step, vacuum_case

OPTIONS: list[dict[str, Any]] = [{}, {"locked": ("torsion",)}, {"torsion_modes": 0}, {"torsion_modes": 2}]


def stepped_modes(model: Model, h: float) -> tuple[Any, Any]:
    """Frequencies and damping ratios of the linearised machine as the scheme (M-2 to M-4) moves it with step ``h``."""
    case = vacuum_case(model)
    generator = model.rows.generator
    free = np.array([i for i in np.flatnonzero(case["locked"] == 0.0) if i != generator])
    case["locked"][generator] = 1.0
    K, D = (derivative_matrix(case, name)[np.ix_(free, free)] for name in ("q", "v"))
    n = len(free)
    one, none = np.eye(n), np.zeros((n, n))
    # rows of the state (q, v, a, a of the step before) after a step
    q = np.hstack([one, h * one, 0.5 * h * h * one, none])
    extrapolated = np.hstack([none, one, 1.5 * h * one, -0.5 * h * one])
    a = K @ q + D @ extrapolated
    v = np.hstack([none, one, 0.5 * h * one, none]) + 0.5 * h * a
    step = np.vstack([q, v, a, np.hstack([none, none, one, none])])
    value = np.log(np.linalg.eigvals(step).astype(complex)) / h
    value = value[(value.imag > 1e-3) & (value.imag < 0.9 * np.pi / h)]
    order = np.argsort(np.abs(value))
    return np.abs(value)[order], (-value.real / np.abs(value))[order]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_numerical_damping_is_small_against_that_of_every_mode(options: dict[str, Any]) -> None:
    model = meltemi.build(
        meltemi.load_turbine("nrel5mw"), ModelOptions(integration="explicit", **options), Environment(gravity=0.0)
    )
    h = time_step(model)
    modes = [mode for mode in natural_modes(model) if mode.damping < 0.5]
    frequency, damping = stepped_modes(model, h)
    for mode in modes:
        near = np.argmin(np.abs(frequency / mode.frequency - 1.0) + 5.0 * np.abs(damping - mode.damping))
        assert frequency[near] == pytest.approx(mode.frequency, rel=0.01), mode.participation()
        assert damping[near] == pytest.approx(mode.damping, rel=0.02), mode.participation()
    assert max(mode.frequency for mode in modes) * h < 0.4


def test_a_step_too_large_shows() -> None:
    """The same measure does see numerical damping where there is some."""
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), None, Environment(gravity=0.0))
    highest = max(natural_modes(model), key=lambda mode: mode.frequency)
    frequency, damping = stepped_modes(model, 0.8 / highest.frequency)
    near = np.argmin(np.abs(frequency / highest.frequency - 1.0))
    assert abs(damping[near] / highest.damping - 1.0) > 0.1


def test_the_highest_mode_of_a_blade_decays_as_it_should() -> None:
    """In the simulation itself: torsion of all blades, let go in vacuum."""
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(
        turbine, ModelOptions(locked=("tower", "yaw", "generator", "drivetrain")), Environment(gravity=0.0)
    ).with_parameters(**{"aerodynamics.air_density": 0.0})
    mode = min(
        (m for m in natural_modes(model) if "torsion" in m.participation(1)), key=lambda m: abs(m.damping - 0.005)
    )
    names = [name for name in model.coordinates if name.endswith("torsion")]
    result = meltemi.simulate(
        model,
        SteadyWind(speed=0.0),
        duration=4.0,
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(coordinates=dict.fromkeys(names, 1e-3)),
        channels=[f"q {names[0]}"],
        output_step=time_step(model),
    )
    x = result[f"q {names[0]}"]
    peaks = [i for i in range(1, len(x) - 1) if x[i - 1] < x[i] >= x[i + 1]]
    cycles = len(peaks) - 1
    decrement = np.log(x[peaks[0]] / x[peaks[-1]]) / cycles
    assert decrement / (2.0 * np.pi) == pytest.approx(mode.damping, rel=0.1)
