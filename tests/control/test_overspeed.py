"""Overspeed limits of the supervisor: production in extreme turbulence at cut-out lies below, with a margin (C-69)."""

from __future__ import annotations

import pytest

import meltemi
from meltemi.loads.loadbase.campaign import NO_WIND
from meltemi.supervisor.settings import OVER_SPEED, TRIP_SPEED, Supervision
from meltemi.tuning.controller_bench.suite import BenchLimits

MARGIN = 1.2
"""On the largest excursion."""


def test_the_bench_judges_against_the_limit_of_the_supervisor() -> None:
    found = Supervision()
    assert (found.over_speed, found.trip_speed) == (OVER_SPEED, TRIP_SPEED) == (1.25, 1.3)
    assert BenchLimits().over_speed == found.over_speed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed"),
    [("nrel5mw", 2), *(pytest.param(name, 6, marks=pytest.mark.long) for name in ("iea15mw", "iea22mw"))],
)
def test_production_goes_on_in_extreme_turbulence(name: str, seed: int) -> None:
    """In the seed with the largest excursion of those of the theory's page."""
    if name.startswith("iea"):
        pytest.importorskip("windIO")
    turbine = meltemi.load_turbine(name)
    beyond = dict.fromkeys(("cut_out_mean", "cut_out_wind", "cut_out_gust"), NO_WIND)
    law = meltemi.control.SupervisedController(turbine, Supervision(stop_wind=0.0, **beyond))
    wind = meltemi.iec_wind("ETM", turbine=turbine, wind_class="IB", speed=turbine.cut_out, seed=seed)
    result = meltemi.simulate(
        meltemi.build(turbine), wind, duration=660.0, transient=60.0, controller=law, channels=["generator_speed"]
    )
    assert not [entry for entry in result.log if entry.what.endswith("stop")]
    excursion = result.evaluated["generator_speed"].max() / turbine.control.pitch.reference_speed - 1.0
    assert excursion > 0.14 and MARGIN * excursion < OVER_SPEED - 1.0
