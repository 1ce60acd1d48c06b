"""Statistics of runs that keep no series: those of the series, in constant memory."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi.core.errors import InputError
from meltemi.loads import Summary, damage_sum, rainflow_cycles, summary
from meltemi.postprocess.counting import DEPTH, OpenCycles, count, damage_until_now
from meltemi.simulation.run import Run

MODEL = meltemi.build(meltemi.load_turbine("pmsg20mw"))
CHANNELS = ("azimuth", "rotor_speed", "rotor_torque", "generator_torque")


def run(**settings: object) -> Run:
    wind = meltemi.wind.eog(MODEL.turbine, 9.0, "IA", begin=10.0)
    return Run(MODEL, wind, **{"duration": 30.0, "transient": 3.02, "channels": CHANNELS, **settings})  # type: ignore[arg-type]


def test_online_rainflow_counting_is_that_of_whole_series() -> None:
    rng = np.random.default_rng(3)
    for series in (rng.standard_normal(400), np.round(np.cumsum(rng.standard_normal(400))), np.ones(5), np.arange(3.0)):
        x, points, spare = OpenCycles.of(slope=4.0), np.zeros(DEPTH), np.zeros(DEPTH)
        for n, value in enumerate(series):
            count(x, points, value)
            if n % 50 == 20 or n == len(series) - 1:
                expected = damage_sum(rainflow_cycles(series[: n + 1]), 4.0)
                assert damage_until_now(x, points, spare) == pytest.approx(expected, rel=1e-12)
        assert x.depth < DEPTH


def test_open_cycles_beyond_the_depth_count_as_half() -> None:
    """Growing ranges stay open; the oldest, which are the smallest, are given up first."""
    series = np.cumsum((-1.0) ** np.arange(400) * np.arange(400.0))
    x, points, spare = OpenCycles.of(slope=3.0), np.zeros(DEPTH), np.zeros(DEPTH)
    for value in np.concatenate([series[::-1], series]):
        count(x, points, value)
        assert x.depth < DEPTH
    assert damage_until_now(x, points, spare) > 0.9 * damage_sum(rainflow_cycles(series), 3.0)


def test_a_run_without_series_has_the_bits_of_one_with_them() -> None:
    (kept,) = meltemi.simulate_batch([run()])
    (counted,) = meltemi.simulate_batch([run()], series=False)
    a, b = summary(kept.value), counted.value
    np.testing.assert_array_equal(a.statistics, b.statistics)
    np.testing.assert_array_equal(a.damages, b.damages)
    assert (a.samples, a.duration, a.status, a.channels) == (b.samples, b.duration, b.status, b.channels)
    assert b.samples == len(kept.value.evaluated.time) and b.meta["turbine_hash"] == kept.value.meta["turbine_hash"]


def test_a_summary_agrees_with_the_evaluation_of_series() -> None:
    result = meltemi.simulate(**vars(run()))
    found, x = summary(result), result.evaluated.data
    rows = np.stack([x.mean(axis=0), x.std(axis=0), x.min(axis=0), x.max(axis=0)], axis=1)
    np.testing.assert_allclose(found.statistics, rows, rtol=1e-12)
    assert found["RotSpeed"]["max"] == result.evaluated["RotSpeed"].max()
    loads = meltemi.equivalent_loads(result, f_eq=0.5)
    assert found.equivalent_loads(f_eq=0.5) == pytest.approx(loads, rel=1e-10) and len(loads) == 2
    other = summary(result, {"rotor_speed": 5.0}).equivalent_loads()
    assert other["rotor_speed"] == pytest.approx(
        meltemi.equivalent_loads(result, slopes={"rotor_speed": 5.0})["rotor_speed"], rel=1e-10
    )
    assert "rotor_speed" in summary(result, {"rotor_speed": 5.0}).card().sections[0].rows[1]


def test_the_output_of_a_run_without_series_has_constant_length() -> None:
    seen = []

    def reduce(found: Summary) -> float:
        seen.append(found)
        return found.equivalent_loads()["rotor_torque"]

    (short,) = meltemi.simulate_batch([run(duration=16.0)], series=False, slopes={"RotSpeed": 3.0}, reduce=reduce)
    assert short.value > 0.0 and seen[0].slopes[1] == 3.0 and seen[0].meta["case"] == "case_0001"
    held = [meltemi.Simulation(run(duration=d), held_steps=500) for d in (30.0, 60.0)]
    assert len({each.loop.output.shape for each in held}) == 1


def test_what_needs_series_is_refused() -> None:
    with pytest.raises(InputError, match="out and series=False exclude each other"):
        meltemi.simulate_batch([run()], series=False, out="never")
    with pytest.raises(InputError, match="slopes are those of summaries"):
        meltemi.simulate_batch([run()], slopes={"RotSpeed": 3.0})
    (seen,) = meltemi.simulate_batch([run(view=True)], series=False)
    assert seen.message.startswith("view=True and series=False exclude each other")
    (named,) = meltemi.simulate_batch([run()], series=False, slopes={"RotSped": 3.0})
    assert "RotSpeed" in named.message
    (negative,) = meltemi.simulate_batch([run()], series=False, slopes={"RotSpeed": -3.0})
    assert negative.message == "slopes: that of 'rotor_speed' must be positive, found -3.0"
