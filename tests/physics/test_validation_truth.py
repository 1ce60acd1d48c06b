"""A fit on measurements of a turbine whose parameters are known: intervals of 95 % contain them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meltemi.validation.comparison import Comparison
from meltemi.validation.fit import GAUGE_GAIN, GAUGE_ZERO, PRIORS, fitted, linear
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import Simulator, simulate_records
from simulated_measurement import FIELD, MACHINE, channel_map, load_case, measured

FLAP = "root_moment_flap_1"
MEAN_FLAP = 6e6
"""[N m] about its mean magnitude, for the prior of its zero."""
WIDTHS = {name: PRIORS[name] for name in ("pitch_offset", "drag", "air_density")}
WIDTHS |= {f"gauge_gain.{FLAP}": GAUGE_GAIN, f"gauge_zero.{FLAP}": GAUGE_ZERO * MEAN_FLAP}
SPEEDS = np.linspace(7.0, 16.0, 6)
"""[m/s] of the records of a turbine."""
LENGTH, SETS = 150.0, 4


def relative_errors(number: int) -> np.ndarray:
    """Estimate less truth over the half-width, of a turbine whose parameters are drawn from the priors."""
    settings = Validation(case="", channels=channel_map(), seeds=3, transient=30.0, turbulence=FIELD)
    simulator = Simulator.of(settings, load_case(), Path())
    truth = {
        name: s * x for (name, s), x in zip(WIDTHS.items(), np.random.default_rng(number).normal(size=5), strict=True)
    }
    records = [measured(simulator, v, 1000 * number + k, LENGTH, truth) for k, v in enumerate(SPEEDS, 1)]
    compared, failed = simulate_records(simulator, records, list(MACHINE))
    assert not failed
    prepared = [simulator.prepared(record, list(MACHINE)) for record in records]
    found = fitted(simulator, prepared, Comparison(tuple(compared), tuple(MACHINE)), list(WIDTHS))
    return (found.estimate - [*truth.values()]) / found.half


@pytest.mark.long
@pytest.mark.xfail(strict=True, reason="17 of these 20, 32 of 40 with sets 5 to 8: intervals of the fit are too narrow")
def test_intervals_contain_the_truth() -> None:
    errors = np.array([relative_errors(number) for number in range(1, SETS + 1)])
    assert np.sum(np.abs(errors) < 1.0) >= 19, errors


@pytest.mark.slow
@pytest.mark.parametrize(("name", "step"), [("drag", 2e-3), ("air_density", 1e-3), (f"gauge_gain.{FLAP}", 1e-3)])
def test_derivatives_hold_where_parameters_are_changed_already(name: str, step: float) -> None:
    """Derivatives hold the start, which a difference moves: above rated wind it is forgotten after 90 s, while at 8 m/s
    differences of mean moments vary by 4 % with their step."""
    settings = Validation(case="", channels=channel_map(), seeds=1, transient=90.0, turbulence=FIELD)
    simulator = Simulator.of(settings, load_case(), Path())
    record = measured(simulator, 14.0, 1, 30.0, {})
    prepared = [simulator.prepared(record, list(MACHINE))]
    low, at, high = (
        linear(simulator.at([name], [0.3 + change]), prepared, list(MACHINE), [name]) for change in (-step, 0.0, step)
    )
    difference = (high.values - low.values)[0, :, 0] / (2.0 * step)
    np.testing.assert_allclose(at.slopes[0, :, 0, 0], difference, rtol=0.02, atol=0.003 * np.abs(difference).max())
